//! Where a solid meets a grid: layers of occupancy, volume fraction, signed distance and material.
//!
//! The unit of work is a z layer. Layers do not depend on each other: any number of threads gives the same values.
//! Each body has the quickest way that its turn and its axis allow, to the same membership and to distances within
//! max(2 ulp, 1e-4 of the least spacing); composites combine those of their bodies. What has no such way, and
//! materials and scalars, goes row by row, where one point test serves a whole run between the cuts of [`crate::solid`].
//!
//! ```text
//!   upright     rings of a layer ──> ends of all rows ──> bits, 64 voxels a word ──> bytes
//!   plane       radii of a layer's voxels, once for the grid
//!   radial      a table of cubics over the radii of a layer ──spread──> rows
//!   partial     the same for less than a full turn, with a second table along its caps
//!   lookup      distances from a table of cells, for rows and points of a layer
//!   blocks      squares of a layer, divided where the surface is near ──> bits
//!   tilted      ties these to a body and its table
//!   tilted_caps the same for less than a full turn, with a second table along its caps
//!   cap_rows    what both kinds of caps do with a row
//!   wedge       what less than a full turn leaves of a layer
//!   body        the way of one body
//!   composite   bits and distances of several
//!   flux        fractions of one body by what flows through the sides of voxels
//!   fraction    fractions of one body and of several
//!   rows        the rest
//!   row_writer  rows of a layer, to the memory one at a time
//!   memory      stores past the caches, large pages
//! ```

mod beyond;
mod bits;
mod blocks;
mod body;
mod cap_rows;
mod caps;
mod composite;
mod cut_cells;
mod divided;
mod flux;
mod fraction;
mod known;
mod layer;
mod lookup;
mod memory;
mod nearest_point;
mod partial;
mod plane;
mod radial;
mod row_writer;
mod rows;
mod spread;
mod tally;
mod tilted;
mod tilted_caps;
mod upright;
mod volume;
mod wedge;

pub(crate) use layer::stored;
pub use layer::{Cancel, LayerBuffers, LayerSampler, Selection};
pub use tally::{Certainty, FRACTION_ERROR, Loose, Tally, Ways};
pub use volume::{filled, fraction, material, occupancy, occupancy_bits, signed_distance};
