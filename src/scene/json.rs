//! Strict JSON with the place of every value.
//!
//! RFC 8259 and nothing more: no comments, trailing or missing commas, single quotes or bare words. A byte order
//! mark before the text is passed over, as that document allows. Keys are unique, nesting is at most [`MAX_DEPTH`] deep, so the recursion is.
//! A number beyond the range of f64 becomes infinite here and is refused by the key that reads it.

use std::collections::BTreeMap;

use super::error::{Fault, Place, shorten};
use super::limits::MAX_DEPTH;
use super::toml_reader::taken_from;
use super::value::{Entry, Kind, Value};

/// The byte order mark.
const MARK: char = '\u{feff}';

/// Reads a JSON document. `source` is the index of `text` among the sources.
pub(super) fn from_json(text: &str, source: u32) -> Result<Value, Fault> {
    let mut reader = Reader {
        text,
        at: if text.starts_with(MARK) {
            MARK.len_utf8()
        } else {
            0
        },
        source,
        elements: Vec::new(),
    };
    reader.skip_blanks();
    let value = reader.value(0)?;
    reader.skip_blanks();
    if reader.at < text.len() {
        return Err(reader.unexpected("the end of the text after the value"));
    }
    Ok(value)
}

struct Reader<'a> {
    text: &'a str,
    /// The byte to read next.
    at: usize,
    source: u32,
    /// Elements of the arrays that are being read, outermost first.
    elements: Vec<Value>,
}

impl Reader<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn skip_blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    fn place_from(&self, start: usize) -> Place {
        Place::new(self.source, start..self.at)
    }

    /// What stands here is not what was wanted.
    fn unexpected(&self, wanted: &str) -> Fault {
        let rest = &self.text[self.at..];
        let word = rest
            .find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '+' | '-' | '.')))
            .unwrap_or(rest.len());
        let length = word.max(rest.chars().next().map_or(0, char::len_utf8));
        let place = Place::new(self.source, self.at..self.at + length);
        let found = match rest.chars().next() {
            None => "the end of the text".to_owned(),
            Some(MARK) => "a byte order mark".to_owned(),
            Some(_) => format!("`{}`", shorten(&rest[..length])),
        };
        let hint = match rest.as_bytes() {
            [b'/' | b'#', ..] => Some("json has no comments; toml has"),
            [b'\'', ..] => Some("json strings take double quotes"),
            [b'N' | b'n' | b'i' | b'I', ..] => Some("json has no nan and no infinity"),
            _ => None,
        };
        Fault::found(place, found, wanted).with_hint(hint.map(str::to_owned))
    }

    fn value(&mut self, depth: usize) -> Result<Value, Fault> {
        let start = self.at;
        let kind = match self.peek() {
            Some(b'{' | b'[') if depth >= MAX_DEPTH => {
                let place = Place::new(self.source, start..start + 1);
                return Err(Fault::found(
                    place,
                    "deeper nesting",
                    format!("at most {MAX_DEPTH} arrays and tables inside each other"),
                ));
            }
            Some(b'{') => self.table(depth)?,
            Some(b'[') => self.array(depth)?,
            Some(b'"') => Kind::String(self.string()?.into()),
            Some(b'-' | b'0'..=b'9') => self.number()?,
            _ => self.word()?,
        };
        Ok(Value {
            kind,
            place: self.place_from(start),
        })
    }

    fn word(&mut self) -> Result<Kind, Fault> {
        let rest = &self.text[self.at..];
        let end = rest
            .find(|c: char| !c.is_ascii_alphanumeric())
            .unwrap_or(rest.len());
        let kind = match &rest[..end] {
            "true" => Kind::Bool(true),
            "false" => Kind::Bool(false),
            "null" => Kind::Null,
            _ => return Err(self.unexpected("a json value")),
        };
        self.at += end;
        Ok(kind)
    }

    fn digits(&mut self) -> Result<(), Fault> {
        if !matches!(self.peek(), Some(b'0'..=b'9')) {
            return Err(self.unexpected("a digit"));
        }
        while matches!(self.peek(), Some(b'0'..=b'9')) {
            self.at += 1;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<Kind, Fault> {
        let start = self.at;
        let mut integer = true;
        if self.peek() == Some(b'-') {
            self.at += 1;
        }
        if self.peek() == Some(b'0') {
            self.at += 1;
            if matches!(self.peek(), Some(b'0'..=b'9')) {
                return Err(self.unexpected("a number without leading zeros"));
            }
        } else {
            self.digits()?;
        }
        if self.peek() == Some(b'.') {
            integer = false;
            self.at += 1;
            self.digits()?;
        }
        if matches!(self.peek(), Some(b'e' | b'E')) {
            integer = false;
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            self.digits()?;
        }
        let text = &self.text[start..self.at];
        if integer && let Ok(value) = text.parse() {
            return Ok(Kind::Integer(value));
        }
        text.parse()
            .map(Kind::Float)
            .map_err(|_| Fault::value(self.place_from(start), "a number"))
    }

    fn string(&mut self) -> Result<String, Fault> {
        let start = self.at;
        self.at += 1;
        let mut string = String::new();
        loop {
            let plain = self.at;
            while !matches!(self.peek(), None | Some(b'"' | b'\\' | 0..0x20)) {
                self.at += 1;
            }
            string.push_str(&self.text[plain..self.at]);
            match self.peek() {
                Some(b'"') => {
                    self.at += 1;
                    return Ok(string);
                }
                Some(b'\\') => string.push(self.escape()?),
                Some(_) => return Err(self.unexpected("control characters escaped in a string")),
                None => {
                    return Err(Fault::value(
                        self.place_from(start),
                        "a closing `\"` before the end of the text",
                    ));
                }
            }
        }
    }

    fn escape(&mut self) -> Result<char, Fault> {
        let start = self.at;
        self.at += 1;
        let c = match self.peek() {
            Some(c @ (b'"' | b'\\' | b'/')) => char::from(c),
            Some(b'b') => '\u{8}',
            Some(b'f') => '\u{c}',
            Some(b'n') => '\n',
            Some(b'r') => '\r',
            Some(b't') => '\t',
            Some(b'u') => {
                self.at += 1;
                let first = self.hex()?;
                let mut code = first;
                // A pair of surrogates makes one character.
                if (0xd800..0xdc00).contains(&first) && self.text[self.at..].starts_with("\\u") {
                    self.at += 2;
                    let second = self.hex()?;
                    if (0xdc00..0xe000).contains(&second) {
                        code = 0x1_0000 + ((first - 0xd800) << 10) + (second - 0xdc00);
                    }
                }
                return char::from_u32(code).ok_or_else(|| {
                    Fault::value(self.place_from(start), "a character or a surrogate pair")
                });
            }
            _ => {
                return Err(self.unexpected("one of \" \\ / b f n r t u after a backslash"));
            }
        };
        self.at += 1;
        Ok(c)
    }

    fn hex(&mut self) -> Result<u32, Fault> {
        let digits = self.text.get(self.at..self.at + 4);
        let code = digits
            .filter(|digits| digits.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|digits| u32::from_str_radix(digits, 16).ok());
        match code {
            Some(code) => {
                self.at += 4;
                Ok(code)
            }
            None => Err(self.unexpected("four hexadecimal digits")),
        }
    }

    fn array(&mut self, depth: usize) -> Result<Kind, Fault> {
        self.at += 1;
        let outer = self.elements.len();
        self.skip_blanks();
        if self.peek() == Some(b']') {
            self.at += 1;
            return Ok(Kind::Array(Box::default()));
        }
        loop {
            self.skip_blanks();
            if self.peek() == Some(b']') {
                return Err(self
                    .unexpected("a json value after the comma")
                    .with_hint(Some("json has no trailing commas".to_owned())));
            }
            let index = self.elements.len() - outer;
            let value = self.value(depth + 1);
            let value = value.map_err(|fault| fault.at_index(index))?;
            self.elements.push(value);
            self.skip_blanks();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b']') => {
                    self.at += 1;
                    return Ok(Kind::Array(taken_from(&mut self.elements, outer)));
                }
                _ => return Err(self.unexpected("`,` or `]`")),
            }
        }
    }

    fn table(&mut self, depth: usize) -> Result<Kind, Fault> {
        self.at += 1;
        let mut entries: Vec<Entry> = Vec::new();
        let mut seen = BTreeMap::new();
        self.skip_blanks();
        if self.peek() == Some(b'}') {
            self.at += 1;
            return Ok(Kind::Table(entries));
        }
        loop {
            self.skip_blanks();
            match self.peek() {
                Some(b'"') => {}
                Some(b'}') => {
                    return Err(self
                        .unexpected("a key after the comma")
                        .with_hint(Some("json has no trailing commas".to_owned())));
                }
                _ => return Err(self.unexpected("a key in double quotes")),
            }
            let start = self.at;
            let key = self.string()?;
            let key_place = self.place_from(start);
            if let Some(first) = seen.insert(key.clone(), start) {
                let line = self.text[..first].matches('\n').count() + 1;
                let shown = shorten(&key);
                return Err(Fault::found(
                    key_place,
                    format!("a second `{shown}`"),
                    "each key once",
                )
                .with_hint(Some(format!("the first is on line {line}")))
                .at_key(&key));
            }
            self.skip_blanks();
            if self.peek() != Some(b':') {
                return Err(self.unexpected("`:` after the key"));
            }
            self.at += 1;
            self.skip_blanks();
            let value = self.value(depth + 1).map_err(|fault| fault.at_key(&key))?;
            entries.push(Entry {
                key,
                key_place,
                value,
            });
            self.skip_blanks();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b'}') => {
                    self.at += 1;
                    return Ok(Kind::Table(entries));
                }
                _ => return Err(self.unexpected("`,` or `}`")),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::error::Sources;

    fn read(text: &str) -> Result<Value, String> {
        let mut sources = Sources::default();
        let id = sources.add("x.json".into(), text.into(), false);
        from_json(text, id).map_err(|fault| fault.into_error(&sources).to_string())
    }

    #[test]
    fn refuses_what_strict_json_refuses() {
        for (text, wanted) in [
            (
                "",
                "x.json:1:1: found the end of the text, wanted a json value",
            ),
            ("[1 2]", "x.json:1:4: found `2`, wanted `,` or `]`"),
            (
                "[1,]",
                "x.json:1:4: found `]`, wanted a json value after the comma; json has no trailing commas",
            ),
            (
                "{'a': 1}",
                "x.json:1:2: found `'`, wanted a key in double quotes; json strings take double quotes",
            ),
            (
                "[1] // end",
                "x.json:1:5: found `/`, wanted the end of the text after the value; json has no comments; toml has",
            ),
            (
                "{\"a\": {\"b\": 1,\n \"b\": 2}}",
                "x.json:2:2: a.b: found a second `b`, wanted each key once; the first is on line 1",
            ),
            (
                "[0, NaN]",
                "x.json:1:5: [1]: found `NaN`, wanted a json value; json has no nan and no infinity",
            ),
            (
                "[01]",
                "x.json:1:3: [0]: found `1`, wanted a number without leading zeros",
            ),
            ("[1.]", "x.json:1:4: [0]: found `]`, wanted a digit"),
            (
                "\u{feff}\u{feff}{}",
                "x.json:1:2: found a byte order mark, wanted a json value",
            ),
        ] {
            assert_eq!(read(text).expect_err(text), wanted, "{text}");
        }
    }

    #[test]
    fn nesting_is_limited() {
        let nested = |n: usize| "[".repeat(n) + &"]".repeat(n);
        assert!(read(&nested(MAX_DEPTH)).is_ok());
        assert!(read(&nested(MAX_DEPTH + 1)).is_err());
        assert!(read(&"[".repeat(1 << 20)).is_err());
        assert!(read(&"{\"a\":".repeat(1 << 18)).is_err());
    }

    #[test]
    fn strings_are_decoded() {
        let Ok(Value {
            kind: Kind::String(text),
            ..
        }) = read(r#""a\u00e9\ud83c\udffa\n\/é""#)
        else {
            panic!("a string")
        };
        assert_eq!(&*text, "aé🏺\n/é");
        assert!(read(r#""\ud83c""#).is_err());
        assert!(read(r#""\ud83c\u0041""#).is_err());
        assert!(read(r#""\u00é9""#).is_err());
        assert!(read("\u{feff}{}").is_ok());
        assert!(read("\"a\nb\"").is_err());
    }

    proptest! {
        /// The independent reference is the reader of `serde_json`, which has no places.
        #[test]
        fn accepts_what_serde_json_accepts(
            pieces in proptest::collection::vec(
                prop::sample::select(vec![
                    "{", "}", "[", "]", ",", ":", "\"a\"", "\"b\"", "1", "-", "0", ".5", "e3",
                    "true", "null", " ", "\n", "\"", "\\u0041", "/", "'", "nul", "é",
                ]),
                0..24,
            )
        ) {
            let text = pieces.concat();
            let reference = serde_json::from_str::<serde_json::Value>(&text);
            let found = read(&text);
            let duplicate = matches!(&found, Err(message) if message.contains("each key once"));
            // Here a number too large is refused by the key that reads it.
            let large = matches!(&reference, Err(e) if e.to_string().contains("out of range"));
            prop_assert!(
                found.is_ok() == reference.is_ok() || duplicate || large,
                "{text:?}: {:?} {:?}", found.err(), reference.err()
            );
        }
    }
}
