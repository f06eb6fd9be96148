//! Bounds of a patch's integrand for complex parameters, and what Gauss's rule may err by.
//!
//! A function that is analytic and at most M on the ellipse with foci 0 and 1 and half axes (ρ ± 1/ρ)/4 has Chebyshev
//! coefficients of at most 2 M ρ^-k. Gauss's rule of n >= 2 points on [0, 1] is exact up to degree 2n - 1 and errs by at
//! most 16/15 for each even polynomial beyond, so
//!
//! ```text
//!   |∫ f - G_n f| <= (32/15) M ρ^-2n / (1 - ρ^-2)
//! ```
//!
//! (L. N. Trefethen, *Approximation Theory and Approximation Practice*, theorem 19.3). On the same ellipse
//! |u| + |1 - u| = (ρ + 1/ρ)/2 = σ, so a polynomial of degree p with Bernstein coefficients up to b is at most b σ^p:
//! all bounds come from the largest coefficients of the patch about its middle.
//!
//! A function f that changes sign has its zero at v = g(u), where it rises steadily with v. With f = A + B u + C v + D(u, v), the
//! map v -> v - f/C contracts the disc of radius R about -(A + B u)/C by θ to itself when |D_v| <= θ |C| and
//! |D| <= R (1 - θ) |C| on a set that holds the disc, so that g is analytic there and as near to the line.

use super::domain::{Form, Hull};
use super::net::{Net, real};
use smallvec::SmallVec;

/// Ellipses that are tried.
const RHO: [f64; 9] = [1.4, 2.0, 3.0, 4.5, 7.0, 10.0, 16.0, 25.0, 40.0];
/// Points of the rules.
pub(super) const POINTS: [usize; 6] = [2, 4, 6, 8, 11, 15];

/// Bounds of an integrand on the ellipses; infinite where nothing is known.
pub(super) type Bounds = [f64; RHO.len()];

/// Half the sum of the axes of an ellipse about [-1, 1].
fn sigma(rho: f64) -> f64 {
    0.5 * (rho + 1.0 / rho)
}

/// The first rule, by its place, whose error over the unit square is at most `goal`, or the last, and that error.
pub(super) fn rule(bounds: &Bounds, goal: f64) -> (usize, f64) {
    let mut found = (POINTS.len() - 1, f64::INFINITY);
    for (place, n) in POINTS.into_iter().enumerate() {
        let mut error = f64::INFINITY;
        for (most, rho) in bounds.iter().zip(RHO) {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_possible_wrap,
                reason = "a few points"
            )]
            let tail = rho.powi(-2 * (n as i32)) / (1.0 - 1.0 / (rho * rho));
            // Both directions.
            error = error.min(64.0 / 15.0 * most * tail);
        }
        found = (place, error);
        if error <= goal {
            break;
        }
    }
    found
}

/// The largest coefficients of a patch about its middle, weights over their middle one.
pub(super) struct Norms {
    degrees: [usize; 2],
    centre: [f64; 3],
    /// Of the coordinates and of their differences along u and v, times the degree.
    values: [f64; 3],
    slopes: [[f64; 3]; 2],
    /// The same of the weights, less 1.
    weight: f64,
    weight_slopes: [f64; 2],
}

impl Norms {
    pub(super) fn new(net: &Net, hull: &Hull) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in hull {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let (mut light, mut heavy) = (f64::INFINITY, 0.0_f64);
        for h in &net.points {
            light = light.min(h[3]);
            heavy = heavy.max(h[3]);
        }
        let unit = 2.0 / (light + heavy);
        let mut norms = Self {
            degrees: net.degrees,
            centre: std::array::from_fn(|k| 0.5 * (low[k] + high[k])),
            values: [0.0; 3],
            slopes: [[0.0; 3]; 2],
            weight: 0.5 * (heavy - light) * unit,
            weight_slopes: [0.0; 2],
        };
        let count = net.degrees[0] + 1;
        let about = |i: usize| -> [f64; 4] {
            let (h, w) = (net.points[i], net.points[i][3] * unit);
            [
                h[0] * unit - norms.centre[0] * w,
                h[1] * unit - norms.centre[1] * w,
                h[2] * unit - norms.centre[2] * w,
                w,
            ]
        };
        let all: SmallVec<[[f64; 4]; 16]> = (0..net.points.len()).map(about).collect();
        for (i, h) in all.iter().enumerate() {
            for k in 0..3 {
                norms.values[k] = norms.values[k].max(h[k].abs());
            }
            let next = [
                (i % count + 1 < count).then(|| all[i + 1]),
                all.get(i + count).copied(),
            ];
            for (d, next) in next.into_iter().enumerate() {
                let Some(next) = next else { continue };
                let degree = real(net.degrees[d]);
                for k in 0..3 {
                    let step = degree * (next[k] - h[k]).abs();
                    norms.slopes[d][k] = norms.slopes[d][k].max(step);
                }
                let step = degree * (next[3] - h[3]).abs();
                norms.weight_slopes[d] = norms.weight_slopes[d].max(step);
            }
        }
        norms
    }

    /// Bounds of |X_u × X_v|'s first component, of a form, and of the slopes' lengths' product, where |u| + |1 - u| <= σ
    /// and |v| + |1 - v| <= τ.
    fn at(&self, sigma: f64, tau: f64) -> Option<Reach> {
        let [p, q] = self.degrees.map(exponent);
        let (su, tv) = (sigma.powi(p - 1), tau.powi(q - 1));
        let whole = su * sigma * tv * tau;
        let lower = [su * tv * tau, su * sigma * tv];
        let least = 1.0 - self.weight * whole;
        if !(least > 0.05) {
            return None;
        }
        let slope = |d: usize, k: usize| {
            let turning = self.values[k] * whole * self.weight_slopes[d] * lower[d] / least;
            (self.slopes[d][k] * lower[d] + turning) / least
        };
        let [u, v] = [0, 1].map(|d| [0, 1, 2].map(|k| slope(d, k)));
        let length = |a: [f64; 3]| (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        Some(Reach {
            jacobian: u[1] * v[2] + u[2] * v[1],
            area: length(u) * length(v),
            about: self.values.map(|n| n * whole / least),
        })
    }

    /// Bounds over the patch itself.
    pub(super) fn real(&self) -> Reach {
        self.at(1.0, 1.0).unwrap_or(Reach {
            jacobian: f64::INFINITY,
            area: f64::INFINITY,
            about: [f64::INFINITY; 3],
        })
    }

    fn form(&self, form: &Form, reach: &Reach) -> f64 {
        let centre = super::domain::value(form, &self.centre).abs();
        (0..3).fold(centre, |sum, k| sum + form[k].abs() * reach.about[k])
    }

    /// Bounds of L n_x dA with a linear L over the whole patch.
    pub(super) fn whole(&self, form: &Form) -> Bounds {
        RHO.map(|rho| {
            let sigma = sigma(rho);
            let reach = self.at(sigma, sigma);
            reach.map_or(f64::INFINITY, |r| r.jacobian * self.form(form, &r))
        })
    }

    /// Bounds over all strips between graphs together, with L on each of them.
    pub(super) fn strips(&self, graphs: &[Graph], regions: &[Option<Form>]) -> Bounds {
        RHO.map(|rho| {
            let sigma = sigma(rho);
            let tau = graphs
                .iter()
                .try_fold(sigma, |m, g| Some(g.reach(sigma)?.max(m)));
            let Some((tau, reach)) = tau.and_then(|tau| Some((tau, self.at(sigma, tau)?))) else {
                return f64::INFINITY;
            };
            let forms = regions.iter().flatten().map(|form| self.form(form, &reach));
            // No strip is wider than the ellipse.
            reach.jacobian * forms.sum::<f64>() * tau
        })
    }

    /// Along which parameter the patch is further from a plane with even parameters, and by how much.
    pub(super) fn bends(&self, net: &Net) -> [f64; 2] {
        let unit = 1.0 / net.points.iter().fold(0.0_f64, |m, h| m.max(h[3]));
        let about = |h: &[f64; 4], k: usize| h[k] - self.centre[k] * h[3];
        [0, 1].map(|d| {
            let at = |a: usize, b: usize, c: usize| {
                let [a, b, c] = [a, b, c].map(|i| &net.points[i]);
                let bend = |k: usize| about(a, k) - 2.0 * about(b, k) + about(c, k);
                let turn = a[3] - 2.0 * b[3] + c[3];
                (bend(0).abs() + bend(1).abs() + bend(2).abs() + turn.abs()) * unit
            };
            second_differences(net.degrees, d, at) * real(net.degrees[d]).powi(2)
        })
    }
}

/// The largest of a second difference along a parameter.
pub(super) fn second_differences(
    degrees: [usize; 2],
    direction: usize,
    at: impl Fn(usize, usize, usize) -> f64,
) -> f64 {
    let [n, m] = degrees.map(|d| d + 1);
    let (count, rows, step, stride) = if direction == 0 {
        (n, m, 1, n)
    } else {
        (m, n, n, 1)
    };
    let mut most = 0.0_f64;
    for row in 0..rows {
        for i in 2..count {
            let place = row * stride + i * step;
            most = most.max(at(place - 2 * step, place - step, place));
        }
    }
    most
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "a degree"
)]
fn exponent(degree: usize) -> i32 {
    degree as i32
}

/// Bounds over a set of parameters.
pub(super) struct Reach {
    pub(super) jacobian: f64,
    pub(super) area: f64,
    /// Of the coordinates from the patch's middle.
    about: [f64; 3],
}

/// A function on a patch whose zero is a graph over u: f = A + B u + C v + D(u, v).
pub(super) struct Graph {
    degrees: [usize; 2],
    /// Coefficients, rising along v.
    pub(super) coefficients: SmallVec<[f64; 16]>,
    /// Where the line is at u = 0 and at u = 1.
    ends: [f64; 2],
    rise: f64,
    /// B, and the largest of D, D_u and D_v.
    along: f64,
    deviation: f64,
    slopes: [f64; 2],
}

impl Graph {
    /// A form's numerator over a patch; `None` where it does not rise with v throughout.
    pub(super) fn new(net: &Net, form: &Form) -> Option<Self> {
        let [p, q] = net.degrees;
        if p == 0 || q == 0 {
            return None;
        }
        let value =
            |h: &[f64; 4]| form[0] * h[0] + form[1] * h[1] + form[2] * h[2] + form[3] * h[3];
        let mut coefficients: SmallVec<[f64; 16]> = net.points.iter().map(value).collect();
        let at = |i: usize, j: usize| i + (p + 1) * j;
        let f = &coefficients;
        let b = 0.5 * (f[at(p, 0)] - f[at(0, 0)] + f[at(p, q)] - f[at(0, q)]);
        let c = 0.5 * (f[at(0, q)] - f[at(0, 0)] + f[at(p, q)] - f[at(p, 0)]);
        if c == 0.0 {
            return None;
        }
        let sign = c.signum();
        let (b, c) = (b * sign, c.abs());
        for f in &mut coefficients {
            *f *= sign;
        }
        let f = &coefficients;
        let linear = |i: usize, j: usize| b * real(i) / real(p) + c * real(j) / real(q);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut slopes = [0.0_f64; 2];
        for j in 0..=q {
            for i in 0..=p {
                let rest = f[at(i, j)] - linear(i, j);
                (low, high) = (low.min(rest), high.max(rest));
                if j < q {
                    let step = real(q) * (f[at(i, j + 1)] - f[at(i, j)]) - c;
                    slopes[1] = slopes[1].max(step.abs());
                }
                if i < p {
                    let step = real(p) * (f[at(i + 1, j)] - f[at(i, j)]) - b;
                    slopes[0] = slopes[0].max(step.abs());
                }
            }
        }
        let a = 0.5 * (low + high);
        Some(Self {
            degrees: net.degrees,
            ends: [-a / c, -(a + b) / c],
            rise: c,
            deviation: 0.5 * (high - low),
            along: b,
            slopes,
            coefficients,
        })
    }

    /// How much of the unit interval the line's ends miss it by.
    pub(super) fn overshoot(&self) -> f64 {
        let [a, b] = self.ends;
        (-a.min(b)).max(a.max(b) - 1.0).max(0.0)
    }

    /// τ such that |v| + |1 - v| <= τ holds the graph's discs and the patch where |u| + |1 - u| <= σ; `None` where the
    /// graph is not proved.
    fn reach(&self, sigma: f64) -> Option<f64> {
        let [p, q] = self.degrees.map(exponent);
        let [a, b] = self.ends;
        let (low, high) = (a.min(b), a.max(b));
        let line = sigma * (high - low) + low.abs() + (1.0 - high).abs();
        let least = line.max(1.01 * sigma);
        [1.02, 1.1, 1.3, 1.7].into_iter().find_map(|room| {
            let tau = least * room;
            let across = sigma.powi(p);
            let slope = self.slopes[1] * across * tau.powi(q - 1) / self.rise;
            let radius = self.deviation * across * tau.powi(q) / (self.rise * (1.0 - slope));
            (slope < 0.9 && line + 2.0 * radius <= tau).then_some(tau)
        })
    }

    /// The range of the graph's slope.
    fn slope(&self) -> [f64; 2] {
        let [du, dv] = self.slopes;
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for along in [self.along - du, self.along + du] {
            for rise in [self.rise - dv, self.rise + dv] {
                let slope = -along / rise;
                range = [range[0].min(slope), range[1].max(slope)];
            }
        }
        range
    }

    /// How far the zero may be from the line over the patch.
    fn off_line(&self) -> f64 {
        self.deviation / (self.rise - self.slopes[1])
    }

    /// Whether this graph and another, that do not change sides between the ends of the patch, do not between
    /// them either.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        let ([a, b], [c, d]) = (self.slope(), other.slope());
        if b < c || d < a {
            return true;
        }
        let gaps = [0, 1].map(|k| self.ends[k] - other.ends[k]);
        let room = self.off_line() + other.off_line();
        gaps.iter().all(|g| *g > room) || gaps.iter().all(|g| *g < -room)
    }

    /// How far along v the zero may be off where the patch is off by `slack`.
    pub(super) fn room(&self, slack: f64) -> f64 {
        slack / self.rise
    }

    /// Whether the zero is a graph over the patch, if it does not leave it.
    pub(super) fn is_proved(&self) -> bool {
        self.reach(sigma(RHO[0])).is_some()
    }

    /// Where along u the graph leaves the patch, through its first or its last line; the middle where that is not
    /// clear. `None` where it stays, to `room`.
    pub(super) fn exit(&self, room: f64) -> Option<f64> {
        let [p, q] = self.degrees;
        let row = |j: usize, sign: f64| -> SmallVec<[f64; 8]> {
            let from = (p + 1) * j;
            let row = &self.coefficients[from..=from + p];
            row.iter().map(|c| c * sign).collect()
        };
        let rows = [row(0, 1.0), row(q, -1.0)];
        let leaving = rows.iter().find(|row| row.iter().any(|c| *c > room))?;
        let value = |t: f64| {
            let (b, _) = super::net::basis(p, t);
            b.iter()
                .zip(leaving.iter())
                .map(|(b, c)| b * c)
                .sum::<f64>()
        };
        let (first, last) = (leaving[0], leaving[p]);
        if (first > 0.0) == (last > 0.0) {
            return Some(0.5);
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (value(middle) > 0.0) == (first > 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let at = 0.5 * (low + high);
        Some(if at > 1e-9 && at < 1.0 - 1e-9 {
            at
        } else {
            0.5
        })
    }
}
