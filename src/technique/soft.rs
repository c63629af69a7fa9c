//! What the techniques share that search for an area light's blockers.

use super::{Param, Params};
use crate::pass::soft::SearchWindow;

pub(super) const SEARCH_TAPS: Param =
    Param::odd("search_taps", 1, 63, 9, "taps", "taps of the blocker search along each axis");
pub(super) const SEARCH: Param = Param::choice(
    "search",
    &["near", "blockers"],
    1,
    "window of the blocker search: up to the light's near plane as in the papers, or as far as the nearest blocker in it allows",
);
/// Of those whose pixels are classified first.
pub(super) const SKIP: Param = Param::choice(
    "skip",
    &["auto", "off"],
    0,
    "decide pixels whose whole search window is lit or in shadow by depth bounds of the map: the same image",
);

/// What [`SEARCH`] says.
pub(super) fn search_window(params: &Params) -> SearchWindow {
    if params.word("search") == "near" { SearchWindow::Near } else { SearchWindow::Blockers }
}
