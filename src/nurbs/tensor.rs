//! Rational tensor-product B-splines in space: surfaces and volumes.
//!
//! ```text
//!   X(u, v, ..) = Σ N_i(u) N_j(v) .. w_ij.. P_ij.. / Σ N_i(u) N_j(v) .. w_ij..
//! ```
//!
//! * Shapes: the net is one list, the first index fastest.
//! * Units: control points in model units; parameters and weights have none.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §4.4; volumes: Lasser (1985).

use super::curve::bounds;
use super::homogeneous::check_control;
use super::{Homogeneous, KnotVector, LocalBasis, NurbsError, rational_derivatives};

/// A rational B-spline map of N parameters into space: [`NurbsSurface`] and [`NurbsVolume`].
///
/// A value that exists is valid: the counts agree, the weights are finite and greater than zero,
/// and the coordinates are finite, with their weight and without.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsTensor<const N: usize> {
    knots: [KnotVector; N],
    points: Vec<[f64; 3]>,
    weights: Vec<f64>,
}

/// A rational tensor-product B-spline surface in space.
pub type NurbsSurface = NurbsTensor<2>;

/// A trivariate rational tensor-product B-spline: a volume.
pub type NurbsVolume = NurbsTensor<3>;

impl<const N: usize> NurbsTensor<N> {
    /// The map with these control points and weights over the knot vectors.
    ///
    /// * `points`: control points in model units, the first index fastest; as many as the product of
    ///   the knot vectors' control points.
    /// * `weights`: as many, greater than zero.
    ///
    /// # Errors
    /// [`NurbsError::Length`] where the counts do not agree, [`NurbsError::Weight`],
    /// [`NurbsError::ControlPoint`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let saddle = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// assert_eq!(saddle.evaluate([0.5, 0.5])?, [0.5, 0.5, 0.25]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn new(
        knots: [KnotVector; N],
        points: Vec<[f64; 3]>,
        weights: Vec<f64>,
    ) -> Result<Self, NurbsError> {
        let expected = (knots.iter()).try_fold(1_usize, |n, k| n.checked_mul(k.control_points()));
        let expected = expected.unwrap_or(usize::MAX);
        for (what, found) in [("control points", points.len()), ("weights", weights.len())] {
            if found != expected {
                return Err(NurbsError::Length {
                    what,
                    found,
                    expected,
                });
            }
        }
        check_control(&points, &weights)?;
        Ok(Self {
            knots,
            points,
            weights,
        })
    }

    /// The map with homogeneous control points.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn from_homogeneous(
        knots: [KnotVector; N],
        points: &[Homogeneous<3>],
    ) -> Result<Self, NurbsError> {
        for (index, h) in points.iter().enumerate() {
            h.checked(index)?;
        }
        Self::new(
            knots,
            points.iter().map(|h| h.to_point()).collect(),
            points.iter().map(|h| h.weight).collect(),
        )
    }

    /// The control points with their weights, in homogeneous form.
    #[must_use]
    pub fn to_homogeneous(&self) -> Vec<Homogeneous<3>> {
        let pairs = self.points.iter().zip(&self.weights);
        pairs
            .map(|(&point, &weight)| Homogeneous::from_point(point, weight))
            .collect()
    }

    /// The degrees.
    #[must_use]
    pub fn degrees(&self) -> [usize; N] {
        self.knots.each_ref().map(KnotVector::degree)
    }

    /// The knot vectors.
    #[must_use]
    pub fn knots(&self) -> &[KnotVector; N] {
        &self.knots
    }

    /// Control points along each parameter.
    #[must_use]
    pub fn counts(&self) -> [usize; N] {
        self.knots.each_ref().map(KnotVector::control_points)
    }

    /// The control points in model units, the first index fastest.
    #[must_use]
    pub fn control_points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The weights, one for each control point.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// First and last value of each parameter.
    #[must_use]
    pub fn domain(&self) -> [(f64, f64); N] {
        self.knots.each_ref().map(KnotVector::domain)
    }

    /// Least and greatest coordinates of the control points: a box that holds the image.
    #[must_use]
    pub fn control_bounds(&self) -> ([f64; 3], [f64; 3]) {
        bounds(self.points.iter().copied())
    }

    /// The point at the parameters, in model units.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside its domain or NaN.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A4.3, p. 134.
    pub fn evaluate(&self, at: [f64; N]) -> Result<[f64; 3], NurbsError> {
        let bases = self.bases(at, 0)?;
        let rows = bases.each_ref().map(LocalBasis::values);
        Ok(self.sum(&bases, &rows).to_point())
    }

    /// The point and its first derivatives by each parameter.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside its domain or NaN.
    pub fn gradient(&self, at: [f64; N]) -> Result<([f64; 3], [[f64; 3]; N]), NurbsError> {
        let bases = self.bases(at, 1)?;
        let values = bases.each_ref().map(LocalBasis::values);
        let point = self.sum(&bases, &values);
        let slopes = std::array::from_fn(|k| {
            let mut rows = values;
            rows[k] = bases[k].derivatives(1).unwrap_or_default();
            rational_derivatives(&[point, self.sum(&bases, &rows)])[1]
        });
        Ok((point.to_point(), slopes))
    }

    /// The basis functions at the parameters, with derivatives up to `order`.
    pub(super) fn bases(&self, at: [f64; N], order: usize) -> Result<[LocalBasis; N], NurbsError> {
        let found: Result<Vec<_>, _> = (self.knots.iter().zip(at))
            .map(|(knots, u)| knots.basis_functions(u, order))
            .collect();
        Ok(found?
            .try_into()
            .unwrap_or_else(|_| unreachable!("one for each parameter")))
    }

    /// Σ N_i N_j .. (w P, w) for rows of basis values over the spans of `bases`.
    pub(super) fn sum(&self, bases: &[LocalBasis; N], rows: &[&[f64]; N]) -> Homogeneous<3> {
        self.sum_about(bases, rows, [0.0; 3])
    }

    /// The same about another origin o: Σ N_i N_j .. (w (P - o), w).
    pub(super) fn sum_about(
        &self,
        bases: &[LocalBasis; N],
        rows: &[&[f64]; N],
        origin: [f64; 3],
    ) -> Homogeneous<3> {
        let counts = self.counts();
        let mut sum = Homogeneous::ZERO;
        let mut index = [0_usize; N];
        loop {
            let (mut place, mut factor) = (0, 1.0);
            for k in (0..N).rev() {
                place = place * counts[k] + bases[k].first() + index[k];
                factor *= rows[k][index[k]];
            }
            let point = self.points[place];
            let from_origin = std::array::from_fn(|i| point[i] - origin[i]);
            let part = Homogeneous::from_point(from_origin, self.weights[place]);
            sum = sum.plus(factor, part);
            let Some(k) = (0..N).find(|&k| index[k] + 1 < rows[k].len()) else {
                return sum;
            };
            index[k] += 1;
            index[..k].fill(0);
        }
    }
}
