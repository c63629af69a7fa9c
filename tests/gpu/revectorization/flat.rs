//! A plane under a shadow map made here, seen so that every pixel lies at a known position in a known texel. Also the
//! results of the functions there from the bare shadow tests, without camera, light or depth.

use crate::common::plain_inputs;
use crate::noise::visibility_of;
use ash::vk;
use edgeshade::gpu::{Image, ImageDesc};
use edgeshade::host::Host;
use edgeshade::reference::FrameData;
use edgeshade::reference::revectorization::revectorize::{Function, Texels, prepare};
use edgeshade::technique::common::view::ViewConstants;
use edgeshade::technique::{self, OutputFormat, Params, Setup};
use edgeshade::view::{CameraView, LightView};
use edgeshade::{Inputs, NormalEncoding};
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

/// World size of a texel.
const TEXEL: f64 = 0.125;
/// Height of camera and light over the plane's middle, and the planes of their views.
const EYE: f64 = 20.0;
const NEAR: f64 = 1.0;
const FAR: f64 = 41.0;
/// Depth of casters, in front of any receiver here.
const CASTER: f32 = 0.02;
/// Depth by which the map's receiver lies behind the visible one, so that rounding decides nothing.
const DEEPER: f64 = 1e-5;

/// Single-precision error from a pixel to its position in the map, texels: eight roundings on maps up to 128 texels
/// wide.
pub const PLACE_ERROR: f64 = 8.0 * 128.0 * f32::EPSILON as f64;

/// The map, and the part that the image shows.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Size of the map, texels.
    pub map: [u32; 2],
    /// First texel shown, which may lie outside the map, and the number of texels shown.
    pub first: [i64; 2],
    pub texels: [u32; 2],
    /// Pixels per texel along each axis.
    pub zoom: u32,
    /// Rise of the plane towards the light along the world's x and y.
    pub rise: [f64; 2],
}

impl Window {
    pub fn size(&self) -> [u32; 2] {
        self.texels.map(|n| n * self.zoom)
    }

    /// Returns the texel that contains a pixel's centre, and the position in it.
    pub fn place(&self, pixel: usize) -> ([i64; 2], DVec2) {
        let (width, zoom) = (self.size()[0] as usize, self.zoom as usize);
        let at = [pixel % width, pixel / width];
        let texel = [0, 1].map(|k| self.first[k] + (at[k] / zoom) as i64);
        (texel, (dvec2((at[0] % zoom) as f64, (at[1] % zoom) as f64) + 0.5) / f64::from(self.zoom))
    }

    fn contains(&self, texel: [i64; 2]) -> bool {
        (0..2).all(|k| (0..i64::from(self.map[k])).contains(&texel[k]))
    }

    /// Returns the world x and y of a point of the map, texels.
    fn world(&self, point: DVec2) -> DVec2 {
        let middle = dvec2(self.map[0].into(), self.map[1].into()) / 2.0;
        dvec2(point.x - middle.x, middle.y - point.y) * TEXEL
    }

    fn height(&self, point: DVec2) -> f64 {
        DVec2::from(self.rise).dot(self.world(point))
    }

    /// Returns the indices of all pixels.
    pub fn pixels(&self) -> std::ops::Range<usize> {
        0..(self.size()[0] * self.size()[1]) as usize
    }
}

/// All inputs of a technique.
pub struct Flat {
    pub window: Window,
    camera: CameraView,
    light: [LightView; 1],
    images: [Image; 3],
    constants: ViewConstants,
    depth: Vec<f32>,
    normal: Vec<[f32; 3]>,
    map: Vec<f32>,
}

impl Flat {
    /// Makes the inputs from the map's texels; only those inside the map are read.
    pub fn new(host: &Host, window: Window, texels: &impl Texels) -> Self {
        let half = |n: [u32; 2]| n.map(|n| 0.5 * TEXEL * f64::from(n));
        let above = |p: DVec2| DAffine3::from_translation(window.world(p).extend(EYE));
        let middle = |first: DVec2, n: [u32; 2]| first + dvec2(n[0].into(), n[1].into()) / 2.0;
        let first = dvec2(window.first[0] as f64, window.first[1] as f64);
        let camera = CameraView::orthographic(above(middle(first, window.texels)), half(window.texels), NEAR, FAR);
        let of_map = above(middle(DVec2::ZERO, window.map));
        let light = [LightView::directional(of_map, half(window.map), NEAR, FAR, 0.0)];
        let point = |(texel, fraction): ([i64; 2], DVec2)| dvec2(texel[0] as f64, texel[1] as f64) + fraction;
        // The camera's depth is reversed, the light's is not.
        let range = FAR - NEAR;
        let seen = |p| (FAR - EYE + window.height(p)) / range;
        let stored = |p| (EYE - window.height(p) - NEAR) / range + DEEPER;
        let depth: Vec<f32> = window.pixels().map(|i| seen(point(window.place(i))) as f32).collect();
        let n: DVec3 = dvec3(-window.rise[0], -window.rise[1], 1.0).normalize();
        let normal = vec![n.as_vec3().to_array(); depth.len()];
        let [width, height] = window.map.map(i64::from);
        let map: Vec<f32> = (0..width * height)
            .map(|i| [i % width, i / width])
            .map(|t| if texels.lit(t) { stored(point((t, DVec2::splat(0.5)))) as f32 } else { CASTER })
            .collect();

        let usage = vk::ImageUsageFlags::SAMPLED;
        let of = |name, format, size| ImageDesc { usage, ..ImageDesc::storage(name, format, size) };
        let four: Vec<[f32; 4]> = normal.iter().map(|n| [n[0], n[1], n[2], 0.0]).collect();
        let (d32, rgba) = (vk::Format::D32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT);
        let map_desc = ImageDesc { array: true, ..of("map", d32, window.map) };
        let images = [
            host.upload_image(&of("depth", d32, window.size()), bytemuck::cast_slice(&depth)).unwrap(),
            host.upload_image(&of("normals", rgba, window.size()), bytemuck::cast_slice(&four)).unwrap(),
            host.upload_image(&map_desc, bytemuck::cast_slice(&map)).unwrap(),
        ];
        let constants = ViewConstants::default();
        let mut flat = Self { window, camera, light, images, constants, depth, normal, map };
        flat.constants = ViewConstants::new(&flat.inputs());
        flat
    }

    fn inputs(&self) -> Inputs<'_> {
        let [depth, normal, map] = &self.images;
        Inputs {
            normal: Some((normal.as_ref(), NormalEncoding::Cartesian)),
            ..plain_inputs(&self.camera, depth, map, &self.light)
        }
    }

    /// Returns the data for a mirror.
    pub fn data(&self) -> FrameData<'_> {
        let (depth, normal) = (&self.depth[..], &self.normal[..]);
        FrameData { constants: &self.constants, depth, normal, shadow_map: &self.map }
    }

    /// Returns a technique's visibility. Without a normal offset, receivers stay where they are.
    pub fn visibility(&self, host: &Host, id: &str, settings: &[(&str, &str)]) -> Vec<f32> {
        let settings = settings.iter().copied().chain([("normal_offset", "0")]);
        let params = Params::parse(technique::find(id).unwrap(), settings).unwrap();
        let (extent, map_size) = (self.window.size(), self.window.map);
        let setup = Setup { extent, map_size, output: OutputFormat::R32, params, intermediates: false, casters: None };
        let mut technique = technique::prepare(id, host.context(), &setup).unwrap();
        visibility_of(host, technique.as_mut(), &self.inputs())
    }
}

/// Result of a function from the shadow tests themselves, pixel by pixel.
pub struct Expected {
    pub visibility: Vec<f64>,
    /// Possible error of a pixel because a line that decides it passes within the rounding error of its position.
    pub doubt: Vec<f64>,
}

/// Returns the mean of `function` over `width` x `width` texels, or the function itself for width 1. Pixels and texels
/// outside the map are lit.
pub fn expected(w: &Window, texels: &impl Texels, function: Function, max_distance: u32, width: u32) -> Expected {
    let inside = |t: [i64; 2]| !w.contains(t) || texels.lit(t);
    expected_of(w, &inside, function, max_distance, width)
}

/// Returns the same, with any tests for the texels outside the map.
pub fn expected_of(w: &Window, texels: &impl Texels, function: Function, max_distance: u32, width: u32) -> Expected {
    let half = i64::from(width / 2);
    let first = w.first.map(|n| n - half);
    let [columns, rows] = w.texels.map(|n| i64::from(n) + 2 * half);
    let prepared: Vec<_> = (0..columns * rows)
        .map(|i| prepare(texels, [first[0] + i % columns, first[1] + i / columns], function, max_distance))
        .collect();
    let mut expected = Expected { visibility: vec![], doubt: vec![] };
    for (texel, fraction) in w.pixels().map(|i| w.place(i)) {
        let (mut sum, mut doubt) = (0.0, 0.0);
        for (i, j) in (0..i64::from(width)).flat_map(|j| (0..i64::from(width)).map(move |i| (i, j))) {
            let at = (texel[0] - w.first[0] + i) + (texel[1] - w.first[1] + j) * columns;
            let outcome = prepared[at as usize].at(fraction);
            sum += outcome.visibility;
            doubt += f64::from(u8::from(outcome.margin <= PLACE_ERROR));
        }
        let (area, is_seen) = (f64::from(width * width), w.contains(texel));
        expected.visibility.push(if is_seen { sum / area } else { 1.0 });
        expected.doubt.push(if is_seen { doubt / area } else { 0.0 });
    }
    expected
}

impl Expected {
    /// Counts the pixels that are not as expected, including NaN.
    pub fn wrong(&self, gpu: &[f32]) -> usize {
        assert_eq!(gpu.len(), self.visibility.len());
        let is_right = |i: usize| {
            // A ramp changes by at most 1 per texel along each axis.
            (f64::from(gpu[i]) - self.visibility[i]).abs() <= self.doubt[i] + 2.0 * PLACE_ERROR
        };
        (0..gpu.len()).filter(|&i| !is_right(i)).count()
    }

    /// Counts the pixels in doubt.
    pub fn ties(&self) -> usize {
        self.doubt.iter().filter(|d| **d > 0.0).count()
    }
}
