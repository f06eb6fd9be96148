//! A section: the signed distance on a plane, drawn to scale.
//!
//! ```text
//!   +--------------------------------------------+
//!   | title                       isolines every |
//!   |   +---------------------------+  +-+       |
//!   | y |  distance as colour,      |  | |  d    |
//!   |   |  isolines, the border,    |  | |       |
//!   |   |  hatching inside, axes    |  | |       |
//!   |   +---------------------------+  +-+       |
//!   |               x              |---| 5 mm    |
//!   |            materials                       |
//!   +--------------------------------------------+
//! ```
//!
//! The distance φ is evaluated in f64 at the middle of every pixel. A line of the field at level c
//! is drawn where |φ - c| / |∇φ| is within half its width, with the gradient in the plane from
//! differences between pixels, so that lines are equally wide however the surface leans.

use super::annotate::{self, ink};
use super::canvas::{Canvas, Pen, Picture, length, single, whole};
use super::colour::{self, Linear, diverging, mix};
use super::error::PictureError;
use super::field::Field;
use super::render::{MAX_SIDE, check_size};
use super::shade::hatching;
use super::text::{self, Align, Run};
use super::ticks::{Labels, multiples, round_step};
use crate::error::Error;
use crate::sample::Cancel;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// The coordinate that is constant on a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlaneAxis {
    /// y to the right, z up.
    X,
    /// x to the right, z up.
    Y,
    /// x to the right, y up.
    Z,
}

impl PlaneAxis {
    /// Index of the coordinate.
    fn normal(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// Indices of the coordinates to the right and up.
    fn flat(self) -> [usize; 2] {
        match self {
            Self::X => [1, 2],
            Self::Y => [0, 2],
            Self::Z => [0, 1],
        }
    }

    /// `x`, `y` or `z`.
    #[must_use]
    pub fn name(self) -> char {
        ['x', 'y', 'z'][self.normal()]
    }
}

/// A plane normal to a coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    axis: PlaneAxis,
    value: f64,
}

impl Plane {
    /// The farthest plane, in scene units.
    const MOST: f64 = 1e90;

    /// The plane where a coordinate has a value in scene units.
    ///
    /// # Errors
    /// [`PictureError::Plane`] when the value is not finite or beyond 1e90.
    pub fn new(axis: PlaneAxis, value: f64) -> Result<Self, PictureError> {
        if value.abs() <= Self::MOST {
            Ok(Self { axis, value })
        } else {
            Err(PictureError::Plane {
                axis: axis.name(),
                found: value,
                most: Self::MOST,
            })
        }
    }

    /// The plane that a text as `z=0.5` names.
    ///
    /// # Errors
    /// [`PictureError::PlaneText`] when the text is not of that form, and as [`new`](Self::new).
    ///
    /// ```
    /// use voxlathe::picture::{Plane, PlaneAxis};
    /// assert_eq!(Plane::parse("z = 0.5")?, Plane::new(PlaneAxis::Z, 0.5)?);
    /// assert!(Plane::parse("w=1").is_err());
    /// # Ok::<(), voxlathe::picture::PictureError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, PictureError> {
        let wrong = || PictureError::PlaneText { found: text.into() };
        let (name, value) = text.split_once('=').ok_or_else(wrong)?;
        let axis = match name.trim() {
            "x" => PlaneAxis::X,
            "y" => PlaneAxis::Y,
            "z" => PlaneAxis::Z,
            _ => return Err(wrong()),
        };
        Self::new(axis, value.trim().parse().map_err(|_| wrong())?)
    }

    /// The coordinate that is constant.
    #[must_use]
    pub fn axis(&self) -> PlaneAxis {
        self.axis
    }

    /// Its value, in scene units.
    #[must_use]
    pub fn value(&self) -> f64 {
        self.value
    }
}

/// How a section is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionOptions {
    /// The plane.
    pub plane: Plane,
    /// Pixels along x, 1 to [`MAX_SIDE`]; without it what goes with the height, or with a solid
    /// drawn 900 pixels long.
    pub width: Option<usize>,
    /// Pixels along y, likewise.
    pub height: Option<usize>,
    /// Distance between isolines in scene units; a round one without it.
    pub isolines: Option<f64>,
    /// Whether there are a title, scales, a colour bar and names, where there is room.
    pub annotations: bool,
}

impl SectionOptions {
    /// The section by a plane, all else chosen by the solid.
    #[must_use]
    pub fn new(plane: Plane) -> Self {
        Self {
            plane,
            width: None,
            height: None,
            isolines: None,
            annotations: true,
        }
    }
}

/// Where things are in the picture, in pixels.
#[derive(Debug, Clone, Copy)]
struct Layout {
    size: [usize; 2],
    /// Columns and rows of the plot.
    low: [usize; 2],
    high: [usize; 2],
    text: f32,
    stroke: f32,
    annotated: bool,
}

/// The part of the plane that the plot shows.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Smallest coordinates, to the right and up.
    low: [f64; 2],
    /// Scene units for a pixel.
    pixel: f64,
    /// Pixels along both.
    size: [usize; 2],
}

impl Window {
    /// Coordinates of a place in the plot, in pixels from its upper left corner.
    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        [
            self.low[0] + x * self.pixel,
            self.low[1] + (length(self.size[1]) - y) * self.pixel,
        ]
    }

    fn high(&self) -> [f64; 2] {
        [0, 1].map(|a| self.low[a] + length(self.size[a]) * self.pixel)
    }
}

/// The distance, and the place of the material, at the middle of a pixel.
#[derive(Debug, Clone, Copy)]
struct Value {
    distance: f64,
    /// 0 outside.
    material: u32,
}

/// Draws the section of a scene's solid by a plane, to scale, with its distance field.
///
/// The bounds of the added solids fill the plot. Inside there is hatching in the colour of the
/// material; the distance is the colour by [`colour::diverging`], its ends at the largest distance
/// shown, with isolines at multiples of a step. `cancel` is asked between rows.
///
/// # Errors
/// [`PictureError::Side`], [`PictureError::Pixels`] and [`PictureError::Isolines`] when the picture
/// cannot be, [`Error::Interrupted`] when `cancel` says so.
pub fn section(
    scene: &Scene,
    options: &SectionOptions,
    cancel: Cancel<'_>,
) -> Result<Picture, Error> {
    if let Some(found) = options.isolines
        && !(found > 0.0 && found.is_finite())
    {
        let hint = String::new();
        return Err(PictureError::Isolines { found, hint }.into());
    }
    let field = Field::new(scene.assembly(), None);
    let layout = lay_out(scene, &field, options)?;
    let window = window(&field, options.plane, &layout);
    let values = values(&field, options.plane, &window, cancel)?;
    let reach = |sign: f64| {
        let of = |v: &Value| (sign * v.distance).max(0.0);
        values.iter().map(of).fold(0.0, f64::max)
    };
    let (deep, far) = (reach(-1.0), reach(1.0));
    let most = deep.max(far);
    // The distance to an empty solid has no bound.
    let measured = most > 0.0 && most < 1e100;
    let automatic = round_step(if measured { most / 12.0 } else { 1.0 });
    let step = options.isolines.unwrap_or(automatic);
    let lines = most / step;
    if measured && lines > 1000.0 {
        let hint = format!("; distances reach {most:.3e} here, and {automatic} is a good step");
        return Err(PictureError::Isolines { found: step, hint }.into());
    }
    let drawing = Drawing {
        field: &field,
        plane: options.plane,
        window,
        most: if measured { most } else { f64::INFINITY },
        step: if measured { step } else { f64::INFINITY },
        stroke: layout.stroke,
    };
    let mut canvas = Canvas::new(layout.size[0], layout.size[1], [1.0; 3]);
    drawing.fill(&mut canvas, &layout, &values, cancel)?;
    drawing.centre_lines(&mut canvas, &layout);
    if layout.annotated {
        drawing.scales(&mut canvas, &layout, scene);
        if measured {
            let units = scene.model().units.name();
            drawing.colour_bar(&mut canvas, &layout, [-deep, far], units);
        }
    }
    Ok(canvas.finish(false))
}

/// Sizes of the picture and of the plot in it.
fn lay_out(
    scene: &Scene,
    field: &Field<'_>,
    options: &SectionOptions,
) -> Result<Layout, PictureError> {
    /// Pixels of the longer side of the plot.
    const LONG: f64 = 900.0;
    let sides = options.plane.axis.flat().map(|a| field.bounds.sides()[a]);
    let longest = sides[0].max(sides[1]);
    let shape = sides.map(|s| (s / longest).clamp(0.45, 1.0) * LONG);
    let names = annotate::materials(scene, field);
    let default_text: f32 = 19.0;
    // The lines that the names take in the default size, where they have most of the width.
    let span = [0.0, single(shape[0]) + 9.0 * default_text];
    let rows = match annotate::lines(span, default_text, &names) {
        0 => 0.0,
        n => 0.7 + 1.3 * length(n),
    };
    // Left, top, right and bottom of the plot, in sizes of the text.
    let around = [5.6, 2.4, 8.6, 5.2 + rows];
    let wanted = options.annotations;
    let scaled = |text: f64| {
        if wanted {
            [
                (around[0] + around[2]) * text,
                (around[1] + around[3]) * text,
            ]
        } else {
            [0.0; 2]
        }
    };
    let default_text = f64::from(default_text);
    let extra = scaled(default_text);
    let natural = [shape[0] + extra[0], shape[1] + extra[1]];
    let pixels = |v: f64| whole(single(v.round().clamp(1.0, length(MAX_SIDE))));
    let size = match (options.width, options.height) {
        (Some(w), Some(h)) => [w, h],
        (Some(w), None) => [w, pixels(length(w) * natural[1] / natural[0])],
        (None, Some(h)) => [pixels(length(h) * natural[0] / natural[1]), h],
        (None, None) => natural.map(pixels),
    };
    check_size(size[0], size[1])?;
    let factor = (length(size[0]) / natural[0]).min(length(size[1]) / natural[1]);
    let text = (default_text * factor).max(11.0);
    let room = [around[0] + around[2] + 8.0, around[1] + around[3] + 6.0].map(|v| v * text);
    let annotated = wanted && length(size[0]) >= room[0] && length(size[1]) >= room[1];
    let margin = |n: f64| if annotated { pixels(n * text) } else { 0 };
    Ok(Layout {
        size,
        low: [margin(around[0]), margin(around[1])],
        high: [size[0] - margin(around[2]), size[1] - margin(around[3])],
        text: single(text),
        stroke: single(factor.max(0.6)),
        annotated,
    })
}

/// The window of the plot: the bounds with a margin, to scale.
fn window(field: &Field<'_>, plane: Plane, layout: &Layout) -> Window {
    let flat = plane.axis.flat();
    let size = [0, 1].map(|a| layout.high[a] - layout.low[a]);
    let sides = flat.map(|a| field.bounds.sides()[a]);
    let margin = 0.07 * sides[0].max(sides[1]);
    let pixel = [0, 1]
        .map(|a| (sides[a] + 2.0 * margin) / length(size[a]))
        .into_iter()
        .fold(0.0, f64::max);
    let low = [0, 1].map(|a| {
        let middle = 0.5 * (field.bounds.min[flat[a]] + field.bounds.max[flat[a]]);
        middle - 0.5 * length(size[a]) * pixel
    });
    Window { low, pixel, size }
}

/// The point of a plane with these coordinates to the right and up.
fn point(plane: Plane, [u, v]: [f64; 2]) -> DVec3 {
    let mut p = DVec3::splat(plane.value);
    let flat = plane.axis.flat();
    (p[flat[0]], p[flat[1]]) = (u, v);
    p
}

/// Values at the middles of the plot's pixels and of one pixel more on every side.
fn values(
    field: &Field<'_>,
    plane: Plane,
    window: &Window,
    cancel: Cancel<'_>,
) -> Result<Vec<Value>, Error> {
    let [wide, high] = window.size.map(|n| n + 2);
    let outside = Value {
        distance: f64::INFINITY,
        material: 0,
    };
    let mut values = vec![outside; wide * high];
    values
        .par_chunks_mut(wide)
        .enumerate()
        .try_for_each(|(j, row)| {
            if cancel() {
                return Err(Error::Interrupted);
            }
            let mut probe = field.probe(f64::INFINITY);
            for (i, value) in row.iter_mut().enumerate() {
                let p = point(plane, window.at(length(i) - 0.5, length(j) - 0.5));
                let distance = field.exact_distance(&mut probe, p);
                let material = if distance <= 0.0 {
                    1 + u32::try_from(field.material(p)).unwrap_or(0)
                } else {
                    0
                };
                *value = Value { distance, material };
            }
            Ok(())
        })?;
    Ok(values)
}

struct Drawing<'a> {
    field: &'a Field<'a>,
    plane: Plane,
    window: Window,
    /// The distance at the ends of the colours.
    most: f64,
    /// Distance between isolines.
    step: f64,
    stroke: f32,
}

impl Drawing<'_> {
    /// Draws what has a value at every pixel.
    fn fill(
        &self,
        canvas: &mut Canvas,
        layout: &Layout,
        values: &[Value],
        cancel: Cancel<'_>,
    ) -> Result<(), Error> {
        let [width, height] = self.window.size;
        let rows = (0..height)
            .into_par_iter()
            .map(|y| {
                if cancel() {
                    return Err(Error::Interrupted);
                }
                let colour = |x: usize| self.colour(values, x, y);
                Ok((0..width).map(colour).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>, Error>>()?;
        for (y, row) in rows.iter().enumerate() {
            canvas.row_mut(layout.low[1] + y)[layout.low[0]..layout.high[0]].copy_from_slice(row);
        }
        Ok(())
    }

    /// The colour of a pixel of the plot.
    fn colour(&self, values: &[Value], x: usize, y: usize) -> Linear {
        let wide = self.window.size[0] + 2;
        let at = |dx: usize, dy: usize| &values[(y + dy) * wide + x + dx];
        let own = at(1, 1);
        let d = own.distance;
        // The steeper of both sides: across a crease the mean would be too flat, and lines blots.
        let change = |a: &Value, b: &Value| (a.distance - d).abs().max((b.distance - d).abs());
        let per_pixel = change(at(0, 1), at(2, 1)).hypot(change(at(1, 0), at(1, 2)));
        let base = diverging(single(d / self.most));
        // Where the plane runs along the surface there are no lines to be drawn.
        let flat = !(per_pixel > 0.02 * self.window.pixel);
        let off = |level: f64| single((d - level).abs() / per_pixel);
        let line = |half: f32, off: f32| (half + 0.5 - off).clamp(0.0, 1.0).min(2.0 * half);
        let mut found = base;
        let inside = if flat {
            if d <= 0.0 { 1.0 } else { 0.0 }
        } else {
            (0.5 - single(d / per_pixel)).clamp(0.0, 1.0)
        };
        if inside > 0.0 {
            found = mix(base, self.hatched(base, values, x, y), inside);
        }
        if !flat && self.step.is_finite() {
            let n = (d / self.step).round();
            let apart = single(self.step / per_pixel);
            // Lines nearer than a few pixels would fill the plot.
            let share = ((apart - 3.0) / 3.0).clamp(0.0, 1.0);
            if n != 0.0 {
                let half = if n % 5.0 == 0.0 { 0.85 } else { 0.5 } * self.stroke;
                let strength = if n % 5.0 == 0.0 { 0.8 } else { 0.55 };
                let cover = share * strength * line(half, off(n * self.step));
                found = mix(found, ink(), cover);
            }
        }
        if !flat {
            found = mix(found, ink(), line(1.25 * self.stroke, off(0.0)));
        }
        found
    }

    /// The colour inside: hatching over a tint, and lines between materials.
    fn hatched(&self, base: Linear, values: &[Value], x: usize, y: usize) -> Linear {
        let wide = self.window.size[0] + 2;
        let own = &values[(y + 1) * wide + x + 1];
        let mut neighbours = (0..9).map(|n| &values[(y + n / 3) * wide + x + n % 3]);
        let borders = own.material != 0
            && neighbours
                .clone()
                .any(|v| v.material != 0 && v.material != own.material);
        // A pixel whose middle is outside takes the material next to it.
        let place = if own.material == 0 {
            neighbours
                .find(|v| v.material != 0)
                .map_or(1, |v| v.material)
        } else {
            own.material
        } as usize
            - 1;
        let colour = colour::material(place);
        let at = [length(x) + 0.5, length(self.window.size[1] - y) - 0.5];
        let line = hatching(at, place, f64::from(self.stroke));
        let tinted = mix(base, colour, 0.30);
        let mut found = mix(tinted, mix(colour, [0.0; 3], 0.30), 0.85 * line);
        if borders {
            found = mix(found, ink(), self.border(x, y));
        }
        found
    }

    /// How much of a pixel the line between two materials covers.
    fn border(&self, x: usize, y: usize) -> f32 {
        let p = point(self.plane, self.window.at(length(x) + 0.5, length(y) + 0.5));
        let limit = 4.0 * self.window.pixel;
        let distance = self
            .field
            .assembly
            .added()
            .map(|part| part.body().distance(p, part.contains(p), limit))
            .fold(limit, f64::min);
        let off = single(distance / self.window.pixel);
        (0.8 * self.stroke + 0.5 - off).clamp(0.0, 1.0)
    }

    /// A place of the plane in pixels of the picture.
    fn screen(&self, layout: &Layout, [u, v]: [f64; 2]) -> [f32; 2] {
        let w = &self.window;
        let x = (u - w.low[0]) / w.pixel;
        let y = length(w.size[1]) - (v - w.low[1]) / w.pixel;
        [
            single(length(layout.low[0]) + x),
            single(length(layout.low[1]) + y),
        ]
    }

    /// The axes of the solids: dash-dotted where they lie in the plane, a cross where they pierce it.
    fn centre_lines(&self, canvas: &mut Canvas, layout: &Layout) {
        let size = self.field.size;
        let normal = self.plane.axis.normal();
        let flat = self.plane.axis.flat();
        let unit = f32::max(self.stroke, 0.5);
        let dashes = [14.0, 4.0, 2.0, 4.0].map(|v| v * unit);
        let pen = Pen {
            dashes: &dashes,
            ..Pen::solid(1.3 * unit, ink())
        };
        let mut lines: Vec<CentreLine> = Vec::new();
        let parts = self.field.assembly.parts().iter();
        for part in parts.filter(|p| p.body().revolved().is_some()) {
            let frame = part.body().frame();
            let (origin, axis) = (frame.origin(), frame.axis(2));
            let bounds = part.bounds();
            let sides = bounds.sides();
            let at = flat.map(|a| origin[a]);
            let found = if axis[normal].abs() > 1.0 - 1e-9 {
                let value = self.plane.value;
                let room = 1e-9 * size;
                if value < bounds.min[normal] - room || value > bounds.max[normal] + room {
                    continue;
                }
                CentreLine {
                    at,
                    along: [0.0; 2],
                    span: [0.0; 2],
                }
            } else if axis[normal].abs() < 1e-6
                && (origin[normal] - self.plane.value).abs() < 1e-3 * size
            {
                // As far along the axis as the part's box, and a little farther.
                let middle = axis.dot(0.5 * (bounds.min + bounds.max) - origin);
                let half = 0.5 * axis.abs().dot(sides) + 0.03 * size;
                CentreLine {
                    at,
                    along: flat.map(|a| axis[a]),
                    span: [middle - half, middle + half],
                }
            } else {
                continue;
            };
            // Solids about one axis have one line.
            match lines.iter_mut().find(|l| l.is_on(&found, 1e-6 * size)) {
                Some(line) => line.join(&found),
                None => lines.push(found),
            }
        }
        for line in lines {
            if line.span[0] < line.span[1] {
                self.clipped(canvas, layout, line.span.map(|t| line.place(t)), pen);
            } else {
                self.centre_mark(canvas, layout, line.at, pen);
            }
        }
    }

    /// A cross where an axis pierces the plane.
    fn centre_mark(&self, canvas: &mut Canvas, layout: &Layout, at: [f64; 2], pen: Pen<'_>) {
        let arm = 13.0 * f64::from(f32::max(self.stroke, 0.5)) * self.window.pixel;
        let pen = Pen { dashes: &[], ..pen };
        for [du, dv] in [[arm, 0.0], [0.0, arm]] {
            let ends = [[at[0] - du, at[1] - dv], [at[0] + du, at[1] + dv]];
            self.clipped(canvas, layout, ends, pen);
        }
    }

    /// The part of a line that is in the plot.
    fn clipped(&self, canvas: &mut Canvas, layout: &Layout, ends: [[f64; 2]; 2], pen: Pen<'_>) {
        let (low, high) = (self.window.low, self.window.high());
        let way = [0, 1].map(|a| ends[1][a] - ends[0][a]);
        let mut span = [0.0_f64, 1.0];
        for a in 0..2 {
            if way[a] == 0.0 {
                if !(low[a]..=high[a]).contains(&ends[0][a]) {
                    return;
                }
                continue;
            }
            let (t, u) = (
                (low[a] - ends[0][a]) / way[a],
                (high[a] - ends[0][a]) / way[a],
            );
            span = [span[0].max(t.min(u)), span[1].min(t.max(u))];
        }
        if span[0] < span[1] {
            let place = |t: f64| [0, 1].map(|a| ends[0][a] + way[a] * t);
            let [from, to] = span.map(|t| self.screen(layout, place(t)));
            canvas.line(from, to, pen);
        }
    }

    /// The frame with its scales, the title, the scale bar and the names of materials.
    fn scales(&self, canvas: &mut Canvas, layout: &Layout, scene: &Scene) {
        let units = scene.model().units.name();
        let size = layout.text;
        let (low, high) = (corner(layout.low), corner(layout.high));
        let pen = Pen::solid(f32::max(1.3 * self.stroke, 1.0), ink());
        canvas.frame(low, high, pen);
        let small = 0.88 * size;
        let names = self.plane.axis.flat().map(|a| ['x', 'y', 'z'][a]);
        let (from, to) = (self.window.low, self.window.high());
        for a in 0..2 {
            let shown = (to[a] - from[a]) / length(self.window.size[a]);
            // A label for every five sizes of the text.
            let step = round_step(shown * f64::from(if a == 0 { 5.5 } else { 4.0 } * size));
            let labels = Labels::new(from[a].abs().max(to[a].abs()), step);
            let mut widest: f32 = 0.0;
            for value in multiples(from[a], to[a], step) {
                let at = self.screen(layout, [[value, from[1]], [from[0], value]][a]);
                let label = labels.text(value);
                widest = widest.max(text::width(&label, small));
                if a == 0 {
                    canvas.line([at[0], high[1]], [at[0], high[1] + 0.35 * size], pen);
                    let below = [at[0], high[1] + 0.6 * size + text::cap_height(small)];
                    let place = (Align::Middle, Run::Right);
                    text::draw(canvas, &label, small, below, place, ink());
                } else {
                    canvas.line([low[0] - 0.35 * size, at[1]], [low[0], at[1]], pen);
                    let beside = [low[0] - 0.55 * size, at[1] + 0.5 * text::cap_height(small)];
                    let place = (Align::End, Run::Right);
                    text::draw(canvas, &label, small, beside, place, ink());
                }
            }
            let name = format!("{} / {}", names[a], labels.unit(units));
            let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
            let (at, run) = if a == 0 {
                ([middle[0], high[1] + 2.9 * size], Run::Right)
            } else {
                let beside = low[0] - 1.25 * size - widest;
                (
                    [beside.max(text::cap_height(size) + 2.0), middle[1]],
                    Run::Up,
                )
            };
            text::draw(canvas, &name, size, at, (Align::Middle, run), ink());
        }
        let value = number(self.plane.value);
        let title = format!(
            "{}, {} = {value} {}",
            scene.name(),
            self.plane.axis.name(),
            unit(units)
        );
        let line = low[1] - 0.75 * size;
        let room = high[0] - low[0];
        let note = if self.step.is_finite() {
            format!("isolines every {} {}", number(self.step), unit(units))
        } else {
            String::new()
        };
        let note_width = text::width(&note, small);
        let fitting = (room - note_width - size) / text::width(&title, size);
        let title_size = size * fitting.clamp(0.0, 1.0);
        if title_size > 0.6 * size {
            let place = (Align::Start, Run::Right);
            text::draw(canvas, &title, title_size, [low[0], line], place, ink());
        }
        let place = (Align::End, Run::Right);
        text::draw(canvas, &note, small, [high[0], line], place, ink());
        // Under the numbers of the scale, so that nothing of the section is hidden.
        annotate::bar(
            canvas,
            [high[0] - 0.2 * size, high[1] + 4.2 * size],
            f64::from(0.22 * room),
            self.window.pixel,
            units,
            small,
        );
        let entries = annotate::materials(scene, self.field);
        let bottom = single(length(layout.size[1])) - 0.9 * size;
        let across = [low[0] - 3.0 * size, high[0] + 6.0 * size];
        annotate::rows(canvas, across, bottom, size, &entries);
    }

    /// The colours of the distances from `range[0]` to `range[1]`, with a scale.
    fn colour_bar(&self, canvas: &mut Canvas, layout: &Layout, range: [f64; 2], units: &str) {
        let size = layout.text;
        let small = 0.88 * size;
        let (low, high) = (corner(layout.low), corner(layout.high));
        let left = high[0] + 1.3 * size;
        let right = left + 1.25 * size;
        let rows = layout.high[1] - layout.low[1];
        let value = |y: f64| range[1] + (range[0] - range[1]) * y / length(rows);
        let place = |v: f64| {
            let share = (v - range[1]) / (range[0] - range[1]);
            low[1] + single(share) * (high[1] - low[1])
        };
        for y in 0..rows {
            let top = low[1] + single(length(y));
            let colour = diverging(single(value(length(y) + 0.5) / self.most));
            canvas.rectangle([left, top], [right, top + 1.0], colour);
        }
        let per_pixel = (range[1] - range[0]) / length(rows);
        let thin = f32::max(0.9 * self.stroke, 0.7);
        if self.step > 4.0 * per_pixel {
            for v in multiples(range[0], range[1], self.step) {
                let (y, main) = (place(v), v.abs() < 0.5 * self.step);
                let width = if main { 2.5 * self.stroke } else { thin };
                canvas.line([left, y], [right, y], Pen::solid(width, ink()));
            }
        }
        let pen = Pen::solid(f32::max(1.3 * self.stroke, 1.0), ink());
        canvas.frame([left, low[1]], [right, high[1]], pen);
        let step = round_step(per_pixel * f64::from(2.6 * size));
        // A multiple of the isolines' step, where the two are near.
        let step = if (self.step..=5.0 * self.step).contains(&(step * 1.000_001)) {
            (step / self.step).round().max(1.0) * self.step
        } else {
            step
        };
        let labels = Labels::new(self.most, step);
        let mut widest: f32 = 0.0;
        for v in multiples(range[0], range[1], step) {
            let y = place(v);
            canvas.line([right, y], [right + 0.35 * size, y], pen);
            let label = labels.text(v);
            widest = widest.max(text::width(&label, small));
            let at = [right + 0.55 * size, y + 0.5 * text::cap_height(small)];
            let start = (Align::Start, Run::Right);
            text::draw(canvas, &label, small, at, start, ink());
        }
        let name = format!("signed distance / {}", labels.unit(units));
        let x = right + 0.55 * size + widest + 1.25 * size;
        let middle = 0.5 * (low[1] + high[1]);
        let up = (Align::Middle, Run::Up);
        text::draw(canvas, &name, size, [x, middle], up, ink());
    }
}

/// An axis in the plane, or the point where it pierces the plane.
#[derive(Debug, Clone, Copy)]
struct CentreLine {
    at: [f64; 2],
    /// A unit vector; zero for a point.
    along: [f64; 2],
    span: [f64; 2],
}

impl CentreLine {
    fn place(&self, t: f64) -> [f64; 2] {
        [0, 1].map(|a| self.at[a] + self.along[a] * t)
    }

    /// Whether the other is on the same straight line, or the same point.
    fn is_on(&self, other: &Self, near: f64) -> bool {
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let off = [0, 1].map(|a| other.at[a] - self.at[a]);
        if self.along == [0.0; 2] || other.along == [0.0; 2] {
            return self.along == other.along && off[0].hypot(off[1]) < near;
        }
        cross(self.along, other.along).abs() < 1e-9 && cross(self.along, off).abs() < near
    }

    /// Grows by the other's span.
    fn join(&mut self, other: &Self) {
        for t in other.span {
            let end = other.place(t);
            let t = (0..2)
                .map(|a| (end[a] - self.at[a]) * self.along[a])
                .sum::<f64>();
            self.span = [self.span[0].min(t), self.span[1].max(t)];
        }
    }
}

fn corner(pixels: [usize; 2]) -> [f32; 2] {
    pixels.map(|n| single(length(n)))
}

/// A number as it was given, with a true minus sign.
pub(super) fn number(v: f64) -> String {
    // Six digits are as many as a title needs.
    let short: f64 = format!("{v:.5e}").parse().unwrap_or(v);
    let plain = if short != 0.0 && !(1e-4..1e6).contains(&short.abs()) {
        format!("{short:e}")
    } else {
        format!("{}", short + 0.0)
    };
    plain.replace('-', "\u{2212}")
}

/// The label of a unit as it is printed.
pub(super) fn unit(units: &str) -> &str {
    super::ticks::units_label(units)
}
