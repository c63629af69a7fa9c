//! Parameters of the blocker search of area lights.

use crate::technique::{Param, Params};

/// Window in which blockers are searched: `searchWindow` of `glsl/common/hsm.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchWindow {
    /// The papers' window: the cross-section of the pyramid between receiver and light at the light's near plane.
    Near,
    /// The smaller window in which blockers can lie, according to the smallest depth in the papers' window. It still
    /// holds every blocker, and its taps lie denser.
    Blockers,
}

pub(crate) const SEARCH_TAPS: Param =
    Param::odd("search_taps", 1, 63, 9, "taps", "taps of the blocker search along each axis");
pub(crate) const SEARCH: Param = Param::choice(
    "search",
    &["near", "blockers"],
    1,
    "window of the blocker search: up to the light's near plane as in the papers, or as far as the nearest blocker in it allows",
);
pub(crate) const MEAN: Param = Param::choice(
    "mean",
    &["distance", "depth"],
    0,
    "what the blocker search averages: distances from the light, or the map's depths as in the papers; under a sun it is the same",
);

/// Returns true if [`MEAN`] says that the map's depths are averaged.
pub(crate) fn averages_depths(params: &Params) -> bool {
    params.word("mean") == "depth"
}

/// Returns the most rounds of loops that the search of a pixel takes, with `taps` along each axis.
pub(crate) fn rounds(taps: u32) -> u32 {
    100 + 2 * (taps + 1) * (taps + 1)
}

/// Returns the value of [`SEARCH`].
pub(crate) fn search_window(params: &Params) -> SearchWindow {
    if params.word("search") == "near" { SearchWindow::Near } else { SearchWindow::Blockers }
}
