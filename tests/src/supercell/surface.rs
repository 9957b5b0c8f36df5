// SPDX-License-Identifier: MIT OR Apache-2.0
//! Supercells: K successive rings, or one tooth on a plane, on the chord of the ring in the middle.

use anyhow::{Context, Result, ensure};
use num_complex::Complex64;
use rcwa::Stack;
use rcwa::relief::{Layer, Polygon, Relief, SlicePlan};

use geometry::profile::{Elements, SphericalDome};
use geometry::{Chord, Meridian, Role, vertices};

use crate::tables::{SILICONE, WAVELENGTH_UM};
use crate::traces::design;

/// Silicone below the lowest point of an outline and air above the highest, µm: outlines that
/// differ a little share their slices.
const MARGIN_UM: f64 = 0.05;

/// A ring of a design with those beside it.
#[derive(Debug, Clone)]
pub struct Ring {
    dome: SphericalDome,
    rings: Elements,
    number: usize,
}

/// What stands beside the ring in the middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbours {
    /// The same ring again.
    Same,
    /// The next rings with their own outlines and chords, the chords laid in one line: without the
    /// curvature of the dome.
    InLine,
    /// The next rings where they are, seen from the chord of the middle one.
    True,
    /// The plane of the chord.
    Plane,
}

/// One period of a supercell.
#[derive(Debug, Clone)]
pub struct Surface {
    /// The relief, µm.
    pub relief: Relief,
    /// Number of chords in it, odd.
    pub teeth: usize,
    /// Height of the middle of the middle chord, µm.
    pub level_um: f64,
    /// Difference of height of the two ends, which was spread evenly over the period, µm.
    pub mismatch_um: f64,
    /// Length before it was stretched to `teeth` chords, by that length, less 1.
    pub stretched: f64,
}

impl Ring {
    /// Ring `number` (from 1) of the 10 µm rings of a design.
    ///
    /// # Errors
    /// A design without a dome, or a ring that it does not have.
    pub fn of(file: &str, number: usize) -> Result<Self> {
        let design = design(file);
        let rings = design.hybrid_rings();
        ensure!((1..=rings.shapes.len()).contains(&number), "{file} has no ring {number}");
        let dome = *design.sphere().context("a design with a dome")?;
        Ok(Self { dome, rings, number })
    }

    fn chord(&self) -> Chord {
        Chord::of(&self.dome, self.rings.width_mm, self.number)
    }

    /// Length of its chord, µm.
    pub fn period_um(&self) -> f64 {
        1e3 * self.chord().length_mm()
    }

    /// Corners from base to base in the frame of its own chord, µm.
    fn outline(&self) -> Vec<[f64; 2]> {
        let chord = self.chord();
        let mut points = vec![[0.0, 0.0]];
        let corners = vertices(&self.rings.shapes[self.number - 1], &chord);
        points.extend(corners.iter().map(|v| [1e3 * v[0], 1e3 * v[1]]));
        points.push([self.period_um(), 0.0]);
        points
    }

    /// Corners of the dome's meridian from ring `number - by` to ring `number + by`, in the frame
    /// of the middle chord, µm.
    fn meridian(&self, by: usize) -> Result<Vec<[f64; 2]>> {
        let meridian = Meridian::stepped(&self.dome, &self.rings)?;
        let within = |role| matches!(role, Role::Element(k) if k.abs_diff(self.number) <= by);
        let pieces = || meridian.pieces.iter().filter(|p| within(p.role));
        let first = pieces().next().context("a ring")?.start;
        let chord = self.chord();
        let (sin, cos) = chord.slope().sin_cos();
        let seen = |p: [f64; 2]| {
            let (r, z) = (p[0] - chord.inner[0], p[1] - chord.inner[1]);
            [1e3 * (r * cos - z * sin), 1e3 * (r * sin + z * cos)]
        };
        Ok(std::iter::once(first).chain(pieces().map(|p| p.end)).map(seen).collect())
    }

    /// `teeth` chords of this ring's length with this ring in the middle.
    ///
    /// # Errors
    /// Rings that the design does not have, outlines that the solver refuses.
    pub fn supercell(&self, teeth: usize, neighbours: Neighbours) -> Result<Surface> {
        ensure!(!teeth.is_multiple_of(2), "an odd number of teeth, got {teeth}");
        let by = teeth / 2;
        ensure!(
            neighbours == Neighbours::Same
                || neighbours == Neighbours::Plane
                || (self.number > by && self.number + by <= self.rings.shapes.len()),
            "ring {} has no {by} neighbours on either side",
            self.number
        );
        let mut points: Vec<[f64; 2]> = Vec::new();
        match neighbours {
            Neighbours::True => points = self.meridian(by)?,
            Neighbours::Plane => {
                let before = by as f64 * self.period_um();
                points.push([0.0, 0.0]);
                points.extend(self.outline().iter().map(|p| [p[0] + before, p[1]]));
                points.push([teeth as f64 * self.period_um(), 0.0]);
            }
            Neighbours::Same | Neighbours::InLine => {
                for place in 0..teeth {
                    let number = match neighbours {
                        Neighbours::Same => self.number,
                        _ => self.number + place - by,
                    };
                    let ring = Self { number, ..self.clone() };
                    let end = points.pop().unwrap_or([0.0, 0.0]);
                    points.extend(ring.outline().iter().map(|p| [p[0] + end[0], p[1]]));
                }
            }
        }
        points.dedup();
        self.closed(points, teeth)
    }

    /// This ring alone as a periodic relief at the height at which it stands in `supercell`, of the
    /// same depth.
    ///
    /// # Errors
    /// Outlines that the solver refuses.
    pub fn grating(&self, supercell: &Surface) -> Result<Surface> {
        let points: Vec<[f64; 2]> =
            self.outline().iter().map(|p| [p[0], p[1] + supercell.level_um]).collect();
        Ok(Surface {
            relief: relief(points, self.period_um(), supercell.relief.depth())?,
            teeth: 1,
            level_um: supercell.level_um,
            mismatch_um: 0.0,
            stretched: 0.0,
        })
    }

    /// Ends brought to one height and the length to `teeth` chords.
    fn closed(&self, mut points: Vec<[f64; 2]>, teeth: usize) -> Result<Surface> {
        let ([x0, z0], [x1, z1]) = (points[0], points[points.len() - 1]);
        let period = teeth as f64 * self.period_um();
        let before = (teeth / 2) as f64 * self.period_um();
        let (mismatch, stretch) = (z1 - z0, period / (x1 - x0));
        for p in &mut points {
            let along = (p[0] - x0) / (x1 - x0);
            *p = [along * period, p[1] - mismatch * along];
        }
        // The corners of the middle chord were at height 0, and are the nearest to where they
        // should stand.
        let at = |x: f64| {
            let near = |a: &&[f64; 2], b: &&[f64; 2]| {
                (a[0] - x).abs().total_cmp(&(b[0] - x).abs()).is_le()
            };
            points.iter().reduce(|a, b| if near(&a, &b) { a } else { b })
        };
        let level = [before, before + self.period_um()]
            .into_iter()
            .filter_map(at)
            .map(|p| 0.5 * p[1])
            .sum::<f64>();
        let lowest = points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let highest = points.iter().map(|p| p[1]).fold(-f64::INFINITY, f64::max);
        for p in &mut points {
            p[1] += MARGIN_UM - lowest;
        }
        Ok(Surface {
            relief: relief(points, period, highest - lowest + 2.0 * MARGIN_UM)?,
            teeth,
            level_um: level + MARGIN_UM - lowest,
            mismatch_um: mismatch,
            stretched: 1.0 / stretch - 1.0,
        })
    }
}

/// Silicone up to `outline`, which goes from one end of the period to the other.
fn relief(mut outline: Vec<[f64; 2]>, period: f64, depth: f64) -> Result<Relief> {
    let silicone = Complex64::new(SILICONE, 0.0);
    outline.extend([[period, 0.0], [0.0, 0.0]]);
    let polygon = Polygon { index: silicone, points: outline };
    Ok(Relief::new(period, depth, Complex64::ONE, vec![polygon])?)
}

impl Surface {
    /// Between silicone and air, cut where `plan` cuts, whichever relief of the same depth that was
    /// made for.
    ///
    /// # Errors
    /// Those of the solver.
    pub fn stack(&self, plan: &SlicePlan) -> Result<Stack> {
        let layers = plan
            .slices()
            .map(|(z, thickness)| Layer { thickness, segments: self.relief.layer_at(z) })
            .collect();
        stack(self.relief.period(), layers)
    }

    /// A plane between silicone and air, with this period.
    ///
    /// # Errors
    /// Those of the solver.
    pub fn plane(&self) -> Result<Stack> {
        stack(self.relief.period(), Vec::new())
    }

    /// Slices of about `thickness_um`, none across a corner.
    pub fn plan(&self, thickness_um: f64) -> SlicePlan {
        let count = (self.relief.depth() / thickness_um).ceil() as usize;
        self.relief.slice_plan(count)
    }
}

fn stack(period: f64, layers: Vec<Layer>) -> Result<Stack> {
    let silicone = Complex64::new(SILICONE, 0.0);
    Ok(Stack::new(WAVELENGTH_UM, period, silicone, Complex64::ONE, layers)?)
}
