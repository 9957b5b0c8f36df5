// SPDX-License-Identifier: MIT OR Apache-2.0
//! Control characters, which steer terminals: refused in input files, escaped where text of others
//! is shown.

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
}
