//! The engine's own Vulkan code: instance, device, images, pipelines. Edgeshade does not depend on this file.
//!
//! One argument covers the unsafe blocks of this file and of `engine.rs` that have no comment of their own: they call
//! Vulkan with handles that this engine made from one device, and `Gpu` destroys these after the device is idle.
#![allow(clippy::undocumented_unsafe_blocks, reason = "the head of this file gives the argument for all")]

use ash::vk;
use edgeshade::DeviceFeatures;
use std::cell::RefCell;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

pub type Result<T, E = Box<dyn std::error::Error>> = std::result::Result<T, E>;
/// Warnings and errors of the validation layer.
pub type Messages = Arc<Mutex<Vec<String>>>;
/// Use of an image: stages, accesses, layout.
pub type State = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// Destroys an object that the engine made.
type Destroy = Box<dyn FnOnce(&ash::Device)>;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

pub struct Gpu {
    _entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub family: u32,
    /// Optional features for Edgeshade's techniques that the device was made with.
    pub features: DeviceFeatures,
    pub debug_utils: bool,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT, *const Mutex<Vec<String>>)>,
    at_exit: RefCell<Vec<Destroy>>,
}

pub struct Texture {
    pub image: vk::Image,
    pub view: vk::ImageView,
    pub format: vk::Format,
    pub extent: [u32; 2],
    pub aspect: vk::ImageAspectFlags,
}

impl Texture {
    pub fn barrier(&self, from: State, to: State) -> vk::ImageMemoryBarrier2<'static> {
        let range = vk::ImageSubresourceRange {
            aspect_mask: self.aspect,
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        };
        vk::ImageMemoryBarrier2::default()
            .image(self.image)
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .old_layout(from.2)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)
            .new_layout(to.2)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .subresource_range(range)
    }
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid struct; the pointer is the Arc that `Gpu` keeps alive.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map(CStr::to_string_lossy).unwrap_or_default();
        (text.into_owned(), &*messages.cast::<Mutex<Vec<String>>>())
    };
    messages.lock().unwrap().push(text);
    vk::FALSE
}

impl Gpu {
    /// Opens a device. With `messages` it runs under the validation layer with synchronization validation.
    pub fn new(messages: Option<Messages>) -> Result<Self> {
        Self::with_extensions(messages, edgeshade::requirements().extensions)
    }

    /// Does the same as [`Self::new`], but with these device extensions instead of those that Edgeshade needs.
    pub fn with_extensions(messages: Option<Messages>, extensions: &[&CStr]) -> Result<Self> {
        let device_extensions = extensions;
        unsafe {
            let entry = ash::Entry::load().map_err(|e| format!("no Vulkan loader: {e}"))?;
            let layers = entry.enumerate_instance_layer_properties()?;
            if messages.is_some() && !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION)) {
                return Err("VK_LAYER_KHRONOS_validation is not installed: run scripts/setup.sh, or on Debian \
                            and Ubuntu apt-get install vulkan-validationlayers"
                    .into());
            }
            let offered = entry.enumerate_instance_extension_properties(None)?;
            let debug_utils = offered.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME));
            let mut extensions = vec![];
            if debug_utils {
                extensions.push(ash::ext::debug_utils::NAME.as_ptr());
            }
            let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let mut info = vk::InstanceCreateInfo::default().application_info(&app);
            let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
            let layers = [VALIDATION.as_ptr()];
            let keep = messages.map(Arc::into_raw);
            use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
            use vk::DebugUtilsMessageTypeFlagsEXT as Kind;
            let listen = keep.map(|messages| {
                vk::DebugUtilsMessengerCreateInfoEXT::default()
                    .message_severity(Severity::WARNING | Severity::ERROR)
                    .message_type(Kind::GENERAL | Kind::VALIDATION | Kind::PERFORMANCE)
                    .pfn_user_callback(Some(on_message))
                    .user_data(messages.cast_mut().cast())
            });
            let mut listen_early = listen.unwrap_or_default();
            if listen.is_some() {
                extensions.push(ash::ext::validation_features::NAME.as_ptr());
                info = info.enabled_layer_names(&layers).push_next(&mut features).push_next(&mut listen_early);
            }
            let instance = entry.create_instance(&info.enabled_extension_names(&extensions), None)?;
            let messenger = match (listen, keep) {
                (Some(listen), Some(keep)) => {
                    let loader = ash::ext::debug_utils::Instance::new(&entry, &instance);
                    let messenger = loader.create_debug_utils_messenger(&listen, None)?;
                    Some((loader, messenger, keep))
                }
                _ => None,
            };

            // Edgeshade lists what it needs; the engine adds its own requirements.
            let needs = edgeshade::requirements();
            let mut problem = String::from("there is no Vulkan driver");
            let mut found = None;
            for physical_device in instance.enumerate_physical_devices()? {
                let missing = needs.missing(&instance, physical_device);
                let families = instance.get_physical_device_queue_family_properties(physical_device);
                let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
                match families.iter().position(|f| f.queue_flags.contains(wanted)) {
                    Some(family) if missing.is_empty() => {
                        found = found.or(Some((physical_device, family as u32)));
                    }
                    Some(_) => problem = format!("the device lacks {}", missing.join(", ")),
                    None => problem = "the device has no queue for both graphics and compute".into(),
                }
            }
            let (physical_device, family) = found.ok_or(problem)?;
            let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
                .scalar_block_layout(true)
                .separate_depth_stencil_layouts(true);
            let mut v13 = vk::PhysicalDeviceVulkan13Features::default().synchronization2(true).dynamic_rendering(true);
            // All features that some technique may use and the device has.
            let features = DeviceFeatures::of(&instance, physical_device);
            let mut core = needs.features;
            features.enable(&mut core, &mut v12, &mut v13);
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let extensions: Vec<_> = device_extensions.iter().map(|e| e.as_ptr()).collect();
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&core)
                .push_next(&mut v12)
                .push_next(&mut v13);
            let device = instance.create_device(physical_device, &info, None)?;
            let queue = device.get_device_queue(family, 0);
            let at_exit = RefCell::default();
            Ok(Self {
                _entry: entry,
                instance,
                physical_device,
                device,
                queue,
                family,
                features,
                debug_utils,
                messenger,
                at_exit,
            })
        }
    }

    /// Remembers how to destroy an object that was just made.
    pub fn at_exit(&self, destroy: impl FnOnce(&ash::Device) + 'static) {
        self.at_exit.borrow_mut().push(Box::new(destroy));
    }

    unsafe fn memory(&self, r: vk::MemoryRequirements, flags: vk::MemoryPropertyFlags) -> Result<vk::DeviceMemory> {
        let types = unsafe { self.instance.get_physical_device_memory_properties(self.physical_device) };
        let fits = |&i: &u32| {
            r.memory_type_bits & (1 << i) != 0 && types.memory_types[i as usize].property_flags.contains(flags)
        };
        let index = (0..types.memory_type_count).find(fits).ok_or("no fitting memory type")?;
        let info = vk::MemoryAllocateInfo::default().allocation_size(r.size).memory_type_index(index);
        let memory = unsafe { self.device.allocate_memory(&info, None) }?;
        self.at_exit(move |d| unsafe { d.free_memory(memory, None) });
        Ok(memory)
    }

    /// Creates an attachment; `view` is the type of its view.
    pub fn texture(
        &self,
        format: vk::Format,
        extent: [u32; 2],
        usage: vk::ImageUsageFlags,
        view: vk::ImageViewType,
    ) -> Result<Texture> {
        let is_depth = matches!(format, vk::Format::D32_SFLOAT | vk::Format::D16_UNORM);
        let aspect = if is_depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: extent[0], height: extent[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        unsafe {
            let image = self.device.create_image(&info, None)?;
            let requirements = self.device.get_image_memory_requirements(image);
            let memory = self.memory(requirements, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            self.device.bind_image_memory(image, memory, 0)?;
            let range = vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
            let info =
                vk::ImageViewCreateInfo::default().image(image).view_type(view).format(format).subresource_range(range);
            let view = self.device.create_image_view(&info, None)?;
            self.at_exit(move |d| {
                d.destroy_image_view(view, None);
                d.destroy_image(image, None);
            });
            Ok(Texture { image, view, format, extent, aspect })
        }
    }

    /// Creates a buffer for reading back, and maps it.
    pub fn readback(&self, size: u64) -> Result<(vk::Buffer, *const u8)> {
        let flags = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let info = vk::BufferCreateInfo::default().size(size).usage(vk::BufferUsageFlags::TRANSFER_DST);
        unsafe {
            let buffer = self.device.create_buffer(&info, None)?;
            let memory = self.memory(self.device.get_buffer_memory_requirements(buffer), flags)?;
            self.device.bind_buffer_memory(buffer, memory, 0)?;
            let mapped = self.device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())?;
            self.at_exit(move |d| d.destroy_buffer(buffer, None));
            Ok((buffer, mapped.cast()))
        }
    }

    /// Creates command buffers, each with a signalled fence.
    pub fn commands(&self, count: u32) -> Result<Vec<(vk::CommandBuffer, vk::Fence)>> {
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
            .queue_family_index(self.family);
        unsafe {
            let pool = self.device.create_command_pool(&pool, None)?;
            self.at_exit(move |d| d.destroy_command_pool(pool, None));
            let cmds = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(count);
            let mut commands = vec![];
            for cmd in self.device.allocate_command_buffers(&cmds)? {
                let info = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
                let fence = self.device.create_fence(&info, None)?;
                self.at_exit(move |d| d.destroy_fence(fence, None));
                commands.push((cmd, fence));
            }
            Ok(commands)
        }
    }

    /// Creates a descriptor set for two images that fragment shaders sample, with the layouts that they will have
    /// then.
    pub fn image_set(
        &self,
        images: [(vk::ImageView, vk::ImageLayout); 2],
    ) -> Result<(vk::DescriptorSetLayout, vk::DescriptorSet)> {
        let ty = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let bindings = [0, 1].map(|binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(ty)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        });
        let d = &self.device;
        unsafe {
            let sampler = d.create_sampler(&vk::SamplerCreateInfo::default(), None)?;
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let layouts = [d.create_descriptor_set_layout(&info, None)?];
            let sizes = [vk::DescriptorPoolSize { ty, descriptor_count: 2 }];
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool = d.create_descriptor_pool(&info, None)?;
            self.at_exit(move |d| {
                d.destroy_descriptor_pool(pool, None);
                d.destroy_descriptor_set_layout(layouts[0], None);
                d.destroy_sampler(sampler, None);
            });
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            let set = d.allocate_descriptor_sets(&info)?[0];
            let infos =
                images.map(|(image_view, image_layout)| vk::DescriptorImageInfo { sampler, image_view, image_layout });
            // One write covers consecutive bindings of one type.
            let write = vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(ty).image_info(&infos);
            d.update_descriptor_sets(&[write], &[]);
            Ok((layouts[0], set))
        }
    }

    pub fn layout(
        &self,
        stage: vk::ShaderStageFlags,
        push_bytes: u32,
        sets: &[vk::DescriptorSetLayout],
    ) -> Result<vk::PipelineLayout> {
        let ranges = [vk::PushConstantRange { stage_flags: stage, offset: 0, size: push_bytes }];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges).set_layouts(sets);
        let layout = unsafe { self.device.create_pipeline_layout(&info, None) }?;
        self.at_exit(move |d| unsafe { d.destroy_pipeline_layout(layout, None) });
        Ok(layout)
    }

    /// Creates a pipeline without vertex buffers, for dynamic rendering.
    pub fn pipeline(
        &self,
        layout: vk::PipelineLayout,
        shaders: &[(vk::ShaderStageFlags, &[u8])],
        color: Option<vk::Format>,
        depth: Option<(vk::Format, vk::CompareOp)>,
    ) -> Result<vk::Pipeline> {
        unsafe {
            let mut stages = vec![];
            for (stage, spirv) in shaders {
                let code = ash::util::read_spv(&mut std::io::Cursor::new(spirv))?;
                let info = vk::ShaderModuleCreateInfo::default().code(&code);
                let module = self.device.create_shader_module(&info, None)?;
                stages.push(vk::PipelineShaderStageCreateInfo::default().stage(*stage).module(module).name(c"main"));
            }
            let input = vk::PipelineVertexInputStateCreateInfo::default();
            let assembly =
                vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
            let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
            let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
            let samples =
                vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
            let depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default()
                .depth_test_enable(depth.is_some())
                .depth_write_enable(depth.is_some())
                .depth_compare_op(depth.map_or(vk::CompareOp::NEVER, |d| d.1));
            let colors: Vec<_> = color.into_iter().collect();
            let write =
                [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
            let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&write[..colors.len()]);
            let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
            let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
            let mut rendering = vk::PipelineRenderingCreateInfo::default()
                .color_attachment_formats(&colors)
                .depth_attachment_format(depth.map_or(vk::Format::UNDEFINED, |d| d.0));
            let info = vk::GraphicsPipelineCreateInfo::default()
                .stages(&stages)
                .vertex_input_state(&input)
                .input_assembly_state(&assembly)
                .viewport_state(&viewport)
                .rasterization_state(&raster)
                .multisample_state(&samples)
                .depth_stencil_state(&depth_stencil)
                .color_blend_state(&blend)
                .dynamic_state(&dynamic)
                .layout(layout)
                .push_next(&mut rendering);
            let made = self.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
            stages.iter().for_each(|s| self.device.destroy_shader_module(s.module, None));
            let pipeline = made.map_err(|(_, e)| e)?[0];
            self.at_exit(move |d| d.destroy_pipeline(pipeline, None));
            Ok(pipeline)
        }
    }

    pub fn barriers(&self, cmd: vk::CommandBuffer, barriers: &[vk::ImageMemoryBarrier2<'_>]) {
        let info = vk::DependencyInfo::default().image_memory_barriers(barriers);
        unsafe { self.device.cmd_pipeline_barrier2(cmd, &info) };
    }

    /// Records one pass over cleared targets in `COLOR_ATTACHMENT_OPTIMAL` and `DEPTH_ATTACHMENT_OPTIMAL`.
    pub fn render(
        &self,
        cmd: vk::CommandBuffer,
        color: Option<&Texture>,
        depth: Option<(&Texture, f32)>,
        draw: impl FnOnce(&ash::Device),
    ) {
        let target = |texture: &Texture, layout| {
            vk::RenderingAttachmentInfo::default()
                .image_view(texture.view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
        };
        let colors: Vec<_> = color.iter().map(|c| target(c, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)).collect();
        let depth_target = depth.map_or_else(Default::default, |(texture, clear)| {
            let depth_stencil = vk::ClearDepthStencilValue { depth: clear, stencil: 0 };
            target(texture, vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL).clear_value(vk::ClearValue { depth_stencil })
        });
        let [width, height] = color.or(depth.map(|d| d.0)).map_or([0; 2], |t| t.extent);
        let area = vk::Rect2D { extent: vk::Extent2D { width, height }, ..Default::default() };
        let viewport =
            vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth_target);
        unsafe {
            self.device.cmd_begin_rendering(cmd, &info);
            self.device.cmd_set_viewport(cmd, 0, &[viewport]);
            self.device.cmd_set_scissor(cmd, 0, &[area]);
            draw(&self.device);
            self.device.cmd_end_rendering(cmd);
        }
    }

    /// Copies a picture to a buffer that the CPU can read once the fence is signalled.
    pub fn copy_to_host(&self, cmd: vk::CommandBuffer, picture: &Texture, buffer: vk::Buffer) {
        let [width, height] = picture.extent;
        let layers = vk::ImageSubresourceLayers { aspect_mask: picture.aspect, layer_count: 1, ..Default::default() };
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        });
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        unsafe {
            self.device.cmd_copy_image_to_buffer(cmd, picture.image, layout, buffer, &[region]);
            self.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&to_host));
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        unsafe {
            self.at_exit.borrow_mut().drain(..).rev().for_each(|destroy| destroy(&self.device));
            self.device.destroy_device(None);
            if let Some((loader, messenger, _)) = &self.messenger {
                loader.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
            if let Some((.., messages)) = self.messenger {
                drop(Arc::from_raw(messages));
            }
        }
    }
}
