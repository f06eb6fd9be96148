//! Volume, area and moments of a solid, and what a user reads from them.
//!
//! ```text
//!   V = ∭ 1,   F_i = ∭ (x - a)_i,   S_ij = ∭ (x - a)_i (x - a)_j          about a point a
//!   centroid  c = a + F / V
//!   inertia   I = tr(S') 1 - S',   S' = S - F Fᵀ / V                     about c, for density 1
//! ```
//!
//! * Units: scene units; V cubed, area squared, F in the fourth and S and I in the fifth power.
//! * Accuracy: an estimate beside a value is not below its error, rounding included. Moments about a
//!   point near the centroid keep their digits wherever the solid is; from a point `k` sizes away the
//!   inertia loses `k²`.

use crate::math::quadrature::Integral;
use crate::math::{Aabb, Dd};
use glam::DVec3;

/// Rounding of a sum of a few products, relative to the sum of their sizes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Volume, area, first and second moments of a solid about a point, each with an estimate of its
/// absolute error.
///
/// Solids that do not overlap have the moments of their union as the [`sum`](Self::sum) of theirs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// The point that the moments are about, in scene units.
    pub about: DVec3,
    /// ∭ 1, in cubed scene units.
    pub volume: Integral,
    /// Area of the whole boundary, in squared scene units.
    pub area: Integral,
    /// ∭ (x - about)_i.
    pub first: [Integral; 3],
    /// ∭ (x - about)_i (x - about)_j, symmetric.
    pub second: [[Integral; 3]; 3],
}

/// Volume, area, centroid, inertia and bounds of a solid, with estimates of their errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Volume in cubed scene units.
    pub volume: f64,
    /// Area of the whole boundary in squared scene units, flat caps included.
    pub area: f64,
    /// Centre of mass; `None` where the volume does not differ from 0.
    pub centroid: Option<DVec3>,
    /// Inertia tensor about the centroid for density 1, in the fifth power of scene units.
    pub inertia: [[f64; 3]; 3],
    /// The smallest box around the solid; `None` for an empty one.
    pub bounds: Option<Aabb>,
    /// How wrong the values may be.
    pub error_estimate: MeasureErrors,
}

/// Estimates of absolute errors, not below them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeasureErrors {
    /// Of the volume.
    pub volume: f64,
    /// Of the area.
    pub area: f64,
    /// Length of the error of the centroid; 0 where there is none.
    pub centroid: f64,
    /// Frobenius norm of the error of the inertia tensor, so of each entry too.
    pub inertia: f64,
}

/// What rounding of joints may change: regions that are joined are cut where their curves cross, to some ulps.
fn rounding(value: f64) -> f64 {
    8.0 * f64::EPSILON * value.abs()
}

impl Moments {
    /// The moments of nothing.
    pub const EMPTY: Self = {
        let zero = Integral {
            value: 0.0,
            error: 0.0,
        };
        Self {
            about: DVec3::ZERO,
            volume: zero,
            area: zero,
            first: [zero; 3],
            second: [[zero; 3]; 3],
        }
    };

    /// Adds to the errors what a surface that is off by `share` of `reach` changes, where no point is farther than `reach`
    /// from the point that the moments are about.
    pub(super) fn widen(&mut self, share: f64, reach: f64) {
        let off = share * reach;
        let area = self.area.value.abs();
        // Lengths change by that share, and where faces end by the distance.
        self.area.error += 4.0 * share * area;
        self.volume.error += off * area;
        for i in 0..3 {
            self.first[i].error += off * area * reach;
            for j in 0..3 {
                self.second[i][j].error += off * area * reach * reach;
            }
        }
    }

    /// The same moments about another point.
    #[must_use]
    pub fn moved(&self, about: DVec3) -> Self {
        if about == self.about {
            return *self;
        }
        let d = (self.about - about).to_array();
        let v = self.volume;
        let first = std::array::from_fn(|i| sum(&[self.first[i], times(v, d[i])]));
        let second = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                sum(&[
                    self.second[i][j],
                    times(self.first[j], d[i]),
                    times(self.first[i], d[j]),
                    times(v, d[i] * d[j]),
                ])
            })
        });
        Self {
            about,
            first,
            second,
            ..*self
        }
    }

    /// The moments of several solids that do not overlap, about a point near their common centroid.
    #[must_use]
    pub fn sum(parts: &[Self]) -> Self {
        let volume: f64 = parts.iter().map(|m| m.volume.value).sum();
        let weighted: DVec3 = parts.iter().map(|m| m.about * m.volume.value).sum();
        let centre = weighted / volume;
        let about = match parts.first() {
            None => return Self::EMPTY,
            Some(only) if parts.len() == 1 => only.about,
            Some(_) if centre.is_finite() => centre,
            Some(first) => first.about,
        };
        let moved: Vec<Self> = parts.iter().map(|m| m.moved(about)).collect();
        let total = |of: &dyn Fn(&Self) -> Integral| {
            let terms: Vec<Integral> = moved.iter().map(of).collect();
            sum(&terms)
        };
        Self {
            about,
            volume: total(&|m| m.volume),
            area: total(&|m| m.area),
            first: std::array::from_fn(|i| total(&|m| m.first[i])),
            second: std::array::from_fn(|i| std::array::from_fn(|j| total(&|m| m.second[i][j]))),
        }
    }

    /// What a user reads: centroid and inertia about it, with the bounds that are given.
    #[must_use]
    pub fn measures(&self, bounds: Option<Aabb>) -> Measures {
        let centre = self.centre();
        let about_centre = match centre {
            Some((offset, _)) => self.centred(offset),
            None => self.second,
        };
        let (inertia, inertia_error) = inertia(&about_centre);
        Measures {
            volume: self.volume.value,
            area: self.area.value,
            centroid: centre.map(|(offset, _)| self.about + offset),
            inertia,
            bounds,
            error_estimate: MeasureErrors {
                volume: self.volume.error + rounding(self.volume.value),
                area: self.area.error + rounding(self.area.value),
                centroid: centre.map_or(0.0, |(_, error)| error),
                inertia: inertia_error,
            },
        }
    }

    /// The centroid as an offset from `about`, with an estimate of the length of its error.
    fn centre(&self) -> Option<(DVec3, f64)> {
        let v = self.volume;
        if !(v.value > v.error) {
            return None;
        }
        let least = v.value - v.error;
        let offset = DVec3::from_array(self.first.map(|f| f.value / v.value));
        let error = DVec3::from_array(std::array::from_fn(|i| {
            let d = offset[i].abs();
            // What the last addition rounds is known: nothing, where f64 has the coordinate.
            let rounding = Dd::sum(self.about[i], offset[i]).lo().abs();
            (self.first[i].error + d * v.error) / least + 2.0 * f64::EPSILON * d + rounding
        }));
        Some((offset, error.length()))
    }

    /// The second moments about `about + offset`, where that is the centroid: S - F Fᵀ / V.
    fn centred(&self, offset: DVec3) -> [[Integral; 3]; 3] {
        let centred: [[Integral; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                sum(&[
                    self.second[i][j],
                    // Half of the product each, so that the tensor stays symmetric.
                    times(self.first[j], -0.5 * offset[i]),
                    times(self.first[i], -0.5 * offset[j]),
                    // The error of the offset changes S' by a square, that of V by this.
                    Integral {
                        value: 0.0,
                        error: (offset[i] * offset[j]).abs() * self.volume.error
                            + 0.5 * offset[i].abs() * self.first[j].error
                            + 0.5 * offset[j].abs() * self.first[i].error,
                    },
                ])
            })
        });
        // One half twice: the two differ by the order of their roundings.
        std::array::from_fn(|i| std::array::from_fn(|j| centred[i.min(j)][i.max(j)]))
    }
}

/// The inertia tensor of second moments about its point, with the Frobenius norm of its error.
fn inertia(second: &[[Integral; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let negative = |m: Integral| Integral {
        // Not -0 where there is nothing.
        value: 0.0 - m.value,
        error: m.error,
    };
    let tensor: [[Integral; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            if i == j {
                let (k, l) = ((i + 1) % 3, (i + 2) % 3);
                sum(&[second[k][k], second[l][l]])
            } else {
                negative(second[i][j])
            }
        })
    });
    let error = tensor.iter().flatten().map(|m| m.error * m.error);
    // A scale first: squares of small errors underflow.
    let largest = tensor.iter().flatten().fold(0.0_f64, |m, t| m.max(t.error));
    let norm = if largest > 0.0 && largest.is_finite() {
        let squares = tensor.iter().flatten().map(|t| (t.error / largest).powi(2));
        largest * squares.sum::<f64>().sqrt()
    } else {
        error.sum::<f64>().sqrt()
    };
    (tensor.map(|row| row.map(|m| m.value)), norm)
}

/// A sum with its rounding.
fn sum(terms: &[Integral]) -> Integral {
    let value = terms.iter().map(|t| t.value).sum();
    let kept = terms.iter().filter(|t| t.value != 0.0).count();
    let size: f64 = terms.iter().map(|t| t.value.abs()).sum();
    #[allow(clippy::cast_precision_loss, reason = "a count of terms")]
    let rounding = kept.saturating_sub(1) as f64 * 0.5 * f64::EPSILON * size;
    Integral {
        value,
        error: terms.iter().map(|t| t.error).sum::<f64>() + rounding,
    }
}

/// A product with a number that carries a few roundings.
fn times(m: Integral, factor: f64) -> Integral {
    let value = m.value * factor;
    Integral {
        value,
        error: m.error * factor.abs() + ROUNDING * value.abs(),
    }
}
