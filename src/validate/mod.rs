//! The exact answers held against the triangles, and the sampled distance against what a distance is.
//!
//! Every solid is tessellated and asked two questions that know nothing of curves: how often a ray
//! crosses the triangles, and how often they wind about the point. The booleans of the solids'
//! answers are compared with the exact membership. Triangles are chords, so near the surface they
//! may be wrong; every difference is traced to a solid whose exact surface is within its mesh's
//! proven chord error of the point, and any that cannot be is a failure. Then the field: finite,
//! of the right sign, no steeper than 1 and of slope 1 where it is smooth, zero where the triangles
//! are, and as far from them as it says.
//!
//! Nothing is decided by how many points are looked at; by default that is every voxel.

mod field;
mod page;
mod votes;

pub use field::{FieldChecks, Violation};
pub use page::{Heading, page};
pub use votes::{Ballot, Disagreement, PartVote};

use crate::Error;
use crate::grid::{Channel, GridSpec};
use crate::mesh::{Mesh, MeshError, MeshTree, tessellate};
use crate::sample::{LayerBuffers, LayerSampler, Selection};
use crate::scene::Scene;
use crate::work::in_parts;
use field::{Field, Stencil};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use votes::Votes;

/// Layers that one task looks at; it samples one more on either side.
const SLAB: usize = 8;
/// Random points that one task looks at.
const CHUNK: u64 = 1024;

/// A solid's triangles, ready to be asked.
#[derive(Debug)]
pub struct PartMesh {
    mesh: Mesh,
    tree: MeshTree,
    /// Whether every edge is used once in each direction.
    closed: bool,
}

impl PartMesh {
    /// The triangles of one part of the scene.
    #[must_use]
    pub fn new(mesh: Mesh) -> Self {
        let tree = MeshTree::new(&mesh);
        let closed = mesh.unmatched_edge().is_none();
        Self { mesh, tree, closed }
    }

    /// Other triangles in place of the mesh's, with the chord error it claims: to see that what is
    /// broken is found.
    #[must_use]
    pub fn with_triangles(self, triangles: &[[DVec3; 3]]) -> Self {
        Self {
            tree: MeshTree::from_triangles(triangles),
            closed: closes(triangles),
            ..self
        }
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
}

/// Whether every edge is used as often in one direction as in the other, by the corners' bits.
fn closes(triangles: &[[DVec3; 3]]) -> bool {
    let mut uses: HashMap<[[u64; 3]; 2], i64> = HashMap::new();
    for t in triangles {
        for n in 0..3 {
            let [a, b] = [t[n], t[(n + 1) % 3]].map(|p| (p + 0.0).to_array().map(f64::to_bits));
            *uses.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    uses.values().all(|&n| n == 0)
}

/// The meshes of a scene's parts, in their order.
///
/// # Errors
/// The part's name and the reason, when a chord error (scene units) cannot be kept.
pub fn meshes(scene: &Scene, chord_error: f64) -> Result<Vec<PartMesh>, (String, MeshError)> {
    let parts = scene.assembly().parts().par_iter();
    parts
        .map(|part| {
            let mesh = tessellate(part.body(), chord_error);
            mesh.map(PartMesh::new)
                .map_err(|e| (part.name().to_owned(), e))
        })
        .collect()
}

/// What is known of one solid's mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshReport {
    /// The solid's name.
    pub name: String,
    /// How many triangles.
    pub triangles: usize,
    /// Proven largest distance between triangles and surface, both ways, in scene units.
    pub chord_error: f64,
    /// Whether every edge is used once in each direction.
    pub closed: bool,
    /// Vertices less edges plus faces.
    pub euler_characteristic: i64,
    /// Volume within the triangles, in cubed scene units.
    pub volume: f64,
}

/// What a validation found.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Points whose membership was compared.
    pub samples: u64,
    /// Those where rays, windings and the exact path agree.
    pub agree: u64,
    /// Those where they do not, and the exact surface is within the chord error.
    pub within_chord_error: u64,
    /// Those where they do not, and it is not.
    pub disagree: u64,
    /// The first of these, in the order of the grid.
    pub disagreements: Vec<Disagreement>,
    /// The meshes.
    pub meshes: Vec<MeshReport>,
    /// The checks of the distance.
    pub field: FieldChecks,
}

impl Report {
    /// Whether all is well.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.disagree == 0 && self.field.is_ok() && self.meshes.iter().all(|m| m.closed)
    }

    /// How many triangles all meshes have.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles).sum()
    }

    /// The largest chord error of a mesh, in scene units.
    #[must_use]
    pub fn chord_error(&self) -> f64 {
        self.meshes.iter().fold(0.0, |m, p| m.max(p.chord_error))
    }
}

/// Where to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Points {
    /// At the centre of every voxel.
    Grid,
    /// At so many points of the grid's box, the same in every run.
    Random(u64),
}

/// Asked between pieces of work whether to give up.
pub type Stop<'a> = &'a (dyn Fn() -> Result<(), Error> + Sync);

/// Compares a scene with the meshes of its parts, which are in their order. `done` is told how many
/// points were looked at.
///
/// # Errors
/// What `stop` says.
///
/// # Panics
/// When there is not one mesh for each part.
pub fn validate(
    scene: &Scene,
    grid: &GridSpec,
    meshes: &[PartMesh],
    points: Points,
    stop: Stop,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Report, Error> {
    let workers = rayon::current_num_threads();
    validate_with(workers, scene, grid, meshes, points, stop, done)
}

/// Bytes that a worker of [`validate_with`] takes.
#[must_use]
pub fn bytes_per_worker(scene: &Scene, grid: &GridSpec, points: Points) -> u64 {
    match points {
        Points::Grid => {
            let layers = (SLAB + 2).min(grid.dims()[2]) as u64;
            let selection = Selection::of(&[Channel::Sdf], None);
            LayerSampler::bytes_per_layer(scene.assembly(), grid, &selection).saturating_mul(layers)
        }
        Points::Random(_) => 0,
    }
}

/// As [`validate()`], by so many workers at most: each holds some layers.
///
/// # Errors
/// As [`validate()`].
///
/// # Panics
/// As [`validate()`].
pub fn validate_with(
    workers: usize,
    scene: &Scene,
    grid: &GridSpec,
    meshes: &[PartMesh],
    points: Points,
    stop: Stop,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Report, Error> {
    assert_eq!(
        scene.assembly().parts().len(),
        meshes.len(),
        "a mesh for each part"
    );
    let votes = Votes::new(scene.assembly(), meshes);
    let field = Field::new(scene.assembly(), meshes, grid);
    let found: Vec<(Ballot, FieldChecks)> = match points {
        Points::Grid => {
            let selection = Selection::of(&[Channel::Sdf], None);
            // The field's checks know no tolerance of tables.
            let sampler = LayerSampler::exact(scene.assembly(), grid, selection);
            let slabs = grid.dims()[2].div_ceil(SLAB);
            in_parts(slabs, workers, Vec::new, |layers, n| {
                stop()?;
                let found = slab(&sampler, grid, &votes, &field, n * SLAB, layers);
                done(found.0.samples);
                Ok(found)
            })?
        }
        Points::Random(count) => (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|n| {
                stop()?;
                let range = n * CHUNK..((n + 1) * CHUNK).min(count);
                let found = chunk(grid, &votes, &field, range);
                done(found.0.samples);
                Ok(found)
            })
            .collect::<Result<_, Error>>()?,
    };
    let (mut ballot, mut checks) = (Ballot::default(), FieldChecks::default());
    for (b, c) in found {
        ballot.add(b);
        checks.add(c);
    }
    let named = scene.assembly().parts().iter().zip(meshes);
    Ok(Report {
        samples: ballot.samples,
        agree: ballot.agree,
        within_chord_error: ballot.within_chord_error,
        disagree: ballot.disagree,
        disagreements: ballot.disagreements,
        meshes: named
            .map(|(part, m)| MeshReport {
                name: part.name().to_owned(),
                triangles: m.tree.len(),
                chord_error: m.mesh.chord_error(),
                closed: m.closed,
                euler_characteristic: m.mesh.euler_characteristic(),
                volume: m.mesh.volume(),
            })
            .collect(),
        field: checks,
    })
}

/// The layers from `first`, as many as a slab has.
fn slab(
    sampler: &LayerSampler,
    grid: &GridSpec,
    votes: &Votes,
    field: &Field,
    first: usize,
    layers: &mut Vec<LayerBuffers>,
) -> (Ballot, FieldChecks) {
    let [nx, ny, nz] = grid.dims();
    let end = (first + SLAB).min(nz);
    let start = first.saturating_sub(1);
    let held = start..(end + 1).min(nz);
    layers.resize_with(layers.len().max(held.len()), LayerBuffers::default);
    for (k, layer) in held.zip(&mut *layers) {
        sampler.sample(k, layer);
    }
    let layers = &*layers;
    let value = |i: usize, j: usize, k: usize| layers[k - start].sdf[j * nx + i];
    let (mut ballot, mut checks) = (Ballot::default(), FieldChecks::default());
    for k in first..end {
        let layer = &layers[k - start];
        for j in 0..ny {
            let row = &layer.occupancy[j * nx..(j + 1) * nx];
            votes.row(grid, [j, k], row, &mut ballot);
            for i in 0..nx {
                let beside = |axis: usize, step: usize, room: bool| {
                    room.then(|| {
                        let mut at = [i, j, k];
                        at[axis] = at[axis] + step - 1;
                        value(at[0], at[1], at[2])
                    })
                };
                let stencil = Stencil {
                    voxel: Some([i, j, k]),
                    point: grid.centre(i, j, k),
                    inside: row[i] != 0,
                    value: value(i, j, k),
                    beside: [
                        [beside(0, 0, i > 0), beside(0, 2, i + 1 < nx)],
                        [beside(1, 0, j > 0), beside(1, 2, j + 1 < ny)],
                        [beside(2, 0, k > 0), beside(2, 2, k + 1 < nz)],
                    ],
                };
                field.check(&stencil, &mut checks);
            }
        }
    }
    (ballot, checks)
}

/// Random points by their numbers.
fn chunk(
    grid: &GridSpec,
    votes: &Votes,
    field: &Field,
    numbers: std::ops::Range<u64>,
) -> (Ballot, FieldChecks) {
    let (mut ballot, mut checks) = (Ballot::default(), FieldChecks::default());
    let sides = grid.spacing() * DVec3::from(grid.dims().map(|d| d as f64));
    for n in numbers {
        let point = grid.origin() + sides * random(n);
        votes.point(point, &mut ballot);
        field.check(&field.around(point), &mut checks);
    }
    (ballot, checks)
}

/// Point number `n` of the unit cube: splitmix64 (Steele et al., 2014) over three consecutive numbers.
fn random(n: u64) -> DVec3 {
    let one = |c: u64| {
        let mut z = (3 * n + c + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        #[allow(clippy::cast_precision_loss, reason = "53 bits")]
        let unit = ((z ^ (z >> 31)) >> 11) as f64;
        unit * (0.5 * f64::EPSILON)
    };
    DVec3::new(one(0), one(1), one(2))
}
