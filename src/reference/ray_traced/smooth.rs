//! Grouping of triangles into smooth surfaces.

use super::trace::RayScene;
use glam::DVec3;

impl RayScene {
    /// Returns a surface number for every triangle id. Triangles have the same number if they are connected over edges
    /// at which the surface turns by less than the angle of cosine `min_cosine`. An edge of more than two triangles
    /// connects none; a degenerate triangle is a surface of its own.
    pub(super) fn smooth_surfaces(&self, min_cosine: f64) -> Vec<u32> {
        let mut parents: Vec<u32> = (0..self.triangles()).collect();
        for (slot, triangle) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let Some((other, far)) = self.edges().across(slot, k) else { continue };
                // Visit each edge once.
                if other < slot {
                    continue;
                }
                let (a, b) = (triangle.corner(k), triangle.corner((k + 1) % 3));
                let across = [triangle.corner((k + 2) % 3), self.triangles[other].corner(far)];
                if turn_cosine(a, b, across) >= min_cosine {
                    let roots = [triangle.id, self.triangles[other].id].map(|id| root(&mut parents, id));
                    parents[roots[0].max(roots[1]) as usize] = roots[0].min(roots[1]);
                }
            }
        }
        (0..self.triangles()).map(|id| root(&mut parents, id)).collect()
    }
}

/// Returns the cosine of the angle by which a surface turns at the edge `a b`, whatever the triangles' winding; -1
/// where it folds back onto itself.
fn turn_cosine(a: DVec3, b: DVec3, across: [DVec3; 2]) -> f64 {
    let edge = (b - a).normalize_or_zero();
    let [one, other] = across.map(|c| (c - a).reject_from_normalized(edge).normalize_or_zero());
    -one.dot(other)
}

/// Returns the smallest id that an id is joined with, and shortens the path for the next call.
fn root(parents: &mut [u32], mut id: u32) -> u32 {
    while parents[id as usize] != id {
        let next = parents[parents[id as usize] as usize];
        parents[id as usize] = next;
        id = next;
    }
    id
}

#[cfg(test)]
mod tests {
    use crate::scene::{Instance, Material, Mesh, Scene};
    use glam::DAffine3;

    /// Returns a strip that turns by these angles, degrees, between its quads. Quads in `flipped` have reversed
    /// winding.
    fn strip(turns: &[f64], flipped: &[usize]) -> Scene {
        let mut positions = vec![[0.0f32, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let (mut x, mut y, mut angle) = (0.0, 0.0, 0.0f64);
        for turn in std::iter::once(&0.0).chain(turns) {
            angle += turn.to_radians();
            (x, y) = (x + angle.cos(), y + angle.sin());
            positions.extend([[x as f32, y as f32, 0.0], [x as f32, y as f32, 1.0]]);
        }
        let mut indices = vec![];
        for quad in 0..=turns.len() {
            let i = 2 * quad as u32;
            let corners = [i, i + 1, i + 2, i + 2, i + 1, i + 3];
            indices.extend(if flipped.contains(&quad) {
                [corners[1], corners[0], corners[2], corners[4], corners[3], corners[5]]
            } else {
                corners
            });
        }
        let mut mesh = Mesh { positions, indices, ..Mesh::default() };
        mesh.compute_bounds();
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance { mesh: 0, world_from_object: DAffine3::IDENTITY }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn surfaces_end_at_creases() {
        let surfaces = |scene: &Scene| super::RayScene::build(scene).unwrap().smooth_surfaces(30f64.to_radians().cos());
        assert_eq!(surfaces(&strip(&[20.0, -25.0, 35.0, 29.0], &[])), [0, 0, 0, 0, 0, 0, 6, 6, 6, 6]);
        assert_eq!(surfaces(&strip(&[20.0, 90.0], &[1])), [0, 0, 0, 0, 4, 4]);
        assert_eq!(surfaces(&strip(&[31.0, -31.0], &[0])), [0, 0, 2, 2, 4, 4]);
        // A surface folded back by nearly half a turn is not smooth, whatever its winding.
        assert_eq!(surfaces(&strip(&[179.0], &[1])), [0, 0, 2, 2]);
    }
}
