//! The lattice that values are sampled on; it knows no geometry and no file format.

mod bit_volume;
mod channel;
mod spec;
mod volume;

pub use bit_volume::BitVolume;
pub use channel::{Channel, Channels, Stored, Unit};
pub use spec::{GridError, GridSpec};
pub use volume::Volume;
