//! Closed forms to compare with: torus, cylinder, cone and sphere.
//!
//! Nothing here goes through profiles, pieces or searches, so that agreement means something. In
//! the shape's own coordinates, ρ the distance from the axis:
//!
//! ```text
//!   torus R, r      V = 2π² R r²               sd = |(ρ - R, z)| - r
//!   sphere r        V = 4/3 π r³               sd = |(ρ, z)| - r
//!   cylinder r, h   V = π r² h                 sd = distance to the rectangle [0, r] × [0, h]
//!   cone a, b, h    V = π h (a² + a b + b²)/3  sd = distance to the trapezium
//! ```

use crate::math::Similarity;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// A shape with closed forms for its volume and its distance. Lengths in its own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// About its centre; `minor` is at most `major`.
    Torus {
        /// Radius of the circle of centres.
        major: f64,
        /// Radius of the tube.
        minor: f64,
    },
    /// From z = 0 up.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Its height.
        height: f64,
    },
    /// From z = 0 up; a frustum where no radius is 0.
    Cone {
        /// Radius at z = 0.
        radius1: f64,
        /// Radius at the top.
        radius2: f64,
        /// Its height.
        height: f64,
    },
    /// About its centre.
    Sphere {
        /// Its radius.
        radius: f64,
    },
}

/// A shape in its place.
#[derive(Debug, Clone)]
pub struct Analytic {
    shape: Shape,
    frame: Similarity,
}

impl Analytic {
    /// A shape about the third axis of `frame`.
    #[must_use]
    pub fn new(shape: Shape, frame: Similarity) -> Self {
        Self { shape, frame }
    }

    /// The shape.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Volume in cubed scene units.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let own = match self.shape {
            Shape::Torus { major, minor } => 2.0 * PI * PI * major * minor * minor,
            Shape::Cylinder { radius, height } => PI * radius * radius * height,
            Shape::Cone {
                radius1: a,
                radius2: b,
                height,
            } => PI / 3.0 * height * (a * a + a * b + b * b),
            Shape::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
        };
        own * self.frame.scale().powi(3)
    }

    /// Signed distance, negative inside, in scene units.
    #[must_use]
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let p = self.frame.to_local(point).point;
        let (rho, z) = (p.x.hypot(p.y), p.z);
        let own = match self.shape {
            Shape::Torus { major, minor } => (rho - major).hypot(z) - minor,
            Shape::Sphere { radius } => rho.hypot(z) - radius,
            Shape::Cylinder { radius, height } => {
                let beyond = DVec2::new(rho - radius, (z - 0.5 * height).abs() - 0.5 * height);
                beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
            }
            Shape::Cone {
                radius1,
                radius2,
                height,
            } => frustum([radius1, radius2], height, DVec2::new(rho, z)),
        };
        own * self.frame.scale()
    }
}

/// Signed distance of (ρ, z) to a frustum from z = 0 up.
fn frustum([a, b]: [f64; 2], height: f64, p: DVec2) -> f64 {
    let to_segment = |from: DVec2, to: DVec2| {
        let along = to - from;
        let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        // A radius of 0 makes a segment a point.
        let share = if share.is_nan() { 0.0 } else { share };
        (p - from - along * share).length()
    };
    let (bottom, top) = (DVec2::new(a, 0.0), DVec2::new(b, height));
    let distance = to_segment(DVec2::ZERO, bottom)
        .min(to_segment(bottom, top))
        .min(to_segment(top, DVec2::new(0.0, height)));
    let side = (top - bottom).perp_dot(p - bottom);
    let inside = p.y >= 0.0 && p.y <= height && side >= 0.0;
    if inside { -distance } else { distance }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(shape: Shape, p: [f64; 3]) -> f64 {
        let frame = Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X).expect("a frame");
        Analytic::new(shape, frame).signed_distance(p.into())
    }

    #[test]
    fn distances_at_places_that_can_be_read_off() {
        let torus = Shape::Torus {
            major: 3.0,
            minor: 1.0,
        };
        assert_eq!(at(torus, [0.0, 0.0, 0.0]), 2.0);
        assert_eq!(at(torus, [0.0, 3.0, 0.25]), -0.75);
        let cylinder = Shape::Cylinder {
            radius: 2.0,
            height: 1.0,
        };
        assert_eq!(at(cylinder, [0.0, 0.0, 0.25]), -0.25);
        assert_eq!(at(cylinder, [5.0, 0.0, 5.0]), 5.0);
        assert_eq!(at(cylinder, [0.0, -1.875, 0.5]), -0.125);
        assert_eq!(at(cylinder, [1.0, 0.0, -2.0]), 2.0);
        // The side runs from (4, 0) to (1, 4): a unit normal of (0.8, 0.6).
        let cone = Shape::Cone {
            radius1: 4.0,
            radius2: 1.0,
            height: 4.0,
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} for {b}");
        near(at(cone, [2.5 + 0.8, 0.0, 2.0 + 0.6]), 1.0);
        near(at(cone, [2.5 - 0.4, 0.0, 2.0 - 0.3]), -0.5);
        near(at(cone, [0.0, 0.0, 4.5]), 0.5);
        let tip = Shape::Cone {
            radius1: 3.0,
            radius2: 0.0,
            height: 4.0,
        };
        near(at(tip, [0.0, 0.0, 7.0]), 3.0);
        near(at(tip, [0.0, 0.0, 0.0]), 0.0);
        assert_eq!(at(Shape::Sphere { radius: 2.0 }, [0.0, 3.0, 4.0]), 3.0);
    }

    /// The share of a fine grid inside is the volume.
    #[test]
    fn volumes_are_those_of_the_distances() {
        for shape in [
            Shape::Torus {
                major: 0.625,
                minor: 0.25,
            },
            Shape::Cylinder {
                radius: 0.75,
                height: 0.8,
            },
            Shape::Cone {
                radius1: 0.9,
                radius2: 0.3,
                height: 0.9,
            },
            Shape::Sphere { radius: 0.9 },
        ] {
            let n = 120;
            let inside = |i: u32| {
                let c = |k: u32| (f64::from(k) + 0.5) / f64::from(n) * 2.0 - 1.0;
                at(shape, [c(i % n), c(i / n % n), c(i / n / n)]) <= 0.0
            };
            let count = (0..n * n * n).filter(|&i| inside(i)).count();
            #[allow(clippy::cast_precision_loss, reason = "a count")]
            let found = count as f64 * 8.0 / f64::from(n).powi(3);
            let frame = Similarity::from_axis(DVec3::ZERO, DVec3::Z, DVec3::X).expect("a frame");
            let wanted = Analytic::new(shape, frame).volume();
            assert!(
                (found - wanted).abs() < 3e-3 * wanted,
                "{shape:?}: {found} for {wanted}"
            );
        }
    }
}
