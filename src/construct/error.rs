//! What can be wrong with a construction.
//!
//! Each variant names the value found and the value wanted.

use super::{MAX_LENGTH, MIN_LENGTH};
use crate::nurbs::NurbsError;

/// Why a form cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConstructError {
    /// Radii, half axes and heights are positive and of moderate size.
    #[error("{what} is {found}; it must be between {MIN_LENGTH:e} and {MAX_LENGTH:e}")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its value.
        found: f64,
    },
    /// A parameter of a form or a surface is outside its range, or NaN.
    #[error("{what} is {found}; {wanted}")]
    Parameter {
        /// Which parameter.
        what: &'static str,
        /// Its value.
        found: f64,
        /// What was wanted.
        wanted: &'static str,
    },
    /// A turn starts at a finite angle and is at most a full one, not empty.
    #[error(
        "a turn by {angle} degrees from {start}; the start must be finite and the angle not 0 and at most 360 either way"
    )]
    Turn {
        /// Where it starts, in degrees.
        start: f64,
        /// The angle turned, in degrees.
        angle: f64,
    },
    /// The form covers only some turns.
    #[error("{form} cannot turn by {angle} degrees, only by {wanted}")]
    TurnOfForm {
        /// The form.
        form: &'static str,
        /// The angle asked for, in degrees.
        angle: f64,
        /// The angles it covers.
        wanted: &'static str,
    },
    /// Vectors do not make a right-handed frame of orthonormal axes.
    #[error("no frame: {reason}")]
    Frame {
        /// What is wrong with them.
        reason: &'static str,
    },
    /// The generator lies on the axis, so that it sweeps nothing.
    #[error("the generator lies on the axis and sweeps no surface")]
    OnAxis,
    /// The generator is not a curve of one meridian half-plane.
    #[error(
        "control point {index} is {distance} off the meridian half-plane of the others; at most {allowed} is rounding"
    )]
    NotMeridian {
        /// Which control point.
        index: usize,
        /// How far it is off, in model units.
        distance: f64,
        /// What counts as rounding, in model units.
        allowed: f64,
    },
    /// A knot vector whose ends do not meet the first and the last layer of the net.
    #[error("parameter {parameter} is not clamped, so its ends are no layers of the control net")]
    NotClamped {
        /// Which parameter, from 0.
        parameter: usize,
    },
    /// A chain has no curves.
    #[error("the chain holds no curve")]
    EmptyChain,
    /// Curves of a chain do not meet.
    #[error(
        "curve {curve} starts {gap} from the end of the one before it; at most {allowed} is allowed"
    )]
    Gap {
        /// The later of the two curves, from 0.
        curve: usize,
        /// The distance, in model units.
        gap: f64,
        /// What is allowed, in model units.
        allowed: f64,
    },
    /// The control net is refused by the spline it was made for.
    #[error(transparent)]
    Nurbs(#[from] NurbsError),
}
