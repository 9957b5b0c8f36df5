// SPDX-License-Identifier: MIT OR Apache-2.0
//! Messages for command lines that cannot be parsed, one line each.
//!
//! A message names the argument, what was expected and what was found. It suggests the nearest name
//! where one was mistyped.

use std::error::Error as _;
use std::num::{ParseFloatError, ParseIntError};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

use formats::listed;

/// The message for `error` of the command line `cli`, which is neither help nor version.
pub fn message(error: &Error, cli: &Command) -> String {
    let argument = name(&text(error, ContextKind::InvalidArg));
    let value = text(error, ContextKind::InvalidValue);
    match error.kind() {
        ErrorKind::InvalidValue if value.is_empty() => {
            let placeholder = text(error, ContextKind::InvalidArg);
            let expected =
                placeholder.split_once(' ').map_or("a value", |(_, placeholder)| placeholder);
            format!("{argument}: expected {}, got nothing", bare(expected))
        }
        ErrorKind::InvalidValue => {
            let known = Some(listed(&texts(error, ContextKind::ValidValue), "or"));
            let known = known.filter(|known| !known.is_empty()).unwrap_or("another one".to_owned());
            format!("{argument}: expected {known}, got {value:?}{}", nearest(error))
        }
        ErrorKind::ValueValidation => {
            let expected = expected_value(error);
            if expected.contains(" got ") {
                format!("{argument}: {expected}")
            } else {
                format!("{argument}: {expected}, got {value:?}")
            }
        }
        ErrorKind::UnknownArgument if argument.starts_with('-') => {
            let (of, near) = (command(error), nearest(error));
            format!("expected options that `{of} --help` lists, got {argument}{near}")
        }
        ErrorKind::UnknownArgument => {
            let of = command(error);
            format!("expected no more than `{of} --help` lists, got {argument:?}")
        }
        ErrorKind::InvalidSubcommand => {
            let got = text(error, ContextKind::InvalidSubcommand);
            format!("expected {}, got {got:?}{}", commands(cli), nearest(error))
        }
        ErrorKind::MissingSubcommand => format!("expected {}, got none", commands(cli)),
        ErrorKind::MissingRequiredArgument => {
            let missing = texts(error, ContextKind::InvalidArg);
            let missing: Vec<String> = missing.iter().map(|argument| bare(argument)).collect();
            let (of, missing) = (command(error), listed(&missing, "and"));
            // The program names itself before every message.
            let of = of.strip_prefix("batwing ").map_or_else(String::new, |of| format!("{of}: "));
            format!("{of}expected {missing}, got nothing of it")
        }
        ErrorKind::ArgumentConflict => {
            let others = texts(error, ContextKind::PriorArg);
            let others: Vec<String> = others.iter().map(|argument| name(argument)).collect();
            if others.is_empty() || others.contains(&argument) {
                format!("{argument}: expected once, got more than once")
            } else {
                format!(
                    "{argument}: expected no such option beside {}, got both",
                    listed(&others, "and")
                )
            }
        }
        ErrorKind::TooManyValues => format!("{argument}: expected no value, got {value:?}"),
        ErrorKind::InvalidUtf8 => "expected a command line in UTF-8, got other bytes".to_owned(),
        // Kinds that no argument of this program can lead to.
        _ => {
            let said = error.to_string();
            let first = said.lines().next().unwrap_or_default();
            first.trim_start_matches("error: ").to_owned()
        }
    }
}

/// The expectation that the parser of a value states.
fn expected_value(error: &Error) -> String {
    let Some(source) = error.source() else {
        return "expected another value".to_owned();
    };
    if source.is::<ParseIntError>() {
        "expected a whole number, not below 0".to_owned()
    } else if source.is::<ParseFloatError>() {
        "expected a number".to_owned()
    } else {
        source.to_string()
    }
}

/// All texts of one kind in the context of `error`.
fn texts(error: &Error, kind: ContextKind) -> Vec<String> {
    match error.get(kind) {
        Some(ContextValue::String(one)) => vec![one.clone()],
        Some(ContextValue::Strings(all)) => all.clone(),
        _ => Vec::new(),
    }
}

/// The first text of a kind, or an empty one.
fn text(error: &Error, kind: ContextKind) -> String {
    texts(error, kind).into_iter().next().unwrap_or_default()
}

/// `--threads` of `--threads <N>`, `DESIGN.toml` of `<DESIGN.toml>`.
fn name(argument: &str) -> String {
    let first = argument.split([' ', '=']).next().unwrap_or_default();
    bare(first)
}

/// Without the brackets of placeholders.
fn bare(argument: &str) -> String {
    argument.replace(['<', '>'], "")
}

/// A suggestion of the name that was probably meant.
fn nearest(error: &Error) -> String {
    let kinds =
        [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::SuggestedValue];
    let suggested = kinds.map(|kind| text(error, kind));
    let near = suggested.iter().find(|near| !near.is_empty());
    near.map_or_else(String::new, |near| format!("; did you mean {}?", name(near)))
}

/// The command that was parsed: `batwing run`.
fn command(error: &Error) -> String {
    let usage = error.get(ContextKind::Usage).map(ToString::to_string);
    let usage = usage.unwrap_or_default();
    let words = usage.split_whitespace().skip_while(|word| *word != "batwing");
    let words: Vec<&str> = words.take_while(|word| !word.starts_with(['<', '[', '-'])).collect();
    if words.is_empty() { "batwing".to_owned() } else { words.join(" ") }
}

/// The list of commands.
fn commands(cli: &Command) -> String {
    let names: Vec<String> =
        cli.get_subcommands().map(|command| command.get_name().to_owned()).collect();
    format!("one of the commands {}", listed(&names, "or"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};

    use crate::cli::Cli;

    fn said(line: &str) -> String {
        let words = std::iter::once("batwing").chain(line.split_whitespace());
        message(&Cli::try_parse_from(words).expect_err(line), &Cli::command())
    }

    #[test]
    fn every_mistake_has_its_line() {
        for (line, expected) in [
            (
                "run d.toml --threads 0",
                "--threads: expected a whole number from 1 to 1024, got \"0\"",
            ),
            (
                "--threads two run d.toml",
                "--threads: expected a whole number from 1 to 1024, got \"two\"",
            ),
            (
                "run d.toml --seed -1",
                "--seed: expected a whole number from 0 to 18446744073709551615, got \"-1\"",
            ),
            (
                "run d.toml --paths 10",
                "--paths: expected a whole number from 1000 to 1000000000000, such as 1000000, 1_000_000 or 1e6, got \"10\"",
            ),
            (
                "run d.toml --paths -5",
                "--paths: expected a whole number from 1000 to 1000000000000, such as 1000000, 1_000_000 or 1e6, got \"-5\"",
            ),
            (
                "run d.toml --model hybird",
                "--model: expected geometric, fine, control, hybrid or all, got \"hybird\"; did you mean hybrid?",
            ),
            ("run d.toml --paths", "--paths: expected N, got nothing"),
            ("run d.toml --out --quiet", "--out: expected DIR, got nothing"),
            (
                "run d.toml --thread 2",
                "expected options that `batwing run --help` lists, got --thread; did you mean --threads?",
            ),
            (
                "run d.toml more.toml",
                "expected no more than `batwing run --help` lists, got \"more.toml\"",
            ),
            ("run d.toml --quiet=no", "--quiet: expected no value, got \"no\""),
            ("run d.toml --seed 1 --seed 2", "--seed: expected once, got more than once"),
            ("run", "run: expected DESIGN.toml, got nothing of it"),
            ("converge", "converge: expected --ring N and DESIGN.toml, got nothing of it"),
            (
                "run d.toml --most-paths 5000",
                "run: expected --until-error FIGURE=ERROR, got nothing of it",
            ),
            ("zones d.toml --levels max", "zones: expected --picture FILE, got nothing of it"),
            (
                "zones d.toml --pattern p.csv --white -0.3,0.3",
                "--white: expected x and y with a sum below 1, such as 0.3127,0.3290, or a temperature from 1000K to 25000K, got \"-0.3,0.3\"",
            ),
            (
                "run d.toml --until-error uniformity=-1%",
                "--until-error: expected an error above 0, got \"-1\"",
            ),
            (
                "bsdf d.toml --no-cache --cache c",
                "--no-cache: expected no such option beside --cache, got both",
            ),
            (
                "bsdf d.toml --rings 0",
                "--rings: expected `representatives`, `all` or ring numbers from 1 such as `5,75,165`, got `0`",
            ),
            (
                "near-field d.toml --ring 7 --theta-deg 95",
                "--theta-deg: expected an angle above -90 and below 90 degrees, got \"95\"",
            ),
            (
                "rum d.toml",
                "expected one of the commands new, reproduce, run, bsdf, study, optimise, tolerance, explore, converge, near-field, full-wave, zones, plan, submit, merge, grating, export, import, schema, report, rays, check, completions or man, got \"rum\"; did you mean run?",
            ),
        ] {
            assert_eq!(said(line), expected, "batwing {line}");
        }
        assert!(said("--quiet").ends_with("completions or man, got none"));
    }

    /// Whatever is given to whatever argument of whatever command: one line that names it.
    #[test]
    fn every_value_of_every_argument_is_refused_in_one_line() {
        let mut tried = 0;
        for command in Cli::command().get_subcommands() {
            for argument in command.get_arguments() {
                let Some(long) = argument.get_long().filter(|long| *long != "help") else {
                    continue;
                };
                for value in ["", "=", "=-1", "=x y", "=1e999", "=%"] {
                    let flag = format!("--{long}{value}");
                    let line = ["batwing", command.get_name(), "d.toml", &flag];
                    let Err(error) = Cli::try_parse_from(line) else {
                        continue;
                    };
                    let said = message(&error, &Cli::command());
                    assert!(said.contains("expected ") && !said.contains('\n'), "{line:?}: {said}");
                    assert!(!said.starts_with("error:"), "{line:?}: {said}");
                    tried += 1;
                }
            }
        }
        assert!(tried > 50, "{tried}");
    }
}
