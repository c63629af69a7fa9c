//! The map that is fitted to a sun's casters contains their penumbrae.

use crate::common::{desc, prepare, with_gpu};
use crate::made::{self, cuboid, moved, perspective, plane};
use edgeshade::scene::{Light, LightShape, Renderer, light_view};
use edgeshade::view::{CameraView, LightView, look_along};
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [192, 128];
/// Height of a slab over the ground, whose edge is one unit from its middle; and the sun's angle, radians.
const HEIGHT: f64 = 4.0;
const ANGLE: f64 = 0.2;

#[test]
fn penumbrae_beside_all_casters_are_whole() {
    with_gpu(|host| {
        let light = |angle| {
            let shape = LightShape::Directional { angle: Some(angle) };
            Light { shape, ..made::sun(DVec3::Y) }
        };
        let parts =
            vec![(plane(20.0), DAffine3::IDENTITY), (cuboid(dvec3(1.0, 0.01, 1.0)), moved(dvec3(0.0, HEIGHT, 0.0)))];
        let scene = made::scene(parts, perspective(DVec3::Y, DVec3::ZERO, 0.1), light(ANGLE));
        // The camera looks straight down from below the slab onto the shadow's edge; the image is three penumbrae wide.
        let width = 2.0 * (0.5 * ANGLE).tan() * HEIGHT;
        let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
        let (above, across) = (0.5 * HEIGHT, 3.0 * width);
        let eye = look_along(dvec3(1.0, above, 0.0), DVec3::NEG_Y);
        let camera = CameraView::perspective(eye, 2.0 * (0.5 * across / aspect / above).atan(), aspect, 0.02);
        let mut r = Renderer::new(host, &scene, camera, &scene.lights[0], desc(SIZE, 512)).unwrap();
        // Computes the root mean square difference from the ramp that similar triangles give, along the middle row.
        let ramp = |i: u32| 0.5 + 3.0 * ((f64::from(i) + 0.5) / f64::from(SIZE[0]) - 0.5);
        let off = |image: &[f32]| {
            let row = &image[(SIZE[0] * SIZE[1] / 2) as usize..][..SIZE[0] as usize];
            let square = |(i, v): (u32, &f32)| (f64::from(*v) - ramp(i).clamp(0.0, 1.0)).powi(2);
            ((0..).zip(row).map(square).sum::<f64>() / f64::from(SIZE[0])).sqrt()
        };
        let fitted = *r.light();
        // This map is as tight as for a sun without size.
        let cut = LightView { kind: fitted.kind, ..light_view(&scene, &light(0.0)) };
        for id in ["pcss", "rbssm", "ssrbssm", "edtssm-star"] {
            let mut technique = prepare(&r, id, &[]);
            let [whole, cut] = [fitted, cut].map(|view| {
                r.set_light(&scene, view);
                r.frame(technique.as_mut()).unwrap();
                off(&r.visibility(technique.as_ref()).unwrap())
            });
            println!("{id:12} off the ramp by {whole:.4}, with a map that ends at the casters {cut:.4}");
            assert!(whole < 0.02, "{id}: {whole}");
            assert!(cut > 0.1, "{id}: a map that ends at the casters goes unnoticed, {cut}");
        }
    });
}
