//! The signed distance along one height, as cubics in r.
//!
//! A stretch of cells of a [`MeridianField`]'s lattice gets the cubic that has the distance and its slope at both ends,
//! each cell its part of it. Where one feature answers for the whole stretch, of length h, the error of that is
//!
//! ```text
//!   |error| <= h⁴ / 384 · max |d⁗|,    |d⁗| <= 3 b³    b the bend, 1 / distance from the centre of curvature
//! ```
//!
//! and where features hand over within it, each jump J of the second derivative adds at most `h² J / 60` and each
//! jump K of the third at most `h³ K / 192` (the Peano kernel of cubic Hermite interpolation, a clamped beam, and
//! its slope). Stretches that may err by more than the tolerance are halved. Single cells that may, and those where
//! the distance is not smooth, have NaN as their first coefficient and are [`mended`](RadialTable::mended) voxel by
//! voxel: where a ridge between smooth stretches of the boundary crosses the cell, from the cubics of those; where
//! features hand over, from that of each between its normals; where they bend too much for a cubic, from the features
//! themselves. In cells that no surface can be in, the sign is known.
//!
//! Source of d⁗: `d = ρ - R` with ρ the distance from the centre, differentiated along a line: `d″ = b τ²`,
//! `d‴ = -3 b² g τ²` with b = 1 / ρ, g the slope and τ² = 1 - g², and `b′ = -b² g`, `|b″| <= 2 |b|³`.

use super::chain::{Chain, Local};
use super::field::MeridianField;
use super::field_nodes::MOST_RUNS;
use crate::math::Kernel;
use std::ops::{Deref, DerefMut};

/// Cells whose coefficients lie together.
pub(crate) const GROUP: usize = 16;

/// The coefficients of 16 cells: those of 1, t, t² and t³ over each cell, t from 0 to 1, and last what the first of
/// them lost in rounding. Each kind is a line of memory.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(crate) struct Group([[f32; GROUP]; 5]);

impl Deref for Group {
    type Target = [[f32; GROUP]; 5];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Group {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// Cubics over the cells of one height.
#[derive(Debug, Clone, Default)]
pub(crate) struct RadialTable {
    groups: Vec<Group>,
    /// The second cubics of cells with a ridge; [`UNUSED`] elsewhere.
    seconds: Vec<Group>,
    /// A bit for each cell of a group that has one.
    ridged: Vec<u16>,
    /// Whether what the first coefficients lost is kept, as some distances are large.
    precise: bool,
    leaves: Vec<u32>,
    /// What is known of the cells without one cubic, and which those are.
    open: Vec<OpenCell>,
    opened: Vec<u32>,
    /// What may be nearest in them.
    parts: Vec<Part>,
    kernel: Kernel,
    /// Values to which the rounding of the first coefficients does not count.
    small: f32,
    height: f64,
    scale: f64,
}

/// Cubics in groups: the value is that of the first or of the second, whichever is nearer to 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cubics<'a> {
    pub(crate) groups: &'a [Group],
    pub(crate) seconds: &'a [Group],
    /// A bit for each cell of a group that has a second one; the others' are [`UNUSED`].
    pub(crate) ridged: &'a [u16],
    /// Whether the last coefficients count.
    pub(crate) precise: bool,
}

/// A cell without one cubic.
#[derive(Debug, Clone, Copy, Default)]
struct OpenCell {
    /// Its part of `parts`: the first, and how many.
    first: u32,
    count: u32,
    /// That of the distance in all of it; 0 where it is not known.
    sign: f64,
    /// Whether a list of features must be searched in it.
    searched: bool,
}

/// What answers from `from` to `to` over its cell.
#[derive(Debug, Clone, Copy)]
struct Part {
    form: Form,
    from: f64,
    to: f64,
}

/// How the distance to a feature is found.
#[derive(Debug, Clone, Copy)]
enum Form {
    Cubic([f64; 4]),
    Feature(u32),
    /// All of the cell's leaf.
    Leaf,
}

/// Groups read beyond the last cell's by lanes that do not use them.
const PADDING: usize = 2;
/// Tolerances to which a distance is so small that the rounding of the first coefficient does not count: less than a
/// fifth of a tolerance.
const SMALL: f64 = 4_194_304.0;
/// Value of the columns that are left out: further away than anything, and its square has a root by
/// [`crate::math::root`].
pub(crate) const UNUSED: f32 = 1e17;
const NO_SECOND: Group = Group([
    [UNUSED; GROUP],
    [0.0; GROUP],
    [0.0; GROUP],
    [0.0; GROUP],
    [0.0; GROUP],
]);
/// Features that may follow each other within one cell.
const MOST_JOINTS: usize = 4;
/// Difference of two bends, as a share of them, below which the features that touch are parts of one circle.
const SAME_BEND: f64 = 1e-9;
/// The most cells that one cubic serves.
const WIDEST: usize = 16;
/// Largest bend times length for which the bounds' variation over the cell is accounted.
const BENT: f64 = 0.25;

impl RadialTable {
    /// Tabulates height `z` of a field whose unit is `scale` scene units, within `tolerance` region units.
    pub(crate) fn fill(
        &mut self,
        kernel: Kernel,
        field: &MeridianField,
        z: f64,
        scale: f64,
        tolerance: f64,
    ) {
        self.fill_from(0, kernel, field, z, scale, tolerance);
    }

    /// The same, but for the columns before `start`: they hold [`UNUSED`].
    pub(crate) fn fill_from(
        &mut self,
        start: usize,
        kernel: Kernel,
        field: &MeridianField,
        z: f64,
        scale: f64,
        tolerance: f64,
    ) {
        let (columns, first) = field.columns();
        let groups = columns / GROUP + PADDING;
        // What is left of the last height is overwritten, or not read where a cell has no cubic.
        self.groups.resize(groups, Group::default());
        self.groups[columns / GROUP..].fill(Group::default());
        (0..start).for_each(|k| self.settle(k, UNUSED));
        for (group, ridged) in self.seconds.iter_mut().zip(&mut self.ridged) {
            if *ridged != 0 {
                *group = NO_SECOND;
            }
            *ridged = 0;
        }
        self.seconds.resize(groups, NO_SECOND);
        self.ridged.resize(groups, 0);
        self.leaves.resize(columns, 0);
        self.open.resize(columns, OpenCell::default());
        self.opened.clear();
        self.parts.clear();
        self.kernel = kernel;
        self.height = z;
        self.scale = scale;
        let row = Row {
            field,
            z,
            tolerance,
            first,
        };
        field.leaves_at(z, &mut |from, to, number| {
            let from = from.max(start);
            if from >= to {
                return;
            }
            self.leaves[from..to].fill(number);
            let features = field.features(field.leaf(number));
            if features.is_empty() {
                (from..to).for_each(|k| self.open_by_leaves(&row, k));
                return;
            }
            let mut near = Feet::new(field, features, row.node(from));
            let mut start = from;
            while start < to {
                let end = to.min(start + row.cells_for(near.nearest()));
                let far = row.feet(&near, end);
                self.span(&row, [start, end], &near, &far);
                (start, near) = (end, far);
            }
        });
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let small = (SMALL * tolerance * scale) as f32;
        self.small = small;
        let large = |v: &f32| v.abs() > small && *v != UNUSED;
        self.precise = self.groups.iter().any(|g| g[0].iter().any(large));
        if !self.precise {
            for group in &mut self.groups {
                group[4] = [0.0; GROUP];
            }
        }
    }

    /// The coefficients in groups, with some beyond the last cell's.
    pub(crate) fn cubics(&self) -> Cubics<'_> {
        Cubics {
            groups: &self.groups,
            seconds: &self.seconds,
            ridged: &self.ridged,
            precise: self.precise,
        }
    }

    /// The value where a cell begins, not a number where it has no cubic.
    pub(crate) fn at_start_of(&self, cell: usize) -> f32 {
        self.groups[cell / GROUP][0][cell % GROUP]
    }

    /// Whether a cell has no cubic.
    pub(crate) fn is_open(&self, cell: usize) -> bool {
        self.at_start_of(cell).is_nan()
    }

    /// Gives a cell one value all over.
    pub(crate) fn settle(&mut self, cell: usize, value: f32) {
        for (n, row) in self.groups[cell / GROUP].iter_mut().enumerate() {
            row[cell % GROUP] = if n == 0 { value } else { 0.0 };
        }
    }

    /// Leaves a cell to the parts from `start` on, or where there are none to its leaf.
    fn leave_open(&mut self, cell: usize, start: usize) {
        if self.parts.len() == start {
            self.parts.push(Part {
                form: Form::Leaf,
                from: 0.0,
                to: 1.0,
            });
        }
        let [first, end] = [start, self.parts.len()].map(number);
        self.groups[cell / GROUP][0][cell % GROUP] = f32::NAN;
        self.opened.push(number(cell));
        let parts = self.parts[start..].iter();
        self.open[cell] = OpenCell {
            first,
            count: end - first,
            sign: 0.0,
            searched: { parts }.any(|p| matches!(p.form, Form::Leaf)),
        };
    }

    /// Leaves a cell to the leaves that it is divided into.
    fn open_by_leaves(&mut self, row: &Row<'_>, cell: usize) {
        let start = self.parts.len();
        let ends = [cell, cell + 1].map(|k| row.node(k)[0]);
        let place = |r: f64| (r - ends[0]) / row.field.cell();
        let leaf = self.leaves[cell];
        row.field
            .parts_at(row.z, leaf, ends, &mut |from, to, leaf| {
                // The last ends with the cell, however that was rounded.
                let end = if to == ends[1] { 1.0 } else { place(to) };
                let stretch = Stretch {
                    ends: [from, to].map(|r| [r, row.z]),
                    places: [place(from), end],
                };
                self.add_leaf(row, leaf, stretch);
            });
        self.leave_open(cell, start);
    }

    /// Adds what may be nearest in a leaf: the features of its runs, else the leaf.
    fn add_leaf(&mut self, row: &Row<'_>, number: u32, stretch: Stretch) {
        let (start, chain) = (self.parts.len(), row.field.chain());
        let features = row.field.features(row.field.leaf(number));
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
            let [from, to] = stretch.places;
            let form = Form::Leaf;
            self.parts.push(Part { form, from, to });
        }
    }

    /// Tabulates cells of one leaf from what its runs know at both ends: by one cubic where that is within the
    /// tolerance, else half by half.
    fn span(&mut self, row: &Row<'_>, [from, to]: [usize; 2], near: &Feet, far: &Feet) {
        let count = to - from;
        let rivals = row.rivals([near, far], [from, to]);
        let ends = |i: usize| [&near.list[i].local, &far.list[i].local];
        if let Some(Rivals {
            first,
            others: 0,
            good: true,
        }) = rivals
        {
            self.put(row.field, [from, to], ends(first));
        } else if count > 1 {
            let middle = from + count / 2;
            let feet = row.feet(near, middle);
            self.span(row, [from, middle], near, &feet);
            self.span(row, [middle, to], &feet, far);
        } else {
            let start = self.parts.len();
            if let Some(rivals) = rivals {
                // The distance is the least of theirs, and each is within the tolerance.
                let mut runs = (0..near.count).filter(|i| rivals.has(*i));
                if !runs.all(|i| self.add_parts(row, from, [&near.list[i], &far.list[i]])) {
                    self.parts.truncate(start);
                }
            }
            if let [
                Part {
                    form: Form::Cubic(cubic),
                    from: 0.0,
                    to: 1.0,
                },
            ] = self.parts[start..]
            {
                // Features hand over within it, but not by much.
                self.parts.truncate(start);
                store(&mut self.groups[from / GROUP], from % GROUP, cubic);
            } else {
                self.leave_open(from, start);
            }
        }
    }

    /// Adds what the distance to a run is made of in a cell: one cubic, or one part between each two normals at which
    /// features hand over. Whether all were found; some may be added where they were not.
    fn add_parts(&mut self, row: &Row<'_>, cell: usize, feet: [&Foot; 2]) -> bool {
        let (chain, h) = (row.field.chain(), row.field.cell());
        let ends = [cell, cell + 1].map(|k| row.node(k));
        let (length, scale) = (h * self.scale, self.scale);
        let places = [0.0, 1.0];
        let passage = Passage::new(row.field, feet, ends[1], h);
        if passage.is_some_and(|p| p.error(h) <= row.tolerance) {
            let [near, far] = feet.map(|f| &f.local);
            let form = Form::Cubic(cubic([near, far], scale, length));
            let [from, to] = places;
            self.parts.push(Part { form, from, to });
            return true;
        }
        let start = self.parts.len();
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
            let [from, to] = places;
            let form = Form::Cubic(one);
            self.parts.push(Part { form, from, to });
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
        let Some(features) = chain.between(near.feature, far.feature, MOST_JOINTS) else {
            return false;
        };
        let [mut from, end] = stretch.places;
        let mut feature = near.feature;
        for next in features.filter(|_| near.feature != far.feature) {
            let Some([before, beyond]) = chain.past_joint([feature, next], stretch.ends) else {
                return false;
            };
            let joint = stretch.place(before / (before - beyond));
            if !(from <= joint && joint <= end) {
                return false;
            }
            let form = form(feature);
            self.parts.push(Part {
                form,
                from,
                to: joint,
            });
            (feature, from) = (next, joint);
        }
        let form = form(feature);
        self.parts.push(Part {
            form,
            from,
            to: end,
        });
        true
    }

    /// Gives cells their parts of one cubic.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "coefficients are f32: the stored voxels are; counts are small"
    )]
    fn put(&mut self, field: &MeridianField, [from, to]: [usize; 2], ends: [&Local; 2]) {
        let count = (to - from) as f64;
        let [a, b, c, d] = cubic(ends, self.scale, count * field.cell() * self.scale);
        let part = 1.0 / count;
        for k in from..to {
            let t = (k - from) as f64 * part;
            let value = a + t * (b + t * (c + t * d));
            let coefficients = [
                value,
                part * (b + t * (2.0 * c + 3.0 * t * d)),
                part * part * (c + 3.0 * t * d),
                part * part * part * d,
            ];
            store(&mut self.groups[k / GROUP], k % GROUP, coefficients);
        }
    }

    /// Finds the signs in cells that the surface is not in; `inside` tells them by the radius.
    pub(crate) fn find_signs(&mut self, field: &MeridianField, inside: impl Fn(f64) -> bool) {
        let reach = (field.cell() + field.chain().margin()) * self.scale;
        for n in 0..self.opened.len() {
            let cell = self.opened[n] as usize;
            // No distance changes by more than the way.
            if self.size(field, cell, 0.0) > reach {
                let r = self.radius(field, cell, 0.5);
                let sign = if inside(r) { -1.0 } else { 1.0 };
                self.open[cell].sign = sign;
                self.close_ridge(cell, sign);
            }
        }
    }

    /// Gives a cell with a ridge between two cubics both of them, with that sign.
    fn close_ridge(&mut self, cell: usize, sign: f64) {
        let OpenCell { first, count, .. } = self.open[cell];
        let [one, other] = &self.parts[first as usize..][..count as usize] else {
            return;
        };
        if [one, other].iter().any(|p| [p.from, p.to] != [0.0, 1.0]) {
            return;
        }
        let (Form::Cubic(one), Form::Cubic(other)) = (one.form, other.form) else {
            return;
        };
        // Neither is 0 in the cell.
        let signed = |c: [f64; 4]| c.map(|v| v * sign * c[0].signum());
        let (group, lane) = (cell / GROUP, cell % GROUP);
        self.precise |= one[0].abs().max(other[0].abs()) > f64::from(self.small);
        for (groups, cubic) in [(&mut self.groups, one), (&mut self.seconds, other)] {
            let group = &mut groups[group];
            store(group, lane, signed(cubic));
            if !self.precise {
                group[4][lane] = 0.0;
            }
        }
        self.ridged[group] |= 1 << lane;
    }

    /// The signed distance in scene units at a place in a cell without a cubic, from 0 to 1 in it, where it is to be had
    /// at little cost.
    #[inline]
    pub(crate) fn signed(&self, field: &MeridianField, cell: usize, place: f64) -> Option<f64> {
        let open = &self.open[cell];
        let quick = open.sign != 0.0 && !open.searched;
        quick.then(|| open.sign * self.size(field, cell, place))
    }

    /// The sign of the distance in all of a cell without a cubic, where it is known.
    pub(crate) fn sign(&self, cell: usize) -> Option<f64> {
        Some(self.open[cell].sign).filter(|s| *s != 0.0)
    }

    /// The unsigned distance in scene units at a place in a cell without a cubic.
    #[inline]
    pub(crate) fn size(&self, field: &MeridianField, cell: usize, place: f64) -> f64 {
        let OpenCell { first, count, .. } = self.open[cell];
        let mut least = f64::INFINITY;
        for part in &self.parts[first as usize..][..count as usize] {
            let value = match part.form {
                Form::Cubic([a, b, c, d]) => a + place * (b + place * (c + place * d)),
                _ => self.searched(field, cell, part, place),
            };
            // Without a branch that nobody can foresee.
            let counts = (part.from <= place) & (place <= part.to);
            least = least.min(if counts { value.abs() } else { f64::INFINITY });
        }
        least
    }

    /// The distance of a part that is no cubic.
    fn searched(&self, field: &MeridianField, cell: usize, part: &Part, place: f64) -> f64 {
        if !(part.from <= place && place <= part.to) {
            return f64::INFINITY;
        }
        let q = [self.radius(field, cell, place), self.height];
        let distance = match part.form {
            Form::Feature(feature) => field.chain().local(feature, q).value,
            _ => field.distance(self.kernel, field.leaf(self.leaves[cell]), q),
        };
        distance * self.scale
    }

    #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
    fn radius(&self, field: &MeridianField, cell: usize, place: f64) -> f64 {
        ((field.columns().1 + cell as i64) as f64 + place) * field.cell()
    }
}

/// The cubic over a stretch of `length` scene units, of which a unit has `scale`, from what its ends know.
#[inline]
fn cubic([near, far]: [&Local; 2], scale: f64, length: f64) -> [f64; 4] {
    let (a, b) = (near.value * scale, far.value * scale);
    let (da, db) = (near.gradient[0] * length, far.gradient[0] * length);
    let rise = b - a;
    [a, da, 3.0 * rise - 2.0 * da - db, da + db - 2.0 * rise]
}

/// One cubic for all parts of a cell, none of which it differs from by more than `tolerance`.
fn joined(parts: &[Part], tolerance: f64) -> Option<[f64; 4]> {
    let at = |t: f64| -> Option<f64> {
        let part = parts.iter().find(|p| t <= p.to)?;
        match part.form {
            Form::Cubic([a, b, c, d]) => Some(a + t * (b + t * (c + t * d))),
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
            bound(rest, [part.from, part.to]) <= tolerance
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

/// Gives a lane of a group its coefficients.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "coefficients are f32: the stored voxels are"
)]
fn store(group: &mut Group, lane: usize, [a, b, c, d]: [f64; 4]) {
    let lost = a - f64::from(a as f32);
    for (row, v) in group.iter_mut().zip([a, b, c, d, lost]) {
        row[lane] = v as f32;
    }
}

fn number(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The nearest feature of a run, with its distance.
#[derive(Debug, Clone, Copy, Default)]
struct Foot {
    feature: u32,
    local: Local,
}

/// Those of a leaf's runs.
#[derive(Debug, Clone, Copy, Default)]
struct Feet {
    list: [Foot; MOST_RUNS],
    count: usize,
}

/// Runs that may be nearest: the first by its number, the others as bits.
#[derive(Debug, Clone, Copy)]
struct Rivals {
    first: usize,
    others: u32,
    /// Whether the cubic of each is within the tolerance.
    good: bool,
}

impl Rivals {
    fn has(self, run: usize) -> bool {
        run == self.first || self.others >> run & 1 != 0
    }
}

impl Foot {
    /// The distance without its sign.
    fn size(&self) -> f64 {
        self.local.value.abs()
    }

    #[inline]
    fn new(field: &MeridianField, from: u32, q: [f64; 2]) -> Self {
        let feature = field.chain().walk(from, q);
        Self {
            feature,
            local: field.chain().local(feature, q),
        }
    }
}

impl Feet {
    /// Those of a point, from a feature of each run.
    fn new(field: &MeridianField, features: &[u32], q: [f64; 2]) -> Self {
        let mut feet = Self {
            count: features.len(),
            ..Self::default()
        };
        for (foot, &from) in feet.list.iter_mut().zip(features) {
            *foot = Foot::new(field, from, q);
        }
        feet
    }

    /// The foot of the least distance.
    fn nearest(&self) -> &Foot {
        let mut nearest = &self.list[0];
        for foot in &self.list[..self.count] {
            if foot.size() < nearest.size() {
                nearest = foot;
            }
        }
        nearest
    }

    fn all(&self) -> &[Foot] {
        &self.list[..self.count]
    }
}

/// One height of a field.
struct Row<'a> {
    field: &'a MeridianField,
    z: f64,
    tolerance: f64,
    /// The first cell, counted from r = 0.
    first: i64,
}

impl Row<'_> {
    #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
    fn node(&self, k: usize) -> [f64; 2] {
        let r = (self.first + k as i64) as f64 * self.field.cell();
        [r, self.z]
    }

    /// The most cells for which one cubic may serve, from a foot at their beginning.
    fn cells_for(&self, foot: &Foot) -> usize {
        let (bend, mut cells, mut h) = (foot.local.bend.abs(), 1, self.field.cell());
        while cells < WIDEST && smooth_error(2.0 * h, bend) <= self.tolerance {
            (cells, h) = (2 * cells, 2.0 * h);
        }
        cells
    }

    /// The feet of node `k`, from those of another point of the leaf.
    #[inline]
    fn feet(&self, known: &Feet, k: usize) -> Feet {
        let q = self.node(k);
        let mut feet = *known;
        for foot in &mut feet.list[..known.count] {
            *foot = Foot::new(self.field, foot.feature, q);
        }
        feet
    }

    /// The runs that may be nearest between two nodes; `None` where the cubic of one of them may err by more than the
    /// tolerance over more than a cell.
    ///
    /// The differences to the others are linear but for the bends, where no other surface is crossed: they keep their
    /// sign where they have it at both ends by more than those. What the arcs err by is added: the sign of the distance
    /// is that of the surface that is nearer, not of its arc.
    #[inline]
    fn rivals(&self, [near, far]: [&Feet; 2], [from, to]: [usize; 2]) -> Option<Rivals> {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let h = (to - from) as f64 * self.field.cell();
        let q = self.node(to);
        let passage = |i: usize| Passage::new(self.field, [&near.list[i], &far.list[i]], q, h);
        let good = |p: &Option<Passage>| p.as_ref().is_some_and(|p| p.error(h) <= self.tolerance);
        let one_cell = to - from == 1;
        let mut rivals = Rivals {
            first: 0,
            others: 0,
            good: true,
        };
        if near.count == 1 {
            rivals.good = good(&passage(0));
            return (rivals.good || one_cell).then_some(rivals);
        }
        let first = (1..near.count).fold(0, |m, i| {
            if near.list[i].size() < near.list[m].size() {
                i
            } else {
                m
            }
        });
        let own = passage(first);
        rivals.first = first;
        rivals.good = good(&own);
        if !(rivals.good || one_cell) {
            return None;
        }
        let bend = |p: &Option<Passage>| p.as_ref().map_or(f64::INFINITY, |p| p.bend);
        let own = bend(&own);
        for (i, (a, b)) in near.all().iter().zip(far.all()).enumerate() {
            if i == first {
                continue;
            }
            let gap = |f: &Foot, feet: &Feet| f.size() - feet.list[first].size();
            let passage = passage(i);
            let bent = h * (bend(&passage) + own);
            let clear = a.local.value * b.local.value > 0.0
                && bent <= BENT
                && gap(a, near).min(gap(b, far)) > 0.25 * h * bent + self.field.chain().margin();
            if !clear {
                rivals.others |= 1 << i;
                rivals.good &= good(&passage);
                if !(rivals.good || one_cell) {
                    return None;
                }
            }
        }
        Some(rivals)
    }
}

/// What happens between the feet of two neighbouring nodes.
struct Passage {
    /// The largest bend of the features passed.
    bend: f64,
    /// Sums of the jumps of the second and of the third derivative.
    jumps: [f64; 2],
}

impl Passage {
    /// From one foot to the next, which is that of `q`, on a stretch of length `h`; `None` where more features are
    /// passed than are followed.
    #[inline]
    fn new(field: &MeridianField, [near, far]: [&Foot; 2], q: [f64; 2], h: f64) -> Option<Self> {
        let mut found = Self {
            bend: near.local.bend.abs().max(far.local.bend.abs()),
            jumps: [0.0; 2],
        };
        if near.feature == far.feature {
            return Some(found);
        }
        let chain = field.chain();
        let mut last = chain.bend(near.feature, q);
        for feature in chain.between(near.feature, far.feature, MOST_JOINTS)? {
            let bend = chain.bend(feature, q);
            let (difference, widest) = ((bend - last).abs(), bend.abs().max(last.abs()));
            found.bend = found.bend.max(widest);
            // Else they are parts of one circle.
            if difference > SAME_BEND * widest {
                // Both bends are taken at the far end; on the way from the joint they drift by b² h each, which
                // cancels but for their difference, and by terms in b³.
                let b = widest / (1.0 - BENT);
                let drift = h * b * b * b;
                found.jumps[0] += difference * (1.0 + 3.0 * h * b) + 6.0 * h * drift;
                found.jumps[1] += 2.4 * b * difference + 24.0 * drift;
            }
            last = bend;
        }
        Some(found)
    }

    /// A bound on the error of the cubic over a stretch of length `h`.
    fn error(&self, h: f64) -> f64 {
        let [second, third] = self.jumps;
        smooth_error(h, self.bend) + h * h * (second / 60.0 + h * third / 192.0)
    }
}

/// The error over a stretch of length `h` where the bend at its ends is at most `bend`.
fn smooth_error(h: f64, bend: f64) -> f64 {
    if bend * h > BENT {
        return f64::INFINITY;
    }
    // The centre of curvature may be nearer by the stretch's length.
    let hb = h * bend / (1.0 - bend * h);
    hb * hb * hb * h / 128.0
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::region::{
        Boundary, BoundaryPiece, Chain, DistanceSet, Extent, Fill, MeridianField, ProfileCurve,
        ProfileLoop, Region,
    };

    fn polyline(points: &[[f64; 2]]) -> ProfileCurve {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let mut knots: Vec<f64> = (0..points.len()).map(|i| i as f64).collect();
        knots.insert(0, 0.0);
        knots.push(knots[knots.len() - 1]);
        ProfileCurve::Nurbs {
            degree: 1,
            knots,
            points: points.to_vec(),
            weights: vec![1.0; points.len()],
        }
    }

    fn cubic(points: &[[f64; 2]], weights: &[f64]) -> ProfileCurve {
        let inner = points.len() - 4;
        let mut knots = vec![0.0; 4];
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        knots.extend((1..=inner).map(|i| i as f64));
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        knots.extend([(inner + 1) as f64; 4]);
        ProfileCurve::Nurbs {
            degree: 3,
            knots,
            points: points.to_vec(),
            weights: weights.to_vec(),
        }
    }

    fn arc(center: [f64; 2], radii: [f64; 2], from: f64, to: f64) -> ProfileCurve {
        ProfileCurve::Arc {
            center,
            radii,
            tilt: 20.0,
            from,
            to,
        }
    }

    /// Profiles with arcs, free curves, inflections, corners of both kinds, tips on the axis and thin walls.
    pub(in crate::region) fn regions() -> Vec<(&'static str, Region)> {
        let region = |loops: &[ProfileLoop], boundary| {
            Region::new(loops, boundary, Fill::EvenOdd).expect("a region")
        };
        let star: Vec<[f64; 2]> = (0..=10)
            .map(|i| {
                let (s, c) = (f64::from(i % 10) * 36.0).to_radians().sin_cos();
                let r = if i % 2 == 0 { 1.0 } else { 0.45 };
                [1.5 + r * c, r * s]
            })
            .collect();
        let weights = [1.0, 3.0, 0.4, 1.0, 2.0, 1.0];
        vec![
            (
                "tube",
                region(
                    &[vec![arc([1.0, 0.0], [0.35; 2], 0.0, 360.0)]],
                    Boundary::Closed,
                ),
            ),
            ("star", region(&[vec![polyline(&star)]], Boundary::Closed)),
            (
                "cone",
                region(
                    &[vec![polyline(&[[0.0, 0.0], [0.7, 0.2], [0.0, 1.0]])]],
                    Boundary::ToAxis,
                ),
            ),
            (
                "goblet",
                region(
                    &[vec![
                        polyline(&[[0.0, 0.0], [34.0, 0.0], [34.0, 3.0]]),
                        cubic(
                            &[
                                [34.0, 3.0],
                                [16.0, 5.0],
                                [4.0, 6.0],
                                [4.0, 22.0],
                                [4.5, 40.0],
                                [3.5, 62.0],
                            ],
                            &weights,
                        ),
                        cubic(
                            &[
                                [3.5, 62.0],
                                [20.0, 66.0],
                                [39.0, 78.0],
                                [44.0, 108.0],
                                [40.0, 140.0],
                                [33.0, 170.0],
                            ],
                            &[1.0; 6],
                        ),
                        polyline(&[[33.0, 170.0], [32.0, 170.0]]),
                        cubic(
                            &[
                                [32.0, 170.0],
                                [38.5, 140.0],
                                [42.0, 108.0],
                                [37.0, 80.0],
                                [18.0, 69.0],
                                [0.0, 68.0],
                            ],
                            &[1.0; 6],
                        ),
                    ]],
                    Boundary::ToAxis,
                ),
            ),
            (
                "ellipses",
                region(
                    &[
                        vec![arc([2.0, 0.0], [1.0, 0.3], 0.0, 360.0)],
                        vec![arc([2.0, 0.05], [0.5, 0.1], 0.0, 360.0)],
                    ],
                    Boundary::Closed,
                ),
            ),
        ]
    }

    pub(in crate::region) fn swept(region: &Region) -> Vec<BoundaryPiece> {
        (region.boundary().iter())
            .filter(|b| !b.piece.on_axis)
            .cloned()
            .collect()
    }

    /// Numbers from 0 to 1, always the same.
    pub(in crate::region) fn numbers(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            #[allow(clippy::cast_precision_loss, reason = "53 bits")]
            {
                (state >> 11) as f64 / (1_u64 << 53) as f64
            }
        }
    }

    #[test]
    fn tables_are_within_their_tolerance_of_the_distance() {
        for (name, region) in regions() {
            for voxels in [40.0, 300.0, 2000.0] {
                let swept = swept(&region);
                let exact = DistanceSet::new(swept.iter().map(|b| &b.piece));
                let top = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.max(b.piece.bounds.max[1]));
                let low = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.min(b.piece.bounds.min[1]));
                let side = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.max(b.piece.bounds.max[0]))
                    .max(top - low);
                let cell = 1.3 * side / voxels;
                let tolerance = 2.5e-5 * cell;
                let chain = Chain::new(&swept, tolerance, 100_000, true).expect("few arcs");
                let features = chain.len();
                let began = std::time::Instant::now();
                let extent = Extent {
                    r: [0.0, 1.3 * side],
                    z: [low - 0.1 * side, top + 0.1 * side],
                    cell,
                };
                let field = MeridianField::new(chain, extent).expect("a field");
                let built = began.elapsed();
                let mut table = RadialTable::default();
                let mut number = numbers(7);
                let (mut worst, mut special, mut all) = (0.0_f64, 0_u32, 0_u32);
                let (mut signs, mut ridges) = (0_u32, 0_u32);
                let (columns, _) = field.columns();
                let mut time = std::time::Duration::ZERO;
                for _ in 0..60 {
                    let z = extent.z[0] + (extent.z[1] - extent.z[0]) * number();
                    let began = std::time::Instant::now();
                    table.fill(Kernel::default(), &field, z, 1.0, 3.5e-5 * cell);
                    table.find_signs(&field, |r| {
                        region.section().side_of(r, z) != crate::math::Side::Outside
                    });
                    time += began.elapsed();
                    for k in 0..columns {
                        let t = number();
                        #[allow(clippy::cast_precision_loss, reason = "a small count")]
                        let r = (k as f64 + t) * cell;
                        let truth = exact.distance([r, z], f64::INFINITY);
                        let value = |groups: &[Group]| {
                            let [a, b, c, d, lost] =
                                std::array::from_fn(|i| f64::from(groups[k / GROUP][i][k % GROUP]));
                            a + (lost + t * (b + t * (c + t * d)))
                        };
                        let cubics = table.cubics();
                        let (v, second) = (value(cubics.groups), value(cubics.seconds));
                        let has_second = second != f64::from(UNUSED);
                        assert_eq!(has_second, cubics.ridged[k / GROUP] >> (k % GROUP) & 1 != 0);
                        ridges += u32::from(has_second);
                        all += 1;
                        let found = if v.is_nan() {
                            special += 1;
                            let inside =
                                region.section().side_of(r, z) != crate::math::Side::Outside;
                            let sign = table.sign(k);
                            assert!(
                                sign.is_none_or(|s| inside == (s < 0.0)),
                                "{name} {voxels}: sign at {r} {z}: {sign:?}"
                            );
                            signs += u32::from(sign.is_some());
                            table.size(&field, k, t)
                        } else {
                            let v = if second.abs() < v.abs() { second } else { v };
                            let inside =
                                region.section().side_of(r, z) != crate::math::Side::Outside;
                            assert!(
                                truth < 1e-4 * cell || inside == (v < 0.0),
                                "{name} {voxels}: sign at {r} {z}: {v}"
                            );
                            v.abs()
                        };
                        let error = (found - truth).abs();
                        worst = worst.max(error / cell);
                        assert!(
                            error < 6.2e-5 * cell,
                            "{name} {voxels}: {found} for {truth} at {r} {z}, cell {cell}, {}",
                            v.is_nan()
                        );
                    }
                }
                let (leaves, smooth) = field.census();
                eprintln!(
                    "{name:>9} {voxels:>5}: {features} features, {leaves} leaves, {smooth} smooth, {built:?}; tables {:?} each, {:.2}% mended, {:.0}% of them with a sign, {:.2}% with a ridge, worst {worst:.1e} of a cell",
                    time / 60,
                    100.0 * f64::from(special) / f64::from(all),
                    100.0 * f64::from(signs) / f64::from(special),
                    100.0 * f64::from(ridges) / f64::from(all)
                );
            }
        }
    }

    #[test]
    fn detail_finer_than_the_cells_is_left_to_the_exact_path() {
        // A saw of 3000 teeth, all within a cell.
        let mut saw: Vec<[f64; 2]> = (0..6001_u32)
            .map(|i| [1.0 + 1e-3 * f64::from(i % 2), 1e-6 * f64::from(i)])
            .collect();
        saw.extend([[2.0, 0.006], [2.0, 0.0], [1.0, 0.0]]);
        let region = Region::new(&[vec![polyline(&saw)]], Boundary::Closed, Fill::EvenOdd);
        let swept = swept(&region.expect("a region"));
        let chain = Chain::new(&swept, 1e-9, 100_000, true).expect("few arcs");
        let extent = Extent {
            r: [0.0, 20.0],
            z: [-20.0, 20.0],
            cell: 0.01,
        };
        assert!(MeridianField::new(chain, extent).is_none());
    }

    #[test]
    fn a_jump_of_the_second_derivative_costs_no_more_than_assumed() {
        // d = (x - s)²/2 beyond s: the error of the cubic through its ends.
        let mut worst = [0.0_f64; 2];
        for s in (1..200).map(|i| f64::from(i) / 200.0) {
            for (power, factor) in [(2, 0.5), (3, 1.0 / 6.0)] {
                let d = |x: f64| factor * (x - s).max(0.0).powi(power);
                let slope = f64::from(power) * factor * (1.0 - s).powi(power - 1);
                let (c, e) = (3.0 * d(1.0) - slope, slope - 2.0 * d(1.0));
                for x in (0..=200).map(|i| f64::from(i) / 200.0) {
                    let error = (c * x * x + e * x * x * x - d(x)).abs();
                    let k = usize::from(power == 3);
                    worst[k] = worst[k].max(error);
                }
            }
        }
        eprintln!("jumps: {worst:?}");
        assert!(worst[0] < 1.0 / 60.0 && worst[1] <= 1.0 / 192.0 + 1e-12);
    }
}
