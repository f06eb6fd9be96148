//! Line integrals along the boundary.
//!
//! ```text
//!   ∮ r² dz = Σ ± ∫ (r² - r_c²) z' dt         region on the left; V of a full turn = π ∮ r² dz
//! ```
//!
//! The constant `r_c`, the middle of the radii, integrates to nothing around closed loops (parts
//! on the axis included) and keeps the digits of a thin ring far from its axis.

use super::boundary::BoundaryPiece;
use crate::math::bernstein;
use crate::math::quadrature::{self, Integral};

/// ∮ r² dz with its error estimate.
pub(crate) fn r_squared_dz(boundary: &[BoundaryPiece]) -> Integral {
    let radii = boundary.iter().map(|b| &b.piece.bounds);
    let low = radii.clone().fold(f64::INFINITY, |m, b| m.min(b.min[0]));
    let high = radii.fold(0.0_f64, |m, b| m.max(b.max[0]));
    let centre = 0.5 * (low + high);
    let mut total = Integral::default();
    let mut carry = 0.0;
    for part in boundary {
        let piece = &part.piece;
        let offset = piece.twin.origin[0] - centre;
        let [r, z, w] = &piece.twin.coefficients;
        let integrand = |t: f64| {
            let (r, _) = bernstein::evaluate_with_derivative(r, t);
            let (z, dz) = bernstein::evaluate_with_derivative(z, t);
            let (w, dw) = bernstein::evaluate_with_derivative(w, t);
            let delta = r / w + offset;
            delta * (delta + 2.0 * centre) * (dz * w - z * dw) / (w * w)
        };
        let scale = (high - low) * (high + low) * (piece.bounds.max[1] - piece.bounds.min[1]);
        let one = quadrature::integrate(integrand, 0.0, 1.0, 1e-16 * scale, 64);
        let value = if part.forward { one.value } else { -one.value };
        // Neumaier's summation: the pieces of a thin ring nearly cancel.
        let sum = total.value + value;
        carry += if total.value.abs() >= value.abs() {
            (total.value - sum) + value
        } else {
            (value - sum) + total.value
        };
        total = Integral {
            value: sum,
            error: total.error + one.error,
        };
    }
    total.value += carry;
    total
}
