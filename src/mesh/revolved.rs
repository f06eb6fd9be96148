//! The boundary of a turned region as triangles.
//!
//! The polygons of the [outline](super::outline) are turned in equal steps Δφ. Every corner off the
//! axis becomes a ring of vertices on the true circle, a corner on the axis becomes a pole:
//!
//! ```text
//!   B0 ---- B1       chord A→B, the region on its left     pole:   P
//!   |  .-'  |        triangles A0 A1 B1 and A0 B1 B0              / \
//!   A0 ---- A1       counter-clockwise seen from outside        A0---A1
//! ```
//!
//! The four corners lie in one plane, so the triangles of a chord bound its prism exactly. In the
//! plane normal to the axis a circle of radius r becomes a polygon of area (sin Δφ/Δφ) π r², and so
//!
//! ```text
//!   V(mesh) = (sin Δφ/Δφ) · V(turned polygons)          for a full turn
//! ```
//!
//! # Why the mesh is within the chord error
//!
//! Let δ be the outline's error and s = r (1 − cos(Δφ/2)) the sagitta at the largest radius. A
//! point of the curved surface moves within its half-plane by at most δ to the nearest point of its
//! chord, then towards the axis by at most s to the flat triangle. Both moves are continuous and
//! onto, so every point of one surface has a point of the other within δ + s: the Hausdorff
//! distance, both ways, convex or not. A cap stays in its plane, where only the first move
//! takes place. The surface sweeps only points within δ + s of where it began, and a winding
//! number changes only where the surface passes: any point further away than that is on the
//! same side of the mesh as of the solid.
//!
//! The budget is halved between the two, which is the cheapest: the counts of chords and of
//! steps fall with the square roots of their shares. What the chords leave goes to the steps.

use super::cap::Cap;
use super::outline::{NoOutline, Outline, index};
use super::triangles::Mesh;
use super::{MAX_TRIANGLES, MeshError};
use crate::math::{Dd, Real};
use crate::solid::{Revolved, Turn};
use glam::{DVec2, DVec3};

/// The largest angle of a step in degrees: three steps make a full turn, and those of half a turn
/// do not pass through the axis.
const WIDEST_STEP: f64 = 120.0;

/// Chords at which the count for a tolerance is judged.
const SAMPLE: usize = 1 << 14;

/// The boundary of a turned region as a closed mesh within `chord_error`, a length greater than 0.
pub(super) fn tessellate(body: &Revolved, chord_error: f64) -> Result<Mesh, MeshError> {
    let frame = body.frame();
    let scale = frame.scale();
    // The products and sums of the last rotation; local coordinates are within the unit square.
    let rounding = 16.0 * f64::EPSILON * (frame.origin().abs().max_element() + 2.0 * scale);
    let budget = (chord_error - rounding) / scale;
    if !(budget > 64.0 * f64::EPSILON) {
        let smallest = 2.0 * (rounding + 64.0 * f64::EPSILON * scale);
        return Err(MeshError::BelowRounding {
            found: chord_error,
            smallest,
        });
    }
    let mut outline = fitted(body, budget).map_err(|reason| match reason {
        NoOutline::TooManyChords => MeshError::TooManyTriangles {
            found: chord_error,
            triangles: estimate(body, budget),
            limit: MAX_TRIANGLES,
        },
        NoOutline::Open(at) => MeshError::Open {
            at: at.map(|v| v * scale),
        },
    })?;
    let cap = match body.turn() {
        Turn::Full => None,
        Turn::Partial(_) => {
            let spare = 0.5 * (budget - outline.error);
            let cap = Cap::new(&mut outline, spare).map_err(|at| MeshError::Thin {
                at: at.map(|v| v * scale),
            })?;
            Some(cap)
        }
    };
    let radius = outline.radius();
    let turned = steps(body.turn(), radius, budget - outline.error);
    let caps = cap.as_ref().map_or(0, |c| 2 * c.triangles.len());
    let count = 2.0 * turned * as_f64(outline.swept()) + as_f64(caps);
    if count > as_f64(MAX_TRIANGLES) {
        return Err(MeshError::TooManyTriangles {
            found: chord_error,
            triangles: count,
            limit: MAX_TRIANGLES,
        });
    }
    let achieved = outline.error + sagitta(body.turn(), radius, turned);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count below the limit"
    )]
    let rings = Rings::new(body, &outline, turned as usize);
    let (vertices, triangles) = rings.surface(cap.as_ref(), body);
    Ok(Mesh::new(
        vertices,
        triangles,
        (achieved * scale + rounding).min(chord_error),
    ))
}

/// The outline with half of the budget, refused where it alone is too much.
fn fitted(body: &Revolved, budget: f64) -> Result<Outline, NoOutline> {
    // At least this many steps for each chord.
    let rough = Outline::new(body.boundary(), 2.0, SAMPLE.max(4 * body.boundary().len()))?;
    let least = steps(body.turn(), rough.radius(), budget);
    let most = as_f64(MAX_TRIANGLES) / least;
    if !(most >= 1.0) {
        return Err(NoOutline::TooManyChords);
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 1 and the limit"
    )]
    Outline::new(body.boundary(), 0.5 * budget, most as usize)
}

/// Triangles that a budget takes, about: the chords of curves grow with its square root.
fn estimate(body: &Revolved, budget: f64) -> f64 {
    let (mut tolerance, mut factor) = (0.5 * budget, 1.0);
    let most = SAMPLE.max(4 * body.boundary().len());
    loop {
        match Outline::new(body.boundary(), tolerance, most) {
            Ok(outline) => {
                let turned = steps(body.turn(), outline.radius(), 0.5 * budget);
                return 2.0 * turned * (factor * as_f64(outline.swept())).max(1.0);
            }
            Err(NoOutline::TooManyChords) if tolerance < 2.0 => {
                tolerance *= 16.0;
                factor *= 4.0;
            }
            Err(_) => return f64::INFINITY,
        }
    }
}

/// Steps of a turn whose sagitta at `radius` is at most `most`; a whole number.
fn steps(turn: &Turn, radius: f64, most: f64) -> f64 {
    let least = (turn.degrees() / WIDEST_STEP).ceil();
    let share = (most / (2.0 * radius)).clamp(0.0, 1.0);
    // r (1 - cos(h/2)) = 2 r sin²(h/4)
    let widest = 4.0 * share.sqrt().asin();
    let mut n = (turn.radians() / widest).ceil().max(least);
    // The root and the arcsine are rounded.
    while n < 1e15 && sagitta(turn, radius, n) > most {
        n += 1.0;
    }
    n
}

/// r (1 - cos(Δφ/2)) for `n` steps.
fn sagitta(turn: &Turn, radius: f64, n: f64) -> f64 {
    let sine = (0.25 * turn.radians() / n).sin();
    2.0 * radius * sine * sine
}

#[allow(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

/// The vertices that a corner of the outline becomes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Spot {
    /// One vertex on the axis.
    Pole(u32),
    /// Consecutive vertices from this one on.
    Ring(u32),
}

/// The turned corners.
struct Rings<'a> {
    outline: &'a Outline,
    full: bool,
    steps: usize,
    vertices: Vec<DVec3>,
    /// For each corner, where the chord that arrives ends and where the one that leaves begins.
    spots: Vec<[Spot; 2]>,
}

impl<'a> Rings<'a> {
    fn new(body: &Revolved, outline: &'a Outline, steps: usize) -> Self {
        let directions = directions(body.turn(), steps);
        let full = *body.turn() == Turn::Full;
        let frame = body.frame();
        let mut vertices = Vec::new();
        let mut spots = Vec::new();
        for corners in &outline.loops {
            let n = corners.len();
            let point = |i: usize| outline.points[corners[i % n] as usize];
            for i in 0..n {
                let [r, z] = point(i);
                let at = index(vertices.len());
                if r > 0.0 {
                    let turned = |d: &DVec2| frame.to_world(DVec3::new(r * d.x, r * d.y, z));
                    vertices.extend(directions.iter().map(turned));
                    spots.push([Spot::Ring(at); 2]);
                    continue;
                }
                let pole = frame.to_world(DVec3::new(0.0, 0.0, z));
                let swept = [i + n - 1, i + 1].map(|k| point(k)[0] > 0.0);
                // Without caps nothing joins the two fans of a corner that only touches the axis,
                // and a corner between two chords on the axis has none.
                let apart = full && swept == [true, true];
                let poles = match (full, swept) {
                    (true, [false, false]) => 0,
                    _ => 1 + usize::from(apart),
                };
                vertices.extend(std::iter::repeat_n(pole, poles));
                spots.push([Spot::Pole(at), Spot::Pole(at + u32::from(apart))]);
            }
        }
        Self {
            outline,
            full,
            steps,
            vertices,
            spots,
        }
    }

    /// Vertex `k` of a ring, or the pole.
    fn vertex(&self, spot: Spot, k: usize) -> u32 {
        match spot {
            Spot::Pole(at) => at,
            Spot::Ring(first) if self.full => first + index(k % self.steps),
            Spot::Ring(first) => first + index(k),
        }
    }

    /// All vertices and triangles, with both caps where there is one to be put at the ends.
    fn surface(mut self, cap: Option<&Cap>, body: &Revolved) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut triangles = Vec::new();
        let mut first = 0;
        for corners in &self.outline.loops {
            let n = corners.len();
            for i in 0..n {
                let (a, b) = (self.spots[first + i][1], self.spots[first + (i + 1) % n][0]);
                for k in 0..self.steps {
                    let [a0, a1] = [k, k + 1].map(|k| self.vertex(a, k));
                    let [b0, b1] = [k, k + 1].map(|k| self.vertex(b, k));
                    if matches!(a, Spot::Ring(_)) {
                        triangles.push([a0, a1, b1]);
                    }
                    if matches!(b, Spot::Ring(_)) {
                        triangles.push([a0, b1, b0]);
                    }
                }
            }
            first += n;
        }
        for (cap, k) in cap.into_iter().flat_map(|c| [(c, 0), (c, self.steps)]) {
            let inner = index(self.vertices.len());
            let direction = directions(body.turn(), self.steps)[k];
            self.vertices.extend(cap.inner.iter().map(|&p| {
                let [r, z] = self.outline.points[p as usize];
                let turned = DVec3::new(r * direction.x, r * direction.y, z);
                body.frame().to_world(turned)
            }));
            let corner = |c: u32| match self.spots.get(c as usize) {
                Some(spot) => self.vertex(spot[0], k),
                None => inner + c - index(self.spots.len()),
            };
            // Seen from before the start the half-plane's r runs to the right.
            let turned = |[a, b, c]: [u32; 3]| if k == 0 { [a, b, c] } else { [a, c, b] };
            triangles.extend(cap.triangles.iter().map(|&t| turned(t).map(corner)));
        }
        (self.vertices, triangles)
    }
}

/// Unit vectors of the steps in the plane normal to the axis: n of a full turn, else n + 1.
fn directions(turn: &Turn, steps: usize) -> Vec<DVec2> {
    let at = |angle: Dd| {
        let (s, c) = angle.sin_cos_degrees();
        DVec2::new(c.f64(), s.f64())
    };
    let share = |k: usize| Dd::of(turn.degrees()) * Dd::of(as_f64(k)) / Dd::of(as_f64(steps));
    match turn {
        Turn::Full => (0..steps).map(|k| at(share(k))).collect(),
        Turn::Partial(wedge) => {
            let [start, end] = wedge.directions();
            let inner = (1..steps).map(|k| at(Dd::of(wedge.from()) + share(k)));
            std::iter::once(start).chain(inner).chain([end]).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use std::f64::consts::{PI, TAU};

    fn scenes() -> Vec<Scene> {
        let names = [
            "torus", "sphere", "goblet", "cone", "cylinder", "nozzle", "rings", "tokamak",
        ];
        let path = |n: &str| format!("{}/scenes/{n}.toml", env!("CARGO_MANIFEST_DIR"));
        names
            .iter()
            .map(|n| Scene::load(path(n)).expect(n))
            .collect()
    }

    /// The volume of the turned polygons, ∮ π r² dz.
    fn turned_volume(outline: &Outline) -> f64 {
        let mut sum = 0.0;
        for l in &outline.loops {
            for i in 0..l.len() {
                let [a, b] = [l[i], l[(i + 1) % l.len()]].map(|p| outline.points[p as usize]);
                sum += (b[1] - a[1]) * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0]);
            }
        }
        PI / 3.0 * sum
    }

    #[test]
    fn the_volume_is_that_of_the_turned_polygons_times_the_share_of_the_steps() {
        for scene in scenes() {
            for part in scene.assembly().parts() {
                let body = part.body().revolved().expect("turned");
                if *body.turn() != Turn::Full {
                    continue;
                }
                let size = body.bounds().longest_side();
                for share in [0.3, 1e-2, 1e-4] {
                    let mesh = tessellate(body, share * size).expect("a mesh");
                    let scale = body.frame().scale();
                    let budget = share * size / scale
                        - 16.0
                            * f64::EPSILON
                            * (body.frame().origin().abs().max_element() / scale + 2.0);
                    let outline = fitted(body, budget).expect("an outline");
                    let n = steps(body.turn(), outline.radius(), budget - outline.error);
                    let step = TAU / n;
                    let wanted = step.sin() / step * turned_volume(&outline) * scale.powi(3);
                    let relative = (mesh.volume() / wanted - 1.0).abs();
                    assert!(
                        relative < 1e-12,
                        "{} {share}: {} against {wanted}",
                        part.name(),
                        mesh.volume()
                    );
                }
            }
        }
    }

    #[test]
    fn the_sagitta_is_kept_with_no_step_to_spare() {
        for turn in [Turn::new(0.0, 360.0), Turn::new(0.0, 90.0)] {
            for most in [0.4, 1e-2, 1e-5, 1e-9] {
                let n = steps(&turn, 1.0, most);
                assert!(sagitta(&turn, 1.0, n) <= most);
                let least = (turn.degrees() / WIDEST_STEP).ceil();
                assert!(n <= least || sagitta(&turn, 1.0, n - 1.0) > most * (1.0 - 1e-9));
            }
        }
    }
}
