//! Where text goes.

use super::arguments::{Color, Common};
use super::failure::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is said of an empty composite.
pub(super) const NOTHING_LEFT: &str =
    "nothing is left of the solids: what is added is all subtracted, or not in what intersects it";

/// Whether the document of this run is printed, or being printed: there is one, also where a signal comes.
static ANSWERED: AtomicBool = AtomicBool::new(false);

/// What is said where the total is more work than a run that samples waits for.
pub(super) const VOLUME_NOT_MEASURED: &str = "volume_exact: not measured, as the solids meet so often, or so nearly, that it would take longer than the sampling should wait, or one is some 10^7 times as long as another is thick";

/// The error of a measured volume, relative to it, up to which it is called exact.
const EXACT: f64 = 1e-9;

/// Whether a measured volume may be called exact.
pub(super) fn is_exact(value: f64, error: Option<f64>) -> bool {
    error.is_some_and(|e| e <= EXACT * value.abs())
}

/// A measured volume with its unit, and with its error where that says something.
pub(super) fn volume(value: f64, error: Option<f64>, units: &str) -> String {
    match error {
        Some(error) if !is_exact(value, Some(error)) => format!("{value} +- {error:.1e} {units}^3"),
        _ => format!("{value} {units}^3"),
    }
}

/// The user's wishes about output.
#[derive(Debug, Clone, Copy)]
pub(super) struct Console {
    json: bool,
    quiet: bool,
    colored: bool,
}

impl Console {
    pub(super) fn new(common: &Common) -> Self {
        let colored = match common.color {
            Color::Always => true,
            Color::Never => false,
            Color::Auto => {
                std::io::stderr().is_terminal()
                    && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
            }
        };
        Self {
            json: common.json,
            quiet: common.quiet,
            colored,
        }
    }

    pub(super) fn json(&self) -> bool {
        self.json
    }

    pub(super) fn colored(&self) -> bool {
        self.colored
    }

    /// A line for people, on standard error.
    pub(super) fn say(&self, text: &str) {
        if !self.quiet {
            // Nobody is left to tell when standard error is gone.
            let _ = writeln!(std::io::stderr(), "{}", visible(text));
        }
    }

    pub(super) fn warn(&self, text: &str) {
        let label = if self.colored {
            "\u{1b}[1;33mwarning\u{1b}[0m"
        } else {
            "warning"
        };
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{label}: {}", visible(text));
        }
    }

    /// The result: the document, or the text for people, on standard output.
    pub(super) fn result(&self, document: &serde_json::Value, text: &str) -> Result<(), Failure> {
        if self.json {
            self.document(document)
        } else if self.quiet {
            Ok(())
        } else {
            print(&visible(text))
        }
    }

    /// The one document of a run, on standard output.
    pub(super) fn document(&self, document: &serde_json::Value) -> Result<(), Failure> {
        if ANSWERED.swap(true, Ordering::SeqCst) {
            return Ok(());
        }
        print(&format!("{document:#}\n"))
    }

    /// A bar that counts to `length`; hidden where nobody watches.
    pub(super) fn bar(&self, length: u64, unit: &str) -> ProgressBar {
        let hidden = self.quiet || !std::io::stderr().is_terminal();
        let target = if hidden {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(length), target);
        if let Ok(style) = ProgressStyle::with_template(&format!(
            "{{bar:40}} {{pos}}/{{len}} {unit}  {{eta}} left"
        )) {
            bar.set_style(style);
        }
        bar
    }
}

/// Text with control characters, and those that turn the direction of writing, escaped: names come from files, and a
/// terminal obeys them. Lines stay lines.
pub(super) fn visible(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        turns || (c.is_control() && c != '\n' && c != '\t')
    };
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if obeyed(c) {
            shown.extend(c.escape_unicode());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Writes to standard output; a reader that has gone is no failure of ours.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::output(&e)),
        _ => Ok(()),
    }
}

/// A path in a document: JSON is Unicode, so that of a path which is not is replaced by U+FFFD.
pub(super) fn path(path: &Path) -> Cow<'_, str> {
    path.to_string_lossy()
}

/// Bytes as a person reads them.
#[allow(clippy::cast_precision_loss, reason = "only shown")]
pub(super) fn bytes(n: u64) -> String {
    const UNITS: [&str; 5] = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 {
        format!("{n} bytes")
    } else {
        format!("{value:.1} {}", UNITS[unit])
    }
}
