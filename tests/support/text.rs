//! Scene text from a scene's data, scaled and placed anew.

use std::fmt::Write;

use voxlathe::scene::{
    Boundary, CurveKind, CurveModel, Fill, Operation, PlaceStep, PointModel, SceneModel, SolidKind,
    TurnModel,
};

/// The scene with every length multiplied by `scale` and `steps` (items of a `place` list) appended
/// to the place of every solid.
pub(crate) fn scene_text(model: &SceneModel, scale: f64, steps: &str) -> String {
    let mut text = String::from("schema = 1\n");
    for (i, (_, profile)) in model.profiles.iter().enumerate() {
        let boundary = match profile.boundary {
            Boundary::ToAxis => "to-axis",
            _ => "closed",
        };
        let fill = match profile.fill {
            Fill::NonZero => "nonzero",
            _ => "even-odd",
        };
        writeln!(
            text,
            "[profiles.p{i}]\nboundary = '{boundary}'\nfill = '{fill}'"
        )
        .expect("text");
        let list = |curves: &Vec<CurveModel>| {
            let curves: Vec<String> = curves.iter().map(|c| curve_text(c, scale)).collect();
            format!("[{}]", curves.join(", "))
        };
        if let Some(curves) = &profile.curves {
            writeln!(text, "curves = {}", list(curves)).expect("text");
        }
        if !profile.loops.is_empty() {
            let loops: Vec<String> = profile.loops.iter().map(list).collect();
            writeln!(text, "loops = [{}]", loops.join(", ")).expect("text");
        }
    }
    for solid in &model.solids {
        let SolidKind::Revolve {
            profile,
            turn: TurnModel { angle, start, .. },
        } = &solid.kind
        else {
            unreachable!("a solid these tests do not know")
        };
        let axis = &solid.axis;
        let x = axis.x.map_or(String::new(), |x| format!(", x = {x:?}"));
        let mut places: Vec<String> = solid
            .steps
            .iter()
            .map(|step| match step {
                PlaceStep::Scale(factor) => format!("{{ scale = {factor:?} }}"),
                PlaceStep::Rotate { axis, degrees } => {
                    format!("{{ rotate = {{ axis = {axis:?}, degrees = {degrees:?} }} }}")
                }
                PlaceStep::Translate(by) => {
                    format!("{{ translate = {:?} }}", by.map(|x| x * scale))
                }
                _ => unreachable!("a step these tests do not know"),
            })
            .collect();
        if !steps.is_empty() {
            places.push(steps.to_owned());
        }
        let operation = match solid.operation {
            Operation::Subtract => "subtract",
            Operation::Intersect => "intersect",
            _ => "add",
        };
        writeln!(
            text,
            "[[solid]]\nname = {:?}\nkind = 'revolve'\nprofile = 'p{profile}'\nangle = {angle:?}\n\
             start = {start:?}\nmaterial = {}\naxis = {{ origin = {:?}, direction = {:?}{x} }}\n\
             place = [{}]\noperation = '{operation}'",
            solid.name,
            solid.material,
            axis.origin.map(|o| o * scale),
            axis.direction,
            places.join(", "),
        )
        .expect("text");
    }
    text
}

fn curve_text(curve: &CurveModel, scale: f64) -> String {
    let list = |points: &[PointModel]| {
        let points: Vec<String> = points
            .iter()
            .map(|p| format!("[{:?}, {:?}]", p.r * scale, p.z * scale))
            .collect();
        format!("[{}]", points.join(", "))
    };
    let pair = |p: &[f64; 2]| format!("{:?}", p.map(|x| x * scale));
    let kind = match &curve.kind {
        CurveKind::Nurbs {
            degree,
            points,
            weights,
            knots,
        } => format!(
            "kind = 'nurbs', degree = {degree}, points = {}, weights = {weights:?}, \
             knots = {knots:?}",
            list(points)
        ),
        CurveKind::Bezier { points, weights } => {
            format!(
                "kind = 'bezier', points = {}, weights = {weights:?}",
                list(points)
            )
        }
        CurveKind::Polyline { points } => format!("kind = 'polyline', points = {}", list(points)),
        CurveKind::Arc {
            center,
            radius,
            from,
            to,
        } => format!(
            "kind = 'arc', center = {}, radius = {:?}, from = {from:?}, to = {to:?}",
            pair(center),
            radius * scale
        ),
        CurveKind::Circle { center, radius } => format!(
            "kind = 'circle', center = {}, radius = {:?}",
            pair(center),
            radius * scale
        ),
        CurveKind::Ellipse {
            center,
            radii,
            tilt,
        } => format!(
            "kind = 'ellipse', center = {}, radii = {}, tilt = {tilt:?}",
            pair(center),
            pair(radii)
        ),
        CurveKind::Interpolate { points, degree, .. } => {
            format!(
                "kind = 'interpolate', points = {}, degree = {degree}",
                list(points)
            )
        }
        _ => unreachable!("a curve these tests do not know"),
    };
    format!("{{ {kind}, reverse = {} }}", curve.reverse)
}
