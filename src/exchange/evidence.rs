//! Whether coordinates are premultiplied by their weights: what the numbers themselves say.
//!
//! Neighbours in a control net often share a coordinate: all points of a ring have one height, the
//! corner of a square round a circle has x from one neighbour and y from the other. Such agreements hold
//! for the true, Cartesian coordinates. Where neighbours have different weights, an agreement seen in
//! the numbers as they stand speaks for Cartesian coordinates, one seen after division by the weights
//! speaks for premultiplied ones, and chance gives neither.
//!
//! ```text
//!   for neighbours a, b with w_a != w_b, for each axis with a number that is not 0:
//!     Cartesian       if x_a = x_b              up to 1e-5, for files of six digits
//!     premultiplied   if x_a / w_a = x_b / w_b
//! ```
//!
//! The count decides about a note only, never about what is read.

use std::fmt;

/// Relative difference up to which two numbers of a six-digit file may be one.
const SAME: f64 = 1e-5;

/// How many coordinates of neighbours with different weights agree.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Agreement {
    /// As they stand in the file.
    pub(super) as_written: usize,
    /// After division by the weights.
    pub(super) divided: usize,
}

impl Agreement {
    /// Counts agreements in a net.
    ///
    /// * `raw`: coordinates as they stand, the first index fastest.
    /// * `weights`: as many, greater than zero.
    /// * `counts`: control points along each parameter; their product is the length of the lists.
    pub(super) fn of(raw: &[[f64; 3]], weights: &[f64], counts: &[usize]) -> Self {
        let same = |x: f64, y: f64| (x - y).abs() <= SAME * x.abs().max(y.abs());
        let mut found = Self::default();
        let mut stride = 1;
        for &count in counts {
            for a in 0..raw.len().saturating_sub(stride) {
                let b = a + stride;
                let (wa, wb) = (weights[a], weights[b]);
                if a / stride % count + 1 == count || same(wa, wb) {
                    continue;
                }
                for (x, y) in raw[a].into_iter().zip(raw[b]) {
                    if x == 0.0 && y == 0.0 {
                        continue;
                    }
                    found.as_written += usize::from(same(x, y));
                    found.divided += usize::from(same(x / wa, y / wb));
                }
            }
            stride *= count;
        }
        found
    }

    pub(super) fn speaks_for_cartesian(self) -> bool {
        self.as_written >= 2 * self.divided + 2
    }

    pub(super) fn speaks_for_premultiplied(self) -> bool {
        self.divided >= 2 * self.as_written + 2
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "neighbouring points of different weight share {} coordinates as they stand and {} after \
             division by the weights",
            self.as_written, self.divided
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The full circle of nine points, in the plane z = 5.
    fn circle(premultiplied: bool) -> (Vec<[f64; 3]>, Vec<f64>) {
        let corner = [
            (1, 0),
            (1, 1),
            (0, 1),
            (-1, 1),
            (-1, 0),
            (-1, -1),
            (0, -1),
            (1, -1),
            (1, 0),
        ];
        let weights: Vec<_> = (0..9)
            .map(|i| {
                if i % 2 == 0 {
                    1.0
                } else {
                    std::f64::consts::FRAC_1_SQRT_2
                }
            })
            .collect();
        let points = corner.iter().zip(&weights).map(|(&(x, y), &w)| {
            let factor = if premultiplied { w } else { 1.0 };
            [f64::from(x) * 3.0, f64::from(y) * 3.0, 5.0].map(|c| c * factor)
        });
        (points.collect(), weights)
    }

    #[test]
    fn a_circle_tells() {
        let (points, weights) = circle(false);
        let found = Agreement::of(&points, &weights, &[9]);
        assert_eq!((found.as_written, found.divided), (16, 0));
        assert!(found.speaks_for_cartesian() && !found.speaks_for_premultiplied());
        let (points, weights) = circle(true);
        let found = Agreement::of(&points, &weights, &[9]);
        assert_eq!((found.as_written, found.divided), (0, 16));
        assert!(found.speaks_for_premultiplied() && !found.speaks_for_cartesian());
    }

    #[test]
    fn equal_weights_and_row_ends_say_nothing() {
        let points = vec![[1.0, 2.0, 3.0]; 6];
        assert_eq!(
            Agreement::of(&points, &[0.5; 6], &[2, 3]),
            Agreement::default()
        );
        // Weights differ only between the end of one row and the start of the next one.
        let weights = [1.0, 1.0, 2.0, 2.0];
        let found = Agreement::of(&points[..4], &weights, &[2, 2]);
        assert_eq!(found.as_written, 6);
    }
}
