//! Solids as exact trivariate NURBS, in their places.
//!
//! ```text
//!   volume                  its own nets
//!   cylinder, cone, sphere  segment or half circle x disc, of a partial turn x arc after ruling to the axis
//!   torus                   disc x circle, where the tube does not cross the axis
//!   revolve                 as a volume of construct = "curve-disc", where its profile is one chain to the
//!                           axis along which z never turns back; else as sections of construct =
//!                           "surface-circle" (see [`super::sections`])
//!   ellipsoid               the ball of radius 1, stretched
//!   box                     one patch of degrees 1, 1, 1
//! ```
//!
//! * Units: scene units; angles in degrees.
//! * Accuracy: control points are those of [`crate::construct`], placed in double-double and rounded once;
//!   those of an ellipsoid have one rounding more. Weights and knots are not changed.
//! * Not every solid of revolution has such a form here: what neither chain nor sections can hold is refused.

use super::build::{placing, region, rules};
use super::model::{Boundary, SceneModel, SolidKind, SolidModel, TurnModel};
use super::{nets, sections};
use crate::construct::{
    AngleInterval, AxisFrame, ConstructError, Construction, DiscForm, solid_of_revolution,
    sphere_profile, sphere_volume, torus_volume,
};
use crate::error::Error;
use crate::math::{Dd, Real, Similarity};
use crate::nurbs::{KnotVector, NurbsCurve, NurbsError, NurbsVolume};
use crate::solid::{Body, Shape};

/// The volumes of a solid.
///
/// * `body`: what was made of it.
pub(super) fn volumes(
    model: &SceneModel,
    solid: &SolidModel,
    body: &Body,
) -> Result<Vec<NurbsVolume>, Error> {
    let refused = |found: String| {
        let wanted = "a solid that is a NURBS volume";
        let hint = "`mesh` writes the boundary of every solid".to_owned();
        Error::from(model.error(solid.place, &solid.path, Some(found), wanted, Some(hint)))
    };
    let local = match (&solid.kind, body) {
        (SolidKind::Volume(_), Body::Patches(patches)) => patches.volumes().to_vec(),
        (SolidKind::Volume(_), _) => {
            return Err(refused("the union of discs that overlap".to_owned()));
        }
        (SolidKind::Revolve { profile, turn }, _) => {
            revolved(model, solid, *profile, closed(*turn), &refused)?
        }
        (SolidKind::Round { shape, turn }, _) => {
            vec![round(*shape, closed(*turn)).map_err(|e| refused(e.to_string()))?]
        }
        (SolidKind::Ellipsoid { radii }, _) => {
            let made = ellipsoid(*radii).map_err(|e| refused(e.to_string()));
            vec![made?]
        }
        (SolidKind::Box { size }, _) => vec![block(*size).map_err(|e| refused(e.to_string()))?],
    };
    let placing = placing(model, solid)?;
    // The nets of a body are those of its frame; the others are not yet reflected.
    let reflect = placing.mirrored && !matches!(body, Body::Patches(_));
    let clockwise = match &solid.kind {
        SolidKind::Revolve { turn, .. } | SolidKind::Round { turn, .. } => {
            closed(*turn).angle < 0.0
        }
        _ => false,
    };
    // Programs that read the nets want the Jacobian determinant positive, as it was before.
    let reverse = placing.mirrored != clockwise;
    let place = |volume: &NurbsVolume| -> Result<NurbsVolume, NurbsError> {
        let mut volume = volume.clone();
        if reflect {
            volume = nets::mirrored(&volume)?;
        }
        if reverse {
            volume = volume.reverse(2)?;
        }
        placed(&placing.frame, &volume)
    };
    (local.iter().map(place))
        .collect::<Result<_, _>>()
        .map_err(|e| refused(e.to_string()))
}

/// The same turn; a full one counter-clockwise, since it is the same solid either way.
fn closed(turn: TurnModel) -> TurnModel {
    match turn.angle {
        -360.0 => TurnModel {
            angle: 360.0,
            ..turn
        },
        _ => turn,
    }
}

/// The volumes of a turned profile: of its chain, or of its region where that can be filled.
fn revolved(
    model: &SceneModel,
    solid: &SolidModel,
    profile: usize,
    turn: TurnModel,
    refused: &dyn Fn(String) -> Error,
) -> Result<Vec<NurbsVolume>, Error> {
    let data = &model.profiles[profile].1;
    let filled = || -> Result<Vec<NurbsVolume>, String> {
        let region = region(data, &rules(data)).map_err(|e| e.to_string())?;
        let turn = AngleInterval::new(turn.start, turn.angle).map_err(|e| e.to_string())?;
        sections::volumes(data, &region, turn)
    };
    if data.boundary == Boundary::Closed {
        return filled().map_err(refused);
    }
    nets::revolved(model, solid, profile, turn).or_else(|error| filled().map_err(|_| error))
}

fn round(shape: Shape, turn: TurnModel) -> Result<NurbsVolume, ConstructError> {
    let turn = AngleInterval::new(turn.start, turn.angle)?;
    let world = &AxisFrame::WORLD;
    let by = if turn.is_full() {
        Construction::CurveDisc(DiscForm::Biquadratic)
    } else {
        Construction::CurveToAxis
    };
    let side = |radii: [f64; 2], height: f64| {
        let points = vec![[radii[0], 0.0], [radii[1], height]];
        let segment = NurbsCurve::polynomial(KnotVector::bezier(1)?, points)?;
        solid_of_revolution(&segment, by, turn, world)
    };
    match shape {
        Shape::Torus { major, minor } => {
            torus_volume(major, minor, Construction::SurfaceCircle, turn, world)
        }
        Shape::Cylinder { radius, height } => side([radius; 2], height),
        Shape::Cone {
            radius1,
            radius2,
            height,
        } => side([radius1, radius2], height),
        Shape::Sphere { radius } => solid_of_revolution(&sphere_profile(radius)?, by, turn, world),
    }
}

/// The unit ball stretched along its axes: what is affine moves the control points.
fn ellipsoid(radii: [f64; 3]) -> Result<NurbsVolume, ConstructError> {
    let by = Construction::CurveDisc(DiscForm::Biquadratic);
    let ball = sphere_volume(1.0, by, AngleInterval::FULL, &AxisFrame::WORLD)?;
    let stretched = ball.control_points().iter();
    let points = stretched.map(|p| std::array::from_fn(|k| p[k] * radii[k]));
    Ok(NurbsVolume::new(
        ball.knots().clone(),
        points.collect(),
        ball.weights().to_vec(),
    )?)
}

fn block(size: [f64; 3]) -> Result<NurbsVolume, NurbsError> {
    let corner = |i: usize| -> [f64; 3] {
        std::array::from_fn(|k| if i >> k & 1 == 1 { 0.5 } else { -0.5 } * size[k])
    };
    let line = || KnotVector::bezier(1);
    NurbsVolume::new(
        [line()?, line()?, line()?],
        (0..8).map(corner).collect(),
        vec![1.0; 8],
    )
}

/// The volume in scene coordinates.
fn placed(frame: &Similarity, volume: &NurbsVolume) -> Result<NurbsVolume, NurbsError> {
    let (axes, scale) = ([0, 1, 2].map(|i| frame.axis_exact(i)), frame.scale_exact());
    let origin = frame.origin_exact();
    let place = |p: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| {
            let along = (0..3).fold(Dd::ZERO, |sum, i| sum + axes[i][k] * Dd::of(p[i]));
            (origin[k] + scale * along).f64()
        })
    };
    NurbsVolume::new(
        volume.knots().clone(),
        volume.control_points().iter().map(place).collect(),
        volume.weights().to_vec(),
    )
}
