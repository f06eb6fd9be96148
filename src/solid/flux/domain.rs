//! A cell as the integrand of a surface integral.
//!
//! The cell is the box |x|, |y|, |z| <= ½ and half-spaces. The line through a point along -x leaves of it the length
//!
//! ```text
//!   L = max(0, min_ij (T_i - F_j)),     T_i in {x, ½, tops},  F_j in {-½, floors}
//! ```
//!
//! where (y, z) is within the sides: planes that hold the direction x. Tops and floors are the other planes as
//! functions of y and z. L is continuous and linear in pieces but for the jumps at the sides.

use super::net::Net;
use crate::math::tetrahedra::HalfSpace;
use smallvec::SmallVec;

/// a x + b y + c z + d.
pub(super) type Form = [f64; 4];

/// Slope of a plane against x, as a share of its normal, below which it counts as a side.
const SIDE: f64 = 1e-13;

/// What bounds a cell, seen along x.
#[derive(Debug, Clone)]
pub(super) struct Domain {
    /// At most 0 within.
    sides: SmallVec<[Form; 8]>,
    tops: SmallVec<[Form; 8]>,
    floors: SmallVec<[Form; 8]>,
}

/// What L is on a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// 0, but for the places that roundings may decide.
    Nothing,
    Whole(Form),
    /// Functions change sign.
    Open,
}

/// L on a patch.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) kind: Kind,
    /// A bound of L.
    pub(super) most: f64,
    /// The linear function nearest to L where no side cuts the patch, and how far it is off at most.
    pub(super) nearest: Option<(Form, f64)>,
    /// Functions that change sign, one for each place of zeros: between them L is linear.
    pub(super) open: SmallVec<[Form; 8]>,
    /// Sides that cut the patch.
    sides: SmallVec<[Form; 8]>,
    /// What may be the lowest top and the highest floor.
    tops: Forms,
    floors: Forms,
    /// How far L or the place of a side may be misjudged; 0 where nothing was near.
    pub(super) slack: f64,
}

type Forms = SmallVec<[Form; 4]>;

impl Look {
    /// Leaves one of functions that have their zeros in common, as where a flat patch passes through an edge of the
    /// cell: they could not be told apart however small the patch.
    fn join(&mut self, hull: &Hull, slack: f64) {
        let mut left: SmallVec<[Form; 8]> = SmallVec::new();
        for form in &self.open {
            match left
                .iter()
                .find_map(|kept| in_common(kept, form, hull, slack))
            {
                Some(room) => self.slack = self.slack.max(room),
                None => left.push(*form),
            }
        }
        self.open = left;
    }

    /// L about a point of the patch, where no function is 0; `None` where it is 0.
    pub(super) fn form_at(&self, p: &[f64; 3]) -> Option<Form> {
        if self.sides.iter().any(|s| value(s, p) > 0.0) {
            return None;
        }
        let of = |form: &&Form| value(form, p);
        let top = self.tops.iter().min_by(|a, b| of(a).total_cmp(&of(b)))?;
        let floor = self.floors.iter().max_by(|a, b| of(a).total_cmp(&of(b)))?;
        let form = minus(top, floor);
        (value(&form, p) > 0.0).then_some(form)
    }
}

/// Cartesian control points.
pub(super) type Hull = SmallVec<[[f64; 3]; 16]>;

/// The range of a form over the control points, which holds that over the patch.
pub(super) fn range(form: &Form, hull: &Hull) -> [f64; 2] {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for p in hull {
        let value = value(form, p);
        range = [range[0].min(value), range[1].max(value)];
    }
    range
}

pub(super) fn value(form: &Form, p: &[f64; 3]) -> f64 {
    form[0] * p[0] + form[1] * p[1] + form[2] * p[2] + form[3]
}

/// Whether one form is a multiple of another on a patch, but for the rounding that is returned.
fn in_common(kept: &Form, form: &Form, hull: &Hull, slack: f64) -> Option<f64> {
    let largest =
        |a: &&[f64; 3], b: &&[f64; 3]| value(kept, a).abs().total_cmp(&value(kept, b).abs());
    let at = hull.iter().max_by(largest)?;
    let times = value(form, at) / value(kept, at);
    let room = rounding(form, slack) + times.abs() * rounding(kept, slack);
    let alike = |p: &[f64; 3]| (value(form, p) - times * value(kept, p)).abs() <= room;
    (times.is_finite() && hull.iter().all(alike)).then_some(room)
}

/// Adds a plane that is not there yet.
fn add(forms: &mut SmallVec<[Form; 8]>, form: Form) {
    let size = form.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let same = |other: &Form| (0..4).all(|k| (other[k] - form[k]).abs() <= 1e-15 * size);
    if !forms.iter().any(same) {
        forms.push(form);
    }
}

fn minus(a: &Form, b: &Form) -> Form {
    std::array::from_fn(|k| a[k] - b[k])
}

/// Rounding of a form's value where coordinates are off by `slack`.
fn rounding(form: &Form, slack: f64) -> f64 {
    slack * (form[0].abs() + form[1].abs() + form[2].abs()) + 4.0 * f64::EPSILON * form[3].abs()
}

impl Domain {
    /// The cell within half-spaces, given in its coordinates.
    pub(super) fn new(spaces: &[HalfSpace]) -> Self {
        let mut domain = Self {
            sides: SmallVec::new(),
            tops: SmallVec::from_slice(&[[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.5]]),
            floors: SmallVec::from_slice(&[[0.0, 0.0, 0.0, -0.5]]),
        };
        for k in [1, 2] {
            for sign in [1.0, -1.0] {
                let mut form = [0.0, 0.0, 0.0, -0.5];
                form[k] = sign;
                domain.sides.push(form);
            }
        }
        for space in spaces {
            let n = space.normal;
            let length = n.length();
            if n.x.abs() <= SIDE * length {
                let unit = if length > 0.0 { 1.0 / length } else { 1.0 };
                let form = [0.0, n.y, n.z, -space.offset];
                add(&mut domain.sides, form.map(|c| c * unit));
                continue;
            }
            let form = [0.0, -n.y / n.x, -n.z / n.x, space.offset / n.x];
            if n.x > 0.0 {
                add(&mut domain.tops, form);
            } else {
                add(&mut domain.floors, form);
            }
        }
        domain
    }

    /// The steepest of the tops and floors: how badly this direction suits the half-spaces.
    pub(super) fn steepness(&self) -> f64 {
        let forms = self.tops.iter().chain(&self.floors);
        forms.fold(0.0, |m, f| f[1].abs().max(f[2].abs()).max(m))
    }

    /// What L is on a patch with these control points.
    pub(super) fn look(&self, hull: &Hull, slack: f64) -> Look {
        let mut look = Look {
            kind: Kind::Nothing,
            most: 0.0,
            nearest: None,
            open: SmallVec::new(),
            sides: SmallVec::new(),
            tops: Forms::new(),
            floors: Forms::new(),
            slack: 0.0,
        };
        for side in &self.sides {
            let [low, high] = range(side, hull);
            let room = rounding(side, slack);
            if low >= -room {
                if low <= room {
                    look.slack = room;
                }
                return look;
            }
            if high > room {
                look.sides.push(*side);
            } else if high > -room {
                look.slack = look.slack.max(room);
            }
        }
        look.open.clone_from(&look.sides);
        let tops = lowest(&self.tops, hull, slack, 1.0, &mut look.slack);
        let floors = lowest(&self.floors, hull, slack, -1.0, &mut look.slack);
        // A length is at most 1, and at most each difference.
        look.most = 1.0;
        for top in &tops {
            for floor in &floors {
                let form = minus(top, floor);
                let [low, high] = range(&form, hull);
                let room = rounding(&form, slack);
                if high <= room {
                    look.slack = look.slack.max(room);
                    look.most = 0.0;
                    return look;
                }
                look.most = look.most.min(high);
                if low < -room {
                    look.open.push(form);
                } else if low < room {
                    look.slack = look.slack.max(room);
                }
            }
        }
        for list in [&tops, &floors] {
            for (i, a) in list.iter().enumerate() {
                look.open.extend(list[..i].iter().map(|b| minus(a, b)));
            }
        }
        if look.sides.is_empty() && !look.open.is_empty() {
            look.nearest = nearest(&tops, &floors, hull);
        }
        look.join(hull, slack);
        look.kind = if look.open.is_empty() {
            Kind::Whole(minus(&tops[0], &floors[0]))
        } else {
            Kind::Open
        };
        (look.tops, look.floors) = (tops, floors);
        look
    }
}

/// The forms, times `sign`, that may be the lowest somewhere on a patch.
fn lowest(forms: &[Form], hull: &Hull, slack: f64, sign: f64, misjudged: &mut f64) -> Forms {
    let mut left = Forms::new();
    for form in forms {
        let above = |other: &Form, by: &Form| {
            let d = minus(other, by).map(|c| c * sign);
            let [low, _] = range(&d, hull);
            let room = rounding(&d, slack);
            (low >= -room).then_some(if low <= room { room } else { 0.0 })
        };
        if let Some(room) = left.iter().find_map(|other| above(form, other)) {
            *misjudged = misjudged.max(room);
            continue;
        }
        left.retain(|other| match above(other, form) {
            Some(room) => {
                *misjudged = misjudged.max(room);
                false
            }
            None => true,
        });
        left.push(*form);
    }
    left
}

/// Of the lengths, and 0, that from which L deviates least.
fn nearest(tops: &[Form], floors: &[Form], hull: &Hull) -> Option<(Form, f64)> {
    let mut all: SmallVec<[Form; 8]> = SmallVec::new();
    for top in tops {
        all.extend(floors.iter().map(|floor| minus(top, floor)));
    }
    let above = |a: &Form, b: &Form| range(&minus(a, b), hull)[1].max(0.0);
    let zero = [0.0; 4];
    let off = all.iter().map(|form| {
        // Of L = max(0, min of all): below the form by what the others are, above it where that is negative.
        let below = all
            .iter()
            .fold(0.0, |m: f64, other| m.max(above(form, other)));
        (*form, below.max(above(&zero, form)))
    });
    off.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Cartesian control points of a patch.
pub(super) fn hull(net: &Net) -> Hull {
    let points = net.points.iter();
    points
        .map(|h| {
            let w = 1.0 / h[3];
            [h[0] * w, h[1] * w, h[2] * w]
        })
        .collect()
}
