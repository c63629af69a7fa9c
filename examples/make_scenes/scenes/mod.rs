//! Generators of the shipped scenes. Each makes a scene in memory, and [`encode`] turns it into a `.glb` file.
//!
//! Lengths are in metres, `+Y` is up. Every scene has a camera and one light with a size, so that the same file
//! serves hard and soft shadows.

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
mod ripples;
mod robot;
mod texture;

use edgeshade::scene::Scene;

pub use glb::encode;

/// Function that makes a scene, the same on every platform.
pub type Stage = fn() -> Scene;

/// All scenes with their names, in the order of [`edgeshade::scene::shipped::ALL`].
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
