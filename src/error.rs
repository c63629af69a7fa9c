//! One error type for the whole crate.

use std::path::PathBuf;

/// What can go wrong. The message names the place and, where there is one, the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A Vulkan call failed.
    #[error("{call}: {result}")]
    Vulkan {
        /// Which call, and on what.
        call: String,
        /// What it returned.
        result: ash::vk::Result,
    },
    /// GPU memory could not be had.
    #[error("allocating {what}: {source}")]
    Allocation {
        /// Debug name of the resource.
        what: String,
        /// The allocator's own reason.
        source: gpu_allocator::AllocationError,
    },
    /// No Vulkan driver, or none that is good enough.
    #[error("{0}")]
    NoDevice(String),
    /// An input that a technique needs was not given, or does not fit.
    #[error("{technique}: input {input}: {problem}")]
    Input {
        /// Id of the technique.
        technique: String,
        /// Name of the input.
        input: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// A wrong parameter name or value; the message lists what is allowed.
    #[error("{0}")]
    Parameter(String),
    /// A shader and the host code disagree, or a shader is missing.
    #[error("shader {shader}: {problem}")]
    Shader {
        /// Its path under `glsl/`.
        shader: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's own reason.
        source: std::io::Error,
    },
    /// A file's content is wrong.
    #[error("{}: {place}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Where in the file, in the format's own terms: `accessors[3].count`.
        place: String,
        /// What is wrong, and what would help.
        problem: String,
    },
    /// Anything else that the caller asked for and cannot have.
    #[error("{0}")]
    Usage(String),
}

/// `std::result::Result` with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Attaches the name of the call to a Vulkan result.
pub(crate) trait VkContext<T> {
    /// `what` names the call and its object.
    fn context(self, what: impl Into<String>) -> Result<T>;
}

impl<T> VkContext<T> for std::result::Result<T, ash::vk::Result> {
    fn context(self, what: impl Into<String>) -> Result<T> {
        self.map_err(|result| Error::Vulkan { call: what.into(), result })
    }
}

/// The message for a name that does not exist: `problem`, the known name that is closest to the given one if one is close
/// enough to be a slip of the pen, and all known names after `intro`, such as "there are".
pub fn unknown(problem: &str, given: &str, intro: &str, known: &[&str]) -> String {
    let list = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    let Some(meant) = closest(given, known) else { return format!("{problem}; {intro}: {list}") };
    let (first, rest) = intro.split_at(intro.chars().next().map_or(0, char::len_utf8));
    format!("{problem}; did you mean {meant:?}? {}{rest}: {list}", first.to_uppercase())
}

/// The known name with the fewest slips from the given one, at most one for every three letters.
fn closest<'k>(given: &str, known: &[&'k str]) -> Option<&'k str> {
    let given: Vec<char> = given.to_lowercase().chars().collect();
    // A text much longer than any name is no slip of the pen, and comparing takes time by the square of its length.
    let known = known.iter().filter(|k| given.len() <= 2 * k.len());
    let (slips, name) = known.map(|k| (slips(&given, &k.chars().collect::<Vec<_>>()), *k)).min_by_key(|k| k.0)?;
    (slips <= given.len().div_ceil(3)).then_some(name)
}

/// Letters put in, left out, exchanged for another or swapped with their neighbour: the optimal string alignment distance.
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
