//! A shaded picture of a scene's solid.
//!
//! The picture is made of tiles that do not depend on each other, so any number of threads gives
//! the same bytes. In a tile every pixel has one ray through its middle; where neighbours differ
//! in what they meet, or a ray passes the solid within a pixel, sixteen rays more decide.

use super::annotate;
use super::camera::{Camera, View};
use super::canvas::{Canvas, Picture, length, single};
use super::colour::{self, Linear, mix};
use super::error::PictureError;
use super::field::{Cut, CutAway, Field};
use super::lines::{self, Sight};
use super::shade::{Lights, Lit, Probes, face_colour};
use super::trace::{Meets, Ray, clear, trace};
use crate::error::Error;
use crate::sample::Cancel;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// The longest side of a picture, in pixels.
pub const MAX_SIDE: usize = 16384;
/// The most pixels of a picture: thirteen bytes each are held.
pub const MAX_PIXELS: usize = 1 << 26;
/// The most parameter lines between two knots.
pub const MAX_LINES: usize = 256;

/// Pixels along a side of a tile.
const TILE: usize = 32;
/// Pixels along a side of the blocks that share the start of their rays.
const BLOCK: usize = 8;
/// Rays for a pixel at an edge.
const RAYS: usize = 16;
/// Cells along the longer side of the coarse picture that finds where the solid is seen.
const CELLS: f64 = 128.0;

/// How a solid is pictured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// Pixels along x, 1 to [`MAX_SIDE`].
    pub width: usize,
    /// Pixels along y, 1 to [`MAX_SIDE`].
    pub height: usize,
    /// Where it is seen from.
    pub view: View,
    /// What is cut away.
    pub cut: Option<Cut>,
    /// Whether a scale bar, the axes and the names of materials are drawn, where there is room.
    pub annotations: bool,
    /// Parameter lines between each two knots of a parameter, on the outer faces of solids that are
    /// trivariate NURBS, 0 to [`MAX_LINES`].
    ///
    /// The lines at the knots themselves are a little stronger; with 0 there are neither. Parts that
    /// are hidden, cut away or no longer on the surface are not drawn, nor are lines that would be
    /// nearer than four pixels to each other (of a picture of 1200 by 900). Other solids have none.
    pub lines: usize,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            width: 1200,
            height: 900,
            view: View::default(),
            cut: None,
            annotations: true,
            lines: 4,
        }
    }
}

/// Refuses sizes that no picture can have.
pub(super) fn check_size(width: usize, height: usize) -> Result<(), PictureError> {
    for (side, found) in [("width", width), ("height", height)] {
        if !(1..=MAX_SIDE).contains(&found) {
            return Err(PictureError::Side {
                side,
                found,
                most: MAX_SIDE,
            });
        }
    }
    if width * height > MAX_PIXELS {
        return Err(PictureError::Pixels {
            width,
            height,
            most: MAX_PIXELS,
        });
    }
    Ok(())
}

/// Pictures a scene's solid on a light floor, which is left out where it would be seen from below.
///
/// The projection is orthographic and the solid fills the picture; of an empty solid there is only
/// the background. `cancel` is asked between tiles.
///
/// # Errors
/// [`PictureError::Side`] and [`PictureError::Pixels`] when the size cannot be,
/// [`PictureError::Lines`] when there would be more than [`MAX_LINES`] lines between two knots,
/// [`Error::Interrupted`] when `cancel` says so.
///
/// ```
/// use voxlathe::picture::{RenderOptions, render};
/// let scene = voxlathe::Scene::parse(r#"
///     schema = 1
///     [profiles.ring]
///     curves = [{ kind = "circle", center = [1, 0], radius = 0.25 }]
///     [[solid]]
///     kind = "revolve"
///     profile = "ring"
/// "#)?;
/// let small = RenderOptions { width: 64, height: 48, ..RenderOptions::default() };
/// let picture = render(&scene, &small, &|| false)?;
/// // The background is in the corner, the tube of the ring at the left.
/// assert_eq!(picture.pixel(0, 0), [247, 247, 248]);
/// assert!(picture.pixel(10, 24)[0] < 200);
/// # Ok::<(), voxlathe::Error>(())
/// ```
pub fn render(
    scene: &Scene,
    options: &RenderOptions,
    cancel: Cancel<'_>,
) -> Result<Picture, Error> {
    check_size(options.width, options.height)?;
    if options.lines > MAX_LINES {
        return Err(Error::from(PictureError::Lines {
            found: options.lines,
            most: MAX_LINES,
        }));
    }
    let (width, height) = (options.width, options.height);
    let assembly = scene.assembly();
    let cut = options.cut.map(|c| CutAway::new(c, assembly, options.view));
    let field = Field::new(assembly, cut);
    let floor = (options.view.elevation() > 1.0).then_some(assembly.bounds().min.z);
    let stroke = annotate::stroke(width, height);
    let camera = frame(scene, &field, options, cancel)?;
    let painter = Painter {
        field: &field,
        camera,
        lights: Lights::new(options.view, floor),
        stroke,
    };
    let columns = width.div_ceil(TILE);
    let tiles = (0..columns * height.div_ceil(TILE))
        .into_par_iter()
        .map_init(
            || Probes::new(&field),
            |probes, n| {
                if cancel() {
                    return Err(Error::Interrupted);
                }
                let corner = [n % columns * TILE, n / columns * TILE];
                let size = [TILE.min(width - corner[0]), TILE.min(height - corner[1])];
                Ok((corner, size, painter.tile(probes, corner, size)))
            },
        )
        .collect::<Result<Vec<_>, Error>>()?;
    let mut canvas = Canvas::new(width, height, colour::linear(colour::BACKGROUND));
    for (corner, size, pixels) in tiles {
        for (j, row) in pixels.chunks(size[0]).enumerate() {
            canvas.row_mut(corner[1] + j)[corner[0]..corner[0] + size[0]].copy_from_slice(row);
        }
    }
    if options.lines > 0 {
        let sight = Sight {
            field: &field,
            camera,
            stroke,
        };
        lines::draw(&mut canvas, [width, height], sight, options.lines, cancel)?;
    }
    if options.annotations && annotate::has_room(width, height) {
        let size = [single(length(width)), single(length(height))];
        annotate::axes(&mut canvas, size, &camera);
        annotate::scale_bar(
            &mut canvas,
            size,
            camera.scale(),
            scene.model().units.name(),
        );
        annotate::legend(&mut canvas, size, &annotate::materials(scene, &field));
    }
    Ok(canvas.finish(true))
}

/// The camera that shows all of the solid, with room around it.
fn frame(
    scene: &Scene,
    field: &Field<'_>,
    options: &RenderOptions,
    cancel: Cancel<'_>,
) -> Result<Camera, Error> {
    let size = [length(options.width), length(options.height)];
    let (coarse, [low, high]) = seen_cells(field, options.view, cancel)?;
    let written = options.annotations && annotate::has_room(options.width, options.height);
    let below = if written {
        let size = size.map(single);
        annotate::band(size, &annotate::materials(scene, field))
    } else {
        0.0
    };
    let room = [0.88 * size[0], (0.90 * size[1] - below).max(0.5 * size[1])];
    let camera = coarse.resized(size);
    let shift = |p: [f64; 2]| {
        // From cells to the pixels of the picture that shows the whole square.
        let factor = coarse.scale() / camera.scale();
        [0, 1].map(|a| 0.5 * size[a] + (p[a] - 0.5 * CELLS) * factor)
    };
    Ok(camera
        .framed(shift(low), shift(high), room)
        .lowered(0.4 * below))
}

/// The part of a view that shows the solid: its middle, a point in space, and its width and height in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub(crate) middle: DVec3,
    pub(crate) extent: [f64; 2],
}

/// What a picture shows of a scene's solid before it is given room around it. A picture without annotations is
/// 0.88 of its width or 0.90 of its height as large, whichever is less.
///
/// # Errors
/// [`Error::Interrupted`] when `cancel` says so.
pub(crate) fn seen(scene: &Scene, view: View, cancel: Cancel<'_>) -> Result<Seen, Error> {
    let field = Field::new(scene.assembly(), None);
    let (coarse, [low, high]) = seen_cells(&field, view, cancel)?;
    let middle = coarse.point(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]));
    let extent = [0, 1].map(|a| (high[a] - low[a]) * coarse.scale());
    Ok(Seen { middle, extent })
}

/// A camera of few cells, and the box of those in which the solid is seen.
fn seen_cells(
    field: &Field<'_>,
    view: View,
    cancel: Cancel<'_>,
) -> Result<(Camera, [[f64; 2]; 2]), Error> {
    let middle = 0.5 * (field.bounds.min + field.bounds.max);
    // A square around the box from any side.
    let coarse = Camera::new(view, middle, field.size / CELLS, [CELLS; 2]);
    let back = field.size * 2.0;
    let radius = std::f64::consts::FRAC_1_SQRT_2 * coarse.scale();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small whole number"
    )]
    let cells = CELLS as usize;
    let rows = (0..cells)
        .into_par_iter()
        .map_init(
            || field.probe(f64::INFINITY),
            |probe, j| {
                if cancel() {
                    return Err(Error::Interrupted);
                }
                let hit = |i: &usize| {
                    let ray = Ray {
                        origin: coarse.point(length(*i) + 0.5, length(j) + 0.5)
                            - coarse.forward * back,
                        direction: coarse.forward,
                    };
                    clear(field, probe, ray, 0.0, radius).is_some()
                };
                let hits: Vec<usize> = (0..cells).filter(hit).collect();
                Ok((hits.first().copied(), hits.last().copied()))
            },
        )
        .collect::<Result<Vec<_>, Error>>()?;
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (j, row) in rows.iter().enumerate() {
        if let (Some(first), Some(last)) = row {
            low = [low[0].min(length(*first)), low[1].min(length(j))];
            high = [high[0].max(length(last + 1)), high[1].max(length(j + 1))];
        }
    }
    if low[0] > high[0] {
        (low, high) = ([0.0; 2], [CELLS; 2]);
    }
    Ok((coarse, [low, high]))
}

/// What a ray saw.
#[derive(Debug, Clone, Copy)]
struct Sample {
    kind: Kind,
    point: DVec3,
    normal: DVec3,
    /// Distance along the ray.
    t: f64,
    /// The light there, once it is known.
    lit: Option<Lit>,
    /// Whether one ray cannot tell what the pixel shows.
    thin: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Background,
    Floor,
    /// The surface of a material, by its place.
    Surface(usize),
    /// A face of the cut, its material and its colour.
    Section(usize, Linear),
}

impl Kind {
    fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::Section(a, _), Self::Section(b, _)) => a == b,
            _ => self == other,
        }
    }
}

struct Painter<'a> {
    field: &'a Field<'a>,
    camera: Camera,
    lights: Lights,
    stroke: f64,
}

impl Painter<'_> {
    fn ray(&self, x: f64, y: f64) -> Ray {
        Ray {
            origin: self.camera.point(x, y) - self.camera.forward * (4.0 * self.field.size),
            direction: self.camera.forward,
        }
    }

    /// Where rays through a box of pixels, grown by one, may start; infinity where they meet nothing.
    fn start(&self, probes: &mut Probes, low: [usize; 2], size: [usize; 2], from: f64) -> f64 {
        let half = [0, 1].map(|a| 0.5 * length(size[a]) + 1.0);
        let middle = [0, 1].map(|a| length(low[a]) + 0.5 * length(size[a]));
        let radius = half[0].hypot(half[1]) * self.camera.scale();
        let ray = self.ray(middle[0], middle[1]);
        clear(self.field, &mut probes.far, ray, from, radius).unwrap_or(f64::INFINITY)
    }

    /// The colours of a tile, row by row.
    fn tile(&self, probes: &mut Probes, corner: [usize; 2], size: [usize; 2]) -> Vec<Linear> {
        let from = self.start(probes, corner, size, 0.0);
        let blocks = size.map(|s| s.div_ceil(BLOCK));
        let mut starts = Vec::with_capacity(blocks[0] * blocks[1]);
        for j in 0..blocks[1] {
            for i in 0..blocks[0] {
                let low = [corner[0] + i * BLOCK, corner[1] + j * BLOCK];
                starts.push(if from < f64::INFINITY {
                    self.start(probes, low, [BLOCK; 2], from)
                } else {
                    from
                });
            }
        }
        let block = |x: usize, y: usize| starts[(y / BLOCK) * blocks[0] + x / BLOCK];
        // One pixel more on every side, so that edges between tiles are seen from both.
        let (wide, high) = (size[0] + 2, size[1] + 2);
        let mut samples = Vec::with_capacity(wide * high);
        for y in 0..high {
            for x in 0..wide {
                let at = [length(corner[0] + x) - 0.5, length(corner[1] + y) - 0.5];
                let inner = |v: usize, n: usize| v.clamp(1, n) - 1;
                let from = block(inner(x, size[0]), inner(y, size[1]));
                samples.push(self.look(probes, at, from));
            }
        }
        self.light(probes, &mut samples, wide);
        let mut colours = Vec::with_capacity(size[0] * size[1]);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let around = |dx: usize, dy: usize| &samples[(y + dy) * wide + x + dx];
                let own = around(1, 1);
                let sides = [around(0, 1), around(2, 1), around(1, 0), around(1, 2)];
                colours.push(if own.thin || sides.iter().any(|s| self.is_edge(own, s)) {
                    let near: Vec<&Sample> = (0..9).map(|n| around(n % 3, n / 3)).collect();
                    let at = [length(corner[0] + x), length(corner[1] + y)];
                    self.fine(probes, at, block(x, y), &near)
                } else {
                    self.colour(own, own.lit.unwrap_or_default())
                });
            }
        }
        colours
    }

    /// Finds the light of a tile's samples: that of every second one in both directions, and of
    /// others where the ones between which they lie are not of the same surface.
    fn light(&self, probes: &mut Probes, samples: &mut [Sample], wide: usize) {
        let high = samples.len() / wide;
        // Tiles start at even pixels, so the first row and column are odd.
        let known = |v: usize| v % 2 == 1;
        for y in (1..high).step_by(2) {
            for x in (1..wide).step_by(2) {
                let own = samples[y * wide + x];
                samples[y * wide + x].lit = Some(self.lit(probes, &own, &[]));
            }
        }
        for y in 0..high {
            for x in 0..wide {
                if known(x) && known(y) {
                    continue;
                }
                let own = samples[y * wide + x];
                let span = |v: usize, n: usize| {
                    if known(v) {
                        v..=v
                    } else {
                        v.saturating_sub(1)..=(v + 1).min(n - 1)
                    }
                };
                let (mut sum, mut count, mut all) = (Lit::default(), 0.0_f32, true);
                for j in span(y, high) {
                    for i in span(x, wide) {
                        if !(known(i) && known(j)) {
                            continue;
                        }
                        let other = &samples[j * wide + i];
                        all &= self.is_alike(&own, other);
                        let lit = other.lit.unwrap_or_default();
                        sum.key += lit.key;
                        sum.ambient += lit.ambient;
                        count += 1.0;
                    }
                }
                samples[y * wide + x].lit = Some(if all && count > 0.0 {
                    Lit {
                        key: sum.key / count,
                        ambient: sum.ambient / count,
                    }
                } else {
                    self.lit(probes, &own, &[])
                });
            }
        }
    }

    /// Whether two samples are near each other on one surface, so that light changes little.
    fn is_alike(&self, a: &Sample, b: &Sample) -> bool {
        a.kind.is_like(b.kind)
            && a.normal.dot(b.normal) > 0.9
            && (a.point - b.point).length() < 24.0 * self.camera.scale()
    }

    /// Whether an edge passes between two neighbours.
    fn is_edge(&self, a: &Sample, b: &Sample) -> bool {
        if !a.kind.is_like(b.kind) {
            return true;
        }
        if !matches!(a.kind, Kind::Surface(_) | Kind::Section(..)) {
            return false;
        }
        // Of one surface, the depth changes by its slope.
        let slope = a.normal.dot(self.camera.forward).abs().max(0.05);
        a.normal.dot(b.normal) < 0.96 || (a.t - b.t).abs() > 4.0 * self.camera.scale() / slope
    }

    /// The mean colour of a pixel by many rays.
    fn fine(&self, probes: &mut Probes, at: [f64; 2], from: f64, near: &[&Sample]) -> Linear {
        /// The plastic number's first two powers: a lattice with no two points in line.
        const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        let mut sum = [0.0; 3];
        for n in 0..RAYS {
            let place = [0, 1].map(|a| at[a] + (0.5 + STEP[a] * length(n)).fract());
            let found = self.look(probes, place, from);
            let lit = self.lit(probes, &found, near);
            let colour = self.colour(&found, lit);
            for c in 0..3 {
                sum[c] += colour[c];
            }
        }
        sum.map(|v| v / single(length(RAYS)))
    }

    /// What a ray sees.
    fn look(&self, probes: &mut Probes, [x, y]: [f64; 2], from: f64) -> Sample {
        let ray = self.ray(x, y);
        let pixel = self.camera.scale();
        let meets = if from < f64::INFINITY {
            trace(self.field, &mut probes.far, ray, from, pixel)
        } else {
            Meets::Nothing(f64::INFINITY)
        };
        match meets {
            Meets::Surface(t) => {
                let point = ray.at(t);
                let normal = self.field.normal(&mut probes.far, point);
                Sample {
                    kind: Kind::Surface(self.place(point, normal)),
                    point,
                    normal,
                    t,
                    lit: None,
                    thin: false,
                }
            }
            Meets::Section(t, normal) => self.face(probes, [x, y], ray.at(t), (t, normal)),
            Meets::Nothing(nearest) => self.behind(ray, nearest < pixel),
        }
    }

    /// A face of the cut.
    fn face(
        &self,
        probes: &mut Probes,
        at: [f64; 2],
        point: DVec3,
        (t, normal): (f64, DVec3),
    ) -> Sample {
        let pixel = self.camera.scale();
        let depth = -self.field.distance(&mut probes.far, point);
        // How far it is to the border in the face, where the surface leans.
        let reach = 4.0 * self.stroke * pixel;
        let off = if depth < reach {
            let leans = self.field.normal(&mut probes.far, point).dot(normal);
            depth / (1.0 - leans * leans).max(0.0).sqrt().max(0.02)
        } else {
            reach
        };
        let place = self.place(point, normal);
        let (right, up) = (self.camera.right, self.camera.up);
        let borders = self.field.materials().len() > 1
            && [right, -right, up, -up].iter().any(|d| {
                let flat = *d - normal * normal.dot(*d);
                let p = point + flat * (0.7 * self.stroke * pixel);
                self.field.assembly.contains(p) && self.field.material(p) != place
            });
        let colour = if borders {
            colour::linear(colour::INK)
        } else {
            face_colour(at, place, off / pixel, self.stroke)
        };
        Sample {
            kind: Kind::Section(place, colour),
            point,
            normal,
            t,
            lit: None,
            thin: borders,
        }
    }

    /// The floor or the background.
    fn behind(&self, ray: Ray, thin: bool) -> Sample {
        let floor = self
            .lights
            .floor
            .filter(|_| !self.field.assembly.is_empty());
        let (kind, t) = match floor {
            Some(floor) => (Kind::Floor, (floor - ray.origin.z) / ray.direction.z),
            None => (Kind::Background, 0.0),
        };
        Sample {
            kind,
            point: ray.at(t),
            normal: DVec3::Z,
            t,
            lit: None,
            thin,
        }
    }

    /// The place of the material under a surface.
    fn place(&self, point: DVec3, normal: DVec3) -> usize {
        self.field
            .material(point - normal * (2e-7 * self.field.size))
    }

    /// The light at a sample, from a neighbour on the same surface where there is one.
    fn lit(&self, probes: &mut Probes, own: &Sample, near: &[&Sample]) -> Lit {
        if !matches!(own.kind, Kind::Surface(_) | Kind::Floor) {
            return Lit::default();
        }
        let off = |s: &Sample| (s.point - own.point).length_squared();
        let alike = near.iter().filter(|s| self.is_alike(own, s));
        let best = alike.min_by(|a, b| off(a).total_cmp(&off(b)));
        best.and_then(|s| s.lit)
            .unwrap_or_else(|| self.lights.at(self.field, probes, own.point, own.normal))
    }

    fn colour(&self, own: &Sample, lit: Lit) -> Linear {
        match own.kind {
            Kind::Background => colour::linear(colour::BACKGROUND),
            Kind::Floor => Lights::floor(lit),
            Kind::Surface(place) => {
                let albedo = mix(colour::material(place), [1.0; 3], 0.10);
                self.lights.surface(albedo, own.normal, lit)
            }
            Kind::Section(_, colour) => colour,
        }
    }
}
