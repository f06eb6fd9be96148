//! Where the panels of a composite's faces begin and end.
//!
//! Fifteen points of a panel see no body that is far smaller than the panel, and no step between
//! them. So a piece is cut where its height or radius passes the extremes of the circles in which
//! the pieces of other bodies join (a step for parallel axes), and in quarters of each body's
//! bounding ball. What is left to the estimates is of the size of the bodies.

use super::body::Body;
use super::path::Path;
use crate::math::{Aabb, Dd, Real};
use crate::region::Piece;
use glam::DVec3;
use std::f64::consts::TAU;

/// Heights and radii, in a body's own coordinates, at which other bodies begin, end or turn.
#[derive(Debug, Default)]
pub(super) struct Seeds {
    radii: Vec<f64>,
    heights: Vec<f64>,
    /// Centres and radii of balls around the other bodies.
    balls: Vec<(DVec3, f64)>,
}

impl Seeds {
    /// The seeds that `others` put on the surface of `body`.
    pub(super) fn new<'a>(body: &Body, others: impl Iterator<Item = &'a Body>) -> Self {
        let mut seeds = Self::default();
        for other in others {
            seeds.add_ball(body, &other.bounds());
            seeds.add_vertices(body, other);
        }
        seeds
    }

    fn add_ball(&mut self, body: &Body, bounds: &Aabb) {
        let centre = body.frame().to_local(0.5 * (bounds.min + bounds.max)).point;
        let radius = 0.5 * bounds.sides().length() / body.frame().scale();
        self.balls.push((centre, radius));
        let rho = centre.x.hypot(centre.y);
        for k in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            self.radii.push(rho + k * radius);
            self.heights.push(centre.z + k * radius);
        }
    }

    fn add_vertices(&mut self, body: &Body, other: &Body) {
        /// Points on a circle that its extreme radii are looked for among; they only seed.
        const POINTS: u32 = 32;
        let Some(other) = other.revolved() else {
            return;
        };
        let frame = other.frame();
        let scale = frame.scale();
        for piece in other.boundary().iter().map(|b| &b.piece) {
            let [r, z] = piece.start.map(Real::f64);
            let circle = Path::Circle {
                centre: frame.to_world(DVec3::new(0.0, 0.0, z)),
                u: frame.axis(0) * (r * scale),
                v: frame.axis(1) * (r * scale),
            };
            let along = body.frame().axis(2);
            let local = |p: DVec3| body.frame().to_local(p).point;
            let height = |p: f64| (p - along.dot(body.frame().origin())) / body.frame().scale();
            self.heights.push(height(circle.support(along, [0.0, TAU])));
            self.heights
                .push(height(-circle.support(-along, [0.0, TAU])));
            let radius = |k: u32| {
                let p = local(circle.at(TAU * f64::from(k) / f64::from(POINTS)));
                p.x.hypot(p.y)
            };
            let radii = (0..POINTS).map(radius);
            let (low, high) =
                radii.fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(r), b.max(r)));
            // Exact for parallel axes, where a step is.
            let centre = local(frame.to_world(DVec3::new(0.0, 0.0, z)));
            let (off, own) = (centre.x.hypot(centre.y), r * scale / body.frame().scale());
            self.radii.extend([low, high, off + own, (off - own).abs()]);
        }
    }

    /// Parameters at which a face is cut whose lines `place` puts at coordinates of a local axis, 0
    /// and 1 included.
    pub(super) fn along(&self, axis: usize, place: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut cuts = vec![0.0, 1.0];
        for (centre, radius) in &self.balls {
            let of = |k: f64| place(centre[axis] + k * radius);
            cuts.extend([-1.0, -0.5, 0.0, 0.5, 1.0].map(of));
        }
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() <= 1e-14);
        cuts
    }

    /// Parameters at which a piece is cut, 0 and 1 included.
    pub(super) fn cuts(&self, piece: &Piece) -> Vec<f64> {
        let mut cuts = vec![0.0, 1.0];
        for (c, values) in [(0, &self.radii), (1, &self.heights)] {
            let (a, b) = (piece.start[c].f64(), piece.end[c].f64());
            let within = |v: &&f64| **v > a.min(b) && **v < a.max(b);
            let found = values.iter().filter(within);
            cuts.extend(found.map(|&v| piece.parameter_at(c, Dd::of(v)).f64()));
        }
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() <= 1e-14);
        cuts
    }
}
