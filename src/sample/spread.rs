//! A table of cubics, spread to the voxels of rows.
//!
//! ```text
//!   value = c0 + (c4 + t (c1 + t (c2 + t c3)))      cell and t from the voxel's radius
//! ```
//!
//! A row's radii rise and fall by at most a cell from voxel to voxel, so 8 neighbours find their coefficients among
//! 16 in registers: lanes permute instead of gathering.
//!
//! c4 is what c0 lost when it became an f32, so that the sum in brackets, at most some cells in size, is all that is
//! rounded before the last addition.
//!
//! * Accuracy: half an ulp of the value, and some ulps of a cell's side.
//! * The plain loop is the definition; the wide ones agree with it bit for bit.

use super::plane::{BLOCK, Radii, SCATTERED};
use crate::math::Kernel;
#[cfg(target_arch = "x86_64")]
use pulp::Arch;

/// Fills `out`, and sets in `doubts` a bit, eight to a byte, for each value that is NaN or nearer to 0 than `least`.
pub(super) fn spread(
    kernel: Kernel,
    at: Radii<'_>,
    table: [&[f32]; 5],
    least: f32,
    out: &mut [f32],
    doubts: &mut [u8],
) {
    let job = Spread {
        at,
        table,
        least,
        out,
        doubts,
    };
    match kernel.lanes() {
        #[cfg(target_arch = "x86_64")]
        Some(Arch::V4(simd)) => simd.vectorize(Wide512(simd, job)),
        #[cfg(target_arch = "x86_64")]
        Some(Arch::V3(simd)) => simd.vectorize(Wide256(simd, job)),
        _ => job.run(0),
    }
}

struct Spread<'a> {
    at: Radii<'a>,
    table: [&'a [f32]; 5],
    least: f32,
    out: &'a mut [f32],
    doubts: &'a mut [u8],
}

impl Spread<'_> {
    /// The definition, from a block on.
    #[inline(always)]
    fn run(self, first: usize) {
        let radii = self.at.radii.chunks(BLOCK).skip(first);
        let out = self.out.chunks_mut(BLOCK).skip(first);
        for ((radii, out), doubts) in radii.zip(out).zip(&mut self.doubts[first..]) {
            *doubts = plain(&self.table, self.least, radii, out);
        }
    }
}

/// One block.
#[inline(always)]
fn plain(table: &[&[f32]; 5], least: f32, radii: &[u32], out: &mut [f32]) -> u8 {
    let mut doubts = 0;
    for n in 0..radii.len() {
        let cell = (radii[n] >> 16) as usize;
        #[allow(clippy::cast_precision_loss, reason = "16 bits")]
        let t = (radii[n] & 0xffff) as f32 * (1.0 / 65_536.0);
        let value = t * table[3][cell];
        let value = t * (table[2][cell] + value);
        let value = t * (table[1][cell] + value);
        let value = table[0][cell] + (table[4][cell] + value);
        out[n] = value;
        doubts |= u8::from(!(value.abs() >= least)) << n;
    }
    doubts
}

/// The coefficients that the lanes of a block choose from; `None` near the end of the table.
#[inline(always)]
fn window<const N: usize>(c: &[f32], first: u32) -> Option<&[f32; N]> {
    match c.get(first as usize..) {
        Some(rest) => rest.first_chunk::<N>(),
        None => None,
    }
}

// What the wide loops call is `inline(always)` and no closure: a call would leave the function that has the
// instructions switched on.

#[cfg(target_arch = "x86_64")]
struct Wide512<'a>(pulp::x86::V4, Spread<'a>);

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn choose_512(
    simd: pulp::x86::V4,
    c: &[f32; 32],
    cell: std::arch::x86_64::__m512i,
) -> std::arch::x86_64::__m512 {
    let [low, high]: [std::arch::x86_64::__m512; 2] = pulp::cast(*c);
    simd.avx512f._mm512_permutex2var_ps(low, cell, high)
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide512<'_> {
    type Output = ();

    /// Two blocks at a time: 32 coefficients from the lower of their cells on.
    #[inline(always)]
    fn call(self) {
        let Self(simd, job) = self;
        let f = simd.avx512f;
        let Spread {
            at,
            table,
            least,
            out,
            doubts,
        } = job;
        let (radii, rest) = at.radii.as_chunks::<16>();
        let (values, _) = out.as_chunks_mut::<16>();
        let (blocks, _) = at.blocks.as_chunks::<2>();
        let (marks, _) = doubts.as_chunks_mut::<2>();
        let part = f._mm512_set1_ps(1.0 / 65_536.0);
        let low = f._mm512_set1_epi32(0xffff);
        let limit = f._mm512_set1_ps(least);
        for n in 0..radii.len() {
            let (radii, values) = (&radii[n], &mut values[n]);
            let [p, q] = blocks[n];
            let first = p.min(q);
            let near = p.max(q) - first < 32 - super::plane::REACH;
            let (Some(a), Some(b), Some(c), Some(d), Some(e), true) = (
                window::<32>(table[0], first),
                window::<32>(table[1], first),
                window::<32>(table[2], first),
                window::<32>(table[3], first),
                window::<32>(table[4], first),
                near,
            ) else {
                marks[n] = [
                    plain(&table, least, &radii[..BLOCK], &mut values[..BLOCK]),
                    plain(&table, least, &radii[BLOCK..], &mut values[BLOCK..]),
                ];
                continue;
            };
            let radius = pulp::cast(*radii);
            let cell = f._mm512_sub_epi32(
                f._mm512_srli_epi32::<16>(radius),
                f._mm512_set1_epi32(first.cast_signed()),
            );
            let t = f._mm512_mul_ps(f._mm512_cvtepi32_ps(f._mm512_and_si512(radius, low)), part);
            let value = f._mm512_mul_ps(t, choose_512(simd, d, cell));
            let value = f._mm512_mul_ps(t, f._mm512_add_ps(choose_512(simd, c, cell), value));
            let value = f._mm512_mul_ps(t, f._mm512_add_ps(choose_512(simd, b, cell), value));
            let value = f._mm512_add_ps(choose_512(simd, e, cell), value);
            let value = f._mm512_add_ps(choose_512(simd, a, cell), value);
            *values = pulp::cast(value);
            let mask = f._mm512_cmp_ps_mask::<9>(f._mm512_abs_ps(value), limit);
            marks[n] = mask.to_le_bytes();
        }
        let done = radii.len() * 2;
        if !rest.is_empty() {
            Spread {
                at,
                table,
                least,
                out,
                doubts,
            }
            .run(done);
        }
    }
}

#[cfg(target_arch = "x86_64")]
struct Wide256<'a>(pulp::x86::V3, Spread<'a>);

/// `upper` has the sign where the cell is in the second half.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn choose_256(
    simd: pulp::x86::V3,
    c: &[f32; 16],
    cell: std::arch::x86_64::__m256i,
    upper: std::arch::x86_64::__m256,
) -> std::arch::x86_64::__m256 {
    let [low, high]: [std::arch::x86_64::__m256; 2] = pulp::cast(*c);
    simd.avx._mm256_blendv_ps(
        simd.avx2._mm256_permutevar8x32_ps(low, cell),
        simd.avx2._mm256_permutevar8x32_ps(high, cell),
        upper,
    )
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide256<'_> {
    type Output = ();

    /// A block at a time: 16 coefficients from its least cell on.
    #[inline(always)]
    fn call(self) {
        let Self(simd, job) = self;
        let (f, i) = (simd.avx, simd.avx2);
        let Spread {
            at,
            table,
            least,
            out,
            doubts,
        } = job;
        let (radii, rest) = at.radii.as_chunks::<BLOCK>();
        let (values, _) = out.as_chunks_mut::<BLOCK>();
        let part = f._mm256_set1_ps(1.0 / 65_536.0);
        let low = f._mm256_set1_epi32(0xffff);
        let limit = f._mm256_set1_ps(least);
        let sign = f._mm256_set1_ps(-0.0);
        for n in 0..radii.len() {
            let (radii, values) = (&radii[n], &mut values[n]);
            let first = at.blocks[n];
            let (Some(a), Some(b), Some(c), Some(d), Some(e), true) = (
                window::<16>(table[0], first),
                window::<16>(table[1], first),
                window::<16>(table[2], first),
                window::<16>(table[3], first),
                window::<16>(table[4], first),
                first != SCATTERED,
            ) else {
                doubts[n] = plain(&table, least, radii, values);
                continue;
            };
            let radius = pulp::cast(*radii);
            let cell = i._mm256_sub_epi32(
                i._mm256_srli_epi32::<16>(radius),
                f._mm256_set1_epi32(first.cast_signed()),
            );
            // Cells from 8 on come from the second half: their bit 3, moved to the sign.
            let upper = f._mm256_castsi256_ps(i._mm256_slli_epi32::<28>(cell));
            let t = f._mm256_mul_ps(f._mm256_cvtepi32_ps(i._mm256_and_si256(radius, low)), part);
            let value = f._mm256_mul_ps(t, choose_256(simd, d, cell, upper));
            let value =
                f._mm256_mul_ps(t, f._mm256_add_ps(choose_256(simd, c, cell, upper), value));
            let value =
                f._mm256_mul_ps(t, f._mm256_add_ps(choose_256(simd, b, cell, upper), value));
            let value = f._mm256_add_ps(choose_256(simd, e, cell, upper), value);
            let value = f._mm256_add_ps(choose_256(simd, a, cell, upper), value);
            *values = pulp::cast(value);
            let size = f._mm256_andnot_ps(sign, value);
            let mask = f._mm256_movemask_ps(f._mm256_cmp_ps::<9>(size, limit));
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "eight bits"
            )]
            {
                doubts[n] = mask as u8;
            }
        }
        let done = radii.len();
        if !rest.is_empty() {
            Spread {
                at,
                table,
                least,
                out,
                doubts,
            }
            .run(done);
        }
    }
}
