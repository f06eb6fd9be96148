//! Every bound that is a choice, each with its reason.

/// Half an ulp of 1: the largest relative error of one f64 operation.
pub const U: f64 = f64::EPSILON / 2.0;

/// Distance, relative to the half-plane's unit, below which a double-double decision calls a point
/// met by the boundary. The profile is scaled into the unit square, evaluation there loses some
/// tens of units of 2^-106; 2^-88 is thousands of times that and 2^36 times below one f64 ulp, so
/// it is far inside the rounding band in which either answer is right.
pub const ON_BOUNDARY: f64 = 1.0 / (1_u128 << 88) as f64;

/// Width of a parameter interval that no further halving of a double-double narrows usefully.
pub const PARAMETER_RESOLUTION: f64 = 1.0 / (1_u128 << 98) as f64;

/// A gap between consecutive curves, as a share of the profile's size, that is closed by a segment
/// instead of refused.
pub const GAP: f64 = 1e-9;

/// How far below r = 0 a curve may reach, as a share of the profile's size, and count as r = 0.
pub const BELOW_AXIS: f64 = 1e-12;

/// Accumulated rounding of `operations` f64 operations: γ(n) = n u / (1 - n u).
#[must_use]
pub fn gamma(operations: f64) -> f64 {
    operations * U / (1.0 - operations * U)
}
