//! The signed distance along one height, as cubics in r.
//!
//! A stretch of cells of a [`MeridianField`]'s lattice gets the cubic that has the distance and its slope at both ends,
//! each cell its part of it. Stretches where that may err by more than the tolerance ([`super::radial_feet`]) are halved.
//! Single cells where it may, and those where the distance is not smooth, are open ([`super::open_cells`]): they have NaN
//! as their first coefficient and are answered voxel by voxel. In open cells that no surface can be in, the sign is found
//! once; where a ridge between two cubics is all that is in one, it gets both, of which the one nearer to 0 counts.

use super::chain::Local;
use super::field::MeridianField;
use super::open_cells::{OpenCells, cubic};
use super::radial_feet::{Feet, Rivals, Row};
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
    open: OpenCells,
    /// Values to which the rounding of the first coefficients does not count.
    small: f32,
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
        self.open.start(kernel, columns, z, scale);
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
            let features = field.features(field.leaf(number));
            if features.is_empty() {
                for k in from..to {
                    self.open.open_by_leaves(&row, k, number);
                    self.leave_open(k);
                }
                return;
            }
            let mut near = Feet::new(field, features, row.node(from));
            let mut start = from;
            while start < to {
                near.keep_within(row.reach(to - start));
                let end = to.min(start + row.cells_for(near.nearest()));
                let far = row.feet(&near, end);
                self.span(&row, number, [start, end], [&near, &far]);
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

    fn leave_open(&mut self, cell: usize) {
        self.groups[cell / GROUP][0][cell % GROUP] = f32::NAN;
    }

    /// Tabulates cells of one leaf from what its runs know at both ends: by one cubic where that is within the
    /// tolerance, else half by half.
    fn span(&mut self, row: &Row<'_>, leaf: u32, [from, to]: [usize; 2], [near, far]: [&Feet; 2]) {
        let count = to - from;
        let rivals = row.rivals([near, far], [from, to]);
        if let Some(Rivals {
            first,
            others: 0,
            good: true,
        }) = rivals
        {
            let ends = [near, far].map(|feet| &feet.list[first].local);
            self.put(row.field, [from, to], ends);
        } else if count > 1 {
            let middle = from + count / 2;
            let feet = row.feet(near, middle);
            self.span(row, leaf, [from, middle], [near, &feet]);
            self.span(row, leaf, [middle, to], [&feet, far]);
        } else {
            // The distance is the least of theirs, and each is within the tolerance.
            let runs = (0..near.count).filter(|i| rivals.is_some_and(|r| r.has(*i)));
            let feet = runs.map(|i| [&near.list[i], &far.list[i]]);
            match self.open.open_by_runs(row, (from, leaf), feet) {
                Some(cubic) => store(&mut self.groups[from / GROUP], from % GROUP, cubic),
                None => self.leave_open(from),
            }
        }
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

    /// Finds the signs in open cells that the surface is not in; `inside` tells them by the radius, where it can. Those
    /// with a ridge between two cubics are open no longer.
    pub(crate) fn find_signs(
        &mut self,
        field: &MeridianField,
        inside: impl Fn(f64) -> Option<bool>,
    ) {
        let Self {
            groups,
            seconds,
            ridged,
            precise,
            small,
            open,
            ..
        } = self;
        open.find_signs(field, inside, |cell, sign, cubics| {
            let (group, lane) = (cell / GROUP, cell % GROUP);
            *precise |= cubics.iter().any(|c| c[0].abs() > f64::from(*small));
            let lists = [&mut *groups, &mut *seconds];
            for (groups, cubic) in lists.into_iter().zip(cubics) {
                // Neither is 0 in the cell.
                let sign = sign * cubic[0].signum();
                store(&mut groups[group], lane, cubic.map(|c| c * sign));
                if !*precise {
                    groups[group][4][lane] = 0.0;
                }
            }
            ridged[group] |= 1 << lane;
        });
    }

    /// The signed distance in scene units at a place in an open cell, from 0 to 1 in it, where it is to be had at little
    /// cost.
    #[inline]
    pub(crate) fn signed(&self, field: &MeridianField, cell: usize, place: f64) -> Option<f64> {
        self.open.signed(field, cell, place)
    }

    /// The sign of the distance in all of an open cell, where it is known.
    pub(crate) fn sign(&self, cell: usize) -> Option<f64> {
        self.open.sign(cell)
    }

    /// The unsigned distance in scene units at a place in an open cell.
    #[inline]
    pub(crate) fn size(&self, field: &MeridianField, cell: usize, place: f64) -> f64 {
        self.open.size(field, cell, place)
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

    pub(in crate::region) fn swept(region: &Region) -> Vec<BoundaryPiece<'_>> {
        (region.boundary().iter())
            .filter(|b| !b.piece.on_axis)
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
                let exact = DistanceSet::new(swept.iter().map(|b| b.piece));
                let top = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.max(b.piece.bounds().max[1]));
                let low = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.min(b.piece.bounds().min[1]));
                let side = swept
                    .iter()
                    .fold(0.0_f64, |m, b| m.max(b.piece.bounds().max[0]))
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
                let field = MeridianField::new(Kernel::default(), chain, extent).expect("a field");
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
                        let side = region.section().side_of(r, z);
                        Some(side != crate::math::Side::Outside)
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
    fn a_blunt_apex_that_is_passed_within_a_cell_counts() {
        // Its edges fall by 1.5 degrees: ten cells above, it is nearest over half a cell, and nodes see the edges alone.
        let fall = 2000.0 * 1.5_f64.to_radians().tan();
        for at in [0.5, 0.3, 0.75] {
            let apex = 2100.0 + at;
            let corners = [
                [apex, 0.0],
                [apex - 2000.0, -fall],
                [apex + 2000.0, -fall],
                [apex, 0.0],
            ];
            let region = Region::new(&[vec![polyline(&corners)]], Boundary::Closed, Fill::EvenOdd);
            let region = region.expect("a region");
            let swept = swept(&region);
            let exact = DistanceSet::new(swept.iter().map(|b| b.piece));
            // The region's unit is its own.
            let furthest = |m: f64, b: &BoundaryPiece| m.max(b.piece.bounds().max[0]);
            let cell = swept.iter().fold(0.0, furthest) / (apex + 2000.0);
            let chain = Chain::new(&swept, 2.5e-5 * cell, 1000, true).expect("few arcs");
            let extent = Extent {
                r: [2090.0, 2111.0].map(|r| r * cell),
                z: [5.0, 20.0].map(|z| z * cell),
                cell,
            };
            let field = MeridianField::new(Kernel::default(), chain, extent).expect("a field");
            let (columns, first) = field.columns();
            for z in [7.0, 10.0, 13.0] {
                let mut table = RadialTable::default();
                table.fill(Kernel::default(), &field, z * cell, 1.0, 3.5e-5 * cell);
                let mut tabulated = 0;
                for n in 0..64 * columns {
                    let (k, t) = (n / 64, f64::from((n % 64) as u32) / 64.0);
                    #[allow(clippy::cast_precision_loss, reason = "small counts")]
                    let r = (first + k as i64) as f64 + t;
                    let [a, b, c, d, lost] =
                        std::array::from_fn(|i| f64::from(table.groups[k / GROUP][i][k % GROUP]));
                    let found = if a.is_nan() {
                        table.size(&field, k, t)
                    } else {
                        tabulated += 1;
                        a + (lost + t * (b + t * (c + t * d)))
                    };
                    let truth = exact.distance([r, z].map(|c| c * cell), f64::INFINITY);
                    assert!(
                        (found - truth).abs() < 6.2e-5 * cell,
                        "{at}, {z}: {found} for {truth} at {r}, {cell}"
                    );
                }
                assert!(tabulated > 16 * columns, "{at}, {z}: {tabulated}");
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
        let region = region.expect("a region");
        let swept = swept(&region);
        let chain = Chain::new(&swept, 1e-9, 100_000, true).expect("few arcs");
        let extent = Extent {
            r: [0.0, 20.0],
            z: [-20.0, 20.0],
            cell: 0.01,
        };
        assert!(MeridianField::new(Kernel::default(), chain, extent).is_none());
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
