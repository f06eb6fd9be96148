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
//! function is evaluated twice. The innermost sum runs over lanes of u-samples, with one division for a
//! point; planes are shared out to threads.
//!
//! * Shapes: the answer is a structure of arrays, x, y and z apart, the first parameter fastest.
//! * Accuracy: γ(p + q + r + 6) of the largest coordinate beyond that of the basis functions. The
//!   numbers do not depend on the kernel or on the threads, bit for bit.
//! * Memory: the output, and for each thread one layer of the net.
//! * Source: S. Orszag, J. Comput. Phys. 37 (1980) 70–92 (sum factorisation).

use super::kernel::{Curves, scalar, wide};
use super::{BasisCache, BasisTable, Kernel, NurbsError, NurbsTensor};
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
                    let Some((mine, below)) = scratch.split_first_mut() else {
                        return Ok(());
                    };
                    mine.iter_mut().for_each(Vec::clear);
                    grid.contract(top, sample, &columns, mine);
                    grid.fill(top - 1, mine, [x, y, z], below)
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
            let value =
                |h: &super::Homogeneous<3>| h.weighted.get(axis).copied().unwrap_or(h.weight);
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
    /// Appends to `layer` the layer of a net of directions 0 to `k` at one sample of direction `k`: a
    /// net of the directions before it.
    fn contract(&self, k: usize, sample: usize, net: &Columns, layer: &mut Columns) {
        let table = self.tables[k];
        let p = table.knots().degree();
        let size: usize = self.counts[..k].iter().product();
        let first = table.spans()[sample] as usize - p;
        for (net, layer) in net.iter().zip(layer) {
            let start = layer.len();
            layer.resize(start + size, 0.0);
            for a in 0..=p {
                let factor = table.row(0, a).map_or(0.0, |row| row[sample]);
                let from = &net[(first + a) * size..][..size];
                for (sum, value) in layer[start..].iter_mut().zip(from) {
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
        let Some((mine, below)) = scratch.split_first_mut().filter(|_| k > 0) else {
            return self.curves(net, out);
        };
        let [x, y, z] = out;
        if k == 1 {
            // All curves of the sheet in one go.
            mine.iter_mut().for_each(Vec::clear);
            for sample in 0..self.tables[1].samples().len() {
                self.contract(1, sample, net, mine);
            }
            return self.curves(mine, [x, y, z]);
        }
        let part: usize = (self.tables[..k].iter())
            .map(|table| table.samples().len())
            .product();
        let parts = x
            .chunks_mut(part)
            .zip(y.chunks_mut(part))
            .zip(z.chunks_mut(part));
        for (sample, ((x, y), z)) in parts.enumerate() {
            mine.iter_mut().for_each(Vec::clear);
            self.contract(k, sample, net, mine);
            self.fill(k - 1, mine, [x, y, z], below)?;
        }
        Ok(())
    }

    /// The points of curves in direction 0 that stand one after the other in `net`.
    fn curves(&self, net: &Columns, out: [&mut [f64]; 3]) -> Result<(), NurbsError> {
        let usable = |w: f64| w > 0.0 && w.is_finite();
        if let Some(index) = net[3].iter().position(|&w| !usable(w)) {
            return Err(NurbsError::Weight {
                index,
                found: net[3][index],
            });
        }
        let table = self.tables[0];
        let curves = Curves {
            basis: table.rows(0),
            stride: table.stride(),
            runs: table.runs(),
            degree: table.knots().degree(),
            control_points: self.counts[0],
            samples: table.samples().len(),
            net: net.each_ref().map(Vec::as_slice),
        };
        match self.kernel.lanes() {
            Some(arch) => arch.dispatch(wide::CurvePoints {
                curves: &curves,
                out,
            }),
            None => scalar::curves(&curves, out),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::net::indices;
    use super::super::tensor_testing::{extent, inside, maps};
    use super::super::testing::{gamma, gap};
    use super::super::{KnotVector, NurbsSurface, SimdLevel};
    use super::*;
    use crate::math::every_kernel;
    use proptest::prelude::*;

    fn plain() -> Kernel {
        Kernel::new(SimdLevel::Scalar).expect("the plain loops are always there")
    }

    fn bits(points: &[Vec<f64>; 3]) -> Vec<u64> {
        points.iter().flatten().map(|x| x.to_bits()).collect()
    }

    /// The grid by every kernel, against the plain loops bit for bit and `evaluate` within rounding.
    fn check<const N: usize>(
        map: &NurbsTensor<N>,
        fractions: &[Vec<f64>],
    ) -> Result<(), TestCaseError> {
        let samples: Vec<Vec<f64>> = (0..N)
            .map(|k| {
                fractions[k]
                    .iter()
                    .map(|&t| inside(map, [t; N])[k])
                    .collect()
            })
            .collect();
        let lists = std::array::from_fn(|k| samples[k].as_slice());
        let expected = map
            .sample_grid(&BasisCache::new(plain()), lists)
            .expect("inside");
        for kernel in every_kernel() {
            let found = map
                .sample_grid(&BasisCache::new(kernel), lists)
                .expect("inside");
            prop_assert_eq!(bits(&found), bits(&expected), "{:?}", kernel.level());
        }
        let bound = extent(map) * 4.0 * gamma(100);
        for (i, index) in indices(lists.map(<[f64]>::len)).enumerate() {
            let at = std::array::from_fn(|k| lists[k][index[k]]);
            let point = map.evaluate(at).expect("inside");
            let found = [expected[0][i], expected[1][i], expected[2][i]];
            prop_assert!(
                gap(found, point) <= bound,
                "{at:?}: {found:?} for {point:?}"
            );
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn volumes_on_a_grid(
            map in maps::<3>(), sorted: bool,
            mut fractions in prop::collection::vec(prop::collection::vec(0.0..=1.0_f64, 0..=21), 3),
        ) {
            for list in &mut fractions {
                list.extend([0.0, 1.0]);
                if sorted {
                    list.sort_by(f64::total_cmp);
                }
            }
            check(&map, &fractions)?;
        }

        #[test]
        fn surfaces_on_a_grid(
            map in maps::<2>(),
            fractions in prop::collection::vec(prop::collection::vec(0.0..=1.0_f64, 0..=90), 2),
        ) {
            check(&map, &fractions)?;
        }
    }

    #[test]
    fn wrong_questions_are_errors() {
        let line = || KnotVector::bezier(1).expect("valid");
        let sheet =
            NurbsSurface::new([line(), line()], vec![[0.0; 3]; 4], vec![1.0; 4]).expect("valid");
        let cache = BasisCache::default();
        assert!(matches!(
            sheet.sample_grid(&cache, [&[0.5], &[0.5, 2.0]]),
            Err(NurbsError::SampleOutsideDomain { index: 1, .. })
        ));
        let empty = sheet
            .sample_grid(&cache, [&[], &[0.5]])
            .expect("an empty grid");
        assert!(empty.iter().all(Vec::is_empty));
        let kernel = Kernel::default();
        let table = BasisTable::new(&line(), &[0.5], 0, kernel).expect("inside");
        let other = KnotVector::bezier(2).expect("valid");
        let other = BasisTable::new(&other, &[0.5], 0, kernel).expect("inside");
        let [mut x, mut y, mut z] = [[0.0; 1]; 3];
        let wrong = sheet.evaluate_grid(kernel, [&table, &other], [&mut x, &mut y, &mut z]);
        assert_eq!(wrong, Err(NurbsError::TableKnots { direction: 1 }));
        let short = sheet.evaluate_grid(kernel, [&table, &table], [&mut x, &mut y, &mut []]);
        assert!(matches!(
            short,
            Err(NurbsError::Length {
                found: 0,
                expected: 1,
                ..
            })
        ));
    }
}
