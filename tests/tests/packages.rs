// SPDX-License-Identifier: MIT OR Apache-2.0
//! What packages are made of: domes, solids, walls, films, sources, receivers.

mod coatings;
mod films;
mod housing;
mod meridian;
mod mesh_design;
mod receivers;
mod slab;
mod solids;
mod solids_command;
mod sources;
