//! The inner loops, one lane for each sample: the twin of [`scalar`](super::scalar).
//!
//! Every lane does what the plain loops do, in their order. Degrees up to 7 have loops of fixed
//! length, so that the triangle stays in registers; higher ones share a loop with the degree as a
//! number. What is left over after the last full set of lanes goes through partial loads and stores,
//! whose idle lanes hold zeros. Everything a loop calls is `inline(always)` and no closure: a call
//! would leave the function that has the instructions switched on, at a cost of some five times.

use super::super::MAX_DEGREE;
use super::super::basis::SpanFactors;
use super::{Curves, Rows};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Calls `$body::<S, N>` with the N that holds degree + 1 values exactly, or the largest.
macro_rules! for_degree {
    ($degree:expr, $body:ident::<$S:ident>($($argument:expr),* $(,)?)) => {
        match $degree {
            1 => $body::<$S, 2>($($argument,)* 1),
            2 => $body::<$S, 3>($($argument,)* 2),
            3 => $body::<$S, 4>($($argument,)* 3),
            4 => $body::<$S, 5>($($argument,)* 4),
            5 => $body::<$S, 6>($($argument,)* 5),
            6 => $body::<$S, 7>($($argument,)* 6),
            7 => $body::<$S, 8>($($argument,)* 7),
            p => $body::<$S, { MAX_DEGREE + 1 }>($($argument,)* p),
        }
    };
}

/// The lanes of `values` from `at` on, as many as there are.
#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f64]) -> S::f64s {
    match S::as_simd_f64s(values) {
        ([full], []) => *full,
        _ => simd.partial_load_f64s(values),
    }
}

/// Writes as many lanes as `values` has room for.
#[inline(always)]
fn store<S: Simd>(simd: S, values: &mut [f64], lanes: S::f64s) {
    if values.len() == S::F64_LANES {
        S::as_mut_simd_f64s(values).0[0] = lanes;
    } else {
        simd.partial_store_f64s(values, lanes);
    }
}

/// Basis functions and derivatives of samples of one span; see [`scalar::fill`](super::scalar::fill).
#[derive(Debug)]
pub(in super::super) struct Fill<'a, 'b> {
    /// The span.
    pub(in super::super) factors: &'a SpanFactors,
    /// Parameters, all in the span.
    pub(in super::super) samples: &'a [f64],
    /// Highest derivative, 0 to 2.
    pub(in super::super) order: usize,
    /// Where the values go.
    pub(in super::super) rows: &'a mut Rows<'b>,
    /// Column of the first sample.
    pub(in super::super) first: usize,
}

impl WithSimd for Fill<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for_degree!(self.factors.degree, fill::<S>(simd, self));
    }
}

#[inline(always)]
fn fill<S: Simd, const N: usize>(simd: S, job: Fill<'_, '_>, p: usize) {
    let zero = simd.splat_f64s(0.0);
    let knots = &job.factors.knots[..2 * p];
    let mut left = [zero; N];
    let mut right = [zero; N];
    let mut n = [zero; N];
    let mut climbs = [[zero; N]; 2];
    let mut column = job.first;
    for samples in job.samples.chunks(S::F64_LANES) {
        let u = load(simd, samples);
        for i in 0..p {
            // right[i] = u_{k+1+i} - u and left[i] = u - u_{k-i}.
            right[i] = simd.sub_f64s(simd.splat_f64s(knots[p + i]), u);
            left[i] = simd.sub_f64s(u, simd.splat_f64s(knots[p - 1 - i]));
        }
        n[0] = simd.splat_f64s(1.0);
        for j in 0..=p {
            if j > 0 {
                let reciprocals = job.factors.level(j);
                let mut saved = zero;
                for r in 0..j {
                    let t = simd.mul_f64s(n[r], simd.splat_f64s(reciprocals[r]));
                    n[r] = simd.add_f64s(saved, simd.mul_f64s(right[r], t));
                    saved = simd.mul_f64s(left[j - 1 - r], t);
                }
                n[j] = saved;
            }
            if j < p && p - j <= job.order {
                climbs[p - j - 1][..=j].copy_from_slice(&n[..=j]);
            }
        }
        for (a, &lanes) in n[..=p].iter().enumerate() {
            put(simd, job.rows, a, column, samples.len(), lanes);
        }
        for q in 1..=job.order {
            let climb = &mut climbs[q - 1];
            if q > p {
                climb.fill(zero);
            } else {
                for j in p + 1 - q..=p {
                    raise(simd, &mut climb[..=j], job.factors.level(j));
                }
            }
            for (a, &lanes) in climb[..=p].iter().enumerate() {
                put(
                    simd,
                    job.rows,
                    q * (p + 1) + a,
                    column,
                    samples.len(),
                    lanes,
                );
            }
        }
        column += samples.len();
    }
    set_units(job.factors, job.samples, job.rows, job.first);
}

/// Writes `count` lanes to a row.
#[inline(always)]
fn put<S: Simd>(
    simd: S,
    rows: &mut Rows<'_>,
    row: usize,
    column: usize,
    count: usize,
    lanes: S::f64s,
) {
    let at = row * rows.stride + column;
    store(simd, &mut rows.values[at..at + count], lanes);
}

/// Lanes times one number.
#[inline(always)]
fn times<S: Simd>(simd: S, lanes: S::f64s, factor: f64) -> S::f64s {
    simd.mul_f64s(lanes, simd.splat_f64s(factor))
}

/// One level of the climb: from functions of degree j - 1 to the derivatives of those of degree j.
#[inline(always)]
fn raise<S: Simd>(simd: S, row: &mut [S::f64s], reciprocals: &[f64]) {
    let j = row.len() - 1;
    let factor = simd.splat_f64s(j as f64);
    row[j] = simd.mul_f64s(factor, times(simd, row[j - 1], reciprocals[j - 1]));
    for a in (1..j).rev() {
        let difference = simd.sub_f64s(
            times(simd, row[a - 1], reciprocals[a - 1]),
            times(simd, row[a], reciprocals[a]),
        );
        row[a] = simd.mul_f64s(factor, difference);
    }
    let difference = simd.sub_f64s(simd.splat_f64s(0.0), times(simd, row[0], reciprocals[0]));
    row[0] = simd.mul_f64s(factor, difference);
}

/// Sets the values at knots of full multiplicity, as the plain loops do.
#[inline(always)]
fn set_units(factors: &SpanFactors, samples: &[f64], rows: &mut Rows<'_>, first: usize) {
    if !(factors.unit_at_start || factors.unit_at_end) {
        return;
    }
    for (s, &u) in samples.iter().enumerate() {
        if let Some(unit) = factors.unit(u) {
            for a in 0..=factors.degree {
                rows.values[a * rows.stride + first + s] = f64::from(u8::from(a == unit));
            }
        }
    }
}

/// Sums over the basis; see [`scalar::sum`](super::scalar::sum).
#[derive(Debug)]
pub(in super::super) struct Sum<'a> {
    /// Rows of one order.
    pub(in super::super) basis: &'a [f64],
    /// From a row to the next.
    pub(in super::super) stride: usize,
    /// Column of the first sum.
    pub(in super::super) first: usize,
    /// The control values of the span, degree + 1 of them.
    pub(in super::super) control: &'a [f64],
    /// Where the sums go.
    pub(in super::super) out: &'a mut [f64],
}

impl WithSimd for Sum<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for_degree!(self.control.len() - 1, sum::<S>(simd, self));
    }
}

#[inline(always)]
fn sum<S: Simd, const N: usize>(simd: S, job: Sum<'_>, p: usize) {
    let control = &job.control[..=p];
    let mut column = job.first;
    for out in job.out.chunks_mut(S::F64_LANES) {
        let lanes = column..column + out.len();
        let mut total = times(simd, load(simd, &job.basis[lanes.clone()]), control[0]);
        for (a, &c) in control.iter().enumerate().skip(1) {
            let at = a * job.stride;
            let n = load(simd, &job.basis[at + lanes.start..at + lanes.end]);
            total = simd.add_f64s(total, times(simd, n, c));
        }
        store(simd, out, total);
        column += out.len();
    }
}

/// Points; see [`scalar::project`](super::scalar::project).
#[derive(Debug)]
pub(in super::super) struct Project<'a, 'b> {
    /// Rows of values.
    pub(in super::super) basis: &'a [f64],
    /// From a row to the next.
    pub(in super::super) stride: usize,
    /// The columns to do.
    pub(in super::super) window: Range<usize>,
    /// Weighted coordinates of the control points of the span.
    pub(in super::super) coordinates: &'a [&'a [f64]],
    /// Their weights.
    pub(in super::super) weights: &'a [f64],
    /// A slice for each coordinate.
    pub(in super::super) out: &'a mut [&'b mut [f64]],
}

impl WithSimd for Project<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for_degree!(self.weights.len() - 1, project::<S>(simd, self));
    }
}

#[inline(always)]
fn project<S: Simd, const N: usize>(simd: S, job: Project<'_, '_>, p: usize) {
    let mut n = [simd.splat_f64s(0.0); N];
    let n = &mut n[..=p];
    let mut column = job.window.start;
    while column < job.window.end {
        let lanes = S::F64_LANES.min(job.window.end - column);
        for (a, n) in n.iter_mut().enumerate() {
            let at = a * job.stride + column;
            *n = load(simd, &job.basis[at..at + lanes]);
        }
        let w = dot(simd, n, &job.weights[..=p]);
        for (control, out) in job.coordinates.iter().zip(job.out.iter_mut()) {
            let point = simd.div_f64s(dot(simd, n, &control[..=p]), w);
            store(simd, &mut out[column..column + lanes], point);
        }
        column += lanes;
    }
}

/// The sum of lanes times numbers, in order; there is at least one.
#[inline(always)]
fn dot<S: Simd>(simd: S, n: &[S::f64s], control: &[f64]) -> S::f64s {
    let mut total = times(simd, n[0], control[0]);
    for (&n, &c) in n.iter().zip(control).skip(1) {
        total = simd.add_f64s(total, times(simd, n, c));
    }
    total
}

/// Points of curves; see [`scalar::curves`](super::scalar::curves).
#[derive(Debug)]
pub(in super::super) struct CurvePoints<'a, 'b> {
    /// The curves.
    pub(in super::super) curves: &'a Curves<'a>,
    /// x, y and z.
    pub(in super::super) out: [&'b mut [f64]; 3],
}

impl WithSimd for CurvePoints<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for_degree!(self.curves.degree, curve_points::<S>(simd, self));
    }
}

#[inline(always)]
fn curve_points<S: Simd, const N: usize>(simd: S, job: CurvePoints<'_, '_>, p: usize) {
    let zero = simd.splat_f64s(0.0);
    let one = simd.splat_f64s(1.0);
    let CurvePoints { curves, out } = job;
    let [x, y, z] = out;
    let (control_points, samples) = (curves.control_points, curves.samples);
    let count = curves.net[3].len() / control_points;
    let [mut cx, mut cy, mut cz, mut cw] = [[zero; N]; 4];
    for curve in 0..count {
        for run in curves.runs {
            let first = curve * control_points + run.span - curves.degree;
            for a in 0..=p {
                cx[a] = simd.splat_f64s(curves.net[0][first + a]);
                cy[a] = simd.splat_f64s(curves.net[1][first + a]);
                cz[a] = simd.splat_f64s(curves.net[2][first + a]);
                cw[a] = simd.splat_f64s(curves.net[3][first + a]);
            }
            let (start, end) = (run.window.start, run.window.end);
            let to = curve * samples;
            let (x, x_rest) = S::as_mut_simd_f64s(&mut x[to + start..to + end]);
            let (y, y_rest) = S::as_mut_simd_f64s(&mut y[to + start..to + end]);
            let (z, z_rest) = S::as_mut_simd_f64s(&mut z[to + start..to + end]);
            let mut n = [zero; N];
            for (i, ((x, y), z)) in x.iter_mut().zip(y).zip(z).enumerate() {
                let column = start + i * S::F64_LANES;
                for a in 0..=p {
                    let at = a * curves.stride + column;
                    n[a] = S::as_simd_f64s(&curves.basis[at..at + S::F64_LANES]).0[0];
                }
                let r = simd.div_f64s(one, lane_dot(simd, &n[..=p], &cw[..=p]));
                *x = simd.mul_f64s(lane_dot(simd, &n[..=p], &cx[..=p]), r);
                *y = simd.mul_f64s(lane_dot(simd, &n[..=p], &cy[..=p]), r);
                *z = simd.mul_f64s(lane_dot(simd, &n[..=p], &cz[..=p]), r);
            }
            if !x_rest.is_empty() {
                let column = end - x_rest.len();
                for a in 0..=p {
                    let at = a * curves.stride + column;
                    n[a] = simd.partial_load_f64s(&curves.basis[at..at + x_rest.len()]);
                }
                let r = simd.div_f64s(one, lane_dot(simd, &n[..=p], &cw[..=p]));
                let point = simd.mul_f64s(lane_dot(simd, &n[..=p], &cx[..=p]), r);
                simd.partial_store_f64s(x_rest, point);
                let point = simd.mul_f64s(lane_dot(simd, &n[..=p], &cy[..=p]), r);
                simd.partial_store_f64s(y_rest, point);
                let point = simd.mul_f64s(lane_dot(simd, &n[..=p], &cz[..=p]), r);
                simd.partial_store_f64s(z_rest, point);
            }
        }
    }
}

/// The sum of products of lanes, in order; there is at least one.
#[inline(always)]
fn lane_dot<S: Simd>(simd: S, n: &[S::f64s], control: &[S::f64s]) -> S::f64s {
    let mut total = simd.mul_f64s(n[0], control[0]);
    for (&n, &c) in n.iter().zip(control).skip(1) {
        total = simd.add_f64s(total, simd.mul_f64s(n, c));
    }
    total
}
