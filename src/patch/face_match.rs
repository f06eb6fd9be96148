//! Faces that two cells share drop out in pairs.
//!
//! Two pieces are the same when, after raising degrees to a common pair, their homogeneous control
//! points agree up to one factor in one of the eight orders of a square net. That is a statement
//! about maps, not only about point sets, and needs no sampling.
//!
//! Pieces whose knots do not match are the same map on a common part when that part is a rectangle
//! in the parameters of both. Its corners are corners of one piece or the other, so each piece is
//! cut at the parameters of the other's corners and the parts are compared.
//!
//! The solid must lie on opposite sides of the two: volumes that overlap and have a face in common on
//! the same side (a patch given twice, say) are both bounded by it.
//!
//! * Accuracy: points to [`tolerance`](super::shared::tolerance), weights to the same share; where to
//!   cut is proposed more generously, within [`COINCIDE`].
//! * Cost: pieces are compared when their corners' sums, or their boxes, meet; boxes are swept along
//!   the longest side of all.

use super::distance::locate;
use super::face::{COINCIDE, Face};
use super::face_net::{Net, cartesian, length, minus};
use super::face_tree::PatchTree;
use smallvec::SmallVec;

/// Faces without those that coincide with another, points to `tolerance` units.
pub(super) fn pair_off(faces: Vec<Face>, tolerance: f64) -> Vec<Face> {
    cut_and_pair(drop_equal(faces, tolerance), tolerance)
}

fn corners(net: &Net) -> [[f64; 3]; 4] {
    let [p, q] = net.degrees;
    [(0, 0), (p, 0), (0, q), (p, q)].map(|(i, j)| cartesian(net.points[net.at(i, j)]))
}

fn coincide(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    length(minus(a, b)) <= tolerance
}

/// Drops pairs of equal faces.
fn drop_equal(faces: Vec<Face>, tolerance: f64) -> Vec<Face> {
    /// A direction in which different faces rarely tie.
    const MIX: [f64; 3] = [0.618_033_988, 0.414_213_562, 0.324_717_957];
    let mut keys: Vec<(f64, usize)> = (faces.iter().enumerate())
        .map(|(index, face)| {
            let mut key = 0.0;
            for x in corners(&face.net) {
                key += (0..3).map(|c| x[c] * MIX[c]).sum::<f64>();
            }
            (key, index)
        })
        .collect();
    keys.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut dropped = vec![false; faces.len()];
    for (place, &(key, index)) in keys.iter().enumerate() {
        if dropped[index] {
            continue;
        }
        // Four corners, each off by the tolerance at most, and the rounding of their sum.
        let most = 8.0 * tolerance + 64.0 * f64::EPSILON;
        let near = keys[place + 1..]
            .iter()
            .take_while(|(other, _)| other - key <= most);
        for &(_, other) in near {
            if !dropped[other] && meet(&faces[index], &faces[other], tolerance) {
                (dropped[index], dropped[other]) = (true, true);
                break;
            }
        }
    }
    keep(faces, &dropped)
}

fn keep(faces: Vec<Face>, dropped: &[bool]) -> Vec<Face> {
    let pairs = faces.into_iter().zip(dropped);
    pairs
        .filter(|(_, dropped)| !**dropped)
        .map(|(face, _)| face)
        .collect()
}

/// Whether two faces are one surface with the solid on opposite sides of it.
fn meet(a: &Face, b: &Face, tolerance: f64) -> bool {
    let ways = (0..8_u8).filter(|way| {
        // Each exchange and each reversal of parameters turns the normal round. A face of what is
        // flat throughout has no side.
        let turned = if way.count_ones() % 2 == 0 { 1 } else { -1 };
        a.outward * b.outward * turned <= 0
    });
    is_same(&a.net, &b.net, ways, tolerance)
}

/// Whether two nets are one surface in one of the `ways` to lay the parameters, up to a factor of the
/// weights.
fn is_same(a: &Net, b: &Net, ways: impl Iterator<Item = u8>, tolerance: f64) -> bool {
    let ends = corners(a);
    for way in ways {
        // Corners first: they rule out nearly every way.
        let from = corners(b);
        let laid = |i: usize, j: usize| {
            let (mut i, mut j) = (i, j);
            if way & 2 != 0 {
                i = 1 - i;
            }
            if way & 4 != 0 {
                j = 1 - j;
            }
            if way & 1 == 0 { i + 2 * j } else { j + 2 * i }
        };
        let fits = |i: usize, j: usize| coincide(ends[i + 2 * j], from[laid(i, j)], tolerance);
        if !(fits(0, 0) && fits(1, 0) && fits(0, 1) && fits(1, 1)) {
            continue;
        }
        let b = b.laid(way);
        let degrees = [0, 1].map(|k| a.degrees[k].max(b.degrees[k]));
        let (a, b) = (a.elevated(degrees), b.elevated(degrees));
        let factor = b.points[0][3] / a.points[0][3];
        let same = a.points.iter().zip(&b.points).all(|(&p, &q)| {
            (q[3] - factor * p[3]).abs() <= tolerance * q[3]
                && coincide(cartesian(p), cartesian(q), tolerance)
        });
        if same {
            return true;
        }
    }
    false
}

/// A face with what is needed to find points on it, made when first asked for.
struct Candidate {
    face: Face,
    /// Which of the faces given it is, or is a part of.
    origin: usize,
    whole: bool,
    low: [f64; 3],
    high: [f64; 3],
    tree: Option<PatchTree>,
}

impl Candidate {
    fn new(face: Face, origin: usize, whole: bool) -> Self {
        let (low, high) = face.net.bounds();
        Self {
            face,
            origin,
            whole,
            low,
            high,
            tree: None,
        }
    }

    /// Whether the boxes around the control points meet.
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|c| {
            self.low[c] <= other.high[c] + COINCIDE && other.low[c] <= self.high[c] + COINCIDE
        })
    }

    /// Inner parameters at which corners of `other` lie on this face.
    fn cuts(&mut self, other: &Net) -> [Cuts; 2] {
        /// Nearer to an edge of the face than this, a cut would part nothing.
        const EDGE: f64 = 1e-9;
        let mut cuts = [Cuts::new(), Cuts::new()];
        let own = corners(&self.face.net);
        for corner in corners(other) {
            let outside = (0..3)
                .any(|c| corner[c] < self.low[c] - COINCIDE || corner[c] > self.high[c] + COINCIDE);
            if outside || own.iter().any(|&x| coincide(x, corner, COINCIDE)) {
                continue;
            }
            let face = &self.face.net;
            let tree = self
                .tree
                .get_or_insert_with(|| PatchTree::new([face].into_iter()));
            let Some(at) = locate(tree, corner, COINCIDE) else {
                continue;
            };
            for k in 0..2 {
                let known = cuts[k].iter().any(|c| (c - at[k]).abs() < EDGE);
                if at[k] > EDGE && at[k] < 1.0 - EDGE && !known {
                    cuts[k].push(at[k]);
                }
            }
        }
        for list in &mut cuts {
            list.sort_unstable_by(f64::total_cmp);
        }
        cuts
    }

    /// The face cut at the parameters.
    fn parts(&self, cuts: &[Cuts; 2]) -> Vec<Face> {
        let steps = cuts.each_ref().map(|list| {
            let mut steps = vec![0.0];
            steps.extend(list.iter().copied());
            steps.push(1.0);
            steps
        });
        let mut parts = Vec::new();
        for v in steps[1].windows(2) {
            for u in steps[0].windows(2) {
                parts.push(self.face.part([u[0], v[0]], [u[1], v[1]]));
            }
        }
        parts
    }
}

type Cuts = SmallVec<[f64; 4]>;

/// Cuts faces that share a part with another and drops those parts.
fn cut_and_pair(faces: Vec<Face>, tolerance: f64) -> Vec<Face> {
    let mut waiting: Vec<Candidate> = (faces.into_iter().enumerate())
        .map(|(origin, face)| Candidate::new(face, origin, true))
        .collect();
    let near = neighbours(&waiting);
    waiting.reverse();
    let mut done: Vec<Option<Candidate>> = Vec::new();
    // Places in `done` of what is left of each face.
    let mut left: Vec<SmallVec<[usize; 1]>> = vec![SmallVec::new(); waiting.len()];
    // Each success removes a common part of two faces, so there is an end; this many bounds it
    // against parts that rounding keeps producing.
    let mut budget = 16 * waiting.len() + 256;
    let mut others: Vec<usize> = Vec::new();
    'next: while let Some(mut one) = waiting.pop() {
        others.clear();
        let around = near[one.origin].iter().chain([&one.origin]);
        others.extend(around.flat_map(|&origin| &left[origin]));
        others.sort_unstable();
        for &index in &others {
            let Some(other) = &mut done[index] else {
                continue;
            };
            if budget == 0 || !one.meets(other) {
                continue;
            }
            let (ours, theirs) = (one.cuts(&other.face.net), other.cuts(&one.face.net));
            let uncut = |cuts: &[Cuts; 2]| cuts.iter().all(Cuts::is_empty);
            if one.whole && other.whole && uncut(&ours) && uncut(&theirs) {
                // They have been compared.
                continue;
            }
            // Where nothing is cut the parts are the faces themselves: cutting others may have made
            // them equal.
            let (a, b) = (one.parts(&ours), other.parts(&theirs));
            let mut gone = [vec![false; a.len()], vec![false; b.len()]];
            for i in 0..a.len() {
                let equal = (0..b.len()).find(|&j| !gone[1][j] && meet(&a[i], &b[j], tolerance));
                if let Some(j) = equal {
                    (gone[0][i], gone[1][j]) = (true, true);
                }
            }
            if gone[0].contains(&true) {
                budget -= 1;
                let origin = other.origin;
                done[index] = None;
                left[origin].retain(|i| *i != index);
                let part = |origin| move |face| Candidate::new(face, origin, false);
                waiting.extend(keep(b, &gone[1]).into_iter().map(part(origin)));
                waiting.extend(keep(a, &gone[0]).into_iter().map(part(one.origin)));
                continue 'next;
            }
        }
        left[one.origin].push(done.len());
        done.push(Some(one));
    }
    let done = done.into_iter().flatten();
    done.map(|candidate| candidate.face).collect()
}

/// For each face the others whose boxes meet its own.
fn neighbours(faces: &[Candidate]) -> Vec<Vec<usize>> {
    let extent = |k: usize| {
        let low = faces.iter().fold(f64::INFINITY, |m, f| m.min(f.low[k]));
        let high = (faces.iter()).fold(f64::NEG_INFINITY, |m, f| m.max(f.high[k]));
        high - low
    };
    let axis = (1..3).fold(0, |a, b| if extent(b) > extent(a) { b } else { a });
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&a, &b| faces[a].low[axis].total_cmp(&faces[b].low[axis]));
    let mut near = vec![Vec::new(); faces.len()];
    for (place, &a) in order.iter().enumerate() {
        let end = faces[a].high[axis] + COINCIDE;
        let after = order[place + 1..].iter();
        for &b in after.take_while(|&&b| faces[b].low[axis] <= end) {
            if faces[a].meets(&faces[b]) {
                near[a].push(b);
                near[b].push(a);
            }
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::super::face_testing::{
        area, ball, bent, biquadratic, block, frustum, laid, mapped, polar, torus,
    };
    use super::super::{FaceSet, outer_faces};
    use crate::nurbs::NurbsVolume;
    use glam::DVec3;
    use std::f64::consts::{PI, TAU};

    fn count(patches: &[NurbsVolume]) -> usize {
        outer_faces(patches).expect("faces").len()
    }

    /// Sum of the areas of the outer faces.
    fn total(patches: &[NurbsVolume]) -> f64 {
        outer_faces(patches).expect("faces").iter().map(area).sum()
    }

    #[test]
    fn seams_axes_and_poles_are_not_faces() {
        assert_eq!(count(&[frustum(1.0, 1.0, 1.0, &biquadratic())]), 6);
        assert_eq!(count(&[frustum(1.0, 1.0, 1.0, &polar(TAU))]), 12);
        // A cone's tip is a point.
        assert_eq!(count(&[frustum(1.0, 0.0, 1.0, &polar(TAU))]), 8);
        // A quarter has two flat faces through the axis.
        assert_eq!(count(&[frustum(1.0, 1.0, 1.0, &polar(TAU / 4.0))]), 5);
        assert_eq!(count(&[ball(1.0, &biquadratic())]), 8);
        assert_eq!(count(&[ball(1.0, &polar(TAU))]), 8);
        assert_eq!(count(&[torus(1.0, 0.4, TAU)]), 16);
        assert_eq!(count(&[torus(1.0, 0.4, PI)]), 10);
        let areas = [
            (frustum(1.0, 1.0, 1.0, &biquadratic()), 4.0 * PI),
            (
                frustum(1.0, 0.0, 1.0, &polar(TAU)),
                PI * (1.0 + 2f64.sqrt()),
            ),
            (ball(1.0, &polar(TAU)), 4.0 * PI),
            (torus(1.0, 0.4, TAU), 4.0 * PI * PI * 0.4),
            (torus(1.0, 0.4, PI), 2.0 * PI * PI * 0.4 + 2.0 * PI * 0.16),
        ];
        for (volume, wanted) in areas {
            let found = total(&[volume]);
            assert!((found - wanted).abs() < 1e-7, "{found} for {wanted}");
        }
    }

    #[test]
    fn faces_point_outward() {
        let middle = |face: &super::super::OuterFace| {
            let (x, n) = super::super::face_testing::normal(face, [0.4, 0.6]);
            (x, n * f64::from(face.outward))
        };
        let shapes = [
            block([-1.0; 3], [1.0; 3]),
            frustum(1.0, 1.0, 1.0, &biquadratic()),
            ball(1.0, &polar(TAU)),
            bent(&[0.0, 0.1, -0.1, 0.05, -0.07]),
        ];
        for (index, shape) in shapes.iter().enumerate() {
            for (order, reversed) in [
                ([0, 1, 2], [false; 3]),
                ([1, 0, 2], [false; 3]),
                ([2, 0, 1], [true, false, false]),
                ([0, 2, 1], [true, false, true]),
            ] {
                let volume = laid(shape, order, reversed);
                let inside = [DVec3::ZERO, DVec3::Z * 0.5, DVec3::ZERO, DVec3::ONE][index];
                for face in outer_faces(std::slice::from_ref(&volume)).expect("faces") {
                    let (x, n) = middle(&face);
                    // These are star-shaped about their middles.
                    assert!(n.dot(x - inside) > 0.0, "{index} {order:?} {face:?}");
                    let at = volume
                        .evaluate(face.volume_parameters([0.4, 0.6]))
                        .expect("inside");
                    assert!((DVec3::from_array(at) - x).length() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn neighbours_share_a_face_however_their_parameters_lie() {
        let right = block([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
        let left = block([0.0; 3], [1.0; 3]);
        for order in [
            [0, 1, 2],
            [1, 0, 2],
            [2, 1, 0],
            [1, 2, 0],
            [2, 0, 1],
            [0, 2, 1],
        ] {
            for bits in 0..8 {
                let reversed = [0, 1, 2].map(|k| bits >> k & 1 == 1);
                let right = laid(&right, order, reversed);
                assert_eq!(
                    count(&[left.clone(), right.clone()]),
                    10,
                    "{order:?} {bits}"
                );
            }
        }
        // Of degree two, at another weight, and far from the origin.
        let heavy = mapped(&bent(&[0.0]), |[x, y, z]| {
            [1e5 + 1.0 + 0.5 * x, 0.5 * y, 0.5 * z]
        });
        let near = block([1e5, 0.0, 0.0], [1e5 + 1.0, 1.0, 1.0]);
        let heavy = NurbsVolume::new(
            heavy.knots().clone(),
            heavy.control_points().to_vec(),
            vec![3.0; 27],
        )
        .expect("a cube");
        assert_eq!(count(&[near.clone(), heavy]), 10);
        // Not quite touching.
        let apart = block([1e5 + 1.000_001, 0.0, 0.0], [1e5 + 2.0, 1.0, 1.0]);
        assert_eq!(count(&[near, apart]), 12);
    }

    #[test]
    fn larger_faces_are_cut_by_smaller_ones() {
        // An L: its top is cut where the other block stands.
        let l = [
            block([0.0; 3], [2.0, 1.0, 1.0]),
            laid(
                &block([0.0, 0.0, 1.0], [1.0, 1.0, 2.0]),
                [2, 0, 1],
                [false, true, false],
            ),
        ];
        assert_eq!(count(&l), 11);
        assert!((total(&l) - 14.0).abs() < 1e-12);
        let faces = FaceSet::new(&l).expect("faces");
        let on_joint = faces.distance(DVec3::new(0.5, 0.5, 1.0), f64::INFINITY);
        assert!((on_joint - 0.5).abs() < 1e-14, "{on_joint}");

        // A block covered by three; and two by two that overlap like bricks.
        let covered = [
            block([0.0; 3], [3.0, 1.0, 1.0]),
            block([0.0, 0.0, 1.0], [0.7, 1.0, 2.0]),
            block([0.7, 0.0, 1.0], [2.1, 1.0, 2.0]),
            block([2.1, 0.0, 1.0], [3.0, 1.0, 2.0]),
        ];
        assert!(
            (total(&covered) - 22.0).abs() < 1e-11,
            "{}",
            total(&covered)
        );
        let bricks = [
            block([0.0; 3], [1.0, 1.0, 1.0]),
            block([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
            block([0.0, 0.0, 1.0], [1.3, 1.0, 2.0]),
            block([1.3, 0.0, 1.0], [2.0, 1.0, 2.0]),
        ];
        assert!((total(&bricks) - 16.0).abs() < 1e-11, "{}", total(&bricks));

        // A stud in the middle of a plate leaves eight parts of the plate's top.
        let stud = [
            block([0.0; 3], [3.0, 3.0, 1.0]),
            block([1.0, 1.2, 1.0], [2.0, 2.0, 1.5]),
        ];
        assert_eq!(count(&stud), 5 + 8 + 5);
        assert!((total(&stud) - (18.0 + 12.0 + 2.0 * 0.5 * 1.8)).abs() < 1e-11);
    }

    #[test]
    fn curved_faces_are_cut_too() {
        // A thin cylinder on a thick one: the ring around it stays.
        let up = |v: &NurbsVolume| mapped(v, |[x, y, z]| [x, y, z + 1.0]);
        let stack = [
            frustum(1.0, 1.0, 1.0, &polar(TAU)),
            up(&frustum(0.5, 0.5, 1.0, &polar(TAU))),
        ];
        assert_eq!(count(&stack), 4 + 4 + 4 + 4 + 4);
        let found = total(&stack);
        assert!((found - 5.0 * PI).abs() < 1e-7, "{found}");
        let faces = FaceSet::new(&stack).expect("faces");
        for z in [0.9, 1.0, 1.1] {
            let wanted = if z < 1.0 { 0.5_f64.hypot(1.0 - z) } else { 0.5 };
            let found = faces.distance(DVec3::new(0.0, 0.0, z), f64::INFINITY);
            assert!(
                (found - wanted).abs() < 1e-13,
                "{found} for {wanted} at {z}"
            );
        }
        // A quarter on a full turn: one of four sectors.
        let quarter = up(&frustum(1.0, 1.0, 1.0, &polar(TAU / 4.0)));
        assert_eq!(count(&[frustum(1.0, 1.0, 1.0, &polar(TAU)), quarter]), 15);
        // Two halves of a ring, one turned by half a turn.
        let half = torus(1.0, 0.4, PI);
        let other = mapped(&half, |[x, y, z]| [-x, -y, z]);
        assert_eq!(count(&[half, other]), 16);
    }
}
