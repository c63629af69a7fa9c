//! Picture: light, shadow, albedo and sky.

use super::{GBuffer, Light, LightShape, Scene};
use crate::gpu::{ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::host::Host;
use crate::technique::common::bindings::CameraBindings;
use crate::technique::common::view::ViewBuffer;
use crate::{Bind, Frame, ImageRef, Inputs, NormalEncoding, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

shader_struct! {
    /// Push constants of `glsl/common/shade.comp`.
    pub struct ShadePush {
        light_color: [f32; 3],
        ambient: f32,
        reference_distance: f32,
        cos_outer: f32,
        cos_inner: f32,
    }
}

/// Lighting of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadeOptions {
    /// Brightness of the key light.
    pub exposure: f32,
    /// Brightness of the sky's light.
    pub ambient: f32,
}

impl Default for ShadeOptions {
    fn default() -> Self {
        Self { exposure: 2.2, ambient: 0.55 }
    }
}

impl ShadePush {
    /// Returns the constants for a scene and a light.
    pub fn new(scene: &Scene, light: &Light, options: &ShadeOptions) -> Self {
        let (reference_distance, outer) = match light.shape {
            LightShape::Directional { .. } => (0.0, 0.0),
            LightShape::Spot { outer, .. } => {
                ((scene.bounds().center() - light.world_from_light.translation).length().max(f64::MIN_POSITIVE), outer)
            }
        };
        Self {
            light_color: light.color.map(|c| c * options.exposure),
            ambient: options.ambient,
            reference_distance: reference_distance as f32,
            cos_outer: outer.cos() as f32,
            // The two ends of a smoothstep must differ, however narrow the cone is.
            cos_inner: ((0.85 * outer).cos() as f32).max(outer.cos() as f32 + 1e-6),
        }
    }
}

bindings! {
    struct ShadeBindings { ..camera: CameraBindings, albedo, visibility, picture }
}

/// Shading pass with its picture.
pub struct Shade {
    pipeline: Arc<ComputePipeline>,
    view: ViewBuffer,
    picture: Image,
    push: ShadePush,
}

impl Shade {
    /// Allocates the pass for a scene and a light.
    pub fn new(host: &Host, size: [u32; 2], scene: &Scene, light: &Light, options: &ShadeOptions) -> Result<Self> {
        let context = host.context();
        let pipeline = context.pipeline::<ShadeBindings, ShadePush>("common/shade.comp", &[])?;
        let desc = ImageDesc::storage("picture", vk::Format::R8G8B8A8_UNORM, size);
        Ok(Self {
            pipeline,
            view: ViewBuffer::new(context.device())?,
            picture: Image::new(context.device(), &desc)?,
            push: ShadePush::new(scene, light, options),
        })
    }

    /// Shades every pixel with the given visibility.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        inputs: &Inputs<'_>,
        gbuffer: &GBuffer,
        visibility: &ImageRef,
    ) -> Result<()> {
        let shading = (gbuffer.shading_normal.as_ref(), NormalEncoding::OctahedralSigned);
        let inputs = Inputs { normal: Some(shading), ..*inputs };
        let view = self.view.update(frame, &inputs);
        let [width, height] = self.picture.extent();
        frame.dispatch(&Pass {
            name: "shade",
            pipeline: &self.pipeline,
            bind: &ShadeBindings {
                camera: CameraBindings::new(view, &inputs),
                albedo: Bind::Image(&gbuffer.albedo),
                visibility: Bind::Input(visibility),
                picture: Bind::Image(&self.picture),
            },
            push: bytemuck::bytes_of(&self.push),
            threads: Threads::Count([width, height, 1]),
        })
    }

    /// Returns the picture, in 8-bit sRGB codes.
    pub fn picture(&self) -> &Image {
        &self.picture
    }
}
