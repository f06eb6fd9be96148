//! One tree of values with the place of each, for TOML and JSON alike.

use toml::de::DeTable;

use super::error::{Fault, Place, shorten};
use super::limits::{MAX_EXPLAINED, TOML_STACK_BYTES};
use super::toml_reader::{self, Refusal};

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Value {
    pub(super) kind: Kind,
    /// Of a TOML table with a header, the header; of an array of tables, its first header.
    pub(super) place: Place,
}

/// What a value is.
#[derive(Debug, Clone)]
pub(super) enum Kind {
    Null,
    Bool(bool),
    /// Written as an integer and within 64 bits.
    Integer(i64),
    /// Any other number; not finite where it was written so or overflows.
    Float(f64),
    String(Box<str>),
    Date,
    Array(Box<[Value]>),
    /// In the order of the text, each key once.
    Table(Vec<Entry>),
}

// Arrays of a million numbers are nothing out of the way.
const _: () = assert!(size_of::<Value>() <= 32);

/// A key and its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) key_place: Place,
    pub(super) value: Value,
}

impl Value {
    /// The type in words, to be put before the text of the value.
    pub(super) fn type_name(&self) -> &'static str {
        match self.kind {
            Kind::Null => "null",
            Kind::Bool(_) => "a boolean",
            Kind::Integer(_) | Kind::Float(_) => "a number",
            Kind::String(_) => "a string",
            Kind::Date => "a date",
            Kind::Array(_) => "an array",
            Kind::Table(_) => "a table",
        }
    }

    /// This value has the wrong type.
    pub(super) fn wrong_type(&self, wanted: impl Into<String>) -> Fault {
        Fault::typed(self.place, self.type_name(), wanted)
    }
}

/// Reads a TOML document. `source` is the index of `text` among the sources.
pub(super) fn from_toml(text: &str, source: u32) -> Result<Value, Fault> {
    toml_reader::document(text, source).map_err(|refusal| match refusal {
        Refusal::Syntax(fault) if text.len() <= MAX_EXPLAINED => {
            explained(text, source).unwrap_or(fault)
        }
        other => other.into_fault(),
    })
}

/// Reads a lone TOML value that stands at byte `offset` of text `source`; `None` if it is not TOML.
pub(super) fn from_toml_value(text: &str, source: u32, offset: usize) -> Option<Value> {
    toml_reader::lone_value(text, source, offset).ok()
}

/// What the `toml` crate says of a short text: it knows what is meant by many a slip.
fn explained(text: &str, source: u32) -> Option<Fault> {
    let error = with_stack(|| DeTable::parse(text).err()).ok()??;
    Some(toml_fault(text, source, &error))
}

/// Does the work where recursion has room: see [`TOML_STACK_BYTES`].
fn with_stack<T: Send>(work: impl FnOnce() -> T + Send) -> std::io::Result<T> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .name("toml".to_owned())
            .stack_size(TOML_STACK_BYTES)
            .spawn_scoped(scope, work)?;
        match thread.join() {
            Ok(value) => Ok(value),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

fn toml_fault(text: &str, source: u32, error: &toml::de::Error) -> Fault {
    let span = error.span().unwrap_or(text.len()..text.len());
    let span = span.start.min(text.len())..span.end.min(text.len());
    let found = shorten(text.get(span.clone()).unwrap_or_default());
    let place = Place::new(source, span.clone());
    if error.message() == "duplicate key" {
        return Fault::found(place, format!("a second `{found}`"), "each key once");
    }
    let found = if span.start >= text.len() {
        "the end of the text".to_owned()
    } else if found.is_empty() {
        let rest = text.get(span.start..).unwrap_or_default();
        match rest.lines().next().unwrap_or_default().trim() {
            "" => "the end of the line".to_owned(),
            line => format!("`{}`", shorten(line)),
        }
    } else {
        format!("`{found}`")
    };
    let reason = error.message().replace(['\n', '\r'], " ");
    Fault::found(place, found, format!("valid toml ({reason})"))
}
