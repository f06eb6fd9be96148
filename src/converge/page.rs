//! A study as a page that needs no other file.

use super::{Row, Study};
use crate::page::{escaped, picture, sheet, table};

/// A column: its name, and its value in a row.
type Column = (&'static str, fn(&Row) -> f64);

/// Columns and the orders that are fitted to them.
const COLUMNS: [Column; 7] = [
    ("spacing", |r| r.spacing),
    ("volume, occupancy", |r| r.volume_occupancy_error),
    ("its mean over moved grids", |r| {
        r.volume_occupancy_mean_error
    }),
    ("volume, fraction", |r| r.volume_fraction_error),
    ("its bound", |r| r.volume_fraction_bound),
    ("distance, largest", |r| r.sdf_max_error),
    ("distance, mean", |r| r.sdf_mean_error),
];

impl Study {
    /// The study as a self-contained HTML page, with its plot.
    ///
    /// * `scene`, `hash`: the name of the scene, and BLAKE3 of its resolved form.
    /// * `units`: its unit of length.
    /// * `plot`: the bytes of the PNG file that [`plot`](Self::plot) gives.
    #[must_use]
    pub fn page(&self, scene: &str, hash: &str, units: &str, plot: &[u8]) -> String {
        let line = "errors of volumes relative, of distances in ".to_owned() + units;
        let about = format!("Errors of {scene} over the spacing, both axes logarithmic");
        let mut body = format!(
            "<section class=\"card\"><p>volume compared with: {} ± {:.1e} {}³; scene <code>{}</code></p></section>\n\
             <section class=\"card\">{}</section>\n",
            self.volume,
            self.volume_error,
            escaped(units),
            escaped(hash),
            picture(plot, &about)
        );
        let head: Vec<&str> = std::iter::once("resolution")
            .chain(COLUMNS.iter().map(|c| c.0))
            .collect();
        let row = |row: &Row| {
            let values = COLUMNS
                .iter()
                .map(|(_, value)| format!("{:.3e}", value(row)));
            std::iter::once(row.resolution.to_string())
                .chain(values)
                .collect()
        };
        let rows: Vec<Vec<String>> = self.rows.iter().map(row).collect();
        body += &table("Errors", &head, &rows);
        let order = |o: Option<f64>| o.map_or_else(|| "–".to_owned(), |o| format!("{o:.2}"));
        let o = &self.orders;
        let orders = [
            ("volume, occupancy", o.volume_occupancy_error),
            ("volume, fraction", o.volume_fraction_error),
            ("distance, largest", o.sdf_max_error),
            ("distance, mean", o.sdf_mean_error),
        ];
        let orders = orders.map(|(name, value)| vec![name.to_owned(), order(value)]);
        body += &table("Fitted orders", &["error", "order"], &orders);
        sheet(&format!("voxlathe converge: {scene}"), &line, &body)
    }
}
