//! Parameter lines of volumes: where they run in the picture, and which parts of them are seen.
//!
//! ```text
//!   outer face X(u, v)  --fix u or v-->  rational Bézier curve  --camera-->  (x, y, depth)
//!      --split until a piece is short and straight-->  points  --seen?-->  runs  -->  ink
//! ```
//!
//! A parallel projection is affine, so a line's control points seen by the camera are those of the
//! line as it is seen. Pieces are halved until their control polygon, which is longer than they are,
//! is below a pixel; every point that is asked for is on the curve to rounding.
//!
//! * Lines: at the knots, and so many evenly spaced between two of them, by the parameters of the
//!   whole volume. Where lines would be nearer to each other than [`LEAST_GAP`] they are left out, by
//!   the length of the control net in space, so that foreshortening does not thin them.
//! * Seen: a point that is on the surface of the composite, is not cut away, and whose ray meets
//!   nothing before it. Where a line goes out of sight is found to a sixteenth of a pixel; parts
//!   shorter than a pixel may be missed.
//! * Ink: where lines cross or join, the darkest counts, so that the weight is even.

use super::camera::Camera;
use super::canvas::{Canvas, centre, length, single, whole};
use super::colour;
use super::field::{Field, Probe};
use super::trace::{Meets, Ray, trace};
use crate::error::Error;
use crate::math::Similarity;
use crate::nurbs::NurbsVolume;
use crate::patch::OuterFace;
use crate::sample::Cancel;
use crate::solid::Body;
use glam::DVec3;
use rayon::prelude::*;

/// The least distance between two lines, in pixels of a picture of 1200 by 900.
const LEAST_GAP: f64 = 4.0;
/// How far behind what its ray meets a point still is seen, and how far off the surface it still is
/// on it, in pixels. The ray goes through the point itself, so slopes do not matter.
const NEAR: [f64; 2] = [0.25, 0.01];
/// The longest piece of a line whose ends alone are looked at, in pixels.
const PIECE: f64 = 1.0;
/// How often a line is halved at most; weights far from each other need many.
const DEPTH: u32 = 40;
/// How often a piece is halved where it goes out of sight.
const HALVINGS: u32 = 4;

/// How lines are drawn.
#[derive(Debug, Clone, Copy)]
struct Stroke {
    /// In pixels of a picture of 1200 by 900.
    width: f64,
    /// How much of what is under them they hide.
    share: f32,
}

/// A line at a knot.
const STRONG: Stroke = Stroke {
    width: 1.9,
    share: 0.80,
};
/// A line between knots.
const FAINT: Stroke = Stroke {
    width: 1.1,
    share: 0.58,
};

/// A homogeneous point as it is seen: (w x, w y) in pixels, w times the depth in scene units, w.
type Seen = [f64; 4];

/// What the lines are seen with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight<'a> {
    pub(super) field: &'a Field<'a>,
    pub(super) camera: Camera,
    /// Widths of lines relative to those of the default size.
    pub(super) stroke: f64,
}

/// A part of a line that is seen, in pixels.
#[derive(Debug, Clone)]
struct Run {
    points: Vec<[f64; 2]>,
    stroke: Stroke,
}

/// Draws the lines at the knots of the volumes' outer faces and `between` more between two of them.
///
/// # Errors
/// [`Error::Interrupted`] when `cancel` says so.
pub(super) fn draw(
    canvas: &mut Canvas,
    [width, height]: [usize; 2],
    sight: Sight<'_>,
    between: usize,
    cancel: Cancel<'_>,
) -> Result<(), Error> {
    let mut faces = Vec::new();
    for part in sight.field.assembly.parts() {
        if let Body::Patches(patches) = &**part.body() {
            let here = patches.faces().faces().iter();
            faces.extend(here.map(|face| (patches.frame(), patches.volumes(), face)));
        }
    }
    if faces.is_empty() {
        return Ok(());
    }
    let runs = faces
        .into_par_iter()
        .map_init(
            || sight.field.probe(f64::INFINITY),
            |probe, (frame, volumes, face)| {
                if cancel() {
                    return Err(Error::Interrupted);
                }
                Ok(sight.face(probe, frame, volumes, face, between))
            },
        )
        .collect::<Result<Vec<_>, Error>>()?;
    let mut ink = Ink {
        size: [width, height],
        share: vec![0; width * height],
    };
    for run in runs.iter().flatten() {
        for ends in run.points.windows(2) {
            ink.stroke(ends[0], ends[1], run.stroke, sight.stroke);
        }
    }
    ink.lay(canvas);
    Ok(())
}

impl Sight<'_> {
    /// The parts of a face's lines that are seen.
    fn face(
        &self,
        probe: &mut Probe,
        frame: &Similarity,
        volumes: &[NurbsVolume],
        face: &OuterFace,
        between: usize,
    ) -> Vec<Run> {
        let net: Vec<Seen> = (face.surface.control_points().iter())
            .map(|h| {
                let [x, y, z] = h.to_point();
                let [x, y, depth] = self.camera.project(frame.to_world(DVec3::new(x, y, z)));
                let w = h.weight;
                [w * x, w * y, w * depth, w]
            })
            .collect();
        let counts = face.surface.counts();
        let others = (0..3).filter(|&k| k != face.parameter);
        let mut runs = Vec::new();
        for (direction, parameter) in others.enumerate() {
            let knots = volumes.get(face.patch).map(|v| &v.knots()[parameter]);
            let Some(span) = knots.and_then(|k| k.spans().nth(face.cell[parameter])) else {
                continue;
            };
            let domain = face.domain[direction];
            // What the whole span measures, where the face is a part of it only.
            let share = (domain[1] - domain[0]) / (span.end - span.start);
            let long = extent(&net, counts, direction, self.camera.scale()) / share;
            let gap = LEAST_GAP * self.stroke;
            if !(long >= gap) {
                continue;
            }
            for (t, strong) in parameters(domain, [span.start, span.end], between) {
                if !strong && long < gap * (length(between) + 1.0) {
                    continue;
                }
                let line = contracted(&net, counts, direction, t);
                let stroke = if strong { STRONG } else { FAINT };
                self.line(probe, &line, stroke, &mut runs);
            }
        }
        runs
    }

    /// Adds the parts of a line that are seen.
    fn line(&self, probe: &mut Probe, line: &[Seen], stroke: Stroke, runs: &mut Vec<Run>) {
        let mut pieces = Vec::new();
        split(line, DEPTH, &mut pieces);
        let Some(first) = pieces.first() else {
            return;
        };
        let mut seen = self.sees(probe, first[0]);
        let mut points = Vec::new();
        if seen {
            points.push(flat(first[0]));
        }
        let mut end = |points: &mut Vec<[f64; 2]>| {
            let points = std::mem::take(points);
            if points.len() > 1 {
                runs.push(Run { points, stroke });
            }
        };
        for piece in &pieces {
            let last = piece[piece.len() - 1];
            let next = self.sees(probe, last);
            if next != seen {
                points.push(self.edge(probe, piece, seen));
            }
            if next {
                points.push(flat(last));
            } else {
                end(&mut points);
            }
            seen = next;
        }
        end(&mut points);
    }

    /// Where a piece goes into or out of sight; `seen` says whether its first point is seen.
    fn edge(&self, probe: &mut Probe, piece: &[Seen], seen: bool) -> [f64; 2] {
        let mut piece = piece.to_vec();
        for _ in 0..HALVINGS {
            let (before, after) = halves(&piece);
            piece = if self.sees(probe, after[0]) == seen {
                after
            } else {
                before
            };
        }
        // The end that is seen.
        flat(piece[if seen { 0 } else { piece.len() - 1 }])
    }

    /// Whether a point of a volume's outer face is on the composite's surface and in sight.
    fn sees(&self, probe: &mut Probe, seen: Seen) -> bool {
        let [x, y] = flat(seen);
        let depth = seen[2] / seen[3];
        let pixel = self.camera.scale();
        let front = self.camera.point(x, y);
        let point = front + self.camera.forward * depth;
        let cut = |p| self.field.cut.map_or(f64::NEG_INFINITY, |c| c.depth(p));
        let near = NEAR[1] * pixel;
        // Half of what is allowed before it: to tell on which side of its own surface a point is takes longest.
        let before = point - self.camera.forward * (0.5 * near);
        if !(cut(point) <= near) || !(self.field.distance(probe, before).abs() <= near) {
            return false;
        }
        // As far back as all of the solid.
        let back = 4.0 * self.field.size;
        let ray = Ray {
            origin: front - self.camera.forward * back,
            direction: self.camera.forward,
        };
        match trace(self.field, probe, ray, 0.0, pixel) {
            Meets::Surface(t) | Meets::Section(t, _) => t >= depth + back - NEAR[0] * pixel,
            Meets::Nothing(_) => true,
        }
    }
}

/// Where a point is in the picture.
fn flat(seen: Seen) -> [f64; 2] {
    [seen[0] / seen[3], seen[1] / seen[3]]
}

/// The parameters, from 0 to 1 of a face, at which lines are drawn, and whether at a knot.
///
/// * `domain`: first and last value of the volume's parameter on the face.
/// * `span`: the two knots that it is between.
fn parameters(
    [a, b]: [f64; 2],
    [start, end]: [f64; 2],
    between: usize,
) -> impl Iterator<Item = (f64, bool)> {
    let first = (a == start).then_some((0.0, true));
    let last = (b == end).then_some((1.0, true));
    let count = length(between) + 1.0;
    let inner = (1..=between).filter_map(move |k| {
        let share = length(k) / count;
        let t = start * (1.0 - share) + end * share;
        // A line at the border of two parts of a face is drawn with either.
        (a <= t && t <= b).then(|| ((t - a) / (b - a), false))
    });
    first.into_iter().chain(inner).chain(last)
}

/// How long the longest row of a net along a direction is, in pixels.
fn extent(net: &[Seen], counts: [usize; 2], direction: usize, scale: f64) -> f64 {
    let (step, other) = steps(counts, direction);
    let at = |h: Seen| DVec3::new(h[0] / h[3], h[1] / h[3], h[2] / h[3] / scale);
    (0..counts[1 - direction])
        .map(|row| {
            (1..counts[direction])
                .map(|i| {
                    let here = row * other + i * step;
                    (at(net[here]) - at(net[here - step])).length()
                })
                .sum()
        })
        .fold(0.0, f64::max)
}

/// How far apart neighbours along a direction and along the other one are in a net.
fn steps(counts: [usize; 2], direction: usize) -> (usize, usize) {
    if direction == 0 {
        (1, counts[0])
    } else {
        (counts[0], 1)
    }
}

/// The curve of a net along which the parameter of a direction is `t`.
fn contracted(net: &[Seen], counts: [usize; 2], direction: usize, t: f64) -> Vec<Seen> {
    let (step, other) = steps(counts, direction);
    (0..counts[1 - direction])
        .map(|row| {
            let mut points: Vec<Seen> = (0..counts[direction])
                .map(|i| net[row * other + i * step])
                .collect();
            for level in (1..points.len()).rev() {
                for i in 0..level {
                    points[i] = mean(points[i], points[i + 1], t);
                }
            }
            points[0]
        })
        .collect()
}

fn mean(a: Seen, b: Seen, t: f64) -> Seen {
    std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t)
}

/// The halves of a rational Bézier curve, by de Casteljau.
fn halves(points: &[Seen]) -> (Vec<Seen>, Vec<Seen>) {
    let mut row = points.to_vec();
    let mut before = Vec::with_capacity(row.len());
    let mut after = Vec::with_capacity(row.len());
    while let (Some(&first), Some(&last)) = (row.first(), row.last()) {
        before.push(first);
        after.push(last);
        for i in 1..row.len() {
            row[i - 1] = mean(row[i - 1], row[i], 0.5);
        }
        row.pop();
    }
    after.reverse();
    (before, after)
}

/// The pieces of a curve whose control polygon, seen, is short.
fn split(points: &[Seen], depth: u32, pieces: &mut Vec<Vec<Seen>>) {
    let steps = points.windows(2).map(|w| {
        let ([x0, y0], [x1, y1]) = (flat(w[0]), flat(w[1]));
        (x1 - x0).hypot(y1 - y0)
    });
    if depth == 0 || steps.sum::<f64>() <= PIECE {
        pieces.push(points.to_vec());
        return;
    }
    let (before, after) = halves(points);
    split(&before, depth - 1, pieces);
    split(&after, depth - 1, pieces);
}

/// How much ink each pixel has, 255 for all that there can be.
struct Ink {
    size: [usize; 2],
    share: Vec<u8>,
}

impl Ink {
    /// A straight line with round ends.
    fn stroke(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke, scale: f64) {
        let half = 0.5 * single(stroke.width * scale);
        let (from, to) = (from.map(single), to.map(single));
        let along = [to[0] - from[0], to[1] - from[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let grow = half + 1.0;
        let low = [0, 1].map(|a| whole(from[a].min(to[a]) - grow));
        let high = [0, 1].map(|a| (whole(from[a].max(to[a]) + grow) + 1).min(self.size[a]));
        for y in low[1]..high[1] {
            for x in low[0]..high[0] {
                let off = [centre(x) - from[0], centre(y) - from[1]];
                let t = if squared > 0.0 {
                    ((off[0] * along[0] + off[1] * along[1]) / squared).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (off[0] - t * along[0]).hypot(off[1] - t * along[1]);
                let covered = (half + 0.5 - distance).clamp(0.0, 1.0).min(2.0 * half);
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a share of 255"
                )]
                let found = (255.0 * stroke.share * covered + 0.5) as u8;
                let share = &mut self.share[y * self.size[0] + x];
                *share = (*share).max(found);
            }
        }
    }

    /// Lays the ink on a picture.
    fn lay(&self, canvas: &mut Canvas) {
        let colour = colour::linear(colour::INK);
        for (y, row) in self.share.chunks(self.size[0]).enumerate() {
            for (pixel, &share) in canvas.row_mut(y).iter_mut().zip(row) {
                if share > 0 {
                    *pixel = colour::mix(*pixel, colour, f32::from(share) / 255.0);
                }
            }
        }
    }
}
