//! Mistakes that an engine may make, each with Edgeshade's error, which names the input and the remedy.

use crate::engine::{self, Engine, Options, Told};
use crate::gpu::{Gpu, Result};
use crate::scene;
use ash::vk;
use edgeshade::casters::{CasterMesh, Casters, VertexBuffer, Vertices};
use edgeshade::view::{DepthRange, LightKind};
use glam::{DMat3, DMat4, dvec4};

/// A mistake in the inputs of a frame: its description, and the change that makes it.
type Mistake = (&'static str, fn(&mut Told));

const IN_A_FRAME: &[Mistake] = &[
    ("a colour image as the camera's depth", |t| t.depth.format = vk::Format::R8G8B8A8_UNORM),
    ("a colour image as the shadow map", |t| t.shadow_map.format = vk::Format::R8G8B8A8_UNORM),
    ("a multisampled depth buffer", |t| t.depth.samples = vk::SampleCountFlags::TYPE_4),
    ("a multisampled shadow map", |t| t.shadow_map.samples = vk::SampleCountFlags::TYPE_2),
    ("a depth buffer of another size than prepared for", |t| t.depth.extent[0] /= 2),
    ("a shadow map of another size than prepared for", |t| t.shadow_map.extent[0] *= 2),
    ("a shadow map in a layout that nothing can be read in", |t| t.shadow_map.layout = vk::ImageLayout::UNDEFINED),
    ("a reversed-Z shadow map, stated as such", |t| {
        t.light.depth = DepthRange::Reversed;
        t.light.clip_from_view = reversed(t.light.clip_from_view);
    }),
    ("a reversed-Z shadow map, stated as standard", |t| t.light.clip_from_view = reversed(t.light.clip_from_view)),
    ("a standard shadow map, stated as reversed", |t| t.light.depth = DepthRange::Reversed),
    ("a camera of the other depth range than stated", |t| t.camera.clip_from_view = reversed(t.camera.clip_from_view)),
    ("a directional light with a perspective projection", |t| t.light.kind = LightKind::Directional { angle: 0.01 }),
    ("a light matrix with a NaN", |t| t.light.clip_from_view.x_axis.x = f64::NAN),
    ("a light matrix with an infinity", |t| t.light.clip_from_view.w_axis.z = f64::NEG_INFINITY),
    ("a light matrix of zeros", |t| t.light.clip_from_view = DMat4::ZERO),
    ("a light matrix without inverse", |t| t.light.clip_from_view.y_axis.y = 0.0),
    ("a light that stands at NaN", |t| t.light.world_from_view.translation.y = f64::NAN),
    ("a light with a scale in its transform", |t| t.light.world_from_view.matrix3 *= 2.0),
    ("a camera matrix with a NaN", |t| t.camera.clip_from_view.x_axis.x = f64::NAN),
    ("a camera matrix of zeros", |t| t.camera.clip_from_view = DMat4::ZERO),
    ("a camera whose transform is zero", |t| t.camera.world_from_view.matrix3 = DMat3::ZERO),
    ("a light whose size is NaN", |t| t.light.kind = LightKind::Spot { size: f64::NAN }),
    ("a light whose size is negative", |t| t.light.kind = LightKind::Spot { size: -1.0 }),
];

/// Reverses the depth of a projection: z' = w - z.
fn reversed(m: DMat4) -> DMat4 {
    let flip = DMat4::from_cols(
        dvec4(1.0, 0.0, 0.0, 0.0),
        dvec4(0.0, 1.0, 0.0, 0.0),
        dvec4(0.0, 0.0, -1.0, 0.0),
        dvec4(0.0, 0.0, 1.0, 1.0),
    );
    flip * m
}

/// All mistakes with their errors. None of them reaches the GPU.
pub fn all() -> Result<Vec<(&'static str, String)>> {
    let extent = [64, 48];
    let depth = DepthRange::Reversed;
    let mut engine = Engine::new(&Options {
        technique: "pcf",
        params: &[],
        extent,
        depth,
        normals: false,
        map_format: vk::Format::D32_SFLOAT,
        throw_away: false,
        validation: None,
    })?;
    let right = engine.told(&scene::moment(0, 0, extent, depth));
    engine.attempt(&right)?;
    let mut answers = vec![];
    for (what, change) in IN_A_FRAME {
        let mut told = right;
        change(&mut told);
        answers.push((*what, answer(engine.attempt(&told))));
    }

    let (context, gpu) = engine.edgeshade();
    let (buffer, _) = gpu.readback(64)?;
    // SAFETY: the buffer is too small for the mesh; Edgeshade detects that before anything reads it.
    let vertices = Vertices::Buffer(unsafe { VertexBuffer::new(buffer, 64, 12) });
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = CasterMesh { name: "triangle", positions: &positions, indices: &[0, 1, 2], first_vertex: 4 };
    let casters = Casters::new(context, vertices, &[mesh], &[0], false);
    answers.push(("casters beyond the end of their vertex buffer", answer(casters.map(drop))));

    let bare = Gpu::with_extensions(None, &[])?;
    let context = engine::context(&bare);
    answers.push(("a device without VK_KHR_push_descriptor", answer(context.map(drop))));
    Ok(answers)
}

fn answer<E: ToString>(outcome: std::result::Result<(), E>) -> String {
    outcome.map_or_else(|e| e.to_string(), |()| "accepted".into())
}
