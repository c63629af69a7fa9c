//! Files in `tests/reports` that other tools wrote or might write, each with the expected result.
#![cfg(feature = "app")]

use edgeshade::picture::read_visibility;
use edgeshade::scene::{LightShape, MAX_SPOT_FOV, Projection, Scene, fit, light_view, light_view_for, load};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reports").join(name)
}

fn scene(name: &str) -> Scene {
    load(&file(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn counts(scene: &Scene) -> (usize, usize) {
    (scene.triangles(), scene.instances.len())
}

/// Runs the tool on a file in a temporary folder.
fn run(folder: &Path, command: &str, name: &str, args: &[&str]) -> Output {
    let mut tool = Command::new(env!("CARGO_BIN_EXE_edgeshade"));
    tool.arg(command).arg(file(name)).args(args).current_dir(folder).env("EDGESHADE_CACHE", folder);
    tool.output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn good(folder: &Path, command: &str, name: &str, args: &[&str]) -> Output {
    let output = run(folder, command, name, args);
    assert!(output.status.success(), "{name} {args:?}: {}", errors(&output));
    output
}

/// Results of `compare` for each technique at 640 x 360 pixels.
fn compare(name: &str, techniques: &str, args: &[&str]) -> Vec<(String, Value)> {
    let folder = tempfile::tempdir().unwrap();
    let all = [&["-t", techniques, "--size", "640x360", "--frames", "1", "--json", "-"], args].concat();
    let output = good(folder.path(), "compare", name, &all);
    let figures: Value = serde_json::from_slice(&output.stdout).unwrap();
    let left_out: u64 = figures["pixels_left_out"].as_object().unwrap().values().map(|v| v.as_u64().unwrap()).sum();
    let judged = figures["pixels_judged"].as_u64().unwrap();
    assert_eq!(left_out + judged, 640 * 360, "{name}: every pixel is judged or has a reason");
    assert!(judged > 1000, "{name}: {judged}");
    let results = figures["results"].as_array().unwrap();
    results.iter().map(|r| (r["technique"].as_str().unwrap().to_owned(), r.clone())).collect()
}

/// Share of wrong pixels in percent.
fn mismatch(result: &Value) -> f64 {
    100.0 * result["mismatch"].as_f64().unwrap()
}

#[test]
fn geometry_far_from_its_origin_keeps_its_shadows() {
    let far = scene("far_utm.glb");
    let centre = scene("far_centre.glb");
    assert_eq!(counts(&far), counts(&centre));
    for (mesh, by) in far.meshes.iter().zip(&centre.meshes) {
        let reach = |m: &edgeshade::scene::Mesh| m.bounds.min.abs().max(m.bounds.max.abs()).max_element();
        assert!(reach(mesh) <= 4.0 * reach(by), "{} of {}", reach(mesh), reach(by));
    }
    let (a, b) = (far.bounds(), centre.bounds());
    assert!(a.min.abs_diff_eq(b.min, 1e-6) && a.max.abs_diff_eq(b.max, 1e-6), "{a:?} {b:?}");
    for (technique, result) in compare("far_utm.glb", "sm,pcf,rbsm-star,edsm-x,shadow-volumes", &[]) {
        let most = match technique.as_str() {
            "edsm-x" | "shadow-volumes" => 0.01,
            "rbsm-star" => 0.05,
            _ => 0.1,
        };
        assert!(mismatch(&result) <= most, "{technique}: {} %", mismatch(&result));
    }
}

#[test]
fn a_caster_that_shadows_nothing_in_view_takes_no_texels() {
    for (technique, result) in compare("ships_20M.glb", "rbsm-star,pcss,edsm-x", &[]) {
        let most = if technique == "edsm-x" { 0.05 } else { 0.1 };
        assert!(mismatch(&result) <= most, "{technique}: {} %", mismatch(&result));
    }
    let width = |s: &Scene, camera: bool| {
        let view = s.cameras[0].view([640, 360]);
        let light = if camera { light_view_for(s, &s.lights[0], &view) } else { light_view(s, &s.lights[0]) };
        1.0 / light.clip_from_view.x_axis.x.abs()
    };
    let (far, near) = (scene("ships_20M.glb"), scene("ships_12.glb"));
    assert!(width(&far, true) <= width(&near, true), "{} {}", width(&far, true), width(&near, true));
    assert!(width(&far, false) > 1e6, "for any camera all of it counts: {}", width(&far, false));
    // A coarse map causes a warning.
    let folder = tempfile::tempdir().unwrap();
    let args = ["--shadow-map", "8", "--frames", "1", "--size", "640x360"];
    let output = good(folder.path(), "render", "ships_12.glb", &args);
    assert!(errors(&output).contains("a texel of the shadow map covers"), "{}", errors(&output));
}

#[test]
fn far_planes_far_beyond_the_scene_change_nothing() {
    let near = scene("cam_ortho.gltf");
    let usual = fit::clamp_clip_planes(&near, &near.cameras[0]).projection;
    for zfar in [1e6, 3e9, 3.4e38] {
        let clamped = fit::clamp_clip_planes(&near, &scene_with(&near, zfar).cameras[0]).projection;
        assert_eq!(clamped, usual, "{zfar}");
    }
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["cam_ortho.gltf", "cam_ortho_far1e6.gltf"].map(|name| {
        let path = folder.path().join(format!("{name}.png"));
        let out = path.display().to_string();
        let args = ["--view", "visibility", "--size", "320x180", "--frames", "1", "-o", &out];
        good(folder.path(), "render", name, &args);
        read_visibility(&path, [320, 180]).unwrap()
    });
    assert!(a == b && a.contains(&0.0) && a.contains(&1.0));
}

/// The scene with another far plane of its camera.
fn scene_with(scene: &Scene, zfar: f64) -> Scene {
    let mut scene = scene.clone();
    if let Projection::Orthographic { far, .. } = &mut scene.cameras[0].projection {
        *far = zfar;
    }
    scene
}

#[test]
fn the_ground_is_lit_up_to_the_horizon() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.png");
    let out = path.display().to_string();
    for normals in ["visibility", "normal"] {
        let args = ["-t", "sm", "--view", normals, "--size", "640x360", "--frames", "1", "-o", &out];
        good(folder.path(), "render", "hz_2000_1.2.glb", &args);
        if normals == "visibility" {
            let values = read_visibility(&path, [640, 360]).unwrap();
            let dark = values[159 * 640..161 * 640].iter().filter(|v| **v < 1.0).count();
            assert_eq!(dark, 0, "pixels of the last rows below the horizon");
        } else {
            let picture = image::open(&path).unwrap().into_rgb8();
            // +Y is stored as (128, 255, 128); the sky is black.
            for x in 0..640 {
                let [r, g, b] = picture.get_pixel(x, 159).0;
                assert!(g == 255 && r.abs_diff(128) <= 1 && b.abs_diff(128) <= 1, "{x}: {r} {g} {b}");
            }
        }
    }
}

#[test]
fn a_light_within_a_mesh_lights_nothing_outside() {
    for size in ["0.02", "0.05"] {
        let techniques = "pcss,rbssm,ssabss,ssrbssm,soft-auto,edtssm,edtssm-star";
        for (technique, result) in compare("bulb.glb", techniques, &["--light-size", size, "--samples", "64"]) {
            let mae = result["mae"].as_f64().unwrap();
            assert!(mismatch(&result) <= 0.05 && mae <= 0.005, "{technique}, {size}: {} %, {mae}", mismatch(&result));
        }
    }
}

/// Walls without thickness leak at their joints. The default bias of revectorization, 0.3 texel slopes, is what curved
/// receivers need: on `ripples` it leaves 0.41 % of the pixels wrong, a bias of 0.1 leaves 0.54 %, and none 1.2 %.
#[test]
fn joints_of_thin_walls_leak_no_more_than_the_bias() {
    let techniques = "sm,rbsm,rbsm-star:depth_bias=0,rbsm-star,edtsm-star,pcf";
    let found = compare("room_thin.glb", techniques, &[]);
    let [sm, rbsm, unbiased, rbsm_star, edtsm_star, pcf] = [0, 1, 2, 3, 4, 5].map(|i| mismatch(&found[i].1));
    println!(
        "sm {sm}, rbsm {rbsm}, without bias {unbiased}, rbsm-star {rbsm_star}, edtsm-star {edtsm_star}, pcf {pcf} %"
    );
    assert!(sm < 0.04 && rbsm <= sm && unbiased < 0.05, "{sm} {rbsm} {unbiased}");
    assert!(rbsm_star < 0.12 && edtsm_star < 0.12 && pcf < 0.2, "{rbsm_star} {edtsm_star} {pcf}");
}

#[test]
fn what_a_file_hides_stays_hidden() {
    assert_eq!(counts(&scene("hidden.glb")), (14, 2));
    // The same holds if the file requires the extension.
    let bytes = std::fs::read(file("hidden.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    json["extensionsRequired"] = serde_json::json!(["KHR_node_visibility"]);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &bytes[20 + length..];
    let total = (20 + text.len() + rest.len()) as u32;
    let mut required = [&b"glTF"[..], &2u32.to_le_bytes(), &total.to_le_bytes()].concat();
    required.extend([&(text.len() as u32).to_le_bytes()[..], b"JSON", &text, rest].concat());
    assert_eq!(counts(&edgeshade::scene::load_bytes("required", &required).unwrap()), (14, 2));
    // Glass casts no shadow, whichever way the file describes it.
    let glass = scene("transmission.glb");
    assert_eq!(counts(&glass), (2, 1));
    assert!(
        glass.warnings.iter().any(|w| w.contains("\"pane\" and 1 more") && w.contains("glass")),
        "{:?}",
        glass.warnings
    );
}

#[test]
fn paths_as_people_write_them() {
    for name in ["uris/backslash.gltf", "uris/literal_percent20.gltf", "uris/uri_newlines.gltf", "glb_json_nul.glb"] {
        let scene = scene(name);
        assert_eq!((scene.triangles(), scene.warnings.len()), (14, 0), "{name}");
    }
    // Names with a colon, and with an accent that is composed in the file and decomposed on disk.
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(file("uris/literal_percent20.gltf")).unwrap();
    let buffer = file("uris/big%20ball.bin");
    for (uri, on_disk) in
        [("a:b.bin", "a:b.bin"), ("gr\u{fc}n.bin", "gru\u{308}n.bin"), ("gru%CC%88n.bin", "gr\u{fc}n.bin")]
    {
        std::fs::copy(&buffer, folder.path().join(on_disk)).unwrap();
        let path = folder.path().join("scene.gltf");
        std::fs::write(&path, text.replace("big%20ball.bin", uri)).unwrap();
        assert_eq!(load(&path).unwrap_or_else(|e| panic!("{uri}: {e}")).triangles(), 14);
        std::fs::remove_file(folder.path().join(on_disk)).unwrap();
        assert!(load(&path).is_err(), "{uri}");
    }
}

#[test]
fn a_view_that_is_not_used_may_be_broken() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["--size", "64x36", "--frames", "1"];
    let output = good(folder.path(), "render", "cam_znear0_second.gltf", &small);
    assert!(
        errors(&output).contains("warning: cam_znear0_second: cameras[1].perspective.znear: is 0"),
        "{}",
        errors(&output)
    );
    let output = run(folder.path(), "render", "cam_znear0_second.gltf", &[&small[..], &["--camera", "1"]].concat());
    let text = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("cam_znear0_second.gltf: cameras[1].perspective.znear: is 0") && text.contains("--camera"),
        "{text}"
    );
    let name = "cam_spot_outer0.gltf";
    let output = good(folder.path(), "render", name, &[&small[..], &["--light", "sun:300,40"]].concat());
    assert!(errors(&output).contains("outerConeAngle: is 0"), "{}", errors(&output));
    let output = run(folder.path(), "render", name, &small);
    let text = errors(&output);
    assert!(
        output.status.code() == Some(1) && text.contains("outerConeAngle: is 0") && text.contains("--light"),
        "{text}"
    );
}

#[test]
fn a_texture_that_only_colours_may_be_missing() {
    let scene = scene("tex_webp_optional.glb");
    assert_eq!((scene.triangles(), scene.textures.len()), (4, 0));
    assert!(scene.warnings.iter().any(|w| w.starts_with("textures[0].source: ")), "{:?}", scene.warnings);
}

#[test]
fn a_cone_wider_than_a_map_is_told() {
    let spot = scene("spot_90.glb");
    let LightShape::Spot { outer, .. } = spot.lights[0].shape else { panic!("a spot") };
    assert!(2.0 * outer > MAX_SPOT_FOV);
    let folder = tempfile::tempdir().unwrap();
    let output = good(folder.path(), "render", "spot_90.glb", &["--size", "64x36", "--frames", "1"]);
    let text = errors(&output);
    assert!(text.contains("\"light 0\" has a cone of 90 degrees") && text.contains("holds 80"), "{text}");
}

#[test]
fn a_floor_of_its_own_is_enough() {
    let own = scene("box_on_own_floor.glb");
    assert!(fit::has_floor(&own));
    // The box alone has no floor.
    let mut bare = own.clone();
    bare.instances.remove(0);
    assert!(!fit::has_floor(&bare));
    // The camera shows the casters, not all of the floor.
    let camera = fit::camera(&own, [1280, 720]).view([1280, 720]);
    let columns = own.instance_bounds(&own.instances[1]).corners().map(|c| {
        let clip = camera.clip_from_view * camera.world_from_view.inverse().transform_point3(c).extend(1.0);
        clip.x / clip.w
    });
    let width = columns.iter().fold(f64::MIN, |a, b| a.max(*b)) - columns.iter().fold(f64::MAX, |a, b| a.min(*b));
    assert!(width / 2.0 > 0.2, "the box takes {} of the picture's width", width / 2.0);
    let folder = tempfile::tempdir().unwrap();
    let output = good(folder.path(), "render", "box_on_own_floor.glb", &["--size", "64x36", "--frames", "1"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("14 triangles in 2 objects"));
}

/// A floor may face down if it is double-sided, but the bottom of a box is no floor. The ground never shares its depth
/// with a rug.
#[test]
fn floors_face_any_way_and_rugs_lie_above_the_ground() {
    let own = scene("box_on_own_floor.glb");
    let mut turned = own.clone();
    let floor = own.instances[0].mesh;
    turned.meshes[floor].indices.chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
    turned.materials.iter_mut().for_each(|m| m.double_sided = false);
    assert!(!fit::has_floor(&turned));
    turned.materials.iter_mut().for_each(|m| m.double_sided = true);
    assert!(fit::has_floor(&turned));
    turned.instances.remove(0);
    assert!(!fit::has_floor(&turned), "a double-sided box alone");

    let ground = |scene: &Scene| {
        let mut scene = scene.clone();
        fit::add_ground(&mut scene);
        scene.instances.last().unwrap().world_from_object.translation.y
    };
    let mut rug = own.clone();
    rug.instances[0].world_from_object.matrix3 *= 0.02;
    assert!(!fit::has_floor(&rug));
    assert!(ground(&rug) < rug.bounds().min.y);
    assert_eq!(ground(&turned), turned.bounds().min.y);
}

#[test]
fn a_mask_without_seeds_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let seeds = |name: &str, args: &[&str]| {
        let output = good(folder.path(), "edt", name, &[args, &["--json", "-", "--frames", "1"]].concat());
        let figures: Value = serde_json::from_slice(&output.stdout).unwrap();
        let warnings: Vec<_> =
            errors(&output).lines().filter(|l| l.starts_with("warning")).map(str::to_owned).collect();
        (figures["seeds"].as_u64().unwrap(), warnings.join("\n"))
    };
    assert_eq!(seeds("l8.png", &[]), (14, String::new()));
    assert_eq!(seeds("l8_01.png", &["--threshold", "1"]), (14, String::new()));
    let (none, text) = seeds("l8_01.png", &[]);
    assert!(none == 0 && text.contains("the brightest pixel has 1; see --threshold"), "{text}");
    let output = run(folder.path(), "edt", "wide20000.png", &["--method", "auto"]);
    if output.status.code() != Some(0) {
        let text = errors(&output);
        assert!(text.contains("wide20000.png: size: 20000 pixels") && text.contains("--method brute"), "{text}");
    }
    assert!(seeds("wide20000.png", &["--method", "brute"]).0 > 0);
}
