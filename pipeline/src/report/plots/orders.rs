// SPDX-License-Identifier: MIT OR Apache-2.0
//! One structure by rays and by waves at one incidence (figure 6 of the paper): power over the outgoing angle, as stems.

use anyhow::{Result, ensure};

use super::super::data::{Heading, Quantity, Unit};
use super::draw::canvas::{Align, Canvas, Letters, Pen, Rect};
use super::draw::colour::{Colour, LineColours};
use super::draw::panel::{LABEL_SIZE, Panel, PanelAxis, TICK_SIZE};
use super::draw::scale::Scale;
use super::draw::sheet::{Entry, Sample, Sheet};

/// The side that light leaves to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeSide {
    /// Back to where it came from.
    Reflected,
    /// Through the structure.
    Transmitted,
}

/// Power that leaves in one direction of the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneLobe {
    /// Side.
    pub side: LobeSide,
    /// Angle to the normal of the surface in degrees, -90..90, positive along the grating vector.
    pub angle_deg: f64,
    /// Power per incident power, 0..1.
    pub power: f64,
}

/// Draws rays above and diffraction orders below, transmitted light left and reflected light right, all over the same angles;
/// each row shares its scale of power.
///
/// # Errors
/// No lobes, angles outside -90°..90°, or powers below 0.
pub fn grating_lobes(
    heading: &Heading,
    rays: &[PlaneLobe],
    orders: &[PlaneLobe],
) -> Result<Vec<u8>> {
    for (name, lobes) in [("rays", rays), ("orders", orders)] {
        ensure!(!lobes.is_empty(), "{name}: expected at least one lobe");
        for lobe in lobes {
            ensure!(
                (-90.0..=90.0).contains(&lobe.angle_deg),
                "{name}: expected angles within -90°..90°, got {}",
                lobe.angle_deg
            );
            ensure!(
                lobe.power >= 0.0 && lobe.power.is_finite(),
                "{name}: expected powers of at least 0, got {}",
                lobe.power
            );
        }
    }
    let (blue, red) = (
        LineColours::Distinct.pick(0, 2),
        LineColours::Distinct.pick(1, 2),
    );
    let legend = [
        Entry::new(Sample::Dot(blue, 6.0), "ray tracing, one stem a lobe"),
        Entry::new(Sample::Dot(red, 6.0), "RCWA, one stem a diffraction order"),
    ];
    let mut sheet = Sheet::new(1600, 900, heading, &legend)?;
    let body = sheet.body.inset(75.0, 30.0, 10.0, 65.0);
    let gaps = [95.0, 30.0];
    let width = (body.width() - gaps[0]) / 2.0;
    let height = (body.height() - gaps[1]) / 2.0;
    let rows = [(rays, blue, "rays"), (orders, red, "orders")];
    for (row, (lobes, colour, _)) in rows.into_iter().enumerate() {
        for (column, side) in [LobeSide::Transmitted, LobeSide::Reflected]
            .into_iter()
            .enumerate()
        {
            let left = body.left + column as f64 * (width + gaps[0]);
            let top = body.top + row as f64 * (height + gaps[1]);
            let area = Rect::new(left, top, left + width, top + height);
            if row == 0 {
                let name = match side {
                    LobeSide::Transmitted => "Transmitted",
                    LobeSide::Reflected => "Reflected",
                };
                let letters = Letters::new(LABEL_SIZE, Align::Centre).bold();
                sheet
                    .canvas
                    .text(name, [area.centre()[0], area.top - 18.0], &letters);
            }
            draw_stems(&mut sheet.canvas, area, lobes, side, colour, row == 1);
        }
    }
    sheet.canvas.into_png()
}

fn draw_stems(
    canvas: &mut Canvas,
    area: Rect,
    lobes: &[PlaneLobe],
    side: LobeSide,
    colour: Colour,
    numbered: bool,
) {
    let share = Quantity::new("share of incident power", Unit::Fraction);
    let angle = Quantity::new("angle to the surface normal", Unit::Degree);
    let shown: Vec<&PlaneLobe> = lobes.iter().filter(|lobe| lobe.side == side).collect();
    let top = shown.iter().fold(0.0f64, |top, lobe| top.max(lobe.power));
    let total: f64 = shown.iter().map(|lobe| lobe.power).sum();
    let top = if top > 0.0 { top } else { 1.0 };
    let x = PanelAxis::angle(&angle, -90.0, 90.0, 30.0);
    let panel = Panel {
        area,
        x: if numbered { x } else { x.bare() },
        y: PanelAxis::linear(&share, Scale::rounded(0.0, top * 1.12, 5), 5),
    };
    panel.grid(canvas);
    let stem = Pen::solid(colour, 2.2);
    for lobe in &shown {
        let foot = panel.at(lobe.angle_deg, 0.0);
        let head = panel.at(lobe.angle_deg, lobe.power);
        canvas.line(foot, head, &stem);
        canvas.disk(head, 4.6, colour);
    }
    panel.frame(canvas);
    let letters = Letters::new(TICK_SIZE, Align::Right);
    let text = format!("total {:.1} %", total * 100.0);
    canvas.text_with_rim(&text, [area.right - 12.0, area.top + 20.0], &letters);
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn lobe(angle_deg: f64, power: f64) -> PlaneLobe {
        PlaneLobe {
            side: LobeSide::Transmitted,
            angle_deg,
            power,
        }
    }

    #[test]
    fn bad_lobes_are_refused() {
        let heading = Heading::new("S8", "normal incidence");
        let good = [lobe(20.0, 0.5)];
        assert!(grating_lobes(&heading, &good, &good).is_ok());
        assert!(grating_lobes(&heading, &[], &good).is_err());
        assert!(grating_lobes(&heading, &good, &[lobe(91.0, 0.5)]).is_err());
        assert!(grating_lobes(&heading, &[lobe(0.0, f64::NAN)], &good).is_err());
    }

    #[test]
    fn rays_and_orders_at_one_angle_stand_above_each_other() {
        let png = grating_lobes(
            &Heading::new("", ""),
            &[lobe(30.0, 0.5)],
            &[lobe(30.0, 0.1)],
        );
        let picture = decode(&png.unwrap());
        let columns = |colour: Colour, top: u32| -> Vec<u32> {
            (0..picture.width())
                .filter(|&x| {
                    (top..picture.height()).any(|y| {
                        let p = picture.pixel(x, y).unwrap();
                        [p.red(), p.green(), p.blue()] == colour.rgb
                    })
                })
                .collect()
        };
        // Below the legend.
        let rays = columns(LineColours::Distinct.pick(0, 2), 140);
        let orders = columns(LineColours::Distinct.pick(1, 2), 140);
        assert!(!rays.is_empty() && rays == orders);
    }
}
