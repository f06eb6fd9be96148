//! The generalised winding number: the solid angle of all triangles by 4π.
//!
//! ```text
//!   w(p) = 1/4π ∫ n·(x - p) / |x - p|³ dA
//!
//!   near   Σ 2 atan2(a·(b × c), |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)   a, b, c from p
//!   far    with r = c - p, ρ = |r| about a centre c of the node
//!          N·r/ρ³ + tr M/ρ³ - 3 rᵀM r/ρ⁵     N = ∫ n dA,  M = ∫ (x - c) nᵀ dA
//! ```
//!
//! The far form is the Taylor series of the gradient of 1/|x - p| to first order. Its second
//! derivatives are third derivatives of 1/ρ, at most 6/ρ⁴ in every direction, so a node of area A within R of
//! its centre is off by at most 3 A R² / (4π (ρ - R)⁴). A node is taken whole where that is no
//! more than its share of the accuracy, A of the area of all: the sum is then within the
//! accuracy, wherever the point is.
//!
//! Source: Van Oosterom & Strackee, *The solid angle of a plane triangle*, IEEE Trans. Biomed.
//! Eng. 30 (1983); Barill et al., *Fast winding numbers for soups and clouds*, ACM TOG 37 (2018).

use super::bvh::{Bvh, Holds};
use super::tree::MeshTree;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// The moments of a node's triangles.
#[derive(Debug, Clone, Copy)]
struct Pole {
    centre: DVec3,
    radius: f64,
    area: f64,
    /// N.
    normal: DVec3,
    /// M.
    first: DMat3,
}

/// The moments of all nodes.
#[derive(Debug, Clone)]
pub(super) struct Poles(Vec<Pole>);

impl Poles {
    fn new(bvh: &Bvh, corners: &[[DVec3; 3]]) -> Self {
        let empty = Pole {
            centre: DVec3::ZERO,
            radius: 0.0,
            area: 0.0,
            normal: DVec3::ZERO,
            first: DMat3::ZERO,
        };
        let mut poles = vec![empty; bvh.nodes.len()];
        // Boxes around the corners, exact.
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); bvh.nodes.len()];
        // Children come after their parents.
        for at in (0..bvh.nodes.len()).rev() {
            let parts: Vec<Pole> = match bvh.nodes[at].holds(at) {
                Holds::Triangles(places) => {
                    let own = &corners[places];
                    boxes[at] = own
                        .iter()
                        .flatten()
                        .fold(boxes[at], |(l, h), &v| (l.min(v), h.max(v)));
                    own.iter().map(Pole::of).collect()
                }
                Holds::Children(children) => {
                    let [a, b] = children.map(|c| boxes[c]);
                    boxes[at] = (a.0.min(b.0), a.1.max(b.1));
                    children.map(|c| poles[c]).to_vec()
                }
            };
            poles[at] = Pole::joined(&parts, boxes[at]);
        }
        Self(poles)
    }
}

impl Pole {
    fn of(t: &[DVec3; 3]) -> Self {
        let [a, b, c] = *t;
        let normal = 0.5 * (b - a).cross(c - a);
        // About its centroid a triangle has no first moment.
        Self {
            centre: (a + b + c) / 3.0,
            radius: 0.0,
            area: normal.length(),
            normal,
            first: DMat3::ZERO,
        }
    }

    fn joined(parts: &[Self], (low, high): (DVec3, DVec3)) -> Self {
        let area: f64 = parts.iter().map(|p| p.area).sum();
        let weighted: DVec3 = parts.iter().map(|p| p.centre * p.area).sum();
        let centre = if area > 0.0 {
            (weighted / area).clamp(low, high)
        } else {
            0.5 * low + 0.5 * high
        };
        let outer = |x: DVec3, n: DVec3| DMat3::from_cols(x * n.x, x * n.y, x * n.z);
        Self {
            centre,
            radius: (centre - low).max(high - centre).length(),
            area,
            normal: parts.iter().map(|p| p.normal).sum(),
            first: parts.iter().fold(DMat3::ZERO, |m, p| {
                m + p.first + outer(p.centre - centre, p.normal)
            }),
        }
    }
}

impl MeshTree {
    /// The winding number of the mesh about a point, within `accuracy` (and roundings) of the
    /// exact sum of all solid angles: 1 inside a closed mesh, 0 outside.
    ///
    /// Any accuracy below 0.5 tells inside from outside by rounding. On the mesh itself the number
    /// jumps, and what is found is in between.
    ///
    /// * `point`: in scene units.
    /// * `accuracy`: 0 for the sum over all triangles.
    #[must_use]
    pub fn winding_number(&self, point: DVec3, accuracy: f64) -> f64 {
        let p = point * self.scale;
        let Poles(poles) = self
            .poles
            .get_or_init(|| Poles::new(&self.bvh, &self.corners));
        let Some(root) = poles.first() else {
            return 0.0;
        };
        // 3 A R² / (4π (ρ - R)⁴) <= accuracy A / all
        let strength = if accuracy > 0.0 {
            3.0 * root.area / (4.0 * PI * accuracy)
        } else {
            f64::INFINITY
        };
        let mut angle = 0.0;
        let mut pending = vec![0];
        while let Some(at) = pending.pop() {
            let pole = &poles[at];
            let r = pole.centre - p;
            let distance = r.length();
            let gap = distance - pole.radius;
            if gap > 0.0 && (gap * gap) * (gap * gap) >= strength * pole.radius * pole.radius {
                let cubed = distance * distance * distance;
                let m = pole.first;
                let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
                let square = r.dot(m * r) / (distance * distance);
                angle += (pole.normal.dot(r) + trace - 3.0 * square) / cubed;
                continue;
            }
            match self.bvh.nodes[at].holds(at) {
                Holds::Children([first, second]) => pending.extend([second, first]),
                Holds::Triangles(places) => {
                    angle += self.corners[places]
                        .iter()
                        .map(|t| solid_angle(t, p))
                        .sum::<f64>();
                }
            }
        }
        angle / (4.0 * PI)
    }
}

/// The solid angle of a triangle, positive where its back is seen.
fn solid_angle(t: &[DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = t.map(|v| v - p);
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let sine = a.dot(b.cross(c));
    let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * sine.atan2(cosine)
}
