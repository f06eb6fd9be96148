//! The share of a voxel, less what half-spaces take, that a solid of rational patches fills. Whole voxels
//! are those of [`patch_voxel`](super::patch_voxel).
//!
//! The voxel is cut in tetrahedra, each mapped to x, y, z >= 0, x + y + z <= 1. The divergence of
//! (x, 0, 0) is 1 and its flux through three of the four faces is nothing, and so again in the
//! fourth face and on its edge from (0, 1, 0) to (0, 0, 1):
//!
//! ```text
//!   V = ∬_S x n_x dA + A       S the solid's surface within
//!   A = ∮ (y - y²/2 - y z) dz + B       along the boundary of the solid in the face x + y + z = 1
//!   B = Σ ± H(z),  H = -(1 - z)³/6       over the crossings of the edge, and its ends that are inside
//! ```
//!
//! So a surface, clipped, and the membership of one corner give the volume. The surface is a
//! triangulation of the faces' parts within the voxel on grids of n, 2n, 4n.. parts, alike on both
//! sides of every edge; its volume errs by c/n² + .., which two grids together remove. Grids are
//! refined until what they say together agrees.
//!
//! * Error: the difference of the last two results, which is that of the coarser one.

use super::fraction::SNAP;
use super::patch_voxel::Cube;
use super::patches::Patches;
use crate::math::Side;
use crate::math::tetrahedra::{HalfSpace, Tetrahedron, box_tetrahedra_within};
use glam::DVec3;
use smallvec::SmallVec;

/// Grids of at most 2^this parts along a part of a face.
const FINEST: u32 = 7;

/// A part of a face within reach of the voxel: homogeneous points from the voxel's centre, local.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) counts: [usize; 2],
    pub(super) points: Net,
    /// +1 where X_u × X_v points out of the solid, else -1.
    pub(super) outward: f64,
}

/// Control points of a patch.
pub(super) type Net = SmallVec<[[f64; 4]; 16]>;
/// Control points of a line on it.
pub(super) type Line = SmallVec<[[f64; 4]; 8]>;

/// A difference of two results, as a share of the voxel, below which the finer one is good: its own
/// error is several times less.
const AGREE: f64 = 1e-7;

/// Halvings of a voxel that has no corner clear of the surface.
const DEEPEST: u32 = 3;

impl Patches {
    pub(super) fn fraction_within(
        &self,
        sides: DVec3,
        centre: DVec3,
        spaces: &[HalfSpace],
        tolerance: f64,
    ) -> f64 {
        let agree = tolerance.max(AGREE);
        let share = self.share_within(sides, centre, spaces, agree, 0);
        if share < SNAP {
            0.0
        } else if share > 1.0 - SNAP {
            1.0
        } else {
            share
        }
    }

    fn share_within(
        &self,
        sides: DVec3,
        centre: DVec3,
        spaces: &[HalfSpace],
        agree: f64,
        depth: u32,
    ) -> f64 {
        let clear = if depth < DEEPEST {
            0.02 * sides.min_element()
        } else {
            0.0
        };
        let (corner, distance) = self.clearest_corner(sides, centre, clear);
        // All tetrahedra of a box share its first corner.
        let mut tetrahedra = box_tetrahedra_within(-corner, spaces);
        let starts = if distance < clear {
            None
        } else {
            let first = self.side(centre + corner) != Side::Outside;
            self.starts(&mut tetrahedra, (corner, first), centre, clear)
        };
        let Some(starts) = starts else {
            let eighths = (0..8_u32).map(|n| {
                let side = |bit: u32| if n >> bit & 1 == 1 { 0.25 } else { -0.25 };
                let by = sides * DVec3::new(side(0), side(1), side(2));
                let moved = spaces.iter().map(|s| HalfSpace {
                    normal: s.normal,
                    offset: s.offset - s.normal.dot(by),
                });
                let moved: SmallVec<[HalfSpace; 4]> = moved.collect();
                self.share_within(0.5 * sides, centre + by, &moved, agree, depth + 1)
            });
            return eighths.sum::<f64>() / 8.0;
        };
        let parts = self.parts(sides, centre);
        if spaces.is_empty() {
            let first = starts.first().is_some_and(|s| *s);
            return Cube::new(self.frame(), corner).share(&parts, first, agree);
        }
        let volume = sides.element_product();
        let whole = |n: u32| -> f64 {
            let triangles = parts.iter().flat_map(|p| p.triangles(n, self.frame()));
            let triangles: Vec<[DVec3; 3]> = triangles.collect();
            let shares = tetrahedra.iter().zip(&starts);
            let shares = shares.map(|(t, start)| share(t, *start, &triangles));
            shares.sum::<f64>() / volume
        };
        let mut last = whole(2);
        let mut settled: Option<f64> = None;
        for level in 2..=FINEST {
            let next = whole(1 << level);
            // c/n² removed.
            let better = next + (next - last) / 3.0;
            let done = settled.is_some_and(|s| (better - s).abs() <= agree);
            settled = Some(better);
            last = next;
            if done || parts.is_empty() {
                break;
            }
        }
        settled.unwrap_or(last)
    }

    /// A corner of the voxel, from its centre, that is at least `clear` of the surface, or the one
    /// that is furthest, and how far. On the surface itself a triangulation has no say, and faces
    /// that lie in those of the tetrahedra must lie in those opposite to where these start.
    fn clearest_corner(&self, sides: DVec3, centre: DVec3, clear: f64) -> (DVec3, f64) {
        let away = self
            .foot(centre, true)
            .map_or(DVec3::X, |foot| centre - foot);
        let mut corners: SmallVec<[DVec3; 8]> = (0..8_u32)
            .map(|n| {
                let side = |bit: u32| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
                sides * DVec3::new(side(0), side(1), side(2))
            })
            .collect();
        // Seen from the nearest point of the surface, the furthest first.
        corners.sort_by(|a, b| b.dot(away).total_cmp(&a.dot(away)));
        let mut best = (corners[0], -1.0);
        for corner in corners {
            let distance = self.distance(centre + corner, true, f64::INFINITY);
            if distance > best.1 {
                best = (corner, distance);
            }
            if distance >= clear {
                break;
            }
        }
        best
    }

    /// Whether the first corners of the tetrahedra are inside, with corners put first that are `clear`
    /// of the surface; `None` where there is none.
    fn starts(
        &self,
        tetrahedra: &mut [Tetrahedron],
        (corner, inside): (DVec3, bool),
        centre: DVec3,
        clear: f64,
    ) -> Option<SmallVec<[bool; 32]>> {
        let mut starts = SmallVec::new();
        for tetrahedron in tetrahedra {
            if let Some(k) = (0..4).find(|&k| tetrahedron[k] == corner) {
                tetrahedron.swap(0, k);
                starts.push(inside);
                continue;
            }
            // Half-spaces have cut the corner off.
            let distance = |k: usize| self.distance(centre + tetrahedron[k], true, f64::INFINITY);
            let k = (0..4).find(|&k| distance(k) >= clear)?;
            tetrahedron.swap(0, k);
            starts.push(self.side(centre + tetrahedron[0]) != Side::Outside);
        }
        Some(starts)
    }

    /// The parts of faces that may reach into the voxel, halved until none is much larger.
    fn parts(&self, sides: DVec3, centre: DVec3) -> Vec<Part> {
        let frame = self.frame();
        let local = frame.to_local(centre).point;
        // A box around the voxel in local coordinates.
        let half = DVec3::from_array(
            [0, 1, 2].map(|i| (frame.axis(i) * 0.5 * sides).abs().element_sum() / frame.scale()),
        ) * (1.0 + 1e-9);
        let mut parts = Vec::new();
        // Every face is halved alike, so that neighbours meet at the same points.
        let depth = self.depth(half.max_element());
        for face in self.faces().faces() {
            let points = face.surface.control_points().iter();
            let points: Net = points
                .map(|h| {
                    let w = h.weight;
                    let d: [f64; 3] = std::array::from_fn(|k| h.weighted[k] - w * local[k]);
                    [d[0], d[1], d[2], w]
                })
                .collect();
            let whole = Part {
                counts: face.surface.degrees().map(|p| p + 1),
                points,
                outward: f64::from(face.outward),
            };
            whole.within(half, depth, &mut parts);
        }
        parts
    }

    /// How often faces are halved for voxels of that half extent, in local lengths.
    fn depth(&self, half: f64) -> u32 {
        let sizes = self.faces().faces().iter().map(|f| {
            let (low, high) = f.surface.control_bounds();
            (DVec3::from_array(high) - DVec3::from_array(low)).max_element()
        });
        let largest = sizes.fold(0.0, f64::max);
        let mut depth = 0;
        while depth < 20 && largest > 4.0 * half * f64::from(1_u32 << depth) {
            depth += 1;
        }
        depth
    }
}

/// The volume of the solid in a tetrahedron, by the surface's triangles (both from the voxel's centre,
/// scene units) and whether its first corner, where the last edge starts, is inside.
fn share(corners: &Tetrahedron, start: bool, triangles: &[[DVec3; 3]]) -> f64 {
    let [b, o, a, c] = *corners;
    let (e1, e2, e3) = (a - o, b - o, c - o);
    let det = e1.cross(e2).dot(e3);
    if det == 0.0 {
        return 0.0;
    }
    let rows = [e2.cross(e3) / det, e3.cross(e1) / det, e1.cross(e2) / det];
    let mut flux = Flux::default();
    for t in triangles {
        let p = t.map(|v| DVec3::from_array(rows.map(|r| r.dot(v - o))));
        // A left-handed map turns the triangles round.
        flux.add(if det > 0.0 { p } else { [p[0], p[2], p[1]] });
    }
    let edge = if start { 1.0 / 6.0 } else { 0.0 };
    (flux.sum + edge) * det.abs()
}

impl Part {
    /// Adds the parts of this one after `depth` more halvings both ways that may reach into the box
    /// `± half`.
    fn within(self, half: DVec3, depth: u32, out: &mut Vec<Self>) {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for h in &self.points {
            let p = DVec3::new(h[0], h[1], h[2]) / h[3];
            low = low.min(p);
            high = high.max(p);
        }
        if low.cmpgt(half).any() || high.cmplt(-half).any() {
            return;
        }
        if depth == 0 {
            out.push(self);
            return;
        }
        for first in self.halves(0) {
            for part in first.halves(1) {
                part.within(half, depth - 1, out);
            }
        }
    }

    pub(super) fn halves(&self, direction: usize) -> [Self; 2] {
        let [n, m] = self.counts;
        let (count, rows, step, stride) = if direction == 0 {
            (n, m, 1, n)
        } else {
            (m, n, n, 1)
        };
        let (mut lower, mut upper) = (self.points.clone(), self.points.clone());
        for row in 0..rows {
            let at = |i: usize| row * stride + i * step;
            let mut work: SmallVec<[[f64; 4]; 8]> =
                (0..count).map(|i| self.points[at(i)]).collect();
            for level in (0..count).rev() {
                lower[at(count - 1 - level)] = work[0];
                upper[at(level)] = work[level];
                for i in 0..level {
                    work[i] = std::array::from_fn(|c| 0.5 * (work[i][c] + work[i + 1][c]));
                }
            }
        }
        [lower, upper].map(|points| Self {
            counts: self.counts,
            points,
            outward: self.outward,
        })
    }

    /// Two triangles for each cell of an n × n grid of parameters, outward counter-clockwise, from
    /// the voxel's centre in scene units.
    fn triangles(&self, n: u32, frame: &crate::math::Similarity) -> Vec<[DVec3; 3]> {
        let axes = [0, 1, 2].map(|i| frame.axis(i) * frame.scale());
        let (columns, rows) = (self.counts[0], self.counts[1]);
        let mut grid: Vec<DVec3> = Vec::new();
        let mut line: SmallVec<[[f64; 4]; 8]> = SmallVec::new();
        for j in 0..=n {
            line.clear();
            let v = f64::from(j) / f64::from(n);
            line.extend((0..columns).map(|i| {
                let column: SmallVec<[[f64; 4]; 8]> =
                    (0..rows).map(|r| self.points[r * columns + i]).collect();
                reduced(column, v)
            }));
            for i in 0..=n {
                let h = reduced(line.clone(), f64::from(i) / f64::from(n));
                let w = h[3];
                grid.push(axes[0] * (h[0] / w) + axes[1] * (h[1] / w) + axes[2] * (h[2] / w));
            }
        }
        let at = |i: u32, j: u32| grid[(j * (n + 1) + i) as usize];
        let mut triangles = Vec::with_capacity(2 * (n * n) as usize);
        for j in 0..n {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                for t in [[a, b, c], [a, c, d]] {
                    triangles.push(if self.outward > 0.0 {
                        t
                    } else {
                        [t[0], t[2], t[1]]
                    });
                }
            }
        }
        triangles
    }
}

/// De Casteljau's point of a homogeneous row.
fn reduced(mut row: SmallVec<[[f64; 4]; 8]>, t: f64) -> [f64; 4] {
    for level in (1..row.len()).rev() {
        for i in 0..level {
            row[i] = std::array::from_fn(|c| row[i][c] * (1.0 - t) + row[i + 1][c] * t);
        }
    }
    row[0]
}

type Polygon = SmallVec<[DVec3; 8]>;

/// The sums of the surface's part: everything but the edge's end.
#[derive(Debug, Default)]
struct Flux {
    sum: f64,
}

impl Flux {
    /// Adds a triangle in the coordinates of the tetrahedron.
    fn add(&mut self, triangle: [DVec3; 3]) {
        let heights = |p: DVec3| [p.x, p.y, p.z, 1.0 - p.x - p.y - p.z];
        let all = triangle.map(heights);
        if (0..4).any(|k| all.iter().all(|h| h[k] <= 0.0)) {
            return;
        }
        let mut polygon: Polygon = triangle.into_iter().collect();
        for axis in 0..3 {
            polygon = clipped(&polygon, |p| p[axis], |p| p[axis] = 0.0);
        }
        // The last cut leaves one edge in the face x + y + z = 1, from `from` to `to`.
        let depth = |p: DVec3| 1.0 - p.x - p.y - p.z;
        let mut left = Polygon::new();
        let (mut from, mut to) = (None, None);
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (da, db) = (depth(a), depth(b));
            if da >= 0.0 {
                left.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                let cut = a + (b - a) * (da / (da - db));
                left.push(cut);
                if da >= 0.0 {
                    from = Some(cut);
                } else {
                    to = Some(cut);
                }
            }
        }
        self.sum += flux_of_x(&left);
        if let (Some(from), Some(to)) = (from, to) {
            // The solid in the face has the edge the other way round.
            self.sum += along_edge(to, from);
        }
    }
}

/// What a clip by `height >= 0` leaves; points on it are put there.
fn clipped(polygon: &Polygon, height: impl Fn(DVec3) -> f64, put: impl Fn(&mut DVec3)) -> Polygon {
    let mut left = Polygon::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            left.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            let mut cut = a + (b - a) * (ha / (ha - hb));
            put(&mut cut);
            left.push(cut);
        }
    }
    left
}

/// ∬ x n_x dA over a planar polygon.
fn flux_of_x(polygon: &Polygon) -> f64 {
    let mut sum = 0.0;
    for i in 2..polygon.len() {
        let [a, b, c] = [polygon[0], polygon[i - 1], polygon[i]];
        sum += (a.x + b.x + c.x) / 6.0 * (b - a).cross(c - a).x;
    }
    sum
}

/// ∫ (y - y²/2 - y z) dz along an edge, and what its ends on x = 0 give of B.
fn along_edge(from: DVec3, to: DVec3) -> f64 {
    let value = |p: DVec3| p.y - 0.5 * p.y * p.y - p.y * p.z;
    // Quadratic along the edge: Simpson's rule is exact.
    let sum = value(from) + 4.0 * value(0.5 * (from + to)) + value(to);
    let end = |p: DVec3| {
        if p.x == 0.0 {
            -(1.0 - p.z).powi(3) / 6.0
        } else {
            0.0
        }
    };
    // Where the boundary leaves the edge of the face an inside stretch of it ends, where it comes
    // to the edge one begins.
    sum / 6.0 * (to.z - from.z) + end(from) - end(to)
}
