//! A small engine that embeds Edgeshade; `Engine::draw` shows everything that is needed.
//!
//! The engine owns the instance, the device, the queue, the command buffers, the depth buffer, the shadow map and all
//! synchronization between its passes. Edgeshade owns the visibility image and everything needed to make it. It
//! orders its own passes, both within a frame and from frame to frame.
//!
//! `EDGESHADE_BLESS=1 cargo test --test embed shaders` makes the SPIR-V next to the shaders. It calls
//! `glslangValidator -V --target-env vulkan1.3 -g0 -o scene.vert.spv scene.vert` and so on.
#![allow(clippy::undocumented_unsafe_blocks, reason = "the head of gpu.rs gives the argument for all")]

use crate::gpu::{Gpu, Messages, Result, State, Texture};
use crate::scene::{BOX, GROUND, MAP_SIZE, Moment};
use ash::vk::{self, AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique};
use edgeshade::timing::{FrameTiming, Timings};
use edgeshade::view::{CameraView, DepthRange, LightView};
use edgeshade::{Context, ContextDesc, Frame, Handoff, ImageRef, Inputs, NormalEncoding};
use glam::{DAffine3, DMat4};

pub const SHADERS: [(&str, &[u8]); 4] = [
    ("scene.vert", include_bytes!("scene.vert.spv")),
    ("normal.frag", include_bytes!("normal.frag.spv")),
    ("fullscreen.vert", include_bytes!("fullscreen.vert.spv")),
    ("light.frag", include_bytes!("light.frag.spv")),
];
const FRAMES_IN_FLIGHT: u32 = 2;
/// Number of cameras per frame (split screen); they share one light.
pub const VIEWS: usize = 2;
const NORMALS: vk::Format = vk::Format::R16G16_SFLOAT;
const PICTURE: vk::Format = vk::Format::R8G8B8A8_UNORM;

// Uses of the engine's images. Edgeshade reads its inputs in compute shaders.
const DEPTH_TESTS: Stage = Stage::from_raw(Stage::EARLY_FRAGMENT_TESTS.as_raw() | Stage::LATE_FRAGMENT_TESTS.as_raw());
const DEPTH_TARGET: State = (
    DEPTH_TESTS,
    Access::from_raw(Access::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | Access::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()),
    Layout::DEPTH_ATTACHMENT_OPTIMAL,
);
const COLOR_TARGET: State =
    (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_WRITE, Layout::COLOR_ATTACHMENT_OPTIMAL);
/// State of the depth buffer while Edgeshade and the engine's lighting read it.
const DEPTH_READ: State = (
    Stage::from_raw(Stage::COMPUTE_SHADER.as_raw() | Stage::FRAGMENT_SHADER.as_raw()),
    Access::SHADER_SAMPLED_READ,
    Layout::DEPTH_READ_ONLY_OPTIMAL,
);
/// State of images that only Edgeshade reads.
const SHADOW_INPUT: State = (Stage::COMPUTE_SHADER, Access::SHADER_SAMPLED_READ, Layout::SHADER_READ_ONLY_OPTIMAL);
const COPIED: State = (Stage::COPY, Access::TRANSFER_READ, Layout::TRANSFER_SRC_OPTIMAL);

/// State of an image about to be overwritten: its content may be lost, but its last readers must have finished.
fn discard(read: State) -> State {
    (read.0, Access::NONE, Layout::UNDEFINED)
}

pub struct Options<'a> {
    pub technique: &'a str,
    pub params: &'a [(&'a str, &'a str)],
    pub extent: [u32; 2],
    pub depth: DepthRange,
    /// Pass octahedral normals to Edgeshade. Otherwise it derives them from the depth buffer.
    pub normals: bool,
    /// Format of the shadow map: `D32_SFLOAT` or `D16_UNORM`.
    pub map_format: vk::Format,
    /// Record every third frame's visibility twice, and discard the first command buffer.
    pub throw_away: bool,
    /// Receiver of the validation layer's messages; `None` runs without the layer.
    pub validation: Option<Messages>,
}

/// Resources of one frame in flight. All frames share everything else, ordered by barriers.
struct Slot {
    cmd: vk::CommandBuffer,
    fence: vk::Fence,
    /// A picture for each view, and the buffer for reading it back.
    views: Vec<(Texture, (vk::Buffer, *const u8))>,
    /// Moments of the animation that the pictures being read back show.
    pending: Vec<Moment>,
}

/// Fields are dropped in this order: Edgeshade's objects before the device that they were made on.
pub struct Engine {
    shadows: Box<dyn Technique>,
    timings: Timings,
    context: Context,
    /// Times of all finished frames.
    pub times: Vec<FrameTiming>,

    extent: [u32; 2],
    depth: Texture,
    normals: Option<Texture>,
    shadow_map: Texture,
    /// Version of the light that the shadow map was last rendered for.
    map_version: Option<u64>,
    throw_away: bool,
    frame: u32,
    slots: Vec<Slot>,
    next: usize,
    scene_layout: vk::PipelineLayout,
    light_layout: vk::PipelineLayout,
    shadow_pass: vk::Pipeline,
    depth_pass: vk::Pipeline,
    light_pass: vk::Pipeline,
    light_set: vk::DescriptorSet,
    gpu: Gpu,
}

impl Engine {
    pub fn new(options: &Options<'_>) -> Result<Self> {
        let gpu = Gpu::new(options.validation.clone())?;
        let extent = options.extent;

        // Edgeshade: a context for the device, a technique for the sizes, and query pools for the times of its
        // passes.
        let context = context(&gpu)?;
        let info = technique::find(options.technique)?;
        let setup = Setup {
            extent,
            map_size: [MAP_SIZE; 2],
            output: OutputFormat::R8,
            params: Params::parse(info, options.params.iter().copied())?,
            intermediates: false,
            casters: None,
        };
        let shadows = technique::prepare(options.technique, &context, &setup)?;
        let timings = Timings::new(&context, gpu.family, FRAMES_IN_FLIGHT * VIEWS as u32)?;

        // The engine's own images. Edgeshade expects the shadow map as an array, here of one layer.
        let sampled_depth = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
        let sampled_color = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
        let (flat, array) = (vk::ImageViewType::TYPE_2D, vk::ImageViewType::TYPE_2D_ARRAY);
        let depth = gpu.texture(vk::Format::D32_SFLOAT, extent, sampled_depth, flat)?;
        let shadow_map = gpu.texture(options.map_format, [MAP_SIZE; 2], sampled_depth, array)?;
        let normals = if options.normals { Some(gpu.texture(NORMALS, extent, sampled_color, flat)?) } else { None };

        let mut slots = vec![];
        for (cmd, fence) in gpu.commands(FRAMES_IN_FLIGHT)? {
            let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
            let view = || -> Result<_> {
                let picture = gpu.texture(PICTURE, extent, usage, flat)?;
                Ok((picture, gpu.readback(4 * u64::from(extent[0] * extent[1]))?))
            };
            slots.push(Slot { cmd, fence, views: (0..VIEWS).map(|_| view()).collect::<Result<_>>()?, pending: vec![] });
        }

        // The visibility image stays the same as long as the technique lives, so one descriptor serves all frames, in
        // the layout that the hand-off states.
        let visibility = shadows.output().as_ref().view;
        let (set_layout, light_set) =
            gpu.image_set([(visibility, Handoff::FRAGMENT_SAMPLED.layout), (depth.view, DEPTH_READ.2)])?;

        let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
        let scene_layout = gpu.layout(vertex, size_of::<[[f32; 4]; 7]>() as u32, &[])?;
        let light_layout = gpu.layout(fragment, size_of::<f32>() as u32, &[set_layout])?;
        let [scene, normal, fullscreen, light] = SHADERS.map(|s| s.1);
        let nearer = if options.depth == DepthRange::Reversed { vk::CompareOp::GREATER } else { vk::CompareOp::LESS };
        let stages = [(vertex, scene), (fragment, normal)];
        let stages_used = if options.normals { &stages[..] } else { &stages[..1] };
        Ok(Self {
            shadow_pass: gpu.pipeline(
                scene_layout,
                &stages[..1],
                None,
                Some((options.map_format, vk::CompareOp::LESS)),
            )?,
            depth_pass: gpu.pipeline(
                scene_layout,
                stages_used,
                options.normals.then_some(NORMALS),
                Some((vk::Format::D32_SFLOAT, nearer)),
            )?,
            light_pass: gpu.pipeline(light_layout, &[(vertex, fullscreen), (fragment, light)], Some(PICTURE), None)?,
            scene_layout,
            light_layout,
            light_set,
            shadows,
            timings,
            context,
            times: vec![],
            extent,
            depth,
            normals,
            shadow_map,
            map_version: None,
            throw_away: options.throw_away,
            frame: 0,
            slots,
            next: 0,
            gpu,
        })
    }

    /// Records and submits a frame: one picture for each view, all at the same moment of the light. Returns the
    /// pictures of the frame that used this slot before, if they were read back.
    pub fn draw(&mut self, views: [Moment; VIEWS], read_back: bool) -> Result<Vec<(Moment, Vec<u8>)>> {
        let finished = self.wait(self.next)?;
        let Slot { cmd, fence, .. } = self.slots[self.next];
        unsafe {
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            self.gpu.device.begin_command_buffer(cmd, &begin)?;
            self.frame += 1;
            if self.throw_away && self.frame % 3 == 1 {
                // This stands for a window that closes in the meantime: the commands never run, and the engine tells
                // Edgeshade so.
                for now in &views {
                    self.draw_visibility(cmd, now)?;
                }
                self.shadows.reset();
                self.gpu.device.end_command_buffer(cmd)?;
                self.gpu.device.begin_command_buffer(cmd, &begin)?;
            }
            self.draw_shadow_map(cmd, &views[0]);
            for (i, now) in views.iter().enumerate() {
                self.draw_depth(cmd, now);
                self.draw_visibility(cmd, now)?;
                self.draw_light(cmd, now, i, read_back);
            }
            self.gpu.device.end_command_buffer(cmd)?;
            self.gpu.device.reset_fences(&[fence])?;
            let cmds = [cmd];
            self.gpu.device.queue_submit(self.gpu.queue, &[vk::SubmitInfo::default().command_buffers(&cmds)], fence)?;
        }
        self.slots[self.next].pending.extend(views.into_iter().filter(|_| read_back));
        self.next = (self.next + 1) % self.slots.len();
        Ok(finished)
    }

    /// Inputs that the engine states for one view of a frame.
    pub fn told(&self, now: &Moment) -> Told {
        let (depth, shadow_map) = (input(&self.depth, DEPTH_READ), input(&self.shadow_map, SHADOW_INPUT));
        Told { camera: now.camera, light: now.light, depth, shadow_map }
    }

    /// Records a frame from the given inputs and discards it. No other frame is in flight.
    pub fn attempt(&mut self, told: &Told) -> Result<()> {
        let inputs = Inputs {
            camera: &told.camera,
            depth: told.depth,
            normal: None,
            shadow_map: told.shadow_map,
            light: &[told.light],
            light_version: None,
            camera_version: None,
            casters: &[],
        };
        let cmd = self.slots[0].cmd;
        // SAFETY: the command buffer is recording and never runs.
        unsafe {
            self.gpu.device.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default())?;
            let mut frame = Frame::begin(&self.context, cmd, Handoff::FRAGMENT_SAMPLED, None);
            let outcome = self.shadows.record(&mut frame, &inputs);
            drop(frame);
            self.gpu.device.end_command_buffer(cmd)?;
            Ok(outcome.map(drop)?)
        }
    }

    /// Edgeshade's context and the engine's device.
    pub fn edgeshade(&self) -> (&Context, &Gpu) {
        (&self.context, &self.gpu)
    }

    /// Records Edgeshade's passes. Edgeshade reads the inputs as they are and synchronizes its own work, so the
    /// engine needs no barrier for the visibility image, neither before nor after.
    fn draw_visibility(&mut self, cmd: vk::CommandBuffer, now: &Moment) -> Result<()> {
        let normal = self.normals.as_ref().map(|n| (input(n, SHADOW_INPUT), NormalEncoding::OctahedralSigned));
        let inputs = Inputs {
            camera: &now.camera,
            depth: input(&self.depth, DEPTH_READ),
            normal,
            shadow_map: input(&self.shadow_map, SHADOW_INPUT),
            light: &[now.light],
            light_version: Some(now.light_version),
            camera_version: None,
            casters: &[],
        };
        // SAFETY: the command buffer is recording and submitted in order, and the images outlive it.
        let mut frame = unsafe { Frame::begin(&self.context, cmd, Handoff::FRAGMENT_SAMPLED, Some(&mut self.timings)) };
        self.shadows.record(&mut frame, &inputs)?;
        frame.finish(self.shadows.output());
        Ok(())
    }

    /// Draws the engine's shadow map if the light has moved. The barrier before the pass waits for Edgeshade's reads in
    /// the last frame. The barrier after the pass makes the map ready for Edgeshade's reads.
    fn draw_shadow_map(&mut self, cmd: vk::CommandBuffer, now: &Moment) {
        if self.map_version.replace(now.light_version) == Some(now.light_version) {
            return;
        }
        self.gpu.barriers(cmd, &[self.shadow_map.barrier(discard(SHADOW_INPUT), DEPTH_TARGET)]);
        self.gpu.render(cmd, None, Some((&self.shadow_map, 1.0)), |d| {
            self.draw_scene(d, cmd, self.shadow_pass, now.light.clip_from_view, now.light.world_from_view);
        });
        self.gpu.barriers(cmd, &[self.shadow_map.barrier(DEPTH_TARGET, SHADOW_INPUT)]);
    }

    /// Draws the engine's depth pre-pass, which may write normals, between the same two barriers.
    fn draw_depth(&self, cmd: vk::CommandBuffer, now: &Moment) {
        let mut before = vec![self.depth.barrier(discard(DEPTH_READ), DEPTH_TARGET)];
        let mut after = vec![self.depth.barrier(DEPTH_TARGET, DEPTH_READ)];
        if let Some(normals) = &self.normals {
            before.push(normals.barrier(discard(SHADOW_INPUT), COLOR_TARGET));
            after.push(normals.barrier(COLOR_TARGET, SHADOW_INPUT));
        }
        self.gpu.barriers(cmd, &before);
        self.gpu.render(cmd, self.normals.as_ref(), Some((&self.depth, far_depth(now))), |d| {
            self.draw_scene(d, cmd, self.depth_pass, now.camera.clip_from_view, now.camera.world_from_view);
        });
        self.gpu.barriers(cmd, &after);
    }

    /// Draws the engine's lighting, which samples the visibility image in a fragment shader.
    fn draw_light(&self, cmd: vk::CommandBuffer, now: &Moment, view: usize, read_back: bool) {
        let (picture, (buffer, _)) = &self.slots[self.next].views[view];
        self.gpu.barriers(cmd, &[picture.barrier(discard(COPIED), COLOR_TARGET)]);
        self.gpu.render(cmd, Some(picture), None, |d| unsafe {
            let (point, layout) = (vk::PipelineBindPoint::GRAPHICS, self.light_layout);
            d.cmd_bind_pipeline(cmd, point, self.light_pass);
            d.cmd_bind_descriptor_sets(cmd, point, layout, 0, &[self.light_set], &[]);
            d.cmd_push_constants(cmd, layout, vk::ShaderStageFlags::FRAGMENT, 0, &far_depth(now).to_ne_bytes());
            d.cmd_draw(cmd, 3, 1, 0, 0);
        });
        if read_back {
            self.gpu.barriers(cmd, &[picture.barrier(COLOR_TARGET, COPIED)]);
            self.gpu.copy_to_host(cmd, picture, *buffer);
        }
    }

    /// Waits for the frames still in flight and returns their pictures, oldest first.
    pub fn finish(&mut self) -> Result<Vec<(Moment, Vec<u8>)>> {
        let mut pictures = vec![];
        for i in 0..self.slots.len() {
            pictures.extend(self.wait((self.next + i) % self.slots.len())?);
        }
        Ok(pictures)
    }

    /// Waits for one frame only; the others stay in flight.
    fn wait(&mut self, slot: usize) -> Result<Vec<(Moment, Vec<u8>)>> {
        let slot = &mut self.slots[slot];
        unsafe { self.gpu.device.wait_for_fences(&[slot.fence], true, u64::MAX) }?;
        self.times.extend(self.timings.poll());
        let size = 4 * (self.extent[0] * self.extent[1]) as usize;
        // SAFETY: the memory is mapped as long as the engine lives, and the frame that wrote it has finished.
        let pixels = |mapped: *const u8| unsafe { std::slice::from_raw_parts(mapped, size) }.to_vec();
        let pending = slot.pending.drain(..).zip(&slot.views);
        Ok(pending.map(|(moment, (_, (_, mapped)))| (moment, pixels(*mapped))).collect())
    }

    fn draw_scene(&self, d: &ash::Device, cmd: vk::CommandBuffer, pass: vk::Pipeline, clip: DMat4, view: DAffine3) {
        let clip_from_world = (clip * view.inverse()).as_mat4();
        let [min, max] = BOX.map(|corner| corner.as_vec3().extend(0.0));
        let ground = glam::Vec4::splat(GROUND as f32);
        let push = [clip_from_world.x_axis, clip_from_world.y_axis, clip_from_world.z_axis, clip_from_world.w_axis];
        let push = [&push[..], &[min, max, ground]].concat();
        unsafe {
            d.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, pass);
            let bytes = bytemuck::cast_slice(&push);
            d.cmd_push_constants(cmd, self.scene_layout, vk::ShaderStageFlags::VERTEX, 0, bytes);
            d.cmd_draw(cmd, 42, 1, 0, 0);
        }
    }
}

/// Inputs that the engine states for one view of a frame.
#[derive(Clone, Copy)]
pub struct Told {
    pub camera: CameraView,
    pub light: LightView,
    pub depth: ImageRef,
    pub shadow_map: ImageRef,
}

/// Edgeshade's context for the engine's device.
pub fn context(gpu: &Gpu) -> edgeshade::Result<Context> {
    // SAFETY: the handles fit each other, have what `requirements` lists, and outlive the context.
    unsafe {
        Context::new(&ContextDesc {
            instance: &gpu.instance,
            physical_device: gpu.physical_device,
            device: &gpu.device,
            features: gpu.features,
            debug_utils: gpu.debug_utils,
            allocator: None,
            pipeline_cache: vk::PipelineCache::null(),
            keep_alive: None,
        })
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        // The only wait for the whole device: nothing may be destroyed while a frame is in flight.
        let _ = unsafe { self.gpu.device.device_wait_idle() };
    }
}

/// One of the engine's images as an input of Edgeshade, in the layout that the barriers above leave it in.
fn input(texture: &Texture, state: State) -> ImageRef {
    ImageRef {
        image: texture.image,
        view: texture.view,
        format: texture.format,
        extent: texture.extent,
        layers: 1,
        samples: vk::SampleCountFlags::TYPE_1,
        layout: state.2,
    }
}

/// Depth value that the depth pre-pass clears to.
fn far_depth(now: &Moment) -> f32 {
    if now.camera.depth == DepthRange::Reversed { 0.0 } else { 1.0 }
}
