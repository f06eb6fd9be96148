//! One z layer as an OpenEXR file in memory, and back.
//!
//! Image column = i, image row = j (row 0 is the smallest y), one scan-line part, channels in
//! alphabetical order as the format wants. `occupancy` is HALF, `fraction` and `sdf` FLOAT,
//! `material` UINT; any further channel is one of these three sample types.
//!
//! ```text
//!   header   attributes in the order of their names
//!   table    offset of every block of lines, u64 each
//!   block    y (i32)  size (i32)  for each line: the samples of one channel after the other
//! ```
//!
//! * Numbers are little-endian; those in text have 17 significant digits, which every f64 survives.
//! * Accuracy: every compression but `pxr24` gives back the same bits. `pxr24` rounds floats to 24
//!   bits, 2^-16 of the value; integers and halves survive it.
//! * Source: Academy Software Foundation, *OpenEXR File Layout*, on headers, scan-line blocks and
//!   the offset table.

mod attributes;
mod compression;
mod decode;
mod encode;
mod error;
mod header;
mod runs;
mod samples;
mod slices;
#[cfg(test)]
mod testing;

pub(super) use self::attributes::ascii;
pub use self::attributes::{Attribute, Attributes, decimal17, layer_attributes};
pub use self::compression::{Compression, UnknownCompression};
pub use self::decode::{DecodedLayer, DecodedSamples, decode_layer};
pub use self::encode::{LayerEncoder, encode_layer};
pub use self::error::ExrError;
pub(crate) use self::header::check_channel_name;
pub use self::samples::{SampleKind, Samples};
pub(super) use self::slices::Slices;
pub use self::slices::largest_slice_bytes;
pub use super::stack::{StackChannel, write_stack};

/// What the sign of the distance means, as `voxlathe:signConvention` says it.
pub const SIGN_CONVENTION: &str = "negative-inside";
