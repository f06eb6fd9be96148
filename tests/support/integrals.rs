//! Measures of a solid in 256-bit floats, from the oracle's Bézier pieces alone.
//!
//! Gauss-Legendre rules of 32 points on each piece, halved until two levels agree to 1e-23 of the
//! profile. The loops must not cross: each is oriented by asking on which of its sides the region is.

use std::sync::LazyLock;

use super::oracle::{
    Big, Homogeneous, Piece, Region, Solid, big, cos_sin_degrees, dehomogenize, pi, small, sqrt,
};

/// What is measured, in world units.
#[derive(Debug)]
pub(crate) struct Exact {
    pub(crate) volume: Big,
    pub(crate) area: Big,
    pub(crate) centroid: [Big; 3],
    /// About the centroid, density 1.
    pub(crate) inertia: [[Big; 3]; 3],
}

/// Points of a rule.
const POINTS: i32 = 32;

/// Integrals over the region and along its boundary: ∬ 1, r, r², r³, r ζ, r² ζ, r ζ², and ∫ r ds.
const COUNT: usize = 8;
type Integrals = [Big; COUNT];

/// Nodes and weights on [0, 1].
static RULE: LazyLock<Vec<(Big, Big)>> = LazyLock::new(|| {
    let n = POINTS;
    let one = big(1.0);
    let node = |i: i32| {
        let mut x =
            big((std::f64::consts::PI * (f64::from(i) + 0.75) / (f64::from(n) + 0.5)).cos());
        let mut slope = one.clone();
        for _ in 0..7 {
            let (mut before, mut value) = (one.clone(), x.clone());
            for k in 2..=n {
                let k = f64::from(k);
                let next = (big(2.0 * k - 1.0) * &x * &value - big(k - 1.0) * &before) / big(k);
                before = value;
                value = next;
            }
            slope = big(f64::from(n)) * (&before - &x * &value) / (&one - &x * &x);
            x = &x - &value / &slope;
        }
        let weight = &one / ((&one - &x * &x) * &slope * &slope);
        ((&one + &x) / big(2.0), weight)
    };
    (0..n).map(node).collect()
});

/// The point and the derivative at `t`.
fn evaluate(piece: &Piece, t: &Big) -> ([Big; 2], [Big; 2]) {
    let s = big(1.0) - t;
    let mut p: Vec<Homogeneous> = piece.clone();
    while p.len() > 2 {
        for i in 0..p.len() - 1 {
            p[i] = std::array::from_fn(|c| &p[i][c] * &s + &p[i + 1][c] * t);
        }
        p.pop();
    }
    let degree = big((piece.len() - 1) as f64);
    let h: Homogeneous = std::array::from_fn(|c| &p[0][c] * &s + &p[1][c] * t);
    let d: Homogeneous = std::array::from_fn(|c| (&p[1][c] - &p[0][c]) * &degree);
    let point = dehomogenize(&h);
    let derivative = [0, 1].map(|c| (&d[c] - &point[c] * &d[2]) / &h[2]);
    (point, derivative)
}

fn integrands(piece: &Piece, t: &Big, middle: &Big) -> Integrals {
    let ([r, z], [dr, dz]) = evaluate(piece, t);
    let zero = big(0.0);
    // Shallow excursions below the axis count as on it.
    let r = if r < zero { zero } else { r };
    let zeta = z - middle;
    let speed = sqrt(&(&dr * &dr + &dz * &dz));
    let first = &r * &dz;
    let second = &first * &r / big(2.0);
    let third = &first * &r * &r / big(3.0);
    let fourth = &third * &r * big(0.75);
    [
        first,
        second.clone(),
        third.clone(),
        fourth,
        &second * &zeta,
        &third * &zeta,
        &second * &zeta * &zeta,
        r * speed,
    ]
}

fn rule(piece: &Piece, a: f64, b: f64, middle: &Big) -> Integrals {
    let width = big(b) - big(a);
    let mut total: Integrals = std::array::from_fn(|_| big(0.0));
    for (x, weight) in RULE.iter() {
        let values = integrands(piece, &(big(a) + &width * x), middle);
        for (sum, value) in total.iter_mut().zip(values) {
            *sum += weight * value;
        }
    }
    total.map(|t| t * &width)
}

/// The integrals along a piece.
fn along(piece: &Piece, middle: &Big, tolerances: &[f64; COUNT]) -> Integrals {
    let mut total: Integrals = std::array::from_fn(|_| big(0.0));
    let mut open = vec![(0.0, 1.0, rule(piece, 0.0, 1.0, middle))];
    while let Some((a, b, whole)) = open.pop() {
        let m = 0.5 * (a + b);
        let halves = [rule(piece, a, m, middle), rule(piece, m, b, middle)];
        let agree = (0..COUNT).all(|i| {
            let change = small(&(&whole[i] - &halves[0][i] - &halves[1][i])).abs();
            change <= tolerances[i]
        });
        let [left, right] = halves;
        if agree || b - a < 1e-15 {
            for i in 0..COUNT {
                total[i] = &total[i] + &left[i] + &right[i];
            }
        } else {
            open.push((a, m, left));
            open.push((m, b, right));
        }
    }
    total
}

/// +1 where the region is on the left of a loop, -1 where it is on the right, 0 where it is on both
/// sides or none.
fn side(region: &Region, chain: &[Piece]) -> f64 {
    // Far from other pieces, and not on the axis nor a rounding beside it.
    let chord = |piece: &&Piece| {
        let (a, b) = (
            dehomogenize(&piece[0]),
            dehomogenize(&piece[piece.len() - 1]),
        );
        if small(&evaluate(piece, &big(0.43)).0[0]) <= 1e-9 * region.extent {
            return 0.0;
        }
        small(&(&a[0] - &b[0])).hypot(small(&(&a[1] - &b[1])))
    };
    let longest = chain
        .iter()
        .max_by(|a, b| chord(a).total_cmp(&chord(b)))
        .expect("a piece");
    let (p, d) = evaluate(longest, &big(0.43));
    let length = sqrt(&(&d[0] * &d[0] + &d[1] * &d[1]));
    let step = big(1e-14 * region.extent) / length;
    let beside = |sign: f64| {
        let step = &step * big(sign);
        region.contains(&[&p[0] - &d[1] * &step, &p[1] + &d[0] * &step])
    };
    match (beside(1.0), beside(-1.0)) {
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ => 0.0,
    }
}

fn section(region: &Region) -> Integrals {
    let middle = big(region.center[1]);
    let e = 1e-23 * region.extent;
    let x = region.extent;
    let tolerances = [
        e * x,
        e * x.powi(2),
        e * x.powi(3),
        e * x.powi(4),
        e * x.powi(3),
        e * x.powi(4),
        e * x.powi(4),
        e * x,
    ];
    let mut total: Integrals = std::array::from_fn(|_| big(0.0));
    for chain in &region.loops {
        let sign = side(region, chain);
        for piece in chain {
            let one = along(piece, &middle, &tolerances);
            for i in 0..COUNT {
                // The swept length has no direction.
                let factor = if i + 1 < COUNT { sign } else { sign.abs() };
                total[i] = &total[i] + &one[i] * big(factor);
            }
        }
    }
    total
}

/// The measures of a solid.
pub(crate) fn exact(solid: &Solid) -> Exact {
    let [flat, r1, r2, r3, rz, rrz, rzz, swept] = section(&solid.region);
    let [start, angle] = solid.turn;
    let full = angle == 360.0;
    let half = big(angle) / big(2.0);
    let [cos, sin] = cos_sin_degrees(&half);
    let h = &half * pi() / big(180.0);
    let two = big(2.0);
    let product = &sin * &cos;
    let volume = &two * &h * &r1;
    let caps = big(if full { 0.0 } else { 2.0 });
    let area = &two * &h * &swept + caps * &flat;
    // Along the middle of the turn, across it, along the axis.
    let xi = &two * &sin * &r2 / &volume;
    let zeta = &two * &h * &rz / &volume;
    let xx = (&h + &product) * &r3 - &volume * &xi * &xi;
    let yy = (&h - &product) * &r3;
    let zz = &two * &h * &rzz - &volume * &zeta * &zeta;
    let xz = &two * &sin * &rrz - &volume * &xi * &zeta;
    let [c, s] = cos_sin_degrees(&(big(start) + &half));
    let [e1, e2, e3] = &solid.axes;
    let u: [Big; 3] = std::array::from_fn(|i| &e1[i] * &c + &e2[i] * &s);
    let v: [Big; 3] = std::array::from_fn(|i| &e2[i] * &c - &e1[i] * &s);
    let k = &solid.scale;
    let z = &zeta + big(solid.region.center[1]);
    let centroid = std::array::from_fn(|i| &solid.origin[i] + k * (&u[i] * &xi + &e3[i] * &z));
    let fifth = k * k * k * k * k;
    let trace = &xx + &yy + &zz;
    let inertia = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let s = &xx * &u[i] * &u[j]
                + &yy * &v[i] * &v[j]
                + &zz * &e3[i] * &e3[j]
                + &xz * (&u[i] * &e3[j] + &e3[i] * &u[j]);
            let diagonal = if i == j { trace.clone() } else { big(0.0) };
            (diagonal - s) * &fifth
        })
    });
    Exact {
        volume: volume * k * k * k,
        area: area * k * k,
        centroid,
        inertia,
    }
}
