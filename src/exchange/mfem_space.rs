//! The second dialect of MFEM NURBS meshes: weights and points numbered over the whole mesh.
//!
//! ```text
//!   numbers     of                          order among them
//!   0 ..        vertices                    by vertex
//!     ..        edges, as they are listed   from the vertex of lower number to that of higher
//!     ..        faces                       as elements meet them first; along that element's face
//!     ..        elements                    the first index fastest
//! ```
//!
//! Each takes the control points inside it: all but the first and the last along every parameter. Elements
//! count corners as below; the faces of a cube begin at their first corner, run to the second, and step
//! towards the fourth. A face met again from another element is the same list seen from another corner.
//!
//! ```text
//!        7------6        faces   3 2 1 0   below
//!       /|     /|                0 1 5 4   front
//!      4------5 |                1 2 6 5   right
//!      | 3----|-2                2 3 7 6   back
//!      |/     |/                 3 0 4 7   left
//!      0------1                  4 5 6 7   above
//! ```
//!
//! The knot vector of a parameter is that of the edges along it, all of which must name the same one in
//! the same direction; it is reversed where the edges are listed against the parameter.
//!
//! * Limits: meshes of one parameter are read in the first dialect only.
//! * Source: MFEM, the order of degrees of freedom of NURBSExtension.

use std::collections::HashMap;

use super::mfem::{Topology, note_agreement, refuse_rest, refuse_section};
use super::scan::Scanner;
use super::spline::{Parts, parameter};
use super::{ExchangeError, Reading};
use crate::nurbs::KnotVector;

/// Corners of the faces of a cube.
const FACES: [[usize; 4]; 6] = [
    [3, 2, 1, 0],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
    [4, 5, 6, 7],
];

/// How many control points all patches together may have for each number of the mesh.
///
/// Patches share their vertices, edges and faces. In a mesh of cubes a vertex has about eight users, so
/// 64 is generous; without a limit, a short text could ask for any amount of memory.
const MOST_SHARED: usize = 64;

/// Reads what follows the knot vectors.
pub(super) fn read(
    scan: &mut Scanner<'_>,
    topology: &Topology,
    knots: &[KnotVector],
    reading: &mut Reading,
) -> Result<(), ExchangeError> {
    let section = scan.word("the word \"weights\"")?;
    refuse_section(scan, section)?;
    if topology.parameters == 1 {
        return Err(scan.unsupported(
            section.at,
            "meshes of one parameter are read with \"patches\" only, not with \"knotvectors\"",
        ));
    }
    let numbering = Numbering::new(scan, topology, knots)?;
    let total = numbering.total;
    let weights = match section.text {
        "weights" => {
            let mut weights = Vec::new();
            for index in 0..total {
                weights.push(scan.weight(index)?);
            }
            Some(weights)
        }
        "unitweights" => None,
        _ => return Err(scan.unexpected(section, "the word \"weights\"")),
    };
    let at = scan.here();
    let points = read_points(scan, total, knots)?;
    if points.two {
        reading.note_flat(|| scan.place(at));
    }
    refuse_rest(scan)?;
    let weights = weights.unwrap_or_else(|| vec![1.0; total]);
    numbering.check_size(scan, total)?;
    for (patch, element) in numbering.patches.iter().zip(&topology.elements) {
        let numbers = numbering.of_patch(patch, &element.vertices);
        let pick: Vec<_> = numbers.iter().map(|&n| points.list[n]).collect();
        let picked_weights: Vec<_> = numbers.iter().map(|&n| weights[n]).collect();
        let mut own = Vec::new();
        for (direction, &(index, reversed)) in patch.knots.iter().enumerate() {
            own.push(if reversed {
                turned(&knots[index], direction, reading, || scan.place(element.at))?
            } else {
                knots[index].clone()
            });
        }
        note_agreement(
            reading,
            "the format",
            false,
            (&pick, &picked_weights, &own),
            || scan.place(at),
        );
        let parts = Parts {
            knots: own,
            points: pick,
            weights: picked_weights,
        };
        let spline = parts.build(|| scan.place(element.at))?;
        reading.splines.push(spline);
    }
    Ok(())
}

/// A knot vector that runs against the parameter.
fn turned(
    knots: &KnotVector,
    direction: usize,
    reading: &mut Reading,
    place: impl Fn() -> super::Place,
) -> Result<KnotVector, ExchangeError> {
    let turned = knots.reversed().map_err(|source| ExchangeError::Spline {
        place: place(),
        part: format!("reversed knot vector of {}: ", parameter(direction)),
        source,
    })?;
    if &turned != knots {
        let patch = reading.splines.len();
        let u = parameter(direction);
        reading.note(place, || {
            format!("the edges of patch {patch} along {u} are listed backwards; its knot vector is reversed")
        });
    }
    Ok(turned)
}

struct Points {
    list: Vec<[f64; 3]>,
    two: bool,
}

/// The finite element space with its values.
fn read_points(
    scan: &mut Scanner<'_>,
    total: usize,
    knots: &[KnotVector],
) -> Result<Points, ExchangeError> {
    let versioned = scan.peek().is_some_and(|word| word.text == "MFEM");
    if versioned {
        scan.keyword("MFEM")?;
    }
    scan.keyword("FiniteElementSpace")?;
    if versioned {
        scan.keyword("v1.0")?;
    }
    scan.keyword("FiniteElementCollection:")?;
    let collection = scan.word("a collection of NURBS")?;
    check_collection(scan, collection, knots)?;
    scan.keyword("VDim:")?;
    let dimension = scan.integer("the number of coordinates of a point", 2..=3)?;
    let dimension = if dimension == 2 { 2 } else { 3 };
    scan.keyword("Ordering:")?;
    let by_point = scan.integer("the ordering", 0..=1)? == 1;
    if versioned {
        for word in ["End:", "MFEM", "FiniteElementSpace", "v1.0"] {
            scan.keyword(word)?;
        }
    }
    let length = total.saturating_mul(dimension);
    let values = scan.numbers(length, |i| {
        let (point, axis) = if by_point {
            (i / dimension, i % dimension)
        } else {
            (i % total, i / total)
        };
        format!("coordinate {axis} of point {point}")
    })?;
    let list = (0..total).map(|n| {
        let mut point = [0.0; 3];
        for axis in 0..dimension {
            point[axis] = values[if by_point {
                n * dimension + axis
            } else {
                axis * total + n
            }];
        }
        point
    });
    Ok(Points {
        list: list.collect(),
        two: dimension == 2,
    })
}

/// The points must be those of the mesh's own splines.
fn check_collection(
    scan: &Scanner<'_>,
    word: super::scan::Word<'_>,
    knots: &[KnotVector],
) -> Result<(), ExchangeError> {
    let wanted = "a collection of NURBS, of the degree of the knot vectors";
    let Some(order) = word.text.strip_prefix("NURBS") else {
        return Err(scan.unexpected(word, wanted));
    };
    let degrees: Vec<_> = knots.iter().map(KnotVector::degree).collect();
    let one = degrees.iter().all(|d| *d == degrees[0]);
    match order.parse::<usize>() {
        _ if order.is_empty() => Ok(()),
        Ok(order) if !one || order == degrees[0] => Ok(()),
        _ => Err(scan.unexpected(word, wanted)),
    }
}

/// A patch: its control points along each parameter, and its knot vectors.
#[derive(Debug)]
struct Patch {
    counts: Vec<usize>,
    /// Which knot vector, and whether it runs the other way.
    knots: Vec<(usize, bool)>,
    first_inside: usize,
}

/// The numbers inside a face, as its first element has them.
#[derive(Debug, Clone, Copy)]
struct Face {
    first: usize,
    /// Where they begin, and the neighbour they run to.
    corners: [usize; 2],
    /// How many they are in a run, and how many runs.
    sides: [usize; 2],
}

#[derive(Debug)]
struct Numbering {
    total: usize,
    /// By the lower and the higher vertex: the first number inside the edge.
    edges: HashMap<[usize; 2], usize>,
    /// By the vertices in order of their numbers.
    faces: HashMap<[usize; 4], Face>,
    patches: Vec<Patch>,
}

impl Numbering {
    fn new(
        scan: &Scanner<'_>,
        topology: &Topology,
        knots: &[KnotVector],
    ) -> Result<Self, ExchangeError> {
        let mut total = topology.vertices;
        let mut take = |at: usize, count: usize| {
            let first = total;
            total = total.checked_add(count).ok_or_else(|| {
                scan.unsupported(at, "the control points are too many to be counted")
            })?;
            Ok::<_, ExchangeError>(first)
        };
        let mut edges = HashMap::new();
        let mut listed = HashMap::new();
        for edge in &topology.edges {
            let own = knots
                .get(edge.knot_vector)
                .ok_or_else(|| ExchangeError::Unexpected {
                    place: scan.place(edge.at),
                    found: format!("knot vector {}", edge.knot_vector),
                    wanted: format!("knot vectors below their number, {}", knots.len()),
                })?;
            let key = sorted([edge.first, edge.last]);
            if listed.insert(key, *edge).is_some() {
                return Err(scan.unsupported(
                    edge.at,
                    format!("a second edge joins the vertices {} and {}", key[0], key[1]),
                ));
            }
            edges.insert(key, take(edge.at, own.control_points() - 2)?);
        }
        let mut patches = Vec::new();
        for element in &topology.elements {
            let mut own = Vec::new();
            for direction in 0..topology.parameters {
                own.push(along(
                    scan,
                    &listed,
                    element,
                    topology.parameters,
                    direction,
                )?);
            }
            patches.push(Patch {
                counts: own
                    .iter()
                    .map(|&(k, _)| knots[k].control_points())
                    .collect(),
                knots: own,
                first_inside: 0,
            });
        }
        let mut faces = HashMap::new();
        if topology.parameters == 3 {
            for (patch, element) in patches.iter().zip(&topology.elements) {
                for corners in FACES {
                    let ids = corners.map(|c| element.vertices[c]);
                    let sides = [corners[1], corners[3]]
                        .map(|c| patch.counts[direction_between(corners[0], c)] - 2);
                    let new = Face {
                        first: 0,
                        corners: [ids[0], ids[1]],
                        sides,
                    };
                    match faces.get(&sorted(ids)) {
                        None => {
                            let count = sides[0].saturating_mul(sides[1]);
                            let first = take(element.at, count)?;
                            faces.insert(sorted(ids), Face { first, ..new });
                        }
                        Some(face) => check_face(scan, element.at, face, ids, sides)?,
                    }
                }
            }
        }
        for (patch, element) in patches.iter_mut().zip(&topology.elements) {
            let inside = patch.counts.iter().map(|n| n - 2);
            let count = inside.fold(1_usize, usize::saturating_mul);
            patch.first_inside = take(element.at, count)?;
        }
        Ok(Self {
            total,
            edges,
            faces,
            patches,
        })
    }

    /// Patches together must not be much larger than what they share.
    fn check_size(&self, scan: &Scanner<'_>, numbers: usize) -> Result<(), ExchangeError> {
        let sizes = self.patches.iter().map(|patch| {
            let counts = patch.counts.iter().copied();
            counts.fold(1_usize, usize::saturating_mul)
        });
        if sizes.fold(0, usize::saturating_add) <= numbers.saturating_mul(MOST_SHARED) {
            Ok(())
        } else {
            Err(scan.unsupported(
                0,
                format!("more than {MOST_SHARED} patches share a control point on average"),
            ))
        }
    }

    /// The numbers of a patch's control points, the first index fastest.
    fn of_patch(&self, patch: &Patch, vertices: &[usize]) -> Vec<usize> {
        let n = patch.counts.len();
        let size = patch.counts.iter().product();
        let mut numbers = Vec::with_capacity(size);
        let mut index = vec![0; n];
        for _ in 0..size {
            numbers.push(self.of_point(patch, vertices, &index));
            for (i, count) in index.iter_mut().zip(&patch.counts) {
                *i += 1;
                if *i < *count {
                    break;
                }
                *i = 0;
            }
        }
        numbers
    }

    /// The number of the control point at an index.
    fn of_point(&self, patch: &Patch, vertices: &[usize], index: &[usize]) -> usize {
        let counts = &patch.counts;
        let free: Vec<_> = (0..index.len())
            .filter(|&d| index[d] > 0 && index[d] + 1 < counts[d])
            .collect();
        // The corner with these ends along the free directions, and the point's own end elsewhere.
        let corner = |ends: &[bool]| {
            let mut bits: Vec<_> = index.iter().map(|&i| i > 0).collect();
            for (&d, &end) in free.iter().zip(ends) {
                bits[d] = end;
            }
            vertices[corner_number(&bits)]
        };
        let inside = |d: usize, from_high: bool| {
            let m = index[d] - 1;
            if from_high { counts[d] - 3 - m } else { m }
        };
        match free[..] {
            [] => corner(&[]),
            [d] => {
                let (low, high) = (corner(&[false]), corner(&[true]));
                self.edges[&sorted([low, high])] + inside(d, low > high)
            }
            [a, b] if index.len() == 3 => {
                let ends = [[false, false], [true, false], [true, true], [false, true]];
                let ids = ends.map(|e| corner(&e));
                let face = &self.faces[&sorted(ids)];
                let [start, next] = face.corners.map(|id| ends[position(&ids, id)]);
                let (i, j) = (inside(a, start[0]), inside(b, start[1]));
                if start[0] == next[0] {
                    face.first + j + i * face.sides[0]
                } else {
                    face.first + i + j * face.sides[0]
                }
            }
            _ => {
                let mut number = 0;
                for d in (0..index.len()).rev() {
                    number = number * (counts[d] - 2) + index[d] - 1;
                }
                patch.first_inside + number
            }
        }
    }
}

/// Which knot vector runs along a direction of an element, and whether backwards.
fn along(
    scan: &Scanner<'_>,
    listed: &HashMap<[usize; 2], super::mfem::Edge>,
    element: &super::mfem::Element,
    parameters: usize,
    direction: usize,
) -> Result<(usize, bool), ExchangeError> {
    let mut found = None;
    for others in 0..1_usize << (parameters - 1) {
        let mut bits: Vec<_> = (0..parameters - 1).map(|k| others >> k & 1 == 1).collect();
        bits.insert(direction, false);
        let low = element.vertices[corner_number(&bits)];
        bits[direction] = true;
        let high = element.vertices[corner_number(&bits)];
        let edge = listed.get(&sorted([low, high])).ok_or_else(|| {
            scan.unsupported(
                element.at,
                format!("the edge of this element from vertex {low} to vertex {high} is not listed among the edges"),
            )
        })?;
        let own = (edge.knot_vector, edge.first != low);
        if *found.get_or_insert(own) != own {
            return Err(scan.unsupported(
                element.at,
                format!(
                    "the edges of this element along {} do not all have the same knot vector in the same direction",
                    parameter(direction)
                ),
            ));
        }
    }
    found.ok_or_else(|| scan.unsupported(element.at, "the element has no edges"))
}

/// A face met again must have the same corners in a row, and the same numbers along its sides.
///
/// Where the edges agree about their knot vectors the faces do too; this guards what is built on it.
fn check_face(
    scan: &Scanner<'_>,
    at: usize,
    face: &Face,
    ids: [usize; 4],
    sides: [usize; 2],
) -> Result<(), ExchangeError> {
    let [start, next] = face.corners.map(|id| position(&ids, id));
    let here = match (4 + next - start) % 4 {
        // Along the first side if it begins at an even corner, for the ring is 0 1 2 3.
        1 => Some(start % 2 == 0),
        3 => Some(start % 2 == 1),
        _ => None,
    };
    let turned = [sides[1], sides[0]];
    match here {
        Some(true) if sides == face.sides => Ok(()),
        Some(false) if turned == face.sides => Ok(()),
        _ => Err(scan.unsupported(
            at,
            format!("a face of this element, of the vertices {ids:?}, does not fit the element met before it"),
        )),
    }
}

/// The corner with these ends: 0 1 3 2 in the plane, then the same above.
fn corner_number(high: &[bool]) -> usize {
    let bit = |d: usize| usize::from(high.get(d).copied().unwrap_or(false));
    [0, 1, 3, 2][bit(0) + 2 * bit(1)] + 4 * bit(2)
}

/// The direction in which two corners of a cube differ.
fn direction_between(a: usize, b: usize) -> usize {
    let ends = |c: usize| [[0, 0], [1, 0], [1, 1], [0, 1]][c % 4];
    if a / 4 != b / 4 {
        2
    } else if ends(a)[0] != ends(b)[0] {
        0
    } else {
        1
    }
}

/// Where an id is; faces are compared by all their ids before.
fn position(ids: &[usize; 4], id: usize) -> usize {
    ids.iter().position(|&other| other == id).unwrap_or(0)
}

fn sorted<const N: usize>(mut ids: [usize; N]) -> [usize; N] {
    ids.sort_unstable();
    ids
}
