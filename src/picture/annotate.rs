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

/// The height at the bottom of a picture that is kept for what is written, in pixels.
pub(super) fn band(width: usize, height: usize) -> f64 {
    let size = [width, height].map(|n| single(length(n)));
    f64::from(3.0 * text_size(size[0], size[1]))
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

/// The materials in a row in the middle of the lower edge, as many as there is room for.
pub(super) fn legend(canvas: &mut Canvas, [w, h]: [f32; 2], entries: &[(String, Linear)]) {
    let size = text_size(w, h);
    row(
        canvas,
        [7.5 * size, 0.72 * w],
        h - 1.5 * size,
        size,
        entries,
    );
}

/// A row of swatches with names, centred between two places.
pub(super) fn row(
    canvas: &mut Canvas,
    [from, to]: [f32; 2],
    baseline: f32,
    size: f32,
    entries: &[(String, Linear)],
) {
    let small = 0.82 * size;
    let each = |name: &str| 1.9 * small + text::width(name, small);
    let mut shown = 0;
    let mut total = 0.0;
    for (name, _) in entries {
        if total + each(name) > to - from {
            break;
        }
        total += each(name);
        shown += 1;
    }
    let mut x = from + 0.5 * (to - from - total);
    for (name, fill) in &entries[..shown] {
        let side = 0.8 * small;
        let low = [x, baseline - side];
        canvas.rectangle(low, [x + side, baseline], *fill);
        canvas.frame(low, [x + side, baseline], Pen::solid(0.06 * size, ink()));
        let place = (Align::Start, Run::Right);
        text::draw(
            canvas,
            name,
            small,
            [x + 1.15 * small, baseline],
            place,
            ink(),
        );
        x += each(name);
    }
}
