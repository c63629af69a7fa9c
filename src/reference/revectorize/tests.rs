//! Small patterns with values worked out by hand.
