//! Occupancy of bodies whose axis is parallel to grid z, a layer at a time.
//!
//! A layer of such a body is made of rings: the radii where its height crosses the profile serve all its rows. The
//! voxels of a row within a radius are those between two ends, found for all rows at once:
//!
//! ```text
//!   |i - c| <= m,   m = sqrt(D) / h,   D = R² - y²      i the voxel's number, c the axis's, h the spacing
//! ```
//!
//! D is known up to its rounding w, and m up to `w / (h sqrt(D))`, since `sqrt(D) - sqrt(D - w) <= w / sqrt(D)`, where
//! m is at least a voxel. A voxel that the bounds leave open, hardly ever any, is asked alone, and
//! so are the few of a row that the circle only touches. A row and the one that mirrors it have the same ends. A
//! wedge is the same in all layers and is kept as bits.

use super::bits::{self, SideBits};
use super::wedge::Wedge;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real, Side};
use crate::solid::{LayerCuts, Revolved, Ring, Turn};

/// Rows of a grid as one upright body sees them.
#[derive(Debug)]
pub(super) struct UprightBody {
    /// Squared distance from the axis, in voxels, of each row up to the one in the middle, or of all where the axis
    /// is not in their middle.
    squares: Vec<f64>,
    /// The greatest of them.
    widest: f64,
    /// How much a row and the one that mirrors it differ, in voxels.
    asymmetry: f64,
    /// Place of the axis in a row, in voxels.
    centre: f64,
    /// Voxels for a unit of length.
    per_length: f64,
    /// Rounding of a place in a row, in voxels.
    slack: f64,
    columns: usize,
    rows: usize,
    wedge: Option<Wedge>,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct UprightScratch {
    /// For each row its first voxel and the one after its last.
    ends: [Vec<i32>; 2],
    /// For each row whether other ends are possible.
    open: Vec<i32>,
}

/// Rounding of a squared radius or row, relative to the radius's.
const SQUARE_ROUNDING: f64 = 128.0 * f64::EPSILON;
/// Asymmetry of the rows that is left to the brackets, in voxels.
const ALIKE: f64 = 1e-9;

impl UprightBody {
    /// The rows of `grid`; `None` where the body's axis is not parallel to grid z or the numbers leave no room.
    pub(super) fn new(body: &Revolved, grid: &GridSpec) -> Option<Self> {
        if !body.rows().is_upright() {
            return None;
        }
        let [nx, ny, _] = grid.dims();
        let frame = body.frame();
        let axis = frame.origin_exact();
        let step = grid.spacing().x;
        let away =
            |c: usize, index: usize| (Dd::of(grid.centre_along(c, index)) - axis[c]).f64() / step;
        let rows: Vec<f64> = (0..ny).map(|j| away(1, j)).collect();
        let pairs = rows.iter().zip(rows.iter().rev());
        let asymmetry = pairs.fold(0.0_f64, |m, (a, b)| m.max((a + b).abs()));
        let mirrored = asymmetry <= ALIKE;
        let kept = if mirrored { ny.div_ceil(2) } else { ny };
        let centre = -away(0, 0);
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
        let last = nx as f64;
        let far = grid
            .centre(0, 0, 0)
            .x
            .abs()
            .max(grid.centre(nx - 1, 0, 0).x.abs());
        // Centres are rounded in the world, and the axis's place in the row once.
        let slack = 4.0 * f64::EPSILON * far / step + 16.0 * f64::EPSILON * (centre.abs() + last);
        (slack < 0.25 && nx < 1 << 30).then(|| Self {
            squares: rows[..kept].iter().map(|y| y * y).collect(),
            widest: rows.iter().fold(0.0, |m, y| (y * y).max(m)),
            asymmetry: if mirrored { asymmetry } else { 0.0 },
            centre,
            per_length: frame.scale() / step,
            slack,
            columns: nx,
            rows: ny,
            wedge: match body.turn() {
                Turn::Full => None,
                Turn::Partial(_) => Some(Wedge::new(body, grid, 0)),
            },
        })
    }

    /// Sets, in bits that are 0, the sides of layer `k`'s voxels.
    pub(super) fn layer(
        &self,
        kernel: Kernel,
        body: &Revolved,
        grid: &GridSpec,
        k: usize,
        scratch: &mut UprightScratch,
        sides: &mut SideBits<'_>,
    ) {
        let rows = body.rows();
        let LayerCuts::Radii(radii) = rows.layer(grid.centre(0, 0, k)) else {
            return;
        };
        let rings = rows.rings(&radii, grid.centre(0, 0, k));
        let mut doubtful = Vec::new();
        for (n, ring) in rings.iter().enumerate() {
            let beyond = rings.get(n + 1).map_or(Side::Outside, |r| r.side);
            let circle = self.circle(ring);
            let any_open = self.ends(kernel, &circle, scratch);
            if (ring.side == Side::Outside) != (beyond == Side::Outside) {
                self.flip(scratch, sides.inside);
            }
            if (ring.side == Side::On) != (beyond == Side::On)
                && let Some(on) = sides.on()
            {
                self.flip(scratch, on);
            }
            if any_open {
                for (j, _) in scratch.open.iter().enumerate().filter(|(_, o)| **o != 0) {
                    let ends = scratch.ends.each_ref().map(|e| e[j]);
                    self.doubts(&circle, j, ends, &mut doubtful);
                }
            }
        }
        if let Some(wedge) = &self.wedge {
            wedge.narrow(sides);
        }
        for [i, j] in doubtful {
            sides.set(j * self.columns + i, body.side(grid.centre(i, j, k)));
        }
    }

    /// The row that mirrors row `j` of those kept.
    fn twin(&self, j: usize) -> Option<usize> {
        let twin = self.rows - 1 - j;
        (self.squares.len() < self.rows && twin != j).then_some(twin)
    }

    /// Flips the voxels between the ends.
    fn flip(&self, scratch: &UprightScratch, words: &mut [u64]) {
        let [from, to] = &scratch.ends;
        for (j, (&from, &to)) in from.iter().zip(to).enumerate() {
            if from >= to {
                continue;
            }
            let [from, to] = [from, to].map(|i| usize::try_from(i).unwrap_or(0));
            bits::flip(words, j * self.columns + from, j * self.columns + to);
            if let Some(twin) = self.twin(j) {
                bits::flip(words, twin * self.columns + from, twin * self.columns + to);
            }
        }
    }

    /// The voxels of row `j` and its twin that the bounds leave open.
    fn doubts(&self, circle: &Circle, j: usize, [from, to]: [i32; 2], out: &mut Vec<[usize; 2]>) {
        let most = (circle.square - self.squares[j] + circle.rounding)
            .max(0.0)
            .sqrt();
        let reach = most + circle.slack;
        let first = place((self.centre - reach).ceil(), circle.last);
        let last = place((self.centre + reach).floor() + 1.0, circle.last);
        // The voxels at either end, or all of a row that only touches.
        let (left, right) = if from < to { (from, to) } else { (last, last) };
        for i in (first..left).chain(right..last) {
            let i = usize::try_from(i).unwrap_or(0);
            out.extend(std::iter::once(j).chain(self.twin(j)).map(|j| [i, j]));
        }
    }

    /// A ring's outer circle in voxels.
    fn circle(&self, ring: &Ring) -> Circle {
        let [low, high] = ring.radius.map(|r| r.max(0.0) * self.per_length);
        let square = high * high;
        let rounding = 2.0 * SQUARE_ROUNDING * square
            + 2.0 * high * (high - low)
            + (2.0 * high + self.asymmetry) * self.asymmetry;
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^30")]
        let last = self.columns as f64;
        // Every half chord of a voxel or more is at least this long.
        let shortest = (square - self.widest).max(1.0).sqrt();
        Circle {
            square,
            rounding,
            slack: self.slack + rounding / shortest,
            centre: self.centre,
            last,
        }
    }

    /// For each row the voxels surely within the circle; whether any row has others that may be.
    fn ends(&self, kernel: Kernel, circle: &Circle, scratch: &mut UprightScratch) -> bool {
        for list in scratch.ends.iter_mut().chain([&mut scratch.open]) {
            list.resize(self.squares.len(), 0);
        }
        let job = Ends {
            squares: &self.squares,
            ends: scratch.ends.each_mut().map(Vec::as_mut_slice),
            open: &mut scratch.open,
            circle,
        };
        kernel.dispatch(job)
    }
}

/// A circle around the axis, in voxels.
#[derive(Debug, Clone, Copy)]
struct Circle {
    /// Squared radius.
    square: f64,
    /// What the square of a half chord may err by.
    rounding: f64,
    /// What the end of a chord longer than two voxels may err by.
    slack: f64,
    /// Place of the axis in a row.
    centre: f64,
    /// Voxels of a row.
    last: f64,
}

/// One circle and all rows.
struct Ends<'a> {
    squares: &'a [f64],
    ends: [&'a mut [i32]; 2],
    open: &'a mut [i32],
    circle: &'a Circle,
}

impl pulp::NullaryFnOnce for Ends<'_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        // Lists of one length each, so that the compiler uses its lanes.
        let Circle {
            square,
            rounding,
            slack,
            centre,
            last,
        } = *self.circle;
        let n = self.squares.len();
        let [from, to] = self.ends;
        let (from, to, open) = (&mut from[..n], &mut to[..n], &mut self.open[..n]);
        let mut any = 0;
        for j in 0..n {
            let difference = square - self.squares[j];
            let half = difference.max(0.0).sqrt();
            let a = place((centre - half + slack).ceil(), last);
            let b = place((centre + half - slack).floor() + 1.0, last);
            let c = place((centre - half - slack).ceil(), last);
            let d = place((centre + half + slack).floor() + 1.0, last);
            // A short chord is left open as a whole, a row out of reach has none.
            let long = difference >= 1.0;
            let reached = i32::from(difference + rounding >= 0.0);
            from[j] = if long { a } else { 0 };
            to[j] = if long { b } else { 0 };
            open[j] = if long { (a - c) | (d - b) } else { reached };
            any |= open[j];
        }
        any != 0
    }
}

#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "clamped to the row; the low bits of 1.5 * 2^52 and a number are the number"
)]
fn place(v: f64, last: f64) -> i32 {
    const LOW_BITS: f64 = 6_755_399_441_055_744.0;
    (v.max(0.0).min(last) + LOW_BITS).to_bits() as i32
}
