//! Meshes that suites make.

use edgeshade::scene::Mesh;
use glam::{DVec3, dvec3};
use std::f64::consts::{PI, TAU};

/// A mesh with flat normals.
pub fn mesh(triangles: &[[DVec3; 3]]) -> Mesh {
    let mut mesh = Mesh { name: "part".into(), ..Mesh::default() };
    for t in triangles {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero().as_vec3().to_array();
        for p in t {
            mesh.indices.push(mesh.positions.len() as u32);
            mesh.positions.push(p.as_vec3().to_array());
            mesh.normals.push(normal);
            mesh.uvs.push([0.0; 2]);
        }
    }
    mesh.compute_bounds();
    mesh
}

/// A square in the plane y = 0 that faces up.
pub fn ground(half: f64) -> Mesh {
    let [a, b, c, d] = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, z)| half * dvec3(x, 0.0, z));
    mesh(&[[a, b, c], [a, c, d]])
}

/// A cuboid with these half-widths.
pub fn block(half: DVec3) -> Mesh {
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
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh(&triangles)
}

/// A sphere of radius 1.
pub fn ball(rings: u32, sectors: u32) -> Mesh {
    let at = |i: u32, j: u32| {
        let (theta, phi) = (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j % sectors) / f64::from(sectors));
        dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let mut triangles = vec![];
    for (i, j) in (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        triangles.extend((i > 0).then_some([a, b, c]));
        triangles.extend((i + 1 < rings).then_some([a, c, d]));
    }
    mesh(&triangles)
}
