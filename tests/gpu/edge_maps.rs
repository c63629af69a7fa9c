//! Techniques that hold the casters' edges in a map: shadow silhouette maps and edge distance shadow mapping.

mod cards;
mod lookups;
mod maps;
mod straight;

use crate::common::Shot;
use ash::vk;
use edgeshade::casters::Casters;
use edgeshade::gpu::{Buffer, BufferDesc, MemoryKind};
use edgeshade::host::Host;
use edgeshade::pass::edsm::{DistanceConfig, EdgeDistances};
use edgeshade::pass::map_edges::MapEdges;
use edgeshade::pass::sssm::{PointsBy, SilhouettePoints};
use edgeshade::reference::map_edges::MapEdge;
use edgeshade::scene::{GpuScene, Renderer, Scene, SceneCasters};
use edgeshade::technique::{Params, find};
use edgeshade::{Frame, Handoff, Inputs};
use std::sync::Arc;

/// The maps of a scene, read back.
struct Maps {
    edges: Vec<MapEdge>,
    points: Vec<u32>,
    drawn_points: Vec<u32>,
    /// By distance and by cosine.
    distances: [Vec<f32>; 2],
}

fn config(cosine: bool, kill: bool) -> DistanceConfig {
    DistanceConfig { cosine, kill, half_width: 1.5 }
}

/// Of what the renderer drew last.
fn maps(host: &Host, scene: &Scene, renderer: &Renderer<'_>, kill: bool) -> Maps {
    let context = host.context();
    let gpu = GpuScene::new(host, scene).unwrap();
    let SceneCasters { casters, transforms } = SceneCasters::new(context, scene, &gpu).unwrap();
    let casters: &Arc<Casters> = &casters;
    let map_size = renderer.shadow_map().extent();
    let inputs = Inputs {
        camera: renderer.camera(),
        depth: renderer.gbuffer().depth.as_ref(),
        normal: None,
        shadow_map: renderer.shadow_map().as_ref(),
        light: std::slice::from_ref(renderer.light()),
        light_version: None,
        casters: &transforms,
    };
    let points = |by| SilhouettePoints::new(context, "test", casters, map_size, by, kill).unwrap();
    let [mut walked, mut drawn] = [PointsBy::Compute, PointsBy::Raster].map(points);
    let distances = |cosine| EdgeDistances::new(context, "test", casters, map_size, config(cosine, kill)).unwrap();
    let [mut plain, mut cosine] = [false, true].map(distances);
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(context, cmd, Handoff::default(), None) };
        walked.record(&mut frame, &inputs)?;
        drawn.record(&mut frame, &inputs)?;
        plain.record(&mut frame, &inputs)?;
        cosine.record(&mut frame, &inputs)?;
        frame.end();
        Ok(())
    })
    .unwrap();
    Maps {
        edges: edges(host, walked.edges()),
        points: host.read_image(walked.points()).unwrap(),
        drawn_points: host.read_image(drawn.points()).unwrap(),
        distances: [&plain, &cosine].map(|d| host.read_values(d.distances()).unwrap()),
    }
}

/// The list of edges, read back.
fn edges(host: &Host, edges: &MapEdges) -> Vec<MapEdge> {
    let header: Vec<u32> = read(host, edges.header());
    let words: Vec<u32> = read(host, edges.segments());
    let count = header[3] as usize;
    words.chunks_exact(8).take(count).filter_map(|w| MapEdge::from_words(w.try_into().unwrap())).collect()
}

fn read<T: bytemuck::AnyBitPattern>(host: &Host, source: &Buffer) -> Vec<T> {
    let device = host.context().device();
    let desc = BufferDesc {
        name: "read back",
        size: source.size(),
        usage: vk::BufferUsageFlags::TRANSFER_DST,
        memory: MemoryKind::Readback,
    };
    let target = Buffer::new(device, &desc).unwrap();
    let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: source.size() };
    let visible = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    host.run(|cmd| {
        // SAFETY: the source's last use was waited for, and the target is of its size.
        unsafe {
            device.raw.cmd_copy_buffer(cmd, source.handle(), target.handle(), &[region]);
            device.raw.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&visible));
        }
        Ok(())
    })
    .unwrap();
    target.bytes().chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

/// What a technique does with its receivers, for the mirrors.
fn receiver_settings(id: &str) -> edgeshade::reference::rbsm::Settings {
    let p = Params::new(find(id).unwrap());
    edgeshade::reference::rbsm::Settings {
        function: edgeshade::reference::revectorize::Function::Silhouette,
        fixed_depth: false,
        max_distance: 16,
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        slack: p.float("slack"),
    }
}

fn shadow_map(host: &Host, renderer: &Renderer<'_>) -> Vec<f32> {
    Shot::of(host, renderer, true).map
}
