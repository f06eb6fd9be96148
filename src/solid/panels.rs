//! The integrals over the faces of a composite along the parameter of each patch.
//!
//! While the order of a line's visible stretches, and of the bodies that end them, stays the same, the integrand is
//! smooth in the line's parameter, but for edges of a body that the ends pass. Where the order changes a line touches a
//! surface, and the integrand has a square root, or it steps. Such a place is closed in on between two lines of
//! different order down to the resolution of the parameter; the stretches between two such places are integrated in a
//! variable in which square roots at the ends are smooth:
//!
//! ```text
//!   t = a + w u² (3 - 2 u)       w = b - a, 0 <= u <= 1;   a + w u² or b - w (1 - u)² with one such end
//! ```
//!
//! by Gauss-Kronrod panels, halved where the estimates are largest.

use super::faces::{Faces, Flux, QUANTITIES, Seen};
use crate::math::quadrature::{Integral, graded, panel_of};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Estimated errors to reach, relative to area, volume, volume times size and its square.
const TOLERANCE: f64 = 1e-12;
/// Panels replaced between two looks at the work.
const BATCH: usize = 64;
/// How often a stretch is cut where the order of its lines changes, one cut within another.
const MOST_CUTS: u32 = 6;
/// Changes of order between the lines of one panel that are closed in on; of more it is halved.
const MOST_CHANGES: usize = 4;
/// Places of the quantities.
pub(super) const AREA: usize = 0;
pub(super) const VOLUME: usize = 1;
pub(super) const FIRST: usize = 2;
pub(super) const SQUARES: usize = 5;
pub(super) const PRODUCTS: usize = 8;
const EDGES: usize = 11;

/// A line of a sheet: its parameter, and what stands for the order of its stretches.
type Line = (f64, u64);

/// A stretch of a sheet.
#[derive(Debug, Clone, Copy)]
struct Span {
    sheet: usize,
    t: [f64; 2],
    /// At which ends the order of the lines changes.
    graded: [bool; 2],
    /// How many cuts it is within.
    cuts: u32,
}

impl Span {
    /// The parameter of the sheet and its derivative at `u` of [0, 1].
    fn place(&self, u: f64) -> (f64, f64) {
        graded(self.t, self.graded, u)
    }
}

/// A part of a span with its integrals.
pub(super) struct Panel {
    span: Span,
    /// Within [0, 1].
    u: [f64; 2],
    pub(super) integrals: [Integral; QUANTITIES],
    /// For each direction the furthest circle looked at: how far it reaches, and its parameter.
    pub(super) furthest: [(f64, f64); 6],
    /// The first and the last line.
    ends: Option<[Line; 2]>,
    /// Neighbouring lines of different order.
    changes: Vec<[Line; 2]>,
    /// By how much the integrands differ from line to line, over the whole panel.
    spread: [f64; QUANTITIES],
    /// The integrands of the first and the last line, per unit of the sheet's parameter.
    verges: [Flux; 2],
}

impl Panel {
    fn new(faces: &Faces, span: Span, u: [f64; 2]) -> Self {
        let mut furthest = [(f64::NEG_INFINITY, span.place(u[0]).0); 6];
        let mut lines: Vec<Line> = Vec::new();
        let mut low = [f64::INFINITY; QUANTITIES];
        let mut high = [f64::NEG_INFINITY; QUANTITIES];
        let (mut verges, mut outermost) =
            ([[0.0; QUANTITIES]; 2], [f64::INFINITY, f64::NEG_INFINITY]);
        let mut flux = |u: f64| {
            let (t, slope) = span.place(u);
            let (flux, extremes, seen) = faces.flux_and_extremes(span.sheet, t);
            for (best, reach) in furthest.iter_mut().zip(extremes) {
                if reach > best.0 {
                    *best = (reach, t);
                }
            }
            lines.extend(seen.map(|s: Seen| (t, s.signature)));
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip(flux) {
                (*low, *high) = (low.min(value), high.max(value));
            }
            if u < outermost[0] {
                (outermost[0], verges[0]) = (u, flux);
            }
            if u > outermost[1] {
                (outermost[1], verges[1]) = (u, flux);
            }
            flux.map(|f| f * slope)
        };
        let integrals = panel_of(&mut flux, u[0], u[1]);
        lines.sort_by(|p, q| p.0.total_cmp(&q.0));
        let pairs = lines.windows(2).filter(|w| w[0].1 != w[1].1);
        let changes = pairs.map(|w| [w[0], w[1]]).collect();
        let ends = lines.first().zip(lines.last()).map(|(a, b)| [*a, *b]);
        let width = (span.place(u[1]).0 - span.place(u[0]).0).abs();
        let spread = std::array::from_fn(|k| (high[k] - low[k]) * width);
        Self {
            span,
            u,
            integrals,
            furthest,
            ends,
            changes,
            spread,
            verges,
        }
    }

    pub(super) fn sheet(&self) -> usize {
        self.span.sheet
    }

    /// The parameters of the sheet between which it lies.
    pub(super) fn range(&self) -> [f64; 2] {
        self.u.map(|u| self.span.place(u).0)
    }

    /// Whether the other goes on where this one ends.
    pub(super) fn is_followed_by(&self, other: &Self) -> bool {
        #[allow(clippy::float_cmp, reason = "halving keeps the ends")]
        let meets = self.range()[1] == other.range()[0];
        meets && self.sheet() == other.sheet()
    }

    /// What the place may be off by at which this one ends and the other begins, of quantity `k`: where the integrand
    /// steps there, an edge runs along the line, and is found as the lines see it, to within hairs.
    pub(super) fn joint(&self, other: &Self, k: usize, faces: &Faces) -> f64 {
        if !(self.is_followed_by(other) && self.is_graded(1) && other.is_graded(0)) {
            return 0.0;
        }
        let step = (other.verges[0][k] - self.verges[1][k]).abs();
        step * faces.uncertain(self.sheet(), self.range()[1])
    }

    /// Whether it can be cut or halved at all.
    fn divides(&self) -> bool {
        let [a, b] = self.range();
        b - a > 1e-13 * a.abs().max(b.abs())
    }

    /// Whether an end is that of its span, where the order of the lines changes.
    fn is_graded(&self, end: usize) -> bool {
        #[allow(clippy::float_cmp, reason = "halving keeps the ends")]
        let whole = self.u[end] == [0.0, 1.0][end];
        whole && self.span.graded[end]
    }

    /// Whether its edges are known: where they are as uncertain as its area is large, the order of its lines is
    /// that of roundings.
    fn is_certain(&self) -> bool {
        self.integrals[EDGES].value.abs() <= 0.01 * self.integrals[AREA].value.abs()
    }

    /// Whether the order of its lines changes and may be followed up.
    fn is_to_be_cut(&self) -> bool {
        let may = self.span.cuts < MOST_CUTS && self.is_certain() && self.divides();
        !self.changes.is_empty() && may
    }

    /// What takes its place.
    fn parts(&self, faces: &Faces) -> Vec<(Span, [f64; 2])> {
        if self.is_to_be_cut() && self.changes.len() <= MOST_CHANGES {
            let mut places = Vec::new();
            for change in &self.changes {
                close_in(faces, self.sheet(), *change, &mut places);
            }
            self.cut_at(&places)
        } else {
            self.halves()
        }
    }

    fn halves(&self) -> Vec<(Span, [f64; 2])> {
        let [a, b] = self.u;
        let m = 0.5 * (a + b);
        let mut span = self.span;
        if !self.changes.is_empty() {
            span.cuts += 1;
        }
        vec![(span, [a, m]), (span, [m, b])]
    }

    /// The spans between its ends and the places, in order, where the order of its lines changes.
    fn cut_at(&self, places: &[f64]) -> Vec<(Span, [f64; 2])> {
        let [from, to] = self.range();
        let mut graded = self.is_graded(0);
        let mut spans = Vec::new();
        let mut start = from;
        let mut add = |start: f64, end: f64, graded: [bool; 2]| {
            if end > start {
                let span = Span {
                    t: [start, end],
                    graded,
                    cuts: self.span.cuts + 1,
                    ..self.span
                };
                spans.push((span, [0.0, 1.0]));
            }
        };
        for &place in places {
            let place = place.clamp(start, to);
            add(start, place, [graded, true]);
            (start, graded) = (place, true);
        }
        #[allow(clippy::float_cmp, reason = "clamped to it")]
        let ends_there = places.last().is_some_and(|&p| p >= to);
        add(start, to, [graded, self.is_graded(1) || ends_there]);
        spans
    }

    /// The error of quantity `k` that is not the panel's: what the edges may be off by, which is at most as far from
    /// the centre as a body; and the rounding of the sum.
    pub(super) fn noise(&self, k: usize, faces: &Faces) -> f64 {
        let power = match k {
            AREA => 0,
            VOLUME => 1,
            FIRST..SQUARES => 2,
            _ => 3,
        };
        let moved = self.integrals[EDGES].value.abs() * faces.reach().powi(power);
        // Where the order of the lines is unknown, any of them may stand for the others.
        let unknown = self.spread[k] * self.unknown_share();
        moved + unknown + 4.0 * f64::EPSILON * self.integrals[k].value.abs()
    }

    /// The share of its width over which the order of its lines is not known: all, where it changes between points of
    /// the rule; where it does beyond the outermost, what is left there.
    fn unknown_share(&self) -> f64 {
        let (Some([first, last]), [from, to]) = (self.ends, self.range()) else {
            return 0.0;
        };
        #[allow(clippy::float_cmp, reason = "places are kept")]
        let at_verge = |c: &[Line; 2]| c[0].0 == first.0 || c[1].0 == last.0;
        if !self.changes.iter().all(at_verge) {
            return 1.0;
        }
        let gaps: f64 = self.changes.iter().map(|c| c[1].0 - c[0].0).sum();
        (gaps / (to - from)).min(1.0)
    }

    /// The largest error as a multiple of its tolerance.
    fn excess(&self, tolerances: &[f64; QUANTITIES]) -> f64 {
        let errors = self.integrals.iter().zip(tolerances);
        errors.fold(0.0, |m, (i, t)| m.max(i.error / t))
    }
}

/// The places between two lines of different order where it changes, to the resolution of the parameter.
fn close_in(faces: &Faces, sheet: usize, [mut from, to]: [Line; 2], places: &mut Vec<f64>) {
    for _ in 0..MOST_CHANGES {
        let (mut low, mut high) = (from.0, to);
        loop {
            let middle = 0.5 * (low + high.0);
            if !(middle > low && middle < high.0 && high.0 - low > f64::EPSILON * high.0.abs()) {
                break;
            }
            match faces.seen(sheet, middle) {
                Some(seen) if seen.signature != from.1 => high = (middle, seen.signature),
                _ => low = middle,
            }
        }
        places.push(0.5 * (low + high.0));
        if high.1 == to.1 {
            return;
        }
        from = high;
    }
}

/// Panels in order whose estimated errors sum to the tolerances, or the best that `most` questions give; `None` where
/// even the first take more.
pub(super) fn integrated(faces: &Faces, size: f64, most: u64) -> Option<Vec<Panel>> {
    let stretches = faces.stretches().into_iter().map(|(sheet, t)| {
        let span = Span {
            sheet,
            t,
            graded: [false; 2],
            cuts: 0,
        };
        (span, [0.0, 1.0])
    });
    let mut panels = made(faces, stretches.collect(), most)?;
    sort(&mut panels);
    loop {
        let places = joints(faces, &panels);
        let mut chosen: Vec<usize> = places.keys().copied().collect();
        let others = worst(&panels, faces, &tolerances(&panels, size));
        chosen.extend(others.into_iter().filter(|i| !places.contains_key(i)));
        let mut replaced = Vec::new();
        for batch in chosen.chunks(BATCH) {
            let parts = batch.par_iter().flat_map(|&i| match places.get(&i) {
                Some(places) => panels[i].cut_at(places),
                None => panels[i].parts(faces),
            });
            let Some(parts) = made(faces, parts.collect(), most) else {
                break;
            };
            replaced.extend_from_slice(batch);
            panels.extend(parts);
        }
        let all = replaced.len() == chosen.len();
        replaced.sort_unstable();
        for &i in replaced.iter().rev() {
            panels.swap_remove(i);
        }
        sort(&mut panels);
        if !all || chosen.is_empty() {
            return Some(panels);
        }
    }
}

fn sort(panels: &mut [Panel]) {
    let start = |p: &Panel| p.range()[0];
    panels.sort_by(|a, b| {
        let by_sheet = a.sheet().cmp(&b.sheet());
        by_sheet.then(start(a).total_cmp(&start(b)))
    });
}

/// For panels beside which the order of the lines changes without a cut, where it does: between the last line of one
/// and the first of the next. No line of either may be beyond the change.
fn joints(faces: &Faces, panels: &[Panel]) -> BTreeMap<usize, Vec<f64>> {
    let open = |&i: &usize| {
        let (a, b) = (&panels[i], &panels[i + 1]);
        let changes = a.ends.zip(b.ends).is_some_and(|(a, b)| a[1].1 != b[0].1);
        let cut = a.is_graded(1) && b.is_graded(0);
        let mended = |p: &Panel| p.span.cuts < MOST_CUTS && p.is_certain() && p.divides();
        a.is_followed_by(b) && changes && !cut && mended(a) && mended(b)
    };
    let pairs: Vec<usize> = (0..panels.len().saturating_sub(1)).filter(open).collect();
    let found = pairs.into_par_iter().filter_map(|i| {
        let [from, to] = [panels[i].ends?[1], panels[i + 1].ends?[0]];
        let mut places = Vec::new();
        close_in(faces, panels[i].sheet(), [from, to], &mut places);
        Some((i, places))
    });
    let mut all: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (i, places) in found.collect::<Vec<_>>() {
        for k in [i, i + 1] {
            all.entry(k).or_default().extend(&places);
        }
    }
    all
}

/// The panels of all stretches; `None` where the work passes `most`, or has passed it, whatever the order of the work.
fn made(faces: &Faces, work: Vec<(Span, [f64; 2])>, most: u64) -> Option<Vec<Panel>> {
    work.into_par_iter()
        .map(|(span, u)| {
            let panel = (faces.work() <= most).then(|| Panel::new(faces, span, u));
            panel.filter(|_| faces.work() <= most)
        })
        .collect()
}

/// The panels to be replaced for the rest to be good: those between whose lines the order changes, and of those with
/// the largest errors the ones that halving mends, the largest first.
fn worst(panels: &[Panel], faces: &Faces, tolerances: &[f64; QUANTITIES]) -> Vec<usize> {
    let excess = |(i, p): (usize, &Panel)| (p.excess(tolerances), i);
    let mut order: Vec<(f64, usize)> = panels.iter().enumerate().map(excess).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut left: f64 = order.iter().map(|o| o.0).sum();
    // Halving does not mend rounding, but where that is larger at one end it parts the ends.
    let noisy = |p: &Panel| {
        let edges = p.integrals[EDGES];
        let wide = p.u[1] - p.u[0] > 1.0 / 128.0;
        let even = !wide || edges.error <= 0.05 * edges.value.abs();
        let small = |k: usize| tolerances[k] / 64.0;
        let least = |k: usize| {
            let noise = if even { p.noise(k, faces) } else { 0.0 };
            noise.max(1e-3 * small(k))
        };
        let over = |k: usize| p.integrals[k].error > least(k);
        let apart = !even && (AREA..EDGES).any(|k| p.noise(k, faces) > small(k));
        !apart && !(AREA..EDGES).any(over)
    };
    let chosen = order.iter().filter(|(excess, i)| {
        let panel = &panels[*i];
        let more = left > 0.5;
        left -= excess;
        panel.is_to_be_cut() || more && panel.divides() && !noisy(panel)
    });
    chosen.map(|o| o.1).collect()
}

/// Errors that are good enough.
fn tolerances(panels: &[Panel], size: f64) -> [f64; QUANTITIES] {
    let sum = |k: usize| panels.iter().map(|p| p.integrals[k].value).sum::<f64>();
    let area = sum(AREA).abs().max(f64::MIN_POSITIVE);
    // Below this the volume is rounding.
    let volume = sum(VOLUME).abs().max(1e-12 * area * size);
    let mut tolerances = [f64::INFINITY; QUANTITIES];
    tolerances[AREA] = TOLERANCE * area;
    tolerances[VOLUME] = TOLERANCE * volume;
    tolerances[FIRST..SQUARES].fill(TOLERANCE * volume * size);
    tolerances[SQUARES..EDGES].fill(TOLERANCE * volume * size * size);
    tolerances
}
