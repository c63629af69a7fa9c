//! Filtered moments, and the lookups of `vsm`, `evsm` and `msm`, equal their mirrors.

use super::SIZE;
use crate::common::passes::{Random, read_mip};
use crate::common::{Shot, differing, every_nth, every_shipped, prepare, shipped_scene, visibility, with_gpu};
use crate::mirrors::{compare, lit_renderer};
use ash::vk;
use edgeshade::gpu::Image;
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::reference::filtering::moments::{Filter, Kept, Level, Settings, Stored, filtered, pack, unpack};
use edgeshade::reference::filtering::{evsm, msm, vsm};
use edgeshade::technique::filtering::{self, moment_kind};
use edgeshade::technique::{Params, find};
use edgeshade::view::LightView;

type Set = &'static [(&'static str, &'static str)];

/// Techniques in their forms.
pub const FORMS: [(&str, Set); 11] = [
    ("vsm", &[]),
    ("vsm", &[("filter", "gaussian"), ("width", "9"), ("fetch", "texels")]),
    ("vsm", &[("width", "63"), ("mips", "off")]),
    ("evsm", &[]),
    ("evsm", &[("bits", "16"), ("warps", "positive"), ("width", "7")]),
    ("evsm", &[("filter", "gaussian"), ("mips", "off"), ("fetch", "texels")]),
    ("msm", &[]),
    ("msm", &[("filter", "gaussian"), ("width", "7"), ("anisotropy", "1")]),
    ("msm", &[("bits", "16"), ("width", "9"), ("fetch", "texels")]),
    ("msm", &[("reconstruction", "hausdorff"), ("width", "31"), ("fetch", "texels")]),
    (
        "msm",
        &[
            ("bits", "16"),
            ("reconstruction", "hausdorff"),
            ("filter", "gaussian"),
            ("fetch", "texels"),
            ("mips", "off"),
        ],
    ),
];

pub fn params(id: &str, set: &[(&str, &str)]) -> Params {
    Params::parse(find(id).unwrap(), set.iter().copied()).unwrap()
}

fn kept(id: &str, p: &Params) -> Kept {
    match id {
        "vsm" => Kept::Variance,
        "evsm" => Kept::Warped(filtering::evsm::exponents(p)),
        _ if p.word("bits") == "16" => Kept::Packed,
        _ => Kept::Powers,
    }
}

fn filter(id: &str, p: &Params, light: &LightView) -> Filter {
    Filter {
        kept: kept(id, p),
        width: p.int("width"),
        gaussian: p.word("filter") == "gaussian",
        range: moment_kind::range(light),
    }
}

fn settings(p: &Params, light: &LightView) -> Settings {
    Settings {
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        width: p.int("width"),
        range: moment_kind::range(light),
        anisotropy: if p.on("mips") { p.int("anisotropy") } else { 0 },
        reduction: p.float("reduction"),
        sampled: p.word("fetch") != "texels",
    }
}

/// Returns one level of the moments, and the rounding of the format.
fn stored(host: &Host, image: &Image, level: u32) -> (Vec<[f32; 4]>, f64) {
    let half = |v: u16| half::f16::from_bits(v).to_f32();
    let unorm = |v: u16| f32::from(v) / 65535.0;
    match image.format() {
        vk::Format::R32G32_SFLOAT => {
            let texels = read_mip::<[f32; 2]>(host, image, level);
            (texels.into_iter().map(|[a, b]| [a, b, 0.0, 0.0]).collect(), 6e-8)
        }
        vk::Format::R32G32B32A32_SFLOAT => (read_mip(host, image, level), 6e-8),
        vk::Format::R16G16_SFLOAT => {
            let texels = read_mip::<[u16; 2]>(host, image, level);
            (texels.into_iter().map(|[a, b]| [half(a), half(b), 0.0, 0.0]).collect(), 0.5f64.powi(10))
        }
        vk::Format::R16G16B16A16_SFLOAT => {
            (read_mip::<[u16; 4]>(host, image, level).into_iter().map(|t| t.map(half)).collect(), 0.5f64.powi(10))
        }
        vk::Format::R16G16B16A16_UNORM => {
            // Drivers may round to the nearest step or to either of two, of halves too.
            (read_mip::<[u16; 4]>(host, image, level).into_iter().map(|t| t.map(unorm)).collect(), 1.0 / 65535.0)
        }
        format => panic!("{format:?}"),
    }
}

fn mirror(id: &str, p: &Params, shot: &Shot, light: &LightView, stored: &Stored<'_>) -> Mirror {
    let (data, settings) = (shot.data(), settings(p, light));
    match id {
        "vsm" => vsm::visibility(&data, stored, &settings, filtering::vsm::least_deviation(p)),
        "evsm" => {
            let warps = evsm::Warps {
                exponents: filtering::evsm::exponents(p),
                both: p.word("warps") == "both",
                least_deviation: 2.0 * p.float("deviation"),
            };
            evsm::visibility(&data, stored, &settings, &warps)
        }
        _ => {
            let reconstruction = msm::Reconstruction {
                hausdorff: p.word("reconstruction") == "hausdorff",
                bits_16: p.word("bits") == "16",
                moment_bias: filtering::msm::moment_bias(p),
            };
            msm::visibility(&data, stored, &settings, &reconstruction)
        }
    }
    .unwrap()
}

/// Largest error of a filtered moment: relative for warps, whose range is that of `f32`, else absolute.
fn off(found: [f32; 4], exact: [f64; 4], relative: bool, used: usize) -> f64 {
    let one = |c: usize| {
        let error = (f64::from(found[c]) - exact[c]).abs();
        if relative { error / exact[c].abs() } else { error }
    };
    // Written so that NaN counts.
    (0..used).map(one).fold(0.0, |worst, e| if e <= worst { worst } else { e })
}

#[test]
fn filtered_moments_equal_exact_sums() {
    with_gpu(|host| {
        let scene = shipped_scene("courtyard");
        for (id, set) in FORMS {
            let p = params(id, set);
            for map_size in [333, 64] {
                let mut renderer = lit_renderer(host, &scene, [48, 27], map_size, true);
                let mut technique = prepare(&renderer, id, set);
                renderer.frame(technique.as_mut()).unwrap();
                let shot = Shot::of(host, &renderer, true);
                let image = technique.intermediates()[0].1;
                let (found, step) = stored(host, image, 0);
                let filter = filter(id, &p, renderer.light());
                let size = [map_size; 2];
                let exact = filtered(&shot.map, size, &filter);
                let (relative, used) =
                    (id == "evsm", if image.format() == vk::Format::R32G32B32A32_SFLOAT { 4 } else { 2 });
                let used = if p.word("filter") == "box" && id == "msm" { 4 } else { used };
                let worst = |exact: &[[f64; 4]]| {
                    found.iter().zip(exact).map(|(f, e)| off(*f, *e, relative, used)).fold(0.0, f64::max)
                };
                // Integers of the table, single precision, the format; warps by exp with up to 3 + 2 * 42 steps, squared.
                let rounding = if relative { 3e-5 } else { 1e-6 };
                let table = if moments_are_tabulated(id, &p) {
                    1.5 / f64::from(filtering::summed_area::scale(p.int("width")))
                } else {
                    0.0
                };
                let allowed = rounding + table + step;
                let largest = worst(&exact);
                println!("{id} {set:?} map {map_size}: off by {largest:.1e}, {allowed:.1e} allowed");
                assert!(largest <= allowed, "{id} {set:?} {map_size}: {largest:.2e}");
                let other = filtered(&shot.map, size, &Filter { width: filter.width + 2, ..filter });
                assert!(worst(&other) > 10.0 * allowed, "{id} {set:?}: another width goes unnoticed");
                // The mip chain.
                if p.on("mips") {
                    let texels = found.iter().map(|t| t.map(f64::from)).collect();
                    let mut level = Level { size: size.map(|n| n as usize), texels };
                    for l in 1..=map_size.ilog2() {
                        level = level.coarser();
                        let (found, _) = stored(host, image, l);
                        assert_eq!(found.len(), level.texels.len());
                        let largest = found.iter().zip(&level.texels);
                        let largest = largest.map(|(f, e)| off(*f, *e, relative, used)).fold(0.0, f64::max);
                        let allowed = (1e-6 + step) * f64::from(l);
                        assert!(largest <= allowed, "{id} {set:?}, level {l}: {largest:.2e}");
                    }
                }
            }
        }
    });
}

fn moments_are_tabulated(id: &str, p: &Params) -> bool {
    id != "evsm" && p.word("filter") == "box"
}

#[test]
fn lookups_equal_their_mirrors() {
    with_gpu(|host| {
        for (i, scene) in every_nth(3, every_shipped().enumerate()) {
            for (k, (id, set)) in FORMS.into_iter().enumerate() {
                // A sampler may move the lookup by 1/256 of a texel, which explains too much where depths differ, as on
                // leaves; `both_ways_to_fetch_agree` has it.
                let set: Vec<_> = set.iter().copied().filter(|s| s.0 != "fetch").chain([("fetch", "texels")]).collect();
                let set = &set[..];
                let p = params(id, set);
                let normals = (i + k) % 3 != 0;
                let map_size = if k % 2 == 0 { 1024 } else { 333 };
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, normals);
                let mut technique = prepare(&renderer, id, set);
                renderer.frame(technique.as_mut()).unwrap();
                let gpu = renderer.visibility(technique.as_ref()).unwrap();
                let image = technique.intermediates()[0].1;
                let count = if p.on("mips") { map_size.ilog2() + 1 } else { 1 };
                let levels: Vec<_> = (0..count).map(|l| stored(host, image, l).0).collect();
                let stored = Stored { levels: &levels };
                let shot = Shot::of(host, &renderer, normals);
                let what = format!("{id} {set:?} {} {map_size} {normals}", scene.name);
                let mirror = mirror(id, &p, &shot, renderer.light(), &stored);
                compare(&gpu, &mirror, 2e-3).check(&what, 0.02);
                // The bounds are those of the worst case, far above what is lost: nearly all pixels are off by less than 0.02.
                // The form that reads a pixel by a single tap from coarse levels loses most, in up to 116 of 36,864 pixels.
                let pixels_per_miss = if p.int("anisotropy") == 1 { 200 } else { 1000 };
                let off = |values: &[f32]| {
                    let pixels = values.iter().zip(&mirror.visibility);
                    pixels.filter(|(v, m)| (f64::from(**v) - **m).abs() > 0.02).count()
                };
                let wide = mirror.rounding.iter().filter(|r| **r > 0.05).count();
                println!("    {} pixels off by 0.02; a bound above 0.05 in {wide}", off(&gpu));
                assert!(off(&gpu) * pixels_per_miss <= gpu.len(), "{what}: {} pixels are off by 0.02", off(&gpu));
                let planted: Vec<f32> = gpu.iter().map(|v| if *v > 0.5 { v - 0.06 } else { v + 0.06 }).collect();
                assert!(off(&planted) * 10 > gpu.len() * 9, "{what}: a planted error goes unnoticed");
            }
        }
    });
}

/// The sampler interpolates as the shader does, up to the sampler's fixed point.
#[test]
fn both_ways_to_fetch_agree() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut r = lit_renderer(host, &scene, SIZE, 512, true);
        // Drivers may interpolate integers of 16 bits in as many, where the least bias of four moments is four steps.
        for (id, bits, tolerance) in
            [("vsm", None, 0.02), ("evsm", None, 0.02), ("msm", None, 0.02), ("msm", Some("16"), 0.1)]
        {
            let [sampled, texels] = ["sampler", "texels"].map(|fetch| {
                let bits = bits.map(|b| ("bits", b));
                visibility(&mut r, id, &[("fetch", fetch), ("width", "5")].into_iter().chain(bits).collect::<Vec<_>>())
            });
            let off = differing(&sampled, &texels, tolerance);
            println!("{id} {bits:?}: {off} pixels differ by more than {tolerance}");
            assert!(off * 200 <= sampled.len(), "{id}: {off}");
            let other = visibility(&mut r, id, &[("width", "7")]);
            assert!(differing(&sampled, &other, 0.02) > 500, "{id}: another width goes unnoticed");
        }
    });
}

#[test]
fn packing_is_undone_and_keeps_to_its_range() {
    let mut random = Random(9);
    for _ in 0..10_000 {
        let x = 2.0 * f64::from(random.unit()) - 1.0;
        let b = [x, x * x, x.powi(3), x.powi(4)];
        let packed = pack(b);
        assert!(packed.iter().all(|p| (-1e-12..=1.0 + 1e-12).contains(p)), "{x}: {packed:?}");
        assert!(unpack(packed).iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14), "{x}");
    }
}
