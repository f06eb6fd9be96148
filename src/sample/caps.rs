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
use crate::math::{Dd, Kernel, Real, root};
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

/// Runs a job with the kernel's lanes.
pub(super) fn dispatch<J: pulp::NullaryFnOnce<Output = ()>>(kernel: Kernel, job: J) {
    match kernel.lanes() {
        Some(arch) => arch.dispatch(job),
        None => job.call(),
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
    /// A bit for each voxel of a group that is inside.
    pub(super) inside: &'a [u16],
    /// Distances to the swept surface, of either sign.
    pub(super) swept: &'a [f32],
    /// Values nearer to 0 than this are doubts.
    pub(super) least: f32,
    pub(super) band: f32,
}

/// The stored value, and whether it is a doubt.
#[inline(always)]
fn signed(value: f32, inside: u32, least: f32, band: f32) -> (f32, u32) {
    let doubt = u32::from(!(value >= least));
    let value = if value > band { band } else { value };
    (f32::from_bits(value.to_bits() | (inside << 31)), doubt)
}

/// Fills the groups where no cap is nearer than the swept surface, and marks the others.
///
/// In the wedge a cap is nearer than the swept surface inside the solid only: from outside, the nearest point of the
/// full turn is at the point's own angle.
pub(super) struct SweptGroups<'a> {
    pub(super) given: Given<'a>,
    /// The first and the last voxel of each group along x.
    pub(super) ends: &'a [[f64; 2]],
    /// Left as the least |s| of each group, below 0 where some voxel may not be in the wedge.
    pub(super) gaps: &'a mut [f32],
    /// Set for each group that a cap may be nearest to.
    pub(super) wanted: &'a mut [bool],
    pub(super) out: &'a mut [f32],
    pub(super) doubts: &'a mut [bool],
}

impl pulp::NullaryFnOnce for SweptGroups<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Given {
            row,
            inside,
            swept,
            least,
            band,
            ..
        } = self.given;
        let (swept, _) = swept.as_chunks::<GROUP>();
        let (out, _) = self.out.as_chunks_mut::<GROUP>();
        let groups = inside.len();
        let (ends, gaps) = (&self.ends[..groups], &mut self.gaps[..groups]);
        for (gap, [a, b]) in gaps.iter_mut().zip(ends) {
            let [c, d] = row.across;
            let (p, q) = (a * c[0] + c[1], b * c[0] + c[1]);
            let (r, s) = (a * d[0] + d[1], b * d[0] + d[1]);
            let (low, high) = (max(min(p, q), min(r, s)), max(max(p, q), max(r, s)));
            let most = if row.sense > 0.0 { high } else { -low };
            #[allow(clippy::cast_possible_truncation, reason = "a hair more is taken off")]
            {
                *gap = (-most * (1.0 - 1e-6)) as f32;
            }
        }
        // Bound to what the loops go through: an index into a list in an inner loop costs the lanes.
        let lists = gaps.iter().zip(inside).zip(swept).zip(out);
        let flags = self.wanted[..groups]
            .iter_mut()
            .zip(&mut self.doubts[..groups]);
        for ((((gap, bits), swept), out), (wanted_here, doubts_here)) in lists.zip(flags) {
            let (gap, bits) = (*gap, u32::from(*bits));
            let wanted = gap < row.guard
                || bits != 0 && {
                    // As whole numbers, whose largest the lanes may find in any order.
                    let bits = swept.iter().fold(0, |m, s| s.abs().to_bits().max(m));
                    let deepest = f32::from_bits(bits);
                    // A distance that is not a number tells nothing.
                    !(gap >= deepest)
                };
            *wanted_here = wanted;
            if wanted {
                continue;
            }
            let mut doubts = 0;
            for n in 0..GROUP {
                let inside = (bits >> n) & 1;
                let (value, doubt) = signed(swept[n].abs(), inside, least, band);
                out[n] = value;
                doubts |= doubt;
            }
            *doubts_here = doubts != 0;
        }
    }
}

/// Fills groups where caps may be the nearest.
pub(super) struct CapGroups<'a> {
    pub(super) given: Given<'a>,
    /// Signed distances to the section in the cap's plane; left as those to the cap.
    pub(super) edges: &'a mut [f32],
    pub(super) out: &'a mut [f32],
    pub(super) doubts: &'a mut [bool],
}

impl pulp::NullaryFnOnce for CapGroups<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Given {
            row,
            x,
            inside,
            swept,
            least,
            band,
        } = self.given;
        // In loops over the whole run, or of whole groups: shorter ones are unrolled before they get their lanes.
        let lanes = x.iter().zip(self.edges.iter_mut()).zip(self.out.iter_mut());
        for ((x, edge), out) in lanes {
            [*out, *edge] = cap(row, *x, *edge);
        }
        let (swept, _) = swept.as_chunks::<GROUP>();
        let (caps, _) = self.edges.as_chunks::<GROUP>();
        let (out, _) = self.out.as_chunks_mut::<GROUP>();
        let groups = swept.iter().zip(caps).zip(out);
        let marks = inside.iter().zip(self.doubts);
        for (((swept, caps), out), (bits, mark)) in groups.zip(marks) {
            let bits = u32::from(*bits);
            let mut doubts = 0;
            for n in 0..GROUP {
                let value = nearer(row, swept[n], [out[n], caps[n]]);
                let (value, doubt) = signed(value, (bits >> n) & 1, least, band);
                out[n] = value;
                doubts |= doubt;
            }
            *mark = doubts != 0;
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

/// The lesser of the distances to the swept surface and to the cap, in the wedge, and that to the cap outside it.
///
/// From outside the solid in the wedge the cap is no nearer than the swept surface: the lesser is the latter, or
/// equal to it but for the errors of both.
#[inline(always)]
fn nearer(row: CapRow, swept: f32, [across, cap]: [f32; 2]) -> f32 {
    let turned = row.sense * across < -row.guard;
    let swept = if turned { swept.abs() } else { f32::INFINITY };
    // The second comparison alone would do, were it not for caps that are NaN and do not matter.
    let cap = if cap >= swept { swept } else { cap };
    // A swept distance that is not a number stays so.
    if across.abs() < swept { cap } else { swept }
}

/// Unsigned distance of one voxel; NaN where it rests on an edge distance that is.
pub(super) fn combined(row: CapRow, x: f64, swept: f32, edge: f32) -> f32 {
    nearer(row, swept, cap(row, x, edge))
}
