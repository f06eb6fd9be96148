//! Triangles of a flat cap.
//!
//! A cap is what the loops of an [`Outline`](super::outline::Outline) enclose. Its triangles use
//! the loops' own corners and no others, so that the cap meets the turned surface edge for edge:
//! a constrained Delaunay triangulation with exact predicates, its inside found from the left
//! sides of the chords.
//!
//! Polygons of walls thinner than the chord error may cross. They have no triangulation, yet
//! a fan from a corner of each loop has the loop as its boundary all the same: its triangles
//! overlap with opposite orientation where they should not be, and cancel in every winding number.

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::HashMap;

/// Triangles over the corners of all loops, counted through, counter-clockwise in the half-plane.
///
/// * `points`: distinct points (r, z).
/// * `loops`: indices of points, what they enclose on their left.
pub(super) fn triangles(points: &[[f64; 2]], loops: &[Vec<u32>]) -> Vec<[u32; 3]> {
    let chords = corner_chords(loops);
    delaunay(points, loops)
        .filter(|found| bounded_by(found, &chords))
        .unwrap_or_else(|| fans(points, loops))
}

/// The chords as pairs of corners.
fn corner_chords(loops: &[Vec<u32>]) -> Vec<[u32; 2]> {
    let mut chords = Vec::new();
    let mut first = 0;
    for l in loops {
        let n = index(l.len());
        chords.extend((0..n).map(|i| [first + i, first + (i + 1) % n]));
        first += n;
    }
    chords
}

/// Whether the edges of the triangles cancel but for the chords.
fn bounded_by(triangles: &[[u32; 3]], chords: &[[u32; 2]]) -> bool {
    let edges = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let reversed = chords.iter().map(|&[a, b]| [b, a]);
    let mut uses: Vec<(u32, u32, bool)> = edges
        .chain(reversed)
        .map(|[a, b]| (a.min(b), a.max(b), a < b))
        .collect();
    uses.sort_unstable();
    uses.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
        .all(|u| u.len() == 2 && u[0].2 != u[1].2)
}

/// The Delaunay triangles inside; `None` where chords cross or overlap.
fn delaunay(points: &[[f64; 2]], loops: &[Vec<u32>]) -> Option<Vec<[u32; 3]>> {
    // Only the points in use, so that no stray one divides a triangle.
    let mut place = vec![usize::MAX; points.len()];
    let mut used = Vec::new();
    for &p in loops.iter().flatten() {
        if place[p as usize] == usize::MAX {
            place[p as usize] = used.len();
            let [r, z] = points[p as usize];
            used.push(Point2::new(r, z));
        }
    }
    // Corner of each chord by its ends.
    let mut leaving: HashMap<(usize, usize), u32> = HashMap::new();
    let mut edges = Vec::new();
    let mut corner = 0;
    for l in loops {
        for (i, &p) in l.iter().enumerate() {
            let ends = [p, l[(i + 1) % l.len()]].map(|p| place[p as usize]);
            if leaving.insert((ends[0], ends[1]), corner).is_some() {
                return None;
            }
            edges.push(ends);
            corner += 1;
        }
    }
    let mut crossed = false;
    let cdt =
        ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(used, edges, |_| {
            crossed = true
        })
        .ok()?;
    if crossed {
        return None;
    }
    let mut inside = vec![false; cdt.num_all_faces()];
    let mut reached = Vec::new();
    for &(a, b) in leaving.keys() {
        let [a, b] = [a, b].map(FixedVertexHandle::from_index);
        let edge = cdt.get_edge_from_neighbors(a, b)?;
        if !edge.is_constraint_edge() {
            return None;
        }
        reached.push(edge.face().as_inner()?.fix());
    }
    // The order of a hash map must not reach the file.
    reached.sort_unstable_by_key(|f| f.index());
    while let Some(face) = reached.pop() {
        if std::mem::replace(&mut inside[face.index()], true) {
            continue;
        }
        for edge in cdt.face(face).adjacent_edges() {
            if !edge.is_constraint_edge() {
                reached.push(edge.rev().face().as_inner()?.fix());
            }
        }
    }
    let mut found = Vec::new();
    for face in cdt.inner_faces().filter(|f| inside[f.fix().index()]) {
        let mut corners = [0; 3];
        for (slot, edge) in corners.iter_mut().zip(face.adjacent_edges()) {
            // Clockwise to the chord that opens the wedge.
            let mut side = edge;
            let known = |e: (usize, usize)| leaving.get(&e).copied();
            *slot = loop {
                if side.is_constraint_edge() {
                    break known((side.from().index(), side.to().index()))?;
                }
                side = side.cw();
                if side == edge {
                    return None;
                }
            };
        }
        found.push(corners);
    }
    Some(found)
}

/// A fan from a corner of each loop.
fn fans(points: &[[f64; 2]], loops: &[Vec<u32>]) -> Vec<[u32; 3]> {
    let mut found = Vec::new();
    let mut first = 0;
    for l in loops {
        let n = index(l.len());
        // Not from the axis: both caps share its corners, and an edge between two of them would
        // be used by both.
        let off_axis = |&p: &u32| points[p as usize][0] > 0.0;
        let from = index(l.iter().position(off_axis).unwrap_or(0));
        let corner = |i: u32| first + (from + i) % n;
        found.extend((1..n - 1).map(|i| [corner(0), corner(i), corner(i + 1)]));
        first += n;
    }
    found
}

#[allow(clippy::cast_possible_truncation, reason = "far below 2^32 corners")]
fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 2]], loops: &[Vec<u32>], triangles: &[[u32; 3]]) -> f64 {
        let corners: Vec<[f64; 2]> = loops
            .iter()
            .flatten()
            .map(|&p| points[p as usize])
            .collect();
        let twice = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        triangles.iter().map(|t| 0.5 * twice(t)).sum()
    }

    #[test]
    fn squares_with_holes_and_touching_corners_are_covered_once() {
        // A square, a hole that touches its lower left corner, an island in the hole, and points
        // in the middle of straight sides.
        let points = [
            [0.0, 0.0],
            [2.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.5, 2.0],
            [2.5, 2.0],
            [2.0, 2.5],
        ];
        let loops = vec![
            // Around the wedges at the touching corner: out along the side, back to the corner.
            vec![0, 1, 2, 3, 4, 0, 5, 6, 7],
            vec![8, 9, 10],
        ];
        let found = triangles(&points, &loops);
        assert!(bounded_by(&found, &corner_chords(&loops)));
        assert_eq!(found.len(), 7 + 1);
        // The square less the hole, and the island.
        let wanted = 16.0 - 6.0 + 0.25;
        assert!((area(&points, &loops, &found) - wanted).abs() < 1e-12);
        let corners: Vec<[f64; 2]> = loops
            .iter()
            .flatten()
            .map(|&p| points[p as usize])
            .collect();
        let positive = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])
        };
        assert!(found.iter().all(positive));
    }

    #[test]
    fn crossing_polygons_still_have_a_cap_with_their_boundary() {
        let points = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        let loops = vec![vec![0, 1, 2, 3]];
        let found = triangles(&points, &loops);
        assert!(bounded_by(&found, &corner_chords(&loops)));
    }
}
