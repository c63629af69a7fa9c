//! Every pass against its mirror in `f64`, pixel by pixel.

use crate::common::{Shot, assert_same_bits, desc, differing, every_nth, every_shipped, frame, prepare, renderer};
use crate::common::{shipped_scene, visibility, with_gpu};
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::reference::common::shade;
use edgeshade::reference::filtering::pcf::Settings;
use edgeshade::reference::filtering::{pcf, sm};
use edgeshade::scene::{RenderDesc, Renderer, Scene, ShadeOptions, ShadePush};
use edgeshade::technique::find;

const SIZE: [u32; 2] = [256, 144];

/// How a pass's output agrees with its mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    pub pixels: usize,
    /// Pixels whose value rounding may change by more than the tolerance, and in how many it shows: by 1 % or more.
    pub ties: usize,
    pub ties_differing: usize,
    /// Pixels beyond the tolerance and beyond what rounding explains: errors.
    pub wrong: usize,
    /// Largest difference among the pixels that are no ties, and among those that are.
    largest: f64,
    largest_tie: f64,
}

pub fn compare(gpu: &[f32], mirror: &Mirror, tolerance: f64) -> Agreement {
    assert_eq!(gpu.len(), mirror.visibility.len());
    let mut a = Agreement { pixels: gpu.len(), ..Agreement::default() };
    for (i, &value) in gpu.iter().enumerate() {
        let (doubt, rounding) = (mirror.doubt[i], mirror.rounding[i]);
        let difference = (f64::from(value) - mirror.visibility[i]).abs();
        let is_tie = doubt > tolerance;
        a.ties += usize::from(is_tie);
        if is_tie {
            a.ties_differing += usize::from(difference >= tolerance.max(0.01));
            a.largest_tie = a.largest_tie.max(difference);
        } else {
            a.largest = a.largest.max(difference);
        }
        // Written so that NaN counts.
        let explained = difference <= tolerance + rounding + if is_tie { doubt } else { 0.0 };
        a.wrong += usize::from(!explained);
    }
    a
}

impl Agreement {
    pub fn check(&self, what: &str, most_ties: f64) {
        let ties = self.ties as f64 / self.pixels as f64;
        println!(
            "{what:42} wrong {} of {}, ties {:.3} % (of these differ {}), largest difference {:.1e}, of a tie {:.1e}",
            self.wrong,
            self.pixels,
            100.0 * ties,
            self.ties_differing,
            self.largest,
            self.largest_tie
        );
        assert_eq!(self.wrong, 0, "{what}: {self:?}");
        assert!(ties <= most_ties, "{what}: {:.3} % ties", 100.0 * ties);
        assert!(self.ties_differing * 100 <= self.pixels, "{what}: {self:?}");
    }
}

pub fn default_of(technique: &str, name: &str) -> f32 {
    find(technique).unwrap().params.iter().find(|p| p.name == name).unwrap().default as f32
}

fn mirror_sm(shot: &Shot) -> Mirror {
    sm::visibility(&shot.data(), default_of("sm", "normal_offset"), default_of("sm", "depth_bias")).unwrap()
}

fn pcf_settings(width: u32) -> Settings {
    let normal_offset = default_of("pcf", "normal_offset");
    Settings { width, normal_offset, depth_bias: default_of("pcf", "depth_bias") }
}

pub fn lit_renderer<'h>(host: &'h Host, scene: &Scene, size: [u32; 2], map_size: u32, normals: bool) -> Renderer<'h> {
    renderer(host, scene, RenderDesc { normals, ..desc(size, map_size) })
}

#[test]
fn sm_equals_its_mirror() {
    with_gpu(|host| {
        for scene in every_shipped() {
            for (map_size, normals) in [(1024, true), (333, true), (1024, false)] {
                let mut renderer = lit_renderer(host, &scene, SIZE, map_size, normals);
                let gpu = visibility(&mut renderer, "sm", &[]);
                let mirror = mirror_sm(&Shot::of(host, &renderer, normals));
                let from = if normals { "normals" } else { "depth" };
                let what = format!("sm {} {map_size} {from}", scene.name);
                compare(&gpu, &mirror, 0.5).check(&what, if normals { 0.003 } else { 0.02 });
                // A picture with nothing in it would agree as well.
                let lit = gpu.iter().filter(|v| **v == 1.0).count();
                assert!(lit > gpu.len() / 10 && lit < gpu.len() * 97 / 100, "{what}: {lit} pixels lit");
            }
        }
    });
}

#[test]
fn pcf_equals_its_mirror_in_both_fetch_modes() {
    with_gpu(|host| {
        for (i, scene) in every_nth(2, every_shipped().enumerate()) {
            let cases: &[(u32, [u32; 2], u32, bool)] = &[
                (1, SIZE, 1024, true),
                (3, SIZE, 1024, true),
                (7, SIZE, 333, true),
                (15, SIZE, 1024, true),
                (63, [96, 54], 1024, true),
                (3, SIZE, 1024, false),
                (15, SIZE, 333, false),
            ];
            for &(width, size, map_size, normals) in cases {
                if width == 63 && i % 3 != 0 {
                    continue;
                }
                let mut renderer = lit_renderer(host, &scene, size, map_size, normals);
                let w = width.to_string();
                let mut run =
                    |fetch, skip| visibility(&mut renderer, "pcf", &[("width", &w), ("fetch", fetch), ("skip", skip)]);
                let gather = run("gather", "off");
                let one_by_one = run("loop", "off");
                let mirror = pcf::visibility(&Shot::of(host, &renderer, normals).data(), &pcf_settings(width)).unwrap();
                let from = if normals { "normals" } else { "depth" };
                let what = format!("pcf {} w{width} {map_size} {from}", scene.name);
                // Any of a wide kernel's many taps makes a tie; few of them come to differ.
                let most_ties: f64 = match width {
                    0..=3 => 0.005,
                    4..=7 => 0.02,
                    _ => 0.3,
                };
                let most_ties = if normals { most_ties } else { most_ties.max(0.05) };
                compare(&gather, &mirror, 1e-4).check(&format!("{what} gather"), most_ties);
                compare(&one_by_one, &mirror, 1e-4).check(&format!("{what} loop"), most_ties);
                // The sums are formed in another order: equal up to their rounding.
                let bits = differing(&gather, &one_by_one, 0.0);
                println!("{what}: {bits} pixels differ in a bit between loop and gather");
                assert_eq!(differing(&gather, &one_by_one, 1e-6), 0, "{what}: loop and gather differ");
            }
        }
    });
}

/// Skipping changes no bit, and works on no more tiles than it has to.
#[test]
fn skipping_changes_nothing() {
    with_gpu(|host| {
        let cases: &[(u32, [u32; 2], u32, bool)] = &[
            (1, SIZE, 1024, true),
            (3, SIZE, 64, true),
            (7, SIZE, 100, true),
            (15, SIZE, 333, true),
            (15, SIZE, 1024, false),
            (31, SIZE, 1024, true),
            (63, [96, 54], 1024, true),
            (63, [96, 54], 100, true),
        ];
        let (mut active, mut total) = (0, 0);
        for scene in every_nth(2, every_shipped()) {
            for &(width, size, map_size, normals) in cases {
                let mut renderer = lit_renderer(host, &scene, size, map_size, normals);
                let w = width.to_string();
                let off = visibility(&mut renderer, "pcf", &[("width", &w), ("skip", "off")]);
                let pixels = visibility(&mut renderer, "pcf", &[("width", &w), ("skip", "pixels")]);
                let (tiles, timing) = frame(&mut renderer, "pcf", &[("width", &w), ("skip", "tiles")]);
                let what = format!("pcf {} w{width} {map_size} at {size:?}", scene.name);
                assert_same_bits(&off, &pixels, &format!("{what}, pixels"));
                assert_same_bits(&off, &tiles, &format!("{what}, tiles"));
                let tiles = timing.passes.iter().find_map(|p| p.tiles).unwrap();
                assert_eq!(tiles.total, size[0].div_ceil(8) * size[1].div_ceil(8), "{what}");
                let listed = pcf::listed(&Shot::of(host, &renderer, normals).data(), &pcf_settings(width)).unwrap();
                let expected = listed.least..=listed.most;
                assert!(expected.contains(&tiles.active), "{what}: {} tiles, expected {expected:?}", tiles.active);
                (active, total) = (active + tiles.active, total + tiles.total);
            }
        }
        println!("tiles filtered: {active} of {total}");
        assert!(active > 0 && active < total, "{active} of {total} tiles");
    });
}

#[test]
fn the_picture_equals_its_mirror() {
    with_gpu(|host| {
        for scene in every_shipped() {
            let mut renderer = renderer(host, &scene, desc(SIZE, 1024));
            let mut technique = prepare(&renderer, "pcf", &[]);
            renderer.frame(technique.as_mut()).unwrap();
            let seen = renderer.visibility(technique.as_ref()).unwrap();
            let shot = Shot::with_normal(host, &renderer, Some(&renderer.gbuffer().shading_normal));
            let codes = host.read_image::<[u8; 4]>(&renderer.gbuffer().albedo).unwrap();
            let linear = |c: u8| {
                let c = f64::from(c) / 255.0;
                (if c > 0.04045 { ((c + 0.055) / 1.055).powf(2.4) } else { c / 12.92 }) as f32
            };
            let albedo: Vec<_> = codes.iter().map(|c| [linear(c[0]), linear(c[1]), linear(c[2])]).collect();
            let push = ShadePush::new(&scene, &crate::common::light_of(&scene), &ShadeOptions::default());
            let mirror = shade::picture(&shot.data(), &push, &albedo, &seen).unwrap();
            let picture = host.read_image::<[u8; 4]>(renderer.picture()).unwrap();
            // Codes are rounded once more, and the fetch of an sRGB texel has some freedom.
            let worst = |picture: &[[u8; 4]]| {
                let off = |(p, m): (&[u8; 4], &[f64; 3])| {
                    (0..3).map(|k| (f64::from(p[k]) - 255.0 * m[k]).abs()).fold(0.0, f64::max)
                };
                picture.iter().zip(&mirror).map(off).fold(0.0, f64::max)
            };
            let largest = worst(&picture);
            println!("shade {:12} largest difference {largest:.2} codes", scene.name);
            assert!(largest <= 1.5, "{}: {largest} codes", scene.name);
            let mut planted = picture.clone();
            planted[SIZE[0] as usize * 70 + 100][1] ^= 8;
            assert!(worst(&planted) > 1.5, "a planted difference of 8 codes goes unnoticed");
        }
    });
}

/// The comparisons are worth something only if they can fail.
#[test]
fn planted_differences_are_found() {
    with_gpu(|host| {
        let scene = shipped_scene("jenga");
        let mut renderer = lit_renderer(host, &scene, SIZE, 1024, true);
        let hard = visibility(&mut renderer, "sm", &[]);
        let soft = visibility(&mut renderer, "pcf", &[]);
        let shot = Shot::of(host, &renderer, true);
        let sure = |m: &Mirror| (0..m.doubt.len()).position(|i| m.doubt[i] == 0.0 && m.visibility[i] == 1.0).unwrap();

        let mirror = mirror_sm(&shot);
        let mut planted = hard.clone();
        planted[sure(&mirror)] = 0.0;
        assert_eq!(compare(&planted, &mirror, 0.5).wrong, 1);

        let mirror = pcf::visibility(&shot.data(), &pcf_settings(3)).unwrap();
        let (mut planted, at) = (soft.clone(), sure(&mirror));
        planted[at] -= 2e-4;
        assert_eq!(compare(&planted, &mirror, 1e-4).wrong, 1);
        planted[at] = f32::NAN;
        assert_eq!(compare(&planted, &mirror, 1e-4).wrong, 1);

        // One texel of the map that differs from what the GPU saw.
        let mut other = Shot { map: shot.map.clone(), depth: shot.depth.clone(), normal: shot.normal.clone(), ..shot };
        let middle = 512 * 1024 + 512;
        other.map[middle..middle + 64].fill(0.0);
        assert!(compare(&soft, &pcf::visibility(&other.data(), &pcf_settings(3)).unwrap(), 1e-4).wrong > 0);
        assert!(compare(&hard, &mirror_sm(&other), 0.5).wrong > 0);

        // Another kernel, another bias.
        other.map[middle..middle + 64].copy_from_slice(&shot.map[middle..middle + 64]);
        assert!(compare(&soft, &pcf::visibility(&other.data(), &pcf_settings(5)).unwrap(), 1e-4).wrong > 100);
        assert!(compare(&hard, &sm::visibility(&other.data(), 1.5, 0.5).unwrap(), 0.5).wrong > 100);

        // Too few values are refused.
        other.map.pop();
        assert!(sm::visibility(&other.data(), 0.0, 0.0).unwrap_err().to_string().contains("shadow map"));
    });
}
