//! References: made once and kept on disk.

use super::args::{TruthArgs, usage};
use super::progress::Progress;
use super::stage::Stage;
use super::techniques::Choice;
use edgeshade::Result;
use edgeshade::metrics;
use edgeshade::picture::Picture;
use edgeshade::reference::ray_traced::{
    Cache, FixedPenumbraSettings, Method, Origin, RayScene, SoftSettings, Truth, cache_key, trace,
};
use edgeshade::scene::{Light, Renderer, Scene};
use edgeshade::technique::penumbra::fixed_width::penumbra_width;
use edgeshade::view::{CameraView, LightKind, LightView};

/// Seed of the truth, or of a second one that is compared with it.
#[derive(Clone, Copy)]
pub enum Seed {
    Truth = 0,
    NoiseFloor = 1,
}

/// Traces the truth of one scene. Builds the ray-tracing hierarchy only if something is not cached.
pub struct Tracer<'a> {
    scene: &'a Scene,
    lamp: &'a Light,
    camera: CameraView,
    light: LightView,
    size: [u32; 2],
    cache: Cache,
    rays: Option<RayScene>,
    /// Shows no progress of its own.
    quiet: bool,
}

impl<'a> Tracer<'a> {
    /// Makes a tracer. `light` is the view that the stage's shadow map is rendered from.
    pub fn new(stage: &'a Stage, light: &LightView, size: [u32; 2], args: &TruthArgs) -> Tracer<'a> {
        let cache = match &args.cache {
            Some(folder) if folder.as_os_str() == "off" => Cache::disabled(),
            folder => Cache::open(folder.as_deref()),
        };
        Self {
            scene: &stage.scene,
            lamp: &stage.light,
            camera: stage.camera,
            light: *light,
            size,
            cache,
            rays: None,
            quiet: false,
        }
    }

    /// Turns off the tracer's own progress, for many small truths under one progress bar.
    pub fn quiet(self) -> Self {
        Self { quiet: true, ..self }
    }

    /// Changes to another view of the same scene.
    pub fn look(&mut self, camera: CameraView, light: &LightView) {
        self.camera = camera;
        self.light = *light;
    }

    /// Soft shadows with `samples` rays per pixel; hard ones if that is 1 or the light has no size.
    pub fn truth(&mut self, samples: u32, seed: Seed) -> Result<(Truth, Origin)> {
        let is_point = match self.light.kind {
            LightKind::Spot { size } => size == 0.0,
            LightKind::Directional { angle } => angle == 0.0,
        };
        if is_point || samples == 1 {
            return self.trace(&Method::Hard);
        }
        self.trace(&Method::Soft(SoftSettings { samples, adaptive: true, seed: seed as u64 }))
    }

    /// Hard shadows. They also give the pixels that are judged, because these do not depend on the light's size.
    pub fn hard(&mut self) -> Result<Truth> {
        Ok(self.trace(&Method::Hard)?.0)
    }

    /// Penumbrae of a fixed width, by the parameters of `fixed-penumbra`.
    pub fn fixed_penumbra(&mut self, choice: &Choice) -> Result<(Truth, Origin)> {
        let penumbra = self.penumbra(choice);
        let subsamples = choice.params.int("subsamples");
        self.trace(&Method::FixedPenumbra(FixedPenumbraSettings { penumbra, subsamples }))
    }

    /// Width of the penumbra in world units that the parameters of `fixed-penumbra` give under this light.
    pub fn penumbra(&self, choice: &Choice) -> f64 {
        penumbra_width(choice.params.get("penumbra"), &self.light)
    }

    fn trace(&mut self, method: &Method) -> Result<(Truth, Origin)> {
        let Self { scene, camera, light, size, cache, rays, quiet, .. } = self;
        let key = cache_key(scene, camera, light, *size, method);
        cache.get_or_trace(&key, *size, || {
            let [w, h] = *size;
            let progress = (!*quiet).then(|| {
                Progress::start(match method {
                    Method::Hard => format!("tracing the truth, {w}x{h}, one ray per pixel"),
                    Method::Soft(s) => format!("tracing the truth, {w}x{h}, {} rays per pixel", s.samples),
                    Method::FixedPenumbra(s) => {
                        format!("tracing the shadow boundary, {w}x{h}, {0}x{0} rays per pixel", s.subsamples)
                    }
                })
            });
            let rays = match rays {
                Some(rays) => rays,
                None => rays.insert(RayScene::build(scene)?),
            };
            trace(rays, camera, light, *size, method, &|done, total| {
                if let Some(progress) = &progress {
                    progress.set(done, total);
                }
            })
        })
    }
}

/// Visibility computed by one of the registry's references.
pub fn reference(
    choice: &Choice,
    tracer: &mut Tracer<'_>,
    renderer: &mut Renderer<'_>,
    seed: Seed,
) -> Result<Vec<f32>> {
    match choice.info.id {
        "ray-traced" => Ok(tracer.truth(choice.params.int("samples"), seed)?.0.visibility),
        "fixed-penumbra" => Ok(tracer.fixed_penumbra(choice)?.0.visibility),
        "area-samples" => {
            let samples = choice.params.int("samples");
            let progress = Progress::start(format!("averaging {samples} shadow maps"));
            let mut done = |done: u32, total: u32| progress.set(done.into(), total.into());
            renderer.area_samples(tracer.scene, tracer.lamp, samples, &mut done)
        }
        id => usage(format!("{id}: this reference cannot be made here")),
    }
}

/// Mean FLIP difference of two lit pictures over the judged pixels.
pub fn flip(test: &Picture, truth: &Picture, mask: &[bool]) -> Result<f64> {
    let pixels = test.rgb.iter().zip(&truth.rgb).zip(mask);
    let masked: Vec<_> = pixels.map(|((&test, &truth), &counts)| if counts { test } else { truth }).collect();
    Ok(metrics::flip(&masked, &truth.rgb, truth.size)?.0)
}
