//! Tests of `edgeshade edt`, run the way a user runs it.
#![cfg(feature = "app")]

mod json_page;

use edgeshade::picture::{Picture, read_exr, write_png};
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

const SIZE: [u32; 2] = [37, 41];
const SEEDS: [[u32; 2]; 3] = [[3, 5], [30, 6], [17, 40]];

/// A folder with `mask.png`: seeds are white or just bright enough, other pixels black or just too dark.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        let mut picture = Picture::filled(SIZE, [0; 3]);
        for (i, [x, y]) in SEEDS.into_iter().enumerate() {
            picture.rgb[(y * SIZE[0] + x) as usize] = [if i == 0 { 128 } else { 255 }; 3];
        }
        picture.rgb[0] = [127; 3];
        write_png(&place.path("mask.png"), &picture).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, args: &[&str]) -> Output {
        let output =
            Command::new(env!("CARGO_BIN_EXE_edgeshade")).arg("edt").args(args).current_dir(self.0.path()).output();
        let output = output.unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("panicked"), "{args:?}: {stderr}");
        output
    }

    /// Runs a command that must succeed and returns its standard output.
    fn good(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
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

    fn labels(&self, name: &str) -> Vec<u32> {
        let bytes = std::fs::read(self.path(name)).unwrap();
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
    }
}

/// Nearest of the [`SEEDS`] and the squared distance to it, computed without the library.
fn expected(i: usize) -> (u32, u32) {
    let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
    let squared = |s: &[u32; 2]| s[0].abs_diff(x).pow(2) + s[1].abs_diff(y).pow(2);
    let [sx, sy] = SEEDS.into_iter().min_by_key(|s| (squared(s), s[1], s[0])).unwrap();
    (sx + 65536 * sy, squared(&[sx, sy]))
}

#[test]
fn distances_labels_and_figures() {
    let place = Place::new();
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    // Missing folders are created.
    let args = ["mask.png", "-o", "a/d.exr", "--labels", "b/c/l.u32", "--frames", "2", "--validate", "--json"];
    let figures: Value = serde_json::from_str(&place.good(&[&["--timing", "wall"], &args[..]].concat())).unwrap();
    assert_eq!(figures["timing"], "wall");
    json_page::check("edt", &figures);
    assert_eq!(figures["command"].as_array().unwrap().len(), 4 + args.len());
    let distances = read_exr(&place.path("a/d.exr"), SIZE, None).unwrap();
    let labels = place.labels("b/c/l.u32");
    assert_eq!((labels.len(), distances.len()), (pixels, pixels));
    for i in 0..pixels {
        let (label, squared) = expected(i);
        assert_eq!((labels[i], distances[i]), (label, (squared as f32).sqrt()), "pixel {i}");
    }
    assert_eq!((&figures["seeds"], &figures["labelled"]), (&3.into(), &pixels.into()));
    assert_eq!((&figures["size"], &figures["radius"]), (&serde_json::json!(SIZE), &Value::Null));
    assert_eq!((&figures["frames"], &figures["validation_messages"]), (&2.into(), &serde_json::json!([])));
    let passes = figures["passes"].as_array().unwrap();
    assert!(passes.len() >= 2 && passes[0]["name"] == "edt pack", "{figures}");
    let total = figures["total_gpu_ms"].as_f64().unwrap();
    assert!(total > 0.0 && figures["memory_bytes"].as_u64().unwrap() > 4 * pixels as u64, "{figures}");
    assert!(figures["device"].is_string() && figures["method"] != "auto", "{figures}");
}

#[test]
fn methods_agree_within_a_radius() {
    let place = Place::new();
    let mut all: Vec<Vec<u32>> = vec![];
    for method in ["brute", "pba", "bounded-tile", "bounded-row", "auto"] {
        let args = ["mask.png", "--method", method, "--radius", "9", "--labels", "l.u32", "--frames", "1"];
        let said = place.good(&args);
        assert!(said.contains("radius 9") && said.contains("wrote l.u32"), "{said}");
        all.push(place.labels("l.u32"));
    }
    assert!(all.iter().all(|labels| labels == &all[0]));
    for (i, &label) in all[0].iter().enumerate() {
        let (nearest, squared) = expected(i);
        assert_eq!(label, if squared <= 81 { nearest } else { u32::MAX }, "pixel {i}");
    }
    // In the picture seeds are white and the farthest pixels black; neither has the colour of pixels without a seed.
    place.good(&["mask.png", "--radius", "9", "-o", "d.png"]);
    let at = |[x, y]: [u32; 2]| {
        let gray = edgeshade::picture::read_png_gray(&place.path("d.png"), SIZE).unwrap();
        gray[(y * SIZE[0] + x) as usize]
    };
    assert_eq!((at(SEEDS[0]), at([12, 5])), (1.0, 0.0));
}

#[test]
fn faults_are_named() {
    let place = Place::new();
    let help = place.good(&["--help"]);
    assert!(help.contains("Examples") && help.contains("edgeshade edt") && help.contains("bounded-row"), "{help}");
    place.bad(&[], 2, &["<MASK>"]);
    place.bad(&["mask.png", "--method", "jfa"], 2, &["jfa", "pba, bounded-tile, bounded-row, auto, brute"]);
    place.bad(&["mask.png", "--method", "bounded-tile"], 2, &["bounded-tile", "64", "bounded-row"]);
    place.bad(&["mask.png", "--method", "bounded-tile", "--radius", "65"], 2, &["65", "64"]);
    place.bad(&["mask.png", "--radius", "-1"], 2, &["-1"]);
    place.bad(&["mask.png", "-o", "d.tiff"], 2, &["d.tiff", ".exr"]);
    std::fs::write(place.path("file"), "no folder").unwrap();
    for option in ["-o", "--labels", "--json"] {
        let file = ["file/d.exr", "file/d.json"][usize::from(option == "--json")];
        place.bad(&["mask.png", option, file], 1, &["file"]);
    }
    place.bad(&["mask.png", "--method", "bounded-rwo"], 2, &["did you mean \"bounded-row\"?"]);
    place.bad(&["mask.png", "--method", "brtue"], 2, &["did you mean \"brute\"?"]);
    place.bad(&["none.png"], 1, &["none.png"]);
    std::fs::write(place.path("text.png"), "no picture").unwrap();
    place.bad(&["text.png"], 1, &["text.png", "PNG"]);
    // More pixels a side than labels can hold.
    write_png(&place.path("huge.png"), &Picture::filled([70_000, 1], [0; 3])).unwrap();
    place.bad(&["huge.png"], 1, &["huge.png", "65535"]);
    assert!(!place.path("d.exr").exists());
    // The mask survives, by whatever path it is named.
    let before = std::fs::read(place.path("mask.png")).unwrap();
    for option in ["-o", "--labels"] {
        place.bad(&["mask.png", option, "./mask.png"], 2, &["mask.png", "name another file"]);
    }
    assert_eq!(std::fs::read(place.path("mask.png")).unwrap(), before);
}
