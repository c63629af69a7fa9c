//! Triangle lists from the three triangle modes, and normals for files without them.

use super::fault::{Loaded, fault};
use crate::scene::Mesh;
use glam::Vec3;
use gltf::json::mesh::Mode;

/// Returns the triangles of a primitive from its corners' indices. Triangles with two equal corners, which join
/// strips, are left out. Trailing corners that do not make a whole triangle are ignored.
pub fn triangles(mode: Mode, corners: Vec<u32>) -> Vec<u32> {
    let n = corners.len();
    let joined = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    match mode {
        Mode::TriangleStrip => {
            let triangle = |i: usize| [corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]];
            (0..n.saturating_sub(2)).map(triangle).filter(joined).flatten().collect()
        }
        Mode::TriangleFan => {
            let triangle = |i: usize| [corners[i + 1], corners[i + 2], corners[0]];
            (0..n.saturating_sub(2)).map(triangle).filter(joined).flatten().collect()
        }
        _ => {
            let mut corners = corners;
            corners.truncate(n - n % 3);
            corners
        }
    }
}

/// Checks that every index is below the number of vertices.
pub fn check_range(corners: &[u32], vertices: usize, place: impl FnOnce() -> String) -> Loaded<()> {
    // A plain maximum is vectorised; the bad index is searched only if there is one.
    if corners.iter().max().is_none_or(|&largest| (largest as usize) < vertices) {
        return Ok(());
    }
    let at = corners.iter().position(|&i| i as usize >= vertices).unwrap_or(0);
    Err(fault(place(), format!("element {at} is {}, but there are {vertices} vertices", corners[at])))
}

/// Drops triangles with a position that is not finite and returns their number; such positions become 0.
pub fn drop_unplaced(mesh: &mut Mesh) -> usize {
    if mesh.positions.as_flattened().iter().all(|v| v.is_finite()) {
        return 0;
    }
    let placed: Vec<bool> = mesh.positions.iter().map(|p| p.iter().all(|v| v.is_finite())).collect();
    let before = mesh.triangles();
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    mesh.indices = triangles.iter().filter(|t| t.iter().all(|&i| placed[i as usize])).flatten().copied().collect();
    for (position, _) in mesh.positions.iter_mut().zip(&placed).filter(|(_, placed)| !**placed) {
        *position = [0.0; 3];
    }
    before - mesh.triangles()
}

/// Returns a triangle's normal times a positive factor. It is computed in `f64`, so that tiny and huge triangles have
/// one.
fn face_normal(mesh: &Mesh, t: &[u32; 3]) -> Option<Vec3> {
    let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3());
    Some((b - a).cross(c - a).try_normalize()?.as_vec3())
}

/// Gives each triangle its own vertices with its normal. Triangles without area have none and are left out.
pub fn flatten(mesh: &mut Mesh) {
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let kept: Vec<([u32; 3], Vec3)> = triangles.iter().filter_map(|t| Some((*t, face_normal(mesh, t)?))).collect();
    fn unshare<T: Copy>(kept: &[([u32; 3], Vec3)], values: &[T]) -> Vec<T> {
        kept.iter().flat_map(|(t, _)| t.map(|i| values[i as usize])).collect()
    }
    mesh.positions = unshare(&kept, &mesh.positions);
    mesh.uvs = unshare(&kept, &mesh.uvs);
    if !mesh.colors.is_empty() {
        mesh.colors = unshare(&kept, &mesh.colors);
    }
    mesh.normals = kept.iter().flat_map(|(_, n)| [n.to_array(); 3]).collect();
    mesh.indices = (0..mesh.positions.len() as u32).collect();
}

/// Normalises every normal. Those without a direction get the normal of an adjacent triangle; returns their number.
pub fn mend_normals(mesh: &mut Mesh) -> usize {
    let mut lost = Vec::new();
    for (i, normal) in mesh.normals.iter_mut().enumerate() {
        // The computation uses `f64`, because squares of tiny or huge components leave the range of `f32`.
        match Vec3::from(*normal).as_dvec3().try_normalize() {
            Some(unit) => *normal = unit.as_vec3().into(),
            None => lost.push(i),
        }
    }
    if lost.is_empty() {
        return 0;
    }
    lost.iter().for_each(|&i| mesh.normals[i] = [0.0; 3]);
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for t in triangles {
        if t.iter().any(|&i| mesh.normals[i as usize] == [0.0; 3]) {
            let Some(normal) = face_normal(mesh, t) else { continue };
            for &i in t {
                if mesh.normals[i as usize] == [0.0; 3] {
                    mesh.normals[i as usize] = normal.into();
                }
            }
        }
    }
    // The remaining vertices belong to no triangle with an area.
    mesh.normals.iter_mut().filter(|n| **n == [0.0; 3]).for_each(|n| *n = [0.0, 1.0, 0.0]);
    lost.len()
}
