//! The share of a voxel that a turned region fills.
//!
//! A plane normal to the axis at height z cuts the voxel in a convex polygon P(z) and the solid in
//! discs about the axis, so with s_k = ±1 as the region lies inside or outside of piece k
//!
//! ```text
//!   V = Σ_k s_k ∫ area(P(z) ∩ disc(r_k(z)) ∩ wedge) dz
//! ```
//!
//! over the heights of the voxel. Where the voxel
//! stands upright on the axis P and the wedge are the same at every height, the area is closed form, and the integral runs
//! in the piece's parameter, cut at the radii where the circle meets a corner of the polygon or touches an edge: all
//! radii at which the area is not analytic. Between them it is, but for (r - r₀)^{3/2} at the cuts, which the substitution
//! t = 3u² - 2u³ makes smooth. Gauss-Kronrod panels are halved until the error estimate is below what the caller asks.
//!
//! All other voxels are those of [`oblique`](super::oblique).

use super::flux::Place;
use super::oblique::Spaces;
use super::revolved::Revolved;
use super::turn::Turn;
use crate::math::bernstein;
use crate::math::disc::{self, Polygon};
use crate::math::quadrature::{self, Integral};
use crate::math::similarity::LocalPoint;
use crate::math::tetrahedra::HalfSpace;
use crate::math::{Real, Similarity};
use crate::region::BoundaryPiece;
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Share of the voxel below which a sum of areas is taken as nothing, or as everything: rounding.
pub(super) const SNAP: f64 = 1e-11;
/// Estimated error of one stretch of a piece, as a share of the voxel: a hundredth of what is
/// promised, for the few stretches a voxel meets.
pub(crate) const TOLERANCE: f64 = 1e-8;

/// A voxel in a solid's own coordinates. All voxels of a grid share it.
#[derive(Debug, Clone)]
pub(crate) struct CellShape {
    edges: [DVec3; 3],
    upright: Option<Upright>,
    half_diagonal: f64,
    volume: f64,
}

/// A voxel with the same cross-section normal to the axis at every height.
#[derive(Debug, Clone)]
struct Upright {
    /// Corners relative to the centre, counter-clockwise.
    polygon: Polygon,
    low: f64,
    high: f64,
}

impl CellShape {
    /// The shape of a voxel with those side lengths (scene units) in a solid's frame.
    pub(crate) fn new(frame: &Similarity, sides: DVec3) -> Self {
        let axes = [DVec3::X * sides.x, DVec3::Y * sides.y, DVec3::Z * sides.z];
        Self::of_edges(axes.map(|v| frame.vector_to_local(v)))
    }

    /// The shape of a parallelepiped with those edges, in local coordinates.
    pub(super) fn of_edges(edges: [DVec3; 3]) -> Self {
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
            edges[0] * side(0) + edges[1] * side(1) + edges[2] * side(2)
        });
        Self {
            edges,
            upright: Upright::new(&corners),
            half_diagonal: corners.iter().fold(0.0, |m, c| m.max(c.length())),
            volume: edges[0].cross(edges[1]).dot(edges[2]).abs(),
        }
    }

    /// Half the diagonal, in local lengths.
    pub(crate) fn half_diagonal(&self) -> f64 {
        self.half_diagonal
    }
}

impl Upright {
    /// The shape with those corners; `None` where they are at more than two heights.
    fn new(corners: &[DVec3; 8]) -> Option<Self> {
        let low = corners.iter().fold(f64::INFINITY, |m, c| m.min(c.z));
        let high = corners.iter().fold(f64::NEG_INFINITY, |m, c| m.max(c.z));
        let near = 1e-12 * (high - low);
        let flat = |c: &DVec3| DVec2::new(c.x, c.y);
        let mut polygon: Polygon = (corners.iter().filter(|c| c.z - low <= near))
            .map(flat)
            .collect();
        let above = corners.iter().filter(|c| high - c.z <= near).count();
        if polygon.len() != 4 || above != 4 {
            return None;
        }
        polygon.sort_by(|a, b| a.to_angle().total_cmp(&b.to_angle()));
        Some(Self { polygon, low, high })
    }
}

/// Whether a half-space leaves the same of every height.
fn is_upright(space: &HalfSpace) -> bool {
    space.normal.z.abs() <= 1e-13 * space.normal.length()
}

/// What an upright half-space, given from the voxel's centre, leaves of a cross-section.
fn clip(polygon: &Polygon, space: &HalfSpace, centre: DVec2) -> Polygon {
    let normal = DVec2::new(space.normal.x, space.normal.y);
    let offset = space.offset + normal.dot(centre);
    let height = |p: DVec2| normal.dot(p) - offset;
    let mut left = Polygon::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if ha <= 0.0 {
            left.push(a);
        }
        if (ha <= 0.0) != (hb <= 0.0) {
            left.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    left
}

/// Convex parts of a cross-section within the turn, with their signs.
type Sections = SmallVec<[(Polygon, f64); 2]>;

/// How a voxel lies to the turn.
#[derive(Clone, Copy, PartialEq)]
enum Reach {
    /// The turn takes the whole voxel.
    Whole,
    /// A cap's plane passes through it.
    Cut,
}

/// The part of a cross-section within the turn.
fn within_turn(polygon: Polygon, turn: &Turn, reach: Reach) -> Sections {
    let mut sections = Sections::new();
    match turn {
        Turn::Partial(wedge) if reach == Reach::Cut => {
            let [s, e] = wedge.directions();
            if wedge.is_reflex() {
                // Everything less the convex rest.
                let rest = disc::clip_left(&disc::clip_left(&polygon, e), -s);
                sections.push((polygon, 1.0));
                sections.push((rest, -1.0));
            } else {
                sections.push((disc::clip_left(&disc::clip_left(&polygon, s), -e), 1.0));
            }
        }
        _ => sections.push((polygon, 1.0)),
    }
    sections
}

fn disc_area(sections: &Sections, r: f64) -> f64 {
    sections
        .iter()
        .map(|(p, sign)| sign * disc::polygon_disc_area(p, r))
        .sum()
}

impl Revolved {
    /// The share of the voxel that lies in the solid and in all the half-spaces, which are given
    /// from the voxel's centre.
    pub(crate) fn fraction_within(
        &self,
        shape: &CellShape,
        centre: DVec3,
        spaces: &[HalfSpace],
        tolerance: f64,
    ) -> Integral {
        let scale = self.frame().scale();
        // The frame turns and scales: a normal goes as a vector does, but for the length.
        let spaces = spaces.iter().map(|s| HalfSpace {
            normal: self.frame().vector_to_local(s.normal) * scale,
            offset: s.offset / scale,
        });
        let local = self.frame().to_local(centre);
        self.local_fraction(shape, local, &spaces.collect(), tolerance)
    }

    /// The same in local coordinates.
    pub(super) fn local_fraction(
        &self,
        shape: &CellShape,
        centre: LocalPoint,
        spaces: &Spaces,
        tolerance: f64,
    ) -> Integral {
        let flat = DVec2::new(centre.point.x, centre.point.y);
        let mut reach = Reach::Whole;
        let mut wedge = None;
        if let Turn::Partial(turn) = self.turn() {
            let half = shape.half_diagonal();
            if turn
                .directions()
                .iter()
                .all(|d| d.perp_dot(flat).abs() > half)
            {
                if turn.contains(flat, 0.0) == Some(false) {
                    return Integral::default();
                }
            } else {
                reach = Reach::Cut;
                wedge = Some(turn);
            }
        }
        match &shape.upright {
            Some(upright) if spaces.iter().all(is_upright) => {
                let moved = upright.polygon.iter().map(|p| *p + flat);
                let left = |polygon, space| clip(&polygon, space, flat);
                let polygon = spaces.iter().fold(moved.collect(), left);
                let sections = within_turn(polygon, self.turn(), reach);
                let heights = [centre.point.z + upright.low, centre.point.z + upright.high];
                let around = [
                    (flat.length() - shape.half_diagonal).max(0.0),
                    flat.length() + shape.half_diagonal,
                ];
                let found =
                    self.upright_volume(&sections, heights, around, tolerance * shape.volume);
                Integral {
                    value: found.value / shape.volume,
                    error: found.error / shape.volume,
                }
            }
            _ => {
                let place = Place::new(shape.edges, centre.point, centre.error);
                self.oblique_fraction(&place, spaces, wedge, tolerance)
            }
        }
    }

    /// The volume over a cross-section, which is between two radii, between two heights.
    ///
    /// * `tolerance`: error allowed to one stretch of a piece.
    fn upright_volume(
        &self,
        sections: &Sections,
        [bottom, top]: [f64; 2],
        [near, far]: [f64; 2],
        tolerance: f64,
    ) -> Integral {
        let radii = critical_radii(sections);
        let mut volume = Integral::default();
        self.boundary_near(bottom, top, near, |part| {
            let piece = &part.piece;
            let sign = f64::from(part.disc_sign());
            if sign == 0.0 || piece.on_axis {
                return;
            }
            let low = piece.bounds.min[1].max(bottom);
            let high = piece.bounds.max[1].min(top);
            if low >= high {
                return;
            }
            if piece.bounds.min[0] >= far {
                // The disc takes the whole polygon.
                volume.value += sign * ((high - low) * disc_area(sections, 2.0 * far));
                return;
            }
            let stretch = Stretch::new(part, low, high);
            let area = |r: f64| disc_area(sections, r);
            let found = stretch.volume(&stretch.at_radii(&radii), tolerance, &area);
            volume.value += sign * found.value;
            volume.error += found.error;
        });
        volume
    }
}

/// Radii at which the area of polygon ∩ disc is not smooth: corners and feet of edges.
fn critical_radii(sections: &Sections) -> Vec<f64> {
    let mut radii = Vec::new();
    for (polygon, _) in sections {
        for (i, &a) in polygon.iter().enumerate() {
            let d = polygon[(i + 1) % polygon.len()] - a;
            radii.push(a.length());
            let foot = -a.dot(d) / d.length_squared();
            if foot > 0.0 && foot < 1.0 {
                radii.push((a + d * foot).length());
            }
        }
    }
    radii
}

/// The part of a piece between two heights.
struct Stretch<'a> {
    part: &'a BoundaryPiece,
    from: f64,
    to: f64,
}

type Cuts = SmallVec<[f64; 16]>;

impl<'a> Stretch<'a> {
    fn new(part: &'a BoundaryPiece, low: f64, high: f64) -> Self {
        let (a, b) = (parameter(part, 1, low), parameter(part, 1, high));
        let (from, to) = if part.piece.direction() > 0 {
            (a, b)
        } else {
            (b, a)
        };
        Self { part, from, to }
    }

    /// The radius and height at a parameter.
    fn point(&self, t: f64) -> [f64; 2] {
        let piece = &self.part.piece;
        let p = piece.twin.at(t);
        [p[0] + piece.twin.origin[0], p[1] + piece.twin.origin[1]]
    }

    /// Parameters at which the radius takes one of the values.
    fn at_radii(&self, radii: &[f64]) -> Cuts {
        let (a, b) = (self.point(self.from)[0], self.point(self.to)[0]);
        let inner = radii.iter().filter(|&&r| r > a.min(b) && r < a.max(b));
        inner.map(|&r| parameter(self.part, 0, r)).collect()
    }

    /// ∫ area(r(z)) |dz|, cut at the given parameters.
    fn volume(&self, cuts: &[f64], tolerance: f64, area: &impl Fn(f64) -> f64) -> Integral {
        let piece = &self.part.piece;
        let mut ends: Cuts = cuts
            .iter()
            .copied()
            .filter(|&t| t > self.from && t < self.to)
            .collect();
        ends.push(self.from);
        ends.push(self.to);
        ends.sort_by(f64::total_cmp);
        let [r, z, w] = &piece.twin.coefficients;
        let origin = piece.twin.origin;
        let linear = piece.degree() == 1;
        let (start, end) = (piece.start.map(Real::f64), piece.end.map(Real::f64));
        let integrand = |t: f64| {
            if linear {
                let dz = end[1] - start[1];
                return area(start[0] + (end[0] - start[0]) * t) * dz.abs();
            }
            let (r, _) = bernstein::evaluate_with_derivative(r, t);
            let (z, dz) = bernstein::evaluate_with_derivative(z, t);
            let (w, dw) = bernstein::evaluate_with_derivative(w, t);
            area(r / w + origin[0]) * ((dz * w - z * dw) / (w * w)).abs()
        };
        let mut sum = Integral::default();
        for c in ends.windows(2).filter(|c| c[1] > c[0]) {
            let width = c[1] - c[0];
            let smooth = |u: f64| {
                integrand(c[0] + width * u * u * (3.0 - 2.0 * u)) * width * 6.0 * u * (1.0 - u)
            };
            let one = quadrature::integrate(smooth, 0.0, 1.0, tolerance, 256);
            sum.value += one.value;
            sum.error += one.error;
        }
        sum
    }
}

/// The parameter at which coordinate `c` of a piece takes the value `v`, clamped to the piece.
fn parameter(part: &BoundaryPiece, c: usize, v: f64) -> f64 {
    let piece = &part.piece;
    let (start, end) = (piece.start[c].f64(), piece.end[c].f64());
    let rising = end > start;
    if v == start || (v < start) == rising {
        return 0.0;
    }
    if v == end || (v > end) == rising {
        return 1.0;
    }
    if piece.degree() == 1 {
        return (v - start) / (end - start);
    }
    let target = v - piece.twin.origin[c];
    let off = |t: f64| piece.twin.at(t)[c] - target;
    illinois(&off, 0.0, 1.0, off(0.0), off(1.0))
}

/// The root of `f` between `a` and `b`: the secant, halving the value at the end it keeps. Where the
/// values at the ends do not differ in sign, the root is within rounding of the end nearer to it.
fn illinois(f: &impl Fn(f64) -> f64, a: f64, b: f64, f_a: f64, f_b: f64) -> f64 {
    let (mut lo, mut hi, mut f_lo, mut f_hi) = (a, b, f_a, f_b);
    if (f_lo < 0.0) == (f_hi < 0.0) {
        return if f_lo.abs() < f_hi.abs() { a } else { b };
    }
    let close = 4.0 * f64::EPSILON * (f_hi - f_lo).abs();
    let mut side = 0;
    for _ in 0..100 {
        let secant = lo - f_lo * (hi - lo) / (f_hi - f_lo);
        let m = if secant > lo && secant < hi {
            secant
        } else {
            0.5 * (lo + hi)
        };
        if !(m > lo && m < hi) || hi - lo <= 1e-15 {
            break;
        }
        let v = f(m);
        if v.abs() <= close {
            return m;
        }
        if (v < 0.0) == (f_lo < 0.0) {
            if side == -1 {
                f_hi *= 0.5;
            }
            (lo, f_lo, side) = (m, v, -1);
        } else {
            if side == 1 {
                f_lo *= 0.5;
            }
            (hi, f_hi, side) = (m, v, 1);
        }
    }
    0.5 * (lo + hi)
}
