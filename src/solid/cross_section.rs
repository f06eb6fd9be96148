//! The cross-sections of a voxel between two heights of its corners, by their sides.
//!
//! The sides of a section stay in the voxel's, so each has one direction, and its distance d from the axis and the
//! places of its ends along it, from the foot of the axis, are linear in the height. The area within a disc about the
//! axis is the sum over the sides, counter-clockwise, with `w² = r² - d²`:
//!
//! ```text
//!   ½ d × length within the disc + ½ r² × angle seen from the axis of what is beyond
//! ```

use glam::DVec2;
use smallvec::SmallVec;

/// A number that is linear in the height above the voxel's centre.
#[derive(Debug, Clone, Copy)]
struct Linear {
    at_centre: f64,
    slope: f64,
}

impl Linear {
    fn at(self, h: f64) -> f64 {
        self.at_centre + self.slope * h
    }
}

/// A corner of the sections: `at + slope h`, from the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: DVec2,
    pub(super) slope: DVec2,
}

impl Corner {
    fn place(&self, h: f64) -> DVec2 {
        self.at + self.slope * h
    }

    /// The least and the greatest radius between two heights.
    pub(super) fn radii(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        let ends = [low, high].map(|h| self.place(h).length());
        let nearest = -self.at.dot(self.slope) / self.slope.length_squared();
        let least = if nearest > low && nearest < high {
            self.place(nearest).length()
        } else {
            ends[0].min(ends[1])
        };
        [least, ends[0].max(ends[1])]
    }
}

#[derive(Debug, Clone, Copy)]
struct Side {
    /// Distance of the line from the axis, positive with the axis on the left.
    distance: Linear,
    from: Linear,
    to: Linear,
}

/// Sections between two heights.
#[derive(Debug, Clone)]
pub(super) struct CrossSections {
    sides: SmallVec<[Side; 6]>,
    pub(super) corners: SmallVec<[Corner; 6]>,
}

impl CrossSections {
    /// The sections with these corners, counter-clockwise; `middle` is a height at which no two coincide.
    pub(super) fn new(corners: SmallVec<[Corner; 6]>, middle: f64) -> Self {
        let next = |i: usize| corners[if i + 1 == corners.len() { 0 } else { i + 1 }];
        let side = |(i, a): (usize, &Corner)| {
            let b = next(i);
            let along = (b.place(middle) - a.place(middle)).normalize_or_zero();
            let linear = |f: &dyn Fn(DVec2) -> f64, c: &Corner| Linear {
                at_centre: f(c.at),
                slope: f(c.slope),
            };
            let place = |v: DVec2| along.dot(v);
            Side {
                distance: linear(&|v| v.perp_dot(along), a),
                from: linear(&place, a),
                to: linear(&place, &b),
            }
        };
        Self {
            sides: corners.iter().enumerate().map(side).collect(),
            corners,
        }
    }

    /// The area of the section at height `h` above the voxel's centre.
    fn whole(&self, h: f64) -> f64 {
        let sides = self.sides.iter();
        let twice = sides.map(|s| s.distance.at(h) * (s.to.at(h) - s.from.at(h)));
        0.5 * twice.sum::<f64>()
    }

    /// The volume between two heights.
    pub(super) fn volume(&self, [low, high]: [f64; 2]) -> f64 {
        // Of second degree in the height: Simpson's rule is exact.
        let middle = self.whole(0.5 * (low + high));
        (high - low) * (self.whole(low) + 4.0 * middle + self.whole(high)) / 6.0
    }

    /// The area of the section at height `h` within the disc of radius `r`.
    pub(super) fn within_disc(&self, h: f64, r: f64) -> f64 {
        let square = r * r;
        let mut twice = 0.0;
        for side in &self.sides {
            let (d, from, to) = (side.distance.at(h), side.from.at(h), side.to.at(h));
            let half = square - d * d;
            if half <= 0.0 {
                twice += square * angle(d, from, to);
                continue;
            }
            let half = half.sqrt();
            let (a, b) = (from.clamp(-half, half), to.clamp(-half, half));
            twice += d * (b - a);
            if from < a {
                twice += square * angle(d, from, a.min(to));
            }
            if to > b {
                twice += square * angle(d, b.max(from), to);
            }
        }
        0.5 * twice
    }

    /// For each side's line its distance from the axis at the voxel's centre, and how that changes with the height.
    pub(super) fn lines(&self) -> impl Iterator<Item = [f64; 2]> {
        self.sides
            .iter()
            .map(|s| [s.distance.at_centre, s.distance.slope])
    }

    /// The least and the greatest distance of each side's line from the axis between two heights.
    pub(super) fn distances(&self, heights: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        self.sides.iter().map(move |s| {
            let [a, b] = heights.map(|h| s.distance.at(h));
            let least = if a * b < 0.0 {
                0.0
            } else {
                a.abs().min(b.abs())
            };
            [least, a.abs().max(b.abs())]
        })
    }
}

/// The angle seen from the origin of the part from `from` to `to` of a line at distance `d`.
fn angle(d: f64, from: f64, to: f64) -> f64 {
    let (y, x) = (d * (to - from), d * d + from * to);
    if y.abs() < 0.04 * x {
        // The seventh term leaves 0.04^14 / 15.
        let t = y / x;
        let t2 = t * t;
        let terms = 1.0 / 3.0
            - t2 * (1.0 / 5.0
                - t2 * (1.0 / 7.0 - t2 * (1.0 / 9.0 - t2 * (1.0 / 11.0 - t2 / 13.0))));
        return t * (1.0 - t2 * terms);
    }
    y.atan2(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::disc::{Polygon, polygon_disc_area};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn areas_are_those_of_polygons_and_discs(
            centre in [-3.0..3.0_f64, -3.0..3.0],
            turn in 0.0..6.3_f64,
            slope in [-0.4..0.4_f64, -0.4..0.4],
            count in 3..7_u32,
            r in 0.0..4.0_f64,
            h in -0.5..0.5_f64,
        ) {
            let corners = (0..count).map(|i| {
                let a = turn + std::f64::consts::TAU * f64::from(i) / f64::from(count);
                let at = DVec2::from(centre) + DVec2::from_angle(a);
                // Sides keep their directions where all corners move alike, or away from the middle alike.
                Corner { at, slope: DVec2::from(slope) + 0.3 * DVec2::from_angle(a) }
            });
            let sections = CrossSections::new(corners.collect(), 0.0);
            let polygon: Polygon = sections.corners.iter().map(|c| c.place(h)).collect();
            let wanted = polygon_disc_area(&polygon, r);
            let found = sections.within_disc(h, r);
            prop_assert!((found - wanted).abs() < 1e-12, "{found} for {wanted}");
            let whole = sections.within_disc(h, 9.0);
            prop_assert!((whole - sections.whole(h)).abs() < 1e-12);
        }
    }
}
