//! Round shapes as regions of the half-plane.
//!
//! A torus whose tube is wider than its ring would cross the axis: what lies beyond it is on the
//! other side, inside of the tube there, so the solid is what the arc off the axis encloses with it.

use crate::region::{Boundary, Fill, ProfileCurve, Region, RegionError};
use crate::solid::Shape;

/// The region that makes the shape when it is turned.
pub(super) fn region(shape: Shape) -> Result<Region, RegionError> {
    let arc = |r: f64, radius: f64, from: f64, to: f64| ProfileCurve::Arc {
        center: [r, 0.0],
        radii: [radius; 2],
        tilt: 0.0,
        from,
        to,
    };
    let (curve, boundary) = match shape {
        Shape::Torus { major, minor } if minor <= major => {
            (arc(major, minor, 0.0, 360.0), Boundary::Closed)
        }
        Shape::Torus { major, minor } => {
            let most = (-major / minor).acos().to_degrees();
            (arc(major, minor, -most, most), Boundary::ToAxis)
        }
        Shape::Sphere { radius } => (arc(0.0, radius, -90.0, 90.0), Boundary::ToAxis),
        Shape::Cylinder { radius, height } => (side([radius, radius], height), Boundary::ToAxis),
        Shape::Cone {
            radius1,
            radius2,
            height,
        } => (side([radius1, radius2], height), Boundary::ToAxis),
    };
    Region::new(&[vec![curve]], boundary, Fill::EvenOdd)
}

/// The segment from one radius to the other.
fn side([bottom, top]: [f64; 2], height: f64) -> ProfileCurve {
    ProfileCurve::Polyline {
        points: vec![[bottom, 0.0], [top, height]],
    }
}
