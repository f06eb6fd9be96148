//! Faults found once, each by the name of what happened.

use glam::DVec3;
use voxlathe::grid::GridSpec;
use voxlathe::{Scene, sample};

fn full_turn(curves: &str) -> Scene {
    Scene::parse(&format!(
        "schema = 1\n[profiles.p]\nboundary = 'to-axis'\ncurves = [{curves}]\n[[solid]]\nkind = 'revolve'\n\
         profile = 'p'\n"
    ))
    .expect("scene")
}

/// A spline along r = 3 whose height runs 0 to 6.376, back to 2.469 and on to 8: the solid is a
/// plain cylinder, but near the first fold every one of the three layers was left out.
#[test]
fn a_folded_straight_spline_keeps_its_wall() {
    let scene = full_turn(
        "{ kind = 'nurbs', degree = 3, points = [[3, 0], [3, 7], [3, 1], [3, 2], [3, 8]], \
         weights = [1, 5, 0.1, 7, 2] }",
    );
    let mut worst = (0.0, 0.0);
    for i in 0..=2000 {
        let z = 6.2 + 0.0001 * f64::from(i);
        let error = (scene.assembly().signed_distance(DVec3::new(3.0625, 0.0, z)) - 0.0625).abs();
        if error > worst.0 {
            worst = (error, z);
        }
    }
    assert!(worst.0 <= 8e-12, "off by {:e} at z = {}", worst.0, worst.1);
}

/// A conic with weights 1 : 1e10 : 1 and 1 : 1e12 : 1 hugs its control polygon; its points near the
/// end (1, 2) have parameters within a rounding of 1, and the end itself was taken for the nearest.
#[test]
fn heavy_weights_near_the_end_of_a_curve() {
    let mut failures = String::new();
    for (reverse, w) in [(false, 1e5), (false, 1e6), (true, 1e5), (true, 1e6)] {
        let scene = full_turn(&format!(
            "{{ kind = 'bezier', points = [[1, 0], [2, 1], [1, 2]], weights = [{:?}, {w:?}, {:?}], reverse = {reverse} }}",
            1.0 / w,
            1.0 / w
        ));
        let mut worst = (0.0, 0.0, 0.0, 0.0);
        for i in 0..=700 {
            // From beside the end at height 2 the curve is its leg from (1, 2) to (2, 1), to far
            // within the bound.
            let h = 10_f64.powf(-8.0 + f64::from(i) / 100.0);
            let (found, wanted) = (
                scene
                    .assembly()
                    .signed_distance(DVec3::new(1.0 + 2.0 * h, 0.0, 2.0)),
                std::f64::consts::SQRT_2 * h,
            );
            let error = (found - wanted).abs();
            if error > worst.0 {
                worst = (error, h, found, wanted);
            }
        }
        if worst.0 > 1e-10 * 4.0 {
            failures += &format!("{w:e} {reverse}: error, h, found, wanted: {worst:?}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Two curves that leave the axis along z = 0, one below and one above: the crack between them is
/// 4e-8 wide at r = 1e-4 and 4e-16 at 1e-8, where it was taken as closed.
#[test]
fn a_crack_that_closes_at_the_axis() {
    let scene = full_turn(
        "{ kind = 'bezier', points = [[0, -1], [1, -1], [1, 0], [0, 0]] }, \
         { kind = 'bezier', points = [[0, 0], [0.3, 0], [0.5, 1], [0, 1]] }",
    );
    let mut failures = String::new();
    for r in [1e-9, 1e-8, 3e-8, 1e-7, 1e-6] {
        // The upper side of the crack is at z = 3.7 r^2, below every z used here.
        let z = r / 1024.0;
        let found = scene.assembly().signed_distance(DVec3::new(r, 0.0, z));
        let wanted = -(z - 100.0 / 27.0 * r * r);
        if (found - wanted).abs() > 2e-10 {
            failures += &format!("r = {r:e}: {found:e}, wanted {wanted:e}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// A tube with a wall of 1e-13: ten times as thick as the rounding band, refused for enclosing no
/// area.
#[test]
fn a_wall_of_1e_13_is_a_wall() {
    let scene = Scene::parse(
        "schema = 1\n[profiles.p]\nloops = [[{ kind = 'circle', center = [2, 0], radius = 1 }], \
         [{ kind = 'circle', center = [2, 0], radius = 0.9999999999999 }]]\n[[solid]]\n\
         kind = 'revolve'\nprofile = 'p'\n",
    );
    assert!(scene.is_ok(), "{}", scene.expect_err("refused"));
}

/// A sphere's arcs with one weight of 7e8 each in turn: the radii of a layer were bracketed so widely that voxels well
/// outside had distances below 0.
#[test]
fn heavy_weights_leave_no_sign_to_wide_brackets() {
    for heavy in [1.0, 1e3, 1e6, 1e9, 1e11] {
        for which in 0..5 {
            let mut weights = [1.0, 0.5_f64.sqrt(), 1.0, 0.5_f64.sqrt(), 1.0];
            weights[which] *= heavy;
            let scene = full_turn(&format!(
                "{{ kind = 'nurbs', degree = 2, points = [[0, -10], [10, -10], [10, 0], [10, 10], [0, 10]], \
                 weights = {weights:?}, knots = [0, 0, 0, 0.5, 0.5, 1, 1, 1] }}"
            ));
            let bounds = scene.bounds();
            for n in [5.0, 13.0, 40.0] {
                let spacing = (bounds.max - bounds.min) / n;
                let grid = GridSpec::new([47, 46, 45], bounds.min - spacing * 0.3, spacing);
                let grid = grid.expect("a grid");
                let inside = sample::occupancy(&scene, &grid).expect("a small volume");
                let sdf = sample::signed_distance(&scene, &grid).expect("a small volume");
                let pairs = sdf.data().iter().zip(inside.data());
                let wrong = pairs.filter(|(d, o)| (**d <= 0.0) != (**o == 1)).count();
                assert_eq!(wrong, 0, "weight {which} times {heavy:e}, {n} voxels");
            }
        }
    }
}
