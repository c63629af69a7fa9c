//! Bounding volume hierarchy: built by `obvhs`, traversed here.
//!
//! The traversal of `obvhs` is not used because it clamps small direction components to an absolute 1e-7, and because
//! its stack panics when a tree is deeper than expected. Nodes here hold both children's boxes in one cache line.

use super::triangle::Triangle;
use glam::{DVec3, Vec3A, Vec4, Vec4Swizzles};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;

/// Padding of every box on each side, in local space (coordinates in `[-1, 1]`).
///
/// The slab test of a box runs in `f32`, with a rounded origin (2^-25) and a rounded inverse direction. Each slab
/// distance carries at most three roundings, two distances are compared, and no two points of the scene are more than
/// 2 sqrt(3) apart: 2 * 3 * 2^-24 * 3.47 + 2^-25 < 1.3e-6. So no box is missed whose triangle the `f64` test would
/// hit.
pub(super) const BOX_PADDING: f64 = 1.0 / (1 << 19) as f64;

/// Inner node: the boxes and the indices of both children.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// One row per axis: left min, right min, left max, right max.
    rows: [Vec4; 3],
    /// Index of the child's node, or of its first triangle if it is a leaf.
    first: [u32; 2],
    /// Number of the child's triangles; 0 if it is an inner node.
    count: [u32; 2],
}

/// Box that no ray meets.
const NOTHING: Aabb = Aabb { min: Vec3A::splat(f32::MAX), max: Vec3A::splat(f32::MIN) };

/// Binary hierarchy of boxes over triangles in leaf order.
#[derive(Debug, Default)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
}

impl Bvh {
    /// Builds the hierarchy and sorts `triangles` into its leaf order.
    pub fn build(triangles: &mut Vec<Triangle>) -> Self {
        if triangles.is_empty() {
            return Self::default();
        }
        let boxes: Vec<Aabb> = triangles.par_iter().map(padded_box).collect();
        let params = BvhBuildParams::medium_build();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            params.ploc_search_distance,
            &boxes,
            (0..boxes.len() as u32).collect::<Vec<_>>(),
            params.sort_precision,
            params.search_depth_threshold,
        );
        drop(boxes);
        let mut reinsertion = ReinsertionOptimizer::default();
        reinsertion.run(&mut tree, params.reinsertion_batch_ratio, None);
        collapse(&mut tree, params.max_prims_per_leaf, params.collapse_traversal_cost);
        let second = params.reinsertion_batch_ratio * params.post_collapse_reinsertion_batch_ratio_multiplier;
        reinsertion.run(&mut tree, second, None);
        *triangles = tree.primitive_indices.par_iter().map(|&i| triangles[i as usize]).collect();
        Self { nodes: pair_children(&tree) }
    }

    /// Returns the number of bytes held on the heap.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    /// Calls `leaf` with the ranges of triangles whose box the ray meets, until one call returns `true`.
    #[inline(always)]
    pub fn any(&self, ray: &BoxRay, t_max: f32, mut leaf: impl FnMut(std::ops::Range<usize>) -> bool) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let mut stack = Stack::new();
        let mut at = 0u32;
        loop {
            let node = &self.nodes[at as usize];
            let (near, met) = ray.meet(node, t_max);
            let mut inner = [u32::MAX; 2];
            for side in 0..2 {
                if !met[side] {
                    continue;
                }
                let first = node.first[side];
                if node.count[side] == 0 {
                    inner[side] = first;
                } else if leaf(first as usize..(first + node.count[side]) as usize) {
                    return true;
                }
            }
            if near[1] < near[0] {
                inner.swap(0, 1);
            }
            at = match inner {
                [u32::MAX, u32::MAX] => match stack.pop() {
                    Some(next) => next,
                    None => return false,
                },
                [u32::MAX, one] | [one, u32::MAX] => one,
                [one, other] => {
                    stack.push(other);
                    one
                }
            };
        }
    }

    /// Calls `leaf` with the ranges of triangles whose box the ray meets before `t_max`. `leaf` shortens `t_max` when
    /// it finds a hit.
    pub fn closest(&self, ray: &BoxRay, t_max: &mut f32, mut leaf: impl FnMut(std::ops::Range<usize>, &mut f32)) {
        let mut stack: Vec<(u32, f32)> = Vec::with_capacity(64);
        if !self.nodes.is_empty() {
            stack.push((0, f32::NEG_INFINITY));
        }
        while let Some((at, entry)) = stack.pop() {
            if entry > *t_max {
                continue;
            }
            let node = &self.nodes[at as usize];
            let (near, met) = ray.meet(node, *t_max);
            let order = if near[1] < near[0] { [1, 0] } else { [0, 1] };
            for side in order {
                if met[side] && node.count[side] > 0 && near[side] <= *t_max {
                    let first = node.first[side];
                    leaf(first as usize..(first + node.count[side]) as usize, t_max);
                }
            }
            for side in [order[1], order[0]] {
                if met[side] && node.count[side] == 0 {
                    stack.push((node.first[side], near[side]));
                }
            }
        }
    }

    /// Calls `leaf` with the ranges of triangles whose box (centre, half size) `outside` does not reject, until one
    /// call returns `false`.
    pub fn overlapping(
        &self,
        outside: impl Fn(DVec3, DVec3) -> bool,
        mut leaf: impl FnMut(std::ops::Range<usize>) -> bool,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = Stack::new();
        stack.push(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            for side in 0..2 {
                let min = DVec3::from_array(std::array::from_fn(|axis| f64::from(node.rows[axis][side])));
                let max = DVec3::from_array(std::array::from_fn(|axis| f64::from(node.rows[axis][side + 2])));
                if min.x > max.x || outside(0.5 * (min + max), 0.5 * (max - min)) {
                    continue;
                }
                let first = node.first[side];
                if node.count[side] == 0 {
                    stack.push(first);
                } else if !leaf(first as usize..(first + node.count[side]) as usize) {
                    return;
                }
            }
        }
    }
}

fn padded_box(triangle: &Triangle) -> Aabb {
    let [a, b, c] = [triangle.corner(0), triangle.corner(1), triangle.corner(2)];
    let min = a.min(b).min(c) - BOX_PADDING;
    let max = a.max(b).max(c) + BOX_PADDING;
    Aabb { min: min.as_vec3a(), max: max.as_vec3a() }
}

/// Converts a tree with one box per node into one with two boxes per node.
fn pair_children(tree: &Bvh2) -> Vec<Node> {
    let root = &tree.nodes[0];
    if root.is_leaf() {
        return vec![node([root.aabb, NOTHING], [root.first_index, 0], [root.prim_count, 1])];
    }
    // Siblings are adjacent in `tree.nodes`, so the pair at `i, i + 1` becomes one node. The parent learns the new
    // node's index when that node is written. Depth-first order keeps a subtree's nodes close together.
    let mut nodes = Vec::with_capacity(tree.nodes.len() / 2);
    let mut pending = vec![(root.first_index as usize, None::<(usize, usize)>)];
    while let Some((pair, parent)) = pending.pop() {
        let index = nodes.len();
        if let Some((at, side)) = parent {
            let parent: &mut Node = &mut nodes[at];
            parent.first[side] = index as u32;
        }
        let children = [&tree.nodes[pair], &tree.nodes[pair + 1]];
        nodes.push(node(
            children.map(|c| c.aabb),
            children.map(|c| if c.is_leaf() { c.first_index } else { 0 }),
            children.map(|c| c.prim_count),
        ));
        for side in [1, 0] {
            if !children[side].is_leaf() {
                pending.push((children[side].first_index as usize, Some((index, side))));
            }
        }
    }
    nodes
}

fn node(boxes: [Aabb; 2], first: [u32; 2], count: [u32; 2]) -> Node {
    let row = |axis: usize| Vec4::new(boxes[0].min[axis], boxes[1].min[axis], boxes[0].max[axis], boxes[1].max[axis]);
    Node { rows: [row(0), row(1), row(2)], first, count }
}

/// Ray prepared for box tests.
pub(super) struct BoxRay {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    negative: [bool; 3],
}

impl BoxRay {
    /// Prepares a ray. `origin` must lie within a few units of the scene's box, because [`BOX_PADDING`] accounts for
    /// its rounding to `f32`.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        // 1e30 keeps products with coordinates finite and 0 * inverse from being NaN.
        let inverse = |d: f64| if d.abs() < 1e-30 { 1e30f64.copysign(d) } else { 1.0 / d } as f32;
        let d = direction.to_array();
        Self {
            origin: origin.to_array().map(|x| Vec4::splat(x as f32)),
            inverse: d.map(|x| Vec4::splat(inverse(x))),
            negative: d.map(|x| x.is_sign_negative()),
        }
    }

    /// Returns the entry distances of both children, and whether each is met within `[0, t_max]`.
    #[inline(always)]
    fn meet(&self, node: &Node, t_max: f32) -> ([f32; 2], [bool; 2]) {
        let slab = |axis: usize| {
            let t = (node.rows[axis] - self.origin[axis]) * self.inverse[axis];
            if self.negative[axis] { t.zwxy() } else { t }
        };
        let (x, y, z) = (slab(0), slab(1), slab(2));
        let near = x.max(y).max(z);
        let far = x.min(y).min(z);
        let met = |near: f32, far: f32| near <= far && far >= 0.0 && near <= t_max;
        ([near.x, near.y], [met(near.x, far.z), met(near.y, far.w)])
    }
}

/// Traversal stack that uses the heap only when it is unusually deep.
struct Stack {
    shallow: [u32; 64],
    len: usize,
    deep: Vec<u32>,
}

impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Self { shallow: [0; 64], len: 0, deep: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, node: u32) {
        if self.len < self.shallow.len() {
            self.shallow[self.len] = node;
            self.len += 1;
        } else {
            self.deep.push(node);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u32> {
        if !self.deep.is_empty() {
            return self.deep.pop();
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.shallow[self.len])
    }
}
