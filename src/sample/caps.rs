//! Voxels of a layer as the caps of an upright wedge see them.
//!
//! A wedge and its caps are symmetric about the half-plane in the middle of the turn, and each cap lies on one side
//! of its plane: of the two, the cap on a point's own side is the nearer. With u along the middle of the turn, v
//! across it and θ half the turn, that cap sees the point at
//!
//! ```text
//!   along  a = u cos θ + |v| sin θ     from the axis; never less than for the other cap, as sin θ > 0
//!   across s = |v| cos θ - u sin θ     below 0 in the wedge, above 0 outside it
//! ```
//!
//! Both are the larger or the smaller of two linear functions of a voxel's number in its row, so that rows need no
//! table and lanes no branch.
//!
//! * Units: lengths in scene units; places are 65 536ths of a cell from the first column of a table.
//! * Accuracy: some roundings of the voxel's distance from the axis. Within a guard of the caps' planes, much wider
//!   than those, nothing rests on the sign of s.

use super::plane::{BLOCK, PLACES, REACH, SCATTERED};
use crate::grid::GridSpec;
use crate::math::{Dd, Real, root};
use crate::solid::Revolved;

/// Voxels that are decided on together.
pub(super) const GROUP: usize = 16;
/// Lengths above this are too near to what columns hold that are left out, and their squares to the end of f32.
const FAR: f64 = 1e16;
/// Spacings below this are too near to what roots of the least squares are off by.
const NARROW: f64 = 1e-12;
/// Share of the least spacing within which a point may be on either side of a cap's plane: some tens of roundings of
/// a place 65 000 cells away.
pub(super) const GUARD: f64 = 1e-9;
/// Least sine of half a turn above 180 degrees. Near a full turn s is small beside the axis, too, where the guard
/// must not hide that a voxel is in the wedge: it does so up to GUARD / sine from the axis, where S and E differ by
/// twice that, a hundredth of what they may err by.
pub(super) const LEAST_SINE: f64 = 2e-3;

/// Rows of a grid around the axis of a wedge.
#[derive(Debug)]
pub(super) struct CapPlane {
    /// The voxels of a row along x, from the axis; the last is repeated to fill the group.
    x: Vec<f64>,
    /// The first and the last of each group of them.
    ends: Vec<[f64; 2]>,
    y: Vec<f64>,
    /// For either cap, its direction.
    along: [[f64; 2]; 2],
    /// For either cap, what gives s, or -s for wedges of more than half a turn, where s is the lesser.
    across: [[f64; 2]; 2],
    /// 1, or -1 where `across` gives -s.
    sense: f64,
    /// Places for a unit of length.
    per_length: f64,
    /// Place of the axis.
    axis_place: f64,
    guard: f64,
    /// Whether the lanes of a block may be too far apart for one window.
    scattered: bool,
}

/// One row: coefficients of x, and what y gives, for either cap.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapRow {
    along: [[f64; 2]; 2],
    across: [[f64; 2]; 2],
    sense: f32,
    guard: f32,
}

impl CapPlane {
    /// The rows of `grid` in cells of `cell` scene units; `None` where the turn is full, or all
    /// but full, or the numbers are too large.
    pub(super) fn new(body: &Revolved, grid: &GridSpec, cell: f64) -> Option<Self> {
        let wedge = body.turn().halves()?;
        let frame = body.frame();
        let axis = frame.origin_exact();
        let dims = grid.dims();
        let list = |c: usize| -> Vec<f64> {
            let from = |i| (Dd::of(grid.centre_along(c, i)) - axis[c]).f64();
            (0..dims[c]).map(from).collect()
        };
        let (mut x, y) = (list(0), list(1));
        let ends = |v: &[f64]| v[0].abs().max(v[v.len() - 1].abs());
        let bounds = body.bounds();
        let furthest = [ends(&x), ends(&y), ends(&list(2)), bounds.longest_side()];
        let apart = (bounds.min - frame.origin()).abs().max_element();
        let least = grid.spacing().min_element();
        if !(furthest.into_iter().fold(apart, f64::max) < FAR && least > NARROW) {
            return None;
        }
        let last = x[x.len() - 1];
        x.resize(x.len().next_multiple_of(GROUP), last);
        let [e1, e2] = [frame.axis(0), frame.axis(1)];
        let [m, n] = [wedge.middle, [-wedge.middle[1], wedge.middle[0]]]
            .map(|d| [d[0] * e1.x + d[1] * e2.x, d[0] * e1.y + d[1] * e2.y]);
        let mixed = |a: f64, b: f64| [a * m[0] + b * n[0], a * m[1] + b * n[1]];
        let (sin, cos) = (wedge.sin, wedge.cos);
        if cos < 0.0 && sin < LEAST_SINE {
            return None;
        }
        let sense = if cos >= 0.0 { 1.0 } else { -1.0 };
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let span = (BLOCK - 1) as f64 * grid.spacing().x / cell;
        let (groups, _) = x.as_chunks::<GROUP>();
        Some(Self {
            ends: groups.iter().map(|g| [g[0], g[GROUP - 1]]).collect(),
            x,
            y,
            along: [mixed(cos, sin), mixed(cos, -sin)],
            across: [
                mixed(-sense * sin, sense * cos),
                mixed(-sense * sin, -sense * cos),
            ],
            sense,
            per_length: PLACES / cell,
            axis_place: 0.0,
            guard: GUARD * least,
            scattered: span + 1.5 >= f64::from(REACH),
        })
    }

    /// The least and the greatest length along the caps, or less and more.
    pub(super) fn reach(&self) -> [f64; 2] {
        let ends = |v: &[f64]| [v[0], v[v.len() - 1]];
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for d in self.along {
            let mut least = f64::INFINITY;
            for x in ends(&self.x) {
                for y in ends(&self.y) {
                    let a = x * d[0] + y * d[1];
                    least = least.min(a);
                    high = high.max(a);
                }
            }
            low = low.max(least);
        }
        [low, high]
    }

    /// The same with places counted from column `first` of a table.
    pub(super) fn with_first_column(self, first: i64) -> Self {
        #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
        let axis_place = -(first as f64) * PLACES;
        Self { axis_place, ..self }
    }

    /// One row.
    pub(super) fn row(&self, j: usize) -> CapRow {
        let y = self.y[j];
        let along = self.along.map(|d| {
            let [x, y] = [d[0], d[1] * y].map(|v| v * self.per_length);
            [x, y + self.axis_place]
        });
        let across = self.across.map(|d| [d[0], d[1] * y]);
        CapRow::new(along, across, self.sense, self.guard)
    }

    /// The voxels of a row along x, whole groups of them.
    pub(super) fn x(&self) -> &[f64] {
        &self.x
    }

    /// The first and the last voxel of each group of them.
    pub(super) fn ends(&self) -> &[[f64; 2]] {
        &self.ends
    }

    /// Whether, from outside the wedge, no place along the caps is below 0.
    pub(super) fn sees_forwards(&self) -> bool {
        self.sense < 0.0
    }

    /// Whether one window of cells may not serve a block.
    pub(super) fn is_scattered(&self) -> bool {
        self.scattered
    }
}

/// The larger of two numbers, as lanes have it.
#[inline(always)]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The lesser of two numbers, as lanes have it.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of either cap's.
#[inline(always)]
fn larger(of: [[f64; 2]; 2], x: f64) -> f64 {
    max(x * of[0][0] + of[0][1], x * of[1][0] + of[1][1])
}

impl CapRow {
    /// A row whose voxels are at `x`: for either cap, coefficients of x and what is added, in places along it and in
    /// scene units across.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "1 or -1, and a bound with room"
    )]
    pub(super) fn new(along: [[f64; 2]; 2], across: [[f64; 2]; 2], sense: f64, guard: f64) -> Self {
        Self {
            along,
            across,
            sense: sense as f32,
            guard: guard as f32,
        }
    }

    /// Place along the nearer cap of the voxel at `x`.
    #[inline(always)]
    pub(super) fn place(&self, x: f64) -> u32 {
        rounded(larger(self.along, x))
    }
}

impl CapRow {
    /// Whether all voxels between two places of the row are outside the wedge, further than rounding.
    pub(super) fn is_outside(&self, ends: [f64; 2]) -> bool {
        let guard = f64::from(self.guard);
        let sense = f64::from(self.sense);
        let outside = |of: [f64; 2]| ends.iter().all(|x| sense * (x * of[0] + of[1]) > guard);
        // s is the larger of the two, or for more than half a turn the lesser.
        if sense > 0.0 {
            self.across.into_iter().any(outside)
        } else {
            self.across.into_iter().all(outside)
        }
    }
}

/// A number below 2^32 to the nearest whole one, in a way that lanes have.
#[inline(always)]
fn rounded(v: f64) -> u32 {
    #[allow(clippy::cast_possible_truncation, reason = "the low half is meant")]
    {
        (v + 4_503_599_627_370_496.0).to_bits() as u32
    }
}

/// Finds the places of voxels along their cap, and the least cell of each block.
pub(super) struct Places<'a> {
    pub(super) row: CapRow,
    pub(super) x: &'a [f64],
    pub(super) scattered: bool,
    pub(super) places: &'a mut [u32],
    pub(super) cells: &'a mut [u32],
}

impl pulp::NullaryFnOnce for Places<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // One loop for each thing, which the compiler gives to lanes.
        for (place, x) in self.places.iter_mut().zip(self.x) {
            *place = self.row.place(*x);
        }
        let (places, _) = self.places.as_chunks::<BLOCK>();
        for (places, cell) in places.iter().zip(self.cells) {
            let least = places.iter().fold(u32::MAX, |m, p| m.min(*p));
            *cell = if self.scattered {
                SCATTERED
            } else {
                least >> 16
            };
        }
    }
}

/// What a row's values are made of.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub(super) row: CapRow,
    pub(super) x: &'a [f64],
    /// Signed distances to the swept surface of the full turn.
    pub(super) swept: &'a [f32],
    pub(super) band: f32,
}

/// A value that is no further from 0 than the band.
#[inline(always)]
fn clamped(value: f32, band: f32) -> f32 {
    let least = if value < -band { -band } else { value };
    if least > band { band } else { least }
}

/// Flags groups with a value that is below what is asked, or no number.
pub(super) struct Below<'a> {
    pub(super) values: &'a [f32],
    pub(super) least: Least<'a>,
    pub(super) flags: &'a mut [bool],
}

/// What values must be at least.
#[derive(Clone, Copy)]
pub(super) enum Least<'a> {
    /// Their sizes, this.
    Size(f32),
    /// Those of each group, its own.
    Values(&'a [f32]),
}

// Lanes by hand: the compiler unrolls what makes one flag of sixteen values before it could use them.
impl pulp::WithSimd for Below<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let (groups, _) = self.values.as_chunks::<GROUP>();
        for (g, (group, flag)) in groups.iter().zip(self.flags).enumerate() {
            let (lanes, _) = S::as_simd_f32s(group);
            *flag = false;
            for &value in lanes {
                let (value, least) = match self.least {
                    Least::Size(least) => (simd.abs_f32s(value), least),
                    Least::Values(least) => (value, least[g]),
                };
                let met = simd.greater_than_or_equal_f32s(value, simd.splat_f32s(least));
                *flag |= simd.first_true_m32s(simd.not_m32s(met)) < S::F32_LANES;
            }
        }
    }
}

/// No value is less.
pub(super) const BEYOND: f32 = f32::NEG_INFINITY;

/// Fills a row as if no cap were nearer than the swept surface, and finds below which value one may be.
///
/// In the wedge a cap is nearer than the swept surface inside the solid only: from outside, the nearest point of the
/// full turn is at the point's own angle.
pub(super) struct SweptRow<'a> {
    pub(super) given: Given<'a>,
    /// The first and the last voxel of each group along x.
    pub(super) ends: &'a [[f64; 2]],
    /// Left as the value below which a cap may be nearer in a group: minus its least |s|; [`BEYOND`] where all of it is
    /// outside the wedge and as far from both caps as the band; no number where some voxel else may not be in the wedge:
    /// a cap is nearer than any value.
    pub(super) limits: &'a mut [f32],
    pub(super) out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for SweptRow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Given {
            row, swept, band, ..
        } = self.given;
        for (limit, [a, b]) in self.limits.iter_mut().zip(self.ends) {
            let [c, d] = row.across;
            let (p, q) = (a * c[0] + c[1], b * c[0] + c[1]);
            let (r, s) = (a * d[0] + d[1], b * d[0] + d[1]);
            let (low, high) = (max(min(p, q), min(r, s)), max(max(p, q), max(r, s)));
            let (most, least) = if row.sense > 0.0 {
                (high, low)
            } else {
                (-low, -high)
            };
            #[allow(clippy::cast_possible_truncation, reason = "a hair more is taken off")]
            let [gap, beyond] = [-most, least].map(|s| (s * (1.0 - 1e-6)) as f32);
            // No value is at least what is no number.
            let near = if beyond - row.guard >= band {
                BEYOND
            } else {
                f32::NAN
            };
            *limit = if gap < row.guard { near } else { -gap };
        }
        // In loops over the whole row: others are unrolled before they get their lanes.
        for (swept, out) in swept.iter().zip(self.out.iter_mut()) {
            *out = clamped(*swept, band);
        }
    }
}

/// Fills a run of groups where caps may be the nearest.
pub(super) struct CapRun<'a> {
    pub(super) given: Given<'a>,
    /// Signed distances to the section in the cap's plane; left as those to the cap.
    pub(super) edges: &'a mut [f32],
    pub(super) out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for CapRun<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Given {
            row,
            x,
            swept,
            band,
        } = self.given;
        // In loops over the whole run: others are unrolled before they get their lanes.
        let lanes = x.iter().zip(self.edges.iter_mut()).zip(self.out.iter_mut());
        for ((x, edge), out) in lanes {
            [*out, *edge] = cap(row, *x, *edge);
        }
        let lanes = swept.iter().zip(&*self.edges).zip(self.out.iter_mut());
        for ((swept, cap), out) in lanes {
            *out = clamped(nearer(row, *swept, [*out, *cap]), band);
        }
    }
}

/// s, but for its sense, and the distance to the cap: NaN where the edge's is.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "the one rounding of the stored value"
)]
fn cap(row: CapRow, x: f64, edge: f32) -> [f32; 2] {
    let across = larger(row.across, x);
    let edge = f64::from(if edge < 0.0 { 0.0 } else { edge });
    [across as f32, root(across * across + edge * edge) as f32]
}

/// The lesser of the distances to the swept surface and to the cap, in the wedge, and that to the cap outside it; below
/// 0 in the solid.
///
/// From outside the solid in the wedge the cap is no nearer than the swept surface: the lesser is the latter, or
/// equal to it but for the errors of both.
#[inline(always)]
fn nearer(row: CapRow, swept: f32, [across, cap]: [f32; 2]) -> f32 {
    let turned = row.sense * across < -row.guard;
    let full = if turned { swept } else { f32::INFINITY };
    let size = full.abs();
    // The second comparison alone would do, were it not for caps that are NaN and do not matter.
    let cap = if cap >= size { size } else { cap };
    // A swept distance that is not a number stays so.
    let value = if across.abs() < size { cap } else { size };
    if full < 0.0 { -value } else { value }
}

/// Signed distance of one voxel; NaN where it rests on an edge distance that is.
pub(super) fn combined(row: CapRow, x: f64, swept: f32, edge: f32) -> f32 {
    nearer(row, swept, cap(row, x, edge))
}
