//! Arcs and corners eight by eight, for loops that take one in each lane.
//!
//! ```text
//!   between the normals at an arc's ends   |u / (1 + S)|, as in super::chain
//!   beyond                                 the nearer end
//! ```
//!
//! Every lane does the same operations in the same order, whatever their number.

use pulp::Simd;

/// Shapes side by side.
pub(super) const LANES: usize = 8;

/// An arc, or a point whose tangents are not numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub(super) start: [f64; 2],
    pub(super) end: [f64; 2],
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
    pub(super) curvature: f64,
}

/// Eight of them.
#[derive(Debug, Clone)]
pub(super) struct Shapes {
    start: [[f64; LANES]; 2],
    end: [[f64; LANES]; 2],
    from: [[f64; LANES]; 2],
    to: [[f64; LANES]; 2],
    curvature: [f64; LANES],
}

/// As many as there are lanes.
pub(super) struct ShapeLanes<S: Simd> {
    pub(super) start: [S::f64s; 2],
    pub(super) end: [S::f64s; 2],
    pub(super) from: [S::f64s; 2],
    pub(super) to: [S::f64s; 2],
    pub(super) curvature: S::f64s,
}

impl Shapes {
    /// One shape or more, the last repeated where they are not eight.
    pub(super) fn new(list: &[Shape]) -> Self {
        let lane = |n: usize| &list[n.min(list.len() - 1)];
        let point =
            |of: fn(&Shape) -> [f64; 2]| [0, 1].map(|c| std::array::from_fn(|n| of(lane(n))[c]));
        Self {
            start: point(|s| s.start),
            end: point(|s| s.end),
            from: point(|s| s.from),
            to: point(|s| s.to),
            curvature: std::array::from_fn(|n| lane(n).curvature),
        }
    }

    /// The `n`-th lanes of them.
    #[inline(always)]
    pub(super) fn lanes<S: Simd>(&self, n: usize) -> ShapeLanes<S> {
        ShapeLanes {
            start: point::<S>(&self.start, n),
            end: point::<S>(&self.end, n),
            from: point::<S>(&self.from, n),
            to: point::<S>(&self.to, n),
            curvature: S::as_simd_f64s(&self.curvature).0[n],
        }
    }
}

#[inline(always)]
fn point<S: Simd>(of: &[[f64; LANES]; 2], n: usize) -> [S::f64s; 2] {
    [S::as_simd_f64s(&of[0]).0[n], S::as_simd_f64s(&of[1]).0[n]]
}

impl<S: Simd> ShapeLanes<S> {
    /// The squared distances of a point.
    #[inline(always)]
    pub(super) fn squares(&self, simd: S, q: [f64; 2]) -> S::f64s {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let q = [simd.splat_f64s(q[0]), simd.splat_f64s(q[1])];
        let (a, b) = (minus(simd, q, self.start), minus(simd, q, self.end));
        let (aa, bb) = (dot(simd, a, a), dot(simd, b, b));
        let u = simd.sub_f64s(
            simd.mul_f64s(simd.splat_f64s(2.0), cross(simd, self.from, a)),
            simd.mul_f64s(self.curvature, aa),
        );
        let rest = simd.sub_f64s(one, simd.mul_f64s(self.curvature, u));
        let rest = simd.select_f64s(simd.greater_than_f64s(rest, zero), rest, zero);
        let across = simd.div_f64s(u, simd.add_f64s(one, simd.sqrt_f64s(rest)));
        let ends = simd.select_f64s(simd.less_than_f64s(aa, bb), aa, bb);
        let beside = simd.and_m64s(
            simd.greater_than_or_equal_f64s(dot(simd, self.from, a), zero),
            simd.less_than_or_equal_f64s(dot(simd, self.to, b), zero),
        );
        simd.select_f64s(beside, simd.mul_f64s(across, across), ends)
    }
}

#[inline(always)]
pub(super) fn minus<S: Simd>(simd: S, a: [S::f64s; 2], b: [S::f64s; 2]) -> [S::f64s; 2] {
    [simd.sub_f64s(a[0], b[0]), simd.sub_f64s(a[1], b[1])]
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: [S::f64s; 2], b: [S::f64s; 2]) -> S::f64s {
    simd.add_f64s(simd.mul_f64s(a[0], b[0]), simd.mul_f64s(a[1], b[1]))
}

#[inline(always)]
fn cross<S: Simd>(simd: S, a: [S::f64s; 2], b: [S::f64s; 2]) -> S::f64s {
    simd.sub_f64s(simd.mul_f64s(a[0], b[1]), simd.mul_f64s(a[1], b[0]))
}
