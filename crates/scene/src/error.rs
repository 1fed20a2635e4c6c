//! What can be wrong with a scene.

/// A scene could not be loaded or used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A file could not be read, or holds something else.
    #[error("{file}: {reason}")]
    Unreadable {
        /// Path.
        file: String,
        /// Why.
        reason: String,
    },
    /// Neither a builtin nor a known file type.
    #[error("{file}: not a scene; expected a .glb, .gltf or .ron file or builtin:NAME")]
    UnknownKind {
        /// Path.
        file: String,
    },
    /// The file is broken or holds what cannot be.
    #[error("{file}: {message}")]
    Content {
        /// Path.
        file: String,
        /// Where in the file, what was found, what would be right.
        message: String,
    },
    /// A RON scene is wrong.
    #[error("{file}:{line}:{column}: {message}{}", .help.as_ref().map(|help| format!("\n  help: {help}")).unwrap_or_default())]
    Ron {
        /// Path.
        file: String,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong.
        message: String,
        /// How to mend it.
        help: Option<String>,
    },
    /// There is no such thing in the scene.
    #[error("{file}: no {what} is called `{name}`; {help}")]
    UnknownName {
        /// Scene.
        file: String,
        /// Kind of thing.
        what: &'static str,
        /// Name asked for.
        name: String,
        /// Nearest or all names.
        help: String,
    },
    /// Nothing to see.
    #[error("{file}: the scene is empty: it has no triangle to draw")]
    Empty {
        /// Path.
        file: String,
    },
}

impl SceneError {
    pub(crate) fn content(file: &str, message: impl Into<String>) -> Self {
        SceneError::Content { file: file.into(), message: message.into() }
    }
}

/// `did you mean ...`, or all names.
pub(crate) fn suggestion(name: &str, known: &[&str]) -> String {
    match lobelia_base::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => "there are none".into(),
        None => format!("there are {}", known.join(", ")),
    }
}
