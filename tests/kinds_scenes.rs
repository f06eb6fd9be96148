//! The shipped scenes of ellipsoids, boxes, round shapes and volumes: their volumes by other formulas,
//! and the file that one of them reads.

use std::f64::consts::PI;

use voxlathe::Scene;
use voxlathe::construct::{AngleInterval, AxisFrame, CircleForm, surface_circle};
use voxlathe::exchange::{Format, write_text};
use voxlathe::nurbs::{KnotVector, NurbsSurface, NurbsVolume};

const BOWL: &str = "scenes/volumes/tea_bowl.g2";

/// A point (r, z) of the half-plane.
type Point = [f64; 2];

/// Sections of the bowl, each between two Bézier curves: the first index along them, the second
/// across.
fn sections() -> Vec<[Vec<Point>; 2]> {
    vec![
        [vec![[0.0, 0.5], [1.5, 0.5]], vec![[0.0, 0.8], [1.5, 0.8]]],
        [vec![[1.5, 0.5], [2.0, 0.5]], vec![[1.5, 0.8], [2.0, 0.8]]],
        [vec![[1.5, 0.0], [2.25, 0.0]], vec![[1.5, 0.5], [2.0, 0.5]]],
        [
            vec![[2.0, 0.5], [4.5, 0.625], [5.5, 2.0], [6.0, 5.0]],
            vec![[2.0, 0.8], [4.0, 1.0], [5.125, 2.25], [5.75, 5.0]],
        ],
    ]
}

fn bowl() -> Vec<NurbsVolume> {
    let volume = |section: &[Vec<Point>; 2]| {
        let degree = section[0].len() - 1;
        let knots = [degree, 1].map(|d| KnotVector::bezier(d).expect("a degree"));
        let points: Vec<[f64; 3]> = section
            .iter()
            .flatten()
            .map(|[r, z]| [*r, 0.0, *z])
            .collect();
        let weights = vec![1.0; points.len()];
        let surface = NurbsSurface::new(knots, points, weights).expect("a surface");
        let world = &AxisFrame::WORLD;
        surface_circle(&surface, CircleForm::Quadratic, AngleInterval::FULL, world)
            .expect("a volume")
    };
    sections().iter().map(volume).collect()
}

#[test]
fn the_bowl_s_file_is_what_the_writer_writes() {
    let text = write_text(Format::G2, &bowl()).expect("a text");
    let found = std::fs::read_to_string(BOWL).expect("the file");
    assert!(
        text == found,
        "{BOWL} is not what the construction gives; make it anew"
    );
}

#[test]
#[ignore = "makes the file anew"]
fn make_the_bowl_s_file() {
    let text = write_text(Format::G2, &bowl()).expect("a text");
    std::fs::write(BOWL, text).expect("the file");
}

/// ∫ f over [0, 1] by Gauss's rule of five points on each of n parts.
fn integral(n: usize, f: impl Fn(f64) -> f64) -> f64 {
    let (a, b) = (0.538_469_310_105_683_1, 0.906_179_845_938_664);
    let rule = [
        (0.0, 128.0 / 225.0),
        (-a, 0.478_628_670_499_366_47),
        (a, 0.478_628_670_499_366_47),
        (-b, 0.236_926_885_056_189_08),
        (b, 0.236_926_885_056_189_08),
    ];
    let h = 1.0 / n as f64;
    let part = |k: usize| rule.map(|(x, w)| 0.5 * h * w * f((k as f64 + 0.5 + 0.5 * x) * h));
    (0..n).flat_map(part).sum()
}

/// A rational Bézier combination of values at `t`.
fn bezier(values: &[f64], weights: &[f64], t: f64) -> f64 {
    let mut a: Vec<[f64; 2]> = values
        .iter()
        .zip(weights)
        .map(|(v, w)| [v * w, *w])
        .collect();
    for n in (1..a.len()).rev() {
        for i in 0..n {
            a[i] = [0, 1].map(|k| (1.0 - t) * a[i][k] + t * a[i + 1][k]);
        }
    }
    a[0][0] / a[0][1]
}

/// π ∫ r² dz along a curve, the derivative by central differences of fourth order.
fn turned(r: impl Fn(f64) -> f64, z: impl Fn(f64) -> f64) -> f64 {
    let h = 1e-3;
    let slope =
        |t: f64| (8.0 * (z(t + h) - z(t - h)) - (z(t + 2.0 * h) - z(t - 2.0 * h))) / (12.0 * h);
    PI * integral(40, |t| r(t).powi(2) * slope(t))
}

fn along(points: &[Point], weights: &[f64]) -> f64 {
    let of = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let (r, z) = (of(0), of(1));
    turned(|t| bezier(&r, weights, t), |t| bezier(&z, weights, t))
}

/// What lies between two curves and the segments that join their ends.
fn between([low, high]: &[Vec<Point>; 2]) -> f64 {
    let ones = vec![1.0; low.len()];
    let last = low.len() - 1;
    let side = |k: usize| along(&[low[k], high[k]], &[1.0, 1.0]);
    along(low, &ones) + side(last) - along(high, &ones) - side(0)
}

/// ∭ |det J| of a patch of degrees 2, 1, 2, by differences of its own sums.
fn of_patch(points: &[[f64; 3]], weights: &[f64]) -> f64 {
    let at = |t: [f64; 3]| -> [f64; 3] {
        let square = |x: f64| [(1.0 - x) * (1.0 - x), 2.0 * x * (1.0 - x), x * x];
        let (a, b, c) = (square(t[0]), [1.0 - t[1], t[1]], square(t[2]));
        let mut sum = [0.0; 4];
        for (i, p) in points.iter().enumerate() {
            let w = a[i % 3] * b[i / 3 % 2] * c[i / 6] * weights[i];
            sum[3] += w;
            for k in 0..3 {
                sum[k] += w * p[k];
            }
        }
        [0, 1, 2].map(|k| sum[k] / sum[3])
    };
    let slope = |t: [f64; 3], k: usize| {
        let h = 1e-3;
        let moved = |by: f64| {
            let mut s = t;
            s[k] += by * h;
            at(s)
        };
        let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(moved);
        [0, 1, 2].map(|i| (8.0 * (c[i] - b[i]) - (d[i] - a[i])) / (12.0 * h))
    };
    let det = |t: [f64; 3]| {
        let [a, b, c] = [0, 1, 2].map(|k| slope(t, k));
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    integral(4, |u| integral(4, |v| integral(4, |w| det([u, v, w])))).abs()
}

#[track_caller]
fn check(name: &str, wanted: f64, relative: f64) {
    let scene = Scene::load(format!("scenes/{name}.toml")).expect("a shipped scene");
    let found = scene.exact_volume().expect("a volume").value;
    assert!(
        (found - wanted).abs() <= relative * wanted,
        "{name}: {found}, wanted {wanted}"
    );
}

#[test]
fn volumes_are_those_of_closed_forms() {
    check("ellipsoid", 32.0 / 3.0 * PI, 1e-14);
    check("box", 72_000.0 - 1920.0 * PI - 1040.0 * PI, 1e-12);
    check("volume_cylinder", 12.0 * PI, 1e-14);
    check("volume_torus", 6.0 * PI * PI, 1e-14);
}

/// The largest radius at each height; the cone meets the lamp where g changes sign.
#[test]
fn the_buoy_is_the_outline_of_its_parts() {
    let lamp = |z: f64| (0.09_f64 - (z - 3.1).powi(2)).max(0.0).sqrt();
    let tower = |z: f64| 0.8 - 0.325 * (z - 0.9);
    let (mut low, mut high) = (2.8, 2.9);
    while high - low > 1e-15 {
        let z = 0.5 * (low + high);
        if z <= low || z >= high {
            break;
        }
        *(if tower(z) > lamp(z) {
            &mut low
        } else {
            &mut high
        }) = z;
    }
    let segment = |a: f64, b: f64, r: &dyn Fn(f64) -> f64| {
        turned(|t| r(a + t * (b - a)), |t| a + t * (b - a))
    };
    // The fender, half outside: the half disc about the axis, 2π r̄ A of its moment.
    let fender = PI * PI * 0.04 * 1.2 + 4.0 / 3.0 * PI * 0.008;
    let cap = 3.4 - low;
    let wanted =
        PI * 1.44 * 0.9 + fender + segment(0.9, low, &tower) + PI * cap * cap * (0.3 - cap / 3.0);
    check("buoy", wanted, 1e-12);
}

#[test]
fn the_vase_and_the_bowl_are_their_profiles_turned() {
    // The wall's spline in two Bézier pieces, by hand: a knot of multiplicity three at 1/2.
    let low = [[4.0, 0.0], [7.0, 2.0], [7.5, 5.0], [7.0, 7.75]];
    let high = [[7.0, 7.75], [6.5, 10.5], [5.0, 13.0], [3.0, 16.0]];
    let ones = [1.0; 4];
    let lip = along(&[[2.0, 19.0], [2.0, 20.5], [3.5, 22.0]], &[1.0, 2.0, 1.0]);
    let wall = along(&low, &ones) + along(&high, &ones) + 12.0 * PI + lip;
    check("volume_vase", 0.75 * wall, 1e-10);
    let bowl: f64 = sections().iter().map(|s| between(s).abs()).sum();
    check("tea_bowl", bowl, 1e-10);
}

#[test]
fn the_graded_block_is_the_integral_of_its_determinants() {
    let text = std::fs::read_to_string("scenes/graded_block.toml").expect("a scene");
    let value: toml::Table = text.parse().expect("toml");
    let patches = value["solid"][0]["patches"].as_array().expect("patches");
    let number = |v: &toml::Value| {
        v.as_float()
            .unwrap_or_else(|| v.as_integer().map_or(f64::NAN, |i| i as f64))
    };
    let list = |v: &toml::Value| -> Vec<f64> {
        v.as_array().expect("a list").iter().map(number).collect()
    };
    let volumes = patches.iter().map(|patch| {
        let points: Vec<[f64; 3]> = (patch["points"].as_array().expect("points").iter())
            .map(|p| list(p).try_into().expect("three"))
            .collect();
        of_patch(&points, &list(&patch["weights"]))
    });
    check("graded_block", volumes.sum(), 1e-9);
}
