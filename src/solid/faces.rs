//! The faces of a composite: the parts of its bodies' surfaces that separate its inside from its
//! outside.
//!
//! A point of a body's surface is on the composite's boundary where the composite holds one of the
//! two points a hair beside it and not the other. Along a circle of the surface that can only
//! change where the circle, moved by the hair, crosses another body. Where faces of several bodies
//! coincide, the first body's counts.

use super::body::Body;
use super::path::Path;
use super::rule::{Patch, Rule};
use super::seeds::Seeds;
use super::terms::Term;
use crate::math::{Aabb, Side};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of quantities that are integrated: area, volume, first and second moments, and the
/// length of the edges between faces.
pub(super) const QUANTITIES: usize = 12;

/// Values of the quantities, in the order of [`QUANTITIES`].
pub(super) type Flux = [f64; QUANTITIES];

/// Bodies and terms about a common centre.
#[derive(Debug)]
pub(super) struct Faces {
    pub(super) bodies: Vec<Arc<Body>>,
    pub(super) terms: Vec<Term>,
    /// For each body those whose boxes touch its own.
    others: Vec<Vec<usize>>,
    /// The furthest coordinate of a body.
    reach: f64,
    /// How far beside a surface its two sides are asked.
    hair: f64,
    /// What a question costs to each body, compared with one of lines.
    prices: Vec<u64>,
    work: AtomicU64,
}

/// One patch of one body's surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheet {
    body: usize,
    patch: Patch,
}

impl Sheet {
    /// A number for an order.
    pub(super) fn number(self) -> (usize, Patch) {
        (self.body, self.patch)
    }
}

impl Faces {
    /// The faces of the terms over `bodies`, whose coordinates reach to `reach`.
    pub(super) fn new(bodies: Vec<Arc<Body>>, terms: Vec<Term>, reach: f64) -> Self {
        let boxes: Vec<Aabb> = bodies.iter().map(|b| b.bounds()).collect();
        let others = (0..boxes.len())
            .map(|i| {
                let near = (0..boxes.len()).filter(|&j| j != i && touch(&boxes[i], &boxes[j]));
                near.collect()
            })
            .collect();
        let prices = bodies.iter().map(|b| b.price());
        Self {
            prices: prices.collect(),
            bodies,
            terms,
            others,
            reach,
            hair: 64.0 * f64::EPSILON * reach,
            work: AtomicU64::new(0),
        }
    }

    /// All sheets of all bodies, cut where the estimates need it; `None` where they cost more than
    /// `most` lines to cross.
    pub(super) fn sheets(&self, most: usize) -> Option<Vec<(Sheet, [f64; 2])>> {
        let mut sheets = Vec::new();
        let mut left = most;
        for (body, b) in self.bodies.iter().enumerate() {
            let others = self.others[body].iter().map(|&k| &*self.bodies[k]);
            // A cap is cut by the heights of its own edges too.
            let own = b.has_caps().then_some(&**b);
            let seeds = Seeds::new(b, others.chain(own));
            for (patch, cuts) in b.patches(&seeds) {
                let sheet = Sheet { body, patch };
                let cost = 1 + self.others[body].len();
                left = left.checked_sub(cost * (cuts.len() - 1))?;
                sheets.extend(cuts.windows(2).map(|w| (sheet, [w[0], w[1]])));
            }
        }
        Some(sheets)
    }

    /// Questions to bodies so far, for stretches of paths and for places of crossings, times their prices.
    pub(super) fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// How far beside a surface its two sides are asked, in scene units.
    pub(super) fn hair(&self) -> f64 {
        self.hair
    }

    /// The furthest coordinate of a body.
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    fn holds(&self, point: DVec3) -> bool {
        self.terms.iter().any(|term| {
            let mut factors = term.factors.iter();
            factors.all(|f| f.side(self.bodies[f.body].side(point)) != Side::Outside)
        })
    }

    /// The quantities per unit of the piece's parameter, and the [`extremes`](Self::extremes).
    pub(super) fn flux_and_extremes(&self, sheet: Sheet, t: f64) -> (Flux, [f64; 6]) {
        let mut flux = [0.0; QUANTITIES];
        let mut extremes = [f64::NEG_INFINITY; 6];
        let Some(rule) = self.rule(sheet, t) else {
            return (flux, extremes);
        };
        let edges = self.visible(sheet, &rule, &mut |range, sign| {
            add_flux(&rule, range, sign, &mut flux);
            add_extremes(&rule, range, &mut extremes);
        });
        #[allow(clippy::cast_precision_loss, reason = "a count of crossings")]
        let edges = edges as f64;
        flux[QUANTITIES - 1] = edges * self.bodies[sheet.body].pace(sheet.patch, t);
        (flux, extremes)
    }

    /// The largest coordinates along the six directions +x, +y, +z, -x, -y, -z.
    pub(super) fn extremes(&self, sheet: Sheet, t: f64) -> [f64; 6] {
        let mut extremes = [f64::NEG_INFINITY; 6];
        if let Some(rule) = self.rule(sheet, t) {
            self.visible(sheet, &rule, &mut |range, _| {
                add_extremes(&rule, range, &mut extremes);
            });
        }
        extremes
    }

    /// The line of a sheet at parameter `t`; `None` where it has no extent.
    fn rule(&self, sheet: Sheet, t: f64) -> Option<Rule> {
        self.bodies[sheet.body].rule(sheet.patch, t, self.hair)
    }

    /// Calls `each` with the stretches of a rule on the composite's boundary, and +1 where its
    /// normal is the body's, -1 where it is the opposite; returns the number of crossings.
    fn visible(&self, sheet: Sheet, rule: &Rule, each: &mut impl FnMut([f64; 2], f64)) -> usize {
        let [a, b] = rule.range;
        let mut cuts = Vec::new();
        let around = bounds(&rule.path, rule.range, 4.0 * self.hair);
        // What a body sweeps meets no face of its own; its flat caps do.
        let own = sheet.patch.cap.map(|_| &sheet.body);
        for &k in self.others[sheet.body].iter().chain(own) {
            let other = &self.bodies[k];
            if !touch(&around, &other.bounds()) {
                continue;
            }
            // The two paths differ by a hair, but where they run along the other body.
            let room = [0.125 * self.hair, 4.0 * self.hair];
            let search = |path: &Path, cuts: &mut Vec<f64>| {
                let found = path.crossings(other, rule.range, room, cuts);
                let work = found.questions * self.prices[k];
                self.work.fetch_add(work, Ordering::Relaxed);
                found.along
            };
            if search(&rule.beside[1], &mut cuts) {
                search(&rule.beside[0], &mut cuts);
            }
        }
        let crossings = cuts.len();
        cuts.push(b);
        cuts.sort_by(f64::total_cmp);
        let mut from = a;
        let mut stretch: Option<([f64; 2], f64)> = None;
        let mut emit = |s: Option<([f64; 2], f64)>| {
            if let Some((range, sign)) = s {
                each(range, sign);
            }
        };
        for to in cuts {
            // Between the crossings of the two paths beside a point nothing is lost.
            if !(to - from > 1e-14 * (b - a)) {
                continue;
            }
            let m = 0.5 * (from + to);
            let [outside, inside] = [0, 1].map(|k| self.holds(rule.beside[k].at(m)));
            let mut sign = f64::from(u8::from(inside)) - f64::from(u8::from(outside));
            if sign != 0.0 && self.belongs_to_earlier(sheet.body, rule.path.at(m)) {
                sign = 0.0;
            }
            match &mut stretch {
                Some((range, same)) if *same == sign => range[1] = to,
                _ => {
                    emit(stretch.take().filter(|s| s.1 != 0.0));
                    stretch = Some(([from, to], sign));
                }
            }
            from = to;
        }
        emit(stretch.filter(|s| s.1 != 0.0));
        crossings
    }

    /// Whether an earlier body's surface passes there too.
    fn belongs_to_earlier(&self, body: usize, point: DVec3) -> bool {
        let earlier = self.others[body].iter().filter(|&&k| k < body);
        earlier.map(|&k| &self.bodies[k]).any(|b| {
            let near = 2.0 * self.hair;
            let (low, high) = (b.bounds().min - near, b.bounds().max + near);
            point.cmpge(low).all()
                && point.cmple(high).all()
                && b.distance(point, b.side(point) != Side::Outside, near) < near
        })
    }
}

/// The direction number `k` of +x, +y, +z, -x, -y, -z.
pub(super) fn direction(k: usize) -> DVec3 {
    let axis = DVec3::AXES[k % 3];
    if k < 3 { axis } else { -axis }
}

fn bounds(path: &Path, range: [f64; 2], margin: f64) -> Aabb {
    let of = |k: usize| path.furthest(direction(k), range);
    Aabb {
        min: -DVec3::new(of(3), of(4), of(5)) - margin,
        max: DVec3::new(of(0), of(1), of(2)) + margin,
    }
}

fn touch(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Nodes and weights of Gauss's rule with 10 points on [-1, 1], the positive half.
const GAUSS: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_4),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

fn add_extremes(rule: &Rule, range: [f64; 2], extremes: &mut [f64; 6]) {
    for (k, best) in extremes.iter_mut().enumerate() {
        *best = best.max(rule.path.support(direction(k), range));
    }
}

/// Adds the integrals over a stretch. Along a circle they are trigonometric polynomials of degree
/// 4, along a line polynomials: eight points of a whole circle, or ten of a quarter, are exact. Where
/// the area is a root, quarters are halved until two results agree.
fn add_flux(rule: &Rule, [a, b]: [f64; 2], sign: f64, flux: &mut Flux) {
    let turning = matches!(rule.path, Path::Circle { .. });
    if turning && b - a >= TAU && rule.is_polynomial() {
        for k in 0..8 {
            add_point(rule, a + f64::from(k) * (TAU / 8.0), sign, TAU / 8.0, flux);
        }
        return;
    }
    let parts = if turning {
        ((b - a) / FRAC_PI_2).ceil().max(1.0)
    } else {
        1.0
    };
    let half = 0.5 * (b - a) / parts;
    let mut middle = a + half;
    while middle < b {
        let part = gauss(rule, middle, half, sign);
        let part = if rule.is_polynomial() {
            part
        } else {
            halved(rule, [middle, half], sign, &part, 0)
        };
        for (f, v) in flux.iter_mut().zip(part) {
            *f += v;
        }
        middle += 2.0 * half;
    }
}

/// The integrals over `middle ± half` with ten points.
fn gauss(rule: &Rule, middle: f64, half: f64, sign: f64) -> Flux {
    let mut flux = [0.0; QUANTITIES];
    for (x, w) in GAUSS {
        add_point(rule, middle - half * x, sign, half * w, &mut flux);
        add_point(rule, middle + half * x, sign, half * w, &mut flux);
    }
    flux
}

/// The integrals over `middle ± half`, in halves until `whole`, the result for both, is confirmed.
fn halved(rule: &Rule, [middle, half]: [f64; 2], sign: f64, whole: &Flux, depth: u32) -> Flux {
    const DEPTH: u32 = 12;
    let quarter = 0.5 * half;
    let parts = [middle - quarter, middle + quarter].map(|m| (m, gauss(rule, m, quarter, sign)));
    let sum: Flux = std::array::from_fn(|k| parts[0].1[k] + parts[1].1[k]);
    let agree = |k: usize| (sum[k] - whole[k]).abs() <= 1e-14 * sum[k].abs();
    // The area's integrand is the one that is not a polynomial.
    if depth == DEPTH || agree(0) && agree(1) {
        return sum;
    }
    let [a, b] = parts.map(|(m, part)| halved(rule, [m, quarter], sign, &part, depth + 1));
    std::array::from_fn(|k| a[k] + b[k])
}

/// Adds the integrands at one point. By the divergence theorem,
///
/// ```text
///   V = ∮ x·n / 3    ∭ x_i = ∮ x_i² n_i / 2    ∭ x_i² = ∮ x_i³ n_i / 3    ∭ x_i x_j = ∮ x_i² x_j n_i / 2
/// ```
fn add_point(rule: &Rule, s: f64, sign: f64, weight: f64, flux: &mut Flux) {
    let x = rule.path.at(s);
    let normal = rule.normal.at(s);
    let n = normal * (sign * weight);
    let values = [
        rule.area(normal) * weight,
        x.dot(n) / 3.0,
        0.5 * x.x * x.x * n.x,
        0.5 * x.y * x.y * n.y,
        0.5 * x.z * x.z * n.z,
        x.x * x.x * x.x * n.x / 3.0,
        x.y * x.y * x.y * n.y / 3.0,
        x.z * x.z * x.z * n.z / 3.0,
        0.5 * x.x * x.x * x.y * n.x,
        0.5 * x.y * x.y * x.z * n.y,
        0.5 * x.z * x.z * x.x * n.z,
    ];
    for (f, v) in flux.iter_mut().zip(values) {
        *f += v;
    }
}
