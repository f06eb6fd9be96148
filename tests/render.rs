//! Pictures: what is seen where, against closed forms; the command `render` and the preview.

#[path = "support/command.rs"]
mod support;

use std::fs;

use support::{below, run, scratch, shipped};
use voxlathe::Scene;
use voxlathe::picture::colour::{diverging, linear, to_oklab};
use voxlathe::picture::{
    Cut, Picture, Plane, RenderOptions, SectionOptions, View, contact_sheet, render, section,
};

const BACKGROUND: [u8; 3] = [247, 247, 248];

/// A ball of radius 2 about (1, -2, 3).
const BALL: &str = r#"
schema = 1
name = "ball"
units = "mm"
[profiles.ball]
boundary = "to-axis"
curves = [{ kind = "arc", center = [0, 0], radius = 2, from = -90, to = 90 }]
[[solid]]
kind = "revolve"
profile = "ball"
place = [{ translate = [1, -2, 3] }]
"#;

/// A ball of which nothing is left.
const NOTHING: &str = r#"
schema = 1
name = "nothing"
[profiles.ball]
boundary = "to-axis"
curves = [{ kind = "arc", center = [0, 0], radius = 2, from = -90, to = 90 }]
[[solid]]
kind = "revolve"
profile = "ball"
[[solid]]
kind = "revolve"
profile = "ball"
operation = "subtract"
"#;

fn scene(text: &str) -> Scene {
    Scene::parse(text).expect("a scene")
}

fn plain(width: usize, height: usize) -> RenderOptions {
    RenderOptions {
        width,
        height,
        annotations: false,
        ..RenderOptions::default()
    }
}

fn shaded(text: &str, options: &RenderOptions) -> Picture {
    render(&scene(text), options, &|| false).expect("a picture")
}

fn sliced(text: &str, options: &SectionOptions) -> Picture {
    section(&scene(text), options, &|| false).expect("a picture")
}

fn slice(plane: &str) -> SectionOptions {
    SectionOptions {
        annotations: false,
        ..SectionOptions::new(Plane::parse(plane).expect("a plane"))
    }
}

fn float(n: usize) -> f64 {
    f64::from(u32::try_from(n).expect("a small number"))
}

#[test]
fn the_middle_of_a_ball_is_lit_and_the_corners_are_background() {
    let picture = shaded(BALL, &plain(120, 90));
    let [r, g, b] = picture.pixel(60, 40);
    // The first material is blue, in light.
    assert!(b > g && g > r && b > 150, "{:?}", [r, g, b]);
    for (x, y) in [(0, 0), (119, 0), (0, 89)] {
        let seen = picture.pixel(x, y);
        assert!(seen.iter().all(|&v| v > 235), "{x}, {y}: {seen:?}");
    }
    // The key light is at the upper left.
    let light = |x, y| u32::from(picture.pixel(x, y)[2]);
    assert!(light(48, 28) > light(76, 58) + 20);
    // The shadow falls to the right and not to the left.
    assert!(picture.pixel(112, 60)[0] + 6 < picture.pixel(7, 60)[0]);
}

/// Where the solid begins and ends in a row, to a part of a pixel, without a floor.
fn silhouette(picture: &Picture, y: usize) -> Option<(f64, f64)> {
    let red = |x: usize| f64::from(linear(picture.pixel(x, y))[0]);
    let ground = f64::from(linear(BACKGROUND)[0]);
    let columns = 0..picture.width();
    let seen: Vec<usize> = columns.filter(|&x| red(x) < ground - 0.02).collect();
    let (first, last) = (*seen.first()?, *seen.last()?);
    // The share of the first pixel that is covered, by the colour of the one behind it.
    let share = |edge: usize, behind: usize| {
        ((ground - red(edge)) / (ground - red(behind))).clamp(0.0, 1.0)
    };
    let left = float(first) + 1.0 - share(first, first + 1);
    let right = float(last) + share(last, last.saturating_sub(1));
    Some((left, right))
}

#[test]
fn the_silhouette_of_a_ball_is_the_circle_within_a_pixel_in_every_row() {
    for (azimuth, elevation) in [(0.0, 0.0), (37.0, -25.0)] {
        let options = RenderOptions {
            view: View::new(azimuth, elevation).expect("a view"),
            ..plain(161, 141)
        };
        let picture = shaded(BALL, &options);
        let rows: Vec<(usize, (f64, f64))> = (0..141)
            .filter_map(|y| Some((y, silhouette(&picture, y)?)))
            .collect();
        let widest = rows.iter().map(|(_, (l, r))| r - l).fold(0.0, f64::max);
        let (radius, middle) = (0.5 * widest, 70.5);
        assert!(radius > 55.0, "the ball is small: {radius}");
        // As many rows as the circle is high.
        assert!(
            (float(rows.len()) - 2.0 * radius).abs() <= 2.0,
            "{}",
            rows.len()
        );
        for &(y, (left, right)) in &rows {
            // Of the row's three edges, the chords of the circle; the shape is between them.
            let chord = |h: f64| (radius * radius - h * h).max(0.0).sqrt();
            let height = (float(y) + 0.5 - middle).abs();
            let (near, far) = (chord((height - 0.5).max(0.0)), chord(height + 0.5));
            for found in [80.5 - left, right - 80.5] {
                assert!(
                    found <= near + 1.0 && found >= far - 1.0,
                    "row {y}: {found}, {near}, {far}"
                );
            }
        }
    }
}

#[test]
fn edges_are_smooth() {
    let options = RenderOptions {
        view: View::new(0.0, 0.0).expect("a view"),
        ..plain(100, 100)
    };
    let picture = shaded(BALL, &options);
    // Along the border of the ball there are tones between it and the background.
    let between = |y: &usize| {
        (1..100).any(|x| {
            let (a, b) = (picture.pixel(x - 1, *y)[0], picture.pixel(x, *y)[0]);
            a == BACKGROUND[0] && b < 240 && b > 140
        })
    };
    let smooth = (20..80).filter(between).count();
    assert!(smooth > 20, "{smooth} rows");
}

#[test]
fn a_cut_shows_a_face_and_a_quarter_shows_two() {
    let front = View::new(-90.0, 0.0).expect("a view");
    let whole = RenderOptions {
        view: front,
        ..plain(100, 100)
    };
    let of = |cut| RenderOptions {
        cut: Some(cut),
        ..whole
    };
    let half = shaded(BALL, &of(Cut::Half));
    // The face is flat: the same few tones everywhere, tint and hatching.
    let tone = |x: usize, y: usize| half.pixel(x, y);
    let face: std::collections::BTreeSet<[u8; 3]> = (30..70)
        .flat_map(|y| (30..70).map(move |x| (x, y)))
        .map(|(x, y)| tone(x, y))
        .collect();
    let brightest = face.iter().map(|p| p[0]).max().expect("pixels");
    let lit = shaded(BALL, &whole);
    assert!(brightest > lit.pixel(50, 50)[0], "{brightest}");
    let tints = |p: &Picture, y: usize| {
        (30..70)
            .filter(|&x| p.pixel(x, y)[0].abs_diff(brightest) < 3)
            .count()
    };
    assert!(tints(&half, 50) > 15, "{}", tints(&half, 50));
    assert!(tints(&lit, 50) == 0);
    let quarter = shaded(BALL, &of(Cut::Quarter));
    assert_ne!(quarter, half);
    assert!(tints(&quarter, 50) > 15);
    // Behind the quarter's edge the ball's own surface is still there at the sides.
    assert_eq!(quarter.pixel(12, 50), lit.pixel(12, 50));
}

/// A slice through the middle of the ball: 101 pixels for sides of 4 and margins of 7 per cent.
fn ball_slice(isolines: Option<f64>) -> (Picture, f64) {
    let options = SectionOptions {
        width: Some(401),
        height: Some(401),
        isolines,
        ..slice("z=3")
    };
    (sliced(BALL, &options), 4.0 * 1.14 / 401.0)
}

/// Darkness along the middle row: luminance of each pixel.
fn middle_row(picture: &Picture) -> Vec<f64> {
    let y = picture.height() / 2;
    let lightness = |x| f64::from(to_oklab(linear(picture.pixel(x, y)))[0]);
    (0..picture.width()).map(lightness).collect()
}

/// Where the row is darker than its surroundings: centres of the dips, in pixels.
fn dips(row: &[f64], from: usize, to: usize, depth: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut x = from;
    while x < to {
        let around = row[x.saturating_sub(5)].min(row[(x + 5).min(row.len() - 1)]);
        if row[x] < around - depth {
            let end = (x..to).find(|&e| row[e] >= around - depth).unwrap_or(to);
            let weight: f64 = (x..end).map(|e| around - row[e]).sum();
            let moment: f64 = (x..end).map(|e| (around - row[e]) * (float(e) + 0.5)).sum();
            found.push(moment / weight);
            x = end;
        }
        x += 1;
    }
    found
}

#[test]
fn the_zero_line_of_a_slice_is_on_the_circle() {
    let (picture, pixel) = ball_slice(Some(100.0));
    let row = middle_row(&picture);
    // Outside of the circle there is no hatching, so its outer border is found there.
    let dark: Vec<usize> = (0..401).filter(|&x| row[x] < 0.4).collect();
    let (first, last) = (dark[0], dark[dark.len() - 1]);
    let half_line = 1.25 * 0.9;
    let wanted = 2.0 / pixel;
    assert!(
        (200.5 - float(first) - wanted).abs() <= half_line + 1.0,
        "{first}"
    );
    assert!(
        (float(last) + 0.5 - 200.5 - wanted).abs() <= half_line + 1.0,
        "{last}"
    );
    // In the middle of the ball and in the corner: negative is blue, positive is orange.
    let [r, _, b] = picture.pixel(200, 203);
    assert!(b > r);
    let [r, _, b] = picture.pixel(2, 2);
    assert!(r > b + 40);
}

#[test]
fn isolines_are_where_the_distance_says() {
    let (with, pixel) = ball_slice(Some(0.1));
    let row = middle_row(&with);
    // From the circle to the left border: 0.28 of the plane, so lines at 0.1 and 0.2.
    let found = dips(&row, 6, 22, 0.02);
    let wanted: Vec<f64> = [0.2, 0.1].map(|d| 200.5 - (2.0 + d) / pixel).into();
    assert_eq!(found.len(), 2, "{found:?}, not {wanted:?}");
    for (f, w) in found.iter().zip(&wanted) {
        assert!((f - w).abs() < 0.5, "{found:?}, not {wanted:?}");
    }
    let (without, _) = ball_slice(Some(100.0));
    assert!(dips(&middle_row(&without), 6, 22, 0.02).is_empty());
}

#[test]
fn where_the_plane_runs_along_a_face_its_inside_is_filled() {
    let disc = r#"
        schema = 1
        [profiles.disc]
        boundary = "to-axis"
        curves = [{ kind = "polyline", points = [[0, 0], [2, 0], [2, 1], [0, 1]] }]
        [[solid]]
        kind = "revolve"
        profile = "disc"
    "#;
    let at = |plane: &str| {
        let options = SectionOptions {
            width: Some(200),
            height: Some(200),
            ..slice(plane)
        };
        sliced(disc, &options)
    };
    let (face, middle) = (at("z=0"), at("z=0.5"));
    // Tint and hatching, no black: the zero line is not smeared over the face.
    for (x, y) in [(60, 90), (110, 70), (130, 120)] {
        let (a, b) = (face.pixel(x, y), middle.pixel(x, y));
        assert!(a[2] > 90, "{a:?}");
        assert!(a[0] < 235 && b[0] < 235, "{a:?} {b:?}");
    }
    // Beside the solid there is no hatching, and all is on the positive side.
    let [r, _, b] = at("z=1.2").pixel(100, 60);
    assert!(r > b && r > 200, "{r} {b}");
}

#[test]
fn the_colours_of_distances_are_even_and_far_apart_at_the_ends() {
    let (low, high) = (to_oklab(diverging(-1.0)), to_oklab(diverging(1.0)));
    assert!((low[0] - high[0]).abs() < 1e-4);
    let apart = (low[1] - high[1]).hypot(low[2] - high[2]);
    assert!(apart > 0.2, "{apart}");
}

#[test]
fn materials_have_their_own_colours() {
    let two = r#"
        schema = 1
        [materials]
        1 = "core"
        2 = "shell"
        [profiles.ball]
        boundary = "to-axis"
        curves = [{ kind = "arc", center = [0, 0], radius = 2, from = -90, to = 90 }]
        [[solid]]
        kind = "revolve"
        profile = "ball"
        [[solid]]
        kind = "revolve"
        profile = "ball"
        material = 2
        place = [{ translate = [6, 0, 0] }]
    "#;
    let options = RenderOptions {
        view: View::new(-90.0, 0.0).expect("a view"),
        ..plain(200, 100)
    };
    let picture = shaded(two, &options);
    let ([r, _, b], [s, _, c]) = (picture.pixel(45, 50), picture.pixel(155, 50));
    assert!(b > r + 40, "blue: {:?}", picture.pixel(45, 50));
    assert!(s > c + 40, "red: {:?}", picture.pixel(155, 50));
    let cut = sliced(
        two,
        &SectionOptions {
            width: Some(200),
            ..slice("y=0")
        },
    );
    let mean = |low: usize, high: usize, channel: usize| {
        let mid = cut.height() / 2;
        (low..high)
            .map(|x| u32::from(cut.pixel(x, mid)[channel]))
            .sum::<u32>()
    };
    // Under the blue of the depth, the tint and the hatching of the second are red.
    let red = |low, high| i64::from(mean(low, high, 0)) - i64::from(mean(low, high, 2));
    assert!(
        red(140, 180) > red(20, 60) + 40 * 15,
        "{} {}",
        red(140, 180),
        red(20, 60)
    );
}

#[test]
fn an_empty_composite_is_a_picture_of_the_background() {
    let picture = shaded(NOTHING, &plain(64, 48));
    assert!(picture.rgb().chunks(3).all(|p| p == BACKGROUND));
    let cut = sliced(
        NOTHING,
        &SectionOptions {
            width: Some(64),
            ..slice("z=0")
        },
    );
    assert!(cut.width() == 64 && cut.pixel(20, 20)[0] > 200);
    let dir = scratch();
    let (source, file) = (below(&dir, "nothing.toml"), below(&dir, "nothing.png"));
    fs::write(&source, NOTHING).expect("a scene is written");
    let done = run(&[
        "render", &source, "-o", &file, "--width", "64", "--height", "48",
    ])
    .exits(0);
    assert!(
        done.err.contains("nothing is left of the solids"),
        "{}",
        done.err
    );
}

#[test]
fn small_pictures_and_single_pixels_are_possible() {
    for (w, h) in [(1, 1), (1, 40), (33, 2), (65, 31)] {
        assert_eq!(shaded(BALL, &plain(w, h)).rgb().len(), 3 * w * h);
        let options = SectionOptions {
            width: Some(w),
            height: Some(h),
            annotations: true,
            ..slice("x=1")
        };
        assert_eq!(sliced(BALL, &options).rgb().len(), 3 * w * h);
    }
}

#[test]
fn annotations_are_drawn_where_there_is_room() {
    let with = RenderOptions {
        annotations: true,
        ..plain(400, 300)
    };
    let (a, b) = (shaded(BALL, &with), shaded(BALL, &plain(400, 300)));
    let drawn = |columns: std::ops::Range<usize>| {
        let places = (250..300).flat_map(|y| columns.clone().map(move |x| (x, y)));
        let blue = |p: &Picture, x, y| p.pixel(x, y)[2];
        places
            .filter(|&(x, y)| blue(&a, x, y).saturating_add(60) < blue(&b, x, y))
            .count()
    };
    assert!(drawn(320..400) > 40, "no scale bar: {}", drawn(320..400));
    assert!(drawn(0..60) > 20, "no axes: {}", drawn(0..60));
}

#[test]
fn a_cancelled_picture_is_none() {
    let s = scene(BALL);
    assert!(matches!(
        render(&s, &plain(64, 64), &|| true),
        Err(voxlathe::Error::Interrupted)
    ));
    assert!(matches!(
        section(&s, &slice("z=0"), &|| true),
        Err(voxlathe::Error::Interrupted)
    ));
    let grid = s.grid().expect("a grid");
    assert!(matches!(
        contact_sheet(&s, &grid, &|| true),
        Err(voxlathe::Error::Interrupted)
    ));
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let dir = scratch();
    let scene = shipped("overlap");
    for (kind, flags) in [
        (
            "shaded",
            vec!["--cut", "quarter", "--width", "320", "--height", "240"],
        ),
        ("slice", vec!["--slice", "y=0", "--width", "420"]),
    ] {
        let bytes: Vec<Vec<u8>> = ["1", "2", "3"]
            .iter()
            .map(|threads| {
                let file = below(&dir, &format!("{kind}-{threads}.png"));
                let mut all = vec!["render", &scene, "-o", &file, "--threads", threads];
                all.extend(&flags);
                run(&all).exits(0);
                fs::read(&file).expect("a picture")
            })
            .collect();
        assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2], "{kind}");
    }
}

#[test]
fn the_document_says_what_was_drawn() {
    let dir = scratch();
    let file = below(&dir, "torus.PNG");
    let scene = shipped("torus");
    let done = run(&[
        "render", &scene, "-o", &file, "--width", "80", "--height", "60", "--view", "-30,45",
        "--cut", "half", "--json",
    ])
    .exits(0);
    let d = done.json();
    assert_eq!(d["file"], file.as_str());
    assert_eq!((&d["width"], &d["height"]), (&80.into(), &60.into()));
    assert_eq!(d["kind"], "shaded");
    assert_eq!(d["cut"], "half");
    assert_eq!(d["view"], serde_json::json!([-30.0, 45.0]));
    assert_eq!(d["slice"], serde_json::Value::Null);
    let bytes = fs::read(&file).expect("a picture");
    assert_eq!(d["bytes"], bytes.len());
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
    let done = run(&[
        "render",
        &scene,
        "-o",
        &file,
        "--width",
        "80",
        "--slice",
        "z=0.1",
        "--isolines",
        "0.2",
        "--json",
    ])
    .exits(0);
    let d = done.json();
    assert_eq!(d["kind"], "slice");
    assert_eq!(d["slice"], serde_json::json!({ "axis": "z", "value": 0.1 }));
    assert_eq!(d["isolines"], 0.2);
    // Nothing else is left in the directory.
    assert_eq!(fs::read_dir(dir.path()).expect("a directory").count(), 1);
}

#[test]
fn bad_input_is_refused_before_anything_is_written() {
    let dir = scratch();
    let (file, jpg) = (below(&dir, "p.png"), below(&dir, "p.jpg"));
    let scene = shipped("torus");
    let base = ["render", &scene, "-o", &file];
    for (flags, wanted) in [
        (
            vec!["--width", "0"],
            "width 0 is not between 1 and 16384 pixels",
        ),
        (
            vec!["--height", "16385"],
            "height 16385 is not between 1 and 16384 pixels",
        ),
        (
            vec!["--width", "16384", "--height", "16384"],
            "a picture of 16384 x 16384 pixels",
        ),
        (vec!["--width", "-3"], "-3"),
        (
            vec!["--view", "30"],
            "--view: [30.0] is not an azimuth and an elevation",
        ),
        (
            vec!["--view", "30,91"],
            "--view: elevation 91 is not a number of degrees between -90 and 90",
        ),
        (vec!["--view", "NaN,0"], "--view: azimuth NaN"),
        (vec!["--cut", "third"], "third"),
        (vec!["--slice", "w=3"], "--slice: \"w=3\" is not a plane"),
        (vec!["--slice", "z"], "--slice: \"z\" is not a plane"),
        (vec!["--slice", "z=1e99"], "the plane z = "),
        (vec!["--slice", "z=nan"], "the plane z = NaN"),
        (
            vec!["--slice", "z=0", "--cut", "half"],
            "cannot be used with",
        ),
        (vec!["--isolines", "1"], "--slice"),
        (
            vec!["--slice", "z=0", "--isolines", "0"],
            "isolines every 0 cannot be drawn",
        ),
        (
            vec!["--slice", "z=0", "--isolines", "-1"],
            "isolines every -1 cannot be drawn",
        ),
        (
            vec!["--slice", "z=0", "--isolines", "1e-9"],
            "is a good step",
        ),
    ] {
        let all: Vec<&str> = base.iter().copied().chain(flags.iter().copied()).collect();
        let done = run(&all).exits(2);
        assert!(done.err.contains(wanted), "{flags:?}: {}", done.err);
    }
    let done = run(&["render", &scene, "-o", &jpg]).exits(2);
    assert!(
        done.err
            .contains("p.jpg: cannot tell the format from the name; it must end in .png"),
        "{}",
        done.err
    );
    let missing = below(&dir, "no/such/p.png");
    run(&[
        "render", &scene, "-o", &missing, "--width", "8", "--height", "8",
    ])
    .exits(3);
    run(&["render", &below(&dir, "none.toml"), "-o", &file]).exits(3);
    assert_eq!(fs::read_dir(dir.path()).expect("a directory").count(), 0);
    let done = run(&[
        "render", &scene, "-o", &file, "--slice", "z=9", "--width", "40",
    ])
    .exits(0);
    assert!(
        done.err
            .contains("the plane misses the solids, which have z from"),
        "{}",
        done.err
    );
}

#[test]
fn previews_belong_to_the_stack() {
    let dir = scratch();
    let out = below(&dir, "out");
    let scene = shipped("torus");
    let args = [
        "voxelize",
        &scene,
        "-o",
        &out,
        "--resolution",
        "12",
        "--json",
    ];
    let with: Vec<&str> = args.iter().copied().chain(["--preview"]).collect();
    let first = run(&with).exits(0).json();
    let files: Vec<&str> = first["files"]
        .as_array()
        .expect("files")
        .iter()
        .filter_map(|f| f.as_str())
        .collect();
    assert_eq!(
        files[files.len() - 2..],
        ["preview-slices.png", "preview.png"]
    );
    let preview = |name: &str| dir.path().join("out").join(name);
    for name in ["preview.png", "preview-slices.png"] {
        let bytes = fs::read(preview(name)).expect("a preview");
        assert_eq!(bytes[..4], *b"\x89PNG");
    }
    let info = run(&["info", &out, "--json"]).exits(0).json();
    assert_eq!(
        (&info["ok"], &info["extra"]),
        (&true.into(), &serde_json::json!([]))
    );
    // An altered preview is found as any altered file is.
    let good = fs::read(preview("preview.png")).expect("a preview");
    fs::write(preview("preview.png"), b"other").expect("a file is written");
    let info = run(&["info", &out, "--json"]).exits(1).json();
    assert_eq!(info["altered"], serde_json::json!(["preview.png"]));
    // An edited file is not replaced. Moved away, the same again gives the same; without the flag both are gone.
    let again: Vec<&str> = with.iter().copied().chain(["--force"]).collect();
    run(&again).exits(2);
    fs::remove_file(preview("preview.png")).expect("the edited file is moved away");
    run(&again).exits(0);
    assert_eq!(fs::read(preview("preview.png")).expect("a preview"), good);
    let without: Vec<&str> = args.iter().copied().chain(["--force"]).collect();
    run(&without).exits(0);
    assert!(!preview("preview.png").exists() && !preview("preview-slices.png").exists());
    run(&["info", &out]).exits(0);
}

#[test]
fn a_contact_sheet_shows_nine_layers_or_all() {
    let s = scene(BALL);
    let grid = s.grid().expect("a grid");
    let sheet = contact_sheet(&s, &grid, &|| false).expect("a sheet");
    // Three rows of three: the middle one has the ball in its middle, the material's blue.
    let (w, h) = (sheet.width(), sheet.height());
    assert!(w > 900 && h > 900, "{w} x {h}");
    let [r, _, b] = sheet.pixel(w / 2, h / 2 - 10);
    assert!(b > r + 60);
    let mut flat = scene(BALL);
    flat.model_mut().0.step = voxlathe::scene::GridStep::Resolutions([20, 20, 1]);
    flat.model_mut().0.padding = 0;
    let one = contact_sheet(&flat, &flat.grid().expect("a grid"), &|| false).expect("a sheet");
    assert!(
        one.width() < 400 && one.height() < 420,
        "{} x {}",
        one.width(),
        one.height()
    );
}
