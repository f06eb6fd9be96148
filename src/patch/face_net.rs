//! Bernstein nets of rational surface pieces: the arithmetic under faces, distances and lines.
//!
//! A net holds four channels a control point. In a face they are (w x, w y, w z, w); seen from a
//! line they are two coordinates across it, one along it, and the weight.
//!
//! ```text
//!   c(u, v) = Σ c_ij B_{i,p}(u) B_{j,q}(v)      u, v in [0, 1], i fastest
//! ```
//!
//! * Accuracy: means with factors that sum to 1; each level rounds by a few units in the last place
//!   of the largest coefficient. [`squares`] sums (p + 1)(q + 1) products at most.
//! * Source: Farouki, Rajan, *CAGD* 5 (1988) 1-26; Farin, *Curves and Surfaces for CAGD*, chapter 15.

use crate::nurbs::MAX_DEGREE;
use smallvec::SmallVec;

/// One control point of a net.
pub(super) type Point4 = [f64; 4];

/// Scalar Bernstein coefficients, the first index fastest.
pub(super) type Scalars = SmallVec<[f64; 32]>;

const ROWS: usize = 2 * MAX_DEGREE + 1;

/// Pascal's triangle up to twice the largest degree.
static BINOMIAL: [[f64; ROWS]; ROWS] = binomials();

const fn binomials() -> [[f64; ROWS]; ROWS] {
    let mut table = [[0.0; ROWS]; ROWS];
    let mut n = 0;
    while n < ROWS {
        table[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            table[n][k] = table[n - 1][k - 1] + table[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    table
}

/// Row `n` of Pascal's triangle.
pub(super) fn binomial_row(n: usize) -> &'static [f64] {
    &BINOMIAL[n][..=n]
}

/// A degree or an index as a number.
#[allow(clippy::cast_precision_loss, reason = "degrees and indices are small")]
pub(super) fn real(n: usize) -> f64 {
    n as f64
}

/// A rational surface piece over the unit square.
#[derive(Debug, PartialEq)]
pub(super) struct Net {
    /// Degrees along both parameters.
    pub(super) degrees: [usize; 2],
    /// Control points, the first index fastest.
    pub(super) points: SmallVec<[Point4; 9]>,
}

/// Value and derivatives of a net at one place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub(super) value: Point4,
    pub(super) u: Point4,
    pub(super) v: Point4,
    pub(super) uu: Point4,
    pub(super) uv: Point4,
    pub(super) vv: Point4,
}

#[inline]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline]
pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(super) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// The point of a homogeneous control point.
#[inline]
pub(super) fn cartesian(p: Point4) -> [f64; 3] {
    [p[0] / p[3], p[1] / p[3], p[2] / p[3]]
}

#[inline]
fn add(sum: &mut Point4, factor: f64, p: Point4) {
    for c in 0..4 {
        sum[c] += factor * p[c];
    }
}

/// Values, first and second derivatives of the Bernstein polynomials of degree `p` at `t`: the first `p + 1` of each.
#[inline]
fn bernstein<const N: usize>(p: usize, t: f64) -> [[f64; N]; 3] {
    let mut row = [0.0; N];
    let (mut first, mut second) = (row, row);
    row[0] = 1.0;
    let s = 1.0 - t;
    for n in 1..=p {
        // The row is that of degree n - 1.
        if n == p {
            let factor = real(p);
            for i in 0..p {
                first[i] -= factor * row[i];
                first[i + 1] += factor * row[i];
            }
        }
        if n + 1 == p {
            let factor = real(p) * (real(p) - 1.0);
            for i in 0..p - 1 {
                second[i] += factor * row[i];
                second[i + 1] -= 2.0 * factor * row[i];
                second[i + 2] += factor * row[i];
            }
        }
        for i in (1..=n).rev() {
            row[i] = s * row[i] + t * row[i - 1];
        }
        row[0] *= s;
    }
    [row, first, second]
}

impl Clone for Net {
    fn clone(&self) -> Self {
        // One copy, where cloning the list would go point by point.
        Self {
            degrees: self.degrees,
            points: SmallVec::from_slice(&self.points),
        }
    }
}

impl Net {
    /// Index of control point (i, j).
    #[inline]
    pub(super) fn at(&self, i: usize, j: usize) -> usize {
        i + j * (self.degrees[0] + 1)
    }

    /// Distance in the list between neighbours along `direction`.
    #[inline]
    fn stride(&self, direction: usize) -> usize {
        if direction == 0 {
            1
        } else {
            self.degrees[0] + 1
        }
    }

    /// Positions of the first control points of the rows along `direction`.
    fn rows(&self, direction: usize) -> impl Iterator<Item = usize> + use<> {
        let step = self.stride(1 - direction);
        (0..=self.degrees[1 - direction]).map(move |k| k * step)
    }

    /// The net with every control point mapped.
    pub(super) fn map(&self, f: impl FnMut(&Point4) -> Point4) -> Self {
        Self {
            degrees: self.degrees,
            points: self.points.iter().map(f).collect(),
        }
    }

    /// The surface as seen from `origin`: A - origin W.
    pub(super) fn seen_from(&self, o: [f64; 3]) -> Self {
        self.map(|p| {
            [
                p[0] - o[0] * p[3],
                p[1] - o[1] * p[3],
                p[2] - o[2] * p[3],
                p[3],
            ]
        })
    }

    /// The parts before and after `t` along `direction`.
    pub(super) fn split(&self, direction: usize, t: f64) -> (Self, Self) {
        let (n, stride) = (self.degrees[direction], self.stride(direction));
        let mut after = self.clone();
        let mut before = self.clone();
        let s = 1.0 - t;
        for start in self.rows(direction) {
            for level in 1..=n {
                for i in 0..=n - level {
                    let (a, b) = (start + i * stride, start + (i + 1) * stride);
                    let (x, y) = (after.points[a], after.points[b]);
                    for c in 0..4 {
                        // What neighbours share is kept exactly.
                        after.points[a][c] = if x[c] == y[c] {
                            x[c]
                        } else {
                            s * x[c] + t * y[c]
                        };
                    }
                }
                before.points[start + level * stride] = after.points[start];
            }
        }
        (before, after)
    }

    /// The part from `a` to `b` along `direction`, 0 <= a < b <= 1.
    pub(super) fn restrict(&self, direction: usize, a: f64, b: f64) -> Self {
        let mut part = if b < 1.0 {
            self.split(direction, b).0
        } else {
            self.clone()
        };
        if a > 0.0 {
            part = part.split(direction, a / b).1;
        }
        part
    }

    /// The same surface with the parameter along `direction` reversed.
    pub(super) fn reversed(&self, direction: usize) -> Self {
        let (n, stride) = (self.degrees[direction], self.stride(direction));
        let mut out = self.clone();
        for start in self.rows(direction) {
            for i in 0..=n {
                out.points[start + i * stride] = self.points[start + (n - i) * stride];
            }
        }
        out
    }

    /// The same surface with its parameters exchanged.
    pub(super) fn transposed(&self) -> Self {
        let [p, q] = self.degrees;
        let mut points = SmallVec::with_capacity(self.points.len());
        for i in 0..=p {
            for j in 0..=q {
                points.push(self.points[self.at(i, j)]);
            }
        }
        Self {
            degrees: [q, p],
            points,
        }
    }

    /// One of the eight ways to lay the parameters: bit 0 exchanges them, then bits 1 and 2 reverse
    /// the first and the second.
    pub(super) fn laid(&self, way: u8) -> Self {
        let mut net = if way & 1 == 0 {
            self.clone()
        } else {
            self.transposed()
        };
        for direction in 0..2 {
            if way & (2 << direction) != 0 {
                net = net.reversed(direction);
            }
        }
        net
    }

    /// The same surface with its degree along `direction` raised to `degree`.
    fn elevated_along(&self, direction: usize, degree: usize) -> Self {
        let mut net = self.clone();
        while net.degrees[direction] < degree {
            let n = net.degrees[direction];
            let old = net.stride(direction);
            let mut degrees = net.degrees;
            degrees[direction] = n + 1;
            let mut out = Self {
                degrees,
                points: SmallVec::from_elem([0.0; 4], (degrees[0] + 1) * (degrees[1] + 1)),
            };
            let new = out.stride(direction);
            for (from, to) in net.rows(direction).zip(out.rows(direction)) {
                for i in 0..=n + 1 {
                    let high = net.points[from + i.min(n) * old];
                    let low = net.points[from + i.saturating_sub(1) * old];
                    let t = real(i) / real(n + 1);
                    out.points[to + i * new] = std::array::from_fn(|c| {
                        if low[c] == high[c] {
                            low[c]
                        } else {
                            t * low[c] + (1.0 - t) * high[c]
                        }
                    });
                }
            }
            net = out;
        }
        net
    }

    /// The same surface with degrees raised to `degrees` where they are lower.
    pub(super) fn elevated(&self, degrees: [usize; 2]) -> Self {
        self.elevated_along(0, degrees[0])
            .elevated_along(1, degrees[1])
    }

    /// The homogeneous point at (u, v).
    pub(super) fn evaluate(&self, u: f64, v: f64) -> Point4 {
        self.jet(u, v).value
    }

    /// Value and derivatives at (u, v), all homogeneous.
    pub(super) fn jet(&self, u: f64, v: f64) -> Jet {
        /// Coefficients of most nets, along either parameter.
        const FEW: usize = 8;
        if self.degrees.iter().all(|d| *d < FEW) {
            self.jet_of::<FEW>(u, v)
        } else {
            self.jet_of::<{ MAX_DEGREE + 1 }>(u, v)
        }
    }

    /// The same with room for `N` coefficients along either parameter.
    fn jet_of<const N: usize>(&self, u: f64, v: f64) -> Jet {
        let [p, q] = self.degrees;
        let [a, a1, a2] = bernstein::<N>(p, u);
        let [b, b1, b2] = bernstein::<N>(q, v);
        let mut jet = Jet {
            value: [0.0; 4],
            u: [0.0; 4],
            v: [0.0; 4],
            uu: [0.0; 4],
            uv: [0.0; 4],
            vv: [0.0; 4],
        };
        for (j, row) in self.points.chunks_exact(p + 1).enumerate() {
            let (mut x, mut x1, mut x2) = ([0.0; 4], [0.0; 4], [0.0; 4]);
            for (i, &point) in row.iter().enumerate() {
                add(&mut x, a[i], point);
                add(&mut x1, a1[i], point);
                add(&mut x2, a2[i], point);
            }
            add(&mut jet.value, b[j], x);
            add(&mut jet.u, b[j], x1);
            add(&mut jet.uu, b[j], x2);
            add(&mut jet.v, b1[j], x);
            add(&mut jet.uv, b1[j], x1);
            add(&mut jet.vv, b2[j], x);
        }
        jet
    }

    /// Least and greatest coordinates of the control points.
    pub(super) fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for &p in &self.points {
            let x = cartesian(p);
            for c in 0..3 {
                low[c] = low[c].min(x[c]);
                high[c] = high[c].max(x[c]);
            }
        }
        (low, high)
    }

    /// How much the control polygons bend along `direction`: the largest second difference over the
    /// largest first one, of points and of weights.
    pub(super) fn bend(&self, direction: usize) -> f64 {
        let (n, stride) = (self.degrees[direction], self.stride(direction));
        let (mut first, mut second) = (0.0_f64, 0.0_f64);
        let (mut weight, mut weight2) = (0.0_f64, 0.0_f64);
        for start in self.rows(direction) {
            let get = |i: usize| self.points[start + i * stride];
            for i in 0..n {
                first = first.max(length(minus(cartesian(get(i + 1)), cartesian(get(i)))));
                weight = weight.max(get(i)[3]).max(get(i + 1)[3]);
            }
            for i in 2..=n {
                let [a, b, c] = [get(i - 2), get(i - 1), get(i)];
                let [x, y, z] = [a, b, c].map(cartesian);
                second = second.max(length(std::array::from_fn(|k| x[k] - 2.0 * y[k] + z[k])));
                weight2 = weight2.max((c[3] - a[3]).abs());
            }
        }
        let bend = if first > 0.0 { second / first } else { 0.0 };
        bend.max(weight2 / weight)
    }

    /// Largest distance between neighbouring control points along `direction`, summed along a row.
    pub(super) fn extent(&self, direction: usize) -> f64 {
        let (n, stride) = (self.degrees[direction], self.stride(direction));
        let mut most = 0.0_f64;
        for start in self.rows(direction) {
            let mut sum = 0.0;
            for i in 0..n {
                let [a, b] = [i, i + 1].map(|i| cartesian(self.points[start + i * stride]));
                sum += length(minus(b, a));
            }
            most = most.max(sum);
        }
        most
    }
}

/// Bernstein coefficients of |B|² and of W², B the first three channels, of twice the degrees.
pub(super) fn squares(net: &Net, square: &mut Scalars, weight: &mut Scalars) {
    let [p, q] = net.degrees;
    let (row_p, row_q) = (binomial_row(p), binomial_row(q));
    let width = 2 * p + 1;
    let size = width * (2 * q + 1);
    square.clear();
    square.resize(size, 0.0);
    weight.clear();
    weight.resize(size, 0.0);
    let mut scaled: SmallVec<[Point4; 16]> = SmallVec::with_capacity(net.points.len());
    for (j, row) in net.points.chunks_exact(p + 1).enumerate() {
        for (i, point) in row.iter().enumerate() {
            let f = row_p[i] * row_q[j];
            scaled.push(point.map(|x| x * f));
        }
    }
    let count = scaled.len();
    for a in 0..count {
        let (i, j) = (a % (p + 1), a / (p + 1));
        let x = scaled[a];
        let place = i + j * width;
        square[2 * place] += x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        weight[2 * place] += x[3] * x[3];
        let x = x.map(|x| 2.0 * x);
        let (mut k, mut other) = (i, place);
        for y in &scaled[a + 1..] {
            k += 1;
            other += 1;
            if k > p {
                k = 0;
                other += width - (p + 1);
            }
            square[place + other] += x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
            weight[place + other] += x[3] * y[3];
        }
    }
    let (row_p, row_q) = (binomial_row(2 * p), binomial_row(2 * q));
    for j in 0..=2 * q {
        for i in 0..width {
            let f = 1.0 / (row_p[i] * row_q[j]);
            square[i + j * width] *= f;
            weight[i + j * width] *= f;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    pub(in super::super) fn nets() -> impl Strategy<Value = Net> {
        (1..5_usize, 1..5_usize).prop_flat_map(|(p, q)| {
            proptest::collection::vec(
                (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, 0.3..2.0_f64),
                (p + 1) * (q + 1),
            )
            .prop_map(move |c| Net {
                degrees: [p, q],
                points: c
                    .iter()
                    .map(|&(x, y, z, w)| [x * w, y * w, z * w, w])
                    .collect(),
            })
        })
    }

    fn near(a: Point4, b: Point4) -> bool {
        (0..4).all(|c| (a[c] - b[c]).abs() < 1e-13)
    }

    proptest! {
        #[test]
        fn other_nets_of_the_same_surface(net in nets(), u in 0.0..1.0_f64, v in 0.0..1.0_f64,
                                          t in 0.05..0.95_f64) {
            let value = net.evaluate(u, v);
            for direction in 0..2 {
                let (before, after) = net.split(direction, t);
                let at = |t: f64| if direction == 0 { (t, v) } else { (u, t) };
                let x = if direction == 0 { u } else { v };
                let (a, b) = at(t * x);
                prop_assert!(near(before.evaluate(u, v), net.evaluate(a, b)));
                let (a, b) = at(t + (1.0 - t) * x);
                prop_assert!(near(after.evaluate(u, v), net.evaluate(a, b)));
                let part = net.restrict(direction, 0.5 * t, t);
                let (a, b) = at(0.5 * t * (1.0 + x));
                prop_assert!(near(part.evaluate(u, v), net.evaluate(a, b)));
            }
            prop_assert!(near(net.elevated([6, 5]).evaluate(u, v), value));
            prop_assert!(near(net.laid(1).evaluate(v, u), value));
            prop_assert!(near(net.laid(2).evaluate(1.0 - u, v), value));
            prop_assert!(near(net.laid(7).evaluate(1.0 - v, 1.0 - u), value));
        }

        #[test]
        fn derivatives_and_squares(net in nets(), u in 0.1..0.9_f64, v in 0.1..0.9_f64) {
            let jet = net.jet(u, v);
            let h = 1e-5;
            for c in 0..4 {
                let du = (net.evaluate(u + h, v)[c] - net.evaluate(u - h, v)[c]) / (2.0 * h);
                let dv = (net.evaluate(u, v + h)[c] - net.evaluate(u, v - h)[c]) / (2.0 * h);
                let duu = (net.jet(u + h, v).u[c] - net.jet(u - h, v).u[c]) / (2.0 * h);
                let duv = (net.jet(u, v + h).u[c] - net.jet(u, v - h).u[c]) / (2.0 * h);
                let dvv = (net.jet(u, v + h).v[c] - net.jet(u, v - h).v[c]) / (2.0 * h);
                prop_assert!((jet.u[c] - du).abs() < 1e-6 && (jet.v[c] - dv).abs() < 1e-6);
                prop_assert!((jet.uu[c] - duu).abs() < 1e-6 && (jet.uv[c] - duv).abs() < 1e-6);
                prop_assert!((jet.vv[c] - dvv).abs() < 1e-6);
            }
            let (mut f, mut e) = (Scalars::new(), Scalars::new());
            squares(&net, &mut f, &mut e);
            let twice = Net {
                degrees: net.degrees.map(|p| 2 * p),
                points: f.iter().zip(&e).map(|(&f, &e)| [f, e, 0.0, 1.0]).collect(),
            };
            let (x, y) = (net.evaluate(u, v), twice.evaluate(u, v));
            let b = [x[0], x[1], x[2]];
            prop_assert!((dot(b, b) - y[0]).abs() < 1e-12 && (x[3] * x[3] - y[1]).abs() < 1e-12);
        }
    }
}
