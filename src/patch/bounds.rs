//! How far a set of faces reaches along a direction.
//!
//! With t the largest n · X found so far, a piece X = A / W reaches no farther where the Bernstein
//! coefficients of h = n · A - t W are not above zero. Other pieces are halved along the parameter in
//! which h bends more; a ridge of equal heights stays in one piece along its length.
//!
//! * Accuracy: the answer is attained by a point of a face, up to the rounding of the halvings; no
//!   point reaches farther than 4 ε of the unit beyond it. A control point that is on the face and
//!   reaches farthest is met exactly.

use super::face_net::{Net, dot};
use super::face_tree::{PatchTree, SubPatch};
use smallvec::SmallVec;

/// What a piece may seem to reach beyond the answer.
const SLACK: f64 = 4.0 * f64::EPSILON;

/// Pieces looked at before the slack is let grow.
const PATIENCE: u32 = 1 << 14;

/// The largest n · x over the parts, all local; `n` with components up to 1.
pub(super) fn support(tree: &PatchTree, n: [f64; 3]) -> f64 {
    let mut best = f64::NEG_INFINITY;
    let (mut slack, mut visited) = (SLACK, 0_u32);
    let corner = |min: [f64; 3], max: [f64; 3]| -> f64 {
        (0..3)
            .map(|c| {
                if n[c] < 0.0 {
                    n[c] * min[c]
                } else {
                    n[c] * max[c]
                }
            })
            .sum()
    };
    tree.visit_best_first(
        |b| -corner(b.min, b.max),
        f64::INFINITY,
        |index| {
            raise(&tree.parts[index], n, &mut best, &mut slack, &mut visited);
            -(best + slack)
        },
    );
    best
}

fn raise(part: &SubPatch, n: [f64; 3], best: &mut f64, slack: &mut f64, visited: &mut u32) {
    let base = dot(n, part.origin);
    let [p, q] = part.net.degrees;
    // The first channel is the height above the part's origin, the last the weight.
    let heights = part
        .net
        .map(|&x| [dot(n, [x[0], x[1], x[2]]), 0.0, 0.0, x[3]]);
    let mut work: SmallVec<[(Net, [f64; 2]); 4]> = SmallVec::new();
    work.push((heights, [1.0; 2]));
    while let Some((net, sides)) = work.pop() {
        *visited += 1;
        if visited.is_multiple_of(PATIENCE) {
            *slack *= 2.0;
        }
        for (i, j) in [(0, 0), (p, 0), (0, q), (p, q)] {
            let x = net.points[net.at(i, j)];
            *best = best.max(base + x[0] / x[3]);
        }
        let t = *best + *slack - base;
        let h = |i: usize, j: usize| {
            let x = net.points[net.at(i, j)];
            x[0] - t * x[3]
        };
        if (0..=q).all(|j| (0..=p).all(|i| h(i, j) <= 0.0)) {
            continue;
        }
        let mut bend = [0.0_f64; 2];
        for j in 0..=q {
            for i in 0..=p {
                if i >= 2 {
                    bend[0] = bend[0].max((h(i, j) - 2.0 * h(i - 1, j) + h(i - 2, j)).abs());
                }
                if j >= 2 {
                    bend[1] = bend[1].max((h(i, j) - 2.0 * h(i, j - 1) + h(i, j - 2)).abs());
                }
            }
        }
        let bent = usize::from(bend[1] > bend[0]);
        // A side that is used up leaves the other.
        let k = if sides[bent] < f64::EPSILON {
            1 - bent
        } else {
            bent
        };
        if sides[k] < f64::EPSILON {
            continue;
        }
        let (before, after) = net.split(k, 0.5);
        let mut sides = sides;
        sides[k] *= 0.5;
        let reach =
            |net: &Net| (net.points.iter()).fold(f64::NEG_INFINITY, |m, x| m.max(x[0] / x[3]));
        // The half that reaches farther goes on top.
        if reach(&before) < reach(&after) {
            work.push((before, sides));
            work.push((after, sides));
        } else {
            work.push((after, sides));
            work.push((before, sides));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::FaceSet;
    use super::super::face_testing::{
        Numbers, ball, bent, biquadratic, block, frustum, mapped, normal, polar, torus,
    };
    use crate::nurbs::NurbsVolume;
    use glam::DVec3;
    use std::f64::consts::TAU;

    fn faces(volume: &NurbsVolume) -> FaceSet {
        FaceSet::new(std::slice::from_ref(volume)).expect("faces")
    }

    fn close(found: DVec3, wanted: [f64; 3]) {
        let gap = (found - DVec3::from_array(wanted)).abs().max_element();
        assert!(gap <= 2.0 * f64::EPSILON, "{found} for {wanted:?}");
    }

    #[test]
    fn boxes_of_round_solids_are_exact() {
        for disc in [biquadratic(), polar(TAU)] {
            let bounds = faces(&frustum(1.0, 1.0, 1.0, &disc))
                .bounds()
                .expect("faces");
            close(bounds.min, [-1.0, -1.0, 0.0]);
            close(bounds.max, [1.0, 1.0, 1.0]);
            let bounds = faces(&ball(1.0, &disc)).bounds().expect("faces");
            close(bounds.min, [-1.0; 3]);
            close(bounds.max, [1.0; 3]);
        }
        let bounds = faces(&torus(0.5, 0.25, TAU)).bounds().expect("faces");
        close(bounds.min, [-0.75, -0.75, -0.25]);
        close(bounds.max, [0.75, 0.75, 0.25]);
        // A quarter of a turn less a little: the arc ends before the y axis.
        let bounds = faces(&frustum(1.0, 1.0, 1.0, &polar(1.0)))
            .bounds()
            .expect("faces");
        close(bounds.min, [0.0; 3]);
        close(bounds.max, [1.0, 1f64.sin(), 1.0]);
        let bounds = faces(&block([1e6, 2.0, 3.0], [1e6 + 1.0, 3.0, 5.0]))
            .bounds()
            .expect("faces");
        assert_eq!(bounds.min, DVec3::new(1e6, 2.0, 3.0));
        assert_eq!(bounds.max, DVec3::new(1e6 + 1.0, 3.0, 5.0));
        assert!(FaceSet::new(&[]).expect("nothing").bounds().is_none());
    }

    #[test]
    fn support_of_tilted_solids() {
        let mut numbers = Numbers(5);
        let ball = faces(&ball(1.0, &biquadratic()));
        let cylinder = faces(&frustum(1.0, 1.0, 1.0, &polar(TAU)));
        let torus = faces(&torus(1.0, 0.4, TAU));
        for _ in 0..40 {
            let n = numbers.point(-1.0, 1.0);
            let flat = n.x.hypot(n.y);
            for (faces, wanted) in [
                (&ball, n.length()),
                (&cylinder, flat + n.z.max(0.0)),
                (&torus, flat + 0.4 * n.length()),
            ] {
                let found = faces.support(n);
                assert!(
                    (found - wanted).abs() <= 8e-15,
                    "{found} for {wanted} along {n}"
                );
            }
        }
        assert_eq!(ball.support(DVec3::ZERO), 0.0);
    }

    #[test]
    fn support_of_bent_blocks() {
        for seed in 0..4 {
            let mut numbers = Numbers(seed);
            let by: Vec<f64> = (0..108)
                .map(|_| numbers.next().expect("endless") * 0.5 - 0.25)
                .collect();
            let volume = bent(&by);
            let faces = faces(&volume);
            let n = numbers.point(-1.0, 1.0);
            let found = faces.support(n);
            let mut most = f64::NEG_INFINITY;
            for face in faces.faces() {
                for i in 0..=100 {
                    for j in 0..=100 {
                        let x = normal(face, [f64::from(i) / 100.0, f64::from(j) / 100.0]).0;
                        most = most.max(n.dot(x));
                    }
                }
            }
            // Points 1/200 off in the parameters are lower by second order at most.
            assert!(
                found >= most - 1e-15 && found <= most + 2e-3,
                "{found} {most}"
            );
            let far = self::faces(&mapped(&volume, |p| p.map(|x| 1e3 * x)));
            assert!((far.support(n) - 1e3 * found).abs() <= 1e-11);
        }
    }
}
