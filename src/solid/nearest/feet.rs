//! All points of a body's surface that may be the nearest one of what is left of it: the local minima of the distance,
//! within faces, along edges and at corners.
//!
//! On what a profile sweeps all of them lie in the half-plane of the point, as the distance to a circle about the axis
//! has one minimum. For a point on the axis all of a circle is as near, and any direction stands for it; where that is
//! hidden and another is not, an edge of the composite crosses the circle.
//!
//! A point on an edge of the body is moved into each of the faces that meet there, by a share [`INSET`] of the size, so
//! that each face tells what is beside it.

use super::super::block::Block;
use super::super::body::Body;
use super::super::revolved::Revolved;
use super::super::turn::{Turn, Wedge};
use super::visible::Spot;
use crate::region::LocalFoot;
use glam::{DVec2, DVec3};

/// How far spots are from the edges of their faces, as a share of the composite's size.
const INSET: f64 = 1e-10;

/// A place to look from, and how far.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub(super) point: DVec3,
    /// Feet beyond are of no use.
    pub(super) limit: f64,
    /// The size of the composite.
    pub(super) size: f64,
}

/// Calls `each` with the distance of every foot on the body of that index and a spot of the surface there.
pub(super) fn feet(index: usize, body: &Body, view: View, each: &mut impl FnMut(f64, Spot)) {
    let mut offer = |distance: f64, point: DVec3, normal: DVec3| {
        if let Some(normal) = normal.try_normalize()
            && distance < view.limit
        {
            let spot = Spot {
                point,
                normal,
                body: index,
            };
            each(distance, spot);
        }
    };
    match body {
        Body::Revolved(one) => Turned::new(one, view).feet(&mut offer),
        Body::Ellipsoid(one) => {
            for (foot, normal) in one.local_feet(view.point) {
                offer(foot.distance(view.point), foot, normal);
            }
        }
        Body::Block(one) => block(one, view, &mut offer),
        Body::Patches(one) => {
            if let Some(one) = one.turned() {
                Turned::new(one, view).feet(&mut offer);
            }
        }
    }
}

/// A turned region seen from a point: lengths in the region's unit.
struct Turned<'a> {
    one: &'a Revolved,
    flat: DVec2,
    z: f64,
    limit: f64,
    inset: f64,
}

impl<'a> Turned<'a> {
    fn new(one: &'a Revolved, view: View) -> Self {
        let frame = one.frame();
        let p = frame.to_local(view.point).point;
        Self {
            one,
            flat: DVec2::new(p.x, p.y),
            z: p.z,
            limit: view.limit / frame.scale(),
            inset: INSET * view.size / frame.scale(),
        }
    }

    fn feet(&self, offer: &mut impl FnMut(f64, DVec3, DVec3)) {
        let frame = self.one.frame();
        let mut local = |distance: f64, point: DVec3, n: DVec3| {
            let normal = frame.axis(0) * n.x + frame.axis(1) * n.y + frame.axis(2) * n.z;
            offer(distance * frame.scale(), frame.to_world(point), normal);
        };
        match self.one.turn() {
            Turn::Full => {
                let along = self.flat.try_normalize().unwrap_or(DVec2::X);
                self.swept(|_| along, &mut local);
            }
            Turn::Partial(wedge) => {
                let middle = DVec2::from_angle((wedge.from() + 0.5 * wedge.degrees()).to_radians());
                let along = self.flat.try_normalize().unwrap_or(middle);
                if wedge.contains(self.flat, 0.0).unwrap_or(true) {
                    self.swept(|r| self.within(wedge, along, r), &mut local);
                }
                for (d, sign) in wedge.directions().into_iter().zip([1.0, -1.0]) {
                    self.cap(d, sign, &mut local);
                }
            }
        }
    }

    /// A direction turned into the wedge where it is nearer to a cap than the inset at radius `r`.
    fn within(&self, wedge: &Wedge, along: DVec2, r: f64) -> DVec2 {
        for (d, sign) in wedge.directions().into_iter().zip([1.0, -1.0]) {
            if d.dot(along) > 0.0 && d.perp_dot(along).abs() * r < self.inset {
                return (d * r + d.perp() * (sign * self.inset)).normalize_or(d);
            }
        }
        along
    }

    /// The foot's point and normal in the half-plane, off the piece's end.
    fn spot(&self, foot: &LocalFoot) -> (DVec2, DVec2) {
        let tangent = DVec2::from_array(foot.tangent);
        let at = DVec2::from_array(foot.at);
        let inset = if foot.is_end { self.inset } else { 0.0 };
        (at + tangent * inset, DVec2::new(tangent.y, -tangent.x))
    }

    fn swept(&self, along: impl Fn(f64) -> DVec2, offer: &mut impl FnMut(f64, DVec3, DVec3)) {
        let q = [self.flat.length(), self.z];
        self.one.swept().each_foot(q, self.limit, |foot| {
            let (at, normal) = self.spot(&foot);
            let d = along(at.x);
            let turned = |v: DVec2| DVec3::new(d.x * v.x, d.y * v.x, v.y);
            offer(foot.distance, turned(at), turned(normal));
        });
    }

    /// The cap along a direction, `sign` the side of it that the wedge is on.
    fn cap(&self, d: DVec2, sign: f64, offer: &mut impl FnMut(f64, DVec3, DVec3)) {
        let (along, across) = (d.dot(self.flat), d.perp_dot(self.flat).abs());
        if across >= self.limit {
            return;
        }
        let turned = |v: DVec2| DVec3::new(d.x * v.x, d.y * v.x, v.y);
        let normal = DVec3::new(-d.y, d.x, 0.0);
        let q = [along, self.z];
        if self.one.section_holds(q) {
            offer(across, turned(DVec2::from_array(q)), normal);
        }
        let room = (self.limit * self.limit - across * across).sqrt();
        self.one.cap_edges().each_foot(q, room, |foot| {
            let distance = across.hypot(foot.distance);
            let (at, side) = self.spot(&foot);
            for side in [side, -side] {
                let within = at + side * self.inset;
                if self.one.section_holds(within.to_array()) {
                    offer(distance, turned(within), normal);
                }
            }
            if at.x > self.inset {
                let beside = turned(at) + normal * (sign * self.inset);
                offer(distance, beside, turned(side));
            }
        });
    }
}

/// The feet on faces, edges and corners of a block.
fn block(one: &Block, view: View, offer: &mut impl FnMut(f64, DVec3, DVec3)) {
    let frame = one.frame();
    let (half, scale) = (one.local_half(), frame.scale());
    let p = frame.to_local(view.point).point;
    let inset = INSET * view.size / scale;
    for feature in 1..27_u32 {
        // For each axis 0 where it is free, else the side.
        let side = [1, 3, 9].map(|d| [0.0, -1.0, 1.0][(feature / d % 3) as usize]);
        if (0..3).any(|i| side[i] == 0.0 && p[i].abs() >= half[i]) {
            continue;
        }
        let place = |inset: [f64; 3]| -> DVec3 {
            let at = |i: usize| match side[i] {
                0.0 => p[i],
                side => side * (half[i] - inset[i]),
            };
            DVec3::new(at(0), at(1), at(2))
        };
        let distance = place([0.0; 3]).distance(p) * scale;
        for i in (0..3).filter(|&i| side[i] != 0.0) {
            let mut off = [inset; 3];
            off[i] = 0.0;
            offer(distance, frame.to_world(place(off)), frame.axis(i));
        }
    }
}
