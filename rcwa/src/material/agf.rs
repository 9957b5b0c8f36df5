// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reader of glass catalogues (`.agf`) as makers of glass publish them for Zemax OpticStudio.
//!
//! A glass begins with `NM` (name, number of its formula). Read are the lines `CD` (coefficients,
//! wavelengths in micrometres), `LD` (range) and `IT` (wavelength, internal transmittance, thickness
//! in mm), which some makers break before a number. The index is relative to air, at wavelengths in
//! air, which differ from those in vacuum by 3e-4: 1e-5 in the index of glass in visible light.
//!
//! Sources: OpticStudio's help, "The Glass Dispersion Formulas"; the order of coefficients is that
//! with which the n_d stated for each of 2300 glasses of 23 catalogues comes out. None has formula 4.

use std::f64::consts::PI;

use super::{Formula, Material, MaterialError, Source, Table, formula_source};

/// Names of glasses that a message lists.
const LISTED: usize = 6;

/// Tag, number of the line, and words behind it.
type Record<'a> = (&'a str, usize, Vec<&'a str>);

/// True of a line that begins a glass.
pub(super) fn is_name(line: &str) -> bool {
    line.starts_with("NM ")
}

/// The glass of this name; without one, the only glass of the catalogue.
pub(super) fn parse(text: &str, glass: Option<&str>) -> Result<Material, MaterialError> {
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).collect();
    let parts = lines.chunk_by(|_, next| !is_name(next.1)).filter(|part| is_name(part[0].1));
    let all: Vec<&[(usize, &str)]> = parts.collect();
    let chosen = match glass {
        Some(glass) => all.iter().find(|part| name(part).eq_ignore_ascii_case(glass)),
        None => all.first().filter(|_| all.len() == 1),
    };
    let chosen = chosen.ok_or_else(|| {
        let listed = all.iter().take(LISTED).map(|part| name(part)).collect::<Vec<_>>().join(", ");
        let rest = if all.len() > LISTED { ", ..." } else { "" };
        let expected = format!("the name of one of {} glasses, {listed}{rest}", all.len());
        MaterialError::Glass { expected, got: glass.unwrap_or("none").to_owned() }
    })?;
    read(&records(chosen))
}

/// The name of a glass.
fn name<'a>(glass: &[(usize, &'a str)]) -> &'a str {
    glass[0].1.split_whitespace().nth(1).unwrap_or_default()
}

/// Lines with those that carry them on.
fn records<'a>(lines: &[(usize, &'a str)]) -> Vec<Record<'a>> {
    let mut records: Vec<Record> = Vec::new();
    for &(line, text) in lines {
        let mut words = text.split_whitespace().peekable();
        let continues = words.peek().is_some_and(|word| word.parse::<f64>().is_ok());
        match (records.last_mut(), continues) {
            (Some((_, _, numbers)), true) => numbers.extend(words),
            _ => records.extend(words.next().map(|tag| (tag, line, words.collect()))),
        }
    }
    records
}

fn read(records: &[Record]) -> Result<Material, MaterialError> {
    let all = |tag: &'static str| records.iter().filter(move |record| record.0 == tag);
    let (_, line, words) = &records[0];
    let number = words.get(1).and_then(|word| word.parse::<f64>().ok());
    let mut coefficients = [0.0; 10];
    let stated = all("CD").next().ok_or(MaterialError::Missing("the line CD of a glass"))?;
    for (coefficient, value) in coefficients.iter_mut().zip(numbers(stated)?) {
        *coefficient = value;
    }
    let (formula, coefficients) = number
        .and_then(|number| dispersion(number, coefficients))
        .ok_or_else(|| MaterialError::Line {
            line: *line,
            expected: "a formula from 1 to 13 but 4, on which sources do not agree",
            got: words.get(1).unwrap_or(&"none").to_string(),
        })?;
    let range = all("LD").next().ok_or(MaterialError::Missing("the line LD of a glass"))?;
    let &[from, to, ..] = &numbers(range)?[..] else {
        return Err(MaterialError::Missing("one of the two wavelengths of the line LD"));
    };
    let mut k: Vec<[f64; 2]> = Vec::new();
    let mut opaque_from = None;
    for row in all("IT") {
        let &[wavelength, transmittance, thickness_mm] = &numbers(row)?[..] else {
            let expected = "a wavelength, a transmittance and a thickness";
            return Err(MaterialError::Line { line: row.1, expected, got: row.2.join(" ") });
        };
        if transmittance <= 0.0 || thickness_mm <= 0.0 {
            // At both ends the data are silent; light between would not be.
            opaque_from = opaque_from.or(Some(row.1).filter(|_| !k.is_empty()));
            continue;
        }
        if let Some(line) = opaque_from {
            let expected = "an internal transmittance above 0 between others";
            return Err(MaterialError::Line { line, expected, got: "0".into() });
        }
        // T = exp(-4π k d / λ).
        let per_mm = -transmittance.ln() / thickness_mm;
        k.push([wavelength, per_mm * wavelength * 1e-3 / (4.0 * PI)]);
    }
    if k.is_empty()
        && let Some(row) = all("IT").next()
    {
        let expected = "an internal transmittance above 0 at some wavelength";
        return Err(MaterialError::Line { line: row.1, expected, got: "0".into() });
    }
    let k = if k.is_empty() { None } else { Some(Source::Table(Table::new(k)?)) };
    Material::paired(formula_source(formula, &coefficients, [from, to])?, k)
}

/// The numbers of a record.
fn numbers((_, line, words): &Record) -> Result<Vec<f64>, MaterialError> {
    let refused =
        |word: &str| MaterialError::Line { line: *line, expected: "numbers", got: word.to_owned() };
    words.iter().map(|word| word.parse().map_err(|_| refused(word))).collect()
}

/// The formula of this number of the catalogue, with its coefficients in our order.
fn dispersion(number: f64, c: [f64; 10]) -> Option<(Formula, Vec<f64>)> {
    // n² = c0 + Σ c_i λ^e_i.
    let powers = |exponents: &[f64]| {
        let pairs = c[1..].iter().zip(exponents).flat_map(|(factor, power)| [*factor, *power]);
        (Formula::Polynomial, [c[0]].into_iter().chain(pairs).collect())
    };
    // n² - 1 = first + Σ K λ²/(λ² - L).
    let poles = |first: f64, pairs: &[f64]| (Formula::Sellmeier2, [&[first], pairs].concat());
    // n² = A + B λ^power/(λ² - C) - D λ², without a second pole.
    let handbook = |power: f64| {
        let [a, b, pole, d, ..] = c;
        (Formula::Mixed, vec![a, b, power, pole, 1.0, 0.0, 0.0, 0.0, 1.0, -d, 2.0])
    };
    Some(match number {
        1.0 => powers(&[2.0, -2.0, -4.0, -6.0, -8.0]),
        2.0 => poles(0.0, &c[..6]),
        3.0 => (Formula::Herzberger, c[..6].to_vec()),
        // n = n0 + A/λ + B/λ^3.5.
        5.0 => (Formula::Cauchy, vec![c[0], c[1], -1.0, c[2], -3.5]),
        6.0 => poles(0.0, &c[..8]),
        7.0 => handbook(0.0),
        8.0 => handbook(2.0),
        9.0 => poles(c[0] - 1.0, &c[1..5]),
        10.0 => powers(&[2.0, -2.0, -4.0, -6.0, -8.0, -10.0, -12.0]),
        11.0 => poles(0.0, &c),
        12.0 => powers(&[2.0, -2.0, -4.0, -6.0, -8.0, 4.0, 6.0]),
        13.0 => powers(&[2.0, 4.0, -2.0, -4.0, -6.0, -8.0, -10.0, -12.0]),
        _ => return None,
    })
}
