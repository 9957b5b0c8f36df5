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
