// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files.

pub mod atomic_file;
pub mod cache;
pub mod content_hash;
pub mod formats;
pub mod interrupt;
pub mod program;
pub mod progress;
pub mod provenance;
pub mod run_context;
pub mod serde_messages;
pub mod store;
