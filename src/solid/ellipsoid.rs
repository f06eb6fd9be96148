//! A ball stretched along three axes.
//!
//! ```text
//!   inside    Σ (x_i / r_i)² <= 1
//!   foot      y_i = r_i² x_i / (s + d_i),  d_i = r_i² - r_m²,  r_m the least radius
//!             s > 0 the root of  F(s) = Σ (r_i x_i / (s + d_i))² - 1,  falling and convex
//! ```
//!
//! With t = s - r_m² these are the points where y + t ∇ = x. Counted from the least radius, s keeps
//! its digits where t comes near -r_m², which is where the foot leaves the plane that a point deep
//! inside lies in: there is no root then, s is 0 and the least axis gets what is left.
//!
//! * Units: local lengths in a power of two of the frame's.
//! * Accuracy: membership exact; distances a few roundings of the largest coordinate; area by
//!   Carlson's R_G to some units in the last place.
//! * Source: D. Eberly, *Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid*
//!   (2013), for the root; B. C. Carlson, *Numerical computation of real or complex elliptic
//!   integrals* (1995), for the area: S = 4π R_G(a²b², b²c², c²a²).

use super::block::{length, placed_bounds, power_of_two, side_of};
use super::fraction::{CellShape, Clip};
use super::measure::Moments;
use super::path::Path;
use super::revolved::Revolved;
use super::row::{Cuts, Row};
use super::rule::{Area, Cover, Normal, Patch, Rule};
use super::turn::Turn;
use crate::math::tetrahedra::HalfSpace;
use crate::math::{Aabb, Dd, Real, Side, Similarity};
use crate::region::{Boundary, Fill, ProfileCurve, Region};
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};

/// A solid ellipsoid about the origin of its frame, its half axes along the frame's axes.
#[derive(Debug, Clone)]
pub struct Ellipsoid {
    frame: Similarity,
    /// Half axes in local lengths.
    radii: DVec3,
    /// The unit ball that the ellipsoid is the image of.
    ball: Revolved,
    bounds: Aabb,
}

impl Ellipsoid {
    /// The ellipsoid with those half axes, greater than 0, in local lengths of the frame; `None`
    /// where they leave the range in which a ball can be made of them.
    #[must_use]
    pub fn new(frame: &Similarity, radii: DVec3) -> Option<Self> {
        let unit = power_of_two(radii.max_element());
        Some(Self::of_radii(
            frame.with_local_unit(unit),
            radii / unit,
            unit_ball()?,
        ))
    }

    fn of_radii(frame: Similarity, radii: DVec3, ball: Revolved) -> Self {
        let extent = |k: usize| {
            let squares = (0..3).map(|i| {
                let along = frame.axis_exact(i)[k] * Dd::of(radii[i]);
                along * along
            });
            squares.fold(Dd::ZERO, |sum, e| sum + e).sqrt()
        };
        let bounds = placed_bounds(&frame, extent);
        Self {
            frame,
            radii,
            ball,
            bounds,
        }
    }

    pub(crate) fn frame(&self) -> &Similarity {
        &self.frame
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Half axes in local lengths of [`frame`](Self::frame).
    pub(crate) fn local_radii(&self) -> DVec3 {
        self.radii
    }

    /// The ball of radius 1 about the origin.
    pub(crate) fn unit_ball(&self) -> &Revolved {
        &self.ball
    }

    pub(super) fn side(&self, point: DVec3) -> Side {
        let local = self.frame.to_local(point);
        let (p, error) = (local.point / self.radii, local.error / self.radii);
        let reach = p.abs().max_element();
        if !(reach < 1e3) {
            return Side::Outside;
        }
        let doubt = 2.0 * (error * (p.abs() + error)).element_sum()
            + 16.0 * f64::EPSILON * (1.0 + p.length_squared());
        let height = p.length_squared() - 1.0;
        if height > doubt {
            Side::Outside
        } else if height < -doubt {
            Side::Inside
        } else {
            let e = self.frame.to_local_exact(point);
            let squares = (0..3).map(|i| {
                let s = e[i] / Dd::of(self.radii[i]);
                s * s
            });
            let sum = squares.fold(Dd::ZERO, |sum, s| sum + s);
            side_of(sum - Dd::ONE, 1.0)
        }
    }

    pub(super) fn distance(&self, point: DVec3, _inside: bool, limit: f64) -> f64 {
        let p = self.frame.to_local(point).point;
        let (distance, _) = nearest(self.radii, p);
        (distance * self.frame.scale()).min(limit)
    }

    pub(super) fn foot(&self, point: DVec3, _inside: bool) -> Option<DVec3> {
        let p = self.frame.to_local(point).point;
        if !(p.abs().max_element() < 1e90) {
            return None;
        }
        Some(self.frame.to_world(nearest(self.radii, p).1))
    }

    /// The points of the surface than which no point near them is nearer, and a vector along the normal at each: in
    /// scene units. Those across the plane of the shorter axes of a point deep inside are two.
    pub(super) fn local_feet(&self, point: DVec3) -> SmallVec<[(DVec3, DVec3); 2]> {
        let p = self.frame.to_local(point).point;
        let mut feet = SmallVec::new();
        if !(p.abs().max_element() < 1e90) {
            return feet;
        }
        let mut add = |foot: DVec3| {
            let normal = foot / (self.radii * self.radii);
            let turned = |i: usize| self.frame.axis(i) * normal[i];
            let normal = turned(0) + turned(1) + turned(2);
            feet.push((self.frame.to_world(foot), normal));
        };
        add(nearest(self.radii, p).1);
        if let Some(foot) = second(self.radii, p) {
            add(foot);
        }
        feet
    }

    pub(super) fn cuts(&self, row: &Row, cuts: &mut Cuts) {
        let local = row.local(&self.frame);
        let (p, d) = (local.start / self.radii, local.along / self.radii);
        let error = local.error / self.radii.min_element();
        let c = d.length_squared();
        let middle = -p.dot(d) / c;
        // The part across the row, whose size does not cancel.
        let across = p.cross(d).length_squared() / c;
        let crossings = |r: f64, sign: f64| {
            let square = r * r - across + sign * 16.0 * f64::EPSILON * (r * r + across);
            (r > 0.0 && square > 0.0).then(|| {
                let half = (square / c).sqrt();
                let slack = sign * 8.0 * f64::EPSILON * (middle.abs() + half);
                [middle - half - slack, middle + half + slack]
            })
        };
        let Some([a, b]) = crossings(1.0 + 2.0 * error, 1.0) else {
            return;
        };
        match crossings(1.0 - 2.0 * error, -1.0) {
            Some([from, to]) if from < to => {
                cuts.add(a, from);
                cuts.add(to, b);
            }
            _ => cuts.add(a, b),
        }
    }

    #[allow(clippy::unused_self, reason = "what every body answers")]
    pub(super) fn flat_faces(&self, _axis: usize) -> Vec<f64> {
        Vec::new()
    }

    /// The voxel as a parallelepiped about the unit ball.
    pub(super) fn cell_shape(&self, sides: DVec3) -> CellShape {
        let unit = self.ball.frame().scale();
        let edges = DVec3::AXES.map(|e| self.frame.vector_to_local(e * sides) / self.radii / unit);
        CellShape::of_edges(edges)
    }

    pub(super) fn fraction_within(
        &self,
        shape: &CellShape,
        centre: DVec3,
        spaces: &[HalfSpace],
        tolerance: f64,
    ) -> f64 {
        let unit = self.ball.frame().scale();
        let local = self.frame.to_local(centre).point / self.radii / unit;
        let stretch = self.radii * unit * self.frame.scale();
        let clips = spaces.iter().map(|s| {
            let along = DVec3::from_array([0, 1, 2].map(|i| self.frame.axis(i).dot(s.normal)));
            Clip {
                normal: along * stretch,
                offset: s.offset,
            }
        });
        self.ball
            .local_fraction(shape, local, clips.collect(), tolerance)
    }

    pub(super) fn moments(&self) -> Moments {
        let r = self.radii * self.frame.scale();
        let volume = 4.0 / 3.0 * PI * r.element_product();
        Moments::symmetric(&self.frame, [volume, area(r)], r * r / 5.0, 32.0)
    }

    pub(super) fn translated(&self, by: DVec3) -> Self {
        Self::of_radii(self.frame.translated(by), self.radii, self.ball.clone())
    }

    /// One patch: ellipses of latitude, from the south pole at 0 to the north pole at 1.
    #[allow(clippy::unused_self, reason = "what every body answers")]
    pub(super) fn patches(&self) -> Vec<Patch> {
        vec![Patch::face(0)]
    }

    /// Distance of a point from the surface to first order, in scene units.
    pub(super) fn off_surface(&self, point: DVec3) -> f64 {
        let p = self.frame.to_local(point).point / self.radii;
        let slope = length(p / self.radii);
        if slope > 0.0 {
            0.5 * (p.length_squared() - 1.0).abs() / slope * self.frame.scale()
        } else {
            self.radii.min_element() * self.frame.scale()
        }
    }

    /// A ball around the part between two parameters and two shares of the ellipses.
    pub(super) fn cover(&self, _patch: Patch, t: [f64; 2], s: [f64; 2]) -> Cover {
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        let (sin, cos) = ((middle(t) - 0.5) * PI).sin_cos();
        let (across, along) = (TAU * middle(s)).sin_cos();
        let unit = DVec3::new(cos * along, cos * across, sin);
        let most = self.radii.max_element() * self.frame.scale();
        let half = 0.5 * PI * (t[1] - t[0]);
        Cover {
            centre: self.frame.to_world(unit * self.radii),
            across: most * half,
            // Nowhere is a circle of latitude longer than that.
            along: most * (cos.abs() + half).min(1.0) * 0.5 * TAU * (s[1] - s[0]),
        }
    }

    pub(super) fn pace(&self, _patch: Patch, _t: f64) -> f64 {
        PI * self.radii.max_element() * self.frame.scale()
    }

    pub(super) fn rule(&self, _patch: Patch, t: f64, hair: f64) -> Option<Rule> {
        let (sin, cos) = ((t - 0.5) * PI).sin_cos();
        let scale = self.frame.scale();
        let r = self.radii * scale;
        if cos * r.x.min(r.y) <= 2.0 * hair {
            return None;
        }
        let [e1, e2, e3] = [0, 1, 2].map(|i| self.frame.axis(i));
        let ellipse = |r: DVec3| Path::Circle {
            centre: self.frame.origin() + e3 * (r.z * sin),
            u: e1 * (r.x * cos),
            v: e2 * (r.y * cos),
        };
        Some(Rule {
            path: ellipse(r),
            beside: [ellipse(r + hair), ellipse(r - hair)],
            range: [0.0, TAU],
            // The unit sphere's normal, its coordinates times the other two radii.
            normal: Normal::Turning {
                u: e1 * (PI * cos * cos * r.y * r.z),
                v: e2 * (PI * cos * cos * r.z * r.x),
                along: e3 * (PI * cos * sin * r.x * r.y),
            },
            area: Area::OfNormal,
        })
    }
}

/// The ball of radius 1 about the origin, as a turned half circle.
fn unit_ball() -> Option<Revolved> {
    let half = ProfileCurve::Arc {
        center: [0.0, 0.0],
        radii: [1.0, 1.0],
        tilt: 0.0,
        from: -90.0,
        to: 90.0,
    };
    let region = Region::new(&[vec![half]], Boundary::ToAxis, Fill::EvenOdd).ok()?;
    let frame = Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X)?;
    Some(Revolved::new(
        frame.with_local_unit(region.unit()),
        Turn::Full,
        region.section().clone(),
    ))
}

/// Distance from a point to the ellipsoid's surface, and the nearest point of it.
fn nearest(radii: DVec3, point: DVec3) -> (f64, DVec3) {
    let x = point.abs();
    if !(x.max_element() < 1e90) {
        return (length(point), point);
    }
    let least = radii.min_element();
    let d = (radii - least) * (radii + least);
    let pull = radii * x;
    // Every term alone bounds the root from below.
    let from = (0..3).fold(0.0_f64, |m, i| m.max(pull[i] - d[i]));
    let s = if from == 0.0 && fractions(pull, d, 0.0).length_squared() <= 1.0 {
        0.0
    } else {
        root(pull, d, from)
    };
    let mut foot = radii * fractions(pull, d, s);
    if s == 0.0 {
        let rest = 1.0 - (foot / radii).length_squared();
        let axis = (0..3).find(|&i| d[i] == 0.0).unwrap_or_default();
        foot[axis] = radii[axis] * rest.max(0.0).sqrt();
        return (length(foot - x), signs(foot, point));
    }
    // x - y = t y / r², which keeps its digits near the surface.
    let t = s - least * least;
    let off = t.abs()
        * length(DVec3::from_array(std::array::from_fn(|i| {
            if pull[i] > 0.0 {
                x[i] / (s + d[i])
            } else {
                0.0
            }
        })));
    (off, signs(foot, point))
}

/// The other local minimum of the distance, beyond the plane that the least axis is normal to.
///
/// With t = -r_m² - w the stationary points are those where Σ (r_i x_i / (r_i² + t))² = 1. That of the least w > 0, up
/// to which the sum falls, is a minimum: the second derivatives of |x - y|² along the surface are those of
/// 1 + t / r_i², of which one is negative, along the normal.
fn second(radii: DVec3, point: DVec3) -> Option<DVec3> {
    const STEPS: u32 = 200;
    let least = (0..3).min_by(|&i, &j| radii[i].total_cmp(&radii[j]))?;
    let squares = radii * radii;
    let room = squares - DVec3::splat(squares[least]);
    let others = [(least + 1) % 3, (least + 2) % 3];
    if others.iter().any(|&i| !(room[i] > 1e-12 * squares[i])) {
        return None;
    }
    let pull = radii * point.abs();
    if pull[least] <= 1e-15 * squares[least] {
        // In the plane: the mirror image, where the foot leaves it.
        let mut foot = nearest(radii, point).1;
        foot[least] = -foot[least];
        return (foot[least].abs() > 0.0).then_some(foot);
    }
    let mut w = pull[least];
    for _ in 0..STEPS {
        let own = pull[least] / w;
        let (mut value, mut slope) = (own * own - 1.0, -2.0 * own * own / w);
        for i in others {
            let rest = room[i] - w;
            if !(rest > 0.0) {
                return None;
            }
            let share = pull[i] / rest;
            value += share * share;
            slope += 2.0 * share * share / rest;
        }
        if !(slope < 0.0) {
            return None;
        }
        // From the left of the root of a convex function no step goes beyond it.
        let step = -value / slope;
        w += step.max(0.0);
        if step <= 2.0 * f64::EPSILON * w {
            break;
        }
    }
    let mut foot = DVec3::ZERO;
    foot[least] = -squares[least] * point[least] / w;
    for i in others {
        foot[i] = squares[i] * point[i] / (room[i] - w);
    }
    foot.is_finite().then_some(foot)
}

fn signs(size: DVec3, sign: DVec3) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| size[i].copysign(sign[i])))
}

/// The root of Σ (pull_i / (s + d_i))² = 1 above a lower bound of it: Newton's steps for 1/|q|, q_i the fractions.
///
/// 1/|q| rises and is concave, so that a step from below ends below; it is nearly linear (J. J. Moré, D. C. Sorensen,
/// *Computing a trust region step*, 1983).
fn root(pull: DVec3, d: DVec3, mut s: f64) -> f64 {
    /// At most fifteen are seen with half axes and points over six orders of size, two in the mean.
    const STEPS: u32 = 64;
    for _ in 0..STEPS {
        let q = fractions(pull, d, s);
        let square = q.length_squared();
        let slopes = (0..3).filter(|&i| q[i] > 0.0);
        let slope: f64 = slopes.map(|i| q[i] * q[i] / (s + d[i])).sum();
        let next = s + square * ((square - 1.0) / (square.sqrt() + 1.0)) / slope;
        if !(next > s) {
            break;
        }
        let done = next - s <= f64::EPSILON * next;
        s = next;
        if done {
            break;
        }
    }
    s
}

/// pull_i / (s + d_i); 0 where `pull` is: there both terms of the denominator may be 0.
fn fractions(pull: DVec3, d: DVec3, s: f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| {
        if pull[i] == 0.0 {
            0.0
        } else {
            pull[i] / (s + d[i])
        }
    }))
}

/// Area of the surface of an ellipsoid.
fn area(r: DVec3) -> f64 {
    let unit = r.max_element();
    let r = r / unit;
    let (x, y, z) = (r.y * r.z, r.z * r.x, r.x * r.y);
    4.0 * PI * rg([x * x, y * y, z * z]) * unit * unit
}

/// Carlson's R_G of three numbers greater than 0:
/// 2 R_G = z R_F - (x - z)(y - z) R_D / 3 + sqrt(x y / z), z the middle one.
fn rg(mut v: [f64; 3]) -> f64 {
    v.sort_by(f64::total_cmp);
    let [x, z, y] = v;
    let rest = (x * y / z).sqrt();
    0.5 * (z * rf([x, y, z]) - (x - z) * (y - z) * rd([x, y, z]) / 3.0 + rest)
}

/// Mean and relative deviations below which the series ends in rounding.
const CLOSE: f64 = 1e-3;

fn rf(mut v: [f64; 3]) -> f64 {
    loop {
        let mean = (v[0] + v[1] + v[2]) / 3.0;
        let [x, y, z] = v.map(|c| 1.0 - c / mean);
        if x.abs().max(y.abs()).max(z.abs()) < CLOSE {
            let (e2, e3) = (x * y - z * z, x * y * z);
            let series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0;
            return series / mean.sqrt();
        }
        v = doubled(v).0;
    }
}

fn rd(mut v: [f64; 3]) -> f64 {
    let (mut sum, mut power) = (0.0, 1.0);
    loop {
        let mean = (v[0] + v[1] + 3.0 * v[2]) / 5.0;
        let [x, y, z] = v.map(|c| 1.0 - c / mean);
        if x.abs().max(y.abs()).max(z.abs()) < CLOSE {
            let (p, q) = (x * y, z * z);
            let e2 = p - 6.0 * q;
            let e3 = (3.0 * p - 8.0 * q) * z;
            let e4 = 3.0 * (p - q) * q;
            let e5 = p * q * z;
            let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
                - 3.0 * e4 / 22.0
                - 9.0 * e2 * e3 / 52.0
                + 3.0 * e5 / 26.0;
            return sum + power * series / (mean * mean.sqrt());
        }
        let (next, lambda) = doubled(v);
        sum += 3.0 * power / (v[2].sqrt() * (v[2] + lambda));
        power *= 0.25;
        v = next;
    }
}

/// One duplication: the values grow alike.
fn doubled(v: [f64; 3]) -> ([f64; 3], f64) {
    let [x, y, z] = v.map(f64::sqrt);
    let lambda = x * y + y * z + z * x;
    (v.map(|c| 0.25 * (c + lambda)), lambda)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upright() -> Similarity {
        Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X).expect("a frame")
    }

    #[test]
    fn areas_of_spheroids() {
        // Oblate and prolate, by their elementary formulas.
        for c in [0.01, 0.3, 0.999, 1.0, 1.001, 2.5, 40.0] {
            let found = area(DVec3::new(1.0, 1.0, c));
            let e = (1.0 - c.min(1.0 / c).powi(2)).sqrt();
            let wanted = if c < 1.0 {
                TAU * (1.0 + c * c * e.atanh() / e)
            } else if c > 1.0 {
                TAU * (1.0 + c * e.asin() / e)
            } else {
                2.0 * TAU
            };
            assert!(
                (found - wanted).abs() <= 2e-14 * wanted,
                "{c}: {found} {wanted}"
            );
            let turned = area(DVec3::new(c, 1.0, 1.0));
            assert!((found - turned).abs() <= 1e-14 * wanted);
        }
    }

    /// The distance against a search over the surface in double-double: the condition that x - y is
    /// along the normal, and no better point around.
    #[test]
    fn feet_are_on_the_surface_and_along_the_normal() {
        let radii = [
            DVec3::new(1.0, 0.5, 0.25),
            DVec3::new(1.0, 1.0, 0.3),
            DVec3::new(0.6, 0.6, 1.0),
            DVec3::new(1.0, 1e-3, 0.5),
            DVec3::ONE,
        ];
        for r in radii {
            for n in 0..4000_u32 {
                let c = |k: u32| (f64::from(n * k % 997) / 997.0 - 0.5) * 3.0;
                let mut p = DVec3::new(c(1), c(31), c(577)) * r;
                if n % 5 == 0 {
                    p[(n / 5 % 3) as usize] = 0.0;
                }
                let (d, foot) = nearest(r, p);
                let on = (foot / r).length_squared() - 1.0;
                assert!(on.abs() < 1e-12, "{r} {p}: {on}");
                assert!((d - p.distance(foot)).abs() < 1e-14, "{r} {p}");
                for k in 0..400_u32 {
                    let (a, b) = (f64::from(k) * 2.4, f64::from(k) / 200.0 - 1.0);
                    let s = (1.0 - b * b).max(0.0).sqrt();
                    let other = DVec3::new(s * a.cos(), s * a.sin(), b) * r;
                    assert!(d <= p.distance(other) + 1e-14, "{r} {p}");
                }
            }
        }
    }

    #[test]
    fn sides_distances_and_bounds() {
        let e = Ellipsoid::new(&upright().translated(DVec3::X), DVec3::new(3.0, 2.0, 1.0))
            .expect("an ellipsoid");
        assert_eq!(e.bounds().min.to_array(), [-2.0, -2.0, -1.0]);
        assert_eq!(e.side(DVec3::new(4.0, 0.0, 0.0)), Side::On);
        assert_eq!(e.side(DVec3::new(4.0 + 1e-15, 0.0, 0.0)), Side::Outside);
        assert_eq!(e.side(DVec3::new(4.0 - 1e-15, 0.0, 0.0)), Side::Inside);
        assert_eq!(e.distance(DVec3::X, true, f64::INFINITY), 1.0);
        assert_eq!(
            e.distance(DVec3::new(1.0, 0.0, 4.0), false, f64::INFINITY),
            3.0
        );
    }
}
