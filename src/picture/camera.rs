//! Where a picture is seen from.
//!
//! The projection is orthographic, so lengths in the picture's plane are true everywhere and one
//! scale bar serves the whole picture. +z is up.
//!
//! ```text
//!             z ^   to the camera (azimuth a, elevation e)
//!               |  /
//!               | / e            right = (-sin a, cos a, 0)
//!               |/______ y       up    = (-sin e cos a, -sin e sin a, cos e)
//!              / a
//!             x
//! ```

use super::error::PictureError;
use glam::DVec3;

/// The direction to the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    azimuth: f64,
    elevation: f64,
}

impl View {
    /// A view from `azimuth` degrees about +z, counted from +x towards +y, and `elevation` degrees
    /// above the plane of x and y.
    ///
    /// # Errors
    /// [`PictureError::Angle`] when an angle is not finite or the elevation not within -90 to 90.
    pub fn new(azimuth: f64, elevation: f64) -> Result<Self, PictureError> {
        if !(azimuth.abs() <= 36000.0) {
            return Err(PictureError::Angle {
                angle: "azimuth",
                found: azimuth,
                wanted: "a number of degrees between -36000 and 36000",
            });
        }
        if !(elevation.abs() <= 90.0) {
            return Err(PictureError::Angle {
                angle: "elevation",
                found: elevation,
                wanted: "a number of degrees between -90 and 90",
            });
        }
        Ok(Self { azimuth, elevation })
    }

    /// Degrees about +z, counted from +x towards +y.
    #[must_use]
    pub fn azimuth(&self) -> f64 {
        self.azimuth
    }

    /// Degrees above the plane of x and y.
    #[must_use]
    pub fn elevation(&self) -> f64 {
        self.elevation
    }

    /// The unit vectors along the picture's right and up.
    pub(crate) fn plane(&self) -> (DVec3, DVec3) {
        let (sa, ca) = self.azimuth.to_radians().sin_cos();
        let right = DVec3::new(-sa, ca, 0.0);
        (
            right,
            Self::direction(self.azimuth, self.elevation).cross(right),
        )
    }

    /// The unit vector to a point at infinity, in these angles.
    pub(super) fn direction(azimuth: f64, elevation: f64) -> DVec3 {
        let (sa, ca) = azimuth.to_radians().sin_cos();
        let (se, ce) = elevation.to_radians().sin_cos();
        DVec3::new(ce * ca, ce * sa, se)
    }
}

impl Default for View {
    /// From the front and the right, above: a partial turn that starts at +x shows where it is open.
    fn default() -> Self {
        Self {
            azimuth: -55.0,
            elevation: 24.0,
        }
    }
}

/// An orthographic camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    /// Away from the camera.
    pub(super) forward: DVec3,
    /// What is in the middle of the picture.
    centre: DVec3,
    /// Scene units for a pixel.
    scale: f64,
    /// Pixels along x and y.
    size: [f64; 2],
}

impl Camera {
    pub(super) fn new(view: View, centre: DVec3, scale: f64, size: [f64; 2]) -> Self {
        let to_camera = View::direction(view.azimuth, view.elevation);
        let (right, up) = view.plane();
        Self {
            right,
            up,
            forward: -to_camera,
            centre,
            scale,
            size,
        }
    }

    /// Scene units for a pixel.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// The point of the picture's plane, which is through what is in the middle, at a place of the
    /// picture in pixels from the upper left corner.
    pub(super) fn point(&self, x: f64, y: f64) -> DVec3 {
        self.centre
            + self.right * ((x - 0.5 * self.size[0]) * self.scale)
            + self.up * ((0.5 * self.size[1] - y) * self.scale)
    }

    /// Where a point is seen, in pixels from the upper left corner, and how far behind the picture's
    /// plane it is, in scene units.
    pub(super) fn project(&self, p: DVec3) -> [f64; 3] {
        let d = p - self.centre;
        [
            0.5 * self.size[0] + d.dot(self.right) / self.scale,
            0.5 * self.size[1] - d.dot(self.up) / self.scale,
            d.dot(self.forward),
        ]
    }

    /// The same camera whose picture has a part of this one, a box in pixels, in its middle.
    pub(super) fn framed(&self, low: [f64; 2], high: [f64; 2], room: [f64; 2]) -> Self {
        let middle = self.point(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]));
        let factor = ((high[0] - low[0]) / room[0]).max((high[1] - low[1]) / room[1]);
        Self {
            centre: middle,
            scale: self.scale * factor,
            ..*self
        }
    }

    /// The same camera looking a number of pixels lower.
    pub(super) fn lowered(&self, pixels: f64) -> Self {
        Self {
            centre: self.centre - self.up * (pixels * self.scale),
            ..*self
        }
    }

    /// The same picture in another number of pixels.
    pub(super) fn resized(&self, size: [f64; 2]) -> Self {
        let factor = (self.size[0] / size[0]).max(self.size[1] / size[1]);
        Self {
            scale: self.scale * factor,
            size,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_the_picture_are_right_handed() {
        for (azimuth, elevation) in [(0.0, 0.0), (-55.0, 24.0), (130.0, -40.0), (0.0, 90.0)] {
            let view = View::new(azimuth, elevation).unwrap();
            let camera = Camera::new(view, DVec3::ZERO, 1.0, [10.0, 10.0]);
            let back = camera.right.cross(camera.up);
            assert!((back + camera.forward).length() < 1e-12);
            assert!(camera.up.z >= 0.0);
        }
        let front = Camera::new(View::new(-90.0, 0.0).unwrap(), DVec3::ZERO, 1.0, [10.0; 2]);
        assert!((front.right - DVec3::X).length() < 1e-12);
        assert!((front.up - DVec3::Z).length() < 1e-12);
    }

    #[test]
    fn pixels_are_where_they_should_be() {
        let view = View::new(-90.0, 0.0).unwrap();
        let camera = Camera::new(view, DVec3::new(1.0, 2.0, 3.0), 0.5, [8.0, 6.0]);
        assert!((camera.point(4.0, 3.0) - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
        assert!((camera.point(8.0, 0.0) - DVec3::new(3.0, 2.0, 4.5)).length() < 1e-12);
        let [x, y, depth] = camera.project(camera.point(7.0, 1.5) + camera.forward * 2.5);
        assert!((x - 7.0).abs() + (y - 1.5).abs() + (depth - 2.5).abs() < 1e-12);
        let part = camera.framed([4.0, 0.0], [8.0, 3.0], [8.0, 6.0]);
        assert!((part.point(8.0, 0.0) - camera.point(8.0, 0.0)).length() < 1e-12);
        assert!((part.point(0.0, 6.0) - camera.point(4.0, 3.0)).length() < 1e-12);
    }

    #[test]
    fn impossible_angles_are_refused() {
        assert!(View::new(f64::NAN, 0.0).is_err());
        let error = View::new(0.0, 90.5).unwrap_err().to_string();
        assert_eq!(
            error,
            "elevation 90.5 is not a number of degrees between -90 and 90"
        );
    }
}
