//! Profiles and their curves: from values to the model.

use super::error::{At, Fault, Place, Sources, push_index, push_key};
use super::fields::{
    Fields, LENGTH, WEIGHT, boolean, choice, choices, each, elements, find, finite, integer,
    kinded, length, missing, number, string, tuple,
};
use super::keys;
use super::limits::MAX_DEGREE;
use super::model::{Across, Boundary, CurveKind, CurveModel, Fill, PointModel, ProfileModel};
use super::points::PointFiles;
use super::value::{Entry, Kind, Value};
use crate::math::tolerance::GAP;
use crate::region::MAX_GAP;

/// Reads `[profiles.NAME]`, which is at `path`.
pub(super) fn profile(
    value: &Value,
    path: String,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<ProfileModel, Fault> {
    let fields = Fields::new(value, keys::PROFILE, "a table: a profile")?;
    let boundary = fields
        .read("boundary", |value| choice(value, choices!(Boundary)))?
        .unwrap_or(Boundary::Closed);
    let fill = fields
        .read("fill", |value| choice(value, choices!(Fill)))?
        .unwrap_or(Fill::EvenOdd);
    let gap = fields.read("gap", |value| {
        let wanted = format!("a share of the profile's size from 0 to {MAX_GAP:e}");
        number(value, &wanted, |x| (0.0..=MAX_GAP).contains(&x))
    })?;
    let across = fields.read("across", |value| choice(value, choices!(Across)))?;
    let mut inner = path.clone();
    push_key(&mut inner, "curves");
    let curves = fields.read("curves", |value| curves(value, &inner, files, sources))?;
    let mut inner = path.clone();
    push_key(&mut inner, "loops");
    let loops = fields.read("loops", |value| {
        let wanted = "an array of loops, each an array of curves";
        let list = elements(value, wanted)?;
        if list.is_empty() {
            return Err(Fault::value(value.place, wanted));
        }
        each(list, |index, element| {
            let mut inner = inner.clone();
            push_index(&mut inner, index);
            self::curves(element, &inner, files, sources)
        })
    })?;
    match (boundary, &curves, &loops) {
        (Boundary::Closed, Some(_), Some(_)) => {
            let place = fields.get("loops").map_or(value.place, |v| v.place);
            return Err(Fault::found(
                place,
                "`loops` together with `curves`",
                "either curves, for one loop, or loops",
            )
            .at_key("loops"));
        }
        (Boundary::Closed, None, None) => {
            return Err(missing(value.place, "curves", "curves, or loops"));
        }
        (Boundary::ToAxis, None, _) => {
            let wanted = "the open chain of a profile with boundary to-axis";
            return Err(missing(value.place, "curves", wanted));
        }
        _ => {}
    }
    Ok(ProfileModel {
        boundary,
        fill,
        gap: gap.unwrap_or(GAP),
        across: across.unwrap_or(Across::Refuse),
        curves,
        loops: loops.unwrap_or_default(),
        place: value.place,
        path,
    })
}

fn curves(
    value: &Value,
    path: &str,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<Vec<CurveModel>, Fault> {
    let wanted = "an array of at least one curve";
    let list = match &value.kind {
        Kind::Table(entries) => {
            let hint = if path.ends_with(']') {
                Some(loops_hint(entries))
            } else {
                let name = header(path);
                name.map(|name| format!("in toml write [[{name}]], with two brackets"))
            };
            return Err(value.wrong_type(wanted).with_hint(hint));
        }
        _ => elements(value, wanted)?,
    };
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    each(list, |index, element| {
        let mut path = path.to_owned();
        push_index(&mut path, index);
        curve(element, path, files, sources)
    })
}

/// What to write where a loop is a table.
fn loops_hint(entries: &[Entry]) -> String {
    let circle = "{ kind = \"circle\", center = [3, 0], radius = 1 }";
    match (find(entries, "boundary"), find(entries, "kind")) {
        (Some(_), _) => format!(
            "a loop is an array of curves, loops = [[{circle}]]; boundary stands beside loops, and with \"to-axis\" the open chain is curves"
        ),
        (None, Some(_)) => format!("each loop has brackets of its own: loops = [[{circle}]]"),
        _ => format!("a loop is an array of curves: loops = [[{circle}]]"),
    }
}

/// A path as the header of a TOML table; none where a key cannot be shown as it is.
fn header(path: &str) -> Option<&str> {
    let whole = !path.contains("...") && !path.contains('\\');
    let valid = || toml::de::DeTable::parse(&format!("[[{path}]]")).is_ok();
    (whole && valid()).then_some(path)
}

fn curve(
    value: &Value,
    path: String,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<CurveModel, Fault> {
    let (kind, fields) = kinded(value, keys::CURVES, "a table: a curve")?;
    let reverse = fields.read("reverse", boolean)?.unwrap_or(false);
    let kind = match kind {
        "nurbs" => {
            let degree = fields.need("degree", "the degree, an integer", degree)?;
            let (points, file_weights) = points(&fields, files, sources)?;
            if degree >= points.len() {
                let place = fields.get("degree").map_or(value.place, |v| v.place);
                let wanted = format!("a degree below {}, the number of points", points.len());
                return Err(Fault::value(place, wanted).at_key("degree"));
            }
            let weights = weights(&fields, points.len(), file_weights)?;
            let knots = fields
                .read("knots", |value| {
                    knots(value, points.len(), degree, degree + 1)
                })?
                .unwrap_or_else(|| clamped_uniform(points.len(), degree));
            CurveKind::Nurbs {
                degree,
                points,
                weights,
                knots,
            }
        }
        "bezier" => {
            let (points, file_weights) = points(&fields, files, sources)?;
            if points.len() > MAX_DEGREE + 1 {
                let place = fields.get("points").map_or(value.place, |v| v.place);
                return Err(Fault::found(
                    place,
                    format!("{} points", points.len()),
                    format!("at most {} points, for degree {MAX_DEGREE}", MAX_DEGREE + 1),
                )
                .at_key("points"));
            }
            let weights = weights(&fields, points.len(), file_weights)?;
            CurveKind::Bezier { points, weights }
        }
        "polyline" => CurveKind::Polyline {
            points: unweighted_points(&fields, files, sources)?,
        },
        "interpolate" => interpolate(&fields, unweighted_points(&fields, files, sources)?)?,
        "arc" => {
            let center = center(&fields)?;
            let radius = fields.need("radius", LENGTH, length)?;
            let wanted = "an angle in degrees, from +r towards +z";
            let from = fields.need("from", wanted, finite)?;
            let to = fields.need("to", wanted, |value| {
                number(
                    value,
                    &format!("an angle other than {from} and within 360 of it"),
                    |to| to != from && (to - from).abs() <= 360.0,
                )
            })?;
            CurveKind::Arc {
                center,
                radius,
                from,
                to,
            }
        }
        "circle" => CurveKind::Circle {
            center: center(&fields)?,
            radius: fields.need("radius", LENGTH, length)?,
        },
        _ => CurveKind::Ellipse {
            center: center(&fields)?,
            radii: fields.need("radii", "two half axes", |value| {
                tuple(value, "two half axes, each greater than 0", length)
            })?,
            tilt: fields.read("tilt", finite)?.unwrap_or(0.0),
        },
    };
    Ok(CurveModel {
        kind,
        reverse,
        place: value.place,
        path,
    })
}

/// The spline through those points.
fn interpolate(fields: &Fields<'_>, points: Vec<PointModel>) -> Result<CurveKind, Fault> {
    let closed = fields.read("closed", boolean)?.unwrap_or(false);
    let given = fields.read("degree", degree)?;
    let refused = |key: &str, found: String, wanted: &str| {
        let place = fields.get(key).map_or(fields.place(), |v| v.place);
        Err(Fault::found(place, found, wanted).at_key(key))
    };
    let mut tangents = [None; 2];
    for (tangent, key) in tangents.iter_mut().zip(["start-tangent", "end-tangent"]) {
        *tangent = fields.read(key, |value| tuple(value, "a derivative [dr, dz]", finite))?;
        if closed && tangent.is_some() {
            let found = format!("`{key}` together with closed = true");
            return refused(key, found, "either, since a closed curve has no ends");
        }
        if tangent.is_some() && given == Some(1) {
            let found = format!("`{key}` together with degree = 1");
            return refused(
                key,
                found,
                "degree 2 or more, since segments have no tangent to choose",
            );
        }
    }
    let degree = given.unwrap_or(3);
    if closed && points.len() < 3 {
        let found = format!("{} points", points.len());
        return refused("points", found, "at least 3 points for closed = true");
    }
    if closed && degree.is_multiple_of(2) {
        let wanted = "an odd degree for closed = true";
        return refused("degree", degree.to_string(), wanted);
    }
    let conditions = points.len() + tangents.iter().flatten().count();
    Ok(CurveKind::Interpolate {
        degree: if closed {
            degree
        } else {
            degree.min(conditions - 1)
        },
        points,
        closed,
        tangents,
    })
}

fn degree(value: &Value) -> Result<usize, Fault> {
    const HIGH: u32 = MAX_DEGREE as u32;
    integer(value, 1, HIGH).map(|degree| degree as usize)
}

fn center(fields: &Fields<'_>) -> Result<[f64; 2], Fault> {
    fields.need("center", "a point [r, z]", |value| {
        tuple(value, "a point [r, z]", finite)
    })
}

/// Weights that came with the points of a file, and where the first of them is.
type FileWeights = Option<(Vec<f64>, Place)>;

fn points(
    fields: &Fields<'_>,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<(Vec<PointModel>, FileWeights), Fault> {
    let wanted = "an array of at least 2 points [r, z], or { file = \"points.csv\" }";
    fields.need("points", wanted, |value| {
        let (points, weights) = match &value.kind {
            Kind::Table(_) => {
                let table = Fields::new(value, keys::POINTS_FILE, wanted)?;
                let found = table.need("file", "the name of a file of points", |value| {
                    let file = string(value, "the name of a file")?;
                    if file.is_empty() || file.contains('\0') {
                        return Err(Fault::value(value.place, "the name of a file"));
                    }
                    let found = files.read(file, value.place, sources);
                    found.map(|found| (found, value.place))
                });
                let (found, place) = found?;
                if found.points.len() < 2 {
                    return Err(
                        Fault::found(place, "one point in the file", "at least 2 points")
                            .at_key("file"),
                    );
                }
                let weights = found.weights.map(|weights| (weights, found.weight_place));
                (found.points, weights)
            }
            _ => {
                let list = elements(value, wanted)?;
                let points = each(list, |_, element| {
                    let point: [f64; 2] = tuple(element, "a point [r, z]", finite)?;
                    Ok(PointModel {
                        r: point[0],
                        z: point[1],
                        place: element.place,
                    })
                })?;
                (points, None)
            }
        };
        if points.len() < 2 {
            return Err(Fault::value(value.place, "at least 2 points [r, z]"));
        }
        Ok((points, weights))
    })
}

fn unweighted_points(
    fields: &Fields<'_>,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<Vec<PointModel>, Fault> {
    let (points, weights) = points(fields, files, sources)?;
    match weights {
        None => Ok(points),
        Some((_, place)) => Err(Fault::value(
            place,
            "r and z alone: only nurbs and bezier curves have weights",
        )
        .at_key("points")),
    }
}

fn weights(fields: &Fields<'_>, count: usize, from_file: FileWeights) -> Result<Vec<f64>, Fault> {
    let given = fields.read("weights", |value| {
        if from_file.is_some() {
            return Err(Fault::found(
                value.place,
                "`weights` together with weights in the file of points",
                "weights in one place",
            ));
        }
        let list = elements(value, "an array of numbers")?;
        if list.len() != count {
            return Err(Fault::found(
                value.place,
                format!("{} weights", list.len()),
                format!("{count}, one for each point"),
            ));
        }
        each(list, |_, value| number(value, WEIGHT, |x| x > 0.0))
    })?;
    Ok(given
        .or(from_file.map(|(weights, _)| weights))
        .unwrap_or_else(|| vec![1.0; count]))
}

/// A knot vector for that many points.
///
/// * `inside`: how many knots may be equal inside the domain: `degree`, or one more where the curve may fall into two.
pub(super) fn knots(
    value: &Value,
    points: usize,
    degree: usize,
    inside: usize,
) -> Result<Vec<f64>, Fault> {
    let list = elements(value, "an array of numbers")?;
    let needed = points + degree + 1;
    if list.len() != needed {
        return Err(Fault::found(
            value.place,
            format!("{} knots", list.len()),
            format!("{needed}: {points} points + degree {degree} + 1"),
        ));
    }
    let mut knots: Vec<f64> = Vec::with_capacity(needed);
    let mut multiplicity = 0;
    for (index, element) in list.iter().enumerate() {
        let knot = finite(element).at_index(index)?;
        match knots.last() {
            Some(last) if *last > knot => {
                let wanted = format!("a knot not below the one before it, {last:?}");
                return Err(Fault::value(element.place, wanted).at_index(index));
            }
            Some(last) if *last == knot => multiplicity += 1,
            _ => multiplicity = 1,
        }
        if multiplicity > degree + 1 {
            let wanted = format!("at most {} equal knots for degree {degree}", degree + 1);
            return Err(Fault::value(element.place, wanted).at_index(index));
        }
        knots.push(knot);
    }
    let (low, high) = (knots[degree], knots[points]);
    if low >= high {
        return Err(Fault::found(
            value.place,
            format!("a domain from {low:?} to {high:?}"),
            format!("knots with knots[{degree}] below knots[{points}]"),
        ));
    }
    // Where degree + 1 knots inside the domain are equal, what they are of falls apart.
    for index in inside + 1..points {
        let knot = knots[index];
        if knot > low && knot < high && knots[index - inside] == knot {
            let wanted =
                format!("at most {inside} equal knots inside the domain, for degree {degree}");
            return Err(Fault::value(list[index].place, wanted).at_index(index));
        }
    }
    Ok(knots)
}

/// The clamped knot vector on [0, 1] whose interior knots are evenly spaced.
fn clamped_uniform(points: usize, degree: usize) -> Vec<f64> {
    let spans = points - degree;
    #[allow(
        clippy::cast_precision_loss,
        reason = "counts of points held in memory are below 2^53"
    )]
    let interior = (1..spans).map(|i| i as f64 / spans as f64);
    std::iter::repeat_n(0.0, degree + 1)
        .chain(interior)
        .chain(std::iter::repeat_n(1.0, degree + 1))
        .collect()
}
