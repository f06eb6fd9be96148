//! Words of a text, one after the other, each with its line and column.
//!
//! Every reader of plain text goes through [`Scanner`]: words are separated by blanks, and a comment
//! runs from its mark to the end of the line. Numbers are f64, nearest to the decimal; counts are
//! never trusted with an allocation: a list grows as its numbers are found.

use super::error::quoted;
use super::{ExchangeError, Place};

/// A word and where it begins, in bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    pub(super) at: usize,
}

/// A cursor on a text.
#[derive(Debug, Clone)]
pub(super) struct Scanner<'a> {
    text: &'a str,
    /// Words begin here or later.
    at: usize,
    /// Words end here at the latest.
    end: usize,
    comment: Option<char>,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(text: &'a str, comment: Option<char>) -> Self {
        Self::within(text, 0..text.len(), comment)
    }

    /// A cursor on a part of a text; places are those in the whole.
    pub(super) fn within(
        text: &'a str,
        range: std::ops::Range<usize>,
        comment: Option<char>,
    ) -> Self {
        Self {
            text,
            at: range.start,
            end: range.end,
            comment,
        }
    }

    /// Line and column of a byte of the text.
    pub(super) fn place(&self, at: usize) -> Place {
        place_of(self.text, at)
    }

    /// Where the next word begins, or the end; [`place`](Self::place) makes a place of it.
    pub(super) fn here(&mut self) -> usize {
        self.peek().map_or(self.end, |word| word.at)
    }

    /// The rest of the line, without comment and blanks; the cursor moves to the next line.
    pub(super) fn line(&mut self) -> Word<'a> {
        let rest = &self.text[self.at..self.end];
        let length = rest.find('\n').unwrap_or(rest.len());
        let line = &rest[..length];
        let line = match self.comment.and_then(|mark| line.find(mark)) {
            Some(cut) => &line[..cut],
            None => line,
        };
        let word = Word {
            text: line.trim(),
            at: self.at + (line.len() - line.trim_start().len()),
        };
        self.at = (self.at + length + 1).min(self.end);
        word
    }

    /// The next word, left in place.
    pub(super) fn peek(&mut self) -> Option<Word<'a>> {
        loop {
            let rest = &self.text[self.at..self.end];
            let blank = rest.len() - rest.trim_start().len();
            self.at += blank;
            let rest = &rest[blank..];
            if self.comment.is_some_and(|mark| rest.starts_with(mark)) {
                self.at += rest.find('\n').unwrap_or(rest.len());
                continue;
            }
            let mark = self.comment;
            let length = rest
                .find(|c: char| c.is_whitespace() || Some(c) == mark)
                .unwrap_or(rest.len());
            return (length > 0).then_some(Word {
                text: &rest[..length],
                at: self.at,
            });
        }
    }

    /// The next word.
    pub(super) fn next(&mut self) -> Option<Word<'a>> {
        let word = self.peek()?;
        self.at = word.at + word.text.len();
        Some(word)
    }

    /// The next word, which must be there.
    ///
    /// * `wanted`: what it should be, for the message.
    pub(super) fn word(&mut self, wanted: &str) -> Result<Word<'a>, ExchangeError> {
        self.next().ok_or_else(|| ExchangeError::Unexpected {
            place: self.place(self.end),
            found: "the end of the text".into(),
            wanted: wanted.into(),
        })
    }

    /// The next word, which must be `keyword`.
    pub(super) fn keyword(&mut self, keyword: &str) -> Result<Word<'a>, ExchangeError> {
        let wanted = format!("the word {keyword:?}");
        let word = self.word(&wanted)?;
        if word.text == keyword {
            Ok(word)
        } else {
            Err(self.unexpected(word, &wanted))
        }
    }

    /// A finite number.
    pub(super) fn number(&mut self, wanted: &str) -> Result<f64, ExchangeError> {
        let word = self.word(wanted)?;
        match word.text.parse::<f64>() {
            Ok(found) if found.is_finite() => Ok(found),
            _ => Err(self.unexpected(word, &format!("{wanted}, a finite number"))),
        }
    }

    /// A weight, by which points can be divided.
    pub(super) fn weight(&mut self, index: usize) -> Result<f64, ExchangeError> {
        match self.peek() {
            Some(word) => match word.text.parse::<f64>() {
                Ok(found) if found > 0.0 && found.is_finite() => {
                    self.next();
                    Ok(found)
                }
                _ => Err(self.unexpected(
                    word,
                    &format!("the weight of point {index}, finite and greater than zero"),
                )),
            },
            None => self.number(&format!("the weight of point {index}")),
        }
    }

    /// A whole number from `range`.
    pub(super) fn integer(
        &mut self,
        wanted: &str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<i64, ExchangeError> {
        let word = self.word(wanted)?;
        match word.text.parse::<i64>() {
            Ok(found) if range.contains(&found) => Ok(found),
            _ => {
                let limits = if *range.end() == i64::MAX {
                    format!("at least {}", range.start())
                } else {
                    format!("from {} to {}", range.start(), range.end())
                };
                Err(self.unexpected(word, &format!("{wanted}, a whole number {limits}")))
            }
        }
    }

    /// How many there are of something; at least `least`.
    pub(super) fn count(&mut self, wanted: &str, least: u32) -> Result<usize, ExchangeError> {
        let found = self.integer(wanted, i64::from(least)..=i64::MAX)?;
        // A count beyond the address space cannot be met, and the text ends long before.
        Ok(usize::try_from(found).unwrap_or(usize::MAX))
    }

    /// So many finite numbers. The text bounds the memory, not the count.
    pub(super) fn numbers(
        &mut self,
        count: usize,
        wanted: impl Fn(usize) -> String,
    ) -> Result<Vec<f64>, ExchangeError> {
        let mut found = Vec::new();
        for index in 0..count {
            // The message is put together only where it is needed.
            match self.peek().map(|word| word.text.parse::<f64>()) {
                Some(Ok(number)) if number.is_finite() => {
                    self.next();
                    found.push(number);
                }
                _ => found.push(self.number(&wanted(index))?),
            }
        }
        Ok(found)
    }

    /// Nothing may be left.
    pub(super) fn finished(&mut self, wanted: &str) -> Result<(), ExchangeError> {
        match self.next() {
            None => Ok(()),
            Some(word) => Err(self.unexpected(word, wanted)),
        }
    }

    pub(super) fn unexpected(&self, word: Word<'_>, wanted: &str) -> ExchangeError {
        ExchangeError::Unexpected {
            place: self.place(word.at),
            found: quoted(word.text),
            wanted: wanted.into(),
        }
    }

    pub(super) fn unsupported(&self, at: usize, what: impl Into<String>) -> ExchangeError {
        ExchangeError::Unsupported {
            place: self.place(at),
            what: what.into(),
        }
    }
}

/// Line and column of a byte of a text.
pub(super) fn place_of(text: &str, at: usize) -> Place {
    let mut end = at.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    Place::Line {
        line: before.bytes().filter(|&b| b == b'\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_places() {
        let text = "ab 1 # note\n  é 2.5e3#x\n\n";
        let mut s = Scanner::new(text, Some('#'));
        assert_eq!(s.keyword("ab").expect("it is there").at, 0);
        assert_eq!(s.count("a count", 1).expect("one"), 1);
        let word = s.word("a letter").expect("it is there");
        assert_eq!(word.text, "é");
        assert_eq!(s.place(word.at), Place::Line { line: 2, column: 3 });
        assert_eq!(s.number("a number").expect("a number"), 2500.0);
        assert_eq!(
            s.number("a weight").expect_err("the end").to_string(),
            "line 4, column 1: found the end of the text, wanted a weight"
        );
    }

    #[test]
    fn numbers_are_finite_and_counts_whole() {
        for bad in ["nan", "inf", "-Infinity", "1e999", "1,5", "0x10", "1.5.2"] {
            let found = Scanner::new(bad, None).number("a knot").expect_err(bad);
            assert_eq!(
                found.to_string(),
                format!("line 1, column 1: found {bad:?}, wanted a knot, a finite number")
            );
        }
        for bad in ["-1", "2.0", "99999999999999999999", "0"] {
            assert!(
                Scanner::new(bad, None).count("a count", 1).is_err(),
                "{bad}"
            );
        }
    }
}
