// SPDX-License-Identifier: MIT OR Apache-2.0
//! Designs traced, against closed forms, second routes and scatter over seeds.

mod film_faces;
mod film_surface;
mod film_table;
mod led_faces;
mod periodic_cell;
mod prints;
mod stated_errors;
