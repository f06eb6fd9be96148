//! TOML with the place of every value, in little more memory than the values themselves.
//!
//! TOML 1.1 (so 1.0, too), read in one pass: no list of tokens or events comes between the text and the tree. An element
//! of an array takes 32 bytes, whatever it is written with. Keys are unique; nesting is at most [`MAX_DEPTH`] deep, so the
//! recursion is. A number beyond the range of f64 becomes infinite here and is refused by the key that reads it.
//!
//! Tables are made as the specification has it: a header makes its table and may stand once, `[[header]]` adds one to
//! an array of tables, dotted keys make tables that headers may not make again, and inline tables are closed.

use std::collections::HashMap;
use std::ops::Range;

use super::error::{Fault, Place, shorten};
use super::limits::{MAX_DEPTH, MAX_KEYS, MAX_TABLES};
use super::value::{Entry, Kind, Value};

/// Why a text is refused.
pub(super) enum Refusal {
    /// It is no TOML.
    Syntax(Fault),
    /// It is more than is read.
    Limit(Fault),
}

impl Refusal {
    pub(super) fn into_fault(self) -> Fault {
        match self {
            Self::Syntax(fault) | Self::Limit(fault) => fault,
        }
    }
}

/// Reads a document. `source` is the index of `text` among the sources.
pub(super) fn document(text: &str, source: u32) -> Result<Value, Refusal> {
    let mut reader = Reader::new(text, source, 0);
    if text.starts_with('\u{feff}') {
        reader.at = '\u{feff}'.len_utf8();
    }
    let mut state = State::default();
    loop {
        reader.skip_blanks();
        match reader.peek() {
            None => break,
            Some(b'[') => {
                let header = reader.header()?;
                state.finish(&mut reader)?;
                state.start(&mut reader, header)?;
            }
            Some(b'#' | b'\n' | b'\r') => {}
            Some(_) => reader.key_value(&mut state.current, 1, false)?,
        }
        reader.line_end()?;
    }
    state.finish(&mut reader)?;
    Ok(Value {
        kind: state.root.into_kind(),
        place: Place::new(source, 0..text.len()),
    })
}

/// Reads a lone value that stands at byte `offset` of text `source`.
pub(super) fn lone_value(text: &str, source: u32, offset: usize) -> Result<Value, Refusal> {
    let mut reader = Reader::new(text, source, offset);
    let value = reader.value(0)?;
    match reader.peek() {
        None => Ok(value),
        Some(_) => Err(reader.unexpected("the end of the value")),
    }
}

/// What is above the first `outer` values.
pub(super) fn taken_from(values: &mut Vec<Value>, outer: usize) -> Box<[Value]> {
    match outer {
        // Many are not copied.
        0 => std::mem::take(values).into(),
        _ => values.drain(outer..).collect(),
    }
}

/// A table while keys are added to it.
#[derive(Default)]
struct Table {
    slots: Vec<Slot>,
    /// Places in `slots`, once they are more than a few.
    index: HashMap<Box<str>, usize>,
    /// Made by what stands within it, not by a header of its own.
    implicit: bool,
    /// Made by a dotted key.
    dotted: bool,
}

struct Slot {
    key: String,
    key_place: Place,
    place: Place,
    item: Item,
}

enum Item {
    Value(Kind),
    Table(Table),
    /// An array of tables, each with its header's place.
    Tables(Vec<(Place, Table)>),
}

/// Keys up to which a table is searched one by one.
const FEW: usize = 12;

impl Table {
    fn find(&self, key: &str) -> Option<usize> {
        if self.slots.len() <= FEW {
            self.slots.iter().position(|slot| slot.key == key)
        } else {
            self.index.get(key).copied()
        }
    }

    fn push(&mut self, slot: Slot) {
        if self.slots.len() == FEW {
            let known = self.slots.iter().enumerate();
            self.index = known.map(|(n, s)| (s.key.as_str().into(), n)).collect();
        }
        if self.slots.len() >= FEW {
            let at = self.slots.len();
            self.index.insert(slot.key.as_str().into(), at);
        }
        self.slots.push(slot);
    }

    fn remove(&mut self, at: usize) -> Slot {
        let slot = self.slots.swap_remove(at);
        self.index.remove(slot.key.as_str());
        if let (Some(moved), true) = (self.slots.get(at), self.slots.len() > FEW) {
            self.index.insert(moved.key.as_str().into(), at);
        }
        if self.slots.len() <= FEW {
            self.index.clear();
        }
        slot
    }

    fn into_kind(mut self) -> Kind {
        self.index = HashMap::new();
        self.slots.sort_by_key(|slot| slot.key_place);
        // A list of its own: that of the slots has room for more, and larger ones.
        let mut entries = Vec::with_capacity(self.slots.len());
        entries.extend(self.slots.into_iter().map(|slot| Entry {
            key: slot.key,
            key_place: slot.key_place,
            value: Value {
                kind: slot.item.into_kind(),
                place: slot.place,
            },
        }));
        Kind::Table(entries)
    }
}

impl Item {
    fn into_kind(self) -> Kind {
        match self {
            Self::Value(kind) => kind,
            Self::Table(table) => table.into_kind(),
            Self::Tables(tables) => {
                let values = tables.into_iter().map(|(place, table)| Value {
                    kind: table.into_kind(),
                    place,
                });
                Kind::Array(values.collect())
            }
        }
    }
}

/// A key and where it stands.
struct Key {
    text: String,
    place: Place,
}

/// A header, `[a.b]` or `[[a.b]]`.
struct Header {
    path: Vec<Key>,
    key: Key,
    place: Place,
    is_array: bool,
}

/// The tables of a document, and the one that keys are being added to.
#[derive(Default)]
struct State {
    root: Table,
    current: Table,
    header: Option<Header>,
}

impl State {
    /// Puts the current table in its place.
    fn finish(&mut self, reader: &mut Reader<'_>) -> Result<(), Refusal> {
        let table = std::mem::take(&mut self.current);
        let Some(header) = self.header.take() else {
            self.root = table;
            return Ok(());
        };
        let parent = reader.descend(&mut self.root, &header.path, false)?;
        let Key { text, place } = header.key;
        match (header.is_array, parent.find(&text)) {
            (true, Some(at)) => match &mut parent.slots[at].item {
                Item::Tables(tables) => tables.push((header.place, table)),
                Item::Value(_) | Item::Table(_) => return Err(reader.twice(place)),
            },
            (false, Some(_)) => return Err(reader.twice(place)),
            (is_array, None) => {
                reader.count_key(parent, place)?;
                let item = if is_array {
                    Item::Tables(vec![(header.place, table)])
                } else {
                    Item::Table(table)
                };
                parent.push(Slot {
                    key: text,
                    key_place: place,
                    place: header.place,
                    item,
                });
            }
        }
        Ok(())
    }

    /// Begins the table of a header; what has been made of it by others is its beginning.
    fn start(&mut self, reader: &mut Reader<'_>, header: Header) -> Result<(), Refusal> {
        reader.count_table(header.place)?;
        if !header.is_array {
            let parent = reader.descend(&mut self.root, &header.path, false)?;
            if let Some(at) = parent.find(&header.key.text) {
                match parent.remove(at).item {
                    Item::Table(table) if table.implicit && !table.dotted => self.current = table,
                    _ => return Err(reader.twice(header.key.place)),
                }
            }
        }
        self.current.implicit = false;
        self.current.dotted = false;
        self.header = Some(header);
        Ok(())
    }
}

struct Reader<'a> {
    text: &'a str,
    /// The byte to read next.
    at: usize,
    source: u32,
    /// Where the text begins among the bytes of the source.
    offset: usize,
    tables: usize,
    /// Elements of the arrays that are being read, outermost first. Room that each of them kept for itself would lie
    /// waste among the values.
    elements: Vec<Value>,
}

impl<'a> Reader<'a> {
    fn new(text: &'a str, source: u32, offset: usize) -> Self {
        Self {
            text,
            at: 0,
            source,
            offset,
            tables: 0,
            elements: Vec::new(),
        }
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn place(&self, span: Range<usize>) -> Place {
        Place::new(
            self.source,
            span.start + self.offset..span.end + self.offset,
        )
    }

    fn place_from(&self, start: usize) -> Place {
        self.place(start..self.at)
    }

    /// What stands here is not what was wanted.
    fn unexpected(&self, wanted: &str) -> Refusal {
        let line = self.rest().lines().next().unwrap_or_default();
        let word = line.find([' ', '\t', ',', ']', '}']).unwrap_or(line.len());
        let length = word.max(line.chars().next().map_or(0, char::len_utf8));
        let found = match (self.peek(), line.get(..length).map(shorten)) {
            (None, _) => "the end of the text".to_owned(),
            (_, Some(found)) if !found.is_empty() => format!("`{found}`"),
            _ => "the end of the line".to_owned(),
        };
        let place = self.place(self.at..self.at + length);
        let wanted = format!("valid toml ({wanted} was expected)");
        Refusal::Syntax(Fault::found(place, found, wanted))
    }

    /// What stands at a place is no TOML.
    fn wrong(&self, place: Place, wanted: &str) -> Refusal {
        Refusal::Syntax(Fault::value(place, format!("valid toml ({wanted})")))
    }

    fn twice(&self, place: Place) -> Refusal {
        let span = place.span();
        let own = span.start.saturating_sub(self.offset)..span.end.saturating_sub(self.offset);
        let key = shorten(self.text.get(own).unwrap_or_default());
        let found = format!("a second `{key}`");
        Refusal::Syntax(Fault::found(place, found, "each key once"))
    }

    fn too_deep(&self, place: Place) -> Refusal {
        Refusal::Limit(Fault::found(
            place,
            "deeper nesting",
            format!("at most {MAX_DEPTH} arrays and tables inside each other"),
        ))
    }

    fn count_table(&mut self, place: Place) -> Result<(), Refusal> {
        self.tables += 1;
        if self.tables > MAX_TABLES {
            let wanted = format!("at most {MAX_TABLES} tables in a text");
            return Err(Refusal::Limit(Fault::found(
                place,
                "one more table",
                wanted,
            )));
        }
        Ok(())
    }

    fn count_key(&self, table: &Table, place: Place) -> Result<(), Refusal> {
        if table.slots.len() >= MAX_KEYS {
            let wanted = format!("at most {MAX_KEYS} keys in a table");
            return Err(Refusal::Limit(Fault::found(place, "one more key", wanted)));
        }
        Ok(())
    }

    /// The table at the end of a path, with those missing on the way.
    ///
    /// * `dotted`: the path is that of a dotted key, which goes through no table that a header has made.
    fn descend<'t>(
        &mut self,
        mut table: &'t mut Table,
        path: &[Key],
        dotted: bool,
    ) -> Result<&'t mut Table, Refusal> {
        for key in path {
            let at = match table.find(&key.text) {
                Some(at) => at,
                None => {
                    self.count_key(table, key.place)?;
                    self.count_table(key.place)?;
                    table.push(Slot {
                        key: key.text.clone(),
                        key_place: key.place,
                        place: key.place,
                        item: Item::Table(Table {
                            implicit: true,
                            dotted,
                            ..Table::default()
                        }),
                    });
                    table.slots.len() - 1
                }
            };
            table = match &mut table.slots[at].item {
                Item::Value(_) => {
                    return Err(self.wrong(key.place, "the value of this key is no open table"));
                }
                Item::Tables(tables) => match tables.last_mut() {
                    Some((_, last)) => last,
                    None => return Err(self.twice(key.place)),
                },
                Item::Table(table) => {
                    if dotted {
                        if !table.implicit {
                            return Err(self.twice(key.place));
                        }
                        table.dotted = true;
                    }
                    table
                }
            };
        }
        Ok(table)
    }

    fn skip_blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }

    /// Skips a line feed, with a carriage return before it or not.
    fn newline(&mut self) -> bool {
        let length = match self.rest().as_bytes() {
            [b'\n', ..] => 1,
            [b'\r', b'\n', ..] => 2,
            _ => return false,
        };
        self.at += length;
        true
    }

    fn comment(&mut self) -> Result<(), Refusal> {
        if self.peek() == Some(b'#') {
            while let Some(c) = self.peek() {
                match c {
                    b'\n' => break,
                    b'\r' if self.rest().starts_with("\r\n") => break,
                    0..=8 | 0xb..=0x1f | 0x7f => {
                        return Err(self.unexpected("no control character in a comment"));
                    }
                    _ => self.at += 1,
                }
            }
        }
        Ok(())
    }

    /// The end of a line, or of the text.
    fn line_end(&mut self) -> Result<(), Refusal> {
        self.skip_blanks();
        self.comment()?;
        if self.newline() || self.peek().is_none() {
            Ok(())
        } else {
            Err(self.unexpected("a new line"))
        }
    }

    /// Skips blanks, comments and new lines, as between the elements of an array.
    fn skip_lines(&mut self) -> Result<(), Refusal> {
        loop {
            self.skip_blanks();
            self.comment()?;
            if !self.newline() {
                return Ok(());
            }
        }
    }

    /// A header, of which the first bracket stands here.
    fn header(&mut self) -> Result<Header, Refusal> {
        let start = self.at;
        let is_array = self.rest().starts_with("[[");
        let (open, close) = if is_array { ("[[", "]]") } else { ("[", "]") };
        self.at += open.len();
        let (path, key) = self.path(1)?;
        if !self.rest().starts_with(close) {
            return Err(self.unexpected(&format!("`{close}`")));
        }
        self.at += close.len();
        Ok(Header {
            path,
            key,
            place: self.place_from(start),
            is_array,
        })
    }

    /// The keys of a path but the last, and the last; blanks around them are skipped.
    fn path(&mut self, depth: usize) -> Result<(Vec<Key>, Key), Refusal> {
        let mut path = Vec::new();
        loop {
            self.skip_blanks();
            let key = self.key()?;
            self.skip_blanks();
            if self.peek() != Some(b'.') {
                return Ok((path, key));
            }
            self.at += 1;
            if depth + path.len() + 1 >= MAX_DEPTH {
                return Err(self.too_deep(key.place));
            }
            path.push(key);
        }
    }

    fn key(&mut self) -> Result<Key, Refusal> {
        let start = self.at;
        let text = match self.peek() {
            Some(quote @ (b'"' | b'\'')) => {
                if self.rest().as_bytes().starts_with(&[quote; 3]) {
                    return Err(self.unexpected("a key on one line"));
                }
                self.string()?.into()
            }
            _ => {
                let rest = self.rest();
                let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
                let length = rest.find(|c| !is_bare(c)).unwrap_or(rest.len());
                if length == 0 {
                    return Err(self.unexpected("a key"));
                }
                self.at += length;
                rest[..length].to_owned()
            }
        };
        Ok(Key {
            text,
            place: self.place_from(start),
        })
    }

    /// A key, dotted or not, and its value, which become part of a table.
    fn key_value(
        &mut self,
        table: &mut Table,
        depth: usize,
        is_inline: bool,
    ) -> Result<(), Refusal> {
        let (path, key) = self.path(depth)?;
        if self.peek() != Some(b'=') {
            return Err(self.unexpected("`=`"));
        }
        self.at += 1;
        self.skip_blanks();
        let value = self.value(depth + path.len())?;
        let parent = self.descend(table, &path, true)?;
        // A table of a header takes no dotted keys of another.
        let is_closed = !path.is_empty() && !parent.implicit && !is_inline;
        if is_closed || parent.find(&key.text).is_some() {
            return Err(self.twice(key.place));
        }
        self.count_key(parent, key.place)?;
        parent.push(Slot {
            key: key.text,
            key_place: key.place,
            place: value.place,
            item: Item::Value(value.kind),
        });
        Ok(())
    }

    fn value(&mut self, depth: usize) -> Result<Value, Refusal> {
        let start = self.at;
        let kind = match self.peek() {
            Some(b'[' | b'{') if depth >= MAX_DEPTH => {
                return Err(self.too_deep(self.place(start..start + 1)));
            }
            Some(b'[') => self.array(depth)?,
            Some(b'{') => self.inline_table(depth)?,
            Some(b'"' | b'\'') => Kind::String(self.string()?),
            _ => self.scalar()?,
        };
        Ok(Value {
            kind,
            place: self.place_from(start),
        })
    }

    fn array(&mut self, depth: usize) -> Result<Kind, Refusal> {
        self.at += 1;
        let outer = self.elements.len();
        loop {
            self.skip_lines()?;
            if self.peek() == Some(b']') {
                break;
            }
            let element = self.value(depth + 1)?;
            self.elements.push(element);
            self.skip_lines()?;
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b']') => break,
                _ => return Err(self.unexpected("`,` or `]`")),
            }
        }
        self.at += 1;
        Ok(Kind::Array(taken_from(&mut self.elements, outer)))
    }

    fn inline_table(&mut self, depth: usize) -> Result<Kind, Refusal> {
        self.count_table(self.place(self.at..self.at + 1))?;
        self.at += 1;
        let mut table = Table::default();
        loop {
            self.skip_lines()?;
            if self.peek() == Some(b'}') {
                break;
            }
            self.key_value(&mut table, depth + 1, true)?;
            self.skip_lines()?;
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b'}') => break,
                _ => return Err(self.unexpected("`,` or `}`")),
            }
        }
        self.at += 1;
        Ok(table.into_kind())
    }

    /// A string of any of the four kinds.
    fn string(&mut self) -> Result<Box<str>, Refusal> {
        let start = self.at;
        let Some(quote) = self.peek() else {
            return Err(self.unexpected("a string"));
        };
        let is_long = self.rest().as_bytes().starts_with(&[quote; 3]);
        self.at += if is_long { 3 } else { 1 };
        if is_long {
            self.newline();
        }
        let mut string = String::new();
        loop {
            let plain = self.at;
            while let Some(c) = self.peek() {
                let stops = c == quote
                    || c == b'\\' && quote == b'"'
                    || c < 0x20 && c != b'\t'
                    || c == 0x7f;
                if stops {
                    break;
                }
                self.at += 1;
            }
            string.push_str(self.text.get(plain..self.at).unwrap_or_default());
            match self.peek() {
                Some(c) if c == quote => {
                    if !is_long {
                        self.at += 1;
                        return Ok(string.into());
                    }
                    let run = self.rest().bytes().take_while(|c| *c == quote).take(5);
                    let run = run.count();
                    self.at += run;
                    let own = if run >= 3 { run - 3 } else { run };
                    string.extend(std::iter::repeat_n(char::from(quote), own));
                    if run >= 3 {
                        return Ok(string.into());
                    }
                }
                Some(b'\\') => self.escape(&mut string, is_long)?,
                Some(b'\n') if is_long => {
                    self.at += 1;
                    string.push('\n');
                }
                Some(b'\r') if is_long && self.rest().starts_with("\r\n") => {
                    self.at += 2;
                    string.push_str("\r\n");
                }
                Some(_) => return Err(self.unexpected("the end of the string on its line")),
                None => return Err(self.wrong(self.place(start..self.at), "a string has an end")),
            }
        }
    }

    /// What a backslash stands for.
    fn escape(&mut self, string: &mut String, is_long: bool) -> Result<(), Refusal> {
        let start = self.at;
        self.at += 1;
        let letter = self.peek();
        let c = match letter {
            Some(c @ (b'"' | b'\\')) => char::from(c),
            Some(b'b') => '\u{8}',
            Some(b'e') => '\u{1b}',
            Some(b'f') => '\u{c}',
            Some(b'n') => '\n',
            Some(b'r') => '\r',
            Some(b't') => '\t',
            Some(b'x') => return self.code(start, 2, string),
            Some(b'u') => return self.code(start, 4, string),
            Some(b'U') => return self.code(start, 8, string),
            Some(b' ' | b'\t' | b'\r' | b'\n') if is_long => {
                // A backslash at the end of a line takes it away with all blanks after it.
                self.skip_blanks();
                if !self.newline() {
                    return Err(self.unexpected("the end of the line after a backslash"));
                }
                loop {
                    self.skip_blanks();
                    if !self.newline() {
                        return Ok(());
                    }
                }
            }
            _ => {
                let length = self.rest().chars().next().map_or(0, char::len_utf8);
                let place = self.place(start..self.at + length);
                return Err(self.wrong(
                    place,
                    "an escape is one of \\\" \\\\ \\b \\e \\f \\n \\r \\t \\x \\u \\U",
                ));
            }
        };
        self.at += 1;
        string.push(c);
        Ok(())
    }

    /// A character by its number in hexadecimal digits.
    fn code(&mut self, start: usize, digits: usize, string: &mut String) -> Result<(), Refusal> {
        self.at += 1;
        let code = self.rest().get(..digits);
        let code = code.filter(|code| code.bytes().all(|c| c.is_ascii_hexdigit()));
        let c = code.and_then(|code| char::from_u32(u32::from_str_radix(code, 16).ok()?));
        let Some(c) = c else {
            let place = self.place(start..self.at);
            let wanted = format!("a character has {digits} hexadecimal digits");
            return Err(self.wrong(place, &wanted));
        };
        self.at += digits;
        string.push(c);
        Ok(())
    }

    /// A number, a date or a boolean.
    fn scalar(&mut self) -> Result<Kind, Refusal> {
        let start = self.at;
        let ends = |c: char| c.is_ascii_whitespace() || matches!(c, ',' | ']' | '}' | '#' | '=');
        let rest = self.rest();
        let mut length = rest.find(ends).unwrap_or(rest.len());
        // A blank may stand between date and time.
        if is_date(&rest[..length])
            && let Some(time) = rest[length..].strip_prefix(' ')
        {
            let more = time.find(ends).unwrap_or(time.len());
            if is_moment(&rest[..length + 1 + more]) {
                length += 1 + more;
            }
        }
        let word = &rest[..length];
        let kind = match word {
            "true" => Kind::Bool(true),
            "false" => Kind::Bool(false),
            "inf" | "+inf" => Kind::Float(f64::INFINITY),
            "-inf" => Kind::Float(f64::NEG_INFINITY),
            "nan" | "+nan" | "-nan" => Kind::Float(f64::NAN),
            "" => return Err(self.unexpected("a value")),
            _ if is_moment(word) => Kind::Date,
            _ => match number(word) {
                Some(kind) => kind,
                None if is_radixed(word) => {
                    let place = self.place(start..start + length);
                    let fault = Fault::value(place, "an integer of at most 64 bits");
                    return Err(Refusal::Limit(fault));
                }
                None => return Err(self.unexpected("a number, a string, a boolean or a date")),
            },
        };
        self.at += length;
        Ok(kind)
    }
}

/// Digits with single underscores between them.
fn digits(text: &str, is_digit: impl Fn(u8) -> bool) -> bool {
    let mut after = b'_';
    for c in text.bytes() {
        if !(is_digit(c) || c == b'_' && after != b'_') {
            return false;
        }
        after = c;
    }
    after != b'_'
}

fn decimal(text: &str) -> bool {
    digits(text, |c| c.is_ascii_digit())
}

/// The digits of an integer that is not decimal, and its radix.
fn radixed(word: &str) -> Option<(&str, u32)> {
    let (digits, radix) = match word.as_bytes() {
        [b'0', b'x', ..] => (word.get(2..)?, 16),
        [b'0', b'o', ..] => (word.get(2..)?, 8),
        [b'0', b'b', ..] => (word.get(2..)?, 2),
        _ => return None,
    };
    let is_digit = |c: u8| char::from(c).is_digit(radix);
    self::digits(digits, is_digit).then_some((digits, radix))
}

fn is_radixed(word: &str) -> bool {
    radixed(word).is_some()
}

/// A number; `None` where it is none, or not decimal and beyond 64 bits.
fn number(word: &str) -> Option<Kind> {
    if let Some((digits, radix)) = radixed(word) {
        let plain: String = digits.chars().filter(|c| *c != '_').collect();
        return i64::from_str_radix(&plain, radix).ok().map(Kind::Integer);
    }
    let body = word.strip_prefix(['+', '-']).unwrap_or(word);
    let (mantissa, exponent) = match body.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (body, None),
    };
    let (whole, part) = match mantissa.split_once('.') {
        Some((whole, part)) => (whole, Some(part)),
        None => (mantissa, None),
    };
    let is_led = whole.len() > 1 && whole.starts_with('0');
    let exponent_digits = exponent.map(|e| e.strip_prefix(['+', '-']).unwrap_or(e));
    if !decimal(whole) || is_led || ![part, exponent_digits].into_iter().flatten().all(decimal) {
        return None;
    }
    let plain: std::borrow::Cow<'_, str> = if word.contains('_') {
        word.chars()
            .filter(|c| *c != '_')
            .collect::<String>()
            .into()
    } else {
        word.into()
    };
    if part.is_none()
        && exponent.is_none()
        && let Ok(integer) = plain.parse()
    {
        return Some(Kind::Integer(integer));
    }
    plain.parse().ok().map(Kind::Float)
}

/// Numbers of two digits with a mark between them.
fn pairs<const N: usize>(text: &str, mark: char) -> Option<[u32; N]> {
    let mut found = [0; N];
    let mut parts = text.split(mark);
    for number in &mut found {
        let part = parts.next()?;
        let plain = part.len() == 2 && part.bytes().all(|c| c.is_ascii_digit());
        *number = part.parse().ok().filter(|_| plain)?;
    }
    parts.next().is_none().then_some(found)
}

fn is_date(text: &str) -> bool {
    let Some((year, rest)) = text.split_at_checked(4) else {
        return false;
    };
    let rest = rest
        .strip_prefix('-')
        .and_then(|rest| pairs::<2>(rest, '-'));
    let (Ok(year), true, Some([month, day])) = (
        year.parse::<u32>(),
        year.bytes().all(|c| c.is_ascii_digit()),
        rest,
    ) else {
        return false;
    };
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    (1..=12).contains(&month) && (1..=days).contains(&day)
}

fn is_time(text: &str) -> bool {
    let (text, part) = match text.split_once('.') {
        Some((text, part)) => (text, Some(part)),
        None => (text, None),
    };
    let is_part = part.is_none_or(|p| !p.is_empty() && p.bytes().all(|c| c.is_ascii_digit()));
    match pairs::<3>(text, ':') {
        Some([hour, minute, second]) => hour < 24 && minute < 60 && second <= 60 && is_part,
        // Seconds may be left out.
        None => part.is_none() && is_hours(text),
    }
}

fn is_hours(text: &str) -> bool {
    pairs::<2>(text, ':').is_some_and(|[hour, minute]| hour < 24 && minute < 60)
}

/// Whether a word is a date, a time or both.
fn is_moment(text: &str) -> bool {
    if is_date(text) || is_time(text) {
        return true;
    }
    let Some((date, rest)) = text.split_at_checked(10) else {
        return false;
    };
    let Some(time) = rest.strip_prefix(['T', 't', ' ']) else {
        return false;
    };
    let time = match time.strip_suffix(['Z', 'z']) {
        Some(time) => time,
        None => match time.rfind(['+', '-']) {
            Some(at) if is_hours(&time[at + 1..]) => &time[..at],
            _ => time,
        },
    };
    is_date(date) && is_time(time)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use toml::Spanned;
    use toml::de::{DeTable, DeValue};

    use super::*;

    /// What the `toml` crate reads: another program's answer, with its places.
    fn reference(text: &str) -> Option<String> {
        let table = DeTable::parse(text).ok()?;
        Some(shown_table(table.into_inner()))
    }

    fn shown_table(table: DeTable<'_>) -> String {
        let mut entries: Vec<_> = table
            .into_iter()
            .map(|(key, value)| (key.span(), key.into_inner().into_owned(), shown(value)))
            .collect();
        entries.sort_by_key(|e| (e.0.start, e.0.end));
        format!("{entries:?}")
    }

    fn shown(value: Spanned<DeValue<'_>>) -> String {
        let span = value.span();
        let text = match value.into_inner() {
            DeValue::String(text) => format!("{:?}", text.as_ref()),
            DeValue::Boolean(is) => is.to_string(),
            DeValue::Datetime(_) => "date".to_owned(),
            DeValue::Integer(n) => match i64::from_str_radix(n.as_str(), n.radix()) {
                Ok(n) => n.to_string(),
                Err(_) if n.radix() == 10 => real(n.as_str().parse().expect("a number")),
                Err(_) => "large".to_owned(),
            },
            DeValue::Float(n) => real(n.as_str().parse().expect("a number")),
            DeValue::Array(array) => {
                format!("{:?}", array.into_iter().map(shown).collect::<Vec<_>>())
            }
            DeValue::Table(table) => shown_table(table),
        };
        format!("{span:?} {text}")
    }

    fn real(n: f64) -> String {
        if n.is_nan() {
            "nan".to_owned()
        } else {
            format!("{n:?}")
        }
    }

    fn own(text: &str) -> Option<String> {
        match document(text, 0) {
            Ok(value) => Some(own_kind(value.kind)),
            Err(Refusal::Limit(_)) => reference(text),
            Err(Refusal::Syntax(_)) => None,
        }
    }

    fn own_value(value: Value) -> String {
        format!("{:?} {}", value.place.span(), own_kind(value.kind))
    }

    fn own_kind(kind: Kind) -> String {
        match kind {
            Kind::Null => "null".to_owned(),
            Kind::Bool(is) => is.to_string(),
            Kind::Integer(n) => n.to_string(),
            Kind::Float(n) => real(n),
            Kind::String(text) => format!("{text:?}"),
            Kind::Date => "date".to_owned(),
            Kind::Array(list) => {
                format!("{:?}", list.into_iter().map(own_value).collect::<Vec<_>>())
            }
            Kind::Table(entries) => {
                let shown = entries
                    .into_iter()
                    .map(|e| (e.key_place.span(), e.key, own_value(e.value)));
                format!("{:?}", shown.collect::<Vec<_>>())
            }
        }
    }

    #[test]
    fn reads_what_the_toml_crate_reads() {
        for text in [
            "",
            "\u{feff}a = 1",
            "a = 1\r\nb.c = 'x'\r\n[t]\r\nd = [1, 2,\r\n 3, # three\r\n]",
            "a = +1_000\nb = 0xff_0\nc = 1e5\nd = -0.5e-3\ne = 0o17\nf = 0b1\ng = 1__0",
            "a = 01",
            "a = 1.",
            "a = .5",
            "a = 1e",
            "a = 1_",
            "a = +0x1",
            "a = 99999999999999999999\nb = 1e999",
            "a = 1979-05-27\nb = 1979-05-27 07:32:00Z\nc = 07:32:00.5\nd = 1979-05-27T07:32:00-07:00",
            "a = 1979-02-30",
            "a = 25:00:00",
            "a = \"\\u00e9\\U0001F3FA\\x41\\e\\\"\"",
            "a = \"\\ud800\"",
            "a = \"\\q\"",
            "a = '''\nx\n''y'''''\nb = \"\"\"\nq \\\n   r\"\"\"\"\"",
            "a = \"\"\"x\n",
            "a = \"x\ny\"",
            "a.b = 1\na.c = 2\n[a.d]",
            "[a]\nb = 1\n[a]\nc = 2",
            "[a.b]\nx = 1\n[a]\ny = 2",
            "[a.b.c]\nz = 9\n[a]\nb.c.t = 1",
            "[a.b]\nz = 9\n[a]\nb.t = 1",
            "[[a]]\nx = 1\n[[a]]\nx = 2\n[a.b]\ny = 3\n[[a.c]]\n[[a.c]]",
            "a = []\n[[a]]",
            "[a]\n[[a]]",
            "[[a]]\n[a]",
            "a = {b = 1, c.d = 2, c.e = 3}\n[a.f]",
            "a = {b = {}, b.c = 1}",
            "a = {b = 1,\n c = 2, # two\n}",
            "a = {b = 1, b = 2}",
            "a.b = 1\na = 2",
            "a = 1\na.b = 2",
            "[a]\nb.c = 1\n[a.b.d]\nx = 1\n[a.b]\ny = 1",
            "a = true b = 2",
            "a = [1 2]",
            "a = ",
            "= 1",
            "a b = 1",
            "\"\" = 1\n'x y'.\"z\" = 2",
            "\"\"\"a\"\"\" = 1",
            "[ a . 'b' ]\nc = 1",
            "[a",
            "[[a]",
            "[a]]",
            "[]",
            "a = inf\nb = -nan\nc = +inf",
            "a = 1 # \u{7}",
            "a = 1\rb = 2",
            "# é\né = 1",
            "a = 0\nb = -0\nc = 0.0\nd = 00",
        ] {
            assert_eq!(own(text), reference(text), "{text:?}");
        }
    }

    #[test]
    fn many_keys_are_found_again() {
        let keys: String = (0..200).map(|n| format!("k{n}.x = {n}\n")).collect();
        let text = format!("{keys}[k7.y]\n[s]\n{keys}[k3.z]\n");
        assert_eq!(own(&text), reference(&text));
        let twice = format!("{keys}k150.x = 1\n");
        assert_eq!(own(&twice), None);
        let headers: String = (0..60).map(|n| format!("[a.k{n}.x]\nv = 1\n")).collect();
        let again: String = (0..60)
            .rev()
            .map(|n| format!("[a.k{n}]\nw = 1\n"))
            .collect();
        let text = headers + &again;
        assert_eq!(own(&text), reference(&text));
    }

    #[test]
    fn nesting_and_counts_are_limited() {
        let nested = |n: usize| format!("a = {}{}", "[".repeat(n), "]".repeat(n));
        assert!(document(&nested(MAX_DEPTH - 1), 0).is_ok());
        for text in [
            nested(MAX_DEPTH),
            "a=[".repeat(1 << 20),
            format!("a = {}", "{b=".repeat(1 << 18)),
            format!("{} = 1", vec!["a"; 1 << 18].join(".")),
            format!("[{}]", vec!["a"; 1 << 18].join(".")),
            "[[a]]\n".repeat(MAX_TABLES + 1),
            format!("a = [{}]", "{},".repeat(MAX_TABLES + 1)),
            (0..=MAX_KEYS).map(|n| format!("k{n}=1\n")).collect(),
        ] {
            assert!(document(&text, 0).is_err(), "{}", &text[..20]);
        }
    }

    proptest! {
        #[test]
        fn accepts_what_the_toml_crate_accepts(
            pieces in proptest::collection::vec(
                prop::sample::select(vec![
                    "a", "b", "a.b", "b.c", "[a]", "[a.b]", "[[a]]", "[[a.b]]", "[b]", "[", "]", "{", "}", ",",
                    "=", " = ", "=1", "=2.5", "=[]", "={}", "='x'", "= {b = 1}", "= [[1], 2]", "1", "-", "\n", "\n",
                    "\n", "\r\n", " ", "\"", "'", "\"\"\"", "'''", "\\", "#", "true", "inf", "1e5", "0x1f", "_", ".",
                    "1979-05-27", "07:32:00", "é", "\t", "\u{7f}",
                ]),
                0..24,
            )
        ) {
            let text = pieces.concat();
            prop_assert_eq!(own(&text), reference(&text), "{:?}", text);
        }

        /// Lines that are well formed each by itself.
        #[test]
        fn tables_are_those_of_the_toml_crate(
            lines in proptest::collection::vec(
                prop::sample::select(vec![
                    "a = 1", "a.b = 1", "a.b.c = 2", "b = {}", "b.c = [1]", "[a]", "[a.b]", "[a.b.c]", "[b]", "[[a]]",
                    "[[a.b]]", "[[b]]", "c = {a.b = 1, a.c = 2}", "x = 1", "y.z = 'q'", "[x]", "[y]", "[y.z]",
                    "\"a\".'b' = 1", "[c]", "[c.a]",
                ]),
                0..9,
            )
        ) {
            let text = lines.join("\n");
            prop_assert_eq!(own(&text), reference(&text), "{:?}", text);
        }
    }
}
