//! The cases: what is changed, what must then hold, and how it is measured.

use super::inputs;
use super::lab::{Claim, LAMPS, Lab, MOVING, Shot, Truths, claim, pixel_width, scene, stage};
use crate::cli::bench::driver::{Error, Field, Record, Result, Row};
use crate::cli::bench::judge::Variant;
use crate::cli::bench::tilted::{self, Lamp, Tilted};
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use edgeshade::metrics::{self, Shot as Frame};
use edgeshade::scene::{Bounds, Projection, Scene};
use edgeshade::technique::penumbra::fixed_width::default_penumbra;
use edgeshade::technique::{ParamKind, Params};
use edgeshade::view::{CameraView, LightKind, LightView};
use glam::{DAffine3, DMat3, DVec3, dvec3};
use std::f64::consts::SQRT_2;

/// A change, and what it must leave as it is.
pub struct Case {
    pub name: &'static str,
    /// Description of the change.
    pub changed: &'static str,
    /// Description of the invariant, and of the figure that measures it.
    pub invariant: &'static str,
    /// The bound of the figure, and where it comes from.
    pub bound: &'static str,
    /// Known limits of techniques that make the case fail, for the page; empty if there are none.
    pub limits: &'static str,
    /// True if the figure is a share of pixels.
    pub is_share: bool,
    /// Measures the variants, in their order.
    pub measure: fn(&Lab<'_>, &[&Variant]) -> Result<Vec<Finding>>,
}

/// Result of a case for a technique.
pub enum Finding {
    Measured(Measured),
    /// The case says nothing about the technique, for this reason.
    DoesNotApply(&'static str),
}

/// A figure, and the bound that it must not exceed.
pub struct Measured {
    pub figure: f64,
    pub bound: f64,
    /// Light and change for which the figure is worst.
    pub place: String,
    /// Further figures.
    pub more: Record,
}

impl Measured {
    /// NaN does not hold.
    pub fn holds(&self) -> bool {
        self.figure <= self.bound
    }
}

/// Difference of visibility up to which pixels count as equal: five 8-bit steps, which nobody sees. Sums over a large
/// kernel lose less to rounding.
const EQUAL: f32 = 0.02;
/// Share of pixels that may change because their centre, or that of their texel, lies within rounding of an edge.
const TIES: f64 = 0.002;
/// The same where all positions round differently and the patterns of samples are turned over.
const MIRRORED_TIES: f64 = 0.01;
/// Change per frame relative to the truth's own.
const CHANGE: f64 = 1.05;
/// Root mean squared error relative to the least of a sweep of biases.
const PLATEAU: f64 = 1.1;
/// Root mean squared error of a hard picture in which a thousandth of the pixels is wrong, as many as ties alone may cost.
const HARD_TIES: f64 = 0.0316;
/// Root mean squared error of a soft picture that is wrong by one 8-bit step everywhere.
const SOFT_STEP: f64 = 0.004;

const OWN_VIEW: &str = "it fits a map of its own to every point of the light";

pub static ALL: [Case; 21] = [
    Case {
        name: "repeat",
        changed: "nothing: three frames of one technique, then one that is made anew",
        invariant: "all four pictures have the same bits; share of pixels that have not",
        bound: "0: the same work on the same data",
        limits: "",
        is_share: true,
        measure: repeat,
    },
    Case {
        name: "scale by a power of two",
        changed: "scene, camera and light are 1024 times as large, and 1/1024",
        invariant: "the pictures have the same bits; share of pixels that have not",
        bound: "0: floating point scales by powers of two exactly, so any change is a hidden length",
        limits: "",
        is_share: true,
        measure: |lab, variants| {
            in_places(variants, [1024.0, 1.0 / 1024.0], |factor| {
                same(lab, variants, &format!("times {factor}"), [0.0, 0.0], &|s| scaled(s, factor))
            })
        },
    },
    Case {
        name: "scale",
        changed: "scene, camera and light are 1000 times as large, and 1/1000",
        invariant: "the pictures are equal; share of pixels that differ by more than 0.02",
        bound: "0.2 %: pixels and texels within rounding of an edge",
        limits: "",
        is_share: true,
        measure: |lab, variants| {
            in_places(variants, [1000.0, 0.001], |factor| {
                same(lab, variants, &format!("times {factor}"), [EQUAL.into(), TIES], &|s| scaled(s, factor))
            })
        },
    },
    Case {
        name: "translation",
        changed: "scene, camera and light are moved by 1e6 units along each axis",
        invariant: "the pictures are equal; share of pixels that differ by more than 0.02",
        bound: "0.2 %: views and instances are in double precision, whose spacing at 1e6 units is 1e-10, a \
                hundred-millionth of a texel; what remains is pixels and texels within rounding of an edge",
        limits: "",
        is_share: true,
        measure: |lab, variants| {
            let by = dvec3(1e6, -1e6, 1e6);
            same(lab, variants, "1e6 units", [EQUAL.into(), TIES], &|s| s.transform(&DAffine3::from_translation(by)))
        },
    },
    Case {
        name: "translated vertices",
        changed: "the vertices themselves are moved by 1024 units, after rounding them so that this changes none of them",
        invariant: "the pictures are equal; share of pixels that differ by more than 0.02",
        bound: "0.6 %: a transform in single precision rounds by up to four spacings of 1/8192 unit, a 50th of a pixel, \
                along outlines and shadow edges that pass through a fifth of the pixels; and 0.2 % as above",
        limits: "",
        is_share: true,
        measure: translated_vertices,
    },
    Case {
        name: "mirror",
        changed: "everything is mirrored at a plane",
        invariant: "the picture is the mirror image; share of pixels that differ by more than 0.05",
        bound: "1 %: pixels and texels within rounding of an edge, and sampling patterns that are turned over",
        limits: "",
        is_share: true,
        measure: mirror,
    },
    Case {
        name: "roll of the light",
        changed: "the light's view is turned about its axis by 0 to 75 degrees in steps of 15",
        invariant: "no turn stands out; largest RMSE against the truth divided by the mean; errors that ties alone may cause count as equal",
        bound: "1.41: a square texel is up to the square root of two wider along its diagonal",
        limits: "",
        is_share: false,
        measure: roll,
    },
    Case {
        name: "quarter turns of the light",
        changed: "the light's view is turned about its axis by 90, 180 and 270 degrees, which gives the same texels",
        invariant: "the picture stays; share of pixels that differ by more than 0.05",
        bound: "1 %: as for the mirror",
        limits: "",
        is_share: true,
        measure: quarter_turns,
    },
    Case {
        name: "camera's near plane",
        changed: "the camera's near plane is 1024 times as near",
        invariant: "the picture stays; share of pixels that differ by more than 0.02",
        bound: "0.2 %: reversed floating-point depth keeps its precision whatever the near plane",
        limits: "",
        is_share: true,
        measure: |lab, variants| same(lab, variants, "", [EQUAL.into(), TIES], &nearer),
    },
    Case {
        name: "light's depth range",
        changed: "the planes of the light's view: a spot's are 32 times as near and as far, a sun's range is 1024 times as long",
        invariant: "the picture stays; share of pixels that differ by more than 0.02",
        bound: "1 %: 32-bit depth then resolves a hundredth of a texel, which moves every shadow edge by as much",
        limits: "vsm, evsm, msm, vssm and mssm store moments relative to the range, so a long range leaves the scene a small part of \
                 their precision. Fit the planes to the scene.",
        is_share: true,
        measure: depth_range,
    },
    Case {
        name: "map of 16 bits",
        changed: "the shadow map is rounded to D16",
        invariant: "the error hardly grows; RMSE divided by that with D32",
        bound: "1.1: over the fitted range the format resolves less than a tenth of a texel",
        limits: "",
        is_share: false,
        measure: inputs::sixteen_bits,
    },
    Case {
        name: "bias",
        changed: "normal offset and depth bias, from 1/16 to 16 times their defaults in steps of two",
        invariant: "the default lies on the plateau between acne and leaking; its RMSE divided by the least of the sweep",
        bound: "1.1: the edge of the plateau",
        limits: "",
        is_share: false,
        measure: bias,
    },
    Case {
        name: "slopes",
        changed: "a plane alone, tilted against the light by 0, 45, 70, 80 and 85 degrees",
        invariant: "it is lit; share of pixels darker than 0.98",
        bound: "0: nothing casts a shadow",
        limits: "bounds from moments do not tell a steep receiver from an occluder for certain, which darkens it under msm, vssm and \
                 mssm",
        is_share: true,
        measure: slopes,
    },
    Case {
        name: "light in steps",
        changed: "the light moves so that shadows move by a fraction of a pixel a frame",
        invariant: "the picture changes no more than the truth; change per frame divided by the truth's",
        bound: CHANGE_BOUND,
        limits: "the texels slide over the receivers by more than the shadows move, and the stairs of every technique that reads the map \
                 go with them",
        is_share: false,
        measure: |lab, variants| motion(lab, variants, &light_steps),
    },
    Case {
        name: "camera in steps",
        changed: "the camera moves by a fifth of a pixel a frame",
        invariant: "the picture changes no more than the truth; change per frame divided by the truth's",
        bound: CHANGE_BOUND,
        limits: "",
        is_share: false,
        measure: |lab, variants| motion(lab, variants, &camera_steps),
    },
    Case {
        name: "moving caster",
        changed: "a block moves by a fifth of a pixel a frame",
        invariant: "the picture changes no more than the truth; change per frame divided by the truth's",
        bound: CHANGE_BOUND,
        limits: "",
        is_share: false,
        measure: |lab, variants| motion(lab, variants, &caster_steps),
    },
    Case {
        name: "animated caster",
        changed: "the vertices of a block twist it a little more each frame",
        invariant: "the picture changes no more than the truth; change per frame divided by the truth's",
        bound: CHANGE_BOUND,
        limits: "",
        is_share: false,
        measure: |lab, variants| motion(lab, variants, &caster_twists),
    },
    Case {
        name: "sizes",
        changed: "images and maps of extreme sizes, down to one pixel and one texel",
        invariant: "every value is a number from 0 to 1; share of pixels that are not",
        bound: "0",
        limits: "",
        is_share: true,
        measure: sizes,
    },
    Case {
        name: "settings",
        changed: "each number among the parameters, at the ends of its range",
        invariant: "every value is a number from 0 to 1; share of pixels that are not",
        bound: "0",
        limits: "",
        is_share: true,
        measure: settings,
    },
    Case {
        name: "degenerate triangles",
        changed: "triangles without area are added to all meshes, at points and along edges",
        invariant: "the picture has the same bits; share of pixels that have not",
        bound: "0: they cover nothing",
        limits: "",
        is_share: true,
        measure: |lab, variants| same(lab, variants, "", [0.0, 0.0], &degenerate),
    },
    Case {
        name: "inputs that are no numbers",
        changed: "single pixels of the engine's depth, then of its normals, and single texels of its map are NaN or infinite",
        invariant: "every value is a number from 0 to 1; other pixels see sky where a depth is no number, and nothing farther \
                    than a sixth of the image sees a normal that is none; share of pixels where this is wrong",
        bound: "0",
        limits: "",
        is_share: true,
        measure: inputs::not_numbers,
    },
];

const CHANGE_BOUND: &str = "1.05, plus 2 / sqrt(n) for the n pixels that change in the truth: the counting error of what happens to lie under \
     their centres";

/// Keeps the worst finding of every variant over several places.
fn worst(variants: &[&Variant], places: Vec<Vec<Finding>>) -> Vec<Finding> {
    let margin = |f: &Finding| match f {
        Finding::Measured(m) if m.figure.is_nan() => f64::INFINITY,
        Finding::Measured(m) => m.figure - m.bound,
        Finding::DoesNotApply(_) => f64::NEG_INFINITY,
    };
    let mut places: Vec<_> = places.into_iter().map(Vec::into_iter).collect();
    let each = variants.iter().filter_map(|_| {
        let here = places.iter_mut().filter_map(Iterator::next).collect::<Vec<_>>();
        here.into_iter().max_by(|a, b| margin(a).total_cmp(&margin(b)))
    });
    each.collect()
}

/// Measures in several places, and keeps the worst.
fn in_places<T>(
    variants: &[&Variant],
    places: impl IntoIterator<Item = T>,
    measure: impl FnMut(T) -> Result<Vec<Finding>>,
) -> Result<Vec<Finding>> {
    let found = places.into_iter().map(measure).collect::<Result<Vec<_>>>()?;
    Ok(worst(variants, found))
}

/// Runs a measurement under both kinds of light, and keeps the worst.
pub fn under_lamps(
    variants: &[&Variant],
    measure: impl Fn(Lamp, &str) -> Result<Vec<Finding>>,
) -> Result<Vec<Finding>> {
    let found = LAMPS.into_iter().map(|lamp| measure(lamp, lamp_name(lamp))).collect::<Result<Vec<_>>>()?;
    Ok(worst(variants, found))
}

fn lamp_name(lamp: Lamp) -> &'static str {
    match lamp {
        Lamp::Sun => "sun",
        Lamp::Spot => "spot",
    }
}

/// The error of a picture, raised to the least one that ratios of errors say anything about.
pub fn error(truths: &Truths, choice: &Choice, seen: &[f32]) -> f64 {
    truths.rmse(choice, seen).max(least_error(choice))
}

fn least_error(choice: &Choice) -> f64 {
    if claim(choice.info.id) == Claim::Hard { HARD_TIES } else { SOFT_STEP }
}

pub fn measured(figure: f64, bound: f64, place: &str) -> Finding {
    Finding::Measured(Measured { figure, bound, place: place.to_owned(), more: Record::default() })
}

/// Share of the values that differ by more than `tolerance`; a tolerance of 0 compares bits. NaN differs.
pub fn differing(a: &[f32], b: &[f32], tolerance: f64) -> f64 {
    let differ = |(a, b): (&f32, &f32)| match tolerance {
        0.0 => a.to_bits() != b.to_bits(),
        _ => f64::from((a - b).abs()) > tolerance || a.is_nan() || b.is_nan(),
    };
    share(a.iter().zip(b).map(differ))
}

/// Share of the values that are no numbers from 0 to 1.
pub fn out_of_range(values: &[f32]) -> f64 {
    share(values.iter().map(|v| !(0.0..=1.0).contains(v)))
}

/// Share of the items that are true.
pub fn share(items: impl ExactSizeIterator<Item = bool>) -> f64 {
    let all = items.len().max(1) as f64;
    items.filter(|&is| is).count() as f64 / all
}

/// Compares pictures of the scene with those of a changed scene. `limits` are the tolerance of a pixel and the share of
/// pixels that may exceed it.
fn same(
    lab: &Lab<'_>,
    variants: &[&Variant],
    place: &str,
    [tolerance, bound]: [f64; 2],
    change: &dyn Fn(&mut Scene),
) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let mut changed = scene(lamp);
        change(&mut changed);
        let stages = [lab.stage(scene(lamp)), lab.stage(changed)];
        let [mut before, mut after] = [lab.shot(&stages[0])?, lab.shot(&stages[1])?];
        let place = format!("{name} {place}");
        pairs(variants, &mut before, &mut after, |a, b| measured(differing(a, b, tolerance), bound, place.trim()))
    })
}

/// Compares two pictures by every variant.
fn pairs(
    variants: &[&Variant],
    before: &mut Shot<'_>,
    after: &mut Shot<'_>,
    compare: impl Fn(&[f32], &[f32]) -> Finding,
) -> Result<Vec<Finding>> {
    let one = |v: &&Variant| {
        let pictures = (before.image(&v.choice)?, after.image(&v.choice)?);
        let (Some(a), Some(b)) = pictures else { return Ok(Finding::DoesNotApply(OWN_VIEW)) };
        Ok(compare(&a, &b))
    };
    variants.iter().map(one).collect()
}

fn repeat(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let mut shot = lab.shot(&stage)?;
        let one = |v: &&Variant| {
            let Choice { info, params } = &v.choice;
            let mut pictures = vec![];
            if !v.choice.is_reference() {
                let mut technique = shot.renderer.prepare(info.id, params)?;
                for _ in 0..3 {
                    shot.renderer.frame(technique.as_mut())?;
                    pictures.push(shot.renderer.visibility(technique.as_ref())?);
                }
            }
            pictures.extend(shot.image(&v.choice)?);
            pictures.extend(shot.image(&v.choice)?);
            let shares = pictures.windows(2).map(|p| differing(&p[0], &p[1], 0.0));
            Ok(measured(shares.fold(0.0, f64::max), 0.0, name))
        };
        variants.iter().map(one).collect()
    })
}

fn scaled(scene: &mut Scene, factor: f64) {
    scene.transform(&DAffine3::from_scale(DVec3::splat(factor)));
}

/// Spacing of single precision between 1024 and 2048, world units.
const SPACING: f64 = 1.0 / 8192.0;

fn translated_vertices(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let mut near = scene(lamp);
        // Vertices in the world, at multiples of the spacing.
        for (mesh, instance) in near.meshes.iter_mut().zip(&mut near.instances) {
            for p in &mut mesh.positions {
                let world = instance.world_from_object.transform_point3(DVec3::from(p.map(f64::from)));
                *p = ((world / SPACING).round() * SPACING).as_vec3().to_array();
            }
            let turn = instance.world_from_object.matrix3;
            for n in &mut mesh.normals {
                *n = (turn * DVec3::from(n.map(f64::from))).as_vec3().to_array();
            }
            instance.world_from_object = DAffine3::IDENTITY;
            mesh.compute_bounds();
        }
        let mut far = near.clone();
        let by = DVec3::splat(1024.0);
        for mesh in &mut far.meshes {
            mesh.positions.iter_mut().for_each(|p| *p = p.map(|v| v + 1024.0));
            mesh.compute_bounds();
        }
        far.cameras[0].world_from_camera.translation += by;
        far.lights[0].world_from_light.translation += by;
        let stages = [lab.stage(near), lab.stage(far)];
        let [mut before, mut after] = [lab.shot(&stages[0])?, lab.shot(&stages[1])?];
        pairs(variants, &mut before, &mut after, |a, b| measured(differing(a, b, EQUAL.into()), 0.006, name))
    })
}

/// The scene mirrored at the plane x = 0; transforms of views stay rigid.
fn mirrored(scene: &mut Scene) {
    let flip = DAffine3::from_mat3(DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0)));
    scene.instances.iter_mut().for_each(|i| i.world_from_object = flip * i.world_from_object);
    scene.cameras.iter_mut().for_each(|c| c.world_from_camera = flip * c.world_from_camera * flip);
    scene.lights.iter_mut().for_each(|l| l.world_from_light = flip * l.world_from_light * flip);
}

fn mirror(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let mut other = scene(lamp);
        mirrored(&mut other);
        let stages = [lab.stage(scene(lamp)), lab.stage(other)];
        let [mut before, mut after] = [lab.shot(&stages[0])?, lab.shot(&stages[1])?];
        let width = lab.size[0] as usize;
        pairs(variants, &mut before, &mut after, |a, b| {
            let back: Vec<f32> = b.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
            measured(differing(a, &back, 0.05), MIRRORED_TIES, name)
        })
    })
}

/// Least and largest distance of a light's view along its axis.
fn planes(view: &LightView) -> [f64; 2] {
    let (scale, offset) = (view.clip_from_view.z_axis.z, view.clip_from_view.w_axis.z);
    let near = offset / scale;
    [near, if view.is_directional() { near - 1.0 / scale } else { near * scale / (1.0 + scale) }]
}

fn with_planes(mut view: LightView, [near, far]: [f64; 2]) -> LightView {
    let r = 1.0 / (near - far);
    let [scale, offset] = if view.is_directional() { [r, near * r] } else { [far * r, near * far * r] };
    view.clip_from_view.z_axis.z = scale;
    view.clip_from_view.w_axis.z = offset;
    view
}

/// Makes a sun's view square, and widens views so that they can be turned about their axis.
fn room_to_turn(mut view: LightView) -> LightView {
    let is_sun = view.is_directional();
    let m = &mut view.clip_from_view;
    let [x, y] = [m.x_axis.x, m.y_axis.y];
    let scale = if is_sun { 1.0 / (1.0 / x).hypot(1.0 / y) } else { x.abs().min(y.abs()) / SQRT_2 };
    m.x_axis.x = scale.copysign(x);
    m.y_axis.y = scale.copysign(y);
    view
}

/// The light's view turned about its axis.
fn rolled(view: &LightView, degrees: f64) -> LightView {
    let turn = DAffine3::from_rotation_z(degrees.to_radians());
    LightView { world_from_view: view.world_from_view * turn, ..*view }
}

fn roll(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let mut shot = lab.shot(&stage)?;
        let start = room_to_turn(*shot.renderer.light());
        let mut errors = vec![vec![]; variants.len()];
        for degrees in [0.0, 15.0, 30.0, 45.0, 60.0, 75.0] {
            shot.set_light(rolled(&start, degrees));
            let truths = shot.truths()?;
            for (v, errors) in variants.iter().zip(&mut errors) {
                errors.extend(shot.image(&v.choice)?.map(|seen| error(&truths, &v.choice, &seen)));
            }
        }
        let finding = |errors: Vec<f64>| match errors.iter().copied().reduce(f64::max) {
            Some(largest) => measured(largest * errors.len() as f64 / errors.iter().sum::<f64>(), SQRT_2, name),
            None => Finding::DoesNotApply(OWN_VIEW),
        };
        Ok(errors.into_iter().map(finding).collect())
    })
}

fn quarter_turns(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let [mut before, mut after] = [lab.shot(&stage)?, lab.shot(&stage)?];
        let start = room_to_turn(*before.renderer.light());
        before.set_light(start);
        in_places(variants, [90.0, 180.0, 270.0], |degrees| {
            after.set_light(rolled(&start, degrees));
            let place = format!("{name}, {degrees} degrees");
            pairs(variants, &mut before, &mut after, |a, b| measured(differing(a, b, 0.05), MIRRORED_TIES, &place))
        })
    })
}

fn nearer(scene: &mut Scene) {
    if let Projection::Perspective { near, .. } = &mut scene.cameras[0].projection {
        *near /= 1024.0;
    }
}

fn depth_range(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let [mut before, mut after] = [lab.shot(&stage)?, lab.shot(&stage)?];
        let view = *before.renderer.light();
        let [near, far] = planes(&view);
        let range = match lamp {
            Lamp::Spot => [near / 32.0, far * 32.0],
            Lamp::Sun => [near - 511.5 * (far - near), far + 511.5 * (far - near)],
        };
        before.set_light(view);
        after.set_light(with_planes(view, range));
        // The default penumbra is defined by the middle of the range, so its width is given instead.
        let variants: Vec<_> = variants.iter().map(|v| with_given_penumbra(v, &view)).collect::<Result<_>>()?;
        let variants: Vec<_> = variants.iter().collect();
        pairs(&variants, &mut before, &mut after, |a, b| measured(differing(a, b, EQUAL.into()), 0.01, name))
    })
}

/// The technique with the width of its penumbra stated, if it has a default one.
fn with_given_penumbra(variant: &Variant, view: &LightView) -> Result<Variant> {
    let mut variant = variant.clone();
    let Choice { info, params } = &mut variant.choice;
    if info.params.iter().any(|p| p.name == "penumbra") {
        params.set(info.id, "penumbra", &default_penumbra(view).to_string())?;
    }
    Ok(variant)
}

/// Parameters that push the receiver away from its own texels.
const BIASES: [&str; 2] = ["normal_offset", "depth_bias"];
/// Powers of two that the biases are multiplied by.
const OCTAVES: std::ops::RangeInclusive<i32> = -4..=4;

fn bias(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let mut shot = lab.shot(&stage)?;
        let truths = shot.truths()?;
        let one = |v: &&Variant| {
            let Choice { info, params } = &v.choice;
            let biases = info.params.iter().filter(|p| BIASES.contains(&p.name) && p.default > 0.0);
            let biases: Vec<_> = biases.collect();
            if biases.is_empty() {
                return Ok(Finding::DoesNotApply("it has no bias to set"));
            }
            let (mut rows, mut errors) = (vec![], vec![]);
            for octave in OCTAVES {
                let factor = f64::from(octave).exp2();
                let mut params = params.clone();
                for p in &biases {
                    let ParamKind::Float { min, max } = p.kind else { continue };
                    params.set(info.id, p.name, &(p.default * factor).clamp(min, max).to_string())?;
                }
                let choice = Choice { info, params };
                let Some(seen) = shot.image(&choice)? else { continue };
                let report = metrics::compare(&seen, truths.of(&choice), &truths.mask, lab.size)?;
                errors.push((octave, report.rmse.max(least_error(&choice))));
                let fields = Record::of([
                    ("factor", factor.into()),
                    ("rmse", report.rmse.into()),
                    ("false_shadow", report.false_shadow.into()),
                    ("light_leak", report.light_leak.into()),
                ]);
                rows.push(Row::new("", "", fields));
            }
            let least = errors.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
            let own = errors.iter().find(|e| e.0 == 0).map_or(f64::NAN, |e| e.1);
            let [low, high] = plateau(&errors, PLATEAU * least);
            let more = Record::of([
                ("plateau_octaves", (high - low).into()),
                ("plateau_from", f64::from(low).exp2().into()),
                ("plateau_to", f64::from(high).exp2().into()),
                ("sweep", Field::Rows(rows)),
            ]);
            Ok(Finding::Measured(Measured { figure: own / least, bound: PLATEAU, place: name.into(), more }))
        };
        variants.iter().map(one).collect()
    })
}

/// First and last octave of the run around the least error in which no error exceeds the limit.
fn plateau(errors: &[(i32, f64)], limit: f64) -> [i32; 2] {
    let Some(middle) = (0..errors.len()).min_by(|&a, &b| errors[a].1.total_cmp(&errors[b].1)) else { return [0; 2] };
    let first = (0..=middle).rev().take_while(|&i| errors[i].1 <= limit).last().unwrap_or(middle);
    let last = (middle..errors.len()).take_while(|&i| errors[i].1 <= limit).last().unwrap_or(middle);
    [errors[first].0, errors[last].0]
}

fn slopes(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    let size = [lab.size[1]; 2];
    under_lamps(variants, |lamp, name| {
        let places = [0.0f64, 45.0, 70.0, 80.0, 85.0].map(|degrees| -> Result<Vec<Finding>> {
            let mut tilted = Tilted::new(lamp, degrees.to_radians(), size);
            // The plane without the plates.
            tilted.stage.scene.instances.remove(0);
            let mut shot = lab.shot_of(&tilted.stage, size, tilted::MAP)?;
            let kind = match lamp {
                Lamp::Sun => LightKind::Directional { angle: 0.05 },
                Lamp::Spot => LightKind::Spot { size: 1.0 },
            };
            shot.set_light(LightView { kind, ..tilted.light });
            let mask = shot.truths()?.mask;
            let one = |v: &&Variant| {
                let Some(seen) = shot.image(&v.choice)? else { return Ok(Finding::DoesNotApply(OWN_VIEW)) };
                let judged: Vec<_> = (0..seen.len()).filter(|&i| mask[i]).collect();
                let is_lit = |v: f32| (1.0 - EQUAL..=1.0).contains(&v);
                let dark = share(judged.iter().map(|&i| !is_lit(seen[i])));
                Ok(measured(dark, 0.0, &format!("{name} {degrees} degrees")))
            };
            variants.iter().map(one).collect()
        });
        Ok(worst(variants, places.into_iter().collect::<Result<_>>()?))
    })
}

/// Scene and views, which move from frame to frame.
struct Pose {
    scene: Scene,
    camera: CameraView,
    light: LightView,
}

/// Number of pixels around the true boundary in which change is measured.
const BAND: u32 = 4;
/// Step of camera and casters, pixels.
const STEP: f64 = 0.2;

/// Moves the pose by some steps of `step` world units.
type Move = dyn Fn(&mut Pose, f64);

fn light_steps(pose: &mut Pose, by: f64) {
    let is_sun = pose.light.is_directional();
    let view = &mut pose.light.world_from_view;
    // Shadows move by about a third of what a spot moves, since the casters stand that far from the ground; a sun is turned
    // so that the shadow of a point 3 units above the ground moves by the step.
    if is_sun {
        view.matrix3 = DMat3::from_rotation_y(by / 3.0) * view.matrix3;
    } else {
        *view *= DAffine3::from_translation(dvec3(2.0 * by, by, 0.0));
    }
}

fn camera_steps(pose: &mut Pose, by: f64) {
    let view = &mut pose.camera.world_from_view;
    *view *= DAffine3::from_translation(dvec3(0.8 * by, 0.6 * by, 0.0));
}

fn caster_steps(pose: &mut Pose, by: f64) {
    pose.scene.instances[MOVING].world_from_object.translation += dvec3(0.8 * by, 0.0, 0.6 * by);
}

fn caster_twists(pose: &mut Pose, by: f64) {
    let mesh = &mut pose.scene.meshes[MOVING];
    for p in &mut mesh.positions {
        let point = DVec3::from(p.map(f64::from));
        *p = (DMat3::from_rotation_y(by * (1.0 + point.y)) * point).as_vec3().to_array();
    }
    mesh.compute_bounds();
}

fn motion(lab: &Lab<'_>, variants: &[&Variant], step: &Move) -> Result<Vec<Finding>> {
    let count = if lab.quick { 4 } else { 6 };
    under_lamps(variants, |lamp, name| {
        let stage = lab.stage(scene(lamp));
        let width = pixel_width(&stage, lab.size);
        let start = with_room(&stage, *lab.shot(&stage)?.renderer.light());
        let (mut truths, mut frames) = (vec![], vec![vec![]; variants.len()]);
        for i in 0..count {
            let mut pose = Pose { scene: stage.scene.clone(), camera: stage.camera, light: start };
            step(&mut pose, f64::from(i) * STEP * width);
            let moved = Stage { scene: pose.scene, camera: pose.camera, light: stage.light.clone() };
            let mut shot = lab.shot(&moved)?;
            shot.set_light(pose.light);
            truths.push(shot.truths()?);
            for (v, frames) in variants.iter().zip(&mut frames) {
                frames.extend(shot.image(&v.choice)?);
            }
        }
        let one = |(v, frames): (&&Variant, Vec<Vec<f32>>)| {
            if frames.is_empty() {
                return Ok(Finding::DoesNotApply(OWN_VIEW));
            }
            let shots: Vec<_> = (frames.iter().zip(&truths))
                .map(|(test, t)| Frame { test, truth: t.of(&v.choice), mask: &t.mask })
                .collect();
            let changed = shots.windows(2).map(|s| {
                (0..s[0].test.len()).filter(|&i| s[0].mask[i] && s[1].mask[i] && s[0].truth[i] != s[1].truth[i]).count()
            });
            let changed = changed.sum::<usize>() as f64;
            let motion = metrics::motion(&shots, lab.size, BAND)?;
            let (Some(own), Some(truth)) = (motion.change, motion.change_truth.filter(|&c| c > 0.0)) else {
                return Err(Error::Usage("the image is too small to show a moving shadow".into()));
            };
            let more = Record::of([
                ("change", own.into()),
                ("change_truth", truth.into()),
                ("change_error", motion.change_error.into()),
                ("flicker", motion.flicker.into()),
                ("flicker_truth", motion.flicker_truth.into()),
            ]);
            let bound = CHANGE + 2.0 / changed.sqrt();
            Ok(Finding::Measured(Measured { figure: own / truth, bound, place: name.into(), more }))
        };
        variants.iter().zip(frames).map(one).collect()
    })
}

/// Widens a view so that what moves by a few pixels stays inside.
fn with_room(stage: &Stage, mut view: LightView) -> LightView {
    let [near, far] = planes(&view);
    if view.is_directional() {
        view.clip_from_view.x_axis.x *= 0.95;
        view.clip_from_view.y_axis.y *= 0.95;
        let room = 0.05 * (far - near);
        return with_planes(view, [near - room, far + room]);
    }
    let Bounds { min, max } = stage.scene.bounds();
    with_planes(view, [0.9 * near, far + 0.02 * min.distance(max)])
}

fn sizes(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    let all = [([1, 1], 64), ([1, 7], 1), ([333, 27], 100), ([48, 27], 2), ([48, 27], 65), ([2048, 8], 1024)];
    let all = if lab.quick { &all[..2] } else { &all[..] };
    in_places(variants, all, |&(size, map)| {
        let place = format!("{}x{} pixels, map {map}", size[0], size[1]);
        let stage = stage(scene(Lamp::Spot), size);
        let mut shot = lab.shot_of(&stage, size, map)?;
        let one = |v: &&Variant| {
            let Some(seen) = shot.image(&v.choice)? else { return Ok(Finding::DoesNotApply(OWN_VIEW)) };
            Ok(measured(out_of_range(&seen), 0.0, &place))
        };
        variants.iter().map(one).collect()
    })
}

fn settings(lab: &Lab<'_>, variants: &[&Variant]) -> Result<Vec<Finding>> {
    let size = [48, 27];
    let stage = stage(scene(Lamp::Sun), size);
    let mut shot = lab.shot_of(&stage, size, 128)?;
    let one = |v: &&Variant| {
        let info = v.choice.info;
        if v.choice.is_reference() {
            return Ok(Finding::DoesNotApply("its numbers are counts of samples"));
        }
        let mut worst = measured(0.0, 0.0, "");
        for p in info.params {
            let ends = match p.kind {
                ParamKind::Float { min, max } => [min, max].map(|v| v.to_string()),
                ParamKind::Int { min, max, .. } => [min, max].map(|v| v.to_string()),
                _ => continue,
            };
            // A quick run takes the larger kernels alone.
            let is_left_out = lab.quick && matches!(p.kind, ParamKind::Float { .. });
            for end in ends.iter().filter(|_| !is_left_out).skip(usize::from(lab.quick)) {
                let params = Params::parse(info, [(p.name, end.as_str())])?;
                let seen = match shot.image(&Choice { info, params }) {
                    // A size that the device has no room for is refused with words.
                    Err(Error::Parameter(_)) => continue,
                    seen => seen?.unwrap_or_default(),
                };
                let figure = out_of_range(&seen);
                if let Finding::Measured(m) = &worst
                    && figure > m.figure
                {
                    worst = measured(figure, 0.0, &format!("{}={end}", p.name));
                }
            }
        }
        Ok(worst)
    };
    variants.iter().map(one).collect()
}

fn degenerate(scene: &mut Scene) {
    for mesh in &mut scene.meshes {
        let added: Vec<u32> = mesh
            .indices
            .chunks_exact(3)
            .step_by(3)
            .flat_map(|t| [[t[0], t[0], t[1]], [t[1], t[2], t[1]], [t[2], t[2], t[2]]].concat())
            .collect();
        mesh.indices.extend(added);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::stability::lab::LAMPS;
    use edgeshade::scene::light_view;

    #[test]
    fn a_plateau_is_the_run_around_the_least_error() {
        let errors = |values: [f64; 5]| values.into_iter().zip(-2..).map(|(e, i)| (i, e)).collect::<Vec<_>>();
        assert_eq!(plateau(&errors([5.0, 1.05, 1.0, 1.1, 3.0]), 1.1), [-1, 1]);
        assert_eq!(plateau(&errors([1.0, 2.0, 1.05, 1.0, 1.0]), 1.1), [-2, -2]);
        assert_eq!(plateau(&errors([3.0, 2.0, 1.5, 1.2, 1.0]), 1.1), [2, 2]);
        assert_eq!(plateau(&[], 1.0), [0, 0]);
    }

    #[test]
    fn planes_are_read_and_written() {
        for lamp in LAMPS {
            let scene = scene(lamp);
            let view = light_view(&scene, &scene.lights[0]);
            let [near, far] = planes(&view);
            let point = |distance: f64| {
                let clip = view.clip_from_view * dvec3(0.0, 0.0, -distance).extend(1.0);
                clip.z / clip.w
            };
            assert!(point(near).abs() < 1e-9 && (point(far) - 1.0).abs() < 1e-9, "{lamp:?}: {near} to {far}");
            let same = with_planes(view, [near, far]);
            assert!(same.clip_from_view.abs_diff_eq(view.clip_from_view, 1e-9), "{lamp:?}");
            let [other_near, other_far] = planes(&with_planes(view, [0.25 * near, 3.0 * far]));
            assert!((other_near - 0.25 * near).abs() < 1e-9 && (other_far - 3.0 * far).abs() < 1e-6, "{lamp:?}");
        }
    }

    #[test]
    fn the_worst_place_counts_and_no_number_is_worst() {
        let variants = [Variant::new(Choice::new("sm", &[]).unwrap())];
        let variants: Vec<_> = variants.iter().collect();
        let found = |figures: [f64; 3]| {
            let places = figures.iter().map(|&f| vec![measured(f, 1.0, &f.to_string())]);
            let places = places.chain([vec![Finding::DoesNotApply("")]]).collect();
            match worst(&variants, places).remove(0) {
                Finding::Measured(m) => (m.place.clone(), m.holds()),
                Finding::DoesNotApply(_) => panic!("one place applies"),
            }
        };
        assert_eq!(found([0.5, 0.9, 0.1]), ("0.9".to_owned(), true));
        assert_eq!(found([0.5, 1.1, 0.1]), ("1.1".to_owned(), false));
        assert_eq!(found([0.5, f64::NAN, 1.1]), ("NaN".to_owned(), false));
        assert_eq!(
            (differing(&[0.0, 1.0], &[-0.0, 1.0], 0.0), differing(&[0.0, 1.0], &[-0.0, f32::NAN], 0.1)),
            (0.5, 0.5)
        );
        assert_eq!(out_of_range(&[0.0, 1.0, f32::NAN, 1.5, -0.1, f32::INFINITY, 0.5, 0.5]), 0.5);
    }
}
