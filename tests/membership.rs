//! Membership against an independent oracle of high precision, and against itself after scaling by
//! powers of two.

#![allow(clippy::print_stdout, reason = "the figures are what the test is for")]

mod support;

use glam::DVec3;
use rayon::prelude::*;
use support::hard;
use support::oracle::Oracle;
use support::sampling::{Random, hard as hard_point, uniform};
use support::text::scene_text;
use voxlathe::Scene;

/// Points drawn by one generator.
const CHUNK: usize = 256;

#[derive(Default)]
struct Count {
    points: usize,
    inside: usize,
    /// Decided by the big floats.
    precise: usize,
    /// Different from the oracle, within the contract's rounding band.
    banded: usize,
    /// Different from the oracle beyond it.
    wrong: Vec<(DVec3, bool)>,
}

fn sample(scene: &Scene, index: usize, count: usize) -> Vec<DVec3> {
    let oracle = Oracle::new(scene.model());
    let (low, high) = (scene.bounds().min, scene.bounds().max);
    let mut random = Random::new(index as u64);
    (0..count)
        .map(|i| {
            if i % 3 == 0 {
                hard_point(&oracle, &mut random)
            } else {
                uniform(low, high, &mut random)
            }
        })
        .collect()
}

fn compare(scene: &Scene, count: usize) -> Count {
    let oracle = Oracle::new(scene.model());
    let sizes: Vec<f64> = scene
        .assembly()
        .parts()
        .iter()
        .map(|part| part.bounds().longest_side())
        .collect();
    let (low, high) = (scene.bounds().min, scene.bounds().max);
    let chunk = |index: usize| {
        let mut random = Random::new(index as u64 + 1);
        let mut found = Count::default();
        for i in 0..CHUNK {
            let p = if i % 3 == 0 {
                hard_point(&oracle, &mut random)
            } else {
                uniform(low, high, &mut random)
            };
            let got = scene.assembly().contains(p);
            let (wanted, cheap) = oracle.contains(p);
            found.points += 1;
            found.inside += usize::from(wanted);
            found.precise += usize::from(!cheap);
            if got != wanted {
                if oracle.in_band(p, &sizes) {
                    found.banded += 1;
                } else {
                    found.wrong.push((p, got));
                }
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
            a.precise += b.precise;
            a.banded += b.banded;
            a.wrong.extend(b.wrong);
            a
        })
}

fn check(scenes: &[(String, Scene)], count: usize) {
    let mut failures = String::new();
    for (name, scene) in scenes {
        let found = compare(scene, count);
        println!(
            "{name:36} {:8} points, {:7} inside, {:7} precise, {:5} differ within the band, {} wrong",
            found.points,
            found.inside,
            found.precise,
            found.banded,
            found.wrong.len()
        );
        for (p, got) in found.wrong.iter().take(3) {
            failures += &format!("{name}: {p:?}: found inside = {got}\n");
        }
    }
    assert!(
        failures.is_empty(),
        "wrong beyond the rounding band:\n{failures}"
    );
}

#[test]
fn shipped_scenes_agree_with_the_oracle() {
    check(&hard::shipped(), 6000);
}

#[test]
fn hard_scenes_agree_with_the_oracle() {
    check(&hard::scenes(true), 1500);
}

/// Points a scene: `VOXLATHE_POINTS`, or a million.
#[test]
#[ignore = "minutes long: run in release"]
fn a_million_points_agree_with_the_oracle() {
    let count = std::env::var("VOXLATHE_POINTS").map_or(1_000_000, |text| {
        text.parse().expect("VOXLATHE_POINTS is a number")
    });
    check(&hard::shipped(), count);
    check(&hard::scenes(true), count / 10);
}

#[test]
fn powers_of_two_change_no_bit() {
    let mut failures = String::new();
    for (name, scene) in hard::shipped().into_iter().chain(hard::scenes(true)) {
        let points = sample(&scene, 77, 240);
        for power in [-20, 20] {
            let k = 2_f64.powi(power);
            let text = scene_text(scene.model(), k, "");
            let scaled = Scene::parse(&text).unwrap_or_else(|e| panic!("{name}: {e}\n{text}"));
            let (a, b) = (scene.assembly(), scaled.assembly());
            let mut differ = 0;
            for &p in &points {
                let inside = (a.contains(p), b.contains(p * k));
                let distance = (a.signed_distance(p), b.signed_distance(p * k));
                // An outside distance that rounds to 0 is the smallest positive at any scale.
                let least = distance.0 == distance.1 && distance.0 == f64::from_bits(1);
                let same = (distance.0 * k).to_bits() == distance.1.to_bits() || least;
                if inside.0 != inside.1 || !same {
                    differ += 1;
                    if differ == 1 {
                        failures +=
                            &format!("{name} x 2^{power} at {p:?}: {inside:?} {distance:?}\n");
                    }
                }
            }
            if differ > 0 {
                println!("{name} x 2^{power}: {differ} of {} differ", points.len());
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// At the height of a joint the piece below ends and the piece above begins: a ray there must count
/// one of them. Heights are exact in f64 as the solid stands, and in double-double once scaled by 3.
#[test]
fn heights_of_joints_count_once() {
    let radii = [2.0, 1.5, 1.75, 0.5, 3.0, 3.0, 1.0, 2.25];
    let points: Vec<String> = radii
        .iter()
        .enumerate()
        .map(|(k, r)| format!("[{r}, {k}]"))
        .collect();
    let chain = |place: &str| {
        Scene::parse(&format!(
            "schema = 1\n[profiles.p]\nboundary = \"to-axis\"\ncurves = [{{ kind = \"polyline\", points = [{}] }}]\n\
             [[solid]]\nkind = \"revolve\"\nprofile = \"p\"\n{place}",
            points.join(", ")
        ))
        .expect("a chain")
    };
    let torus = |place: &str| {
        Scene::parse(&format!(
            "schema = 1\n[profiles.p]\ncurves = [{{ kind = \"circle\", center = [2, 0], radius = 0.5 }}]\n\
             [[solid]]\nkind = \"revolve\"\nprofile = \"p\"\n{place}"
        ))
        .expect("a torus")
    };
    for (place, scale) in [
        ("", 1.0),
        ("place = [{ scale = 3 }]", 3.0),
        ("place = [{ scale = 0.25 }]", 0.25),
    ] {
        let chain = chain(place);
        for (k, &radius) in radii.iter().enumerate() {
            for step in 0..=256 {
                // Multiples of 1/64, the radii of the joints among them.
                let r = f64::from(step) / 64.0;
                for p in [DVec3::new(r, 0.0, k as f64), DVec3::new(0.0, -r, k as f64)] {
                    let found = chain.assembly().contains(p * scale);
                    assert_eq!(
                        found,
                        r <= radius,
                        "chain, {place}: {p} at a joint of radius {radius}"
                    );
                }
            }
        }
        let torus = torus(place);
        for step in 0..=256 {
            let r = f64::from(step) / 64.0;
            for (z, low, high) in [
                (0.0, 1.5, 2.5),
                (0.5, 2.0, 2.0),
                (-0.5, 2.0, 2.0),
                (0.515_625, 9.0, 9.0),
            ] {
                let p = DVec3::new(-r, 0.0, z);
                let found = torus.assembly().contains(p * scale);
                assert_eq!(found, r >= low && r <= high, "torus, {place}: {p}");
            }
        }
    }
}
