//! Rational B-splines: knot vectors, basis functions, curves, refinement and Bézier pieces.
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
//! Degree p, control points `P_0 ..= P_n`, weights `w_i > 0`, knots `u_0 <= ... <= u_m` with
//! `m = n + p + 1`. Surfaces and volumes are the same sums over two and three indices: what they
//! share with curves (knot vectors, basis, tables, homogeneous points, refinement of a row of
//! points) takes no curve as argument.
//!
//! * Units: control points in model units; parameters and weights have none.
//! * Accuracy: every sum is of non-negative terms times control values, so a point is off by at
//!   most γ(n) of the largest coordinate, n counting the operations; see each file.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapters 2 to 5.

mod basis;
mod bezier;
mod cache;
mod cell;
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
mod testing;
#[cfg(test)]
mod tensor_testing;

pub use basis::{LocalBasis, MAX_DERIVATIVE_ORDER};
pub use bezier::{BezierPiece, RationalBezier};
pub use cache::{BasisCache, BasisTable, combine, tabulate};
pub use cell::BezierCell;
pub use curve::NurbsCurve;
pub use error::NurbsError;
pub use homogeneous::{Homogeneous, rational_derivatives};
pub use kernel::{Kernel, SimdLevel};
pub use knot_vector::{KnotSpan, KnotVector, MAX_DEGREE, MAX_KNOT_MAGNITUDE, MIN_SPAN_WIDTH};
pub use orientation::{JacobianSign, Orientation, OrientationError};
pub use refine::{clamp, elevate_degree, insert_knot, refine_knots};
pub use tensor::{NurbsSurface, NurbsTensor, NurbsVolume};
pub use tensor_bezier::CellPiece;
pub use tensor_derivatives::{Jacobian, TensorDerivatives};
pub use tensor_integral::MapMoments;
