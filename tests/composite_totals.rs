//! Volumes of composites of 2 to 12 solids against closed forms and integrals of one variable, which share nothing with
//! the crate: balls, cylinders, cones, boxes and tori that cross cleanly, share faces, are flush or touch, each turned,
//! scaled and moved at random.

use std::f64::consts::PI;
use std::fmt::Write;
use std::time::Instant;
use voxlathe::Scene;

/// A generator of numbers: SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        #[allow(clippy::cast_precision_loss, reason = "53 bits")]
        let x = ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
        x
    }

    fn within(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next()
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "small"
    )]
    fn below(&mut self, n: u32) -> u32 {
        (self.next() * f64::from(n)) as u32
    }
}

/// A scene's solids, with what they have in common, and the volume they must have.
struct Case {
    name: &'static str,
    /// Whether surfaces only cross, at angles.
    clean: bool,
    solids: Vec<String>,
    volume: f64,
}

/// ∫ f over [a, b], f with roots at the ends at worst: the tanh-sinh rule.
fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (c, h) = (0.5 * (a + b), 0.5 * (b - a));
    let step = 1.0 / 64.0;
    let mut sum = 0.0;
    for k in -260_i32..=260 {
        let t = f64::from(k) * step;
        let u = 0.5 * PI * t.sinh();
        let weight = 0.5 * PI * t.cosh() / u.cosh().powi(2);
        let value = f(c + h * u.tanh());
        if value.is_finite() {
            sum += weight * value;
        }
    }
    sum * h * step
}

fn ball_volume(r: f64) -> f64 {
    4.0 / 3.0 * PI * r.powi(3)
}

/// Common volume of balls of radii a and b, their centres d apart.
fn lens(a: f64, b: f64, d: f64) -> f64 {
    PI * (a + b - d).powi(2) * (d * d + 2.0 * d * (a + b) - 3.0 * (a - b).powi(2)) / (12.0 * d)
}

/// Common area of discs of radii a and b, their centres d apart.
fn discs(a: f64, b: f64, d: f64) -> f64 {
    let root = |x: f64| x.max(0.0).sqrt();
    integral(
        |x| 2.0 * root(a * a - x * x),
        (d * d + a * a - b * b) / (2.0 * d),
        a,
    ) + integral(
        |x| 2.0 * root(b * b - (x - d) * (x - d)),
        d - b,
        (d * d + a * a - b * b) / (2.0 * d),
    )
}

/// Common volume of long cylinders of radii a and b, their axes at an angle, `e` apart.
fn crossing(a: f64, b: f64, e: f64, angle: f64) -> f64 {
    let root = |x: f64| x.max(0.0).sqrt();
    let (low, high) = ((-a).max(e - b), a.min(e + b));
    integral(
        |z| 4.0 * root((a - z) * (a + z)) * root((b - z + e) * (b + z - e)),
        low,
        high,
    ) / angle.sin()
}

/// Common volume of a ball of radius R and a long cylinder of radius a, its axis d from the centre; d + a < R.
fn drilled(big: f64, a: f64, d: f64) -> f64 {
    let whole = |r: f64| 4.0 * PI * r * (big * big - r * r).sqrt();
    let part = |r: f64| {
        let cosine = (r * r + d * d - a * a) / (2.0 * r * d);
        whole(r) * cosine.clamp(-1.0, 1.0).acos() / PI
    };
    let ring = integral(part, (a - d).abs(), a + d);
    // Circles wholly within the cylinder.
    ring + if a > d {
        integral(whole, 0.0, a - d)
    } else {
        0.0
    }
}

const OPERATIONS: [&str; 3] = ["add", "subtract", "intersect"];

/// The volume of two solids of volumes a and b with c in common.
fn composed(operation: usize, a: f64, b: f64, c: f64) -> f64 {
    [a + b - c, a - c, c][operation]
}

fn axis(origin: [f64; 3], direction: [f64; 3]) -> String {
    format!("axis = {{ origin = {origin:?}, direction = {direction:?} }}")
}

fn cylinder(r: f64, from: [f64; 3], along: [f64; 3], h: f64, operation: &str) -> String {
    let axis = axis(from, along);
    format!("kind = 'cylinder'\nradius = {r:?}\nheight = {h:?}\n{axis}\noperation = '{operation}'")
}

fn ball(r: f64, centre: [f64; 3], up: [f64; 3], operation: &str) -> String {
    let axis = axis(centre, up);
    format!("kind = 'sphere'\nradius = {r:?}\n{axis}\noperation = '{operation}'")
}

fn block(size: [f64; 3], centre: [f64; 3], operation: &str) -> String {
    format!(
        "kind = 'box'\nsize = {size:?}\naxis = {{ origin = {centre:?} }}\noperation = '{operation}'"
    )
}

fn two_balls(random: &mut Random) -> Case {
    let (a, b) = (random.within(0.5, 2.0), random.within(0.5, 2.0));
    let d = random.within((a - b).abs() + 0.05, a + b - 0.05);
    let k = random.below(3) as usize;
    let up = [random.next(), random.next(), 1.0];
    Case {
        name: "balls",
        clean: true,
        solids: vec![
            ball(a, [0.0; 3], [0.0, 0.0, 1.0], "add"),
            ball(b, [d, 0.0, 0.0], up, OPERATIONS[k]),
        ],
        volume: composed(k, ball_volume(a), ball_volume(b), lens(a, b, d)),
    }
}

fn two_cylinders(random: &mut Random) -> Case {
    let (a, b) = (random.within(0.5, 1.5), random.within(0.5, 1.5));
    let e = random.within(0.0, 0.8 * (a + b));
    let angle = random.within(0.6, PI / 2.0);
    let k = random.below(3) as usize;
    let h = 12.0;
    let along = [angle.cos(), angle.sin(), 0.0];
    let from = [-0.5 * h * along[0], -0.5 * h * along[1], e];
    Case {
        name: "cylinders",
        clean: true,
        solids: vec![
            cylinder(a, [-0.5 * h, 0.0, 0.0], [1.0, 0.0, 0.0], h, "add"),
            cylinder(b, from, along, h, OPERATIONS[k]),
        ],
        volume: composed(k, PI * a * a * h, PI * b * b * h, crossing(a, b, e, angle)),
    }
}

/// Equal radii, axes that meet: every crossing passes through two points of tangency.
fn equal_cylinders(random: &mut Random) -> Case {
    let a = random.within(0.5, 1.5);
    let k = random.below(3) as usize;
    let h = 8.0;
    Case {
        name: "equal cylinders",
        clean: false,
        solids: vec![
            cylinder(a, [-0.5 * h, 0.0, 0.0], [1.0, 0.0, 0.0], h, "add"),
            cylinder(a, [0.0, -0.5 * h, 0.0], [0.0, 1.0, 0.0], h, OPERATIONS[k]),
        ],
        volume: composed(k, PI * a * a * h, PI * a * a * h, 16.0 / 3.0 * a.powi(3)),
    }
}

fn drilled_ball(random: &mut Random) -> Case {
    let big = random.within(1.0, 2.0);
    let a = random.within(0.1, 0.5) * big;
    let d = random.within(0.05, 0.95) * (big - a);
    let k = 1 + random.below(2) as usize;
    Case {
        name: "drilled ball",
        clean: true,
        solids: vec![
            ball(big, [0.0; 3], [1.0, 2.0, 0.5], "add"),
            cylinder(
                a,
                [d, 0.0, -3.0 * big],
                [0.0, 0.0, 1.0],
                6.0 * big,
                OPERATIONS[k],
            ),
        ],
        volume: composed(k, ball_volume(big), 0.0, drilled(big, a, d)),
    }
}

/// A plate with bores, some as long as the plate is thick, and bolts whose heads lie on it.
fn plate(random: &mut Random) -> Case {
    let n = 1 + random.below(11);
    let t = random.within(0.2, 1.0);
    let size = [8.0, 6.0, t];
    let mut solids = vec![block(size, [0.0; 3], "add")];
    let mut volume = size.iter().product::<f64>();
    let mut clean = true;
    for i in 0..n {
        let r = random.within(0.2, 0.6);
        let x = 2.0 * (f64::from(i % 4) - 1.5) + random.within(-0.1, 0.1);
        let y = 2.0 * (f64::from(i / 4) - 1.0) + random.within(-0.1, 0.1);
        let up = [0.0, 0.0, 1.0];
        match random.below(3) {
            0 => {
                solids.push(cylinder(r, [x, y, -t], up, 2.0 * t, "subtract"));
                volume -= PI * r * r * t;
            }
            1 => {
                solids.push(cylinder(r, [x, y, -0.5 * t], up, t, "subtract"));
                volume -= PI * r * r * t;
                clean = false;
            }
            _ => {
                solids.push(cylinder(r, [x, y, 0.5 * t], up, 0.5, "add"));
                volume += PI * r * r * 0.5;
                clean = false;
            }
        }
    }
    Case {
        name: "plate",
        clean,
        solids,
        volume,
    }
}

/// Boxes with corners on a coarse lattice: many faces are flush, coincide or touch.
fn boxes(random: &mut Random) -> Case {
    let n = 2 + random.below(8);
    let mut solids = Vec::new();
    let mut filled = [false; 216];
    for i in 0..n {
        let ends: [[u32; 2]; 3] = std::array::from_fn(|_| {
            let a = random.below(5);
            [a, a + 1 + random.below(5 - a)]
        });
        let k = if i == 0 { 0 } else { random.below(2) as usize };
        let side = ends.map(|[a, b]| 0.5 * f64::from(b - a));
        let centre = ends.map(|[a, b]| 0.25 * f64::from(a + b) - 1.5);
        solids.push(block(side, centre, OPERATIONS[k]));
        for (c, cell) in filled.iter_mut().enumerate() {
            #[allow(clippy::cast_possible_truncation, reason = "small")]
            let place = [c % 6, c / 6 % 6, c / 36].map(|x| x as u32);
            if (0..3).all(|d| place[d] >= ends[d][0] && place[d] < ends[d][1]) {
                *cell = k == 0;
            }
        }
    }
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let count = filled.iter().filter(|f| **f).count() as f64;
    Case {
        name: "boxes",
        clean: false,
        solids,
        volume: 0.125 * count,
    }
}

/// Equal heights on parallel axes: the flat ends coincide.
fn stack(random: &mut Random) -> Case {
    let (a, b) = (random.within(0.5, 1.5), random.within(0.5, 1.5));
    let d = random.within((a - b).abs() + 0.05, a + b - 0.05);
    let h = random.within(0.3, 3.0);
    let k = random.below(3) as usize;
    let up = [0.0, 0.0, 1.0];
    Case {
        name: "flush cylinders",
        clean: false,
        solids: vec![
            cylinder(a, [0.0; 3], up, h, "add"),
            cylinder(b, [d, 0.0, 0.0], up, h, OPERATIONS[k]),
        ],
        volume: h * composed(k, PI * a * a, PI * b * b, discs(a, b, d)),
    }
}

/// A ball that touches a plane, another ball, or the walls of a bore.
fn touching(random: &mut Random) -> Case {
    let r = random.within(0.3, 1.0);
    match random.below(3) {
        0 => Case {
            name: "ball on a box",
            clean: false,
            solids: vec![
                block([4.0, 4.0, 1.0], [0.0; 3], "add"),
                ball(r, [0.25, 0.5, 0.5 + r], [1.0, 0.0, 0.0], "add"),
            ],
            volume: 16.0 + ball_volume(r),
        },
        1 => Case {
            name: "balls within",
            clean: false,
            solids: vec![
                ball(2.0, [0.0; 3], [0.0, 0.0, 1.0], "add"),
                ball(r, [2.0 - r, 0.0, 0.0], [0.0, 1.0, 0.0], "subtract"),
            ],
            volume: ball_volume(2.0) - ball_volume(r),
        },
        _ => Case {
            name: "ball in a bar",
            clean: false,
            solids: vec![
                cylinder(r, [0.0, 0.0, -2.0], [0.0, 0.0, 1.0], 4.0, "add"),
                ball(r, [0.0, 0.0, 0.25], [1.0, 1.0, 0.0], "subtract"),
            ],
            volume: 4.0 * PI * r * r - ball_volume(r),
        },
    }
}

/// A cone whose tip is the centre of a ball: the common part is a sector.
fn sector(random: &mut Random) -> Case {
    let (r, h) = (random.within(0.5, 1.5), 3.0);
    let half = random.within(0.2, 1.2);
    let base = h * half.tan();
    let k = random.below(3) as usize;
    let up = [random.next(), 0.3, 1.0];
    let common = 2.0 / 3.0 * PI * r.powi(3) * (1.0 - half.cos());
    Case {
        name: "cone and ball",
        clean: true,
        solids: vec![
            format!("kind = 'cone'\nradius1 = 0\nradius2 = {base:?}\nheight = {h:?}"),
            ball(r, [0.0; 3], up, OPERATIONS[k]),
        ],
        volume: composed(k, PI * base * base * h / 3.0, ball_volume(r), common),
    }
}

/// A ring in parts that meet in flat faces.
fn ring(random: &mut Random) -> Case {
    let n = 2 + random.below(4);
    let (major, minor) = (random.within(1.5, 3.0), random.within(0.3, 1.0));
    let mut cuts: Vec<f64> = (1..n)
        .map(|_| f64::from(1 + random.below(35)) * 10.0)
        .collect();
    cuts.extend([0.0, 360.0]);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let parts = cuts.windows(2).map(|w| {
        let (start, angle) = (w[0], w[1] - w[0]);
        format!("kind = 'torus'\nmajor = {major:?}\nminor = {minor:?}\nstart = {start:?}\nangle = {angle:?}")
    });
    Case {
        name: "ring in parts",
        clean: false,
        solids: parts.collect(),
        volume: 2.0 * PI * PI * major * minor * minor,
    }
}

/// Pipes in a row, each square to the next, none touching the one after.
fn chain(random: &mut Random) -> Case {
    let n = 3 + random.below(4);
    let r = random.within(0.3, 0.7);
    let (pitch, h) = (4.0, 6.0);
    let mut solids = Vec::new();
    for i in 0..n {
        let at = f64::from(i / 2) * pitch;
        let (from, along) = if i % 2 == 0 {
            ([at, at - pitch, 0.0], [0.0, 1.0, 0.0])
        } else {
            ([at - 1.0, at + 1.0, 0.0], [1.0, 0.0, 0.0])
        };
        solids.push(cylinder(r, from, along, h, "add"));
    }
    let joints = f64::from(n - 1);
    Case {
        name: "chain of pipes",
        clean: false,
        solids,
        volume: f64::from(n) * PI * r * r * h - joints * 16.0 / 3.0 * r.powi(3),
    }
}

const KINDS: [fn(&mut Random) -> Case; 11] = [
    two_balls,
    two_cylinders,
    equal_cylinders,
    drilled_ball,
    plate,
    boxes,
    stack,
    touching,
    sector,
    ring,
    chain,
];

fn case(number: u64) -> (Case, String, f64) {
    let mut random = Random(0x5eed_0000 + number);
    #[allow(clippy::cast_possible_truncation, reason = "small")]
    let case = KINDS[number as usize % KINDS.len()](&mut random);
    let turn = [
        random.next() - 0.5,
        random.next() - 0.5,
        random.next() + 0.1,
    ];
    let degrees = [0.0, 90.0, 360.0 * random.next()][random.below(3) as usize];
    let scale = [1.0, 1.0, 1e-3, 1e4][random.below(4) as usize];
    let by: [f64; 3] = std::array::from_fn(|_| 3.0 * scale * (random.next() - 0.5));
    let place = format!(
        "place = [{{ rotate = {{ axis = {turn:?}, degrees = {degrees:?} }} }}, {{ scale = {scale:?} }}, {{ translate = {by:?} }}]"
    );
    let mut text = String::from("schema = 1\n");
    for solid in &case.solids {
        let _ = writeln!(text, "[[solid]]\n{solid}\n{place}");
    }
    let volume = case.volume * scale.powi(3);
    (case, text, volume)
}

struct Result {
    name: &'static str,
    error: f64,
    estimate: f64,
    seconds: f64,
}

fn measured(number: u64, failures: &mut String) -> Result {
    let (case, text, volume) = case(number);
    let scene = Scene::parse(&text).unwrap_or_else(|e| panic!("{number}: {e}\n{text}"));
    let start = Instant::now();
    let found = scene.measures();
    let seconds = start.elapsed().as_secs_f64();
    let (value, estimate) = found.map_or((0.0, f64::INFINITY), |m| {
        (m.volume, m.error_estimate.volume)
    });
    let scale = volume.abs().max(f64::MIN_POSITIVE);
    let (error, estimate) = ((value - volume).abs() / scale, estimate / scale);
    // What the numbers of the text and the reference are rounded to.
    let rounding = 2e-14;
    let bad = error > estimate + rounding
        || case.clean && (error > 1e-10 || estimate > 1e-10)
        || seconds > 20.0;
    if bad {
        let _ = writeln!(
            failures,
            "{number} {}: off by {error:.2e}, estimate {estimate:.2e}, {seconds:.2} s\n{text}",
            case.name
        );
    }
    Result {
        name: case.name,
        error,
        estimate,
        seconds,
    }
}

/// A vessel of 270 degrees of turn whose port leaves through its top, across both faces of the wall.
const VESSEL: &str = r#"
[profiles.wall]
loops = [
  [{ kind = "ellipse", center = [6, 0], radii = [2.2, 3.4] }],
  [{ kind = "ellipse", center = [6, 0], radii = [2.0, 3.2] }],
]
[[solid]]
kind = "revolve"
profile = "wall"
angle = 270
start = 45
[[solid]]
kind = "cylinder"
radius = 0.8
height = 3
axis = { origin = [-4.2, -4.2, 2.8] }
"#;

/// A straight pipe and a quarter bend that share a round face.
const ELBOW: &str = r#"
[[solid]]
kind = "cylinder"
radius = 1
height = 6
[[solid]]
kind = "torus"
major = 4
minor = 1
angle = 90
axis = { origin = [4, 0, 6], direction = [0, 1, 0], x = [-1, 0, 0] }
"#;

/// A block less a bore as long as it is high, less a block flush with three of its faces.
const FLUSH: &str = r#"
[[solid]]
kind = "box"
size = [8, 8, 4]
[[solid]]
kind = "cylinder"
radius = 2
height = 4
operation = "subtract"
axis = { origin = [0, 0, -2] }
[[solid]]
kind = "box"
size = [2, 2, 1]
operation = "subtract"
axis = { origin = [3, 3, 1.5] }
"#;

/// A ring as four quarters.
const QUARTERS: &str = r#"
[[solid]]
kind = "torus"
major = 2
minor = 1
angle = 90
[[solid]]
kind = "torus"
major = 2
minor = 1
start = 90
angle = 90
[[solid]]
kind = "torus"
major = 2
minor = 1
start = 180
angle = 90
[[solid]]
kind = "torus"
major = 2
minor = 1
start = 270
angle = 90
"#;

/// A ring less half of it.
const HALF: &str = r#"
[profiles.tube]
curves = [{ kind = "circle", center = [2, 0], radius = 0.5 }]
[[solid]]
kind = "revolve"
profile = "tube"
[[solid]]
kind = "revolve"
profile = "tube"
operation = "subtract"
start = 20
angle = 180
"#;

const EQUAL_ELLIPSOIDS: &str = r#"
[[solid]]
kind = "ellipsoid"
radii = [0.6, 1.0, 0.3]
[[solid]]
kind = "ellipsoid"
radii = [0.6, 1.0, 0.3]
operation = "intersect"
"#;

fn scene(text: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{text}")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Shared, flush and coincident faces; the vessel's volume by quadrature of chords.
#[test]
fn shared_faces_and_a_port() {
    let mut failures = String::new();
    for (name, text, volume, most) in [
        ("vessel", VESSEL, 101.545_615_564_393_34, 1e-9),
        ("elbow", ELBOW, PI * (6.0 + 2.0 * PI), 1e-10),
        ("flush", FLUSH, 252.0 - 16.0 * PI, 1e-10),
        ("quarters", QUARTERS, 4.0 * PI * PI, 1e-10),
        ("half", HALF, 0.5 * PI * PI, 1e-10),
        ("ellipsoids", EQUAL_ELLIPSOIDS, 0.24 * PI, 1e-12),
    ] {
        let found = scene(text).measures().expect("measured");
        let off = (found.volume - volume).abs() / volume;
        let estimate = found.error_estimate.volume / volume;
        eprintln!("{name:12} off by {off:.1e}, estimate {estimate:.1e}");
        if off > estimate + 1e-14 || estimate > most {
            let _ = writeln!(failures, "{name}: off by {off:e}, estimate {estimate:e}");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Tori a billionth of a radian apart: the common part is the torus but for that, and the estimate says how well.
#[test]
fn nearly_equal_tori() {
    let torus = "[[solid]]\nkind = 'torus'\nmajor = 2\nminor = 1\n";
    let tilted = "axis = { direction = [1e-9, 0, 1] }\noperation = 'intersect'\n";
    let text = format!("{torus}{torus}{tilted}");
    let found = scene(&text).measures().expect("measured");
    let volume = 4.0 * PI * PI;
    let off = (found.volume - volume).abs() / volume;
    let estimate = found.error_estimate.volume / volume;
    assert!(off <= estimate + 1e-8, "{off:e}, {estimate:e}");
    assert!(estimate < 1e-2, "{estimate:e}");
}

/// What is so thin beside its reach that its points fall together is refused, not measured as nothing.
#[test]
fn a_profile_of_extreme_aspect() {
    let text = |far: &str| {
        format!(
            "schema = 1\n[profiles.a]\nboundary = 'closed'\n[[profiles.a.curves]]\nkind = 'polyline'\n\
             points = [[10, 74], [15, 74], [16, 75], [{far}, 81], [15, 82], [10, 82], [10, 74]]\n\
             [[solid]]\nkind = 'revolve'\nprofile = 'a'\n"
        )
    };
    let refused = Scene::parse(&text("1e30"))
        .expect_err("too thin")
        .to_string();
    assert!(refused.contains("thick"), "{refused}");
    // At 1e12 the volume is that of the two cones about the disc's edge, by Pappus's rule for polygons.
    let found = Scene::parse(&text("1e12")).expect("a scene").measures();
    let found = found.expect("measured");
    let points = [
        [10.0, 74.0],
        [15.0, 74.0],
        [16.0, 75.0],
        [1e12, 81.0],
        [15.0, 82.0],
        [10.0, 82.0],
        [10.0, 74.0],
    ];
    let volume: f64 = (points.windows(2))
        .map(|w| {
            let ([r, y], [s, z]) = (w[0], w[1]);
            PI / 3.0 * (z - y) * (r * r + r * s + s * s)
        })
        .sum();
    assert!((found.volume - volume).abs() <= found.error_estimate.volume + 1e-13 * volume);
}

/// Of a solid that is far longer than the others are thick no total is told; before it is so long, the right one.
#[test]
fn a_rod_as_long_as_a_country() {
    for (length, told) in [(1e3, true), (1e5, true), (1.5e9, false)] {
        let half = 0.5 * length;
        let rod = cylinder(1.0, [-half, 0.0, 0.0], [1.0, 0.0, 0.0], length, "add");
        let other = cylinder(1.0, [0.0, 0.0, -2.0], [0.0, 0.0, 1.0], 4.0, "intersect");
        let found = scene(&format!("[[solid]]\n{rod}\n[[solid]]\n{other}\n")).measures();
        assert_eq!(found.is_some(), told, "{length}: {found:?}");
        if let Some(found) = found {
            let off = (found.volume - 16.0 / 3.0).abs();
            assert!(off <= found.error_estimate.volume, "{length}: {found:?}");
        }
    }
}

/// One of each kind.
#[test]
fn totals_of_composites() {
    let mut failures = String::new();
    for number in 0..KINDS.len() as u64 {
        let r = measured(number, &mut failures);
        eprintln!(
            "{:16} off by {:.1e}, estimate {:.1e}, {:.2} s",
            r.name, r.error, r.estimate, r.seconds
        );
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Three hundred, with a table of the worst of each kind.
#[test]
#[ignore = "minutes; --ignored --nocapture shows the table"]
fn totals_of_many_composites() {
    let mut failures = String::new();
    let results: Vec<Result> = (0..300).map(|n| measured(n, &mut failures)).collect();
    let mut names: Vec<&str> = results.iter().map(|r| r.name).collect();
    names.sort_unstable();
    names.dedup();
    let median = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let worst = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(*x));
    let line = |name: &str, of: &[&Result]| {
        let list = |f: fn(&Result) -> f64| of.iter().map(|r| f(r)).collect::<Vec<f64>>();
        let (errors, estimates) = (list(|r| r.error), list(|r| r.estimate));
        let seconds = list(|r| r.seconds);
        eprintln!(
            "{name:16} {:4} error {:.1e} (median {:.1e}) estimate {:.1e} (median {:.1e}) seconds {:.2} (median {:.2})",
            of.len(),
            worst(&errors),
            median(errors.clone()),
            worst(&estimates),
            median(estimates.clone()),
            worst(&seconds),
            median(seconds.clone())
        );
    };
    for name in names {
        let of: Vec<&Result> = results.iter().filter(|r| r.name == name).collect();
        line(name, &of);
    }
    let all: Vec<&Result> = results.iter().collect();
    line("all", &all);
    let over: Vec<f64> = all
        .iter()
        .map(|r| r.estimate / r.error.max(1e-16))
        .collect();
    eprintln!("estimate over error, median {:.1e}", median(over));
    assert!(failures.is_empty(), "{failures}");
}

/// Two parts of a turn less a box sum to the whole less the box, however all of it lies in space. The box's faces cross
/// the axis, where the caps' edges meet at an angle that no rule's points need see.
#[test]
fn parts_of_a_turn_sum_to_the_whole() {
    let volume = |turn: &str, place: &str| {
        let text = format!(
            "schema = 1\n[[solid]]\nkind = 'cylinder'\nradius = 2\nheight = 3\n{turn}\n\
             axis = {{ origin = [0.5, 1, -0.25], direction = [1, 2, 3], x = [0, 1, 0.5] }}\n\
             place = [{place}]\n\
             [[solid]]\nkind = 'box'\nsize = [2, 3, 2]\noperation = 'subtract'\n\
             axis = {{ origin = [1, 1, 1], direction = [0, 1, 4] }}\nplace = [{place}]"
        );
        let scene = Scene::parse(&text).expect("a scene");
        let found = scene.assembly().measures().expect("measured");
        (found.volume, found.error_estimate.volume)
    };
    for place in ["", "{ rotate = { axis = [1, 2, 3], degrees = 33 } }"] {
        let whole = volume("", place);
        for degrees in [185, 200, 270] {
            let part = volume(&format!("start = 10\nangle = {degrees}"), place);
            let (start, angle) = (10 + degrees, 360 - degrees);
            let rest = volume(&format!("start = {start}\nangle = {angle}"), place);
            let off = (part.0 + rest.0 - whole.0).abs();
            let claimed = part.1 + rest.1 + whole.1;
            assert!(
                off <= claimed && claimed <= 1e-11 * whole.0,
                "{degrees}: off by {off:e}, claimed {claimed:e}"
            );
        }
    }
}
