// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is refused, in which words, and what is left behind: nothing.

mod bad_input;
mod dark;
mod exchange_bad;
mod unfit;
