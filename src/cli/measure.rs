//! `voxlathe measure`: volume, area, centroid, inertia and bounds.

use super::arguments::{Common, Measure};
use super::failure::Failure;
use super::interrupt;
use super::output::{Console, NOTHING_LEFT};
use crate::error::Error;
use crate::math::Aabb;
use crate::scene::Scene;
use crate::solid::Measures;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::process::ExitCode;

/// What is said where the total would take minutes.
const NOT_MEASURED: &str = "total: not measured, as so many solids meet that it would take minutes, or one is some 10^7 times as long as another is thick; measure fewer at a time";

pub(super) fn run(
    arguments: &Measure,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    let solids = scene
        .assembly()
        .parts()
        .par_iter()
        .map(|part| {
            interrupt::check()?;
            Ok((part.name(), part.measures()))
        })
        .collect::<Result<Vec<_>, Error>>()?;
    interrupt::check()?;
    let total = match &solids[..] {
        [(_, only)] => Some(*only),
        _ => scene.measures(),
    };
    let mut warnings = scene.warnings().to_vec();
    if total.is_none() {
        warnings.push(NOT_MEASURED.into());
    } else if total.is_some_and(|t| t.area == 0.0) {
        warnings.push(NOTHING_LEFT.into());
    }
    for warning in &warnings {
        console.warn(warning);
    }
    let units = scene.model().units.name();
    let document = json!({
        "scene": scene.name(),
        "units": units,
        "solids": solids.iter().map(|(name, m)| named(name, m)).collect::<Vec<_>>(),
        "total": total.as_ref().map(entry),
        "warnings": warnings,
    });
    console.result(&document, &table(&solids, total.as_ref(), units))?;
    Ok(ExitCode::SUCCESS)
}

/// A solid's measures as the document has them.
fn named(name: &str, m: &Measures) -> Value {
    let mut value = entry(m);
    value["name"] = json!(name);
    value
}

fn entry(m: &Measures) -> Value {
    let e = &m.error_estimate;
    json!({
        "volume": m.volume,
        "area": m.area,
        "centroid": m.centroid.map(|c| c.to_array()),
        "inertia": m.inertia,
        "bounds": m.bounds.map(|b| [b.min.to_array(), b.max.to_array()]),
        "error_estimate": {
            "volume": e.volume,
            "area": e.area,
            "centroid": m.centroid.map(|_| e.centroid),
            "inertia": e.inertia,
        },
    })
}

/// The measures for people; the total where it is not that of the only solid.
fn table(solids: &[(&str, Measures)], total: Option<&Measures>, units: &str) -> String {
    let mut text = String::new();
    for (name, measures) in solids {
        block(&mut text, name, measures, units);
    }
    if let Some(total) = total.filter(|_| solids.len() > 1) {
        block(&mut text, "total", total, units);
    }
    text
}

fn block(text: &mut String, name: &str, m: &Measures, units: &str) {
    let e = &m.error_estimate;
    // Writing to a string does not fail.
    let _ = writeln!(text, "{name}");
    let scalar = |v: f64, error: f64| format!("{} {units}", number(v, error));
    let _ = writeln!(
        text,
        "  volume     {}^3  +- {:.1e}",
        scalar(m.volume, e.volume),
        e.volume
    );
    let _ = writeln!(
        text,
        "  area       {}^2  +- {:.1e}",
        scalar(m.area, e.area),
        e.area
    );
    match m.centroid {
        Some(c) => {
            let c = row(&c.to_array(), e.centroid);
            let _ = writeln!(text, "  centroid   {c} {units}  +- {:.1e}", e.centroid);
        }
        None => text.push_str("  centroid   none\n"),
    }
    for (i, line) in m.inertia.iter().enumerate() {
        let label = if i == 0 { "inertia" } else { "" };
        let line = row(line, e.inertia);
        let _ = if i == 0 {
            writeln!(text, "  {label:<10} {line} {units}^5  +- {:.1e}", e.inertia)
        } else {
            writeln!(text, "  {label:<10} {line}")
        };
    }
    let bounds = |b: &Aabb| {
        let corner = |c: [f64; 3]| row(&c, 0.0);
        let (min, max) = (corner(b.min.to_array()), corner(b.max.to_array()));
        format!("{min} to {max} {units}")
    };
    let bounds = m.bounds.as_ref().map_or_else(|| "none".into(), bounds);
    let _ = writeln!(text, "  bounds     {bounds}");
}

fn row(values: &[f64], error: f64) -> String {
    let shown: Vec<String> = values.iter().map(|&v| number(v, error)).collect();
    format!("[{}]", shown.join(", "))
}

/// All digits, or 0 where the number does not differ from it.
fn number(v: f64, error: f64) -> String {
    if v.abs() <= error || v == 0.0 {
        "0".into()
    } else if (1e-5..1e16).contains(&v.abs()) {
        format!("{v}")
    } else {
        format!("{v:e}")
    }
}
