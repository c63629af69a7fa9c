//! Generators of the shipped scenes and of those for judging. Each makes a scene in memory, and [`encode`] turns it
//! into a `.glb` file.
//!
//! Lengths are in metres, `+Y` is up. Every scene has a camera and one light with a size, so that the same file
//! serves hard and soft shadows.

mod blinds;
mod bridge;
mod courtyard;
mod drum;
mod fence;
mod foliage;
mod glb;
mod jenga;
mod kit;
mod knot;
mod mesh_builder;
mod plants;
mod plaza;
mod ripples;
mod robot;
mod stones;
mod texture;

use edgeshade::scene::Scene;

pub use glb::encode;

/// Function that makes a scene, the same on every platform.
pub type Stage = fn() -> Scene;

/// All shipped scenes with their names, in the order of [`edgeshade::scene::shipped::ALL`].
pub const ALL: [(&str, Stage); 8] = [
    ("courtyard", courtyard::stage),
    ("drum", drum::stage),
    ("fence", fence::stage),
    ("foliage", foliage::stage),
    ("jenga", jenga::stage),
    ("knot", knot::stage),
    ("ripples", ripples::stage),
    ("robot", robot::stage),
];

/// Scenes that serve only for judging techniques. They are not part of the library, so no suite measures on them and
/// no rule or default is chosen on them.
pub const JUDGING: [(&str, Stage); 4] =
    [("blinds", blinds::stage), ("bridge", bridge::stage), ("plaza", plaza::stage), ("stones", stones::stage)];
