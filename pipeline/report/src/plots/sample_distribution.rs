// SPDX-License-Identifier: MIT OR Apache-2.0
//! The distribution of a figure over the packages of a tolerance analysis: the share of packages at
//! or below each value, with its 95 % interval, beside the design without deviations and the limits.

use anyhow::{Result, ensure};

use metrics::quantity::{Quantity, Unit};
use results::tolerance::CumulativeShareEntry;

use super::Heading;
use super::draw::canvas::{Pen, Picture};
use super::draw::colour::Colour;
use super::draw::palette;
use super::draw::panel::{Panel, PanelAxis};
use super::draw::scale::ends_with_room;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH};

/// Room beside the values, as a share of what they span.
const ROOM: f64 = 0.05;

/// A vertical line with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkedValue {
    /// Name in the legend.
    pub label: String,
    /// Place of the line.
    pub value: f64,
}

/// Draws the distribution of the figure of this name and unit; `shares` ascend, `limits` are bounds.
///
/// # Errors
/// Fewer than two packages.
pub fn sample_distribution(
    heading: &Heading,
    (name, unit): (&str, Unit),
    shares: &[CumulativeShareEntry],
    nominal: &MarkedValue,
    limits: &[MarkedValue],
) -> Result<Picture> {
    ensure!(shares.len() > 1, "a distribution needs two packages or more, got {}", shares.len());
    let colour = palette::neutral(0);
    let curve = Pen::solid(colour, 2.6);
    let dashed = Pen::dashed(Colour::TEXT, 1.6, &[7.0, 5.0]);
    let solid = Pen::solid(Colour::TEXT, 1.6);
    let mut legend = vec![
        Entry::new(Sample::Line(curve), "packages at or below"),
        Entry::new(Sample::Band(colour), "95 % interval"),
        Entry::new(Sample::Line(dashed), &nominal.label),
    ];
    let bounds = limits.iter();
    legend.extend(bounds.map(|limit| Entry::new(Sample::Line(solid), &limit.label)));
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &legend);

    let marked = limits.iter().chain([nominal]).map(|mark| mark.value);
    let values = shares.iter().map(|one| one.value).chain(marked);
    let packages = Quantity::new("share of packages", Unit::Fraction);
    let panel = Panel {
        area: sheet.body.inset(80.0, 12.0, 10.0, 65.0),
        x: PanelAxis::linear(&Quantity::new(name, unit), ends_with_room(values, ROOM), 8),
        y: PanelAxis::linear(&packages, [0.0, 1.0], 6),
    };
    let canvas = &mut sheet.canvas;
    panel.grid(canvas);
    let line = |of: &dyn Fn(&CumulativeShareEntry) -> f64| -> Vec<[f64; 2]> {
        let points = shares.iter().map(|one| panel.at(one.value, of(one)));
        points.collect()
    };
    let mut band = line(&|one| one.interval_95[1]);
    band.extend(line(&|one| one.interval_95[0]).into_iter().rev());
    canvas.polygon(&band, colour.with_opacity(0.25));
    canvas.polyline(&line(&|one| one.share), &curve);
    for (mark, pen) in limits.iter().map(|limit| (limit, &solid)).chain([(nominal, &dashed)]) {
        canvas.with_tooltip(&mark.label, |canvas| {
            canvas.line(panel.at(mark.value, 0.0), panel.at(mark.value, 1.0), pen);
        });
    }
    panel.frame(canvas);
    Ok(sheet.canvas.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_differ_with_their_shares_and_limits() {
        let heading = Heading::new("distribution", "test");
        let shares = |shift: f64| -> Vec<CumulativeShareEntry> {
            let one = |k: i32| CumulativeShareEntry {
                value: 0.5 + 0.01 * f64::from(k) + shift,
                share: f64::from(k) / 10.0,
                interval_95: [f64::from(k) / 12.0, f64::from(k + 1) / 11.0],
            };
            (1..=10).map(one).collect()
        };
        let mark = |label: &str, value| MarkedValue { label: label.to_owned(), value };
        let draw = |shares: &[CumulativeShareEntry], limits: &[MarkedValue]| {
            let nominal = mark("without deviations", 0.62);
            sample_distribution(&heading, ("uniformity", Unit::Fraction), shares, &nominal, limits)
        };
        let plain = draw(&shares(0.0), &[]).expect("drawn");
        assert_eq!(plain, draw(&shares(0.0), &[]).expect("drawn"));
        assert_ne!(plain, draw(&shares(0.03), &[]).expect("drawn"));
        let limit = [mark("at least 0.52", 0.52)];
        assert_ne!(plain, draw(&shares(0.0), &limit).expect("drawn"));
        assert!(draw(&shares(0.0)[..1], &[]).is_err());
    }
}
