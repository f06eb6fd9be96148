//! Measures of composites that hold NURBS volumes, against closed forms and against the same solids turned.

#![allow(
    clippy::excessive_precision,
    reason = "figures of 18 digits, rounded by the compiler"
)]

use std::f64::consts::PI;
use std::time::Instant;
use voxlathe::Scene;
use voxlathe::solid::Measures;

fn measured(name: &str, text: &str) -> (Measures, f64) {
    let start = Instant::now();
    let scene =
        Scene::parse(&format!("schema = 1\n{text}")).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let found = scene.assembly().measures();
    let seconds = start.elapsed().as_secs_f64();
    (
        found.unwrap_or_else(|| panic!("{name} is given up")),
        seconds,
    )
}

/// What is measured has to be within the estimate, and the estimate within a share of the value.
fn check(name: &str, text: &str, volume: [f64; 2], area: [f64; 2], share: f64) {
    let (found, seconds) = measured(name, text);
    let estimate = found.error_estimate;
    let off = [
        (found.volume - volume[0]).abs(),
        (found.area - area[0]).abs(),
    ];
    eprintln!(
        "{name}: volume {} off by {:.1e}, claimed {:.1e}; area {} off by {:.1e}, claimed {:.1e}; {seconds:.2} s",
        found.volume, off[0], estimate.volume, found.area, off[1], estimate.area
    );
    assert!(off[0] <= estimate.volume + volume[1], "{name}: volume");
    assert!(off[1] <= estimate.area + area[1], "{name}: area");
    assert!(estimate.volume <= share * volume[0], "{name}: volume");
    assert!(estimate.area <= share * area[0], "{name}: area");
}

const CUBE: &str = "[[solid]]
kind = 'volume'
[[solid.patches]]
degrees = [1, 1, 1]
knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]]
points = [[0,0,0],[3,0,0],[0,3,0],[3,3,0],[0,0,3],[3,0,3],[0,3,3],[3,3,3]]";

#[test]
fn a_box_of_patches_less_a_cylinder() {
    let text = format!(
        "{CUBE}\n[[solid]]\nkind = 'cylinder'\nradius = 0.7\nheight = 5\noperation = 'subtract'
        axis = {{ origin = [1.2, 1.5, -1] }}"
    );
    let bore = PI * 0.49;
    let volume = 27.0 - 3.0 * bore;
    let area = 54.0 - 2.0 * bore + 2.0 * PI * 0.7 * 3.0;
    check("box less cylinder", &text, [volume, 0.0], [area, 0.0], 1e-9);
    // A ball that takes away a corner's eighth, and one that is inside.
    let ball = |at: &str| {
        format!(
            "{CUBE}\n[[solid]]\nkind = 'sphere'\nradius = 1\noperation = 'subtract'\naxis = {{ origin = {at} }}"
        )
    };
    let (v, a) = (4.0 / 3.0 * PI, 4.0 * PI);
    check(
        "box less eighth",
        &ball("[3, 3, 3]"),
        [27.0 - v / 8.0, 0.0],
        [54.0 - 0.75 * PI + a / 8.0, 0.0],
        1e-9,
    );
    check(
        "box less ball",
        &ball("[1.4, 1.5, 1.6]"),
        [27.0 - v, 0.0],
        [54.0 + a, 0.0],
        1e-9,
    );
}

/// Solids of one profile, one of them moved, as volumes and as turned regions.
fn pair(kind: &str, operation: &str) -> String {
    format!(
        "[profiles.p]\nboundary = 'to-axis'\ncurves = [{{ kind = 'nurbs', degree = 3, points = [[4, 0], [7, 2], [8, 8], [5, 13], [3, 16]], weights = [1, 2, 1, 0.5, 1] }}]
        [[solid]]\n{kind}\nprofile = 'p'
        [[solid]]\n{kind}\nprofile = 'p'\noperation = '{operation}'
        place = [{{ rotate = {{ axis = [1, 2, 0], degrees = 35 }} }}, {{ translate = [5, 1, 2] }}]"
    )
}

#[test]
fn turned_volumes_that_meet_measure_as_turned_regions() {
    for operation in ["add", "subtract"] {
        let (wanted, seconds) = measured(operation, &pair("kind = 'revolve'", operation));
        let e = wanted.error_estimate;
        eprintln!(
            "regions, {operation}: {} {} in {seconds:.2} s",
            wanted.volume, wanted.area
        );
        let kind = "kind = 'volume'\nconstruct = 'curve-ruled'";
        check(
            operation,
            &pair(kind, operation),
            [wanted.volume, e.volume],
            [wanted.area, e.area],
            1e-9,
        );
    }
}

#[test]
fn two_tea_bowls() {
    let bowl = "[[solid]]\nkind = 'volume'\nfile = 'scenes/volumes/tea_bowl.g2'";
    let one = measured("one bowl", bowl).0;
    let both = |operation: &str| {
        format!(
            "{bowl}\n{bowl}\noperation = '{operation}'\nplace = [{{ translate = [4, 0.5, 0.25] }}]"
        )
    };
    let (sum, a) = measured("both", &both("add"));
    let (common, b) = measured("common", &both("intersect"));
    let off = (sum.volume + common.volume - 2.0 * one.volume).abs();
    let claimed = sum.error_estimate.volume + common.error_estimate.volume;
    eprintln!(
        "bowls: {} and {}, together off by {off:.1e}, claimed {claimed:.1e}; {a:.2} s and {b:.2} s",
        sum.volume, common.volume
    );
    assert!(off <= claimed && claimed <= 2e-9 * sum.volume);
}

#[test]
fn the_estimate_of_a_joined_region_covers_its_error() {
    let scene = Scene::load("scenes/buoy.toml").expect("a scene");
    let found = scene.assembly().measures().expect("few solids");
    // In 40 digits, from the f64 numbers of the scene.
    let off = (found.volume - 6.324_560_670_648_780_02).abs();
    eprintln!(
        "buoy: off by {off:.1e}, claimed {:.1e}",
        found.error_estimate.volume
    );
    assert!(off <= found.error_estimate.volume);
}

/// A box as a volume: its corners, its degree along every parameter, and where it is placed.
fn block([low, high]: [[f64; 3]; 2], degree: usize, rest: &str) -> String {
    let knots: Vec<u32> = [0, 1].iter().flat_map(|k| vec![*k; degree + 1]).collect();
    let n = degree + 1;
    let at = |c: usize, i: usize| low[c] + (high[c] - low[c]) * i as f64 / degree as f64;
    let points: Vec<[f64; 3]> = (0..n * n * n)
        .map(|i| [at(0, i % n), at(1, i / n % n), at(2, i / (n * n))])
        .collect();
    format!(
        "[[solid]]\nkind = 'volume'\npatches = [{{ degrees = [{degree}, {degree}, {degree}], \
         knots = [{knots:?}, {knots:?}, {knots:?}], points = {points:?} }}]\n{rest}\n"
    )
}

#[test]
fn boxes_of_patches_with_faces_in_one_plane() {
    let cube = [[0.0; 3], [1.0; 3]];
    // Face on face; one within the other up to a face; shifted along a common plane; two edges in one line; the same box.
    let cases = [
        ([[1.0, 0.25, 0.25], [2.0, 0.75, 0.75]], "add", 1.25, 8.0),
        ([[0.5, 0.0, 0.0], [1.0, 1.0, 1.0]], "add", 1.0, 6.0),
        ([[0.5, 0.0, 0.0], [1.0, 1.0, 1.0]], "subtract", 0.5, 4.0),
        ([[0.5, 0.5, 0.0], [1.5, 1.5, 1.0]], "add", 1.75, 9.5),
        ([[0.5, 0.5, 0.0], [1.5, 1.5, 1.0]], "intersect", 0.25, 2.5),
        ([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], "add", 1.0, 6.0),
        (
            [[0.25, 0.25, 0.0], [0.75, 0.75, 1.0]],
            "subtract",
            0.75,
            7.5,
        ),
    ];
    let slanted = "place = [{ rotate = { axis = [1, 2, 3], degrees = 25 } }, { scale = 3 }]";
    for (n, (other, operation, volume, area)) in cases.into_iter().enumerate() {
        for (rest, scale) in [("", 1.0_f64), (slanted, 3.0)] {
            let degree = 1 + n % 2;
            let text = block(cube, degree, rest)
                + &block(other, 1, &format!("operation = '{operation}'\n{rest}"));
            check(
                &format!("{other:?} {operation} x {scale}"),
                &text,
                [volume * scale.powi(3), 0.0],
                [area * scale.powi(2), 0.0],
                1e-9,
            );
        }
    }
}
