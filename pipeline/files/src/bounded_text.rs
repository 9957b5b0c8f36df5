// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text of files that are read whole: no file may claim memory out of proportion.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Result, ensure};

/// Largest file of keys, such as a design: its reader takes some eighty times as much memory.
pub const MAX_KEYS: u64 = 4_000_000;
/// Largest file of rows of numbers.
pub const MAX_ROWS: u64 = 16_000_000;

/// The text of the file at `path`, which has at most `max_bytes`.
///
/// # Errors
/// A file that cannot be read, is larger, or is no UTF-8.
pub fn bounded_text(path: &Path, max_bytes: u64) -> Result<String> {
    let mut text = String::new();
    // A pipe states no length: one byte more tells.
    let read = File::open(path)?.take(max_bytes + 1).read_to_string(&mut text);
    let megabytes = |bytes: u64| bytes as f64 * 1e-6;
    let length = std::fs::metadata(path)?.len().max(text.len() as u64);
    ensure!(
        length <= max_bytes,
        "expected at most {} MB, got {:.1}",
        megabytes(max_bytes),
        megabytes(length)
    );
    read?;
    Ok(text)
}
