//! Tests of the example engine under the validation layer with synchronization validation: no messages and no wrong
//! pixels.
#![allow(missing_docs)]

#[path = "../examples/embed/engine.rs"]
mod engine;
#[path = "../examples/embed/gpu.rs"]
mod gpu;
#[path = "../examples/embed/mistakes.rs"]
mod mistakes;
#[path = "../examples/embed/scene.rs"]
mod scene;

use ash::vk;
use edgeshade::timing::FrameTiming;
use edgeshade::view::DepthRange;
use engine::{Engine, Options, VIEWS};
use gpu::{Gpu, Messages};
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

const EXTENT: [u32; 2] = [320, 240];
const FRAMES: u32 = 8;

/// Makes the layer check hazards across submissions, not only within a command buffer. Returns true if it had to be
/// asked, because layers from 1.3.281 on have their own default. Every test calls this before anything else of
/// Vulkan.
fn check_across_submissions() -> bool {
    static ASKED: OnceLock<bool> = OnceLock::new();
    *ASKED.get_or_init(|| {
        // SAFETY: the loader is loaded before anything else of Vulkan, and the entry outlives the call.
        let entry = unsafe { ash::Entry::load() }.unwrap();
        // SAFETY: the same.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap();
        let is_old = |l: &vk::LayerProperties| {
            l.layer_name_as_c_str() == Ok(c"VK_LAYER_KHRONOS_validation")
                && l.spec_version < vk::make_api_version(0, 1, 3, 281)
        };
        let asked = layers.iter().any(is_old);
        if asked {
            let check = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
            // SAFETY: every test waits here before it calls Vulkan, so nothing reads the environment at this time.
            unsafe { std::env::set_var("VK_LAYER_ENABLES", check) };
        }
        asked
    })
}

fn run(technique: &str, params: &[(&str, &str)], depth: DepthRange, normals: bool) {
    let options = Options { technique, params, depth, normals, ..OPTIONS };
    let times = draw_and_check(options);
    check_times(technique, &times);
}

const OPTIONS: Options<'_> = Options {
    technique: "sm",
    params: &[],
    extent: EXTENT,
    depth: DepthRange::Reversed,
    normals: false,
    map_format: vk::Format::D32_SFLOAT,
    throw_away: false,
    validation: None,
};

/// Draws frames under the validation layer and checks every second picture; returns the times of all frames.
fn draw_and_check(options: Options<'_>) -> Vec<FrameTiming> {
    check_across_submissions();
    let messages = Messages::default();
    let (technique, depth) = (options.technique, options.depth);
    let mut engine = Engine::new(&Options { validation: Some(messages.clone()), ..options }).unwrap();
    // Some pictures are not read back, because the barriers of the copy would hide missing ones between frames.
    let mut pictures = vec![];
    for frame in 0..FRAMES {
        let views = std::array::from_fn(|view| scene::moment(frame, view, EXTENT, depth));
        pictures.extend(engine.draw(views, frame % 2 == 1).unwrap());
    }
    pictures.extend(engine.finish().unwrap());
    let times = engine.times.clone();
    drop(engine);

    assert_eq!(*messages.lock().unwrap(), [""; 0], "messages of the validation layer");
    assert_eq!(pictures.len(), VIEWS * FRAMES as usize / 2);
    for (i, (moment, pixels)) in pictures.iter().enumerate() {
        let frame = i / VIEWS * 2 + 1;
        let verdict = moment.check(pixels, EXTENT);
        assert_eq!(verdict.wrong, 0, "{technique}, frame {frame}: {verdict:?}");
        let all = (EXTENT[0] * EXTENT[1]) as usize;
        let enough = verdict.lit > all / 4 && verdict.shadow > all / 100 && verdict.unsure < all / 10;
        assert!(enough && verdict.sky > all / 10, "{technique}, frame {frame}: {verdict:?}");
    }
    // The comparison can fail: the picture of another view or frame does not match.
    assert!((1..pictures.len()).all(|other| pictures[0].0.check(&pictures[other].1, EXTENT).wrong > 100));
    times
}

fn check_times(technique: &str, times: &[FrameTiming]) {
    assert_eq!(times.len(), VIEWS * FRAMES as usize, "views with times");
    for (i, time) in times.iter().enumerate() {
        let names: Vec<_> = time.passes.iter().map(|p| p.name.as_str()).collect();
        // The blocks depend only on the light, which moves every third frame and is the same for all views.
        let skipping: &[_] =
            if i % (3 * VIEWS) == 0 { &["depth bounds", "pcf classify", "pcf"] } else { &["pcf classify", "pcf"] };
        assert_eq!(names, if technique == "sm" { &["shadow test"] } else { skipping }, "view {i}");
        assert!(time.passes.iter().all(|p| p.gpu_ms > 0.0 && p.gpu_ms <= time.total_gpu_ms), "{time:?}");
        let tiles = time.passes.last().and_then(|p| p.tiles);
        assert!(technique == "sm" || tiles.is_some_and(|t| 0 < t.active && t.active < t.total), "{time:?}");
    }
}

#[test]
fn sm_with_standard_depth() {
    run("sm", &[], DepthRange::Standard, false);
}

#[test]
fn sm_with_reversed_depth_and_normals() {
    run("sm", &[], DepthRange::Reversed, true);
}

#[test]
fn pcf_with_standard_depth_and_normals() {
    run("pcf", &[("width", "5"), ("skip", "tiles")], DepthRange::Standard, true);
}

#[test]
fn pcf_with_reversed_depth() {
    run("pcf", &[("width", "5"), ("skip", "tiles")], DepthRange::Reversed, false);
}

const TILES: &[(&str, &str)] = &[("width", "5"), ("skip", "tiles")];

/// Draws a shadow map with 16-bit depth on the GPU.
#[test]
fn a_shadow_map_of_16_bits() {
    for (technique, params) in [("sm", &[][..]), ("pcf", TILES)] {
        draw_and_check(Options { technique, params, map_format: vk::Format::D16_UNORM, ..OPTIONS });
    }
}

/// Discards command buffers that never run, each before the frame whose results are kept.
#[test]
fn command_buffers_that_are_thrown_away() {
    draw_and_check(Options { technique: "pcf", params: TILES, throw_away: true, ..OPTIONS });
}

/// Checks that the example prints the input, or other fault, and the remedy for every mistake of `--mistakes`.
#[test]
fn mistakes_are_answered_with_input_and_remedy() {
    check_across_submissions();
    let answers = mistakes::all().unwrap();
    let wanted: &[(&str, &[&str])] = &[
        ("a colour image as the camera's depth", &["pcf: input depth", "R8G8B8A8_UNORM", "allowed are", "D32_SFLOAT"]),
        ("a colour image as the shadow map", &["input shadow_map", "R8G8B8A8_UNORM", "allowed are", "D16_UNORM"]),
        ("a multisampled depth buffer", &["input depth", "4 samples", "resolve it", "sample 0"]),
        ("a multisampled shadow map", &["input shadow_map", "2 samples", "resolve it", "sample 0"]),
        ("a depth buffer of another size than prepared for", &["input depth", "prepare one for each size"]),
        ("a shadow map of another size than prepared for", &["input shadow_map", "prepare one for each size"]),
        ("a shadow map in a layout that nothing can be read in", &["input shadow_map", "UNDEFINED", "state the one"]),
        ("a reversed-Z shadow map, stated as such", &["input light", "not supported", "render the map", "Standard"]),
        (
            "a reversed-Z shadow map, stated as standard",
            &["input light", "stated as Standard", "project the other way"],
        ),
        ("a standard shadow map, stated as reversed", &["input light", "stated as Reversed", "DepthRange::Standard"]),
        ("a camera of the other depth range than stated", &["input camera", "DepthRange::Standard"]),
        ("a directional light with a perspective projection", &["input light", "kind", "state LightKind::Spot"]),
        ("a light matrix with a NaN", &["input light", "clip_from_view", "not finite"]),
        ("a light matrix with an infinity", &["input light", "clip_from_view", "not finite"]),
        ("a light matrix of zeros", &["input light", "clip_from_view", "no inverse", "extents other than 0"]),
        ("a light matrix without inverse", &["input light", "clip_from_view", "no inverse", "extents other than 0"]),
        ("a light that stands at NaN", &["input light", "world_from_view", "not finite"]),
        ("a light with a scale in its transform", &["input light", "world_from_view", "leave scale"]),
        ("a camera matrix with a NaN", &["input camera", "clip_from_view", "not finite"]),
        ("a camera matrix of zeros", &["input camera", "clip_from_view", "no inverse", "extents other than 0"]),
        ("a camera whose transform is zero", &["input camera", "world_from_view", "length 1"]),
        ("a light whose size is NaN", &["input light", "size NaN", "0 (a point)"]),
        ("a light whose size is negative", &["input light", "size -1", "0 (a point)"]),
        ("casters beyond the end of their vertex buffer", &["caster mesh triangle", "first_vertex", "check"]),
        ("a device without VK_KHR_push_descriptor", &["enable the extension VK_KHR_push_descriptor"]),
    ];
    assert_eq!(answers.len(), wanted.len());
    for ((what, answer), (wanted_what, words)) in answers.iter().zip(wanted) {
        assert_eq!(what, wanted_what);
        assert!(words.iter().all(|w| answer.contains(w)), "{what}: {answer:?} lacks some of {words:?}");
    }
}

/// Checks that the layer is installed, validates synchronization both within a command buffer and across submissions,
/// and reports its messages.
#[test]
fn a_missing_barrier_is_noticed() {
    let must = check_across_submissions();
    for submissions in [1, 2] {
        let messages = Messages::default();
        let gpu = Gpu::new(Some(messages.clone())).unwrap();
        let (buffer, _) = gpu.readback(64).unwrap();
        let d = &gpu.device;
        // SAFETY: all handles are of this device, which destroys them after it is idle.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family);
            let pool = d.create_command_pool(&info, None).unwrap();
            gpu.at_exit(move |d| d.destroy_command_pool(pool, None));
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(submissions);
            let cmds = d.allocate_command_buffers(&info).unwrap();
            for &cmd in &cmds {
                d.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default()).unwrap();
                (submissions..=2).for_each(|i| d.cmd_fill_buffer(cmd, buffer, 0, 64, i));
                d.end_command_buffer(cmd).unwrap();
                let submit = vk::SubmitInfo::default().command_buffers(std::slice::from_ref(&cmd));
                d.queue_submit(gpu.queue, &[submit], vk::Fence::null()).unwrap();
            }
            d.device_wait_idle().unwrap();
        }
        drop(gpu);
        let heard = messages.lock().unwrap().iter().any(|m| m.contains("SYNC-HAZARD-WRITE-AFTER-WRITE"));
        if submissions == 1 || must {
            assert!(heard, "{submissions} submissions: {:?}", messages.lock().unwrap());
        } else if !heard {
            eprintln!("this validation layer does not check across submissions: hazards between frames go unnoticed");
        }
    }
}

/// Checks by hash that each `.spv` fits its source. `EDGESHADE_BLESS=1` recompiles them with glslangValidator.
#[test]
fn the_shaders_fit_their_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/embed");
    let bless = std::env::var_os("EDGESHADE_BLESS").is_some();
    let mut hashes = String::new();
    for (name, _) in engine::SHADERS {
        let [source, spirv] = [name.to_owned(), format!("{name}.spv")].map(|f| folder.join(f));
        if bless {
            let mut compile = Command::new("glslangValidator");
            compile.args(["-V", "--target-env", "vulkan1.3", "-g0", "-o"]).args([&spirv, &source]);
            assert!(compile.status().expect("glslangValidator (Debian: glslang-tools)").success(), "{name}");
        }
        let [source, spirv] = [source, spirv].map(|f| blake3::hash(&std::fs::read(f).unwrap()).to_hex());
        hashes += &format!("{source} {spirv} {name}\n");
    }
    let record = folder.join("HASHES");
    if bless {
        std::fs::write(&record, &hashes).unwrap();
    }
    let remedy = "run EDGESHADE_BLESS=1 cargo test --test embed shaders, and commit what it wrote";
    assert_eq!(std::fs::read_to_string(&record).unwrap(), hashes, "{remedy}");
}
