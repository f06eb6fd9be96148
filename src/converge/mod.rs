//! How the sampled volume and distance approach the solid's own as the voxels become smaller.
//!
//! Each row of a study is one resolution. Volumes are compared with the exact one, distances, as
//! stored in f32, with the distance in f64; where the scene names a closed form
//! ([`Analytic`](crate::solid::Analytic)), everything is compared with that instead.
//!
//! The volume by occupancy is a lattice count: its error is erratic from grid to grid and says
//! little alone. Its order is fitted to the mean absolute error over lattices moved by parts of a
//! voxel, in a sequence that fills the voxel evenly (Roberts 2018, R₃).

mod fit;
mod page;
mod plot;

pub use fit::order;

use crate::Error;
use crate::grid::{Channel, GridSpec};
use crate::math::quadrature::Integral;
use crate::sample::{LayerBuffers, LayerSampler, Selection};
use crate::scene::{GridStep, Scene};
use crate::work::in_parts;
use glam::DVec3;

/// What a fraction may be off by, where a surface passes through its voxel: that of voxels that have to be divided.
pub const FRACTION_BOUND: f64 = 1e-6;

/// Errors at one resolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Voxels along the longest side of the bounds.
    pub resolution: u32,
    /// The largest side of a voxel, in scene units.
    pub spacing: f64,
    /// Relative error of the volume by occupancy, absolute-valued, on the scene's own grid.
    pub volume_occupancy_error: f64,
    /// Its mean over the moved grids.
    pub volume_occupancy_mean_error: f64,
    /// Relative error of the volume by fractions, absolute-valued.
    pub volume_fraction_error: f64,
    /// What it is at most: [`FRACTION_BOUND`] for each voxel that is neither full nor empty, the rounding of f32, and
    /// what the volume compared with may be off by.
    pub volume_fraction_bound: f64,
    /// Largest error of the stored distances, in scene units.
    pub sdf_max_error: f64,
    /// Mean absolute error of the stored distances, in scene units.
    pub sdf_mean_error: f64,
}

/// Fitted orders: the error goes as the spacing to this power. `None` where the errors are rounding
/// or there are fewer than two of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orders {
    /// Of the mean over moved grids.
    pub volume_occupancy_error: Option<f64>,
    /// Of the volume by fractions.
    pub volume_fraction_error: Option<f64>,
    /// Of the largest error of the distances.
    pub sdf_max_error: Option<f64>,
    /// Of the mean error of the distances.
    pub sdf_mean_error: Option<f64>,
}

/// A study over several resolutions.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// One row for each resolution, in the order asked for.
    pub rows: Vec<Row>,
    /// What the rows say together.
    pub orders: Orders,
    /// The volume compared with, in cubed scene units.
    pub volume: f64,
    /// How wrong it may be, in cubed scene units; the rows' bounds include it.
    pub volume_error: f64,
}

/// What a study asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Voxels along the longest side of the bounds.
    pub resolutions: Vec<u32>,
    /// Grids, moved by parts of a voxel, over which the error by occupancy is averaged.
    pub offsets: u32,
}

/// Runs a study. `stop` is asked between layers whether to give up, and `done` is told of each row.
///
/// # Errors
/// [`Error`] when the exact volume is not known or zero, a grid cannot be, or `stop` says so.
pub fn study(
    scene: &Scene,
    plan: &Plan,
    stop: &(dyn Fn() -> Result<(), Error> + Sync),
    done: &mut dyn FnMut(&Row),
) -> Result<Study, Error> {
    study_with(rayon::current_num_threads(), scene, plan, stop, done)
}

/// Bytes that a worker of [`study_with`] takes.
///
/// # Errors
/// [`Error`] when a grid cannot be.
pub fn bytes_per_worker(scene: &Scene, plan: &Plan) -> Result<u64, Error> {
    let mut most = 0;
    for &resolution in &plan.resolutions {
        let grid = at(scene, resolution).grid()?;
        let each =
            LayerSampler::bytes_per_layer(scene.assembly(), &grid, &studied()).saturating_add(
                LayerSampler::bytes_of_division(scene.assembly(), &studied()),
            );
        most = each.max(most);
    }
    Ok(most)
}

/// A scene at a resolution.
fn at(scene: &Scene, resolution: u32) -> Scene {
    let mut finer = scene.clone();
    finer.model_mut().0.step = GridStep::Resolution(resolution);
    finer
}

/// What is studied of each layer.
fn studied() -> Selection {
    Selection::of(&[Channel::Fraction, Channel::Sdf], None)
}

/// As [`study`], by so many workers at most: each holds a layer.
///
/// # Errors
/// As [`study`].
pub fn study_with(
    workers: usize,
    scene: &Scene,
    plan: &Plan,
    stop: &(dyn Fn() -> Result<(), Error> + Sync),
    done: &mut dyn FnMut(&Row),
) -> Result<Study, Error> {
    let volume = match scene.reference() {
        Some(reference) => Some(Integral {
            value: reference.volume(),
            error: 0.0,
        }),
        None => scene.exact_volume(),
    };
    let volume = volume.filter(|v| v.value > 0.0);
    let Integral {
        value: volume,
        error: volume_error,
    } = volume.ok_or(Error::NoReference)?;
    let mut rows = Vec::new();
    for &resolution in &plan.resolutions {
        let looked = Looked {
            scene: &at(scene, resolution),
            workers,
            stop,
        };
        let mut row = row(looked, resolution, volume, plan.offsets)?;
        row.volume_fraction_bound += volume_error / volume;
        done(&row);
        rows.push(row);
    }
    let orders = orders(&rows);
    Ok(Study {
        rows,
        orders,
        volume,
        volume_error,
    })
}

/// Sums over a layer.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    inside: u64,
    fraction: f64,
    touched: u64,
    worst: f64,
    absolute: f64,
}

/// A scene, and how its layers are gone through.
#[derive(Clone, Copy)]
struct Looked<'a> {
    scene: &'a Scene,
    workers: usize,
    stop: &'a (dyn Fn() -> Result<(), Error> + Sync),
}

fn row(looked: Looked<'_>, resolution: u32, volume: f64, offsets: u32) -> Result<Row, Error> {
    let grid = looked.scene.grid()?;
    let sums = layers(looked, &grid)?;
    let voxel = grid.voxel_volume();
    #[allow(clippy::cast_precision_loss, reason = "counts of voxels")]
    let count = |n: u64| n as f64;
    let relative = |found: f64| (found - volume).abs() / volume;
    let total = sums.iter().fold(Sums::default(), |a, b| Sums {
        inside: a.inside + b.inside,
        fraction: a.fraction + b.fraction,
        touched: a.touched + b.touched,
        worst: a.worst.max(b.worst),
        absolute: a.absolute + b.absolute,
    });
    let mut mean = 0.0;
    for n in 0..offsets {
        let inside = inside(looked, &moved(&grid, n)?)?;
        mean += relative(count(inside) * voxel) / f64::from(offsets);
    }
    let rounding = f64::from(f32::EPSILON) * count(total.touched);
    Ok(Row {
        resolution,
        spacing: grid.spacing().max_element(),
        volume_occupancy_error: relative(count(total.inside) * voxel),
        volume_occupancy_mean_error: if offsets == 0 {
            relative(count(total.inside) * voxel)
        } else {
            mean
        },
        volume_fraction_error: relative(total.fraction * voxel),
        volume_fraction_bound: (FRACTION_BOUND * count(total.touched) + rounding) * voxel / volume
            + displacement(&grid),
        sdf_max_error: total.worst,
        sdf_mean_error: total.absolute / count(grid.voxel_count()),
    })
}

/// What the rounding of the grid's planes may change of a sum, as a share: far from the origin a voxel is not as wide as
/// the spacing says.
fn displacement(grid: &GridSpec) -> f64 {
    let last = grid.origin() + grid.spacing() * DVec3::from(grid.dims().map(|n| n as f64));
    let far = grid.origin().abs().max(last.abs()) / grid.spacing();
    1e-13 + 8.0 * f64::EPSILON * far.max_element()
}

/// The grid moved by part `n` of a voxel, and a voxel longer so that it still covers what it did.
fn moved(grid: &GridSpec, n: u32) -> Result<GridSpec, Error> {
    // 1 / φ, 1 / φ², 1 / φ³ with φ⁴ = φ + 1.
    const STEPS: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_2,
    ];
    let part = STEPS.map(|s| (0.5 + f64::from(n + 1) * s).fract());
    let origin = grid.origin() - grid.spacing() * DVec3::from(part);
    Ok(GridSpec::new(
        grid.dims().map(|d| d + 1),
        origin,
        grid.spacing(),
    )?)
}

/// Calls `each` on every layer of a grid, in parallel; the results in order.
fn over_layers<T: Send>(
    looked: Looked<'_>,
    grid: &GridSpec,
    selection: Selection,
    each: impl Fn(usize, &LayerBuffers) -> T + Sync,
) -> Result<Vec<T>, Error> {
    // What is studied is the grid, not the tables' tolerance.
    let sampler = LayerSampler::exact(looked.scene.assembly(), grid, selection);
    let (count, workers) = (grid.dims()[2], looked.workers);
    in_parts(count, workers, LayerBuffers::default, |buffers, k| {
        (looked.stop)()?;
        sampler.sample(k, buffers);
        Ok(each(k, buffers))
    })
}

fn inside(looked: Looked<'_>, grid: &GridSpec) -> Result<u64, Error> {
    let layers = over_layers(looked, grid, Selection::default(), |_, b| b.inside)?;
    Ok(layers.iter().sum())
}

fn layers(looked: Looked<'_>, grid: &GridSpec) -> Result<Vec<Sums>, Error> {
    let scene = looked.scene;
    let [nx, ny, _] = grid.dims();
    let distance = |p: DVec3| match scene.reference() {
        Some(reference) => reference.signed_distance(p),
        None => scene.assembly().signed_distance(p),
    };
    over_layers(looked, grid, studied(), |k, buffers| {
        let mut sums = Sums {
            inside: buffers.inside,
            fraction: buffers.fraction_sum,
            ..Sums::default()
        };
        let partial = |f: &&f32| **f > 0.0 && **f < 1.0;
        sums.touched = buffers.fraction.iter().filter(partial).count() as u64;
        for j in 0..ny {
            for i in 0..nx {
                let stored = f64::from(buffers.sdf[j * nx + i]);
                let error = (stored - distance(grid.centre(i, j, k))).abs();
                sums.worst = sums.worst.max(error);
                sums.absolute += error;
            }
        }
        sums
    })
}

fn orders(rows: &[Row]) -> Orders {
    // Relative errors below this are rounding.
    let order = |error: fn(&Row) -> f64, least: f64| {
        let points: Vec<[f64; 2]> = rows.iter().map(|r| [r.spacing, error(r)]).collect();
        fit::order(&points, least)
    };
    // Stored distances are rounded to f32, whatever the spacing.
    let size = rows.iter().map(|r| r.spacing * f64::from(r.resolution));
    let rounding = f64::from(f32::EPSILON) * size.fold(0.0, f64::max);
    Orders {
        volume_occupancy_error: order(|r| r.volume_occupancy_mean_error, 1e-12),
        volume_fraction_error: order(|r| r.volume_fraction_error, 1e-12),
        sdf_max_error: order(|r| r.sdf_max_error, rounding),
        sdf_mean_error: order(|r| r.sdf_mean_error, rounding),
    }
}
