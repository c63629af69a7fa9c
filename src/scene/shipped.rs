//! Scenes that come with Edgeshade, as `.glb` files made by `examples/make_scenes`.
//!
//! Lengths are metres, `+Y` is up. Every scene has a camera and one light with a size, so that the same file serves
//! hard and soft shadows.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Scene that comes with Edgeshade.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// Name on the command line, and stem of the file.
    pub name: &'static str,
    /// Description of the scene and its difficulty, in one line.
    pub about: &'static str,
    /// Content of the `.glb` file.
    pub bytes: &'static [u8],
}

/// Name of the default scene.
pub const DEFAULT: &str = "courtyard";

macro_rules! shipped {
    ($name:ident, $about:literal) => {
        Shipped {
            name: stringify!($name),
            about: $about,
            bytes: include_bytes!(concat!("../../assets/", stringify!($name), ".glb")),
        }
    };
}

/// Every shipped scene.
pub const ALL: &[Shipped] = &[
    shipped!(courtyard, "arcades, stairs, furniture and plants down a long passage: many objects over each other"),
    shipped!(drum, "drum, ball, bowl and saddle behind a rack of rods: curved receivers"),
    shipped!(fence, "iron fence, bicycle and overhead wires on paving and a wall: thin bars"),
    shipped!(foliage, "a small tree and grass out of cut-out leaves: alpha test, dense small holes"),
    shipped!(jenga, "a half-played tower of wooden blocks: contact shadows and narrow gaps"),
    shipped!(knot, "a woven ball of some hundred loops: one object that shadows itself everywhere"),
    shipped!(
        ripples,
        "a ground whose waves get ever narrower under poles and frames: receiver depth of rising frequency"
    ),
    shipped!(robot, "a four-legged walker with joints, pipes and antennae: mixed scales of one machine"),
];

/// Returns the shipped scene of that name.
pub fn find(name: &str) -> Option<&'static Shipped> {
    ALL.iter().find(|s| s.name == name)
}

/// Writes every scene as `<name>.glb` into a folder, which is created if necessary.
///
/// # Errors
/// Fails with [`Error::Io`], which names the file that could not be written.
pub fn write_all(dir: impl AsRef<Path>) -> Result<Vec<PathBuf>> {
    let dir = dir.as_ref();
    let io = |path: &Path, source| Error::Io { path: path.into(), source };
    std::fs::create_dir_all(dir).map_err(|e| io(dir, e))?;
    ALL.iter()
        .map(|scene| {
            let path = dir.join(scene.name).with_extension("glb");
            std::fs::write(&path, scene.bytes).map_err(|e| io(&path, e))?;
            Ok(path)
        })
        .collect()
}
