//! Files: stacks of layers in any of nine formats with their manifest, the points of a query, and meshes.
//!
//! ```text
//!   layers ──> format: exr, vti, npy, nrrd, mhd, raw, zarr, vdb, h5 ──> staged (synced, digested)
//!                                               │ directory: one exchange, or renames by a journal
//!                                               v
//!   DIR/slice-0000.exr  DIR/slice-0001.exr  ...  DIR/NAME.vti  ...  DIR/manifest.json
//! ```
//!
//! [`stack`] is the whole path in one type, [`format`](mod@format) the door that all formats stand behind, [`output`] one
//! file without a manifest, [`verify`] the way back, [`points`] the tables that
//! `query` reads and writes, [`mesh`] the files of triangles. Nothing here knows geometry or scenes, only grids and bytes.
//!
//! Equal input gives equal bytes: no times, no random names, no map order reaches a file. A file
//! appears under its final name only when it is whole and synced.

pub(crate) mod base64;
pub(crate) mod deflate;
pub mod directory;
#[cfg_attr(
    not(feature = "cli"),
    allow(dead_code, reason = "only the command is ended by signals")
)]
pub(crate) mod ending;
mod error;
pub mod exr;
pub mod format;
mod grid_file;
mod h5;
pub(crate) mod leftovers;
pub mod manifest;
pub mod mesh;
mod mhd;
mod npy;
mod nrrd;
pub mod output;
pub mod points;
mod raw;
mod regular;
pub(crate) mod scratch;
mod single;
pub mod stack;
pub mod staged;
mod syncer;
mod vdb;
pub mod verify;
mod vti;
mod zarr;

pub use directory::{StackDirectory, available_bytes};
pub use error::{IoError, IoErrorKind};
pub use manifest::Manifest;
pub use mesh::write_mesh;
pub use points::{read_points, write_columns};
pub(crate) use regular::open_regular;
pub use single::write_file_atomically;
pub use stack::{StackWriter, write_stack};
pub use verify::{StackReport, verify_stack};
