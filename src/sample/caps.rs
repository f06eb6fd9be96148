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
use crate::math::{Dd, Kernel, Real};
use crate::solid::Revolved;

/// Voxels that are decided on together.
pub(super) const GROUP: usize = 16;
/// Lengths above this have no square in range of f32.
const FAR: f64 = 1e18;
/// Share of the least spacing within which a point may be on either side of a cap's plane.
const GUARD: f64 = 1e-6;

/// Rows of a grid around the axis of a wedge.
#[derive(Debug)]
pub(super) struct CapPlane {
    /// The voxels of a row along x, from the axis; the last is repeated to fill the group.
    x: Vec<f64>,
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
    /// The rows of `grid` in cells of `cell` scene units; `None` where the turn is full or the
    /// numbers are too large.
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
        if !(ends(&x).max(ends(&y)) < FAR) {
            return None;
        }
        let least = grid.spacing().min_element();
        let last = x[x.len() - 1];
        x.resize(x.len().next_multiple_of(GROUP), last);
        let [e1, e2] = [frame.axis(0), frame.axis(1)];
        let [m, n] = [wedge.middle, [-wedge.middle[1], wedge.middle[0]]]
            .map(|d| [d[0] * e1.x + d[1] * e2.x, d[0] * e1.y + d[1] * e2.y]);
        let mixed = |a: f64, b: f64| [a * m[0] + b * n[0], a * m[1] + b * n[1]];
        let (sin, cos) = (wedge.sin, wedge.cos);
        let sense = if cos >= 0.0 { 1.0 } else { -1.0 };
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let span = (BLOCK - 1) as f64 * grid.spacing().x / cell;
        Some(Self {
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
    pub(super) fn from_column(self, first: i64) -> Self {
        #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
        let axis_place = -(first as f64) * PLACES;
        Self { axis_place, ..self }
    }

    /// One row.
    pub(super) fn row(&self, j: usize) -> CapRow {
        let y = self.y[j];
        CapRow {
            along: self.along.map(|d| {
                let [x, y] = [d[0], d[1] * y].map(|v| v * self.per_length);
                [x, y + self.axis_place]
            }),
            across: self.across.map(|d| [d[0], d[1] * y]),
            #[allow(clippy::cast_possible_truncation, reason = "1 or -1")]
            sense: self.sense as f32,
            #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
            guard: self.guard as f32,
        }
    }

    /// The voxels of a row along x, whole groups of them.
    pub(super) fn x(&self) -> &[f64] {
        &self.x
    }

    /// Whether one window of cells may not serve a block.
    pub(super) fn is_scattered(&self) -> bool {
        self.scattered
    }
}

/// The larger of either cap's.
#[inline(always)]
fn larger(of: [[f64; 2]; 2], x: f64) -> f64 {
    let (a, b) = (x * of[0][0] + of[0][1], x * of[1][0] + of[1][1]);
    if a > b { a } else { b }
}

impl CapRow {
    /// Place along the nearer cap, and s, of the voxel at `x`.
    pub(super) fn at(&self, x: f64) -> [f64; 2] {
        [
            larger(self.along, x),
            f64::from(self.sense) * larger(self.across, x),
        ]
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
        let (x, _) = self.x.as_chunks::<BLOCK>();
        let (places, _) = self.places.as_chunks_mut::<BLOCK>();
        let along = self.row.along;
        for ((x, places), cell) in x.iter().zip(places).zip(self.cells) {
            for (place, x) in places.iter_mut().zip(x) {
                *place = rounded(larger(along, *x));
            }
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
            x,
            inside,
            swept,
            least,
            band,
        } = self.given;
        let (x, _) = x.as_chunks::<GROUP>();
        let (swept, _) = swept.as_chunks::<GROUP>();
        let (out, _) = self.out.as_chunks_mut::<GROUP>();
        let groups = inside.len();
        for g in 0..groups {
            // The least |s| of the group, below 0 where some voxel may not be in the wedge.
            let ends = [x[g][0], x[g][GROUP - 1]];
            let [p, q] = row.across.map(|c| ends.map(|x| x * c[0] + c[1]));
            let most = if row.sense > 0.0 {
                p[0].max(p[1]).max(q[0].max(q[1]))
            } else {
                -(p[0].min(p[1]).max(q[0].min(q[1])))
            };
            #[allow(clippy::cast_possible_truncation, reason = "a hair more is taken off")]
            let gap = (-most * (1.0 - 1e-6)) as f32;
            let bits = u32::from(inside[g]);
            let swept = &swept[g];
            let wanted = gap < row.guard
                || bits != 0 && {
                    let deepest = swept.iter().fold(0.0_f32, |m, s| {
                        let s = s.abs();
                        if s > m { s } else { m }
                    });
                    gap < deepest
                };
            self.wanted[g] = wanted;
            if wanted {
                continue;
            }
            let mut doubts = 0;
            for n in 0..GROUP {
                let inside = (bits >> n) & 1;
                let (value, doubt) = signed(swept[n].abs(), inside, least, band);
                out[g][n] = value;
                doubts |= doubt;
            }
            self.doubts[g] = doubts != 0;
        }
    }
}

/// Fills groups where caps may be the nearest.
pub(super) struct CapGroups<'a> {
    pub(super) given: Given<'a>,
    /// Signed distances to the section in the cap's plane.
    pub(super) edges: &'a [f32],
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
        let (x, _) = x.as_chunks::<GROUP>();
        let (swept, _) = swept.as_chunks::<GROUP>();
        let (edges, _) = self.edges.as_chunks::<GROUP>();
        let (out, _) = self.out.as_chunks_mut::<GROUP>();
        let groups = x.iter().zip(swept).zip(edges).zip(out);
        let marks = inside.iter().zip(self.doubts);
        for ((((x, swept), edges), out), (bits, mark)) in groups.zip(marks) {
            let bits = u32::from(*bits);
            let mut doubts = 0;
            for n in 0..GROUP {
                let inside = (bits >> n) & 1;
                let value = combined(row, x[n], swept[n], edges[n], inside != 0);
                let (value, doubt) = signed(value, inside, least, band);
                out[n] = value;
                doubts |= doubt;
            }
            *mark = doubts != 0;
        }
    }
}

/// Unsigned distance of one voxel; NaN where it rests on an edge distance that is.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "the one rounding of the stored value"
)]
pub(super) fn combined(row: CapRow, x: f64, swept: f32, edge: f32, inside: bool) -> f32 {
    let across = larger(row.across, x);
    let edge = f64::from(if edge < 0.0 { 0.0 } else { edge });
    let cap = (across * across + edge * edge).sqrt() as f32;
    let across = across as f32;
    let swept = swept.abs();
    let turned = row.sense * across < -row.guard;
    let nearer = across.abs() >= swept || cap >= swept;
    if if inside { nearer } else { turned } {
        swept
    } else {
        cap
    }
}
