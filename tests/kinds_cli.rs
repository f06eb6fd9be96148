//! Ellipsoids, boxes, round shapes and volumes through the command: closed forms at odd scales and
//! places, points exactly on faces, nets moved by hand, channels of fields, files of every format, and
//! input that must be refused with its place.

#[path = "support/command.rs"]
mod support;

use std::f64::consts::PI;
use std::fs;
use std::time::Duration;

use serde_json::Value;
use support::{Run, Stack, below, query, run, run_within, scratch};

/// How long one run may take: they are all small.
const LIMIT: Duration = Duration::from_secs(60);

/// Numbers in (0, 1), the same every time.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }
}

type Point = [f64; 3];
type Distance = fn(Point) -> f64;

fn torus(p: Point) -> f64 {
    (p[0].hypot(p[1]) - 3.0).hypot(p[2]) - 1.0
}

/// Radius 2, height 3, from z = 0.
fn cylinder(p: Point) -> f64 {
    let d = [p[0].hypot(p[1]) - 2.0, (p[2] - 1.5).abs() - 1.5];
    d[0].max(d[1]).min(0.0) + d[0].max(0.0).hypot(d[1].max(0.0))
}

/// Radii 2 and 1/2, height 3, from z = 0: a convex quadrilateral of the half-plane.
fn cone(p: Point) -> f64 {
    let q = [p[0].hypot(p[1]), p[2]];
    let corners = [[0.0, 0.0], [2.0, 0.0], [0.5, 3.0], [0.0, 3.0]];
    let mut inside = true;
    let mut nearest = f64::INFINITY;
    for k in 0..3 {
        let (a, b) = (corners[k], corners[k + 1]);
        let (e, f) = ([b[0] - a[0], b[1] - a[1]], [q[0] - a[0], q[1] - a[1]]);
        inside &= e[0] * f[1] - e[1] * f[0] >= 0.0;
        let t = ((e[0] * f[0] + e[1] * f[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
        nearest = nearest.min((f[0] - t * e[0]).hypot(f[1] - t * e[1]));
    }
    if inside { -nearest } else { nearest }
}

fn sphere(p: Point) -> f64 {
    p[0].hypot(p[1]).hypot(p[2]) - 2.0
}

/// Sides 2, 3 and 4.
fn block(p: Point) -> f64 {
    let d = [p[0].abs() - 1.0, p[1].abs() - 1.5, p[2].abs() - 2.0];
    let out = d.map(|v| v.max(0.0));
    d[0].max(d[1]).max(d[2]).min(0.0) + out[0].hypot(out[1]).hypot(out[2])
}

const S: &str = "0.7071067811865476";

/// The torus by construction b.
fn torus_section() -> String {
    let d = 2.0_f64.sqrt();
    let s = 0.5_f64.sqrt();
    let rows = [
        [[-s, -s], [-d, 0.0], [-s, s]],
        [[0.0, -d], [0.0, 0.0], [0.0, d]],
        [[s, -s], [d, 0.0], [s, s]],
    ];
    let points = rows.as_flattened().iter();
    let points: Vec<String> = points
        .map(|[x, z]| format!("[{:?}, {z:?}]", 3.0 + x))
        .collect();
    format!(
        "section = {{ degrees = [2, 2], knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1]], points = [{}], \
         weights = [1, {S}, 1, {S}, 1, {S}, 1, {S}, 1] }}",
        points.join(", ")
    )
}

const PROFILES: &str = "schema = 1\n[profiles.wall]\nboundary = 'to-axis'\n\
    curves = [{ kind = 'polyline', points = [[2, 0], [2, 3]] }]\n\
    [profiles.slope]\nboundary = 'to-axis'\n\
    curves = [{ kind = 'polyline', points = [[0.5, 3], [2, 0]] }]\n";

/// Name, keys, closed form and volume of solids within 4 of the origin.
fn kinds() -> Vec<(&'static str, String, Distance, f64)> {
    let volume = |keys: &str| format!("kind = 'volume'\n{keys}");
    vec![
        (
            "torus",
            "kind = 'torus'\nmajor = 3\nminor = 1".into(),
            torus,
            6.0 * PI * PI,
        ),
        (
            "cylinder",
            "kind = 'cylinder'\nradius = 2\nheight = 3".into(),
            cylinder,
            12.0 * PI,
        ),
        (
            "cone",
            "kind = 'cone'\nradius1 = 2\nradius2 = 0.5\nheight = 3".into(),
            cone,
            5.25 * PI,
        ),
        (
            "sphere",
            "kind = 'sphere'\nradius = 2".into(),
            sphere,
            32.0 / 3.0 * PI,
        ),
        ("box", "kind = 'box'\nsize = [2, 3, 4]".into(), block, 24.0),
        (
            "round ellipsoid",
            "kind = 'ellipsoid'\nradii = [2, 2, 2]".into(),
            sphere,
            32.0 / 3.0 * PI,
        ),
        (
            "construction a",
            volume("construct = 'curve-disc'\nprofile = 'wall'"),
            cylinder,
            12.0 * PI,
        ),
        (
            "construction b",
            volume(&format!(
                "construct = 'surface-circle'\n{}",
                torus_section()
            )),
            torus,
            6.0 * PI * PI,
        ),
        (
            "construction c, falling",
            volume("construct = 'curve-ruled'\nprofile = 'slope'"),
            cone,
            5.25 * PI,
        ),
        (
            "patch",
            volume(
                "patches = [{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [-1, -1, 5, 5], [2, 2, 3, 3]], \
                 points = [[-1, -1.5, -2], [1, -1.5, -2], [-1, 1.5, -2], [1, 1.5, -2], \
                 [-1, -1.5, 2], [1, -1.5, 2], [-1, 1.5, 2], [1, 1.5, 2]] }]",
            ),
            block,
            24.0,
        ),
    ]
}

fn scene(keys: &str) -> String {
    format!("{PROFILES}[[solid]]\n{keys}\n")
}

fn in_file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = below(folder, name);
    fs::write(&path, text).expect("a scene");
    path
}

/// Points around the solid, on its symmetry planes, its axis, its faces, edges and corners.
fn places(seed: u64) -> Vec<Point> {
    let mut next = uniform(seed);
    let mut points: Vec<Point> = (0..60)
        .map(|_| std::array::from_fn(|_| 10.0 * next() - 5.0))
        .collect();
    let special = [-4.0, -3.0, -2.0, -1.5, -1.0, 0.0, 1.0, 1.5, 2.0, 3.0, 4.0];
    let mut pick = || special[(next() * 11.0) as usize];
    points.extend((0..140).map(|_| [pick(), pick(), pick()]));
    points
}

#[test]
fn every_kind_is_its_closed_form_at_every_scale_and_place() {
    let folder = scratch();
    let mut worst = (0.0, String::new());
    for (name, keys, distance, volume) in kinds() {
        for (scale, by) in [
            (1.0, [0.0; 3]),
            (2.0_f64.powi(-20), [0.0; 3]),
            (2.0_f64.powi(20), [0.0; 3]),
            (1.0, [1_048_576.0, -1_048_576.0, 1_048_576.0]),
        ] {
            let place = format!("place = [{{ scale = {scale:?} }}, {{ translate = {by:?} }}]");
            let text = scene(&format!("{keys}\n{place}"));
            let path = in_file(&folder, "s.toml", &text);
            // Scales and offsets are powers of two, so that these are the same points exactly.
            let points = places(5);
            let moved: Vec<Point> = (points.iter())
                .map(|p| std::array::from_fn(|k| scale * p[k] + by[k]))
                .collect();
            let reach = by[0].abs().max(5.0 * scale);
            for (p, (inside, sdf)) in points.iter().zip(query(&path, &[], &moved)) {
                let wanted = scale * distance(*p);
                let bound = 1e-13 * 10.0 * scale + 8.0 * f64::EPSILON * reach;
                let off = (sdf - wanted).abs();
                assert!(
                    off <= bound,
                    "{name} x {scale} + {by:?} at {p:?}: {sdf}, wanted {wanted}"
                );
                if off / bound > worst.0 {
                    worst = (off / bound, format!("{name} x {scale} + {by:?} at {p:?}"));
                }
                assert_eq!(inside, sdf <= 0.0, "{name} at {p:?}: {sdf}");
                if wanted.abs() > bound {
                    assert_eq!(inside, wanted < 0.0, "{name} at {p:?}");
                }
            }
            let d = run(&["measure", &path, "--json"]).exits(0).json();
            let found = d["total"]["volume"].as_f64().expect("a volume");
            let estimate = d["total"]["error_estimate"]["volume"]
                .as_f64()
                .expect("an estimate");
            let exact = volume * scale.powi(3);
            assert!(
                (found - exact).abs() <= estimate + 4e-15 * exact && estimate <= 1e-12 * exact,
                "{name} x {scale}: {found} +- {estimate}, wanted {exact}"
            );
        }
    }
    eprintln!("worst {:.2} of the bound: {}", worst.0, worst.1);
}

/// Where the numbers of the solid are dyadic, a point on a face is on it exactly, and the solid is
/// closed.
#[test]
fn points_exactly_on_faces_are_inside() {
    let folder = scratch();
    let on: [(&str, Vec<Point>); 4] = [
        (
            "box",
            vec![
                [1.0, 0.3, 0.7],
                [-1.0, 1.5, 2.0],
                [0.1, -1.5, -2.0],
                [0.0, 0.0, 2.0],
            ],
        ),
        (
            "patch",
            vec![
                [1.0, 0.3, 0.7],
                [-1.0, 1.5, 2.0],
                [0.1, -1.5, -2.0],
                [0.0, 0.0, 2.0],
            ],
        ),
        (
            "construction a",
            vec![
                [0.0, 0.0, 0.0],
                [0.3, 0.4, 3.0],
                [2.0, 0.0, 1.0],
                [0.0, -2.0, 3.0],
                [1.2, 1.6, 0.5],
            ],
        ),
        (
            "construction c, falling",
            vec![
                [0.0, 0.0, 0.0],
                [0.3, 0.4, 3.0],
                [2.0, 0.0, 0.0],
                [0.0, -0.5, 3.0],
                [0.0, 1.25, 1.5],
            ],
        ),
    ];
    for (name, keys, distance, _) in kinds() {
        let Some((_, points)) = on.iter().find(|o| o.0 == name) else {
            continue;
        };
        let path = in_file(&folder, "s.toml", &scene(&keys));
        for (p, (inside, sdf)) in points.iter().zip(query(&path, &[], points)) {
            assert_eq!(distance(*p), 0.0, "{name}: {p:?} is not on the surface");
            // The net of a disc has irrational weights: its wall is round but for rounding, its caps
            // are flat.
            let flat = p[2] == 0.0 || p[2] == 3.0;
            if name == "box" || name == "patch" || flat && p[0].hypot(p[1]) < 0.5 {
                assert!(inside, "{name} at {p:?}: {sdf}");
            }
            assert!(sdf.abs() <= 1e-15, "{name} at {p:?}: {sdf}");
        }
    }
}

fn dims(stack: &Stack) -> usize {
    stack.dims.iter().product()
}

/// Row by row and point by point there is one answer, with voxel centres on the faces too.
#[test]
fn grids_of_primes_agree_with_query() {
    let folder = scratch();
    for (name, keys, _, volume) in kinds() {
        let path = in_file(&folder, "s.toml", &scene(&keys));
        for grid in [
            "grid={origin=[-4.3,-4.1,-3.7],spacing=[0.67,0.61,0.53],dims=[13,13,13]}",
            // Centres at multiples of 1/2: faces, caps, the axis.
            "grid={origin=[-4.25,-3.25,-2.25],spacing=[0.5,0.5,0.5],dims=[17,13,11]}",
        ] {
            let out = below(&folder, "out");
            let arguments = [
                "voxelize", &path, "-o", &out, "--force", "--json", "--set", grid,
            ];
            let d = run(&arguments).exits(0).json();
            assert!(
                (d["volume_exact"].as_f64().expect("a volume") - volume).abs() < 1e-12 * volume
            );
            let stack = Stack::read(&out);
            let values = query(&path, &[], &stack.centres());
            let (occupancy, sdf) = (stack.channel("occupancy"), stack.channel("sdf"));
            let fraction = stack.channel("fraction");
            for i in 0..dims(&stack) {
                let (inside, distance) = values[i];
                let at = stack.centres()[i];
                assert_eq!(
                    occupancy[i],
                    f32::from(u8::from(inside)),
                    "{name} at {at:?}"
                );
                let stored = f64::from(sdf[i]);
                // On a face the distance is rounding, and may be another in a row than at a point.
                let ulps = 2.0 * f64::from(f32::EPSILON) * distance.abs();
                let bound = ulps.max(1e-4 * 0.5) + 1e-15;
                assert!(
                    (stored - distance).abs() <= bound,
                    "{name} at {at:?}: {stored} {distance}"
                );
                assert!((0.0..=1.0).contains(&fraction[i]), "{name} at {at:?}");
                if distance.abs() > stack.diagonal() / 2.0 {
                    assert_eq!(fraction[i], occupancy[i], "{name} at {at:?}");
                }
            }
        }
    }
}

/// The volume by fractions of the kinds that `chosen` holds for.
fn fractions_add_up(chosen: impl Fn(&str) -> bool) {
    let folder = scratch();
    for (name, keys, _, volume) in kinds() {
        if !chosen(&keys) {
            continue;
        }
        let path = in_file(&folder, "s.toml", &scene(&keys));
        let out = below(&folder, "out");
        for grid in ["--resolution=11", "--spacing=0.5"] {
            let more = [grid, "--channels", "fraction", "--force", "--json"];
            let d = run(&[&["voxelize", &path, "-o", &out], &more[..]].concat())
                .exits(0)
                .json();
            let found = d["volume_fraction"].as_f64().expect("a volume");
            assert!(
                (found - volume).abs() <= 1e-6 * volume,
                "{name}, {grid}: {found}, wanted {volume}"
            );
        }
    }
}

#[test]
fn fractions_add_up_to_the_volume() {
    fractions_add_up(|keys| !keys.contains("'volume'"));
}

#[test]
fn fractions_of_volumes_add_up_to_the_volume() {
    fractions_add_up(|keys| keys.contains("'volume'"));
}

#[test]
fn every_kind_is_meshed_validated_and_rendered() {
    let folder = scratch();
    for (name, keys, _, volume) in kinds() {
        let path = in_file(&folder, "s.toml", &scene(&keys));
        let file = below(&folder, "m.ply");
        let d = run(&[
            "mesh",
            &path,
            "-o",
            &file,
            "--chord-error",
            "0.01",
            "--json",
        ])
        .exits(0)
        .json();
        let found = d["files"][0]["volume"].as_f64().expect("a volume");
        assert!(
            (found - volume).abs() < 0.02 * volume,
            "{name}: {found}, exact {volume}"
        );
        assert!(d["files"][0]["chord_error"].as_f64().expect("a bound") <= 0.01);
        let d = run(&["validate", &path, "--resolution", "13", "--json"])
            .exits(0)
            .json();
        assert_eq!(
            (&d["ok"], &d["disagree"]),
            (&Value::Bool(true), &Value::from(0)),
            "{name}"
        );
        let picture = below(&folder, "p.png");
        let size = ["--width", "40", "--height", "30"];
        for more in [&[][..], &["--slice", "y=0.25"], &["--cut", "quarter"]] {
            run(&[&["render", &path, "-o", &picture], &size[..], more].concat()).exits(0);
            let bytes = fs::read(&picture).expect("a picture");
            assert_eq!(&bytes[16..24], &[0, 0, 0, 40, 0, 0, 0, 30], "{name}");
            fs::remove_file(&picture).expect("it is there");
        }
    }
}

/// A net of degrees 2, 1, 1 and the values of a scalar over it, by its own sums.
struct Net {
    points: Vec<Point>,
    weights: Vec<f64>,
}

impl Net {
    fn basis(&self, t: Point) -> Vec<f64> {
        let [u, v, w] = t;
        let square = [(1.0 - u) * (1.0 - u), 2.0 * u * (1.0 - u), u * u];
        let mut all = Vec::new();
        for c in [1.0 - w, w] {
            for b in [1.0 - v, v] {
                all.extend(square.map(|a| a * b * c));
            }
        }
        all.iter().zip(&self.weights).map(|(b, w)| b * w).collect()
    }

    fn combine(&self, t: Point, values: &[f64]) -> f64 {
        let basis = self.basis(t);
        let sum: f64 = basis.iter().zip(values).map(|(b, v)| b * v).sum();
        sum / basis.iter().sum::<f64>()
    }

    fn at(&self, t: Point) -> Point {
        std::array::from_fn(|k| {
            let column: Vec<f64> = self.points.iter().map(|p| p[k]).collect();
            self.combine(t, &column)
        })
    }

    fn text(&self, more: &str) -> String {
        format!(
            "{{ degrees = [2, 1, 1], knots = [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]], \
             points = {:?}, weights = {:?}{more} }}",
            self.points, self.weights
        )
    }
}

/// Two patches side by side along u with points and weights moved, the shared face in common.
fn bent() -> [Net; 2] {
    let mut next = uniform(99);
    let mut net = |from: f64| {
        let mut points = Vec::new();
        for w in [0.0, 2.0] {
            for v in [0.0, 2.0] {
                points.extend(
                    [0.0, 1.0, 2.0]
                        .map(|u| [from + u, v, w].map(|c: f64| c + 0.4 * (next() - 0.5))),
                );
            }
        }
        let weights = points.iter().map(|_| 0.6 + next()).collect();
        Net { points, weights }
    };
    let (first, mut second) = (net(0.0), net(2.0));
    for row in 0..4 {
        second.points[3 * row] = first.points[3 * row + 2];
        second.weights[3 * row] = first.weights[3 * row + 2];
    }
    [first, second]
}

fn bent_scene(moved: Option<Point>) -> (String, [Net; 2]) {
    let mut nets = bent();
    if let Some(to) = moved {
        nets[0].points[4] = to;
    }
    let patches = nets.each_ref().map(|n| n.text("")).join(",\n");
    (
        scene(&format!("kind = 'volume'\npatches = [{patches}]")),
        nets,
    )
}

/// What comes out of the net is inside, what leaves a face along its normal is outside, and the
/// distance is what it left by; again with one control point elsewhere.
#[test]
fn membership_follows_the_net_when_a_control_point_moves() {
    let folder = scratch();
    for moved in [None, Some([1.1, 3.0, -0.9])] {
        let (text, nets) = bent_scene(moved);
        let path = in_file(&folder, "s.toml", &text);
        let mut next = uniform(3);
        let (mut inner, mut outer) = (Vec::new(), Vec::new());
        for net in &nets {
            inner.extend((0..100).map(|_| net.at([next(), next(), next()])));
        }
        // The faces v and w of both patches, and the outer end of each.
        for (which, net) in nets.iter().enumerate() {
            for (k, end) in [(0, which), (1, 0), (1, 1), (2, 0), (2, 1)] {
                for _ in 0..12 {
                    let mut t = [0, 1, 2].map(|_| 0.1 + 0.8 * next());
                    t[k] = end as f64;
                    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                    let tangent = |c: usize| {
                        let h = 1e-6;
                        let (mut s, mut e) = (t, t);
                        s[c] -= h;
                        e[c] += h;
                        let (s, e) = (net.at(s), net.at(e));
                        [0, 1, 2].map(|i| (e[i] - s[i]) / (2.0 * h))
                    };
                    let (p, q) = (tangent(a), tangent(b));
                    let n = [
                        p[1] * q[2] - p[2] * q[1],
                        p[2] * q[0] - p[0] * q[2],
                        p[0] * q[1] - p[1] * q[0],
                    ];
                    let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
                    let sign = if end == 1 { 1.0 } else { -1.0 };
                    let x = net.at(t);
                    outer.push(std::array::from_fn(|i| x[i] + 1e-3 * sign * n[i] / length));
                }
            }
        }
        for (p, (inside, sdf)) in inner.iter().zip(query(&path, &[], &inner)) {
            assert!(inside && sdf <= 0.0, "{moved:?} at {p:?}: {sdf}");
        }
        for (p, (inside, sdf)) in outer.iter().zip(query(&path, &[], &outer)) {
            assert!(
                !inside && (sdf - 1e-3).abs() < 1e-8,
                "{moved:?} at {p:?}: {sdf}"
            );
        }
    }
}

#[test]
fn channels_hold_the_parameters_and_the_fields() {
    let folder = scratch();
    let nets = bent();
    let mut next = uniform(12);
    let values: [Vec<f64>; 2] = [0, 1].map(|_| (0..12).map(|_| 3.0 * next() - 1.0).collect());
    let fields = |k: usize| {
        format!(
            ", fields = {{ density = {:?}, _t2 = {:?} }}",
            values[k],
            vec![7; 12]
        )
    };
    let patches = [0, 1].map(|k| nets[k].text(&fields(k))).join(", ");
    let text = scene(&format!("kind = 'volume'\npatches = [{patches}]"));
    let path = in_file(&folder, "s.toml", &text);
    // Without a word the fields are there, the parameters are not.
    let out = below(&folder, "plain");
    let d = run(&["voxelize", &path, "-o", &out, "--resolution", "5", "--json"])
        .exits(0)
        .json();
    let channels: Vec<&str> = (d["channels"].as_array().expect("channels").iter())
        .map(|c| c.as_str().expect("a name"))
        .collect();
    assert!(
        channels.contains(&"density") && channels.contains(&"_t2"),
        "{channels:?}"
    );
    assert!(!channels.contains(&"u"), "{channels:?}");

    let out = below(&folder, "all");
    let names = "occupancy,sdf,u,v,w,density,_t2";
    run(&[
        "voxelize",
        &path,
        "-o",
        &out,
        "--resolution",
        "23",
        "--channels",
        names,
    ])
    .exits(0);
    let stack = Stack::read(&out);
    let column = |name: &str| {
        stack
            .channel(name)
            .into_iter()
            .map(f64::from)
            .collect::<Vec<_>>()
    };
    let (inside, sdf) = (column("occupancy"), column("sdf"));
    let [u, v, w] = ["u", "v", "w"].map(column);
    let (density, seven) = (column("density"), column("_t2"));
    let mut counts = [0; 2];
    for (i, p) in stack.centres().iter().enumerate() {
        if inside[i] == 0.0 {
            let all = [u[i], v[i], w[i], density[i], seven[i]];
            assert_eq!(all, [0.0; 5], "at {p:?}");
            continue;
        }
        let t = [u[i], v[i], w[i]];
        // Parameters are single precision; which patch they are of, the point tells.
        let off = |net: &Net| {
            let x = net.at(t);
            (0..3).map(|k| (x[k] - p[k]).abs()).fold(0.0, f64::max)
        };
        let of = usize::from(off(&nets[1]) < off(&nets[0]));
        assert!(off(&nets[of]) < 2e-6, "{t:?} is not where {p:?} comes from");
        counts[of] += 1;
        let wanted = nets[of].combine(t, &values[of]);
        assert!(
            (density[i] - wanted).abs() < 5e-6,
            "at {p:?}: {} {wanted}",
            density[i]
        );
        assert_eq!(seven[i], 7.0, "at {p:?}");
        assert!(sdf[i] <= 0.0);
    }
    assert!(counts[0] > 500 && counts[1] > 500, "{counts:?}");
    let d = run(&["info", &out, "--json"]).exits(0).json();
    assert!(d.to_string().contains("density"));
}

/// Every format gives the same answers as the net in the scene, bit for bit where it is Cartesian.
#[test]
fn files_of_every_format_answer_as_the_net_does() {
    use voxlathe::nurbs::{KnotVector, NurbsVolume};
    let folder = scratch();
    let (text, nets) = bent_scene(None);
    let inline = in_file(&folder, "inline.toml", &text);
    let volumes: Vec<NurbsVolume> = (nets.iter())
        .map(|n| {
            let knots = [2, 1, 1].map(|d| KnotVector::bezier(d).expect("a degree"));
            NurbsVolume::new(knots, n.points.clone(), n.weights.clone()).expect("a net")
        })
        .collect();
    let mut next = uniform(8);
    let points: Vec<Point> = (0..200)
        .map(|_| [5.0 * next() - 0.5, 3.0 * next() - 0.5, 3.0 * next() - 0.5])
        .collect();
    let wanted = query(&inline, &[], &points);
    for ending in ["g2", "mesh", "json", "xml"] {
        let file = below(&folder, &format!("net.{ending}"));
        voxlathe::exchange::write_volumes(&file, &volumes).expect("it can be written");
        let text = scene(&format!("kind = 'volume'\nfile = 'net.{ending}'"));
        let path = in_file(&folder, "file.toml", &text);
        for (p, (a, b)) in points
            .iter()
            .zip(query(&path, &[], &points).iter().zip(&wanted))
        {
            assert!(
                a.0 == b.0 && (a.1 - b.1).abs() < 1e-13,
                "{ending} at {p:?}: {a:?} {b:?}"
            );
        }
    }
}

/// A boolean of four families against the boolean of their closed forms, its volume included.
#[test]
fn families_combine() {
    let folder = scratch();
    let patch = &kinds()[9].1;
    let text = format!(
        "schema = 1\n[[solid]]\n{patch}\nmaterial = 7\n\
         [[solid]]\nkind = 'cylinder'\nradius = 0.25\nheight = 6\noperation = 'subtract'\naxis = {{ origin = [0, 0, -3] }}\n\
         [[solid]]\nkind = 'ellipsoid'\nradii = [0.5, 0.5, 0.5]\noperation = 'subtract'\naxis = {{ origin = [1, 0.75, 1] }}\n\
         [[solid]]\nkind = 'box'\nsize = [2, 2, 2]\nmaterial = 9\naxis = {{ origin = [-2.5, 0, 0] }}\n"
    );
    let path = in_file(&folder, "s.toml", &text);
    let hole = |p: Point| p[0].hypot(p[1]) - 0.25;
    let ball = |p: Point| {
        let d = [p[0] - 1.0, p[1] - 0.75, p[2] - 1.0];
        d[0].hypot(d[1]).hypot(d[2]) - 0.5
    };
    let added = |p: Point| (p[0] + 2.5).abs().max(p[1].abs()).max(p[2].abs()) - 1.0;
    let points = places(17);
    for (p, (inside, sdf)) in points.iter().zip(query(&path, &[], &points)) {
        let (b, h, e, a) = (block(*p), hole(*p), ball(*p), added(*p));
        if [b, h, e, a].iter().any(|d| d.abs() < 1e-12) {
            continue;
        }
        let wanted = b < 0.0 && h > 0.0 && e > 0.0 || a < 0.0;
        assert_eq!(inside, wanted, "at {p:?}: {sdf}");
        // Every boundary of the composite is a boundary of a part, though not the other way round.
        let nearest = |m: f64, d: &f64| m.min(d.abs());
        let least = [b, h, e, a].iter().fold(f64::INFINITY, nearest);
        assert!(
            sdf.abs() >= least.min(h.abs() - 1.0) - 1e-12,
            "at {p:?}: {sdf}, at least {least}"
        );
    }
    let d = run(&["measure", &path, "--json"]).exits(0).json();
    let found = d["total"]["volume"].as_f64().expect("a volume");
    let estimate = d["total"]["error_estimate"]["volume"]
        .as_f64()
        .expect("an estimate");
    // The added box stands apart; half of the ball is in the block.
    let exact = 24.0 - PI / 16.0 * 4.0 - 2.0 / 3.0 * PI / 8.0 + 8.0;
    assert!(
        (found - exact).abs() <= estimate + 1e-12,
        "{found} +- {estimate}, wanted {exact}"
    );
    assert!(estimate < 1e-5 * exact, "{estimate}");
    let out = below(&folder, "out");
    let channels = ["--resolution", "19", "--channels", "material", "--json"];
    run(&[&["voxelize", &path, "-o", &out], &channels[..]].concat()).exits(0);
    let stack = Stack::read(&out);
    for (p, id) in stack.centres().iter().zip(stack.channel("material")) {
        assert!([0.0, 7.0, 9.0].contains(&id), "{id} at {p:?}");
        if added(*p) < -1e-9 {
            assert_eq!(id, 9.0, "at {p:?}");
        }
    }
}

/// The discs of a chain that runs back are a stack, and without `fill` it is refused with a way out.
#[test]
fn chains_that_run_back_need_the_union() {
    let folder = scratch();
    let chain = "schema = 1\n[profiles.p]\nboundary = 'to-axis'\n\
        curves = [{ kind = 'polyline', points = [[1, 0], [3, 2], [2, 1], [1, 4]] }]\n\
        [[solid]]\nkind = 'volume'\nprofile = 'p'\n";
    for construct in ["curve-disc", "curve-ruled"] {
        let text = format!("{chain}construct = '{construct}'\n");
        let path = in_file(&folder, "s.toml", &text);
        let run = run(&["measure", &path]).exits(2);
        assert!(
            run.err.contains("fill = \"union\"") && run.err.contains("revolve"),
            "{}",
            run.err
        );
        let path = in_file(&folder, "u.toml", &format!("{text}fill = 'union'\n"));
        // The legs: up to (3, 2), back on the same line to (2, 1), then up to (1, 4).
        let outer = |z: f64| 1.0 + z;
        let last = |z: f64| 2.0 - (z - 1.0) / 3.0;
        let mut next = uniform(4);
        let points: Vec<Point> = (0..300)
            .map(|_| [3.5 * next(), 0.0, 4.4 * next() - 0.2])
            .collect();
        for (p, (inside, _)) in points.iter().zip(query(&path, &[], &points)) {
            let (r, z) = (p[0], p[2]);
            let first = (0.0..=2.0).contains(&z) && r <= outer(z);
            let second = (1.0..=4.0).contains(&z) && r <= last(z);
            assert_eq!(inside, first || second, "{construct} at {p:?}");
        }
    }
}

fn refusal(scene: &str) -> Run {
    let folder = scratch();
    let path = in_file(&folder, "s.toml", scene);
    run_within(LIMIT, "", &["measure", &path])
}

/// The solid is refused, and the message has all of these.
#[track_caller]
fn refused(keys: &str, marks: &[&str]) {
    let run = refusal(&scene(keys));
    assert_eq!(run.code, 2, "{keys}\n{}\n{}", run.out, run.err);
    for mark in marks {
        assert!(
            run.err.contains(mark),
            "no {mark:?} for {keys}\n{}",
            run.err
        );
    }
}

const CUBE: &str = "{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]], \
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]] }";

/// A volume of the unit cube with a piece of its text replaced.
#[track_caller]
fn cube(from: &str, to: &str) -> String {
    assert!(CUBE.contains(from), "{from}");
    format!(
        "kind = 'volume'\npatches = [{}]",
        CUBE.replacen(from, to, 1)
    )
}

#[test]
fn nets_that_do_not_fit_are_refused_with_counts() {
    refused(
        &cube("[1, 1, 1]] }", "[1, 1, 1], [2, 2, 2]] }"),
        &["patches[0].points", "9 control points", "8"],
    );
    refused(
        &cube(", [1, 1, 1]] }", "] }"),
        &["7 control points", "2 x 2 x 2"],
    );
    refused(
        &cube("degrees = [1, 1, 1]", "degrees = [1, 1]"),
        &["degrees", "3 degrees"],
    );
    refused(
        &cube("degrees = [1, 1, 1]", "degrees = [1, 2, 1]"),
        &["knots[1]", "4 knots", "6"],
    );
    refused(
        &cube("degrees = [1, 1, 1]", "degrees = [1, 0, 1]"),
        &["degrees[1]", "0"],
    );
    refused(&cube("[[0, 0, 1, 1], ", "["), &["knots", "2 knot vectors"]);
    refused(&cube("[0, 0, 1, 1]", "[0, 1, 0, 1]"), &["knots[0]", "0"]);
    refused(&cube("[0, 0, 1, 1]", "[0, 0, 0, 0]"), &["knots[0]"]);
    refused(
        &cube("[0, 0, 1, 1]", "[0, 0, nan, 1]"),
        &["knots[0]", "nan"],
    );
    refused(
        &cube("[1, 1, 1]] }", "[1, 1, inf]] }"),
        &["points[7]", "inf"],
    );
    refused(&cube("[1, 1, 1]] }", "[1, 1]] }"), &["points[7]"]);
    refused(
        &cube("]] }", "]], weights = [1, 1, 1] }"),
        &["weights", "3 weights", "8"],
    );
    for bad in ["0", "-2", "nan", "inf"] {
        let weights = format!("]], weights = [1, 1, 1, 1, 1, {bad}, 1, 1] }}");
        refused(
            &cube("]] }", &weights),
            &["patches[0].weights[5]", "greater than 0"],
        );
    }
    refused(&cube("points", "pionts"), &["pionts", "points"]);
    refused("kind = 'volume'\npatches = []", &["patches"]);
    refused("kind = 'volume'\npatches = [3]", &["patches[0]", "a table"]);
}

#[test]
fn folded_maps_name_their_patch_and_place() {
    // The last corner goes through the cube to the other side.
    let folded = CUBE.replace("[1, 1, 1]] }", "[-2, -2, -2]] }");
    refused(
        &format!("kind = 'volume'\npatches = [{folded}]"),
        &[
            "s.toml:10:12",
            "patches[0]",
            "folds",
            "positive at [0.0, 0.0, 0.0]",
            "in Bézier cell 0 (spans [0, 0, 0])",
            "negative at [1.0, 1.0,",
        ],
    );
    let beside = CUBE.replace("[1, ", "[5, ");
    assert_ne!(beside, CUBE);
    refused(
        &format!("kind = 'volume'\npatches = [{CUBE}, {folded}]"),
        &["patches[1]", "folds", "negative at"],
    );
    // A mirrored net is one cover too.
    let mirrored = CUBE
        .replace("[0, 0, 0], [1, 0, 0]", "[A]")
        .replace("[0, 1, 0], [1, 1, 0]", "[0, 0, 0], [1, 0, 0]");
    let mirrored = mirrored.replace("[A]", "[0, 1, 0], [1, 1, 0]");
    let mirrored = mirrored.replace(
        "[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]",
        "[0, 1, 1], [1, 1, 1], [0, 0, 1], [1, 0, 1]",
    );
    let folder = scratch();
    let path = in_file(
        &folder,
        "m.toml",
        &scene(&format!("kind = 'volume'\npatches = [{mirrored}]")),
    );
    let d = run(&["measure", &path, "--json"]).exits(0).json();
    assert_eq!(d["total"]["volume"], 1.0);
}

#[test]
fn keys_that_do_not_go_together_are_refused() {
    refused("kind = 'volume'", &["patches", "construct", "file"]);
    refused(
        &format!("{}\nfile = 'x.g2'", cube("}", "}")),
        &["several of"],
    );
    refused(
        &format!(
            "{}\nconstruct = 'curve-disc'\nprofile = 'wall'",
            cube("}", "}")
        ),
        &["several of"],
    );
    refused(
        &format!("{}\nangle = 90", cube("}", "}")),
        &["angle", "construct"],
    );
    refused(
        "kind = 'volume'\nfile = 'x.g2'\nprofile = 'wall'",
        &["profile", "construct"],
    );
    refused("kind = 'volume'\nconstruct = 'curve-disc'", &["profile"]);
    refused(
        "kind = 'volume'\nconstruct = 'surface-circle'",
        &["section"],
    );
    refused(
        "kind = 'volume'\nconstruct = 'curve-disk'\nprofile = 'wall'",
        &["did you mean `curve-disc`"],
    );
    refused(
        &format!(
            "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'wall'\n{}",
            torus_section()
        ),
        &["section", "surface-circle"],
    );
    refused(
        &format!(
            "kind = 'volume'\nconstruct = 'surface-circle'\nfill = 'union'\n{}",
            torus_section()
        ),
        &["fill"],
    );
    refused(
        "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'wall'\nfill = 'nonzero'",
        &["fill", "union"],
    );
    refused(
        "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'wal'",
        &["did you mean `wall`"],
    );
    refused(
        "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'wall'\nangle = 0",
        &["angle"],
    );
    refused("kind = 'torus'\nmajor = 3", &["minor"]);
    refused(
        "kind = 'torus'\nmajor = 3\nminor = 1\nradius = 2",
        &["radius", "unknown key"],
    );
    refused("kind = 'box'\nsize = [1, 2]", &["size"]);
    refused("kind = 'box'\nsize = [1, 2, 0]", &["size[2]"]);
    refused("kind = 'box'\nsize = [1, 2, 3]\nangle = 90", &["angle"]);
    refused(
        "kind = 'ellipsoid'\nradii = [1, 2, -3]",
        &["radii[2]", "-3"],
    );
    refused("kind = 'ellipsoid'\nradius = 1", &["radius", "radii"]);
    refused(
        "kind = 'cone'\nradius1 = 0\nradius2 = 0\nheight = 1",
        &["radius2"],
    );
    refused("kind = 'shpere'\nradius = 1", &["did you mean `sphere`"]);
}

#[test]
fn fields_and_channels_are_checked() {
    let with = |fields: &str| cube("]] }", &format!("]], fields = {{ {fields} }} }}"));
    refused(
        &with("density = [1, 2]"),
        &["fields.density", "2 values", "8"],
    );
    refused(&with("density = 3"), &["fields.density"]);
    refused(
        &with("density = [1, 1, 1, 1, 1, 1, 1, nan]"),
        &["density[7]", "nan"],
    );
    for taken in ["sdf", "occupancy", "fraction", "material", "u", "v", "w"] {
        refused(
            &with(&format!("{taken} = [1, 1, 1, 1, 1, 1, 1, 1]")),
            &[taken, "a name other than"],
        );
    }
    for odd in ["'a b'", "'3d'", "''", "'é'"] {
        refused(
            &with(&format!("{odd} = [1, 1, 1, 1, 1, 1, 1, 1]")),
            &["a field named"],
        );
    }
    // TOML itself refuses a name twice.
    refused(
        &with("a = [1, 1, 1, 1, 1, 1, 1, 1], a = [1, 1, 1, 1, 1, 1, 1, 1]"),
        &["once", "a"],
    );
    let far = CUBE.replace("[0, 0, 0]", "[0, 0, 0.25]");
    let some = CUBE.replace(
        "]] }",
        "]], fields = { density = [1, 1, 1, 1, 1, 1, 1, 1] } }",
    );
    refused(
        &format!("kind = 'volume'\npatches = [{some}, {far}]"),
        &["patches[1]", "density"],
    );

    let folder = scratch();
    let text = scene(&format!("kind = 'volume'\npatches = [{some}]"));
    let path = in_file(&folder, "s.toml", &text);
    let out = below(&folder, "out");
    for (channels, marks) in [
        ("densty", ["densty", "did you mean density"]),
        ("sdf,density,density", ["density", "twice"]),
        ("sdf,temperature", ["temperature", "one of"]),
    ] {
        let run = run(&["voxelize", &path, "-o", &out, "--channels", channels]).exits(2);
        for mark in marks {
            assert!(run.err.contains(mark), "no {mark:?}: {}", run.err);
        }
    }
    // A scene without volumes has no u.
    let path = in_file(
        &folder,
        "b.toml",
        "schema = 1\n[[solid]]\nkind = 'box'\nsize = [1, 1, 1]\n",
    );
    run(&["voxelize", &path, "-o", &out, "--channels", "u"]).exits(2);
}

#[test]
fn files_that_cannot_be_read_are_refused_with_their_place() {
    let folder = scratch();
    let good = voxlathe::exchange::write_text(
        voxlathe::exchange::Format::G2,
        &[voxlathe::construct::cylinder_volume(
            1.0,
            2.0,
            voxlathe::construct::Construction::CurveDisc(
                voxlathe::construct::DiscForm::Biquadratic,
            ),
            voxlathe::construct::AngleInterval::FULL,
            &voxlathe::construct::AxisFrame::WORLD,
        )
        .expect("a cylinder")],
    )
    .expect("a text");
    let text = scene("kind = 'volume'\nfile = 'v.g2'");
    let path = in_file(&folder, "s.toml", &text);
    // A missing file is an input that failed.
    let missing = run(&["measure", &path]).exits(3);
    assert!(missing.err.contains("v.g2"), "{}", missing.err);
    // Cut off anywhere: every end but those in blanks and within the last number.
    let last = good.trim_end().rfind([' ', '\n']).expect("numbers");
    for length in (0..=last).step_by(17) {
        in_file(&folder, "v.g2", &good[..length]);
        let run = run_within(LIMIT, "", &["measure", &path]);
        assert_eq!(
            run.code,
            2,
            "cut at {length} of {}: {}{}",
            good.len(),
            run.out,
            run.err
        );
        assert!(run.err.contains("v.g2"), "{}", run.err);
    }
    in_file(&folder, "v.g2", &good);
    let d = run(&["measure", &path, "--json"]).exits(0).json();
    assert!((d["total"]["volume"].as_f64().expect("a volume") - 2.0 * PI).abs() < 1e-14);
    for (content, marks) in [
        ("", &["v.g2"][..]),
        ("solid part\n", &["v.g2"]),
        ("\0\u{1}\u{2}", &["v.g2"]),
        // Counts that no memory holds.
        ("700 1 0 0\n3 0\n4000000000 2\n0 0 1 1\n", &["v.g2"]),
        // A sphere of another kind, and a surface.
        ("260 1 0 0\n3\n", &["v.g2"]),
        (
            "200 1 0 0\n3 0\n2 2\n0 0 1 1\n2 2\n0 0 1 1\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n",
            &["v.g2", "surface"],
        ),
        // A weight of 0 in the last point.
        (
            "700 1 0 0\n3 1\n2 2\n0 0 1 1\n2 2\n0 0 1 1\n2 2\n0 0 1 1\n0 0 0 1\n1 0 0 1\n0 1 0 1\n1 1 0 1\n\
             0 0 1 1\n1 0 1 1\n0 1 1 1\n1 1 1 0\n",
            &["v.g2", "weight"],
        ),
    ] {
        in_file(&folder, "v.g2", content);
        let run = run_within(LIMIT, "", &["measure", &path]);
        assert_eq!(run.code, 2, "{content:?}: {}{}", run.out, run.err);
        for mark in marks {
            assert!(
                run.err.contains(mark),
                "no {mark:?} for {content:?}: {}",
                run.err
            );
        }
    }
    let run = refusal(&scene("kind = 'volume'\nfile = '.'"));
    assert!(run.code == 2 || run.code == 3, "{}", run.err);
}
