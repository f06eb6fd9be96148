//! A rational Bézier patch in a cell's coordinates, while it is cut.

use glam::DVec3;
use smallvec::SmallVec;

/// A homogeneous point (w x, w y, w z, w).
pub(super) type Point = [f64; 4];

/// A row of homogeneous points, or of other numbers along one parameter.
pub(super) type Row<T> = SmallVec<[T; 8]>;

/// A part of a surface: a rational patch with positive weights.
#[derive(Debug, Clone)]
pub(in super::super) struct Net {
    pub(in super::super) degrees: [usize; 2],
    /// Control points, the first index fastest.
    pub(in super::super) points: SmallVec<[Point; 16]>,
    /// +1 where X_u × X_v points out of the solid, -1 where it points in.
    pub(in super::super) sign: f64,
    /// How far a coordinate may be from the true one.
    pub(in super::super) slack: f64,
}

impl Net {
    /// The box of its control points.
    pub(in super::super) fn bounds(&self) -> [[f64; 2]; 3] {
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for h in &self.points {
            for k in 0..3 {
                let c = h[k] / h[3];
                bounds[k] = [bounds[k][0].min(c), bounds[k][1].max(c)];
            }
        }
        bounds
    }

    /// The axis that a nearly flat part is most across.
    pub(in super::super) fn across(&self) -> usize {
        let [n, m] = self.degrees;
        let corner = |i: usize, j: usize| {
            let h = self.points[i + (n + 1) * j];
            DVec3::new(h[0], h[1], h[2]) / h[3]
        };
        let normal = (corner(n, m) - corner(0, 0)).cross(corner(0, m) - corner(n, 0));
        let normal = normal.abs();
        (0..3).fold(0, |a, k| if normal[k] > normal[a] { k } else { a })
    }

    /// The parameter along which the corners are further apart.
    pub(in super::super) fn longer(&self) -> usize {
        let [n, m] = self.degrees;
        let at = |i: usize, j: usize| self.points[i + (n + 1) * j];
        let far = |a: Point, b: Point| {
            (0..3)
                .map(|k| (a[k] / a[3] - b[k] / b[3]).abs())
                .fold(0.0, f64::max)
        };
        let along = far(at(0, 0), at(n, 0)).max(far(at(0, m), at(n, m)));
        let across = far(at(0, 0), at(0, m)).max(far(at(n, 0), at(n, m)));
        usize::from(across > along)
    }

    /// Both sides of `t` along a parameter.
    pub(in super::super) fn split(&self, direction: usize, t: f64) -> [Self; 2] {
        let [n, m] = self.degrees.map(|d| d + 1);
        let (count, rows, step, stride) = if direction == 0 {
            (n, m, 1, n)
        } else {
            (m, n, n, 1)
        };
        let (mut lower, mut upper) = (self.clone(), self.clone());
        let mut work: Row<Point> = Row::new();
        for row in 0..rows {
            let at = |i: usize| row * stride + i * step;
            work.clear();
            work.extend((0..count).map(|i| self.points[at(i)]));
            for level in (0..count).rev() {
                lower.points[at(count - 1 - level)] = work[0];
                upper.points[at(level)] = work[level];
                for i in 0..level {
                    work[i] = std::array::from_fn(|c| (1.0 - t) * work[i][c] + t * work[i + 1][c]);
                }
            }
        }
        [lower, upper]
    }

    /// The same patch with its parameters exchanged.
    pub(super) fn transposed(&self) -> Self {
        let [n, m] = self.degrees.map(|d| d + 1);
        let points = (0..n).flat_map(|i| (0..m).map(move |j| self.points[i + n * j]));
        Self {
            degrees: [m - 1, n - 1],
            points: points.collect(),
            sign: -self.sign,
            slack: self.slack,
        }
    }

    /// The curve along the second parameter at `u`, and its derivative by `u`.
    pub(super) fn line(&self, u: f64) -> Line {
        let [n, m] = self.degrees;
        let (values, slopes) = basis(n, u);
        let mut line = Line {
            points: Row::new(),
            slopes: Row::new(),
            steps: Row::new(),
        };
        for row in self.points.chunks_exact(n + 1) {
            let (mut point, mut slope) = ([0.0; 4], [0.0; 4]);
            for ((h, b), d) in row.iter().zip(&values).zip(&slopes) {
                for c in 0..4 {
                    point[c] += b * h[c];
                    slope[c] += d * h[c];
                }
            }
            line.points.push(point);
            line.slopes.push(slope);
        }
        let pairs = line.points.windows(2);
        let steps = pairs.map(|h| std::array::from_fn(|c| real(m) * (h[1][c] - h[0][c])));
        line.steps = steps.collect();
        scale(&mut line.points);
        scale(&mut line.slopes);
        scale(&mut line.steps);
        line
    }
}

/// Multiplies Bernstein coefficients with their binomials.
fn scale(row: &mut Row<Point>) {
    let degree = row.len().saturating_sub(1);
    let mut binomial = 1.0;
    for k in 1..degree {
        binomial *= real(degree + 1 - k) / real(k);
        row[k] = row[k].map(|c| c * binomial);
    }
}

/// A polynomial of scaled Bernstein coefficients at `t`.
fn evaluate(row: &[Point], t: f64) -> Point {
    let s = 1.0 - t;
    let mut sum = row[0];
    let mut power = 1.0;
    for h in &row[1..] {
        power *= t;
        for c in 0..4 {
            sum[c] = sum[c] * s + h[c] * power;
        }
    }
    sum
}

/// A curve of constant first parameter, and how it moves with that: Bernstein coefficients times binomials.
pub(super) struct Line {
    points: Row<Point>,
    slopes: Row<Point>,
    /// The derivative along the curve.
    steps: Row<Point>,
}

impl Line {
    /// The point at `v` and the first component of X_u × X_v.
    pub(super) fn at(&self, v: f64) -> ([f64; 3], f64) {
        let point = evaluate(&self.points, v);
        let along = evaluate(&self.slopes, v);
        let across = evaluate(&self.steps, v);
        let w = 1.0 / point[3];
        let x = [point[0] * w, point[1] * w, point[2] * w];
        let slope = |h: Point| [(h[1] - x[1] * h[3]) * w, (h[2] - x[2] * h[3]) * w];
        let (a, b) = (slope(along), slope(across));
        (x, a[0] * b[1] - a[1] * b[0])
    }

    /// Where a form that is proved to rise or to fall along the curve is 0, kept within it, and whether it rises.
    pub(super) fn zero(&self, form: &[f64; 4]) -> (f64, bool) {
        let value = |h: Point| form[0] * h[0] + form[1] * h[1] + form[2] * h[2] + form[3] * h[3];
        let at = |t: f64| value(evaluate(&self.points, t));
        let (first, last) = (at(0.0), at(1.0));
        let rising = last > first;
        let (mut low, mut high) = (0.0, 1.0);
        let mut t = (first / (first - last)).clamp(0.0, 1.0);
        for _ in 0..60 {
            let off = at(t);
            if off == 0.0 {
                break;
            }
            if (off < 0.0) == rising {
                low = t;
            } else {
                high = t;
            }
            let step = t - off / value(evaluate(&self.steps, t));
            let next = if step >= low && step <= high {
                step
            } else {
                0.5 * (low + high)
            };
            let moved = (next - t).abs();
            t = next;
            if moved <= 2.0 * f64::EPSILON {
                break;
            }
        }
        (t, rising)
    }
}

/// The Bernstein polynomials of a degree at `t` and their derivatives.
pub(super) fn basis(degree: usize, t: f64) -> (Row<f64>, Row<f64>) {
    let s = 1.0 - t;
    let mut low: Row<f64> = Row::from_elem(0.0, degree + 1);
    low[0] = 1.0;
    for size in 1..degree {
        for k in (1..=size).rev() {
            low[k] = low[k] * s + low[k - 1] * t;
        }
        low[0] *= s;
    }
    if degree == 0 {
        return (low, Row::from_elem(0.0, 1));
    }
    let factor = real(degree);
    let before = |k: usize| if k > 0 { low[k - 1] } else { 0.0 };
    let here = |k: usize| if k < degree { low[k] } else { 0.0 };
    let values = (0..=degree).map(|k| here(k) * s + before(k) * t).collect();
    let slopes = (0..=degree).map(|k| factor * (before(k) - here(k)));
    let slopes = slopes.collect();
    (values, slopes)
}

/// A degree as a number.
#[allow(clippy::cast_precision_loss, reason = "a degree")]
pub(super) fn real(n: usize) -> f64 {
    n as f64
}
