//! Samples as few bytes, bit for bit.
//!
//! A *slab* is a few layers, and stands by itself, so that a page can be read slab by slab. Each sample is replaced by
//! what a predictor misses of it; the bytes of those are laid out plane by plane, the highest first, and deflated:
//!
//! ```text
//!   slab     flags, one for each layer   highest bytes   ...   lowest bytes        (raw deflate)
//!   missed   zigzag(order(sample) - order(predicted))        order: floats as integers in their order
//! ```
//!
//! The predictor continues the samples that are known, `a` before in the row, `b` in the row before, `c` in both, and
//! with [`BEFORE`] those of the layer before; at the sides what is missing is left out:
//!
//! ```text
//!   in the layer             a + b - c
//!   with the layer before    a + b - c + a'  - (b' + c' - d')       a' the same place, the others around it
//! ```
//!
//! A solid of revolution on a grid about its axis is its own mirror image, so a layer may instead predict its second
//! half from its first ([`MIRROR_X`], [`MIRROR_Y`]): most samples are the same bits. Which flags a layer has is tried on
//! some of its rows.
//!
//! * Floats are predicted in f64, in the order written here, and rounded to f32 once: the page does the same.
//! * Source: Lindstrom and Isenburg, *Fast and Efficient Compression of Floating-Point Data* (2006), for the predictor.

use crate::io::deflate;

/// What samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// f32, as its bits.
    Float,
    /// u32.
    Uint,
}

impl Kind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Uint => "uint",
        }
    }
}

/// The layer before takes part.
const BEFORE: u8 = 1;
/// The second half of each row is predicted from the first.
const MIRROR_X: u8 = 2;
/// The second half of the rows is predicted from the first.
const MIRROR_Y: u8 = 4;
/// All flags.
const FLAGS: u8 = 8;
/// Rows that flags are tried on.
const TRIED: usize = 16;

/// Integers in the order of the floats with these bits.
fn order(bits: u32) -> u32 {
    if bits >> 31 == 0 {
        bits | 1 << 31
    } else {
        !bits
    }
}

/// The difference of two samples as a small number where they are near.
fn missed(kind: Kind, bits: u32, predicted: u32) -> u32 {
    let difference = match kind {
        Kind::Float => order(bits).wrapping_sub(order(predicted)),
        Kind::Uint => bits.wrapping_sub(predicted),
    };
    (difference << 1) ^ if difference >> 31 == 0 { 0 } else { u32::MAX }
}

/// A layer and what is known when it is predicted.
#[derive(Clone, Copy)]
struct Known<'a> {
    kind: Kind,
    size: [usize; 2],
    layer: &'a [u32],
    before: Option<&'a [u32]>,
}

impl Known<'_> {
    fn predicted(&self, flags: u8, i: usize, j: usize) -> u32 {
        let [nx, ny] = self.size;
        if flags & MIRROR_Y != 0 && j > ny - 1 - j {
            return self.layer[(ny - 1 - j) * nx + i];
        }
        if flags & MIRROR_X != 0 && i > nx - 1 - i {
            return self.layer[j * nx + nx - 1 - i];
        }
        let at = j * nx + i;
        let before = self.before.filter(|_| flags & BEFORE != 0);
        match self.kind {
            Kind::Float => self.continued(at, i, j, before),
            Kind::Uint => self.counted(at, i, j, before),
        }
    }

    fn continued(&self, at: usize, i: usize, j: usize, before: Option<&[u32]>) -> u32 {
        let nx = self.size[0];
        let value = |layer: &[u32], at: usize| f64::from(f32::from_bits(layer[at]));
        let around = |layer: &[u32]| match (i > 0, j > 0) {
            (true, true) => {
                (value(layer, at - 1) + value(layer, at - nx)) - value(layer, at - nx - 1)
            }
            (true, false) => value(layer, at - 1),
            (false, true) => value(layer, at - nx),
            (false, false) => 0.0,
        };
        let here = around(self.layer);
        let found = before.map_or(here, |b| here + (value(b, at) - around(b)));
        #[allow(clippy::cast_possible_truncation, reason = "the one rounding")]
        let found = found as f32;
        if found.is_finite() {
            found.to_bits()
        } else {
            0
        }
    }

    fn counted(&self, at: usize, i: usize, j: usize, before: Option<&[u32]>) -> u32 {
        let nx = self.size[0];
        let around = |layer: &[u32]| match (i > 0, j > 0) {
            (true, true) => layer[at - 1]
                .wrapping_add(layer[at - nx])
                .wrapping_sub(layer[at - nx - 1]),
            (true, false) => layer[at - 1],
            (false, true) => layer[at - nx],
            (false, false) => 0,
        };
        let here = around(self.layer);
        before.map_or(here, |b| here.wrapping_add(b[at].wrapping_sub(around(b))))
    }

    /// The flags with which some of the rows miss the fewest bits.
    fn flags(&self) -> u8 {
        let [nx, ny] = self.size;
        let rows = TRIED.min(ny);
        let cost = |flags: u8| -> u64 {
            let bits = |n: usize| {
                let j = (2 * n + 1) * ny / (2 * rows);
                let row = (0..nx).map(|i| {
                    let bits = self.layer[j * nx + i];
                    let missed = missed(self.kind, bits, self.predicted(flags, i, j));
                    u64::from(u32::BITS - missed.leading_zeros())
                });
                row.sum::<u64>()
            };
            (0..rows).map(bits).sum()
        };
        let all = (0..FLAGS).filter(|f| f & BEFORE == 0 || self.before.is_some());
        all.min_by_key(|&f| cost(f)).unwrap_or(0)
    }
}

/// The bytes of a slab: layers of `size` samples along x and y, x fastest, as bits.
pub(super) fn encode(kind: Kind, size: [usize; 2], layers: &[Vec<u32>]) -> Vec<u8> {
    let area = size[0] * size[1];
    let count = layers.len();
    let mut bytes = vec![0; count * (1 + 4 * area)];
    let (flags, planes) = bytes.split_at_mut(count);
    let plane = count * area;
    for (k, layer) in layers.iter().enumerate() {
        let known = Known {
            kind,
            size,
            layer,
            before: k.checked_sub(1).map(|k| layers[k].as_slice()),
        };
        flags[k] = known.flags();
        for j in 0..size[1] {
            for i in 0..size[0] {
                let at = j * size[0] + i;
                let missed = missed(kind, layer[at], known.predicted(flags[k], i, j));
                for (p, byte) in missed.to_be_bytes().into_iter().enumerate() {
                    planes[p * plane + k * area + at] = byte;
                }
            }
        }
    }
    deflate::raw(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    /// The way back, as the page goes it.
    fn decode(kind: Kind, size: [usize; 2], count: usize, slab: &[u8]) -> Vec<Vec<u32>> {
        let mut bytes = Vec::new();
        let mut reader = flate2::bufread::DeflateDecoder::new(slab);
        reader.read_to_end(&mut bytes).expect("deflate");
        let area = size[0] * size[1];
        assert_eq!(bytes.len(), count * (1 + 4 * area));
        let mut layers: Vec<Vec<u32>> = Vec::new();
        for k in 0..count {
            let mut layer = vec![0; area];
            for at in 0..area {
                let byte = |p: usize| u32::from(bytes[count + (p * count + k) * area + at]);
                let missed = (0..4).fold(0, |all, p| all << 8 | byte(p));
                let difference = (missed >> 1) ^ (missed & 1).wrapping_neg();
                let known = Known {
                    kind,
                    size,
                    layer: &layer,
                    before: k.checked_sub(1).map(|k| layers[k].as_slice()),
                };
                let predicted = known.predicted(bytes[k], at % size[0], at / size[0]);
                layer[at] = match kind {
                    Kind::Uint => predicted.wrapping_add(difference),
                    Kind::Float => {
                        let place = order(predicted).wrapping_add(difference);
                        if place >> 31 == 1 {
                            place & !(1 << 31)
                        } else {
                            !place
                        }
                    }
                };
            }
            layers.push(layer);
        }
        layers
    }

    fn ball(size: [usize; 2], count: usize) -> Vec<Vec<u32>> {
        let layer = |k: usize| {
            let one = |at: usize| {
                let p = [at % size[0], at / size[0], k];
                let middle = [size[0], size[1], count];
                let square: f64 = (0..3)
                    .map(|a| ((p[a] as f64 + 0.5) - 0.5 * middle[a] as f64).powi(2))
                    .sum();
                #[allow(clippy::cast_possible_truncation, reason = "as samples are stored")]
                let value = (square.sqrt() - 3.0) as f32;
                value.to_bits()
            };
            (0..size[0] * size[1]).map(one).collect()
        };
        (0..count).map(layer).collect()
    }

    #[test]
    fn every_bit_comes_back() {
        let odd = [
            f32::NAN.to_bits(),
            f32::INFINITY.to_bits(),
            (-0.0_f32).to_bits(),
            f32::MIN.to_bits(),
            f32::MAX.to_bits(),
            1,
            0xffff_ffff,
            0x7fa0_0001,
            0,
        ];
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 32) as u32
        };
        for (size, count) in [([1, 1], 1), ([7, 5], 3), ([8, 1], 2), ([3, 9], 4)] {
            let area = size[0] * size[1];
            let noise = (0..count).map(|_| (0..area).map(|_| random()).collect());
            let noise: Vec<Vec<u32>> = noise.collect();
            let strange =
                (0..count).map(|k| (0..area).map(|n| odd[(n * 5 + k) % odd.len()]).collect());
            let strange: Vec<Vec<u32>> = strange.collect();
            for layers in [ball(size, count), noise, strange] {
                for kind in [Kind::Float, Kind::Uint] {
                    let slab = encode(kind, size, &layers);
                    assert_eq!(
                        decode(kind, size, count, &slab),
                        layers,
                        "{kind:?} {size:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_its_own_mirror_image_takes_a_fraction() {
        let size = [64, 64];
        let layers = ball(size, 16);
        let moved: Vec<Vec<u32>> = layers.iter().map(|l| l[..64 * 40].to_vec()).collect();
        let whole = encode(Kind::Float, size, &layers).len();
        // Of these the second half has no mirror image.
        let part = encode(Kind::Float, [64, 40], &moved).len();
        assert!(whole < part, "{whole} bytes, and {part} of five eighths");
        assert!(whole < 64 * 64 * 16, "{whole}");
    }
}
