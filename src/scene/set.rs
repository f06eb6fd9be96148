//! `--set path=value`: a change to the tree of values before it is read as a scene.
//!
//! `grid.padding=4`, `solid.0.axis.x=[0, 1, 0]` or `solid[0].angle=90`,
//! `profiles."my bowl".fill=nonzero`. The value is TOML, or else a string as it stands. Missing keys
//! are made, tables on the way included; whether a key is known is decided with all the others, so
//! that a slip in a `--set` gets the same answer as one in the file. Elements of arrays must exist.

use super::error::{Fault, Place};
use super::limits::MAX_SET_SEGMENTS;
use super::value::{Entry, Kind, Value, from_toml_value};

/// One step of the path: a key or an index, and where it stands in the argument.
struct Segment {
    text: String,
    place: Place,
}

/// Applies `argument`, which is text `source` among the sources, to the scene in `root`.
pub(super) fn apply(root: &mut Value, argument: &str, source: u32) -> Result<(), Fault> {
    let (segments, value_at) = split(argument, source)?;
    let value = read_value(argument, value_at, source);
    let mut current = root;
    for (depth, segment) in segments.iter().enumerate() {
        current = descend(current, segment).map_err(|fault| {
            segments[..=depth]
                .iter()
                .rev()
                .fold(fault, |fault, passed| match passed.text.parse() {
                    Ok(index) => fault.at_index(index),
                    Err(_) => fault.at_key(&passed.text),
                })
        })?;
    }
    *current = value;
    Ok(())
}

/// The element of `current` that `segment` names; made, as an empty table, where a key is missing.
fn descend<'a>(current: &'a mut Value, segment: &Segment) -> Result<&'a mut Value, Fault> {
    let type_name = current.type_name();
    match &mut current.kind {
        Kind::Table(entries) => {
            let at = match entries.iter().position(|entry| entry.key == segment.text) {
                Some(at) => at,
                None => {
                    entries.push(Entry {
                        key: segment.text.clone(),
                        key_place: segment.place,
                        value: Value {
                            kind: Kind::Table(Vec::new()),
                            place: segment.place,
                        },
                    });
                    entries.len() - 1
                }
            };
            Ok(&mut entries[at].value)
        }
        Kind::Array(elements) => {
            let count = elements.len();
            segment
                .text
                .parse::<usize>()
                .ok()
                .and_then(|index| elements.get_mut(index))
                .ok_or_else(|| {
                    let wanted = match count {
                        0 => "another key: the array here is empty".to_owned(),
                        1 => "the index 0 of the one element here".to_owned(),
                        _ => format!("an index from 0 to {}", count - 1),
                    };
                    Fault::value(segment.place, wanted)
                })
        }
        _ => Err(Fault::found(
            segment.place,
            format!("{type_name} before it"),
            "a table or an array to go into",
        )),
    }
}

/// The value from byte `at` on: TOML, else the string itself.
fn read_value(argument: &str, at: usize, source: u32) -> Value {
    let raw = &argument[at..];
    let trimmed = raw.trim();
    let start = at + (raw.len() - raw.trim_start().len());
    from_toml_value(trimmed, source, start).unwrap_or_else(|| Value {
        kind: Kind::String(trimmed.into()),
        place: Place::new(source, start..start + trimmed.len()),
    })
}

/// The steps of the path, and the byte where the value starts.
fn split(argument: &str, source: u32) -> Result<(Vec<Segment>, usize), Fault> {
    const WANTED: &str = "path=value, as grid.padding=4 or solid.0.angle=90";
    let whole = Place::new(source, 0..argument.len());
    let malformed = || Fault::value(whole, WANTED);
    let bytes = argument.as_bytes();
    let mut segments = Vec::new();
    let mut at = 0;
    loop {
        let start = at;
        let text = match bytes.get(at) {
            Some(quote @ (b'"' | b'\'')) => {
                let length = argument[at + 1..]
                    .bytes()
                    .position(|byte| byte == *quote)
                    .ok_or_else(malformed)?;
                at += length + 2;
                &argument[start + 1..at - 1]
            }
            _ => {
                let length = argument[at..]
                    .bytes()
                    .position(|byte| matches!(byte, b'.' | b'=' | b'['))
                    .ok_or_else(malformed)?;
                at += length;
                argument[start..at].trim()
            }
        };
        if text.is_empty() && at == start {
            return Err(malformed());
        }
        segments.push(Segment {
            text: text.to_owned(),
            place: Place::new(source, start..at),
        });
        while bytes.get(at) == Some(&b'[') {
            let length = argument[at..]
                .bytes()
                .position(|byte| byte == b']')
                .ok_or_else(malformed)?;
            let place = Place::new(source, at + 1..at + length);
            let index = argument[at + 1..at + length].trim();
            if index.parse::<usize>().is_err() {
                return Err(Fault::value(place, "an array index from 0"));
            }
            segments.push(Segment {
                text: index.to_owned(),
                place,
            });
            at += length + 1;
        }
        if segments.len() > MAX_SET_SEGMENTS {
            return Err(Fault::found(
                whole,
                "a longer path",
                format!("a path of at most {MAX_SET_SEGMENTS} steps"),
            ));
        }
        while bytes.get(at) == Some(&b' ') {
            at += 1;
        }
        match bytes.get(at) {
            Some(b'=') => return Ok((segments, at + 1)),
            Some(b'.') => at += 1,
            _ => return Err(malformed()),
        }
        while bytes.get(at) == Some(&b' ') {
            at += 1;
        }
    }
}
