//! The field whose zero is the surface that a page draws.
//!
//! A scene is drawn from distances on a grid of its own, as fine as every browser's 3-D textures allow, whatever the
//! resolution of the voxels: so walls that are thinner than a voxel show. A stack is drawn from what it holds.
//!
//! A value `v`, in units `h` of the least spacing, is stored as a whole number `q` that is fine near the surface and
//! coarse away from it, where only steps along rays and offset surfaces need it:
//!
//! ```text
//!   u = v / h        q = round(256 u / (1 + |u| / 8))        |q| <= 2048
//! ```
//!
//! Near the surface that is 1/256 of a spacing.
//!
//! Between samples the field is linear, so a wall that is thinner than a spacing may lie between samples that are all
//! outside. In a scene's field such walls are made about a spacing thick: the exact distance at half a spacing below the
//! surface tells how thick they are, and the values around them are lowered by half of what is missing.
//!
//! ```text
//!   c outside ·          n  out of the solid, from the values that are further out
//!   ----------q------    q = c - u n           the surface
//!             p          p = q - n / 2         w = 1/2 - u(p)      the wall's thickness, where it is less than 1
//!   -----------------
//! ```
//!
//! Where there are several materials the field comes with another of them, sampled a little below the surface next to each
//! voxel, so that a wall which is thinner than a voxel has its own colour.

use super::channels::{in_order, slab_layers};
use super::codec::{self, Kind};
use super::lattice::Lattice;
use super::source::{ChannelHead, Layers};
use crate::error::Error;
use crate::grid::GridSpec;
use crate::math::Aabb;
use crate::picture::View;
use crate::solid::{Assembly, Part};
use glam::DVec3;

/// Voxels along the longest side of a scene's field, the room around it included: the least that WebGL 2 promises.
const SIDE: usize = 256;
/// Voxels around the bounds.
const ROOM: usize = 4;
/// Whole numbers for a spacing, near the surface.
const FINE: f64 = 256.0;
/// Spacings at which the numbers are half as fine.
const BEND: f64 = 8.0;
/// What is added, so that numbers are not negative.
const SHIFT: f64 = 2048.0;

/// What a stack's field is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Made {
    Distance,
    /// Half less the share.
    Share,
}

/// The field, stored.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    pub(super) lattice: Lattice,
    pub(super) slabs: Vec<Vec<u8>>,
    pub(super) layers: usize,
    pub(super) made: Made,
    /// The length that numbers are in.
    pub(super) unit: f64,
    /// Materials next to the surface in slabs like those of the field, 0 where the surface is far; where there are several.
    pub(super) skin: Vec<Vec<u8>>,
    /// Box of what is inside, as it is seen by the default view, in scene units along the picture's right and up.
    pub(super) seen: Option<[[f64; 2]; 2]>,
}

/// The grid of a scene's field: cubes around the bounds.
pub(super) fn grid(bounds: Aabb) -> Result<GridSpec, Error> {
    let sides = bounds.sides();
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let spacing = sides.max_element() / (SIDE - 2 * ROOM) as f64;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most SIDE"
    )]
    let inner = |side: f64| ((side / spacing - 1e-9).ceil().max(1.0) as usize).min(SIDE - 2 * ROOM);
    let dims = [0, 1, 2].map(|a| inner(sides[a]) + 2 * ROOM);
    #[allow(clippy::cast_precision_loss, reason = "small numbers")]
    let half = DVec3::from(dims.map(|n| 0.5 * n as f64)) * spacing;
    let middle = 0.5 * (bounds.min + bounds.max);
    Ok(GridSpec::new(dims, middle - half, DVec3::splat(spacing))?)
}

/// The number that stands for a value, in units of the least spacing.
fn number(value: f64) -> u32 {
    let number = (FINE * value / (1.0 + value.abs() / BEND)).round() + SHIFT;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and twice SHIFT; what is no number is outside"
    )]
    if number.is_nan() {
        2 * SHIFT as u32
    } else {
        number as u32
    }
}

/// Stores the field that a channel makes.
///
/// * `solid`: what the distances are of, where thin walls are to be drawn.
///
/// # Errors
/// What `source` says, and [`Error::Interrupted`] when `cancel` does.
pub(super) fn store<L: Layers>(
    source: &L,
    lattice: &Lattice,
    head: &ChannelHead,
    solid: Option<&Assembly>,
    workers: usize,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<Surface, Error> {
    let made = if head.name == "sdf" {
        Made::Distance
    } else {
        Made::Share
    };
    let unit = match made {
        Made::Distance => lattice.grid.spacing().min_element() * step(lattice),
        Made::Share => 1.0,
    };
    let layers = slab_layers(lattice);
    let size = [lattice.dims[0], lattice.dims[1]];
    let heads = std::slice::from_ref(head);
    let value = |bits: u32| {
        let stored = match head.kind {
            Kind::Float => f64::from(f32::from_bits(bits)),
            Kind::Uint => f64::from(bits),
        };
        match made {
            Made::Distance => stored / unit,
            Made::Share => 0.5 - stored,
        }
    };
    let has_skin = solid.is_some_and(|s| {
        let mut materials = s.added().map(Part::material);
        let first = materials.next();
        materials.any(|m| Some(m) != first)
    });
    // Layers beside a slab that its walls are looked for in.
    let beside = if solid.is_some() { REACH } else { 0 };
    let one = |slab: usize, scratch: &mut L::Scratch| -> Result<_, Error> {
        let own = slab * layers..lattice.dims[2].min((slab + 1) * layers);
        let all = own.start.saturating_sub(beside)..lattice.dims[2].min(own.end + beside);
        let mut values: Vec<Vec<f64>> = Vec::with_capacity(all.len());
        for k in all.clone() {
            let layer = source.layer(lattice.layer(k), heads, scratch)?;
            if cancel() {
                return Err(Error::Interrupted);
            }
            let shown = lattice.of_layer(layer.first().map_or(&[][..], Vec::as_slice));
            values.push(shown.into_iter().map(value).collect());
        }
        let mut seen = Seen::default();
        let mut numbers = Vec::with_capacity(own.len());
        let mut skins = Vec::new();
        for k in own {
            let walls = Walls {
                lattice,
                values: &values,
                first: all.start,
            };
            let layer = match solid {
                Some(solid) => walls.thickened(solid, k),
                None => values[k - all.start].clone(),
            };
            let layer: Vec<u32> = layer.into_iter().map(number).collect();
            seen.add(lattice, k, &layer);
            numbers.push(layer);
            if let Some(solid) = solid.filter(|_| has_skin) {
                skins.push(walls.skin(solid, k));
            }
            if cancel() {
                return Err(Error::Interrupted);
            }
        }
        let skin = has_skin.then(|| codec::encode(Kind::Uint, size, &skins));
        Ok((codec::encode(Kind::Uint, size, &numbers), skin, seen))
    };
    let found = in_order(lattice.dims[2].div_ceil(layers), workers, one)?;
    let mut seen = Seen::default();
    let mut slabs = Vec::with_capacity(found.len());
    let mut skin = Vec::new();
    for (bytes, materials, part) in found {
        slabs.push(bytes);
        skin.extend(materials);
        seen.join(&part);
    }
    Ok(Surface {
        lattice: *lattice,
        slabs,
        layers,
        made,
        unit,
        skin,
        seen: seen.known(),
    })
}

/// Samples from a voxel within which its wall is looked for.
const REACH: usize = 3;
/// Spacings from the surface within which materials are looked for.
const SKIN: f64 = 2.0;
/// Spacings below the surface at which they are, the first that has one.
const BELOW: [f64; 4] = [0.02, 0.1, 0.3, 0.6];
/// How thick walls are made, in spacings: linear interpolation does not miss that.
const THICK: f64 = 1.15;

/// Values around some layers, in spacings of cubes, to find thin walls in.
struct Walls<'a> {
    lattice: &'a Lattice,
    values: &'a [Vec<f64>],
    /// The layer of the first of them.
    first: usize,
}

impl Walls<'_> {
    fn at(&self, [i, j, k]: [usize; 3]) -> f64 {
        self.values[k - self.first][j * self.lattice.dims[0] + i]
    }

    /// Layer `k`, with thin walls made thick.
    fn thickened(&self, solid: &Assembly, k: usize) -> Vec<f64> {
        let mut layer = self.values[k - self.first].clone();
        let [nx, ny, nz] = self.lattice.dims;
        let inner = |n: usize| REACH..n.saturating_sub(REACH);
        if !inner(nz).contains(&k) {
            return layer;
        }
        for j in inner(ny) {
            for i in inner(nx) {
                let u = layer[j * nx + i];
                if (-0.7..2.0).contains(&u) {
                    layer[j * nx + i] -= self.missing(solid, [i, j, k], u);
                }
            }
        }
        layer
    }

    /// The materials next to the surface in layer `k`.
    fn skin(&self, solid: &Assembly, k: usize) -> Vec<u32> {
        let [nx, ny, nz] = self.lattice.dims;
        let inner = |n: usize| REACH..n.saturating_sub(REACH);
        let mut layer = vec![0; nx * ny];
        if !inner(nz).contains(&k) {
            return layer;
        }
        let spacing = self.lattice.grid.spacing();
        for j in inner(ny) {
            for i in inner(nx) {
                let u = self.at([i, j, k]);
                if u.abs() < SKIN {
                    let outward = self.outward([i, j, k], u);
                    let foot = self.lattice.grid.centre(i, j, k) - outward * u * spacing;
                    let below = BELOW.iter().map(|b| foot - outward * *b * spacing);
                    let mut found = below.map(|p| solid.material(p));
                    layer[j * nx + i] = found.find(|m| *m > 0).unwrap_or(0);
                }
            }
        }
        layer
    }

    /// Away from the solid: along each axis from the neighbour that is further out, which no thin wall comes between.
    fn outward(&self, voxel: [usize; 3], u: f64) -> DVec3 {
        let slope = |a: usize| {
            let mut next = voxel;
            next[a] += 1;
            let up = self.at(next) - u;
            next[a] -= 2;
            let down = self.at(next) - u;
            if up >= down { up } else { -down }
        };
        DVec3::from([0, 1, 2].map(slope)).normalize_or_zero()
    }

    /// Half of what the wall by a voxel lacks of being thick.
    fn missing(&self, solid: &Assembly, voxel: [usize; 3], u: f64) -> f64 {
        let outward = self.outward(voxel, u);
        let below = -outward * (u + 0.5);
        // Where interpolation has it well inside the wall is thick enough.
        if outward == DVec3::ZERO || self.between(voxel, below) <= -0.35 {
            return 0.0;
        }
        let [i, j, k] = voxel;
        let spacing = self.lattice.grid.spacing();
        let point = self.lattice.grid.centre(i, j, k) + below * spacing;
        let found = solid.signed_distance(point) / spacing.x;
        let thickness = (0.5 - found).max(0.0);
        // Thicker than can be told from here.
        if thickness >= 0.98 {
            return 0.0;
        }
        0.5 * (THICK - thickness) * (2.0 - u).min(1.0)
    }

    /// The value at a step from a voxel, less than [`REACH`] long, between the samples around it.
    fn between(&self, voxel: [usize; 3], by: DVec3) -> f64 {
        let floor = by.floor();
        let share = by - floor;
        #[allow(clippy::cast_possible_truncation, reason = "small whole numbers")]
        let low = [0, 1, 2].map(|a| voxel[a].saturating_add_signed(floor[a] as isize));
        let mut sum = 0.0;
        for corner in 0..8_usize {
            let mut at = low;
            let mut weight = 1.0;
            for a in 0..3 {
                let upper = corner >> a & 1;
                // The furthest has no share of what lies on a sample.
                at[a] = (at[a] + upper).min(self.lattice.dims[a] - 1);
                weight *= if upper == 1 { share[a] } else { 1.0 - share[a] };
            }
            if weight > 0.0 {
                sum += weight * self.at(at);
            }
        }
        sum
    }
}

#[allow(clippy::cast_precision_loss, reason = "a small number")]
fn step(lattice: &Lattice) -> f64 {
    lattice.stride as f64
}

/// What is seen of voxels that are inside.
#[derive(Debug, Clone, Copy)]
struct Seen {
    low: [f64; 2],
    high: [f64; 2],
}

impl Default for Seen {
    fn default() -> Self {
        Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }
}

impl Seen {
    /// Adds the first and the last voxel inside of each row: the others are between them.
    fn add(&mut self, lattice: &Lattice, k: usize, numbers: &[u32]) {
        let (right, up) = View::default().plane();
        let half = 0.5 * step(lattice) * lattice.grid.spacing().max_element();
        let inside = |n: &u32| f64::from(*n) <= SHIFT;
        for (j, row) in numbers.chunks(lattice.dims[0]).enumerate() {
            let ends = [row.iter().position(inside), row.iter().rposition(inside)];
            for i in ends.into_iter().flatten() {
                let [i, j, k] = [i, j, k].map(|n| n * lattice.stride);
                let [x, y, z] = lattice.first;
                let centre = lattice.grid.centre(i + x, j + y, k + z);
                for (a, axis) in [right, up].into_iter().enumerate() {
                    let at = centre.dot(axis);
                    self.low[a] = self.low[a].min(at - half);
                    self.high[a] = self.high[a].max(at + half);
                }
            }
        }
    }

    fn join(&mut self, other: &Self) {
        for a in 0..2 {
            self.low[a] = self.low[a].min(other.low[a]);
            self.high[a] = self.high[a].max(other.high[a]);
        }
    }

    fn known(&self) -> Option<[[f64; 2]; 2]> {
        (self.low[0] <= self.high[0]).then_some([self.low, self.high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_fine_near_the_surface_and_keep_the_side() {
        let value = |n: u32| {
            let q = f64::from(n) - SHIFT;
            q / (FINE - q.abs() / BEND)
        };
        for v in [0.0_f64, 1e-3, 0.3, 1.7, -0.002, -2.5, 40.0, -300.0] {
            let back = value(number(v));
            let allowed = 0.51 / FINE * (1.0 + v.abs() / BEND).powi(2);
            assert!((back - v).abs() <= allowed, "{v}: {back}");
        }
        assert!(number(-0.01) < 2048 && number(0.01) > 2048);
        assert_eq!(number(f64::INFINITY), 4096);
        assert_eq!(number(f64::NAN), 4096);
    }

    #[test]
    fn a_needle_and_a_sheet_have_a_grid() {
        for sides in [[1.0, 1.0, 1.0], [1e-9, 1e-9, 2.0], [3.0, 3.0, 1e-12]] {
            let bounds = Aabb {
                min: DVec3::splat(0.5),
                max: DVec3::splat(0.5) + DVec3::from(sides),
            };
            let grid = grid(bounds).expect("a grid");
            let end = grid.origin() + grid.spacing() * 256.0;
            assert_eq!(grid.dims().into_iter().max(), Some(SIDE));
            assert!(grid.origin().cmplt(bounds.min).all() && end.cmpgt(bounds.max).any());
        }
    }
}
