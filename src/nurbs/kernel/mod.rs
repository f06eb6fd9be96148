//! The inner loops over samples.
//!
//! The plain loops in [`scalar`] are the definition. Those in [`wide`] do the same operations in
//! the same order for 4 or 8 samples of one span at a time, and neither uses a fused multiply-add,
//! so the two agree bit for bit and a run on one machine can be reproduced on another.

pub(super) mod scalar;
pub(super) mod wide;

use super::cache::Run;

/// Curves over one table of basis functions, to be evaluated at all of its samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curves<'a> {
    /// Rows of basis values.
    pub(super) basis: &'a [f64],
    /// From a row to the next.
    pub(super) stride: usize,
    /// The runs of samples.
    pub(super) runs: &'a [Run],
    /// The degree.
    pub(super) degree: usize,
    /// Control points of a curve.
    pub(super) control_points: usize,
    /// Samples of a curve.
    pub(super) samples: usize,
    /// Weighted coordinates x, y, z and weights, curve after curve.
    pub(super) net: [&'a [f64]; 4],
}

/// Rows of equal length in one slice: row i is `values[i * stride ..][..samples]`.
#[derive(Debug)]
pub(super) struct Rows<'a> {
    /// The values.
    pub(super) values: &'a mut [f64],
    /// From a row to the next.
    pub(super) stride: usize,
}
