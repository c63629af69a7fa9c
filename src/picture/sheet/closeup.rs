//! Choice of the parts of the pictures to show magnified.

use super::Row;
use crate::picture::{
    Picture,
    color::{NOT_JUDGED, false_color},
};

/// Weight of the detail in the first picture, relative to the disagreement of the techniques. Where they agree, the
/// detail decides. Where they disagree, it favours shadow boundaries.
const CONTENT_WEIGHT: f64 = 0.25;

/// Smallest score, relative to the best window's, at which a distant window is preferred as the second one. A distant
/// window shows something else.
const FAR_ENOUGH: f64 = 0.6;

/// Finds up to two windows of the pictures that do not overlap, as left, top, width, height.
///
/// The score is mainly how much the difference between the techniques, or their error, *varies* in a window: a
/// misplaced boundary varies, a uniformly wrong area does not. Detail in the first picture, which should be the truth,
/// adds to the score with a smaller weight. The choice depends on the pictures alone. A window has sides of `side_px`,
/// or of the picture if that is smaller.
pub fn choose_closeups(rows: &[Row], side_px: u32) -> Vec<[u32; 4]> {
    let Some(first) = rows.first() else { return Vec::new() };
    let size = first.full.size;
    let window = size.map(|s| s.min(side_px));
    if window.contains(&0) {
        return Vec::new();
    }
    let blocks = Blocks::new(rows, window);
    let mut scored = blocks.score_windows();
    // Ties go to the upper left window, so that the choice is reproducible.
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    let Some(best) = scored.first().map(|s| s.at) else { return Vec::new() };
    let apart = |at: [u32; 2], times: u32| (0..2).any(|k| at[k].abs_diff(best[k]) >= times * window[k]);
    let good_enough = scored[0].score * FAR_ENOUGH;
    let far = scored.iter().find(|s| apart(s.at, 4) && s.score >= good_enough);
    let second = far.or_else(|| scored.iter().find(|s| apart(s.at, 1)));
    std::iter::once(best).chain(second.map(|s| s.at)).map(|at| [at[0], at[1], window[0], window[1]]).collect()
}

struct Scored {
    at: [u32; 2],
    score: f64,
}

/// Sums over square blocks, from which windows are composed.
struct Blocks {
    /// Side of a block, pixels.
    step: u32,
    /// Number of whole blocks in the picture.
    count: [u32; 2],
    /// Number of blocks in a window.
    window: [u32; 2],
    /// Sums of the pixels' differences, squared differences, contents and squared contents.
    sums: Vec<[f64; 4]>,
}

impl Blocks {
    fn new(rows: &[Row], window: [u32; 2]) -> Self {
        let size = rows[0].full.size;
        let step = (window[0].min(window[1]) / 8).max(1);
        let count = size.map(|s| s / step);
        let mut sums = vec![[0.0; 4]; count[0] as usize * count[1] as usize];
        for y in 0..count[1] * step {
            for x in 0..count[0] * step {
                let i = y as usize * size[0] as usize + x as usize;
                let (difference, content) = (difference(rows, i), luma(rows[0].full, i));
                let block = &mut sums[(y / step) as usize * count[0] as usize + (x / step) as usize];
                let terms = [difference, difference * difference, content, content * content];
                (0..4).for_each(|k| block[k] += terms[k]);
            }
        }
        Self { step, count, window: window.map(|w| w / step), sums }
    }

    fn score_windows(&self) -> Vec<Scored> {
        let mut scored = Vec::new();
        for top in 0..=self.count[1] - self.window[1] {
            for left in 0..=self.count[0] - self.window[0] {
                let mut sum = [0.0; 4];
                for y in top..top + self.window[1] {
                    let row = y as usize * self.count[0] as usize;
                    for block in &self.sums[row + left as usize..row + (left + self.window[0]) as usize] {
                        (0..4).for_each(|k| sum[k] += block[k]);
                    }
                }
                let pixels = f64::from(self.window[0] * self.window[1]) * f64::from(self.step * self.step);
                let deviation = |sum: f64, squares: f64| {
                    let mean = sum / pixels;
                    (squares / pixels - mean * mean).max(0.0).sqrt()
                };
                let score = deviation(sum[0], sum[1]) + CONTENT_WEIGHT * deviation(sum[2], sum[3]);
                scored.push(Scored { at: [left * self.step, top * self.step], score });
            }
        }
        scored
    }
}

/// Returns the mean over the pictures of the larger of error and difference to the first picture, in `[0, 1]`.
fn difference(rows: &[Row], i: usize) -> f64 {
    let first = luma(rows[0].full, i);
    let one = |row: &Row| (luma(row.full, i) - first).abs().max(row.error.map_or(0.0, |e| error_strength(e.rgb[i])));
    rows.iter().map(one).sum::<f64>() / rows.len() as f64
}

/// Returns the distance of an error colour from the colour of no error.
fn error_strength(color: [u8; 3]) -> f64 {
    if color == NOT_JUDGED {
        return 0.0;
    }
    let none = false_color(0.0);
    let farthest = (0..3).map(|c| color[c].abs_diff(none[c])).max().unwrap_or(0);
    f64::from(farthest) / 255.0
}

/// Returns the approximate perceived brightness: the weights of Rec. 709 on the encoded values.
fn luma(picture: &Picture, i: usize) -> f64 {
    let [r, g, b] = picture.rgb[i].map(|c| f64::from(c) / 255.0);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}
