//! Exact voxel grids and signed distances of solids of revolution given by NURBS profiles.

pub mod grid;
pub mod nurbs;
