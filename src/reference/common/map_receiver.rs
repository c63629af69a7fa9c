//! Mirror of `mapReceiver` in `glsl/common/receiver.glsl`: a pixel is decided without the map, or gets a position, a depth and a
//! plane in it.

use super::view::{DEPTH_ULPS, Decision, LightPoint, Plane, Receiver, Verdict, View};

/// State of a pixel before any texel is read.
pub(crate) enum MapReceiver {
    /// The pixel is sky, faces away from the light, or lies outside the light's frustum.
    Decided(Verdict),
    /// The pixel needs a lookup in the map.
    Open(OpenReceiver),
}

pub(crate) struct OpenReceiver {
    pub light: LightPoint,
    pub plane: Plane,
    /// Bias subtracted from the receiver's depth, and the bound of its error.
    pub bias: f64,
    pub bias_error: f64,
    /// Change of depth over a texel's world size.
    pub texel_depth: f64,
    /// Visibility of the pixel if an earlier doubtful decision goes the other way.
    otherwise: Option<f64>,
}

impl OpenReceiver {
    /// Adds the doubts of the earlier decisions to the verdict of a lookup.
    pub fn with_doubts(&self, verdict: Verdict) -> Verdict {
        let verdict = self.otherwise.map_or(verdict, |v| verdict.or(v));
        if self.plane.sure { verdict } else { verdict.or(0.0).or(1.0) }
    }

    /// Returns whether any earlier decision is in doubt.
    pub fn is_doubtful(&self) -> bool {
        self.otherwise.is_some() || !self.plane.sure
    }
}

/// Mirror of `mapReceiver` for a pixel, with its two settings.
pub(crate) fn receive(view: &View<'_>, at: [usize; 2], normal_offset: f32, depth_bias: f32) -> MapReceiver {
    match view.receiver(at) {
        Some(r) => receive_point(view, &r, normal_offset, depth_bias),
        None => MapReceiver::Decided(Verdict::sure(1.0)),
    }
}

/// Mirror of `mapReceiver` for any point on a surface.
pub(crate) fn receive_point(view: &View<'_>, r: &Receiver, normal_offset: f32, depth_bias: f32) -> MapReceiver {
    let decided = |v| MapReceiver::Decided(Verdict::sure(v));
    let doubtful = |v: f64| MapReceiver::Decided(Verdict::sure(v).or(1.0 - v));
    let mut otherwise = None;
    match view.faces_light(r) {
        Decision::No => return decided(0.0),
        Decision::Doubtful(false) => return doubtful(0.0),
        Decision::Doubtful(true) => otherwise = Some(0.0),
        Decision::Yes => {}
    }
    let first = view.light_point(r.position, r.position_error);
    match first.inside {
        Decision::No => return decided(1.0),
        Decision::Doubtful(false) => return doubtful(1.0),
        Decision::Doubtful(true) => otherwise = Some(otherwise.unwrap_or(1.0)),
        Decision::Yes => {}
    }
    let (p, error) = view.offset(r, &first, normal_offset.into());
    let light = view.light_point(p, error);
    match light.inside {
        Decision::No => return decided(1.0),
        Decision::Doubtful(false) => return doubtful(1.0),
        Decision::Doubtful(true) => otherwise = Some(otherwise.unwrap_or(1.0)),
        Decision::Yes => {}
    }
    let plane = view.receiver_plane(&light, &Receiver { position: p, position_error: error, ..*r });
    let (slope, slope_error) = (plane.slope / view.map_extent(), plane.error / view.map_extent());
    let factor = f64::from(depth_bias);
    MapReceiver::Open(OpenReceiver {
        bias: DEPTH_ULPS + factor * (slope.abs().x + slope.abs().y),
        bias_error: factor * (slope_error.x + slope_error.y),
        texel_depth: view.texel_depth(&light),
        light,
        plane,
        otherwise,
    })
}
