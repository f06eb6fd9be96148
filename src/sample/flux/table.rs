//! What a layer normal to the axis holds of a turned region, as a function of s = ρ².
//!
//! ```text
//!   h(s)  share of the layer's height that is solid at radius √s
//!   G(s) = ½ ∫₀^s h ds        K(s) = G(s) / s        F = K (x, y, 0)  has the divergence h
//! ```
//!
//! Between the squared radii at which pieces of the profile enter and leave the layer, h is analytic. Where no piece
//! is in the layer h = c and K = c / 2 + d / s. Elsewhere h is interpolated at Chebyshev points, their number proved to
//! suffice by [`super::part`]; the series is integrated, and K is interpolated in turn, where the pole at s = 0 is the
//! only one. An interval for which either takes too many points is halved; one so narrow that h, which is monotone for
//! each piece, changes no voxel by more than is allowed takes a chord of it. So a vertical tangent, where h has a
//! square root, lies at the end of a graded row of intervals.
//!
//! ```text
//!   error of a voxel's share <= E/16 h's points + E/8 K's points + E/8 Gauss points (super::lines) + chords + rounding
//! ```

use super::part::Part;
use super::series::{self, MOST, Terms};
use crate::region::BoundaryPiece;

/// Widths, in powers of ½ of an interval, for which the number of Gauss points is kept.
pub(super) const WIDTHS: usize = 8;
/// The most intervals of a layer.
const MOST_BANDS: usize = 8192;
/// The most points at which pieces may have to be met.
const MOST_SAMPLES: usize = 400_000;
/// Rounding, in voxels, of a body too far away or a voxel too thin to be left to the flux.
const LOST: f64 = 1e-8;
/// Halvings of an interval.
const DEPTH: u32 = 200;

/// Where K is what.
#[derive(Debug, Clone, Copy)]
pub(super) struct Band {
    /// h, where it is constant.
    pub(super) height: f64,
    /// K = height / 2 + pole / s there.
    pub(super) pole: f64,
    /// The series, elsewhere.
    pub(super) series: Option<u32>,
}

/// K on one interval, by powers of `σ = (s - middle) * inverse_half`.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub(super) middle: f64,
    pub(super) inverse_half: f64,
    /// Even and odd powers.
    pub(super) powers: [[f64; MOST / 2]; 2],
    /// How many of each are used.
    pub(super) pairs: usize,
    /// Fours of Gauss points along a line on which s runs through a part of the interval of 2^-i of its width.
    pub(super) fours: [u8; WIDTHS],
}

/// One layer.
#[derive(Debug, Clone)]
pub(super) struct Table {
    /// Squared radii between the bands, from 0 to infinity.
    pub(super) breaks: Vec<f64>,
    pub(super) bands: Vec<Band>,
    pub(super) series: Vec<Series>,
    /// Bound of the error of a voxel's share, rounding included.
    pub(super) bound: f64,
    /// Shares nearer to 0 or 1 than this are rounding.
    pub(super) rounding: f64,
}

/// What a table is to be good for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// Heights between which the layer lies.
    pub(super) heights: [f64; 2],
    /// Shorter side of a voxel, across the axis.
    pub(super) side: f64,
    /// The largest radius of a voxel's corner.
    pub(super) reach: f64,
    /// Error allowed to a voxel's share.
    pub(super) error: f64,
}

struct Builder<'a> {
    wanted: Wanted,
    parts: &'a [Part],
    per_height: f64,
    table: Table,
    /// G at the start of the next band.
    sum: f64,
    samples: usize,
    chords: f64,
}

impl Table {
    /// The table of a layer; `None` where its pieces are too many for it or its errors too large.
    pub(super) fn new<'p>(
        pieces: impl Iterator<Item = BoundaryPiece<'p>>,
        wanted: Wanted,
    ) -> Option<Self> {
        let [low, high] = wanted.heights;
        let pieces: Vec<BoundaryPiece<'p>> = pieces.collect();
        if !pieces.iter().all(|p| is_tame(p)) {
            return None;
        }
        let parts = pieces.iter().filter_map(|p| Part::new(p, low, high));
        let parts: Vec<Part> = parts.collect();
        let per_height = 1.0 / (high - low);
        let far = wanted.reach / wanted.side;
        #[allow(clippy::cast_precision_loss, reason = "a count")]
        let count = parts.len() as f64;
        // K is at most ½ and known to some roundings, along four sides; heights to their own and the unit's.
        let rounding =
            f64::EPSILON * (16.0 * far + 16.0) + f64::EPSILON * per_height * (4.0 + count);
        if !(rounding <= LOST) {
            return None;
        }
        let mut builder = Builder {
            wanted,
            parts: &parts,
            per_height,
            table: Self {
                breaks: vec![0.0],
                bands: Vec::new(),
                series: Vec::new(),
                bound: 0.0,
                rounding,
            },
            sum: 0.0,
            samples: 0,
            chords: 0.0,
        };
        builder.fill()?;
        let mut table = builder.table;
        table.bound = 0.375 * wanted.error + builder.chords + rounding;
        (builder.chords <= 0.5 * wanted.error).then_some(table)
    }

    /// The band that holds `s`.
    #[inline(always)]
    pub(super) fn band(&self, s: f64) -> usize {
        self.breaks[1..self.bands.len()].partition_point(|b| *b <= s)
    }
}

/// Whether places on a piece are known by its parameter as well as roundings go: not near the end of one that its weights
/// draw all but there.
fn is_tame(part: &BoundaryPiece) -> bool {
    const MOST: f64 = 1e3;
    let [_, _, weights] = part.piece.twin().rows();
    let most = weights.iter().copied().fold(0.0, f64::max);
    weights.iter().all(|&w| w * MOST >= most)
}

impl Builder<'_> {
    fn fill(&mut self) -> Option<()> {
        let mut breaks: Vec<f64> = self.parts.iter().flat_map(|p| p.s).collect();
        breaks.push(0.0);
        breaks.sort_by(f64::total_cmp);
        // Nearer to each other than rounding.
        breaks.dedup_by(|b, a| *b - *a <= 4.0 * f64::EPSILON * *b);
        for ends in breaks.windows(2) {
            let [p, q] = [ends[0], ends[1]];
            let middle = 0.5 * (p + q);
            let active: Vec<usize> = (0..self.parts.len())
                .filter(|&i| self.parts[i].s[0] < middle && middle < self.parts[i].s[1])
                .collect();
            let beyond = self.beyond(middle);
            if active.is_empty() {
                self.constant(beyond, q)?;
            } else {
                self.varying([p, q], beyond, &active)?;
            }
        }
        self.constant(0.0, f64::INFINITY)
    }

    /// Share of the height that pieces beyond `s` bound.
    fn beyond(&self, s: f64) -> f64 {
        let beyond = self.parts.iter().filter(|p| p.s[0] >= s);
        beyond.map(Part::whole).sum::<f64>() * self.per_height
    }

    /// Adds a band of one height; `None` where no layer has such.
    fn constant(&mut self, height: f64, to: f64) -> Option<()> {
        if !(-LOST..=1.0 + LOST).contains(&height) {
            return None;
        }
        let snapped = if height.abs() <= self.table.rounding {
            0.0
        } else if (height - 1.0).abs() <= self.table.rounding {
            1.0
        } else {
            // Ends of pieces that count as one may be apart by a hair.
            height.clamp(0.0, 1.0)
        };
        let from = self.table.breaks[self.table.breaks.len() - 1];
        self.push(
            to,
            Band {
                height: snapped,
                pole: self.sum - 0.5 * snapped * from,
                series: None,
            },
        );
        if to.is_finite() {
            self.sum += 0.5 * snapped * (to - from);
        }
        Some(())
    }

    fn push(&mut self, to: f64, band: Band) {
        self.table.breaks.push(to);
        self.table.bands.push(band);
    }

    /// Adds the bands of an interval in which the pieces of `active` are.
    fn varying(&mut self, whole: [f64; 2], beyond: f64, active: &[usize]) -> Option<()> {
        let mut open = vec![(whole, 0)];
        while let Some((ends, depth)) = open.pop() {
            if self.table.bands.len() >= MOST_BANDS || self.samples >= MOST_SAMPLES {
                return None;
            }
            if let Some(terms) = self.heights(ends, beyond, active) {
                if self.band(ends, &terms) {
                    continue;
                }
            } else if let Some(terms) = self.chord(ends, beyond, active, depth)
                && self.band(ends, &terms)
            {
                continue;
            }
            let middle = 0.5 * (ends[0] + ends[1]);
            if depth >= DEPTH || !(middle > ends[0] && middle < ends[1]) {
                return None;
            }
            open.push(([middle, ends[1]], depth + 1));
            open.push(([ends[0], middle], depth + 1));
        }
        Some(())
    }

    /// The series of h, where the number of its points is proved to suffice.
    fn heights(&mut self, ends: [f64; 2], beyond: f64, active: &[usize]) -> Option<Terms> {
        #[allow(clippy::cast_precision_loss, reason = "a count")]
        let each = self.wanted.error / (16.0 * self.per_height * active.len() as f64);
        let mut needed = 1;
        let mut parts = Vec::with_capacity(active.len());
        for &i in active {
            let part = self.parts[i].between(ends);
            self.samples += 2;
            needed = needed.max(part.points_needed(ends, each)?);
            parts.push(part);
        }
        let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
        let mut values = [0.0; MOST];
        for part in &parts {
            let mut guess = 0.5;
            for (value, sigma) in values.iter_mut().zip(series::points(needed)) {
                let (height, t) = part.height(middle + half * sigma, guess);
                guess = t;
                *value += height * self.per_height;
            }
        }
        self.samples += needed * active.len();
        for value in &mut values[..needed] {
            *value += beyond;
        }
        Some(series::through(&values[..needed]))
    }

    /// h as a straight line, where its change is too small or the interval too narrow to matter.
    fn chord(
        &mut self,
        ends: [f64; 2],
        beyond: f64,
        active: &[usize],
        depth: u32,
    ) -> Option<Terms> {
        let width = ends[1].sqrt() - ends[0].sqrt();
        // A voxel's part of the ring: its width times the longest arc within a voxel.
        let share = (4.0 * width / self.wanted.side).min(1.0);
        if share > 1e-2 {
            return None;
        }
        let parts = active.iter().map(|&i| self.parts[i].between(ends));
        let change = parts.map(|p| p.variation()).sum::<f64>() * self.per_height;
        let lost = change * share;
        #[allow(clippy::cast_precision_loss, reason = "a count")]
        let chords = 32.0 + 4.0 * self.parts.len() as f64;
        if lost > self.wanted.error / (8.0 * chords) && depth < DEPTH - 8 {
            return None;
        }
        self.chords += lost;
        let at = |s: f64| {
            let heights = active.iter().map(|&i| {
                let part = &self.parts[i];
                part.between(ends).height(s, 0.5).0
            });
            heights.sum::<f64>() * self.per_height + beyond
        };
        let (a, b) = (at(ends[0]), at(ends[1]));
        let mut terms = [0.0; MOST + 1];
        terms[0] = 0.5 * (a + b);
        terms[1] = 0.5 * (b - a);
        Some(terms)
    }

    /// Adds the band of an interval whose heights are known; whether K can be had in few enough terms.
    fn band(&mut self, [p, q]: [f64; 2], heights: &Terms) -> bool {
        let (middle, half) = (0.5 * (p + q), 0.5 * (q - p));
        let mut sums = series::integral(heights);
        for sum in &mut sums {
            *sum *= 0.5 * half;
        }
        let end: f64 = sums.iter().sum();
        sums[0] += self.sum;
        // The error of a voxel's share per error of K, by its four sides.
        let per_error = 4.0 * q.sqrt() / self.wanted.side;
        let least = 0.5 * f64::EPSILON;
        let tolerance = (self.wanted.error / (16.0 * per_error)).max(least);
        let Some(points) = points_of_quotient(&sums, [p, q], tolerance) else {
            return false;
        };
        let values: Vec<f64> = series::points(points)
            .map(|sigma| series::value(&sums, sigma) / (middle + half * sigma))
            .collect();
        let mut terms = series::through(&values);
        let mut dropped = 0.0;
        for term in terms[1..].iter_mut().rev() {
            dropped += term.abs();
            if dropped > tolerance {
                break;
            }
            *term = 0.0;
        }
        // Two for the distance from the best polynomial to the rule, two for its length.
        let tolerance = (self.wanted.error / (32.0 * per_error)).max(least);
        self.sum += end;
        let fours = fours(&terms, tolerance);
        let last = terms.iter().rposition(|c| *c != 0.0).unwrap_or(0);
        let powers = series::powers(&terms);
        let mut series = Series {
            middle,
            inverse_half: 1.0 / half,
            powers: [[0.0; MOST / 2]; 2],
            pairs: last / 2 + 1,
            fours,
        };
        for (k, c) in powers.iter().enumerate().take(MOST) {
            series.powers[k % 2][k / 2] = *c;
        }
        #[allow(clippy::cast_possible_truncation, reason = "at most the most bands")]
        let index = self.table.series.len() as u32;
        self.table.series.push(series);
        self.push(
            q,
            Band {
                height: 0.0,
                pole: 0.0,
                series: Some(index),
            },
        );
        true
    }
}

/// The number of points that G / s takes over an interval, whose only pole is at 0.
fn points_of_quotient(sums: &Terms, [p, q]: [f64; 2], tolerance: f64) -> Option<usize> {
    let last = sums.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    if p == 0.0 {
        // G has the factor s.
        return Some(last.max(1)).filter(|n| *n <= MOST);
    }
    let (middle, half) = (0.5 * (p + q), 0.5 * (q - p));
    let pole = middle / half;
    let mut fewest: Option<usize> = None;
    for share in [0.2, 0.4, 0.6, 0.8, 0.95] {
        let reach = 1.0 + (pole - 1.0) * share;
        let rho = series::ellipse(reach).min(64.0);
        let most = series::bound_within(sums, rho) / (middle - half * series::reach(rho));
        let needed = series::points_needed(most, rho, tolerance);
        fewest = match (fewest, needed) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
    fewest
}

/// Fours of Gauss points for parts of the interval of each width, along a line on which s is of second degree.
///
/// A rule of n points is exact for polynomials in s of degree n - 1, so its error is at most twice the length times the
/// distance to the nearest of those, which the terms beyond bound, or within a part of the interval what is known of
/// the ellipses: those of a part of width w lie in that of the whole if `reach' - 1 <= (reach - 1) / w`, by the
/// distances to the foci.
fn fours(terms: &Terms, tolerance: f64) -> [u8; WIDTHS] {
    std::array::from_fn(|i| {
        let mut n = MOST;
        let mut rest = 0.0;
        while n > 1 && rest + terms[n - 1].abs() <= tolerance {
            rest += terms[n - 1].abs();
            n -= 1;
        }
        if i > 0 {
            #[allow(
                clippy::cast_possible_wrap,
                clippy::cast_possible_truncation,
                reason = "small"
            )]
            let width = 0.5_f64.powi(i as i32);
            for rho in [1.25, 1.6, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0] {
                let part = series::ellipse(1.0 + (series::reach(rho) - 1.0) / width);
                // A constant needs no points.
                let most = series::bound_within(&terms[1..], rho) * rho;
                // Its error bound is twice that of the nearest polynomial.
                if let Some(needed) = series::points_needed(most, part, 2.0 * tolerance) {
                    n = n.min(needed);
                }
            }
        }
        #[allow(clippy::cast_possible_truncation, reason = "at most six")]
        {
            n.div_ceil(4) as u8
        }
    })
}
