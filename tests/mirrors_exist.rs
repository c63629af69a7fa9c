//! Checks that every shader of a compute pass, and every file that such shaders include, has a CPU mirror in its
//! room.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[path = "../build/tree.rs"]
#[allow(dead_code)]
mod tree;

/// Files included only by raster shaders, which no mirror covers: their images are compared with ray-traced truth.
const RASTER: [&str; 6] = [
    "caster_edges/edge_quad.glsl",
    "caster_edges/silhouette.glsl",
    "caster_edges/volume.glsl",
    "caster_edges/volume_triangle.glsl",
    "common/instance.glsl",
    "common/material.glsl",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Names of the files in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Shaders that a room's mirrors cover: the stems of the mirrors' files, and the names in backticks in the heads of
/// these files.
struct Covered {
    stems: BTreeSet<String>,
    named: BTreeSet<String>,
}

impl Covered {
    fn of(room: &str) -> Self {
        let folder = root().join("src/reference").join(room);
        let (mut stems, mut named) = (BTreeSet::new(), BTreeSet::new());
        for name in names(&folder) {
            let Some(stem) = name.strip_suffix(".rs") else { continue };
            let text = std::fs::read_to_string(folder.join(&name)).unwrap();
            if stem != "mod" {
                stems.insert(stem.to_owned());
            }
            for line in text.lines().take_while(|l| l.starts_with("//!")) {
                // Every second piece lies between backticks.
                for name in line.split('`').skip(1).step_by(2) {
                    let name = name.strip_prefix(&format!("glsl/{room}/")).unwrap_or(name);
                    if name.ends_with(".comp") || name.ends_with(".glsl") {
                        named.insert(name.to_owned());
                    }
                }
            }
        }
        Self { stems, named }
    }

    fn covers(&self, shader: &str) -> bool {
        let stem = shader.rsplit_once('.').map_or(shader, |s| s.0);
        self.stems.contains(stem) || self.named.iter().any(|pattern| matches(pattern, shader))
    }
}

/// Compares a name with a pattern in which `*` stands for any text.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        Some((before, after)) => name.starts_with(before) && name.ends_with(after),
        None => pattern == name,
    }
}

#[test]
fn every_shader_has_a_mirror_in_its_room() {
    for room in tree::ROOMS {
        let shaders = names(&root().join("glsl").join(room));
        let covered = Covered::of(room);
        for shader in shaders.iter().filter(|s| s.ends_with(".comp") || s.ends_with(".glsl")) {
            let is_raster = RASTER.contains(&format!("{room}/{shader}").as_str());
            assert!(
                covered.covers(shader) != is_raster,
                "glsl/{room}/{shader}: write src/reference/{room}/<stem>.rs, or name the shader in the head of the \
                 mirror that covers it; files of raster shaders alone are listed in this test"
            );
        }
        // Every name in a head exists, and a new shader is noticed.
        for name in covered.named.iter().filter(|n| !n.contains('/')) {
            assert!(
                shaders.iter().any(|s| matches(name, s)),
                "src/reference/{room} names {name}, which does not exist"
            );
        }
        assert!(!covered.covers("new_pass.comp"), "{room}");
    }
}
