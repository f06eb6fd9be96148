//! Adaptive integrals with estimates of their own errors: Lobatto's rule of 4 points and Kronrod's
//! extension of it by 3, halved where they differ (Gander & Gautschi, Adaptive Quadrature, BIT 40, 2000).
//! Both look at the ends, so that what lies beside one is not missed.

/// A value and what it may be off by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// The integral of `f` over an interval, cut in `parts` to begin with, to an absolute tolerance; its
/// error is infinite where `most` intervals do not reach that. `f` gives its own error with its value.
pub(crate) fn integral(
    [a, b]: [f64; 2],
    parts: u32,
    tolerance: f64,
    most: u32,
    f: &mut dyn FnMut(f64) -> Estimate,
) -> Estimate {
    let (alpha, beta) = ((2.0_f64 / 3.0).sqrt(), 0.2_f64.sqrt());
    let mut sum = Estimate {
        value: 0.0,
        error: 0.0,
    };
    let width = (b - a) / f64::from(parts);
    let mut open: Vec<[f64; 2]> = (0..parts)
        .map(|k| [0, 1].map(|e| a + width * f64::from(k + e)))
        .collect();
    let mut looked = 0;
    while let Some([low, high]) = open.pop() {
        looked += 1;
        if looked > most {
            sum.error = f64::INFINITY;
            return sum;
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let mut own = 0.0_f64;
        let mut at = |x: f64| {
            let found = f(middle + x * half);
            own = own.max(found.error);
            found.value
        };
        let ends = at(-1.0) + at(1.0);
        let (outer, inner) = (at(-alpha) + at(alpha), at(-beta) + at(beta));
        let lobatto = half / 6.0 * (ends + 5.0 * inner);
        let kronrod =
            half / 1470.0 * (77.0 * ends + 432.0 * outer + 625.0 * inner + 672.0 * at(0.0));
        let difference = (kronrod - lobatto).abs();
        if difference <= tolerance * (high - low) / (b - a) {
            sum.value += kronrod;
            sum.error += difference + own * 2.0 * half;
        } else {
            open.extend([[low, middle], [middle, high]]);
        }
    }
    sum
}
