//! Exact moments of a turned and placed region.
//!
//! With (ξ, η, z) along the middle of the turn, across it and along the axis, and `h` half the angle,
//!
//! ```text
//!   V    = k₀ ∬ r              k₀ = 2 h          ∭ ξ  = k₁ ∬ r²        k₁ = 2 sin h
//!   ∭ z  = k₀ ∬ r z            ∭ z² = k₀ ∬ r z²  ∭ ξ z = k₁ ∬ r² z
//!   ∭ ξ² = k₂ ∬ r³             k₂ = h + sin h cos h
//!   ∭ η² = k₃ ∬ r³             k₃ = h - sin h cos h
//!   area = k₀ S + caps ∬ 1     ∭ η = ∭ ξ η = ∭ η z = 0
//! ```
//!
//! A full turn is `h = π`. Everything is taken about the point (ξ₀, 0, z_c), ξ₀ = r_c k₁ / k₀, amid
//! the turned ring, with r = r_c + ρ expanded: what cancels does so among the coefficients, before
//! any integral is multiplied. Then it moves to the centroid, all in double-double, and is rounded
//! once.
//!
//! * Units: the region's, until [`Ring::placed`] makes them the scene's.
//! * Source: ∭ f = ∬ r ∫ f dφ dr dz with ξ = r cos φ, η = r sin φ, |φ| <= h; ∫ dφ = k₀, ∫ cos φ = k₁,
//!   ∫ cos² φ = k₂, ∫ sin² φ = k₃. The tests hold cylinder, cone, sphere, hemisphere and torus.

use super::measure::{Measures, Moments};
use super::part::Part;
use super::revolved::Revolved;
use super::turn::Turn;
use crate::math::quadrature::Integral;
use crate::math::similarity::DdVec;
use crate::math::{Dd, Real, Similarity};
use crate::region::{Estimate, FilledPieces, SectionMoments};
use glam::DVec3;

/// Rounding of the double-double sums here, relative to the size of their terms: a few tens of units.
const ROUNDING: f64 = 1.0 / (1_u128 << 96) as f64;

/// What the rounding of a scene's decimals to f64 changes in a solid of ordinary proportions: half an
/// ulp in each of a few factors. Estimates include it, so that they also cover the solid that was
/// meant.
const WRITTEN: f64 = 8.0 * f64::EPSILON;

/// Rounding of a placement of many steps, relative to its lengths.
const PLACEMENT: f64 = 1.0 / (1_u128 << 90) as f64;

impl Revolved {
    /// Volume, area and moments, about the f64 point nearest to the centroid.
    ///
    /// Errors stay near the rounding of f64 for any angle, placement and scale, also where the
    /// profile is far from its axis or the solid far from the origin.
    #[must_use]
    pub fn moments(&self) -> Moments {
        moments(self.frame(), self.turn(), self.boundary())
    }
}

impl Part {
    /// Volume, area and moments of the part by itself.
    #[must_use]
    pub fn moments(&self) -> Moments {
        self.body().moments()
    }

    /// What a user reads of [`moments`](Self::moments), with the bounds.
    #[must_use]
    pub fn measures(&self) -> Measures {
        self.moments().measures(Some(self.bounds()))
    }

    /// The part's volume, in cubed scene units, with an estimate of its error.
    #[must_use]
    pub fn volume(&self) -> Integral {
        self.moments().volume
    }
}

/// Moments of the region that `boundary` bounds, turned about the third axis of `frame`.
fn moments(frame: &Similarity, turn: &Turn, boundary: &FilledPieces) -> Moments {
    let section = SectionMoments::new(boundary);
    let ring = Ring::new(&section, turn).at_centroid();
    ring.with_decimals().placed(frame, turn)
}

/// Moments in the region's unit, along (ξ, η, z) and about a point of the plane η = 0.
struct Ring {
    /// ξ and z of the point.
    about: [Dd; 2],
    volume: Estimate,
    area: Estimate,
    /// ∭ ξ and ∭ z.
    first: [Estimate; 2],
    /// ∭ ξ², ∭ η², ∭ z², ∭ ξ z.
    second: [Estimate; 4],
}

impl Ring {
    fn new(section: &SectionMoments, turn: &Turn) -> Self {
        let (h, sin, cos) = turn.half();
        let two = Dd::of(2.0);
        let [k0, k1, k2, k3] = [h * two, sin * two, h + sin * cos, h - sin * cos];
        let c = Dd::of(section.centre[0]);
        let xi = c * k1 / k0;
        let zero = Dd::ZERO;
        // ∬ (p₁ r + p₂ r² + p₃ r³) ζ^n with r = r_c + ρ.
        let integral = |p: [Dd; 3], n: usize| {
            let [p1, p2, p3] = p;
            let coefficients = [
                ((p3 * c + p2) * c + p1) * c,
                (Dd::of(3.0) * p3 * c + two * p2) * c + p1,
                Dd::of(3.0) * p3 * c + p2,
                p3,
            ];
            let used = coefficients.into_iter().enumerate();
            let used = used.filter(|(_, k)| *k != zero);
            used.fold(
                Estimate {
                    value: zero,
                    error: 0.0,
                },
                |sum, (j, k)| added(sum, scaled(section.area(j, n), k)),
            )
        };
        let volume = integral([k0, zero, zero], 0);
        let reach = section.centre[0] + section.half[0] + section.half[1];
        let rounded = |e: Estimate, power: i32| Estimate {
            value: e.value,
            error: e.error + ROUNDING * volume.value.f64().abs() * reach.powi(power),
        };
        let caps = match turn {
            Turn::Full => zero,
            Turn::Partial(_) => two,
        };
        let area = added(scaled(section.swept, k0), scaled(section.area(0, 0), caps));
        let area_rounding = ROUNDING * area.value.f64();
        Self {
            about: [xi, Dd::of(section.centre[1])],
            volume: rounded(volume, 0),
            area: Estimate {
                value: area.value,
                error: area.error + area_rounding,
            },
            first: [
                rounded(integral([-(xi * k0), k1, zero], 0), 1),
                rounded(integral([k0, zero, zero], 1), 1),
            ],
            second: [
                rounded(integral([xi * xi * k0, -(two * xi * k1), k2], 0), 2),
                rounded(integral([zero, zero, k3], 0), 2),
                rounded(integral([k0, zero, zero], 2), 2),
                rounded(integral([-(xi * k0), k1, zero], 1), 2),
            ],
        }
    }

    /// The moments about the centroid.
    fn at_centroid(self) -> Self {
        let v = self.volume;
        if !(v.value.f64() > v.error) {
            return self;
        }
        let d = self.first.map(|f| f.value / v.value);
        let [dx, dz] = d.map(|d| d.f64().abs());
        // S - d Fᵀ - F dᵀ + V d dᵀ, where F = V d but for the errors.
        let shifted = |s: Estimate, a: usize, b: usize| {
            let (da, db) = ([dx, dz][a], [dx, dz][b]);
            let carried = da * self.first[b].error + db * self.first[a].error + da * db * v.error;
            Estimate {
                value: s.value - v.value * d[a] * d[b],
                error: s.error + carried,
            }
        };
        let [xx, yy, zz, xz] = self.second;
        Self {
            about: [self.about[0] + d[0], self.about[1] + d[1]],
            first: std::array::from_fn(|i| Estimate {
                value: Dd::ZERO,
                error: self.first[i].error + [dx, dz][i] * v.error,
            }),
            second: [shifted(xx, 0, 0), yy, shifted(zz, 1, 1), shifted(xz, 0, 1)],
            ..self
        }
    }

    /// The moments with [`WRITTEN`] in their estimates, in proportion to the solid's own size.
    fn with_decimals(self) -> Self {
        let v = self.volume.value.f64();
        let [xx, yy, zz, _] = self.second.map(|s| s.value.f64().max(0.0));
        let square = xx + yy + zz;
        let wider = |e: Estimate, size: f64| Estimate {
            value: e.value,
            error: e.error + WRITTEN * size,
        };
        Self {
            volume: wider(self.volume, v.abs()),
            area: wider(self.area, self.area.value.f64()),
            // V times the radius of gyration.
            first: self.first.map(|f| wider(f, (v.abs() * square).sqrt())),
            second: self.second.map(|s| wider(s, square)),
            ..self
        }
    }

    /// The moments in the world, about the f64 point nearest to the local one.
    fn placed(&self, frame: &Similarity, turn: &Turn) -> Moments {
        let scale = Scale::new(frame.scale_exact());
        let [along, across] = middle_axes(frame, turn);
        let axis = frame.axis_exact(2);
        let origin = frame.origin_exact();
        let s = frame.scale_exact();
        let point: DdVec = std::array::from_fn(|i| {
            origin[i] + s * (along[i] * self.about[0] + axis[i] * self.about[1])
        });
        let about = DVec3::from_array(point.map(Real::f64));
        let rest: [f64; 3] = std::array::from_fn(|i| (point[i] - Dd::of(about[i])).f64());
        let volume = scale.integral(self.volume, 3);
        let lengths = frame.scale() * (self.about[0].f64().abs() + self.about[1].f64().abs())
            + frame.origin().abs().element_sum();
        let [f_along, f_axis] = self.first;
        let first = std::array::from_fn(|i| {
            let one = added(scaled(f_along, along[i]), scaled(f_axis, axis[i]));
            let one = scale.integral(one, 4);
            let shift = volume.value * rest[i];
            Integral {
                value: one.value + shift,
                error: one.error
                    + f64::EPSILON * shift.abs()
                    + volume.error * rest[i].abs()
                    + volume.value.abs() * PLACEMENT * lengths,
            }
        });
        let [xx, yy, zz, xz] = self.second;
        let size = [xx, yy, zz]
            .iter()
            .map(|s| s.value.f64().abs())
            .sum::<f64>();
        let second = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let terms = [
                    scaled(xx, along[i] * along[j]),
                    scaled(yy, across[i] * across[j]),
                    scaled(zz, axis[i] * axis[j]),
                    scaled(xz, along[i] * axis[j] + axis[i] * along[j]),
                ];
                let mut one = terms.into_iter().reduce(added).unwrap_or(xx);
                one.error += PLACEMENT * size;
                let one = scale.integral(one, 5);
                // About the rounded point instead: a square of rounding.
                let shift = volume.value * rest[i] * rest[j];
                let moved = volume.value * PLACEMENT * lengths * (rest[i].abs() + rest[j].abs());
                Integral {
                    value: one.value + shift,
                    error: one.error
                        + moved
                        + volume.error * (rest[i] * rest[j]).abs()
                        + f64::EPSILON * (2.0 * shift.abs() + 0.5 * one.value.abs()),
                }
            })
        });
        Moments {
            about,
            volume,
            area: scale.integral(self.area, 2),
            first,
            second,
        }
    }
}

/// World directions of ξ and η.
fn middle_axes(frame: &Similarity, turn: &Turn) -> [DdVec; 2] {
    let [c, s] = turn.middle();
    let (x, y) = (frame.axis_exact(0), frame.axis_exact(1));
    [
        std::array::from_fn(|i| x[i] * c + y[i] * s),
        std::array::from_fn(|i| y[i] * c - x[i] * s),
    ]
}

/// A length's powers, whose own exponents may leave the range of f64 where the products do not.
struct Scale {
    mantissa: Dd,
    power: f64,
}

impl Scale {
    fn new(scale: Dd) -> Self {
        let power = scale.f64().log2().floor().exp2();
        Self {
            mantissa: scale.scale_by_power_of_two(1.0 / power),
            power,
        }
    }

    /// A local integral in scene units, `n` the power of lengths in it, rounded.
    fn integral(&self, local: Estimate, n: usize) -> Integral {
        let (mut value, mut error) = (local.value, local.error);
        for _ in 0..n {
            value = value * self.mantissa;
            error *= self.mantissa.f64();
        }
        let (mut value, mut error) = (value.f64(), error * (1.0 + 8.0 * f64::EPSILON));
        for _ in 0..n {
            value *= self.power;
            error *= self.power;
        }
        Integral {
            value,
            // Half an ulp, or what underflow takes.
            error: error + 0.5 * f64::EPSILON * value.abs() + f64::MIN_POSITIVE,
        }
    }
}

fn scaled(e: Estimate, factor: Dd) -> Estimate {
    Estimate {
        value: e.value * factor,
        error: e.error * factor.f64().abs(),
    }
}

fn added(a: Estimate, b: Estimate) -> Estimate {
    Estimate {
        value: a.value + b.value,
        error: a.error + b.error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::{Boundary, Fill, ProfileCurve, ProfileLoop, Region};
    use crate::solid::{Assembly, Body};
    use std::f64::consts::PI;
    use std::sync::Arc;

    fn polyline(points: &[[f64; 2]]) -> ProfileCurve {
        let degree = 1;
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let mut knots: Vec<f64> = (0..points.len()).map(|i| i as f64).collect();
        knots.insert(0, 0.0);
        knots.push(knots[knots.len() - 1]);
        ProfileCurve::Nurbs {
            degree,
            knots,
            points: points.to_vec(),
            weights: vec![1.0; points.len()],
        }
    }

    fn arc(center: [f64; 2], radius: f64, from: f64, to: f64) -> ProfileCurve {
        ProfileCurve::Arc {
            center,
            radii: [radius; 2],
            tilt: 0.0,
            from,
            to,
        }
    }

    fn body(loops: &[ProfileLoop], boundary: Boundary, turn: Turn, frame: &Similarity) -> Body {
        let region = Region::new(loops, boundary, Fill::EvenOdd).expect("a region");
        Body::Revolved(Revolved::new(
            frame.with_local_unit(region.unit()),
            turn,
            region.section().clone(),
        ))
    }

    fn upright() -> Similarity {
        Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X).expect("a frame")
    }

    /// Area of the turned surface and caps, and the moments about the local origin, of a region
    /// whose ∬ r^a z^b is known.
    struct Closed {
        name: &'static str,
        profile: (Vec<ProfileLoop>, Boundary),
        /// ∬ r, ∬ r², ∬ r³, ∬ r z, ∬ r² z, ∬ r z².
        moments: [f64; 6],
        /// ∬ 1 and ∫ r ds.
        area: [f64; 2],
    }

    /// The solids of the design notes, r = 1.5, h = 0.7, R = 2.75.
    fn table() -> Vec<Closed> {
        let (r, h, big) = (1.5_f64, 0.7_f64, 2.75_f64);
        let p = |n: i32| r.powi(n);
        let whole = |c: ProfileCurve| (vec![vec![c]], Boundary::ToAxis);
        vec![
            Closed {
                name: "cylinder",
                profile: whole(polyline(&[[r, 0.0], [r, h]])),
                moments: [
                    p(2) / 2.0 * h,
                    p(3) / 3.0 * h,
                    p(4) / 4.0 * h,
                    p(2) / 2.0 * h * h / 2.0,
                    p(3) / 3.0 * h * h / 2.0,
                    p(2) / 2.0 * h.powi(3) / 3.0,
                ],
                area: [r * h, r * h + p(2)],
            },
            Closed {
                name: "cone",
                profile: whole(polyline(&[[r, 0.0], [0.0, h]])),
                // ∫ ρ^n / n z^m dz with ρ = r (1 - z / h).
                moments: [
                    p(2) * h / 6.0,
                    p(3) * h / 12.0,
                    p(4) * h / 20.0,
                    p(2) * h * h / 24.0,
                    p(3) * h * h / 60.0,
                    p(2) * h.powi(3) / 60.0,
                ],
                area: [r * h / 2.0, r * r.hypot(h) / 2.0 + p(2) / 2.0],
            },
            Closed {
                name: "sphere",
                profile: whole(arc([0.0, 0.0], r, -90.0, 90.0)),
                moments: [
                    2.0 * p(3) / 3.0,
                    PI * p(4) / 8.0,
                    4.0 * p(5) / 15.0,
                    0.0,
                    0.0,
                    2.0 * p(5) / 15.0,
                ],
                area: [PI * p(2) / 2.0, 2.0 * p(2)],
            },
            Closed {
                name: "hemisphere",
                profile: whole(arc([0.0, 0.0], r, 0.0, 90.0)),
                moments: [
                    p(3) / 3.0,
                    PI * p(4) / 16.0,
                    2.0 * p(5) / 15.0,
                    p(4) / 8.0,
                    p(5) / 15.0,
                    p(5) / 15.0,
                ],
                area: [PI * p(2) / 4.0, p(2) * 1.5],
            },
            Closed {
                name: "torus",
                profile: (vec![vec![arc([big, 0.0], r, 0.0, 360.0)]], Boundary::Closed),
                moments: [
                    PI * p(2) * big,
                    PI * p(2) * (big * big + p(2) / 4.0),
                    PI * p(2) * big * (big * big + 0.75 * p(2)),
                    0.0,
                    0.0,
                    PI * p(4) / 4.0 * big,
                ],
                area: [PI * p(2), 2.0 * PI * r * big],
            },
        ]
    }

    /// Measures of a closed form turned from `from` by `degrees`, in local coordinates.
    fn expected(c: &Closed, from: f64, degrees: f64) -> (f64, f64, DVec3, [[f64; 3]; 3]) {
        let half = 0.5 * degrees.to_radians();
        let (sin, cos) = if degrees == 360.0 {
            (0.0, -1.0)
        } else {
            half.sin_cos()
        };
        let [r1, r2, r3, rz, rrz, rzz] = c.moments;
        let v = 2.0 * half * r1;
        let caps = if degrees < 360.0 { 2.0 } else { 0.0 };
        let area = 2.0 * half * c.area[1] + caps * c.area[0];
        let (x, z) = (2.0 * sin * r2 / v, 2.0 * half * rz / v);
        let s = [
            (half + sin * cos) * r3 - v * x * x,
            (half - sin * cos) * r3,
            2.0 * half * rzz - v * z * z,
        ];
        let xz = 2.0 * sin * rrz - v * x * z;
        let (s0, c0) = (from + degrees / 2.0).to_radians().sin_cos();
        let axes = [[c0, -s0, 0.0], [s0, c0, 0.0], [0.0, 0.0, 1.0]];
        let local = [
            [s[1] + s[2], 0.0, -xz],
            [0.0, s[0] + s[2], 0.0],
            [-xz, 0.0, s[0] + s[1]],
        ];
        (
            v,
            area,
            DVec3::new(c0 * x, s0 * x, z),
            turned(&axes, &local),
        )
    }

    /// Q T Qᵀ.
    fn turned(q: &[[f64; 3]; 3], t: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let mut sum = 0.0;
                for a in 0..3 {
                    for b in 0..3 {
                        sum += q[i][a] * t[a][b] * q[j][b];
                    }
                }
                sum
            })
        })
    }

    fn check(name: &str, found: &Measures, wanted: &(f64, f64, DVec3, [[f64; 3]; 3]), far: f64) {
        let (volume, area, centroid, inertia) = wanted;
        let size = found.bounds.expect("bounds").longest_side();
        let off = (found.volume - volume).abs() / volume;
        assert!(off <= 1e-13, "{name}: volume {} for {volume}", found.volume);
        let off = (found.area - area).abs() / area;
        assert!(off <= 1e-13, "{name}: area {} for {area}", found.area);
        let c = found.centroid.expect("a centroid");
        assert!(
            (c - *centroid).abs().max_element() <= 1e-13 * size.max(far * 1e-3),
            "{name}: centroid {c} for {centroid}"
        );
        for i in 0..3 {
            for j in 0..3 {
                let off = (found.inertia[i][j] - inertia[i][j]).abs();
                assert!(
                    off <= 1e-13 * volume * size * size,
                    "{name}: inertia [{i}][{j}] {} for {}",
                    found.inertia[i][j],
                    inertia[i][j]
                );
            }
        }
        let e = &found.error_estimate;
        let relative = [
            e.volume / volume,
            e.area / area,
            e.centroid / size.max(far),
            e.inertia / (volume * size * size),
        ];
        assert!(
            relative.iter().all(|r| (0.0..=4e-15).contains(r)),
            "{name}: estimates {relative:?}"
        );
    }

    #[test]
    fn closed_forms_at_every_angle() {
        for c in &table() {
            for (from, degrees) in [
                (0.0, 360.0),
                (0.0, 90.0),
                (-20.0, 30.0),
                (33.3, 180.0),
                (0.0, 180.0),
                (100.0, 270.0),
                (1.0, 359.9),
                (45.0, 1e-3),
            ] {
                let turn = Turn::new(from, degrees);
                let found = body(&c.profile.0, c.profile.1, turn, &upright()).measures();
                let name = format!("{} from {from} by {degrees}", c.name);
                check(&name, &found, &expected(c, from, degrees), 0.0);
            }
        }
    }

    #[test]
    fn placements_turn_scale_and_move_the_measures() {
        let axis = DVec3::new(1.0, -2.0, 0.4);
        let degrees = 77.0_f64;
        let (s, c) = degrees.to_radians().sin_cos();
        let k = axis.normalize();
        let turn = |v: DVec3| v * c + k.cross(v) * s + k * (k.dot(v) * (1.0 - c));
        let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(turn);
        let q: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
        for form in &table() {
            for (scale, by) in [
                (1.0, DVec3::ZERO),
                (1e-6, DVec3::ZERO),
                (1e6, DVec3::new(1.0, 2.0, 3.0)),
                (1.0, DVec3::new(1e6, -2e6, 3e6)),
                (1e-6, DVec3::new(1e6, 1e6, -1e6)),
            ] {
                for (from, angle) in [(0.0, 360.0), (20.0, 200.0)] {
                    let frame = upright().rotated(axis, degrees).expect("a frame");
                    let frame = frame.scaled(scale).translated(by);
                    let solid = body(
                        &form.profile.0,
                        form.profile.1,
                        Turn::new(from, angle),
                        &frame,
                    );
                    let (v, a, x, i) = expected(form, from, angle);
                    let wanted = (
                        v * scale.powi(3),
                        a * scale * scale,
                        turn(x) * scale + by,
                        turned(&q, &i).map(|row| row.map(|m| m * scale.powi(5))),
                    );
                    let name = format!("{} by {angle}, scale {scale}, at {by}", form.name);
                    let far = by.length() * 4.0 * f64::EPSILON / 1e-15;
                    check(&name, &solid.measures(), &wanted, far);
                }
            }
        }
    }

    #[test]
    fn a_ring_far_from_its_axis_keeps_its_digits() {
        let (big, r) = (1e6, 1.0);
        let ring = [vec![arc([big, 0.0], r, 0.0, 360.0)]];
        // Turned by so little that it is a bent rod of length 2, the hardest to keep: the moments
        // about the axis are 1e12 of those about the centroid.
        let degrees = 2e-6_f64.to_degrees();
        let found = body(&ring, Boundary::Closed, Turn::new(0.0, degrees), &upright()).measures();
        let volume = degrees.to_radians() * big * PI;
        assert!((found.volume - volume).abs() <= 1e-14 * volume, "{found:?}");
        let area = degrees.to_radians() * 2.0 * PI * big + 2.0 * PI;
        assert!((found.area - area).abs() <= 1e-14 * area, "{found:?}");
        // Across the rod r²/4 + r²/4, along it r²/4 and the rod's own length²/12, to 1e-12.
        let [x, y, z] = [0.5, 0.25 + 1.0 / 3.0, 0.25 + 1.0 / 3.0].map(|k| k * volume);
        let tensor = found.inertia;
        // The rod runs along y.
        for (found, wanted) in [(tensor[1][1], x), (tensor[0][0], y), (tensor[2][2], z)] {
            assert!((found - wanted).abs() <= 3e-12 * volume, "{tensor:?}");
        }
        assert!(found.error_estimate.inertia <= 1e-14 * volume, "{found:?}");
        let full = body(&ring, Boundary::Closed, Turn::Full, &upright()).measures();
        let volume = 2.0 * PI * big * PI;
        assert!((full.volume - volume).abs() <= 1e-15 * volume, "{full:?}");
        let zz = volume * (big * big + 0.75);
        assert!((full.inertia[2][2] - zz).abs() <= 1e-15 * zz, "{full:?}");
    }

    #[test]
    fn a_wall_of_1e_11_of_its_radius_keeps_its_digits() {
        // Radii with a difference that f64 has exactly.
        let (outer, inner) = (1.0_f64, 1.0 - 0.5_f64.powi(37));
        let loops = [
            vec![arc([2.0, 0.0], outer, 0.0, 360.0)],
            vec![arc([2.0, 0.0], inner, 0.0, 360.0)],
        ];
        let found = body(&loops, Boundary::Closed, Turn::Full, &upright()).measures();
        let volume = 4.0 * PI * PI * (outer - inner) * (outer + inner);
        let off = (found.volume - volume).abs() / volume;
        assert!(off <= 1e-15, "off by {off:e}");
        let estimate = found.error_estimate.volume / volume;
        assert!((off..1e-13).contains(&estimate), "estimate {estimate:e}");
    }

    #[test]
    fn solids_apart_sum_and_others_are_not_guessed() {
        let part = |name: &str, by: DVec3| {
            let circle = [vec![arc([0.0, 0.0], 1.0, -90.0, 90.0)]];
            let region = Region::new(&circle, Boundary::ToAxis, Fill::EvenOdd).expect("a region");
            let frame = upright().rotated(DVec3::X, by.x).expect("a frame");
            Part::revolved(
                name.into(),
                1,
                Arc::new(region),
                &frame.translated(by),
                Turn::Full,
            )
        };
        let (a, b) = (DVec3::new(10.0, 0.0, 0.0), DVec3::new(-4.0, 3.0, 1.0));
        let found = Assembly::new(vec![part("a", a), part("b", b)]);
        let found = found.measures().expect("apart");
        let volume = 4.0 * PI / 3.0;
        assert!((found.volume - 2.0 * volume).abs() <= 4e-15 * volume);
        assert!((found.area - 8.0 * PI).abs() <= 4e-14);
        let middle = found.centroid.expect("a centroid");
        assert!((middle - 0.5 * (a + b)).length() <= 1e-14, "{middle}");
        let d = 0.5 * (a - b);
        let own = 0.8 * volume;
        let shift = |i: usize, j: usize| {
            let square = if i == j { d.length_squared() } else { 0.0 };
            2.0 * volume * (square - d[i] * d[j])
        };
        for i in 0..3 {
            for j in 0..3 {
                let wanted = if i == j { own } else { 0.0 } + shift(i, j);
                let off = (found.inertia[i][j] - wanted).abs();
                assert!(
                    off <= 1e-12,
                    "[{i}][{j}]: {} for {wanted}",
                    found.inertia[i][j]
                );
            }
        }
    }
}
