//! Whether a chain of curves rises or falls all along, certified.
//!
//! ```text
//!   z = Z / W,   z' = (Z' W - Z W') / W²        sign of z' = sign of N = Z' W - Z W', degree 2 p - 2
//!
//!   N = Σ c_k B_k,   c_k = Σ_{i<j, i+j=k+1} (j - i) C(p,i) C(p,j) / C(2p-2,k) · w_i w_j (z_j - z_i)
//! ```
//!
//! The second line follows from `B_j' B_i` - `B_j B_i'` = (j - i) `B_i B_j` / (t (1 - t)); its only differences are
//! those of the heights of control points, so unequal weights cost no digits. Where all coefficients of a Bézier
//! piece have one sign, so has N: a proof, not a sample. Where they do not, the piece is cut at the parameters where
//! N changes sign, which the signs of Bernstein coefficients isolate too. Constructions a and c describe the solid between curve and axis for chains
//! without a reversal; a horizontal part sweeps no volume, so it is reported for the caller to leave out.
//!
//! * Units: z in model units; parameters are those of the curves.
//! * Accuracy: pieces and coefficients are in double-double, z measured from the curve's first control point.
//!   Heights that differ by less than 2^-92 of the extent of z count as equal: a dip that shallow is none. Where
//!   N touches zero without changing sign the course goes on. Parameters are rounded to f64.
//! * Source: G. Farin, *Curves and Surfaces for CAGD*, 5th ed., §13.5 (derivatives), and §5.1 for the blossoms
//!   that make the pieces.

use super::ConstructError;
use crate::math::bernstein::{Coefficients, binomials, bracketed_root, split};
use crate::math::tolerance::GAP;
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve};

/// Which way a chain runs along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZDirection {
    /// z increases, apart from level parts.
    Rising,
    /// z decreases, apart from level parts.
    Falling,
    /// z is constant.
    Level,
}

/// A part of one curve of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePart {
    /// Which curve, from 0.
    pub curve: usize,
    /// Its parameter where the part starts.
    pub start: f64,
    /// Its parameter where the part ends.
    pub end: f64,
}

/// How a chain of curves runs along the axis; see [`z_course`].
#[derive(Debug, Clone, PartialEq)]
pub struct ZCourse {
    /// The direction in which the chain starts, level parts aside.
    pub direction: ZDirection,
    /// The parts that are horizontal, in order. They sweep no volume.
    pub level: Vec<CurvePart>,
    /// The first part that runs against the direction; `None` for a monotone chain.
    pub reversal: Option<CurvePart>,
}

impl ZCourse {
    /// Whether z never runs back; level parts are allowed.
    #[must_use]
    pub fn is_monotone(&self) -> bool {
        self.reversal.is_none()
    }

    /// Whether z is strictly monotone: no part is level or runs back.
    #[must_use]
    pub fn is_strictly_monotone(&self) -> bool {
        self.is_monotone() && self.level.is_empty()
    }
}

/// How the chain runs along its last coordinate: z of a space curve, or of a meridian curve (r, z).
///
/// * `chain`: curves head to tail, clamped or not; a gap up to 1e-9 of the chain's size is let pass.
///
/// # Errors
/// [`ConstructError::EmptyChain`], [`ConstructError::Gap`].
///
/// ```
/// # use voxlathe::construct::{AngleInterval, ZDirection, arc, full_circle, z_course};
/// let bulge = arc([0.0, 0.0], 1.0, AngleInterval::new(-90.0, 180.0)?)?;
/// let course = z_course(&[bulge])?;
/// assert_eq!((course.direction, course.is_strictly_monotone()), (ZDirection::Rising, true));
///
/// let circle = z_course(&[full_circle([3.0, 0.0], 1.0)?])?;
/// let back = circle.reversal.ok_or("a circle runs back")?;
/// assert_eq!((back.start, back.end), (0.25, 0.75));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn z_course<const D: usize>(chain: &[NurbsCurve<D>]) -> Result<ZCourse, ConstructError> {
    if chain.is_empty() {
        return Err(ConstructError::EmptyChain);
    }
    check_joints(chain)?;
    let mut course = ZCourse {
        direction: ZDirection::Level,
        level: Vec::new(),
        reversal: None,
    };
    for (index, curve) in chain.iter().enumerate() {
        for (part, direction) in parts(curve) {
            let part = CurvePart {
                curve: index,
                start: part[0],
                end: part[1],
            };
            course.take(part, direction);
        }
    }
    Ok(course)
}

impl ZCourse {
    /// Goes on by one part.
    fn take(&mut self, part: CurvePart, direction: ZDirection) {
        if direction == ZDirection::Level {
            match self.level.last_mut() {
                // Level pieces of one curve that meet are one part.
                Some(last) if last.curve == part.curve && last.end == part.start => {
                    last.end = part.end;
                }
                _ => self.level.push(part),
            }
        } else if self.direction == ZDirection::Level {
            self.direction = direction;
        } else if self.direction != direction {
            match &mut self.reversal {
                None => self.reversal = Some(part),
                Some(last) if last.curve == part.curve && last.end == part.start => {
                    last.end = part.end;
                }
                Some(_) => {}
            }
        }
    }
}

/// Whether consecutive curves meet.
fn check_joints<const D: usize>(chain: &[NurbsCurve<D>]) -> Result<(), ConstructError> {
    let mut low = [f64::INFINITY; D];
    let mut high = [f64::NEG_INFINITY; D];
    for curve in chain {
        let (a, b) = curve.control_bounds();
        for i in 0..D {
            (low[i], high[i]) = (low[i].min(a[i]), high[i].max(b[i]));
        }
    }
    let size = (0..D).fold(0.0, |size: f64, i| size.max(high[i] - low[i]));
    for (i, pair) in chain.windows(2).enumerate() {
        let end = pair[0].evaluate(pair[0].domain().1)?;
        let start = pair[1].evaluate(pair[1].domain().0)?;
        let gap = (0..D).fold(0.0, |gap: f64, i| gap.hypot(end[i] - start[i]));
        let allowed = GAP * size;
        if !(gap <= allowed) {
            return Err(ConstructError::Gap {
                curve: i + 1,
                gap,
                allowed,
            });
        }
    }
    Ok(())
}

/// A part of a curve over which z runs one way.
type Run = ([f64; 2], ZDirection);

/// The parts of one curve with one direction each, in order.
fn parts<const D: usize>(curve: &NurbsCurve<D>) -> Vec<Run> {
    let z = || curve.control_points().iter().map(|p| p[D - 1]);
    let (scale_z, scale_w) = (
        power_near_one(z()),
        power_near_one(curve.weights().iter().copied()),
    );
    let first = z().next().unwrap_or_default() * scale_z;
    let homogeneous: Vec<[Dd; 2]> = (z().zip(curve.weights()))
        .map(|(z, &w)| {
            let w = Dd::of(w * scale_w);
            [Dd::sum(z * scale_z, -first) * w, w]
        })
        .collect();
    let extent = z().fold(0.0, |m: f64, z| m.max((z * scale_z - first).abs()));
    let mut found = Vec::new();
    for span in curve.knots().spans() {
        let [z, w] = piece(curve.knots(), &homogeneous, span.index);
        let (slope, noise) = slope(&z, &w, extent);
        let mut inner = Vec::new();
        divide(&slope, &noise, [Dd::ZERO, Dd::ONE], 0, &mut inner);
        let width = span.end - span.start;
        let parameter = |t: Dd| {
            if t == Dd::ONE {
                span.end
            } else {
                span.start + width * t.f64()
            }
        };
        found.extend(inner.iter().map(|(ends, way)| (ends.map(parameter), *way)));
    }
    found
}

/// The power of two that brings the largest of the values near 1, where double-double has its full range.
fn power_near_one(values: impl Iterator<Item = f64>) -> f64 {
    let largest = values.fold(0.0, |m: f64, v| m.max(v.abs()));
    if largest > 0.0 {
        (-largest.log2().floor()).clamp(-1000.0, 1000.0).exp2()
    } else {
        1.0
    }
}

/// The coefficients `c_k` of N, and below what each is nothing but rounding.
fn slope(z: &[Dd], w: &[Dd], extent: f64) -> (Coefficients<Dd>, Coefficients<Dd>) {
    let p = z.len() - 1;
    let (choose, degree) = (binomials::<Dd>(p), 2 * p - 2);
    let below = Dd::of(extent * (-92.0_f64).exp2());
    let mut slope: Coefficients<Dd> = binomials::<Dd>(degree).iter().map(|_| Dd::ZERO).collect();
    let mut noise = slope.clone();
    for j in 1..=p {
        for i in 0..j {
            let factor = Dd::of((j - i) as f64) * choose[i] * choose[j] * w[i] * w[j];
            slope[i + j - 1] = slope[i + j - 1] + factor * (z[j] / w[j] - z[i] / w[i]);
            noise[i + j - 1] = noise[i + j - 1] + factor * below;
        }
    }
    for (k, count) in binomials::<Dd>(degree).into_iter().enumerate() {
        slope[k] = slope[k] / count;
        noise[k] = noise[k] / count;
    }
    (slope, noise)
}

/// Cuts [a, b] where the slope, given over its own [0, 1], changes sign.
///
/// An interval without a change of sign is done; one with a single change between clear ends is cut at the root;
/// any other is halved, down to 2^-60 of the piece, which separates no more than double-double can tell apart.
fn divide(
    slope: &[Dd],
    noise: &[Dd],
    [a, b]: [Dd; 2],
    depth: u32,
    found: &mut Vec<([Dd; 2], ZDirection)>,
) {
    let sign = |k: usize| {
        if slope[k].abs() <= noise[k] {
            0
        } else if slope[k] > Dd::ZERO {
            1
        } else {
            -1
        }
    };
    let last = slope.len() - 1;
    let mut changes = 0;
    let mut latest = 0;
    for now in (0..=last).map(sign).filter(|s| *s != 0) {
        changes += usize::from(latest * now < 0);
        latest = now;
    }
    if changes == 0 || depth == 60 {
        let way = match latest {
            1 => ZDirection::Rising,
            -1 => ZDirection::Falling,
            _ => ZDirection::Level,
        };
        found.push(([a, b], way));
    } else if changes == 1 && sign(0) != 0 && sign(last) != 0 {
        let root = a + (b - a) * bracketed_root(slope, 0.5);
        let ways = [ZDirection::Rising, ZDirection::Falling];
        let [before, after] = if sign(0) > 0 {
            ways
        } else {
            [ways[1], ways[0]]
        };
        found.push(([a, root], before));
        found.push(([root, b], after));
    } else {
        let half = Dd::of(0.5);
        let middle = (a + b) * half;
        let (left, right) = (split(slope, half), split(noise, half));
        divide(&left.0, &right.0, [a, middle], depth + 1, found);
        divide(&left.1, &right.1, [middle, b], depth + 1, found);
    }
}

/// Z and W of the Bézier piece of span k: blossoms with j arguments at its end.
fn piece(knots: &KnotVector, points: &[[Dd; 2]], k: usize) -> [Coefficients<Dd>; 2] {
    let (p, u) = (knots.degree(), knots.knots());
    let blossom = |at_end: usize| {
        let mut row = points[k - p..=k].to_vec();
        for level in 1..=p {
            let t = if level <= at_end { u[k + 1] } else { u[k] };
            for i in (level..=p).rev() {
                let (low, high) = (u[k - p + i], u[k + 1 + i - level]);
                let width = Dd::sum(high, -low);
                let (alpha, beta) = (Dd::sum(t, -low) / width, Dd::sum(high, -t) / width);
                let before = row[i - 1];
                row[i] = [0, 1].map(|c| beta * before[c] + alpha * row[i][c]);
            }
        }
        row[p]
    };
    let controls: Vec<[Dd; 2]> = (0..=p).map(blossom).collect();
    [0, 1].map(|c| controls.iter().map(|h| h[c]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bezier(points: &[[f64; 2]], weights: &[f64]) -> NurbsCurve<2> {
        let knots = KnotVector::bezier(points.len() - 1).expect("a degree");
        NurbsCurve::new(knots, points.to_vec(), weights.to_vec()).expect("valid")
    }

    fn polynomial(z: &[f64]) -> NurbsCurve<2> {
        let points: Vec<_> = z.iter().map(|&z| [1.0, z]).collect();
        bezier(&points, &vec![1.0; z.len()])
    }

    #[test]
    fn a_control_polygon_that_falls_need_not_make_the_curve_fall() {
        // z' = 3 (0.9 B0 - 0.5 B1 + 0.9 B2), whose least value is 0.6.
        let curve = polynomial(&[0.0, 0.9, 0.4, 1.3]);
        let course = z_course(&[curve]).expect("a chain");
        assert_eq!(course.direction, ZDirection::Rising);
        assert!(course.is_strictly_monotone());
    }

    #[test]
    fn a_reversal_is_placed_at_the_roots_of_the_slope() {
        // z' ∝ B0 - 4 B1 + B2 = 1 - 10 t + 10 t², with roots ½ ± √0.15.
        let course = z_course(&[polynomial(&[0.0, 1.0, -3.0, -2.0])]).expect("a chain");
        let back = course.reversal.expect("it falls in the middle");
        let half = 0.15_f64.sqrt();
        assert!((back.start - (0.5 - half)).abs() < 1e-15, "{back:?}");
        assert!((back.end - (0.5 + half)).abs() < 1e-15, "{back:?}");
        assert!(!course.is_monotone());
    }

    #[test]
    fn touching_zero_is_no_reversal_and_a_hair_less_is() {
        // z' ∝ B0 - B1 + B2 = (1 - 2 t)²; exact in these numbers.
        let touching = z_course(&[polynomial(&[0.0, 1.0, 0.0, 1.0])]).expect("a chain");
        assert!(touching.is_strictly_monotone(), "{touching:?}");
        // One ulp: the curve falls by about ε^{3/2} over a parameter interval of √ε.
        let dip = z_course(&[polynomial(&[0.0, 1.0, -f64::EPSILON, 1.0])]).expect("a chain");
        let back = dip.reversal.expect("a dip of one ulp is found");
        assert!((back.start + back.end - 1.0).abs() < 1e-7 && back.end > back.start);
        let width = (2.0 * f64::EPSILON).sqrt();
        assert!((back.end - back.start) < 2.0 * width, "{back:?}");
    }

    #[test]
    fn level_parts_are_reported_and_allowed() {
        let chain = [
            bezier(&[[0.0, 0.0], [2.0, 0.0]], &[1.0, 1.0]),
            bezier(&[[2.0, 0.0], [2.0, 1e6]], &[1.0, 3.0]),
            // Horizontal with unequal weights and at a height that no power of two divides.
            bezier(&[[2.0, 1e6], [1.5, 1e6], [1.0, 1e6]], &[1.0, 0.1, 7.0]),
            bezier(&[[1.0, 1e6], [0.0, 1e6 + 1.0]], &[1.0, 1.0]),
        ];
        let course = z_course(&chain).expect("a chain");
        assert_eq!(course.direction, ZDirection::Rising);
        assert!(course.is_monotone() && !course.is_strictly_monotone());
        let level: Vec<_> = course
            .level
            .iter()
            .map(|l| (l.curve, l.start, l.end))
            .collect();
        assert_eq!(level, [(0, 0.0, 1.0), (2, 0.0, 1.0)]);
        let flat = z_course(&chain[..1]).expect("a chain");
        assert_eq!(flat.direction, ZDirection::Level);
    }

    #[test]
    fn the_second_curve_of_a_chain_can_run_back() {
        let up = bezier(&[[1.0, 0.0], [1.0, 1.0]], &[1.0, 1.0]);
        let down = bezier(&[[1.0, 1.0], [0.0, 0.5]], &[1.0, 1.0]);
        let course = z_course(&[up.clone(), down.clone()]).expect("a chain");
        let back = course.reversal.expect("the second falls");
        assert_eq!((back.curve, back.start, back.end), (1, 0.0, 1.0));
        let falling = z_course(std::slice::from_ref(&down)).expect("a chain");
        assert_eq!(falling.direction, ZDirection::Falling);
        assert!(matches!(
            z_course(&[down, up]),
            Err(ConstructError::Gap { curve: 1, .. })
        ));
        assert!(matches!(
            z_course::<2>(&[]),
            Err(ConstructError::EmptyChain)
        ));
    }

    #[test]
    fn the_slope_is_the_numerator_of_the_quotient_rule() {
        use crate::math::bernstein::quotient_derivative;
        for p in 1..=8 {
            let value = |i: usize| Dd::of((1.7 * (i + 3 * p) as f64).sin());
            let w: Vec<Dd> = (0..=p).map(|i| Dd::of(1.5) + value(i + 20)).collect();
            let z: Vec<Dd> = (0..=p).map(|i| value(i) * w[i]).collect();
            let (found, noise) = slope(&z, &w, 1.0);
            for (k, wanted) in quotient_derivative(&z, &w).iter().enumerate() {
                // The rule's top degree, 2 p - 1, is one too many: it is the product with (1 - t) + t.
                let n = 2.0 * p as f64 - 1.0;
                let before = if k > 0 { found[k - 1] } else { Dd::ZERO };
                let here = found.get(k).copied().unwrap_or(Dd::ZERO);
                let share = Dd::of(k as f64 / n);
                let raised = share * before + (Dd::ONE - share) * here;
                let gap = (raised - *wanted).abs().f64();
                assert!(gap <= 1e-14, "degree {p}, coefficient {k}: {gap}");
            }
            assert!(noise.iter().all(|m| *m > Dd::ZERO));
        }
    }

    #[test]
    fn unequal_weights_hide_nothing() {
        // Up, down, up in steps of 1, with weights that fall by 1e-40 each.
        let z = [5.0, 6.0, 5.0, 6.0];
        let points: Vec<_> = z.iter().map(|&z| [1.0, z]).collect();
        let weights = [1.0, 1e-40, 1e-80, 1e-120];
        let knots = KnotVector::clamped_uniform(1, 4).expect("knots");
        let curve = NurbsCurve::new(knots, points.clone(), weights.to_vec()).expect("valid");
        let back = z_course(&[curve])
            .expect("a chain")
            .reversal
            .expect("the second falls");
        assert_eq!((back.start, back.end), (1.0 / 3.0, 2.0 / 3.0));
        let monotone = bezier(&[[1.0, 5.0], [1.0, 6.0], [1.0, 7.0]], &[1.0, 1e-40, 1e-90]);
        let course = z_course(&[monotone]).expect("a chain");
        assert_eq!(course.direction, ZDirection::Rising);
        assert!(course.is_strictly_monotone(), "{course:?}");
    }

    #[test]
    fn clustered_roots_end() {
        // z' ∝ (t - ½)^9: one change of sign, of order nine; and its square has none.
        let mut odd: Coefficients<Dd> = std::iter::once(Dd::ONE).collect();
        let factor = [Dd::of(-0.5), Dd::of(0.5)];
        for _ in 0..9 {
            odd = crate::math::bernstein::product(&odd, &factor);
        }
        for (derivative, reversed) in [
            (odd.clone(), true),
            (crate::math::bernstein::product(&odd, &odd), false),
        ] {
            let mut height = 0.0;
            let mut z = vec![0.0];
            for c in &derivative {
                height += c.f64();
                z.push(height);
            }
            let course = z_course(&[polynomial(&z)]).expect("a chain");
            assert_eq!(course.reversal.is_some(), reversed, "{course:?}");
        }
    }

    proptest! {
        /// Against brute force: the slope by dense sampling of the derivative.
        #[test]
        fn agrees_with_dense_sampling(
            z in prop::collection::vec(-1.0..1.0_f64, 3..7),
            climb in 0.0..3.0_f64,
            log_weights in prop::collection::vec(-1.0..1.0_f64, 7),
            unclamped in any::<bool>(),
            offset in prop_oneof![Just(0.0), Just(1e6)],
        ) {
            let points: Vec<[f64; 2]> = z.iter().enumerate()
                .map(|(i, z)| [0.5, offset + z + climb * i as f64])
                .collect();
            let weights: Vec<f64> = log_weights[..z.len()].iter().map(|e| e.exp2()).collect();
            let knots = if unclamped {
                KnotVector::unclamped_uniform(2, z.len())
            } else {
                KnotVector::clamped_uniform(2, z.len())
            };
            let curve = NurbsCurve::new(knots.expect("valid"), points, weights).expect("valid");
            let course = z_course(std::slice::from_ref(&curve)).expect("a chain");
            let (a, b) = curve.domain();
            let (mut up, mut down) = (0.0_f64, 0.0_f64);
            for i in 0..=400 {
                let u = (a + (b - a) * f64::from(i) / 400.0).min(b);
                let slope = curve.derivatives(u, 1).expect("inside")[1][1];
                up = up.max(slope);
                down = down.min(slope);
            }
            let rounding = 1e-13 * (1.0 + offset);
            if up > rounding && down < -rounding {
                prop_assert!(course.reversal.is_some(), "{up} {down}");
            }
            if let Some(back) = course.reversal {
                let u = 0.5 * (back.start + back.end);
                let slope = curve.derivatives(u, 1).expect("inside")[1][1];
                let sign = if course.direction == ZDirection::Rising { 1.0 } else { -1.0 };
                prop_assert!(sign * slope <= rounding, "{slope} at {u}");
            }
        }
    }
}
