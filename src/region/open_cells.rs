//! Cells of one height over which the distance is no single cubic.
//!
//! Such a cell has parts, from place to place in it and beside each other, of which the nearest counts: where a ridge
//! between smooth stretches of the boundary crosses the cell, the cubics of those; where features hand over, that of
//! each between its normals; where they bend too much for a cubic, the features themselves; else its leaf, which is
//! searched. Parts that hand over to each other are replaced by one cubic where none is missed by more than the
//! tolerance.

use super::chain::{Chain, Local};
use super::field::MeridianField;
use super::radial_feet::{Feet, Foot, MOST_JOINTS, Passage, Row, smooth_error};
use crate::math::Kernel;

/// The cells that are open.
#[derive(Debug, Clone, Default)]
pub(super) struct OpenCells {
    /// By the number of a cell; what is not open has anything.
    cells: Vec<OpenCell>,
    opened: Vec<u32>,
    parts: Vec<Part>,
    kernel: Kernel,
    height: f64,
    /// Scene units of a region unit.
    scale: f64,
}

/// What is known of one.
#[derive(Debug, Clone, Copy, Default)]
struct OpenCell {
    /// Its parts: the first, and how many.
    first: u32,
    count: u32,
    leaf: u32,
    /// Whether the leaf must be searched.
    searched: bool,
    /// The distance's in all of it; 0 where it is not known.
    sign: f64,
}

/// What answers from one place to another in its cell.
#[derive(Debug, Clone, Copy)]
struct Part {
    form: Form,
    places: [f64; 2],
}

/// How the distance to a feature is found.
#[derive(Debug, Clone, Copy)]
enum Form {
    Cubic([f64; 4]),
    Feature(u32),
    /// All of the cell's leaf.
    Leaf,
}

/// From the beginning of a cell to its end.
const WHOLE: [f64; 2] = [0.0, 1.0];
/// Cells from which on the surface, which is not in the next one, is not so near that a cubic might miss its side.
const CLEAR: f64 = 1.001;

impl OpenCells {
    /// Begins a height of `columns` cells.
    pub(super) fn start(&mut self, kernel: Kernel, columns: usize, height: f64, scale: f64) {
        self.cells.resize(columns, OpenCell::default());
        self.opened.clear();
        self.parts.clear();
        self.kernel = kernel;
        self.height = height;
        self.scale = scale;
    }

    /// Opens a cell of a leaf that is not smooth as a whole, in the leaves that it is divided into.
    pub(super) fn open_by_leaves(&mut self, row: &Row<'_>, cell: usize, leaf: u32) {
        let start = self.parts.len();
        let ends = [cell, cell + 1].map(|k| row.node(k)[0]);
        let place = |r: f64| (r - ends[0]) / row.field.cell();
        row.field
            .parts_at(row.z, leaf, ends, &mut |from, to, part| {
                // The last ends with the cell, however that was rounded.
                let end = if to == ends[1] { 1.0 } else { place(to) };
                let stretch = Stretch {
                    ends: [from, to].map(|r| [r, row.z]),
                    places: [place(from), end],
                };
                self.add_leaf(row, part, stretch);
            });
        self.open(cell, leaf, start);
    }

    /// Opens a cell between its runs that may be nearest, which have those feet at its ends; gives one cubic instead
    /// where that serves. Without any, the leaf is searched.
    pub(super) fn open_by_runs<'a>(
        &mut self,
        row: &Row<'_>,
        (cell, leaf): (usize, u32),
        mut runs: impl Iterator<Item = [&'a Foot; 2]>,
    ) -> Option<[f64; 4]> {
        let start = self.parts.len();
        if !runs.all(|feet| self.add_cubics(row, cell, feet)) {
            self.parts.truncate(start);
        }
        if let [
            Part {
                form: Form::Cubic(cubic),
                ..
            },
        ] = self.parts[start..]
        {
            // Features hand over within it, but not by much.
            self.parts.truncate(start);
            return Some(cubic);
        }
        self.open(cell, leaf, start);
        None
    }

    /// Opens a cell with the parts from `start` on, or where there are none its leaf.
    fn open(&mut self, cell: usize, leaf: u32, start: usize) {
        if self.parts.len() == start {
            self.add(Form::Leaf, WHOLE);
        }
        let [first, end] = [start, self.parts.len()].map(number);
        let parts = &self.parts[start..];
        self.opened.push(number(cell));
        self.cells[cell] = OpenCell {
            first,
            count: end - first,
            leaf,
            searched: parts.iter().any(|p| matches!(p.form, Form::Leaf)),
            sign: 0.0,
        };
    }

    fn add(&mut self, form: Form, places: [f64; 2]) {
        self.parts.push(Part { form, places });
    }

    /// Adds what may be nearest in a leaf: the features of its runs, else the leaf.
    fn add_leaf(&mut self, row: &Row<'_>, leaf: u32, stretch: Stretch) {
        let (start, chain) = (self.parts.len(), row.field.chain());
        let features = row.field.features(row.field.leaf(leaf));
        let feet = stretch.ends.map(|q| Feet::new(row.field, features, q));
        let least = feet.each_ref().map(|f| f.nearest().size());
        // No distance changes by more than the way.
        let [from, to] = stretch.ends;
        let reach = 2.0 * (to[0] - from[0] + chain.margin());
        let found = (0..features.len()).all(|i| {
            let [near, far] = feet.each_ref().map(|f| &f.list[i]);
            let behind = near.size() - least[0] + (far.size() - least[1]);
            behind > reach || self.add_run(chain, [near, far], stretch, Form::Feature)
        });
        if !found || self.parts.len() == start {
            self.parts.truncate(start);
            self.add(Form::Leaf, stretch.places);
        }
    }

    /// Adds what the distance to a run is made of in a cell: one cubic, or one part between each two normals at which
    /// features hand over. Whether all were found; some may be added where they were not.
    fn add_cubics(&mut self, row: &Row<'_>, cell: usize, feet: [&Foot; 2]) -> bool {
        let (chain, h) = (row.field.chain(), row.field.cell());
        let ends = [cell, cell + 1].map(|k| row.node(k));
        let (length, scale) = (h * self.scale, self.scale);
        let passage = Passage::new(row.field, feet, ends[1], h);
        if passage.is_some_and(|p| p.error(h) <= row.tolerance) {
            let one = cubic(feet.map(|f| &f.local), scale, length);
            self.add(Form::Cubic(one), WHOLE);
            return true;
        }
        let start = self.parts.len();
        let places = WHOLE;
        let mut worst = 0.0_f64;
        let found = self.add_run(chain, feet, Stretch { ends, places }, |feature| {
            let [a, b] = ends.map(|q| chain.local(feature, q));
            let error = smooth_error(h, a.bend.abs().max(b.bend.abs()));
            worst = worst.max(error);
            if error <= row.tolerance {
                Form::Cubic(cubic([&a, &b], scale, length))
            } else {
                Form::Feature(feature)
            }
        });
        if found && let Some(one) = joined(&self.parts[start..], (row.tolerance - worst) * scale) {
            self.parts.truncate(start);
            self.add(Form::Cubic(one), WHOLE);
        }
        found
    }

    /// Adds the features of a run, each up to the normal at which it hands over to the next. Whether all were found.
    fn add_run(
        &mut self,
        chain: &Chain,
        [near, far]: [&Foot; 2],
        stretch: Stretch,
        mut form: impl FnMut(u32) -> Form,
    ) -> bool {
        let [mut from, end] = stretch.places;
        let mut feature = near.feature;
        if feature != far.feature {
            let Some(features) = chain.between(feature, far.feature, MOST_JOINTS) else {
                return false;
            };
            for next in features {
                let Some([before, beyond]) = chain.past_joint([feature, next], stretch.ends) else {
                    return false;
                };
                let joint = stretch.place(before / (before - beyond));
                if !(from <= joint && joint <= end) {
                    return false;
                }
                self.add(form(feature), [from, joint]);
                (feature, from) = (next, joint);
            }
        }
        self.add(form(feature), [from, end]);
        true
    }

    /// Finds the signs in cells that the surface is not in; `inside` tells them by the radius, where it can. Gives those
    /// that a ridge between two cubics crosses to `each`: the cell's number, its sign, and both.
    pub(super) fn find_signs(
        &mut self,
        field: &MeridianField,
        inside: impl Fn(f64) -> Option<bool>,
        mut each: impl FnMut(usize, f64, [[f64; 4]; 2]),
    ) {
        let reach = (CLEAR * field.cell() + field.chain().margin()) * self.scale;
        for n in 0..self.opened.len() {
            let cell = self.opened[n] as usize;
            // No distance changes by more than the way.
            if self.size(field, cell, 0.0) <= reach {
                continue;
            }
            let Some(inside) = inside(radius(field, cell, 0.5)) else {
                continue;
            };
            let sign = if inside { -1.0 } else { 1.0 };
            self.cells[cell].sign = sign;
            if let [one, other] = self.parts(cell)
                && [one.places, other.places] == [WHOLE; 2]
                && let (Form::Cubic(one), Form::Cubic(other)) = (one.form, other.form)
            {
                each(cell, sign, [one, other]);
            }
        }
    }

    fn parts(&self, cell: usize) -> &[Part] {
        let OpenCell { first, count, .. } = self.cells[cell];
        &self.parts[first as usize..][..count as usize]
    }

    /// The signed distance in scene units at a place in a cell, from 0 to 1 in it, where it is to be had at little cost.
    #[inline]
    pub(super) fn signed(&self, field: &MeridianField, cell: usize, place: f64) -> Option<f64> {
        let open = &self.cells[cell];
        let quick = open.sign != 0.0 && !open.searched;
        quick.then(|| open.sign * self.size(field, cell, place))
    }

    /// The sign of the distance in all of a cell, where it is known.
    pub(super) fn sign(&self, cell: usize) -> Option<f64> {
        Some(self.cells[cell].sign).filter(|s| *s != 0.0)
    }

    /// The unsigned distance in scene units at a place in a cell.
    #[inline]
    pub(super) fn size(&self, field: &MeridianField, cell: usize, place: f64) -> f64 {
        let mut least = f64::INFINITY;
        for part in self.parts(cell) {
            let value = match part.form {
                Form::Cubic(c) => value(c, place),
                Form::Feature(_) | Form::Leaf => self.searched(field, cell, part, place),
            };
            // Without a branch that nobody can foresee.
            let counts = (part.places[0] <= place) & (place <= part.places[1]);
            least = least.min(if counts { value.abs() } else { f64::INFINITY });
        }
        least
    }

    /// The distance of a part that is no cubic; infinite where it does not answer.
    fn searched(&self, field: &MeridianField, cell: usize, part: &Part, place: f64) -> f64 {
        if !(part.places[0] <= place && place <= part.places[1]) {
            return f64::INFINITY;
        }
        let q = [radius(field, cell, place), self.height];
        let distance = match part.form {
            Form::Feature(feature) => field.chain().local(feature, q).value,
            Form::Cubic(_) | Form::Leaf => {
                field.distance(self.kernel, field.leaf(self.cells[cell].leaf), q)
            }
        };
        distance * self.scale
    }
}

/// A part of a row in one cell: its ends, and their places in the cell.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    ends: [[f64; 2]; 2],
    places: [f64; 2],
}

impl Stretch {
    /// The place at a part of the way.
    fn place(&self, part: f64) -> f64 {
        let [from, to] = self.places;
        from + part * (to - from)
    }
}

/// The radius of a place in a cell.
#[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
fn radius(field: &MeridianField, cell: usize, place: f64) -> f64 {
    ((field.columns().1 + cell as i64) as f64 + place) * field.cell()
}

/// The cubic over a stretch of `length` scene units, of which a unit has `scale`, from what its ends know.
#[inline]
pub(super) fn cubic([near, far]: [&Local; 2], scale: f64, length: f64) -> [f64; 4] {
    let (a, b) = (near.value * scale, far.value * scale);
    let (da, db) = (near.gradient[0] * length, far.gradient[0] * length);
    let rise = b - a;
    [a, da, 3.0 * rise - 2.0 * da - db, da + db - 2.0 * rise]
}

#[inline]
fn value([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    a + t * (b + t * (c + t * d))
}

/// One cubic for all parts of a cell, none of which it differs from by more than `tolerance`.
fn joined(parts: &[Part], tolerance: f64) -> Option<[f64; 4]> {
    let at = |t: f64| -> Option<f64> {
        let part = parts.iter().find(|p| t <= p.places[1])?;
        match part.form {
            Form::Cubic(c) => Some(value(c, t)),
            Form::Feature(_) | Form::Leaf => None,
        }
    };
    // Through the four places that leave a cubic the least error.
    let mut values = [0.0; 4];
    for (value, place) in values.iter_mut().zip(CHEBYSHEV) {
        *value = at(place)?;
    }
    let one = through(values);
    let near = |part: &Part| match part.form {
        Form::Cubic(c) => {
            let rest: [f64; 4] = std::array::from_fn(|n| one[n] - c[n]);
            bound(rest, part.places) <= tolerance
        }
        Form::Feature(_) | Form::Leaf => false,
    };
    parts.iter().all(near).then_some(one)
}

/// (1 - cos((2 i + 1) π / 8)) / 2
const CHEBYSHEV: [f64; 4] = [
    0.038_060_233_744_356_62,
    0.308_658_283_817_455_1,
    0.691_341_716_182_544_9,
    0.961_939_766_255_643_4,
];

/// The cubic through values at those places, by Newton's divided differences.
fn through(values: [f64; 4]) -> [f64; 4] {
    let x = CHEBYSHEV;
    let mut d = values;
    for order in 1..4 {
        for n in (order..4).rev() {
            d[n] = (d[n] - d[n - 1]) / (x[n] - x[n - order]);
        }
    }
    // As powers, from the last factor inwards.
    let mut c = [d[3], 0.0, 0.0, 0.0];
    for n in (0..3).rev() {
        c = [
            d[n] - x[n] * c[0],
            c[0] - x[n] * c[1],
            c[1] - x[n] * c[2],
            c[2] - x[n] * c[3],
        ];
    }
    c
}

/// A bound on the size of a cubic between two places: that of its Bernstein coefficients.
fn bound([a, b, c, d]: [f64; 4], [from, to]: [f64; 2]) -> f64 {
    let h = to - from;
    // About the first place, over the stretch.
    let p = [
        a + from * (b + from * (c + from * d)),
        h * (b + from * (2.0 * c + from * 3.0 * d)),
        h * h * (c + 3.0 * from * d),
        h * h * h * d,
    ];
    let bernstein = [
        p[0],
        p[0] + p[1] / 3.0,
        p[0] + (2.0 * p[1] + p[2]) / 3.0,
        p[0] + p[1] + p[2] + p[3],
    ];
    bernstein.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
}

fn number(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_go_through_their_values() {
        let c = [0.3, -1.7, 2.9, -4.1];
        let again = through(CHEBYSHEV.map(|t| value(c, t)));
        for (a, b) in c.iter().zip(again) {
            assert!((a - b).abs() < 1e-12, "{c:?} {again:?}");
        }
        for (i, t) in (0_u32..).zip(CHEBYSHEV) {
            let angle = f64::from(2 * i + 1) * std::f64::consts::PI / 8.0;
            assert!((t - 0.5 * (1.0 - angle.cos())).abs() < 1e-15);
        }
    }

    #[test]
    fn bounds_cover_cubics_from_place_to_place() {
        let mut number = crate::region::radial::tests::numbers(3);
        for _ in 0..1000 {
            let c: [f64; 4] = std::array::from_fn(|_| 2.0 * number() - 1.0);
            let (a, b) = (number(), number());
            let places = [a.min(b), a.max(b)];
            let most = (0..=100).map(|n| {
                let t = f64::from(n) / 100.0;
                value(c, places[0] + t * (places[1] - places[0])).abs()
            });
            let most = most.fold(0.0, f64::max);
            let found = bound(c, places);
            assert!(
                most <= found * (1.0 + 1e-12),
                "{c:?} {places:?}: {most} {found}"
            );
            assert!(
                found <= 20.0 * most + 1e-12,
                "{c:?} {places:?}: {most} {found}"
            );
        }
    }

    #[test]
    fn joined_parts_are_within_the_tolerance_or_stay() {
        // A jump of the second derivative by 2 j at s.
        let parts = |s: f64, j: f64| {
            let form = |j: f64| Form::Cubic([1.0 + j * s * s, 0.5 - 2.0 * j * s, j, 0.2]);
            let part = |form, places| Part { form, places };
            [part(form(0.0), [0.0, s]), part(form(j), [s, 1.0])]
        };
        let (mut good, mut bad) = (0, 0);
        for n in 1..20 {
            let s = f64::from(n) / 20.0;
            for j in [1e-4, 1e-3, 3e-3, 1e-2, 0.1] {
                let parts = parts(s, j);
                let Some(one) = joined(&parts, 2e-5) else {
                    bad += 1;
                    continue;
                };
                good += 1;
                for k in 0..=1000 {
                    let t = f64::from(k) / 1000.0;
                    let Form::Cubic(c) = parts[usize::from(t > s)].form else {
                        panic!("cubics");
                    };
                    assert!((value(one, t) - value(c, t)).abs() <= 2e-5, "{s} {j} {t}");
                }
            }
        }
        // The bound for the cubic of values and slopes, 1/60 for a jump of 1, would leave the 19 of the least jump.
        assert!(good > 25 && bad > 40, "{good} {bad}");
    }
}
