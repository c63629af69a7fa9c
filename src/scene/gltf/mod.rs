//! glTF 2.0 files as scenes.
//!
//! The JSON is parsed and checked first, the node hierarchy is composed, and everything to be built is listed and
//! compared with [`limits`]. Only then are accessors read, in parallel. No index, offset or count of the file is used
//! before it is checked. Nothing is allocated before its data is known to exist. Nothing recurses.

mod accessor;
mod container;
mod deform;
mod document;
mod fault;
mod files;
mod image;
mod limits;
mod material;
mod node;
mod plan;
mod primitive;
mod topology;
mod view;

use crate::Result;
use crate::scene::{Bounds, Instance, Mesh, Scene};
use accessor::Data;
use deform::Palette;
use document::Document;
use fault::{Fault, Loaded, Warnings, fault};
use files::Folder;
use glam::{DAffine3, DVec3};
use node::{Tree, node_label};
use plan::Plan;
use rayon::prelude::*;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// Loads the default scene of a glTF 2.0 file; the content tells `.glb` from `.gltf`.
///
/// Buffers and images next to the file are read too, but nothing outside the file's own folder.
///
/// **What is read:** all node transforms; triangle lists, strips and fans; every component type, sparse accessors,
/// strides; base colour with its texture, sampler and alpha mask; vertex colours; morph targets and skins in the pose
/// of the file; perspective and orthographic cameras; spot and directional lights; `KHR_lights_punctual`,
/// `KHR_texture_transform`, `KHR_mesh_quantization`, `EXT_mesh_gpu_instancing`, and the base colour of
/// `KHR_materials_pbrSpecularGlossiness`. The size of a light is our own extension: `extras.edgeshade.size` (spot,
/// full width of the square light in world units) or `extras.edgeshade.angle` (directional, full angular width in
/// radians), on the light or on its node; the node's value takes precedence. Nodes hidden by `KHR_node_visibility` are
/// left out. A mesh whose vertices lie far from its own origin is moved there, and its instances back, so that no
/// position loses precision.
///
/// **What is approximated**, each with a line in [`Scene::warnings`]: points and lines are left out. Alpha mode BLEND
/// is opaque, except for glass, which is left out: a base colour with an alpha below 0.5 and no texture, or a
/// transmission of half the light or more (`KHR_materials_transmission`). Point lights are left out. Triangles with a
/// NaN or infinite position are dropped, and so are instances whose transform leaves no area. Extensions that are not
/// read are named. A base-colour texture that cannot be read is left out if the material has no holes. A camera or
/// light that cannot be used goes into [`Scene::broken_cameras`] or [`Scene::broken_lights`].
///
/// **Limits:** 4 GiB of files; 2^28 accessor elements read, 2^26 vertices, 2^25 triangles and 2^20 primitives kept;
/// 2^22 placed primitives; 2^20 elements in an accessor without `bufferView`; images of 16,384 texels per side and 2^27
/// texels, 2 GiB together; placed vertices within 1e18 of the origin.
///
/// # Errors
/// Fails with [`Error::Io`](crate::Error::Io) if the file cannot be read, and with [`Error::File`](crate::Error::File)
/// if its content is wrong or beyond a limit. The latter has the place in glTF's own terms (`accessors[3].count`).
pub fn load(path: &Path) -> Result<Scene> {
    load_scene(path, None)
}

/// Loads a chosen scene of the file; otherwise like [`load`].
///
/// `scene` is an index into the file's `scenes`. `None` means the scene that the file names as default, else its first
/// one, or all nodes if the file has no scenes.
///
/// # Errors
/// Fails like [`load`], or if the file has no such scene.
pub fn load_scene(path: &Path, scene: Option<usize>) -> Result<Scene> {
    let io = |source| crate::Error::Io { path: path.into(), source };
    let bytes = files::read_whole(path, limits::FILE_BYTES).map_err(io)?;
    let folder = Folder::of(path, bytes.len());
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    build(&name, &bytes, scene, folder).map_err(|fault| fault.in_file(path))
}

/// Loads a scene from memory. All its data must be inside it (a `.glb`, or data URIs).
///
/// `name` becomes [`Scene::name`] and replaces the path in errors.
///
/// # Errors
/// Fails like [`load`].
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene> {
    build(name, bytes, None, Folder::none()).map_err(|fault| fault.in_file(Path::new(name)))
}

fn build(name: &str, bytes: &[u8], scene: Option<usize>, mut folder: Folder) -> Loaded<Scene> {
    let container = container::split(bytes)?;
    let document = Document::parse(container.json)?;
    let tree = Tree::new(&document, scene)?;
    let mut warnings = Warnings::default();
    for extension in document.unread_extensions() {
        warnings.add("is not read: what it adds to the scene is missing", 1, || format!("extension {extension}"));
    }
    let buffers = files::buffers(&document, container.bin, &mut folder)?;
    let data = Data { document: &document, buffers };
    let plan = plan::plan(&data, &tree, &mut warnings)?;

    let mut used: Vec<usize> = plan.jobs.iter().filter_map(|job| material_of(&document, job)).collect();
    used.sort_unstable();
    used.dedup();
    let (mut materials, uses) = material::materials(&document, &used, &mut warnings)?;
    let (built, textures) = rayon::join(|| meshes(&data, &tree, &plan), || image::textures(&data, &uses, &mut folder));
    let (built, textures) = (built?, textures?);
    let textures = material::set_textures(&mut materials, textures, &mut warnings)?;

    // A mesh without triangles leaves no gap: `slots` holds the index of each job's mesh.
    let mut slots = vec![None; plan.jobs.len()];
    let mut kept = Vec::with_capacity(built.meshes.len());
    for (job, (mesh, notes)) in built.meshes.into_iter().enumerate() {
        warnings.append(notes);
        let Some(mut mesh) = mesh else { continue };
        mesh.material = match material_of(&document, &plan.jobs[job]) {
            Some(material) => used.binary_search(&material).unwrap_or(0),
            None => used.len(),
        };
        if mesh.material == materials.len() {
            materials.push(material::unspecified());
        }
        slots[job] = Some(kept.len());
        kept.push(mesh);
    }
    let centers = recentre(&plan, &mut kept, &slots);
    let instances = instances(&document, &plan, &kept, &slots, &centers, &built.palettes, &mut warnings)?;
    let (cameras, broken_cameras) = view::cameras(&document, &tree, &mut warnings)?;
    let (lights, broken_lights) = view::lights(&document, &tree, &mut warnings)?;
    Ok(Scene {
        name: name.into(),
        meshes: kept,
        materials,
        textures,
        instances,
        cameras,
        lights,
        broken_cameras,
        broken_lights,
        warnings: warnings.into_sentences(),
    })
}

fn material_of(document: &Document, job: &plan::Job<'_>) -> Option<usize> {
    document.meshes[job.mesh].primitives[job.primitive].material.map(|m| m.value())
}

struct Built {
    /// One entry per job.
    meshes: Vec<(Option<Mesh>, Warnings)>,
    palettes: HashMap<usize, Palette>,
}

fn meshes(data: &Data<'_>, tree: &Tree, plan: &Plan<'_>) -> Loaded<Built> {
    let mut palettes = HashMap::new();
    for skin in plan.jobs.iter().filter_map(|job| job.skin) {
        if let Entry::Vacant(new) = palettes.entry(skin) {
            new.insert(deform::palette(data, tree, skin)?);
        }
    }
    let build = |job: &plan::Job<'_>| primitive::build(data, job, job.skin.and_then(|s| palettes.get(&s)));
    let built: Vec<Loaded<_>> = plan.jobs.par_iter().map(build).collect();
    // Collected in file order, so that the same file always gives the same error.
    Ok(Built { meshes: built.into_iter().collect::<Loaded<_>>()?, palettes })
}

/// Distance of a mesh's middle from its own origin, in half diagonals, above which the mesh is moved to its origin.
const FAR_FROM_ORIGIN: f64 = 4.0;

/// Moves meshes that were baked far from their own origin, such as map data in a national grid, back to it. The GPU
/// works on `f32` positions, whose derivatives and products would lose precision. Returns the offset that was
/// subtracted from each job's positions; instances add it again in `f64`. The parts of one glTF mesh move together.
fn recentre(plan: &Plan<'_>, meshes: &mut [Mesh], slots: &[Option<usize>]) -> Vec<DVec3> {
    let mut centers = vec![DVec3::ZERO; plan.jobs.len()];
    let mut ranges: Vec<_> = plan.placements.iter().map(|p| p.jobs.clone()).collect();
    ranges.sort_unstable_by_key(|r| r.start);
    ranges.dedup();
    for jobs in ranges {
        let parts = || slots[jobs.clone()].iter().flatten().copied();
        let bounds = parts().map(|m| meshes[m].bounds).fold(Bounds::EMPTY, Bounds::union);
        let half = 0.5 * (bounds.max - bounds.min);
        let center = bounds.center().as_vec3().as_dvec3();
        if bounds.is_empty() || center.abs().max_element() <= FAR_FROM_ORIGIN * bounds.radius() {
            continue;
        }
        // An axis counts if all positions lie within a factor of two of the middle: then the difference of two `f32`
        // is exact.
        let center = DVec3::select(center.abs().cmpgt(3.0 * half), center, DVec3::ZERO);
        let to_subtract = center.as_vec3().to_array();
        for part in parts() {
            let mesh = &mut meshes[part];
            for position in &mut mesh.positions {
                position.iter_mut().zip(to_subtract).for_each(|(p, c)| *p -= c);
            }
            mesh.compute_bounds();
        }
        centers[jobs].fill(center);
    }
    centers
}

fn instances(
    document: &Document,
    plan: &Plan<'_>,
    meshes: &[Mesh],
    slots: &[Option<usize>],
    centers: &[DVec3],
    palettes: &HashMap<usize, Palette>,
    warnings: &mut Warnings,
) -> Result<Vec<Instance>, Fault> {
    let mut instances = Vec::new();
    for placement in &plan.placements {
        for job in placement.jobs.clone() {
            let Some(mesh) = slots[job] else { continue };
            // The joints place a skinned mesh; its own node does not.
            let world_from_object = match plan.jobs[job].skin.and_then(|s| palettes.get(&s)) {
                Some(palette) => palette.world_from_object,
                None => placement.world_from_object,
            };
            if !keeps_area(&world_from_object) {
                let place = || node_label(document, placement.node);
                warnings.add("its scale leaves no surface: its mesh is not drawn", 1, place);
                continue;
            }
            let world_from_object = world_from_object * DAffine3::from_translation(centers[job]);
            let Bounds { min, max } = meshes[mesh].bounds.transformed(&world_from_object);
            let near = |v: DVec3| v.abs().cmple(DVec3::splat(limits::COORDINATE)).all();
            if !(near(min) && near(max)) {
                let problem = "its mesh reaches further than 1e18 from the origin; scale the scene down";
                return Err(fault(node_label(document, placement.node), problem));
            }
            instances.push(Instance { mesh, world_from_object });
        }
    }
    Ok(instances)
}

/// Returns `false` if a transform collapses every surface to a line or a point.
fn keeps_area(world: &DAffine3) -> bool {
    let m = world.matrix3;
    // The axes are divided first, because products of tiny scales leave the range of `f64`.
    let largest = m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis / largest);
    largest > 0.0 && [x.cross(y), y.cross(z), z.cross(x)].iter().any(|n| *n != DVec3::ZERO)
}
