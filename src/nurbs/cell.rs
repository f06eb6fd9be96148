//! Rational Bézier cells: one polynomial piece of a surface or a volume.
//!
//! ```text
//!   X(t) = Σ B_i(t_1) B_j(t_2) .. A_ij.. / Σ B_i(t_1) B_j(t_2) .. w_ij..        t in [0, 1]^N
//!
//!   split      de Casteljau in one direction; the halves share the layer between them
//!   restrict   what lies between two parameters, again over [0, 1]
//!   elevate    the same map with one degree raised
//!   face       the layer at an end of one parameter: a cell with a parameter less
//! ```
//!
//! * Shapes: homogeneous control points, the first index fastest, (p_1 + 1)(p_2 + 1).. of them.
//! * Accuracy: de Casteljau's means with positive factors; each level rounds a point by a few units
//!   in the last place.
//! * Source: G. Farin, *Curves and Surfaces for CAGD*, 5th ed., chapter 14.

use super::curve::bounds;
use super::knot_vector::check_degree;
use super::net::{map_rows, window};
use super::tensor_derivatives::derivatives;
use super::{Homogeneous, KnotVector, NurbsError, NurbsTensor, RationalBezier, TensorDerivatives};

/// A rational Bézier map of N parameters, each in [0, 1], into space.
///
/// A value that exists is valid: degrees from 1 to [`MAX_DEGREE`](super::MAX_DEGREE), weights finite
/// and greater than zero, coordinates finite.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierCell<const N: usize> {
    degrees: [usize; N],
    points: Vec<Homogeneous<3>>,
}

impl<const N: usize> BezierCell<N> {
    /// The cell with these homogeneous control points.
    ///
    /// # Errors
    /// [`NurbsError::Degree`], [`NurbsError::Length`], [`NurbsError::Weight`],
    /// [`NurbsError::ControlPoint`].
    pub fn new(degrees: [usize; N], points: Vec<Homogeneous<3>>) -> Result<Self, NurbsError> {
        for degree in degrees {
            check_degree(degree)?;
        }
        let expected = degrees.iter().map(|p| p + 1).product();
        if points.len() != expected {
            return Err(NurbsError::Length {
                what: "control points",
                found: points.len(),
                expected,
            });
        }
        for (index, h) in points.iter().enumerate() {
            h.checked(index)?;
        }
        Ok(Self { degrees, points })
    }

    /// The degrees.
    #[must_use]
    pub fn degrees(&self) -> [usize; N] {
        self.degrees
    }

    /// The homogeneous control points, the first index fastest.
    #[must_use]
    pub fn control_points(&self) -> &[Homogeneous<3>] {
        &self.points
    }

    /// Control points along each parameter: the degrees and one.
    #[must_use]
    pub fn counts(&self) -> [usize; N] {
        self.degrees.map(|p| p + 1)
    }

    /// Least and greatest coordinates of the control points, in model units: a box that holds the
    /// cell.
    #[must_use]
    pub fn control_bounds(&self) -> ([f64; 3], [f64; 3]) {
        bounds(self.points.iter().map(|h| h.to_point()))
    }

    /// The point at `t`, in model units.
    ///
    /// * `t`: parameters, each from 0 to 1.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside [0, 1] or NaN.
    ///
    /// ```
    /// # use voxlathe::nurbs::{BezierCell, Homogeneous};
    /// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let points = corners.map(|p| Homogeneous::from_point(p, 1.0)).to_vec();
    /// let saddle = BezierCell::new([1, 1], points)?;
    /// assert_eq!(saddle.evaluate([0.5, 0.5])?, [0.5, 0.5, 0.25]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn evaluate(&self, t: [f64; N]) -> Result<[f64; 3], NurbsError> {
        Ok(self.derived(t, [0; N])?.to_point())
    }

    /// The point and its first and second derivatives by the cell's parameters.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside [0, 1] or NaN.
    pub fn derivatives(&self, t: [f64; N]) -> Result<TensorDerivatives<N>, NurbsError> {
        let value = self.derived(t, [0; N])?;
        let mut first = [Homogeneous::ZERO; N];
        let mut second = [[Homogeneous::ZERO; N]; N];
        for a in 0..N {
            let mut orders = [0; N];
            orders[a] += 1;
            first[a] = self.derived(t, orders)?;
            for b in a..N {
                orders[b] += 1;
                second[a][b] = self.derived(t, orders)?;
                orders[b] -= 1;
            }
        }
        Ok(derivatives(value, first, |a, b| second[a][b]))
    }

    /// The homogeneous value at `t`, derived as often by each parameter as `orders` says.
    fn derived(&self, t: [f64; N], orders: [usize; N]) -> Result<Homogeneous<3>, NurbsError> {
        let mut net = (self.counts(), self.points.clone());
        for k in (0..N).rev() {
            check_local(t[k])?;
            net = map_rows(net.0, &net.1, k, |row| {
                let mut row = row.to_vec();
                let mut factor = 1.0;
                for _ in 0..orders[k] {
                    factor *= (row.len() - 1) as f64;
                    if row.len() == 1 {
                        row[0] = Homogeneous::ZERO;
                        break;
                    }
                    for i in 1..row.len() {
                        row[i - 1] = row[i].plus(-1.0, row[i - 1]);
                    }
                    row.pop();
                }
                for r in (1..row.len()).rev() {
                    for i in 0..r {
                        row[i] = row[i].mix(1.0 - t[k], row[i + 1], t[k]);
                    }
                }
                vec![if factor == 1.0 {
                    row[0]
                } else {
                    Homogeneous::ZERO.plus(factor, row[0])
                }]
            });
        }
        Ok(net.1[0])
    }

    /// The cells before and after `t` in one direction, each over its own [0, 1].
    ///
    /// The last layer of the first is, exactly, the first of the second.
    ///
    /// # Errors
    /// [`NurbsError::Direction`]; [`NurbsError::OutsideDomain`] when `t` is outside [0, 1] or NaN; at
    /// 0 or 1 one part has no extent.
    ///
    /// # Source
    /// Piegl & Tiller, §1.7 (de Casteljau).
    ///
    /// ```
    /// # use voxlathe::nurbs::{BezierCell, Homogeneous};
    /// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let points = corners.map(|p| Homogeneous::from_point(p, 1.0)).to_vec();
    /// let (before, after) = BezierCell::new([1, 1], points)?.split(0, 0.5)?;
    /// assert_eq!(before.evaluate([1.0, 0.5])?, after.evaluate([0.0, 0.5])?);
    /// assert_eq!(after.evaluate([0.5, 1.0])?, [0.75, 1.0, 0.75]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn split(&self, direction: usize, t: f64) -> Result<(Self, Self), NurbsError> {
        check_direction::<N>(direction)?;
        check_local(t)?;
        let part = |after: bool| {
            let (_, points) = map_rows(self.counts(), &self.points, direction, |row| {
                let mut right = row.to_vec();
                let mut left = Vec::with_capacity(row.len());
                // After level r, right[..] holds the level in front and the right edge behind.
                for r in 0..row.len() {
                    left.push(right[0]);
                    for i in 0..row.len() - 1 - r {
                        right[i] = right[i].mix(1.0 - t, right[i + 1], t);
                    }
                }
                if after { right } else { left }
            });
            Self::new(self.degrees, points)
        };
        Ok((part(false)?, part(true)?))
    }

    /// The part of the cell over the box from `low` to `high`, over its own [0, 1]^N.
    ///
    /// # Errors
    /// [`NurbsError::Interval`] unless `0 <= low < high <= 1` in each parameter.
    pub fn restrict(&self, low: [f64; N], high: [f64; N]) -> Result<Self, NurbsError> {
        let mut cell = self.clone();
        for k in 0..N {
            let (start, end) = (low[k], high[k]);
            if !(start >= 0.0 && start < end && end <= 1.0) {
                return Err(NurbsError::Interval { start, end });
            }
            if end < 1.0 {
                cell = cell.split(k, end)?.0;
            }
            if start > 0.0 {
                cell = cell.split(k, start / end)?.1;
            }
        }
        Ok(cell)
    }

    /// The same map with the degree of one direction raised by one.
    ///
    /// # Errors
    /// [`NurbsError::Direction`]; [`NurbsError::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE).
    ///
    /// # Source
    /// Piegl & Tiller, equation (5.34), p. 203.
    pub fn elevate(&self, direction: usize) -> Result<Self, NurbsError> {
        check_direction::<N>(direction)?;
        let q = self.degrees[direction] + 1;
        check_degree(q)?;
        let (counts, points) = map_rows(self.counts(), &self.points, direction, |row| {
            let mean = |i: usize| {
                let share = i as f64 / q as f64;
                row[i - 1].mix(share, row[i], (q - i) as f64 / q as f64)
            };
            let inner = (1..q).map(mean);
            std::iter::once(row[0])
                .chain(inner)
                .chain(std::iter::once(row[q - 1]))
                .collect()
        });
        Self::new(counts.map(|n| n - 1), points)
    }

    /// The cell as a spline over the box from `start` to `end`.
    ///
    /// # Errors
    /// [`NurbsError::Interval`] unless `start < end`, and those of [`KnotVector::reparametrized`].
    pub fn to_spline(&self, start: [f64; N], end: [f64; N]) -> Result<NurbsTensor<N>, NurbsError> {
        let mut knots = Vec::with_capacity(N);
        for k in 0..N {
            let unit = KnotVector::bezier(self.degrees[k])?;
            knots.push(unit.reparametrized(start[k], end[k])?);
        }
        match <[KnotVector; N]>::try_from(knots) {
            Ok(knots) => NurbsTensor::from_homogeneous(knots, &self.points),
            Err(_) => unreachable!("one for each parameter"),
        }
    }

    /// The control points of the layer at an end of one parameter, the others in their order.
    fn layer(&self, direction: usize, last: bool) -> Vec<Homogeneous<3>> {
        let mut first = [0; N];
        let mut size = self.counts();
        if last {
            first[direction] = size[direction] - 1;
        }
        size[direction] = 1;
        window(self.counts(), &self.points, first, size)
    }
}

impl BezierCell<3> {
    /// The six faces: u = 0, u = 1, v = 0, v = 1, w = 0, w = 1.
    ///
    /// Their parameters are ordered so that, where the Jacobian determinant is positive, the normal
    /// X_s × X_t points out of the cell:
    ///
    /// ```text
    ///   u = 0: (w, v)     v = 0: (u, w)     w = 0: (v, u)
    ///   u = 1: (v, w)     v = 1: (w, u)     w = 1: (u, v)
    /// ```
    #[must_use]
    pub fn faces(&self) -> [BezierCell<2>; 6] {
        std::array::from_fn(|face| {
            let (direction, last) = (face / 2, face % 2 == 1);
            let others = [[1, 2], [0, 2], [0, 1]][direction].map(|k| self.degrees[k]);
            let points = self.layer(direction, last);
            let cell = BezierCell {
                degrees: others,
                points,
            };
            // In index order the layer at the end looks out for u and w, and in for v.
            if last == (direction == 1) {
                cell.swapped()
            } else {
                cell
            }
        })
    }
}

impl BezierCell<2> {
    /// The same patch with its parameters swapped.
    #[must_use]
    pub fn swapped(&self) -> Self {
        let (counts, points) = super::net::permuted(self.counts(), &self.points, [1, 0]);
        Self {
            degrees: counts.map(|n| n - 1),
            points,
        }
    }

    /// The four edges, in the direction of their parameter: u = 0, u = 1, v = 0, v = 1.
    ///
    /// # Errors
    /// None for a cell that exists.
    pub fn edges(&self) -> Result<[RationalBezier<3>; 4], NurbsError> {
        let edge = |i: usize| RationalBezier::new(self.layer(i / 2, i % 2 == 1));
        Ok([edge(0)?, edge(1)?, edge(2)?, edge(3)?])
    }
}

/// The direction, when a cell of N parameters has it.
fn check_direction<const N: usize>(direction: usize) -> Result<(), NurbsError> {
    if direction < N {
        Ok(())
    } else {
        Err(NurbsError::Direction {
            found: direction,
            limit: N,
        })
    }
}

fn check_local(t: f64) -> Result<(), NurbsError> {
    if (0.0..=1.0).contains(&t) {
        Ok(())
    } else {
        Err(NurbsError::OutsideDomain {
            parameter: t,
            start: 0.0,
            end: 1.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tensor_testing::maps;
    use super::super::testing::{gamma, gap};
    use super::*;
    use proptest::prelude::*;

    fn cells() -> impl Strategy<Value = BezierCell<3>> {
        maps::<3>().prop_map(|map| map.to_bezier().expect("finite").swap_remove(0).cell)
    }

    fn size(cell: &BezierCell<3>) -> f64 {
        let (low, high) = cell.control_bounds();
        low.iter().chain(&high).fold(0.0, |m, x| x.abs().max(m))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn parts_and_elevations_are_the_cell(
            cell in cells(), k in 0..3_usize, at in 0.1..0.9_f64,
            t in prop::array::uniform3(0.0..=1.0_f64),
        ) {
            let bound = size(&cell) * 8.0 * gamma(120);
            let [before, after] = <[_; 2]>::from(cell.split(k, at).expect("inside"));
            let mut there = t;
            there[k] = at * t[k];
            let expected = cell.evaluate(there).expect("inside");
            prop_assert!(gap(before.evaluate(t).expect("inside"), expected) <= bound);
            there[k] = (at + (1.0 - at) * t[k]).min(1.0);
            let expected = cell.evaluate(there).expect("inside");
            prop_assert!(gap(after.evaluate(t).expect("inside"), expected) <= bound);
            let (low, high) = ([0.25, 0.0, 0.5], [0.75, 0.5, 1.0]);
            let part = cell.restrict(low, high).expect("a box");
            let there = std::array::from_fn(|k| low[k] + t[k] * (high[k] - low[k]));
            let expected = cell.evaluate(there).expect("inside");
            prop_assert!(gap(part.evaluate(t).expect("inside"), expected) <= bound);
            let expected = cell.evaluate(t).expect("inside");
            let raised = cell.elevate(k).expect("low degree");
            prop_assert_eq!(raised.degrees()[k], cell.degrees()[k] + 1);
            prop_assert!(gap(raised.evaluate(t).expect("inside"), expected) <= bound);
            let spline = cell.to_spline([0.0; 3], [1.0; 3]).expect("an interval");
            prop_assert!(gap(spline.evaluate(t).expect("inside"), expected) <= bound);
            let (low, high) = cell.control_bounds();
            for i in 0..3 {
                prop_assert!(expected[i] >= low[i] - bound && expected[i] <= high[i] + bound);
            }
        }

        #[test]
        fn derivatives_are_those_of_the_spline(
            cell in cells(), t in prop::array::uniform3(0.0..=1.0_f64),
        ) {
            let spline = cell.to_spline([0.0; 3], [1.0; 3]).expect("an interval");
            let found = cell.derivatives(t).expect("inside");
            let expected = spline.hessian(t).expect("inside");
            // Weights differ a hundredfold at most, and each derivative has a factor of degree 3.
            let bound = size(&cell) * gamma(200) * 1e6;
            for a in 0..3 {
                prop_assert!(gap(found.first[a], expected.first[a]) <= bound);
                for b in 0..3 {
                    prop_assert!(gap(found.second[a][b], expected.second[a][b]) <= bound * 1e2);
                }
            }
        }

        #[test]
        fn faces_are_layers(cell in cells(), s in 0.0..=1.0_f64, t in 0.0..=1.0_f64) {
            let bound = size(&cell) * 4.0 * gamma(100);
            let places = [
                [0.0, t, s], [1.0, s, t], [s, 0.0, t], [t, 1.0, s], [t, s, 0.0], [s, t, 1.0],
            ];
            for (face, at) in cell.faces().iter().zip(places) {
                let found = face.evaluate([s, t]).expect("inside");
                prop_assert!(gap(found, cell.evaluate(at).expect("inside")) <= bound);
                let edges = face.edges().expect("valid");
                let found = edges[1].evaluate(t).expect("inside");
                prop_assert!(gap(found, face.evaluate([1.0, t]).expect("inside")) <= bound);
                let found = edges[2].evaluate(s).expect("inside");
                prop_assert!(gap(found, face.evaluate([s, 0.0]).expect("inside")) <= bound);
            }
        }
    }

    #[test]
    fn wrong_questions_are_errors() {
        let points = vec![Homogeneous::from_point([1.0, 2.0, 3.0], 1.0); 4];
        let cell = BezierCell::new([1, 1], points).expect("valid");
        assert!(cell.evaluate([0.5, 1.5]).is_err() && cell.evaluate([f64::NAN, 0.5]).is_err());
        assert!(cell.split(2, 0.5).is_err() && cell.split(0, -0.5).is_err());
        assert!(cell.restrict([0.5, 0.0], [0.5, 1.0]).is_err());
        assert!(cell.elevate(5).is_err());
    }
}
