//! Files that a scene names: points of a curve, `points = { file = "wall.csv" }`, and texts of splines.
//!
//! One point on a line: r, z and optionally the weight, with a comma or blanks between. The first line may be names
//! of the columns. What follows `#` is a comment; empty lines mean nothing.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::{Fault, Place, Sources};
use super::limits::{MAX_FILE_POINTS, MAX_FILES, MAX_MAGNITUDE, MAX_TEXT_BYTES};
use super::model::PointModel;
use crate::io::open_regular;

/// Reads points files, within the limits of one scene.
#[derive(Debug)]
pub(super) struct PointFiles {
    base_dir: PathBuf,
    bytes_left: usize,
    points_left: usize,
    files_left: usize,
}

/// The points of a file.
#[derive(Debug)]
pub(super) struct FilePoints {
    pub(super) points: Vec<PointModel>,
    /// The weights, 1 where a line has none; `None` where no line has one.
    pub(super) weights: Option<Vec<f64>>,
    /// The first weight.
    pub(super) weight_place: Place,
}

impl PointFiles {
    /// Files are looked for in `base_dir` where their path is relative.
    pub(super) fn new(base_dir: &Path) -> Self {
        Self {
            base_dir: base_dir.to_owned(),
            bytes_left: MAX_TEXT_BYTES,
            points_left: MAX_FILE_POINTS,
            files_left: MAX_FILES,
        }
    }

    /// Reads the points of `file`, which the scene names at `place`, and adds its text to `sources`.
    pub(super) fn read(
        &mut self,
        file: &str,
        place: Place,
        sources: &mut Sources,
    ) -> Result<FilePoints, Fault> {
        let (source, text) = self.text(file, place, sources)?;
        let points = parse(&text, source, self.points_left)?;
        self.points_left -= points.points.len();
        Ok(points)
    }

    /// Reads the text of `file` and adds it to `sources`, where it gets a number.
    fn text(
        &mut self,
        file: &str,
        place: Place,
        sources: &mut Sources,
    ) -> Result<(u32, Arc<str>), Fault> {
        let bytes = self.bytes(file, place)?;
        let shown = self.base_dir.join(file).display().to_string();
        let text: Arc<str> = match String::from_utf8(bytes) {
            Ok(text) => text.into(),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let source = sources.add(shown, text.into(), false);
                return Err(Fault::found(
                    Place::new(source, at..at),
                    "bytes that are not utf-8",
                    "utf-8 text",
                ));
            }
        };
        let source = sources.add(shown, text.clone(), false);
        Ok((source, text))
    }

    /// Reads `file`, which the scene names at `place`.
    pub(super) fn bytes(&mut self, file: &str, place: Place) -> Result<Vec<u8>, Fault> {
        let Some(left) = self.files_left.checked_sub(1) else {
            let wanted = format!("at most {MAX_FILES} files in a scene");
            return Err(Fault::value(place, wanted));
        };
        self.files_left = left;
        let path = self.base_dir.join(file);
        let shown = path.display().to_string();
        let unreadable = |error| Fault::read(place, shown.clone(), error);
        let opened = match open_regular(&path) {
            Err(error) if error.kind() == ErrorKind::InvalidInput => {
                return Err(Fault::value(place, "a regular file"));
            }
            opened => opened.map_err(unreadable)?,
        };
        let mut bytes = Vec::new();
        (opened.take(self.bytes_left as u64 + 1))
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        if bytes.len() > self.bytes_left {
            return Err(Fault::value(
                place,
                format!("files of at most {MAX_TEXT_BYTES} bytes, all together"),
            ));
        }
        self.bytes_left -= bytes.len();
        Ok(bytes)
    }
}

fn parse(text: &str, source: u32, limit: usize) -> Result<FilePoints, Fault> {
    let mut points = Vec::new();
    let mut weights = Vec::new();
    let mut weight_place = None;
    let mut line_start = 0;
    let mut header_allowed = true;
    for line in text.split_inclusive('\n') {
        let start = line_start;
        line_start += line.len();
        let (line, start) = match line.strip_prefix('\u{feff}') {
            Some(rest) if start == 0 => (rest, start + '\u{feff}'.len_utf8()),
            _ => (line, start),
        };
        let line = line.split('#').next().unwrap_or_default().trim_end();
        if line.trim().is_empty() {
            continue;
        }
        if std::mem::take(&mut header_allowed) && is_header(line) {
            continue;
        }
        let Some((numbers, count, places)) = parse_line(line, start, source)? else {
            continue;
        };
        let whole = Place::new(source, places[0].span().start..places[count - 1].span().end);
        if count < 2 {
            return Err(Fault::found(
                whole,
                "one number on the line",
                "r and z, and optionally a weight",
            ));
        }
        if points.len() >= limit {
            return Err(Fault::value(
                whole,
                format!("at most {MAX_FILE_POINTS} points in the files of a scene"),
            ));
        }
        points.push(PointModel {
            r: numbers[0],
            z: numbers[1],
            place: whole,
        });
        if count == 3 {
            if numbers[2] <= 0.0 {
                return Err(Fault::value(places[2], super::fields::WEIGHT));
            }
            if weight_place
                .replace(weight_place.unwrap_or(places[2]))
                .is_none()
            {
                weights = vec![1.0; points.len() - 1];
            }
            weights.push(numbers[2]);
        } else if weight_place.is_some() {
            weights.push(1.0);
        }
    }
    points.shrink_to_fit();
    let end = Place::new(source, text.len()..text.len());
    if points.is_empty() {
        return Err(Fault::found(
            end,
            "no points",
            "lines of r and z, and optionally a weight",
        ));
    }
    Ok(FilePoints {
        points,
        weights: weight_place.map(|_| weights),
        weight_place: weight_place.unwrap_or(end),
    })
}

/// Whether a line is names of columns: two or three of them, of which none is a number or begins as one does.
fn is_header(line: &str) -> bool {
    let words: Vec<&str> = line
        .split(',')
        .flat_map(str::split_whitespace)
        .take(4)
        .collect();
    let is_name = |word: &&str| {
        let word = word.trim_matches('"');
        let numeric = word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        !word.is_empty() && !numeric && word.parse::<f64>().is_err()
    };
    (2..=3).contains(&words.len()) && words.iter().all(is_name)
}

/// Up to three numbers of a line that starts at byte `start` of the text; `None` for an empty line.
#[allow(
    clippy::type_complexity,
    reason = "numbers, how many of them, and the place of each"
)]
fn parse_line(
    line: &str,
    start: usize,
    source: u32,
) -> Result<Option<([f64; 3], usize, [Place; 3])>, Fault> {
    let mut numbers = [0.0; 3];
    let mut places = [Place::new(source, start..start); 3];
    let mut count = 0;
    let mut at = 0;
    let skip = |at: usize| {
        line[at..]
            .find(|c: char| !c.is_whitespace())
            .map_or(line.len(), |blanks| at + blanks)
    };
    let mut comma = false;
    loop {
        at = skip(at);
        if at == line.len() && !comma {
            break;
        }
        let length = line[at..]
            .find(|c: char| c == ',' || c.is_whitespace())
            .unwrap_or(line.len() - at);
        let place = Place::new(source, start + at..start + at + length);
        let word = &line[at..at + length];
        if count == 3 {
            return Err(Fault::value(
                place,
                "at most three numbers on a line: r, z and a weight",
            ));
        }
        if word.is_empty() {
            let found = if at == line.len() {
                "the end of the line"
            } else {
                "a comma"
            };
            return Err(Fault::found(place, found, "a number"));
        }
        numbers[count] = word
            .parse()
            .ok()
            .filter(|number: &f64| number.abs() <= MAX_MAGNITUDE)
            .ok_or_else(|| Fault::value(place, super::fields::FINITE))?;
        places[count] = place;
        count += 1;
        at = skip(at + length);
        comma = line[at..].starts_with(',');
        at += usize::from(comma);
    }
    Ok((count > 0).then_some((numbers, count, places)))
}
