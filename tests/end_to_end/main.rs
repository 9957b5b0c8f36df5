// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary `batwing` from end to end: commands, files, refusals, interruptions.
//!
//! The files are modules of one program, since each program links all libraries. Package `batwing`
//! declares it, so that cargo builds the binary first and says where it lies:
//! `cargo test --release -p batwing --test end_to_end study::`.
#![cfg(unix)]

mod support;

mod absolute_light;
mod added_results;
mod backlight_guide;
mod bad_files;
mod bad_input;
mod bad_problems;
mod bodies;
mod bsdf_command;
mod coatings;
mod colours;
mod command_line;
mod command_tables;
mod converge_and_near_field;
mod conversion;
mod converted_zones;
mod exit_codes;
mod explore;
mod export_import;
mod failed_runs;
mod figures_by_route;
mod files_as_they_come;
mod files_of_0_1;
mod full_wave;
mod gallery;
mod grating_command;
mod housing;
mod inconsistent_designs;
mod jones_matrices;
mod key_tables;
mod ledger_by_source;
mod memory;
mod meridian_domes;
mod mesh_domes;
mod new_designs;
mod noisy_maps;
mod odd_files;
mod optimise;
mod ray_file_wavelengths;
mod receivers;
mod rectangular_arrays;
mod report;
mod reproduce;
mod resume;
mod rgb_backlight;
mod scattering;
mod schema;
mod shards;
mod solids;
mod source_spectra;
mod sources_from_files;
mod spectrum;
mod states;
mod stopping_rule;
mod stored_far_field;
mod study;
mod tolerance;
mod tutorial;
mod unlit_receivers;
mod verdicts;
mod walls_through_bins;
mod zone_colours;
mod zone_counts;
mod zones;
