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

use super::channels::{in_order, slab_layers};
use super::codec::{self, Kind};
use super::lattice::Lattice;
use super::source::{ChannelHead, Layers};
use crate::error::Error;
use crate::grid::GridSpec;
use crate::math::Aabb;
use crate::picture::View;
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
/// # Errors
/// What `source` says, and [`Error::Interrupted`] when `cancel` does.
pub(super) fn store<L: Layers>(
    source: &L,
    lattice: &Lattice,
    head: &ChannelHead,
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
    let one = |slab: usize, scratch: &mut L::Scratch| -> Result<_, Error> {
        let mut seen = Seen::default();
        let mut numbers = Vec::with_capacity(layers);
        for k in slab * layers..lattice.dims[2].min((slab + 1) * layers) {
            let layer = source.layer(lattice.layer(k), heads, scratch)?;
            if cancel() {
                return Err(Error::Interrupted);
            }
            let shown = lattice.of_layer(layer.first().map_or(&[][..], Vec::as_slice));
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
            let values: Vec<u32> = shown.into_iter().map(|bits| number(value(bits))).collect();
            seen.add(lattice, k, &values);
            numbers.push(values);
        }
        Ok((codec::encode(Kind::Uint, size, &numbers), seen))
    };
    let found = in_order(lattice.dims[2].div_ceil(layers), workers, one)?;
    let mut seen = Seen::default();
    let mut slabs = Vec::with_capacity(found.len());
    for (bytes, part) in found {
        slabs.push(bytes);
        seen.join(&part);
    }
    Ok(Surface {
        lattice: *lattice,
        slabs,
        layers,
        made,
        unit,
        seen: seen.known(),
    })
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
