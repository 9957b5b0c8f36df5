// SPDX-License-Identifier: MIT OR Apache-2.0
//! The parts of the page that are tables of numbers: figures of merit, power ledger, tables of
//! orders, provenance. They go into the page's template as JSON.

use metrics::figures::{
    self as definitions, BEAM_ANGLE, Definition, FIELD_ANGLE, PARABOLA, PEAK_ANGLE,
};
use serde_json::{Value, json};

use metrics::digits;
use metrics::quantity::Unit;
use metrics::uniformity_forms::FORMS;
use results::figure_entry::FigureEntry;
use results::film_light;
use results::shown::{self, shown_unit};

use super::folder::Folder;
use super::models::{Model, SURFACES};
use super::orders::Listed;
use crate::summary::SummaryRow;

/// Power below which an account of the ledger is left out where it is so in every model.
const NOTHING: f64 = 5e-7;

/// Part of its standard error from which on the bound of a figure's bias is shown.
const SEEN: f64 = 0.1;

/// Sign of a missing number.
const NONE: &str = "–";

/// One figure of a model.
#[derive(Clone, Debug)]
pub struct FigureOfMerit<'a> {
    /// Key in `results.json`.
    pub key: &'static str,
    /// Name for people.
    pub label: String,
    /// Unit of the stored value: a fraction or degrees.
    pub unit: Unit,
    /// The entry of `results.json`.
    pub entry: &'a FigureEntry,
    /// Of a peak angle that is the middle of a bin the entry of that between bins.
    between: Option<&'a FigureEntry>,
}

impl FigureOfMerit<'_> {
    /// The cell of a table: the value, and short notes below it.
    fn cell(&self) -> Value {
        let e = self.entry;
        let (scale, _) = shown_unit(self.unit);
        let value = shown::number(e, self.unit);
        let note = |words: String, wrap: bool| json!({"words": words, "wrap": wrap});
        let mut notes = Vec::new();
        let noise = e.peak_place.words();
        if let Some((_, why)) = noise.and_then(|words| words.split_once('(')) {
            notes.push(note(why.trim_end_matches(')').to_owned(), false));
        }
        // An angle that is noise has none between bins either.
        if let Some(between) = self.between.filter(|_| noise.is_none()) {
            notes.push(note(format!("by a parabola {}", shown::number(between, self.unit)), true));
        }
        let mut difference = None;
        if let Some(published) = e.reference {
            notes.push(note(format!("published {}", short(published * scale)), false));
            if shown::in_words(e, self.unit).is_none() {
                let decimals = decimals(e.standard_error * scale);
                let shown = format!("{:+.decimals$}", (e.value - published) * scale);
                difference = Some(shown.replace('-', "\u{2212}"));
            }
        }
        let bias = e.bias_bound.filter(|b| *b > SEEN * e.standard_error).map(|bound| {
            let bound = || format!("bias below {}", short(two_digits(bound * scale)));
            note(e.interval.map_or_else(bound, |_| "not resolved".to_owned()), false)
        });
        let last = e.wavelength_error.filter(|_| noise.is_none()).map(|error| {
            let error = shown::number(&FigureEntry::new(error), self.unit);
            note(format!("last wavelengths {error}"), true)
        });
        let after: Vec<Value> = bias.into_iter().chain(last).collect();
        json!({
            "value": value.split(" (").next(),
            "notes": notes, "difference": difference, "after": after,
        })
    }
}

/// The figures of a model that are shown first, in their order.
pub fn figures<'a>(model: &Model<'a>) -> Vec<FigureOfMerit<'a>> {
    let all = &model.entry.figures;
    let figure = |definition: Definition| {
        Some(FigureOfMerit {
            key: definition.key,
            label: definition.heading?.to_owned(),
            unit: definition.unit,
            entry: all.get(definition.key)?,
            between: all.get(PARABOLA.key).filter(|_| definition == PEAK_ANGLE),
        })
    };
    definitions::all().filter_map(figure).collect()
}

/// The figures as lines of a picture: those that have published ones, of designs that have some;
/// without any, all.
pub fn rows(models: &[Model]) -> Vec<SummaryRow> {
    let all: Vec<(&Model, FigureOfMerit)> = models
        .iter()
        .flat_map(|model| figures(model).into_iter().map(move |figure| (model, figure)))
        .collect();
    let published = all.iter().filter(|(_, figure)| figure.entry.reference.is_some());
    let (designs, labels): (Vec<&str>, Vec<&str>) =
        published.map(|(model, figure)| (model.design, figure.label.as_str())).unzip();
    let chosen = |model: &Model, figure: &FigureOfMerit| {
        let compared = designs.contains(&model.design) && labels.contains(&figure.label.as_str());
        compared || designs.is_empty()
    };
    all.iter()
        .filter(|(model, figure)| chosen(model, figure))
        .map(|(model, figure)| SummaryRow {
            design: model.design.to_owned(),
            model: model.label(),
            quantity: figure.label.clone(),
            unit: figure.unit,
            published: figure.entry.reference,
            computed: Some(*figure.entry),
        })
        .collect()
}

/// Models of one design after the other.
fn by_design<'m, 'a>(models: &'m [Model<'a>]) -> impl Iterator<Item = &'m [Model<'a>]> {
    models.chunk_by(|a, b| a.design == b.design)
}

/// A table of figures for each design that has any.
pub fn results(models: &[Model]) -> Vec<Value> {
    let of_design = |design: &[Model]| {
        let mut heads = Vec::new();
        for figure in design.iter().flat_map(figures) {
            if heads.iter().all(|head: &FigureOfMerit| head.key != figure.key) {
                heads.push(figure);
            }
        }
        if heads.is_empty() {
            return None;
        }
        let row = |model: &Model| {
            let own = figures(model);
            let cell = |head: &FigureOfMerit| {
                let figure = own.iter().find(|figure| figure.label == head.label);
                let (_, unit) = shown_unit(head.unit);
                json!({
                    "label": head.label, "unit": unit,
                    "cell": figure.map(FigureOfMerit::cell),
                })
            };
            json!({"model": model.label(), "cells": heads.iter().map(cell).collect::<Vec<_>>()})
        };
        let head =
            |head: &FigureOfMerit| json!({"label": head.label, "unit": shown_unit(head.unit).1});
        Some(json!({
            "design": design[0].design,
            "heads": heads.iter().map(head).collect::<Vec<_>>(),
            "rows": design.iter().map(row).collect::<Vec<_>>(),
        }))
    };
    by_design(models).filter_map(of_design).collect()
}

/// A line on the light of each model in a spectrum.
pub fn spectra(models: &[Model]) -> Vec<Value> {
    let line = |model: &Model| {
        let spectrum = model.entry.spectrum.as_ref().filter(|spectrum| !spectrum.is_line())?;
        Some(json!({
            "design": model.design, "model": model.label(), "weighting": spectrum.light.weighting,
            "count": metrics::plural::count(spectrum.wavelengths.len(), "wavelength"),
            "stopped_by": spectrum.stopped_by,
        }))
    };
    models.iter().filter_map(line).collect()
}

/// Power ledger, a table for each design, and in it that of the light between films.
pub fn ledger(models: &[Model]) -> Vec<Value> {
    let of_design = |design: &[Model]| {
        let names = accounts(design).into_iter();
        let row = |key: String| {
            let name = key.replace('_', " ");
            [(name.clone(), (key.clone(), false)), (format!("{name}, photons"), (key, true))]
        };
        let rows: Vec<_> = names.flat_map(row).collect();
        let mut table = by_model(design, &rows, |model, (account, photons)| {
            let entry = model.entry;
            let ledger = if *photons { entry.photon_ledger.as_ref()? } else { &entry.power_ledger };
            let share = ledger.account(account)?;
            Some(shown::number(share, Unit::Fraction))
        })?;
        table["between_films"] = between_films(design).into();
        Some(table)
    };
    by_design(models).filter_map(of_design).collect()
}

/// Light that passes between films, the uppermost plane first.
fn between_films(design: &[Model]) -> Option<Value> {
    let planes = |model: &Model| film_light::planes(&model.entry.power_ledger);
    let names = planes(design.first()?).into_iter().enumerate().rev();
    let rows = names.flat_map(|(k, (name, _))| {
        [(format!("{name}, upwards"), (k, 0)), (format!("{name}, downwards"), (k, 1))]
    });
    by_model(design, &rows.collect::<Vec<_>>(), |model, (k, way)| {
        let share = planes(model).get(*k)?.1[*way];
        Some(shown::number(&share, Unit::Ratio))
    })
}

/// Flux, mean and extremes of `[[receivers]]`, a table for each design that has any.
pub fn receivers(models: &[Model]) -> Vec<Value> {
    let of_design = |design: &[Model]| {
        let first = design.iter().find_map(|model| model.entry.receivers.as_ref())?;
        let rows = first.iter().flat_map(|(name, receiver)| {
            let figures = shown::of_receiver(receiver);
            figures.map(move |(label, _)| (format!("{name}, {label}"), (name, label)))
        });
        by_model(design, &rows.collect::<Vec<_>>(), |model, (name, label)| {
            let mut all = shown::of_receiver(model.entry.receivers.as_ref()?.get(*name)?);
            Some(all.find(|(known, _)| known == label)?.1)
        })
    };
    by_design(models).filter_map(of_design).collect()
}

/// Forms of uniformity, a table for each design that has any.
pub fn uniformity(models: &[Model]) -> Vec<Value> {
    let of_design = |design: &[Model]| {
        let rows: Vec<_> = FORMS.iter().map(|form| (form.label.to_owned(), form.key)).collect();
        by_model(design, &rows, |model, key| {
            Some(shown::number(model.entry.figures.get(*key)?, Unit::Fraction))
        })
    };
    by_design(models).filter_map(of_design).collect()
}

/// A figure of the table after those shown first.
enum Row {
    /// Flux that the sources emit.
    Emitted,
    /// Figure of the registry.
    Figure(Definition),
    /// Share of one package in such a figure.
    OfPackage(Definition),
}

/// Colours of map and far field, a table for each design that has any.
pub fn colours(models: &[Model]) -> Vec<Value> {
    let of_design = |design: &[Model]| {
        let rows: Vec<_> = definitions::colours().map(|f| (f.label.to_owned(), f)).collect();
        by_model(design, &rows, |model, figure| {
            Some(shown::text(model.entry.figures.get(figure.key)?, figure.unit))
        })
    };
    by_design(models).filter_map(of_design).collect()
}

/// Widths of the far field and figures in absolute units, a table for each design that has any.
pub fn others(models: &[Model]) -> Vec<Value> {
    let absolute = || definitions::all().filter(|figure| figure.is_absolute);
    let of_package = absolute().map(|f| (format!("{}, one package", f.label), Row::OfPackage(f)));
    let rows = [BEAM_ANGLE, FIELD_ANGLE].into_iter().chain(absolute());
    let rows = rows.map(|figure| (figure.label.to_owned(), Row::Figure(figure)));
    let emitted = [("flux, emitted".to_owned(), Row::Emitted)];
    let rows: Vec<_> = emitted.into_iter().chain(rows).chain(of_package).collect();
    let text = |model: &Model, row: &Row| {
        let absolute = model.entry.absolute.as_ref();
        match row {
            Row::Emitted => Some(shown::emitted(&absolute?.emitted, model.entry.spectrum.as_ref())),
            Row::Figure(figure) => {
                let (entry, unit) = model.entry.figure(figure.key)?;
                Some(shown::text(&entry, unit))
            }
            Row::OfPackage(figure) => {
                let absolute = absolute.filter(|absolute| absolute.packages > 1)?;
                let figure = absolute.figures.get(figure.key)?;
                Some(shown::text(figure.per_package.as_ref()?, figure.unit()))
            }
        }
    };
    by_design(models).filter_map(|design| by_model(design, &rows, text)).collect()
}

/// A table of one design: a row for each name and what it stands for, a column for each model. Rows
/// without any text are left out, and the table without any row.
fn by_model<K>(
    design: &[Model],
    rows: &[(String, K)],
    text: impl Fn(&Model, &K) -> Option<String>,
) -> Option<Value> {
    let row = |(name, of): &(String, K)| {
        let texts: Vec<Option<String>> = design.iter().map(|model| text(model, of)).collect();
        let has_text = texts.iter().any(Option::is_some);
        let cells = design.iter().zip(texts).map(|(model, text)| {
            json!({"model": model.label(), "text": text.unwrap_or_else(|| NONE.to_owned())})
        });
        has_text.then(|| json!({"name": name, "cells": cells.collect::<Vec<_>>()}))
    };
    let rows: Vec<Value> = rows.iter().filter_map(row).collect();
    (!rows.is_empty()).then(|| {
        json!({
            "design": design[0].design,
            "models": design.iter().map(Model::label).collect::<Vec<_>>(),
            "rows": rows,
        })
    })
}

/// A share in per cent with its error.
pub fn percent(share: Option<&FigureEntry>) -> String {
    share.map_or(NONE.to_owned(), |share| shown::number(share, Unit::Fraction))
}

/// Accounts that hold power in one of the models at least, in the order of a ray's life.
pub fn accounts(models: &[Model]) -> Vec<String> {
    const BEGINNINGS: [&str; 5] = ["emitted", "escaped_", "absorbed_by_", "absorbed_in_", "lost_"];
    let all = models.iter().flat_map(|m| &m.entry.power_ledger.accounts);
    let held = all.filter(|(name, share)| {
        share.value.abs() > NOTHING && !name.starts_with(film_light::PASSED)
    });
    let mut names: Vec<String> = held.map(|(name, _)| name.clone()).collect();
    let rank = |account: &str| {
        let rank = BEGINNINGS.iter().position(|b| account.starts_with(b));
        rank.unwrap_or(BEGINNINGS.len())
    };
    names.sort_by(|a, b| (rank(a), a).cmp(&(rank(b), b)));
    names.dedup();
    names
}

/// Headings of a design's tables of orders.
pub const TABLE_HEADS: [&str; 11] = [
    "band",
    "ring",
    "period (µm)",
    "depth (µm)",
    "highest order",
    "slices",
    "ky",
    "error, orders and slices",
    "error, ky",
    "error, kx",
    "power balance",
];

/// Statements of the tables of diffraction orders on themselves, design by design.
pub fn orders(listed: &[Listed]) -> Vec<Value> {
    let row = |table: &Listed| {
        let e = table.entry;
        let numbers = [e.band, e.ring].map(|n| Some(n as f64));
        let sizes = [e.orders, e.slices, e.ky].map(|n| Some(n as f64));
        let cells = [numbers.as_slice(), &[Some(e.period_um), Some(e.depth_um)], &sizes].concat();
        let errors = [Some(e.estimated_error), e.grid_error, e.kx_error, Some(e.energy_residual)];
        let text = |x: Option<f64>| x.map_or(NONE.to_owned(), short);
        cells.into_iter().chain(errors).map(text).collect::<Vec<_>>()
    };
    let of_design = |design: &[Listed]| json!({"design": design[0].design, "rows": design.iter().map(row).collect::<Vec<_>>()});
    let designs = listed.chunk_by(|a, b| a.design == b.design);
    designs.map(of_design).collect()
}

/// Seed of the paths of `model`, in a file of seed `of_file`.
fn seed(model: &Model, of_file: u64) -> u64 {
    model.entry.seed.unwrap_or(of_file)
}

/// The seed of all `models`, or each with its models.
pub fn seeds(models: &[Model], of_file: u64) -> String {
    let names = models.iter().map(|model| format!("{}, {}", model.design, model.label()));
    seeds_in_words(models.iter().map(|model| seed(model, of_file)).zip(names))
}

fn seeds_in_words(models: impl Iterator<Item = (u64, String)>) -> String {
    let mut by_seed: Vec<(u64, Vec<String>)> = Vec::new();
    for (seed, name) in models {
        match by_seed.iter_mut().find(|(known, _)| *known == seed) {
            Some((_, names)) => names.push(name),
            None => by_seed.push((seed, vec![name])),
        }
    }
    let is_one = by_seed.len() == 1;
    let each = by_seed.into_iter().map(|(seed, names)| {
        let of = if is_one { String::new() } else { format!(" ({})", names.join("; ")) };
        format!("{seed}{of}")
    });
    each.collect::<Vec<_>>().join(", ")
}

/// Version, seed, hashes.
pub fn provenance(folder: &Folder, models: &[Model]) -> Value {
    let top = folder.results();
    let compared = models.iter().any(|m| m.entry.figures.values().any(|f| f.reference.is_some()));
    let mut lines = vec![
        ("computed by", format!("{} {}", top.program.name, top.program.version)),
        ("page written by", format!("batwing {}", env!("CARGO_PKG_VERSION"))),
        ("schema of results.json", top.schema_version.to_string()),
        ("seed", seeds(models, top.seed)),
        ("kind of run", if top.quick { "quick" } else { "full" }.to_owned()),
    ];
    if compared {
        lines.push(("published figures", top.reference_source.clone().unwrap_or_default()));
    }
    let paths = |model: &Model| {
        json!([
            model.design,
            model.label(),
            thousands(model.entry.paths),
            seed(model, top.seed).to_string(),
            short(model.entry.counters[SURFACES]),
        ])
    };
    json!({
        "lines": lines, "inputs": top.inputs, "files": top.files,
        "paths": models.iter().map(paths).collect::<Vec<_>>(),
    })
}

/// Decimals that show an error to two digits.
fn decimals(error: f64) -> usize {
    if error > 0.0 { (1 - error.log10().floor() as i64).clamp(0, 6) as usize } else { 2 }
}

/// Two significant digits for what is below 1, else as few as say all.
fn short(x: f64) -> String {
    if x == 0.0 {
        "0".to_owned()
    } else if x.abs() < 1e-3 {
        format!("{x:.1e}")
    } else if x.abs() < 1.0 {
        let digits = (1 - x.abs().log10().floor() as i64).max(0) as usize;
        format!("{x:.digits$}")
    } else {
        let text = format!("{x:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

/// A number to two significant digits.
fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// Groups of three digits, apart by narrow spaces.
pub fn thousands(number: u64) -> String {
    digits::thousands(number).replace(',', "\u{202f}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_stand_with_their_models_where_they_differ() {
        let words = |seeds: [u64; 3]| {
            let names = ["a, rays", "b, rays", "b, hybrid"].map(str::to_owned);
            seeds_in_words(seeds.into_iter().zip(names))
        };
        assert_eq!(words([5, 5, 5]), "5");
        assert_eq!(words([5, 1, 5]), "5 (a, rays; b, hybrid), 1 (b, rays)");
    }

    #[test]
    fn numbers_are_short_and_say_enough() {
        for (x, text) in [
            (0.0, "0"),
            (25.0, "25"),
            (75.5, "75.5"),
            (0.014_45, "0.014"),
            (1.275e-12, "1.3e-12"),
            (0.000_667, "6.7e-4"),
        ] {
            assert_eq!(short(x), text);
        }
        assert_eq!(short(two_digits(1.644)), "1.6");
        assert_eq!(thousands(20_000_000), "20\u{202f}000\u{202f}000");
        assert_eq!(thousands(600), "600");
        assert_eq!((decimals(0.093), decimals(0.27), decimals(12.0)), (3, 2, 0));
    }
}
