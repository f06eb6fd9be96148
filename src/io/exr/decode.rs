//! A layer read back from an OpenEXR file.
//!
//! Memory is bounded by a multiple of the file's size, whatever the header promises.

use std::io::Cursor;

use ::exr::block::reader::ChunksReader as _;
use ::exr::meta::BlockDescription;
use ::exr::meta::header::LayerAttributes;
use ::exr::prelude::{AttributeValue, SampleType, Vec2};
use half::f16;

use super::{Attribute, Attributes, Compression, ExrError, SampleKind};

/// No compression here shrinks by more than this: deflate reaches 1032, after the 24-bit rounding of
/// `pxr24` 4/3 of that, runs in PIZ's Huffman code about 500. An image that promises more bytes for
/// each byte of its file is refused before anything is allocated for it.
const MAX_EXPANSION: u64 = 2048;

/// Samples reserved at once when decoding; more come as the file delivers them.
const MAX_RESERVED: usize = 1 << 20;

/// The samples of one channel of a decoded layer.
#[derive(Debug, Clone, PartialEq)]
pub enum DecodedSamples {
    /// HALF.
    Half(Vec<f16>),
    /// FLOAT.
    Float(Vec<f32>),
    /// UINT.
    Uint(Vec<u32>),
}

impl DecodedSamples {
    /// The values as f32: exact for halves and floats, rounded for integers above 2^24.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "the rounding is documented")]
    pub fn to_f32(&self) -> Vec<f32> {
        match self {
            Self::Half(s) => s.iter().map(|v| v.to_f32()).collect(),
            Self::Float(s) => s.clone(),
            Self::Uint(s) => s.iter().map(|&v| v as f32).collect(),
        }
    }

    /// The type of the samples in the file.
    #[must_use]
    pub fn kind(&self) -> SampleKind {
        match self {
            Self::Half(_) => SampleKind::Half,
            Self::Float(_) => SampleKind::Float,
            Self::Uint(_) => SampleKind::Uint,
        }
    }

    fn with_capacity(kind: SampleType, n: usize) -> Self {
        match kind {
            SampleType::F16 => Self::Half(Vec::with_capacity(n)),
            SampleType::F32 => Self::Float(Vec::with_capacity(n)),
            SampleType::U32 => Self::Uint(Vec::with_capacity(n)),
        }
    }

    /// Appends samples in the machine's byte order.
    fn extend_native(&mut self, bytes: &[u8]) {
        let four = |b: &[u8]| [b[0], b[1], b[2], b[3]];
        match self {
            Self::Half(s) => s.extend(
                bytes
                    .chunks_exact(2)
                    .map(|b| f16::from_ne_bytes([b[0], b[1]])),
            ),
            Self::Float(s) => {
                s.extend(bytes.chunks_exact(4).map(|b| f32::from_ne_bytes(four(b))));
            }
            Self::Uint(s) => {
                s.extend(bytes.chunks_exact(4).map(|b| u32::from_ne_bytes(four(b))));
            }
        }
    }
}

/// A layer read back.
#[derive(Debug, Clone, PartialEq)]
pub struct DecodedLayer {
    /// Voxels along x and y.
    pub size: [usize; 2],
    /// Channels in alphabetical order.
    pub channels: Vec<(String, DecodedSamples)>,
    /// Custom attributes of the types that stacks have.
    pub attributes: Attributes,
    /// How the samples are compressed, where it is a way that stacks have.
    pub compression: Option<Compression>,
    /// The program that wrote the file.
    pub software: Option<String>,
}

impl DecodedLayer {
    /// The samples of the channel with this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&DecodedSamples> {
        self.channels.iter().find(|c| c.0 == name).map(|c| &c.1)
    }
}

/// The layer in the OpenEXR file `bytes`.
///
/// The memory taken is bounded by a multiple of the file's size, whatever its header says.
///
/// # Errors
/// [`ExrError::Damaged`] when the bytes are not an intact file, [`ExrError::Unsupported`] when it
/// is not one flat scan-line image at the origin.
pub fn decode_layer(bytes: &[u8]) -> Result<DecodedLayer, ExrError> {
    let damaged = |e: ::exr::error::Error| ExrError::Damaged {
        reason: e.to_string(),
    };
    let unsupported = |reason| Err(ExrError::Unsupported { reason });
    let reader = ::exr::block::read(Cursor::new(bytes), true).map_err(damaged)?;
    let [header] = reader.headers() else {
        return unsupported("the file has several parts");
    };
    if header.deep || header.blocks != BlockDescription::ScanLines {
        return unsupported("the file has tiles or deep samples");
    }
    if header.own_attributes.layer_position != Vec2(0, 0) {
        return unsupported("the data window does not start at (0, 0)");
    }
    if header
        .channels
        .list
        .iter()
        .any(|c| c.sampling != Vec2(1, 1))
    {
        return unsupported("a channel is subsampled");
    }
    let Vec2(width, height) = header.layer_size;
    let promised = (width as u64)
        .saturating_mul(height as u64)
        .saturating_mul(header.channels.bytes_per_pixel as u64);
    if promised > (bytes.len() as u64).saturating_mul(MAX_EXPANSION) {
        return Err(ExrError::Damaged {
            reason: format!(
                "{width} x {height} voxels cannot come from {} bytes",
                bytes.len()
            ),
        });
    }
    let mut channels: Vec<(String, DecodedSamples)> = header
        .channels
        .list
        .iter()
        .map(|c| {
            let n = width.saturating_mul(height).min(MAX_RESERVED);
            let samples = DecodedSamples::with_capacity(c.sample_type, n);
            (c.name.to_string(), samples)
        })
        .collect();
    let widths: Vec<usize> = header
        .channels
        .list
        .iter()
        .map(|c| c.sample_type.bytes_per_sample() * width)
        .collect();
    let attributes = decoded_attributes(&header.own_attributes);
    let compression = Compression::from_exr(header.compression);
    let software = (header.own_attributes.software_name.as_ref()).map(ToString::to_string);

    let mut blocks = reader
        .all_chunks(true)
        .map_err(damaged)?
        .sequential_decompressor(true);
    let mut next_row = 0;
    while let Some(block) = blocks.decompress_next_block() {
        let block = block.map_err(damaged)?;
        let rows = block.index.pixel_size.height();
        let line: usize = widths.iter().sum();
        if block.index.pixel_position != Vec2(0, next_row)
            || block.index.pixel_size.width() != width
            || block.data.len() != line * rows
        {
            return Err(ExrError::Damaged {
                reason: format!("the lines after row {next_row} are out of order"),
            });
        }
        let mut rest = block.data.as_slice();
        for _ in 0..rows {
            for (channel, &n) in channels.iter_mut().zip(&widths) {
                let (head, tail) = rest.split_at(n);
                channel.1.extend_native(head);
                rest = tail;
            }
        }
        next_row += rows;
    }
    if next_row != height {
        return Err(ExrError::Damaged {
            reason: format!("{next_row} of {height} rows are there"),
        });
    }
    Ok(DecodedLayer {
        size: [width, height],
        channels,
        attributes,
        compression,
        software,
    })
}

fn decoded_attributes(own: &LayerAttributes) -> Attributes {
    own.other
        .iter()
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(t) => Attribute::Text(t.to_string()),
                AttributeValue::I32(i) => Attribute::Int(*i),
                AttributeValue::F64(d) => Attribute::Double(*d),
                _ => return None,
            };
            Some((name.to_string(), value))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Layer, SIZE, attributes};
    use super::super::{Samples, encode_layer};
    use super::*;

    #[test]
    fn a_header_alone_cannot_claim_memory() {
        let list = [("sdf", Samples::Float(&[0.0]))];
        let mut bytes = encode_layer([1, 1], &list, &Attributes::new(), Compression::None).unwrap();
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        bytes[at + 8..at + 12].copy_from_slice(&1_000_000_000_i32.to_le_bytes());
        let error = decode_layer(&bytes).unwrap_err().to_string();
        assert!(
            error.starts_with("not an intact OpenEXR file (1000000001 x 1 voxels"),
            "{error}"
        );
        bytes[at + 12..at + 16].copy_from_slice(&1_000_000_000_i32.to_le_bytes());
        assert!(decode_layer(&bytes).is_err());
    }

    #[test]
    fn damaged_files_are_refused_without_panic() {
        let layer = Layer::ball(SIZE);
        for compression in Compression::ALL {
            let bytes = encode_layer(SIZE, &layer.channels(), &attributes(), compression).unwrap();
            for end in 0..bytes.len() {
                assert!(decode_layer(&bytes[..end]).is_err(), "cut at {end}");
            }
            let mut state = 1_u64;
            for _ in 0..3000 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let mut flipped = bytes.clone();
                let at = usize::try_from(state >> 33).unwrap() % flipped.len();
                flipped[at] ^= 1 << ((state >> 20) & 7);
                let _ = decode_layer(&flipped);
            }
        }
        assert!(matches!(
            decode_layer(b"not an image"),
            Err(ExrError::Damaged { .. })
        ));
    }
}
