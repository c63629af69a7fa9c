//! Cameras and lights of the shown nodes.

use super::document::{Document, Node};
use super::fault::{Fault, Loaded, Warnings, entry, fault, label};
use super::node::{Tree, rigid};
use crate::scene::{Broken, Camera, Light, LightShape, Projection};
use gltf::json;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as FileLight, Type as LightType};
use gltf::json::validation::Checked;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, PI};

const NO_DIRECTION: &str = "was left out: the scale of its node leaves it no direction";

/// Adds a fault to the list of unusable cameras or lights, and a warning.
fn leave_out(broken: &mut Vec<Broken>, number: usize, name: String, fault: Fault, warnings: &mut Warnings) {
    let (place, problem) = fault.into_parts();
    warnings.add(format!("{problem}. It cannot be used; everything else can"), 1, || place.clone());
    broken.push(Broken { number, name, place, problem });
}

/// Returns the cameras, in the order of their nodes, and those that cannot be used.
pub fn cameras(document: &Document, tree: &Tree, warnings: &mut Warnings) -> Loaded<(Vec<Camera>, Vec<Broken>)> {
    let (mut cameras, mut broken) = (Vec::new(), Vec::new());
    for &i in &tree.shown {
        let node = &document.nodes[i];
        let Some(index) = node.camera else { continue };
        let camera = entry(&document.cameras, "cameras", index, || format!("nodes[{i}].camera"))?;
        let name = own_name(camera.name.as_ref(), node, "camera", index);
        match (projection(camera, index), rigid(&tree.worlds[i])) {
            (Ok(projection), Some(world_from_camera)) => {
                cameras.push(Camera { name, world_from_camera, projection });
            }
            (Ok(_), None) => warnings.add(NO_DIRECTION, 1, || label("cameras", index, camera.name.as_deref())),
            (Err(fault), _) => leave_out(&mut broken, cameras.len(), name, fault, warnings),
        }
    }
    Ok((cameras, broken))
}

fn own_name(name: Option<&String>, node: &Node, kind: &str, index: usize) -> String {
    name.or(node.name.as_ref()).filter(|n| !n.is_empty()).cloned().unwrap_or_else(|| format!("{kind} {index}"))
}

fn projection(camera: &json::Camera, index: usize) -> Loaded<Projection> {
    let bad = |member: &str, problem: String| Err(fault(format!("cameras[{index}].{member}"), problem));
    match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), _) => {
            let (fov_y, near) = (f64::from(p.yfov), f64::from(p.znear));
            if !(fov_y > 0.0 && fov_y < PI) {
                return bad("perspective.yfov", format!("is {fov_y}, must be an angle in radians between 0 and pi"));
            }
            if !(near > 0.0 && near.is_finite()) {
                return bad("perspective.znear", format!("is {near}, must be above 0"));
            }
            Ok(Projection::Perspective { fov_y, near })
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
            let (half_height, near, far) = (f64::from(o.ymag).abs(), f64::from(o.znear), f64::from(o.zfar));
            if !(half_height > 0.0 && half_height.is_finite()) {
                return bad("orthographic.ymag", format!("is {half_height}, must be half the height of the view"));
            }
            if !(near >= 0.0 && far > near && far.is_finite()) {
                return bad(
                    "orthographic.zfar",
                    format!("is {far}, must be above znear, which is {near} and at least 0"),
                );
            }
            Ok(Projection::Orthographic { half_height, near, far })
        }
        _ => bad("type", "must be \"perspective\" or \"orthographic\", with the object of that name".into()),
    }
}

/// Returns the spot and directional lights, in the order of their nodes, and those that cannot be used.
pub fn lights(document: &Document, tree: &Tree, warnings: &mut Warnings) -> Loaded<(Vec<Light>, Vec<Broken>)> {
    let (mut lights, mut points, mut broken) = (Vec::new(), Vec::new(), Vec::new());
    for &i in tree.shown.iter().filter(|&&i| !tree.hidden[i]) {
        let node = &document.nodes[i];
        let reference = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(index) = reference.map(|r| r.light.value()) else { continue };
        let light = entry(document.lights(), "KHR_lights_punctual lights", index, || {
            format!("nodes[{i}].extensions.KHR_lights_punctual.light")
        })?;
        let name = own_name(light.name.as_ref(), node, "light", index);
        match (shape(light, index, node, i), rigid(&tree.worlds[i])) {
            (Err(fault), _) => leave_out(&mut broken, lights.len(), name, fault, warnings),
            (Ok(None), _) => points.push(label("lights", index, Some(&name))),
            (_, None) => warnings.add(NO_DIRECTION, 1, || label("lights", index, Some(&name))),
            (Ok(Some(shape)), Some(world_from_light)) => {
                let color = light.color.map(|c| c.clamp(0.0, 1.0));
                lights.push(Light { name, world_from_light, shape, color });
            }
        }
    }
    if let Some(first) = points.first() {
        let what = if lights.is_empty() {
            "point lights are not supported yet; a light fitted to the scene is used instead"
        } else {
            "point lights are not supported yet; it was left out"
        };
        warnings.add(what, points.len(), || first.clone());
    }
    Ok((lights, broken))
}

/// Returns the shape of a light; `None` for a point light.
fn shape(light: &FileLight, index: usize, node: &Node, node_index: usize) -> Loaded<Option<LightShape>> {
    let place = format!("KHR_lights_punctual.lights[{index}]");
    let Checked::Valid(kind) = light.type_ else {
        return Err(fault(format!("{place}.type"), "must be \"directional\", \"point\" or \"spot\""));
    };
    // The node's own value is more specific.
    let extra = |member: &str, most: f64| -> Loaded<Option<f64>> {
        match own_extra(&node.extras, member, most, || format!("nodes[{node_index}]"))? {
            Some(value) => Ok(Some(value)),
            None => own_extra(&light.extras, member, most, || place.clone()),
        }
    };
    match kind {
        LightType::Point => Ok(None),
        LightType::Directional => Ok(Some(LightShape::Directional { angle: extra("angle", PI)? })),
        LightType::Spot => {
            let outer = light.spot.as_ref().map_or(FRAC_PI_2 / 2.0, |s| f64::from(s.outer_cone_angle));
            // `f32` rounds pi/2 up.
            if !(outer > 0.0 && outer <= FRAC_PI_2 + 1e-6) {
                let problem = format!("is {outer}, must be an angle in radians above 0, at most pi/2");
                return Err(fault(format!("{place}.spot.outerConeAngle"), problem));
            }
            let size = extra("size", super::limits::COORDINATE)?;
            Ok(Some(LightShape::Spot { outer: outer.min(FRAC_PI_2), size }))
        }
    }
}

/// Returns `extras.edgeshade.<member>`; extras of any other form belong to other programs.
fn own_extra(extras: &json::Extras, member: &str, most: f64, place: impl Fn() -> String) -> Loaded<Option<f64>> {
    let extras = extras.as_ref().and_then(|raw| serde_json::from_str::<Value>(raw.get()).ok());
    let Some(value) = extras.as_ref().and_then(|e| e.get("edgeshade")?.get(member)) else { return Ok(None) };
    match value.as_f64() {
        Some(number) if (0.0..=most).contains(&number) => Ok(Some(number)),
        _ => {
            let place = format!("{}.extras.edgeshade.{member}", place());
            Err(fault(place, format!("is {value}, must be a number from 0 to {most:.4}")))
        }
    }
}
