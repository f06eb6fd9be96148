//! The samples of a layer on their way into a file.
//!
//! Masks are HALF, real numbers FLOAT, ids UINT; x fastest, then y.

use std::ops::Range;

use ::exr::prelude::SampleType;
use serde::{Deserialize, Serialize};

use crate::grid::Stored;

/// The samples of one channel in one layer, x fastest, then y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples<'a> {
    /// Small whole numbers, stored as HALF (exact: a half holds every integer up to 2048).
    Half(&'a [u8]),
    /// Stored as FLOAT.
    Float(&'a [f32]),
    /// Stored as UINT.
    Uint(&'a [u32]),
}

impl Samples<'_> {
    /// How many samples there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Half(s) => s.len(),
            Self::Float(s) => s.len(),
            Self::Uint(s) => s.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type the samples have in the file.
    #[must_use]
    pub fn kind(&self) -> SampleKind {
        match self {
            Self::Half(_) => SampleKind::Half,
            Self::Float(_) => SampleKind::Float,
            Self::Uint(_) => SampleKind::Uint,
        }
    }

    /// Writes the samples of `range` to `out` in the machine's byte order.
    pub(super) fn fill_native(&self, range: Range<usize>, out: &mut [u8]) {
        match self {
            Self::Half(s) => halves(&s[range], out),
            Self::Float(s) => out.copy_from_slice(bytemuck::cast_slice(&s[range])),
            Self::Uint(s) => out.copy_from_slice(bytemuck::cast_slice(&s[range])),
        }
    }

    /// Writes the samples of `range` to `out` in little-endian order, as they are in a file.
    pub(super) fn fill_le(&self, range: Range<usize>, out: &mut [u8]) {
        self.fill_native(range, out);
        if cfg!(target_endian = "big") {
            for sample in out.chunks_exact_mut(self.kind().bytes()) {
                sample.reverse();
            }
        }
    }
}

/// Whole numbers as halves in the machine's byte order, a lane of the processor for each.
///
/// Masks of 0 and 1 are a product with the bits of one. Any other number goes by way of f32: times
/// 2^-112 its exponent is that of the half, and 8 significant bits fit the half's 11, so the bits
/// from 13 up are the answer, for 0 too.
fn halves(values: &[u8], out: &mut [u8]) {
    const ONE: u16 = 0x3c00;
    const SCALE: f32 = f32::from_bits((127 - 112) << 23);
    let out = out.chunks_exact_mut(2).zip(values);
    if values.iter().fold(0, |all, &v| all | v) <= 1 {
        for (half, &value) in out {
            half.copy_from_slice(&(ONE * u16::from(value)).to_ne_bytes());
        }
    } else {
        for (half, &value) in out {
            let shifted = (f32::from(value) * SCALE).to_bits() >> 13;
            #[allow(clippy::cast_possible_truncation, reason = "255 is 0x5bf8 as a half")]
            half.copy_from_slice(&(shifted as u16).to_ne_bytes());
        }
    }
}

/// The type of a channel's samples in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SampleKind {
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Float,
    /// 32-bit unsigned integer.
    Uint,
}

impl SampleKind {
    /// Bytes of one sample.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Float | Self::Uint => 4,
        }
    }

    pub(super) fn to_exr(self) -> SampleType {
        match self {
            Self::Half => SampleType::F16,
            Self::Float => SampleType::F32,
            Self::Uint => SampleType::U32,
        }
    }
}

impl From<Stored> for SampleKind {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Mask => Self::Half,
            Stored::Real => Self::Float,
            Stored::Id => Self::Uint,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;

    #[test]
    fn every_byte_is_its_half() {
        let all: Vec<u8> = (0..=255).collect();
        let masks: Vec<u8> = (0..101).map(|n| u8::from(n % 3 == 0)).collect();
        for values in [&all[..], &all[..1], &all[..2], &all[1..2], &masks, &[]] {
            let mut out = vec![0xaa; 2 * values.len()];
            Samples::Half(values).fill_le(0..values.len(), &mut out);
            let wanted: Vec<u8> = values
                .iter()
                .flat_map(|&v| f16::from_f64(f64::from(v)).to_le_bytes())
                .collect();
            assert_eq!(out, wanted);
        }
    }
}
