//! `rbsm-branches` and `rbsm-listings` give, bit for bit, the images of `rbsm` and of `rbsm-filtered` with
//! `shapes=printed`. `rbsm-listings` also gives the image of `rbsm-star`. `rbsm-branches` takes each of its branches.

use crate::common::{desc, every_nth, every_shipped, prepare, renderer, with_gpu};
use crate::noise::{EdgePoint, FlatReceiver, MAP, Noise, edge_point, place, visibility_of};
use edgeshade::host::Host;
use edgeshade::reference::revectorization::revectorize::{Side, filtered_visibility, silhouette_visibility};
use edgeshade::technique::{OutputFormat, Params, Setup, find, prepare as prepare_technique};
use edgeshade::{Inputs, NormalEncoding};
use std::collections::BTreeMap;

/// Largest displacement of a position in the map by single precision, over both axes together, texels: four roundings
/// per coordinate. Between two jumps, visibility changes by no more than the position.
const PLACE_ERROR: f64 = 2.0 * 4.0 * f32::EPSILON as f64 * MAP[0] as f64;

/// The word of `variant`, and the technique and settings with the same image.
type Variant = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const VARIANTS: [Variant; 3] =
    [("silhouette", "rbsm", &[]), ("filtered", "rbsm-filtered", &[("shapes", "printed")]), ("star", "rbsm-star", &[])];

fn differing_bits(a: &[f32], b: &[f32]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a.to_bits() != b.to_bits()).count()
}

/// Runs one technique on prepared inputs.
fn run(host: &Host, inputs: &Inputs<'_>, map_size: [u32; 2], id: &str, settings: &[(&str, &str)]) -> Vec<f32> {
    let params = Params::parse(find(id).unwrap(), settings.iter().copied()).unwrap();
    let setup = Setup {
        extent: inputs.depth.extent,
        map_size,
        output: OutputFormat::R32,
        params,
        intermediates: false,
        casters: None,
    };
    let mut technique = prepare_technique(id, host.context(), &setup).unwrap();
    visibility_of(host, technique.as_mut(), inputs)
}

/// Returns the image of a technique after comparing it with those of its opponents: the listings, and the branches in all
/// skip modes.
fn compared(
    host: &Host,
    inputs: &Inputs<'_>,
    map_size: [u32; 2],
    (name, technique, setting): Variant,
    settings: &[(&str, &str)],
    what: &str,
) -> Vec<f32> {
    let with = |more: &[(&'static str, &'static str)]| [settings, more].concat();
    let expected = run(host, inputs, map_size, technique, &[&with(&[("skip", "off")]), setting].concat());
    let equals = |id: &str, more: &[(&'static str, &'static str)]| {
        let got = run(host, inputs, map_size, id, &with(more));
        assert_eq!(differing_bits(&expected, &got), 0, "{what}: {id} {more:?}, {settings:?}");
    };
    equals("rbsm-listings", &[("variant", name)]);
    for skip in if name == "star" { &[][..] } else { &["off", "list", "tiles"] } {
        equals("rbsm-branches", &[("variant", name), ("skip", skip)]);
    }
    expected
}

#[test]
fn shipped_scenes_are_equal_bit_for_bit() {
    with_gpu(|host| {
        for (i, scene) in every_nth(2, every_shipped().enumerate()) {
            // Every map on every third scene.
            let map = [64, 333, 1024][i % 3];
            let mut r = renderer(host, &scene, desc([256, 144], map));
            r.frame(prepare(&r, "sm", &[]).as_mut()).unwrap();
            let g = r.gbuffer();
            let inputs = Inputs {
                camera: r.camera(),
                depth: g.depth.as_ref(),
                normal: Some((g.geometric_normal.as_ref(), NormalEncoding::OctahedralSigned)),
                shadow_map: r.shadow_map().as_ref(),
                light: std::slice::from_ref(r.light()),
                light_version: None,
                camera_version: None,
                casters: &[],
            };
            let hard = run(host, &inputs, [map; 2], "sm", &[]);
            // Each combination is its own pipeline, and compiling it takes most of the time.
            for (receiver, distance) in [("plane", "16"), ("fixed", "64")] {
                let settings = [("receiver", receiver), ("max_distance", distance)];
                let what = format!("{}, map {map}", scene.name);
                let images = VARIANTS.map(|v| compared(host, &inputs, [map; 2], v, &settings, &what));
                // The images differ from each other and from plain shadow mapping.
                for (i, a) in images.iter().enumerate() {
                    for b in images[..i].iter().chain([&hard]) {
                        assert!(differing_bits(a, b) > 0, "{what}, {settings:?}");
                    }
                }
            }
        }
    });
}

/// Properties that select a branch. Each `Option` that the fields end in is `None` in silhouette recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Scenario {
    I,
    /// `true` if the fragment is lit.
    O(Option<bool>),
    /// `true` if both ends on u were found, `false` if both on v. Then the end found on the other axis, and `true` if
    /// the fragment is lit.
    U(bool, Option<(Option<usize>, bool)>),
    /// The ends found on u and v; `true` if the discontinuity runs along u; `true` if the fragment is lit.
    L(usize, usize, bool, Option<bool>),
}

/// Returns the scenario of a point; `None` where the shader does not reach its branches.
fn scenario(e: &EdgePoint, is_filtered: bool) -> Option<Scenario> {
    if !is_filtered && !e.d.lit {
        return None;
    }
    let found = |axis: usize| -> Vec<usize> { (2 * axis..2 * axis + 2).filter(|&i| e.ends[i] > 0).collect() };
    let lit = is_filtered.then_some(e.d.lit);
    Some(match (&found(0)[..], &found(1)[..]) {
        (&[_, _], &[_, _]) => Scenario::O(lit),
        (&[_, _], other) => Scenario::U(true, lit.map(|lit| (other.first().copied(), lit))),
        (other, &[_, _]) => Scenario::U(false, lit.map(|lit| (other.first().copied(), lit))),
        (&[u], &[v]) => Scenario::L(u, v, e.d.at(Side::ALL[v]), lit),
        _ => Scenario::I,
    })
}

#[test]
fn noise_is_equal_bit_for_bit_and_takes_every_branch() {
    with_gpu(|host| {
        let receiver = FlatReceiver::new(host);
        // Pixels by scenario, for silhouette recovery and for filtering.
        let mut taken: [BTreeMap<Scenario, usize>; 2] = Default::default();
        let mut largest = 0.0_f64;
        for (seed, block) in (1..).zip([[1, 1], [2, 2], [1, 3], [3, 1], [7, 5], [24, 20]]) {
            let noise = Noise::new(seed, block);
            let map = noise.upload(host, true);
            let inputs = receiver.inputs(&map);
            for distance in [1_u32, 16] {
                let text = distance.to_string();
                let compare = |receiver| {
                    let settings = [("receiver", receiver), ("max_distance", &text[..])];
                    VARIANTS.map(|v| compared(host, &inputs, MAP, v, &settings, &format!("blocks of {block:?}")))
                };
                // The receiver is level, so its plane is the fixed depth.
                let images = compare("plane");
                assert!(images == compare("fixed"));
                let mut wrong = [0; 2];
                for (pixel, (&silhouette, &filtered)) in images[0].iter().zip(&images[1]).enumerate() {
                    let at = edge_point(&noise, place(pixel), distance);
                    for (variant, v) in [silhouette, filtered].into_iter().enumerate() {
                        let v = f64::from(v);
                        let Some((e, s)) = at.as_ref().and_then(|e| Some((e, scenario(e, variant == 1)?))) else {
                            wrong[variant] += usize::from(v != f64::from(u8::from(noise.lit(texel(pixel)))));
                            continue;
                        };
                        *taken[variant].entry(s).or_default() += 1;
                        // The scenario belongs to the pixel: the listings in f64 give the same visibility.
                        let listing = [silhouette_visibility, filtered_visibility][variant];
                        let is_tie = variant == 0 && (e.nrd.x + e.nrd.y - 1.0).abs() <= PLACE_ERROR;
                        if !is_tie {
                            let difference = (v - listing(e.d, e.nrd)).abs();
                            wrong[variant] += usize::from(difference > PLACE_ERROR);
                            largest = largest.max(difference);
                        }
                    }
                }
                assert_eq!(wrong, [0; 2], "blocks of {block:?}, distance {distance}: not as the listings say");
            }
        }
        println!("largest difference to the listings in f64: {largest:e}, allowed {PLACE_ERROR:e}");
        for (taken, count, name) in [(&taken[0], 12, "silhouette"), (&taken[1], 31, "filtered")] {
            for (s, pixels) in taken {
                println!("{name}: {s:?}: {pixels} pixels");
            }
            assert_eq!(taken.len(), count, "{name}: scenarios taken");
        }
    });
}

fn texel(pixel: usize) -> [i64; 2] {
    let at = place(pixel).floor();
    [at.x as i64, at.y as i64]
}
