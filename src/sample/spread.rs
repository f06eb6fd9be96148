//! A table of cubics, spread to the voxels of rows.
//!
//! ```text
//!   value = c0 + (c4 + t (c1 + t (c2 + t c3)))      cell and t from the voxel's radius
//! ```
//!
//! A row's radii rise and fall by at most a cell from voxel to voxel, so neighbours find their coefficients among a few
//! in registers: lanes permute instead of gathering.
//!
//! Cells with a ridge have two cubics, of which the one nearer to 0 counts. Blocks without any do not look for a second.
//!
//! c4 is what c0 lost when it became an f32, so that the sum in brackets, at most some cells in size, is all that is
//! rounded before the last addition.
//!
//! * Accuracy: half an ulp of the value, and some ulps of a cell's side.
//! * The plain loop is the definition; the wide ones agree with it bit for bit.

use super::plane::{BLOCK, REACH, Radii, SCATTERED};
use crate::math::Kernel;
use crate::region::{Cubics, GROUP, Group, RadialTable};
#[cfg(target_arch = "x86_64")]
use pulp::Arch;

/// Fills `out`, and sets in `doubts` a bit, eight to a byte, for each value that is NaN or nearer to 0 than `least`.
pub(super) fn spread(
    kernel: Kernel,
    at: Radii<'_>,
    table: &RadialTable,
    least: f32,
    out: &mut [f32],
    doubts: &mut [u8],
) {
    let job = Spread {
        at,
        table: table.cubics(),
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
    table: Cubics<'a>,
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
            *doubts = plain(self.table, self.least, radii, out);
        }
    }
}

/// One block.
#[inline(always)]
fn plain(table: Cubics<'_>, least: f32, radii: &[u32], out: &mut [f32]) -> u8 {
    let mut doubts = 0;
    for n in 0..radii.len() {
        let cell = (radii[n] >> 16) as usize;
        #[allow(clippy::cast_precision_loss, reason = "16 bits")]
        let t = (radii[n] & 0xffff) as f32 * (1.0 / 65_536.0);
        let mut value = plain_cubic(&table.groups[cell / GROUP], cell % GROUP, t);
        if table.ridged[cell / GROUP] >> (cell % GROUP) & 1 != 0 {
            let second = plain_cubic(&table.seconds[cell / GROUP], cell % GROUP, t);
            value = if second.abs() < value.abs() {
                second
            } else {
                value
            };
        }
        out[n] = value;
        doubts |= u8::from(!(value.abs() >= least)) << n;
    }
    doubts
}

#[inline(always)]
fn plain_cubic(group: &Group, cell: usize, t: f32) -> f32 {
    let value = t * group[3][cell];
    let value = t * (group[2][cell] + value);
    let value = t * (group[1][cell] + value);
    group[0][cell] + (group[4][cell] + value)
}

// What the wide loops call is `inline(always)` and no closure: a call would leave the function that has the
// instructions switched on.

#[cfg(target_arch = "x86_64")]
struct Wide512<'a>(pulp::x86::V4, Spread<'a>);

/// Coefficient `c` of the cells that two groups hold.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn choose_512(
    simd: pulp::x86::V4,
    [low, high]: &[Group; 2],
    c: usize,
    cell: std::arch::x86_64::__m512i,
) -> std::arch::x86_64::__m512 {
    let [low, high]: [std::arch::x86_64::__m512; 2] = [pulp::cast(low[c]), pulp::cast(high[c])];
    simd.avx512f._mm512_permutex2var_ps(low, cell, high)
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide512<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(simd, job) = self;
        if job.table.precise {
            run_512::<true>(simd, job);
        } else {
            run_512::<false>(simd, job);
        }
    }
}

/// The cubics of cells that two groups hold.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn cubic_512<const PRECISE: bool>(
    simd: pulp::x86::V4,
    groups: &[Group; 2],
    cell: std::arch::x86_64::__m512i,
    t: std::arch::x86_64::__m512,
) -> std::arch::x86_64::__m512 {
    let f = simd.avx512f;
    let value = f._mm512_mul_ps(t, choose_512(simd, groups, 3, cell));
    let value = f._mm512_mul_ps(t, f._mm512_add_ps(choose_512(simd, groups, 2, cell), value));
    let mut value = f._mm512_mul_ps(t, f._mm512_add_ps(choose_512(simd, groups, 1, cell), value));
    if PRECISE {
        value = f._mm512_add_ps(choose_512(simd, groups, 4, cell), value);
    }
    f._mm512_add_ps(choose_512(simd, groups, 0, cell), value)
}

/// Two blocks at a time, whose cells two groups hold.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn run_512<const PRECISE: bool>(simd: pulp::x86::V4, job: Spread<'_>) {
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
    let one = f._mm512_set1_epi32(1);
    let limit = f._mm512_set1_ps(least);
    let all = radii
        .len()
        .min(values.len())
        .min(blocks.len())
        .min(marks.len());
    for n in 0..all {
        let (radii, values) = (&radii[n], &mut values[n]);
        let [p, q] = blocks[n];
        let first = p.min(q) / 16;
        let near = p.max(q) - 16 * first <= 32 - REACH;
        let (Some((groups, seconds, ridged)), true) = (pair(table, first as usize), near) else {
            marks[n] = [
                plain(table, least, &radii[..BLOCK], &mut values[..BLOCK]),
                plain(table, least, &radii[BLOCK..], &mut values[BLOCK..]),
            ];
            continue;
        };
        let radius = pulp::cast(*radii);
        let cell = f._mm512_sub_epi32(
            f._mm512_srli_epi32::<16>(radius),
            f._mm512_set1_epi32((16 * first).cast_signed()),
        );
        let t = f._mm512_mul_ps(f._mm512_cvtepi32_ps(f._mm512_and_si512(radius, low)), part);
        let mut value = cubic_512::<PRECISE>(simd, groups, cell, t);
        let ridged = f._mm512_set1_epi32(ridged.cast_signed());
        let ridges = f._mm512_test_epi32_mask(f._mm512_srlv_epi32(ridged, cell), one);
        if ridges != 0 {
            let second = cubic_512::<PRECISE>(simd, seconds, cell, t);
            // 17: less, and not where one is no number.
            let nearer =
                f._mm512_cmp_ps_mask::<17>(f._mm512_abs_ps(second), f._mm512_abs_ps(value));
            value = f._mm512_mask_mov_ps(value, nearer, second);
        }
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

/// Two groups that follow each other, their second cubics, and a bit for each cell that has one; `None` at the end of
/// the table.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn pair(table: Cubics<'_>, first: usize) -> Option<(&[Group; 2], &[Group; 2], u32)> {
    let groups = two(table.groups, first)?;
    let seconds = two(table.seconds, first)?;
    let [low, high] = *two(table.ridged, first)?;
    Some((groups, seconds, u32::from(low) | u32::from(high) << 16))
}

/// Two that follow each other; `None` at the end.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn two<T>(list: &[T], first: usize) -> Option<&[T; 2]> {
    match list.get(first..) {
        Some(rest) => rest.first_chunk::<2>(),
        None => None,
    }
}

#[cfg(target_arch = "x86_64")]
struct Wide256<'a>(pulp::x86::V3, Spread<'a>);

/// Coefficient `c` of the 16 cells from half a group on; `upper` has the sign where the cell is in their second half.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn choose_256(
    simd: pulp::x86::V3,
    groups: &[Group; 2],
    [c, half]: [usize; 2],
    cell: std::arch::x86_64::__m256i,
    upper: std::arch::x86_64::__m256,
) -> std::arch::x86_64::__m256 {
    let (low, _) = groups[0][c].as_chunks::<8>();
    let (high, _) = groups[1][c].as_chunks::<8>();
    let [low, high] = if half == 0 {
        [low[0], low[1]]
    } else {
        [low[1], high[0]]
    };
    let [low, high]: [std::arch::x86_64::__m256; 2] = [pulp::cast(low), pulp::cast(high)];
    simd.avx._mm256_blendv_ps(
        simd.avx2._mm256_permutevar8x32_ps(low, cell),
        simd.avx2._mm256_permutevar8x32_ps(high, cell),
        upper,
    )
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide256<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(simd, job) = self;
        run_256(simd, job);
    }
}

/// The cubics of cells that two groups hold from half a group on.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn cubic_256(
    simd: pulp::x86::V3,
    (groups, half, precise): (&[Group; 2], usize, bool),
    cell: std::arch::x86_64::__m256i,
    upper: std::arch::x86_64::__m256,
    t: std::arch::x86_64::__m256,
) -> std::arch::x86_64::__m256 {
    let f = simd.avx;
    let value = f._mm256_mul_ps(t, choose_256(simd, groups, [3, half], cell, upper));
    let value = f._mm256_mul_ps(
        t,
        f._mm256_add_ps(choose_256(simd, groups, [2, half], cell, upper), value),
    );
    let mut value = f._mm256_mul_ps(
        t,
        f._mm256_add_ps(choose_256(simd, groups, [1, half], cell, upper), value),
    );
    if precise {
        value = f._mm256_add_ps(choose_256(simd, groups, [4, half], cell, upper), value);
    }
    f._mm256_add_ps(choose_256(simd, groups, [0, half], cell, upper), value)
}

/// A block at a time, whose cells are among 16 from half a group on.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn run_256(simd: pulp::x86::V3, job: Spread<'_>) {
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
    let one = f._mm256_set1_epi32(1);
    let sign = f._mm256_set1_ps(-0.0);
    for n in 0..radii.len() {
        let (radii, values) = (&radii[n], &mut values[n]);
        let first = at.blocks[n];
        let (Some((groups, seconds, ridged)), true) =
            (pair(table, first as usize / 16), first != SCATTERED)
        else {
            doubts[n] = plain(table, least, radii, values);
            continue;
        };
        let half = first as usize / 8 % 2;
        let radius = pulp::cast(*radii);
        let cell = i._mm256_sub_epi32(
            i._mm256_srli_epi32::<16>(radius),
            f._mm256_set1_epi32((first / 8 * 8).cast_signed()),
        );
        // Cells from 8 on come from the second half: their bit 3, moved to the sign.
        let upper = f._mm256_castsi256_ps(i._mm256_slli_epi32::<28>(cell));
        let t = f._mm256_mul_ps(f._mm256_cvtepi32_ps(i._mm256_and_si256(radius, low)), part);
        let precise = table.precise;
        let mut value = cubic_256(simd, (groups, half, precise), cell, upper, t);
        let ridged = f._mm256_set1_epi32((ridged >> (8 * half)).cast_signed());
        let ridges = i._mm256_and_si256(i._mm256_srlv_epi32(ridged, cell), one);
        if i._mm256_movemask_epi8(i._mm256_cmpeq_epi32(ridges, one)) != 0 {
            let second = cubic_256(simd, (seconds, half, precise), cell, upper, t);
            let [near, far] = [second, value].map(|v| f._mm256_andnot_ps(sign, v));
            value = f._mm256_blendv_ps(value, second, f._mm256_cmp_ps::<17>(near, far));
        }
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
