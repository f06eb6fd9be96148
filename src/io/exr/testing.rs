//! Layers for the tests.

use super::{Attributes, Samples, layer_attributes};
use crate::grid::GridSpec;
use glam::DVec3;

pub(super) const SIZE: [usize; 2] = [7, 13];

pub(super) struct Layer {
    pub(super) occupancy: Vec<u8>,
    pub(super) fraction: Vec<f32>,
    pub(super) sdf: Vec<f32>,
    pub(super) material: Vec<u32>,
}

impl Layer {
    /// A ball of radius 0.35 in the unit square, all channels.
    #[allow(clippy::cast_precision_loss, reason = "small test images")]
    pub(super) fn ball([nx, ny]: [usize; 2]) -> Self {
        let sdf: Vec<f32> = (0..nx * ny)
            .map(|n| {
                let x = ((n % nx) as f64 + 0.5) / nx as f64 - 0.5;
                let y = ((n / nx) as f64 + 0.5) / ny as f64 - 0.5;
                (x.hypot(y).hypot(0.1) - 0.35) as f32
            })
            .collect();
        Self {
            occupancy: sdf.iter().map(|&d| u8::from(d <= 0.0)).collect(),
            fraction: sdf
                .iter()
                .map(|&d| (0.5 - d * nx as f32).clamp(0.0, 1.0))
                .collect(),
            material: sdf
                .iter()
                .map(|&d| if d <= 0.0 { 70_000 } else { 0 })
                .collect(),
            sdf,
        }
    }

    pub(super) fn channels(&self) -> [(&'static str, Samples<'_>); 4] {
        [
            ("occupancy", Samples::Half(&self.occupancy)),
            ("fraction", Samples::Float(&self.fraction)),
            ("sdf", Samples::Float(&self.sdf)),
            ("material", Samples::Uint(&self.material)),
        ]
    }
}

pub(super) fn grid() -> GridSpec {
    GridSpec::new([7, 13, 5], DVec3::new(-0.1, 0.0, 1e-7), DVec3::splat(0.3)).unwrap()
}

pub(super) fn attributes() -> Attributes {
    layer_attributes(&grid(), 3, "mm", Some(("tour \u{e9}", "abc123")))
}
