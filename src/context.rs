//! What lives as long as the caller's device: function tables, allocator, samplers, pipelines.

use crate::device_features::DeviceFeatures;
use crate::gpu::{Bindings, ComputePipeline, Constant, ContextDesc, Device, RasterPipeline, RasterState, ShaderStruct};
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::{BTreeSet, HashMap};
use std::ffi::CStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What the library needs of a device.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// Smallest API version of instance and device.
    pub api_version: u32,
    /// Device extensions. Of Vulkan 1.4 the feature `pushDescriptor` will do instead.
    pub extensions: &'static [&'static CStr],
    /// Features of Vulkan 1.0.
    pub features: vk::PhysicalDeviceFeatures,
    /// Names of the features of Vulkan 1.2 and 1.3.
    pub newer_features: &'static [&'static str],
}

/// What every technique needs: the baseline. Techniques that need more say so in their registry entry,
/// [`crate::technique::Info::needs`]; `edgeshade list ID` prints it. Make the device with the [`DeviceFeatures`] for it,
/// and hand these to [`Context::new`].
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
    /// What `physical_device` lacks, by name; empty if it has all.
    ///
    /// # Safety
    /// `physical_device` belongs to `instance`, whose API version is at least 1.1.
    pub unsafe fn missing(&self, instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<String> {
        let mut missing = vec![];
        // SAFETY: vouched for by the caller, here and below.
        let version = unsafe { instance.get_physical_device_properties(physical_device) }.api_version;
        if version < self.api_version {
            let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
            missing.push(format!("Vulkan 1.3 (it has {major}.{minor})"));
            return missing;
        }
        // SAFETY: as above.
        let extensions = unsafe { instance.enumerate_device_extension_properties(physical_device) }.unwrap_or_default();
        // Part of Vulkan 1.4.
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

/// Shader and specialization constants.
type PipelineKey = (String, Vec<Constant>);

/// The library's side of a caller's device. It creates no queue and submits nothing.
///
/// Dropping it (and every technique prepared with it) needs the GPU to be done with all frames
/// recorded through it, and the caller's device to be still alive.
pub struct Context {
    device: Arc<Device>,
    nearest: vk::Sampler,
    nearest_clamped: vk::Sampler,
    linear_clamped: vk::Sampler,
    pipelines: Mutex<HashMap<PipelineKey, Arc<ComputePipeline>>>,
    /// By the text of their state, which names every part of it.
    raster_pipelines: Mutex<HashMap<String, Arc<RasterPipeline>>>,
    /// A raster pass was recorded: later frames must wait for the stages of one.
    has_rastered: AtomicBool,
}

impl Context {
    /// Wraps the caller's device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] names what the physical device lacks, or what to enable when the device is made;
    /// [`Error::Allocation`] and [`Error::Vulkan`] are of the allocator and the samplers.
    ///
    /// # Safety
    /// The handles are valid and belong together, the device was created with what [`requirements`]
    /// and [`ContextDesc::features`] list, and all of it outlives the context and everything made from it.
    pub unsafe fn new(desc: &ContextDesc<'_>) -> Result<Self> {
        // SAFETY: vouched for by the caller.
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
        // Texels outside a shadow map count as farther than everything: a border of depth 1.
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
            // SAFETY: nobody has it yet.
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

    /// The shared device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Most pixels that an image of this device may have a side.
    pub fn largest_side(&self) -> u32 {
        self.device.limits.max_image_dimension2_d
    }

    /// Nearest filtering; outside the image 1.
    pub fn nearest(&self) -> vk::Sampler {
        self.nearest
    }

    /// Nearest filtering; outside the image its border goes on.
    pub(crate) fn nearest_clamped(&self) -> vk::Sampler {
        self.nearest_clamped
    }

    /// Linear filtering, also between levels; outside the image its border goes on. For formats that can be filtered.
    pub(crate) fn linear_clamped(&self) -> vk::Sampler {
        self.linear_clamped
    }

    /// The compute pipeline of a shader that binds `B`, with the given specialization constants, made once.
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

    /// The raster pipeline of a state, made once; its stages bind `B`, and all see the push constants `P`.
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

    /// Shaders of the compute pipelines that were made so far.
    pub fn shaders(&self) -> BTreeSet<String> {
        let pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        pipelines.keys().map(|key| key.0.clone()).collect()
    }

    /// What the caller's device was made with.
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
        // SAFETY: the owner vouches that the GPU is done with it.
        unsafe {
            self.device.raw.destroy_sampler(self.nearest, None);
            self.device.raw.destroy_sampler(self.nearest_clamped, None);
            self.device.raw.destroy_sampler(self.linear_clamped, None);
        }
    }
}
