//! A picture of the silhouette edges from the camera.

use super::silhouettes::{QUADS, Silhouettes};
use super::volumes::VolumeCamera;
use crate::frame::{Bound, RasterPass, Target};
use crate::gpu::{
    Buffer, BufferDesc, Image, ImageDesc, MemoryKind, RasterPipeline, RasterState, bindings, shader_struct,
};
use crate::technique::common::view::depth_error;
use crate::view::DepthRange;
use crate::{Bind, Context, Frame, Inputs, Result};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/caster_edges/silhouette.glsl`.
    pub struct SilhouetteViewPush {
        stride: u32,
        seen: u32,
        far_depth: f32,
        depth_error: f32,
    }
}

bindings! {
    struct ViewBindings { Positions, Cameras, Silhouettes, camera_depth }
}

/// The pass with its image, in RGBA8 with sRGB values; alpha is 0 where there is no edge. Folds are yellow, and the
/// rims of open surfaces cyan. Edges that are not outlines but count for shadow volumes are magenta. Edges that the
/// camera sees are bright; those behind a surface are dim. Needs [`crate::DeviceFeatures::dynamic_rendering`].
pub struct SilhouetteView {
    pipeline: Arc<RasterPipeline>,
    cameras: Buffer,
    image: Image,
}

impl SilhouetteView {
    /// Makes the pass for images of `extent` pixels.
    pub fn new(context: &Context, silhouettes: &Silhouettes, extent: [u32; 2]) -> Result<Self> {
        const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
        let instances = u64::from(silhouettes.casters().counts().instances.max(1));
        let cameras = BufferDesc {
            name: "cameras of the silhouettes' picture",
            size: instances * size_of::<VolumeCamera>() as u64,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryKind::Gpu,
        };
        Ok(Self {
            pipeline: context.raster_pipeline::<ViewBindings, SilhouetteViewPush>(&RasterState {
                name: "silhouettes, seen",
                vertex: "caster_edges/silhouette.vert",
                fragment: Some("caster_edges/silhouette.frag"),
                topology: vk::PrimitiveTopology::LINE_LIST,
                colors: &[FORMAT],
                ..RasterState::default()
            })?,
            cameras: Buffer::new(context.device(), &cameras)?,
            image: Image::new(context.device(), &ImageDesc::attachment("silhouettes, seen", FORMAT, extent))?,
        })
    }

    /// Draws the edges in the list of `silhouettes`. The inputs have a transform for each of its instances.
    pub fn record(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, silhouettes: &Silhouettes) -> Result<()> {
        let camera = inputs.camera;
        let cameras: Vec<_> = inputs.casters.iter().map(|m| VolumeCamera::new(camera, m, false)).collect();
        if !cameras.is_empty() {
            frame.update(&self.cameras, bytemuck::cast_slice(&cameras));
        }
        let bind = ViewBindings {
            Positions: silhouettes.casters().positions(),
            Cameras: Bind::Buffer(&self.cameras),
            Silhouettes: Bind::Buffer(silhouettes.edges()),
            camera_depth: Bind::Input(&inputs.depth),
        };
        let header = silhouettes.header();
        let pass = RasterPass {
            name: "silhouettes, seen",
            extent: self.image.extent(),
            colors: &[Target::color(&self.image, [0.0; 4])],
            depth: None,
            bound: &[Bound { pipeline: &self.pipeline, bind: &bind }],
            indirect: &[header],
        };
        frame.raster(&pass, |draw| {
            draw.bind(0)?;
            // Draws the hidden edges first, then the visible ones over them.
            for seen in [0, 1] {
                draw.push(bytemuck::bytes_of(&SilhouetteViewPush {
                    stride: silhouettes.casters().stride(),
                    seen,
                    far_depth: if camera.depth == DepthRange::Reversed { 0.0 } else { 1.0 },
                    depth_error: depth_error(inputs.depth.format, camera.depth).abs(),
                }))?;
                draw.indirect(header, QUADS)?;
            }
            Ok(())
        })
    }

    /// The picture.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.image.memory_bytes() + self.cameras.size()
    }
}
