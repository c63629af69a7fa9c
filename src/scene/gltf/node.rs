//! Node hierarchy: a strict tree, composed in `f64`, without recursion.

use super::document::{Document, Node};
use super::fault::{Loaded, entry, fault, label};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Transforms of all nodes, and the nodes that the chosen scene shows.
#[derive(Debug)]
pub struct Tree {
    /// World transform of each node.
    pub worlds: Vec<DAffine3>,
    /// Nodes of the chosen scene, in file order.
    pub shown: Vec<usize>,
    /// `true` for a node that `KHR_node_visibility` hides, itself or through an ancestor. Its mesh and its light are
    /// left out; its camera still works.
    pub hidden: Vec<bool>,
}

impl Tree {
    /// Checks and composes the hierarchy; `scene` chooses among several scenes.
    pub fn new(document: &Document, scene: Option<usize>) -> Loaded<Self> {
        let nodes = &document.nodes;
        let parents = parents(document)?;
        // Parents come before their children.
        let mut order: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
        let mut next = 0;
        while next < order.len() {
            order.extend_from_slice(&nodes[order[next]].children);
            next += 1;
        }
        if order.len() < nodes.len() {
            let mut reached = vec![false; nodes.len()];
            order.iter().for_each(|&i| reached[i] = true);
            let lost = reached.iter().position(|r| !r).unwrap_or(0);
            return Err(fault(node_label(document, lost), "is its own ancestor: nodes must form trees"));
        }

        let mut worlds = vec![DAffine3::IDENTITY; nodes.len()];
        for &i in &order {
            let local = local(&nodes[i], || node_label(document, i))?;
            worlds[i] = parents[i].map_or(local, |p| worlds[p] * local);
            if !worlds[i].is_finite() {
                return Err(fault(node_label(document, i), "its transform is not finite; its scales are too large"));
            }
        }

        let mut shown = vec![false; nodes.len()];
        for root in roots(document, scene, &parents)? {
            shown[root] = true;
        }
        let mut hidden = nodes.iter().enumerate().map(|(i, n)| hides(n, i)).collect::<Loaded<Vec<_>>>()?;
        for &i in &order {
            if let Some(parent) = parents[i] {
                shown[i] |= shown[parent];
                hidden[i] |= hidden[parent];
            }
        }
        let shown = (0..nodes.len()).filter(|&i| shown[i]).collect();
        Ok(Self { worlds, shown, hidden })
    }
}

/// Returns whether the node's own `KHR_node_visibility` hides it.
fn hides(node: &Node, index: usize) -> Loaded<bool> {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    match extension.and_then(|e| e.get("visible")) {
        None => Ok(false),
        Some(serde_json::Value::Bool(visible)) => Ok(!visible),
        Some(other) => {
            let place = format!("nodes[{index}].extensions.KHR_node_visibility.visible");
            Err(fault(place, format!("is {other}, must be true or false")))
        }
    }
}

/// Returns a label such as `nodes[3] "arm"`.
pub fn node_label(document: &Document, index: usize) -> String {
    label("nodes", index, document.nodes[index].name.as_deref())
}

fn parents(document: &Document) -> Loaded<Vec<Option<usize>>> {
    let nodes = &document.nodes;
    let mut parents = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, &child) in node.children.iter().enumerate() {
            entry(nodes, "nodes", child, || format!("nodes[{i}].children[{k}]"))?;
            if let Some(other) = parents[child].replace(i) {
                let problem = format!("has two parents, nodes[{other}] and nodes[{i}]: nodes must form trees");
                return Err(fault(node_label(document, child), problem));
            }
        }
    }
    Ok(parents)
}

fn roots(document: &Document, scene: Option<usize>, parents: &[Option<usize>]) -> Loaded<Vec<usize>> {
    let chosen = match (scene, document.scene) {
        (Some(scene), _) => {
            entry(&document.scenes, "scenes", scene, || "the scene asked for".into())?;
            scene
        }
        (None, Some(scene)) => {
            entry(&document.scenes, "scenes", scene, || "scene".into())?;
            scene
        }
        (None, None) if document.scenes.is_empty() => {
            return Ok((0..parents.len()).filter(|&i| parents[i].is_none()).collect());
        }
        (None, None) => 0,
    };
    let roots = &document.scenes[chosen].nodes;
    for (k, &root) in roots.iter().enumerate() {
        entry(&document.nodes, "nodes", root, || format!("scenes[{chosen}].nodes[{k}]"))?;
    }
    Ok(roots.clone())
}

fn local(node: &Node, place: impl Fn() -> String) -> Loaded<DAffine3> {
    if let Some(m) = &node.matrix {
        let last_row = [m[3], m[7], m[11], m[15] - 1.0];
        if last_row.iter().any(|v| v.abs() > 1e-4) {
            return Err(fault(place(), "its matrix must have 0 0 0 1 as last row"));
        }
        let column = |c: usize| DVec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
        let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
        return Ok(DAffine3 { matrix3, translation: column(3) });
    }
    let rotation = match node.rotation {
        Some(q) => rotation(q).ok_or_else(|| fault(place(), "its rotation is a quaternion of length 0"))?,
        None => DQuat::IDENTITY,
    };
    Ok(compose(node.translation.unwrap_or_default(), rotation, node.scale.unwrap_or([1.0; 3])))
}

/// Composes scale, rotation and translation, in that order.
pub fn compose(translation: [f64; 3], rotation: DQuat, scale: [f64; 3]) -> DAffine3 {
    let matrix3 = DMat3::from_quat(rotation) * DMat3::from_diagonal(scale.into());
    DAffine3 { matrix3, translation: translation.into() }
}

/// Returns the unit quaternion along `q`. Exporters round, and normalized integers are never exactly unit.
pub fn rotation(q: [f64; 4]) -> Option<DQuat> {
    let largest = q.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    // The components are divided by the largest first, because squares of huge or tiny ones leave the range of `f64`.
    let scaled = q.map(|v| v / largest);
    (largest > 0.0 && scaled.iter().all(|v| v.is_finite())).then(|| DQuat::from_array(scaled).normalize())
}

/// Removes the scale of a transform, for cameras and lights. Position and `-Z` stay, and `+Y` as far as possible.
/// Returns `None` if the scale leaves no direction.
pub fn rigid(world: &DAffine3) -> Option<DAffine3> {
    let back = unit(world.matrix3.z_axis)?;
    let up = unit(world.matrix3.y_axis).unwrap_or(DVec3::ZERO);
    let mut out = crate::view::look_along(world.translation, -back);
    if let Some(up) = (up - back * back.dot(up)).try_normalize() {
        out.matrix3 = DMat3::from_cols(up.cross(back), up, back);
    }
    Some(out)
}

/// Normalises a vector of any finite length.
fn unit(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}
