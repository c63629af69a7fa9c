//! Tests of the built tool, run the way a user runs it.
#![cfg(feature = "app")]

mod browser;
mod json_page;

use edgeshade::technique::{ALL, Kind};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Instant;
use tempfile::TempDir;

/// A test's own folder, with a cache of truths inside.
struct Place(TempDir, Instant);

/// Prints the time for `.ci/run`, which lists the slowest tests.
impl Drop for Place {
    fn drop(&mut self) {
        println!("seconds {:.1} {}", self.1.elapsed().as_secs_f64(), std::thread::current().name().unwrap_or_default());
    }
}

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap(), Instant::now())
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_edgeshade"));
        command.args(args).current_dir(self.0.path()).env("EDGESHADE_CACHE", self.0.path().join("cache"));
        command
    }

    fn run(&self, args: &[&str]) -> Output {
        let output = self.command(args).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("panicked") && !stderr.contains("RUST_BACKTRACE"), "{args:?}: {stderr}");
        output
    }

    /// Runs a command that must succeed and returns its standard output.
    fn good(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs a command that must succeed and write JSON to standard output, and checks that docs/json.md describes
    /// every field.
    fn json(&self, args: &[&str]) -> Value {
        let written: Value = serde_json::from_str(&self.good(args)).unwrap();
        json_page::check(args[0], &written);
        assert_eq!(written["command"], serde_json::json!([&["edgeshade"], args].concat()));
        written
    }

    /// Figures that a suite wrote into the folder `out`.
    fn figures(&self) -> Value {
        let mut files = std::fs::read_dir(self.path("out")).unwrap().map(|e| e.unwrap().path());
        let json = files.find(|p| p.extension().is_some_and(|e| e == "json")).unwrap();
        let figures = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
        json_page::check("bench", &figures);
        figures
    }

    /// Runs a command that must fail with this status and a message that contains each of these texts.
    fn bad(&self, args: &[&str], status: i32, texts: &[&str]) {
        let output = self.run(args);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{args:?}: {stderr}");
        for text in texts {
            assert!(stderr.contains(text), "{args:?}: {text:?} is not in: {stderr}");
        }
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn png_size(&self, name: &str) -> (u32, u32) {
        image_size(&self.path(name))
    }
}

/// Reads width and height from a PNG's header.
fn image_size(path: &Path) -> (u32, u32) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn help_shows_examples_and_bare_calls_are_usage_errors() {
    let place = Place::new();
    for sub in ["render", "compare", "bench", "list", "devices", "pipelines", "scenes"] {
        let help = place.good(&[sub, "--help"]);
        assert!(help.contains("Example") && help.contains(&format!("edgeshade {sub}")), "{help}");
    }
    assert!(place.good(&["--help"]).contains("Exit status"));
    assert!(place.good(&["--version"]).contains(env!("CARGO_PKG_VERSION")));
    place.bad(&[], 2, &["Usage"]);
    place.bad(&["paint"], 2, &["paint"]);
}

#[test]
fn lists_are_text_and_json() {
    let place = Place::new();
    let techniques = place.json(&["list", "--json"]);
    let ids: Vec<_> =
        techniques["techniques"].as_array().unwrap().iter().map(|t| t["id"].as_str().unwrap().to_owned()).collect();
    let table = place.good(&["list"]);
    for id in &ids {
        assert!(table.lines().any(|l| l.starts_with(id.as_str())), "{table}");
    }
    let pcf = place.json(&["list", "pcf", "--json"]);
    assert_eq!((&pcf["params"][0]["name"], &pcf["params"][0]["default"]), (&"width".into(), &3.into()));
    assert!(place.good(&["list", "pcf"]).contains("width=3"));
    place.bad(&["list", "pfc"], 2, &["pfc", "sm, pcf"]);
    assert_eq!(pcf["needs"], serde_json::json!([]));
    let edsm = place.json(&["list", "edsm", "--json"]);
    let needs: Vec<_> = edsm["needs"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    assert!(needs.iter().any(|n| n.contains("casters")) && needs.iter().any(|n| n.contains("dynamicRendering")));
    assert!(place.good(&["list", "edsm"]).contains("needs raster passes (dynamicRendering)"));

    let scenes = place.json(&["scenes", "--json"]);
    assert!(scenes["scenes"].as_array().unwrap().iter().all(|s| s["triangles"].as_u64().unwrap() > 1000));
    assert!(place.good(&["scenes"]).contains("jenga"));
    let devices = place.json(&["devices", "--json"]);
    let name = devices["devices"][0]["name"].as_str().unwrap();
    assert!(place.good(&["devices"]).contains(name));
    let suites = place.json(&["bench", "--list", "--json"]);
    let suites: Vec<_> = suites["suites"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    let list = place.good(&["bench", "--list"]);
    assert!(
        suites.len() > 10 && suites.iter().all(|s| list.lines().any(|l| l.starts_with(&format!("  {s} ")))),
        "{list}"
    );
    assert!(!place.path("edgeshade-bench").exists());

    // Every page fits a terminal.
    let of_each = ids.iter().map(|id| vec!["list", id]);
    for args in [vec!["list"], vec!["scenes"], vec!["devices"], vec!["bench", "--list"]].into_iter().chain(of_each) {
        let page = place.good(&args);
        assert!(page.lines().count() > 1, "{args:?}: {page}");
        for line in page.lines() {
            assert!(line.chars().count() <= 80 && !line.ends_with(' '), "{args:?}: {line:?}");
        }
    }
}

#[test]
fn json_means_the_same_everywhere() {
    let place = Place::new();
    for args in [&["list"][..], &["list", "pcf"], &["scenes"], &["devices"], &["bench", "--list"]] {
        let printed = place.json(&[args, &["--json"]].concat());
        let dash = place.json(&[args, &["--json", "-"]].concat());
        // With a JSON file, text for people still goes to standard output.
        let text = place.good(&[args, &["--json", "new/folder/a.json"]].concat());
        assert_eq!(text, place.good(args));
        let file: Value = serde_json::from_slice(&std::fs::read(place.path("new/folder/a.json")).unwrap()).unwrap();
        std::fs::remove_dir_all(place.path("new")).unwrap();
        let without_command = |mut v: Value| {
            v.as_object_mut().unwrap().remove("command");
            v
        };
        let printed = without_command(printed);
        assert_eq!([without_command(dash), without_command(file)], [printed.clone(), printed], "{args:?}");
    }
    let small = ["--size", "32x18", "--frames", "1", "--shadow-map", "64"];
    for command in ["render", "compare"] {
        let args = [&[command, "jenga", "-t", "sm"], &small[..]].concat();
        let printed = place.json(&[&args[..], &["--json"]].concat());
        place.good(&[&args[..], &["--json", "new/a.json"]].concat());
        let file: Value = serde_json::from_slice(&std::fs::read(place.path("new/a.json")).unwrap()).unwrap();
        assert_eq!(file["scene"], printed["scene"]);
    }
    // A scene or a technique behind the option is not taken for the file.
    for args in [&["render", "--json", "jenga"][..], &["list", "--json", "pcf"], &["bench", "--json", "pcf", "--list"]]
    {
        place.bad(args, 2, &[".json", "standard output"]);
        assert!(!place.path(args[2]).exists());
    }
}

const SMALL: [&str; 4] = ["--size", "256x144", "--frames", "2"];

#[test]
fn statistics_are_written_where_asked_for() {
    let place = Place::new();
    let plain = place.json(&[&["render", "jenga", "-t", "sm", "--json", "-"], &SMALL[..]].concat());
    assert!(plain["passes"].as_array().unwrap().iter().all(|p| p.get("statistics").is_none()));
    let set = |technique: &str| {
        let args = [&["render", "jenga", "-t", technique, "--set", "width=5", "--json", "-"], &SMALL[..]].concat();
        let params = place.json(&args)["params"].clone();
        (params["width"].clone(), params["taps"].clone())
    };
    assert_eq!(set("pcf:preset=published, width=9"), (5.into(), "nearest".into()));
    assert_eq!(set("pcf"), (5.into(), "bilinear".into()));
    place.bad(&["render", "jenga", "-t", "pcf:width"], 2, &["-t pcf:width", "name=value"]);
    let counted = place.json(&[&["render", "jenga", "-t", "sm", "--statistics", "--json", "-"], &SMALL[..]].concat());
    let of = |pass: &str, figure: &str| {
        let passes = counted["passes"].as_array().unwrap();
        passes.iter().find(|p| p["name"] == pass).unwrap()["statistics"][figure].as_u64().unwrap()
    };
    assert_eq!(of("shadow test", "compute_invocations"), 256 * 144);
    assert!(of("g-buffer", "input_primitives") > 1000 && of("g-buffer", "fragment_invocations") > 1000);
    let table = place.good(&[&["render", "jenga", "-t", "sm", "--statistics"], &SMALL[..]].concat());
    assert!(table.lines().any(|l| l.contains("primitives") && l.contains("fragments")), "{table}");
}

#[test]
fn render_writes_picture_and_figures() {
    let place = Place::new();
    let args =
        ["render", "jenga", "-o", "new/a.png", "--json", "-", "--set", "width=5", "--set", "skip=tiles", "--validate"];
    let figures = place.json(&[&args[..], &SMALL].concat());
    assert_eq!(place.png_size("new/a.png"), (256, 144));
    for name in ["device", "driver", "version", "scene", "technique", "params", "passes", "memory_bytes"] {
        assert!(!figures[name].is_null(), "{name}: {figures}");
    }
    assert_eq!((&figures["scene"], &figures["technique"]), (&"jenga".into(), &"pcf".into()));
    assert_eq!((&figures["params"]["width"], &figures["params"]["skip"]), (&5.into(), &"tiles".into()));
    assert_eq!((&figures["size"], &figures["shadow_map"]), (&serde_json::json!([256, 144]), &1024.into()));
    assert_eq!((&figures["frames"], figures["memory_bytes"].as_u64() > Some(256 * 144)), (&2.into(), true));
    assert_eq!(figures["validation_messages"], serde_json::json!([]));
    let passes = figures["passes"].as_array().unwrap();
    let names: Vec<_> = passes.iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"shadow map") && names.contains(&"g-buffer") && names.contains(&"shade"), "{names:?}");
    for p in passes {
        let [min, median, max] = ["gpu_ms_min", "gpu_ms", "gpu_ms_max"].map(|k| p[k].as_f64().unwrap());
        assert!(0.0 <= min && min <= median && median <= max, "{p}");
    }
    let tiled = passes.iter().find(|p| p["tiles_total"].is_u64()).expect("a pass that skips");
    assert!(tiled["tiles_active"].as_u64() <= tiled["tiles_total"].as_u64());
    assert!(figures["total_gpu_ms"].as_f64().unwrap() >= passes[0]["gpu_ms_min"].as_f64().unwrap());

    let text = place.good(&[&["render", "jenga", "-o", "b.png", "--json", "b.json"][..], &SMALL].concat());
    for part in ["jenga: 7200 triangles", "shadow map", "gpu ms", "wrote b.png", "from start to picture"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let file: Value = serde_json::from_slice(&std::fs::read(place.path("b.json")).unwrap()).unwrap();
    assert_eq!(file["output"], "b.png");
}

#[test]
fn the_wall_clock_gives_the_same_picture_and_passes() {
    let place = Place::new();
    let render = |timing: &str| {
        let args = ["render", "jenga", "--timing", timing, "-o", "a.png", "--json", "a.json", "--set", "skip=tiles"];
        let text = place.good(&[&args[..], &SMALL, &["--validate"]].concat());
        let read = |name: &str| std::fs::read(place.path(name)).unwrap();
        let figures: Value = serde_json::from_slice(&read("a.json")).unwrap();
        assert_eq!(figures["timing"], timing);
        let is_noted = text.lines().any(|line| line == "times: wall clock, one submission per pass");
        assert_eq!(is_noted, timing == "wall", "{text}");
        let passes = figures["passes"].as_array().unwrap();
        let passes: Vec<_> =
            passes.iter().map(|p| ["name", "tiles_total", "tiles_active"].map(|k| p[k].clone())).collect();
        (passes, read("a.png"))
    };
    let (passes, picture) = render("timestamps");
    let (wall_passes, wall_picture) = render("wall");
    assert!(passes.len() > 3 && passes == wall_passes, "{passes:?} {wall_passes:?}");
    assert!(picture == wall_picture, "the pictures differ");

    let compare = ["compare", "jenga", "-t", "sm", "--frames", "1", "--samples", "4", "--size", "64x36"];
    let args = [&compare[..], &["--timing", "wall", "-o", "out"]].concat();
    let text = place.good(&args);
    assert!(text.contains("times: wall clock, one submission per pass\n"), "{text}");
    let written: Value = serde_json::from_slice(&std::fs::read(place.path("out/results.json")).unwrap()).unwrap();
    assert_eq!(written["timing"], "wall");
    let figures = place.json(&[&compare[..], &["--timing", "timestamps", "--json", "-"]].concat());
    assert_eq!(figures["timing"], "timestamps");
    place.bad(&["render", "--timing", "sundial"], 2, &["--timing", "auto", "timestamps", "wall"]);
}

#[test]
fn every_view_is_a_picture_of_its_own() {
    let place = Place::new();
    let mut seen: Vec<Vec<u8>> = vec![];
    for view in ["shaded", "visibility", "depth", "normal", "shadow-map", "albedo", "error"] {
        for file in ["a.png", "a.exr"] {
            let args = ["render", "jenga", "--view", view, "-o", file, "--frames", "1", "--size", "96x54"];
            place.good(&[&args[..], &["--samples", "16", "--shadow-map", "256"]].concat());
            let bytes = std::fs::read(place.path(file)).unwrap();
            assert!(!seen.contains(&bytes), "{view} {file}");
            seen.push(bytes);
        }
    }
    // Repeating the command gives the same picture; more samples per pixel give another one of the same size.
    let shaded = ["render", "jenga", "-o", "a.png", "--frames", "1", "--size", "96x54", "--shadow-map", "256"];
    place.good(&shaded);
    assert_eq!(std::fs::read(place.path("a.png")).unwrap(), seen[0]);
    place.good(&[&shaded[..], &["--supersample", "2"]].concat());
    assert_eq!(place.png_size("a.png"), (96, 54));
    assert_ne!(std::fs::read(place.path("a.png")).unwrap(), seen[0]);
}

#[test]
fn techniques_show_what_they_find_on_the_way() {
    let place = Place::new();
    let mut seen: Vec<Vec<u8>> = vec![];
    let base = ["render", "jenga", "-t", "rbsm-profile", "-o", "a.png", "--frames", "1", "--size", "96x54"];
    for view in ["discontinuity", "runs", "ends", "profile-height"] {
        place.good(&[&base[..], &["--shadow-map", "128", "--view", view]].concat());
        let bytes = std::fs::read(place.path("a.png")).unwrap();
        assert!(!seen.contains(&bytes), "{view}");
        seen.push(bytes);
    }
    let edges = ["render", "jenga", "-o", "a.png", "--frames", "1", "--size", "96x54", "--shadow-map", "128"];
    for (id, view) in [("shadow-volumes", "silhouettes"), ("edsm-x", "edge-ids"), ("edsm-x", "shaded")] {
        place.good(&[&edges[..], &["-t", id, "--view", view]].concat());
        assert_eq!(place.png_size("a.png"), if view == "edge-ids" { (127, 127) } else { (96, 54) });
        let bytes = std::fs::read(place.path("a.png")).unwrap();
        assert!(!seen.contains(&bytes), "{id} {view}");
        seen.push(bytes);
    }
    place.bad(&[&base[..], &["--view", "rnus"]].concat(), 2, &["rnus", "shadow-map", "discontinuity, runs, ends"]);
}

/// An upright triangle and nothing else.
const LONE_TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0,
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn scenes_come_by_name_and_by_path_and_views_can_be_given() {
    let place = Place::new();
    place.good(&["scenes", "--write", "made"]);
    let picture = |args: &[&str]| {
        place.good(&[&["render", "-o", "a.png", "--frames", "1", "--size", "96x54"], args].concat());
        std::fs::read(place.path("a.png")).unwrap()
    };
    let plain = picture(&["jenga"]);
    assert_eq!(picture(&["made/jenga.glb"]), plain);
    assert_eq!(picture(&["jenga", "--camera", "0", "--light", "0", "--scene-index", "0"]), plain);
    for other in [
        &["jenga", "--camera", "-0.6,0.5,0.9:0,0.2,0"][..],
        &["jenga", "--light", "sun:-40,30"],
        &["jenga", "--light", "spot:1,2,1:0,0.2,0:50"],
        &["jenga", "-t", "sm"],
        &["jenga", "-t", "ray-traced", "--samples", "16"],
        &["jenga", "-t", "area-samples", "--samples", "4"],
        &["jenga", "--caster-bias", "0,80"],
    ] {
        assert_ne!(picture(other), plain, "{other:?}");
    }
    // A lone object gets a camera, a light and a ground.
    std::fs::write(place.path("lone.gltf"), LONE_TRIANGLE).unwrap();
    assert_ne!(picture(&["lone.gltf"]), picture(&["lone.gltf", "--ground", "off"]));
    // A file without any object still gives a picture of the sky.
    std::fs::write(place.path("empty.gltf"), r#"{"asset":{"version":"2.0"}}"#).unwrap();
    picture(&["empty.gltf"]);
}

#[test]
fn wrong_usage_is_status_2_and_says_what_is_allowed() {
    let place = Place::new();
    for (args, texts) in [
        (&["-t", "pfc"][..], &["edgeshade: ", "pfc", "sm, pcf"][..]),
        (&["-t", "rbsmstar"], &["did you mean \"rbsm-star\"?"]),
        (&["--set", "widht=3"], &["widht", "did you mean \"width\"?", "It has: width"]),
        (&["--set", "width=4"], &["width=4", "odd, 1 to 63"]),
        (&["--set", "width"], &["name=value"]),
        (&["castle"], &["castle", "courtyard", ".glb"]),
        (&["courtyrad"], &["did you mean \"courtyard\"?"]),
        (&["--view", "shdaed"], &["did you mean \"shaded\"?"]),
        (&["--size", "12"], &["WxH"]),
        (&["--size", "99999x2"], &["16384"]),
        (&["--shadow-map", "0"], &["16384"]),
        (&["-o", "a.jpg"], &["a.jpg", ".png or .exr"]),
        (&["--view", "blur"], &["blur", "shaded, visibility"]),
        (&["--camera", "nobody"], &["nobody", "it has: 0"]),
        (&["--camera", "1,2,3:1,2,3"], &["--camera"]),
        (&["--light", "moon"], &["moon", "it has: 0"]),
        (&["--light", "sun:1"], &["AZIMUTH"]),
        (&["--light", "spot:0,0,0:0,0,0:10"], &["same"]),
        (&["--light-size", "-1"], &["light-size"]),
        (&["--scene-index", "3", "jenga"], &["scene 3"]),
        (&["--supersample", "5"], &["supersample"]),
        (&["--supersample", "2", "--view", "depth"], &["depth"]),
        (&["--frames", "0"], &["frames"]),
    ] {
        let small = ["render", "--size", "32x18"];
        let args = if args[0] == "--size" { [&["render"], args].concat() } else { [&small, args].concat() };
        place.bad(&args, 2, texts);
    }
    place.bad(&["bench", "--suite", "pfc"], 2, &["did you mean \"pcf\"?"]);
    place.bad(&["compare", "-t", "sm,nope"], 2, &["nope"]);
    place.bad(&["compare", "-t", "pcf:width"], 2, &["name=value"]);
    place.bad(&["compare", "--reference", "guess"], 2, &["guess", "ray-traced"]);
    place.bad(
        &["bench", "--suite", "pcf,nope"],
        2,
        &["nope", "techniques, map-sizes, revectorization, pcf, penumbrae, ", ", penumbra, "],
    );
}

#[test]
fn failed_work_is_status_1_and_names_the_file() {
    let place = Place::new();
    std::fs::write(place.path("broken.glb"), b"glTF\x02\0\0\0 but no more").unwrap();
    place.bad(&["render", "broken.glb"], 1, &["edgeshade: ", "broken.glb"]);
    place.bad(&["render", "missing.glb"], 1, &["missing.glb"]);
    std::fs::write(place.path("file"), b"").unwrap();
    for args in [
        &["render", "-o", "file/a.png"][..],
        &["render", "--json", "file/a.json"],
        &["compare", "-o", "file"],
        &["compare", "--json", "file/a.json"],
        &["bench", "--suite", "shapes", "-o", "file"],
        &["bench", "--suite", "shapes", "--json", "file/a.json"],
        &["list", "--json", "file/a.json"],
        &["scenes", "--write", "file"],
    ] {
        place.bad(args, 1, &["file"]);
    }
    place.bad(&["render", "--device", "no such device"], 1, &["no such device", "0: "]);
    assert!(!place.path("shadow.png").exists());
}

#[test]
fn without_a_driver_the_message_says_what_to_install() {
    let place = Place::new();
    std::fs::write(place.path("none.json"), b"").unwrap();
    for args in [&["render"][..], &["devices"]] {
        let mut command = place.command(args);
        for name in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(name, place.path("none.json"));
        }
        let output = command.output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains("mesa-vulkan-drivers"), "{stderr}");
    }
}

#[test]
fn a_closed_pipe_is_no_fault_and_a_full_disk_is() {
    let place = Place::new();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = place.command(&["list"]).stdout(writer).output().unwrap();
    assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
    if let Ok(full) = std::fs::File::options().write(true).open("/dev/full") {
        let output = place.command(&["list"]).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
    }
}

/// Words of an array.
fn words(value: &Value) -> Vec<&str> {
    value.as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect()
}

#[test]
fn pipelines_are_listed_with_their_users() {
    let place = Place::new();
    let all = place.json(&["pipelines", "--validate", "--json"]);
    assert_eq!(all["validation_messages"], serde_json::json!([]));
    let has_statistics = all["has_statistics"].as_bool().unwrap();
    let pipelines = all["pipelines"].as_array().unwrap();
    let left_out = words(&all["left_out"]);
    let techniques = ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))).map(|t| t.id);
    for user in techniques.chain(["renderer"]) {
        let is_left_out = left_out.iter().any(|line| line.starts_with(&format!("{user}, ")));
        let is_used = pipelines.iter().any(|p| words(&p["users"]).contains(&user));
        assert!(is_used != is_left_out, "{user}: {left_out:?}");
    }
    for pipeline in pipelines {
        assert!(!words(&pipeline["shaders"]).is_empty(), "{pipeline}");
        assert_eq!(pipeline["programs"].as_array().unwrap().is_empty(), !has_statistics, "{pipeline}");
    }
    let users_of = |name: &str| words(&pipelines.iter().find(|p| p["pipeline"] == name).unwrap()["users"]);
    assert_eq!((users_of("filtering/pcf.comp"), users_of("common/shade.comp")), (vec!["pcf"], vec!["renderer"]));
    let users = users_of("common/depth_bounds.comp");
    assert!(users.starts_with(&["rpcf", "edtsm"]) && users.contains(&"rbssm") && !users.contains(&"pcf"), "{users:?}");
    let text = place.good(&["pipelines"]);
    assert!(text.contains("filtering/pcf.comp WIDTH=3 ") && text.contains("shadow map, masked"), "{text}");
    assert_eq!(text.contains("no statistics"), !has_statistics, "{text}");

    let pcf = place.json(&["pipelines", "-t", "pcf:width=7", "--json", "-"]);
    assert_eq!(pcf["techniques"][0]["params"]["width"], 7);
    let own = pcf["pipelines"].as_array().unwrap();
    assert!(own.len() < pipelines.len() && own.iter().all(|p| words(&p["users"]) == ["pcf"]), "{pcf}");
    assert!(own.iter().any(|p| p["pipeline"] == "filtering/pcf.comp" && p["constants"]["WIDTH"] == 7), "{pcf}");

    place.bad(&["pipelines", "-t", "pfc"], 2, &["pfc", "sm, pcf"]);
    place.bad(&["pipelines", "-t", "ray-traced"], 2, &["ray-traced", "reference"]);
    place.bad(&["pipelines", "--check", "missing.md"], 1, &["missing.md"]);
    std::fs::write(place.path("page.md"), "# Other\n").unwrap();
    place.bad(&["pipelines", "--check", "page.md"], 1, &["page.md", "no table of pipelines"]);
    place.bad(&["pipelines", "--write", "page.md", "-t", "sm"], 2, &["--write"]);
}

/// The manifest of Mesa's driver for AMD GPUs, which compiles for GPUs that are not there.
fn radv() -> Option<std::path::PathBuf> {
    let folders = ["/etc", "/usr/local/share", "/usr/share"].map(|folder| Path::new(folder).join("vulkan/icd.d"));
    let names = [format!("radeon_icd.{}.json", std::env::consts::ARCH), "radeon_icd.json".into()];
    folders.iter().flat_map(|folder| names.iter().map(|name| folder.join(name))).find(|path| path.exists())
}

#[test]
fn null_hardware_compiles_but_does_not_render() {
    let place = Place::new();
    let Some(manifest) = radv() else {
        println!("skipped: Mesa's driver for AMD GPUs is not installed");
        return;
    };
    let run = |args: &[&str]| {
        let mut command = place.command(args);
        let output = command.env("VK_DRIVER_FILES", &manifest).env("RADV_FORCE_FAMILY", "navi21").output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, stdout, stderr) = run(&["pipelines", "-t", "sm,edtsm", "--validate", "--json"]);
    assert_eq!(code, Some(0), "{stderr}");
    let figures: Value = serde_json::from_str(&stdout).unwrap();
    json_page::check("pipelines", &figures);
    let (device, driver) = (figures["device"].as_str().unwrap(), figures["driver"].as_str().unwrap());
    assert!(device.starts_with("Null hardware"), "{device}");
    let of = |name: &str| {
        let found = figures["pipelines"].as_array().unwrap().iter().find(|p| p["pipeline"] == name);
        found.unwrap_or_else(|| panic!("no {name} in {figures}"))
    };
    let program = &of("filtering/sm.comp")["programs"][0];
    assert_eq!(program["figures"]["registers"], program["reported"]["VGPRs"]);
    assert!(program["figures"]["code_bytes"].as_u64().unwrap() > 100, "{program}");
    // It counts as a GPU: a driver on the CPU is given another form, distance_transform/edt_row.comp.
    of("distance_transform/edt_tile.comp");

    // A table with a figure that is better than today's.
    let registers = program["figures"]["registers"].as_u64().unwrap();
    let page = |registers: u64| {
        let rest = ["spilled_registers", "scratch_bytes", "code_bytes", "subgroups_per_simd"];
        let rest = rest.map(|name| program["figures"][name].to_string()).join(" | ");
        let row = format!("| `filtering/sm.comp` STEP=0 TOGETHER=1 | {registers} | {rest} |");
        std::fs::write(place.path("page.md"), format!("Device: {device}\nDriver: {driver}\n\n## Figures\n\n{row}\n"))
    };
    page(registers).unwrap();
    let check = ["pipelines", "-t", "sm", "--check", "page.md"];
    let (code, stdout, stderr) = run(&check);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    page(registers - 1).unwrap();
    let (code, stdout, stderr) = run(&check);
    assert_eq!(code, Some(1), "{stdout}{stderr}");
    let fault = format!("FAULT: filtering/sm.comp STEP=0 TOGETHER=1: registers {registers}, before {}", registers - 1);
    assert!(stdout.contains(&fault) && stderr.contains("faults of pipelines: 1."), "{stdout}{stderr}");

    for args in [&["render"][..], &["compare", "jenga", "-t", "sm"], &["bench", "--suite", "pcf", "--quick"]] {
        let (code, stdout, stderr) = run(args);
        assert_eq!(code, Some(1), "{args:?}: {stdout}{stderr}");
        assert!(stderr.contains("lacks memory: it cannot render"), "{args:?}: {stderr}");
    }
}

fn row<'a>(figures: &'a Value, technique: &str, map: Option<u64>) -> &'a Value {
    let rows = figures["results"].as_array().unwrap();
    let found = rows.iter().find(|r| r["technique"] == technique && r["shadow_map"].as_u64() == map);
    found.unwrap_or_else(|| panic!("no {technique} in {figures}"))
}

#[test]
fn compare_measures_and_draws_a_sheet() {
    let place = Place::new();
    let base = ["compare", "jenga", "--size", "96x54", "--samples", "16", "--frames", "1", "--validate"];
    let more = [
        "-t",
        "sm,pcf:width=7,skip=off,ray-traced,area-samples",
        "--shadow-map",
        "128,1024",
        "-o",
        "out",
        "--json",
        "-",
    ];
    let figures = place.json(&[&base[..], &more].concat());
    assert_eq!(figures["results"].as_array().unwrap().len(), 7);
    for r in figures["results"].as_array().unwrap() {
        for name in ["rmse", "mae", "ssim", "flip", "mismatch", "over", "under"] {
            let v = r[name].as_f64().unwrap_or(f64::NAN);
            assert!((0.0..=1.0).contains(&v), "{name}: {r}");
        }
    }
    let sm = row(&figures, "sm", Some(1024));
    assert!(sm["gpu_ms"].as_f64().unwrap() > 0.0 && sm["memory_bytes"].as_u64().unwrap() > 0);
    assert_eq!(row(&figures, "pcf", Some(1024))["params"]["width"], 7);
    // Fewer texels have a larger error, and a second truth has a smaller error than any map.
    let rmse = |technique, map| row(&figures, technique, map)["rmse"].as_f64().unwrap();
    assert!(rmse("sm", Some(128)) > rmse("sm", Some(1024)));
    assert!(rmse("sm", Some(1024)) > rmse("area-samples", Some(1024)));
    assert!(rmse("sm", Some(1024)) > rmse("ray-traced", None) && rmse("ray-traced", None) > 0.0);
    assert!(figures["pixels_judged"].as_u64() < figures["pixels"].as_u64());

    let (w, h) = place.png_size("out/sheet.png");
    assert!(w > 500 && h > 300);
    let written: Value = serde_json::from_slice(&std::fs::read(place.path("out/results.json")).unwrap()).unwrap();
    assert_eq!(written, figures);
    assert!(std::fs::read_to_string(place.path("out/table.txt")).unwrap().contains("width=7 skip=off"));

    // The truth comes from the cache, and the result is the same.
    let again = place.json(&[&base[..], &["-t", "sm", "--json", "-"]].concat());
    assert_eq!((&figures["reference"]["cached"], &again["reference"]["cached"]), (&false.into(), &true.into()));
    assert_eq!(again["results"][0]["rmse"], sm["rmse"]);
    let averaged =
        place.json(&[&base[..], &["-t", "sm,ray-traced", "--reference", "area-samples", "--json", "-"]].concat());
    assert_eq!(averaged["reference"]["samples"], 16);
    assert!(row(&averaged, "sm", Some(1024))["rmse"].as_f64() > row(&averaged, "ray-traced", None)["rmse"].as_f64());
}

#[test]
fn penumbrae_of_a_fixed_width_are_a_truth() {
    let place = Place::new();
    let base = ["compare", "jenga", "--size", "96x54", "--frames", "1", "--reference", "fixed-penumbra", "--json", "-"];
    let with = |more: &[&str]| place.json(&[&base[..], more].concat());
    let usual = with(&["-t", "sm,fixed-penumbra"]);
    let reference = &usual["reference"];
    assert_eq!((&reference["kind"], &reference["samples"]), (&"fixed-penumbra".into(), &16.into()));
    assert_eq!(
        (&reference["cached"], row(&usual, "fixed-penumbra", None)["rmse"].as_f64()),
        (&false.into(), Some(0.0))
    );
    let width = reference["penumbra"].as_f64().unwrap();
    assert!(width > 0.0);
    // The same width given explicitly agrees up to the last digit, and another width differs. --samples belongs to
    // another reference and changes nothing.
    let rmse = |figures: &Value| row(figures, "sm", Some(1024))["rmse"].as_f64().unwrap();
    let given = with(&["-t", "sm", "--penumbra", &width.to_string()]);
    assert!((rmse(&given) - rmse(&usual)).abs() < 1e-6);
    let again = with(&["-t", "sm", "--penumbra", &width.to_string(), "--samples", "4"]);
    assert_eq!((&again["reference"]["cached"], rmse(&again)), (&true.into(), rmse(&given)));
    let wider = with(&["-t", "sm", "--penumbra", &(3.0 * width).to_string()]);
    assert_eq!(
        (&wider["reference"]["cached"], &wider["reference"]["penumbra"]),
        (&false.into(), &(3.0 * width).into())
    );
    assert!(rmse(&wider) > rmse(&given));
    assert!(with(&["-t", "sm", "--penumbra", "0"])["reference"]["penumbra"] == width);
    let traced = place.json(&[
        "compare",
        "jenga",
        "--size",
        "96x54",
        "--frames",
        "1",
        "--samples",
        "1",
        "-t",
        "sm",
        "--json",
        "-",
    ]);
    assert!(traced["reference"]["penumbra"].is_null());

    let picture = |set: &str| {
        place.good(&["render", "jenga", "-t", "fixed-penumbra", "--set", set, "--size", "96x54", "-o", "a.png"]);
        std::fs::read(place.path("a.png")).unwrap()
    };
    assert_eq!(picture("penumbra=0"), picture(&format!("penumbra={width}")));
    assert_ne!(picture("penumbra=0"), picture(&format!("penumbra={}", 3.0 * width)));
    place.bad(&["compare", "--penumbra", "0.1"], 2, &["--penumbra", "--reference fixed-penumbra"]);
    place.bad(&[&base[..], &["--penumbra", "-1"]].concat(), 2, &["penumbra=-1", "0 to"]);
    place.bad(&[&base[..], &["--penumbra", "NaN"]].concat(), 2, &["penumbra=NaN"]);
}

#[test]
fn a_file_serves_as_the_truth() {
    let place = Place::new();
    let size = ["--size", "96x54", "--light-size", "0"];
    for file in ["truth.exr", "truth.png"] {
        let render = ["render", "jenga", "-t", "ray-traced", "--view", "visibility", "-o", file];
        place.good(&[&render[..], &size].concat());
        let compare = ["compare", "jenga", "-t", "ray-traced,sm", "--frames", "1", "--reference", file, "--json", "-"];
        let figures = place.json(&[&compare[..], &size].concat());
        assert_eq!(row(&figures, "ray-traced", None)["rmse"], 0.0, "{file}");
        assert!(row(&figures, "sm", Some(1024))["rmse"].as_f64().unwrap() > 0.01, "{file}");
        assert_eq!(figures["reference"]["kind"], file);
    }
    place.bad(&["compare", "jenga", "--reference", "truth.exr", "--size", "32x18"], 1, &["truth.exr", "96x54"]);
}

#[test]
fn bench_writes_json_and_markdown() {
    let place = Place::new();
    // Default folder for results.
    let args =
        ["bench", "--suite", "pcf", "--size", "64x36", "--frames", "1", "--json", "all.json", "--html", "all.html"];
    let output = place.run(&args);
    let [text, told] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success(), "{told}");
    for part in ["1 suite on ", "into edgeshade-bench: about ", "suite 1 of 1, pcf: ", "1 suite took "] {
        assert!(told.contains(part), "{part}: {told}");
    }
    std::fs::rename(place.path("edgeshade-bench"), place.path("out")).unwrap();
    let files: Vec<_> = std::fs::read_dir(place.path("out")).unwrap().map(|e| e.unwrap().path()).collect();
    let with = |extension: &str| files.iter().find(|p| p.extension().is_some_and(|e| e == extension)).unwrap();
    let figures: Value = serde_json::from_slice(&std::fs::read(with("json")).unwrap()).unwrap();
    let rows = figures["results"].as_array().unwrap();
    assert_eq!((files.len(), rows.len(), &figures["suite"]), (3, 24, &"pcf".into()));
    assert!(rows.iter().all(|r| r["gpu_ms"].as_f64().unwrap() > 0.0 && r["ratio"].as_f64().unwrap() > 0.0));
    assert!(rows.iter().step_by(6).all(|r| r["ratio"] == 1.0));
    assert!(text.contains(&std::fs::read_to_string(with("md")).unwrap()));
    let all: Value = serde_json::from_slice(&std::fs::read(place.path("all.json")).unwrap()).unwrap();
    json_page::check("bench", &all);
    assert_eq!(all["suites"], serde_json::json!([figures]));
    let csv = std::fs::read_to_string(with("csv")).unwrap();
    let lines: Vec<Vec<_>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 1 + 24);
    // From the end, because the names of groups have commas.
    let column = lines[0].iter().rev().position(|head| *head == "gpu_ms").unwrap();
    let times = |i: usize| lines[i + 1].iter().nth_back(column).unwrap().parse::<f64>().unwrap();
    // Reading JSON may change the last bit of a number.
    let is_same = |i: usize| (rows[i]["gpu_ms"].as_f64().unwrap() / times(i) - 1.0).abs() < 1e-12;
    assert!((0..24).all(is_same), "{csv}");
    let page = std::fs::read_to_string(place.path("all.html")).unwrap();
    assert!(page.contains("<h1>Suite <code>pcf</code></h1>") && page.contains("<td>pcf</td>"));
    place.bad(&["bench", "--html", "all.txt"], 2, &["--html", ".html"]);
}

#[test]
fn compare_writes_csv_markdown_and_a_page_that_say_where_figures_come_from() {
    let place = Place::new();
    let args = ["compare", "jenga", "-t", "sm,pcf:width=7", "--size", "64x36", "--samples", "4", "--frames", "1"];
    let figures = place.json(&[&args[..], &["-o", "out", "--html", "new/page.html", "--json", "-"]].concat());
    let date = figures["date"].as_str().unwrap();
    assert!(date.len() == 20 && date.starts_with("20") && date.ends_with('Z'), "{date}");
    assert!(
        !figures["commit"].as_str().unwrap().is_empty() && figures["processor"].as_str().unwrap().ends_with(" threads")
    );
    let scene = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/jenga.glb")).unwrap();
    let hash = blake3::hash(&scene).to_hex().to_string();
    assert_eq!(figures["scene_hashes"], serde_json::json!({ "jenga": hash }));

    let read = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
    let [csv, markdown, page] = ["out/results.csv", "out/results.md", "new/page.html"].map(read);
    let lines: Vec<Vec<_>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| lines[0].iter().position(|head| *head == name).unwrap();
    assert_eq!((lines.len(), lines[1][0], lines[2][0], lines[2][column("params.width")]), (3, "sm", "pcf", "7"));
    for (line, row) in lines[1..].iter().zip(figures["results"].as_array().unwrap()) {
        let is_same = |name: &str, figure: &Value| {
            (line[column(name)].parse::<f64>().unwrap() - figure.as_f64().unwrap()).abs() < 1e-12
        };
        assert!(is_same("rmse", &row["rmse"]) && is_same("boundary.mean", &row["boundary"]["mean"]), "{csv}");
    }
    for text in [&hash, date, "edgeshade compare jenga -t sm,pcf:width=7 --size 64x36", "Edgeshade"] {
        assert!(markdown.contains(text) && page.contains(text), "{text}: {markdown}");
    }
    assert!(markdown.contains("\n| pcf | width=7 | 1024 | 0."), "{markdown}");

    // The page shows the code of each pixel that `render` writes.
    let render = ["render", "jenga", "-t", "pcf", "--set", "width=7", "--view", "visibility", "--size", "64x36"];
    place.good(&[&render[..], &["-o", "v.png"]].concat());
    let visibility = edgeshade::picture::read_png_gray(&place.path("v.png"), [64, 36]).unwrap();
    let codes: Vec<u8> = visibility.iter().map(|v| (255.0 * v + 0.5) as u8).collect();
    let partly = codes.iter().position(|c| (30..220).contains(c)).unwrap();
    let script = format!(
        "const stage = document.querySelector('.stage');\
         const shown = state => until(() => stage.dataset.shown === state);\
         await shown('0/0/false');\
         const choice = document.querySelector('.technique'); choice.value = 1; choice.dispatchEvent(new Event('change'));\
         await shown('0/1/false');\
         const box = stage.getBoundingClientRect(); const scale = stage.clientWidth / 64;\
         const at = n => ({{ clientX: box.left + 1 + (n % 64 + 0.5) * scale, clientY: box.top + 1 + (Math.floor(n / 64) + 0.5) * scale }});\
         const codes = [];\
         for (const n of [{partly}, 0, 1000, 2000, 2303]) {{ stage.dispatchEvent(new PointerEvent('pointermove', at(n)));\
             codes.push(Number(/width=7 [0-9.]+ \\((\\d+)\\)/.exec(document.querySelector('output').value)[1])); }}\
         return {{ codes, loads: performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length }};"
    );
    let Some(found) = browser::run(&place.path("new/page.html"), [1000, 800], &script) else { return };
    assert_eq!(found["codes"], serde_json::json!([partly, 0, 1000, 2000, 2303].map(|n| codes[n])));
    assert_eq!((&found["console"], &found["loads"]), (&serde_json::json!([]), &0.into()));
}

/// Runs a suite that times once in quick mode, with a frame of each variant; returns its figures and its page.
fn quick_suite_once(place: &Place, suite: &str) -> (Value, String) {
    let figures = place.json(&[
        "bench",
        "--suite",
        suite,
        "--quick",
        "--frames",
        "1",
        "--validate",
        "-o",
        "out",
        "--html",
        "all.html",
        "--json",
    ]);
    json_page::check("bench", &figures);
    let mut files = std::fs::read_dir(place.path("out")).unwrap().map(|e| e.unwrap().path());
    let page = files.find(|p| p.extension().is_some_and(|e| e == "md")).unwrap();
    (figures["suites"][0].clone(), std::fs::read_to_string(page).unwrap())
}

/// Runs a suite twice in quick mode; returns its figures and its page.
fn quick_suite(place: &Place, suite: &str) -> (Value, String) {
    let run = |folder: &str| {
        let args = ["bench", "--suite", suite, "--quick", "--validate", "-o", folder];
        let text = place.good(&args);
        let files: Vec<_> = std::fs::read_dir(place.path(folder)).unwrap().map(|e| e.unwrap().path()).collect();
        let with = |extension: &str| {
            let found = files.iter().find(|p| p.extension().is_some_and(|e| e == extension));
            std::fs::read_to_string(found.unwrap_or_else(|| panic!("no {extension} in {files:?}"))).unwrap()
        };
        let (mut json, page): (Value, _) = (serde_json::from_str(&with("json")).unwrap(), with("md"));
        assert!(text.contains(&page), "{text}");
        json_page::check("bench", &json);
        // The folder differs between the two runs, and so may the clock: `auto` measures which one can be trusted.
        let fields = json.as_object_mut().unwrap();
        fields.remove("command");
        fields.remove("date");
        let clock = fields.remove("timing").unwrap();
        assert!(["timestamps", "wall"].contains(&clock.as_str().unwrap()), "{clock}");
        let line = [("accuracy", "sm"), ("edges", "sm"), ("penumbra", "7 texels: rpcf")]
            .into_iter()
            .find(|(s, _)| *s == suite);
        assert_eq!(files.len(), if line.is_some() { 4 } else { 3 }, "{files:?}");
        if let Some((_, line)) = line {
            let plot = with("svg");
            assert!(plot.starts_with("<svg") && plot.contains(&format!(">\n{line}\n<")), "{plot}");
        }
        (json, page)
    };
    let (figures, page) = run("first");
    // With cached truths the results are equal to the last digit. For the long suites only a full sweep checks this,
    // as CI runs it.
    let is_full_sweep = std::env::var_os("EDGESHADE_SWEEP").is_some_and(|v| v == "full");
    if is_full_sweep || ["edges", "penumbra"].contains(&suite) {
        assert_eq!(run("second").0, figures);
    }
    assert_eq!(figures["suite"], suite);
    assert!(figures["device"].is_string() && figures["version"] == env!("CARGO_PKG_VERSION"));
    (figures, page)
}

/// Values of the field `name` in the rows that match `settings`, which are pairs of a name and the text of its value.
fn figures_of(figures: &Value, settings: &[(&str, &str)], name: &str) -> Vec<f64> {
    let text = |v: &Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    let rows = figures["results"].as_array().unwrap();
    let mine = rows.iter().filter(|r| settings.iter().all(|(k, v)| text(&r[*k]) == *v));
    mine.map(|r| r[name].as_f64().unwrap_or_else(|| panic!("{name}: {r}"))).collect()
}

#[test]
fn the_accuracy_suite_sees_finer_maps_err_less() {
    let place = Place::new();
    let (figures, page) = quick_suite(&place, "accuracy");
    for id in ["sm", "pcf"] {
        let of = |map: &str, name: &str| {
            let found = figures_of(&figures, &[("technique", id), ("shadow_map", map), ("scene", "jenga")], name);
            assert!(!found.is_empty() && page.contains(&format!("| {id} | {map} |")), "{id} {map}: {page}");
            found[0]
        };
        for name in ["mismatch", "mismatch_per_boundary"] {
            assert!(of("512", name) > of("1024", name) && of("1024", name) > 0.0, "{id} {name}");
            assert!(of("512", name) < 2.0, "{id} {name}");
        }
        for map in ["512", "1024"] {
            assert!(of(map, "over") + of(map, "under") < 0.1);
            // The figure satisfies its definition.
            let pixels = of(map, "mismatch") * of(map, "pixels");
            let per_boundary = of(map, "mismatch_per_boundary") * of(map, "boundary_length");
            assert!((pixels - per_boundary).abs() < 1e-6 * pixels, "{pixels} {per_boundary}");
        }
    }
    let means = figures["means"].as_array().unwrap();
    assert_eq!(means.len(), figures["results"].as_array().unwrap().len());
    assert!(means.iter().all(|m| m["scenes"] == 1 && m["boundary_p95"].is_f64()));
    assert_eq!(means[0]["mismatch"], figures["results"][0]["mismatch"]);
}

#[test]
fn the_penumbra_suite_sets_equal_widths_next_to_each_other() {
    let place = Place::new();
    let (figures, page) = quick_suite(&place, "penumbra");
    assert_eq!(figures["results"].as_array().unwrap().len(), 2 * 2 * 4);
    for scene in ["jenga", "robot"] {
        let mut widths = vec![];
        for (texels, variants) in [
            ("15", ["pcf", "edtsm", "edtsm-star", "edtsm-star as in the paper"]),
            ("7", ["pcf", "rpcf", "edtsm", "edtsm-star"]),
        ] {
            let of = |variant: &str, name: &str| {
                let found = figures_of(&figures, &[("variant", variant), ("texels", texels), ("scene", scene)], name);
                assert!(found.len() == 1 && page.contains(&format!("| {variant} |")), "{scene} {texels} {variant}");
                found[0]
            };
            for variant in variants {
                assert_eq!(
                    of(variant, "penumbra"),
                    of("pcf", "penumbra"),
                    "all variants of a group have the same width"
                );
                let (rmse, mae) = (of(variant, "rmse"), of(variant, "mae"));
                // The fixed depth that the paper uses for a kernel leaves acne everywhere.
                let limit = if variant.ends_with("paper") { 0.5 } else { 0.15 };
                assert!(0.0 < mae && mae < rmse && rmse < limit, "{scene} {texels} {variant}: {rmse}");
                assert!((of(variant, "over") + of(variant, "under") - mae).abs() < 1e-12);
            }
            widths.push(of("pcf", "penumbra"));
        }
        assert!((widths[0] / widths[1] - 15.0 / 7.0).abs() < 2e-3, "{widths:?}");
    }
    // The subcommand for one scene finds the same at this width.
    let row = figures["results"].as_array().unwrap().iter().find(|r| r["variant"] == "edtsm-star").unwrap();
    let width = row["penumbra"].to_string();
    let technique = format!("edtsm-star:penumbra={width}");
    let scene = row["scene"].as_str().unwrap();
    let alone = ["compare", scene, "-t", &technique, "--size", "192x108", "--reference", "fixed-penumbra"];
    place.good(&[&alone[..], &["--penumbra", &width, "--frames", "1", "--json", "alone.json"]].concat());
    let alone: Value = serde_json::from_slice(&std::fs::read(place.path("alone.json")).unwrap()).unwrap();
    for name in ["rmse", "mae", "over", "pixels"] {
        assert_eq!(alone["results"][0][name], row[name], "{name}");
    }
    // The list of defeats agrees with the tables.
    let beaten = figures["beaten"].as_array().unwrap();
    let of_subject = [("variant", "edtsm-star")];
    let mine = figures_of(&figures, &of_subject, "rmse");
    assert!(mine.len() >= beaten.len());
    for cell in beaten {
        let (mine, other) = (cell["rmse"].as_f64().unwrap(), cell["by_rmse"].as_f64().unwrap());
        assert!(mine > other, "{cell}");
        let name = format!("{} {}, {} texels", cell["scene"].as_str().unwrap(), cell["shadow_map"], cell["texels"]);
        assert!(page.contains(&name), "{name}: {page}");
    }
    let lowest: u64 = figures["means"].as_array().unwrap().iter().map(|m| m["lowest"].as_u64().unwrap()).sum();
    assert_eq!(lowest, 4, "each cell has one lowest error");
}

#[test]
fn the_penumbrae_suite_says_what_edtsm_star_adds() {
    let place = Place::new();
    let args = ["bench", "--suite", "penumbrae", "--quick", "--size", "64x36", "--frames", "1", "-o", "out"];
    let text = place.good(&[&args[..], &["--timing", "wall"]].concat());
    let figures = place.figures();
    assert!(
        figures["timing"] == "wall" && text.contains("\n\ntimes: wall clock, one submission per pass\n\n"),
        "{text}"
    );
    let rows = figures["results"].as_array().unwrap();
    assert_eq!(rows.len(), 9 + 4, "the scene, and its ground alone");
    for r in rows {
        let base = rows.iter().find(|b| b["group"] == r["group"]).unwrap();
        let number = |row: &Value, name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name}: {row}"));
        // With one frame per variant the median is that frame's value.
        let added = number(r, "gpu_ms") - number(base, "gpu_ms");
        assert!((number(r, "added_ms") - added).abs() < 1e-9, "{r}");
        let frame = number(r, "total_gpu_ms") / number(base, "total_gpu_ms");
        assert!((number(r, "frame_ratio") / frame - 1.0).abs() < 1e-9, "{r}");
        assert_eq!(r["ground_alone"].as_bool().unwrap_or(false), r["group"].as_str().unwrap().ends_with("alone"));
        // Without a shadow edge, no tile is near one.
        let passes = r["passes"].as_array().unwrap();
        let of_edges = ["pixels at an edge", "nearest edge", "nearest line of blocks 8, step 1"];
        let is_of_edges = |name: &Value| of_edges.iter().any(|of| name == of);
        let of_edges = passes.iter().filter(|p| is_of_edges(&p["name"]) && r["params"]["skip"] != "off");
        for pass in of_edges {
            assert_eq!(pass["tiles_active"] == 0, r["ground_alone"] == true, "{r}");
        }
    }
    for part in [
        "| courtyard, ground alone |",
        "## What penumbrae add",
        "## Passes of `edtsm-star`",
        "nearest line, round bends",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn the_soft_suite_judges_by_the_light_s_own_penumbrae() {
    let place = Place::new();
    let text = place.good(&["bench", "--suite", "soft", "--quick", "--frames", "1", "--validate", "-o", "out"]);
    let files: Vec<_> = std::fs::read_dir(place.path("out")).unwrap().map(|e| e.unwrap().path()).collect();
    let with = |extension: &str| {
        let found = files.iter().find(|p| p.extension().is_some_and(|e| e == extension));
        std::fs::read_to_string(found.unwrap_or_else(|| panic!("no {extension} in {files:?}"))).unwrap()
    };
    let figures: Value = serde_json::from_str(&with("json")).unwrap();
    let (page, plot) = (with("md"), with("svg"));
    assert!(files.len() == 4 && text.contains(&page), "{text}");
    assert!(plot.contains(">\nsm\n<") && plot.contains(">\npcf width=15\n<"), "{plot}");
    // The published form of a technique is a variant of its own.
    let rows = figures["results"].as_array().unwrap();
    let variants: std::collections::BTreeSet<_> =
        rows.iter().map(|r| format!("{} {}", r["technique"], r["params"])).collect();
    assert_eq!(rows.len(), 2 * 3 * variants.len(), "two scenes, three lights, one map");
    assert_eq!((figures["cells"].as_array().unwrap().len(), &figures["samples"]), (2 * 3, &64.into()));
    for (scene, own, unit) in [("jenga", 0.2, "world units"), ("robot", 0.025f64.to_degrees(), "degrees")] {
        let of = |scale: &str, name: &str| {
            let key = [("scene", scene), ("light_scale", scale), ("technique", "sm")];
            figures_of(&figures, &key, name)[0]
        };
        for scale in [0.25, 1.0, 4.0] {
            let size = of(&format!("{scale:?}"), "light_size");
            assert!((size / (scale * own) - 1.0).abs() < 1e-3, "{scene} x {scale}: {size} {unit}");
        }
        // A larger light is softer, and hard shadows differ more from it.
        assert!(of("0.25", "rmse") < of("1.0", "rmse") && of("1.0", "rmse") < of("4.0", "rmse"), "{scene}");
        assert!(page.contains(&format!("| {scene} |")) && page.contains(unit), "{page}");
    }
    // The subcommand for one scene finds the same under this light.
    let alone =
        "compare jenga -t pcf:width=15 --light-size 0.8 --samples 64 --size 192x108 --frames 1 --json alone.json";
    place.good(&alone.split(' ').collect::<Vec<_>>());
    let alone: Value = serde_json::from_slice(&std::fs::read(place.path("alone.json")).unwrap()).unwrap();
    let key = [("scene", "jenga"), ("light_scale", "4.0"), ("technique", "pcf")];
    for name in ["rmse", "mae", "over", "penumbra_rmse", "flip", "pixels", "memory_bytes"] {
        assert_eq!(alone["results"][0][name].as_f64(), Some(figures_of(&figures, &key, name)[0]), "{name}");
    }
    assert!(figures_of(&figures, &[], "gpu_ms").iter().all(|ms| *ms > 0.0));
}

#[test]
fn the_soft_cost_suite_says_what_is_added() {
    let place = Place::new();
    let args = ["bench", "--suite", "soft-cost", "--quick", "--size", "64x36", "--frames", "1", "-o", "out"];
    let text = place.good(&args);
    for part in ["## What soft shadows add", "## Passes", "| courtyard | pcf width=15 |"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let figures = place.figures();
    let rows = figures["results"].as_array().unwrap();
    assert!(rows.len() > 1 && rows[0]["technique"] == "sm" && rows[0]["added_ms"] == 0.0, "{figures}");
    for r in rows {
        let added = r["gpu_ms"].as_f64().unwrap() - rows[0]["gpu_ms"].as_f64().unwrap();
        assert!((r["added_ms"].as_f64().unwrap() - added).abs() < 1e-9, "{r}");
    }
}

#[test]
fn the_edges_suite_sees_volumes_err_least_and_counts_edges() {
    let place = Place::new();
    let (figures, page) = quick_suite(&place, "edges");
    let of = |id: &str, name: &str| figures_of(&figures, &[("technique", id)], name);
    let volumes = of("shadow-volumes", "mismatch");
    assert_eq!((volumes.len(), of("sm", "mismatch").len()), (1, 2));
    for id in ["sm", "rbsm-star", "edsm", "sssm"] {
        assert!(of(id, "mismatch").iter().all(|m| *m > volumes[0]), "{id}: {page}");
    }
    let rows = figures["results"].as_array().unwrap();
    for r in rows.iter().filter(|r| r["technique"] == "edsm-x") {
        assert!(r["counts"]["edges"].as_u64().unwrap() > 100, "{r}");
        let [spilled, lost] = ["edges_spilled", "edges_lost"].map(|name| r["counts"][name].as_u64().unwrap());
        assert!(r["params"]["slots"] != 1 || spilled + lost > 0, "{r}");
    }
}

#[test]
fn the_edges_cost_suite_splits_frames_into_update_and_shading() {
    let place = Place::new();
    let args = ["bench", "--suite", "edges-cost", "--quick", "--size", "64x36", "--frames", "2", "-o", "out"];
    let text = place.good(&args);
    let figures = place.figures();
    let rows = figures["results"].as_array().unwrap();
    assert!(rows.len() >= 4 && rows.len().is_multiple_of(2) && text.contains("| shadow-volumes |"), "{text}");
    for r in rows {
        let [update, shading] = ["update", "shading"].map(|part| r["times"][part]["median_ms"].as_f64().unwrap());
        // While light and casters stand still, results are kept and the update costs nothing. The shading costs time in
        // both states, because every technique works on all pixels.
        assert_eq!(update > 0.0, r["state"] == "moving", "{r}");
        assert!(shading > 0.0, "{r}");
        let memory = |name: &str| r["memory"][name].as_u64().unwrap();
        assert_eq!(memory("shadow_map_bytes") > 0, r["technique"] != "shadow-volumes", "{r}");
        assert_eq!(memory("casters_bytes") > 0, r["technique"] != "sm" && r["technique"] != "pcf", "{r}");
    }
    for r in rows.iter().filter(|r| r["technique"] == "sm") {
        assert_eq!(r["times"]["both"]["ratio"], 1.0);
    }
}

#[test]
fn the_slopes_suite_measures_stairs_in_texels() {
    let place = Place::new();
    let (figures, page) = quick_suite(&place, "slopes");
    assert_eq!(page.matches("| sm |").count(), 10);
    for light in ["sun", "spot"] {
        for tilt in ["0", "60", "80"] {
            let key = [("technique", "sm"), ("light", light), ("tilt_degrees", tilt)];
            let of = |name: &str| figures_of(&figures, &key, name)[0];
            // Aliasing displaces the boundary by about a quarter of a texel; on a slope the normal offset displaces
            // it further.
            let range = if tilt == "0" { 0.2..0.28 } else { 0.2..0.6 };
            for name in ["displacement_texels", "straight_texels", "curved_texels", "thin_texels"] {
                let off = of(name);
                assert!(range.contains(&off), "{light} {tilt} {name}: {off}");
            }
            assert_eq!((of("false_shadow"), of("false_shadow_pixels")), (0.0, 0.0), "{light} {tilt}");
            assert!(of("boundary_p95_texels") < 1.5 && of("boundary_mean_texels").abs() < 0.2);
        }
    }
}

#[test]
fn the_motion_suite_sets_techniques_next_to_the_truth() {
    let place = Place::new();
    let (figures, _) = quick_suite(&place, "motion");
    for movement in ["light-turned", "light-moved", "camera-moved"] {
        let of = |id: &str, name: &str| {
            figures_of(&figures, &[("technique", id), ("movement", movement), ("scene", "jenga")], name)[0]
        };
        assert_eq!(of("ray-traced", "change_error"), 0.0);
        assert_eq!(of("ray-traced", "change"), of("ray-traced", "change_truth"));
        assert_eq!(of("ray-traced", "flicker"), of("ray-traced", "flicker_truth"));
        for id in ["sm", "pcf"] {
            assert_eq!(of(id, "change_truth"), of("ray-traced", "change"));
            assert_eq!(of(id, "pairs"), of("ray-traced", "pairs"));
            let (change, error) = (of(id, "change"), of(id, "change_error"));
            assert!(0.0 < change && change < 0.5 && 0.0 < error && error < 0.5, "{movement} {id}: {change} {error}");
        }
        // The light moves by half a texel in all. That moves the aliased boundary, but not the true shadow of a spot
        // that only turns.
        if movement == "light-turned" {
            assert_eq!(of("ray-traced", "change"), 0.0);
            assert!(of("sm", "change") > of("pcf", "change"));
        }
    }
}

#[test]
fn the_skip_suite_fits_a_line_for_every_technique() {
    let place = Place::new();
    let (figures, page) = quick_suite_once(&place, "skip");
    let fits = figures["fits"].as_array().unwrap();
    assert_eq!(fits.len(), 8, "{fits:?}");
    for fit in fits {
        let id = fit["variant"].as_str().unwrap();
        assert_eq!(fit["views"], 10, "{id}");
        assert!(fit["most_edges"].as_f64().unwrap() > 0.2 && page.contains(&format!("| {id} |")), "{page}");
    }
    // A view of the ground alone has no edge, and a still picture no pass.
    let ground = figures_of(&figures, &[("view", "ground alone"), ("technique", "sm")], "edge_share");
    assert_eq!(ground, [0.0]);
    for kept in figures["kept"].as_array().unwrap() {
        assert!(kept["nothing_ms"] == 0.0 && kept["everything_ms"].as_f64().unwrap() > 0.0, "{kept}");
    }
}

#[test]
fn the_scaling_suite_measures_every_axis() {
    let place = Place::new();
    let (figures, page) = quick_suite_once(&place, "scaling");
    for axis in ["shadow map", "picture", "triangles"] {
        let amounts = figures_of(&figures, &[("axis", axis), ("technique", "sm")], "amount");
        assert!(amounts.len() == 2 && amounts[0] < amounts[1], "{axis}: {amounts:?}");
        assert!(page.contains(&format!("## {axis}\n")), "{page}");
    }
    let growth = figures["growth"].as_array().unwrap();
    assert!(growth.len() == 24 && growth.iter().all(|g| g["exponent"].is_number()), "{growth:?}");
    // Four times as many pixels take longer.
    let sm = growth.iter().find(|g| g["axis"] == "picture" && g["variant"] == "sm").unwrap();
    assert!(sm["exponent"].as_f64().unwrap() > 0.2, "{sm}");
}

#[test]
fn a_papers_suite_has_its_table_and_a_verdict_for_each_claim() {
    let place = Place::new();
    let (figures, page) = quick_suite_once(&place, "paper-004");
    let of = |form: &str| {
        let cell = [("table", "table 2"), ("method", "RBSM, optimized"), ("form", form), ("amount", "1024")];
        figures_of(&figures, &cell, "added_ms").len()
    };
    assert_eq!((of("published"), of("defaults")), (1, 1));
    let printed = [("table", "table 2"), ("method", "RBSM, optimized"), ("form", "published")];
    assert_eq!(figures_of(&figures, &printed, "paper_ms"), [3.22, 3.32]);
    // Shadow volumes are exact, but for pixels that two triangles share.
    let error = |method: &str| {
        figures_of(&figures, &[("table", "figures 6 and 7"), ("method", method), ("form", "defaults")], "rmse")[0]
    };
    let [sm, rbsm, volumes] = ["Shadow mapping", "RBSM", "Shadow volumes"].map(error);
    assert!(volumes < 0.25 * rbsm.min(sm), "{volumes} {rbsm} {sm}");
    let verdicts = figures["verdicts"].as_array().unwrap();
    for claim in ["RBSM adds 6 to 30 % to shadow mapping", "techniques cost more in the same order as printed"] {
        let found = verdicts.iter().find(|v| v["claim"] == claim).unwrap_or_else(|| panic!("{claim}: {verdicts:?}"));
        let verdict = found["verdict"].as_str().unwrap();
        assert!(["yes", "in part", "no"].contains(&verdict) && page.contains(claim), "{found}");
    }
}

#[test]
fn an_interrupted_run_goes_on_after_its_finished_scenes() {
    let place = Place::new();
    let args = ["bench", "--suite", "edges", "--quick", "-o", "out"];
    // A folder in the place of a file of the results stops the run after its last scene.
    let name = |ending: &str| {
        let files = std::fs::read_dir(place.path("out")).unwrap().map(|e| e.unwrap().path());
        files.into_iter().find(|p| p.to_str().unwrap().ends_with(ending))
    };
    place.good(&args);
    assert_eq!(name(".unfinished.json"), None);
    let results = || -> Value {
        let text = std::fs::read(name("bits.json").unwrap()).unwrap();
        serde_json::from_slice::<Value>(&text).unwrap()["results"].clone()
    };
    let (whole, csv) = (results(), name(".csv").unwrap());
    std::fs::remove_file(&csv).unwrap();
    std::fs::create_dir(&csv).unwrap();
    place.bad(&args, 1, &["csv"]);
    assert!(name(".unfinished.json").is_some());
    std::fs::remove_dir(&csv).unwrap();
    std::fs::remove_file(name("bits.json").unwrap()).unwrap();
    let run = place.run(&args);
    let notes = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success() && notes.contains("goes on after jenga"), "{notes}");
    assert_eq!(results(), whole);
    assert_eq!(name(".unfinished.json"), None);
}

#[test]
fn explain_says_what_was_left_out() {
    let place = Place::new();
    let render = |more: &[&str]| {
        let small = ["render", "jenga", "--size", "96x54", "--frames", "1", "--explain", "--json"];
        place.json(&[&small[..], more].concat())
    };
    let figures = render(&["-t", "pcss", "--moving", "camera"]);
    let explain = &figures["explain"];
    assert!(explain["kept"].as_array().unwrap().iter().any(|k| k["pass"] == "depth bounds"), "{explain}");
    let decided = explain["decided"].as_array().unwrap();
    assert!(decided.iter().any(|d| d["tiles_active"].as_u64() < d["tiles_total"].as_u64()), "{explain}");
    let skip = &explain["skip"];
    assert!(skip["value"] == "auto" && skip["pixels_differing"] == 0 && skip["off_gpu_ms"].is_number(), "{skip}");
    json_page::check("render", &figures);
    assert!(render(&["-t", "pcss:skip=off"])["explain"]["skip"].is_null());
    let text = place.good(&["render", "jenga", "--size", "32x18", "--frames", "1", "--explain", "-t", "sm"]);
    assert!(text.contains("What was left out:\n  nothing: "), "{text}");
    place.bad(&["render", "--explain", "-t", "ray-traced"], 2, &["--explain", "ray-traced", "real-time"]);
}
