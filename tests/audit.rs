//! An audit: random scenes of every kind, and every number that carries a bound held against an answer
//! of another kind.
//!
//! The test command runs some seeds of each family. By hand, for as long as one likes:
//!
//! ```sh
//! VOXLATHE_AUDIT_SECONDS=3600 cargo test --release --test audit -- --ignored --nocapture
//! ```
//!
//! `VOXLATHE_SEEDS=1000..1020` in place of the seconds runs those seeds of each family, the same on every machine.
//! `VOXLATHE_AUDIT_FAMILY=fractions` runs the families whose names begin so, also those that the test
//! command leaves out; `VOXLATHE_AUDIT_SEED=17` runs one seed of them, and prints its scene.
//!
//! What the truths share with the crate is the reading of the scene's numbers, nothing else.

mod support;

#[path = "audit/checks.rs"]
mod checks;
#[path = "audit/cubature.rs"]
mod cubature;
#[path = "audit/draw.rs"]
mod draw;
#[path = "audit/joints.rs"]
mod joints;
#[path = "audit/meshes.rs"]
mod meshes;
#[path = "audit/truth.rs"]
mod truth;

use std::panic::catch_unwind;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use checks::{FAMILIES, Family, Found};

/// A scene that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(600);

/// One seed of a family; what panics or hangs is beyond its bound.
fn run(family: &'static Family, seed: u64, show: bool) -> Found {
    let (send, receive) = channel();
    std::thread::spawn(move || {
        let outcome = catch_unwind(|| (family.check)(seed));
        // Nobody listens any more after the patience is over.
        let _ = send.send(outcome);
    });
    let (text, mut found) = match receive.recv_timeout(PATIENCE) {
        Ok(Ok(found)) => found,
        Ok(Err(_)) => (String::new(), broken("panicked")),
        Err(_) => (String::new(), broken("no answer within ten minutes")),
    };
    for line in found.beyond.iter().take(3) {
        eprintln!(
            "VOXLATHE_AUDIT_FAMILY={} VOXLATHE_AUDIT_SEED={seed}: {line}",
            family.name
        );
    }
    if show || !found.beyond.is_empty() {
        eprintln!("{text}");
    }
    for line in &mut found.beyond {
        *line = format!("{} {seed}: {line}", family.name);
    }
    found
}

fn broken(what: &str) -> Found {
    Found {
        beyond: vec![what.to_owned()],
        ..Found::default()
    }
}

fn report(name: &str, seeds: u64, found: &Found, since: Instant) {
    eprintln!(
        "{name:28} {seeds} scenes: {} held (worst {:.2e} of the bound), {} open, {} beyond; {:.1} s",
        found.held,
        found.worst,
        found.open,
        found.beyond.len(),
        since.elapsed().as_secs_f64()
    );
}

fn verdict(all: &Found) {
    assert!(
        all.beyond.is_empty(),
        "{} numbers are beyond their bound:\n{}",
        all.beyond.len(),
        all.beyond
            .iter()
            .take(40)
            .cloned()
            .collect::<Vec<_>>()
            .join("\n")
    );
}

#[test]
fn a_sample_holds() {
    let mut all = Found::default();
    for family in FAMILIES.iter().filter(|f| f.in_test) {
        let since = Instant::now();
        let mut found = Found::default();
        for &seed in family.seeds {
            found.add(run(family, seed, false));
        }
        report(family.name, family.seeds.len() as u64, &found, since);
        assert!(
            found.held > 0 || !found.beyond.is_empty(),
            "{} says nothing",
            family.name
        );
        all.add(found);
    }
    verdict(&all);
}

#[test]
#[ignore = "for as long as VOXLATHE_AUDIT_SECONDS or VOXLATHE_SEEDS say"]
fn all_families_hold_for_a_while() {
    let number = |name: &str| std::env::var(name).ok().and_then(|v| v.parse::<u64>().ok());
    let wanted = std::env::var("VOXLATHE_AUDIT_FAMILY").unwrap_or_default();
    let families: Vec<&'static Family> = FAMILIES
        .iter()
        .filter(|f| f.name.starts_with(&wanted))
        .collect();
    assert!(!families.is_empty(), "no family begins with {wanted:?}");
    let mut all = Found::default();
    if let Some(seed) = number("VOXLATHE_AUDIT_SEED") {
        for family in families {
            let since = Instant::now();
            let found = run(family, seed, true);
            report(family.name, 1, &found, since);
            all.add(found);
        }
        return verdict(&all);
    }
    let named = std::env::var("VOXLATHE_SEEDS").ok();
    let range = named.map(|range| {
        let ends = range.split_once("..").map(|(from, to)| [from, to]);
        let ends = ends.and_then(|e| Some([e[0].parse().ok()?, e[1].parse().ok()?]));
        ends.expect("VOXLATHE_SEEDS=FROM..TO")
    });
    let [first, end]: [u64; 2] = range.unwrap_or([1001, u64::MAX]);
    let seconds = number("VOXLATHE_AUDIT_SECONDS").unwrap_or(60);
    let share = Duration::from_secs(seconds) / families.len() as u32;
    for family in families {
        let since = Instant::now();
        let (mut found, mut seed) = (Found::default(), first);
        while seed < end && (range.is_some() || since.elapsed() < share) {
            found.add(run(family, seed, false));
            seed += 1;
        }
        report(family.name, seed - first, &found, since);
        all.add(found);
    }
    verdict(&all);
}
