// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files: formats of other programs, files that appear whole, kept tables and figures, and what
//! ends a command half-way.
//!
//! In: bytes and paths. Out: tables, rays, far fields and geometry of other programs; files under
//! their names only when they are whole; kept results under keys that hold all they depend on.
//! Console and interrupt stand here too: both must know which files are half-written when a command
//! is told to end.
//!
//! ```
//! use files::atomic_file::write_bytes;
//! use files::content_hash::sha256_hex;
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("note.txt");
//! write_bytes(&path, b"light")?;
//! assert_eq!(std::fs::read(&path)?, b"light");
//! assert_eq!(sha256_hex(b"light").len(), 64);
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`formats`] | registry of formats, one file each |
//! | [`atomic_file`] | files that appear whole or not at all |
//! | [`cache`] | tables of orders under the hash of all they depend on |
//! | [`store`] | kept figures and groups of paths, bit for bit |
//! | [`bounded_text`], [`control_characters`] | text of others, read and on the terminal |
//! | [`level_image`] | levels from 0 to 1 as text or PNG |
//! | [`content_hash`], [`provenance`] | hashes, records of files |
//! | [`interrupt`], [`progress`], [`run_context`] | Ctrl-C, console, and what a command hands to its steps |
//! | [`program`] | the file that holds the program, for keys of kept results |
//! | [`serde_messages`] | messages of readers: key, expected, got |

pub mod atomic_file;
pub mod bounded_text;
pub mod cache;
pub mod content_hash;
pub mod control_characters;
pub mod formats;
pub mod interrupt;
pub mod level_image;
pub mod program;
pub mod progress;
pub mod provenance;
pub mod run_context;
pub mod serde_messages;
pub mod store;
