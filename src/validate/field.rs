//! What a signed distance must be, checked on stored values and their neighbours.
//!
//! ```text
//!   sign       φ <= 0 where the point is inside, and there alone
//!   steepness  |φ(p) - φ(q)| <= |p - q|, neighbours p and q, and what each may be off by
//!   slope      ||∇φ| - 1| <= (Σ s²)^½ / 2, s the change of slope along each axis within the stencil
//!   zero       where the sign changes the triangles are near: within the chord error and what a
//!              slope of 1 leaves of linear interpolation
//!   distance   of a single solid within the chord error of the distance to its triangles
//! ```
//!
//! A stored value may be off by two ulp of f32, and by 8 ε (size + |p|): an answer is that about a point
//! as f64 has it. Where f32 has no number of the value's size, above its largest or below its smallest
//! normal one, what is stored must be that limit, and the checks look at the distance itself.
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

/// The values of a stencil as numbers that f64 keeps.
struct Near {
    value: f64,
    beside: [[Option<f64>; 2]; 3],
}

impl Near {
    fn new(field: &Field, s: &Stencil) -> Self {
        let kept = |value: f32, point: DVec3| {
            if is_kept(value) {
                f64::from(value)
            } else {
                field.assembly.signed_distance(point)
            }
        };
        let mut beside = [[None; 2]; 3];
        for (axis, pair) in beside.iter_mut().enumerate() {
            let step = DVec3::AXES[axis] * field.spacing[axis];
            let [below, above] = s.beside[axis];
            *pair = [
                below.map(|v| kept(v, s.point - step)),
                above.map(|v| kept(v, s.point + step)),
            ];
        }
        Self {
            value: kept(s.value, s.point),
            beside,
        }
    }
}

/// The checks.
pub(super) struct Field<'a> {
    assembly: &'a Assembly,
    meshes: &'a [PartMesh],
    spacing: DVec3,
    /// Longest side of the bounds.
    size: f64,
    /// Whether stored distances are those of one solid.
    single: bool,
}

/// What storing a value may change it by, twice over.
fn rounding(value: f64) -> f64 {
    2.0 * f64::from(f32::EPSILON) * value.abs()
}

/// Whether f32 has numbers next to each other of a stored value's size.
fn is_kept(value: f32) -> bool {
    value.is_normal() && value.abs() < f32::MAX
}

impl<'a> Field<'a> {
    pub(super) fn new(assembly: &'a Assembly, meshes: &'a [PartMesh], grid: &GridSpec) -> Self {
        Self {
            assembly,
            meshes,
            spacing: grid.spacing(),
            size: assembly.bounds().longest_side(),
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
        let near = Near::new(self, s);
        let here = near.value;
        if !is_kept(s.value) {
            let off = (f64::from(s.value) - f64::from(stored(here))).abs();
            // Two of the smallest numbers there are.
            let allowed = f64::from(f32::from_bits(2)) + self.doubt(s.point);
            checks.distance[0] += 1;
            if off > allowed {
                checks.distance[1] += 1;
                fail(checks, "distance", [off, allowed]);
            }
        }
        for axis in 0..3 {
            let Some(there) = near.beside[axis][1].filter(|v| v.is_finite()) else {
                continue;
            };
            // The step between centres as they are in f64.
            let step = self.spacing[axis] + 4.0 * f64::EPSILON * s.point[axis].abs();
            let allowed = step + rounding(here) + rounding(there) + 2.0 * self.doubt(s.point);
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
        if let Some([off, allowed]) = self.slope(s, &near, checks) {
            checks.slope[1] += 1;
            fail(checks, "slope", [off, allowed]);
        }
        self.distances(s, here, checks);
    }

    /// What a distance may be off by: that of a point as near as f64 has it.
    fn doubt(&self, point: DVec3) -> f64 {
        8.0 * f64::EPSILON * (self.size + point.length())
    }

    /// How far the triangles are from where the sign changes, and how far they may be.
    fn zero(&self, point: DVec3, axis: usize, [here, there]: [f64; 2]) -> [f64; 2] {
        let step = self.spacing[axis];
        let (a, b) = (here.abs(), there.abs());
        let sum = (a + b).max(f64::MIN_POSITIVE);
        let at = point + DVec3::AXES[axis] * (step * (a / sum));
        // |φ| there is at most what is left of a slope of 1 from either end.
        let left = a.max(b) * (step / sum - 1.0).max(0.0);
        let room = 2.0 * (rounding(a) + rounding(b) + self.doubt(point));
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
    fn slope(&self, s: &Stencil, near: &Near, checks: &mut FieldChecks) -> Option<[f64; 2]> {
        let here = near.value;
        let (mut gradient, mut changes, mut noise) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for axis in 0..3 {
            let [Some(low), Some(high)] = near.beside[axis] else {
                return None;
            };
            let step = self.spacing[axis];
            gradient[axis] = (high - low) / (2.0 * step);
            changes[axis] = (high + low - 2.0 * here) / step;
            let off = rounding(low) + rounding(high) + 2.0 * rounding(here);
            noise += (off + 4.0 * self.doubt(s.point)) / step;
        }
        // An empty composite is infinitely far.
        if !here.is_finite() || !gradient.is_finite() {
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
            return (!self.has_slope_one(s, here)).then_some([error, allowed]);
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
    fn has_slope_one(&self, s: &Stencil, value: f64) -> bool {
        let here = self.assembly.signed_distance(s.point);
        let step = 1e-3 * self.spacing.min_element();
        let slope = |axis: usize| {
            let by = DVec3::AXES[axis] * step;
            let above = self.assembly.signed_distance(s.point + by);
            let below = self.assembly.signed_distance(s.point - by);
            (above - below) / (2.0 * step)
        };
        let length = DVec3::new(slope(0), slope(1), slope(2)).length();
        let same = (value - here).abs() <= rounding(value) + self.doubt(s.point);
        // On the medial axis itself the slopes of both sides cancel.
        same && length <= 1.0 + 1e-3 + 2.0 * self.doubt(s.point) / step
    }

    /// Each solid's distance against that of its triangles.
    fn distances(&self, s: &Stencil, value: f64, checks: &mut FieldChecks) {
        for (part, m) in self.assembly.parts().iter().zip(self.meshes) {
            let inside = part.contains(s.point);
            let exact = if self.single {
                value.abs()
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
                allowed += rounding(value);
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
