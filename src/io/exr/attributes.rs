//! Custom header attributes, and those that say where a layer is.
//!
//! Numbers in text have 17 significant digits, which every f64 survives.

use std::collections::BTreeMap;

use super::SIGN_CONVENTION;
use crate::grid::GridSpec;

/// The value of a custom header attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// ASCII text; other characters are written as `\u{...}`.
    Text(String),
    /// A 32-bit integer.
    Int(i32),
    /// A double.
    Double(f64),
}

/// Custom header attributes by name.
pub type Attributes = BTreeMap<String, Attribute>;

/// The `voxlathe:` attributes of layer `k`.
///
/// * `units`: label of the scene's lengths.
/// * `scene`: name and BLAKE3 digest of the resolved scene, where there is one.
#[must_use]
pub fn layer_attributes(
    grid: &GridSpec,
    k: usize,
    units: &str,
    scene: Option<(&str, &str)>,
) -> Attributes {
    let triple = |v: glam::DVec3| Attribute::Text(v.to_array().map(decimal17).join(" "));
    let mut attributes = Attributes::new();
    let mut set = |name: &str, value| attributes.insert(format!("voxlathe:{name}"), value);
    set("origin", triple(grid.origin()));
    set("spacing", triple(grid.spacing()));
    set(
        "dims",
        Attribute::Text(grid.dims().map(|d| d.to_string()).join(" ")),
    );
    set(
        "slice",
        // A grid dimension fits i32, so the other arm is never taken.
        Attribute::Int(i32::try_from(k).unwrap_or(i32::MAX)),
    );
    set("z", Attribute::Double(grid.centre_along(2, k)));
    set("units", Attribute::Text(units.into()));
    set("signConvention", Attribute::Text(SIGN_CONVENTION.into()));
    if let Some((name, hash)) = scene {
        set("scene", Attribute::Text(name.into()));
        set("sceneHash", Attribute::Text(hash.into()));
    }
    attributes
}

/// `value` in decimal with 17 significant digits, trailing zeros dropped, as C's `%.17g` has it.
#[must_use]
pub fn decimal17(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let scientific = format!("{value:.16e}");
    let Some((mantissa, Ok(exponent))) = scientific
        .split_once('e')
        .map(|(m, e)| (m, e.parse::<i32>()))
    else {
        return scientific;
    };
    if (-4..17).contains(&exponent) {
        // As many decimals as make 17 digits in all.
        let decimals = usize::try_from(16 - exponent).unwrap_or(0);
        trim_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{}e{exponent:+03}", trim_zeros(mantissa))
    }
}

fn trim_zeros(decimal: &str) -> &str {
    if decimal.contains('.') {
        decimal.trim_end_matches('0').trim_end_matches('.')
    } else {
        decimal
    }
}

/// `text` in printable ASCII: OpenEXR text is bytes, and readers differ on what they mean.
pub(in super::super) fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c == ' ' || c.is_ascii_graphic() {
            out.push(c);
        } else {
            out.extend(c.escape_unicode());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seventeen_digits_survive() {
        for (value, wanted) in [
            (0.1, "0.10000000000000001"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.0, "0"),
            (1e300, "1.0000000000000001e+300"),
            (1e-5, "1.0000000000000001e-05"),
            (123_456_789.0, "123456789"),
            (1e16, "10000000000000000"),
            (1e17, "1e+17"),
        ] {
            assert_eq!(decimal17(value), wanted);
        }
        let mut state = 7_u64;
        for _ in 0..10_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let value = f64::from_bits(state);
            if value.is_finite() {
                assert_eq!(decimal17(value).parse(), Ok(value));
            }
        }
    }
}
