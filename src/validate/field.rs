//! What a signed distance must be, checked on stored values and their neighbours.
//!
//! ```text
//!   sign       φ <= 0 where the point is inside, and there alone
//!   steepness  |φ(p) - φ(q)| <= |p - q|, neighbours p and q, and two ulp of each for storing them
//!   slope      ||∇φ| - 1| <= (Σ s²)^½ / 2, s the change of slope along each axis within the stencil
//!   zero       where the sign changes the triangles are near: within the chord error and what a
//!              slope of 1 leaves of linear interpolation
//!   distance   of a single solid within the chord error of the distance to its triangles
//! ```
//!
//! The slope along an axis at the middle of three points lies between those on both sides, unless
//! something thinner than the stencil hides between them: where the check fails, the exact distance
//! is asked at a small step, and only its failure counts.

use super::PartMesh;
use crate::grid::GridSpec;
use crate::sample::stored;
use crate::solid::Assembly;
use glam::DVec3;

/// Violations of one kind that are kept to be shown.
const SHOWN: usize = 5;
/// Change of slope up to which a stencil counts as away from the medial axis.
const SMOOTH: f64 = 0.05;

/// A value that no distance has.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// Which check it is.
    pub check: &'static str,
    /// The voxel, where the point is its centre.
    pub voxel: Option<[usize; 3]>,
    /// The point, in scene units.
    pub point: DVec3,
    /// By how much it is off, and how much would be allowed, in scene units or as a slope.
    pub off: [f64; 2],
}

/// Counts of what was checked and of what failed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FieldChecks {
    /// Values that are not finite.
    pub not_finite: u64,
    /// Values whose sign is not that of the membership.
    pub wrong_sign: u64,
    /// Pairs of neighbours looked at, and those steeper than 1.
    pub steepness: [u64; 2],
    /// Slopes looked at away from the medial axis, and slopes anywhere that fail.
    pub slope: [u64; 2],
    /// Largest ||∇φ| - 1| away from the medial axis.
    pub gradient_max_error: f64,
    /// Changes of sign looked at, and those with no triangle near.
    pub zero: [u64; 2],
    /// Distances to triangles looked at, and those that fail.
    pub distance: [u64; 2],
    /// Largest difference from the distance to the triangles, in scene units.
    pub distance_max_error: f64,
    /// The first violations.
    pub violations: Vec<Violation>,
}

impl FieldChecks {
    /// Whether nothing failed.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.not_finite == 0
            && self.wrong_sign == 0
            && [self.steepness, self.slope, self.zero, self.distance]
                .iter()
                .all(|c| c[1] == 0)
    }

    pub(super) fn add(&mut self, other: Self) {
        self.not_finite += other.not_finite;
        self.wrong_sign += other.wrong_sign;
        for (mine, theirs) in [
            (&mut self.steepness, other.steepness),
            (&mut self.slope, other.slope),
            (&mut self.zero, other.zero),
            (&mut self.distance, other.distance),
        ] {
            mine[0] += theirs[0];
            mine[1] += theirs[1];
        }
        self.gradient_max_error = self.gradient_max_error.max(other.gradient_max_error);
        self.distance_max_error = self.distance_max_error.max(other.distance_max_error);
        for violation in other.violations {
            self.keep(violation);
        }
    }

    fn keep(&mut self, violation: Violation) {
        let kept = self.violations.iter();
        if kept.filter(|v| v.check == violation.check).count() < SHOWN {
            self.violations.push(violation);
        }
    }
}

/// A stored value with those beside it along each axis, below and above.
pub(super) struct Stencil {
    pub(super) voxel: Option<[usize; 3]>,
    pub(super) point: DVec3,
    pub(super) inside: bool,
    pub(super) value: f32,
    pub(super) beside: [[Option<f32>; 2]; 3],
}

/// The checks.
pub(super) struct Field<'a> {
    assembly: &'a Assembly,
    meshes: &'a [PartMesh],
    spacing: DVec3,
    /// Whether stored distances are those of one solid.
    single: bool,
}

/// What storing a value may change it by, twice over.
fn rounding(value: f32) -> f64 {
    2.0 * f64::from(f32::EPSILON) * f64::from(value.abs()) + f64::from(f32::MIN_POSITIVE)
}

impl<'a> Field<'a> {
    pub(super) fn new(assembly: &'a Assembly, meshes: &'a [PartMesh], grid: &GridSpec) -> Self {
        Self {
            assembly,
            meshes,
            spacing: grid.spacing(),
            single: assembly.parts().len() == 1,
        }
    }

    /// The stencil about a point that need not be a voxel's centre.
    pub(super) fn around(&self, point: DVec3) -> Stencil {
        let value = |p: DVec3| stored(self.assembly.signed_distance(p));
        let mut beside = [[None; 2]; 3];
        for (axis, pair) in beside.iter_mut().enumerate() {
            let step = DVec3::AXES[axis] * self.spacing[axis];
            *pair = [Some(value(point - step)), Some(value(point + step))];
        }
        Stencil {
            voxel: None,
            point,
            inside: self.assembly.contains(point),
            value: value(point),
            beside,
        }
    }

    pub(super) fn check(&self, s: &Stencil, checks: &mut FieldChecks) {
        let fail = |checks: &mut FieldChecks, check, off: [f64; 2]| {
            checks.keep(Violation {
                check,
                voxel: s.voxel,
                point: s.point,
                off,
            });
        };
        if !s.value.is_finite() {
            checks.not_finite += 1;
            fail(checks, "finite", [f64::INFINITY, 0.0]);
            return;
        }
        if (s.value <= 0.0) != s.inside {
            checks.wrong_sign += 1;
            fail(checks, "sign", [f64::from(s.value), 0.0]);
        }
        let here = f64::from(s.value);
        for axis in 0..3 {
            let Some(next) = s.beside[axis][1].filter(|v| v.is_finite()) else {
                continue;
            };
            let there = f64::from(next);
            // The step between centres as they are in f64.
            let step = self.spacing[axis] + 4.0 * f64::EPSILON * s.point[axis].abs();
            let allowed = step + rounding(s.value) + rounding(next);
            checks.steepness[0] += 1;
            let off = (there - here).abs();
            if off > allowed {
                checks.steepness[1] += 1;
                fail(checks, "steepness", [off, allowed]);
            }
            if (here <= 0.0) != (there <= 0.0) {
                checks.zero[0] += 1;
                let [off, allowed] = self.zero(s.point, axis, [here, there]);
                if off > allowed {
                    checks.zero[1] += 1;
                    fail(checks, "zero", [off, allowed]);
                }
            }
        }
        if let Some([off, allowed]) = self.slope(s, checks) {
            checks.slope[1] += 1;
            fail(checks, "slope", [off, allowed]);
        }
        self.distances(s, checks);
    }

    /// How far the triangles are from where the sign changes, and how far they may be.
    fn zero(&self, point: DVec3, axis: usize, [here, there]: [f64; 2]) -> [f64; 2] {
        let step = self.spacing[axis];
        let (a, b) = (here.abs(), there.abs());
        let sum = (a + b).max(f64::MIN_POSITIVE);
        let at = point + DVec3::AXES[axis] * (step * (a / sum));
        // |φ| there is at most what is left of a slope of 1 from either end.
        let left = a.max(b) * (step / sum - 1.0).max(0.0);
        let stored = rounding(stored(a)) + rounding(stored(b));
        let room = 16.0 * f64::EPSILON * point.abs().max_element() + 2.0 * stored;
        let mut nearest = f64::INFINITY;
        let mut chord = 0.0_f64;
        for m in self.meshes {
            chord = chord.max(m.mesh.chord_error());
            let found = m.tree.nearest_within(at, nearest);
            nearest = found.map_or(nearest, |n| n.distance.min(nearest));
        }
        [nearest, chord + left + room]
    }

    /// The error of the slope and what it may be, where that fails.
    fn slope(&self, s: &Stencil, checks: &mut FieldChecks) -> Option<[f64; 2]> {
        let here = f64::from(s.value);
        let (mut gradient, mut changes, mut noise) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for axis in 0..3 {
            let [Some(below), Some(above)] = s.beside[axis] else {
                return None;
            };
            let step = self.spacing[axis];
            let (low, high) = (f64::from(below), f64::from(above));
            gradient[axis] = (high - low) / (2.0 * step);
            changes[axis] = (high + low - 2.0 * here) / step;
            noise += (rounding(below) + rounding(above) + 2.0 * rounding(s.value)) / step;
        }
        // An empty composite is infinitely far, as far as f32 goes.
        let infinite = |v: f64| v.abs() >= f64::from(f32::MAX);
        if infinite(here) || !gradient.is_finite() {
            return None;
        }
        let error = (gradient.length() - 1.0).abs();
        let smooth = changes.abs().max_element() <= SMOOTH;
        let allowed = 0.5 * changes.length() + noise;
        if smooth {
            checks.slope[0] += 1;
        }
        let worse = smooth && error > checks.gradient_max_error;
        if (worse || error > allowed) && !self.is_exact_about(s.point) {
            return None;
        }
        if error > allowed {
            return (!self.has_slope_one(s)).then_some([error, allowed]);
        }
        if worse {
            checks.gradient_max_error = error;
        }
        None
    }

    /// Whether the distances of a stencil are exact, not lower bounds.
    fn is_exact_about(&self, point: DVec3) -> bool {
        let exact = |p: DVec3| self.assembly.signed_distance_with_certainty(p).1;
        self.single
            || exact(point)
                && (0..3).all(|axis| {
                    let step = DVec3::AXES[axis] * self.spacing[axis];
                    exact(point - step) && exact(point + step)
                })
    }

    /// Whether the exact distance has slope 1 at the stencil's middle, and is what is stored there.
    fn has_slope_one(&self, s: &Stencil) -> bool {
        let here = self.assembly.signed_distance(s.point);
        let step = 1e-3 * self.spacing.min_element();
        let slope = |axis: usize| {
            let by = DVec3::AXES[axis] * step;
            let above = self.assembly.signed_distance(s.point + by);
            let below = self.assembly.signed_distance(s.point - by);
            (above - below) / (2.0 * step)
        };
        let length = DVec3::new(slope(0), slope(1), slope(2)).length();
        let same = (f64::from(s.value) - here).abs() <= rounding(s.value);
        // On the medial axis itself the slopes of both sides cancel.
        same && length <= 1.0 + 1e-3
    }

    /// Each solid's distance against that of its triangles.
    fn distances(&self, s: &Stencil, checks: &mut FieldChecks) {
        for (part, m) in self.assembly.parts().iter().zip(self.meshes) {
            let inside = part.contains(s.point);
            let exact = if self.single {
                f64::from(s.value.abs())
            } else {
                part.body().distance(s.point, inside, f64::INFINITY)
            };
            let Some(nearest) = m.tree.nearest(s.point) else {
                continue;
            };
            let off = (nearest.distance - exact).abs();
            let reach = exact + s.point.abs().max_element();
            let mut allowed = m.mesh.chord_error() + 64.0 * f64::EPSILON * reach;
            if self.single {
                allowed += rounding(s.value);
            }
            checks.distance[0] += 1;
            checks.distance_max_error = checks.distance_max_error.max(off);
            if off > allowed {
                checks.distance[1] += 1;
                checks.keep(Violation {
                    check: "distance",
                    voxel: s.voxel,
                    point: s.point,
                    off: [off, allowed],
                });
            }
        }
    }
}
