//! Volume and moments of a NURBS volume, area of a NURBS surface.
//!
//! ```text
//!   V     = ∭ det J          ∭ x det J,  ∭ x x^T det J       over the parameters
//!   area  = ∬ |X_u x X_v|
//! ```
//!
//! Where a cell's weights are equal the map is polynomial, the integrands have degree 5 p - 1 at most
//! and a rule of 5 p / 2 points is exact. Elsewhere the rules are lengthened, and boxes halved, until
//! they agree. Collapsed edges and corners do no harm: det J is a smooth function there, and
//! |X_u x X_v| at worst one with a cone's tip, towards which boxes are halved.
//!
//! A cell is integrated about its own middle, and its moments shifted afterwards: a small ring far
//! away loses no digits that its control points have.
//!
//! * Units: model units to the powers 3, 4, 5 and 2.
//! * Accuracy: relative errors of about 1e-14 of the integrals of absolute values; the estimate
//!   tells.
//! * Work: two million points for a cell at most; then the best there is, with its estimate.
//! * Source: Press et al., *Numerical Recipes*, 3rd ed., §4.6 and §4.8.

use super::cell_quadrature::integrate_cells;
use super::tensor_derivatives::{cross, determinant};
use super::{Homogeneous, NurbsError, NurbsSurface, NurbsVolume};
use crate::math::dd::{Dd, Real};
use crate::math::quadrature::Integral;
use crate::math::tolerance::U;

/// Volume, first and second moments of a map, each with an estimate of its error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MapMoments {
    /// ∭ 1.
    pub volume: Integral,
    /// ∭ x, ∭ y, ∭ z.
    pub first: [Integral; 3],
    /// ∭ x x, ∭ x y, ..: a symmetric matrix.
    pub second: [[Integral; 3]; 3],
}

impl NurbsVolume {
    /// Volume and moments about the origin.
    ///
    /// Every orientation counts as positive: where the Jacobian determinant is negative throughout,
    /// the signs are turned. A map that folds counts its layers with their signs, and the sum comes
    /// out positive; [`orientation`](Self::orientation) tells.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when control points lie so far apart that their differences are
    /// not finite.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
    /// let line = || KnotVector::bezier(1);
    /// let corner = |i: u32| [f64::from(i & 1) * 2.0, f64::from(i >> 1 & 1) * 3.0, f64::from(i >> 2)];
    /// let knots = [line()?, line()?, line()?];
    /// let brick = NurbsVolume::new(knots, (0..8).map(corner).collect(), vec![1.0; 8])?;
    /// let moments = brick.moments()?;
    /// assert!((moments.volume.value - 6.0).abs() <= moments.volume.error);
    /// assert!((moments.second[0][1].value - 6.0 * 1.5).abs() <= moments.second[0][1].error);
    /// assert!(moments.volume.error < 1e-13);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn moments(&self) -> Result<MapMoments, NurbsError> {
        self.moments_about([0.0; 3])
    }

    /// Volume and moments about the point `origin`.
    ///
    /// # Errors
    /// Those of [`moments`](Self::moments).
    pub fn moments_about(&self, origin: [f64; 3]) -> Result<MapMoments, NurbsError> {
        let integrand = |value: Homogeneous<3>, slopes: &[Homogeneous<3>; 3]| {
            let w = value.weight;
            let x = value.to_point();
            let jacobian = determinant([value, slopes[0], slopes[1], slopes[2]]) / w.powi(4);
            let length = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            // The terms of the determinant, whose rounding is relative to their size.
            let terms: f64 = slopes
                .iter()
                .map(|h| {
                    let row = h.weighted.iter().map(|a| a * a).sum::<f64>().sqrt();
                    (row + h.weight.abs() * length) / w
                })
                .product();
            let [a, b, c] = x;
            let powers = [1.0, a, b, c, a * a, b * b, c * c, a * b, b * c, c * a];
            let size = |i: usize| match i {
                0 => terms,
                1..=3 => terms * length,
                _ => terms * length * length,
            };
            (powers.map(|p| p * jacobian), std::array::from_fn(size))
        };
        let parts = integrate_cells(self, integrand, [0, 1, 1, 1, 2, 2, 2, 2, 2, 2])?;
        let mut total = [Sum::default(); 10];
        for (cell, part) in &parts {
            let shift = std::array::from_fn(|i| cell[i] - origin[i]);
            for (total, part) in total.iter_mut().zip(shifted(part, shift)) {
                total.add(part);
            }
        }
        let sign = if total[0].value.f64() < 0.0 {
            -1.0
        } else {
            1.0
        };
        let value = |i: usize| Integral {
            value: sign * total[i].value.f64(),
            error: total[i].error,
        };
        const SECOND: [[usize; 3]; 3] = [[4, 7, 9], [7, 5, 8], [9, 8, 6]];
        Ok(MapMoments {
            volume: value(0),
            first: [value(1), value(2), value(3)],
            second: SECOND.map(|row| row.map(value)),
        })
    }
}

impl NurbsSurface {
    /// The area, counting parts that the map covers twice as often as it does.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when control points lie so far apart that their differences are
    /// not finite.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let points = vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 4.0], [3.0, 3.0, 4.0]];
    /// let knots = [KnotVector::bezier(1)?, KnotVector::bezier(1)?];
    /// let area = NurbsSurface::new(knots, points, vec![1.0; 4])?.area()?;
    /// assert!((area.value - 15.0).abs() <= area.error && area.error < 1e-12);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn area(&self) -> Result<Integral, NurbsError> {
        let integrand = |value: Homogeneous<3>, slopes: &[Homogeneous<3>; 2]| {
            let x = value.to_point();
            let slope = |h: &Homogeneous<3>| -> [f64; 3] {
                std::array::from_fn(|i| (h.weighted[i] - h.weight * x[i]) / value.weight)
            };
            let length = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let terms: f64 = slopes
                .iter()
                .map(|h| {
                    let row = h.weighted.iter().map(|a| a * a).sum::<f64>().sqrt();
                    (row + h.weight.abs() * length) / value.weight
                })
                .product();
            let [u, v] = slopes.each_ref().map(slope);
            let normal = cross(u, v);
            let area = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
            ([area], [terms])
        };
        let parts = integrate_cells(self, integrand, [0])?;
        let mut total = Sum::default();
        for (_, [part]) in parts {
            total.add(part);
        }
        Ok(Integral {
            value: total.value.f64(),
            error: total.error,
        })
    }
}

/// A sum of integrals that loses nothing but what its terms lack.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    value: Dd,
    error: f64,
}

impl Sum {
    fn add(&mut self, part: Integral) {
        self.value = self.value + Dd::of(part.value);
        self.error += part.error;
    }
}

/// Moments about another origin, `shift` from which the old one lies; in the order 1, x, y, z, xx,
/// yy, zz, xy, yz, zx.
fn shifted(part: &[Integral; 10], shift: [f64; 3]) -> [Integral; 10] {
    let combined = |terms: &[(f64, usize)]| {
        let mut sum = Sum::default();
        for &(factor, i) in terms {
            sum.value = sum.value + Dd::product(factor, part[i].value);
            sum.error += factor.abs() * (part[i].error + 4.0 * U * part[i].value.abs());
        }
        Integral {
            value: sum.value.f64(),
            error: sum.error,
        }
    };
    let second = |i: usize, j: usize, at: usize| {
        combined(&[
            (1.0, at),
            (shift[i], 1 + j),
            (shift[j], 1 + i),
            (shift[i] * shift[j], 0),
        ])
    };
    let first = |i: usize| combined(&[(1.0, 1 + i), (shift[i], 0)]);
    [
        part[0],
        first(0),
        first(1),
        first(2),
        second(0, 0, 4),
        second(1, 1, 5),
        second(2, 2, 6),
        second(0, 1, 7),
        second(1, 2, 8),
        second(2, 0, 9),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::KnotVector;
    use super::super::net::indices;
    use super::super::tensor_testing::{biquadratic, maps, octant, polar, sphere, torus, turned};
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// A value against the exact one: within its estimate, which is at most `relative` of `scale`.
    fn check(name: &str, found: Integral, exact: f64, scale: f64, relative: f64) {
        let off = (found.value - exact).abs();
        assert!(
            off <= found.error && found.error <= relative * scale,
            "{name}: {} for {exact}, off by {:e} of {scale}, estimate {:e}",
            found.value,
            off / scale,
            found.error / scale
        );
    }

    fn line() -> KnotVector {
        KnotVector::bezier(1).expect("valid")
    }

    #[test]
    fn solids_of_revolution_in_closed_form() {
        let (r, h) = (2.0, 5.0);
        for disc in [biquadratic(), polar()] {
            let cylinder = turned(&line(), &[([r, 0.0], 1.0), ([r, h], 1.0)], &disc);
            let found = cylinder.moments().expect("finite");
            let volume = PI * r * r * h;
            check("cylinder", found.volume, volume, volume, 1e-13);
            check("x", found.first[0], 0.0, volume * r, 1e-13);
            check("z", found.first[2], volume * h / 2.0, volume * h, 1e-13);
            check(
                "xx",
                found.second[0][0],
                volume * r * r / 4.0,
                volume * h * h,
                1e-13,
            );
            check("xy", found.second[0][1], 0.0, volume * h * h, 1e-13);
            check(
                "zz",
                found.second[2][2],
                volume * h * h / 3.0,
                volume * h * h,
                1e-13,
            );
            assert_eq!(found.second[0][2], found.second[2][0]);

            let cone = turned(&line(), &[([r, 0.0], 1.0), ([0.0, h], 1.0)], &disc);
            let found = cone.moments().expect("finite");
            let volume = PI * r * r * h / 3.0;
            check("cone", found.volume, volume, volume, 1e-13);
            check("z", found.first[2], volume * h / 4.0, volume * h, 1e-13);
            check(
                "xx",
                found.second[0][0],
                PI * r.powi(4) * h / 20.0,
                volume * h * h,
                1e-13,
            );

            let radius: f64 = 1.5;
            let ball = sphere(radius, &disc);
            let volume = 4.0 * PI * radius.powi(3) / 3.0;
            for ball in [&ball, &ball.reverse(2).expect("valid")] {
                let found = ball.moments().expect("finite");
                check("ball", found.volume, volume, volume, 1e-13);
                for i in 0..3 {
                    let exact = volume * radius * radius / 5.0;
                    check(
                        "xx",
                        found.second[i][i],
                        exact,
                        volume * radius * radius,
                        1e-13,
                    );
                }
            }
            // The six faces: two points, and the rim of the disc; its whole is the sphere.
            let faces = ball.boundary().expect("finite");
            let area = faces.map(|face| face.area().expect("finite"));
            let sum = area.iter().fold(Integral::default(), |sum, face| Integral {
                value: sum.value + face.value,
                error: sum.error + face.error,
            });
            // The polar disc's seam, twice a half disc, counts too.
            let polar = area[4].value + area[5].value > 0.1 && disc.points.len() > 9;
            let seam = if polar { PI * radius * radius } else { 0.0 };
            let exact = 4.0 * PI * radius * radius + seam;
            check("sphere", sum, exact, exact, 1e-11);
        }
        let (big, small) = (3.0_f64, 1.0_f64);
        let found = torus(big, small).moments().expect("finite");
        let volume = 2.0 * PI * PI * big * small * small;
        check("torus", found.volume, volume, volume, 1e-13);
        let axial = Integral {
            value: found.second[0][0].value + found.second[1][1].value,
            error: found.second[0][0].error + found.second[1][1].error,
        };
        let exact = volume * (big * big + 0.75 * small * small);
        check("torus about its axis", axial, exact, volume * 16.0, 1e-13);
        let area = torus(big, small)
            .boundary()
            .expect("finite")
            .map(|f| f.area().expect("finite"));
        let sum = area[..4]
            .iter()
            .fold(Integral::default(), |sum, f| Integral {
                value: sum.value + f.value,
                error: sum.error + f.error,
            });
        let exact = 4.0 * PI * PI * big * small;
        check("torus area", sum, exact, exact, 1e-12);
        check(
            "octant",
            octant().area().expect("finite"),
            PI / 2.0,
            PI / 2.0,
            1e-12,
        );
    }

    #[test]
    fn a_ring_far_away_keeps_its_digits() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        // The control points themselves are rounded to 1.2e-10 out there, a 2e-10th of the radius.
        let (big, small) = (1e6, 0.5);
        let found = torus(big, small).moments().expect("finite");
        let volume = 2.0 * PI * PI * big * small * small;
        let off = (found.volume.value - volume).abs() / volume;
        assert!(off < 1e-9, "{off:e}");
        // A block with exact corners: here nothing is lost at all.
        let corner = |i: u32| {
            [
                f64::from(i & 1),
                f64::from(i >> 1 & 1) * 2.0,
                f64::from(i >> 2),
            ]
        };
        let brick = NurbsVolume::new(
            [line(), line(), line()],
            (0..8).map(corner).collect(),
            vec![1.0; 8],
        )
        .expect("valid")
        .transform(&identity, &[1e6, -2e6, 0.5])
        .expect("finite");
        let found = brick
            .moments_about([1e6 + 0.5, -2e6 + 1.0, 1.0])
            .expect("finite");
        check("volume", found.volume, 2.0, 2.0, 1e-13);
        check("x", found.first[0], 0.0, 2.0, 1e-13);
        check("yy", found.second[1][1], 2.0 / 3.0, 1.0, 1e-12);
        let found = brick.moments().expect("finite");
        check(
            "x about the origin",
            found.first[0],
            2.0 * (1e6 + 0.5),
            2e6,
            1e-13,
        );
        let exact = 2.0 * ((1e6 + 0.5) * (1e6 + 0.5) + 1.0 / 12.0);
        check(
            "xx about the origin",
            found.second[0][0],
            exact,
            exact,
            1e-13,
        );
    }

    #[test]
    fn hard_weights_and_folded_signs() {
        // A block whose weights differ ten-thousandfold is still the block: x = w u / ((1 - u) + w u).
        let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
        let weights = (0..8).map(|i| if i & 1 == 1 { 1e4 } else { 1.0 }).collect();
        let cube = NurbsVolume::new(
            [line(), line(), line()],
            (0..8).map(corner).collect(),
            weights,
        )
        .expect("valid");
        let found = cube.moments().expect("finite");
        check("volume", found.volume, 1.0, 1.0, 1e-11);
        check("xx", found.second[0][0], 1.0 / 3.0, 1.0, 1e-11);
        let mirrored = cube.permute([1, 0, 2]).expect("a permutation");
        assert!(mirrored.jacobian([0.5; 3]).expect("inside").determinant < 0.0);
        check(
            "mirrored",
            mirrored.moments().expect("finite").volume,
            1.0,
            1.0,
            1e-11,
        );
    }

    #[test]
    fn areas_with_corners_and_tips() {
        // A flat disc, whose corners have parallel tangents, and a polar one with a collapsed edge.
        for disc in [biquadratic(), polar()] {
            let points = disc
                .points
                .iter()
                .map(|&([x, y], _)| [3.0 * x, 3.0 * y, 1.0])
                .collect();
            let weights = disc.points.iter().map(|&(_, w)| w).collect();
            let surface = NurbsSurface::new(disc.knots, points, weights).expect("valid");
            check(
                "disc",
                surface.area().expect("finite"),
                9.0 * PI,
                9.0 * PI,
                1e-12,
            );
        }
        // A folded strip: |J| has a crease inside, x = 4 u (1 - u) twice over [0, 1].
        let points = vec![
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [2.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let strip = NurbsSurface::new(
            [KnotVector::bezier(2).expect("valid"), line()],
            points,
            vec![1.0; 6],
        )
        .expect("valid");
        check("strip", strip.area().expect("finite"), 2.0, 2.0, 1e-11);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(6))]

        #[test]
        fn moments_follow_affine_maps(map in maps::<3>()) {
            // Weights that differ a hundredfold from one control point to the next take their time.
            prop_assume!(map.knots().iter().map(|k| k.spans().count()).product::<usize>() <= 3);
            let whole = map.moments().expect("finite");
            let matrix = [[2.0, 0.5, 0.0], [0.0, 1.0, -0.25], [1.0, 0.0, 1.5]];
            let image = map.transform(&matrix, &[0.0; 3]).expect("finite").moments().expect("finite");
            let determinant = 2.0 * 1.5 - 0.5 * 0.25;
            let expected = whole.volume.value * determinant;
            let error = whole.volume.error * determinant + image.volume.error;
            prop_assert!((image.volume.value - expected).abs() <= error,
                "{} for {expected}, {error:e}", image.volume.value);
            let expected = (0..3).map(|i| matrix[1][i] * whole.first[i].value).sum::<f64>() * determinant;
            let error: f64 = (0..3).map(|i| 2.0 * whole.first[i].error * determinant).sum::<f64>()
                + image.first[1].error;
            prop_assert!((image.first[1].value - expected).abs() <= error,
                "{} for {expected}, {error:e}", image.first[1].value);
        }
    }

    #[test]
    fn a_polynomial_map_is_integrated_exactly() {
        // x = u, y = v + u², z = w + u v: volume 1, ∭ z = ∫ w + u v = 3/4, ∭ y² = ∭ (v + u²)².
        let quadratic = || KnotVector::bezier(2).expect("valid");
        let square = [0.0, 0.0, 1.0];
        let half = |i: usize| i as f64 / 2.0;
        let points = indices([3, 3, 2])
            .map(|[i, j, k]| [half(i), half(j) + square[i], k as f64 + half(i) * half(j)]);
        let map = NurbsVolume::new(
            [quadratic(), quadratic(), line()],
            points.collect(),
            vec![0.7; 18],
        )
        .expect("valid");
        let found = map.moments().expect("finite");
        check("volume", found.volume, 1.0, 1.0, 1e-13);
        check("z", found.first[2], 0.75, 1.0, 1e-13);
        check(
            "yy",
            found.second[1][1],
            1.0 / 3.0 + 1.0 / 3.0 + 0.2,
            2.0,
            1e-13,
        );
    }
}
