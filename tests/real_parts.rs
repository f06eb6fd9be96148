//! Scenes of real parts against figures known from elsewhere.

use std::f64::consts::PI;

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::math::Aabb;
use voxlathe::sample;

/// What is known of a published part: figures computed independently of this library, from the same f64 control
/// points, weights and knots, in arithmetic of more than 25 digits.
struct Known {
    name: &'static str,
    volume: f64,
    area: f64,
    /// Height of the centroid, which is on the axis.
    height: f64,
    min: DVec3,
    max: DVec3,
}

/// Largest relative error of a figure.
const BOUND: f64 = 1e-13;

/// The parts of a scene, in its order, have the known figures.
fn check(scene: &str, known: &[Known]) {
    let scene = Scene::load(format!("scenes/{scene}.toml")).expect("a shipped scene");
    let parts = scene.assembly().parts();
    assert_eq!(parts.len(), known.len());
    for (part, known) in parts.iter().zip(known) {
        assert_eq!(part.name(), known.name);
        let found = part.measures();
        let Aabb { min, max } = found.bounds.expect("a solid");
        let size = (known.max - known.min).max_element();
        near("volume", found.volume, known.volume, known.volume);
        near("area", found.area, known.area, known.area);
        let (centroid, wanted) = (found.centroid.expect("a solid"), [0.0, 0.0, known.height]);
        for (axis, what) in ["x", "y", "z"].into_iter().enumerate() {
            near(what, centroid[axis], wanted[axis], size);
            near(what, min[axis], known.min[axis], size);
            near(what, max[axis], known.max[axis], size);
        }
    }
}

fn near(what: &str, found: f64, wanted: f64, scale: f64) {
    let error = (found - wanted).abs() / scale;
    eprintln!("{what}: {found} of {wanted}, relative {error:.1e}");
    assert!(error <= BOUND, "{what}: {found} for {wanted}");
}

#[test]
fn teapot() {
    check(
        "teapot",
        &[
            Known {
                name: "body",
                volume: 24.291_178_681_657_66,
                area: 44.562_996_476_233_92,
                height: 1.198_804_953_736_781_3,
                min: DVec3::new(-2.0, -2.0, 0.0),
                max: DVec3::new(2.0, 2.0, 2.498_437_5),
            },
            Known {
                name: "lid",
                volume: 0.845_851_382_031_526_2,
                area: 12.028_715_120_646_414,
                height: 2.543_677_616_886_218,
                min: DVec3::new(-1.3, -1.3, 2.4),
                max: DVec3::new(1.3, 1.3, 3.15),
            },
        ],
    );
}

#[test]
fn vessel_head() {
    check(
        "vessel_head",
        &[Known {
            name: "head",
            volume: 8_451_843.951_357_866,
            area: 2_138_026.708_424_912_7,
            height: 125.913_610_059_811_83,
            min: DVec3::new(-500.0, -500.0, 0.0),
            max: DVec3::new(500.0, 500.0, 221.774_225_170_145_1),
        }],
    );
}

#[test]
fn bell_nozzle() {
    check(
        "bell_nozzle",
        &[Known {
            name: "bell",
            volume: 0.000_817_689_554_485_591,
            area: 0.864_141_503_194_974_3,
            height: 0.250_167_872_530_775_8,
            min: DVec3::new(-0.202, -0.202, -0.053_033_008_588_991_07),
            max: DVec3::new(0.202, 0.202, 0.447_846_096_908_265_4),
        }],
    );
}

/// The last digits of its knots and points are rounded, and the figures are those of the rounded curve.
#[test]
fn tokamak() {
    check(
        "tokamak",
        &[Known {
            name: "plasma",
            volume: 842.029_728_065_173_7,
            area: 682.603_572_769_766,
            height: 5.894_246_346_709_571e-17,
            min: DVec3::new(
                -8.199_999_999_999_998,
                -8.199_999_999_999_998,
                -3.700_000_000_000_001,
            ),
            max: DVec3::new(8.199_999_999_999_998, 8.199_999_999_999_998, 3.7),
        }],
    );
}

/// Parts of one axis, whose volumes have closed forms: see the comments the scenes open with.
#[test]
fn closed_forms() {
    let load = |name: &str| Scene::load(format!("scenes/{name}.toml")).expect("a shipped scene");
    let square = |r: f64| r * r;
    // A ball of radius `ball` reaches this far beyond the circle of radius 12.7 on it.
    let cap = |ball: f64| {
        let h = square(12.7) / (ball + (square(ball) - square(12.7)).sqrt());
        (h, PI * h * h * (ball - h / 3.0))
    };
    let ((front, front_cap), (back, back_cap)) = (cap(60.0), cap(90.0));
    let rings =
        6.0 * (square(2.5) - square(2.3)) + 5.8 * (square(1.5) - square(1.3)) + 5.6 * 0.7 * 0.45;
    for (name, wanted) in [
        (
            "cooling_tower",
            PI * (square(27.0) - square(26.73))
                * (134.4 + (96_f64.powi(3) + 38.4_f64.powi(3)) / (3.0 * square(72.0))),
        ),
        ("nested_rings", 2.0 * PI * PI * 225.0 / 360.0 * rings),
        (
            "lens",
            front_cap + PI * square(12.7) * (6.0 - front - back) + back_cap,
        ),
    ] {
        let found = load(name).exact_volume().expect("one axis").value;
        near(name, found, wanted, wanted);
    }
    let tank = load("two_material_tank");
    let [wall, water] = tank.assembly().parts() else {
        panic!("two parts")
    };
    let (wanted, outside) = (
        PI * square(300.0) * (380.0 + 100.0),
        PI * square(308.0) * (500.0 + 2.0 / 3.0 * 158.0),
    );
    near("water", water.measures().volume, wanted, wanted);
    // Two quarter ellipses, two cylinders and half a torus for the rim.
    let wanted = outside - PI * square(300.0) * (500.0 + 100.0) + PI * PI * 16.0 * 304.0;
    near("wall", wall.measures().volume, wanted, wanted);
    let together = water.measures().volume + wall.measures().volume;
    near(
        "tank",
        tank.exact_volume().expect("one axis").value,
        together,
        together,
    );
}

/// Solids of several axes: the fractions sum to closed forms, though least well where surfaces of
/// different axes touch or nearly do, on the ridges of the bicylinder and between balls and race.
#[test]
fn fractions_of_crossing_parts() {
    let load = |name: &str, resolution: u32| {
        Scene::load_with(
            format!("scenes/{name}.toml"),
            &[format!("grid.resolution={resolution}")],
        )
        .expect("a shipped scene")
    };
    let check = |name: &str, scene: &Scene, wanted: f64, bound: f64| {
        let grid = scene.grid().expect("a grid");
        let fractions = sample::fraction(scene, &grid).expect("small");
        let sum: f64 = fractions.data().iter().map(|&f| f64::from(f)).sum();
        let found = sum * grid.voxel_volume();
        eprintln!(
            "{name}: {found} of {wanted}, relative {:.1e}",
            (found - wanted).abs() / wanted
        );
        assert!(
            (found - wanted).abs() <= bound * wanted,
            "{name}: {found} for {wanted}"
        );
    };
    check("steinmetz", &load("steinmetz", 17), 16.0 / 3.0, 2e-6);
    // The holes cross plate and raised face: each is as long as what it takes away.
    let flange = load("flange", 41);
    let whole = flange.assembly().parts()[0].volume().value;
    let holes = 4.0 * PI * 81.0 * 15.0 + PI * 2.5_f64.powi(2) * 18.0 / 15_f64.to_radians().cos();
    check("flange", &flange, whole - holes, 1e-8);
    // Ring and balls are apart.
    let bearing = load("bearing_outer_ring", 23);
    let sum = bearing
        .assembly()
        .parts()
        .iter()
        .map(|part| part.volume().value)
        .sum();
    check("bearing outer ring", &bearing, sum, 5e-6);
}
