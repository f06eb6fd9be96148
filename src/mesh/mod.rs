//! Triangles: the tessellated boundary of a body, and a tree over triangles that answers for points.
//!
//! ```text
//!   Body ──outline──> polygons of the half-plane ──tessellate──> Mesh ──> io::mesh (files)
//!                        chord error, proven         rings, fans,  │
//!                                                    caps          └──> MeshTree
//!                                               crossings of a ray, winding number, nearest point
//! ```
//!
//! The mesh is made for checking and for other programs; no other part of the crate computes with
//! it. Its answers come from the triangles alone, so they check the exact ones.
//!
//! * Units: lengths in scene units.
//! * Accuracy: see [`tessellate()`] for the mesh, [`MeshTree`] for the questions.

mod arrangement;
mod bvh;
mod cap;
mod crossings;
mod nearest;
mod outline;
mod patches;
mod revolved;
mod tessellate;
mod tree;
mod triangles;
mod winding;

pub use crossings::RayCrossings;
pub use nearest::Nearest;
pub use tessellate::tessellate;
pub use tree::MeshTree;
pub use triangles::Mesh;

/// The most triangles of one mesh.
pub const MAX_TRIANGLES: usize = 20_000_000;

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A chord error must be a length.
    #[error("the chord error is {found}; it must be a finite length greater than 0")]
    ChordError {
        /// The chord error given.
        found: f64,
    },
    /// A chord error below what f64 coordinates can hold.
    #[error(
        "the chord error {found:e} is below the rounding of the coordinates; the smallest here is {smallest:e}"
    )]
    BelowRounding {
        /// The chord error given, in scene units.
        found: f64,
        /// The smallest that can be kept, in scene units.
        smallest: f64,
    },
    /// A chord error that takes too many triangles.
    #[error(
        "the chord error {found:e} takes about {triangles:.3e} triangles, and the limit is {limit}; a larger chord error may do"
    )]
    TooManyTriangles {
        /// The chord error given, in scene units.
        found: f64,
        /// How many triangles it takes, about.
        triangles: f64,
        /// The most there may be: [`MAX_TRIANGLES`].
        limit: usize,
    },
    /// The boundary of the region has an open end, so it encloses nothing that could be meshed.
    #[error("the profile's boundary does not close near (r, z) = ({}, {})", at[0], at[1])]
    Open {
        /// Where, in scene units of the profile.
        at: [f64; 2],
    },
    /// Walls or gaps of a partial turn's profile that the coordinates of a cap do not tell apart.
    #[error(
        "walls of the profile are too thin for a cap near (r, z) = ({}, {})", at[0], at[1]
    )]
    Thin {
        /// Where, in scene units of the profile.
        at: [f64; 2],
    },
    /// Triangles that do not close.
    #[error(
        "the triangles do not close near ({}, {}, {}); another chord error may do", at[0], at[1], at[2]
    )]
    Torn {
        /// An end of an edge that is not used once in each direction, in scene units.
        at: [f64; 3],
    },
}
