// SPDX-License-Identifier: MIT OR Apache-2.0
//! The libraries together, against closed forms, laws and second methods.

mod boundary_integral;
mod contrast;
mod coplanar_sheets;
mod diffusers;
mod held_tables;
mod lenses;
mod moved_boxes;
mod noisy_maps;
mod optical_contact;
mod order_tables;
#[path = "../../tracer/tests/common/package.rs"]
mod package;
mod polarisers;
mod prism_films;
mod public_cases;
mod ray_optics_control;
mod rcwa_and_boundary_integral;
mod reciprocity;
mod relief_on_meridians;
mod relief_to_trace;
mod rounded_relief;
mod searched_gratings;
mod solids;
mod source_file_spectrum;
mod sources;
mod supercells;
mod surrounding_solids;
mod thin_films;
mod viewing_angles;
