//! Conversion of one primitive in one pose to one mesh.

use super::accessor::{Data, components};
use super::deform::{self, Palette};
use super::fault::{Loaded, Warnings, fault};
use super::material::{self, UvMap};
use super::plan::Job;
use super::topology;
use crate::scene::Mesh;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// Builds the mesh of a job; `None` if no triangle is left. The caller sets its material.
pub fn build(data: &Data<'_>, job: &Job<'_>, palette: Option<&Palette>) -> Loaded<(Option<Mesh>, Warnings)> {
    let source = &data.document.meshes[job.mesh];
    let primitive = &source.primitives[job.primitive];
    let place = format!("meshes[{}].primitives[{}]", job.mesh, job.primitive);
    let mut warnings = Warnings::default();

    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
    let named = |name: &str| format!("{place}.attributes.{name}");
    // The plan holds no primitive without positions.
    let Some(positions) = attribute(Semantic::Positions) else { return Ok((None, warnings)) };
    let mut mesh = Mesh { positions: data.floats(positions, || named("POSITION"))?, ..Mesh::default() };
    let vertices = mesh.positions.len();
    let same_length = |found: usize, name: &str| match found == vertices {
        true => Ok(()),
        false => Err(fault(named(name), format!("has {found} elements, but POSITION has {vertices}"))),
    };
    let mut normals = attribute(Semantic::Normals).map(|a| data.floats::<3>(a, || named("NORMAL"))).transpose()?;
    if let Some(normals) = &normals {
        same_length(normals.len(), "NORMAL")?;
    }
    mesh.uvs = match primitive.material.map(|m| material::uv_map(data.document, m.value())).transpose()?.flatten() {
        Some(map) => uvs(data, primitive, map, vertices, &place)?,
        None => vec![[0.0; 2]; vertices],
    };
    if let Some(accessor) = attribute(Semantic::Colors(0)) {
        mesh.colors = colors(data, accessor, || named("COLOR_0"))?;
        same_length(mesh.colors.len(), "COLOR_0")?;
    }

    mesh.indices = indices(data, primitive, vertices, &place, &mut warnings)?;
    deform::morph(data, primitive, job.weights, &place, &mut mesh.positions, normals.as_mut())?;
    if let Some(palette) = palette {
        deform::skin(data, primitive, palette, &place, &mut mesh.positions, normals.as_mut())?;
        if palette.mirrors() {
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|t| t.swap(1, 2));
        }
    }
    let dropped = topology::drop_unplaced(&mut mesh);
    warnings.add("a triangle with a NaN or infinite position was dropped", dropped, || place.clone());
    match normals {
        Some(normals) => {
            mesh.normals = normals;
            let mended = topology::mend_normals(&mut mesh);
            warnings.add("a normal without direction was replaced by its triangle's", mended, || place.clone());
        }
        None => topology::flatten(&mut mesh),
    }
    if mesh.indices.is_empty() {
        return Ok((None, warnings));
    }
    mesh.name = match (&source.name, source.primitives.len()) {
        (Some(name), 1) => name.clone(),
        (Some(name), _) => format!("{name}/{}", job.primitive),
        (None, _) => place,
    };
    mesh.compute_bounds();
    Ok((Some(mesh), warnings))
}

fn indices(
    data: &Data<'_>,
    primitive: &Primitive,
    vertices: usize,
    place: &str,
    warnings: &mut Warnings,
) -> Loaded<Vec<u32>> {
    let Checked::Valid(mode) = primitive.mode else { return Ok(Vec::new()) };
    let corners = match primitive.indices {
        Some(accessor) => {
            let corners = data.integers::<1>(accessor.value(), || format!("{place}.indices"))?;
            let corners = corners.as_flattened().to_vec();
            topology::check_range(&corners, vertices, || format!("accessors[{}]", accessor.value()))?;
            corners
        }
        // The plan limits vertices to less than 2^32.
        None => (0..vertices as u32).collect(),
    };
    if mode == Mode::Triangles && corners.len() % 3 != 0 {
        warnings.add("the last corners do not make a whole triangle and were left out", 1, || place.into());
    }
    Ok(topology::triangles(mode, corners))
}

fn uvs(data: &Data<'_>, primitive: &Primitive, map: UvMap, vertices: usize, place: &str) -> Loaded<Vec<[f32; 2]>> {
    let Some(accessor) = primitive.attributes.get(&Checked::Valid(Semantic::TexCoords(map.set))) else {
        // glTF specifies that the texture is read at 0 everywhere; the transform applies to this coordinate.
        let [[_, _, u], [_, _, v]] = map.matrix.unwrap_or_default();
        return Ok(vec![[u, v]; vertices]);
    };
    let name = || format!("{place}.attributes.TEXCOORD_{}", map.set);
    let mut uvs = data.floats::<2>(accessor.value(), name)?;
    if uvs.len() != vertices {
        return Err(fault(name(), format!("has {} elements, but POSITION has {vertices}", uvs.len())));
    }
    if let Some([u_row, v_row]) = map.matrix {
        let dot = |row: [f32; 3], [u, v]: [f32; 2]| row[0] * u + row[1] * v + row[2];
        uvs.iter_mut().for_each(|uv| *uv = [dot(u_row, *uv), dot(v_row, *uv)]);
    }
    uvs.as_flattened_mut().iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    Ok(uvs)
}

fn colors(data: &Data<'_>, index: usize, place: impl Fn() -> String) -> Loaded<Vec<[f32; 4]>> {
    let accessor = data.accessor(index, &place)?;
    let mut colors = match components(accessor, index)? {
        3 => data.floats::<3>(index, place)?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect(),
        _ => data.floats::<4>(index, place)?,
    };
    colors.as_flattened_mut().iter_mut().for_each(|c| *c = if c.is_finite() { c.clamp(0.0, 1.0) } else { 1.0 });
    Ok(colors)
}
