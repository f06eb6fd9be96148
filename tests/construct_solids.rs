//! Solids of revolution by the three constructions: volumes by their Jacobians, signs, frames, turns.

use std::f64::consts::PI;
use voxlathe::construct::*;
use voxlathe::nurbs::{KnotVector, NurbsCurve, NurbsSurface, NurbsVolume};

const EPS: f64 = f64::EPSILON;
const WORLD: AxisFrame = AxisFrame::WORLD;
const ALL: [Construction; 4] = [
    Construction::CurveDisc(DiscForm::Biquadratic),
    Construction::CurveDisc(DiscForm::Polar),
    Construction::SurfaceCircle,
    Construction::CurveToAxis,
];

fn turn(start: f64, angle: f64) -> AngleInterval {
    AngleInterval::new(start, angle).expect("a turn")
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

fn det(x: [[f64; 3]; 3]) -> f64 {
    dot(x[0], cross(x[1], x[2]))
}

/// Nodes and weights of the Gauss rule on [0, 1].
fn gauss(n: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut a, mut b) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (a, b) = (b, ((2.0 * k - 1.0) * x * b - (k - 1.0) * a) / k);
        }
        (b, n as f64 * (x * b - a) / (x * x - 1.0))
    };
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..8 {
                let (p, d) = legendre(x);
                x -= p / d;
            }
            let d = legendre(x).1;
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * d * d))
        })
        .collect()
}

/// All nodes along one parameter: 16 points a span, enough for arcs up to 90 degrees, or 4 for a straight line.
fn nodes(knots: &KnotVector) -> Vec<(f64, f64)> {
    let rule = gauss(if knots.degree() == 1 { 4 } else { 16 });
    let mut all = Vec::new();
    for span in knots.spans() {
        let width = span.end - span.start;
        all.extend(
            rule.iter()
                .map(|(x, w)| (span.start + width * x, width * w)),
        );
    }
    all
}

/// ∭ det J and ∭ |det J|.
fn volume(solid: &NurbsVolume) -> (f64, f64) {
    let [a, b, c] = solid.knots().each_ref().map(nodes);
    let (mut signed, mut whole) = (0.0, 0.0);
    for &(u, wu) in &a {
        for &(v, wv) in &b {
            for &(w, ww) in &c {
                let (_, slopes) = solid.gradient([u, v, w]).expect("inside");
                let part = det(slopes) * wu * wv * ww;
                signed += part;
                whole += part.abs();
            }
        }
    }
    (signed, whole)
}

fn check_volume(solid: &NurbsVolume, wanted: f64, name: &str) -> f64 {
    let off = (volume(solid).0 / wanted - 1.0).abs();
    assert!(off <= 1e-12, "{name}: off by {off:e}");
    off
}

#[test]
fn volumes_of_the_four_solids_by_every_construction() {
    let mut worst = 0.0_f64;
    for by in ALL {
        let full = AngleInterval::FULL;
        let (r, h, ring) = (1.3, 2.7, 3.1);
        let name = format!("{by:?}");
        let made = |solid: Result<NurbsVolume, ConstructError>| solid.expect("a solid");
        for (solid, wanted) in [
            (
                made(cylinder_volume(r, h, by, full, &WORLD)),
                PI * r * r * h,
            ),
            (
                made(cone_volume(r, h, by, full, &WORLD)),
                PI * r * r * h / 3.0,
            ),
            (
                made(sphere_volume(r, by, full, &WORLD)),
                4.0 * PI * r * r * r / 3.0,
            ),
            (
                made(torus_volume(ring, r, by, full, &WORLD)),
                2.0 * PI * PI * ring * r * r,
            ),
        ] {
            worst = worst.max(check_volume(&solid, wanted, &name));
        }
    }
    eprintln!("volumes: {worst:e}");
}

#[test]
fn volumes_of_partial_turns_in_tilted_frames_at_every_scale() {
    let mut worst = 0.0_f64;
    for (size, offset) in [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (3.0, 1e6)] {
        let frame = AxisFrame::from_direction([offset, -offset, offset], [1.0, -2.0, 2.0])
            .expect("a frame");
        for (start, angle) in [
            (0.0, 90.0),
            (17.0, 200.0),
            (-90.0, 359.999_999),
            (45.0, -120.0),
            (3.0, 1e-6),
        ] {
            let part = turn(start, angle);
            let solid =
                sphere_volume(size, Construction::CurveToAxis, part, &frame).expect("a solid");
            let wanted = 4.0 / 3.0 * PI * size.powi(3) * angle / 360.0;
            // Control points are rounded at the offset, and a thin wedge is a difference of them.
            let width = (angle.abs() / 360.0).min(0.25);
            let off = (volume(&solid).0 / wanted - 1.0).abs();
            let bound = 1e-12 + 16.0 * EPS * (1.0 + offset / size) / width;
            assert!(
                off <= bound,
                "{size} {offset} {start} {angle}: {off:e} above {bound:e}"
            );
            if offset == 0.0 && angle.abs() > 1.0 {
                worst = worst.max(off);
            }
            let ring = torus_volume(3.0 * size, size, Construction::SurfaceCircle, part, &frame)
                .expect("a solid");
            let wanted = 6.0 * PI * PI * size.powi(3) * angle / 360.0;
            let off = (volume(&ring).0 / wanted - 1.0).abs();
            assert!(
                off <= bound,
                "ring {size} {offset} {start} {angle}: {off:e} above {bound:e}"
            );
        }
    }
    eprintln!("partial: {worst:e}");
}

#[test]
fn signs_of_the_jacobian() {
    for by in ALL {
        for solid in [
            cylinder_volume(1.0, 2.0, by, AngleInterval::FULL, &WORLD),
            cone_volume(1.0, 2.0, by, AngleInterval::FULL, &WORLD),
            sphere_volume(1.0, by, AngleInterval::FULL, &WORLD),
        ] {
            let (signed, whole) = volume(&solid.expect("a solid"));
            assert!(
                (signed - whole).abs() <= 1e-14 * whole,
                "{by:?}: a negative part"
            );
        }
    }
    let torus = torus_volume(
        2.0,
        1.0,
        Construction::SurfaceCircle,
        AngleInterval::FULL,
        &WORLD,
    )
    .expect("a torus");
    let (signed, whole) = volume(&torus);
    assert!((signed - whole).abs() <= 1e-14 * whole);
    // c folds over the circle: |det J| counts the hole twice, π ∮ r² |dz| = 2 π (2 R² + ..) more.
    let folded = torus_volume(
        2.0,
        1.0,
        Construction::CurveToAxis,
        AngleInterval::FULL,
        &WORLD,
    )
    .expect("a map");
    let (signed, whole) = volume(&folded);
    assert!((signed / (4.0 * PI * PI) - 1.0).abs() < 1e-12);
    // Outer and inner half: π ∫ ((R + c)² + (R - c)²) dz = 2 π ∫ (R² + 1 - z²) dz = 4 π (R² + 2/3).
    assert!(
        (whole / (4.0 * PI * (4.0 + 2.0 / 3.0)) - 1.0).abs() < 1e-12,
        "{whole}"
    );
    // A falling curve or a clockwise turn is negative, both together positive.
    let down = sphere_profile(1.0)
        .and_then(|c| Ok(c.reverse()?))
        .expect("a curve");
    for (angle, sign) in [(90.0, -1.0), (-90.0, 1.0)] {
        let solid = solid_of_revolution(&down, Construction::CurveToAxis, turn(0.0, angle), &WORLD)
            .expect("a solid");
        assert_eq!(volume(&solid).0.signum(), sign);
    }
}

/// A rational curve that is not planar.
fn space_curve() -> NurbsCurve<3> {
    let points = vec![
        [1.0, 0.2, -1.0],
        [2.0, 1.5, 0.0],
        [-0.5, 2.0, 0.7],
        [1.0, -1.0, 1.5],
        [0.3, 0.4, 2.0],
    ];
    let knots = KnotVector::clamped_uniform(3, 5).expect("knots");
    NurbsCurve::new(knots, points, vec![1.0, 0.5, 2.0, 1.0, 3.0]).expect("a curve")
}

fn near(found: [f64; 3], wanted: [f64; 3], bound: f64) {
    let gap = (0..3).fold(0.0, |m: f64, i| m.max((found[i] - wanted[i]).abs()));
    assert!(
        gap <= bound,
        "{found:?} for {wanted:?}: {gap:e} above {bound:e}"
    );
}

#[test]
fn every_construction_is_the_complex_product_of_its_factors() {
    let curve = space_curve();
    let part = turn(40.0, 250.0);
    let a = curve_disc(&curve, DiscForm::Polar, part, &WORLD).expect("a volume");
    let biquadratic =
        curve_disc(&curve, DiscForm::Biquadratic, turn(40.0, 360.0), &WORLD).expect("a volume");
    let c = curve_to_axis(&curve, CircleForm::Quadratic, part, &WORLD).expect("a volume");
    assert_eq!(a, c, "a with the polar disc is c");
    let surface =
        surface_of_revolution(&curve, CircleForm::Quadratic, part, &WORLD).expect("a surface");
    let rim = arc([0.0, 0.0], 1.0, part).expect("an arc");
    let disc = biquadratic_disc_turned([0.0, 0.0], 1.0, 40.0).expect("a disc");
    for i in 0..=10 {
        for k in 0..=10 {
            let (u, t) = (f64::from(i) / 10.0, f64::from(k) / 10.0);
            let [x, y, z] = curve.evaluate(u).expect("inside");
            let [p, q] = rim.evaluate(t).expect("inside");
            let wanted = [x * p - y * q, x * q + y * p, z];
            near(
                surface.evaluate([u, t]).expect("inside"),
                wanted,
                16.0 * EPS,
            );
            near(
                a.evaluate([u, 0.5, t]).expect("inside"),
                [0.5 * wanted[0], 0.5 * wanted[1], z],
                16.0 * EPS,
            );
            for s in [0.0, 0.3, 1.0] {
                let [p, q, _] = disc.evaluate([s, t]).expect("inside");
                let wanted = [x * p - y * q, x * q + y * p, z];
                near(
                    biquadratic.evaluate([u, s, t]).expect("inside"),
                    wanted,
                    16.0 * EPS,
                );
            }
        }
    }
    // det J of a: z' |C|² J_D.
    for (u, s, t) in [(0.2, 0.4, 0.7), (0.9, 0.1, 0.2)] {
        let found = det(biquadratic.gradient([u, s, t]).expect("inside").1);
        let c = curve.derivatives(u, 1).expect("inside");
        let (_, [p, q]) = disc.gradient([s, t]).expect("inside");
        let wanted = c[1][2] * (c[0][0].powi(2) + c[0][1].powi(2)) * (p[0] * q[1] - p[1] * q[0]);
        assert!((found / wanted - 1.0).abs() < 1e-13, "{found} {wanted}");
    }
}

#[test]
fn an_unclamped_generator_keeps_its_knots() {
    let knots = KnotVector::unclamped_uniform(2, 5).expect("knots");
    let points = vec![
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 1.0],
        [1.5, 0.0, 2.0],
        [1.0, 0.0, 3.0],
        [2.0, 0.0, 4.0],
    ];
    let curve = NurbsCurve::polynomial(knots, points).expect("a curve");
    let solid =
        curve_to_axis(&curve, CircleForm::Quadratic, turn(0.0, 90.0), &WORLD).expect("a solid");
    let clamped = curve_to_axis(
        &curve.clamp().expect("a curve"),
        CircleForm::Quadratic,
        turn(0.0, 90.0),
        &WORLD,
    )
    .expect("a solid");
    assert_eq!(solid.knots()[0], *curve.knots());
    for u in [0.0, 0.4, 1.0] {
        let [(a, b), ..] = solid.domain();
        let at = |v: &NurbsVolume| v.evaluate([a + (b - a) * u, 0.7, 0.3]).expect("inside");
        near(at(&solid), at(&clamped), 16.0 * EPS);
    }
    assert!(matches!(
        faces(&solid),
        Err(ConstructError::NotClamped { parameter: 0 })
    ));
}

#[test]
fn the_cubic_circle_turns_as_the_quadratic_does() {
    // The 4 x 7 sphere is the cubic half circle times the cubic circle.
    let half = half_circle_cubic([0.0, 0.0], 1.0)
        .and_then(|c| meridian(&c))
        .expect("a curve");
    let sphere = surface_of_revolution(&half, CircleForm::Cubic, AngleInterval::FULL, &WORLD)
        .expect("a sphere");
    assert_eq!(sphere, sphere_bicubic(1.0, &WORLD).expect("a sphere"));
    for angle in [180.0, -180.0, 360.0, -360.0] {
        let cubic = surface_of_revolution(&half, CircleForm::Cubic, turn(25.0, angle), &WORLD)
            .expect("a surface");
        let quadratic =
            surface_of_revolution(&half, CircleForm::Quadratic, turn(25.0, angle), &WORLD)
                .expect("a surface");
        for t in [0.0, 0.5, 1.0] {
            let at = |s: &NurbsSurface| s.evaluate([0.4, t]).expect("inside");
            near(at(&cubic), at(&quadratic), 8.0 * EPS);
        }
    }
    let bad = surface_of_revolution(&half, CircleForm::Cubic, turn(0.0, 90.0), &WORLD);
    assert!(matches!(bad, Err(ConstructError::TurnOfForm { .. })));
    let bad = curve_disc(&half, DiscForm::Biquadratic, turn(0.0, 90.0), &WORLD);
    assert!(matches!(bad, Err(ConstructError::TurnOfForm { .. })));
}

#[test]
fn any_axis_is_the_turned_and_moved_solid() {
    let curve = space_curve();
    let frame =
        AxisFrame::from_axis([1e6, 2.0, -3e5], [0.3, -1.0, 0.4], [1.0, 1.0, 0.0]).expect("a frame");
    let here =
        curve_to_axis(&curve, CircleForm::Quadratic, turn(10.0, 300.0), &WORLD).expect("a solid");
    let there =
        curve_to_axis(&curve, CircleForm::Quadratic, turn(10.0, 300.0), &frame).expect("a solid");
    for u in [0.0, 0.3, 1.0] {
        for (s, t) in [(0.0, 0.2), (0.7, 0.9), (1.0, 1.0)] {
            let wanted = frame.to_world(here.evaluate([u, s, t]).expect("inside"));
            near(
                there.evaluate([u, s, t]).expect("inside"),
                wanted,
                4.0 * EPS * 1e6,
            );
        }
    }
    // A generator in the world keeps its place at angle 0.
    let world_curve = frame.curve_to_local(&curve).expect("a curve");
    let surface =
        surface_of_revolution(&world_curve, CircleForm::Quadratic, turn(0.0, 77.0), &frame)
            .expect("a surface");
    near(
        surface.evaluate([0.6, 0.0]).expect("inside"),
        curve.evaluate(0.6).expect("inside"),
        8.0 * EPS * 1e6,
    );
    let local = frame.surface_to_local(&surface).expect("a surface");
    let again = surface_of_revolution(&world_curve, CircleForm::Quadratic, turn(0.0, 77.0), &WORLD)
        .expect("a surface");
    near(
        local.evaluate([0.6, 0.4]).expect("inside"),
        again.evaluate([0.6, 0.4]).expect("inside"),
        8.0 * EPS * 1e6,
    );
}

#[test]
fn the_literal_formula_is_a_translational_sweep() {
    let axis_distance = |p: [f64; 3]| p[0].hypot(p[1]);
    // The rim of the fixed disc of radius 1, at a generator point of radius r.
    for r in [0.535, 1.0, 1.465] {
        let line = NurbsCurve::polynomial(
            KnotVector::bezier(1).expect("knots"),
            vec![[r, 0.0, 0.0], [r, 0.0, 1.0]],
        )
        .expect("a line");
        let swept =
            translational_curve_disc(&line, 1.0, DiscForm::Polar, &WORLD).expect("a volume");
        let solid =
            curve_disc(&line, DiscForm::Polar, AngleInterval::FULL, &WORLD).expect("a volume");
        let rim = |v: &NurbsVolume| {
            let all = (0..=4000).map(|i| {
                axis_distance(
                    v.evaluate([0.5, 1.0, f64::from(i) / 4000.0])
                        .expect("inside"),
                )
            });
            all.fold((f64::MAX, 0.0_f64), |(a, b), d| (a.min(d), b.max(d)))
        };
        let (least, most) = rim(&swept);
        // Centre at r - 1: between 1 - |r - 1| and 1 + |r - 1|.
        assert!(
            (most - least - 2.0 * (r - 1.0).abs()).abs() < 1e-12,
            "{r}: {least} {most}"
        );
        let (least, most) = rim(&solid);
        assert!(most - least <= 8.0 * EPS);
    }
    // With 0.465 off the axis, by 0.93.
    // b: the surface is moved, not turned.
    let section = torus_section(2.0, 0.5).expect("a surface");
    let swept = translational_surface_circle(&section, 2.0, &WORLD).expect("a volume");
    let full = AngleInterval::FULL;
    let torus = surface_circle(&section, CircleForm::Quadratic, full, &WORLD).expect("a volume");
    for t in [0.0, 0.25, 0.6] {
        let at = |v: &NurbsVolume, a: f64, b: f64| v.evaluate([a, b, t]).expect("inside");
        let middle = |v: &NurbsVolume| at(v, 0.5, 0.5);
        near(middle(&swept), middle(&torus), 8.0 * EPS);
        let (p, q) = (at(&swept, 0.2, 0.8), at(&swept, 0.5, 0.5));
        let shape = section.evaluate([0.2, 0.8]).expect("inside");
        // The same offset everywhere round: a translation.
        near(
            [p[0] - q[0], p[1] - q[1], p[2] - q[2]],
            [shape[0] - 2.0, 0.0, shape[2]],
            16.0 * EPS,
        );
    }
    let p = axis_distance(swept.evaluate([0.5, 1.0, 0.25]).expect("inside"));
    let q = axis_distance(torus.evaluate([0.5, 1.0, 0.25]).expect("inside"));
    assert!(
        (q - 2.5).abs() < 1e-15 * 8.0 && (p - 2.0_f64.hypot(0.5)).abs() < 1e-14,
        "{p} {q}"
    );
    // Biquadratic: its reference point is on the generator too.
    let curve = space_curve();
    let swept =
        translational_curve_disc(&curve, 0.3, DiscForm::Biquadratic, &WORLD).expect("a volume");
    near(
        swept.evaluate([0.4, 0.0, 0.0]).expect("inside"),
        curve.evaluate(0.4).expect("inside"),
        8.0 * EPS,
    );
}

#[test]
fn faces_of_solids() {
    use FaceKind::{Boundary, Collapsed, Seam};
    let kinds = |v: &NurbsVolume| {
        faces(v)
            .expect("clamped")
            .iter()
            .map(|f| f.kind)
            .collect::<Vec<_>>()
    };
    let frame = AxisFrame::from_direction([3.0, 1.0, 2.0], [0.3, -1.0, 0.4]).expect("a frame");
    for frame in [WORLD, frame] {
        let cone = cone_volume(
            1.0,
            2.0,
            Construction::CurveToAxis,
            turn(7.0, 360.0),
            &frame,
        )
        .expect("a cone");
        assert_eq!(
            kinds(&cone),
            [Boundary, Collapsed, Collapsed, Boundary, Seam, Seam]
        );
        let part = cone_volume(
            1.0,
            2.0,
            Construction::CurveToAxis,
            turn(7.0, 100.0),
            &frame,
        )
        .expect("a cone");
        assert_eq!(
            kinds(&part),
            [Boundary, Collapsed, Collapsed, Boundary, Boundary, Boundary]
        );
        let ball = sphere_volume(1.0, Construction::CurveToAxis, AngleInterval::FULL, &frame)
            .expect("a ball");
        assert_eq!(
            kinds(&ball),
            [Collapsed, Collapsed, Collapsed, Boundary, Seam, Seam]
        );
        let torus = torus_volume(
            2.0,
            1.0,
            Construction::SurfaceCircle,
            AngleInterval::FULL,
            &frame,
        )
        .expect("a torus");
        assert_eq!(
            kinds(&torus),
            [Boundary, Boundary, Boundary, Boundary, Seam, Seam]
        );
        let by = Construction::CurveDisc(DiscForm::Biquadratic);
        let cylinder =
            cylinder_volume(1.0, 2.0, by, AngleInterval::FULL, &frame).expect("a cylinder");
        assert_eq!(kinds(&cylinder), [Boundary; 6]);
        // The boundary faces, with their orientation, enclose the volume: ∬ X · (X_a × X_b) / 3.
        for (solid, wanted) in [
            (&cone, 2.0 * PI / 3.0),
            (&part, 2.0 * PI / 3.0 * 100.0 / 360.0),
            (&ball, 4.0 * PI / 3.0),
            (&torus, 4.0 * PI * PI),
            (&cylinder, 2.0 * PI),
        ] {
            let mut total = 0.0;
            for f in faces(solid)
                .expect("clamped")
                .iter()
                .filter(|f| f.kind == Boundary)
            {
                let [a, b] = f.surface.knots().each_ref().map(nodes);
                let sign = if f.outward { 1.0 } else { -1.0 };
                for &(u, wu) in &a {
                    for &(v, wv) in &b {
                        let (p, [x, y]) = f.surface.gradient([u, v]).expect("inside");
                        total += sign * wu * wv * dot(p, cross(x, y)) / 3.0;
                    }
                }
            }
            assert!((total / wanted - 1.0).abs() < 1e-11, "{total} {wanted}");
        }
    }
}

#[test]
fn profiles_surfaces_and_solids_convert_back() {
    let frame = AxisFrame::from_direction([3.0, 1.0, 2.0], [0.3, -1.0, 0.4]).expect("a frame");
    let profile = sphere_profile(2.0).expect("a curve");
    let solid = solid_of_revolution(
        &profile,
        Construction::CurveToAxis,
        turn(0.0, 120.0),
        &frame,
    )
    .expect("a solid");
    let surface = solid_to_surface(&solid).expect("a surface");
    let circle = CircleForm::Quadratic;
    let curve = meridian(&profile).expect("a curve");
    assert_eq!(
        surface,
        surface_of_revolution(&curve, circle, turn(0.0, 120.0), &frame).expect("a surface")
    );
    let again = surface_to_solid(&surface, &frame).expect("a solid");
    for (p, q) in again.control_points().iter().zip(solid.control_points()) {
        near(*p, *q, 4.0 * EPS * 6.0);
    }
    let generator = surface_to_curve(&surface).expect("a curve");
    let back = curve_to_profile(&generator, &frame).expect("a profile");
    for (p, q) in back.control_points().iter().zip(profile.control_points()) {
        assert!(
            (p[0] - q[0]).hypot(p[1] - q[1]) <= 8.0 * EPS * 6.0,
            "{p:?} {q:?}"
        );
    }
    assert!(matches!(
        curve_to_profile(&space_curve(), &WORLD),
        Err(ConstructError::NotMeridian { .. })
    ));
    let axis = NurbsCurve::polynomial(
        KnotVector::bezier(1).expect("knots"),
        vec![[0.0; 3], [0.0, 0.0, 1.0]],
    )
    .expect("a line");
    assert_eq!(curve_to_profile(&axis, &WORLD), Err(ConstructError::OnAxis));
    assert_eq!(
        curve_to_axis(&axis, circle, AngleInterval::FULL, &WORLD),
        Err(ConstructError::OnAxis)
    );
    assert_eq!(
        surface_of_revolution(&axis, circle, AngleInterval::FULL, &WORLD),
        Err(ConstructError::OnAxis)
    );
    assert!(face(&solid, 3, End::First).is_err());
}

#[test]
fn impossible_sizes_are_refused() {
    let by = Construction::CurveToAxis;
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-200, 1e200] {
        assert!(cylinder_volume(bad, 1.0, by, AngleInterval::FULL, &WORLD).is_err());
        assert!(cone_volume(1.0, bad, by, AngleInterval::FULL, &WORLD).is_err());
        assert!(sphere_volume(bad, by, AngleInterval::FULL, &WORLD).is_err());
        assert!(torus_volume(1.0, bad, by, AngleInterval::FULL, &WORLD).is_err());
    }
    assert!(torus_volume(1.0, 1.1, by, AngleInterval::FULL, &WORLD).is_err());
    let huge = NurbsCurve::polynomial(
        KnotVector::bezier(1).expect("knots"),
        vec![[1e308, 1e308, 0.0], [1e308, 0.0, 1.0]],
    )
    .expect("a line");
    assert!(curve_to_axis(&huge, CircleForm::Quadratic, turn(45.0, 90.0), &WORLD).is_err());
}
