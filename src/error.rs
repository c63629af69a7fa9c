//! The one error type of the crate.

use std::path::PathBuf;

/// Everything that can go wrong. The message says where it went wrong and, where possible, how to fix it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A Vulkan call failed.
    #[error("{call}: {result}")]
    Vulkan {
        /// Name of the call and of the object that it was made for.
        call: String,
        /// The call's result code.
        result: ash::vk::Result,
    },
    /// GPU memory could not be allocated.
    #[error("allocating {what}: {source}")]
    Allocation {
        /// Debug name of the resource.
        what: String,
        /// The allocator's own reason.
        source: gpu_allocator::AllocationError,
    },
    /// There is no Vulkan driver, or no device meets the requirements.
    #[error("{0}")]
    NoDevice(String),
    /// An input that a technique needs is missing or does not fit.
    #[error("{technique}: input {input}: {problem}")]
    Input {
        /// Id of the technique.
        technique: String,
        /// Name of the input.
        input: &'static str,
        /// Description of the problem.
        problem: String,
    },
    /// A parameter has a wrong name or value; the message lists what is allowed.
    #[error("{0}")]
    Parameter(String),
    /// A shader and the host code disagree, or a shader is missing.
    #[error("shader {shader}: {problem}")]
    Shader {
        /// Path under `glsl/`.
        shader: String,
        /// Description of the problem.
        problem: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The content of a file is wrong.
    #[error("{}: {place}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Place in the file in the format's own terms, such as `accessors[3].count`.
        place: String,
        /// Description of the mistake and of its remedy.
        problem: String,
    },
    /// The caller asked for anything else that is not possible.
    #[error("{0}")]
    Usage(String),
}

/// `std::result::Result` with [`Error`] as its error.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Attaches the name of the call to the result of a Vulkan call.
pub(crate) trait VkContext<T> {
    /// `what` names the call and its object.
    fn context(self, what: impl Into<String>) -> Result<T>;
}

impl<T> VkContext<T> for std::result::Result<T, ash::vk::Result> {
    fn context(self, what: impl Into<String>) -> Result<T> {
        self.map_err(|result| Error::Vulkan { call: what.into(), result })
    }
}

/// Message for a name that does not exist. It consists of `problem`, the known name closest to the given one if it is
/// close enough to be a typing error, and all known names after `intro`, which is a phrase such as "there are".
pub fn unknown(problem: &str, given: &str, intro: &str, known: &[&str]) -> String {
    let list = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    let Some(meant) = closest(given, known) else { return format!("{problem}; {intro}: {list}") };
    let (first, rest) = intro.split_at(intro.chars().next().map_or(0, char::len_utf8));
    format!("{problem}; did you mean {meant:?}? {}{rest}: {list}", first.to_uppercase())
}

/// Known name with the fewest typing errors against the given one; at most one error for every three letters counts
/// as close.
fn closest<'k>(given: &str, known: &[&'k str]) -> Option<&'k str> {
    let given: Vec<char> = given.to_lowercase().chars().collect();
    // A text much longer than any name is not a typing error, and the time of the comparison grows with the square of
    // its length.
    let known = known.iter().filter(|k| given.len() <= 2 * k.len());
    let (slips, name) = known.map(|k| (slips(&given, &k.chars().collect::<Vec<_>>()), *k)).min_by_key(|k| k.0)?;
    (slips <= given.len().div_ceil(3)).then_some(name)
}

/// Number of typing errors between two names: letters inserted, left out, replaced or swapped with their neighbour.
/// This is the optimal string alignment distance.
fn slips(a: &[char], b: &[char]) -> usize {
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let other = usize::from(a[i - 1] != b[j - 1]);
                let plain = (rows[i - 1][j] + 1).min(rows[i][j - 1] + 1).min(rows[i - 1][j - 1] + other);
                let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
                if swapped { plain.min(rows[i - 2][j - 2] + 1) } else { plain }
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_told_from_another_word() {
        let known = ["sm", "pcf", "rpcf", "rbsm-star", "shadow-volumes"];
        for (given, meant) in [
            ("pfc", Some("pcf")),
            ("PCF", Some("pcf")),
            ("pcff", Some("pcf")),
            ("rbsmstar", Some("rbsm-star")),
            ("shadow-volume", Some("shadow-volumes")),
            ("sn", Some("sm")),
            ("nope", None),
            ("", None),
            ("castle", None),
        ] {
            assert_eq!(closest(given, &known), meant, "{given}");
        }
        assert_eq!(closest(&"p".repeat(100_000), &known), None);
        assert_eq!(slips(&['a', 'b'], &['b', 'a']), 1);
        assert_eq!(
            unknown("no \"pfc\"", "pfc", "there are", &known[..2]),
            "no \"pfc\"; did you mean \"pcf\"? There are: sm, pcf"
        );
        assert_eq!(unknown("no \"x\"", "xyzz", "it has", &[]), "no \"x\"; it has: none");
    }
}
