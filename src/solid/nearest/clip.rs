//! The parts of arcs that are edges of the composite.
//!
//! An arc changes where it leaves one of its two sheets, and where another body's surface crosses it. Each of these is a
//! function that changes by at most the way; a part of the arc that is shorter than its value is not changed by it, any
//! other is halved. What is 0 all along goes along the arc and changes nothing, either.

use super::arc::Arc;
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

/// What may change along an arc.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// The border of one of the arc's sheets.
    Border(usize),
    /// Another body.
    Body(usize),
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
        let touch = 8.0 * self.scene.touch();
        [0.0, 0.23, 0.61, 1.0].iter().all(|share| {
            let s = from + (to - from) * share;
            self.value(change, s, 2.0 * touch).abs() <= touch
        })
    }

    fn parts(&self, all: &Changes, out: &mut Vec<Arc>) -> Option<()> {
        let speed = self.arc.curve.speed();
        let floor = FLOOR * self.scene.size;
        let mut work = vec![([self.arc.from, self.arc.to], all.clone())];
        let mut kept: Option<[f64; 2]> = None;
        let mut seen = 0;
        while let Some(([from, to], changes)) = work.pop() {
            seen += 1;
            self.crossing.spend(LOOKS)?;
            let middle = 0.5 * (from + to);
            let reach = 0.5 * (to - from) * speed + self.scene.hair();
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
                if self.is_still(change, [from, to]) {
                    crowded = true;
                } else {
                    open.push(change);
                }
            }
            if off {
                continue;
            }
            let told = open.is_empty() || 0.5 * (to - from) * speed <= floor || seen > MOST_PARTS;
            if !told {
                // The changes that go along this part may end in it for its halves' sake.
                if crowded {
                    open.clone_from(all);
                }
                work.push(([middle, to], open.clone()));
                work.push(([from, middle], open));
                continue;
            }
            if !self.is_edge(middle, crowded || !open.is_empty()) {
                continue;
            }
            match &mut kept {
                Some(last) if last[1] == from => last[1] = to,
                _ => {
                    self.keep(kept.replace([from, to]), out);
                }
            }
        }
        self.keep(kept, out);
        Some(())
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
