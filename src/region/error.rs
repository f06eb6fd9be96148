//! Why curves do not bound a region.

/// What is wrong with a profile. `loop_index` and `curve` count from 0 in the order given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegionError {
    /// A loop without curves, or a profile without loops.
    #[error("loop {loop_index} has no curves")]
    Empty {
        /// Which loop.
        loop_index: usize,
    },
    /// Consecutive curves do not meet.
    #[error(
        "curve {curve} ends {gap:e} away from where curve {next} begins, near (r, z) = ({}, {}); a gap of at most {allowed:e} is closed by a segment",
        at[0], at[1]
    )]
    Gap {
        /// Which loop.
        loop_index: usize,
        /// The curve that ends.
        curve: usize,
        /// The curve that should begin there.
        next: usize,
        /// Distance between the two ends, in scene units.
        gap: f64,
        /// Where the first one ends.
        at: [f64; 2],
        /// The largest gap that is closed.
        allowed: f64,
    },
    /// A curve jumps inside, where as many of its knots are equal as at a clamped end.
    #[error(
        "curve {curve} jumps by {gap:e} at parameter {parameter}, from (r, z) = ({}, {}); a jump of at most {allowed:e} is closed by a segment",
        at[0], at[1]
    )]
    Jump {
        /// Which loop.
        loop_index: usize,
        /// Which curve.
        curve: usize,
        /// The knot.
        parameter: f64,
        /// How far it jumps, in scene units.
        gap: f64,
        /// From where.
        at: [f64; 2],
        /// The widest jump that is closed.
        allowed: f64,
    },
    /// A curve crosses the axis.
    #[error(
        "curve {curve} reaches r = {r:e} at parameter {parameter}; r must not fall below {allowed:e}"
    )]
    BelowAxis {
        /// Which loop.
        loop_index: usize,
        /// Which curve.
        curve: usize,
        /// The smallest r.
        r: f64,
        /// Where it is reached: knots for NURBS and interpolating curves, degrees for arcs, the
        /// number of the segment for polylines.
        parameter: f64,
        /// The smallest r that is taken as 0.
        allowed: f64,
    },
    /// A curve has no length, or cannot be made from its numbers.
    #[error("curve {curve} {reason}")]
    Curve {
        /// Which loop.
        loop_index: usize,
        /// Which curve.
        curve: usize,
        /// What is wrong and what is wanted.
        reason: String,
    },
    /// The loops cross more often than is sorted out.
    #[error(
        "the loops meet each other more than {limit} times; simplify them, or split them over several profiles"
    )]
    Tangle {
        /// The most meetings allowed.
        limit: usize,
    },
    /// The profile is so thin, beside how far it reaches, that its points cannot be told apart.
    #[error(
        "the profile is {thin:e} thin and reaches {reach:e} far; it must be at least {allowed:e} thick for that"
    )]
    Thin {
        /// The shorter side of its bounds, in scene units.
        thin: f64,
        /// Its largest coordinate.
        reach: f64,
        /// The least shorter side for that.
        allowed: f64,
    },
    /// The loops enclose nothing.
    #[error("the profile encloses no area")]
    NoArea,
}

impl RegionError {
    /// The loop and the curve to point at, where there is one.
    #[must_use]
    pub fn place(&self) -> Option<(usize, Option<usize>)> {
        match self {
            Self::Empty { loop_index } => Some((*loop_index, None)),
            Self::Gap {
                loop_index, next, ..
            } => Some((*loop_index, Some(*next))),
            Self::BelowAxis {
                loop_index, curve, ..
            }
            | Self::Jump {
                loop_index, curve, ..
            }
            | Self::Curve {
                loop_index, curve, ..
            } => Some((*loop_index, Some(*curve))),
            Self::NoArea | Self::Tangle { .. } | Self::Thin { .. } => None,
        }
    }
}
