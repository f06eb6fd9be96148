//! Axis-aligned boxes in space.

use super::similarity::DdVec;
use super::{Dd, Real};
use glam::DVec3;

/// An axis-aligned box, `min` to `max`, in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

/// Relative rounding of a reach in double-double arithmetic, with room for some sums and products.
const REACH_KNOWN_TO: f64 = 1e-28;

impl Aabb {
    /// The box from `origin + reach(k, -1)` to `origin + reach(k, 1)` along each axis k, rounded
    /// outward: no part of it is left out where an end is not an f64. Differences below what the
    /// reaches are known to do not count, so that ends that are meant to be f64 are.
    #[must_use]
    pub(crate) fn around(origin: DdVec, reach: impl Fn(usize, f64) -> Dd) -> Self {
        let end = |k: usize, sign: f64| {
            let reach = reach(k, sign);
            let nearest = (origin[k] + reach).f64();
            // Apart from the origin, which may be so far that the reach is all lost in the sum.
            let lost = (origin[k] - Dd::of(nearest)) + reach;
            if lost * Dd::of(sign) <= reach.abs() * Dd::of(REACH_KNOWN_TO) {
                nearest
            } else if sign > 0.0 {
                nearest.next_up()
            } else {
                nearest.next_down()
            }
        };
        let ends = |sign: f64| DVec3::from_array(std::array::from_fn(|k| end(k, sign)));
        Self {
            min: ends(-1.0),
            max: ends(1.0),
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    /// The interval along x of a reach of ±`reach` about `origin`.
    fn interval(origin: f64, reach: Dd) -> [f64; 2] {
        let b = Aabb::around([origin, 0.0, 0.0].map(Dd::of), |_, sign| {
            reach * Dd::of(sign)
        });
        [b.min.x, b.max.x]
    }

    #[test]
    fn ends_that_are_numbers_are_themselves() {
        assert_eq!(interval(0.0, Dd::of(2.5)), [-2.5, 2.5]);
        assert_eq!(interval(1e6, Dd::of(0.25)), [999_999.75, 1_000_000.25]);
        assert_eq!(interval(1e6, Dd::ZERO), [1e6, 1e6]);
    }

    #[test]
    fn other_ends_are_outside() {
        let third = Dd::ONE / Dd::of(3.0);
        let [low, high] = interval(0.0, third);
        assert!(Dd::of(high) > third && high <= (1.0_f64 / 3.0).next_up());
        assert_eq!(low, -high);
        for origin in [1e16, 1e17, -1e17, 1e50, -1e100] {
            let [low, high] = interval(origin, Dd::of(4.0));
            let out = |end: f64| (Dd::of(end) - Dd::of(origin)).abs() >= Dd::of(4.0);
            assert!(out(low) && out(high), "{low} {high}");
            assert!(low >= origin - 4.0_f64.max(2.0 * (origin.abs().next_up() - origin.abs())));
        }
    }

    #[test]
    fn rounding_of_the_reach_moves_no_end() {
        let nearly = Dd::of(2.5) + Dd::of(1e-31);
        assert_eq!(interval(-1.0, nearly), [-3.5, 1.5]);
    }
}
