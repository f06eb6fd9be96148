//! Exact measures of composites by the command, against closed forms and integrals of one variable
//! done in 30 digits.

#![allow(
    clippy::excessive_precision,
    reason = "figures of 30 digits, rounded by the compiler"
)]

#[path = "support/command.rs"]
mod support;

use std::f64::consts::PI;

use serde_json::Value;
use support::{run_within, scratch};

/// Moments of a solid: volume, area, first moments, and second moments xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy)]
struct Moments {
    volume: f64,
    area: f64,
    first: [f64; 3],
    second: [f64; 6],
}

impl Moments {
    /// About the origin, of a body whose centroid is there.
    fn new(volume: f64, area: f64, second: [f64; 3]) -> Self {
        let [x, y, z] = second;
        Self {
            volume,
            area,
            first: [0.0; 3],
            second: [x, y, z, 0.0, 0.0, 0.0],
        }
    }

    /// A cylinder along z; its area is that of `lateral` and `flat`, added or taken away.
    fn cylinder(r: f64, h: f64, area: f64) -> Self {
        let v = PI * r * r * h;
        Self::new(
            v,
            area,
            [v * r * r / 4.0, v * r * r / 4.0, v * h * h / 12.0],
        )
    }

    fn moved(self, by: [f64; 3]) -> Self {
        let (v, m) = (self.volume, self.first);
        let pair = |k: usize, i: usize, j: usize| {
            self.second[k] + m[i] * by[j] + m[j] * by[i] + v * by[i] * by[j]
        };
        Self {
            volume: v,
            area: self.area,
            first: [0, 1, 2].map(|i| m[i] + v * by[i]),
            second: [
                pair(0, 0, 0),
                pair(1, 1, 1),
                pair(2, 2, 2),
                pair(3, 0, 1),
                pair(4, 0, 2),
                pair(5, 1, 2),
            ],
        }
    }

    fn plus(self, other: Self, sign: f64) -> Self {
        Self {
            volume: self.volume + sign * other.volume,
            area: self.area + other.area,
            first: std::array::from_fn(|i| self.first[i] + sign * other.first[i]),
            second: std::array::from_fn(|i| self.second[i] + sign * other.second[i]),
        }
    }

    fn scaled(self, k: f64) -> Self {
        Self {
            volume: self.volume * k.powi(3),
            area: self.area * k * k,
            first: self.first.map(|x| x * k.powi(4)),
            second: self.second.map(|x| x * k.powi(5)),
        }
    }

    fn centroid(&self) -> [f64; 3] {
        self.first.map(|m| m / self.volume)
    }

    /// About the centroid.
    fn inertia(&self) -> [[f64; 3]; 3] {
        let c = self.centroid();
        let away = self.moved(c.map(|x| -x)).second;
        let [xx, yy, zz, xy, xz, yz] = away;
        [
            [yy + zz, -xy, -xz],
            [-xy, xx + zz, -yz],
            [-xz, -yz, xx + yy],
        ]
    }
}

/// A solid's text: profile key, then the keys of the solid.
fn scene(solids: &[(&str, &str)]) -> String {
    let mut text = String::from("schema = 1\n");
    for (i, (profile, _)) in solids.iter().enumerate() {
        text += &format!("[profiles.p{i}]\nboundary = 'to-axis'\ncurves = [{profile}]\n");
    }
    for (i, (_, keys)) in solids.iter().enumerate() {
        text += &format!("[[solid]]\nkind = 'revolve'\nprofile = 'p{i}'\n{keys}\n");
    }
    text
}

fn wall(r: f64, z0: f64, z1: f64) -> String {
    format!("{{ kind = 'polyline', points = [[{r:?}, {z0:?}], [{r:?}, {z1:?}]] }}")
}

fn ball(r: f64) -> String {
    format!("{{ kind = 'arc', center = [0, 0], radius = {r:?}, from = -90, to = 90 }}")
}

const CUT: &str = "operation = 'subtract'\n";
const COMMON: &str = "operation = 'intersect'\n";

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("{v} is no number"))
}

/// The largest of a number or of (nested) lists of them.
fn largest(v: &Value) -> f64 {
    match v {
        Value::Array(all) => all.iter().map(largest).fold(0.0, f64::max),
        other => number(other),
    }
}

fn measure(text: &str) -> Value {
    let folder = scratch();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("a scene is written");
    let path = path.display().to_string();
    let limit = std::time::Duration::from_secs(60);
    run_within(limit, "", &["measure", &path, "--json"])
        .exits(0)
        .json()
}

/// Compares the total with what is known. `size` is the longest side.
fn check(
    name: &str,
    text: &str,
    wanted: &Moments,
    bounds: Option<[[f64; 3]; 2]>,
    size: f64,
    failures: &mut String,
) {
    let document = measure(text);
    let total = &document["total"];
    let estimate = &total["error_estimate"];
    let scale = wanted.volume.max(f64::MIN_POSITIVE);
    let mut one = |what: &str, error: f64, claimed: f64, scale: f64| {
        let most = 1e4 * error.max(1e-15 * scale);
        eprintln!(
            "{name:44} {what:9} off by {:.1e}, claimed {:.1e}",
            error / scale,
            claimed / scale
        );
        if error > claimed || claimed > most || claimed.is_nan() || error.is_nan() {
            *failures += &format!(
                "{name}: {what}: true error {error:e}, estimate {claimed:e}, scale {scale:e}\n"
            );
        }
    };
    let off = number(&total["volume"]) - wanted.volume;
    one("volume", off.abs(), number(&estimate["volume"]), scale);
    let off = number(&total["area"]) - wanted.area;
    one("area", off.abs(), number(&estimate["area"]), wanted.area);
    let c = wanted.centroid();
    let off = (0..3).map(|i| (number(&total["centroid"][i]) - c[i]).abs());
    let reach = size + c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let off = off.fold(0.0, f64::max);
    one("centroid", off, largest(&estimate["centroid"]), reach);
    let inertia = wanted.inertia();
    let mut off: f64 = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            off = off.max((number(&total["inertia"][i][j]) - inertia[i][j]).abs());
        }
    }
    one(
        "inertia",
        off,
        largest(&estimate["inertia"]),
        scale * size * size,
    );
    if let Some(bounds) = bounds {
        for (side, corner) in bounds.iter().enumerate() {
            for (a, &wanted) in corner.iter().enumerate() {
                let found = number(&total["bounds"][side][a]);
                if (found - wanted).abs() > 1e-9 * reach {
                    *failures += &format!("{name}: bounds {side} {a}: {found}, wanted {wanted}\n");
                }
            }
        }
    }
}

const X: &str = "axis = { direction = [1, 0, 0] }\n";
const Y: &str = "axis = { direction = [0, 1, 0] }\n";

#[test]
fn crossing_bars() {
    let mut failures = String::new();
    let bar = wall(1.0, -2.0, 2.0);
    let x = format!("{X}{COMMON}");
    let y = format!("{Y}{COMMON}");
    // Every face touches the ball of radius 1: the area is three volumes.
    check(
        "two bars",
        &scene(&[(&bar, ""), (&bar, &x)]),
        &Moments::new(16.0 / 3.0, 16.0, [64.0 / 45.0, 16.0 / 15.0, 64.0 / 45.0]),
        Some([[-1.0; 3], [1.0; 3]]),
        2.0,
        &mut failures,
    );
    let root = 2_f64.sqrt();
    check(
        "three bars",
        &scene(&[(&bar, ""), (&bar, &x), (&bar, &y)]),
        &Moments::new(
            8.0 * (2.0 - root),
            24.0 * (2.0 - root),
            [(176.0 - 92.0 * root) / 45.0; 3],
        ),
        Some([[-1.0; 3], [1.0; 3]]),
        2.0,
        &mut failures,
    );
    // At 60 degrees: volume 16 / (3 sin), area 16 / sin; the sheared square turned about y.
    let (s, c) = (0.75_f64.sqrt(), 0.5);
    let slant = format!("axis = {{ direction = [{s:?}, 0, {c:?}] }}\n{COMMON}");
    let keys = "place = [{ scale = 3 }]\n";
    let text = scene(&[(&bar, keys), (&bar, &format!("{slant}{keys}"))]);
    let document = measure(&text);
    let total = &document["total"];
    for (what, wanted) in [("volume", 27.0 * 16.0 / 3.0 / s), ("area", 9.0 * 16.0 / s)] {
        let error = (number(&total[what]) - wanted).abs();
        let claimed = number(&total["error_estimate"][what]);
        eprintln!("bars at 60 degrees, {what}: off by {error:e}, claimed {claimed:e}");
        // The sine of the text is rounded.
        if error > claimed + 1e-14 * wanted || claimed > 1e4 * error.max(1e-15 * wanted) {
            failures += &format!("60 degrees: {what}: {error:e}, {claimed:e}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Balls of radius 2 at the origin and 1.5 at (2, 0, 0), their axes apart; they meet at x = 1.4375.
#[test]
fn two_balls() {
    let mut failures = String::new();
    let (a, b) = (ball(2.0), ball(1.5));
    let at = "axis = { origin = [2, 0, 0] }\n";
    for (name, op, volume, area, x, axial, across, bounds) in [
        (
            "balls united",
            "",
            42.566_944_209_967_954,
            62.635_503_530_946_503,
            0.510_174_418_604_651_16,
            62.855_460_396_962_763,
            101.082_225_399_695_32,
            [[-2.0, -2.0, -2.0], [3.5, 2.0, 2.0]],
        ),
        (
            "lens",
            COMMON,
            5.080_544_369_477_243_8,
            15.904_312_808_798_328,
            1.290_760_869_565_217_4,
            3.484_504_471_341_704,
            2.262_660_636_914_926,
            [
                [0.5, -1.390_537_216_330_436_8, -1.390_537_216_330_436_8],
                [2.0, 1.390_537_216_330_436_8, 1.390_537_216_330_436_8],
            ],
        ),
        (
            "bite",
            CUT,
            28.429_777_268_813_884,
            52.032_628_325_080_951,
            -0.230_665_467_625_899_28,
            50.132_010_149_924_101,
            41.376_693_236_468_842,
            [[-2.0, -2.0, -2.0], [1.4375, 2.0, 2.0]],
        ),
    ] {
        let m = Moments::new(
            volume,
            area,
            [across - axial / 2.0, axial / 2.0, axial / 2.0],
        );
        let m = m.moved([x, 0.0, 0.0]);
        let keys = format!("{at}{op}");
        let text = scene(&[(&a, ""), (&b, &keys)]);
        check(name, &text, &m, Some(bounds), 5.5, &mut failures);
        // Larger, elsewhere.
        let place = "place = [{ scale = 1000 }, { translate = [10, -2000, 0.5] }]\n";
        let text = scene(&[(&a, place), (&b, &format!("{keys}{place}"))]);
        let m = m.scaled(1000.0).moved([10.0, -2000.0, 0.5]);
        check(name, &text, &m, None, 5500.0, &mut failures);
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn a_bar_with_a_hole_across() {
    let mut failures = String::new();
    let (bar, hole) = (wall(1.0, -2.0, 2.0), wall(0.5, -3.0, 3.0));
    let m = Moments::new(
        11.046_330_626_186_275,
        35.660_579_827_415_8,
        [
            2.665_504_435_218_389_2,
            3.049_817_320_531_106_9,
            16.659_082_597_817_385,
        ],
    );
    let keys = format!("{X}{CUT}");
    check(
        "bar with a hole across",
        &scene(&[(&bar, ""), (&hole, &keys)]),
        &m,
        Some([[-1.0, -1.0, -2.0], [1.0, 1.0, 2.0]]),
        4.0,
        &mut failures,
    );
    assert!(failures.is_empty(), "{failures}");
}

/// Plates with holes along their axis.
#[test]
fn plates_with_holes() {
    let mut failures = String::new();
    let plate = wall(4.0, 0.0, 0.5);
    let hole = wall(0.375, 0.0, 0.5);
    let long = wall(0.375, -1.0, 1.5);
    let t = 0.5;
    let disc = |r: f64| Moments::cylinder(r, t, 2.0 * PI * r * (r + t));
    let bored = |r: f64| Moments::cylinder(r, t, 2.0 * PI * r * (t - r));
    for (name, pierce) in [("coplanar holes", &hole), ("long holes", &long)] {
        let one = disc(4.0).plus(bored(0.375).moved([3.0, 0.0, 0.0]), -1.0);
        let keys = format!("axis = {{ origin = [3, 0, 0] }}\n{CUT}");
        check(
            &format!("plate, one of {name}"),
            &scene(&[(&plate, ""), (pierce, &keys)]),
            &one.moved([0.0, 0.0, 0.25]),
            Some([[-4.0, -4.0, 0.0], [4.0, 4.0, 0.5]]),
            8.0,
            &mut failures,
        );
        let mut all = disc(4.0).plus(bored(1.0), -1.0);
        let bore = wall(1.0, 0.0, 0.5);
        let mut solids = vec![
            (plate.as_str(), String::new()),
            (bore.as_str(), CUT.to_owned()),
        ];
        for (x, y) in [(3.0, 0.0), (0.0, 3.0), (-3.0, 0.5)] {
            all = all.plus(bored(0.375).moved([x, y, 0.0]), -1.0);
            let keys = format!("axis = {{ origin = [{x:?}, {y:?}, 0] }}\n{CUT}");
            solids.push((pierce, keys));
        }
        let list: Vec<(&str, &str)> = solids.iter().map(|(p, k)| (*p, k.as_str())).collect();
        check(
            &format!("flange with {name}"),
            &scene(&list),
            &all.moved([0.0, 0.0, 0.25]),
            Some([[-4.0, -4.0, 0.0], [4.0, 4.0, 0.5]]),
            8.0,
            &mut failures,
        );
        // Along x, moved.
        let place = "place = [{ rotate = { axis = [0, 1, 0], degrees = 90 } }, { translate = [5, 6, 7] }]\n";
        let turned: Vec<(&str, String)> = solids
            .iter()
            .map(|(p, k)| (*p, format!("{k}{place}")))
            .collect();
        let list: Vec<(&str, &str)> = turned.iter().map(|(p, k)| (*p, k.as_str())).collect();
        // A quarter turn about y: (x, y, z) to (z, y, -x).
        let m = all.moved([0.0, 0.0, 0.25]);
        let [xx, yy, zz, xy, xz, yz] = m.second;
        let m = Moments {
            first: [m.first[2], m.first[1], -m.first[0]],
            second: [zz, yy, xx, yz, -xz, -xy],
            ..m
        };
        check(
            &format!("flange with {name}, turned"),
            &scene(&list),
            &m.moved([5.0, 6.0, 7.0]),
            Some([[5.0, 2.0, 3.0], [5.5, 10.0, 11.0]]),
            8.0,
            &mut failures,
        );
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn wedges_and_coaxial_solids() {
    let mut failures = String::new();
    let wedge = format!("angle = 90\n{COMMON}");
    let m = Moments {
        volume: PI / 3.0,
        area: 2.0 * PI,
        first: [PI / 8.0, PI / 8.0, 0.0],
        second: [PI / 15.0, PI / 15.0, PI / 15.0, 2.0 / 15.0, 0.0, 0.0],
    };
    check(
        "a quarter of a ball",
        &scene(&[(&ball(1.0), ""), (&wall(2.0, -2.0, 2.0), &wedge)]),
        &m,
        Some([[0.0, 0.0, -1.0], [1.0, 1.0, 1.0]]),
        2.0,
        &mut failures,
    );
    let pipe = Moments::cylinder(2.0, 3.0, 2.0 * PI * (2.0 * 3.0 + 4.0))
        .plus(Moments::cylinder(1.0, 3.0, 2.0 * PI * (3.0 - 1.0)), -1.0);
    check(
        "pipe by coincident caps",
        &scene(&[(&wall(2.0, 0.0, 3.0), ""), (&wall(1.0, 0.0, 3.0), CUT)]),
        &pipe.moved([0.0, 0.0, 1.5]),
        Some([[-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]]),
        4.0,
        &mut failures,
    );
    // Halves that meet in a plane, each a wedge: no area between them.
    let whole = Moments::cylinder(2.0, 3.0, 2.0 * PI * (2.0 * 3.0 + 4.0));
    check(
        "wedges that make a whole",
        &scene(&[
            (&wall(2.0, 0.0, 3.0), "angle = 200\n"),
            (&wall(2.0, 0.0, 3.0), "start = 200\nangle = 160\n"),
        ]),
        &whole.moved([0.0, 0.0, 1.5]),
        Some([[-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]]),
        4.0,
        &mut failures,
    );
    // Stacked on parallel axes: the common part of the caps is no surface.
    let (a, b) = (
        Moments::cylinder(2.0, 1.0, 2.0 * PI * (2.0 + 4.0)),
        Moments::cylinder(1.0, 1.0, 2.0 * PI * (1.0 - 1.0 + 1.0) - 2.0 * PI * 1.0),
    );
    let stack = a
        .moved([0.0, 0.0, 0.5])
        .plus(b.moved([0.5, 0.25, 1.5]), 1.0);
    // Both caps of the smaller one: one is new, one covers as much of the larger one's.
    let stack = Moments {
        area: 2.0 * PI * (2.0 + 4.0) + 2.0 * PI,
        ..stack
    };
    check(
        "stack on parallel axes",
        &scene(&[
            (&wall(2.0, 0.0, 1.0), ""),
            (&wall(1.0, 0.0, 1.0), "axis = { origin = [0.5, 0.25, 1] }\n"),
        ]),
        &stack,
        Some([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]]),
        4.0,
        &mut failures,
    );
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn nothing_has_no_measure() {
    let bar = wall(1.0, 0.0, 2.0);
    let far = format!("axis = {{ origin = [5, 0, 0] }}\n{COMMON}");
    for text in [
        scene(&[(&bar, ""), (&bar, CUT)]),
        scene(&[(&bar, ""), (&bar, &far)]),
        scene(&[(&bar, ""), (&wall(2.0, 0.0, 2.0), CUT)]),
    ] {
        let document = measure(&text);
        let total = &document["total"];
        assert_eq!(number(&total["volume"]), 0.0);
        assert_eq!(number(&total["area"]), 0.0);
        assert!(total["bounds"].is_null(), "{total}");
        // Each solid is still itself.
        let solid = &document["solids"][0];
        assert!((number(&solid["volume"]) - 2.0 * PI).abs() < 1e-12);
        assert!(solid["bounds"].is_array());
    }
}

/// The solids of a composite are measured by themselves, whatever is done with them.
#[test]
fn solids_are_measured_alone() {
    let text = scene(&[
        (&wall(2.0, 0.0, 1.0), "name = 'plate'\n"),
        (&wall(0.5, -1.0, 1.0), &format!("name = 'hole'\n{X}{CUT}")),
    ]);
    let document = measure(&text);
    for (k, name, r, h) in [(0, "plate", 2.0, 1.0), (1, "hole", 0.5, 2.0)] {
        let solid = &document["solids"][k];
        assert_eq!(solid["name"], name);
        let (volume, area) = (PI * r * r * h, 2.0 * PI * r * (r + h));
        assert!((number(&solid["volume"]) - volume).abs() < 1e-13 * volume);
        assert!((number(&solid["area"]) - area).abs() < 1e-13 * area);
    }
}
