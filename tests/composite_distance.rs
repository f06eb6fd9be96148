//! Signed distance of composites against the nearest point of their boundary, found by faces,
//! curves and corners.

mod support;

use glam::DVec3;
use rayon::prelude::*;
use support::composite::{Case, Composite, ball, coaxial, composites, cylinder, flange, sphere};
use support::sampling::Random;
use voxlathe::sample;

#[derive(Debug, Default)]
struct Report {
    points: usize,
    exact: usize,
    /// Largest share of the truth that a lower bound misses.
    slack: f64,
    worst: f64,
    failures: Vec<String>,
}

impl Report {
    fn join(mut self, other: Self) -> Self {
        self.points += other.points;
        self.exact += other.exact;
        self.slack = self.slack.max(other.slack);
        self.worst = self.worst.max(other.worst);
        self.failures.extend(other.failures);
        self
    }
}

/// A case whose faces are prepared; `None` where it has free forms.
fn prepared(composite: Composite) -> Option<Case> {
    let mut case = Case::new(composite);
    case.model.as_mut()?.prepare();
    Some(case)
}

/// One point against the truth.
fn examine(case: &Case, p: DVec3, all_exact: bool, random: &mut Random) -> Report {
    let model = case.model.as_ref().expect("faces");
    let scale = case.composite.moved.0;
    let name = &case.composite.name;
    let (sdf, exact) = case.distance(p);
    let mut report = Report {
        points: 1,
        exact: usize::from(exact),
        ..Report::default()
    };
    let mut fail = |what: String| {
        let p = p.to_array();
        report
            .failures
            .push(format!("{name}: {p:?}: sdf {sdf:e}, exact {exact}: {what}"));
    };
    if sdf.is_nan() {
        fail("no number".to_owned());
    }
    if (sdf <= 0.0) != case.contains(p) {
        fail(format!("but inside = {}", case.contains(p)));
    }
    if case.scene.assembly().signed_distance(p).to_bits() != sdf.to_bits() {
        fail("signed_distance differs".to_owned());
    }
    if all_exact && !exact {
        fail("not exact".to_owned());
    }
    let q = case.unplaced(p);
    let [sure, perhaps] = model.nearest(q);
    let far = |foot: Option<DVec3>| foot.map_or(f64::INFINITY, |p| p.distance(q) * scale);
    let (most, mut least) = (far(sure), far(perhaps));
    // Beside a place where faces touch, crevices are too narrow for the faces' reasoning.
    let touching = model.touches(q, 2e-5);
    if perhaps.is_none() {
        if sdf <= 0.0 && !touching {
            fail("but there is no boundary".to_owned());
        }
        return report;
    }
    // The same tolerance as the distance to one solid has.
    let moved = case.composite.moved.1.length();
    let bound = 1e-10 * case.size + 8.0 * f64::EPSILON * (p.length() + moved);
    if exact && sdf.abs() < least - bound {
        // The samples may have missed a short curve.
        if let Some(better) = model.search(q, sdf.abs() / scale, random) {
            least = least.min(better.distance(q) * scale);
        }
    }
    if sdf.abs() > most + bound {
        fail(format!("the truth is {most:e}, at {sure:?}"));
    } else if exact && !touching && sdf.abs() < least - bound {
        fail(format!("the truth seems {least:e}, at {perhaps:?}"));
    }
    report.worst = if exact {
        (sdf.abs() - most).max(least - sdf.abs()) / case.size
    } else {
        (sdf.abs() - most).max(0.0) / case.size
    };
    if !exact && least > bound {
        report.slack = 1.0 - sdf.abs() / least;
    }
    report
}

fn check(all: Vec<Composite>, count: usize, all_exact: bool) {
    let one = |composite: Composite| -> Option<String> {
        let case = prepared(composite)?;
        let mut random = Random::new(3);
        let mut seeds = case.meetings(200, &mut random);
        let (scale, by) = case.composite.moved;
        let edges = case.model.as_ref().expect("faces").edges();
        let some = 0..200.min(edges.len());
        seeds.extend(some.map(|_| edges[random.below(edges.len())] * scale + by));
        let one = |i: usize| {
            let mut random = Random::new(1000 + i as u64);
            let p = case.point(&seeds, &mut random);
            examine(&case, p, all_exact, &mut random)
        };
        let report = (0..count)
            .into_par_iter()
            .map(one)
            .reduce(Report::default, Report::join);
        eprintln!(
            "{:60} {} points, {} exact, worst {:.1e} size, a lower bound misses at most {:.2} of the truth",
            case.composite.name, report.points, report.exact, report.worst, report.slack
        );
        let mut failures = String::new();
        for line in report.failures.iter().take(4) {
            failures += line;
            failures += "\n";
        }
        if report.failures.len() > 4 {
            failures += &format!("... {} in all\n", report.failures.len());
        }
        Some(failures)
    };
    let failures: Vec<String> = all.into_par_iter().filter_map(one).collect();
    let failures = failures.concat();
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn never_above_the_truth_and_exact_where_it_says_so() {
    check(composites(), 120, false);
}

#[test]
fn coaxial_composites_are_exact_everywhere() {
    check(coaxial(), 300, true);
}

/// Points a scene: `VOXLATHE_POINTS`, or a million.
fn many() -> usize {
    std::env::var("VOXLATHE_POINTS").map_or(1_000_000, |text| {
        text.parse().expect("VOXLATHE_POINTS is a number")
    })
}

#[test]
#[ignore = "hours long: run in release"]
fn a_million_distances_of_composites() {
    check(composites(), many(), false);
}

#[test]
#[ignore = "minutes long: run in release"]
fn a_million_distances_of_coaxial_composites() {
    check(coaxial(), many(), true);
}

#[test]
#[ignore = "minutes long: run in release"]
fn distances_of_sixty_chains() {
    let chains = (200..260).map(|seed| support::composite::chain(seed, 3 + seed as usize % 12));
    check(chains.collect(), many() / 50, false);
}

#[test]
fn a_flange_is_exact_near_its_surface() {
    let case = prepared(Composite::new("flange", flange())).expect("faces");
    let model = case.model.as_ref().expect("faces");
    let spacing = 8.0 / 64.0;
    let mut random = Random::new(8);
    let (mut near, mut exact, mut tried) = (0_u32, 0_u32, 0);
    while near < 16_000 {
        tried += 1;
        assert!(tried < 10_000_000, "few points near the surface");
        let p = support::sampling::uniform(case.low, case.high, &mut random);
        let (sdf, certain) = case.distance(p);
        if sdf.abs() > 3.0 * spacing {
            continue;
        }
        // A lower bound may be near where the surface is not.
        if !certain && model.nearest(p)[0].is_none_or(|q| q.distance(p) > 3.0 * spacing) {
            continue;
        }
        near += 1;
        exact += u32::from(certain);
    }
    let share = f64::from(exact) / f64::from(near);
    eprintln!("flange: {share:.4} of {near} points within three spacings are exact");
    assert!(share >= 0.95, "{share}");
}

/// Neighbours' distances differ by no more than the way between them.
#[test]
fn no_steeper_than_one() {
    let mut failures = String::new();
    for composite in composites().into_iter().chain(coaxial()) {
        let case = Case::new(composite);
        let mut random = Random::new(17);
        let seeds = case.meetings(100, &mut random);
        let (mut worst, mut mixed) = (0.0_f64, 0.0_f64);
        let mut at = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
        for _ in 0..800 {
            let p = case.point(&seeds, &mut random);
            let away = case.size * 10_f64.powf(random.between(-7.0, -1.0));
            let q = p + sphere(&mut random) * away;
            let ((a, exact_a), (b, exact_b)) = (case.distance(p), case.distance(q));
            if !a.is_finite() && a == b {
                continue;
            }
            let bound = p.distance(q) + 1e-10 * case.size + 1e-15 * p.length();
            let excess = ((a - b).abs() - bound) / case.size;
            if exact_a && exact_b {
                worst = worst.max(excess);
            } else {
                mixed = mixed.max(excess);
            }
            if excess >= worst.max(mixed) && excess > 0.0 {
                at = (p, q, a, b);
            }
        }
        if worst > 0.0 || mixed > 0.0 {
            let (p, q, a, b) = at;
            failures += &format!(
                "{}: exact pairs {worst:.1e} size too steep, others {mixed:.1e}: {:?} {a:e}, {:?} {b:e}\n",
                case.composite.name,
                p.to_array(),
                q.to_array()
            );
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn stored_distances_are_those_of_points() {
    for composite in composites().into_iter().chain(coaxial()) {
        let case = Case::new(composite);
        for grid in case.grids([17, 13, 11]) {
            let sdf = sample::signed_distance(&case.scene, &grid).expect("small");
            let [nx, ny, nz] = grid.dims();
            for (k, j, i) in
                (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
            {
                let p = grid.centre(i, j, k);
                let (found, want) = (*sdf.get(i, j, k), case.distance(p).0);
                let ulp = f64::from(f32::EPSILON) * want.abs();
                let bound = (2.0 * ulp).max(1e-4 * grid.spacing().min_element());
                // What rounds to 0 outside is the smallest positive.
                let least = want > 0.0 && found == f32::from_bits(1);
                // So is what has no surface as far as numbers go.
                let most = want > f64::from(f32::MAX) && found >= f32::MAX;
                let same =
                    most || f64::from(found) == want || (f64::from(found) - want).abs() <= bound;
                assert!(
                    same || (least && want < f64::from(found)),
                    "{}: {found} for {want} at {p}",
                    case.composite.name
                );
                assert_eq!(
                    found <= 0.0,
                    want <= 0.0,
                    "{}: sign at {p}",
                    case.composite.name
                );
            }
        }
    }
}

/// A part of a turn somewhere else: the nearest point of the ball is cut away all the same.
#[test]
fn a_wedge_elsewhere_makes_no_bound_exact() {
    let cut = || {
        vec![
            ball(2.0),
            cylinder(1.25, 0.0, 3.0).at(-0.75, 0.0, 0.5).cut(),
        ]
    };
    let mut failures = String::new();
    for (name, more) in [
        ("alone", vec![]),
        ("a ball", vec![ball(0.75).at(1.75, 0.5, 0.75)]),
        (
            "a wedge",
            vec![ball(0.75).at(1.75, 0.5, 0.75).turn(0.0, 60.0)],
        ),
        (
            "a wedge far away",
            vec![cylinder(0.25, 0.0, 1.0).at(9.0, 0.0, 0.0).turn(0.0, 90.0)],
        ),
    ] {
        let case = prepared(Composite::new(name, [cut(), more].concat())).expect("faces");
        for p in [[-0.75, 0.0, 4.0], [-2.75, 0.25, 4.25], [-0.5, 0.25, 3.0]] {
            let p = DVec3::from_array(p);
            let report = examine(&case, p, false, &mut Random::new(1));
            for line in report.failures {
                failures += &format!("{line}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
