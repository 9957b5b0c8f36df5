// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reading and writing of text formats: tokens with line numbers, checked numbers, one error type.
//!
//! In: the bytes or the text of a file. Out: words, finite numbers and counts; or a [`FormatError`]
//! with the place, the expectation and what stands there. Nothing allocates more values than the
//! rest of the text can hold, so a file cannot claim memory out of proportion to its length.

use std::fmt;

use bsdf::{GAIN_TOLERANCE, Transport};
use std::fmt::Write as _;

/// The text of a file in UTF-8 (ASCII included), without a byte order mark.
///
/// # Errors
/// If it is UTF-16, holds zero bytes, or is not UTF-8.
pub fn utf8(bytes: &[u8]) -> Result<&str, FormatError> {
    let expected = "text in UTF-8 or ASCII";
    if bytes.starts_with(&[0xff, 0xfe, 0, 0]) || bytes.starts_with(&[0, 0, 0xfe, 0xff]) {
        return Err(FormatError::offset(0, expected, "text in UTF-32"));
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(FormatError::offset(0, expected, "text in UTF-16"));
    }
    if let Some(at) = bytes.iter().position(|&b| b == 0) {
        return Err(FormatError::offset(at as u64, expected, "a zero byte"));
    }
    let start = if bytes.starts_with(&[0xef, 0xbb, 0xbf]) { 3 } else { 0 };
    std::str::from_utf8(&bytes[start..]).map_err(|error| {
        let at = start + error.valid_up_to();
        let got = format!("byte 0x{:02X} of another encoding", bytes[at]);
        FormatError::offset(at as u64, expected, got)
    })
}

/// Checks that all lines end alike: in LF, in CR LF, or in CR. A file with several kinds was joined
/// of others or damaged in transfer, and its line structure cannot be trusted.
///
/// # Errors
/// At the first line that ends otherwise than the first one.
pub fn check_line_ends(text: &str) -> Result<(), FormatError> {
    let bytes = text.as_bytes();
    let (mut at, mut line) = (0, 1);
    let mut first = None;
    while let Some(found) = bytes[at..].iter().position(|b| matches!(b, b'\n' | b'\r')) {
        at += found;
        let end = if bytes[at..].starts_with(b"\r\n") {
            "CR LF"
        } else if bytes[at] == b'\n' {
            "LF"
        } else {
            "CR"
        };
        let kind = *first.get_or_insert(end);
        if kind != end {
            let expected = format!("every line to end in {kind}, as line 1 does");
            return Err(FormatError::line(line, expected, end));
        }
        at += if end == "CR LF" { 2 } else { 1 };
        line += 1;
    }
    Ok(())
}

/// A word of a file as messages show it: quoted, and shortened if long.
pub fn quoted(word: &str) -> String {
    let mut characters = word.chars();
    let start: String = characters.by_ref().take(40).flat_map(char::escape_debug).collect();
    if characters.next().is_some() { format!("`{start}...`") } else { format!("`{start}`") }
}

/// The comments in the first lines of a text, each without its `#`.
pub fn leading_comments(text: &str) -> Vec<String> {
    text.split(['\n', '\r'])
        .filter(|l| !l.is_empty())
        .map_while(|l| l.trim().strip_prefix('#'))
        .map(|c| c.trim().to_owned())
        .collect()
}

/// `word` as a finite number.
///
/// # Errors
/// If it is none, NaN, infinite, or written with a decimal comma.
pub fn parse_number(word: &str, line: usize, what: &str) -> Result<f64, FormatError> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(FormatError::line(line, format!("{what}: a finite number"), quoted(word))),
        Err(_) if word.contains(',') => Err(FormatError::line(
            line,
            format!("{what}: a number with a decimal point"),
            format!("{}, with a comma", quoted(word)),
        )),
        Err(_) => Err(FormatError::line(line, format!("{what}: a number"), quoted(word))),
    }
}

/// Tokens of a text, separated by blanks and line ends of any kind. Optionally, `#` begins a
/// comment that ends with the line.
#[derive(Clone, Debug)]
pub struct Tokens<'a> {
    rest: &'a str,
    line: usize,
    /// The byte that ends lines: some files have no line feeds.
    line_end: u8,
    comments: bool,
}

impl<'a> Tokens<'a> {
    /// The tokens of `text`, with comments from `#` on if `comments`.
    pub fn new(text: &'a str, comments: bool) -> Self {
        Self {
            rest: text,
            line: 1,
            line_end: if text.contains('\n') { b'\n' } else { b'\r' },
            comments,
        }
    }

    /// The tokens of a part of a file that begins at `line`, without comments.
    pub fn starting(text: &'a str, line: usize) -> Self {
        Self { line, ..Self::new(text, false) }
    }

    /// The line of the next token (or of the end).
    pub fn line(&mut self) -> usize {
        self.skip_blanks();
        self.line
    }

    fn skip_blanks(&mut self) {
        let bytes = self.rest.as_bytes();
        let mut at = 0;
        let mut comment = false;
        while let Some(&byte) = bytes.get(at) {
            if byte == b'\n' || byte == b'\r' {
                comment = false;
                self.line += usize::from(byte == self.line_end);
            } else if self.comments && byte == b'#' {
                comment = true;
            } else if !comment && !byte.is_ascii_whitespace() {
                break;
            }
            at += 1;
        }
        // `at` stands before an ASCII byte or, outside comments, at the start of a character.
        self.rest = &self.rest[at..];
    }

    /// The next token, not consumed.
    pub fn peek(&mut self) -> Option<&'a str> {
        self.skip_blanks();
        let end =
            self.rest.bytes().position(|b| b.is_ascii_whitespace()).unwrap_or(self.rest.len());
        (end > 0).then(|| &self.rest[..end])
    }

    /// Consumes the next token.
    pub fn take(&mut self) -> Option<&'a str> {
        let word = self.peek()?;
        self.rest = &self.rest[word.len()..];
        Some(word)
    }

    /// Consumes the next token; `what` names it in the message if there is none.
    ///
    /// # Errors
    /// At the end of the text.
    pub fn word(&mut self, what: &str) -> Result<&'a str, FormatError> {
        self.take().ok_or_else(|| FormatError::line(self.line, what, "the end of the file"))
    }

    /// Consumes one of `choices`, in upper or lower case, and returns its index.
    ///
    /// # Errors
    /// If the token is another, or at the end of the text.
    pub fn one_of(&mut self, choices: &[&str]) -> Result<usize, FormatError> {
        let expected = choices.join(" or ");
        let line = self.line();
        let word = self.word(&expected)?;
        choices
            .iter()
            .position(|c| c.eq_ignore_ascii_case(word))
            .ok_or_else(|| FormatError::line(line, expected, quoted(word)))
    }

    /// Consumes a finite number.
    ///
    /// # Errors
    /// If it is none, or at the end of the text.
    pub fn number(&mut self, what: &str) -> Result<f64, FormatError> {
        let line = self.line();
        parse_number(self.word(what)?, line, what)
    }

    /// Consumes a finite number for which `holds` is true; `expected` describes that condition.
    ///
    /// # Errors
    /// If it is none.
    pub fn number_that(
        &mut self,
        what: &str,
        expected: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<f64, FormatError> {
        let line = self.line();
        let word = self.word(what)?;
        let value = parse_number(word, line, what)?;
        if holds(value) {
            Ok(value)
        } else {
            Err(FormatError::line(line, format!("{what}: {expected}"), quoted(word)))
        }
    }

    /// Consumes a whole number from `low` to `high`.
    ///
    /// # Errors
    /// If it is none.
    pub fn count(&mut self, what: &str, low: usize, high: usize) -> Result<usize, FormatError> {
        let line = self.line();
        let word = self.word(what)?;
        word.parse().ok().filter(|n| (low..=high).contains(n)).ok_or_else(|| {
            let expected = format!("{what}: a whole number from {low} to {high}");
            FormatError::line(line, expected, quoted(word))
        })
    }

    /// Upper bound on the number of tokens left.
    pub fn at_most(&self) -> usize {
        self.rest.len().div_ceil(2)
    }

    /// Consumes a list of angles in degrees: their count, then as many, ascending, from `low` to
    /// `high`.
    ///
    /// # Errors
    /// If they are not.
    pub fn angles(&mut self, what: &str, low: f64, high: f64) -> Result<Vec<f64>, FormatError> {
        let max = self.at_most();
        let count = self.count(&format!("number of {what} angles"), 1, max.max(1))?;
        let mut angles: Vec<f64> = Vec::with_capacity(count.min(max));
        for _ in 0..count {
            let before = angles.last().copied();
            let expected = before.map_or_else(
                || format!("an angle from {low} to {high} degrees"),
                |before| format!("an angle above {before}, at most {high} degrees"),
            );
            let angle = self.number_that(&format!("{what} angle"), &expected, |a| {
                (low..=high).contains(&a) && before.is_none_or(|b| a > b)
            })?;
            angles.push(angle);
        }
        Ok(angles)
    }

    /// Consumes `count` numbers, ascending within `range`.
    ///
    /// # Errors
    /// If they are not.
    pub(crate) fn ascending(
        &mut self,
        what: &str,
        count: usize,
        [low, high]: [f64; 2],
    ) -> Result<Vec<f64>, FormatError> {
        let mut numbers: Vec<f64> = Vec::with_capacity(count.min(self.at_most()));
        for _ in 0..count {
            let before = numbers.last().copied();
            let expected = format!("ascending from {low} to {high}");
            numbers.push(self.number_that(what, &expected, |v| {
                (low..=high).contains(&v) && before.is_none_or(|b| v > b)
            })?);
        }
        Ok(numbers)
    }

    /// Consumes the rest of the line, its end included.
    pub(crate) fn text_line(&mut self) -> &'a str {
        let end = self.rest.find(['\r', '\n']).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        let break_length = match rest.as_bytes() {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        self.rest = &rest[break_length..];
        self.line += usize::from(break_length > 0);
        line
    }

    /// Consumes `count` characters, line ends counting one each.
    ///
    /// # Errors
    /// If there are fewer.
    pub(crate) fn characters(&mut self, count: usize) -> Result<(), FormatError> {
        let mut left = count;
        while left > 0 {
            match self.rest.chars().next() {
                None => {
                    let expected = format!("{count} characters of text");
                    let got = format!("the end of the file after {}", count - left);
                    return Err(FormatError::line(self.line, expected, got));
                }
                Some('\r' | '\n') => drop(self.text_line()),
                Some(character) => self.rest = &self.rest[character.len_utf8()..],
            }
            left -= 1;
        }
        Ok(())
    }

    /// Consumes `count` numbers of 0 or more.
    ///
    /// # Errors
    /// If there are fewer, or one is below 0.
    pub fn values(&mut self, what: &str, count: usize) -> Result<Vec<f64>, FormatError> {
        let mut values = Vec::with_capacity(count.min(self.at_most()));
        for _ in 0..count {
            values.push(self.number_that(what, "0 or more", |v| v >= 0.0)?);
        }
        Ok(values)
    }

    /// Consumes a total integrated scatter: power per incident power.
    ///
    /// # Errors
    /// If it lies outside 0 to 1 by more than [`GAIN_TOLERANCE`].
    pub(crate) fn total_scatter(&mut self) -> Result<f64, FormatError> {
        let range = 0.0..=1.0 + GAIN_TOLERANCE;
        self.number_that("TIS", "a power from 0 to 1", |t| range.contains(&t))
    }

    /// Consumes a scatter type.
    ///
    /// # Errors
    /// If it is none.
    pub(crate) fn scatter_type(&mut self) -> Result<Transport, FormatError> {
        Ok(Transport::BOTH[self.one_of(&SCATTER_TYPES)?])
    }

    /// Checks that nothing follows; `expected` describes the end.
    ///
    /// # Errors
    /// If a token is left.
    pub(crate) fn end(&mut self, expected: &str) -> Result<(), FormatError> {
        let line = self.line();
        self.take().map_or(Ok(()), |word| Err(FormatError::line(line, expected, quoted(word))))
    }
}

/// Scatter types as files spell them, in the order of [`Transport::BOTH`].
const SCATTER_TYPES: [&str; 2] = ["BRDF", "BTDF"];

/// The scatter type of a transport, as files spell it.
pub fn scatter_type(transport: Transport) -> &'static str {
    SCATTER_TYPES[transport.index()]
}

/// Appends comment lines.
pub(crate) fn push_comments(text: &mut String, comments: &[String]) {
    for comment in comments {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "# {}", comment.replace(['\r', '\n'], " "));
    }
}

/// Appends a list of angles with its count.
pub(crate) fn push_angles(text: &mut String, keyword: &str, angles: &[f64]) {
    let list: Vec<String> = angles.iter().map(ToString::to_string).collect();
    let _ = writeln!(text, "{keyword} {}\n{}", angles.len(), list.join("\t"));
}

/// Appends values in rows of `columns`, separated by tabs: eight significant digits, `0` for zero.
pub(crate) fn push_rows(text: &mut String, values: &[f64], columns: usize) {
    for row in values.chunks_exact(columns) {
        for (column, value) in row.iter().enumerate() {
            if column > 0 {
                text.push('\t');
            }
            let _ = if *value == 0.0 { write!(text, "0") } else { write!(text, "{value:.7e}") };
        }
        text.push('\n');
    }
}

/// Position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Line of a text, from 1.
    Line(usize),
    /// Byte from the beginning, from 0.
    Offset(u64),
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Offset(offset) => write!(f, "offset {offset}"),
        }
    }
}

/// A violation of a file format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{at}: expected {expected}, got {got}")]
pub struct FormatError {
    /// Position.
    pub at: Position,
    /// Content that the format expects.
    pub expected: String,
    /// Content of the file.
    pub got: String,
}

impl FormatError {
    /// At a line of a text.
    pub fn line(line: usize, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self { at: Position::Line(line), expected: expected.into(), got: got.into() }
    }

    /// At a byte of a file.
    pub fn offset(offset: u64, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self { at: Position::Offset(offset), expected: expected.into(), got: got.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_lines_whatever_ends_them() {
        for text in ["a\nb # c\n\nd", "a\r\nb # c\r\n\r\nd", "a\rb # c\r\rd", "a\n\rb # c\n\r\n\rd"]
        {
            let mut words = Tokens::new(text, true);
            let mut found = Vec::new();
            loop {
                let line = words.line();
                let Some(word) = words.take() else { break };
                found.push((line, word));
            }
            assert_eq!(found, [(1, "a"), (2, "b"), (4, "d")], "{text:?}");
        }
        let mut words = Tokens::new("a # no", false);
        assert_eq!((words.take(), words.take(), words.take()), (Some("a"), Some("#"), Some("no")));
    }

    #[test]
    fn lines_that_end_differently_are_refused_with_the_first_of_them() {
        for text in ["", "a", "a\n\nb\n", "a\r\n\r\nb", "a\r\rb\r"] {
            assert_eq!(check_line_ends(text), Ok(()), "{text:?}");
        }
        for (text, line, kind, got) in [
            ("a\nb\r\nc\n", 2, "LF", "CR LF"),
            ("a\r\nb\r\nc\n", 3, "CR LF", "LF"),
            ("a\r\nb\rc\r\n", 2, "CR LF", "CR"),
            ("a\n\rb", 2, "LF", "CR"),
            ("a\rb\r\n", 2, "CR", "CR LF"),
            ("a\r\r\nb", 2, "CR", "CR LF"),
        ] {
            let message = check_line_ends(text).unwrap_err().to_string();
            let expected = format!(
                "line {line}: expected every line to end in {kind}, as line 1 does, got {got}"
            );
            assert_eq!(message, expected, "{text:?}");
        }
    }

    #[test]
    fn numbers_that_are_none_are_named() {
        let message = |word: &str| parse_number(word, 7, "TIS").unwrap_err().to_string();
        assert_eq!(
            message("0,5"),
            "line 7: expected TIS: a number with a decimal point, got `0,5`, with a comma"
        );
        assert_eq!(message("nan"), "line 7: expected TIS: a finite number, got `nan`");
        assert_eq!(message("1e999"), "line 7: expected TIS: a finite number, got `1e999`");
        assert_eq!(message("x"), "line 7: expected TIS: a number, got `x`");
    }

    #[test]
    fn other_encodings_are_named() {
        assert_eq!(utf8(b"\xef\xbb\xbfabc").unwrap(), "abc");
        for (bytes, got) in [
            (&b"\xff\xfea\0"[..], "UTF-16"),
            (b"\xff\xfe\0\0a\0\0\0", "UTF-32"),
            (b"ab\0c", "offset 2"),
            (b"abc\xe9", "byte 0xE9"),
        ] {
            let message = utf8(bytes).unwrap_err().to_string();
            assert!(message.contains(got), "{message}");
        }
    }

    #[test]
    fn a_count_beyond_the_text_is_refused_before_anything_is_allocated() {
        let error =
            Tokens::new("4000000000 1 2 3", false).angles("incidence", 0.0, 90.0).unwrap_err();
        assert!(error.to_string().contains("a whole number from 1 to"), "{error}");
        let error = Tokens::new("3 1 2 2", false).angles("incidence", 0.0, 90.0).unwrap_err();
        assert!(error.to_string().contains("above 2"), "{error}");
    }
}
