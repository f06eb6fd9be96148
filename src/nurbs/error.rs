//! What can be wrong with a knot vector, a curve, or a question put to one.
//!
//! Each variant names the place, the value found there and the value wanted.

use super::{MAX_DEGREE, MAX_KNOT_MAGNITUDE, MIN_SPAN_WIDTH};

/// Why a spline cannot be, or cannot answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsError {
    /// Degrees run from 1 to [`MAX_DEGREE`].
    #[error("degree is {found}; it must be between 1 and {MAX_DEGREE}")]
    Degree {
        /// The degree asked for.
        found: usize,
    },
    /// A spline of degree p has at least p + 1 control points.
    #[error("{found} control points for degree {degree}; at least {expected} needed")]
    TooFewControlPoints {
        /// The number given.
        found: usize,
        /// The least number that will do.
        expected: usize,
        /// The degree.
        degree: usize,
    },
    /// A knot vector of degree p has at least 2 p + 2 knots.
    #[error("{found} knots for degree {degree}; at least {expected} needed")]
    TooFewKnots {
        /// The number given.
        found: usize,
        /// The least number that will do.
        expected: usize,
        /// The degree.
        degree: usize,
    },
    /// The counts must satisfy knots = control points + degree + 1.
    #[error(
        "{found} knots for {control_points} control points of degree {degree}; {expected} needed"
    )]
    KnotCount {
        /// Knots given.
        found: usize,
        /// Knots wanted.
        expected: usize,
        /// Control points given.
        control_points: usize,
        /// The degree.
        degree: usize,
    },
    /// Knots must be numbers of moderate size.
    #[error(
        "knot {index} is {found}; knots must be between -{MAX_KNOT_MAGNITUDE:e} and {MAX_KNOT_MAGNITUDE:e}"
    )]
    Knot {
        /// Which knot.
        index: usize,
        /// Its value.
        found: f64,
    },
    /// Knots must not decrease.
    #[error("knot {index} is {found}, less than the knot before it, {previous}")]
    KnotsDecrease {
        /// Which knot.
        index: usize,
        /// The knot before it.
        previous: f64,
        /// Its value.
        found: f64,
    },
    /// A knot is repeated so often that the curve would fall apart there.
    #[error(
        "knot {knot} (number {index}) occurs {found} times; at most {limit} allowed at degree {degree}"
    )]
    Multiplicity {
        /// Index of the first of the equal knots.
        index: usize,
        /// Their value.
        knot: f64,
        /// How many there are, or would be.
        found: usize,
        /// How many there may be: p inside, p + 1 at the ends of the knot vector.
        limit: usize,
        /// The degree.
        degree: usize,
    },
    /// Two different knots lie too close for the reciprocal of their distance.
    #[error(
        "knots {index} and the next, {start} and {end}, differ by less than {MIN_SPAN_WIDTH:e}"
    )]
    SpanWidth {
        /// Index of the knot at the start of the span.
        index: usize,
        /// Start of the span.
        start: f64,
        /// End of the span.
        end: f64,
    },
    /// The domain holds no interval.
    #[error("the domain, from knot {degree} to knot {last}, is the single parameter {at}")]
    EmptyDomain {
        /// The degree, which is the index of the knot where the domain starts.
        degree: usize,
        /// Index of the knot where the domain ends.
        last: usize,
        /// The parameter.
        at: f64,
    },
    /// A parameter is outside the domain, or NaN.
    #[error("parameter {parameter} is outside the domain [{start}, {end}]")]
    OutsideDomain {
        /// The parameter.
        parameter: f64,
        /// Start of the domain.
        start: f64,
        /// End of the domain.
        end: f64,
    },
    /// A parameter of a list is outside the domain, or NaN.
    #[error("sample {index} is {parameter}, outside the domain [{start}, {end}]")]
    SampleOutsideDomain {
        /// Its place in the list.
        index: usize,
        /// The parameter.
        parameter: f64,
        /// Start of the domain.
        start: f64,
        /// End of the domain.
        end: f64,
    },
    /// A curve can be split only between the ends of its domain.
    #[error("a split at {parameter} leaves an empty part; it must lie between {start} and {end}")]
    SplitAtEnd {
        /// The parameter.
        parameter: f64,
        /// Start of the domain.
        start: f64,
        /// End of the domain.
        end: f64,
    },
    /// A surface has two directions and a volume three, each named once.
    #[error("direction {found} asked for or named twice; directions are numbered below {limit}")]
    Direction {
        /// The direction.
        found: usize,
        /// How many there are.
        limit: usize,
    },
    /// An interval is empty, reversed or not finite.
    #[error("the interval from {start} to {end} is not an increasing one between finite numbers")]
    Interval {
        /// Its start.
        start: f64,
        /// Its end.
        end: f64,
    },
    /// Weights must be finite and positive.
    #[error("weight {index} is {found}; weights must be finite and greater than zero")]
    Weight {
        /// Which weight.
        index: usize,
        /// Its value.
        found: f64,
    },
    /// One weight is needed for each control point.
    #[error("{found} weights for {expected} control points")]
    WeightCount {
        /// Weights given.
        found: usize,
        /// Control points given.
        expected: usize,
    },
    /// A coordinate, or its product with the weight, is not a finite number.
    #[error(
        "control point {index} has coordinate {axis} {found} with weight {weight}; both and their product must be finite"
    )]
    ControlPoint {
        /// Which control point.
        index: usize,
        /// Which coordinate, from 0.
        axis: usize,
        /// Its value.
        found: f64,
        /// The weight it goes with.
        weight: f64,
    },
    /// A slice has the wrong length.
    #[error("{what} holds {found} values; {expected} needed")]
    Length {
        /// Which slice.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length wanted.
        expected: usize,
    },
    /// The order is beyond what a table holds, or beyond what can be asked for.
    #[error("derivatives of order {found} asked for; there are those up to order {limit}")]
    DerivativeOrder {
        /// The order asked for.
        found: usize,
        /// The highest order there can be.
        limit: usize,
    },
    /// A table of basis functions belongs to another knot vector.
    #[error("the table of direction {direction} is not of that direction's knot vector")]
    TableKnots {
        /// Which direction, from 0.
        direction: usize,
    },
}
