//! One tree of values with the place of each, for TOML and JSON alike.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Fault, Place, shorten};
use super::limits::{MAX_DEPTH, TOML_STACK_BYTES};

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
    String(String),
    Date,
    Array(Vec<Value>),
    /// In the order of the text, each key once.
    Table(Vec<Entry>),
}

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
    with_stack(|| {
        let table = DeTable::parse(text).map_err(|error| toml_fault(text, source, &error))?;
        let (span, table) = (table.span(), table.into_inner());
        Ok(Value {
            kind: table_kind(table, source, 0, 0)?,
            place: Place::new(source, span),
        })
    })
    .unwrap_or_else(|error| {
        let place = Place::new(source, 0..0);
        Err(Fault::read(place, "the scene".to_owned(), error))
    })
}

/// Reads a lone TOML value that stands at byte `offset` of text `source`; `None` if it is not TOML.
pub(super) fn from_toml_value(text: &str, source: u32, offset: usize) -> Option<Value> {
    with_stack(|| {
        DeValue::parse(text)
            .ok()
            .and_then(|value| convert(value, source, offset, 0).ok())
    })
    .ok()
    .flatten()
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

fn convert(
    value: Spanned<DeValue<'_>>,
    source: u32,
    offset: usize,
    depth: usize,
) -> Result<Value, Fault> {
    let span = value.span();
    let place = Place::new(source, span.start + offset..span.end + offset);
    if depth > MAX_DEPTH {
        return Err(Fault::found(
            place,
            "deeper nesting",
            format!("at most {MAX_DEPTH} arrays and tables inside each other"),
        ));
    }
    let kind = match value.into_inner() {
        DeValue::String(text) => Kind::String(text.into_owned()),
        DeValue::Boolean(is) => Kind::Bool(is),
        DeValue::Datetime(_) => Kind::Date,
        DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(value) => Kind::Integer(value),
            Err(_) if integer.radix() == 10 => float(integer.as_str(), place)?,
            Err(_) => return Err(Fault::value(place, "an integer of at most 64 bits")),
        },
        DeValue::Float(number) => float(number.as_str(), place)?,
        DeValue::Array(array) => Kind::Array(
            array
                .into_iter()
                .map(|element| convert(element, source, offset, depth + 1))
                .collect::<Result<_, _>>()?,
        ),
        DeValue::Table(table) => table_kind(table, source, offset, depth)?,
    };
    Ok(Value { kind, place })
}

/// The nearest f64 of a decimal number; infinity where it overflows, which no key accepts.
fn float(text: &str, place: Place) -> Result<Kind, Fault> {
    text.parse()
        .map(Kind::Float)
        .map_err(|_| Fault::value(place, "a number"))
}

fn table_kind(table: DeTable<'_>, source: u32, offset: usize, depth: usize) -> Result<Kind, Fault> {
    let mut entries = table
        .into_iter()
        .map(|(key, value)| {
            let span = key.span();
            Ok(Entry {
                key: key.into_inner().into_owned(),
                key_place: Place::new(source, span.start + offset..span.end + offset),
                value: convert(value, source, offset, depth + 1)?,
            })
        })
        .collect::<Result<Vec<_>, Fault>>()?;
    entries.sort_by_key(|entry| entry.key_place);
    Ok(Kind::Table(entries))
}
