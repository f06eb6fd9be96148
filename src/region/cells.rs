//! The signed distance over a part of the half-plane, as a circle for each of many small cells.
//!
//! The half-plane is laid out in square tiles, each divided evenly into 4^level cells, so that a point finds its cell
//! by two look-ups. A cell keeps the distance to the circle, line or corner nearest to its centre, about the centre:
//!
//! ```text
//!   d = d₀ + 2 E / (1 + sqrt(1 + 2 k E)) = d₀ + E (1 - v + 2 v² - 5 v³ + 14 v⁴) + rest
//!   E = n · q + k/2 |q|²     v = k E / 2      q from the centre, n the gradient there, k the bend
//!   |rest| <= 42 |E| |v|⁵ / (1 - 4 |v|)       the coefficients are Catalan numbers
//! ```
//!
//! That is exact where one feature answers for all of the cell but for the rest; where features hand over within it,
//! [`Chain::departure`](super::Chain::departure) bounds what is added. With several runs of features the one nearest to
//! the centre must be nearest all over the cell: the others are further from the centre by more than either distance
//! can change on the way,
//!
//! ```text
//!   |d₂| - |d₁| > w |g₂ - g₁| + w²/2 (b₁ + b₂) + departures      w half the diagonal, b the greatest bends
//! ```
//!
//! with g the gradients of the unsigned distances, or more than 2 w, whatever the gradients. Tiles are divided until
//! each cell is within the tolerance. Where that is not so at the finest level the circles of all runs that may be
//! nearest are kept apart from the cells, for each run one on either side of the normal at which a feature hands over to
//! another, and the nearest of the runs is the distance. Cells without a circle, those too, have NaN as their distance.
//!
//! Points are in places: fixed-point numbers of *steps*, from the lattice's corner on.

use super::chain::Local;
use super::field::MeridianField;
use super::field_nodes::{Leaf, MOST_RUNS};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Cells over a rectangle of the half-plane.
#[derive(Debug, Clone)]
pub(crate) struct CellTable {
    /// For each tile, r first, its level in the lowest bits and the number of its first cell in the others.
    tiles: Vec<u32>,
    /// How far the circles of tiles that are not divided are off at most, in steps.
    errors: Vec<f32>,
    /// Tiles along r.
    across: u32,
    cells: Vec<Cell>,
    /// Circles of cells that have several, [`PARTS`] together for each run: two circles, and the line n · q + c = 0
    /// beyond which the second counts, n first and then c, in steps.
    ridges: Vec<Cell>,
    /// Bits of a place after the point.
    bits: u32,
    /// Corner of the first tile, in the region's unit.
    corner: [f64; 2],
    /// A step in the region's unit, and in scene units.
    step: [f64; 2],
    lost: f32,
}

/// One cell's numbers: the distance, less than half an f32 ulp off; both parts of the gradient, in steps; and half the
/// bend times a step, with what the distance lost in its lowest [`LOST_BITS`]. Where the distance is NaN, the next two
/// are the first of its circles among the ridges', and how many it has.
pub(crate) type Cell = [u32; 4];

/// The circle of a tile that is one cell, about its centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Circle {
    /// In steps.
    pub(crate) distance: f64,
    pub(crate) gradient: [f64; 2],
    /// One through the radius, in steps.
    pub(crate) bend: f64,
    /// How far the distance is from the circle's within the tile at most, in steps.
    pub(crate) error: f64,
}

/// What a run has among the ridges: two circles, and the line between them.
pub(crate) const PARTS: usize = 3;
/// Steps along a tile's side are 2 to the power of this.
pub(crate) const TILE: u32 = 2;
/// Bits of a tile's number that hold its level.
pub(crate) const LEVEL_BITS: u32 = 3;
/// Bits of a cell's bend that hold what its distance lost.
pub(crate) const LOST_BITS: u32 = 10;
/// The finest level: cells of a quarter of a step.
const FINEST: u32 = 4;
/// The most cells: 256 MiB.
const MOST_CELLS: usize = 1 << 24;
/// Bits of a place after the point, where the lattice leaves that many.
const MOST_BITS: u32 = 20;
/// Unit of what a distance lost, in steps.
const LOST: f64 = 1e-7;
/// Greatest share of |k| w, beyond which cells are divided whatever the rest.
const BENT: f64 = 0.2;
/// Rounding of a bend that is stored, as a share of it.
const BEND_ROUNDING: f64 = 1.0 / 16_384.0;
/// The cell of those who have none.
const NONE: Cell = [NAN, 0, 0, 0];
/// The distance of cells without a circle.
const NAN: u32 = 0x7fc0_0000;

impl CellTable {
    /// The cells of a field whose unit is `scale` scene units, each within `tolerance` region units of the distance;
    /// `None` where that takes too many.
    pub(crate) fn new(field: &MeridianField, scale: f64, tolerance: f64) -> Option<Self> {
        let (size, corner) = field.lattice();
        let [across, up] = size.map(|n| n.div_ceil(1 << TILE));
        let widest = across.max(up).next_power_of_two().ilog2() + TILE;
        let bits = MOST_BITS.min(30_u32.checked_sub(widest)?);
        let step = field.cell();
        // Whether there are too many does not depend on who counts them.
        let made = AtomicUsize::new(0);
        let rows: Vec<Tiles> = (0..up)
            .into_par_iter()
            .map(|row| {
                let mut tiles = Tiles::new(field, scale, tolerance);
                for column in 0..across {
                    let before = tiles.cells.len() + tiles.ridges.len();
                    if made.load(Ordering::Relaxed) <= MOST_CELLS {
                        tiles.add([column, row]);
                    }
                    let after = tiles.cells.len() + tiles.ridges.len();
                    made.fetch_add(after - before, Ordering::Relaxed);
                }
                tiles
            })
            .collect();
        let count = 1 + rows.iter().map(|r| r.cells.len()).sum::<usize>();
        if count > MOST_CELLS || made.into_inner() > MOST_CELLS {
            return None;
        }
        let mut cells = Vec::with_capacity(count);
        let mut tiles = Vec::with_capacity(across as usize * up as usize);
        let mut errors = Vec::with_capacity(across as usize * up as usize);
        let mut ridges = Vec::new();
        cells.push(NONE);
        for row in rows {
            let first = u32::try_from(cells.len()).ok()?;
            let first_ridge = u32::try_from(ridges.len()).ok()?;
            ridges.extend_from_slice(&row.ridges);
            #[allow(clippy::cast_possible_truncation, reason = "a bound, rounded upwards")]
            errors.extend(row.errors.iter().map(|e| (*e as f32).next_up()));
            cells.extend(row.cells.iter().map(|cell| match *cell {
                [NAN, first, count, rest] => [NAN, first_ridge + first, count, rest],
                cell => cell,
            }));
            tiles.extend(row.tiles.iter().map(|tile| match tile {
                Some([at, level]) => ((first + at) << LEVEL_BITS) | level,
                None => 0,
            }));
        }
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a small length; it only has to be the same everywhere"
        )]
        let lost = (LOST * step * scale / f64::from(1 << (32 - LOST_BITS))) as f32;
        Some(Self {
            tiles,
            errors,
            across,
            cells,
            ridges,
            bits,
            corner,
            step: [step, step * scale],
            lost,
        })
    }

    /// The tiles' numbers, and how many there are along r.
    pub(crate) fn tiles(&self) -> (&[u32], u32) {
        (&self.tiles, self.across)
    }

    /// The circle of a tile that is not divided; `None` where it is, or has none.
    pub(crate) fn whole_tile(&self, tile: usize) -> Option<Circle> {
        let error = f64::from(*self.errors.get(tile)?);
        let tile = *self.tiles.get(tile)?;
        let [distance, r, z, kept] = self.cells[(tile >> LEVEL_BITS) as usize];
        if tile & ((1 << LEVEL_BITS) - 1) != 0 || distance == NAN {
            return None;
        }
        let value = |bits: u32| f64::from(f32::from_bits(bits));
        let lost = f64::from((kept << (32 - LOST_BITS)).cast_signed()) * f64::from(self.lost);
        Some(Circle {
            distance: (value(distance) + lost) / self.step[1],
            gradient: [value(r), value(z)],
            bend: 2.0 * value(kept & !((1 << LOST_BITS) - 1)),
            error,
        })
    }

    /// All cells.
    pub(crate) fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The circles of a cell that has several, [`PARTS`] for each run, none for those without a circle.
    pub(crate) fn ridge(&self, cell: &Cell) -> &[Cell] {
        match *cell {
            [NAN, first, count, _] => &self.ridges[first as usize..(first + count) as usize],
            _ => &[],
        }
    }

    /// Bits of a place after the point.
    pub(crate) fn bits(&self) -> u32 {
        self.bits
    }

    /// Corner of the lattice, in the region's unit.
    pub(crate) fn corner(&self) -> [f64; 2] {
        self.corner
    }

    /// A step in the region's unit.
    pub(crate) fn region_step(&self) -> f64 {
        self.step[0]
    }

    /// A step in scene units.
    pub(crate) fn step(&self) -> f64 {
        self.step[1]
    }

    /// Places for a unit of the region.
    pub(crate) fn places(&self) -> f64 {
        f64::from(1_u32 << self.bits) / self.step[0]
    }

    /// What the bits of a bend stand for, as the lowest of a 32-bit number's highest, in scene units.
    pub(crate) fn lost(&self) -> f32 {
        self.lost
    }
}

/// A row of tiles while they are made.
struct Tiles<'a> {
    field: &'a MeridianField,
    scale: f64,
    tolerance: f64,
    /// First cell and level of each tile that has cells.
    tiles: Vec<Option<[u32; 2]>>,
    /// How far the circles of tiles that are not divided are off at most, in steps.
    errors: Vec<f64>,
    /// The same of the last circle, in the region's unit.
    error: f64,
    cells: Vec<Cell>,
    ridges: Vec<Cell>,
    /// The features nearest to the last cell's centre, one of each run of its leaf.
    near: Near,
}

type Feet = smallvec::SmallVec<[(u32, Local); MOST_RUNS]>;

#[derive(Debug, Default)]
struct Near {
    leaf: Option<u32>,
    features: smallvec::SmallVec<[u32; MOST_RUNS]>,
}

/// A circle, or several, and how far it is off within its cell at most, in the region's unit.
struct Bounded {
    cell: Cell,
    error: f64,
}

/// Why a cell has no circle.
enum Refusal {
    /// Its parts may have one.
    Divide,
    /// Nor would its parts.
    Never,
}

impl<'a> Tiles<'a> {
    fn new(field: &'a MeridianField, scale: f64, tolerance: f64) -> Self {
        Self {
            field,
            scale,
            tolerance,
            tiles: Vec::new(),
            errors: Vec::new(),
            error: f64::INFINITY,
            cells: Vec::new(),
            ridges: Vec::new(),
            near: Near::default(),
        }
    }

    /// Adds a tile, divided as far as it needs to be.
    fn add(&mut self, tile: [u32; 2]) {
        let (first, first_ridge) = (self.cells.len(), self.ridges.len());
        for level in 0..=FINEST {
            self.cells.truncate(first);
            self.ridges.truncate(first_ridge);
            if let Some(circles) = self.divided(tile, level) {
                let at = u32::try_from(first).unwrap_or(u32::MAX);
                self.tiles.push((circles > 0).then_some([at, level]));
                self.errors.push(self.error / self.field.cell());
                if circles == 0 {
                    self.cells.truncate(first);
                }
                return;
            }
        }
    }

    /// Adds the cells of a tile at one level, and tells how many of them have a circle; `None` where it has to be
    /// divided further.
    fn divided(&mut self, tile: [u32; 2], level: u32) -> Option<usize> {
        let (_, corner) = self.field.lattice();
        let step = self.field.cell();
        let side = step * f64::from(1 << TILE) / f64::from(1 << level);
        let mut circles = 0;
        for z in 0..1_u32 << level {
            for r in 0..1_u32 << level {
                // The field's cell that holds this one, or its first.
                let place = |c: u32| (c << TILE) >> level;
                let at = [(tile[0] << TILE) + place(r), (tile[1] << TILE) + place(z)];
                let Some((leaf, leaf_level)) = self.field.leaf_at(at) else {
                    self.cells.push(NONE);
                    continue;
                };
                if leaf_level + level < TILE {
                    return None;
                }
                let low = |c: usize, n: u32| {
                    corner[c] + step * f64::from(tile[c] << TILE) + side * f64::from(n)
                };
                let square = Square {
                    low: [low(0, r), low(1, z)],
                    side,
                };
                let cell = match self.circle(leaf, square, level == FINEST) {
                    Ok(Bounded { cell, error }) => {
                        circles += 1;
                        self.error = error;
                        cell
                    }
                    Err(Refusal::Divide) if level < FINEST => return None,
                    Err(_) => NONE,
                };
                self.cells.push(cell);
            }
        }
        Some(circles)
    }

    /// The circle of one cell, or where it is one of the `finest` all that may be nearest in it.
    fn circle(&mut self, number: u32, square: Square, finest: bool) -> Result<Bounded, Refusal> {
        let leaf: &Leaf = self.field.leaf(number);
        if !leaf.is_smooth() {
            return Err(Refusal::Never);
        }
        if self.near.leaf != Some(number) {
            self.near.leaf = Some(number);
            self.near.features = self.field.features(leaf).into();
        }
        let chain = self.field.chain();
        let centre = square.centre();
        let mut first = 0;
        let mut feet: Feet = smallvec::SmallVec::new();
        for (n, feature) in self.near.features.iter_mut().enumerate() {
            *feature = chain.walk(*feature, centre);
            feet.push((*feature, chain.local(*feature, centre)));
            if feet[n].1.value.abs() < feet[first].1.value.abs() {
                first = n;
            }
        }
        feet.swap(0, first);
        let cell = self.expanded(feet[0], square);
        if cell.is_none() && !finest {
            return Err(Refusal::Divide);
        }
        // Those that may be nearest somewhere in the cell, too.
        let rivals = || (feet[1..].iter()).filter(|f| !self.is_clear(feet[0], **f, square));
        if let (Some(circle), None) = (cell, rivals().next()) {
            return Ok(circle);
        }
        if !finest {
            return Err(Refusal::Divide);
        }
        let mut parts: smallvec::SmallVec<[[Cell; PARTS]; MOST_RUNS]> = smallvec::SmallVec::new();
        for foot in feet[..1].iter().chain(rivals()) {
            parts.push(self.split(*foot, square).ok_or(Refusal::Never)?);
        }
        let counted = |n: usize| u32::try_from(n).unwrap_or(0);
        let cell = [
            NAN,
            counted(self.ridges.len()),
            counted(parts.len() * PARTS),
            0,
        ];
        self.ridges.extend(parts.into_iter().flatten());
        Ok(Bounded {
            cell,
            error: f64::INFINITY,
        })
    }

    /// The circles of a run over a cell on both sides of the joint at which it bends most.
    fn split(&self, foot: (u32, Local), square: Square) -> Option<[Cell; PARTS]> {
        if let Some(Bounded { cell, .. }) = self.expanded(foot, square) {
            return Some([cell, cell, [0; 4]]);
        }
        let chain = self.field.chain();
        let (joint, departure) = chain.split(foot.0, &square.corners())?;
        let centre = square.centre();
        let near = self.within(foot.1, departure, square)?.cell;
        let far = self
            .within(chain.local(joint.next, centre), departure, square)?
            .cell;
        let [r, z] = joint.along;
        let off = r * (centre[0] - joint.at[0]) + z * (centre[1] - joint.at[1]);
        #[allow(
            clippy::cast_possible_truncation,
            reason = "either side is right near the line"
        )]
        let [r, z, off] = [r, z, off / self.field.cell()].map(|c| (c as f32).to_bits());
        Some([near, far, [r, z, off, 0]])
    }

    /// Whether one run is nearer than another all over a cell.
    fn is_clear(&self, near: (u32, Local), other: (u32, Local), square: Square) -> bool {
        let w = square.half_diagonal();
        let [(_, a), (_, b)] = [near, other];
        let gap = b.value.abs() - a.value.abs();
        if gap > 2.0 * w * (1.0 + 1e-9) + self.field.chain().margin() {
            return true;
        }
        // Neither changes its sign.
        if a.value.abs().min(b.value.abs()) <= w * (1.0 + 1e-9) {
            return false;
        }
        let [s, t] = [a, b].map(|l| l.value.signum());
        let slope =
            (t * b.gradient[0] - s * a.gradient[0]).hypot(t * b.gradient[1] - s * a.gradient[1]);
        let bend = |l: Local| {
            // Within the cell, the centre of curvature may be nearer by w.
            l.bend.abs() / (1.0 - (l.bend.abs() * w).min(1.0))
        };
        let least = w * (slope + 1e-9) + 0.5 * w * w * (bend(a) + bend(b));
        let chain = self.field.chain();
        let departures =
            || [near, other].map(|(feature, _)| chain.departure(feature, &square.corners()));
        // The sign is that of the surface that is nearer, not of its arc.
        let least = least + if s == t { 0.0 } else { chain.margin() };
        gap > least && gap > least + departures().iter().sum::<f64>()
    }

    /// The circle of a run over a cell, where it is within the tolerance.
    fn expanded(&self, (feature, local): (u32, Local), square: Square) -> Option<Bounded> {
        let departure = self.field.chain().departure(feature, &square.corners());
        self.within(local, departure, square)
    }

    /// A circle over a cell, where it is within the tolerance, and how far off it is at most.
    fn within(&self, local: Local, departure: f64, square: Square) -> Option<Bounded> {
        let w = square.half_diagonal();
        if local.bend.abs() * w > BENT {
            return None;
        }
        let half_bend = 0.5 * local.bend;
        let most = w + half_bend.abs() * w * w;
        let v = half_bend.abs() * most;
        let rest = 42.0 * most * v.powi(5) / (1.0 - 4.0 * v);
        let rounding = BEND_ROUNDING * half_bend.abs() * w * w;
        let error = departure + rest + rounding;
        (error <= self.tolerance).then(|| Bounded {
            cell: self.stored(local.value, local.gradient, half_bend),
            error,
        })
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "what is kept is f32, and what that loses a few bits"
    )]
    fn stored(&self, value: f64, gradient: [f64; 2], half_bend: f64) -> Cell {
        let step = self.field.cell();
        let distance = value * self.scale;
        let kept = distance as f32;
        let lost = (distance - f64::from(kept)) / (LOST * step * self.scale);
        let most = f64::from(1 << (LOST_BITS - 1)) - 1.0;
        let lost = lost.clamp(-most, most).round() as i32;
        let mask = (1_u32 << LOST_BITS) - 1;
        let bend = ((half_bend * step) as f32).to_bits();
        // Half of the last bit kept is added: the nearest is.
        let bend = (bend + (1 << (LOST_BITS - 1))) & !mask;
        [
            kept.to_bits(),
            (gradient[0] as f32).to_bits(),
            (gradient[1] as f32).to_bits(),
            bend | lost as u32 & mask,
        ]
    }
}

/// A cell's place.
#[derive(Clone, Copy)]
struct Square {
    low: [f64; 2],
    side: f64,
}

impl Square {
    fn centre(self) -> [f64; 2] {
        self.low.map(|c| c + 0.5 * self.side)
    }

    fn corners(self) -> [[f64; 2]; 4] {
        let ([a, b], side) = (self.low, self.side);
        [[a, b], [a + side, b], [a, b + side], [a + side, b + side]]
    }

    fn half_diagonal(self) -> f64 {
        self.side * 0.5_f64.sqrt()
    }
}

#[cfg(test)]
pub(in crate::region) mod tests {
    use super::*;
    use crate::math::Kernel;
    use crate::region::radial::tests::{numbers, regions, swept};
    use crate::region::{BoundaryPiece, Chain, DistanceSet, Extent};

    impl CellTable {
        /// The table's distance at a point of the lattice, in f64 from the numbers kept.
        fn at(&self, q: [f64; 2]) -> f64 {
            let steps: [f64; 2] = std::array::from_fn(|c| (q[c] - self.corner[c]) / self.step[0]);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "in the lattice"
            )]
            let tile = steps.map(|c| c as u32 >> TILE);
            let number = self.tiles[(tile[1] * self.across + tile[0]) as usize];
            let level = number & ((1 << LEVEL_BITS) - 1);
            let per_step = f64::from(1 << level) / f64::from(1 << TILE);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "in the tile"
            )]
            let at: [u32; 2] = std::array::from_fn(|c| {
                ((steps[c] - f64::from(tile[c] << TILE)) * per_step) as u32
            });
            let index = (number >> LEVEL_BITS) + (at[1] << level) + at[0];
            let cell = self.cells[index as usize];
            let q: [f64; 2] = std::array::from_fn(|c| {
                steps[c] - f64::from(tile[c] << TILE) - (f64::from(at[c]) + 0.5) / per_step
            });
            if cell[0] != NAN {
                return self.circle_at(cell, q);
            }
            let values = self.ridge(&cell).chunks(PARTS).map(|run| {
                let [r, z, off] = [0, 1, 2].map(|n| f64::from(f32::from_bits(run[2][n])));
                let beyond = r * q[0] + z * q[1] + off > 0.0;
                self.circle_at(run[usize::from(beyond)], q)
            });
            values.fold(f64::NAN, |m, v| if m.abs() < v.abs() { m } else { v })
        }

        fn circle_at(&self, [d, gr, gz, kept]: Cell, q: [f64; 2]) -> f64 {
            let value = |b: u32| f64::from(f32::from_bits(b));
            let half_bend = value(kept & !((1 << LOST_BITS) - 1));
            let lost = f64::from((kept << (32 - LOST_BITS)).cast_signed()) * f64::from(self.lost);
            let e = value(gr) * q[0] + value(gz) * q[1] + half_bend * (q[0] * q[0] + q[1] * q[1]);
            let v = half_bend * e;
            let series = 1.0 + v * (-1.0 + v * (2.0 + v * (-5.0 + v * 14.0)));
            value(d) + (lost + e * series * self.step[1])
        }
    }

    /// A part of the half-plane around a boundary, so many steps wide.
    pub(in crate::region) fn extent_of(swept: &[BoundaryPiece], voxels: f64) -> Extent {
        let (mut right, mut low, mut top) = (0.0_f64, 0.0_f64, 0.0_f64);
        for b in swept.iter().map(|b| b.piece.bounds()) {
            right = right.max(b.max[0]);
            low = low.min(b.min[1]);
            top = top.max(b.max[1]);
        }
        let side = right.max(top - low);
        Extent {
            r: [0.0, 1.3 * side],
            z: [low - 0.3 * side, top + 0.3 * side],
            cell: 1.3 * side / voxels,
        }
    }

    #[test]
    fn cells_are_within_their_tolerance_of_the_distance() {
        for (name, region) in regions() {
            for voxels in [40.0, 300.0, 900.0] {
                let swept = swept(&region);
                let exact = DistanceSet::new(swept.iter().map(|b| b.piece));
                let extent = extent_of(&swept, voxels);
                let step = extent.cell;
                let (arcs, cells) = (1.5e-5 * step, 4.5e-5 * step);
                let chain = Chain::new(&swept, arcs, 100_000, true).expect("few arcs");
                let features = chain.len();
                let began = std::time::Instant::now();
                let field = MeridianField::new(Kernel::default(), chain, extent).expect("a field");
                let built = began.elapsed();
                let began = std::time::Instant::now();
                let table = CellTable::new(&field, 1.0, cells).expect("a table");
                let filled = began.elapsed();
                let mut number = numbers(11);
                let (mut worst, mut none) = (0.0_f64, 0);
                let points = 60_000;
                for _ in 0..points {
                    let between = |[a, b]: [f64; 2], t: f64| a + t * (b - a);
                    let q = [between(extent.r, number()), between(extent.z, number())];
                    let found = table.at(q);
                    if found.is_nan() {
                        none += 1;
                        continue;
                    }
                    let truth = exact.distance(q, f64::INFINITY);
                    let inside = region.section().side_of(q[0], q[1]) != crate::math::Side::Outside;
                    assert!(
                        truth < 1e-4 * step || inside == (found < 0.0),
                        "{name} {voxels}: sign at {q:?}: {found}"
                    );
                    let error = (found.abs() - truth).abs();
                    worst = worst.max(error / step);
                    assert!(
                        error < arcs + cells + 1e-6 * step,
                        "{name} {voxels}: {found} for {truth} at {q:?}, step {step}"
                    );
                }
                eprintln!(
                    "{name:>9} {voxels:>5}: {features} features, field {built:?}, {} tiles, {} cells and {} ridges {filled:?}, {:.2}% have none, worst {worst:.1e} of a step",
                    table.tiles.len(),
                    table.cells.len(),
                    table.ridges.len(),
                    100.0 * f64::from(none) / f64::from(points)
                );
                // A coarse grid has detail in most of its tiles.
                assert!(
                    voxels < 100.0 || none < points / 50,
                    "{name} {voxels}: {none} of {points} have no cell"
                );
            }
        }
    }

    #[test]
    fn levels_fit_their_bits() {
        const { assert!(FINEST < 1 << LEVEL_BITS) };
        const { assert!(MOST_CELLS <= 1 << (32 - LEVEL_BITS)) };
    }
}
