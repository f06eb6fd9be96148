//! Families of checks: each draws a scene from a seed and holds the library's numbers against the truth.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::converge::{Plan, study};
use voxlathe::sample;

use super::cubature::{Estimate, integral};
use super::draw::{Drawn, Kinds, Where, grid, scene};
use super::joints;
use super::meshes;
use super::support::sampling::Random;
use super::truth::Truth;

/// What a family found in one scene.
#[derive(Debug, Default, Clone)]
pub(crate) struct Found {
    /// Numbers that hold.
    pub(crate) held: u64,
    /// Numbers that the truth is not known well enough for, and scenes that were refused.
    pub(crate) open: u64,
    /// The largest error by what it may be.
    pub(crate) worst: f64,
    /// Numbers beyond their bound.
    pub(crate) beyond: Vec<String>,
}

impl Found {
    /// Holds a number against the truth: `bound` is what the library says it may be off by.
    pub(crate) fn hold(&mut self, what: &str, number: f64, truth: Estimate, bound: f64) {
        let off = (number - truth.value).abs();
        if off <= bound + truth.error {
            if truth.error > 10.0 * bound {
                self.open += 1;
            } else {
                self.held += 1;
                self.worst = self.worst.max((off - truth.error).max(0.0) / bound);
            }
        } else {
            self.beyond.push(format!(
                "{what}: {number:?}, right {:?} within {:.1e}: off by {off:.3e}, bound {bound:.3e}",
                truth.value, truth.error
            ));
        }
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.held += other.held;
        self.open += other.open;
        self.worst = self.worst.max(other.worst);
        self.beyond.extend(other.beyond);
    }
}

/// A family: its name, whether it is right today, and its check, which gives the scene too.
pub(crate) struct Family {
    pub(crate) name: &'static str,
    /// Whether the test command runs it.
    pub(crate) in_test: bool,
    /// Seeds that the test command runs.
    pub(crate) seeds: &'static [u64],
    pub(crate) check: fn(u64) -> (String, Found),
}

const STRAIGHT: Where = Where {
    slanted: false,
    partial: true,
    powers: &[0, 0, 0, -6, 6],
    far: true,
};
const SLANTED: Where = Where {
    slanted: true,
    ..STRAIGHT
};
const WHOLE: Where = Where {
    partial: false,
    ..STRAIGHT
};

pub(crate) const FAMILIES: &[Family] = &[
    Family {
        name: "fractions-turned",
        in_test: false,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::Turned, STRAIGHT, 1),
    },
    Family {
        name: "fractions-slanted",
        in_test: false,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::Turned, SLANTED, 1),
    },
    Family {
        name: "fractions-volumes",
        in_test: false,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::Volumes, SLANTED, 1),
    },
    Family {
        name: "fractions-volumes-straight",
        in_test: false,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::Volumes, WHOLE, 1),
    },
    Family {
        name: "fractions-quadrics",
        in_test: true,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::Quadrics, SLANTED, 1),
    },
    Family {
        name: "fractions-composites",
        in_test: false,
        seeds: &[1, 2, 3],
        check: |seed| fractions(seed, Kinds::All, SLANTED, 2),
    },
    Family {
        name: "measures",
        in_test: true,
        seeds: &[1, 2, 3, 4, 5, 6, 7, 8],
        check: measures,
    },
    Family {
        name: "totals",
        in_test: false,
        seeds: &[1, 2],
        check: totals,
    },
    Family {
        name: "distances",
        in_test: true,
        seeds: &[1, 2, 3, 4, 5, 6, 7, 8],
        check: distances,
    },
    Family {
        name: "distances-composites",
        in_test: false,
        seeds: &[1, 2],
        check: joints::distances,
    },
    Family {
        name: "converge",
        in_test: true,
        seeds: &[1, 2, 3],
        check: converge,
    },
    Family {
        name: "meshes",
        in_test: true,
        seeds: &[1, 2, 3, 4, 5, 6, 7, 8],
        check: meshes::meshes,
    },
];

/// What storing a fraction in f32 changes.
const STORED: f64 = 6e-8;

/// The library's scene; `None` where it refuses.
fn loaded(text: &str) -> Option<Scene> {
    Scene::parse(text).ok()
}

fn refused(text: String) -> (String, Found) {
    let found = Found {
        open: 1,
        ..Found::default()
    };
    (text, found)
}

/// The share of a box that is inside, by chords along an axis.
fn share(
    truth: &Truth,
    [low, sides]: [DVec3; 2],
    axis: usize,
    tolerance: f64,
    [parts, most]: [u32; 2],
) -> Estimate {
    // Not in the planes of the box: those of solids may be the same.
    const BESIDE: f64 = 1e-9;
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let all = [BESIDE, 1.0 - BESIDE];
    let mut cuts = Vec::new();
    let mut along = |v: f64| {
        let mut chord = |u: f64| {
            let mut p = low;
            p[a] += u * sides[a];
            p[b] += v * sides[b];
            Estimate {
                value: truth.share(p, DVec3::AXES[axis] * sides[axis], &mut cuts),
                error: 0.0,
            }
        };
        integral(all, parts, 0.3 * tolerance, most, &mut chord)
    };
    let found = integral(all, parts, 0.5 * tolerance, most, &mut along);
    Estimate {
        value: found.value,
        error: found.error + 4.0 * BESIDE,
    }
}

/// The share of a box from chords along all three axes, closer together: what one of them steps over
/// makes them differ, and that is a part of the error.
fn looked_at_again(truth: &Truth, voxel: [DVec3; 2], tolerance: f64) -> Estimate {
    let all = [0, 1, 2].map(|axis| share(truth, voxel, axis, tolerance, [16, 2000]));
    let values = all.map(|e| e.value);
    let [low, high] = [
        values.into_iter().fold(f64::INFINITY, f64::min),
        values.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ];
    Estimate {
        value: 0.5 * (low + high),
        error: all.iter().fold(0.0_f64, |m, e| m.max(e.error)) + (high - low),
    }
}

/// Fractions of voxels, and their sum where it is the solid's volume.
fn fractions(seed: u64, kinds: Kinds, place: Where, count: usize) -> (String, Found) {
    let mut random = Random::new(seed);
    let drawn = scene(kinds, place, count, &mut random);
    let text = drawn.text.clone() + &grid(&drawn, &mut random);
    let Some(scene) = loaded(&text) else {
        return refused(text);
    };
    let mut found = Found::default();
    let Ok(grid) = scene.grid() else {
        return refused(text);
    };
    let fraction = sample::fraction(&scene, &grid).expect("memory");
    let bound = voxlathe::converge::FRACTION_BOUND + STORED;
    let all = fraction.data();
    let [nx, ny, _] = grid.dims();
    let partial: Vec<usize> = (0..all.len())
        .filter(|&i| all[i] > 0.0 && all[i] < 1.0)
        .collect();
    let near = |i: usize| {
        let at = grid.centre(i % nx, i / nx % ny, i / nx / ny);
        let reach = 0.9 * grid.spacing().length();
        drawn.truth.solids.iter().any(|s| s.distance(at) < reach)
    };
    for k in 0..8 {
        let i = if k < 6 && !partial.is_empty() {
            partial[random.below(partial.len())]
        } else {
            let i = random.below(all.len());
            if !near(i) {
                continue;
            }
            i
        };
        let at = [i % nx, i / nx % ny, i / nx / ny];
        let low = grid.centre(at[0], at[1], at[2]) - 0.5 * grid.spacing();
        let own = f64::from(all[i]);
        let voxel = [low, grid.spacing()];
        let axis = random.below(3);
        let mut truth = share(&drawn.truth, voxel, axis, 0.1 * bound, [3, 400]);
        if (own - truth.value).abs() > bound + truth.error {
            truth = looked_at_again(&drawn.truth, voxel, 0.1 * bound);
        }
        // Far from the origin a voxel's planes are rounded.
        let rounded = 4.0 * f64::EPSILON * low.abs().max_element() / grid.spacing().min_element();
        found.hold(
            &format!("fraction of voxel {at:?}"),
            own,
            truth,
            bound + 16.0 * rounded,
        );
    }
    let bounds = scene.bounds();
    let [low, high] = [
        grid.origin(),
        grid.origin() + grid.spacing() * DVec3::from(grid.dims().map(|n| n as f64)),
    ];
    if let Some(volume) = drawn.volume
        && bounds.min.cmpge(low).all()
        && bounds.max.cmple(high).all()
    {
        let sum: f64 = all.iter().map(|v| f64::from(*v)).sum::<f64>() * grid.voxel_volume();
        let truth = Estimate {
            value: volume,
            error: 1e-11 * volume,
        };
        let stored = STORED * partial.len() as f64 * grid.voxel_volume();
        found.hold("sum of all fractions", sum, truth, 1e-7 * volume + stored);
    }
    (text, found)
}

/// Volumes of single solids against closed forms.
fn measures(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let kinds = [Kinds::Turned, Kinds::Volumes, Kinds::Quadrics][random.below(3)];
    let drawn = scene(kinds, SLANTED, 1, &mut random);
    let Some(scene) = loaded(&drawn.text) else {
        return refused(drawn.text);
    };
    let mut found = Found::default();
    let volume = drawn.volume.expect("one solid");
    let truth = Estimate {
        value: volume,
        error: 1e-12 * volume,
    };
    for part in scene.assembly().parts() {
        let measured = part.measures();
        let bound = measured.error_estimate.volume.max(1e-13 * volume);
        found.hold("volume", measured.volume, truth, bound);
        if measured.error_estimate.volume > 1e-9 * volume {
            found.open += 1;
        }
    }
    (drawn.text, found)
}

/// Totals of composites.
fn totals(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let count = 2 + random.below(2);
    let mut place = SLANTED;
    place.powers = &[0];
    place.far = false;
    let drawn = scene(Kinds::All, place, count, &mut random);
    let Some(scene) = loaded(&drawn.text) else {
        return refused(drawn.text);
    };
    let mut found = Found::default();
    let Some(measured) = scene.measures() else {
        return refused(drawn.text);
    };
    // About all that is added.
    let bounds = scene.bounds();
    let more = 1e-9 * drawn.size;
    let (low, sides) = (bounds.min - more, bounds.sides() + 2.0 * more);
    let share = share(&drawn.truth, [low, sides], random.below(3), 1e-6, [8, 1000]);
    let whole = sides.x * sides.y * sides.z;
    let truth = Estimate {
        value: share.value * whole,
        error: share.error * whole,
    };
    let bound = measured.error_estimate.volume.max(1e-15 * whole);
    found.hold("total volume", measured.volume, truth, bound);
    if measured.error_estimate.volume <= 1e-9 * measured.volume {
        // What is known to 1e-9 may be held against less.
        found.held += found.open;
        found.open = 0;
    }
    (drawn.text, found)
}

/// Distances of single solids and of what they store on aligned grids.
fn distances(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let kinds = [Kinds::Turned, Kinds::Volumes, Kinds::Quadrics][random.below(3)];
    let drawn = scene(kinds, SLANTED, 1, &mut random);
    let Some(scene) = loaded(&drawn.text) else {
        return refused(drawn.text);
    };
    let mut found = Found::default();
    let solid = &drawn.truth.solids[0];
    let about = solid.frame.origin_small;
    for k in 0..60 {
        let mut p = about + DVec3::from([0, 1, 2].map(|_| drawn.size * random.between(-1.0, 1.0)));
        if k % 3 == 0 {
            // On planes of symmetry and on axes.
            for c in 0..3 {
                if random.below(2) == 0 {
                    p[c] = about[c];
                }
            }
        }
        distance(&mut found, &scene, &drawn, p);
    }
    (drawn.text, found)
}

fn distance(found: &mut Found, scene: &Scene, drawn: &Drawn, p: DVec3) {
    let (sdf, certain) = scene.assembly().signed_distance_with_certainty(p);
    let solid = &drawn.truth.solids[0];
    let far = solid.distance(p);
    let rounding = 8.0 * f64::EPSILON * (drawn.size + p.length());
    let truth = Estimate {
        value: far,
        error: 1e-12 * drawn.size + 4.0 * rounding,
    };
    let what = format!("distance at {:?}, certain {certain}", p.to_array());
    found.hold(&what, sdf.abs(), truth, 1e-10 * drawn.size);
    if (sdf <= 0.0) != solid.contains(p) && far > rounding {
        found
            .beyond
            .push(format!("{what}: {sdf:?} has the wrong sign"));
    }
}

/// Rows of a study against sums and distances of their own.
fn converge(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let kinds = [Kinds::Turned, Kinds::Quadrics][random.below(2)];
    let drawn = scene(kinds, WHOLE, 1, &mut random);
    let Some(scene) = loaded(&drawn.text) else {
        return refused(drawn.text);
    };
    let mut found = Found::default();
    let plan = Plan {
        resolutions: vec![7, 12],
        offsets: 1,
    };
    let Ok(study) = study(&scene, &plan, &|| Ok(()), &mut |_| {}) else {
        return refused(drawn.text);
    };
    let volume = drawn.volume.expect("one solid");
    for row in &study.rows {
        let with = format!("{}[grid]\nresolution = {}\n", drawn.text, row.resolution);
        let finer = Scene::parse(&with).expect("the scene with a grid");
        let grid = finer.grid().expect("a grid");
        let shares = sample::fraction(&finer, &grid).expect("memory");
        let sum: f64 =
            shares.data().iter().map(|v| f64::from(*v)).sum::<f64>() * grid.voxel_volume();
        let known = |value: f64, error: f64| Estimate { value, error };
        let right = (sum / volume - 1.0).abs();
        // The row's sum is of fractions before they are rounded to f32, each within 1e-9 of the solid's share.
        let cut = shares.data().iter().filter(|&&v| v > 0.0 && v < 1.0);
        let (count, kept) = cut.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + f64::from(*v)));
        let share = grid.voxel_volume() / volume;
        // The planes of a far grid are where f64 has numbers.
        let far = grid.origin().abs() / grid.spacing();
        let planes = 16.0 * f64::EPSILON * far.max_element() + 1e-11;
        // A fraction v is stored within half a step of f32, at most `EPSILON / 2 * v`. The faces of a box cut whole
        // layers alike, so those of a layer do not cancel.
        found.hold(
            "volume_fraction_error",
            row.volume_fraction_error,
            known(0.0, 0.0),
            1e-9 * count * share + planes,
        );
        found.hold(
            "volume_fraction_error as stored",
            right,
            known(
                row.volume_fraction_error,
                f64::from(f32::EPSILON) / 2.0 * kept * share,
            ),
            planes,
        );
        found.hold(
            "volume_fraction_error beside its bound",
            right,
            known(0.0, 0.0),
            row.volume_fraction_bound,
        );
        let stored = sample::signed_distance(&finer, &grid).expect("memory");
        let [nx, ny, _] = grid.dims();
        let rounding = 1e-11 * drawn.size + 64.0 * f64::EPSILON * grid.origin().length();
        let least = grid.spacing().min_element();
        let mut most = 0.0_f64;
        for (i, v) in stored.data().iter().enumerate().step_by(7) {
            let p = grid.centre(i % nx, i / nx % ny, i / nx / ny);
            let right = drawn.truth.solids[0].distance(p);
            // Rows are about the grid, not about the tables that a run may take distances from.
            let own = scene.assembly().signed_distance(p) as f32;
            most = most.max((f64::from(own.abs()) - right).abs());
            let ulps = 2.0 * f64::from(f32::EPSILON) * right;
            let what = format!("stored distance at {:?}", p.to_array());
            found.hold(
                &what,
                f64::from(v.abs()),
                known(right, rounding),
                ulps.max(1e-4 * least),
            );
        }
        if most > row.sdf_max_error + rounding {
            found.beyond.push(format!(
                "sdf_max_error {:e}, but {most:e} was seen",
                row.sdf_max_error
            ));
        }
        let ulps =
            2.0 * f64::from(f32::EPSILON) * 2.0 * (drawn.size + grid.spacing().length() * 6.0);
        let bound = (1e-4 * least).max(ulps);
        found.hold(
            "sdf_max_error",
            row.sdf_max_error,
            known(0.0, rounding),
            bound,
        );
    }
    (drawn.text, found)
}
