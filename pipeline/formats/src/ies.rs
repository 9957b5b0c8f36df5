// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field as IES LM-63.

pub mod layout;

use tracer::Distribution;

use super::content::FarField;
use super::photometry::{Labels, Photometry};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes, program};

/// Keywords that hold labels, in the order of [`Labels::all`].
const KEYWORDS: [&str; 6] = ["MANUFAC", "TEST", "LUMINAIRE", "LUMCAT", "ISSUEDATE", "LAMP"];

/// Reads the format.
pub static READER: Reader = Reader {
    name: "IES LM-63",
    endings: &["ies"],
    sniff: Sniff::Lines(|lines| {
        lines.iter().any(|line| line.starts_with("TILT=")) || lines[0].starts_with("IESNA")
    }),
    reads: Reads::FarField(|text| Ok(far_field("IES LM-63", layout::read(text)?))),
};

/// Far field of a file of the format called `format`.
pub(super) fn far_field(format: &'static str, file: layout::Ies) -> FarField {
    let [maker, report, luminaire, number, date, lamp] = KEYWORDS.map(|keyword| {
        let mut found = file.keywords.iter().filter(|(k, _)| k == keyword);
        found.next().map_or(String::new(), |(_, text)| text.clone())
    });
    FarField {
        format,
        labels: Labels { maker, report, luminaire, number, date, lamp },
        photometry: Photometry {
            lumens: file.lumens_per_lamp * file.lamps as f64,
            absolute: file.is_absolute(),
            watts: file.watts,
        },
        warnings: file.warnings.clone(),
        distribution: Box::new(move || file.distribution()),
    }
}

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "ies",
    help: "Far field: IES LM-63, .ies",
    endings: &["ies"],
    writes: Writes::FarField(text),
};

fn text(labels: &Labels, table: &Distribution, photometry: Photometry) -> String {
    let mut keywords: Vec<(String, String)> = KEYWORDS
        .iter()
        .zip(labels.all())
        // The standard asks for these, named or not.
        .filter(|(k, v)| !v.is_empty() || ["TEST", "ISSUEDATE", "MANUFAC"].contains(k))
        .map(|(k, v)| ((*k).to_owned(), v.to_owned()))
        .collect();
    keywords.push(("TESTLAB".to_owned(), program()));
    let axis = "vertical angle 0 is the axis of the source";
    keywords.push(("OTHER".to_owned(), axis.to_owned()));
    let lumens = if photometry.absolute { -1.0 } else { photometry.lumens };
    layout::write(&layout::Ies::from_distribution(table, keywords, lumens, photometry.watts))
}
