//! The one root of a certified map, with a bound on where it is.
//!
//! Let |DΦ - I| <= κ < 1/2 on the convex set E, and let r be Φ(x) to within e at some x in E. A root
//! y in E satisfies -Φ(x) = M (y - x) with |M - I| <= κ, so
//!
//! ```text
//!   | y - x | <= (|r| + |e|) / (1 - κ)
//!   y_i in x_i - r_i ± (e_i + κ (|r| + |e|) / (1 - κ))              for every root in E
//!   there is one, where the ball of the first line lies in E        (Φ - id contracts it)
//! ```
//!
//! If E has no root, x runs to the point of E where Φ points out of E everywhere it does not vanish,
//! and the second line, taken there, has no part of the box left because κ / (1 - κ) < 1. So both
//! answers are proofs; what remains undecided is rounding.
//!
//! * Units: local coordinates of a window; norms are maxima of coordinates.
//! * Source: R. Krawczyk, *Computing* 4 (1969) 187; R. E. Moore, *SIAM J. Numer. Anal.* 14 (1977) 611.

use super::leaf::{Window, invert};
use crate::math::Real;

/// Φ at a place.
pub(super) struct Sample<T> {
    /// The place, as it was taken.
    pub(super) x: [T; 3],
    /// Φ.
    pub(super) value: [f64; 3],
    /// Bounds on its errors.
    pub(super) error: [f64; 3],
    /// Its derivatives by each coordinate.
    pub(super) slopes: [[f64; 3]; 3],
}

/// Where the cell ends, seen from a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) window: Window,
    pub(super) kappa: f64,
    /// How far outside of the window's lower and upper side a root still matters.
    pub(super) outside: [[f64; 2]; 3],
    /// How far inside of a face of the cell a root still counts as on it.
    pub(super) on: [f64; 3],
    /// Whether the root itself is wanted, to rounding, and not only where it is.
    pub(super) refine: bool,
}

/// Where the root is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Located {
    /// Not in the window.
    Nowhere,
    /// In the cell, away from its faces.
    Inside([f64; 3]),
    /// Within rounding of the faces marked, and inside of all others.
    Near([f64; 3], [[bool; 2]; 3]),
    /// The rounding is too large for an answer.
    Unclear,
}

/// Steps at most; a contraction by 0.45 wins 46 bits in 40.
const STEPS: usize = 48;

/// Finds the root of the map that `sample` evaluates, from `start`.
pub(super) fn locate<T: Real>(
    limits: &Limits,
    start: [T; 3],
    mut sample: impl FnMut([T; 3]) -> Sample<T>,
) -> Located {
    let growth = limits.window.growth();
    let faces: [[bool; 2]; 3] = std::array::from_fn(|k| limits.window.at_face(k));
    let clamp = |x: [T; 3]| -> [T; 3] {
        std::array::from_fn(|k| {
            let (low, high) = (T::of(-growth[k][0]), T::of(1.0 + growth[k][1]));
            // A NaN ends up at the middle.
            if x[k] < low {
                low
            } else if x[k] > high {
                high
            } else if x[k].f64().is_nan() {
                T::of(0.5)
            } else {
                x[k]
            }
        })
    };
    let scale = 1.0 / (1.0 - limits.kappa);
    let mut x = clamp(start);
    let mut simple = false;
    for step in 0..STEPS {
        let s = sample(x);
        x = s.x;
        let size = norm(s.value);
        let noise = norm(s.error);
        let radius = (size + noise) * scale;
        let (mut inside, mut exists) = (true, true);
        let mut near = [[false; 2]; 3];
        for k in 0..3 {
            let spread = s.error[k] + limits.kappa * radius;
            // Distances from both sides, each without cancellation.
            let place = [x[k].f64(), (T::ONE - x[k]).f64()];
            let shift = [-s.value[k], s.value[k]];
            for side in 0..2 {
                let root = place[side] + shift[side];
                if root + spread < -limits.outside[k][side] {
                    return Located::Nowhere;
                }
                exists &= place[side] - radius >= -growth[k][side];
                near[k][side] = faces[k][side] && !(root - spread > limits.on[k]);
                inside &= !near[k][side];
            }
        }
        let at = x.map(Real::f64);
        // Below its error a value has nothing more to say.
        let settled = size <= 4.0 * noise || step + 1 == STEPS;
        if exists && inside && !limits.refine {
            return Located::Inside(at);
        }
        if exists && inside && settled {
            // One more step, to what f64 has.
            let last = invert(s.slopes).map_or(s.value, |inverse| inverse.map(|r| dot(r, s.value)));
            return Located::Inside(std::array::from_fn(|k| at[k] - last[k]));
        }
        if settled && exists {
            return Located::Near(at, near);
        }
        if settled || !size.is_finite() {
            return Located::Unclear;
        }
        let full = match invert(s.slopes) {
            Some(inverse) if !simple => inverse.map(|r| dot(r, s.value)),
            _ => s.value,
        };
        let mut next = clamp(std::array::from_fn(|k| x[k] - T::of(full[k])));
        if next == x {
            // Newton's method rests on the edge of E: from here the contraction leads on.
            simple = true;
            next = clamp(std::array::from_fn(|k| x[k] - T::of(s.value[k])));
            if next == x {
                return if exists && inside {
                    Located::Inside(at)
                } else if exists {
                    Located::Near(at, near)
                } else {
                    Located::Unclear
                };
            }
        }
        x = next;
    }
    Located::Unclear
}

fn norm(v: [f64; 3]) -> f64 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

#[inline]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
