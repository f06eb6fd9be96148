//! Other control points for the same curve: knots inserted, ends clamped, the degree raised, the
//! curve split.
//!
//! Inserting t once, `u_k <= t < u_{k+1}`, where t already occurs s times:
//!
//! ```text
//!   R_i = P_i                                     i <= k - p
//!   R_i = ((t - u_i) P_i + (u_{i+p} - t) P_{i-1}) / (u_{i+p} - u_i)      k - p < i <= k - s
//!   R_i = P_{i-1}                                 i > k - s
//! ```
//!
//! Raising the degree by one takes means of such insertions. In the raised curve each knot occurs
//! once more; leaving out every (p + 1)-th of those knots, in the p + 1 ways there are, leaves p + 1
//! refinements of the old curve, and each new control point is the mean of p + 1 of theirs:
//!
//! ```text
//!   û                 old knots, each once more; q = p + 1
//!   v^c               û without those whose index is c modulo q
//!   Q_i = (P^0 + P^1 + ... + P^{q-1}) / q          P^c over the p knots of û_{i+1} .. û_{i+q} in v^c
//! ```
//!
//! Nothing is subtracted anywhere: every new point is a mean of old ones with positive factors.
//!
//! * Shapes: a row of homogeneous control points; a net is refined row by row.
//! * Accuracy: an insertion makes at most five roundings in a factor times a point, so L layers of
//!   them move the curve by at most 2 γ(5 L) of the largest coordinate. Values that neighbouring
//!   points share are kept exactly.
//! * Cost: an insertion moves the points after it, which for a thousand knots is a thousandth of a
//!   second.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapter 5; for the degree, H. Prautzsch,
//!   *Degree elevation of B-spline curves*, CAGD 1 (1984).

use super::knot_vector::check_degree;
use super::{Homogeneous, KnotVector, NurbsCurve, NurbsError};
use smallvec::SmallVec;

/// The spline with the knot `t` inserted `times` times.
///
/// * `points`: one for each control point of `knots`.
/// * `t`: parameter, inside the domain.
///
/// # Errors
/// [`NurbsError::KnotCount`], [`NurbsError::OutsideDomain`], [`NurbsError::Multiplicity`] when `t`
/// would occur more than p times, [`NurbsError::SpanWidth`] when it is too near another knot.
///
/// # Source
/// Piegl & Tiller, Algorithm A5.1, p. 151.
///
/// ```
/// # use voxlathe::nurbs::{Homogeneous, KnotVector, insert_knot};
/// let points = [0.0, 2.0].map(|x| Homogeneous::from_point([x], 1.0));
/// let (knots, points) = insert_knot(&KnotVector::bezier(1)?, &points, 0.25, 1)?;
/// assert_eq!(knots.knots(), [0.0, 0.0, 0.25, 1.0, 1.0]);
/// assert_eq!(points[1].to_point(), [0.5]);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn insert_knot<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
    t: f64,
    times: usize,
) -> Result<(KnotVector, Vec<Homogeneous<D>>), NurbsError> {
    knots.check_parameter(t)?;
    let found = knots.multiplicity(t).saturating_add(times);
    check_multiplicity(knots, t, found, times)?;
    refine_knots(knots, points, &vec![t; times])
}

/// The spline with all of `inserted` inserted: a value given k times is inserted k times.
///
/// * `points`: one for each control point of `knots`.
/// * `inserted`: parameters inside the domain, in any order.
///
/// # Errors
/// Those of [`insert_knot`].
///
/// # Source
/// Piegl & Tiller, §5.3.
///
/// ```
/// # use voxlathe::nurbs::{Homogeneous, KnotVector, refine_knots};
/// let points = [0.0, 0.0, 4.0].map(|x| Homogeneous::from_point([x], 1.0)); // 4 u^2
/// let (knots, points) = refine_knots(&KnotVector::bezier(2)?, &points, &[0.5, 0.5])?;
/// assert_eq!(knots.control_points(), 5);
/// assert_eq!(points.map_points(), [0.0, 0.0, 1.0, 2.0, 4.0]);
/// # trait M { fn map_points(&self) -> Vec<f64>; }
/// # impl M for Vec<Homogeneous<1>> {
/// #     fn map_points(&self) -> Vec<f64> { self.iter().map(|h| h.to_point()[0]).collect() }
/// # }
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn refine_knots<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
    inserted: &[f64],
) -> Result<(KnotVector, Vec<Homogeneous<D>>), NurbsError> {
    knots.check_control_points(points.len())?;
    for &t in inserted {
        knots.check_parameter(t)?;
    }
    let mut sorted = inserted.to_vec();
    sorted.sort_by(f64::total_cmp);
    for equal in sorted.chunk_by(|a, b| a == b) {
        let found = knots.multiplicity(equal[0]) + equal.len();
        check_multiplicity(knots, equal[0], found, equal.len())?;
    }
    let p = knots.degree();
    let mut knots = knots.knots().to_vec();
    let mut points = points.to_vec();
    for &t in &sorted {
        insert_once(p, &mut knots, &mut points, t);
    }
    Ok((KnotVector::new(p, knots)?, points))
}

/// One insertion of `t`, which lies in the domain and occurs less than p times.
fn insert_once<const D: usize>(
    p: usize,
    u: &mut Vec<f64>,
    points: &mut Vec<Homogeneous<D>>,
    t: f64,
) {
    let after = u.partition_point(|&knot| knot <= t);
    let k = after - 1;
    let s = after - u.partition_point(|&knot| knot < t);
    let fresh: SmallVec<[Homogeneous<D>; 8]> = (k - p + 1..=k - s)
        .map(|i| {
            let width = u[i + p] - u[i];
            points[i].mix((t - u[i]) / width, points[i - 1], (u[i + p] - t) / width)
        })
        .collect();
    points.splice(k - p + 1..k - s, fresh);
    u.insert(after, t);
}

/// Whether the knot `t` may occur `found` times, `added` of them new.
fn check_multiplicity(
    knots: &KnotVector,
    t: f64,
    found: usize,
    added: usize,
) -> Result<(), NurbsError> {
    let degree = knots.degree();
    if added == 0 || found <= degree {
        return Ok(());
    }
    Err(NurbsError::Multiplicity {
        index: knots.knots().partition_point(|&k| k < t),
        knot: t,
        found,
        limit: degree,
        degree,
    })
}

/// The spline with clamped ends: unclamped and periodic ones are cut to their domain.
///
/// The ends of the domain become knots of multiplicity p + 1; what lies outside is dropped. The
/// curve, as a map from the domain, is the same.
///
/// * `points`: one for each control point of `knots`.
///
/// # Errors
/// [`NurbsError::KnotCount`].
///
/// # Source
/// Piegl & Tiller, Algorithm A12.1, p. 577.
///
/// ```
/// # use voxlathe::nurbs::{Homogeneous, KnotVector, clamp};
/// let points = [0.0, 2.0, 0.0].map(|x| Homogeneous::from_point([x], 1.0));
/// let (knots, points) = clamp(&KnotVector::unclamped_uniform(2, 3)?, &points)?;
/// assert_eq!(knots.knots(), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
/// assert_eq!(points[0].to_point(), [1.0]);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn clamp<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
) -> Result<(KnotVector, Vec<Homogeneous<D>>), NurbsError> {
    knots.check_control_points(points.len())?;
    if knots.is_clamped() {
        return Ok((knots.clone(), points.to_vec()));
    }
    let p = knots.degree();
    let (start, end) = knots.domain();
    let mut inserted = vec![start; p.saturating_sub(knots.multiplicity(start))];
    inserted.extend(vec![end; p.saturating_sub(knots.multiplicity(end))]);
    let (knots, points) = refine_knots(knots, points, &inserted)?;
    // The last p of the knots at the start and the first p of those at the end stay, and get one
    // more each.
    let u = knots.knots();
    let first = u.partition_point(|&k| k <= start) - p;
    let last = u.partition_point(|&k| k < end) + p - 1;
    let mut clamped = Vec::with_capacity(last - first + 3);
    clamped.push(start);
    clamped.extend_from_slice(&u[first..=last]);
    clamped.push(end);
    Ok((
        KnotVector::from_valid(p, clamped),
        points[first - 1..=last - p].to_vec(),
    ))
}

/// The spline with its degree raised `by` degrees.
///
/// Ends come out clamped. Each distinct knot occurs `by` times more than before, which is the least
/// that keeps the curve: no redundant knots are left to remove.
///
/// * `points`: one for each control point of `knots`.
/// * `by`: how much; 0 changes nothing.
///
/// # Errors
/// [`NurbsError::KnotCount`]; [`NurbsError::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE).
///
/// # Source
/// H. Prautzsch, *Degree elevation of B-spline curves*, CAGD 1 (1984) 193–198; the same curve as
/// Piegl & Tiller, Algorithm A5.9, p. 206.
///
/// ```
/// # use voxlathe::nurbs::{Homogeneous, KnotVector, elevate_degree};
/// let points = [0.0, 0.0, 3.0].map(|x| Homogeneous::from_point([x], 1.0)); // 3 u^2
/// let (knots, points) = elevate_degree(&KnotVector::bezier(2)?, &points, 1)?;
/// assert_eq!(knots, KnotVector::bezier(3)?);
/// assert_eq!(points[2].to_point(), [1.0]);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn elevate_degree<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
    by: usize,
) -> Result<(KnotVector, Vec<Homogeneous<D>>), NurbsError> {
    check_degree(knots.degree().saturating_add(by))?;
    if by == 0 {
        knots.check_control_points(points.len())?;
        return Ok((knots.clone(), points.to_vec()));
    }
    let (mut knots, mut points) = clamp(knots, points)?;
    for _ in 0..by {
        (knots, points) = elevate_once(&knots, &points)?;
    }
    Ok((knots, points))
}

/// One degree more, for a clamped spline.
fn elevate_once<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
) -> Result<(KnotVector, Vec<Homogeneous<D>>), NurbsError> {
    let q = knots.degree() + 1;
    let mut raised = Vec::with_capacity(2 * knots.knots().len());
    for equal in knots.knots().chunk_by(|a, b| a == b) {
        raised.push(equal[0]);
        raised.extend_from_slice(equal);
    }
    // The outermost knots belong to no control point.
    let inner = &raised[1..raised.len() - 1];
    let control_points = inner.len() - q + 1;
    let mut parts = Vec::with_capacity(q);
    for c in 0..q {
        let kept = |&(i, _): &(usize, &f64)| i % q != c;
        let left: Vec<f64> = inner
            .iter()
            .enumerate()
            .filter(kept)
            .map(|(_, &t)| t)
            .collect();
        let mut inserted = Vec::new();
        for equal in left.chunk_by(|a, b| a == b) {
            let more = equal.len().saturating_sub(knots.multiplicity(equal[0]));
            inserted.extend(std::iter::repeat_n(equal[0], more));
        }
        parts.push(refine_knots(knots, points, &inserted)?.1);
    }
    let elevated = (0..control_points)
        .map(|i| {
            // In part c, the knots before number i that were left out shift the index.
            let part = |c: usize| parts[c][i - (i + q - 1 - c) / q];
            mean(q, part)
        })
        .collect();
    Ok((KnotVector::new(q, raised)?, elevated))
}

/// The mean of `part(0) .. part(count)`; what all of them share is kept exactly.
fn mean<const D: usize>(count: usize, part: impl Fn(usize) -> Homogeneous<D>) -> Homogeneous<D> {
    let sum = (1..count).fold(part(0), |sum, c| sum.plus(1.0, part(c)));
    let over = |value: fn(&Homogeneous<D>, usize) -> f64, axis: usize| {
        let first = value(&part(0), axis);
        if (1..count).all(|c| value(&part(c), axis) == first) {
            first
        } else {
            value(&sum, axis) / count as f64
        }
    };
    Homogeneous {
        weighted: std::array::from_fn(|axis| over(|h, axis| h.weighted[axis], axis)),
        weight: over(|h, _| h.weight, 0),
    }
}

impl<const D: usize> NurbsCurve<D> {
    /// The same curve with the knot `u` inserted `times` times.
    ///
    /// # Errors
    /// Those of [`insert_knot`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let curve = NurbsCurve::polynomial(KnotVector::bezier(2)?, vec![[0.0], [0.0], [4.0]])?;
    /// let finer = curve.insert_knot(0.5, 1)?;
    /// assert_eq!(finer.control_points(), [[0.0], [0.0], [2.0], [4.0]]);
    /// assert_eq!(finer.evaluate(0.75)?, curve.evaluate(0.75)?);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn insert_knot(&self, u: f64, times: usize) -> Result<Self, NurbsError> {
        let (knots, points) = insert_knot(self.knots(), &self.to_homogeneous(), u, times)?;
        Self::from_homogeneous(knots, &points)
    }

    /// The same curve with all of `inserted` inserted.
    ///
    /// # Errors
    /// Those of [`refine_knots`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0], [8.0]])?;
    /// assert_eq!(line.refine(&[0.5, 0.25])?.control_points(), [[0.0], [2.0], [4.0], [8.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn refine(&self, inserted: &[f64]) -> Result<Self, NurbsError> {
        let (knots, points) = refine_knots(self.knots(), &self.to_homogeneous(), inserted)?;
        Self::from_homogeneous(knots, &points)
    }

    /// The same curve with clamped ends; see [`clamp`].
    ///
    /// # Errors
    /// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`] when a product of weights and factors
    /// leaves the range of f64.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let knots = KnotVector::unclamped_uniform(2, 3)?;
    /// let curve = NurbsCurve::polynomial(knots, vec![[0.0], [2.0], [0.0]])?.clamp()?;
    /// assert_eq!(curve.control_points(), [[1.0], [2.0], [1.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn clamp(&self) -> Result<Self, NurbsError> {
        if self.knots().is_clamped() {
            return Ok(self.clone());
        }
        let (knots, points) = clamp(self.knots(), &self.to_homogeneous())?;
        Self::from_homogeneous(knots, &points)
    }

    /// The same curve, clamped, with its degree raised `by` degrees; see [`elevate_degree`].
    ///
    /// # Errors
    /// [`NurbsError::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE).
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0], [8.0]])?;
    /// assert_eq!(line.elevate_degree(1)?.control_points(), [[0.0], [4.0], [8.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn elevate_degree(&self, by: usize) -> Result<Self, NurbsError> {
        let (knots, points) = elevate_degree(self.knots(), &self.to_homogeneous(), by)?;
        Self::from_homogeneous(knots, &points)
    }

    /// The parts of the curve before and after `u`, clamped, each over its part of the domain.
    ///
    /// The last control point of the first part is, exactly, the first of the second.
    ///
    /// * `u`: parameter, between the ends of the domain.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`]; [`NurbsError::SplitAtEnd`] at either end of the domain;
    /// [`NurbsError::SpanWidth`] too near a knot.
    ///
    /// # Source
    /// Piegl & Tiller, §5.3 (subdivision by knot insertion).
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let curve = NurbsCurve::polynomial(KnotVector::bezier(2)?, vec![[0.0], [0.0], [4.0]])?;
    /// let (before, after) = curve.split(0.5)?;
    /// assert_eq!(before.control_points(), [[0.0], [0.0], [1.0]]);
    /// assert_eq!(after.domain(), (0.5, 1.0));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn split(&self, u: f64) -> Result<(Self, Self), NurbsError> {
        self.knots().check_parameter(u)?;
        let (start, end) = self.domain();
        if u == start || u == end {
            return Err(NurbsError::SplitAtEnd {
                parameter: u,
                start,
                end,
            });
        }
        let curve = self.clamp()?;
        let p = curve.degree();
        let more = p.saturating_sub(curve.knots().multiplicity(u));
        let curve = curve.insert_knot(u, more)?;
        let knots = curve.knots().knots();
        let first = knots.partition_point(|&k| k < u);
        let part = |knots: Vec<f64>, control: std::ops::Range<usize>| {
            Self::new(
                KnotVector::from_valid(p, knots),
                curve.control_points()[control.clone()].to_vec(),
                curve.weights()[control].to_vec(),
            )
        };
        let before = [&knots[..first + p], &[u]].concat();
        let after = [&[u], &knots[first..]].concat();
        Ok((
            part(before, 0..first)?,
            part(after, first - 1..curve.control_points().len())?,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{curves, gamma, gap, parameter, size};
    use super::*;
    use proptest::prelude::*;

    /// How far two evaluations may lie apart after `layers` layers of insertions.
    fn bound(curve: &NurbsCurve<2>, layers: usize) -> f64 {
        let p = curve.degree();
        size(curve) * (4.0 * gamma(7 * (p + 3) + 4) + 2.0 * gamma(5 * layers + 4))
    }

    fn same(a: &NurbsCurve<2>, b: &NurbsCurve<2>, layers: usize) -> Result<(), TestCaseError> {
        prop_assert_eq!(a.domain(), b.domain());
        for i in 0..=40 {
            let u = parameter(a.knots(), f64::from(i) / 40.0);
            let [x, y] = [a, b].map(|c| c.evaluate(u).expect("inside"));
            let bound = bound(a, layers);
            prop_assert!(gap(x, y) <= bound, "u = {u}: {x:?}, {y:?}, bound {bound:e}");
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn insertion_leaves_the_curve(
            curve in curves(1..=12), at in 0.0..=1.0_f64, times in 0..=12_usize,
        ) {
            let u = parameter(curve.knots(), at);
            let room = curve.degree().saturating_sub(curve.knots().multiplicity(u));
            let times = times.min(room);
            let finer = curve.insert_knot(u, times).expect("room for it");
            prop_assert_eq!(
                finer.control_points().len(), curve.control_points().len() + times);
            same(&curve, &finer, times)?;
            let refused = matches!(
                curve.insert_knot(u, room + 1),
                Err(NurbsError::Multiplicity { .. })
            );
            prop_assert!(refused, "{} more at {}", room + 1, u);
        }

        #[test]
        fn refinement_leaves_the_curve(
            curve in curves(1..=12), at in prop::collection::vec(0.02..0.98_f64, 0..=12),
        ) {
            let mut inserted: Vec<f64> = at.iter().map(|&t| parameter(curve.knots(), t)).collect();
            inserted.sort_by(f64::total_cmp);
            inserted.dedup();
            inserted.retain(|&t| curve.knots().multiplicity(t) < curve.degree());
            inserted.reverse();
            same(&curve, &curve.refine(&inserted).expect("room for it"), inserted.len())?;
        }

        #[test]
        fn clamping_leaves_the_curve(curve in curves(1..=12)) {
            let clamped = curve.clamp().expect("finite");
            prop_assert!(clamped.knots().is_clamped());
            same(&curve, &clamped, 2 * curve.degree())?;
            let (a, b) = curve.domain();
            prop_assert_eq!(clamped.evaluate(a).ok(), clamped.control_points().first().copied());
            prop_assert_eq!(clamped.evaluate(b).ok(), clamped.control_points().last().copied());
        }

        #[test]
        fn elevation_leaves_the_curve(curve in curves(1..=12), by in 0..=3_usize) {
            let raised = curve.elevate_degree(by).expect("below the limit");
            prop_assert_eq!(raised.degree(), curve.degree() + by);
            // Clamping, then for each degree an insertion at every knot and a mean.
            let layers = 2 * curve.degree() + by * (curve.knots().knots().len() + 4);
            same(&curve, &raised, layers)?;
            let (a, b) = curve.domain();
            for span in curve.knots().spans().skip(1) {
                if by > 0 && span.start > a && span.start < b {
                    prop_assert_eq!(
                        raised.knots().multiplicity(span.start),
                        curve.knots().multiplicity(span.start) + by
                    );
                }
            }
        }

        #[test]
        fn split_parts_are_the_curve(curve in curves(1..=12), at in 0.02..=0.98_f64) {
            let u = parameter(curve.knots(), at);
            let (a, b) = curve.domain();
            if u == a {
                let refused = matches!(curve.split(u), Err(NurbsError::SplitAtEnd { .. }));
                prop_assert!(refused);
                return Ok(());
            }
            let (before, after) = curve.split(u).expect("inside");
            prop_assert_eq!((before.domain(), after.domain()), ((a, u), (u, b)));
            prop_assert_eq!(before.evaluate(u), after.evaluate(u));
            for i in 0..=20 {
                let v = parameter(curve.knots(), f64::from(i) / 20.0);
                let part = if v <= u { &before } else { &after };
                let [x, y] = [&curve, part].map(|c| c.evaluate(v).expect("inside"));
                prop_assert!(gap(x, y) <= bound(&curve, 3 * curve.degree()), "{x:?} {y:?}");
            }
        }
    }

    #[test]
    fn degrees_rise_like_bernstein_polynomials() {
        // E_i = i / (p + 1) P_{i-1} + (1 - i / (p + 1)) P_i.
        let points = [[1.0, 0.0], [2.0, 4.0], [5.0, 4.0], [6.0, -1.0]];
        let curve = NurbsCurve::polynomial(KnotVector::bezier(3).expect("valid"), points.to_vec())
            .and_then(|c| c.elevate_degree(1))
            .expect("valid");
        let expected = [
            [1.0, 0.0],
            [1.75, 3.0],
            [3.5, 4.0],
            [5.25, 2.75],
            [6.0, -1.0],
        ];
        for (found, expected) in curve.control_points().iter().zip(expected) {
            assert!(gap(*found, expected) <= 6.0 * gamma(8), "{found:?}");
        }
    }

    #[test]
    fn flat_stretches_stay_flat() {
        // A shared height is no sum of rounded shares of itself.
        let knots = KnotVector::clamped_uniform(3, 9).expect("valid");
        let points = (0..9).map(|i| [f64::from(i), 0.1]).collect();
        let flat = NurbsCurve::polynomial(knots, points).expect("valid");
        let curves = [
            flat.refine(&[0.1, 0.2, 0.3, 0.71]),
            flat.elevate_degree(3),
            flat.split(0.37).map(|parts| parts.1),
        ];
        for curve in curves {
            let curve = curve.expect("valid");
            assert!(curve.control_points().iter().all(|p| p[1] == 0.1));
            assert!(curve.weights().iter().all(|&w| w == 1.0));
        }
    }

    #[test]
    fn bad_refinements_are_refused() {
        let line = NurbsCurve::polynomial(
            KnotVector::bezier(1).expect("valid"),
            vec![[0.0, 0.0], [1.0, 1.0]],
        )
        .expect("valid");
        for u in [-0.1, 1.1, f64::NAN] {
            assert!(matches!(
                line.insert_knot(u, 1),
                Err(NurbsError::OutsideDomain { .. })
            ));
            assert!(matches!(
                line.refine(&[0.5, u]),
                Err(NurbsError::OutsideDomain { .. })
            ));
            assert!(matches!(
                line.split(u),
                Err(NurbsError::OutsideDomain { .. })
            ));
        }
        for u in [0.0, 1.0] {
            assert!(matches!(line.split(u), Err(NurbsError::SplitAtEnd { .. })));
            assert!(matches!(
                line.insert_knot(u, 1),
                Err(NurbsError::Multiplicity { .. })
            ));
        }
        assert!(matches!(
            line.insert_knot(0.5, usize::MAX),
            Err(NurbsError::Multiplicity { .. })
        ));
        assert!(matches!(
            line.insert_knot(1e-120, 1),
            Err(NurbsError::SpanWidth { .. })
        ));
        assert!(matches!(
            line.elevate_degree(32),
            Err(NurbsError::Degree { found: 33 })
        ));
        assert!(line.elevate_degree(usize::MAX).is_err());
        let points = line.to_homogeneous();
        assert!(clamp(line.knots(), &points[..1]).is_err());
        assert!(elevate_degree(line.knots(), &points[..1], 0).is_err());
    }
}
