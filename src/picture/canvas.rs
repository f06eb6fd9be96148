//! A picture in linear light, and the lines, areas and marks drawn on it.
//!
//! Pixel (x, y) covers the square from (x, y) to (x + 1, y + 1); y points down. What is drawn
//! covers a pixel by its share of it, estimated from the distance to the pixel's centre.

use super::colour::{Linear, encoded, mix};
use super::error::PictureError;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Something to draw on.
#[derive(Debug, Clone)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Linear>,
}

/// A line: half its width in pixels, its colour, and the lengths of dashes and gaps in turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) half_width: f32,
    pub(super) colour: Linear,
    pub(super) dashes: &'a [f32],
}

impl Pen<'_> {
    pub(super) fn solid(width: f32, colour: Linear) -> Self {
        Self {
            half_width: 0.5 * width,
            colour,
            dashes: &[],
        }
    }
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, colour: Linear) -> Self {
        Self {
            width,
            height,
            pixels: vec![colour; width * height],
        }
    }

    pub(super) fn row_mut(&mut self, y: usize) -> &mut [Linear] {
        &mut self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// Lays a colour over a pixel; outside the picture nothing happens.
    pub(super) fn blend(&mut self, x: isize, y: isize, colour: Linear, share: f32) {
        let inside = |v: isize, n: usize| usize::try_from(v).ok().filter(|&v| v < n);
        if let (Some(x), Some(y)) = (inside(x, self.width), inside(y, self.height)) {
            let pixel = &mut self.pixels[y * self.width + x];
            *pixel = mix(*pixel, colour, share.clamp(0.0, 1.0));
        }
    }

    /// Lays `share` of a colour over each pixel of the box from `low` to `high`, grown by a pixel.
    fn cover(
        &mut self,
        low: [f32; 2],
        high: [f32; 2],
        colour: Linear,
        share: impl Fn(f32, f32) -> f32,
    ) {
        let first = [0, 1].map(|a| whole(low[a]).saturating_sub(1));
        let sizes = [self.width, self.height];
        let last = [0, 1].map(|a| (whole(high[a]) + 2).min(sizes[a]));
        for y in first[1]..last[1] {
            for x in first[0]..last[0] {
                let found = share(centre(x), centre(y));
                if found > 0.0 {
                    let pixel = &mut self.pixels[y * self.width + x];
                    *pixel = mix(*pixel, colour, found.min(1.0));
                }
            }
        }
    }

    /// A filled rectangle.
    pub(super) fn rectangle(&mut self, low: [f32; 2], high: [f32; 2], colour: Linear) {
        self.cover(low, high, colour, |x, y| {
            let overlap =
                |v: f32, a: f32, b: f32| ((v + 0.5).min(b) - (v - 0.5).max(a)).clamp(0.0, 1.0);
            overlap(x, low[0], high[0]) * overlap(y, low[1], high[1])
        });
    }

    /// The sides of a rectangle.
    pub(super) fn frame(&mut self, low: [f32; 2], high: [f32; 2], pen: Pen<'_>) {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        for i in 0..4 {
            self.line(corners[i], corners[(i + 1) % 4], pen);
        }
    }

    /// A straight line with square ends.
    pub(super) fn line(&mut self, from: [f32; 2], to: [f32; 2], pen: Pen<'_>) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        if !(length > 0.0) {
            return;
        }
        let (ux, uy) = (dx / length, dy / length);
        let period: f32 = pen.dashes.iter().sum();
        let on = |along: f32| {
            // How far inside a dash, in pixels.
            let end = along.min(length - along);
            if pen.dashes.is_empty() {
                return end;
            }
            let mut at = along.rem_euclid(period);
            for (i, &dash) in pen.dashes.iter().enumerate() {
                if at < dash {
                    let room = at.min(dash - at);
                    return if i % 2 == 0 { room.min(end) } else { -room };
                }
                at -= dash;
            }
            end
        };
        let grow = pen.half_width + 1.0;
        let low = [from[0].min(to[0]) - grow, from[1].min(to[1]) - grow];
        let high = [from[0].max(to[0]) + grow, from[1].max(to[1]) + grow];
        self.cover(low, high, pen.colour, |x, y| {
            let (px, py) = (x - from[0], y - from[1]);
            let (along, across) = (px * ux + py * uy, (px * uy - py * ux).abs());
            let side = (pen.half_width + 0.5 - across).clamp(0.0, 1.0);
            side.min(2.0 * pen.half_width) * (on(along) + 0.5).clamp(0.0, 1.0)
        });
    }

    /// The picture as sRGB bytes, three a pixel. `dither` spreads the rounding over neighbours, so
    /// that slow changes of light show no bands.
    pub(super) fn finish(self, dither: bool) -> Picture {
        let mut rgb = Vec::with_capacity(3 * self.pixels.len());
        for (i, &pixel) in self.pixels.iter().enumerate() {
            let offset = if dither {
                noise(i % self.width, i / self.width)
            } else {
                0.5
            };
            for v in encoded(pixel) {
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "0 to 255 and a fraction"
                )]
                rgb.push((v + offset) as u8);
            }
        }
        Picture {
            width: self.width,
            height: self.height,
            rgb,
        }
    }
}

/// Interleaved gradient noise between 0.01 and 0.99: neighbours differ much, blocks average to a half.
///
/// Source: J. Jimenez, *Next generation post processing in Call of Duty: Advanced Warfare*,
/// SIGGRAPH 2014 course.
fn noise(x: usize, y: usize) -> f32 {
    let v = (52.982_918 * (0.067_110_56 * centre(x) + 0.005_837_15 * centre(y)).fract()).fract();
    0.01 + 0.98 * v
}

/// The whole part of what is not negative, 0 of what is.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a float to integer cast saturates"
)]
pub(super) fn whole(v: f32) -> usize {
    v as usize
}

/// The middle of a pixel.
#[allow(
    clippy::cast_precision_loss,
    reason = "pixels are counted in thousands"
)]
pub(super) fn centre(i: usize) -> f32 {
    i as f32 + 0.5
}

/// A number of pixels as a length.
#[allow(
    clippy::cast_precision_loss,
    reason = "pixels are counted in thousands"
)]
pub(super) fn length(pixels: usize) -> f64 {
    pixels as f64
}

/// A length of the screen in single precision.
#[allow(clippy::cast_possible_truncation, reason = "colours and pixels")]
pub(super) fn single(v: f64) -> f32 {
    v as f32
}

/// A finished picture: sRGB, 8 bits a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// Pixels along x.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels along y.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green and blue of each pixel, row by row from the top.
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The pixel in column `x` from the left and row `y` from the top.
    ///
    /// # Panics
    /// When there is no such pixel.
    #[must_use]
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        assert!(x < self.width, "column {x} of {}", self.width);
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// The bytes of a PNG file. Equal pictures give equal bytes.
    ///
    /// # Errors
    /// [`PictureError::Encode`] when the picture is too large for the format.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Vec::new();
        let failed = |reason: String| PictureError::Encode { reason };
        let side = |n: usize| u32::try_from(n).map_err(|e| failed(e.to_string()));
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
            .write_image(
                &self.rgb,
                side(self.width)?,
                side(self.height)?,
                ExtendedColorType::Rgb8,
            )
            .map_err(|e| failed(e.to_string()))?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::colour::linear;

    fn ink(canvas: &Canvas) -> f32 {
        canvas.pixels.iter().map(|p| 1.0 - p[0]).sum()
    }

    #[test]
    fn areas_and_lines_cover_what_they_measure() {
        let mut canvas = Canvas::new(40, 40, [1.0; 3]);
        canvas.rectangle([3.25, 4.5], [10.75, 9.25], [0.0; 3]);
        assert!((ink(&canvas) - 7.5 * 4.75).abs() < 1e-3);
        for to in [[35.0, 5.0], [5.0, 35.0], [30.0, 22.0]] {
            let mut canvas = Canvas::new(40, 40, [1.0; 3]);
            canvas.line([5.0, 5.0], to, Pen::solid(3.0, [0.0; 3]));
            let wanted = 3.0 * (to[0] - 5.0).hypot(to[1] - 5.0);
            assert!((ink(&canvas) / wanted - 1.0).abs() < 0.03, "{to:?}");
        }
    }

    #[test]
    fn dashes_leave_gaps() {
        let mut canvas = Canvas::new(60, 9, [1.0; 3]);
        let pen = Pen {
            dashes: &[6.0, 4.0],
            ..Pen::solid(1.0, [0.0; 3])
        };
        canvas.line([5.0, 4.5], [55.0, 4.5], pen);
        assert!((ink(&canvas) - 30.0).abs() < 1.0, "{}", ink(&canvas));
        let at = |x: usize| canvas.pixels[4 * 60 + x][0];
        assert!(at(7) < 0.01 && at(12) > 0.99 && at(17) < 0.01);
    }

    #[test]
    fn what_is_outside_is_not_drawn() {
        let mut canvas = Canvas::new(8, 8, [1.0; 3]);
        canvas.line([-50.0, -9.0], [-3.0, -9.0], Pen::solid(2.0, [0.0; 3]));
        canvas.rectangle([20.0, 20.0], [30.0, 30.0], [0.0; 3]);
        canvas.blend(-1, 3, [0.0; 3], 1.0);
        canvas.blend(3, 8, [0.0; 3], 1.0);
        assert!(ink(&canvas) < 1e-6);
    }

    #[test]
    fn dithering_keeps_bytes_and_averages_between_them() {
        let flat = Canvas::new(64, 64, linear([247, 31, 0])).finish(true);
        assert!(flat.rgb.chunks(3).all(|p| p == [247, 31, 0]));
        let (a, b) = (linear([100; 3])[0], linear([101; 3])[0]);
        let between = Canvas::new(64, 64, [a + 0.25 * (b - a); 3]).finish(true);
        let count = between.rgb.iter().filter(|&&v| v == 101).count();
        let share = f64::from(u32::try_from(count).unwrap()) / (3.0 * 64.0 * 64.0);
        assert!((share - 0.25).abs() < 0.03, "{share}");
    }

    #[test]
    fn a_png_holds_the_pixels() {
        let mut canvas = Canvas::new(3, 2, linear([10, 20, 30]));
        canvas.blend(2, 1, linear([250, 0, 128]), 1.0);
        let picture = canvas.finish(false);
        let bytes = picture.to_png().unwrap();
        let back = image::load_from_memory(&bytes).unwrap().to_rgb8();
        assert_eq!(back.dimensions(), (3, 2));
        assert_eq!(back.get_pixel(2, 1).0, [250, 0, 128]);
        assert_eq!(back.as_raw(), picture.rgb());
        assert_eq!(picture.pixel(2, 1), [250, 0, 128]);
    }
}
