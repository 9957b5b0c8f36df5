// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far fields in the XML of ANSI/IES TM-33 and ATLA S001 (UNI 11733): luminous intensities of the
//! first emitter that has some, read into an [`Ies`].
//!
//! Versions name one thing differently: intensities are `IntData` with `h` and `v` or
//! `IntensityData` with `horz` and `vert`, in `LuminousIntensity`, `LuminousData` or an
//! `IntensityDistribution` of the metric `Luminous`. Vertical angles are those of LM-63; horizontal
//! ones are azimuths of type C; types A and B are refused. Radiant, photon and spectral intensities
//! are not read.
//!
//! Layout: the public schemas of ATLA S001 and TM-33-22 with their samples.

use std::collections::BTreeMap;

use crate::text::{parse_number, quoted};
use crate::window::layout::check_nesting;
use roxmltree::{Document, Node, ParsingOptions};

use crate::fields::LARGEST;
use crate::ies::layout::Ies;
use crate::text::FormatError;

/// First letters of outermost elements.
pub const ROOTS: [&str; 2] = ["IESTM33", "LuminaireOpticalData"];
/// Elements that hold intensities.
const HOLDERS: [&str; 3] = ["LuminousIntensity", "LuminousData", "IntensityDistribution"];
/// Elements of the header for the keywords of LM-63.
const LABELS: [(&str, &str); 4] = [
    ("Manufacturer", "MANUFAC"),
    ("ReportNumber", "TEST"),
    ("Description", "LUMINAIRE"),
    ("CatalogNumber", "LUMCAT"),
];

fn line_of(node: Node<'_, '_>) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}

fn is(node: Node<'_, '_>, names: &[&str]) -> bool {
    node.is_element() && names.contains(&node.tag_name().name())
}

/// Text of the first of these elements below `node`.
fn text_of<'a>(node: Node<'a, '_>, names: &[&str]) -> Option<(usize, &'a str)> {
    let found = node.descendants().find(|n| is(*n, names))?;
    Some((line_of(found), found.text().unwrap_or_default().trim()))
}

fn number_of(node: Node<'_, '_>, names: &[&str]) -> Result<Option<f64>, FormatError> {
    text_of(node, names).map(|(line, word)| parse_number(word, line, names[0])).transpose()
}

/// Reads the text of a file.
///
/// # Errors
/// If it is no such XML, has no luminous intensities, some of type A or B, none for a pair of its
/// angles or two, or no flux.
pub fn read(text: &str) -> Result<Ies, FormatError> {
    check_nesting(text)?;
    let options = ParsingOptions { nodes_limit: 10_000_000, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        FormatError::line(error.pos().row as usize, "well-formed XML", error.to_string())
    })?;
    let root = document.root_element();
    let name = root.tag_name().name();
    if !ROOTS.iter().any(|known| name.starts_with(known)) {
        let expected = "an outermost element IESTM33 or LuminaireOpticalData";
        return Err(FormatError::line(line_of(root), expected, quoted(name)));
    }
    let held = |holder: &Node<'_, '_>| {
        let luminous = text_of(*holder, &["Metric"]).is_none_or(|(_, metric)| metric == "Luminous");
        let rows = holder.children().any(|n| is(n, &["IntData", "IntensityData"]));
        is(*holder, &HOLDERS) && luminous && rows
    };
    let holders: Vec<Node<'_, '_>> = root.descendants().filter(held).collect();
    let Some(&holder) = holders.first() else {
        let expected = "luminous intensities, IntData or IntensityData of an Emitter";
        return Err(FormatError::line(line_of(root), expected, "none"));
    };
    for name in ["PhotometryType", "GoniometerType", "Gonioradiometer"] {
        let found = root.descendants().find(|n| is(*n, &[name]));
        let kind = found.and_then(|n| text_of(n, &["Type"]).or_else(|| text_of(n, &[name])));
        if let Some((line, kind)) = kind
            && !kind.is_empty()
            && !kind.ends_with('C')
        {
            let expected = "photometry of type C, about the axis of the luminaire";
            return Err(FormatError::line(line, expected, quoted(kind)));
        }
    }
    let emitter = holder.ancestors().find(|n| is(*n, &["Emitter"])).unwrap_or(holder);
    let mut ies = intensities(holder)?;
    let rated = number_of(emitter, &["RatedLumens"])?.filter(|lumens| *lumens > 0.0);
    let relative = text_of(holder, &["AbsolutePhotometry"])
        .is_some_and(|(_, absolute)| absolute.eq_ignore_ascii_case("false"));
    if let Some(lumens) = rated.filter(|_| relative) {
        ies.lumens_per_lamp = lumens;
    }
    ies.watts = number_of(emitter, &["InputWattage", "InputWatts"])?.unwrap_or(0.0);
    ies.keywords = LABELS
        .iter()
        .filter_map(|(name, keyword)| {
            let header = root.children().find(|n| is(*n, &["Header"]))?;
            let (_, label) = text_of(header, &[name])?;
            Some(((*keyword).to_owned(), label.to_owned()))
        })
        .collect();
    if holders.len() > 1 {
        ies.warnings.push(format!(
            "{} emitters have luminous intensities; the first is taken",
            holders.len()
        ));
    }
    let stated = (!ies.is_absolute()).then_some(ies.lumens_per_lamp);
    let usable = crate::fields::usable(ies.distribution(), stated, line_of(holder))?;
    ies.warnings.extend(usable);
    Ok(ies)
}

/// Intensities on the grid of their angles.
fn intensities(holder: Node<'_, '_>) -> Result<Ies, FormatError> {
    let mut rows: BTreeMap<[u64; 2], f64> = BTreeMap::new();
    for node in holder.children().filter(|n| is(*n, &["IntData", "IntensityData"])) {
        let line = line_of(node);
        let angle = |names: [&str; 3], high: f64| {
            let word = names.iter().find_map(|name| node.attribute(*name)).unwrap_or_default();
            let angle = parse_number(word, line, names[0])?;
            if (0.0..=high).contains(&angle) {
                return Ok(angle + 0.0);
            }
            let expected = format!("{}: an angle from 0 to {high} degrees", names[0]);
            Err(FormatError::line(line, expected, quoted(word)))
        };
        let place =
            [angle(["h", "horz", "horizontal"], 360.0)?, angle(["v", "vert", "vertical"], 180.0)?];
        let word = node.text().unwrap_or_default().trim();
        let value = parse_number(word, line, "an intensity")?;
        if !(0.0..=LARGEST).contains(&value) {
            let expected = "an intensity: 0 or more, up to 1e30";
            return Err(FormatError::line(line, expected, quoted(word)));
        }
        // Bits of numbers from 0 ascend as the numbers do.
        if rows.insert(place.map(f64::to_bits), value).is_some() {
            let got = format!("two at h {}, v {}", place[0], place[1]);
            return Err(FormatError::line(line, "one intensity for each direction", got));
        }
    }
    let angles = |axis: usize| {
        let mut all: Vec<u64> = rows.keys().map(|place| place[axis]).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let (mut horizontal, vertical) = (angles(0), angles(1));
    if rows.len() != horizontal.len() * vertical.len() {
        let expected = format!(
            "an intensity for each of {} horizontal and {} vertical angles",
            horizontal.len(),
            vertical.len()
        );
        return Err(FormatError::line(line_of(holder), expected, rows.len().to_string()));
    }
    let mut candela: Vec<f64> = rows.into_values().collect();
    // Planes around the whole circle, of which the last is the first.
    if let [first, .., before, last] =
        horizontal.iter().copied().map(f64::from_bits).collect::<Vec<_>>()[..]
        && first == 0.0
        && last < 360.0
        && 2.0 * last - before > 360.0 - 1e-6
    {
        horizontal.push(360.0_f64.to_bits());
        candela.extend_from_within(..vertical.len());
    }
    let degrees = |list: Vec<u64>| list.into_iter().map(f64::from_bits).collect();
    let multiplier = number_of(holder, &["Multiplier"])?.unwrap_or(1.0);
    Ok(Ies { multiplier, ..Ies::absolute(degrees(vertical), degrees(horizontal), candela) })
}
