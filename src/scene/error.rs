//! Why a scene was refused, and where in which text.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::limits::MAX_SHOWN;

/// Why a scene could not be taken.
///
/// [`Input`](Self::Input) is a scene that says something impossible; [`Read`](Self::Read) is a file
/// that could not be read, whatever it says.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The text of a scene, of a point file or of a `--set` is not acceptable.
    #[error("{problem}")]
    #[non_exhaustive]
    Input {
        /// What was found, where, and what was wanted.
        problem: Box<InputProblem>,
    },
    /// A file could not be read.
    #[error("cannot read {path}{}; check that it exists and that you may read it", asked_by.as_ref().map(|at| format!(", asked for by {at}")).unwrap_or_default())]
    #[non_exhaustive]
    Read {
        /// The file, as given.
        path: String,
        /// The place in the scene that names the file, where it is not the scene itself:
        /// `vase.toml:12:9: profiles.bowl.curves[1].points.file`.
        asked_by: Option<String>,
        /// What the system says.
        source: std::io::Error,
    },
}

impl SceneError {
    /// What was found, where, and what was wanted; `None` for a file that could not be read.
    pub fn problem(&self) -> Option<&InputProblem> {
        match self {
            Self::Input { problem } => Some(problem),
            Self::Read { .. } => None,
        }
    }

    /// The text the error is in and the bytes of it that are at fault, to be shown with a marker.
    pub fn source_text(&self) -> Option<(&str, Range<usize>)> {
        self.problem()
            .map(|problem| (&*problem.text, problem.span.clone()))
    }
}

/// Something in a text that cannot be.
///
/// It displays as one line, `scenes/vase.toml:12:9: profiles.bowl.curves[1].weights[3]: found -0.5,
/// wanted a finite number greater than 0, at most 1e100`, and a hint after a semicolon where there is one.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputProblem {
    /// The file as given, `<stdin>`, or `--set` and its argument.
    pub source_name: String,
    /// Whether the text is that of a `--set`; its line and column are then not displayed.
    pub from_set: bool,
    /// Whether the text is that of a file which the scene names: of such a file no more should be shown than `found`.
    pub from_file: bool,
    /// Line of the value, from 1.
    pub line: usize,
    /// Column of the value in characters, from 1.
    pub column: usize,
    /// Bytes of the value in `text`.
    pub span: Range<usize>,
    /// The key, as `solid[1].axis.x`; empty for the scene as a whole and for text that is not TOML
    /// or JSON at all.
    pub path: String,
    /// The offending value, shortened to some sixty characters.
    pub found: String,
    /// What would have been right.
    pub wanted: String,
    /// What to do, or the nearest valid name.
    pub hint: Option<String>,
    /// The whole text.
    pub text: Arc<str>,
}

impl fmt::Display for InputProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.source_name)?;
        if !self.from_set {
            write!(f, ":{}:{}", self.line, self.column)?;
        }
        if !self.path.is_empty() {
            write!(f, ": {}", self.path)?;
        }
        write!(f, ": found {}, wanted {}", self.found, self.wanted)?;
        if let Some(hint) = &self.hint {
            write!(f, "; {hint}")?;
        }
        Ok(())
    }
}

impl std::error::Error for InputProblem {}

/// A stretch of bytes in one of the texts a scene was made from.
///
/// Every value has one, so it is packed: the index of the text in [`Sources`], where the stretch begins, and its length.
/// Of a longer one the first half MiB is meant, which is more than anybody is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place(u64);

/// Bits of a [`Place`]'s length and of its start, which may be that of the end of a text of
/// [`MAX_TEXT_BYTES`](super::limits::MAX_TEXT_BYTES).
const LENGTH_BITS: u32 = 19;
const START_BITS: u32 = 27;
const _: () = assert!(super::limits::MAX_TEXT_BYTES < 1 << START_BITS);
const _: () = assert!(2 * super::limits::MAX_FILES < 1 << (u64::BITS - LENGTH_BITS - START_BITS));

impl Place {
    /// Bytes `span` of text `source`. Texts are at most [`super::MAX_TEXT_BYTES`] long.
    pub(super) fn new(source: u32, span: Range<usize>) -> Self {
        let start = span.start.min((1 << START_BITS) - 1);
        let length = span.end.saturating_sub(start).min((1 << LENGTH_BITS) - 1);
        Self(((u64::from(source) << START_BITS | start as u64) << LENGTH_BITS) | length as u64)
    }

    /// Index of its text in [`Sources`].
    fn source(self) -> usize {
        low_bits(self.0 >> (START_BITS + LENGTH_BITS), u32::BITS)
    }

    /// The bytes of the value in its text.
    pub fn span(self) -> Range<usize> {
        let start = low_bits(self.0 >> LENGTH_BITS, START_BITS);
        start..start + low_bits(self.0, LENGTH_BITS)
    }
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "no more than 32 bits are asked for"
)]
fn low_bits(packed: u64, bits: u32) -> usize {
    (packed & ((1 << bits) - 1)) as usize
}

/// The texts a scene was made from: the scene file, the `--set` arguments, the point files.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    list: Vec<Source>,
}

#[derive(Debug, Clone)]
struct Source {
    name: String,
    text: Arc<str>,
    from_set: bool,
}

impl Sources {
    pub(super) fn add(&mut self, name: String, text: Arc<str>, from_set: bool) -> u32 {
        self.list.push(Source {
            name,
            text,
            from_set,
        });
        u32::try_from(self.list.len() - 1).expect("as many texts as arguments and files")
    }

    fn text(&self, place: Place) -> &str {
        &self.list[place.source()].text
    }

    pub(super) fn name(&self, source: u32) -> &str {
        &self.list[source as usize].name
    }

    /// The text of a place on one line, at most some sixty characters of it.
    pub fn value_text(&self, place: Place) -> String {
        let text = self.text(place);
        let span = place.span();
        shorten(text.get(span).unwrap_or_default())
    }

    /// An error about the value at `place`.
    ///
    /// * `path`: the dotted key of the value.
    /// * `found`: what is there; `None` for the text of the value itself.
    /// * `wanted`: what would have been right; lower case, no full stop.
    /// * `hint`: what to do.
    pub fn error(
        &self,
        place: Place,
        path: &str,
        found: Option<String>,
        wanted: &str,
        hint: Option<String>,
    ) -> SceneError {
        let found = found.unwrap_or_else(|| self.value_text(place));
        let (line, column) = self.line_and_column(place);
        let source = &self.list[place.source()];
        SceneError::Input {
            problem: Box::new(InputProblem {
                source_name: source.name.clone(),
                from_set: source.from_set,
                from_file: place.source() != 0 && !source.from_set,
                line,
                column,
                span: place.span(),
                path: path.to_owned(),
                found,
                wanted: wanted.to_owned(),
                hint,
                text: Arc::clone(&source.text),
            }),
        }
    }

    /// Line and column of the start of a place, both from 1, the column in characters.
    pub fn line_and_column(&self, place: Place) -> (usize, usize) {
        let text = self.text(place);
        let mut start = place.span().start.min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let before = &text[..start];
        let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (line, before[line_start..].chars().count() + 1)
    }

    /// `scenes/vase.toml:12:9`, or `--set` and its argument.
    pub fn describe(&self, place: Place) -> String {
        let source = &self.list[place.source()];
        if source.from_set {
            return source.name.clone();
        }
        let (line, column) = self.line_and_column(place);
        format!("{}:{line}:{column}", source.name)
    }

    /// `line 12`, or the `--set` that says it: the place as seen from the same scene.
    pub(super) fn describe_line(&self, place: Place) -> String {
        if self.list[place.source()].from_set {
            return self.describe(place);
        }
        format!("line {}", self.line_and_column(place).0)
    }
}

/// At most [`MAX_SHOWN`] characters of `text` on one line: white space runs become one blank, other
/// control characters are escaped.
pub(super) fn shorten(text: &str) -> String {
    let mut short = String::new();
    let mut count = 0;
    let mut blank = false;
    // A text of blanks alone must not be walked to its end for nothing, hence the outer limit.
    for c in text.trim_start().chars().take(16 * MAX_SHOWN) {
        if c.is_whitespace() {
            blank = !short.is_empty();
            continue;
        }
        if count + usize::from(blank) >= MAX_SHOWN {
            short.push_str("...");
            return short;
        }
        if blank {
            short.push(' ');
            count += 1;
            blank = false;
        }
        if c.is_control() {
            short.extend(c.escape_default());
        } else {
            short.push(c);
        }
        count += 1;
    }
    short
}

/// One step from a value to a value inside it.
#[derive(Debug, Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// An error on its way up from the value to the scene: each level adds its step of the path.
#[derive(Debug)]
pub(super) struct Fault(Box<FaultBody>);

#[derive(Debug)]
struct FaultBody {
    place: Place,
    /// Innermost step first.
    steps: Vec<Step>,
    kind: FaultKind,
}

#[derive(Debug)]
enum FaultKind {
    Input {
        /// Put before the text of the value: `a string `; or, with `Some` below, nothing.
        prefix: &'static str,
        /// What was found where it is not the text of the value.
        found: Option<String>,
        wanted: String,
        hint: Option<String>,
    },
    Read {
        path: String,
        source: std::io::Error,
    },
}

impl Fault {
    /// The value at `place` is not what was wanted.
    pub(super) fn value(place: Place, wanted: impl Into<String>) -> Self {
        Self::typed(place, "", wanted)
    }

    /// As [`value`](Self::value), with the type of the value put before its text.
    pub(super) fn typed(place: Place, prefix: &'static str, wanted: impl Into<String>) -> Self {
        Self(Box::new(FaultBody {
            place,
            steps: Vec::new(),
            kind: FaultKind::Input {
                prefix,
                found: None,
                wanted: wanted.into(),
                hint: None,
            },
        }))
    }

    /// What is at `place` is `found`, in words.
    pub(super) fn found(place: Place, found: impl Into<String>, wanted: impl Into<String>) -> Self {
        Self(Box::new(FaultBody {
            place,
            steps: Vec::new(),
            kind: FaultKind::Input {
                prefix: "",
                found: Some(found.into()),
                wanted: wanted.into(),
                hint: None,
            },
        }))
    }

    /// The file `path`, named at `place`, could not be read.
    pub(super) fn read(place: Place, path: String, source: std::io::Error) -> Self {
        Self(Box::new(FaultBody {
            place,
            steps: Vec::new(),
            kind: FaultKind::Read { path, source },
        }))
    }

    pub(super) fn with_hint(mut self, text: Option<String>) -> Self {
        if let FaultKind::Input { hint, .. } = &mut self.0.kind {
            *hint = text;
        }
        self
    }

    pub(super) fn at_key(mut self, key: &str) -> Self {
        self.0.steps.push(Step::Key(key.to_owned()));
        self
    }

    pub(super) fn at_index(mut self, index: usize) -> Self {
        self.0.steps.push(Step::Index(index));
        self
    }

    /// The error with its place worked out.
    pub(super) fn into_error(self, sources: &Sources) -> SceneError {
        let mut path = String::new();
        for step in self.0.steps.iter().rev() {
            match step {
                Step::Key(key) => push_key(&mut path, key),
                Step::Index(index) => push_index(&mut path, *index),
            }
        }
        let place = self.0.place;
        match self.0.kind {
            FaultKind::Input {
                prefix,
                found,
                wanted,
                hint,
            } => {
                let found = found.unwrap_or_else(|| match (prefix, sources.value_text(place)) {
                    ("null", text) => text,
                    (prefix, text) if prefix.is_empty() || text.is_empty() => {
                        format!("{prefix}{text}")
                    }
                    (prefix, text) => format!("{prefix} {text}"),
                });
                sources.error(place, &path, Some(found), &wanted, hint)
            }
            FaultKind::Read { path: file, source } => SceneError::Read {
                path: file,
                asked_by: Some(format!("{}: {path}", sources.describe(place))),
                source,
            },
        }
    }
}

/// Adds the step of a path to an error passing by.
pub(super) trait At {
    fn at_key(self, key: &str) -> Self;
    fn at_index(self, index: usize) -> Self;
}

impl<T> At for Result<T, Fault> {
    fn at_key(self, key: &str) -> Self {
        self.map_err(|fault| fault.at_key(key))
    }

    fn at_index(self, index: usize) -> Self {
        self.map_err(|fault| fault.at_index(index))
    }
}

/// Appends `.key` to a path, in quotes where the key is not a bare TOML key.
pub(super) fn push_key(path: &mut String, key: &str) {
    if !path.is_empty() {
        path.push('.');
    }
    let bare = !key.is_empty()
        && key
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare && key.len() <= MAX_SHOWN {
        path.push_str(key);
    } else {
        path.push('"');
        path.push_str(&shorten(key));
        path.push('"');
    }
}

/// Appends `[index]` to a path.
pub(super) fn push_index(path: &mut String, index: usize) {
    path.push_str(&format!("[{index}]"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_lines_count_line_feeds() {
        let mut sources = Sources::default();
        let text = "a = 1\r\n\"größe\" = 2\n";
        let id = sources.add("x.toml".into(), text.into(), false);
        let at = text.find('2').expect("in the text");
        assert_eq!(sources.line_and_column(Place::new(id, at..at + 1)), (2, 11));
        assert_eq!(sources.line_and_column(Place::new(id, 0..0)), (1, 1));
        let end = text.len();
        assert_eq!(sources.line_and_column(Place::new(id, end..end)), (3, 1));
    }

    #[test]
    fn values_are_shortened_to_one_line() {
        assert_eq!(shorten("  [1,\n   2]\n"), "[1, 2]");
        assert_eq!(shorten("a\u{1b}[31m"), "a\\u{1b}[31m");
        let long = shorten(&"123456789 ".repeat(1000));
        assert!(long.ends_with("...") && long.len() <= 64, "{long}");
        assert_eq!(shorten(&"x".repeat(60)), "x".repeat(60));
    }

    #[test]
    fn paths_quote_what_is_not_bare() {
        let mut path = String::from("profiles");
        push_key(&mut path, "my bowl");
        push_key(&mut path, "curves");
        push_index(&mut path, 2);
        assert_eq!(path, "profiles.\"my bowl\".curves[2]");
    }
}
