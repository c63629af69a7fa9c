//! Errors against the truth, shared by the suites that judge pictures.

use super::driver::*;
use edgeshade::metrics::{Displacement, Report};
use serde_json::Value;

/// Errors of soft shadows, for tables and means.
pub const COLUMNS: [Column; 5] = [
    ("RMSE", "rmse", 4),
    ("in the band", "penumbra_rmse", 4),
    ("MAE", "mae", 4),
    ("over", "over", 4),
    ("under", "under", 4),
];

/// Explanation of these columns.
pub const LEGEND: &str = "`RMSE`, `MAE`: over the judged pixels; `in the band`: RMSE within 8 px of the true penumbra; `over`, \
                          `under`: mean error of being too dark and too light, over the judged pixels";

/// All figures of a report.
pub fn figures(report: &Report) -> Record {
    let of = |d: Displacement| Record::of([("mean", d.mean.into()), ("p95", d.p95.into()), ("max", d.max.into())]);
    let displacement = |d: Option<Displacement>| d.map_or(Value::Null.into(), |d| of(d).into());
    Record::of([
        ("pixels", report.pixels.into()),
        ("rmse", report.rmse.into()),
        ("mae", report.mae.into()),
        ("ssim", report.ssim.into()),
        ("mismatch", report.mismatch.into()),
        ("mismatch_per_boundary", report.mismatch_per_boundary.into()),
        ("boundary_length", report.boundary_length.into()),
        ("over", report.over.into()),
        ("under", report.under.into()),
        ("boundary", displacement(report.boundary)),
        ("boundary_reverse", displacement(report.boundary_reverse)),
        ("false_shadow", report.false_shadow.into()),
        ("false_shadow_share", report.false_shadow_share.into()),
        ("light_leak", report.light_leak.into()),
        ("light_leak_share", report.light_leak_share.into()),
        ("penumbra_rmse", report.penumbra_rmse.into()),
        ("penumbra_pixels", report.penumbra_pixels.into()),
    ])
}

/// The row with the lowest RMSE.
pub fn lowest(rows: &[Row]) -> Option<&Row> {
    let rmse = |r: &Row| r.number("rmse").unwrap_or(f64::INFINITY);
    rows.iter().min_by(|a, b| rmse(a).total_cmp(&rmse(b)))
}
