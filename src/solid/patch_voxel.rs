//! The share of a whole voxel that a solid of rational patches fills.
//!
//! In coordinates in which the voxel is the unit cube,
//!
//! ```text
//!   V = ∬_S x n_x dA + A                  S the solid's surface within
//!   A = ∮ y dz + B                        along S's boundary in the face x = 1, the solid on the left
//!   B = Σ ± z + [(1, 1, 1) is inside]     over S's crossings of the edge x = y = 1
//! ```
//!
//! The faces' patches are halved. One that lies within the cube gives its flux by Gauss's rule; one
//! that its planes cut is halved on to some level m, where it is two triangles, clipped. So the work
//! is along the cuts only. The triangles' error falls with 4^-m, which two levels together remove.
//!
//! * Error: the difference of the last two results, which is that of the coarser one.

use super::patch_fraction::{Line, Part};
use crate::math::Similarity;
use glam::DVec3;

/// Levels below that at which a patch is about as large as the voxel.
const COARSEST: usize = 4;
const FINEST: usize = 9;

/// Nodes and weights of Gauss's rules on [0, 1].
const GAUSS_3: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];
const GAUSS_6: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_18),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_5, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_18),
];

/// The voxel as a cube: where its clear corner is (1, 1, 1).
pub(super) struct Cube {
    /// From the voxel's centre to the corner, scene units.
    corner: DVec3,
    axes: [DVec3; 3],
}

impl Cube {
    pub(super) fn new(frame: &Similarity, corner: DVec3) -> Self {
        let scale = frame.scale();
        Self {
            corner,
            axes: [0, 1, 2].map(|i| frame.axis(i) * scale),
        }
    }

    /// A part of a face in the cube's coordinates.
    fn placed(&self, part: &Part) -> Part {
        let points = part.points.iter().map(|h| {
            let offset = self.axes[0] * h[0] + self.axes[1] * h[1] + self.axes[2] * h[2];
            let p = 0.5 * (offset / self.corner + h[3]);
            [p.x, p.y, p.z, h[3]]
        });
        // A mirror image turns the faces round.
        let mirror = self.corner.signum().element_product();
        Part {
            counts: part.counts,
            points: points.collect(),
            outward: part.outward * mirror,
        }
    }

    /// The share, where `first` says whether the clear corner is inside.
    pub(super) fn share(&self, parts: &[Part], first: bool, agree: f64) -> f64 {
        let mut all: Vec<Rules> = Vec::new();
        let placed = parts.iter().map(|part| {
            let known = all.iter().position(|r| r.counts == part.counts);
            let rules = known.unwrap_or_else(|| {
                all.push(Rules::new(part.counts));
                all.len() - 1
            });
            (self.placed(part), rules)
        });
        let parts: Vec<(Part, usize)> = placed.collect();
        let start = f64::from(u8::from(first));
        let mut finest = COARSEST + 2;
        loop {
            let mut sums = Sums::new(finest);
            for (part, rules) in &parts {
                sums.visit(part, &all[*rules], 0);
            }
            let value = |m: usize| start + sums.at(m);
            let better = |m: usize| value(m) + (value(m) - value(m - 1)) / 3.0;
            let share = better(finest);
            if (share - better(finest - 1)).abs() <= agree || finest == FINEST {
                return share;
            }
            finest += 1;
        }
    }
}

/// Sums over patches, by level.
struct Sums {
    /// Of patches within the cube, at the level they were found.
    within: Vec<f64>,
    /// Of triangles in place of the patches of a level that the cube's planes cut.
    cut: Vec<f64>,
}

/// Where a patch is to the cube.
enum Place {
    Beyond,
    Within,
    Cut,
}

impl Sums {
    fn new(finest: usize) -> Self {
        Self {
            within: vec![0.0; finest + 1],
            cut: vec![0.0; finest + 1],
        }
    }

    /// Everything with the triangles of level m.
    fn at(&self, m: usize) -> f64 {
        self.within[..=m].iter().sum::<f64>() + self.cut[m]
    }

    fn visit(&mut self, part: &Part, rules: &Rules, level: usize) {
        match place(part) {
            Place::Beyond => {}
            Place::Within => self.within[level] += part.outward * rules.flux(part, level),
            Place::Cut if level + 2 == self.cut.len() - 1 => self.leaf(part, rules, level),
            Place::Cut => {
                for half in part.halves(0) {
                    for quarter in half.halves(1) {
                        self.visit(&quarter, rules, level + 1);
                    }
                }
            }
        }
    }

    /// The triangles of the last three levels, on points of the finest.
    fn leaf(&mut self, part: &Part, rules: &Rules, level: usize) {
        let grid = rules.points(part);
        let at = |i: usize, j: usize| grid[j][i];
        for (more, step) in [4, 2, 1].into_iter().enumerate() {
            let mut sum = 0.0;
            for j in (0..4).step_by(step) {
                for i in (0..4).step_by(step) {
                    let (k, l) = (i + step, j + step);
                    let [a, b, c, d] = [at(i, j), at(k, j), at(k, l), at(i, l)];
                    if part.outward > 0.0 {
                        sum += clip([a, b, c]) + clip([a, c, d]);
                    } else {
                        sum += clip([a, c, b]) + clip([a, d, c]);
                    }
                }
            }
            self.cut[level + more] += sum;
        }
    }
}

fn place(part: &Part) -> Place {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for h in &part.points {
        let p = DVec3::new(h[0], h[1], h[2]) / h[3];
        low = low.min(p);
        high = high.max(p);
    }
    if low.cmpgt(DVec3::ONE).any() || high.cmplt(DVec3::ZERO).any() {
        Place::Beyond
    } else if low.cmpge(DVec3::ZERO).all() && high.cmple(DVec3::ONE).all() {
        Place::Within
    } else {
        Place::Cut
    }
}

/// Bernstein polynomials of a degree and their derivatives at the nodes of a rule.
struct Basis {
    weights: Vec<f64>,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
}

impl Basis {
    fn new(rule: &[(f64, f64)], degree: usize) -> Self {
        let all = |p: usize, t: f64| -> Vec<f64> {
            let mut row = vec![1.0];
            for _ in 0..p {
                let mut next = vec![0.0; row.len() + 1];
                for (k, b) in row.iter().enumerate() {
                    next[k] += b * (1.0 - t);
                    next[k + 1] += b * t;
                }
                row = next;
            }
            row
        };
        #[allow(clippy::cast_precision_loss, reason = "a degree")]
        let factor = degree as f64;
        let slopes = |t: f64| -> Vec<f64> {
            let low = all(degree - 1, t);
            (0..=degree)
                .map(|k| {
                    let before = if k > 0 { low[k - 1] } else { 0.0 };
                    let after = low.get(k).copied().unwrap_or(0.0);
                    factor * (before - after)
                })
                .collect()
        };
        Self {
            weights: rule.iter().map(|r| r.1).collect(),
            values: rule.iter().map(|r| all(degree, r.0)).collect(),
            slopes: rule.iter().map(|r| slopes(r.0)).collect(),
        }
    }
}

/// Gauss's rules for patches of one pair of degrees.
struct Rules {
    counts: [usize; 2],
    /// With 6 and with 3 points, in both directions.
    bases: [[Basis; 2]; 2],
    /// At quarters.
    quarters: [Basis; 2],
}

impl Rules {
    fn new(counts: [usize; 2]) -> Self {
        let both = |rule: &[(f64, f64)]| counts.map(|n| Basis::new(rule, n - 1));
        Self {
            counts,
            bases: [both(&GAUSS_6), both(&GAUSS_3)],
            quarters: both(&[0.0, 0.25, 0.5, 0.75, 1.0].map(|t| (t, 0.0))),
        }
    }

    /// Points at quarters of both parameters, the first within the rows.
    fn points(&self, part: &Part) -> [[DVec3; 5]; 5] {
        let [first, second] = &self.quarters;
        let columns = self.counts[0];
        let mut line = Line::from_elem([0.0; 4], columns);
        let mut grid = [[DVec3::ZERO; 5]; 5];
        for (row, values) in grid.iter_mut().zip(&second.values) {
            for i in 0..columns {
                let mut value = [0.0; 4];
                for (j, b) in values.iter().enumerate() {
                    let h = part.points[j * columns + i];
                    for c in 0..4 {
                        value[c] += b * h[c];
                    }
                }
                line[i] = value;
            }
            for (place, values) in row.iter_mut().zip(&first.values) {
                let mut h = [0.0; 4];
                for (b, p) in values.iter().zip(&line) {
                    for c in 0..4 {
                        h[c] += b * p[c];
                    }
                }
                *place = DVec3::new(h[0], h[1], h[2]) / h[3];
            }
        }
        grid
    }

    /// ∬ x (X_u × X_v)_x du dv over a patch found at a level: where it is as large as the voxel it is
    /// halved until two results agree, where it is small fewer points are as good.
    fn flux(&self, part: &Part, level: usize) -> f64 {
        match level {
            0..=2 => self.adaptive(part, 0),
            3 | 4 => self.gauss(part, 0),
            _ => self.gauss(part, 1),
        }
    }

    fn adaptive(&self, part: &Part, depth: u32) -> f64 {
        const DEPTH: u32 = 5;
        let whole = self.gauss(part, 0);
        let quarters = part.halves(0).map(|half| half.halves(1));
        let sum: f64 = quarters.iter().flatten().map(|q| self.gauss(q, 0)).sum();
        if depth == DEPTH || (whole - sum).abs() <= 1e-9 {
            return sum;
        }
        let deeper = quarters.iter().flatten();
        deeper.map(|q| self.adaptive(q, depth + 1)).sum()
    }

    fn gauss(&self, part: &Part, rule: usize) -> f64 {
        let [first, second] = &self.bases[rule];
        let columns = self.counts[0];
        let mut line = Line::from_elem([0.0; 4], columns);
        let mut slopes = line.clone();
        let mut sum = 0.0;
        for ((values, steps), wv) in (second.values.iter())
            .zip(&second.slopes)
            .zip(&second.weights)
        {
            for i in 0..columns {
                let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
                for (j, (b, d)) in values.iter().zip(steps).enumerate() {
                    let h = part.points[j * columns + i];
                    for c in 0..4 {
                        value[c] += b * h[c];
                        slope[c] += d * h[c];
                    }
                }
                line[i] = value;
                slopes[i] = slope;
            }
            for ((values, steps), wu) in
                (first.values.iter()).zip(&first.slopes).zip(&first.weights)
            {
                let (mut point, mut along, mut across) = ([0.0; 4], [0.0; 4], [0.0; 4]);
                for i in 0..columns {
                    for c in 0..4 {
                        point[c] += values[i] * line[i][c];
                        along[c] += steps[i] * line[i][c];
                        across[c] += values[i] * slopes[i][c];
                    }
                }
                let w = 1.0 / point[3];
                let x = [point[0] * w, point[1] * w, point[2] * w];
                let slope = |h: [f64; 4]| [(h[1] - x[1] * h[3]) * w, (h[2] - x[2] * h[3]) * w];
                let (a, b) = (slope(along), slope(across));
                sum += wu * wv * x[0] * (a[0] * b[1] - a[1] * b[0]);
            }
        }
        sum
    }
}

/// A polygon while it is clipped: a triangle has at most three and six corners more.
struct Clipped {
    corners: [DVec3; 9],
    count: usize,
}

impl Clipped {
    fn push(&mut self, p: DVec3) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = p;
            self.count += 1;
        }
    }

    /// What is left where `height` is not negative; points on that plane are put there.
    fn cut(&self, height: impl Fn(DVec3) -> f64, put: impl Fn(&mut DVec3)) -> Self {
        let mut left = Self {
            corners: self.corners,
            count: 0,
        };
        let corners = &self.corners[..self.count];
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[if i + 1 == corners.len() { 0 } else { i + 1 }];
            let (ha, hb) = (height(a), height(b));
            if ha >= 0.0 {
                left.push(a);
            }
            if (ha >= 0.0) != (hb >= 0.0) {
                let mut at = a + (b - a) * (ha / (ha - hb));
                put(&mut at);
                left.push(at);
            }
        }
        left
    }
}

/// ∬ x n_x dA over a triangle.
fn triangle_flux([a, b, c]: [DVec3; 3]) -> f64 {
    let (u, v) = (b - a, c - a);
    (a.x + b.x + c.x) / 6.0 * (u.y * v.z - u.z * v.y)
}

/// The sums of a triangle, clipped.
fn clip(triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if high.cmplt(DVec3::ZERO).any() || low.cmpgt(DVec3::ONE).any() {
        return 0.0;
    }
    if low.cmpge(DVec3::ZERO).all() && high.cmple(DVec3::ONE).all() {
        return triangle_flux(triangle);
    }
    let mut polygon = Clipped {
        corners: [a; 9],
        count: 0,
    };
    polygon.push(a);
    polygon.push(b);
    polygon.push(c);
    for axis in 0..3 {
        if low[axis] < 0.0 {
            polygon = polygon.cut(|p| p[axis], |p| p[axis] = 0.0);
        }
    }
    for axis in [1, 2] {
        if high[axis] > 1.0 {
            polygon = polygon.cut(|p| 1.0 - p[axis], |p| p[axis] = 1.0);
        }
    }
    // The last cut leaves one edge in the face x = 1.
    let (mut from, mut to) = (None, None);
    let mut left = Clipped {
        corners: [a; 9],
        count: 0,
    };
    let corners = &polygon.corners[..polygon.count];
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[if i + 1 == corners.len() { 0 } else { i + 1 }];
        let (da, db) = (1.0 - a.x, 1.0 - b.x);
        if da >= 0.0 {
            left.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            let mut cut = a + (b - a) * (da / (da - db));
            cut.x = 1.0;
            left.push(cut);
            if da >= 0.0 {
                from = Some(cut);
            } else {
                to = Some(cut);
            }
        }
    }
    let mut sum = 0.0;
    for i in 2..left.count {
        sum += triangle_flux([left.corners[0], left.corners[i - 1], left.corners[i]]);
    }
    if let (Some(from), Some(to)) = (from, to) {
        // The solid in the face has the edge the other way round: from `to` to `from`.
        sum += 0.5 * (from.y + to.y) * (from.z - to.z);
        // Where its boundary comes to the edge y = 1 an inside stretch of that begins.
        let end = |p: DVec3| if p.y == 1.0 { p.z } else { 0.0 };
        sum += end(to) - end(from);
    }
    sum
}
