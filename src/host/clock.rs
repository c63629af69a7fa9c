//! Choice of the clock that times passes, and timing of single passes by the host's clock.

use super::Host;
use crate::timing::{FrameTiming, PassTiming};
use crate::{Error, Result};
use ash::vk;

/// Clock that the times of passes come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Timing {
    /// The GPU's timestamps before and after each pass, all in one submission.
    #[default]
    Timestamps,
    /// The host's clock. Each pass is submitted alone, and the time spans its submission and the wait for it.
    Wall,
}

/// Time of one submission by the host's clock.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Span {
    /// Name of the pass; `None` for the commands between passes.
    pub pass: Option<String>,
    /// Milliseconds from submitting to the end of the wait.
    pub ms: f64,
}

/// Share of the time that timestamps may miss before they are doubted.
const UNSEEN: f64 = 0.01;

/// Smallest share of a pass's time that its timestamps may show. A smaller share cannot be explained by the pass
/// having run faster this time.
const SEEN: f64 = 0.25;

/// Returns true if the passes' timestamps add up to nearly all of a frame's time, both by the frame's own timestamps
/// and by the host's clock. Frames of a fast GPU may fail this as well, because waking up the host takes as long as
/// they do.
pub(super) fn accounts_for(frame: &FrameTiming, host_ms: f64) -> bool {
    let seen: f64 = frame.passes.iter().map(|p| p.gpu_ms).sum();
    seen >= (1.0 - UNSEEN) * frame.total_gpu_ms.max(host_ms)
}

/// Returns true if the timestamps of a frame agree with the host's clock around the same passes, apart from the
/// overhead of a submission. The shortest submission has little else to do and so measures this overhead.
pub(super) fn agree(frame: &FrameTiming, spans: &[Span]) -> bool {
    let submission = spans.iter().map(|s| s.ms).fold(f64::INFINITY, f64::min);
    let passes: Vec<f64> = spans.iter().filter(|s| s.pass.is_some()).map(|s| s.ms).collect();
    if frame.passes.is_empty() {
        return passes.is_empty();
    }
    let both = passes.iter().zip(&frame.passes);
    let unseen = both.filter(|(ms, pass)| pass.gpu_ms < SEEN * **ms).map(|(ms, pass)| ms - submission - pass.gpu_ms);
    unseen.sum::<f64>() <= UNSEEN * passes.iter().sum::<f64>() + 2.0 * submission * passes.len() as f64
}

/// The frame with its times replaced by those of the host's clock. Tiles, counts and statistics stay. As with
/// timestamps, the total reaches from before the first pass until after the last.
pub(super) fn by_wall_clock(frame: FrameTiming, spans: &[Span]) -> FrameTiming {
    let is_pass = |s: &Span| s.pass.is_some();
    let (first, last) = (spans.iter().position(is_pass), spans.iter().rposition(is_pass));
    let within = first.zip(last).map_or(&[][..], |(first, last)| &spans[first..=last]);
    let mut counted = frame.passes.into_iter();
    let mut pass = |name: &String, ms: f64| match counted.next() {
        Some(pass) => PassTiming { gpu_ms: ms, ..pass },
        // The device has no timestamps, or the pass lies beyond `timing::MAX_PASSES`.
        None => PassTiming { name: name.clone(), gpu_ms: ms, tiles: None, counts: vec![], statistics: None },
    };
    FrameTiming {
        passes: within.iter().filter_map(|s| Some(pass(s.pass.as_ref()?, s.ms))).collect(),
        total_gpu_ms: within.iter().map(|s| s.ms).sum(),
    }
}

/// Cuts a frame into one submission for each pass and one for the commands between two passes, and waits for each.
pub(super) struct Clock<'h> {
    host: &'h Host,
    /// All command buffers so far, to be freed at the end; the last one is recording.
    pub commands: Vec<vk::CommandBuffer>,
    /// The pass that is being recorded.
    pass: Option<String>,
    pub spans: Vec<Span>,
    /// The first failure. After it the frame is recorded to its end but no longer submitted.
    pub error: Option<Error>,
}

impl<'h> Clock<'h> {
    pub fn new(host: &'h Host, first: vk::CommandBuffer) -> Self {
        Self { host, commands: vec![first], pass: None, spans: vec![], error: None }
    }

    /// Runs the commands recorded so far. `pass` names the pass that follows; `None` means commands between passes.
    /// Returns the command buffer to continue with, which is recording even after an error.
    pub fn cut(&mut self, pass: Option<&str>) -> vk::CommandBuffer {
        let current = self.commands[self.commands.len() - 1];
        if self.error.is_some() {
            return current;
        }
        let next = match self.host.begin() {
            Ok(next) => next,
            Err(error) => {
                self.error = Some(error);
                return current;
            }
        };
        self.commands.push(next);
        match self.host.submit(current) {
            Ok(ms) => self.spans.push(Span { pass: self.pass.take(), ms }),
            Err(error) => self.error = Some(error),
        }
        self.pass = pass.map(str::to_owned);
        next
    }

    /// Runs the last piece. Returns the first error of the whole frame.
    pub fn finish(&mut self) -> Result<()> {
        let last = self.commands[self.commands.len() - 1];
        match self.error.take() {
            Some(error) => Err(error),
            None => self.host.submit(last).map(|ms| self.spans.push(Span { pass: self.pass.take(), ms })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(total_gpu_ms: f64, passes: &[(&str, f64)]) -> FrameTiming {
        let pass = |&(name, gpu_ms): &(&str, f64)| PassTiming {
            name: name.into(),
            gpu_ms,
            tiles: None,
            counts: vec![("edges", 7)],
            statistics: None,
        };
        FrameTiming { passes: passes.iter().map(pass).collect(), total_gpu_ms }
    }

    fn spans(spans: &[(&str, f64)]) -> Vec<Span> {
        let span = |&(name, ms): &(&str, f64)| Span { pass: (!name.is_empty()).then(|| name.into()), ms };
        spans.iter().map(span).collect()
    }

    #[test]
    fn timestamps_account_for_a_frame_or_miss_some_of_it() {
        let fine = frame(100.5, &[("shadow map", 40.0), ("pcf", 60.0)]);
        assert!(accounts_for(&fine, 100.9));
        // The host's clock shows that something is missing.
        assert!(!accounts_for(&fine, 150.0));
        // Behaviour of Mesa 25's CPU driver: raster passes are timed, compute passes are not, and the total is right.
        let compute_unseen = frame(355.0, &[("shadow map", 49.0), ("g-buffer", 216.0), ("pcf", 0.4)]);
        assert!(!accounts_for(&compute_unseen, 0.0));
        // A device without timestamps.
        assert!(!accounts_for(&FrameTiming::default(), 1.0));
    }

    #[test]
    fn submissions_of_a_fast_gpu_take_longer_than_its_passes() {
        let fast = frame(0.5, &[("shadow map", 0.05), ("pcf", 0.02)]);
        let cut = spans(&[("", 0.08), ("shadow map", 0.2), ("", 0.09), ("pcf", 0.15), ("", 0.08)]);
        assert!(!accounts_for(&fast, 0.3) && agree(&fast, &cut));
    }

    #[test]
    fn passes_that_timestamps_do_not_see_disagree() {
        let blind = frame(355.0, &[("shadow map", 49.0), ("g-buffer", 216.0), ("pcf", 0.4)]);
        let cut = spans(&[("shadow map", 60.1), ("", 0.1), ("g-buffer", 216.1), ("", 0.1), ("pcf", 89.0)]);
        assert!(!agree(&blind, &cut));
        // The same driver with a small frame.
        let small = frame(3.0, &[("shadow map", 0.5), ("pcf", 0.03), ("shade", 0.03)]);
        let cut = spans(&[("shadow map", 0.6), ("", 0.05), ("pcf", 1.4), ("", 0.05), ("shade", 1.0)]);
        assert!(!agree(&small, &cut) && !agree(&FrameTiming::default(), &cut));
        // A busy machine: all passes take longer, and the timestamps saw all of them.
        let slower = spans(&[("shadow map", 1.0), ("", 0.05), ("pcf", 0.09), ("", 0.05), ("shade", 0.1)]);
        assert!(agree(&small, &slower));
    }

    #[test]
    fn the_wall_clock_replaces_the_times_alone() {
        let stamped = frame(9.0, &[("sm", 0.1), ("shade", 0.2)]);
        let cut = spans(&[("", 50.0), ("sm", 3.0), ("", 0.5), ("shade", 4.0), ("", 60.0)]);
        let expected = frame(7.5, &[("sm", 3.0), ("shade", 4.0)]);
        assert_eq!(by_wall_clock(stamped, &cut), expected);
        // Without timestamps the names and times come from the submissions.
        let bare = by_wall_clock(FrameTiming::default(), &cut);
        assert_eq!(
            bare.passes.iter().map(|p| (&p.name[..], p.gpu_ms)).collect::<Vec<_>>(),
            [("sm", 3.0), ("shade", 4.0)]
        );
        assert_eq!(by_wall_clock(FrameTiming::default(), &cut[..1]), FrameTiming::default());
    }
}
