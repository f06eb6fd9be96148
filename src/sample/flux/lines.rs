//! Integrals along lines of the grid.
//!
//! ```text
//!   E(a; b, c) = ∫_b^c a K(a² + y²) dy        the flux of K (x, y, 0) through the line x = a
//! ```
//!
//! A line is cut where it enters another band of the table. Where h is constant `∫ a (c/2 + d / (a² + y²)) dy` has a
//! closed form. Within a band of series K is a polynomial in y: these parts are listed, and Gauss points integrate all
//! of a row at once, four points at a time in the same order for all lanes, even and odd powers summed apart.

use super::series::MOST;
use super::table::{Series, Table, WIDTHS};
use crate::math::{Kernel, Real, gauss};
use std::sync::LazyLock;

/// Four Gauss points on [0, 1] and their weights.
type Four = ([f64; 4], [f64; 4]);

/// Gauss points by fours, for each number of fours.
static RULES: LazyLock<Vec<Vec<Four>>> = LazyLock::new(|| {
    let rule = |n: usize| {
        let nodes = gauss::nodes(4 * n);
        let fours = nodes.chunks_exact(4);
        let of = |four: &[gauss::Node]| {
            (
                std::array::from_fn(|i| four[i].0.f64()),
                std::array::from_fn(|i| four[i].1.f64()),
            )
        };
        fours.map(of).collect()
    };
    (0..=MOST / 4).map(rule).collect()
});

/// Part of a line within a band of series.
#[derive(Debug, Clone, Copy)]
struct Part {
    a: f64,
    y: [f64; 2],
    series: u32,
    fours: u32,
    line: u32,
}

/// The lines of a row: what flows through them, once [`Lines::integrate`] has run.
#[derive(Debug, Default)]
pub(super) struct Lines {
    fluxes: Vec<f64>,
    parts: Vec<Part>,
}

impl Lines {
    pub(super) fn clear(&mut self) {
        self.fluxes.clear();
        self.parts.clear();
    }

    /// A line through which `flux` flows besides what is added to it.
    pub(super) fn line(&mut self, flux: f64) -> u32 {
        self.fluxes.push(flux);
        #[allow(
            clippy::cast_possible_truncation,
            reason = "some for each voxel of a row"
        )]
        {
            (self.fluxes.len() - 1) as u32
        }
    }

    /// The flux through a line.
    pub(super) fn flux(&self, line: u32) -> f64 {
        self.fluxes[line as usize]
    }

    /// Adds to a line its part from `from` to `to`, at distance `a` from the axis.
    pub(super) fn add(&mut self, table: &Table, line: u32, a: f64, [from, to]: [f64; 2]) {
        if a == 0.0 {
            return;
        }
        if from < 0.0 && to > 0.0 {
            self.add_half(table, line, a, [0.0, -from]);
            self.add_half(table, line, a, [0.0, to]);
        } else if to <= 0.0 {
            self.add_half(table, line, a, [-to, -from]);
        } else {
            self.add_half(table, line, a, [from, to]);
        }
    }

    /// The same where y is not negative.
    fn add_half(&mut self, table: &Table, line: u32, a: f64, [from, to]: [f64; 2]) {
        let a2 = a * a;
        let end = a2 + to * to;
        let mut s = a2 + from * from;
        let mut band = table.band(s);
        let mut y = from;
        loop {
            let limit = table.breaks[band + 1];
            let next = if end <= limit {
                to
            } else {
                (limit - a2).max(0.0).sqrt()
            };
            if next >= to {
                self.add_part(table, (line, band), (a, a2), [y, to], [s, end]);
                return;
            }
            if next > y {
                self.add_part(table, (line, band), (a, a2), [y, next], [s, limit]);
                y = next;
            }
            s = limit;
            band += 1;
        }
    }

    fn add_part(
        &mut self,
        table: &Table,
        (line, band): (u32, usize),
        (a, a2): (f64, f64),
        y: [f64; 2],
        s: [f64; 2],
    ) {
        let band = &table.bands[band];
        if let Some(index) = band.series {
            let series = &table.series[index as usize];
            let narrow = narrowness(0.5 * (s[1] - s[0]) * series.inverse_half);
            self.parts.push(Part {
                a,
                y,
                series: index,
                fours: u32::from(series.fours[narrow]),
                line,
            });
            return;
        }
        let mut sum = 0.5 * band.height * (y[1] - y[0]);
        if band.pole != 0.0 {
            sum += band.pole * angle(a2, y);
        }
        self.fluxes[line as usize] += a * sum;
    }

    /// Adds what the listed parts come to.
    pub(super) fn integrate(&mut self, kernel: Kernel, table: &Table) {
        kernel.dispatch(Integrals {
            series: &table.series,
            parts: &self.parts,
            fluxes: &mut self.fluxes,
        });
        self.parts.clear();
    }
}

/// The parts of lines to integrate.
struct Integrals<'a> {
    series: &'a [Series],
    parts: &'a [Part],
    fluxes: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Integrals<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for part in self.parts {
            let series = &self.series[part.series as usize];
            let integral = match part.fours {
                0 | 1 => integral::<1>(series, part),
                2 => integral::<2>(series, part),
                3 => integral::<3>(series, part),
                4 => integral::<4>(series, part),
                5 => integral::<5>(series, part),
                _ => integral::<6>(series, part),
            };
            self.fluxes[part.line as usize] += part.a * integral;
        }
    }
}

/// ∫ K dy by that many fours of points.
#[inline(always)]
fn integral<const FOURS: usize>(series: &Series, part: &Part) -> f64 {
    let rule = &RULES[FOURS][..FOURS];
    let (a2, y) = (part.a * part.a, part.y);
    let length = y[1] - y[0];
    let mut sigma = [[0.0; 4]; FOURS];
    let mut square = [[0.0; 4]; FOURS];
    for f in 0..FOURS {
        for l in 0..4 {
            let at = y[0] + length * rule[f].0[l];
            let v = (a2 + at * at - series.middle) * series.inverse_half;
            sigma[f][l] = v;
            square[f][l] = v * v;
        }
    }
    let mut even = [[0.0; 4]; FOURS];
    let mut odd = [[0.0; 4]; FOURS];
    let pairs = series.pairs.min(MOST / 2);
    let powers = (series.powers[0][..pairs].iter()).zip(&series.powers[1][..pairs]);
    for (e, o) in powers.rev() {
        for f in 0..FOURS {
            for l in 0..4 {
                even[f][l] = even[f][l] * square[f][l] + e;
                odd[f][l] = odd[f][l] * square[f][l] + o;
            }
        }
    }
    let mut sums = [0.0; 4];
    for f in 0..FOURS {
        for l in 0..4 {
            sums[l] += rule[f].1[l] * (even[f][l] + odd[f][l] * sigma[f][l]);
        }
    }
    length * ((sums[0] + sums[1]) + (sums[2] + sums[3]))
}

/// The power of ½ not below a share of an interval, up to the last that is kept.
#[inline(always)]
fn narrowness(share: f64) -> usize {
    // The exponent of a number below 1: -1 for [½, 1).
    let exponent = (share.to_bits() >> 52 & 0x7ff) as usize;
    1022_usize.saturating_sub(exponent).min(WIDTHS - 1)
}

/// ∫ dy / (a² + y²).
#[inline(always)]
fn angle(a2: f64, y: [f64; 2]) -> f64 {
    // tan of the angle is a times this.
    let over_a = (y[1] - y[0]) / (a2 + y[0] * y[1]);
    let t2 = a2 * over_a * over_a;
    if t2 < 2e-3 {
        // The seventh term leaves t^14 / 15, below 1e-20.
        let terms = 1.0 / 3.0
            - t2 * (1.0 / 5.0
                - t2 * (1.0 / 7.0 - t2 * (1.0 / 9.0 - t2 * (1.0 / 11.0 - t2 / 13.0))));
        return over_a * (1.0 - t2 * terms);
    }
    let t = t2.sqrt();
    over_a * (t.atan() / t)
}
