//! Progress of long work: a bar on a terminal, a few plain lines elsewhere.

use super::console;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Plain lines come only from work that takes longer than this.
const PATIENCE: Duration = Duration::from_secs(5);

/// Work under way; may be told from any thread.
pub struct Progress {
    what: String,
    bar: Option<ProgressBar>,
    started: Instant,
    /// Quarters already announced in plain lines.
    quarters: AtomicU64,
}

impl Progress {
    /// Begins; `what` names the work.
    pub fn start(what: impl Into<String>) -> Self {
        let what = what.into();
        let bar = console::is_terminal().then(|| {
            let style = ProgressStyle::with_template("{msg} {bar:32} {percent:>3} %, {eta} left");
            let bar = ProgressBar::new(0).with_message(what.clone());
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { what, bar, started: Instant::now(), quarters: AtomicU64::new(0) }
    }

    /// `done` of `total` are done. Calls may come out of order.
    pub fn set(&self, done: u64, total: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(total);
            bar.set_position(done.max(bar.position()));
            return;
        }
        let quarter = 4 * done / total.max(1);
        if quarter > 0
            && quarter < 4
            && self.started.elapsed() > PATIENCE
            && self.quarters.fetch_max(quarter, Ordering::Relaxed) < quarter
        {
            console::note(format_args!("{}: {} %", self.what, 25 * quarter));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
