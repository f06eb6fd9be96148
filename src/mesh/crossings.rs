//! Crossings of a ray along +x, decided exactly.
//!
//! Seen along x, a triangle is crossed where its projection holds the point (y, z). The point is
//! taken as (y + ε, z + ε²) with ε > 0 smaller than every number (simulation of simplicity), so it
//! lies on no projected edge. For an edge from a to b
//!
//! ```text
//!   E(q) = (b_y - a_y)(q_z - a_z) - (b_z - a_z)(q_y - a_y)        orient2d, its sign exact
//!   E(q + (ε, ε²)) = E(q) - (b_z - a_z) ε + (b_y - a_y) ε²
//! ```
//!
//! so the sign is that of the first of E(q), a_z - b_z, b_y - a_y that is not 0. It is the opposite for the
//! reversed edge: two triangles that share an edge agree on it to the last bit, a ray through an edge or a
//! vertex passes between triangles and never through none or too many, and triangles seen edge on
//! are not crossed. A crossing is beyond the point where `orient3d` has the sign of the
//! projection; it is 0 only for a point on the triangle.
//!
//! Source: Edelsbrunner & Mücke, *Simulation of simplicity*, ACM TOG 9 (1990); Shewchuk, *Adaptive
//! precision floating-point arithmetic and fast robust geometric predicates*, DCG 18 (1997).

use super::tree::MeshTree;
use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// What a ray crosses on its way from a point to x = +∞.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCrossings {
    /// How many triangles.
    pub count: u32,
    /// Those crossed from inside out less those from outside in: the winding number of a closed
    /// mesh, exactly.
    pub signed: i32,
}

impl RayCrossings {
    /// Whether the number of crossings is odd.
    #[must_use]
    pub fn is_inside(self) -> bool {
        self.count % 2 == 1
    }
}

impl MeshTree {
    /// The crossings of the ray along +x from a point, right for every point that is not on the
    /// mesh; for those on it one of the two answers, the same every time.
    ///
    /// * `point`: in scene units.
    #[must_use]
    pub fn crossings(&self, point: DVec3) -> RayCrossings {
        let p = point * self.scale;
        let [x, y, z] = self.bvh.map(p);
        let mut found = RayCrossings::default();
        self.bvh.visit(
            |n| n.max[0] >= x && n.min[1] <= y && y <= n.max[1] && n.min[2] <= z && z <= n.max[2],
            |places| {
                for t in &self.corners[places] {
                    let facing = facing(t, p.y, p.z);
                    if facing != 0 && is_beyond(t, facing, p) {
                        found.count += 1;
                        found.signed += facing;
                    }
                }
            },
        );
        found
    }

    /// The crossings of a row of points that differ in x, with one walk through the tree: what
    /// [`crossings`](Self::crossings) gives for each.
    ///
    /// * `xs`: coordinates in scene units, rising.
    /// * `y`, `z`: those that the points share.
    /// * `out`: one for each point.
    ///
    /// # Panics
    /// When `xs` and `out` differ in length.
    pub fn crossings_row(&self, xs: &[f64], y: f64, z: f64, out: &mut [RayCrossings]) {
        assert_eq!(xs.len(), out.len(), "a result for each point");
        out.fill(RayCrossings::default());
        let Some(&first) = xs.first() else {
            return;
        };
        let p = DVec3::new(first, y, z) * self.scale;
        let [x, my, mz] = self.bvh.map(p);
        self.bvh.visit(
            |n| {
                n.max[0] >= x
                    && n.min[1] <= my
                    && my <= n.max[1]
                    && n.min[2] <= mz
                    && mz <= n.max[2]
            },
            |places| {
                for t in &self.corners[places] {
                    let facing = facing(t, p.y, p.z);
                    if facing == 0 {
                        continue;
                    }
                    let before = self.before(t, facing, xs, p);
                    if before > 0 {
                        out[before - 1].count += 1;
                        out[before - 1].signed += facing;
                    }
                }
            },
        );
        // A crossing is one for every point before it.
        let mut sum = RayCrossings::default();
        for at in out.iter_mut().rev() {
            sum.count += at.count;
            sum.signed += at.signed;
            *at = sum;
        }
    }

    /// How many of the points a crossed triangle is beyond. The rounded crossing only says where to
    /// ask.
    fn before(&self, t: &[DVec3; 3], facing: i32, xs: &[f64], p: DVec3) -> usize {
        let [a, b, c] = *t;
        let n = (b - a).cross(c - a);
        let x = a.x - (n.y * (p.y - a.y) + n.z * (p.z - a.z)) / n.x;
        let (low, high) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        // NaN, where the normal rounds to 0, becomes a corner.
        let x = if x > low { x.min(high) } else { low };
        let mut before = xs.partition_point(|&v| v * self.scale < x);
        let beyond = |i: usize| is_beyond(t, facing, DVec3::new(xs[i] * self.scale, p.y, p.z));
        while before < xs.len() && beyond(before) {
            before += 1;
        }
        while before > 0 && !beyond(before - 1) {
            before -= 1;
        }
        before
    }
}

/// The sign of the projected triangle's orientation where it holds the point, the sign of its normal's
/// x; 0 elsewhere.
#[inline]
fn facing(t: &[DVec3; 3], y: f64, z: f64) -> i32 {
    let [a, b, c] = t;
    // The shifted point is not on the far side of a box it leaves.
    if y < a.y.min(b.y).min(c.y)
        || y >= a.y.max(b.y).max(c.y)
        || z < a.z.min(b.z).min(c.z)
        || z > a.z.max(b.z).max(c.z)
    {
        return 0;
    }
    let sign = edge_sign(a, b, y, z);
    if sign != 0 && edge_sign(b, c, y, z) == sign && edge_sign(c, a, y, z) == sign {
        sign
    } else {
        0
    }
}

/// The side of the edge that the shifted point is on: 1 left, -1 right, 0 where the edge projects
/// to a point.
#[inline]
fn edge_sign(a: &DVec3, b: &DVec3, y: f64, z: f64) -> i32 {
    let sign = |v: f64| i32::from(v > 0.0) - i32::from(v < 0.0);
    let coord = |y: f64, z: f64| Coord { x: y, y: z };
    let exact = sign(orient2d(coord(a.y, a.z), coord(b.y, b.z), coord(y, z)));
    if exact != 0 {
        return exact;
    }
    let order = |a: f64, b: f64| i32::from(a > b) - i32::from(a < b);
    match order(a.z, b.z) {
        0 => order(b.y, a.y),
        first => first,
    }
}

/// Whether the triangle, crossed with that sign, is at a larger x than the point.
#[inline]
fn is_beyond(t: &[DVec3; 3], facing: i32, p: DVec3) -> bool {
    // Nothing to decide beside the triangle.
    let [a, b, c] = t;
    if p.x < a.x.min(b.x).min(c.x) {
        return true;
    }
    if p.x > a.x.max(b.x).max(c.x) {
        return false;
    }
    let coord = |v: &DVec3| Coord3D {
        x: v.x,
        y: v.y,
        z: v.z,
    };
    let side = orient3d(coord(a), coord(b), coord(c), coord(&p));
    if facing > 0 { side > 0.0 } else { side < 0.0 }
}
