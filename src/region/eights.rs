//! Features of a boundary eight by eight, for the distance to the nearest of a list.
//!
//! ```text
//!   between the normals at an arc's ends   |u / (1 + S)|, as in super::chain
//!   beyond                                 the nearer end
//! ```
//!
//! Lanes hold squares, of which the least is kept: its root is taken once. The plain loop and the wide ones give the
//! same bits, as nothing depends on the order of the list.

use super::chain::Shape;
use crate::math::Kernel;

/// Features of a lane each.
const LANES: usize = 8;

/// Eight features, the last repeated where there are fewer.
#[derive(Debug, Clone)]
pub(super) struct Eight {
    start: [[f64; LANES]; 2],
    end: [[f64; LANES]; 2],
    /// Unit tangents; not numbers where there is but the point.
    from: [[f64; LANES]; 2],
    to: [[f64; LANES]; 2],
    curvature: [f64; LANES],
    /// None of these and of those after them is nearer to the list's centre.
    beyond: f64,
}

/// Features with their distances from a centre, which rise, in eights.
pub(super) fn in_eights(list: &[(Shape, f64)]) -> impl Iterator<Item = Eight> {
    list.chunks(LANES).map(|part| {
        let lane = |n: usize| &part[n.min(part.len() - 1)].0;
        let point =
            |of: fn(&Shape) -> [f64; 2]| [0, 1].map(|c| std::array::from_fn(|n| of(lane(n))[c]));
        Eight {
            start: point(|s| s.start),
            end: point(|s| s.end),
            from: point(|s| s.from),
            to: point(|s| s.to),
            curvature: std::array::from_fn(|n| lane(n).curvature),
            // A hair less covers its rounding.
            beyond: part[0].1 * (1.0 - 1e-9),
        }
    })
}

/// The distance from `q`, which is `away` from the centre of the eights, to the nearest of them.
pub(super) fn nearest(kernel: Kernel, eights: &[Eight], q: [f64; 2], away: f64) -> f64 {
    let job = Nearest { eights, q, away };
    kernel.dispatch(job)
}

struct Nearest<'a> {
    eights: &'a [Eight],
    q: [f64; 2],
    away: f64,
}

impl pulp::NullaryFnOnce for Nearest<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let mut least = f64::INFINITY;
        for eight in self.eights {
            // No feature is nearer to the point than to the centre by more than `away`.
            let beyond = eight.beyond - self.away;
            if beyond > 0.0 && beyond * beyond > least {
                break;
            }
            let mut squares = [0.0; LANES];
            for n in 0..LANES {
                let [ax, az] = [self.q[0] - eight.start[0][n], self.q[1] - eight.start[1][n]];
                let [bx, bz] = [self.q[0] - eight.end[0][n], self.q[1] - eight.end[1][n]];
                let (aa, bb) = (ax * ax + az * az, bx * bx + bz * bz);
                let [fx, fz] = [eight.from[0][n], eight.from[1][n]];
                let [tx, tz] = [eight.to[0][n], eight.to[1][n]];
                let k = eight.curvature[n];
                let u = 2.0 * (fx * az - fz * ax) - k * aa;
                let rest = 1.0 - k * u;
                let s = (if rest > 0.0 { rest } else { 0.0 }).sqrt();
                let across = u / (1.0 + s);
                let ends = if aa < bb { aa } else { bb };
                let beside = (fx * ax + fz * az >= 0.0) & (tx * bx + tz * bz <= 0.0);
                squares[n] = if beside { across * across } else { ends };
            }
            for square in squares {
                least = if square < least { square } else { least };
            }
        }
        least.sqrt()
    }
}
