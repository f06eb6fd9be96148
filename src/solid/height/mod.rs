//! The share of a cell that one smooth sheet of surface cuts off it, with a proved bound of the error.
//!
//! The cell is the cube |x|, |y|, |z| <= ½ and the sheet the graph x = h(y, z) over its square. With a linear part
//!
//! ```text
//!   h(y, z) = a + b y + c z + e(y, z)            |e| <= E(R) for complex |y|, |z| <= R/2
//!   V = ∬ clip(h + ½, 0, 1) dy dz                the part below the sheet
//! ```
//!
//! the sheet meets x = ±½ along curves y = g(z), as b is the larger slope. The square is cut at the z where these pass
//! its sides, and each panel mapped to a square: the middle and the half width of the rows along y are linear in z but for
//! E/b, where on |y - line| = r > E/b the linear part outweighs e (Rouché's theorem), so that g is analytic there
//! too. Gauss's rule in both directions errs by at most `64/15 M ρ^-2n / (1 - ρ^-2)` for an integrand of at most M on the
//! ellipses of [`proof`](super::flux); the integrand of the linear parts is a polynomial that it has exactly, so M is the bound of the
//! rest.

mod kit;
mod patch;
mod swept;
#[cfg(test)]
mod tests;

pub(super) use patch::{Below, Region, cell_of_patch, share_of_patch};
pub(super) use swept::{Swept, swept};

use crate::math::quadrature::Integral;
use smallvec::SmallVec;
use std::sync::LazyLock;

/// Sizes of the complex squares, in cells, that are tried.
pub(super) const SIZES: [f64; 8] = [2.0, 3.0, 4.5, 7.0, 11.0, 18.0, 30.0, 50.0];
/// Ellipses with half axes (ρ ± 1/ρ)/2 about [-1, 1] that are tried.
const RHO: [f64; 14] = [
    1.5, 2.0, 2.6, 3.4, 4.4, 5.5, 7.0, 9.0, 12.0, 16.0, 22.0, 30.0, 44.0, 60.0,
];
/// Points of the rules.
const POINTS: [usize; 7] = [2, 3, 4, 6, 8, 11, 15];

/// Nodes and weights on [-1, 1].
static RULES: LazyLock<[Vec<(f64, f64)>; POINTS.len()]> = LazyLock::new(|| {
    use crate::math::Real;
    POINTS.map(|n| {
        let nodes = crate::math::gauss::nodes(n).into_iter();
        nodes
            .map(|(x, w)| (2.0 * x.f64() - 1.0, 2.0 * w.f64()))
            .collect()
    })
});

/// ρ^-2n / (1 - ρ^-2) for each ellipse and rule.
static TAILS: LazyLock<[[f64; POINTS.len()]; RHO.len()]> = LazyLock::new(|| {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "a few points"
    )]
    RHO.map(|rho| POINTS.map(|n| rho.powi(-2 * (n as i32)) / (1.0 - 1.0 / (rho * rho))))
});

/// A sheet of surface over the square |y|, |z| <= ½.
pub(super) trait Height {
    /// a, b and c of the linear part.
    fn linear(&self) -> [f64; 3];

    fn deviations(&self) -> Deviations;

    /// The height at a place of the square.
    fn at(&self, y: f64, z: f64) -> Option<f64>;

    /// The height and its slopes.
    fn slopes(&self, y: f64, z: f64) -> Option<[f64; 3]>;
}

/// Bounds of e: infinite where nothing is known.
pub(super) struct Deviations {
    /// Of |e| over the real square, and of its slopes there.
    off: f64,
    steep: f64,
    /// E of each of [`SIZES`].
    sizes: [f64; SIZES.len()],
}

/// Where rows along y begin or end.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    /// At a side of the square.
    Side(f64),
    /// Where the sheet has this height.
    Level(f64),
}

/// A part of the square between two z.
#[derive(Debug, Clone, Copy)]
struct Panel {
    z: [f64; 2],
    rows: Rows,
}

/// The rows of a panel along y.
#[derive(Debug, Clone, Copy)]
enum Rows {
    /// All above the sheet.
    Empty,
    /// All below it.
    Full,
    /// Between these ends the height is within the cell; up to the first they are above the sheet, from the second on below it.
    Cut([End; 2]),
}

impl Panel {
    /// The middle and half the width.
    fn span(&self) -> [f64; 2] {
        [0.5 * (self.z[0] + self.z[1]), 0.5 * (self.z[1] - self.z[0])]
    }
}

type Panels = SmallVec<[Panel; 5]>;

/// A sheet that rises along y no less than it changes along z.
struct Sheet<'a, H> {
    height: &'a H,
    is_swapped: bool,
    /// -1 where y is turned round.
    sign: f64,
    /// The linear part.
    a: f64,
    b: f64,
    c: f64,
    deviations: [f64; SIZES.len()],
    /// Bounds over the real square of |e| and of its slopes.
    off: f64,
    steep: f64,
}

/// The share of the cell below a sheet: an error of at most `goal` is tried for; `None` where nothing is proved.
pub(super) fn share(height: &impl Height, goal: f64) -> Option<Integral> {
    let sheet = Sheet::new(height);
    let spread = 0.5 * (sheet.b + sheet.c.abs()) + sheet.off;
    if !spread.is_finite() {
        return None;
    }
    // What is beyond the cell by less counts as error.
    let over = 0.125 * goal;
    let (low, high) = (sheet.a - spread, sheet.a + spread);
    let whole = |value: f64, error: f64| {
        Some(Integral {
            value,
            error: error.max(0.0),
        })
    };
    if high <= -0.5 + over {
        return whole(0.0, high + 0.5);
    }
    if low >= 0.5 - over {
        return whole(1.0, 0.5 - low);
    }
    let mut sum = Integral::default();
    let levels: SmallVec<[f64; 2]> = [
        (low < -0.5 - over).then_some(-0.5),
        (high > 0.5 + over).then_some(0.5),
    ]
    .into_iter()
    .flatten()
    .collect();
    if levels.len() < 2 {
        sum.error += over;
    }
    if !levels.is_empty() && sheet.b <= 1.05 * sheet.steep {
        return None;
    }
    let mut panels = Panels::new();
    // A level that comes no further within a side of the square is taken for beyond it: it counts squared.
    let near = (0.02 * goal * sheet.b).sqrt();
    sum.error += sheet.panels(&levels, near, &mut panels)? * 0.02 * goal;
    #[allow(clippy::cast_precision_loss, reason = "a few")]
    let each = 0.5 * goal / panels.len().max(1) as f64;
    for panel in &panels {
        sheet.add(panel, each, &mut sum)?;
    }
    sum.error += 8.0 * f64::EPSILON;
    (sum.value.is_finite() && sum.error <= goal).then_some(sum)
}

impl<'a, H: Height> Sheet<'a, H> {
    fn new(height: &'a H) -> Self {
        let [a, b, c] = height.linear();
        let Deviations { off, steep, sizes } = height.deviations();
        let is_swapped = c.abs() > b.abs();
        let (b, c) = if is_swapped { (c, b) } else { (b, c) };
        // A disc of (R - 1)/2 about each place of the square (Cauchy's estimate).
        let slopes = SIZES.iter().zip(&sizes);
        let slopes = slopes.map(|(size, off)| 2.0 * off / (size - 1.0));
        Self {
            height,
            is_swapped,
            sign: if b < 0.0 { -1.0 } else { 1.0 },
            a,
            b: b.abs(),
            c,
            steep: slopes.fold(steep, f64::min),
            off,
            deviations: sizes,
        }
    }

    fn at(&self, y: f64, z: f64) -> Option<f64> {
        let y = y * self.sign;
        if self.is_swapped {
            self.height.at(z, y)
        } else {
            self.height.at(y, z)
        }
    }

    fn linear(&self, y: f64, z: f64) -> f64 {
        self.a + self.b * y + self.c * z
    }

    /// Cuts the square where rows begin or cease to pass a level, and tells how often one that comes no further within a side than
    /// `near` was taken for beyond it.
    fn panels(&self, levels: &[f64], near: f64, out: &mut Panels) -> Option<f64> {
        let mut cuts: SmallVec<[f64; 6]> = SmallVec::from_slice(&[-0.5, 0.5]);
        let mut passed = 0.0;
        for &level in levels {
            for side in [-0.5, 0.5] {
                let middle = self.linear(side, 0.0) - level;
                let reach = 0.5 * self.c.abs() + self.off;
                if middle.abs() > reach {
                    continue;
                }
                if middle.abs() + reach <= near {
                    passed += 1.0;
                    continue;
                }
                // Rising or falling throughout.
                if self.c.abs() <= self.steep {
                    return None;
                }
                cuts.extend(self.root(side, level)?);
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|b, a| *b - *a <= 1e-14);
        for pair in cuts.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let lower = self.at(-0.5, middle)?;
            let upper = self.at(0.5, middle)?;
            let mut rows = Rows::Cut([End::Side(-0.5), End::Side(0.5)]);
            for &level in levels {
                let is_lower = level < 0.0;
                if upper <= level {
                    if is_lower {
                        rows = Rows::Empty;
                    }
                } else if lower >= level {
                    if !is_lower {
                        rows = Rows::Full;
                    }
                } else if let Rows::Cut(ends) = &mut rows {
                    ends[usize::from(!is_lower)] = End::Level(level);
                }
            }
            out.push(Panel {
                z: [pair[0], pair[1]],
                rows,
            });
        }
        Some(passed)
    }

    /// Where the sheet over a side, on which it rises or falls, has a height; `None` inside where it has nowhere.
    fn root(&self, side: f64, level: f64) -> Option<Option<f64>> {
        let f = |z: f64| Some(self.at(side, z)? - level);
        let (mut low, mut high) = (-0.5, 0.5);
        let (mut at_low, mut at_high) = (f(low)?, f(high)?);
        if at_low == 0.0 || at_high == 0.0 || (at_low > 0.0) == (at_high > 0.0) {
            return Some(None);
        }
        // The secant, halving the value at the end it keeps.
        let mut kept = 0;
        for _ in 0..60 {
            let z = low - at_low * (high - low) / (at_high - at_low);
            let value = f(z)?;
            if value.abs() <= 1e-14 || high - low <= 1e-14 {
                return Some(Some(z));
            }
            if (value > 0.0) == (at_low > 0.0) {
                (low, at_low) = (z, value);
                at_high *= if kept < 0 { 0.5 } else { 1.0 };
                kept = -1;
            } else {
                (high, at_high) = (z, value);
                at_low *= if kept > 0 { 0.5 } else { 1.0 };
                kept = 1;
            }
        }
        Some(Some(0.5 * (low + high)))
    }

    /// Adds the part of a panel below the sheet, within `goal`.
    fn add(&self, panel: &Panel, goal: f64, sum: &mut Integral) -> Option<()> {
        let [middle, half] = panel.span();
        let ends = match panel.rows {
            Rows::Empty => return Some(()),
            Rows::Full => {
                sum.value += 2.0 * half;
                return Some(());
            }
            Rows::Cut(ends) => ends,
        };
        let (rule, error) = self.rule([middle, half], ends, goal);
        if !(error <= goal) {
            return None;
        }
        sum.error += error;
        let rule = &RULES[rule];
        for &(node, weight) in rule {
            let z = middle + half * node;
            let [from, to] = ends.map(|end| self.end(end, z, 3e-8));
            let ([from, low_error], [to, high_error]) = (from?, to?);
            let (m, h) = (0.5 * (from + to), 0.5 * (to - from));
            let mut row = 0.0;
            for &(node, weight) in rule {
                row += weight * (self.at(m + h * node, z)? + 0.5);
            }
            sum.value += half * weight * (h * row + (0.5 - to));
            sum.error += half * weight * (low_error + high_error);
        }
        Some(())
    }

    /// Where a row ends, and what the row's sum may be off by that.
    ///
    /// * `within`: what the height may be off there.
    fn end(&self, end: End, z: f64, within: f64) -> Option<[f64; 2]> {
        let level = match end {
            End::Side(y) => return Some([y, 0.0]),
            End::Level(level) => level,
        };
        let mut y = (level - self.linear(0.0, z)) / self.b;
        let mut slope = self.b;
        let mut before: Option<[f64; 2]> = None;
        let least = self.b - self.steep;
        // The integrand is continuous where a row ends: what the place is off counts squared.
        let lost = |off: f64| off * off / least;
        for _ in 0..8 {
            let off = self.at(y, z)? - level;
            if off.abs() <= within {
                let y = y - off / slope;
                return Some([y, lost(off)]);
            }
            if let Some([y0, off0]) = before
                && y != y0
            {
                let secant = (off - off0) / (y - y0);
                slope = secant.clamp(least, self.b + self.steep);
            }
            before = Some([y, off]);
            y -= off / slope;
        }
        let off = self.at(y, z)? - level;
        Some([y, lost(off)])
    }

    /// The first rule whose error over a panel is at most `goal`, or the last, and that error.
    fn rule(&self, [zc, hw]: [f64; 2], ends: [End; 2], goal: f64) -> (usize, f64) {
        let mut errors = [f64::INFINITY; POINTS.len()];
        // The ends' lines, in the panel's own z.
        let line = |end: End| match end {
            End::Side(y) => [y, 0.0],
            End::Level(level) => [
                (level - self.linear(0.0, zc)) / self.b,
                -self.c * hw / self.b,
            ],
        };
        let [low, high] = ends.map(line);
        let [low_bent, high_bent] = ends.map(|end| matches!(end, End::Level(_)));
        let middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
        let half = [0, 1].map(|k| 0.5 * (high[k] - low[k]));
        for (size, off) in SIZES.into_iter().zip(self.deviations) {
            if !off.is_finite() {
                break;
            }
            let bend = |bent: bool| if bent { off / self.b } else { 0.0 };
            let (low_off, high_off) = (bend(low_bent), bend(high_bent));
            let off_line = 0.5 * (low_off + high_off);
            for (rho, tails) in RHO.into_iter().zip(TAILS.iter()) {
                let sigma = 0.5 * (rho + 1.0 / rho);
                let reach = |line: [f64; 2]| line[0].abs() + line[1].abs() * sigma;
                let half_most = reach(half) + off_line;
                let fits = zc.abs() + hw * sigma <= 0.5 * size
                    && reach(low) + low_off <= 0.5 * size
                    && reach(high) + high_off <= 0.5 * size
                    && reach(middle) + off_line + half_most * sigma <= 0.5 * size;
                if !fits {
                    break;
                }
                // Of h + ½: its linear part, and what that misses.
                let rest = self.b * off_line * (1.0 + sigma) + off;
                let straight = (self.linear(middle[0], zc) + 0.5).abs()
                    + (self.b * middle[1].abs() + self.c.abs() * hw) * sigma
                    + self.b * reach(half) * sigma;
                let rows = hw * (off_line * (straight + rest) + reach(half) * rest);
                let beyond = hw * high_off;
                // Over [-1, 1] in both directions, and in one.
                let most = 64.0 / 15.0 * (4.0 * rows + beyond);
                for (error, tail) in errors.iter_mut().zip(tails) {
                    *error = error.min(most * tail);
                }
            }
        }
        let enough = errors.iter().position(|e| *e <= goal);
        let rule = enough.unwrap_or(POINTS.len() - 1);
        (rule, errors[rule])
    }
}
