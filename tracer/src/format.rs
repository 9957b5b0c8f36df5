// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats of far fields and rays: one file a format, reading and writing and nothing else. Opening files is the caller's business.

pub mod eulumdat;
pub mod ies;
pub mod ltray;
pub mod rays;
pub mod tm25;

pub use bsdf::format::text::{FormatError, Place, utf8};

/// The text of a photometric file: UTF-8 where it is, else every byte one character (Latin-1), as the names in older files need it.
///
/// # Errors
/// If it is UTF-16 or holds zero bytes.
pub fn photometric_text(bytes: &[u8]) -> Result<String, FormatError> {
    match utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) if error.got.starts_with("byte") => {
            Ok(bytes.iter().map(|&b| char::from(b)).collect())
        }
        Err(error) => Err(error),
    }
}
