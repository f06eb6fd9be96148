//! A layer of occupancy as bits: 64 voxels to a word.
//!
//! Voxel (i, j) is bit `j nx + i` of the layer, the lowest of a word first; the bits after the last voxel are 0.

use crate::math::{Kernel, Side};
use pulp::Arch;

/// Words that hold `bits` bits.
pub(crate) fn words_for(bits: usize) -> usize {
    bits.div_ceil(64)
}

/// Flips the bits from `from` up to, not with, `to`.
#[inline]
pub(crate) fn flip(words: &mut [u64], from: usize, to: usize) {
    if from >= to {
        return;
    }
    let (first, last) = (from / 64, (to - 1) / 64);
    let low = u64::MAX << (from % 64);
    let high = u64::MAX >> (63 - (to - 1) % 64);
    if first == last {
        words[first] ^= low & high;
        return;
    }
    words[first] ^= low;
    for word in &mut words[first + 1..last] {
        *word = !*word;
    }
    words[last] ^= high;
}

/// The bit of one voxel.
#[inline]
pub(crate) fn get(words: &[u64], at: usize) -> bool {
    words[at / 64] >> (at % 64) & 1 != 0
}

/// Sets the bit of one voxel.
#[inline]
pub(crate) fn set(words: &mut [u64], at: usize, value: bool) {
    let mask = 1_u64 << (at % 64);
    if value {
        words[at / 64] |= mask;
    } else {
        words[at / 64] &= !mask;
    }
}

/// The sides of a layer's voxels from one body.
#[derive(Debug)]
pub(super) struct SideBits<'a> {
    /// A bit for each voxel that is inside or on the boundary.
    pub(super) inside: &'a mut [u64],
    /// A bit for each of those on the boundary, where somebody asks for them. It has no words as long as there is none.
    pub(super) on: Option<&'a mut Vec<u64>>,
}

impl SideBits<'_> {
    /// The bits of voxels on the boundary, where they are asked for.
    pub(super) fn on(&mut self) -> Option<&mut [u64]> {
        let words = self.inside.len();
        let on = self.on.as_deref_mut()?;
        on.resize(words, 0);
        Some(on)
    }

    /// Sets the side of one voxel.
    pub(super) fn set(&mut self, at: usize, side: Side) {
        set(self.inside, at, side != Side::Outside);
        let known = self.on.as_ref().is_some_and(|on| !on.is_empty());
        if (side == Side::On || known)
            && let Some(on) = self.on()
        {
            set(on, at, side == Side::On);
        }
    }

    /// Sets the side of voxels from `from` up to, not with, `to`, which are still outside.
    pub(super) fn fill(&mut self, from: usize, to: usize, side: Side) {
        if side != Side::Outside {
            flip(self.inside, from, to);
        }
        if side == Side::On
            && let Some(on) = self.on()
        {
            flip(on, from, to);
        }
    }
}

/// How many bits are set.
pub(crate) fn count(words: &[u64]) -> u64 {
    words.iter().map(|w| u64::from(w.count_ones())).sum()
}

/// One byte, 0 or 1, for each bit. Bytes beyond the last whole word take as many bits as there are bytes.
pub(crate) fn expand(kernel: Kernel, words: &[u64], bytes: &mut [u8]) {
    match kernel.lanes() {
        None => expand_plain(words, bytes),
        #[cfg(target_arch = "x86_64")]
        Some(Arch::V4(simd)) => simd.vectorize(Expand512 { simd, words, bytes }),
        Some(arch) => arch.dispatch(|| expand_plain(words, bytes)),
    }
}

/// The definition.
#[inline(always)]
fn expand_plain(words: &[u64], bytes: &mut [u8]) {
    for (&word, bytes) in words.iter().zip(bytes.chunks_mut(64)) {
        let (eights, rest) = bytes.as_chunks_mut::<8>();
        let parts = word.to_le_bytes();
        for (eight, &bits) in eights.iter_mut().zip(&parts) {
            *eight = expanded(bits);
        }
        if let Some(&bits) = parts.get(eights.len()) {
            rest.copy_from_slice(&expanded(bits)[..rest.len()]);
        }
    }
}

/// One byte for each of eight bits.
#[inline(always)]
fn expanded(bits: u8) -> [u8; 8] {
    const EACH: u64 = 0x0101_0101_0101_0101;
    /// Bit n of byte n.
    const OWN: u64 = 0x8040_2010_0804_0201;
    let own = (u64::from(bits) * EACH) & OWN;
    // Any bit of a byte below the highest carries into that, and no further.
    (((own + 0x7f * EACH) >> 7) & EACH).to_le_bytes()
}

#[cfg(target_arch = "x86_64")]
struct Expand512<'a> {
    simd: pulp::x86::V4,
    words: &'a [u64],
    bytes: &'a mut [u8],
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Expand512<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, words, bytes } = self;
        let (whole, rest) = bytes.as_chunks_mut::<64>();
        let done = whole.len();
        for (&word, bytes) in words.iter().zip(whole) {
            *bytes = pulp::cast(simd.avx512bw._mm512_maskz_set1_epi8(word, 1));
        }
        if !rest.is_empty() {
            expand_plain(&words[done..], rest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{SimdLevel, every_kernel};

    #[test]
    fn ranges_flip_and_expand() {
        let bits = 300;
        let plain = Kernel::new(SimdLevel::Scalar).expect("always there");
        for kernel in every_kernel().into_iter().chain([plain]) {
            for (from, to) in [
                (0, 0),
                (0, 1),
                (3, 64),
                (63, 65),
                (64, 128),
                (1, 299),
                (130, 300),
                (299, 300),
            ] {
                let mut words = vec![0; words_for(bits)];
                flip(&mut words, from, to);
                flip(&mut words, 10, 20);
                set(&mut words, 77, true);
                set(&mut words, 78, false);
                let mut bytes = vec![9; bits];
                expand(kernel, &words, &mut bytes);
                for (at, byte) in bytes.iter().enumerate() {
                    let flipped = (from..to).contains(&at) != (10..20).contains(&at);
                    let wanted = (flipped || at == 77) && at != 78;
                    assert_eq!(*byte, u8::from(wanted), "{from}..{to} at {at}");
                    assert_eq!(get(&words, at), wanted);
                }
                assert_eq!(
                    count(&words),
                    bytes.iter().map(|b| u64::from(*b)).sum::<u64>()
                );
            }
        }
    }
}
