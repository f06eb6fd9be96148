//! Splines to files and back: every format, every dialect, and what is wrong with a file.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use voxlathe::exchange::{
    self, ExchangeError, Format, Reading, Spline, g2, geomdl, gismo, mfem, read_text, write_text,
};
use voxlathe::nurbs::{KnotVector, NurbsCurve, NurbsTensor, NurbsVolume};

/// Numbers that look random; the same for the same seed.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        // Steele, Lea, Flood: SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.next() % n as u64).expect("small")
    }

    /// From 0 to 1, all bits in use.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.below(i + 1));
        }
    }

    /// Degree 1 to 5, knots of any multiplicity allowed, ends clamped or not.
    fn knots(&mut self, clamped: bool) -> KnotVector {
        let degree = 1 + self.below(5);
        let mut at = self.unit() * 4.0 - 2.0;
        let mut knots = vec![at; if clamped { degree + 1 } else { 1 }];
        for _ in 0..self.below(3) + usize::from(!clamped) * 2 * degree {
            at += 0.01 + self.unit();
            let times = if clamped { 1 + self.below(degree) } else { 1 };
            knots.extend(vec![at; times]);
        }
        at += 0.1 + self.unit();
        knots.extend(vec![at; if clamped { degree + 1 } else { 1 }]);
        KnotVector::new(degree, knots).expect("increasing")
    }

    fn tensor<const N: usize>(&mut self, clamped: bool, rational: bool) -> NurbsTensor<N> {
        let knots = std::array::from_fn(|_| self.knots(clamped));
        let (points, weights) = self.points(&knots, rational);
        NurbsTensor::new(knots, points, weights).expect("valid")
    }

    fn curve(&mut self, clamped: bool, rational: bool) -> NurbsCurve<3> {
        let knots = [self.knots(clamped)];
        let (points, weights) = self.points(&knots, rational);
        let [knots] = knots;
        NurbsCurve::new(knots, points, weights).expect("valid")
    }

    fn points(&mut self, knots: &[KnotVector], rational: bool) -> (Vec<[f64; 3]>, Vec<f64>) {
        let count = knots.iter().map(KnotVector::control_points).product();
        let scale = 10_f64.powi(i32::try_from(self.below(13)).expect("small") - 6);
        let points = (0..count).map(|_| [0; 3].map(|_| (self.unit() - 0.5) * scale));
        let points = points.collect();
        let weights = (0..count).map(|_| {
            if rational {
                10_f64.powf(self.unit() * 4.0 - 2.0)
            } else {
                1.0
            }
        });
        (points, weights.collect())
    }

    /// One to three splines of a kind.
    fn splines(&mut self, kind: usize, clamped: bool) -> Vec<Spline> {
        let one = |dice: &mut Self| {
            let rational = dice.below(3) > 0;
            match kind {
                0 => Spline::Curve(dice.curve(clamped, rational)),
                1 => Spline::Surface(dice.tensor(clamped, rational)),
                _ => Spline::Volume(dice.tensor(clamped, rational)),
            }
        };
        (0..=self.below(3)).map(|_| one(self)).collect()
    }
}

/// Knots, points and weights of a spline.
fn parts(spline: &Spline) -> (Vec<&KnotVector>, &[[f64; 3]], &[f64]) {
    match spline {
        Spline::Curve(c) => (vec![c.knots()], c.control_points(), c.weights()),
        Spline::Surface(s) => (s.knots().iter().collect(), s.control_points(), s.weights()),
        Spline::Volume(v) => (v.knots().iter().collect(), v.control_points(), v.weights()),
    }
}

fn bits(spline: &Spline) -> Vec<u64> {
    let (knots, points, weights) = parts(spline);
    let knots = knots.iter().flat_map(|k| k.knots().iter().copied());
    let numbers = knots.chain(points.iter().flatten().copied());
    numbers
        .chain(weights.iter().copied())
        .map(f64::to_bits)
        .collect()
}

fn must_read(format: Format, text: &str) -> Reading {
    read_text(format, text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn cartesian_formats_give_every_bit_back(seed in any::<u64>(), kind in 0..3_usize) {
        let mut dice = Dice(seed);
        for format in [Format::Mfem, Format::Geomdl, Format::Gismo] {
            // MFEM has clamped knot vectors only.
            let clamped = format == Format::Mfem || dice.below(2) == 0;
            let splines = dice.splines(kind, clamped);
            let text = write_text(format, &splines).expect("one kind");
            prop_assert_eq!(Format::of_text(&text), Some(format));
            let reading = must_read(format, &text);
            prop_assert_eq!(&reading.splines, &splines);
            for (found, wanted) in reading.splines.iter().zip(&splines) {
                prop_assert_eq!(bits(found), bits(wanted));
            }
            prop_assert_eq!(reading.notes, Vec::<String>::new());
        }
    }

    #[test]
    fn premultiplied_points_come_back_within_a_step(seed in any::<u64>()) {
        let mut dice = Dice(seed);
        // All kinds in one file.
        let mut splines: Vec<_> = (0..3).flat_map(|kind| dice.splines(kind, seed % 2 == 0)).collect();
        dice.shuffle(&mut splines);
        let text = g2::write(&splines);
        prop_assert_eq!(Format::of_text(&text), Some(Format::G2));
        let reading = must_read(Format::G2, &text);
        prop_assert_eq!(reading.splines.len(), splines.len());
        for (found, wanted) in reading.splines.iter().zip(&splines) {
            let ((knots, points, weights), (knots_0, points_0, weights_0)) = (parts(found), parts(wanted));
            prop_assert_eq!(knots, knots_0);
            prop_assert_eq!(weights, weights_0);
            if weights.iter().all(|&w| w == 1.0) {
                prop_assert_eq!(points, points_0);
            }
            for (x, x_0) in points.iter().flatten().zip(points_0.iter().flatten()) {
                prop_assert!(*x == *x_0 || *x == x_0.next_up() || *x == x_0.next_down(), "{} {}", x, x_0);
            }
        }
    }
}

#[test]
fn numbers_have_all_their_digits() {
    let points = vec![
        [0.1 + 0.2, std::f64::consts::FRAC_1_SQRT_2, -1e-310],
        [1e22, 5e-324, -0.0],
    ];
    let line = NurbsCurve::new(
        KnotVector::bezier(1).expect("degree 1"),
        points,
        vec![1.0, std::f64::consts::PI],
    );
    let line = [line.expect("valid")];
    for format in [Format::Mfem, Format::Geomdl, Format::Gismo] {
        let text = write_text(format, &line).expect("one curve");
        for digits in [
            "0.30000000000000004",
            "0.7071067811865476",
            "3.141592653589793",
            "5e-324",
        ] {
            assert!(text.contains(digits), "{format}: {digits} in\n{text}");
        }
        let back = must_read(format, &text).splines;
        assert_eq!(
            bits(&back[0]),
            bits(&Spline::Curve(line[0].clone())),
            "{format}"
        );
    }
}

// ---- hand-made files -----------------------------------------------------------------------------

/// A quarter of a ring, radii 1 and 2, angle by angle: three points on each of two arcs.
const QUARTER: [[f64; 2]; 6] = [
    [1.0, 0.0],
    [2.0, 0.0],
    [1.0, 1.0],
    [2.0, 2.0],
    [0.0, 1.0],
    [0.0, 2.0],
];
const HALF_ROOT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The ring's points and weights, from z = 0 to z = 3.
fn quarter() -> NurbsVolume {
    let knots = [1, 2, 1].map(|degree| KnotVector::bezier(degree).expect("low"));
    let points = [0.0, 3.0]
        .iter()
        .flat_map(|&z| QUARTER.map(|[x, y]| [x, y, z]));
    let weights = [1.0, 1.0, HALF_ROOT, HALF_ROOT, 1.0, 1.0].repeat(2);
    NurbsVolume::new(knots, points.collect(), weights).expect("valid")
}

/// Points of the ring lie where polar coordinates have them, and radii on the right arcs.
fn check_quarter(volume: &NurbsVolume, tolerance: f64) {
    for i in 0..=8 {
        for j in 0..=8 {
            let (u, v) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
            let [x, y, z] = volume.evaluate([u, v, 0.25]).expect("inside");
            assert!(
                (x.hypot(y) - (1.0 + u)).abs() <= tolerance,
                "{x} {y} at {u} {v}"
            );
            assert!((z - 0.75).abs() <= tolerance);
            assert!(x >= -tolerance && y >= -tolerance);
        }
    }
}

fn one_volume(reading: &Reading) -> &NurbsVolume {
    match &reading.splines[..] {
        [Spline::Volume(volume)] => volume,
        other => panic!("{} splines, the first a {}", other.len(), other[0].kind()),
    }
}

#[test]
fn g2_premultiplied_with_auxiliary_numbers() {
    // A colour in the header, six digits, order instead of degree, several objects in a row.
    let text = "700 1 0 4 0 200 200 255\n\n3 1\n2 2\n0 0 1 1\n3 3\n0 0 0 1 1 1\n2 2\n0 0 1 1\n\
        1 0 0 1\n2 0 0 1\n0.707107 0.707107 0 0.707107\n1.414214 1.414214 0 0.707107\n0 1 0 1\n0 2 0 1\n\
        1 0 3 1\n2 0 3 1\n0.707107 0.707107 2.121320 0.707107\n1.414214 1.414214 2.121320 0.707107\n0 1 3 1\n0 2 3 1\n\
        \n200 1 0 0\n2 0\n2 2\n0 0 1 1\n2 2\n5 5 7 7\n0 0\n1 0\n0 1\n4 5\n\
        100 1 0 0 3 0 2 2 0 0 1 1 0 0 0 1 2 3";
    let reading = g2::read(text).expect("well formed");
    let [
        Spline::Volume(ring),
        Spline::Surface(flat),
        Spline::Curve(line),
    ] = &reading.splines[..]
    else {
        panic!("{:?}", reading.splines);
    };
    check_quarter(ring, 3e-6);
    assert!((ring.control_points()[2][0] - 1.0).abs() < 1e-12);
    assert_eq!(
        flat.evaluate([1.0, 7.0]).expect("a corner"),
        [4.0, 5.0, 0.0]
    );
    assert_eq!(line.evaluate(1.0).expect("the end"), [1.0, 2.0, 3.0]);
    assert_eq!(
        reading.notes,
        ["line 23, column 1: the points have two coordinates and are read with z = 0"]
    );
}

#[test]
fn weights_taken_the_wrong_way_are_noticed() {
    let (points, weights) = (
        quarter().control_points().to_vec(),
        quarter().weights().to_vec(),
    );
    let row = |factor: bool| {
        let lines = points.iter().zip(&weights).map(|(p, &w)| {
            let [x, y, z] = p.map(|c| if factor { c * w } else { c });
            format!("{x} {y} {z} {w}\n")
        });
        lines.collect::<String>()
    };
    let knots = "2 2 0 0 1 1\n3 3 0 0 0 1 1 1\n2 2 0 0 1 1\n";
    let g2_of = |factor| format!("700 1 0 0\n3 1\n{knots}{}", row(factor));
    let right = g2::read(&g2_of(true)).expect("well formed");
    assert_eq!(right.notes, Vec::<String>::new());
    check_quarter(one_volume(&right), 1e-14);
    let wrong = g2::read(&g2_of(false)).expect("well formed");
    assert!(
        wrong.notes[0].contains("look Cartesian"),
        "{:?}",
        wrong.notes
    );

    let head = "MFEM NURBS mesh v1.0\ndimension 3 elements 1 1 5 0 1 2 3 4 5 6 7 boundary 0 edges 0 vertices 8\n\
        patches knotvectors 3 1 2 0 0 1 1 2 3 0 0 0 1 1 1 1 2 0 0 1 1 dimension 3\n";
    for (section, premultiplied) in [
        ("controlpoints", true),
        ("controlpoints_homogeneous", true),
        ("controlpoints_cartesian", false),
    ] {
        let right = mfem::read(&format!("{head}{section}\n{}", row(premultiplied))).expect(section);
        assert_eq!(right.notes, Vec::<String>::new());
        check_quarter(one_volume(&right), 1e-14);
        let wrong =
            mfem::read(&format!("{head}{section}\n{}", row(!premultiplied))).expect(section);
        let look = if premultiplied {
            "look Cartesian"
        } else {
            "look premultiplied"
        };
        assert!(wrong.notes[0].contains(look), "{:?}", wrong.notes);
        assert!(wrong.notes[0].contains(section), "{:?}", wrong.notes);
    }
    let wrong = points
        .iter()
        .zip(&weights)
        .map(|(p, &w)| p.map(|c| c * w))
        .collect();
    let wrong = NurbsVolume::new(quarter().knots().clone(), wrong, weights.clone()).expect("valid");
    for format in [Format::Geomdl, Format::Gismo] {
        let text = write_text(format, &[quarter()]).expect("a volume");
        assert_eq!(must_read(format, &text).notes, Vec::<String>::new());
        let text = write_text(format, std::slice::from_ref(&wrong)).expect("a volume");
        let notes = must_read(format, &text).notes;
        assert!(notes[0].contains("look premultiplied"), "{notes:?}");
    }
}

#[test]
fn geomdl_has_v_first() {
    // u has three points, v two, w two; x counts along u, y along v, z along w.
    let mut points = Vec::new();
    for w in 0..2 {
        for u in 0..3 {
            for v in 0..2 {
                points.push(format!("[{u}, {v}.0, {w}]"));
            }
        }
    }
    let text = format!(
        r#"{{"shape": {{"type": "volume", "count": 1, "data": [{{"rational": true, "dimension": 3,
        "degree_u": 2, "degree_v": 1, "degree_w": 1, "size_u": 3, "size_v": 2, "size_w": 2,
        "knotvector_u": [0, 0, 0, 1, 1, 1], "knotvector_v": [0, 0, 1, 1], "knotvector_w": [0, 0, 1, 1],
        "control_points": {{"points": [{}], "weights": [1, 1, 0.5, 0.25, 1, 1, 1, 1, 1, 1, 1, 1]}},
        "delta": [0.1, 0.1, 0.1]}}]}}}}"#,
        points.join(", ")
    );
    let reading = geomdl::read(&text).expect("well formed");
    let volume = one_volume(&reading);
    for (index, point) in volume.control_points().iter().enumerate() {
        let wanted = [index % 3, index / 3 % 2, index / 6].map(|i| i as f64);
        assert_eq!(*point, wanted);
    }
    // u = 1: v = 0 has 0.5 and v = 1 has 0.25.
    assert_eq!(volume.weights()[1], 0.5);
    assert_eq!(volume.weights()[4], 0.25);
    // The writer has the same order.
    let written = write_text(Format::Geomdl, &reading.splines).expect("a volume");
    let value: serde_json::Value = serde_json::from_str(&written).expect("JSON");
    let points = &value["shape"]["data"][0]["control_points"]["points"];
    assert_eq!(points[1], serde_json::json!([0.0, 1.0, 0.0]));
    assert_eq!(points[2], serde_json::json!([1.0, 0.0, 0.0]));
    assert_eq!(value["shape"]["data"][0]["size_u"], 3);
}

#[test]
fn geomdl_curves_and_trims() {
    let text = r#"{"shape": {"type": "curve", "data": [{"degree": 1, "knotvector": [0, 0, 0.5, 1, 1],
        "control_points": {"points": [[0, 0], [1, 2], [3, 0.5]]}}]}}"#;
    let reading = geomdl::read(text).expect("well formed");
    let Spline::Curve(curve) = &reading.splines[0] else {
        panic!("a curve")
    };
    assert_eq!(curve.evaluate(0.75).expect("inside"), [2.0, 1.25, 0.0]);
    assert!(reading.notes[0].contains("z = 0"));
    let text = r#"{"shape": {"type": "surface", "data": [{"rational": true,
        "degree_u": 1, "knotvector_u": [0, 0, 1, 1], "size_u": 2, "degree_v": 1, "knotvector_v": [0, 0, 1, 1],
        "size_v": 2, "control_points": {"points": [[0,0,0],[0,1,0],[1,0,0],[1,1,0]]},
        "trims": {"count": 1, "data": []}}]}}"#;
    let notes = geomdl::read(text).expect("well formed").notes;
    assert_eq!(
        notes,
        [
            "shape.data[0].control_points: the spline is rational without weights; they are taken as 1",
            "shape.data[0].trims: the trimming curves are passed over; the whole surface is read",
        ]
    );
}

#[test]
fn gismo_layers_and_free_blanks() {
    let text = r#"<?xml version="1.0" encoding="UTF-8"?>
<xml> <!-- two geometries and their joint -->
 <Geometry type="TensorNurbs3" id="4"><Basis type="TensorNurbsBasis3">
  <weights>1 1 0.70710678118654757 0.70710678118654757 1 1
  1 1 <!-- the second layer --> 0.70710678118654757 0.70710678118654757 1 1</weights>
  <Basis type="TensorBSplineBasis3">
   <Basis type="BSplineBasis" index="0"><KnotVector degree="1"> 0 0 1 1 </KnotVector></Basis>
   <Basis type="BSplineBasis" index="1"><KnotVector degree="2">0.0 0.0 0.0 1e0 1.0 1.0</KnotVector></Basis>
   <Basis type="BSplineBasis" index="2"><KnotVector degree="1">
     0 0 1 1</KnotVector></Basis>
  </Basis></Basis>
  <coefs geoDim="3">1 0 0 2 0 0 1 1 0 2 2 0 0 1 0 0 2 0 1 0 3 2 0 3 1 1 3 2 2 3 0 1 3 0 2 3</coefs>
 </Geometry>
 <Geometry type="TensorBSpline2"><Basis type="TensorBSplineBasis2">
   <Basis type="BSplineBasis" index="0"><KnotVector degree="1">0 0 1 1</KnotVector></Basis>
   <Basis type="BSplineBasis" index="1"><KnotVector degree="1">0 0 1 1</KnotVector></Basis></Basis>
  <coefs geoDim="2">0 0 1 0 0 1 1 1</coefs></Geometry>
 <MultiPatch parDim="3"><patches type="id_range">4 4</patches></MultiPatch>
</xml>"#;
    let reading = gismo::read(text).expect("well formed");
    let [Spline::Volume(ring), Spline::Surface(_)] = &reading.splines[..] else {
        panic!("two")
    };
    check_quarter(ring, 1e-14);
    assert_eq!(*ring, quarter());
    assert_eq!(reading.notes.len(), 1);
    assert!(
        reading.notes[0].starts_with("line 14, column 2: "),
        "{:?}",
        reading.notes
    );
}

// ---- MFEM: points numbered over the mesh ---------------------------------------------------------

/// The disc of radius 3: a square in the middle and four pieces round it, rational quadratic along the
/// rim and linear across it.
fn disc() -> String {
    let (r, d, e) = (HALF_ROOT, 3.0 * HALF_ROOT, 3.0 / HALF_ROOT);
    format!(
        "MFEM NURBS mesh v1.1   # how to refine is passed over
dimension 2
elements 5
1 3 4 5 6 7   1 3 0 1 5 4   1 3 1 2 6 5   1 3 3 7 6 2   1 3 0 4 7 3
boundary 4
1 1 0 1   1 1 2 3   1 1 1 2   1 1 3 0
edges 12
0 0 1  0 4 5  0 7 6  0 3 2  1 1 2  1 5 6  1 4 7  1 0 3  2 0 4  2 1 5  2 2 6  2 3 7
vertices 8
knotvectors 3
2 3 0 0 0 1 1 1  2 3 0 0 0 1 1 1  1 2 0 0 1 1
refinements 2 2
spacing 1
0 1 1 2  7  0.5 0.25
weights
1 1 1 1 1 1 1 1   {r} 1 1 {r}   {r} 1 1 {r}   1
FiniteElementSpace
FiniteElementCollection: NURBS
VDim: 2
Ordering: 1
{md} {md}  {d} {md}  {d} {d}  {md} {d}   -1 -1  1 -1  1 1  -1 1
0 {me} 0 -1 0 1 0 {e}   {e} 0 1 0 -1 0 {me} 0   0 0
",
        md = -d,
        me = -e
    )
}

#[test]
fn mfem_disc_is_round() {
    let text = disc();
    let reading = mfem::read(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut notes = reading.notes.iter();
    assert!(
        notes
            .next()
            .is_some_and(|n| n.contains("how the mesh is to be refined"))
    );
    assert!(notes.next().is_some_and(|n| n.contains("z = 0")));
    assert_eq!(notes.next(), None);
    let surfaces = reading.splines.iter().map(|spline| match spline {
        Spline::Surface(surface) => surface,
        other => panic!("a {}", other.kind()),
    });
    let surfaces = surfaces.collect::<Vec<_>>();
    let degrees: Vec<_> = surfaces.iter().map(|s| s.degrees()).collect();
    assert_eq!(degrees, [[2, 2], [2, 1], [2, 1], [1, 2], [1, 2]]);
    for i in 0..=8 {
        let t = f64::from(i) / 8.0;
        // The rim is v = 0 of the second and third element, u = 0 of the others.
        for (patch, rim, inner) in [
            (1, [t, 0.0], [t, 1.0]),
            (2, [t, 0.0], [t, 1.0]),
            (3, [0.0, t], [1.0, t]),
            (4, [0.0, t], [1.0, t]),
        ] {
            let [x, y, _] = surfaces[patch].evaluate(rim).expect("inside");
            assert!(
                (x.hypot(y) - 3.0).abs() < 2e-15 * 4.0,
                "patch {patch} at {t}: {x} {y}"
            );
            let [x, y, _] = surfaces[patch].evaluate(inner).expect("inside");
            assert!(
                (x.abs().max(y.abs()) - 1.0).abs() < 1e-15,
                "patch {patch} at {t}: {x} {y}"
            );
        }
    }
    // Coordinate by coordinate says the same.
    let (head, tail) = text.split_once("Ordering: 1").expect("there");
    let numbers: Vec<_> = tail.split_whitespace().collect();
    let by_axis = |axis: usize| {
        numbers
            .iter()
            .skip(axis)
            .step_by(2)
            .copied()
            .collect::<Vec<_>>()
            .join(" ")
    };
    let turned = format!("{head}Ordering: 0\n{}\n{}", by_axis(0), by_axis(1));
    assert_eq!(
        mfem::read(&turned).expect("well formed").splines,
        reading.splines
    );
}

/// A block of cubes with the points of each axis on a lattice, every cube in a frame of its own.
struct Block {
    /// Slabs along each axis.
    slabs: [usize; 3],
    /// Knot vectors of each axis and slab, along the axis.
    knots: [Vec<KnotVector>; 3],
    /// The number of each vertex, by its place among the slabs.
    vertices: HashMap<[usize; 3], usize>,
    cubes: Vec<Cube>,
}

/// A cube: its slab along each axis, and for each parameter its axis and whether it runs down the axis.
struct Cube {
    slab: [usize; 3],
    frame: [(usize, bool); 3],
}

const CORNERS: [[usize; 3]; 8] = [
    [0, 0, 0],
    [1, 0, 0],
    [1, 1, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [1, 1, 1],
    [0, 1, 1],
];

impl Block {
    fn new(dice: &mut Dice) -> Self {
        let slabs = [0; 3].map(|_| 1 + dice.below(3));
        // Knots that are sums of powers of two, so that reversing twice changes nothing.
        let knots = slabs.map(|n| {
            let slab = |_| {
                let degree = 1 + dice.below(3);
                let mut knots = vec![0.0; degree + 1];
                let inner = dice.below(3);
                knots.extend([0.25, 0.375].iter().take(inner));
                knots.extend(vec![1.0; degree + 1]);
                KnotVector::new(degree, knots).expect("increasing")
            };
            (0..n).map(slab).collect()
        });
        let mut places = Vec::new();
        let mut cubes = Vec::new();
        for x in 0..=slabs[0] {
            for y in 0..=slabs[1] {
                for z in 0..=slabs[2] {
                    places.push([x, y, z]);
                    if x < slabs[0] && y < slabs[1] && z < slabs[2] {
                        let mut axes = [0, 1, 2];
                        dice.shuffle(&mut axes);
                        cubes.push(Cube {
                            slab: [x, y, z],
                            frame: axes.map(|axis| (axis, dice.below(2) == 0)),
                        });
                    }
                }
            }
        }
        dice.shuffle(&mut places);
        dice.shuffle(&mut cubes);
        Self {
            slabs,
            knots,
            vertices: places
                .into_iter()
                .enumerate()
                .map(|(i, p)| (p, i))
                .collect(),
            cubes,
        }
    }

    fn count(&self, axis: usize, slab: usize) -> usize {
        self.knots[axis][slab].control_points()
    }

    /// Where a vertex is on the lattice of points.
    fn lattice(&self, place: [usize; 3]) -> [usize; 3] {
        std::array::from_fn(|axis| (0..place[axis]).map(|s| self.count(axis, s) - 1).sum())
    }

    /// Point and weight at a place of the lattice: all different.
    fn value(at: [usize; 3]) -> ([f64; 3], f64) {
        let [x, y, z] = at.map(|i| i as f64);
        let bend = (0.7 * x + 1.3 * y + 2.1 * z).sin();
        (
            [x + 0.1 * bend, y - 0.2 * bend, z + 0.05 * x],
            1.0 + 0.3 * bend,
        )
    }

    /// The place of a cube's corner among the slabs.
    fn corner(cube: &Cube, ends: [usize; 3]) -> [usize; 3] {
        let mut place = cube.slab;
        for (end, (axis, down)) in ends.into_iter().zip(cube.frame) {
            place[axis] += if down { 1 - end } else { end };
        }
        place
    }

    /// The cube itself, from the lattice and without any numbering.
    fn volume(&self, cube: &Cube) -> NurbsVolume {
        let counts = cube
            .frame
            .map(|(axis, _)| self.count(axis, cube.slab[axis]));
        let knots = cube.frame.map(|(axis, down)| {
            let along = &self.knots[axis][cube.slab[axis]];
            if down {
                along.reversed().expect("dyadic")
            } else {
                along.clone()
            }
        });
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let mut at = self.lattice(cube.slab);
                    for (step, ((axis, down), n)) in [i, j, k]
                        .into_iter()
                        .zip(cube.frame.into_iter().zip(counts))
                    {
                        at[axis] += if down { n - 1 - step } else { step };
                    }
                    let (point, weight) = Self::value(at);
                    points.push(point);
                    weights.push(weight);
                }
            }
        }
        NurbsVolume::new(knots, points, weights).expect("valid")
    }

    /// The mesh with points numbered over all of it, by walks on the lattice from vertex to vertex.
    fn text(&self, dice: &mut Dice) -> String {
        let mut out = String::from("MFEM NURBS mesh v1.0\n\ndimension\n3\n\nelements\n");
        let _ = writeln!(out, "{}", self.cubes.len());
        let ids = |cube: &Cube| CORNERS.map(|c| self.vertices[&Self::corner(cube, c)]);
        for cube in &self.cubes {
            let ids = ids(cube).map(|id| id.to_string()).join(" ");
            let _ = writeln!(out, "1 5 {ids}");
        }
        let _ = writeln!(out, "\nboundary\n0\n\nedges");
        let mut edges = Vec::new();
        let mut number = 0;
        for axis in 0..3 {
            for slab in 0..self.slabs[axis] {
                for place in self.vertices.keys().filter(|p| p[axis] == slab) {
                    let mut end = *place;
                    end[axis] += 1;
                    edges.push((number, *place, end));
                }
                number += 1;
            }
        }
        edges.sort_unstable();
        dice.shuffle(&mut edges);
        let _ = writeln!(out, "{}", edges.len());
        for (number, from, to) in &edges {
            let _ = writeln!(
                out,
                "{number} {} {}",
                self.vertices[from], self.vertices[to]
            );
        }
        let _ = writeln!(
            out,
            "\nvertices\n{}\n\nknotvectors\n{number}",
            self.vertices.len()
        );
        for knots in self.knots.iter().flatten() {
            let values = knots
                .knots()
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(" ");
            let _ = writeln!(
                out,
                "{} {} {values}",
                knots.degree(),
                knots.control_points()
            );
        }

        let mut by_number: Vec<_> = self.vertices.iter().map(|(p, id)| (id, *p)).collect();
        by_number.sort_unstable();
        let place_of: Vec<_> = by_number.into_iter().map(|(_, p)| p).collect();
        let mut order: Vec<[usize; 3]> = place_of.iter().map(|&p| self.lattice(p)).collect();
        // A walk on the lattice over all points strictly between, the first step fastest.
        let mut walk = |start: usize, ends: &[usize]| {
            let origin = self.lattice(place_of[start]);
            let ways: Vec<_> = ends
                .iter()
                .map(|&end| {
                    let end = self.lattice(place_of[end]);
                    let axis = (0..3)
                        .find(|&a| end[a] != origin[a])
                        .expect("another place");
                    (
                        axis,
                        end[axis] > origin[axis],
                        end[axis].abs_diff(origin[axis]) - 1,
                    )
                })
                .collect();
            let total: usize = ways.iter().map(|w| w.2).product();
            for step in 0..total {
                let (mut at, mut rest) = (origin, step);
                for &(axis, up, n) in &ways {
                    let by = rest % n + 1;
                    at[axis] = if up { at[axis] + by } else { at[axis] - by };
                    rest /= n;
                }
                order.push(at);
            }
        };
        for (_, from, to) in &edges {
            let (a, b) = (self.vertices[from], self.vertices[to]);
            walk(a.min(b), &[a.max(b)]);
        }
        let mut seen = Vec::new();
        for cube in &self.cubes {
            let ids = ids(cube);
            for face in [
                [3, 2, 1, 0],
                [0, 1, 5, 4],
                [1, 2, 6, 5],
                [2, 3, 7, 6],
                [3, 0, 4, 7],
                [4, 5, 6, 7],
            ] {
                let face: [usize; 4] = face.map(|c: usize| ids[c]);
                let mut key = face;
                key.sort_unstable();
                if !seen.contains(&key) {
                    seen.push(key);
                    walk(face[0], &[face[1], face[3]]);
                }
            }
        }
        for cube in &self.cubes {
            let ids = ids(cube);
            walk(ids[0], &[ids[1], ids[3], ids[4]]);
        }
        let values: Vec<_> = order.into_iter().map(Self::value).collect();
        out.push_str("\nweights\n");
        for (_, weight) in &values {
            let _ = writeln!(out, "{weight}");
        }
        out.push_str(
            "\nFiniteElementSpace\nFiniteElementCollection: NURBS\nVDim: 3\nOrdering: 1\n\n",
        );
        for ([x, y, z], _) in &values {
            let _ = writeln!(out, "{x} {y} {z}");
        }
        out
    }
}

/// The number after a section's name.
fn section(text: &str, name: &str) -> usize {
    let mut words = text.split_whitespace().skip_while(|word| *word != name);
    words
        .nth(1)
        .and_then(|word| word.parse().ok())
        .expect("a count")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn mfem_numbering_gives_the_pieces(seed in any::<u64>()) {
        let mut dice = Dice(seed);
        let block = Block::new(&mut dice);
        let text = block.text(&mut dice);
        let wanted: Vec<_> = block.cubes.iter().map(|c| Spline::Volume(block.volume(c))).collect();
        let reading = must_read(Format::Mfem, &text);
        prop_assert_eq!(&reading.splines, &wanted);

        // Written as patches, the mesh joins where the block does.
        let written = mfem::write(&wanted).expect("volumes");
        prop_assert_eq!(&must_read(Format::Mfem, &written).splines, &wanted);
        let [x, y, z] = block.slabs;
        prop_assert_eq!(section(&written, "vertices"), (x + 1) * (y + 1) * (z + 1));
        prop_assert_eq!(
            section(&written, "edges"),
            x * (y + 1) * (z + 1) + y * (x + 1) * (z + 1) + z * (x + 1) * (y + 1)
        );
        prop_assert_eq!(section(&written, "boundary"), 2 * (x * y + y * z + z * x));

        // The topology written is one that the other dialect accepts: numbers in its order are as
        // many as it wants, and the edges of every element agree about their knot vectors.
        let (head, _) = written.split_once("patches").expect("there");
        let mut names: HashMap<usize, &KnotVector> = HashMap::new();
        let mut words = head.split_whitespace().skip_while(|w| *w != "edges").skip(2);
        let edges = section(&written, "edges");
        for _ in 0..edges {
            let mut next = || words.next().and_then(|w| w.parse::<usize>().ok()).expect("a number");
            let (name, _, _) = (next(), next(), next());
            names.entry(name).or_insert(&block.knots[0][0]);
        }
        let line = "1 2 0 0 1 1\n".repeat(names.len());
        let mut trial = format!("{head}\nknotvectors {}\n{line}\nunitweights\nFiniteElementSpace\nFiniteElementCollection: NURBS1\nVDim: 3\nOrdering: 1\n", names.len());
        for i in 0..section(&written, "vertices") {
            let _ = writeln!(trial, "{i} 0 0");
        }
        prop_assert_eq!(must_read(Format::Mfem, &trial).splines.len(), wanted.len());
    }
}

#[test]
fn a_ring_of_pieces_is_joined_and_a_single_turn_is_not() {
    // Four quarters about z: the faces between them are shared.
    let turned = |times: usize| {
        let spin = |[x, y, z]: [f64; 3]| (0..times).fold([x, y, z], |[x, y, z], _| [0.0 - y, x, z]);
        let ring = quarter();
        let points = ring.control_points().iter().map(|&p| spin(p)).collect();
        NurbsVolume::new(ring.knots().clone(), points, ring.weights().to_vec()).expect("valid")
    };
    let ring: Vec<_> = (0..4).map(turned).collect();
    let text = mfem::write(&ring).expect("volumes");
    assert_eq!(
        [section(&text, "vertices"), section(&text, "edges")],
        [16, 32]
    );
    assert_eq!(section(&text, "boundary"), 16);
    // Two halves would have two edges between the same vertices.
    let half = |first: usize| {
        let (a, b) = (turned(first), turned(first + 1));
        let knots =
            KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0]).expect("valid");
        let [u, _, w] = quarter().knots().clone();
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for k in 0..2 {
            for (part, rows) in [(&a, 0..2), (&b, 0..3)] {
                let at = (k * 6 + rows.start * 2)..(k * 6 + rows.end * 2);
                points.extend_from_slice(&part.control_points()[at.clone()]);
                weights.extend_from_slice(&part.weights()[at]);
            }
        }
        NurbsVolume::new([u, knots, w], points, weights).expect("valid")
    };
    let halves = [half(0), half(2)];
    let text = mfem::write(&halves).expect("volumes");
    assert_eq!(
        [section(&text, "vertices"), section(&text, "edges")],
        [16, 24]
    );
    assert_eq!(section(&text, "boundary"), 12);
    let reading = mfem::read(&text).expect("well formed");
    assert_eq!(reading.splines, halves.map(Spline::Volume));
}

// ---- what is wrong -------------------------------------------------------------------------------

#[track_caller]
fn refused(format: Format, text: &str, wanted: &str) {
    match read_text(format, text) {
        Ok(reading) => panic!("read {} splines from {text:?}", reading.splines.len()),
        Err(error) => assert_eq!(error.to_string(), wanted, "{text}"),
    }
}

#[test]
fn g2_says_what_is_wrong_and_where() {
    let cases = [
        (
            "",
            "line 1, column 1: found the end of the text, wanted a header",
        ),
        (
            "260 1 0 0 3",
            "line 1, column 1: the object is a Cylinder, class 260; only spline curves, surfaces and volumes (100, 200, 700) are read; convert it to a spline first",
        ),
        (
            "7 1 0 0",
            "line 1, column 1: found \"7\", wanted the class number of an object: 100, 200 or 700",
        ),
        (
            "100 2 0 0",
            "line 1, column 5: major version 2; only 1 is known",
        ),
        (
            "100 1 0 0\n4 0",
            "line 2, column 1: found \"4\", wanted the dimension of the points, 2 or 3",
        ),
        (
            "100 1 0 0\n3 2",
            "line 2, column 3: found \"2\", wanted whether the spline is rational, a whole number from 0 to 1",
        ),
        (
            "100 1 0 0 3 0 2 2 0 0 1",
            "line 1, column 24: found the end of the text, wanted knot 3 of u",
        ),
        (
            "100 1 0 0 3 0\n2 2\n0 1 0 1",
            "line 2, column 3: knot vector of u: knot 2 is 0, less than the knot before it, 1",
        ),
        (
            "100 1 0 0 3 0\n2 40 0",
            "line 2, column 7: found the end of the text, wanted knot 1 of u",
        ),
        (
            "100 1 0 0 3 0\n2 2\n0 0 1 1\n0 0 0 1 nan 0",
            "line 4, column 9: found \"nan\", wanted coordinate 1 of point 1, a finite number",
        ),
        (
            "100 1 0 0 3 1\n2 2\n0 0 1 1\n0 0 0 1 0 0 0 0",
            "line 4, column 15: found \"0\", wanted the weight of point 1, finite and greater than zero",
        ),
        (
            "100 1 0 0 3 1\n2 2\n0 0 1 1\n0 0 0 -1",
            "line 4, column 7: found \"-1\", wanted the weight of point 0, finite and greater than zero",
        ),
        (
            "100 1 0 0 3 0\n2 2\n0 0 1 1\n0 0 0 1 0 0 5",
            "line 4, column 13: found \"5\", wanted the class number of an object: 100, 200 or 700",
        ),
    ];
    for (text, wanted) in cases {
        refused(Format::G2, text, wanted);
    }
    let long = format!(
        "100 1 0 0 3 0\n34 34\n{}",
        "0 ".repeat(34) + &"1 ".repeat(34)
    );
    refused(
        Format::G2,
        &long,
        "line 2, column 4: knot vector of u: degree is 33; it must be between 1 and 32",
    );
}

#[test]
fn mfem_says_what_is_wrong_and_where() {
    let head = "MFEM NURBS mesh v1.0\ndimension 2\nelements 1\n1 3 0 1 2 3\nboundary 0\n";
    let knots = "knotvectors 1\n1 2 0 0 1 1\n";
    let edges = "edges 4\n0 0 1\n0 3 2\n0 0 3\n0 1 2\nvertices 4\n";
    let cases = [
        (
            "MFEM mesh v1.0\n".to_string(),
            "line 1, column 1: \"MFEM mesh v1.0\" is no NURBS mesh; only those, MFEM NURBS mesh v1.0 and v1.1, are read",
        ),
        (
            "MFEM NURBS NC-patch mesh v1.0".into(),
            "line 1, column 1: \"MFEM NURBS NC-patch mesh v1.0\" is not read, only MFEM NURBS mesh v1.0 and v1.1",
        ),
        (
            "MFEM NURBS mesh v1.0\ndimension 4".into(),
            "line 2, column 11: found \"4\", wanted the number of parameters, a whole number from 1 to 3",
        ),
        (
            head.replace("1 3 0", "1 5 0"),
            "line 4, column 3: found \"5\", wanted the geometry of an element of dimension 2, a whole number from 3 to 3",
        ),
        (
            format!("{head}edges 0 vertices 3 patches"),
            "line 4, column 1: found vertex 3, wanted vertices below their number, 3",
        ),
        (
            format!("{}edges 0 vertices 4", head.replace("0 1 2 3", "0 1 1 3")),
            "line 4, column 1: vertex 1 occurs twice here; elements and edges with vertices in common with themselves are not read",
        ),
        (
            format!("{head}edges 0\nvertices 4\nmesh"),
            "line 8, column 1: found \"mesh\", wanted the word \"knotvectors\" or \"patches\"",
        ),
        (
            format!("{head}edges 0\nvertices 4\n{knots}weights"),
            "line 4, column 1: the edge of this element from vertex 0 to vertex 1 is not listed among the edges",
        ),
        (
            format!("{head}{}{knots}weights", edges.replace("0 3 2", "0 2 3")),
            "line 4, column 1: the edges of this element along u do not all have the same knot vector in the same direction",
        ),
        (
            format!("{head}{}{knots}weights", edges.replace("0 3 2", "7 3 2")),
            "line 8, column 1: found knot vector 7, wanted knot vectors below their number, 1",
        ),
        (
            format!("{head}{}{knots}weights", edges.replace("0 0 3", "0 1 0")),
            "line 9, column 1: a second edge joins the vertices 0 and 1",
        ),
        (
            format!("{head}{edges}{knots}periodic"),
            "line 14, column 1: boundaries that are identified (periodic) are not read; write the mesh without them",
        ),
        (
            format!("{head}{edges}{knots}weights 1 1 1 -2"),
            "line 14, column 15: found \"-2\", wanted the weight of point 3, finite and greater than zero",
        ),
        (
            format!(
                "{head}{edges}{knots}unitweights\nFiniteElementSpace\nFiniteElementCollection: H1_3D_P2"
            ),
            "line 16, column 26: found \"H1_3D_P2\", wanted a collection of NURBS, of the degree of the knot vectors",
        ),
        (
            format!(
                "{head}{edges}{knots}unitweights\nFiniteElementSpace\nFiniteElementCollection: NURBS1 VDim: 3 Ordering: 1 0 0 0 1 0 0 0 1 0 1 1"
            ),
            "line 16, column 74: found the end of the text, wanted coordinate 2 of point 3",
        ),
    ];
    for (text, wanted) in cases {
        refused(Format::Mfem, &text, wanted);
    }
    // Two cubes that meet in a face in the wrong order.
    let text = "MFEM NURBS mesh v1.0 dimension 3 elements 2
        1 5 0 1 2 3 4 5 6 7  1 5 4 5 7 6 8 9 10 11 boundary 0
        edges 21  0 0 1 0 3 2 0 4 5 0 7 6 0 0 3 0 1 2 0 4 7 0 5 6 0 0 4 0 1 5 0 2 6 0 3 7
        0 6 4 0 7 5 0 8 9 0 11 10 0 8 11 0 9 10 0 4 8 0 5 9 0 7 10 vertices 12 knotvectors 1 1 2 0 0 1 1 weights";
    let text = text.replacen("v1.0", "v1.0\n", 1);
    let wanted = "line 3, column 30: the edges of this element along u do not all have the same knot vector in the same direction";
    refused(Format::Mfem, &text, wanted);
}

#[test]
fn geomdl_says_what_is_wrong_and_where() {
    let good = r#"{"shape": {"type": "curve", "count": 1, "data": [{"degree": 1, "knotvector": [0, 0, 1, 1],
        "control_points": {"points": [[0, 0, 0], [1, 2, 3]], "weights": [1, 2]}}]}}"#;
    assert!(geomdl::read(good).is_ok());
    let cases = [
        (
            "\"curve\"",
            "\"solid\"",
            "shape.type: found \"solid\", wanted \"curve\", \"surface\" or \"volume\"",
        ),
        (
            "\"count\": 1",
            "\"count\": 2",
            "shape.count: found 2, wanted the length of the list of data, 1",
        ),
        (
            "\"degree\": 1",
            "\"degree\": 1.5",
            "shape.data[0].degree: found 1.5, wanted a whole number",
        ),
        (
            "\"degree\": 1, ",
            "",
            "shape.data[0]: found an object without it, wanted the entry \"degree\"",
        ),
        (
            "[0, 0, 1, 1]",
            "[0, 0, \"x\", 1]",
            "shape.data[0].knotvector[2]: found \"x\", wanted a number",
        ),
        (
            "[0, 0, 1, 1]",
            "[0, 1, 0, 1]",
            "shape.data[0].knotvector: knot vector: knot 2 is 0, less than the knot before it, 1",
        ),
        (
            "[1, 2, 3]",
            "[1, 2]",
            "shape.data[0].control_points.points[1]: found a list of 2, wanted a list of 3 coordinates",
        ),
        (
            "[1, 2, 3]",
            "[1, null, 3]",
            "shape.data[0].control_points.points[1]: found null, wanted coordinate 1, a number",
        ),
        (
            ", [1, 2, 3]",
            "",
            "shape.data[0].control_points.weights: found 2 weights, wanted 1, one for each point",
        ),
        (
            "\"weights\": [1, 2]",
            "\"weights\": [1, -2]",
            "shape.data[0].control_points.weights[1]: found -2, wanted a weight, finite and greater than zero",
        ),
        (
            "{\"degree\"",
            "{\"rational\": false, \"degree\"",
            "shape.data[0].control_points.weights: there are weights other than 1, yet \"rational\" is false; correct one of them",
        ),
        (
            "[1, 2, 3]",
            "[1, NaN, 3]",
            "line 2, column 54: not JSON text: expected value",
        ),
        (
            "[1, 2, 3]",
            "[1, 1e999, 3]",
            "line 2, column 58: not JSON text: number out of range",
        ),
    ];
    for (from, to, wanted) in cases {
        assert!(good.contains(from), "{from}");
        refused(Format::Geomdl, &good.replacen(from, to, 1), wanted);
    }
}

#[test]
fn gismo_says_what_is_wrong_and_where() {
    let good = "<xml><Geometry type=\"BSpline\">\n<Basis type=\"BSplineBasis\"><KnotVector degree=\"1\">0 0 1 1</KnotVector></Basis>\n<coefs geoDim=\"3\">0 0 0 1 2 3</coefs></Geometry></xml>";
    assert!(gismo::read(good).is_ok());
    let cases = [
        (
            "\"BSpline\"",
            "\"THBSpline2\"",
            "line 1, column 6: a geometry of type \"THBSpline2\"; only BSpline, Nurbs, and TensorBSpline and TensorNurbs of 2 and 3 parameters are read",
        ),
        (
            "<xml>",
            "<svg>",
            "line 1, column 1: found <svg>, wanted <xml>",
        ),
        (
            "degree=\"1\"",
            "degree=\"x\"",
            "line 2, column 28: found degree=\"x\", wanted a whole number",
        ),
        (
            "degree=\"1\"",
            "degree=\"1\" mode=\"uniform\"",
            "line 2, column 28: mode=\"uniform\"; only knot vectors with all their knots are read",
        ),
        (
            "0 0 1 1<",
            "0 0 x 1<",
            "line 2, column 55: found \"x\", wanted a knot, a finite number",
        ),
        (
            "1 2 3<",
            "1 2 <",
            "line 3, column 1: found 5 coordinates, wanted 3 for each of 2 control points",
        ),
        (
            "1 2 3<",
            "1 inf 3<",
            "line 3, column 27: found \"inf\", wanted a coordinate, a finite number",
        ),
        (
            "1 2 3<",
            "1 &#50; 3<",
            "line 3, column 19: entities or CDATA among numbers; write them as plain text",
        ),
        (
            "geoDim=\"3\"",
            "geoDim=\"3\" format=\"B64Float64\"",
            "line 3, column 1: numbers in the format \"B64Float64\"; only text (ASCII) is read",
        ),
        (
            "geoDim=\"3\"",
            "geoDim=\"1\"",
            "line 3, column 1: found geoDim=\"1\", wanted points of 2 or 3 coordinates",
        ),
        (
            "<coefs",
            "<Basis/><coefs",
            "line 3, column 1: found a second <Basis>, wanted one only",
        ),
        (
            "BSplineBasis",
            "TensorBSplineBasis2",
            "line 2, column 1: found the type \"TensorBSplineBasis2\", wanted \"BSplineBasis\"",
        ),
    ];
    for (from, to, wanted) in cases {
        assert!(good.contains(from), "{from}");
        let bad = good.replacen(from, to, 1);
        refused(
            Format::Gismo,
            &if to == "<svg>" {
                bad.replace("</xml>", "</svg>")
            } else {
                bad
            },
            wanted,
        );
    }
    for bad in [
        "",
        "<xml>",
        "<!DOCTYPE a [<!ENTITY b \"c\">]><xml>&b;</xml>",
        "<xml></xml>",
    ] {
        assert!(gismo::read(bad).is_err(), "{bad}");
    }
}

#[test]
fn counts_are_not_trusted_with_memory() {
    let huge = i64::MAX;
    let cases = [
        (Format::G2, format!("100 1 0 {huge} 0")),
        (Format::G2, format!("100 1 0 0 3 0 {huge} 2 0 0 1 1")),
        (Format::G2, format!("100 1 0 0 3 0 2 {huge} 0 0 1 1")),
        (
            Format::Mfem,
            format!("MFEM NURBS mesh v1.0\ndimension 3 elements {huge}"),
        ),
        (
            Format::Mfem,
            format!(
                "MFEM NURBS mesh v1.0\ndimension 3 elements 1 1 5 0 1 2 3 4 5 6 7 boundary 0 edges {huge}"
            ),
        ),
        (
            Format::Mfem,
            format!(
                "MFEM NURBS mesh v1.0\ndimension 2 elements 1 1 3 0 1 2 3 boundary 0 edges 4 0 0 1 0 3 2 0 0 3 0 1 2 vertices {huge} knotvectors 1 1 2 0 0 1 1 unitweights FiniteElementSpace FiniteElementCollection: NURBS VDim: 3 Ordering: 0 1 2 3"
            ),
        ),
        (
            Format::Mfem,
            format!(
                "MFEM NURBS mesh v1.0\ndimension 2 elements 1 1 3 0 1 2 3 boundary 0 edges 0 vertices 4 patches knotvectors 2 1 {huge} 0"
            ),
        ),
        (
            Format::Geomdl,
            format!(r#"{{"shape": {{"type": "curve", "count": {huge}, "data": [{{}}]}}}}"#),
        ),
        (
            Format::Geomdl,
            format!("{}1{}", r#"{"a":"#.repeat(100_000), "}".repeat(100_000)),
        ),
        (
            Format::Gismo,
            format!("{}{}", "<xml>".repeat(100_000), "</xml>".repeat(100_000)),
        ),
        (Format::Gismo, "<xml>".repeat(100_000)),
    ];
    for (format, text) in cases {
        let start = Instant::now();
        assert!(read_text(format, &text).is_err(), "{format}");
        assert!(start.elapsed() < Duration::from_secs(5), "{format}");
    }
    // A product of counts that the text does not hold: a hundred thousand points along each parameter.
    let n = 100_000;
    let line = format!(
        "1 {n} 0 {} {}",
        (0..n).map(|i| i.to_string()).collect::<Vec<_>>().join(" "),
        n - 1
    );
    let text = format!(
        "MFEM NURBS mesh v1.0\ndimension 3 elements 1 1 5 0 1 2 3 4 5 6 7 boundary 0 edges 0 vertices 8 patches knotvectors 3 {line} {line} {line} dimension 3 controlpoints 0 0 0 1"
    );
    assert!(mfem::read(&text).is_err());
}

/// One change to a text, at places and with characters that hurt.
fn mutated(text: &str, dice: &mut Dice) -> String {
    let mut bytes: Vec<char> = text.chars().collect();
    for _ in 0..=dice.below(3) {
        let at = dice.below(bytes.len().max(1));
        let to = (at + 1 + dice.below(12)).min(bytes.len());
        match dice.below(6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..to)),
            2 => {
                let copy = bytes[at..to].to_vec();
                bytes.splice(at..at, copy);
            }
            3 => {
                let all = [
                    '0', '9', '-', '.', 'e', ' ', '\n', '#', '<', '>', '"', '{', '[', ',', 'é',
                    '\0',
                ];
                if at < bytes.len() {
                    bytes[at] = all[dice.below(all.len())];
                }
            }
            4 => {
                let all = [
                    "99999999",
                    "-1",
                    "1e308",
                    "nan",
                    "4.9e-324",
                    "0",
                    "18446744073709551616",
                ];
                bytes.splice(at..to, all[dice.below(all.len())].chars());
            }
            _ => {
                // Words that change places.
                let joined: String = bytes.iter().collect();
                let mut words: Vec<_> = joined.split(' ').collect();
                let (a, b) = (dice.below(words.len()), dice.below(words.len()));
                words.swap(a, b);
                bytes = words.join(" ").chars().collect();
            }
        }
    }
    bytes.into_iter().collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn damaged_texts_are_read_or_refused(seed in any::<u64>()) {
        let mut dice = Dice(seed);
        let ring = [Spline::Volume(quarter())];
        let text = match dice.below(6) {
            0 => g2::write(&ring),
            1 => mfem::write(&ring).expect("a volume"),
            2 => geomdl::write(&ring).expect("a volume"),
            3 => gismo::write(&ring),
            4 => disc(),
            _ => {
                let block = Block::new(&mut dice);
                block.text(&mut dice)
            }
        };
        let text = mutated(&text, &mut dice);
        let start = Instant::now();
        for format in Format::ALL {
            match read_text(format, &text) {
                // What is read is valid, and can be written again.
                Ok(reading) if !reading.splines.is_empty() => {
                    let again = gismo::write(&reading.splines);
                    prop_assert_eq!(must_read(Format::Gismo, &again).splines, reading.splines);
                }
                Ok(_) => prop_assert!(false, "nothing read, nothing refused"),
                Err(error) => prop_assert!(error.to_string().len() < 600, "{}", error),
            }
        }
        prop_assert!(start.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn any_text_at_all(text in "\\PC{0,80}") {
        for format in Format::ALL {
            prop_assert!(read_text(format, &text).is_err());
        }
    }
}

// ---- files ---------------------------------------------------------------------------------------

#[test]
fn files_are_known_by_name_and_content() {
    let folder = tempfile::tempdir().expect("a folder");
    let ring = [quarter()];
    for name in ["ring.g2", "ring.mesh", "ring.json", "RING.XML"] {
        let path = folder.path().join(name);
        exchange::write_volumes(&path, &ring).expect(name);
        let found = exchange::read_volumes(&path).expect(name);
        check_quarter(&found[0], 1e-14);
        let error = exchange::read_surfaces(&path).expect_err(name).to_string();
        assert!(error.ends_with("spline 0: found a volume, wanted a surface; read every kind at once, or split the file"), "{error}");
        // Under another name the content tells, and a note says so.
        let other = folder.path().join("ring.dat");
        std::fs::copy(&path, &other).expect("a copy");
        let reading = exchange::read(&other).expect(name);
        assert_eq!(reading.splines, [Spline::Volume(found[0].clone())]);
        assert!(
            reading.notes[0].contains("the content is taken as"),
            "{:?}",
            reading.notes
        );
        // Under the name of another format it is refused.
        let wrong = folder.path().join(if name == "ring.json" {
            "other.g2"
        } else {
            "other.json"
        });
        std::fs::copy(&path, &wrong).expect("a copy");
        let error = exchange::read(&wrong).expect_err(name).to_string();
        assert!(error.contains("rename the file"), "{error}");
        // A mark in front is no content.
        let text = std::fs::read_to_string(&path).expect("text");
        std::fs::write(&path, format!("\u{feff}{text}")).expect("room");
        assert_eq!(exchange::read_volumes(&path).expect(name), found);
    }
    let surface = Dice(1).tensor::<2>(true, true);
    let curve = Dice(2).curve(true, true);
    exchange::write_surfaces(folder.path().join("s.json"), std::slice::from_ref(&surface))
        .expect("room");
    exchange::write_curves(folder.path().join("c.xml"), std::slice::from_ref(&curve))
        .expect("room");
    assert_eq!(
        exchange::read_surfaces(folder.path().join("s.json")).expect("there"),
        [surface]
    );
    assert_eq!(
        exchange::read_curves(folder.path().join("c.xml")).expect("there"),
        [curve]
    );
}

#[test]
fn files_that_cannot_be() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let write = |name: &str, bytes: &[u8]| std::fs::write(path(name), bytes).expect("room");
    write("a.g2", &[0x1f, 0x8b, 8, 0]);
    write("b.g2", b"100 1 0 0\n3 0\n\xff\xfe");
    write("c.step", b"ISO-10303-21;");
    write("d.g2", b"");
    write("e.g2", b"100 1 0 0\n3 0\n2 2\n0 0 1 1\n0 0 0\n1 x 0\n");
    let cases = [
        (
            "a.g2",
            "a.g2: line 1, column 1: the file is compressed by gzip; decompress it first",
        ),
        (
            "b.g2",
            "b.g2: line 3, column 1: found bytes that are no UTF-8 text, wanted a text file",
        ),
        (
            "c.step",
            "c.step: cannot tell the format: the name ends in .step; the name must end in .g2, .mesh, .json or .xml, and the content must agree",
        ),
        (
            "d.g2",
            "d.g2: line 1, column 1: found the end of the text, wanted a header",
        ),
        (
            "e.g2",
            "e.g2: line 6, column 3: found \"x\", wanted coordinate 1 of point 1, a finite number",
        ),
    ];
    for (name, wanted) in cases {
        let error = exchange::read(path(name)).expect_err(name).to_string();
        assert_eq!(error, format!("{}/{wanted}", folder.path().display()));
    }
    assert!(matches!(
        exchange::read(path("none.g2")),
        Err(ExchangeError::Io(_))
    ));
    assert!(matches!(
        exchange::read(folder.path()),
        Err(ExchangeError::Io(_))
    ));

    // Nothing is left of a file that could not be written, and what was there stays.
    let mixed = [
        Spline::Volume(quarter()),
        Spline::Curve(Dice(3).curve(true, false)),
    ];
    for name in ["m.json", "m.mesh"] {
        write(name, b"old");
        let error = exchange::write(path(name), &mixed)
            .expect_err(name)
            .to_string();
        assert!(
            error.contains("it is a curve and the first is a volume"),
            "{error}"
        );
        assert_eq!(std::fs::read(path(name)).expect("there"), b"old");
    }
    exchange::write(path("m.g2"), &mixed).expect("g2 holds any kinds");
    let loose = Dice(4).tensor::<2>(false, false);
    let error = exchange::write_surfaces(path("l.mesh"), &[loose])
        .expect_err("not clamped")
        .to_string();
    assert!(error.contains("not all clamped"), "{error}");
    assert!(!path("l.mesh").exists());
    assert!(exchange::write_volumes(path("n.g2"), &[]).is_err());
    assert!(exchange::write_volumes(path("n.stl"), &[quarter()]).is_err());
    assert!(exchange::write_volumes(path("no/such/folder.g2"), &[quarter()]).is_err());
}
