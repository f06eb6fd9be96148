//! Failures: the message, and the exit code.

use super::interrupt;
use super::output::{self, Console};
use crate::error::Error;
use crate::io::IoErrorKind;
use crate::scene::SceneError;
use miette::{
    Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode,
};
use std::process::ExitCode;

/// Why a command ended without its result.
#[derive(Debug)]
pub(super) enum Failure {
    /// Bad usage, found after the arguments were read.
    Usage(String),
    /// Standard output, or a file of the command's own, could not be written.
    Output(String),
    /// Answers that should be equal are not.
    Disagreement(String),
    /// A signal ended the run, and this is how things are.
    Interrupted(String),
    /// Anything of the library.
    Library(Error),
}

impl Failure {
    pub(super) fn usage(text: impl Into<String>) -> Self {
        Self::Usage(text.into())
    }

    pub(super) fn disagrees(text: impl Into<String>) -> Self {
        Self::Disagreement(text.into())
    }

    pub(super) fn output(error: &std::io::Error) -> Self {
        Self::Output(format!("cannot write to standard output: {error}"))
    }

    pub(super) fn files(text: impl Into<String>) -> Self {
        Self::Output(text.into())
    }

    pub(super) fn interrupted(text: impl Into<String>) -> Self {
        Self::Interrupted(text.into())
    }

    fn code(&self) -> u8 {
        match self {
            Self::Interrupted(_) => interrupt::code(),
            Self::Usage(_) => 2,
            Self::Disagreement(_) => 1,
            Self::Output(_) => 3,
            Self::Library(error) => match error {
                Error::Scene(SceneError::Read { .. }) => 3,
                Error::Io(e) => match e.kind() {
                    IoErrorKind::Damaged => 1,
                    IoErrorKind::BadInput => 2,
                    _ => 3,
                },
                Error::Interrupted => interrupt::code(),
                _ => 2,
            },
        }
    }

    /// The message with everything that caused it.
    fn message(&self) -> String {
        match self {
            Self::Usage(text)
            | Self::Output(text)
            | Self::Disagreement(text)
            | Self::Interrupted(text) => text.clone(),
            Self::Library(error) => {
                let mut text = error.to_string();
                let mut cause = std::error::Error::source(error);
                while let Some(e) = cause {
                    text = format!("{text}: {e}");
                    cause = e.source();
                }
                text
            }
        }
    }

    /// Tells the user, and gives the exit code.
    pub(super) fn report(&self, console: &Console) -> ExitCode {
        use std::io::Write;
        let label = if console.colored() {
            "\u{1b}[1;31merror\u{1b}[0m"
        } else {
            "error"
        };
        let mut text = format!("{label}: {}\n", output::visible(&self.message()));
        if let Self::Library(Error::Scene(scene)) = self {
            text.push_str(&excerpt(scene, console.colored()));
        }
        // Nobody is left to tell when standard error is gone.
        let _ = std::io::stderr().write_all(text.as_bytes());
        if console.json() {
            let document = serde_json::json!({ "error": { "message": self.message(), "exit_code": self.code() } });
            let _ = console.document(&document);
        }
        ExitCode::from(self.code())
    }
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Library(error.into())
    }
}

/// Longest line that is shown; an array of points can be one line of megabytes.
const LONGEST_LINE: usize = 400;

/// The lines of the scene around what is wrong.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
struct Excerpt {
    message: String,
    source_text: NamedSource<String>,
    label: LabeledSpan,
}

impl Diagnostic for Excerpt {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source_text)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(std::iter::once(self.label.clone())))
    }
}

fn excerpt(error: &SceneError, colored: bool) -> String {
    let (Some(problem), Some((text, span))) = (error.problem(), error.source_text()) else {
        return String::new();
    };
    if problem.from_file {
        return String::new();
    }
    // The lines that would be shown: the one that is wrong and its neighbours.
    let line_start = |at: usize| text[..at].rfind('\n').map_or(0, |n| n + 1);
    let first = line_start(span.start);
    let before = line_start(first.saturating_sub(1));
    let shown = text[before..]
        .split('\n')
        .take(if before < first { 3 } else { 2 });
    let is_raw = |line: &str| line.contains(|c: char| c.is_control() && !matches!(c, '\t' | '\r'));
    if shown
        .into_iter()
        .any(|line| line.len() > LONGEST_LINE || is_raw(line))
    {
        return String::new();
    }
    // A span over many lines is marked at its first.
    let end = text[span.clone()]
        .find('\n')
        .map_or(span.end, |n| span.start + n);
    let shown = Excerpt {
        message: format!("wanted {}", problem.wanted),
        source_text: NamedSource::new(&problem.source_name, text.to_owned()),
        label: LabeledSpan::new_with_span(
            Some(format!("wanted {}", problem.wanted)),
            span.start..end,
        ),
    };
    let theme = if colored {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    let mut out = String::new();
    match GraphicalReportHandler::new_themed(theme)
        .with_width(120)
        .render_report(&mut out, &shown)
    {
        Ok(()) => out,
        Err(_) => String::new(),
    }
}
