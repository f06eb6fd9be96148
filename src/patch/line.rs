//! Where a straight line may meet a set of faces.
//!
//! Across the line the face has two coordinates x = e₁ · (X - start), y = e₂ · (X - start), and along
//! it the parameter s. The line meets the face where both polynomials x W and y W vanish. A piece is
//! left out when all coefficients of one of them, or of the two turned to the piece's own
//! directions, have one sign. Multiplied by the inverse of the piece's mean derivative they are
//! nearly u - u* and v - v*: what they are off by bounds the parameters of any common root, and the
//! piece is cut down to those (Newton's method on intervals, in Bernstein form), or halved where that
//! gains little.
//!
//! * Units: local across the line; s as the caller's.
//! * Accuracy: coordinates across are widened by the caller's error and by the rounding of the
//!   rotation and of the halvings, so no crossing is lost. What is narrower than that, or is seen
//!   edge-on from the line, is reported as it is: the work on tangent lines and on lines in a flat
//!   face is bounded.
//! * Source: Nishita, Sederberg, Kakimoto, SIGGRAPH 1990 (Bézier clipping); Krawczyk's operator for
//!   the interval step.

use super::face::Frame;
use super::face_net::{Net, cross, dot, length, real};
use super::face_tree::{Box3, PatchTree, SubPatch};
use glam::DVec3;
use smallvec::SmallVec;

/// A line in local coordinates.
struct Line {
    start: [f64; 3],
    along: [f64; 3],
    /// Unit vectors across.
    across: [[f64; 3]; 2],
    /// along / |along|²: what turns a vector into a step of s.
    rate: [f64; 3],
    /// Reciprocals of the components of `along`.
    inverse: [f64; 3],
    range: [f64; 2],
    /// Uncertainty across the line.
    error: f64,
    /// The same along the line, in s.
    slack: f64,
}

/// Halvings of a sub-patch at most.
const DEPTH: u32 = 96;

/// Pieces of one sub-patch looked at before what is left is reported as it is.
const PIECES: u32 = 4096;

pub(super) fn search(
    tree: &PatchTree,
    frame: &Frame,
    start: DVec3,
    along: DVec3,
    range: [f64; 2],
    error: f64,
    each: &mut impl FnMut(f64, f64),
) {
    let Some(line) = Line::new(frame, start, along, range, error) else {
        each(range[0], range[1]);
        return;
    };
    tree.visit(
        |b| line.meets(b).is_some(),
        |index| line.search_part(&tree.parts[index], each),
    );
}

impl Line {
    /// `None` where the numbers say nothing.
    fn new(frame: &Frame, start: DVec3, along: DVec3, range: [f64; 2], error: f64) -> Option<Self> {
        let local = frame.local(start);
        let step = (along / frame.unit).to_array();
        let speed = length(step);
        let error = error.max(0.0) / frame.unit;
        let finite = local
            .iter()
            .chain(&step)
            .chain(&range)
            .all(|x| x.is_finite());
        if !(finite && error.is_finite() && speed > 0.0 && speed.is_finite()) {
            return None;
        }
        // The axis farthest from the line gives a direction across it.
        let axis = (1..3).fold(0, |k, c| if step[c].abs() < step[k].abs() { c } else { k });
        let mut aside = [0.0; 3];
        aside[axis] = 1.0;
        let unit = step.map(|x| x / speed);
        let first = cross(unit, aside);
        let first = first.map(|x| x / length(first));
        let second = cross(unit, first);
        // Rounding of start - centre, of the directions over the whole range, and of the halvings.
        let reach = length(local) + speed * range[0].abs().max(range[1].abs()) + 4.0;
        let offset = (start.abs().max_element() + frame.centre.abs().max_element()) / frame.unit;
        let error = error + f64::EPSILON * (16.0 * reach + offset);
        let slack = error / speed
            + 8.0 * f64::EPSILON * (range[0].abs().max(range[1].abs()) + reach / speed);
        (error.is_finite() && slack.is_finite()).then_some(Self {
            start: local,
            along: step,
            across: [first, second],
            rate: unit.map(|x| x / speed),
            inverse: step.map(|x| 1.0 / x),
            range,
            error,
            slack,
        })
    }

    /// The parameters at which the line passes the box grown by the error.
    #[inline]
    fn meets(&self, b: &Box3) -> Option<[f64; 2]> {
        let [mut from, mut to] = self.range;
        for c in 0..3 {
            let low = b.min[c] - self.error - self.start[c];
            let high = b.max[c] + self.error - self.start[c];
            if self.along[c] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low * self.inverse[c], high * self.inverse[c]);
            from = from.max(a.min(b) - self.slack);
            to = to.min(a.max(b) + self.slack);
        }
        (from <= to).then_some([from, to])
    }

    fn search_part(&self, part: &SubPatch, each: &mut impl FnMut(f64, f64)) {
        let from = std::array::from_fn(|c| part.origin[c] - self.start[c]);
        let [e, f] = self.across;
        let offset = [dot(e, from), dot(f, from), dot(self.rate, from)];
        // Two channels across, one along, and the weight.
        let seen = part.net.map(|&p| {
            let x = [p[0], p[1], p[2]];
            let w = p[3];
            [
                dot(e, x) + offset[0] * w,
                dot(f, x) + offset[1] * w,
                dot(self.rate, x) + offset[2] * w,
                w,
            ]
        });
        let mut work: SmallVec<[(Net, u32); 4]> = SmallVec::new();
        work.push((seen, 0));
        let mut visited = 0;
        while let Some((net, depth)) = work.pop() {
            visited += 1;
            let Some(view) = View::new(&net, self) else {
                continue;
            };
            let [a, b] = view.along;
            if !(a <= b) {
                continue;
            }
            if a.ceil() > b.floor() || view.spent || depth >= DEPTH || visited >= PIECES {
                each(a, b);
                continue;
            }
            match view.clip {
                Clip::Empty => {}
                Clip::To(windows) => {
                    let [u, v] = windows;
                    let net = net.restrict(0, u[0], u[1]).restrict(1, v[0], v[1]);
                    work.push((net, depth + 1));
                }
                Clip::Halve(k) => {
                    let (before, after) = net.split(k, 0.5);
                    work.push((after, depth + 1));
                    work.push((before, depth + 1));
                }
            }
        }
    }
}

/// What to do with a piece that may meet the line.
enum Clip {
    Empty,
    To([[f64; 2]; 2]),
    Halve(usize),
}

/// A piece as seen along the line.
struct View {
    /// The s between which it lies.
    along: [f64; 2],
    /// It is too small, or too thin, to tell more.
    spent: bool,
    clip: Clip,
}

impl View {
    /// `None` where the line misses the piece for certain.
    fn new(net: &Net, line: &Line) -> Option<Self> {
        let error = line.error;
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for p in &net.points {
            let inverse = 1.0 / p[3];
            for c in 0..3 {
                let x = p[c] * inverse;
                low[c] = low[c].min(x);
                high[c] = high[c].max(x);
            }
        }
        if low[0] > error || high[0] < -error || low[1] > error || high[1] < -error {
            return None;
        }
        let along = [
            (low[2] - line.slack).max(line.range[0]),
            (high[2] + line.slack).min(line.range[1]),
        ];
        let sides = [high[0] - low[0], high[1] - low[1]];
        let mut view = Self {
            along,
            spent: sides[0].max(sides[1]) <= 16.0 * error,
            clip: Clip::Empty,
        };
        if view.spent || along[0].ceil() > along[1].floor() {
            return Some(view);
        }
        // Across the piece's longest side: a strip that misses the line, or is too thin to tell.
        let [p, q] = net.degrees;
        let at = |i: usize, j: usize| {
            let x = net.points[net.at(i, j)];
            [x[0] / x[3], x[1] / x[3]]
        };
        let less = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let corners = [at(0, 0), at(p, 0), at(0, q), at(p, q)];
        let mut longest = [0.0; 2];
        for k in 1..4 {
            for l in 0..k {
                let d = less(corners[k], corners[l]);
                if d[0] * d[0] + d[1] * d[1] > longest[0] * longest[0] + longest[1] * longest[1] {
                    longest = d;
                }
            }
        }
        let size = longest[0].hypot(longest[1]);
        if size > 0.0 {
            let normal = [-longest[1] / size, longest[0] / size];
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for p in &net.points {
                let x = (normal[0] * p[0] + normal[1] * p[1]) / p[3];
                least = least.min(x);
                most = most.max(x);
            }
            let error = 1.5 * error;
            if least > error || most < -error {
                return None;
            }
            if most - least <= 8.0 * error {
                // Seen edge-on. A thin strip that one parameter runs along can still be halved; one
                // that both run along would fall into ever more pieces.
                let [a, b] = [0, 1].map(|k| net_extent(net, k));
                view.spent = a.min(b) > 16.0 * error;
                view.clip = Clip::Halve(usize::from(b > a));
                return Some(view);
            }
        }
        view.clip = Self::clip(net, error);
        Some(view)
    }

    /// The part of the piece that can hold a common root of both coordinates.
    fn clip(net: &Net, error: f64) -> Clip {
        /// A window this share of the piece, in area, is worth the four cuts to get it.
        const GAIN: f64 = 0.35;
        let [p, q] = net.degrees;
        let corner = |i: usize, j: usize| net.points[net.at(i, j)];
        let [a, b, c, d] = [corner(0, 0), corner(p, 0), corner(0, q), corner(p, q)];
        let u = [0, 1].map(|k| 0.5 * ((b[k] - a[k]) + (d[k] - c[k])));
        let v = [0, 1].map(|k| 0.5 * ((c[k] - a[k]) + (d[k] - b[k])));
        let longer = || usize::from(net_extent(net, 1) > net_extent(net, 0));
        let det = u[0] * v[1] - u[1] * v[0];
        let size = u[0].hypot(u[1]) * v[0].hypot(v[1]);
        if !(det.abs() > 1e-3 * size) {
            return Clip::Halve(longer());
        }
        let rows = [[v[1] / det, -v[0] / det], [-u[1] / det, u[0] / det]];
        let weight = net.points.iter().fold(0.0_f64, |m, x| m.max(x[3]));
        let mut windows = [[0.0; 2]; 2];
        for k in 0..2 {
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for (j, row) in net.points.chunks_exact(p + 1).enumerate() {
                for (i, x) in row.iter().enumerate() {
                    let linear = if k == 0 {
                        real(i) / real(p)
                    } else {
                        real(j) / real(q)
                    };
                    let off = linear - (rows[k][0] * x[0] + rows[k][1] * x[1]);
                    least = least.min(off);
                    most = most.max(off);
                }
            }
            // Rounding of the differences, and the error across the line.
            let slack = weight * error * (rows[k][0].abs() + rows[k][1].abs())
                + 8.0 * f64::EPSILON * (1.0 + least.abs() + most.abs());
            if most + slack < 0.0 || least - slack > 1.0 {
                return Clip::Empty;
            }
            windows[k] = [(least - slack).max(0.0), (most + slack).min(1.0)];
        }
        let [u, v] = windows.map(|w| w[1] - w[0]);
        if u * v <= GAIN && u > 0.0 && v > 0.0 {
            Clip::To(windows)
        } else {
            Clip::Halve(longer())
        }
    }
}

/// Largest length, seen along the line, of a control polygon along `direction`.
fn net_extent(net: &Net, direction: usize) -> f64 {
    net.map(|p| [p[0], p[1], 0.0, p[3]]).extent(direction)
}

#[cfg(test)]
mod tests {
    use super::super::FaceSet;
    use super::super::face_testing::{
        Numbers, ball, bent, biquadratic, block, frustum, mapped, polar, torus,
    };
    use crate::nurbs::NurbsVolume;
    use glam::DVec3;
    use std::f64::consts::TAU;

    fn faces(volume: &NurbsVolume) -> FaceSet {
        FaceSet::new(std::slice::from_ref(volume)).expect("faces")
    }

    const ERROR: f64 = 1e-14;

    fn intervals(faces: &FaceSet, start: DVec3, along: DVec3, range: [f64; 2]) -> Vec<[f64; 2]> {
        let mut found = Vec::new();
        faces.line(start, along, range, ERROR, &mut |a, b| {
            assert!(a <= b && a >= range[0] && b <= range[1], "{a} {b}");
            found.push([a, b]);
        });
        found
    }

    fn holds(list: &[[f64; 2]], s: f64, slack: f64) -> bool {
        list.iter().any(|&[a, b]| a - slack <= s && s <= b + slack)
    }

    /// Every crossing is held, and integers are held only next to a crossing.
    fn check(faces: &FaceSet, start: DVec3, along: DVec3, crossings: &[f64]) {
        let range = [-1.0, 100.0];
        let list = intervals(faces, start, along, range);
        for &s in crossings.iter().filter(|&&s| s > range[0] && s < range[1]) {
            assert!(
                holds(&list, s, 1e-10),
                "{s} of {crossings:?} not in {list:?}, {start} {along}"
            );
        }
        for &[a, b] in &list {
            if a.ceil() <= b.floor() {
                let at = start + along * a.ceil();
                let off = faces.distance(at, f64::INFINITY);
                assert!(
                    off <= 1e-7,
                    "[{a}, {b}] holds an integer {off} away from the faces"
                );
            }
        }
        assert!(list.len() <= 64, "{} intervals", list.len());
    }

    fn sphere(start: DVec3, along: DVec3, centre: DVec3, radius: f64) -> Vec<f64> {
        let p = start - centre;
        let (a, b, c) = (
            along.length_squared(),
            p.dot(along),
            p.length_squared() - radius * radius,
        );
        let disc = b * b - a * c;
        if disc < 1e-9 * a {
            return Vec::new();
        }
        vec![(-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a]
    }

    fn cylinder(start: DVec3, along: DVec3) -> Vec<f64> {
        let (p, d) = (start.truncate(), along.truncate());
        let mut list = Vec::new();
        let (a, b, c) = (d.length_squared(), p.dot(d), p.length_squared() - 1.0);
        let disc = b * b - a * c;
        if disc > 1e-9 * a {
            list.extend([(-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a]);
        }
        list.retain(|s| (0.0..=1.0).contains(&(start.z + s * along.z)));
        for z in [0.0, 1.0] {
            let s = (z - start.z) / along.z;
            if s.is_finite() && (p + d * s).length() <= 1.0 {
                list.push(s);
            }
        }
        list
    }

    #[test]
    fn slanted_lines_through_round_solids() {
        let mut numbers = Numbers(11);
        let balls = [biquadratic(), polar(TAU)].map(|d| faces(&ball(1.0, &d)));
        let cylinders = [biquadratic(), polar(TAU)].map(|d| faces(&frustum(1.0, 1.0, 1.0, &d)));
        for _ in 0..300 {
            let (from, to) = (numbers.point(-1.5, 1.5), numbers.point(-1.5, 1.5));
            let along = (to - from) / 50.0;
            let start = from - 20.0 * along;
            for ball in &balls {
                check(ball, start, along, &sphere(start, along, DVec3::ZERO, 1.0));
            }
            for body in &cylinders {
                check(body, start, along, &cylinder(start, along));
            }
        }
    }

    #[test]
    fn rows_through_axes_seams_and_corners() {
        let ball = faces(&ball(1.0, &polar(TAU)));
        let body = faces(&frustum(1.0, 1.0, 1.0, &polar(TAU)));
        for i in 0..=20 {
            for along in [DVec3::X, DVec3::Y, DVec3::Z] {
                let off = f64::from(i) * 0.05;
                let aside = DVec3::new(along.z, along.x, along.y);
                let along = along * 0.0625;
                // Crossings at integers too: 1 / 0.0625 is one.
                let start = aside * off - along * 32.0;
                check(&ball, start, along, &sphere(start, along, DVec3::ZERO, 1.0));
                let start = start + DVec3::Z * 0.25;
                check(&body, start, along, &cylinder(start, along));
            }
        }
        // Through the corners of a block.
        let block = faces(&block([0.0; 3], [1.0; 3]));
        let start = DVec3::splat(-1.0);
        check(&block, start, DVec3::splat(0.125), &[8.0, 16.0]);
        check(&block, start, DVec3::splat(0.3), &[10.0 / 3.0, 20.0 / 3.0]);
        // Past a corner: no face is met.
        let past = intervals(
            &block,
            DVec3::new(1.01, -1.0, 0.5),
            DVec3::Y * 0.1,
            [-1.0, 99.0],
        );
        assert!(past.is_empty(), "{past:?}");
    }

    #[test]
    fn tori_have_four_crossings() {
        let (large, small) = (1.0, 0.4);
        let body = faces(&torus(large, small, TAU));
        let mut numbers = Numbers(12);
        let mut four = 0;
        for _ in 0..200 {
            let (from, to) = (numbers.point(-1.5, 1.5), numbers.point(-1.0, 1.0));
            let along = (to - from) / 40.0;
            let start = from;
            // (|x|² + R² - r²)² - 4 R² (x² + y²), sampled signs bracket its roots.
            let f = |s: f64| {
                let p = start + along * s;
                let k = p.length_squared() + large * large - small * small;
                k * k - 4.0 * large * large * p.truncate().length_squared()
            };
            let mut roots = Vec::new();
            for i in 0..2020 {
                let (mut a, mut b) = (-1.0 + f64::from(i) * 0.05, -0.95 + f64::from(i) * 0.05);
                if f(a) * f(b) < 0.0 {
                    for _ in 0..60 {
                        let m = 0.5 * (a + b);
                        if f(a) * f(m) <= 0.0 { b = m } else { a = m }
                    }
                    roots.push(a);
                }
            }
            four += usize::from(roots.len() == 4);
            check(&body, start, along, &roots);
        }
        assert!(four > 5, "{four}");
    }

    #[test]
    fn lines_in_faces_and_along_them() {
        // In the cap's plane, all of the chord is held.
        for disc in [biquadratic(), polar(TAU)] {
            let body = faces(&frustum(1.0, 1.0, 1.0, &disc));
            for y in [0.0_f64, 0.3, 0.7, 0.99] {
                let half = (1.0 - y * y).sqrt();
                let list = intervals(
                    &body,
                    DVec3::new(-2.0, y, 1.0),
                    DVec3::X * 0.01,
                    [-1.0, 400.0],
                );
                for i in 0..=1000 {
                    let x = -half + 2.0 * half * f64::from(i) / 1000.0;
                    assert!(holds(&list, (x + 2.0) / 0.01, 1e-9), "{x} at {y}");
                }
                assert!(list.len() < 400, "{}", list.len());
            }
            // Along a line of the side, and touching it across.
            let list = intervals(
                &body,
                DVec3::new(0.6, 0.8, -1.0),
                DVec3::Z * 0.01,
                [-1.0, 400.0],
            );
            for i in 0..=100 {
                assert!(holds(&list, 100.0 + f64::from(i), 1e-9), "{i} of {list:?}");
            }
            let list = intervals(
                &body,
                DVec3::new(-2.0, 1.0, 0.5),
                DVec3::X * 0.1,
                [-1.0, 99.0],
            );
            assert!(holds(&list, 20.0, 1e-9), "{list:?}");
            assert!(list.iter().all(|[a, b]| *a > 19.9 && *b < 20.1), "{list:?}");
        }
        let ball = faces(&ball(1.0, &biquadratic()));
        for along in [DVec3::X, DVec3::new(0.6, -0.8, 0.0)] {
            let list = intervals(&ball, DVec3::Z - along * 2.0, along * 0.1, [-1.0, 99.0]);
            assert!(holds(&list, 20.0, 1e-9), "{list:?}");
            assert!(
                list.iter().all(|[a, b]| *a > 19.9 && *b < 20.1) && list.len() < 200,
                "{list:?}"
            );
        }
        let ring = faces(&torus(1.0, 0.4, TAU));
        // The plane that touches a torus along a circle.
        let list = intervals(
            &ring,
            DVec3::new(-2.0, 0.0, 0.4),
            DVec3::X * 0.1,
            [-1.0, 99.0],
        );
        assert!(
            holds(&list, 10.0, 1e-9) && holds(&list, 30.0, 1e-9),
            "{list:?}"
        );
        // A line along the edge of a block.
        let block = faces(&block([0.0; 3], [1.0; 3]));
        let list = intervals(
            &block,
            DVec3::new(-1.0, 0.0, 0.0),
            DVec3::X * 0.01,
            [-1.0, 400.0],
        );
        for i in 100..=200 {
            assert!(holds(&list, f64::from(i), 1e-12), "{i} of {list:?}");
        }
    }

    #[test]
    fn bent_blocks_change_sides_only_at_crossings() {
        // Between crossings the distance has no zero: its sign along the row is that of the number of
        // changes, and each change of a plane's side is held.
        let mut numbers = Numbers(13);
        for _ in 0..4 {
            let by: Vec<f64> = (0..108)
                .map(|_| numbers.next().expect("endless") * 0.4 - 0.2)
                .collect();
            let body = faces(&bent(&by));
            for _ in 0..40 {
                let start = numbers.point(-0.5, 2.5);
                let along = numbers.point(-0.05, 0.05);
                let list = intervals(&body, start, along, [-1.0, 100.0]);
                let mut s = -1.0;
                while s < 100.0 {
                    let d = body.distance(start + along * s, f64::INFINITY);
                    assert!(
                        d > 1e-9 || holds(&list, s, 1e-6),
                        "{s} is at {d:e}, {list:?}"
                    );
                    // Sphere tracing: no face is met before the next step.
                    s += (d / along.length()).max(1e-9);
                    if d <= 1e-9 {
                        let past = list.iter().filter(|i| i[0] - 1e-6 <= s && s <= i[1] + 1e-6);
                        s = past.fold(s, |s, i| s.max(i[1] + 1e-6)) + 1e-6;
                    }
                }
            }
        }
    }

    #[test]
    fn scales_offsets_and_senseless_lines() {
        for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let place = |p: [f64; 3]| p.map(|x| x * scale + offset);
            let body = faces(&mapped(&ball(1.0, &biquadratic()), place));
            let start = DVec3::from_array(place([-2.0, 0.1, 0.3]));
            let along = DVec3::X * (0.01 * scale);
            let list = intervals(&body, start, along, [-1.0, 400.0]);
            let half = (1.0 - 0.01 - 0.09_f64).sqrt();
            for x in [-half, half] {
                assert!(
                    holds(&list, (x + 2.0) / 0.01, 1e-6),
                    "{scale} {offset} {list:?}"
                );
            }
            assert!(list.len() < 8);
        }
        let body = faces(&ball(1.0, &biquadratic()));
        for (start, along) in [
            (DVec3::ZERO, DVec3::ZERO),
            (DVec3::NAN, DVec3::X),
            (DVec3::ZERO, DVec3::INFINITY),
        ] {
            let mut list = Vec::new();
            body.line(start, along, [-1.0, 9.0], 0.0, &mut |a, b| {
                list.push([a, b])
            });
            assert_eq!(list, [[-1.0, 9.0]]);
        }
    }
}
