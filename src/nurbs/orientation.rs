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
//!   more than [`MOST_WORK`] multiplications.
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

/// Why a volume has no orientation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrientationError {
    /// The Jacobian determinant takes both signs.
    #[error(
        "the volume folds over itself: its Jacobian determinant is positive at {positive:?} and negative at {negative:?}"
    )]
    Folded {
        /// Parameters where it is greater than zero.
        positive: [f64; 3],
        /// Parameters where it is less than zero.
        negative: [f64; 3],
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
    /// points.swap(0, 7);
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
        for (sign, (start, end)) in self.jacobian_signs()? {
            match sign {
                JacobianSign::Positive { at } => positive = positive.or(Some(at)),
                JacobianSign::Negative { at } => negative = negative.or(Some(at)),
                JacobianSign::Folded { positive, negative } => {
                    return Err(OrientationError::Folded { positive, negative });
                }
                JacobianSign::Flat => open = open.or(Some(OrientationError::Flat { start, end })),
                JacobianSign::Undecided { start, end } => {
                    open = open.or(Some(OrientationError::Undecided { start, end }));
                }
            }
        }
        match (positive, negative, open) {
            (Some(positive), Some(negative), _) => {
                Err(OrientationError::Folded { positive, negative })
            }
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
    pub fn jacobian_signs(
        &self,
    ) -> Result<Vec<(JacobianSign, ([f64; 3], [f64; 3]))>, NurbsError> {
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
                JacobianSign::Positive { at } => JacobianSign::Positive { at: place(at) },
                JacobianSign::Negative { at } => JacobianSign::Negative { at: place(at) },
                JacobianSign::Flat => JacobianSign::Flat,
                JacobianSign::Folded { positive, negative } => JacobianSign::Folded {
                    positive: place(positive),
                    negative: place(negative),
                },
                JacobianSign::Undecided { start, end } => JacobianSign::Undecided {
                    start: place(start),
                    end: place(end),
                },
            };
            Ok((sign, (start, end)))
        });
        signs.collect()
    }
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
