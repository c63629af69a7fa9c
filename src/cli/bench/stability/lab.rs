//! A small scene under either kind of light, its pictures by every technique of the registry, and the truths.

use crate::cli::args::TruthArgs;
use crate::cli::bench::judge::{self, mask};
use crate::cli::bench::meshes::{ball, block, ground};
use crate::cli::bench::tilted::Lamp;
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use crate::cli::truth::{self, Seed, Tracer};
use edgeshade::host::Host;
use edgeshade::scene::{Camera, Instance, Light, LightShape, Material, Projection, Renderer, Scene};
use edgeshade::technique::Technique;
use edgeshade::view::{CameraView, LightView, look_at};
use edgeshade::{Frame, Handoff, Inputs, Result};
use glam::{DAffine3, DMat3, DVec3, dvec3};
use std::path::PathBuf;

/// Both kinds of light.
pub const LAMPS: [Lamp; 2] = [Lamp::Sun, Lamp::Spot];

/// Rays per pixel of the soft truth.
const SAMPLES: u32 = 256;

/// Device and sizes of a run.
pub struct Lab<'h> {
    pub host: &'h Host,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Side of the shadow map, texels.
    pub map: u32,
    pub quick: bool,
}

/// A scene from its own camera under its own light, ready to be drawn.
pub struct Shot<'a> {
    host: &'a Host,
    pub stage: &'a Stage,
    pub renderer: Renderer<'a>,
    size: [u32; 2],
    /// True if the caller has chosen the map's view.
    has_own_view: bool,
}

/// Truths of one picture, and the pixels that are judged.
pub struct Truths {
    hard: Vec<f32>,
    fixed: Vec<f32>,
    soft: Vec<f32>,
    pub mask: Vec<bool>,
}

/// Light whose shadows a technique claims to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claim {
    /// Shadows of a light without size.
    Hard,
    /// Penumbrae of a width that does not depend on the light.
    Fixed,
    /// Shadows of the light's own size.
    Soft,
}

/// Techniques whose penumbrae have a fixed width.
const FIXED: [&str; 3] = ["edtsm", "edtsm-star", "fixed-penumbra"];

/// Techniques that read the light's size.
const SOFT: [&str; 13] = [
    "pcss",
    "vssm",
    "mssm",
    "rbssm",
    "rbssm-naive",
    "ssabss",
    "ssrbssm",
    "edtssm",
    "edtssm-star",
    "soft-auto",
    "exact-soft",
    "area-samples",
    "ray-traced",
];

/// The truth that judges a technique.
pub fn claim(id: &str) -> Claim {
    match id {
        _ if FIXED.contains(&id) => Claim::Fixed,
        _ if SOFT.contains(&id) => Claim::Soft,
        _ => Claim::Hard,
    }
}

impl Truths {
    /// The truth that judges this technique.
    pub fn of(&self, choice: &Choice) -> &[f32] {
        match claim(choice.info.id) {
            Claim::Hard => &self.hard,
            Claim::Fixed => &self.fixed,
            Claim::Soft => &self.soft,
        }
    }

    /// Root of the mean squared error over the judged pixels.
    pub fn rmse(&self, choice: &Choice, seen: &[f32]) -> f64 {
        let truth = self.of(choice);
        let squares = (0..seen.len()).filter(|&i| self.mask[i]).map(|i| f64::from(seen[i] - truth[i]).powi(2));
        let (mut sum, mut count) = (0.0, 0.0);
        for square in squares {
            sum += square;
            count += 1.0;
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }
}

impl<'h> Lab<'h> {
    /// The stage of a scene with one camera and one light.
    pub fn stage(&self, scene: Scene) -> Stage {
        stage(scene, self.size)
    }

    /// Makes a scene ready to be drawn, with the map fitted to it.
    pub fn shot<'a>(&self, stage: &'a Stage) -> Result<Shot<'a>>
    where
        'h: 'a,
    {
        self.shot_of(stage, self.size, self.map)
    }

    /// Does the same with other sizes of image and map; the stage must be made for this image.
    pub fn shot_of<'a>(&self, stage: &'a Stage, size: [u32; 2], map: u32) -> Result<Shot<'a>>
    where
        'h: 'a,
    {
        let renderer = judge::renderer(self.host, stage, size, map)?;
        Ok(Shot { host: self.host, stage, renderer, size, has_own_view: false })
    }
}

/// The stage of a scene with one camera and one light, for an image of this size.
pub fn stage(scene: Scene, size: [u32; 2]) -> Stage {
    let (camera, light) = (scene.cameras[0].view(size), scene.lights[0].clone());
    Stage { scene, camera, light }
}

impl<'a> Shot<'a> {
    /// Replaces the map's view.
    pub fn set_light(&mut self, view: LightView) {
        self.renderer.set_light(&self.stage.scene, view);
        self.has_own_view = true;
    }

    fn tracer(&self, stage: &'a Stage) -> Tracer<'a> {
        // Pictures this small take less time than their files.
        let args = TruthArgs { samples: None, cache: Some(PathBuf::from("off")) };
        let mut tracer = Tracer::new(stage, self.renderer.light(), self.size, &args).quiet();
        tracer.look(*self.renderer.camera(), self.renderer.light());
        tracer
    }

    /// Visibility by a technique or reference; `None` if the reference cannot use the map's view.
    pub fn image(&mut self, choice: &Choice) -> Result<Option<Vec<f32>>> {
        Ok(Some(match choice.info.id {
            "area-samples" if self.has_own_view => return Ok(None),
            "area-samples" => {
                let samples = choice.params.int("samples");
                self.renderer.area_samples(&self.stage.scene, &self.stage.light, samples, &mut |_, _| ())?
            }
            _ if choice.is_reference() => {
                truth::reference(choice, &mut self.tracer(self.stage), &mut self.renderer, Seed::Truth)?
            }
            _ => judge::visibility(&mut self.renderer, choice)?,
        }))
    }

    /// The truths of this picture.
    pub fn truths(&mut self) -> Result<Truths> {
        let mut tracer = self.tracer(self.stage);
        let hard = tracer.hard()?;
        let fixed = tracer.fixed_penumbra(&Choice::new("fixed-penumbra", &[])?)?.0.visibility;
        let soft = tracer.truth(SAMPLES, Seed::NoiseFloor)?.0.visibility;
        let mask = mask(self.host, &mut self.renderer, &hard)?;
        Ok(Truths { hard: hard.visibility, fixed, soft, mask })
    }

    /// Draws map and G-buffer, for techniques that get them by [`record`].
    pub fn draw(&mut self) -> Result<()> {
        judge::visibility(&mut self.renderer, &Choice::new("sm", &[])?).map(drop)
    }

    /// Inputs of the picture that was drawn last, from which nothing is kept.
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs { light_version: None, camera_version: None, ..self.renderer.inputs() }
    }
}

/// Visibility that a technique computes from the given inputs.
pub fn record(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>) -> Result<Vec<f32>> {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording; the host has one queue and waits for the work.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        technique.record(&mut frame, inputs)?;
        frame.end();
        Ok(())
    })?;
    host.read_values(technique.output())
}

/// Index of the instance that moves in cases with moving casters.
pub const MOVING: usize = 1;

/// A block, a ball, posts, a leaning board and a floating plate over a ground, under a light with a size.
pub fn scene(lamp: Lamp) -> Scene {
    let mut scene = Scene {
        name: "stability".into(),
        materials: vec![Material { double_sided: true, ..Material::default() }],
        cameras: vec![Camera {
            name: "camera".into(),
            world_from_camera: look_at(dvec3(1.0, 5.0, 9.0), dvec3(0.0, 0.6, 0.0)),
            projection: Projection::Perspective { fov_y: 0.8, near: 0.1 },
        }],
        lights: vec![light(lamp)],
        ..Scene::default()
    };
    let lean = DMat3::from_rotation_z(0.5) * DMat3::from_rotation_y(0.4);
    let moved = DAffine3::from_translation;
    let mut parts = vec![
        (ground(6.0), DAffine3::IDENTITY),
        (
            block(dvec3(0.8, 0.9, 0.5)),
            DAffine3 { matrix3: DMat3::from_rotation_y(0.3), ..moved(dvec3(-1.5, 0.9, 0.2)) },
        ),
        (ball(16, 32), moved(dvec3(1.7, 1.2, -0.7))),
        (block(dvec3(0.7, 0.02, 0.5)), DAffine3 { matrix3: lean, ..moved(dvec3(0.4, 0.6, 1.9)) }),
        (
            block(dvec3(0.5, 0.05, 0.5)),
            DAffine3 { matrix3: DMat3::from_rotation_y(0.7), ..moved(dvec3(-0.2, 2.2, -1.4)) },
        ),
    ];
    let posts = (0..5).map(|i| (block(dvec3(0.04, 0.6, 0.04)), moved(dvec3(-2.6 + 0.37 * f64::from(i), 0.6, 2.1))));
    parts.extend(posts);
    for (mesh, world_from_object) in parts {
        scene.instances.push(Instance { mesh: scene.meshes.len(), world_from_object });
        scene.meshes.push(mesh);
    }
    scene
}

fn light(lamp: Lamp) -> Light {
    let (from, shape) = match lamp {
        Lamp::Sun => (dvec3(-1.2, 2.0, 0.9), LightShape::Directional { angle: Some(0.1) }),
        Lamp::Spot => (dvec3(3.0, 7.0, 2.5), LightShape::Spot { outer: 0.65, size: Some(1.0) }),
    };
    Light { name: "lamp".into(), world_from_light: look_at(from, DVec3::ZERO), shape, color: [1.0; 3] }
}

/// World width of a pixel at the middle of the scene.
pub fn pixel_width(stage: &Stage, size: [u32; 2]) -> f64 {
    let CameraView { world_from_view, clip_from_view, .. } = &stage.camera;
    let distance = -world_from_view.inverse().transform_point3(stage.scene.bounds().center()).z;
    2.0 * distance / (clip_from_view.y_axis.y.abs() * f64::from(size[1]))
}
