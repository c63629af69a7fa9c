//! Optional device features.

use ash::vk;

/// Features that the caller's device was made with beyond [`crate::requirements`]. Some techniques need them;
/// [`crate::technique::Info::needs`] lists which.
///
/// [`DeviceFeatures::of`] returns what a physical device offers, and [`DeviceFeatures::enable`] requests it;
/// [`executable_statistics`](Self::executable_statistics) is left to the caller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceFeatures {
    /// `dynamicRendering`, for raster passes.
    pub dynamic_rendering: bool,
    /// `depthClamp`.
    pub depth_clamp: bool,
    /// `geometryShader`.
    pub geometry_shader: bool,
    /// `shaderInt64` and `shaderBufferInt64Atomics`.
    pub int64_atomics: bool,
    /// `fragmentStoresAndAtomics`, for fragment shaders that write buffers.
    pub fragment_stores: bool,
    /// `pipelineStatisticsQuery`, for [`crate::timing::Timings::with_statistics`].
    pub pipeline_statistics: bool,
    /// `pipelineExecutableInfo` of the extension `VK_KHR_pipeline_executable_properties`: every pipeline is made with its
    /// compiler's statistics, which [`crate::Context::pipelines`] returns. It serves the study of shaders, and drivers may
    /// compile such pipelines anew instead of taking them from a cache. So [`DeviceFeatures::of`] leaves it off, and
    /// [`DeviceFeatures::enable`] does not turn it on: enable the extension and its feature yourself.
    pub executable_statistics: bool,
}

impl DeviceFeatures {
    /// Features that `physical_device` offers.
    ///
    /// # Safety
    /// `physical_device` belongs to `instance`, and both support at least Vulkan 1.3.
    pub unsafe fn of(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Self {
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut has = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: the caller guarantees that the device belongs to the instance.
        unsafe { instance.get_physical_device_features2(physical_device, &mut has) };
        let core = has.features;
        Self {
            dynamic_rendering: v13.dynamic_rendering == vk::TRUE,
            depth_clamp: core.depth_clamp == vk::TRUE,
            geometry_shader: core.geometry_shader == vk::TRUE,
            int64_atomics: core.shader_int64 == vk::TRUE && v12.shader_buffer_int64_atomics == vk::TRUE,
            fragment_stores: core.fragment_stores_and_atomics == vk::TRUE,
            pipeline_statistics: core.pipeline_statistics_query == vk::TRUE,
            executable_statistics: false,
        }
    }

    /// Turns these features on in the structs that a device is created from, and leaves all others as they are.
    pub fn enable(
        self,
        core: &mut vk::PhysicalDeviceFeatures,
        v12: &mut vk::PhysicalDeviceVulkan12Features<'_>,
        v13: &mut vk::PhysicalDeviceVulkan13Features<'_>,
    ) {
        let Self {
            dynamic_rendering,
            depth_clamp,
            geometry_shader,
            int64_atomics,
            fragment_stores,
            pipeline_statistics,
            executable_statistics: _,
        } = self;
        let set = |feature: &mut vk::Bool32, on: bool| *feature |= vk::Bool32::from(on);
        set(&mut v13.dynamic_rendering, dynamic_rendering);
        set(&mut core.depth_clamp, depth_clamp);
        set(&mut core.geometry_shader, geometry_shader);
        set(&mut core.shader_int64, int64_atomics);
        set(&mut v12.shader_buffer_int64_atomics, int64_atomics);
        set(&mut core.fragment_stores_and_atomics, fragment_stores);
        set(&mut core.pipeline_statistics_query, pipeline_statistics);
    }
}

/// A requirement of a technique beyond the baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The casters' geometry among the inputs.
    Casters,
    /// Raster passes.
    DynamicRendering,
    /// Depth that is clamped instead of clipped.
    DepthClamp,
    /// Geometry shaders.
    GeometryShader,
    /// 64-bit atomics on buffers.
    Int64Atomics,
    /// Fragment shaders that write buffers.
    FragmentStores,
}

impl Need {
    /// Description in words, with Vulkan's names of the features.
    pub fn text(self) -> &'static str {
        match self {
            Self::Casters => "the casters' geometry (Inputs::casters)",
            Self::DynamicRendering => "raster passes (dynamicRendering)",
            Self::DepthClamp => "clamped depth (depthClamp)",
            Self::GeometryShader => "geometry shaders (geometryShader)",
            Self::Int64Atomics => "64-bit atomics on buffers (shaderInt64, shaderBufferInt64Atomics)",
            Self::FragmentStores => "fragment shaders that write buffers (fragmentStoresAndAtomics)",
        }
    }

    /// True if a device with these features meets the requirement. Inputs are checked later, when they are given.
    pub fn is_met(self, device: DeviceFeatures) -> bool {
        match self {
            Self::Casters => true,
            Self::DynamicRendering => device.dynamic_rendering,
            Self::DepthClamp => device.depth_clamp,
            Self::GeometryShader => device.geometry_shader,
            Self::Int64Atomics => device.int64_atomics,
            Self::FragmentStores => device.fragment_stores,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_enabled_is_asked_for() {
        let all = DeviceFeatures {
            dynamic_rendering: true,
            depth_clamp: true,
            geometry_shader: true,
            int64_atomics: true,
            fragment_stores: true,
            pipeline_statistics: true,
            executable_statistics: true,
        };
        let (mut core, mut v12, mut v13) = Default::default();
        DeviceFeatures::default().enable(&mut core, &mut v12, &mut v13);
        assert_eq!((core.depth_clamp, v12.shader_buffer_int64_atomics, v13.dynamic_rendering), (0, 0, 0));
        all.enable(&mut core, &mut v12, &mut v13);
        let asked = [
            v13.dynamic_rendering,
            core.depth_clamp,
            core.geometry_shader,
            core.shader_int64,
            v12.shader_buffer_int64_atomics,
            core.fragment_stores_and_atomics,
            core.pipeline_statistics_query,
        ];
        assert_eq!(asked, [vk::TRUE; 7]);
        DeviceFeatures::default().enable(&mut core, &mut v12, &mut v13);
        assert_eq!(core.depth_clamp, vk::TRUE, "what the engine asked for itself stays");
    }

    #[test]
    fn needs_are_told_apart() {
        let needs =
            [Need::DynamicRendering, Need::DepthClamp, Need::GeometryShader, Need::Int64Atomics, Need::FragmentStores];
        for need in needs {
            assert!(!need.is_met(DeviceFeatures::default()), "{need:?}");
        }
        let one = DeviceFeatures { int64_atomics: true, ..DeviceFeatures::default() };
        let met: Vec<_> = needs.into_iter().filter(|n| n.is_met(one)).collect();
        assert_eq!(met, [Need::Int64Atomics]);
    }
}
