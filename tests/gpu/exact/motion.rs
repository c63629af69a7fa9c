//! Soft shadows while light or camera move by less than a texel or a pixel a frame.

use super::{SIZE, Stage};
use crate::common::{prepare, with_gpu};
use edgeshade::host::Host;
use edgeshade::metrics::{Motion, Shot, motion};
use edgeshade::reference::ray_traced::{RayScene, SoftSettings, soft};
use edgeshade::view::{CameraView, LightView};
use glam::{DAffine3, DVec2};

const FRAMES: u32 = 4;
/// Movement a frame, at the middle of the scene: pixels of the camera.
const STEP: f64 = 0.2;
/// Distance in pixels up to which a pixel counts as near a penumbra.
const BAND: u32 = 2;

/// Camera and light of a frame.
type Pose = (CameraView, LightView);

/// Camera and light after some steps.
fn pose(stage: &Stage<'_>, (mut camera, mut light): Pose, light_moves: bool, steps: f64) -> Pose {
    let middle = stage.scene.bounds().center();
    let distance = -camera.world_from_view.inverse().transform_point3(middle).z;
    let pixel = 2.0 * distance / camera.clip_from_view.y_axis.y.abs() / f64::from(SIZE[1]);
    let by = (steps * STEP * pixel * DVec2::from_angle(0.5)).extend(0.0);
    if light_moves && light.is_directional() {
        let turn = DAffine3::from_rotation_y(by.x / (0.5 * distance));
        light.world_from_view.matrix3 = turn.matrix3 * light.world_from_view.matrix3;
    } else if light_moves {
        light.world_from_view *= DAffine3::from_translation(by);
    } else {
        camera.world_from_view *= DAffine3::from_translation(by);
    }
    (camera, light)
}

/// Returns the change near the penumbrae of a sequence, and of one in which every other frame is two steps ahead.
fn change(host: &Host, stage: &mut Stage<'_>, light_moves: bool) -> [Motion; 2] {
    let rays = RayScene::build(&stage.scene).unwrap();
    let own = (*stage.renderer.camera(), *stage.renderer.light());
    let mut technique = prepare(&stage.renderer, "exact-soft", &[]);
    let (mut truths, mut even, mut shaken) = (vec![], vec![], vec![]);
    for i in 0..FRAMES {
        let mut seen = |steps: u32| {
            let (camera, light) = pose(stage, own, light_moves, steps.into());
            stage.renderer.set_camera(&stage.scene, camera).unwrap();
            stage.set_light(light);
            stage.renderer.frame(technique.as_mut()).unwrap();
            stage.renderer.visibility(technique.as_ref()).unwrap()
        };
        shaken.push(seen(i + 2 * (i % 2)));
        even.push(seen(i));
        let settings = SoftSettings { samples: 400, ..SoftSettings::default() };
        let r = &stage.renderer;
        let truth = soft(&rays, r.camera(), r.light(), SIZE, &settings, &|_, _| ()).unwrap();
        let mask = truth.judged(&host.read_image::<u32>(&r.gbuffer().triangle).unwrap());
        truths.push((truth.visibility, mask));
    }
    stage.renderer.set_camera(&stage.scene, own.0).unwrap();
    stage.set_light(own.1);
    [even, shaken].map(|frames| {
        let shots: Vec<_> =
            frames.iter().zip(&truths).map(|(test, (truth, mask))| Shot { test, truth, mask }).collect();
        motion(&shots, SIZE, BAND).unwrap()
    })
}

#[test]
fn soft_shadows_change_no_more_than_the_truth() {
    with_gpu(|host| {
        let mut failed = vec![];
        for name in ["jenga", "fence"] {
            let mut stage = Stage::shipped(host, name);
            for (what, light_moves) in [("light", true), ("camera", false)] {
                let [own, shaken] = change(host, &mut stage, light_moves);
                let ratio = |m: &Motion| m.change.unwrap() / m.change_truth.unwrap();
                println!(
                    "{name:8} {what} moves: {} pairs, change {:.5}, of the truth {:.5}, ratio {:.3}; not the truth's {:.5}; ratio of a shaken one {:.2}",
                    own.pairs,
                    own.change.unwrap(),
                    own.change_truth.unwrap(),
                    ratio(&own),
                    own.change_error.unwrap(),
                    ratio(&shaken)
                );
                assert!(own.pairs > 500 && own.change_truth.unwrap() > 1e-3, "{name} {what}: {own:?}");
                assert!(ratio(&shaken) > 1.05, "{name} {what}: {shaken:?}");
                if ratio(&own) > 1.05 {
                    failed.push(format!("{name} {what}: {own:?}"));
                }
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}
