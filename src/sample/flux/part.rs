//! The part of a profile's piece that lies in a layer, as a function of s = ρ².
//!
//! A piece is bi-monotone, so at each s its part is met once at most, at a parameter that is found by a bracketed
//! Newton's method. How far the height z(s) is analytic beyond an interval of s is proved from the piece's
//! coefficients: about the middle of the interval's parameters, with τ = ±1 at its ends,
//!
//! ```text
//!   |s(τ) - s₀ - s₁ τ| <= B |τ|²/Q²            within |τ| <= Q, by Schwarz's lemma; B bounds it on |τ| = Q
//!   every s with |s - s₀| < |s₁| P - B P²/Q²   is met by exactly one τ with |τ| < P <= Q, by Rouché's theorem
//! ```
//!
//! so z is analytic in that disc and bounded by its values on |τ| <= P. What bounds a rational function is the sum of
//! its numerator's absolute terms and the least of its denominator.

use super::series;
use crate::math::Real;
use crate::math::bernstein::{self, Coefficients};
use crate::region::BoundaryPiece;

/// One piece, in coefficients of r w, z w and w.
pub(super) struct Curve {
    r: Coefficients<f64>,
    z: Coefficients<f64>,
    w: Coefficients<f64>,
    /// What r and z are relative to.
    origin: [f64; 2],
}

impl Curve {
    pub(super) fn new(part: &BoundaryPiece) -> Self {
        let piece = part.piece;
        let twin = piece.twin();
        let [r, z, w] = twin.rows().map(|row| Coefficients::from_slice(&row));
        Self {
            r,
            z,
            w,
            origin: twin.origin,
        }
    }

    fn coordinate(&self, c: usize) -> &[f64] {
        if c == 0 { &self.r } else { &self.z }
    }

    /// The radius (c = 0) or height (c = 1) at a parameter.
    pub(super) fn at(&self, c: usize, t: f64) -> f64 {
        bernstein::evaluate(self.coordinate(c), t) / bernstein::evaluate(&self.w, t)
            + self.origin[c]
    }

    /// The part between two parameters, over its own [0, 1].
    pub(super) fn between(&self, [a, b]: [f64; 2]) -> Self {
        let restrict = |c: &[f64]| bernstein::restrict(c, a, b);
        Self {
            r: restrict(&self.r),
            z: restrict(&self.z),
            w: restrict(&self.w),
            origin: self.origin,
        }
    }

    /// The parameter at which coordinate `c`, monotone, takes the value `v`; the nearer end where it does not.
    pub(super) fn parameter(&self, c: usize, v: f64, guess: f64) -> f64 {
        let v = v - self.origin[c];
        let pairs = self.coordinate(c).iter().zip(&self.w);
        let f: Coefficients<f64> = pairs.map(|(x, w)| x - v * w).collect();
        let (first, last) = (f[0], f[f.len() - 1]);
        let rising = last > first;
        if (first >= 0.0) == rising {
            return 0.0;
        }
        if (last <= 0.0) == rising {
            return 1.0;
        }
        if f.len() == 2 && self.w[0] == self.w[1] {
            return first / (first - last);
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut t = if guess > 0.0 && guess < 1.0 {
            guess
        } else {
            first / (first - last)
        };
        let mut wide = 1.0;
        for step in 1..200 {
            let (value, slope) = bernstein::evaluate_with_derivative(&f, t);
            if value == 0.0 {
                return t;
            }
            if (value < 0.0) == rising {
                low = t;
            } else {
                high = t;
            }
            let newton = t - value / slope;
            let mut next = newton;
            if step % 4 == 0 {
                // Newton's steps that do not halve the bracket in four are left to bisection.
                if high - low > 0.5 * wide && (newton - t).abs() > 1e-3 * (high - low) {
                    next = 0.5 * (low + high);
                }
                wide = high - low;
            }
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            if (next - t).abs() <= 2.0 * f64::EPSILON * t || high - low <= 2.0 * f64::EPSILON * high
            {
                return next;
            }
            t = next;
        }
        t
    }
}

/// The part of a piece in a layer.
pub(super) struct Part {
    curve: Curve,
    /// +1 where the region lies at smaller radii, else -1.
    sign: f64,
    /// Parameters at which it is nearest to the axis and farthest.
    t: [f64; 2],
    /// Squared radii there.
    pub(super) s: [f64; 2],
    radius: [f64; 2],
    /// Heights there.
    z: [f64; 2],
}

impl Part {
    /// What a layer between two heights has of a piece that is not horizontal; `None` where it has nothing.
    pub(super) fn new(part: &BoundaryPiece, low: f64, high: f64) -> Option<Self> {
        let piece = part.piece;
        let sign = f64::from(part.disc_sign());
        if sign == 0.0 || piece.on_axis {
            return None;
        }
        let (start, end) = (piece.start().map(Real::f64), piece.end().map(Real::f64));
        let curve = Curve::new(part);
        // Parameter, radius and height where the piece enters the layer or leaves it.
        let clipped = |t: f64, own: [f64; 2]| {
            let z = own[1].clamp(low, high);
            if z.to_bits() == own[1].to_bits() {
                return (t, own[0], z);
            }
            let t = curve.parameter(1, z, 0.5);
            let span = [start[0].min(end[0]), start[0].max(end[0])];
            (t, curve.at(0, t).clamp(span[0], span[1]), z)
        };
        if start[1].max(end[1]) <= low || start[1].min(end[1]) >= high {
            return None;
        }
        let (mut near, mut far) = (clipped(0.0, start), clipped(1.0, end));
        if near.1 > far.1 {
            std::mem::swap(&mut near, &mut far);
        }
        (near.2 != far.2).then(|| Self {
            curve,
            sign,
            t: [near.0, far.0],
            radius: [near.1.max(0.0), far.1.max(0.0)],
            s: [near.1, far.1].map(|r| r.max(0.0) * r.max(0.0)),
            z: [near.2, far.2],
        })
    }

    /// The height of what the part bounds, with its sign: at radii below it.
    pub(super) fn whole(&self) -> f64 {
        self.sign * (self.z[1] - self.z[0]).abs()
    }

    /// The part between two squared radii of its range.
    pub(super) fn between(&self, s: [f64; 2]) -> Between<'_> {
        let at = |s: f64| {
            let r = s.sqrt();
            if r <= self.radius[0] {
                self.t[0]
            } else if r >= self.radius[1] {
                self.t[1]
            } else {
                let share = (r - self.radius[0]) / (self.radius[1] - self.radius[0]);
                let t = self
                    .curve
                    .parameter(0, r, self.t[0] + (self.t[1] - self.t[0]) * share);
                t.clamp(self.t[0].min(self.t[1]), self.t[0].max(self.t[1]))
            }
        };
        let ends = s.map(at);
        let ordered = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        Between {
            part: self,
            ends,
            curve: self.curve.between(ordered),
        }
    }
}

/// The part of a piece between two squared radii.
pub(super) struct Between<'a> {
    part: &'a Part,
    /// Parameters of the piece.
    ends: [f64; 2],
    curve: Curve,
}

/// Bounds of the parameter's disc, in half ranges of the parameter.
const DISCS: [f64; 6] = [1.6, 2.2, 3.0, 4.5, 8.0, 16.0];

impl Between<'_> {
    /// Height of what the part bounds at radii from √s on, with its sign; and the parameter.
    pub(super) fn height(&self, s: f64, guess: f64) -> (f64, f64) {
        let t = self.curve.parameter(0, s.sqrt(), guess);
        let z = self.curve.at(1, t);
        let part = self.part;
        let (low, high) = (part.z[0].min(part.z[1]), part.z[0].max(part.z[1]));
        (part.sign * (z.clamp(low, high) - part.z[1]).abs(), t)
    }

    /// How much the height may change between the two.
    pub(super) fn variation(&self) -> f64 {
        let [a, b] = self.ends.map(|t| self.part.curve.at(1, t));
        (a - b).abs()
    }

    /// The number of points at which the height is to be known so that the series through it, over `s`, is within
    /// `tolerance`; `None` where it cannot be proved of [`series::MOST`].
    pub(super) fn points_needed(&self, s: [f64; 2], tolerance: f64) -> Option<usize> {
        let curve = &self.curve;
        let w = powers(&curve.w);
        let mut r = powers(&curve.r);
        for (r, w) in r.iter_mut().zip(&w) {
            *r += curve.origin[0] * w;
        }
        let mut z = powers(&curve.z);
        let r0 = r[0] / w[0];
        let (s0, s1) = (r0 * r0, 2.0 * r0 * (r[1] - r0 * w[1]) / w[0]);
        // What s is beyond its linear part, times w²: the terms from τ² on.
        let ww = product(&w, &w);
        let mut beyond = product(&r, &r);
        for k in 2..beyond.len() {
            beyond[k] -= s0 * ww[k] + s1 * ww[k - 1];
        }
        let linear = ww.last().copied().unwrap_or(0.0) * s1;
        beyond.push(-linear);
        let z0 = z[0] / w[0];
        for (z, w) in z.iter_mut().zip(&w) {
            *z -= z0 * w;
        }
        let (middle, half) = (0.5 * (s[0] + s[1]), 0.5 * (s[1] - s[0]));
        let mut fewest: Option<usize> = None;
        for q in DISCS {
            let least = w[0] - absolute(&w[1..], q) * q;
            if !(least > 0.1 * w[0]) {
                break;
            }
            let b = absolute(&beyond[2..], q) * q * q / (least * least);
            let p = q.min(0.5 * s1.abs() * q * q / b);
            let disc = s1.abs() * p - b * (p / q) * (p / q);
            let reach = (disc - (middle - s0).abs()) / half * (1.0 - 1e-9);
            if !(reach > 1.0) {
                continue;
            }
            let most = absolute(&z[1..], p) * p / least;
            let needed = series::points_needed(most, series::ellipse(reach), tolerance);
            fewest = match (fewest, needed) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
        }
        fewest
    }
}

/// Coefficients of a polynomial on [0, 1] by powers of τ = 2 t - 1.
fn powers(c: &[f64]) -> Coefficients<f64> {
    let mut right = bernstein::split(c, 0.5).1;
    let n = right.len();
    let mut binomial = 1.0;
    // Differences from the first value on.
    for k in 1..n {
        for i in (k..n).rev() {
            right[i] -= right[i - 1];
        }
    }
    for k in 1..n {
        #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
        {
            binomial *= (n - k) as f64 / k as f64;
        }
        right[k] *= binomial;
    }
    right
}

fn product(a: &[f64], b: &[f64]) -> Coefficients<f64> {
    let mut out = Coefficients::from_elem(0.0, a.len() + b.len() - 1);
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

/// The sum of the absolute terms at `x`.
fn absolute(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c.abs())
}
