//! Planar regions in the meridian half-plane: what a turn sweeps into a solid.
//!
//! A profile's curves become rational Bézier pieces in double-double, scaled by a power of two
//! into the unit square and cut where they turn in r or in z. Such a *bi-monotone* piece spans
//! exactly the box of its two ends, and every part of it the box of its own two ends. That one
//! property carries the membership test, the row spans and the searches.
//!
//! ```text
//!   curves ──> pieces ──┬──> crossings   is a point of the half-plane inside?
//!                       └──> boundary ──┬──> distance    how far is it?
//!                                       ├──> moments     how much is it?
//!                                       └──> arcs ──> chain ──> field ──┬──> radial   how far, for many at once?
//!                                                                  └──> cells ──> polynomials
//! ```

mod arcs;
mod boundary;
mod cells;
mod chain;
mod crossings;
mod curve;
mod distance;
mod eights;
mod error;
mod field;
mod field_nodes;
mod interpolate;
mod locate;
mod mirror;
mod moments;
mod open_cells;
mod piece;
mod polynomials;
mod profile;
mod radial;
mod radial_feet;
mod section;
mod shapes;
mod stretch_lanes;
mod stretches;
mod tree;
mod weld;

pub use crossings::Winding;
pub use curve::ProfileCurve;
pub use distance::DistanceSet;
pub use error::RegionError;
pub use interpolate::Ends;
pub use profile::{Across, Boundary, Fill, MAX_GAP, ProfileLoop, Region, Rules};

pub(crate) use boundary::{BoundaryPiece, FilledPieces, MOST_MEETINGS, SAME_FACE, filled_boundary};
pub(crate) use cells::{CellTable, LEVEL_BITS, LOST_BITS, PARTS, TILE};
pub(crate) use chain::Chain;
pub(crate) use crossings::MeridianPoint;
pub(crate) use curve::{HomogeneousPoint, beziers};
pub(crate) use distance::{LocalFoot, Touch};
pub(crate) use field::{Extent, MeridianField};
pub(crate) use locate::CurveLocator;
pub(crate) use mirror::is_mirrored;
pub(crate) use moments::{Estimate, SectionMoments};
pub(crate) use piece::Piece;
pub(crate) use polynomials::{Polynomial, PolynomialTable, SQUARE};
pub(crate) use radial::{Cubics, GROUP, Group, RadialTable};
pub(crate) use section::Section;
pub(crate) use tree::{Box2, BoxTree};
pub(crate) use weld::welded;
