//! The shapes of a composite as implicit faces: planes, cylinders, cones, spheres and tori.
//!
//! A nearest point of the boundary is the foot of the perpendicular on a face, or a nearest point
//! of a curve where two faces meet, or a corner where three do. All of these are found, whatever
//! solids the faces belong to, and those count about which the composite's state differs.

use glam::{DMat3, DVec3};

use super::composite::{Composite, Item, Profile, Step};
use super::sampling::Random;

/// The zero set of a signed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// Normal and offset.
    Plane(DVec3, f64),
    /// Radius about the third axis.
    Cylinder(f64),
    /// Radius about the origin.
    Sphere(f64),
    /// Normal (r, z) and offset of the line that is turned, and height of the tip.
    Cone(f64, f64, f64, f64),
    /// Radius of the ring and of its section.
    Torus(f64, f64),
}

/// A face of a solid: all of its surface, and the part that is looked at for samples.
#[derive(Debug, Clone)]
struct Face {
    form: Form,
    origin: DVec3,
    /// Columns are the local axes.
    axes: DMat3,
    /// Corners of the parameters: angles or lengths.
    low: [f64; 2],
    high: [f64; 2],
}

impl Face {
    fn local(&self, p: DVec3) -> DVec3 {
        self.axes.transpose() * (p - self.origin)
    }

    fn world(&self, p: DVec3) -> DVec3 {
        self.origin + self.axes * p
    }

    fn value(&self, p: DVec3) -> f64 {
        let p = self.local(p);
        let rho = p.x.hypot(p.y);
        match self.form {
            Form::Plane(n, d) => n.dot(p) - d,
            Form::Cylinder(r) => rho - r,
            Form::Sphere(r) => p.length() - r,
            Form::Cone(nr, nz, d, _) => nr * rho + nz * p.z - d,
            Form::Torus(a, b) => (rho - a).hypot(p.z) - b,
        }
    }

    /// Gradient of the value: a unit vector.
    fn normal(&self, p: DVec3) -> DVec3 {
        let p = self.local(p);
        let rho = p.x.hypot(p.y);
        let out = if rho > 0.0 {
            DVec3::new(p.x / rho, p.y / rho, 0.0)
        } else {
            DVec3::X
        };
        self.axes
            * match self.form {
                Form::Plane(n, _) => n,
                Form::Cylinder(_) => out,
                Form::Sphere(_) => p.try_normalize().unwrap_or(DVec3::X),
                Form::Cone(nr, nz, ..) => out * nr + DVec3::Z * nz,
                Form::Torus(a, _) => (out * (rho - a) + DVec3::Z * p.z)
                    .try_normalize()
                    .unwrap_or(DVec3::Z),
            }
    }

    /// The nearest point of the whole face. On its axis or centre any of them: `turn` chooses.
    fn foot(&self, p: DVec3, turn: f64) -> Option<DVec3> {
        let value = self.value(p);
        let q = self.local(p);
        let rho = q.x.hypot(q.y);
        let (s, c) = turn.sin_cos();
        let out = if rho > 0.0 {
            DVec3::new(q.x / rho, q.y / rho, 0.0)
        } else {
            DVec3::new(c, s, 0.0)
        };
        Some(match self.form {
            Form::Plane(..) => p - self.normal(p) * value,
            Form::Cylinder(r) => self.world(out * r + DVec3::Z * q.z),
            Form::Sphere(r) => {
                let n = q
                    .try_normalize()
                    .unwrap_or(DVec3::new(c * (0.1 + turn).cos(), s, 0.3).normalize());
                self.world(n * r)
            }
            Form::Cone(nr, nz, ..) => {
                let (r, z) = (rho - value * nr, q.z - value * nz);
                if r < 0.0 {
                    return None;
                }
                self.world(out * r + DVec3::Z * z)
            }
            Form::Torus(a, b) => {
                let d = (out * (rho - a) + DVec3::Z * q.z)
                    .try_normalize()
                    .unwrap_or(DVec3::Z * s + out * c);
                self.world(out * a + d * b)
            }
        })
    }

    /// A point of the face by its parameters.
    fn point(&self, u: f64, v: f64) -> DVec3 {
        self.world(match self.form {
            Form::Plane(n, d) => {
                let e = n.any_orthonormal_vector();
                n * d + e * u + n.cross(e) * v
            }
            Form::Cylinder(r) => DVec3::new(r * u.cos(), r * u.sin(), v),
            Form::Sphere(r) => DVec3::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin()) * r,
            Form::Cone(nr, nz, d, _) => {
                let r = ((d - nz * v) / nr).abs();
                DVec3::new(r * u.cos(), r * u.sin(), v)
            }
            Form::Torus(a, b) => {
                let r = a + b * v.cos();
                DVec3::new(r * u.cos(), r * u.sin(), b * v.sin())
            }
        })
    }
}

/// A solid: where it is, and its profile's range.
#[derive(Debug, Clone)]
struct Shape {
    profile: Profile,
    origin: DVec3,
    axes: DMat3,
    scale: f64,
    start: f64,
    angle: f64,
}

impl Shape {
    fn new(item: &Item, moved: (f64, DVec3)) -> Self {
        let e3 = DVec3::from_array(item.direction).normalize();
        let x = if e3.x.abs() >= 1_f64.to_radians().cos() {
            DVec3::Y
        } else {
            DVec3::X
        };
        let e1 = (x - e3 * x.dot(e3)).normalize();
        let mut axes = DMat3::from_cols(e1, e3.cross(e1), e3);
        let mut origin = DVec3::from_array(item.origin);
        let mut scale = 1.0;
        for step in &item.steps {
            match *step {
                Step::Scale(k) => {
                    scale *= k;
                    origin *= k;
                }
                Step::Rotate(axis, degrees) => {
                    let turn = DMat3::from_axis_angle(
                        DVec3::from_array(axis).normalize(),
                        degrees.to_radians(),
                    );
                    origin = turn * origin;
                    axes = turn * axes;
                }
                Step::Translate(by) => origin += DVec3::from_array(by),
            }
        }
        Self {
            profile: item.profile.clone(),
            origin: (origin - moved.1) / moved.0,
            axes,
            scale: scale / moved.0,
            start: item.start,
            angle: item.angle,
        }
    }

    fn inside(&self, p: DVec3) -> bool {
        let p = self.axes.transpose() * (p - self.origin) / self.scale;
        if self.angle < 360.0 {
            let u = |degrees: f64| {
                let quarter = (degrees / 90.0).round();
                let rest = (degrees - 90.0 * quarter).to_radians();
                let (s, c) = rest.sin_cos();
                match quarter.rem_euclid(4.0) as u8 {
                    0 => [c, s],
                    1 => [-s, c],
                    2 => [-c, -s],
                    _ => [s, -c],
                }
            };
            let (a, b) = (u(self.start), u(self.start + self.angle));
            let first = a[0] * p.y - a[1] * p.x >= 0.0;
            let second = p.x * b[1] - p.y * b[0] >= 0.0;
            let within = if self.angle > 180.0 {
                first || second
            } else {
                first && second
            };
            if !within {
                return false;
            }
        }
        let rho = p.x.hypot(p.y);
        match self.profile {
            Profile::Cylinder(r, z0, z1) => rho <= r && p.z >= z0 && p.z <= z1,
            Profile::Ball(r, z) => rho.hypot(p.z - z) <= r,
            Profile::Frustum(r0, z0, r1, z1) => {
                let t = (p.z - z0) / (z1 - z0);
                (0.0..=1.0).contains(&t) && rho <= r0 + t * (r1 - r0)
            }
            Profile::Tube(r0, r1, z0, z1) => rho >= r0 && rho <= r1 && p.z >= z0 && p.z <= z1,
            Profile::Torus(a, b, z) => (rho - a).hypot(p.z - z) <= b,
            Profile::Text(_) => unreachable!("shapes with faces only"),
        }
    }

    fn faces(&self) -> Vec<Face> {
        let k = self.scale;
        let turn = [0.0, std::f64::consts::TAU];
        let mut faces = Vec::new();
        let mut add = |form: Form, u: [f64; 2], v: [f64; 2]| {
            faces.push(Face {
                form,
                origin: self.origin,
                axes: self.axes,
                low: [u[0], v[0]],
                high: [u[1], v[1]],
            });
        };
        // Somewhat more than the solid has, so that no meeting along a border is missed.
        let wide = |a: f64, b: f64| {
            let more = 0.06 * (b - a);
            [a - more, b + more]
        };
        let square = |r: f64| wide(-r, r);
        let (mut reach, mut heights) = (0.0, [0.0, 0.0]);
        match self.profile {
            Profile::Cylinder(r, z0, z1) => {
                let (r, z0, z1) = (r * k, z0 * k, z1 * k);
                add(Form::Cylinder(r), turn, wide(z0, z1));
                add(Form::Plane(DVec3::Z, z0), square(r), square(r));
                add(Form::Plane(DVec3::Z, z1), square(r), square(r));
                (reach, heights) = (r, [z0, z1]);
            }
            Profile::Tube(r0, r1, z0, z1) => {
                let (r0, r1, z0, z1) = (r0 * k, r1 * k, z0 * k, z1 * k);
                add(Form::Cylinder(r0), turn, wide(z0, z1));
                add(Form::Cylinder(r1), turn, wide(z0, z1));
                add(Form::Plane(DVec3::Z, z0), square(r1), square(r1));
                add(Form::Plane(DVec3::Z, z1), square(r1), square(r1));
                (reach, heights) = (r1, [z0, z1]);
            }
            Profile::Frustum(r0, z0, r1, z1) => {
                let (r0, z0, r1, z1) = (r0 * k, z0 * k, r1 * k, z1 * k);
                if r0 == r1 {
                    add(Form::Cylinder(r0), turn, wide(z0, z1));
                } else {
                    let (dr, dz) = (r1 - r0, z1 - z0);
                    let length = dr.hypot(dz);
                    let (nr, nz) = (dz / length, -dr / length);
                    let offset = nr * r0 + nz * z0;
                    let tip = offset / nz;
                    add(Form::Cone(nr, nz, offset, tip), turn, wide(z0, z1));
                }
                for (r, z) in [(r0, z0), (r1, z1)] {
                    if r > 0.0 {
                        add(Form::Plane(DVec3::Z, z), square(r), square(r));
                    }
                }
                (reach, heights) = (r0.max(r1), [z0, z1]);
            }
            Profile::Ball(r, z) => {
                assert!(z == 0.0, "balls are about the origin of their axis");
                let (pole, r) = (std::f64::consts::FRAC_PI_2, r * k);
                add(Form::Sphere(r), turn, [-pole, pole]);
                (reach, heights) = (r, [-r, r]);
            }
            Profile::Torus(a, b, z) => {
                assert!(z == 0.0, "rings are about the origin of their axis");
                add(Form::Torus(a * k, b * k), turn, turn);
                (reach, heights) = ((a + b) * k, [-b * k, b * k]);
            }
            Profile::Text(_) => {}
        }
        if self.angle < 360.0 {
            for degrees in [self.start, self.start + self.angle] {
                let (s, c) = degrees.to_radians().sin_cos();
                let n = DVec3::new(-s, c, 0.0);
                // The plane's own parameters run along any two directions: a square holds all.
                let side = reach.max(heights[0].abs()).max(heights[1].abs()) * 1.5;
                add(Form::Plane(n, 0.0), square(side), square(side));
            }
        }
        faces
    }
}

/// Points of a curve where two faces meet.
#[derive(Debug, Clone)]
struct Curve {
    faces: [usize; 2],
    /// Largest distance of neighbours.
    step: f64,
    points: Vec<DVec3>,
}

/// A composite as faces.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    composite: Composite,
    shapes: Vec<Shape>,
    faces: Vec<Face>,
    curves: Vec<Curve>,
    corners: Vec<DVec3>,
    /// Longest side of the box of all faces, nearly.
    pub(crate) size: f64,
}

/// Cells a side of a face.
const CELLS: usize = 90;

impl Model {
    /// `None` where a profile has no implicit faces.
    pub(crate) fn new(composite: &Composite) -> Option<Self> {
        if composite
            .items
            .iter()
            .any(|item| matches!(item.profile, Profile::Text(_)))
        {
            return None;
        }
        let shapes: Vec<Shape> = composite
            .items
            .iter()
            .map(|item| Shape::new(item, composite.moved))
            .collect();
        let faces: Vec<Face> = shapes.iter().flat_map(Shape::faces).collect();
        let corners = faces.iter().flat_map(|f| {
            [(0.0, 0.0), (0.5, 0.3), (0.7, 0.8), (1.0, 1.0)].map(|(u, v)| {
                f.point(
                    f.low[0] + u * (f.high[0] - f.low[0]),
                    f.low[1] + v * (f.high[1] - f.low[1]),
                )
            })
        });
        let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| {
            (a.min(p), b.max(p))
        });
        Some(Self {
            composite: composite.clone(),
            shapes,
            faces,
            curves: Vec::new(),
            corners: Vec::new(),
            size: (high - low).max_element(),
        })
    }

    /// Membership by f64: not to be asked on a face.
    pub(crate) fn inside(&self, p: DVec3) -> bool {
        self.composite.combine(|i| self.shapes[i].inside(p))
    }

    /// Faces within `tolerance` of a point.
    fn through(&self, p: DVec3, tolerance: f64) -> Vec<usize> {
        let all = 0..self.faces.len();
        all.filter(|&f| self.faces[f].value(p).abs() <= tolerance)
            .collect()
    }

    /// Whether faces that do not coincide touch there, or the curves in which three of them meet, relative to the size.
    pub(crate) fn touches(&self, p: DVec3, tolerance: f64) -> bool {
        let near = self.through(p, tolerance * self.size);
        let normals: Vec<DVec3> = near.iter().map(|&f| self.faces[f].normal(p)).collect();
        let across = |i: usize, j: usize| normals[i].cross(normals[j]);
        (0..near.len()).any(|j| {
            (0..j).any(|i| {
                if across(i, j).length() < 1e-3 {
                    return !self.coincide(near[i], near[j], p);
                }
                (0..i).any(|k| {
                    let apart = across(k, i).length().min(across(k, j).length()) >= 1e-3;
                    apart && across(i, j).dot(normals[k]).abs() < 1e-3
                })
            })
        })
    }

    /// Whether two faces that meet are one surface: they still meet some way off.
    fn coincide(&self, a: usize, b: usize, p: DVec3) -> bool {
        let (f, g) = (&self.faces[a], &self.faces[b]);
        let n = f.normal(p);
        let (u, v) = (n.any_orthonormal_vector(), n);
        let w = u.cross(v);
        (0..6).all(|k| {
            let (s, c) = (0.3 + f64::from(k)).sin_cos();
            let q = p + (u * c + w * s) * (0.05 * self.size);
            f.foot(q, 0.0)
                .is_some_and(|q| g.value(q).abs() < 1e-9 * self.size)
        })
    }

    /// Directions to the sides of the faces near a point, every combination of sides.
    pub(crate) fn directions(&self, p: DVec3, tolerance: f64) -> Vec<DVec3> {
        let near = self.through(p, tolerance * self.size);
        let normals: Vec<DVec3> = near.iter().map(|&f| self.faces[f].normal(p)).collect();
        self.sides(&normals)
    }

    #[allow(clippy::unused_self, reason = "a part of the model's reasoning")]
    fn sides(&self, normals: &[DVec3]) -> Vec<DVec3> {
        let k = normals.len().min(6);
        let mut all = Vec::new();
        for pattern in 0..1_u32 << k {
            let sign = |i: usize| if pattern >> i & 1 == 1 { 1.0 } else { -1.0 };
            // Sum of normals, bent until each is on its side by as much.
            let mut d = DVec3::ZERO;
            for _ in 0..24 {
                for (i, n) in normals.iter().take(k).enumerate() {
                    let off = sign(i) * 0.5 - n.dot(d);
                    d += *n * (0.7 * off);
                }
            }
            all.extend(d.try_normalize());
        }
        if k > 3 {
            // More planes than three have sectors that no such sum is in. Each is spanned by lines in which planes meet.
            let mut rays = Vec::new();
            for (i, a) in normals.iter().take(k).enumerate() {
                for b in &normals[i + 1..k] {
                    rays.extend(a.cross(*b).try_normalize());
                }
            }
            rays.dedup_by(|a, b| a.cross(*b).length() < 1e-9);
            for (i, &a) in rays.iter().enumerate() {
                for (j, &b) in rays.iter().enumerate().skip(i + 1) {
                    for &c in &rays[j + 1..] {
                        let sums = [a + b + c, a + b - c, a - b + c, a - b - c];
                        all.extend(sums.into_iter().filter_map(DVec3::try_normalize));
                    }
                }
            }
        }
        // Between two that are nearly parallel that does not come into the narrow sector.
        for (i, a) in normals.iter().enumerate() {
            for b in &normals[i + 1..] {
                all.extend((*a - *b).try_normalize());
                all.extend((*a + *b).try_normalize());
            }
        }
        all
    }

    /// Whether the composite's state differs about a point, or beside it where faces touch.
    fn active(&self, p: DVec3) -> bool {
        if self.differs(p) {
            return true;
        }
        let near = self.through(p, 2e-12 * self.size);
        near.len() > 1
            && self.touches(p, 2e-12)
            && near.iter().any(|&f| {
                let face = &self.faces[f];
                let n = face.normal(p);
                let u = n.any_orthonormal_vector();
                let v = n.cross(u);
                (0..12).any(|k| {
                    let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_6 + 0.1).sin_cos();
                    let q = p + (u * c + v * s) * (1e-4 * self.size);
                    face.foot(q, 0.0).is_some_and(|q| self.differs(q))
                })
            })
    }

    fn differs(&self, p: DVec3) -> bool {
        let tolerance = 2e-12 * self.size;
        let near = self.through(p, tolerance);
        let normals: Vec<DVec3> = near.iter().map(|&f| self.faces[f].normal(p)).collect();
        let mut met = [false; 2];
        let mut look = |d: DVec3| {
            let q = p + d * (3.0 * tolerance);
            met[usize::from(self.inside(q))] = true;
            met[0] && met[1]
        };
        for &f in &near {
            // At the tip of a cone its normal says little.
            let axis = self.faces[f].axes.z_axis;
            if matches!(self.faces[f].form, Form::Cone(..)) && (look(axis) || look(-axis)) {
                return true;
            }
        }
        if normals.len() == 1 {
            return look(normals[0]) || look(-normals[0]);
        }
        for d in self.sides(&normals) {
            if look(d) || look(-d) {
                return true;
            }
        }
        let mut random = Random::new(1);
        (0..40).any(|_| look(super::composite::sphere(&mut random)))
    }

    /// To the common points of faces, by Newton; `None` where that fails.
    fn onto(&self, faces: &[usize], mut p: DVec3) -> Option<DVec3> {
        for _ in 0..30 {
            // The smallest step to all tangent planes.
            let n: Vec<DVec3> = faces.iter().map(|&f| self.faces[f].normal(p)).collect();
            let f: Vec<f64> = faces.iter().map(|&f| -self.faces[f].value(p)).collect();
            let step = match *n.as_slice() {
                [a] => a * f[0],
                [a, b] => {
                    let c = a.dot(b);
                    let det = 1.0 - c * c;
                    if det < 1e-9 {
                        return None;
                    }
                    a * ((f[0] - c * f[1]) / det) + b * ((f[1] - c * f[0]) / det)
                }
                [a, b, c] => {
                    let det = a.dot(b.cross(c));
                    if det.abs() < 1e-6 {
                        return None;
                    }
                    (b.cross(c) * f[0] + c.cross(a) * f[1] + a.cross(b) * f[2]) / det
                }
                _ => return None,
            };
            if step.is_nan() {
                return None;
            }
            p += step.clamp_length_max(0.2 * self.size);
            if step.length() < 1e-15 * self.size {
                break;
            }
        }
        let done = faces
            .iter()
            .all(|&f| self.faces[f].value(p).abs() < 1e-13 * self.size);
        done.then_some(p)
    }

    /// Finds the curves and corners of the boundary.
    pub(crate) fn prepare(&mut self) {
        let n = self.faces.len();
        let mut corners: Vec<DVec3> = Vec::new();
        for face in &self.faces {
            if let Form::Cone(.., tip) = face.form {
                corners.push(face.world(DVec3::Z * tip));
            }
        }
        let mut curves = Vec::new();
        for a in 0..n {
            let face = &self.faces[a];
            // Off any symmetry of the shapes.
            let at = |i: usize, k: usize| {
                // The same share on, so that a whole turn stays one.
                let share = |i: usize, a: usize| {
                    let t = (i as f64 + 0.317) / CELLS as f64;
                    face.low[a] + t * (face.high[a] - face.low[a])
                };
                [share(i, 0), share(k, 1)]
            };
            let width = CELLS + 1;
            let nodes: Vec<DVec3> = (0..width * width)
                .map(|c| {
                    let [u, v] = at(c % width, c / width);
                    face.point(u, v)
                })
                .collect();
            let mut step: f64 = 0.0;
            for (c, p) in nodes.iter().enumerate() {
                if c % width > 0 && c / width > 0 {
                    step = step.max(p.distance(nodes[c - width - 1]));
                }
            }
            for b in a + 1..n {
                let values: Vec<f64> = nodes.iter().map(|&p| self.faces[b].value(p)).collect();
                let mut points = Vec::new();
                for c in 0..nodes.len() {
                    let right = (c % width < CELLS).then_some(c + 1);
                    let up = (c / width < CELLS).then_some(c + width);
                    for d in [right, up].into_iter().flatten() {
                        if (values[c] < 0.0) == (values[d] < 0.0) {
                            continue;
                        }
                        let t = values[c] / (values[c] - values[d]);
                        points.extend(self.onto(&[a, b], nodes[c].lerp(nodes[d], t)));
                    }
                }
                for c in b + 1..n {
                    let third = &self.faces[c];
                    for &p in &points {
                        if third.value(p).abs() >= 1.5 * step {
                            continue;
                        }
                        if let Some(q) = self.onto(&[a, b, c], p) {
                            let new = |r: &DVec3| r.distance(q) > 1e-9 * self.size;
                            if corners.iter().all(new) {
                                corners.push(q);
                            }
                        }
                    }
                }
                points.retain(|&p| self.active(p));
                if !points.is_empty() {
                    curves.push(Curve {
                        faces: [a, b],
                        step,
                        points,
                    });
                }
            }
        }
        corners.retain(|&p| self.active(p));
        self.corners = corners;
        self.curves = curves;
    }

    /// Points of the composite's edges and corners.
    pub(crate) fn edges(&self) -> Vec<DVec3> {
        let curves = self.curves.iter().flat_map(|c| c.points.iter().copied());
        curves.chain(self.corners.iter().copied()).collect()
    }

    /// The nearest point of the boundary, and the nearest that may belong to it where faces touch;
    /// `None` where there is no boundary.
    pub(crate) fn nearest(&self, q: DVec3) -> [Option<DVec3>; 2] {
        let mut best = (f64::INFINITY, None);
        let mut perhaps = (f64::INFINITY, None);
        let mut offer = |p: DVec3| {
            let d = p.distance(q);
            if d < best.0 && self.differs(p) {
                best = (d, Some(p));
            }
            if d < perhaps.0 && self.active(p) {
                perhaps = (d, Some(p));
            }
            best.0
        };
        let mut least = f64::INFINITY;
        for face in &self.faces {
            let feet = face.foot(q, 0.0);
            least = feet.map_or(least, &mut offer);
            // On an axis or at a centre every direction is as near.
            let p = face.local(q);
            let ring = match face.form {
                Form::Plane(..) => false,
                Form::Torus(a, _) => p.x.hypot(p.y) == 0.0 || (p.x.hypot(p.y) == a && p.z == 0.0),
                _ => p.x.hypot(p.y) == 0.0,
            };
            if ring {
                for k in 1..200 {
                    least = face.foot(q, f64::from(k) * 0.7).map_or(least, &mut offer);
                }
            }
        }
        for &p in &self.corners {
            least = offer(p);
        }
        // Samples of curves nearest first, each with the distance that its neighbourhood may reach.
        let mut seeds: Vec<(f64, usize, DVec3)> = Vec::new();
        for (k, curve) in self.curves.iter().enumerate() {
            for &p in &curve.points {
                let d = p.distance(q);
                if d - curve.step < least {
                    least = offer(p);
                    seeds.push((d - curve.step, k, p));
                }
            }
        }
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut used: Vec<(usize, DVec3)> = Vec::new();
        for (bound, k, p) in seeds {
            let curve = &self.curves[k];
            if bound >= least || used.len() > 40 {
                break;
            }
            let near = |u: &(usize, DVec3)| u.0 == k && u.1.distance(p) < 1.5 * curve.step;
            if used.iter().any(near) {
                continue;
            }
            used.push((k, p));
            if let Some(p) = self.along(curve, p, q) {
                least = offer(p);
            }
        }
        [best.1, perhaps.1]
    }

    /// The nearest point of a curve about one of its points.
    fn along(&self, curve: &Curve, start: DVec3, q: DVec3) -> Option<DVec3> {
        let [a, b] = curve.faces;
        let n = self.faces[a]
            .normal(start)
            .cross(self.faces[b].normal(start));
        let tangent = n.try_normalize()?;
        let at = |s: f64| self.onto(&[a, b], start + tangent * s);
        let far = |s: f64| at(s).map_or(f64::INFINITY, |p| p.distance(q));
        let golden = 0.618_033_988_749_894_9;
        let (mut low, mut high) = (-2.0 * curve.step, 2.0 * curve.step);
        let (mut c, mut d) = (high - golden * (high - low), low + golden * (high - low));
        let (mut at_c, mut at_d) = (far(c), far(d));
        for _ in 0..60 {
            if at_c < at_d {
                (high, d, at_d) = (d, c, at_c);
                c = high - golden * (high - low);
                at_c = far(c);
            } else {
                (low, c, at_c) = (c, d, at_d);
                d = low + golden * (high - low);
                at_d = far(d);
            }
        }
        at((low + high) / 2.0)
    }

    /// Whether the composite and what is not of it are both met closely about a point: slivers take many looks.
    fn is_mixed(&self, p: DVec3) -> bool {
        let mut random = Random::new(5);
        let first = self.inside(p);
        (0..20_000).any(|_| {
            let far = 2e-11 * self.size * random.between(0.0, 1.0);
            self.inside(p + super::composite::sphere(&mut random) * far) != first
        })
    }

    /// The nearest to `q` of the points of the boundary beside a place: that of faces that pass there, of pairs and
    /// triples of them.
    pub(crate) fn witness(&self, place: DVec3, q: DVec3) -> Option<DVec3> {
        let near = self.through(place, 1e-6 * self.size);
        let mut best: Option<DVec3> = None;
        let mut take = |faces: &[usize]| {
            let Some(p) = self.onto(faces, place) else {
                return;
            };
            let better = best.is_none_or(|b| p.distance(q) < b.distance(q));
            if better && (self.active(p) || self.is_mixed(p)) {
                best = Some(p);
            }
        };
        for (i, &a) in near.iter().enumerate() {
            take(&[a]);
            for (j, &b) in near.iter().enumerate().skip(i + 1) {
                take(&[a, b]);
                for &c in &near[j + 1..] {
                    take(&[a, b, c]);
                }
            }
        }
        best
    }

    /// A longer search for a point of the boundary within `reach` of `q`: random points brought onto
    /// faces, pairs and triples.
    pub(crate) fn search(&self, q: DVec3, reach: f64, random: &mut Random) -> Option<DVec3> {
        let n = self.faces.len();
        let mut best: Option<DVec3> = None;
        let near = |p: DVec3, best: Option<DVec3>| {
            p.distance(q) <= best.map_or(f64::INFINITY, |b| b.distance(q)) && self.active(p)
        };
        // Those that are as near, as a rule all that matter, and every other time any.
        let all: Vec<usize> = (0..n).collect();
        let meets = |a: &usize| {
            let foot = self.onto(&[*a], q);
            foot.is_some_and(|p| p.distance(q) <= 1.5 * reach + 1e-12)
        };
        let close: Vec<usize> = all.iter().copied().filter(meets).collect();
        for k in 0..3000 {
            let p = q + super::composite::sphere(random) * (reach * random.between(0.5, 1.2));
            let of = if k % 2 == 0 && close.len() > 1 {
                &close
            } else {
                &all
            };
            let [a, b, c] = [0; 3].map(|_: usize| of[random.below(of.len())]);
            if let Some(p) = self.onto(&[a], p).filter(|&p| near(p, best)) {
                best = Some(p);
            }
            if a == b {
                continue;
            }
            if let Some(p) = self.onto(&[a, b], p) {
                let curve = Curve {
                    faces: [a, b],
                    step: 0.05 * reach,
                    points: Vec::new(),
                };
                for p in [Some(p), self.along(&curve, p, q)] {
                    if let Some(p) = p.filter(|&p| near(p, best)) {
                        best = Some(p);
                    }
                }
            }
            if b == c || a == c {
                continue;
            }
            if let Some(p) = self.onto(&[a, b, c], p).filter(|&p| near(p, best)) {
                best = Some(p);
            }
        }
        best
    }

    /// Parameters at which the line `p + t d` meets a face; `None` for a face with no formula.
    fn cuts(&self, p: DVec3, d: DVec3, out: &mut Vec<f64>) -> Option<()> {
        for face in &self.faces {
            let q = face.local(p);
            let e = face.axes.transpose() * d;
            match face.form {
                Form::Plane(n, offset) => {
                    let along = n.dot(e);
                    if along.abs() > 1e-14 {
                        out.push((offset - n.dot(q)) / along);
                    }
                }
                Form::Cylinder(r) => quadratic(
                    out,
                    e.x * e.x + e.y * e.y,
                    e.x * q.x + e.y * q.y,
                    q.x * q.x + q.y * q.y - r * r,
                ),
                Form::Sphere(r) => quadratic(out, e.dot(e), e.dot(q), q.dot(q) - r * r),
                Form::Cone(nr, nz, _, tip) => {
                    let (k, z) = (nz * nz / (nr * nr), q.z - tip);
                    quadratic(
                        out,
                        e.x * e.x + e.y * e.y - k * e.z * e.z,
                        e.x * q.x + e.y * q.y - k * e.z * z,
                        q.x * q.x + q.y * q.y - k * z * z,
                    );
                }
                Form::Torus(..) => return None,
            }
        }
        Some(())
    }

    /// Length of the composite on the segment from `p` to `p + d`, as a share; `None` with a torus.
    pub(crate) fn share(&self, p: DVec3, d: DVec3, cuts: &mut Vec<f64>) -> Option<f64> {
        cuts.clear();
        self.cuts(p, d, cuts)?;
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.extend([0.0, 1.0]);
        cuts.sort_by(f64::total_cmp);
        let inside = cuts.windows(2).map(|pair| {
            let middle = (pair[0] + pair[1]) / 2.0;
            if pair[1] > pair[0] && self.inside(p + d * middle) {
                pair[1] - pair[0]
            } else {
                0.0
            }
        });
        Some(inside.sum())
    }
}

/// Roots of `a t^2 + 2 b t + c`.
fn quadratic(out: &mut Vec<f64>, a: f64, b: f64, c: f64) {
    let det = b * b - a * c;
    if det <= 0.0 {
        return;
    }
    let root = -(b + det.sqrt().copysign(b));
    if a != 0.0 {
        out.push(root / a);
    }
    if root != 0.0 {
        out.push(c / root);
    }
}
