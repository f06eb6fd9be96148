//! Signed distance of composites against the nearest point of their boundary, found by faces,
//! curves and corners.

mod support;

use glam::DVec3;
use rayon::prelude::*;
use support::composite::{Case, Composite, Profile, ball, coaxial, composites, cylinder, sphere};
use support::sampling::Random;
use voxlathe::{Scene, sample};

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

/// Where the nearest point of the boundary is by the distances about a point.
fn said(case: &Case, p: DVec3, sdf: f64) -> DVec3 {
    let step = 1e-5 * case.size;
    let slope = DVec3::AXES.map(|e| case.distance(p + e * step).0 - case.distance(p - e * step).0);
    p - DVec3::from_array(slope).normalize_or_zero() * sdf
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
        // The samples may have missed a short curve: what is said is looked at where it is said to be.
        let place = case.unplaced(said(case, p, sdf));
        for better in [
            model.witness(place, q),
            model.search(q, sdf.abs() / scale, random),
        ] {
            least = least.min(far(better));
            if sdf.abs() >= least - bound {
                break;
            }
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
fn exact_everywhere() {
    check(composites(), 120, true);
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
    check(composites(), many(), true);
}

#[test]
#[ignore = "minutes long: run in release"]
fn a_million_distances_of_coaxial_composites() {
    check(coaxial(), many(), true);
}

fn chains(seeds: std::ops::Range<u64>) -> impl Iterator<Item = Composite> {
    seeds.map(|seed| support::composite::chain(seed, 3 + seed as usize % 12))
}

#[test]
fn chains_are_exact_everywhere() {
    check(chains(300..312).collect(), 60, true);
    // Edges that run along borders of their faces, closer than any step, and such as come back over a bore.
    let grazing = [263, 272, 298, 315, 337].map(|seed| chains(seed..seed + 1));
    check(grazing.into_iter().flatten().collect(), 500, true);
}

#[test]
#[ignore = "minutes long: run in release"]
fn a_hundred_thousand_distances_of_two_hundred_composites() {
    let mut all = composites();
    all.extend(chains(200..400));
    all.retain(|c| {
        c.items
            .iter()
            .all(|i| !matches!(i.profile, Profile::Text(_)))
    });
    all.truncate(200);
    check(all, 500, true);
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
            let report = examine(&case, p, true, &mut Random::new(1));
            for line in report.failures {
                failures += &format!("{line}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

fn signed(scene: &Scene, p: [f64; 3]) -> f64 {
    let (distance, exact) = (scene.assembly()).signed_distance_with_certainty(DVec3::from_array(p));
    assert!(exact, "a bound at {p:?}");
    distance
}

/// A point and its signed distance.
type Row = ([f64; 3], f64);

/// Where faces of two solids are one in the other's surface no sheet is left between.
#[test]
fn no_sheet_where_faces_join() {
    let elbow = "schema = 1\n[[solid]]\nkind = 'cylinder'\nradius = 1\nheight = 6\n\
                 [[solid]]\nkind = 'torus'\nmajor = 4\nminor = 1\nangle = 90\n\
                 axis = { origin = [4, 0, 6], direction = [0, 1, 0], x = [-1, 0, 0] }";
    let flush = "schema = 1\n[[solid]]\nkind = 'box'\nsize = [8, 8, 4]\n\
                 [[solid]]\nkind = 'cylinder'\nradius = 2\nheight = 4\noperation = 'subtract'\n\
                 axis = { origin = [0, 0, -2] }\n\
                 [[solid]]\nkind = 'box'\nsize = [2, 2, 1]\noperation = 'subtract'\n\
                 axis = { origin = [3, 3, 1.5] }";
    let quarter = |start: i32| {
        format!("[[solid]]\nkind = 'torus'\nmajor = 2\nminor = 1\nstart = {start}\nangle = 90\n")
    };
    let quarters = [0, 90, 180, 270].map(quarter).concat();
    let rows: [(&str, &[Row]); 3] = [
        (
            elbow,
            &[
                ([0.0, 0.0, 6.0], -1.0),
                ([0.5, 0.0, 6.0], -0.5),
                ([0.0, 0.0, 5.0], -1.0),
            ],
        ),
        (
            flush,
            &[
                ([0.0, 0.0, 2.0], 2.0),
                ([0.0, 0.0, 2.1], (4.0_f64 + 0.01).sqrt()),
                ([3.0, 3.0, 2.0], 1.0),
                ([3.0, 3.0, 2.5], 1.25_f64.sqrt()),
            ],
        ),
        (
            &format!("schema = 1\n{quarters}"),
            &[
                ([2.0, 0.0, 0.0], -1.0),
                ([0.0, -2.5, 0.0], -0.5),
                ([0.0, 0.0, 0.0], 1.0),
            ],
        ),
    ];
    for (text, points) in rows {
        let scene = Scene::parse(text).expect("a scene");
        for &(p, wanted) in points {
            let found = signed(&scene, p);
            assert!(
                (found - wanted).abs() <= 1e-9,
                "{found} for {wanted} at {p:?}"
            );
        }
    }
}

/// About a point where solids of one axis touch, both surfaces are boundary up to the point: what is between them is
/// thinner than a rounding as far off as the root of one.
#[test]
fn surfaces_that_touch_on_the_axis() {
    let ball = |radius: f64, z: f64, operation: &str| {
        format!(
            "[[solid]]\nkind = 'sphere'\nradius = {radius:?}\naxis = {{ origin = [0, 0, {z:?}] }}\n\
             operation = '{operation}'\n"
        )
    };
    let two = |first: String, second: String| {
        Scene::parse(&format!("schema = 1\n{first}{second}")).expect("a scene")
    };
    let on_another = two(ball(1.0, 0.0, "add"), ball(0.5, 1.5, "add"));
    let within_another = two(ball(1.0, 0.0, "add"), ball(0.5, 0.5, "subtract"));
    for far in [0.0, 1e-10, 1e-9, 1e-8, 3e-8, 1e-7, 1e-6] {
        for aside in [0.0, 1e-9, 1e-8, 4e-8, 1e-7] {
            let above = signed(&on_another, [aside, 0.0, 1.0 + far]);
            assert!(
                (above.abs() - far).abs() < 1e-13,
                "{far:e} {aside:e}: {above:e}"
            );
            let below = signed(&within_another, [0.0, aside, 1.0 - far]);
            assert!(
                (below.abs() - far).abs() < 1e-13,
                "{far:e} {aside:e}: {below:e}"
            );
        }
    }
}

/// Where the edges of three surfaces touch though the surfaces cross, what they leave between them is thinner than a
/// rounding as far off as the root of one, and yet reaches up to the place.
#[test]
fn edges_that_touch_in_a_place() {
    let text = "schema = 1\n[[solid]]\nkind = 'cylinder'\nradius = 1.5\nheight = 0.5\n\
                axis = { origin = [-0.5, 0, 0.5], direction = [0, -1, 0] }\n\
                [[solid]]\nkind = 'cylinder'\nradius = 1\nheight = 1.75\n\
                axis = { origin = [0.5, 0.5, 0.5], direction = [0, -1, 0] }\n\
                [[solid]]\nkind = 'torus'\nmajor = 1.75\nminor = 0.5\naxis = { origin = [0.25, -1, 0.5] }";
    let scene = Scene::parse(text).expect("a scene");
    for far in [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5] {
        for z in [0.5 - far, 0.5 + far] {
            let found = signed(&scene, [-0.5, 0.0, z]);
            assert!(found.abs() <= far + 1e-11, "{found:e} at {far:e}");
        }
    }
}

/// A ring less the half of it that is told by the same profile is the other half.
#[test]
fn a_ring_less_its_half() {
    let text = "schema = 1\n[profiles.tube]\n\
                curves = [{ kind = 'circle', center = [2, 0], radius = 0.5 }]\n\
                [[solid]]\nkind = 'revolve'\nprofile = 'tube'\n\
                [[solid]]\nkind = 'revolve'\nprofile = 'tube'\noperation = 'subtract'\n\
                start = 20\nangle = 180";
    let scene = Scene::parse(text).expect("a scene");
    let mut random = Random::new(5);
    for _ in 0..2000 {
        let p = [3.0, 3.0, 1.0].map(|c| random.between(-c, c));
        // Lengths along the cut, across it to the half's side, and from the ring's circle.
        let (sin, cos) = 20_f64.to_radians().sin_cos();
        let (along, beside) = (p[0] * cos + p[1] * sin, p[0] * sin - p[1] * cos);
        let tube = |r: f64| (r - 2.0).hypot(p[2]) - 0.5;
        let cap = beside.hypot(tube(along.abs()).max(0.0));
        let swept = tube(along.hypot(beside));
        let inside = beside >= 0.0 && swept <= 0.0;
        let distance = if beside >= 0.0 {
            cap.min(swept.abs())
        } else {
            cap
        };
        let wanted = if inside { -distance } else { distance };
        let found = signed(&scene, p);
        assert!(
            (found - wanted).abs() <= 1e-9,
            "{found} for {wanted} at {p:?}"
        );
    }
}

/// Boxes along the axes, on a lattice of halves so that many are flush: the boundary is the rectangles between the cells
/// of their planes.
#[test]
fn boxes_against_rectangles() {
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let mut half = |low: i32, count: usize| {
            f64::from(low + i32::try_from(random.below(count)).expect("small")) / 2.0
        };
        let mut text = "schema = 1\n".to_owned();
        let mut boxes: Vec<([f64; 3], [f64; 3], &str)> = Vec::new();
        for n in 0..5 {
            let low = [0; 3].map(|_| half(-4, 6));
            let high = low.map(|l| l + half(1, 6));
            let operation = match half(0, 8) {
                _ if n == 0 => "add",
                h if h < 2.0 => "add",
                h if h < 3.5 => "subtract",
                _ => "intersect",
            };
            let size = [0, 1, 2].map(|i| high[i] - low[i]);
            let middle = [0, 1, 2].map(|i| 0.5 * (high[i] + low[i]));
            text += &format!(
                "[[solid]]\nkind = 'box'\nsize = {size:?}\naxis = {{ origin = {middle:?} }}\n\
                 operation = '{operation}'\n"
            );
            boxes.push((low, high, operation));
        }
        let inside = |p: [f64; 3]| {
            boxes.iter().fold(false, |state, (low, high, operation)| {
                let held = (0..3).all(|i| p[i] > low[i] && p[i] < high[i]);
                match *operation {
                    "add" => state || held,
                    "subtract" => state && !held,
                    _ => state && held,
                }
            })
        };
        // Rectangles: each half a cell on either side.
        let mut rectangles: Vec<([f64; 3], [f64; 3])> = Vec::new();
        let cells = -6..12;
        for (i, j, k) in cells.clone().flat_map(|i| {
            let cells = cells.clone();
            cells
                .clone()
                .flat_map(move |j| cells.clone().map(move |k| (i, j, k)))
        }) {
            let low = [i, j, k].map(|c| f64::from(c) / 2.0);
            let middle = low.map(|c| c + 0.25);
            for axis in 0..3 {
                let mut before = middle;
                before[axis] -= 0.5;
                if inside(middle) != inside(before) {
                    let mut high = low.map(|c| c + 0.5);
                    high[axis] = low[axis];
                    rectangles.push((low, high));
                }
            }
        }
        let scene = Scene::parse(&text).expect("a scene");
        for n in 0..150 {
            let p = [0; 3].map(|_| random.between(-3.0, 5.0));
            // Some on the lattice.
            let p = p.map(|c| {
                if n % 3 == 0 {
                    (c * 4.0).round() / 4.0
                } else {
                    c
                }
            });
            let far = |(low, high): &([f64; 3], [f64; 3])| {
                let off = [0, 1, 2].map(|i| (low[i] - p[i]).max(p[i] - high[i]).max(0.0));
                (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt()
            };
            let wanted = rectangles.iter().map(far).fold(f64::MAX, f64::min);
            let found = signed(&scene, p);
            assert!(
                (found.abs() - wanted).abs() <= 1e-9,
                "{found} for {wanted} at {p:?}: {text}"
            );
            assert_eq!(
                found <= 0.0,
                scene.assembly().contains(DVec3::from_array(p))
            );
        }
    }
}
