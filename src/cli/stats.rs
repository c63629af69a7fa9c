//! Medians of the passes' times over several frames.

use edgeshade::timing::{FrameTiming, PassTiming, Statistics};
use serde::Serialize;
use std::collections::BTreeMap;

/// Passes that every frame has, whatever the technique.
pub const FRAME_PASSES: [&str; 3] = ["shadow map", "g-buffer", "shade"];

/// Median and range of some times in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Span {
    /// Median and range of `values`; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let (low, high) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        Some(Self { median: 0.5 * (low + high), min, max })
    }
}

/// Times of one pass over all measured frames: an entry of `passes` in the JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassStats {
    pub name: String,
    pub gpu_ms: f64,
    pub gpu_ms_min: f64,
    pub gpu_ms_max: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiles_total: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiles_active: Option<u32>,
    /// Counts of the last frame that has the pass.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub counts: BTreeMap<&'static str, u32>,
    /// Statistics of the last frame that has the pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistics: Option<Statistics>,
}

/// Times of the passes in recording order. A name that occurs twice in a frame gives two entries. A pass that some
/// frames skip is measured over the frames that have it.
pub fn passes(frames: &[FrameTiming]) -> Vec<PassStats> {
    let mut found: Vec<(usize, Vec<&PassTiming>)> = vec![];
    for frame in frames {
        for (i, pass) in frame.passes.iter().enumerate() {
            let repeat = frame.passes[..i].iter().filter(|p| p.name == pass.name).count();
            match found.iter_mut().find(|f| f.0 == repeat && f.1[0].name == pass.name) {
                Some((_, all)) => all.push(pass),
                None => found.push((repeat, vec![pass])),
            }
        }
    }
    let entry = |(_, all): (usize, Vec<&PassTiming>)| {
        let span = Span::of(all.iter().map(|p| p.gpu_ms))?;
        let tiles = all.iter().rev().find_map(|p| p.tiles);
        Some(PassStats {
            name: all[0].name.clone(),
            gpu_ms: span.median,
            gpu_ms_min: span.min,
            gpu_ms_max: span.max,
            tiles_total: tiles.map(|t| t.total),
            tiles_active: tiles.map(|t| t.active),
            counts: all.iter().flat_map(|p| p.counts.iter().copied()).collect(),
            statistics: all.iter().rev().find_map(|p| p.statistics),
        })
    };
    found.into_iter().filter_map(entry).collect()
}

/// Times of whole frames; `None` if the device has no timestamps.
pub fn total(frames: &[FrameTiming]) -> Option<Span> {
    Span::of(timed(frames).map(|f| f.total_gpu_ms))
}

/// Times of the technique's own passes, without shadow map, G-buffer and shading.
pub fn technique(frames: &[FrameTiming]) -> Option<Span> {
    Span::of(timed(frames).map(technique_ms))
}

/// Time of the technique's own passes in one frame, milliseconds.
pub fn technique_ms(frame: &FrameTiming) -> f64 {
    frame.passes.iter().filter(|p| !FRAME_PASSES.contains(&p.name.as_str())).map(|p| p.gpu_ms).sum()
}

fn timed(frames: &[FrameTiming]) -> impl Iterator<Item = &FrameTiming> {
    frames.iter().filter(|f| !f.passes.is_empty())
}

/// A line through points, by least squares.
#[derive(Debug, PartialEq)]
pub struct Fit {
    pub slope: f64,
    pub intercept: f64,
    /// Share of the variance that the line explains.
    pub r2: f64,
}

/// Fits a line; `None` for points that all have the same place.
pub fn fit(points: &[(f64, f64)]) -> Option<Fit> {
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - x, p.1 - y)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|a, _| a * a), sum(&|a, b| a * b), sum(&|_, b| b * b));
    let slope = xy / xx;
    let r2 = if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 };
    (xx > 0.0).then_some(Fit { slope, intercept: y - slope * x, r2 })
}

#[cfg(test)]
mod tests {
    use super::*;
    fn frame(passes: &[(&str, f64)]) -> FrameTiming {
        let pass = |&(name, gpu_ms): &(&str, f64)| PassTiming {
            name: name.into(),
            gpu_ms,
            tiles: None,
            counts: vec![],
            statistics: None,
        };
        FrameTiming { passes: passes.iter().map(pass).collect(), total_gpu_ms: passes.iter().map(|p| p.1).sum() }
    }

    #[test]
    fn medians_are_of_the_middle() {
        assert_eq!(Span::of([]), None);
        assert_eq!(Span::of([3.0, 1.0, 2.0]), Some(Span { median: 2.0, min: 1.0, max: 3.0 }));
        assert_eq!(Span::of([4.0, 1.0, 2.0, 8.0]).map(|s| s.median), Some(3.0));
    }

    #[test]
    fn passes_keep_order_and_repeats() {
        let frames = [
            frame(&[("g-buffer", 5.0), ("blur", 1.0), ("blur", 3.0), ("shade", 1.0)]),
            frame(&[("g-buffer", 7.0), ("blur", 2.0), ("blur", 5.0), ("extra", 9.0), ("shade", 1.0)]),
        ];
        let found: Vec<_> = passes(&frames).into_iter().map(|p| (p.name, p.gpu_ms)).collect();
        let expected = [("g-buffer", 6.0), ("blur", 1.5), ("blur", 4.0), ("shade", 1.0), ("extra", 9.0)];
        assert_eq!(found, expected.map(|(n, t)| (n.to_owned(), t)));
        assert_eq!(technique(&frames).map(|s| (s.min, s.max)), Some((4.0, 16.0)));
        assert_eq!(total(&[FrameTiming::default()]), None);
    }

    #[test]
    fn a_line_is_found_and_noise_lowers_what_it_explains() {
        let exact = fit(&[(0.0, 1.0), (0.5, 2.0), (1.0, 3.0)]).unwrap();
        assert_eq!(exact, Fit { slope: 2.0, intercept: 1.0, r2: 1.0 });
        // The normal equations, solved by hand.
        let noisy = fit(&[(0.0, 1.0), (1.0, 0.5), (2.0, 4.0), (3.0, 3.5)]).unwrap();
        assert!((noisy.slope - 1.1).abs() < 1e-12 && (noisy.intercept - 0.6).abs() < 1e-12, "{noisy:?}");
        assert!((noisy.r2 - 6.05 / 9.25).abs() < 1e-12, "{noisy:?}");
        assert_eq!(fit(&[(1.0, 2.0), (1.0, 3.0)]), None);
    }
}
