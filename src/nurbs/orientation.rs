//! On which side a volume's parameters turn: the certified sign of its Jacobian determinant.
//!
//! A map whose determinant has one sign is locally one to one. The determinant's numerator over a
//! Bézier cell is a polynomial in Bernstein form ([`jacobian`](super::jacobian)), whose values lie
//! between its least and its largest coefficient:
//!
//! ```text
//!   no coefficient below zero, one above           positive, zeros at most where they are isolated
//!                                                  or on the cell's boundary
//!   coefficients of both signs, corners of both    folded: a corner's coefficient is a value
//!   coefficients of both signs otherwise           the two halves, across the liveliest variable
//! ```
//!
//! A coefficient within its rounding bound of zero counts as zero. So the corners of a biquadratic
//! disc, the axis of a polar one and an apex, where the determinant vanishes, do not hide the sign of
//! the rest; and a fold shallower than rounding (about 1e-13 of the determinant's own terms) is none.
//!
//! * Work: boxes are halved breadth first, so that a fold is found where it is widest, and no more
//!   than [`BOXES`] of them for a cell, fewer for high degrees; what is still open then is
//!   *undecided*, with the box that is. That happens where the determinant touches zero inside a
//!   cell without a change of sign along a curve or surface, and for degrees whose expansion takes
//!   more than [`MOST_WORK`] multiplications. There the determinant is evaluated at Gauss's points,
//!   where two signs prove a fold.
//! * Source: J. Garloff, *The Bernstein algorithm*, Interval Computations 2 (1993) 154–168.

use super::jacobian::{Bounded, CellNet, Expansion, cost};
use super::net::{indices, place};
use super::tensor_bezier::Spans;
use super::{BezierCell, Homogeneous, NurbsError, NurbsVolume};
use crate::math::dd::{Dd, Real};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Boxes looked at for one cell, at most.
const BOXES: usize = 1 << 14;

/// Coefficients held for one cell, at most: 64 megabytes of them.
const COEFFICIENTS: usize = 1 << 22;

/// Multiplications for one expansion, at most: a few seconds.
const MOST_WORK: f64 = 4e9;

/// Share of the product of the derivatives' greatest lengths below which a determinant may be rounding.
const ROUNDED: f64 = 1e-9;

/// Whether a volume's parameters run like the axes of a right-handed or a left-handed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Orientation {
    /// The Jacobian determinant is positive: right-handed.
    Positive,
    /// The Jacobian determinant is negative: left-handed.
    Negative,
}

/// The sign of the Jacobian determinant over one Bézier cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JacobianSign {
    /// Positive, with isolated zeros at most, and zeros on the cell's boundary.
    Positive {
        /// Parameters where it is greater than zero.
        at: [f64; 3],
    },
    /// Negative, with isolated zeros at most, and zeros on the cell's boundary.
    Negative {
        /// Parameters where it is less than zero.
        at: [f64; 3],
    },
    /// Zero but for rounding everywhere: the cell is a surface, a curve or a point.
    Flat,
    /// It takes both signs: the cell folds over itself.
    Folded {
        /// Parameters where it is greater than zero.
        positive: [f64; 3],
        /// Parameters where it is less than zero.
        negative: [f64; 3],
    },
    /// The sign is not known in this box of parameters; the work allowed did not settle it.
    Undecided {
        /// Where the box starts.
        start: [f64; 3],
        /// Where it ends.
        end: [f64; 3],
    },
}

/// A Bézier cell of a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CellIndex {
    /// Its place in the order of [`to_bezier`](NurbsVolume::to_bezier), from 0: the first direction fastest.
    pub number: usize,
    /// The number of its span in each direction, from 0; spans without length are not counted.
    pub spans: [usize; 3],
}

impl CellIndex {
    /// The cell of that number, of so many in each direction.
    fn new(number: usize, cells: [usize; 3]) -> Self {
        let [a, b, _] = cells;
        Self {
            number,
            spans: [number % a, number / a % b, number / (a * b)],
        }
    }
}

impl std::fmt::Display for CellIndex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { number, spans } = self;
        write!(f, "cell {number} (spans {spans:?})")
    }
}

/// Why a volume has no orientation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrientationError {
    /// The Jacobian determinant takes both signs.
    #[error(
        "the volume folds over itself: its Jacobian determinant is positive at {positive:?} in Bézier {} and negative at {negative:?} in Bézier {}",
        cells[0],
        cells[1]
    )]
    Folded {
        /// Parameters where it is greater than zero.
        positive: [f64; 3],
        /// Parameters where it is less than zero.
        negative: [f64; 3],
        /// The Bézier cells of the two places; one cell twice where it folds by itself.
        cells: [CellIndex; 2],
    },
    /// A cell has no volume.
    #[error("the volume is flat, but for rounding, between parameters {start:?} and {end:?}")]
    Flat {
        /// Where the cell starts.
        start: [f64; 3],
        /// Where it ends.
        end: [f64; 3],
    },
    /// The work allowed did not settle the sign.
    #[error("the sign of the Jacobian determinant is not settled between {start:?} and {end:?}")]
    Undecided {
        /// Where the box starts.
        start: [f64; 3],
        /// Where it ends.
        end: [f64; 3],
    },
    /// A product of weights and factors leaves the range of f64.
    #[error(transparent)]
    Nurbs(#[from] NurbsError),
}

impl BezierCell<3> {
    /// The sign of the Jacobian determinant over the cell; parameters are the cell's, in [0, 1].
    ///
    /// The control points are taken as exact.
    ///
    /// ```
    /// # use voxlathe::nurbs::{BezierCell, Homogeneous, JacobianSign};
    /// let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
    /// let mut points: Vec<_> = (0..8).map(|i| Homogeneous::from_point(corner(i), 1.0)).collect();
    /// let cube = BezierCell::new([1, 1, 1], points.clone())?;
    /// assert!(matches!(cube.jacobian_sign(), JacobianSign::Positive { .. }));
    /// points.swap(4, 7); // the top upside down
    /// let folded = BezierCell::new([1, 1, 1], points)?;
    /// assert!(matches!(folded.jacobian_sign(), JacobianSign::Folded { .. }));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    #[must_use]
    pub fn jacobian_sign(&self) -> JacobianSign {
        let (low, high) = self.control_bounds();
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * low[i] + 0.5 * high[i]);
        // A - w m in double-double: one rounding, however far away the cell is.
        let values: Vec<_> = (self.control_points().iter())
            .map(|h| Homogeneous {
                weighted: std::array::from_fn(|i| {
                    (Dd::of(h.weighted[i]) - Dd::product(h.weight, middle[i])).f64()
                }),
                weight: h.weight,
            })
            .collect();
        sign(&CellNet {
            counts: self.counts(),
            bounds: (values.iter())
                .map(|h| Homogeneous {
                    weighted: h.weighted.map(f64::abs),
                    weight: h.weight,
                })
                .collect(),
            values,
            roundings: 1.0,
        })
    }
}

impl NurbsVolume {
    /// The certified sign of the Jacobian determinant over the whole volume.
    ///
    /// Zeros on the boundaries of cells (an axis, an apex, the corners of a biquadratic disc) are
    /// allowed, and isolated ones inside, as far as the work allowed can tell.
    ///
    /// # Errors
    /// [`OrientationError::Folded`] with a point of either sign; [`OrientationError::Flat`];
    /// [`OrientationError::Undecided`] when the bound on the work is met first.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsVolume, Orientation, OrientationError};
    /// let line = || KnotVector::bezier(1);
    /// let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
    /// let cube = NurbsVolume::new([line()?, line()?, line()?], (0..8).map(corner).collect(), vec![1.0; 8])?;
    /// assert_eq!(cube.orientation()?, Orientation::Positive);
    /// assert_eq!(cube.reverse(1)?.orientation()?, Orientation::Negative);
    /// # Ok::<(), OrientationError>(())
    /// ```
    pub fn orientation(&self) -> Result<Orientation, OrientationError> {
        let mut positive = None;
        let mut negative = None;
        let mut open = None;
        let cells = self.knots().each_ref().map(|k| k.spans().count());
        for (number, (sign, (start, end))) in self.jacobian_signs()?.into_iter().enumerate() {
            let cell = CellIndex::new(number, cells);
            match sign {
                JacobianSign::Positive { at } => positive = positive.or(Some((at, cell))),
                JacobianSign::Negative { at } => negative = negative.or(Some((at, cell))),
                JacobianSign::Folded { positive, negative } => {
                    return Err(OrientationError::Folded {
                        positive,
                        negative,
                        cells: [cell; 2],
                    });
                }
                JacobianSign::Flat => open = open.or(Some(OrientationError::Flat { start, end })),
                JacobianSign::Undecided { start, end } => {
                    open = open.or(Some(OrientationError::Undecided { start, end }));
                }
            }
        }
        match (positive, negative, open) {
            (Some((positive, a)), Some((negative, b)), _) => Err(OrientationError::Folded {
                positive,
                negative,
                cells: [a, b],
            }),
            (_, _, Some(open)) => Err(open),
            (_, Some(_), None) => Ok(Orientation::Negative),
            _ => Ok(Orientation::Positive),
        }
    }

    /// The sign of the Jacobian determinant over each Bézier cell, with the cell's box, in the order
    /// of [`to_bezier`](Self::to_bezier); parameters are the volume's.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when control points lie so far apart that their differences are
    /// not finite.
    #[allow(clippy::type_complexity, reason = "a sign and a box")]
    pub fn jacobian_signs(&self) -> Result<Vec<(JacobianSign, ([f64; 3], [f64; 3]))>, NurbsError> {
        let spans = Spans::new(self);
        let counts = self.degrees().map(|p| p + 1);
        let cells: Vec<_> = indices(spans.cells).collect();
        let signs = cells.into_par_iter().map(|index| {
            let (start, end) = spans.bounds(index);
            let cell = self.centred_cell(&spans, index)?;
            let cell = CellNet {
                counts,
                values: cell.points,
                bounds: cell.sizes,
                roundings: cell.roundings,
            };
            let place = |t: [f64; 3]| -> [f64; 3] {
                std::array::from_fn(|k| (start[k] + t[k] * (end[k] - start[k])).min(end[k]))
            };
            let sign = match sign(&cell) {
                JacobianSign::Undecided { start: a, end: b } => self
                    .fold_at_points([start, end])
                    .unwrap_or(JacobianSign::Undecided {
                        start: place(a),
                        end: place(b),
                    }),
                JacobianSign::Positive { at } => JacobianSign::Positive { at: place(at) },
                JacobianSign::Negative { at } => JacobianSign::Negative { at: place(at) },
                JacobianSign::Flat => JacobianSign::Flat,
                JacobianSign::Folded { positive, negative } => JacobianSign::Folded {
                    positive: place(positive),
                    negative: place(negative),
                },
            };
            Ok((sign, (start, end)))
        });
        signs.collect()
    }

    /// A fold that shows at Gauss's points of a cell, as many in each direction as the degree and one
    /// more, ten at most.
    fn fold_at_points(&self, [start, end]: [[f64; 3]; 2]) -> Option<JacobianSign> {
        let points = self.degrees().map(|p| gauss_points((p + 1).min(10)));
        let mut lengths = [0.0_f64; 3];
        let mut found = Vec::new();
        for index in indices(points.each_ref().map(Vec::len)) {
            let at = std::array::from_fn(|k| {
                (start[k] + points[k][index[k]] * (end[k] - start[k])).min(end[k])
            });
            let jacobian = self.jacobian(at).ok()?;
            for (length, column) in lengths.iter_mut().zip(jacobian.columns) {
                *length = length.max(column.iter().map(|x| x * x).sum::<f64>().sqrt());
            }
            found.push((jacobian.determinant, at));
        }
        // Far above the rounding of a sum of (p + 1)^3 terms, and of their products: where a derivative
        // vanishes what is left of it is rounding of the others.
        let most = ROUNDED * lengths.iter().product::<f64>();
        let mut seen = Seen::default();
        for (determinant, at) in found {
            if determinant.abs() > most {
                seen.note(determinant, at);
            }
        }
        match seen {
            Seen {
                positive: Some(positive),
                negative: Some(negative),
            } => Some(JacobianSign::Folded { positive, negative }),
            _ => None,
        }
    }
}

/// Gauss's points on [0, 1].
fn gauss_points(count: usize) -> Vec<f64> {
    let nodes = crate::math::gauss::nodes(count);
    nodes.iter().map(|(at, _)| at.f64()).collect()
}

/// A box of the cell's parameters and the expansion over it.
struct Open {
    start: [f64; 3],
    size: [f64; 3],
    expansion: Expansion,
}

/// What is known of the signs so far: a place of each.
#[derive(Default)]
struct Seen {
    positive: Option<[f64; 3]>,
    negative: Option<[f64; 3]>,
}

impl Seen {
    /// Notes that `c` is a value at `at`, if its sign is certain.
    fn note(&mut self, certain: f64, at: [f64; 3]) {
        if certain > 0.0 {
            self.positive = self.positive.or(Some(at));
        } else if certain < 0.0 {
            self.negative = self.negative.or(Some(at));
        }
    }
}

/// The sign over one cell.
fn sign(cell: &CellNet) -> JacobianSign {
    let whole = JacobianSign::Undecided {
        start: [0.0; 3],
        end: [1.0; 3],
    };
    if cost(cell.counts) > MOST_WORK {
        return whole;
    }
    let expansion = Expansion::of_jacobian(cell);
    if (expansion.coefficients.iter()).any(|c| !(c.value.is_finite() && c.bound.is_finite())) {
        return whole;
    }
    let boxes = (COEFFICIENTS / expansion.coefficients.len()).clamp(16, BOXES);
    let mut looked_at = 0;
    let mut seen = Seen::default();
    let mut open = VecDeque::from([Open {
        start: [0.0; 3],
        size: [1.0; 3],
        expansion,
    }]);
    while let Some(Open {
        start,
        size,
        expansion,
    }) = open.pop_front()
    {
        // The value, or zero where rounding could have made it.
        let certain = |c: Bounded| {
            if c.value.abs() > expansion.noise(c) {
                c.value
            } else {
                0.0
            }
        };
        let (mut least, mut greatest) = (0.0_f64, 0.0_f64);
        for &c in &expansion.coefficients {
            let c = certain(c);
            (least, greatest) = (least.min(c), greatest.max(c));
        }
        if least == 0.0 && greatest == 0.0 {
            continue;
        }
        for corner in indices([2; 3]) {
            let index = std::array::from_fn(|k| corner[k] * (expansion.counts[k] - 1));
            let c = expansion.coefficients[place(expansion.counts, index)];
            let at = std::array::from_fn(|k| start[k] + corner[k] as f64 * size[k]);
            seen.note(certain(c), at);
        }
        if least < 0.0 && greatest > 0.0 {
            looked_at += 1;
            if looked_at == boxes {
                return match seen {
                    Seen {
                        positive: Some(positive),
                        negative: Some(negative),
                    } => JacobianSign::Folded { positive, negative },
                    _ => JacobianSign::Undecided {
                        start,
                        end: std::array::from_fn(|k| start[k] + size[k]),
                    },
                };
            }
            let k = expansion.liveliest();
            let mut half = size;
            half[k] *= 0.5;
            let mut after = start;
            after[k] += half[k];
            for (start, expansion) in [start, after].into_iter().zip(expansion.halves(k)) {
                open.push_back(Open {
                    start,
                    size: half,
                    expansion,
                });
            }
        } else {
            // One sign: inside the box the value is not zero, whatever its corners are.
            let middle = std::array::from_fn(|k| start[k] + 0.5 * size[k]);
            seen.note(least + greatest, middle);
        }
        if let Seen {
            positive: Some(positive),
            negative: Some(negative),
        } = seen
        {
            return JacobianSign::Folded { positive, negative };
        }
    }
    match seen {
        Seen {
            positive: Some(at), ..
        } => JacobianSign::Positive { at },
        Seen {
            negative: Some(at), ..
        } => JacobianSign::Negative { at },
        _ => JacobianSign::Flat,
    }
}

#[cfg(test)]
mod tests {
    use super::super::KnotVector;
    use super::super::tensor_testing::{biquadratic, extent, polar, sphere, torus, turned};
    use super::*;
    use proptest::prelude::*;

    fn line() -> KnotVector {
        KnotVector::bezier(1).expect("valid")
    }

    /// A block of Bézier degree (2, 2, 1), its control points off by up to `by`.
    fn perturbed(by: f64, weights: bool, seed: &[f64]) -> NurbsVolume {
        let quadratic = || KnotVector::bezier(2).expect("valid");
        let mut seed = seed.iter().copied().cycle();
        let mut next = move || seed.next().unwrap_or(0.0);
        let points = indices([3, 3, 2])
            .map(|i| i.map(|i| i as f64 + by * next()))
            .collect();
        let weights = (0..18)
            .map(|_| if weights { 1.0 + 0.9 * next() } else { 1.0 })
            .collect();
        NurbsVolume::new([quadratic(), quadratic(), line()], points, weights).expect("valid")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn perturbed_blocks_against_dense_sampling(
            by in 0.0..1.2_f64, weights: bool, seed in prop::collection::vec(-1.0..=1.0_f64, 73),
        ) {
            let block = perturbed(by, weights, &seed);
            let n = 12;
            let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
            for index in indices([n + 1; 3]) {
                let at = index.map(|i| i as f64 / n as f64);
                let found = block.jacobian(at).expect("inside").determinant;
                (least, greatest) = (least.min(found), greatest.max(found));
            }
            match block.orientation() {
                Ok(Orientation::Positive) => prop_assert!(least >= -1e-12, "{least}"),
                Ok(Orientation::Negative) => prop_assert!(greatest <= 1e-12, "{greatest}"),
                Err(OrientationError::Folded { positive, negative, cells }) => {
                    // Samples may miss a fold; its witnesses do not.
                    let sign = |at| block.jacobian(at).expect("inside").determinant;
                    prop_assert!(sign(positive) > 0.0 && sign(negative) < 0.0);
                    let pieces = block.to_bezier().expect("finite");
                    for (at, cell) in [positive, negative].into_iter().zip(cells) {
                        let piece = &pieces[cell.number];
                        prop_assert!((0..3).all(|k| (piece.start[k]..=piece.end[k]).contains(&at[k])));
                    }
                }
                Err(other) => prop_assert!(false, "{other}"),
            }
            if least < 0.0 && greatest > 0.0 {
                let folded = matches!(block.orientation(), Err(OrientationError::Folded { .. }));
                prop_assert!(folded);
            }
        }
    }

    #[test]
    fn zeros_on_axes_apexes_and_corners_are_allowed() {
        for disc in [biquadratic(), polar()] {
            let cylinder = turned(&line(), &[([2.0, 0.0], 1.0), ([2.0, 5.0], 1.0)], &disc);
            let cone = turned(&line(), &[([1.0, 0.0], 1.0), ([0.0, 3.0], 1.0)], &disc);
            for solid in [cylinder, cone, sphere(1.5, &disc)] {
                assert_eq!(solid.orientation(), Ok(Orientation::Positive));
                assert_eq!(
                    solid.reverse(0).expect("valid").orientation(),
                    Ok(Orientation::Negative)
                );
                // Away from the origin and turned, the zeros are no longer exact ones.
                let tilted = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
                let far = solid.transform(&tilted, &[1e6, -3e5, 7.7]).expect("finite");
                assert_eq!(
                    far.orientation(),
                    Ok(Orientation::Positive),
                    "{}",
                    extent(&far)
                );
            }
        }
        assert_eq!(torus(3.0, 1.0).orientation(), Ok(Orientation::Positive));
    }

    #[test]
    fn folds_are_found() {
        // A meridian that turns back: z = 0, 3, -1, 2.
        let knots = KnotVector::bezier(3).expect("valid");
        let back = [
            ([1.0, 0.0], 1.0),
            ([1.0, 3.0], 1.0),
            ([1.0, -1.0], 1.0),
            ([1.0, 2.0], 1.0),
        ];
        let folded = turned(&knots, &back, &biquadratic());
        let Err(OrientationError::Folded {
            positive, negative, ..
        }) = folded.orientation()
        else {
            panic!("{:?}", folded.orientation());
        };
        assert!(folded.jacobian(positive).expect("inside").determinant > 0.0);
        assert!(folded.jacobian(negative).expect("inside").determinant < 0.0);
        // Two blocks of which one is turned over: every cell has one sign, the whole has two.
        let knots = KnotVector::clamped_uniform(1, 3).expect("valid");
        let z = [0.0, 2.0, 1.0];
        let points = indices([2, 2, 3])
            .map(|[i, j, k]| [i as f64, j as f64, z[k]])
            .collect();
        let pleat =
            NurbsVolume::new([line(), line(), knots], points, vec![1.0; 12]).expect("valid");
        let signs: Vec<_> = pleat
            .jacobian_signs()
            .expect("finite")
            .into_iter()
            .map(|s| s.0)
            .collect();
        assert!(matches!(
            signs[..],
            [JacobianSign::Positive { .. }, JacobianSign::Negative { .. }]
        ));
        let Err(error @ OrientationError::Folded { cells, .. }) = pleat.orientation() else {
            panic!("{:?}", pleat.orientation());
        };
        let cell = |number, spans| CellIndex { number, spans };
        assert_eq!(cells, [cell(0, [0, 0, 0]), cell(1, [0, 0, 1])]);
        let text = error.to_string();
        assert!(
            text.contains("in Bézier cell 0 (spans [0, 0, 0]) and"),
            "{text}"
        );
        assert!(
            text.ends_with("in Bézier cell 1 (spans [0, 0, 1])"),
            "{text}"
        );
    }

    #[test]
    fn a_fold_names_its_cell() {
        // 2 x 3 x 2 cells.
        let knots = [
            KnotVector::clamped_uniform(1, 3).expect("valid"),
            KnotVector::clamped_uniform(1, 4).expect("valid"),
            KnotVector::clamped_uniform(1, 3).expect("valid"),
        ];
        let mut points: Vec<[f64; 3]> = indices([3, 4, 3])
            .map(|index| index.map(|i| i as f64))
            .collect();
        // The corner of the last cell but those above it goes through to the other side.
        points[2 + 3 * 3] = [0.0, 1.0, 2.5];
        let block = NurbsVolume::new(knots, points, vec![1.0; 36]).expect("valid");
        let Err(OrientationError::Folded { cells, .. }) = block.orientation() else {
            panic!("{:?}", block.orientation());
        };
        let wanted = CellIndex {
            number: 5,
            spans: [1, 2, 0],
        };
        assert_eq!(cells, [wanted; 2]);
    }

    #[test]
    fn a_shallow_fold_is_found_and_none_is_invented() {
        // z' = (u - 1/3)^2 + h up to a factor: folded just if h < 0.
        let knots = || KnotVector::bezier(3).expect("valid");
        for (h, expected) in [(-1e-6, false), (-1e-9, false), (1e-9, true), (1e-6, true)] {
            // z = (u - 1/3)^3 / 3 + h u + 1/81, Bézier ordinates by the blossom.
            let blossom = |a: f64, b: f64, c: f64| {
                let m = 1.0 / 3.0;
                (a - m) * (b - m) * (c - m) / 3.0 + h * (a + b + c) / 3.0
            };
            let z = [
                blossom(0.0, 0.0, 0.0),
                blossom(0.0, 0.0, 1.0),
                blossom(0.0, 1.0, 1.0),
                blossom(1.0, 1.0, 1.0),
            ];
            let meridian = z.map(|z| ([1.0, z], 1.0));
            let solid = turned(&knots(), &meridian, &polar());
            match solid.orientation() {
                Ok(found) => assert!(expected && found == Orientation::Positive, "{h}"),
                Err(OrientationError::Folded { .. }) => assert!(!expected, "{h}"),
                Err(other) => panic!("{h}: {other}"),
            }
        }
    }

    #[test]
    fn flat_cells_and_bounded_work() {
        let flat = NurbsVolume::new(
            [line(), line(), line()],
            indices([2; 3])
                .map(|[i, j, _]| [i as f64, j as f64, 0.5])
                .collect(),
            vec![1.0; 8],
        )
        .expect("valid");
        assert!(matches!(
            flat.orientation(),
            Err(OrientationError::Flat { .. })
        ));
        // det = (u - v)^2: zero along a plane inside without a change of sign; whatever the answer,
        // it comes soon and is no fold.
        let quadratic = || KnotVector::bezier(3).expect("valid");
        let points = indices([4, 4, 2]).map(|[i, j, k]| {
            let (u, v) = (i as f64 / 3.0, j as f64 / 3.0);
            // x = u³/3 - u² v + u v² has x_u = (u - v)²: its blossom.
            let cube = f64::from(u8::from(i == 3)) / 3.0;
            let square = [0.0, 0.0, 1.0 / 3.0, 1.0];
            [cube - square[i] * v + u * square[j], v, k as f64]
        });
        let touching = NurbsVolume::new(
            [quadratic(), quadratic(), line()],
            points.collect(),
            vec![1.0; 32],
        )
        .expect("valid");
        let at = touching
            .jacobian([0.75, 0.25, 0.5])
            .expect("inside")
            .determinant;
        assert!((at - 0.25).abs() < 1e-15 * 8.0, "{at}");
        match touching.orientation() {
            Ok(found) => assert_eq!(found, Orientation::Positive),
            Err(error) => assert!(
                matches!(error, OrientationError::Undecided { .. }),
                "{error}"
            ),
        }
        // Degree 20: the expansion is beyond the work allowed.
        let twenty = || KnotVector::bezier(20).expect("valid");
        let points = indices([21; 3]).map(|i| i.map(|i| i as f64)).collect();
        let high = NurbsVolume::new([twenty(), twenty(), twenty()], points, vec![1.0; 9261])
            .expect("valid");
        assert!(matches!(
            high.orientation(),
            Err(OrientationError::Undecided { .. })
        ));
    }
}
