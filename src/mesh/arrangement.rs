//! Chords that meet in common ends alone.
//!
//! Chords of walls or gaps thinner than the tolerance cross, and those of curves that touch may lie on
//! each other. They are cut where they do:
//!
//! ```text
//!    \   /             \   /
//!     \ /               \ /
//!      X       ──>       o        every point a multiple of 2^-48
//!     / \               / \
//! ```
//!
//! A cut moves to the lattice, which bends its chords by less than a step of it; what then crosses
//! anew is cut again (iterated snap rounding). On the lattice the signs are exact, and there are no
//! endless many points to cut at. Chords of one place and opposite directions enclose nothing and go.
//!
//! Source: Halperin & Packer, *Iterated snap rounding*, Computational Geometry 23 (2002).

use super::outline::{index, squared_distance};
use crate::region::{Box2, BoxTree};
use robust::{Coord, orient2d};
use std::collections::{BTreeMap, HashMap};

/// Steps of the lattice in the region's unit.
const STEPS: f64 = (1_u64 << 48) as f64;
/// Rounds of cutting: one is enough but for cuts that bend chords across others.
const ROUNDS: usize = 64;
/// The most chords: a pair of walls that cross everywhere must end.
const MOST_CHORDS: usize = 4_000_000;

/// Chords over points of the lattice, and how far they are from those they came from.
#[derive(Debug)]
pub(super) struct Arrangement {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) chords: Vec<[u32; 2]>,
    /// A bound on the distance, both ways, in the region's unit.
    pub(super) moved: f64,
}

impl Arrangement {
    /// Cuts chords over distinct points, which leave every point as often as they arrive.
    ///
    /// * `most`: how far what is left may be from chords that enclose nothing and go.
    ///
    /// # Errors
    /// A place where cutting does not end, or walls are thinner than the lattice.
    pub(super) fn new(
        points: &[[f64; 2]],
        chords: &[[u32; 2]],
        most: f64,
    ) -> Result<Self, [f64; 2]> {
        let snapped = points
            .iter()
            .map(|p| p.map(|v| (v * STEPS).round() / STEPS));
        let mut lattice = Lattice::default();
        let to: Vec<u32> = snapped.map(|p| lattice.index(p)).collect();
        let mut chords: Vec<[u32; 2]> = chords.iter().map(|c| c.map(|i| to[i as usize])).collect();
        chords.retain(|[a, b]| a != b);
        let somewhere = points.first().copied().unwrap_or_default();
        for round in 0..ROUNDS {
            let cuts = cuts(&mut lattice, &chords);
            if cuts.is_empty() {
                let kept = without_opposites(&chords);
                let gone = farthest_gone(&lattice.points, &chords, &kept, most)?;
                #[allow(clippy::cast_precision_loss, reason = "a few rounds")]
                return Ok(Self {
                    points: lattice.points,
                    chords: kept,
                    moved: gone + (round + 1) as f64 / STEPS,
                });
            }
            chords = divided(&lattice.points, &chords, &cuts);
            if chords.len() > MOST_CHORDS {
                break;
            }
        }
        Err(somewhere)
    }
}

/// Distinct points.
#[derive(Debug, Default)]
struct Lattice {
    points: Vec<[f64; 2]>,
    known: HashMap<[u64; 2], u32>,
}

impl Lattice {
    fn index(&mut self, p: [f64; 2]) -> u32 {
        // -0 and 0 are one.
        let p = p.map(|v| v + 0.0);
        *self.known.entry(p.map(f64::to_bits)).or_insert_with(|| {
            self.points.push(p);
            index(self.points.len() - 1)
        })
    }
}

/// Ends of a chord whatever its direction.
fn undirected([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Points inside chords at which these are to be cut.
type Cuts = BTreeMap<[u32; 2], Vec<u32>>;

/// Where chords meet other than in common ends.
fn cuts(lattice: &mut Lattice, chords: &[[u32; 2]]) -> Cuts {
    let mut edges: Vec<[u32; 2]> = chords.iter().map(|&c| undirected(c)).collect();
    edges.sort_unstable();
    edges.dedup();
    let at = |lattice: &Lattice, i: u32| lattice.points[i as usize];
    let boxes: Vec<Box2> = edges
        .iter()
        .map(|e| Box2::around(at(lattice, e[0]), at(lattice, e[1])))
        .collect();
    let tree = BoxTree::new(&boxes);
    let mut found = Cuts::new();
    for (i, &edge) in edges.iter().enumerate() {
        let mut near = Vec::new();
        tree.visit(|b| b.overlaps(&boxes[i]), |j| near.push(j as usize));
        near.retain(|&j| j > i && boxes[j].overlaps(&boxes[i]));
        near.sort_unstable();
        for j in near {
            let other = edges[j];
            let mut inside = false;
            for (one, ends) in [(edge, other), (other, edge)] {
                for end in ends {
                    if one.contains(&end) {
                        continue;
                    }
                    if lies_on(lattice, one, end) {
                        found.entry(one).or_default().push(end);
                        inside = true;
                    }
                }
            }
            if inside || edge.iter().any(|v| other.contains(v)) {
                continue;
            }
            if let Some(p) = crossing(lattice, edge, other) {
                let p = lattice.index(p);
                for one in [edge, other] {
                    if !one.contains(&p) {
                        found.entry(one).or_default().push(p);
                    }
                }
            }
        }
    }
    found
}

/// Twice the signed area of a triangle, its sign exact.
fn turn(lattice: &Lattice, a: u32, b: u32, c: u32) -> f64 {
    let [a, b, c] = [a, b, c].map(|i| {
        let [x, y] = lattice.points[i as usize];
        Coord { x, y }
    });
    orient2d(a, b, c)
}

/// Whether a point lies on a chord, between its ends.
fn lies_on(lattice: &Lattice, [a, b]: [u32; 2], p: u32) -> bool {
    let [q, from, to] = [p, a, b].map(|i| lattice.points[i as usize]);
    let between = (0..2).all(|c| from[c].min(to[c]) <= q[c] && q[c] <= from[c].max(to[c]));
    between && turn(lattice, a, b, p) == 0.0
}

/// The point of the lattice where two chords cross.
fn crossing(lattice: &Lattice, [a, b]: [u32; 2], [c, d]: [u32; 2]) -> Option<[f64; 2]> {
    let (from, to) = (turn(lattice, c, d, a), turn(lattice, c, d, b));
    let (left, right) = (turn(lattice, a, b, c), turn(lattice, a, b, d));
    let apart = |u: f64, v: f64| u > 0.0 && v < 0.0 || u < 0.0 && v > 0.0;
    if !(apart(from, to) && apart(left, right)) {
        return None;
    }
    let [p, q] = [a, b].map(|i| lattice.points[i as usize]);
    let share = from / (from - to);
    Some([0, 1].map(|k| {
        let v = p[k] + share * (q[k] - p[k]);
        ((v * STEPS).round() / STEPS).clamp(p[k].min(q[k]), p[k].max(q[k]))
    }))
}

/// Chords cut at the points inside them.
fn divided(points: &[[f64; 2]], chords: &[[u32; 2]], cuts: &Cuts) -> Vec<[u32; 2]> {
    let mut all = Vec::with_capacity(chords.len());
    for &[a, b] in chords {
        let Some(inside) = cuts.get(&undirected([a, b])) else {
            all.push([a, b]);
            continue;
        };
        let [p, q] = [a, b].map(|i| points[i as usize]);
        let along = |i: u32| {
            let v = points[i as usize];
            (v[0] - p[0]) * (q[0] - p[0]) + (v[1] - p[1]) * (q[1] - p[1])
        };
        let mut run = inside.clone();
        run.sort_by(|&i, &j| along(i).total_cmp(&along(j)).then(i.cmp(&j)));
        run.dedup();
        let mut last = a;
        for next in run.into_iter().chain([b]) {
            if next != last {
                all.push([last, next]);
            }
            last = next;
        }
    }
    all
}

/// The chords less pairs of opposite ones.
fn without_opposites(chords: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut balance: HashMap<[u32; 2], i32> = HashMap::new();
    for &chord in chords {
        let key = undirected(chord);
        *balance.entry(key).or_default() += if key == chord { 1 } else { -1 };
    }
    let mut kept = Vec::with_capacity(chords.len());
    for &chord in chords {
        let key = undirected(chord);
        let sign = if key == chord { 1 } else { -1 };
        // The first as many as are left of this direction.
        if let Some(n) = balance.get_mut(&key).filter(|n| **n * sign > 0) {
            *n -= sign;
            kept.push(chord);
        }
    }
    kept
}

/// How far the chords that went are from those kept; a place where that is more than `most`.
fn farthest_gone(
    points: &[[f64; 2]],
    chords: &[[u32; 2]],
    kept: &[[u32; 2]],
    most: f64,
) -> Result<f64, [f64; 2]> {
    let mut stay: Vec<[u32; 2]> = kept.iter().map(|&c| undirected(c)).collect();
    stay.sort_unstable();
    stay.dedup();
    let segment = |e: [u32; 2]| e.map(|i| points[i as usize]);
    let boxes: Vec<Box2> = stay
        .iter()
        .map(|&e| {
            let [p, q] = segment(e);
            Box2::around(p, q)
        })
        .collect();
    let tree = BoxTree::new(&boxes);
    let mut farthest = 0.0_f64;
    for &chord in chords {
        if stay.binary_search(&undirected(chord)).is_ok() {
            continue;
        }
        let [p, q] = segment(chord);
        let middle = [0, 1].map(|k| 0.5 * (p[k] + q[k]));
        let mut nearest = f64::INFINITY;
        tree.visit_nearest(middle, nearest, |i, limit| {
            nearest = nearest.min(squared_distance(middle, segment(stay[i as usize])));
            limit.min(nearest)
        });
        let off = nearest.sqrt() + 0.5 * (q[0] - p[0]).hypot(q[1] - p[1]);
        if !(off <= most) {
            return Err(middle);
        }
        farthest = farthest.max(off);
    }
    Ok(farthest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn closed(points: &[[f64; 2]]) -> Vec<[u32; 2]> {
        let n = index(points.len());
        (0..n).map(|i| [i, (i + 1) % n]).collect()
    }

    /// No two chords meet but in common ends, and all balance.
    fn is_arranged(found: &Arrangement) {
        let mut lattice = Lattice::default();
        for &p in &found.points {
            lattice.index(p);
        }
        assert!(cuts(&mut lattice, &found.chords).is_empty());
        let mut balance = vec![0; found.points.len()];
        for [a, b] in &found.chords {
            balance[*a as usize] += 1;
            balance[*b as usize] -= 1;
        }
        assert!(balance.iter().all(|n| *n == 0));
    }

    #[test]
    fn a_bow_tie_is_cut_in_the_middle() {
        let points = [[0.0, 0.0], [0.5, 0.5], [0.5, 0.0], [0.0, 0.5]];
        let found = Arrangement::new(&points, &closed(&points), 0.1).expect("chords");
        is_arranged(&found);
        assert_eq!(found.points[4], [0.25, 0.25]);
        assert_eq!(found.chords.len(), 6);
    }

    #[test]
    fn random_polygons_are_cut_to_the_end() {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for n in [5, 20, 80] {
            // Flat ones, so that cuts bend chords across others.
            for flat in [1.0, 1e-9, 1e-13] {
                let points: Vec<[f64; 2]> = (0..n).map(|_| [random(), flat * random()]).collect();
                let found = Arrangement::new(&points, &closed(&points), 1.0).expect("chords");
                is_arranged(&found);
                assert!(
                    found.moved < 1e-12 || flat < 1e-12,
                    "{flat} {}",
                    found.moved
                );
            }
        }
    }

    #[test]
    fn walls_without_thickness_go_where_the_rest_is_near_and_are_refused_elsewhere() {
        // A triangle with an antenna of 0.25.
        let points = [[0.0, 0.0], [0.5, 0.0], [0.75, 0.0], [0.25, 0.5]];
        let chords = [[0, 1], [1, 2], [2, 1], [1, 3], [3, 0]];
        let found = Arrangement::new(&points, &chords, 0.3).expect("chords");
        is_arranged(&found);
        assert_eq!(found.chords.len(), 3);
        assert!((0.25..0.3).contains(&found.moved));
        assert!(Arrangement::new(&points, &chords, 0.2).is_err());
    }
}
