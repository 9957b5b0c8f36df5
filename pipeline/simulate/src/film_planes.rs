// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light between the films of a stack: planes below them, in their gaps and above, with the power that
//! passes each upwards and downwards, again each time that it comes back.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::receiver::{DetectorRectangle, Facing, Sense, underscored};
use tracer::{Detector, Measurement, Scene};

use design::Design;
use design::resolved::solids::{CheckedSolid, LEAST_MM};
use results::film_light::{WAYS, account};

/// Largest distance of a plane from the film that it is named for, mm: half the usual gap.
const OFF_MM: f64 = 0.005;

/// Planes of a design with their accounts, upwards: two of each plane, up and down.
pub struct FilmPlanes {
    /// Detectors of one bin.
    pub detectors: Vec<Detector>,
    /// Their heights, mm, and the ways in which light passes them.
    pub levels_mm: Vec<(f64, Sense)>,
    /// Accounts of the ledger, which are no ends of light.
    pub accounts: Vec<String>,
}

impl FilmPlanes {
    /// Those of `design` that cut nothing in `scene`.
    ///
    /// # Errors
    /// Those of a rectangle.
    pub fn new(design: &Design, scene: &Scene) -> Result<Self> {
        let mut all = Vec::new();
        for (name, z_mm, size_mm) in levels(design) {
            let detector = |sense: Sense| -> Result<Detector> {
                let centre = DVec3::new(0.0, 0.0, z_mm);
                let bin = DetectorRectangle::new(Facing::Z(sense), centre, size_mm, [1, 1])?;
                Ok(Detector::new(name.clone(), Measurement::Plane(bin)))
            };
            let pair = [detector(Sense::Plus)?, detector(Sense::Minus)?];
            if pair.iter().all(|detector| scene.admits(detector).is_ok()) {
                all.push((underscored(&name), z_mm, pair));
            }
        }
        // Numbers that sort as the planes lie.
        let digits = all.len().to_string().len();
        let accounts = all.iter().enumerate().flat_map(|(k, (name, ..))| {
            let number = format!("{:0digits$}", k + 1);
            WAYS.map(|way| account(&number, way, name))
        });
        let accounts = accounts.collect();
        let levels = all.iter().flat_map(|(_, z, _)| [Sense::Plus, Sense::Minus].map(|s| (*z, s)));
        Ok(Self {
            levels_mm: levels.collect(),
            detectors: all.into_iter().flat_map(|(.., pair)| pair).collect(),
            accounts,
        })
    }
}

/// Name, lower and upper end, and lengths of a film, mm.
fn film(solid: &CheckedSolid) -> Option<(&str, [f64; 2], [f64; 2])> {
    let (ends, lengths) = solid.film_mm()?;
    Some((solid.name(), ends, lengths))
}

/// The planes of the films of `design`, upwards, with height and lengths, mm: `below_NAME`, of the
/// last also `above_NAME`.
fn levels(design: &Design) -> Vec<(String, f64, [f64; 2])> {
    let films: Vec<_> = design.solids.iter().filter_map(film).collect();
    let mut levels = Vec::new();
    let mut below_mm = 0.0;
    for (name, [low, high], size_mm) in &films {
        let gap = low - below_mm;
        // None in optical contact.
        if gap > 0.5 * LEAST_MM {
            levels.push((format!("below_{name}"), low - OFF_MM.min(0.5 * gap), *size_mm));
        }
        below_mm = *high;
    }
    if let Some((name, [_, high], size_mm)) = films.last() {
        levels.push((format!("above_{name}"), high + OFF_MM, *size_mm));
    }
    levels
}
