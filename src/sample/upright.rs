//! Occupancy of bodies whose axis is parallel to grid z, a layer at a time.
//!
//! A layer of such a body is made of rings: the radii where its height crosses the profile serve all its rows. The
//! voxels of a row within a radius are those between two ends, found for all rows at once:
//!
//! ```text
//!   |i - c| <= sqrt(R² - y²) / h      i the voxel's number in the row, c that of the axis, h the spacing
//! ```
//!
//! once with R² - y² less its rounding and once with it more. Voxels that only the second has, hardly ever any, are
//! asked one by one. A wedge is the same in all layers and is kept as bits.

use super::bits;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real, Side};
use crate::solid::{Cuts, LayerCuts, Revolved, Ring, Row, Turn};

/// Rows of a grid as one upright body sees them.
#[derive(Debug)]
pub(super) struct UprightBody {
    /// Squared distance of each row from the axis, in the region's unit.
    squares: Vec<f64>,
    /// Place of the axis in a row, in voxels.
    centre: f64,
    /// Voxels for a unit of length.
    per_length: f64,
    /// Rounding of a place in a row, in voxels.
    slack: f64,
    columns: usize,
    wedge: Option<Vec<u64>>,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct UprightScratch {
    /// For each row: from and to, surely; and from and to, perhaps.
    ends: [Vec<i32>; 4],
}

/// Rounding of a squared half chord, relative to its terms.
const SQUARE_ROUNDING: f64 = 64.0 * f64::EPSILON;

impl UprightBody {
    /// The rows of `grid`; `None` where the body's axis is not parallel to grid z or the numbers leave no room.
    pub(super) fn new(body: &Revolved, grid: &GridSpec) -> Option<Self> {
        if !body.rows().is_upright() {
            return None;
        }
        let [nx, ny, _] = grid.dims();
        let frame = body.frame();
        let scale = frame.scale();
        let axis = frame.origin_exact();
        let away = |c: usize, index: usize| (Dd::of(grid.centre_along(c, index)) - axis[c]).f64();
        let squares = (0..ny).map(|j| (away(1, j) / scale).powi(2)).collect();
        let step = grid.spacing().x;
        let centre = -away(0, 0) / step;
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
            squares,
            centre,
            per_length: scale / step,
            slack,
            columns: nx,
            wedge: match body.turn() {
                Turn::Full => None,
                Turn::Partial(_) => Some(wedge_bits(body, grid)),
            },
        })
    }

    /// Flips, in bits that are 0, those of layer `k`'s voxels inside the body.
    pub(super) fn layer(
        &self,
        kernel: Kernel,
        body: &Revolved,
        grid: &GridSpec,
        k: usize,
        scratch: &mut UprightScratch,
        words: &mut [u64],
    ) {
        let rows = body.rows();
        let LayerCuts::Radii(radii) = rows.layer(grid.centre(0, 0, k)) else {
            return;
        };
        let rings = rows.rings(&radii, grid.centre(0, 0, k));
        let mut doubtful = Vec::new();
        for (n, ring) in rings.iter().enumerate() {
            let beyond = rings.get(n + 1).is_some_and(|r| r.side != Side::Outside);
            let changes = (ring.side != Side::Outside) != beyond;
            self.ends(kernel, ring, &mut scratch.ends);
            for j in 0..self.squares.len() {
                let [surely, before, perhaps, until] = scratch.ends.each_ref().map(|e| e[j]);
                let (first, at) = (j * self.columns, |i: i32| usize::try_from(i).unwrap_or(0));
                if changes {
                    bits::flip(words, first + at(surely), first + at(before));
                }
                if perhaps < surely || until > before {
                    // The voxels at either end, or all of a row that only touches.
                    let (left, right) = if surely < before {
                        (surely, before)
                    } else {
                        (until, until)
                    };
                    doubtful.extend((perhaps..left).chain(right..until).map(|i| [at(i), j]));
                }
            }
        }
        if let Some(wedge) = &self.wedge {
            for (word, mask) in words.iter_mut().zip(wedge) {
                *word &= mask;
            }
        }
        for [i, j] in doubtful {
            let inside = body.contains(grid.centre(i, j, k));
            bits::set(words, j * self.columns + i, inside);
        }
    }

    /// For each row the voxels within the ring's radius.
    fn ends(&self, kernel: Kernel, ring: &Ring, ends: &mut [Vec<i32>; 4]) {
        for list in &mut *ends {
            list.resize(self.squares.len(), 0);
        }
        let [low, high] = ring.radius;
        let (square, width) = (high * high, (high - low.max(0.0)) * (2.0 * high));
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^30")]
        let last = self.columns as f64;
        let job = Ends {
            squares: &self.squares,
            ends: ends.each_mut().map(Vec::as_mut_slice),
            square,
            width,
            centre: self.centre,
            per_length: self.per_length,
            slack: self.slack,
            last,
        };
        match kernel.lanes() {
            Some(arch) => arch.dispatch(job),
            None => job.run(),
        }
    }
}

/// One radius and all rows.
struct Ends<'a> {
    squares: &'a [f64],
    ends: [&'a mut [i32]; 4],
    square: f64,
    width: f64,
    centre: f64,
    per_length: f64,
    slack: f64,
    last: f64,
}

impl pulp::NullaryFnOnce for Ends<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.run();
    }
}

impl Ends<'_> {
    /// Lists of one length each, so that the compiler uses its lanes.
    #[inline(always)]
    fn run(self) {
        let [a, b, c, d] = self.ends;
        let n = self.squares.len();
        let (a, b, c, d) = (&mut a[..n], &mut b[..n], &mut c[..n], &mut d[..n]);
        for j in 0..n {
            let y2 = self.squares[j];
            let difference = self.square - y2;
            let rounding = SQUARE_ROUNDING * (self.square + y2) + self.width;
            let most = (difference + rounding).max(0.0).sqrt() * self.per_length;
            let least = (difference - rounding).max(0.0).sqrt() * self.per_length;
            // A row out of reach has no end at all.
            let reach = if difference + rounding < 0.0 {
                -1.0
            } else {
                self.slack
            };
            a[j] = place((self.centre - least + self.slack).ceil(), self.last);
            b[j] = place((self.centre + least - self.slack).floor() + 1.0, self.last);
            c[j] = place((self.centre - most - reach).ceil(), self.last);
            d[j] = place((self.centre + most + reach).floor() + 1.0, self.last);
        }
    }
}

#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "clamped to the row")]
fn place(v: f64, last: f64) -> i32 {
    v.max(0.0).min(last) as i32
}

/// The voxels of any layer that a body's wedge holds.
fn wedge_bits(body: &Revolved, grid: &GridSpec) -> Vec<u64> {
    let [nx, ny, _] = grid.dims();
    let mut words = vec![0; bits::words_for(nx * ny)];
    let mut cuts = Cuts::default();
    for j in 0..ny {
        let row = Row {
            first: grid.centre(0, j, 0),
            step: grid.spacing().x,
            count: nx,
        };
        cuts.reset(nx);
        body.rows().wedge_cuts(&row, &mut cuts);
        cuts.runs(|from, to| {
            let middle = grid.centre(from + (to - from) / 2, j, 0);
            if body.wedge_side(middle) != Side::Outside {
                bits::flip(&mut words, j * nx + from, j * nx + to + 1);
            }
        });
    }
    words
}
