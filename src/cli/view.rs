//! Images that `--view` shows, as a picture for PNG and as channels for OpenEXR.

use super::args::usage;
use ash::vk;
use edgeshade::Result;
use edgeshade::gpu::Image;
use edgeshade::host::Host;
use edgeshade::picture::{Picture, linear_from_srgb, srgb_from_linear, write_exr, write_png, write_png_gray};
use edgeshade::scene::Renderer;
use edgeshade::view::DepthRange;
use glam::{DMat4, DVec3, Vec3, dvec4};
use std::path::Path;

/// Views that every technique has.
pub const NAMES: [&str; 7] = ["shaded", "visibility", "depth", "normal", "shadow-map", "albedo", "error"];

/// Name of the intermediate image that is drawn over the shaded picture.
pub const OVERLAY: &str = "silhouettes";

/// Form of an image in a PNG file.
pub enum Look {
    /// Colours to look at, 8 bits per channel.
    Color(Picture),
    /// Linear values in `[0, 1]`, 16 bits, which can be read back.
    Linear(Vec<f32>),
}

/// A view of a frame.
pub struct Shot {
    pub size: [u32; 2],
    pub look: Look,
    /// Name and values of each channel of an OpenEXR file.
    pub channels: Vec<(&'static str, Vec<f32>)>,
}

/// True if the name ends in .exr, false for .png; anything else is an error.
pub fn is_exr(path: &Path) -> Result<bool> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => Ok(true),
        Some("png") => Ok(false),
        _ => usage(format!("-o {}: the name must end in .png or .exr", path.display())),
    }
}

impl Shot {
    /// Writes the file in the format that its name implies.
    pub fn write(&self, path: &Path) -> Result<()> {
        if is_exr(path)? {
            let channels: Vec<_> = self.channels.iter().map(|(n, v)| (*n, v.as_slice())).collect();
            return write_exr(path, self.size, &channels);
        }
        match &self.look {
            Look::Color(picture) => write_png(path, picture),
            Look::Linear(values) => write_png_gray(path, self.size, values),
        }
    }

    /// A picture; OpenEXR gets it in linear light.
    pub fn color(picture: Picture) -> Self {
        let plane = |c: usize| picture.rgb.iter().map(|p| linear_from_srgb(p[c])).collect();
        let channels = vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))];
        Self { size: picture.size, look: Look::Color(picture), channels }
    }

    /// Visibility: 1 lit, 0 in shadow.
    pub fn visibility(values: Vec<f32>, size: [u32; 2]) -> Self {
        Self { size, channels: vec![("V", values.clone())], look: Look::Linear(values) }
    }

    /// The error `test - truth`. Pixels that are not judged are NaN in OpenEXR.
    pub fn error(test: &[f32], truth: &[f32], mask: &[bool], size: [u32; 2]) -> Result<Self> {
        let picture = Picture::from_error(test, truth, mask, size)?;
        let value = |i: usize| if mask[i] { test[i] - truth[i] } else { f32::NAN };
        let values = (0..test.len()).map(value).collect();
        Ok(Self { size, look: Look::Color(picture), channels: vec![("V", values)] })
    }

    /// A depth buffer of any projection. Near is bright, and pixels without a surface are black. OpenEXR gets the
    /// distance along the view axis in world units, infinite for pixels without a surface.
    pub fn depth(host: &Host, image: &Image, clip_from_view: &DMat4, range: DepthRange) -> Result<Self> {
        let view_from_clip = clip_from_view.inverse();
        let far = if range == DepthRange::Reversed { 0.0 } else { 1.0 };
        let distance = |d: f32| {
            if d == far {
                return f32::INFINITY;
            }
            let p = view_from_clip * dvec4(0.0, 0.0, d.into(), 1.0);
            (-p.z / p.w) as f32
        };
        let distances: Vec<f32> = host.read_values(image)?.into_iter().map(distance).collect();
        let size = image.extent();
        // Distances in a perspective view span orders of magnitude; those in a parallel view do not.
        let logarithmic = clip_from_view.row(3).z != 0.0;
        let picture = by_distance(&distances, size, logarithmic);
        Ok(Self { size, look: Look::Color(picture), channels: vec![("Z", distances)] })
    }

    /// Octahedral world-space normals; pixels without a surface have none.
    pub fn normal(host: &Host, image: &Image, triangle_ids: &[u32]) -> Result<Self> {
        let (planes, size) = (planes(host, image)?, image.extent());
        let normal = |i: usize| {
            if triangle_ids[i] == u32::MAX { [0.0; 3] } else { octahedral_decode([planes[0][i], planes[1][i]]) }
        };
        let normals: Vec<[f32; 3]> = (0..triangle_ids.len()).map(normal).collect();
        let code = |v: f32| (127.5 * (v + 1.0)).round() as u8;
        let rgb = normals.iter().map(|n| if *n == [0.0; 3] { [0; 3] } else { n.map(code) }).collect();
        let plane = |c: usize| normals.iter().map(|n| n[c]).collect();
        let channels = vec![("X", plane(0)), ("Y", plane(1)), ("Z", plane(2))];
        Ok(Self { size, look: Look::Color(Picture { size, rgb }), channels })
    }

    /// A picture with an image of the same size drawn over it. A pixel of that image counts if it has any alpha. Both
    /// images have 8-bit colours.
    pub fn over(host: &Host, below: &Image, above: &Image) -> Result<Self> {
        let (mut picture, above) = (self::picture(host, below)?, host.read_image::<[u8; 4]>(above)?);
        lay_over(&mut picture, &above);
        Ok(Self::color(picture))
    }

    /// Any image of a technique: one channel as grey, several as colours. Values beyond `[0, 1]` are scaled into it.
    pub fn of_image(host: &Host, image: &Image) -> Result<Self> {
        let (planes, size) = (planes(host, image)?, image.extent());
        let finite = || planes.iter().flatten().copied().filter(|v| v.is_finite());
        let (low, high) = finite().fold((0f32, 1f32), |(low, high), v| (low.min(v), high.max(v)));
        let shown = |v: f32| if v.is_nan() { 0.0 } else { ((v - low) / (high - low)).clamp(0.0, 1.0) };
        let look = if let [plane] = planes.as_slice() {
            Look::Linear(plane.iter().map(|&v| shown(v)).collect())
        } else {
            let code = |c: usize, i: usize| planes.get(c).map_or(0, |p| (255.0 * shown(p[i])).round() as u8);
            let rgb = (0..planes[0].len()).map(|i| std::array::from_fn(|c| code(c, i))).collect();
            Look::Color(Picture { size, rgb })
        };
        Ok(Self { size, look, channels: ["R", "G", "B", "A"].into_iter().zip(planes).collect() })
    }
}

/// The first three of four 8-bit channels.
pub fn picture(host: &Host, image: &Image) -> Result<Picture> {
    let rgba: Vec<[u8; 4]> = host.read_image(image)?;
    Ok(Picture { size: image.extent(), rgb: rgba.into_iter().map(|[r, g, b, _]| [r, g, b]).collect() })
}

/// Cosine between each pixel's G-buffer normal and the direction to the centre of the light; 0 for the sky.
/// `depth_view` holds the distances along the view axis in world units.
pub fn facing(host: &Host, renderer: &Renderer<'_>, depth_view: &[f32]) -> Result<Vec<f32>> {
    let (camera, light) = (renderer.camera(), renderer.light());
    let normals = &renderer.gbuffer().geometric_normal;
    let (planes, [w, h]) = (planes(host, normals)?, normals.extent());
    let axis = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
    let cosine = |i: usize| {
        let depth = f64::from(depth_view[i]);
        if !depth.is_finite() {
            return 0.0;
        }
        let center = |i: usize, n: u32| (2 * i + 1) as f64 / f64::from(n) - 1.0;
        let (origin, direction) = camera.ray([center(i % w as usize, w), center(i / w as usize, h)]);
        let along = (depth - (origin - camera.position()).dot(axis)) / direction.dot(axis);
        let normal = octahedral_decode([planes[0][i], planes[1][i]]);
        Vec3::from(normal).as_dvec3().dot(light.towards(origin + along * direction)) as f32
    };
    Ok((0..depth_view.len()).map(cosine).collect())
}

/// Replaces the pixels where `above` has any alpha.
fn lay_over(picture: &mut Picture, above: &[[u8; 4]]) {
    for (pixel, &[r, g, b, a]) in picture.rgb.iter_mut().zip(above) {
        if a > 0 {
            *pixel = [r, g, b];
        }
    }
}

/// Averages blocks of `factor x factor` pixels in linear light.
pub fn box_filter(source: &Picture, factor: u32) -> Picture {
    let decode: Vec<f32> = (0..=255).map(linear_from_srgb).collect();
    let size = source.size.map(|s| s / factor);
    let weight = 1.0 / (factor * factor) as f32;
    let pixel = |x: u32, y: u32| {
        let mut sum = [0f32; 3];
        for (sx, sy) in (0..factor).flat_map(|j| (0..factor).map(move |i| (x * factor + i, y * factor + j))) {
            let p = source.rgb[sy as usize * source.size[0] as usize + sx as usize];
            (0..3).for_each(|c| sum[c] += decode[usize::from(p[c])]);
        }
        sum.map(|v| srgb_from_linear(v * weight))
    };
    let rgb = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
    Picture { size, rgb }
}

/// Grey by distance or its logarithm: the nearest is bright, the farthest dark, pixels without a surface are black.
fn by_distance(distances: &[f32], size: [u32; 2], logarithmic: bool) -> Picture {
    let scale = |d: f32| if logarithmic { d.max(f32::MIN_POSITIVE).ln() } else { d };
    let finite = || distances.iter().filter(|d| d.is_finite()).map(|&d| scale(d));
    let (low, high) = finite().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
    let code = |&d: &f32| {
        if !d.is_finite() {
            return [0; 3];
        }
        let t = if high > low { (scale(d) - low) / (high - low) } else { 0.0 };
        [(255.0 - 215.0 * t).round() as u8; 3]
    };
    Picture { size, rgb: distances.iter().map(code).collect() }
}

fn octahedral_decode([x, y]: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let fold = |v: f32| if v >= 0.0 { v - t } else { v + t };
    let n = glam::vec3(fold(x), fold(y), z);
    n.normalize_or_zero().to_array()
}

/// Decodes the value of a channel from its bytes.
type Decode = fn(&[u8]) -> f32;

/// Reads the channels of an image in one of the common formats.
fn planes(host: &Host, image: &Image) -> Result<Vec<Vec<f32>>> {
    use vk::Format as F;
    let unorm8 = |b: &[u8]| f32::from(b[0]) / 255.0;
    let uint8 = |b: &[u8]| f32::from(b[0]);
    let snorm16 = |b: &[u8]| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0);
    let uint16 = |b: &[u8]| f32::from(u16::from_le_bytes([b[0], b[1]]));
    let unorm16 = |b: &[u8]| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0;
    let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
    let float = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let uint32 = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32;
    let (count, bytes, decode): (usize, usize, Decode) = match image.format() {
        F::R8_UNORM => (1, 1, unorm8),
        F::R8G8_UNORM => (2, 1, unorm8),
        F::R8G8B8A8_UNORM | F::R8G8B8A8_SRGB => (4, 1, unorm8),
        F::R8_UINT => (1, 1, uint8),
        F::R16_UINT => (1, 2, uint16),
        F::R16G16_UINT => (2, 2, uint16),
        F::R16G16_SNORM => (2, 2, snorm16),
        F::R16G16B16A16_UNORM => (4, 2, unorm16),
        F::R16_SFLOAT => (1, 2, half),
        F::R16G16_SFLOAT => (2, 2, half),
        F::R16G16B16A16_SFLOAT => (4, 2, half),
        F::R32_UINT => (1, 4, uint32),
        F::R32_SFLOAT | F::D32_SFLOAT => (1, 4, float),
        F::R32G32_SFLOAT => (2, 4, float),
        F::R32G32B32A32_SFLOAT => (4, 4, float),
        format => return usage(format!("an image of the format {format:?} cannot be shown")),
    };
    let raw: Vec<u8> = match count * bytes {
        1 => host.read_image::<u8>(image)?,
        2 => host.read_image::<[u8; 2]>(image)?.into_flattened(),
        4 => host.read_image::<[u8; 4]>(image)?.into_flattened(),
        8 => host.read_image::<[u8; 8]>(image)?.into_flattened(),
        _ => host.read_image::<[u8; 16]>(image)?.into_flattened(),
    };
    let plane = |c: usize| raw.chunks_exact(count * bytes).map(|t| decode(&t[c * bytes..])).collect();
    Ok((0..count).map(plane).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_filter_means_in_linear_light() {
        let checker = Picture { size: [4, 2], rgb: [[0; 3], [255; 3], [7; 3], [7; 3]].repeat(2) };
        assert_eq!(box_filter(&checker, 2), Picture { size: [2, 1], rgb: vec![[188; 3], [7; 3]] });
        assert_eq!(box_filter(&checker, 1), checker);
    }

    #[test]
    fn what_has_alpha_covers() {
        let mut picture = Picture { size: [3, 1], rgb: vec![[1, 2, 3]; 3] };
        lay_over(&mut picture, &[[9, 8, 7, 0], [9, 8, 7, 255], [0, 0, 0, 1]]);
        assert_eq!(picture.rgb, [[1, 2, 3], [9, 8, 7], [0; 3]]);
    }

    #[test]
    fn octahedral_corners_decode_to_axes() {
        for (code, axis) in [
            ([0.0, 0.0], [0.0, 0.0, 1.0]),
            ([1.0, 0.0], [1.0, 0.0, 0.0]),
            ([0.0, -1.0], [0.0, -1.0, 0.0]),
            ([1.0, 1.0], [0.0, 0.0, -1.0]),
            ([-1.0, 1.0], [0.0, 0.0, -1.0]),
        ] {
            assert_eq!(octahedral_decode(code), axis);
        }
    }

    #[test]
    fn near_is_bright_and_nothing_is_black() {
        let grey = |distances: &[f32], logarithmic| {
            let size = [distances.len() as u32, 1];
            by_distance(distances, size, logarithmic).rgb.into_iter().map(|c| c[0]).collect::<Vec<_>>()
        };
        assert_eq!(grey(&[1.0, 10.0, 100.0, f32::INFINITY], true), [255, 148, 40, 0]);
        assert_eq!(grey(&[-1.0, 0.0, 1.0, f32::INFINITY], false), [255, 148, 40, 0]);
        assert_eq!(grey(&[f32::INFINITY], true), [0]);
        assert_eq!(grey(&[-3.0, -3.0], false), [255, 255]);
    }
}
