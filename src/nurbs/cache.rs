//! Tables of basis functions at many parameters, kept and shared.
//!
//! Sampling a solid asks for the same basis functions over and over: every profile piece of degree
//! p is sampled at the same parameters of the same Bézier knot vector, and on a tensor grid each
//! direction has its own list. A table holds them by function, so that lanes run over samples:
//!
//! ```text
//!   span[s]                         k of sample s
//!   N[a][s]                         N_{k-p+a}(u_s), a = 0 ..= p
//!   N'[a][s], N''[a][s]             where asked for
//!
//!   point(s) = Σ_a N[a][s] A[k-p+a] / Σ_a N[a][s] w[k-p+a]
//! ```
//!
//! Neighbouring samples of one span form a run, the piece of work of the inner loops; a sorted list
//! has one run for each span and goes fastest. Runs shorter than four samples (an unsorted list)
//! take the plain loops.
//!
//! * Shapes: rows of `samples` values; each row starts on a 64-byte boundary.
//! * Accuracy: that of [`basis`](super::KnotVector::basis_functions), bit for bit. Sums are taken
//!   in index order without fused operations, the same on every machine.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., Algorithms A2.2, A2.3 and A4.1.

use super::Kernel;
use super::basis::SpanFactors;
use super::kernel::{Rows, scalar, wide};
use super::{KnotVector, NurbsError};
use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::ops::Range;
use std::sync::{Arc, PoisonError, RwLock};

/// f64 values in a 64-byte cache line.
const LINE: usize = 8;

/// Runs below this length take the plain loops: filling lanes costs more than it saves.
const LEAST_WIDE_RUN: usize = 4;

/// Basis functions, and derivatives up to the second, of one knot vector at a list of parameters.
#[derive(Debug)]
pub struct BasisTable {
    knots: KnotVector,
    samples: Vec<f64>,
    order: usize,
    spans: Vec<u32>,
    runs: Vec<Run>,
    /// From a row to the next: the number of samples, rounded up to whole cache lines.
    stride: usize,
    /// Where the first row starts in `values`, which begin at any 8-byte boundary.
    offset: usize,
    values: Vec<f64>,
}

/// Neighbouring samples of one span.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// The span.
    pub(super) span: usize,
    /// The samples.
    pub(super) window: Range<usize>,
}

impl BasisTable {
    /// The highest derivative a table holds.
    pub const MAX_ORDER: usize = 2;

    /// The table of `knots` at `samples`, with derivatives up to `order`.
    ///
    /// * `samples`: parameters inside the domain, in any order; sorted ones are quickest.
    /// * `order`: 0 for values alone, 1 or 2 for derivatives too.
    /// * `kernel`: which inner loops; the numbers do not depend on it.
    ///
    /// # Errors
    /// [`NurbsError::SampleOutsideDomain`], [`NurbsError::DerivativeOrder`].
    ///
    /// # Source
    /// Piegl & Tiller, Algorithms A2.2 and A2.3.
    ///
    /// ```
    /// # use voxlathe::nurbs::{BasisTable, Kernel, KnotVector};
    /// let table = BasisTable::new(&KnotVector::bezier(2)?, &[0.0, 0.5, 1.0], 0, Kernel::default())?;
    /// assert_eq!(table.row(0, 1), Some(&[0.0, 0.5, 0.0][..]));
    /// assert_eq!(table.spans(), [2, 2, 2]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn new(
        knots: &KnotVector,
        samples: &[f64],
        order: usize,
        kernel: Kernel,
    ) -> Result<Self, NurbsError> {
        if order > Self::MAX_ORDER {
            return Err(NurbsError::DerivativeOrder {
                found: order,
                limit: Self::MAX_ORDER,
            });
        }
        let (spans, runs) = locate(knots, samples)?;
        let stride = samples.len().next_multiple_of(LINE);
        let rows = (order + 1) * (knots.degree() + 1);
        let mut values = vec![0.0; rows * stride + LINE - 1];
        // An offset is a matter of speed only: any value below a line would do.
        let offset = values.as_ptr().align_offset(LINE * size_of::<f64>()) % LINE;
        let mut out = Rows {
            values: &mut values[offset..],
            stride,
        };
        let mut factors: HashMap<usize, SpanFactors> = HashMap::new();
        for run in &runs {
            let factors = factors
                .entry(run.span)
                .or_insert_with(|| SpanFactors::new(knots, run.span));
            let (samples, first) = (&samples[run.window.clone()], run.window.start);
            match kernel.lanes() {
                Some(arch) if run.window.len() >= LEAST_WIDE_RUN => arch.dispatch(wide::Fill {
                    factors,
                    samples,
                    order,
                    rows: &mut out,
                    first,
                }),
                _ => scalar::fill(factors, samples, order, &mut out, first),
            }
        }
        Ok(Self {
            knots: knots.clone(),
            samples: samples.to_vec(),
            order,
            spans,
            runs,
            stride,
            offset,
            values,
        })
    }

    /// The knot vector.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The parameters, in the order given.
    #[must_use]
    pub fn samples(&self) -> &[f64] {
        &self.samples
    }

    /// The highest derivative held.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The knot span of each sample.
    #[must_use]
    pub fn spans(&self) -> &[u32] {
        &self.spans
    }

    /// The derivatives of `order` (0 for the values) of function `a` of each sample's span.
    ///
    /// * `a`: 0 to the degree; at sample s the function is number `spans()[s] - degree + a`.
    ///
    /// `None` when the table holds no such row.
    #[must_use]
    pub fn row(&self, order: usize, a: usize) -> Option<&[f64]> {
        let width = self.knots.degree() + 1;
        (order <= self.order && a < width).then(|| {
            let at = self.offset + (order * width + a) * self.stride;
            &self.values[at..at + self.samples.len()]
        })
    }

    /// The runs of samples of one span, in order; they hold all samples.
    pub(super) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// From a row to the next in [`rows`](Self::rows).
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// All rows of one order.
    pub(super) fn rows(&self, order: usize) -> &[f64] {
        let height = (self.knots.degree() + 1) * self.stride;
        &self.values[self.offset + order * height..][..height]
    }

    /// Whether this is the table for these arguments, bit for bit.
    fn answers(&self, knots: &KnotVector, samples: &[f64], order: usize) -> bool {
        let same = |a: &[f64], b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x.to_bits() == y.to_bits())
        };
        self.order == order
            && self.knots.degree() == knots.degree()
            && same(self.knots.knots(), knots.knots())
            && same(&self.samples, samples)
    }
}

/// The span of each sample, and the runs.
fn locate(knots: &KnotVector, samples: &[f64]) -> Result<(Vec<u32>, Vec<Run>), NurbsError> {
    let mut spans = Vec::with_capacity(samples.len());
    let mut runs: Vec<Run> = Vec::new();
    let mut guess = knots.degree();
    for (index, &u) in samples.iter().enumerate() {
        guess = knots.find_span_near(u, guess).map_err(|_| {
            let (start, end) = knots.domain();
            NurbsError::SampleOutsideDomain {
                index,
                parameter: u,
                start,
                end,
            }
        })?;
        spans.push(u32::try_from(guess).map_err(|_| NurbsError::Length {
            what: "the knot vector",
            found: knots.knots().len(),
            expected: u32::MAX as usize,
        })?);
        match runs.last_mut() {
            Some(run) if run.span == guess => run.window.end = index + 1,
            _ => runs.push(Run {
                span: guess,
                window: index..index + 1,
            }),
        }
    }
    Ok((spans, runs))
}

/// The sums Σ N c of control values at all samples of a table, or of a derivative of N.
///
/// No division is made: with the weights for control values this is w(u), with weighted
/// coordinates A(u), and with `order` above 0 their derivatives, from which
/// [`rational_derivatives`](super::rational_derivatives) gives those of the point.
///
/// * `order`: which derivative, at most the table's.
/// * `control`: one value for each control point.
/// * `out`: one place for each sample.
///
/// # Errors
/// [`NurbsError::DerivativeOrder`], [`NurbsError::Length`].
///
/// # Source
/// Piegl & Tiller, Algorithm A3.1, p. 82.
///
/// ```
/// # use voxlathe::nurbs::{BasisTable, Kernel, KnotVector, combine};
/// let kernel = Kernel::default();
/// let table = BasisTable::new(&KnotVector::bezier(2)?, &[0.0, 0.5, 1.0], 1, kernel)?;
/// let mut slope = [0.0; 3];
/// combine(kernel, &table, 1, &[0.0, 0.0, 4.0], &mut slope)?; // the derivative of 4 u^2
/// assert_eq!(slope, [0.0, 4.0, 8.0]);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn combine(
    kernel: Kernel,
    table: &BasisTable,
    order: usize,
    control: &[f64],
    out: &mut [f64],
) -> Result<(), NurbsError> {
    if order > table.order {
        return Err(NurbsError::DerivativeOrder {
            found: order,
            limit: table.order,
        });
    }
    check_length(
        "the control values",
        control.len(),
        table.knots.control_points(),
    )?;
    check_length("the output", out.len(), table.samples.len())?;
    let (basis, stride, p) = (table.rows(order), table.stride, table.knots.degree());
    for run in &table.runs {
        let control = &control[run.span - p..=run.span];
        let (first, out) = (run.window.start, &mut out[run.window.clone()]);
        match kernel.lanes() {
            Some(arch) if run.window.len() >= LEAST_WIDE_RUN => arch.dispatch(wide::Sum {
                basis,
                stride,
                first,
                control,
                out,
            }),
            _ => scalar::sum(basis, stride, first, control, out),
        }
    }
    Ok(())
}

/// The points of a rational spline at all samples of a table.
///
/// One table serves every spline over its knot vector: for Bézier pieces of degree p sampled alike,
/// make the table of [`KnotVector::bezier`] once and call this for each piece. A call allocates
/// nothing.
///
/// * `coordinates`: for each coordinate, the products w P of all control points (model units).
/// * `weights`: the weights w, greater than zero.
/// * `out`: for each coordinate, one place for each sample; model units.
///
/// # Errors
/// [`NurbsError::Length`], [`NurbsError::Weight`].
///
/// # Source
/// Piegl & Tiller, Algorithm A4.1, p. 124.
///
/// ```
/// # use voxlathe::nurbs::{BasisTable, Kernel, KnotVector, tabulate};
/// // A quarter circle: (1, 0), (1, 1), (0, 1) with weights 1, 1, 2.
/// let kernel = Kernel::default();
/// let table = BasisTable::new(&KnotVector::bezier(2)?, &[0.0, 0.25, 1.0], 0, kernel)?;
/// let (mut x, mut y) = ([0.0; 3], [0.0; 3]);
/// tabulate(
///     kernel,
///     &table,
///     &[&[1.0, 1.0, 0.0], &[0.0, 1.0, 2.0]],
///     &[1.0, 1.0, 2.0],
///     &mut [&mut x, &mut y],
/// )?;
/// assert_eq!((x, y), ([1.0, 15.0 / 17.0, 0.0], [0.0, 8.0 / 17.0, 1.0]));
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
pub fn tabulate(
    kernel: Kernel,
    table: &BasisTable,
    coordinates: &[&[f64]],
    weights: &[f64],
    out: &mut [&mut [f64]],
) -> Result<(), NurbsError> {
    let control_points = table.knots.control_points();
    check_length("the weights", weights.len(), control_points)?;
    check_length("the list of outputs", out.len(), coordinates.len())?;
    for (control, out) in coordinates.iter().zip(out.iter()) {
        check_length(
            "a coordinate's control values",
            control.len(),
            control_points,
        )?;
        check_length("a coordinate's output", out.len(), table.samples.len())?;
    }
    for (index, &found) in weights.iter().enumerate() {
        if !(found > 0.0 && found.is_finite()) {
            return Err(NurbsError::Weight { index, found });
        }
    }
    let (basis, stride, p) = (table.rows(0), table.stride, table.knots.degree());
    let mut window_of_control = smallvec::SmallVec::<[&[f64]; 4]>::new();
    for run in &table.runs {
        let control = run.span - p..=run.span;
        window_of_control.clear();
        window_of_control.extend(coordinates.iter().map(|c| &c[control.clone()]));
        let (coordinates, weights) = (&window_of_control[..], &weights[control]);
        match kernel.lanes() {
            Some(arch) if run.window.len() >= LEAST_WIDE_RUN => arch.dispatch(wide::Project {
                basis,
                stride,
                window: run.window.clone(),
                coordinates,
                weights,
                out,
            }),
            _ => scalar::project(basis, stride, run.window.clone(), coordinates, weights, out),
        }
    }
    Ok(())
}

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), NurbsError> {
    if found == expected {
        Ok(())
    } else {
        Err(NurbsError::Length {
            what,
            found,
            expected,
        })
    }
}

/// Tables by knot vector, samples and order, made once and shared between threads.
///
/// Keys are compared bit for bit. A table is freed when the cache is cleared and nobody holds it;
/// the cache itself never forgets one, so a caller with ever new sample lists clears it.
#[derive(Debug, Default)]
pub struct BasisCache {
    kernel: Kernel,
    tables: RwLock<HashMap<u64, Vec<Arc<BasisTable>>>>,
}

impl BasisCache {
    /// An empty cache whose tables are made by `kernel`.
    #[must_use]
    pub fn new(kernel: Kernel) -> Self {
        Self {
            kernel,
            tables: RwLock::default(),
        }
    }

    /// The inner loops that make the tables.
    #[must_use]
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The table of `knots` at `samples` with derivatives up to `order`, made now if need be.
    ///
    /// Two threads that ask for a new table at once may both make it; both get the same one.
    ///
    /// # Errors
    /// Those of [`BasisTable::new`].
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use voxlathe::nurbs::{BasisCache, KnotVector};
    /// let cache = BasisCache::default();
    /// let knots = KnotVector::bezier(3)?;
    /// let first = cache.table(&knots, &[0.25, 0.75], 0)?;
    /// let again = cache.table(&knots, &[0.25, 0.75], 0)?;
    /// assert!(Arc::ptr_eq(&first, &again));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn table(
        &self,
        knots: &KnotVector,
        samples: &[f64],
        order: usize,
    ) -> Result<Arc<BasisTable>, NurbsError> {
        let key = key(knots, samples, order);
        let known = |tables: &HashMap<u64, Vec<Arc<BasisTable>>>| {
            tables
                .get(&key)?
                .iter()
                .find(|table| table.answers(knots, samples, order))
                .cloned()
        };
        // A panic while the lock is held leaves a map that is whole: the poison says nothing.
        if let Some(table) = known(&self.tables.read().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(table);
        }
        let table = Arc::new(BasisTable::new(knots, samples, order, self.kernel)?);
        let mut tables = self.tables.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(table) = known(&tables) {
            return Ok(table);
        }
        tables.entry(key).or_default().push(Arc::clone(&table));
        Ok(table)
    }

    /// How many tables are kept.
    #[must_use]
    pub fn len(&self) -> usize {
        let tables = self.tables.read().unwrap_or_else(PoisonError::into_inner);
        tables.values().map(Vec::len).sum()
    }

    /// Whether no table is kept.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets all tables; those in use live on with their users.
    pub fn clear(&self) {
        self.tables
            .write()
            .unwrap_or_else(PoisonError::into_inner)
            .clear();
    }
}

/// A hash of the bits of a table's arguments.
fn key(knots: &KnotVector, samples: &[f64], order: usize) -> u64 {
    let mut hasher = DefaultHasher::new();
    (knots.degree(), order, samples.len()).hash(&mut hasher);
    hasher.write(bytemuck::cast_slice(knots.knots()));
    hasher.write(bytemuck::cast_slice(samples));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::super::SimdLevel;
    use super::super::testing::{gamma, knot_vectors, parameter};
    use super::*;
    use crate::math::every_kernel;
    use proptest::prelude::*;

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|x| x.to_bits()).collect()
    }

    fn plain() -> Kernel {
        Kernel::new(SimdLevel::Scalar).expect("the plain loops are always there")
    }

    /// A knot vector with 0 to 67 parameters, sorted or not, some of them knots.
    fn questions() -> impl Strategy<Value = (KnotVector, Vec<f64>)> {
        (
            knot_vectors(1..=12),
            prop::collection::vec(0.0..=1.0_f64, 0..=67),
            any::<bool>(),
        )
            .prop_map(|(knots, at, sorted)| {
                let mut samples: Vec<f64> = at.iter().map(|&t| parameter(&knots, t)).collect();
                if sorted {
                    samples.sort_by(f64::total_cmp);
                }
                (knots, samples)
            })
    }

    proptest! {
        #[test]
        fn wide_equals_scalar((knots, samples) in questions(), order in 0..=2_usize) {
            let expected = BasisTable::new(&knots, &samples, order, plain()).expect("inside");
            for kernel in every_kernel() {
                let found = BasisTable::new(&knots, &samples, order, kernel).expect("inside");
                prop_assert_eq!(found.spans(), expected.spans());
                for q in 0..=order {
                    for a in 0..=knots.degree() {
                        let [f, e] = [&found, &expected].map(|t| bits(t.row(q, a).expect("held")));
                        prop_assert_eq!(f, e, "{:?}, order {}, function {}", kernel.level(), q, a);
                    }
                }
            }
        }

        #[test]
        fn wide_points_equal_scalar_points(
            (knots, samples) in questions(),
            seed in prop::collection::vec(0.1..10.0_f64, 64),
            coordinates in 0..=3_usize,
        ) {
            let n = knots.control_points();
            let column = |c: usize| -> Vec<f64> {
                (0..n).map(|i| seed[(7 * c + i) % 64] * if c > 0 { 20.0 } else { 1.0 }).collect()
            };
            let weights = column(0);
            let columns: Vec<_> = (1..=coordinates).map(column).collect();
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let table = BasisTable::new(&knots, &samples, 1, plain()).expect("inside");
            let points = |kernel| {
                let mut out = vec![vec![f64::NAN; samples.len()]; coordinates];
                let mut slices: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
                tabulate(kernel, &table, &columns, &weights, &mut slices).expect("lengths agree");
                let mut slope = vec![f64::NAN; samples.len()];
                combine(kernel, &table, 1, &weights, &mut slope).expect("lengths agree");
                (out.iter().map(|row| bits(row)).collect::<Vec<_>>(), bits(&slope))
            };
            let expected = points(plain());
            for kernel in every_kernel() {
                prop_assert_eq!(points(kernel), expected.clone(), "{:?}", kernel.level());
            }
        }

        #[test]
        fn table_equals_one_by_one((knots, samples) in questions()) {
            let table = BasisTable::new(&knots, &samples, 2, Kernel::default()).expect("inside");
            for (s, &u) in samples.iter().enumerate() {
                let basis = knots.basis_functions(u, 2).expect("inside");
                prop_assert_eq!(table.spans()[s] as usize, basis.span());
                for q in 0..=2 {
                    let row = basis.derivatives(q).expect("asked for");
                    for (a, value) in row.iter().enumerate() {
                        let held = table.row(q, a).expect("held")[s];
                        prop_assert_eq!(held.to_bits(), value.to_bits());
                    }
                }
            }
        }

        #[test]
        fn tables_reproduce_u((knots, samples) in questions()) {
            let table = BasisTable::new(&knots, &samples, 0, Kernel::default()).expect("inside");
            let mut out = vec![0.0; samples.len()];
            combine(Kernel::default(), &table, 0, &knots.greville_abscissae(), &mut out)
                .expect("lengths agree");
            let size = knots.knots().iter().fold(0.0_f64, |m, k| m.max(k.abs()));
            for (found, u) in out.iter().zip(&samples) {
                prop_assert!((found - u).abs() <= gamma(9 * knots.degree()) * size);
            }
        }
    }

    #[test]
    fn rows_start_on_cache_lines() {
        let samples: Vec<f64> = (0..37).map(|i| f64::from(i) / 36.0).collect();
        let knots = KnotVector::clamped_uniform(3, 9).expect("valid");
        let table = BasisTable::new(&knots, &samples, 1, plain()).expect("inside");
        for a in 0..=3 {
            let row = table.row(1, a).expect("held");
            assert_eq!(row.as_ptr().align_offset(64), 0);
        }
        assert!(table.row(2, 0).is_none() && table.row(0, 4).is_none());
    }

    #[test]
    fn wrong_questions_are_errors() {
        let knots = KnotVector::bezier(2).expect("valid");
        let new = |samples: &[f64], order| BasisTable::new(&knots, samples, order, plain());
        assert!(matches!(
            new(&[0.5, f64::NAN], 0),
            Err(NurbsError::SampleOutsideDomain { index: 1, .. })
        ));
        assert!(matches!(
            new(&[0.5], 3),
            Err(NurbsError::DerivativeOrder { found: 3, limit: 2 })
        ));
        let table = new(&[0.5, 0.6], 0).expect("inside");
        let control = [1.0, 2.0, 3.0];
        let mut out = [0.0; 2];
        assert!(combine(plain(), &table, 1, &control, &mut out).is_err());
        assert!(combine(plain(), &table, 0, &control[..2], &mut out).is_err());
        assert!(combine(plain(), &table, 0, &control, &mut out[..1]).is_err());
        let mut points = |weights: &[f64], columns: &[&[f64]], room: usize| {
            tabulate(plain(), &table, columns, weights, &mut [&mut out[..room]])
        };
        assert_eq!(points(&control, &[&control], 2), Ok(()));
        assert!(matches!(
            points(&[1.0, 0.0, 1.0], &[&control], 2),
            Err(NurbsError::Weight { index: 1, .. })
        ));
        assert!(points(&control, &[&control[..1]], 2).is_err());
        assert!(points(&control, &[&control], 1).is_err());
        assert!(points(&control, &[&control, &control], 2).is_err());
    }

    #[test]
    fn the_cache_tells_bits_apart() {
        let cache = BasisCache::new(plain());
        let knots = KnotVector::bezier(2).expect("valid");
        let get = |samples: &[f64], order| cache.table(&knots, samples, order).expect("inside");
        let a = get(&[0.0, 1.0], 0);
        assert!(!Arc::ptr_eq(&a, &get(&[-0.0, 1.0], 0)));
        assert!(!Arc::ptr_eq(&a, &get(&[0.0, 1.0], 1)));
        assert!(Arc::ptr_eq(&a, &get(&[0.0, 1.0], 0)));
        assert_eq!(cache.len(), 3);
        cache.clear();
        assert!(cache.is_empty());
        assert_eq!(a.samples(), [0.0, 1.0]);
    }

    #[test]
    fn threads_share_one_table() {
        let cache = BasisCache::default();
        let knots = KnotVector::clamped_uniform(3, 12).expect("valid");
        let samples: Vec<f64> = (0..=500).map(|i| f64::from(i) / 500.0).collect();
        let tables: Vec<_> = std::thread::scope(|scope| {
            let ask = || cache.table(&knots, &samples, 2).expect("inside");
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(ask)).collect();
            threads
                .into_iter()
                .map(|t| t.join().expect("no thread panics"))
                .collect()
        });
        assert!(tables.iter().all(|t| Arc::ptr_eq(t, &tables[0])));
        assert_eq!(cache.len(), 1);
    }
}
