//! Limited number of devices at a time, and rendered frames with all their data read back.

mod gbuffer;
mod hsm;
pub mod passes;
mod shade;

use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::host::{Host, HostDesc};
use edgeshade::reference::FrameData;
use edgeshade::reference::common::blockers::SearchForm;
use edgeshade::reference::penumbra::edge_seeds::{self, Points};
use edgeshade::reference::revectorization::rbsm;
use edgeshade::reference::revectorization::revectorize::Function;
use edgeshade::scene::{Camera, Light, RenderDesc, Renderer, Scene, fit, load_bytes, shipped};
use edgeshade::technique::common::blocker_search::SearchWindow;
use edgeshade::technique::common::surface::SurfaceTest;
use edgeshade::technique::common::view::ViewConstants;
use edgeshade::technique::penumbra::edge_line::STEPS;
use edgeshade::technique::{OutputFormat, Params, Technique, find};
use edgeshade::timing::FrameTiming;
use edgeshade::view::{CameraView, LightKind, LightView};
use edgeshade::{Frame, Handoff, Inputs, NormalEncoding};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Instant;

/// Number of tests with their own device at a time. Compiling pipelines takes most of the time and uses one core.
const DEVICES: u32 = 2;
static IN_USE: Mutex<u32> = Mutex::new(0);
static FREED: Condvar = Condvar::new();

/// Use of one device; it is returned at the end, even if the test fails.
struct Turn;

impl Turn {
    fn wait() -> Self {
        let in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut in_use = FREED.wait_while(in_use, |n| *n >= DEVICES).unwrap_or_else(PoisonError::into_inner);
        *in_use += 1;
        Self
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        *IN_USE.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        FREED.notify_one();
    }
}

/// Runs a test on its own device. Any message of the validation layer fails it, including those at the very end.
pub fn with_gpu(test: impl FnOnce(&Host)) {
    let messages = messages_of(test);
    assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
}

/// Runs a test and returns the messages of the validation layer. Prints the time for `.ci/run`, which lists the
/// slowest tests.
pub fn messages_of(test: impl FnOnce(&Host)) -> Vec<String> {
    messages_of_host(HostDesc::default(), test)
}

/// Does the same on a device opened as `desc` says, but always with validation.
pub fn messages_of_host(desc: HostDesc, test: impl FnOnce(&Host)) -> Vec<String> {
    let _turn = Turn::wait();
    let started = Instant::now();
    let host = Host::new(&HostDesc { validation: true, ..desc }).unwrap();
    let messages = host.messages().clone();
    test(&host);
    drop(host);
    println!("seconds {:.1} {}", started.elapsed().as_secs_f64(), std::thread::current().name().unwrap_or_default());
    messages.all()
}

/// Returns whether this is the software rasteriser that made the committed pictures.
pub fn is_llvmpipe(host: &Host) -> bool {
    host.info().name.contains("llvmpipe")
}

/// Returns whether every case of a sweep should run: in CI, which sets `EDGESHADE_SWEEP=full`. Otherwise the longest
/// tests run some of their cases, so that `make test` stays short. Both include every kind of check.
pub fn is_full_sweep() -> bool {
    std::env::var_os("EDGESHADE_SWEEP").is_some_and(|v| v == "full")
}

/// Returns all cases of a full sweep, otherwise every `n`-th of them, from the first.
pub fn every_nth<T>(n: usize, cases: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    cases.into_iter().step_by(if is_full_sweep() { 1 } else { n })
}

pub fn shipped_scene(name: &str) -> Scene {
    let found = shipped::find(name).unwrap();
    load_bytes(found.name, found.bytes).unwrap()
}

pub fn every_shipped() -> impl Iterator<Item = Scene> {
    shipped::ALL.iter().map(|s| load_bytes(s.name, s.bytes).unwrap())
}

/// Returns a description with visibility in `f32`, so that nothing is rounded away.
pub fn desc(size: [u32; 2], map_size: u32) -> RenderDesc {
    RenderDesc { size, map_size, output: OutputFormat::R32, ..RenderDesc::default() }
}

pub fn camera_of(scene: &Scene, size: [u32; 2]) -> Camera {
    scene.cameras.first().cloned().unwrap_or_else(|| fit::camera(scene, size))
}

pub fn light_of(scene: &Scene) -> Light {
    scene.lights.first().cloned().unwrap_or_else(|| fit::light(scene))
}

/// Renders the scene from its own camera under its own light, or fitted ones.
pub fn renderer<'h>(host: &'h Host, scene: &Scene, desc: RenderDesc) -> Renderer<'h> {
    let camera = camera_of(scene, desc.size).view(desc.size);
    Renderer::new(host, scene, camera, &light_of(scene), desc).unwrap()
}

pub fn prepare(renderer: &Renderer<'_>, id: &str, settings: &[(&str, &str)]) -> Box<dyn Technique> {
    let params = Params::parse(find(id).unwrap(), settings.iter().copied()).unwrap();
    renderer.prepare(id, &params).unwrap()
}

/// Renders one frame.
pub fn frame(renderer: &mut Renderer<'_>, id: &str, settings: &[(&str, &str)]) -> (Vec<f32>, FrameTiming) {
    let mut technique = prepare(renderer, id, settings);
    let timing = renderer.frame(technique.as_mut()).unwrap();
    (renderer.visibility(technique.as_ref()).unwrap(), timing)
}

pub fn visibility(renderer: &mut Renderer<'_>, id: &str, settings: &[(&str, &str)]) -> Vec<f32> {
    frame(renderer, id, settings).0
}

/// All inputs of the last frame's technique.
#[derive(Clone)]
pub struct Shot {
    pub constants: ViewConstants,
    pub depth: Vec<f32>,
    /// Normals as fetched; empty where the technique derives them from depth.
    pub normal: Vec<[f32; 3]>,
    pub map: Vec<f32>,
}

impl Shot {
    pub fn of(host: &Host, renderer: &Renderer<'_>, normals: bool) -> Self {
        Self::with_normal(host, renderer, normals.then_some(&renderer.gbuffer().geometric_normal))
    }

    pub fn with_normal(host: &Host, renderer: &Renderer<'_>, normal: Option<&Image>) -> Self {
        let g = renderer.gbuffer();
        let constants = ViewConstants::new(&Inputs {
            camera: renderer.camera(),
            depth: g.depth.as_ref(),
            normal: normal.map(|n| (n.as_ref(), NormalEncoding::OctahedralSigned)),
            shadow_map: renderer.shadow_map().as_ref(),
            light: std::slice::from_ref(renderer.light()),
            light_version: None,
            camera_version: None,
            casters: &[],
        });
        Self {
            constants,
            depth: host.read_values(&g.depth).unwrap(),
            normal: normal.map_or(vec![], |n| normal_texels(host, n)),
            map: host.read_values(renderer.shadow_map()).unwrap(),
        }
    }

    pub fn data(&self) -> FrameData<'_> {
        FrameData { constants: &self.constants, depth: &self.depth, normal: &self.normal, shadow_map: &self.map }
    }
}

/// Returns the pixels of a two-channel normal image, as a shader fetches them.
pub fn normal_texels(host: &Host, image: &Image) -> Vec<[f32; 3]> {
    if image.format() == vk::Format::R16G16_SNORM {
        let value = |v: i16| (f32::from(v) / 32767.0).max(-1.0);
        let pixels = host.read_image::<[i16; 2]>(image).unwrap();
        pixels.into_iter().map(|[x, y]| [value(x), value(y), 0.0]).collect()
    } else {
        host.read_image::<[f32; 2]>(image).unwrap().into_iter().map(|[x, y]| [x, y, 0.0]).collect()
    }
}

/// Checks that all values are numbers in `[0, 1]`.
pub fn assert_in_range(values: &[f32], what: &str) {
    if let Some(i) = values.iter().position(|v| !(0.0..=1.0).contains(v)) {
        panic!("{what}: value {} at pixel {i} of {}", values[i], values.len());
    }
}

/// Returns the number of values that differ by more than `tolerance`; NaN differs from everything.
pub fn differing(a: &[f32], b: &[f32], tolerance: f32) -> usize {
    assert_eq!(a.len(), b.len());
    let same = |a: f32, b: f32| (a - b).abs() <= tolerance;
    a.iter().zip(b).filter(|(a, b)| !same(**a, **b)).count()
}

/// Panics unless both are equal bit for bit.
pub fn assert_same_bits(a: &[f32], b: &[f32], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    let bad: Vec<_> = (0..a.len()).filter(|&i| a[i].to_bits() != b[i].to_bits()).collect();
    if let Some(&i) = bad.first() {
        panic!("{what}: {} of {} pixels differ, pixel {i} first: {} and {}", bad.len(), a.len(), a[i], b[i]);
    }
}

/// Returns the seed settings for the mirror of a technique that uses shadow edges.
pub fn seed_settings(id: &str, p: &Params) -> edge_seeds::Settings {
    let surfaces = if p.word("surfaces") == "plane" { SurfaceTest::Planes } else { SurfaceTest::Depth };
    let hard = rbsm::Settings {
        function: if id.ends_with("-star") { Function::Star } else { Function::Silhouette },
        fixed_depth: p.word("receiver") == "fixed",
        max_distance: p.int("max_distance"),
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        slack: p.float("slack"),
    };
    edge_seeds::Settings {
        surfaces,
        tolerance: match p.float("edge_threshold") {
            0.0 => surfaces.usual_tolerance(),
            given => given,
        },
        any_surface: p.word("seeds") == "any",
        points: match p.word("edge") {
            "traced" => Points::Traced { hard, steps: STEPS },
            "between" => Points::Between,
            _ => Points::Pixels,
        },
    }
}

/// Returns the search window of a technique's blocker search.
pub fn search_window(p: &Params) -> SearchWindow {
    if p.word("search") == "near" { SearchWindow::Near } else { SearchWindow::Blockers }
}

/// Returns the form of a technique's blocker search.
pub fn search_form(p: &Params) -> SearchForm {
    SearchForm { mean_depth: p.word("mean") == "depth", fixed_depth: p.word("receiver") == "fixed" }
}

/// Returns the light, `factor` times as large.
pub fn enlarged(light: &LightView, factor: f64) -> LightView {
    let kind = match light.kind {
        LightKind::Spot { size } => LightKind::Spot { size: size * factor },
        LightKind::Directional { angle } => LightKind::Directional { angle: angle * factor },
    };
    LightView { kind, ..*light }
}

/// Records passes into a frame of their own, runs it and waits; returns what `passes` does.
pub fn run_passes<T>(host: &Host, passes: impl FnOnce(&mut Frame<'_>) -> edgeshade::Result<T>) -> T {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        let value = passes(&mut frame)?;
        frame.end();
        Ok(value)
    })
    .unwrap()
}

/// Uploads depths, row by row from the top; a shadow map is an array of images.
pub fn upload_depths(host: &Host, depths: &[f32], size: [u32; 2], array: bool) -> Image {
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { array, usage, ..ImageDesc::storage("depths made here", vk::Format::D32_SFLOAT, size) };
    host.upload_image(&desc, bytemuck::cast_slice(depths)).unwrap()
}

/// Returns inputs without normals and casters, of a light from which nothing is kept.
pub fn plain_inputs<'a>(camera: &'a CameraView, depth: &Image, map: &Image, light: &'a [LightView]) -> Inputs<'a> {
    let (depth, shadow_map) = (depth.as_ref(), map.as_ref());
    Inputs { camera, depth, normal: None, shadow_map, light, light_version: None, camera_version: None, casters: &[] }
}
