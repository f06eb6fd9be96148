//! What can go wrong with files, each with the path, the reason and the next step.

use std::path::{Path, PathBuf};

use super::exr::ExrError;

/// A failure of reading or writing files.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The system refused to read.
    #[error("cannot read {}; check that it exists and that you may read it", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The system refused to write.
    #[error("cannot write {}; check its permissions and the free space, then run again", path.display())]
    Write {
        /// The file or directory.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The output directory is something else.
    #[error("{} exists and is not a directory; choose another output directory", path.display())]
    NotADirectory {
        /// The path asked for.
        path: PathBuf,
    },
    /// The output directory holds something and was not to be overwritten.
    #[error(
        "{} is not empty ({entries} {}); choose another output directory, or give --force to replace the stack in it",
        path.display(),
        if *entries == 1 { "entry" } else { "entries" }
    )]
    NotEmpty {
        /// The directory.
        path: PathBuf,
        /// How many entries it holds.
        entries: usize,
    },
    /// Another run is writing into the same directory.
    #[error("{} is being written by another run; wait for it, or choose another output directory", path.display())]
    InUse {
        /// The directory.
        path: PathBuf,
    },
    /// A file that does not belong to a stack has the name of a new one.
    #[error("{} exists and belongs to no stack; move it away or choose another output directory", path.display())]
    Occupied {
        /// The file in the way.
        path: PathBuf,
    },
    /// A file that is to be written is there already.
    #[error("{} exists; choose another name, or give --force to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// What is to be replaced is something else than what comes.
    #[error("{} exists and is no {wanted}, so it is not replaced; move it away, or choose another name", path.display())]
    Other {
        /// The path asked for.
        path: PathBuf,
        /// What it would have to be.
        wanted: &'static str,
    },
    /// A file that is to be replaced is not the one that was written.
    #[error("{} has been changed since it was written, so it is not replaced; move it away, or choose another output directory", path.display())]
    Edited {
        /// The file.
        path: PathBuf,
    },
    /// A replacement of files can neither be finished nor undone.
    #[error(
        "{}: the replacement of its files was interrupted, and can now neither be finished nor undone; what was there is in {} and stays there; when the directory can be written again, any run on it settles this, `voxlathe info` too",
        path.display(), aside.display()
    )]
    Unsettled {
        /// The output directory.
        path: PathBuf,
        /// Where its old files are.
        aside: PathBuf,
        /// What stands in the way.
        source: Box<IoError>,
    },
    /// A name cannot be that of a file in a stack.
    #[error("{}: the file name {name:?} {reason}; remove that entry by hand, or use another directory", path.display())]
    FileName {
        /// The manifest or directory that has the name.
        path: PathBuf,
        /// The name.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A file was written twice.
    #[error("{} was written twice; each file of a stack has one writer", path.display())]
    WrittenTwice {
        /// The file.
        path: PathBuf,
    },
    /// Two files would have one name where case does not count.
    #[error(
        "{}: the files {name:?} and {other:?} have the same name where case does not count; rename a channel or the scene",
        path.display()
    )]
    Clash {
        /// The directory.
        path: PathBuf,
        /// The name of the second.
        name: String,
        /// The name of the first.
        other: String,
    },
    /// A layer was written twice.
    #[error("{}: layer {layer} was written twice; write each layer once", path.display())]
    LayerTwice {
        /// The directory of the stack.
        path: PathBuf,
        /// The layer.
        layer: usize,
    },
    /// A manifest is not one of ours, or damaged.
    #[error(
        "{}: not a usable manifest: {reason}; restore the file or write the stack again into a fresh directory",
        path.display()
    )]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong, with line and column where there are any.
        reason: String,
    },
    /// An output directory has a manifest that is not a stack's.
    #[error(
        "{} is not a stack's manifest ({reason}), so what may be replaced is unknown; move it away or choose another output directory",
        path.display()
    )]
    ForeignManifest {
        /// The manifest.
        path: PathBuf,
        /// Why it is not one.
        reason: String,
    },
    /// A slice cannot be encoded or decoded.
    #[error("{}: {error}", path.display())]
    Exr {
        /// The file.
        path: PathBuf,
        /// What is wrong with the image.
        error: ExrError,
    },
    /// A layer index is not in the grid.
    #[error("{}: layer {layer} is outside a grid of {layers} layers; write layers 0 to {}", path.display(), layers - 1)]
    LayerOutside {
        /// The directory of the stack.
        path: PathBuf,
        /// The layer given.
        layer: usize,
        /// How many layers the grid has.
        layers: usize,
    },
    /// A stack was finished before all its layers were there.
    #[error("{}: layer {layer} was never written; write every layer before finishing the stack", path.display())]
    LayerMissing {
        /// The directory of the stack.
        path: PathBuf,
        /// The first missing layer.
        layer: usize,
    },
    /// A layer or volume does not match what the stack declares.
    #[error("{}: {reason}", path.display())]
    Mismatch {
        /// The directory or file.
        path: PathBuf,
        /// What was found and what was wanted.
        reason: String,
    },
    /// A mesh format is unknown.
    #[error("{}: cannot tell the format from the name; it must end in .stl, .obj or .ply", path.display())]
    MeshFormat {
        /// The file.
        path: PathBuf,
    },
    /// A coordinate is beyond the numbers of the file's format.
    #[error("{}: a coordinate is {found:e}, beyond the single precision of .stl; write .ply or .obj, or choose other units", path.display())]
    MeshRange {
        /// The file.
        path: PathBuf,
        /// The size of the coordinate.
        found: f64,
    },
    /// A point or table format is unknown.
    #[error("{}: cannot tell the format from the name; it must end in .csv or .npy", path.display())]
    TableFormat {
        /// The file.
        path: PathBuf,
    },
    /// What should be read is no regular file.
    #[error("{} is no regular file; pipes, devices and files of the kernel are not read: write it to a file first", path.display())]
    NotRegular {
        /// The path asked for.
        path: PathBuf,
    },
    /// A line of a point file is wrong.
    #[error("{}:{line}:{column}: {reason}, found {value:?}; each line is x, y, z with commas or blanks between", path.display())]
    PointLine {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Column in characters, from 1.
        column: usize,
        /// The offending text.
        value: String,
        /// What was wanted.
        reason: &'static str,
    },
    /// A coordinate in an array is NaN or infinite.
    #[error("{}: row {row}, column {column} is {value}; points must be finite", path.display())]
    PointNotFinite {
        /// The file.
        path: PathBuf,
        /// Row, from 0.
        row: u64,
        /// Column, 0 to 2.
        column: usize,
        /// The value.
        value: f64,
    },
    /// An array file is not what was asked for.
    #[error("{}: {reason}; save the points as a little-endian float64 array of shape (n, 3)", path.display())]
    Array {
        /// The file.
        path: PathBuf,
        /// What was found and what was wanted.
        reason: String,
    },
}

/// What sort of failure an [`IoError`] is; the command turns it into an exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IoErrorKind {
    /// The user gave something unusable: exit code 2.
    BadInput,
    /// The system failed, or a file is missing: exit code 3.
    System,
    /// A stack's files are damaged: exit code 1.
    Damaged,
}

impl IoError {
    /// What sort of failure this is.
    #[must_use]
    pub fn kind(&self) -> IoErrorKind {
        match self {
            Self::Read { .. } | Self::Write { .. } | Self::Unsettled { .. } => IoErrorKind::System,
            Self::Manifest { .. }
            | Self::Exr {
                error: ExrError::Damaged { .. },
                ..
            } => IoErrorKind::Damaged,
            _ => IoErrorKind::BadInput,
        }
    }

    pub(crate) fn read(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Read { path, source }
    }

    pub(super) fn unsettled(path: &Path, aside: &Path) -> impl FnOnce(Self) -> Self {
        let (path, aside) = (path.into(), aside.into());
        move |error| match error {
            already @ Self::Unsettled { .. } => already,
            error => Self::Unsettled {
                path,
                aside,
                source: Box::new(error),
            },
        }
    }

    /// As [`read`](Self::read), for a file that must be a regular one.
    pub(crate) fn open(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| match source.kind() {
            std::io::ErrorKind::InvalidInput => Self::NotRegular { path },
            _ => Self::Read { path, source },
        }
    }

    pub(crate) fn write(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Write { path, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_say_what_where_and_next() {
        let error = IoError::NotEmpty {
            path: "out/goblet".into(),
            entries: 3,
        };
        assert_eq!(
            error.to_string(),
            "out/goblet is not empty (3 entries); choose another output directory, or give --force to replace the stack in it"
        );
        assert_eq!(error.kind(), IoErrorKind::BadInput);
        let error = IoError::read("missing.csv")(std::io::ErrorKind::NotFound.into());
        assert_eq!(
            error.to_string(),
            "cannot read missing.csv; check that it exists and that you may read it"
        );
        assert_eq!(error.kind(), IoErrorKind::System);
        assert!(std::error::Error::source(&error).is_some());
        let error = IoError::LayerOutside {
            path: "out".into(),
            layer: 7,
            layers: 5,
        };
        assert_eq!(
            error.to_string(),
            "out: layer 7 is outside a grid of 5 layers; write layers 0 to 4"
        );
    }
}
