//! Plan of what to build: the primitives with their poses, and their placements. All limits are checked here, so that
//! building can run in parallel without any.

use super::accessor::Data;
use super::document::Document;
use super::fault::{Loaded, Warnings, entry, fault, label};
use super::node::{Tree, compose, node_label, rotation};
use super::{limits, material};
use glam::DAffine3;
use gltf::json;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;

/// Primitive in one pose.
#[derive(Debug)]
pub struct Job<'a> {
    pub mesh: usize,
    pub primitive: usize,
    /// Skin that deforms the primitive, only if it has joints.
    pub skin: Option<usize>,
    /// Morph weights; missing ones are zero.
    pub weights: &'a [f32],
}

/// Range of jobs placed in the world by one node.
#[derive(Debug)]
pub struct Placement {
    pub node: usize,
    pub jobs: Range<usize>,
    pub world_from_object: DAffine3,
}

/// Everything to build.
#[derive(Debug, Default)]
pub struct Plan<'a> {
    pub jobs: Vec<Job<'a>>,
    pub placements: Vec<Placement>,
}

#[derive(Default)]
struct Totals {
    elements: u64,
    vertices: u64,
    triangles: u64,
    instances: u64,
}

/// Lists the primitives of the shown nodes; nodes that show the same mesh in the same pose share them.
pub fn plan<'a>(data: &Data<'a>, tree: &Tree, warnings: &mut Warnings) -> Loaded<Plan<'a>> {
    let document = data.document;
    let mut plan = Plan::default();
    let mut totals = Totals::default();
    let mut known: HashMap<(usize, Option<usize>, Vec<u32>), Range<usize>> = HashMap::new();
    for &i in &tree.shown {
        let node = &document.nodes[i];
        let Some(mesh) = node.mesh.filter(|_| !tree.hidden[i]) else { continue };
        entry(&document.meshes, "meshes", mesh, || format!("nodes[{i}].mesh"))?;
        if let Some(skin) = node.skin {
            entry(&document.skins, "skins", skin, || format!("nodes[{i}].skin"))?;
        }
        // Nodes with the same mesh and skin differ only by their own weights.
        let own = node.weights.as_ref().map_or(vec![], |w| w.iter().map(|w| w.to_bits()).collect());
        let jobs = match known.entry((mesh, node.skin, own)) {
            Entry::Occupied(jobs) => jobs.get().clone(),
            Entry::Vacant(new) => {
                let weights = node.weights.as_ref().or(document.meshes[mesh].weights.as_ref());
                let start = plan.jobs.len();
                add_jobs(data, &mut plan.jobs, &mut totals, mesh, node.skin, weights.map_or(&[], |w| w), warnings)?;
                new.insert(start..plan.jobs.len()).clone()
            }
        };
        let places = places(data, tree, i, warnings)?;
        // Each counts as at least 1, so that many instances of nothing count too.
        totals.instances += (places.len() as u64).saturating_mul(jobs.len().max(1) as u64);
        most(totals.instances, limits::INSTANCES, "instances", || node_label(document, i))?;
        let place = |world_from_object| Placement { node: i, jobs: jobs.clone(), world_from_object };
        plan.placements.extend(places.into_iter().map(place));
    }
    Ok(plan)
}

fn most(total: u64, limit: u64, what: &str, place: impl FnOnce() -> String) -> Loaded<()> {
    if total <= limit {
        return Ok(());
    }
    let problem = format!("the scene has more than {limit} {what} up to here; split it into several files");
    Err(fault(place(), problem))
}

fn add_jobs<'a>(
    data: &Data<'a>,
    jobs: &mut Vec<Job<'a>>,
    totals: &mut Totals,
    mesh: usize,
    skin: Option<usize>,
    weights: &'a [f32],
    warnings: &mut Warnings,
) -> Loaded<()> {
    let document = data.document;
    if weights.iter().any(|w| !w.is_finite()) {
        return Err(fault(format!("meshes[{mesh}]"), "has a morph weight that is not finite"));
    }
    for (p, primitive) in document.meshes[mesh].primitives.iter().enumerate() {
        let place = || format!("meshes[{mesh}].primitives[{p}]");
        totals.elements += 1;
        if !is_wanted(document, primitive, place, warnings)? {
            continue;
        }
        let jointed = primitive.attributes.contains_key(&Checked::Valid(Semantic::Joints(0)));
        if skin.is_some() && !jointed {
            warnings.add("has no JOINTS_0, so its skin was ignored", 1, place);
        }
        let job = Job { mesh, primitive: p, skin: skin.filter(|_| jointed), weights };
        charge(data, totals, primitive, &job, place)?;
        jobs.push(job);
        most(jobs.len() as u64, limits::MESHES as u64, "primitives", place)?;
    }
    Ok(())
}

fn is_wanted(
    document: &Document,
    primitive: &Primitive,
    place: impl Fn() -> String,
    warnings: &mut Warnings,
) -> Loaded<bool> {
    match primitive.mode {
        Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) => {}
        Checked::Valid(_) => {
            warnings.add("points and lines are not drawn", 1, place);
            return Ok(false);
        }
        Checked::Invalid => return Err(fault(format!("{}.mode", place()), "must be 0 to 6")),
    }
    if !primitive.attributes.contains_key(&Checked::Valid(Semantic::Positions)) {
        warnings.add("has no POSITION and was left out", 1, place);
        return Ok(false);
    }
    // Without its extension, such a file has positions but no data for them.
    let draco = primitive.extensions.as_ref().is_some_and(|e| e.others.contains_key("KHR_draco_mesh_compression"));
    let stored =
        |a: &json::Index<json::Accessor>| document.accessors.get(a.value()).is_none_or(|a| a.buffer_view.is_some());
    if draco && !primitive.attributes.values().all(stored) {
        let problem =
            "is compressed with KHR_draco_mesh_compression, which is not supported; export it without compression";
        return Err(fault(place(), problem));
    }
    if let Some(m) = primitive.material.map(|m| m.value()) {
        let material = entry(&document.materials, "materials", m, || format!("{}.material", place()))?;
        if material::is_glass(material) {
            let what = "blended with an alpha below 0.5, or transmitting half the light or more, without a texture: taken for glass, which casts no shadow and is not drawn";
            warnings.add(what, 1, || label("materials", m, material.name.as_deref()));
            return Ok(false);
        }
    }
    Ok(true)
}

/// Adds up what a primitive will read and keep.
fn charge(
    data: &Data<'_>,
    totals: &mut Totals,
    primitive: &Primitive,
    job: &Job<'_>,
    place: impl Fn() -> String,
) -> Loaded<()> {
    // Each counts as at least 1, so that many empty ones count too.
    let count = |index: usize, member: &str| -> Loaded<u64> {
        Ok(data.count(index, || format!("{}.{member}", place()))?.max(1))
    };
    let mut vertices = 0;
    for (semantic, accessor) in &primitive.attributes {
        let count = count(accessor.value(), "attributes")?;
        totals.elements = totals.elements.saturating_add(count);
        if *semantic == Checked::Valid(Semantic::Positions) {
            vertices = count;
        }
    }
    for target in primitive.targets.iter().flatten().take(job.weights.len()) {
        for accessor in [target.positions, target.normals].into_iter().flatten() {
            totals.elements = totals.elements.saturating_add(count(accessor.value(), "targets")?);
        }
        totals.elements = totals.elements.saturating_add(1);
    }
    if let Some(skin) = job.skin {
        totals.elements = totals.elements.saturating_add(data.document.skins[skin].joints.len() as u64);
    }
    let corners = match primitive.indices {
        Some(accessor) => {
            let count = count(accessor.value(), "indices")?;
            totals.elements = totals.elements.saturating_add(count);
            count
        }
        None => vertices,
    };
    let triangles = if primitive.mode == Checked::Valid(Mode::Triangles) { corners / 3 } else { corners };
    // Without normals, every triangle gets its own vertices.
    let flat = !primitive.attributes.contains_key(&Checked::Valid(Semantic::Normals));
    let kept = if flat { vertices.max(triangles.saturating_mul(3)) } else { vertices };
    totals.triangles = totals.triangles.saturating_add(triangles);
    totals.vertices = totals.vertices.saturating_add(kept);
    most(totals.elements, limits::ELEMENTS, "accessor elements", &place)?;
    most(totals.triangles, limits::TRIANGLES, "triangles", &place)?;
    most(totals.vertices, limits::VERTICES, "vertices", &place)
}

/// Returns the transforms of a node's mesh: one, or those of `EXT_mesh_gpu_instancing`.
fn places(data: &Data<'_>, tree: &Tree, i: usize, warnings: &mut Warnings) -> Loaded<Vec<DAffine3>> {
    let node = &data.document.nodes[i];
    let world = tree.worlds[i];
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
    let Some(extension) = extension else { return Ok(vec![world]) };
    let root = format!("nodes[{i}].extensions.EXT_mesh_gpu_instancing.attributes");
    let place = |name: &str| format!("{root}.{name}");
    let index = |name: &str| -> Loaded<Option<usize>> {
        let Some(value) = extension.get("attributes").and_then(|a| a.get(name)) else { return Ok(None) };
        let index = value.as_u64().and_then(|v| usize::try_from(v).ok());
        index.map(Some).ok_or_else(|| fault(place(name), format!("is {value}, must be the index of an accessor")))
    };
    let (translation, rotations, scale) = (index("TRANSLATION")?, index("ROTATION")?, index("SCALE")?);
    let mut count = None;
    for (name, accessor) in [("TRANSLATION", translation), ("ROTATION", rotations), ("SCALE", scale)] {
        let Some(accessor) = accessor else { continue };
        let found = data.accessor(accessor, || place(name))?.count.0;
        let expected = *count.get_or_insert(found);
        if found != expected {
            let problem = format!("has {found} elements, but the other attributes have {expected}");
            return Err(fault(place(name), problem));
        }
        most(found, limits::INSTANCES, "instances", || place(name))?;
    }
    let Some(count) = count else {
        return Err(fault(root, "must have TRANSLATION, ROTATION or SCALE"));
    };
    let translation = translation.map(|a| data.floats::<3>(a, || place("TRANSLATION"))).transpose()?;
    let rotations = rotations.map(|a| data.floats::<4>(a, || place("ROTATION"))).transpose()?;
    let scale = scale.map(|a| data.floats::<3>(a, || place("SCALE"))).transpose()?;
    let instance = |k: usize| {
        let t = translation.as_ref().map_or([0.0; 3], |t| t[k].map(f64::from));
        let r = rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[k].map(f64::from));
        let s = scale.as_ref().map_or([1.0; 3], |s| s[k].map(f64::from));
        Some(world * compose(t, rotation(r)?, s)).filter(DAffine3::is_finite)
    };
    // `count` is at most `limits::INSTANCES`.
    let places: Vec<_> = (0..count as usize).filter_map(instance).collect();
    let lost = count as usize - places.len();
    warnings.add("instances were dropped: their transform is not finite", lost, || node_label(data.document, i));
    Ok(places)
}
