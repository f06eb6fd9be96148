//! The catalogue of circles, discs and spheres against published points and against what they should be.

use voxlathe::construct::*;
use voxlathe::nurbs::{NurbsCurve, NurbsSurface};

const EPS: f64 = f64::EPSILON;
const S: f64 = std::f64::consts::FRAC_1_SQRT_2;
const ORIGIN: [f64; 2] = [0.0, 0.0];
const WORLD: AxisFrame = AxisFrame::WORLD;

fn near<const D: usize>(found: [f64; D], wanted: [f64; D], bound: f64) {
    let gap = (0..D).fold(0.0, |m: f64, i| m.max((found[i] - wanted[i]).abs()));
    assert!(
        gap <= bound,
        "{found:?} for {wanted:?}: {gap:e} above {bound:e}"
    );
}

fn net<const D: usize>(points: &[[f64; D]], wanted: &[[f64; D]], ulps: f64) {
    assert_eq!(points.len(), wanted.len());
    let size = wanted
        .iter()
        .flatten()
        .fold(0.0, |m: f64, c| m.max(c.abs()));
    for (p, w) in points.iter().zip(wanted) {
        near(*p, *w, ulps * EPS * size);
    }
}

/// The largest distance of the curve from the circle, in ulp of |centre| + radius.
fn residual(curve: &NurbsCurve<2>, center: [f64; 2], radius: f64) -> f64 {
    let mut worst = 0.0_f64;
    let (a, b) = curve.domain();
    for i in 0..=2000 {
        let [x, y] = curve
            .evaluate(a + (b - a) * f64::from(i) / 2000.0)
            .expect("inside");
        worst = worst.max(((x - center[0]).hypot(y - center[1]) - radius).abs());
    }
    worst / (EPS * (center[0].hypot(center[1]) + radius))
}

/// The angle turned along the curve about the centre, in degrees.
fn turned(curve: &NurbsCurve<2>, center: [f64; 2]) -> f64 {
    let at = |i: i32| {
        let [x, y] = curve.evaluate(f64::from(i) / 1024.0).expect("inside");
        [x - center[0], y - center[1]]
    };
    let mut total = 0.0;
    for i in 0..1024 {
        let (p, q) = (at(i), at(i + 1));
        total += (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
    }
    total.to_degrees()
}

#[test]
fn tables_of_the_circles() {
    let half = half_circle_cubic(ORIGIN, 1.0).expect("a circle");
    let table = [[0.0, 1.0], [2.0, 1.0], [2.0, -1.0], [0.0, -1.0]];
    assert_eq!(half.control_points(), table);
    assert_eq!(half.weights(), [1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0]);
    let full = full_circle_cubic(ORIGIN, 1.0).expect("a circle");
    let table = [
        [0.0, 1.0],
        [2.0, 1.0],
        [2.0, -1.0],
        [0.0, -1.0],
        [-2.0, -1.0],
        [-2.0, 1.0],
        [0.0, 1.0],
    ];
    assert_eq!(full.control_points(), table);
    let t = 1.0 / 3.0;
    assert_eq!(full.weights(), [1.0, t, t, 1.0, t, t, 1.0]);
    assert_eq!(
        full.knots().knots(),
        [0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0]
    );
    let square = full_circle(ORIGIN, 1.0).expect("a circle");
    let table = [
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
    net(square.control_points(), &table, 1.0);
    assert_eq!(square.weights(), [1.0, S, 1.0, S, 1.0, S, 1.0, S, 1.0]);
    near(
        square.evaluate(0.1).expect("inside"),
        [0.813_826_04, 0.581_108_58],
        5e-9,
    );
    let quarter = quarter_circle(QuarterWeights::Symmetric, ORIGIN, 1.0).expect("a circle");
    assert_eq!(quarter.weights(), [1.0, S, 1.0]);
}

#[test]
fn circles_close_smoothly() {
    for circle in [full_circle(ORIGIN, 1.0), full_circle_cubic(ORIGIN, 1.0)] {
        let circle = circle.expect("a circle");
        let slope = |u: f64| circle.derivatives(u, 1).expect("inside")[1];
        // From the right at 0 and at a knot; from the left at 1 and by the reversed curve.
        near(slope(0.0), slope(1.0), 1e-14);
        let back = circle
            .reverse()
            .expect("a curve")
            .derivatives(0.5, 1)
            .expect("inside")[1];
        near(slope(0.5), back.map(|c| -c), 1e-14);
    }
    // The speeds of the nine points differ by 1.17.
    let circle = full_circle(ORIGIN, 1.0).expect("a circle");
    let (mut least, mut most, mut lag) = (f64::MAX, 0.0_f64, 0.0_f64);
    for i in 0..=4000 {
        let u = f64::from(i) / 4000.0;
        let d = circle.derivatives(u, 1).expect("inside");
        let speed = d[1][0].hypot(d[1][1]);
        (least, most) = (least.min(speed), most.max(speed));
        let angle = d[0][1].atan2(d[0][0]) - u * std::f64::consts::TAU;
        lag = lag.max(
            (angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI,
        );
    }
    assert!((most / least - 1.17).abs() < 0.005, "{}", most / least);
    assert!((lag - 0.0160).abs() < 5e-5, "{lag}");
}

#[test]
fn arcs_of_any_angle() {
    let angles = [
        1e-6,
        1e-3,
        1.0,
        89.999_999,
        90.0,
        90.000_001,
        120.0,
        180.0,
        180.1,
        270.0,
        359.999_999,
        360.0,
    ];
    let mut worst = 0.0_f64;
    for angle in angles {
        for sign in [1.0, -1.0] {
            for start in [0.0, 90.0, -270.0, 17.3, 1e6] {
                for (center, radius) in [
                    (ORIGIN, 1.0),
                    ([1e6, -3.0], 1e-6),
                    ([0.5, 2.0], 1e6),
                    ([0.0, -1e-6], 1e-6),
                ] {
                    let turn = AngleInterval::new(start, sign * angle).expect("a turn");
                    let arc = arc(center, radius, turn).expect("an arc");
                    let k = (angle / 90.0).ceil() as usize;
                    assert_eq!(arc.control_points().len(), 2 * k + 1);
                    let off = residual(&arc, center, radius);
                    worst = worst.max(off);
                    assert!(
                        off <= 4.0,
                        "{start} {angle} at {center:?} {radius}: {off} ulp"
                    );
                    if center == ORIGIN {
                        assert!(
                            (turned(&arc, center) - sign * angle).abs() <= 1e-9,
                            "{angle}"
                        );
                    }
                    let end = (start + sign * angle).to_radians();
                    let wanted = [
                        center[0] + radius * end.cos(),
                        center[1] + radius * end.sin(),
                    ];
                    let size = center[0].hypot(center[1]) + radius;
                    near(
                        arc.evaluate(1.0).expect("inside"),
                        wanted,
                        4.0 * EPS * size * (1.0 + end.abs()),
                    );
                }
            }
        }
    }
    eprintln!("arcs: {worst:.2} ulp");
    // Right angles are exact.
    let arc = arc(
        ORIGIN,
        3.0,
        AngleInterval::new(90.0, -180.0).expect("a turn"),
    )
    .expect("an arc");
    assert_eq!(arc.evaluate(0.0), Ok([0.0, 3.0]));
    assert_eq!(arc.evaluate(0.5), Ok([3.0, 0.0]));
    assert_eq!(arc.evaluate(1.0), Ok([0.0, -3.0]));
    for (start, angle) in [
        (0.0, 0.0),
        (0.0, 360.1),
        (f64::NAN, 90.0),
        (f64::INFINITY, 1.0),
        (0.0, f64::NAN),
    ] {
        assert!(AngleInterval::new(start, angle).is_err());
    }
}

#[test]
fn all_circles_are_circles_at_every_scale() {
    let mut worst = 0.0_f64;
    for (center, radius) in [
        (ORIGIN, 1.0),
        (ORIGIN, 1e-6),
        (ORIGIN, 1e6),
        ([1e6, -1e6], 1.0),
        ([-3.0, 1e-3], 0.7),
    ] {
        for (curve, angle) in [
            (
                quarter_circle(QuarterWeights::Rational, center, radius),
                90.0,
            ),
            (
                quarter_circle(QuarterWeights::Symmetric, center, radius),
                90.0,
            ),
            (
                quarter_circle_quartic(QuarticFamily::A, 0.836_516, center, radius),
                90.0,
            ),
            (
                quarter_circle_quartic(QuarticFamily::A, 0.2, center, radius),
                90.0,
            ),
            (
                quarter_circle_quartic(QuarticFamily::B, 1.0, center, radius),
                90.0,
            ),
            (
                quarter_circle_quartic(QuarticFamily::B, 5.0, center, radius),
                90.0,
            ),
            (half_circle_cubic(center, radius), -180.0),
            (full_circle_cubic(center, radius), -360.0),
            (full_circle(center, radius), 360.0),
        ] {
            let curve = curve.expect("a circle");
            let off = residual(&curve, center, radius);
            worst = worst.max(off);
            assert!(
                off <= 4.0,
                "degree {} at {center:?} {radius}: {off} ulp",
                curve.degree()
            );
            let size = center[0].hypot(center[1]) / radius;
            assert!(
                (turned(&curve, center) - angle).abs() <= 1e-10 * (1.0 + size),
                "degree {}",
                curve.degree()
            );
        }
    }
    eprintln!("circles: {worst:.2} ulp");
    assert!(full_circle(ORIGIN, 0.0).is_err());
    assert!(full_circle(ORIGIN, f64::NAN).is_err());
    assert!(full_circle([f64::NAN, 0.0], 1.0).is_err());
    assert!(full_circle_cubic(ORIGIN, -1.0).is_err());
}

/// Point and derivatives of a planar surface, and its Jacobian.
fn planar(surface: &NurbsSurface, at: [f64; 2]) -> ([f64; 2], f64) {
    let (p, [u, v]) = surface.gradient(at).expect("inside");
    assert_eq!((p[2], u[2], v[2]), (0.0, 0.0, 0.0));
    ([p[0], p[1]], u[0] * v[1] - u[1] * v[0])
}

#[test]
fn the_biquadratic_disc() {
    let disc = biquadratic_disc(ORIGIN, 1.0).expect("a disc");
    let d = 2.0 * S;
    let rows = [
        [-S, -S, 0.0],
        [0.0, -d, 0.0],
        [S, -S, 0.0],
        [-d, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [d, 0.0, 0.0],
        [-S, S, 0.0],
        [0.0, d, 0.0],
        [S, S, 0.0],
    ];
    net(disc.control_points(), &rows, 1.0);
    assert_eq!(disc.weights(), [1.0, S, 1.0, S, 1.0, S, 1.0, S, 1.0]);
    near(planar(&disc, [0.25, 0.5]).0, [-0.5, 0.0], 4.0 * EPS);
    near(planar(&disc, [0.25, 0.25]).0, [-0.473_476_16; 2], 5e-9);
    let j = |u: f64, v: f64| planar(&disc, [u, v]).1;
    assert!((j(0.5, 0.5) - 4.0).abs() < 1e-14);
    for (u, v) in [(0.5, 0.0), (0.5, 1.0), (0.0, 0.5), (1.0, 0.5)] {
        assert!((j(u, v) - 8.0 * (2_f64.sqrt() - 1.0)).abs() < 1e-13);
    }
    for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        assert!(j(u, v).abs() < 1e-14, "{}", j(u, v));
    }
    let mut worst = 0.0_f64;
    for i in 0..=100 {
        let t = f64::from(i) / 100.0;
        for edge in [[t, 0.0], [t, 1.0], [0.0, t], [1.0, t]] {
            let [x, y] = planar(&disc, edge).0;
            worst = worst.max((x.hypot(y) - 1.0).abs() / EPS);
        }
        for k in 0..=100 {
            let s = f64::from(k) / 100.0;
            let ([x, y], jacobian) = planar(&disc, [t, s]);
            assert!(x.hypot(y) <= 1.0 + 4.0 * EPS);
            let corner = (i == 0 || i == 100) && (k == 0 || k == 100);
            assert!(corner || jacobian > 0.0, "{t} {s}: {jacobian}");
        }
    }
    eprintln!("disc rim: {worst:.2} ulp");
    assert!(worst <= 4.0);
    // Turned by 135 degrees: every point times (-s, s).
    let turned = biquadratic_disc_turned(ORIGIN, 1.0, 0.0).expect("a disc");
    assert_eq!(turned.control_points()[0], [1.0, 0.0, 0.0]);
    for (p, q) in disc.control_points().iter().zip(turned.control_points()) {
        near(
            *q,
            [-S * p[0] - S * p[1], S * p[0] - S * p[1], 0.0],
            4.0 * EPS,
        );
    }
    let placed = biquadratic_disc([5.0, -2.0], 3.0).expect("a disc");
    near(
        placed.evaluate([0.25, 0.5]).expect("inside"),
        [3.5, -2.0, 0.0],
        4.0 * 8.0 * EPS,
    );
}

#[test]
fn polar_discs_and_sectors() {
    let disc = polar_disc(ORIGIN, 2.0).expect("a disc");
    assert_eq!(disc.degrees(), [1, 2]);
    assert_eq!(disc.counts(), [2, 9]);
    for k in 0..9 {
        assert_eq!(disc.control_points()[2 * k], [0.0; 3]);
        assert_eq!(disc.weights()[2 * k], disc.weights()[2 * k + 1]);
    }
    let circle = full_circle(ORIGIN, 2.0).expect("a circle");
    for i in 0..=40 {
        for k in 0..=10 {
            let (t, a) = (f64::from(i) / 40.0, f64::from(k) / 10.0);
            let [x, y] = circle.evaluate(t).expect("inside");
            let ([px, py], jacobian) = planar(&disc, [a, t]);
            near([px, py], [a * x, a * y], 8.0 * EPS);
            // a (c × c').
            let d = circle.derivatives(t, 1).expect("inside");
            let wanted = a * (d[0][0] * d[1][1] - d[0][1] * d[1][0]);
            assert!((jacobian - wanted).abs() < 1e-12, "{jacobian} {wanted}");
        }
    }
    for angle in [-300.0, -90.0, 1e-6, 45.0, 359.999_999] {
        let turn = AngleInterval::new(30.0, angle).expect("a turn");
        let sector = sector([1.0, 1.0], 2.0, turn).expect("a sector");
        for t in [0.0, 0.37, 1.0] {
            let [x, y, _] = sector.evaluate([0.5, t]).expect("inside");
            assert!(((x - 1.0).hypot(y - 1.0) - 1.0).abs() <= 8.0 * EPS);
        }
        let end = (30.0 + angle).to_radians();
        let wanted = [1.0 + 2.0 * end.cos(), 1.0 + 2.0 * end.sin(), 0.0];
        near(
            sector.evaluate([1.0, 1.0]).expect("inside"),
            wanted,
            16.0 * EPS,
        );
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Largest distance from the unit sphere in ulp, and the sign of (`X_u` × `X_v`) · X inside the domain.
fn sphere_residual(surface: &NurbsSurface) -> (f64, f64) {
    let (mut worst, mut sign) = (0.0_f64, 0.0);
    for i in 0..=60 {
        for k in 0..=60 {
            let at = [f64::from(i) / 60.0, f64::from(k) / 60.0];
            let (p, [u, v]) = surface.gradient(at).expect("inside");
            worst = worst.max((length(p) - 1.0).abs() / EPS);
            if 0 < i && i < 60 {
                let side = dot(cross(u, v), p).signum();
                assert!(
                    sign == 0.0 || sign == side,
                    "the normal turns over at {at:?}"
                );
                sign = side;
            }
        }
    }
    (worst, sign)
}

#[test]
fn spheres_of_tensor_products() {
    let octant = sphere_octant(1.0, &WORLD).expect("an octant");
    let hemisphere = hemisphere(1.0, &WORLD).expect("a hemisphere");
    let sphere = sphere_bicubic(1.0, &WORLD).expect("a sphere");
    for (surface, outward, name) in [
        (&octant, -1.0, "octant"),
        (&hemisphere, 1.0, "hemisphere"),
        (&sphere, 1.0, "sphere"),
    ] {
        let (worst, sign) = sphere_residual(surface);
        eprintln!("{name}: {worst:.2} ulp");
        assert!(worst <= 4.0, "{name}: {worst} ulp");
        assert_eq!(sign, outward, "{name}");
    }
    for (u, v) in [(0.2_f64, 0.7_f64), (0.5, 0.5), (1.0, 0.3), (0.9, 0.0)] {
        let (a, b) = (u * u, v * v);
        let w = (1.0 + a) * (1.0 + b);
        let wanted = [
            (1.0 - a) * (1.0 - b) / w,
            2.0 * (1.0 - a) * v / w,
            2.0 * u * (1.0 + b) / w,
        ];
        near(octant.evaluate([u, v]).expect("inside"), wanted, 4.0 * EPS);
    }
    // The tables, row by row; the row is the first index here.
    let t = 1.0 / 3.0;
    let rows = [(1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 0.0)];
    let ring = [
        [2.0, 0.0],
        [2.0, 4.0],
        [-2.0, 4.0],
        [-2.0, 0.0],
        [-2.0, -4.0],
        [2.0, -4.0],
        [2.0, 0.0],
    ];
    let ring_weights = [1.0, t, t, 1.0, t, t, 1.0];
    for (surface, count) in [(&hemisphere, 4), (&sphere, 7)] {
        for j in 0..count {
            for (i, (z, scale)) in rows.into_iter().enumerate() {
                let wanted = [ring[j][0] * scale, ring[j][1] * scale, z];
                near(surface.control_points()[4 * j + i], wanted, 0.0);
                let w = [1.0, t, t, 1.0][i] * ring_weights[j];
                assert!((surface.weights()[4 * j + i] - w).abs() <= EPS);
            }
        }
    }
    let wanted = [-0.355_029_59, 0.852_071_01, 0.384_615_38];
    near(sphere.evaluate([0.4, 0.3]).expect("inside"), wanted, 5e-9);
    for i in 0..=20 {
        for k in 0..=20 {
            let p = hemisphere
                .evaluate([f64::from(i) / 20.0, f64::from(k) / 20.0])
                .expect("inside");
            assert!(p[1] >= 0.0);
        }
    }
    assert!(sphere_bicubic(0.0, &WORLD).is_err());
}

#[test]
fn the_triangular_octant() {
    let octant = octant_triangle(1.0, &WORLD).expect("an octant");
    let r3 = 3_f64.sqrt();
    let r2 = 2_f64.sqrt();
    let a0 = (r3 - 1.0) / r3;
    let a1 = (r3 + 1.0) / (2.0 * r3);
    let a2 = 1.0 - (5.0 - r2) * (7.0 - r3) / 46.0;
    let b3 = r2 * (3.0 + 2.0 * r2 - r3) / r3;
    for (i, j, point, weight) in [
        (4, 0, [1.0, 0.0, 0.0], 4.0 * r3 * (r3 - 1.0)),
        (0, 4, [0.0, 1.0, 0.0], 4.0 * r3 * (r3 - 1.0)),
        (0, 0, [0.0, 0.0, 1.0], 4.0 * r3 * (r3 - 1.0)),
        (3, 1, [1.0, a0, 0.0], 3.0 * r2),
        (3, 0, [1.0, 0.0, a0], 3.0 * r2),
        (1, 3, [a0, 1.0, 0.0], 3.0 * r2),
        (0, 1, [0.0, a0, 1.0], 3.0 * r2),
        (2, 2, [a1, a1, 0.0], 4.0),
        (0, 2, [0.0, a1, a1], 4.0),
        (2, 0, [a1, 0.0, a1], 4.0),
        (2, 1, [1.0, a2, a2], b3),
        (1, 2, [a2, 1.0, a2], b3),
        (1, 1, [a2, a2, 1.0], b3),
    ] {
        let h = octant.control_point(i, j).expect("a control point");
        near(h.to_point(), point, 4.0 * EPS);
        assert!((h.weight - weight).abs() <= 8.0 * EPS);
    }
    assert_eq!(octant.control_point(3, 2), None);
    near(
        octant.evaluate(1.0 / 3.0, 1.0 / 3.0).expect("inside"),
        [1.0 / r3; 3],
        4.0 * EPS,
    );
    let (before, after) = octant.split();
    let mut worst = 0.0_f64;
    for i in 0..=64_u32 {
        for j in 0..=64 - i {
            let (u, v) = (f64::from(i) / 64.0, f64::from(j) / 64.0);
            let g = octant.gradient(u, v).expect("inside");
            worst = worst.max((length(g.point) - 1.0).abs() / EPS);
            // Regular and outward on the closed triangle.
            assert!(dot(cross(g.du, g.dv), g.point) > 0.1, "{u} {v}");
            near(g.normal.expect("regular"), g.point, 64.0 * EPS);
            assert_eq!(octant.evaluate(u, v), Ok(g.point));
            // The sum of Bernstein polynomials, term by term.
            let w = 1.0 - u - v;
            let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
            let mut sum = [0.0; 4];
            for k in 0..=4 {
                for l in 0..=4 - k {
                    let m = 4 - k - l;
                    let h = octant
                        .control_point(k as usize, l as usize)
                        .expect("a control point");
                    let b = 24.0 / (factorial(k) * factorial(l) * factorial(m))
                        * u.powi(k)
                        * v.powi(l)
                        * w.powi(m);
                    for c in 0..3 {
                        sum[c] += b * h.weighted[c];
                    }
                    sum[3] += b * h.weight;
                }
            }
            near(g.point, [0, 1, 2].map(|c| sum[c] / sum[3]), 16.0 * EPS);
            // First: (u, v) = a (1, 0) + b (½, ½); second: a (½, ½) + b (0, 1).
            near(
                before.evaluate(u, v).expect("inside"),
                octant.evaluate(u + 0.5 * v, 0.5 * v).expect("inside"),
                16.0 * EPS,
            );
            near(
                after.evaluate(u, v).expect("inside"),
                octant.evaluate(0.5 * u, 0.5 * u + v).expect("inside"),
                16.0 * EPS,
            );
        }
    }
    eprintln!("triangle: {worst:.2} ulp");
    assert!(worst <= 4.0, "{worst} ulp");
    // Derivatives against central differences.
    let (u, v, h) = (0.3, 0.2, 1e-5);
    let g = octant.gradient(u, v).expect("inside");
    let at = |u: f64, v: f64| octant.evaluate(u, v).expect("inside");
    let (p, q) = (at(u + h, v), at(u - h, v));
    near(g.du, [0, 1, 2].map(|c| (p[c] - q[c]) / (2.0 * h)), 1e-9);
    let (p, q) = (at(u, v + h), at(u, v - h));
    near(g.dv, [0, 1, 2].map(|c| (p[c] - q[c]) / (2.0 * h)), 1e-9);
    // The edge v = 0 is the quartic of family A.
    let w1 = 3.0 * r2 / (4.0 * r3 * (r3 - 1.0));
    assert!((w1 - 0.836_516).abs() < 5e-7);
    let edge = quarter_circle_quartic(QuarticFamily::A, w1, ORIGIN, 1.0).expect("a circle");
    for i in 0..=50 {
        let t = f64::from(i) / 50.0;
        let [x, z] = edge.evaluate(1.0 - t).expect("inside");
        near(at(t, 0.0), [x, 0.0, z], 8.0 * EPS);
    }
    for (u, v) in [
        (-0.1, 0.0),
        (0.6, 0.6),
        (f64::NAN, 0.0),
        (0.0, f64::NAN),
        (1.1, 0.0),
    ] {
        assert!(octant.evaluate(u, v).is_err() && octant.gradient(u, v).is_err());
    }
    assert!(RationalBezierTriangle::new(0, &[[0.0; 3]], &[1.0]).is_err());
    assert!(RationalBezierTriangle::new(1, &[[0.0; 3]; 3], &[1.0, 0.0, 1.0]).is_err());
    assert!(RationalBezierTriangle::new(1, &[[0.0; 3]; 2], &[1.0; 2]).is_err());
    assert!(RationalBezierTriangle::new(1, &[[0.0, f64::NAN, 0.0]; 3], &[1.0; 3]).is_err());
}

#[test]
fn spheres_in_frames_at_every_scale() {
    for (origin, radius) in [
        ([0.0; 3], 1e-6),
        ([0.0; 3], 1e6),
        ([1e6, -1e6, 3.0], 0.7),
        ([1e-6; 3], 1e-6),
    ] {
        let frame = AxisFrame::from_direction(origin, [1.0, -2.0, 0.5]).expect("a frame");
        let size = length(origin) + radius;
        let off = |p: [f64; 3]| {
            (length([0, 1, 2].map(|i| p[i] - origin[i])) - radius).abs() / (EPS * size)
        };
        let surfaces = [
            sphere_octant(radius, &frame),
            hemisphere(radius, &frame),
            sphere_bicubic(radius, &frame),
            Sphere::new(radius, frame).and_then(|s| s.to_nurbs()),
        ];
        for surface in surfaces {
            let surface = surface.expect("a sphere");
            for i in 0..=30 {
                for k in 0..=30 {
                    let p = surface
                        .evaluate([f64::from(i) / 30.0, f64::from(k) / 30.0])
                        .expect("inside");
                    assert!(off(p) <= 4.0, "{:?}: {} ulp", surface.counts(), off(p));
                }
            }
        }
        let triangle = octant_triangle(radius, &frame).expect("an octant");
        for i in 0..=30_u32 {
            for k in 0..=30 - i {
                let p = triangle
                    .evaluate(f64::from(i) / 30.0, f64::from(k) / 30.0 * 0.999)
                    .expect("inside");
                assert!(off(p) <= 4.0, "triangle: {} ulp", off(p));
            }
        }
    }
}
