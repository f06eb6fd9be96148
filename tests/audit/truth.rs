//! Membership, chords and distances of solids, by formulas that the crate does not use.
//!
//! A line meets a turned Bézier piece where a polynomial of twice its degree is zero, an ellipsoid where
//! a quadratic is, a box at its planes; between neighbouring cuts membership is asked once. Distances
//! are minima over samples of the meridian, each polished by golden sections.

use glam::DVec3;

use super::support::oracle::Solid as Turned;
use super::support::sampling::evaluate;

/// What a solid does to those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Op {
    Add,
    Subtract,
    Intersect,
}

/// What stands in a frame.
#[derive(Debug)]
pub(crate) enum Shape {
    /// The turned region of the frame itself.
    Turned,
    /// Half axes.
    Ellipsoid(DVec3),
    /// Half sides.
    Block(DVec3),
}

/// A solid: its frame is that of a turned one.
#[derive(Debug)]
pub(crate) struct Solid {
    pub(crate) op: Op,
    pub(crate) shape: Shape,
    pub(crate) frame: Turned,
}

/// Solids combined in their order.
#[derive(Debug)]
pub(crate) struct Truth {
    pub(crate) solids: Vec<Solid>,
}

impl Truth {
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        self.solids.iter().fold(false, |state, s| match s.op {
            Op::Add => state || s.contains(p),
            Op::Subtract => state && !s.contains(p),
            Op::Intersect => state && s.contains(p),
        })
    }

    /// The share of the segment from `p` to `p + d` that is inside.
    pub(crate) fn share(&self, p: DVec3, d: DVec3, cuts: &mut Vec<f64>) -> f64 {
        cuts.clear();
        cuts.extend([0.0, 1.0]);
        for solid in &self.solids {
            solid.cuts(p, d, cuts);
        }
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.sort_by(f64::total_cmp);
        let inside = cuts.windows(2).filter(|pair| {
            pair[1] - pair[0] > 1e-11 && self.contains(p + d * (0.5 * (pair[0] + pair[1])))
        });
        inside.map(|pair| pair[1] - pair[0]).sum()
    }
}

impl Solid {
    fn local(&self, p: DVec3) -> DVec3 {
        let d = p - self.frame.origin_small;
        DVec3::from(self.frame.axes_small.map(|e| d.dot(e))) / self.frame.scale_small
    }

    pub(crate) fn contains(&self, p: DVec3) -> bool {
        match self.shape {
            Shape::Turned => self.frame.contains(p).0,
            Shape::Ellipsoid(radii) => (self.local(p) / radii).length() <= 1.0,
            Shape::Block(half) => self.local(p).abs().cmple(half).all(),
        }
    }

    /// Parameters of the line `p + t d` where it may change sides.
    fn cuts(&self, p: DVec3, d: DVec3, out: &mut Vec<f64>) {
        let o = self.local(p);
        let e = DVec3::from(self.frame.axes_small.map(|a| d.dot(a))) / self.frame.scale_small;
        match self.shape {
            Shape::Ellipsoid(radii) => {
                let (o, e) = (o / radii, e / radii);
                quadratic(e.dot(e), e.dot(o), o.dot(o) - 1.0, out);
            }
            Shape::Block(half) => {
                for c in 0..3 {
                    for side in [-half[c], half[c]] {
                        out.push((side - o[c]) / e[c]);
                    }
                }
            }
            Shape::Turned => {
                let [start, angle] = self.frame.turn;
                if angle < 360.0 {
                    for degrees in [start, start + angle] {
                        let (s, c) = degrees.to_radians().sin_cos();
                        out.push((o.x * s - o.y * c) / (e.y * c - e.x * s));
                    }
                }
                let center = self.frame.region.center;
                for piece in self.frame.region.small.iter().flatten() {
                    if !piece.on_axis {
                        let control: Vec<[f64; 3]> = piece
                            .control
                            .iter()
                            .map(|h| [h[0] + center[0] * h[2], h[1] + center[1] * h[2], h[2]])
                            .collect();
                        turned_cuts(&control, o, e, out);
                    }
                }
            }
        }
        out.retain(|t| t.is_finite());
    }

    /// The distance of a point to the surface.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        let q = self.local(p);
        self.frame.scale_small
            * match self.shape {
                Shape::Ellipsoid(radii) => ellipsoid_distance(q.abs(), radii),
                Shape::Block(half) => {
                    let off = q.abs() - half;
                    if off.max_element() <= 0.0 {
                        -off.max_element()
                    } else {
                        off.max(DVec3::ZERO).length()
                    }
                }
                Shape::Turned => self.turned_distance(q),
            }
    }

    /// Whether the region holds (r, z), asked in the middle of the turn.
    pub(crate) fn holds(&self, [r, z]: [f64; 2]) -> bool {
        let [start, angle] = self.frame.turn;
        let (s, c) = (start + 0.5 * angle).to_radians().sin_cos();
        r > 0.0 && self.frame.contains(self.frame.world([r * c, r * s, z])).0
    }

    fn turned_distance(&self, q: DVec3) -> f64 {
        let [start, angle] = self.frame.turn;
        let rho = q.x.hypot(q.y);
        if angle == 360.0 {
            return self.meridian_distance([rho, q.z], false);
        }
        let mut nearest = f64::INFINITY;
        let azimuth = (q.y.atan2(q.x).to_degrees() - start).rem_euclid(360.0);
        if azimuth <= angle {
            nearest = self.meridian_distance([rho, q.z], false);
        }
        for degrees in [start, start + angle] {
            let (s, c) = degrees.to_radians().sin_cos();
            let (u, v) = (q.x * c + q.y * s, q.y * c - q.x * s);
            let flat = if self.holds([u, q.z]) {
                0.0
            } else {
                self.meridian_distance([u, q.z], true)
            };
            nearest = nearest.min(flat.hypot(v));
        }
        nearest
    }

    /// The distance to the curves in the plane of the meridian.
    fn meridian_distance(&self, q: [f64; 2], with_axis: bool) -> f64 {
        let center = self.frame.region.center;
        let q = [q[0] - center[0], q[1] - center[1]];
        let pieces = self.frame.region.small.iter().flatten();
        pieces
            .filter(|p| with_axis || !p.on_axis)
            .map(|p| piece_distance(&p.control, q))
            .fold(f64::INFINITY, f64::min)
    }
}

/// Roots of `a t² + 2 b t + c`.
fn quadratic(a: f64, b: f64, c: f64, out: &mut Vec<f64>) {
    let root = (b * b - a * c).sqrt();
    let sum = -(b + root.copysign(b));
    out.extend([sum / a, c / sum]);
}

/// Where the line o + t e meets the surface that a piece (w r, w z, w) sweeps.
fn turned_cuts(control: &[[f64; 3]], o: DVec3, e: DVec3, out: &mut Vec<f64>) {
    let (a, b, c) = (
        e.x * e.x + e.y * e.y,
        e.x * o.x + e.y * o.y,
        o.x * o.x + o.y * o.y,
    );
    let at = |u: f64| evaluate(control, u);
    let level: Vec<f64> = control.iter().map(|h| h[1] - o.z * h[2]).collect();
    if e.z.abs() <= 1e-9 * e.length() {
        // The height stays: so does the radius.
        for u in roots(level) {
            let r = at(u)[0];
            quadratic(a, b, c - r * r, out);
        }
        return;
    }
    let x: Vec<f64> = control.iter().map(|h| h[0] * e.z).collect();
    let w: Vec<f64> = control.iter().map(|h| h[2] * e.z).collect();
    let terms = [
        (1.0, product(&x, &x)),
        (-a, product(&level, &level)),
        (-2.0 * b, product(&level, &w)),
        (-c, product(&w, &w)),
    ];
    let sum = (0..terms[0].1.len()).map(|k| terms.iter().map(|(f, p)| f * p[k]).sum());
    for u in roots(sum.collect()) {
        out.push((at(u)[1] - o.z) / e.z);
    }
}

/// The product of polynomials in Bernstein form.
fn product(p: &[f64], q: &[f64]) -> Vec<f64> {
    let (m, n) = (p.len() - 1, q.len() - 1);
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
    (0..=m + n)
        .map(|k| {
            let range = k.saturating_sub(n)..=k.min(m);
            let sum: f64 = range
                .map(|i| choose(m, i) * choose(n, k - i) * p[i] * q[k - i])
                .sum();
            sum / choose(m + n, k)
        })
        .collect()
}

/// Roots in [0, 1] of a polynomial in Bernstein form, by halving until signs change once, then by the
/// Illinois form of false position; ends of where it is 0 as far as f64 goes are among them.
fn roots(coefficients: Vec<f64>) -> Vec<f64> {
    let most = |c: &[f64]| c.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let nothing = 1e-15 * most(&coefficients);
    let mut found: Vec<f64> = Vec::new();
    let whole = coefficients.clone();
    let mut open = vec![(0.0_f64, 1.0_f64, coefficients)];
    while let Some((low, high, c)) = open.pop() {
        let n = c.len();
        let changes = c.windows(2).filter(|w| (w[0] > 0.0) != (w[1] > 0.0));
        let changes = changes.count();
        if changes == 0 && c.iter().all(|v| *v != 0.0) {
            continue;
        }
        if high - low < 1e-15 || most(&c) <= nothing {
            found.extend([low, high]);
            continue;
        }
        let ends = [c[0], c[n - 1]];
        if changes == 1 && ends[0] * ends[1] < 0.0 && c.iter().all(|v| *v != 0.0) {
            found.push(crossing(&whole, [low, high], ends));
            continue;
        }
        let (mut left, mut p) = (vec![c[0]], c);
        for level in 1..n {
            for i in 0..n - level {
                p[i] = 0.5 * (p[i] + p[i + 1]);
            }
            left.push(p[0]);
        }
        let middle = 0.5 * (low + high);
        open.push((low, middle, left));
        open.push((middle, high, p));
    }
    found.dedup_by(|a, b| (*a - *b).abs() < 1e-14);
    found
}

/// The one root of a polynomial between two places where its signs differ.
fn crossing(whole: &[f64], [mut a, mut b]: [f64; 2], [mut f, mut g]: [f64; 2]) -> f64 {
    for _ in 0..100 {
        let c = (a * g - b * f) / (g - f);
        let value = bernstein(whole, c);
        if value == 0.0 || (b - a).abs().min((c - b).abs()) < 1e-15 {
            return c;
        }
        if value * g < 0.0 {
            (a, f) = (b, g);
        } else {
            f *= 0.5;
        }
        (b, g) = (c, value);
    }
    0.5 * (a + b)
}

/// De Casteljau's value.
fn bernstein(coefficients: &[f64], t: f64) -> f64 {
    let mut p = [0.0; 64];
    let p = &mut p[..coefficients.len()];
    p.copy_from_slice(coefficients);
    for level in 1..p.len() {
        for i in 0..p.len() - level {
            p[i] = (1.0 - t) * p[i] + t * p[i + 1];
        }
    }
    p[0]
}

/// The distance of a point to a piece.
fn piece_distance(control: &[[f64; 3]], q: [f64; 2]) -> f64 {
    let count = if control.len() == 2 { 2 } else { 96 };
    let at = |t: f64| {
        let p = evaluate(control, t.clamp(0.0, 1.0));
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    let step = 1.0 / f64::from(count);
    let samples: Vec<f64> = (0..=count).map(|k| at(step * f64::from(k))).collect();
    let mut nearest = f64::INFINITY;
    for k in 0..samples.len() {
        nearest = nearest.min(samples[k]);
        let lowest = (k == 0 || samples[k] <= samples[k - 1])
            && (k + 1 == samples.len() || samples[k] <= samples[k + 1]);
        if !lowest {
            continue;
        }
        let golden = 0.618_033_988_749_894_9;
        let mut low = (step * (k as f64 - 1.0)).max(0.0);
        let mut high = (step * (k as f64 + 1.0)).min(1.0);
        for _ in 0..70 {
            let (c, d) = (high - golden * (high - low), low + golden * (high - low));
            if at(c) < at(d) {
                high = d;
            } else {
                low = c;
            }
        }
        nearest = nearest.min(at(0.5 * (low + high)));
    }
    nearest
}

/// The distance of a point of the first octant to an ellipsoid: the root of
/// Σ (rᵢ qᵢ / (s + rᵢ² - r²))² = 1 with the shortest half axis r (Eberly, Distance from a Point to an
/// Ellipsoid, 2013). On the planes of symmetry s may be 0, and the foot leaves them along that axis.
fn ellipsoid_distance(q: DVec3, radii: DVec3) -> f64 {
    let squares = radii * radii;
    let shortest = radii.min_element();
    let least = (0..3)
        .find(|&c| radii[c] == shortest)
        .expect("a shortest axis");
    let gaps = squares - squares[least];
    let term = |c: usize, s: f64| {
        if q[c] == 0.0 {
            0.0
        } else {
            q[c] / (s + gaps[c])
        }
    };
    let (mut low, mut high) = (0.0, (radii * q).length());
    for _ in 0..400 {
        let middle = 0.5 * (low + high);
        let sum: f64 = (0..3).map(|c| (radii[c] * term(c, middle)).powi(2)).sum();
        if sum > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut foot = DVec3::from([0, 1, 2].map(|c| squares[c] * term(c, high)));
    if q[least] == 0.0 {
        let others: f64 = (0..3)
            .filter(|&c| c != least)
            .map(|c| (foot[c] / radii[c]).powi(2))
            .sum();
        foot[least] = radii[least] * (1.0 - others).max(0.0).sqrt();
    }
    foot.distance(q)
}
