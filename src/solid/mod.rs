//! Solids of revolution in space: regions of the half-plane, turned, placed and joined.
//!
//! A point of space becomes a point (ρ, z) of the half-plane in the solid's own frame. For a full
//! turn the nearest boundary point lies in that half-plane, so membership and distance are those
//! of the region. A partial turn adds two flat caps.

mod analytic;
mod assembly;
mod atlas;
mod block;
mod body;
mod bounds;
mod circles;
mod coaxial;
mod composite;
mod cross_section;
mod crossed;
mod ellipsoid;
mod faces;
mod flux;
mod fraction;
mod grazing;
mod height;
mod measure;
mod nearest;
mod panels;
mod part;
mod patch_fraction;
mod patches;
mod path;
mod remains;
mod revolved;
mod row;
mod rule;
mod surface_point;
mod swept;
mod terms;
mod turn;
mod turned;

pub use analytic::{Analytic, Shape};
pub use assembly::Assembly;
pub use block::Block;
pub use body::Body;
pub use ellipsoid::Ellipsoid;
pub use measure::{MeasureErrors, Measures, Moments};
pub use part::{Operation, Part};
pub use patches::{Field, Patches, Scalar};
pub use revolved::Revolved;
pub use turn::Turn;

pub(crate) use assembly::{Measured, Reaches, signed};
pub(crate) use body::{STRETCHES, VoxelShape};
pub(crate) use circles::cut_cell;
pub(crate) use crossed::{Crossed, CutCell};
pub(crate) use fraction::{SNAP, TOLERANCE};
pub(crate) use nearest::{Nearest, Vicinity};
pub(crate) use patch_fraction::RowSheets;
pub(crate) use row::{Cuts, LayerCuts, Ring, Row};
pub(crate) use surface_point::SurfacePoint;
pub(crate) use terms::{Factor, Term};
