//! A page to look at: one HTML file that shows a solid and its voxels, without any other file or the network.
//!
//! ```text
//!   scene ──> LayerSampler ─┐               ┌─> surface   the field that is drawn, in 16 bits
//!                           ├─> layers ─────┤
//!   stack ──> its files ────┘               └─> channels  every sample, bit for bit (codec)
//!   scene, manifest ──> facts ──────────────────┐
//!   render ──> a still picture ─────────────────┴─> template: one HTML text
//! ```
//!
//! * The numbers under the pointer are the stored samples themselves. A page has [`MOST_BYTES`]; channels that do not
//!   fit are left out or, where they are distances, rounded away from the surface, and the page says so.
//! * Grids with more than [`MOST_SIDE`] voxels along a side are thinned: every so manieth voxel is shown.
//! * Names from files are text: nothing of them is markup, and the page's policy lets no script run but its own.
//! * [`sheet()`] is the frame of pages without scripts; reports have the same look by it.

mod channels;
mod codec;
mod digest;
mod facts;
mod lattice;
mod sheet;
mod source;
mod stack;
mod surface;
mod template;

pub use lattice::MOST_SIDE;
pub use sheet::{escaped, mark, picture, sheet, table};
pub use template::Page;

use crate::error::Error;
use crate::grid::{Channel, GridSpec};
use crate::io::Manifest;
use crate::io::manifest::MANIFEST_NAME;
use crate::io::stack::ChannelSpec;
use crate::math::Kernel;
use crate::picture::{RenderOptions, View, material_bytes, render, seen};
use crate::sample::{Cancel, LayerSampler, Selection, Tally};
use crate::scene::{ChannelModel, PARAMETERS, Scene};
use crate::solid::{Assembly, Part, Scalar};
use channels::{Keep, Stored};
use codec::Kind;
use glam::DVec3;
use lattice::Lattice;
use source::{ChannelHead, Counts, Layers, Sampled};
use stack::Stack;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use surface::{Made, Surface};

/// Bytes of a page at most.
pub const MOST_BYTES: usize = 20_000_000;
/// Bytes that are kept for what is neither samples nor pictures: text, style and scripts.
const TEXT: usize = 200_000;
/// Distances up to so many spacings keep their bits where not all do.
const BAND: f64 = 4.0;
/// Pixels of the still picture.
const STILL: [usize; 2] = [720, 540];

/// How a page is made.
#[derive(Debug, Clone, Copy)]
pub struct PageOptions {
    /// Slabs of layers that are sampled at the same time, at least 1.
    pub workers: usize,
    /// The inner loops; the page does not depend on them.
    pub kernel: Kernel,
}

/// What a scene's page shows of its grid.
#[derive(Debug, Clone)]
struct Sampling {
    heads: Vec<ChannelHead>,
    selection: Selection,
    scalars: Vec<String>,
    shares: Vec<(String, u32)>,
}

impl Sampling {
    fn new(scene: &Scene, grid: &GridSpec, channels: &[ChannelModel]) -> Self {
        let units = scene.model().units.name();
        let known = |c: &ChannelModel| match c {
            ChannelModel::Known(channel) => Some(*channel),
            _ => None,
        };
        let head = |c: &ChannelModel| {
            let kind = known(c).map_or(Kind::Float, |channel| match channel {
                Channel::Occupancy | Channel::Material => Kind::Uint,
                _ => Kind::Float,
            });
            let spec = ChannelSpec::named(c.name(), crate::io::exr::SampleKind::Float, units);
            ChannelHead {
                name: spec.name,
                unit: spec.unit,
                meaning: spec.meaning,
                kind,
            }
        };
        let wanted: Vec<Channel> = channels.iter().filter_map(known).collect();
        let scalar = |c: &ChannelModel| match c {
            ChannelModel::Scalar(name) => Some(name.clone()),
            _ => None,
        };
        let share = |c: &ChannelModel| match c {
            ChannelModel::MaterialFraction { id, name } => Some((name.clone(), *id)),
            _ => None,
        };
        Self {
            heads: channels.iter().map(head).collect(),
            selection: Selection::of(&wanted, scene.band(grid)),
            scalars: channels.iter().filter_map(scalar).collect(),
            shares: channels.iter().filter_map(share).collect(),
        }
    }
}

/// The channels that a page of a scene shows without being told: those of its output, the distance, and the material
/// where there are several.
#[must_use]
pub fn default_channels(scene: &Scene) -> Vec<ChannelModel> {
    let mut channels = scene.model().output.channels.clone();
    let mut more = vec![Channel::Sdf];
    if materials_of(scene).len() > 1 {
        more.push(Channel::Material);
    }
    for channel in more.into_iter().map(ChannelModel::Known) {
        if !channels.contains(&channel) {
            channels.push(channel);
        }
    }
    channels
}

/// Bytes of memory that a worker takes for a page of a scene, tables aside.
#[must_use]
pub fn scene_bytes_per_worker(scene: &Scene, grid: &GridSpec, channels: &[ChannelModel]) -> u64 {
    let sampling = Sampling::new(scene, grid, channels);
    let lattice = Lattice::new(*grid);
    let layers = channels::slab_layers(&lattice);
    let shown = shown_grid(&lattice);
    let layer =
        LayerSampler::bytes_per_layer(scene.assembly(), grid, &sampling.selection).saturating_add(
            LayerSampler::bytes_of_division(scene.assembly(), &sampling.selection),
        );
    // Samples of the layer by their bits, and a share of each material by itself.
    let copies = 4 * (sampling.heads.len() + 4 * sampling.shares.len() + sampling.scalars.len());
    let copies = (grid.layer_len() as u64).saturating_mul(copies as u64);
    source::bytes_per_slab(&shown, sampling.heads.len(), layers)
        .saturating_add(layer)
        .saturating_add(copies)
}

/// As [`scene_bytes_per_worker`], of a stack.
///
/// # Errors
/// As [`of_stack`].
pub fn stack_bytes_per_worker(directory: &Path, manifest: &Manifest) -> Result<u64, Error> {
    let lattice = Lattice::new(grid_of(manifest)?);
    let stack = Stack::new(directory, manifest.clone())?;
    let layers = channels::slab_layers(&lattice);
    let shown = shown_grid(&lattice);
    Ok(stack
        .bytes_per_layer()
        .saturating_add(source::bytes_per_slab(
            &shown,
            manifest.channels.len(),
            layers,
        )))
}

/// A grid with as many voxels as are shown.
fn shown_grid(lattice: &Lattice) -> GridSpec {
    GridSpec::new(lattice.dims, DVec3::ZERO, DVec3::ONE).unwrap_or(lattice.grid)
}

/// The page of a scene on a grid.
///
/// # Errors
/// [`Error::Interrupted`] when `cancel` says so.
///
/// ```
/// use voxlathe::page::{PageOptions, default_channels, of_scene};
/// let scene = voxlathe::Scene::parse("schema = 1\ngrid = { resolution = 8 }\n[[solid]]\nkind = 'sphere'\nradius = 1\n")?;
/// let options = PageOptions { workers: 1, kernel: voxlathe::math::Kernel::default() };
/// let (page, _) = of_scene(&scene, &scene.grid()?, &default_channels(&scene), &options, &|| false)?;
/// let mut html = Vec::new();
/// page.write(&mut html)?;
/// assert!(html.starts_with(b"<!doctype html>") && html.len() < voxlathe::page::MOST_BYTES);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn of_scene(
    scene: &Scene,
    grid: &GridSpec,
    channels: &[ChannelModel],
    options: &PageOptions,
    cancel: Cancel<'_>,
) -> Result<(Page, Tally), Error> {
    let sampling = Sampling::new(scene, grid, channels);
    let lattice = Lattice::new(*grid);
    let still = still(scene, cancel)?;
    // Of nothing every distance takes its time.
    let surface = if scene.is_known_empty() {
        None
    } else {
        Some(drawn(scene, options, cancel)?)
    };
    let shares = (sampling.shares.iter()).filter_map(|(_, id)| scene.assembly().of_material(*id));
    let shares: Vec<Assembly> = shares.collect();
    let sampler =
        LayerSampler::with_kernel(options.kernel, scene.assembly(), grid, sampling.selection)
            .with_scalars(scalars(&sampling.scalars))
            .with_profiles(scene)
            .with_materials(&shares)
            .with_cancel(cancel);
    let names: Vec<String> = sampling.shares.iter().map(|s| s.0.clone()).collect();
    let counts = Mutex::new(Counts::default());
    let source = |counts| Sampled {
        sampler: &sampler,
        scalars: &sampling.scalars,
        shares: &names,
        counts,
    };
    let room = room(surface.as_ref(), still.len());
    let (stored, mut notices) = fitted(
        &source(Some(&counts)),
        &source(None),
        &lattice,
        &sampling.heads,
        room,
        options.workers,
        cancel,
    )?;
    let counts = counts.into_inner().unwrap_or_else(PoisonError::into_inner);
    let has = |channel| sampling.selection.has(channel);
    let counted = lattice.is_whole().then_some(facts::Counted {
        inside: counts.inside,
        fraction: has(Channel::Fraction).then(|| counts.fractions.values().sum()),
    });
    notices.splice(0..0, thinned(&lattice));
    notices.extend(scene.warnings().iter().cloned());
    notices.extend(scene.grid_warning(grid));
    if surface.is_none() {
        notices.push("nothing is left of the solids: there is no surface to draw".into());
    }
    let facts = facts::of_scene(scene, &lattice, counted, &stored);
    let view = seen(scene, View::default(), cancel)?;
    let ids = materials_of(scene);
    let name = |id: &u32| scene.model().materials.get(id).cloned();
    let page = Page {
        name: scene.name().to_owned(),
        units: scene.model().units.name().to_owned(),
        source: "scene",
        lattice,
        surface,
        channels: stored,
        materials: (ids.iter().enumerate())
            .map(|(place, id)| (*id, name(id), material_bytes(place)))
            .collect(),
        middle: view.middle.to_array(),
        extent: view.extent,
        facts,
        notices,
        still: Some(still),
    };
    Ok((page, counts.tally))
}

/// The page of a finished stack, whose files are as its manifest lists them; see [`crate::io::verify_stack`].
///
/// * `wanted`: names of the channels that are shown; all of them where there are none.
///
/// # Errors
/// [`crate::io::IoError::Mismatch`] where the stack has no format that can be read here, or not what its manifest says,
/// [`crate::io::IoError::Read`] where a file cannot be read, [`Error::Interrupted`] when `cancel` says so.
pub fn of_stack(
    directory: &Path,
    manifest: &Manifest,
    wanted: &[String],
    options: &PageOptions,
    cancel: Cancel<'_>,
) -> Result<Page, Error> {
    let grid = grid_of(manifest)?;
    let lattice = Lattice::new(grid);
    let stack = Stack::new(directory, manifest.clone())?;
    let all: Vec<ChannelHead> = manifest.channels.iter().map(Stack::head).collect();
    let shown = all
        .iter()
        .filter(|h| wanted.is_empty() || wanted.contains(&h.name));
    let heads: Vec<ChannelHead> = shown.cloned().collect();
    let drawn = ["sdf", "fraction", "occupancy"];
    let drawn = drawn
        .iter()
        .find_map(|name| all.iter().find(|h| h.name == *name));
    let surface = match drawn {
        Some(head) => {
            let workers = options.workers;
            Some(surface::store(
                &stack, &lattice, head, None, workers, cancel,
            )?)
        }
        None => None,
    };
    let room = room(surface.as_ref(), 0);
    let workers = options.workers;
    let (stored, mut notices) = fitted(&stack, &stack, &lattice, &heads, room, workers, cancel)?;
    notices.splice(0..0, thinned(&lattice));
    notices.extend(manifest.warnings.iter().cloned());
    for head in &heads {
        if stack.is_rounded(head)? {
            notices.push(format!(
                "{}: stored in 64 bits, shown rounded to 32",
                head.name
            ));
        }
    }
    match surface.as_ref().map(|s| (s.made, drawn)) {
        Some((Made::Share, Some(head))) => notices.push(format!(
            "the stack has no sdf: the surface is drawn where {} is a half",
            head.name
        )),
        None => notices.push(
            "the stack has no sdf, fraction or occupancy: there is no surface to draw".into(),
        ),
        _ => {}
    }
    let (middle, extent) = framed(surface.as_ref(), &grid);
    let bytes = std::fs::read(directory.join(MANIFEST_NAME)).unwrap_or_default();
    let digest = blake3::hash(&bytes).to_hex().to_string();
    let facts = facts::of_stack(manifest, &digest, &lattice, &stored);
    let name = |id: u32| {
        let named = manifest.materials.get(id.to_string());
        named.and_then(|n| n.as_str()).map(str::to_owned)
    };
    let mut ids: Vec<u32> = manifest.material_volumes.iter().map(|m| m.id).collect();
    if ids.is_empty() {
        ids.push(1);
    }
    Ok(Page {
        name: manifest
            .scene_name
            .clone()
            .unwrap_or_else(|| "stack".into()),
        units: manifest.units.clone(),
        source: "stack",
        lattice,
        surface,
        channels: stored,
        materials: (ids.iter().enumerate())
            .map(|(place, id)| (*id, name(*id), material_bytes(place)))
            .collect(),
        middle,
        extent,
        facts,
        notices,
        still: None,
    })
}

fn grid_of(manifest: &Manifest) -> Result<GridSpec, Error> {
    let g = manifest.grid;
    Ok(GridSpec::new(g.dims, g.origin.into(), g.spacing.into())?)
}

/// The materials of a scene, in the order of their colours.
fn materials_of(scene: &Scene) -> Vec<u32> {
    let mut ids: Vec<u32> = scene.assembly().added().map(Part::material).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

fn scalars(names: &[String]) -> Vec<Scalar> {
    let one = |name: &String| {
        let parameter = PARAMETERS.iter().position(|p| p == name);
        parameter.map_or_else(|| Scalar::Field(name.clone()), Scalar::Parameter)
    };
    names.iter().map(one).collect()
}

/// The still picture, as the bytes of a PNG file.
fn still(scene: &Scene, cancel: Cancel<'_>) -> Result<Vec<u8>, Error> {
    let options = RenderOptions {
        width: STILL[0],
        height: STILL[1],
        annotations: false,
        lines: 0,
        ..RenderOptions::default()
    };
    Ok(render(scene, &options, cancel)?.to_png()?)
}

/// The field that a scene's surface is drawn from.
fn drawn(scene: &Scene, options: &PageOptions, cancel: Cancel<'_>) -> Result<Surface, Error> {
    let grid = surface::grid(scene.bounds())?;
    let selection = Selection::of(&[Channel::Sdf], None);
    let sampler = LayerSampler::with_kernel(options.kernel, scene.assembly(), &grid, selection)
        .with_cancel(cancel);
    let source = Sampled {
        sampler: &sampler,
        scalars: &[],
        shares: &[],
        counts: None,
    };
    let head = ChannelHead {
        name: Channel::Sdf.name().into(),
        unit: None,
        meaning: String::new(),
        kind: Kind::Float,
    };
    let lattice = Lattice::new(grid);
    let solid = Some(scene.assembly());
    surface::store(&source, &lattice, &head, solid, options.workers, cancel)
}

/// Bytes that are left for channels, before they are written as text.
fn room(surface: Option<&Surface>, still: usize) -> usize {
    let drawn: usize = surface.map_or(0, |s| s.slabs.iter().chain(&s.skin).map(Vec::len).sum());
    let left = (MOST_BYTES - TEXT) / 4 * 3;
    left.saturating_sub(drawn).saturating_sub(still)
}

/// The channels that there is room for, and what is to be said of the others.
///
/// * `again`: the same source, for what is read a second time.
fn fitted<L: Layers>(
    source: &L,
    again: &L,
    lattice: &Lattice,
    heads: &[ChannelHead],
    mut room: usize,
    workers: usize,
    cancel: Cancel<'_>,
) -> Result<(Vec<Stored>, Vec<String>), Error> {
    let all = channels::store(source, lattice, heads, Keep::Exactly, workers, cancel)?;
    // Small ones first, then the distance, for which there is another way, then the others in their order.
    let rank = |s: &Stored| match s.head.name.as_str() {
        "occupancy" | "material" => 0,
        "fraction" => 1,
        "sdf" => 2,
        _ => 3,
    };
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|&n| rank(&all[n]));
    let mut kept: Vec<Option<Stored>> = vec![None; all.len()];
    let mut notices = Vec::new();
    for n in order {
        let stored = &all[n];
        let name = &stored.head.name;
        if stored.bytes() <= room {
            room -= stored.bytes();
            kept[n] = Some(stored.clone());
            continue;
        }
        if name == "sdf" {
            let most = BAND * lattice.grid.spacing().max_element();
            let keep = Keep::Within(most);
            let head = std::slice::from_ref(&stored.head);
            let rounded = channels::store(again, lattice, head, keep, workers, cancel)?;
            if let Some(rounded) = rounded.into_iter().next().filter(|r| r.bytes() <= room) {
                notices.push(format!(
                    "sdf: farther than {BAND} spacings from the surface the values are rounded to 10 bits, marked with \u{2248}, so that the page stays within {} MB",
                    MOST_BYTES / 1_000_000
                ));
                room -= rounded.bytes();
                kept[n] = Some(rounded);
                continue;
            }
        }
        notices.push(format!(
            "{name}: left out, as the page would have more than {} MB; choose fewer channels or a lower resolution",
            MOST_BYTES / 1_000_000
        ));
    }
    Ok((kept.into_iter().flatten().collect(), notices))
}

/// What is to be said of a grid that is not shown whole.
fn thinned(lattice: &Lattice) -> Option<String> {
    (!lattice.is_whole()).then(|| {
        let [nx, ny, nz] = lattice.grid.dims();
        let [a, b, c] = lattice.dims;
        format!(
            "the grid of {nx} x {ny} x {nz} voxels is reduced to {a} x {b} x {c}: one voxel of {} along each axis is shown, with its own values",
            lattice.stride
        )
    })
}

/// The middle and the size of what the default view shows of a stack.
fn framed(surface: Option<&Surface>, grid: &GridSpec) -> ([f64; 3], [f64; 2]) {
    let dims = DVec3::from(grid.dims().map(|n| {
        #[allow(clippy::cast_precision_loss, reason = "dimensions are below 2^31")]
        let n = n as f64;
        n
    }));
    let size = dims * grid.spacing();
    let middle = grid.origin() + 0.5 * size;
    let (right, up) = View::default().plane();
    let Some([low, high]) = surface.and_then(|s| s.seen) else {
        let reach = |axis: DVec3| (axis.abs() * size).element_sum();
        return (middle.to_array(), [reach(right), reach(up)]);
    };
    let to = [right, up]
        .into_iter()
        .enumerate()
        .map(|(a, axis)| axis * (0.5 * (low[a] + high[a]) - middle.dot(axis)));
    let middle = middle + to.sum::<DVec3>();
    (middle.to_array(), [0, 1].map(|a| high[a] - low[a]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_rounded_or_left_out() {
        let text = "schema = 1\ngrid = { resolution = 40 }\n[[solid]]\nkind = 'torus'\nmajor = 2\nminor = 1\n";
        let scene = Scene::parse(text).expect("a scene");
        let grid = scene.grid().expect("a grid");
        let names = ["normal-x", "sdf", "occupancy", "fraction"];
        let channels = scene.model().channels(&names).expect("channels");
        let sampling = Sampling::new(&scene, &grid, &channels);
        let sampler = LayerSampler::new(scene.assembly(), &grid, sampling.selection);
        let source = Sampled {
            sampler: &sampler,
            scalars: &[],
            shares: &[],
            counts: None,
        };
        let lattice = Lattice::new(grid);
        let kept = |room: usize| {
            fitted(
                &source,
                &source,
                &lattice,
                &sampling.heads,
                room,
                2,
                &|| false,
            )
            .expect("nothing stops it")
        };
        let (all, notices) = kept(usize::MAX);
        assert!(notices.is_empty() && all.iter().all(|c| c.exact_within.is_none()));
        let order: Vec<&str> = all.iter().map(|c| c.head.name.as_str()).collect();
        assert_eq!(order, names);
        // A byte too few for the distance.
        let first = all[1..].iter().map(Stored::bytes).sum::<usize>() - 1;
        let (some, notices) = kept(first);
        let sdf = some.iter().find(|c| c.head.name == "sdf").expect("sdf");
        let band = sdf.exact_within.expect("a band");
        assert!((band - 4.0 * grid.spacing().x).abs() < 1e-12);
        assert!(sdf.bytes() < all[1].bytes());
        assert!(notices[0].contains("rounded to 10 bits"), "{notices:?}");
        assert!(notices[1].starts_with("normal-x: left out"), "{notices:?}");
        let (none, notices) = kept(0);
        assert!(none.is_empty() && notices.len() == names.len());
    }
}
