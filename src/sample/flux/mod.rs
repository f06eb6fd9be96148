//! Volume fractions of a turned region whose axis is parallel to a grid axis.
//!
//! The field `F = K(ρ²) (x, y, 0)` of a layer ([`table`]) has the layer's solid height for its divergence, passes no
//! flux through planes that hold the axis, and does not jump at the surface. So a voxel's share is the flux through
//! its four sides, and of a wedge that through their parts within the wedge: caps add nothing.
//!
//! ```text
//!        y₁ +--E(y₁)--+
//!           |         |          V = E(x₁) - E(x₀) + E(y₁) - E(y₀)
//!        E(x₀)       E(x₁)
//!           |         |          each E serves the voxels on both sides
//!        y₀ +--E(y₀)--+
//!           x₀        x₁
//! ```
//!
//! In a row the distance from the axis grows from its nearest voxel to both ends: voxels within a band of constant
//! height are filled as runs, found by bisection, and only those that the surface may cross are integrated. Where the
//! axis is in the middle of the grid, half of the voxels are the mirror images of the others.
//!
//! * Units: lengths are the region's. The table of a layer and the field belong to that layer alone.
//! * Accuracy: within the error asked for and rounding, [`Table::bound`]; rounding is some ε R / h for voxels of side h
//!   at radius R.

mod lines;
mod part;
mod series;
mod table;
#[cfg(test)]
mod tests;

use self::lines::Lines;
use self::table::{Table, Wanted};
use super::layer::Cancel;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real};
use crate::solid::{Revolved, Turn};
use glam::DVec2;
use std::sync::OnceLock;

/// Asymmetry of the grid about the axis, in voxels, that counts as none: it is part of the rounding.
const ALIKE: f64 = 1e-13;

/// A stored fraction.
pub(super) trait Stored: Copy {
    fn of(share: f64) -> Self;
}

impl Stored for f32 {
    #[inline(always)]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a share is between 0 and 1"
    )]
    fn of(share: f64) -> Self {
        share as Self
    }
}

impl Stored for f64 {
    #[inline(always)]
    fn of(share: f64) -> Self {
        share
    }
}

/// The planes of a grid normal to one of its axes, from the body's axis.
#[derive(Debug, Clone)]
struct Planes {
    at: Vec<f64>,
    /// The least and the greatest square of each voxel's places.
    near: Vec<f64>,
    far: Vec<f64>,
    /// Where the body's axis is in the middle.
    mirrored: bool,
}

impl Planes {
    fn new(grid: &GridSpec, c: usize, axis: Dd, scale: Dd) -> Self {
        let at: Vec<f64> = (0..=grid.dims()[c])
            .map(|i| ((plane(grid, c, i) - axis) / scale).f64())
            .collect();
        let side = (at[1] - at[0]).abs();
        let pairs = at.iter().zip(at.iter().rev());
        let asymmetry = pairs.fold(0.0_f64, |m, (a, b)| m.max((a + b).abs()));
        let squares = |w: &[f64]| (w[0] * w[0], w[1] * w[1]);
        let near = |w: &[f64]| {
            let (a, b) = squares(w);
            if w[0] * w[1] <= 0.0 { 0.0 } else { a.min(b) }
        };
        let far = |w: &[f64]| {
            let (a, b) = squares(w);
            a.max(b)
        };
        Self {
            near: at.windows(2).map(near).collect(),
            far: at.windows(2).map(far).collect(),
            mirrored: asymmetry <= ALIKE * side,
            at,
        }
    }

    fn len(&self) -> usize {
        self.near.len()
    }

    /// The voxel nearest to the axis.
    fn nearest(&self) -> usize {
        let (low, high) = (0, self.len());
        self.at[low + 1..high].partition_point(|x| *x <= 0.0)
    }
}

/// Coordinate `c` of the planes between voxels.
fn plane(grid: &GridSpec, c: usize, i: usize) -> Dd {
    #[allow(clippy::cast_precision_loss, reason = "dimensions are below 2^31")]
    let steps = i as f64;
    Dd::of(grid.origin()[c]) + Dd::product(steps, grid.spacing()[c])
}

/// How a voxel lies to the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Within {
    All,
    Nothing,
    /// A cap may pass through it.
    Cut,
}

/// Half-planes through the axis, in the plane of a layer.
#[derive(Debug, Clone, Copy)]
struct Caps {
    /// From the first counter-clockwise to the second the turn is inside.
    directions: [DVec2; 2],
    reflex: bool,
}

impl Caps {
    fn holds(&self, p: DVec2) -> bool {
        let [s, e] = self.directions;
        let (left, right) = (s.perp_dot(p) > 0.0, p.perp_dot(e) > 0.0);
        if self.reflex {
            left || right
        } else {
            left && right
        }
    }

    /// How a voxel lies to the turn.
    fn of(&self, u: [f64; 2], v: [f64; 2]) -> Within {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| DVec2::new(u[i], v[j]));
        let far = u[0].abs().max(u[1].abs()) + v[0].abs().max(v[1].abs());
        let room = 1e-12 * (u[1] - u[0]).abs().max((v[1] - v[0]).abs()) + 8.0 * f64::EPSILON * far;
        for d in self.directions {
            let across = corners.map(|p| d.perp_dot(p));
            let ahead = corners.iter().any(|p| d.dot(*p) >= -room);
            if ahead && across.iter().any(|a| *a <= room) && across.iter().any(|a| *a >= -room) {
                return Within::Cut;
            }
        }
        if self.holds(0.5 * (corners[0] + corners[3])) {
            Within::All
        } else {
            Within::Nothing
        }
    }

    /// Calls `each` with the parts within the turn of the line at `a`, along the second coordinate if `second`.
    fn parts(&self, second: bool, a: f64, [from, to]: [f64; 2], mut each: impl FnMut(f64, f64)) {
        let point = |c: f64| {
            if second {
                DVec2::new(a, c)
            } else {
                DVec2::new(c, a)
            }
        };
        let mut cuts = [from, to, to, to];
        let mut count = 1;
        let meets = self.directions.map(|d| {
            let (along, across) = if second { (d.y, d.x) } else { (d.x, d.y) };
            // On the half-plane's side of the axis.
            if across * a > 0.0 {
                a * along / across
            } else {
                to
            }
        });
        let ordered = [meets[0].min(meets[1]), meets[0].max(meets[1])];
        for c in ordered {
            if c > cuts[count - 1] && c < to {
                cuts[count] = c;
                count += 1;
            }
        }
        cuts[count] = to;
        for k in 0..count {
            let (b, c) = (cuts[k], cuts[k + 1]);
            if self.holds(point(0.5 * (b + c))) {
                each(b, c);
            }
        }
    }
}

/// For each row the ends of stretches of voxels that lie to the turn alike.
fn stretches(caps: &Caps, [columns, rows]: &[Planes; 2]) -> Vec<Vec<(usize, Within)>> {
    let row = |v: &[f64]| {
        let mut ends: Vec<(usize, Within)> = Vec::new();
        for (i, u) in columns.at.windows(2).enumerate() {
            let within = caps.of([u[0], u[1]], [v[0], v[1]]);
            match ends.last_mut() {
                Some(last) if last.1 == within => last.0 = i + 1,
                _ => ends.push((i + 1, within)),
            }
        }
        ends
    };
    rows.at.windows(2).map(row).collect()
}

/// Fractions of one body on one grid.
#[derive(Debug)]
pub(super) struct FluxSampler {
    /// The grid axis that the body's is parallel to.
    axis: usize,
    /// Planes across it: along the rows, and from row to row.
    across: [Planes; 2],
    /// Heights of the planes along it, in the body's coordinates.
    heights: Vec<f64>,
    caps: Option<Caps>,
    /// For each row where stretches of voxels end that lie to the turn alike; empty for a full turn.
    turn: Vec<Vec<(usize, Within)>>,
    error: f64,
    /// The tables of all layers across the axis, made when they are asked for, where it lies in a layer of the grid.
    tables: Vec<OnceLock<Option<Table>>>,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct FluxScratch {
    /// Fluxes through the sides below and above a row.
    sides: [Vec<f64>; 2],
    lines: Lines,
    cuts: Vec<Cut>,
    row: Vec<f64>,
}

/// A voxel to integrate: the lines out of it and into it along the row, below and above it.
#[derive(Debug, Clone, Copy)]
struct Cut {
    voxel: usize,
    /// Before and after it along the row, below and above.
    lines: [u32; 4],
    /// Whether the sides below and above serve other rows.
    shared: bool,
}

/// What a layer came to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Filled {
    pub(super) sum: f64,
    /// Voxels that were integrated.
    pub(super) cut: u64,
    /// Bound of the error of a share.
    pub(super) bound: f64,
}

impl FluxSampler {
    /// The sampler of a body; `None` where its axis is not parallel to one of the grid's, or too far away for the
    /// rounding to leave anything.
    pub(super) fn new(body: &Revolved, grid: &GridSpec, error: f64) -> Option<Self> {
        let frame = body.frame();
        let along = frame.axis_exact(2);
        let parallel = |c: usize| (0..3).all(|o| o == c || along[o] == Dd::ZERO);
        let axis = (0..3).find(|&c| parallel(c))?;
        let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
        let (origin, scale) = (frame.origin_exact(), frame.scale_exact());
        let across = [u, v].map(|c| Planes::new(grid, c, origin[c], scale));
        let up = along[axis];
        let heights: Vec<f64> = (0..=grid.dims()[axis])
            .map(|i| ((plane(grid, axis, i) - origin[axis]) * up / scale).f64())
            .collect();
        let caps = match body.turn() {
            Turn::Full => None,
            Turn::Partial(wedge) => {
                let [x, y] = [0, 1].map(|i| frame.axis(i));
                let flat = |d: DVec2| {
                    let d = x * d.x + y * d.y;
                    DVec2::new(d[u], d[v])
                };
                let [s, e] = wedge.directions();
                let turned = flat(DVec2::X).perp_dot(flat(DVec2::Y)) < 0.0;
                let directions = if turned {
                    [flat(e), flat(s)]
                } else {
                    [flat(s), flat(e)]
                };
                Some(Caps {
                    directions,
                    reflex: wedge.is_reflex(),
                })
            }
        };
        let turn = caps.iter().flat_map(|c| stretches(c, &across)).collect();
        let kept = if axis == 2 { 0 } else { grid.dims()[axis] };
        Some(Self {
            axis,
            across,
            heights,
            caps,
            turn,
            error,
            tables: vec![OnceLock::new(); kept],
        })
    }

    fn table(&self, body: &Revolved, layer: usize) -> Option<Table> {
        let (a, b) = (self.heights[layer], self.heights[layer + 1]);
        let side = |p: &Planes| (p.at[1] - p.at[0]).abs();
        let reach = |p: &Planes| p.far.iter().fold(0.0_f64, |m, v| m.max(*v));
        let [u, v] = &self.across;
        let wanted = Wanted {
            heights: [a.min(b), a.max(b)],
            side: side(u).min(side(v)),
            reach: (reach(u) + reach(v)).sqrt(),
            error: self.error,
        };
        let mut pieces = Vec::new();
        body.boundary_near(wanted.heights[0], wanted.heights[1], 0.0, |p| {
            pieces.push(p);
        });
        Table::new(pieces.into_iter(), wanted)
    }

    /// Fills layer `k` of the grid, x fastest; `None` where a table cannot be had, or `cancel` says so, and nothing is
    /// right.
    pub(super) fn layer<T: Stored>(
        &self,
        (kernel, cancel): (Kernel, Option<Cancel<'_>>),
        body: &Revolved,
        k: usize,
        scratch: &mut FluxScratch,
        out: &mut [T],
    ) -> Option<Filled> {
        if self.axis == 2 {
            let table = self.table(body, k)?;
            return Some(self.normal_layer(kernel, &table, scratch, out));
        }
        self.lying_layer((kernel, cancel), body, k, scratch, out)
    }

    /// A layer normal to the body's axis.
    fn normal_layer<T: Stored>(
        &self,
        kernel: Kernel,
        table: &Table,
        scratch: &mut FluxScratch,
        out: &mut [T],
    ) -> Filled {
        let [columns, rows] = &self.across;
        let (nx, ny) = (columns.len(), rows.len());
        let mirrored = rows.mirrored && self.caps.is_none();
        let kept = if mirrored { ny.div_ceil(2) } else { ny };
        let mut filled = Filled {
            bound: table.bound,
            ..Filled::default()
        };
        scratch.reset(nx);
        for j in 0..kept {
            let (before, after) = out.split_at_mut((j + 1) * nx);
            let values = &mut before[j * nx..];
            let count = RowFlux::new(self, table, j).fill(kernel, scratch, values);
            scratch.next_row();
            filled.add(count);
            let twin = ny - 1 - j;
            if mirrored && twin != j {
                let start = (twin - j - 1) * nx;
                after[start..start + nx].copy_from_slice(values);
                filled.add(count);
            }
        }
        filled
    }

    /// A layer that the body's axis lies in.
    fn lying_layer<T: Stored>(
        &self,
        (kernel, cancel): (Kernel, Option<Cancel<'_>>),
        body: &Revolved,
        k: usize,
        scratch: &mut FluxScratch,
        out: &mut [T],
    ) -> Option<Filled> {
        let (n, layers) = (self.across[0].len(), self.tables.len());
        for (i, table) in self.tables.iter().enumerate() {
            if cancel.is_some_and(|cancel| cancel()) {
                return None;
            }
            table.get_or_init(|| self.table(body, i)).as_ref()?;
        }
        let mut filled = Filled::default();
        let mut values = std::mem::take(&mut scratch.row);
        values.resize(n, 0.0);
        for (i, table) in self.tables.iter().enumerate() {
            let table = table.get()?.as_ref()?;
            scratch.reset(n);
            filled.add(RowFlux::new(self, table, k).fill(kernel, scratch, &mut values));
            filled.bound = filled.bound.max(table.bound);
            // Rows run along x where the axis is along y, and from one x to the next where it is along x.
            if self.axis == 1 {
                for (out, value) in out[i * n..][..n].iter_mut().zip(&values) {
                    *out = T::of(*value);
                }
            } else {
                for (j, value) in values.iter().enumerate() {
                    out[j * layers + i] = T::of(*value);
                }
            }
        }
        scratch.row = values;
        Some(filled)
    }
}

impl Filled {
    fn add(&mut self, count: Count) {
        self.sum += count.sum;
        self.cut += count.cut;
    }
}

impl FluxScratch {
    fn reset(&mut self, n: usize) {
        for sides in &mut self.sides {
            sides.clear();
            sides.resize(n, f64::NAN);
        }
    }

    /// What was above is below.
    fn next_row(&mut self) {
        self.sides.swap(0, 1);
        self.sides[1].fill(f64::NAN);
    }
}

/// One row of a layer.
struct RowFlux<'a> {
    table: &'a Table,
    columns: &'a Planes,
    /// Places of the row's sides.
    v: [f64; 2],
    near: f64,
    far: f64,
    caps: Option<Caps>,
    turn: Option<&'a [(usize, Within)]>,
    per_area: f64,
}

impl<'a> RowFlux<'a> {
    fn new(sampler: &'a FluxSampler, table: &'a Table, j: usize) -> Self {
        let [columns, rows] = &sampler.across;
        let v = [rows.at[j], rows.at[j + 1]];
        Self {
            table,
            columns,
            v,
            near: rows.near[j],
            far: rows.far[j],
            caps: sampler.caps,
            turn: sampler.turn.get(j).map(Vec::as_slice),
            per_area: 1.0 / ((columns.at[1] - columns.at[0]) * (v[1] - v[0])),
        }
    }

    /// Fills the row.
    fn fill<T: Stored>(&self, kernel: Kernel, scratch: &mut FluxScratch, out: &mut [T]) -> Count {
        let n = self.columns.len();
        scratch.lines.clear();
        scratch.cuts.clear();
        let mut count = Count::default();
        if let Some(turn) = self.turn {
            let nearest = self.columns.nearest();
            let mut from = 0;
            for &(to, within) in turn {
                match within {
                    Within::Nothing => out[from..to].fill(T::of(0.0)),
                    Within::Cut => self.capped(scratch, from..to, out),
                    Within::All => {
                        let middle = nearest.clamp(from, to);
                        count.sum += self.outwards(scratch, middle..to, false, out);
                        count.sum += self.outwards(scratch, from..middle, true, out);
                    }
                }
                from = to;
            }
            count.add(self.integrate(kernel, scratch, out));
            return count;
        }
        if !self.columns.mirrored {
            let middle = self.columns.nearest();
            count.sum += self.outwards(scratch, middle..n, false, out);
            count.sum += self.outwards(scratch, 0..middle, true, out);
            count.add(self.integrate(kernel, scratch, out));
            return count;
        }
        // The middle voxel of an odd number is its own image.
        let half = n.div_ceil(2);
        count.sum += self.outwards(scratch, n / 2..half, false, out);
        count.add(self.integrate(kernel, scratch, out));
        scratch.lines.clear();
        scratch.cuts.clear();
        let mut right = Count {
            sum: self.outwards(scratch, half..n, false, out),
            cut: 0,
        };
        right.add(self.integrate(kernel, scratch, out));
        for i in half..n {
            out[n - 1 - i] = out[i];
        }
        count.add(right);
        count.add(right);
        count
    }

    /// Fills voxels on one side of the axis, from it to the end of the row or, if `down`, to its start: runs, whose sum
    /// is returned. Those that the surface may cross are listed.
    fn outwards<T: Stored>(
        &self,
        scratch: &mut FluxScratch,
        range: std::ops::Range<usize>,
        down: bool,
        out: &mut [T],
    ) -> f64 {
        let table = self.table;
        let (near, far) = (&self.columns.near, &self.columns.far);
        let length = range.len();
        let place = |step: usize| {
            if down {
                range.end - 1 - step
            } else {
                range.start + step
            }
        };
        let (mut band, mut step, mut sum) = (0, 0, 0.0);
        // The plane that was passed last, and its line.
        let mut passed = None;
        while step < length {
            let i = place(step);
            let low = near[i] + self.near;
            while table.breaks[band + 1] <= low {
                band += 1;
            }
            let (limit, here) = (table.breaks[band + 1], &table.bands[band]);
            if far[i] + self.far > limit || here.series.is_some() {
                self.voxel(scratch, i, down, &mut passed);
                step += 1;
                continue;
            }
            // Voxels further out, up to the band's end, are the same.
            let (mut same, mut other) = (step, length);
            while other - same > 1 {
                let middle = same + (other - same) / 2;
                if far[place(middle)] + self.far <= limit {
                    same = middle;
                } else {
                    other = middle;
                }
            }
            let (a, b) = (place(step), place(same));
            out[a.min(b)..=a.max(b)].fill(T::of(here.height));
            #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
            {
                sum += here.height * (same + 1 - step) as f64;
            }
            step = same + 1;
        }
        sum
    }

    /// Lists voxel `i` with its lines; `passed` is the plane between voxels that was passed last.
    fn voxel(
        &self,
        scratch: &mut FluxScratch,
        i: usize,
        down: bool,
        passed: &mut Option<(usize, u32)>,
    ) {
        let at = &self.columns.at;
        let (table, u) = (self.table, [at[i], at[i + 1]]);
        let lines = &mut scratch.lines;
        let mut through = |p: usize| {
            let line = lines.line(0.0);
            lines.add(table, line, at[p], self.v);
            line
        };
        let [inner, outer] = if down { [i + 1, i] } else { [i, i + 1] };
        let first = passed
            .filter(|p| p.0 == inner)
            .map_or_else(|| through(inner), |p| p.1);
        let last = through(outer);
        *passed = Some((outer, last));
        let known = scratch.sides[0][i];
        let below = if known.is_nan() {
            let line = lines.line(0.0);
            lines.add(table, line, self.v[0], u);
            line
        } else {
            lines.line(known)
        };
        let above = lines.line(0.0);
        lines.add(table, above, self.v[1], u);
        let [before, after] = if down { [last, first] } else { [first, last] };
        scratch.cuts.push(Cut {
            voxel: i,
            lines: [before, after, below, above],
            shared: true,
        });
    }

    /// Lists voxels that a cap may pass through, with the parts of their lines that are within the turn.
    fn capped<T: Stored>(
        &self,
        scratch: &mut FluxScratch,
        range: std::ops::Range<usize>,
        out: &mut [T],
    ) {
        let table = self.table;
        let Some(caps) = self.caps else {
            return;
        };
        for i in range {
            let (low, high) = (
                self.columns.near[i] + self.near,
                self.columns.far[i] + self.far,
            );
            let band = table.band(low);
            let here = &table.bands[band];
            if high <= table.breaks[band + 1] && here.series.is_none() && here.height == 0.0 {
                out[i] = T::of(0.0);
                continue;
            }
            let at = &self.columns.at;
            let (u, v) = ([at[i], at[i + 1]], self.v);
            let sides = [
                (true, u[0], v),
                (true, u[1], v),
                (false, v[0], u),
                (false, v[1], u),
            ];
            let lines = sides.map(|(second, a, ends)| {
                let line = scratch.lines.line(0.0);
                caps.parts(second, a, ends, |b, c| {
                    scratch.lines.add(table, line, a, [b, c]);
                });
                line
            });
            scratch.cuts.push(Cut {
                voxel: i,
                lines,
                shared: false,
            });
        }
    }

    /// Integrates what is listed.
    fn integrate<T: Stored>(
        &self,
        kernel: Kernel,
        scratch: &mut FluxScratch,
        out: &mut [T],
    ) -> Count {
        let FluxScratch {
            sides, lines, cuts, ..
        } = scratch;
        lines.integrate(kernel, self.table);
        let rounding = self.table.rounding;
        let mut sum = 0.0;
        for cut in &*cuts {
            let [before, after, below, above] = cut.lines.map(|l| lines.flux(l));
            if cut.shared {
                sides[1][cut.voxel] = above;
            }
            let share = ((after - before) + (above - below)) * self.per_area;
            // Without what rounding leaves of nothing and of all.
            let share = if share <= rounding {
                0.0
            } else if share >= 1.0 - rounding {
                1.0
            } else {
                share
            };
            sum += share;
            out[cut.voxel] = T::of(share);
        }
        Count {
            sum,
            cut: cuts.len() as u64,
        }
    }
}

/// What a part of a layer came to.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    sum: f64,
    cut: u64,
}

impl Count {
    fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.cut += other.cut;
    }
}
