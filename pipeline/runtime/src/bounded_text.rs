// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files that are read whole: none may claim memory out of proportion.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Result, anyhow, ensure};

/// Largest file of keys, such as a design: its reader takes some eighty times as much memory.
pub const MAX_KEYS: u64 = 4_000_000;
/// Largest file of rows of numbers, or of a far field.
pub const MAX_ROWS: u64 = 16_000_000;
/// Largest file of scattering or of diffraction orders.
pub const MAX_TABLES: u64 = 2_000_000_000;

/// The text of the file at `path`, which has at most `max_bytes`.
///
/// # Errors
/// A file that cannot be read, is larger, or is no UTF-8.
pub fn bounded_text(path: &Path, max_bytes: u64) -> Result<String> {
    String::from_utf8(bounded_bytes(path, max_bytes)?)
        .map_err(|error| anyhow!("expected text in UTF-8, got {}", error.utf8_error()))
}

/// The bytes of the file at `path`, at most `max_bytes`.
///
/// # Errors
/// A file that cannot be read or is larger.
pub fn bounded_bytes(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let is_small = |length: u64| {
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        ensure!(
            length <= max_bytes,
            "expected at most {} MB, got {}",
            megabytes(max_bytes),
            megabytes(length)
        );
        Ok(())
    };
    let file = open(path)?;
    is_small(file.metadata()?.len())?;
    let mut bytes = Vec::new();
    // A file that grows meanwhile.
    file.take(max_bytes + 1).read_to_end(&mut bytes)?;
    is_small(bytes.len() as u64)?;
    Ok(bytes)
}

/// Opens an input file. A pipe or a device would be waited for without end, and differs each time it
/// is read.
///
/// # Errors
/// A path at which no file is.
pub fn open(path: &Path) -> io::Result<File> {
    let about = std::fs::metadata(path)?;
    // A folder is refused in the words of the system.
    if !about.is_file() && !about.is_dir() {
        return Err(io::Error::other("expected a file, got a pipe or a device"));
    }
    File::open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_the_limit_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, b"1234").expect("written");
        assert_eq!(bounded_text(&path, 4).expect("small enough"), "1234");
        let refusal = bounded_bytes(&path, 3).expect_err("too large").to_string();
        assert!(refusal.starts_with("expected at most"), "{refusal}");
        // A hole of 3 GB is refused without a look at it.
        let file = File::options().write(true).open(&path).expect("a file");
        file.set_len(3_000_000_000).expect("a hole");
        let refusal = bounded_bytes(&path, MAX_TABLES).expect_err("too large").to_string();
        assert_eq!(refusal, "expected at most 2000 MB, got 3000");
        if cfg!(unix) {
            let refusal = bounded_text(Path::new("/dev/zero"), 4).expect_err("a device");
            assert!(refusal.to_string().contains("expected a file"), "{refusal}");
        }
        std::fs::write(&path, b"a\xff").expect("written");
        let refusal = bounded_text(&path, 4).expect_err("no text").to_string();
        assert!(refusal.contains("UTF-8"), "{refusal}");
    }
}
