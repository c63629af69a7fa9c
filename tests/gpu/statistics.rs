//! Pipeline statistics of whole frames: the host's passes draw what the scene contains.

use crate::common::{desc, prepare, renderer, shipped_scene, with_gpu};
use edgeshade::scene::cull::DrawList;
use edgeshade::scene::{RenderDesc, Scene};

const SIZE: [u32; 2] = [128, 64];

fn triangles(scene: &Scene, list: &DrawList) -> u64 {
    list.calls.iter().map(|c| scene.meshes[c.mesh].triangles() as u64 * c.instances.len() as u64).sum()
}

#[test]
fn the_g_buffer_and_the_map_count_the_triangles_that_are_drawn() {
    with_gpu(|host| {
        if !host.context().features().pipeline_statistics {
            eprintln!("skipped: this device has no pipeline statistics");
            return;
        }
        for name in ["fence", "jenga"] {
            let scene = shipped_scene(name);
            let desc = RenderDesc { statistics: true, ..desc(SIZE, 64) };
            let mut renderer = renderer(host, &scene, desc);
            let mut technique = prepare(&renderer, "sm", &[]);
            let frame = renderer.frame(technique.as_mut()).unwrap();
            let of = |pass: &str| frame.passes.iter().find(|p| p.name == pass).unwrap().statistics.unwrap();
            let camera = triangles(&scene, &DrawList::for_camera(&scene, renderer.camera()));
            let light = triangles(&scene, &DrawList::for_light(&scene, renderer.light()));
            assert!(camera > 0 && light > 0);
            assert_eq!((of("g-buffer").input_primitives, of("shadow map").input_primitives), (camera, light), "{name}");
            assert!(of("g-buffer").clipped_primitives <= camera && of("g-buffer").fragment_invocations > 0, "{name}");
            let test = of("shadow test");
            assert_eq!((test.input_primitives, test.fragment_invocations), (0, 0), "{name}");
            assert_eq!(test.compute_invocations, u64::from(SIZE[0] * SIZE[1]), "{name}");
        }
    });
}

#[test]
fn without_being_asked_for_there_are_none() {
    with_gpu(|host| {
        let mut renderer = renderer(host, &shipped_scene("fence"), desc(SIZE, 64));
        let mut technique = prepare(&renderer, "sm", &[]);
        let frame = renderer.frame(technique.as_mut()).unwrap();
        assert!(!frame.passes.is_empty() && frame.passes.iter().all(|p| p.statistics.is_none()));
    });
}
