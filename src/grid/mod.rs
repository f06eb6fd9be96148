//! The lattice that values are sampled on; it knows no geometry and no file format.

mod spec;
mod volume;

pub use spec::{GridError, GridSpec};
pub use volume::Volume;
