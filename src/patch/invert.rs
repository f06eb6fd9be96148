//! Membership and preimages of points, from the cells' nets alone.
//!
//! ```text
//!   X(t) = p   iff   F(t) = A(t) - p W(t) = 0                          W > 0
//! ```
//!
//! 1. The tree names the leaves whose box holds p; most of them drop out by their hull, a box along
//!    the mean slopes.
//! 2. In a certified leaf there is one root at most, and it is proved to be inside the cell, outside
//!    the leaf, or within rounding of a face of the cell.
//! 3. In the last case the root is found again in double-double, at the exact point. What is 2^-88 of
//!    the unit from an outer face is `On`; an interior face has its gap for tolerance.
//! 4. In a leaf that could not be certified, boxes are halved until they are excluded, certified for
//!    this one point, or of no size: first in f64, then in double-double.
//!
//! Of several answers the strongest holds: inside a cell, on an outer face, on an interior face.
//! A point that only touches interior faces is inside.
//!
//! * Accuracy: every exclusion and every root is proved with the rounding counted. A box that ends
//!   step 4 holds a point of the solid within 2^-88 of p; after [`SOFT`] boxes within 2 eps of the
//!   unit. After [`HARD`] boxes (a map that is singular in a whole region) the rest is taken as
//!   touching. The unit is at most twice the size.
//! * Cost: step 2 allocates nothing.

use super::arc::Found;
use super::cells::{Cell, Cells};
use super::leaf::{self, Certificate, Hull, Leaf, Window};
use super::net::{self, Row};
use super::newton::{Limits, Located, Sample, dot, locate};
use super::shared::{Face, LEAST_SLACK};
use crate::math::tolerance::{ON_BOUNDARY, U, gamma};
use crate::math::{Dd, Real, Side};
use glam::DVec3;
use smallvec::SmallVec;

/// Boxes in f64 before a search is handed to double-double.
const QUICK: usize = 1024;

/// Boxes in double-double after which 2 eps is small enough.
const SOFT: usize = 256;

/// Boxes in double-double after which everything is small enough.
const HARD: usize = 8192;

/// Where a point of the solid comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preimage {
    /// Which volume.
    pub volume: usize,
    /// The parameters, in the domain of the volume's knots.
    pub parameters: [f64; 3],
}

/// What is known of a point so far.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    inside: bool,
    outer: bool,
    shared: bool,
    /// The lowest cell and its parameters.
    first: Option<(usize, [f64; 3])>,
}

impl Known {
    fn side(&self) -> Side {
        match (self.inside, self.outer, self.shared) {
            (true, ..) | (false, false, true) => Side::Inside,
            (false, true, _) => Side::On,
            (false, false, false) => Side::Outside,
        }
    }

    fn place(&mut self, cell: usize, t: [f64; 3]) {
        let before = self.first.is_none_or(|(c, s)| {
            let order = (0..3).fold(cell.cmp(&c), |o, k| o.then(t[k].total_cmp(&s[k])));
            order.is_lt()
        });
        if before {
            self.first = Some((cell, t));
        }
    }

    /// The point meets the marked faces of the cell.
    fn touch(&mut self, cell: &Cell, faces: [[bool; 2]; 3]) {
        let mut marked = 0;
        let mut outer = false;
        for k in 0..3 {
            for side in 0..2 {
                if faces[k][side] {
                    marked += 1;
                    outer |= cell.faces[k][side] == Face::Outer;
                }
            }
        }
        // One interior face has cells on both sides; edges depend on the other cells around them.
        let whole = marked == 1
            && (0..3).any(|k| {
                (0..2).any(|side| faces[k][side] && matches!(cell.faces[k][side], Face::Shared(_)))
            });
        self.inside |= whole || marked == 0;
        self.outer |= outer;
        self.shared |= !outer;
    }
}

/// A question, with the exact point once it is known.
struct Query<'a, E: FnOnce() -> [Dd; 3]> {
    cells: &'a Cells,
    point: [f64; 3],
    error: f64,
    exact: Option<E>,
    known: [Dd; 3],
    found: Known,
    /// Whether one cell that has the point inside is enough.
    one: bool,
}

/// A cell and a point, in f64 or in double-double.
struct Problem<'a, T> {
    index: usize,
    cell: &'a Cell,
    net: &'a [Row<T, 4>],
    point: [T; 3],
    /// Bound on the rounding of A - p W for the whole net.
    noise: f64,
    /// Relative rounding of one operation.
    roundoff: f64,
}

/// A box that is not decided.
struct Open<T> {
    window: Window,
    net: SmallVec<[Row<T, 4>; 64]>,
    splits: usize,
    /// Directions to split in, the longest first.
    order: SmallVec<[usize; 3]>,
}

/// What a box has to say.
#[allow(
    clippy::large_enum_variant,
    reason = "it is moved to the stack of boxes at once"
)]
enum Answer<T> {
    /// Nothing more.
    Closed,
    /// f64 does not suffice.
    Lost,
    /// Split it.
    Open(Open<T>),
}

impl Cells {
    /// Where a point lies relative to the solid.
    ///
    /// * `point`: in the coordinates of the nets.
    /// * `error`: bounds on its rounding.
    /// * `exact`: the point in double-double; asked for only where f64 does not decide.
    ///
    /// The answer is that of the exact point. A point that is not finite is outside.
    pub fn side(&self, point: DVec3, error: DVec3, exact: impl FnOnce() -> [Dd; 3]) -> Side {
        if self.ruled {
            match self.turned.find(point, error.abs().max_element()) {
                Found::At(_) => return Side::Inside,
                Found::Nowhere => return Side::Outside,
                Found::Unclear => {}
            }
        }
        self.ask(point, error, exact, true).side()
    }

    /// Where the point comes from: of several places the one in the first volume, in the first of its
    /// cells, with the least parameters. `None` outside the solid.
    ///
    /// Volumes [turned about an axis](Self::turned) are answered one parameter at a time; the place is mapped to
    /// within 64 eps (size + |P|) of the point, as that of [`Self::invert_in_space`] is.
    #[must_use]
    pub fn invert(&self, point: DVec3) -> Option<Preimage> {
        match self.turned.find(point, 0.0) {
            Found::At(found) => Some(found),
            Found::Nowhere => None,
            Found::Unclear => self.invert_in_space(point),
        }
    }

    /// [`Self::invert`] from the cells alone, in all three parameters together, whatever the nets are.
    #[must_use]
    pub fn invert_in_space(&self, point: DVec3) -> Option<Preimage> {
        let exact = || point.to_array().map(Dd::of);
        let (cell, t) = self.ask(point, DVec3::ZERO, exact, false).first?;
        let cell = self.cells.get(cell)?;
        Some(Preimage {
            volume: cell.volume,
            parameters: std::array::from_fn(|k| {
                let ([a, b], t) = (cell.domain[k], t[k].clamp(0.0, 1.0));
                if t < 1.0 { a + t * (b - a) } else { b }
            }),
        })
    }

    /// Asks all leaves around the point, or until one has it inside when `one` will do.
    fn ask(&self, point: DVec3, error: DVec3, exact: impl FnOnce() -> [Dd; 3], one: bool) -> Known {
        let (local, bound) = self.to_local(point, error);
        let mut query = Query {
            cells: self,
            point: local,
            error: bound,
            exact: Some(exact),
            known: [Dd::ZERO; 3],
            found: Known::default(),
            one,
        };
        if local.iter().all(|x| x.is_finite()) && bound.is_finite() {
            self.tree.visit(local, bound, |index| {
                query.leaf(&self.leaves[index]);
                one && query.found.inside
            });
        }
        query.found
    }
}

impl<E: FnOnce() -> [Dd; 3]> Query<'_, E> {
    /// The exact point, in the cells' coordinates.
    fn exactly(&mut self) -> [Dd; 3] {
        if let Some(exact) = self.exact.take() {
            self.known = self.cells.to_local_exact(exact());
        }
        self.known
    }

    #[inline]
    fn leaf(&mut self, leaf: &Leaf) {
        let Some(hull) = &leaf.hull else {
            self.search(leaf.cell, leaf.window);
            return;
        };
        let (p, m, by) = (self.point, hull.middle, &hull.certificate);
        let d = [p[0] - m[0], p[1] - m[1], p[2] - m[2]];
        let q = by.inverse.map(|r| dot(r, d));
        // Rounding of the difference and of the product; coordinates are at most 1 here.
        let off = by.rows.map(|r| r * (self.error + 16.0 * U));
        let [low, high] = hull.bounds;
        if (0..3).any(|k| q[k] < low[k] - off[k] || q[k] > high[k] + off[k]) {
            return;
        }
        if leaf.regular {
            self.regular(leaf, hull, q);
        } else {
            self.search(leaf.cell, leaf.window);
        }
    }

    /// Step 2.
    #[inline]
    fn regular(&mut self, leaf: &Leaf, regular: &Hull, q: [f64; 3]) {
        let cells = self.cells;
        let (cell, window, p) = (&cells.cells[leaf.cell], leaf.window, self.point);
        let Certificate { inverse, rows, .. } = regular.certificate;
        let noise = cell.noise + self.error;
        let limits = limits(cell, window, &regular.certificate, false, !self.one);
        let start = q.map(|q| 0.5 + q * regular.weight);
        // Leaves are wide enough for f64.
        let low = window.low.map(Real::f64);
        let located = locate(&limits, start, |x: [f64; 3]| {
            let t: [f64; 3] = std::array::from_fn(|k| low[k] + window.width[k] * x[k]);
            let h = net::value_and_slopes(&cell.net, cell.counts, t);
            let f: [[f64; 3]; 4] =
                std::array::from_fn(|i| std::array::from_fn(|c| h[i][c] - p[c] * h[i][3]));
            Sample {
                x: std::array::from_fn(|k| (t[k] - low[k]) / window.width[k]),
                value: inverse.map(|r| dot(r, f[0])),
                error: std::array::from_fn(|k| {
                    let size = (0..3).map(|c| (inverse[k][c] * f[0][c]).abs()).sum::<f64>();
                    rows[k] * noise + 4.0 * U * size
                }),
                slopes: std::array::from_fn(|k| {
                    inverse.map(|r| dot(r, f[k + 1]) * window.width[k])
                }),
            }
        });
        match located {
            Located::Nowhere => {}
            Located::Inside(x) => self.inside(leaf.cell, window, x),
            Located::Near(x, _) => {
                if !self.polish(leaf.cell, window, &regular.certificate, x) {
                    self.search(leaf.cell, window);
                }
            }
            Located::Unclear => self.search(leaf.cell, window),
        }
    }

    fn inside(&mut self, cell: usize, window: Window, x: [f64; 3]) {
        self.found.inside = true;
        self.found.place(cell, parameters(window, x));
    }

    /// Step 3: whether it came to a decision.
    fn polish(&mut self, index: usize, window: Window, by: &Certificate, start: [f64; 3]) -> bool {
        let p = self.exactly();
        let cells = self.cells;
        let cell = &cells.cells[index];
        let limits = limits(cell, window, by, true, !self.one);
        let located = locate(&limits, start.map(Dd::of), |x: [Dd; 3]| {
            let t: [Dd; 3] = std::array::from_fn(|k| {
                window.low[k] + x[k].scale_by_power_of_two(window.width[k])
            });
            let h = net::value_and_slopes(&cell.exact, cell.counts, t);
            let f: [[f64; 3]; 4] =
                std::array::from_fn(|i| std::array::from_fn(|c| (h[i][c] - p[c] * h[i][3]).f64()));
            Sample {
                x,
                value: by.inverse.map(|r| dot(r, f[0])),
                error: std::array::from_fn(|k| {
                    let size = (0..3)
                        .map(|c| (by.inverse[k][c] * f[0][c]).abs())
                        .sum::<f64>();
                    by.rows[k] * cell.exact_noise + 8.0 * U * size
                }),
                slopes: std::array::from_fn(|k| {
                    by.inverse.map(|r| dot(r, f[k + 1]) * window.width[k])
                }),
            }
        });
        match located {
            Located::Nowhere => {}
            Located::Inside(x) => self.inside(index, window, x),
            Located::Near(x, faces) => {
                self.found.touch(cell, faces);
                self.found.place(index, parameters(window, x));
            }
            Located::Unclear => return false,
        }
        true
    }

    /// Step 4.
    #[cold]
    #[inline(never)]
    fn search(&mut self, index: usize, window: Window) {
        let cells = self.cells;
        let cell = &cells.cells[index];
        let before = self.found;
        let quick = Problem {
            index,
            cell,
            net: &cell.net,
            point: self.point,
            noise: cell.noise + self.error,
            roundoff: U,
        };
        if self.halve(&quick, window) {
            return;
        }
        // The answer must not depend on how far f64 came.
        self.found = before;
        let exact = Problem {
            index,
            cell,
            net: &cell.exact,
            point: self.exactly(),
            noise: cell.exact_noise,
            roundoff: (-102.0_f64).exp2(),
        };
        let _ = self.halve(&exact, window);
    }

    /// Halves boxes of a window until all are decided; `false` when f64 does not suffice.
    ///
    /// A box is split in the direction that leaves the fewest halves open. Near a line where the map
    /// is singular every other choice doubles the boxes that meet the point.
    fn halve<T: Real>(&mut self, problem: &Problem<T>, window: Window) -> bool {
        let counts = problem.cell.counts;
        let mut whole: SmallVec<[Row<T, 4>; 64]> = SmallVec::from_slice(problem.net);
        for k in 0..3 {
            // The window of a leaf.
            let a = window.low[k].f64();
            net::restrict(&mut whole, counts, k, T::of(a), T::of(a + window.width[k]));
        }
        let mut boxes = 0;
        let mut stack: SmallVec<[Open<T>; 4]> = SmallVec::new();
        match self.examine(problem, window, whole, 6, &mut boxes) {
            Answer::Closed => {}
            Answer::Lost => return false,
            Answer::Open(open) => stack.push(open),
        }
        while let Some(open) = stack.pop() {
            let mut best: SmallVec<[Open<T>; 2]> = SmallVec::new();
            for (trial, &axis) in open.order.iter().enumerate() {
                let mut left: SmallVec<[Open<T>; 2]> = SmallVec::new();
                for side in [1, 0] {
                    let mut net = open.net.clone();
                    if side == 0 {
                        net::before(&mut net, counts, axis, T::of(0.5));
                    } else {
                        net::after(&mut net, counts, axis, T::of(0.5));
                    }
                    let half = open.window.half(axis, side);
                    match self.examine(problem, half, net, open.splits + 1, &mut boxes) {
                        Answer::Closed => {}
                        Answer::Lost => return false,
                        Answer::Open(open) => left.push(open),
                    }
                    if self.one && self.found.inside {
                        return true;
                    }
                }
                if trial == 0 || left.len() < best.len() {
                    best = left;
                }
                if best.len() < 2 {
                    break;
                }
            }
            stack.extend(best);
        }
        true
    }

    /// Decides a box, if it can be.
    fn examine<T: Real>(
        &mut self,
        problem: &Problem<T>,
        window: Window,
        net: SmallVec<[Row<T, 4>; 64]>,
        splits: usize,
        boxes: &mut usize,
    ) -> Answer<T> {
        let (cell, p, quick) = (problem.cell, problem.point, problem.roundoff == U);
        let counts = cell.counts;
        let most = counts[0].max(counts[1]).max(counts[2]);
        *boxes += 1;
        if quick && *boxes > QUICK {
            return Answer::Lost;
        }
        // Coordinates and |p| are at most 1 times the weight near the solid.
        let noise = problem.noise + 4.0 * problem.roundoff * (3 * most * splits) as f64;
        let y: leaf::LocalNet = (net.iter())
            .map(|h| {
                let at = |c: usize| (h[c] - p[c] * h[3]).f64();
                [at(0), at(1), at(2), h[3].f64()]
            })
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut weight = f64::INFINITY;
        for y in &y {
            for c in 0..3 {
                low[c] = low[c].min(y[c]);
                high[c] = high[c].max(y[c]);
            }
            weight = weight.min(y[3]);
        }
        if (0..3).any(|c| low[c] > noise || high[c] < -noise) {
            return Answer::Closed;
        }
        let extent = (0..3).fold(0.0_f64, |m, c| m.max(high[c] - low[c])) / weight;
        if quick && extent < 1e3 * noise {
            return Answer::Lost;
        }
        let small =
            extent <= ON_BOUNDARY || *boxes > SOFT && extent <= 2.0 * f64::EPSILON || *boxes > HARD;
        if small {
            let faces = std::array::from_fn(|k| window.at_face(k));
            self.found.touch_small(cell, faces);
            self.found
                .place(problem.index, parameters(window, [0.5; 3]));
            return Answer::Closed;
        }
        if let Some((inverse, rows)) = leaf::frame(&y, counts) {
            let size = (0..3).fold(0.0_f64, |m, c| m.max(high[c]).max(-low[c]));
            let local = leaf::precondition(&y, &inverse);
            let error = rows.map(|r| r * (noise + 4.0 * U * size));
            let excluded = (0..3).any(|c| {
                local.iter().all(|b| b[c] > error[c]) || local.iter().all(|b| b[c] < -error[c])
            });
            if excluded {
                return Answer::Closed;
            }
            // With errors of this size nothing smaller will be decided in f64.
            if quick && error.iter().any(|&e| e > 0.03) {
                return Answer::Lost;
            }
            // The rows of DΦ sum to 1 + κ at most, and so wide is what the coefficients span.
            let wide = (0..3).any(|c| {
                let (low, high) =
                    (local.iter()).fold((0.0_f64, 0.0_f64), |(l, h), b| (l.min(b[c]), h.max(b[c])));
                high - low > 1.0 + leaf::MAX_KAPPA
            });
            if !wide {
                let (kappa, _) = leaf::bend(&local, counts, window.growth(), [0.0; 3], error);
                if kappa <= leaf::MAX_KAPPA {
                    let by = Certificate {
                        inverse,
                        rows,
                        kappa,
                    };
                    if self.certified(problem.index, window, &by, &local, error) {
                        return Answer::Closed;
                    }
                }
            }
        }
        // Sides much shorter than the longest can wait, whatever their halves do: else a box that has
        // the point in its middle would stay as long as it is.
        let extents = leaf::extents(&y, counts);
        let longest = extents[leaf::largest(extents)];
        let mut order: SmallVec<[usize; 3]> =
            (0..3).filter(|&k| extents[k] * 256.0 >= longest).collect();
        order.sort_by(|&a, &b| extents[b].total_cmp(&extents[a]));
        Answer::Open(Open {
            window,
            net,
            splits,
            order,
        })
    }

    /// Decides a box on which the map is certified for this point; `false` when rounding prevents it.
    fn certified(
        &mut self,
        index: usize,
        window: Window,
        by: &Certificate,
        local: &[Row<f64, 4>],
        error: [f64; 3],
    ) -> bool {
        let cells = self.cells;
        let cell = &cells.cells[index];
        let counts = cell.counts;
        let mut size = [0.0_f64; 3];
        for b in local {
            for c in 0..3 {
                size[c] = size[c].max(b[c].abs());
            }
        }
        let degrees: usize = counts.iter().map(|n| n - 1).sum();
        // E reaches 1/16 outside, where the basis sums to (9/8)^p at most, in absolute values.
        let stretch = 1.125_f64.powf(degrees as f64);
        let round = gamma((4 * degrees + 8) as f64);
        let error: [f64; 3] = std::array::from_fn(|c| stretch * (error[c] + round * size[c]));
        let limits = limits(cell, window, by, false, !self.one);
        let located = locate(&limits, [0.5; 3], |x: [f64; 3]| {
            let h = net::value_and_slopes(local, counts, x);
            let part = |i: usize| [h[i][0], h[i][1], h[i][2]];
            Sample {
                x,
                value: part(0),
                error,
                slopes: [part(1), part(2), part(3)],
            }
        });
        match located {
            Located::Nowhere => true,
            Located::Inside(x) => {
                self.inside(index, window, x);
                true
            }
            Located::Near(x, _) => self.polish(index, window, by, x),
            Located::Unclear => false,
        }
    }
}

impl Known {
    /// A box of no size, or one that the bound on the work left over, meets the point.
    fn touch_small(&mut self, cell: &Cell, faces: [[bool; 2]; 3]) {
        let outer =
            (0..3).any(|k| (0..2).any(|side| faces[k][side] && cell.faces[k][side] == Face::Outer));
        self.outer |= outer;
        self.shared |= !outer;
    }
}

fn parameters(window: Window, x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| (window.low[k] + Dd::product(window.width[k], x[k])).f64())
}

/// The tolerances at the sides of a window, in its local coordinates.
#[inline]
fn limits(cell: &Cell, window: Window, by: &Certificate, exact: bool, refine: bool) -> Limits {
    // A length of 1 at the root is at most this in local coordinates, where W <= 1.
    let length = by.rows.map(|r| r / (1.0 - by.kappa));
    let on = length.map(|l| if exact { l * ON_BOUNDARY } else { 0.0 });
    let mut outside = [[0.0; 2]; 3];
    for k in 0..3 {
        let at = window.at_face(k);
        for side in 0..2 {
            if at[side] {
                outside[k][side] = match cell.faces[k][side] {
                    Face::Shared(gap) => length[k] * gap,
                    Face::Outer => on[k],
                    Face::Collapsed => length[k] * LEAST_SLACK,
                };
            }
        }
    }
    Limits {
        window,
        kappa: by.kappa,
        outside,
        on,
        refine,
    }
}
