//! Solids that are images of trivariate NURBS volumes.
//!
//! The solid is the union of the images of all Bézier cells, a closed set. Membership comes from the
//! cells, distances and crossings from the faces that bound them:
//!
//! ```text
//!   cells      the volumes' Bézier cells in double-double, relative to a common centre
//!   shared     which faces of cells are interior, collapsed or outer
//!   leaf       parts of cells on which the map is certified one to one, and a box tree over them
//!   newton     the one root in such a part, with a bound
//!   invert     membership and preimages
//!   net        nets of Bernstein coefficients
//!   face*      the faces of cells that are not shared and not collapsed, with a tree over their parts
//!   distance   the nearest point of them, certified
//!   line       where a line may meet them
//!   bounds     how far they reach along a direction
//! ```

mod bounds;
mod cells;
mod distance;
mod face;
mod face_match;
mod face_net;
mod face_set;
#[cfg(test)]
mod face_testing;
mod face_tree;
mod invert;
mod leaf;
mod line;
mod net;
mod newton;
mod shared;

pub use cells::Cells;
pub use face::{End, OuterFace, outer_faces};
pub use face_set::{FaceSet, NearestFace};
pub use invert::Preimage;
