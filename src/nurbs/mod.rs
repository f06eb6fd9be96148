//! Rational B-splines: knot vectors, basis functions, curves, surfaces, volumes, refinement and Bézier
//! pieces.
//!
//! ```text
//!   C(u) = Σ N_{i,p}(u) w_i P_i / Σ N_{i,p}(u) w_i          u in [u_p, u_{n+1}]
//!
//!   knot_vector   where the pieces begin and end
//!   basis         N_{i,p}(u) and its derivatives
//!   cache         tables of N at many parameters, and the sums above taken from them
//!   kernel        the inner loops: plain (the definition) and wide (its twin)
//!   homogeneous   the points (w P, w) in which everything is linear
//!   curve         the sums at one parameter
//!   refine        other control points for the same curve
//!   bezier        one polynomial piece at a time
//! ```
//!
//! Surfaces and volumes are the same sums over two and three indices, [`NurbsTensor`]:
//!
//! ```text
//!   X(u, v, w) = Σ N_i(u) N_j(v) N_k(w) w_ijk P_ijk / Σ N_i(u) N_j(v) N_k(w) w_ijk
//!
//!   tensor               the sums at one place; [`NurbsSurface`] and [`NurbsVolume`]
//!   tensor_derivatives   second derivatives, Jacobian determinants, normals
//!   tensor_refine        other nets for the same map; affine and projective images
//!   tensor_bezier        Bézier cells; the six faces of a volume
//!   tensor_grid          all points of a grid of parameters
//!   tensor_integral      volume, moments and area (cell_quadrature)
//!   cell                 one polynomial piece of a map
//!   orientation          the certified sign of the Jacobian determinant (jacobian)
//!   net                  what is done to a net of control points row by row
//! ```
//!
//! What they share with curves (knot vectors, basis, tables, homogeneous points, refinement of a row
//! of points) takes no curve as argument. A block bent upwards, from its net to its volume:
//!
//! ```
//! use voxlathe::nurbs::{BasisCache, KnotVector, NurbsVolume, Orientation};
//!
//! // Degrees 2, 1, 1; the first index runs fastest. Straight but for z, which rises by 4 u^2.
//! let knots = [KnotVector::bezier(2)?, KnotVector::bezier(1)?, KnotVector::bezier(1)?];
//! let mut points = Vec::new();
//! for k in [0.0, 1.0] {
//!     for j in [0.0, 3.0] {
//!         points.extend([[0.0, j, k], [1.0, j, k], [2.0, j, k + 4.0]]);
//!     }
//! }
//! let block = NurbsVolume::new(knots, points, vec![1.0; 12])?;
//! assert_eq!(block.evaluate([0.5, 0.5, 0.0])?, [1.0, 1.5, 1.0]);
//!
//! // Sheared, not stretched: the determinant is that of the straight block, and so is the volume.
//! assert_eq!(block.jacobian([0.25, 0.5, 0.5])?.determinant, 6.0);
//! assert_eq!(block.orientation()?, Orientation::Positive);
//! let volume = block.moments()?.volume;
//! assert!((volume.value - 6.0).abs() <= volume.error && volume.error < 1e-12);
//!
//! // Its top, the end of w, and its points on a grid.
//! let top = &block.boundary()?[5];
//! assert_eq!(top.evaluate([1.0, 0.0])?, [2.0, 0.0, 5.0]);
//! let halves = [0.0, 0.5, 1.0];
//! let [_, _, z] = block.sample_grid(&BasisCache::default(), [&halves, &[0.0], &[1.0]])?;
//! assert_eq!(z, [1.0, 2.0, 5.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Volumes are made by [`construct`](crate::construct), read and written by [`exchange`](crate::exchange), and asked
//! which points they hold by [`patch`](crate::patch).
//!
//! Degree p, control points `P_0 ..= P_n`, weights `w_i > 0`, knots `u_0 <= ... <= u_m` with
//! `m = n + p + 1`.
//!
//! * Units: control points in model units; parameters and weights have none.
//! * Accuracy: every sum is of non-negative terms times control values, so a point is off by at
//!   most γ(n) of the largest coordinate, n counting the operations; see each file.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapters 2 to 5.

mod basis;
mod bezier;
mod cache;
mod cell;
mod cell_quadrature;
mod curve;
mod error;
mod homogeneous;
mod jacobian;
mod kernel;
mod knot_vector;
mod net;
mod orientation;
mod refine;
mod tensor;
mod tensor_bezier;
mod tensor_derivatives;
mod tensor_grid;
mod tensor_integral;
mod tensor_refine;
#[cfg(test)]
mod tensor_testing;
#[cfg(test)]
mod testing;

pub use crate::math::{Kernel, SimdLevel};
pub use basis::{LocalBasis, MAX_DERIVATIVE_ORDER};
pub use bezier::{BezierPiece, RationalBezier};
pub use cache::{BasisCache, BasisTable, combine, tabulate};
pub use cell::BezierCell;
pub use curve::NurbsCurve;
pub use error::NurbsError;
pub use homogeneous::{Homogeneous, rational_derivatives};
pub use knot_vector::{KnotSpan, KnotVector, MAX_DEGREE, MAX_KNOT_MAGNITUDE, MIN_SPAN_WIDTH};
pub use orientation::{CellIndex, JacobianSign, Orientation, OrientationError};
pub use refine::{clamp, elevate_degree, insert_knot, refine_knots};
pub use tensor::{NurbsSurface, NurbsTensor, NurbsVolume};
pub use tensor_bezier::CellPiece;
pub use tensor_derivatives::{Jacobian, TensorDerivatives};
pub use tensor_integral::MapMoments;
