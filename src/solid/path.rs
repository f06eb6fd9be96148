//! Circles and segments in space, and where they cross a solid's surface.
//!
//! A stretch of a path is left aside where the boxes of the surface's pieces keep clear of it, or
//! where the distance of its middle exceeds its half length; any other is halved. Below a
//! ten-thousandth of a turn the signed distances of its ends and its middle stand for all of it,
//! where a parabola through them leaves no doubt; above it a polynomial does where it fits them, see
//! [`Polynomial`].

use super::body::Body;
use super::grazing::{Crossing, Polynomial};
use super::patches::FaceLine;
use super::remains::Remains;
use super::turn::Turn;
use crate::math::{Aabb, Side};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A parametrised path in space.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Path {
    /// `centre + u cos s + v sin s`, u and v normal to each other: a circle, or an ellipse.
    Circle { centre: DVec3, u: DVec3, v: DVec3 },
    /// `start + s along`.
    Line { start: DVec3, along: DVec3 },
    /// A line on a rational patch, moved along its normal.
    Face { line: Arc<FaceLine>, off: f64 },
}

/// Half width of a stretch below which a parabola is trusted.
const TRUST: f64 = 1e-5;
/// Half width down to which stretches are halved: two crossings nearer to each other than this are
/// taken for none.
const FLOOR: f64 = 1e-9;
/// Share of a stretch's half length below which distances count as small beside it: what runs along a surface.
const GRAZING: f64 = 1e-3;
/// Stretches after which only wide ones are halved on: the path runs along the surface.
const MANY: u64 = 1_024;
/// Half width that then counts as fine.
const COARSE: f64 = 1e-3;

/// Bounds of (ρ, z) over a stretch.
pub(super) struct Reach {
    pub(super) r: [f64; 2],
    pub(super) z: [f64; 2],
}

/// The parameters `middle ± half` of a path in a body's own coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub(super) path: &'a Path,
    pub(super) middle: f64,
    pub(super) half: f64,
}

impl Stretch<'_> {
    fn range(&self) -> [f64; 2] {
        [self.middle - self.half, self.middle + self.half]
    }

    /// Bounds of ρ and z over the stretch: of a line on a patch by the hull of its control points, else by
    /// Taylor's formula.
    pub(super) fn reach(&self) -> Reach {
        let (path, half) = (self.path, self.half);
        if let Path::Face { line, off } = path {
            let (hull, room) = line.hull(self.range(), *off);
            return reach_of_hull(&hull, room);
        }
        let p = path.at(self.middle);
        let (d, bend) = path.slopes(self.middle);
        let flat = DVec2::new(p.x, p.y);
        let square = flat.length_squared();
        let speed = path.speed();
        let furthest = square.sqrt() + speed * half;
        let tilt = match path {
            Path::Circle { u, v, .. } => u.z.hypot(v.z),
            _ => 0.0,
        };
        // (ρ²)'' = 2 |P'|² + 2 P·P''
        let curvature = 2.0 * (speed * speed + furthest * bend);
        let rounding = 8.0 * f64::EPSILON * furthest * furthest;
        let slope = 2.0 * flat.dot(DVec2::new(d.x, d.y)).abs();
        let spread = slope * half + 0.5 * curvature * half * half + rounding;
        let rise = d.z.abs() * half + 0.5 * tilt * half * half;
        let root = |x: f64| x.max(0.0).sqrt();
        Reach {
            r: [root(square - spread), root(square + spread)],
            z: [p.z - rise, p.z + rise],
        }
    }

    /// Whether it may meet the planes of a wedge's caps.
    pub(super) fn meets_caps(&self, turn: &Turn, margin: f64) -> bool {
        let Turn::Partial(wedge) = turn else {
            return false;
        };
        if let Path::Face { line, off } = self.path {
            let (hull, room) = line.hull(self.range(), *off);
            let room = room + margin;
            return wedge.directions().iter().any(|d| {
                let flat = || hull.iter().map(|p| DVec2::new(p.x, p.y));
                let aside = flat().any(|p| d.perp_dot(p) <= room);
                aside && flat().any(|p| d.perp_dot(p) >= -room) && flat().any(|p| d.dot(p) >= -room)
            });
        }
        let p = self.path.at(self.middle);
        let (velocity, bend) = self.path.slopes(self.middle);
        let flat = DVec2::new(p.x, p.y);
        let slope = DVec2::new(velocity.x, velocity.y);
        wedge.directions().iter().any(|d| {
            let room =
                d.perp_dot(slope).abs() * self.half + 0.5 * bend * self.half * self.half + margin;
            let beyond = self.path.speed() * self.half + margin;
            d.perp_dot(flat).abs() <= room && d.dot(flat) >= -beyond
        })
    }

    /// A box around the stretch.
    pub(super) fn bounds(&self) -> Aabb {
        let range = self.range();
        if let Path::Face { line, off } = self.path {
            let (hull, room) = line.hull(range, *off);
            let ends = |f: fn(DVec3, DVec3) -> DVec3| hull.iter().copied().reduce(f);
            let (min, max) = (ends(DVec3::min), ends(DVec3::max));
            return Aabb {
                min: min.unwrap_or(DVec3::NEG_INFINITY) - room,
                max: max.unwrap_or(DVec3::INFINITY) + room,
            };
        }
        let furthest =
            |sign: f64| DVec3::from_array(DVec3::AXES.map(|e| self.path.support(e * sign, range)));
        Aabb {
            min: -furthest(-1.0),
            max: furthest(1.0),
        }
    }
    /// The least and the largest `direction · x` over the stretch; `direction` a unit vector.
    pub(super) fn span(&self, direction: DVec3) -> [f64; 2] {
        let range = self.range();
        if let Path::Face { line, off } = self.path {
            let (hull, room) = line.hull(range, *off);
            let heights = hull.iter().map(|p| direction.dot(*p));
            let low = heights.clone().fold(f64::INFINITY, f64::min);
            return [low - room, heights.fold(f64::NEG_INFINITY, f64::max) + room];
        }
        let furthest = |d: DVec3| self.path.support(d, range);
        [-furthest(-direction), furthest(direction)]
    }
}

/// Bounds of (ρ, z) over the convex hull of points, grown by `room`.
fn reach_of_hull(hull: &[DVec3], room: f64) -> Reach {
    let flat = |p: &DVec3| DVec2::new(p.x, p.y);
    // ρ is convex, and a linear function of the plane along a unit vector is never above it.
    let most = hull.iter().map(|p| flat(p).length()).fold(0.0, f64::max);
    let sum: DVec2 = hull.iter().map(flat).sum();
    let towards = sum.normalize_or_zero();
    let least = (hull.iter().map(|p| flat(p).dot(towards))).fold(f64::INFINITY, f64::min);
    let low = hull.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let high = hull.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
    Reach {
        r: [(least - room).max(0.0), most + room],
        z: [low - room, high + room],
    }
}

impl Path {
    pub(super) fn at(&self, s: f64) -> DVec3 {
        match self {
            Self::Circle { centre, u, v } => {
                let (sin, cos) = s.sin_cos();
                *centre + *u * cos + *v * sin
            }
            Self::Line { start, along } => *start + *along * s,
            Self::Face { line, off } => line.at(s, *off),
        }
    }

    /// The most length per unit of the parameter.
    pub(super) fn speed(&self) -> f64 {
        match self {
            Self::Circle { u, v, .. } => u.length().max(v.length()),
            Self::Line { along, .. } => along.length(),
            Self::Face { line, .. } => line.speed(),
        }
    }

    /// Whether nothing but its points and its speed is known of it.
    pub(super) fn is_free(&self) -> bool {
        matches!(self, Self::Face { .. })
    }

    /// The largest `direction · x` between two parameters.
    pub(super) fn support(&self, direction: DVec3, [a, b]: [f64; 2]) -> f64 {
        let ends = direction.dot(self.at(a)).max(direction.dot(self.at(b)));
        if let Self::Circle { u, v, .. } = self {
            let peak = direction.dot(*v).atan2(direction.dot(*u));
            let turns = ((a - peak) / std::f64::consts::TAU).ceil();
            let first = peak + turns * std::f64::consts::TAU;
            if first <= b {
                return ends.max(direction.dot(self.at(peak)));
            }
        }
        if self.is_free() {
            return ends.max(self.peak(direction, [a, b]));
        }
        ends
    }

    /// The largest `direction · x` beside the best of some points: golden section.
    fn peak(&self, direction: DVec3, [a, b]: [f64; 2]) -> f64 {
        const PARTS: u32 = 16;
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let height = |s: f64| direction.dot(self.at(s));
        let place = |k: u32| a + (b - a) * f64::from(k) / f64::from(PARTS);
        let best = (0..=PARTS).max_by(|&i, &j| height(place(i)).total_cmp(&height(place(j))));
        let best = best.unwrap_or_default();
        let (mut low, mut high) = (place(best.saturating_sub(1)), place((best + 1).min(PARTS)));
        for _ in 0..60 {
            let step = (high - low) * GOLDEN;
            if height(high - step) < height(low + step) {
                low = high - step;
            } else {
                high = low + step;
            }
        }
        height(0.5 * (low + high))
    }

    /// The path in a body's local coordinates.
    fn local(&self, body: &Body) -> Self {
        let frame = body.frame();
        let point = |p| frame.to_local(p).point;
        let vector = |v| frame.vector_to_local(v);
        match self {
            Self::Circle { centre, u, v } => Self::Circle {
                centre: point(*centre),
                u: vector(*u),
                v: vector(*v),
            },
            Self::Line { start, along } => Self::Line {
                start: point(*start),
                along: vector(*along),
            },
            Self::Face { line, off } => Self::Face {
                line: Arc::new(line.placed(frame)),
                off: *off / frame.scale(),
            },
        }
    }

    /// First derivative and a bound of the second.
    fn slopes(&self, s: f64) -> (DVec3, f64) {
        match self {
            Self::Circle { u, v, .. } => {
                let (sin, cos) = s.sin_cos();
                (*v * cos - *u * sin, self.speed())
            }
            Self::Line { along, .. } => (*along, 0.0),
            Self::Face { .. } => (DVec3::ZERO, 0.0),
        }
    }

    /// Whether ρ and z do not change along the path, but for rounding.
    pub(super) fn is_coaxial(&self) -> bool {
        match self {
            Self::Circle { centre, u, v } => {
                let size = u.length();
                let off = centre.x.hypot(centre.y);
                let round = (v.length() - size).abs() <= 1e-14 * size;
                round && off <= 1e-14 * size && u.z.hypot(v.z) <= 1e-14 * size
            }
            _ => false,
        }
    }

    /// Adds the parameters between `a` and `b` at which the path crosses what remains of the body's surface.
    /// Coordinates are known to within `margin`; within `near` the path counts as running along it.
    pub(super) fn crossings(
        &self,
        body: &Body,
        remains: &Remains,
        [a, b]: [f64; 2],
        [margin, near]: [f64; 2],
        out: &mut Vec<Crossing>,
    ) -> Searched {
        let local = self.local(body);
        let mut along = false;
        let speed = self.speed();
        // Distances up to a limit: where one is only compared, farther faces need no search.
        let distance = |s: f64, limit: f64| remains.distance(body, self.at(s), limit);
        let signed = |s: f64, limit: f64| {
            let p = self.at(s);
            let outside = body.side(p) == Side::Outside;
            let d = remains.distance(body, p, limit);
            if outside {
                d.max(f64::MIN_POSITIVE)
            } else {
                -d
            }
        };
        let whole = b - a;
        let mut work = vec![Open {
            a,
            b,
            ends: None,
            level: 0,
        }];
        let (mut seen, mut steps) = (0_u64, 0_u64);
        while let Some(Open { a, b, ends, level }) = work.pop() {
            seen += 1;
            let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
            let stretch = Stretch {
                path: &local,
                middle: m,
                half: h,
            };
            if !body.may_meet(&stretch, margin) {
                along = along || body.may_meet(&stretch, near);
                continue;
            }
            let small = h <= TRUST || seen > MANY && h <= COARSE;
            let clear = speed * h * (1.0 + 1e-9);
            // Distances are proved to less than that.
            let limit = clear + 4.0 * near;
            let middle = if small {
                signed(m, limit)
            } else {
                distance(m, limit)
            };
            along |= middle.abs() <= near && h > FLOOR;
            if middle.abs() >= clear {
                continue;
            }
            if !small && (level % 2 == 0 || middle.abs() <= GRAZING * clear) {
                let within = |s: f64| signed(s, 4.0 * clear + limit);
                steps += 9;
                let made = Polynomial::new(&within, m, h, [0.25 * margin, near], 2.0 * clear);
                let runs = made.as_ref().is_some_and(|f| f.is_within(near));
                along |= runs;
                if runs {
                    continue;
                }
                if let Some((f, changes)) = made.and_then(|f| f.changes().map(|c| (f, c))) {
                    for change in changes {
                        let (crossing, taken) = f.polished(&within, change, 0.25 * margin);
                        out.push(crossing);
                        steps += taken;
                    }
                    continue;
                }
            }
            let mut values = None;
            if small {
                // What is so near to the middle is at most this far.
                let limit = middle.abs() + limit;
                let [fa, fb] = ends.unwrap_or_else(|| [a, b].map(|s| signed(s, limit)));
                values = Some([fa, middle, fb]);
                let on = [fa, middle, fb].iter().all(|f| f.abs() <= 0.5 * margin);
                if on && h > FLOOR {
                    // On the surface, as far as distances tell.
                    along = true;
                    continue;
                }
                let within = |s: f64| signed(s, limit);
                let fine = h <= FLOOR || seen > MANY || !(m > a && m < b);
                match parabola([fa, middle, fb], speed * h) {
                    Crossings::None => continue,
                    Crossings::One => {
                        let (place, taken) = root(&within, [a, b], [fa, fb], 0.25 * margin);
                        out.push(Crossing {
                            place,
                            slope: (fb - fa).abs() / (b - a),
                        });
                        steps += taken;
                        continue;
                    }
                    Crossings::Unknown if fine => {
                        if (fa < 0.0) != (fb < 0.0) {
                            let zero = 0.25 * margin;
                            let (place, taken) = root(&within, [a, b], [fa, fb], zero);
                            // In doubt as far as the distance stays near 0: where it touches that is long, beside
                            // an edge much less than this stretch.
                            let near_zero = |s: f64| within(s).abs() <= 2.0 * zero;
                            let mut reach = 4.0 * zero / speed;
                            while reach < whole
                                && (near_zero(place - reach) || near_zero(place + reach))
                            {
                                reach *= 4.0;
                                steps += 2;
                            }
                            out.push(Crossing {
                                place,
                                slope: 2.0 * zero / reach,
                            });
                            steps += taken;
                        }
                        continue;
                    }
                    Crossings::Unknown => {}
                }
            }
            let half = |a, b, ends| Open {
                a,
                b,
                ends,
                level: level + 1,
            };
            work.push(half(m, b, values.map(|[_, m, b]| [m, b])));
            work.push(half(a, m, values.map(|[a, m, _]| [a, m])));
        }
        Searched {
            along,
            questions: seen + steps,
        }
    }
}

/// What a search for crossings found besides them.
pub(super) struct Searched {
    /// Whether the path may run along the surface.
    pub(super) along: bool,
    /// How often the body was asked, for stretches and for places of crossings.
    pub(super) questions: u64,
}

/// A stretch to look at, with the signed distances of its ends, where they are known.
struct Open {
    a: f64,
    b: f64,
    ends: Option<[f64; 2]>,
    /// How often the path was halved for it.
    level: u32,
}

/// Share of the most that distances may change over half a stretch from which they count as bent.
const KINK: f64 = 1e-3;

/// How often a stretch crosses a surface.
enum Crossings {
    None,
    One,
    Unknown,
}

/// What a parabola through the signed distances of both ends and the middle says; `way` is the most that they may differ
/// by between the middle and an end.
///
/// So short a stretch is bent only where it passes an edge. The distance then has a kink, and between two values the
/// path may be on the other side, unless both are too large for that.
fn parabola([a, m, b]: [f64; 3], way: f64) -> Crossings {
    let (slope, bend) = (0.5 * (b - a), 0.5 * (a + b) - m);
    let kink = bend.abs() > KINK * way;
    if kink && (a < 0.0) == (b < 0.0) && (a.abs() + m.abs()).min(m.abs() + b.abs()) <= way {
        return Crossings::Unknown;
    }
    let straight = bend.abs() <= 0.1 * slope.abs();
    if (a < 0.0) != (b < 0.0) {
        return if straight {
            Crossings::One
        } else {
            Crossings::Unknown
        };
    }
    if (a < 0.0) != (m < 0.0) {
        return Crossings::Unknown;
    }
    // The vertex of m + slope x + bend x², |x| <= 1, where it is nearest to 0.
    let nearest = if slope.abs() < 2.0 * bend.abs() {
        (m - 0.25 * slope * slope / bend)
            .abs()
            .min(a.abs())
            .min(b.abs())
    } else {
        a.abs().min(b.abs())
    };
    let crosses =
        slope.abs() < 2.0 * bend.abs() && ((m - 0.25 * slope * slope / bend) < 0.0) != (m < 0.0);
    if !crosses && nearest > 0.05 * (slope.abs() + bend.abs()) {
        Crossings::None
    } else {
        Crossings::Unknown
    }
}

/// The place where signed distances change sign, down to a distance of `zero` or the resolution of
/// the parameter; and the steps it took.
///
/// By turns a secant, a step beyond where it led, which closes the bracket from the other side, and
/// a halving, which serves distances that jump: beside an edge of two faces.
pub(super) fn root(
    signed: &impl Fn(f64) -> f64,
    [mut a, mut b]: [f64; 2],
    [mut fa, mut fb]: [f64; 2],
    zero: f64,
) -> (f64, u64) {
    const STEPS: u64 = 120;
    for step in 0..STEPS {
        let middle = 0.5 * (a + b);
        if !(b - a > 4.0 * f64::EPSILON * a.abs().max(b.abs()).max(1.0)) {
            return (middle, step);
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let proposed = match step % 3 {
            0 => secant,
            // The end that the secant moved has the smaller value.
            1 if fa.abs() < fb.abs() => a + 4.0 * (secant - a).max(1e-16),
            1 => b - 4.0 * (b - secant).max(1e-16),
            _ => middle,
        };
        let x = if proposed > a && proposed < b {
            proposed
        } else {
            middle
        };
        let f = signed(x);
        if f.abs() <= zero {
            return (x, step);
        }
        if (f < 0.0) == (fa < 0.0) {
            (a, fa) = (x, f);
        } else {
            (b, fb) = (x, f);
        }
    }
    (0.5 * (a + b), STEPS)
}
