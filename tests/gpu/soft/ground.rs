//! Plane, level or tilted, that fills the views of a camera and a light, under hand-made shadow maps.

use crate::common::passes::Random;
use crate::common::{enlarged, plain_inputs, upload_depths};
use edgeshade::Inputs;
use edgeshade::gpu::Image;
use edgeshade::host::Host;
use edgeshade::reference::FrameData;
use edgeshade::technique::common::view::ViewConstants;
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique};
use edgeshade::view::{CameraView, LightView};
use glam::{DAffine3, dvec3};

/// Size of the map in texels: odd, and wider than high.
pub const MAP: [u32; 2] = [101, 67];
pub const IMAGE: [u32; 2] = [192, 128];

/// Lights and planes for noise: whether it is a spot, the light's size, the plane's tilt.
pub const UNDER_NOISE: [(bool, f64, f64); 5] =
    [(true, 0.0, 0.0), (true, 0.5, 0.0), (true, 3.0, 0.3), (false, 0.02, 0.0), (false, 0.4, -0.2)];

/// Distance of the plane's middle, and the planes of both views.
const DISTANCE: f64 = 10.0;
const NEAR: f64 = 1.0;
const FAR: f64 = 21.0;

/// Prepares a technique for such images and maps.
pub fn on_ground(host: &Host, id: &str, params: Params) -> Box<dyn Technique> {
    let setup =
        Setup { extent: IMAGE, map_size: MAP, output: OutputFormat::R32, params, intermediates: false, casters: None };
    technique::prepare(id, host.context(), &setup).unwrap()
}

pub struct Ground {
    pub camera: CameraView,
    pub light: [LightView; 1],
    depths: Vec<f32>,
    depth: Image,
}

impl Ground {
    /// Makes the plane and the light. The plane falls away by `tilt` per unit to the right. The light is a spot of
    /// full width `size`, or a sun of full angle `size`.
    pub fn new(host: &Host, is_spot: bool, size: f64, tilt: f64) -> Self {
        let eye = DAffine3::from_translation(dvec3(0.0, 0.0, DISTANCE));
        let half = [4.0, 4.0 * f64::from(MAP[1]) / f64::from(MAP[0])];
        let light = match is_spot {
            // Its square view is wider than the camera's.
            true => LightView::spot(eye, 2.0 * (half[0] / (DISTANCE - 1.5)).atan(), NEAR, FAR, size),
            false => LightView::directional(eye, half, NEAR, FAR, size),
        };
        let of_column = |i: u32| {
            let x = half[0] * ((2.0 * f64::from(i) + 1.0) / f64::from(IMAGE[0]) - 1.0);
            ((FAR - DISTANCE - tilt * x) / (FAR - NEAR)) as f32
        };
        let depths: Vec<f32> = (0..IMAGE[0] * IMAGE[1]).map(|i| of_column(i % IMAGE[0])).collect();
        Self {
            camera: CameraView::orthographic(eye, half, NEAR, FAR),
            light: [light],
            depth: upload_depths(host, &depths, IMAGE, false),
            depths,
        }
    }

    /// Returns the same under a light of another size.
    pub fn with_size(mut self, factor: f64) -> Self {
        self.light[0] = enlarged(&self.light[0], factor);
        self
    }

    /// Returns the depth that the map stores at a distance from the light's plane.
    pub fn stored(&self, distance: f64) -> f32 {
        let q = self.light[0].clip_from_view * glam::dvec4(0.0, 0.0, -distance, 1.0);
        (q.z / q.w) as f32
    }

    pub fn inputs<'a>(&'a self, map: &Image) -> Inputs<'a> {
        plain_inputs(&self.camera, &self.depth, map, &self.light)
    }

    pub fn constants(&self, map: &Image) -> ViewConstants {
        ViewConstants::new(&self.inputs(map))
    }

    pub fn data<'a>(&'a self, constants: &'a ViewConstants, map: &'a [f32]) -> FrameData<'a> {
        FrameData { constants, depth: &self.depths, normal: &[], shadow_map: map }
    }

    /// Returns the width of a texel at the plane's middle, world units along x.
    pub fn texel(&self) -> f64 {
        let q = self.light[0].clip_from_view * glam::dvec4(1.0, 0.0, -DISTANCE, 1.0);
        2.0 / (f64::from(MAP[0]) * q.x / q.w)
    }

    /// Returns the world x of a pixel's centre.
    pub fn x(&self, pixel: usize) -> f64 {
        (2.0 * (pixel % IMAGE[0] as usize) as f64 + 1.0) / f64::from(IMAGE[0]) * 4.0 - 4.0
    }

    pub const fn distance() -> f64 {
        DISTANCE
    }
}

/// Returns a shadow map of given depths, row by row from the top.
pub fn upload(host: &Host, depths: &[f32]) -> Image {
    upload_depths(host, depths, MAP, true)
}

/// Returns depths of noise: holes, casters at many heights, and occasional single texels.
pub fn noise(ground: &Ground, seed: u64) -> Vec<f32> {
    let mut random = Random(seed);
    let blocks: Vec<f32> = (0..20 * 20).map(|_| random.unit()).collect();
    let stored = |v: f32| match v {
        0.0..0.4 => 1.0,
        v => ground.stored(2.0 + 12.0 * f64::from(v - 0.4)),
    };
    (0..MAP[0] * MAP[1])
        .map(|i| {
            let (x, y) = (i % MAP[0], i / MAP[0]);
            let own = random.unit();
            stored(if own < 0.02 { 50.0 * own } else { blocks[(x / 6 + y / 5 * 20) as usize] })
        })
        .collect()
}
