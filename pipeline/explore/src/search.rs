// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far a search from the present design is.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use serde_json::{Value, json};

use runtime::interrupt::Interrupt;

/// A search and how far it is.
#[derive(Debug, Default)]
pub struct Search {
    /// Its folder; none before the first.
    pub folder: Option<PathBuf>,
    /// Figure that is to grow.
    pub figure: String,
    /// Raised to stop it.
    pub interrupt: Interrupt,
    /// True until it has ended.
    pub is_running: bool,
    /// How far it is, for people.
    pub lines: Vec<String>,
    /// Values found, by key.
    pub found: Option<Vec<(String, Value)>>,
    /// Why it found nothing.
    pub error: Option<String>,
}

impl Search {
    /// Stops it.
    pub fn stop(&self) {
        self.interrupt.flag().store(true, Ordering::SeqCst);
    }

    /// As the page reads it.
    pub fn to_json(&self) -> Value {
        if self.folder.is_none() && !self.is_running {
            return Value::Null;
        }
        json!({"running": self.is_running, "lines": self.lines, "found": self.found.is_some(),
            "error": self.error})
    }
}
