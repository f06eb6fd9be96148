//! Composites of plain shapes: their text, and what is expected of them.
//!
//! A composite is a list of shapes with operations. Its text goes to the library; each shape alone
//! goes to the library as a scene of one solid (for distances to its surface) and to the oracle (for
//! exact membership); [`super::faces`] has the same shapes as implicit faces.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::scene::{SceneFormat, parse_model};

use super::faces::Model;
use super::oracle::{Big, Oracle, big};
use super::sampling::{Random, hard, uniform};

/// What a shape does to those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Op {
    /// Union.
    Add,
    /// Difference.
    Subtract,
    /// Intersection.
    Intersect,
}

/// Meridian of a shape, in its own lengths.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Profile {
    /// Radius and two heights.
    Cylinder(f64, f64, f64),
    /// Radius and height of the centre.
    Ball(f64, f64),
    /// Radius and height of the lower end, then of the upper one.
    Frustum(f64, f64, f64, f64),
    /// Inner and outer radius and two heights.
    Tube(f64, f64, f64, f64),
    /// Radius of the ring, of its section, and height.
    Torus(f64, f64, f64),
    /// Keys of the profile: no implicit faces.
    Text(&'static str),
}

/// A step of `place`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    /// Factor.
    Scale(f64),
    /// Axis and degrees.
    Rotate([f64; 3], f64),
    /// By.
    Translate([f64; 3]),
}

/// One solid of a composite.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) op: Op,
    pub(crate) profile: Profile,
    pub(crate) start: f64,
    pub(crate) angle: f64,
    pub(crate) origin: [f64; 3],
    pub(crate) direction: [f64; 3],
    pub(crate) steps: Vec<Step>,
}

fn item(profile: Profile) -> Item {
    Item {
        op: Op::Add,
        profile,
        start: 0.0,
        angle: 360.0,
        origin: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
        steps: Vec::new(),
    }
}

/// A cylinder.
pub(crate) fn cylinder(r: f64, z0: f64, z1: f64) -> Item {
    item(Profile::Cylinder(r, z0, z1))
}

/// A ball about the origin of its axis.
pub(crate) fn ball(r: f64) -> Item {
    item(Profile::Ball(r, 0.0))
}

/// A cone without its tip, or with it.
pub(crate) fn frustum(r0: f64, z0: f64, r1: f64, z1: f64) -> Item {
    item(Profile::Frustum(r0, z0, r1, z1))
}

/// A thick pipe.
pub(crate) fn tube(r0: f64, r1: f64, z0: f64, z1: f64) -> Item {
    item(Profile::Tube(r0, r1, z0, z1))
}

/// A ring.
pub(crate) fn torus(major: f64, minor: f64) -> Item {
    item(Profile::Torus(major, minor, 0.0))
}

/// Any profile.
pub(crate) fn other(keys: &'static str) -> Item {
    item(Profile::Text(keys))
}

impl Item {
    /// The origin of the axis.
    pub(crate) fn at(mut self, x: f64, y: f64, z: f64) -> Self {
        self.origin = [x, y, z];
        self
    }

    /// The direction of the axis.
    pub(crate) fn along(mut self, x: f64, y: f64, z: f64) -> Self {
        self.direction = [x, y, z];
        self
    }

    /// Start and angle of the turn.
    pub(crate) fn turn(mut self, start: f64, angle: f64) -> Self {
        (self.start, self.angle) = (start, angle);
        self
    }

    /// Another step of its place.
    pub(crate) fn step(mut self, step: Step) -> Self {
        self.steps.push(step);
        self
    }

    /// Taken away.
    pub(crate) fn cut(mut self) -> Self {
        self.op = Op::Subtract;
        self
    }

    /// Kept in common.
    pub(crate) fn common(mut self) -> Self {
        self.op = Op::Intersect;
        self
    }

    fn profile_text(&self) -> String {
        let line = |points: &[[f64; 2]]| {
            format!("curves = [{{ kind = 'polyline', points = {points:?} }}]")
        };
        let chain = |points: &[[f64; 2]]| format!("boundary = 'to-axis'\n{}", line(points));
        match self.profile {
            Profile::Cylinder(r, z0, z1) => chain(&[[r, z0], [r, z1]]),
            Profile::Ball(r, z) => format!(
                "boundary = 'to-axis'\ncurves = [{{ kind = 'arc', center = [0, {z:?}], radius = {r:?}, \
                 from = -90, to = 90 }}]"
            ),
            Profile::Frustum(r0, z0, r1, z1) => chain(&[[r0, z0], [r1, z1]]),
            Profile::Tube(r0, r1, z0, z1) => {
                line(&[[r0, z0], [r1, z0], [r1, z1], [r0, z1], [r0, z0]])
            }
            Profile::Torus(a, b, z) => {
                format!("curves = [{{ kind = 'circle', center = [{a:?}, {z:?}], radius = {b:?} }}]")
            }
            Profile::Text(keys) => keys.to_owned(),
        }
    }

    fn solid_text(&self, profile: usize, material: usize, op: Op) -> String {
        let steps: Vec<String> = self
            .steps
            .iter()
            .map(|step| match step {
                Step::Scale(k) => format!("{{ scale = {k:?} }}"),
                Step::Rotate(axis, degrees) => {
                    format!("{{ rotate = {{ axis = {axis:?}, degrees = {degrees:?} }} }}")
                }
                Step::Translate(by) => format!("{{ translate = {by:?} }}"),
            })
            .collect();
        let op = match op {
            Op::Add => "add",
            Op::Subtract => "subtract",
            Op::Intersect => "intersect",
        };
        format!(
            "[[solid]]\nkind = 'revolve'\nprofile = 'p{profile}'\nstart = {:?}\nangle = {:?}\n\
             axis = {{ origin = {:?}, direction = {:?} }}\nplace = [{}]\noperation = '{op}'\n\
             material = {material}\n",
            self.start,
            self.angle,
            self.origin,
            self.direction,
            steps.join(", "),
        )
    }
}

/// A named list of shapes.
#[derive(Debug, Clone)]
pub(crate) struct Composite {
    pub(crate) name: String,
    pub(crate) items: Vec<Item>,
    /// Scale and offset of everything, beside `items`: those have them as steps already.
    pub(crate) moved: (f64, DVec3),
}

impl Composite {
    /// Shapes that stay where they are.
    pub(crate) fn new(name: &str, items: Vec<Item>) -> Self {
        Self {
            name: name.to_owned(),
            items,
            moved: (1.0, DVec3::ZERO),
        }
    }

    /// All of it scaled, then moved.
    pub(crate) fn placed(mut self, scale: f64, by: DVec3) -> Self {
        for item in &mut self.items {
            if scale != 1.0 {
                item.steps.push(Step::Scale(scale));
            }
            if by != DVec3::ZERO {
                item.steps.push(Step::Translate(by.to_array()));
            }
        }
        self.moved = (self.moved.0 * scale, self.moved.1 * scale + by);
        self.name = format!("{}, x {scale:e} by {by}", self.name);
        self
    }

    /// All of it turned.
    pub(crate) fn turned(mut self, axis: [f64; 3], degrees: f64) -> Self {
        for item in &mut self.items {
            item.steps.push(Step::Rotate(axis, degrees));
        }
        self.name = format!("{}, turned", self.name);
        self
    }

    /// The scene. Materials count from 1.
    pub(crate) fn text(&self) -> String {
        let mut text = String::from("schema = 1\n");
        for (i, item) in self.items.iter().enumerate() {
            writeln!(text, "[profiles.p{i}]\n{}", item.profile_text()).expect("text");
        }
        for (i, item) in self.items.iter().enumerate() {
            text += &item.solid_text(i, i + 1, item.op);
        }
        text
    }

    /// One shape as a scene.
    pub(crate) fn single(&self, i: usize) -> String {
        let item = &self.items[i];
        format!(
            "schema = 1\n[profiles.p0]\n{}\n{}",
            item.profile_text(),
            item.solid_text(0, 1, Op::Add)
        )
    }

    /// The state of the composite where those of its shapes are known.
    pub(crate) fn combine(&self, inside: impl Fn(usize) -> bool) -> bool {
        let mut state = false;
        for (i, item) in self.items.iter().enumerate() {
            state = match item.op {
                Op::Add => state || inside(i),
                Op::Subtract => state && !inside(i),
                Op::Intersect => state && inside(i),
            };
        }
        state
    }

    /// The material where the states of the shapes are known.
    pub(crate) fn material(&self, inside: impl Fn(usize) -> bool) -> u32 {
        let mut material = 0;
        for (i, item) in self.items.iter().enumerate() {
            match (item.op, inside(i)) {
                (Op::Add, true) => material = i as u32 + 1,
                (Op::Subtract, true) | (Op::Intersect, false) => material = 0,
                _ => {}
            }
        }
        material
    }
}

/// What membership has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Expected {
    /// Beyond the rounding band of every surface: the boolean of the single answers.
    Clear(bool),
    /// Within the band of a single surface that is no surface of the composite.
    Regular(bool),
    /// Met by the surface exactly.
    Closed,
    /// Within the rounding band of the surface of the composite.
    Either,
}

/// A composite, ready for questions.
#[derive(Debug)]
pub(crate) struct Case {
    pub(crate) composite: Composite,
    pub(crate) scene: Scene,
    pub(crate) singles: Vec<Scene>,
    pub(crate) oracle: Oracle,
    /// Implicit faces, in the lengths before [`Composite::placed`]; `None` with [`Profile::Text`].
    pub(crate) model: Option<Model>,
    /// Longest side of a single solid.
    pub(crate) size: f64,
    /// Box of all solids, taken away or not.
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
}

impl Case {
    /// Reads the texts.
    pub(crate) fn new(composite: Composite) -> Self {
        let text = composite.text();
        let scene = Scene::parse(&text).unwrap_or_else(|e| panic!("{}: {e}", composite.name));
        Self::with(composite, scene)
    }

    fn with(composite: Composite, scene: Scene) -> Self {
        let name = &composite.name;
        let singles: Vec<Scene> = (0..composite.items.len())
            .map(|i| Scene::parse(&composite.single(i)).unwrap_or_else(|e| panic!("{name}: {e}")))
            .collect();
        let model = parse_model(
            &composite.text(),
            SceneFormat::Toml,
            "composite",
            Path::new(""),
            &[],
        )
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        let sides = singles.iter().map(|s| s.bounds().longest_side());
        let low = singles.iter().map(|s| s.bounds().min);
        let high = singles.iter().map(|s| s.bounds().max);
        Self {
            size: sides.fold(0.0, f64::max),
            low: low.fold(DVec3::INFINITY, DVec3::min),
            high: high.fold(DVec3::NEG_INFINITY, DVec3::max),
            oracle: Oracle::new(&model),
            model: Model::new(&composite),
            composite,
            scene,
            singles,
        }
    }

    /// The library's answer.
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        self.scene.assembly().contains(p)
    }

    /// The library's distance, and whether it says that it is exact.
    pub(crate) fn distance(&self, p: DVec3) -> (f64, bool) {
        self.scene.assembly().signed_distance_with_certainty(p)
    }

    /// Unsigned distance to the surface of a single solid.
    pub(crate) fn single_distance(&self, i: usize, p: DVec3) -> f64 {
        self.singles[i].assembly().signed_distance(p).abs()
    }

    fn inside(&self, i: usize, p: DVec3) -> bool {
        self.oracle.solids[i].contains(p).0
    }

    /// The rounding band about a point of the composite.
    pub(crate) fn band(&self, p: DVec3) -> f64 {
        4.0 * 8.0 * f64::EPSILON * (self.size + p.length())
    }

    /// What membership has to be at a point. `directions` beyond the usual ones are looked along
    /// where the point is within the band of a single surface.
    pub(crate) fn expected(&self, p: DVec3, directions: usize, random: &mut Random) -> Expected {
        let n = self.singles.len();
        let band = self.band(p);
        let away: Vec<f64> = (0..n).map(|i| self.single_distance(i, p)).collect();
        let near: Vec<usize> = (0..n).filter(|&i| away[i] <= band).collect();
        if near.is_empty() {
            return Expected::Clear(self.composite.combine(|i| self.inside(i, p)));
        }
        let touching = match &self.model {
            Some(model) => model.touches(self.unplaced(p), 1e-9),
            None => false,
        };
        // Far enough that f64 decides, near enough that surfaces are planes.
        let reach = 1e4 * band;
        let mut known: Vec<Option<bool>> = vec![None; n];
        let mut met = [0, 0];
        let mut look = |d: DVec3| {
            let q = p + d * reach;
            let band = self.band(q);
            let mut states = vec![false; n];
            for i in 0..n {
                states[i] = if away[i] > 4.0 * reach {
                    *known[i].get_or_insert_with(|| self.inside(i, p))
                } else if self.single_distance(i, q) <= band {
                    return;
                } else {
                    self.inside(i, q)
                };
            }
            met[usize::from(self.composite.combine(|i| states[i]))] += 1;
        };
        for k in 0..27 {
            let d = DVec3::from_array([k % 3, k / 3 % 3, k / 9].map(|c| f64::from(c) - 1.0));
            if d != DVec3::ZERO {
                look(d.normalize());
            }
        }
        if let Some(model) = &self.model {
            for d in model.directions(self.unplaced(p), 1e-9) {
                look(d);
            }
        }
        for _ in 0..24 + directions {
            look(sphere(random));
        }
        match met {
            [0, 0] => Expected::Either,
            [0, _] | [_, 0] if touching => Expected::Either,
            [0, _] => Expected::Regular(true),
            [_, 0] => Expected::Regular(false),
            _ if self.closed(p, &near, random) => Expected::Closed,
            _ => Expected::Either,
        }
    }

    /// Whether the closure of the composite holds a point that all surfaces near it meet exactly.
    fn closed(&self, p: DVec3, near: &[usize], random: &mut Random) -> bool {
        let solids = &self.oracle.solids;
        let within = |share: f64| {
            let close = |&&i: &&usize| solids[i].near(p, share * self.size);
            near.iter().filter(close).copied().collect::<Vec<usize>>()
        };
        let met = within(1e-22);
        if met.is_empty() || within(1e-60) != met {
            return false;
        }
        let n = solids.len();
        let states: Vec<bool> = (0..n).map(|i| self.inside(i, p)).collect();
        let reach = big(1e-30 * self.size);
        let look = |d: DVec3| {
            let q: [Big; 3] = std::array::from_fn(|a| big(p[a]) + big(d[a]) * &reach);
            let moved: Vec<bool> = (0..n)
                .map(|i| {
                    if met.contains(&i) {
                        solids[i].contains_of(&q)
                    } else {
                        states[i]
                    }
                })
                .collect();
            self.composite.combine(|i| moved[i])
        };
        let sides = self
            .model
            .as_ref()
            .map_or_else(Vec::new, |model| model.directions(self.unplaced(p), 1e-9));
        // Tilted, so that no direction runs along a face.
        let tilt = DVec3::new(0.0123, 0.0234, -0.0345);
        sides.into_iter().any(|d| look(d + tilt)) || (0..24).any(|_| look(sphere(random)))
    }

    /// A point in the lengths of the faces.
    pub(crate) fn unplaced(&self, p: DVec3) -> DVec3 {
        let (scale, by) = self.composite.moved;
        (p - by) / scale
    }

    /// Grids around everything: one at random, one with voxel centres on the bounds, one with them on
    /// multiples of a quarter where all stands there.
    pub(crate) fn grids(&self, dims: [usize; 3]) -> Vec<GridSpec> {
        let counts = DVec3::from_array(dims.map(|n| n as f64));
        let sides = self.high - self.low;
        let spacing = sides * 1.06 / counts;
        let around = GridSpec::new(dims, self.low - sides * 0.03, spacing);
        let step = sides / (counts - 1.0);
        let bounds = GridSpec::new(dims, self.low - step * 0.5, step);
        let (scale, by) = self.composite.moved;
        let low = ((self.low - by) / scale * 4.0).floor() / 4.0 - 0.25;
        let quarter = 0.25 * scale;
        let primes = [7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
        let needed = sides / quarter + 3.0;
        let dims = [0, 1, 2].map(|a| {
            let enough = primes.iter().find(|&&n| n as f64 >= needed[a]);
            *enough.unwrap_or(&53)
        });
        let lattice = GridSpec::new(
            dims,
            low * scale + by - quarter / 2.0,
            DVec3::splat(quarter),
        );
        [around, bounds, lattice]
            .into_iter()
            .map(|grid| grid.expect("a grid"))
            .collect()
    }

    /// Points where surfaces of two solids meet, as well as f64 has them.
    pub(crate) fn meetings(&self, count: usize, random: &mut Random) -> Vec<DVec3> {
        let n = self.singles.len();
        let mut found = Vec::new();
        for _ in 0..count {
            let (i, j) = (random.below(n), random.below(n));
            if i == j {
                continue;
            }
            let mut p = hard(&self.oracle, random);
            for _ in 0..12 {
                let step = |i: usize| {
                    let h = 1e-6 * self.size;
                    let f = |d: DVec3| self.singles[i].assembly().signed_distance(p + d);
                    let g = |d: DVec3| (f(d * h) - f(-d * h)) / (2.0 * h);
                    (
                        f(DVec3::ZERO),
                        DVec3::new(g(DVec3::X), g(DVec3::Y), g(DVec3::Z)),
                    )
                };
                let ((a, u), (b, v)) = (step(i), step(j));
                let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
                let det = uu * vv - uv * uv;
                if det < 1e-3 {
                    break;
                }
                p -= u * ((a * vv - b * uv) / det) + v * ((b * uu - a * uv) / det);
            }
            let most = 16.0 * f64::EPSILON * (self.size + p.length());
            if self.single_distance(i, p) <= most && self.single_distance(j, p) <= most {
                found.push(p);
            }
        }
        found
    }

    /// A point to ask about: anywhere, near a surface, near two, on planes of caps, on axes.
    pub(crate) fn point(&self, meetings: &[DVec3], random: &mut Random) -> DVec3 {
        let p = self.any_point(meetings, random);
        // Nothing is nearer to a face than the oracle resolves, unless it is on it.
        let clear = |c: f64| if c.abs() < 1e-40 * self.size { 0.0 } else { c };
        DVec3::from_array(p.to_array().map(clear))
    }

    fn any_point(&self, meetings: &[DVec3], random: &mut Random) -> DVec3 {
        match random.below(12) {
            0 | 1 => uniform(self.low, self.high, random),
            2 | 3 => hard(&self.oracle, random),
            k @ 4..=7 if !meetings.is_empty() => {
                let p = meetings[random.below(meetings.len())];
                if k == 4 {
                    return p;
                }
                p + sphere(random) * (self.size * 10_f64.powf(random.between(-17.0, -3.0)))
            }
            8 | 9 => {
                // Coordinates of caps, rims and axes: exact where the solid stands along an axis.
                let mut p = uniform(self.low, self.high, random);
                for a in 0..3 {
                    if random.below(2) == 0 {
                        let b = self.singles[random.below(self.singles.len())].bounds();
                        p[a] = match random.below(3) {
                            0 => b.min[a],
                            1 => b.max[a],
                            _ => (b.min[a] + b.max[a]) / 2.0,
                        };
                    } else if random.below(2) == 0 {
                        // Multiples of a sixteenth.
                        let (scale, by) = self.composite.moved;
                        let steps = 16.0 * (p[a] - by[a]) / scale;
                        p[a] = steps.round() / 16.0 * scale + by[a];
                    }
                }
                p
            }
            10 => {
                // The axis of a solid, at any height or at that of another's bound.
                let solid = &self.oracle.solids[random.below(self.oracle.solids.len())];
                let reach = solid.region.extent;
                let z = solid.region.center[1] + reach * random.between(-1.2, 1.2);
                let p = solid.world([0.0, 0.0, z]);
                if random.below(2) == 0 {
                    let away = self.size * 10_f64.powf(random.between(-17.0, -6.0));
                    p + sphere(random) * away
                } else {
                    p
                }
            }
            _ => {
                // A face's own point carried onto another solid's cap: both hold it exactly.
                let p = hard(&self.oracle, random);
                let b = self.singles[random.below(self.singles.len())].bounds();
                let a = random.below(3);
                let mut p = p;
                p[a] = if random.below(2) == 0 {
                    b.min[a]
                } else {
                    b.max[a]
                };
                p
            }
        }
    }
}

/// A random direction.
pub(crate) fn sphere(random: &mut Random) -> DVec3 {
    let (z, phi) = (
        random.between(-1.0, 1.0),
        random.between(0.0, std::f64::consts::TAU),
    );
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// A plate with a hub, a bore, four holes through and one at a slant.
pub(crate) fn flange() -> Vec<Item> {
    let mut items = vec![
        cylinder(4.0, 0.0, 0.5),
        cylinder(2.0, 0.0, 2.0),
        cylinder(1.0, 0.0, 2.0).cut(),
    ];
    for (x, y) in [(3.0, 0.0), (0.0, 3.0), (-3.0, 0.0), (0.0, -3.0)] {
        items.push(cylinder(0.375, 0.0, 0.5).at(x, y, 0.0).cut());
    }
    items.push(
        cylinder(0.25, -1.0, 2.0)
            .at(2.0, 2.0, 0.25)
            .along(1.0, 1.0, 2.0)
            .cut(),
    );
    items
}

/// Shapes on a lattice of quarters, along axes and diagonals: many touch and coincide.
pub(crate) fn chain(seed: u64, length: usize) -> Composite {
    let mut random = Random::new(seed);
    let mut items = Vec::new();
    for i in 0..length {
        let random = &mut random;
        let q = |random: &mut Random, low: f64, high: f64| {
            (random.between(4.0 * low, 4.0 * high)).round() / 4.0
        };
        let (r, z) = (q(random, 0.5, 2.0), q(random, -2.0, 0.5));
        let h = q(random, 0.5, 3.0);
        let mut one = match random.below(6) {
            0 | 1 => cylinder(r, z, z + h),
            2 => ball(r),
            3 => frustum(r, z, q(random, 0.0, 1.0), z + h),
            4 => tube(r * 0.5, r, z, z + h),
            _ => torus(r + 0.5, 0.5),
        };
        one = match random.below(5) {
            0 => one.along(1.0, 0.0, 0.0),
            1 => one.along(0.0, -1.0, 0.0),
            2 => one.along(1.0, 2.0, 2.0),
            _ => one,
        };
        if random.below(4) == 0 {
            one = one.turn(
                90.0 * random.below(4) as f64,
                [90.0, 180.0, 270.0, 60.0][random.below(4)],
            );
        }
        one = one.at(
            q(random, -1.0, 1.0),
            q(random, -1.0, 1.0),
            q(random, -1.0, 1.0),
        );
        one.op = match random.below(8) {
            _ if i == 0 => Op::Add,
            0..=3 => Op::Add,
            4..=6 => Op::Subtract,
            _ => Op::Intersect,
        };
        if one.op == Op::Intersect {
            // A large one, so that something stays.
            one = ball(3.0).common().at(q(random, -1.0, 1.0), 0.0, 0.5);
        }
        items.push(one);
    }
    Composite::new(&format!("chain {seed} of {length}"), items)
}

const WAVY: &str = "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1, 0], [3, 0.5], \
                    [-0.2, 1.2], [2, 2]], weights = [1, 2, 3, 0.5] }]";
const CUP: &str = "curves = [{ kind = 'nurbs', degree = 2, points = [[0.5, 0], [1.5, 0.25], [1, 1], \
                   [2, 1.5], [1.5, 2.5]] }, { kind = 'polyline', points = [[1.5, 2.5], [1.25, 2.5], \
                   [0.5, 1.5], [0.5, 0]] }]";

/// Composites whose axes differ, or whose solids meet in every way that flat and round faces can.
pub(crate) fn composites() -> Vec<Composite> {
    let mut all = Vec::new();
    let mut add = |name: &str, items: Vec<Item>| all.push(Composite::new(name, items));
    let bar = || cylinder(1.0, -2.0, 2.0);
    add(
        "two bars crossing, common",
        vec![bar(), bar().along(1.0, 0.0, 0.0).common()],
    );
    add(
        "three bars crossing, common",
        vec![
            bar(),
            bar().along(1.0, 0.0, 0.0).common(),
            bar().along(0.0, 1.0, 0.0).common(),
        ],
    );
    add(
        "two bars crossing at a slant, united",
        vec![bar(), bar().along(1.0, 2.0, 2.0).at(0.25, 0.125, 0.5)],
    );
    add(
        "bar with a slanted hole",
        vec![
            bar(),
            cylinder(0.5, -3.0, 3.0)
                .along(2.0, 1.0, 2.0)
                .at(0.25, 0.0, 0.0)
                .cut(),
        ],
    );
    add(
        "a bite of a ball",
        vec![ball(2.0), ball(1.5).at(1.5, 0.5, 0.25).cut()],
    );
    add(
        "lens",
        vec![ball(2.0), ball(2.0).at(2.0, 0.0, 1.0).common()],
    );
    add(
        "ball less a ball that touches it from within",
        vec![ball(2.0), ball(1.0).at(1.0, 0.0, 0.0).cut()],
    );
    add(
        "ball less a ball that touches it from without",
        vec![ball(1.0), ball(1.0).at(0.0, 2.0, 0.0).cut()],
    );
    add(
        "balls that touch, united",
        vec![ball(1.0), ball(0.5).at(0.0, 0.0, 1.5)],
    );
    add("flange", flange());
    add(
        "pipe by coincident caps",
        vec![cylinder(2.0, 0.0, 3.0), cylinder(1.0, 0.0, 3.0).cut()],
    );
    add(
        "stack, a hole through it",
        vec![
            cylinder(2.0, 0.0, 1.0),
            cylinder(2.0, 1.0, 2.0),
            cylinder(1.0, 2.0, 3.0),
            cylinder(0.5, 0.0, 3.0).at(0.75, 0.25, 0.0).cut(),
        ],
    );
    add(
        "stack on parallel axes",
        vec![
            cylinder(2.0, 0.0, 1.0),
            cylinder(1.5, 0.0, 1.0).at(0.5, 0.25, 1.0),
            cylinder(0.5, 1.0, 2.0).at(-1.5, 0.0, 0.0),
        ],
    );
    add(
        "coplanar caps, pockets",
        vec![
            cylinder(2.0, 0.0, 2.0),
            cylinder(1.0, 0.0, 2.0).at(1.5, 0.0, 0.0).cut(),
            cylinder(0.5, 1.0, 2.0).at(-1.0, 0.0, 0.0).cut(),
            cylinder(0.75, 0.0, 1.0).at(-1.0, 0.25, 0.0).cut(),
        ],
    );
    let plug = || cylinder(0.75, -3.0, 3.0).along(1.0, 2.0, 2.0);
    add("cut and filled again", vec![bar(), plug().cut(), plug()]);
    add("filled and cut again", vec![bar(), plug(), plug().cut()]);
    add(
        "cut, kept and filled with the same pocket",
        vec![
            cylinder(2.0, 0.0, 2.0),
            cylinder(0.5, 1.0, 2.0).at(1.0, 0.0, 0.0).cut(),
            cylinder(0.5, 0.0, 1.0)
                .along(0.0, 0.0, -1.0)
                .at(1.0, 0.0, 2.0),
        ],
    );
    add(
        "perpendicular bars, a wall on a cap",
        vec![
            cylinder(1.0, -1.0, 1.0),
            cylinder(1.0, 0.0, 2.0)
                .along(1.0, 0.0, 0.0)
                .at(0.0, 0.0, 2.0),
            cylinder(1.0, -1.0, 1.0)
                .along(0.0, 1.0, 0.0)
                .at(2.0, 0.0, 0.0)
                .cut(),
            cylinder(0.5, 0.0, 1.0)
                .along(1.0, 0.0, 0.0)
                .at(-1.0, 0.0, 0.0)
                .cut(),
        ],
    );
    add(
        "perpendicular bars, coplanar caps cut",
        vec![
            cylinder(2.0, 0.0, 1.0),
            cylinder(1.0, -1.0, 1.0)
                .along(1.0, 0.0, 0.0)
                .at(1.0, 0.0, 1.0)
                .cut(),
            cylinder(0.5, -2.0, 0.0)
                .along(0.0, 1.0, 0.0)
                .at(0.0, 0.0, 0.5)
                .cut(),
            cylinder(0.5, 0.0, 1.0).at(0.0, -1.0, 0.0),
        ],
    );
    add(
        "parallel bars that touch along a line",
        vec![
            cylinder(1.0, 0.0, 2.0),
            cylinder(1.0, 0.0, 2.0).at(2.0, 0.0, 0.0),
            cylinder(1.0, 0.0, 2.0).at(0.0, 2.0, 0.0).cut(),
            cylinder(0.5, 0.0, 2.0).at(0.5, 0.0, 0.0).cut(),
        ],
    );
    add(
        "wedge less an offset bar",
        vec![
            cylinder(2.0, 0.0, 2.0).turn(0.0, 90.0),
            cylinder(0.75, 0.0, 2.0).at(1.0, 0.5, 0.0).cut(),
        ],
    );
    add(
        "wedge less a wedge with the same cap",
        vec![
            cylinder(2.0, 0.0, 2.0).turn(0.0, 120.0),
            cylinder(2.0, 0.0, 2.0).turn(0.0, 60.0).cut(),
        ],
    );
    add(
        "wedge less a coaxial bar",
        vec![
            tube(0.5, 2.0, 0.0, 2.0).turn(30.0, 250.0),
            cylinder(1.0, 0.5, 2.0).cut(),
            cylinder(1.5, 0.0, 0.5).turn(90.0, 100.0).cut(),
        ],
    );
    add(
        "wedges that make a whole, in a ball",
        vec![
            cylinder(2.0, -1.0, 1.0).turn(0.0, 200.0),
            cylinder(2.0, -1.0, 1.0).turn(200.0, 160.0),
            ball(2.0).at(0.25, 0.0, 0.0).common(),
        ],
    );
    add(
        "balls in wedges",
        vec![
            ball(2.0).turn(0.0, 270.0),
            ball(1.0).turn(270.0, 90.0),
            ball(1.0).turn(45.0, 90.0).cut(),
            torus(1.5, 0.25).turn(180.0, 180.0).cut(),
        ],
    );
    add("nothing: itself taken away", vec![bar(), bar().cut()]);
    add(
        "nothing: itself upside down taken away",
        vec![
            cylinder(1.0, 0.0, 2.0),
            cylinder(1.0, -2.0, 0.0).along(0.0, 0.0, -1.0).cut(),
        ],
    );
    add(
        "nothing: no common part",
        vec![ball(1.0), ball(1.0).at(4.0, 0.0, 0.0).common()],
    );
    add(
        "rings within rings",
        vec![
            torus(3.0, 1.0),
            torus(3.0, 0.5).cut(),
            torus(3.0, 0.25),
            cylinder(0.75, 0.0, 5.0).along(1.0, 1.0, 0.25).cut(),
        ],
    );
    add(
        "cones",
        vec![
            frustum(2.0, 0.0, 0.0, 3.0),
            frustum(1.0, 0.0, 0.5, 2.0).at(0.5, 0.5, 0.0).cut(),
            frustum(2.0, 0.0, 0.0, 3.0)
                .along(1.0, 0.0, 0.0)
                .at(-1.0, 0.0, 0.5),
            ball(1.75).at(0.0, 0.0, 1.0).common(),
        ],
    );
    add(
        "free forms",
        vec![
            other(WAVY),
            other(CUP).along(1.0, 0.0, 0.0).at(-1.0, 0.25, 1.0).cut(),
            other(WAVY).turn(30.0, 200.0).along(0.0, 1.0, 1.0),
            cylinder(0.75, -4.0, 4.0)
                .along(1.0, 1.0, 0.0)
                .at(0.0, 0.0, 1.0)
                .cut(),
        ],
    );
    add(
        "free forms, coaxial",
        vec![
            other(WAVY),
            other(CUP).cut(),
            other(CUP).at(0.0, 0.0, 1.0).common(),
        ],
    );
    let bars = vec![bar(), bar().along(1.0, 0.0, 0.0).common()];
    let pockets = all
        .iter()
        .find(|c| c.name.starts_with("coplanar"))
        .expect("pockets")
        .items
        .clone();
    let stack = all
        .iter()
        .find(|c| c.name.starts_with("stack, a hole"))
        .expect("a stack")
        .items
        .clone();
    let named = |name: &str, items: &[Item]| Composite::new(name, items.to_vec());
    all.extend([
        named("stack", &stack).turned([1.0, 2.0, 3.0], 77.0),
        named("pockets", &pockets).turned([-3.0, 1.0, 2.0], 20.0),
        named("flange", &flange()).placed(1e-6, DVec3::ZERO),
        named("flange", &flange()).placed(1e6, DVec3::ZERO),
        named("flange", &flange()).placed(1.0, DVec3::new(1e6, -2e6, 5e5)),
        named("bars", &bars).placed(1e6, DVec3::new(1e6, 0.0, -3e6)),
        named("pockets", &pockets).placed(0.25, DVec3::new(1e6, -1e6, 1e6)),
        chain(3, 6),
        chain(4, 9),
        chain(5, 12),
    ]);
    all
}

/// Composites whose solids share axis and turn.
pub(crate) fn coaxial() -> Vec<Composite> {
    vec![
        Composite::new(
            "pipe by coincident caps",
            vec![cylinder(2.0, 0.0, 3.0), cylinder(1.0, 0.0, 3.0).cut()],
        ),
        Composite::new(
            "pot",
            vec![
                cylinder(2.0, 0.0, 3.0),
                cylinder(1.5, 0.5, 3.0).cut(),
                torus(2.0, 0.25).at(0.0, 0.0, 3.0),
                ball(3.25).at(0.0, 0.0, 1.0).common(),
            ],
        ),
        Composite::new(
            "wedge of a turned part",
            vec![
                cylinder(2.0, 0.0, 3.0).turn(20.0, 200.0),
                frustum(1.0, 0.0, 2.0, 3.0).turn(20.0, 200.0).cut(),
                torus(1.5, 0.5).turn(20.0, 200.0),
                tube(0.5, 1.75, -0.25, 1.0).turn(20.0, 200.0).common(),
            ],
        ),
        Composite::new(
            "hollow ball, upside down",
            vec![
                ball(2.0),
                ball(1.5).along(0.0, 0.0, -1.0).cut(),
                cylinder(0.5, -3.0, 0.0).along(0.0, 0.0, -1.0).cut(),
                ball(0.5),
            ],
        )
        .turned([1.0, 2.0, 3.0], 77.0),
        Composite::new(
            "rings within rings",
            vec![
                torus(3.0, 1.0),
                torus(3.0, 0.5).cut(),
                torus(3.0, 0.25),
                tube(2.5, 3.0, -0.125, 0.125),
            ],
        )
        .placed(1e-3, DVec3::new(1.0, 0.0, 0.0)),
    ]
}
