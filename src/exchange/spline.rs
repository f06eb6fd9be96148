//! What files hold: a curve, a surface or a volume in space; and what writers look at.
//!
//! ```text
//!   reader ──> Parts (knots, points, weights, place) ──> Spline
//!   writer <── Net (a view) <── NurbsCurve<3>, NurbsSurface, NurbsVolume, Spline
//! ```

use crate::nurbs::{KnotVector, NurbsCurve, NurbsError, NurbsSurface, NurbsTensor, NurbsVolume};

use super::{ExchangeError, Format, Place};

/// A spline in space, as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub enum Spline {
    /// One parameter.
    Curve(NurbsCurve<3>),
    /// Two parameters.
    Surface(NurbsSurface),
    /// Three parameters.
    Volume(NurbsVolume),
}

impl Spline {
    /// `"curve"`, `"surface"` or `"volume"`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        Net::from(self).kind()
    }
}

/// A spline to be written: a view of its knot vectors, control points and weights.
///
/// Made by `Net::from` from references to curves in space, surfaces, volumes and [`Spline`]s.
#[derive(Debug, Clone)]
pub struct Net<'a> {
    knots: Vec<&'a KnotVector>,
    points: &'a [[f64; 3]],
    weights: &'a [f64],
}

impl<'a> Net<'a> {
    /// The knot vectors, one for each parameter.
    #[must_use]
    pub fn knots(&self) -> &[&'a KnotVector] {
        &self.knots
    }

    /// The control points, the first index fastest.
    #[must_use]
    pub fn points(&self) -> &'a [[f64; 3]] {
        self.points
    }

    /// The weights, one for each control point.
    #[must_use]
    pub fn weights(&self) -> &'a [f64] {
        self.weights
    }

    /// Control points along each parameter.
    #[must_use]
    pub fn counts(&self) -> Vec<usize> {
        self.knots.iter().map(|k| k.control_points()).collect()
    }

    /// Whether a weight is not 1.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.weights.iter().any(|&w| w != 1.0)
    }

    /// `"curve"`, `"surface"` or `"volume"`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        ["curve", "surface", "volume"][self.knots.len().clamp(1, 3) - 1]
    }
}

impl<'a> From<&'a NurbsCurve<3>> for Net<'a> {
    fn from(curve: &'a NurbsCurve<3>) -> Self {
        Self {
            knots: vec![curve.knots()],
            points: curve.control_points(),
            weights: curve.weights(),
        }
    }
}

impl<'a> From<&'a NurbsSurface> for Net<'a> {
    fn from(surface: &'a NurbsSurface) -> Self {
        Self::tensor(surface)
    }
}

impl<'a> From<&'a NurbsVolume> for Net<'a> {
    fn from(volume: &'a NurbsVolume) -> Self {
        Self::tensor(volume)
    }
}

impl<'a> Net<'a> {
    fn tensor<const N: usize>(tensor: &'a NurbsTensor<N>) -> Self {
        Self {
            knots: tensor.knots().iter().collect(),
            points: tensor.control_points(),
            weights: tensor.weights(),
        }
    }
}

impl<'a> From<&'a Spline> for Net<'a> {
    fn from(spline: &'a Spline) -> Self {
        match spline {
            Spline::Curve(curve) => Self::from(curve),
            Spline::Surface(surface) => Self::from(surface),
            Spline::Volume(volume) => Self::from(volume),
        }
    }
}

/// The view of each spline.
pub(super) fn nets<'a, T>(splines: &'a [T]) -> Vec<Net<'a>>
where
    Net<'a>: From<&'a T>,
{
    splines.iter().map(Net::from).collect()
}

/// The kind of all the splines, where there is one.
pub(super) fn common_kind(nets: &[Net<'_>], format: Format) -> Result<&'static str, ExchangeError> {
    let unwritable = |index, what: String| ExchangeError::Unwritable {
        place: Place::Spline(index),
        format,
        what,
    };
    let Some(first) = nets.first() else {
        return Err(unwritable(0, "there is none; give at least one".into()));
    };
    match nets.iter().position(|net| net.kind() != first.kind()) {
        None => Ok(first.kind()),
        Some(index) => Err(unwritable(
            index,
            format!(
                "it is a {} and the first is a {}; a file holds one kind, so write them apart",
                nets[index].kind(),
                first.kind()
            ),
        )),
    }
}

/// A knot vector, or why it is none.
///
/// * `place`: where it stands; asked for only when something is wrong.
/// * `name`: what to call it.
pub(super) fn knot_vector(
    degree: usize,
    knots: Vec<f64>,
    name: &str,
    place: impl FnOnce() -> Place,
) -> Result<KnotVector, ExchangeError> {
    KnotVector::new(degree, knots).map_err(|source| ExchangeError::Spline {
        place: place(),
        part: format!("{name}: "),
        source,
    })
}

/// u, v, w.
pub(super) fn parameter(direction: usize) -> &'static str {
    ["u", "v", "w"][direction.min(2)]
}

/// What a reader has found of a spline.
#[derive(Debug)]
pub(super) struct Parts {
    /// One to three of them.
    pub(super) knots: Vec<KnotVector>,
    /// Cartesian, the first index fastest.
    pub(super) points: Vec<[f64; 3]>,
    /// One for each point.
    pub(super) weights: Vec<f64>,
}

impl Parts {
    /// The spline.
    ///
    /// * `place`: where it stands; asked for only when something is wrong.
    pub(super) fn build(self, place: impl FnOnce() -> Place) -> Result<Spline, ExchangeError> {
        let Self {
            knots,
            points,
            weights,
        } = self;
        let built = match <[KnotVector; 1]>::try_from(knots) {
            Ok([u]) => NurbsCurve::new(u, points, weights).map(Spline::Curve),
            Err(knots) => match <[KnotVector; 2]>::try_from(knots) {
                Ok(uv) => NurbsTensor::new(uv, points, weights).map(Spline::Surface),
                Err(knots) => match <[KnotVector; 3]>::try_from(knots) {
                    Ok(uvw) => NurbsTensor::new(uvw, points, weights).map(Spline::Volume),
                    Err(knots) => Err(NurbsError::Length {
                        what: "the list of knot vectors",
                        found: knots.len(),
                        expected: 3,
                    }),
                },
            },
        };
        built.map_err(|source| ExchangeError::Spline {
            place: place(),
            part: String::new(),
            source,
        })
    }
}

/// How many control points the knot vectors ask for.
pub(super) fn net_size(
    knots: &[KnotVector],
    place: impl FnOnce() -> Place,
) -> Result<usize, ExchangeError> {
    knots
        .iter()
        .try_fold(1_usize, |n, k| n.checked_mul(k.control_points()))
        .ok_or_else(|| ExchangeError::Unsupported {
            place: place(),
            what: "the control points are too many to be counted".into(),
        })
}
