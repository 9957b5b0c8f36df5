// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of other programs, in and out: what `batwing export` and `batwing import` do, and what a
//! design takes from such files.
//!
//! The layouts of scattering tables live in `bsdf::formats`, those of far fields and rays in
//! `tracer::formats`; here stand the geometry formats, `.npy` and `.npz`, and the opening,
//! recognising, converting and describing of them all. `docs/guide/other-programs.md` says what
//! each format keeps and loses.

pub mod bin_entries;
pub mod content;
pub mod csv;
pub mod dxf;
pub mod exr;
pub mod exr_layers;
pub mod mesh;
pub mod npy;
pub mod npz;
pub mod obj;
pub mod photometry;
pub mod ray_files;
pub mod scattering;
pub mod sniff;
pub mod stl;
pub mod svg;
pub mod tables;
