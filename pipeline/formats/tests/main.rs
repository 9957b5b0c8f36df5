// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of other programs: what is written comes back, what is wrong is named.

mod common;
mod photometric_files;
mod ray_files;
