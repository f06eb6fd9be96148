//! How deep a volume folds over itself.
//!
//! Where a map is singular on purpose (the corners of a biquadratic disc, an axis, an apex) its
//! Jacobian determinant is 0, and control points that were rounded before they were written down make
//! it take either sign. Such a fold is no deeper than what the rounding could have made:
//!
//! ```text
//!   X + δ X':   |δ det| <= Σ_k |δ X_k| Π_{j ≠ k} |X_j|,      |δ X_k| <= 2 p_k δ R / h_k
//! ```
//!
//! with δ the rounding of a coordinate, p the degree, h the length of a span and R the ratio of the
//! weights. Where a fold is, `orientation` has proved; its depth is looked for from there, and on a
//! lattice, since folds of rounding are at corners and edges.

use crate::nurbs::{CellIndex, NurbsVolume};

/// Points of the lattice over a cell, less one, in each direction.
const PARTS: u32 = 8;

/// Largest share of the determinant that can pass for rounding, however few digits the numbers have.
const MOST: f64 = 1e-5;

/// The extremes of a Jacobian determinant that takes both signs.
pub(super) struct Fold {
    low: f64,
    high: f64,
    /// What a rounding of 1 may change the determinant by.
    slope: f64,
}

impl Fold {
    /// * `witnesses`: parameters where the determinant is positive, and where it is negative.
    /// * `cells`: the cells they are in.
    pub(super) fn new(
        volume: &NurbsVolume,
        witnesses: [[f64; 3]; 2],
        cells: [CellIndex; 2],
    ) -> Self {
        let mut found = Self {
            low: 0.0,
            high: 0.0,
            slope: 0.0,
        };
        let mut lengths = [0.0_f64; 3];
        let mut look = |at: [f64; 3]| -> f64 {
            let Ok(jacobian) = volume.jacobian(at) else {
                return f64::NAN;
            };
            for (length, column) in lengths.iter_mut().zip(jacobian.columns) {
                *length = length.max(column.iter().map(|x| x * x).sum::<f64>().sqrt());
            }
            found.low = found.low.min(jacobian.determinant);
            found.high = found.high.max(jacobian.determinant);
            jacobian.determinant
        };
        let spans = volume.knots().each_ref().map(|knots| {
            let spans: Vec<[f64; 2]> = knots.spans().map(|s| [s.start, s.end]).collect();
            spans
        });
        let boxes = |[i, j, k]: [usize; 3]| [spans[0][i], spans[1][j], spans[2][k]];
        for n in 0..spans.iter().map(Vec::len).product::<usize>() {
            let (a, b) = (spans[0].len(), spans[1].len());
            let within = boxes([n % a, n / a % b, n / (a * b)]);
            for n in 0..(PARTS + 1).pow(3) {
                let place = |d: u32| f64::from(n / d % (PARTS + 1)) / f64::from(PARTS);
                let shares = [place(1), place(PARTS + 1), place((PARTS + 1).pow(2))];
                look(std::array::from_fn(|k| {
                    let [a, b] = within[k];
                    (a + shares[k] * (b - a)).min(b)
                }));
            }
        }
        for ((at, cell), sign) in witnesses.into_iter().zip(cells).zip([1.0, -1.0]) {
            climb(at, boxes(cell.spans), |at| sign * look(at));
        }
        let weights = volume.weights().iter();
        let (least, most) =
            weights.fold((f64::INFINITY, 0.0_f64), |(a, b), &w| (a.min(w), b.max(w)));
        found.slope = (0..3)
            .map(|k| {
                let shortest = spans[k]
                    .iter()
                    .fold(f64::INFINITY, |m, [a, b]| m.min(b - a));
                #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
                let own = 2.0 * volume.degrees()[k] as f64 * (most / least) / shortest;
                own * lengths[(k + 1) % 3] * lengths[(k + 2) % 3]
            })
            .sum();
        found
    }

    /// The determinant of the rarer sign as a share of the other's; 1 where it is not a number.
    pub(super) fn share(&self) -> f64 {
        let share = self.low.abs().min(self.high) / self.low.abs().max(self.high);
        if share.is_finite() { share } else { 1.0 }
    }

    /// Whether coordinates off by at most `rounding` may have made the fold.
    pub(super) fn is_rounding(&self, rounding: impl FnOnce() -> f64) -> bool {
        self.share() <= MOST && self.low.abs().min(self.high) <= rounding() * self.slope
    }
}

/// Goes uphill from a place in a box, along the parameters, by ever smaller steps.
fn climb(mut at: [f64; 3], within: [[f64; 2]; 3], mut height: impl FnMut([f64; 3]) -> f64) {
    let mut best = height(at);
    let mut step = 0.25;
    while step > 1e-4 {
        let mut moved = false;
        for k in 0..3 {
            for sign in [-1.0, 1.0] {
                let [a, b] = within[k];
                let mut next = at;
                next[k] = (at[k] + sign * step * (b - a)).clamp(a, b);
                let found = height(next);
                if found > best {
                    (at, best, moved) = (next, found, true);
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
}

/// The rounding of coordinates, as far as it shows in their digits: half a unit in the last place that
/// the one with the most digits has, were it as large as the largest.
///
/// ```text
///   0.353553, 2.646447   seven digits, the largest below 10    5e-7
/// ```
pub(super) fn rounding<'a, const N: usize>(points: impl Iterator<Item = &'a [f64; N]>) -> f64 {
    let (mut digits, mut largest) = (1_i32, 0.0_f64);
    for &x in points.flatten() {
        largest = largest.max(x.abs());
        let shown = format!("{x:e}");
        let mantissa = shown.split('e').next().unwrap_or_default();
        let count = mantissa.bytes().filter(u8::is_ascii_digit).count();
        digits = digits.max(i32::try_from(count).unwrap_or(17));
    }
    if largest == 0.0 {
        return 0.0;
    }
    #[allow(clippy::cast_possible_truncation, reason = "a decimal exponent")]
    let exponent = largest.log10().floor() as i32;
    let half = 0.5 * 10.0_f64.powi(exponent + 1 - digits);
    half.max(8.0 * f64::EPSILON * largest)
}

#[cfg(test)]
mod tests {
    use super::rounding;

    #[test]
    fn rounding_shows_in_the_digits() {
        let of = |numbers: &[f64]| rounding(numbers.iter().map(std::array::from_ref));
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(near(of(&[0.353_553, 2.646_447, -1.0]), 5e-7));
        assert!(near(of(&[35.3553, 0.035_355_3]), 5e-5));
        assert!(near(of(&[1.0 / 3.0, 1.0]), 8.0 * f64::EPSILON));
        assert_eq!(of(&[0.0]), 0.0);
    }
}
