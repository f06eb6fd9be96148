//! The errors of a study as a picture.

use super::{Row, Study};
use crate::picture::{Panel, Picture, Series, log_plot};

impl Study {
    /// Errors of the volumes, and of the distances, over the spacing: both axes logarithmic.
    ///
    /// * `scene`: the title.
    /// * `units`: the unit of length, for the axes.
    #[must_use]
    pub fn plot(&self, scene: &str, units: &str) -> Picture {
        let series = |name: &'static str, value: fn(&Row) -> f64| Series {
            name,
            points: self.rows.iter().map(|r| [r.spacing, value(r)]).collect(),
        };
        let x = format!("spacing / {units}");
        let distances = format!("error of the stored distance / {units}");
        log_plot(&[
            Panel {
                title: &format!("{scene}: volume"),
                x: &x,
                y: "relative error of the volume",
                series: vec![
                    series("occupancy", |r| r.volume_occupancy_error),
                    series("occupancy, mean over moved grids", |r| {
                        r.volume_occupancy_mean_error
                    }),
                    series("fraction", |r| r.volume_fraction_error),
                    series("fraction, its bound", |r| r.volume_fraction_bound),
                ],
                slopes: &[1, 2],
            },
            Panel {
                title: &format!("{scene}: signed distance"),
                x: &x,
                y: &distances,
                series: vec![
                    series("largest", |r| r.sdf_max_error),
                    series("mean", |r| r.sdf_mean_error),
                ],
                slopes: &[1],
            },
        ])
    }
}
