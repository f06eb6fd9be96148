//! Turns in degrees: where they start and how far they go.

use super::ConstructError;
use crate::math::{Dd, Real};

/// An angle turned from a start angle, in degrees, counter-clockwise seen from the tip of the axis;
/// negative angles turn clockwise.
///
/// ```
/// # use voxlathe::construct::AngleInterval;
/// let half = AngleInterval::new(90.0, 180.0)?;
/// assert_eq!((half.start(), half.angle(), half.is_full()), (90.0, 180.0, false));
/// assert!(AngleInterval::new(0.0, 400.0).is_err());
/// # Ok::<(), voxlathe::construct::ConstructError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleInterval {
    start: f64,
    angle: f64,
}

impl AngleInterval {
    /// The full turn from 0.
    pub const FULL: Self = Self {
        start: 0.0,
        angle: 360.0,
    };

    /// The turn by `angle` degrees from `start`.
    ///
    /// * `start`: degrees, finite.
    /// * `angle`: degrees, not 0 and at most 360 either way.
    ///
    /// # Errors
    /// [`ConstructError::Turn`].
    pub fn new(start: f64, angle: f64) -> Result<Self, ConstructError> {
        if start.is_finite() && angle != 0.0 && angle.abs() <= 360.0 {
            Ok(Self { start, angle })
        } else {
            Err(ConstructError::Turn { start, angle })
        }
    }

    /// Where the turn starts, in degrees.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.start
    }

    /// The angle turned, in degrees.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Whether the turn ends where it starts.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.angle.abs() == 360.0
    }

    /// Cosine and sine at the share `numerator / denominator` of the turn.
    pub(super) fn direction(&self, numerator: usize, denominator: usize) -> [Dd; 2] {
        if numerator == denominator && self.is_full() {
            // What closes, closes to the last bit.
            return self.direction(0, 1);
        }
        let part = Dd::of(self.angle) * Dd::of(numerator as f64) / Dd::of(denominator as f64);
        let (sin, cos) = (Dd::of(self.start) + part).sin_cos_degrees();
        [cos, sin]
    }
}
