// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders in files.

use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, Result};
use bsdf::OrderTable;
use bsdf::native;
use runtime::atomic_file;
use runtime::bounded_text::open;

/// File ending of tables.
pub const EXTENSION: &str = "bworders";

/// Reads the table in the file at `path`; a truncated or altered one is an error.
pub fn read_table(path: &Path) -> Result<OrderTable> {
    let file = open(path).with_context(|| {
        format!("`{}`: expected a table of diffraction orders, cannot open it", path.display())
    })?;
    native::read(BufReader::new(file))
        .map_err(of_file)
        .with_context(|| format!("`{}` is no usable table", path.display()))
}

/// Writes `table` to the file at `path`, whole or not at all.
pub fn write_table(path: &Path, table: &OrderTable) -> Result<()> {
    atomic_file::write_atomic(path, |file| native::write(table, file).map_err(of_file))
}

/// The error of the file system where it is one: the error of a table holds it without having it as
/// its source.
fn of_file(error: bsdf::Error) -> anyhow::Error {
    match error {
        bsdf::Error::Io(error) => error.into(),
        other => other.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_files_are_told_from_those_of_tables() {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        let error = of_file(bsdf::Error::Io(full)).context("cannot keep the table");
        assert!(atomic_file::is_of_files(&error), "{error:#}");
        let error = of_file(bsdf::Error::Measured("too much".to_owned()));
        assert!(!atomic_file::is_of_files(&error), "{error:#}");
    }
}
