//! Surfaces of a voxel that are nearly one.
//!
//! Where a bore is off its shaft by 1e-12 of a voxel, rows that touch both cross them in an order that rounding decides, and
//! every cut between two rows finds another. Such surfaces are made one: the second takes the equation of the first, so that
//! rows cross both at the same place. With f and g their functions, scaled alike, nothing is lost but a part of
//!
//! ```text
//!   { |f| <= d }        d >= |f - g| in the voxel
//! ```
//!
//! whose volume is bounded: over a box in which `|∂f/∂p_k| >= s`, a line along k is in it for `2 d / s` at most, and for
//! `2 sqrt(2 d / |a|)` where f is `a p_k² + ...` along it.

use super::Part;
use super::sheet::{Form, Quadric, Sheet};

/// Share of a voxel up to which what lies between two surfaces is left out.
pub(super) const LITTLE: f64 = 2e-11;
/// The same where nothing else leads to an answer.
pub(super) const AT_MOST: f64 = 1e-5;
/// How often boxes are halved for the bound.
const DEPTH: u32 = 4;

/// Makes surfaces the same that have no more than a share `most` of the voxel between them, and says how much of it that
/// may change.
pub(super) fn unite(parts: &mut [Part], most: f64) -> f64 {
    let mut lost = 0.0;
    let count = parts.iter().map(|p| p.surfaces.len()).sum();
    let place = |parts: &[Part], n: usize| {
        let mut rest = n;
        for (i, part) in parts.iter().enumerate() {
            match rest.checked_sub(part.surfaces.len()) {
                Some(less) => rest = less,
                None => return (i, rest),
            }
        }
        unreachable!("a number below the count of surfaces")
    };
    for n in 1..count {
        let (i, s) = place(parts, n);
        let Some(mine) = Equation::of(&parts[i].surfaces[s].sheet) else {
            continue;
        };
        let found = (0..n).find_map(|m| {
            let (j, t) = place(parts, m);
            let other = Equation::of(&parts[j].surfaces[t].sheet)?;
            let (same, between) = mine.replaced(&other, most)?;
            Some((same, between))
        });
        if let Some((same, between)) = found {
            same.put(&mut parts[i].surfaces[s].sheet);
            lost += between;
        }
    }
    lost
}

/// What of a voxel lies between a ring that rises by nothing to speak of and a plane; `None` where that is too much.
pub(super) fn between_plane(rise: f64, height: &Form) -> Option<f64> {
    let most = height.slope.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    let between = 2.0 * rise.abs() / most;
    (between <= LITTLE).then_some(between)
}

/// What is zero on a surface.
#[derive(Debug, Clone, Copy)]
enum Equation {
    Quadric(Quadric),
    Plane(Form),
}

impl Equation {
    fn of(sheet: &Sheet) -> Option<Self> {
        match sheet {
            Sheet::Cone { quadric, .. }
            | Sheet::Sphere { quadric, .. }
            | Sheet::Ball { quadric } => Some(Self::Quadric(*quadric)),
            Sheet::Plane { form, .. } => Some(Self::Plane(*form)),
            Sheet::Bent(_) => None,
        }
    }

    /// The other's equation with the sign of this one, and what may lie between the two in the voxel; `None` where that is
    /// nothing, as they are equal, or too much.
    fn replaced(&self, other: &Self, most: f64) -> Option<(Self, f64)> {
        match (self, other) {
            (Self::Quadric(f), Self::Quadric(g)) => {
                let (sign, off) = apart(&terms(f), &terms(g))?;
                let slab = Slab { of: g, off, most };
                let between = slab.volume([0.0; 3], 0.5, 0);
                let same = if sign < 0.0 { negated(g) } else { *g };
                (between <= most).then_some((Self::Quadric(same), 4.0 * between))
            }
            (Self::Plane(f), Self::Plane(g)) => {
                let list = |f: &Form| [f.slope[0], f.slope[1], f.slope[2], f.constant];
                let (sign, off) = apart(&list(f), &list(g))?;
                let steepest = g.slope.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
                let between = 2.0 * off / steepest;
                let same = g.scaled(sign, 0.0);
                (between <= most).then_some((Self::Plane(same), 4.0 * between))
            }
            _ => None,
        }
    }

    fn put(self, sheet: &mut Sheet) {
        match (self, sheet) {
            (
                Self::Quadric(one),
                Sheet::Cone { quadric, .. }
                | Sheet::Sphere { quadric, .. }
                | Sheet::Ball { quadric },
            ) => *quadric = one,
            (Self::Plane(one), Sheet::Plane { form, .. }) => *form = one,
            _ => {}
        }
    }
}

/// Every coefficient with the most that its monomial is in the voxel.
fn terms(q: &Quadric) -> [f64; 10] {
    let s = &q.squares;
    [
        0.25 * s[0][0],
        0.25 * s[1][1],
        0.25 * s[2][2],
        0.5 * s[0][1],
        0.5 * s[0][2],
        0.5 * s[1][2],
        q.linear[0],
        q.linear[1],
        q.linear[2],
        q.constant,
    ]
}

fn negated(q: &Quadric) -> Quadric {
    Quadric {
        squares: q.squares.map(|row| row.map(|s| -s)),
        linear: q.linear.map(|l| -l),
        constant: -q.constant,
    }
}

/// The sign of the factor that brings `f` nearest to `g`, and how far they are apart then; `None` where that is far, or
/// where they are equal.
fn apart<const N: usize>(f: &[f64; N], g: &[f64; N]) -> Option<(f64, f64)> {
    let dot = |a: &[f64; N], b: &[f64; N]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let factor = dot(f, g) / dot(f, f);
    if !(factor.is_finite() && factor != 0.0) {
        return None;
    }
    let off: f64 = f.iter().zip(g).map(|(a, b)| (factor * a - b).abs()).sum();
    let size = dot(g, g).sqrt();
    // The volume is asked for what may be near enough.
    (off <= 1e-4 * size && f != g).then_some((factor.signum(), off + 4.0 * f64::EPSILON * size))
}

/// Where a quadric is not further than `off` from zero.
struct Slab<'a> {
    of: &'a Quadric,
    off: f64,
    /// What its volume is held against.
    most: f64,
}

impl Slab<'_> {
    /// A bound on its volume in a cube of `half` the side about a point.
    fn volume(&self, middle: [f64; 3], half: f64, depth: u32) -> f64 {
        let (q, d) = (self.of, self.off);
        let side = 2.0 * half;
        // Half the gradient, and how much it changes.
        let slope = q.slope(middle).to_array();
        let turn = q
            .squares
            .map(|row| half * row.iter().map(|s| s.abs()).sum::<f64>());
        let reach: f64 = (0..3)
            .map(|k| 2.0 * half * (slope[k].abs() + 0.5 * turn[k]))
            .sum();
        if q.at(middle).abs() > reach + d {
            return 0.0;
        }
        let lines = (0..3).map(|k| {
            let least = 2.0 * (slope[k].abs() - turn[k]);
            let steep = if least > 0.0 {
                2.0 * d / least
            } else {
                f64::INFINITY
            };
            let bent = 2.0 * (2.0 * d / q.squares[k][k].abs()).sqrt();
            steep.min(bent).min(side)
        });
        let whole = lines.fold(side, f64::min) * side * side;
        if depth >= DEPTH || whole <= self.most / 512.0 {
            return whole;
        }
        let mut sum = 0.0;
        for corner in 0..8 {
            let at = |k: usize| middle[k] + if corner >> k & 1 == 1 { 0.5 } else { -0.5 } * half;
            sum += self.volume([at(0), at(1), at(2)], 0.5 * half, depth + 1);
        }
        sum.min(whole)
    }
}
