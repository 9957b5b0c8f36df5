// SPDX-License-Identifier: MIT OR Apache-2.0
//! Full wave against series, laws and polygons.

mod corners;
mod cylinder;
mod many_corners;
mod series;
