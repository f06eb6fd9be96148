//! `voxlathe query`: membership and distance at given points.

use super::arguments::{Column, Common, Query};
use super::failure::Failure;
use super::interrupt;
use super::output::{self, Console};
use crate::error::Error;
use crate::io::points;
use crate::scene::Scene;
use clap::ValueEnum;
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;

/// What stands for standard input.
const STDIN: &str = "-";

/// Points between two looks at the interrupt flag.
const CHUNK: usize = 4096;

pub(super) fn run(
    arguments: &Query,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    if [&arguments.scene, &arguments.points]
        .into_iter()
        .all(|p| p == Path::new(STDIN))
    {
        return Err(Failure::usage(
            "the scene and --points are both -; standard input holds one of them".to_owned(),
        ));
    }
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    for warning in scene.warnings() {
        console.warn(warning);
    }
    for (i, column) in arguments.columns.iter().enumerate() {
        if arguments.columns[..i].contains(column) {
            let name = column
                .to_possible_value()
                .map_or_else(String::new, |v| v.get_name().to_owned());
            return Err(Failure::usage(format!(
                "--columns: {name:?} is given twice"
            )));
        }
    }
    if let Some(path) = &arguments.output {
        points::check_table_name(path)?;
    }
    let points = if arguments.points == Path::new(STDIN) {
        points::read_csv_points("<stdin>", std::io::stdin().lock())?
    } else {
        points::read_points(&arguments.points)?
    };
    let bar = console.bar(points.len() as u64, "points");
    let solid = scene.assembly();
    let answers = points
        .par_chunks(CHUNK)
        .map(|chunk| {
            interrupt::check()?;
            let values: Vec<(f64, bool)> = chunk
                .iter()
                .map(|&p| solid.signed_distance_with_certainty(p))
                .collect();
            bar.inc(chunk.len() as u64);
            Ok(values)
        })
        .collect::<Result<Vec<_>, Error>>()?
        .concat();
    bar.finish_and_clear();
    let distances: Vec<f64> = answers.iter().map(|a| a.0).collect();
    let certainty: Vec<f64> = answers.iter().map(|a| f64::from(u8::from(a.1))).collect();
    // The sign is that of the membership, so the one column follows from the other.
    let inside: Vec<f64> = distances
        .iter()
        .map(|&d| f64::from(u8::from(d <= 0.0)))
        .collect();
    let columns: Vec<(&str, &[f64])> = arguments
        .columns
        .iter()
        .map(|c| match c {
            Column::Inside => ("inside", inside.as_slice()),
            Column::Sdf => ("sdf", distances.as_slice()),
            Column::Certainty => ("certainty", certainty.as_slice()),
        })
        .collect();
    let count = inside.iter().filter(|&&v| v != 0.0).count();
    if let Some(path) = &arguments.output {
        points::write_columns(path, &columns)?;
    }
    if console.json() {
        let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
        let rows = arguments.output.is_none().then(|| {
            (0..points.len())
                .map(|i| columns.iter().map(|c| c.1[i]).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        });
        let document = json!({
            "points": points.len(),
            "inside": count,
            "units": scene.model().units.name(),
            "columns": names,
            "rows": rows,
            "file": arguments.output.as_deref().map(output::path),
            "warnings": scene.warnings(),
        });
        console.result(&document, "")?;
    } else if arguments.output.is_none() {
        let mut bytes = Vec::new();
        points::write_csv(&mut bytes, &columns).map_err(|e| Failure::output(&e))?;
        output::print(&String::from_utf8_lossy(&bytes))?;
    } else {
        console.say(&format!("{} points, {count} inside", points.len()));
    }
    Ok(ExitCode::SUCCESS)
}
