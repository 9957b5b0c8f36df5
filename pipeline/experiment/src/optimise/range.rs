// SPDX-License-Identifier: MIT OR Apache-2.0
//! Values of one coefficient by a coordinate of the unit box: numbers between bounds, or choices.

use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};
use toml::Value;

use design::ConfigError;
use design::json_schema::{NumberKind, number_kind};

use super::file::VariableKeys;
use crate::design_file::DesignFile;

/// Most choices of a variable.
const MOST: usize = 1000;

/// Values of one coefficient.
#[derive(Debug, Clone)]
pub(super) enum Range {
    Between { from: f64, to: f64, resolution: Option<f64>, whole: bool },
    Choices(Vec<Value>),
}

impl Range {
    /// The values that `keys` ask for, of a key of the design or of a profile.
    ///
    /// # Errors
    /// Bounds that cross, a resolution or choices that do not fit.
    pub fn new(keys: &VariableKeys, of_key: bool) -> Result<Self> {
        if let Some(value) = &keys.value {
            let others = keys.from.or(keys.to).or(keys.start).or(keys.resolution);
            ensure!(
                keys.key.is_some() && others.is_none() && keys.choices.is_none(),
                "value: expected a `key` alone beside it, which follows others"
            );
            return Ok(Self::Choices(vec![Value::String(value.clone())]));
        }
        if let Some(choices) = &keys.choices {
            ensure!(
                of_key && keys.from.is_none() && keys.to.is_none(),
                "choices: expected a `key` without `from` and `to` beside them"
            );
            ensure!(
                (2..=MOST).contains(&choices.len()),
                "choices: expected 2 to {MOST}, got {}",
                choices.len()
            );
            return Ok(Self::Choices(choices.clone()));
        }
        let (Some(from), Some(to)) = (keys.from, keys.to) else {
            bail!("expected `from` and `to`, or `choices`");
        };
        ensure!(
            from.is_finite() && to.is_finite() && from < to,
            "from, to: expected a number and a larger one, got {from} and {to}"
        );
        if let Some(step) = keys.resolution {
            ensure!(
                step > 0.0 && step <= (to - from) * (1.0 + 1e-12),
                "resolution: expected a number above 0 and up to {}, got {step}",
                to - from
            );
        }
        Ok(Self::Between { from, to, resolution: keys.resolution, whole: false })
    }

    /// These values of `key`: whole numbers where the schema of designs takes no others. A value
    /// without a design is no reason to refuse the others.
    ///
    /// # Errors
    /// A key that the design of `source` cannot have; bounds without a whole number between them;
    /// choices of which none makes a design.
    pub fn of_key(mut self, key: &str, source: &DesignFile) -> Result<Self> {
        let settings = |value: Value| BTreeMap::from([(key.to_owned(), value)]);
        // A path that the design does not hold is wrong whatever the value.
        source.table_with(&settings(self.value(0.5)))?;
        let with = |value: Value| source.with(&settings(value));
        if let Self::Choices(choices) = &self {
            let mut refusals = Vec::new();
            for choice in choices {
                match with(choice.clone()) {
                    Ok(_) => return Ok(self),
                    Err(refusal) => refusals.push(refusal),
                }
            }
            return refusals.into_iter().next().map_or(Ok(self), Err);
        }
        if let Self::Between { from, to, whole, .. } = &mut self
            && number_kind(key) == Some(NumberKind::Whole)
        {
            *whole = true;
            ensure!(
                from.ceil() <= to.floor(),
                "from, to: expected bounds with a whole number between them, as {key} takes no \
                 others, got {from} and {to}"
            );
        }
        match with(self.value(0.5)) {
            // Keys and types are wrong whatever the value.
            Err(refusal) if is_syntax(&refusal) || number_kind(key).is_none() => Err(refusal),
            _ => Ok(self),
        }
    }

    /// For people: bounds, or the number of choices.
    pub fn words(&self) -> String {
        match self {
            Self::Between { from, to, resolution: None, .. } => format!("{from} to {to}"),
            Self::Between { from, to, resolution: Some(step), .. } => {
                format!("{from} to {to} in steps of {step}")
            }
            Self::Choices(choices) => match &choices[..] {
                [one] => one.to_string(),
                choices => format!("{} choices", choices.len()),
            },
        }
    }

    /// The value at a coordinate of the unit box, as the design states it.
    pub fn value(&self, coordinate: f64) -> Value {
        match self {
            Self::Between { whole, .. } => {
                let value = self.number(coordinate);
                if *whole { Value::Integer(value as i64) } else { Value::Float(value) }
            }
            Self::Choices(choices) => {
                let place = (coordinate * choices.len() as f64) as usize;
                choices[place.min(choices.len() - 1)].clone()
            }
        }
    }

    /// The number at a coordinate of the unit box; of choices the coordinate.
    pub fn number(&self, coordinate: f64) -> f64 {
        match self {
            Self::Between { from, to, .. } => self.rounded(from + coordinate * (to - from)),
            Self::Choices(_) => coordinate,
        }
    }

    /// To a multiple of the resolution and to a whole number, within the bounds.
    pub fn rounded(&self, value: f64) -> f64 {
        match self {
            Self::Between { from, to, resolution, whole: true } => {
                let step = resolution.unwrap_or(1.0);
                let value = (value / step).round() * step;
                value.round().clamp(from.ceil(), to.floor())
            }
            Self::Between { from, to, resolution: Some(step), .. } => {
                ((value / step).round() * step).clamp(*from, *to)
            }
            _ => value,
        }
    }

    /// Place of `value` in the unit box, moved into the bounds.
    pub fn coordinate(&self, value: f64) -> f64 {
        match self {
            Self::Between { from, to, .. } => ((value - from) / (to - from)).clamp(0.0, 1.0),
            Self::Choices(_) => value,
        }
    }
}

/// True of a complaint about keys and types.
fn is_syntax(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(ConfigError::Syntax { .. }))
}
