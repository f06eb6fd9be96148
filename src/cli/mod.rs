//! The command: arguments in, files and reports out. One file per command.
//!
//! Results go to standard output, everything meant for people while it runs to standard error.

mod arguments;
mod bench;
mod converge;
mod export;
mod failure;
mod formats;
mod generate;
mod info;
mod interrupt;
mod measure;
mod memory;
mod mesh;
mod output;
mod query;
mod render;
mod space;
mod step;
mod validate;
mod view;
mod voxelize;

use arguments::{Arguments, Command};
use clap::Parser;
use failure::Failure;
use output::Console;
use std::process::ExitCode;

/// Runs the command with the process's arguments.
#[must_use]
pub fn run() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version come this way too, and are no failure.
            let code = if error.use_stderr() { 2 } else { 0 };
            return match error.print() {
                Ok(()) => ExitCode::from(code),
                Err(_) => ExitCode::from(3),
            };
        }
    };
    let console = Console::new(&arguments.common);
    match execute(&arguments, &console) {
        Ok(code) => code,
        Err(failure) => {
            interrupt::yield_to_end();
            failure.report(&console)
        }
    }
}

fn execute(arguments: &Arguments, console: &Console) -> Result<ExitCode, Failure> {
    let common = &arguments.common;
    if common.verbose {
        tracing_subscriber::fmt()
            .with_writer(std::io::stderr)
            .with_ansi(console.colored())
            .with_max_level(tracing::Level::DEBUG)
            .with_target(false)
            .init();
    }
    start_threads(common.threads.map(std::num::NonZeroUsize::get))?;
    interrupt::listen(*console);
    match &arguments.command {
        Command::Voxelize(a) => voxelize::run(a, common, console),
        Command::Query(a) => query::run(a, common, console),
        Command::Measure(a) => measure::run(a, common, console),
        Command::Validate(a) => validate::run(a, common, console),
        Command::Converge(a) => converge::run(a, common, console),
        Command::Mesh(a) => mesh::run(a, common, console),
        Command::Export(a) => export::run(a, common, console),
        Command::Render(a) => render::run(a, common, console),
        Command::View(a) => view::run(a, common, console),
        Command::Bench(a) => bench::run(a, common, console),
        Command::Info(a) => info::run(a, common, console),
        Command::Generate(a) => generate::run(a),
    }
}

/// More threads than this help nobody, however many cores there are.
const MOST_THREADS: usize = 64;

/// Starts the threads that everything runs on: so many, or as many as `RAYON_NUM_THREADS` says, or one for each core.
fn start_threads(asked: Option<usize>) -> Result<(), Failure> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let most = MOST_THREADS.max(4 * cores);
    let named = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok();
    let (threads, by) = match asked {
        Some(threads) => (threads, "--threads"),
        None => match named().filter(|threads| *threads > 0) {
            Some(threads) => (threads, "RAYON_NUM_THREADS"),
            None => (cores, "without --threads"),
        },
    };
    if asked.is_some() || by == "RAYON_NUM_THREADS" {
        check_threads(threads, by, most)?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global().map_err(|error| {
        Failure::files(format!(
            "cannot start {threads} threads: {error}; give a smaller --threads, or allow the process more threads or memory"
        ))
    })
}

fn check_threads(threads: usize, by: &str, most: usize) -> Result<(), Failure> {
    if threads <= most {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "{by}: {threads} threads are more than {most}, the most that are started; leave it out for one for each core"
    )))
}
