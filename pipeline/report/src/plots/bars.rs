// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shares that add up, as bars of several colours, one bar a line: where the power goes.

use anyhow::{Result, ensure};

use metrics::Estimate;
use metrics::quantity::{Quantity, Unit};
use results::shown;

use super::Heading;
use super::draw::canvas::{Align, Letters, Picture, Rect};
use super::draw::colour::Colour;
use super::draw::panel::{Panel, PanelAxis, TICK_SIZE};
use super::draw::sheet::{Entry, Sample, Sheet};

/// Pixels of a line, of its bar, and of a picture without lines.
const LINE: f64 = 42.0;
const BAR: f64 = 26.0;
const REST: f64 = 260.0;

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct ShareBar {
    /// Name at the left.
    pub label: String,
    /// A share for each name of the legend.
    pub shares: Vec<Estimate>,
}

/// Draws a bar for each of `bars`, whose shares have the names and colours of `parts`.
///
/// # Errors
/// No bars, no parts, or a number of shares other than that of the names.
pub fn share_bars(
    heading: &Heading,
    quantity: &str,
    parts: &[(String, Colour)],
    bars: &[ShareBar],
) -> Result<Picture> {
    ensure!(
        !bars.is_empty() && !parts.is_empty() && bars.iter().all(|b| b.shares.len() == parts.len()),
        "expected bars with {} shares each",
        parts.len()
    );
    let legend: Vec<Entry> =
        parts.iter().map(|(name, colour)| Entry::new(Sample::Area(*colour), name)).collect();
    let height = REST + LINE * bars.len() as f64;
    let mut sheet = Sheet::new(1600, height as u32, heading, &legend);
    let names = Letters::new(TICK_SIZE, Align::Right);
    let widest = bars.iter().map(|b| names.width(&b.label));
    let left = widest.fold(0.0, f64::max) + 26.0;
    let body = sheet.body.inset(left, 10.0, 20.0, 65.0);
    let total = |bar: &ShareBar| bar.shares.iter().map(|s| s.value).sum::<f64>();
    let top = bars.iter().map(total).fold(1e-9, f64::max);
    let panel = Panel {
        area: body,
        x: PanelAxis::linear(&Quantity::new(quantity, Unit::Fraction), [0.0, 1.04 * top], 8),
        y: PanelAxis::blank(0.0, 1.0),
    };
    panel.grid(&mut sheet.canvas);
    for (line, bar) in bars.iter().enumerate() {
        let y = body.top + body.height() * (line as f64 + 0.5) / bars.len() as f64;
        sheet.canvas.text(&bar.label, [body.left - 14.0, y], &names);
        let mut from = 0.0;
        for (part, share) in bar.shares.iter().enumerate().filter(|(_, s)| s.value > 0.0) {
            let [x0, x1] = [from, from + share.value].map(|v| panel.at(v, 0.0)[0]);
            let number = shown::estimate(*share, Unit::Fraction);
            let words = format!("{}, {}: {number}", bar.label, parts[part].0);
            sheet.canvas.with_tooltip(&words, |canvas| {
                let area = Rect::new(x0, y - BAR / 2.0, x1, y + BAR / 2.0);
                canvas.rectangle(area, parts[part].1);
            });
            from += share.value;
        }
    }
    panel.frame(&mut sheet.canvas);
    Ok(sheet.canvas.finish())
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_shares() {
        let colours = [Colour::new(10, 20, 30), Colour::new(200, 20, 30)];
        let parts = [("floor".to_owned(), colours[0]), ("mirror".to_owned(), colours[1])];
        let bar = |shares: [f64; 2]| ShareBar {
            label: "D1".to_owned(),
            shares: shares.map(|v| Estimate::new(v, 0.0)).to_vec(),
        };
        let heading = Heading::new("Losses", "D1");
        let picture = share_bars(&heading, "share", &parts, &[bar([0.1, 0.3])]).unwrap();
        let picture = decode(&picture);
        let count = |part: usize| {
            let rgb = colours[part].rgb;
            let below = picture.pixels().iter().skip(1600 * 140);
            below.filter(|p| [p.red(), p.green(), p.blue()] == rgb).count() as f64
        };
        assert!((count(1) / count(0) - 3.0).abs() < 0.05);
        assert!(share_bars(&heading, "share", &parts[..1], &[bar([0.1, 0.3])]).is_err());
        assert!(share_bars(&heading, "share", &parts, &[]).is_err());
    }
}
