//! geomdl (NURBS-Python) JSON: splines of one kind.
//!
//! ```text
//!   { "shape": { "type": "curve" | "surface" | "volume", "count": n, "data": [ spline, .. ] } }
//!
//!   spline   "rational", "dimension"
//!            "degree", "knotvector"                                         of curves
//!            "degree_u", "knotvector_u", "size_u", the same for v and w      of the others
//!            "control_points": { "points": [[x, y, z], ..], "weights": [w, ..] }
//! ```
//!
//! Points are Cartesian; weights stand apart. In a surface **v is the fastest index**, then u; a volume is
//! such layers, one for each index along w.
//!
//! * Units: those of the file.
//! * Limits: trimming curves are passed over, with a note. Places in messages are paths of names; line and
//!   column are known for text that is no JSON only.
//! * Source: geomdl, *Supported File Formats*.

use std::fmt::Write as _;

use serde_json::{Map, Value};

use super::error::{brief, quoted};
use super::evidence::Agreement;
use super::spline::{Parts, knot_vector, nets, parameter};
use super::{ExchangeError, Format, Net, Place, Reading};
use crate::nurbs::KnotVector;

/// The splines of a text.
///
/// # Errors
/// [`ExchangeError::Syntax`] for text that is no JSON; [`ExchangeError::Unexpected`],
/// [`ExchangeError::Unsupported`] and [`ExchangeError::Spline`] with the path of names.
///
/// ```
/// # use voxlathe::exchange::{Spline, geomdl};
/// let text = r#"{"shape": {"type": "surface", "data": [{
///     "degree_u": 1, "knotvector_u": [0, 0, 1, 1], "size_u": 2,
///     "degree_v": 1, "knotvector_v": [0, 0, 1, 1], "size_v": 2,
///     "control_points": {"points": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 5]]}}]}}"#;
/// let Spline::Surface(patch) = &geomdl::read(text)?.splines[0] else { panic!("a surface") };
/// assert_eq!(patch.control_points()[1], [1.0, 0.0, 0.0]);
/// # Ok::<(), voxlathe::exchange::ExchangeError>(())
/// ```
pub fn read(text: &str) -> Result<Reading, ExchangeError> {
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let reason = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        ExchangeError::Syntax {
            place: Place::Line {
                line: error.line(),
                column: error.column(),
            },
            format: "JSON",
            reason: brief(reason.strip_suffix(&place).unwrap_or(&reason)),
        }
    })?;
    let root = Node::of("", &value)?;
    let shape = root.child("shape")?;
    let kind = shape.required("type")?;
    let parameters = match kind.as_str() {
        Some("curve") => 1,
        Some("surface") => 2,
        Some("volume") => 3,
        _ => return Err(shape.unexpected("type", kind, "\"curve\", \"surface\" or \"volume\"")),
    };
    let data = shape.list("data")?;
    if let Some(count) = shape.optional("count")
        && count.as_u64() != u64::try_from(data.len()).ok()
    {
        let wanted = format!("the length of the list of data, {}", data.len());
        return Err(shape.unexpected("count", count, &wanted));
    }
    if data.is_empty() {
        return Err(shape.unexpected("data", shape.required("data")?, "at least one spline"));
    }
    let mut reading = Reading::new(Format::Geomdl);
    for (index, item) in data.iter().enumerate() {
        let node = Node::of(&format!("shape.data[{index}]"), item)?;
        read_spline(&node, parameters, &mut reading)?;
    }
    Ok(reading)
}

fn read_spline(
    node: &Node<'_>,
    parameters: usize,
    reading: &mut Reading,
) -> Result<(), ExchangeError> {
    let mut knots = Vec::new();
    for direction in 0..parameters {
        let name = |what: &str| match parameters {
            1 => what.to_string(),
            _ => format!("{what}_{}", parameter(direction)),
        };
        let degree = node.whole(&name("degree"))?;
        let key = name("knotvector");
        let values = node.numbers(&key)?;
        let found = knot_vector(degree, values, "knot vector", || node.place(&key))?;
        let size = name("size");
        if parameters > 1 || node.optional(&size).is_some() {
            let given = node.whole(&size)?;
            if given != found.control_points() {
                let wanted = format!(
                    "{}, as many as the knots ask for at degree {degree}",
                    found.control_points()
                );
                return Err(node.unexpected(&size, node.required(&size)?, &wanted));
            }
        }
        knots.push(found);
    }
    let net = node.child("control_points")?;
    let (points, flat) = read_points(node, &net)?;
    let weights = read_weights(node, &net, points.len(), reading)?;
    if flat {
        reading.note_flat(|| net.place("points"));
    }
    let counts: Vec<_> = knots.iter().map(KnotVector::control_points).collect();
    let size = counts.iter().copied().fold(1, usize::saturating_mul);
    if size != points.len() {
        return Err(ExchangeError::Unexpected {
            place: net.place("points"),
            found: format!("{} points", points.len()),
            wanted: format!("{size}, the product of the sizes"),
        });
    }
    let order = from_file_order(&counts);
    let points: Vec<_> = order.iter().map(|&i| points[i]).collect();
    let weights: Vec<_> = order.iter().map(|&i| weights[i]).collect();
    let agreement = Agreement::of(&points, &weights, &counts);
    if agreement.speaks_for_premultiplied() {
        reading.note(
            || net.place("points"),
            || {
                format!(
                    "the coordinates are taken as Cartesian, as the format has it, but they look \
                     premultiplied by their weights: {agreement}"
                )
            },
        );
    }
    if node.optional("trims").is_some_and(|trims| {
        trims.as_array().is_none_or(|list| !list.is_empty())
            && trims.as_object().is_none_or(|map| !map.is_empty())
            && !trims.is_null()
    }) {
        reading.note(
            || node.place("trims"),
            || "the trimming curves are passed over; the whole surface is read".into(),
        );
    }
    let parts = Parts {
        knots,
        points,
        weights,
    };
    reading.splines.push(parts.build(|| node.here())?);
    Ok(())
}

/// The points, and whether they have two coordinates.
fn read_points(node: &Node<'_>, net: &Node<'_>) -> Result<(Vec<[f64; 3]>, bool), ExchangeError> {
    let list = net.list("points")?;
    let dimension = match node.optional("dimension") {
        Some(_) => node.whole("dimension")?,
        None => list.first().and_then(Value::as_array).map_or(3, Vec::len),
    };
    if !(2..=3).contains(&dimension) {
        return Err(ExchangeError::Unexpected {
            place: node.place("dimension"),
            found: format!("points of {dimension} coordinates"),
            wanted: "2 or 3".into(),
        });
    }
    let mut points = Vec::new();
    for (index, item) in list.iter().enumerate() {
        let place = || net.place(&format!("points[{index}]"));
        let coordinates = item.as_array().filter(|list| list.len() == dimension);
        let coordinates = coordinates.ok_or_else(|| ExchangeError::Unexpected {
            place: place(),
            found: shown(item),
            wanted: format!("a list of {dimension} coordinates"),
        })?;
        let mut point = [0.0; 3];
        for (axis, value) in coordinates.iter().enumerate() {
            point[axis] = value.as_f64().ok_or_else(|| ExchangeError::Unexpected {
                place: place(),
                found: shown(value),
                wanted: format!("coordinate {axis}, a number"),
            })?;
        }
        points.push(point);
    }
    Ok((points, dimension == 2))
}

fn read_weights(
    node: &Node<'_>,
    net: &Node<'_>,
    points: usize,
    reading: &mut Reading,
) -> Result<Vec<f64>, ExchangeError> {
    let rational = match node.optional("rational") {
        None => None,
        Some(value) => Some(
            value
                .as_bool()
                .ok_or_else(|| node.unexpected("rational", value, "true or false"))?,
        ),
    };
    if net.optional("weights").is_none_or(Value::is_null) {
        if rational == Some(true) {
            reading.note(
                || net.here(),
                || "the spline is rational without weights; they are taken as 1".into(),
            );
        }
        return Ok(vec![1.0; points]);
    }
    let weights = net.numbers("weights")?;
    if weights.len() != points {
        return Err(ExchangeError::Unexpected {
            place: net.place("weights"),
            found: format!("{} weights", weights.len()),
            wanted: format!("{points}, one for each point"),
        });
    }
    // Named as the file has them: its order is not ours.
    if let Some(i) = weights.iter().position(|w| !(*w > 0.0 && w.is_finite())) {
        return Err(ExchangeError::Unexpected {
            place: net.place(&format!("weights[{i}]")),
            found: weights[i].to_string(),
            wanted: "a weight, finite and greater than zero".into(),
        });
    }
    if rational == Some(false) && weights.iter().any(|&w| w != 1.0) {
        return Err(ExchangeError::Unsupported {
            place: net.place("weights"),
            what: "there are weights other than 1, yet \"rational\" is false; correct one of them"
                .into(),
        });
    }
    Ok(weights)
}

/// For each control point, the first index fastest, its place in the file, where v is the fastest.
fn from_file_order(counts: &[usize]) -> Vec<usize> {
    let n = |d: usize| counts.get(d).copied().unwrap_or(1);
    let (nu, nv, nw) = (n(0), n(1), n(2));
    let mut order = Vec::with_capacity(nu * nv * nw);
    for w in 0..nw {
        for v in 0..nv {
            for u in 0..nu {
                order.push(v + nv * (u + nu * w));
            }
        }
    }
    order
}

/// An object of the file with the path to it.
struct Node<'a> {
    path: String,
    map: &'a Map<String, Value>,
}

impl<'a> Node<'a> {
    fn of(path: &str, value: &'a Value) -> Result<Self, ExchangeError> {
        let map = value.as_object().ok_or_else(|| ExchangeError::Unexpected {
            place: place(path),
            found: shown(value),
            wanted: "an object".into(),
        })?;
        Ok(Self {
            path: path.into(),
            map,
        })
    }

    fn here(&self) -> Place {
        place(&self.path)
    }

    fn path_of(&self, key: &str) -> String {
        match self.path.as_str() {
            "" => key.into(),
            path => format!("{path}.{key}"),
        }
    }

    fn place(&self, key: &str) -> Place {
        Place::Field(self.path_of(key))
    }

    fn optional(&self, key: &str) -> Option<&'a Value> {
        self.map.get(key)
    }

    fn required(&self, key: &str) -> Result<&'a Value, ExchangeError> {
        self.optional(key).ok_or_else(|| ExchangeError::Unexpected {
            place: self.here(),
            found: "an object without it".into(),
            wanted: format!("the entry {key:?}"),
        })
    }

    fn child(&self, key: &str) -> Result<Self, ExchangeError> {
        Node::of(&self.path_of(key), self.required(key)?)
    }

    fn list(&self, key: &str) -> Result<&'a Vec<Value>, ExchangeError> {
        let value = self.required(key)?;
        value
            .as_array()
            .ok_or_else(|| self.unexpected(key, value, "a list"))
    }

    fn whole(&self, key: &str) -> Result<usize, ExchangeError> {
        let value = self.required(key)?;
        let found = value.as_u64().and_then(|found| usize::try_from(found).ok());
        found.ok_or_else(|| self.unexpected(key, value, "a whole number"))
    }

    fn numbers(&self, key: &str) -> Result<Vec<f64>, ExchangeError> {
        let values = self.list(key)?.iter().enumerate().map(|(index, value)| {
            value
                .as_f64()
                .ok_or_else(|| self.unexpected(&format!("{key}[{index}]"), value, "a number"))
        });
        values.collect()
    }

    fn unexpected(&self, key: &str, value: &Value, wanted: &str) -> ExchangeError {
        ExchangeError::Unexpected {
            place: self.place(key),
            found: shown(value),
            wanted: wanted.into(),
        }
    }
}

fn place(path: &str) -> Place {
    Place::Field(if path.is_empty() { "the file" } else { path }.into())
}

/// A value, short enough for a message.
fn shown(value: &Value) -> String {
    match value {
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".into(),
        Value::String(text) => quoted(text),
        other => other.to_string(),
    }
}

/// The text of splines, which must all be curves, all surfaces or all volumes.
///
/// # Errors
/// [`ExchangeError::Unwritable`] where kinds are mixed or there is nothing.
///
/// ```
/// # use voxlathe::exchange::{Spline, geomdl};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0; 3], [1.0, 2.0, 0.1]])?;
/// let text = geomdl::write(std::slice::from_ref(&line))?;
/// assert_eq!(geomdl::read(&text)?.splines, [Spline::Curve(line)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write<'a, T>(splines: &'a [T]) -> Result<String, ExchangeError>
where
    Net<'a>: From<&'a T>,
{
    let nets = nets(splines);
    let kind = super::spline::common_kind(&nets, Format::Geomdl)?;
    let count = nets.len();
    // Writing into a string cannot fail.
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{{\"shape\": {{\"type\": \"{kind}\", \"count\": {count}, \"data\": ["
    );
    for (index, net) in nets.iter().enumerate() {
        write_spline(&mut out, net);
        out.push_str(if index + 1 < count { ",\n" } else { "\n" });
    }
    out.push_str("]}}\n");
    Ok(out)
}

fn write_spline(out: &mut String, net: &Net<'_>) {
    let parameters = net.knots().len();
    let _ = writeln!(
        out,
        "{{\"rational\": {}, \"dimension\": 3,",
        net.is_rational()
    );
    for (direction, knots) in net.knots().iter().enumerate() {
        let suffix = match parameters {
            1 => String::new(),
            _ => format!("_{}", parameter(direction)),
        };
        let _ = writeln!(
            out,
            "\"degree{suffix}\": {}, \"knotvector{suffix}\": {},",
            knots.degree(),
            list(knots.knots())
        );
        if parameters > 1 {
            let _ = writeln!(out, "\"size{suffix}\": {},", knots.control_points());
        }
    }
    let order = from_file_order(&net.counts());
    let mut in_file = vec![0; order.len()];
    for (ours, &theirs) in order.iter().enumerate() {
        in_file[theirs] = ours;
    }
    let points: Vec<_> = in_file.iter().map(|&i| list(&net.points()[i])).collect();
    let _ = write!(
        out,
        "\"control_points\": {{\"points\": [\n{}\n]",
        points.join(",\n")
    );
    if net.is_rational() {
        let weights: Vec<_> = in_file.iter().map(|&i| net.weights()[i]).collect();
        let _ = write!(out, ",\n\"weights\": {}", list(&weights));
    }
    out.push_str("}}");
}

/// Numbers with a point, so that readers of other languages take them as such.
fn list(numbers: &[f64]) -> String {
    let texts: Vec<_> = numbers.iter().map(|x| format!("{x:?}")).collect();
    format!("[{}]", texts.join(", "))
}
