//! Scenes of published parts against their exact figures.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::math::Aabb;

/// What is known of a part: figures computed independently of this library, from the same f64 control
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
                volume: 24.291_178_681_657_657,
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
