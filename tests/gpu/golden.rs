//! Pictures that were once inspected and found good.
//!
//! On the software rasteriser that made them, results must be the same except for rounding. Other GPUs place triangle
//! edges differently and round differently, so more pixels may differ there. `EDGESHADE_BLESS=1` rewrites the
//! pictures.

use crate::common::{desc, is_llvmpipe, prepare, renderer, shipped_scene, with_gpu};
use edgeshade::picture::{Picture, write_png};
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [256, 144];
/// Scene, technique and settings.
type Golden = (&'static str, &'static str, &'static [(&'static str, &'static str)]);
const GOLDEN: &[Golden] = &[
    ("courtyard", "pcf", &[("width", "3")]),
    ("foliage", "sm", &[]),
    ("jenga", "pcf", &[("width", "7")]),
    ("knot", "vsm", &[("width", "5")]),
    ("robot", "evsm", &[("width", "9")]),
    ("jenga", "msm", &[("filter", "gaussian"), ("width", "7")]),
    ("fence", "rbsm-filtered", &[]),
    ("robot", "rbsm-profile", &[("quality", "line")]),
    ("jenga", "rpcf", &[]),
    ("courtyard", "edtsm", &[("penumbra", "0.3")]),
    ("robot", "edtsm-star", &[]),
    ("jenga", "pcss", &[]),
    ("robot", "rbssm", &[]),
    ("jenga", "ssabss", &[]),
    ("knot", "ssrbssm", &[]),
    ("drum", "vssm", &[]),
    ("fence", "mssm", &[]),
    ("robot", "shadow-volumes", &[]),
    ("jenga", "sssm", &[]),
    ("jenga", "edsm", &[("border", "3")]),
    ("fence", "edsm-x", &[]),
    ("fence", "exact-hard", &[]),
    ("jenga", "exact-soft", &[]),
];

fn path(scene: &str, technique: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{scene}-{technique}.png"))
}

/// Returns the fraction of pixels with a channel that is off by more than `codes`.
fn share_off(a: &[[u8; 3]], b: &[[u8; 3]], codes: u8) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = |(p, q): (&[u8; 3], &[u8; 3])| (0..3).any(|k| p[k].abs_diff(q[k]) > codes);
    a.iter().zip(b).filter(|p| off(*p)).count() as f64 / a.len() as f64
}

#[test]
fn golden_pictures() {
    with_gpu(|host| {
        let (codes, most) = if is_llvmpipe(host) { (2, 0.001) } else { (8, 0.03) };
        for &(name, technique, settings) in GOLDEN {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc(SIZE, 1024));
            let mut t = prepare(&r, technique, settings);
            r.frame(t.as_mut()).unwrap();
            let texels = host.read_image::<[u8; 4]>(r.picture()).unwrap();
            let rgb: Vec<[u8; 3]> = texels.iter().map(|t| [t[0], t[1], t[2]]).collect();
            let path = path(name, technique);
            if std::env::var_os("EDGESHADE_BLESS").is_some() {
                assert!(is_llvmpipe(host), "golden pictures are made on llvmpipe, this is {}", host.info().name);
                write_png(&path, &Picture { size: SIZE, rgb: rgb.clone() }).unwrap();
            }
            let golden = image::open(&path)
                .unwrap_or_else(|e| panic!("{}: {e}; EDGESHADE_BLESS=1 writes it", path.display()))
                .into_rgb8();
            assert_eq!(golden.dimensions(), (SIZE[0], SIZE[1]), "{}", path.display());
            let golden: Vec<[u8; 3]> = golden.pixels().map(|p| p.0).collect();
            let off = share_off(&rgb, &golden, codes);
            println!(
                "golden {name}-{technique} on {}: {:.3} % of pixels off by more than {codes} codes, {:.1} % allowed",
                host.info().name,
                100.0 * off,
                100.0 * most
            );
            assert!(off <= most, "{}: {:.3} % of pixels differ", path.display(), 100.0 * off);
            // A slightly darker patch of 16 x 16 pixels is noticed, on llvmpipe.
            let mut planted = golden.clone();
            for i in 0..256 {
                let p = &mut planted[(60 + i / 16) * SIZE[0] as usize + 100 + i % 16];
                *p = p.map(|v| v.wrapping_sub(12));
            }
            assert!(share_off(&planted, &golden, codes) > 0.001);
        }
    });
}
