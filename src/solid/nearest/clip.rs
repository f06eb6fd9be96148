//! The parts of arcs that are edges of the composite.
//!
//! An arc changes where it leaves one of its two sheets, and where another body's surface crosses it. Each of these is a
//! function that changes by at most the way; a part of the arc that is shorter than its value is not changed by it, any
//! other is halved. What is 0 all along goes along the arc and changes nothing, either.

use super::arc::Arc;
use super::boxes::away;
use super::fences::Fences;
use super::sheet::{Jet, Sheet};
use super::trace::Crossing;
use super::visible::Scene;
use glam::DVec3;
use smallvec::SmallVec;

/// Parts looked at in one arc before those that are left are told by their middles.
const MOST_PARTS: u32 = 3000;
/// Looks at both sheets that a part takes.
const LOOKS: u64 = 16;
/// Half length, as a share of the composite's size, of the parts that are told by their middles.
const FLOOR: f64 = 1e-12;
/// Greatest length, as a share of the composite's size, of what a surface that touches an arc hides of it for being
/// thinner than a hair: a root of the hair where the two bend apart as circles do, its fourth root where they fit better.
const GRAZE: f64 = 1e-3;
/// What is not longer is no surface that lies on an arc, but one that bends away from it and touches it.
const SHORT: f64 = 3e-6;

/// What may change along an arc.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// The border of one of the arc's sheets.
    Border(usize),
    /// Another body.
    Body(usize),
}

/// Part of an arc, by its parameter about the middle.
struct Part {
    middle: DVec3,
    half: f64,
    /// No point of it is further from the middle.
    reach: f64,
    /// The derivative in the middle, and bounds of the first and the second.
    slope: DVec3,
    speed: f64,
    curl: f64,
}

/// Where a change meets a part.
enum Met {
    Nowhere,
    /// All of the part is beyond a border.
    Beyond,
    Perhaps,
}

/// What a part of an arc is found to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    Edge,
    /// No edge as far as can be seen, but another surface is within two hairs all along.
    Crowded,
    Off,
}

/// A part of an arc that is told.
#[derive(Debug, Clone, Copy)]
struct Told {
    range: [f64; 2],
    sort: Sort,
}

type Changes = SmallVec<[Change; 16]>;

/// The parts of the arcs of a crossing that are edges; `None` where the work is too much.
pub(super) fn edges(
    scene: &Scene,
    crossing: &Crossing<'_>,
    arcs: &[Arc],
    out: &mut Vec<Arc>,
) -> Option<()> {
    let own = crossing.sheets.map(|s| s.body);
    let others = (0..scene.bodies.len()).filter(|b| !own.contains(b));
    let all: Changes = [Change::Border(0), Change::Border(1)]
        .into_iter()
        .chain(others.map(Change::Body))
        .collect();
    for arc in arcs {
        let clip = Clip {
            scene,
            crossing,
            arc,
        };
        clip.parts(&all, out)?;
    }
    Some(())
}

struct Clip<'a> {
    scene: &'a Scene,
    crossing: &'a Crossing<'a>,
    arc: &'a Arc,
}

impl Clip<'_> {
    /// The point of the curve itself, which is nearer to both sheets than the arc.
    fn at(&self, s: f64) -> DVec3 {
        let x = self.arc.curve.at(s);
        let near = |p: &DVec3| p.distance(x) <= 1e-9 * self.scene.size;
        self.crossing.onto(x, None).filter(near).unwrap_or(x)
    }

    fn value(&self, change: Change, s: f64, limit: f64) -> f64 {
        let x = self.at(s);
        match change {
            Change::Border(k) => self.crossing.sheets[k].margin(x),
            Change::Body(b) => self.scene.distance(b, x, limit),
        }
    }

    /// Whether a function is 0 all along.
    fn is_still(&self, change: Change, [from, to]: [f64; 2]) -> bool {
        let touch = 2.0 * self.scene.hair();
        [0.0, 0.23, 0.61, 1.0].iter().all(|share| {
            let s = from + (to - from) * share;
            self.value(change, s, 2.0 * touch).abs() <= touch
        })
    }

    /// The side of 0 on which a function stays all along a part, by its second derivatives; 0 where that is not known.
    fn side(&self, f: &Jet, part: &Part) -> f64 {
        let bend = f.bend * part.speed * part.speed + f.gradient.length() * part.curl;
        let most = part.half * (f.gradient.dot(part.slope).abs() + 0.5 * bend * part.half);
        if f.value.abs() > most + self.scene.hair() {
            f.value.signum()
        } else {
            0.0
        }
    }

    /// Whether a part passes no fence of a sheet.
    fn passes_none(&self, fences: &Fences, part: &Part) -> bool {
        fences.each.iter().all(|fence| {
            let beside = |f: &Jet| self.side(f, part) < 0.0;
            self.side(&fence.across, part) != 0.0 || fence.along.as_ref().is_some_and(beside)
        })
    }

    /// Whether a part meets a sheet nowhere, by what is known of the sheet alone.
    fn is_off(&self, sheet: &Sheet, part: &Part) -> bool {
        let (x, reach) = (part.middle, part.reach);
        if away(&sheet.bounds, x) > reach {
            return true;
        }
        let margin = sheet.margin(x);
        let beyond = || {
            let fences = sheet.fences(x, reach);
            fences.are_all && self.passes_none(&fences, part)
        };
        margin < -reach || self.side(&sheet.jet(x, reach), part) != 0.0 || margin < 0.0 && beyond()
    }

    /// Whether all of a part that is on a sheet's surface is within the sheet's borders, or all beyond them.
    fn stays(&self, sheet: &Sheet, part: &Part) -> bool {
        let fences = sheet.fences(part.middle, part.reach);
        let others = |s: &&Sheet| s.body == sheet.body && !std::ptr::eq(*s, sheet);
        self.passes_none(&fences, part)
            && (fences.are_all
                || (self.scene.sheets.iter().filter(others)).all(|s| self.is_off(s, part)))
    }

    /// What a change is to a part that is longer than the way to it.
    fn look(&self, change: Change, part: &Part) -> Met {
        match change {
            Change::Body(b) => {
                let mut sheets = self.scene.sheets.iter().filter(|s| s.body == b);
                let apart = |s: &Sheet| {
                    self.is_off(s, part) || s.margin(part.middle) < 0.0 && self.stays(s, part)
                };
                if sheets.all(apart) {
                    return Met::Nowhere;
                }
            }
            Change::Border(k) => {
                let own = self.crossing.sheets[k];
                let margin = own.margin(part.middle);
                if margin != 0.0 && self.stays(own, part) {
                    return if margin > 0.0 {
                        Met::Nowhere
                    } else {
                        Met::Beyond
                    };
                }
            }
        }
        Met::Perhaps
    }

    fn parts(&self, all: &Changes, out: &mut Vec<Arc>) -> Option<()> {
        let (speed, curl) = (self.arc.curve.speed(), self.arc.curve.curl());
        let floor = FLOOR * self.scene.size;
        let mut work = vec![([self.arc.from, self.arc.to], all.clone())];
        let mut told: Vec<Told> = Vec::new();
        let mut seen = 0;
        while let Some(([from, to], changes)) = work.pop() {
            seen += 1;
            self.crossing.spend(LOOKS)?;
            let middle = 0.5 * (from + to);
            let reach = 0.5 * (to - from) * speed + self.scene.hair();
            let part = Part {
                middle: self.at(middle),
                half: 0.5 * (to - from),
                reach,
                slope: self.arc.curve.slope(middle),
                speed,
                curl,
            };
            let mut open = Changes::new();
            let (mut off, mut crowded) = (false, false);
            for change in changes {
                let value = self.value(change, middle, reach);
                if value < -reach {
                    off = true;
                    break;
                }
                if value >= reach {
                    continue;
                }
                match self.look(change, &part) {
                    Met::Nowhere => continue,
                    Met::Beyond => {
                        off = true;
                        break;
                    }
                    Met::Perhaps => {}
                }
                if self.is_still(change, [from, to]) {
                    crowded = true;
                } else {
                    open.push(change);
                }
            }
            if off {
                told.push(Told {
                    range: [from, to],
                    sort: Sort::Off,
                });
                continue;
            }
            let is_told =
                open.is_empty() || 0.5 * (to - from) * speed <= floor || seen > MOST_PARTS;
            if !is_told {
                // The changes that go along this part may end in it for its halves' sake.
                if crowded {
                    open.clone_from(all);
                }
                work.push(([middle, to], open.clone()));
                work.push(([from, middle], open));
                continue;
            }
            let is_crowded = crowded || !open.is_empty();
            let sort = if self.is_edge(middle, is_crowded) {
                Sort::Edge
            } else if is_crowded {
                Sort::Crowded
            } else {
                Sort::Off
            };
            told.push(Told {
                range: [from, to],
                sort,
            });
        }
        self.join(&mut told, all, speed);
        let mut kept: Option<[f64; 2]> = None;
        for part in told.iter().filter(|p| p.sort == Sort::Edge) {
            let [from, to] = part.range;
            match &mut kept {
                Some(last) if last[1] == from => last[1] = to,
                _ => self.keep(kept.replace([from, to]), out),
            }
        }
        self.keep(kept, out);
        Some(())
    }

    /// Counts short runs of crowded parts beside an edge as of the edge: what a third surface that grazes the arc leaves
    /// there is thinner than a hair, and yet is there.
    fn join(&self, told: &mut [Told], all: &Changes, speed: f64) {
        let mut from = 0;
        while from < told.len() {
            let run = told[from..].iter().take_while(|p| p.sort == Sort::Crowded);
            let to = from + run.count();
            if to == from {
                from += 1;
                continue;
            }
            let is_edge = |i: usize| told.get(i).is_some_and(|p| p.sort == Sort::Edge);
            let beside = from > 0 && is_edge(from - 1) || is_edge(to);
            let range = [told[from].range[0], told[to - 1].range[1]];
            let length = speed * (range[1] - range[0]) / self.scene.size;
            if beside && length <= GRAZE && (length <= SHORT || !self.is_flush(all, range)) {
                told[from..to].iter_mut().for_each(|p| p.sort = Sort::Edge);
            }
            from = to;
        }
    }

    /// Whether a surface lies on most of a part, not just near it.
    fn is_flush(&self, all: &Changes, [from, to]: [f64; 2]) -> bool {
        const PLACES: u32 = 9;
        let on = 4.0 * self.scene.touch();
        all.iter().any(|&change| {
            let places =
                (0..PLACES).map(|k| from + (to - from) * (f64::from(k) + 0.5) / f64::from(PLACES));
            let count = places.filter(|&s| self.value(change, s, 2.0 * on).abs() <= on);
            4 * count.count() > 3 * PLACES as usize
        })
    }

    fn is_edge(&self, s: f64, crowded: bool) -> bool {
        let x = self.at(s);
        let bodies = self.crossing.sheets.map(|s| s.body);
        let inside = |k: usize| self.crossing.sheets[k].margin(x) >= -8.0 * self.scene.touch();
        inside(0)
            && inside(1)
            && self
                .scene
                .is_edge(x, self.crossing.normals(x), bodies, crowded)
    }

    fn keep(&self, part: Option<[f64; 2]>, out: &mut Vec<Arc>) {
        if let Some([from, to]) = part {
            out.push(Arc::new(self.arc.curve.clone(), from, to));
        }
    }
}
