//! `voxlathe info`: what a finished stack holds.

use super::arguments::{Common, Info};
use super::failure::Failure;
use super::output::{self, Console};
use crate::io::{Manifest, verify_stack};
use serde_json::{Value, json};
use std::fmt::Write;
use std::process::ExitCode;

/// Contradictions that are shown to people: each slice may have the same one.
const SHOWN: usize = 20;

pub(super) fn run(
    arguments: &Info,
    _common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let report = verify_stack(&arguments.directory)?;
    let m = &report.manifest;
    let total: u64 = m.files.iter().map(|f| f.bytes).sum();
    let altered: Vec<&str> = report.altered.iter().map(|a| a.name.as_str()).collect();
    let mut document = json!({
        "directory": output::path(&arguments.directory),
        "scene": m.scene_name,
        "scene_hash": m.scene_hash,
        "version": m.version,
        "dims": m.grid.dims,
        "origin": m.grid.origin,
        "spacing": m.grid.spacing,
        "units": m.units,
        "bounds": m.bounds,
        "channels": m.channels,
        "formats": m.formats,
        "compression": m.compression,
        "files": m.files.len(),
        "bytes": total,
        "voxels_inside": m.voxels_inside,
        "volume_occupancy": m.volume_occupancy,
        "volume_fraction": m.volume_fraction,
        "volume_exact": m.volume_exact,
        "volume_exact_error": m.volume_exact_error,
        "solids": m.solids,
        "materials": m.materials,
        "material_volumes": m.material_volumes,
        "certainty": m.certainty,
        "warnings": m.warnings,
        "missing": report.missing,
        "altered": altered,
        "wrong": report.wrong,
        "extra": report.extra,
        "ok": report.is_intact(),
    });
    if arguments.files {
        document["listing"] = json!(m.files);
    }
    let mut text = holdings(m);
    if arguments.files {
        let listed = m.files.iter();
        text.extend(
            listed.map(|f| format!("file         {:>12} {} {}\n", f.bytes, f.blake3, f.name)),
        );
    }
    let damaged = report.missing.iter().map(|n| format!("missing      {n}\n"));
    let damaged = damaged.chain(altered.iter().map(|n| format!("altered      {n}\n")));
    let wrong = report.wrong.iter().take(SHOWN);
    let damaged = damaged.chain(wrong.map(|w| format!("wrong        {w}\n")));
    let more = report.wrong.len().saturating_sub(SHOWN);
    let more = (more > 0).then(|| format!("wrong        and {more} more\n"));
    let damaged = damaged.chain(more);
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

/// What a stack holds, as text.
fn holdings(m: &Manifest) -> String {
    let mut lines: Vec<[String; 2]> = Vec::new();
    let mut line = |name: &str, value: String| lines.push([name.to_owned(), value]);
    let unknown = || "unknown".to_owned();
    let volume = |v: Option<f64>| v.map_or_else(unknown, |v| format!("{v} {}^3", m.units));
    let [nx, ny, nz] = m.grid.dims;
    let name = m.scene_name.as_deref().unwrap_or("unnamed");
    line("scene", name.to_owned());
    let voxels = format!("{nx} x {ny} x {nz} voxels");
    line(
        "grid",
        format!("{voxels} of {:?} {}", m.grid.spacing, m.units),
    );
    line("origin", format!("{:?}", m.grid.origin));
    for c in &m.channels {
        let range = c.range.map_or_else(unknown, |[a, b]| format!("{a} to {b}"));
        let unit = c
            .unit
            .as_ref()
            .map_or_else(String::new, |u| format!(" {u}"));
        line(
            "channel",
            format!("{:<10} {range}{unit}  {}", c.name, c.meaning),
        );
    }
    let inside = m.voxels_inside.map_or_else(unknown, |v| v.to_string());
    line("inside", format!("{inside} voxels"));
    line(
        "volume",
        format!("{} by occupancy", volume(m.volume_occupancy)),
    );
    line("", format!("{} by fraction", volume(m.volume_fraction)));
    let measured = |value: Option<f64>, error: Option<f64>| {
        value.map_or_else(
            || "not measured".to_owned(),
            |v| {
                let shown = output::volume(v, error, &m.units);
                let exact = output::is_exact(v, error);
                format!("{shown} {}", if exact { "exact" } else { "measured" })
            },
        )
    };
    line("", measured(m.volume_exact, m.volume_exact_error));
    for one in &m.material_volumes {
        let name = one
            .name
            .as_ref()
            .map_or_else(String::new, |n| format!(" {n:?}"));
        let sampled = one.voxels.map_or_else(String::new, |n| {
            format!(
                "{n} voxels, {} by occupancy, ",
                volume(one.volume_occupancy)
            )
        });
        let exact = measured(one.volume_exact, one.volume_exact_error);
        line("material", format!("{}{name}: {sampled}{exact}", one.id));
    }
    let count = |pointer: &str| m.certainty.pointer(pointer).and_then(Value::as_u64);
    if let (Some(exact), Some(bounds)) = (count("/exact"), count("/lower_bound")) {
        let near = m.certainty.pointer("/within_three_voxels/exact_share");
        let near = near.and_then(Value::as_f64).unwrap_or(1.0);
        let share = format!("{near:.4} of those within three voxels exact");
        line(
            "distances",
            format!("{exact} exact, {bounds} lower bounds; {share}"),
        );
    }
    let total: u64 = m.files.iter().map(|f| f.bytes).sum();
    let files = format!("{}, {}", m.files.len(), output::bytes(total));
    let formats = m.formats.join(", ");
    let compression = m.compression.as_deref();
    let compression = compression.map_or_else(String::new, |c| format!(", {c}"));
    line("files", format!("{files}, {formats}{compression}"));
    lines
        .iter()
        .map(|[name, value]| format!("{name:<12} {value}\n"))
        .collect()
}
