//! A solid that is the image of trivariate NURBS, in its place.
//!
//! Membership is point inversion over the Bézier cells, distance that to the outer faces, rows ask
//! where their line may meet those; see [`crate::patch`]. Where the nets are proved to be turned about the z
//! axis of their frame, distances are those of the turned region, which is the same solid to some ulps; volume, area and
//! centroid of both are compared before it is trusted. What is moved is the question, not the net.
//!
//! * Units: local lengths are those of the nets; the frame scales and places them.
//! * Volume and moments: integrals of the Jacobian determinant, every patch counted positive.

use super::measure::Moments;
use super::path::{Path, Stretch};
use super::revolved::Revolved;
use super::row::{Cuts, Row};
use super::rule::{Area, Cover, Normal, Patch, Rule};
use super::turn::Turn;
use crate::math::quadrature::Integral;
use crate::math::{Aabb, Dd, Real, Side, Similarity};
use crate::nurbs::{BezierCell, MapMoments, NurbsCurve, NurbsError, NurbsSurface, NurbsVolume};
use crate::patch::{Cells, FaceSet, Preimage};
use crate::region::{Boundary, Fill, ProfileCurve, ProfileLoop, Region};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;

/// A number that a volume has at each of its points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scalar {
    /// One of the parameters, by its place.
    Parameter(usize),
    /// A field, by its name.
    Field(String),
}

/// A scalar over the basis of a volume's net: values at the control points, combined as these are.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    name: String,
    /// For each volume the same net, its first coordinate the value.
    nets: Vec<NurbsVolume>,
}

impl Field {
    /// The field with a list of values for each volume, one for each control point.
    ///
    /// # Errors
    /// [`NurbsError::Length`] where the counts do not agree.
    pub fn new(
        name: String,
        volumes: &[NurbsVolume],
        values: &[&[f64]],
    ) -> Result<Self, NurbsError> {
        let nets = volumes.iter().zip(values).map(|(volume, values)| {
            NurbsVolume::new(
                volume.knots().clone(),
                values.iter().map(|&v| [v, 0.0, 0.0]).collect(),
                volume.weights().to_vec(),
            )
        });
        Ok(Self {
            name,
            nets: nets.collect::<Result<_, _>>()?,
        })
    }
}

/// Nets with all that is known of them; shared by the places they are put in.
#[derive(Debug)]
pub(crate) struct Nets {
    volumes: Vec<NurbsVolume>,
    cells: Cells,
    faces: FaceSet,
    moments: MapMoments,
    /// The point that the moments are about, and the area of the outer faces.
    about: [f64; 3],
    area: Integral,
    fields: Vec<Field>,
    /// What is turned, where the nets are proved to be so about the z axis.
    turned: Option<(Region, Turn)>,
}

impl Nets {
    /// How far the control points, and so the solid, reach in a direction along an axis, exactly; infinite in any other.
    fn hull(&self, direction: DVec3) -> f64 {
        let along = direction.to_array();
        let Some(k) = (0..3).find(|&k| along[k].abs() == 1.0) else {
            return f64::INFINITY;
        };
        if (0..3).any(|i| i != k && along[i] != 0.0) {
            return f64::INFINITY;
        }
        let points = self.volumes.iter().flat_map(|v| v.control_points());
        points.fold(f64::NEG_INFINITY, |m, p| m.max(p[k] * along[k]))
    }
}

/// The image of one or several trivariate NURBS.
#[derive(Debug, Clone)]
pub struct Patches {
    frame: Similarity,
    nets: Arc<Nets>,
    bounds: Aabb,
    /// Far wider than any rounding of the bounds, far narrower than the solid.
    margin: f64,
    /// The same solid as a turned region, to the rounding of the nets, where they are proved to be one.
    turned: Option<Revolved>,
}

impl Patches {
    /// The volumes, whose coordinates are local lengths of the frame.
    ///
    /// # Errors
    /// [`NurbsError`] when control points lie too far apart for their differences to be finite.
    pub fn new(
        frame: &Similarity,
        volumes: Vec<NurbsVolume>,
        fields: Vec<Field>,
    ) -> Result<Self, NurbsError> {
        let cells = Cells::new(&volumes)?;
        let faces = FaceSet::new(&volumes)?;
        let around = faces.bounds();
        let about = around
            .map_or(DVec3::ZERO, |b: Aabb| 0.5 * (b.min + b.max))
            .to_array();
        let mut moments = MapMoments::default();
        for volume in &volumes {
            add(&mut moments, &volume.moments_about(about)?);
        }
        let mut area = Integral::default();
        for face in faces.faces() {
            let surface: NurbsSurface = face.surface.to_spline([0.0; 2], [1.0; 2])?;
            let one = surface.area()?;
            area.value += one.value;
            area.error += one.error;
        }
        area.error += f64::EPSILON * area.value * 4.0;
        let mut made = Self::placed(
            frame.clone(),
            Arc::new(Nets {
                volumes,
                faces,
                moments,
                about,
                area,
                fields,
                turned: turned(&cells),
                cells,
            }),
        );
        if made.turned.as_ref().is_some_and(|t| !made.agrees(t)) {
            made.turned = None;
        }
        Ok(made)
    }

    /// Whether a turned region has the volume, area and centroid of the nets: then no part of them overlaps, and the
    /// surfaces are the same.
    fn agrees(&self, turned: &Revolved) -> bool {
        let (own, other) = (self.moments(), turned.moments());
        let same = |a: Integral, b: Integral, size: f64| {
            (a.value - b.value).abs() <= a.error + b.error + 1e-12 * size
        };
        let (volume, area) = (own.volume.value, own.area.value);
        let reach = volume * self.bounds.longest_side();
        let moved = (other.about - own.about).to_array();
        same(own.volume, other.volume, volume)
            && same(own.area, other.area, area)
            && (0..3).all(|k| {
                let first = other.first[k];
                let value = first.value + other.volume.value * moved[k];
                same(own.first[k], Integral { value, ..first }, reach)
            })
    }

    fn placed(frame: Similarity, nets: Arc<Nets>) -> Self {
        let bounds = Aabb::around(frame.origin_exact(), |k, sign| {
            // A world direction in local coordinates.
            let direction = DVec3::from_array([0, 1, 2].map(|i| frame.axis(i)[k])) * sign;
            // Rounding takes a flat face beyond its points; where the axes agree those are exact.
            let support = nets.faces.support(direction).min(nets.hull(direction));
            frame.scale_exact() * Dd::of(support * sign)
        });
        let turned = nets.turned.as_ref().map(|(region, turn)| {
            let frame = frame.with_local_unit(region.unit());
            let section = region.section().clone();
            Revolved::new(frame, turn.clone(), section)
        });
        Self {
            margin: 1e-9 * bounds.longest_side(),
            frame,
            nets,
            bounds,
            turned,
        }
    }

    pub(crate) fn frame(&self) -> &Similarity {
        &self.frame
    }

    /// The same solid as a turned region: its surface is that of the nets to some ulps of their size and place.
    pub(crate) fn turned(&self) -> Option<&Revolved> {
        self.turned.as_ref()
    }

    /// The volumes, in local coordinates of their frame.
    #[must_use]
    pub fn volumes(&self) -> &[NurbsVolume] {
        &self.nets.volumes
    }

    /// Two volumes that both hold the middle of a cell of the later one, or one twice where it holds the
    /// middle of a cell of its own again, and where, in local coordinates; `None` where no middle is
    /// held twice.
    #[must_use]
    pub fn overlap(&self) -> Option<([usize; 2], DVec3)> {
        for (later, volume) in self.nets.volumes.iter().enumerate() {
            for piece in volume.to_bezier().unwrap_or_default() {
                let at = piece.parameters([0.5; 3]);
                let Ok((middle, gradient)) = volume.gradient(at) else {
                    continue;
                };
                let [a, b, c] = gradient.map(DVec3::from_array);
                // A flat cell holds nothing that another could hold, too.
                if !(a.cross(b).dot(c).abs() > 1e-9 * a.length() * b.length() * c.length()) {
                    continue;
                }
                let middle = DVec3::from_array(middle);
                // Of several the lowest answers. What is its own is so to far less than this.
                let apart = |found: &Preimage| {
                    let share = |k: usize| {
                        (found.parameters[k] - at[k]).abs() / (piece.end[k] - piece.start[k])
                    };
                    (0..3).any(|k| share(k) > 0.25)
                };
                if let Some(found) = self.nets.cells.invert_in_space(middle)
                    && (found.volume < later || found.volume == later && apart(&found))
                {
                    return Some(([found.volume, later], middle));
                }
            }
        }
        None
    }

    /// The faces that bound the solid, in local coordinates.
    pub(crate) fn faces(&self) -> &FaceSet {
        &self.nets.faces
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Where a point comes from; `None` outside.
    #[must_use]
    pub fn invert(&self, point: DVec3) -> Option<Preimage> {
        let local = self.frame.to_local(point).point;
        self.nets.cells.invert(local).or_else(|| {
            // The point of the net's coordinates is rounded; on a face it may be outside of the net.
            if self.side(point) == Side::Outside {
                return None;
            }
            let nearest = self.nets.faces.nearest(local)?;
            let face = self.nets.faces.faces().get(nearest.face)?;
            Some(Preimage {
                volume: face.patch,
                parameters: face.volume_parameters(nearest.parameters),
            })
        })
    }

    /// The scalar at a point of the solid; 0 for a field that it does not have.
    #[must_use]
    pub fn scalar(&self, scalar: &Scalar, at: &Preimage) -> f64 {
        match scalar {
            Scalar::Parameter(k) => at.parameters[*k],
            Scalar::Field(name) => {
                let field = self.nets.fields.iter().find(|f| f.name == *name);
                let net = field.and_then(|f| f.nets.get(at.volume));
                let value = net.and_then(|n| n.evaluate(at.parameters).ok());
                value.map_or(0.0, |[value, ..]| value)
            }
        }
    }

    pub(super) fn side(&self, point: DVec3) -> Side {
        let margin = self.margin + 64.0 * f64::EPSILON * point.abs().max_element();
        if !(point.cmpge(self.bounds.min - margin).all()
            && point.cmple(self.bounds.max + margin).all())
        {
            return Side::Outside;
        }
        let local = self.frame.to_local(point);
        let exact = || self.frame.to_local_exact(point);
        let side = self.nets.cells.side(local.point, local.error, exact);
        // Where cells of different sizes meet, a face of one is on those of several: cells know of
        // pairs only, the outer faces of all.
        if side == Side::On && self.is_beneath(point, local.point) {
            Side::Inside
        } else {
            side
        }
    }

    /// Whether a point of the solid is further from the faces that bound it than rounding.
    #[cold]
    fn is_beneath(&self, point: DVec3, local: DVec3) -> bool {
        let size = self.bounds.longest_side() + point.abs().max_element();
        let scale = self.frame.scale();
        // Distances are told apart to 64 eps.
        let rounding = 256.0 * f64::EPSILON * size / scale;
        let limit = (self.margin / scale).max(2.0 * rounding);
        self.nets.faces.distance(local, limit) > rounding
    }

    pub(super) fn distance(&self, point: DVec3, inside: bool, limit: f64) -> f64 {
        if let Some(turned) = &self.turned {
            return turned.distance(point, inside, limit);
        }
        let scale = self.frame.scale();
        let limit_here = limit / scale;
        let found = self
            .nets
            .faces
            .distance(self.frame.to_local(point).point, limit_here);
        if found < limit_here {
            found * scale
        } else {
            limit
        }
    }

    pub(super) fn foot(&self, point: DVec3, _inside: bool) -> Option<DVec3> {
        let found = self.nets.faces.nearest(self.frame.to_local(point).point)?;
        Some(self.frame.to_world(found.foot))
    }

    pub(super) fn cuts(&self, row: &Row, cuts: &mut Cuts) {
        let local = row.local(&self.frame);
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
        let range = [-1.0, row.count as f64];
        let mut each = |a: f64, b: f64| cuts.add(a, b);
        self.nets
            .faces
            .line(local.start, local.along, range, local.error, &mut each);
    }

    /// Faces that lie in a plane normal to the grid axis.
    pub(super) fn flat_faces(&self, axis: usize) -> Vec<f64> {
        let mut heights = Vec::new();
        for face in self.nets.faces.faces() {
            let points = face.surface.control_points().iter();
            let world = points.map(|h| self.frame.to_world(DVec3::from_array(h.to_point()))[axis]);
            let (low, high) = world.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
            if high - low <= 1e-14 * self.bounds.longest_side() {
                heights.push(0.5 * (low + high));
            }
        }
        heights
    }

    pub(super) fn moments(&self) -> Moments {
        let (frame, nets) = (&self.frame, &*self.nets);
        let s = frame.scale();
        let local = &nets.moments;
        let axes = [0, 1, 2].map(|i| frame.axis(i));
        let centre = DVec3::from_array(nets.about);
        let about = frame.to_world(centre);
        let exact: [Dd; 3] = std::array::from_fn(|k| {
            let along = (0..3).map(|i| frame.axis_exact(i)[k] * Dd::of(centre[i]));
            frame.origin_exact()[k] + frame.scale_exact() * along.fold(Dd::ZERO, |s, v| s + v)
        });
        let of = |value: f64, error: f64, size: f64| Integral {
            value,
            error: error + 16.0 * f64::EPSILON * size,
        };
        let volume = local.volume.value;
        let first = std::array::from_fn(|k| {
            let rest = (exact[k] - Dd::of(about[k])).f64();
            let terms = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
            let value = terms(&|i| axes[i][k] * local.first[i].value);
            let error = terms(&|i| axes[i][k].abs() * local.first[i].error);
            let size = terms(&|i| axes[i][k].abs() * local.first[i].value.abs());
            let shift = volume * s.powi(3) * rest;
            let cubed = s.powi(4);
            let own = of(value * cubed, error * cubed, size * cubed);
            of(own.value + shift, own.error, shift.abs())
        });
        let second = std::array::from_fn(|k| {
            std::array::from_fn(|l| {
                let (mut value, mut error, mut size) = (0.0, 0.0, 0.0);
                for i in 0..3 {
                    for j in 0..3 {
                        let factor = axes[i][k] * axes[j][l];
                        let m = local.second[i][j];
                        value += factor * m.value;
                        error += factor.abs() * m.error;
                        size += factor.abs() * m.value.abs();
                    }
                }
                let power = s.powi(5);
                of(value * power, error * power, size * power)
            })
        });
        Moments {
            about,
            volume: of(
                volume * s.powi(3),
                local.volume.error * s.powi(3),
                volume * s.powi(3),
            ),
            area: of(
                nets.area.value * s * s,
                nets.area.error * s * s,
                nets.area.value * s * s,
            ),
            first,
            second,
        }
    }

    pub(super) fn translated(&self, by: DVec3) -> Self {
        let mut moved = Self::placed(self.frame.translated(by), self.nets.clone());
        if self.turned.is_none() {
            moved.turned = None;
        }
        moved
    }

    /// Whether the surface may come within `margin` (scene units) of a stretch of a path, given in local coordinates.
    pub(super) fn may_meet(&self, stretch: &Stretch, margin: f64) -> bool {
        let Aabb { min, max } = stretch.bounds();
        let margin = margin / self.frame.scale();
        let grown = Aabb {
            min: min - margin,
            max: max + margin,
        };
        let span = |direction: DVec3| {
            let [low, high] = stretch.span(direction);
            [low - margin, high + margin]
        };
        self.nets.faces.may_touch(&grown, span)
    }

    /// The outer faces: lines of constant first parameter.
    pub(super) fn patches(&self) -> Vec<Patch> {
        (0..self.nets.faces.faces().len())
            .map(Patch::face)
            .collect()
    }

    /// A ball around the part of a face between two parameters and two shares of its lines.
    pub(super) fn cover(&self, patch: Patch, t: [f64; 2], s: [f64; 2]) -> Cover {
        let cell = &self.nets.faces.faces()[patch.number].surface;
        let scale = self.frame.scale();
        let middle = [0.5 * (t[0] + t[1]), 0.5 * (s[0] + s[1])];
        let centre = cell.evaluate(middle).unwrap_or_default();
        let [across, along] = speeds(cell);
        Cover {
            centre: self.frame.to_world(DVec3::from_array(centre)),
            across: 0.5 * (t[1] - t[0]) * across * scale,
            along: 0.5 * (s[1] - s[0]) * along * scale,
        }
    }

    pub(super) fn pace(&self, patch: Patch, t: f64) -> f64 {
        let face = &self.nets.faces.faces()[patch.number].surface;
        let along = [0.0, 0.5, 1.0].map(|v| {
            let slopes = face
                .derivatives([t, v])
                .map(|d| DVec3::from_array(d.first[0]));
            slopes.map_or(0.0, DVec3::length)
        });
        along.into_iter().fold(0.0, f64::max) * self.frame.scale()
    }

    /// The curve of constant first parameter on a face.
    pub(super) fn rule(&self, patch: Patch, t: f64, hair: f64) -> Option<Rule> {
        let face = &self.nets.faces.faces()[patch.number];
        let line = FaceLine::new(&self.frame, &face.surface, t)?;
        if line.length() <= 2.0 * hair {
            return None;
        }
        let outward = f64::from(face.outward);
        let line = Arc::new(line);
        let path = |off: f64| Path::Face {
            line: line.clone(),
            off: off * outward,
        };
        Some(Rule {
            path: path(0.0),
            beside: [path(hair), path(-hair)],
            range: [0.0, 1.0],
            normal: Normal::Face {
                line: line.clone(),
                sign: outward,
            },
            area: Area::OfNormal,
        })
    }
}

/// Bounds on the length per unit of each parameter of a rational patch: G. Farin's for curves, of every row of
/// its net.
fn speeds(cell: &BezierCell<2>) -> [f64; 2] {
    let [p, q] = cell.degrees();
    let net = cell.control_points();
    let weights = net.iter().map(|h| h.weight);
    let (low, high) = weights.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
    let at = |i: usize, j: usize| DVec3::from_array(net[j * (p + 1) + i].to_point());
    let first = (0..p).flat_map(|i| (0..=q).map(move |j| (i, j)));
    let second = (0..=p).flat_map(|i| (0..q).map(move |j| (i, j)));
    let most = |steps: &mut dyn Iterator<Item = f64>| steps.fold(0.0, f64::max);
    #[allow(clippy::cast_precision_loss, reason = "degrees")]
    let degrees = [p as f64, q as f64];
    let ratio = (high / low).powi(2);
    [
        degrees[0] * ratio * most(&mut first.map(|(i, j)| at(i + 1, j).distance(at(i, j)))),
        degrees[1] * ratio * most(&mut second.map(|(i, j)| at(i, j + 1).distance(at(i, j)))),
    ]
}

/// The region that is turned, where the nets show one about the z axis.
fn turned(cells: &Cells) -> Option<(Region, Turn)> {
    let (outlines, [from, degrees]) = cells.outlines()?;
    let curve = |c: &NurbsCurve<2>| ProfileCurve::Nurbs {
        degree: c.degree(),
        knots: c.knots().knots().to_vec(),
        points: c.control_points().to_vec(),
        weights: c.weights().to_vec(),
    };
    let loops: Vec<ProfileLoop> = (outlines.iter())
        .map(|curves| curves.iter().map(curve).collect())
        .collect();
    let region = Region::new(&loops, Boundary::Closed, Fill::NonZero).ok()?;
    Some((region, Turn::new(from, degrees)))
}

fn add(sum: &mut MapMoments, one: &MapMoments) {
    let added = |a: Integral, b: Integral| Integral {
        value: a.value + b.value,
        error: a.error + b.error + f64::EPSILON * (a.value + b.value).abs(),
    };
    sum.volume = added(sum.volume, one.volume);
    for i in 0..3 {
        sum.first[i] = added(sum.first[i], one.first[i]);
        for j in 0..3 {
            sum.second[i][j] = added(sum.second[i][j], one.second[i][j]);
        }
    }
}

/// A line of constant first parameter on a rational patch, in the world, with what moves it along
/// the normal: the homogeneous curves of the point and of its slope across the line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FaceLine {
    /// (w x, w) of the points, from a common origin.
    points: SmallVec<[[f64; 4]; 8]>,
    /// Derivatives of these by the first parameter.
    slopes: SmallVec<[[f64; 4]; 8]>,
    origin: DVec3,
    /// The unit normal, where it is the same all along.
    normal: Option<DVec3>,
}

impl FaceLine {
    fn new(frame: &Similarity, cell: &BezierCell<2>, t: f64) -> Option<Self> {
        let [p, q] = cell.degrees();
        let first = cell.control_points().first()?.to_point();
        let origin = frame.to_world(DVec3::from_array(first));
        let s = frame.scale();
        let axes = [0, 1, 2].map(|i| frame.axis(i) * s);
        let placed = |j: usize, i: usize| -> [f64; 4] {
            let h = cell.control_points()[j * (p + 1) + i];
            let d: [f64; 3] = std::array::from_fn(|k| h.weighted[k] - h.weight * first[k]);
            let v = axes[0] * d[0] + axes[1] * d[1] + axes[2] * d[2];
            [v.x, v.y, v.z, h.weight]
        };
        let (mut points, mut slopes) = (SmallVec::new(), SmallVec::new());
        for j in 0..=q {
            let mut row: SmallVec<[[f64; 4]; 8]> = (0..=p).map(|i| placed(j, i)).collect();
            for level in (1..=p).rev() {
                if level == 1 {
                    #[allow(clippy::cast_precision_loss, reason = "a degree")]
                    let degree = p as f64;
                    slopes.push(std::array::from_fn(|c| degree * (row[1][c] - row[0][c])));
                }
                for i in 0..level {
                    row[i] = mix(row[i], row[i + 1], t);
                }
            }
            points.push(row[0]);
        }
        let normal = common_normal(&points, &slopes);
        Some(Self {
            points,
            slopes,
            origin,
            normal,
        })
    }

    /// Point, slope across the line and slope along it, at `s`.
    fn frame(&self, s: f64) -> [DVec3; 3] {
        let (h, along) = casteljau(&self.points, s);
        let (across, _) = casteljau(&self.slopes, s);
        let w = h[3];
        let x = xyz(h) / w;
        [
            x + self.origin,
            (xyz(across) - x * across[3]) / w,
            (xyz(along) - x * along[3]) / w,
        ]
    }

    /// The point moved by `off` along the unit normal across × along.
    pub(super) fn at(&self, s: f64, off: f64) -> DVec3 {
        if off == 0.0 {
            let (h, _) = casteljau(&self.points, s);
            return xyz(h) / h[3] + self.origin;
        }
        let [x, across, along] = self.frame(s);
        x + across.cross(along).normalize_or_zero() * off
    }

    /// The normal across × along, its length the area per unit of both parameters.
    pub(super) fn normal(&self, s: f64) -> DVec3 {
        let [_, across, along] = self.frame(s);
        across.cross(along)
    }

    /// A bound on the length per unit of the parameter.
    pub(super) fn speed(&self) -> f64 {
        // |x'| <= p max |P_{j+1} - P_j| (w_max / w_min)²: G. Farin's bound for rational curves.
        let weights = self.points.iter().map(|h| h[3]);
        let (low, high) = weights.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
        let at = |h: &[f64; 4]| xyz(*h) / h[3];
        let steps = self
            .points
            .windows(2)
            .map(|w| (at(&w[1]) - at(&w[0])).length());
        #[allow(clippy::cast_precision_loss, reason = "a degree")]
        let degree = (self.points.len() - 1) as f64;
        degree * steps.fold(0.0, f64::max) * (high / low).powi(2)
    }

    /// The same line in a body's own coordinates.
    pub(super) fn placed(&self, frame: &Similarity) -> Self {
        let turned = |h: &[f64; 4]| {
            let v = frame.vector_to_local(xyz(*h));
            [v.x, v.y, v.z, h[3]]
        };
        Self {
            points: self.points.iter().map(turned).collect(),
            slopes: self.slopes.iter().map(turned).collect(),
            origin: frame.to_local(self.origin).point,
            normal: (self.normal).map(|n| frame.vector_to_local(n).normalize_or_zero()),
        }
    }

    /// Points in whose convex hull, grown by the length that comes with them, the part between two parameters lies,
    /// moved by `off` along the normal.
    pub(super) fn hull(&self, [a, b]: [f64; 2], off: f64) -> (SmallVec<[DVec3; 8]>, f64) {
        let (by, room) = match self.normal {
            Some(normal) => (normal * off, 0.0),
            None => (DVec3::ZERO, off.abs()),
        };
        let mut row: SmallVec<[[f64; 4]; 8]> = self.points.clone();
        let n = row.len();
        if b < 1.0 {
            for level in 1..n {
                for i in (level..n).rev() {
                    row[i] = mix(row[i - 1], row[i], b);
                }
            }
        }
        if a > 0.0 {
            let share = a / b;
            for level in 1..n {
                for i in 0..n - level {
                    row[i] = mix(row[i], row[i + 1], share);
                }
            }
        }
        let points = row.iter().map(|h| xyz(*h) / h[3] + self.origin + by);
        (points.collect(), room)
    }

    /// Length of the control polygon.
    fn length(&self) -> f64 {
        let at = |h: &[f64; 4]| xyz(*h) / h[3];
        self.points
            .windows(2)
            .map(|w| (at(&w[1]) - at(&w[0])).length())
            .sum()
    }
}

/// The unit normal of a line whose control points, and those of its slope across, are in one plane with its origin.
fn common_normal(points: &[[f64; 4]], slopes: &[[f64; 4]]) -> Option<DVec3> {
    let (h, along) = casteljau(points, 0.5);
    let (across, _) = casteljau(slopes, 0.5);
    let x = xyz(h) / h[3];
    let [across, along] = [across, along].map(|d| xyz(d) - x * d[3]);
    let normal = across.cross(along).try_normalize()?;
    let even = |vectors: &[[f64; 4]]| {
        let size = vectors.iter().map(|v| xyz(*v).length()).fold(0.0, f64::max);
        let heights = vectors.iter().map(|v| normal.dot(xyz(*v)).abs());
        heights.fold(0.0, f64::max) <= 4.0 * f64::EPSILON * size
    };
    (even(points) && even(slopes)).then_some(normal)
}

fn xyz(h: [f64; 4]) -> DVec3 {
    DVec3::new(h[0], h[1], h[2])
}

fn mix(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t)
}

/// Value and derivative of a homogeneous Bézier curve.
fn casteljau(points: &[[f64; 4]], s: f64) -> ([f64; 4], [f64; 4]) {
    let mut row: SmallVec<[[f64; 4]; 8]> = SmallVec::from_slice(points);
    let degree = row.len() - 1;
    let mut slope = [0.0; 4];
    for level in (1..=degree).rev() {
        if level == 1 {
            #[allow(clippy::cast_precision_loss, reason = "a degree")]
            let factor = degree as f64;
            slope = std::array::from_fn(|c| factor * (row[1][c] - row[0][c]));
        }
        for i in 0..level {
            row[i] = mix(row[i], row[i + 1], s);
        }
    }
    (row[0], slope)
}
