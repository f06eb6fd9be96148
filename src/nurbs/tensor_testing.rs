//! Surfaces and volumes shared by the tests of this folder, and evaluation by the definition.

use super::testing::knot_vectors;
use super::{KnotVector, NurbsSurface, NurbsTensor, NurbsVolume};
use proptest::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2 as S;

/// A parameter from a fraction of the domain; 0 and 1 give the ends.
pub(super) fn inside<const N: usize>(map: &NurbsTensor<N>, t: [f64; N]) -> [f64; N] {
    let domain = map.domain();
    std::array::from_fn(|k| {
        let (a, b) = domain[k];
        (a + (b - a) * t[k]).clamp(a, b)
    })
}

/// The largest absolute coordinate of the control points.
pub(super) fn extent<const N: usize>(map: &NurbsTensor<N>) -> f64 {
    let (low, high) = map.control_bounds();
    low.iter().chain(&high).fold(0.0, |m, x| x.abs().max(m))
}

/// N_{i,p}(u) by the recursion, 0/0 being 0 and the last span closed.
fn basis(knots: &[f64], last: usize, i: usize, p: usize, u: f64) -> f64 {
    if p == 0 {
        let closed = i == last && u >= knots[last + 1];
        return f64::from(u8::from((knots[i] <= u && u < knots[i + 1]) || closed));
    }
    let part = |top: f64, bottom: f64, value: f64| {
        if bottom == 0.0 {
            0.0
        } else {
            top / bottom * value
        }
    };
    part(
        u - knots[i],
        knots[i + p] - knots[i],
        basis(knots, last, i, p - 1, u),
    ) + part(
        knots[i + p + 1] - u,
        knots[i + p + 1] - knots[i + 1],
        basis(knots, last, i + 1, p - 1, u),
    )
}

/// The point by the definition: every basis function by recursion, every control point summed.
pub(super) fn by_definition<const N: usize>(map: &NurbsTensor<N>, at: [f64; N]) -> [f64; 3] {
    let rows: Vec<Vec<f64>> = (map.knots().iter().zip(at))
        .map(|(knots, u)| {
            let last = knots.spans().last().expect("a span").index;
            (0..knots.control_points())
                .map(|i| basis(knots.knots(), last, i, knots.degree(), u))
                .collect()
        })
        .collect();
    let counts = map.counts();
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for (mut place, (point, w)) in map.control_points().iter().zip(map.weights()).enumerate() {
        let mut factor = *w;
        for k in 0..N {
            factor *= rows[k][place % counts[k]];
            place /= counts[k];
        }
        weight += factor;
        for i in 0..3 {
            sum[i] += factor * point[i];
        }
    }
    sum.map(|x| x / weight)
}

/// Surfaces and volumes of degrees 1 to 3, weights from 0.1 to 10, knots of any kind.
pub(super) fn maps<const N: usize>() -> impl Strategy<Value = NurbsTensor<N>> {
    let knots: [_; N] = std::array::from_fn(|_| knot_vectors(1..=3));
    (Vec::from(knots), any::<u64>()).prop_map(|(knots, seed)| {
        let knots: [KnotVector; N] = knots.try_into().expect("as many");
        let count = knots.iter().map(KnotVector::control_points).product();
        let mut state = seed | 1;
        let mut random = || {
            // Marsaglia's xorshift; the top bits.
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let points = (0..count)
            .map(|_| [0.0; 3].map(|_| 20.0 * random() - 10.0))
            .collect();
        let weights = (0..count)
            .map(|_| 10_f64.powf(2.0 * random() - 1.0))
            .collect();
        NurbsTensor::new(knots, points, weights).expect("valid")
    })
}

/// (r, z) and weight.
pub(super) type Meridian = ([f64; 2], f64);

/// Planar control points (x, y) with weights of a disc, its centre at the origin.
pub(super) struct Disc {
    pub(super) knots: [KnotVector; 2],
    pub(super) points: Vec<([f64; 2], f64)>,
}

/// The 9-point circle.
pub(super) fn circle() -> Vec<([f64; 2], f64)> {
    let on = [
        [1., 0.],
        [1., 1.],
        [0., 1.],
        [-1., 1.],
        [-1., 0.],
        [-1., -1.],
        [0., -1.],
        [1., -1.],
        [1., 0.],
    ];
    (on.into_iter().enumerate())
        .map(|(i, p)| (p, if i % 2 == 0 { 1.0 } else { S }))
        .collect()
}

pub(super) fn circle_knots() -> KnotVector {
    let knots = [0., 0., 0., 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1., 1., 1.];
    KnotVector::new(2, knots.to_vec()).expect("valid")
}

/// The biquadratic unit disc.
pub(super) fn biquadratic() -> Disc {
    let rows = [
        ([-S, -S], 1.0),
        ([0.0, -2.0 * S], S),
        ([S, -S], 1.0),
        ([-2.0 * S, 0.0], S),
        ([0.0, 0.0], 1.0),
        ([2.0 * S, 0.0], S),
        ([-S, S], 1.0),
        ([0.0, 2.0 * S], S),
        ([S, S], 1.0),
    ];
    let knots = || KnotVector::bezier(2).expect("valid");
    Disc {
        knots: [knots(), knots()],
        points: rows.to_vec(),
    }
}

/// The polar unit disc: radius, then angle.
pub(super) fn polar() -> Disc {
    let rim = circle();
    let points = rim.iter().flat_map(|&(p, w)| [([0.0; 2], w), (p, w)]);
    Disc {
        knots: [KnotVector::bezier(1).expect("valid"), circle_knots()],
        points: points.collect(),
    }
}

/// The volume of a meridian curve (r, z) times a disc: parameters (u, a, b).
pub(super) fn turned(knots: &KnotVector, meridian: &[Meridian], disc: &Disc) -> NurbsVolume {
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for &(d, q) in &disc.points {
        for &([r, z], w) in meridian {
            points.push([r * d[0], r * d[1], z]);
            weights.push(w * q);
        }
    }
    let [a, b] = disc.knots.clone();
    NurbsVolume::new([knots.clone(), a, b], points, weights).expect("valid")
}

/// The sphere of radius `radius`, z increasing.
pub(super) fn sphere(radius: f64, disc: &Disc) -> NurbsVolume {
    let knots = KnotVector::new(2, vec![0., 0., 0., 0.5, 0.5, 1., 1., 1.]).expect("valid");
    let r = radius;
    let meridian = [
        ([0.0, -r], 1.0),
        ([r, -r], S),
        ([r, 0.0], 1.0),
        ([r, r], S),
        ([0.0, r], 1.0),
    ];
    turned(&knots, &meridian, disc)
}

/// The torus of radii R and r about z: the biquadratic disc times the circle, as MATH's case b.
pub(super) fn torus(big: f64, small: f64) -> NurbsVolume {
    let disc = biquadratic();
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for (c, q) in circle() {
        // The first index along z: the disc transposed.
        for place in 0..9 {
            let (d, w) = disc.points[place / 3 + 3 * (place % 3)];
            let r = big + small * d[0];
            points.push([r * c[0], r * c[1], small * d[1]]);
            weights.push(w * q);
        }
    }
    let [a, b] = disc.knots;
    NurbsVolume::new([a, b, circle_knots()], points, weights).expect("valid")
}

/// The octant of the unit sphere over the unit square, degree 2 x 2, in closed form
/// ((1-u²)(1-v²), 2(1-u²)v, 2u(1+v²)) / ((1+u²)(1+v²)).
pub(super) fn octant() -> NurbsSurface {
    // Bernstein coefficients of 1 - t², 2 t, 1 + t².
    let (minus, twice, plus) = ([1.0, 1.0, 0.0], [0.0, 1.0, 2.0], [1.0, 1.0, 2.0]);
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for j in 0..3 {
        for i in 0..3 {
            let w = plus[i] * plus[j];
            let a = [minus[i] * minus[j], minus[i] * twice[j], twice[i] * plus[j]];
            points.push(a.map(|x| x / w));
            weights.push(w);
        }
    }
    let knots = || KnotVector::bezier(2).expect("valid");
    NurbsSurface::new([knots(), knots()], points, weights).expect("valid")
}

/// Cosine- and sine-like functions of t = tan(φ/2) with two derivatives.
pub(super) fn turn(t: f64) -> [[f64; 3]; 2] {
    let q = 1.0 + t * t;
    [
        [
            (1.0 - t * t) / q,
            -4.0 * t / (q * q),
            (12.0 * t * t - 4.0) / q.powi(3),
        ],
        [
            2.0 * t / q,
            2.0 * (1.0 - t * t) / (q * q),
            (4.0 * t.powi(3) - 12.0 * t) / q.powi(3),
        ],
    ]
}
