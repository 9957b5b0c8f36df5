// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keys of kept results: the hash of all that they depend on.

use crate::content_hash::sha256_hex;

/// Version of the way from relief to table. To be raised whenever the same key would give other
/// numbers.
pub const SOLVER_VERSION: u32 = 9;

/// Hash of everything that a kept result depends on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key(String);

impl Key {
    /// The key of what `fields` lists by name, beside the version of the solver.
    pub fn of(fields: &serde_json::Value) -> Self {
        // Fields are hashed under an older name of theirs, so that tables keep their keys.
        let all = serde_json::json!({"solver_version": SOLVER_VERSION, "ingredients": fields});
        Self(sha256_hex(all.to_string().as_bytes()))
    }

    /// Hexadecimal.
    pub fn hex(&self) -> &str {
        &self.0
    }
}
