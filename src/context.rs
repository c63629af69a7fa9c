//! Objects that live as long as the caller's device: function tables, allocator, samplers and pipelines.

use crate::device_features::DeviceFeatures;
use crate::gpu::{
    Bindings, ComputePipeline, Constant, ContextDesc, Device, PipelineInfo, RasterPipeline, RasterState, ShaderStruct,
};
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::{BTreeSet, HashMap};
use std::ffi::CStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Requirements of the library on a device.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// Smallest API version of instance and device.
    pub api_version: u32,
    /// Device extensions. The feature `pushDescriptor` of Vulkan 1.4 replaces the extension for push descriptors.
    pub extensions: &'static [&'static CStr],
    /// Features of Vulkan 1.0.
    pub features: vk::PhysicalDeviceFeatures,
    /// Names of the features of Vulkan 1.2 and 1.3.
    pub newer_features: &'static [&'static str],
}

/// Requirements of every technique, called the baseline. Techniques that need more list it in their registry entry,
/// [`crate::technique::Info::needs`], which `edgeshade list ID` prints. For these, make the device with the matching
/// [`DeviceFeatures`] and hand them to [`Context::new`].
pub fn requirements() -> Requirements {
    Requirements {
        api_version: vk::API_VERSION_1_3,
        extensions: &[ash::khr::push_descriptor::NAME],
        features: vk::PhysicalDeviceFeatures {
            shader_storage_image_extended_formats: vk::TRUE,
            shader_storage_image_write_without_format: vk::TRUE,
            ..Default::default()
        },
        newer_features: &["scalarBlockLayout", "synchronization2"],
    }
}

const VULKAN_1_4: u32 = vk::make_api_version(0, 1, 4, 0);

impl Requirements {
    /// Names of the requirements that `physical_device` lacks; empty if it meets all.
    ///
    /// # Safety
    /// `physical_device` belongs to `instance`, whose API version is at least 1.1.
    pub unsafe fn missing(&self, instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<String> {
        let mut missing = vec![];
        // SAFETY: guaranteed by the caller, here and below.
        let version = unsafe { instance.get_physical_device_properties(physical_device) }.api_version;
        if version < self.api_version {
            let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
            missing.push(format!("Vulkan 1.3 (it has {major}.{minor})"));
            return missing;
        }
        // SAFETY: as above.
        let extensions = unsafe { instance.enumerate_device_extension_properties(physical_device) }.unwrap_or_default();
        // The extension is part of Vulkan 1.4.
        let is_core = |name: &CStr| name == ash::khr::push_descriptor::NAME && version >= VULKAN_1_4;
        for needed in self.extensions.iter().filter(|name| !is_core(name)) {
            if !extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(needed)) {
                missing.push(format!("the extension {}", needed.to_string_lossy()));
            }
        }
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut has = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(physical_device, &mut has) };
        let core = has.features;
        let mut feature = |name: &str, present: vk::Bool32| {
            if present == vk::FALSE {
                missing.push(format!("the feature {name}"));
            }
        };
        feature("shaderStorageImageExtendedFormats", core.shader_storage_image_extended_formats);
        feature("shaderStorageImageWriteWithoutFormat", core.shader_storage_image_write_without_format);
        feature("scalarBlockLayout", v12.scalar_block_layout);
        feature("synchronization2", v13.synchronization2);
        missing
    }
}

/// Name of the shader, and its specialization constants.
type PipelineKey = (String, Vec<Constant>);

/// The library's side of a caller's device. It creates no queue and submits nothing.
///
/// When it and the techniques prepared with it are dropped, the GPU must be done with all frames recorded through it,
/// and the caller's device must still be alive.
pub struct Context {
    device: Arc<Device>,
    nearest: vk::Sampler,
    nearest_clamped: vk::Sampler,
    linear_clamped: vk::Sampler,
    pipelines: Mutex<HashMap<PipelineKey, Arc<ComputePipeline>>>,
    /// Raster pipelines by the debug text of their state, which contains every part of the state.
    raster_pipelines: Mutex<HashMap<String, Arc<RasterPipeline>>>,
    /// True once a raster pass was recorded. Later frames must then wait for the stages of raster passes.
    has_rastered: AtomicBool,
}

impl Context {
    /// Wraps the caller's device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] names what the physical device lacks, or what to enable when the device is made.
    /// [`Error::Allocation`] and [`Error::Vulkan`] come from the allocator and the samplers.
    ///
    /// # Safety
    /// The handles are valid and belong together. The device was created with the extensions and features that
    /// [`requirements`] and [`ContextDesc::features`] list. All of them outlive the context and everything made from
    /// it.
    pub unsafe fn new(desc: &ContextDesc<'_>) -> Result<Self> {
        // SAFETY: guaranteed by the caller.
        let missing = unsafe { requirements().missing(desc.instance, desc.physical_device) };
        if !missing.is_empty() {
            return Err(Error::NoDevice(format!("the device lacks {}", missing.join(", "))));
        }
        let allocator = match &desc.allocator {
            Some(allocator) => allocator.clone(),
            None => {
                let allocator = Allocator::new(&AllocatorCreateDesc {
                    instance: desc.instance.clone(),
                    device: desc.device.clone(),
                    physical_device: desc.physical_device,
                    debug_settings: Default::default(),
                    buffer_device_address: false,
                    allocation_sizes: Default::default(),
                })
                .map_err(|source| Error::Allocation { what: "the allocator".into(), source })?;
                Arc::new(Mutex::new(allocator))
            }
        };
        let device = Arc::new(Device::new(desc, allocator)?);
        // Texels outside a shadow map count as farther than everything, so the border has depth 1.
        let info = vk::SamplerCreateInfo::default()
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .border_color(vk::BorderColor::FLOAT_OPAQUE_WHITE);
        let nearest = device.sampler(&info, "nearest, white border")?;
        let clamped = vk::SamplerCreateInfo::default()
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
        let nearest_clamped = device.sampler(&clamped, "nearest, clamped").inspect_err(|_| {
            // SAFETY: the sampler has not been used yet.
            unsafe { device.raw.destroy_sampler(nearest, None) };
        })?;
        let linear = clamped
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .max_lod(vk::LOD_CLAMP_NONE);
        let linear_clamped = device.sampler(&linear, "linear, clamped").inspect_err(|_| {
            // SAFETY: nobody has them yet.
            unsafe {
                device.raw.destroy_sampler(nearest, None);
                device.raw.destroy_sampler(nearest_clamped, None);
            }
        })?;
        Ok(Self {
            device,
            nearest,
            nearest_clamped,
            linear_clamped,
            pipelines: Mutex::default(),
            raster_pipelines: Mutex::default(),
            has_rastered: AtomicBool::new(false),
        })
    }

    /// The device that everything made from this context shares.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Largest width or height that an image may have on this device, in pixels.
    pub fn largest_side(&self) -> u32 {
        self.device.limits.max_image_dimension2_d
    }

    /// Sampler with nearest filtering that returns 1 outside the image.
    pub fn nearest(&self) -> vk::Sampler {
        self.nearest
    }

    /// Sampler with nearest filtering that repeats the border texels outside the image.
    pub(crate) fn nearest_clamped(&self) -> vk::Sampler {
        self.nearest_clamped
    }

    /// Sampler that filters linearly within and between levels, and repeats the image's border outside. For formats that
    /// can be filtered.
    pub(crate) fn linear_clamped(&self) -> vk::Sampler {
        self.linear_clamped
    }

    /// Returns the compute pipeline of a shader with the given specialization constants, which binds the resources `B`
    /// and has the push constants `P`. It is made at the first call.
    ///
    /// # Errors
    /// Errors are those of [`ComputePipeline::new`].
    pub fn pipeline<B: Bindings, P: ShaderStruct>(
        &self,
        shader: &str,
        constants: &[Constant],
    ) -> Result<Arc<ComputePipeline>> {
        let key = (shader.to_owned(), constants.to_vec());
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&key) {
            pipeline.interface.check::<B, P>()?;
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(ComputePipeline::new::<B, P>(&self.device, shader, constants)?);
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    /// Returns the raster pipeline of a state, whose stages bind the resources `B` and have the push constants `P`. It
    /// is made at the first call.
    ///
    /// # Errors
    /// Errors are those of [`RasterPipeline::new`].
    pub fn raster_pipeline<B: Bindings, P: ShaderStruct>(
        &self,
        state: &RasterState<'_>,
    ) -> Result<Arc<RasterPipeline>> {
        let key = format!("{state:?}");
        let mut pipelines = self.raster_pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&key) {
            pipeline.interface.check::<B, P>()?;
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(RasterPipeline::new::<B, P>(&self.device, state)?);
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    /// Names of the shaders whose compute pipelines have been made so far.
    pub fn shaders(&self) -> BTreeSet<String> {
        let pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        pipelines.keys().map(|key| key.0.clone()).collect()
    }

    /// Describes the pipelines that were made so far, sorted by name. Statistics of their compiler are among it if the
    /// device was made with [`DeviceFeatures::executable_statistics`].
    ///
    /// # Errors
    /// [`Error::Vulkan`] comes from the driver.
    pub fn pipelines(&self) -> Result<Vec<PipelineInfo>> {
        let compute = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let raster = self.raster_pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let infos = compute.values().map(|p| p.info()).chain(raster.values().map(|p| p.info()));
        let mut infos = infos.collect::<Result<Vec<_>>>()?;
        infos.sort_by(|a, b| (&a.name, &a.constants).cmp(&(&b.name, &b.constants)));
        Ok(infos)
    }

    /// Forgets the pipelines that were made so far: they are made anew when they are next asked for. Techniques keep
    /// theirs. So [`Context::pipelines`] returns those of one technique, if it is prepared after this call.
    pub fn forget_pipelines(&self) {
        self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.raster_pipelines.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Optional features that the caller's device was made with.
    pub fn features(&self) -> DeviceFeatures {
        self.device.features
    }

    pub(crate) fn has_rastered(&self) -> bool {
        self.has_rastered.load(Ordering::Relaxed)
    }

    pub(crate) fn note_raster(&self) {
        self.has_rastered.store(true, Ordering::Relaxed);
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that the GPU is done with it.
        unsafe {
            self.device.raw.destroy_sampler(self.nearest, None);
            self.device.raw.destroy_sampler(self.nearest_clamped, None);
            self.device.raw.destroy_sampler(self.linear_clamped, None);
        }
    }
}
