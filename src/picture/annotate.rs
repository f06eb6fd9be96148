//! What is written into pictures: scale bars, axes, names.

use super::camera::Camera;
use super::canvas::{Canvas, Pen, length, single};
use super::colour::{self, Linear};
use super::field::Field;
use super::text::{self, Align, Run};
use super::ticks::{Labels, round_step};
use crate::scene::Scene;
use glam::DVec3;

/// Below this width and height, in pixels, text would be larger than what it explains.
const LEAST: [usize; 2] = [300, 220];

/// Whether a picture is large enough for text.
pub(super) fn has_room(width: usize, height: usize) -> bool {
    width >= LEAST[0] && height >= LEAST[1]
}

/// Widths of lines relative to those of a picture of 1200 by 900.
pub(super) fn stroke(width: usize, height: usize) -> f64 {
    (length(width) / 1200.0)
        .min(length(height) / 900.0)
        .max(0.5)
}

/// The size of text in pixels.
pub(super) fn text_size(width: f32, height: f32) -> f32 {
    (width.min(1.35 * height) / 50.0).max(11.0)
}

/// The height at the bottom of a shaded picture that is kept for what is written, in pixels.
pub(super) fn band([w, h]: [f32; 2], entries: &[(String, Linear)]) -> f64 {
    let size = text_size(w, h);
    let lines = wrapped(legend_span(w, size), size, entries).len().max(1);
    f64::from((1.7 + 1.3 * single(length(lines))) * size)
}

/// Between what a shaded picture's legend has room: beside the axes and the scale bar.
fn legend_span(width: f32, size: f32) -> [f32; 2] {
    [7.5 * size, 0.76 * width]
}

pub(super) fn ink() -> Linear {
    colour::linear(colour::INK)
}

/// A bar of a round length at the lower right.
pub(super) fn scale_bar(canvas: &mut Canvas, [w, h]: [f32; 2], unit_per_pixel: f64, units: &str) {
    let size = text_size(w, h);
    bar(
        canvas,
        [w - 1.6 * size, h - 1.5 * size],
        f64::from(0.2 * w),
        unit_per_pixel,
        units,
        size,
    );
}

/// A scale bar that ends at `end`, not longer than `most` pixels, its label above it.
pub(super) fn bar(
    canvas: &mut Canvas,
    end: [f32; 2],
    most: f64,
    unit_per_pixel: f64,
    units: &str,
    size: f32,
) {
    // The largest round length that fits: the smallest not below a fifth, a half or all of it.
    let longest = most * unit_per_pixel;
    let fits = [1.0, 0.5, 0.4, 0.2]
        .map(|s| round_step(s * longest))
        .into_iter()
        .find(|&l| l <= longest * (1.0 + 1e-9));
    let Some(value) = fits else {
        return;
    };
    let pixels = single(value / unit_per_pixel);
    let labels = Labels::new(value, value);
    let start = [end[0] - pixels, end[1]];
    let pen = Pen::solid(0.12 * size, ink());
    let tick = 0.28 * size;
    canvas.line(start, end, pen);
    for x in [start[0], end[0]] {
        canvas.line([x, end[1] - tick], [x, end[1] + tick], pen);
    }
    let label = format!("{} {}", labels.text(value), labels.unit(units));
    text::draw(
        canvas,
        &label,
        size,
        [start[0] + 0.5 * pixels, end[1] - 0.5 * size],
        (Align::Middle, Run::Right),
        ink(),
    );
}

/// The directions of x, y and z at the lower left.
pub(super) fn axes(canvas: &mut Canvas, [w, h]: [f32; 2], camera: &Camera) {
    let size = text_size(w, h);
    let arm = f64::from(2.1 * size);
    let origin = [3.4 * size, h - 2.6 * size];
    let pen = Pen::solid(0.1 * size, ink());
    let axes = [(DVec3::X, "x"), (DVec3::Y, "y"), (DVec3::Z, "z")];
    for (axis, name) in axes {
        let flat = [
            single(axis.dot(camera.right) * arm),
            single(-axis.dot(camera.up) * arm),
        ];
        let long = flat[0].hypot(flat[1]);
        // Seen end on, an axis has no direction.
        if long < 0.35 * size {
            continue;
        }
        let unit = [flat[0] / long, flat[1] / long];
        let tip = [origin[0] + flat[0], origin[1] + flat[1]];
        canvas.line(origin, tip, pen);
        let head = 0.32 * size;
        for side in [-0.42, 0.42] {
            let back = [
                tip[0] - head * (unit[0] + side * unit[1]),
                tip[1] - head * (unit[1] - side * unit[0]),
            ];
            canvas.line(back, tip, pen);
        }
        let at = [
            tip[0] + 0.55 * size * unit[0],
            tip[1] + 0.55 * size * unit[1] + 0.26 * size,
        ];
        text::draw(
            canvas,
            name,
            0.9 * size,
            at,
            (Align::Middle, Run::Right),
            ink(),
        );
    }
}

/// Names and colours of the materials, where there are several.
pub(super) fn materials(scene: &Scene, field: &Field<'_>) -> Vec<(String, Linear)> {
    let ids = field.materials();
    if ids.len() < 2 {
        return Vec::new();
    }
    let name = |id: &u32| {
        let named = scene.model().materials.get(id);
        named.cloned().unwrap_or_else(|| format!("material {id}"))
    };
    let names = ids.iter().map(name);
    let colours = (0..).map(colour::material);
    names.zip(colours).collect()
}

/// The names of materials at the lower edge of a shaded picture.
pub(super) fn legend(canvas: &mut Canvas, [w, h]: [f32; 2], entries: &[(String, Linear)]) {
    let size = text_size(w, h);
    rows(canvas, legend_span(w, size), h - 1.5 * size, size, entries);
}

/// How long an entry of a legend is.
fn entry(name: &str, small: f32) -> f32 {
    2.0 * small + text::width(name, small)
}

/// The size of a legend's text.
fn legend_text(size: f32) -> f32 {
    0.82 * size
}

/// Entries in lines that are not longer than there is room.
fn wrapped(
    [from, to]: [f32; 2],
    size: f32,
    entries: &[(String, Linear)],
) -> Vec<&[(String, Linear)]> {
    let small = legend_text(size);
    let mut lines = Vec::new();
    let (mut start, mut total) = (0, 0.0);
    for (n, (name, _)) in entries.iter().enumerate() {
        let long = entry(name, small);
        if n > start && total + long > to - from {
            lines.push(&entries[start..n]);
            (start, total) = (n, 0.0);
        }
        total += long;
    }
    if start < entries.len() {
        lines.push(&entries[start..]);
    }
    // More would be taller than the picture they explain.
    lines.truncate(4);
    lines
}

/// How many lines a legend takes.
pub(super) fn lines(span: [f32; 2], size: f32, entries: &[(String, Linear)]) -> usize {
    wrapped(span, size, entries).len()
}

/// Swatches with names in centred lines between two places, the last at `baseline`.
pub(super) fn rows(
    canvas: &mut Canvas,
    span: [f32; 2],
    baseline: f32,
    size: f32,
    entries: &[(String, Linear)],
) {
    let small = legend_text(size);
    for (n, line) in wrapped(span, size, entries).iter().rev().enumerate() {
        let total: f32 = line.iter().map(|(name, _)| entry(name, small)).sum();
        let mut x = span[0] + 0.5 * (span[1] - span[0] - total + small);
        let y = baseline - 1.3 * size * single(length(n));
        for (name, fill) in *line {
            let side = 0.8 * small;
            canvas.rectangle([x, y - side], [x + side, y], *fill);
            let pen = Pen::solid(0.06 * size, ink());
            canvas.frame([x, y - side], [x + side, y], pen);
            let place = (Align::Start, Run::Right);
            text::draw(canvas, name, small, [x + 1.15 * small, y], place, ink());
            x += entry(name, small);
        }
    }
}
