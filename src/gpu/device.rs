//! The caller's device, with the function tables and the allocator that all other objects share.

use crate::device_features::DeviceFeatures;
use crate::error::VkContext;
use crate::{Error, Result};
use ash::vk::{self, Handle};
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, Allocator};
use std::any::Any;
use std::ffi::{CStr, CString};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The caller's handles.
pub struct ContextDesc<'a> {
    /// The instance, made with an API version of at least 1.3.
    pub instance: &'a ash::Instance,
    /// The physical device of `device`.
    pub physical_device: vk::PhysicalDevice,
    /// The device, made with the extensions and features that [`crate::requirements`] lists.
    pub device: &'a ash::Device,
    /// Features that `device` was made with beyond those; `DeviceFeatures::default()` if there are none. Techniques
    /// that need other features are refused when they are prepared.
    pub features: DeviceFeatures,
    /// True if the instance has `VK_EXT_debug_utils`. Objects then get names and passes get labels.
    pub debug_utils: bool,
    /// Allocator for all memory. With `None`, the library makes one of its own.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// Pipeline cache for every pipeline; may be null.
    pub pipeline_cache: vk::PipelineCache,
    /// Owner of the device. It is dropped after everything made from the context, so that the device outlives these
    /// objects. With `None`, the caller must ensure this order.
    pub keep_alive: Option<Arc<dyn Any + Send + Sync>>,
}

/// The caller's device, shared by [`crate::Context`] and every object made from it. It is dropped with the last of
/// them.
pub struct Device {
    /// Function table of the caller's instance.
    pub instance: ash::Instance,
    /// The caller's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The caller's device.
    pub raw: ash::Device,
    pub(crate) push_descriptor_set: vk::PFN_vkCmdPushDescriptorSetKHR,
    pub(crate) debug_utils: Option<ash::ext::debug_utils::Device>,
    /// Present if pipelines are made with their compiler's statistics.
    pub(super) executables: Option<ash::khr::pipeline_executable_properties::Device>,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(crate) features: DeviceFeatures,
    device_type: vk::PhysicalDeviceType,
    has_memory: bool,
    /// Size of a subgroup in which compute shaders can shuffle values; 0 if they cannot.
    subgroup: u32,
    pub(crate) pipeline_cache: vk::PipelineCache,
    allocator: Arc<Mutex<Allocator>>,
    /// This field comes after the allocator, because fields are dropped in order and the allocator needs the device to
    /// free its memory.
    _keep_alive: Option<Arc<dyn Any + Send + Sync>>,
}

impl Device {
    /// # Errors
    /// [`Error::NoDevice`] if the device lacks a function that the library calls with the features in [`ContextDesc`].
    /// Otherwise, `ash` would abort the process at the first call.
    pub(crate) fn new(desc: &ContextDesc<'_>, allocator: Arc<Mutex<Allocator>>) -> Result<Self> {
        let ContextDesc { instance, physical_device, device, .. } = *desc;
        // SAFETY: the caller of `Context::new` guarantees that the handles are valid.
        let load = |name: &CStr| unsafe { instance.get_device_proc_addr(device.handle(), name.as_ptr()) };
        check_functions(load, desc.features, desc.debug_utils)?;
        let push_descriptor_set = push_descriptor_set(load)?;
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup);
        // SAFETY: the caller of `Context::new` guarantees that the handles are valid and that the version is 1.3.
        unsafe { instance.get_physical_device_properties2(physical_device, &mut properties) };
        let properties = properties.properties;
        let shuffles = subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
            && subgroup.supported_operations.contains(vk::SubgroupFeatureFlags::SHUFFLE);
        // SAFETY: as above.
        let memory = unsafe { instance.get_physical_device_memory_properties(physical_device) };
        #[cfg(feature = "app")]
        let _lists = crate::loader::look_up();
        Ok(Self {
            instance: instance.clone(),
            physical_device,
            raw: device.clone(),
            push_descriptor_set,
            debug_utils: desc.debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, device)),
            executables: (desc.features.executable_statistics)
                .then(|| ash::khr::pipeline_executable_properties::Device::new(instance, device)),
            limits: properties.limits,
            features: desc.features,
            device_type: properties.device_type,
            has_memory: memory.memory_type_count > 0,
            subgroup: if shuffles { subgroup.subgroup_size } else { 0 },
            pipeline_cache: desc.pipeline_cache,
            allocator,
            _keep_alive: desc.keep_alive.clone(),
        })
    }

    /// Gives a Vulkan object its debug name. Does nothing if the caller did not enable `VK_EXT_debug_utils`.
    pub fn name<T: Handle>(&self, handle: T, name: &str) {
        let Some(debug) = &self.debug_utils else { return };
        let name = CString::new(name.replace('\0', " ")).unwrap_or_default();
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        #[cfg(feature = "app")]
        let _lists = crate::loader::look_up();
        // SAFETY: the handle belongs to this device. If the call fails (out of host memory), only the name is lost.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    /// True for a driver that runs on the CPU, which has few threads, each of them fast.
    pub(crate) fn is_cpu(&self) -> bool {
        self.device_type == vk::PhysicalDeviceType::CPU
    }

    /// True if compute shaders have `subgroupShuffle`, in subgroups of at least so many threads. On a CPU driver a
    /// workgroup of so many threads is then one subgroup.
    pub(crate) fn shuffles(&self, threads: u32) -> bool {
        self.subgroup >= threads
    }

    /// False for hardware that is not there, such as RADV's null device. It only compiles: images and buffers are made
    /// without Vulkan objects, so that techniques can be prepared for the sake of their pipelines.
    pub(super) fn has_memory(&self) -> bool {
        self.has_memory
    }

    fn allocator(&self) -> MutexGuard<'_, Allocator> {
        // A panic elsewhere while the lock was held leaves the allocator's state intact.
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn allocate(&self, desc: &AllocationCreateDesc<'_>) -> Result<Allocation> {
        self.allocator().allocate(desc).map_err(|source| Error::Allocation { what: desc.name.into(), source })
    }

    pub(crate) fn free(&self, allocation: Allocation) {
        // Freeing fails only for an allocation from another allocator.
        let _ = self.allocator().free(allocation);
    }

    /// Features that a format supports with optimal tiling.
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: the instance and the physical device are the caller's and alive.
        unsafe { self.instance.get_physical_device_format_properties(self.physical_device, format) }
            .optimal_tiling_features
    }

    pub(crate) fn sampler(&self, info: &vk::SamplerCreateInfo<'_>, name: &str) -> Result<vk::Sampler> {
        // SAFETY: `info` is complete and without extension chain.
        let sampler = unsafe { self.raw.create_sampler(info, None) }.context(format!("vkCreateSampler({name})"))?;
        self.name(sampler, name);
        Ok(sampler)
    }
}

/// A Vulkan function as `vkGetDeviceProcAddr` returns it.
type Loaded = Option<unsafe extern "system" fn()>;

/// The function of the extension, or the same function of Vulkan 1.4.
fn push_descriptor_set(load: impl Fn(&CStr) -> Loaded) -> Result<vk::PFN_vkCmdPushDescriptorSetKHR> {
    let loaded = load(c"vkCmdPushDescriptorSetKHR").or_else(|| load(c"vkCmdPushDescriptorSet"));
    let loaded = loaded.ok_or_else(|| {
        Error::NoDevice(
            "the device has no vkCmdPushDescriptorSet: enable the extension VK_KHR_push_descriptor when you make it, or \
             the feature pushDescriptor of Vulkan 1.4"
                .into(),
        )
    })?;
    // SAFETY: both names are of functions of this type.
    Ok(unsafe { std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCmdPushDescriptorSetKHR>(loaded) })
}

/// Returns an error unless the device has the functions beyond Vulkan 1.0 that the library calls.
fn check_functions(load: impl Fn(&CStr) -> Loaded, features: DeviceFeatures, debug_utils: bool) -> Result<()> {
    let version = "make the instance with the API version 1.3 (VkApplicationInfo::apiVersion)";
    let debug = "enable VK_EXT_debug_utils when you make the instance, or set ContextDesc::debug_utils to false";
    let statistics = "enable VK_KHR_pipeline_executable_properties when you make the device, or set \
                      DeviceFeatures::executable_statistics to false";
    let wanted = [
        (true, c"vkCmdPipelineBarrier2", version),
        (true, c"vkCmdWriteTimestamp2", version),
        (features.dynamic_rendering, c"vkCmdBeginRendering", version),
        (debug_utils, c"vkSetDebugUtilsObjectNameEXT", debug),
        (debug_utils, c"vkCmdBeginDebugUtilsLabelEXT", debug),
        (features.executable_statistics, c"vkGetPipelineExecutablePropertiesKHR", statistics),
        (features.executable_statistics, c"vkGetPipelineExecutableStatisticsKHR", statistics),
    ];
    match wanted.into_iter().find(|(is_called, name, _)| *is_called && load(name).is_none()) {
        None => Ok(()),
        Some((_, name, remedy)) => {
            Err(Error::NoDevice(format!("the device has no {}: {remedy}", name.to_string_lossy())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    unsafe extern "system" fn of_extension() {}
    unsafe extern "system" fn of_core() {}

    /// Address of the function that is loaded on a device with these functions.
    fn loaded(names: &[(&CStr, unsafe extern "system" fn())]) -> Result<usize> {
        let find = |name: &CStr| names.iter().find(|n| n.0 == name).map(|n| n.1);
        push_descriptor_set(find).map(|f| f as usize)
    }

    #[test]
    fn functions_are_wanted_where_they_are_called() {
        let core = [c"vkCmdPipelineBarrier2", c"vkCmdWriteTimestamp2"];
        let load = |known: Vec<&'static CStr>| {
            move |name: &CStr| known.contains(&name).then_some(of_core as unsafe extern "system" fn())
        };
        let none = DeviceFeatures::default();
        let rendering = DeviceFeatures { dynamic_rendering: true, ..none };
        let statistics = DeviceFeatures { executable_statistics: true, ..none };
        assert!(check_functions(load(core.to_vec()), none, false).is_ok());
        for (known, features, debug, words) in [
            (&core[1..], none, false, "vkCmdPipelineBarrier2: make the instance with the API version 1.3"),
            (&core, rendering, false, "vkCmdBeginRendering: make the instance"),
            (&core, none, true, "vkSetDebugUtilsObjectNameEXT: enable VK_EXT_debug_utils"),
            (&core, statistics, false, "vkGetPipelineExecutablePropertiesKHR: enable VK_KHR_pipeline_executable_prop"),
        ] {
            let error = check_functions(load(known.to_vec()), features, debug).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn push_descriptors_come_from_the_extension_or_from_core() {
        let khr = (c"vkCmdPushDescriptorSetKHR", of_extension as unsafe extern "system" fn());
        let core = (c"vkCmdPushDescriptorSet", of_core as unsafe extern "system" fn());
        assert_eq!(loaded(&[core, khr]).unwrap(), of_extension as *const () as usize);
        assert_eq!(loaded(&[core]).unwrap(), of_core as *const () as usize);
        let error = loaded(&[]).unwrap_err().to_string();
        assert!(error.contains("VK_KHR_push_descriptor") && error.contains("Vulkan 1.4"), "{error}");
    }
}
