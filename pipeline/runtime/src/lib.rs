// SPDX-License-Identifier: MIT OR Apache-2.0
//! The run time of a command: console, interruption, seed, kept results, and files that appear whole.
//!
//! In: bytes, values and paths. Out: files under their names only when they are whole; kept results
//! under keys that hold all they depend on. It knows nothing of optics. Console and interrupt stand
//! with the files: both must know which are half-written when a command is told to end.
//!
//! ```
//! use runtime::atomic_file::write_bytes;
//! use runtime::content_hash::sha256_hex;
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
//! | [`atomic_file`] | files that appear whole or not at all |
//! | [`key`], [`store`] | kept figures and groups of paths, bit for bit, under the hash of all they depend on |
//! | [`bounded_text`], [`control_characters`] | text of others, read and on the terminal |
//! | [`content_hash`], [`provenance`] | hashes, records of files |
//! | [`interrupt`], [`progress`], [`run_context`] | Ctrl-C, console, and what a command hands to its steps |
//! | [`program`] | the file that holds the program, for keys of kept results |
//! | [`serde_messages`] | messages of readers: key, expected, got |
//! | [`serde_arrays`], [`field_names`] | lists of fixed length, names of keys |

pub mod atomic_file;
pub mod bounded_text;
pub mod content_hash;
pub mod control_characters;
pub mod field_names;
pub mod interrupt;
pub mod key;
pub mod program;
pub mod progress;
pub mod provenance;
pub mod run_context;
pub mod serde_arrays;
pub mod serde_messages;
pub mod store;
