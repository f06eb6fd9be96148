//! Axis-aligned boxes in space.

use glam::DVec3;

/// An axis-aligned box, `min` to `max`, in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// Lengths of the sides.
    #[must_use]
    pub fn sides(&self) -> DVec3 {
        self.max - self.min
    }

    /// The longest side.
    #[must_use]
    pub fn longest_side(&self) -> f64 {
        self.sides().max_element()
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}
