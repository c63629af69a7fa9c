//! Verdicts on the papers' claims, from figures alone.

use crate::cli::bench::record::{Field, Row, groups};

/// Answer to a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Yes,
    InPart,
    No,
    /// The differences are no larger than the spread of the times, or nothing was measured.
    CannotTell,
}

impl Verdict {
    pub fn text(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::InPart => "in part",
            Self::No => "no",
            Self::CannotTell => "this device cannot tell",
        }
    }

    /// Yes for all of the cases, no for none of them.
    fn of(holds: usize, cases: usize) -> Self {
        match holds {
            _ if cases == 0 => Self::CannotTell,
            0 => Self::No,
            n if n == cases => Self::Yes,
            _ => Self::InPart,
        }
    }
}

pub const LEGEND: &str = "Claims are judged by the published forms, or the only form that a technique has, cell by cell: `yes` if all cells agree, `no` if none does. An \
                          order is judged by pairs of methods whose printed times differ by more than 10 % of what they add to \
                          shadow mapping, or of the times where that is not printed: `yes` from 90 % of the pairs on, `no` up to \
                          50 %.";

/// A claim of a paper.
pub struct Claim {
    pub source: &'static str,
    pub text: &'static str,
    /// Figure and verdict; `None` if the rows lack what is needed.
    pub judge: fn(&[Row]) -> Option<(String, Verdict)>,
}

/// Rows of the paper's own form, or of a method that has only one.
fn published<'r>(rows: &'r [Row], method: &str) -> Option<&'r Row> {
    let mine = || rows.iter().filter(|r| r.text("method") == method);
    mine().find(|r| r.text("form") == "published").or_else(|| mine().next())
}

/// Groups of rows with times, which are compared with each other.
fn timed(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    groups(rows).filter(|g| g[0].number("total_gpu_ms").is_some())
}

/// Groups of rows with errors.
fn judged(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    groups(rows).filter(|g| g[0].number("rmse").is_some())
}

/// Text with the least and the largest of some figures.
fn range(values: &[f64], digits: usize) -> String {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    format!("{low:.digits$} to {high:.digits$}")
}

/// Pairs of methods in each cell of a table: whether the one that costs more in print costs more here.
pub fn order(rows: &[Row]) -> Option<(String, Verdict)> {
    let (mut same, mut pairs) = (0, 0);
    for group in timed(rows) {
        let mut methods: Vec<&str> = vec![];
        for row in group {
            let name = row.text("method");
            if name != "SM" && !methods.contains(&name) {
                methods.push(name);
            }
        }
        let places: Vec<(f64, f64)> = methods
            .iter()
            .filter_map(|m| {
                let row = published(group, m)?;
                let printed = row.number("paper_added_ms").or(row.number("paper_ms"))?;
                // The papers print whole frames.
                Some((printed, row.number("frame_ratio")?))
            })
            .collect();
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                if (a.0 - b.0).abs() > 0.1 * a.0.max(b.0) {
                    pairs += 1;
                    same += usize::from((a.0 > b.0) == (a.1 > b.1));
                }
            }
        }
    }
    let verdict = match 100 * same {
        s if s >= 90 * pairs => Verdict::Yes,
        s if s <= 50 * pairs => Verdict::No,
        _ => Verdict::InPart,
    };
    (pairs > 0).then(|| (format!("{same} of {pairs} pairs"), verdict))
}

/// Ratios of a figure of two methods, cell by cell.
fn ratios(rows: &[Row], table: &str, [mine, other]: [&str; 2], figure: &str) -> Vec<f64> {
    let cells = timed(rows).filter(|g| g[0].text("table").starts_with(table));
    cells.filter_map(|g| Some(published(g, mine)?.number(figure)? / published(g, other)?.number(figure)?)).collect()
}

pub fn rbsm_adds(rows: &[Row]) -> Option<(String, Verdict)> {
    let cells = timed(rows).filter(|g| ["table 2", "table 3"].contains(&g[0].text("table")));
    let added: Vec<f64> =
        cells.filter_map(|g| Some(100.0 * (published(g, "RBSM, optimized")?.number("frame_ratio")? - 1.0))).collect();
    let within = added.iter().filter(|a| (6.0..=30.0).contains(*a)).count();
    (!added.is_empty()).then(|| (format!("{} %", range(&added, 1)), Verdict::of(within, added.len())))
}

/// The spread of the times decides whether one per cent can be told.
pub fn branches_cost_more(rows: &[Row]) -> Option<(String, Verdict)> {
    let (mut ratios, mut spreads) = (vec![], vec![]);
    for group in timed(rows) {
        let (Some(a), Some(b)) = (published(group, "RBSM, optimized"), published(group, "RBSM, not optimized")) else {
            continue;
        };
        for row in [a, b] {
            let [low, median, high] = ["gpu_ms_min", "gpu_ms", "gpu_ms_max"].map(|name| row.number(name));
            spreads.push((high? - low?) / median?);
        }
        ratios.push(b.number("gpu_ms_min")? / a.number("gpu_ms_min")?);
    }
    if ratios.is_empty() {
        return None;
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let spread = spreads.iter().sum::<f64>() / spreads.len() as f64;
    let verdict = match mean - 1.0 {
        // A single frame has no spread.
        d if d.abs() < spread || spread == 0.0 => Verdict::CannotTell,
        d if d > 0.0 => Verdict::Yes,
        _ => Verdict::No,
    };
    let text = format!(
        "the branches take {mean:.3} times as long ({}); times spread by {:.1} %",
        range(&ratios, 2),
        100.0 * spread
    );
    Some((text, verdict))
}

pub fn edtsm_star_overtakes(rows: &[Row]) -> Option<(String, Verdict)> {
    let cells = timed(rows).filter(|g| g[0].text("table") == "table 3");
    let found: Vec<(f64, f64)> = cells
        .filter_map(|g| {
            let [mine, pcf] = [published(g, "EDTSM*")?.number("added_ms")?, published(g, "PCF")?.number("added_ms")?];
            // Less than nothing is noise.
            (mine > 0.0 && pcf > 0.0).then_some((g[0].number("amount")?, mine / pcf))
        })
        .collect();
    let text: Vec<_> = found.iter().map(|(kernel, ratio)| format!("{kernel}: {ratio:.2}")).collect();
    let wide: Vec<_> = found.iter().filter(|f| f.0 >= 23.0).collect();
    let holds = wide.iter().filter(|f| f.1 < 1.0).count();
    let text = format!("adds, by what PCF adds, by kernel: {}", text.join(", "));
    (!wide.is_empty()).then(|| (text, Verdict::of(holds, wide.len())))
}

pub fn edt_is_bottleneck(rows: &[Row]) -> Option<(String, Verdict)> {
    let mut shares: Vec<[f64; 3]> = vec![];
    for group in timed(rows).filter(|g| g[0].text("table") == "tables 2 and 4") {
        let Field::Passes(passes) = published(group, "EDTSM*")?.fields.get("passes") else { return None };
        let sum =
            |is_of: &dyn Fn(&str) -> bool| passes.iter().filter(|p| is_of(&p.name)).map(|p| p.gpu_ms).sum::<f64>();
        let revectorize = sum(&|n| n.starts_with("revectorize") || n == "depth bounds");
        let filter = sum(&|n| n.starts_with("mean filter"));
        let own = sum(&|n| !["shadow map", "g-buffer", "shade"].contains(&n));
        shares.push([revectorize, own - revectorize - filter, filter].map(|ms| 100.0 * ms / own));
    }
    let largest = shares.iter().filter(|[a, b, c]| b > a && b > c).count();
    let of = |i: usize| range(&shares.iter().map(|s| s[i]).collect::<Vec<_>>(), 0);
    let text = format!("RBSM {} %, distances {} %, filter {} % of its passes", of(0), of(1), of(2));
    (!shares.is_empty()).then(|| (text, Verdict::of(largest, shares.len())))
}

pub fn rpcf_is_slowest(rows: &[Row]) -> Option<(String, Verdict)> {
    let slowest = |g: &[Row]| {
        let mine = published(g, "RPCF")?.number("added_ms")?;
        let others = ["Prefiltering", "PCF", "EDTSM", "EDTSM*"];
        let most = others.iter().filter_map(|m| published(g, m)?.number("added_ms")).fold(f64::NEG_INFINITY, f64::max);
        Some(mine > most)
    };
    let cells: Vec<bool> = timed(rows).filter_map(slowest).collect();
    let holds = cells.iter().filter(|c| **c).count();
    (!cells.is_empty()).then(|| (format!("in {holds} of {} cells", cells.len()), Verdict::of(holds, cells.len())))
}

pub fn rbssm_errs_least(rows: &[Row]) -> Option<(String, Verdict)> {
    lowest(rows, "RBSSM", "")
}

pub fn edsm_errs_least(rows: &[Row]) -> Option<(String, Verdict)> {
    // The thesis finds silhouette maps almost identical.
    lowest(rows, "EDSM", "SSSM")
}

/// Cells in which a method has the lowest RMSE of all published forms, but for one method.
fn lowest(rows: &[Row], method: &str, but_for: &str) -> Option<(String, Verdict)> {
    let is_lowest = |g: &[Row]| {
        let mine = published(g, method)?.number("rmse")?;
        let others = g.iter().filter(|r| ![method, but_for].contains(&r.text("method")));
        let others = others.filter_map(|r| published(g, r.text("method"))?.number("rmse"));
        Some((g[0].text("scene").to_owned(), mine, others.fold(f64::INFINITY, f64::min)))
    };
    let cells: Vec<_> = judged(rows).filter_map(is_lowest).collect();
    let holds = cells.iter().filter(|c| c.1 <= c.2).count();
    let text: Vec<_> =
        cells.iter().map(|(scene, mine, other)| format!("{scene}: {mine:.4}, best other {other:.4}")).collect();
    (!cells.is_empty()).then(|| (text.join("; "), Verdict::of(holds, cells.len())))
}

pub fn ssrbssm_is_faster(rows: &[Row]) -> Option<(String, Verdict)> {
    let all = ratios(rows, "figure", ["RBSSM", "SSRBSSM"], "total_gpu_ms");
    let holds = all.iter().filter(|r| (2.0..=4.0).contains(*r)).count();
    (!all.is_empty())
        .then(|| (format!("RBSSM's frames take {} times as long", range(&all, 2)), Verdict::of(holds, all.len())))
}

/// Growth of each method's own passes from the smallest map to the largest.
pub fn prefiltering_grows(rows: &[Row]) -> Option<(String, Verdict)> {
    let cells: Vec<_> = timed(rows).filter(|g| g[0].text("table") == "table I").collect();
    let mut scenes: Vec<&str> = cells.iter().map(|g| g[0].text("scene")).collect();
    scenes.dedup();
    let (mut texts, mut holds) = (vec![], 0);
    for scene in &scenes {
        let mine: Vec<_> = cells.iter().filter(|g| g[0].text("scene") == *scene).collect();
        let (first, last) = (mine.first()?, mine.last()?);
        let growth =
            |method| Some(published(last, method)?.number("gpu_ms")? / published(first, method)?.number("gpu_ms")?);
        let [vssm, mssm, edtssm] = ["VSSM", "MSSM", "EDTSSM"].map(growth);
        let (vssm, mssm, edtssm) = (vssm?, mssm?, edtssm?);
        holds += usize::from(vssm.min(mssm) > 1.5 && edtssm < 1.5);
        texts.push(format!("{scene}: VSSM {vssm:.1}, MSSM {mssm:.1}, EDTSSM {edtssm:.1} times"));
    }
    (!scenes.is_empty()).then(|| (texts.join("; "), Verdict::of(holds, scenes.len())))
}

pub fn volumes_are_slowest(rows: &[Row]) -> Option<(String, Verdict)> {
    let mut all = vec![];
    for other in ["SSSM", "EDSM", "PCF"] {
        all.extend(ratios(rows, "figure 5.2", ["Shadow volumes", other], "total_gpu_ms"));
    }
    let holds = all.iter().filter(|r| **r > 1.0).count();
    (!all.is_empty()).then(|| {
        (format!("their frames take {} times as long as the others'", range(&all, 2)), Verdict::of(holds, all.len()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::record::Record;

    fn row(method: &str, table: &str, figures: &[(&'static str, f64)]) -> Row {
        let place = Record::of([("table", table.into()), ("method", method.into()), ("form", "published".into())]);
        let figures = figures.iter().map(|&(name, value)| (name, value.into()));
        Row::new(method, table, place.and([("scene", "a".into()), ("total_gpu_ms", 1.0.into())]).and(figures))
    }

    #[test]
    fn an_order_is_kept_turned_over_or_mixed() {
        let cell = |here: [f64; 3]| {
            let printed = [1.0, 2.0, 4.0];
            let names = ["A", "B", "C"];
            let rows: Vec<_> = (0..3)
                .map(|i| row(names[i], "t", &[("paper_added_ms", printed[i]), ("frame_ratio", here[i])]))
                .collect();
            order(&rows).unwrap()
        };
        assert_eq!(cell([1.0, 3.0, 5.0]), ("3 of 3 pairs".into(), Verdict::Yes));
        assert_eq!(cell([5.0, 3.0, 1.0]), ("0 of 3 pairs".into(), Verdict::No));
        assert_eq!(cell([3.0, 1.0, 5.0]), ("2 of 3 pairs".into(), Verdict::InPart));
        assert_eq!(order(&[row("A", "t", &[("frame_ratio", 1.0)])]), None);
    }

    #[test]
    fn one_per_cent_needs_times_that_spread_less() {
        let rows = |branches: f64, spread: f64| {
            let times = |ms: f64| [("gpu_ms_min", ms), ("gpu_ms", ms), ("gpu_ms_max", ms * (1.0 + spread))];
            [row("RBSM, optimized", "table 2", &times(1.0)), row("RBSM, not optimized", "table 2", &times(branches))]
        };
        assert_eq!(branches_cost_more(&rows(1.01, 0.001)).unwrap().1, Verdict::Yes);
        assert_eq!(branches_cost_more(&rows(0.9, 0.001)).unwrap().1, Verdict::No);
        assert_eq!(branches_cost_more(&rows(1.01, 0.2)).unwrap().1, Verdict::CannotTell);
    }

    #[test]
    fn rbsm_adds_what_the_paper_says_or_not() {
        let rows =
            |ratio: f64| [row("SM", "table 2", &[]), row("RBSM, optimized", "table 2", &[("frame_ratio", ratio)])];
        assert_eq!(rbsm_adds(&rows(1.1)), Some(("10.0 to 10.0 %".into(), Verdict::Yes)));
        assert_eq!(rbsm_adds(&rows(1.5)).unwrap().1, Verdict::No);
        assert_eq!(rbsm_adds(&[]), None);
    }

    #[test]
    fn the_lowest_error_is_that_of_the_method() {
        let errors = |mine: f64| {
            [
                row("RBSSM", "e", &[("rmse", mine)]),
                row("PCSS", "e", &[("rmse", 0.2)]),
                row("MSSM", "e", &[("rmse", 0.3)]),
            ]
        };
        assert_eq!(rbssm_errs_least(&errors(0.1)).unwrap().1, Verdict::Yes);
        assert_eq!(rbssm_errs_least(&errors(0.25)).unwrap().1, Verdict::No);
    }
}
