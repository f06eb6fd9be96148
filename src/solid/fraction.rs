//! The share of a voxel that a turned region fills.
//!
//! A plane normal to the axis at height z cuts the voxel in a convex polygon P(z) and the solid in
//! discs about the axis, so with s_k = ±1 as the region lies inside or outside of piece k
//!
//! ```text
//!   V = Σ_k s_k ∫ area(P(z) ∩ disc(r_k(z)) ∩ wedge) dz
//! ```
//!
//! over the heights of the voxel (MATH: exact volume fraction of a cell, for any orientation). The
//! area is closed form; the integral runs in the piece's parameter, cut at the heights where the
//! polygon changes its edges and, for a polygon that does not change with z, at the radii where
//! the circle meets its corners or touches its edges. In between the integrand is smooth but for
//! (r - r₀)^{3/2} at the cuts, which the substitution t = 3u² - 2u³ makes smooth. Gauss-Kronrod
//! panels are halved until the error estimate is below what the caller asks.
//!
//! For a polygon that changes with z, all planes that bound it (sides of the voxel, half-spaces, caps) are lines that
//! move evenly with z. So where two of them meet runs along a straight line, and that it passes a third one, or that the
//! circle passes it or touches a line, are zeros of polynomials in z or in the piece's parameter: all are cuts. Without
//! them the two rules of a panel may agree on a wrong number, as a kink need not lie where their points see it.
//!
//! A voxel that nothing but its own sides bounds has its areas from [`super::cross_section`]; its cuts are looked for where
//! the radii of the piece and of a corner or a side overlap, and between cuts where nothing is touched, seven points are
//! tried first.

use super::cross_section::{Corner, CrossSections};
use super::revolved::Revolved;
use super::turn::Turn;
use crate::math::bernstein::{self, Coefficients};
use crate::math::disc::{self, Polygon};
use crate::math::tetrahedra::HalfSpace;
use crate::math::{Real, Similarity, quadrature};
use crate::region::{BoundaryPiece, Piece};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Share of the voxel below which a sum of areas is taken as nothing, or as everything: rounding.
pub(crate) const SNAP: f64 = 1e-11;
/// Estimated error of one stretch of a piece, as a share of the voxel: a hundredth of what is
/// promised, for the few stretches a voxel meets.
pub(crate) const TOLERANCE: f64 = 1e-8;

/// The cross-sections of a voxel, normal to a solid's axis. All voxels of a grid share it.
#[derive(Debug, Clone)]
pub(crate) struct CellShape {
    /// The eight corners relative to the centre, in local coordinates.
    corners: [DVec3; 8],
    /// Distinct heights of corners, ascending, relative to the centre.
    heights: Vec<f64>,
    /// For each slab between heights, the edges in counter-clockwise order.
    slabs: Vec<Vec<[usize; 2]>>,
    /// For each slab the voxel's sides that bound the polygon, from its centre; in the order of the edges.
    sides: Vec<Vec<HalfSpace>>,
    /// Whether the polygon is the same at every height.
    upright: bool,
    volume: f64,
}

const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

impl CellShape {
    /// The shape of a voxel with those side lengths (scene units) in a solid's frame.
    pub(crate) fn new(frame: &Similarity, sides: DVec3) -> Self {
        let axes = [DVec3::X * sides.x, DVec3::Y * sides.y, DVec3::Z * sides.z];
        Self::of_edges(axes.map(|v| frame.vector_to_local(v)))
    }

    /// The shape of a parallelepiped with those edges, in local coordinates.
    pub(super) fn of_edges(axes: [DVec3; 3]) -> Self {
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
            axes[0] * side(0) + axes[1] * side(1) + axes[2] * side(2)
        });
        let mut heights: Vec<f64> = corners.iter().map(|c| c.z).collect();
        heights.sort_by(f64::total_cmp);
        let extent = heights[7] - heights[0];
        heights.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * extent);
        let slabs = heights
            .windows(2)
            .map(|w| {
                let z = 0.5 * (w[0] + w[1]);
                let mut edges: Vec<([usize; 2], DVec2)> = EDGES
                    .iter()
                    .filter(|e| (corners[e[0]].z < z) != (corners[e[1]].z < z))
                    .map(|&e| (e, on_edge(&corners, e, z)))
                    .collect();
                #[allow(clippy::cast_precision_loss, reason = "at most six")]
                let middle = edges.iter().map(|e| e.1).sum::<DVec2>() / edges.len() as f64;
                edges.sort_by(|a, b| {
                    (a.1 - middle)
                        .to_angle()
                        .total_cmp(&(b.1 - middle).to_angle())
                });
                edges.into_iter().map(|e| e.0).collect()
            })
            .collect();
        let slabs: Vec<Vec<[usize; 2]>> = slabs;
        let sides = slabs.iter().map(|edges| sides(&corners, edges)).collect();
        let volume = axes[0].cross(axes[1]).dot(axes[2]).abs();
        let upright = heights.len() == 2;
        Self {
            corners,
            heights,
            slabs,
            sides,
            upright,
            volume,
        }
    }

    /// Half the diagonal, in local lengths.
    pub(crate) fn half_diagonal(&self) -> f64 {
        self.corners.iter().fold(0.0, |m, c| m.max(c.length()))
    }

    /// The cross-sections of a slab, at a voxel centred on `centre`.
    fn cross_sections(&self, slab: usize, centre: DVec2) -> CrossSections {
        let corner = |&[i, j]: &[usize; 2]| {
            let (a, b) = (self.corners[i], self.corners[j]);
            let slope = DVec2::new(b.x - a.x, b.y - a.y) / (b.z - a.z);
            Corner {
                at: centre + DVec2::new(a.x, a.y) - slope * a.z,
                slope,
            }
        };
        let corners = self.slabs[slab].iter().map(corner).collect();
        let middle = 0.5 * (self.heights[slab] + self.heights[slab + 1]);
        CrossSections::new(corners, middle)
    }

    /// The cross-section at height `z` within a slab, at a voxel centred on `centre`.
    fn polygon(&self, slab: usize, z: f64, centre: DVec2) -> Polygon {
        self.slabs[slab]
            .iter()
            .map(|&e| on_edge(&self.corners, e, z) + centre)
            .collect()
    }
}

/// The planes through neighbouring edges of a cross-section.
fn sides(corners: &[DVec3; 8], edges: &[[usize; 2]]) -> Vec<HalfSpace> {
    let next = |i: usize| edges[if i + 1 == edges.len() { 0 } else { i + 1 }];
    let pairs = edges.iter().enumerate().map(|(i, &e)| (e, next(i)));
    let plane = |([a, b], [c, d]): ([usize; 2], [usize; 2])| {
        let start = corners[a];
        // Edges of one side may share a corner.
        let across = if c == a || c == b { d } else { c };
        let normal = (corners[b] - start).cross(corners[across] - start);
        let normal = normal.normalize_or_zero();
        let offset = normal.dot(start);
        HalfSpace { normal, offset }
    };
    pairs.map(plane).collect()
}

fn on_edge(corners: &[DVec3; 8], [i, j]: [usize; 2], z: f64) -> DVec2 {
    let (a, b) = (corners[i], corners[j]);
    let s = ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0);
    DVec2::new(a.x + (b.x - a.x) * s, a.y + (b.y - a.y) * s)
}

/// A half-space in a solid's frame, from the voxel's centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clip {
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

impl Clip {
    /// Whether it leaves the same of every height.
    fn is_upright(&self) -> bool {
        self.normal.z.abs() <= 1e-13 * self.normal.length()
    }

    /// What the half-space leaves of a cross-section at height `z` above the voxel's centre.
    fn of(&self, polygon: &Polygon, z: f64, centre: DVec2) -> Polygon {
        let normal = DVec2::new(self.normal.x, self.normal.y);
        let offset = self.offset - self.normal.z * z + normal.dot(centre);
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

/// A line of a cross-section that moves evenly with its height: `normal · x + tilt h = offset`, x from the axis and h
/// from the voxel's centre.
#[derive(Debug, Clone, Copy)]
struct SectionLine {
    normal: DVec2,
    tilt: f64,
    offset: f64,
    /// Whether it is in a side of the voxel.
    is_side: bool,
}

type Lines = SmallVec<[SectionLine; 12]>;

/// How many of the lines are in sides of the voxel.
fn sides_of(lines: &Lines) -> usize {
    lines.iter().filter(|l| l.is_side).count()
}

/// Where two lines meet: at `at + slope h`.
struct Vertex {
    at: DVec2,
    slope: DVec2,
}

impl SectionLine {
    /// Where two lines meet; `None` where they are parallel.
    fn vertex(&self, other: &Self) -> Option<Vertex> {
        let (a, b) = (self.normal, other.normal);
        let det = a.perp_dot(b);
        if det.abs() <= 1e-12 * a.length() * b.length() {
            return None;
        }
        let at = |own: f64, others: f64| (b.perp() * -own + a.perp() * others) / det;
        Some(Vertex {
            at: at(self.offset, other.offset),
            slope: at(-self.tilt, -other.tilt),
        })
    }
}

impl Vertex {
    /// The height at which it passes a line; `None` where it runs along it.
    fn height_on(&self, line: &SectionLine) -> Option<f64> {
        let rate = line.normal.dot(self.slope) + line.tilt;
        let height = (line.offset - line.normal.dot(self.at)) / rate;
        height.is_finite().then_some(height)
    }
}

/// One voxel in a solid's frame.
struct Cell<'a> {
    shape: &'a CellShape,
    /// Centre, across the axis and along it.
    flat: DVec2,
    z: f64,
    turn: &'a Turn,
    reach: Reach,
    clips: SmallVec<[Clip; 4]>,
    /// Error allowed to one stretch of a piece, in local volume.
    tolerance: f64,
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
    ) -> f64 {
        let local = self.frame().to_local(centre).point;
        let clips = spaces.iter().map(|s| self.clip(s));
        self.local_fraction(shape, local, clips.collect(), tolerance)
    }

    /// The same in local coordinates.
    pub(super) fn local_fraction(
        &self,
        shape: &CellShape,
        c: DVec3,
        clips: SmallVec<[Clip; 4]>,
        tolerance: f64,
    ) -> f64 {
        let flat = DVec2::new(c.x, c.y);
        let mut reach = Reach::Whole;
        if let Turn::Partial(wedge) = self.turn() {
            let half = shape.half_diagonal();
            if wedge
                .directions()
                .iter()
                .all(|d| d.perp_dot(flat).abs() > half)
            {
                if wedge.contains(flat, 0.0) == Some(false) {
                    return 0.0;
                }
            } else {
                reach = Reach::Cut;
            }
        }
        let cell = Cell {
            shape,
            flat,
            z: c.z,
            turn: self.turn(),
            reach,
            clips,
            tolerance: tolerance * shape.volume,
        };
        let volume: f64 = (0..shape.slabs.len())
            .map(|slab| self.slab_volume(&cell, slab))
            .sum();
        let share = volume / shape.volume;
        if share < SNAP {
            0.0
        } else if share > 1.0 - SNAP {
            1.0
        } else {
            share
        }
    }

    /// A half-space in the solid's frame and unit.
    fn clip(&self, space: &HalfSpace) -> Clip {
        let scale = self.frame().scale();
        // The frame turns and scales: a normal goes as a vector does, but for the length.
        Clip {
            normal: self.frame().vector_to_local(space.normal) * scale,
            offset: space.offset / scale,
        }
    }

    /// The volume between two heights of corners, in parts within which the half-spaces meet the
    /// same edges.
    fn slab_volume(&self, cell: &Cell, slab: usize) -> f64 {
        if !cell.shape.upright && cell.reach == Reach::Whole && cell.clips.is_empty() {
            return self.whole_slab_volume(cell, slab);
        }
        let mut heights = cell.meetings(slab);
        heights.extend([cell.shape.heights[slab], cell.shape.heights[slab + 1]]);
        heights.sort_by(f64::total_cmp);
        let parts = heights.windows(2).filter(|h| h[0] < h[1]);
        parts.map(|h| self.part_volume(cell, slab, h)).sum()
    }

    /// The same of a slab that nothing is cut off.
    fn whole_slab_volume(&self, cell: &Cell, slab: usize) -> f64 {
        let (shape, z) = (cell.shape, cell.z);
        let (bottom, top) = (shape.heights[slab], shape.heights[slab + 1]);
        let sections = shape.cross_sections(slab, cell.flat);
        let reach = sections.corners.iter().map(|c| c.radii([bottom, top])[1]);
        // A hair more, for the rounding.
        let far = reach.fold(0.0, f64::max) * (1.0 + 1e-12);
        let near = (cell.flat.length() - shape.half_diagonal()).max(0.0) * (1.0 - 1e-12);
        let mut volume = 0.0;
        self.boundary_near(z + bottom, z + top, near, |part| {
            let piece = part.piece;
            let sign = f64::from(part.disc_sign());
            if sign == 0.0 || piece.on_axis {
                return;
            }
            let low = piece.bounds().min[1].max(z + bottom);
            let high = piece.bounds().max[1].min(z + top);
            if low >= high {
                return;
            }
            let between = [low - z, high - z];
            let mut stretch = None;
            let mut radii = [piece.bounds().min[0], piece.bounds().max[0]];
            if radii[0] < far {
                let found = Stretch::new(part, low, high);
                let ends = [found.from, found.to].map(|t| found.point(t)[0]);
                radii = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                stretch = Some(found);
            }
            volume += sign
                * match stretch {
                    _ if radii[1] <= near => 0.0,
                    Some(stretch) if radii[0] < far => {
                        let cuts = stretch.at_sections(&sections, between, radii, z);
                        stretch.sections_volume(&cuts, cell.tolerance, |r, height| {
                            sections.within_disc(height - z, r)
                        })
                    }
                    // Beyond the slab the disc takes the whole of it.
                    _ => sections.volume(between),
                };
        });
        volume
    }

    fn part_volume(&self, cell: &Cell, slab: usize, heights: &[f64]) -> f64 {
        let (shape, z) = (cell.shape, cell.z);
        let (bottom, top) = (heights[0], heights[1]);
        let fixed = (shape.upright && cell.clips.iter().all(Clip::is_upright))
            .then(|| cell.sections(slab, z + 0.5 * (bottom + top)));
        let half = shape.half_diagonal();
        let (near, far) = (
            (cell.flat.length() - half).max(0.0),
            cell.flat.length() + half,
        );
        let radii = fixed.as_ref().map(critical_radii);
        let lines = match fixed {
            Some(_) => Lines::new(),
            None => cell.lines(slab),
        };
        let mut volume = 0.0;
        self.boundary_near(z + bottom, z + top, near, |part| {
            let piece = part.piece;
            let sign = f64::from(part.disc_sign());
            if sign == 0.0 || piece.on_axis {
                return;
            }
            let low = piece.bounds().min[1].max(z + bottom);
            let high = piece.bounds().max[1].min(z + top);
            if low >= high {
                return;
            }
            // Beyond the voxel the disc takes the whole polygon.
            let beyond = piece.bounds().min[0] >= far;
            let area = |r: f64, height: f64| match &fixed {
                Some(sections) => disc_area(sections, r),
                None => disc_area(&cell.sections(slab, height), r),
            };
            volume += sign
                * match (beyond, &radii) {
                    (true, Some(_)) => (high - low) * area(2.0 * far, low),
                    // The polygon's area is quadratic in z: one panel is exact.
                    (true, None) if cell.clips.len() < 2 => {
                        quadrature::panel(&mut |h| area(2.0 * far, h), low, high).value
                    }
                    (true, None) => {
                        let whole = |h: f64| area(2.0 * far, h);
                        quadrature::integrate(whole, low, high, cell.tolerance, 256).value
                    }
                    (false, Some(radii)) => {
                        let stretch = Stretch::new(part, low, high);
                        stretch.volume(&stretch.at_radii(radii), cell.tolerance, &area)
                    }
                    (false, None) => {
                        let stretch = Stretch::new(part, low, high);
                        stretch.volume(&stretch.at_lines(&lines, cell.z), cell.tolerance, &area)
                    }
                };
        });
        volume
    }
}

impl Cell<'_> {
    /// The lines that may bound the cross-sections of a slab; neighbouring sides of the voxel first.
    fn lines(&self, slab: usize) -> Lines {
        let from_axis = |space: &HalfSpace| {
            let normal = DVec2::new(space.normal.x, space.normal.y);
            SectionLine {
                normal,
                tilt: space.normal.z,
                offset: space.offset + normal.dot(self.flat),
                is_side: false,
            }
        };
        let mut lines = Lines::new();
        for side in &self.shape.sides[slab] {
            let line = from_axis(side);
            lines.push(SectionLine {
                is_side: true,
                ..line
            });
        }
        lines.extend(self.clips.iter().map(|c| {
            from_axis(&HalfSpace {
                normal: c.normal,
                offset: c.offset,
            })
        }));
        if let (Turn::Partial(wedge), Reach::Cut) = (self.turn, self.reach) {
            lines.extend(wedge.directions().iter().map(|d| SectionLine {
                normal: d.perp(),
                tilt: 0.0,
                offset: 0.0,
                is_side: false,
            }));
        }
        lines
    }

    /// Heights, within a slab and from the centre, at which three of the lines meet. Sides of the voxel alone meet at
    /// its corners, between the slabs.
    fn meetings(&self, slab: usize) -> Vec<f64> {
        let (low, high) = (self.shape.heights[slab], self.shape.heights[slab + 1]);
        let mut heights = Vec::new();
        if self.shape.upright && self.clips.iter().all(Clip::is_upright) {
            return heights;
        }
        let lines = self.lines(slab);
        for (i, a) in lines.iter().enumerate().filter(|l| !l.1.is_side) {
            // Among those that are no sides, each three once.
            let others = lines.iter().enumerate();
            let others = others.filter(|(k, l)| l.is_side || *k < i);
            let others: SmallVec<[&SectionLine; 12]> = others.map(|o| o.1).collect();
            for (k, b) in others.iter().enumerate() {
                for c in &others[..k] {
                    let height = b.vertex(c).and_then(|v| v.height_on(a));
                    heights.extend(height.filter(|h| *h > low && *h < high));
                }
            }
        }
        heights
    }

    /// The cross-section at height `h`, within the turn and the half-spaces.
    fn sections(&self, slab: usize, h: f64) -> Sections {
        let z = h - self.z;
        let mut polygon = self.shape.polygon(slab, z, self.flat);
        for clip in &self.clips {
            polygon = clip.of(&polygon, z, self.flat);
        }
        within_turn(polygon, self.turn, self.reach)
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
    part: BoundaryPiece<'a>,
    from: f64,
    to: f64,
}

pub(super) type Cuts = SmallVec<[f64; 16]>;
/// Parameters with whether the circle touches a side there.
type KindCuts = SmallVec<[(f64, bool); 16]>;

impl<'a> Stretch<'a> {
    fn new(part: BoundaryPiece<'a>, low: f64, high: f64) -> Self {
        let (a, b) = (
            parameter(part.piece, 1, low),
            parameter(part.piece, 1, high),
        );
        let (from, to) = if part.piece.direction() > 0 {
            (a, b)
        } else {
            (b, a)
        };
        Self { part, from, to }
    }

    /// The radius and height at a parameter.
    fn point(&self, t: f64) -> [f64; 2] {
        let piece = self.part.piece;
        if piece.degree() == 1 {
            // As its rows would, which are not made for this.
            let (start, end) = (piece.start().map(Real::f64), piece.end().map(Real::f64));
            return [0, 1].map(|c| start[c] + (end[c] - start[c]) * t);
        }
        let twin = piece.twin();
        let p = twin.at(t);
        [p[0] + twin.origin[0], p[1] + twin.origin[1]]
    }

    /// Parameters at which the radius takes one of the values.
    fn at_radii(&self, radii: &[f64]) -> Cuts {
        let (a, b) = (self.point(self.from)[0], self.point(self.to)[0]);
        let inner = radii.iter().filter(|&&r| r > a.min(b) && r < a.max(b));
        inner.map(|&r| parameter(self.part.piece, 0, r)).collect()
    }

    /// Parameters at which the circle touches one of the lines or passes a point in which two meet; `z` is the height of
    /// the voxel's centre.
    fn at_lines(&self, lines: &Lines, z: f64) -> Cuts {
        let twin = self.part.piece.twin();
        let ([r, h, w], origin) = (twin.rows(), twin.origin);
        let plus = |a: &[f64], b: &[f64], times: f64| -> Coefficients<f64> {
            a.iter().zip(b).map(|(a, b)| a + times * b).collect()
        };
        // Numerators of the radius and of the height above the voxel's centre.
        let (r, h) = (plus(&r, &w, origin[0]), plus(&h, &w, origin[1] - z));
        let mut cuts = Cuts::new();
        let mut zeros = |numerator: &[f64]| {
            let part = bernstein::restrict(numerator, self.from, self.to);
            sign_changes(&part, self.from, self.to, 0, &mut cuts);
        };
        let even = |constant: f64, slope: f64| -> Coefficients<f64> {
            (w.iter().zip(&h))
                .map(|(w, h)| constant * w + slope * h)
                .collect()
        };
        for (i, a) in lines.iter().enumerate() {
            let length = a.normal.length();
            let off = even(a.offset, -a.tilt);
            zeros(&plus(&off, &r, length));
            zeros(&plus(&off, &r, -length));
            for (k, b) in lines[..i].iter().enumerate() {
                // Sides that are no neighbours meet beyond the voxel.
                let apart =
                    a.is_side && b.is_side && k + 1 != i && !(k == 0 && i + 1 == sides_of(lines));
                if apart {
                    continue;
                }
                let Some(vertex) = a.vertex(b) else {
                    continue;
                };
                let [x, y] = [0, 1].map(|c| even(vertex.at[c], vertex.slope[c]));
                let squares = [&x, &y, &r].map(|c| bernstein::product(c, c));
                let sum = bernstein::sum(&squares[0], &squares[1]);
                zeros(&bernstein::difference(&sum, &squares[2]));
            }
        }
        cuts
    }

    /// Parameters at which the circle touches a side of the sections (true) or passes a corner (false), between two
    /// heights from the voxel's centre, which is at `z`; the stretch's radii bound where that may be.
    fn at_sections(
        &self,
        sections: &CrossSections,
        heights: [f64; 2],
        radii: [f64; 2],
        z: f64,
    ) -> KindCuts {
        let room = 1e-12 * (radii[1] + 1.0);
        let meets = |[least, most]: [f64; 2]| most >= radii[0] - room && least <= radii[1] + room;
        let twin = self.part.piece.twin();
        let ([r, h, w], origin) = (twin.rows(), twin.origin);
        let plus = |a: &[f64], b: &[f64], times: f64| -> Coefficients<f64> {
            a.iter().zip(b).map(|(a, b)| a + times * b).collect()
        };
        let (r, h) = (plus(&r, &w, origin[0]), plus(&h, &w, origin[1] - z));
        let [r, h, w] = [&*r, &*h, &*w].map(|c| bernstein::restrict(c, self.from, self.to));
        let even = |constant: f64, slope: f64| -> Coefficients<f64> {
            (w.iter().zip(&h))
                .map(|(w, h)| constant * w + slope * h)
                .collect()
        };
        let mut cuts = KindCuts::new();
        let mut zeros = |part: &[f64], touches: bool| {
            let mut found = Cuts::new();
            sign_changes(part, self.from, self.to, 0, &mut found);
            cuts.extend(found.into_iter().map(|t| (t, touches)));
        };
        for (line, distances) in sections.lines().zip(sections.distances(heights)) {
            if meets(distances) {
                let off = even(line[0], line[1]);
                zeros(&plus(&off, &r, 1.0), true);
                zeros(&plus(&off, &r, -1.0), true);
            }
        }
        let mut square = None;
        for corner in &sections.corners {
            if meets(corner.radii(heights)) {
                let square = square.get_or_insert_with(|| bernstein::product(&r, &r));
                let [x, y] = [0, 1].map(|c| even(corner.at[c], corner.slope[c]));
                let [x, y] = [&x, &y].map(|c| bernstein::product(c, c));
                let sum = bernstein::sum(&x, &y);
                zeros(&bernstein::difference(&sum, square), false);
            }
        }
        cuts
    }

    /// ∫ area(r(z), z) |dz|, cut at the given parameters. Where the circle touches a side the area goes as the power
    /// 3/2 of the parameter, which a substitution makes smooth; elsewhere few points will do.
    fn sections_volume(
        &self,
        cuts: &KindCuts,
        tolerance: f64,
        area: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let mut ends: KindCuts = cuts
            .iter()
            .copied()
            .filter(|&(t, _)| t > self.from && t < self.to)
            .collect();
        ends.push((self.from, false));
        ends.push((self.to, false));
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let integrand = self.integrand(area);
        let panels = ends.windows(2).filter(|c| c[1].0 > c[0].0);
        let volumes = panels.map(|c| {
            let (from, width) = (c[0].0, c[1].0 - c[0].0);
            if c[0].1 || c[1].1 {
                let smooth = |u: f64| {
                    let at = from + width * u * u * (3.0 - 2.0 * u);
                    integrand(at) * width * 6.0 * u * (1.0 - u)
                };
                return quadrature::integrate(smooth, 0.0, 1.0, tolerance, 256).value;
            }
            let quick = quadrature::short_panel(&mut |t| integrand(t), from, c[1].0);
            if quick.error <= tolerance {
                return quick.value;
            }
            quadrature::integrate(&integrand, from, c[1].0, tolerance, 256).value
        });
        volumes.sum()
    }

    /// area(r(t), z(t)) |z'(t)|.
    fn integrand<'s>(&'s self, area: impl Fn(f64, f64) -> f64 + 's) -> impl Fn(f64) -> f64 + 's {
        let piece = self.part.piece;
        let twin = piece.twin();
        let ([r, z, w], origin) = (twin.rows(), twin.origin);
        let linear = piece.degree() == 1;
        let (start, end) = (piece.start().map(Real::f64), piece.end().map(Real::f64));
        move |t: f64| {
            if linear {
                let dz = end[1] - start[1];
                return area(start[0] + (end[0] - start[0]) * t, start[1] + dz * t) * dz.abs();
            }
            let r = bernstein::evaluate(&r, t);
            let (z, dz) = bernstein::evaluate_with_derivative(&z, t);
            let (w, dw) = bernstein::evaluate_with_derivative(&w, t);
            area(r / w + origin[0], z / w + origin[1]) * ((dz * w - z * dw) / (w * w)).abs()
        }
    }

    /// ∫ area(r(z), z) |dz|, cut at the given parameters.
    fn volume(&self, cuts: &[f64], tolerance: f64, area: &impl Fn(f64, f64) -> f64) -> f64 {
        let mut ends: Cuts = cuts
            .iter()
            .copied()
            .filter(|&t| t > self.from && t < self.to)
            .collect();
        ends.push(self.from);
        ends.push(self.to);
        ends.sort_by(f64::total_cmp);
        let integrand = self.integrand(area);
        ends.windows(2)
            .filter(|c| c[1] > c[0])
            .map(|c| {
                let width = c[1] - c[0];
                let smooth = |u: f64| {
                    integrand(c[0] + width * u * u * (3.0 - 2.0 * u)) * width * 6.0 * u * (1.0 - u)
                };
                quadrature::integrate(smooth, 0.0, 1.0, tolerance, 256).value
            })
            .sum()
    }
}

/// Adds the parameters between `from` and `to` at which a polynomial with these coefficients there changes its sign;
/// where two may be too near to each other to be told apart, a place between.
pub(super) fn sign_changes(c: &[f64], from: f64, to: f64, depth: u32, cuts: &mut Cuts) {
    /// Zeros nearer to each other than 2^-30 of the stretch bound no panel worth cutting.
    const DEPTH: u32 = 30;
    let signs = c.iter().filter(|v| **v != 0.0).map(|v| *v > 0.0);
    let mut last = None;
    let changes = signs
        .filter(|sign| last.replace(*sign).is_some_and(|l| l != *sign))
        .count();
    if changes == 0 {
        return;
    }
    let middle = 0.5 * (from + to);
    let (first, end) = (c[0], c[c.len() - 1]);
    if changes == 1 && first * end < 0.0 {
        let at = illinois(&|t| bernstein::evaluate(c, t), 0.0, 1.0, first, end);
        cuts.push(from + (to - from) * at);
    } else if depth == DEPTH {
        cuts.push(middle);
    } else {
        let (below, above) = bernstein::split(c, 0.5);
        sign_changes(&below, from, middle, depth + 1, cuts);
        if above[0] == 0.0 {
            cuts.push(middle);
        }
        sign_changes(&above, middle, to, depth + 1, cuts);
    }
}

/// The parameter at which coordinate `c` of a piece takes the value `v`, clamped to the piece.
pub(super) fn parameter(piece: &Piece, c: usize, v: f64) -> f64 {
    let (start, end) = (piece.start()[c].f64(), piece.end()[c].f64());
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
    let target = v - piece.twin().origin[c];
    let off = |t: f64| piece.twin().at(t)[c] - target;
    illinois(&off, 0.0, 1.0, off(0.0), off(1.0))
}

/// The root of `f` between `a` and `b`: the secant, halving the value at the end it keeps. Where the
/// values at the ends do not differ in sign, the root is within rounding of the end nearer to it.
pub(super) fn illinois(f: &impl Fn(f64) -> f64, a: f64, b: f64, f_a: f64, f_b: f64) -> f64 {
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
