//! Surfaces in a voxel, and where rows of it cross them.
//!
//! A voxel is the cube of side 1 about the origin. A body's own coordinates are linear in the cube's:
//!
//! ```text
//!   local = o + p_0 m_0 + p_1 m_1 + p_2 m_2        -½ <= p_i <= ½
//! ```
//!
//! and a row is what moves along one of the three, the others fixed. Straight pieces of a profile, circles about points of
//! the axis and ellipsoids are quadrics in p, horizontal pieces, caps and sides of blocks planes. Other pieces are crossed
//! at one height, or one radius, where a row is normal or parallel to the axis, else at the zeros of a polynomial:
//!
//! ```text
//!   |d_z o_xy + (z - o_z) d_xy|² = d_z² r²          of the parameter of the piece; o and d of the row
//! ```

use super::super::fraction::{illinois, parameter, sign_changes};
use crate::math::Real;
use crate::math::bernstein::{self, Coefficients};
use crate::region::{BoundaryPiece, Piece};
use glam::DVec3;
use smallvec::SmallVec;
use std::cell::Cell;

/// A body's coordinates over a voxel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Affine {
    pub(super) o: DVec3,
    pub(super) m: [DVec3; 3],
}

impl Affine {
    pub(super) fn at(&self, p: [f64; 3]) -> DVec3 {
        self.o + self.m[0] * p[0] + self.m[1] * p[1] + self.m[2] * p[2]
    }

    /// One of the coordinates.
    pub(super) fn form(&self, c: usize) -> Form {
        Form {
            slope: self.m.map(|m| m[c]),
            constant: self.o[c],
        }
    }

    /// The place along `k` of a local point: the columns are normal to each other.
    pub(super) fn place(&self, k: usize, local: DVec3) -> f64 {
        self.m[k].dot(local - self.o) / self.m[k].length_squared()
    }
}

/// `slope · p + constant`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    pub(super) slope: [f64; 3],
    pub(super) constant: f64,
}

impl Form {
    pub(super) fn at(&self, p: [f64; 3]) -> f64 {
        self.slope[0] * p[0] + self.slope[1] * p[1] + self.slope[2] * p[2] + self.constant
    }

    /// `a self + b`.
    pub(super) fn scaled(&self, a: f64, b: f64) -> Self {
        Self {
            slope: self.slope.map(|s| s * a),
            constant: self.constant * a + b,
        }
    }

    /// The least and the largest value in the voxel.
    pub(super) fn span(&self) -> [f64; 2] {
        let half = 0.5 * self.slope.iter().map(|s| s.abs()).sum::<f64>();
        [self.constant - half, self.constant + half]
    }
}

/// `p·Q p + 2 q·p + c`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    pub(super) squares: [[f64; 3]; 3],
    pub(super) linear: [f64; 3],
    pub(super) constant: f64,
}

impl Quadric {
    /// With `times` the square of a form added.
    pub(super) fn plus(mut self, form: &Form, times: f64) -> Self {
        for i in 0..3 {
            for j in 0..3 {
                self.squares[i][j] += times * form.slope[i] * form.slope[j];
            }
            self.linear[i] += times * form.slope[i] * form.constant;
        }
        self.constant += times * form.constant * form.constant;
        self
    }

    /// The coefficients a, b, c of `a s² + 2 b s + c` along `i` through a point.
    pub(super) fn along(&self, i: usize, p: [f64; 3]) -> [f64; 3] {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let q = &self.squares;
        let b = q[i][j] * p[j] + q[i][k] * p[k] + self.linear[i];
        let c = q[j][j] * p[j] * p[j]
            + q[k][k] * p[k] * p[k]
            + 2.0 * (q[j][k] * p[j] * p[k] + self.linear[j] * p[j] + self.linear[k] * p[k])
            + self.constant;
        [q[i][i], b, c]
    }

    /// Half its gradient.
    pub(super) fn slope(&self, p: [f64; 3]) -> DVec3 {
        let row = |i: usize| (0..3).map(|j| self.squares[i][j] * p[j]).sum::<f64>();
        DVec3::new(row(0), row(1), row(2)) + DVec3::from_array(self.linear)
    }

    pub(super) fn at(&self, p: [f64; 3]) -> f64 {
        let [a, b, c] = self.along(0, p);
        (a * p[0] + 2.0 * b) * p[0] + c
    }
}

/// The zeros of `a s² + 2 b s + c` with the sign of the slope there.
pub(super) fn zeros([a, b, c]: [f64; 3]) -> SmallVec<[(f64, f64); 2]> {
    let mut found = SmallVec::new();
    let square = b * b - a * c;
    if !(square > 0.0) {
        return found;
    }
    let root = square.sqrt();
    // The larger sum first; the other zero by the product.
    let sum = -(b + root.copysign(b));
    let mut add = |s: f64, slope: f64| {
        if s.abs() < 1e6 {
            found.push((s, slope));
        }
    };
    // At sum / a the slope is a s + b = -sign(b) root, at c / sum the opposite.
    add(sum / a, -root.copysign(b));
    add(c / sum, root.copysign(b));
    found
}

/// A place of a row where a surface crosses it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Event {
    pub(super) place: f64,
    /// Which branch of which surface.
    pub(super) label: u32,
    pub(super) solid: u16,
    /// Whether what follows is inside of the solid.
    pub(super) inside: bool,
}

/// What a row is: it moves along `along` through the point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) along: usize,
    pub(super) through: [f64; 3],
}

/// A turned frame whose axis is along one of the cube's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aligned {
    pub(super) axis: usize,
    /// The height is `z0 + rise p` along the axis; across it `x0 + scale p`, the distances from the axis' planes.
    pub(super) z0: f64,
    pub(super) rise: f64,
    pub(super) x0: [f64; 3],
    pub(super) scale: [f64; 3],
}

impl Aligned {
    /// `None` where the axis is along none.
    pub(super) fn new(affine: &Affine) -> Option<Self> {
        let axis = (0..3).max_by(|&i, &j| {
            let share = |k: usize| affine.m[k].z.abs() / affine.m[k].length();
            share(i).total_cmp(&share(j))
        })?;
        let along = (0..3).all(|k| {
            let m = affine.m[k];
            let off = if k == axis { m.x.hypot(m.y) } else { m.z.abs() };
            off <= 4.0 * f64::EPSILON * m.length()
        });
        let scale = [0, 1, 2].map(|k| affine.m[k].x.hypot(affine.m[k].y));
        let x0 = [0, 1, 2].map(|k| {
            let m = affine.m[k];
            (m.x * affine.o.x + m.y * affine.o.y) / scale[k]
        });
        along.then_some(Self {
            axis,
            z0: affine.o.z,
            rise: affine.m[axis].z,
            x0,
            scale,
        })
    }

    pub(super) fn across(&self, k: usize, p: f64) -> f64 {
        self.x0[k] + self.scale[k] * p
    }

    pub(super) fn across_from(&self, k: usize, x: f64) -> f64 {
        (x - self.x0[k]) / self.scale[k]
    }

    pub(super) fn height(&self, p: f64) -> f64 {
        self.z0 + self.rise * p
    }

    pub(super) fn height_from(&self, z: f64) -> f64 {
        (z - self.z0) / self.rise
    }
}

/// A bent piece of a profile.
#[derive(Debug)]
pub(super) struct Bend<'a> {
    pub(super) part: BoundaryPiece<'a>,
    /// Both ends, (r, z).
    pub(super) ends: [[f64; 2]; 2],
    circle: Option<Circle>,
    /// The last question and its answer, for either coordinate.
    last: [Cell<(f64, f64)>; 2],
}

#[derive(Debug, Clone, Copy)]
struct Circle {
    centre: [f64; 2],
    radius: f64,
    /// On which sides of the centre the piece lies.
    sides: [f64; 2],
}

impl<'a> Bend<'a> {
    pub(super) fn new(part: BoundaryPiece<'a>) -> Self {
        let piece = part.piece;
        let ends = [piece.start().map(Real::f64), piece.end().map(Real::f64)];
        let circle = piece.circle().map(|(centre, radius)| {
            let centre = centre.map(Real::f64);
            let side = |c: usize| {
                let middle = 0.5 * (ends[0][c] + ends[1][c]);
                1_f64.copysign(middle - centre[c])
            };
            Circle {
                centre,
                radius: radius.f64(),
                sides: [side(0), side(1)],
            }
        });
        let none = || Cell::new((f64::NAN, f64::NAN));
        Self {
            part,
            ends,
            circle,
            last: [none(), none()],
        }
    }

    /// Centre, (r, z), and radius of a circular piece.
    pub(super) fn circle(&self) -> Option<([f64; 2], f64)> {
        self.circle.map(|c| (c.centre, c.radius))
    }

    /// A vector along the normal (r, z) at a point of the piece.
    fn normal(&self, [r, z]: [f64; 2]) -> [f64; 2] {
        match self.circle {
            Some(Circle { centre, .. }) => [r - centre[0], z - centre[1]],
            None => {
                // By the coordinate that moves more.
                let sides = [0, 1].map(|c| (self.ends[1][c] - self.ends[0][c]).abs());
                let c = usize::from(sides[1] > sides[0]);
                let t = parameter(self.part.piece, c, [r, z][c]);
                let [dr, dz] = self.part.piece.twin().slope(t);
                [dz, -dr]
            }
        }
    }

    /// The other coordinate where `c` is `v`; `None` beyond the piece.
    pub(super) fn at(&self, c: usize, v: f64) -> Option<f64> {
        let (a, b) = (self.ends[0][c], self.ends[1][c]);
        if !(v >= a.min(b) && v < a.max(b)) {
            return None;
        }
        let (asked, known) = self.last[c].get();
        #[allow(clippy::float_cmp, reason = "the same question")]
        if asked == v {
            return Some(known);
        }
        let other = match self.circle {
            Some(Circle {
                centre,
                radius,
                sides,
            }) => {
                let d = v - centre[c];
                let square = ((radius - d) * (radius + d)).max(0.0);
                centre[1 - c] + sides[1 - c] * square.sqrt()
            }
            None => {
                let twin = self.part.piece.twin();
                let t = parameter(self.part.piece, c, v);
                twin.at(t)[1 - c] + twin.origin[1 - c]
            }
        };
        self.last[c].set((v, other));
        Some(other)
    }
}

/// Which of a surface's points count: a stretch of a straight piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) ends: [[f64; 2]; 2],
    height: Form,
}

impl Stretch {
    pub(super) fn new(ends: [[f64; 2]; 2], height: Form) -> Self {
        Self { ends, height }
    }

    fn holds(&self, p: [f64; 3], affine: &Affine) -> bool {
        let [a, b] = self.ends;
        let (dr, dz) = (b[0] - a[0], b[1] - a[1]);
        let between = |v: f64, c: usize| v >= a[c].min(b[c]) && v < a[c].max(b[c]);
        let z = self.height.at(p);
        if dz.abs() >= dr.abs() {
            return between(z, 1);
        }
        // Of the two nappes of a cone the one with the piece.
        let side = (a[0] * dz + dr * (z - a[1])) * dz;
        let q = affine.at(p);
        side >= 0.0 && between(q.x.hypot(q.y), 0)
    }

    /// The same for a part of a sphere, which a height is enough for.
    fn holds_height(&self, p: [f64; 3]) -> bool {
        let [a, b] = self.ends;
        let z = self.height.at(p);
        z >= a[1].min(b[1]) && z < a[1].max(b[1])
    }
}

/// A surface that rows cross.
#[derive(Debug)]
pub(super) enum Sheet<'a> {
    /// What a straight piece sweeps: positive at larger radii.
    Cone { quadric: Quadric, stretch: Stretch },
    /// What a circle about a point of the axis sweeps.
    Sphere { quadric: Quadric, stretch: Stretch },
    /// A whole quadric: positive outside.
    Ball { quadric: Quadric },
    /// A ring normal to the axis, or a whole plane: positive above.
    Plane { form: Form, radii: Option<[f64; 2]> },
    /// What any other piece sweeps.
    Bent(Bend<'a>),
}

/// A sheet, and on which side of it the solid is.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    pub(super) sheet: Sheet<'a>,
    /// Whether the solid is where the sheet's function is negative; at smaller radii, for a bent piece.
    pub(super) inside_below: bool,
    /// For a bent piece whether the solid is above it.
    pub(super) inside_above: bool,
    pub(super) label: u32,
    pub(super) solid: u16,
}

/// Places further away from the voxel than this are not looked at.
const FAR: f64 = 4.0;

impl Surface<'_> {
    /// A vector along the surface's normal at a place of a line, by the voxel's coordinates.
    pub(super) fn slope(&self, affine: &Affine, line: Line, place: f64) -> DVec3 {
        let mut p = line.through;
        p[line.along] = place;
        match &self.sheet {
            Sheet::Cone { quadric, .. }
            | Sheet::Sphere { quadric, .. }
            | Sheet::Ball { quadric } => quadric.slope(p),
            Sheet::Plane { form, .. } => DVec3::from_array(form.slope),
            Sheet::Bent(bend) => {
                let local = affine.at(p);
                let [r, z] = bend.normal([local.x.hypot(local.y), local.z]);
                let flat = local.truncate().normalize_or(glam::DVec2::X) * r;
                let normal = flat.extend(z);
                DVec3::from_array(affine.m.map(|m| m.dot(normal)))
            }
        }
    }

    /// Adds the places at which a line crosses the surface.
    pub(super) fn crossings(
        &self,
        affine: &Affine,
        aligned: Option<&Aligned>,
        line: Line,
        out: &mut SmallVec<[Event; 24]>,
    ) {
        let Line { along, through } = line;
        let mut add = |place: f64, branch: u32, inside: bool| {
            if place.abs() <= FAR {
                out.push(Event {
                    place,
                    label: self.label + branch,
                    solid: self.solid,
                    inside,
                });
            }
        };
        let on = |s: f64| {
            let mut p = through;
            p[along] = s;
            p
        };
        match &self.sheet {
            Sheet::Cone { quadric, stretch } => {
                for (s, slope) in zeros(quadric.along(along, through)) {
                    if s.abs() <= FAR && stretch.holds(on(s), affine) {
                        add(s, branch(slope), (slope > 0.0) != self.inside_below);
                    }
                }
            }
            Sheet::Sphere { quadric, stretch } => {
                for (s, slope) in zeros(quadric.along(along, through)) {
                    if s.abs() <= FAR && stretch.holds_height(on(s)) {
                        add(s, branch(slope), (slope > 0.0) != self.inside_below);
                    }
                }
            }
            Sheet::Ball { quadric } => {
                for (s, slope) in zeros(quadric.along(along, through)) {
                    add(s, branch(slope), (slope > 0.0) != self.inside_below);
                }
            }
            Sheet::Plane { form, radii } => {
                let slope = form.slope[along];
                let s = -(form.at(on(0.0))) / slope;
                if !(s.abs() <= FAR) {
                    return;
                }
                let within = radii.is_none_or(|[low, high]| {
                    let q = affine.at(on(s));
                    let r = q.x.hypot(q.y);
                    r >= low && r < high
                });
                if within {
                    add(s, 0, (slope > 0.0) != self.inside_below);
                }
            }
            Sheet::Bent(bend) => match aligned {
                Some(frame) => self.bent(bend, frame, line, &mut add),
                None => self.bent_any(bend, affine, line, &mut add),
            },
        }
    }

    fn bent(
        &self,
        bend: &Bend,
        frame: &Aligned,
        Line { along, through }: Line,
        add: &mut impl FnMut(f64, u32, bool),
    ) {
        let (j, k) = ((along + 1) % 3, (along + 2) % 3);
        if frame.axis == along {
            let r = frame
                .across(j, through[j])
                .hypot(frame.across(k, through[k]));
            if let Some(z) = bend.at(0, r) {
                let upward = frame.rise > 0.0;
                add(frame.height_from(z), 0, self.inside_above == upward);
            }
            return;
        }
        let Some(r) = bend.at(1, frame.height(through[frame.axis])) else {
            return;
        };
        let other = 3 - along - frame.axis;
        let q = frame.across(other, through[other]);
        let square = (r - q) * (r + q);
        if square > 0.0 {
            let x = square.sqrt();
            add(frame.across_from(along, -x), 0, self.inside_below);
            add(frame.across_from(along, x), 1, !self.inside_below);
        }
    }

    /// Of a piece about any axis.
    fn bent_any(
        &self,
        bend: &Bend,
        affine: &Affine,
        Line { along, through }: Line,
        add: &mut impl FnMut(f64, u32, bool),
    ) {
        let mut start = through;
        start[along] = 0.0;
        let (o, d) = (affine.at(start), affine.m[along]);
        let (flat, across) = (d.x * o.x + d.y * o.y, d.x * d.x + d.y * d.y);
        let piece = bend.part.piece;
        let tangent_sign = if bend.part.forward { 1.0 } else { -1.0 };
        let mut crossing = |s: f64, t: f64, branch: u32| {
            let [dr, dz] = piece.twin().slope(t);
            let p = o + d * s;
            let r = p.x.hypot(p.y);
            // Outward is right of the way along which the solid is left.
            let out = dz * (p.x * d.x + p.y * d.y) / r - dr * d.z;
            add(s, branch, out * tangent_sign < 0.0);
        };
        // Where the radius is r, of both places the one at that height.
        let at_radius = |r: f64, sign: f64| {
            let far = (o.x * d.y - o.y * d.x).powi(2) / across;
            let square = r * r - far;
            (square >= 0.0).then(|| (-flat + sign * (square * across).sqrt()) / across)
        };
        if d.z.abs() <= 1e-13 * d.length() {
            let Some(r) = bend.at(1, o.z) else { return };
            let t = parameter(bend.part.piece, 1, o.z);
            for (sign, branch) in [(-1.0, 0), (1.0, 1)] {
                if let Some(s) = at_radius(r, sign) {
                    crossing(s, t, branch);
                }
            }
            return;
        }
        for (branch, t) in (0..).zip(parameters(piece, o, d)) {
            let twin = piece.twin();
            let at = twin.at(t);
            let (r, z) = (at[0] + twin.origin[0], at[1] + twin.origin[1]);
            let by_height = (z - o.z) / d.z;
            let s = if d.z * d.z >= 0.1 * across {
                Some(by_height)
            } else {
                let two = [-1.0, 1.0].map(|sign| at_radius(r, sign));
                let near = |a: &f64, b: &f64| {
                    let off = |s: f64| (s - by_height).abs();
                    off(*a).total_cmp(&off(*b))
                };
                two.into_iter().flatten().min_by(near)
            };
            if let Some(s) = s {
                crossing(s, t, branch);
            }
        }
    }
}

fn branch(slope: f64) -> u32 {
    u32::from(slope > 0.0)
}

/// The parameters in [0, 1) at which a line meets what a piece sweeps.
pub(in super::super) fn parameters(piece: &Piece, o: DVec3, d: DVec3) -> SmallVec<[f64; 16]> {
    let twin = piece.twin();
    let ([r, z, w], origin) = (twin.rows(), twin.origin);
    let plus = |a: &[f64], b: &[f64], times: f64| -> Coefficients<f64> {
        a.iter().zip(b).map(|(a, b)| a + times * b).collect()
    };
    let scaled =
        |a: &[f64], times: f64| -> Coefficients<f64> { a.iter().map(|a| a * times).collect() };
    let (r, z) = (plus(&r, &w, origin[0]), plus(&z, &w, origin[1] - o.z));
    let [x, y] = [[o.x, d.x], [o.y, d.y]].map(|[o, d_across]| {
        let even = scaled(&w, d.z * o);
        plus(&even, &z, d_across)
    });
    let r = scaled(&r, d.z);
    let [x, y, r] = [&x, &y, &r].map(|c| bernstein::product(c, c));
    let f = bernstein::difference(&bernstein::sum(&x, &y), &r);
    let mut found = SmallVec::new();
    sign_changes(&f, 0.0, 1.0, 0, &mut found);
    found
}

/// The zero of a function between two values of different sign.
pub(super) fn zero(f: &impl Fn(f64) -> f64, [a, b]: [f64; 2], [fa, fb]: [f64; 2]) -> f64 {
    illinois(f, a, b, fa, fb)
}
