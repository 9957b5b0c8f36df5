// SPDX-License-Identifier: MIT OR Apache-2.0
//! Section of a dome against gratings, and models against each other.

mod grating;
mod models;
