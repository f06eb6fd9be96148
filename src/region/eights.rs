//! The distance to the nearest feature of a list.
//!
//! Lanes hold squares, of which the least is kept: its root is taken once. The plain loop and the wide ones give the
//! same bits, as nothing depends on the order of the list.

use super::shapes::{LANES, Shape, Shapes};
use crate::math::Kernel;
use pulp::Simd;

/// Eight features, the last repeated where there are fewer.
#[derive(Debug, Clone)]
pub(super) struct Eight {
    shapes: Shapes,
    /// None of these and of those after them is nearer to the list's centre.
    beyond: f64,
}

/// Features with their distances from a centre, which rise, in eights.
pub(super) fn in_eights(list: &[(Shape, f64)]) -> impl Iterator<Item = Eight> {
    list.chunks(LANES).map(|part| {
        let shapes: smallvec::SmallVec<[Shape; LANES]> = part.iter().map(|(s, _)| *s).collect();
        Eight {
            shapes: Shapes::new(&shapes),
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

impl pulp::WithSimd for Nearest<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut least = f64::INFINITY;
        for eight in self.eights {
            // No feature is nearer to the point than to the centre by more than `away`.
            let beyond = eight.beyond - self.away;
            if beyond > 0.0 && beyond * beyond > least {
                break;
            }
            let mut squares = [0.0; LANES];
            let (lanes, _) = S::as_mut_simd_f64s(&mut squares);
            for (n, lane) in lanes.iter_mut().enumerate() {
                *lane = eight.shapes.lanes::<S>(n).squares(simd, self.q);
            }
            for square in squares {
                least = if square < least { square } else { least };
            }
        }
        least.sqrt()
    }
}
