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
