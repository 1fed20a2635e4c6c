//! What is wrong with a graph: every problem with its place in the file, all listed at once.

use std::{fmt, ops::Range};

/// One problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What is wrong, with pass, port and types where they play a part.
    pub message: String,
    /// Bytes of the file that are at fault; `None` for the command line.
    pub span: Option<Range<usize>>,
    /// How to mend it.
    pub help: Option<String>,
    /// A second place, with what stands there.
    pub other: Option<(Range<usize>, String)>,
}

impl Problem {
    /// A problem at a place in the file.
    pub fn at(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span: Some(span), help: None, other: None }
    }

    /// A problem that came from the command line.
    pub fn on_command_line(message: impl Into<String>) -> Self {
        Self { message: message.into(), span: None, help: None, other: None }
    }

    /// Adds how to mend it.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds how to mend it, if there is a way.
    pub fn maybe_help(mut self, help: Option<String>) -> Self {
        self.help = help.or(self.help);
        self
    }

    /// Adds a second place.
    pub fn other(mut self, span: Range<usize>, message: impl Into<String>) -> Self {
        self.other = Some((span, message.into()));
        self
    }
}

/// Everything that is wrong with a graph file, or with a graph on a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problems {
    /// Path of the file, as given.
    pub file: String,
    /// Its text.
    pub text: String,
    /// At least one.
    pub problems: Vec<Problem>,
}

impl Problems {
    /// Line and column, both from 1, of a byte offset. Columns count characters.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        position(&self.text, offset)
    }
}

/// Line and column, both from 1, of a byte offset of `text`. Columns count characters.
pub fn position(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |index| index + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

impl fmt::Display for Problems {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                writeln!(formatter)?;
            }
            match &problem.span {
                Some(span) => {
                    let (line, column) = self.position(span.start);
                    write!(formatter, "{}:{line}:{column}: {}", self.file, problem.message)?;
                }
                None => write!(formatter, "{}", problem.message)?,
            }
            if let Some((span, message)) = &problem.other {
                let (line, column) = self.position(span.start);
                write!(formatter, "\n  {}:{line}:{column}: {message}", self.file)?;
            }
            if let Some(help) = &problem.help {
                write!(formatter, "\n  help: {help}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}
