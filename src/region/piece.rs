//! A bi-monotone rational Bézier piece, in double-double and in f64.
//!
//! Neither r nor z turns within a piece, so the part between two parameters spans exactly the box
//! of the two points. Searching a height or a radius is then bisection with a proof at each step.
//!
//! Lengths are in the region's unit. The f64 twin is centred on its own start, so its rounding is
//! that of the piece's extent and not of its place:
//!
//! ```text
//!   |found - exact| <= γ(6 p + 8) · max_i |P_i - origin|        for positive weights
//! ```

use super::curve::{Bezier, HomogeneousPoint};
use super::tree::Box2;
use crate::math::bernstein::{self, Coefficients};
use crate::math::tolerance::{ON_BOUNDARY, gamma};
use crate::math::{Dd, Real};
use std::cmp::Ordering;
use std::ops::Deref;

/// Where a point lies relative to a piece, looking along +r at the point's height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Position {
    /// The piece passes at a larger r.
    Before,
    /// The piece passes through the point, to the resolution of double-double.
    On,
    /// The piece passes at a smaller r.
    Behind,
}

/// Uniform parameters at which every piece is tabulated.
pub(crate) const TABLE: usize = 16;

/// A part of a curve on which r and z are both monotone.
///
/// A profile may have very many straight pieces between points that are f64s: they take no more than these.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    /// Start and end, each rounded to f64.
    ends: [[f64; 2]; 2],
    /// What else there is.
    rest: Option<Box<Rest>>,
    loop_index: u32,
    /// On r = 0, where nothing is swept.
    pub(crate) on_axis: bool,
}

/// What a piece has besides f64s of its ends.
#[derive(Debug, Clone)]
struct Rest {
    start: [Dd; 2],
    end: [Dd; 2],
    /// `None` of a straight piece.
    curve: Option<Curve>,
}

/// What makes a piece curved.
#[derive(Debug, Clone)]
struct Curve {
    /// Homogeneous control points.
    points: Vec<HomogeneousPoint>,
    /// Centre and radius of a circular piece.
    circle: Option<([Dd; 2], Dd)>,
    /// The point the coefficients are relative to.
    origin: [f64; 2],
    /// Coefficients of w (r - origin), w (z - origin) and w.
    coefficients: [Coefficients<f64>; 3],
    /// Bound on the rounding of a coordinate that they give.
    error: f64,
    /// Points at the parameters i / [`TABLE`], relative to the origin; empty until they are asked for.
    table: Vec<[f64; 2]>,
}

/// The f64 side of a piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Twin<'a> {
    /// The point the coefficients are relative to.
    pub(crate) origin: [f64; 2],
    /// Bound on the rounding of an evaluated coordinate.
    pub(crate) error: f64,
    shape: Shape<'a>,
}

#[derive(Debug, Clone, Copy)]
enum Shape<'a> {
    /// Both ends relative to the origin, by coordinate.
    Straight([[f64; 2]; 2]),
    Curved(&'a Curve),
}

/// Coefficients of one homogeneous coordinate of a [`Twin`].
#[derive(Debug, Clone, Copy)]
pub(crate) enum Row<'a> {
    Two([f64; 2]),
    Many(&'a [f64]),
}

impl Deref for Row<'_> {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        match self {
            Self::Two(two) => two,
            Self::Many(many) => many,
        }
    }
}

impl Piece {
    /// A piece with those control points; a straight one is the segment between its ends, whatever their weights.
    pub(crate) fn new(
        points: Vec<HomogeneousPoint>,
        start: [Dd; 2],
        end: [Dd; 2],
        loop_index: usize,
        circle: Option<([Dd; 2], Dd)>,
    ) -> Self {
        if points.len() == 2 {
            return Self::segment(start, end, loop_index);
        }
        let on_axis = points.iter().all(|p| p[0] == Dd::ZERO);
        let origin = start.map(Real::f64);
        let coefficients = relative(&points, origin);
        let error = rounding(&coefficients);
        let curve = Some(Curve {
            points,
            circle,
            origin,
            coefficients,
            error,
            table: Vec::new(),
        });
        Self {
            ends: [start, end].map(|p| p.map(Real::f64)),
            rest: Some(Box::new(Rest { start, end, curve })),
            loop_index: numbered(loop_index),
            on_axis,
        }
    }

    /// A straight piece.
    pub(crate) fn segment(start: [Dd; 2], end: [Dd; 2], loop_index: usize) -> Self {
        let rounded = start.iter().chain(&end).any(|v| v.lo() != 0.0);
        let rest = Rest {
            start,
            end,
            curve: None,
        };
        Self {
            ends: [start, end].map(|p| p.map(Real::f64)),
            rest: rounded.then(|| Box::new(rest)),
            loop_index: numbered(loop_index),
            on_axis: start[0] == Dd::ZERO && end[0] == Dd::ZERO,
        }
    }

    /// The point it starts at.
    #[inline]
    pub(crate) fn start(&self) -> [Dd; 2] {
        match &self.rest {
            None => self.ends[0].map(Dd::of),
            Some(rest) => rest.start,
        }
    }

    /// The point it ends at.
    #[inline]
    pub(crate) fn end(&self) -> [Dd; 2] {
        match &self.rest {
            None => self.ends[1].map(Dd::of),
            Some(rest) => rest.end,
        }
    }

    fn curve(&self) -> Option<&Curve> {
        self.rest.as_ref().and_then(|rest| rest.curve.as_ref())
    }

    pub(crate) fn degree(&self) -> usize {
        self.curve().map_or(1, |c| c.points.len() - 1)
    }

    /// Whether it is neither straight nor circular: nothing of it has a closed form.
    pub(crate) fn is_rational(&self) -> bool {
        self.curve().is_some_and(|c| c.circle.is_none())
    }

    /// Number of the loop it is of.
    pub(crate) fn loop_index(&self) -> usize {
        self.loop_index as usize
    }

    /// Centre and radius of a circular piece.
    pub(crate) fn circle(&self) -> Option<([Dd; 2], Dd)> {
        self.curve().and_then(|c| c.circle)
    }

    /// The box of its ends, which hold all of it.
    #[inline]
    pub(crate) fn bounds(&self) -> Box2 {
        Box2::around(self.ends[0], self.ends[1])
    }

    /// A homogeneous control point.
    pub(crate) fn point(&self, i: usize) -> HomogeneousPoint {
        match self.curve() {
            Some(curve) => curve.points[i],
            None => {
                let [r, z] = if i == 0 { self.start() } else { self.end() };
                [r, z, Dd::ONE]
            }
        }
    }

    /// Its homogeneous control points.
    pub(crate) fn points(&self) -> impl ExactSizeIterator<Item = HomogeneousPoint> + '_ {
        (0..self.degree() + 1).map(|i| self.point(i))
    }

    /// Its f64 side.
    #[inline]
    pub(crate) fn twin(&self) -> Twin<'_> {
        if let Some(curve) = self.curve() {
            return Twin {
                origin: curve.origin,
                error: curve.error,
                shape: Shape::Curved(curve),
            };
        }
        let (origin, start, end) = (self.ends[0], self.start(), self.end());
        let from = |p: [Dd; 2], c: usize| (p[c] - Dd::of(origin[c])).f64();
        let shape = Shape::Straight([0, 1].map(|c| [from(start, c), from(end, c)]));
        let mut twin = Twin {
            origin,
            error: 0.0,
            shape,
        };
        twin.error = rounding(&twin.rows());
        twin
    }

    /// Moves its ends by a rounding.
    pub(crate) fn with_ends(mut self, start: [Dd; 2], end: [Dd; 2]) -> Self {
        match &mut self.rest {
            Some(rest) if rest.curve.is_some() => (rest.start, rest.end) = (start, end),
            _ => return Self::segment(start, end, self.loop_index()),
        }
        self.ends = [start, end].map(|p| p.map(Real::f64));
        self
    }

    /// Takes the points at the parameters i / [`TABLE`] that `of` makes of its coefficients.
    pub(crate) fn tabulate(
        &mut self,
        of: impl FnOnce(usize, &[Coefficients<f64>; 3]) -> Option<Vec<[f64; 2]>>,
    ) {
        if let Some(curve) = self.rest.as_mut().and_then(|rest| rest.curve.as_mut())
            && let Some(table) = of(curve.points.len() - 1, &curve.coefficients)
        {
            curve.table = table;
        }
    }

    /// Whether z does not change along the piece.
    pub(crate) fn is_horizontal(&self) -> bool {
        self.start()[1] == self.end()[1]
    }

    /// +1 where z rises from start to end, -1 where it falls, 0 for a horizontal piece.
    pub(crate) fn direction(&self) -> i32 {
        sign(self.end()[1].partial_cmp(&self.start()[1]))
    }

    /// The coefficients of one homogeneous coordinate.
    fn coordinate(&self, c: usize) -> Coefficients<Dd> {
        self.points().map(|p| p[c]).collect()
    }

    /// The point at `t`.
    pub(crate) fn at(&self, t: Dd) -> [Dd; 2] {
        let [r, z, w] = [0, 1, 2].map(|c| bernstein::evaluate(&self.coordinate(c), t));
        [r / w, z / w]
    }

    /// The part between two parameters, `a < b`.
    pub(crate) fn part(&self, a: Dd, b: Dd, start: [Dd; 2], end: [Dd; 2]) -> Self {
        let coordinates = [0, 1, 2].map(|c| bernstein::restrict(&self.coordinate(c), a, b));
        let points = (0..self.degree() + 1)
            .map(|i| [coordinates[0][i], coordinates[1][i], coordinates[2][i]])
            .collect();
        let mut part = Self::new(points, start, end, self.loop_index(), self.circle());
        part.on_axis = self.on_axis;
        part
    }

    /// The parameter at which coordinate `c` (0 is r, 1 is z) takes the value `v`, which must lie
    /// within the piece's range of it.
    pub(crate) fn parameter_at(&self, c: usize, v: Dd) -> Dd {
        if v == self.start()[c] {
            return Dd::ZERO;
        }
        if v == self.end()[c] {
            return Dd::ONE;
        }
        let f: Coefficients<Dd> = self.points().map(|p| p[c] - v * p[2]).collect();
        bernstein::bracketed_root(&f, self.rough_parameter(c, v.f64()))
    }

    /// A start value for [`parameter_at`](Self::parameter_at): f64 bisection.
    fn rough_parameter(&self, c: usize, v: f64) -> f64 {
        let twin = self.twin();
        let v = v - twin.origin[c];
        let rising = self.end()[c] > self.start()[c];
        let (mut lo, mut hi) = (0.0, 1.0);
        for _ in 0..26 {
            let t = 0.5 * (lo + hi);
            if (twin.at(t)[c] < v) == rising {
                lo = t;
            } else {
                hi = t;
            }
        }
        0.5 * (lo + hi)
    }

    /// The other coordinate where coordinate `c` takes the value `v`.
    pub(crate) fn other_at(&self, c: usize, v: Dd) -> Dd {
        if self.degree() == 1 {
            // Straight, whatever the weights.
            let (a, b) = (self.start(), self.end());
            let s = (v - a[c]) / (b[c] - a[c]);
            return a[1 - c] + (b[1 - c] - a[1 - c]) * s;
        }
        if v == self.start()[c] {
            return self.start()[1 - c];
        }
        if v == self.end()[c] {
            return self.end()[1 - c];
        }
        self.at(self.parameter_at(c, v))[1 - c]
    }

    /// Bounds of the other coordinate where coordinate `c` takes the value `v`, which must lie within the piece's range
    /// of it: by f64 alone. `None` where its rounding leaves no bracket.
    pub(crate) fn bracket_at(&self, c: usize, v: Dd) -> Option<[f64; 2]> {
        let t = self.twin();
        let q = (v - Dd::of(t.origin[c])).f64();
        let error = t.error + 4.0 * f64::EPSILON * q.abs();
        let rising = if self.end()[c] > self.start()[c] {
            1.0
        } else {
            -1.0
        };
        let beyond = |p: [f64; 2]| rising * (p[c] - q);
        let beyond_at = |m: f64| rising * (t.coordinate(c, m) - q);
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let parameter = |i: usize| i as f64 / TABLE as f64;
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        let (mut below, mut above) = (beyond(t.at(0.0)), beyond(t.at(1.0)));
        if !t.table().is_empty() {
            let next = t
                .table()
                .partition_point(|&p| beyond(p) < 0.0)
                .clamp(1, TABLE);
            (low, below) = (parameter(next - 1), beyond(t.table()[next - 1]));
            (high, above) = (parameter(next), beyond(t.table()[next]));
        }
        // Secants, whose older end counts less the better the last one did (Anderson and Björck 1973); bisection where
        // three have not left half of the bracket, as where weights differ by much.
        let mut weights = [1.0_f64; 2];
        let mut wide = high - low;
        for step in 1..150 {
            if high - low <= 4.0 * f64::EPSILON || below.abs().min(above.abs()) <= error {
                break;
            }
            let (a, b) = (weights[0] * below, weights[1] * above);
            let mut m = low + (high - low) * (a / (a - b));
            let slow = step % 3 == 0 && high - low > 0.5 * wide;
            if step % 3 == 0 {
                wide = high - low;
            }
            if slow || !(m > low && m < high) {
                m = 0.5 * (low + high);
            }
            let at = beyond_at(m);
            let left = |last: f64| {
                let left = 1.0 - at / last;
                if left > 0.0 { left } else { 0.5 }
            };
            if at < 0.0 {
                weights = [1.0, weights[1] * left(below)];
                (low, below) = (m, at);
            } else {
                weights = [weights[0] * left(above), 1.0];
                (high, above) = (m, at);
            }
        }
        let slope = (above - below) / (high - low);
        let middle = if below.abs() < above.abs() { low } else { high };
        let mut width = (4.0 * error / slope).max(4.0 * f64::EPSILON);
        for _ in 0..24 {
            let (a, b) = ((middle - width).max(0.0), (middle + width).min(1.0));
            let (p, r) = (t.at(a), t.at(b));
            // An end of the piece is on its side whatever the rounding says.
            if (a == 0.0 || beyond(p) < -error) && (b == 1.0 || beyond(r) > error) {
                let (o, margin) = (t.origin[1 - c], t.error + 2.0 * f64::EPSILON);
                let (x, y) = (p[1 - c] + o, r[1 - c] + o);
                return Some([x.min(y) - margin, x.max(y) + margin]);
            }
            width *= 4.0;
        }
        None
    }

    /// Where the point lies, in double-double. `z` must lie within the piece's heights and the
    /// piece must not be horizontal.
    pub(crate) fn position_exact(&self, r: Dd, z: Dd) -> Position {
        let difference = self.other_at(1, z) - r;
        if difference.abs().f64() <= ON_BOUNDARY {
            Position::On
        } else if difference > Dd::ZERO {
            Position::Before
        } else {
            Position::Behind
        }
    }

    /// Where the point lies, in f64; `None` where the rounding does not decide. `error` bounds the
    /// rounding of `point`, and z must lie within the piece's heights.
    pub(crate) fn position(&self, point: [f64; 2], error: f64) -> Option<Position> {
        let t = self.twin();
        let q = [point[0] - t.origin[0], point[1] - t.origin[1]];
        let error = error + t.error + 4.0 * f64::EPSILON * (q[0].abs() + q[1].abs());
        let decide = |a: f64, b: f64| {
            if q[0] > a.max(b) + error {
                Some(Position::Behind)
            } else if q[0] < a.min(b) - error {
                Some(Position::Before)
            } else {
                None
            }
        };
        let end = [
            (self.end()[0] - Dd::of(t.origin[0])).f64(),
            (self.end()[1] - Dd::of(t.origin[1])).f64(),
        ];
        let start = [
            (self.start()[0] - Dd::of(t.origin[0])).f64(),
            (self.start()[1] - Dd::of(t.origin[1])).f64(),
        ];
        if self.degree() == 1 {
            let (dr, dz) = (end[0] - start[0], end[1] - start[1]);
            let (qr, qz) = (q[0] - start[0], q[1] - start[1]);
            let side = qr * dz - qz * dr;
            let bound = error * (dr.abs() + dz.abs())
                + gamma(8.0) * (qr.abs() * dz.abs() + qz.abs() * dr.abs());
            // Positive on the right of a rising segment, that is behind it.
            return match side.abs() > bound {
                true if (side > 0.0) == (dz > 0.0) => Some(Position::Behind),
                true => Some(Position::Before),
                false => None,
            };
        }
        let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
        let (mut a, mut b) = (start, end);
        let rising = end[1] > start[1];
        let below = |p: [f64; 2]| match (p[1] - q[1]).abs() > error {
            true => Some((p[1] < q[1]) == rising),
            false => None,
        };
        if !t.table().is_empty() {
            // The table narrows the bracket to one interval, two where a node is at the height.
            #[allow(clippy::cast_precision_loss, reason = "a small count")]
            let parameter = |i: usize| i as f64 / TABLE as f64;
            let first_not_below = t.table().partition_point(|&p| below(p) == Some(true));
            let first_above = t.table().partition_point(|&p| below(p) != Some(false));
            if first_not_below > 0 {
                lo = parameter(first_not_below - 1);
                a = t.table()[first_not_below - 1];
            }
            if first_above <= TABLE {
                hi = parameter(first_above);
                b = t.table()[first_above];
            }
        }
        for step in 0..64 {
            if let Some(answer) = decide(a[0], b[0]) {
                return Some(answer);
            }
            let secant = lo + (hi - lo) * ((q[1] - a[1]) / (b[1] - a[1]));
            let middle = 0.5 * (lo + hi);
            // Secant and bisection in turn: the one is quick, the other shrinks both ends.
            let m = if step % 2 == 0 && secant > lo && secant < hi {
                0.98 * secant + 0.02 * middle
            } else {
                middle
            };
            if !(m > lo && m < hi) {
                return None;
            }
            let p = t.at(m);
            match below(p) {
                Some(true) => (lo, a) = (m, p),
                Some(false) => (hi, b) = (m, p),
                None => return None,
            }
        }
        None
    }
}

impl Piece {
    /// The piece under `r -> k r`, `z -> h z + d`, as coaxial frames differ.
    pub(crate) fn mapped(&self, k: Dd, h: Dd, d: Dd) -> Self {
        let point = |p: [Dd; 2]| [p[0] * k, p[1] * h + d];
        let points = self
            .points()
            .map(|p| [p[0] * k, p[1] * h + d * p[2], p[2]])
            .collect();
        let circle = self.circle().map(|(c, r)| (point(c), r * k));
        let mut mapped = Self::new(
            points,
            point(self.start()),
            point(self.end()),
            self.loop_index(),
            circle,
        );
        mapped.on_axis = self.on_axis;
        mapped
    }
}

impl Piece {
    /// The piece in parts whose weights differ by no more than [`SKEW`], cut in the middle of the
    /// longer extent. A heavy weight crowds most of a piece into parameters next to an end, where
    /// f64 cannot tell them apart; in each part's own parameter it can.
    pub(crate) fn even_parts(&self, parts: &mut Vec<Self>) {
        let Some((t, at)) = self.uneven() else {
            parts.push(self.clone());
            return;
        };
        self.part(Dd::ZERO, t, self.start(), at).even_parts(parts);
        self.part(t, Dd::ONE, at, self.end()).even_parts(parts);
    }

    /// Whether it is the only one of its [`even_parts`](Self::even_parts).
    pub(crate) fn is_even(&self) -> bool {
        self.uneven().is_none()
    }

    /// Where it is to be cut: the parameter and the point.
    fn uneven(&self) -> Option<(Dd, [Dd; 2])> {
        if self.degree() == 1 {
            return None;
        }
        let weights = self.points().map(|p| p[2].f64());
        let (low, high) = weights.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
        let (start, end) = (self.start(), self.end());
        let extent = [0, 1].map(|c| (end[c] - start[c]).f64().abs());
        let c = usize::from(extent[1] >= extent[0]);
        if high <= SKEW * low || extent[c] < f64::EPSILON {
            return None;
        }
        let middle = (start[c] + end[c]) * Dd::of(0.5);
        let t = self.parameter_at(c, middle);
        (t > Dd::ZERO && t < Dd::ONE).then(|| (t, self.at(t)))
    }
}

/// Ratio of weights up to which a piece's parameter is even enough: f64 then tells points 2^-47 of
/// the piece apart.
const SKEW: f64 = 32.0;

/// -1, 0 or 1.
pub(crate) fn sign(o: Option<Ordering>) -> i32 {
    match o {
        Some(Ordering::Greater) => 1,
        Some(Ordering::Less) => -1,
        _ => 0,
    }
}

/// The coefficients of w (r - origin), w (z - origin) and w.
fn relative(points: &[HomogeneousPoint], origin: [f64; 2]) -> [Coefficients<f64>; 3] {
    // A power of two brings the largest weight near 1; the curve does not see it.
    let largest = points.iter().fold(0.0_f64, |m, p| m.max(p[2].f64()));
    let power = (-largest.log2().floor()).exp2();
    [0, 1, 2].map(|c| {
        let coefficient = |p: &HomogeneousPoint| {
            let relative = if c < 2 {
                p[c] - Dd::of(origin[c]) * p[2]
            } else {
                p[2]
            };
            relative.scale_by_power_of_two(power).f64()
        };
        points.iter().map(coefficient).collect()
    })
}

/// A bound on the rounding of a coordinate that coefficients give.
fn rounding(coefficients: &[impl Deref<Target = [f64]>; 3]) -> f64 {
    let w = &coefficients[2];
    let reach = |c: usize| {
        let shares = coefficients[c].iter().zip(w.iter());
        shares.fold(0.0_f64, |m, (v, w)| m.max((v / w).abs()))
    };
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let roundings = 6.0 * (w.len() as f64) + 8.0;
    gamma(roundings) * reach(0).max(reach(1))
}

/// Loops are counted in u32.
#[allow(
    clippy::cast_possible_truncation,
    reason = "a scene has no such number of loops"
)]
fn numbered(loop_index: usize) -> u32 {
    loop_index as u32
}

impl<'a> Twin<'a> {
    /// The coefficients of w (r - origin), w (z - origin) and w.
    #[inline]
    pub(crate) fn rows(&self) -> [Row<'a>; 3] {
        match self.shape {
            Shape::Straight([r, z]) => [Row::Two(r), Row::Two(z), Row::Two([1.0; 2])],
            Shape::Curved(curve) => {
                let [r, z, w] = &curve.coefficients;
                [Row::Many(r), Row::Many(z), Row::Many(w)]
            }
        }
    }

    /// Points at the parameters i / [`TABLE`], relative to the origin; none of straight pieces.
    #[inline]
    fn table(&self) -> &'a [[f64; 2]] {
        match self.shape {
            Shape::Straight(_) => &[],
            Shape::Curved(curve) => &curve.table,
        }
    }

    /// The derivative at `t`.
    pub(crate) fn slope(&self, t: f64) -> [f64; 2] {
        let [r, z, w] = self.rows();
        let (w, dw) = bernstein::evaluate_with_derivative(&w, t);
        [r, z].map(|c| {
            let (v, dv) = bernstein::evaluate_with_derivative(&c, t);
            (dv * w - v * dw) / (w * w)
        })
    }

    /// The point at `t`, relative to the origin.
    #[inline]
    pub(crate) fn at(&self, t: f64) -> [f64; 2] {
        match self.shape {
            Shape::Straight(rows) => {
                let w = bernstein::evaluate(&[1.0; 2], t);
                rows.map(|c| bernstein::evaluate(&c, t) / w)
            }
            Shape::Curved(curve) => {
                let w = bernstein::evaluate(&curve.coefficients[2], t);
                [0, 1].map(|c| bernstein::evaluate(&curve.coefficients[c], t) / w)
            }
        }
    }

    /// One of its coordinates.
    #[inline]
    fn coordinate(&self, c: usize, t: f64) -> f64 {
        match self.shape {
            Shape::Straight(rows) => {
                bernstein::evaluate(&rows[c], t) / bernstein::evaluate(&[1.0; 2], t)
            }
            Shape::Curved(curve) => {
                bernstein::evaluate(&curve.coefficients[c], t)
                    / bernstein::evaluate(&curve.coefficients[2], t)
            }
        }
    }
}

/// Cuts a Bézier piece of a curve, already in the region's unit, where r or z turns and where r
/// changes sign. Returns parameters and points of the cuts, both ends included.
pub(crate) fn cuts(bezier: &Bezier) -> Vec<(Dd, [Dd; 2])> {
    let coordinate =
        |c: usize| -> Coefficients<Dd> { bezier.points.iter().map(|p| p[c]).collect() };
    let [r, z, w] = [coordinate(0), coordinate(1), coordinate(2)];
    let polynomial = w.iter().all(|x| *x == w[0]);
    let mut parameters = Vec::new();
    for c in [&r, &z] {
        let turning = if polynomial {
            bernstein::derivative(c)
        } else {
            bernstein::quotient_derivative(c, &w)
        };
        let scale = bernstein::magnitude(c) * bernstein::magnitude(&w);
        parameters.extend(bernstein::sign_change_parameters(&turning, scale));
    }
    let mut crossings: Vec<Dd> = Vec::new();
    if r.iter().any(|x| *x < Dd::ZERO) {
        crossings.extend(bernstein::sign_change_parameters(
            &r,
            bernstein::magnitude(&r),
        ));
        parameters.extend_from_slice(&crossings);
    }
    parameters.sort_by(|a, b| a.partial_cmp(b).expect("parameters are numbers"));
    // Cuts closer than this would leave pieces that double-double cannot evaluate usefully.
    let merge = (-80.0_f64).exp2();
    let mut kept: Vec<Dd> = vec![Dd::ZERO];
    for t in parameters {
        if (t - *kept.last().expect("never empty")).f64() > merge && (Dd::ONE - t).f64() > merge {
            kept.push(t);
        }
    }
    kept.push(Dd::ONE);
    let last = bezier.points.len() - 1;
    kept.into_iter()
        .map(|t| {
            let [a, b, c] = if t == Dd::ZERO {
                bezier.points[0]
            } else if t == Dd::ONE {
                bezier.points[last]
            } else {
                [
                    bernstein::evaluate(&r, t),
                    bernstein::evaluate(&z, t),
                    bernstein::evaluate(&w, t),
                ]
            };
            // Where the curve crosses the axis it is on it, whatever rounding leaves.
            let crosses = (a / c).f64().abs() < merge && crossings.contains(&t);
            let r = if crosses { Dd::ZERO } else { a / c };
            (t, [r, b / c])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::{Boundary, Fill, ProfileCurve, Region};

    #[test]
    fn quick_brackets_hold_the_exact_place() {
        let nurbs = ProfileCurve::Nurbs {
            degree: 3,
            knots: vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0],
            points: vec![[0.8, 0.0], [1.6, 0.0], [0.2, 1.0], [0.9, 1.8]],
            weights: vec![1.0, 3.0, 0.5, 1.0],
        };
        let ring = ProfileCurve::Arc {
            center: [3.0, 0.5],
            radii: [1.0, 0.01],
            tilt: 1.0,
            from: 0.0,
            to: 360.0,
        };
        for (curve, boundary) in [(nurbs, Boundary::ToAxis), (ring, Boundary::Closed)] {
            let region = Region::new(&[vec![curve]], boundary, Fill::EvenOdd).expect("a region");
            let (mut widest, mut missing, mut all) = (0.0_f64, 0, 0);
            for piece in region.section().pieces().iter().filter(|p| p.degree() > 1) {
                let (a, b) = (piece.start()[1], piece.end()[1]);
                for i in 1..400_u32 {
                    // Crowded towards both ends, where the pieces turn.
                    let x = f64::from(i) / 400.0;
                    let v = a + (b - a) * Dd::of(x * x * (3.0 - 2.0 * x)).sqrt();
                    let exact = piece.other_at(1, v);
                    all += 1;
                    let Some([low, high]) = piece.bracket_at(1, v) else {
                        missing += 1;
                        continue;
                    };
                    assert!(
                        Dd::of(low) <= exact && exact <= Dd::of(high),
                        "{low} {high} for {exact:?} at {v:?}"
                    );
                    widest = widest.max(high - low);
                }
            }
            eprintln!(
                "{all} heights: widest bracket {widest:.1e}, {missing} left to double-double"
            );
            assert!(missing * 10 <= all && widest < 1e-6);
        }
    }
}
