//! Membership in images of NURBS volumes, against closed forms.

mod patch_nets;

use glam::DVec3;
use patch_nets::*;
use voxlathe::math::Side;
use voxlathe::patch::Cells;

fn band(size: f64, p: DVec3) -> f64 {
    8.0 * f64::EPSILON * (size + p.length())
}

/// Mean, median, 99 % and largest.
fn times(mut t: Vec<f64>) -> String {
    t.sort_by(f64::total_cmp);
    let at = |q: f64| t[((t.len() - 1) as f64 * q) as usize];
    let mean = t.iter().sum::<f64>() / t.len() as f64;
    format!(
        "mean {mean:.2}, median {:.2}, 99 % {:.1}, most {:.0}",
        at(0.5),
        at(0.99),
        at(1.0)
    )
}

#[test]
fn random_points_and_points_near_the_surface() {
    let mut random = Random(1);
    for solid in solids() {
        let start = std::time::Instant::now();
        let cells = Cells::new(&solid.volumes).expect("valid");
        let built = start.elapsed();
        let (mut wrong, mut decided) = (Vec::new(), 0);
        let mut check = |p: DVec3, times: &mut Vec<f64>| {
            let start = std::time::Instant::now();
            let found = side(&cells, p);
            times.push(start.elapsed().as_secs_f64() * 1e6);
            let d = (solid.sdf)(p);
            if d.abs() > band(solid.size, p) {
                decided += 1;
                if (found != Side::Outside) != (d < 0.0) || found == Side::On {
                    wrong.push((p, d, found));
                }
            }
        };
        let (mut anywhere, mut near) = (Vec::new(), Vec::new());
        for _ in 0..4000 {
            let reach = 0.75 * solid.size;
            let p = DVec3::from_array(std::array::from_fn(|_| random.within(-reach, reach)));
            check(p, &mut anywhere);
        }
        for i in 0..4000 {
            let (p, n) = (solid.surface)(&mut random);
            let d = 10f64.powf(random.within(-16.0, -1.0)) * solid.size;
            check(p + n * if i % 2 == 0 { d } else { -d }, &mut near);
        }
        eprintln!(
            "{:22} {} cells, {:6} leaves, built in {built:.1?}; {decided} decided; us {}, near {}",
            solid.name,
            cells.len(),
            cells.leaves(),
            times(anywhere),
            times(near),
        );
        assert!(
            wrong.is_empty(),
            "{}: {} wrong, {:?}",
            solid.name,
            wrong.len(),
            &wrong[..wrong.len().min(4)]
        );
    }
}

/// Heights are parameters of construction a and c here, so caps are exact.
#[test]
fn caps_axes_and_centres() {
    let tube = line([1.0, 0.0], [1.0, 2.0]);
    let full = circle();
    for (name, volume) in [("a", by_disc(&tube)), ("c", by_axis(&tube, &full))] {
        let cells = Cells::new(&[volume]).expect("valid");
        for x in [0.0, 1e-300, -1e-17, 1e-9, 0.25, -0.5, 0.875] {
            for y in [0.0, -1e-16, 1e-12, 0.125, -0.375] {
                let at = |z: f64| side(&cells, DVec3::new(x, y, z));
                assert_eq!(at(1.0), Side::Inside, "{name} at {x} {y}");
                assert_eq!(at(0.0), Side::On, "{name} at {x} {y}");
                assert_eq!(at(2.0), Side::On, "{name} at {x} {y}");
                // Far below the rounding of f64 the double-double path still decides.
                if f64::hypot(x, y) > 1e-3 {
                    assert_eq!(at(-1e-20), Side::Outside, "{name} at {x} {y}");
                    assert_eq!(at(1e-20), Side::Inside, "{name} at {x} {y}");
                }
                assert_eq!(at(-1e-14), Side::Outside, "{name} at {x} {y}");
                assert_eq!(at(2.0 + 1e-14), Side::Outside, "{name} at {x} {y}");
                assert_eq!(at(2.0 - 1e-14), Side::Inside, "{name} at {x} {y}");
            }
        }
    }
}

#[test]
fn seams_and_shared_faces_are_inside() {
    let full = circle();
    let tube = line([1.0, 0.0], [1.0, 2.0]);
    let spline = by_axis(&tube, &full);
    let cells = Cells::new(&[spline]).expect("valid");
    let ring = Cells::new(&[torus(2.0, 0.75, &full)]).expect("valid");
    for i in 1..64 {
        let r = i as f64 / 64.0;
        for (x, y) in [(r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r)] {
            for z in [0.5, 1.0, 1.984_375] {
                assert_eq!(
                    side(&cells, DVec3::new(x, y, z)),
                    Side::Inside,
                    "{x} {y} {z}"
                );
            }
            let (x, y) = (
                x + 2.0 * x.signum() * x.abs().min(1.0).ceil(),
                y + 2.0 * y.signum() * y.abs().min(1.0).ceil(),
            );
            let p = DVec3::new(x, y, 0.0);
            let inside = p.length() < 2.75;
            if p.length() != 2.75 {
                assert_eq!(side(&ring, p) == Side::Inside, inside, "{p}");
            }
        }
    }
    // Two halves of a cylinder and two storeys: faces of different volumes, one turned round.
    let half = |turn: f64| {
        mapped(&by_axis(&tube, &arc(std::f64::consts::PI)), |[x, y, z]| {
            [turn * x, turn * y, z]
        })
    };
    let lower = [half(1.0), half(-1.0)];
    let upper = lower
        .each_ref()
        .map(|v| mapped(v, |[x, y, z]| [x, y, 4.0 - z]));
    let all: Vec<_> = lower.into_iter().chain(upper).collect();
    let cells = Cells::new(&all).expect("valid");
    for i in -31..32 {
        let x = i as f64 / 32.0;
        for z in [0.5, 1.0, 2.0, 3.0, 3.5] {
            // The seam, the floor between the storeys, the axis, and the line where they meet.
            assert_eq!(side(&cells, DVec3::new(x, 0.0, z)), Side::Inside, "{x} {z}");
        }
        if x.abs() < 0.7 {
            assert_eq!(side(&cells, DVec3::new(x, 0.25, 2.0)), Side::Inside, "{x}");
        }
        for z in [0.0, 4.0] {
            assert_eq!(side(&cells, DVec3::new(x, 0.0, z)), Side::On, "{x} {z}");
        }
    }
}

/// Points around the four places of the biquadratic rim where the map folds flat, around poles and
/// apexes: outside of the band no answer may be wrong, however near.
#[test]
fn rims_poles_and_apexes() {
    let mut random = Random(7);
    let corners: Vec<f64> = (0..4)
        .map(|i| i as f64 * std::f64::consts::FRAC_PI_2)
        .collect();
    let places = |name: &str, random: &mut Random| -> DVec3 {
        let corner = corners[(random.unit() * 4.0) as usize];
        let phi = corner + random.within(-1.0, 1.0) * 10f64.powf(random.within(-12.0, -1.0));
        let (s, c) = phi.sin_cos();
        let u = random.within(-1.0, 1.0);
        match name.split(' ').next().expect("name") {
            "cylinder" => DVec3::new(c, s, [0.0, 1.0 + u, 2.0][(random.unit() * 3.0) as usize]),
            "cone" if random.unit() < 0.4 => DVec3::Z,
            "cone" => DVec3::new(c * (0.5 + 0.5 * u), s * (0.5 + 0.5 * u), 0.5 - 0.5 * u),
            "sphere" if random.unit() < 0.4 => DVec3::Z * u.signum(),
            "sphere" => DVec3::new(c * (1.0 - u * u).sqrt(), s * (1.0 - u * u).sqrt(), u),
            // The corners of the meridian disc are at multiples of 90 degrees.
            _ => {
                let turn = random.within(0.0, 7.0);
                DVec3::new(
                    (2.0 + 0.75 * c) * turn.cos(),
                    (2.0 + 0.75 * c) * turn.sin(),
                    0.75 * s,
                )
            }
        }
    };
    for solid in solids() {
        if solid.name.contains("turned") {
            continue;
        }
        let cells = Cells::new(&solid.volumes).expect("valid");
        let (mut decided, mut worst) = (0, Vec::new());
        for _ in 0..1500 {
            let d = 10f64.powf(random.within(-16.0, -2.0)) * solid.size;
            let p = places(&solid.name, &mut random) + d * random.direction();
            let start = std::time::Instant::now();
            let found = side(&cells, p);
            worst.push(start.elapsed().as_secs_f64() * 1e6);
            let d = (solid.sdf)(p);
            if d.abs() > band(solid.size, p) {
                decided += 1;
                assert_eq!(
                    found == Side::Inside,
                    d < 0.0,
                    "{} at {p:?}, {d:e}: {found:?}",
                    solid.name
                );
                assert_ne!(found, Side::On, "{} at {p:?}, {d:e}", solid.name);
            }
        }
        eprintln!("{:12} {decided} decided; us {}", solid.name, times(worst));
    }
    // The places themselves.
    let tube = Cells::new(&[by_disc(&line([1.0, 0.0], [1.0, 2.0]))]).expect("valid");
    let cone = Cells::new(&[by_disc(&line([1.0, 0.0], [0.0, 1.0]))]).expect("valid");
    let ball = Cells::new(&[by_disc(&meridian(1.0))]).expect("valid");
    assert_eq!(side(&cone, DVec3::Z), Side::On);
    assert_eq!(side(&ball, DVec3::Z), Side::On);
    assert_eq!(side(&ball, -DVec3::Z), Side::On);
    assert_eq!(side(&ball, DVec3::ZERO), Side::Inside);
    assert_eq!(side(&tube, DVec3::new(0.0, 0.0, 1.0)), Side::Inside);
}

/// Other nets of the same solid give the same answers, at other scales and places too.
#[test]
fn other_nets_of_the_same_solid() {
    let full = circle();
    let base = torus(2.0, 0.75, &full);
    let permuted = |v: &voxlathe::nurbs::NurbsVolume| {
        // (u, v, w) becomes (w, u, v) with u the other way.
        let [a, b, c] = v.counts();
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for j in 0..b {
            for i in (0..a).rev() {
                for k in 0..c {
                    let at = i + a * (j + b * k);
                    points.push(v.control_points()[at]);
                    weights.push(v.weights()[at] * 3.0);
                }
            }
        }
        let [u, w, z] = v.knots().clone();
        let u = u.reversed().expect("valid");
        voxlathe::nurbs::NurbsVolume::new([z, u, w], points, weights).expect("valid")
    };
    let mut random = Random(3);
    for (scale, offset) in [
        (1.0, 0.0),
        (1e-6, 0.0),
        (1e6, 0.0),
        (1.0, 1e6),
        (1e-6, 1.0),
        (1e6, -1e6),
    ] {
        let place =
            |[x, y, z]: [f64; 3]| [x * scale + offset, y * scale - offset, z * scale + offset];
        let nets = [mapped(&base, place), mapped(&permuted(&base), place)];
        let cells = nets.map(|v| Cells::new(&[v]).expect("valid"));
        for _ in 0..3000 {
            let (phi, t) = (random.within(0.0, 7.0), random.within(0.0, 7.0));
            let r = 0.75 + random.within(-1.0, 1.0) * 10f64.powf(random.within(-16.0, 0.0));
            let rho = 2.0 + r * t.cos();
            let q = DVec3::from_array(place([rho * phi.cos(), rho * phi.sin(), r * t.sin()]));
            // Back in the torus' own coordinates: exact differences, one rounding each.
            let p = (q - DVec3::new(offset, -offset, offset)) / scale;
            let d = f64::hypot(f64::hypot(p.x, p.y) - 2.0, p.z) - 0.75;
            // The control points are rounded where they are placed.
            if d.abs() * scale > band(5.5 * scale, q) {
                for c in &cells {
                    assert_eq!(
                        side(c, q) == Side::Inside,
                        d < 0.0,
                        "{scale} {offset}: {d:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn answers_do_not_depend_on_order() {
    let mut random = Random(11);
    for solid in solids() {
        let cells = Cells::new(&solid.volumes).expect("valid");
        let points: Vec<DVec3> = (0..400)
            .map(|i| {
                let (p, n) = (solid.surface)(&mut random);
                p + n * [0.0, 1e-16, -1e-16, 1e-15][i % 4]
            })
            .collect();
        let there: Vec<_> = points.iter().map(|&p| side(&cells, p)).collect();
        let copy = cells.clone();
        let mut back: Vec<_> = points.iter().rev().map(|&p| side(&copy, p)).collect();
        back.reverse();
        assert_eq!(there, back, "{}", solid.name);
    }
}

#[test]
fn preimages_are_preimages() {
    let mut random = Random(5);
    for solid in solids() {
        let cells = Cells::new(&solid.volumes).expect("valid");
        let mut found = 0;
        for _ in 0..1000 {
            let reach = 0.6 * solid.size;
            let p = DVec3::from_array(std::array::from_fn(|_| random.within(-reach, reach)));
            let preimage = cells.invert(p);
            assert_eq!(
                preimage.is_some(),
                side(&cells, p) != Side::Outside,
                "{}",
                solid.name
            );
            assert_eq!(preimage, cells.invert(p));
            if let Some(f) = preimage {
                found += 1;
                let q = solid.volumes[f.volume]
                    .evaluate(f.parameters)
                    .expect("in the domain");
                let off = (DVec3::from_array(q) - p).length();
                assert!(off <= 1e-13 * solid.size, "{} at {p}: {off:e}", solid.name);
            }
        }
        assert!(found > 10, "{}", solid.name);
    }
}

/// The same map with the degree of one parameter raised; Bezier nets only.
fn elevated(v: &voxlathe::nurbs::NurbsVolume, axis: usize) -> voxlathe::nurbs::NurbsVolume {
    let counts = v.counts();
    let net = v.to_homogeneous();
    let stride: usize = counts[..axis].iter().product();
    let n = counts[axis];
    let mut more = Vec::new();
    for at in 0..net.len() / n * (n + 1) {
        let (inner, i, outer) = (at % stride, at / stride % (n + 1), at / stride / (n + 1));
        let get = |i: usize| net[inner + (i + outer * n) * stride];
        let a = i as f64 / n as f64;
        more.push(match i {
            0 => get(0),
            i if i == n => get(n - 1),
            i => get(i - 1).mix(a, get(i), 1.0 - a),
        });
    }
    let mut knots = v.knots().clone();
    knots[axis] = voxlathe::nurbs::KnotVector::bezier(n).expect("degree");
    voxlathe::nurbs::NurbsVolume::from_homogeneous(knots, &more).expect("valid")
}

#[test]
fn high_degrees() {
    let mut volume = by_disc(&line([1.0, 0.0], [1.0, 2.0]));
    for (axis, times) in [(0, 2), (1, 5), (2, 3)] {
        for _ in 0..times {
            volume = elevated(&volume, axis);
        }
    }
    assert_eq!(volume.degrees(), [3, 7, 5]);
    let mut bar = by_disc(&line([1.0, 0.0], [1.0, 2.0]));
    while bar.degrees()[0] < 32 {
        bar = elevated(&bar, 0);
    }
    let tube = solids().swap_remove(0);
    for volume in [volume, bar] {
        let degrees = volume.degrees();
        let cells = Cells::new(&[volume]).expect("valid");
        let mut random = Random(2);
        let mut spent = Vec::new();
        for i in 0..1000 {
            let (p, n) = (tube.surface)(&mut random);
            let p = p + n * (random.within(-1.0, 1.0) * 10f64.powf(-16.0 * (i % 16) as f64 / 16.0));
            let d = (tube.sdf)(p);
            let start = std::time::Instant::now();
            let found = side(&cells, p);
            spent.push(start.elapsed().as_secs_f64() * 1e6);
            // Elevation rounds the net: a few units in the last place for each step.
            if d.abs() > 8.0 * band(2.0, p) {
                assert_eq!(found == Side::Inside, d < 0.0, "{degrees:?} at {p}: {d:e}");
            }
        }
        eprintln!(
            "{degrees:?}: {} leaves; us {}",
            cells.leaves(),
            times(spent)
        );
    }
}

/// Perturbed boxes of degree (2, 3, 2) with random weights: points made by evaluation are inside,
/// points across a face go by its normal, others by the winding number of a dense tessellation.
#[test]
fn perturbed_volumes() {
    use voxlathe::nurbs::{KnotVector, NurbsVolume};
    let mut random = Random(17);
    for round in 0..4 {
        let knots = [(2, 4), (3, 4), (2, 3)]
            .map(|(p, n)| KnotVector::clamped_uniform(p, n).expect("valid"));
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for k in 0..3 {
            for j in 0..4 {
                for i in 0..4 {
                    let x = [i as f64 / 3.0, j as f64 / 3.0, k as f64 / 2.0];
                    points.push(x.map(|c| c + random.within(-0.06, 0.06)));
                    weights.push(random.within(0.7, 1.4));
                }
            }
        }
        // Odd rounds are mirrored: the determinant is negative.
        if round % 2 == 1 {
            for p in &mut points {
                p[0] = -p[0];
            }
        }
        let volume = NurbsVolume::new(knots, points, weights).expect("valid");
        let cells = Cells::new(std::slice::from_ref(&volume)).expect("valid");
        let at = |t: [f64; 3]| DVec3::from_array(volume.evaluate(t).expect("in the domain"));
        let mut spent = Vec::new();
        for _ in 0..500 {
            let t = std::array::from_fn(|_| random.within(1e-12, 1.0 - 1e-12));
            let p = at(t);
            assert_eq!(side(&cells, p), Side::Inside, "{t:?}");
            let found = cells.invert(p).expect("inside").parameters;
            assert!(
                (0..3).all(|k| (found[k] - t[k]).abs() < 1e-12),
                "{found:?} for {t:?}"
            );
        }
        for i in 0..1500 {
            let (axis, end) = (i % 3, f64::from(i as u32 / 3 % 2));
            let mut t = std::array::from_fn(|_| random.within(0.01, 0.99));
            t[axis] = end;
            let (x, slopes) = volume.gradient(t).expect("in the domain");
            let [a, b, c] =
                [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| DVec3::from_array(slopes[k]));
            let normal = b.cross(c).normalize();
            let outward = normal * (normal.dot(a).signum() * (2.0 * end - 1.0));
            let d = 10f64.powf(random.within(-14.0, -3.0));
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let p = DVec3::from_array(x) + outward * (sign * d);
            if d > band(1.3, p) {
                let start = std::time::Instant::now();
                let found = side(&cells, p);
                spent.push(start.elapsed().as_secs_f64() * 1e6);
                assert_eq!(
                    found == Side::Inside,
                    sign < 0.0,
                    "round {round}, {t:?}, {d:e}"
                );
            }
        }
        eprintln!(
            "round {round}: {} leaves; us {}",
            cells.leaves(),
            times(spent)
        );
        let n = 24;
        let mut triangles = Vec::new();
        for face in 0..6 {
            let (axis, end) = (face % 3, (face / 3) as f64);
            let corner = |i: usize, j: usize| {
                let mut t = [end; 3];
                t[(axis + 1) % 3] = i as f64 / n as f64;
                t[(axis + 2) % 3] = j as f64 / n as f64;
                at(t)
            };
            for i in 0..n {
                for j in 0..n {
                    let q = [
                        corner(i, j),
                        corner(i + 1, j),
                        corner(i + 1, j + 1),
                        corner(i, j + 1),
                    ];
                    for t in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
                        triangles.push(if end == 1.0 { t } else { [t[0], t[2], t[1]] });
                    }
                }
            }
        }
        let mut checked = 0;
        for _ in 0..150 {
            let mut p = DVec3::from_array(std::array::from_fn(|_| random.within(-0.3, 1.3)));
            if round % 2 == 1 {
                p.x = -p.x;
            }
            let mut winding = 0.0;
            let mut nearest = f64::INFINITY;
            for t in &triangles {
                let [a, b, c] = t.map(|v| v - p);
                nearest = nearest.min(a.length());
                let (la, lb, lc) = (a.length(), b.length(), c.length());
                let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
                winding += a.dot(b.cross(c)).atan2(below) / std::f64::consts::TAU;
            }
            if nearest > 0.05 {
                checked += 1;
                assert_eq!(side(&cells, p) == Side::Inside, winding.abs() > 0.5, "{p}");
            }
        }
        assert!(checked > 60);
    }
}
