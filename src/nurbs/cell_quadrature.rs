//! Integrals over the Bézier cells of a map: product Gauss rules, lengthened and halved until they
//! agree.
//!
//! ```text
//!   I       = G(n) + Σ_k (G(n, next n_k) - G(n))        value
//!   error   = Σ_k |G(n, next n_k) - G(n)|  +  rounding
//! ```
//!
//! In a box the rules grow, in each direction apart, until the next longer one changes nothing; where
//! the longest does not get there the box is halved in that direction, the worst box first. The
//! estimate is the error of G(n), which the sum of the changes removes to first order; for analytic
//! integrands what is left is smaller by orders, and at a crease or a tip the boxes close in.
//!
//! A rule's points are a tensor grid, so A, w and their derivatives are summed one direction after
//! the other.
//!
//! * Shapes: K integrals at once over N parameters in [0, 1].
//! * Accuracy: [`AGREEMENT`] of the integral of absolute values for each direction, and [`ROUNDING`]
//!   of it for rounding, both counted in the estimate.
//! * Work: [`POINTS`] points for a cell at most; then the best there is, with its estimate.
//! * Source: Press et al., *Numerical Recipes*, 3rd ed., §4.6 and §4.8.

use super::net::{indices, map_rows, place};
use super::tensor_bezier::{CentredCell, Spans};
use super::{Homogeneous, NurbsError, NurbsTensor};
use crate::math::dd::{Dd, Real};
use crate::math::gauss::nodes;
use crate::math::quadrature::Integral;
use crate::math::tolerance::U;
use rayon::prelude::*;
use std::sync::LazyLock;

/// Points of the rules, shortest first.
const ORDERS: [usize; 10] = [3, 5, 8, 10, 13, 16, 20, 24, 28, 32];

/// Change of a rule, as a share of the integral of absolute values, that counts as none.
const AGREEMENT: f64 = 2e-15;

/// What rounding may have done, as a share of the integral of absolute values: some tens of units
/// in the last place go into a determinant, and few of them have the same sign.
const ROUNDING: f64 = 32.0 * U;

/// Rounding of a cell's control points, as a share of their distance from its middle: the knots and weights they are
/// made with have it. It moves the cell's faces, which counts where the cell is thin.
const MOVED: f64 = 4.0 * U;

/// Points of one cell, at most; about a second's work.
const POINTS: usize = 2_000_000;

/// Nodes and weights on [0, 1] of each of the [`ORDERS`].
static RULES: LazyLock<Vec<Vec<(f64, f64)>>> = LazyLock::new(|| {
    let rule = |&n: &usize| {
        let pairs = nodes(n).into_iter();
        pairs.map(|(x, w)| (x.f64(), w.f64())).collect()
    };
    ORDERS.iter().map(rule).collect()
});

/// K integrals over each cell, with the origin about which the integrand got its points.
///
/// * `integrand`: from A, w and their derivatives, the K values and what their rounding is relative
///   to.
/// * `powers`: for each of the K, the power of the distance from the middle that it has beside the N derivatives.
#[allow(
    clippy::type_complexity,
    reason = "an origin and K integrals for each cell"
)]
pub(super) fn integrate_cells<const N: usize, const K: usize>(
    map: &NurbsTensor<N>,
    integrand: impl Fn(Homogeneous<3>, &[Homogeneous<3>; N]) -> ([f64; K], [f64; K]) + Sync,
    powers: [i32; K],
) -> Result<Vec<([f64; 3], [Integral; K])>, NurbsError> {
    let spans = Spans::new(map);
    let cells: Vec<_> = indices(spans.cells).collect();
    let degrees = map.degrees();
    let one = |index| {
        let CentredCell { origin, points, .. } = map.centred_cell(&spans, index)?;
        let cell = Cell {
            degrees,
            points,
            integrand: &integrand,
        };
        let (moved, reach) = cell.moved();
        let mut parts: [Integral; K] = cell.integrate();
        for (part, power) in parts.iter_mut().zip(powers) {
            part.error += moved * reach.powi(power);
        }
        Ok((origin, parts))
    };
    cells.into_par_iter().map(one).collect()
}

/// One cell and what is integrated over it.
struct Cell<'a, F, const N: usize> {
    degrees: [usize; N],
    points: Vec<Homogeneous<3>>,
    integrand: &'a F,
}

/// Sums of one rule over a box: of the integrands and of the sizes of their terms.
#[derive(Clone, Copy)]
struct Rule<const K: usize> {
    values: [f64; K],
    sizes: [f64; K],
}

/// A box of parameters with the integrals over it.
struct Panel<const N: usize, const K: usize> {
    start: [f64; N],
    size: [f64; N],
    result: Rule<K>,
    errors: [f64; K],
    /// The direction whose rule changed most.
    worst: usize,
}

impl<F, const N: usize, const K: usize> Cell<'_, F, N>
where
    F: Fn(Homogeneous<3>, &[Homogeneous<3>; N]) -> ([f64; K], [f64; K]) + Sync,
{
    /// What the rounding of the control points may do to the content of the cell, and how far they are from its middle:
    /// a direction's width moves by the rounding, times what the others span.
    fn moved(&self) -> (f64, f64) {
        let points: Vec<[f64; 3]> = self.points.iter().map(|h| h.to_point()).collect();
        let length = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let reach = points.iter().fold(0.0_f64, |m, p| m.max(length(*p)));
        let mut stride = 1;
        let spans = self.degrees.map(|p| {
            let pairs = (0..points.len()).filter(|i| i / stride % (p + 1) < p);
            let widest = pairs.fold(0.0_f64, |m, i| {
                let (a, b) = (points[i], points[i + stride]);
                m.max(length(std::array::from_fn(|c| b[c] - a[c])))
            });
            stride *= p + 1;
            #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
            let span = p as f64 * widest;
            span
        });
        let others = |k: usize| {
            (0..N)
                .filter(|j| *j != k)
                .map(|j| spans[j])
                .product::<f64>()
        };
        (MOVED * reach * (0..N).map(others).sum::<f64>(), reach)
    }

    /// The integrals over the cell.
    fn integrate(&self) -> [Integral; K] {
        let polynomial = self.points.windows(2).all(|h| h[0].weight == h[1].weight);
        let exact = (self.degrees).map(|p| ORDERS.iter().position(|&n| 2 * n >= 5 * p));
        let finished = |result: Rule<K>, errors: [f64; K]| {
            std::array::from_fn(|i| Integral {
                value: result.values[i],
                error: errors[i] + ROUNDING * result.sizes[i],
            })
        };
        // The moments are polynomials; an area's integrand is a root and gets no such promise.
        if K > 1 && polynomial && exact.iter().all(Option::is_some) {
            let orders = exact.map(Option::unwrap_or_default);
            return finished(self.rule([0.0; N], [1.0; N], orders), [0.0; K]);
        }
        let first = self.degrees.map(|p| ORDERS.iter().position(|&n| n > 2 * p));
        let first = first.map(|i| i.unwrap_or(ORDERS.len() - 2).min(ORDERS.len() - 2));
        let whole = self.rule([0.0; N], [1.0; N], first);
        let tolerances = whole.sizes.map(|size| AGREEMENT * size);
        let mut points = 0;
        let mut panel = |start, size| self.panel(start, size, first, &tolerances, &mut points);
        let mut panels = vec![panel([0.0; N], [1.0; N])];
        let excess = |errors: &[f64; K]| {
            let shares = errors.iter().zip(&tolerances);
            shares.fold(0.0_f64, |m, (e, t)| {
                m.max(if *e > *t { e / t } else { 0.0 })
            })
        };
        loop {
            let mut errors = [0.0; K];
            for panel in &panels {
                for (sum, error) in errors.iter_mut().zip(panel.errors) {
                    *sum += error;
                }
            }
            let worst = (0..panels.len())
                .map(|i| (excess(&panels[i].errors), i))
                .filter(|(excess, _)| *excess > 0.0)
                .max_by(|a, b| a.0.total_cmp(&b.0));
            // Three directions may each have changed by a tolerance.
            let done = (errors.iter().zip(&tolerances)).all(|(e, t)| *e <= 4.0 * t);
            let Some((_, i)) = worst.filter(|_| !done) else {
                break;
            };
            let Panel {
                start, size, worst, ..
            } = panels[i];
            let mut half = size;
            half[worst] *= 0.5;
            let mut after = start;
            after[worst] += half[worst];
            if after[worst] <= start[worst] {
                break;
            }
            let mut panel = |start, size| self.panel(start, size, first, &tolerances, &mut points);
            panels[i] = panel(start, half);
            panels.push(panel(after, half));
            if points > POINTS {
                break;
            }
        }
        let mut sum = Rule {
            values: [0.0; K],
            sizes: [0.0; K],
        };
        let mut values = [Dd::ZERO; K];
        let mut errors = [0.0; K];
        for panel in &panels {
            for i in 0..K {
                values[i] = values[i] + Dd::of(panel.result.values[i]);
                sum.sizes[i] += panel.result.sizes[i];
                errors[i] += panel.errors[i];
            }
        }
        sum.values = values.map(Real::f64);
        finished(sum, errors)
    }

    /// The integrals over a box, with rules as long as they need to be, or the longest.
    fn panel(
        &self,
        start: [f64; N],
        size: [f64; N],
        first: [usize; N],
        tolerances: &[f64; K],
        points: &mut usize,
    ) -> Panel<N, K> {
        let mut orders = first;
        loop {
            let base = self.rule(start, size, orders);
            let mut result = base;
            let mut errors = [0.0; K];
            let mut next = orders;
            let mut worst = (0.0, 0);
            for k in 0..N {
                let mut longer = orders;
                longer[k] += 1;
                *points += longer.iter().map(|&i| ORDERS[i]).product::<usize>();
                let rule = self.rule(start, size, longer);
                let mut excess = 0.0_f64;
                for i in 0..K {
                    let change = rule.values[i] - base.values[i];
                    result.values[i] += change;
                    errors[i] += change.abs();
                    if change.abs() > tolerances[i] {
                        excess = excess.max(change.abs() / tolerances[i]);
                    }
                }
                if excess > worst.0 {
                    worst = (excess, k);
                }
                if excess > 0.0 && longer[k] + 1 < ORDERS.len() {
                    next[k] = longer[k];
                }
            }
            if next == orders || *points > POINTS {
                return Panel {
                    start,
                    size,
                    result,
                    errors,
                    worst: worst.1,
                };
            }
            orders = next;
        }
    }

    /// One product rule over a box.
    fn rule(&self, start: [f64; N], size: [f64; N], orders: [usize; N]) -> Rule<K> {
        let counts = self.degrees.map(|p| p + 1);
        // What is asked for: the value, and the derivative by each parameter.
        let mut nets = vec![(None, (counts, self.points.clone()))];
        for k in 0..N {
            let basis: Vec<_> = RULES[orders[k]]
                .iter()
                .map(|&(x, _)| bernstein(self.degrees[k], start[k] + size[k] * x))
                .collect();
            let sum = |row: &[Homogeneous<3>], functions: &[f64]| {
                let pairs = functions.iter().zip(row);
                pairs.fold(Homogeneous::ZERO, |sum, (&b, &h)| sum.plus(b, h))
            };
            nets = nets
                .into_iter()
                .flat_map(|(derived, (counts, net))| {
                    let values = map_rows(counts, &net, k, |row| {
                        basis.iter().map(|(b, _)| sum(row, b)).collect()
                    });
                    let slopes = derived.is_none().then(|| {
                        let net = map_rows(counts, &net, k, |row| {
                            basis.iter().map(|(_, d)| sum(row, d)).collect()
                        });
                        (Some(k), net)
                    });
                    std::iter::once((derived, values)).chain(slopes)
                })
                .collect();
        }
        let counts = orders.map(|i| ORDERS[i]);
        let mut slots: [usize; N] = [0; N];
        let mut value = 0;
        for (slot, (derived, _)) in nets.iter().enumerate() {
            match derived {
                Some(k) => slots[*k] = slot,
                None => value = slot,
            }
        }
        let mut values = [Dd::ZERO; K];
        let mut sizes = [0.0; K];
        for index in indices(counts) {
            let at = place(counts, index);
            let weight: f64 = (0..N)
                .map(|k| size[k] * RULES[orders[k]][index[k]].1)
                .product();
            let slopes = slots.map(|slot| nets[slot].1.1[at]);
            let (f, s) = (self.integrand)(nets[value].1.1[at], &slopes);
            for i in 0..K {
                values[i] = values[i] + Dd::of(weight * f[i]);
                sizes[i] += weight * s[i];
            }
        }
        Rule {
            values: values.map(Real::f64),
            sizes,
        }
    }
}

/// The Bernstein polynomials of degree p at t, and their derivatives.
fn bernstein(p: usize, t: f64) -> (Vec<f64>, Vec<f64>) {
    let mut values = vec![1.0];
    let mut slopes = vec![0.0];
    for degree in 1..=p {
        let lower = values;
        let at = |i: usize| lower.get(i).copied().unwrap_or(0.0);
        let before = |i: usize| i.checked_sub(1).map_or(0.0, at);
        values = (0..=degree)
            .map(|i| (1.0 - t) * at(i) + t * before(i))
            .collect();
        if degree == p {
            slopes = (0..=p).map(|i| p as f64 * (before(i) - at(i))).collect();
        }
    }
    (values, slopes)
}
