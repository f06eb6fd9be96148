//! `voxlathe info`: what a finished stack holds.

use super::arguments::{Common, Info};
use super::failure::Failure;
use super::output::{self, Console};
use crate::io::verify_stack;
use serde_json::json;
use std::fmt::Write;
use std::process::ExitCode;

pub(super) fn run(
    arguments: &Info,
    _common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let report = verify_stack(&arguments.directory)?;
    let m = &report.manifest;
    let total: u64 = m.files.iter().map(|f| f.bytes).sum();
    let altered: Vec<&str> = report.altered.iter().map(|a| a.name.as_str()).collect();
    let document = json!({
        "directory": arguments.directory,
        "scene": m.scene_name,
        "scene_hash": m.scene_hash,
        "version": m.version,
        "dims": m.grid.dims,
        "origin": m.grid.origin,
        "spacing": m.grid.spacing,
        "units": m.units,
        "bounds": m.bounds,
        "channels": m.channels,
        "compression": m.compression,
        "files": m.files.len(),
        "bytes": total,
        "voxels_inside": m.voxels_inside,
        "volume_occupancy": m.volume_occupancy,
        "volume_fraction": m.volume_fraction,
        "volume_exact": m.volume_exact,
        "solids": m.solids,
        "materials": m.materials,
        "warnings": m.warnings,
        "missing": report.missing,
        "altered": altered,
        "extra": report.extra,
        "ok": report.is_intact(),
    });
    let mut text = String::new();
    let [nx, ny, nz] = m.grid.dims;
    let unknown = || "unknown".to_owned();
    let volume = |v: Option<f64>| v.map_or_else(unknown, |v| format!("{v} {}^3", m.units));
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "scene        {}",
        m.scene_name.as_deref().unwrap_or("unnamed")
    );
    let _ = writeln!(
        text,
        "grid         {nx} x {ny} x {nz} voxels of {:?} {}",
        m.grid.spacing, m.units
    );
    let _ = writeln!(text, "origin       {:?}", m.grid.origin);
    for c in &m.channels {
        let range = c.range.map_or_else(unknown, |[a, b]| format!("{a} to {b}"));
        let _ = writeln!(
            text,
            "channel      {:<10} {range}{}  {}",
            c.name,
            c.unit
                .as_ref()
                .map_or_else(String::new, |u| format!(" {u}")),
            c.meaning
        );
    }
    let _ = writeln!(
        text,
        "inside       {} voxels",
        m.voxels_inside.map_or_else(unknown, |v| v.to_string())
    );
    let _ = writeln!(
        text,
        "volume       {} by occupancy",
        volume(m.volume_occupancy)
    );
    let _ = writeln!(
        text,
        "             {} by fraction",
        volume(m.volume_fraction)
    );
    let _ = writeln!(text, "             {} exact", volume(m.volume_exact));
    let _ = writeln!(
        text,
        "files        {}, {}, {}",
        m.files.len(),
        output::bytes(total),
        m.compression
    );
    let damaged = report.missing.iter().map(|n| format!("missing      {n}\n"));
    let damaged = damaged.chain(altered.iter().map(|n| format!("altered      {n}\n")));
    text.extend(damaged.chain(report.extra.iter().map(|n| format!("not listed   {n}\n"))));
    let intact = report.is_intact();
    let _ = writeln!(
        text,
        "digests      {}",
        if intact {
            "all verified"
        } else {
            "NOT as listed"
        }
    );
    console.result(&document, &text)?;
    if intact {
        Ok(ExitCode::SUCCESS)
    } else {
        console.say("error: the stack is not what its manifest lists; write it again, or restore the files named above");
        Ok(ExitCode::from(1))
    }
}
