//! Text in pictures: DejaVu Sans, embedded, so that every machine draws the same.

use super::canvas::Canvas;
use super::colour::Linear;
use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};
use std::sync::OnceLock;

/// Where a text is relative to the point given for it, along its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    /// It starts there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

/// Which way a text runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Run {
    /// From left to right.
    Right,
    /// From bottom to top.
    Up,
}

fn font() -> &'static FontRef<'static> {
    static FONT: OnceLock<FontRef<'static>> = OnceLock::new();
    FONT.get_or_init(|| {
        FontRef::try_from_slice(dejavu::sans::regular()).expect("the embedded font is whole")
    })
}

/// The scale at which the font's letters are `size` pixels from the highest to the lowest.
fn scale(size: f32) -> PxScale {
    PxScale::from(size * 1.164)
}

/// Calls `each` with the glyphs of a text and where they are on its line.
fn lay_out(text: &str, size: f32, mut each: impl FnMut(GlyphId, f32)) -> f32 {
    let font = font().as_scaled(scale(size));
    let mut at = 0.0;
    let mut last = None;
    for c in text.chars() {
        let glyph = font.glyph_id(c);
        if let Some(last) = last {
            at += font.kern(last, glyph);
        }
        each(glyph, at);
        at += font.h_advance(glyph);
        last = Some(glyph);
    }
    at
}

/// How long a text is, in pixels.
pub(super) fn width(text: &str, size: f32) -> f32 {
    lay_out(text, size, |_, _| {})
}

/// How high capital letters and digits are at a size.
pub(super) fn cap_height(size: f32) -> f32 {
    // 1493 of the font's 2048 units to the em.
    size * 0.729
}

/// Draws a text with its baseline through `at`.
pub(super) fn draw(
    canvas: &mut Canvas,
    text: &str,
    size: f32,
    at: [f32; 2],
    (align, run): (Align, Run),
    colour: Linear,
) {
    let shift = match align {
        Align::Start => 0.0,
        Align::Middle => -0.5 * width(text, size),
        Align::End => -width(text, size),
    };
    lay_out(text, size, |id, along| {
        // Upright, the pixels of the glyph are those of the picture.
        let origin = match run {
            Run::Right => (at[0] + shift + along, at[1]),
            Run::Up => (shift + along, 0.0),
        };
        let glyph = id.with_scale_and_position(scale(size), origin);
        let Some(outline) = font().outline_glyph(glyph) else {
            return;
        };
        let corner = outline.px_bounds().min;
        outline.draw(|x, y, share| {
            // Dark strokes on light ground look thinner in linear light than they are.
            let share = share.clamp(0.0, 1.0).powf(0.75);
            let (x, y) = (pixel(corner.x) + signed(x), pixel(corner.y) + signed(y));
            match run {
                Run::Right => canvas.blend(x, y, colour, share),
                Run::Up => canvas.blend(pixel(at[0]) + y, pixel(at[1]) - x - 1, colour, share),
            }
        });
    });
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "a float to integer cast saturates"
)]
fn pixel(v: f32) -> isize {
    v.floor() as isize
}

fn signed(v: u32) -> isize {
    isize::try_from(v).unwrap_or(isize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every character that pictures may have.
    const ALL: &str = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ+\u{2212}.,:;=()/^\
         \u{b5}\u{d7}\u{2070}\u{b9}\u{b2}\u{b3}\u{2074}\u{2075}\u{2076}\u{2077}\u{2078}\u{2079}\u{207b}";

    fn drawn(text: &str, run: Run) -> Vec<u8> {
        let mut canvas = Canvas::new(48, 48, [1.0; 3]);
        draw(
            &mut canvas,
            text,
            20.0,
            [24.0, 24.0],
            (Align::Middle, run),
            [0.0; 3],
        );
        canvas.finish(false).rgb().to_vec()
    }

    #[test]
    fn every_character_is_drawn_and_its_own() {
        let mut seen = std::collections::BTreeMap::new();
        let blank = drawn(" ", Run::Right);
        assert!(blank.iter().all(|&b| b == 255));
        for c in ALL.chars() {
            let picture = drawn(&c.to_string(), Run::Right);
            let dark = picture.iter().filter(|&&b| b < 215).count();
            assert!(dark >= 3, "{c:?} is not seen");
            if let Some(other) = seen.insert(picture, c) {
                panic!("{c:?} looks like {other:?}");
            }
        }
        let missing = drawn("\u{e000}", Run::Right);
        assert!(
            !seen.contains_key(&missing),
            "a character is not in the font"
        );
    }

    #[test]
    fn text_that_runs_up_is_turned() {
        let (right, up) = (drawn("Lp", Run::Right), drawn("Lp", Run::Up));
        let at = |p: &[u8], x: usize, y: usize| p[3 * (y * 48 + x)];
        let mut differing = 0;
        for y in 0..47 {
            for x in 0..48 {
                // A quarter turn about the point that both have in common.
                let turned = at(&up, y, 47 - x);
                differing += u32::from(at(&right, x, y).abs_diff(turned) > 160);
            }
        }
        assert!(differing < 8, "{differing} pixels differ");
    }

    #[test]
    fn widths_add_up_and_follow_the_size() {
        let one = width("mm", 20.0);
        assert!((width("mm", 40.0) / one - 2.0).abs() < 1e-3);
        assert!(width("mmm", 20.0) > one * 1.4);
        assert!(width("", 20.0).abs() < 1e-6);
    }

    #[test]
    fn a_capital_is_as_high_as_said() {
        let mut canvas = Canvas::new(120, 120, [1.0; 3]);
        let place = (Align::Start, Run::Right);
        draw(&mut canvas, "H", 100.0, [10.0, 100.0], place, [0.0; 3]);
        let picture = canvas.finish(false);
        let dark = |y: usize| (0..120).any(|x| picture.pixel(x, y)[0] < 128);
        let rows: Vec<usize> = (0..120).filter(|&y| dark(y)).collect();
        let high = rows.len();
        let wanted = cap_height(100.0);
        assert!(
            (super::super::canvas::centre(high) - 0.5 - wanted).abs() <= 1.0,
            "{high}"
        );
        assert_eq!(rows[rows.len() - 1], 99);
    }
}
