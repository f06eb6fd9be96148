//! Solids of revolution in space: regions of the half-plane, turned, placed and joined.
//!
//! A point of space becomes a point (ρ, z) of the half-plane in the solid's own frame. For a full
//! turn the nearest boundary point lies in that half-plane, so membership and distance are those
//! of the region. A partial turn adds two flat caps.

mod analytic;
mod assembly;
mod body;
mod bounds;
mod coaxial;
mod composite;
mod faces;
mod fraction;
mod measure;
mod part;
mod path;
mod row;
mod seeds;
mod terms;
mod turn;
mod turned;

pub use analytic::{Analytic, Shape};
pub use assembly::Assembly;
pub use body::Body;
pub use measure::{MeasureErrors, Measures, Moments};
pub use part::{Operation, Part};
pub use turn::Turn;

pub(crate) use assembly::{Reaches, signed};
pub(crate) use fraction::{CellShape, TOLERANCE};
pub(crate) use row::{Cuts, LayerCuts, Row};
pub(crate) use terms::{Factor, Term};
