//! The faces of a solid of rational patches as triangles.
//!
//! Every face is cut in n × n cells, alike on all faces, so that neighbours meet at the same points;
//! points nearer to each other than the rounding are one. Each cell is two triangles.
//!
//! # Why the mesh is within the chord error
//!
//! Over a cell, with corners A, B, C, D and Q its bilinear interpolant, X = N/w the surface,
//!
//! ```text
//!   |X - Q| <= max |coefficients of N - w Q| / min w       both of degree p + 1, q + 1 in Bernstein form
//!   |Q - T| <= |A - B + C - D| / 4                         T the two triangles, at the same parameters
//! ```
//!
//! so that every point of the cell and its point of the triangles at the same parameters are within
//! the sum: the distance both ways, and as points move continuously, what is further away than that
//! is on the same side of both.
//!
//! # Where faces of different sizes meet
//!
//! An edge of one face may run along several of others. A piece of an edge that no other triangle has
//! in the other direction takes in all ends of such pieces that lie on it, so that both sides have
//! them all. With E the bound above, a triangle's point moves by E at most when a point of its edge
//! goes from the chord to the surface, which makes 2 E.

use super::tessellate::rounding;
use super::triangles::Mesh;
use super::{MAX_TRIANGLES, MeshError};
use crate::nurbs::{BezierCell, Homogeneous};
use crate::patch::OuterFace;
use crate::solid::Patches;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// The boundary of rational patches as a closed mesh within `chord_error`, a length greater than 0.
pub(super) fn tessellate(body: &Patches, chord_error: f64) -> Result<Mesh, MeshError> {
    let frame = body.frame();
    let bounds = body.faces().bounds();
    let reach = bounds.map_or(1.0, |b| b.min.abs().max(b.max.abs()).max_element());
    let rounding = rounding(frame.origin(), reach * frame.scale());
    let budget = (chord_error - rounding) / frame.scale();
    let size = bounds.map_or(1.0, |b| b.longest_side());
    let least = 1e-11 * size;
    if budget < least {
        return Err(MeshError::BelowRounding {
            found: chord_error,
            smallest: 2.0 * (rounding + least * frame.scale()),
        });
    }
    let faces = body.faces().faces();
    let limit = |n: f64| 2.0 * n * n * as_f64(faces.len());
    let divide = |budget: f64| -> Result<(u32, f64), MeshError> {
        // The error falls with the square of n: from a coarse grid's the count is known nearly.
        let mut n = 4_u32;
        loop {
            let error = largest_error(faces, n);
            if error <= budget {
                return Ok((n, error));
            }
            let wanted = (f64::from(n) * (error / budget).sqrt() * 1.05).ceil();
            if !(limit(wanted) <= as_f64(MAX_TRIANGLES)) {
                return Err(MeshError::TooManyTriangles {
                    found: chord_error,
                    triangles: limit(wanted),
                    limit: MAX_TRIANGLES,
                });
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "below the limit of triangles"
            )]
            {
                n = (wanted as u32).max(n + 1);
            }
        }
    };
    let hair = 1e-12 * size.max(reach * 1e-3);
    let (n, error) = divide(budget)?;
    let mut grids = Grids::new(faces, n, hair);
    let mut error = error;
    let mut within = grids.ends_within(error);
    if !within.is_empty() {
        if 2.0 * error > budget {
            let (n, finer) = divide(0.5 * budget)?;
            grids = Grids::new(faces, n, hair);
            within = grids.ends_within(finer);
            error = finer;
        }
        error *= 2.0;
    }
    let triangles = grids.triangles(&within);
    let points = grids.welded.points.iter();
    let vertices = points.map(|&p| frame.to_world(p)).collect();
    Ok(Mesh::new(
        vertices,
        triangles,
        (error * frame.scale() + rounding).min(chord_error),
    ))
}

#[allow(clippy::cast_precision_loss, reason = "a count")]
fn as_f64(n: usize) -> f64 {
    n as f64
}

/// Points, those within a hair of each other taken as one.
struct Welded {
    points: Vec<DVec3>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    hair: f64,
}

impl Welded {
    fn new(hair: f64) -> Self {
        Self {
            points: Vec::new(),
            cells: HashMap::new(),
            hair,
        }
    }

    fn index(&mut self, p: DVec3) -> u32 {
        #[allow(clippy::cast_possible_truncation, reason = "saturates")]
        let cell = |v: DVec3| (v / (4.0 * self.hair)).floor().to_array().map(|c| c as i64);
        // The hair's box touches at most eight cells.
        let mut seen: Vec<[i64; 3]> = Vec::with_capacity(8);
        for n in 0..8_u32 {
            let side = |bit: u32| {
                if n >> bit & 1 == 1 {
                    self.hair
                } else {
                    -self.hair
                }
            };
            let at = cell(p + DVec3::new(side(0), side(1), side(2)));
            if !seen.contains(&at) {
                seen.push(at);
            }
        }
        for at in &seen {
            for &k in self.cells.get(at).into_iter().flatten() {
                if self.points[k as usize].distance(p) <= self.hair {
                    return k;
                }
            }
        }
        #[allow(
            clippy::cast_possible_truncation,
            reason = "below the limit of triangles"
        )]
        let k = self.points.len() as u32;
        self.points.push(p);
        self.cells.entry(cell(p)).or_default().push(k);
        k
    }
}

/// A piece of a face's edge between two of its points: the face, which of its edges (counter-clockwise
/// in its parameters, from v = 0) and which piece of that, in the same direction.
type Piece = (usize, u32, u32);

/// Points that a piece of an edge takes in, in its direction.
type Within = HashMap<Piece, Vec<u32>>;

/// The faces cut alike, their points welded.
struct Grids<'a> {
    faces: &'a [OuterFace],
    n: u32,
    /// Vertices of each face, n + 1 in a row.
    points: Vec<Vec<u32>>,
    welded: Welded,
}

impl<'a> Grids<'a> {
    fn new(faces: &'a [OuterFace], n: u32, hair: f64) -> Self {
        let mut welded = Welded::new(hair);
        let points = faces.iter().map(|face| {
            let mut grid = Vec::with_capacity(((n + 1) * (n + 1)) as usize);
            for j in 0..=n {
                for i in 0..=n {
                    let at = [i, j].map(|k| f64::from(k) / f64::from(n));
                    grid.push(welded.index(point_of(face, at)));
                }
            }
            grid
        });
        Self {
            points: points.collect(),
            faces,
            n,
            welded,
        }
    }

    /// The ends of a piece, as places in the grid.
    fn ends(&self, edge: u32, piece: u32) -> [[u32; 2]; 2] {
        let n = self.n;
        let at = |k: u32| match edge {
            0 => [k, 0],
            1 => [n, k],
            2 => [n - k, n],
            _ => [0, n - k],
        };
        [at(piece), at(piece + 1)]
    }

    fn vertex(&self, face: usize, [i, j]: [u32; 2]) -> u32 {
        self.points[face][(j * (self.n + 1) + i) as usize]
    }

    /// The vertices that lie within pieces of edges which have no counterpart.
    ///
    /// * `error`: how far a point of a piece may be from its chord.
    fn ends_within(&self, error: f64) -> Within {
        let (n, faces) = (self.n, self.faces.len());
        let pieces = || {
            let edges = (0..faces).flat_map(|face| (0..4).map(move |edge| (face, edge)));
            edges.flat_map(|(face, edge)| (0..n).map(move |k| (face, edge, k)))
        };
        let vertices = |(face, edge, k): Piece| {
            let [a, b] = self.ends(edge, k).map(|at| self.vertex(face, at));
            let turned = self.faces[face].outward < 0;
            if turned { [b, a] } else { [a, b] }
        };
        // Once in each direction makes 0.
        let mut uses: HashMap<[u32; 2], i32> = HashMap::new();
        for piece in pieces() {
            let [a, b] = vertices(piece);
            *uses.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
        let single: Vec<Piece> = pieces()
            .filter(|&piece| {
                let [a, b] = vertices(piece);
                a != b && uses[&[a.min(b), a.max(b)]] != 0
            })
            .collect();
        let points = &self.welded.points;
        let mut ends: Vec<u32> = single.iter().flat_map(|&piece| vertices(piece)).collect();
        ends.sort_unstable();
        ends.dedup();
        // Along a direction in which points of different edges rarely tie.
        let along = DVec3::new(0.618_033_988, 0.414_213_562, 0.324_717_957).normalize();
        let mut keyed: Vec<(f64, u32)> = (ends.into_iter())
            .map(|v| (points[v as usize].dot(along), v))
            .collect();
        keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let found = single.into_par_iter().filter_map(|piece| {
            let (face, edge, k) = piece;
            let places = self.ends(edge, k);
            let [a, b] = places.map(|at| self.vertex(face, at));
            let [from, to] = [a, b].map(|v| points[v as usize]);
            let middle = 0.5 * (from + to);
            let radius = 0.5 * from.distance(to) + error + self.welded.hair;
            let key = middle.dot(along);
            let first = keyed.partition_point(|(k, _)| *k < key - radius);
            let near = keyed[first..].iter();
            let mut within: Vec<(f64, u32)> = near
                .take_while(|(k, _)| *k <= key + radius)
                .filter(|(_, v)| *v != a && *v != b)
                .filter(|(_, v)| points[*v as usize].distance(middle) <= radius)
                .filter_map(|&(_, v)| Some((self.place_on(face, places, points[v as usize])?, v)))
                .collect();
            within.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let list: Vec<u32> = within.into_iter().map(|(_, v)| v).collect();
            (!list.is_empty()).then_some((piece, list))
        });
        found.collect()
    }

    /// Where between two places of a face's edge a point lies, as a share; `None` where it is off it.
    fn place_on(&self, face: usize, places: [[u32; 2]; 2], point: DVec3) -> Option<f64> {
        const STEPS: usize = 32;
        let surface = &self.faces[face].surface;
        let [from, to] = places.map(|at| at.map(|k| f64::from(k) / f64::from(self.n)));
        let direction = [to[0] - from[0], to[1] - from[1]];
        let mut share = 0.5;
        // Gauss and Newton's: a piece is nearly straight.
        for _ in 0..STEPS {
            let at = [0, 1].map(|k| from[k] + share * direction[k]);
            let found = surface.derivatives(at).ok()?;
            let off = point - DVec3::from_array(found.point);
            let slope = (0..2)
                .map(|k| DVec3::from_array(found.first[k]) * direction[k])
                .sum::<DVec3>();
            let step = off.dot(slope) / slope.length_squared();
            if !step.is_finite() {
                return None;
            }
            let next = (share + step).clamp(0.0, 1.0);
            if (next - share).abs() <= f64::EPSILON {
                break;
            }
            share = next;
        }
        let at = [0, 1].map(|k| from[k] + share * direction[k]);
        let near = point_of(&self.faces[face], at).distance(point) <= self.welded.hair;
        (near && share > 0.0 && share < 1.0).then_some(share)
    }

    /// All triangles, with the points that pieces of edges take in.
    fn triangles(&self, within: &Within) -> Vec<[u32; 3]> {
        let n = self.n;
        let mut triangles = Vec::new();
        for (number, face) in self.faces.iter().enumerate() {
            let mut add = |[a, b, c]: [u32; 3]| {
                // Where an edge is collapsed a triangle is.
                if a != b && b != c && c != a {
                    let turned = if face.outward >= 0 {
                        [a, b, c]
                    } else {
                        [a, c, b]
                    };
                    triangles.push(turned);
                }
            };
            let at = |i: u32, j: u32| self.vertex(number, [i, j]);
            let inner = |edge: u32, piece: u32| {
                let list = within.get(&(number, edge, piece));
                list.map_or(&[][..], Vec::as_slice)
            };
            for j in 0..n {
                for i in 0..n {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    let edge = |is: bool, edge: u32, piece: u32| {
                        if is { inner(edge, piece) } else { &[][..] }
                    };
                    let low = edge(j == 0, 0, i);
                    let right = edge(i + 1 == n, 1, j);
                    let high = edge(j + 1 == n, 2, n - 1 - i);
                    let left = edge(i == 0, 3, n - 1 - j);
                    split([a, b, c], low, right, &mut add);
                    if high.is_empty() && left.is_empty() {
                        add([a, c, d]);
                    } else {
                        split([c, d, a], high, left, &mut add);
                    }
                }
            }
        }
        triangles
    }
}

/// The triangle a, b, c with further points on its edges from a to b and from b to c.
fn split([a, b, c]: [u32; 3], first: &[u32], second: &[u32], add: &mut impl FnMut([u32; 3])) {
    let mut last = a;
    for &p in first {
        add([last, p, c]);
        last = p;
    }
    // What is left is last, b, c.
    let mut from = b;
    for &q in second {
        add([last, from, q]);
        from = q;
    }
    add([last, from, c]);
}

fn point_of(face: &OuterFace, at: [f64; 2]) -> DVec3 {
    let found = face.surface.evaluate(at);
    found.map_or(DVec3::ZERO, DVec3::from_array)
}

/// The largest deviation of n × n cells' triangles from the faces.
fn largest_error(faces: &[OuterFace], n: u32) -> f64 {
    let cells = faces
        .par_iter()
        .flat_map_iter(|face| (0..n * n).map(move |k| (face, [k % n, k / n])));
    cells
        .map(|(face, at)| {
            let low = at.map(|k| f64::from(k) / f64::from(n));
            let high = at.map(|k| f64::from(k + 1) / f64::from(n));
            // A part that cannot be made (it always can) would be refused as too coarse.
            let part = face.surface.restrict(low, high);
            part.map_or(f64::INFINITY, |p| deviation(&p))
        })
        .reduce(|| 0.0, f64::max)
}

/// A bound on the distance of a cell's points from its two triangles' points at the same parameters.
fn deviation(cell: &BezierCell<2>) -> f64 {
    let [p, q] = cell.degrees();
    let points = cell.control_points();
    let at = |i: usize, j: usize| points[j * (p + 1) + i];
    let corner = |i: usize, j: usize| DVec3::from_array(at(i, j).to_point());
    let corners = [corner(0, 0), corner(p, 0), corner(0, q), corner(p, q)];
    let origin = corners[0];
    // N and w less the origin, and the corners of Q less it.
    let value = |h: Homogeneous<3>| DVec3::from_array(h.weighted) - origin * h.weight;
    let [o, a, b, c] = corners.map(|v| v - origin);
    let weight = points.iter().fold(f64::INFINITY, |m, h| m.min(h.weight));
    let (fp, fq) = (as_f64(p + 1), as_f64(q + 1));
    let mut most = 0.0_f64;
    // Coefficient (i, j) of degree (p + 1, q + 1): N elevated, w times the four corners' shares.
    for j in 0..=q + 1 {
        for i in 0..=p + 1 {
            let mut sum = DVec3::ZERO;
            for (di, u) in [(0, 1.0 - as_f64(i) / fp), (1, as_f64(i) / fp)] {
                for (dj, v) in [(0, 1.0 - as_f64(j) / fq), (1, as_f64(j) / fq)] {
                    let (Some(k), Some(l)) = (i.checked_sub(di), j.checked_sub(dj)) else {
                        continue;
                    };
                    if k > p || l > q {
                        continue;
                    }
                    let h = at(k, l);
                    let share = match (di, dj) {
                        (0, 0) => o,
                        (1, 0) => a,
                        (0, _) => b,
                        _ => c,
                    };
                    sum += (value(h) - share * h.weight) * (u * v);
                }
            }
            most = most.max(sum.length());
        }
    }
    most / weight + 0.25 * (o - a - b + c).length()
}
