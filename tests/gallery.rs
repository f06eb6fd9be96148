//! The README's gallery: a picture and figures of every shipped scene, made by the library itself.
//!
//! `cargo test --release --locked --test gallery -- --ignored` makes them anew, with
//! `VOXLATHE_SCENES=torus,vase` those of some scenes alone.

use std::fs;

use voxlathe::Scene;
use voxlathe::converge::{Plan, study};
use voxlathe::picture::{Cut, Plane, RenderOptions, SectionOptions, render, section};
use voxlathe::sample;
use voxlathe::validate::{Points, meshes, validate};

const README: &str = "README.md";
const PICTURES: &str = "scenes/pictures";
const BEGIN: &str = "<!-- gallery: cargo test --release --locked --test gallery -- --ignored -->\n";
const END: &str = "<!-- end of the gallery -->\n";
/// Size of a scene's picture.
const SIZE: [usize; 2] = [480, 360];
/// Voxels along the longest side for the figures.
const RESOLUTION: u32 = 128;
/// Scenes that have more to show inside than outside.
const CUT: &[&str] = &[
    "bell_nozzle",
    "cooling_tower",
    "lens",
    "nozzle",
    "oring_hub",
    "rings",
    "teapot",
    "tokamak",
    "two_material_tank",
    "vessel_head",
];

fn scenes() -> Vec<String> {
    let entries = fs::read_dir("scenes").expect("the scenes");
    let mut names: Vec<String> = entries
        .filter_map(|e| {
            let path = e.expect("an entry").path();
            let toml = path.extension().is_some_and(|e| e == "toml");
            toml.then(|| {
                path.file_stem()
                    .expect("a name")
                    .to_str()
                    .expect("text")
                    .to_owned()
            })
        })
        .collect();
    names.sort();
    names
}

/// What the scene's first sentence says it shows.
fn shows(name: &str) -> String {
    let text = fs::read_to_string(format!("scenes/{name}.toml")).expect("a scene");
    let comment: Vec<&str> = text
        .lines()
        .take_while(|l| l.starts_with('#'))
        .map(|l| l.trim_start_matches('#').trim())
        .collect();
    let comment = comment.join(" ");
    let end = comment.find(". ").unwrap_or(comment.len());
    comment[..end].to_owned()
}

/// The gallery's part of the README.
fn gallery(readme: &str) -> &str {
    let from = readme.find(BEGIN).expect("the gallery begins") + BEGIN.len();
    let to = readme.find(END).expect("the gallery ends");
    &readme[from..to]
}

/// Width and height of a PNG file.
fn size(path: &str) -> [usize; 2] {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{path}");
    [16, 20]
        .map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize)
}

#[test]
fn every_scene_has_its_row_and_its_picture() {
    let readme = fs::read_to_string(README).expect("the README");
    let rows: Vec<&str> = gallery(&readme)
        .lines()
        .filter(|l| l.starts_with("| !["))
        .collect();
    let scenes = scenes();
    assert_eq!(rows.len(), scenes.len());
    for (row, name) in rows.iter().zip(&scenes) {
        let picture = format!("{PICTURES}/{name}.png");
        assert!(row.contains(&format!("({picture})")), "{name}: {row}");
        assert!(row.contains(&format!("`{name}.toml`")), "{name}: {row}");
        assert!(row.contains(&shows(name)), "{name}: {row}");
        assert!(row.contains(" 0 unexplained"), "{name}: {row}");
        assert_eq!(size(&picture), SIZE, "{picture}");
        // The exact volume is what the scene says today.
        let scene = Scene::load(format!("scenes/{name}.toml")).expect("a shipped scene");
        let volume = exact_volume(&scene);
        assert!(row.contains(&volume), "{name}: {volume} is not in {row}");
    }
    for name in ["torus", "cylinder"] {
        assert!(size(&format!("{PICTURES}/converge-{name}.png"))[0] > 1000);
    }
}

fn exact_volume(scene: &Scene) -> String {
    let volume = scene.exact_volume().expect("a volume").value;
    // As many digits as every machine agrees on.
    format!("{volume:.9e} {}³", scene.model().units.name())
}

fn write(name: &str, picture: &voxlathe::picture::Picture) {
    let path = format!("{PICTURES}/{name}.png");
    fs::write(&path, picture.to_png().expect("a picture")).expect("a file");
}

fn row(name: &str) -> String {
    let sets = [format!("grid.resolution={RESOLUTION}")];
    let scene = Scene::load_with(format!("scenes/{name}.toml"), &sets).expect("a shipped scene");
    let options = RenderOptions {
        width: SIZE[0],
        height: SIZE[1],
        cut: CUT.contains(&name).then_some(Cut::Quarter),
        ..RenderOptions::default()
    };
    write(
        name,
        &render(&scene, &options, &|| false).expect("a picture"),
    );
    let grid = scene.grid().expect("a grid");
    let fractions = sample::fraction(&scene, &grid).expect("a volume");
    let sum: f64 = fractions.data().iter().map(|&f| f64::from(f)).sum();
    let exact = scene.exact_volume().expect("a volume").value;
    let error = (sum * grid.voxel_volume() - exact).abs() / exact;
    let meshes = meshes(&scene, 0.1 * grid.spacing().min_element()).expect("meshes");
    let report =
        validate(&scene, &grid, &meshes, Points::Grid, &|| Ok(()), &|_| {}).expect("it runs");
    assert!(report.is_ok(), "{name}: {report:#?}");
    format!(
        "| ![{name}]({PICTURES}/{name}.png) | `{name}.toml`: {} | {} | {error:.0e} | {} points, {} within the chord error, {} unexplained |\n",
        shows(name),
        exact_volume(&scene),
        report.samples,
        report.within_chord_error,
        report.disagree,
    )
}

#[test]
#[ignore = "minutes long: makes the pictures and the README's gallery anew"]
fn make_the_gallery() {
    fs::create_dir_all(PICTURES).expect("a directory");
    let only = std::env::var("VOXLATHE_SCENES").ok();
    let chosen = |name: &str| {
        only.as_ref()
            .is_none_or(|o| o.split(',').any(|n| n == name))
    };
    let old = fs::read_to_string(README).expect("the README");
    let mut table =
        "\n| | scene | exact volume | by fractions, off by | `validate` |\n|---|---|---|---|---|\n"
            .to_owned();
    for name in scenes() {
        let start = std::time::Instant::now();
        if chosen(&name) {
            table += &row(&name);
        } else {
            let kept = gallery(&old).lines();
            let kept = kept.filter(|l| l.contains(&format!("({PICTURES}/{name}.png)")));
            table.extend(kept.map(|l| format!("{l}\n")));
        }
        eprintln!("{name}: {:.1?}", start.elapsed());
    }
    table += "\n";
    let readme = fs::read_to_string(README).expect("the README");
    let from = readme.find(BEGIN).expect("the gallery begins") + BEGIN.len();
    let rest = &readme[from + gallery(&readme).len()..];
    let whole = format!("{}{table}{rest}", &readme[..from]);
    fs::write(README, whole).expect("the README");
    if only.is_some() {
        return;
    }
    // What stands elsewhere in the README.
    let load = |name: &str| Scene::load(format!("scenes/{name}.toml")).expect("a shipped scene");
    let cut = RenderOptions {
        cut: Some(Cut::Quarter),
        ..RenderOptions::default()
    };
    write(
        "cut",
        &render(&load("assembly"), &cut, &|| false).expect("a picture"),
    );
    let plane = Plane::parse("y=0").expect("a plane");
    let options = SectionOptions::new(plane);
    write(
        "section",
        &section(&load("goblet"), &options, &|| false).expect("a picture"),
    );
    for name in ["torus", "cylinder"] {
        let plan = Plan {
            resolutions: vec![16, 32, 64, 128, 256],
            offsets: 64,
        };
        let scene = load(name);
        let found = study(&scene, &plan, &|| Ok(()), &mut |_| {}).expect("a study");
        let units = scene.model().units.name();
        write(&format!("converge-{name}"), &found.plot(name, units));
    }
}
