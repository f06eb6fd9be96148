//! Colours: light, lightness, and the maps from numbers to them.
//!
//! Everything is drawn in linear light with the primaries of sRGB, each channel 0 to 1, and turned
//! into sRGB bytes at the end. The diverging map is a path in Oklab, where equal steps look equal:
//!
//! ```text
//!   L
//!   |            neutral              L falls by the same amount on both sides,
//!   |          .   '   .              the chroma grows, the hues stay
//!   |      .               .
//!   |  blue                  orange
//!   +--- -1 ------ 0 ------ 1 ---> t
//! ```
//!
//! * Source: B. Ottosson, *A perceptual color space for image processing* (2020), for Oklab;
//!   IEC 61966-2-1 for sRGB; P. Tol, *Colour schemes*, SRON/EPS/TN/09-002 (2021), for the colours
//!   of materials, which people of any colour vision can tell apart.

/// A colour in linear light, red, green and blue.
pub type Linear = [f32; 3];

/// Near white: what is behind a solid.
pub(super) const BACKGROUND: [u8; 3] = [247, 247, 248];
/// Near black: lines and text.
pub(super) const INK: [u8; 3] = [32, 34, 38];

/// The scheme "bright" of Tol, in the order in which materials take them.
const MATERIALS: [[u8; 3]; 7] = [
    [0x44, 0x77, 0xaa],
    [0xee, 0x66, 0x77],
    [0xcc, 0xbb, 0x44],
    [0x22, 0x88, 0x33],
    [0x66, 0xcc, 0xee],
    [0xaa, 0x33, 0x77],
    [0xbb, 0xbb, 0xbb],
];

/// The colour of a material, by its place among the materials of the scene.
#[must_use]
pub(super) fn material(place: usize) -> Linear {
    linear(material_bytes(place))
}

/// The same as sRGB bytes.
#[must_use]
pub(crate) fn material_bytes(place: usize) -> [u8; 3] {
    MATERIALS[place % MATERIALS.len()]
}

/// Linear light of sRGB bytes.
#[must_use]
pub fn linear(srgb: [u8; 3]) -> Linear {
    srgb.map(|byte| {
        let v = f32::from(byte) / 255.0;
        if v <= 0.040_45 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    })
}

/// sRGB of linear light, 0 to 255 before rounding; what no screen can show is clipped.
#[must_use]
pub(super) fn encoded(colour: Linear) -> [f32; 3] {
    colour.map(|v| {
        let v = v.clamp(0.0, 1.0);
        255.0
            * if v <= 0.003_130_8 {
                12.92 * v
            } else {
                1.055 * v.powf(1.0 / 2.4) - 0.055
            }
    })
}

/// Between two colours: `a` at 0, `b` at 1.
#[must_use]
pub(super) fn mix(a: Linear, b: Linear, share: f32) -> Linear {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * share)
}

/// Linear light of Oklab's lightness and two opponent axes; may leave what screens can show.
#[must_use]
pub fn from_oklab([l, a, b]: [f32; 3]) -> Linear {
    let cube = |v: f32| v * v * v;
    let l_ = cube(l + 0.396_337_78 * a + 0.215_803_76 * b);
    let m_ = cube(l - 0.105_561_346 * a - 0.063_854_17 * b);
    let s_ = cube(l - 0.089_484_18 * a - 1.291_485_5 * b);
    [
        4.076_741_7 * l_ - 3.307_711_6 * m_ + 0.230_969_94 * s_,
        -1.268_438 * l_ + 2.609_757_4 * m_ - 0.341_319_38 * s_,
        -0.004_196_086_3 * l_ - 0.703_418_6 * m_ + 1.707_614_7 * s_,
    ]
}

/// Oklab of a colour in linear light.
#[must_use]
pub fn to_oklab([r, g, b]: Linear) -> [f32; 3] {
    let l = (0.412_221_47 * r + 0.536_332_55 * g + 0.051_445_995 * b).cbrt();
    let m = (0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b).cbrt();
    let s = (0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b).cbrt();
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

/// Lightness where the diverging map is neutral.
const NEUTRAL: f32 = 0.965;
/// Lightness at its ends.
const END: f32 = 0.50;
/// Chroma at its ends: the most that both hues have at that lightness on a screen.
const CHROMA: f32 = 0.115;
/// Hues of the negative and the positive end, in degrees.
const HUES: [f32; 2] = [252.0, 48.0];

/// The diverging map: -1 is blue, 0 neutral, 1 orange; beyond, the ends.
///
/// Lightness is even in `t` and falls linearly from 0.965 to 0.5; equal steps of `t` are equal
/// steps in Oklab within 7 per cent.
///
/// ```
/// use voxlathe::picture::colour::{diverging, to_oklab};
/// let (low, high) = (to_oklab(diverging(-0.5)), to_oklab(diverging(0.5)));
/// assert!((low[0] - high[0]).abs() < 1e-4);
/// ```
#[must_use]
pub fn diverging(t: f32) -> Linear {
    let u = t.abs().min(1.0);
    let hue = HUES[usize::from(t > 0.0)].to_radians();
    // The chroma rises faster near the neutral, so that small values have a colour.
    let chroma = CHROMA * u * (1.6 - 0.6 * u);
    let l = NEUTRAL - (NEUTRAL - END) * u;
    from_oklab([l, chroma * hue.cos(), chroma * hue.sin()]).map(|v| v.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(i: i16) -> [f32; 3] {
        to_oklab(diverging(f32::from(i) / 128.0))
    }

    #[test]
    fn bytes_come_back() {
        for byte in 0..=255_u8 {
            let back = encoded(linear([byte; 3]));
            assert!(back.iter().all(|v| (v - f32::from(byte)).abs() < 1e-2));
        }
    }

    #[test]
    fn oklab_of_white_red_and_back() {
        // Values published with Oklab.
        for (colour, lab) in [
            ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [0.628, 0.225, 0.126]),
            ([0.0, 0.0, 1.0], [0.452, -0.032, -0.312]),
        ] {
            let found = to_oklab(colour);
            let back = from_oklab(found);
            for c in 0..3 {
                assert!((found[c] - lab[c]).abs() < 1e-3, "{found:?}");
                assert!((back[c] - colour[c]).abs() < 1e-4, "{back:?}");
            }
        }
    }

    #[test]
    fn lightness_of_the_diverging_map_is_even_and_falls() {
        for i in 0..128 {
            assert!((at(i)[0] - at(-i)[0]).abs() < 1e-4, "{i}");
            assert!(at(i + 1)[0] < at(i)[0] - 1e-3, "{i}");
        }
        let middle = at(0);
        assert!(middle[1].hypot(middle[2]) < 1e-3, "{middle:?}");
    }

    #[test]
    fn equal_steps_of_the_diverging_map_look_equal() {
        let step = |i: i16| {
            let (a, b) = (at(i), at(i + 1));
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>().sqrt()
        };
        let steps: Vec<f32> = (-128..128).map(step).collect();
        let mean = steps.iter().sum::<f32>() / 256.0;
        for (i, s) in steps.iter().enumerate() {
            assert!((s / mean - 1.0).abs() < 0.07, "{i}: {s} of {mean}");
        }
    }

    #[test]
    fn nothing_of_the_diverging_map_is_clipped() {
        for i in -128_i16..=128 {
            let c = diverging(f32::from(i) / 128.0);
            assert!(c.iter().all(|&v| v > 0.0 && v < 1.0), "{i}: {c:?}");
        }
    }

    #[test]
    fn beyond_the_ends_are_the_ends() {
        assert_eq!(diverging(7.0), diverging(1.0));
        assert_eq!(diverging(-7.0), diverging(-1.0));
        assert_ne!(diverging(-1.0), diverging(1.0));
    }
}
