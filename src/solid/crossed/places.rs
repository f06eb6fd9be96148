//! Where, as a row moves through a voxel, its crossings with one body begin, end, or pass the voxel's sides.
//!
//! A row along `i` moves along `j`, at a fixed place along the third direction. Of quadrics and planes, and of any piece
//! whose axis is along one of the directions, these places are roots of closed form: pieces of a profile rise or fall all
//! along, so each takes a radius and a height once.

use super::sheet::{Affine, Aligned, Bend, Form, Quadric, Sheet, Surface, zeros};
use glam::DVec3;
use smallvec::SmallVec;

/// Places, each with whether lengths go there as a square root.
pub(super) type Places = SmallVec<[(f64, bool); 32]>;

/// Rows along `along` that move along `moving`; the point fixes the third direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Family {
    pub(super) along: usize,
    pub(super) moving: usize,
    pub(super) through: [f64; 3],
}

impl Family {
    pub(super) fn fixed(&self) -> usize {
        3 - self.along - self.moving
    }
}

/// The voxel's sides.
const SIDES: [f64; 2] = [-0.5, 0.5];

/// Adds the places of one surface.
pub(super) fn of_surface(
    surface: &Surface,
    aligned: Option<&Aligned>,
    family: Family,
    out: &mut Places,
) {
    match &surface.sheet {
        Sheet::Cone { quadric, .. } | Sheet::Sphere { quadric, .. } | Sheet::Ball { quadric } => {
            of_quadric(quadric, family, out);
        }
        Sheet::Plane { form, .. } => of_plane(form, family, out),
        Sheet::Bent(bend) => {
            if let Some(frame) = aligned {
                of_bend(bend, frame, family, out);
            }
        }
    }
}

fn of_quadric(q: &Quadric, family: Family, out: &mut Places) {
    let (i, j, k) = (family.along, family.moving, family.fixed());
    let p = family.through[k];
    let s = &q.squares;
    let (a, h, b) = (s[i][i], s[i][j], s[j][j]);
    let (g, f) = (s[i][k] * p + q.linear[i], s[j][k] * p + q.linear[j]);
    let c = (s[k][k] * p + 2.0 * q.linear[k]) * p + q.constant;
    for (place, _) in zeros([h * h - a * b, h * g - a * f, g * g - a * c]) {
        out.push((place, true));
    }
    for side in SIDES {
        for (place, _) in zeros([b, h * side + f, (a * side + 2.0 * g) * side + c]) {
            out.push((place, false));
        }
    }
}

fn of_plane(form: &Form, family: Family, out: &mut Places) {
    let (i, j) = (family.along, family.moving);
    let mut p = family.through;
    p[j] = 0.0;
    for side in SIDES {
        p[i] = side;
        out.push((-form.at(p) / form.slope[j], false));
    }
}

fn of_bend(bend: &Bend, frame: &Aligned, family: Family, out: &mut Places) {
    let (i, j, k) = (family.along, family.moving, family.fixed());
    let fixed = family.through[k];
    if frame.axis == k {
        let Some(r) = bend.at(1, frame.height(fixed)) else {
            return;
        };
        for x in [-r, r] {
            out.push((frame.across_from(j, x), true));
        }
        for side in SIDES {
            let u = frame.across(i, side);
            at_both(frame, j, (r - u) * (r + u), false, out);
        }
    } else if frame.axis == j {
        let q = frame.across(k, fixed);
        if let Some(z) = bend.at(0, q.abs()) {
            out.push((frame.height_from(z), true));
        }
        for side in SIDES {
            if let Some(z) = bend.at(0, q.hypot(frame.across(i, side))) {
                out.push((frame.height_from(z), false));
            }
        }
        for [_, z] in bend.ends {
            out.push((frame.height_from(z), true));
        }
    } else {
        let q = frame.across(k, fixed);
        for [r, _] in bend.ends {
            at_both(frame, j, (r - q) * (r + q), true, out);
        }
        for side in SIDES {
            if let Some(r) = bend.at(1, frame.height(side)) {
                at_both(frame, j, (r - q) * (r + q), false, out);
            }
        }
        out.push((frame.across_from(j, 0.0), false));
    }
}

fn at_both(frame: &Aligned, j: usize, square: f64, graded: bool, out: &mut Places) {
    if square >= 0.0 {
        let x = square.sqrt();
        out.push((frame.across_from(j, -x), graded));
        out.push((frame.across_from(j, x), graded));
    }
}

/// Adds the places at which rows pass a circle about the axis.
pub(super) fn of_rim(
    affine: &Affine,
    ([r, z], bent): ([f64; 2], bool),
    family: Family,
    out: &mut Places,
) {
    let (i, j, k) = (family.along, family.moving, family.fixed());
    let height = affine.form(2);
    let (hi, hj) = (height.slope[i], height.slope[j]);
    let mut base = [0.0; 3];
    base[k] = family.through[k];
    let missing = z - height.at(base);
    let size = affine.m[i].length().max(affine.m[j].length());
    if hi.abs().max(hj.abs()) <= 1e-14 * size {
        return;
    }
    // The line in which the circle's plane meets that of the rows: a point and a direction.
    let (first, second) = if hj.abs() >= hi.abs() { (j, i) } else { (i, j) };
    let (hf, hs) = (height.slope[first], height.slope[second]);
    base[first] = missing / hf;
    let at = |s: f64| {
        let mut p = base;
        p[first] -= s * hs / hf;
        p[second] = s;
        p
    };
    let start = affine.at(at(0.0));
    let way: DVec3 = affine.at(at(1.0)) - start;
    let square = |x: f64, y: f64| x * x + y * y;
    let coefficients = [
        square(way.x, way.y),
        way.x * start.x + way.y * start.y,
        square(start.x, start.y) - r * r,
    ];
    if hs == 0.0 && first == j {
        out.push((base[j], bent));
        return;
    }
    for (s, _) in zeros(coefficients) {
        out.push((at(s)[j], bent));
    }
}

/// Adds how far along `k` a circle about the axis reaches.
pub(super) fn reach_of_rim(
    affine: &Affine,
    ([r, z], bent): ([f64; 2], bool),
    k: usize,
    out: &mut Places,
) {
    let m = affine.m[k];
    let middle = affine.place(k, DVec3::new(0.0, 0.0, z));
    let half = r * m.x.hypot(m.y) / m.length_squared();
    let graded = bent || m.x.hypot(m.y) > 1e-14 * m.length();
    out.push((middle - half, graded));
    out.push((middle + half, graded));
}

/// Adds how far along `k` what a circle sweeps about a slanted axis reaches. Of other pieces that is not known.
pub(super) fn reach_of_bend(affine: &Affine, bend: &Bend, k: usize, out: &mut Places) {
    let Some(([r, z], radius)) = bend.circle() else {
        return;
    };
    let m = affine.m[k];
    let middle = affine.place(k, DVec3::new(0.0, 0.0, z));
    let (out_of, reach) = (r * m.x.hypot(m.y) / m.length_squared(), radius / m.length());
    for sign in [-1.0, 1.0] {
        out.push((middle + sign * out_of - reach, true));
        out.push((middle + sign * out_of + reach, true));
    }
}
