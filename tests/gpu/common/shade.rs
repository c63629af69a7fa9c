//! The shaded picture equals its mirror.

use crate::common::{Shot, desc, every_shipped, light_of, prepare, renderer, with_gpu};
use edgeshade::reference::common::shade;
use edgeshade::scene::{ShadeOptions, ShadePush};

const SIZE: [u32; 2] = [256, 144];

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
            let push = ShadePush::new(&scene, &light_of(&scene), &ShadeOptions::default());
            let mirror = shade::picture(&shot.data(), &push, &albedo, &seen).unwrap();
            let picture = host.read_image::<[u8; 4]>(renderer.picture()).unwrap();
            // Codes are rounded once more, and sRGB texel fetches may be slightly imprecise.
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
