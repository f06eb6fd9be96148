//! Volume, area, centroid and inertia against an integration in 256-bit floats, and the estimates of
//! their errors against the errors.

mod support;

use std::f64::consts::PI;
use std::fmt::Write;

use rayon::prelude::*;
use support::hard;
use support::integrals::{Exact, exact};
use support::oracle::{Big, Oracle, big, small};
use support::text::scene_text;
use voxlathe::Scene;
use voxlathe::solid::Measures;

/// Largest error asked of any profile, relative to the scale of the quantity.
const BOUND: f64 = 1e-13;

/// True error, estimate and scale of one quantity.
struct Figure {
    what: &'static str,
    error: f64,
    estimate: f64,
    scale: f64,
}

fn off(found: f64, exact: &Big) -> f64 {
    small(&(big(found) - exact)).abs()
}

fn figures(found: &Measures, exact: &Exact) -> [Figure; 4] {
    let size = found.bounds.expect("bounds").longest_side();
    let volume = small(&exact.volume);
    let e = &found.error_estimate;
    let centroid = found.centroid.expect("a centroid").to_array();
    let away = centroid.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let centre = (0..3).map(|i| off(centroid[i], &exact.centroid[i]).powi(2));
    let mut tensor = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            assert_eq!(
                found.inertia[i][j].to_bits(),
                found.inertia[j][i].to_bits(),
                "not symmetric"
            );
            tensor += (off(found.inertia[i][j], &exact.inertia[i][j]) / e.inertia).powi(2);
        }
    }
    [
        Figure {
            what: "volume",
            error: off(found.volume, &exact.volume),
            estimate: e.volume,
            scale: volume,
        },
        Figure {
            what: "area",
            error: off(found.area, &exact.area),
            estimate: e.area,
            scale: small(&exact.area),
        },
        Figure {
            what: "centroid",
            error: centre.sum::<f64>().sqrt(),
            estimate: e.centroid,
            // A coordinate far away is no better than its own rounding.
            scale: size.max(away * f64::EPSILON / BOUND),
        },
        Figure {
            what: "inertia",
            error: tensor.sqrt() * e.inertia,
            estimate: e.inertia,
            scale: volume * size * size,
        },
    ]
}

/// The scene's only solid, where its loops do not cross.
fn compare(name: &str, scene: &Scene) -> (String, Vec<Figure>) {
    let oracle = Oracle::new(scene.model());
    let mut failures = String::new();
    let mut all = Vec::new();
    for (solid, part) in oracle.solids.iter().zip(scene.assembly().parts()) {
        let (found, wanted) = (part.measures(), exact(solid));
        for f in figures(&found, &wanted) {
            // There the segment that closes the gap runs back along an edge: a sheet, which the
            // region does not have and the oracle does not see.
            if name == "closed within the gap" && f.what == "area" {
                continue;
            }
            let Figure {
                what,
                error,
                estimate,
                scale,
            } = f;
            let says = |why: &str| {
                format!(
                    "{name}: {what} {why}: error {error:e}, estimate {estimate:e}, scale {scale:e}\n"
                )
            };
            if !(error <= BOUND * scale) {
                failures += &says("is wrong");
            }
            if !(error <= estimate) {
                failures += &says("is worse than estimated");
            }
            if !(estimate <= 1e4 * error.max(1e-15 * scale)) {
                failures += &says("is better than estimated by far");
            }
            all.push(f);
        }
    }
    (failures, all)
}

fn check(title: &str, scenes: &[(String, Scene)]) {
    let plain: Vec<_> = scenes
        .iter()
        .filter(|s| s.1.warnings().is_empty())
        .collect();
    let compared: Vec<_> = plain
        .par_iter()
        .map(|(name, scene)| compare(name, scene))
        .collect();
    let mut report = String::new();
    for what in ["volume", "area", "centroid", "inertia"] {
        let of = || {
            compared
                .iter()
                .flat_map(|c| &c.1)
                .filter(|f| f.what == what)
        };
        let worst = |f: &dyn Fn(&Figure) -> f64| of().map(f).fold(0.0_f64, f64::max);
        writeln!(
            report,
            "{title}: {what:9} worst error {:.1e}, worst estimate {:.1e} of the scale, estimate / max(error, 1e-15) at most {:.1e}",
            worst(&|f| f.error / f.scale),
            worst(&|f| f.estimate / f.scale),
            worst(&|f| f.estimate / f.error.max(1e-15 * f.scale)),
        )
        .expect("text");
    }
    eprint!("{report}");
    let failures: String = compared.iter().map(|c| c.0.as_str()).collect();
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn shipped_scenes_agree_with_the_oracle() {
    let scenes = hard::shipped();
    assert!(scenes.len() >= 10);
    check("shipped", &scenes);
}

#[test]
fn hard_scenes_agree_with_the_oracle() {
    let scenes = hard::scenes(false);
    let skipped: Vec<&str> = scenes
        .iter()
        .filter(|s| !s.1.warnings().is_empty())
        .map(|s| s.0.as_str())
        .collect();
    eprintln!("not compared, for they cross themselves: {skipped:?}");
    assert!(skipped.len() < 6, "{skipped:?}");
    check("hard", &scenes);
}

#[test]
fn scales_and_placements_keep_the_accuracy() {
    let mut scenes = Vec::new();
    for (name, scene) in hard::shipped() {
        if !["goblet", "nozzle", "vase", "half_torus"].contains(&name.as_str()) {
            continue;
        }
        for (scale, steps) in [
            (1e6, ""),
            (1e-6, ""),
            (1.0, "{ translate = [1e6, -2e6, 3e6] }"),
            (
                1e-3,
                "{ rotate = { axis = [1, -2, 0.3], degrees = 77 } }, { translate = [1e6, 0, 0.1] }",
            ),
            (
                1.0,
                "{ scale = 1e-6 }, { rotate = { axis = [1, 1, 1], degrees = -40 } }",
            ),
        ] {
            let text = scene_text(scene.model(), scale, steps);
            let made = Scene::parse(&text).unwrap_or_else(|e| panic!("{name}: {e}\n{text}"));
            scenes.push((format!("{name} x {scale:e}, {steps}"), made));
        }
    }
    check("placed", &scenes);
}

fn solid(profile: &str, keys: &str) -> Scene {
    let text = format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{keys}\n"
    );
    Scene::parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// A clamped cubic of `pieces` pieces around a wavy wall, weights from 0.2 to 5.
fn long_curve(pieces: i32) -> String {
    let mut points = String::new();
    let mut weights = String::new();
    for i in 0..pieces + 3 {
        let t = f64::from(i);
        let r = 3.0 + (0.9 * t).sin() + 0.5 * (0.13 * t).cos();
        write!(points, "[{r:?}, {:?}], ", 0.2 * t).expect("text");
        write!(weights, "{:?}, ", 5_f64.powf((1.7 * t).sin())).expect("text");
    }
    format!(
        "boundary = 'to-axis'\ncurves = [{{ kind = 'nurbs', degree = 3, points = [{points}], weights = [{weights}] }}]"
    )
}

#[test]
fn cusps_weights_and_long_curves_agree_with_the_oracle() {
    let bezier = |points: &str, weights: &str| {
        format!(
            "boundary = 'to-axis'\ncurves = [{{ kind = 'bezier', points = [{points}], weights = [{weights}] }}]"
        )
    };
    let plain = |points: &str| {
        format!("boundary = 'to-axis'\ncurves = [{{ kind = 'bezier', points = [{points}] }}]")
    };
    let mut scenes = Vec::new();
    let mut add = |name: &str, profile: &str, keys: &str| {
        scenes.push((name.to_owned(), solid(profile, keys)));
    };
    for near in [0.0, 1e-3, 1e-6, 1e-9, 1e-13] {
        let points = format!("[6, 0], [4, {:?}], [4, {near:?}], [6, 2]", 2.0 - near);
        add(
            &format!("a cusp but for {near:e}"),
            &plain(&points),
            "angle = 140",
        );
    }
    add(
        "repeated first and last points",
        &plain("[1, 0], [1, 0], [1, 0], [3, 1], [2, 2], [2, 2], [2, 2], [2, 2]"),
        "",
    );
    add(
        "repeated points amid a curve",
        &plain("[1, 0], [2, 1], [2, 1], [2, 1], [2, 1], [2, 1], [1.5, 3]"),
        "angle = 30\nstart = 5",
    );
    add(
        "all but one point the same",
        &plain("[2, 0], [2, 0], [2, 0], [2, 0], [1, 1]"),
        "",
    );
    add(
        "weights of 1e-9 and 1e9",
        &bezier("[1, 0], [3, 0.5], [0.5, 1], [2, 2]", "1, 1e9, 1e-9, 1"),
        "angle = 200",
    );
    add(
        "weights of 1 and 1e-12",
        &bezier("[1, 0], [3, 0.5], [2, 2]", "1, 1e-12, 1"),
        "",
    );
    add("260 pieces", &long_curve(260), "angle = 311");
    add(
        "a slim wedge far from its axis",
        "curves = [{ kind = 'ellipse', center = [1e6, 3], radii = [0.5, 0.25], tilt = 30 }]",
        "angle = 1e-5\nstart = 12",
    );
    add(
        "a thin wall, part of a turn",
        "loops = [[{ kind = 'circle', center = [2, 0], radius = 1 }], \
         [{ kind = 'circle', center = [2, 0], radius = 0.9999999999 }]]",
        "angle = 15",
    );
    add(
        "a needle",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1e-6, 0], [3e-6, 1], [1e-7, 2]] }]",
        "angle = 270",
    );
    add(
        "a disc",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1, 0], [1.1, 2e-7], [1, 3e-7]] }]",
        "place = [{ rotate = { axis = [1, 1, 0], degrees = 30 } }]",
    );
    check("built", &scenes);
}

/// Volume and area of scenes whose loops or solids meet, with closed forms.
#[test]
fn crossing_loops_and_joined_solids_agree_with_closed_forms() {
    let eight = "[1, 0], [3, 2], [3, 0], [1, 2], [1, 0]";
    // Two circles of radius 1 a diagonal apart: the lens between them.
    let d = 0.5_f64.sqrt();
    let angle = 2.0 * (d / 2.0).acos();
    let lens = angle - (d / 2.0) * (4.0 - d * d).sqrt();
    let circles = |fill: &str| {
        solid(
            &format!(
                "fill = '{fill}'\nloops = [[{{ kind = 'circle', center = [3, 0], radius = 1 }}], \
                 [{{ kind = 'circle', center = [3.5, 0.5], radius = 1 }}]]"
            ),
            "",
        )
    };
    let cylinder = |r: f64, from: f64, to: f64| {
        format!(
            "curves = [{{ kind = 'polyline', points = [[{r:?}, {from:?}], [{r:?}, {to:?}]] }}]\n"
        )
    };
    let joined = |profiles: [String; 2], keys: &[String; 2]| {
        let mut text = String::from("schema = 1\n");
        for (i, p) in profiles.iter().enumerate() {
            write!(text, "[profiles.p{i}]\nboundary = 'to-axis'\n{p}").expect("text");
        }
        for i in 0..2 {
            write!(
                text,
                "[[solid]]\nkind = 'revolve'\nprofile = 'p{i}'\n{}\n",
                keys[i]
            )
            .expect("text");
        }
        Scene::parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
    };
    let plain = [String::new(), String::new()];
    let ball = "curves = [{ kind = 'arc', center = [0, 0], radius = 1, from = -90, to = 90 }]\n"
        .to_owned();
    // A ball with a rod of half its radius from the centre to twice the radius.
    let s = 0.75_f64.sqrt();
    let cap = PI * (1.0 - s) * (1.0 - s) * (2.0 + s) / 3.0;
    let rod = PI * 0.25 * (2.0 - s);
    let half_ball =
        "curves = [{ kind = 'arc', center = [0, 0], radius = 1, from = 0, to = 90 }]\n".to_owned();
    let tilted = "place = [{ rotate = { axis = [1, 0, 0], degrees = SIDE } }, \
                  { rotate = { axis = [1, 2, 3], degrees = 31 } }, { translate = [0.1, 0.2, 0.7] }]";
    let sides = ["180", "0"].map(|side| tilted.replace("SIDE", side));
    let two_halves = joined([half_ball.clone(), half_ball], &sides);
    let square = |from: f64, to: f64, low: f64, high: f64| {
        format!(
            "[{{ kind = 'polyline', points = [[{from:?}, {low:?}], [{to:?}, {low:?}], [{to:?}, {high:?}], \
             [{from:?}, {high:?}], [{from:?}, {low:?}]] }}]"
        )
    };
    for (name, scene, volume, area) in [
        (
            "circles that touch from within",
            solid(
                "loops = [[{ kind = 'circle', center = [2, 0], radius = 1 }], \
                 [{ kind = 'circle', center = [2.7, 0], radius = 0.3 }]]",
                "",
            ),
            2.0 * PI * (2.0 * PI - 0.09 * PI * 2.7),
            2.0 * PI * (4.0 * PI + 2.7 * PI * 0.6),
        ),
        (
            "squares that share part of an edge",
            solid(
                &format!(
                    "loops = [{}, {}]",
                    square(1.0, 2.0, 0.0, 1.0),
                    square(2.0, 3.0, 0.3, 0.7)
                ),
                "",
            ),
            PI * (3.0 + 0.4 * 5.0),
            2.0 * PI * (3.0 + 1.0 + 2.0 * 0.6 + 5.0 + 3.0 * 0.4),
        ),
        ("hemispheres, tilted", two_halves, 4.0 * PI / 3.0, 4.0 * PI),
        (
            "figure of eight",
            solid(
                &format!("curves = [{{ kind = 'polyline', points = [{eight}] }}]"),
                "",
            ),
            8.0 * PI,
            2.0 * PI * (8.0 + 8.0 * 2_f64.sqrt()),
        ),
        (
            "circles, joined",
            circles("nonzero"),
            2.0 * PI * 3.25 * (2.0 * PI - lens),
            2.0 * PI * 3.25 * 2.0 * (2.0 * PI - angle),
        ),
        (
            "circles, without the lens",
            circles("even-odd"),
            2.0 * PI * 3.25 * (2.0 * PI - 2.0 * lens),
            2.0 * PI * 3.25 * 4.0 * PI,
        ),
        (
            "cylinders whose faces differ by a rounding",
            joined(
                [cylinder(1.0, 0.0, 0.1 + 0.2), cylinder(1.0, 0.3, 1.0)],
                &plain,
            ),
            PI,
            4.0 * PI,
        ),
        (
            "cylinders of two radii, half a turn",
            joined(
                [cylinder(1.0, 0.0, 0.7), cylinder(0.3, 0.7, 1.1)],
                &["angle = 180"; 2].map(String::from),
            ),
            0.5 * PI * (0.7 + 0.09 * 0.4),
            0.5 * (2.0 * PI + 2.0 * PI * (0.7 + 0.3 * 0.4)) + 2.0 * 0.7 + 2.0 * 0.3 * 0.4,
        ),
        (
            "a ball and a rod",
            joined([ball, cylinder(0.5, 0.0, 2.0)], &plain),
            4.0 * PI / 3.0 - cap + rod,
            4.0 * PI - 2.0 * PI * (1.0 - s) + PI * (2.0 - s) + PI * 0.25,
        ),
    ] {
        let found = scene.measures().expect("one body");
        let e = found.error_estimate;
        for (what, found, wanted, estimate) in [
            ("volume", found.volume, volume, e.volume),
            ("area", found.area, area, e.area),
        ] {
            let off = (found - wanted).abs() / wanted;
            let estimate = estimate / wanted;
            eprintln!("{name}: {what} off by {off:.1e}, estimate {estimate:.1e}");
            assert!(off <= 1e-13, "{name}: {what} {found} for {wanted}");
            assert!(
                off <= estimate,
                "{name}: {what} off by {off:e}, estimate {estimate:e}"
            );
            assert!(estimate <= 1e-11, "{name}: {what} estimate {estimate:e}");
        }
    }
}
