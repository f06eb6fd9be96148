//! Meshes of profiles of all tangencies: closed, within the chord error both ways, of the right volume.

use std::collections::HashMap;

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::mesh::{Mesh, tessellate};

use super::checks::Found;
use super::cubature::Estimate;
use super::draw::{Drawn, from_profile};
use super::support::sampling::{Random, evaluate};
use super::truth::Solid;

/// Profiles whose curves touch the axis, each other or themselves.
fn profile(random: &mut Random) -> String {
    let r = random.between(0.3, 1.5);
    let q = random.between(0.2, 0.9);
    let circle = |r: f64, z: f64, radius: f64| {
        format!("[{{ kind = 'circle', center = [{r:?}, {z:?}], radius = {radius:?} }}]")
    };
    let to_axis = |curves: &str| format!("boundary = 'to-axis'\ncurves = [{curves}]");
    let bezier = |points: &str| format!("{{ kind = 'bezier', points = {points} }}");
    match random.below(16) {
        // Tangent to the axis at the start, at the end, at both, to second order.
        0 => to_axis(&bezier(&format!("[[0, 0], [0, 2], [{r:?}, 3]]"))),
        1 => to_axis(&bezier(&format!("[[{r:?}, 0], [0, 1], [0, 3]]"))),
        2 => to_axis(&bezier(&format!("[[0, 0], [0, 1], [{:?}, 1.5], [0, 2], [0, 3]]", 2.0 * r))),
        3 => to_axis(&bezier(&format!("[[0, 0], [0, 1], [0, 2], [{r:?}, 3]]"))),
        // A bore that touches the outside from within, at any place.
        4 => {
            let (a, b) = (1.0, q * 0.9);
            format!("loops = [{}, {}]", circle(3.0, 0.0, a), circle(3.0 + a - b, 0.0, b))
        }
        5 => {
            let (s, c) = random.between(0.0, 6.3).sin_cos();
            let off = 1.0 - q;
            format!("loops = [{}, {}]", circle(3.0, 0.0, 1.0), circle(3.0 + off * c, off * s, q))
        }
        // Rings that touch from without.
        6 => format!("loops = [{}, {}]", circle(2.0, 0.0, q), circle(2.0, q + r, r)),
        7 => format!("loops = [{}, {}]", circle(1.0 + q, 0.0, q), circle(1.0 + 2.0 * q + r, 0.0, r)),
        // A circle that touches the axis, with a bore that touches both.
        8 => format!("loops = [{}, {}]", circle(r, 0.0, r), circle(q * r, 0.0, q * r)),
        // A cusp.
        9 => format!(
            "curves = [{{ kind = 'bezier', points = [[1, 0], [{:?}, 1], [1, 1], [1, 0]] }}]",
            2.0 + r
        ),
        10 => to_axis(&bezier(&format!("[[1, 0], [{:?}, 1], [1, 1], [{:?}, 0.5]]", 1.0 + r, 1.0 + 0.5 * r))),
        // Pieces along the axis, and points met several times.
        11 => "loops = [[{ kind = 'polyline', points = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.5], [0, 0]] }], \
               [{ kind = 'polyline', points = [[0, 1], [1, 2], [0, 2], [0, 1]] }]]"
            .to_owned(),
        12 => format!(
            "loops = [[{{ kind = 'polyline', points = [[1, 0], [2, 0], [2, {r:?}], [1, {r:?}], [1, 0]] }}], \
             [{{ kind = 'polyline', points = [[1, 0], [1.5, {:?}], [1.2, {:?}], [1, 0]] }}], \
             [{{ kind = 'polyline', points = [[2, {r:?}], [3, {r:?}], [2.5, {:?}], [2, {r:?}]] }}]]",
            0.5 * r,
            0.7 * r,
            r + q
        ),
        13 => format!(
            "loops = [[{{ kind = 'polyline', points = [[0, 0], [1, 1], [0, 2], [1, 3], [0, 4], [0, 0]] }}], {}]",
            circle(0.3, 1.0 + 0.1 * q, 0.3)
        ),
        // Thin walls and gaps.
        14 => {
            let wall = 10_f64.powf(random.between(-9.0, -2.0));
            format!("loops = [{}, {}]", circle(2.5, 0.0, 1.0), circle(2.5 + 0.5 * wall, 0.0, 1.0 - wall))
        }
        _ => {
            let gap = 10_f64.powf(random.between(-9.0, -2.0));
            let arc = "{ kind = 'bezier', points = [[1, 0], [1.8, 1], [1, 2]] }";
            format!(
                "loops = [[{arc}, {{ kind = 'polyline', points = [[1, 2], [0.5, 1], [1, 0]] }}], \
                 [{{ kind = 'bezier', points = [[{:?}, 0], [{:?}, 1], [{:?}, 2]] }}, \
                 {{ kind = 'polyline', points = [[{:?}, 2], [3, 1], [{:?}, 0]] }}]]",
                1.0 + gap,
                1.8 + gap,
                1.0 + gap,
                1.0 + gap,
                1.0 + gap
            )
        }
    }
}

pub(crate) fn meshes(seed: u64) -> (String, Found) {
    let mut random = Random::new(seed);
    let angle = match random.below(4) {
        0 => 360.0,
        1 => [90.0, 180.0, 270.0][random.below(3)],
        _ => random.between(5.0, 355.0),
    };
    let start = [0.0, 45.0, random.between(0.0, 360.0)][random.below(3)];
    let keys = format!("angle = {angle:?}\nstart = {start:?}\n");
    let keys = match random.below(3) {
        0 => keys + "axis = { origin = [1, 2, 3], direction = [1, 2, 2] }\n",
        1 => keys + "axis = { direction = [1, 0, 0] }\nplace = [{ scale = 1e-3 }]\n",
        _ => keys,
    };
    let drawn = from_profile(&profile(&mut random), &keys);
    let text = drawn.text.clone();
    let mut found = Found::default();
    let scene = match Scene::parse(&text) {
        Ok(scene) => scene,
        Err(_) => {
            found.open += 1;
            return (text, found);
        }
    };
    let body = scene.assembly().parts()[0].body();
    let size = scene.bounds().longest_side();
    let share = 10_f64.powf(random.between(-3.0, -0.7));
    match tessellate(body, share * size) {
        Err(e) => found.beyond.push(format!("chord error {share:e}: {e}")),
        Ok(mesh) => check(&drawn, &mesh, share * size, &scene, &mut random, &mut found),
    }
    (text, found)
}

fn check(
    drawn: &Drawn,
    mesh: &Mesh,
    asked: f64,
    scene: &Scene,
    random: &mut Random,
    found: &mut Found,
) {
    let chord = mesh.chord_error();
    if !(chord > 0.0 && chord <= asked) {
        found
            .beyond
            .push(format!("chord error {chord:e} of {asked:e}"));
    }
    // Every edge once in each direction.
    let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
    for &[a, b, c] in mesh.triangles() {
        for edge in [[a, b], [b, c], [c, a]] {
            *uses.entry(edge).or_default() += 1;
        }
    }
    let torn = uses
        .iter()
        .filter(|(e, n)| **n != 1 || uses.get(&[e[1], e[0]]) != Some(&1));
    let torn = torn.count();
    if torn > 0 || mesh.triangles().is_empty() {
        found
            .beyond
            .push(format!("{torn} edges are not used once in each direction"));
    }
    let rounding = 1e-12 * drawn.size + 1e-14 * drawn.middle.length();
    let solid = &drawn.truth.solids[0];
    let corners: Vec<[DVec3; 3]> = mesh.corners().collect();
    let none = |error: f64| Estimate { value: 0.0, error };
    // The mesh is near the surface. Large triangles, long ones and those by number.
    for k in 0..300 {
        let t = corners[if k < 100 {
            corners.len() * k / 100
        } else {
            random.below(corners.len())
        }];
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        let p = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
        found.hold(
            "from mesh to surface",
            solid.distance(p),
            none(rounding),
            chord,
        );
    }
    // The surface is near the mesh.
    for _ in 0..150 {
        if let Some(p) = on_surface(solid, random) {
            let nearest = corners
                .iter()
                .map(|t| to_triangle(p, t))
                .fold(f64::INFINITY, f64::min);
            found.hold("from surface to mesh", nearest, none(rounding), chord);
        }
    }
    let measured = scene.assembly().parts()[0].measures();
    let right = Estimate {
        value: measured.volume,
        error: measured.error_estimate.volume + 1e-11 * measured.volume,
    };
    found.hold(
        "volume of the mesh",
        mesh.volume(),
        right,
        1.5 * measured.area * chord,
    );
}

/// A point of the true surface; `None` where a cap was missed.
fn on_surface(solid: &Solid, random: &mut Random) -> Option<DVec3> {
    let region = &solid.frame.region;
    let [start, angle] = solid.frame.turn;
    if angle < 360.0 && random.below(3) == 0 {
        let [r, z] = [0, 1].map(|c| region.center[c] + region.extent * random.between(-1.0, 1.0));
        let degrees = start + if random.below(2) == 0 { 0.0 } else { angle };
        let (s, c) = degrees.to_radians().sin_cos();
        return solid
            .holds([r, z])
            .then(|| solid.frame.world([r * c, r * s, z]));
    }
    let pieces: Vec<_> = region
        .small
        .iter()
        .flatten()
        .filter(|p| !p.on_axis)
        .collect();
    let t = match random.below(4) {
        0 => 10_f64.powf(random.between(-9.0, 0.0)),
        1 => 1.0 - 10_f64.powf(random.between(-9.0, 0.0)),
        _ => random.unit(),
    };
    let p = evaluate(&pieces[random.below(pieces.len())].control, t);
    let (s, c) = (start + angle * random.unit()).to_radians().sin_cos();
    let r = (p[0] + region.center[0]).max(0.0);
    Some(solid.frame.world([r * c, r * s, p[1] + region.center[1]]))
}

/// The distance of a point to a triangle, by the regions of its corners (Ericson, Real-Time Collision
/// Detection, 2005).
fn to_triangle(p: DVec3, [a, b, c]: &[DVec3; 3]) -> f64 {
    let segment = |a: DVec3, b: DVec3| {
        let d = b - a;
        let t = ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        let t = if t.is_nan() { 0.0 } else { t };
        p.distance(a + d * t)
    };
    let edges = segment(*a, *b).min(segment(*b, *c)).min(segment(*c, *a));
    let n = (*b - *a).cross(*c - *a);
    let within = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(a, b)| n.dot((**b - **a).cross(p - **a)) >= 0.0);
    if within && n.length() > 0.0 {
        edges.min((p - *a).dot(n.normalize()).abs())
    } else {
        edges
    }
}
