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
        .with_context(|| format!("`{}` is no usable table", path.display()))
}

/// Writes `table` to the file at `path`, whole or not at all.
pub fn write_table(path: &Path, table: &OrderTable) -> Result<()> {
    atomic_file::write_atomic(path, |file| match native::write(table, file) {
        // As the error of the file system that it is.
        Err(bsdf::Error::Io(error)) => Err(error.into()),
        written => Ok(written?),
    })
}
