//! What the runs of a field's leaf know at the nodes of one height, and between two of them.
//!
//! Where one feature answers for a stretch of length h, the cubic that has the distance and its slope at both ends errs by
//!
//! ```text
//!   |error| <= h⁴ / 384 · max |d⁗|,    |d⁗| <= 3 b³    b the bend, 1 / distance from the centre of curvature
//! ```
//!
//! and where features hand over within it, each jump J of the second derivative adds at most `h² J / 60` and each
//! jump K of the third at most `h³ K / 192` (the Peano kernel of cubic Hermite interpolation, a clamped beam, and
//! its slope).
//!
//! Source of d⁗: `d = ρ - R` with ρ the distance from the centre, differentiated along a line: `d″ = b τ²`,
//! `d‴ = -3 b² g τ²` with b = 1 / ρ, g the slope and τ² = 1 - g², and `b′ = -b² g`, `|b″| <= 2 |b|³`.

use super::chain::Local;
use super::field::MeridianField;
use super::field_nodes::MOST_RUNS;

/// Features that may follow each other within one cell.
pub(super) const MOST_JOINTS: usize = 4;
/// Difference of two bends, as a share of them, below which the features that touch are parts of one circle.
const SAME_BEND: f64 = 1e-9;
/// The most cells that one cubic serves.
const WIDEST: usize = 16;
/// Largest bend times length for which the bounds' variation over the cell is accounted.
const BENT: f64 = 0.25;

/// The nearest feature of a run, with its distance.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foot {
    pub(super) feature: u32,
    pub(super) local: Local,
}

/// Those of a leaf's runs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Feet {
    pub(super) list: [Foot; MOST_RUNS],
    pub(super) count: usize,
}

/// Runs that may be nearest: the first by its number, the others as bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rivals {
    pub(super) first: usize,
    pub(super) others: u32,
    /// Whether the cubic of each is within the tolerance.
    pub(super) good: bool,
}

impl Rivals {
    pub(super) fn has(self, run: usize) -> bool {
        run == self.first || self.others >> run & 1 != 0
    }
}

impl Foot {
    /// The distance without its sign.
    pub(super) fn size(&self) -> f64 {
        self.local.value.abs()
    }

    #[inline]
    pub(super) fn new(field: &MeridianField, from: u32, q: [f64; 2]) -> Self {
        let feature = field.chain().walk(from, q);
        Self {
            feature,
            local: field.chain().local(feature, q),
        }
    }
}

impl Feet {
    /// Those of a point, from a feature of each run.
    pub(super) fn new(field: &MeridianField, features: &[u32], q: [f64; 2]) -> Self {
        let mut feet = Self {
            count: features.len(),
            ..Self::default()
        };
        for (foot, &from) in feet.list.iter_mut().zip(features) {
            *foot = Foot::new(field, from, q);
        }
        feet
    }

    /// The foot of the least distance.
    pub(super) fn nearest(&self) -> &Foot {
        let mut nearest = &self.list[0];
        for foot in &self.list[..self.count] {
            if foot.size() < nearest.size() {
                nearest = foot;
            }
        }
        nearest
    }

    /// Leaves out those that are further than the nearest by more than `reach`.
    pub(super) fn keep_within(&mut self, reach: f64) {
        let most = self.nearest().size() + reach;
        let mut kept = 0;
        for n in 0..self.count {
            if self.list[n].size() <= most {
                self.list[kept] = self.list[n];
                kept += 1;
            }
        }
        self.count = kept;
    }

    fn all(&self) -> &[Foot] {
        &self.list[..self.count]
    }
}

/// One height of a field.
pub(super) struct Row<'a> {
    pub(super) field: &'a MeridianField,
    pub(super) z: f64,
    pub(super) tolerance: f64,
    /// The first cell, counted from r = 0.
    pub(super) first: i64,
}

impl Row<'_> {
    #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
    pub(super) fn node(&self, k: usize) -> [f64; 2] {
        let r = (self.first + k as i64) as f64 * self.field.cell();
        [r, self.z]
    }

    /// What two distances may come nearer to each other over some cells: neither changes by more than the way.
    pub(super) fn reach(&self, cells: usize) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let way = cells as f64 * self.field.cell();
        2.0 * (way + self.field.chain().margin())
    }

    /// The most cells for which one cubic may serve, from a foot at their beginning.
    pub(super) fn cells_for(&self, foot: &Foot) -> usize {
        let (bend, mut cells, mut h) = (foot.local.bend.abs(), 1, self.field.cell());
        while cells < WIDEST && smooth_error(2.0 * h, bend) <= self.tolerance {
            (cells, h) = (2 * cells, 2.0 * h);
        }
        cells
    }

    /// The feet of node `k`, from those of another point of the leaf.
    #[inline]
    pub(super) fn feet(&self, known: &Feet, k: usize) -> Feet {
        let q = self.node(k);
        let mut feet = *known;
        for foot in &mut feet.list[..known.count] {
            *foot = Foot::new(self.field, foot.feature, q);
        }
        feet
    }

    /// The runs that may be nearest between two nodes; `None` where the cubic of one of them may err by more than the
    /// tolerance over more than a cell.
    ///
    /// The differences to the others are linear but for the bends, where no other surface is crossed: they keep their
    /// sign where they have it at both ends by more than those. What the arcs err by is added: the sign of the distance
    /// is that of the surface that is nearer, not of its arc.
    #[inline]
    pub(super) fn rivals(&self, [near, far]: [&Feet; 2], [from, to]: [usize; 2]) -> Option<Rivals> {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let h = (to - from) as f64 * self.field.cell();
        let q = self.node(to);
        let passage = |i: usize| Passage::new(self.field, [&near.list[i], &far.list[i]], q, h);
        let good = |p: &Option<Passage>| p.as_ref().is_some_and(|p| p.error(h) <= self.tolerance);
        let one_cell = to - from == 1;
        let mut rivals = Rivals {
            first: 0,
            others: 0,
            good: true,
        };
        if near.count == 1 {
            rivals.good = good(&passage(0));
            return (rivals.good || one_cell).then_some(rivals);
        }
        let first = (1..near.count).fold(0, |m, i| {
            if near.list[i].size() < near.list[m].size() {
                i
            } else {
                m
            }
        });
        let own = passage(first);
        rivals.first = first;
        rivals.good = good(&own);
        if !(rivals.good || one_cell) {
            return None;
        }
        let bend = |p: &Option<Passage>| p.as_ref().map_or(f64::INFINITY, |p| p.bend);
        let own = bend(&own);
        let reach = self.reach(to - from);
        for (i, (a, b)) in near.all().iter().zip(far.all()).enumerate() {
            if i == first {
                continue;
            }
            let gap = |f: &Foot, feet: &Feet| f.size() - feet.list[first].size();
            if gap(a, near) + gap(b, far) > reach {
                continue;
            }
            let passage = passage(i);
            let bent = h * (bend(&passage) + own);
            let clear = a.local.value * b.local.value > 0.0
                && bent <= BENT
                && gap(a, near).min(gap(b, far)) > 0.25 * h * bent + self.field.chain().margin();
            if !clear {
                rivals.others |= 1 << i;
                rivals.good &= good(&passage);
                if !(rivals.good || one_cell) {
                    return None;
                }
            }
        }
        Some(rivals)
    }
}

/// What happens between the feet of two neighbouring nodes.
pub(super) struct Passage {
    /// The largest bend of the features passed.
    bend: f64,
    /// Sums of the jumps of the second and of the third derivative.
    jumps: [f64; 2],
}

impl Passage {
    /// From one foot to the next, which is that of `q`, on a stretch of length `h`; `None` where more features are
    /// passed than are followed.
    #[inline]
    pub(super) fn new(
        field: &MeridianField,
        [near, far]: [&Foot; 2],
        q: [f64; 2],
        h: f64,
    ) -> Option<Self> {
        let mut found = Self {
            bend: near.local.bend.abs().max(far.local.bend.abs()),
            jumps: [0.0; 2],
        };
        if near.feature == far.feature {
            return Some(found);
        }
        let chain = field.chain();
        let mut last = chain.bend(near.feature, q);
        for feature in chain.between(near.feature, far.feature, MOST_JOINTS)? {
            let bend = chain.bend(feature, q);
            let (difference, widest) = ((bend - last).abs(), bend.abs().max(last.abs()));
            found.bend = found.bend.max(widest);
            // Else they are parts of one circle.
            if difference > SAME_BEND * widest {
                // Both bends are taken at the far end; on the way from the joint they drift by b² h each, which
                // cancels but for their difference, and by terms in b³.
                let b = widest / (1.0 - BENT);
                let drift = h * b * b * b;
                found.jumps[0] += difference * (1.0 + 3.0 * h * b) + 6.0 * h * drift;
                found.jumps[1] += 2.4 * b * difference + 24.0 * drift;
            }
            last = bend;
        }
        Some(found)
    }

    /// A bound on the error of the cubic over a stretch of length `h`.
    pub(super) fn error(&self, h: f64) -> f64 {
        let [second, third] = self.jumps;
        smooth_error(h, self.bend) + h * h * (second / 60.0 + h * third / 192.0)
    }
}

/// The error over a stretch of length `h` where the bend at its ends is at most `bend`.
pub(super) fn smooth_error(h: f64, bend: f64) -> f64 {
    if bend * h > BENT {
        return f64::INFINITY;
    }
    // The centre of curvature may be nearer by the stretch's length.
    let hb = h * bend / (1.0 - bend * h);
    hb * hb * hb * h / 128.0
}
