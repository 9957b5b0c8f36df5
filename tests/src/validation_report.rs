// SPDX-License-Identifier: MIT OR Apache-2.0
//! The values of `docs/validation/report.md`: the tests that own them write them there.
//!
//! A section of the page stands between `<!-- values: NAME -->` and `<!-- end -->`. With `BATWING_BLESS` set
//! a test writes its section; else it fails where the page says something else.

use std::fmt::Write as _;
use std::sync::{Mutex, PoisonError};

use metrics::Estimate;
use metrics::digits::format_value_with_error;

/// The page, from the top of the workspace.
pub const PAGE: &str = "docs/validation/report.md";
/// Power of ten below which a difference is rounding, which depends on the processor.
const LEAST: i32 = -10;

/// One check, as it is shown.
pub struct Row {
    check: String,
    expected: String,
    computed: String,
    error: String,
    allowed: String,
    holds: bool,
}

impl Row {
    /// A number that is to be within `allowed` of another's, shown to `decimals`.
    pub fn near(check: &str, expected: f64, computed: f64, allowed: f64, decimals: usize) -> Self {
        let off = (computed - expected).abs();
        let power = (off.max(f64::MIN_POSITIVE).log10().ceil() as i32).max(LEAST);
        Self {
            check: check.to_owned(),
            expected: format!("{expected:.decimals$}"),
            computed: format!("{computed:.decimals$}"),
            error: format!("below 1e{power}"),
            allowed: format!("{allowed:.0e}"),
            holds: off <= allowed,
        }
    }

    /// An estimate that is to be within `allowed` standard errors and `beyond` of an exact value, shown to
    /// `decimals`.
    pub fn estimate(
        check: &str,
        (exact, decimals): (f64, usize),
        found: Estimate,
        (allowed, beyond): (f64, f64),
    ) -> Self {
        let off = (found.value - exact).abs();
        let more = if beyond > 0.0 { format!(" + {beyond}") } else { String::new() };
        Self {
            check: check.to_owned(),
            expected: format!("{exact:.decimals$}"),
            computed: format_value_with_error(found.value, found.standard_error),
            error: format!("{:.1} SE", off / found.standard_error.max(f64::MIN_POSITIVE)),
            allowed: format!("{allowed} SE{more}"),
            holds: off < allowed * found.standard_error + beyond,
        }
    }

    /// Texts as they stand elsewhere.
    pub fn quoted(check: &str, texts: [String; 4], holds: bool) -> Self {
        let [expected, computed, error, allowed] = texts;
        Self { check: check.to_owned(), expected, computed, error, allowed, holds }
    }
}

/// Holds the section `name` of the page to these rows.
///
/// # Panics
/// If the page says something else, or has no such section.
pub fn hold(name: &str, rows: &[Row]) {
    let mut table = String::from(
        "| check | value | ours | error | allowed | verdict |\n|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let Row { check, expected, computed, error, allowed, holds } = row;
        let verdict = if *holds { "holds" } else { "**misses**" };
        let _ = writeln!(
            table,
            "| {check} | {expected} | {computed} | {error} | {allowed} | {verdict} |"
        );
    }
    hold_text(name, &table);
}

/// Holds the section `name` of the page to a text.
///
/// # Panics
/// If the page says something else, or has no such section.
pub fn hold_text(name: &str, section: &str) {
    static WRITERS: Mutex<()> = Mutex::new(());
    let _one = WRITERS.lock().unwrap_or_else(PoisonError::into_inner);
    let path = crate::workspace().join(PAGE);
    let page = crate::read(PAGE);
    let opening = format!("<!-- values: {name} -->\n\n");
    let (before, rest) =
        page.split_once(&opening).unwrap_or_else(|| panic!("{PAGE}: no section {name}"));
    let (found, after) = rest.split_once("\n<!-- end -->").expect("the end of the section");
    if std::env::var_os("BATWING_BLESS").is_some() {
        let fresh = format!("{before}{opening}{section}\n<!-- end -->{after}");
        std::fs::write(path, fresh).expect("written");
    } else {
        assert!(
            found == section,
            "{PAGE}: stale section {name}: test once with BATWING_BLESS=1; expected\n{section}"
        );
    }
}
