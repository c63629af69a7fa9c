//! Exact shadows from lists in a grid: every result against brute force over all casters, ray tracing or closed forms.

mod awkward;
mod closed_forms;
mod hard;
mod invariance;
mod lists;
mod motion;
mod overflow;
mod soft;
mod traced;
mod views;

use crate::caster_edges::shadow_volumes::{cases, is_outside, topologies};
use crate::common::{Shot, desc, renderer, shipped_scene, visibility};
use crate::made::{self, cuboid, moved, perspective, plane};
use edgeshade::casters::topology::Topology;
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::shadow_volumes::Caster;
use edgeshade::scene::{Masked, Mesh, Projection, Renderer, Scene};
use edgeshade::view::{LightKind, LightView, look_at};
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [160, 90];
/// The shadow map decides nothing here; a coarse one shows where it does.
const MAP: u32 = 32;

/// A scene with its renderer, and what the mirrors need of the casters.
struct Stage<'h> {
    name: String,
    scene: Scene,
    renderer: Renderer<'h>,
    topologies: Vec<Topology>,
}

impl<'h> Stage<'h> {
    /// Leaves out masked casters, which the mirrors do not know.
    fn new(host: &'h Host, name: &str, mut scene: Scene) -> Self {
        scene.set_masked(Masked::Exclude);
        let renderer = renderer(host, &scene, desc(SIZE, MAP));
        Self { name: name.to_owned(), topologies: topologies(&scene), renderer, scene }
    }

    fn shipped(host: &'h Host, name: &str) -> Self {
        Self::new(host, name, shipped_scene(name))
    }

    /// Gives the light a size: a spot light's side is this share of the distance to the middle of what the camera sees,
    /// a sun's angle is as wide.
    fn with_light_size(mut self, share: f64) -> Self {
        let light = *self.renderer.light();
        let kind = match light.kind {
            LightKind::Spot { .. } => LightKind::Spot { size: share * light.position().length() },
            LightKind::Directional { .. } => LightKind::Directional { angle: share },
        };
        self.set_light(LightView { kind, ..light });
        self
    }

    fn set_light(&mut self, light: LightView) {
        self.renderer.set_light(&self.scene, light);
    }

    fn seen(&mut self, id: &str, settings: &[(&str, &str)]) -> Vec<f32> {
        visibility(&mut self.renderer, id, settings)
    }

    fn casters(&self) -> Vec<Caster<'_>> {
        (self.scene.instances.iter().zip(&self.topologies))
            .map(|(i, topology)| {
                let mesh = &self.scene.meshes[i.mesh];
                Caster {
                    positions: &mesh.positions,
                    topology,
                    world_from_object: i.world_from_object,
                    shells: topology.outward && is_outside(&self.renderer, mesh, &i.world_from_object),
                }
            })
            .collect()
    }

    fn shot(&self, host: &Host) -> Shot {
        Shot::of(host, &self.renderer, true)
    }
}

/// A spot light whose near plane lies at `near`.
fn spot_from(eye: DVec3, near: f64) -> LightView {
    LightView::spot(look_at(eye, DVec3::ZERO), 1.2, near, 3.0 * eye.length(), 0.0)
}

/// Returns casters over a ground under a sun.
fn over(parts: Vec<(Mesh, DAffine3)>) -> Scene {
    let ground = (plane(8.0), moved(dvec3(0.0, -0.001, 0.0)));
    let all = std::iter::once(ground).chain(parts).collect();
    made::scene(all, perspective(dvec3(2.0, 4.0, 7.0), dvec3(0.0, 0.5, 0.0), 0.1), made::sun(DVec3::Y))
}

/// The small scenes of the shadow volumes, and further ones that are awkward for lists.
fn stages(host: &Host) -> impl Iterator<Item = Stage<'_>> {
    let lamp = dvec3(0.4, 5.0, 0.7);
    let own = [
        // A card that hangs between the light and its near plane.
        ("before the near plane", over(vec![(plane(0.1), moved(dvec3(0.35, 4.4, 0.6)))]), spot_from(lamp, 1.5)),
        // A wall that goes on above and behind the light.
        (
            "behind the light",
            over(vec![(
                made::mesh(&[[dvec3(-1.0, 0.3, -0.4), dvec3(1.0, 0.3, -0.4), dvec3(0.3, 30.0, 4.0)]]),
                DAffine3::IDENTITY,
            )]),
            spot_from(lamp, 0.5),
        ),
        (
            "box on the ground",
            over(vec![(cuboid(dvec3(0.6, 0.5, 0.4)), moved(dvec3(0.0, 0.5, 0.0)))]),
            spot_from(dvec3(-1.2, 4.0, -2.0), 0.5),
        ),
    ];
    let cases = cases().into_iter().map(|(name, scene)| (name, scene, None));
    cases.chain(own.into_iter().map(|(name, scene, light)| (name, scene, Some(light)))).map(|(name, scene, light)| {
        let mut stage = Stage::new(host, name, scene);
        if let Some(light) = light {
            stage.set_light(light);
        }
        stage
    })
}

/// Returns the projection for a scene that is `factor` times as large.
fn scaled(projection: Projection, factor: f64) -> Projection {
    match projection {
        Projection::Perspective { fov_y, near } => Projection::Perspective { fov_y, near: factor * near },
        Projection::Orthographic { half_height, near, far } => {
            let [half_height, near, far] = [half_height, near, far].map(|x| factor * x);
            Projection::Orthographic { half_height, near, far }
        }
    }
}
