//! Parameter lines in pictures: where they must be, and none where they are hidden, cut away or gone.

#[path = "support/command.rs"]
mod support;

use std::fs;

use support::{below, run, scratch};
use voxlathe::Scene;
use voxlathe::picture::colour::linear;
use voxlathe::picture::{Cut, MAX_LINES, Picture, RenderOptions, View, render};

/// Construction a: a cylinder of radius 1 and height 2, seams at 0, 90, 180 and 270 degrees.
const CYLINDER: &str = r#"
schema = 1
[profiles.wall]
boundary = "to-axis"
curves = [{ kind = "polyline", points = [[1, 0], [1, 2]] }]
[[solid]]
kind = "volume"
construct = "curve-disc"
profile = "wall"
"#;

/// Construction b: a torus of radii 3 and 1, its section's corners at 45 degrees and so on.
const TORUS: &str = r#"
schema = 1
[[solid]]
kind = "volume"
construct = "surface-circle"
[solid.section]
degrees = [2, 2]
knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1]]
points = [
  [2.292893218813452, -0.7071067811865476], [1.585786437626905, 0], [2.292893218813452, 0.7071067811865476],
  [3, -1.414213562373095], [3, 0], [3, 1.414213562373095],
  [3.707106781186548, -0.7071067811865476], [4.414213562373095, 0], [3.707106781186548, 0.7071067811865476]]
weights = [1, 0.7071067811865476, 1, 0.7071067811865476, 1, 0.7071067811865476, 1, 0.7071067811865476, 1]
"#;

/// Large enough to tell lines from each other.
const SMALL: [usize; 2] = [120, 90];

fn float(n: usize) -> f64 {
    f64::from(u32::try_from(n).expect("a small number"))
}

/// A picture with lines, less the one without.
struct Ink {
    with: Picture,
    without: Picture,
    /// First and last column and row of the solid, as edges of pixels.
    low: [f64; 2],
    high: [f64; 2],
}

impl Ink {
    fn new(text: &str, view: [f64; 2], cut: Option<Cut>, lines: usize, size: [usize; 2]) -> Self {
        let scene = Scene::parse(text).expect("a scene");
        let of = |lines| {
            let options = RenderOptions {
                width: size[0],
                height: size[1],
                view: View::new(view[0], view[1]).expect("a view"),
                cut,
                annotations: false,
                lines,
            };
            render(&scene, &options, &|| false).expect("a picture")
        };
        let (with, without) = (of(lines), of(0));
        // The solid is blue, floor and background are grey.
        let solid = |x: usize, y: usize| {
            let [r, _, b] = without.pixel(x, y);
            b > r.saturating_add(12)
        };
        let xs = (0..size[0]).filter(|&x| (0..size[1]).any(|y| solid(x, y)));
        let ys = (0..size[1]).filter(|&y| (0..size[0]).any(|x| solid(x, y)));
        let ends = |found: Vec<usize>| {
            let (first, last) = (
                found.first().expect("a solid"),
                found.last().expect("a solid"),
            );
            [float(*first), float(*last) + 1.0]
        };
        let (x, y) = (ends(xs.collect()), ends(ys.collect()));
        Self {
            with,
            without,
            low: [x[0], y[0]],
            high: [x[1], y[1]],
        }
    }

    /// The light that lines take from a pixel, as a share.
    fn at(&self, x: usize, y: usize) -> f64 {
        let light = |p: &Picture| {
            linear(p.pixel(x, y))
                .iter()
                .map(|&v| f64::from(v))
                .sum::<f64>()
        };
        1.0 - light(&self.with) / light(&self.without)
    }

    /// The most of the nine pixels around a place.
    fn near(&self, [x, y]: [f64; 2]) -> f64 {
        let columns = 0..self.with.width();
        let rows = 0..self.with.height();
        let mut most = 0.0_f64;
        for j in rows {
            for i in columns.clone() {
                if (float(i) + 0.5 - x).abs() <= 1.5 && (float(j) + 0.5 - y).abs() <= 1.5 {
                    most = most.max(self.at(i, j));
                }
            }
        }
        most
    }
}

/// Columns or rows where there is ink, as the middles of runs with all that they have.
fn runs(ink: &[f64]) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    let mut sums = [0.0, 0.0];
    for (i, &v) in ink.iter().chain(&[0.0]).enumerate() {
        // Dithering changes pixels by one of 255.
        if v > 0.04 {
            sums = [sums[0] + v, sums[1] + v * (float(i) + 0.5)];
        } else if sums[0] > 0.0 {
            found.push((sums[1] / sums[0], sums[0]));
            sums = [0.0, 0.0];
        }
    }
    found
}

#[test]
fn the_lines_of_a_cylinder_are_where_arithmetic_has_them() {
    let size = SMALL;
    let ink = Ink::new(CYLINDER, [0.0, 0.0], None, 1, size);
    let radius = 0.5 * (ink.high[0] - ink.low[0]);
    let middle = 0.5 * (ink.high[0] + ink.low[0]);
    assert!(radius > 35.0, "{radius}");
    // The camera is on +x: the seam at 0 degrees, the middles of two arcs at 45, the seams at 90.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let wanted = [-1.0, -half, 0.0, half, 1.0].map(|s| middle + s * radius);
    let heights = [0.25, 0.75].map(|s| ink.low[1] + s * (ink.high[1] - ink.low[1]));
    let mut seams = Vec::new();
    for height in heights {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a row"
        )]
        let y = height as usize;
        let row: Vec<f64> = (0..size[0]).map(|x| ink.at(x, y)).collect();
        let found = runs(&row);
        assert_eq!(found.len(), 5, "{found:?}, {wanted:?}");
        for ((at, _), wanted) in found.iter().zip(wanted) {
            assert!((at - wanted).abs() < 1.0, "{found:?}, {wanted}");
        }
        // Seams are stronger than what is between them.
        assert!(
            found[2].1 > 1.5 * found[1].1 && found[2].1 > 1.5 * found[3].1,
            "{found:?}"
        );
        seams.push(found[2].1);
    }
    assert!((seams[0] / seams[1] - 1.0).abs() < 0.1, "{seams:?}");
    // In a column between them: the upper rim, the line at half the height, the lower rim.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a column"
    )]
    let x = (middle + 0.35 * radius) as usize;
    let column: Vec<f64> = (0..size[1]).map(|y| ink.at(x, y)).collect();
    let found = runs(&column);
    let wanted = [0.0, 0.5, 1.0].map(|s| ink.low[1] + s * (ink.high[1] - ink.low[1]));
    assert_eq!(found.len(), 3, "{found:?}");
    for ((at, _), wanted) in found.iter().zip(wanted) {
        assert!((at - wanted).abs() < 1.0, "{found:?}, {wanted}");
    }
}

/// Where a point (angle in degrees, height) of the cylinder's wall is in a picture from azimuth 0.
fn place(ink: &Ink, elevation: f64, angle: f64, z: f64) -> [f64; 2] {
    let scale = 0.5 * (ink.high[0] - ink.low[0]);
    let middle = 0.5 * (ink.high[0] + ink.low[0]);
    let (se, ce) = elevation.to_radians().sin_cos();
    let (y, x) = angle.to_radians().sin_cos();
    // The top of the picture of the solid is the far end of the upper rim.
    let top = se + 2.0 * ce;
    [
        middle + scale * y,
        ink.low[1] + scale * (top - (ce * z - se * x)),
    ]
}

/// The cylinder from azimuth 0 and elevation 20.
fn tilted(cut: Option<Cut>, more: &str) -> Ink {
    Ink::new(&format!("{CYLINDER}{more}"), [0.0, 20.0], cut, 1, SMALL)
}

#[test]
fn what_is_hidden_or_subtracted_has_no_lines() {
    let whole = tilted(None, "");
    let at = |angle, z| place(&whole, 20.0, angle, z);
    let seen = [
        (20.0, 0.0),
        (-20.0, 0.0),
        (20.0, 1.0),
        (45.0, 0.5),
        (20.0, 2.0),
        (160.0, 2.0),
        (-160.0, 2.0),
    ];
    for (angle, z) in seen {
        let found = whole.near(at(angle, z));
        assert!(found > 0.12, "{angle}, {z}: {found}");
    }
    for (angle, z) in [(160.0, 0.0), (-160.0, 0.0), (160.0, 1.0), (-160.0, 1.0)] {
        let found = whole.near(at(angle, z));
        assert!(found < 0.04, "{angle}, {z}: {found}");
    }
    let less = tilted(
        None,
        r#"
[[solid]]
kind = "box"
size = [2, 2, 2]
operation = "subtract"
place = [{ translate = [1, 1, 2.2] }]
"#,
    );
    assert_eq!((whole.low, whole.high), (less.low, less.high));
    for (angle, z) in [(60.0, 2.0), (35.0, 2.0), (45.0, 1.6)] {
        assert!(whole.near(at(angle, z)) > 0.12, "{angle}, {z}");
        let found = less.near(at(angle, z));
        assert!(found < 0.04, "{angle}, {z}: {found}");
    }
    for (angle, z) in [(-60.0, 2.0), (-160.0, 2.0), (20.0, 1.0), (45.0, 0.5)] {
        let found = less.near(at(angle, z));
        assert!(found > 0.12, "{angle}, {z}: {found}");
    }
}

#[test]
fn what_a_cut_opens_has_no_lines() {
    let half = tilted(Some(Cut::Half), "");
    let (mut on_section, mut on_top) = (0.0_f64, 0.0_f64);
    for y in 0..SMALL[1] {
        for x in 0..SMALL[0] {
            // The section is a rectangle of the full width; what is left of the upper disc is above.
            let share = (float(y) - half.low[1]) / (half.high[1] - half.low[1]);
            let inner = float(x) > half.low[0] + 3.0 && float(x) < half.high[0] - 3.0;
            if inner && share > 0.25 && share < 0.95 {
                on_section = on_section.max(half.at(x, y));
            } else if inner && share < 0.1 {
                on_top = on_top.max(half.at(x, y));
            }
        }
    }
    assert!(on_section < 0.04 && on_top > 0.12, "{on_section}, {on_top}");
}

#[test]
fn the_lines_of_a_torus_are_circles_and_meridians() {
    let ink = Ink::new(TORUS, [-90.0, 90.0], None, 1, [90, 90]);
    let scale = (ink.high[0] - ink.low[0]) / 8.0;
    let middle = [0, 1].map(|a| 0.5 * (ink.high[a] + ink.low[a]));
    let at = |radius: f64, angle: f64| {
        let (s, c) = angle.to_radians().sin_cos();
        [
            middle[0] + scale * radius * c,
            middle[1] - scale * radius * s,
        ]
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for angle in [20.0, 110.0, 200.0, 290.0] {
        for radius in [3.0 - half, 3.0, 3.0 + half] {
            let found = ink.near(at(radius, angle));
            assert!(found > 0.12, "{radius}, {angle}: {found}");
        }
        for radius in [2.65, 3.35] {
            let found = ink.near(at(radius, angle));
            assert!(found < 0.04, "{radius}, {angle}: {found}");
        }
    }
    for angle in [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0] {
        let found = ink.near(at(3.35, angle));
        assert!(found > 0.12, "{angle}: {found}");
    }
}

#[test]
fn other_solids_have_no_lines_and_impossible_numbers_are_refused() {
    let ball = "schema = 1\n[[solid]]\nkind = \"sphere\"\nradius = 1\n";
    let ink = Ink::new(ball, [0.0, 20.0], None, 9, [60, 45]);
    assert_eq!(ink.with.rgb(), ink.without.rgb());
    let scene = Scene::parse(ball).expect("a scene");
    let options = RenderOptions {
        lines: MAX_LINES + 1,
        ..RenderOptions::default()
    };
    assert!(render(&scene, &options, &|| false).is_err());

    let folder = scratch();
    let (from, to) = (below(&folder, "ball.toml"), below(&folder, "ball.png"));
    fs::write(&from, ball).expect("a scene");
    let small = [
        "render", &from, "-o", &to, "--width", "40", "--height", "30", "--json",
    ];
    let with = |more: &[&str]| run(&[&small[..], more].concat());
    assert_eq!(with(&["--lines", "7"]).exits(0).json()["lines"], 7);
    assert_eq!(with(&[]).exits(0).json()["lines"], 4);
    with(&["--lines", "300"]).exits(2);
    with(&["--lines", "2", "--slice", "y=0"]).exits(2);
}
