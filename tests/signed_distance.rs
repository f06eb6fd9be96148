//! Signed distance against closed forms in high precision and against a dense search, and its sign
//! against membership.

#![allow(clippy::print_stdout, reason = "the figures are what the test is for")]

mod support;

use glam::DVec3;
use support::hard;
use support::oracle::{Big, Oracle, Solid, big, small, sqrt};
use support::sampling::{Random, evaluate, hard as hard_point, uniform};
use support::text::scene_text;
use voxlathe::Scene;

/// Steps that a scene is moved by, and how far (in f64 lengths beside its own).
const MOVES: [(&str, &str); 7] = [
    ("as it stands", ""),
    ("turned", "{ rotate = { axis = [1, -2, 3], degrees = 50 } }"),
    ("small", "{ scale = 1e-6 }"),
    ("large", "{ scale = 1e6 }"),
    ("near", "{ translate = [0.1, -3, 0.7] }"),
    ("offset", "{ translate = [2e6, -3e6, 1e6] }"),
    (
        "all",
        "{ scale = 1e6 }, { rotate = { axis = [3, 1, -1], degrees = -111 } }, { translate = [2e12, -3e12, 1e12] }",
    ),
];

fn abs(x: Big) -> Big {
    if x < big(0.0) { -x } else { x }
}

fn max(a: Big, b: Big) -> Big {
    if a < b { b } else { a }
}

fn min(a: Big, b: Big) -> Big {
    if a < b { a } else { b }
}

fn hypot(a: &Big, b: &Big) -> Big {
    sqrt(&(a * a + b * b))
}

/// Distance to a segment of the half-plane.
fn to_segment(p: [&Big; 2], a: [f64; 2], b: [f64; 2]) -> Big {
    let d = [big(b[0]) - big(a[0]), big(b[1]) - big(a[1])];
    let v = [p[0] - big(a[0]), p[1] - big(a[1])];
    let t = (&v[0] * &d[0] + &v[1] * &d[1]) / (&d[0] * &d[0] + &d[1] * &d[1]);
    let t = max(big(0.0), min(big(1.0), t));
    hypot(&(&v[0] - &t * &d[0]), &(&v[1] - &t * &d[1]))
}

/// Signed distance in local coordinates.
type Form = fn(&[Big; 3]) -> Big;

fn rho(p: &[Big; 3]) -> Big {
    hypot(&p[0], &p[1])
}

fn torus(p: &[Big; 3]) -> Big {
    hypot(&(rho(p) - big(2.0)), &p[2]) - big(0.75)
}

/// The torus from 30 to 210 degrees: its caps are discs in one plane, u the direction of the first.
fn half_torus(p: &[Big; 3]) -> Big {
    let [c, s] = support::oracle::cos_sin_degrees(&big(30.0));
    let (u, v) = (&p[0] * &c + &p[1] * &s, &p[1] * &c - &p[0] * &s);
    let tube = torus(p);
    let in_plane = |u: Big| max(big(0.0), hypot(&(u - big(2.0)), &p[2]) - big(0.75));
    let cap = min(hypot(&v, &in_plane(u.clone())), hypot(&v, &in_plane(-u)));
    if v < big(0.0) {
        return cap;
    }
    if tube <= big(0.0) {
        -min(-tube, cap)
    } else {
        min(tube, cap)
    }
}

fn cylinder(p: &[Big; 3]) -> Big {
    let (r, z) = (rho(p) - big(3.0), abs(&p[2] - big(4.0)) - big(4.0));
    let (zero_r, zero_z) = (max(r.clone(), big(0.0)), max(z.clone(), big(0.0)));
    min(max(r, z), big(0.0)) + hypot(&zero_r, &zero_z)
}

fn cone(p: &[Big; 3]) -> Big {
    let (r, z) = (rho(p), &p[2]);
    let d = min(
        to_segment([&r, z], [2.0, 0.0], [0.0, 6.0]),
        to_segment([&r, z], [0.0, 0.0], [2.0, 0.0]),
    );
    let inside = *z >= big(0.0) && big(3.0) * &r + z <= big(6.0);
    if inside { -d } else { d }
}

fn sphere(p: &[Big; 3]) -> Big {
    hypot(&rho(p), &p[2]) - big(10.0)
}

/// Quarter of a cylinder of radius 1 and height 2: a convex wedge.
fn quarter(p: &[Big; 3]) -> Big {
    let zero = big(0.0);
    let [x, y, z] = p;
    let (dz, r) = (abs(z - big(1.0)) - big(1.0), rho(p));
    let dr = &r - big(1.0);
    if *x >= zero && *y >= zero && dr <= zero && dz <= zero {
        return max(max(dr, dz), max(-x.clone(), -y.clone()));
    }
    // Distance in the plane to the quarter disc.
    let clamp = |t: &Big| max(big(0.0), min(big(1.0), t.clone()));
    let plane = if *x >= zero && *y >= zero {
        max(dr, zero.clone())
    } else {
        let to_x = hypot(&(x - clamp(x)), y);
        let to_y = hypot(x, &(y - clamp(y)));
        min(to_x, to_y)
    };
    hypot(&plane, &max(dz, zero))
}

/// Name, profile, solid, closed form, places of interest.
type Case = (
    &'static str,
    &'static str,
    &'static str,
    Form,
    &'static [[f64; 2]],
);

/// Name, profile, solid, closed form, and places of interest in (r, z): centres, edges, the axis.
const FORMS: [Case; 8] = [
    (
        "torus",
        "curves = [{ kind = 'circle', center = [2, 0], radius = 0.75 }]",
        "",
        torus,
        &[[2.0, 0.0], [0.0, 0.0], [2.75, 0.0], [1.25, 0.0]],
    ),
    (
        "half torus",
        "curves = [{ kind = 'circle', center = [2, 0], radius = 0.75 }]",
        "angle = 180\nstart = 30",
        half_torus,
        &[[2.0, 0.0], [0.0, 0.0], [2.75, 0.0]],
    ),
    (
        "cylinder",
        "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[3, 0], [3, 8]] }]",
        "",
        cylinder,
        &[[3.0, 0.0], [3.0, 8.0], [0.0, 4.0], [0.0, 3.0], [0.0, 0.0]],
    ),
    (
        "cylinder by a spline",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 3, points = [[3, 0], [3, 7], [3, 1], \
         [3, 2], [3, 8]], weights = [1, 5, 0.1, 7, 2] }]",
        "",
        cylinder,
        &[[3.0, 0.0], [3.0, 8.0], [0.0, 4.0], [0.0, 3.0]],
    ),
    (
        "cone",
        "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[2, 0], [0, 6]] }]",
        "",
        cone,
        &[
            [0.0, 6.0],
            [2.0, 0.0],
            [0.0, 1.4415184401122528],
            [0.0, 0.0],
        ],
    ),
    (
        "sphere",
        "boundary = 'to-axis'\ncurves = [{ kind = 'arc', center = [0, 0], radius = 10, from = -90, to = 90 }]",
        "",
        sphere,
        &[[0.0, 0.0], [0.0, 10.0], [0.0, -10.0], [10.0, 0.0]],
    ),
    (
        "sphere by cubics",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[0, -10], [20, -10], [20, 10], [0, 10]], \
         weights = [3, 1, 1, 3] }]",
        "start = 5",
        sphere,
        &[[0.0, 0.0], [0.0, 10.0], [0.0, -10.0], [10.0, 0.0]],
    ),
    (
        "quarter of a cylinder",
        "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[1, 0], [1, 2]] }]",
        "angle = 90",
        quarter,
        &[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 2.0], [0.5, 1.0]],
    ),
];

/// Points of all kinds for one scene.
fn points(scene: &Scene, oracle: &Oracle, special: &[[f64; 2]], count: usize) -> Vec<DVec3> {
    let mut random = Random::new(9);
    let solid = &oracle.solids[0];
    let mut points = Vec::new();
    for at in special {
        for k in 0..12 {
            let (s, c) = (f64::from(k) * std::f64::consts::PI / 6.0).sin_cos();
            for away in [0.0, 1e-17, 1e-15, 1e-12, 1e-8, 1e-4] {
                let r = at[0] + away * random.between(-1.0, 1.0);
                let z = at[1] + away * random.between(-1.0, 1.0);
                points.push(solid.world([r * c, r * s, z]));
            }
        }
    }
    for i in 0..count {
        points.push(if i % 2 == 0 {
            hard_point(oracle, &mut random)
        } else {
            uniform(scene.bounds().min, scene.bounds().max, &mut random)
        });
    }
    points
}

#[test]
fn closed_forms() {
    let mut failures = String::new();
    for (name, profile, keys, form, special) in FORMS {
        let base = format!(
            "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{keys}\n"
        );
        let model = Scene::parse(&base).unwrap_or_else(|e| panic!("{name}: {e}"));
        for (moved, steps) in MOVES {
            let text = scene_text(model.model(), 1.0, steps);
            let scene = Scene::parse(&text).unwrap_or_else(|e| panic!("{name}, {moved}: {e}"));
            let oracle = Oracle::new(scene.model());
            let solid = &oracle.solids[0];
            let size = scene.bounds().longest_side();
            let mut worst = (0.0, DVec3::ZERO, 0.0, 0.0);
            let all = points(&scene, &oracle, special, 600);
            for &p in &all {
                let found = scene.assembly().signed_distance(p);
                let wanted = form(&solid.local(p)) * big(solid.scale_small);
                // Beside the bound of the distance, the rounding of the move.
                let bound =
                    1e-12 * size + 8.0 * f64::EPSILON * (p.length() + solid.origin_small.length());
                let error = small(&(big(found) - &wanted)).abs();
                if error / bound > worst.0 {
                    worst = (error / bound, p, found, small(&wanted));
                }
                if scene.assembly().contains(p) != (found <= 0.0) {
                    failures += &format!("{name}, {moved}: sign at {p:?}: {found:e}\n");
                }
            }
            let (ratio, p, found, wanted) = worst;
            println!(
                "{name:22} {moved:14} {} points, worst error {:.1e} size ({ratio:.1e} of the bound)",
                all.len(),
                (found - wanted).abs() / size,
            );
            if ratio > 1.0 {
                failures += &format!("{name}, {moved} at {p:?}: {found:e}, wanted {wanted:e}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Golden values of MATH's wedge: made there by brute force.
#[test]
fn quarter_of_a_cylinder_at_given_points() {
    let (_, profile, keys, ..) = FORMS[7];
    let scene = Scene::parse(&format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{keys}\n"
    ))
    .expect("scene");
    for (p, wanted, bound) in [
        ([0.5, 0.25, 1.0], -0.25, 1e-12),
        ([-0.5, -0.5, 1.0], std::f64::consts::FRAC_1_SQRT_2, 1e-12),
        ([0.5, -0.3, 1.0], 0.3, 1e-12),
        ([2.0, 2.0, 3.0], 2.084_021_53, 5e-9),
        ([-0.4, 0.5, 2.5], 0.640_312_42, 5e-9),
    ] {
        let found = scene.assembly().signed_distance(DVec3::from_array(p));
        assert!(
            (found - wanted).abs() <= bound,
            "{p:?}: {found}, wanted {wanted}"
        );
    }
}

/// Chords and the controls they come from, for a dense search.
struct Dense {
    parts: Vec<(Vec<[f64; 3]>, [f64; 2], f64)>,
}

impl Dense {
    /// Halves every piece until its control box is at most `extent / 400` wide.
    fn new(solid: &Solid) -> Self {
        let limit = solid.region.extent / 400.0;
        let mut parts = Vec::new();
        let pieces = solid.region.small.iter().flatten();
        let mut stack: Vec<(Vec<[f64; 3]>, u32)> = pieces
            .filter(|piece| !piece.on_axis)
            .map(|piece| (piece.control.clone(), 0))
            .collect();
        while let Some((control, depth)) = stack.pop() {
            let range = |c: usize| {
                let all = control.iter().map(|h| h[c] / h[2]);
                let low = all.clone().fold(f64::INFINITY, f64::min);
                (low, all.fold(-f64::INFINITY, f64::max))
            };
            let (r, z) = (range(0), range(1));
            let reach = (r.1 - r.0).hypot(z.1 - z.0) / 2.0;
            if reach <= limit || depth > 60 {
                parts.push((control, [(r.0 + r.1) / 2.0, (z.0 + z.1) / 2.0], reach));
            } else {
                let (left, right) = halve(&control);
                stack.push((left, depth + 1));
                stack.push((right, depth + 1));
            }
        }
        Self { parts }
    }

    /// Distance of a point about the region's centre.
    fn distance(&self, q: [f64; 2]) -> f64 {
        let gap = |middle: &[f64; 2]| (middle[0] - q[0]).hypot(middle[1] - q[1]);
        let bounds = self
            .parts
            .iter()
            .map(|(_, middle, reach)| gap(middle) + reach);
        let mut best = bounds.fold(f64::INFINITY, f64::min);
        for (control, middle, reach) in &self.parts {
            if gap(middle) - reach <= best {
                best = best.min(refine(control, q));
            }
        }
        best
    }
}

fn halve(control: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let n = control.len();
    let mut p = control.to_vec();
    let (mut left, mut right) = (vec![p[0]], vec![p[n - 1]]);
    for level in 1..n {
        for i in 0..n - level {
            p[i] = std::array::from_fn(|c| 0.5 * (p[i][c] + p[i + 1][c]));
        }
        left.push(p[0]);
        right.push(p[n - 1 - level]);
    }
    right.reverse();
    (left, right)
}

/// The least distance over a short piece: eight golden sections.
fn refine(control: &[[f64; 3]], q: [f64; 2]) -> f64 {
    let at = |t: f64| {
        let p = evaluate(control, t);
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    let mut best = at(0.0).min(at(1.0));
    let golden = 0.618_033_988_749_894_9;
    for part in 0..8 {
        let (mut a, mut b) = (f64::from(part) / 8.0, f64::from(part + 1) / 8.0);
        let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
        let (mut at_c, mut at_d) = (at(c), at(d));
        for _ in 0..40 {
            if at_c < at_d {
                (b, d, at_d) = (d, c, at_c);
                c = b - golden * (b - a);
                at_c = at(c);
            } else {
                (a, c, at_c) = (c, d, at_d);
                d = a + golden * (b - a);
                at_d = at(d);
            }
        }
        best = best.min(at_c).min(at_d);
    }
    best
}

/// Unsigned distance to the surface of one solid.
fn brute(solid: &Solid, dense: &Dense, p: DVec3) -> f64 {
    let [x, y, z] = solid.local(p);
    let center = solid.region.center;
    let (h, cz) = (small(&(z.clone() - big(center[1]))), big(center[0]));
    let rho = hypot(&x, &y);
    let lateral = dense.distance([small(&(&rho - &cz)), h]);
    let [start, angle] = solid.turn;
    if angle == 360.0 {
        return lateral * solid.scale_small;
    }
    let mut best = f64::INFINITY;
    let mut sides = Vec::new();
    for degrees in [big(start), big(start) + big(angle)] {
        let [c, s] = support::oracle::cos_sin_degrees(&degrees);
        let (along, aside) = (&x * &c + &y * &s, &y * &c - &x * &s);
        let off = if along >= big(0.0) && solid.region.contains(&[along.clone(), z.clone()]) {
            0.0
        } else {
            // The region may lie along the axis: its closure there is met through r = 0.
            let mut off = dense.distance([small(&(&along - &cz)), h]);
            if along < big(0.0) && solid.region.contains(&[big(0.0), z.clone()]) {
                off = off.min(-small(&along));
            }
            off
        };
        sides.push(small(&aside));
        best = best.min(off.hypot(small(&aside)));
    }
    let within = if angle > 180.0 {
        sides[0] >= 0.0 || sides[1] <= 0.0
    } else {
        sides[0] >= 0.0 && sides[1] <= 0.0
    };
    if within {
        best = best.min(lateral);
    }
    best * solid.scale_small
}

#[test]
fn dense_search() {
    let mut failures = String::new();
    for (name, scene) in hard::shipped().into_iter().chain(hard::scenes(false)) {
        let oracle = Oracle::new(scene.model());
        let dense: Vec<Dense> = oracle.solids.iter().map(Dense::new).collect();
        let size = scene.bounds().longest_side();
        let mut worst = (0.0, DVec3::ZERO, 0.0, 0.0);
        let mut compared = 0;
        for p in points(&scene, &oracle, &[], 160) {
            let found = scene.assembly().signed_distance(p);
            if scene.assembly().contains(p) != (found <= 0.0) {
                failures += &format!("{name}: sign at {p:?}: {found:e}\n");
            }
            // Inside several solids the distance may be a lower bound.
            if oracle.solids.len() > 1 && found <= 0.0 {
                continue;
            }
            let solids = oracle.solids.iter().zip(&dense);
            let wanted = solids.map(|(solid, dense)| brute(solid, dense, p));
            let wanted = wanted.fold(f64::INFINITY, f64::min);
            let origin = oracle.solids[0].origin_small.length();
            let bound = 1e-10 * size + 8.0 * f64::EPSILON * (p.length() + origin);
            if !oracle.is_union() {
                // The surface is among those of the solids, so that none is nearer than the least.
                if found.abs() < wanted - bound {
                    failures += &format!("{name} at {p:?}: {found:e}, at least {wanted:e}\n");
                }
                continue;
            }
            compared += 1;
            let error = (found.abs() - wanted).abs();
            if error.is_nan() || error / bound > worst.0 {
                worst = (error / bound, p, found, wanted);
            }
        }
        let (ratio, p, found, wanted) = worst;
        println!(
            "{name:36} {compared} points, worst error {:.1e} size ({ratio:.1e} of the bound)",
            (found.abs() - wanted).abs() / size,
        );
        if ratio.is_nan() || ratio > 1.0 {
            failures += &format!("{name} at {p:?}: {found:e}, wanted {wanted:e}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn far_points_are_finite() {
    let mut failures = String::new();
    for (name, scene) in hard::shipped().into_iter().chain(hard::scenes(true)) {
        let size = scene.bounds().longest_side();
        let middle = (scene.bounds().min + scene.bounds().max) / 2.0;
        let mut random = Random::new(4);
        for power in [
            3, 6, 9, 15, 20, 50, 100, 140, 150, 153, 155, 160, 200, 250, 300,
        ] {
            for _ in 0..4 {
                let d = DVec3::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)));
                let far = size * 10_f64.powi(power);
                if !far.is_finite() {
                    continue;
                }
                for p in [
                    middle + d * far,
                    DVec3::new(0.0, 0.0, far),
                    DVec3::new(far, 0.0, 0.0),
                ] {
                    let found = scene.assembly().signed_distance(p);
                    // To a point of the solid it is the length within the solid's reach.
                    let m = p.abs().max_element();
                    let wanted = m * ((p - middle) / m).length();
                    let bound = 2.0 * size + 1e-14 * wanted;
                    if found.is_nan()
                        || (found - wanted).abs() > bound
                        || scene.assembly().contains(p)
                    {
                        failures += &format!("{name} at {p:?}: {found:e}, wanted {wanted:e}\n");
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
