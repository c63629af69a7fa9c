//! The search for what blocks an area light: its parameters.

use crate::technique::{Param, Params};

/// Window in which blockers are searched: `searchWindow` of `glsl/common/hsm.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchWindow {
    /// The papers' window, which the light's near plane cuts out of the pyramid between receiver and light.
    Near,
    /// The part of it where blockers can be, by its smallest depth: it still holds every blocker, under denser taps.
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
/// Value of [`SEARCH`].
pub(crate) fn search_window(params: &Params) -> SearchWindow {
    if params.word("search") == "near" { SearchWindow::Near } else { SearchWindow::Blockers }
}
