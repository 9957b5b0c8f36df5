// SPDX-License-Identifier: MIT OR Apache-2.0
//! One structure by rays and by waves at one incidence (figure 6 of the paper): power over the
//! outgoing angle, as stems.

use anyhow::{Result, ensure};

use metrics::quantity::{Quantity, Unit};
use results::schema::LobeEntry;

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Rect};
use super::draw::colour::Colour;
use super::draw::palette;
use super::draw::panel::{LABEL_SIZE, Panel, PanelAxis};
use super::draw::sheet::{Entry, Sample, Sheet};

/// Per cent of one.
const PERCENT: f64 = 100.0;
/// Sides of the surface, a column each.
const SIDES: [&str; 2] = ["transmitted", "reflected"];

/// Draws rays above and diffraction orders below, transmitted light left and reflected light right,
/// all over the same angles; each panel has its own scale of power, since an order carries a small
/// part of a lobe.
///
/// # Errors
/// No lobes, angles outside -90°..90°, or powers below 0.
pub fn grating_lobes(
    heading: &Heading,
    rays: &[LobeEntry],
    orders: &[LobeEntry],
) -> Result<Picture> {
    for (name, lobes) in [("rays", rays), ("orders", orders)] {
        ensure!(!lobes.is_empty(), "{name}: expected at least one lobe");
        for lobe in lobes {
            ensure!(
                (-90.0..=90.0).contains(&lobe.theta_deg),
                "{name}: expected angles within -90°..90°, got {}",
                lobe.theta_deg
            );
            ensure!(
                SIDES.contains(&&*lobe.side),
                "{name}: expected transmitted or reflected lobes, got {:?}",
                lobe.side
            );
            ensure!(
                lobe.share >= 0.0 && lobe.share.is_finite(),
                "{name}: expected powers of at least 0, got {}",
                lobe.share
            );
        }
    }
    let [blue, red] = palette::RAYS_WAVES;
    let legend = [
        Entry::new(Sample::Dot(blue, 6.0), "ray tracing, one stem a lobe"),
        Entry::new(Sample::Dot(red, 6.0), "RCWA, one stem a diffraction order"),
    ];
    let mut sheet = Sheet::new(1600, 900, heading, &legend);
    let body = sheet.body.inset(75.0, 42.0, 10.0, 65.0);
    let gaps = [110.0, 84.0];
    let width = (body.width() - gaps[0]) / 2.0;
    let height = (body.height() - gaps[1]) / 2.0;
    let models = [("Rays", rays, blue), ("RCWA", orders, red)];
    for (column, side) in SIDES.into_iter().enumerate() {
        let left = body.left + column as f64 * (width + gaps[0]);
        let panels = [0, 1].map(|row| {
            let top = body.top + row as f64 * (height + gaps[1]);
            let area = Rect::new(left, top, left + width, top + height);
            stem_panel(area, models[row].1, side, row == 1)
        });
        let room = panels[0].number_room().max(panels[1].number_room());
        for (panel, (model, lobes, colour)) in panels.iter().zip(models) {
            draw_stems(&mut sheet.canvas, panel, lobes, side, colour);
            panel.frame_with_room(&mut sheet.canvas, room);
            let total: f64 = on_side(lobes, side).map(|lobe| lobe.share).sum();
            let title = format!("{model}, {side}: {:.1} %", total * PERCENT);
            let place = [panel.area.centre()[0], panel.area.top - 20.0];
            let letters = Letters::new(LABEL_SIZE, Align::Centre).bold();
            sheet.canvas.text(&title, place, &letters);
        }
    }
    Ok(sheet.canvas.finish())
}

fn on_side<'a>(lobes: &'a [LobeEntry], side: &'static str) -> impl Iterator<Item = &'a LobeEntry> {
    lobes.iter().filter(move |lobe| lobe.side == side)
}

fn stem_panel(area: Rect, lobes: &[LobeEntry], side: &'static str, named: bool) -> Panel {
    let share = Quantity::new("share of incident power", Unit::Fraction);
    let angle = Quantity::new("angle to the surface normal", Unit::Degree);
    let top = on_side(lobes, side).fold(0.0f64, |top, lobe| top.max(lobe.share));
    let power = [0.0, if top > 0.0 { top * 1.1 } else { 1.0 }];
    let mut x = PanelAxis::position(&angle, -90.0, 90.0, 12);
    if !named {
        x.label.clear();
    }
    Panel { area, x, y: PanelAxis::linear(&share, power, 5) }
}

fn draw_stems(
    canvas: &mut Canvas,
    panel: &Panel,
    lobes: &[LobeEntry],
    side: &'static str,
    colour: Colour,
) {
    panel.grid(canvas);
    let stem = Pen::solid(colour, 2.2);
    for lobe in on_side(lobes, side) {
        let foot = panel.at(lobe.theta_deg, 0.0);
        let head = panel.at(lobe.theta_deg, lobe.share);
        let share = PERCENT * lobe.share;
        let words = format!("{:.1}°: {share:.3} %", lobe.theta_deg);
        canvas.with_tooltip(&words, |canvas| {
            canvas.line(foot, head, &stem);
            canvas.disk(head, 4.2, colour);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn lobe(theta_deg: f64, share: f64) -> LobeEntry {
        LobeEntry { side: "transmitted".to_owned(), theta_deg, share, order: None }
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
        let png = grating_lobes(&Heading::new("", ""), &[lobe(30.0, 0.5)], &[lobe(30.0, 0.1)]);
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
        let rays = columns(palette::RAYS_WAVES[0], 140);
        let orders = columns(palette::RAYS_WAVES[1], 140);
        assert!(!rays.is_empty() && rays == orders);
    }
}
