//! State of a resource after the commands recorded so far have run.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};

/// State such as an image's layout, or a flag that a result exists; 0 means unknown. Frames keep handles to the states
/// that they change, so that these can be reset if the commands never run.
///
/// The contract demands that command buffers are submitted in the order of their recording. It therefore suffices to
/// track the state when commands are recorded.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorded(Arc<AtomicI32>);

impl Recorded {
    pub fn get(&self) -> i32 {
        self.0.load(Ordering::Relaxed)
    }

    /// Returns the previous value.
    pub fn set(&self, value: i32) -> i32 {
        self.0.swap(value, Ordering::Relaxed)
    }

    /// Resets the state to that before any recording.
    pub fn forget(&self) {
        self.set(0);
    }

    /// True if both are handles to the same state.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
