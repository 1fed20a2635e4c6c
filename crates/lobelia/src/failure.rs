//! How errors reach the user: with the place in the file, and an exit code that says whose fault it is.

use lobelia::{
    SessionError,
    graph::{GpuError, Problem, Problems, RunError},
};
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use std::{fmt, io::IsTerminal, process::ExitCode};

/// Why the program stops.
#[derive(Debug)]
pub enum Failure {
    /// The graph, with places.
    Graph(Problems),
    /// Other bad input.
    Input(String),
    /// The run.
    Run(String),
    /// The reader of standard output went away.
    Pipe,
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Graph(problems) => Failure::Graph(problems),
            error if error.is_bad_input() => Failure::Input(error.to_string()),
            error => Failure::Run(error.to_string()),
        }
    }
}

impl From<Problems> for Failure {
    fn from(problems: Problems) -> Self {
        Failure::Graph(problems)
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Failure::Run(error.to_string())
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        Failure::Run(error.to_string())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        if error.kind() == std::io::ErrorKind::BrokenPipe { Failure::Pipe } else { Failure::Run(error.to_string()) }
    }
}

impl Failure {
    /// In one line, for a table of failures.
    pub fn message(&self) -> String {
        match self {
            Failure::Graph(problems) => {
                let place = |problem: &Problem| match &problem.span {
                    Some(span) => {
                        let (line, column) = problems.position(span.start);
                        format!("{}:{line}:{column}: {}", problems.file, problem.message)
                    }
                    None => problem.message.clone(),
                };
                problems.problems.iter().map(place).collect::<Vec<_>>().join("; ")
            }
            Failure::Input(message) | Failure::Run(message) => message.clone(),
            Failure::Pipe => "the reader of the output went away".into(),
        }
    }

    /// Prints the failure to standard error and gives the exit code: 2 for bad input, 1 for a failed run.
    pub fn report(&self) -> ExitCode {
        match self {
            Failure::Graph(problems) => {
                for problem in &problems.problems {
                    eprint!("{}", shown(problems, problem));
                }
                let count = problems.problems.len();
                if count > 1 {
                    eprintln!("{count} problems");
                }
                ExitCode::from(2)
            }
            Failure::Input(message) => {
                eprintln!("error: {message}");
                ExitCode::from(2)
            }
            Failure::Run(message) => {
                eprintln!("error: {message}");
                ExitCode::from(1)
            }
            Failure::Pipe => ExitCode::SUCCESS,
        }
    }
}

/// One problem as a diagnostic with its piece of the file.
struct Shown<'a> {
    source: NamedSource<String>,
    problem: &'a Problem,
    title: String,
}

impl fmt::Debug for Shown<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.title)
    }
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.title)
    }
}

impl std::error::Error for Shown<'_> {}

impl Diagnostic for Shown<'_> {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.problem.span.as_ref().map(|_| &self.source as &dyn SourceCode)
    }

    fn help<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        self.problem.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let here = self.problem.span.iter().map(|span| LabeledSpan::new(Some("here".into()), span.start, span.len().max(1)));
        let there = self.problem.other.iter().map(|(span, label)| LabeledSpan::new(Some(label.clone()), span.start, span.len().max(1)));
        Some(Box::new(here.chain(there)))
    }
}

/// `error: file:line:column: message`, then the lines of the file, then the help.
fn shown(problems: &Problems, problem: &Problem) -> String {
    let title = match &problem.span {
        Some(span) => {
            let (line, column) = problems.position(span.start);
            format!("{}:{line}:{column}: {}", problems.file, problem.message)
        }
        None => problem.message.clone(),
    };
    let shown = Shown { source: NamedSource::new(&problems.file, problems.text.clone()), problem, title };
    let coloured = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let theme = if coloured { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut text = String::from("error: ");
    // Long titles are kept on one line, so that editors and scripts find `file:line:column`.
    let handler = GraphicalReportHandler::new_themed(theme).with_width(400).with_links(false);
    let mut body = String::new();
    if handler.render_report(&mut body, &shown).is_err() {
        body = shown.title.clone();
    }
    text.push_str(body.trim_start().trim_start_matches(['×', '✖', ' ']).trim_start());
    text.push('\n');
    text
}
