//! Errors of creating and running passes. Errors of graph *files* are [`crate::problem::Problems`].

use lobelia_shaders::ShaderError;

/// The device could not be had, was lost, or ran out of memory.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// Nothing to run on.
    #[error(
        "no Vulkan, Metal or DX12 adapter was found{}\non Debian or Ubuntu, `cargo xtask render` offers to install Mesa's software driver (package mesa-vulkan-drivers)",
        .wanted.as_ref().map(|name| format!(" whose name contains `{name}`")).unwrap_or_default()
    )]
    NoAdapter {
        /// Name asked for, if any.
        wanted: Option<String>,
    },
    /// The adapter refused a device.
    #[error("adapter `{adapter}` gave no device: {reason}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// The device was lost.
    #[error("the device was lost: {0}")]
    Lost(String),
    /// An allocation failed.
    #[error("out of device memory: {0}")]
    OutOfMemory(String),
    /// The device refused a command. A defect of a pass or of this program.
    #[error("the device refused a command: {0}")]
    Validation(String),
    /// Reading back failed.
    #[error("could not read back from the device: {0}")]
    ReadBack(String),
}

/// What is wrong with the inputs of a pass, found while planning.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct PortError {
    /// The port at fault, if it is one.
    pub port: Option<&'static str>,
    /// What was found and what would do.
    pub message: String,
    /// How to mend it.
    pub help: Option<String>,
}

impl PortError {
    /// An error about one port.
    pub fn at(port: &'static str, message: impl Into<String>) -> Self {
        Self { port: Some(port), message: message.into(), help: None }
    }

    /// An error about several ports or about parameters and ports together.
    pub fn new(message: impl Into<String>) -> Self {
        Self { port: None, message: message.into(), help: None }
    }

    /// Adds how to mend it.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A pass could not be created or bound.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Its shader is wrong.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// The device refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The shader has no such binding.
    #[error("shader `{shader}` has no binding `{name}`{}", .nearest.as_ref().map(|nearest| format!("; did you mean `{nearest}`?")).unwrap_or_default())]
    UnknownBinding {
        /// Shader path.
        shader: String,
        /// Name given.
        name: String,
        /// Closest declared name.
        nearest: Option<String>,
    },
    /// A binding that the shader uses was not given.
    #[error("shader `{shader}`, entry point `{entry}`: binding `{name}` (group {group}) was not given")]
    MissingBinding {
        /// Shader path.
        shader: String,
        /// Entry point.
        entry: String,
        /// Declared name.
        name: String,
        /// Bind group.
        group: u32,
    },
    /// A texture stands where a buffer is declared, or the like.
    #[error("shader `{shader}`: binding `{name}` is {declared}, but was given {given}")]
    BindingKind {
        /// Shader path.
        shader: String,
        /// Declared name.
        name: String,
        /// What the shader declares.
        declared: String,
        /// What the pass gave.
        given: String,
    },
    /// A pass binds an input for writing.
    #[error("shader `{shader}` writes `{name}`, but `{resource}` came through an input port; only outputs may be written")]
    WritesInput {
        /// Shader path.
        shader: String,
        /// Declared name.
        name: String,
        /// `pass.port/part`.
        resource: String,
    },
    /// Anything else, in words.
    #[error("{0}")]
    Other(String),
}

/// A frame could not be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A pass could not be created.
    #[error("pass `{pass}` ({kind}): {source}")]
    Build {
        /// Name in the file.
        pass: String,
        /// Registered name.
        kind: &'static str,
        /// Why.
        source: Box<BuildError>,
    },
    /// A pass asked for what it did not declare.
    #[error("pass `{pass}` reached for `{resource}`, which is not among its declared ports ({declared})")]
    Undeclared {
        /// Name in the file.
        pass: String,
        /// What it asked for.
        resource: String,
        /// What it declared.
        declared: String,
    },
    /// The safety net found numbers that must not be there.
    #[error(
        "pass `{pass}` ({kind}) wrote {non_finite} non-finite and {negative} negative values into `{resource}` in frame {frame}; it is the first to do so"
    )]
    BadValues {
        /// Name in the file.
        pass: String,
        /// Registered name.
        kind: &'static str,
        /// `port/part`.
        resource: String,
        /// Frame index.
        frame: u64,
        /// NaN and infinities.
        non_finite: u64,
        /// Below zero where that is wrong.
        negative: u64,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
    /// Anything else, in words, from a pass.
    #[error("pass `{pass}`: {message}")]
    Pass {
        /// Name in the file.
        pass: String,
        /// What happened.
        message: String,
    },
}
