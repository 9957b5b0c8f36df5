// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a reader of figures is: it names them, takes their sums from an observation, and reads
//! values from sums, all in one order.

use std::borrow::Cow;

use metrics::figures::{Definition, NamedFigure};
use metrics::kinds::ReceiverKind;
use metrics::quantity::Unit;
use metrics::{Estimate, Grouped, JackknifedFigure};
use rayon::prelude::*;
use results::figure_entry::FigureEntry;

use super::Observation;
use crate::units::Units;

/// A figure that a reader reads per watt emitted, and the factor to its unit.
#[derive(Clone)]
pub(super) struct Column {
    pub figure: NamedFigure,
    pub factor: f64,
}

impl Column {
    /// A figure in the units of the light.
    pub fn new(figure: impl Into<NamedFigure>, unit: Unit, units: &Units) -> Self {
        let mut figure = figure.into();
        let (unit, factor) = units.of_unit(unit);
        figure.definition.unit = unit;
        Self { figure, factor }
    }

    /// A figure as it is read.
    pub fn plain(figure: impl Into<NamedFigure>) -> Self {
        Self { figure: figure.into(), factor: 1.0 }
    }
}

/// Reader of the figures of one source.
pub(super) trait Reader: Sync {
    /// The figures, in the order of values and entries.
    fn columns(&self) -> Vec<Column>;

    /// The sums that they are read from; `None` where nothing was recorded.
    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>>;

    /// Values of one set of sums; NaN of a figure that it has not.
    fn values(&self, sums: &[f64]) -> Vec<f64>;

    /// Values with errors and states.
    fn entries(&self, sums: &Grouped) -> Vec<FigureEntry> {
        let all = self.replicates(sums).into_iter();
        all.map(|figure| FigureEntry::new(figure.estimate())).collect()
    }

    /// Values of the totals and without each group.
    fn replicates(&self, sums: &Grouped) -> Vec<JackknifedFigure> {
        left_out(sums, |sums| self.values(sums))
    }

    /// Change of each value that is a sum by one path of this power, 0 of others and of sums that
    /// no path can reach; ends where no further figure is a sum.
    fn one_path(&self, _power: f64) -> Vec<f64> {
        Vec::new()
    }
}

/// Figures that `values` makes of the totals and without each group.
pub(super) fn left_out(
    sums: &Grouped,
    values: impl Fn(&[f64]) -> Vec<f64> + Sync,
) -> Vec<JackknifedFigure> {
    let groups = (0..sums.count()).into_par_iter();
    let rows: Vec<Vec<f64>> = groups.map(|g| values(&sums.without(g))).collect();
    let totals = values(sums.total()).into_iter().enumerate();
    totals
        .map(|(i, value)| {
            let without = rows.iter().map(|row| row.get(i).copied().unwrap_or(value));
            JackknifedFigure::new(value, without.collect())
        })
        .collect()
}

/// A width of a beam, with the ends between which it lies where it is not resolved.
pub(super) fn of_width((width, ends): (Estimate, Option<[f64; 2]>)) -> FigureEntry {
    let entry = FigureEntry::new(width);
    FigureEntry { interval: ends.or(entry.interval), ..entry }
}

/// Radiometric unit of a figure of a receiver of this kind.
pub(super) fn unit_of_receiver(figure: Definition, kind: ReceiverKind) -> Unit {
    match (figure.unit, kind) {
        (Unit::WattPerSquareMillimetre, ReceiverKind::FarField | ReceiverKind::CGamma) => {
            Unit::WattPerSteradian
        }
        (Unit::WattPerSquareMillimetre, ReceiverKind::Luminance) => {
            Unit::WattPerSquareMetreSteradian
        }
        (unit, _) => unit,
    }
}
