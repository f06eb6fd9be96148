//! `voxlathe converge`: errors over several resolutions.

use super::arguments::{Common, Converge};
use super::failure::Failure;
use super::interrupt;
use super::memory::{Budget, Need};
use super::output::{self, Console};
use crate::converge::{Plan, Row, Study, bytes_per_worker, study_with};
use crate::io::{IoError, StackDirectory};
use crate::scene::Scene;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

const TABLE: &str = "converge.csv";
const PLOT: &str = "converge.png";
const PAGE: &str = "converge.html";
/// What drawing and compressing the plot takes.
const PLOT_BYTES: u64 = 12 << 20;

pub(super) fn run(
    arguments: &Converge,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    for warning in scene.warnings() {
        console.warn(warning);
    }
    let names = [TABLE, PLOT, PAGE];
    let output = arguments.output.as_deref();
    let writer = output
        .map(|path| StackDirectory::create_for(path, &names, arguments.force))
        .transpose()
        .map_err(refused)?;
    let plan = Plan {
        resolutions: arguments.resolutions.clone(),
        offsets: arguments.offsets,
    };
    let need = Need {
        what: "the process with a layer of the finest grid at a time",
        fixed: PLOT_BYTES,
        each: bytes_per_worker(&scene, &plan)?,
        remedy: "lower the highest of --resolutions",
    };
    let budget = Budget::new(arguments.memory_limit);
    let workers = budget.workers(&need, rayon::current_num_threads())?;
    let bar = console.bar(plan.resolutions.len() as u64, "resolutions");
    let study = || {
        study_with(workers, &scene, &plan, &interrupt::check, &mut |_| {
            bar.inc(1)
        })
    };
    // Each resolution has tables of its own.
    let what = "the process with the tables of its solids";
    let found = budget.while_watched(what, need.remedy, console, study)?;
    bar.finish_and_clear();
    let mut files = Vec::new();
    if let Some(writer) = writer {
        let png = found
            .plot(scene.name(), scene.model().units.name())
            .to_png()?;
        let path = writer.path().to_path_buf();
        let units = scene.model().units.name();
        let page = found.page(scene.name(), &scene.hash(), units, &png);
        let contents = [csv(&found).into_bytes(), png, page.into_bytes()];
        for (name, bytes) in names.into_iter().zip(contents) {
            writer.write_file(name, &bytes)?;
            files.push(path.join(name));
        }
        writer.commit_files()?;
    }
    let document = json!({
        "scene": scene.name(),
        "units": scene.model().units.name(),
        "reference": scene.model().resolve().get("reference"),
        "volume": found.volume,
        "volume_error": found.volume_error,
        "offsets": plan.offsets,
        "rows": found.rows.iter().map(entry).collect::<Vec<_>>(),
        "orders": orders(&found),
        "files": files.iter().map(|f| output::path(f)).collect::<Vec<_>>(),
        "warnings": scene.warnings(),
    });
    console.result(&document, &table(&found, scene.model().units.name()))?;
    Ok(ExitCode::SUCCESS)
}

/// A directory that holds something is kept as it is unless the user says otherwise.
fn refused(error: IoError) -> Failure {
    match error {
        IoError::NotEmpty { path, .. } => Failure::usage(format!(
            "{} is not empty; choose another directory, or add --force to replace {TABLE}, {PLOT} and {PAGE} in it",
            path.display()
        )),
        other => other.into(),
    }
}

fn entry(row: &Row) -> Value {
    json!({
        "resolution": row.resolution,
        "spacing": row.spacing,
        "volume_occupancy_error": row.volume_occupancy_error,
        "volume_occupancy_mean_error": row.volume_occupancy_mean_error,
        "volume_fraction_error": row.volume_fraction_error,
        "volume_fraction_bound": row.volume_fraction_bound,
        "sdf_max_error": row.sdf_max_error,
        "sdf_mean_error": row.sdf_mean_error,
    })
}

fn orders(study: &Study) -> Value {
    json!({
        "volume_occupancy_error": study.orders.volume_occupancy_error,
        "volume_fraction_error": study.orders.volume_fraction_error,
        "sdf_max_error": study.orders.sdf_max_error,
        "sdf_mean_error": study.orders.sdf_mean_error,
    })
}

/// A column: its name, and its value in a row.
type Column = (&'static str, fn(&Row) -> f64);

const COLUMNS: [Column; 7] = [
    ("spacing", |r| r.spacing),
    ("volume_occupancy_error", |r| r.volume_occupancy_error),
    ("volume_occupancy_mean_error", |r| {
        r.volume_occupancy_mean_error
    }),
    ("volume_fraction_error", |r| r.volume_fraction_error),
    ("volume_fraction_bound", |r| r.volume_fraction_bound),
    ("sdf_max_error", |r| r.sdf_max_error),
    ("sdf_mean_error", |r| r.sdf_mean_error),
];

fn csv(study: &Study) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|c| c.0).collect();
    let mut text = format!("resolution,{}\n", names.join(","));
    for row in &study.rows {
        // Writing to a string does not fail.
        let _ = write!(text, "{}", row.resolution);
        for (_, value) in COLUMNS {
            let _ = write!(text, ",{:e}", value(row));
        }
        text.push('\n');
    }
    text
}

fn table(study: &Study, units: &str) -> String {
    let mut text = format!(
        "volume {}; errors of volumes relative, of distances in {units}\n\n",
        output::volume(study.volume, Some(study.volume_error), units)
    );
    let head = [
        "resolution",
        "spacing",
        "occupancy",
        "mean",
        "fraction",
        "bound",
        "sdf max",
        "sdf mean",
    ];
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| format!("{c:>10}")).collect();
        cells.join("  ") + "\n"
    };
    text += &line(&head.map(str::to_owned));
    for row in &study.rows {
        let values = COLUMNS.map(|(_, value)| format!("{:.3e}", value(row)));
        let mut cells = vec![row.resolution.to_string()];
        cells.extend(values);
        text += &line(&cells);
    }
    let order = |o: Option<f64>| o.map_or_else(|| "-".to_owned(), |o| format!("{o:.2}"));
    let o = &study.orders;
    let blank = String::new;
    text += &line(&[
        "order".to_owned(),
        blank(),
        blank(),
        order(o.volume_occupancy_error),
        order(o.volume_fraction_error),
        blank(),
        order(o.sdf_max_error),
        order(o.sdf_mean_error),
    ]);
    text
}
