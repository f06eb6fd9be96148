//! Nets of Bernstein coefficients in three parameters: restriction and evaluation.
//!
//! ```text
//!   F(t) = Σ B_i(t_0) B_j(t_1) B_k(t_2) f_ijk          f_ijk = (A, W), A = W X
//! ```
//!
//! * Shapes: (p_0 + 1)(p_1 + 1)(p_2 + 1) coefficients, the first index fastest.
//! * Accuracy: a restriction takes p means with factors that sum to 1; inside [0, 1] each rounds a
//!   coefficient by γ(3) of the largest, so that n restrictions in one direction cost γ(3 p n).
//! * Source: G. Farin, *Curves and Surfaces for CAGD*, 5th ed., chapter 14.

use crate::math::Real;
use crate::nurbs::MAX_DEGREE;

/// The numbers that belong to one coefficient.
pub(super) type Row<T, const C: usize> = [T; C];

/// Coefficients in each direction: the degrees plus one.
pub(super) type Counts = [usize; 3];

/// Distance between neighbours in each direction.
fn strides(counts: Counts) -> Counts {
    [1, counts[0], counts[0] * counts[1]]
}

/// Calls `each` with the place of the first coefficient of every row in direction `axis`.
#[inline]
fn rows(counts: Counts, axis: usize, mut each: impl FnMut(usize)) {
    let stride = strides(counts);
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    for j in 0..counts[b] {
        for i in 0..counts[a] {
            each(i * stride[a] + j * stride[b]);
        }
    }
}

#[inline]
fn mean<T: Real, const C: usize>(a: Row<T, C>, s: T, b: Row<T, C>, t: T) -> Row<T, C> {
    std::array::from_fn(|c| s * a[c] + t * b[c])
}

/// Restricts to the part before `t` in direction `axis`.
pub(super) fn before<T: Real, const C: usize>(
    net: &mut [Row<T, C>],
    counts: Counts,
    axis: usize,
    t: T,
) {
    let (stride, n, s) = (strides(counts)[axis], counts[axis], T::ONE - t);
    rows(counts, axis, |first| {
        for level in 1..n {
            for i in (level..n).rev() {
                let at = first + i * stride;
                net[at] = mean(net[at - stride], s, net[at], t);
            }
        }
    });
}

/// Restricts to the part after `t` in direction `axis`.
pub(super) fn after<T: Real, const C: usize>(
    net: &mut [Row<T, C>],
    counts: Counts,
    axis: usize,
    t: T,
) {
    let (stride, n, s) = (strides(counts)[axis], counts[axis], T::ONE - t);
    rows(counts, axis, |first| {
        for level in 1..n {
            for i in 0..n - level {
                let at = first + i * stride;
                net[at] = mean(net[at], s, net[at + stride], t);
            }
        }
    });
}

/// Restricts to the interval from `start` to `end` in direction `axis`. The ends may lie a little
/// outside of [0, 1].
pub(super) fn restrict<T: Real, const C: usize>(
    net: &mut [Row<T, C>],
    counts: Counts,
    axis: usize,
    start: T,
    end: T,
) {
    if start != T::ZERO {
        after(net, counts, axis, start);
    }
    if end != T::ONE {
        before(net, counts, axis, (end - start) / (T::ONE - start));
    }
}

/// Calls `each` with every pair of neighbours in direction `axis`, first one first.
#[inline]
pub(super) fn neighbours(counts: Counts, axis: usize, mut each: impl FnMut(usize, usize)) {
    let (stride, n) = (strides(counts)[axis], counts[axis]);
    rows(counts, axis, |first| {
        for i in 1..n {
            each(first + (i - 1) * stride, first + i * stride);
        }
    });
}

/// Calls `each` with the first and the last place of every row in direction `axis`.
#[inline]
pub(super) fn ends(counts: Counts, axis: usize, mut each: impl FnMut(usize, usize)) {
    let along = (counts[axis] - 1) * strides(counts)[axis];
    rows(counts, axis, |first| each(first, first + along));
}

/// Places of the coefficients of the face `axis`, `side` (0 or 1), the lower of the other two
/// directions fastest, and their counts.
pub(super) fn face(counts: Counts, axis: usize, side: usize) -> (Vec<usize>, [usize; 2]) {
    let stride = strides(counts);
    let (a, b) = [(1, 2), (0, 2), (0, 1)][axis];
    let first = side * (counts[axis] - 1) * stride[axis];
    let mut places = Vec::with_capacity(counts[a] * counts[b]);
    for j in 0..counts[b] {
        for i in 0..counts[a] {
            places.push(first + i * stride[a] + j * stride[b]);
        }
    }
    (places, [counts[a], counts[b]])
}

/// Bernstein polynomials of one degree at one parameter, with their derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basis<T> {
    values: [T; MAX_DEGREE + 1],
    slopes: [T; MAX_DEGREE + 1],
}

impl<T: Real> Basis<T> {
    /// Those of degree `count` - 1 at `t`.
    #[inline]
    pub(super) fn new(count: usize, t: T) -> Self {
        let mut values = [T::ZERO; MAX_DEGREE + 1];
        let mut slopes = [T::ZERO; MAX_DEGREE + 1];
        let s = T::ONE - t;
        values[0] = T::ONE;
        for n in 1..count {
            if n + 1 == count {
                #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
                let p = T::of(n as f64);
                let mut last = T::ZERO;
                for i in 0..n {
                    slopes[i] = p * (last - values[i]);
                    last = values[i];
                }
                slopes[n] = p * last;
            }
            let mut carried = T::ZERO;
            for value in &mut values[..n] {
                let v = *value;
                *value = carried + s * v;
                carried = t * v;
            }
            values[n] = carried;
        }
        Self { values, slopes }
    }
}

/// The three directions' basis at `t`.
#[inline]
pub(super) fn bases<T: Real>(counts: Counts, t: [T; 3]) -> [Basis<T>; 3] {
    std::array::from_fn(|k| Basis::new(counts[k], t[k]))
}

#[inline]
fn add<T: Real, const C: usize>(sum: &mut Row<T, C>, factor: T, row: &Row<T, C>) {
    for c in 0..C {
        sum[c] = sum[c] + factor * row[c];
    }
}

/// The value.
pub(super) fn value<T: Real, const C: usize>(
    net: &[Row<T, C>],
    counts: Counts,
    t: [T; 3],
) -> Row<T, C> {
    let b = bases(counts, t);
    let mut sum = [T::ZERO; C];
    for (slab, &bk) in net.chunks_exact(counts[0] * counts[1]).zip(&b[2].values) {
        let mut in_slab = [T::ZERO; C];
        for (row, &bj) in slab.chunks_exact(counts[0]).zip(&b[1].values) {
            let mut in_row = [T::ZERO; C];
            for (f, &bi) in row.iter().zip(&b[0].values) {
                add(&mut in_row, bi, f);
            }
            add(&mut in_slab, bj, &in_row);
        }
        add(&mut sum, bk, &in_slab);
    }
    sum
}

/// The value and the derivatives by each parameter.
#[inline]
pub(super) fn value_and_slopes<T: Real, const C: usize>(
    net: &[Row<T, C>],
    counts: Counts,
    t: [T; 3],
) -> [Row<T, C>; 4] {
    let b = bases(counts, t);
    let mut sums = [[T::ZERO; C]; 4];
    for (k, slab) in net.chunks_exact(counts[0] * counts[1]).enumerate() {
        let mut in_slab = [[T::ZERO; C]; 3];
        for (j, row) in slab.chunks_exact(counts[0]).enumerate() {
            let mut in_row = [[T::ZERO; C]; 2];
            for (i, f) in row.iter().enumerate() {
                add(&mut in_row[0], b[0].values[i], f);
                add(&mut in_row[1], b[0].slopes[i], f);
            }
            add(&mut in_slab[0], b[1].values[j], &in_row[0]);
            add(&mut in_slab[1], b[1].values[j], &in_row[1]);
            add(&mut in_slab[2], b[1].slopes[j], &in_row[0]);
        }
        let (value, slope) = (b[2].values[k], b[2].slopes[k]);
        add(&mut sums[0], value, &in_slab[0]);
        add(&mut sums[1], value, &in_slab[1]);
        add(&mut sums[2], value, &in_slab[2]);
        add(&mut sums[3], slope, &in_slab[0]);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A net of degrees (1, 2, 3) without any symmetry.
    fn net() -> (Vec<[f64; 2]>, Counts) {
        let place = |i: usize| {
            let x = i as f64;
            [(x * 1.7).sin(), 1.0 + 0.5 * (x * 2.3).cos()]
        };
        ((0..24).map(place).collect(), [2, 3, 4])
    }

    #[test]
    fn restrictions_are_the_same_polynomial() {
        let (net, counts) = net();
        for axis in 0..3 {
            let mut part = net.clone();
            restrict(&mut part, counts, axis, -0.125, 0.75);
            let t = [0.3, 0.6, 0.8];
            let mut outer = t;
            outer[axis] = -0.125 + 0.875 * t[axis];
            let (a, b) = (value(&part, counts, t), value(&net, counts, outer));
            assert!((a[0] - b[0]).abs() < 1e-14 && (a[1] - b[1]).abs() < 1e-14);
        }
    }

    #[test]
    fn slopes_are_those_of_the_value() {
        let (net, counts) = net();
        let t = [0.3, 0.6, 0.8];
        let found = value_and_slopes(&net, counts, t);
        assert!((found[0][0] - value(&net, counts, t)[0]).abs() < 1e-15);
        for axis in 0..3 {
            let at = |d: f64| {
                let mut t = t;
                t[axis] += d;
                value(&net, counts, t)[0]
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((found[axis + 1][0] - slope).abs() < 1e-8, "axis {axis}");
        }
    }
}
