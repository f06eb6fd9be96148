//! Gauss-Kronrod quadrature with an error estimate, refined until the estimate is met.
//!
//! One panel is the 15-point Kronrod rule. Its estimate is the larger of its distances from two
//! rules on parts of the same points: the 7 Gauss points, and the 8 others. For an analytic
//! integrand that overstates the error by many orders; for one with a kink either distance alone
//! can vanish by accident, both together do not. No rule looks beyond its outermost points, where
//! what is left of the panel may hide a kink or a step: there the integrand itself is compared with
//! the polynomial through the points. Panels are halved, the worst first, until the estimates sum
//! to the tolerance.
//!
//! * Source: Piessens et al., *QUADPACK* (1983), rule QK15; the second rule is the interpolatory
//!   one on the points that Kronrod adds.

/// Nodes of the Kronrod rule on [-1, 1], the non-negative half, descending; odd places are Gauss nodes.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Weights of the interpolatory rule on the points that Kronrod adds, degree 7.
const ADDED: [f64; 4] = [
    0.043_787_914_992_233_267,
    0.209_136_164_496_178,
    0.338_314_908_133_113_07,
    0.408_761_012_378_475_7,
];

/// How far out the integrand is compared with the polynomial, short of the end, where it may be something else.
const VERGE: f64 = 1.0 - 1e-6;
/// Values there of the polynomials that are 1 at one of the points and 0 at the others, from the near end to the far.
const BEYOND: [f64; 15] = [
    1.453_923_282_573_478_5,
    -0.706_575_797_202_559_6,
    0.419_983_687_205_886_3,
    -0.291_373_603_598_244_2,
    0.221_141_425_513_650_8,
    -0.174_542_958_097_954_93,
    0.139_761_438_250_267_94,
    -0.112_911_375_022_037_52,
    0.091_672_830_948_838_45,
    -0.073_767_330_612_192_47,
    0.057_710_000_628_405_235,
    -0.043_243_981_137_281_52,
    0.030_433_498_268_801_416,
    -0.018_448_660_052_567_35,
    0.006_237_542_333_509_022,
];

/// An integral with a bound on its error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Integral {
    /// The value.
    pub value: f64,
    /// An estimate of the absolute error, not below it.
    pub error: f64,
}

/// The place and its derivative at `u` of [0, 1] between two ends, at which of them it moves as the square of the step: a
/// square root there becomes analytic.
pub(crate) fn graded([a, b]: [f64; 2], graded: [bool; 2], u: f64) -> (f64, f64) {
    let (w, v) = (b - a, 1.0 - u);
    match graded {
        [false, false] => (a + w * u, w),
        [true, false] => (a + w * u * u, 2.0 * w * u),
        [false, true] => (b - w * v * v, 2.0 * w * v),
        // From the nearer end, for the rounding.
        [true, true] if u < 0.5 => (a + w * u * u * (3.0 - 2.0 * u), 6.0 * w * u * v),
        [true, true] => (b - w * v * v * (3.0 - 2.0 * v), 6.0 * w * u * v),
    }
}

/// One panel: the Kronrod value over [a, b] and an estimate of its error.
pub fn panel(f: &mut impl FnMut(f64) -> f64, a: f64, b: f64) -> Integral {
    panel_of(&mut |t| [f(t)], a, b)[0]
}

/// One panel for several integrands that share their points.
pub fn panel_of<const N: usize>(
    f: &mut impl FnMut(f64) -> [f64; N],
    a: f64,
    b: f64,
) -> [Integral; N] {
    let (c, h) = (0.5 * (a + b), 0.5 * (b - a));
    let middle = f(c);
    let mut kronrod = middle.map(|v| KRONROD[7] * v);
    let mut gauss = middle.map(|v| GAUSS[3] * v);
    let mut added = [0.0; N];
    // What the polynomial through the points is near either end.
    let mut verges = [middle.map(|v| BEYOND[7] * v); 2];
    for i in 0..7 {
        let (below, above) = (f(c - h * NODES[i]), f(c + h * NODES[i]));
        for n in 0..N {
            let pair = below[n] + above[n];
            kronrod[n] += KRONROD[i] * pair;
            if i % 2 == 1 {
                gauss[n] += GAUSS[i / 2] * pair;
            } else {
                added[n] += ADDED[i / 2] * pair;
            }
            let [near, far] = [BEYOND[i], BEYOND[14 - i]];
            verges[0][n] += near * below[n] + far * above[n];
            verges[1][n] += near * above[n] + far * below[n];
        }
    }
    let there = [f(c - h * VERGE), f(c + h * VERGE)];
    std::array::from_fn(|n| {
        let lesser = (kronrod[n] - gauss[n])
            .abs()
            .max((kronrod[n] - added[n]).abs());
        let off = |k: usize| (there[k][n] - verges[k][n]).abs();
        Integral {
            value: kronrod[n] * h,
            error: (lesser + (off(0) + off(1)) * (1.0 - NODES[0])) * h.abs(),
        }
    })
}

/// A panel of seven points for integrands that are analytic on it: the Kronrod value and, as for a longer [`panel`], the
/// larger of its distances from the rules on the three Gauss points and on the four others.
pub fn short_panel(f: &mut impl FnMut(f64) -> f64, a: f64, b: f64) -> Integral {
    const NODES: [f64; 3] = [
        0.960_491_268_708_020_3,
        0.774_596_669_241_483_4,
        0.434_243_749_346_802_54,
    ];
    const KRONROD: [f64; 4] = [
        0.104_656_226_026_467_27,
        0.268_488_089_868_333_44,
        0.401_397_414_775_962_2,
        0.450_916_538_658_474_14,
    ];
    let (c, h) = (0.5 * (a + b), 0.5 * (b - a));
    let middle = f(c);
    let pairs = NODES.map(|x| f(c - h * x) + f(c + h * x));
    let kronrod =
        KRONROD[0] * pairs[0] + KRONROD[1] * pairs[1] + KRONROD[2] * pairs[2] + KRONROD[3] * middle;
    let gauss = (5.0 * pairs[1] + 8.0 * middle) / 9.0;
    // Exact for squares, too: w x² + (1 - w) y² = 1/3.
    let [x, y] = [NODES[0] * NODES[0], NODES[2] * NODES[2]];
    let outer = (1.0 / 3.0 - y) / (x - y);
    let others = outer * pairs[0] + (1.0 - outer) * pairs[2];
    let error = (kronrod - gauss).abs().max((kronrod - others).abs());
    Integral {
        value: kronrod * h,
        error: error * h.abs(),
    }
}

/// Places in [0, 1] of the points of a rule, ascending.
pub fn points<const N: usize>(rule: &Nested<N>) -> [f64; N] {
    std::array::from_fn(|i| 0.5 + 0.5 * rule.node(i))
}

/// A Kronrod rule whose points are all known before any value is asked for.
#[derive(Debug)]
pub struct Nested<const N: usize> {
    /// The non-negative half of the points on [-1, 1], descending.
    nodes: &'static [f64],
    kronrod: &'static [f64],
    /// Weights of the Gauss points, at every second place.
    gauss: &'static [f64],
    /// Weights of the interpolatory rule on the others.
    others: &'static [f64],
}

/// Seven points, three of them those of Gauss.
pub const SEVEN: Nested<7> = Nested {
    nodes: &[
        0.960_491_268_708_020_3,
        0.774_596_669_241_483_4,
        0.434_243_749_346_802_54,
        0.0,
    ],
    kronrod: &[
        0.104_656_226_026_467_27,
        0.268_488_089_868_333_44,
        0.401_397_414_775_962_2,
        0.450_916_538_658_474_14,
    ],
    gauss: &[5.0 / 9.0, 8.0 / 9.0],
    others: &[0.197_234_964_590_250_83, 0.802_765_035_409_749_2],
};

/// Fifteen points, seven of them those of Gauss.
pub const FIFTEEN: Nested<15> = Nested {
    nodes: &NODES,
    kronrod: &KRONROD,
    gauss: &GAUSS,
    others: &ADDED,
};

/// What of the distance from the lesser of the two rules counts: it is of half the degree, and far from the value where
/// the other one is next to it, but does not agree with it by accident.
const LESSER: f64 = 1.0 / 64.0;

impl<const N: usize> Nested<N> {
    fn node(&self, i: usize) -> f64 {
        if i <= N / 2 {
            -self.nodes[i]
        } else {
            self.nodes[N - 1 - i]
        }
    }

    /// The integral over [0, 1] of what has those values at the [`points`]; for what is analytic there its error is far
    /// below the estimate.
    pub fn sum(&self, values: &[f64; N]) -> Integral {
        let (mut kronrod, mut gauss, mut others) = (0.0, 0.0, 0.0);
        for (i, value) in values.iter().enumerate() {
            let i = i.min(N - 1 - i);
            kronrod += self.kronrod[i] * value;
            if i % 2 == 1 {
                gauss += self.gauss[i / 2] * value;
            } else {
                others += self.others[i / 2] * value;
            }
        }
        let error = (kronrod - gauss)
            .abs()
            .max(LESSER * (kronrod - others).abs());
        Integral {
            value: 0.5 * kronrod,
            error: 0.5 * error,
        }
    }
}

/// Integral of `f` over [a, b] with an estimated absolute error of at most `tolerance`, or the
/// best that `max_panels` panels reach; the estimate tells.
pub fn integrate(
    mut f: impl FnMut(f64) -> f64,
    a: f64,
    b: f64,
    tolerance: f64,
    max_panels: usize,
) -> Integral {
    let first = panel(&mut f, a, b);
    if first.error <= tolerance || max_panels < 2 {
        return first;
    }
    let mut panels = vec![(a, b, first)];
    while panels.len() < max_panels {
        let total: f64 = panels.iter().map(|p| p.2.error).sum();
        if total <= tolerance {
            break;
        }
        let worst =
            (0..panels.len()).max_by(|&i, &j| panels[i].2.error.total_cmp(&panels[j].2.error));
        let Some(worst) = worst else { break };
        let (a, b, _) = panels[worst];
        let c = 0.5 * (a + b);
        if !(c > a && c < b) {
            break;
        }
        panels[worst] = (a, c, panel(&mut f, a, c));
        panels.push((c, b, panel(&mut f, c, b)));
    }
    // Summed from left to right, so the order of refinement does not show.
    panels.sort_by(|p, q| p.0.total_cmp(&q.0));
    panels.iter().fold(Integral::default(), |sum, p| Integral {
        value: sum.value + p.2.value,
        error: sum.error + p.2.error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_panel_is_exact_for_polynomials_of_degree_22() {
        for degree in 0..=22 {
            let got = panel(&mut |x: f64| x.powi(degree), 0.0, 2.0);
            let want = 2f64.powi(degree + 1) / f64::from(degree + 1);
            assert!(
                (got.value - want).abs() <= 1e-14 * want,
                "degree {degree}: {} for {want}",
                got.value
            );
        }
    }

    #[test]
    fn the_estimate_covers_the_true_error() {
        type Case = (&'static str, fn(f64) -> f64, f64);
        let cases: [Case; 5] = [
            (
                "quarter circle",
                |x| (1.0 - x * x).sqrt(),
                std::f64::consts::FRAC_PI_4,
            ),
            ("kink", |x| (x - 0.3).abs(), 0.29),
            // Halves of [0, 1] that no rule's points tell from straight ones.
            ("kink near an end", |x| (x - 0.998).max(0.0), 2e-6),
            ("step near an end", |x| f64::from(x > 0.999), 1e-3),
            (
                "peak",
                |x| 1.0 / (1e-4 + (x - 0.4) * (x - 0.4)),
                100.0 * (60f64.atan() + 40f64.atan()),
            ),
        ];
        for (name, f, want) in cases {
            let got = integrate(f, 0.0, 1.0, 1e-9, 400);
            assert!(got.error <= 1e-9, "{name}: estimate {}", got.error);
            assert!(
                (got.value - want).abs() <= got.error.max(1e-14 * want),
                "{name}: {} for {want}",
                got.value
            );
        }
    }
}
