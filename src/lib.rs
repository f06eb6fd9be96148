//! Exact voxel grids and signed distances of solids of revolution given by NURBS profiles.

#[cfg(feature = "cli")]
pub mod cli;
pub mod error;
pub mod grid;
pub mod io;
pub mod math;
pub mod nurbs;
pub mod region;
pub mod sample;
pub mod scene;
pub mod solid;

pub use error::Error;
pub use scene::Scene;
