//! Why a file of splines cannot be read or written: where, what was found and what was wanted.

use std::fmt;
use std::path::PathBuf;

use crate::io::IoError;
use crate::nurbs::NurbsError;

use super::Format;

/// A place in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A line and a column, both from 1; columns count characters.
    Line {
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
    },
    /// A path of names and indices, as in `shape.data[0].degree_u`.
    Field(String),
    /// One of several splines, from 0, where no better place is known.
    Spline(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { line, column } => write!(f, "line {line}, column {column}"),
            Self::Field(path) => f.write_str(path),
            Self::Spline(index) => write!(f, "spline {index}"),
        }
    }
}

/// A failure of reading or writing splines.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExchangeError {
    /// Something else stands where a value or a word was wanted.
    #[error("{place}: found {found}, wanted {wanted}")]
    Unexpected {
        /// Where.
        place: Place,
        /// What stands there.
        found: String,
        /// What was wanted.
        wanted: String,
    },
    /// The text is well formed and says something that is not read.
    #[error("{place}: {what}")]
    Unsupported {
        /// Where.
        place: Place,
        /// What it is, and what to do about it.
        what: String,
    },
    /// Numbers were read that make no spline.
    #[error("{place}: {part}{source}")]
    Spline {
        /// Where the spline, or the offending knot vector, begins.
        place: Place,
        /// Which part of it, followed by `: `, or nothing.
        part: String,
        /// What is wrong.
        source: NurbsError,
    },
    /// JSON or XML that is none.
    #[error("{place}: not {format} text: {reason}")]
    Syntax {
        /// Where.
        place: Place,
        /// The name of the notation.
        format: &'static str,
        /// The reader's reason.
        reason: String,
    },
    /// Splines cannot be written in a format.
    #[error("{place} cannot be written as {format}: {what}")]
    Unwritable {
        /// Which spline.
        place: Place,
        /// The format.
        format: Format,
        /// Why not, and what to do.
        what: String,
    },
    /// The format of a file cannot be told.
    #[error(
        "cannot tell the format{}; the name must end in .g2, .mesh, .json or .xml, and the content must agree",
        found.as_deref().map(|f| format!(": the name ends in .{f}")).unwrap_or_default()
    )]
    UnknownFormat {
        /// The extension, where there is one.
        found: Option<String>,
    },
    /// A file is larger than is read.
    #[error("the file is larger than {limit} bytes, the most that is read; split it")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// A failure within a file.
    #[error("{}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong there.
        source: Box<ExchangeError>,
    },
    /// The system refused.
    #[error(transparent)]
    Io(#[from] IoError),
}

impl ExchangeError {
    /// The same failure with the file it happened in.
    pub(super) fn in_file(self, path: &std::path::Path) -> Self {
        match self {
            // These have the path already.
            Self::Io(_) | Self::InFile { .. } => self,
            other => Self::InFile {
                path: path.into(),
                source: Box::new(other),
            },
        }
    }
}

/// A reader's reason, which may repeat names out of the text: not more of it than fits a line.
pub(super) fn brief(reason: &str) -> String {
    const MOST: usize = 160;
    if reason.chars().count() <= MOST {
        reason.to_owned()
    } else {
        reason.chars().take(MOST).chain("...".chars()).collect()
    }
}

/// What a text holds at a place, short enough for a message.
pub(super) fn quoted(text: &str) -> String {
    const MOST: usize = 40;
    if text.chars().count() <= MOST {
        format!("{text:?}")
    } else {
        format!("{:?} and more", text.chars().take(MOST).collect::<String>())
    }
}
