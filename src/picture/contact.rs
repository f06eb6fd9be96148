//! A contact sheet: slices of a grid side by side.

use super::annotate::ink;
use super::canvas::{Canvas, Pen, Picture, length, single};
use super::colour::{self, Linear, diverging, mix};
use super::field::Field;
use super::section::{number, unit};
use super::text::{self, Align, Run};
use crate::error::Error;
use crate::grid::GridSpec;
use crate::sample::Cancel;
use crate::scene::Scene;
use rayon::prelude::*;

/// Slices in a row, and rows.
const SIDE: usize = 3;
/// Pixels of the longer side of a slice.
const LONG: usize = 320;
/// Size of the text.
const TEXT: f32 = 15.0;

/// Pictures nine z layers of a grid, evenly spaced, or all where there are fewer.
///
/// A voxel is as the stack has it: the colour of its material where its centre is inside, else
/// that of its centre's distance. Of voxels finer than pixels some are shown. +y is up, unlike in
/// the stack's files.
///
/// # Errors
/// [`Error::Interrupted`] when `cancel` says so.
pub fn contact_sheet(scene: &Scene, grid: &GridSpec, cancel: Cancel<'_>) -> Result<Picture, Error> {
    let field = Field::new(scene.assembly(), None);
    let [nx, ny, nz] = grid.dims();
    let shown = nz.min(SIDE * SIDE);
    // The middle of each of so many equal parts.
    let layers: Vec<usize> = (0..shown).map(|n| (2 * n + 1) * nz / (2 * shown)).collect();
    let spacing = grid.spacing();
    let sides = [length(nx) * spacing.x, length(ny) * spacing.y];
    let scale = length(LONG) / sides[0].max(sides[1]);
    let size = sides.map(|s| super::canvas::whole(single((s * scale).round().max(1.0))));
    let columns = shown.min(SIDE);
    let rows = shown.div_ceil(SIDE);
    let (gap, label) = (14, 26);
    // Labels are as wide as they are, however slim the slices.
    let cell = [size[0].max(190) + gap, size[1] + label + gap];
    let total = [columns * cell[0] + gap, rows * cell[1] + gap];
    let mut canvas = Canvas::new(total[0], total[1], [1.0; 3]);
    let most = 0.5 * sides[0].hypot(sides[1]);
    let slices = layers
        .par_iter()
        .map(|&k| slice(&field, grid, k, size, most, cancel))
        .collect::<Result<Vec<_>, Error>>()?;
    for (n, (pixels, &k)) in slices.iter().zip(&layers).enumerate() {
        let left = gap + n % SIDE * cell[0] + (cell[0] - gap - size[0]) / 2;
        let top = gap + n / SIDE * cell[1];
        for (y, row) in pixels.chunks(size[0]).enumerate() {
            canvas.row_mut(top + y)[left..left + size[0]].copy_from_slice(row);
        }
        let low = [left, top].map(|v| single(length(v)));
        let high = [left + size[0], top + size[1]].map(|v| single(length(v)));
        canvas.frame(low, high, Pen::solid(1.0, mix(ink(), [1.0; 3], 0.3)));
        let units = unit(scene.model().units.name());
        let name = format!("k = {k},  z = {} {units}", number(grid.centre_along(2, k)));
        let at = [0.5 * (low[0] + high[0]), high[1] + 18.0];
        let place = (Align::Middle, Run::Right);
        text::draw(&mut canvas, &name, TEXT, at, place, ink());
    }
    Ok(canvas.finish(false))
}

/// The pixels of one layer, row by row from the largest y.
fn slice(
    field: &Field<'_>,
    grid: &GridSpec,
    k: usize,
    size: [usize; 2],
    most: f64,
    cancel: Cancel<'_>,
) -> Result<Vec<Linear>, Error> {
    let [nx, ny, _] = grid.dims();
    // Where pixels are coarser than voxels, four voxels of each pixel are looked at.
    let fine = 1 + usize::from(nx > size[0] || ny > size[1]);
    let voxel = |p: usize, pixels: usize, n: usize| (2 * p + 1) * n / (2 * pixels * fine);
    let mut probe = field.probe(f64::INFINITY);
    let mut colour = |i: usize, j: usize| {
        let p = grid.centre(i, j, k);
        let distance = field.exact_distance(&mut probe, p);
        if distance <= 0.0 {
            colour::material(field.material(p))
        } else {
            diverging(single(distance / most))
        }
    };
    let mut pixels = vec![[0.0; 3]; size[0] * size[1]];
    let mut last_row = usize::MAX;
    for y in 0..size[1] {
        if cancel() {
            return Err(Error::Interrupted);
        }
        let row_of = |sub: usize| voxel((size[1] - 1 - y) * fine + sub, size[1], ny);
        // Rows of the same voxels are the same.
        if fine == 1 && row_of(0) == last_row {
            pixels.copy_within((y - 1) * size[0]..y * size[0], y * size[0]);
            continue;
        }
        last_row = row_of(0);
        let mut known: Option<(usize, Linear)> = None;
        for x in 0..size[0] {
            let mut sum = [0.0; 3];
            for sub in 0..fine * fine {
                let i = voxel(x * fine + sub % fine, size[0], nx);
                let j = row_of(sub / fine);
                let found = match known {
                    Some((at, c)) if fine == 1 && at == i => c,
                    _ => colour(i, j),
                };
                known = Some((i, found));
                for c in 0..3 {
                    sum[c] += found[c];
                }
            }
            let share = single(length(fine * fine));
            pixels[y * size[0] + x] = sum.map(|v| v / share);
        }
    }
    Ok(pixels)
}
