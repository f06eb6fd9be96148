//! A patch in strips between the zeros of several functions.

use super::domain::{Form, Look};
use super::net::{Line, Net};
use super::proof::Graph;
use smallvec::SmallVec;

/// Functions at most that are told apart on one patch.
pub(super) const MOST: usize = 6;

/// Shares of a patch that are not cut off it.
const LEAST: f64 = 1e-6;

/// Zeros that are graphs over the first parameter and do not cross, in order, and L between them.
#[derive(Debug, Clone)]
pub(super) struct Strips {
    zeros: SmallVec<[Form; 4]>,
    /// One more than zeros; `None` where L is 0.
    pub(super) regions: SmallVec<[Option<Form>; 4]>,
}

/// What comes of trying to see a patch in strips.
#[allow(
    clippy::large_enum_variant,
    reason = "each is taken apart where it is made"
)]
pub(super) enum Attempt {
    /// Nothing is known.
    None,
    /// The patch should be cut at a place along its first parameter; its parameters may have been exchanged.
    Cut(Net, f64),
    Strips(Net, SmallVec<[Graph; 4]>, Strips),
}

/// Sees a patch in strips, where no more than `most` functions change sign on it.
pub(super) fn attempt(net: &Net, look: &Look, most: usize) -> Attempt {
    if look.open.len() > most {
        return Attempt::None;
    }
    let views = [net.clone(), net.transposed()];
    let of = |view: &Net| -> SmallVec<[Option<Graph>; 4]> {
        let graphs = look.open.iter().map(|form| Graph::new(view, form));
        graphs.map(|g| g.filter(Graph::is_proved)).collect()
    };
    let graphs = [of(&views[0]), of(&views[1])];
    let count = |o: usize| graphs[o].iter().flatten().count();
    let overshoot = |o: usize| {
        let all = graphs[o].iter().flatten();
        all.fold(0.0_f64, |m, g| m.max(g.overshoot()))
    };
    let turned = count(1) > count(0) || count(1) == count(0) && overshoot(1) < overshoot(0);
    let [first, second] = views;
    let [a, b] = graphs;
    let (view, other, own, others) = if turned {
        (second, first, b, a)
    } else {
        (first, second, a, b)
    };
    // A zero that runs across the strips: where it passes the patch's ends it can be cut off, or comes to be a graph.
    for (k, form) in look.open.iter().enumerate() {
        if own[k].is_some() {
            continue;
        }
        if others[k].is_some() {
            for end in [0.0, 1.0] {
                let (at, _) = other.line(end).zero(form);
                if at > LEAST && at < 1.0 - LEAST {
                    return Attempt::Cut(view, at);
                }
            }
        }
        return Attempt::None;
    }
    let graphs: SmallVec<[Graph; 4]> = own.into_iter().flatten().collect();
    let heavy = view.points.iter().fold(0.0_f64, |m, h| m.max(h[3]));
    let room = 4.0 * view.slack * heavy;
    if let Some(at) = graphs.iter().find_map(|g| g.exit(room)) {
        return Attempt::Cut(view, at);
    }
    if let Some(at) = crossing(&view, &look.open, &graphs, room) {
        return Attempt::Cut(view, at);
    }
    let middle = view.line(0.5);
    let mut zeros: SmallVec<[(f64, Form); 4]> = look
        .open
        .iter()
        .map(|form| (middle.zero(form).0, *form))
        .collect();
    zeros.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = |k: usize| {
        let below = if k > 0 { zeros[k - 1].0 } else { 0.0 };
        let above = zeros.get(k).map_or(1.0, |z| z.0);
        0.5 * (below + above)
    };
    let regions = (0..=zeros.len()).map(|k| look.form_at(&middle.at(ends(k)).0));
    let strips = Strips {
        regions: regions.collect(),
        zeros: zeros.iter().map(|z| z.1).collect(),
    };
    Attempt::Strips(view, graphs, strips)
}

/// Where two of the zeros cross, or the middle where it is not proved that they do not; `None` where it is.
fn crossing(net: &Net, forms: &[Form], graphs: &[Graph], room: f64) -> Option<f64> {
    if forms.len() < 2 {
        return None;
    }
    let places = |line: &Line| -> SmallVec<[f64; 8]> {
        forms.iter().map(|form| line.zero(form).0).collect()
    };
    let (first, last) = (places(&net.line(0.0)), places(&net.line(1.0)));
    for i in 1..forms.len() {
        for j in 0..i {
            let near = 1e-13 + graphs[i].room(room) + graphs[j].room(room);
            let (a, b) = (first[i] - first[j], last[i] - last[j]);
            if a.abs() > near && b.abs() > near && (a > 0.0) != (b > 0.0) {
                return Some(meeting(net, &forms[i], &forms[j], a, b));
            }
            if !graphs[i].is_apart(&graphs[j]) {
                return Some(0.5);
            }
        }
    }
    None
}

/// The place where two zeros meet that are `a` and `b`, of different signs, apart at the ends: the secant, halving the
/// value at the end it keeps.
fn meeting(net: &Net, one: &Form, other: &Form, a: f64, b: f64) -> f64 {
    let (mut low, mut high, mut at_low, mut at_high) = (0.0, 1.0, a, b);
    let mut side = 0;
    let mut at = 0.5;
    for _ in 0..60 {
        at = low - at_low * (high - low) / (at_high - at_low);
        let line = net.line(at);
        let gap = line.zero(one).0 - line.zero(other).0;
        if gap.abs() <= 1e-15 || high - low <= 1e-15 {
            break;
        }
        if (gap > 0.0) == (at_low > 0.0) {
            (low, at_low) = (at, gap);
            at_high *= if side < 0 { 0.5 } else { 1.0 };
            side = -1;
        } else {
            (high, at_high) = (at, gap);
            at_low *= if side > 0 { 0.5 } else { 1.0 };
            side = 1;
        }
    }
    if at > LEAST && at < 1.0 - LEAST {
        at
    } else {
        0.5
    }
}

impl Strips {
    /// The sum of the regions' parts of a line.
    pub(super) fn sum(&self, line: &Line, part: impl Fn(&Form, f64, f64) -> f64) -> f64 {
        let mut from = 0.0;
        let mut sum = 0.0;
        for (k, region) in self.regions.iter().enumerate() {
            let to = self.zeros.get(k).map_or(1.0, |form| line.zero(form).0);
            if let Some(form) = region {
                sum += part(form, from, to);
            }
            from = to;
        }
        sum
    }
}
