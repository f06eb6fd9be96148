//! Volumes for tests: blocks, and solids of revolution as products of a curve or a surface with a
//! disc or a circle.

use crate::nurbs::{KnotVector, NurbsVolume};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, TAU};

/// Two coordinates and a weight.
type Flat = ([f64; 2], f64);

/// A planar net: knot vectors and points, the first index fastest.
pub(super) struct Disc {
    knots: [KnotVector; 2],
    points: Vec<Flat>,
}

fn bezier(degree: usize) -> KnotVector {
    KnotVector::bezier(degree).expect("a degree")
}

fn knots(degree: usize, knots: &[f64]) -> KnotVector {
    KnotVector::new(degree, knots.to_vec()).expect("knots")
}

/// An arc of the unit circle from angle 0, over [0, 1].
fn arc(angle: f64) -> (KnotVector, Vec<Flat>) {
    let k = (angle / FRAC_PI_2 - 1e-9).ceil().max(1.0) as usize;
    let step = angle / k as f64;
    let mut points = Vec::new();
    for i in 0..=2 * k {
        let a = 0.5 * step * i as f64;
        let (weight, radius) = if i % 2 == 0 {
            (1.0, 1.0)
        } else {
            ((0.5 * step).cos(), 1.0 / (0.5 * step).cos())
        };
        // Multiples of a right angle, and of half of one, are exact.
        let snap = |x: f64| {
            if x.abs() < 1e-15 {
                0.0
            } else if (x.abs() - 1.0).abs() < 1e-15 {
                x.signum()
            } else {
                x
            }
        };
        points.push(([snap(radius * a.cos()), snap(radius * a.sin())], weight));
    }
    let mut list = vec![0.0; 3];
    for i in 1..k {
        list.extend([i as f64 / k as f64; 2]);
    }
    list.extend([1.0; 3]);
    if (angle - TAU).abs() < 1e-12 {
        let first = points[0];
        points[2 * k] = first;
    }
    (knots(2, &list), points)
}

/// The biquadratic unit disc with its corner at (1, 0).
pub(super) fn biquadratic() -> Disc {
    let s = FRAC_1_SQRT_2;
    let flat = [
        [-s, -s],
        [0.0, -2.0 * s],
        [s, -s],
        [-2.0 * s, 0.0],
        [0.0, 0.0],
        [2.0 * s, 0.0],
        [-s, s],
        [0.0, 2.0 * s],
        [s, s],
    ];
    let weights = [1.0, s, 1.0, s, 1.0, s, 1.0, s, 1.0];
    // Times (-s, s): a turn by 135 degrees.
    let turn = |[x, y]: [f64; 2]| [-s * x - s * y, s * x - s * y];
    Disc {
        knots: [bezier(2), bezier(2)],
        points: flat.into_iter().map(turn).zip(weights).collect(),
    }
}

/// The unit disc, or a sector of it, with rays as the first parameter.
pub(super) fn polar(angle: f64) -> Disc {
    let (circle, rim) = arc(angle);
    let points = rim
        .iter()
        .flat_map(|&(x, w)| [([0.0; 2], w), (x, w)])
        .collect();
    Disc {
        knots: [bezier(1), circle],
        points,
    }
}

/// A meridian (r, z) times a disc: the solid between it and the axis.
pub(super) fn turned(curve: &KnotVector, meridian: &[Flat], disc: &Disc) -> NurbsVolume {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for &(d, q) in &disc.points {
        for &([r, z], w) in meridian {
            points.push([r * d[0], r * d[1], z]);
            weights.push(w * q);
        }
    }
    let [a, b] = disc.knots.clone();
    NurbsVolume::new([curve.clone(), a, b], points, weights).expect("a solid")
}

/// A cylinder or a truncated cone from z = 0 to `height`.
pub(super) fn frustum(low: f64, high: f64, height: f64, disc: &Disc) -> NurbsVolume {
    turned(
        &bezier(1),
        &[([low, 0.0], 1.0), ([high, height], 1.0)],
        disc,
    )
}

/// A ball about the origin.
pub(super) fn ball(radius: f64, disc: &Disc) -> NurbsVolume {
    let (r, s) = (radius, FRAC_1_SQRT_2);
    turned(
        &knots(2, &[0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0]),
        &[
            ([0.0, -r], 1.0),
            ([r, -r], s),
            ([r, 0.0], 1.0),
            ([r, r], s),
            ([0.0, r], 1.0),
        ],
        disc,
    )
}

/// A torus about the z axis, or a part of it: the biquadratic disc times an arc.
pub(super) fn torus(large: f64, small: f64, angle: f64) -> NurbsVolume {
    let disc = biquadratic();
    let (circle, rim) = arc(angle);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for &(c, q) in &rim {
        for &(d, w) in &disc.points {
            let r = large + small * d[0];
            points.push([r * c[0], r * c[1], small * d[1]]);
            weights.push(w * q);
        }
    }
    let [a, b] = disc.knots;
    NurbsVolume::new([a, b, circle], points, weights).expect("a torus")
}

/// The box between two corners, trilinear.
pub(super) fn block(low: [f64; 3], high: [f64; 3]) -> NurbsVolume {
    let points =
        (0..8).map(|i| std::array::from_fn(|c| if i >> c & 1 == 0 { low[c] } else { high[c] }));
    NurbsVolume::new(
        [bezier(1), bezier(1), bezier(1)],
        points.collect(),
        vec![1.0; 8],
    )
    .expect("a box")
}

/// A cube of 3 x 3 x 3 control points, each moved by a part of `by` and weighted.
pub(super) fn bent(by: &[f64]) -> NurbsVolume {
    let part = |i: usize| by[i % by.len()];
    let points = (0..27).map(|i| {
        let at = [i % 3, i / 3 % 3, i / 9];
        std::array::from_fn(|c| at[c] as f64 + part(3 * i + c))
    });
    let weights = (0..27).map(|i| 1.0 + part(81 + i)).collect();
    NurbsVolume::new([bezier(2), bezier(2), bezier(2)], points.collect(), weights).expect("a block")
}

/// The volume with every control point mapped.
pub(super) fn mapped(volume: &NurbsVolume, f: impl Fn([f64; 3]) -> [f64; 3]) -> NurbsVolume {
    let points = volume.control_points().iter().map(|&p| f(p)).collect();
    NurbsVolume::new(volume.knots().clone(), points, volume.weights().to_vec()).expect("mapped")
}

/// The volume with its parameters in another order, those in `reversed` backwards.
pub(super) fn laid(volume: &NurbsVolume, order: [usize; 3], reversed: [bool; 3]) -> NurbsVolume {
    let counts = volume.counts();
    let new_counts = order.map(|k| counts[k]);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for place in 0..counts.iter().product() {
        let index = [
            place % new_counts[0],
            place / new_counts[0] % new_counts[1],
            place / (new_counts[0] * new_counts[1]),
        ];
        let mut old = [0; 3];
        for k in 0..3 {
            old[order[k]] = if reversed[k] {
                new_counts[k] - 1 - index[k]
            } else {
                index[k]
            };
        }
        let from = old[0] + counts[0] * (old[1] + counts[1] * old[2]);
        points.push(volume.control_points()[from]);
        weights.push(volume.weights()[from]);
    }
    let knots = [0, 1, 2].map(|k| {
        let knots = &volume.knots()[order[k]];
        if reversed[k] {
            knots.reversed().expect("reversed")
        } else {
            knots.clone()
        }
    });
    NurbsVolume::new(knots, points, weights).expect("laid")
}

/// A sequence of numbers in [0, 1) without patterns.
pub(super) struct Numbers(pub(super) u64);

impl Iterator for Numbers {
    type Item = f64;
    fn next(&mut self) -> Option<f64> {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Some(((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

impl Numbers {
    pub(super) fn point(&mut self, low: f64, high: f64) -> glam::DVec3 {
        let mut x = || low + (high - low) * self.next().expect("endless");
        glam::DVec3::new(x(), x(), x())
    }
}

fn net_of(face: &super::OuterFace) -> super::face_net::Net {
    let points = face.surface.control_points().iter();
    super::face_net::Net {
        degrees: face.surface.degrees(),
        points: points
            .map(|h| [h.weighted[0], h.weighted[1], h.weighted[2], h.weight])
            .collect(),
    }
}

/// A point of a face and X_u × X_v there.
pub(super) fn normal(face: &super::OuterFace, at: [f64; 2]) -> (glam::DVec3, glam::DVec3) {
    let jet = net_of(face).jet(at[0], at[1]);
    let vector = |p: [f64; 4]| glam::DVec3::new(p[0], p[1], p[2]);
    let w = jet.value[3];
    let x = vector(jet.value) / w;
    let slope = |d: [f64; 4]| (vector(d) - x * d[3]) / w;
    (x, slope(jet.u).cross(slope(jet.v)))
}

/// The area of a face, by Gauss's rule of three points on a grid of squares.
pub(super) fn area(face: &super::OuterFace) -> f64 {
    const PARTS: usize = 8;
    let rule = [
        (0.112_701_665_379_258_3, 5.0 / 18.0),
        (0.5, 4.0 / 9.0),
        (0.887_298_334_620_741_7, 5.0 / 18.0),
    ];
    let mut sum = 0.0;
    for i in 0..PARTS {
        for j in 0..PARTS {
            for (u, a) in rule {
                for (v, b) in rule {
                    let at = [(i as f64 + u) / PARTS as f64, (j as f64 + v) / PARTS as f64];
                    sum += a * b * normal(face, at).1.length();
                }
            }
        }
    }
    sum / (PARTS * PARTS) as f64
}
