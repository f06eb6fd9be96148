//! Exact bounds.
//!
//! The largest coordinate along a world direction u of a turned point is
//!
//! ```text
//!   o·u + s (a z + m r),   a = e₃·u,   m = max over the turn of e(φ)·u
//! ```
//!
//! and a linear function of (r, z) is largest on the boundary, where its derivative changes sign or
//! at an end of a piece.

use super::turn::Turn;
use crate::math::Side;
use crate::math::bernstein::{self, Coefficients};
use crate::math::{Aabb, Dd, Real, Similarity};
use crate::region::FilledPieces;

pub(super) fn bounds(frame: &Similarity, turn: &Turn, boundary: &FilledPieces) -> Aabb {
    let scale = frame.scale_exact();
    Aabb::around(frame.origin_exact(), |k, sign| {
        let sign = Dd::of(sign);
        let [x, y, a] = [0, 1, 2].map(|i| frame.axis_exact(i)[k] * sign);
        let extent = support(boundary, a, largest_over_turn(turn, [x, y]));
        scale * extent * sign
    })
}

/// The largest of v·(cos φ, sin φ) over the turn.
fn largest_over_turn(turn: &Turn, v: [Dd; 2]) -> Dd {
    let length = if v[1] == Dd::ZERO {
        v[0].abs()
    } else if v[0] == Dd::ZERO {
        v[1].abs()
    } else {
        (v[0] * v[0] + v[1] * v[1]).sqrt()
    };
    match turn {
        Turn::Full => length,
        Turn::Partial(wedge) => {
            if wedge.side_exact(v) != Side::Outside && length > Dd::ZERO {
                return length;
            }
            let [s, e] = wedge.directions_exact().map(|d| d[0] * v[0] + d[1] * v[1]);
            if s > e { s } else { e }
        }
    }
}

/// The largest a z + m r on the boundary.
fn support(boundary: &FilledPieces, a: Dd, m: Dd) -> Dd {
    let value = |p: [Dd; 2]| a * p[1] + m * p[0];
    let ends = boundary
        .iter()
        .flat_map(|b| [value(b.piece.start()), value(b.piece.end())]);
    let mut best = ends.fold(Dd::of(f64::NEG_INFINITY), |m, v| if v > m { v } else { m });
    if a == Dd::ZERO || m == Dd::ZERO {
        return best;
    }
    for piece in boundary.iter().map(|b| b.piece).filter(|p| p.degree() > 1) {
        let b = &piece.bounds();
        let (af, mf) = (a.f64(), m.f64());
        let corner = (af * b.min[1]).max(af * b.max[1]) + (mf * b.min[0]).max(mf * b.max[0]);
        if corner < best.f64() {
            continue;
        }
        let f: Coefficients<Dd> = piece.points().map(|p| a * p[1] + m * p[0]).collect();
        let w: Coefficients<Dd> = piece.points().map(|p| p[2]).collect();
        let scale = bernstein::magnitude(&f) * bernstein::magnitude(&w);
        let turning = bernstein::quotient_derivative(&f, &w);
        for t in bernstein::sign_change_parameters(&turning, scale) {
            let v = value(piece.at(t));
            if v > best {
                best = v;
            }
        }
    }
    best
}
