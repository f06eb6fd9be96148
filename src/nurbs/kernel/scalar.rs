//! The inner loops, one sample at a time: the definition.
//!
//! ```text
//!   fill      rows[q (p + 1) + a][s] = derivative of order q of N_{k-p+a} at sample s
//!   sum       out[s] = ((N_0 c_0) + N_1 c_1) + ... + N_p c_p
//!   project   out[s] = sum of A / sum of w
//!   curves    out[s] = sum of A · (1 / sum of w), for many curves and all their spans
//! ```
//!
//! All samples of a call (but of `curves`) lie in one span, so the c are the same for all. Products and sums are
//! rounded one by one.

use super::super::MAX_DEGREE;
use super::super::basis::SpanFactors;
use super::{Curves, Rows};

/// Basis functions and derivatives up to `order` (0 to 2) of `samples`, from column `first` on.
pub(in super::super) fn fill(
    factors: &SpanFactors,
    samples: &[f64],
    order: usize,
    rows: &mut Rows<'_>,
    first: usize,
) {
    let mut local = [0.0; 3 * (MAX_DEGREE + 1)];
    let local = &mut local[..(order + 1) * (factors.degree + 1)];
    for (s, &u) in samples.iter().enumerate() {
        factors.evaluate(u, order, local);
        for (row, &value) in local.iter().enumerate() {
            rows.values[row * rows.stride + first + s] = value;
        }
    }
}

/// The sums of `basis` (rows of one order, `stride` apart) times `control`, from column `first` on.
pub(in super::super) fn sum(
    basis: &[f64],
    stride: usize,
    first: usize,
    control: &[f64],
    out: &mut [f64],
) {
    for (s, out) in out.iter_mut().enumerate() {
        *out = sum_at(basis, stride, first + s, control);
    }
}

/// One sum.
#[inline(always)]
fn sum_at(basis: &[f64], stride: usize, column: usize, control: &[f64]) -> f64 {
    let mut sum = basis[column] * control[0];
    for (a, c) in control.iter().enumerate().skip(1) {
        sum += basis[a * stride + column] * c;
    }
    sum
}

/// The points A / w: `coordinates` and `weights` are the control values of the span, `out` a slice
/// for each coordinate, `window` the part of it (and of the basis rows) to write.
pub(in super::super) fn project(
    basis: &[f64],
    stride: usize,
    window: std::ops::Range<usize>,
    coordinates: &[&[f64]],
    weights: &[f64],
    out: &mut [&mut [f64]],
) {
    let span = window.len();
    debug_assert!(out.iter().all(|o| o.len() >= window.start + span));
    let p = weights.len() - 1;
    for column in window {
        let w = sum_at(basis, stride, column, weights);
        for (control, out) in coordinates.iter().zip(out.iter_mut()) {
            out[column] = sum_at(basis, stride, column, &control[..=p]) / w;
        }
    }
}

/// The points of curves, with one division each; `out` holds x, y and z, curve after curve.
pub(in super::super) fn curves(job: &Curves<'_>, out: [&mut [f64]; 3]) {
    let count = job.net[3].len() / job.control_points;
    for curve in 0..count {
        let (from, to) = (curve * job.control_points, curve * job.samples);
        for run in job.runs {
            let first = from + run.span - job.degree;
            let control = job.net.map(|c| &c[first..=first + job.degree]);
            for column in run.window.clone() {
                let r = 1.0 / sum_at(job.basis, job.stride, column, control[3]);
                for axis in 0..3 {
                    out[axis][to + column] =
                        sum_at(job.basis, job.stride, column, control[axis]) * r;
                }
            }
        }
    }
}
