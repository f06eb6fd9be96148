//! Triangles of a flat cap.
//!
//! A cap is what the loops of an [`Outline`] enclose. Its triangles use
//! the loops' own corners, so that the cap meets the turned surface edge for edge: a constrained
//! Delaunay triangulation with exact predicates, each face of it taken as often as the loops wind
//! about it.
//!
//! Polygons of walls or gaps thinner than the chord error may cross; they are cut where they do
//! ([`Arrangement`]). Between the cuts they wind -1 or 2 times about slivers no wider than the chord
//! error, so faces are taken in sheets, turned over where the number is negative:
//!
//! ```text
//!   winding          2 | 1                 sheets of both sides of an edge are glued in order,
//!   sheets     [0] [1] | [0]       ──>     0 to 0; what is left over is glued to the chords along
//!                  [1] | chord             the edge, as many as the difference
//! ```
//!
//! What is glued about a point makes one corner of it: it begins at a chord that arrives and ends at
//! one that leaves, which are the neighbours in a loop, or it goes around within the cap. So every
//! edge of the cap has two sides by construction, whatever the chords do.

use super::arrangement::Arrangement;
use super::outline::{Outline, chains, index, used};
use spade::handles::{FixedDirectedEdgeHandle, FixedVertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::HashMap;

type Triangulated = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// A cap's triangles.
#[derive(Debug)]
pub(super) struct Cap {
    /// Counter-clockwise in the half-plane, turned over ones clockwise. Numbers are those of the
    /// corners of all loops counted through, then of `inner`.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Points that are corners of no loop.
    pub(super) inner: Vec<u32>,
}

impl Cap {
    /// The cap of an outline, whose loops become those that the cap is bounded by: where they cross
    /// or touch they have further corners, and its error grows by what that moves.
    ///
    /// * `most`: how much the error may grow, in the region's unit.
    ///
    /// # Errors
    /// A place where walls are too thin to be told apart.
    pub(super) fn new(outline: &mut Outline, most: f64) -> Result<Self, [f64; 2]> {
        let chords = outline.chords();
        if let Some((loops, cap)) = glued(&outline.points, &chords) {
            outline.loops = loops;
            return Ok(cap);
        }
        let arranged = Arrangement::new(&outline.points, &chords, most)?;
        let somewhere = outline.points.first().copied().unwrap_or_default();
        let (mut loops, mut cap) = glued(&arranged.points, &arranged.chords).ok_or(somewhere)?;
        // Inner points are those of corners, so they are among the ones in use.
        let count = loops.len();
        loops.push(std::mem::take(&mut cap.inner));
        outline.points = used(arranged.points, &mut loops);
        cap.inner = loops.split_off(count).concat();
        outline.loops = loops;
        outline.error += arranged.moved;
        Ok(cap)
    }
}

/// Sets of nodes, as a forest.
struct Classes(Vec<usize>);

impl Classes {
    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let (a, b) = (self.root(i), self.root(j));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Loops over the points, and the cap that they bound; `None` where chords cross, overlap or do not
/// close.
fn glued(points: &[[f64; 2]], chords: &[[u32; 2]]) -> Option<(Vec<Vec<u32>>, Cap)> {
    // Only the points in use, so that no stray one divides a triangle.
    let mut place = vec![usize::MAX; points.len()];
    let mut vertices = Vec::new();
    for &[p, _] in chords {
        if place[p as usize] == usize::MAX {
            place[p as usize] = vertices.len();
            let [r, z] = points[p as usize];
            vertices.push(Point2::new(r, z));
        }
    }
    let mut along: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    let mut edges = Vec::new();
    for (c, chord) in chords.iter().enumerate() {
        let ends = chord.map(|p| place[p as usize]);
        if ends.contains(&usize::MAX) || along.contains_key(&[ends[1], ends[0]]) {
            return None;
        }
        let same = along.entry(ends).or_default();
        if same.is_empty() {
            edges.push(ends);
        }
        same.push(c);
    }
    let mut crossed = false;
    let cdt = Triangulated::try_bulk_load_cdt(vertices, edges.clone(), |_| crossed = true).ok()?;
    let whole = edges.iter().all(|&[a, b]| {
        let [a, b] = [a, b].map(FixedVertexHandle::from_index);
        let edge = cdt.get_edge_from_neighbors(a, b);
        edge.is_some_and(|e| e.is_constraint_edge())
    });
    if crossed || !whole {
        return None;
    }
    let sheets = Sheets::new(&cdt, &along, chords.len())?;
    sheets.cap(&cdt, chords, points.len())
}

/// Faces as often as the chords wind about them, glued.
struct Sheets {
    /// By face.
    winding: Vec<i32>,
    /// The first sheet of each face; each has three nodes, its corners.
    first: Vec<usize>,
    /// The corner of its face that a directed edge begins at.
    slot: Vec<usize>,
    /// Nodes of the sheets' corners, then start and end of each chord.
    nodes: Classes,
    chord_nodes: usize,
}

/// The two ends of a side that is glued, as nodes.
type Side = [usize; 2];

impl Sheets {
    fn new(
        cdt: &Triangulated,
        along: &HashMap<[usize; 2], Vec<usize>>,
        chords: usize,
    ) -> Option<Self> {
        let winding = windings(cdt, along)?;
        let mut first = vec![0; winding.len()];
        let mut slot = vec![0; cdt.num_directed_edges()];
        let mut sheets = 0;
        for face in cdt.inner_faces() {
            let f = face.fix().index();
            first[f] = sheets;
            sheets += winding[f].unsigned_abs() as usize;
            for (k, edge) in face.adjacent_edges().iter().enumerate() {
                slot[edge.fix().index()] = k;
            }
        }
        let mut all = Self {
            winding,
            first,
            slot,
            nodes: Classes((0..3 * sheets + 2 * chords).collect()),
            chord_nodes: 3 * sheets,
        };
        for edge in cdt.undirected_edges() {
            all.glue(cdt, edge.as_directed().fix(), along)?;
        }
        Some(all)
    }

    /// Glues the sides along an edge; `None` where they do not match.
    fn glue(
        &mut self,
        cdt: &Triangulated,
        edge: FixedDirectedEdgeHandle,
        along: &HashMap<[usize; 2], Vec<usize>>,
    ) -> Option<()> {
        let there = cdt.directed_edge(edge);
        let ends = [there.from().fix().index(), there.to().fix().index()];
        let chords = |ends: [usize; 2]| along.get(&ends).map_or(&[][..], Vec::as_slice);
        let [left, right] = [there, there.rev()].map(|e| {
            let f = e.face().fix().index();
            (self.winding[f], self.first[f], self.slot[e.fix().index()])
        });
        // From the edge's start to its end, whichever way the face goes around.
        let sides = |(winding, first, slot): (i32, usize, usize), ahead: bool, sign: i32| {
            let (a, b) = (slot, (slot + 1) % 3);
            let (a, b) = if ahead { (a, b) } else { (b, a) };
            let count = usize::try_from(winding * sign).unwrap_or(0);
            (0..count).map(move |s| [3 * (first + s) + a, 3 * (first + s) + b])
        };
        let node = self.chord_nodes;
        let of_chords = |list: &'_ [usize], ahead: bool| -> Vec<Side> {
            let ends = |&c: &usize| [node + 2 * c, node + 2 * c + 1];
            let turned = |[a, b]: Side| if ahead { [a, b] } else { [b, a] };
            list.iter().map(|c| turned(ends(c))).collect()
        };
        // Sides that go along the edge, and those they are glued to.
        let mut forward: Vec<Side> = sides(left, true, 1)
            .chain(sides(right, false, -1))
            .collect();
        forward.extend(of_chords(chords([ends[1], ends[0]]), false));
        let mut backward: Vec<Side> = sides(right, false, 1)
            .chain(sides(left, true, -1))
            .collect();
        backward.extend(of_chords(chords(ends), true));
        if forward.len() != backward.len() {
            return None;
        }
        for (p, q) in forward.into_iter().zip(backward) {
            self.nodes.join(p[0], q[0]);
            self.nodes.join(p[1], q[1]);
        }
        Some(())
    }

    /// The loops and the cap, from what is glued.
    fn cap(
        mut self,
        cdt: &Triangulated,
        chords: &[[u32; 2]],
        count: usize,
    ) -> Option<(Vec<Vec<u32>>, Cap)> {
        let mut leaving = vec![u32::MAX; self.nodes.0.len()];
        for c in 0..chords.len() {
            let root = self.nodes.root(self.chord_nodes + 2 * c);
            if std::mem::replace(&mut leaving[root], index(c)) != u32::MAX {
                return None;
            }
        }
        let mut next = vec![u32::MAX; chords.len()];
        for (c, next) in next.iter_mut().enumerate() {
            *next = leaving[self.nodes.root(self.chord_nodes + 2 * c + 1)];
            chords.get(*next as usize)?;
        }
        let chains = chains(&next);
        if chains.iter().any(|chain| chain.len() < 3) {
            return None;
        }
        let mut number = vec![u32::MAX; self.nodes.0.len()];
        for (corner, &c) in chains.iter().flatten().enumerate() {
            let root = self.nodes.root(self.chord_nodes + 2 * c as usize);
            number[root] = index(corner);
        }
        let loops: Vec<Vec<u32>> = chains
            .iter()
            .map(|chain| chain.iter().map(|&c| chords[c as usize][0]).collect())
            .collect();
        let corners = index(chords.len());
        // The point of each vertex.
        let mut point = vec![u32::MAX; cdt.num_vertices()];
        let mut place = vec![u32::MAX; count];
        let mut seen = 0;
        for &[p, _] in chords {
            if std::mem::replace(&mut place[p as usize], 0) == u32::MAX {
                point[seen] = p;
                seen += 1;
            }
        }
        let mut cap = Cap {
            triangles: Vec::new(),
            inner: Vec::new(),
        };
        for face in cdt.inner_faces() {
            let f = face.fix().index();
            let at = face.vertices().map(|v| v.fix().index());
            for s in 0..self.winding[f].unsigned_abs() as usize {
                let corner = [0, 1, 2].map(|k| {
                    let root = self.nodes.root(3 * (self.first[f] + s) + k);
                    if number[root] == u32::MAX {
                        number[root] = corners + index(cap.inner.len());
                        cap.inner.push(point[at[k]]);
                    }
                    number[root]
                });
                let [a, b, c] = corner;
                cap.triangles.push(if self.winding[f] > 0 {
                    [a, b, c]
                } else {
                    [a, c, b]
                });
            }
        }
        Some((loops, cap))
    }
}

/// How often the chords wind about each face; `None` where they do not close.
fn windings(cdt: &Triangulated, along: &HashMap<[usize; 2], Vec<usize>>) -> Option<Vec<i32>> {
    let chords = |a: usize, b: usize| {
        let count = along.get(&[a, b]).map_or(0, Vec::len);
        i32::try_from(count).ok()
    };
    // What the winding is more by on the other side of each face's edges.
    let mut beside: Vec<Vec<(usize, i32)>> = vec![Vec::new(); cdt.num_all_faces()];
    for edge in cdt.directed_edges() {
        let [a, b] = [edge.from().fix().index(), edge.to().fix().index()];
        let [left, right] = [edge.face(), edge.rev().face()].map(|f| f.fix().index());
        beside[left].push((right, chords(b, a)? - chords(a, b)?));
    }
    let mut winding: Vec<Option<i32>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix().index();
    winding[outer] = Some(0);
    let mut pending = vec![outer];
    while let Some(f) = pending.pop() {
        let here = winding[f]?;
        for &(other, more) in &beside[f] {
            match winding[other] {
                None => {
                    winding[other] = Some(here + more);
                    pending.push(other);
                }
                Some(known) if known != here + more => return None,
                Some(_) => {}
            }
        }
    }
    winding.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(points: &[[f64; 2]], loops: &[Vec<u32>]) -> Outline {
        Outline {
            points: points.to_vec(),
            loops: loops.to_vec(),
            error: 0.0,
        }
    }

    fn corners(outline: &Outline, cap: &Cap) -> Vec<[f64; 2]> {
        let all = outline.loops.iter().flatten().chain(&cap.inner);
        all.map(|&p| outline.points[p as usize]).collect()
    }

    fn twice(corners: &[[f64; 2]], t: [u32; 3]) -> f64 {
        let [a, b, c] = t.map(|i| corners[i as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Whether the triangles' edges and the reversed chords of the loops make pairs.
    fn is_bounded(outline: &Outline, cap: &Cap) -> bool {
        let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
        let mut first = 0;
        for l in &outline.loops {
            let n = index(l.len());
            for i in 0..n {
                *uses.entry([first + (i + 1) % n, first + i]).or_default() += 1;
            }
            first += n;
        }
        for [a, b, c] in &cap.triangles {
            for edge in [[*a, *b], [*b, *c], [*c, *a]] {
                *uses.entry(edge).or_default() += 1;
            }
        }
        let matched = |(e, n): (&[u32; 2], &u32)| *n == 1 && uses.get(&[e[1], e[0]]) == Some(&1);
        uses.iter().all(matched)
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
        let mut outline = outline(&points, &loops);
        let cap = Cap::new(&mut outline, 0.0).expect("a cap");
        assert_eq!(outline.loops, loops);
        assert!(is_bounded(&outline, &cap) && cap.inner.is_empty());
        assert_eq!(cap.triangles.len(), 7 + 1);
        // The square less the hole, and the island.
        let wanted = 16.0 - 6.0 + 0.25;
        let corners = corners(&outline, &cap);
        let areas = cap.triangles.iter().map(|&t| 0.5 * twice(&corners, t));
        assert!((areas.sum::<f64>() - wanted).abs() < 1e-12);
        assert!(cap.triangles.iter().all(|&t| twice(&corners, t) > 0.0));
    }

    /// Crossing polygons: each point is covered as often as they wind about it, by no more triangles
    /// than that, so that nothing lies where they do not.
    #[test]
    fn crossing_polygons_are_covered_as_often_as_they_wind() {
        let square = |low: f64, high: f64| [[low, low], [high, low], [high, high], [low, high]];
        let bow = vec![[0.0, 0.0], [0.5, 0.5], [0.5, 0.0], [0.0, 0.5]];
        let overlapping = [square(0.0, 0.5), square(0.25, 0.75)].concat();
        let mut slanted = square(0.0, 0.5).to_vec();
        slanted.extend([[0.1, 0.2], [0.3, 0.7], [0.8, 0.1]]);
        // A star that winds twice about its middle.
        let star: Vec<[f64; 2]> = (0..5)
            .map(|k| f64::from(2 * k) * std::f64::consts::TAU / 5.0)
            .map(|a| [0.5 + 0.4 * a.cos(), 0.5 + 0.4 * a.sin()])
            .collect();
        for (points, sizes) in [
            (bow, vec![4]),
            (overlapping, vec![4, 4]),
            (slanted, vec![4, 3]),
            (star, vec![5]),
        ] {
            let mut first = 0;
            let loops: Vec<Vec<u32>> = sizes
                .iter()
                .map(|&n| {
                    first += n;
                    (first - n..first).collect()
                })
                .collect();
            let mut outline = outline(&points, &loops);
            let cap = Cap::new(&mut outline, 0.1).expect("a cap");
            assert!(is_bounded(&outline, &cap));
            let corners = corners(&outline, &cap);
            let wound = |p: [f64; 2]| -> i32 {
                let side = |a: [f64; 2], b: [f64; 2]| {
                    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0
                };
                let of = |l: &Vec<u32>| -> i32 {
                    (0..l.len())
                        .map(|i| {
                            let [a, b] = [l[i], l[(i + 1) % l.len()]].map(|k| points[k as usize]);
                            match (a[1] <= p[1], b[1] <= p[1]) {
                                (true, false) => i32::from(side(a, b)),
                                (false, true) => -i32::from(!side(a, b)),
                                _ => 0,
                            }
                        })
                        .sum()
                };
                loops.iter().map(of).sum()
            };
            for k in 0..400_u32 {
                // On no chord.
                let p = [f64::from(k % 20) + 0.417, f64::from(k / 20) + 0.283].map(|v| v / 19.0);
                let (mut covered, mut layers) = (0, 0);
                for &t in &cap.triangles {
                    let [a, b, c] = t.map(|i| corners[i as usize]);
                    let sign = twice(&corners, t).signum();
                    let side = |a: [f64; 2], b: [f64; 2]| {
                        sign * ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))
                    };
                    if side(a, b) > 0.0 && side(b, c) > 0.0 && side(c, a) > 0.0 {
                        covered += sign as i32;
                        layers += 1;
                    }
                }
                assert_eq!(covered, wound(p), "{p:?}");
                assert_eq!(layers, covered.abs(), "{p:?}");
            }
        }
    }
}
