//! The smooth sheets that bodies' surfaces are made of, as zero sets with their gradients.
//!
//! ```text
//!   swept line     n · (ρ, z) - d                    plane, cylinder, cone
//!   swept circle   |(ρ, z) - c| - R                  sphere, torus
//!   swept curve    the signed distance to a rational piece, by its foot
//!   flat           n · x - d                         cap of a turn, face of a block
//!   ellipsoid      (|x / r| - 1) min r
//! ```
//!
//! A value goes on beyond the sheet's borders, so that curves where two sheets meet can be followed over them;
//! [`Sheet::margin`] tells how far within the borders a point of the sheet is.
//!
//! * Units: scene lengths, from the middle of the composite.
//! * Gradients are unit vectors but for ellipsoids; no value is steeper than 1.

use super::super::body::Body;
use super::super::revolved::Revolved;
use super::super::turn::{Turn, Wedge};
use super::boxes::NOWHERE;
use crate::math::{Aabb, Real, Similarity};
use crate::region::{BoundaryPiece, Piece};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A frame without its scale.
#[derive(Debug, Clone)]
pub(super) struct Place {
    origin: DVec3,
    axes: [DVec3; 3],
}

impl Place {
    fn new(frame: &Similarity) -> Self {
        Self {
            origin: frame.origin(),
            axes: [0, 1, 2].map(|i| frame.axis(i)),
        }
    }

    pub(super) fn local(&self, x: DVec3) -> DVec3 {
        let d = x - self.origin;
        DVec3::from_array(self.axes.map(|a| a.dot(d)))
    }

    pub(super) fn turned(&self, v: DVec3) -> DVec3 {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }

    fn world(&self, q: DVec3) -> DVec3 {
        self.origin + self.turned(q)
    }
}

/// A profile's piece in scene lengths.
#[derive(Debug, Clone)]
pub(super) enum Profile {
    Line {
        start: DVec2,
        along: DVec2,
        length: f64,
    },
    Circle {
        centre: DVec2,
        radius: f64,
        ends: [DVec2; 2],
    },
    Rational {
        piece: Box<Piece>,
        scale: f64,
        /// The largest curvature of its samples.
        bend: f64,
    },
}

/// A zero set.
#[derive(Debug, Clone)]
pub(super) enum Form {
    Swept {
        profile: Profile,
        wedge: Option<Wedge>,
        /// Angle at which the turn starts, and the angle turned.
        turn: [f64; 2],
    },
    /// A cap: the plane through the axis along `direction`, within the region.
    Cap {
        body: Arc<Body>,
        direction: DVec2,
        scale: f64,
        low: DVec2,
        high: DVec2,
    },
    /// The face of a block, normal to axis `axis` on the side `sign`.
    Face {
        half: DVec3,
        axis: usize,
        sign: f64,
    },
    Ellipsoid {
        radii: DVec3,
    },
}

/// A smooth part of a body's surface.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    /// Index of the body.
    pub(super) body: usize,
    pub(super) place: Place,
    pub(super) form: Form,
    pub(super) bounds: Aabb,
}

/// A smooth function at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) gradient: DVec3,
    /// A bound on the second derivatives about the point.
    pub(super) bend: f64,
}

/// A part of a sheet: a rectangle of its parameters, each from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tile {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Tile {
    pub(super) const ALL: Self = Self {
        low: [0.0; 2],
        high: [1.0; 2],
    };

    pub(super) fn middle(&self) -> [f64; 2] {
        [0, 1].map(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    /// Its halves along parameter `k`.
    pub(super) fn halves(&self, k: usize) -> [Self; 2] {
        let (mut a, mut b) = (*self, *self);
        a.high[k] = self.middle()[k];
        b.low[k] = a.high[k];
        [a, b]
    }
}

fn vec2(p: [f64; 2]) -> DVec2 {
    DVec2::from_array(p)
}

/// The sheets of a body; `None` where its surface is not made of any that are known.
pub(super) fn sheets(index: usize, body: &Arc<Body>, out: &mut Vec<Sheet>) -> Option<()> {
    match &**body {
        Body::Revolved(one) => revolved(index, body, one, out),
        Body::Patches(one) => {
            let turned = Arc::new(Body::Revolved(one.turned()?.clone()));
            revolved(index, &turned, turned.revolved()?, out);
        }
        Body::Ellipsoid(one) => {
            let frame = one.frame();
            out.push(Sheet {
                body: index,
                place: Place::new(frame),
                form: Form::Ellipsoid {
                    radii: one.local_radii() * frame.scale(),
                },
                bounds: body.bounds(),
            });
        }
        Body::Block(one) => {
            let place = Place::new(one.frame());
            let half = one.half_sides();
            for (axis, sign) in (0..3).flat_map(|i| [(i, -1.0), (i, 1.0)]) {
                let form = Form::Face { half, axis, sign };
                out.push(Sheet::flat(index, place.clone(), form));
            }
        }
    }
    Some(())
}

fn revolved(index: usize, body: &Arc<Body>, one: &Revolved, out: &mut Vec<Sheet>) {
    let frame = one.frame();
    let (place, scale) = (Place::new(frame), frame.scale());
    let wedge = match one.turn() {
        Turn::Full => None,
        Turn::Partial(wedge) => Some(wedge),
    };
    let turn = wedge.map_or([0.0, TAU], |w| {
        [w.from().to_radians(), w.degrees().to_radians()]
    });
    let swept = one.boundary().iter().filter(|b| !b.piece.on_axis);
    for BoundaryPiece { piece, .. } in swept {
        let form = Form::Swept {
            profile: Profile::new(piece, scale),
            wedge: wedge.cloned(),
            turn,
        };
        let bounds = ring_box(&place, piece, scale);
        out.push(Sheet {
            body: index,
            place: place.clone(),
            form,
            bounds,
        });
    }
    let corners = || {
        let ends = (one.boundary().iter()).flat_map(|b| [b.piece.start(), b.piece.end()]);
        ends.map(|p| vec2(p.map(Real::f64)) * scale)
    };
    let low = corners().fold(DVec2::INFINITY, DVec2::min);
    let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
    for direction in wedge.iter().flat_map(|w| w.directions()) {
        let form = Form::Cap {
            body: body.clone(),
            direction,
            scale,
            low,
            high,
        };
        out.push(Sheet::flat(index, place.clone(), form));
    }
}

/// A box around the ring that a piece sweeps.
fn ring_box(place: &Place, piece: &Piece, scale: f64) -> Aabb {
    let e = place.axes[2];
    let [low, high] = [piece.bounds().min, piece.bounds().max].map(|p| vec2(p) * scale);
    let flat = (DVec3::ONE - e * e).max(DVec3::ZERO);
    let across = DVec3::from_array(flat.to_array().map(f64::sqrt)) * high.x;
    let (a, b) = (place.origin + e * low.y, place.origin + e * high.y);
    Aabb {
        min: a.min(b) - across,
        max: a.max(b) + across,
    }
}

impl Profile {
    fn new(piece: &Piece, scale: f64) -> Self {
        let [start, end] = [piece.start(), piece.end()].map(|p| vec2(p.map(Real::f64)) * scale);
        if piece.degree() == 1 {
            let along =
                DVec2::from_array([0, 1].map(|c| (piece.end()[c] - piece.start()[c]).f64()));
            return Self::Line {
                start,
                along: along.normalize_or_zero(),
                length: along.length() * scale,
            };
        }
        if let Some((centre, radius)) = piece.circle() {
            let mut centre = vec2(centre.map(Real::f64)) * scale;
            let radius = radius.f64() * scale;
            if centre.x.abs() <= 1e-14 * radius {
                centre.x = 0.0;
            }
            return Self::Circle {
                centre,
                radius,
                ends: [start, end],
            };
        }
        Self::Rational {
            piece: Box::new(piece.clone()),
            scale,
            bend: largest_bend(piece) / scale,
        }
    }

    /// Value and gradient at a point of the half-plane.
    fn flat(&self, q: DVec2) -> (f64, DVec2) {
        match self {
            Self::Line { start, along, .. } => {
                let normal = DVec2::new(along.y, -along.x);
                (normal.dot(q - *start), normal)
            }
            Self::Circle { centre, radius, .. } => {
                let v = q - *centre;
                let length = v.length();
                let out = v.try_normalize().unwrap_or(DVec2::X);
                (length - radius, out)
            }
            Self::Rational { piece, scale, .. } => {
                let t = rational_foot(piece, q / *scale);
                let slope = vec2(piece.twin().slope(t)).normalize_or(DVec2::Y);
                let normal = DVec2::new(slope.y, -slope.x);
                (normal.dot(q - rational_at(piece, t) * *scale), normal)
            }
        }
    }

    fn at(&self, t: f64) -> DVec2 {
        match self {
            Self::Line {
                start,
                along,
                length,
            } => *start + *along * (t * length),
            Self::Circle {
                centre,
                radius,
                ends,
            } => {
                let [a, b] = ends.map(|e| e - *centre);
                let turn = a.angle_to(b) * t;
                *centre + DVec2::from_angle(turn).rotate(a.normalize_or(DVec2::X)) * *radius
            }
            Self::Rational { piece, scale, .. } => rational_at(piece, t) * *scale,
        }
    }

    /// How far within its ends the foot of a point is.
    fn margin(&self, q: DVec2) -> f64 {
        match self {
            Self::Line {
                start,
                along,
                length,
            } => {
                let s = along.dot(q - *start);
                s.min(length - s)
            }
            Self::Circle { centre, ends, .. } => {
                let v = q - *centre;
                let [s, e] = ends.map(|p| p - *centre);
                let turn = s.perp_dot(e);
                let within = s.perp_dot(v) * turn >= 0.0 && v.perp_dot(e) * turn >= 0.0;
                let far = (q - ends[0]).length().min((q - ends[1]).length());
                if within { far } else { -far }
            }
            Self::Rational { piece, scale, .. } => {
                let t = rational_foot(piece, q / *scale);
                let ends = [0.0, 1.0].map(|t| rational_at(piece, t) * *scale);
                let far = (q - ends[0]).length().min((q - ends[1]).length());
                if (0.0..=1.0).contains(&t) { far } else { -far }
            }
        }
    }

    /// A bound on the second derivatives of the value, turned about the axis, within `reach` of a point.
    fn bend(&self, q: DVec2, reach: f64) -> f64 {
        let over = |length: f64| over_axis(1.0, length);
        match self {
            // The normal's part across the axis.
            Self::Line { along, .. } => over_axis(along.y, q.x - reach),
            Self::Circle { centre, .. } => {
                let tube = over((q - *centre).length() - reach);
                if centre.x == 0.0 {
                    tube
                } else {
                    tube.max(over(q.x - reach))
                }
            }
            Self::Rational { bend, .. } => (2.0 * bend).max(over(q.x - reach)),
        }
    }
}

/// A bound on the second derivatives of a linear function of (ρ, z), turned about the axis: its slope along ρ over the
/// least ρ.
pub(super) fn over_axis(slope: f64, least: f64) -> f64 {
    if slope == 0.0 {
        0.0
    } else if least > 0.0 {
        slope.abs() / least
    } else {
        f64::INFINITY
    }
}

fn rational_at(piece: &Piece, t: f64) -> DVec2 {
    vec2(piece.twin().origin) + vec2(piece.twin().at(t))
}

/// The parameter of the nearest point of a piece that goes on a little beyond its ends.
fn rational_foot(piece: &Piece, q: DVec2) -> f64 {
    const BEYOND: f64 = 0.05;
    const SAMPLES: u32 = 16;
    let square = |t: f64| (rational_at(piece, t) - q).length_squared();
    let place = |k: u32| f64::from(k) / f64::from(SAMPLES);
    let samples = (0..=SAMPLES).map(place);
    let nearest = samples.min_by(|&a, &b| square(a).total_cmp(&square(b)));
    let mut t = nearest.unwrap_or_default();
    for _ in 0..20 {
        let off = rational_at(piece, t) - q;
        let slope = vec2(piece.twin().slope(t));
        let h = 1e-6;
        let bend = (vec2(piece.twin().slope(t + h)) - vec2(piece.twin().slope(t - h))) / (2.0 * h);
        let metric = slope.length_squared();
        let second = metric + off.dot(bend);
        let by = if second > 0.1 * metric {
            second
        } else {
            metric
        };
        let next = (t - off.dot(slope) / by).clamp(-BEYOND, 1.0 + BEYOND);
        let step = (next - t).abs();
        t = next;
        if !(step > 1e-16) {
            break;
        }
    }
    t
}

/// The largest curvature of samples of a piece, per unit of its own length.
fn largest_bend(piece: &Piece) -> f64 {
    const SAMPLES: u32 = 64;
    let slope = |k: u32| vec2(piece.twin().slope(f64::from(k) / f64::from(SAMPLES)));
    let bends = (0..SAMPLES).map(|k| {
        let (a, b) = (slope(k), slope(k + 1));
        let length = 0.5 * (a.length() + b.length()) / f64::from(SAMPLES);
        a.angle_to(b).abs() / length
    });
    bends.filter(|b| b.is_finite()).fold(0.0, f64::max)
}

/// How far within a wedge a point of the plane is.
fn wedge_margin(wedge: &Wedge, p: DVec2) -> f64 {
    let far = wedge.directions().map(|d| {
        if d.dot(p) >= 0.0 {
            d.perp_dot(p).abs()
        } else {
            p.length()
        }
    });
    let far = far[0].min(far[1]);
    if wedge.contains(p, 0.0).unwrap_or(true) {
        far
    } else {
        -far
    }
}

impl Sheet {
    /// A flat sheet with the box of its rectangle.
    fn flat(body: usize, place: Place, form: Form) -> Self {
        let mut sheet = Self {
            body,
            place,
            form,
            bounds: NOWHERE,
        };
        for at in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
            let p = sheet.point(at);
            sheet.bounds.min = sheet.bounds.min.min(p);
            sheet.bounds.max = sheet.bounds.max.max(p);
        }
        sheet
    }

    /// What a look at it costs, compared with one at a plane.
    pub(super) fn price(&self) -> u64 {
        match &self.form {
            Form::Swept {
                profile: Profile::Rational { .. },
                ..
            } => 20,
            _ => 1,
        }
    }

    /// Value and gradient.
    pub(super) fn value(&self, x: DVec3) -> (f64, DVec3) {
        let q = self.place.local(x);
        let (value, gradient) = match &self.form {
            Form::Swept { profile, .. } => {
                let rho = q.x.hypot(q.y);
                let out = DVec2::new(q.x, q.y).normalize_or(DVec2::X);
                let (value, g) = profile.flat(DVec2::new(rho, q.z));
                (value, DVec3::new(out.x * g.x, out.y * g.x, g.y))
            }
            Form::Cap { direction: d, .. } => {
                let normal = DVec3::new(-d.y, d.x, 0.0);
                (normal.dot(q), normal)
            }
            Form::Face { half, axis, sign } => (q[*axis] - sign * half[*axis], DVec3::AXES[*axis]),
            Form::Ellipsoid { radii } => {
                let y = q / *radii;
                let (length, least) = (y.length(), radii.min_element());
                let out = y.normalize_or(DVec3::Z);
                ((length - 1.0) * least, out / *radii * least)
            }
        };
        (value, self.place.turned(gradient))
    }

    /// Value, gradient, and what bounds the second derivatives within `reach` of a point.
    pub(super) fn jet(&self, x: DVec3, reach: f64) -> Jet {
        let (value, gradient) = self.value(x);
        Jet {
            value,
            gradient,
            bend: self.bend(x, reach),
        }
    }

    /// A bound on the second derivatives within `reach` of a point.
    pub(super) fn bend(&self, x: DVec3, reach: f64) -> f64 {
        let q = self.place.local(x);
        match &self.form {
            Form::Swept { profile, .. } => profile.bend(DVec2::new(q.x.hypot(q.y), q.z), reach),
            Form::Cap { .. } | Form::Face { .. } => 0.0,
            Form::Ellipsoid { radii } => {
                let least = radii.min_element();
                let room = least * (q / *radii).length() - reach;
                if room > 0.0 {
                    1.0 / room
                } else {
                    f64::INFINITY
                }
            }
        }
    }

    /// How far within the sheet's borders a point is, if it is on the sheet; less than 0 beyond them. It changes by at
    /// most the way, and a sheet is no nearer to a point beyond its borders.
    pub(super) fn margin(&self, x: DVec3) -> f64 {
        let q = self.place.local(x);
        match &self.form {
            Form::Swept { profile, wedge, .. } => {
                let flat = DVec2::new(q.x, q.y);
                let own = profile.margin(DVec2::new(flat.length(), q.z));
                let turned = wedge.as_ref().map(|w| wedge_margin(w, flat));
                turned.map_or(own, |t| own.min(t))
            }
            Form::Cap {
                body,
                direction,
                scale,
                ..
            } => {
                let at = [direction.dot(DVec2::new(q.x, q.y)) / scale, q.z / scale];
                let Some(one) = body.revolved() else {
                    return f64::NEG_INFINITY;
                };
                let far = one.cap_edges().distance(at, f64::INFINITY) * scale;
                if one.section_holds(at) { far } else { -far }
            }
            Form::Face { half, axis, .. } => {
                let room = *half - q.abs();
                let others = (0..3).filter(|k| k != axis);
                others.map(|k| room[k]).fold(f64::INFINITY, f64::min)
            }
            Form::Ellipsoid { .. } => f64::INFINITY,
        }
    }

    /// The point with those parameters.
    pub(super) fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let local = match &self.form {
            Form::Swept { profile, turn, .. } => {
                let p = profile.at(u);
                let (sin, cos) = (turn[0] + turn[1] * v).sin_cos();
                DVec3::new(p.x * cos, p.x * sin, p.y)
            }
            Form::Cap {
                direction: d,
                low,
                high,
                ..
            } => {
                let p = *low + (*high - *low) * DVec2::new(u, v);
                DVec3::new(p.x * d.x, p.x * d.y, p.y)
            }
            Form::Face { half, axis, sign } => {
                let mut q = DVec3::ZERO;
                q[*axis] = sign * half[*axis];
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                q[j] = (2.0 * u - 1.0) * half[j];
                q[k] = (2.0 * v - 1.0) * half[k];
                q
            }
            Form::Ellipsoid { radii } => {
                let ((sin, cos), (s, c)) = (((u - 0.5) * PI).sin_cos(), (v * TAU).sin_cos());
                DVec3::new(cos * c, cos * s, sin) * *radii
            }
        };
        self.place.world(local)
    }

    /// How far along each parameter a tile reaches from its middle, at most.
    pub(super) fn reach(&self, tile: &Tile) -> [f64; 2] {
        let [u, v] = [0, 1].map(|k| 0.5 * (tile.high[k] - tile.low[k]));
        match &self.form {
            Form::Swept { profile, turn, .. } => {
                let [a, m, b] =
                    [tile.low[0], tile.middle()[0], tile.high[0]].map(|t| profile.at(t));
                // Pieces are monotone in both coordinates.
                let along = (a - m).length().max((b - m).length());
                [along, a.x.max(b.x) * turn[1] * v]
            }
            Form::Cap { low, high, .. } => [(high.x - low.x) * u, (high.y - low.y) * v],
            Form::Face { half, axis, .. } => {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                [2.0 * half[j] * u, 2.0 * half[k] * v]
            }
            Form::Ellipsoid { radii } => {
                let most = radii.max_element();
                [most * PI * u, most * TAU * v]
            }
        }
    }

    /// A box around a tile.
    pub(super) fn tile_box(&self, tile: &Tile) -> Aabb {
        let around = |points: &mut dyn Iterator<Item = DVec3>, room: f64| {
            points.fold(NOWHERE, |b, p| Aabb {
                min: b.min.min(p - room),
                max: b.max.max(p + room),
            })
        };
        let [u, v] = [0, 1].map(|k| [tile.low[k], tile.high[k]]);
        match &self.form {
            Form::Swept { profile, turn, .. } if turn[1] * (v[1] - v[0]) < 1.6 => {
                // Pieces are monotone in both coordinates; between two angles a circle is a little off the chord.
                let [a, b] = u.map(|u| profile.at(u));
                let half = 0.5 * turn[1] * (v[1] - v[0]);
                let room = a.x.max(b.x) * (1.0 - half.cos());
                let corners = [a.x, b.x].into_iter().flat_map(|r| [(r, a.y), (r, b.y)]);
                let mut points = corners.flat_map(|(r, z)| {
                    v.map(|v| {
                        let (sin, cos) = (turn[0] + turn[1] * v).sin_cos();
                        self.place.world(DVec3::new(r * cos, r * sin, z))
                    })
                });
                around(&mut points, room)
            }
            Form::Cap { .. } | Form::Face { .. } => {
                let mut points = u.into_iter().flat_map(|u| v.map(|v| self.point([u, v])));
                around(&mut points, 0.0)
            }
            _ => {
                let [a, b] = self.reach(tile);
                around(&mut std::iter::once(self.point(tile.middle())), a.hypot(b))
            }
        }
    }

    /// Whether another sheet is on the same surface: it is at points all over this one, with the same tangent planes.
    pub(super) fn coincides(&self, other: &Self, touch: f64) -> bool {
        const PLACES: [[f64; 2]; 9] = [
            [0.031, 0.043],
            [0.967, 0.071],
            [0.053, 0.943],
            [0.971, 0.957],
            [0.491, 0.517],
            [0.237, 0.311],
            [0.733, 0.281],
            [0.269, 0.787],
            [0.769, 0.713],
        ];
        let narrow = matches!(
            other.form,
            Form::Swept {
                profile: Profile::Rational { .. },
                ..
            }
        );
        let (mut met, mut all) = (0, true);
        for at in PLACES {
            let x = self.point(at);
            if narrow && other.margin(x) < 0.0 {
                continue;
            }
            let ((_, own), (value, gradient)) = (self.value(x), other.value(x));
            let size = own.length() * gradient.length();
            met += 1;
            all &= value.abs() <= touch && own.cross(gradient).length() <= 1e-6 * size;
        }
        all && met > 0
    }
}
