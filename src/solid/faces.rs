//! The faces of a composite: the parts of its bodies' surfaces that separate its inside from its
//! outside.
//!
//! A point of a body's surface is on the composite's boundary where the composite holds one of the
//! two points a hair beside it and not the other. Along a circle of the surface that can only
//! change where the circle crosses another body, which the patch's [`Atlas`] narrows down. Where faces
//! coincide, the circles a hair beside are what crosses the faces that are left, see [`Remains`], and
//! the first body's faces count.

use super::atlas::{Atlas, Rival};
use super::body::Body;
use super::grazing::Crossing;
use super::path::Path;
use super::remains::Remains;
use super::rule::{Patch, Rule};
use super::terms::Term;
use crate::math::{Aabb, Side};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of quantities that are integrated: area, volume, first and second moments, and the
/// area by which the edges between faces may be off.
pub(super) const QUANTITIES: usize = 12;

/// Values of the quantities, in the order of [`QUANTITIES`].
pub(super) type Flux = [f64; QUANTITIES];

/// How near ends of stretches count as one for the [`Seen::signature`], as a share of the line.
const NARROW: f64 = 1e-10;

/// How many times the doubt in its ends a stretch must be long to count for it.
const UNSURE: f64 = 8.0;

/// A place where a line crosses a body.
#[derive(Debug, Clone, Copy)]
struct Cut {
    place: f64,
    /// How far it may be off, in the parameter of the line.
    doubt: f64,
    by: usize,
}

/// Bodies and terms about a common centre.
#[derive(Debug)]
pub(super) struct Faces {
    pub(super) bodies: Vec<Arc<Body>>,
    pub(super) terms: Vec<Term>,
    /// For each body those whose boxes touch its own.
    others: Vec<Vec<usize>>,
    sheets: Vec<Sheet>,
    /// The furthest coordinate of a body.
    reach: f64,
    /// How far beside a surface its two sides are asked.
    hair: f64,
    /// What a question costs to each body, compared with one of lines.
    prices: Vec<u64>,
    work: AtomicU64,
}

/// One patch of one body's surface.
#[derive(Debug)]
struct Sheet {
    body: usize,
    patch: Patch,
    /// What it may cross of other bodies, in their order.
    remains: Vec<(usize, Remains)>,
    atlas: Atlas,
}

/// What is known of a line of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    /// How far its crossings with other bodies may be from where they are taken for, all together, in scene units.
    doubt: f64,
    /// A number that stands for the order of its visible stretches and of the bodies that end them: while
    /// it stays the same, the ends move smoothly with the line, but where they pass an edge of a body.
    pub(super) signature: u64,
}

impl Faces {
    /// The faces of the terms over `bodies`, whose coordinates reach to `reach`.
    pub(super) fn new(bodies: Vec<Arc<Body>>, terms: Vec<Term>, reach: f64) -> Self {
        let boxes: Vec<Aabb> = bodies.iter().map(|b| b.bounds()).collect();
        let hair = 64.0 * f64::EPSILON * reach;
        let near = |i: usize, j: usize| touch(&boxes[i], &grown(&boxes[j], 4.0 * hair));
        let others: Vec<Vec<usize>> = (0..boxes.len())
            .map(|i| (0..boxes.len()).filter(|&j| j != i && near(i, j)).collect())
            .collect();
        let prices: Vec<u64> = bodies.iter().map(|b| b.price()).collect();
        let patches: Vec<(usize, Patch)> = (bodies.iter().enumerate())
            .flat_map(|(i, b)| b.patches().into_iter().map(move |p| (i, p)))
            .collect();
        let sheets = patches.into_par_iter().map(|(body, patch)| {
            // What a body sweeps meets no face of its own; its flat caps do.
            let own = patch.cap.map(|_| &body);
            let met = others[body].iter().chain(own).map(|&k| {
                let remains =
                    Remains::new(&bodies[body], patch, &bodies[k], k == body, 0.25 * hair);
                (k, remains)
            });
            let remains: Vec<(usize, Remains)> = met.collect();
            let rivals: Vec<Rival> = (remains.iter())
                .map(|(k, remains)| Rival {
                    number: *k,
                    body: &bodies[*k],
                    remains,
                    price: prices[*k],
                })
                .collect();
            let atlas = Atlas::new(&bodies[body], patch, &rivals, 4.0 * hair);
            Sheet {
                body,
                patch,
                remains,
                atlas,
            }
        });
        let sheets: Vec<Sheet> = sheets.collect();
        let work = sheets.iter().map(|s| s.atlas.work).sum();
        Self {
            prices,
            bodies,
            terms,
            others,
            sheets,
            reach,
            hair,
            work: AtomicU64::new(work),
        }
    }

    /// The stretches of all sheets between the parameters at which the bodies change that they may cross.
    pub(super) fn stretches(&self) -> Vec<(usize, [f64; 2])> {
        let of = |(number, sheet): (usize, &Sheet)| {
            let cuts = sheet.atlas.cuts();
            let pairs = cuts.windows(2).map(|w| (number, [w[0], w[1]]));
            pairs.collect::<Vec<_>>()
        };
        self.sheets.iter().enumerate().flat_map(of).collect()
    }

    /// Questions to bodies so far, for stretches of paths and for places of crossings, times their prices.
    pub(super) fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// The furthest coordinate of a body.
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    /// How far, in a sheet's parameter, an edge along a line may be from where the lines see it.
    pub(super) fn uncertain(&self, sheet: usize, t: f64) -> f64 {
        let Sheet { body, patch, .. } = self.sheets[sheet];
        let pace = self.bodies[body].pace(patch, t);
        if pace > 0.0 {
            4.0 * self.hair / pace
        } else {
            0.0
        }
    }

    fn holds(&self, point: DVec3) -> bool {
        self.terms.iter().any(|term| {
            let mut factors = term.factors.iter();
            factors.all(|f| f.side(self.bodies[f.body].side(point)) != Side::Outside)
        })
    }

    /// The quantities per unit of the patch's parameter, the [`extremes`](Self::extremes), and what was seen.
    pub(super) fn flux_and_extremes(&self, sheet: usize, t: f64) -> (Flux, [f64; 6], Option<Seen>) {
        let mut flux = [0.0; QUANTITIES];
        let mut extremes = [f64::NEG_INFINITY; 6];
        let Some(rule) = self.rule(sheet, t) else {
            return (flux, extremes, None);
        };
        let seen = self.visible(sheet, t, &rule, &mut |range, sign| {
            add_flux(&rule, range, sign, &mut flux);
            add_extremes(&rule, range, &mut extremes);
        });
        let Sheet { body, patch, .. } = self.sheets[sheet];
        flux[QUANTITIES - 1] = seen.doubt * self.bodies[body].pace(patch, t);
        (flux, extremes, Some(seen))
    }

    /// The largest coordinates along the six directions +x, +y, +z, -x, -y, -z.
    pub(super) fn extremes(&self, sheet: usize, t: f64) -> [f64; 6] {
        let mut extremes = [f64::NEG_INFINITY; 6];
        if let Some(rule) = self.rule(sheet, t) {
            self.visible(sheet, t, &rule, &mut |range, _| {
                add_extremes(&rule, range, &mut extremes);
            });
        }
        extremes
    }

    /// What is seen of the line at `t`; `None` where it has no extent.
    pub(super) fn seen(&self, sheet: usize, t: f64) -> Option<Seen> {
        let rule = self.rule(sheet, t)?;
        Some(self.visible(sheet, t, &rule, &mut |_, _| {}))
    }

    /// The line of a sheet at parameter `t`; `None` where it has no extent.
    fn rule(&self, sheet: usize, t: f64) -> Option<Rule> {
        let Sheet { body, patch, .. } = self.sheets[sheet];
        self.bodies[body].rule(patch, t, self.hair)
    }

    /// Where the line of a sheet crosses other bodies, in order.
    fn cuts(&self, sheet: &Sheet, t: f64, rule: &Rule) -> Vec<Cut> {
        let [a, b] = rule.range;
        let mut cuts = Vec::new();
        let mut found = Vec::new();
        for band in sheet.atlas.bands(t) {
            let k = band.body;
            let Some((_, remains)) = sheet.remains.iter().find(|r| r.0 == k) else {
                continue;
            };
            let range = band.share.map(|s| a + (b - a) * s);
            let search = |path: &Path, found: &mut Vec<Crossing>| {
                // The paths differ by a hair.
                let room = [0.125 * self.hair, 4.0 * self.hair];
                let searched = path.crossings(&self.bodies[k], remains, range, room, found);
                let work = searched.questions * self.prices[k];
                self.work.fetch_add(work, Ordering::Relaxed);
                searched.along
            };
            found.clear();
            let beside = remains.is_partial() || search(&rule.path, &mut found);
            if beside {
                found.clear();
                // Outward of its own cap there is nothing of a body.
                if k != sheet.body {
                    search(&rule.beside[0], &mut found);
                }
                search(&rule.beside[1], &mut found);
            }
            // What a distance is off by, over the slope at which it rises along the line.
            let off = if beside { 2.0 } else { 1.0 / 16.0 } * self.hair;
            cuts.extend(found.iter().map(|c| Cut {
                place: c.place,
                doubt: (off / c.slope).min(range[1] - range[0]),
                by: k,
            }));
        }
        cuts.sort_by(|p, q| p.place.total_cmp(&q.place).then(p.by.cmp(&q.by)));
        cuts
    }

    /// Calls `each` with the stretches of a rule on the composite's boundary, and +1 where its
    /// normal is the body's, -1 where it is the opposite.
    fn visible(
        &self,
        sheet: usize,
        t: f64,
        rule: &Rule,
        each: &mut impl FnMut([f64; 2], f64),
    ) -> Seen {
        let sheet = &self.sheets[sheet];
        let [a, b] = rule.range;
        let cuts = self.cuts(sheet, t, rule);
        let own = LINE + STRETCH * (cuts.len() as u64 + 1);
        self.work.fetch_add(own, Ordering::Relaxed);
        let mut signature = Signature::new(NARROW * (b - a));
        let mut from = a;
        let mut stretch: Option<([f64; 2], f64)> = None;
        let mut emit = |s: Option<([f64; 2], f64)>| {
            if let Some((range, sign)) = s
                && sign != 0.0
            {
                each(range, sign);
            }
        };
        let end = Cut {
            place: b,
            doubt: 0.0,
            by: usize::MAX,
        };
        let mut doubt = 0.0;
        // What edges may be off by: crossings at which nothing changes move none.
        let (mut moved, mut since) = (0.0, 0.0);
        let mut before: Option<f64> = None;
        for cut in cuts.iter().chain([&end]) {
            let to = cut.place;
            // Between the crossings of the two paths beside a point nothing is lost.
            if !(to - from > 1e-14 * (b - a)) {
                signature.add(0.0, 0.0, cut.by);
                since += cut.doubt;
                continue;
            }
            let m = 0.5 * (from + to);
            let [outside, inside] = [0, 1].map(|k| self.holds(rule.beside[k].at(m)));
            let mut sign = f64::from(u8::from(inside)) - f64::from(u8::from(outside));
            if sign != 0.0 && self.belongs_to_earlier(sheet.body, rule.path.at(m)) {
                sign = 0.0;
            }
            signature.add(to - from - UNSURE * (doubt + cut.doubt), sign, cut.by);
            #[allow(clippy::float_cmp, reason = "signs")]
            if before != Some(sign) {
                moved += since;
            }
            (before, since) = (Some(sign), cut.doubt);
            doubt = cut.doubt;
            match &mut stretch {
                Some((range, same)) if *same == sign => range[1] = to,
                _ => {
                    emit(stretch.take());
                    stretch = Some(([from, to], sign));
                }
            }
            from = to;
        }
        emit(stretch);
        Seen {
            doubt: (moved + since) * rule.path.speed(),
            signature: signature.number(),
        }
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

/// What a line takes that asks no body anything, and each of its stretches, in questions.
const LINE: u64 = 8;
const STRETCH: u64 = 2;

/// The direction number `k` of +x, +y, +z, -x, -y, -z.
pub(super) fn direction(k: usize) -> DVec3 {
    let axis = DVec3::AXES[k % 3];
    if k < 3 { axis } else { -axis }
}

fn grown(b: &Aabb, by: f64) -> Aabb {
    Aabb {
        min: b.min - by,
        max: b.max + by,
    }
}

fn touch(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// The order of the stretches of a line and of what ends them.
struct Signature {
    narrow: f64,
    hash: u64,
    /// The stretch that is not yet told: its sign and the body at its end.
    last: Option<(f64, usize)>,
}

impl Signature {
    fn new(narrow: f64) -> Self {
        Self {
            narrow,
            hash: 0xcbf2_9ce4_8422_2325,
            last: None,
        }
    }

    /// Goes on by a stretch of that length, ended by a body; what is narrow counts for nothing.
    fn add(&mut self, length: f64, sign: f64, by: usize) {
        #[allow(clippy::float_cmp, reason = "signs are exact")]
        match &mut self.last {
            Some((_, end)) if length <= self.narrow => *end = by.min(*end),
            None if length <= self.narrow => {}
            Some((same, end)) if *same == sign => *end = by,
            last => {
                if let Some(told) = last.replace((sign, by)) {
                    self.tell(told);
                }
            }
        }
    }

    /// One step of the FNV-1a hash of words.
    fn tell(&mut self, (sign, by): (f64, usize)) {
        for word in [sign.to_bits(), by as u64] {
            self.hash = (self.hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
            self.hash ^= self.hash >> 29;
        }
    }

    fn number(mut self) -> u64 {
        if let Some(told) = self.last.take() {
            self.tell((told.0, usize::MAX));
        }
        self.hash
    }
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
