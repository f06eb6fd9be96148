//! What can go wrong with a picture.

/// A picture that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// A side is zero or too long.
    #[error("{side} {found} is not between 1 and {most} pixels")]
    Side {
        /// `width` or `height`.
        side: &'static str,
        /// The value given.
        found: usize,
        /// The most that is allowed.
        most: usize,
    },
    /// The picture has too many pixels.
    #[error("a picture of {width} x {height} pixels has more than {most}; make it smaller")]
    Pixels {
        /// Pixels along x.
        width: usize,
        /// Pixels along y.
        height: usize,
        /// The most that is allowed.
        most: usize,
    },
    /// There would be too many parameter lines.
    #[error("{found} lines between two knots are more than {most}")]
    Lines {
        /// The value given.
        found: usize,
        /// The most that is allowed.
        most: usize,
    },
    /// An angle of view is not a number of degrees.
    #[error("{angle} {found} is not {wanted}")]
    Angle {
        /// `azimuth` or `elevation`.
        angle: &'static str,
        /// The value given, in degrees.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// The plane of a section is nowhere near the solid, or not a number.
    #[error("the plane {axis} = {found} is not a finite number within {most:e} of the origin")]
    Plane {
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given, in scene units.
        found: f64,
        /// The farthest that can be drawn.
        most: f64,
    },
    /// A text names no plane.
    #[error("{found:?} is not a plane; write x=, y= or z= and a number in scene units, as z=0.5")]
    PlaneText {
        /// The text given.
        found: String,
    },
    /// The distance between isolines cannot be drawn.
    #[error("isolines every {found} cannot be drawn: a finite step greater than 0 is wanted{hint}")]
    Isolines {
        /// The value given, in scene units.
        found: f64,
        /// What would do, where it is known.
        hint: String,
    },
    /// The picture cannot be encoded.
    #[error("the picture cannot be encoded as PNG: {reason}")]
    Encode {
        /// The encoder's reason.
        reason: String,
    },
}
