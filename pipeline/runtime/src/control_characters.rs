// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text of others: control characters, which steer terminals, are refused in input files and escaped
//! where text is shown; in messages numbers and quotes are bounded.

use std::borrow::Cow;
use std::fmt::Write as _;

/// `text` as a terminal shows it: control characters but line breaks and tabs as `\u001b`, which
/// reads the same in JSON.
pub fn printable(text: &str) -> Cow<'_, str> {
    let steers = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if steers(c) {
            // Writing to a string cannot fail.
            let _ = write!(shown, "\\u{:04x}", u32::from(c));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Maximum digits of a number in a message, and maximum characters of a word or a quote in one:
/// those of paths; and characters of a longer one that are shown.
const MAX_DIGITS: usize = 25;
const MAX_QUOTE: usize = 300;
const SHOWN: usize = 60;

/// `message` with numbers of many digits to six of them with a power of ten, and long words, quotes
/// and lists cut.
pub fn bounded(message: &str) -> String {
    let mut bounded = String::with_capacity(message.len());
    let mut rest = message;
    while let Some(first) = rest.chars().next() {
        let close = match first {
            '`' | '"' => Some(first),
            // Not the choices of an option.
            '[' if rest[1..].starts_with(|c: char| !c.is_alphabetic()) => Some(']'),
            _ => None,
        };
        let quote = close.and_then(|close| {
            let end = rest[1..].find(close)? + 2;
            (rest[..end].chars().count() > MAX_QUOTE).then_some((close, end))
        });
        if let Some((close, end)) = quote {
            bounded.extend(rest.chars().take(SHOWN));
            bounded.push_str("...");
            bounded.push(close);
            rest = &rest[end..];
            continue;
        }
        let ends_word = |c: char| c.is_whitespace() || matches!(c, '`' | '"' | '[');
        let end = rest.char_indices().skip(1).find(|(_, c)| ends_word(*c) || ends_word(first));
        let (word, after) = rest.split_at(end.map_or(rest.len(), |(at, _)| at));
        push_word(&mut bounded, word);
        rest = after;
    }
    bounded
}

fn push_word(bounded: &mut String, word: &str) {
    let bare = word.trim_end_matches([',', ';', ':', '.', ')', '%']);
    let digits = bare.chars().filter(char::is_ascii_digit).count();
    match bare.parse::<f64>() {
        Ok(number) if digits > MAX_DIGITS && number.is_finite() => {
            // To six digits, without the zeros at the end.
            let rounded: f64 = format!("{number:.5e}").parse().unwrap_or(number);
            let _ = write!(bounded, "{rounded:e}{}", &word[bare.len()..]);
        }
        Ok(_) if digits > MAX_DIGITS => {
            let _ = write!(bounded, "a number of {digits} digits{}", &word[bare.len()..]);
        }
        _ if word.chars().nth(MAX_QUOTE).is_some() => {
            bounded.extend(word.chars().take(SHOWN));
            bounded.push_str("...");
        }
        _ => bounded.push_str(word),
    }
}

/// The refusal of `text` that is a key, a name or the like; `None` where it can be used. A
/// description may have `lines`.
pub fn refusal(text: &str, lines: bool) -> Option<String> {
    let allowed = |c: char| lines && matches!(c, '\n' | '\r' | '\t');
    let found = text.chars().any(|c| c.is_control() && !allowed(c));
    found.then(|| format!("expected text without control characters, got {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_and_refused() {
        assert_eq!(printable("a\u{1b}[31m\u{9b}\n"), "a\\u001b[31m\\u009b\n");
        assert!(matches!(printable("µm\t1\n"), Cow::Borrowed(_)));
        assert_eq!(refusal("two\nlines", true), None);
        let said = refusal("two\nlines", false).expect("refused");
        assert_eq!(said, "expected text without control characters, got \"two\\nlines\"");
        assert!(refusal("a\u{7f}", true).is_some());
    }

    #[test]
    fn numbers_and_quotes_of_messages_are_bounded() {
        let same =
            "`a b/c d.toml`: led.size_mm[1]: expected 1e-6 to 10 000, got [1, \"two\", 0.25]";
        assert_eq!(bounded(same), same);
        let zeros = "0".repeat(300);
        let number = format!("key = -12{zeros}: expected less, got 1{zeros}{zeros}.");
        assert_eq!(bounded(&number), "key = -1.2e301: expected less, got a number of 601 digits.");
        let small = format!("got 0.{zeros}1234567");
        assert_eq!(bounded(&small), "got 1.23457e-301");
        let long = "é".repeat(5000);
        for text in [format!("got `{long}`, or"), format!("got \"{long}\""), long.clone()] {
            assert!(bounded(&text).chars().count() < 100, "{}", bounded(&text));
        }
        let list = format!("got [{}]: or", "1, ".repeat(2000));
        assert!(bounded(&list).ends_with("...]: or") && bounded(&list).len() < 100);
        assert_eq!(bounded("no `end"), "no `end");
    }
}
