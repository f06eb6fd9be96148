//! Nets of solids of revolution, and the same solids in closed form.

#![allow(dead_code, reason = "every test file takes what it needs")]

use glam::DVec3;
use std::f64::consts::{FRAC_1_SQRT_2 as S, TAU};
use voxlathe::math::{Dd, Real, Side};
use voxlathe::nurbs::{KnotVector, NurbsVolume};
use voxlathe::patch::Cells;

/// A small generator: the tests are the same every time.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub(crate) fn within(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array(std::array::from_fn(|_| self.within(-1.0, 1.0)));
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }
}

/// A rational spline: knots, points and weights.
#[derive(Clone)]
pub(crate) struct Spline<const D: usize> {
    pub(crate) knots: KnotVector,
    pub(crate) points: Vec<([f64; D], f64)>,
}

fn knots(degree: usize, breaks: usize) -> KnotVector {
    let mut u = vec![0.0; degree + 1];
    for i in 1..breaks {
        u.extend(std::iter::repeat_n(i as f64 / breaks as f64, degree));
    }
    u.extend(vec![1.0; degree + 1]);
    KnotVector::new(degree, u).expect("valid")
}

pub(crate) fn line(a: [f64; 2], b: [f64; 2]) -> Spline<2> {
    Spline {
        knots: knots(1, 1),
        points: vec![(a, 1.0), (b, 1.0)],
    }
}

/// The full circle with nine points.
pub(crate) fn circle() -> Spline<2> {
    let square = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
        [1.0, 0.0],
    ];
    let weight = |i: usize| if i.is_multiple_of(2) { 1.0 } else { S };
    Spline {
        knots: knots(2, 4),
        points: (0..9).map(|i| (square[i], weight(i))).collect(),
    }
}

/// An arc of the unit circle from the angle 0.
pub(crate) fn arc(angle: f64) -> Spline<2> {
    let n = (angle / (TAU / 4.0)).ceil() as usize;
    let d = angle / n as f64;
    let mut points = Vec::new();
    for i in 0..=2 * n {
        let (phi, c) = (i as f64 * d / 2.0, (d / 2.0).cos());
        let (r, w) = if i.is_multiple_of(2) {
            (1.0, 1.0)
        } else {
            (1.0 / c, c)
        };
        points.push(([r * phi.cos(), r * phi.sin()], w));
    }
    Spline {
        knots: knots(2, n),
        points,
    }
}

/// A half circle in the meridian half-plane, from the south pole to the north pole.
pub(crate) fn meridian(radius: f64) -> Spline<2> {
    let p = [[0.0, -1.0], [1.0, -1.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let weight = |i: usize| if i.is_multiple_of(2) { 1.0 } else { S };
    Spline {
        knots: knots(2, 2),
        points: (0..5)
            .map(|i| (p[i].map(|c| c * radius), weight(i)))
            .collect(),
    }
}

/// The biquadratic disc, its first point at (1, 0).
pub(crate) fn disc() -> Vec<([f64; 2], f64)> {
    let rows = [
        [[-S, -S], [0.0, -2.0 * S], [S, -S]],
        [[-2.0 * S, 0.0], [0.0, 0.0], [2.0 * S, 0.0]],
        [[-S, S], [0.0, 2.0 * S], [S, S]],
    ];
    let mut out = Vec::new();
    for j in 0..3 {
        for i in 0..3 {
            let w = [1.0, S][i % 2] * [1.0, S][j % 2];
            out.push((times(rows[j][i], [-S, S]), w));
        }
    }
    out
}

fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// Construction a: every profile point (r, z) times the biquadratic disc.
pub(crate) fn by_disc(profile: &Spline<2>) -> NurbsVolume {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (d, q) in disc() {
        for &([r, z], w) in &profile.points {
            points.push([r * d[0], r * d[1], z]);
            weights.push(w * q);
        }
    }
    let flat = || KnotVector::bezier(2).expect("valid");
    NurbsVolume::new([profile.knots.clone(), flat(), flat()], points, weights).expect("valid")
}

/// Construction b: a meridian net, first index fastest, times a circle or an arc.
pub(crate) fn by_circle(
    u: KnotVector,
    v: KnotVector,
    net: &[([f64; 2], f64)],
    circle: &Spline<2>,
) -> NurbsVolume {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for &(c, q) in &circle.points {
        for &([r, z], w) in net {
            points.push([r * c[0], r * c[1], z]);
            weights.push(w * q);
        }
    }
    NurbsVolume::new([u, v, circle.knots.clone()], points, weights).expect("valid")
}

/// Construction c: the ruled surface to the axis, turned.
pub(crate) fn by_axis(profile: &Spline<2>, circle: &Spline<2>) -> NurbsVolume {
    let mut net: Vec<_> = (profile.points.iter())
        .map(|&([_, z], w)| ([0.0, z], w))
        .collect();
    net.extend(&profile.points);
    let ruled = KnotVector::bezier(1).expect("valid");
    by_circle(profile.knots.clone(), ruled, &net, circle)
}

/// The ring torus.
pub(crate) fn torus(major: f64, minor: f64, circle: &Spline<2>) -> NurbsVolume {
    let net: Vec<_> = (disc().into_iter())
        .map(|(d, w)| ([major + minor * d[0], minor * d[1]], w))
        .collect();
    let flat = || KnotVector::bezier(2).expect("valid");
    by_circle(flat(), flat(), &net, circle)
}

/// The volume with its points mapped.
pub(crate) fn mapped(v: &NurbsVolume, map: impl Fn([f64; 3]) -> [f64; 3]) -> NurbsVolume {
    let points = v.control_points().iter().map(|&p| map(p)).collect();
    NurbsVolume::new(v.knots().clone(), points, v.weights().to_vec()).expect("valid")
}

pub(crate) fn side(cells: &Cells, p: DVec3) -> Side {
    cells.side(p, DVec3::ZERO, || p.to_array().map(Dd::of))
}

/// A place and a direction.
type Across = dyn Fn(&mut Random) -> (DVec3, DVec3);

/// A solid in closed form.
pub(crate) struct Solid {
    pub(crate) name: String,
    pub(crate) volumes: Vec<NurbsVolume>,
    /// Signed distance, negative inside; a bound of the same sign will do away from the surface.
    pub(crate) sdf: Box<dyn Fn(DVec3) -> f64>,
    /// A point of the surface and a direction across it.
    pub(crate) surface: Box<Across>,
    pub(crate) size: f64,
}

fn polar(rho: f64, phi: f64, z: f64) -> DVec3 {
    DVec3::new(rho * phi.cos(), rho * phi.sin(), z)
}

fn radius(p: DVec3) -> f64 {
    p.x.hypot(p.y)
}

/// Radius 1, heights 0 to 2.
fn cylinder_sdf(p: DVec3) -> f64 {
    let (a, b) = (radius(p) - 1.0, (-p.z).max(p.z - 2.0));
    if a > 0.0 && b > 0.0 {
        a.hypot(b)
    } else {
        a.max(b)
    }
}

fn cylinder_surface(r: &mut Random) -> (DVec3, DVec3) {
    let phi = r.within(0.0, TAU);
    match r.unit() {
        u if u < 0.4 => (polar(1.0, phi, r.within(0.0, 2.0)), polar(1.0, phi, 0.0)),
        u if u < 0.7 => (polar(r.unit(), phi, 0.0), -DVec3::Z),
        _ => (polar(r.unit(), phi, 2.0), DVec3::Z),
    }
}

/// Radius 1 at height 0, apex at height 1.
fn cone_sdf(p: DVec3) -> f64 {
    ((radius(p) + p.z - 1.0) * S).max(-p.z)
}

fn cone_surface(r: &mut Random) -> (DVec3, DVec3) {
    let (phi, h) = (r.within(0.0, TAU), r.unit());
    if r.unit() < 0.6 {
        (polar(1.0 - h, phi, h), polar(S, phi, S))
    } else {
        (polar(h, phi, 0.0), -DVec3::Z)
    }
}

fn sphere_surface(r: &mut Random) -> (DVec3, DVec3) {
    let d = r.direction();
    (d, d)
}

fn torus_sdf(p: DVec3) -> f64 {
    (radius(p) - 2.0).hypot(p.z) - 0.75
}

fn torus_surface(r: &mut Random) -> (DVec3, DVec3) {
    let (phi, t) = (r.within(0.0, TAU), r.within(0.0, TAU));
    let n = polar(t.cos(), phi, t.sin());
    (polar(2.0, phi, 0.0) + 0.75 * n, n)
}

/// Cuts a turned solid down to the angles 0 to `angle`: distance to the wedge's planes.
fn wedge(p: DVec3, angle: f64) -> f64 {
    let (s, c) = angle.sin_cos();
    let (first, last) = (-p.y, p.y * c - p.x * s);
    if angle <= TAU / 2.0 {
        first.max(last)
    } else {
        first.min(last)
    }
}

pub(crate) fn solids() -> Vec<Solid> {
    let mut out = Vec::new();
    let mut add = |name: &str,
                   volumes: Vec<NurbsVolume>,
                   sdf: fn(DVec3) -> f64,
                   surface: fn(&mut Random) -> (DVec3, DVec3),
                   size: f64| {
        out.push(Solid {
            name: name.into(),
            volumes,
            sdf: Box::new(sdf),
            surface: Box::new(surface),
            size,
        });
    };
    let (tube, cone) = (line([1.0, 0.0], [1.0, 2.0]), line([1.0, 0.0], [0.0, 1.0]));
    let (ball, full) = (meridian(1.0), circle());
    let ball_sdf = |p: DVec3| p.length() - 1.0;
    add(
        "cylinder a",
        vec![by_disc(&tube)],
        cylinder_sdf,
        cylinder_surface,
        2.0,
    );
    add(
        "cylinder c",
        vec![by_axis(&tube, &full)],
        cylinder_sdf,
        cylinder_surface,
        2.0,
    );
    add("cone a", vec![by_disc(&cone)], cone_sdf, cone_surface, 2.0);
    add(
        "cone c",
        vec![by_axis(&cone, &full)],
        cone_sdf,
        cone_surface,
        2.0,
    );
    add(
        "sphere a",
        vec![by_disc(&ball)],
        ball_sdf,
        sphere_surface,
        2.0,
    );
    add(
        "sphere c",
        vec![by_axis(&ball, &full)],
        ball_sdf,
        sphere_surface,
        2.0,
    );
    add(
        "torus b",
        vec![torus(2.0, 0.75, &full)],
        torus_sdf,
        torus_surface,
        5.5,
    );
    for angle in [1.0, 2.5, 4.5] {
        let tube = by_axis(&tube, &arc(angle));
        let ring = torus(2.0, 0.75, &arc(angle));
        type Sdf = fn(DVec3) -> f64;
        type Surface = fn(&mut Random) -> (DVec3, DVec3);
        let both: [(_, _, Sdf, Surface, f64); 2] = [
            ("cylinder", tube, cylinder_sdf, cylinder_surface, 2.0),
            ("torus", ring, torus_sdf, torus_surface, 5.5),
        ];
        for (name, volume, sdf, surface, size) in both {
            let reach = size;
            out.push(Solid {
                name: format!("{name} turned by {angle}"),
                volumes: vec![volume],
                sdf: Box::new(move |p| sdf(p).max(wedge(p, angle))),
                surface: Box::new(move |r| {
                    if r.unit() < 0.5 {
                        let (mut p, n) = surface(r);
                        let phi = r.within(0.0, angle);
                        let turn = |v: DVec3, by: f64| {
                            let (s, c) = by.sin_cos();
                            DVec3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z)
                        };
                        let by = phi - p.y.atan2(p.x);
                        p = turn(p, by);
                        (p, turn(n, by))
                    } else {
                        // A point of the planes at the ends, in the solid or not.
                        let end = if r.unit() < 0.5 { 0.0 } else { angle };
                        let p = polar(r.within(0.0, reach / 2.0), end, r.within(-1.0, 2.0));
                        (p, polar(1.0, end + TAU / 4.0, 0.0))
                    }
                }),
                size,
            });
        }
    }
    out
}
