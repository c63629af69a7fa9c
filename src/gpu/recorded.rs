//! State of a resource after the commands recorded so far have run.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};

/// An image's layout, or whether a result is there; 0 where nothing is known. Frames hold on to what they change, so that
/// it can be forgotten where their commands never run.
///
/// Command buffers are submitted in the order of their recording (part of the contract), so recording time is enough.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorded(Arc<AtomicI32>);

impl Recorded {
    pub fn get(&self) -> i32 {
        self.0.load(Ordering::Relaxed)
    }

    /// Returns what was there before.
    pub fn set(&self, value: i32) -> i32 {
        self.0.swap(value, Ordering::Relaxed)
    }

    /// Resets the state to that before any recording.
    pub fn forget(&self) {
        self.set(0);
    }

    /// True for another handle of the same resource.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
