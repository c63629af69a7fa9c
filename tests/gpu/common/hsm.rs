//! The hierarchical shadow map equals its mirror, and is kept while the light stands still.

use crate::common::passes::{Random, read_mip};
use crate::common::{desc, plain_inputs, prepare, renderer, run_passes, shipped_scene};
use crate::common::{upload_depths, with_gpu};
use crate::made;
use edgeshade::reference::common::hsm;
use edgeshade::scene::{Moving, RenderDesc, fit, light_view};
use edgeshade::technique::common::hsm::Hsm;
use glam::DVec3;

#[test]
fn levels_equal_the_mirror() {
    with_gpu(|host| {
        let scene = made::still_life(made::sun(DVec3::ONE));
        let camera = fit::camera(&scene, [1, 1]).view([1, 1]);
        let light = [light_view(&scene, &scene.lights[0])];
        let mut random = Random(1);
        for size in [[1, 1], [2, 63], [64, 64], [65, 64], [100, 333], [1024, 1024], [2100, 8], [3, 1500]] {
            let texels: Vec<f32> = (0..size[0] * size[1]).map(|_| random.unit()).collect();
            let (map, depth) = (upload_depths(host, &texels, size, true), upload_depths(host, &texels, size, false));
            let mut pass = Hsm::new(host.context(), size).unwrap();
            run_passes(host, |frame| pass.record(frame, &plain_inputs(&camera, &depth, &map, &light)));
            let mut planted = texels.clone();
            planted[texels.len() / 2] = -1.0;
            let [mirror, other] = [&texels, &planted].map(|t| hsm::Hsm::new(t, size));
            assert_eq!(pass.levels() as usize, mirror.levels.len(), "{size:?}");
            for (l, (level, other)) in (0..).zip(mirror.levels.iter().zip(&other.levels)) {
                let got = read_mip::<[f32; 2]>(host, pass.bounds(), l);
                assert_eq!(got, level.bounds, "{size:?}, level {l}");
                let wrong = got.iter().zip(&other.bounds).filter(|(a, b)| a != b).count();
                assert_eq!(wrong, 1, "{size:?}, level {l}: a planted texel goes unnoticed");
            }
        }
    });
}

#[test]
fn it_is_kept_while_the_light_stands_still() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut r = renderer(host, &scene, RenderDesc { moving: Moving::Camera, ..desc([96, 54], 333) });
        let mut technique = prepare(&r, "pcss", &[]);
        let mut made = || {
            let passes = r.frame(technique.as_mut()).unwrap().passes;
            passes.iter().filter(|p| p.name.starts_with("hierarchical shadow map")).count()
        };
        assert_eq!([made(), made()], [2, 0]);
    });
}
