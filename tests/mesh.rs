//! Tessellations: closed, oriented outward, of the right genus, and within the chord error.

#[allow(dead_code, reason = "the texts are what is used here")]
#[path = "support/hard.rs"]
mod hard;

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::mesh::{MAX_TRIANGLES, Mesh, MeshError, MeshTree, tessellate};
use voxlathe::solid::Turn;

fn shipped() -> Vec<(String, Scene)> {
    let folder = format!("{}/scenes", env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("the scenes")
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|p| (p.display().to_string(), Scene::load(p).expect("a scene")))
        .collect()
}

fn scene(profile: &str, solid: &str) -> Scene {
    let text = format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{solid}\n"
    );
    Scene::parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn only(scene: &Scene, chord_error: f64) -> Mesh {
    let body = scene.assembly().single().expect("one body");
    tessellate(body, chord_error).unwrap_or_else(|e| panic!("{e}"))
}

/// Numbers in (0, 1), the same every time.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }
}

#[test]
fn every_shipped_solid_is_closed_and_its_volume_is_within_the_chord_error_of_the_exact_one() {
    for (name, scene) in shipped() {
        for part in scene.assembly().parts() {
            let size = part.bounds().longest_side();
            let exact = part.measures();
            for share in [0.05, 1e-3] {
                let mesh = tessellate(part.body(), share * size)
                    .unwrap_or_else(|e| panic!("{name} {}: {e}", part.name()));
                assert_eq!(
                    mesh.unmatched_edge(),
                    None,
                    "{name} {} {share}",
                    part.name()
                );
                assert!(mesh.chord_error() <= share * size && mesh.chord_error() > 0.0);
                assert_eq!(mesh.euler_characteristic() % 2, 0, "{name}");
                // What differs lies within the chord error of the true surface; twice its area
                // covers the curvature.
                let off = (mesh.volume() - exact.volume).abs();
                let room = 2.0 * exact.area * mesh.chord_error() + 1e-9 * exact.volume;
                assert!(
                    off <= room,
                    "{name} {}: {} for {}, off by {off}, room {room}",
                    part.name(),
                    mesh.volume(),
                    exact.volume
                );
                assert!(mesh.volume() > 0.0, "{name}: turned inside out");
            }
        }
    }
}

/// Gaps that a profile closes by a segment of 1e-15 make no triangles: programs that weld by
/// distance would tear the mesh there.
#[test]
fn no_edge_is_a_rounding() {
    for (name, scene) in shipped() {
        for part in scene.assembly().parts() {
            let size = part.bounds().longest_side();
            let mesh = tessellate(part.body(), 2e-3 * size).expect("a mesh");
            let shortest = mesh
                .corners()
                .flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)])
                .fold(f64::INFINITY, f64::min);
            assert!(
                shortest > 1e-7 * size,
                "{name} {}: {shortest:e}",
                part.name()
            );
        }
    }
}

#[test]
fn hard_profiles_close() {
    for (name, text) in hard::texts(true) {
        let scene = Scene::parse(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        for part in scene.assembly().parts() {
            let size = part.bounds().longest_side();
            for share in [0.1, 1e-3] {
                let mesh =
                    tessellate(part.body(), share * size).unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_eq!(mesh.unmatched_edge(), None, "{name} {share}");
                let exact = part.measures();
                let off = (mesh.volume() - exact.volume).abs();
                let room = 2.0 * exact.area * mesh.chord_error() + 1e-9 * exact.volume;
                assert!(off <= room, "{name} {share}: off by {off}, room {room}");
            }
        }
    }
}

#[test]
fn the_genus_is_right() {
    let ring = "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]";
    let ball = "boundary = 'to-axis'\ncurves = [{ kind = 'arc', center = [0, 0], radius = 2, from = -90, to = 90 }]";
    let shell = "loops = [[{ kind = 'arc', center = [0, 0], radius = 2, from = -90, to = 90 }, \
                 { kind = 'polyline', points = [[0, 2], [0, -2]] }], \
                 [{ kind = 'arc', center = [0, 0], radius = 1, from = -90, to = 90 }, \
                 { kind = 'polyline', points = [[0, 1], [0, -1]] }]]";
    let pipe = "loops = [[{ kind = 'circle', center = [3, 0], radius = 1 }], \
                [{ kind = 'circle', center = [3, 0], radius = 0.5 }]]";
    let horn = "curves = [{ kind = 'circle', center = [1, 0], radius = 1 }]";
    let hourglass = "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[1, -1], [0, 0], [1, 1]] }]";
    let pinched = "loops = [[{ kind = 'polyline', points = [[1, 0], [2, 1], [1, 2], [0.5, 1], [1, 0]] }], \
                   [{ kind = 'polyline', points = [[2, 1], [3, 0], [4, 1], [3, 2], [2, 1]] }]]";
    let cases = [
        (ring, "", 0),
        (ring, "angle = 100", 2),
        (ring, "angle = 359.9", 2),
        (ball, "", 2),
        (ball, "angle = 180", 2),
        (ball, "angle = 270", 2),
        (shell, "", 4),
        // A half shell: the cavity opens at the caps.
        (shell, "angle = 180", 2),
        (shell, "angle = 90", 2),
        (pipe, "", 0),
        // A tube with two ends: one handle.
        (pipe, "angle = 120", 0),
        // The circle touches the axis: a ball whose poles meet in one place.
        (horn, "", 2),
        (horn, "angle = 200", 2),
        // Two cones that touch in a point.
        (hourglass, "", 4),
        (hourglass, "angle = 90", 4),
        // Two rings that touch along a circle.
        (pinched, "", 0),
        (pinched, "angle = 30", 4),
    ];
    for (profile, solid, wanted) in cases {
        for chord_error in [0.2, 0.01] {
            let mesh = only(&scene(profile, solid), chord_error);
            assert_eq!(mesh.unmatched_edge(), None, "{profile} {solid}");
            assert_eq!(
                mesh.euler_characteristic(),
                wanted,
                "{profile} {solid} at {chord_error}"
            );
        }
    }
}

#[test]
fn vertices_are_on_the_true_surface_and_no_triangle_is_further_than_the_chord_error() {
    let mut random = uniform(7);
    for (name, scene) in shipped() {
        for part in scene.assembly().parts() {
            let body = part.body();
            let size = part.bounds().longest_side();
            let reach = part
                .bounds()
                .max
                .abs()
                .max(part.bounds().min.abs())
                .max_element();
            let mesh = tessellate(body, 4e-3 * size).expect("a mesh");
            let off = |p: DVec3| body.distance(p, body.contains(p), f64::INFINITY);
            let stride = mesh.vertices().len() / 300 + 1;
            for &v in mesh.vertices().iter().step_by(stride) {
                assert!(
                    off(v) <= 1e-13 * (size + reach),
                    "{name} {}: a vertex is off by {}",
                    part.name(),
                    off(v)
                );
            }
            let triangles: Vec<[DVec3; 3]> = mesh.corners().collect();
            let mut worst = 0.0_f64;
            for _ in 0..600 {
                let k = (random() * triangles.len() as f64) as usize;
                let [a, b, c] = triangles[k];
                let (u, v) = (random(), random());
                let (u, v) = if u + v > 1.0 {
                    (1.0 - u, 1.0 - v)
                } else {
                    (u, v)
                };
                worst = worst.max(off(a + u * (b - a) + v * (c - a)));
            }
            assert!(
                worst <= mesh.chord_error(),
                "{name} {}: {worst} beyond {}",
                part.name(),
                mesh.chord_error()
            );
        }
    }
}

#[test]
fn the_true_surface_is_nowhere_further_from_the_mesh_and_membership_differs_only_there() {
    let mut random = uniform(11);
    for (name, scene) in shipped() {
        for part in scene.assembly().parts() {
            let body = part.body();
            let bounds = part.bounds();
            let size = bounds.longest_side();
            let mesh = tessellate(body, 2e-2 * size).expect("a mesh");
            let tree = MeshTree::new(&mesh);
            let mut near = 0;
            for _ in 0..400 {
                let p = bounds.min
                    + (DVec3::new(random(), random(), random()) * 1.1 - 0.05) * bounds.sides();
                let inside = body.contains(p);
                let exact = body.distance(p, inside, f64::INFINITY);
                // One surface is within the chord error of the other, both ways.
                let found = tree.nearest(p).expect("triangles").distance;
                assert!(
                    (found - exact).abs() <= mesh.chord_error(),
                    "{name} {}: {found} for {exact} at {p}",
                    part.name()
                );
                if exact > mesh.chord_error() {
                    let crossed = tree.crossings(p);
                    assert_eq!(crossed.is_inside(), inside, "{name} {} {p}", part.name());
                    assert_eq!(crossed.signed, i32::from(inside), "{name} {p}");
                } else {
                    near += 1;
                }
            }
            assert!(near < 300, "{name}: the test says nothing");
        }
    }
}

#[test]
fn the_budget_is_used() {
    // A cylinder has no curved profile: the steps take it all. Half of it would be wasteful.
    let rod = scene(
        "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[1, 0], [1, 2]] }]",
        "",
    );
    let mesh = only(&rod, 1e-3);
    let steps = mesh.vertices().len() / 2 - 1;
    let sagitta = |n: usize| 1.0 - (std::f64::consts::PI / n as f64).cos();
    assert!(
        sagitta(steps) <= 1e-3 && sagitta(steps - 1) > 1e-3,
        "{steps} steps"
    );
    assert_eq!(mesh.triangles().len(), 4 * steps);
    // Four times the triangles for a quarter of the error, of a doubly curved surface.
    let ring = scene(
        "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
        "",
    );
    let counts = [1e-3, 2.5e-4].map(|e| only(&ring, e).triangles().len() as f64);
    let ratio = counts[1] / counts[0];
    assert!((3.6..4.4).contains(&ratio), "{counts:?}");
}

#[test]
fn placed_solids_are_turned_scaled_and_moved() {
    let plain = scene(
        "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
        "angle = 77\nstart = 31",
    );
    let placed = scene(
        "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
        "angle = 77\nstart = 31\nplace = [{ scale = 0.5 }, { rotate = { axis = [1, 2, 3], degrees = 40 } }, \
         { translate = [100, -7, 3] }]",
    );
    let (a, b) = (only(&plain, 0.01), only(&placed, 0.005));
    assert_eq!(a.triangles().len(), b.triangles().len());
    assert!((a.volume() / 8.0 / b.volume() - 1.0).abs() < 1e-11);
    let bounds = placed.bounds();
    for &v in b.vertices() {
        assert!(v.cmpge(bounds.min - 1e-12).all() && v.cmple(bounds.max + 1e-12).all());
    }
}

#[test]
fn one_scene_at_any_scale_takes_the_same_triangles() {
    let wanted = only(
        &scene(
            "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
            "angle = 200",
        ),
        0.01,
    );
    for factor in [1e-6, 1e6] {
        let made = scene(
            "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
            &format!("angle = 200\nplace = [{{ scale = {factor:?} }}]"),
        );
        let mesh = only(&made, 0.01 * factor);
        assert_eq!(mesh.triangles(), wanted.triangles());
        assert!((mesh.chord_error() / factor / wanted.chord_error() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn solids_of_one_axis_and_turn_become_one_mesh() {
    let lens =
        Scene::load(format!("{}/scenes/lens.toml", env!("CARGO_MANIFEST_DIR"))).expect("lens");
    assert!(lens.assembly().parts().len() > 1);
    let mesh = only(&lens, 1e-3 * lens.bounds().longest_side());
    assert_eq!(mesh.unmatched_edge(), None);
    assert_eq!(mesh.euler_characteristic(), 2);
    let exact = lens.measures().expect("measures");
    assert!((mesh.volume() - exact.volume).abs() <= 2.0 * exact.area * mesh.chord_error());
}

#[test]
fn chord_errors_that_cannot_be_are_refused() {
    let ring = scene(
        "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
        "",
    );
    let body = ring.assembly().single().expect("one");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(
            matches!(tessellate(body, bad), Err(MeshError::ChordError { .. })),
            "{bad}"
        );
    }
    for bad in [1e-300, 1e-17] {
        assert!(
            matches!(tessellate(body, bad), Err(MeshError::BelowRounding { .. })),
            "{bad}"
        );
    }
    // The count promised is that of the square law from a mesh that can be.
    let made = only(&ring, 1e-5).triangles().len() as f64;
    for fine in [1e-8, 1e-10] {
        let Err(MeshError::TooManyTriangles {
            triangles, limit, ..
        }) = tessellate(body, fine)
        else {
            panic!("{fine} is too fine");
        };
        assert_eq!(limit, MAX_TRIANGLES);
        let wanted = made * 1e-5 / fine;
        assert!(
            (0.5..2.0).contains(&(triangles / wanted)),
            "{triangles} for {wanted}"
        );
    }
    // However coarse, a solid stays one.
    for part in [
        ring,
        scene(
            "curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]",
            "angle = 180",
        ),
    ] {
        let mesh = only(&part, 1e9);
        assert_eq!(mesh.unmatched_edge(), None);
        assert!(mesh.volume() > 1.0);
    }
}

#[test]
fn caps_share_their_edges_with_the_sides_and_lie_in_their_planes() {
    let quarter = scene(
        "loops = [[{ kind = 'circle', center = [3, 0], radius = 1 }], \
         [{ kind = 'circle', center = [3.2, 0.1], radius = 0.4 }], \
         [{ kind = 'circle', center = [3.2, 0.1], radius = 0.2 }]]",
        "angle = 90",
    );
    assert!(matches!(
        quarter.assembly().parts()[0]
            .body()
            .revolved()
            .expect("turned")
            .turn(),
        Turn::Partial(_)
    ));
    let mesh = only(&quarter, 1e-3);
    let area_at = |axis: usize, sign: f64| {
        let flat = |t: &[DVec3; 3]| t.iter().all(|v| v[axis] == 0.0);
        mesh.corners()
            .filter(flat)
            .map(|[a, b, c]| sign * 0.5 * (b - a).cross(c - a)[axis])
            .inspect(|&area| assert!(area > 0.0, "a cap's triangle is turned over"))
            .sum::<f64>()
    };
    let wanted = std::f64::consts::PI * (1.0 - 0.16 + 0.04);
    for (axis, sign) in [(1, -1.0), (0, -1.0)] {
        let found = area_at(axis, sign);
        assert!(
            (found - wanted).abs() < 0.01 * wanted,
            "{found} for {wanted}"
        );
    }
}
