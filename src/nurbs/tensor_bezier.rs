//! Surfaces and volumes cut into Bézier cells, and the six faces of a volume.
//!
//! A spline of N parameters is one rational polynomial map on each box of spans. Rows of the net are
//! turned into the Bézier points of all their spans, one direction after the other:
//!
//! ```text
//!   rows of n points  ->  rows of p s + 1 points, s spans    joints stand once
//!   cell (i, j, k)    =   points p_1 i .. p_1 (i + 1), p_2 j .. p_2 (j + 1), ..
//! ```
//!
//! Since a joint is one point of that net, neighbours share their layer bit for bit.
//!
//! * Shapes: cells in the order of their spans, the first parameter fastest.
//! * Accuracy: γ(5 (p_1 + .. + p_N)) of the largest coordinate for each control point.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §5.3; row by row as in §5.4.

use super::bezier::span_to_bezier;
use super::curve::bounds;
use super::jacobian::to_one;
use super::net::{Net, indices, map_rows, window};
use super::{
    BezierCell, Homogeneous, KnotSpan, KnotVector, NurbsError, NurbsSurface, NurbsTensor,
    NurbsVolume,
};

/// A Bézier cell of a surface or volume and the box of parameters it covers.
#[derive(Debug, Clone, PartialEq)]
pub struct CellPiece<const N: usize> {
    /// The map's parameters where the cell's are 0.
    pub start: [f64; N],
    /// The map's parameters where the cell's are 1.
    pub end: [f64; N],
    /// The cell.
    pub cell: BezierCell<N>,
}

impl<const N: usize> CellPiece<N> {
    /// The map's parameters at the cell's parameters `t`.
    #[must_use]
    pub fn parameters(&self, t: [f64; N]) -> [f64; N] {
        std::array::from_fn(|k| {
            // Both ends come out exactly.
            let (a, b) = (self.start[k], self.end[k]);
            if t[k] == 1.0 { b } else { a + t[k] * (b - a) }
        })
    }
}

/// One Bézier cell about an origin of its own.
#[derive(Debug)]
pub(super) struct CentredCell<const N: usize> {
    /// The origin: the middle of the control points that matter.
    pub(super) origin: [f64; 3],
    /// Homogeneous Bézier points about it.
    pub(super) points: Vec<Homogeneous<3>>,
    /// The same means taken of absolute values.
    pub(super) sizes: Vec<Homogeneous<3>>,
    /// Roundings in each: its error is at most γ of them times its size.
    pub(super) roundings: f64,
}

/// The boxes of spans with what of a Bézier net belongs to them.
#[derive(Debug)]
pub(super) struct Spans<const N: usize> {
    /// Number of cells along each parameter.
    pub(super) cells: [usize; N],
    spans: [Vec<KnotSpan>; N],
    degrees: [usize; N],
}

impl<const N: usize> Spans<N> {
    /// The spans of a map.
    pub(super) fn new(map: &NurbsTensor<N>) -> Self {
        let spans = (map.knots().each_ref()).map(|knots| knots.spans().collect::<Vec<_>>());
        Self {
            cells: spans.each_ref().map(Vec::len),
            spans,
            degrees: map.degrees(),
        }
    }

    /// The box of one cell.
    pub(super) fn bounds(&self, cell: [usize; N]) -> ([f64; N], [f64; N]) {
        (
            std::array::from_fn(|k| self.spans[k][cell[k]].start),
            std::array::from_fn(|k| self.spans[k][cell[k]].end),
        )
    }

    /// The control points of one cell.
    pub(super) fn points(
        &self,
        net: &Net<Homogeneous<3>, N>,
        cell: [usize; N],
    ) -> Vec<Homogeneous<3>> {
        let first = std::array::from_fn(|k| cell[k] * self.degrees[k]);
        window(net.0, &net.1, first, self.degrees.map(|p| p + 1))
    }
}

impl<const N: usize> NurbsTensor<N> {
    /// The Bézier cells, one for each box of spans that are not empty, the first parameter fastest.
    ///
    /// Neighbours share their control points bit for bit. Clamped, unclamped and periodic knot
    /// vectors will do.
    ///
    /// # Errors
    /// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`] when a mean leaves the range of f64.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let knots = [KnotVector::clamped_uniform(1, 3)?, KnotVector::bezier(1)?];
    /// let points = (0..6).map(|i| [f64::from(i % 3), f64::from(i / 3), 0.0]).collect();
    /// let cells = NurbsSurface::new(knots, points, vec![1.0; 6])?.to_bezier()?;
    /// assert_eq!(cells.len(), 2);
    /// assert_eq!((cells[1].start, cells[1].end), ([0.5, 0.0], [1.0, 1.0]));
    /// assert_eq!(cells[1].cell.evaluate([0.5, 0.5])?, [1.5, 0.5, 0.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn to_bezier(&self) -> Result<Vec<CellPiece<N>>, NurbsError> {
        let spans = Spans::new(self);
        let net = self.bezier_net(self.to_homogeneous());
        indices(spans.cells)
            .map(|index| {
                let (start, end) = spans.bounds(index);
                Ok(CellPiece {
                    start,
                    end,
                    cell: BezierCell::new(self.degrees(), spans.points(&net, index))?,
                })
            })
            .collect()
    }

    /// One cell about its own origin, so that its digits are those of its size, wherever it is.
    pub(super) fn centred_cell(
        &self,
        spans: &Spans<N>,
        cell: [usize; N],
    ) -> Result<CentredCell<N>, NurbsError> {
        let degrees = self.degrees();
        let index: [usize; N] = std::array::from_fn(|k| spans.spans[k][cell[k]].index);
        let first = std::array::from_fn(|k| index[k] - degrees[k]);
        let size = degrees.map(|p| p + 1);
        let near = window(self.counts(), self.control_points(), first, size);
        let weights = window(self.counts(), self.weights(), first, size);
        let (low, high) = bounds(near.iter().copied());
        let origin: [f64; 3] = std::array::from_fn(|i| 0.5 * low[i] + 0.5 * high[i]);
        // Weights of about 1, by a power of two: fourth powers of them stay within range.
        let greatest = weights.iter().fold(0.0_f64, |m, w| m.max(*w));
        let scale = to_one(greatest);
        let points: Vec<_> = (near.iter().zip(&weights))
            .map(|(p, &w)| {
                Homogeneous::from_point(std::array::from_fn(|i| p[i] - origin[i]), w * scale)
            })
            .collect();
        for (place, h) in points.iter().enumerate() {
            h.checked(place)?;
        }
        let sizes = points.iter().map(|h| Homogeneous {
            weighted: h.weighted.map(f64::abs),
            weight: h.weight,
        });
        let mut nets = [sizes.collect(), points];
        for k in 0..N {
            // The knots that the span depends on make a knot vector with this one span.
            let (p, u) = (degrees[k], self.knots()[k].knots());
            let local = KnotVector::new(p, u[index[k] - p..=index[k] + p + 1].to_vec())?;
            nets = nets.map(|net| map_rows(size, &net, k, |row| span_to_bezier(&local, row, p)).1);
        }
        let [sizes, points] = nets;
        Ok(CentredCell {
            origin,
            points,
            sizes,
            roundings: 5.0 * degrees.iter().sum::<usize>() as f64 + 2.0,
        })
    }

    /// The Bézier points of all cells in one net, for control points in homogeneous form.
    pub(super) fn bezier_net(&self, points: Vec<Homogeneous<3>>) -> Net<Homogeneous<3>, N> {
        (0..N).fold((self.counts(), points), |(counts, points), k| {
            let knots = &self.knots()[k];
            map_rows(counts, &points, k, |row| {
                let mut out: Vec<Homogeneous<3>> = Vec::new();
                for span in knots.spans() {
                    let control = span_to_bezier(knots, row, span.index);
                    out.extend_from_slice(&control[usize::from(!out.is_empty())..]);
                }
                out
            })
        })
    }
}

impl NurbsVolume {
    /// The six surfaces at the ends of the parameters: u at its start and end, v at its start and
    /// end, w at its start and end.
    ///
    /// They are the outer layers of the clamped net, bit for bit where the volume is clamped. Their
    /// parameters are ordered so that, where the Jacobian determinant is positive, the normal
    /// X_s × X_t points out of the volume:
    ///
    /// ```text
    ///   u start: (w, v)     v start: (u, w)     w start: (v, u)
    ///   u end:   (v, w)     v end:   (w, u)     w end:   (u, v)
    /// ```
    ///
    /// A face may be collapsed to a curve or a point (a face on an axis), and two faces may be glued
    /// to each other (the seam of a full turn): neither is taken out here.
    ///
    /// # Errors
    /// Those of [`clamp`](Self::clamp).
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
    /// let line = || KnotVector::bezier(1);
    /// let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
    /// let cube = NurbsVolume::new([line()?, line()?, line()?], (0..8).map(corner).collect(), vec![1.0; 8])?;
    /// let normals: Vec<_> = cube.boundary()?.iter().map(|face| face.normal([0.5, 0.5])).collect();
    /// assert_eq!(normals[0], Ok(Some([-1.0, 0.0, 0.0])));
    /// assert_eq!(normals[5], Ok(Some([0.0, 0.0, 1.0])));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn boundary(&self) -> Result<[NurbsSurface; 6], NurbsError> {
        let whole = self.clamp()?;
        let face = |face: usize| {
            let (direction, last) = (face / 2, face % 2 == 1);
            let mut first = [0; 3];
            let mut size = whole.counts();
            if last {
                first[direction] = size[direction] - 1;
            }
            size[direction] = 1;
            let counts = whole.counts();
            let surface = NurbsSurface::new(
                [[1, 2], [0, 2], [0, 1]][direction].map(|k: usize| whole.knots()[k].clone()),
                window(counts, whole.control_points(), first, size),
                window(counts, whole.weights(), first, size),
            )?;
            // In index order the layer at the end looks out for u and w, and in for v.
            if last == (direction == 1) {
                surface.permute([1, 0])
            } else {
                Ok(surface)
            }
        };
        Ok([face(0)?, face(1)?, face(2)?, face(3)?, face(4)?, face(5)?])
    }
}

#[cfg(test)]
mod tests {
    use super::super::net::place;
    use super::super::tensor_testing::{biquadratic, extent, maps, polar, sphere, torus};
    use super::super::testing::{gamma, gap};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn cells_are_the_map_and_share_their_layers(
            map in maps::<3>(), t in prop::array::uniform3(0.0..=1.0_f64),
        ) {
            let pieces = map.to_bezier().expect("finite");
            let counts = Spans::new(&map).cells;
            prop_assert_eq!(pieces.len(), counts.iter().product::<usize>());
            let bound = extent(&map) * 8.0 * gamma(150);
            for (index, piece) in indices(counts).zip(&pieces) {
                let at = piece.parameters(t);
                let found = piece.cell.evaluate(t).expect("inside");
                // The parameter is rounded: compare where its ulp is small in the span.
                let fine = (0..3).all(|k| piece.end[k] - piece.start[k] > 1e-3 * at[k].abs());
                if fine {
                    let expected = map.evaluate(at).expect("inside");
                    prop_assert!(gap(found, expected) <= bound + extent(&map) * 1e-11);
                }
                for k in 0..3 {
                    if index[k] + 1 == counts[k] {
                        continue;
                    }
                    let mut next = index;
                    next[k] += 1;
                    let next = &pieces[place(counts, next)];
                    prop_assert_eq!(piece.end[k].to_bits(), next.start[k].to_bits());
                    let size = piece.cell.counts();
                    for at in indices(size) {
                        if at[k] != 0 {
                            continue;
                        }
                        let mut last = at;
                        last[k] = size[k] - 1;
                        prop_assert_eq!(
                            piece.cell.control_points()[place(size, last)],
                            next.cell.control_points()[place(size, at)]
                        );
                    }
                }
            }
        }

        #[test]
        fn a_centred_cell_is_the_cell_moved(map in maps::<3>()) {
            let spans = Spans::new(&map);
            for (index, piece) in indices(spans.cells).zip(map.to_bezier().expect("finite")) {
                let cell = map.centred_cell(&spans, index).expect("finite");
                for (a, b) in cell.points.iter().zip(piece.cell.control_points()) {
                    let point = a.to_point();
                    let moved = std::array::from_fn(|i| point[i] + cell.origin[i]);
                    prop_assert!(gap(moved, b.to_point()) <= extent(&map) * 8.0 * gamma(120));
                }
            }
        }
    }

    #[test]
    fn a_turn_has_four_cells_and_a_ball_eight() {
        assert_eq!(torus(3.0, 1.0).to_bezier().expect("finite").len(), 4);
        assert_eq!(sphere(1.0, &polar()).to_bezier().expect("finite").len(), 8);
    }

    #[test]
    fn boundary_normals_look_out() {
        // A ball about the origin: on the faces that are not caps of zero radius, out is away
        // from it, whichever disc.
        let ball = sphere(2.0, &biquadratic());
        for (face, surface) in ball.boundary().expect("finite").iter().enumerate() {
            let cap = face < 2;
            assert_eq!(surface.area().expect("finite").value < 1e-20, cap);
            if cap {
                continue;
            }
            let middle = surface.domain().map(|(a, b)| 0.4 * a + 0.6 * b);
            let point = surface.evaluate(middle).expect("inside");
            let normal = surface.normal(middle).expect("inside").expect("regular");
            assert!(gap(normal, point.map(|x| x / 2.0)) < 1e-14, "face {face}");
        }
        // An unclamped block: every face's normal leaves the point in the middle behind.
        let knots = |n| super::super::KnotVector::unclamped_uniform(2, n).expect("valid");
        let points = indices([4, 5, 3]).map(|i| i.map(|i| i as f64 + 0.1 * (i * i) as f64));
        let block = NurbsVolume::new(
            [knots(4), knots(5), knots(3)],
            points.collect(),
            vec![1.0; 60],
        )
        .expect("valid");
        let inside = block.evaluate([0.5; 3]).expect("inside");
        for surface in block.boundary().expect("finite") {
            let point = surface.evaluate([0.5, 0.5]).expect("inside");
            let normal = surface
                .normal([0.5, 0.5])
                .expect("inside")
                .expect("regular");
            let out: f64 = (0..3).map(|i| normal[i] * (point[i] - inside[i])).sum();
            assert!(out > 0.3, "{normal:?}");
        }
    }

    #[test]
    fn flux_through_the_boundary_is_the_volume() {
        // ∬ x · n / 3 over the six faces, by a midpoint rule on each: an independent volume.
        let torus = torus(3.0, 1.0);
        let n = 96;
        let mut flux = 0.0;
        for surface in torus.boundary().expect("finite") {
            for [i, j] in indices([n, n]) {
                let at = [(i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64];
                let (x, [s, t]) = surface.gradient(at).expect("inside");
                let normal = super::super::tensor_derivatives::cross(s, t);
                flux += (0..3).map(|k| x[k] * normal[k]).sum::<f64>() / 3.0 / (n * n) as f64;
            }
        }
        let exact = torus.moments().expect("finite").volume.value;
        assert!((flux - exact).abs() < 3e-3 * exact, "{flux} for {exact}");
    }
}
