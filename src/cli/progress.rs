//! Progress of long work: a bar on a terminal, a few plain lines elsewhere.

use super::console;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time after which work reports its progress in plain lines.
const PATIENCE: Duration = Duration::from_secs(5);

/// Progress of one piece of work; any thread may report to it.
pub struct Progress {
    what: String,
    bar: Option<ProgressBar>,
    started: Instant,
    /// Number of quarters already announced in plain lines.
    quarters: AtomicU64,
}

impl Progress {
    /// Starts the progress; `what` names the work.
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

    /// Reports that `done` of `total` units are done. Calls may come out of order.
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
            let left = self.started.elapsed().mul_f64((total - done) as f64 / done as f64);
            console::note(format_args!("{}: {} %, {} left", self.what, 25 * quarter, duration(left)));
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

/// Formats a time in seconds, minutes or hours, as precisely as an estimate deserves.
pub fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        ..90.0 => format!("{seconds:.0} s"),
        ..5400.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// The steps of work that is usually quick, shown only on a terminal and only if the work takes longer.
pub struct Steps {
    bar: ProgressBar,
    /// Thread that shows the bar when its time has come, unless the other end of the channel is dropped first.
    timer: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
}

/// Time during which [`Steps`] show nothing.
const AT_ONCE: Duration = Duration::from_secs(2);

impl Steps {
    /// Starts with a step of the given name.
    pub fn start(step: impl Into<Cow<'static, str>>) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{spinner} {msg} ({elapsed})");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.set_message(step);
        let timer = console::is_terminal().then(|| {
            let (sender, receiver) = mpsc::channel();
            let shown = bar.clone();
            let show = move || {
                if receiver.recv_timeout(AT_ONCE) == Err(mpsc::RecvTimeoutError::Timeout) {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                    shown.enable_steady_tick(Duration::from_millis(100));
                }
            };
            (sender, std::thread::spawn(show))
        });
        Self { bar, timer }
    }

    /// Continues with the next step.
    pub fn next(&self, step: impl Into<Cow<'static, str>>) {
        self.bar.set_message(step);
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.timer.take() {
            drop(sender);
            // The thread cannot have panicked: it only waits and draws.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_as_exact_as_estimates_are() {
        let shown = |seconds| duration(Duration::from_secs(seconds));
        assert_eq!(
            [shown(0), shown(89), shown(90), shown(3000), shown(9000)],
            ["0 s", "89 s", "2 min", "50 min", "2.5 h"]
        );
    }
}
