//! Membership by rays, by windings and by the exact path.

use super::PartMesh;
use crate::grid::GridSpec;
use crate::math::Aabb;
use crate::mesh::RayCrossings;
use crate::solid::{Assembly, Operation};
use glam::DVec3;

/// Disagreements that are kept to be shown.
const SHOWN: usize = 20;
/// How far a winding number may be off: it is a whole number, and rounded to one.
const ACCURACY: f64 = 0.45;

/// One solid's answers about a point.
#[derive(Debug, Clone, PartialEq)]
pub struct PartVote {
    /// The solid's name.
    pub name: String,
    /// The exact answer.
    pub inside: bool,
    /// Whether a ray crosses the triangles an odd number of times.
    pub parity: bool,
    /// How often the triangles wind about the point.
    pub winding: f64,
    /// Distance to the exact surface, in scene units.
    pub distance: f64,
    /// Chord error of the mesh, in scene units.
    pub chord_error: f64,
}

/// A point where the answers differ and no chord explains it.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// The voxel, where the point is its centre.
    pub voxel: Option<[usize; 3]>,
    /// The point, in scene units.
    pub point: DVec3,
    /// The exact answer.
    pub inside: bool,
    /// The answer of the rays.
    pub parity: bool,
    /// The answer of the windings.
    pub winding: bool,
    /// What each solid said.
    pub parts: Vec<PartVote>,
}

/// Counts of points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ballot {
    /// All of them.
    pub samples: u64,
    /// Where all answers are the same.
    pub agree: u64,
    /// Where the difference lies within the chord error.
    pub within_chord_error: u64,
    /// Where it does not.
    pub disagree: u64,
    /// The first of these.
    pub disagreements: Vec<Disagreement>,
}

impl Ballot {
    pub(super) fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.agree += other.agree;
        self.within_chord_error += other.within_chord_error;
        self.disagree += other.disagree;
        let room = SHOWN - self.disagreements.len();
        self.disagreements
            .extend(other.disagreements.into_iter().take(room));
    }
}

/// The voters.
pub(super) struct Votes<'a> {
    assembly: &'a Assembly,
    meshes: &'a [PartMesh],
    /// Around each mesh.
    boxes: Vec<Aabb>,
}

impl<'a> Votes<'a> {
    pub(super) fn new(assembly: &'a Assembly, meshes: &'a [PartMesh]) -> Self {
        let around = |m: &PartMesh| {
            let empty = Aabb {
                min: DVec3::INFINITY,
                max: DVec3::NEG_INFINITY,
            };
            m.mesh.vertices().iter().fold(empty, |b, &v| Aabb {
                min: b.min.min(v),
                max: b.max.max(v),
            })
        };
        Self {
            assembly,
            meshes,
            boxes: meshes.iter().map(around).collect(),
        }
    }

    /// The votes on a row of voxels, whose exact answers are given.
    pub(super) fn row(
        &self,
        grid: &GridSpec,
        [j, k]: [usize; 2],
        exact: &[u8],
        ballot: &mut Ballot,
    ) {
        let xs: Vec<f64> = (0..exact.len()).map(|i| grid.centre_along(0, i)).collect();
        let (y, z) = (grid.centre_along(1, j), grid.centre_along(2, k));
        let mut crossings = vec![RayCrossings::default(); xs.len()];
        let mut parity = vec![false; xs.len()];
        let mut winding = vec![false; xs.len()];
        for (n, (part, mesh)) in self.assembly.parts().iter().zip(self.meshes).enumerate() {
            let b = &self.boxes[n];
            let misses = y < b.min.y || y > b.max.y || z < b.min.z || z > b.max.z;
            if misses {
                crossings.fill(RayCrossings::default());
            } else {
                mesh.tree.crossings_row(&xs, y, z, &mut crossings);
            }
            let mut steady = Steady::default();
            for (i, &x) in xs.iter().enumerate() {
                let point = DVec3::new(x, y, z);
                compose(&mut parity[i], part.operation(), || {
                    crossings[i].is_inside()
                });
                compose(&mut winding[i], part.operation(), || {
                    !misses && steady.winds(self, n, point)
                });
            }
        }
        for (i, &x) in xs.iter().enumerate() {
            let answers = [exact[i] != 0, parity[i], winding[i]];
            self.count(Some([i, j, k]), DVec3::new(x, y, z), answers, ballot);
        }
    }

    /// The votes on one point.
    pub(super) fn point(&self, point: DVec3, ballot: &mut Ballot) {
        let (mut parity, mut winding) = (false, false);
        for (n, part) in self.assembly.parts().iter().enumerate() {
            let tree = &self.meshes[n].tree;
            compose(&mut parity, part.operation(), || {
                tree.crossings(point).is_inside()
            });
            compose(&mut winding, part.operation(), || self.winds(n, point));
        }
        let answers = [self.assembly.contains(point), parity, winding];
        self.count(None, point, answers, ballot);
    }

    /// Whether the triangles of mesh `n` wind about the point.
    fn winds(&self, n: usize, point: DVec3) -> bool {
        let b = &self.boxes[n];
        let beside = point.cmplt(b.min).any() || point.cmpgt(b.max).any();
        !beside && self.meshes[n].tree.winding_number(point, ACCURACY).abs() > 0.5
    }

    fn count(
        &self,
        voxel: Option<[usize; 3]>,
        point: DVec3,
        [inside, parity, winding]: [bool; 3],
        ballot: &mut Ballot,
    ) {
        ballot.samples += 1;
        if inside == parity && inside == winding {
            ballot.agree += 1;
            return;
        }
        let parts = self.parts(point);
        if explained(&parts, point, self.assembly) {
            ballot.within_chord_error += 1;
            return;
        }
        ballot.disagree += 1;
        if ballot.disagreements.len() < SHOWN {
            ballot.disagreements.push(Disagreement {
                voxel,
                point,
                inside,
                parity,
                winding,
                parts,
            });
        }
    }

    fn parts(&self, point: DVec3) -> Vec<PartVote> {
        let parts = self.assembly.parts().iter().zip(self.meshes);
        parts
            .map(|(part, m)| {
                let inside = part.contains(point);
                PartVote {
                    name: part.name().to_owned(),
                    inside,
                    parity: m.tree.crossings(point).is_inside(),
                    winding: m.tree.winding_number(point, 0.0),
                    distance: part.body().distance(point, inside, f64::INFINITY),
                    chord_error: m.mesh.chord_error(),
                }
            })
            .collect()
    }
}

/// A point whose winding number is known, and how far around it no triangle is: the number of a
/// closed mesh changes nowhere else.
#[derive(Default)]
struct Steady {
    point: DVec3,
    radius: f64,
    winds: bool,
}

impl Steady {
    fn winds(&mut self, votes: &Votes, n: usize, point: DVec3) -> bool {
        if (point - self.point).length() >= self.radius {
            let mesh = &votes.meshes[n];
            self.point = point;
            self.winds = votes.winds(n, point);
            let nearest = mesh.tree.nearest(point).filter(|_| mesh.closed);
            self.radius = nearest.map_or(0.0, |n| n.distance * (1.0 - 1e-9));
        }
        self.winds
    }
}

/// What a part makes of what the parts before it have made.
fn compose(so_far: &mut bool, operation: Operation, inside: impl FnOnce() -> bool) {
    *so_far = match operation {
        Operation::Add => *so_far || inside(),
        Operation::Subtract => *so_far && !inside(),
        Operation::Intersect => *so_far && inside(),
    };
}

/// Whether chords explain why the votes differ: each solid that its own triangles misjudge is within
/// their chord error of the point. Where none does, the exact boolean is regularised and the point
/// within rounding of a surface.
fn explained(parts: &[PartVote], point: DVec3, assembly: &Assembly) -> bool {
    let size = assembly.bounds().longest_side();
    let rounding = 16.0 * f64::EPSILON * (size + point.abs().max_element());
    let differs = |p: &&PartVote| p.inside != p.parity || p.inside != (p.winding.abs() > 0.5);
    let misjudged: Vec<&PartVote> = parts.iter().filter(differs).collect();
    if misjudged.is_empty() {
        return parts.iter().any(|p| p.distance <= rounding);
    }
    misjudged
        .iter()
        .all(|p| p.distance <= p.chord_error + rounding)
}
