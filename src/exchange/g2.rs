//! GoTools `.g2`: splines of any kind, one after the other.
//!
//! ```text
//!   header   class major minor n a1 .. an       class 100 curve, 200 surface, 700 volume
//!   body     dimension rational                 rational 0 or 1
//!            count order, knots                 for each parameter; order = degree + 1
//!            x y z [w]                          the first index fastest
//! ```
//!
//! Rational points are premultiplied: (w x, w y, w z, w). On reading each is divided by its weight;
//! [`write()`] gives a coordinate back exactly or one step of f64 beside it. The n numbers that end a
//! header (a colour) are passed over. Other classes are refused by name.
//!
//! A file with Cartesian points and weights has the same form as one with premultiplied points. Where
//! the coordinates speak for the other reading, a note says so; see [`read`].
//!
//! * Units: those of the file.
//! * Source: GoTools, the classes ObjectHeader, SplineCurve, SplineSurface and SplineVolume.

use std::fmt::Write as _;

use super::evidence::Agreement;
use super::scan::Scanner;
use super::spline::{Parts, knot_vector, net_size, nets, parameter};
use super::{ExchangeError, Format, Net, Reading, number};

/// Class numbers and names; those of splines are read, the others refused by name.
const CLASSES: [(i64, &str); 30] = [
    (100, "SplineCurve"),
    (110, "CurveOnSurface"),
    (111, "CurveOnVolume"),
    (120, "Line"),
    (130, "Circle"),
    (140, "Ellipse"),
    (150, "BoundedCurve"),
    (160, "Hyperbola"),
    (170, "Parabola"),
    (200, "SplineSurface"),
    (210, "BoundedSurface"),
    (220, "GoBaseSurface"),
    (250, "Plane"),
    (260, "Cylinder"),
    (261, "SurfaceOfLinearExtrusion"),
    (270, "Sphere"),
    (280, "Cone"),
    (290, "Torus"),
    (291, "SurfaceOfRevolution"),
    (292, "Disc"),
    (293, "LRSplineSurface"),
    (400, "PointCloud"),
    (410, "LineCloud"),
    (700, "SplineVolume"),
    (720, "Parallelepiped"),
    (721, "SphereVolume"),
    (722, "CylinderVolume"),
    (723, "ConeVolume"),
    (724, "TorusVolume"),
    (793, "LRSplineVolume"),
];

/// Whether a text could be of this format: it begins with four whole numbers, the first a class.
pub(super) fn recognise(text: &str) -> bool {
    let mut words = text.split_whitespace().take(4);
    let class = words.next().and_then(|word| word.parse::<i64>().ok());
    class.is_some_and(|class| (100..1000).contains(&class))
        && words.filter(|word| word.parse::<i64>().is_ok()).count() == 3
}

/// The splines of a text.
///
/// Points of two coordinates are read with z = 0. Notes say that, and where the coordinates of a
/// rational spline look as if they were not premultiplied.
///
/// # Errors
/// [`ExchangeError::Unexpected`], [`ExchangeError::Unsupported`] and [`ExchangeError::Spline`], each
/// with line and column.
///
/// ```
/// # use voxlathe::exchange::g2;
/// let text = "100 1 0 0\n3 1\n3 3\n0 0 0 1 1 1\n1 0 0 1\n1 1 0 1\n0 2 0 2\n";
/// let curve = match &g2::read(text)?.splines[..] {
///     [voxlathe::exchange::Spline::Curve(curve)] => curve.clone(),
///     other => panic!("{other:?}"),
/// };
/// assert_eq!(curve.control_points()[2], [0.0, 1.0, 0.0]);
/// # Ok::<(), voxlathe::exchange::ExchangeError>(())
/// ```
pub fn read(text: &str) -> Result<Reading, ExchangeError> {
    let mut scan = Scanner::new(text, None);
    let mut reading = Reading::new(Format::G2);
    scan.word("a header")?;
    scan = Scanner::new(text, None);
    while scan.peek().is_some() {
        read_object(&mut scan, &mut reading)?;
    }
    Ok(reading)
}

fn read_object(scan: &mut Scanner<'_>, reading: &mut Reading) -> Result<(), ExchangeError> {
    let at = scan.here();
    let parameters = read_header(scan)?;
    let dimension = read_dimension(scan)?;
    let rational = scan.integer("whether the spline is rational", 0..=1)? == 1;
    let mut knots = Vec::new();
    for direction in 0..parameters {
        let of = format!("of {}", parameter(direction));
        let count = scan.count(&format!("the number of control points {of}"), 1)?;
        let here = scan.here();
        let order = scan.count(&format!("the order {of}, which is degree + 1"), 1)?;
        let length = count.saturating_add(order);
        let values = scan.numbers(length, |i| format!("knot {i} {of}"))?;
        let name = format!("knot vector {of}");
        knots.push(knot_vector(order.saturating_sub(1), values, &name, || {
            scan.place(here)
        })?);
    }
    let size = net_size(&knots, || scan.place(at))?;
    let mut raw = Vec::new();
    let mut weights = Vec::new();
    for index in 0..size {
        let found = scan.numbers(dimension, |i| format!("coordinate {i} of point {index}"))?;
        let mut point = [0.0; 3];
        point[..dimension].copy_from_slice(&found);
        raw.push(point);
        weights.push(if rational { scan.weight(index)? } else { 1.0 });
    }
    let spline_index = reading.splines.len();
    if dimension == 2 {
        reading.note_flat(|| scan.place(at));
    }
    if rational {
        let counts: Vec<_> = knots.iter().map(|k| k.control_points()).collect();
        let agreement = Agreement::of(&raw, &weights, &counts);
        if agreement.speaks_for_cartesian() {
            reading.note(
                || scan.place(at),
                || {
                    format!(
                        "the coordinates of spline {spline_index} are taken as premultiplied by \
                         their weights, as the format has it, but they look Cartesian: {agreement}"
                    )
                },
            );
        }
    }
    let points = raw
        .iter()
        .zip(&weights)
        .map(|(p, &w)| if rational { p.map(|a| a / w) } else { *p })
        .collect();
    let parts = Parts {
        knots,
        points,
        weights,
    };
    reading.splines.push(parts.build(|| scan.place(at))?);
    Ok(())
}

/// The number of parameters of what follows.
fn read_header(scan: &mut Scanner<'_>) -> Result<usize, ExchangeError> {
    let word = scan.word("a header")?;
    let class = word.text.parse::<i64>();
    let parameters = match class {
        Ok(100) => 1,
        Ok(200) => 2,
        Ok(700) => 3,
        _ => {
            let name = (CLASSES.iter())
                .find(|(number, _)| class.as_ref() == Ok(number))
                .map(|(number, name)| format!("the object is a {name}, class {number}; "));
            return Err(match name {
                Some(name) => scan.unsupported(
                    word.at,
                    name + "only spline curves, surfaces and volumes (100, 200, 700) are read; \
                            convert it to a spline first",
                ),
                None => scan.unexpected(word, "the class number of an object: 100, 200 or 700"),
            });
        }
    };
    let version = scan.peek();
    let major = scan.integer("the major version", 0..=i64::MAX)?;
    if major != 1 {
        let at = version.map_or(0, |word| word.at);
        return Err(scan.unsupported(at, format!("major version {major}; only 1 is known")));
    }
    scan.integer("the minor version", 0..=i64::MAX)?;
    let auxiliary = scan.count("the number of auxiliary numbers", 0)?;
    for _ in 0..auxiliary {
        scan.number("an auxiliary number")?;
    }
    Ok(parameters)
}

fn read_dimension(scan: &mut Scanner<'_>) -> Result<usize, ExchangeError> {
    let word = scan.clone().word("the dimension of the points")?;
    match scan.count("the dimension of the points", 0)? {
        dimension @ (2 | 3) => Ok(dimension),
        _ => Err(scan.unexpected(word, "the dimension of the points, 2 or 3")),
    }
}

/// The text of splines: curves, surfaces and volumes, in any order.
///
/// Splines whose weights are all 1 are written as not rational, and read back bit for bit. Of the
/// others a coordinate reads back as it was or one step of f64 beside it.
///
/// ```
/// # use voxlathe::exchange::g2;
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0; 3], [1.0, 2.0, 0.5]])?;
/// assert_eq!(g2::write(&[line]), "100 1 0 0\n3 0\n2 2\n0 0 1 1\n0 0 0\n1 2 0.5\n\n");
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
#[must_use]
pub fn write<'a, T>(splines: &'a [T]) -> String
where
    Net<'a>: From<&'a T>,
{
    let mut out = String::new();
    for net in nets(splines) {
        write_object(&mut out, &net);
    }
    out
}

fn write_object(out: &mut String, net: &Net<'_>) {
    let class = [100, 200, 700][net.knots().len().clamp(1, 3) - 1];
    let rational = net.is_rational();
    // Writing into a string cannot fail.
    let _ = writeln!(out, "{class} 1 0 0\n3 {}", u8::from(rational));
    for knots in net.knots() {
        let order = knots.degree() + 1;
        let _ = writeln!(out, "{} {order}", knots.control_points());
        let _ = writeln!(out, "{}", number::row(knots.knots().iter().copied()));
    }
    for (point, &weight) in net.points().iter().zip(net.weights()) {
        let _ = if rational {
            let weighted = point.map(|x| number::premultiplied(x, weight));
            writeln!(out, "{}", number::row(weighted.into_iter().chain([weight])))
        } else {
            writeln!(out, "{}", number::row(*point))
        };
    }
    out.push('\n');
}
