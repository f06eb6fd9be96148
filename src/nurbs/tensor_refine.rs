//! Other control nets for the same surface or volume, and its images under affine and projective
//! maps.
//!
//! A net is refined row by row: what [`refine`](super::refine_knots) does to a curve is done to
//! every row in one direction. A homogeneous point goes where a linear map of the 4-vectors sends it:
//!
//! ```text
//!   affine       P -> M P + b                   weights kept
//!   projective   (A, w) -> T (A, w)             T is 4 x 4; new weights are the fourth coordinates
//! ```
//!
//! * Shapes: directions are numbered from 0; nets have their first index fastest.
//! * Accuracy: refinement errs by at most 2 γ(5 L) of the largest coordinate for L layers of
//!   insertions; reversal and permutation move no bit of a control point.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §4.2 and §5.2 to §5.5.

use super::net::{permuted, try_map_rows};
use super::{
    Homogeneous, KnotVector, NurbsError, NurbsTensor, clamp, elevate_degree, refine_knots,
};

impl<const N: usize> NurbsTensor<N> {
    /// The same map with the knot `t` inserted `times` times in one direction.
    ///
    /// # Errors
    /// Those of [`insert_knot`](super::insert_knot), and [`NurbsError::Direction`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 0.0]];
    /// let sheet = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// let finer = sheet.insert_knot(1, 0.25, 1)?;
    /// assert_eq!(finer.counts(), [2, 3]);
    /// assert_eq!(finer.control_points()[3], [4.0, 1.0, 0.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn insert_knot(&self, direction: usize, t: f64, times: usize) -> Result<Self, NurbsError> {
        self.along(direction, |knots, row| {
            super::insert_knot(knots, row, t, times)
        })
    }

    /// The same map with all of `inserted` inserted in one direction.
    ///
    /// # Errors
    /// Those of [`refine_knots`], and [`NurbsError::Direction`].
    pub fn refine(&self, direction: usize, inserted: &[f64]) -> Result<Self, NurbsError> {
        self.along(direction, |knots, row| refine_knots(knots, row, inserted))
    }

    /// The same map, clamped in one direction, with the degree there raised `by` degrees.
    ///
    /// # Errors
    /// [`NurbsError::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE), [`NurbsError::Direction`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 0.0]];
    /// let sheet = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// let raised = sheet.elevate_degree(0, 1)?;
    /// assert_eq!(raised.degrees(), [2, 1]);
    /// assert_eq!(raised.control_points()[1], [2.0, 0.0, 0.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn elevate_degree(&self, direction: usize, by: usize) -> Result<Self, NurbsError> {
        self.along(direction, |knots, row| elevate_degree(knots, row, by))
    }

    /// The same map with clamped ends in every direction: unclamped and periodic ones are cut to
    /// their domain.
    ///
    /// # Errors
    /// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`] when a product of weights and factors
    /// leaves the range of f64.
    pub fn clamp(&self) -> Result<Self, NurbsError> {
        (0..N)
            .filter(|&k| !self.knots()[k].is_clamped())
            .try_fold(self.clone(), |map, k| map.along(k, clamp))
    }

    /// Whether every direction is clamped: the corners of the net are then those of the map.
    #[must_use]
    pub fn is_clamped(&self) -> bool {
        self.knots().iter().all(KnotVector::is_clamped)
    }

    /// The parts before and after the parameter `t` of one direction, clamped there, each over its
    /// part of the domain.
    ///
    /// The last layer of the first part is, exactly, the first of the second.
    ///
    /// # Errors
    /// [`NurbsError::Direction`]; [`NurbsError::OutsideDomain`]; [`NurbsError::SplitAtEnd`] at
    /// either end of the domain; [`NurbsError::SpanWidth`] too near a knot.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 8.0]];
    /// let saddle = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// let (before, after) = saddle.split(0, 0.5)?;
    /// assert_eq!(before.domain(), [(0.0, 0.5), (0.0, 1.0)]);
    /// assert_eq!(after.evaluate([0.5, 1.0])?, before.evaluate([0.5, 1.0])?);
    /// assert_eq!(after.evaluate([0.75, 0.5])?, [3.0, 2.0, 3.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn split(&self, direction: usize, t: f64) -> Result<(Self, Self), NurbsError> {
        let knots = self.direction(direction)?;
        knots.check_parameter(t)?;
        let (start, end) = knots.domain();
        if t == start || t == end {
            return Err(NurbsError::SplitAtEnd {
                parameter: t,
                start,
                end,
            });
        }
        let whole = self.along(direction, clamp)?;
        let knots = &whole.knots()[direction];
        let p = knots.degree();
        let more = p.saturating_sub(knots.multiplicity(t));
        let whole = whole.insert_knot(direction, t, more)?;
        let knots = whole.knots()[direction].knots();
        let first = knots.partition_point(|&k| k < t);
        let part = |knots: Vec<f64>, control: std::ops::Range<usize>| {
            let mut all = whole.knots().clone();
            all[direction] = KnotVector::from_valid(p, knots);
            let (_, points) =
                super::net::map_rows(whole.counts(), whole.control_points(), direction, |row| {
                    row[control.clone()].to_vec()
                });
            let (_, weights) =
                super::net::map_rows(whole.counts(), whole.weights(), direction, |row| {
                    row[control.clone()].to_vec()
                });
            Self::new(all, points, weights)
        };
        let before = [&knots[..first + p], &[t]].concat();
        let after = [&[t], &knots[first..]].concat();
        Ok((
            part(before, 0..first)?,
            part(after, first - 1..whole.counts()[direction])?,
        ))
    }

    /// The same point set with one parameter running the other way, u to a + b − u.
    ///
    /// The sign of a volume's Jacobian determinant changes, and so does the side of a surface's
    /// normal.
    ///
    /// # Errors
    /// [`NurbsError::Direction`]; those of [`KnotVector::reversed`].
    pub fn reverse(&self, direction: usize) -> Result<Self, NurbsError> {
        let mut knots = self.knots().clone();
        knots[self.checked_direction(direction)?] = self.direction(direction)?.reversed()?;
        let (_, points) =
            super::net::map_rows(self.counts(), self.control_points(), direction, |row| {
                row.iter().rev().copied().collect()
            });
        let (_, weights) = super::net::map_rows(self.counts(), self.weights(), direction, |row| {
            row.iter().rev().copied().collect()
        });
        Self::new(knots, points, weights)
    }

    /// The same point set with one parameter's domain mapped affinely to `[start, end]`.
    ///
    /// # Errors
    /// [`NurbsError::Direction`]; those of [`KnotVector::reparametrized`].
    pub fn reparametrize(
        &self,
        direction: usize,
        start: f64,
        end: f64,
    ) -> Result<Self, NurbsError> {
        let mut knots = self.knots().clone();
        knots[self.checked_direction(direction)?] =
            self.direction(direction)?.reparametrized(start, end)?;
        Self::new(
            knots,
            self.control_points().to_vec(),
            self.weights().to_vec(),
        )
    }

    /// The same point set with its parameters in another order: parameter k of the result is
    /// parameter `order[k]` of this map.
    ///
    /// Swapping two parameters changes the sign of a volume's Jacobian determinant.
    ///
    /// # Errors
    /// [`NurbsError::Direction`] unless `order` holds each of 0 to N − 1 once.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let points = (0..6).map(|i| [f64::from(i % 2), f64::from(i / 2), 0.0]).collect();
    /// let knots = [KnotVector::bezier(1)?, KnotVector::bezier(2)?];
    /// let sheet = NurbsSurface::new(knots, points, vec![1.0; 6])?;
    /// let swapped = sheet.permute([1, 0])?;
    /// assert_eq!(swapped.degrees(), [2, 1]);
    /// assert_eq!(swapped.evaluate([0.25, 0.5])?, sheet.evaluate([0.5, 0.25])?);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn permute(&self, order: [usize; N]) -> Result<Self, NurbsError> {
        for (place, &k) in order.iter().enumerate() {
            self.checked_direction(k)?;
            if order[..place].contains(&k) {
                return Err(NurbsError::Direction { found: k, limit: N });
            }
        }
        let (_, points) = permuted(self.counts(), self.control_points(), order);
        let (_, weights) = permuted(self.counts(), self.weights(), order);
        Self::new(order.map(|k| self.knots()[k].clone()), points, weights)
    }

    /// The image under the affine map P ↦ M P + b.
    ///
    /// * `matrix`: M by rows.
    /// * `translation`: b, in model units.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when an image is not finite.
    pub fn transform(
        &self,
        matrix: &[[f64; 3]; 3],
        translation: &[f64; 3],
    ) -> Result<Self, NurbsError> {
        let image = |point: &[f64; 3]| {
            std::array::from_fn(|row| {
                let product: f64 = (0..3).map(|i| matrix[row][i] * point[i]).sum();
                product + translation[row]
            })
        };
        Self::new(
            self.knots().clone(),
            self.control_points().iter().map(image).collect(),
            self.weights().to_vec(),
        )
    }

    /// The image under the projective map (A, w) ↦ T (A, w).
    ///
    /// * `matrix`: T by rows, for columns (x, y, z, w).
    ///
    /// # Errors
    /// [`NurbsError::Weight`] when a control point lands on the plane at infinity or beyond it;
    /// [`NurbsError::ControlPoint`] when an image is not finite.
    ///
    /// # Source
    /// Piegl & Tiller, §6.5 (projective transformations).
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsError, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 2.0], [4.0, 4.0, 2.0]];
    /// let sheet = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// // The perspective (x, y, z) -> (x / z, y / z, 1 / z).
    /// let mut t = [[0.0; 4]; 4];
    /// (t[0][0], t[1][1], t[2][3], t[3][2]) = (1.0, 1.0, 1.0, 1.0);
    /// let seen = sheet.project(&t)?;
    /// assert_eq!(seen.evaluate([1.0, 1.0])?, [2.0, 2.0, 0.5]);
    /// t[3][2] = -1.0;
    /// assert!(matches!(sheet.project(&t), Err(NurbsError::Weight { .. })));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn project(&self, matrix: &[[f64; 4]; 4]) -> Result<Self, NurbsError> {
        let image = |h: Homogeneous<3>| {
            let [x, y, z] = h.weighted;
            let of = |row: [f64; 4]| row[0] * x + row[1] * y + row[2] * z + row[3] * h.weight;
            let [x, y, z, weight] = matrix.map(of);
            Homogeneous {
                weighted: [x, y, z],
                weight,
            }
        };
        let points: Vec<_> = self.to_homogeneous().into_iter().map(image).collect();
        Self::from_homogeneous(self.knots().clone(), &points)
    }

    /// The knot vector of a direction.
    fn direction(&self, direction: usize) -> Result<&KnotVector, NurbsError> {
        self.knots().get(direction).ok_or(NurbsError::Direction {
            found: direction,
            limit: N,
        })
    }

    fn checked_direction(&self, direction: usize) -> Result<usize, NurbsError> {
        self.direction(direction).map(|_| direction)
    }

    /// `refine` done to every row of one direction.
    fn along(
        &self,
        direction: usize,
        refine: impl Fn(
            &KnotVector,
            &[Homogeneous<3>],
        ) -> Result<(KnotVector, Vec<Homogeneous<3>>), NurbsError>,
    ) -> Result<Self, NurbsError> {
        let old = self.direction(direction)?;
        let mut knots = self.knots().clone();
        let (_, points) = try_map_rows(self.counts(), &self.to_homogeneous(), direction, |row| {
            let (refined, points) = refine(old, row)?;
            knots[direction] = refined;
            Ok(points)
        })?;
        Self::from_homogeneous(knots, &points)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tensor_testing::{biquadratic, extent, inside, maps, sphere};
    use super::super::testing::{gamma, gap, parameter};
    use super::super::{NurbsSurface, NurbsVolume};
    use super::*;
    use proptest::prelude::*;

    /// Both maps at the same 27 or so parameters of the first one's domain.
    fn same<const N: usize>(
        a: &NurbsTensor<N>,
        b: &NurbsTensor<N>,
        layers: usize,
        t: [f64; N],
    ) -> Result<(), TestCaseError> {
        prop_assert_eq!(a.domain(), b.domain());
        let roundings: usize = a
            .degrees()
            .iter()
            .chain(&b.degrees())
            .map(|p| 9 * p + 9)
            .sum();
        // The quotient passes on errors of weights as large as they differ: a hundredfold here.
        let bound = extent(a) * (4.0 * gamma(roundings) + 4.0 * gamma(5 * layers + 4));
        for shift in [0.0, 0.33, 0.66] {
            let at = inside(a, t.map(|t| (t + shift) % 1.0));
            let [x, y] = [a, b].map(|m| m.evaluate(at).expect("inside"));
            prop_assert!(gap(x, y) <= bound, "{at:?}: {x:?}, {y:?}, bound {bound:e}");
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn refinement_leaves_the_points(
            map in maps::<2>(), k in 0..2_usize, at in 0.0..=1.0_f64,
            t in prop::array::uniform2(0.0..=1.0_f64),
        ) {
            let knots = &map.knots()[k];
            let u = parameter(knots, at);
            let room = knots.degree().saturating_sub(knots.multiplicity(u));
            let finer = map.insert_knot(k, u, room).expect("room for it");
            prop_assert_eq!(finer.counts()[k], map.counts()[k] + room);
            same(&map, &finer, room, t)?;
            same(&map, &map.refine(k, &vec![u; room]).expect("room"), room, t)?;
            let clamped = map.clamp().expect("finite");
            prop_assert!(clamped.is_clamped());
            same(&map, &clamped, 12, t)?;
            let raised = map.elevate_degree(k, 2).expect("low degree");
            prop_assert_eq!(raised.degrees()[k], map.degrees()[k] + 2);
            same(&map, &raised, 60, t)?;
        }

        #[test]
        fn volumes_are_refined_alike(
            map in maps::<3>(), k in 0..3_usize, t in prop::array::uniform3(0.0..=1.0_f64),
        ) {
            same(&map, &map.elevate_degree(k, 1).expect("low degree"), 40, t)?;
            same(&map, &map.clamp().expect("finite"), 18, t)?;
        }

        #[test]
        fn parts_share_their_layer(
            map in maps::<3>(), k in 0..3_usize, t in prop::array::uniform3(0.05..=0.95_f64),
        ) {
            let at = inside(&map, t);
            let knots = &map.knots()[k];
            let near = knots.knots().iter().any(|&u| u != at[k] && (u - at[k]).abs() < 1e-9);
            prop_assume!(!near);
            let (before, after) = map.split(k, at[k]).expect("inside");
            prop_assert_eq!(before.domain()[k].1, at[k]);
            prop_assert_eq!(after.domain()[k].0, at[k]);
            let last = before.counts()[k] - 1;
            let layer = |m: &NurbsVolume, i: usize| -> Vec<[u64; 3]> {
                super::super::net::indices(m.counts()).zip(m.control_points())
                    .filter(|(index, _)| index[k] == i)
                    .map(|(_, p)| p.map(f64::to_bits))
                    .collect()
            };
            prop_assert_eq!(layer(&before, last), layer(&after, 0));
            for (part, low) in [(&before, true), (&after, false)] {
                let mut here = at;
                let (a, b) = part.domain()[k];
                here[k] = a + 0.4 * (b - a);
                let [x, y] = [part, &map].map(|m| m.evaluate(here).expect("inside"));
                let bound = extent(&map) * 8.0 * gamma(120);
                prop_assert!(gap(x, y) <= bound, "{low}: {x:?} {y:?}");
            }
        }

        #[test]
        fn parameters_reversed_moved_and_swapped(
            map in maps::<3>(), k in 0..3_usize, t in prop::array::uniform3(0.0..=1.0_f64),
        ) {
            // Another parameter rounds by an ulp of the domain; a narrow span makes much of it.
            let steep = map.knots().iter().flat_map(KnotVector::spans)
                .fold(f64::INFINITY, |m, s| m.min(s.end - s.start));
            prop_assume!(steep > 1e-3);
            let at = inside(&map, t);
            let bound = extent(&map) * 1e-9;
            let point = map.evaluate(at).expect("inside");
            let (a, b) = map.domain()[k];
            let mut there = at;
            there[k] = (a + (b - at[k])).clamp(a, b);
            let back = map.reverse(k).expect("no knots fall together");
            prop_assert!(gap(back.evaluate(there).expect("inside"), point) <= bound);
            let moved = map.reparametrize(k, 3.0, 5.0).expect("an interval");
            there[k] = (3.0 + (at[k] - a) / (b - a) * 2.0).clamp(3.0, 5.0);
            prop_assert!(gap(moved.evaluate(there).expect("inside"), point) <= bound);
            let turned = map.permute([2, 0, 1]).expect("a permutation");
            let found = turned.evaluate([at[2], at[0], at[1]]).expect("inside");
            prop_assert!(gap(found, point) <= extent(&map) * gamma(200));
            prop_assert_eq!(turned.permute([1, 2, 0]).expect("a permutation"), map);
        }
    }

    #[test]
    fn a_projective_map_acts_on_points() {
        let ball = sphere(1.0, &biquadratic());
        let t = [
            [1.0, 0.25, 0.0, 0.5],
            [0.0, 2.0, 0.5, 0.0],
            [0.25, 0.0, 1.0, 1.0],
            [0.125, 0.0, 0.25, 4.0],
        ];
        let image = ball.project(&t).expect("weights stay positive");
        for at in [[0.1, 0.2, 0.3], [0.5, 0.5, 0.5], [0.9, 1.0, 0.4]] {
            let [x, y, z] = ball.evaluate(at).expect("inside");
            let h = t.map(|r| r[0] * x + r[1] * y + r[2] * z + r[3]);
            let expected = [h[0] / h[3], h[1] / h[3], h[2] / h[3]];
            assert!(gap(image.evaluate(at).expect("inside"), expected) < 2e-15);
        }
        let mut far = t;
        far[3] = [1.0, 0.0, 0.0, 0.5];
        assert!(matches!(ball.project(&far), Err(NurbsError::Weight { .. })));
    }

    #[test]
    fn wrong_directions_are_errors() {
        let line = || KnotVector::bezier(1).expect("valid");
        let sheet =
            NurbsSurface::new([line(), line()], vec![[0.0; 3]; 4], vec![1.0; 4]).expect("valid");
        let wrong = |found| Err(NurbsError::Direction { found, limit: 2 });
        assert_eq!(sheet.insert_knot(2, 0.5, 1), wrong(2));
        assert_eq!(sheet.reverse(7), wrong(7));
        assert_eq!(sheet.permute([1, 1]), wrong(1));
        assert!(sheet.split(3, 0.5).is_err() && sheet.reparametrize(2, 0.0, 1.0).is_err());
        assert!(matches!(
            sheet.split(0, 0.0),
            Err(NurbsError::SplitAtEnd { .. })
        ));
        assert!(matches!(
            sheet.split(0, f64::NAN),
            Err(NurbsError::OutsideDomain { .. })
        ));
    }
}
