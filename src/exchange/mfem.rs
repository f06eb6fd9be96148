//! MFEM NURBS meshes: patches with a topology.
//!
//! ```text
//!   MFEM NURBS mesh v1.0                        v1.1: the same, and how to refine
//!   dimension d                                 1, 2 or 3 parameters
//!   elements n                                  attribute, geometry 1, 3 or 5, vertices
//!   boundary n                                  the same, one parameter less
//!   edges n                                     knot vector, first vertex, last vertex
//!   vertices n
//! ```
//!
//! and then one of two dialects:
//!
//! ```text
//!   patches                                     for each element:
//!     knotvectors d                             degree, control points, knots
//!     dimension s                               coordinates of a point: 2 or 3
//!     controlpoints                             w x, w y, w z, w; also controlpoints_homogeneous
//!     controlpoints_cartesian                   x, y, z, w
//!
//!   knotvectors n                               shared by the edges
//!   weights                                     numbered over the whole mesh
//!   FiniteElementSpace ..                       points, Cartesian, numbered in the same way
//! ```
//!
//! The first index of a patch is the fastest. The numbering of the second dialect is that of
//! `super::mfem_space`. In the first the topology adds nothing to the geometry; it is read and
//! checked for its form alone. Comments run from `#` to the end of the line.
//!
//! [`write()`] gives the first dialect with Cartesian points, so that all numbers read back bit for bit.
//!
//! Two ways of writing that other programs have are taken with a note: `dimensions` for `dimension` in a patch, and in a
//! v1.0 mesh the word `spacing` with its parameters after a knot vector.
//!
//! * Units: those of the file.
//! * Limits: meshes that are periodic by identified boundaries, not conforming, or have inactive
//!   elements are refused. Factors of refinement (v1.1) are passed over: the geometry is the same.
//! * Source: MFEM, the format *NURBS meshes* of its documentation and the class NURBSExtension.

use super::evidence::Agreement;
use super::mfem_space;
use super::scan::{Scanner, Word};
use super::spline::{Parts, knot_vector, net_size, parameter};
use super::{ExchangeError, Format, Place, Reading};
use crate::nurbs::KnotVector;

pub use super::mfem_write::write;

/// What every NURBS mesh begins with.
const HEADER: &str = "MFEM NURBS mesh ";

/// An element of the topology.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) at: usize,
    pub(super) vertices: Vec<usize>,
}

/// An edge of the topology, and the knot vector that runs from its first vertex to its last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) at: usize,
    pub(super) knot_vector: usize,
    pub(super) first: usize,
    pub(super) last: usize,
}

/// What comes before the geometry.
#[derive(Debug, Clone)]
pub(super) struct Topology {
    pub(super) parameters: usize,
    pub(super) elements: Vec<Element>,
    pub(super) edges: Vec<Edge>,
    pub(super) vertices: usize,
}

/// Whether a text could be of this format.
pub(super) fn recognise(text: &str) -> bool {
    text.trim_start().starts_with("MFEM ")
}

/// The patches of a mesh, in the order of its elements.
///
/// Points of two coordinates are read with z = 0. Notes say that, and where coordinates look as if
/// they were premultiplied and should not be, or the reverse.
///
/// # Errors
/// [`ExchangeError::Unexpected`], [`ExchangeError::Unsupported`] and [`ExchangeError::Spline`], each
/// with line and column.
///
/// ```
/// # use voxlathe::exchange::{Spline, mfem};
/// let text = "MFEM NURBS mesh v1.0
/// dimension 2   elements 1   1 3 0 1 2 3   boundary 0   edges 0   vertices 4
/// patches
/// knotvectors 2   1 2 0 0 1 1   1 2 0 0 1 1
/// dimension 3
/// controlpoints_cartesian   0 0 0 1   1 0 0 1   0 1 0 1   1 1 5 1";
/// let Spline::Surface(patch) = &mfem::read(text)?.splines[0] else { panic!("two parameters") };
/// assert_eq!(patch.control_points()[3], [1.0, 1.0, 5.0]);
/// # Ok::<(), voxlathe::exchange::ExchangeError>(())
/// ```
pub fn read(text: &str) -> Result<Reading, ExchangeError> {
    let mut scan = Scanner::new(text, Some('#'));
    let refinable = read_header(&mut scan)?;
    let topology = read_topology(&mut scan)?;
    let mut reading = Reading::new(Format::Mfem);
    let word = scan.word("the word \"knotvectors\" or \"patches\"")?;
    match word.text {
        "patches" => read_patches(&mut scan, &topology, &mut reading)?,
        "knotvectors" => {
            let knots = read_knot_vectors(&mut scan, refinable, &mut reading)?;
            if refinable {
                skip_refinement(&mut scan, topology.parameters, knots.len(), &mut reading)?;
            }
            mfem_space::read(&mut scan, &topology, &knots, &mut reading)?;
        }
        _ => return Err(scan.unexpected(word, "the word \"knotvectors\" or \"patches\"")),
    }
    Ok(reading)
}

/// Whether the mesh says how it is to be refined.
fn read_header(scan: &mut Scanner<'_>) -> Result<bool, ExchangeError> {
    scan.here();
    let line = scan.line();
    match line.text.strip_prefix(HEADER) {
        Some("v1.0") => Ok(false),
        Some("v1.1") => Ok(true),
        _ if line.text.starts_with("MFEM NURBS") => Err(scan.unsupported(
            line.at,
            format!(
                "{} is not read, only {HEADER}v1.0 and v1.1",
                super::error::quoted(line.text)
            ),
        )),
        _ if line.text.starts_with("MFEM") => Err(scan.unsupported(
            line.at,
            format!(
                "{} is no NURBS mesh; only those, {HEADER}v1.0 and v1.1, are read",
                super::error::quoted(line.text)
            ),
        )),
        _ => Err(scan.unexpected(line, &format!("the line \"{HEADER}v1.0\""))),
    }
}

fn read_topology(scan: &mut Scanner<'_>) -> Result<Topology, ExchangeError> {
    scan.keyword("dimension")?;
    let parameters = small(scan.integer("the number of parameters", 1..=3)?);
    let (mut elements, mut edges) = (Vec::new(), Vec::new());
    scan.keyword("elements")?;
    for _ in 0..scan.count("the number of elements", 1)? {
        elements.push(read_element(scan, parameters)?);
    }
    scan.keyword("boundary")?;
    for _ in 0..scan.count("the number of boundary elements", 0)? {
        read_element(scan, parameters - 1)?;
    }
    scan.keyword("edges")?;
    for _ in 0..scan.count("the number of edges", 0)? {
        let at = scan.peek().map_or(0, |word| word.at);
        edges.push(Edge {
            at,
            knot_vector: scan.count("the knot vector of an edge", 0)?,
            first: scan.count("a vertex of an edge", 0)?,
            last: scan.count("a vertex of an edge", 0)?,
        });
    }
    scan.keyword("vertices")?;
    let vertices = scan.count("the number of vertices", 0)?;
    let topology = Topology {
        parameters,
        elements,
        edges,
        vertices,
    };
    check_vertices(scan, &topology)?;
    Ok(topology)
}

fn check_vertices(scan: &Scanner<'_>, topology: &Topology) -> Result<(), ExchangeError> {
    let ends = |e: &Edge| (e.at, vec![e.first, e.last]);
    let groups = (topology.elements.iter().map(|e| (e.at, e.vertices.clone())))
        .chain(topology.edges.iter().map(ends));
    for (at, vertices) in groups {
        for (i, vertex) in vertices.iter().enumerate() {
            if *vertex >= topology.vertices {
                return Err(ExchangeError::Unexpected {
                    place: scan.place(at),
                    found: format!("vertex {vertex}"),
                    wanted: format!("vertices below their number, {}", topology.vertices),
                });
            }
            if vertices[..i].contains(vertex) {
                return Err(scan.unsupported(
                    at,
                    format!("vertex {vertex} occurs twice here; elements and edges with vertices in common with themselves are not read"),
                ));
            }
        }
    }
    Ok(())
}

/// Attribute, geometry and vertices.
fn read_element(scan: &mut Scanner<'_>, parameters: usize) -> Result<Element, ExchangeError> {
    let at = scan.peek().map_or(0, |word| word.at);
    scan.integer("the attribute of an element", i64::MIN..=i64::MAX)?;
    let geometry = [0, 1, 3, 5][parameters];
    scan.integer(
        &format!("the geometry of an element of dimension {parameters}"),
        geometry..=geometry,
    )?;
    let vertices: Result<_, _> = (0..1_usize << parameters)
        .map(|_| scan.count("a vertex of an element", 0))
        .collect();
    Ok(Element {
        at,
        vertices: vertices?,
    })
}

/// One knot vector: degree, number of control points, knots; how its spans are spaced is passed over.
///
/// * `section`: whether spacings have a section of their own, so that none follows here.
fn read_knot_vector(
    scan: &mut Scanner<'_>,
    name: &str,
    section: bool,
    reading: &mut Reading,
) -> Result<KnotVector, ExchangeError> {
    let at = scan.here();
    let degree = scan.count("the degree of a knot vector", 0)?;
    let count = scan.count("the number of control points of a knot vector", 1)?;
    let length = count.saturating_add(degree).saturating_add(1);
    let knots = scan.numbers(length, |i| format!("knot {i}"))?;
    let knots = knot_vector(degree, knots, name, || scan.place(at))?;
    // A v1.1 mesh has a section of that name after its knot vectors.
    if let Some(word) = scan.peek()
        && word.text == "spacing"
        && !section
    {
        scan.next();
        skip_spacing(scan)?;
        reading.note(
            || scan.place(word.at),
            || format!("the spacing of {name} is passed over; it does not change the geometry"),
        );
    }
    Ok(knots)
}

fn read_knot_vectors(
    scan: &mut Scanner<'_>,
    section: bool,
    reading: &mut Reading,
) -> Result<Vec<KnotVector>, ExchangeError> {
    let count = scan.count("the number of knot vectors", 1)?;
    let mut knots = Vec::new();
    for index in 0..count {
        knots.push(read_knot_vector(
            scan,
            &format!("knot vector {index}"),
            section,
            reading,
        )?);
    }
    Ok(knots)
}

/// Kind and parameters of how the spans of a knot vector are spaced.
fn skip_spacing(scan: &mut Scanner<'_>) -> Result<(), ExchangeError> {
    scan.count("a kind of spacing", 0)?;
    let integers = scan.count("a number of whole parameters", 0)?;
    let reals = scan.count("a number of real parameters", 0)?;
    scan.numbers(integers.saturating_add(reals), |i| {
        format!("parameter {i} of a spacing")
    })?;
    Ok(())
}

/// How a mesh is to be refined does not change what it is.
fn skip_refinement(
    scan: &mut Scanner<'_>,
    parameters: usize,
    knot_vectors: usize,
    reading: &mut Reading,
) -> Result<(), ExchangeError> {
    let at = scan.here();
    loop {
        let word = scan.word("the word \"spacing\"")?;
        match word.text {
            "refinements" => {
                scan.numbers(parameters, |i| format!("factor of refinement {i}"))?;
            }
            "knotvector_refinements" => {
                for _ in 0..knot_vectors {
                    let count = scan.count("a number of factors", 0)?;
                    scan.numbers(count, |i| format!("factor of refinement {i}"))?;
                }
            }
            "spacing" => break,
            _ => return Err(scan.unexpected(word, "the word \"spacing\"")),
        }
    }
    let count = scan.count("the number of spacings", 0)?;
    for _ in 0..count {
        scan.count("a knot vector", 0)?;
        skip_spacing(scan)?;
    }
    reading.note(
        || scan.place(at),
        || "how the mesh is to be refined is passed over; it does not change the geometry".into(),
    );
    Ok(())
}

fn read_patches(
    scan: &mut Scanner<'_>,
    topology: &Topology,
    reading: &mut Reading,
) -> Result<(), ExchangeError> {
    for _ in &topology.elements {
        read_patch(scan, topology.parameters, reading)?;
    }
    refuse_rest(scan)
}

/// Whatever follows the geometry is either refused by name or not understood.
pub(super) fn refuse_rest(scan: &mut Scanner<'_>) -> Result<(), ExchangeError> {
    if let Some(word) = scan.peek() {
        refuse_section(scan, word)?;
    }
    scan.finished("the end of the mesh")
}

/// Sections that would change the meaning of the mesh.
pub(super) fn refuse_section(scan: &Scanner<'_>, word: Word<'_>) -> Result<(), ExchangeError> {
    let what = match word.text {
        "periodic" => "boundaries that are identified (periodic) are not read",
        "mesh_elements" => "meshes with inactive elements (mesh_elements) are not read",
        _ => return Ok(()),
    };
    Err(scan.unsupported(word.at, format!("{what}; write the mesh without them")))
}

fn read_patch(
    scan: &mut Scanner<'_>,
    parameters: usize,
    reading: &mut Reading,
) -> Result<(), ExchangeError> {
    let at = scan.here();
    scan.keyword("knotvectors")?;
    let wanted = i64::try_from(parameters).unwrap_or(3);
    scan.integer("the number of knot vectors of a patch", wanted..=wanted)?;
    let mut knots = Vec::new();
    for direction in 0..parameters {
        let name = format!("knot vector of {}", parameter(direction));
        knots.push(read_knot_vector(scan, &name, false, reading)?);
    }
    let word = scan.word("the word \"dimension\"")?;
    match word.text {
        "dimension" => {}
        "dimensions" => reading.note(
            || scan.place(word.at),
            || "\"dimensions\" is taken for \"dimension\"".into(),
        ),
        _ => return Err(scan.unexpected(word, "the word \"dimension\"")),
    }
    let dimension = small(scan.integer("the number of coordinates of a point", 2..=3)?);
    let wanted = "controlpoints, controlpoints_homogeneous or controlpoints_cartesian";
    let word = scan.word(wanted)?;
    let premultiplied = match word.text {
        "controlpoints" | "controlpoints_homogeneous" => true,
        "controlpoints_cartesian" => false,
        _ => return Err(scan.unexpected(word, wanted)),
    };
    let size = net_size(&knots, || scan.place(at))?;
    let (mut raw, mut weights) = (Vec::new(), Vec::new());
    for index in 0..size {
        let found = scan.numbers(dimension, |i| format!("coordinate {i} of point {index}"))?;
        let mut point = [0.0; 3];
        point[..dimension].copy_from_slice(&found);
        raw.push(point);
        weights.push(scan.weight(index)?);
    }
    if dimension == 2 {
        reading.note_flat(|| scan.place(at));
    }
    note_agreement(
        reading,
        word.text,
        premultiplied,
        (&raw, &weights, &knots),
        || scan.place(at),
    );
    let points = raw
        .iter()
        .zip(&weights)
        .map(|(p, &w)| if premultiplied { p.map(|a| a / w) } else { *p })
        .collect();
    let parts = Parts {
        knots,
        points,
        weights,
    };
    reading.splines.push(parts.build(|| scan.place(at))?);
    Ok(())
}

/// A note where the coordinates speak against the way they are taken.
///
/// * `net`: coordinates as they stand, weights, knot vectors.
pub(super) fn note_agreement(
    reading: &mut Reading,
    section: &str,
    premultiplied: bool,
    net: (&[[f64; 3]], &[f64], &[KnotVector]),
    place: impl FnOnce() -> Place,
) {
    let (raw, weights, knots) = net;
    let counts: Vec<_> = knots.iter().map(KnotVector::control_points).collect();
    let found = Agreement::of(raw, weights, &counts);
    let patch = reading.splines.len();
    let (taken, look) = if premultiplied && found.speaks_for_cartesian() {
        ("premultiplied by their weights", "Cartesian")
    } else if !premultiplied && found.speaks_for_premultiplied() {
        ("Cartesian", "premultiplied by their weights")
    } else {
        return;
    };
    reading.note(place, || {
        format!(
            "the coordinates of patch {patch} are taken as {taken}, as {section} says, but they look \
             {look}: {found}"
        )
    });
}

/// A number from 0 to 3.
fn small(found: i64) -> usize {
    usize::try_from(found.clamp(0, 3)).unwrap_or(0)
}
