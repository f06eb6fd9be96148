//! Moments of a region and the area its boundary sweeps, as line integrals in double-double.
//!
//! ```text
//!   A_jk = ∬ ρ^j ζ^k dρ dζ = ∮ ρ^(j+1) / (j+1) ζ^k dζ        the region on the left of its boundary
//!   S    = ∫ r |C'| dt                                       over the parts off the axis
//!   ρ = r - r_c,  ζ = z - z_c                                 (r_c, z_c) the middle of the region's box
//! ```
//!
//! About the middle of its own box a region has moments of its own size: a ring far from its axis
//! keeps its digits. What cancels besides (a wall that is 1e-11 of its radius is the difference of two
//! discs) is left to double-double.
//!
//! * Units: lengths in the region's unit, `A_jk` in its power `j + k + 2`, `S` squared.
//! * Accuracy: each error is an estimate that is not below the truth: what the last halving changed,
//!   the resolution of the pieces ([`ON_BOUNDARY`]) times the boundary's length, and the gaps where
//!   pieces were cut at meetings known to f64 only.
//! * Source: Green's theorem; the quadrature is [`gauss`].

use super::boundary::{FilledPieces, SAME_FACE, SAME_PROFILE};
use super::piece::Piece;
use crate::math::bernstein::{self, Coefficients};
use crate::math::gauss::{self, Integrals};
use crate::math::tolerance::ON_BOUNDARY;
use crate::math::{Dd, Real};
use std::cmp::Ordering;

/// A number with an estimate of its absolute error, not below it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Estimate {
    pub(crate) value: Dd,
    pub(crate) error: f64,
}

/// What a region contributes to the measures of its turned solid.
#[derive(Debug, Clone)]
pub(crate) struct SectionMoments {
    /// (r_c, z_c).
    pub(crate) centre: [f64; 2],
    /// Half the sides of the region's box, each rounded up to a power of two.
    pub(crate) half: [f64; 2],
    /// `A_jk` in the order of [`POWERS`].
    area: [Estimate; POWERS.len()],
    /// S.
    pub(crate) swept: Estimate,
}

/// The powers (j, k) of ρ and ζ: what third moments in r and second ones in z take.
const POWERS: [(usize, usize); 9] = [
    (0, 0),
    (1, 0),
    (2, 0),
    (3, 0),
    (0, 1),
    (1, 1),
    (2, 1),
    (0, 2),
    (1, 2),
];

/// The integrals of one piece: those of [`POWERS`] before the division by j + 1, then S.
const INTEGRALS: usize = POWERS.len() + 1;

/// First tolerance of a panel, as a share of the moments of the region's box: below the rounding of
/// f64 for regions that fill 1e-4 of their box.
const TOLERANCE: f64 = 1.0 / (1_u128 << 70) as f64;

/// Relative error at which volume and area are good enough: a small part of the rounding of f64.
const ENOUGH: f64 = f64::EPSILON / 16.0;

/// How far a crossing that f64 searched, down to boxes of 1e-14, may be from the truth.
const CUT: f64 = 4e-14;

/// Most panels of a piece: enough for a near-cusp at every parameter that f64 resolves.
const MOST_PANELS: usize = 800;

impl SectionMoments {
    /// The moments of the region that the pieces bound.
    pub(crate) fn new(boundary: &FilledPieces) -> Self {
        let frame = Frame::around(boundary);
        let closing = Closing::new(boundary);
        let mut tolerance = TOLERANCE.max(frame.least_tolerance());
        let mut found = frame.moments(boundary, &closing, tolerance);
        for _ in 0..2 {
            let excess = found.relative_error() / ENOUGH;
            // A region that is a sliver of its box asks for more than a share of the box.
            if !(excess > 1.0) || tolerance <= frame.least_tolerance() {
                break;
            }
            tolerance = (tolerance / (16.0 * excess)).max(frame.least_tolerance());
            found = frame.moments(boundary, &closing, tolerance);
        }
        if !(found.relative_error() < 1.0) {
            // Faces so near that they count as one: nothing is known of what they sweep.
            found.swept.error += 8.0 * frame.radius * (frame.half[0] + frame.half[1]);
        }
        found
    }

    /// `A_jk`.
    ///
    /// # Panics
    /// Where j or k is beyond what [`POWERS`] lists.
    pub(crate) fn area(&self, j: usize, k: usize) -> Estimate {
        let at = POWERS.iter().position(|&p| p == (j, k));
        self.area[at.expect("only the moments that are listed are asked for")]
    }

    /// The larger relative error of ∬ r and S.
    fn relative_error(&self) -> f64 {
        let (area, first) = (self.area(0, 0), self.area(1, 0));
        let c = self.centre[0];
        let ring = (Dd::of(c) * area.value + first.value).abs().f64();
        let ring_error = c * area.error + first.error;
        (ring_error / ring).max(self.swept.error / self.swept.value.f64())
    }
}

/// The region's box: coordinates are taken about its middle in units of its half sides.
struct Frame {
    centre: [f64; 2],
    half: [f64; 2],
    /// Largest radius.
    radius: f64,
    /// Resolution of the coordinates, in half sides.
    noise: f64,
}

impl Frame {
    fn around(boundary: &FilledPieces) -> Self {
        let mut min = [f64::INFINITY; 2];
        let mut max = [f64::NEG_INFINITY; 2];
        for b in boundary.iter().map(|b| b.piece.bounds()) {
            for c in 0..2 {
                min[c] = min[c].min(b.min[c]);
                max[c] = max[c].max(b.max[c]);
            }
        }
        let power_above = |x: f64| {
            let power = x.log2().ceil().exp2();
            if power > 0.0 && power.is_finite() {
                power
            } else {
                1.0
            }
        };
        let half = [0, 1].map(|c| power_above(0.5 * (max[c] - min[c])));
        let reach = [0, 1].map(|c| min[c].abs().max(max[c].abs()));
        Self {
            centre: [0, 1].map(|c| 0.5 * (min[c] + max[c])),
            half,
            radius: reach[0],
            noise: ON_BOUNDARY * (reach[0] / half[0] + reach[1] / half[1]),
        }
    }

    /// Below this the halving would chase rounding.
    fn least_tolerance(&self) -> f64 {
        16.0 * self.noise.max(ON_BOUNDARY)
    }

    fn moments(
        &self,
        boundary: &FilledPieces,
        closing: &Closing,
        tolerance: f64,
    ) -> SectionMoments {
        let length = self.half[0].max(self.half[1]);
        let mut tolerances = [tolerance; INTEGRALS];
        tolerances[INTEGRALS - 1] = tolerance * self.radius * length;
        let mut total = Integrals {
            values: [Dd::ZERO; INTEGRALS],
            errors: [0.0; INTEGRALS],
        };
        // Lengths along r and along z of all pieces, in half sides.
        let mut variation = 0.0;
        for part in boundary.iter() {
            let one = self.along(part.piece, &tolerances);
            for i in 0..INTEGRALS {
                // S counts parts of either direction.
                let turned = !part.forward && i + 1 < INTEGRALS;
                let value = one.values[i];
                total.values[i] = total.values[i] + if turned { -value } else { value };
                total.errors[i] += one.errors[i];
            }
            let b = &part.piece.bounds();
            variation += (0..2)
                .map(|c| (b.max[c] - b.min[c]) / self.half[c])
                .sum::<f64>();
        }
        for [from, to] in &closing.segments {
            let one = self.along_segment(*from, *to);
            for i in 0..INTEGRALS - 1 {
                total.values[i] = total.values[i] + one[i];
            }
        }
        let slack =
            variation * self.noise + closing.slack(self.half[0].min(self.half[1]), variation);
        let area = std::array::from_fn(|i| {
            let (j, k) = POWERS[i];
            let unit = power(self.half[0], j + 1) * power(self.half[1], k + 1);
            #[allow(clippy::cast_precision_loss, reason = "a small count")]
            let (degree, powers) = ((j + 1) as f64, (j + k + 1) as f64);
            let value = total.values[i] / Dd::of(degree);
            // How far ρ^(j+1) ζ^k moves with a coordinate, both at most 1.
            let moved = powers / degree * slack;
            Estimate {
                value: value.scale_by_power_of_two(unit),
                error: (total.errors[i] / degree + moved) * unit,
            }
        });
        #[allow(clippy::cast_precision_loss, reason = "a count of pieces")]
        let gaps = closing.segments.len() as f64 * 2.0 * closing.widest;
        let swept_slack = self.radius * (gaps + 2.0 * self.noise * variation * length);
        SectionMoments {
            centre: self.centre,
            half: self.half,
            area,
            swept: Estimate {
                value: total.values[INTEGRALS - 1],
                error: total.errors[INTEGRALS - 1] + swept_slack,
            },
        }
    }

    /// The integrals along a piece in its own direction.
    fn along(&self, piece: &Piece, tolerances: &[f64; INTEGRALS]) -> Integrals<INTEGRALS> {
        let mut found = if piece.degree() == 1 {
            Integrals {
                values: self.along_segment(piece.start(), piece.end()),
                errors: [0.0; INTEGRALS],
            }
        } else {
            let curve = Centred::new(self, piece);
            let integrand = |t: Dd| {
                let (p, d) = curve.at(t);
                self.integrands(p, d)
            };
            gauss::integrate(integrand, tolerances, MOST_PANELS)
        };
        if piece.on_axis {
            found.values[INTEGRALS - 1] = Dd::ZERO;
            found.errors[INTEGRALS - 1] = 0.0;
        }
        found
    }

    fn along_segment(&self, from: [Dd; 2], to: [Dd; 2]) -> [Dd; INTEGRALS] {
        let start = [0, 1].map(|c| self.centred(from[c], c));
        let step = [0, 1].map(|c| self.centred(to[c], c) - start[c]);
        let integrand = |t: Dd| self.integrands([0, 1].map(|c| start[c] + step[c] * t), step);
        gauss::integrate_quintic(integrand)
    }

    fn centred(&self, value: Dd, c: usize) -> Dd {
        (value - Dd::of(self.centre[c])).scale_by_power_of_two(1.0 / self.half[c])
    }

    /// The integrands at a centred point with its derivative.
    fn integrands(&self, [rho, zeta]: [Dd; 2], [drho, dzeta]: [Dd; 2]) -> [Dd; INTEGRALS] {
        let p0 = rho * dzeta;
        let p1 = p0 * rho;
        let p2 = p1 * rho;
        let (q0, q1) = (p0 * zeta, p1 * zeta);
        let scaled = |v: Dd, c: usize| v.scale_by_power_of_two(self.half[c]);
        let (dr, dz) = (scaled(drho, 0), scaled(dzeta, 1));
        let speed = (dr * dr + dz * dz).sqrt();
        let r = Dd::of(self.centre[0]) + scaled(rho, 0);
        [
            p0,
            p1,
            p2,
            p2 * rho,
            q0,
            q1,
            p2 * zeta,
            q0 * zeta,
            q1 * zeta,
            r * speed,
        ]
    }
}

fn power(x: f64, n: usize) -> f64 {
    (0..n).fold(1.0, |p, _| p * x)
}

/// A piece's Bernstein coefficients in the frame of its region.
struct Centred {
    /// w ρ and w ζ.
    numerators: [Coefficients<Dd>; 2],
    /// w; `None` where it is constant and divided out.
    weights: Option<Coefficients<Dd>>,
}

impl Centred {
    fn new(frame: &Frame, piece: &Piece) -> Self {
        let first = piece.point(0)[2];
        let polynomial = piece.points().all(|p| p[2] == first);
        // A power of two brings the largest weight near 1; the curve does not see it.
        let largest = piece.points().fold(0.0_f64, |m, p| m.max(p[2].f64()));
        let scale = (-largest.log2().floor()).exp2();
        let numerators = [0, 1].map(|c| {
            let coefficient = |p: [Dd; 3]| {
                if polynomial {
                    frame.centred(p[c] / p[2], c)
                } else {
                    let shifted = p[c].scale_by_power_of_two(scale)
                        - Dd::of(frame.centre[c]) * p[2].scale_by_power_of_two(scale);
                    shifted.scale_by_power_of_two(1.0 / frame.half[c])
                }
            };
            piece.points().map(coefficient).collect()
        });
        let weights = piece.points().map(|p| p[2].scale_by_power_of_two(scale));
        Self {
            numerators,
            weights: (!polynomial).then(|| weights.collect()),
        }
    }

    /// The point and its derivative.
    fn at(&self, t: Dd) -> ([Dd; 2], [Dd; 2]) {
        let [(r, dr), (z, dz)] =
            [0, 1].map(|c| bernstein::evaluate_with_derivative(&self.numerators[c], t));
        let Some(weights) = &self.weights else {
            return ([r, z], [dr, dz]);
        };
        let (w, dw) = bernstein::evaluate_with_derivative(weights, t);
        let (r, z) = (r / w, z / w);
        ([r, z], [(dr - r * dw) / w, (dz - z * dw) / w])
    }
}

/// What closes a boundary whose pieces were cut where they meet others, which f64 found.
struct Closing {
    /// From the end of a piece to the start of one, the region on the left.
    segments: Vec<[[Dd; 2]; 2]>,
    /// How far their ends may be from where the pieces truly meet.
    widest: f64,
}

impl Closing {
    fn new(boundary: &FilledPieces) -> Self {
        let (mut ends, mut starts) = loose(boundary);
        let mut closing = Self {
            segments: Vec::new(),
            widest: 0.0,
        };
        while let Some(end) = ends.pop() {
            let Some(at) = nearest(&starts, end) else {
                break;
            };
            let start = starts.remove(at);
            let gap = distance(end, start);
            // Both ends of a crossing may be off by the same, so a narrow gap proves nothing.
            let doubt = if gap > SAME_PROFILE { CUT } else { 0.0 };
            closing.widest = closing.widest.max(gap).max(doubt);
            closing.segments.push([end, start]);
        }
        closing
    }

    /// What the gaps may hide, as an area in half sides: slivers between parts that counted as one,
    /// along all of the boundary, and at a crossing the stretch where two pieces run within the gap
    /// of each other, 1e-3 where they touch to the fourth order.
    fn slack(&self, half: f64, variation: f64) -> f64 {
        const STRETCH: f64 = 1e-3;
        let sliver = self.widest.min(2.0 * SAME_FACE);
        (sliver * variation + self.widest * STRETCH) / half
    }
}

/// Ends that no piece starts from and starts that no piece ends at, ascending in r and z.
fn loose(boundary: &FilledPieces) -> (Vec<[Dd; 2]>, Vec<[Dd; 2]>) {
    // By numbers: there may be very many ends, and as a rule none of them is loose.
    #[allow(clippy::cast_possible_truncation, reason = "pieces are counted in u32")]
    let mut order: Vec<u32> = (0..2 * boundary.len() as u32).collect();
    let end = |i: u32| {
        let part = boundary.at(i as usize / 2);
        let (point, sign) = if i.is_multiple_of(2) {
            (part.piece.start(), 1)
        } else {
            (part.piece.end(), -1)
        };
        (point, if part.forward { sign } else { -sign })
    };
    order.sort_unstable_by(|&a, &b| compare(end(a).0, end(b).0));
    let (mut ends, mut starts) = (Vec::new(), Vec::new());
    for group in order.chunk_by(|&a, &b| compare(end(a).0, end(b).0) == Ordering::Equal) {
        let net: i32 = group.iter().map(|&i| end(i).1).sum();
        let list = if net < 0 { &mut ends } else { &mut starts };
        list.extend((0..net.abs()).map(|_| end(group[0]).0));
    }
    (ends, starts)
}

fn compare(a: [Dd; 2], b: [Dd; 2]) -> Ordering {
    let order = |c: usize| a[c].partial_cmp(&b[c]).unwrap_or(Ordering::Equal);
    order(0).then_with(|| order(1))
}

fn distance(a: [Dd; 2], b: [Dd; 2]) -> f64 {
    (a[0] - b[0]).f64().hypot((a[1] - b[1]).f64())
}

/// The place of the nearest of some points that ascend in r.
fn nearest(points: &[[Dd; 2]], p: [Dd; 2]) -> Option<usize> {
    let from = points.partition_point(|q| compare(*q, p) == Ordering::Less);
    let mut best: Option<(usize, f64)> = None;
    // Outwards on both sides, until r alone is further than the best.
    let mut look = |i: usize| {
        let reach = best.map_or(f64::INFINITY, |b| b.1);
        if (points[i][0] - p[0]).f64().abs() > reach {
            return false;
        }
        let d = distance(points[i], p);
        if d < reach {
            best = Some((i, d));
        }
        true
    };
    let _ = (from..points.len()).all(&mut look);
    let _ = (0..from).rev().all(&mut look);
    best.map(|b| b.0)
}
