//! Membership of composites: the boolean of the single answers, regularised.

mod support;

use glam::DVec3;
use rayon::prelude::*;
use support::composite::{Case, Composite, Expected, ball, chain, coaxial, composites, cylinder};
use support::sampling::Random;
use voxlathe::solid::{Assembly, Operation};

/// Points drawn by one generator.
const CHUNK: usize = 128;

#[derive(Debug, Default)]
struct Count {
    points: usize,
    inside: usize,
    regular: usize,
    closed: usize,
    either: usize,
    wrong: Vec<(DVec3, Expected, bool)>,
}

fn compare(case: &Case, count: usize) -> Count {
    let meetings = case.meetings(count.clamp(100, 3000), &mut Random::new(5));
    let chunk = |index: usize| {
        let mut random = Random::new(index as u64 + 1);
        let mut found = Count::default();
        for _ in 0..CHUNK {
            let p = case.point(&meetings, &mut random);
            let got = case.contains(p);
            let mut expected = case.expected(p, 0, &mut random);
            let differs = |e: Expected| match e {
                Expected::Clear(wanted) | Expected::Regular(wanted) => got != wanted,
                Expected::Closed => !got,
                Expected::Either => false,
            };
            if differs(expected) {
                // A thin part may lie between few directions.
                expected = case.expected(p, 3000, &mut random);
            }
            found.points += 1;
            found.inside += usize::from(got);
            match expected {
                Expected::Clear(_) => {}
                Expected::Regular(_) => found.regular += 1,
                Expected::Closed => found.closed += 1,
                Expected::Either => found.either += 1,
            }
            if differs(expected) {
                found.wrong.push((p, expected, got));
            }
        }
        found
    };
    (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(chunk)
        .reduce(Count::default, |mut a, b| {
            a.points += b.points;
            a.inside += b.inside;
            a.regular += b.regular;
            a.closed += b.closed;
            a.either += b.either;
            a.wrong.extend(b.wrong);
            a
        })
}

fn check(all: Vec<Composite>, count: usize) {
    let mut failures = String::new();
    for composite in all {
        let case = Case::new(composite);
        let found = compare(&case, count);
        let name = &case.composite.name;
        eprintln!(
            "{name:60} {:7} points, {:6} inside; in bands {:5} regular, {:5} closed, {:5} either; {} wrong",
            found.points,
            found.inside,
            found.regular,
            found.closed,
            found.either,
            found.wrong.len()
        );
        for (p, expected, got) in found.wrong.iter().take(4) {
            let p = p.to_array();
            failures += &format!("{name}: {p:?}: wanted {expected:?}, found inside = {got}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn booleans_of_the_single_answers() {
    check(composites(), 600);
}

#[test]
fn coaxial_booleans_of_the_single_answers() {
    check(coaxial(), 1000);
}

#[test]
fn chains_of_many_solids() {
    check((100..112).map(|seed| chain(seed, 10)).collect(), 250);
}

/// Points a scene: `VOXLATHE_POINTS`, or a million.
fn many() -> usize {
    std::env::var("VOXLATHE_POINTS").map_or(1_000_000, |text| {
        text.parse().expect("VOXLATHE_POINTS is a number")
    })
}

#[test]
#[ignore = "hours long: run in release"]
fn a_million_points_of_composites() {
    check(composites(), many());
}

#[test]
#[ignore = "minutes long: run in release"]
fn a_million_points_of_coaxial_composites() {
    check(coaxial(), many());
}

#[test]
#[ignore = "minutes long: run in release"]
fn points_of_a_hundred_chains() {
    let chains = (200..300).map(|seed| chain(seed, 3 + seed as usize % 12));
    check(chains.collect(), many() / 50);
}

/// The boolean of what the parts themselves answer.
fn boolean(assembly: &Assembly, p: DVec3) -> bool {
    assembly.parts().iter().fold(false, |inside, part| {
        let own = part.contains(p);
        match part.operation() {
            Operation::Add => inside || own,
            Operation::Subtract => inside && !own,
            Operation::Intersect => inside && own,
        }
    })
}

/// Composites differ from the boolean of their parts' answers in the rounding band alone.
fn parts_answer(all: Vec<Composite>, count: usize) {
    let mut failures = String::new();
    for composite in all {
        let case = Case::new(composite);
        let assembly = case.scene.assembly();
        let meetings = case.meetings(3000, &mut Random::new(7));
        let near = |p: DVec3| {
            assembly.parts().iter().any(|part| {
                let band = 8.0 * f64::EPSILON * (part.bounds().longest_side() + p.length());
                let d = part.body().distance(p, part.contains(p), f64::INFINITY);
                d <= band
            })
        };
        let chunk = |index: usize| {
            let mut random = Random::new(index as u64 + 1);
            let points = (0..CHUNK).map(|_| case.point(&meetings, &mut random));
            let different = points.filter(|&p| assembly.contains(p) != boolean(assembly, p));
            let (near, wrong): (Vec<DVec3>, Vec<DVec3>) = different.partition(|&p| near(p));
            (near.len(), wrong)
        };
        let (near, wrong) = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(chunk)
            .reduce(Default::default, |mut a, b| {
                a.0 += b.0;
                a.1.extend(b.1);
                a
            });
        let name = &case.composite.name;
        eprintln!(
            "{name:60} {count:8} points, {near:6} decided in the rounding band, {} wrong",
            wrong.len()
        );
        if let Some(p) = wrong.first() {
            failures += &format!(
                "{name}: {} wrong, {:?} for one\n",
                wrong.len(),
                p.to_array()
            );
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn what_the_parts_answer() {
    parts_answer(composites(), 5000);
    parts_answer(coaxial(), 5000);
}

#[test]
#[ignore = "minutes long: run in release"]
fn what_the_parts_answer_at_a_million_points() {
    parts_answer(composites(), many());
    parts_answer(coaxial(), many());
}

fn assert_points(case: &Case, points: &[([f64; 3], bool)]) {
    let mut failures = String::new();
    for &(p, wanted) in points {
        let p = DVec3::from_array(p);
        let (sdf, _) = case.distance(p);
        if case.contains(p) != wanted || (sdf <= 0.0) != wanted {
            failures += &format!(
                "{}: {p}: wanted {wanted}, sdf {sdf:e}\n",
                case.composite.name
            );
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn no_sheet_is_left_on_coincident_caps() {
    // The bore's ends lie in the caps of the bar: of its discs only the rims belong to the solid.
    let pipe = Composite::new(
        "pipe",
        vec![cylinder(2.0, 0.0, 3.0), cylinder(1.0, 0.0, 3.0).cut()],
    );
    let offset = Composite::new(
        "offset pipe",
        vec![
            cylinder(2.0, 0.0, 3.0),
            cylinder(1.0, 0.0, 3.0).at(0.5, 0.0, 0.0).cut(),
        ],
    );
    for (composite, x) in [(pipe, 0.0), (offset, 0.5)] {
        let case = Case::new(composite);
        let mut points = Vec::new();
        for z in [0.0, 3.0] {
            points.extend([
                ([x, 0.0, z], false),
                ([x + 0.5, 0.25, z], false),
                ([x - 0.5, -0.75, z], false),
                ([x + 1.0, 0.0, z], true),
                ([x, -1.0, z], true),
                ([x - 1.25, 0.0, z], true),
                ([2.0, 0.0, z], true),
                ([2.5, 0.0, z], false),
            ]);
        }
        points.extend([([x + 1.0, 0.0, 1.5], true), ([x, 0.0, 1.5], false)]);
        assert_points(&case, &points);
    }
}

#[test]
fn no_sheet_is_left_between_parts() {
    let mut points = Vec::new();
    let case = Case::new(Composite::new(
        "halves cut",
        vec![
            cylinder(2.0, 0.0, 1.0),
            cylinder(2.0, 1.0, 2.0),
            // All of the upper half, less a quarter that is as high.
            cylinder(2.0, 1.0, 2.0).turn(0.0, 270.0).cut(),
        ],
    ));
    for (p, wanted) in [
        ([0.5, 0.5, 1.0], true),
        ([0.5, 0.5, 1.5], false),
        ([0.5, 0.5, 2.0], false),
        ([0.5, -0.5, 2.0], true),
        ([0.5, -0.5, 1.0], true),
        ([0.5, 0.0, 1.5], true),
        ([0.5, 0.0, 2.0], true),
        ([0.0, -0.5, 1.5], true),
        ([-0.5, 0.0, 1.5], false),
        ([0.0, 0.0, 1.5], true),
        ([2.0, 0.0, 1.5], true),
        ([0.0, 2.0, 1.5], false),
        ([0.0, 2.0, 1.0], true),
    ] {
        points.push((p, wanted));
    }
    assert_points(&case, &points);
}

#[test]
fn what_is_common_to_touching_solids_is_nothing() {
    let touching = [
        vec![cylinder(1.0, 0.0, 1.0), cylinder(1.0, 1.0, 2.0).common()],
        vec![
            cylinder(1.0, 0.0, 1.0),
            cylinder(1.0, 0.0, 1.0).at(0.25, 0.0, 1.0).common(),
        ],
        vec![
            cylinder(1.0, 0.0, 2.0).turn(0.0, 90.0),
            cylinder(1.0, 0.0, 2.0).turn(90.0, 90.0).common(),
        ],
        vec![
            cylinder(1.0, 0.0, 2.0).turn(0.0, 180.0),
            cylinder(1.5, 0.0, 1.0)
                .turn(180.0, 180.0)
                .at(0.25, 0.0, 0.5)
                .common(),
        ],
        vec![ball(1.0), ball(1.0).cut()],
        vec![ball(1.0), ball(2.0).cut()],
        vec![cylinder(1.0, 0.0, 1.0), cylinder(2.0, 0.0, 1.0).cut()],
        vec![
            cylinder(1.0, 0.0, 1.0).along(1.0, 0.0, 0.0),
            cylinder(2.0, -2.0, 2.0).at(1.0, 0.0, 0.0).cut(),
        ],
    ];
    for (k, items) in touching.into_iter().enumerate() {
        let case = Case::new(Composite::new(&format!("touching {k}"), items));
        let mut points = Vec::new();
        for x in -8..=8 {
            for y in -8..=8 {
                for z in -8..=12 {
                    points.push(([x, y, z].map(|c| f64::from(c) * 0.25), false));
                }
            }
        }
        assert_points(&case, &points);
    }
}

/// A ball in common with a bar on the same axis cuts the bar's cap, which stays in the plane of the
/// pocket's.
#[test]
fn no_sheet_is_left_on_a_cap_that_a_coaxial_solid_cuts() {
    let bar = || cylinder(2.0, 0.0, 3.0);
    let pocket = || cylinder(1.0, 0.0, 2.0).at(0.5, 0.5, 0.0).cut();
    let common = || ball(1.75).at(0.0, 0.0, 1.0).common();
    for (name, items) in [
        ("common last", vec![bar(), pocket(), common()]),
        ("common first", vec![bar(), common(), pocket()]),
    ] {
        let case = Case::new(Composite::new(name, items));
        assert_points(
            &case,
            &[
                ([0.25, 0.25, 0.0], false),
                ([0.5, 0.5, 0.0], false),
                ([0.75, 0.25, 0.0], false),
                ([0.5, 1.25, 0.0], false),
                ([0.5, -0.5, 0.0], true),
                ([-0.75, 0.0, 0.0], true),
            ],
        );
    }
}

/// What is left of a bar beyond a flat cap has sharp edges: they belong to it.
#[test]
fn acute_edges_belong_to_the_solid() {
    let case = Case::new(Composite::new(
        "bar less a larger one across",
        vec![
            cylinder(1.25, 0.0, 2.5),
            cylinder(3.0, -2.0, 1.0).along(0.0, 1.0, 0.0).cut(),
        ],
    ));
    let mut points = Vec::new();
    for z in [0.0, 0.25, 0.5, 1.0, 2.5] {
        for x in [-0.75, 0.75] {
            points.push(([x, 1.0, z], true));
        }
        points.extend([
            ([0.0, 1.0, z], true),
            ([0.0, 1.25, z], true),
            ([1.0, 0.75, z], false),
            ([1.25, 1.0, z], false),
        ]);
    }
    assert_points(&case, &points);
}
