//! Parametric surfaces against differences, against their implicit equations, and against their rational forms.

use voxlathe::construct::*;
use voxlathe::nurbs::NurbsSurface;

const EPS: f64 = f64::EPSILON;

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
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

fn near(found: [f64; 3], wanted: [f64; 3], bound: f64, what: &str) {
    let gap = dot(sub(found, wanted), sub(found, wanted)).sqrt();
    assert!(
        gap <= bound,
        "{what}: {found:?} for {wanted:?}: {gap:e} above {bound:e}"
    );
}

fn frame() -> AxisFrame {
    AxisFrame::from_axis([3.0, -1.0, 0.5], [1.0, 2.0, -0.5], [0.0, 1.0, 1.0]).expect("a frame")
}

/// Derivatives against central differences, and the normal against the cross product with the sign given.
fn check(surface: &dyn ParametricSurface, u: f64, v: f64, outward: f64) {
    let h = 1e-4;
    let at = |u: f64, v: f64| surface.evaluate(u, v).expect("inside");
    let p = at(u, v);
    let slope = |a: [f64; 3], b: [f64; 3]| sub(a, b).map(|c| c / (2.0 * h));
    let (u1, u0, v1, v0) = (at(u + h, v), at(u - h, v), at(u, v + h), at(u, v - h));
    near(p.du, slope(u1.point, u0.point), 1e-7, "S_u");
    near(p.dv, slope(v1.point, v0.point), 1e-7, "S_v");
    near(p.duu, slope(u1.du, u0.du), 1e-7, "S_uu");
    near(p.duv, slope(v1.du, v0.du), 1e-7, "S_uv");
    near(p.duv, slope(u1.dv, u0.dv), 1e-7, "S_vu");
    near(p.dvv, slope(v1.dv, v0.dv), 1e-7, "S_vv");
    let n = cross(p.du, p.dv);
    let length = dot(n, n).sqrt();
    near(
        p.normal,
        n.map(|c| outward * c / length),
        8.0 * EPS,
        "normal",
    );
}

#[test]
fn derivatives_and_normals() {
    let frame = frame();
    let sphere = Sphere::new(1.5, frame).expect("a sphere");
    let ring = Torus::new(2.0, 0.6, frame).expect("a torus");
    let horn = Torus::new(1.0, 1.0, frame).expect("a torus");
    let up = EllipticCone::new([1.5, 0.7], 0.4, true, frame).expect("a cone");
    let down = EllipticCone::new([0.7, 1.5], 0.4, false, frame).expect("a cone");
    let cylinder = EllipticCone::cylinder([1.5, 0.7], frame).expect("a cylinder");
    for i in 0..7 {
        for k in 0..9 {
            let (u, v) = (0.3 + 0.4 * f64::from(i), 0.7 * f64::from(k));
            check(&Plane::new(frame), u - 2.0, v, 1.0);
            check(&sphere, u, v, -1.0);
            check(&ring, u, v, -1.0);
            check(&horn, u, v, -1.0);
            check(&up, u - 1.5, v, -1.0);
            check(&cylinder, u - 1.5, v, -1.0);
            check(&down, u - 1.5, v, 1.0);
        }
    }
}

#[test]
fn normals_point_outward_and_stay_where_tangents_vanish() {
    let frame = frame();
    let sphere = Sphere::new(2.0, frame).expect("a sphere");
    for (u, v) in [(0.0, 0.3), (1.0, 4.0), (std::f64::consts::PI, 5.0)] {
        let p = sphere.evaluate(u, v).expect("inside");
        let out = sub(p.point, frame.origin()).map(|c| c / 2.0);
        near(p.normal, out, 8.0 * EPS, "sphere");
    }
    near(
        sphere.evaluate(0.0, 1.0).expect("a pole").normal,
        frame.axis(2).map(|c| -c),
        EPS,
        "south",
    );
    near(
        sphere
            .evaluate(std::f64::consts::PI, 1.0)
            .expect("a pole")
            .normal,
        frame.axis(2),
        2.0 * EPS,
        "north",
    );
    for upward in [true, false] {
        let cone = EllipticCone::new([1.0, 0.5], 0.5, upward, frame).expect("a cone");
        let apex = cone.apex();
        assert!((apex + 1.0 / 0.5_f64.tan()).abs() <= 4.0 * EPS);
        for k in 0..8 {
            let v = f64::from(k);
            let (p, q) = (
                cone.evaluate(apex, v).expect("apex"),
                cone.evaluate(0.5, v).expect("inside"),
            );
            // The normal is that of the whole generator; the apex is on the axis.
            assert_eq!(p.normal, q.normal);
            let [x, y, z] = frame.to_local(p.point);
            assert!(x.hypot(y) <= 8.0 * EPS && (z.abs() + apex).abs() <= 16.0 * EPS);
            let [x, y, _] = frame.to_local(q.point);
            let n = sub(
                frame.to_local([0, 1, 2].map(|i| frame.origin()[i] + q.normal[i])),
                [0.0; 3],
            );
            assert!(n[0] * x + n[1] * y > 0.0);
        }
        assert!(cone.evaluate(apex - 1e-9, 0.0).is_err());
        assert!(cone.evaluate(f64::NAN, 0.0).is_err());
    }
    let torus = Torus::new(2.0, 0.5, frame).expect("a torus");
    for (u, v) in [(0.0, 0.0), (3.0, 1.0), (-2.0, 9.0)] {
        let p = torus.evaluate(u, v).expect("inside");
        let center: [f64; 3] = [0, 1, 2].map(|i| {
            frame.origin()[i] + 2.0 * (v.cos() * frame.axis(0)[i] + v.sin() * frame.axis(1)[i])
        });
        near(
            p.normal,
            sub(p.point, center).map(|c| c / 0.5),
            32.0 * EPS,
            "torus",
        );
    }
    assert!(sphere.evaluate(-0.1, 0.0).is_err());
    assert!(sphere.evaluate(0.5, f64::INFINITY).is_err());
    assert!(torus.evaluate(f64::NAN, 0.0).is_err());
    // A coordinate beyond f64 is an error, not an infinity or a NaN.
    let needle = EllipticCone::new([1e-140, 1e140], 1.0, true, frame).expect("a cone");
    assert!(needle.evaluate(1e100, 0.0).is_err());
    assert!(
        Plane::new(frame)
            .evaluate(f64::MAX, f64::MAX)
            .is_err_and(|e| e.to_string().contains("f64"))
    );
    assert!(Sphere::new(-1.0, frame).is_err());
    assert!(Torus::new(f64::NAN, 1.0, frame).is_err());
    assert!(EllipticCone::new([1.0, 1.0], 1.6, true, frame).is_err());
    assert!(EllipticCone::new([1.0, 1.0], -0.1, true, frame).is_err());
    assert!(EllipticCone::new([1.0, 0.0], 0.1, true, frame).is_err());
}

/// The largest absolute value of the implicit function over the surface, in local coordinates.
fn implicit(surface: &NurbsSurface, frame: &AxisFrame, f: impl Fn([f64; 3]) -> f64) -> f64 {
    let mut worst = 0.0_f64;
    let [(a, b), (c, d)] = surface.domain();
    for i in 0..=40 {
        for k in 0..=80 {
            let at = [
                a + (b - a) * f64::from(i) / 40.0,
                c + (d - c) * f64::from(k) / 80.0,
            ];
            worst = worst.max(f(frame.to_local(surface.evaluate(at).expect("inside"))).abs());
        }
    }
    worst
}

#[test]
fn rational_forms_satisfy_the_implicit_equations() {
    let frame = frame();
    let torus = Torus::new(2.0, 0.6, frame)
        .and_then(|t| t.to_nurbs())
        .expect("a torus");
    assert_eq!(torus.counts(), [9, 9]);
    let off = implicit(&torus, &frame, |[x, y, z]| {
        (x.hypot(y) - 2.0).hypot(z) - 0.6
    });
    eprintln!("torus {:.1} ulp", off / EPS);
    assert!(off <= 32.0 * EPS);
    let sphere = Sphere::new(1.5, frame)
        .and_then(|t| t.to_nurbs())
        .expect("a sphere");
    assert_eq!(sphere.counts(), [5, 9]);
    let off = implicit(&sphere, &frame, |[x, y, z]| x.hypot(y).hypot(z) - 1.5);
    eprintln!("sphere {:.1} ulp", off / EPS);
    assert!(off <= 32.0 * EPS);
    for upward in [true, false] {
        let (a, b, alpha) = (1.5, 0.7, 0.4_f64);
        let cone = EllipticCone::new([a, b], alpha, upward, frame).expect("a cone");
        let surface = cone.to_nurbs([cone.apex(), 2.0]).expect("a cone");
        let sense = if upward { 1.0 } else { -1.0 };
        let off = implicit(&surface, &frame, |[x, y, z]| {
            (x / a).hypot(y / b) - (1.0 + sense * z / a * alpha.tan())
        });
        eprintln!("cone {:.1} ulp", off / EPS);
        assert!(off <= 32.0 * EPS);
        assert!(cone.to_nurbs([cone.apex() - 1.0, 0.0]).is_err());
    }
    let cylinder = EllipticCone::cylinder([1.5, 0.7], frame).expect("a cylinder");
    assert_eq!(cylinder.apex(), f64::NEG_INFINITY);
    let surface = cylinder.to_nurbs([-2.0, 3.0]).expect("a cylinder");
    let off = implicit(&surface, &frame, |[x, y, _]| (x / 1.5).hypot(y / 0.7) - 1.0);
    assert!(off <= 32.0 * EPS);
    let plane = Plane::new(frame)
        .to_nurbs([-1.0, 2.0], [0.0, 5.0])
        .expect("a plane");
    assert!(implicit(&plane, &frame, |[_, _, z]| z) <= 16.0 * EPS);
}

#[test]
fn scaled_frames_scale_lengths_and_not_normals() {
    use glam::DVec3;
    use voxlathe::math::Similarity;
    let similarity = Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X)
        .map(|s| s.scaled(4.0).translated(DVec3::Y));
    let frame = AxisFrame::from(&similarity.expect("a frame"));
    let p = Sphere::new(2.0, frame)
        .and_then(|s| s.evaluate(0.5 * std::f64::consts::PI, 0.0))
        .expect("a point");
    near(p.point, [8.0, 1.0, 0.0], 8.0 * EPS, "point");
    near(p.normal, [1.0, 0.0, 0.0], EPS, "normal");
    assert_eq!(frame.scale(), 4.0);
}
