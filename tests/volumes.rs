//! Solids of kind `volume`: trivariate NURBS against profiles that are turned, closed forms and their
//! own tessellations.

use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use voxlathe::{Scene, sample};

fn scene(text: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{text}")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Numbers in [0, 1) that fill it evenly.
fn share(n: u32, k: usize) -> f64 {
    let step = [
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    ];
    (f64::from(n) * step[k]).fract()
}

fn points(scene: &Scene, count: u32) -> impl Iterator<Item = DVec3> {
    let bounds = scene.bounds();
    let (middle, sides) = (0.5 * (bounds.min + bounds.max), bounds.sides());
    (0..count).map(move |n| {
        middle + 1.1 * sides * (DVec3::new(share(n, 0), share(n, 1), share(n, 2)) - 0.5)
    })
}

const PLACED: &str = "axis = { origin = [1, -2, 0.5], direction = [1, 2, 3] }
    place = [{ scale = 0.75 }, { rotate = { axis = [0, 1, 1], degrees = 30 } }]";

/// Profiles whose chain rises or falls, steps included.
const CHAINS: [(&str, &str); 6] = [
    (
        "cylinder",
        "{ kind = 'polyline', points = [[1, 0], [1, 2]] }",
    ),
    ("cone", "{ kind = 'polyline', points = [[1.5, 0], [0, 2]] }"),
    (
        "sphere",
        "{ kind = 'arc', center = [0, 0], radius = 1.25, from = -90, to = 90 }",
    ),
    (
        "vase",
        "{ kind = 'nurbs', degree = 3, points = [[0.5, 0], [1.5, 0.5], [0.25, 1], [1, 2], [0.75, 2.5]], weights = [1, 2, 1, 0.5, 1] }",
    ),
    (
        "steps",
        "{ kind = 'polyline', points = [[2, 0], [2, 0.5], [1, 0.5], [1.25, 1.5], [1.75, 1.5], [0.5, 2.5]] }",
    ),
    (
        "falling",
        "{ kind = 'interpolate', points = [[0.5, 2], [1, 1.5], [0.75, 1], [1.25, 0]] }",
    ),
];

/// The volume of a chain by a construction, and the revolved solid of the same profile.
fn pair(chain: &str, construct: &str, turn: &str, placed: &str) -> (Scene, Scene) {
    let profile = format!("[profiles.p]\nboundary = 'to-axis'\ncurves = [{chain}]");
    let kind = |kind: &str| {
        scene(&format!(
            "{profile}\n[[solid]]\n{kind}\nprofile = 'p'\n{turn}\n{placed}"
        ))
    };
    (
        kind(&format!("kind = 'volume'\nconstruct = '{construct}'")),
        kind("kind = 'revolve'"),
    )
}

fn every_pair(mut check: impl FnMut(&str, &Scene, &Scene)) {
    for (name, chain) in CHAINS {
        for construct in ["curve-disc", "curve-ruled"] {
            for turn in ["", "angle = 250\nstart = 20"] {
                let (volume, revolved) = pair(chain, construct, turn, PLACED);
                check(&format!("{name} {construct} {turn}"), &volume, &revolved);
            }
        }
    }
}

/// No point further than 1e-9 of the size from the surface may differ.
fn check_membership(count: u32) {
    every_pair(|name, volume, revolved| {
        let size = revolved.bounds().longest_side();
        let all: Vec<DVec3> = points(revolved, count).collect();
        let differs = |p: &&DVec3| {
            let inside = revolved.assembly().contains(**p);
            if volume.assembly().contains(**p) == inside {
                return false;
            }
            let sd = revolved.assembly().signed_distance(**p);
            assert!(sd.abs() <= 1e-9 * size, "{name}: {p} at {sd:e}");
            true
        };
        let differ = all.par_iter().filter(differs).count();
        // Nearer to the surface the two are different solids, by the rounding of their nets.
        for (n, p) in points(revolved, (count / 10).min(2000)).enumerate() {
            let sd = revolved.assembly().signed_distance(p);
            let h = 1e-6 * size;
            let slope = DVec3::from_array(DVec3::AXES.map(|e| {
                let f = |s: f64| revolved.assembly().signed_distance(p + s * h * e);
                (f(1.0) - f(-1.0)) / (2.0 * h)
            }));
            let off = [1e-8, -1e-8, 1e-5, -1e-5][n % 4] * size;
            let q = p - slope * (sd - off);
            let sd = revolved.assembly().signed_distance(q);
            if sd.abs() > 1e-9 * size {
                assert_eq!(
                    volume.assembly().contains(q),
                    sd < 0.0,
                    "{name}: {q} at {sd:e}"
                );
            }
        }
        eprintln!("{name}: {differ} of {count} differ, all within 1e-9 of the surface");
    });
}

#[test]
fn volumes_hold_what_their_profile_turned_holds() {
    check_membership(2000);
}

#[test]
#[ignore = "a million points a solid take minutes"]
fn volumes_hold_what_their_profile_turned_holds_at_a_million_points() {
    let asked = std::env::var("VOXLATHE_POINTS").ok();
    check_membership(asked.and_then(|n| n.parse().ok()).unwrap_or(1_000_000));
}

#[test]
fn distances_measures_and_bounds_are_those_of_the_profile_turned() {
    let mut worst = [0.0_f64; 4];
    every_pair(|name, volume, revolved| {
        let size = revolved.bounds().longest_side();
        for p in points(revolved, 300) {
            let (a, b) = (
                volume.assembly().signed_distance(p),
                revolved.assembly().signed_distance(p),
            );
            worst[0] = worst[0].max((a - b).abs() / size);
            assert!((a - b).abs() <= 1e-12 * size, "{name}: {p}: {a} {b}");
        }
        let (a, b) = (
            volume.measures().expect("one solid"),
            revolved.measures().expect("one solid"),
        );
        let volumes = (a.volume / b.volume - 1.0).abs();
        let areas = (a.area / b.area - 1.0).abs();
        worst[1] = worst[1].max(volumes);
        worst[2] = worst[2].max(areas);
        assert!(volumes <= 1e-12, "{name}: volume {} {}", a.volume, b.volume);
        assert!(
            (a.volume - b.volume).abs()
                <= a.error_estimate.volume + b.error_estimate.volume + 1e-14 * b.volume
        );
        assert!(areas <= 1e-11, "{name}: area {} {}", a.area, b.area);
        assert!(
            (a.area - b.area).abs()
                <= a.error_estimate.area + b.error_estimate.area + 1e-14 * b.area
        );
        let apart = (a.centroid.expect("full") - b.centroid.expect("full")).length();
        assert!(
            apart <= a.error_estimate.centroid + b.error_estimate.centroid + 1e-14 * size,
            "{name}: {apart:e}"
        );
        for (k, (a, b)) in a
            .inertia
            .iter()
            .flatten()
            .zip(b.inertia.iter().flatten())
            .enumerate()
        {
            assert!(
                (a - b).abs() <= 1e-12 * size.powi(5),
                "{name}: inertia {k}: {a} {b}"
            );
        }
        let (a, b) = (volume.bounds(), revolved.bounds());
        let off = (a.min - b.min)
            .abs()
            .max((a.max - b.max).abs())
            .max_element()
            / size;
        worst[3] = worst[3].max(off);
        assert!(off <= 1e-13, "{name}: {a:?} {b:?}");
    });
    eprintln!(
        "worst: distance {:e}, volume {:e}, area {:e}, bounds {:e}",
        worst[0], worst[1], worst[2], worst[3]
    );
}

/// The torus by b: rational biquadratic disc times circle.
const TORUS: &str = "section = { degrees = [2, 2], knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1]],
    points = [[2.646447, -0.353553], [2.292893, 0], [2.646447, 0.353553],
              [3, -0.707107], [3, 0], [3, 0.707107],
              [3.353553, -0.353553], [3.707107, 0], [3.353553, 0.353553]],
    weights = [1, 0.70710678118654752, 1, 0.70710678118654752, 1, 0.70710678118654752, 1, 0.70710678118654752, 1] }";

#[test]
fn a_section_turned_is_a_torus_but_for_its_decimals() {
    let torus = scene(&format!(
        "[[solid]]\nkind = 'volume'\nconstruct = 'surface-circle'\n{TORUS}"
    ));
    let found = torus.measures().expect("one solid");
    // Six decimals in the section.
    assert!(
        (found.volume / (2.0 * PI * PI * 3.0 * 0.25) - 1.0).abs() < 3e-6,
        "{}",
        found.volume
    );
    for p in points(&torus, 2000) {
        let sd = (p.x.hypot(p.y) - 3.0).hypot(p.z) - 0.5;
        let ours = torus.assembly().signed_distance(p);
        assert!((sd - ours).abs() < 2e-6, "{p}: {ours} {sd}");
    }
}

/// Every voxel of a grid: rows against points, fractions against those of the profile turned.
#[test]
fn grids_agree_with_points_and_fractions_with_the_profile_turned() {
    let mut worst = 0.0_f64;
    for (name, chain) in CHAINS {
        for (construct, turn) in [
            ("curve-disc", ""),
            ("curve-ruled", "angle = 250\nstart = 20"),
        ] {
            for placed in ["", PLACED] {
                let (volume, revolved) = pair(chain, construct, turn, placed);
                let mut fine = volume.clone();
                fine.model_mut().0.step = voxlathe::scene::GridStep::Resolutions([13, 11, 7]);
                let grid = fine.grid().expect("a grid");
                let occupancy = sample::occupancy(&volume, &grid).expect("a volume");
                let ours = sample::fraction(&volume, &grid).expect("a volume");
                let theirs = sample::fraction(&revolved, &grid).expect("a volume");
                let [nx, ny, nz] = grid.dims();
                for n in 0..nx * ny * nz {
                    let p = grid.centre(n % nx, n / nx % ny, n / (nx * ny));
                    assert_eq!(
                        occupancy.data()[n] == 1,
                        volume.assembly().contains(p),
                        "{name} {construct} {p}"
                    );
                    let off = f64::from(ours.data()[n]) - f64::from(theirs.data()[n]);
                    worst = worst.max(off.abs());
                    assert!(
                        off.abs() <= 2e-6,
                        "{name} {construct} {turn} {placed} {p}: {} {}",
                        ours.data()[n],
                        theirs.data()[n]
                    );
                }
            }
        }
    }
    eprintln!("worst fraction off by {worst:e}");
}

/// Two patches that share a face, one of their control points moved.
fn two_blocks(moved: f64) -> String {
    let mut patches = Vec::new();
    for x in [0.0, 2.0] {
        let mut points = Vec::new();
        for k in 0..3 {
            for j in 0..3 {
                for i in 0..3 {
                    let mut p = [x + f64::from(i), f64::from(j), f64::from(k)];
                    if [i, j, k] == [1, 1, 2] && x == 0.0 {
                        p[2] += moved;
                    }
                    // The middle of the shared face.
                    if [j, k] == [1, 1] && x + f64::from(i) == 2.0 {
                        p[0] += 0.5 * moved;
                    }
                    points.push(p);
                }
            }
        }
        let density: Vec<f64> = points.iter().map(|p| p[0] * 10.0 + p[1]).collect();
        patches.push(format!(
            "{{ degrees = [2, 2, 2], knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1]], points = {points:?}, fields = {{ density = {density:?} }} }}"
        ));
    }
    format!(
        "[[solid]]\nkind = 'volume'\npatches = [{}]",
        patches.join(", ")
    )
}

#[test]
fn shared_faces_are_no_boundary() {
    let blocks = scene(&two_blocks(0.0));
    let sd = |p: [f64; 3]| blocks.assembly().signed_distance(p.into());
    assert_eq!(sd([2.0, 1.0, 1.0]), -1.0);
    assert!((sd([1.75, 1.0, 0.75]) + 0.75).abs() < 1e-15);
    assert!(blocks.assembly().contains(DVec3::new(2.0, 0.0, 2.0)));
    let found = blocks.measures().expect("one solid");
    assert!((found.volume - 16.0).abs() <= found.error_estimate.volume + 1e-14);
    assert!((found.area - 40.0).abs() <= found.error_estimate.area + 1e-14);
    assert_eq!(found.bounds.expect("full").max.to_array(), [4.0, 2.0, 2.0]);

    // Fields and parameters come from the net.
    let mut grid = blocks.clone();
    grid.model_mut().0.step = voxlathe::scene::GridStep::Resolutions([7, 5, 3]);
    let perturbed = scene(&two_blocks(0.4));
    assert!(perturbed.assembly().contains(DVec3::new(1.0, 1.0, 2.05)));
    assert!(!perturbed.assembly().contains(DVec3::new(3.0, 1.0, 2.05)));
    let (a, b) = (
        perturbed.measures().expect("one"),
        perturbed.exact_volume().expect("one").value,
    );
    assert_eq!(a.volume, b);
    // The bump: ∬ B_1(u) B_1(v) 0.4 dx dy over a face of 2 by 2.
    assert!(
        (a.volume - 16.0 - 0.4 * 4.0 / 9.0).abs() < 1e-13,
        "{}",
        a.volume
    );
}

#[test]
fn patches_that_overlap_are_refused() {
    let cube = |x: f64| {
        let corner = |n: u32| {
            [
                x + f64::from(n & 1),
                f64::from(n >> 1 & 1),
                f64::from(n >> 2),
            ]
        };
        let points: Vec<[f64; 3]> = (0..8).map(corner).collect();
        format!(
            "{{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]], points = {points:?} }}"
        )
    };
    let pair = |x: f64| {
        format!(
            "schema = 1\n[[solid]]\nkind = 'volume'\npatches = [{}, {}]",
            cube(0.0),
            cube(x)
        )
    };
    assert!(
        scene(&pair(1.0).replace("schema = 1\n", ""))
            .warnings()
            .is_empty()
    );
    let said = Scene::parse(&pair(0.25))
        .expect_err("patches that overlap")
        .to_string();
    assert!(
        said.contains("patches 0 and 1, which both hold ["),
        "{said}"
    );
}

#[test]
fn a_chain_that_runs_back_is_refused_or_taken_as_its_discs() {
    let text = |fill: &str| {
        format!(
            "schema = 1\n[profiles.p]\nboundary = 'to-axis'\ncurves = [{{ kind = 'polyline', points = [[1, 0], [1, 2], [3, 2], [3, 1], [2, 1], [2, 3]] }}]
             [[solid]]\nkind = 'volume'\nconstruct = 'curve-ruled'\nprofile = 'p'\n{fill}"
        )
    };
    let error = Scene::parse(&text(""))
        .expect_err("it runs back")
        .to_string();
    assert!(
        error.contains("fill = \"union\"") || error.contains("runs back"),
        "{error}"
    );
    let union = Scene::parse(&text("fill = 'union'")).unwrap_or_else(|e| panic!("{e}"));
    // Discs of radius 1 to z = 1, of 3 to z = 2, of 2 to z = 3.
    let volume = PI * (1.0 + 9.0 + 4.0);
    let found = union.measures().expect("one solid").volume;
    assert!((found - volume).abs() < 1e-13 * volume, "{found} {volume}");
    // To the ring's lower edge.
    let sd = (union.assembly()).signed_distance(DVec3::new(0.0, 0.0, 1.5));
    assert!((sd + 1.25_f64.sqrt()).abs() < 1e-15);
    assert!(union.assembly().contains(DVec3::new(2.5, 0.0, 1.5)));
    assert!(!union.assembly().contains(DVec3::new(1.5, 0.0, 0.5)));
}

#[test]
fn bad_volumes_are_refused_with_their_place() {
    let refused = |text: &str, wanted: &str| {
        let error = Scene::parse(&format!("schema = 1\n[[solid]]\nkind = 'volume'\n{text}"));
        let error = error.expect_err(text).to_string();
        assert!(error.contains(wanted), "{text}: {error}");
    };
    let cube = "degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]]";
    let corners = "points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]]";
    refused("", "one of `patches`, `construct`, `file`");
    refused("patches = []", "at least one patch");
    refused(
        &format!("patches = [{{ {cube}, points = [[0, 0, 0]] }}]"),
        "solid[0].patches[0].points: found 1 control points, wanted 8: 2 x 2 x 2",
    );
    refused(
        &format!("patches = [{{ {cube}, {corners}, weights = [1, 1, 1, 0, 1, 1, 1, 1] }}]"),
        "solid[0].patches[0].weights[3]",
    );
    refused(
        &format!(
            "patches = [{{ {cube}, {corners}, fields = {{ sdf = [1, 1, 1, 1, 1, 1, 1, 1] }} }}]"
        ),
        "a name other than",
    );
    let folded = corners.replace("[1, 1, 1]", "[-3, -3, -3]");
    refused(
        &format!("patches = [{{ {cube}, {folded} }}]"),
        "folds over itself",
    );
    refused(
        "construct = 'curve-disc'\nprofile = 'p'",
        "the name of a profile",
    );
    refused("file = 'absent.g2'", "absent.g2");
    refused(
        &format!("patches = [{{ {cube}, {corners} }}]\nangle = 90"),
        "`angle` without `construct`",
    );
}

/// The inside test against the tessellated boundary.
#[test]
fn perturbed_volumes_agree_with_their_tessellation() {
    use voxlathe::validate::{Points, meshes, validate};
    for text in [two_blocks(0.4), two_blocks(-0.3)] {
        let mut one = scene(&text);
        one.model_mut().0.step = voxlathe::scene::GridStep::Resolutions([17, 13, 11]);
        let grid = one.grid().expect("a grid");
        let meshes = meshes(&one, 0.02).expect("meshes");
        let report =
            validate(&one, &grid, &meshes, Points::Grid, &|| Ok(()), &|_| ()).expect("a report");
        assert_eq!(report.disagree, 0);
        assert!(report.agree > 2000);
    }
}
