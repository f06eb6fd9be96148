//! Round numbers for scales: steps of 1, 2 and 5 times a power of ten, and their labels.

/// The smallest of 1, 2 and 5 times a power of ten that is not less than `least`.
///
/// * `least`: finite and greater than 0.
#[must_use]
pub fn round_step(least: f64) -> f64 {
    let exponent = least.log10().floor();
    // A hair of room, so that the logarithm's rounding does not turn 1 into 2.
    let wanted = least * (1.0 - 1e-9);
    for e in [exponent, exponent + 1.0] {
        for m in [1.0, 2.0, 5.0] {
            let step = power(m, e);
            if step >= wanted {
                return step;
            }
        }
    }
    power(2.0, exponent + 1.0)
}

/// `m` times ten to the `e`; the division keeps 0.1 and 0.2 what they are as literals.
fn power(m: f64, e: f64) -> f64 {
    if e < 0.0 {
        m / 10_f64.powf(-e)
    } else {
        m * 10_f64.powf(e)
    }
}

/// The multiples of `step` from `low` to `high`.
#[must_use]
pub(super) fn multiples(low: f64, high: f64, step: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut n = (low / step - 1e-6).ceil();
    while n * step <= high + 1e-6 * step && found.len() < 1000 {
        // Adding 0 turns -0 into 0.
        found.push(n * step + 0.0);
        n += 1.0;
    }
    found
}

/// How the numbers of one scale are written: divided by a power of ten, with so many decimals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Labels {
    exponent: i32,
    decimals: usize,
}

impl Labels {
    /// For numbers up to `largest` in steps of `step`.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "exponents of f64"
    )]
    pub(super) fn new(largest: f64, step: f64) -> Self {
        let magnitude = largest.max(step).log10().floor() as i32;
        let exponent = if (-3..=4).contains(&magnitude) {
            0
        } else {
            magnitude
        };
        let scaled = step.log10() - f64::from(exponent);
        let decimals = (-(scaled + 1e-9).floor()).clamp(0.0, 12.0) as usize;
        Self { exponent, decimals }
    }

    /// A number of the scale, with a true minus sign.
    pub(super) fn text(&self, value: f64) -> String {
        let scaled = if self.exponent < 0 {
            value * 10_f64.powi(-self.exponent)
        } else {
            value / 10_f64.powi(self.exponent)
        };
        let text = format!("{scaled:.*}", self.decimals);
        match text.strip_prefix('-') {
            Some(rest) if rest.bytes().any(|b| b.is_ascii_digit() && b != b'0') => {
                format!("\u{2212}{rest}")
            }
            Some(rest) => rest.to_owned(),
            None => text,
        }
    }

    /// The unit that the numbers are in, with the power of ten.
    pub(super) fn unit(&self, units: &str) -> String {
        if self.exponent == 0 {
            units_label(units).to_owned()
        } else {
            let digits: String = self.exponent.to_string().chars().map(superscript).collect();
            format!("10{digits} {}", units_label(units))
        }
    }
}

/// The label of a unit as it is printed.
pub(super) fn units_label(units: &str) -> &str {
    if units == "um" { "\u{b5}m" } else { units }
}

fn superscript(c: char) -> char {
    match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_one_two_or_five() {
        for (least, wanted) in [
            (1.0, 1.0),
            (1.01, 2.0),
            (2.0, 2.0),
            (3.0, 5.0),
            (5.1, 10.0),
            (0.1, 0.1),
            (0.11, 0.2),
            (7e-9, 1e-8),
            (1e30, 1e30),
            (1000.0, 1000.0),
        ] {
            let found = round_step(least);
            assert!(
                (found / wanted - 1.0).abs() < 1e-12,
                "{least}: {found}, not {wanted}"
            );
        }
    }

    #[test]
    fn multiples_are_within() {
        assert_eq!(multiples(-1.0, 1.0, 0.5), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(multiples(0.2, 0.9, 0.5), [0.5]);
        assert!(multiples(0.1, 0.2, 0.5).is_empty());
    }

    #[test]
    fn labels_have_the_decimals_of_their_step() {
        let one = |largest, step, value| Labels::new(largest, step).text(value);
        assert_eq!(one(3.0, 0.5, -1.5), "\u{2212}1.5");
        assert_eq!(one(3.0, 0.5, 0.0), "0.0");
        assert_eq!(one(300.0, 50.0, 150.0), "150");
        assert_eq!(one(0.02, 0.005, 0.015), "0.015");
        assert_eq!(one(1.0, 0.2, -1e-18), "0.0");
        let large = Labels::new(2.5e7, 5e6);
        assert_eq!(
            (large.text(-1.5e7), large.unit("m")),
            ("\u{2212}1.5".into(), "10\u{2077} m".into())
        );
        let small = Labels::new(2.5e-7, 5e-8);
        assert_eq!(
            (small.text(2e-7), small.unit("um")),
            ("2.0".into(), "10\u{207b}\u{2077} \u{b5}m".into())
        );
    }
}
