// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of bad input: a good file, and what is laid over it, each with the message that must
//! come.
//!
//! A file of `tests/bad_input/` is cut at lines `+++`. The first part is a good design (TOML) or
//! grating (JSON), or names the file that holds it: `#< path`. Every further part has a head of
//! comments, `# what is wrong`, then `#^ words of the message` (all must appear; the file is called
//! `bad.toml` or `bad.json`), and a body. The body is laid over the good file, table by table; the
//! value `"(removed)"` takes a key out. With the comment `#= as it is` the body is the whole file.

use serde_json::Value as Json;
use toml::Value as Toml;

/// One bad file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// What is wrong, in words.
    pub title: String,
    /// Pieces of the message that must come.
    pub words: Vec<String>,
    /// The file's text.
    pub text: String,
}

const REMOVED: &str = "(removed)";

/// A document that another can be laid over.
trait Document: Sized {
    fn parse(text: &str) -> Result<Self, String>;
    fn print(&self) -> String;
    /// Whether it takes out what it is laid over.
    fn removes(&self) -> bool;
    /// The entries of a table; what is none comes back as it is.
    fn entries(self) -> Result<Vec<(String, Self)>, Self>;
    fn table(entries: Vec<(String, Self)>) -> Self;

    /// This document with `over` laid over it.
    fn under(self, over: Self) -> Self {
        let (mut mine, over) = match (self.entries(), over.entries()) {
            (Ok(mine), Ok(over)) => (mine, over),
            (Err(_), Ok(over)) => return Self::table(over),
            (_, Err(over)) => return over,
        };
        for (key, value) in over {
            let old = mine.iter().position(|(k, _)| *k == key);
            let old = old.map(|place| mine.swap_remove(place).1);
            if value.removes() {
                assert!(old.is_some(), "no {key} to remove");
                continue;
            }
            let new = match old {
                Some(old) => old.under(value),
                None => value,
            };
            mine.push((key, new));
        }
        Self::table(mine)
    }
}

impl Document for Toml {
    fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|e| e.to_string())
    }

    fn print(&self) -> String {
        toml::to_string(self).expect("a table")
    }

    fn removes(&self) -> bool {
        self.as_str() == Some(REMOVED)
    }

    fn entries(self) -> Result<Vec<(String, Self)>, Self> {
        match self {
            Self::Table(table) => Ok(table.into_iter().collect()),
            other => Err(other),
        }
    }

    fn table(entries: Vec<(String, Self)>) -> Self {
        Self::Table(entries.into_iter().collect())
    }
}

impl Document for Json {
    fn parse(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    fn print(&self) -> String {
        self.to_string()
    }

    fn removes(&self) -> bool {
        self.as_str() == Some(REMOVED)
    }

    fn entries(self) -> Result<Vec<(String, Self)>, Self> {
        match self {
            Self::Object(table) => Ok(table.into_iter().collect()),
            other => Err(other),
        }
    }

    fn table(entries: Vec<(String, Self)>) -> Self {
        Self::Object(entries.into_iter().collect())
    }
}

/// The good text and the bad cases of a TOML file.
///
/// # Panics
/// If the file is not as described above.
pub fn toml_cases(text: &str) -> (String, Vec<Case>) {
    cases::<Toml>(text)
}

/// The good text and the bad cases of a JSON file.
///
/// # Panics
/// If the file is not as described above.
pub fn json_cases(text: &str) -> (String, Vec<Case>) {
    cases::<Json>(text)
}

fn cases<D: Document>(text: &str) -> (String, Vec<Case>) {
    let mut parts = text.split("\n+++\n");
    let first = parts.next().unwrap_or_default();
    let good = match first.lines().find_map(|line| line.strip_prefix("#< ")) {
        Some(path) => good(&crate::read(path)),
        None => good(first),
    };
    let cases = parts.map(|part| case::<D>(&good, part)).collect();
    (good, cases)
}

/// The good file at the beginning of `text`.
///
/// # Panics
/// If it is a reference to another file.
pub fn good(text: &str) -> String {
    let first = text.split("\n+++\n").next().unwrap_or_default();
    assert!(!first.contains("#< "), "a reference to a reference");
    uncommented(first)
}

/// The text without lines that begin with `#`, which JSON does not know.
fn uncommented(text: &str) -> String {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .fold(String::new(), |all, line| all + line + "\n")
}

fn case<D: Document>(good: &str, part: &str) -> Case {
    let head: Vec<&str> = part.lines().take_while(|l| l.starts_with('#')).collect();
    let title = head.first().map_or("", |l| l.trim_start_matches('#').trim());
    let words: Vec<String> =
        head.iter().filter_map(|l| l.strip_prefix("#^")).map(|l| l.trim().to_owned()).collect();
    assert!(!words.is_empty(), "`{title}` expects no message");
    let body = uncommented(part);
    let text = if head.iter().any(|l| l.starts_with("#= as it is")) {
        body
    } else {
        let read = |text: &str| D::parse(text).unwrap_or_else(|e| panic!("{title}: {e}"));
        read(good).under(read(&body)).print()
    };
    Case { title: title.to_owned(), words, text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_laid_over_the_good_file() {
        let text = "# good\na = 1\n[b]\nc = 2\nd = 3\n+++\n# too much\n#^ b.c = 9\n#^ expected\nb.c = 9\n+++\n# gone\n#^ d\n[b]\nd = \"(removed)\"\n+++\n# nonsense\n#^ line 1\n#= as it is\na = = 1\n";
        let (good, cases) = toml_cases(text);
        assert_eq!(good, "a = 1\n[b]\nc = 2\nd = 3\n");
        assert_eq!(
            (cases[0].title.as_str(), &cases[0].words[..]),
            ("too much", &["b.c = 9".to_owned(), "expected".to_owned()][..])
        );
        let table = |text: &str| text.parse::<toml::Table>().expect("TOML");
        assert_eq!(table(&cases[0].text), table("a = 1\n[b]\nc = 9\nd = 3"));
        assert_eq!(table(&cases[1].text), table("a = 1\n[b]\nc = 2"));
        assert_eq!(cases[2].text, "a = = 1\n");
    }
}
