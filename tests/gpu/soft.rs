//! Penumbrae of an area light: the shared passes and the techniques made of them.

mod auto;
mod classes;
mod fit;
mod ground;
mod hsm;
mod pcss;
mod rbssm;

use edgeshade::view::{LightKind, LightView};

/// The light `factor` times as large.
pub fn enlarged(light: &LightView, factor: f64) -> LightView {
    let kind = match light.kind {
        LightKind::Spot { size } => LightKind::Spot { size: size * factor },
        LightKind::Directional { angle } => LightKind::Directional { angle: angle * factor },
    };
    LightView { kind, ..*light }
}
