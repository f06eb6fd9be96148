//! Surfaces and volumes at all points of a grid of parameters, by sum factorisation.
//!
//! On a tensor grid the sums over the directions are taken one after the other, the last direction
//! first, and what a plane or a row of the grid shares is taken once for it:
//!
//! ```text
//!   for each w:             A'_ij  = Σ_k N_k(w) A_ijk           (n_1 n_2) (r + 1) products
//!     for each v:           A''_i  = Σ_j N_j(v) A'_ij            n_1 (q + 1)
//!       for each u:         X      = Σ_i N_i(u) A''_i / Σ_i N_i(u) w''_i        p + 1
//! ```
//!
//! so that a point costs p + 1 products a coordinate and not (p + 1)(q + 1)(r + 1), and no basis
//! function is evaluated twice. The innermost sum runs over lanes of u-samples through the kernels of
//! [`tabulate`]; planes are shared out to threads.
//!
//! * Shapes: the answer is a structure of arrays, x, y and z apart, the first parameter fastest.
//! * Accuracy: γ(p + q + r + 4) of the largest coordinate beyond that of the basis functions. The
//!   numbers do not depend on the kernel or on the threads, bit for bit.
//! * Memory: the output, and for each thread one layer of the net.
//! * Source: S. Orszag, J. Comput. Phys. 37 (1980) 70–92 (sum factorisation).

use super::{BasisCache, BasisTable, Kernel, NurbsError, NurbsTensor, tabulate};
use rayon::prelude::*;
use std::sync::Arc;

/// Points that a piece of work has at least, where the grid allows it.
const LEAST_WORK: usize = 4096;

/// Homogeneous coordinates of a net in four lists: x, y, z and the weight.
type Columns = [Vec<f64>; 4];

impl<const N: usize> NurbsTensor<N> {
    /// The points at all combinations of the tables' parameters.
    ///
    /// * `kernel`: which inner loops; the numbers do not depend on it.
    /// * `tables`: one for each direction, of that direction's knot vector; see [`BasisCache`].
    /// * `out`: x, y and z in model units, each with one place for each combination, the first
    ///   parameter fastest.
    ///
    /// Sorted samples are quickest. Every sample of the grid is written.
    ///
    /// # Errors
    /// [`NurbsError::TableKnots`], [`NurbsError::Length`]; [`NurbsError::Weight`] when a mean of
    /// weights leaves the range of f64.
    ///
    /// ```
    /// # use voxlathe::nurbs::{BasisTable, Kernel, KnotVector, NurbsSurface};
    /// let kernel = Kernel::default();
    /// let line = KnotVector::bezier(1)?;
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let saddle = NurbsSurface::new([line.clone(), line.clone()], points, vec![1.0; 4])?;
    /// let u = BasisTable::new(&line, &[0.0, 0.5, 1.0], 0, kernel)?;
    /// let v = BasisTable::new(&line, &[0.5, 1.0], 0, kernel)?;
    /// let [mut x, mut y, mut z] = [[0.0; 6]; 3];
    /// saddle.evaluate_grid(kernel, [&u, &v], [&mut x, &mut y, &mut z])?;
    /// assert_eq!(z, [0.0, 0.25, 0.5, 0.0, 0.5, 1.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn evaluate_grid(
        &self,
        kernel: Kernel,
        tables: [&BasisTable; N],
        out: [&mut [f64]; 3],
    ) -> Result<(), NurbsError> {
        for (direction, (table, knots)) in tables.iter().zip(self.knots()).enumerate() {
            if table.knots() != knots {
                return Err(NurbsError::TableKnots { direction });
            }
        }
        let lengths = tables.map(|table| table.samples().len());
        let expected = lengths.iter().try_fold(1_usize, |n, &s| n.checked_mul(s));
        let expected = expected.unwrap_or(usize::MAX);
        for out in &out {
            if out.len() != expected {
                return Err(NurbsError::Length {
                    what: "a coordinate of the grid",
                    found: out.len(),
                    expected,
                });
            }
        }
        if expected == 0 {
            return Ok(());
        }
        let columns = self.columns();
        let grid = Grid {
            kernel,
            tables: &tables,
            counts: self.counts(),
        };
        let top = N.saturating_sub(1);
        if top == 0 {
            return grid.fill(0, &columns, out, &mut []);
        }
        let slab: usize = lengths[..top].iter().product();
        let [x, y, z] = out;
        x.par_chunks_mut(slab)
            .zip(y.par_chunks_mut(slab))
            .zip(z.par_chunks_mut(slab))
            .enumerate()
            .with_min_len(LEAST_WORK.div_ceil(slab))
            .try_for_each_init(
                || vec![Columns::default(); top + 1],
                |scratch, (sample, ((x, y), z))| {
                    let (mine, below) = scratch.split_at_mut(1);
                    grid.contract(top, sample, &columns, &mut mine[0]);
                    grid.fill(top - 1, &mine[0], [x, y, z], below)
                },
            )
    }

    /// The points at all combinations of the samples: x, y and z, the first parameter fastest.
    ///
    /// The tables of basis functions come from the cache, and stay there for the next call.
    ///
    /// * `samples`: parameters of each direction, inside its domain.
    ///
    /// # Errors
    /// Those of [`BasisTable::new`] and of [`evaluate_grid`](Self::evaluate_grid).
    ///
    /// ```
    /// # use voxlathe::nurbs::{BasisCache, KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let saddle = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// let [x, y, z] = saddle.sample_grid(&BasisCache::default(), [&[0.0, 0.5, 1.0], &[0.25]])?;
    /// assert_eq!((x, y, z), (vec![0.0, 0.5, 1.0], vec![0.25; 3], vec![0.0, 0.125, 0.25]));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn sample_grid(
        &self,
        cache: &BasisCache,
        samples: [&[f64]; N],
    ) -> Result<[Vec<f64>; 3], NurbsError> {
        let tables: Vec<Arc<BasisTable>> = (self.knots().iter().zip(samples))
            .map(|(knots, samples)| cache.table(knots, samples, 0))
            .collect::<Result<_, _>>()?;
        let total = samples.iter().map(|s| s.len()).product();
        let mut out = [vec![0.0; total], vec![0.0; total], vec![0.0; total]];
        let tables: [&BasisTable; N] = std::array::from_fn(|k| &*tables[k]);
        self.evaluate_grid(
            cache.kernel(),
            tables,
            out.each_mut().map(Vec::as_mut_slice),
        )?;
        Ok(out)
    }

    /// The homogeneous control points in four lists.
    fn columns(&self) -> Columns {
        let points = self.to_homogeneous();
        let column = |axis: usize| {
            let value = |h: &super::Homogeneous<3>| h.weighted.get(axis).copied().unwrap_or(h.weight);
            points.iter().map(value).collect()
        };
        std::array::from_fn(column)
    }
}

/// What all parts of a grid share.
struct Grid<'a, const N: usize> {
    kernel: Kernel,
    tables: &'a [&'a BasisTable; N],
    counts: [usize; N],
}

impl<const N: usize> Grid<'_, N> {
    /// The layer of a net of directions 0 to `k` at one sample of direction `k`: a net of the
    /// directions before it.
    fn contract(&self, k: usize, sample: usize, net: &Columns, layer: &mut Columns) {
        let table = self.tables[k];
        let p = table.knots().degree();
        let size: usize = self.counts[..k].iter().product();
        let first = table.spans()[sample] as usize - p;
        for (net, layer) in net.iter().zip(layer) {
            layer.clear();
            layer.resize(size, 0.0);
            for a in 0..=p {
                let factor = table.row(0, a).map_or(0.0, |row| row[sample]);
                let from = &net[(first + a) * size..][..size];
                for (sum, value) in layer.iter_mut().zip(from) {
                    *sum += factor * value;
                }
            }
        }
    }

    /// All points of directions 0 to `k`, for a net of these directions.
    fn fill(
        &self,
        k: usize,
        net: &Columns,
        out: [&mut [f64]; 3],
        scratch: &mut [Columns],
    ) -> Result<(), NurbsError> {
        let [x, y, z] = out;
        let Some((mine, below)) = scratch.split_first_mut().filter(|_| k > 0) else {
            let [a, b, c, weights] = net;
            return tabulate(
                self.kernel,
                self.tables[0],
                &[a, b, c],
                weights,
                &mut [x, y, z],
            );
        };
        let part: usize = (self.tables[..k].iter())
            .map(|table| table.samples().len())
            .product();
        let parts = x.chunks_mut(part).zip(y.chunks_mut(part)).zip(z.chunks_mut(part));
        for (sample, ((x, y), z)) in parts.enumerate() {
            self.contract(k, sample, net, mine);
            self.fill(k - 1, mine, [x, y, z], below)?;
        }
        Ok(())
    }
}
