// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary from end to end: commands, files, interruptions.

mod bsdf_command;
mod ends;
mod exchange;
mod exchange_sources;
mod grating_command;
mod ledgers;
mod memory;
mod report;
mod reproduce;
mod resume;
mod ring_commands;
mod study;
mod until_error;
