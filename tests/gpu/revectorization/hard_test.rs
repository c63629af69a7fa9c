//! The RBSM family compared with the hard shadow test alone: where it must keep the test, and where it may only darken
//! it. Nothing here uses the mirrors: a pixel's point is where its ray meets the scene, and the map is read directly.

use crate::common::{Shot, desc, every_shipped, renderer, visibility, with_gpu};
use crate::properties::hits;
use edgeshade::reference::ray_traced::Hit;
use edgeshade::view::LightView;
use glam::{DMat2, DVec2, DVec3, dvec2};

const SIZE: [u32; 2] = [256, 144];

/// Counts the pixels of `b` that are lighter than those of `a`.
fn lighter(a: &[f32], b: &[f32]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| b.is_nan() || b > a).count()
}

/// Listing 4 with a fixed depth starts from exactly the test of shadow mapping.
#[test]
fn silhouette_recovery_lights_nothing() {
    with_gpu(|host| {
        let (mut grown, mut by_others) = (0, 0);
        for (i, scene) in every_shipped().enumerate() {
            let map = [128, 1024][i % 2];
            let mut r = renderer(host, &scene, desc(SIZE, map));
            let sm = visibility(&mut r, "sm", &[("normal_offset", "1")]);
            let same = [("receiver", "fixed"), ("normal_offset", "1"), ("depth_bias", "0")];
            for distance in if i == 0 { &["1", "16", "64"][..] } else { &["1", "16"] } {
                let settings = [&same[..], &[("max_distance", *distance)]].concat();
                let rbsm = visibility(&mut r, "rbsm", &settings);
                assert_eq!(lighter(&sm, &rbsm), 0, "{} map {map}, distance {distance}", scene.name);
                grown += lighter(&rbsm, &sm);
            }
            // RBSM* moves the boundary both ways.
            by_others += lighter(&sm, &visibility(&mut r, "rbsm-star", &same));
        }
        println!("{grown} pixels darkened by rbsm, {by_others} lit by rbsm-star");
        assert!(grown > 1000 && by_others > 300);
    });
}

/// Facts about a pixel that the map alone makes certain.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Certain {
    Nothing,
    /// The texel that contains the pixel's point is in shadow.
    Dark,
    /// No side of the texel has a discontinuity; holds the texel's test.
    Quiet(bool),
}

/// The techniques' default bias along the slope of a texel, and the margin for rounding on either side of a test: a
/// fraction of the slope (for 16-bit normals) and a part of the depth.
const DEPTH_BIAS: f64 = 0.3;
const GUARD: [f64; 2] = [0.1, 1e-6];

fn certain(hit: &Hit, light: &LightView, map: &[f32], map_size: u32) -> Certain {
    let point = |p: DVec3| {
        let q = light.clip_from_view * light.world_from_view.inverse().transform_point3(p).extend(1.0);
        let inside = q.w > 0.0 && q.x.abs().max(q.y.abs()) < q.w && q.z > 0.0 && q.z < q.w;
        let place = dvec2(q.x / q.w + 1.0, q.y / q.w + 1.0) * 0.5 * f64::from(map_size);
        inside.then_some((place, q.z / q.w))
    };
    if hit.normal.dot(light.towards(hit.position)) < 0.05 {
        return Certain::Nothing;
    }
    // The plane's slope per texel, from two steps so short that perspective has no effect.
    let step = 1e-5 * (light.position() - hit.position).length();
    let (s, t) = hit.normal.any_orthonormal_pair();
    let points = [DVec3::ZERO, s, t].map(|d| point(hit.position + step * d));
    let [Some((place, depth)), Some((ps, ds)), Some((pt, dt))] = points else { return Certain::Nothing };
    let slope = DMat2::from_cols(ps - place, pt - place).transpose().inverse() * dvec2(ds - depth, dt - depth);
    let steep = slope.abs().element_sum();
    let first = place.floor();
    let fraction = place - first;
    if fraction.min_element() < 0.01 || fraction.max_element() > 0.99 {
        return Certain::Nothing;
    }
    // Lit, in shadow, or too close to tell.
    let test = |away: DVec2| {
        let texel = (first + away).as_i64vec2();
        let inside = texel.min_element() >= 0 && texel.max_element() < i64::from(map_size);
        let index = texel.y * i64::from(map_size) + texel.x;
        let stored = if inside { f64::from(map[index as usize]) } else { 1.0 };
        let reference = depth + slope.dot(first + away + 0.5 - place) - DEPTH_BIAS * steep;
        let before = stored - reference.min(1.0);
        let is_sure = before.abs() > GUARD[0] * steep + GUARD[1] || stored == 1.0;
        is_sure.then_some(before >= 0.0)
    };
    let own = test(DVec2::ZERO);
    let around = [DVec2::NEG_X, DVec2::X, DVec2::NEG_Y, DVec2::Y].map(test);
    match own {
        Some(lit) if around == [own; 4] => Certain::Quiet(lit),
        Some(false) => Certain::Dark,
        _ => Certain::Nothing,
    }
}

/// Counts wrong pixels. Where no side of the texel has a discontinuity, none may differ from the test, and silhouette
/// recovery lights no texel in shadow.
fn wrong(certain: &[Certain], seen: &[f32], recovers: bool) -> usize {
    assert_eq!(certain.len(), seen.len());
    let is_wrong = |(c, v): (&Certain, &f32)| match c {
        Certain::Nothing => false,
        Certain::Dark => recovers && *v != 0.0,
        Certain::Quiet(lit) => *v != f32::from(u8::from(*lit)),
    };
    certain.iter().zip(seen).filter(|p| is_wrong(*p)).count()
}

#[test]
fn away_from_edges_the_family_keeps_the_test() {
    // These may change only texels with a discontinuity.
    let modes: [(&str, &[(&str, &str)]); 5] = [
        ("rbsm", &[]),
        ("rbsm-filtered", &[]),
        ("rbsm-star", &[]),
        ("rbsm-profile", &[]),
        ("rpcf", &[("width", "1"), ("visibility", "star")]),
    ];
    with_gpu(|host| {
        let mut controls = [0; 2];
        for scene in every_shipped() {
            let map_size = 256;
            let mut r = renderer(host, &scene, desc(SIZE, map_size));
            // The techniques test the point itself on its plane, without offset or slack.
            let exact = [("normal_offset", "0"), ("slack", "0")];
            let images = modes.map(|(id, params)| visibility(&mut r, id, &[params, &exact].concat()));
            let shot = Shot::of(host, &r, true);
            let triangles = host.read_image::<u32>(&r.gbuffer().triangle).unwrap();
            let light = *r.light();
            // A pixel counts only if the ray and the rasteriser see the same triangle.
            let certain: Vec<Certain> = hits(&scene, &r, SIZE)
                .iter()
                .zip(&triangles)
                .map(|(hit, id)| match hit {
                    Some(h) if h.triangle == *id => certain(h, &light, &shot.map, map_size),
                    _ => Certain::Nothing,
                })
                .collect();
            let count = |c| certain.iter().filter(|x| **x == c).count();
            let (lit, shadow, dark) = (count(Certain::Quiet(true)), count(Certain::Quiet(false)), count(Certain::Dark));
            println!("{:10} certain: {lit} lit, {shadow} in shadow, {dark} in shadow at an edge", scene.name);
            assert!(lit > 2000 && shadow > 200 && dark > 60, "{}", scene.name);
            for (k, (id, params)) in modes.iter().enumerate() {
                let off = wrong(&certain, &images[k], *id == "rbsm");
                assert_eq!(off, 0, "{} {id} {params:?}", scene.name);
            }
            // A technique that reads more than a texel away is found out, and so is one that lights shadow.
            let wide = visibility(&mut r, "rpcf", &[&[("width", "3")], &exact[..]].concat());
            controls[0] += wrong(&certain, &wide, false);
            controls[1] += wrong(&certain, &images[2], true);
        }
        println!("found of rpcf 3: {}, of rbsm-star taken for rbsm: {}", controls[0], controls[1]);
        assert!(controls.iter().all(|n| *n > 300), "{controls:?}");
    });
}
