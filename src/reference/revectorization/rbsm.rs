//! Mirror of `glsl/revectorization/rbsm.comp` and `rbsm_listings.comp`: the functions of [`super::revectorize`] applied to the tests on a
//! receiver's plane.
//!
//! `rbsm_steps.glsl` has no mirror of its own: it decides only which dispatch works on a pixel.

use super::revectorize::{self, Crack, Function, Outcome, Quality, Side};
use crate::Result;
use crate::reference::common::map_receiver::{MapReceiver, receive, receive_point};
use crate::reference::common::rbsm_receiver::{PLACE_ROUNDING, ReceiverSettings, Tests};
use crate::reference::common::view::{FrameData, Mirror, Receiver, Verdict, View};
use glam::DVec2;
use std::cell::RefCell;

/// Settings of the pass.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Visibility function at a discontinuity.
    pub function: Function,
    /// Compares all texels with the fragment's own depth.
    pub fixed_depth: bool,
    /// `MAXDIST`, texels.
    pub max_distance: u32,
    /// Normal offset, in multiples of what a plane needs.
    pub normal_offset: f32,
    /// Depth bias, as a fraction of the depth slope per texel, summed over both axes.
    pub depth_bias: f32,
    /// Distance by which a curved receiver may lie in front of its plane, in texel sizes of depth per texel of
    /// distance.
    pub slack: f32,
}

impl Settings {
    pub(crate) fn receiver(&self) -> ReceiverSettings {
        let Self { fixed_depth, normal_offset, depth_bias, slack, .. } = *self;
        ReceiverSettings { fixed_depth, normal_offset, depth_bias, slack }
    }
}

/// Returns the visibility of every pixel.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn visibility(data: &FrameData<'_>, settings: &Settings) -> Result<Mirror> {
    let view = View::new(data)?;
    let pixels = view.every_pixel(|p| {
        let receiver = receive(&view, p, settings.normal_offset, settings.depth_bias);
        verdict(&view, receiver, settings)
    });
    Ok(Mirror::collect(pixels))
}

fn verdict(view: &View<'_>, receiver: MapReceiver, settings: &Settings) -> Verdict {
    match receiver {
        MapReceiver::Decided(verdict) => verdict,
        MapReceiver::Open(r) => r.with_doubts(look_up(&Tests::new(view, &r, &settings.receiver()), settings)),
    }
}

/// Edge of the hard shadow in a texel, for a point in it: [`revectorize::TexelEdge`] and the bound of the value's error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeAt {
    pub value: f64,
    pub error: f64,
    pub gradient: DVec2,
}

/// Hard shadow at a point.
pub(crate) struct HardEdges {
    pub visibility: f64,
    /// `false` where a test or decision that matters lies within the rounding.
    pub sure: bool,
    /// Edge in each texel that the point may lie in, the likely one first; empty if no texel was read.
    pub edges: Vec<Option<EdgeAt>>,
}

/// Mirrors `hardEdge` of `glsl/penumbra/edge_line.comp` at any point on a surface.
pub(crate) fn edge_at(view: &View<'_>, r: &Receiver, settings: &Settings) -> HardEdges {
    let open = match receive_point(view, r, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(v) => {
            return HardEdges { visibility: v.visibility, sure: v.doubt == 0.0, edges: vec![] };
        }
        MapReceiver::Open(open) => open,
    };
    let tests = Tests::new(view, &open, &settings.receiver());
    let place_error = tests.place_error + PLACE_ROUNDING;
    let mut found = HardEdges { visibility: 1.0, sure: !open.is_doubtful(), edges: vec![] };
    for (i, texel) in tests.texels().into_iter().enumerate() {
        let fraction = tests.fraction(texel);
        let doubt = RefCell::new(false);
        let lit = |t: [i64; 2]| {
            let test = tests.test(texel, t);
            *doubt.borrow_mut() |= test.is_doubtful();
            test.is_yes()
        };
        let prepared = revectorize::prepare(&lit, texel, settings.function, settings.max_distance);
        let outcome = prepared.at(fraction);
        let mut is_tie = false;
        let edge = prepared.edge(fraction).map(|edge| {
            is_tie = edge.margin <= place_error.length();
            let error = edge.gradient.abs().dot(place_error);
            EdgeAt { value: edge.value, error, gradient: edge.gradient }
        });
        if i == 0 {
            found.visibility = outcome.visibility;
        }
        // The line itself tells where the visibility changes.
        let tie = outcome.margin <= place_error.length() && edge.is_none() || is_tie;
        found.sure &= !doubt.into_inner() && !tie && (edge.is_some() || outcome.visibility == found.visibility);
        found.edges.push(edge);
    }
    found
}

/// Intermediate results of a pixel, as `rbsm_view.comp` computes them. Arrays of four are in the order left, right,
/// +v, -v.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intermediates {
    /// Packed discontinuity of listing 2.
    pub discontinuity: [f64; 3],
    /// Signed steps of listing 3; 0 without a discontinuity.
    pub traversal: [f64; 4],
    /// Height of the edge profile over each side that differs, texels.
    pub height: [f64; 4],
    /// `false` where a test or the position in the map may rightly differ in single precision.
    pub sure: bool,
}

/// Returns the intermediate results of every pixel; `quality` is that of the edge profile.
///
/// # Errors
/// Fails if the images do not fit the constants.
pub fn intermediates(data: &FrameData<'_>, settings: &Settings, quality: Quality) -> Result<Vec<Intermediates>> {
    let view = View::new(data)?;
    Ok(view.every_pixel(|p| match receive(&view, p, settings.normal_offset, settings.depth_bias) {
        MapReceiver::Decided(verdict) => Intermediates {
            discontinuity: [0.0, 0.0, 1.0 - verdict.visibility],
            sure: verdict.doubt == 0.0,
            ..Intermediates::default()
        },
        MapReceiver::Open(r) => {
            let tests = Tests::new(&view, &r, &settings.receiver());
            let texels = tests.texels();
            let ask = |lit: &dyn Fn([i64; 2]) -> bool| found_at(&tests, texels[0], lit, settings, quality);
            // Any test in doubt puts the pixel in doubt.
            let doubt = RefCell::new(false);
            let found = ask(&|t| {
                let test = tests.test(texels[0], t);
                *doubt.borrow_mut() |= test.is_doubtful();
                test.is_yes()
            });
            let sure = texels.len() == 1 && !*doubt.borrow() && !r.is_doubtful();
            Intermediates { sure, ..found }
        }
    }))
}

fn found_at(
    tests: &Tests<'_>,
    texel: [i64; 2],
    lit: &dyn Fn([i64; 2]) -> bool,
    settings: &Settings,
    quality: Quality,
) -> Intermediates {
    let texels = |t| lit(t);
    let d = revectorize::discontinuity(&texels, texel);
    let mut found = Intermediates { discontinuity: d.packed().to_array(), ..Intermediates::default() };
    if d.mask == 0 {
        return found;
    }
    let fraction = tests.fraction(texel);
    found.traversal = revectorize::traverse_all(&texels, texel, d, settings.max_distance).map(|t| t as f64);
    found.height = Side::ALL.map(|side| {
        if !d.at(side) {
            return 0.0;
        }
        let crack = Crack { texel, side, lit: d.lit };
        let profile = revectorize::profile(&texels, crack, quality, settings.max_distance);
        profile.height(profile.before + if side.is_horizontal() { fraction.y } else { fraction.x })
    });
    found
}

pub(crate) fn look_up(tests: &Tests<'_>, settings: &Settings) -> Verdict {
    let mut found: Option<Verdict> = None;
    for texel in tests.texels() {
        let fraction = tests.fraction(texel);
        let ask = |lit: &dyn Fn([i64; 2]) -> bool| {
            revectorize::visibility(&|t| lit(t), texel, fraction, settings.function, settings.max_distance)
        };
        let (outcome, doubt) = tests.ask(texel, |o: &Outcome| o.visibility, ask);
        let place_error = tests.place_error.length() + PLACE_ROUNDING;
        let moved = tests.place_error.x + tests.place_error.y + PLACE_ROUNDING;
        let rounding = settings.function.slope() * moved;
        let verdict = Verdict { visibility: outcome.visibility, doubt, rounding };
        let verdict = if outcome.margin <= place_error { verdict.or(1.0 - outcome.visibility) } else { verdict };
        found = Some(found.map_or(verdict, |first| first.or_verdict(verdict)));
    }
    // The loop visits at least the exact texel.
    found.unwrap_or(Verdict::sure(1.0))
}
