// SPDX-License-Identifier: MIT OR Apache-2.0
//! Defaults that follow from what a design states, so that none of them refuses it.

use toml::Table;

use metrics::far_field::{BinPlacement, PeakMethod};

use crate::schema::Design;

/// Most rings of a band by default.
const RINGS_OF_A_BAND: usize = 10;

/// Sets the keys that `written` does not have and whose default depends on others.
pub(crate) fn derive(raw: &mut Design, written: &Table) {
    let states = |table: &str, key: &str| {
        let table = written.get(table).and_then(toml::Value::as_table);
        table.is_some_and(|table| table.contains_key(key))
    };
    rings(raw, |key| states("hybrid", key));
    far_field(raw, |key| states("far_field", key));
}

/// Rings are those of the elements. Of copies of another width, which a design asks for, a band
/// holds the most that divide those of one element.
fn rings(raw: &mut Design, states: impl Fn(&str) -> bool) {
    let Some(elements) = raw.elements.as_ref().map(|elements| elements.width_um) else {
        return;
    };
    let usable = |width: f64| width.is_finite() && width > 0.0;
    if !usable(elements) {
        return;
    }
    let hybrid = &mut raw.hybrid;
    if !states("element_width_um") {
        hybrid.element_width_um = elements;
    }
    if !states("rings_per_band") && usable(hybrid.element_width_um) {
        let rings = (elements / hybrid.element_width_um).round() as usize;
        let divides = |n: &usize| rings.is_multiple_of(*n);
        hybrid.rings_per_band = (1..=RINGS_OF_A_BAND).rev().find(divides).unwrap_or(1);
    }
    if !states("representative") {
        hybrid.representative = hybrid.rings_per_band.div_ceil(2).max(1);
    }
}

/// The centre ends where a bin ends, the first at or beyond the usual angle; the parabola reaches
/// at least a bin.
fn far_field(raw: &mut Design, states: impl Fn(&str) -> bool) {
    let f = &mut raw.far_field;
    if f.read_bins == BinPlacement::About && !states("read_bin_deg") {
        if !states("bin_deg") {
            f.bin_deg = 1.0;
        }
        // Whole bins on both sides of a multiple of the width that is read.
        let pair = 2.0 * f.bin_deg;
        let fits = |read: &f64| (90.0 / read - (90.0 / read).round()).abs() < 1e-9;
        let multiples = (1..=90).map(|k| pair * f64::from(k));
        f.read_bin_deg = multiples.take_while(|read| *read <= 15.0).find(fits);
    }
    let read = f.read_bin_deg();
    if !(read.is_finite() && read > 0.0) {
        return;
    }
    let inner = match f.read_bins {
        BinPlacement::Between => read,
        BinPlacement::About => 0.5 * read,
    };
    if !states("centre_deg") {
        let more = ((f.centre_deg - inner) / read - 1e-9).ceil().max(0.0);
        f.centre_deg = inner + more * read;
    }
    if !states("peak_fit_deg") && f.peak == PeakMethod::Parabola {
        f.peak_fit_deg = f.peak_fit_deg.max(read);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::parse;
    use crate::resolved::Design;

    const OWN: &str = crate::NEW_DESIGN;

    fn own(edits: &[(&str, &str)], more: &str) -> Design {
        let mut text = OWN.replace("NAME", "own") + more;
        for (old, new) in edits {
            assert!(text.contains(old), "{old}");
            text = text.replace(old, new);
        }
        parse("own.toml", &text, Path::new("")).unwrap_or_else(|e| panic!("{edits:?} {more}: {e}"))
    }

    #[test]
    fn rings_are_those_of_the_elements_unless_the_design_asks_for_copies() {
        let copies = "element_width_um = 10.0";
        for (width, stated, expected) in [
            (20.0, None, (1, 1, 1)),
            (7.5, None, (1, 1, 1)),
            (100.0, Some(10.0), (10, 10, 5)),
            (100.0, Some(20.0), (5, 5, 3)),
            (130.0, Some(10.0), (13, 1, 1)),
            (80.0, Some(10.0), (8, 8, 4)),
        ] {
            let width_um = format!("width_um = {width:?}\n\n[[");
            let stated = stated.map_or(String::new(), |um: f64| format!("element_width_um = {um}"));
            let edits = [("width_um = 100.0\n\n[[", &*width_um), (copies, &*stated)];
            let hybrid = own(&edits, "").hybrid;
            let rings = (width / hybrid.element_width_um).round() as usize;
            let found = (rings, hybrid.rings_per_band, hybrid.representative);
            assert_eq!(found, expected, "{width} {stated}");
        }
        // The rings of the paper.
        let usual = own(&[], "").hybrid;
        assert_eq!((usual.rings_per_band, usual.representative), (10, 5));
        assert!((usual.element_width_um - 10.0).abs() < 1e-12);
    }

    #[test]
    fn optional_lines_of_the_starting_design_are_accepted() {
        let stated = |line: &str| {
            let key = line.strip_prefix("# ").filter(|key| {
                let name = key.split([' ', '=']).next().unwrap_or_default();
                key.starts_with("[[")
                    || key.contains(" = ") && name.contains('_')
                    || ["name", "kind", "bins"].contains(&name)
            });
            key.unwrap_or(line).to_owned()
        };
        let lines: Vec<String> = OWN.replace("NAME", "own").lines().map(stated).collect();
        let design = parse("own.toml", &lines.join("\n"), Path::new(""));
        let design = design.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(design.receivers.len(), 1);
        assert!(design.emitted.is_some());
    }

    #[test]
    fn one_key_of_the_far_field_is_enough() {
        for bin in ["0.5", "1.0", "2.0", "2.5", "5.0", "7.5", "10.0", "15.0"] {
            let far = own(&[], &format!("\n[far_field]\nbin_deg = {bin}\n")).far_field;
            let bins = far.centre_deg / far.bin_deg;
            assert!((bins - bins.round()).abs() < 1e-9 && far.centre_deg >= 2.0, "{bin}");
        }
        for bin in ["", "bin_deg = 0.5\n", "bin_deg = 2.5\n"] {
            let text = format!("\n[far_field]\nread_bins = \"about\"\n{bin}");
            let far = own(&[], &text).far_field;
            assert!(far.read_bin_deg() >= 2.0 * far.bin_deg, "{bin}");
        }
        own(&[("pitch_mm = 5.0", "pitch_mm = 17")], "");
    }
}
