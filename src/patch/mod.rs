//! Solids that are images of trivariate NURBS volumes.
//!
//! ```text
//!   cells    the volumes' Bezier cells in double-double, relative to a common centre
//!   shared   which faces of cells are interior, collapsed or outer
//!   leaf     parts of cells on which the map is certified one to one, and a box tree over them
//!   newton   the one root in such a part, with a bound
//!   invert   membership and preimages
//!   net      nets of Bernstein coefficients
//! ```
//!
//! The solid is the union of the images of all cells, a closed set.

mod cells;
mod invert;
mod leaf;
mod net;
mod newton;
mod shared;

pub use cells::Cells;
pub use invert::Preimage;
