//! Summed-area tables are exact, whatever the map's size.

use crate::common::passes::Random;
use crate::common::with_gpu;
use crate::made;
use ash::vk;
use edgeshade::gpu::ImageDesc;
use edgeshade::host::Host;
use edgeshade::reference::filtering::summed_area::{mean, outside, quantised, table};
use edgeshade::scene::{fit, light_view};
use edgeshade::technique::filtering::moment_kind::Kind;
use edgeshade::technique::filtering::summed_area::{SummedArea, scale};
use edgeshade::{Frame, Handoff, Inputs};
use glam::DVec3;

/// Returns the GPU's table of a map under a sun, with windows of up to `width` texels.
fn tabulated(host: &Host, texels: &[f32], size: [u32; 2], kind: Kind, width: u32) -> Vec<[u32; 4]> {
    tabulated_range(host, texels, size, (kind, width), 0.0)
}

/// Returns the GPU's table of a map under a light of any range of depths.
pub fn tabulated_range(
    host: &Host,
    texels: &[f32],
    size: [u32; 2],
    (kind, width): (Kind, u32),
    range: f32,
) -> Vec<[u32; 4]> {
    let scene = made::still_life(made::sun(DVec3::ONE));
    let camera = fit::camera(&scene, [1, 1]).view([1, 1]);
    let light = [light_view(&scene, &scene.lights[0])];
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { array: true, usage, ..ImageDesc::storage("map made here", vk::Format::D32_SFLOAT, size) };
    let map = host.upload_image(&desc, bytemuck::cast_slice(texels)).unwrap();
    let one = ImageDesc { array: false, usage, ..ImageDesc::storage("a pixel", vk::Format::D32_SFLOAT, [1, 1]) };
    let depth = host.upload_image(&one, bytemuck::bytes_of(&0.5f32)).unwrap();
    let mut pass = SummedArea::new(host.context(), size, kind, width).unwrap();
    let inputs = Inputs {
        camera: &camera,
        depth: depth.as_ref(),
        normal: None,
        shadow_map: map.as_ref(),
        light: &light,
        light_version: None,
        camera_version: None,
        casters: &[],
    };
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        pass.record(&mut frame, &inputs, range)?;
        frame.end();
        Ok(())
    })
    .unwrap();
    match kind {
        Kind::Variance => {
            host.read_image::<[u32; 2]>(pass.table()).unwrap().into_iter().map(|[a, b]| [a, b, 0, 0]).collect()
        }
        _ => host.read_image::<[u32; 4]>(pass.table()).unwrap(),
    }
}

/// Depths whose moments single precision holds exactly, so that the integers are certain.
fn exact_depths(size: [u32; 2], seed: u64) -> Vec<f32> {
    let mut random = Random(seed);
    (0..size[0] * size[1]).map(|_| (4.0 * random.unit()).round() / 4.0).collect()
}

#[test]
fn tables_are_exact_up_to_4096_texels_squared() {
    with_gpu(|host| {
        let sizes = [[1, 1], [1, 130], [130, 1], [3, 5], [64, 64], [100, 333], [511, 17], [513, 129], [4096, 4096]];
        for (k, size) in sizes.into_iter().enumerate() {
            // The largest map has two moments; their sums wrap around hundreds of thousands of times.
            let kinds = if size[0] > 1024 { &[Kind::Variance][..] } else { &[Kind::Variance, Kind::Packed] };
            for &kind in kinds {
                let texels = exact_depths(size, k as u64);
                let width = 3;
                let integers: Vec<_> = texels.iter().map(|&d| quantised(d, kind, 0.0, scale(width))).collect();
                let expected = table(&integers, size);
                let got = tabulated(host, &texels, size, kind, width);
                // Packing four moments multiplies by irrational numbers: these integers may be a few steps off.
                let exact = |c: usize| kind == Kind::Variance || c == 1;
                let wrong = got.iter().zip(&expected).filter(|(a, b)| (0..4).any(|c| exact(c) && a[c] != b[c])).count();
                assert_eq!(wrong, 0, "{kind:?} {size:?}: {wrong} of {} entries", got.len());
                // One step more in one texel changes everything below and to the right of it.
                let mut planted = integers.clone();
                let at = planted.len() / 2;
                planted[at][1] += 1;
                let other = table(&planted, size);
                let (x, y) = (at as u32 % size[0], at as u32 / size[0]);
                let changed = got.iter().zip(&other).filter(|(a, b)| a[1] != b[1]).count();
                assert_eq!(changed as u32, (size[0] - x) * (size[1] - y), "{kind:?} {size:?}");
            }
        }
    });
}

/// Means over random windows differ from exact ones by no more than the rounding of each texel, 0.5 of 1 / scale, and that
/// of the depths' own moments.
#[test]
fn windows_have_exact_means() {
    with_gpu(|host| {
        let size = [700, 500];
        let mut random = Random(5);
        let texels: Vec<f32> = (0..size[0] * size[1]).map(|_| random.unit()).collect();
        for (kind, width) in [(Kind::Variance, 15), (Kind::Variance, 127), (Kind::Packed, 63), (Kind::Packed, 255)] {
            let got = tabulated(host, &texels, size, kind, width);
            let scale = scale(width);
            let unit =
                |d: f32| quantised(d, kind, 0.0, (1u32 << 31) as f32).map(|v| f64::from(v) / f64::from(1u32 << 31));
            let units: Vec<[f64; 4]> = texels.iter().map(|&d| unit(d)).collect();
            let (mut largest, mut windows) = (0.0f64, 0);
            for _ in 0..300 {
                let whole = |n: f32| (random.unit() * n) as i64;
                let mut whole = whole;
                let first = [whole(size[0] as f32) - 20, whole(size[1] as f32) - 20];
                let end = [first[0] + 1 + whole(width as f32), first[1] + 1 + whole(width as f32)];
                let far = outside(kind, 0.0);
                let found = mean(&got, size, first, end, (scale, far));
                let mut exact = [0.0; 4];
                for y in first[1]..end[1] {
                    for x in first[0]..end[0] {
                        let inside = (0..i64::from(size[0])).contains(&x) && (0..i64::from(size[1])).contains(&y);
                        let v = if inside { units[(y * i64::from(size[0]) + x) as usize] } else { far };
                        exact = std::array::from_fn(|c| exact[c] + v[c]);
                    }
                }
                let area = ((end[0] - first[0]) * (end[1] - first[1])) as f64;
                largest = (0..4).map(|c| (found[c] - exact[c] / area).abs()).fold(largest, f64::max);
                windows += 1;
            }
            let allowed = 0.5 / f64::from(scale) + 4e-7;
            println!("{kind:?} up to {width}: {windows} windows, means off by {largest:.1e}, {allowed:.1e} allowed");
            assert!(largest <= allowed, "{kind:?} {width}: {largest:.2e}");
            assert!(largest > 1e-9, "nothing was rounded");
        }
    });
}

/// The sum over the largest window fits 32 bits, if only just; one over a wider window does not.
#[test]
fn the_scale_uses_all_bits() {
    for width in [1, 3, 5, 15, 31, 63, 127, 255, 511, 1023] {
        let scale = scale(width);
        // The integer that the shader stores for a moment of 1.
        let one = u64::from((1.0f32 * scale + 0.5) as u32);
        let (own, wider) = (u64::from(width).pow(2) * one, u64::from(width + 2).pow(2) * one);
        assert!(own <= u64::from(u32::MAX), "{width}");
        assert!(width == 1 || wider > u64::from(u32::MAX), "{width}");
    }
    with_gpu(|host| {
        // Everything far: both moments are 1, over a window of 31 and over one of 33.
        let (size, width) = ([64, 64], 31);
        let got = tabulated(host, &[1.0; 64 * 64], size, Kind::Variance, width);
        let over = |n: i64| mean(&got, size, [0, 0], [n, n], (scale(width), [0.0; 4]))[0];
        assert!((over(31) - 1.0).abs() < 1e-6, "{}", over(31));
        assert!((over(33) - 1.0).abs() > 0.05, "{}", over(33));
    });
}
