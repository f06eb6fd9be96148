//! Curves of a profile, and the rational Bézier pieces they are made of.
//!
//! Everything here is in double-double: the weight `cos(δ/2)` of an arc, the points of an
//! interpolating curve or the control points of a knot span are irrational or rounded numbers in
//! f64, and the solid is that of the numbers in the scene, not of their roundings.
//!
//! Source: Piegl & Tiller, *The NURBS Book*, 2nd ed.: blossoms and Bézier extraction §5.6, arcs §7.3.

use super::interpolate::{self, Ends};
use crate::math::{Dd, Real};

/// A curve of the meridian half-plane, coordinates (r, z) in scene units.
#[derive(Debug, Clone, PartialEq)]
pub enum ProfileCurve {
    /// A NURBS curve on its domain `[u_d, u_{n+1}]`; knots clamped or not.
    Nurbs {
        /// Degree d.
        degree: usize,
        /// n + d + 2 knots, non-decreasing; where d + 1 of them inside are equal, the curve falls into two.
        knots: Vec<f64>,
        /// n + 1 control points.
        points: Vec<[f64; 2]>,
        /// n + 1 positive weights.
        weights: Vec<f64>,
    },
    /// Straight segments through the points.
    Polyline {
        /// At least two points.
        points: Vec<[f64; 2]>,
    },
    /// An arc of an ellipse, from one angle to another; clockwise when `from > to`.
    Arc {
        /// Centre.
        center: [f64; 2],
        /// Half axes along r and z before the tilt; equal for a circle.
        radii: [f64; 2],
        /// Turn of the half axes, in degrees from +r towards +z.
        tilt: f64,
        /// Start angle in degrees.
        from: f64,
        /// End angle in degrees, at most a turn away.
        to: f64,
    },
    /// The spline through the points, with chord-length parameters.
    Interpolate {
        /// At least two points, of a closed one three, no two consecutive ones equal.
        points: Vec<[f64; 2]>,
        /// Degree; of an open one reduced to the number of points and tangents less one where there are few, of a
        /// closed one odd.
        degree: usize,
        /// Whether and how it ends.
        ends: Ends,
    },
    /// A curve run backwards.
    Reversed(Box<ProfileCurve>),
}

/// A homogeneous point (w r, w z, w).
pub(crate) type HomogeneousPoint = [Dd; 3];

/// A rational Bézier piece of a curve.
#[derive(Debug, Clone)]
pub(crate) struct Bezier {
    pub(crate) points: Vec<HomogeneousPoint>,
    /// The part of the curve's own parameter it covers.
    pub(crate) interval: [f64; 2],
    /// Centre and radius, where the piece is part of a circle.
    pub(crate) circle: Option<([Dd; 2], Dd)>,
}

impl Bezier {
    pub(super) fn segment(a: [Dd; 2], b: [Dd; 2], interval: [f64; 2]) -> Self {
        let lift = |p: [Dd; 2]| [p[0], p[1], Dd::ONE];
        Self {
            points: vec![lift(a), lift(b)],
            interval,
            circle: None,
        }
    }
}

pub(super) fn exact(p: [f64; 2]) -> [Dd; 2] {
    p.map(Dd::of)
}

/// Parameters inside a curve at which it falls into two, since as many knots as a clamped end has are equal there.
pub(crate) fn breaks(curve: &ProfileCurve) -> Vec<f64> {
    match curve {
        ProfileCurve::Nurbs {
            degree,
            knots,
            points,
            ..
        } => (degree + 1..points.len())
            .filter(|&i| {
                let ends = [knots.get(*degree), knots.get(points.len())];
                knots.get(i) == knots.get(i - degree) && !ends.contains(&knots.get(i))
            })
            .map(|i| knots[i])
            .collect(),
        ProfileCurve::Reversed(inner) => breaks(inner),
        _ => Vec::new(),
    }
}

/// The points of a polyline, and whether it runs backwards.
pub(crate) fn polyline(curve: &ProfileCurve) -> Option<(&[[f64; 2]], bool)> {
    match curve {
        ProfileCurve::Polyline { points } => Some((points, false)),
        ProfileCurve::Reversed(inner) => polyline(inner).map(|(points, back)| (points, !back)),
        _ => None,
    }
}

/// The Bézier pieces of a curve, head to tail; but for [`breaks`], neighbours share their end points to the last bit.
pub(crate) fn beziers(curve: &ProfileCurve) -> Result<Vec<Bezier>, String> {
    let breaks = breaks(curve);
    let mut pieces = match curve {
        ProfileCurve::Nurbs {
            degree,
            knots,
            points,
            weights,
        } => {
            let knots: Vec<Dd> = knots.iter().copied().map(Dd::of).collect();
            let points: Vec<HomogeneousPoint> = points
                .iter()
                .zip(weights)
                .map(|(p, &w)| [Dd::product(p[0], w), Dd::product(p[1], w), Dd::of(w)])
                .collect();
            if *degree == 0 || points.len() <= *degree || knots.len() != points.len() + degree + 1 {
                return Err(format!(
                    "has degree {degree}, {} control points and {} knots; the counts must satisfy knots = control points + degree + 1",
                    points.len(),
                    knots.len()
                ));
            }
            extract(*degree, &knots, &points)
        }
        ProfileCurve::Polyline { points } => {
            if points.len() < 2 {
                return Err(format!(
                    "has {} points; a polyline needs at least 2",
                    points.len()
                ));
            }
            #[allow(clippy::cast_precision_loss, reason = "a count")]
            points
                .windows(2)
                .enumerate()
                .map(|(i, w)| Bezier::segment(exact(w[0]), exact(w[1]), [i as f64, i as f64 + 1.0]))
                .collect()
        }
        ProfileCurve::Arc {
            center,
            radii,
            tilt,
            from,
            to,
        } => arc(*center, *radii, *tilt, *from, *to)?,
        ProfileCurve::Interpolate {
            points,
            degree,
            ends,
        } => interpolate::pieces(points, *degree, *ends)?,
        ProfileCurve::Reversed(inner) => {
            let mut pieces = beziers(inner)?;
            pieces.reverse();
            for piece in &mut pieces {
                piece.points.reverse();
                piece.interval.reverse();
            }
            return Ok(pieces);
        }
    };
    for i in 1..pieces.len() {
        if breaks.contains(&pieces[i].interval[0]) {
            continue;
        }
        let joint = *pieces[i - 1].points.last().expect("a piece has points");
        let next = &mut pieces[i].points[0];
        // The two spans agree on their joint in exact arithmetic, up to a common factor.
        let ratio = next[2] / joint[2];
        *next = if ratio == Dd::ONE {
            joint
        } else {
            joint.map(|c| c * ratio)
        };
    }
    Ok(pieces)
}

/// Bézier pieces of the non-empty knot spans, each control point a blossom value.
pub(super) fn extract(degree: usize, knots: &[Dd], points: &[HomogeneousPoint]) -> Vec<Bezier> {
    let mut pieces = Vec::new();
    for span in degree..points.len() {
        let (a, b) = (knots[span], knots[span + 1]);
        if a >= b {
            continue;
        }
        let local = &points[span - degree..=span];
        let piece = (0..=degree)
            .map(|j| blossom(degree, knots, span, local, a, b, j))
            .collect();
        pieces.push(Bezier {
            points: piece,
            interval: [a.f64(), b.f64()],
            circle: None,
        });
    }
    pieces
}

/// The blossom with `from_b` arguments equal to `b` and the rest equal to `a`.
fn blossom(
    degree: usize,
    knots: &[Dd],
    span: usize,
    local: &[HomogeneousPoint],
    a: Dd,
    b: Dd,
    from_b: usize,
) -> HomogeneousPoint {
    let mut work: Vec<HomogeneousPoint> = local.to_vec();
    for r in 1..=degree {
        let x = if r <= from_b { b } else { a };
        for i in (r..=degree).rev() {
            let (lo, hi) = (knots[span - degree + i], knots[span + i - r + 1]);
            let alpha = (x - lo) / (hi - lo);
            let beta = Dd::ONE - alpha;
            for c in 0..3 {
                work[i][c] = beta * work[i - 1][c] + alpha * work[i][c];
            }
        }
    }
    work[degree]
}

/// Quadratic pieces of at most 90 degrees: on-points of weight 1, middle points of weight cos(δ/2).
fn arc(
    center: [f64; 2],
    radii: [f64; 2],
    tilt: f64,
    from: f64,
    to: f64,
) -> Result<Vec<Bezier>, String> {
    let sweep = Dd::sum(to, -from);
    let turn = sweep.f64().abs();
    if !(turn > 0.0 && turn <= 360.0) {
        return Err(format!(
            "turns from {from} to {to} degrees; an arc must turn by more than 0 and at most 360"
        ));
    }
    let count = (turn / 90.0).ceil();
    let step = sweep / Dd::of(count);
    let (tilt_sin, tilt_cos) = Dd::of(tilt).sin_cos_degrees();
    let (_, weight) = (step / Dd::of(2.0)).sin_cos_degrees();
    let at = |angle: Dd, weight: Dd| -> HomogeneousPoint {
        let (s, c) = angle.sin_cos_degrees();
        let (x, y) = (Dd::of(radii[0]) * c, Dd::of(radii[1]) * s);
        // A middle point lies at 1/cos(δ/2) times the radius and has weight cos(δ/2), so its
        // homogeneous offset is that of the rim itself.
        [
            Dd::of(center[0]) * weight + (x * tilt_cos - y * tilt_sin),
            Dd::of(center[1]) * weight + (x * tilt_sin + y * tilt_cos),
            weight,
        ]
    };
    let circle = (radii[0] == radii[1]).then(|| (center.map(Dd::of), Dd::of(radii[0])));
    let mut pieces = Vec::new();
    let mut i = 0.0;
    while i < count {
        let angle = |k: f64| Dd::of(from) + step * Dd::of(k);
        // The last angle is the given one, so that a full turn closes exactly.
        let end = if i + 1.0 == count {
            Dd::of(to)
        } else {
            angle(i + 1.0)
        };
        pieces.push(Bezier {
            points: vec![
                at(angle(i), Dd::ONE),
                at(angle(i + 0.5), weight),
                at(end, Dd::ONE),
            ],
            interval: [angle(i).f64(), end.f64()],
            circle,
        });
        i += 1.0;
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bernstein::evaluate;

    fn at(b: &Bezier, t: f64) -> [Dd; 2] {
        let c = [0, 1, 2].map(|k| {
            evaluate(
                &b.points.iter().map(|p| p[k]).collect::<Vec<_>>(),
                Dd::of(t),
            )
        });
        [c[0] / c[2], c[1] / c[2]]
    }

    #[test]
    fn arcs_lie_on_their_circle_to_thirty_digits() {
        for (from, to) in [(0.0, 360.0), (350.0, 370.0), (90.0, -200.0), (17.0, 18.0)] {
            let pieces = beziers(&ProfileCurve::Arc {
                center: [3.0, -1.0],
                radii: [0.7, 0.7],
                tilt: 0.0,
                from,
                to,
            })
            .expect("an arc");
            for piece in &pieces {
                for i in 0..=8 {
                    let p = at(piece, f64::from(i) / 8.0);
                    let d = [p[0] - Dd::of(3.0), p[1] + Dd::ONE];
                    let off = (d[0] * d[0] + d[1] * d[1]).sqrt() - Dd::of(0.7);
                    assert!(off.abs().f64() < 1e-30, "{from}..{to}: off by {off:?}");
                }
            }
        }
    }

    #[test]
    fn a_full_turn_closes_exactly() {
        let pieces = beziers(&ProfileCurve::Arc {
            center: [1.0, 0.0],
            radii: [0.35, 0.35],
            tilt: 0.0,
            from: 0.0,
            to: 360.0,
        })
        .expect("a circle");
        assert_eq!(pieces.len(), 4);
        assert_eq!(pieces[0].points[0], pieces[3].points[2]);
    }

    #[test]
    fn interpolating_curves_pass_through_their_points() {
        let points: Vec<[f64; 2]> = (0..23)
            .map(f64::from)
            .map(|t| [2.0 + (0.7 * t).sin(), t * 0.3 + (t * 1.9).cos() * 0.2])
            .collect();
        for degree in 1..=7 {
            let pieces = beziers(&ProfileCurve::Interpolate {
                points: points.clone(),
                degree,
                ends: Ends::FREE,
            })
            .expect("a curve");
            let ends: Vec<[Dd; 2]> = pieces.iter().map(|b| at(b, 0.0)).collect();
            assert_eq!(ends[0], exact(points[0]));
            for p in &points {
                let nearest = pieces
                    .iter()
                    .flat_map(|b| (0..=400).map(move |i| at(b, f64::from(i) / 400.0)))
                    .map(|q| (q[0].f64() - p[0]).hypot(q[1].f64() - p[1]))
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest < 5e-3, "degree {degree}: {nearest} from {p:?}");
            }
        }
    }
}
