//! The outer faces of a solid given by trivariate rational splines.
//!
//! A solid is the union of the images of one or several volumes. Each volume's image is bounded by
//! the images of its six parameter faces, except where two of them meet face to face (in one volume
//! that closes on itself, or in two volumes that touch) and where a face has collapsed to a curve or
//! a point. What is left, as Bézier pieces, are the outer faces.
//!
//! ```text
//!   face of parameter k at its end:   X_a × X_b · X_k = ± det [X_u X_v X_w],   + for k = u, w
//!   (a, b the others in order)                                                 - for k = v
//! ```
//!
//! so the sign of the Jacobian in the cell behind a face says on which side the solid is.
//!
//! * Collapsed: X_a × X_b vanishes on as many points as its numerator has coefficients, to 1e-12 of
//!   the unit times the face's own extent.
//! * Shared: equal control nets after raising degrees, in one of the eight orders of a square net,
//!   points to 4 eps (size + |P|), as those of cells are, and weights up to a common factor, with the
//!   solid on opposite sides; see [`pair_off`]. Faces whose knots do not match are cut at each
//!   other's corners first.
//! * Limits: volumes that overlap, or touch in faces that are not the same map up to an affine change
//!   of parameters, keep their faces.
//! * Units: model units outside; inside, coordinates relative to the solid's middle over a power of
//!   two ([`Frame`]), so that nothing is lost far from the origin.

use super::face_match::pair_off;
use super::face_net::{Net, Point4, cartesian, cross, dot, length, minus, real};
use super::shared;
use crate::nurbs::{
    BezierCell, Homogeneous, KnotVector, NurbsError, NurbsVolume, clamp, refine_knots,
};
use glam::DVec3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Share of the unit below which a face may meet another, or is none; whether two are one is decided
/// by the frame's tolerance.
pub(super) const COINCIDE: f64 = 1e-12;

/// Where a solid is: its middle, and a power of two near half its longest side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub(super) centre: DVec3,
    pub(super) unit: f64,
    /// Distance below which points of two nets count as one, in units.
    pub(super) tolerance: f64,
}

impl Frame {
    /// Coordinates of a model point relative to the middle, in units.
    #[inline]
    pub(super) fn local(&self, p: DVec3) -> [f64; 3] {
        ((p - self.centre) / self.unit).to_array()
    }

    /// The model point of local coordinates.
    #[inline]
    pub(super) fn model(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from_array(p) * self.unit + self.centre
    }

    fn around(patches: &[NurbsVolume]) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for patch in patches {
            let (a, b) = patch.control_bounds();
            low = low.min(DVec3::from_array(a));
            high = high.max(DVec3::from_array(b));
        }
        if patches.is_empty() {
            return Self {
                centre: DVec3::ZERO,
                unit: 1.0,
                tolerance: 0.0,
            };
        }
        let half = (0.5 * high - 0.5 * low).max_element();
        let far = low.abs().max(high.abs()).max_element();
        let exponent = half.log2().ceil();
        // A point has no size; any unit will do.
        let unit = if exponent.is_finite() {
            exponent.clamp(-1000.0, 1000.0).exp2()
        } else {
            1.0
        };
        Self {
            centre: 0.5 * low + 0.5 * high,
            unit,
            tolerance: shared::tolerance(half, far) / unit,
        }
    }
}

/// Which end of its parameter a face lies at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum End {
    /// The parameter's first value.
    First,
    /// The parameter's last value.
    Last,
}

/// A part of the boundary of a solid: a Bézier piece of a face of a volume.
#[derive(Debug, Clone, PartialEq)]
pub struct OuterFace {
    /// The piece, in model units; its parameters are the volume's other two, in order.
    pub surface: BezierCell<2>,
    /// +1 where X_u × X_v of `surface` points out of the solid, -1 where it points in, 0 where the
    /// volume behind the face is flat.
    pub outward: i8,
    /// Index of the volume.
    pub patch: usize,
    /// The Bézier cell of the volume, by its span along each parameter.
    pub cell: [usize; 3],
    /// The parameter that is constant on the face: 0, 1 or 2.
    pub parameter: usize,
    /// At which end of that parameter's domain.
    pub end: End,
    /// The parameter's value there.
    pub value: f64,
    /// First and last value of the volume's other two parameters on the piece.
    pub domain: [[f64; 2]; 2],
}

impl OuterFace {
    /// The volume's parameters at (u, v) of the piece.
    #[must_use]
    pub fn volume_parameters(&self, at: [f64; 2]) -> [f64; 3] {
        let mut result = [self.value; 3];
        let others = (0..3).filter(|&k| k != self.parameter);
        for ((k, [a, b]), t) in others.zip(self.domain).zip(at) {
            result[k] = a * (1.0 - t) + b * t;
        }
        result
    }
}

/// A face while it is sorted out: a net in local coordinates and where it comes from.
#[derive(Debug, Clone)]
pub(super) struct Face {
    pub(super) net: Net,
    pub(super) outward: i8,
    patch: usize,
    cell: [usize; 3],
    parameter: usize,
    end: End,
    value: f64,
    domain: [[f64; 2]; 2],
}

impl Face {
    /// The part from `from` to `to` of the face's parameters.
    pub(super) fn part(&self, from: [f64; 2], to: [f64; 2]) -> Self {
        let mut part = self.clone();
        for k in 0..2 {
            part.net = part.net.restrict(k, from[k], to[k]);
            let [a, b] = self.domain[k];
            let at = |t: f64| a * (1.0 - t) + b * t;
            part.domain[k] = [at(from[k]), at(to[k])];
        }
        part
    }

    fn publish(&self, frame: &Frame) -> Result<OuterFace, NurbsError> {
        let points = (self.net.points.iter())
            .map(|&p| Homogeneous::from_point(frame.model(cartesian(p)).to_array(), p[3]));
        Ok(OuterFace {
            surface: BezierCell::new(self.net.degrees, points.collect())?,
            outward: self.outward,
            patch: self.patch,
            cell: self.cell,
            parameter: self.parameter,
            end: self.end,
            value: self.value,
            domain: self.domain,
        })
    }
}

/// The outer faces of the union of `patches`: local nets, published faces, and the frame.
pub(super) fn collect(
    patches: &[NurbsVolume],
) -> Result<(Frame, Vec<Net>, Vec<OuterFace>), NurbsError> {
    let frame = Frame::around(patches);
    let mut faces = Vec::new();
    for (index, patch) in patches.iter().enumerate() {
        faces_of(patch, index, &frame, &mut faces)?;
    }
    faces.retain(|face| !is_collapsed(&face.net));
    let faces = pair_off(faces, frame.tolerance);
    let published: Result<Vec<_>, _> = faces.iter().map(|face| face.publish(&frame)).collect();
    Ok((
        frame,
        faces.into_iter().map(|face| face.net).collect(),
        published?,
    ))
}

/// The outer faces of the union of the images of `patches`.
///
/// # Errors
/// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`] when a mean leaves the range of f64.
///
/// ```
/// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
/// # use voxlathe::patch::outer_faces;
/// let line = || KnotVector::bezier(1);
/// let cube = |x: f64| {
///     let points = (0..8).map(|i| [x + f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]);
///     NurbsVolume::new([line()?, line()?, line()?], points.collect(), vec![1.0; 8])
/// };
/// assert_eq!(outer_faces(&[cube(0.0)?])?.len(), 6);
/// // Side by side, two cubes have one face each less.
/// assert_eq!(outer_faces(&[cube(0.0)?, cube(1.0)?])?.len(), 10);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn outer_faces(patches: &[NurbsVolume]) -> Result<Vec<OuterFace>, NurbsError> {
    Ok(collect(patches)?.2)
}

/// A net of three indices on its way to Bézier form.
struct Block {
    counts: [usize; 3],
    points: Vec<Homogeneous<3>>,
}

impl Block {
    fn place(&self, at: [usize; 3]) -> usize {
        at[0] + self.counts[0] * (at[1] + self.counts[1] * at[2])
    }

    /// Every row along `direction` through `f`.
    fn map_rows(
        &self,
        direction: usize,
        mut f: impl FnMut(&[Homogeneous<3>]) -> Result<Vec<Homogeneous<3>>, NurbsError>,
    ) -> Result<Self, NurbsError> {
        let [a, b] = others(direction);
        let mut rows = Vec::new();
        for j in 0..self.counts[b] {
            for i in 0..self.counts[a] {
                let mut at = [0; 3];
                (at[a], at[b]) = (i, j);
                let row: Vec<_> = (0..self.counts[direction])
                    .map(|k| {
                        at[direction] = k;
                        self.points[self.place(at)]
                    })
                    .collect();
                rows.push(f(&row)?);
            }
        }
        let mut counts = self.counts;
        counts[direction] = rows.first().map_or(0, Vec::len);
        let mut block = Self {
            counts,
            points: vec![Homogeneous::ZERO; counts.iter().product()],
        };
        for j in 0..counts[b] {
            for i in 0..counts[a] {
                for k in 0..counts[direction] {
                    let mut at = [0; 3];
                    (at[a], at[b], at[direction]) = (i, j, k);
                    let place = block.place(at);
                    block.points[place] = rows[i + counts[a] * j][k];
                }
            }
        }
        Ok(block)
    }
}

/// The two parameters other than `k`, in order.
fn others(k: usize) -> [usize; 2] {
    match k {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

/// A row of control points in Bézier form: spans of p + 1 points that share their ends.
fn row_to_bezier(
    knots: &KnotVector,
    row: &[Homogeneous<3>],
) -> Result<Vec<Homogeneous<3>>, NurbsError> {
    let (knots, row) = clamp(knots, row)?;
    let mut inserted = Vec::new();
    for span in knots.spans().skip(1) {
        let missing = knots
            .degree()
            .saturating_sub(knots.multiplicity(span.start));
        inserted.extend(std::iter::repeat_n(span.start, missing));
    }
    Ok(refine_knots(&knots, &row, &inserted)?.1)
}

/// The Bézier pieces of a volume's six parameter faces.
fn faces_of(
    patch: &NurbsVolume,
    index: usize,
    frame: &Frame,
    faces: &mut Vec<Face>,
) -> Result<(), NurbsError> {
    let local: Vec<[f64; 3]> = (patch.control_points().iter())
        .map(|&p| frame.local(DVec3::from_array(p)))
        .collect();
    // Weights near 1, by a power of two.
    let largest = patch.weights().iter().fold(0.0_f64, |m, &w| m.max(w));
    let power = (-largest.log2().floor()).clamp(-1000.0, 1000.0).exp2();
    let weights: Vec<f64> = patch.weights().iter().map(|w| w * power).collect();
    let volume = NurbsVolume::new(patch.knots().clone(), local, weights)?;
    let mut block = Block {
        counts: volume.counts(),
        points: volume.to_homogeneous(),
    };
    for (k, knots) in volume.knots().iter().enumerate() {
        block = block.map_rows(k, |row| row_to_bezier(knots, row))?;
    }
    let spans = volume.knots().each_ref().map(|knots| {
        let spans: Vec<[f64; 2]> = knots.spans().map(|s| [s.start, s.end]).collect();
        spans
    });
    let degrees = volume.degrees();
    // One that is one to one has one sign all through; a flat cell has that of the others.
    let whole = whole_sign(&volume, &spans)?;
    // Cells at edges have several faces.
    let mut signs: HashMap<[usize; 3], i8> = HashMap::new();
    for parameter in 0..3 {
        let [a, b] = others(parameter);
        for end in [End::First, End::Last] {
            let last = spans[parameter].len().saturating_sub(1);
            let (span, layer) = match end {
                End::First => (0, 0),
                End::Last => (last, block.counts[parameter] - 1),
            };
            for (j, &domain_b) in spans[b].iter().enumerate() {
                for (i, &domain_a) in spans[a].iter().enumerate() {
                    let mut cell = [span; 3];
                    (cell[a], cell[b]) = (i, j);
                    let mut points = smallvec::SmallVec::new();
                    for y in 0..=degrees[b] {
                        for x in 0..=degrees[a] {
                            let mut at = [layer; 3];
                            (at[a], at[b]) = (i * degrees[a] + x, j * degrees[b] + y);
                            let h = block.points[block.place(at)];
                            let [p, q, r] = h.weighted;
                            points.push([p, q, r, h.weight] as Point4);
                        }
                    }
                    let [first, last] = spans[parameter][span];
                    let sign = match signs.entry(cell) {
                        Entry::Occupied(known) => *known.get(),
                        Entry::Vacant(place) => {
                            let boxed = std::array::from_fn(|k| spans[k][cell[k]]);
                            let sign = jacobian_sign(&volume, boxed)?;
                            *place.insert(if sign == 0 { whole } else { sign })
                        }
                    };
                    faces.push(Face {
                        net: Net {
                            degrees: [degrees[a], degrees[b]],
                            points,
                        },
                        outward: match (parameter == 1, end) {
                            (false, End::Last) | (true, End::First) => sign,
                            _ => -sign,
                        },
                        patch: index,
                        cell,
                        parameter,
                        end,
                        value: if end == End::First { first } else { last },
                        domain: [domain_a, domain_b],
                    });
                }
            }
        }
    }
    Ok(())
}

/// The sign of det [X_u X_v X_w] in the first cell that is not flat.
fn whole_sign(volume: &NurbsVolume, spans: &[Vec<[f64; 2]>; 3]) -> Result<i8, NurbsError> {
    for &w in &spans[2] {
        for &v in &spans[1] {
            for &u in &spans[0] {
                let sign = jacobian_sign(volume, [u, v, w])?;
                if sign != 0 {
                    return Ok(sign);
                }
            }
        }
    }
    Ok(0)
}

/// The sign of det [X_u X_v X_w] in a cell: that of its integral by Gauss's rule of three points.
///
/// A map that is one-to-one has one sign all through; where it touches zero on a face or an edge of
/// the cell, the points inside still tell.
fn jacobian_sign(volume: &NurbsVolume, cell: [[f64; 2]; 3]) -> Result<i8, NurbsError> {
    const AT: [f64; 3] = [0.112_701_665_379_258_3, 0.5, 0.887_298_334_620_741_7];
    const SHARE: [f64; 3] = [5.0, 8.0, 5.0];
    let (mut sum, mut size) = (0.0, 0.0);
    for index in 0..27 {
        let digit = [index % 3, index / 3 % 3, index / 9];
        let at = std::array::from_fn(|k| {
            let [a, b] = cell[k];
            a * (1.0 - AT[digit[k]]) + b * AT[digit[k]]
        });
        let (_, [x, y, z]) = volume.gradient(at)?;
        let share = digit.map(|d| SHARE[d]).iter().product::<f64>();
        sum += share * dot(cross(x, y), z);
        size += share * length(x) * length(y) * length(z);
    }
    Ok(if sum > 1e-12 * size {
        1
    } else if sum < -1e-12 * size {
        -1
    } else {
        0
    })
}

/// Whether a face has no area.
///
/// The numerator of X_u × X_v has degrees 3p - 1 and 3q - 1 at most; it vanishes when it does on a
/// grid of 3p by 3q points.
fn is_collapsed(net: &Net) -> bool {
    let [n, m] = net.degrees.map(|p| 3 * p);
    let first = cartesian(net.points[0]);
    let extent =
        (net.points.iter()).fold(0.0_f64, |e, &p| e.max(length(minus(cartesian(p), first))));
    let most = COINCIDE * extent;
    // Chebyshev's points: a polynomial small on them is small between them.
    let at = |i: usize, n: usize| {
        let angle = std::f64::consts::PI * (real(i) + 0.5) / real(n);
        0.5 - 0.5 * angle.cos()
    };
    let flat = |i: usize, j: usize| {
        let jet = net.jet(at(i, n), at(j, m));
        let x = cartesian(jet.value);
        let slope = |d: Point4| -> [f64; 3] {
            std::array::from_fn(|c| (d[c] - x[c] * d[3]) / jet.value[3])
        };
        length(cross(slope(jet.u), slope(jet.v))) <= most
    };
    (0..m).all(|j| (0..n).all(|i| flat(i, j)))
}
