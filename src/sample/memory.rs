//! Writing large buffers: stores that go past the caches, and large pages.
//!
//! A plain store first reads the line it is going to replace, and makes room for it in the caches. Where a buffer
//! is larger than those and nobody reads it soon, streaming stores save that: measured on a two-core Xeon, filling
//! 1 GiB takes about half the time. A fresh buffer costs a page fault for each page; pages of 2 MiB make those rare.
//!
//! This is the one file with `unsafe` code. Each function has a safe twin that the tests hold it against.
#![allow(
    unsafe_code,
    reason = "streaming stores and page advice have no safe form"
)]

use super::bits;
use crate::math::{Kernel, SimdLevel};
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// Values of a line of memory.
pub(crate) const LINE: usize = 16;

/// Values from the beginning of a line on: lanes that load whole lines touch one each.
#[derive(Debug, Default)]
pub(crate) struct Lines<T> {
    values: Vec<T>,
    start: usize,
    length: usize,
}

impl<T: Copy + Default> Lines<T> {
    /// Values of a length, of which nothing is said.
    pub(crate) fn resize(&mut self, length: usize) {
        if self.length != length {
            self.values.clear();
            self.values.resize(length + LINE, T::default());
            let start = self.values.as_ptr().align_offset(size_of::<[f32; LINE]>());
            self.start = start.min(LINE);
            self.length = length;
        }
    }
}

impl<T> Deref for Lines<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        &self.values[self.start..self.start + self.length]
    }
}

impl<T> DerefMut for Lines<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[self.start..self.start + self.length]
    }
}

/// Stores that go past the caches, where the kernel's lanes have such. They may be seen late by other threads: not
/// after the stream is dropped.
#[derive(Debug)]
pub(crate) struct Stream {
    kernel: Kernel,
    /// Only the thread that stored can wait for its stores: a stream stays with it.
    of_thread: PhantomData<*const ()>,
}

impl Stream {
    /// A stream with the stores that `kernel` has.
    pub(crate) fn new(kernel: Kernel) -> Self {
        Self {
            kernel,
            of_thread: PhantomData,
        }
    }

    /// Copies bytes.
    ///
    /// # Panics
    /// When the lengths differ.
    pub(crate) fn copy(&self, from: &[u8], to: &mut [u8]) {
        assert_eq!(from.len(), to.len(), "the bytes to copy fill the buffer");
        #[cfg(target_arch = "x86_64")]
        match self.kernel.level() {
            // SAFETY: the level says that this machine has AVX-512F.
            SimdLevel::Avx512 => return unsafe { x86::copy_512(from, to) },
            // SAFETY: the level says that this machine has AVX2, and so AVX.
            SimdLevel::Avx2 => return unsafe { x86::copy_256(from, to) },
            SimdLevel::Scalar | SimdLevel::Auto => {}
        }
        to.copy_from_slice(from);
    }

    /// The part of `to` that consists of whole lines; all of it where the kernel has no such stores. Less than a line is
    /// before it, and after it.
    pub(crate) fn whole_lines(&self, to: &[f32]) -> [usize; 2] {
        match self.kernel.level() {
            SimdLevel::Avx512 | SimdLevel::Avx2 => {
                let head = to.as_ptr().align_offset(size_of::<[f32; LINE]>());
                let head = head.min(to.len());
                [head, head + (to.len() - head) / LINE * LINE]
            }
            SimdLevel::Scalar | SimdLevel::Auto => [0, to.len()],
        }
    }

    /// Writes one byte, 0 or 1, for each bit.
    ///
    /// # Panics
    /// When there are more bytes than bits.
    pub(crate) fn expand(&self, words: &[u64], to: &mut [u8]) {
        assert!(to.len() <= 64 * words.len(), "a bit for each byte");
        #[cfg(target_arch = "x86_64")]
        if self.kernel.level() == SimdLevel::Avx512 {
            // SAFETY: the level says that this machine has AVX-512F and AVX-512BW.
            return unsafe { x86::expand_512(words, to) };
        }
        /// Bytes expanded together: some lines, and few enough to stay in the nearest cache.
        const PART: usize = 1 << 14;
        let mut bytes = [0; PART];
        for (words, to) in words.chunks(PART / 64).zip(to.chunks_mut(PART)) {
            let bytes = &mut bytes[..to.len()];
            bits::expand(self.kernel, words, bytes);
            self.copy(bytes, to);
        }
    }
}

impl Drop for Stream {
    /// Whoever is told that a buffer is filled sees it so.
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        x86::fence();
    }
}

/// Asks for large pages under a buffer that has not been written yet. It is only advice: nothing depends on it.
pub(crate) fn advise_large_pages<T>(buffer: &mut [T]) {
    #[cfg(target_os = "linux")]
    {
        /// Advice below this length is not worth the call.
        const LEAST: usize = 4 << 20;
        let length = size_of_val(buffer);
        if length < LEAST {
            return;
        }
        let page = rustix::param::page_size();
        let start = buffer.as_mut_ptr().cast::<u8>();
        let skip = start.align_offset(page);
        if skip >= length {
            return;
        }
        let whole = (length - skip) / page * page;
        // SAFETY: the range lies within the buffer, which is borrowed exclusively; this advice changes no content.
        let _ = unsafe {
            rustix::mm::madvise(
                start.add(skip).cast(),
                whole,
                rustix::mm::Advice::LinuxHugepage,
            )
        };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = buffer;
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::bits;
    use std::arch::x86_64::{
        __m256i, __m512i, _mm_sfence, _mm256_loadu_si256, _mm256_stream_si256, _mm512_loadu_si512,
        _mm512_maskz_set1_epi8, _mm512_stream_si512,
    };

    /// Waits until all stores before can be seen.
    pub(super) fn fence() {
        // SAFETY: the fence is part of SSE, which every machine of this kind has.
        unsafe { _mm_sfence() };
    }

    /// The part of `to` that is aligned for stores of `N` bytes, with the rest before and after it.
    fn aligned<const N: usize>(to: &mut [u8]) -> [usize; 2] {
        let head = to.as_ptr().align_offset(N).min(to.len());
        [head, head + (to.len() - head) / N * N]
    }

    /// Copies what is before and after the aligned part: mostly there is nothing.
    fn copy_ends(from: &[u8], to: &mut [u8], [head, tail]: [usize; 2]) {
        if head > 0 {
            to[..head].copy_from_slice(&from[..head]);
        }
        if tail < to.len() {
            to[tail..].copy_from_slice(&from[tail..]);
        }
    }

    /// # Safety
    /// The machine must have AVX-512F.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn copy_512(from: &[u8], to: &mut [u8]) {
        let [head, tail] = aligned::<64>(to);
        copy_ends(from, to, [head, tail]);
        let (from, to) = (&from[head..tail], &mut to[head..tail]);
        for (a, b) in from.chunks_exact(64).zip(to.chunks_exact_mut(64)) {
            // SAFETY: both are 64 bytes long, and `b` is aligned to 64 bytes: the slice starts so, and so does
            // every chunk of it.
            unsafe {
                _mm512_stream_si512(
                    b.as_mut_ptr().cast::<__m512i>(),
                    _mm512_loadu_si512(a.as_ptr().cast()),
                );
            }
        }
    }

    /// The 64 bits from bit `at` on; those beyond the last word are 0.
    #[inline(always)]
    fn bits_from(words: &[u64], at: usize) -> u64 {
        let (word, shift) = (at / 64, at % 64);
        let low = words[word] >> shift;
        match words.get(word + 1) {
            Some(next) if shift != 0 => low | next << (64 - shift),
            _ => low,
        }
    }

    /// # Safety
    /// The machine must have AVX-512F and AVX-512BW.
    #[target_feature(enable = "avx512f,avx512bw")]
    pub(super) unsafe fn expand_512(words: &[u64], to: &mut [u8]) {
        let [head, tail] = aligned::<64>(to);
        let plain = |to: &mut [u8], from: usize, until: usize| {
            for (at, byte) in (from..until).zip(&mut to[from..until]) {
                *byte = u8::from(bits::get(words, at));
            }
        };
        plain(to, 0, head);
        plain(to, tail, to.len());
        for (n, b) in to[head..tail].chunks_exact_mut(64).enumerate() {
            let ones = _mm512_maskz_set1_epi8(bits_from(words, head + 64 * n), 1);
            // SAFETY: `b` is 64 bytes long and aligned to as many: the slice starts so, and so does every chunk.
            unsafe { _mm512_stream_si512(b.as_mut_ptr().cast::<__m512i>(), ones) };
        }
    }

    /// # Safety
    /// The machine must have AVX.
    #[target_feature(enable = "avx")]
    pub(super) unsafe fn copy_256(from: &[u8], to: &mut [u8]) {
        let [head, tail] = aligned::<32>(to);
        copy_ends(from, to, [head, tail]);
        let (from, to) = (&from[head..tail], &mut to[head..tail]);
        for (a, b) in from.chunks_exact(32).zip(to.chunks_exact_mut(32)) {
            // SAFETY: both are 32 bytes long, and `b` is aligned to 32 bytes as above.
            unsafe {
                _mm256_stream_si256(
                    b.as_mut_ptr().cast::<__m256i>(),
                    _mm256_loadu_si256(a.as_ptr().cast()),
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::every_kernel;

    #[test]
    fn streamed_copies_are_copies() {
        let from: Vec<u8> = (0..1000_u32).map(|i| (i * i % 251) as u8).collect();
        for kernel in every_kernel() {
            for start in [0, 1, 31, 32, 63, 64, 65] {
                for length in [0, 1, 31, 64, 65, 200, 700] {
                    let mut to = vec![7_u8; 900];
                    Stream::new(kernel).copy(&from[3..3 + length], &mut to[start..start + length]);
                    let mut twin = vec![7_u8; 900];
                    twin[start..start + length].copy_from_slice(&from[3..3 + length]);
                    assert_eq!(to, twin, "{:?} {start} {length}", kernel.level());
                }
            }
        }
    }

    #[test]
    fn streamed_bits_are_those_expanded() {
        let words: Vec<u64> = (1..20_u64)
            .map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .collect();
        for kernel in every_kernel() {
            for start in [0, 1, 31, 63, 64] {
                for length in [0, 1, 63, 64, 65, 200, 19 * 64] {
                    let mut to = vec![7_u8; 1400];
                    Stream::new(kernel).expand(&words, &mut to[start..start + length]);
                    let mut twin = vec![7_u8; 1400];
                    bits::expand(kernel, &words, &mut twin[start..start + length]);
                    assert_eq!(to, twin, "{:?} {start} {length}", kernel.level());
                }
            }
        }
    }

    #[test]
    fn lines_begin_with_a_line() {
        let mut lines = Lines::<f32>::default();
        for length in [1, 40, 40, 7, 100_000] {
            lines.resize(length);
            assert_eq!(lines.len(), length);
            assert_eq!(lines.as_ptr().align_offset(64), 0);
        }
    }

    #[test]
    fn advice_keeps_the_content() {
        let mut buffer: Vec<u32> = (0..3_000_000).collect();
        advise_large_pages(&mut buffer);
        advise_large_pages(&mut buffer[1..2]);
        assert!(buffer.iter().zip(0..).all(|(a, b)| *a == b));
    }
}
