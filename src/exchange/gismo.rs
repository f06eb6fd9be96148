//! G+Smo XML: geometries of tensor-product splines.
//!
//! ```text
//!   <xml>
//!     <Geometry type="TensorNurbs3" id="0">
//!       <Basis type="TensorNurbsBasis3">                    the layer of the weights,
//!         <Basis type="TensorBSplineBasis3">                absent from TensorBSpline3
//!           <Basis type="BSplineBasis" index="0">
//!             <KnotVector degree="2"> 0 0 0 1 1 1 </KnotVector> ..
//!         <weights> 1 0.7 1 .. </weights>
//!       <coefs geoDim="3"> x y z .. </coefs>
//! ```
//!
//! Points are Cartesian, the first index fastest. With one parameter the names are `Nurbs`,
//! `NurbsBasis`, `BSpline`, `BSplineBasis`, and there is no tensor layer. Elements other than `Geometry`,
//! such as the interfaces of a `MultiPatch`, add nothing to the geometry and are passed over.
//!
//! * Units: those of the file.
//! * Limits: at most 64 attributes of an element, 64 declarations of name spaces and a million elements and texts between
//!   them, so that time and memory follow the length of the text; document types (DTD), numbers in other encodings than text, periodic bases and knot vectors
//!   given by a rule are refused.
//! * Source: G+Smo, the files of its `filedata` and the class gsXml.

use std::fmt::Write as _;

use roxmltree::{Document, Node, ParsingOptions};

use super::error::{brief, quoted};
use super::evidence::Agreement;
use super::scan::{Scanner, place_of};
use super::spline::{Parts, knot_vector, net_size, nets, parameter};
use super::{ExchangeError, Format, Net, Place, Reading, number};
use crate::nurbs::KnotVector;

/// Types of geometry: name, parameters, rational.
const TYPES: [(&str, usize, bool); 6] = [
    ("BSpline", 1, false),
    ("Nurbs", 1, true),
    ("TensorBSpline2", 2, false),
    ("TensorNurbs2", 2, true),
    ("TensorBSpline3", 3, false),
    ("TensorNurbs3", 3, true),
];

/// The splines of a text.
///
/// # Errors
/// [`ExchangeError::Syntax`] for text that is no XML; [`ExchangeError::Unexpected`],
/// [`ExchangeError::Unsupported`] and [`ExchangeError::Spline`], each with line and column.
///
/// ```
/// # use voxlathe::exchange::{Spline, gismo};
/// let text = r#"<xml><Geometry type="BSpline" id="0">
///     <Basis type="BSplineBasis"><KnotVector degree="1">0 0 1 1</KnotVector></Basis>
///     <coefs geoDim="3">0 0 0  1 2 3</coefs></Geometry></xml>"#;
/// let Spline::Curve(line) = &gismo::read(text)?.splines[0] else { panic!("a curve") };
/// assert_eq!(line.control_points()[1], [1.0, 2.0, 3.0]);
/// # Ok::<(), voxlathe::exchange::ExchangeError>(())
/// ```
pub fn read(text: &str) -> Result<Reading, ExchangeError> {
    check_tags(text)?;
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let at = error.pos();
        let reason = error.to_string();
        let tail = format!(" at {at}");
        ExchangeError::Syntax {
            place: Place::Line {
                line: usize::try_from(at.row).unwrap_or(usize::MAX),
                column: usize::try_from(at.col).unwrap_or(usize::MAX),
            },
            format: "XML",
            reason: brief(reason.strip_suffix(&tail).unwrap_or(&reason)),
        }
    })?;
    let file = Xml { text };
    let root = document.root_element();
    if root.tag_name().name() != "xml" {
        return Err(file.unexpected(root, format!("<{}>", root.tag_name().name()), "<xml>"));
    }
    let mut reading = Reading::new(Format::Gismo);
    for geometry in root.children().filter(|n| n.has_tag_name("Geometry")) {
        file.geometry(geometry, &mut reading)?;
    }
    if reading.splines.is_empty() {
        return Err(file.unexpected(root, "no <Geometry> in <xml>".into(), "at least one"));
    }
    Ok(reading)
}

/// Elements, and texts between them, of a file: some hundred bytes each, whatever they are written with.
const MAX_NODES: u32 = 1_000_000;
/// Attributes of an element. The reader compares each with all others of its element; G+Smo writes up to five.
const MAX_ATTRIBUTES: usize = 64;
/// Declarations of name spaces in a file, which every element within hands on; G+Smo writes none.
const MAX_NAMESPACES: usize = 64;

/// Refuses tags that would take the reader of XML a time not linear in the text: goes through it once, from tag to tag.
fn check_tags(text: &str) -> Result<(), ExchangeError> {
    let bytes = text.as_bytes();
    let after = |from: usize, end: &str| {
        let rest = text.get(from..).unwrap_or_default();
        rest.find(end).map_or(text.len(), |n| from + n + end.len())
    };
    let (mut at, mut namespaces) = (0, 0);
    while let Some(start) = text
        .get(at..)
        .and_then(|rest| rest.find('<'))
        .map(|n| at + n)
    {
        let rest = &text[start..];
        if rest.starts_with("<!--") {
            at = after(start + 4, "-->");
        } else if rest.starts_with("<![CDATA[") {
            at = after(start + 9, "]]>");
        } else if rest.starts_with("<?") {
            at = after(start + 2, "?>");
        } else {
            let mut attributes = 0;
            at = start + 1;
            while let Some(&c) = bytes.get(at) {
                at += 1;
                match c {
                    b'>' => break,
                    b'"' | b'\'' => at = after(at, if c == b'"' { "\"" } else { "'" }),
                    b'=' => attributes += 1,
                    b'x' if bytes[at - 1..].starts_with(b"xmlns") => namespaces += 1,
                    _ => {}
                }
                let most = [
                    (attributes, MAX_ATTRIBUTES, "attributes of an element"),
                    (
                        namespaces,
                        MAX_NAMESPACES,
                        "declarations of name spaces in a file",
                    ),
                ];
                if let Some((_, most, what)) = most.into_iter().find(|m| m.0 > m.1) {
                    return Err(ExchangeError::Unsupported {
                        place: place_of(text, start),
                        what: format!("more than {most} {what}, the most that are read"),
                    });
                }
            }
        }
    }
    Ok(())
}

/// The text, for places.
struct Xml<'a> {
    text: &'a str,
}

impl Xml<'_> {
    fn place(&self, node: Node<'_, '_>) -> Place {
        place_of(self.text, node.range().start)
    }

    fn unexpected(&self, node: Node<'_, '_>, found: String, wanted: &str) -> ExchangeError {
        ExchangeError::Unexpected {
            place: self.place(node),
            found,
            wanted: wanted.into(),
        }
    }

    fn unsupported(&self, node: Node<'_, '_>, what: impl Into<String>) -> ExchangeError {
        ExchangeError::Unsupported {
            place: self.place(node),
            what: what.into(),
        }
    }

    fn attribute<'n>(&self, node: Node<'n, '_>, name: &str) -> Result<&'n str, ExchangeError> {
        node.attribute(name).ok_or_else(|| {
            let tag = node.tag_name().name();
            self.unexpected(
                node,
                format!("<{tag}> without it"),
                &format!("the attribute {name:?}"),
            )
        })
    }

    /// The only child of that name.
    fn child<'n, 'd>(&self, node: Node<'n, 'd>, name: &str) -> Result<Node<'n, 'd>, ExchangeError> {
        let mut found = node.children().filter(|n| n.has_tag_name(name));
        match (found.next(), found.next()) {
            (Some(child), None) => Ok(child),
            (None, _) => {
                let tag = node.tag_name().name();
                Err(self.unexpected(
                    node,
                    format!("<{tag}> without it"),
                    &format!("<{name}> in it"),
                ))
            }
            (_, Some(second)) => {
                Err(self.unexpected(second, format!("a second <{name}>"), "one only"))
            }
        }
    }

    /// A child of that name whose type is given.
    fn typed<'n, 'd>(
        &self,
        node: Node<'n, 'd>,
        name: &str,
        kind: &str,
    ) -> Result<Node<'n, 'd>, ExchangeError> {
        let child = self.child(node, name)?;
        self.check_type(child, kind)?;
        Ok(child)
    }

    fn check_type(&self, node: Node<'_, '_>, kind: &str) -> Result<(), ExchangeError> {
        let found = self.attribute(node, "type")?;
        if found == kind {
            Ok(())
        } else {
            Err(self.unexpected(
                node,
                format!("the type {}", quoted(found)),
                &format!("{kind:?}"),
            ))
        }
    }

    /// All numbers of an element.
    fn numbers(&self, node: Node<'_, '_>, what: &str) -> Result<Vec<f64>, ExchangeError> {
        if let Some(format) = node.attribute("format")
            && !format.eq_ignore_ascii_case("ascii")
        {
            let found = quoted(format);
            return Err(self.unsupported(
                node,
                format!("numbers in the format {found}; only text (ASCII) is read"),
            ));
        }
        let mut numbers = Vec::new();
        for part in node.children() {
            if part.is_element() {
                let tag = part.tag_name().name();
                return Err(self.unexpected(
                    part,
                    format!("<{tag}>"),
                    &format!("only {what} here"),
                ));
            }
            if !part.is_text() {
                continue;
            }
            let range = part.range();
            if part.text() != self.text.get(range.clone()) {
                // Line ends of other systems are turned by the reader of XML, and mean the same.
                let raw = self.text.get(range.clone()).unwrap_or("");
                if raw.contains(['&', '<']) {
                    return Err(self.unsupported(
                        part,
                        "entities or CDATA among numbers; write them as plain text",
                    ));
                }
            }
            let mut scan = Scanner::within(self.text, range, None);
            while scan.peek().is_some() {
                numbers.push(scan.number(what)?);
            }
        }
        Ok(numbers)
    }

    fn geometry(&self, node: Node<'_, '_>, reading: &mut Reading) -> Result<(), ExchangeError> {
        let kind = self.attribute(node, "type")?;
        let Some(&(_, parameters, rational)) = TYPES.iter().find(|(name, ..)| *name == kind) else {
            return Err(self.unsupported(
                node,
                format!(
                    "a geometry of type {}; only BSpline, Nurbs, and TensorBSpline and TensorNurbs of 2 \
                     and 3 parameters are read",
                    quoted(kind)
                ),
            ));
        };
        let suffix = if parameters == 1 {
            String::new()
        } else {
            parameters.to_string()
        };
        let tensor = if parameters == 1 { "" } else { "Tensor" };
        let plain = format!("{tensor}BSplineBasis{suffix}");
        let (layer, basis) = if rational {
            let layer = self.typed(node, "Basis", &format!("{tensor}NurbsBasis{suffix}"))?;
            (Some(layer), self.typed(layer, "Basis", &plain)?)
        } else {
            (None, self.typed(node, "Basis", &plain)?)
        };
        let knots = self.knot_vectors(basis, parameters)?;
        let size = net_size(&knots, || self.place(basis))?;
        let weights = match layer {
            Some(layer) => self.weights(self.child(layer, "weights")?, size)?,
            None => vec![1.0; self.check_memory(node, size)?],
        };
        let (points, flat) = self.points(self.child(node, "coefs")?, size)?;
        if flat {
            reading.note_flat(|| self.place(node));
        }
        let counts: Vec<_> = knots.iter().map(KnotVector::control_points).collect();
        let agreement = Agreement::of(&points, &weights, &counts);
        if agreement.speaks_for_premultiplied() {
            reading.note(
                || self.place(node),
                || {
                    format!(
                        "the coordinates are taken as Cartesian, as the format has it, but they look \
                         premultiplied by their weights: {agreement}"
                    )
                },
            );
        }
        let parts = Parts {
            knots,
            points,
            weights,
        };
        reading.splines.push(parts.build(|| self.place(node))?);
        Ok(())
    }

    fn knot_vectors(
        &self,
        basis: Node<'_, '_>,
        parameters: usize,
    ) -> Result<Vec<KnotVector>, ExchangeError> {
        if parameters == 1 {
            return Ok(vec![self.knot_vector(basis, 0)?]);
        }
        let mut knots = Vec::new();
        for child in basis.children().filter(|n| n.has_tag_name("Basis")) {
            self.check_type(child, "BSplineBasis")?;
            let index = child.attribute("index");
            if index.is_some_and(|index| index.trim().parse() != Ok(knots.len())) {
                let found = format!("the index {}", quoted(index.unwrap_or("")));
                return Err(self.unexpected(child, found, &format!("{}, in order", knots.len())));
            }
            knots.push(self.knot_vector(child, knots.len())?);
        }
        if knots.len() == parameters {
            Ok(knots)
        } else {
            Err(self.unexpected(
                basis,
                format!("{} bases of one parameter", knots.len()),
                &parameters.to_string(),
            ))
        }
    }

    fn knot_vector(
        &self,
        basis: Node<'_, '_>,
        direction: usize,
    ) -> Result<KnotVector, ExchangeError> {
        let node = self.child(basis, "KnotVector")?;
        for element in [basis, node] {
            for rule in ["periodic", "mode", "initKnots", "multiplicity"] {
                if let Some(value) = element.attribute(rule)
                    && !["0", "false"].contains(&value)
                {
                    return Err(self.unsupported(
                        element,
                        format!(
                            "{rule}={}; only knot vectors with all their knots are read",
                            quoted(value)
                        ),
                    ));
                }
            }
        }
        let degree = self.attribute(node, "degree")?;
        let degree = degree.trim().parse::<usize>().map_err(|_| {
            self.unexpected(node, format!("degree={}", quoted(degree)), "a whole number")
        })?;
        let values = self.numbers(node, "a knot")?;
        let name = format!("knot vector of {}", parameter(direction));
        knot_vector(degree, values, &name, || self.place(node))
    }

    fn weights(&self, node: Node<'_, '_>, size: usize) -> Result<Vec<f64>, ExchangeError> {
        let weights = self.numbers(node, "a weight")?;
        if weights.len() == size {
            Ok(weights)
        } else {
            let found = format!("{} weights", weights.len());
            Err(self.unexpected(node, found, &format!("{size}, one for each control point")))
        }
    }

    /// A size that the text is long enough for: each control point takes two letters at least.
    fn check_memory(&self, node: Node<'_, '_>, size: usize) -> Result<usize, ExchangeError> {
        if size <= self.text.len() {
            Ok(size)
        } else {
            let found = "fewer coordinates than that".to_string();
            Err(self.unexpected(node, found, &format!("{size} control points")))
        }
    }

    /// The points, and whether they have two coordinates.
    fn points(
        &self,
        node: Node<'_, '_>,
        size: usize,
    ) -> Result<(Vec<[f64; 3]>, bool), ExchangeError> {
        let given = self.attribute(node, "geoDim")?;
        let dimension = match given.trim() {
            "2" => 2,
            "3" => 3,
            _ => {
                let found = format!("geoDim={}", quoted(given));
                return Err(self.unexpected(node, found, "points of 2 or 3 coordinates"));
            }
        };
        let numbers = self.numbers(node, "a coordinate")?;
        if Some(numbers.len()) != size.checked_mul(dimension) {
            let found = format!("{} coordinates", numbers.len());
            let wanted = format!("{dimension} for each of {size} control points");
            return Err(self.unexpected(node, found, &wanted));
        }
        let points = numbers.chunks_exact(dimension).map(|coordinates| {
            let mut point = [0.0; 3];
            point[..dimension].copy_from_slice(coordinates);
            point
        });
        Ok((points.collect(), dimension == 2))
    }
}

/// The text of splines, in any order; those whose weights are all 1 as B-splines.
///
/// ```
/// # use voxlathe::exchange::{Spline, gismo};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0; 3], [1.0, 2.0, 0.1]])?;
/// let text = gismo::write(std::slice::from_ref(&line));
/// assert_eq!(gismo::read(&text)?.splines, [Spline::Curve(line)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn write<'a, T>(splines: &'a [T]) -> String
where
    Net<'a>: From<&'a T>,
{
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<xml>\n");
    for (id, net) in nets(splines).iter().enumerate() {
        write_geometry(&mut out, id, net);
    }
    out.push_str("</xml>\n");
    out
}

fn write_geometry(out: &mut String, id: usize, net: &Net<'_>) {
    let parameters = net.knots().len();
    let rational = net.is_rational();
    let tensor = if parameters == 1 { "" } else { "Tensor" };
    let suffix = if parameters == 1 {
        String::new()
    } else {
        parameters.to_string()
    };
    let kind = if rational { "Nurbs" } else { "BSpline" };
    // Writing into a string cannot fail.
    let _ = writeln!(
        out,
        " <Geometry type=\"{tensor}{kind}{suffix}\" id=\"{id}\">"
    );
    if rational {
        let _ = writeln!(out, "  <Basis type=\"{tensor}NurbsBasis{suffix}\">");
    }
    let _ = writeln!(out, "  <Basis type=\"{tensor}BSplineBasis{suffix}\">");
    for (direction, knots) in net.knots().iter().enumerate() {
        let knot_vector = format!(
            "<KnotVector degree=\"{}\">{}</KnotVector>",
            knots.degree(),
            number::row(knots.knots().iter().copied())
        );
        let _ = if parameters == 1 {
            writeln!(out, "   {knot_vector}")
        } else {
            writeln!(
                out,
                "   <Basis type=\"BSplineBasis\" index=\"{direction}\">{knot_vector}</Basis>"
            )
        };
    }
    out.push_str("  </Basis>\n");
    if rational {
        let weights: Vec<_> = net.weights().iter().map(|&w| number::text(w)).collect();
        let _ = writeln!(
            out,
            "  <weights>{}</weights>\n  </Basis>",
            weights.join("\n")
        );
    }
    let points: Vec<_> = net.points().iter().map(|p| number::row(*p)).collect();
    let _ = writeln!(
        out,
        "  <coefs geoDim=\"3\">{}</coefs>\n </Geometry>",
        points.join("\n")
    );
}
