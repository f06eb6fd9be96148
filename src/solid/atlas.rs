//! Where a patch of a body may cross other bodies.
//!
//! The patch's parameters, t across its lines and the share s along them, are cut into rectangles. A
//! rectangle in whose ball no face of another body comes is proved free of crossings with it, and
//! dropped; the rest is halved until its ball is small beside the two bodies. What is left follows the
//! curves in which the surfaces cross, so that the work grows with their length:
//!
//! ```text
//!   |x(t, s) - c| <= R on the rectangle,   dist(c, faces) > R   =>   no crossing
//! ```
//!
//! Along a line of the patch only those stretches are searched. Where what is left begins or ends as t
//! rises, the panels of the integrals are cut.

use super::body::Body;
use super::remains::Remains;
use super::rule::Patch;
use std::sync::Arc;

/// Parts of the smaller body's size down to which rectangles are halved.
const FINE: f64 = 24.0;
/// Rectangles asked on one patch, after which they are left as they are.
const MOST: u64 = 400_000;
/// Halvings across the lines.
const DEPTH: u32 = 24;

/// A stretch of the lines of some parameters that may cross a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Band {
    /// Its place among the bodies.
    pub(super) body: usize,
    /// Shares of the lines' ranges.
    pub(super) share: [f64; 2],
}

/// The lines up to a parameter, from where those before end, with what they may cross.
#[derive(Debug)]
struct Column {
    end: f64,
    bands: Vec<Band>,
}

/// What the lines of a patch may cross.
#[derive(Debug)]
pub(super) struct Atlas {
    columns: Vec<Column>,
    /// How many rectangles were asked.
    pub(super) work: u64,
}

/// A body that the patch may cross.
pub(super) struct Rival<'a> {
    pub(super) number: usize,
    pub(super) body: &'a Arc<Body>,
    pub(super) remains: &'a Remains,
    /// Work of a question.
    pub(super) price: u64,
}

struct Chart<'a> {
    body: &'a Body,
    patch: Patch,
    rivals: &'a [Rival<'a>],
    /// For each rival how large a rectangle may stay.
    fine: Vec<f64>,
    /// Room for the rounding of coordinates.
    room: f64,
    columns: Vec<Column>,
    work: u64,
}

impl Atlas {
    /// What `patch` of `body` may cross of `rivals`; coordinates are known to within `room`.
    pub(super) fn new(body: &Body, patch: Patch, rivals: &[Rival], room: f64) -> Self {
        let own = body.bounds().longest_side();
        let fine = rivals.iter().map(|r| {
            let size = r.body.bounds().longest_side().min(own);
            size / FINE
        });
        let mut chart = Chart {
            body,
            patch,
            rivals,
            fine: fine.collect(),
            room,
            columns: Vec::new(),
            work: 0,
        };
        let all = (0..rivals.len()).map(|body| Band {
            body,
            share: [0.0, 1.0],
        });
        let all = all.collect();
        chart.divide([0.0, 1.0], all, 0);
        let mut columns = chart.columns;
        for band in columns.iter_mut().flat_map(|c| &mut c.bands) {
            band.body = rivals[band.body].number;
        }
        Self {
            columns,
            work: chart.work,
        }
    }

    /// What the line at parameter `t` may cross.
    pub(super) fn bands(&self, t: f64) -> &[Band] {
        let k = self.columns.partition_point(|c| c.end < t);
        let last = self.columns.len().saturating_sub(1);
        self.columns.get(k.min(last)).map_or(&[], |c| &c.bands)
    }

    /// Parameters where panels begin and end, 0 and 1 included: where the bodies change that may be crossed.
    pub(super) fn cuts(&self) -> Vec<f64> {
        let bodies = |c: &Column| {
            let mut all: Vec<usize> = c.bands.iter().map(|b| b.body).collect();
            all.dedup();
            all
        };
        let mut cuts = vec![0.0];
        let pairs = self.columns.windows(2);
        cuts.extend(
            pairs
                .filter(|w| bodies(&w[0]) != bodies(&w[1]))
                .map(|w| w[0].end),
        );
        cuts.push(1.0);
        cuts
    }
}

impl Chart<'_> {
    /// Adds the columns of the lines between two parameters, where `bands` may cross.
    fn divide(&mut self, t: [f64; 2], bands: Vec<Band>, depth: u32) {
        let mut left = Vec::new();
        let mut wide = false;
        // The first on top, so that what is left is in order.
        let mut open: Vec<Band> = bands.into_iter().rev().collect();
        while let Some(band) = open.pop() {
            let rival = &self.rivals[band.body];
            let cover = self.body.cover(self.patch, t, band.share);
            let radius = (cover.across + cover.along) * (1.0 + 1e-9) + self.room;
            self.work += rival.price;
            if self.work > MOST {
                left.push(band);
                continue;
            }
            if rival.remains.is_nothing()
                || rival.remains.distance(rival.body, cover.centre, radius) >= radius
            {
                continue;
            }
            let fine = 0.5 * self.fine[band.body];
            let coarse = cover.across > fine;
            if cover.along > fine.max(if coarse { cover.across } else { 0.0 }) {
                let middle = 0.5 * (band.share[0] + band.share[1]);
                let half = |a, b| Band {
                    share: [a, b],
                    ..band
                };
                open.push(half(middle, band.share[1]));
                open.push(half(band.share[0], middle));
                continue;
            }
            wide |= coarse;
            left.push(band);
        }
        if left.is_empty() {
            self.columns.push(Column {
                end: t[1],
                bands: left,
            });
            return;
        }
        if wide && depth < DEPTH && self.work <= MOST {
            let middle = 0.5 * (t[0] + t[1]);
            self.divide([t[0], middle], joined(&left), depth + 1);
            self.divide([middle, t[1]], joined(&left), depth + 1);
        } else {
            self.columns.push(Column {
                end: t[1],
                bands: joined(&left),
            });
        }
    }
}

/// Bands in order, those of one body that meet as one.
fn joined(bands: &[Band]) -> Vec<Band> {
    let mut joined: Vec<Band> = Vec::new();
    for band in bands {
        match joined.last_mut() {
            #[allow(clippy::float_cmp, reason = "halves share their end")]
            Some(last) if last.body == band.body && last.share[1] == band.share[0] => {
                last.share[1] = band.share[1];
            }
            _ => joined.push(*band),
        }
    }
    joined
}
