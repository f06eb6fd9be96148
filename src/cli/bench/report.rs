//! What `bench` prints.

use super::Job;
use super::clock::Measured;
use serde_json::{Value, json};
use std::fmt::Write as _;

impl Job<'_> {
    pub(super) fn document(&self, measured: &[Measured]) -> Value {
        json!({
            "scene": self.scene.name(),
            "dims": self.grid.dims(),
            "threads": rayon::current_num_threads(),
            "simd": format!("{:?}", self.kernel.level()).to_lowercase(),
            "machine": machine(),
            "temporary": std::env::temp_dir(),
            "stages": measured.iter().map(entry).collect::<Vec<_>>(),
            "warnings": self.scene.warnings(),
        })
    }

    pub(super) fn table(&self, measured: &[Measured]) -> String {
        let [nx, ny, nz] = self.grid.dims();
        let mut text = format!(
            "{}, {nx} x {ny} x {nz} voxels, {} threads, {}\n\n{:<15} {:>12} {:>12} {:>12} {:>12} {:>8} {:>8}\n",
            self.scene.name(),
            rayon::current_num_threads(),
            machine(),
            "stage",
            "voxels",
            "seconds",
            "voxels/s",
            "bytes/s",
            "fill",
            "writes"
        );
        let ratio = |r: Option<f64>| r.map_or_else(|| "-".into(), |r| format!("{r:.3}"));
        for m in measured {
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "{:<15} {:>12} {:>12.6} {:>12.4e} {:>12.4e} {:>8} {:>8}",
                m.name,
                m.voxels,
                m.seconds,
                m.rate(m.voxels),
                m.rate(m.bytes),
                ratio(m.ratio_to_fill()),
                ratio(m.ratio_to_writes()),
            );
        }
        text.push_str(
            "\nfill, writes: bytes a second, compared with a plain fill of memory and with plain file writes in turn with it\n",
        );
        if measured.iter().any(|m| m.ratio_to_writes().is_some()) {
            let _ = writeln!(text, "files in {}", std::env::temp_dir().display());
        }
        text
    }
}

fn entry(m: &Measured) -> Value {
    json!({
        "name": m.name,
        "voxels": m.voxels,
        "seconds": m.seconds,
        "voxels_per_second": m.rate(m.voxels),
        "bytes_per_second": m.rate(m.bytes),
        "ratio_to_memory_write": m.ratio_to_fill(),
        "ratio_to_file_write": m.ratio_to_writes(),
        "runs": m.runs,
        "seconds_least": m.spread[0],
        "seconds_most": m.spread[1],
    })
}

/// The processor's name and the number of processors.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|l| l.strip_prefix("model name"));
    let name = named.map_or(std::env::consts::ARCH, |n| {
        n.trim_start_matches([' ', '\t', ':'])
    });
    let count = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    format!("{name}, {count} processors")
}
