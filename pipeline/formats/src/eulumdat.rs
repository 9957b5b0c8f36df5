// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field as EULUMDAT.

pub mod layout;

use anyhow::Result;
use tracer::Distribution;

use super::content::FarField;
use super::photometry::{Labels, Photometry};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "EULUMDAT",
    endings: &["ldt"],
    sniff: Sniff::Lines(has_numbers),
    reads: Reads::LampSets(read),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "ldt",
    help: "Far field: EULUMDAT, .ldt",
    endings: &["ldt"],
    writes: Writes::FarField(text),
};

/// True for lines that begin with the numbers of the format.
fn has_numbers(lines: &[&str]) -> bool {
    let whole = |number: usize| -> Option<f64> {
        let value: f64 = lines.get(number - 1)?.parse().ok()?;
        (value.fract() == 0.0).then_some(value)
    };
    let ranges = [(2, 0.0, 3.0), (3, 0.0, 4.0), (4, 1.0, 721.0), (6, 2.0, 1e4)];
    let fits = ranges
        .iter()
        .all(|&(line, low, high)| whole(line).is_some_and(|v| (low..=high).contains(&v)));
    // Lines 13 to 21 are lengths.
    let lengths = lines.get(12..21);
    fits && lengths.is_some_and(|lengths| lengths.iter().all(|l| l.parse::<f64>().is_ok()))
}

fn read(text: &str, lamp_set: Option<usize>) -> Result<FarField> {
    let file = layout::read_lamp_set(text, lamp_set.unwrap_or(1))?;
    let several = (file.lamp_sets > 1 && lamp_set.is_none()).then(|| {
        format!(
            "{} sets of lamps, the first is taken; `batwing import --lamp-set N` takes another",
            file.lamp_sets
        )
    });
    let [maker, report, luminaire, number, _, date] = file.texts.clone();
    let lamp = file.lamp_texts[0].clone();
    Ok(FarField {
        format: "EULUMDAT",
        labels: Labels { maker, report, luminaire, number, date, lamp },
        photometry: Photometry {
            lumens: file.flux,
            absolute: file.is_absolute(),
            watts: file.watts,
        },
        warnings: file.warnings.iter().cloned().chain(several).collect(),
        distribution: Box::new(move || file.distribution()),
    })
}

fn text(labels: &Labels, table: &Distribution, photometry: Photometry) -> String {
    let texts =
        [&labels.maker, &labels.report, &labels.luminaire, &labels.number, "", &labels.date]
            .map(str::to_owned);
    // Absolute photometry knows no lamps: the flux stated is that of the luminaire, its light
    // output ratio 100 %.
    let (count, flux) =
        if photometry.absolute { (-1, table.flux()) } else { (1, photometry.lumens) };
    let lamps = layout::Lamps { count, flux, watts: photometry.watts };
    let mut file = layout::Ldt::from_distribution(table, texts, lamps);
    labels.lamp.clone_into(&mut file.lamp_texts[0]);
    layout::write(&file)
}
