//! The crate's error: one enum around those of its layers.

use crate::grid::GridError;
use crate::io::IoError;
use crate::mesh::MeshError;
use crate::picture::PictureError;
use crate::scene::SceneError;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene cannot be read, or says something impossible.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A grid cannot be.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// A file cannot be read or written, or is not what it should be.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A solid cannot be tessellated.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A picture cannot be made.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Something needs more memory or disk than there is.
    #[error("{what} needs {needed} bytes, and {available} are available; {remedy}")]
    TooLarge {
        /// What was asked for.
        what: String,
        /// Bytes it takes.
        needed: u64,
        /// Bytes there are.
        available: u64,
        /// What to do.
        remedy: String,
    },
    /// Distances of the grid leave the range of stored numbers.
    #[error(
        "{what} is {found:e} {units}; f32 distances need {wanted}; choose other units or leave out the sdf channel"
    )]
    Range {
        /// The length.
        what: &'static str,
        /// Its value.
        found: f64,
        /// The scene's units.
        units: &'static str,
        /// What would do.
        wanted: &'static str,
    },
    /// There is no volume to compare with.
    #[error(
        "the solid has no exact volume to compare with: nothing is left of it, or so many solids meet that measuring them would take minutes; name a closed form as [reference]"
    )]
    NoReference,
    /// A signal asked the run to stop.
    #[error("interrupted; nothing was left behind")]
    Interrupted,
}
