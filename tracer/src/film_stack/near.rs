// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places from which light is likely to leave a film stack below receivers into a narrow cone: there it is
//! worth more sights.

use glam::DVec2;

use super::{FilmTable, Viewer};
use crate::random::{self, PathStream};

/// Sights that a ray below receivers stands for, at most, and one elsewhere. Behind a full stack nine spots on
/// 3 % of a display have two thirds of the error of one sight everywhere, in less time.
const MOST_SIGHTS: f64 = 8.0;
const FEW_SIGHTS: f64 = 0.25;

/// Where light that meets the films is likely to leave them below receivers into a narrow cone.
pub(super) struct Near {
    /// Rectangles, ends along x and y, mm.
    ends_mm: Vec<[[f64; 2]; 2]>,
    /// Sights that a ray there stands for, and one elsewhere.
    rays: [f64; 2],
}

impl Near {
    /// Light leaves the films about as far from where it met them as they are high.
    pub fn new(table: &FilmTable) -> Self {
        let [_, high] = table.ends_mm();
        let tan = (table.seen_sin2 / (1.0 - table.seen_sin2)).sqrt();
        let around = |viewer: &Viewer| {
            let margin = table.height_mm() + (viewer.z_mm - high) * tan;
            viewer.ends_mm.map(|[low, high]| [low - margin, high + margin])
        };
        let ends_mm: Vec<[[f64; 2]; 2]> = table.viewers.iter().map(around).collect();
        let areas = ends_mm.iter().map(|ends| ends.map(|[low, high]| high - low));
        let near: f64 = areas.map(|[x, y]| x * y).sum();
        let films: f64 = table.half_mm.map(|half| 2.0 * half).iter().product();
        let most =
            if films.is_finite() { (films / near).clamp(1.0, MOST_SIGHTS).floor() } else { 1.0 };
        Self { ends_mm, rays: [most, if most > 1.0 { FEW_SIGHTS } else { 1.0 }] }
    }

    /// The number of sights for which a ray stands that meets the films here. A number below 1 is the chance
    /// with which the ray takes a sight at all: it is returned where it does, and 0 where it does not.
    pub fn rays(&self, at: DVec2, rng: &mut PathStream) -> f64 {
        let holds = |ends: &[[f64; 2]; 2]| {
            let [x, y] = ends;
            (x[0]..=x[1]).contains(&at.x) && (y[0]..=y[1]).contains(&at.y)
        };
        let [near, far] = self.rays;
        if self.ends_mm.iter().any(holds) {
            near
        } else if far >= 1.0 || random::unit(rng) < far {
            far
        } else {
            0.0
        }
    }
}
