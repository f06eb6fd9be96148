//! The surface of a turned region as lines: circles that its pieces sweep, and segments of its caps.

use super::path::{Path, Stretch};
use super::revolved::Revolved;
use super::rule::{Area, Cover, Normal, Patch, Rule};
use super::turn::Turn;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

impl Revolved {
    /// What a piece sweeps, and its part of each cap.
    pub(super) fn patches(&self) -> Vec<Patch> {
        let turned = *self.turn() != Turn::Full;
        let mut patches = Vec::new();
        for (number, part) in self.boundary().iter().enumerate() {
            if part.piece.on_axis {
                continue;
            }
            let caps = if turned && !part.piece.is_horizontal() {
                &[None, Some(0), Some(1)][..]
            } else {
                &[None]
            };
            patches.extend(caps.iter().map(|&cap| Patch { number, cap }));
        }
        patches
    }

    /// A ball around the part of a patch between two parameters of its piece and two shares of its lines.
    pub(super) fn cover(&self, patch: Patch, t: [f64; 2], s: [f64; 2]) -> Cover {
        let twin = self.boundary().at(patch.number).piece.twin();
        // Neither coordinate turns within a piece.
        let [a, b] = t.map(|t| {
            let p = twin.at(t);
            DVec2::new(p[0] + twin.origin[0], p[1] + twin.origin[1])
        });
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a).abs());
        let scale = self.frame().scale();
        match (patch.cap, self.turn()) {
            (Some(cap), Turn::Partial(wedge)) => {
                let d = wedge.directions()[cap];
                let (low, high) = (s[0] * (middle.x - half.x), s[1] * (middle.x + half.x));
                let r = 0.5 * (low + high);
                // What the ends of the lines move is counted to the one side, their length to the other.
                let along = 0.5 * (s[1] - s[0]) * middle.x;
                Cover {
                    centre: self
                        .frame()
                        .to_world(DVec3::new(d.x * r, d.y * r, middle.y)),
                    across: (half.y + (0.5 * (high - low) - along).max(0.0)) * scale,
                    along: along * scale,
                }
            }
            _ => {
                let [from, to] = angles(self.turn());
                let (sin, cos) = (from + 0.5 * (s[0] + s[1]) * (to - from)).sin_cos();
                let r = middle.x;
                Cover {
                    centre: self
                        .frame()
                        .to_world(DVec3::new(r * cos, r * sin, middle.y)),
                    across: half.length() * scale,
                    along: 0.5 * (s[1] - s[0]) * (to - from) * (middle.x + half.x) * scale,
                }
            }
        }
    }

    /// Length of the piece per unit of its parameter, in scene units.
    pub(super) fn pace(&self, patch: Patch, t: f64) -> f64 {
        let [dr, dz] = self.boundary().at(patch.number).piece.twin().slope(t);
        dr.hypot(dz) * self.frame().scale()
    }

    /// What a question costs, compared with one to a solid of lines: arcs and free-form curves cost more to look at.
    pub(super) fn price(&self) -> u64 {
        let degrees = self.boundary().iter().map(|p| p.piece.degree());
        match degrees.max() {
            None | Some(0 | 1) => 1,
            Some(2) => 2,
            Some(_) => 5,
        }
    }

    /// The circle or the segment of a patch at parameter `t` of its piece.
    pub(super) fn rule(&self, patch: Patch, t: f64, hair: f64) -> Option<Rule> {
        let part = self.boundary().at(patch.number);
        let twin = part.piece.twin();
        let at = twin.at(t);
        let (r, z) = (at[0] + twin.origin[0], at[1] + twin.origin[1]);
        let [dr, dz] = twin.slope(t);
        let sign = if part.forward { 1.0 } else { -1.0 };
        let frame = self.frame();
        let scale = frame.scale();
        let hair_here = hair / scale;
        if r <= 2.0 * hair_here {
            return None;
        }
        let [e1, e2, e3] = [0, 1, 2].map(|i| frame.axis(i));
        match patch.cap {
            None => {
                let pace = dr.hypot(dz);
                // Outward of the region: on the right of a piece with the region on its left.
                let out = DVec2::new(dz, -dr) * (sign / pace);
                if !out.is_finite() {
                    return None;
                }
                let circle = |r: f64, z: f64| Path::Circle {
                    centre: frame.to_world(DVec3::new(0.0, 0.0, z)),
                    u: e1 * (r * scale),
                    v: e2 * (r * scale),
                };
                let area = r * pace * scale * scale;
                let beside = |k: f64| circle(r + k * hair_here * out.x, z + k * hair_here * out.y);
                Some(Rule {
                    path: circle(r, z),
                    beside: [beside(1.0), beside(-1.0)],
                    range: angles(self.turn()),
                    normal: Normal::Turning {
                        u: e1 * (area * out.x),
                        v: e2 * (area * out.x),
                        along: e3 * (area * out.y),
                    },
                    area: Area::Even(area),
                })
            }
            Some(cap) => {
                let Turn::Partial(wedge) = self.turn() else {
                    return None;
                };
                let d = wedge.directions()[cap];
                let outward = if cap == 0 { -d.perp() } else { d.perp() };
                let out = e1 * outward.x + e2 * outward.y;
                let line = |off: f64| Path::Line {
                    start: frame.to_world(DVec3::new(0.0, 0.0, z)) + out * off,
                    along: (e1 * d.x + e2 * d.y) * scale,
                };
                // Green's theorem: ∬ g dr dz = ∮ (∫_0^r g dr) dz, region on the left.
                let area = sign * dz * scale * scale;
                Some(Rule {
                    path: line(0.0),
                    beside: [line(hair), line(-hair)],
                    range: [0.0, r],
                    normal: Normal::Fixed(out * area),
                    area: Area::Even(area),
                })
            }
        }
    }

    /// Whether the swept surface, or a plane of a cap, may come within `margin` (scene units) of a
    /// stretch of a path.
    pub(super) fn may_meet(&self, stretch: &Stretch, margin: f64) -> bool {
        let margin = margin / self.frame().scale();
        let reach = stretch.reach();
        !stretch.path.is_coaxial() && self.surface_overlaps(reach.r, reach.z, margin)
            || stretch.meets_caps(self.turn(), margin)
    }
}

/// The angles of a turn, in radians.
fn angles(turn: &Turn) -> [f64; 2] {
    match turn {
        Turn::Full => [0.0, TAU],
        Turn::Partial(wedge) => {
            let from = wedge.from().rem_euclid(360.0).to_radians();
            [from, from + turn.radians()]
        }
    }
}
