//! Distances of composites against the nearest point of their boundary, found by faces, curves and
//! corners: solids told in pieces, joints, flush tools, and lattices where much coincides.

use glam::DVec3;

use super::checks::Found;
use super::cubature::Estimate;
use super::support::composite::{
    Case, Composite, Item, ball, chain, cylinder, frustum, torus, tube,
};
use super::support::sampling::Random;

fn round(random: &mut Random) -> Item {
    match random.below(5) {
        0 => torus(2.0, 0.5 + 0.25 * random.below(3) as f64),
        1 => cylinder(1.5, 0.0, 1.0 + random.below(3) as f64),
        2 => tube(0.5, 1.5, -1.0, 1.0),
        3 => frustum(2.0, 0.0, 0.5, 2.0),
        _ => ball(1.5),
    }
}

/// Solids whose faces lie on each other.
fn joined(random: &mut Random) -> Vec<Item> {
    match random.below(6) {
        // One solid in parts of its turn.
        0 => {
            let whole = round(random);
            let parts = [2, 3, 4][random.below(3)];
            let angle = 360.0 / parts as f64;
            let start = [0.0, 20.0, 45.0][random.below(3)];
            (0..parts)
                .map(|k| whole.clone().turn(start + angle * k as f64, angle))
                .collect()
        }
        // One solid less a part of itself.
        1 => {
            let whole = round(random);
            let angle = [90.0, 180.0, 120.0][random.below(3)];
            vec![whole.clone(), whole.turn(20.0, angle).cut()]
        }
        // A pipe and a bend.
        2 => vec![
            cylinder(1.0, 0.0, 6.0),
            torus(4.0, 1.0)
                .turn(180.0, 90.0)
                .along(0.0, 1.0, 0.0)
                .at(4.0, 0.0, 6.0),
        ],
        // Bores as long as what they go through.
        3 => {
            let height = 1.0 + random.below(3) as f64;
            let (x, y) = (0.25 * random.below(5) as f64, 0.25 * random.below(5) as f64);
            vec![
                cylinder(3.0, 0.0, height),
                cylinder(0.5 + 0.25 * random.below(3) as f64, 0.0, height)
                    .at(x, y, 0.0)
                    .cut(),
            ]
        }
        // Two on top of each other, about other axes.
        4 => vec![
            cylinder(2.0, 0.0, 1.0),
            round(random).at(0.25 * random.below(5) as f64, 0.0, 1.0),
        ],
        _ => vec![
            cylinder(1.0, -2.0, 2.0).along(0.0, 0.0, 1.0),
            cylinder(1.0, -2.0, 2.0)
                .along(1.0, 0.0, 0.0)
                .at(0.0, 0.0, 2.0),
            ball(1.0).at(0.0, 0.0, -2.0),
        ],
    }
}

pub(crate) fn distances(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let composite = if random.below(3) == 0 {
        chain(seed, 2 + random.below(4))
    } else {
        Composite::new(&format!("joined {seed}"), joined(&mut random))
    };
    let composite = match random.below(4) {
        0 => composite.turned([1.0, 2.0, 3.0], 77.0),
        1 => composite.placed(1e3, DVec3::new(1e3, 0.0, -2e3)),
        _ => composite,
    };
    let text = composite.text();
    let mut found = Found::default();
    let mut case = Case::new(composite);
    if let Some(model) = case.model.as_mut() {
        model.prepare();
    }
    let seeds = case.meetings(60, &mut random);
    for k in 0..120 {
        let p = match k % 3 {
            0 => case.point(&seeds, &mut random),
            // Within one solid, in a plane that bounds another.
            1 => {
                let [one, other] = [0, 1].map(|_| {
                    let single = &case.singles[random.below(case.singles.len())];
                    single.bounds()
                });
                let mut p = one.min + one.sides() * DVec3::from([0, 1, 2].map(|_| random.unit()));
                let c = random.below(3);
                p[c] = if random.below(2) == 0 {
                    other.min[c]
                } else {
                    other.max[c]
                };
                p
            }
            // On a lattice.
            _ => {
                let (scale, by) = case.composite.moved;
                let low = (case.low - by) / scale;
                let sides = (case.high - case.low) / scale;
                let at = DVec3::from([0, 1, 2].map(|_| random.unit()));
                ((low + sides * at) * 4.0).round() / 4.0 * scale + by
            }
        };
        examine(&case, p, &mut found);
    }
    (text, found)
}

fn examine(case: &Case, p: DVec3, found: &mut Found) {
    let Some(model) = case.model.as_ref() else {
        return;
    };
    let scale = case.composite.moved.0;
    let (sdf, certain) = case.distance(p);
    let q = (p - case.composite.moved.1) / scale;
    let [sure, perhaps] = model.nearest(q);
    let far = |foot: Option<DVec3>| foot.map_or(f64::INFINITY, |f| f.distance(q) * scale);
    let (most, least) = (far(sure), far(perhaps));
    let bound =
        1e-9 * case.size + 16.0 * f64::EPSILON * (p.length() + case.composite.moved.1.length());
    let what = format!("distance {sdf:e} at {:?}, certain {certain}", p.to_array());
    // The faces' own reasoning is too coarse in crevices, and a foot may be missed.
    let touching = model.touches(q, 2e-5);
    if sdf.abs() > most + bound {
        found.beyond.push(format!(
            "{what}: a point of the boundary is {most:e} away, {sure:?}"
        ));
    } else if touching || perhaps.is_none() || least < most - bound {
        found.open += 1;
    } else {
        // A lower bound that is short of the distance is not one.
        let truth = Estimate {
            value: most,
            error: 0.0,
        };
        found.hold(&what, sdf.abs(), truth, bound);
    }
}
