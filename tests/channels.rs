//! Channels beside occupancy, fraction, sdf and material: what a run writes, against closed forms and each other.

#[path = "support/command.rs"]
mod support;

use serde_json::Value;
use support::{Stack, below, run, scratch, shipped};
use voxlathe::Scene;
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

/// The layers of some channels, each whole, x fastest.
fn sampled(scene: &Scene, grid: &GridSpec, channels: &[Channel]) -> Vec<Vec<f32>> {
    let selection = Selection::of(channels, None);
    let sampler = LayerSampler::new(scene.assembly(), grid, selection);
    let mut all = vec![Vec::new(); channels.len()];
    let mut layer = LayerBuffers::default();
    for k in 0..grid.dims()[2] {
        sampler.sample(k, &mut layer);
        assert_eq!(
            (
                layer.tally.unseen,
                layer.tally.uncut,
                layer.tally.loose.voxels
            ),
            (0, 0, 0)
        );
        for (channel, all) in channels.iter().zip(&mut all) {
            let values = match channel {
                Channel::Fraction => &layer.fraction,
                Channel::Sdf => &layer.sdf,
                other => {
                    let found = layer.others.iter().find(|(c, _)| c == other);
                    &found.expect("a channel that was asked for").1
                }
            };
            all.extend_from_slice(values);
        }
    }
    all
}

fn scene(text: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{text}")).expect("a scene")
}

/// Every cell of every scene: the sides that neighbours share, the closure of each cell, and the sums of all.
#[test]
fn cut_cells_close_and_sum() {
    use Channel::{
        BoundaryArea, BoundaryNormalX, BoundaryNormalY, BoundaryNormalZ, FaceX, FaceY, FaceZ,
        Fraction,
    };
    let tilted =
        "solid = [{ kind = 'torus', major = 3, minor = 1, axis = { direction = [1, 2, 3] } }]";
    let bored = "solid = [{ kind = 'cylinder', radius = 1, height = 2 },
        { kind = 'cylinder', radius = 0.5, height = 2, operation = 'subtract', axis = { direction = [1, 0, 0] },
          place = [{ translate = [-1, 0, 1] }] }]";
    let quarter = "solid = [{ kind = 'cone', radius1 = 2, radius2 = 0.5, height = 3, angle = 90 }]";
    for (text, resolution) in [(tilted, 24), (bored, 8), (quarter, 16)] {
        let scene = scene(&format!("grid.resolution = {resolution}\n{text}"));
        let grid = scene.grid().expect("a grid");
        let channels = [
            FaceX,
            FaceY,
            FaceZ,
            BoundaryNormalX,
            BoundaryNormalY,
            BoundaryNormalZ,
            BoundaryArea,
            Fraction,
        ];
        let all = sampled(&scene, &grid, &channels);
        let [nx, ny, nz] = grid.dims();
        let step = [1, nx, nx * ny];
        let s = grid.spacing();
        let face = [s.y * s.z, s.z * s.x, s.x * s.y];
        let (mut area, mut worst) = (0.0, 0.0_f64);
        for n in 0..nx * ny * nz {
            area += f64::from(all[6][n]);
            let place = [n % nx, n / nx % ny, n / nx / ny];
            for a in 0..3 {
                // The padding is empty: what is beyond the last voxel is 0.
                let is_last = place[a] + 1 == grid.dims()[a];
                let upper = if is_last {
                    0.0
                } else {
                    f64::from(all[a][n + step[a]])
                };
                let off = f64::from(all[3 + a][n]) + face[a] * (upper - f64::from(all[a][n]));
                worst = worst.max(off.abs() / face[a]);
            }
        }
        let exact = scene
            .assembly()
            .moments()
            .expect("a solid that is measured")
            .area
            .value;
        eprintln!(
            "closure to {worst:.1e}, area to {:.1e}: {text}",
            area / exact - 1.0
        );
        // Three roundings to f32.
        assert!(worst <= 2e-7, "{worst}: {text}");
        assert!(
            (area - exact).abs() <= 1e-6 * exact,
            "{area} {exact}: {text}"
        );
    }
}

#[test]
fn azimuth_and_profile_parameter_are_the_scene_s() {
    let t = scratch();
    let path = t.path().join("half.toml");
    let text = "schema = 1
grid = { origin = [-4, -4, -1], spacing = 0.5, dims = [16, 16, 8] }
profiles.ring.curves = [{ kind = 'polyline', points = [[1, 0], [3, 0], [3, 2]] },
    { kind = 'nurbs', degree = 1, points = [[3, 2], [1, 2]] }, { kind = 'polyline', points = [[1, 2], [1, 0]] }]
solid = [{ kind = 'revolve', profile = 'ring', angle = 180 }]
";
    std::fs::write(&path, text).expect("a scene");
    let out = below(&t, "out");
    let channels = "azimuth,profile-parameter,normal-x,normal-y,normal-z,closest-x,closest-y,closest-z,curvature-mean";
    run(&[
        "voxelize",
        path.to_str().expect("a path"),
        "-o",
        &out,
        "--channels",
        channels,
    ])
    .exits(0);
    let stack = Stack::read(&out);
    let get = |name: &str| stack.channel(name);
    let [azimuth, parameter] = ["azimuth", "profile-parameter"].map(get);
    let normal = ["normal-x", "normal-y", "normal-z"].map(get);
    let closest = ["closest-x", "closest-y", "closest-z"].map(get);
    let mean = get("curvature-mean");
    let at = |i: usize, j: usize, k: usize| (k * 16 + j) * 16 + i;
    // Centres are at (i - 7.5) / 2 across and (k - 1.5) / 2 up. Below the middle of the ring, at y = 2.25.
    let n = at(7, 12, 0);
    assert!((f64::from(azimuth[n]) - (2.25_f64).atan2(-0.25).to_degrees()).abs() < 1e-4);
    let share = ((0.25_f64).hypot(2.25) - 1.0) / 4.0;
    assert!(
        (f64::from(parameter[n]) - share).abs() < 1e-6,
        "{} {share}",
        parameter[n]
    );
    assert_eq!([normal[0][n], normal[1][n], normal[2][n]], [0.0, 0.0, -1.0]);
    assert_eq!((closest[2][n], mean[n]), (0.0, 0.0));
    // Above it, on the second curve, which runs inwards.
    let n = at(7, 12, 6);
    let share = 1.0 + (3.0 - (0.25_f64).hypot(2.25)) / 2.0;
    assert!(
        (f64::from(parameter[n]) - share).abs() < 1e-6,
        "{} {share}",
        parameter[n]
    );
    // Outside of the wall, half of whose curvature is 1/3.
    let n = at(15, 8, 3);
    assert!((mean[n] - 1.0 / 6.0).abs() < 1e-6);
    // Inside of it, behind the cap at 0 degrees, and before that at 180.
    for (i, degrees) in [(12, 0.0), (3, 180.0)] {
        let n = at(i, 7, 3);
        assert_eq!((parameter[n], azimuth[n]), (-1.0, degrees));
        assert_eq!(
            [normal[0][n], normal[1][n], normal[2][n]].map(|v| v + 0.0),
            [0.0, -1.0, 0.0]
        );
        assert_eq!(closest[1][n], 0.0);
    }
}

#[test]
fn shares_of_materials_are_those_of_the_later_solid() {
    let t = scratch();
    let path = t.path().join("two.toml");
    // A ball of material 2 in the corner of a block of material 1, which it takes from; the block's lower half is cut away.
    let text = "schema = 1
grid = { origin = [-1, -1, -1], spacing = 1, dims = [2, 2, 2] }
[[solid]]
kind = 'box'
size = [2, 2, 2]
[[solid]]
kind = 'sphere'
radius = 1
material = 2
[[solid]]
kind = 'box'
size = [2, 2, 2]
operation = 'subtract'
place = [{ translate = [0, 0, -1.5] }]
";
    std::fs::write(&path, text).expect("a scene");
    let out = below(&t, "out");
    let channels = "fraction,fraction-1,fraction-2,face-z,boundary-area";
    let json = run(&[
        "voxelize",
        path.to_str().expect("a path"),
        "-o",
        &out,
        "--channels",
        channels,
        "--json",
    ])
    .exits(0)
    .json();
    assert_eq!(
        json["channels"],
        serde_json::json!([
            "fraction",
            "fraction-1",
            "fraction-2",
            "face-z",
            "boundary-area"
        ])
    );
    let stack = Stack::read(&out);
    let get = |name: &str| stack.channel(name);
    let [all, first, second] = ["fraction", "fraction-1", "fraction-2"].map(get);
    // Of the upper cells an eighth of a ball each; of the lower ones what is above -0.5 of it.
    let upper = std::f64::consts::PI / 6.0;
    let lower = std::f64::consts::PI * (0.5 - 0.125 / 3.0) / 4.0;
    for n in 0..8 {
        let (whole, ball) = if n < 4 { (0.5, lower) } else { (1.0, upper) };
        assert!((f64::from(all[n]) - whole).abs() < 1e-7, "{n}: {}", all[n]);
        assert!(
            (f64::from(second[n]) - ball).abs() < 1e-7,
            "{n}: {}",
            second[n]
        );
        assert!(
            (f64::from(first[n]) - (whole - ball)).abs() < 1e-7,
            "{n}: {}",
            first[n]
        );
    }
    // The block's sides are sides of the cells; the cut is in the middle of the lower ones.
    let [face, area] = ["face-z", "boundary-area"].map(get);
    assert_eq!((face[0], face[4]), (0.0, 1.0));
    assert!(
        (area[0] - 2.0).abs() < 1e-6 && (area[4] - 3.0).abs() < 1e-6,
        "{} {}",
        area[0],
        area[4]
    );
}

#[test]
fn what_a_scene_cannot_have_is_refused() {
    let t = scratch();
    let out = below(&t, "out");
    let refused = |scene: &str, channels: &str| {
        let arguments = [
            "voxelize",
            scene,
            "-o",
            &out,
            "--channels",
            channels,
            "--resolution",
            "8",
        ];
        let run = run(&arguments).exits(2);
        assert!(!std::path::Path::new(&out).exists());
        run.err
    };
    let err = refused(&shipped("torus"), "fraction-2");
    assert!(
        err.contains("\"fraction-2\" is not one of") && err.contains("fraction-1"),
        "{err}"
    );
    let err = refused(&shipped("torus"), "normal-w");
    assert!(err.contains("did you mean normal-"), "{err}");
    // A volume of nets that is no turned solid has nearest points, but no cut cells.
    let err = refused(&shipped("graded_block"), "face-x");
    assert!(
        err.contains("no turned solid") && err.contains("face, centroid and boundary"),
        "{err}"
    );
    let arguments = [
        "voxelize",
        &shipped("graded_block"),
        "-o",
        &out,
        "--channels",
        "normal-x,curvature-mean",
    ];
    run(&[&arguments[..], &["--resolution", "8"]].concat()).exits(0);
    let manifest = std::fs::read_to_string(format!("{out}/manifest.json")).expect("a manifest");
    let manifest: Value = serde_json::from_str(&manifest).expect("JSON");
    assert_eq!(
        manifest["channels"][1]["unit"],
        "mm^-1".replace("mm", manifest["units"].as_str().unwrap_or("m"))
    );
}
