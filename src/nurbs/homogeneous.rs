//! Homogeneous points: where rational splines are linear.
//!
//! ```text
//!   P^h = (A, w),   A = w P          P = A / w
//! ```
//!
//! Every construction on curves, surfaces and volumes (insertion, splitting, elevation, evaluation)
//! is a weighted mean of homogeneous points, coordinate by coordinate, and ends with one division.
//!
//! * Units: A in model units times weight; w has none.
//! * Accuracy: a mean with non-negative factors α + β = 1 errs by at most γ(2) of the larger value,
//!   and a coordinate or weight that both points share is kept exactly.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §1.4 and §4.2.

use super::NurbsError;

/// A point of D coordinates times its weight, together with the weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homogeneous<const D: usize> {
    /// A = w P, in model units times weight.
    pub weighted: [f64; D],
    /// w, greater than zero in control points.
    pub weight: f64,
}

impl<const D: usize> Homogeneous<D> {
    /// All coordinates and the weight zero: where a sum starts.
    pub const ZERO: Self = Self {
        weighted: [0.0; D],
        weight: 0.0,
    };

    /// The homogeneous form of `point` with `weight`.
    ///
    /// ```
    /// # use voxlathe::nurbs::Homogeneous;
    /// let h = Homogeneous::from_point([1.0, 2.0], 0.5);
    /// assert_eq!(h.weighted, [0.5, 1.0]);
    /// assert_eq!(h.to_point(), [1.0, 2.0]);
    /// ```
    #[must_use]
    pub fn from_point(point: [f64; D], weight: f64) -> Self {
        Self {
            weighted: point.map(|x| x * weight),
            weight,
        }
    }

    /// The point A / w, in model units.
    #[must_use]
    pub fn to_point(self) -> [f64; D] {
        self.weighted.map(|a| a / self.weight)
    }

    /// The mean α · `self` + β · `other`, for α + β = 1.
    ///
    /// Coordinates and weights that the two share are kept exactly, whatever α and β round to.
    ///
    /// ```
    /// # use voxlathe::nurbs::Homogeneous;
    /// let [a, b] = [[0.0, 0.1], [4.0, 0.1]].map(|p| Homogeneous::from_point(p, 1.0));
    /// assert_eq!(a.mix(0.75, b, 0.25).to_point(), [1.0, 0.1]);
    /// ```
    #[must_use]
    pub fn mix(self, alpha: f64, other: Self, beta: f64) -> Self {
        let mean = |x: f64, y: f64| if x == y { x } else { alpha * x + beta * y };
        Self {
            weighted: std::array::from_fn(|i| mean(self.weighted[i], other.weighted[i])),
            weight: mean(self.weight, other.weight),
        }
    }

    /// `self` + `factor` · `other`, rounded after the product and after the sum.
    #[must_use]
    pub fn plus(self, factor: f64, other: Self) -> Self {
        Self {
            weighted: std::array::from_fn(|i| self.weighted[i] + factor * other.weighted[i]),
            weight: self.weight + factor * other.weight,
        }
    }

    /// The point, when it can be control point `index` of something.
    pub(super) fn checked(self, index: usize) -> Result<Self, NurbsError> {
        if !(self.weight > 0.0 && self.weight.is_finite()) {
            return Err(NurbsError::Weight {
                index,
                found: self.weight,
            });
        }
        match self.weighted.iter().position(|a| !a.is_finite()) {
            Some(axis) => Err(NurbsError::ControlPoint {
                index,
                axis,
                found: self.weighted[axis] / self.weight,
                weight: self.weight,
            }),
            None => Ok(self),
        }
    }
}

/// Whether points and weights, as many of each, can be control points: weights greater than zero, and
/// coordinates finite, with their weight and without.
pub(super) fn check_control<const D: usize>(
    points: &[[f64; D]],
    weights: &[f64],
) -> Result<(), NurbsError> {
    for (index, (&point, &weight)) in points.iter().zip(weights).enumerate() {
        if !(weight > 0.0 && weight.is_finite()) {
            return Err(NurbsError::Weight {
                index,
                found: weight,
            });
        }
        for (axis, found) in point.into_iter().enumerate() {
            if !(found.is_finite() && (found * weight).is_finite()) {
                return Err(NurbsError::ControlPoint {
                    index,
                    axis,
                    found,
                    weight,
                });
            }
        }
    }
    Ok(())
}

/// Derivatives of A / w from those of A and w.
///
/// ```text
///   X^(k) = (A^(k) - Σ_{i=1..k} C(k, i) w^(i) X^(k-i)) / w
/// ```
///
/// * `derivatives`: the homogeneous value and its derivatives by one variable, in order; the weight
///   of the first greater than zero.
///
/// Returns as many derivatives of the point, in model units over parameter units.
///
/// # Source
/// Piegl & Tiller, Algorithm A4.2, p. 127.
///
/// ```
/// # use voxlathe::nurbs::{Homogeneous, rational_derivatives};
/// // 1 / (1 + u) at u = 1: value 1/2, first derivative -1/4, second 1/4.
/// let h = |a: f64, weight| Homogeneous { weighted: [a], weight };
/// let x = rational_derivatives(&[h(1.0, 2.0), h(0.0, 1.0), h(0.0, 0.0)]);
/// assert_eq!(x, [[0.5], [-0.25], [0.25]]);
/// ```
#[must_use]
pub fn rational_derivatives<const D: usize>(derivatives: &[Homogeneous<D>]) -> Vec<[f64; D]> {
    let mut points: Vec<[f64; D]> = Vec::with_capacity(derivatives.len());
    for (k, h) in derivatives.iter().enumerate() {
        let mut numerator = h.weighted;
        let mut binomial = 1.0;
        for i in 1..=k {
            binomial = binomial * (k + 1 - i) as f64 / i as f64;
            let factor = binomial * derivatives[i].weight;
            for (a, x) in numerator.iter_mut().zip(points[k - i]) {
                *a -= factor * x;
            }
        }
        points.push(numerator.map(|a| a / derivatives[0].weight));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotient_of_polynomials() {
        // A = u^3, w = 1 + u^2 at u = 2, against derivatives worked out by hand.
        let u: f64 = 2.0;
        let h = |a: f64, weight: f64| Homogeneous {
            weighted: [a],
            weight,
        };
        let found = rational_derivatives(&[
            h(u.powi(3), 1.0 + u * u),
            h(3.0 * u * u, 2.0 * u),
            h(6.0 * u, 2.0),
            h(6.0, 0.0),
        ]);
        // u^3 / (1 + u^2) = u - u / (1 + u^2), whose second part has the derivatives
        // (1 - u^2) / (1 + u^2)^2, 2 u (u^2 - 3) / (1 + u^2)^3, -6 (u^4 - 6 u^2 + 1) / (1 + u^2)^4.
        let q = 1.0 + u * u;
        let expected = [
            u - u / q,
            1.0 - (1.0 - u * u) / (q * q),
            -2.0 * u * (u * u - 3.0) / q.powi(3),
            6.0 * (u.powi(4) - 6.0 * u * u + 1.0) / q.powi(4),
        ];
        for (f, e) in found.iter().zip(expected) {
            assert!((f[0] - e).abs() <= 1e-15 * 8.0, "{f:?} for {e}");
        }
    }

    #[test]
    fn shared_values_survive_a_mean() {
        let a = Homogeneous {
            weighted: [0.1, 3.0],
            weight: 0.3,
        };
        let b = Homogeneous {
            weighted: [0.1, 5.0],
            weight: 0.3,
        };
        // 0.7 + 0.3 rounds, but what both points share does not move.
        let m = a.mix(0.7, b, 1.0 - 0.7);
        assert_eq!((m.weighted[0], m.weight), (0.1, 0.3));
    }

    #[test]
    fn bad_points_are_refused() {
        let h = Homogeneous::from_point([1.0, f64::INFINITY], 2.0);
        assert!(matches!(
            h.checked(4),
            Err(NurbsError::ControlPoint {
                index: 4,
                axis: 1,
                ..
            })
        ));
        let h = Homogeneous::from_point([1.0], f64::NAN);
        assert!(matches!(h.checked(0), Err(NurbsError::Weight { .. })));
    }
}
