//! Volumes that were once answered wrongly, or refused or accepted without a word, one test each.

use glam::DVec3;
use std::f64::consts::PI;
use voxlathe::Scene;

fn parse(text: &str) -> Result<Scene, String> {
    Scene::parse(&format!("schema = 1\n{text}")).map_err(|e| e.to_string())
}

fn scene(text: &str) -> Scene {
    parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn refused(text: &str) -> String {
    match parse(text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error,
    }
}

/// The volume of a chain, and what the same profile is when it is turned.
fn pair(curves: &str, construct: &str) -> [Result<Scene, String>; 2] {
    let profile = format!("[profiles.p]\nboundary = 'to-axis'\ncurves = [{curves}]");
    [
        format!("kind = 'volume'\nconstruct = '{construct}'"),
        "kind = 'revolve'".to_owned(),
    ]
    .map(|kind| parse(&format!("{profile}\n[[solid]]\n{kind}\nprofile = 'p'")))
}

fn polyline(points: &str) -> String {
    format!("{{ kind = 'polyline', points = [{points}] }}")
}

/// A patch of degree 1 between two corners.
fn block(low: [f64; 3], high: [f64; 3]) -> String {
    let corner = |n: usize| [0, 1, 2].map(|k| if n >> k & 1 == 0 { low[k] } else { high[k] });
    let points: Vec<[f64; 3]> = (0..8).map(corner).collect();
    format!(
        "{{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]], points = {points:?} }}"
    )
}

fn patches(list: &[String]) -> String {
    format!(
        "[[solid]]\nkind = 'volume'\npatches = [{}]",
        list.join(", ")
    )
}

fn distance(scene: &Scene, p: [f64; 3]) -> f64 {
    scene.assembly().signed_distance(p.into())
}

#[test]
fn a_chain_with_a_gap_is_refused_as_a_profile_is() {
    let apart = [polyline("[1, 0], [1, 1]"), polyline("[1, 2], [1, 3]")].join(", ");
    let below = polyline("[-1, 0], [1, 2]");
    for construct in ["curve-disc", "curve-ruled"] {
        for (curves, said) in [
            (
                &apart,
                "a gap of 1e0 between the end of profiles.p.curves[0] at (r, z) = (1, 1) and the start of profiles.p.curves[1]",
            ),
            (&below, "r = -1e0 at parameter"),
        ] {
            let [volume, turned] = pair(curves, construct);
            let error = volume
                .err()
                .unwrap_or_else(|| panic!("{construct} {curves}"));
            assert!(error.contains(said), "{error}");
            // What crosses the axis may be cut or mirrored where it is turned, and a volume may not.
            let told = |text: &str| text.split(';').next().map(str::to_owned);
            let turned = turned
                .expect_err("refused too")
                .replace("revolve", "volume");
            if said.starts_with("r = ") {
                assert_eq!(told(&error), told(&turned));
                assert!(!error.contains("across"), "{error}");
            } else {
                assert_eq!(error, turned);
            }
        }
    }
}

#[test]
fn a_gap_that_a_profile_closes_is_closed_in_its_volume() {
    for off in [5e-10, -5e-10, 1e-16] {
        for radius in [0.0, 4e-10] {
            let curves = [
                polyline("[1, 0], [1, 1]"),
                polyline(&format!("[{}, {}], [1, 2]", 1.0 + radius, 1.0 + off)),
            ];
            for construct in ["curve-disc", "curve-ruled"] {
                let [volume, turned] =
                    pair(&curves.join(", "), construct).map(|s| s.expect("a solid"));
                for z in [1.2, 1.0, 1.0 + 0.5 * off, 0.7] {
                    let p = [0.0, 0.0, z];
                    let (a, b) = (distance(&volume, p), distance(&turned, p));
                    assert!(
                        (a - b).abs() < 2e-9 && b < -0.5,
                        "{off} {radius} {construct} {z}: {a} {b}"
                    );
                }
                let (a, b) = [&volume, &turned]
                    .map(|s| s.exact_volume().expect("one solid").value)
                    .into();
                assert!((a - b).abs() < 1e-8, "{a} {b}");
            }
        }
    }
}

#[test]
fn blocks_that_overlap_are_refused_whatever_faces_they_share() {
    for second in [[2.0, 1.0, 1.0], [1.0; 3], [0.5, 1.0, 1.0]] {
        let said = refused(&patches(&[
            block([0.0; 3], [1.0; 3]),
            block([0.0; 3], second),
        ]));
        assert!(
            said.contains("patches 0 and 1, which both hold ["),
            "{said}"
        );
        assert!(said.contains("solids of its own"), "{said}");
    }
}

#[test]
fn flat_faces_of_rational_patches_bound_exactly() {
    // A quarter of a ring between z = 0 and z = 1.5, and one from 1 on.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    for z in [0.0, 1.0] {
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for height in [z, z + 1.5] {
            for [x, y, w] in [[1.0, 0.0, 1.0], [1.0, 1.0, s], [0.0, 1.0, 1.0]] {
                for r in [1.0, 2.0] {
                    points.push([r * x, r * y, height]);
                    weights.push(w);
                }
            }
        }
        let ring = scene(&patches(&[format!(
            "{{ degrees = [1, 2, 1], knots = [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1], [0, 0, 1, 1]], points = {points:?}, weights = {weights:?} }}"
        )]));
        assert_eq!(ring.bounds().min.to_array(), [0.0, 0.0, z]);
        assert_eq!(ring.bounds().max.to_array(), [2.0, 2.0, z + 1.5]);
    }
}

/// A patch of degree 1, 1, `z.len() - 1` over the unit square.
fn column(z: &[f64]) -> String {
    let p = z.len() - 1;
    let mut points = Vec::new();
    for z in z {
        for n in 0..4 {
            points.push([f64::from(n & 1), f64::from(n >> 1), *z]);
        }
    }
    let knots = [vec![0; p + 1], vec![1; p + 1]].concat();
    format!(
        "{{ degrees = [1, 1, {p}], knots = [[0, 0, 1, 1], [0, 0, 1, 1], {knots:?}], points = {points:?} }}"
    )
}

#[test]
fn a_narrow_fold_is_refused() {
    let error = refused(&patches(&[column(&[
        0.0,
        0.291_768_75,
        0.271_037_5,
        0.271_139_583_333_33,
    ])]));
    assert!(error.contains("folds over itself"), "{error}");
}

#[test]
fn a_fold_of_rounded_decimals_is_told_of() {
    // The last slope is 0, or was meant to be: six decimals.
    let level = scene(&patches(&[column(&[0.0, 0.333_333, 0.666_667, 0.666_667])]));
    assert!(level.warnings().is_empty(), "{:?}", level.warnings());
    let rounded = scene(&patches(&[column(&[0.0, 0.333_333, 0.666_667, 0.666_666])]));
    let said = rounded.warnings();
    assert!(
        said.len() == 1
            && said[0].starts_with("solid[0].patches[0]: folds over itself by the rounding"),
        "{said:?}"
    );
    // The same fold given with all digits is meant.
    let error = refused(&patches(&[column(&[
        0.0,
        0.333_333_333_333_333,
        0.666_667,
        0.666_666,
    ])]));
    assert!(error.contains("folds over itself"), "{error}");
}

#[test]
fn a_flat_patch_is_refused_and_a_flat_cell_adds_nothing() {
    let error = refused(&patches(&[column(&[0.5, 0.5])]));
    assert!(
        error.contains("solid[0].patches[0]") && error.contains("flat"),
        "{error}"
    );
    // Two cells, the second without height.
    let mut points = Vec::new();
    for z in [0.0, 1.0, 1.0] {
        for n in 0..4 {
            points.push([f64::from(n & 1), f64::from(n >> 1), z]);
        }
    }
    let ended = scene(&patches(&[format!(
        "{{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 2, 2]], points = {points:?} }}"
    )]));
    assert_eq!(distance(&ended, [0.5, 0.5, 0.75]), -0.25);
    assert_eq!(distance(&ended, [0.5, 0.5, 1.25]), 0.25);
    assert_eq!(distance(&ended, [0.5, 0.5, 1.0]), 0.0);
    assert!(
        !ended
            .assembly()
            .contains(DVec3::new(0.5, 0.5, 1.0f64.next_up()))
    );
}

#[test]
fn cells_and_faces_agree_on_what_is_one_face() {
    // Neighbours a rounding apart, far out.
    let x = 1_000_000.3_f64;
    let far = scene(&patches(&[
        block([1_000_000.0, 0.0, 0.0], [x, 1.0, 1.0]),
        block([x.next_up(), 0.0, 0.0], [1_000_001.0, 1.0, 1.0]),
    ]));
    assert!((distance(&far, [x, 0.5, 0.5]) + 0.3).abs() < 1e-9);
    // A gap of many roundings.
    let near = scene(&patches(&[
        block([0.0; 3], [1.0; 3]),
        block([1.0 + 5e-13, 0.0, 0.0], [2.0, 1.0, 1.0]),
    ]));
    let middle = [1.0 + 2.5e-13, 0.5, 0.5];
    assert!(!near.assembly().contains(middle.into()));
    assert!(distance(&near, middle) < 1e-12);
    assert!((distance(&near, [0.9, 0.5, 0.5]) + 0.1).abs() < 1e-12);
}

#[test]
fn a_small_file_cannot_ask_for_much_memory() {
    // 6 x 6 x 7 cells of 33^3 coefficients each, from 38 x 38 x 39 points.
    let knots = |spans: usize| {
        let mut list = vec![0.0; 33];
        list.extend((1..spans).map(|i| i as f64));
        list.extend(vec![spans as f64; 33]);
        list
    };
    let [u, w] = [6, 7].map(knots);
    let mut points = Vec::new();
    for k in 0..39 {
        for j in 0..38 {
            for i in 0..38 {
                points.push([i, j, k]);
            }
        }
    }
    let error = refused(&patches(&[format!(
        "{{ degrees = [32, 32, 32], knots = [{u:?}, {u:?}, {w:?}], points = {points:?} }}"
    )]));
    assert!(
        error.contains("9056124 Bézier coefficients") && error.contains("at most 8388608"),
        "{error}"
    );
}

#[test]
fn a_long_patch_is_made_ready_in_time_that_grows_with_its_length() {
    let count = 20_000;
    let knots = (0..=count).map(f64::from);
    let knots: Vec<f64> = std::iter::once(0.0)
        .chain(knots)
        .chain([f64::from(count)])
        .collect();
    let line = voxlathe::nurbs::KnotVector::bezier(1).expect("valid");
    let mut points = Vec::new();
    for n in 0..4 {
        for i in 0..=count {
            points.push([f64::from(i), f64::from(n & 1), f64::from(n >> 1)]);
        }
    }
    let weights = vec![1.0; points.len()];
    let along = voxlathe::nurbs::KnotVector::new(1, knots).expect("valid");
    let volume = voxlathe::nurbs::NurbsVolume::new([along, line.clone(), line], points, weights)
        .expect("valid");
    let start = std::time::Instant::now();
    let faces = voxlathe::patch::FaceSet::new(std::slice::from_ref(&volume)).expect("faces");
    eprintln!("faces in {:?}", start.elapsed());
    let start = std::time::Instant::now();
    let cells = voxlathe::patch::Cells::new(std::slice::from_ref(&volume)).expect("cells");
    eprintln!("cells in {:?}", start.elapsed());
    let start = std::time::Instant::now();
    let frame =
        voxlathe::math::Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X).expect("a frame");
    let solid = voxlathe::solid::Patches::new(&frame, vec![volume], Vec::new()).expect("a solid");
    eprintln!("all in {:?}", start.elapsed());
    assert!(start.elapsed().as_secs() < 30, "quadratic");
    drop(solid);
    assert_eq!(faces.faces().len(), 4 * 20_000 + 2);
    assert_eq!(cells.len(), 20_000);
}

#[test]
fn what_is_empty_is_named() {
    for curves in [polyline("[1, 0], [2, 0]"), polyline("[0, 0], [0, 2]")] {
        for fill in ["", "fill = 'union'"] {
            for construct in ["curve-disc", "curve-ruled"] {
                let error = refused(&format!(
                    "[profiles.p]\nboundary = 'to-axis'\ncurves = [{curves}]\n[[solid]]\nkind = 'volume'\nconstruct = '{construct}'\nprofile = 'p'\n{fill}"
                ));
                assert!(
                    !error.contains("NaN") && error.contains("profile"),
                    "{error}"
                );
                assert!(error.contains("encloses no"), "{error}");
            }
        }
    }
}

#[test]
fn joints_of_blocks_of_different_sizes_are_inside() {
    for turn in 0..3_usize {
        let laid = |p: [f64; 3]| [p[(3 - turn) % 3], p[(4 - turn) % 3], p[(5 - turn) % 3]];
        let block = |a: [f64; 3], b: [f64; 3]| block(laid(a), laid(b));
        let l = [
            block([0.0; 3], [2.0, 1.0, 1.0]),
            block([0.0, 0.0, 1.0], [1.0, 1.0, 2.0]),
        ];
        let text = format!(
            "[[solid]]\nkind = 'box'\nsize = [8, 8, 8]\n{}\noperation = 'subtract'",
            patches(&l)
        );
        let cut = scene(&text);
        let p = laid([0.5, 0.5, 1.0]);
        assert!(
            !cut.assembly().contains(p.into()),
            "a sheet is left at {p:?}"
        );
        assert!((distance(&cut, p) - 0.5).abs() < 1e-14);
        // On the step itself the cut solid is closed.
        assert!(cut.assembly().contains(laid([1.5, 0.5, 1.0]).into()));
    }
    // Bricks whose joints cross.
    let bricks = scene(&format!(
        "[[solid]]\nkind = 'box'\nsize = [8, 8, 8]\n{}\noperation = 'subtract'",
        patches(&[
            block([0.0; 3], [1.0, 1.0, 1.0]),
            block([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
            block([0.0, 0.0, 1.0], [1.25, 1.0, 2.0]),
            block([1.25, 0.0, 1.0], [2.0, 1.0, 2.0]),
        ])
    ));
    for x in [0.5, 1.0, 1.125, 1.25, 1.5] {
        assert!(!bricks.assembly().contains(DVec3::new(x, 0.5, 1.0)), "{x}");
    }
}

#[test]
fn weights_of_all_sizes_in_one_cell_are_refused() {
    let with = |least: f64| {
        patches(&[block([0.0; 3], [1.0; 3]).replace(
            " }",
            &format!(", weights = [1, 1, 1, 1, 1, 1, 1, {least:e}] }}"),
        )])
    };
    let error = refused(&with(1e-13));
    assert!(
        error.contains("solid[0].patches[0]") && error.contains("1e13") && error.contains("cell 0"),
        "{error}"
    );
    scene(&with(1e-9));
}

#[test]
fn a_fold_of_high_degree_is_found_and_doubt_is_told() {
    let height = |k: usize, fold: f64| k as f64 + if k == 10 { fold } else { 0.0 };
    let high = |fold: f64| {
        let mut points = Vec::new();
        for k in 0..21 {
            for j in 0..21 {
                for i in 0..21 {
                    points.push([i as f64, j as f64, height(k, fold)]);
                }
            }
        }
        let knots = [[0; 21], [1; 21]].concat();
        patches(&[format!(
            "{{ degrees = [20, 20, 20], knots = [{knots:?}, {knots:?}, {knots:?}], points = {points:?} }}"
        )])
    };
    let error = refused(&high(60.0));
    assert!(error.contains("folds over itself"), "{error}");
    let doubtful = scene(&high(0.0));
    assert!(
        doubtful.warnings()[0].contains("not proved one to one"),
        "{:?}",
        doubtful.warnings()
    );
}

#[test]
fn scalars_are_given_on_the_faces_too() {
    let mut points: Vec<[f64; 3]> = (0..8)
        .map(|n: u32| {
            [
                0.1 + f64::from(n & 1),
                0.2 + f64::from(n >> 1 & 1),
                0.3 + f64::from(n >> 2),
            ]
        })
        .collect();
    // Of no shape that is known.
    points[7] = [1.25, 1.3, 1.45];
    points[2] = [0.0, 1.1, 0.35];
    let density = vec![7.0; 8];
    let placed = scene(&format!(
        "[[solid]]\nkind = 'volume'\npatches = [{{ degrees = [1, 1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]], points = {points:?}, fields = {{ density = {density:?} }} }}]
         place = [{{ rotate = {{ axis = [1, 2, 3], degrees = 33 }} }}, {{ translate = [1e3, 0.1, 0.7] }}]"
    ));
    let voxlathe::solid::Body::Patches(volume) = &**placed.assembly().parts()[0].body() else {
        panic!("a volume");
    };
    let mut held = 0;
    for n in 0..2000_u32 {
        // Feet of points outside are on the faces, to their rounding.
        let share = |k: u32| {
            (f64::from(n) * [0.819_172_513, 0.671_043_606, 0.549_700_477][k as usize]).fract()
        };
        let p = DVec3::new(share(0), share(1), share(2)) * 3.0 - 1.0;
        let b = placed.bounds();
        let p = b.min + p * b.sides();
        let sd = placed.assembly().signed_distance(p);
        let slope = DVec3::from_array(DVec3::AXES.map(|e| {
            let f = |s: f64| placed.assembly().signed_distance(p + s * 1e-4 * e);
            (f(1.0) - f(-1.0)) / 2e-4
        }));
        let q = p - slope.normalize() * sd;
        if placed.assembly().contains(q) {
            held += 1;
            assert!(volume.invert(q).is_some(), "{q}");
        }
    }
    assert!(held > 100, "{held}");
}

#[test]
fn a_patch_that_overlaps_itself_is_refused() {
    // A ring of rectangular section that goes round one and a quarter times, rising not at all.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let ring = |quarters: usize| {
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for i in 0..=2 * quarters {
            let a = i as f64 * PI / 4.0;
            let (far, weight) = if i % 2 == 0 { (1.0, 1.0) } else { (1.0 / s, s) };
            for z in [0.0, 1.0] {
                for r in [1.0, 2.0] {
                    points.push([r * far * a.cos(), r * far * a.sin(), z]);
                    weights.push(weight);
                }
            }
        }
        let mut knots = vec![0.0; 3];
        knots.extend((1..quarters).flat_map(|i| [i as f64; 2]));
        knots.extend(vec![quarters as f64; 3]);
        patches(&[format!(
            "{{ degrees = [1, 1, 2], knots = [[0, 0, 1, 1], [0, 0, 1, 1], {knots:?}], points = {points:?}, weights = {weights:?} }}"
        )])
    };
    let said = refused(&ring(5));
    assert!(said.contains("patch 0, which overlaps itself"), "{said}");
    assert!(scene(&ring(3)).warnings().is_empty());
    assert!(scene(&ring(4)).warnings().is_empty());
}

#[test]
fn a_file_is_read_as_the_exchange_reads_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let knots = "2 2  0 0 1 1\n".repeat(3);
    let cube = format!("700 1 0 0  3 0\n{knots} 0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1");
    let read = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        let there = voxlathe::exchange::read(&path);
        let here = parse(&format!(
            "[[solid]]\nkind = 'volume'\nfile = {:?}",
            path.display().to_string()
        ));
        if let (Err(there), Err(here)) = (&there, &here) {
            let there = there.to_string();
            let reason = there.split(": ").last().expect("a reason");
            assert!(here.contains(reason), "{here}\n{there}");
        }
        assert_eq!(there.is_ok(), here.is_ok(), "{name}");
        here
    };
    read("marked.g2", format!("\u{feff}{cube}").as_bytes())
        .expect("a byte order mark is none of the text");
    let error = read("cube.json", cube.as_bytes()).expect_err("not what its name says");
    assert!(error.contains("rename the file"), "{error}");
    let error = read("cube.g2", &[0x1f, 0x8b, 8, 0]).expect_err("compressed");
    assert!(error.contains("decompress it first"), "{error}");
    let said = read("cube.txt", cube.as_bytes()).expect("the content tells");
    assert!(
        said.warnings()[0].contains("not told by the name"),
        "{:?}",
        said.warnings()
    );
}

#[test]
fn meshes_are_closed_where_faces_of_different_sizes_meet() {
    use voxlathe::construct::{AngleInterval, AxisFrame, Construction, DiscForm, cylinder_volume};
    let closed = |scene: &Scene, chord: f64, volume: f64, area: f64| {
        for mesh in voxlathe::validate::meshes(scene, chord).expect("meshes") {
            let mesh = mesh.mesh();
            assert_eq!(mesh.unmatched_edge(), None);
            assert!(mesh.chord_error() <= chord);
            let off = (mesh.volume() - volume).abs();
            assert!(off <= area * chord + 1e-9, "{} for {volume}", mesh.volume());
        }
    };
    closed(
        &scene(&patches(&[
            block([0.0; 3], [2.0, 1.0, 1.0]),
            block([0.0, 0.0, 1.0], [1.0, 1.0, 2.0]),
        ])),
        0.01,
        3.0,
        0.0,
    );
    // A quarter of a cylinder, and on it the first half of another: the arcs meet half way.
    let by = Construction::CurveDisc(DiscForm::Polar);
    let turn = AngleInterval::new(0.0, 90.0).expect("an angle");
    let below = cylinder_volume(1.0, 1.0, by, turn, &AxisFrame::WORLD).expect("a cylinder");
    // The direction that turns is that of degree 2.
    let round = (0..3)
        .find(|&k| below.degrees()[k] == 2)
        .expect("one turns");
    let (first, last) = below.domain()[round];
    let (half, _) = below.split(round, 0.5 * (first + last)).expect("inside");
    let raised = half
        .control_points()
        .iter()
        .map(|[x, y, z]| [*x, *y, z + 1.0]);
    let half = voxlathe::nurbs::NurbsVolume::new(
        half.knots().clone(),
        raised.collect(),
        half.weights().to_vec(),
    )
    .expect("valid");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("steps.xml");
    voxlathe::exchange::write_volumes(&path, &[below, half]).expect("written");
    let steps = scene(&format!(
        "[[solid]]\nkind = 'volume'\nfile = {:?}",
        path.display().to_string()
    ));
    closed(&steps, 1e-3, PI / 4.0 * 1.5, 8.0);
    closed(&steps, 1e-4, PI / 4.0 * 1.5, 8.0);
}
