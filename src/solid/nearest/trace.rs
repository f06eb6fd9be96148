//! The curves in which two sheets cross.
//!
//! One sheet is divided into tiles until each is proved to hold no point of the other, or is regular:
//!
//! ```text
//!   none      |f| > r                          f the other's value in the tile's middle, r the tile's reach
//!             |f| > r sin θ + κ r²             θ between the normals, κ bounds of the curvatures of both
//!   regular   κ r <= sin θ / 4                 then at most one curve passes, and Newton's method finds it
//! ```
//!
//! From each regular tile a curve that is not known is followed both ways, in arcs that are polynomials of its own
//! length, out of the tile and of both sheets. Where sheets touch, no tile is regular; down to a size that is left open, crossings that Newton's method still
//! finds are followed, too.
//!
//! * Accuracy: arcs are within [`DEVIATION`] of the sheets.

use super::arc::{Arc, DEGREE, Polynomial, node};
use super::boxes::away;
use super::sheet::{Sheet, Tile};
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// How far arcs may be from the sheets they are on, as a share of the composite's size.
const DEVIATION: f64 = 2e-12;
/// Tiles looked at for one pair of sheets.
const MOST_TILES: u32 = 200_000;
/// Looks at sheets of one composite, those at sheets that are swept by a curve counted by their price: some seconds.
const MOST_WORK: u64 = 40_000_000;
/// Arcs of one pair of sheets.
const MOST_ARCS: usize = 20_000;
/// Tiles of sheets that touch are divided down to this share of the smaller sheet.
const OPEN: f64 = 1e-3;
/// Sines of angles below which sheets do not cross but touch.
const SHALLOW: f64 = 1e-6;

/// Two sheets of a composite of that size.
pub(super) struct Crossing<'a> {
    pub(super) sheets: [&'a Sheet; 2],
    pub(super) size: f64,
    /// What the crossings of a composite have taken so far, all together.
    pub(super) work: &'a AtomicU64,
}

/// An end of what is followed of a curve.
#[derive(Debug, Clone, Copy)]
struct End {
    /// The point that it was followed from.
    start: DVec3,
    at: DVec3,
    along: DVec3,
}

/// How following a curve ended.
enum Followed {
    Closed,
    /// Where the sheets no longer cross.
    Stuck,
    Open(End),
}

/// Where a tile is.
struct Ball {
    centre: DVec3,
    reach: f64,
}

/// A point with what the sheets are there.
struct Contact {
    values: [f64; 2],
    gradients: [DVec3; 2],
}

impl Crossing<'_> {
    /// Counts looks at both sheets; `None` once a composite has had all it gets. As what is counted does not depend on
    /// the order, neither does whether that comes.
    pub(super) fn spend(&self, looks: u64) -> Option<()> {
        let prices = self.sheets.map(Sheet::price);
        let spent = looks * (prices[0] + prices[1]);
        let before = self.work.fetch_add(spent, Ordering::Relaxed);
        (before + spent <= MOST_WORK).then_some(())
    }

    fn contact(&self, x: DVec3) -> Contact {
        let [a, b] = self.sheets.map(|s| s.value(x));
        Contact {
            values: [a.0, b.0],
            gradients: [a.1, b.1],
        }
    }

    /// Unit normals.
    pub(super) fn normals(&self, x: DVec3) -> [DVec3; 2] {
        self.contact(x)
            .gradients
            .map(|g| g.try_normalize().unwrap_or(DVec3::Z))
    }

    /// The sine of the angle at which the sheets cross.
    fn sine(&self, x: DVec3) -> f64 {
        let [a, b] = self.normals(x);
        a.cross(b).length()
    }

    /// Brings a point onto both sheets: by the least steps, or within the plane `along · (x - start) = const`.
    pub(super) fn onto(&self, mut x: DVec3, along: Option<DVec3>) -> Option<DVec3> {
        const STEPS: usize = 24;
        let accurate = 4.0 * f64::EPSILON * self.size;
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let Contact {
                values: [f, g],
                gradients: [a, b],
            } = self.contact(x);
            let tangent = a.cross(b);
            let third = along.unwrap_or(tangent);
            let det = tangent.dot(third);
            if !(det.abs() > 0.0) {
                return None;
            }
            let step = -(b.cross(third) * f + third.cross(a) * g) / det;
            let length = step.length();
            if !(length <= 2.0 * self.size) {
                return None;
            }
            x += step;
            // Roundings no longer become less.
            if length <= accurate || length <= 1e-9 * self.size && length >= 0.5 * last {
                break;
            }
            last = length;
        }
        let Contact {
            values: [f, g],
            gradients: [a, b],
        } = self.contact(x);
        let room = 1e-13 * self.size;
        (f.abs() <= room * a.length() && g.abs() <= room * b.length()).then_some(x)
    }

    /// An arc from a point of the curve along a direction, up to `length` further along it.
    fn arc(&self, start: DVec3, along: DVec3, length: f64) -> Option<Polynomial> {
        let mut points = [start; DEGREE + 1];
        for k in 1..=DEGREE {
            let place = |k: usize| 0.5 * length * (node(k) + 1.0);
            let way = place(k) - place(k - 1);
            let guess = if k >= 2 {
                let before = place(k - 1) - place(k - 2);
                points[k - 1] + (points[k - 1] - points[k - 2]) * (way / before)
            } else {
                start + along * way
            };
            // The guess is put on the plane it is for.
            let guess = guess + along * (place(k) - along.dot(guess - start));
            points[k] = self.onto(guess, Some(along))?;
            let step = points[k] - points[k - 1];
            if points[k].distance(guess) > 0.3 * way || step.length() > 1.5 * way {
                return None;
            }
        }
        let curve = Polynomial::through(&points);
        let close = (0..DEGREE).all(|k| {
            let x = curve.at(0.5 * (node(k) + node(k + 1)));
            let Contact { values, gradients } = self.contact(x);
            let [a, b] = gradients.map(DVec3::length);
            let sine = self.sine(x).max(1e-3);
            let room = DEVIATION * self.size * sine;
            values[0].abs() <= room * a && values[1].abs() <= room * b
        });
        close.then_some(curve)
    }

    /// Whether an arc is all beyond the borders of a sheet.
    fn is_outside(&self, curve: &Polynomial) -> bool {
        let (middle, reach) = (curve.at(0.0), curve.speed());
        self.sheets.iter().any(|s| s.margin(middle) < -reach)
    }

    /// Follows a curve on from an open end, until it is beyond the sheets' borders and outside of a ball.
    fn follow(&self, mut end: End, ball: &Ball, out: &mut Vec<Arc>) -> Option<Followed> {
        let smallest = 1e-7 * self.size;
        let mut length = 0.05 * self.size;
        loop {
            let made = self.arc(end.at, end.along, length);
            let Some(curve) = made else {
                length *= 0.5;
                if length < smallest {
                    return Some(Followed::Stuck);
                }
                continue;
            };
            if end.at != end.start {
                let (far, at) = curve.nearest(end.start, -1.0, 1.0);
                if far <= 1e-9 * self.size && at > -1.0 + 1e-9 {
                    out.push(Arc::new(curve, -1.0, at));
                    return Some(Followed::Closed);
                }
            }
            let away = curve.at(0.0).distance(ball.centre) > ball.reach + curve.speed();
            let outside = away && self.is_outside(&curve);
            end.at = curve.at(1.0);
            end.along = curve.slope(1.0).try_normalize()?;
            out.push(Arc::new(curve, -1.0, 1.0));
            if outside {
                return Some(Followed::Open(end));
            }
            if out.len() > MOST_ARCS {
                return None;
            }
            length *= 1.5;
        }
    }

    /// Follows the curve through a point of it both ways.
    fn follow_both(
        &self,
        start: DVec3,
        ball: &Ball,
        arcs: &mut Vec<Arc>,
        open: &mut Vec<End>,
    ) -> Option<()> {
        let [a, b] = self.normals(start);
        let along = a.cross(b).try_normalize()?;
        for along in [along, -along] {
            let end = End {
                start,
                at: start,
                along,
            };
            match self.follow(end, ball, arcs)? {
                Followed::Closed => break,
                Followed::Stuck => {}
                Followed::Open(end) => open.push(end),
            }
        }
        Some(())
    }

    /// Follows on what ends within a ball: a curve that left the sheets may come back in it, as over a bore.
    fn follow_on(&self, ball: &Ball, arcs: &mut Vec<Arc>, open: &mut Vec<End>) -> Option<()> {
        let within = |end: &End| end.at.distance(ball.centre) <= ball.reach;
        while let Some(k) = open.iter().position(within) {
            let end = open.swap_remove(k);
            if let Followed::Open(end) = self.follow(end, ball, arcs)? {
                open.push(end);
            }
        }
        Some(())
    }

    /// All curves; `None` where there are more than are followed.
    pub(super) fn curves(&self) -> Option<Vec<Arc>> {
        let (mut arcs, mut ends): (Vec<Arc>, Vec<End>) = Default::default();
        let [a, b] = self.sheets;
        let small = |s: &Sheet| (s.bounds.max - s.bounds.min).max_element();
        let open = OPEN * small(a).min(small(b));
        let mut work = vec![Tile::ALL];
        let mut seen = 0;
        while let Some(tile) = work.pop() {
            seen += 1;
            self.spend(1)?;
            if seen > MOST_TILES {
                return None;
            }
            let x = a.point(tile.middle());
            let sides = a.reach(&tile);
            let reach = sides[0].hypot(sides[1]);
            if away(&b.bounds, x) > reach || a.margin(x) < -reach {
                continue;
            }
            let (value, gradient) = b.value(x);
            if value.abs() > reach || b.margin(x) < -reach {
                continue;
            }
            let steep = gradient.length();
            let own = a.value(x).1.length();
            let sine = self.sine(x);
            let bend = b.bend(x, reach) / steep + a.bend(x, reach) / own;
            if value.abs() / steep > 1.01 * (reach * sine + bend * reach * reach) {
                continue;
            }
            let regular = bend * reach <= 0.25 * sine;
            if !regular && reach > open {
                let k = usize::from(sides[1] > sides[0]);
                work.extend(tile.halves(k));
                continue;
            }
            let Some(seed) = self.onto(x, None) else {
                continue;
            };
            if seed.distance(x) > 4.0 * reach || self.sine(seed) < SHALLOW {
                continue;
            }
            // A curve is followed as far as it is within the borders or the tile: beyond them nothing begins.
            if reach > open && self.sheets.iter().any(|s| s.margin(seed) < 0.0) {
                let k = usize::from(sides[1] > sides[0]);
                work.extend(tile.halves(k));
                continue;
            }
            let known = |arc: &Arc| {
                let near = 1e-7 * self.size;
                away(&arc.bounds, seed) <= near && arc.curve.nearest(seed, -1.0, 1.0).0 <= near
            };
            let ball = Ball { centre: x, reach };
            if arcs.iter().any(known) {
                self.follow_on(&ball, &mut arcs, &mut ends)?;
            } else {
                self.follow_both(seed, &ball, &mut arcs, &mut ends)?;
            }
            if arcs.len() > MOST_ARCS {
                return None;
            }
        }
        Some(arcs)
    }
}
