// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a scattering surface sends light: over the angle of incidence, and over the hemisphere for one incidence.

use anyhow::{Result, ensure};

use super::super::data::{Heading, Map, Quantity, Unit};
use super::draw::canvas::{Align, Canvas, Letters, Pen, Point, Rect};
use super::draw::colour::{self, Colour};
use super::draw::panel::{LABEL_SIZE, Panel, PanelAxis, TICK_SIZE, colour_bar};
use super::draw::scale::Scale;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH};
use super::map::paint_bins;
use super::orders::LobeSide;

/// Power that leaves in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectedLobe {
    /// Side.
    pub side: LobeSide,
    /// Direction cosines along t and b of the local frame; within the unit circle.
    pub cosines: [f64; 2],
    /// Power per incident power, 0..1.
    pub power: f64,
}

/// Draws shares of power over two angles, for example outgoing (rows) over incident (columns), with a logarithmic scale of
/// colours over `decades` below the largest share.
///
/// # Errors
/// A map without a positive value, or decades that are not positive.
pub fn scattering_map(heading: &Heading, map: &Map, decades: f64) -> Result<Vec<u8>> {
    let top = map.maximum();
    ensure!(top > 0.0, "expected a positive value in the map");
    ensure!(
        decades > 0.0 && decades <= 30.0,
        "expected 0 to 30 decades of colours, got {decades}"
    );
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &[])?;
    let [columns, rows] = [map.columns().range(), map.rows().range()];
    let panel = Panel {
        area: sheet.body.inset(75.0, 10.0, 170.0, 65.0),
        x: PanelAxis::position(map.columns().quantity(), columns[0], columns[1], 10),
        y: PanelAxis::position(map.rows().quantity(), rows[0], rows[1], 8),
    };
    let levels = PanelAxis::log(map.quantity(), top * 10f64.powf(-decades), top, 6);
    paint_bins(&mut sheet.canvas, &panel, map, &levels.scale);
    panel.frame(&mut sheet.canvas);
    let area = panel.area;
    let bar = Rect::new(area.right + 34.0, area.top, area.right + 62.0, area.bottom);
    colour_bar(&mut sheet.canvas, bar, &levels, colour::Scale::Glow);
    sheet.canvas.into_png()
}

/// Draws the lobes of one incidence as dots over the hemispheres of transmitted and reflected directions, seen along the surface
/// normal; colour and size tell the power over four decades. `incident` is the direction that light came from.
///
/// # Errors
/// No lobes, direction cosines outside the unit circle, negative powers, or no power at all.
pub fn scattering_disks(
    heading: &Heading,
    incident: [f64; 2],
    lobes: &[DirectedLobe],
) -> Result<Vec<u8>> {
    for lobe in lobes {
        let [u, v] = lobe.cosines;
        ensure!(
            u * u + v * v <= 1.0 + 1e-9,
            "expected direction cosines within the unit circle, got ({u}, {v})"
        );
        ensure!(
            lobe.power >= 0.0 && lobe.power.is_finite(),
            "expected powers of at least 0, got {}",
            lobe.power
        );
    }
    let top = lobes.iter().fold(0.0f64, |top, lobe| top.max(lobe.power));
    ensure!(top > 0.0, "expected at least one lobe with power");
    let power = Quantity::new("share of incident power", Unit::Fraction);
    let levels = PanelAxis::log(&power, top * 1e-4, top, 6);
    let legend = [Entry::new(
        Sample::Diamond(Colour::TEXT),
        "direction light came from",
    )];
    let mut sheet = Sheet::new(1600, HEIGHT, heading, &legend)?;
    let body = sheet.body.inset(10.0, 40.0, 160.0, 65.0);
    let radius = (body.height() / 2.0 - 30.0).min(body.width() / 4.0 - 45.0);
    for (column, side) in [LobeSide::Transmitted, LobeSide::Reflected]
        .into_iter()
        .enumerate()
    {
        let centre = [
            body.left + body.width() * (0.25 + 0.5 * column as f64),
            body.centre()[1],
        ];
        let disk = Disk { centre, radius };
        disk.ground(&mut sheet.canvas);
        let chosen: Vec<&DirectedLobe> = lobes.iter().filter(|lobe| lobe.side == side).collect();
        disk.dots(&mut sheet.canvas, &chosen, &levels.scale);
        disk.ring_labels(&mut sheet.canvas, &chosen);
        if side == LobeSide::Reflected {
            super::draw::sheet::diamond(&mut sheet.canvas, disk.at(incident), 8.5, Colour::TEXT);
        }
        let total: f64 = chosen.iter().map(|lobe| lobe.power).sum();
        let name = match side {
            LobeSide::Transmitted => "Transmitted",
            LobeSide::Reflected => "Reflected",
        };
        let letters = Letters::new(LABEL_SIZE, Align::Centre).bold();
        let text = format!("{name}, total {:.1} %", total * 100.0);
        sheet
            .canvas
            .text(&text, [centre[0], centre[1] - radius - 46.0], &letters);
        let letters = Letters::new(LABEL_SIZE, Align::Centre);
        let place = [centre[0], centre[1] + radius + 56.0];
        let label = "Direction cosine along t (upwards: along b)";
        sheet.canvas.text(label, place, &letters);
    }
    let bar = Rect::new(body.right + 20.0, body.top, body.right + 48.0, body.bottom);
    colour_bar(&mut sheet.canvas, bar, &levels, colour::Scale::Cool);
    sheet.canvas.into_png()
}

/// Rings of equal angle to the normal, in degrees.
const RINGS_DEG: [f64; 4] = [15.0, 30.0, 45.0, 60.0];

/// A disk of direction cosines.
struct Disk {
    centre: Point,
    radius: f64,
}

impl Disk {
    fn at(&self, [u, v]: [f64; 2]) -> Point {
        [
            self.centre[0] + self.radius * u,
            self.centre[1] - self.radius * v,
        ]
    }

    fn ground(&self, canvas: &mut Canvas) {
        let grid = Pen::solid(Colour::GRID, 1.0);
        for step in 0..12 {
            let (sin, cos) = (f64::from(step) * std::f64::consts::PI / 6.0).sin_cos();
            canvas.line(self.centre, self.at([cos, sin]), &grid);
        }
        for deg in RINGS_DEG {
            canvas.circle(self.centre, self.radius * deg.to_radians().sin(), &grid);
        }
        let border = Pen::solid(Colour::MUTED, 1.4);
        canvas.circle(self.centre, self.radius, &border);
        let numbers = Letters::new(TICK_SIZE, Align::Centre);
        let bottom = self.centre[1] + self.radius;
        for (u, label) in [(-1.0, "−1"), (0.0, "0"), (1.0, "1")] {
            let x = self.at([u, 0.0])[0];
            canvas.text(label, [x, bottom + 24.0], &numbers);
        }
    }

    /// Angles of the rings, between grid lines in the half that holds fewer lobes.
    fn ring_labels(&self, canvas: &mut Canvas, lobes: &[&DirectedLobe]) {
        let letters = Letters::new(TICK_SIZE - 2.0, Align::Centre).coloured(Colour::MUTED);
        let above = lobes.iter().filter(|lobe| lobe.cosines[1] > 0.0).count();
        let side = if 2 * above > lobes.len() { -1.0 } else { 1.0 };
        let (v, u) = (side * 75f64).to_radians().sin_cos();
        for deg in RINGS_DEG {
            let sine = deg.to_radians().sin();
            let place = self.at([sine * u, sine * v]);
            canvas.text_with_rim(&format!("{deg}°"), place, &letters);
        }
    }

    fn dots(&self, canvas: &mut Canvas, lobes: &[&DirectedLobe], levels: &Scale) {
        let mut sorted: Vec<&&DirectedLobe> =
            lobes.iter().filter(|lobe| lobe.power > 0.0).collect();
        // Strong lobes lie over weak ones.
        sorted.sort_by(|a, b| a.power.total_cmp(&b.power));
        for lobe in sorted {
            let share = levels.share(lobe.power);
            if share < 0.0 {
                continue;
            }
            let radius = 2.5 + 7.0 * share;
            let at = self.at(lobe.cosines);
            canvas.disk(at, radius, colour::Scale::Cool.at(share));
            canvas.circle(at, radius, &Pen::solid(Colour::TEXT.with_opacity(0.6), 0.8));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::data::Axis;
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn lobe(u: f64, v: f64, power: f64) -> DirectedLobe {
        DirectedLobe {
            side: LobeSide::Transmitted,
            cosines: [u, v],
            power,
        }
    }

    #[test]
    fn lobes_outside_the_hemisphere_are_refused() {
        let heading = Heading::new("Lobes", "ring 75");
        let draw = |lobes: &[DirectedLobe]| scattering_disks(&heading, [0.0, 0.0], lobes);
        assert!(draw(&[lobe(0.6, 0.6, 0.5)]).is_ok());
        assert!(draw(&[lobe(0.8, 0.8, 0.5)]).is_err());
        assert!(draw(&[lobe(0.0, 0.0, -0.1)]).is_err());
        assert!(draw(&[]).is_err());
    }

    #[test]
    fn the_strongest_lobe_has_the_last_colour() {
        let heading = Heading::new("Lobes", "ring 75");
        let png = scattering_disks(
            &heading,
            [0.0, 0.0],
            &[lobe(0.5, 0.0, 0.5), lobe(-0.5, 0.0, 5e-5)],
        );
        let picture = decode(&png.unwrap());
        let count = |colour: Colour| {
            let left_half = |index: usize| (index as u32 % picture.width()) < 1200;
            let pixels = picture.pixels().iter().enumerate();
            pixels
                .filter(|(i, p)| left_half(*i) && [p.red(), p.green(), p.blue()] == colour.rgb)
                .count()
        };
        assert!(count(colour::Scale::Cool.at(1.0)) > 150);
        let weak = count(colour::Scale::Cool.at(0.0));
        assert!(weak > 2 && weak < 60, "{weak}");
    }

    #[test]
    fn a_map_of_angles_needs_light_and_decades() {
        let axis = |name| Axis::uniform(Quantity::new(name, Unit::Degree), -90.0, 90.0, 6).unwrap();
        let map = |value: f64| {
            let quantity = Quantity::new("share", Unit::Fraction);
            Map::new(
                quantity,
                axis("out"),
                axis("in"),
                vec![value; 36],
                vec![0.0; 36],
            )
            .unwrap()
        };
        let heading = Heading::new("BSDF", "band 8");
        assert!(scattering_map(&heading, &map(0.1), 4.0).is_ok());
        assert!(scattering_map(&heading, &map(0.0), 4.0).is_err());
        assert!(scattering_map(&heading, &map(0.1), 0.0).is_err());
    }
}
