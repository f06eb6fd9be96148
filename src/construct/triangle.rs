//! Rational Bézier triangles, and the octant of the sphere as one of degree 4.
//!
//! ```text
//!   X(u, v) = Σ_{i+j+k=n} B_ijk w_ijk P_ijk / Σ B_ijk w_ijk,     B_ijk = n! / (i! j! k!) u^i v^j (1-u-v)^k
//! ```
//!
//! De Casteljau's algorithm takes means of three neighbours; the last three give the point and both first
//! derivatives:
//!
//! ```text
//!   b_ijk  <-  u b_{i+1,j,k} + v b_{i,j+1,k} + w b_{i,j,k+1},      w = 1 - u - v
//!   ∂u = n (b_100 - b_001),   ∂v = n (b_010 - b_001)               one level before the end
//! ```
//!
//! The octant, with `a0` = (√3-1)/√3, `a1` = (√3+1)/(2√3), `a2` = 1 - (5-√2)(7-√3)/46 and the weights
//! `b0` = 4√3(√3-1), `b1` = 3√2, `b2` = 4, `b3` = √2(3+2√2-√3)/√3:
//!
//! ```text
//!   corners       P_400 = (1,0,0) and cyclic                      b0
//!   next to them  P_310 = (1,a0,0), P_301 = (1,0,a0) and cyclic   b1
//!   edge middles  P_220 = (a1,a1,0) and cyclic                    b2
//!   inside        P_211 = (1,a2,a2) and cyclic                    b3
//! ```
//!
//! It lies on the sphere exactly and is regular with `X_u × X_v` outward on the closed triangle, corners
//! included, which no tensor-product octant can be.
//!
//! * Shapes: control points in order of k, then j: i = n - j - k falls fastest.
//! * Units: control points in model units; parameters and weights have none.
//! * Accuracy: n levels of means with positive factors, each of at most five roundings: a point is off
//!   by at most 2 γ(5 n + 2) of the largest coordinate.
//! * Source: G. Farin, B. Piper, A. Worsey, *The octant of a sphere as a non-degenerate triangular Bézier
//!   patch*, CAGD 4 (1987) 329.

use super::{AxisFrame, ConstructError, check_length};
use crate::math::{Dd, Real};
use crate::nurbs::{Homogeneous, NurbsError, rational_derivatives};

/// The highest degree accepted; control points grow with its square.
pub const MAX_TRIANGLE_DEGREE: usize = 16;

/// A rational Bézier triangle in space over u, v >= 0, u + v <= 1.
///
/// A value that exists is valid: degree 1 to [`MAX_TRIANGLE_DEGREE`], weights finite and greater than zero,
/// coordinates finite.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalBezierTriangle {
    degree: usize,
    points: Vec<Homogeneous<3>>,
}

/// A point of a surface with its first derivatives by the two parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleGradient {
    /// The point.
    pub point: [f64; 3],
    /// The derivative by u.
    pub du: [f64; 3],
    /// The derivative by v.
    pub dv: [f64; 3],
    /// `X_u × X_v` at unit length; `None` where it is zero.
    pub normal: Option<[f64; 3]>,
}

impl RationalBezierTriangle {
    /// The triangle with these control points and weights, in order of k, then j.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] with [`NurbsError::Degree`], [`NurbsError::Length`],
    /// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`].
    ///
    /// ```
    /// # use voxlathe::construct::RationalBezierTriangle;
    /// // P_001 comes last: it is the point at u = v = 0.
    /// let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// let flat = RationalBezierTriangle::new(1, &corners, &[1.0; 3])?;
    /// assert_eq!(flat.evaluate(0.0, 0.0)?, [0.0, 0.0, 1.0]);
    /// assert_eq!(flat.evaluate(0.5, 0.25)?, [0.5, 0.25, 0.25]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(
        degree: usize,
        points: &[[f64; 3]],
        weights: &[f64],
    ) -> Result<Self, ConstructError> {
        if !(1..=MAX_TRIANGLE_DEGREE).contains(&degree) {
            return Err(NurbsError::Degree { found: degree }.into());
        }
        let expected = (degree + 1) * (degree + 2) / 2;
        for (what, found) in [("control points", points.len()), ("weights", weights.len())] {
            if found != expected {
                return Err(NurbsError::Length {
                    what,
                    found,
                    expected,
                }
                .into());
            }
        }
        for (index, (&point, &weight)) in points.iter().zip(weights).enumerate() {
            if !(weight > 0.0 && weight.is_finite()) {
                return Err(NurbsError::Weight {
                    index,
                    found: weight,
                }
                .into());
            }
            for (axis, found) in point.into_iter().enumerate() {
                if !(found.is_finite() && (found * weight).is_finite()) {
                    return Err(NurbsError::ControlPoint {
                        index,
                        axis,
                        found,
                        weight,
                    }
                    .into());
                }
            }
        }
        let pairs = points.iter().zip(weights);
        Ok(Self {
            degree,
            points: pairs
                .map(|(&p, &w)| Homogeneous::from_point(p, w))
                .collect(),
        })
    }

    /// The degree n.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The homogeneous control points, in order of k, then j.
    #[must_use]
    pub fn control_points(&self) -> &[Homogeneous<3>] {
        &self.points
    }

    /// The control point of the powers i of u, j of v and n - i - j of 1 - u - v; `None` where i + j > n.
    #[must_use]
    pub fn control_point(&self, i: usize, j: usize) -> Option<Homogeneous<3>> {
        let k = self.degree.checked_sub(i.checked_add(j)?)?;
        self.points.get(place(self.degree, j, k)).copied()
    }

    /// The point at (u, v), in model units.
    ///
    /// # Errors
    /// [`ConstructError::Parameter`] unless u >= 0, v >= 0 and u + v <= 1.
    pub fn evaluate(&self, u: f64, v: f64) -> Result<[f64; 3], ConstructError> {
        let [a, b, c] = self.last_three(u, v)?;
        Ok(mean([a, b, c], barycentric(u, v)?).to_point())
    }

    /// The point at (u, v), its first derivatives and the unit normal.
    ///
    /// # Errors
    /// [`ConstructError::Parameter`] unless u >= 0, v >= 0 and u + v <= 1.
    pub fn gradient(&self, u: f64, v: f64) -> Result<TriangleGradient, ConstructError> {
        let [a, b, c] = self.last_three(u, v)?;
        let value = mean([a, b, c], barycentric(u, v)?);
        let slope = |to: Homogeneous<3>| {
            let difference = to.plus(-1.0, c);
            let by = Homogeneous::ZERO.plus(self.degree as f64, difference);
            rational_derivatives(&[value, by])[1]
        };
        let (du, dv) = (slope(a), slope(b));
        Ok(TriangleGradient {
            point: value.to_point(),
            du,
            dv,
            normal: super::unit_normal(du, dv),
        })
    }

    /// The two triangles on either side of the median from u = v = 0 to the middle of the edge u + v = 1,
    /// each over its own parameters.
    ///
    /// In the first, u leads to the old corner u = 1 and v to the middle; in the second, u to the middle
    /// and v to the old corner v = 1. They share their common edge bit for bit.
    #[must_use]
    pub fn split(&self) -> (Self, Self) {
        let n = self.degree;
        let mut first = self.points.clone();
        let mut second = self.points.clone();
        // Each row of equal k is a Bézier curve from j = 0 to j = n - k, halved on its own.
        for k in 0..=n {
            let length = n - k;
            let mut row: Vec<_> = (0..=length).map(|j| self.points[place(n, j, k)]).collect();
            for done in 0..=length {
                first[place(n, done, k)] = row[0];
                second[place(n, length - done, k)] = row[length - done];
                for j in 0..length - done {
                    row[j] = row[j].mix(0.5, row[j + 1], 0.5);
                }
            }
        }
        let of = |points| Self { degree: n, points };
        (of(first), of(second))
    }

    /// The last three points of de Casteljau's algorithm: b_100, b_010, b_001.
    fn last_three(&self, u: f64, v: f64) -> Result<[Homogeneous<3>; 3], ConstructError> {
        let at = barycentric(u, v)?;
        let mut row = self.points.clone();
        for n in (2..=self.degree).rev() {
            // In place: the targets come before their sources.
            for k in 0..n {
                for j in 0..n - k {
                    let next = [
                        row[place(n, j, k)],
                        row[place(n, j + 1, k)],
                        row[place(n, j, k + 1)],
                    ];
                    row[place(n - 1, j, k)] = mean(next, at);
                }
            }
        }
        Ok([row[0], row[1], row[2]])
    }
}

/// Where the control point with powers j of v and k of w stands.
fn place(n: usize, j: usize, k: usize) -> usize {
    // Rows of equal k hold n + 1 - k points.
    k * (n + 1) - (k * k - k) / 2 + j
}

fn mean(p: [Homogeneous<3>; 3], at: [f64; 3]) -> Homogeneous<3> {
    let start = Homogeneous::ZERO.plus(at[0], p[0]);
    start.plus(at[1], p[1]).plus(at[2], p[2])
}

fn barycentric(u: f64, v: f64) -> Result<[f64; 3], ConstructError> {
    for (what, found) in [("u", u), ("v", v)] {
        if !(0.0..=1.0).contains(&found) {
            return Err(ConstructError::Parameter {
                what,
                found,
                wanted: "it must be between 0 and 1",
            });
        }
    }
    if u + v > 1.0 {
        return Err(ConstructError::Parameter {
            what: "u + v",
            found: u + v,
            wanted: "it must be at most 1",
        });
    }
    Ok([u, v, 1.0 - (u + v)])
}

/// The octant x, y, z >= 0 of the sphere as one triangle of degree 4, in the coordinates of the frame.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::{AxisFrame, octant_triangle};
/// let octant = octant_triangle(1.0, &AxisFrame::WORLD)?;
/// for c in octant.evaluate(1.0 / 3.0, 1.0 / 3.0)? {
///     assert!((c - 3_f64.sqrt().recip()).abs() < 1e-15);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn octant_triangle(
    radius: f64,
    frame: &AxisFrame,
) -> Result<RationalBezierTriangle, ConstructError> {
    check_length("the radius", radius)?;
    let n = Dd::of;
    let (root2, root3) = (n(2.0).sqrt(), n(3.0).sqrt());
    let (zero, one) = (Dd::ZERO, Dd::ONE);
    let a0 = (root3 - one) / root3;
    let a1 = (root3 + one) / (n(2.0) * root3);
    let a2 = one - (n(5.0) - root2) * (n(7.0) - root3) / n(46.0);
    let b0 = n(4.0) * root3 * (root3 - one);
    let b1 = n(3.0) * root2;
    let b3 = root2 * (n(3.0) + n(2.0) * root2 - root3) / root3;
    let mut points = Vec::with_capacity(15);
    let mut weights = Vec::with_capacity(15);
    for k in 0..=4_usize {
        for j in 0..=4 - k {
            let powers = [4 - j - k, j, k];
            // A coordinate follows from its power and from the largest of the three.
            let largest = powers.into_iter().fold(0, usize::max);
            let coordinate = |power: usize| match (largest, power) {
                (4, 4) | (3, 3) => one,
                (_, 0) => zero,
                (3, _) => a0,
                (_, 2) if powers.contains(&0) => a1,
                (_, 2) => one,
                _ => a2,
            };
            let weight = match largest {
                4 => b0,
                3 => b1,
                _ if powers.contains(&0) => n(4.0),
                _ => b3,
            };
            points.push(frame.place(powers.map(|p| n(radius) * coordinate(p))));
            weights.push(weight.f64());
        }
    }
    RationalBezierTriangle::new(4, &points, &weights)
}
