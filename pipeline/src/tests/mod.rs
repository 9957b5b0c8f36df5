// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of the reference, which tests compare with the types that they come from, and write.

mod command_tables;
mod key_tables;
