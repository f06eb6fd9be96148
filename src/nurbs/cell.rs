//! Rational Bézier cells: one polynomial piece of a surface or a volume.
//!
//! * Shapes: homogeneous control points, the first index fastest, (p_1 + 1)(p_2 + 1).. of them.
//! * Accuracy: de Casteljau's means with positive factors; each level rounds a point by a few units
//!   in the last place.
//! * Source: G. Farin, *Curves and Surfaces for CAGD*, 5th ed., chapter 14.

use super::knot_vector::check_degree;
use super::{Homogeneous, NurbsError};

/// A rational Bézier map of N parameters, each in [0, 1], into space.
///
/// A value that exists is valid: degrees from 1 to [`MAX_DEGREE`](super::MAX_DEGREE), weights finite
/// and greater than zero, coordinates finite.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierCell<const N: usize> {
    degrees: [usize; N],
    points: Vec<Homogeneous<3>>,
}

impl<const N: usize> BezierCell<N> {
    /// The cell with these homogeneous control points.
    ///
    /// # Errors
    /// [`NurbsError::Degree`], [`NurbsError::Length`], [`NurbsError::Weight`],
    /// [`NurbsError::ControlPoint`].
    pub fn new(degrees: [usize; N], points: Vec<Homogeneous<3>>) -> Result<Self, NurbsError> {
        for degree in degrees {
            check_degree(degree)?;
        }
        let expected = degrees.iter().map(|p| p + 1).product();
        if points.len() != expected {
            return Err(NurbsError::Length {
                what: "control points",
                found: points.len(),
                expected,
            });
        }
        for (index, h) in points.iter().enumerate() {
            h.checked(index)?;
        }
        Ok(Self { degrees, points })
    }

    /// The degrees.
    #[must_use]
    pub fn degrees(&self) -> [usize; N] {
        self.degrees
    }

    /// The homogeneous control points, the first index fastest.
    #[must_use]
    pub fn control_points(&self) -> &[Homogeneous<3>] {
        &self.points
    }
}
