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
    // The error falls with the square of n: from a coarse grid's the count is known nearly.
    let mut n = 4_u32;
    let error = loop {
        let error = largest_error(faces, n);
        if error <= budget {
            break error;
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
    };
    let mut welded = Welded::new(1e-12 * size.max(reach * 1e-3));
    let mut triangles = Vec::new();
    for face in faces {
        add(face, n, &mut welded, &mut triangles);
    }
    let vertices = welded.points.iter().map(|&p| frame.to_world(p)).collect();
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

/// Adds the triangles of a face.
fn add(face: &OuterFace, n: u32, welded: &mut Welded, triangles: &mut Vec<[u32; 3]>) {
    let mut grid = Vec::with_capacity(((n + 1) * (n + 1)) as usize);
    for j in 0..=n {
        for i in 0..=n {
            let at = [i, j].map(|k| f64::from(k) / f64::from(n));
            let point = face
                .surface
                .evaluate(at)
                .map_or(DVec3::ZERO, DVec3::from_array);
            grid.push(welded.index(point));
        }
    }
    let at = |i: u32, j: u32| grid[(j * (n + 1) + i) as usize];
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                // Where an edge is collapsed a triangle is.
                if a != b && b != c && c != a {
                    triangles.push(if face.outward >= 0 {
                        [a, b, c]
                    } else {
                        [a, c, b]
                    });
                }
            }
        }
    }
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
