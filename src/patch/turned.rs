//! Volumes whose net is proved to be turned about an axis, and their preimages in closed form.
//!
//! The three constructions of a solid of revolution leave their mark in the net, whoever made it. About an axis with
//! coordinates ρ = x + i y across it and z along it, the control points and weights are products:
//!
//! ```text
//!   surface × circle   ρ_sj = r_s e_j,  z_sj = z_s,  w_sj = ω_s q_j,   (e, q) an arc      r, z, angle apart
//!   ... of a ruled one r_ik = R_i ρ_k,  z_ik = z_i,  w_ik = ω_i σ_k                       z -> u, r / R(u) -> s
//!   curve × disc       ρ_ik = R_i d_k,  z_ik = z_i,  w_ik = ω_i q_k,   (d, q) a disc      z -> u, ρ / R(u) -> disc
//! ```
//!
//! so that X is the section at (r, z) turned by the angle, or the disc scaled by R(u) at the height z(u), and
//! the parameters follow one or two at a time: the angle in closed form ([`arc`](super::arc)), a height from a function
//! of one parameter ([`monotone`](super::monotone)), a section or a disc in the plane
//! ([`section`](super::section)).
//!
//! * The axis: one of the coordinate axes, the axis of the circle through three points of a ring of the net, or the line
//!   through the middle of a layer and normal to it. Whichever it is, every control point is then held against the product;
//!   one that is off by more than [`SLACK`] ε (size + |P|) sends the volume to the general search.
//! * Accuracy: a preimage that is given is mapped to within 64 ε (size + |P|) of the point. What is nearer than 2^-43
//!   (size + |P|) to a face, a knot of a section or the axis is left to the general search, so that sides and shared
//!   faces are decided from the net itself.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §8.3 (surfaces of revolution).

use super::arc::{Arc, Found};
use super::invert::Preimage;
use super::monotone::Monotone;
use super::section::Section;
use crate::nurbs::{KnotVector, NurbsCurve, NurbsSurface, NurbsVolume};
use glam::{DMat3, DVec3};

/// How far a control point may be from the product, in ε (size + |P|); weights are compared relative to theirs.
const SLACK: f64 = 8.0;

/// Nearer to a face than this share of the lengths a point is left open; SLACK ε and rounding are well below it.
const MARGIN: f64 = 1.0 / (1_u64 << 43) as f64;

/// An axis with two directions across it.
#[derive(Debug, Clone, Copy)]
struct Axis {
    origin: DVec3,
    /// Rows x, y, z.
    to_local: DMat3,
    /// Whether local coordinates are those of the nets in another order.
    exact: bool,
}

/// The half-plane at one angle.
#[derive(Debug, Clone)]
enum Meridian {
    /// Any section, over two directions.
    Surface([usize; 2], Box<Section>),
    /// Lines from the axis to a curve: the curve's direction, its height and radius, then the other's share.
    Ruled([usize; 2], Monotone, Monotone),
}

#[derive(Debug, Clone)]
enum Shape {
    /// Turned along a direction.
    Circle(usize, Arc, Meridian),
    /// A disc over two directions, scaled and shifted along a third.
    Disc(usize, Monotone, [usize; 2], Box<Section>),
}

/// One volume.
#[derive(Debug, Clone)]
struct Turned {
    /// Where it is, with the margin.
    low: DVec3,
    high: DVec3,
    /// `None` where nothing was recognised.
    shape: Option<(Axis, Shape)>,
    /// The section that is turned, where it is known: curves (r, z) head to tail, and the turn in degrees.
    outline: Option<(Vec<NurbsCurve<2>>, [f64; 2])>,
    /// The margin, and the length that rounding is in proportion to.
    margin: f64,
    length: f64,
}

/// The volumes of a solid, as far as they are turned.
#[derive(Debug, Clone)]
pub(super) struct TurnedSet {
    volumes: Vec<Turned>,
}

impl TurnedSet {
    /// What the nets show.
    pub(super) fn new(volumes: &[NurbsVolume]) -> Self {
        let volumes = volumes.iter().map(Turned::new).collect();
        Self { volumes }
    }

    /// Whether every volume is ruled to the axis: then a side is found sooner than in the cells.
    pub(super) fn is_ruled(&self) -> bool {
        let ruled = |shape: &Shape| matches!(shape, Shape::Circle(_, _, Meridian::Ruled(..)));
        let mut shapes = self.volumes.iter().map(|v| v.shape.as_ref());
        shapes.all(|s| s.is_some_and(|(_, shape)| ruled(shape)))
    }

    /// How many volumes were recognised.
    pub(super) fn recognised(&self) -> usize {
        self.volumes.iter().filter(|v| v.shape.is_some()).count()
    }

    /// Closed loops (r, z) whose union is turned about the z axis, and the turn in degrees, from where and how far; `None`
    /// where volumes are turned otherwise, or not.
    pub(super) fn outlines(&self) -> Option<(Vec<Vec<NurbsCurve<2>>>, [f64; 2])> {
        let mut loops = Vec::new();
        let mut turn: Option<[f64; 2]> = None;
        for volume in &self.volumes {
            let (axis, _) = volume.shape.as_ref()?;
            let (outline, own) = volume.outline.as_ref()?;
            let about_z = axis.exact && axis.to_local == DMat3::IDENTITY;
            let same = turn.is_none_or(|t| (0..2).all(|k| (t[k] - own[k]).abs() <= 1e-12));
            if !(about_z && same) {
                return None;
            }
            turn = Some(*own);
            loops.push(outline.clone());
        }
        Some((loops, turn?))
    }

    /// The first volume that has the point inside, and the parameters there.
    ///
    /// * `error`: bound on the rounding of each coordinate.
    pub(super) fn find(&self, point: DVec3, error: f64) -> Found<Preimage> {
        for (volume, turned) in self.volumes.iter().enumerate() {
            match turned.find(point, error) {
                Found::Nowhere => {}
                Found::Unclear => return Found::Unclear,
                Found::At(parameters) => return Found::At(Preimage { volume, parameters }),
            }
        }
        Found::Nowhere
    }
}

/// A net as a matrix: one direction, or several together, against the rest.
struct Table<'a> {
    rows: usize,
    columns: usize,
    place: &'a dyn Fn(usize, usize) -> usize,
}

/// A matrix that is a product: v_ik = r_i d_k.
struct Product {
    scales: Vec<f64>,
    shape: Vec<[f64; 2]>,
}

impl Table<'_> {
    /// Numbers as r_i d_k with the largest |d_k| 1, or |d_0| where `first` says so, to a tolerance.
    fn product(
        &self,
        of: &dyn Fn(usize) -> [f64; 2],
        tolerance: f64,
        first: bool,
    ) -> Option<Product> {
        let at = |i: usize, k: usize| of((self.place)(i, k));
        let size = |v: [f64; 2]| v[0].hypot(v[1]);
        let columns = if first { 1 } else { self.columns };
        let (mut row, mut column, mut largest) = (0, 0, 0.0);
        for i in 0..self.rows {
            for k in 0..columns {
                if size(at(i, k)) > largest {
                    (row, column, largest) = (i, k, size(at(i, k)));
                }
            }
        }
        if !(largest > 64.0 * tolerance) {
            return None;
        }
        let shape: Vec<[f64; 2]> = (0..self.columns)
            .map(|k| at(row, k).map(|c| c / largest))
            .collect();
        let d = shape[column];
        // Radii that are rounding of 0 are 0; the axis is never crossed.
        let scale = |i: usize| {
            let v = at(i, column);
            let r = v[0] * d[0] + v[1] * d[1];
            if r < 0.0 && r >= -tolerance { 0.0 } else { r }
        };
        let scales: Vec<f64> = (0..self.rows).map(scale).collect();
        let same = (0..self.rows).all(|i| {
            (0..self.columns).all(|k| {
                let v = at(i, k);
                let off = [0, 1].map(|c| v[c] - scales[i] * shape[k][c]);
                size(off) <= tolerance
            })
        });
        (same && scales.iter().all(|r| *r >= 0.0)).then_some(Product { scales, shape })
    }

    /// Whether a number depends on the row alone.
    fn constant_along_rows(&self, of: &dyn Fn(usize) -> f64, tolerance: f64) -> bool {
        (0..self.rows).all(|i| {
            let first = of((self.place)(i, 0));
            (0..self.columns).all(|k| (of((self.place)(i, k)) - first).abs() <= tolerance)
        })
    }

    /// Weights as ω_i q_k, q_0 = 1, to rounding.
    fn weights(&self, of: &dyn Fn(usize) -> f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let at = |i: usize, k: usize| of((self.place)(i, k));
        let rows: Vec<f64> = (0..self.rows).map(|i| at(i, 0)).collect();
        let columns: Vec<f64> = (0..self.columns).map(|k| at(0, k) / at(0, 0)).collect();
        let same = (0..self.rows).all(|i| {
            (0..self.columns).all(|k| {
                let w = at(i, k);
                (w - rows[i] * columns[k]).abs() <= SLACK * f64::EPSILON * w
            })
        });
        same.then_some((rows, columns))
    }
}

/// A net in the coordinates of an axis.
struct LocalNet<'a> {
    volume: &'a NurbsVolume,
    points: Vec<DVec3>,
    tolerance: f64,
}

impl Turned {
    fn new(volume: &NurbsVolume) -> Self {
        let (low, high) = volume.control_bounds();
        let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
        let far = low.abs().max(high.abs()).max_element();
        let length = (high - low).max_element() + far;
        let margin = MARGIN * length;
        let tolerance = SLACK * f64::EPSILON * length;
        let shape = if length > 1e-250 && length < 1e250 {
            // Far from an axis its coordinates would be rounding.
            let middle = 0.5 * (low + high);
            let near = |axis: &Axis| (axis.origin - middle).length() <= 2.0 * length;
            candidates(volume)
                .into_iter()
                .filter(near)
                .find_map(|axis| {
                    let net = LocalNet::new(volume, &axis, tolerance);
                    let circle = (0..3).find_map(|k| net.circle(k));
                    let (shape, outline) = circle.or_else(|| (0..3).find_map(|k| net.disc(k)))?;
                    Some(((axis, shape), outline))
                })
        } else {
            None
        };
        let (shape, outline) = shape.unzip();
        Self {
            low: low - margin,
            high: high + margin,
            shape,
            outline: outline.flatten(),
            margin,
            length,
        }
    }

    fn find(&self, point: DVec3, error: f64) -> Found<[f64; 3]> {
        if !(point.cmpge(self.low).all() && point.cmple(self.high).all()) {
            return Found::Nowhere;
        }
        let Some((axis, shape)) = &self.shape else {
            return Found::Unclear;
        };
        if !(error <= f64::EPSILON * self.length) {
            return Found::Unclear;
        }
        let local = axis.to_local * (point - axis.origin);
        let (d, z) = ([local.x, local.y], local.z);
        // Rounding of the change of axes, in each coordinate.
        let error = 2.0 * error + 4.0 * f64::EPSILON * self.length;
        let margin = self.margin;
        match shape {
            Shape::Circle(around, arc, meridian) => {
                let r = d[0].hypot(d[1]);
                let mut found = [0.0; 3];
                match meridian {
                    Meridian::Surface(along, section) => {
                        match section.invert([r, z], error, margin) {
                            Found::At(t) => [found[along[0]], found[along[1]]] = t,
                            other => return other.without(),
                        }
                    }
                    Meridian::Ruled([u, s], curve, share) => {
                        let root = match curve.solve(z, error, margin) {
                            Found::At(root) => root,
                            other => return other.without(),
                        };
                        let [radius, off] = curve.companion(&root);
                        let [low, high] = share.range();
                        let off = off * high + margin;
                        if r > high * radius + off || r < low * radius - off {
                            return Found::Nowhere;
                        }
                        // A share of r / R is known to the error over R.
                        if !(r < high * radius - off && r > low * radius + off) {
                            return Found::Unclear;
                        }
                        let part = share.solve(r / radius, off / radius, 0.0);
                        let Found::At(part) = part else {
                            return Found::Unclear;
                        };
                        found[*u] = curve.parameter(&root);
                        found[*s] = share.parameter(&part);
                    }
                }
                if !(r > margin) {
                    return Found::Unclear;
                }
                match arc.parameter(d, margin, axis.exact) {
                    Found::At(t) => found[*around] = t,
                    other => return other.without(),
                }
                Found::At(found)
            }
            Shape::Disc(along, curve, over, disc) => {
                let root = match curve.solve(z, error, margin) {
                    Found::At(root) => root,
                    other => return other.without(),
                };
                let [radius, off] = curve.companion(&root);
                let off = off + margin;
                if !(radius > 2.0 * off) {
                    return Found::Unclear;
                }
                let scaled = d.map(|x| x / radius);
                // Outside the disc is what is far from it; its edges keep the margin of lengths.
                match disc.invert(scaled, 2.0 * f64::EPSILON, off / radius) {
                    Found::At(t) => {
                        let mut found = [0.0; 3];
                        found[*along] = curve.parameter(&root);
                        [found[over[0]], found[over[1]]] = t;
                        Found::At(found)
                    }
                    other => other.without(),
                }
            }
        }
    }
}

impl<T> Found<T> {
    /// The same without a place.
    fn without<S>(self) -> Found<S> {
        match self {
            Self::Nowhere => Found::Nowhere,
            Self::At(_) | Self::Unclear => Found::Unclear,
        }
    }
}

impl<'a> LocalNet<'a> {
    fn new(volume: &'a NurbsVolume, axis: &Axis, tolerance: f64) -> Self {
        let points = volume.control_points().iter();
        Self {
            volume,
            points: (points.map(|p| axis.to_local * (DVec3::from_array(*p) - axis.origin)))
                .collect(),
            tolerance,
        }
    }

    /// The volume as a surface turned along direction `k`.
    fn circle(&self, k: usize) -> Option<(Shape, Outline)> {
        let counts = self.volume.counts();
        let strides = [1, counts[0], counts[0] * counts[1]];
        let [a, b] = [[1, 2], [0, 2], [0, 1]][k];
        let place = |s: usize, j: usize| {
            s % counts[a] * strides[a] + s / counts[a] * strides[b] + j * strides[k]
        };
        let table = Table {
            rows: counts[a] * counts[b],
            columns: counts[k],
            place: &place,
        };
        let across = |n: usize| [self.points[n].x, self.points[n].y];
        if !table.constant_along_rows(&|n| self.points[n].z, self.tolerance) {
            return None;
        }
        let product = table.product(&across, self.tolerance, true)?;
        let (own, around) = table.weights(&|n| self.volume.weights()[n])?;
        let knots = self.volume.knots();
        let arc = Arc::new(&knots[k], product.shape, around)?;
        let heights: Vec<f64> = (0..table.rows)
            .map(|s| self.points[place(s, 0)].z)
            .collect();
        let radii = product.scales;
        let ruled = [(a, b, false), (b, a, true)]
            .into_iter()
            .find_map(|(u, s, swapped)| {
                let place = |i: usize, k: usize| {
                    if swapped {
                        k + i * counts[a]
                    } else {
                        i + k * counts[a]
                    }
                };
                let table = Table {
                    rows: counts[u],
                    columns: counts[s],
                    place: &place,
                };
                let (curve, share) =
                    self.along(&table, &|n| [radii[n], 0.0], &heights, &own, &knots[u])?;
                let (shape, weights) = share;
                // A share that is 0 at the axis is never below it.
                let values: Vec<[f64; 2]> = shape.iter().map(|d| [d[0], 0.0]).collect();
                let share = Monotone::new(&knots[s], &values, &weights)?;
                Some(Meridian::Ruled([u, s], curve, share))
            });
        let meridian = ruled.or_else(|| {
            let points = radii.iter().zip(&heights).map(|(&r, &z)| [r, z, 0.0]);
            let knots = [knots[a].clone(), knots[b].clone()];
            let surface = NurbsSurface::new(knots, points.collect(), own.clone()).ok()?;
            Some(Meridian::Surface([a, b], Box::new(Section::new(&surface)?)))
        })?;
        let rim = [&knots[a], &knots[b]];
        let edges = edges(rim, |n| [radii[n], heights[n]], &own);
        let outline = edges.map(|edges| (edges, arc.degrees()));
        Some((Shape::Circle(k, arc, meridian), outline))
    }

    /// The volume as a disc that is scaled and shifted along direction `k`.
    fn disc(&self, k: usize) -> Option<(Shape, Outline)> {
        let counts = self.volume.counts();
        let strides = [1, counts[0], counts[0] * counts[1]];
        let [a, b] = [[1, 2], [0, 2], [0, 1]][k];
        let place = |i: usize, s: usize| {
            s % counts[a] * strides[a] + s / counts[a] * strides[b] + i * strides[k]
        };
        let table = Table {
            rows: counts[k],
            columns: counts[a] * counts[b],
            place: &place,
        };
        let across = |n: usize| [self.points[n].x, self.points[n].y];
        let heights: Vec<f64> = self.points.iter().map(|p| p.z).collect();
        let knots = self.volume.knots();
        let (curve, (shape, weights)) =
            self.along(&table, &across, &heights, self.volume.weights(), &knots[k])?;
        let points = shape.iter().map(|d| [d[0], d[1], 0.0]);
        let over = [knots[a].clone(), knots[b].clone()];
        let surface = NurbsSurface::new(over, points.collect(), weights.clone()).ok()?;
        let section = Box::new(Section::new(&surface)?);
        // The curve of the rim, where the disc is round.
        let radius = shape[0][0].hypot(shape[0][1]);
        let outline = is_round([&knots[a], &knots[b]], &shape, &weights, radius).then(|| {
            let row = |i: usize| place(i, 0);
            let scale = |i: usize| {
                let n = row(i);
                across(n)[0].hypot(across(n)[1])
            };
            let points: Vec<[f64; 2]> = (0..counts[k])
                .map(|i| [scale(i), heights[row(i)]])
                .collect();
            let own = (0..counts[k])
                .map(|i| self.volume.weights()[row(i)])
                .collect();
            to_axis(&knots[k], points, own).map(|curves| (curves, [0.0, 360.0]))
        });
        Some((Shape::Disc(k, curve, [a, b], section), outline.flatten()))
    }

    /// Rows at one height each, scaled copies of one shape: height and scale along the rows, and the shape.
    #[allow(
        clippy::type_complexity,
        reason = "a curve, and the points and weights of a shape"
    )]
    fn along(
        &self,
        table: &Table,
        across: &dyn Fn(usize) -> [f64; 2],
        heights: &[f64],
        weights: &[f64],
        knots: &KnotVector,
    ) -> Option<(Monotone, (Vec<[f64; 2]>, Vec<f64>))> {
        if !table.constant_along_rows(&|n| heights[n], self.tolerance) {
            return None;
        }
        let product = table.product(across, self.tolerance, false)?;
        let (own, other) = table.weights(&|n| weights[n])?;
        let curve: Vec<[f64; 2]> = (0..table.rows)
            .map(|i| [heights[(table.place)(i, 0)], product.scales[i]])
            .collect();
        Some((Monotone::new(knots, &curve, &own)?, (product.shape, other)))
    }
}

/// A closed loop (r, z), and the turn in degrees.
type Outline = Option<(Vec<NurbsCurve<2>>, [f64; 2])>;

/// The four edges of a planar net, head to tail; those that are a point are left out.
fn edges(
    knots: [&KnotVector; 2],
    point: impl Fn(usize) -> [f64; 2],
    weights: &[f64],
) -> Option<Vec<NurbsCurve<2>>> {
    if !knots.iter().all(|k| k.is_clamped()) {
        return None;
    }
    let [n, m] = knots.map(KnotVector::control_points);
    let edge = |k: usize, places: Vec<usize>, back: bool| {
        let points: Vec<[f64; 2]> = places.iter().map(|&i| point(i)).collect();
        let own = places.iter().map(|&i| weights[i]).collect();
        let curve = NurbsCurve::new(knots[k].clone(), points, own).ok()?;
        if back {
            curve.reverse().ok()
        } else {
            Some(curve)
        }
    };
    let all = [
        edge(0, (0..n).collect(), false)?,
        edge(1, (0..m).map(|j| n - 1 + j * n).collect(), false)?,
        edge(0, (0..n).map(|i| i + (m - 1) * n).collect(), true)?,
        edge(1, (0..m).map(|j| j * n).collect(), true)?,
    ];
    let spread = |c: &NurbsCurve<2>| {
        let points = c.control_points();
        points.iter().any(|p| *p != points[0])
    };
    Some(all.into_iter().filter(spread).collect())
}

/// Whether the edges of a planar net make one round of a circle about the origin.
fn is_round(knots: [&KnotVector; 2], points: &[[f64; 2]], weights: &[f64], radius: f64) -> bool {
    let Some(edges) = edges(knots, |n| points[n].map(|x| x / radius), weights) else {
        return false;
    };
    let mut turned = 0.0;
    for edge in &edges {
        let points = edge.control_points().to_vec();
        let Some(arc) = Arc::new(edge.knots(), points, edge.weights().to_vec()) else {
            return false;
        };
        let [sense, angle] = arc.sweep();
        turned += sense * angle;
    }
    (turned.abs() - std::f64::consts::TAU).abs() <= 1e-9
}

/// A curve joined to the axis at both ends.
fn to_axis(
    knots: &KnotVector,
    points: Vec<[f64; 2]>,
    weights: Vec<f64>,
) -> Option<Vec<NurbsCurve<2>>> {
    if !knots.is_clamped() {
        return None;
    }
    let ([r0, z0], [r1, z1]) = (*points.first()?, *points.last()?);
    let mut curves = vec![NurbsCurve::new(knots.clone(), points, weights).ok()?];
    let mut corners = vec![[r1, z1], [0.0, z1], [0.0, z0], [r0, z0]];
    corners.dedup();
    for pair in corners.windows(2) {
        let line = KnotVector::bezier(1).ok()?;
        curves.push(NurbsCurve::polynomial(line, pair.to_vec()).ok()?);
    }
    Some(curves)
}

/// Axes that a volume may be turned about.
fn candidates(volume: &NurbsVolume) -> Vec<Axis> {
    let coordinate = |z: usize| {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        Axis {
            origin: DVec3::ZERO,
            to_local: DMat3::from_cols(axes[(z + 1) % 3], axes[(z + 2) % 3], axes[z]).transpose(),
            exact: true,
        }
    };
    let mut found = vec![coordinate(2), coordinate(0), coordinate(1)];
    for k in 0..3 {
        found.extend(of_ring(volume, k));
    }
    for k in 0..3 {
        found.extend(of_layer(volume, k));
    }
    found
}

/// The axis through `origin` along `normal`, the first direction across it near `x`.
fn about(origin: DVec3, normal: DVec3, x: DVec3) -> Option<Axis> {
    let z = normal.try_normalize()?;
    let x = (x - z * z.dot(x)).try_normalize()?;
    Some(Axis {
        origin,
        to_local: DMat3::from_cols(x, z.cross(x), z).transpose(),
        exact: false,
    })
}

/// The axis of the circle through three points of the widest ring along direction `k`.
fn of_ring(volume: &NurbsVolume, k: usize) -> Option<Axis> {
    let domain = volume.domain();
    let at = |k: usize, t: f64| domain[k].0 + t * (domain[k].1 - domain[k].0);
    let [a, b] = [[1, 2], [0, 2], [0, 1]][k];
    // Rings at corners may be poles or on the axis.
    let places = (0..9).map(|n| [f64::from(n % 3) * 0.5, f64::from(n / 3) * 0.5]);
    let rings = places.filter_map(|[s, t]| {
        let mut points = [DVec3::ZERO; 3];
        for (n, p) in points.iter_mut().enumerate() {
            let mut place = [0.0; 3];
            [place[a], place[b]] = [at(a, s), at(b, t)];
            place[k] = at(k, [0.0, 1.0 / 3.0, 2.0 / 3.0][n]);
            *p = DVec3::from_array(volume.evaluate(place).ok()?);
        }
        let [p, q, r] = points;
        Some(([p, q - p, r - p], (q - p).cross(r - p)))
    });
    let widest = rings.max_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()))?;
    let ([p, e, f], n) = widest;
    // The circumcentre of a triangle.
    let across = f.length_squared() * n.cross(e) + e.length_squared() * f.cross(n);
    let from = across / (2.0 * n.length_squared());
    about(p + from, n, -from)
}

/// The line through the middle of the widest end layer of direction `k`, normal to it.
fn of_layer(volume: &NurbsVolume, k: usize) -> Option<Axis> {
    let counts = volume.counts();
    let strides = [1, counts[0], counts[0] * counts[1]];
    let [a, b] = [[1, 2], [0, 2], [0, 1]][k];
    let layers = (0..counts[k]).filter_map(|i| {
        let points: Vec<DVec3> = (0..counts[a] * counts[b])
            .map(|s| s % counts[a] * strides[a] + s / counts[a] * strides[b] + i * strides[k])
            .map(|n| DVec3::from_array(volume.control_points()[n]))
            .collect();
        #[allow(clippy::cast_precision_loss, reason = "a count")]
        let count = points.len() as f64;
        let first = *points.first()?;
        let middle = first + points.iter().map(|p| *p - first).sum::<DVec3>() / count;
        let far = |p: &&DVec3| (**p - middle).length_squared();
        let x = *points.iter().max_by(|p, q| far(p).total_cmp(&far(q)))? - middle;
        let normals = points.iter().map(|p| x.cross(*p - middle));
        let normal = normals.max_by(|p, q| p.length_squared().total_cmp(&q.length_squared()))?;
        Some((middle, normal, x))
    });
    let widest = layers.max_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()))?;
    about(widest.0, widest.1, widest.2)
}
