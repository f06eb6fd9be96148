//! Cut cells of one turned body, whatever its axis, by the circles that its profile sweeps.
//!
//! All is a flux through the body's surface. With n its outward unit normal, q_a the place along axis a from the cell's
//! centre, h_a half the cell's side, and the integrals over the surface whose two other places are within the cell:
//!
//! ```text
//!   the solid in the upper side across a     ∬ n_a dA                        over q_a > h_a
//!   the solid in the lower side              ∬ n_a dA                        over q_a > -h_a
//!   the solid in the cell                    ∬ L n_a dA                      L = min(q_a, h_a) + h_a, from 0 up
//!   its first moments                        ∬ ½ (min(q_a, h_a)² - h_a²) n_a dA, ∬ q_b L n_a dA
//!   the boundary in the cell                 ∬ 1, q, n dA                    over |q_a| <= h_a, too
//! ```
//!
//! A point of the profile at (r, z) sweeps a circle, of which each pair of the cell's sides leaves arcs. Over these the
//! integrands are polynomials of cosine and sine; the integral along the profile is cut where an arc begins, ends or passes
//! a side of the cell, between which it is analytic but for square roots at the cuts, which a substitution takes away:
//!
//! * where a circle touches a side's plane, the profile meets the line `e_z z ± |e_xy| r = const`;
//! * where a circle passes an edge of the cell, the profile meets a hyperbola ([`parameters`]);
//! * where an end of a partial turn meets a side's plane, the profile meets a line.
//!
//! The caps of a partial turn are planar: the same integrals over the region of the half-plane, row by row along r.
//!
//! * Surface in a side of the cell is the cell's that the solid is in; the sides' shares are those of the interior. Bent
//!   surface that comes no further beyond a side than membership is sure, `8 ε (size + |p|)`, touches it.
//! * Error: Gauss-Kronrod's estimates, with the spread of the three volumes, one for each axis, and the closure of the
//!   boundary's normals.

use super::crossed::{CutCell, parameters};
use super::fraction::{parameter, sign_changes};
use super::revolved::Revolved;
use super::turn::{Turn, Wedge};
use crate::math::Real;
use crate::math::bernstein::Coefficients;
use crate::math::quadrature::{graded, panel_of};
use crate::region::BoundaryPiece;
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// What is summed: the lower sides, the upper ones, the volume by each axis, its first moments; the boundary's area, first
/// moments and normals.
const SUMS: usize = 19;
/// Panels of one piece: more are not halved.
const MOST_PANELS: usize = 400;
/// How often a panel is halved.
const DEPTH: u32 = 30;
/// Parameters nearer to each other than this are one.
const NARROW: f64 = 1e-13;
/// Cosines of axes below this are 0.
const NORMAL: f64 = 1e-14;

/// Nodes and weights on [0, 1].
static NODES: LazyLock<[Vec<(f64, f64)>; 3]> = LazyLock::new(|| {
    [2, 5, 10].map(|n| {
        let nodes = crate::math::gauss::nodes(n).into_iter();
        nodes.map(|(x, w)| (x.f64(), w.f64())).collect()
    })
});

type Sums = [f64; SUMS];

/// The cell as the body sees it: local lengths, `x = centre + Σ q_i axes_i`.
struct Cell {
    centre: DVec3,
    axes: [DVec3; 3],
    half: [f64; 3],
    /// Flat surface nearer to a side than this is in it.
    tiny: f64,
    /// Other surface no further beyond a side than this touches it, as the solid is not told from one so near.
    touch: f64,
    /// 1, or -1 where the solid is what the body leaves.
    sign: f64,
}

/// One axis of the cell along a circle: `q = radius cos(φ - turn) + height`.
#[derive(Clone, Copy)]
struct Along {
    radius: f64,
    turn: f64,
    height: f64,
}

/// A piece of surface that is small enough to be a point: the places, the normal and the area by it.
struct Element {
    q: [f64; 3],
    n: [f64; 3],
    weight: f64,
}

impl Cell {
    fn new(body: &Revolved, complement: bool, centre: DVec3, sides: DVec3) -> Self {
        let frame = body.frame();
        let columns = DVec3::AXES.map(|e| frame.vector_to_local(e * sides));
        let centre = frame.to_local(centre).point;
        let half = columns.map(|m| 0.5 * m.length());
        let far = centre.abs().max_element();
        let size = body.bounds().longest_side() / frame.scale();
        let least = half.iter().fold(f64::INFINITY, |m, h| m.min(*h));
        Self {
            centre,
            axes: columns.map(DVec3::normalize),
            half,
            tiny: (1e-12 * least).max(64.0 * f64::EPSILON * far),
            touch: 8.0 * f64::EPSILON * (size + far),
            sign: if complement { -1.0 } else { 1.0 },
        }
    }

    /// `q_i` of the axis' point at a height.
    fn height(&self, i: usize, z: f64) -> f64 {
        self.axes[i].z * z - self.axes[i].dot(self.centre)
    }

    /// Below, within or above the cell's sides; of flat surface that is in a side: on that of the solid.
    fn zone(&self, i: usize, q: f64, n: f64, is_flat: bool) -> i32 {
        let h = self.half[i];
        // Surface that only touches a side is in it along a line.
        let in_side = |side: f64| is_flat && (q - side).abs() <= self.tiny;
        if in_side(h) {
            i32::from(n < 0.0)
        } else if in_side(-h) {
            -i32::from(n > 0.0)
        } else {
            i32::from(q > h + self.touch) - i32::from(q < -h - self.touch)
        }
    }

    /// Adds a part of the surface that lies in these zones.
    fn add(&self, zones: [i32; 3], e: &Element, sums: &mut Sums) {
        let Element { q, n, weight } = e;
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            if zones[a] < 0 || zones[b] != 0 || zones[c] != 0 {
                continue;
            }
            let (h, flux) = (self.half[a], n[a] * weight);
            let is_beyond = zones[a] > 0;
            let (length, square) = if is_beyond {
                sums[3 + a] += flux;
                (2.0 * h, 0.0)
            } else {
                (q[a] + h, 0.5 * (q[a] * q[a] - h * h))
            };
            sums[a] += flux;
            sums[6 + a] += length * flux;
            if a == 0 {
                sums[9] += square * flux;
                sums[10] += q[1] * length * flux;
                sums[11] += q[2] * length * flux;
            }
        }
        if zones == [0; 3] {
            sums[12] += weight;
            for i in 0..3 {
                sums[13 + i] += q[i] * weight;
                sums[16 + i] += n[i] * weight;
            }
        }
    }

    fn counts(zones: [i32; 3]) -> bool {
        zones.iter().filter(|z| **z == 0).count() >= 2 && !zones.iter().any(|z| *z < 0)
    }

    /// The sums as shares of the cell and its sides: all errors are by one measure then.
    fn shares(&self, mut sums: Sums) -> Sums {
        let [x, y, z] = self.half.map(|h| 2.0 * h);
        let (faces, volume) = ([y * z, z * x, x * y], x * y * z);
        let largest = faces[0].max(faces[1]).max(faces[2]);
        for i in 0..3 {
            sums[i] /= faces[i];
            sums[3 + i] /= faces[i];
            sums[6 + i] /= volume;
            sums[9 + i] /= volume * 2.0 * self.half[i];
            sums[13 + i] /= largest * 2.0 * self.half[i];
            sums[16 + i] /= largest;
        }
        sums[12] /= largest;
        sums
    }
}

/// A point of the profile and the derivative there, by whatever is integrated along it.
#[derive(Clone, Copy)]
struct Place {
    r: f64,
    z: f64,
    dr: f64,
    dz: f64,
}

/// A turned body's surface in a cell.
struct Surface<'a> {
    cell: Cell,
    wedge: Option<&'a Wedge>,
}

impl Surface<'_> {
    /// What the circle at a place of the profile adds; `out` is 1 where outward is right of the profile's way, else -1.
    fn circle(&self, at: Place, out: f64, is_flat: bool, sums: &mut Sums) {
        let cell = &self.cell;
        let Place { r, z, dr, dz } = at;
        let out = out * cell.sign;
        let along = [0, 1, 2].map(|i| {
            let e = cell.axes[i];
            let across = e.x.hypot(e.y);
            Along {
                radius: if across > NORMAL { r * across } else { 0.0 },
                turn: e.y.atan2(e.x),
                height: cell.height(i, z),
            }
        });
        let speed = dr.hypot(dz);
        if !(speed > 0.0 && r > 0.0) {
            return;
        }
        let element = |phi: f64, weight: f64| {
            let mut e = Element {
                q: [0.0; 3],
                n: [0.0; 3],
                weight,
            };
            let (sin, cos) = phi.sin_cos();
            for i in 0..3 {
                let axis = cell.axes[i];
                let flat = axis.x * cos + axis.y * sin;
                e.q[i] = flat * r + along[i].height;
                e.n[i] = out * (dz * flat - dr * axis.z) / speed;
            }
            e
        };
        let [from, sweep] = match self.wedge {
            None => [0.0, TAU],
            Some(wedge) => [wedge.from().to_radians(), wedge.degrees().to_radians()],
        };
        let mut ends: SmallVec<[f64; 16]> = SmallVec::new();
        for (i, one) in along.iter().enumerate() {
            for side in [-cell.half[i], cell.half[i]] {
                let cosine = (side - one.height) / one.radius;
                if cosine.abs() < 1.0 {
                    let off = cosine.acos();
                    for end in [one.turn - off, one.turn + off] {
                        let past = (end - from).rem_euclid(TAU);
                        if past < sweep {
                            ends.push(past);
                        }
                    }
                }
            }
        }
        ends.push(0.0);
        ends.push(sweep);
        ends.sort_unstable_by(f64::total_cmp);
        for pair in ends.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            if !(b > a) {
                continue;
            }
            let middle = element(from + 0.5 * (a + b), 1.0);
            let zone = |i: usize| {
                let is_flat = is_flat && along[i].radius == 0.0;
                cell.zone(i, middle.q[i], middle.n[i], is_flat)
            };
            let zones = [0, 1, 2].map(zone);
            if Cell::counts(zones) {
                self.arc([from + a, from + b], zones, r * speed, &element, sums);
            }
        }
    }

    /// Adds an arc in these zones, a radian at a time.
    fn arc(
        &self,
        [a, b]: [f64; 2],
        zones: [i32; 3],
        weight: f64,
        element: &impl Fn(f64, f64) -> Element,
        sums: &mut Sums,
    ) {
        let nodes = &NODES[if b - a < 0.2 { 1 } else { 2 }];
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 7 radians"
        )]
        let parts = (b - a).ceil().max(1.0) as u32;
        let step = (b - a) / f64::from(parts);
        for part in 0..parts {
            let start = a + step * f64::from(part);
            for (x, w) in nodes {
                let one = element(start + step * x, w * step * weight);
                self.cell.add(zones, &one, sums);
            }
        }
    }

    /// What the rows of a cap add between the axis and a place of the profile, `times` the height's derivative.
    fn row_of_cap(&self, cap: &Cap, at: Place, times: f64, sums: &mut Sums) {
        let cell = &self.cell;
        let heights = [0, 1, 2].map(|i| cell.height(i, at.z));
        let mut ends: SmallVec<[f64; 8]> = SmallVec::new();
        for i in 0..3 {
            if cap.slope[i].abs() <= NORMAL {
                continue;
            }
            for side in [-cell.half[i], cell.half[i]] {
                let r = (side - heights[i]) / cap.slope[i];
                if r > 0.0 && r < at.r {
                    ends.push(r);
                }
            }
        }
        ends.push(0.0);
        ends.push(at.r);
        ends.sort_unstable_by(f64::total_cmp);
        let place = |i: usize, r: f64| cap.slope[i] * r + heights[i];
        for pair in ends.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let middle = 0.5 * (a + b);
            let zone = |i: usize| {
                let is_flat = cap.normal[i].abs() >= 1.0 - NORMAL;
                cell.zone(i, place(i, middle), cap.normal[i], is_flat)
            };
            let zones = [0, 1, 2].map(zone);
            if !(b > a && Cell::counts(zones)) {
                continue;
            }
            for (x, w) in &NODES[0] {
                let r = a + (b - a) * x;
                let one = Element {
                    q: [0, 1, 2].map(|i| place(i, r)),
                    n: cap.normal,
                    weight: w * (b - a) * times,
                };
                cell.add(zones, &one, sums);
            }
        }
    }
}

/// A flat end of a partial turn.
struct Cap {
    /// Of each place by the radius.
    slope: [f64; 3],
    /// Outward.
    normal: [f64; 3],
}

fn caps(cell: &Cell, wedge: Option<&Wedge>) -> SmallVec<[Cap; 2]> {
    let directions = wedge.into_iter().flat_map(Wedge::directions);
    directions
        .zip([-1.0, 1.0])
        .map(|(d, sign)| {
            let outward = DVec3::new(-d.y, d.x, 0.0) * (sign * cell.sign);
            Cap {
                slope: cell.axes.map(|e| e.x * d.x + e.y * d.y),
                normal: cell.axes.map(|e| e.dot(outward)),
            }
        })
        .collect()
}

/// Adds the parameters at which a piece meets the line `a r + b z = c` of the half-plane.
fn meets_line(part: BoundaryPiece, [a, b, c]: [f64; 3], out: &mut SmallVec<[f64; 16]>) {
    let twin = part.piece.twin();
    let [r, z, w] = twin.rows();
    let rest = a * twin.origin[0] + b * twin.origin[1] - c;
    let form: Coefficients<f64> = (r.iter().zip(z.iter()).zip(w.iter()))
        .map(|((r, z), w)| a * r + b * z + rest * w)
        .collect();
    sign_changes(&form, 0.0, 1.0, 0, out);
}

/// The parameters of a piece at which what its circles leave in the cell changes.
fn cuts(cell: &Cell, part: BoundaryPiece, caps: &[Cap]) -> SmallVec<[f64; 16]> {
    let mut found: SmallVec<[f64; 16]> = SmallVec::new();
    for i in 0..3 {
        let e = cell.axes[i];
        let across = e.x.hypot(e.y);
        let middle = e.dot(cell.centre);
        for side in [-cell.half[i], cell.half[i]] {
            let level = middle + side;
            meets_line(part, [across, e.z, level], &mut found);
            meets_line(part, [-across, e.z, level], &mut found);
            for cap in caps {
                meets_line(part, [cap.slope[i], e.z, level], &mut found);
            }
        }
        // The edges along this axis.
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        for n in 0..4 {
            let sign = |bit: usize, axis: usize| {
                let side = if n >> bit & 1 == 1 { 1.0 } else { -1.0 };
                cell.axes[axis] * (side * cell.half[axis])
            };
            let o = cell.centre + sign(0, j) + sign(1, k);
            if e.z.abs() <= NORMAL {
                meets_line(part, [0.0, 1.0, o.z], &mut found);
            } else {
                found.extend(parameters(part.piece, o, e));
            }
        }
    }
    found
}

/// The heights at which the order of the cell's sides along a cap changes.
fn levels(cell: &Cell, cap: &Cap) -> SmallVec<[f64; 32]> {
    // Lines slope r + rise z = level, the axis among them.
    let mut lines: SmallVec<[[f64; 3]; 8]> = SmallVec::new();
    lines.push([1.0, 0.0, 0.0]);
    for i in 0..3 {
        let (rise, middle) = (cell.axes[i].z, cell.axes[i].dot(cell.centre));
        for side in [-cell.half[i], cell.half[i]] {
            lines.push([cap.slope[i], rise, middle + side]);
        }
    }
    let mut found = SmallVec::new();
    for (n, [a, b, c]) in lines.iter().enumerate() {
        for [d, e, f] in &lines[..n] {
            let z = (c * d - f * a) / (b * d - e * a);
            if z.is_finite() {
                found.push(z);
            }
        }
    }
    found
}

/// The integral along a piece, cut at these parameters, and an estimate of its error.
fn along_piece(
    mut cuts: SmallVec<[f64; 16]>,
    tolerance: f64,
    mut at: impl FnMut(f64) -> Sums,
) -> (Sums, f64) {
    cuts.push(0.0);
    cuts.push(1.0);
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.dedup_by(|b, a| *b - *a <= NARROW);
    let (mut total, mut error) = ([0.0; SUMS], 0.0);
    let mut panels = 0;
    for pair in cuts.windows(2) {
        let mut work: SmallVec<[(f64, f64, u32); 8]> = SmallVec::new();
        work.push((0.0, 1.0, 0));
        while let Some((from, to, depth)) = work.pop() {
            let mut value = |u: f64| {
                let (t, slope) = graded([pair[0], pair[1]], [true, true], u);
                at(t).map(|v| v * slope)
            };
            let found = panel_of(&mut value, from, to);
            panels += 1;
            let worst = found.iter().fold(0.0, |m: f64, i| m.max(i.error));
            if worst <= tolerance || depth >= DEPTH || panels >= MOST_PANELS {
                for (sum, one) in total.iter_mut().zip(&found) {
                    *sum += one.value;
                }
                error += worst;
                continue;
            }
            let middle = 0.5 * (from + to);
            work.push((middle, to, depth + 1));
            work.push((from, middle, depth + 1));
        }
    }
    (total, error)
}

/// All that is asked of a cell that one turned body cuts, or what it leaves of the cell, each to an estimated error of
/// some `tolerance`.
pub(crate) fn cut_cell(
    body: &Revolved,
    complement: bool,
    centre: DVec3,
    sides: DVec3,
    tolerance: f64,
) -> CutCell {
    /// Share of the tolerance that a panel takes: there are some.
    const PANEL: f64 = 0.1;
    let wedge = match body.turn() {
        Turn::Full => None,
        Turn::Partial(wedge) => Some(wedge),
    };
    let cell = Cell::new(body, complement, centre, sides);
    let surface = Surface { cell, wedge };
    let cell = &surface.cell;
    let caps = caps(cell, wedge);
    let levels: SmallVec<[SmallVec<[f64; 32]>; 2]> = caps.iter().map(|c| levels(cell, c)).collect();
    let tolerance = PANEL * tolerance;
    let (mut total, mut error) = ([0.0; SUMS], 0.0);
    for part in body.boundary().iter() {
        if part.piece.on_axis || !surface.may_count(part) {
            continue;
        }
        let twin = part.piece.twin();
        let place = |t: f64| {
            let at = twin.at(t);
            let [dr, dz] = twin.slope(t);
            Place {
                r: (at[0] + twin.origin[0]).max(0.0),
                z: at[1] + twin.origin[1],
                dr,
                dz,
            }
        };
        let out = if part.forward { 1.0 } else { -1.0 };
        let inside = f64::from(part.disc_sign());
        let is_flat = part.piece.is_horizontal();
        let mut marks = cuts(cell, part, &caps);
        if !part.piece.is_horizontal() {
            let ends = [part.piece.start()[1].f64(), part.piece.end()[1].f64()];
            let within = |z: &&f64| **z > ends[0].min(ends[1]) && **z < ends[0].max(ends[1]);
            let all = levels.iter().flatten().filter(within);
            marks.extend(all.map(|z| parameter(part.piece, 1, *z)));
        }
        let (sums, off) = along_piece(marks, tolerance, |t| {
            let at = place(t);
            let mut sums = [0.0; SUMS];
            surface.circle(at, out, is_flat, &mut sums);
            for cap in &caps {
                surface.row_of_cap(cap, at, inside * at.dz.abs(), &mut sums);
            }
            cell.shares(sums)
        });
        for (sum, one) in total.iter_mut().zip(sums) {
            *sum += one;
        }
        error += off;
    }
    made(cell, total, error, body.frame().scale())
}

impl Surface<'_> {
    /// Whether what a piece sweeps, or its part of a cap, may be in the cell or beyond it along one of the axes.
    fn may_count(&self, part: BoundaryPiece) -> bool {
        let cell = &self.cell;
        let ends = [
            part.piece.start().map(Real::f64),
            part.piece.end().map(Real::f64),
        ];
        let r = ends[0][0].max(ends[1][0]);
        // A cap's rows begin at the axis.
        let zones = [0, 1, 2].map(|i| {
            let e = cell.axes[i];
            let reach = r * e.x.hypot(e.y) + cell.tiny;
            let z = ends.map(|p| cell.height(i, p[1]));
            let (low, high) = (z[0].min(z[1]) - reach, z[0].max(z[1]) + reach);
            (low <= cell.half[i], high >= -cell.half[i])
        });
        let within = zones.iter().filter(|z| z.0 && z.1).count();
        within >= 2 && zones.iter().all(|z| z.1)
    }
}

/// The cell of its sums.
fn made(cell: &Cell, shares: Sums, error: f64, scale: f64) -> CutCell {
    let base = if cell.sign < 0.0 { 1.0 } else { 0.0 };
    let s = shares;
    let volumes = [6, 7, 8].map(|n| base + s[n]);
    let sides: [[f64; 2]; 3] = std::array::from_fn(|a| [base + s[a], base + s[3 + a]]);
    let lengths = cell.half.map(|h| 2.0 * h * scale);
    let faces = [0, 1, 2].map(|a| lengths[(a + 1) % 3] * lengths[(a + 2) % 3]);
    let largest = faces[0].max(faces[1]).max(faces[2]);
    let spread = volumes.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v))
        - volumes.iter().fold(f64::INFINITY, |m, v| m.min(*v));
    let far = cell.centre.abs().max_element();
    let least = cell.half.iter().fold(f64::INFINITY, |m, h| m.min(*h));
    let rounding = 32.0 * f64::EPSILON * (1.0 + far / least);
    CutCell {
        volume: volumes[0].clamp(0.0, 1.0),
        first: DVec3::new(s[9], s[10], s[11]),
        sides: sides.map(|pair| pair.map(|v| v.clamp(0.0, 1.0))),
        area: s[12] * largest,
        boundary: DVec3::new(s[13], s[14], s[15]) * largest,
        normal: DVec3::new(s[16], s[17], s[18]) * largest,
        error: error + spread + rounding,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::solid::{Assembly, Body, Crossed, Factor, Term};

    const TOLERANCE: f64 = 1e-11;

    fn assembly(solids: &str) -> Assembly {
        let scene = Scene::parse(&format!("schema = 1\n{solids}")).expect("a scene");
        scene.assembly().clone()
    }

    fn turned(of: &Assembly) -> &Revolved {
        let body = of.single().and_then(Body::turned_region);
        body.expect("one turned body")
    }

    const WALL: &str =
        "profiles.wall.curves = [{ kind = 'polyline', points = [[0.5, 2], [0.5, 0], [1, 0]] },
        { kind = 'bezier', points = [[1, 0], [1.8, 0.7], [0.9, 2]] },
        { kind = 'polyline', points = [[0.9, 2], [0.5, 2]] }]
";

    fn solids() -> Vec<String> {
        let wall =
            |rest: &str| format!("{WALL}solid = [{{ kind = 'revolve', profile = 'wall'{rest} }}]");
        vec![
            "solid = [{ kind = 'torus', major = 3, minor = 1 }]".to_owned(),
            "solid = [{ kind = 'torus', major = 3, minor = 1, axis = { direction = [1, 2, 3] } }]".to_owned(),
            "solid = [{ kind = 'sphere', radius = 2 }]".to_owned(),
            "solid = [{ kind = 'cylinder', radius = 1, height = 2 }]".to_owned(),
            "solid = [{ kind = 'cone', radius1 = 2, radius2 = 0, height = 3, axis = { direction = [0, 1, 1] } }]".to_owned(),
            wall(""),
            wall(", axis = { direction = [1, 0, 0] }"),
            wall(", axis = { direction = [3, 1, 2] }"),
            wall(", angle = 90"),
            wall(", angle = 180, start = 20"),
            wall(", angle = 270, axis = { direction = [1, -2, 3] }"),
            wall(", angle = 100, axis = { direction = [0, 1, 0] }"),
        ]
    }

    /// The same cell by chords along the grid's axes: other surfaces, other cuts, other integrals.
    #[test]
    fn circles_and_chords_agree() {
        for text in solids() {
            let of = assembly(&text);
            let (body, bounds) = (turned(&of), of.bounds());
            let sides = bounds.sides() / 13.0;
            let mut state = 1_u64;
            let (mut compared, mut held) = (0, 0);
            let (mut worst, mut chords) = (0.0_f64, 0.0_f64);
            while held < 6 && compared < 16 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let n = state >> 33;
                let place = [n % 13, n / 13 % 13, n / 169 % 13].map(|n| n as f64 + 0.5);
                let centre = bounds.min + sides * DVec3::from_array(place);
                let inside = body.contains(centre);
                if body.distance(centre, inside, 1.0) > 0.4 * sides.length() {
                    continue;
                }
                compared += 1;
                for complement in [false, true] {
                    let terms = [Term {
                        factors: [Factor {
                            body: 0,
                            complement,
                        }]
                        .into_iter()
                        .collect(),
                    }];
                    let rows = Crossed::new(of.bodies(), &terms, centre, sides).expect("rows");
                    let a = cut_cell(body, complement, centre, sides, TOLERANCE);
                    let b = rows.cut_cell(TOLERANCE);
                    worst = worst.max(a.error);
                    if b.error > 1e-9 {
                        // Rows ran out.
                        continue;
                    }
                    held += 1;
                    chords = chords.max(b.error);
                    // Where a surface touches a side, rows see it to the root of rounding.
                    let touching = a.sides.iter().zip(&b.sides);
                    let touching = touching.flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
                    let touching = touching.fold(0.0, |m: f64, off| m.max(off.abs()));
                    assert!(touching <= 1e-5, "{text}: sides of {centre}: {a:?}\n{b:?}");
                    let within = a.error + b.error + 1e-11 + touching;
                    let face = [sides.y * sides.z, sides.z * sides.x, sides.x * sides.y];
                    let largest = face[0].max(face[1]).max(face[2]);
                    let near = |x: f64, y: f64, times: f64, what: &str| {
                        assert!(
                            (x - y).abs() <= within * times,
                            "{text}: {what} of {centre} ({complement}): {x} {y}\n{a:?}\n{b:?}"
                        );
                    };
                    near(a.volume, b.volume, 1.0, "volume");
                    near(a.area, b.area, 2.0 * largest, "area");
                    for c in 0..3 {
                        near(a.first[c], b.first[c], 1.0, "moment");
                        near(a.sides[c][0], b.sides[c][0], 1.0, "lower side");
                        near(a.sides[c][1], b.sides[c][1], 1.0, "upper side");
                        near(a.boundary[c], b.boundary[c], 2.0 * largest, "boundary");
                        near(a.normal[c], b.normal[c], 2.0 * largest, "normal");
                    }
                }
            }
            eprintln!("{worst:.1e} circles, {chords:.1e} chords, {held} cells: {text}");
            assert!(worst <= 1e-9 && held > 0, "{text}");
        }
    }

    /// Every cell of a grid that holds the solid, its faces in the sides of cells too: what the cells sum to is known by
    /// other means.
    #[test]
    fn cells_sum_to_the_solid() {
        for text in solids() {
            let of = assembly(&text);
            let (body, bounds) = (turned(&of), of.bounds());
            let exact = body.moments();
            for (count, room) in [(1, 0.0), (2, 0.0), (5, 0.3)] {
                let low = bounds.min - room * bounds.sides();
                let sides = (1.0 + 2.0 * room) * bounds.sides() / f64::from(count);
                let whole = sides.element_product();
                let (mut volume, mut area, mut error) = (0.0, 0.0, 0.0_f64);
                let (mut first, mut normal) = (DVec3::ZERO, DVec3::ZERO);
                for n in 0..count * count * count {
                    let place = [n % count, n / count % count, n / count / count];
                    let middle = low + sides * (DVec3::from_array(place.map(f64::from)) + 0.5);
                    let one = cut_cell(body, false, middle, sides, TOLERANCE);
                    error = error.max(one.error);
                    volume += whole * one.volume;
                    first += whole * (middle * one.volume + sides * one.first);
                    area += one.area;
                    normal += one.normal;
                }
                let (v, a) = (exact.volume.value, exact.area.value);
                eprintln!(
                    "{error:.1e}: {:.1e} {:.1e} {text}",
                    volume / v - 1.0,
                    area / a - 1.0
                );
                assert!((volume - v).abs() <= 1e-10 * v, "{text}: {volume} {v}");
                assert!((area - a).abs() <= 1e-9 * a, "{text}: {area} {a}");
                assert!(normal.length() <= 1e-9 * a, "{text}: {normal}");
                for c in 0..3 {
                    let about = exact.first[c].value + exact.about[c] * v;
                    assert!(
                        (first[c] - about).abs() <= 1e-9 * bounds.longest_side() * v,
                        "{text}"
                    );
                }
            }
        }
    }
}
