//! The Bernstein form of a Bézier volume's Jacobian determinant, with a bound on its rounding.
//!
//! The sign of det J over a cell is that of the numerator of
//!
//! ```text
//!   det J = det4 [F; F_u; F_v; F_w] / w^4,     F = (w, A)
//! ```
//!
//! a polynomial. Let F' and F'' be the cell without its last and without its first layer in u. Then
//! F = (1 - u) F' + u F'' and F_u = p (F'' - F'), so that
//!
//! ```text
//!   det4 [F; F_u; F_v; F_w] = p det4 [F'; F''; F_v; F_w]
//! ```
//!
//! whose first two rows have the degree p - 1 in u: 4 p - 2 in all, the least there is. In v and w
//! the same step is not free at the same time, and the degree there is one above the least, 4 q - 1.
//! The determinant is Laplace's expansion by pairs of rows; products of Bernstein polynomials are
//! convolutions of their coefficients times binomials.
//!
//! Each coefficient comes with the same expression in absolute values. Times γ(n), n counting the
//! roundings on the way from the control points, that bounds its error; so where control points
//! agree or lie on an axis, the zeros they make are known to be zeros as far as f64 can tell.
//!
//! * Shapes: coefficients with the first index fastest.
//! * Units: any; the cell is moved to the origin and scaled by powers of two to about 1.
//! * Cost: 12 products of (2 p - 1)(2 q + 1)(2 r + 1) by (2 p + 1) 2 q 2 r coefficients for degrees
//!   p, q, r: a tenth of a millisecond for (3, 2, 2), seconds for (12, 12, 12).
//! * Source: Farouki, Rajan, CAGD 5 (1988), §4.3 (products).

use super::Homogeneous;
use super::net::{Net, indices, map_rows, place, window};
use crate::math::bernstein::binomials;
use crate::math::tolerance::gamma;

/// A coefficient and the same sum of products in absolute values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounded {
    /// The rounded value.
    pub(super) value: f64,
    /// What the error is measured by, not below the value's size.
    pub(super) bound: f64,
}

impl Bounded {
    const ZERO: Self = Self {
        value: 0.0,
        bound: 0.0,
    };

    fn minus(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            bound: self.bound + other.bound,
        }
    }

    fn scaled(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            bound: self.bound * factor,
        }
    }
}

/// A polynomial of three variables in Bernstein form, rounded.
#[derive(Debug, Clone)]
pub(super) struct Expansion {
    /// Coefficients along each variable: the degrees and one.
    pub(super) counts: [usize; 3],
    /// The coefficients.
    pub(super) coefficients: Vec<Bounded>,
    /// Roundings each of them went through, at most.
    pub(super) roundings: f64,
}

/// Homogeneous control points of a cell: the values and bounds of their sizes.
pub(super) struct CellNet {
    /// Control points along each variable.
    pub(super) counts: [usize; 3],
    /// The control points about an origin near them.
    pub(super) values: Vec<Homogeneous<3>>,
    /// The same means taken of absolute values.
    pub(super) bounds: Vec<Homogeneous<3>>,
    /// Roundings each of them went through.
    pub(super) roundings: f64,
}

impl Expansion {
    /// The numerator of the Jacobian determinant, up to a positive factor.
    pub(super) fn of_jacobian(cell: &CellNet) -> Self {
        let counts = cell.counts;
        let length = largest(cell.bounds.iter().flat_map(|h| h.weighted));
        let weight = largest(cell.bounds.iter().map(|h| h.weight));
        // Entry e of the 4-vectors: w, x, y, z, brought to about 1 without rounding.
        let scale = [weight, length, length, length].map(to_one);
        let entry = |e: usize| -> Vec<Bounded> {
            let of = |h: &Homogeneous<3>| e.checked_sub(1).map_or(h.weight, |i| h.weighted[i]);
            (cell.values.iter().zip(&cell.bounds))
                .map(|(value, bound)| {
                    Bounded {
                        value: of(value),
                        bound: of(bound),
                    }
                    .scaled(scale[e])
                })
                .collect()
        };
        let entries: [Vec<Bounded>; 4] = std::array::from_fn(entry);
        let mut shorter = counts;
        shorter[0] -= 1;
        let [low, high] = [0, 1].map(|first| {
            (entries.each_ref())
                .map(|e| binomial_form(&(shorter, window(counts, e, [first, 0, 0], shorter))))
        });
        let [along_v, along_w] = [1, 2].map(|k| {
            let p = (counts[k] - 1) as f64;
            (entries.each_ref()).map(|e| {
                binomial_form(&map_rows(counts, e, k, |row| {
                    row.windows(2)
                        .map(|pair| pair[1].minus(pair[0]).scaled(p))
                        .collect()
                }))
            })
        });
        // Laplace: pairs of columns of the upper two rows with the other two of the lower ones.
        const PAIRS: [([usize; 2], [usize; 2], f64); 6] = [
            ([0, 1], [2, 3], 1.0),
            ([0, 2], [1, 3], -1.0),
            ([0, 3], [1, 2], 1.0),
            ([1, 2], [0, 3], 1.0),
            ([1, 3], [0, 2], -1.0),
            ([2, 3], [0, 1], 1.0),
        ];
        let mut sum: Option<Net<Bounded, 3>> = None;
        for (upper, lower, sign) in PAIRS {
            let above = minor(&low, &high, upper, sign);
            let below = minor(&along_v, &along_w, lower, 1.0);
            let total = sum.get_or_insert_with(|| product_room(&above, &below));
            add_product(total, &above, &below, 1.0);
        }
        let (counts, mut coefficients) = sum.unwrap_or(([1; 3], vec![Bounded::ZERO]));
        let rows = counts.map(|n| binomials::<f64>(n - 1));
        for (index, c) in indices(counts).zip(&mut coefficients) {
            let factor: f64 = (0..3).map(|k| rows[k][index[k]]).product();
            c.value /= factor;
            c.bound /= factor;
        }
        // Each of the four entries of a product: its own roundings, a difference, factors. Then the
        // sums of two minors and of six products of minors, and the binomials taken out again.
        let terms = cell.values.len() as f64;
        let [above, below] = minor_sizes(cell.counts);
        let binomial = counts.iter().sum::<usize>() as f64;
        let roundings = 4.0 * (cell.roundings + 6.0 + binomial)
            + 2.0 * (2.0 * terms + 2.0)
            + 6.0 * above.min(below)
            + 8.0;
        Self {
            counts,
            coefficients,
            roundings,
        }
    }

    /// What the error of a coefficient is at most.
    pub(super) fn noise(&self, c: Bounded) -> f64 {
        gamma(self.roundings) * c.bound
    }

    /// The coefficients over the lower and upper half of one variable.
    pub(super) fn halves(&self, k: usize) -> [Self; 2] {
        let half = |upper: bool| {
            let (counts, coefficients) = map_rows(self.counts, &self.coefficients, k, |row| {
                let mut right = row.to_vec();
                let mut left = Vec::with_capacity(row.len());
                for r in 0..row.len() {
                    left.push(right[0]);
                    for i in 0..row.len() - 1 - r {
                        right[i] = Bounded {
                            value: 0.5 * (right[i].value + right[i + 1].value),
                            bound: 0.5 * (right[i].bound + right[i + 1].bound),
                        };
                    }
                }
                if upper { right } else { left }
            });
            Self {
                counts,
                coefficients,
                roundings: self.roundings + 2.0 * counts[k] as f64,
            }
        };
        [half(false), half(true)]
    }

    /// The variable along which the coefficients change most.
    pub(super) fn liveliest(&self) -> usize {
        let change = |k: usize| -> f64 {
            let mut total = 0.0;
            let stride: usize = self.counts[..k].iter().product();
            for index in indices(self.counts) {
                if index[k] + 1 < self.counts[k] {
                    let at = place(self.counts, index);
                    let step = self.coefficients[at + stride].value - self.coefficients[at].value;
                    total += step.abs();
                }
            }
            total
        };
        let [u, v, w] = [0, 1, 2].map(change);
        if u >= v && u >= w {
            0
        } else if v >= w {
            1
        } else {
            2
        }
    }
}

/// The number of coefficients of the minors of the upper and of the lower two rows.
fn minor_sizes(counts: [usize; 3]) -> [f64; 2] {
    let [p, q, r] = counts.map(|n| (n - 1) as f64);
    [
        (2.0 * p - 1.0) * (2.0 * q + 1.0) * (2.0 * r + 1.0),
        (2.0 * p + 1.0) * 2.0 * q * 2.0 * r,
    ]
}

/// Multiplications that an expansion takes.
pub(super) fn cost(counts: [usize; 3]) -> f64 {
    let [above, below] = minor_sizes(counts);
    12.0 * above * below
}

/// The largest of some numbers that are not negative.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// A power of two that brings `size` to between 1 and 2; 1 for zero.
pub(super) fn to_one(size: f64) -> f64 {
    if size > 0.0 {
        // Not beyond the range of normal numbers, whose reciprocals exist.
        (-size.log2().floor().clamp(-1000.0, 1000.0)).exp2()
    } else {
        1.0
    }
}

/// The coefficients times their binomials.
fn binomial_form(net: &Net<Bounded, 3>) -> Net<Bounded, 3> {
    let rows = net.0.map(|n| binomials::<f64>(n - 1));
    let scaled = indices(net.0).zip(&net.1).map(|(index, c)| {
        let factor: f64 = (0..3).map(|k| rows[k][index[k]]).product();
        c.scaled(factor)
    });
    (net.0, scaled.collect())
}

/// The minor of columns i and j of two rows, times a sign.
fn minor(
    p: &[Net<Bounded, 3>; 4],
    q: &[Net<Bounded, 3>; 4],
    [i, j]: [usize; 2],
    sign: f64,
) -> Net<Bounded, 3> {
    let mut total = product_room(&p[i], &q[j]);
    add_product(&mut total, &p[i], &q[j], sign);
    add_product(&mut total, &p[j], &q[i], -sign);
    total
}

/// Zeros enough for a product.
fn product_room(a: &Net<Bounded, 3>, b: &Net<Bounded, 3>) -> Net<Bounded, 3> {
    let counts: [usize; 3] = std::array::from_fn(|k| a.0[k] + b.0[k] - 1);
    (counts, vec![Bounded::ZERO; counts.iter().product()])
}

/// Adds `sign` a b, all in binomial form: a convolution.
fn add_product(total: &mut Net<Bounded, 3>, a: &Net<Bounded, 3>, b: &Net<Bounded, 3>, sign: f64) {
    let [row, depth] = [b.0[0], b.0[1]];
    for (index, x) in indices(a.0).zip(&a.1) {
        if x.bound == 0.0 {
            continue;
        }
        let (value, bound) = (sign * x.value, x.bound);
        for (r, from) in b.1.chunks_exact(row).enumerate() {
            let corner = [index[0], index[1] + r % depth, index[2] + r / depth];
            let start = place(total.0, corner);
            for (to, y) in total.1[start..start + row].iter_mut().zip(from) {
                to.value += value * y.value;
                to.bound += bound * y.bound;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::BezierCell;
    use super::super::tensor_testing::maps;
    use super::*;
    use crate::math::dd::{Dd, Real};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_expansion_is_the_determinant(map in maps::<3>(), t in prop::array::uniform3(0.0..=1.0_f64)) {
            let cell = map.to_bezier().expect("finite").swap_remove(0).cell;
            let net = CellNet {
                counts: cell.counts(),
                values: cell.control_points().to_vec(),
                bounds: cell.control_points().iter().map(|h| Homogeneous {
                    weighted: h.weighted.map(f64::abs), weight: h.weight,
                }).collect(),
                roundings: 0.0,
            };
            let expansion = Expansion::of_jacobian(&net);
            let degrees = cell.degrees();
            prop_assert_eq!(expansion.counts, [4 * degrees[0] - 1, 4 * degrees[1], 4 * degrees[2]]);
            // The same cell in double-double, by de Casteljau; the factor of the scales is free,
            // so ratios to the value at one corner of a box are compared.
            let value = |t: [f64; 3]| -> (f64, f64) {
                let (mut value, mut bound) = (Dd::ZERO, 0.0);
                for (index, c) in indices(expansion.counts).zip(&expansion.coefficients) {
                    let mut factor = Dd::ONE;
                    for k in 0..3 {
                        let p = expansion.counts[k] - 1;
                        let row = crate::math::bernstein::binomials::<Dd>(p);
                        factor = factor * row[index[k]];
                        for _ in 0..index[k] { factor = factor * Dd::of(t[k]); }
                        for _ in index[k]..p { factor = factor * (Dd::ONE - Dd::of(t[k])); }
                    }
                    value = value + factor * Dd::of(c.value);
                    bound += factor.f64() * expansion.noise(*c);
                }
                (value.f64(), bound)
            };
            let exact = |t: [f64; 3]| determinant_in_dd(&cell, t);
            let [a, b] = [t, [0.5; 3]];
            let ((va, na), (vb, nb)) = (value(a), value(b));
            let (ea, eb) = (exact(a), exact(b));
            // va / vb = ea / eb, each within its noise.
            let left = va * eb - vb * ea;
            prop_assert!(left.abs() <= na * eb.abs() + nb * ea.abs() + 1e-14 * (va * eb).abs(),
                "{va} {vb} {ea} {eb}");
        }
    }

    /// The determinant of a cell at t, all in double-double.
    fn determinant_in_dd(cell: &BezierCell<3>, t: [f64; 3]) -> f64 {
        let counts = cell.counts();
        let basis = |k: usize, derived: bool| -> Vec<Dd> {
            let p = counts[k] - 1;
            let u = Dd::of(t[k]);
            let bernstein = |q: usize, i: usize| {
                let mut value = crate::math::bernstein::binomials::<Dd>(q)[i];
                for _ in 0..i {
                    value = value * u;
                }
                for _ in i..q {
                    value = value * (Dd::ONE - u);
                }
                value
            };
            (0..=p)
                .map(|i| {
                    if !derived {
                        return bernstein(p, i);
                    }
                    let low = if i > 0 {
                        bernstein(p - 1, i - 1)
                    } else {
                        Dd::ZERO
                    };
                    let high = if i < p { bernstein(p - 1, i) } else { Dd::ZERO };
                    Dd::of(p as f64) * (low - high)
                })
                .collect()
        };
        let row = |which: usize| -> [Dd; 4] {
            let rows: [Vec<Dd>; 3] = std::array::from_fn(|k| basis(k, which == k + 1));
            let mut sum = [Dd::ZERO; 4];
            for (index, h) in indices(counts).zip(cell.control_points()) {
                let factor = (0..3).fold(Dd::ONE, |f, k| f * rows[k][index[k]]);
                let entries = [h.weight, h.weighted[0], h.weighted[1], h.weighted[2]];
                for (s, e) in sum.iter_mut().zip(entries) {
                    *s = *s + factor * Dd::of(e);
                }
            }
            sum
        };
        // Leibniz's formula over the 24 permutations.
        let rows = [row(0), row(1), row(2), row(3)];
        let mut total = Dd::ZERO;
        for [a, b, c, d] in indices([4; 4]) {
            let p = [a, b, c, d];
            let pairs = || (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
            if pairs().any(|(i, j)| p[i] == p[j]) {
                continue;
            }
            let odd = pairs().filter(|&(i, j)| p[i] > p[j]).count() % 2 == 1;
            let term = rows[0][a] * rows[1][b] * rows[2][c] * rows[3][d];
            total = if odd { total - term } else { total + term };
        }
        total.f64()
    }
}
