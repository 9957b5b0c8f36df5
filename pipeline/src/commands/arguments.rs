// SPDX-License-Identifier: MIT OR Apache-2.0
//! Arguments that several commands have, and the parsers of their values.

use std::any::TypeId;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;
use std::str::FromStr;

use clap::{Command, ValueEnum};

use arrays::cache::Cache;
use design::resolved::PATHS;
use simulate::model::Model;

/// Ways to compute a design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelChoice {
    /// Rays on the relief as designed.
    Geometric,
    /// Rays on the relief in the hybrid's finer steps.
    Fine,
    /// Rays, with the relief as a BSDF by geometric optics.
    Control,
    /// Rays, with the relief as a BSDF by RCWA.
    Hybrid,
    /// Everything that the design allows.
    All,
}

impl ModelChoice {
    /// The one model that was chosen; `None` for all.
    pub fn one(self) -> Option<Model> {
        match self {
            Self::Geometric => Some(Model::Geometric),
            Self::Fine => Some(Model::Fine),
            Self::Control => Some(Model::Control),
            Self::Hybrid => Some(Model::Hybrid),
            Self::All => None,
        }
    }
}

/// Sides that light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IncidentSide {
    /// The inner side: of a dome, the silicone.
    Inner,
    /// The outer side: of a dome, the air.
    Outer,
}

/// Lets the arguments of numbers take negative ones, which their parsers then refuse by name.
pub(crate) fn negative_numbers(command: Command) -> Command {
    let numbers = [
        TypeId::of::<f64>(),
        TypeId::of::<u8>(),
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
    ];
    command.mut_args(|argument| {
        let value = argument.get_value_parser().type_id();
        let is_number = numbers.iter().any(|number| value == *number);
        if is_number { argument.allow_negative_numbers(true) } else { argument }
    })
}

/// The cache in `directory`, or beside `out` where none is given.
pub(super) fn cache(directory: Option<&Path>, out: &Path) -> Cache {
    directory.map_or_else(|| Cache::beside(out), |given| Cache::new(given.to_owned()))
}

/// A parser of numbers of paths within [`PATHS`]: `1000000`, `1_000_000`, `1e6` or `2.5e6`.
pub(super) fn paths(text: &str) -> Result<u64, String> {
    let plain = text.replace('_', "");
    let whole = plain.parse::<u64>().ok().or_else(|| {
        let number = plain.parse::<f64>().ok()?;
        // Exact up to 2^53, beyond any number of paths.
        (number.fract() == 0.0 && (0.0..1e15).contains(&number)).then_some(number as u64)
    });
    let (low, high) = (PATHS.start(), PATHS.end());
    whole.filter(|number| PATHS.contains(number)).ok_or_else(|| {
        format!("expected a whole number from {low} to {high}, such as 1000000, 1_000_000 or 1e6")
    })
}

/// A parser of whole numbers within `range`.
pub(crate) fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let (low, high) = (range.start(), range.end());
        number.ok_or_else(|| format!("expected a whole number from {low} to {high}"))
    }
}

/// A parser of finite numbers.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| v.is_finite());
    number.ok_or_else(|| "expected a finite number".to_owned())
}
