// SPDX-License-Identifier: MIT OR Apache-2.0
//! Parts that every picture is drawn with: a canvas, letters, colours, scales, axes, and the frame of
//! heading and legend.
//!
//! Positions are in pixels of the finished picture, x to the right and y downwards.

pub mod canvas;
pub mod colour;
pub mod font;
pub mod line_colours;
mod mark;
pub mod palette;
pub mod panel;
mod raster;
pub mod scale;
pub mod sheet;
