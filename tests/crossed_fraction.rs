//! Fractions of voxels that several solids cross, against integrals of chords that share no code with the library:
//! implicit formulas of plain shapes, zeros of their polynomials along a line by the zeros of their derivatives, and
//! halving of both integrals until nothing changes.

mod support;

use glam::DVec3;
use rayon::prelude::*;
use std::fmt::Write;
use support::sampling::Random;
use voxlathe::Scene;
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

/// A shape about the z axis of its own frame.
#[derive(Debug, Clone, Copy)]
enum Shape {
    /// Radius and height, from z = 0.
    Cylinder(f64, f64),
    /// Radii below and above, height.
    Cone(f64, f64, f64),
    Sphere(f64),
    /// Radii of the ring and of its section.
    Torus(f64, f64),
    Ellipsoid([f64; 3]),
    Block([f64; 3]),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operation {
    Add,
    Subtract,
    Intersect,
}

/// A shape with its turn in degrees, rotated about an axis, then moved.
#[derive(Debug, Clone, Copy)]
struct Solid {
    shape: Shape,
    turn: Option<[f64; 2]>,
    axis: [f64; 3],
    degrees: f64,
    by: [f64; 3],
    operation: Operation,
}

fn solid(shape: Shape) -> Solid {
    Solid {
        shape,
        turn: None,
        axis: [0.0, 0.0, 1.0],
        degrees: 0.0,
        by: [0.0; 3],
        operation: Operation::Add,
    }
}

impl Solid {
    fn rotated(mut self, axis: [f64; 3], degrees: f64) -> Self {
        (self.axis, self.degrees) = (axis, degrees);
        self
    }

    fn at(mut self, x: f64, y: f64, z: f64) -> Self {
        self.by = [x, y, z];
        self
    }

    fn turned(mut self, start: f64, angle: f64) -> Self {
        self.turn = Some([start, angle]);
        self
    }

    fn cut(mut self) -> Self {
        self.operation = Operation::Subtract;
        self
    }

    fn common(mut self) -> Self {
        self.operation = Operation::Intersect;
        self
    }

    fn text(&self) -> String {
        let shape = match self.shape {
            Shape::Cylinder(r, h) => format!("kind = 'cylinder'\nradius = {r:?}\nheight = {h:?}"),
            Shape::Cone(a, b, h) => {
                format!("kind = 'cone'\nradius1 = {a:?}\nradius2 = {b:?}\nheight = {h:?}")
            }
            Shape::Sphere(r) => format!("kind = 'sphere'\nradius = {r:?}"),
            Shape::Torus(a, b) => format!("kind = 'torus'\nmajor = {a:?}\nminor = {b:?}"),
            Shape::Ellipsoid(r) => format!("kind = 'ellipsoid'\nradii = {r:?}"),
            Shape::Block(s) => format!("kind = 'box'\nsize = {s:?}"),
        };
        let turn = self.turn.map_or(String::new(), |[start, angle]| {
            format!("start = {start:?}\nangle = {angle:?}\n")
        });
        let operation = match self.operation {
            Operation::Add => "add",
            Operation::Subtract => "subtract",
            Operation::Intersect => "intersect",
        };
        format!(
            "[[solid]]\n{shape}\n{turn}operation = '{operation}'\nplace = [{{ rotate = {{ axis = {:?}, degrees = {:?} }} \
             }}, {{ translate = {:?} }}]\n",
            self.axis, self.degrees, self.by
        )
    }

    /// A world vector in the solid's frame (Rodrigues).
    fn turned_back(&self, v: DVec3) -> DVec3 {
        let k = DVec3::from_array(self.axis).normalize();
        let (sin, cos) = (-self.degrees).to_radians().sin_cos();
        v * cos + k.cross(v) * sin + k * (k.dot(v) * (1.0 - cos))
    }

    fn contains(&self, p: DVec3) -> bool {
        let p = self.turned_back(p - DVec3::from_array(self.by));
        let rho = p.x.hypot(p.y);
        let inside = match self.shape {
            Shape::Cylinder(r, h) => rho <= r && p.z >= 0.0 && p.z <= h,
            Shape::Cone(a, b, h) => rho <= a + (b - a) * p.z / h && p.z >= 0.0 && p.z <= h,
            Shape::Sphere(r) => p.length() <= r,
            Shape::Torus(a, b) => (rho - a).hypot(p.z) <= b,
            Shape::Ellipsoid(r) => (p / DVec3::from_array(r)).length() <= 1.0,
            Shape::Block(s) => (p.abs() * 2.0).cmple(DVec3::from_array(s)).all(),
        };
        inside
            && self.turn.is_none_or(|[start, angle]| {
                (p.y.atan2(p.x).to_degrees() - start).rem_euclid(360.0) <= angle
            })
    }

    /// Adds the parameters at which the line `p + t d` meets the planes and the surface.
    fn cuts(&self, p: DVec3, d: DVec3, out: &mut Vec<f64>) {
        let (p, d) = (
            self.turned_back(p - DVec3::from_array(self.by)),
            self.turned_back(d),
        );
        let mut plane = |height: f64, slope: f64| out.push(-height / slope);
        if let Some([start, angle]) = self.turn {
            for degrees in [start, start + angle] {
                let (s, c) = degrees.to_radians().sin_cos();
                plane(c * p.y - s * p.x, c * d.y - s * d.x);
            }
        }
        let line = |a: f64, b: f64| vec![a, b];
        let (x, y, z) = (line(p.x, d.x), line(p.y, d.y), line(p.z, d.z));
        let flat = sum(&product(&x, &x), &product(&y, &y), 1.0);
        let polynomial = match self.shape {
            Shape::Cylinder(r, h) => {
                plane(p.z, d.z);
                plane(p.z - h, d.z);
                sum(&flat, &[r * r], -1.0)
            }
            Shape::Cone(a, b, h) => {
                plane(p.z, d.z);
                plane(p.z - h, d.z);
                let k = (b - a) / h;
                let radius = line(a + k * p.z, k * d.z);
                sum(&flat, &product(&radius, &radius), -1.0)
            }
            Shape::Sphere(r) => sum(&sum(&flat, &product(&z, &z), 1.0), &[r * r], -1.0),
            Shape::Torus(a, b) => {
                let square = sum(&flat, &product(&z, &z), 1.0);
                let inner = sum(&square, &[a * a - b * b], 1.0);
                sum(&product(&inner, &inner), &flat, -4.0 * a * a)
            }
            Shape::Ellipsoid(r) => {
                let squares = [x, y, z].map(|c| product(&c, &c));
                (0..3).fold(vec![-1.0], |all, i| {
                    sum(&all, &squares[i], 1.0 / (r[i] * r[i]))
                })
            }
            Shape::Block(s) => {
                for i in 0..3 {
                    plane(p[i] - 0.5 * s[i], d[i]);
                    plane(p[i] + 0.5 * s[i], d[i]);
                }
                return;
            }
        };
        out.extend(zeros(&polynomial));
    }
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            c[i + j] += x * y;
        }
    }
    c
}

/// `a + k b`.
fn sum(a: &[f64], b: &[f64], k: f64) -> Vec<f64> {
    let at = |v: &[f64], i: usize| v.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len()))
        .map(|i| at(a, i) + k * at(b, i))
        .collect()
}

/// Zeros in [0, 1] of a polynomial, ascending powers: between those of its derivative it rises or falls.
fn zeros(c: &[f64]) -> Vec<f64> {
    if c.len() < 2 {
        return Vec::new();
    }
    let value = |t: f64| c.iter().rev().fold(0.0, |v, k| v * t + k);
    let derivative: Vec<f64> = (1..c.len()).map(|i| c[i] * i as f64).collect();
    let mut ends = vec![0.0];
    ends.extend(zeros(&derivative));
    ends.push(1.0);
    let mut found = Vec::new();
    for pair in ends.windows(2) {
        let (mut a, mut b) = (pair[0], pair[1]);
        if (value(a) < 0.0) == (value(b) < 0.0) {
            continue;
        }
        let falling = value(a) > 0.0;
        while b - a > 1e-17 + 2e-16 * b {
            let m = 0.5 * (a + b);
            if m <= a || m >= b {
                break;
            }
            if (value(m) > 0.0) == falling {
                a = m;
            } else {
                b = m;
            }
        }
        found.push(0.5 * (a + b));
    }
    found
}

/// A named list of solids.
struct Case {
    name: &'static str,
    solids: Vec<Solid>,
    scene: Scene,
}

impl Case {
    fn new(name: &'static str, solids: Vec<Solid>) -> Self {
        let mut text = String::from("schema = 1\n");
        for solid in &solids {
            write!(text, "{}", solid.text()).expect("text");
        }
        let scene = Scene::parse(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        Self {
            name,
            solids,
            scene,
        }
    }

    fn contains(&self, p: DVec3) -> bool {
        self.solids
            .iter()
            .fold(false, |inside, s| match s.operation {
                Operation::Add => inside || s.contains(p),
                Operation::Subtract => inside && !s.contains(p),
                Operation::Intersect => inside && s.contains(p),
            })
    }

    /// The share of the segment from `p` to `p + d` inside.
    fn chord(&self, p: DVec3, d: DVec3) -> f64 {
        let mut cuts = vec![0.0, 1.0];
        for solid in &self.solids {
            solid.cuts(p, d, &mut cuts);
        }
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.sort_by(f64::total_cmp);
        let inside = cuts
            .windows(2)
            .filter(|w| w[1] > w[0] && self.contains(p + d * (0.5 * (w[0] + w[1]))));
        inside.map(|w| w[1] - w[0]).sum()
    }

    /// The share of a voxel, along the axes in an order.
    fn share(&self, low: DVec3, sides: DVec3, [a, b, c]: [usize; 3], tolerance: f64) -> f64 {
        let mut run = DVec3::ZERO;
        run[a] = sides[a];
        let plane = |w: f64| {
            let row = |v: f64| {
                let mut p = low;
                p[b] += sides[b] * v;
                p[c] += sides[c] * w;
                self.chord(p, run)
            };
            integral(&row, tolerance / 8.0)
        };
        integral(&plane, tolerance)
    }

    /// A voxel that at least two of the solids cross, as far as points tell.
    fn voxel(&self, random: &mut Random) -> (DVec3, DVec3) {
        let bounds = self.scene.bounds();
        loop {
            let size = bounds.longest_side() * 10_f64.powf(random.between(-2.0, -0.5));
            let sides = DVec3::from_array([0; 3].map(|_| size * random.between(0.7, 1.3)));
            let at = |i: usize, random: &mut Random| {
                random.between(
                    bounds.min[i] - 0.5 * sides[i],
                    bounds.max[i] - 0.5 * sides[i],
                )
            };
            let low = DVec3::new(at(0, random), at(1, random), at(2, random));
            let crossing = self.solids.iter().filter(|s| {
                let mut seen = [false; 2];
                for n in 0..27 {
                    let share =
                        DVec3::new((n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64) * 0.5;
                    seen[usize::from(s.contains(low + sides * share))] = true;
                }
                seen == [true; 2]
            });
            if crossing.count() >= 2 {
                return (low, sides);
            }
        }
    }
}

/// Ten points of Gauss.
fn gauss(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    const NODES: [f64; 5] = [
        0.148_874_338_981_631_22,
        0.433_395_394_129_247_2,
        0.679_409_568_299_024_4,
        0.865_063_366_688_984_5,
        0.973_906_528_517_171_7,
    ];
    const WEIGHTS: [f64; 5] = [
        0.295_524_224_714_752_87,
        0.269_266_719_309_996_35,
        0.219_086_362_515_982_04,
        0.149_451_349_150_580_6,
        0.066_671_344_308_688_14,
    ];
    let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
    let pairs = NODES.iter().zip(WEIGHTS);
    h * pairs
        .map(|(x, w)| w * (f(m - h * x) + f(m + h * x)))
        .sum::<f64>()
}

/// The integral over [0, 1], halved where halves differ from the whole; the first parts are uneven, so that no symmetry
/// hides anything.
fn integral(f: &impl Fn(f64) -> f64, tolerance: f64) -> f64 {
    fn halved(
        f: &impl Fn(f64) -> f64,
        a: f64,
        b: f64,
        whole: f64,
        tolerance: f64,
        depth: u32,
    ) -> f64 {
        let m = 0.5 * (a + b);
        let (left, right) = (gauss(f, a, m), gauss(f, m, b));
        if (left + right - whole).abs() <= tolerance * (b - a).sqrt() || depth == 0 {
            return left + right;
        }
        halved(f, a, m, left, tolerance, depth - 1) + halved(f, m, b, right, tolerance, depth - 1)
    }
    let ends = [0.0, 0.177, 0.431, 0.712, 1.0];
    let parts = ends.windows(2).map(|w| {
        let whole = gauss(f, w[0], w[1]);
        halved(f, w[0], w[1], whole, tolerance, 40)
    });
    parts.sum()
}

/// Composites of every family.
fn cases() -> Vec<Case> {
    use Shape::{Block, Cone, Cylinder, Ellipsoid, Sphere, Torus};
    let x = [1.0, 0.0, 0.0];
    let y = [0.0, 1.0, 0.0];
    vec![
        Case::new(
            "steinmetz",
            vec![
                solid(Cylinder(1.0, 3.0)).at(0.0, 0.0, -1.5),
                solid(Cylinder(1.0, 3.0))
                    .rotated(y, 90.0)
                    .at(-1.5, 0.0, 0.0)
                    .common(),
            ],
        ),
        Case::new(
            "three bars",
            vec![
                solid(Cylinder(1.0, 3.0)).at(0.0, 0.0, -1.5),
                solid(Cylinder(1.0, 3.0))
                    .rotated(y, 90.0)
                    .at(-1.5, 0.0, 0.0)
                    .common(),
                solid(Cylinder(1.0, 3.0))
                    .rotated(x, 90.0)
                    .at(0.0, 1.5, 0.0)
                    .common(),
            ],
        ),
        Case::new(
            "plate with a hole and a boss on it",
            vec![
                solid(Cylinder(4.0, 0.5)),
                solid(Cylinder(0.375, 0.5)).at(3.0, 0.25, 0.0).cut(),
                solid(Cylinder(1.0, 1.0)).at(0.5, 0.25, 0.5),
                solid(Cylinder(0.25, 4.0))
                    .rotated([1.0, 2.0, 0.5], 40.0)
                    .at(0.5, 0.5, -0.5)
                    .cut(),
            ],
        ),
        Case::new(
            "balls and rings",
            vec![
                solid(Sphere(2.0)),
                solid(Sphere(1.5)).at(1.5, 0.5, 0.25).cut(),
                solid(Torus(2.0, 0.5)).at(0.25, 0.0, 0.5),
                solid(Torus(1.5, 0.75)).rotated(x, 90.0).at(0.0, 0.0, 1.0),
            ],
        ),
        Case::new(
            "slanted rings",
            vec![
                solid(Torus(2.0, 0.75)),
                solid(Torus(2.0, 0.5))
                    .rotated([1.0, 0.5, 0.0], 50.0)
                    .at(0.5, 0.25, 0.125),
                solid(Cone(1.5, 0.25, 3.0))
                    .rotated([0.0, 1.0, 1.0], 70.0)
                    .at(0.0, 0.25, 0.0)
                    .cut(),
            ],
        ),
        Case::new(
            "cones",
            vec![
                solid(Cone(2.0, 0.0, 3.0)),
                solid(Cone(1.0, 0.5, 2.0)).at(0.5, 0.5, 0.0).cut(),
                solid(Cone(2.0, 0.0, 3.0))
                    .rotated(y, 90.0)
                    .at(-1.0, 0.0, 0.5),
            ],
        ),
        Case::new(
            "a block, an ellipsoid and a bore",
            vec![
                solid(Block([4.0, 3.0, 2.0])),
                solid(Ellipsoid([1.5, 1.25, 1.0])).at(0.5, 0.25, 1.0).cut(),
                solid(Cylinder(0.5, 4.0)).at(-1.25, 0.125, -2.0).cut(),
            ],
        ),
        Case::new(
            "a slanted block in an ellipsoid",
            vec![
                solid(Block([4.0, 2.0, 1.5])).rotated([1.0, 2.0, 3.0], 50.0),
                solid(Ellipsoid([1.5, 1.25, 1.0]))
                    .rotated([3.0, -1.0, 1.0], 30.0)
                    .at(0.5, 0.25, 0.25)
                    .common(),
                solid(Cylinder(0.5, 4.0))
                    .rotated([1.0, 1.0, 0.0], 30.0)
                    .at(0.0, 0.0, -2.0)
                    .cut(),
            ],
        ),
        Case::new(
            "wedges",
            vec![
                solid(Cylinder(2.0, 2.0)).turned(0.0, 200.0),
                solid(Torus(1.5, 0.5)).turned(30.0, 100.0).at(0.0, 0.0, 2.0),
                solid(Sphere(1.0))
                    .turned(45.0, 270.0)
                    .rotated(x, 90.0)
                    .at(0.5, 0.75, 0.25)
                    .cut(),
            ],
        ),
    ]
}

fn found(case: &Case, low: DVec3, sides: DVec3, error: f64) -> f64 {
    let grid = GridSpec::new([1; 3], low, sides).expect("a voxel");
    let selection = Selection {
        fraction_error: Some(error),
        ..Selection::of(&[Channel::Fraction], None)
    };
    let mut buffers = LayerBuffers::default();
    LayerSampler::new(case.scene.assembly(), &grid, selection).sample(0, &mut buffers);
    buffers.fraction_sum
}

/// Random voxels at an error, and what the largest difference was.
fn voxels(each: usize, error: f64, tolerance: f64) {
    let failures: Vec<String> = cases()
        .into_iter()
        .flat_map(|case| {
            let mut random = Random::new(26);
            let asked: Vec<(DVec3, DVec3, usize)> = (0..each)
                .map(|_| {
                    let (low, sides) = case.voxel(&mut random);
                    (low, sides, random.below(3))
                })
                .collect();
            let start = std::time::Instant::now();
            let shares: Vec<f64> = asked
                .iter()
                .map(|&(low, sides, _)| found(&case, low, sides, error))
                .collect();
            let took = start.elapsed() / u32::try_from(each).expect("few");
            let wrong: Vec<(f64, String)> = asked
                .into_par_iter()
                .zip(shares)
                .map(|((low, sides, turn), share)| {
                    let order = [turn, (turn + 1) % 3, (turn + 2) % 3];
                    let wanted = case.share(low, sides, order, tolerance);
                    let off = (share - wanted).abs();
                    let text = format!("{}: voxel at {low}, sides {sides}: {share}, wanted {wanted}, off by {off:e}", case.name);
                    (off, text)
                })
                .collect();
            let worst = wrong.iter().fold(0.0_f64, |m, w| m.max(w.0));
            eprintln!("{:40} {each} voxels at {error:e}: off by {worst:.1e} at most, {took:.1?} each", case.name);
            wrong.into_iter().filter(move |w| w.0 > error).map(|w| w.1)
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Of two crossing cylinders planes normal to both axes cut rectangles: one integral is left.
#[test]
fn voxels_of_two_crossing_cylinders_are_integrals_of_rectangles() {
    let case = &cases()[0];
    let mut random = Random::new(27);
    for error in [1e-6, 1e-9, 1e-12] {
        let mut worst = 0.0_f64;
        for _ in 0..100 {
            let (low, sides) = case.voxel(&mut random);
            let area = |v: f64| {
                let y = low.y + sides.y * v;
                let half = (1.0 - y * y).max(0.0).sqrt();
                let share = |i: usize| {
                    let (from, to) = (low[i].max(-half), (low[i] + sides[i]).min(half));
                    (to - from).max(0.0) / sides[i]
                };
                share(0) * share(2)
            };
            // Where a side of the voxel, or nothing, begins to be what is left: in between the integrand is smooth but
            // for square roots at y = 1 and -1, which the substitution takes.
            let mut cuts = vec![0.0, 1.0];
            for x in [low.x, low.z, low.x + sides.x, low.z + sides.z, 0.0] {
                let y = (1.0 - x * x).max(0.0).sqrt();
                cuts.extend([(y - low.y) / sides.y, (-y - low.y) / sides.y]);
            }
            cuts.retain(|v| (0.0..=1.0).contains(v));
            cuts.sort_by(f64::total_cmp);
            let wanted: f64 = cuts
                .windows(2)
                .map(|w| {
                    let width = w[1] - w[0];
                    let smooth = |u: f64| {
                        area(w[0] + width * u * u * (3.0 - 2.0 * u)) * width * 6.0 * u * (1.0 - u)
                    };
                    (0..8)
                        .map(|k| gauss(&smooth, f64::from(k) / 8.0, f64::from(k + 1) / 8.0))
                        .sum::<f64>()
                })
                .sum();
            let found = found(case, low, sides, error);
            let off = (found - wanted).abs();
            worst = worst.max(off);
            assert!(
                off <= error,
                "{error:e}: voxel at {low}, sides {sides}: {found}, wanted {wanted}, off by {off:e}"
            );
        }
        eprintln!("two crossing cylinders at {error:e}: off by {worst:.1e} at most");
    }
}

/// How many of them, where `VOXLATHE_POINTS` does not say.
fn many() -> usize {
    let points = std::env::var("VOXLATHE_POINTS");
    points.map_or(10_000, |n| n.parse().expect("a number"))
}

#[test]
#[ignore = "minutes long: run in release"]
fn many_voxels_that_several_solids_cross_are_integrals_of_chords() {
    for (error, tolerance) in [(1e-6, 1e-9), (1e-9, 1e-12), (1e-12, 3e-14)] {
        voxels(many(), error, tolerance);
    }
}
