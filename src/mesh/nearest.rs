//! The nearest point of a mesh.

use super::bvh::Holds;
use super::tree::MeshTree;
use glam::DVec3;

/// A nearest point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The point of the mesh, in scene units.
    pub point: DVec3,
    /// Its distance, in scene units; good to 16 roundings of the distance and of the triangle's
    /// coordinates.
    pub distance: f64,
    /// The triangle it is on; the first where several are equally near.
    pub triangle: u32,
}

impl MeshTree {
    /// The nearest point of the mesh; `None` without triangles.
    ///
    /// * `point`: in scene units.
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> Option<Nearest> {
        self.nearest_within(point, f64::INFINITY)
    }

    /// The nearest point of the mesh, where one is not further than `limit`.
    ///
    /// * `point`, `limit`: in scene units.
    #[must_use]
    pub fn nearest_within(&self, point: DVec3, limit: f64) -> Option<Nearest> {
        let p = point * self.scale;
        let mut best: Option<(f64, u32, DVec3)> = None;
        let mut reach = limit * self.scale;
        let mut pending: Vec<(f64, usize)> = Vec::with_capacity(64);
        let below = |at: usize| (self.bvh.distance_below(&self.bvh.nodes[at], p), at);
        pending.extend((!self.bvh.nodes.is_empty()).then(|| below(0)));
        while let Some((distance, at)) = pending.pop() {
            // Equal is looked at: of equally near triangles the first is wanted.
            if distance > reach {
                continue;
            }
            match self.bvh.nodes[at].holds(at) {
                Holds::Children(children) => {
                    let [a, b] = children.map(below);
                    pending.extend(if a.0 < b.0 { [b, a] } else { [a, b] });
                }
                Holds::Triangles(places) => {
                    for k in places {
                        let q = nearest_on(&self.corners[k], p);
                        let (d, id) = ((q - p).length(), self.bvh.order[k]);
                        let better = best.is_none_or(|(e, i, _)| d < e || d == e && id < i);
                        if d <= reach && better {
                            best = Some((d, id, q));
                            reach = d;
                        }
                    }
                }
            }
        }
        best.map(|(distance, triangle, q)| Nearest {
            point: q / self.scale,
            distance: distance / self.scale,
            triangle,
        })
    }
}

/// The nearest point of a triangle, flat to a line or a point as it may be.
fn nearest_on(t: &[DVec3; 3], p: DVec3) -> DVec3 {
    let [a, b, c] = *t;
    let n = (b - a).cross(c - a);
    let inward = |a: DVec3, b: DVec3| n.dot((b - a).cross(p - a)) >= 0.0;
    let squared = n.length_squared();
    if squared > 0.0 && inward(a, b) && inward(b, c) && inward(c, a) {
        return p - n * (n.dot(p - a) / squared);
    }
    [(a, b), (b, c), (c, a)]
        .map(|(a, b)| {
            let d = b - a;
            let s = (p - a).dot(d) / d.length_squared();
            // 0/0 of an edge without length ends at its point.
            if s > 0.0 { a + d * s.min(1.0) } else { a }
        })
        .into_iter()
        .min_by(|q, r| {
            (*q - p)
                .length_squared()
                .total_cmp(&(*r - p).length_squared())
        })
        .unwrap_or(a)
}
