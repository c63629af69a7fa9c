//! Small scenes made here, independent of the crate's generators.

use edgeshade::scene::{Camera, Instance, Light, LightShape, Material, Mesh, Projection, Scene};
use edgeshade::view::look_at;
use glam::{DAffine3, DVec3, Vec3, dvec3};

/// Returns a mesh with flat normals: three vertices per triangle.
pub fn mesh(triangles: &[[DVec3; 3]]) -> Mesh {
    let mut mesh = Mesh { name: "made".into(), ..Mesh::default() };
    for t in triangles {
        let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero().as_vec3().to_array();
        for p in t {
            mesh.indices.push(mesh.positions.len() as u32);
            mesh.positions.push(p.as_vec3().to_array());
            mesh.normals.push(n);
            mesh.uvs.push([0.0; 2]);
        }
    }
    mesh.compute_bounds();
    mesh
}

/// Returns a square in the plane y = 0, facing up.
pub fn plane(half: f64) -> Mesh {
    let p = |x: f64, z: f64| dvec3(half * x, 0.0, half * z);
    let (a, b, c, d) = (p(-1.0, -1.0), p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0));
    mesh(&[[a, b, c], [a, c, d]])
}

/// Returns a box around the origin, facing outwards.
pub fn cuboid(half: DVec3) -> Mesh {
    let mut triangles = vec![];
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let corner = |u: f64, v: f64| {
                let mut p = DVec3::ZERO;
                p[axis] = sign;
                p[(axis + 1) % 3] = u * sign;
                p[(axis + 2) % 3] = v;
                p * half
            };
            let (a, b, c, d) = (corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh(&triangles)
}

/// Returns a sphere of radius 1 around the origin, facing outwards.
pub fn sphere(rings: u32, sectors: u32) -> Mesh {
    let at = |i: u32, j: u32| {
        let theta = std::f64::consts::PI * f64::from(i) / f64::from(rings);
        let phi = std::f64::consts::TAU * f64::from(j % sectors) / f64::from(sectors);
        dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let mut triangles = vec![];
    for i in 0..rings {
        for j in 0..sectors {
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            if i > 0 {
                triangles.push([a, b, c]);
            }
            if i + 1 < rings {
                triangles.push([a, c, d]);
            }
        }
    }
    mesh(&triangles)
}

pub fn moved(by: DVec3) -> DAffine3 {
    DAffine3::from_translation(by)
}

pub fn perspective(eye: DVec3, target: DVec3, near: f64) -> Camera {
    let projection = Projection::Perspective { fov_y: 0.8, near };
    Camera { name: "made".into(), world_from_camera: look_at(eye, target), projection }
}

pub fn sun(from: DVec3) -> Light {
    let shape = LightShape::Directional { angle: Some(0.0) };
    Light { name: "sun".into(), world_from_light: look_at(from, DVec3::ZERO), shape, color: [1.0; 3] }
}

pub fn spot(eye: DVec3, target: DVec3, outer: f64) -> Light {
    let shape = LightShape::Spot { outer, size: Some(0.0) };
    Light { name: "spot".into(), world_from_light: look_at(eye, target), shape, color: [1.0; 3] }
}

/// Returns a scene with each mesh at its place, in the default material, double-sided.
pub fn scene(parts: Vec<(Mesh, DAffine3)>, camera: Camera, light: Light) -> Scene {
    let mut scene = Scene {
        name: "made".into(),
        materials: vec![Material { double_sided: true, ..Material::default() }],
        cameras: vec![camera],
        lights: vec![light],
        ..Scene::default()
    };
    for (i, (mesh, world_from_object)) in parts.into_iter().enumerate() {
        scene.meshes.push(mesh);
        scene.instances.push(Instance { mesh: i, world_from_object });
    }
    scene
}

/// Returns a box, a ball and a fence post over a ground, at most 20 units away.
pub fn still_life(light: Light) -> Scene {
    let parts = vec![
        (plane(8.0), DAffine3::IDENTITY),
        (cuboid(dvec3(1.0, 1.0, 0.6)), moved(dvec3(-1.5, 1.01, 0.3))),
        (sphere(24, 48), moved(dvec3(1.6, 1.3, -0.7))),
        (cuboid(dvec3(0.05, 1.5, 0.05)), moved(dvec3(0.3, 1.5, 2.0))),
    ];
    scene(parts, perspective(dvec3(1.0, 5.0, 9.0), dvec3(0.0, 0.8, 0.0), 0.1), light)
}

/// Converts a point of `f32`.
pub fn point(p: [f32; 3]) -> DVec3 {
    Vec3::from(p).as_dvec3()
}
