// SPDX-License-Identifier: MIT OR Apache-2.0
//! Laws that hold exactly at any truncation, on thousands of random structures: polygons, sawteeth
//! and stacks of lamellae, dielectric, plasma and absorbing, at random wavevectors, in both
//! polarisations and from both sides. Single chosen cases of the same laws: `laws.rs`.

mod energy;
mod hemispheres;
mod invariance;
mod planar;
mod random;
mod reference;
mod self_mirror;
mod symmetry;
