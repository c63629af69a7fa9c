//! Binary shadow maps of noise over a flat receiver, and the shapes of the discontinuities in them.

use crate::common::{plain_inputs, run_passes, upload_depths};
use edgeshade::Inputs;
use edgeshade::gpu::Image;
use edgeshade::host::Host;
use edgeshade::reference::revectorization::revectorize::{
    Discontinuity, discontinuity, distance_to_edge, normalized, traverse_all,
};
use edgeshade::technique::Technique;
use edgeshade::view::{CameraView, LightView};
use glam::{DAffine3, DVec2, DVec4, dvec2, dvec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

/// Size of the map in texels: odd, and wider than high.
pub const MAP: [u32; 2] = [101, 67];
/// Pixels per texel along each axis.
pub const ZOOM: u32 = 4;
pub const IMAGE: [u32; 2] = [MAP[0] * ZOOM, MAP[1] * ZOOM];

/// Noise map; `true` where a texel is lit. Texels outside count as lit, as in the shaders.
#[derive(Clone)]
pub struct Noise(Vec<bool>);

impl Noise {
    /// Makes each block of texels lit or not at random, then flips about one texel in twenty.
    pub fn new(seed: u64, block: [u32; 2]) -> Self {
        let mut random = Pcg32::seed_from_u64(seed);
        let across = MAP[0].div_ceil(block[0]);
        let blocks: Vec<bool> = (0..across * MAP[1].div_ceil(block[1])).map(|_| random.next_u32() & 1 == 0).collect();
        let texel = |i: u32| blocks[(i % MAP[0] / block[0] + i / MAP[0] / block[1] * across) as usize];
        Self((0..MAP[0] * MAP[1]).map(|i| texel(i) ^ (random.next_u32() % 20 == 0)).collect())
    }

    pub fn lit(&self, [x, y]: [i64; 2]) -> bool {
        let inside = (0..i64::from(MAP[0])).contains(&x) && (0..i64::from(MAP[1])).contains(&y);
        !inside || self.0[(x + y * i64::from(MAP[0])) as usize]
    }

    /// Uploads the map as depth: 0 where it blocks, 1 where it does not.
    pub fn upload(&self, host: &Host, array: bool) -> Image {
        let depths: Vec<f32> = self.0.iter().map(|&lit| f32::from(u8::from(lit))).collect();
        upload_depths(host, &depths, MAP, array)
    }
}

/// Point of the map at a discontinuity, with the values of the listings there.
pub struct EdgePoint {
    pub d: Discontinuity,
    /// Steps to the ends: left, right, +v, -v; positive where an end was found.
    pub ends: [i64; 4],
    pub nrd: DVec4,
}

/// Returns the values at a point; `None` where its texel has no discontinuity.
pub fn edge_point(noise: &Noise, place: DVec2, max_distance: u32) -> Option<EdgePoint> {
    let first = place.floor();
    let texel = [first.x as i64, first.y as i64];
    let texels = |t| noise.lit(t);
    let d = discontinuity(&texels, texel);
    if d.mask == 0 {
        return None;
    }
    let ends = traverse_all(&texels, texel, d, max_distance);
    Some(EdgePoint { d, ends, nrd: normalized(distance_to_edge(place - first, ends), ends) })
}

/// Returns the position of a pixel's centre in the map, texels.
pub fn place(pixel: usize) -> DVec2 {
    let (x, y) = (pixel as u32 % IMAGE[0], pixel as u32 / IMAGE[0]);
    (dvec2(f64::from(x), f64::from(y)) + 0.5) / f64::from(ZOOM)
}

/// Camera and light side by side, looking straight at a plane that fills both views. There is an image pixel at
/// exactly every `1 / ZOOM` of a texel.
pub struct FlatReceiver {
    camera: CameraView,
    light: [LightView; 1],
    depth: Image,
}

impl FlatReceiver {
    pub fn new(host: &Host) -> Self {
        let eye = DAffine3::from_translation(dvec3(0.0, 0.0, 10.0));
        let half = MAP.map(|n| f64::from(n) / 16.0);
        let (near, far) = (1.0, 21.0);
        let depth = ((far - 10.0) / (far - near)) as f32;
        let depths = vec![depth; (IMAGE[0] * IMAGE[1]) as usize];
        Self {
            camera: CameraView::orthographic(eye, half, near, far),
            light: [LightView::directional(eye, half, near, far, 0.0)],
            depth: upload_depths(host, &depths, IMAGE, false),
        }
    }

    pub fn inputs<'a>(&'a self, map: &Image) -> Inputs<'a> {
        plain_inputs(&self.camera, &self.depth, map, &self.light)
    }
}

/// Returns the visibility from prepared inputs.
pub fn visibility_of(host: &Host, technique: &mut dyn Technique, inputs: &Inputs<'_>) -> Vec<f32> {
    run_passes(host, |frame| technique.record(frame, inputs));
    host.read_values(technique.output()).unwrap()
}
