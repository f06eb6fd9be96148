//! The solid as rays see it: signed distances from point to point, less what is cut away.

use super::camera::View;
use crate::math::Aabb;
use crate::math::Side;
use crate::solid::{Assembly, Part, Reaches, signed};
use glam::DVec3;

/// What is removed from a picture, so that the inside shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cut {
    /// The quadrant about the axis that is nearest to the camera.
    Quarter,
    /// The half in front of the plane through the axis that faces the camera.
    Half,
}

/// The part of space that is cut away: where both products with the normals are positive.
#[derive(Debug, Clone, Copy)]
pub(super) struct CutAway {
    origin: DVec3,
    normals: [DVec3; 2],
}

impl CutAway {
    /// A cut through the axis of the first solid, where the others share it, else through the
    /// upright line in the middle.
    pub(super) fn new(cut: Cut, assembly: &Assembly, view: View) -> Self {
        let bounds = assembly.bounds();
        let middle = 0.5 * (bounds.min + bounds.max);
        let frame = assembly.parts()[0].body().frame();
        let (mut origin, mut axis) = (frame.origin(), frame.axis(2));
        let near = 1e-6 * bounds.longest_side();
        let coaxial = |p: &Part| {
            let f = p.body().frame();
            f.axis(2).cross(axis).length() < 1e-6
                && (f.origin() - origin).cross(axis).length() < near
        };
        if !assembly.added().all(coaxial) {
            // An assembly is about the line that its largest solid turns about, if that is upright.
            (origin, axis) = (middle, DVec3::Z);
            let size = |p: &&Part| p.bounds().sides().element_product();
            let largest = assembly.added().max_by(|a, b| size(a).total_cmp(&size(b)));
            if let Some(part) = largest {
                origin = part.body().frame().origin();
                axis = part.body().frame().axis(2);
            }
        }
        let to_camera = View::direction(view.azimuth(), view.elevation());
        let across = |v: DVec3| (v - axis * v.dot(axis)).try_normalize();
        let seen = to_camera - axis * to_camera.dot(axis);
        // Seen along the axis, any plane through it is as good.
        let facing = (seen.length() > 0.05)
            .then(|| across(to_camera))
            .flatten()
            .or_else(|| across(-DVec3::Y))
            .or_else(|| across(DVec3::X))
            .unwrap_or(DVec3::X);
        let side = axis.cross(facing);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let normals = match cut {
            Cut::Half => [facing; 2],
            Cut::Quarter => [(facing + side) * half, (facing - side) * half],
        };
        Self { origin, normals }
    }

    /// How deep a point is in what is cut away, negative outside of it: a lower bound of the
    /// distance to it there.
    pub(super) fn depth(&self, p: DVec3) -> f64 {
        let d = self.normals.map(|n| n.dot(p - self.origin));
        d[0].min(d[1])
    }

    /// Where a ray is in what is cut away, and the normal of the plane at the far end.
    pub(super) fn span(&self, origin: DVec3, direction: DVec3) -> Option<([f64; 2], DVec3)> {
        let mut span = [f64::NEG_INFINITY, f64::INFINITY];
        let mut normal = self.normals[0];
        for n in self.normals {
            let (at, speed) = (n.dot(origin - self.origin), n.dot(direction));
            let t = -at / speed;
            if speed > 0.0 {
                span[0] = span[0].max(t);
            } else if speed < 0.0 {
                if t < span[1] {
                    (span[1], normal) = (t, n);
                }
            } else if at <= 0.0 {
                return None;
            }
        }
        (span[0] < span[1]).then_some((span, normal))
    }
}

/// A solid with what is cut away from it.
#[derive(Debug)]
pub(super) struct Field<'a> {
    pub(super) assembly: &'a Assembly,
    pub(super) cut: Option<CutAway>,
    /// The bounds with a little room.
    pub(super) bounds: Aabb,
    /// The diagonal of the bounds.
    pub(super) size: f64,
    /// The materials in ascending order; a colour goes with the place in it.
    materials: Vec<u32>,
}

/// What one thread carries from point to point.
#[derive(Debug)]
pub(super) struct Probe {
    reaches: Reaches,
    sides: Vec<Side>,
    last: DVec3,
}

impl<'a> Field<'a> {
    pub(super) fn new(assembly: &'a Assembly, cut: Option<CutAway>) -> Self {
        let bounds = assembly.bounds();
        let size = bounds.sides().length();
        let room = 1e-6 * size;
        let mut materials: Vec<u32> = assembly.added().map(Part::material).collect();
        materials.sort_unstable();
        materials.dedup();
        Self {
            assembly,
            cut,
            bounds: Aabb {
                min: bounds.min - room,
                max: bounds.max + room,
            },
            size,
            materials,
        }
    }

    /// A probe that need not know distances beyond `most`.
    pub(super) fn probe(&self, most: f64) -> Probe {
        Probe {
            reaches: Reaches::new(self.assembly, most),
            sides: vec![Side::Outside; self.assembly.bodies().len()],
            last: DVec3::ZERO,
        }
    }

    /// Signed distance to the solid as it is without the cut, or a lower bound of its size.
    pub(super) fn distance(&self, probe: &mut Probe, p: DVec3) -> f64 {
        probe.reaches.moved((p - probe.last).length());
        probe.last = p;
        for (side, body) in probe.sides.iter_mut().zip(self.assembly.bodies()) {
            *side = body.side(p);
        }
        let sides = &probe.sides;
        let inside = self.assembly.holds(|b| sides[b], || p);
        let found = self
            .assembly
            .measure_distance(p, |b| sides[b], inside, &mut probe.reaches);
        signed(found.distance, inside)
    }

    /// Signed distance to the solid as it is without the cut.
    pub(super) fn exact_distance(&self, probe: &mut Probe, p: DVec3) -> f64 {
        if self.assembly.single().is_some() {
            self.distance(probe, p)
        } else {
            self.assembly.signed_distance(p)
        }
    }

    /// A lower bound with the cut.
    pub(super) fn cut_distance(&self, probe: &mut Probe, p: DVec3) -> f64 {
        let removed = self.cut.map_or(f64::NEG_INFINITY, |c| c.depth(p));
        self.distance(probe, p).max(removed)
    }

    /// Unit normal out of the solid near its surface: the gradient of the distance.
    pub(super) fn normal(&self, probe: &mut Probe, p: DVec3) -> DVec3 {
        // Far above the rounding of distances, far below what is seen.
        let h = 1e-6 * self.size;
        let corners = [
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(1.0, 1.0, 1.0),
        ];
        let sum = corners.map(|c| c * self.distance(probe, p + c * h));
        let gradient: DVec3 = sum.into_iter().sum();
        gradient.try_normalize().unwrap_or(DVec3::Z)
    }

    /// The place of a material among those of the scene; the first where there is one only.
    pub(super) fn material(&self, inside: DVec3) -> usize {
        if self.materials.len() < 2 {
            return 0;
        }
        let id = self.assembly.material_inside(inside);
        self.materials.binary_search(&id).unwrap_or(0)
    }

    /// The ids of the materials, in the order of their places.
    pub(super) fn materials(&self) -> &[u32] {
        &self.materials
    }

    /// Where a ray is in the box around the solid.
    pub(super) fn span(&self, origin: DVec3, direction: DVec3, grown: f64) -> Option<[f64; 2]> {
        let mut span = [f64::NEG_INFINITY, f64::INFINITY];
        for a in 0..3 {
            let (low, high) = (self.bounds.min[a] - grown, self.bounds.max[a] + grown);
            if direction[a].abs() < 1e-12 {
                if origin[a] < low || origin[a] > high {
                    return None;
                }
                continue;
            }
            let (t, u) = (
                (low - origin[a]) / direction[a],
                (high - origin[a]) / direction[a],
            );
            span = [span[0].max(t.min(u)), span[1].min(t.max(u))];
        }
        (span[0] < span[1]).then_some(span)
    }
}
