//! Closing a boundary to the last bit.
//!
//! Counting crossings is right for every height only where the ends of pieces meet exactly: each
//! vertex must belong to an even number of ends. Pieces of several solids meet within roundings,
//! so their ends are brought together here, and what does not close is told.

use super::boundary::FilledPieces;
use super::piece::Piece;
use crate::math::{Dd, Real};
use std::sync::Arc;

/// Ends nearer than this, in the region's unit, are brought together where that leaves no end
/// alone: along curves that touch, the place where one takes over from the other is known no
/// better.
const LOOSE: f64 = 1e-13;

/// Sets of vertices, as a forest.
struct Clusters(Vec<usize>);

impl Clusters {
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

/// Brings ends nearer than `tolerance` together; `None` where the pieces then do not close.
pub(crate) fn welded(boundary: FilledPieces, tolerance: f64) -> Option<FilledPieces> {
    let pieces = boundary.shared();
    let ends: Vec<[Dd; 2]> = (pieces.iter()).flat_map(|p| [p.start(), p.end()]).collect();
    let mut order: Vec<usize> = (0..ends.len()).collect();
    let key = |i: usize| ends[i].map(Real::f64);
    order.sort_by(|&i, &j| key(i)[1].total_cmp(&key(j)[1]).then(i.cmp(&j)));
    let mut clusters = Clusters((0..ends.len()).collect());
    join_near(&ends, &order, tolerance, &mut clusters);
    let odd = odd_vertices(ends.len(), &mut clusters);
    if !odd.is_empty() {
        let lonely: Vec<usize> = order.iter().copied().filter(|i| odd.contains(i)).collect();
        join_near(&ends, &lonely, LOOSE, &mut clusters);
        if !odd_vertices(ends.len(), &mut clusters).is_empty() {
            return None;
        }
    }
    // A flat face stays in its plane and a cylinder on its radius, whatever curve ends there.
    let mut place: Vec<[Option<(u8, Dd)>; 2]> = vec![[None; 2]; ends.len()];
    for (i, end) in ends.iter().enumerate() {
        let piece = &pieces[i / 2];
        let at = &mut place[clusters.root(i)];
        for c in 0..2 {
            let weight = match piece.degree() {
                1 if piece.start()[c] == piece.end()[c] => 2,
                1 => 1,
                _ => 0,
            };
            let better = |(w, v): (u8, Dd)| weight > w || weight == w && end[c] < v;
            if at[c].is_none_or(better) {
                at[c] = Some((weight, end[c]));
            }
        }
    }
    let mut at = |i: usize| {
        let root = clusters.root(i);
        [0, 1].map(|c| place[root][c].map_or(ends[i][c], |(_, v)| v))
    };
    let (pieces, forward) = boundary.into_parts();
    let pieces = Arc::unwrap_or_clone(pieces).into_iter().zip(forward);
    let (pieces, forward) = (pieces.enumerate())
        .filter_map(|(k, (piece, forward))| {
            Some((between(piece, at(2 * k), at(2 * k + 1))?, forward))
        })
        .unzip();
    Some(FilledPieces::new(pieces, forward))
}

/// Joins the points of `order`, which rises in z, that are nearer than `tolerance`.
fn join_near(ends: &[[Dd; 2]], order: &[usize], tolerance: f64, clusters: &mut Clusters) {
    for (n, &i) in order.iter().enumerate() {
        for &j in &order[n + 1..] {
            if (ends[j][1] - ends[i][1]).f64() > tolerance {
                break;
            }
            if (ends[j][0] - ends[i][0]).f64().abs() <= tolerance {
                clusters.join(i, j);
            }
        }
    }
}

/// Roots of the clusters that an odd number of ends belong to.
fn odd_vertices(ends: usize, clusters: &mut Clusters) -> std::collections::BTreeSet<usize> {
    let mut odd = std::collections::BTreeSet::new();
    for k in 0..ends {
        let root = clusters.root(k);
        if !odd.remove(&root) {
            odd.insert(root);
        }
    }
    odd
}

/// The piece with its ends moved by a rounding; `None` where nothing is left of it.
fn between(piece: Piece, start: [Dd; 2], end: [Dd; 2]) -> Option<Piece> {
    if start == end {
        return None;
    }
    if start == piece.start() && end == piece.end() {
        return Some(piece);
    }
    Some(piece.with_ends(start, end))
}
