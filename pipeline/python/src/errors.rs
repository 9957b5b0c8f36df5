// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of the crates as exceptions of `batwing.errors`, with key, what was found and what was
//! expected.

use std::any::Any;

use pyo3::prelude::*;

use design::ConfigError;
use pipeline::exit;

/// Where the classes are defined.
const MODULE: &str = "batwing.errors";

/// Parts of a message of the form `KEY: expected EXPECTED, got GOT`.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Parts {
    key: Option<String>,
    got: Option<String>,
    expected: Option<String>,
}

impl Parts {
    fn of(message: &str) -> Self {
        let words = [": expected ", " must ", ", expected "];
        let split = words.iter().find_map(|word| message.rsplit_once(word));
        let Some((before, after)) = split else {
            return Self::default();
        };
        let (expected, got) = match after.split_once(", got ") {
            Some((expected, got)) => (expected, Some(got.split(';').next().unwrap_or(got))),
            None => (after, None),
        };
        let (before, last) = before.rsplit_once(": ").unwrap_or(("", before));
        let (key, beside) = match last.split_once(" = ") {
            // The key that does not exist stands before.
            _ if last.starts_with("no such key") => {
                (before.rsplit(": ").next().unwrap_or(before), Some(last))
            }
            Some((key, got)) => (key, Some(got)),
            None => (last, None),
        };
        let key = key.trim().trim_start_matches("the ");
        Self {
            key: Some(key.to_owned()),
            got: got.or(beside).map(|got| got.trim().to_owned()),
            expected: Some(expected.trim().to_owned()),
        }
    }
}

/// Class and parts of an error.
fn class_of(error: &anyhow::Error, message: &str) -> (&'static str, Parts) {
    for cause in error.chain() {
        match cause.downcast_ref() {
            Some(rcwa::Error::NotConverged { .. }) => {
                return ("ConvergenceError", Parts::of(message));
            }
            Some(rcwa::Error::Energy { .. } | rcwa::Error::Eigen { .. }) => {
                return ("SolverError", Parts::default());
            }
            _ => {}
        }
        if let Some(ConfigError::Value { key, got, expected, .. }) = cause.downcast_ref() {
            let [key, got, expected] = [key, got, expected].map(|text| Some(text.clone()));
            return ("InputError", Parts { key, got, expected });
        }
        if cause.is::<std::io::Error>() {
            return ("FileError", Parts::of(message));
        }
    }
    ("InputError", Parts::of(message))
}

fn raised(py: Python<'_>, class: &str, message: &str, parts: Parts) -> PyErr {
    let build = || {
        let class = py.import(MODULE)?.getattr(class)?;
        class.call1((message, parts.key, parts.got, parts.expected))
    };
    build().map_or_else(|error| error, PyErr::from_value)
}

/// An error of the crates.
pub fn to_python(py: Python<'_>, error: &anyhow::Error) -> PyErr {
    of_texts(py, error, &[])
}

/// The message without the place in the text `name`, which nobody has seen.
fn without_place(message: &str, name: &str) -> Option<String> {
    let (before, after) = message.split_once(&format!("{name}: line "))?;
    let (place, rest) = after.split_once(": ")?;
    let is_place = place.split(", column ").all(|number| number.parse::<usize>().is_ok());
    is_place.then(|| format!("{before}{name}: {rest}"))
}

/// An error of the crates on texts that were made of dicts of Python.
pub fn of_texts(py: Python<'_>, error: &anyhow::Error, names: &[String]) -> PyErr {
    let message = names.iter().fold(exit::message(error), |message, name| {
        without_place(&message, name).unwrap_or(message)
    });
    let (class, parts) = class_of(error, &message);
    raised(py, class, &message, parts)
}

/// An argument that is refused before anything is computed.
pub fn refused(py: Python<'_>, key: &str, expected: &str, got: &str) -> PyErr {
    let parts = Parts {
        key: Some(key.to_owned()),
        got: Some(got.to_owned()),
        expected: Some(expected.to_owned()),
    };
    let message = format!("{key}: expected {expected}, got {got}");
    raised(py, "InputError", &message, parts)
}

/// A panic, which is a mistake in this program.
pub fn internal(py: Python<'_>, panic: &(dyn Any + Send)) -> PyErr {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    let message = format!("internal error, please report it: {text}");
    raised(py, "InternalError", &message, Parts::default())
}
