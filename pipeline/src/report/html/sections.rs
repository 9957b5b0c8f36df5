// SPDX-License-Identifier: MIT OR Apache-2.0
//! The parts of the page that are tables of numbers: figures of merit, power ledger, tables used, provenance. They need no script.

use std::fmt::Write as _;

use anyhow::Result;

use super::folder::Folder;
use super::markup::escaped;
use super::models::Model;
use super::orders::Listed;
use super::value::At;
use crate::digits::format_value_with_error;

/// Figures by key, in the order of the paper's tables, and their names for people.
const FIGURES: [(&str, &str); 6] = [
    (PEAK, "peak angle"),
    ("centre_to_peak", "centre / peak"),
    ("uniformity", "uniformity"),
    ("uniformity_diagonal", "uniformity, diagonal"),
    ("illuminance_valley_to_peak", "illuminance valley / peak"),
    ("extraction_efficiency", "extraction"),
];

/// The peak angle, and the same between bins, which stands below it.
const PEAK: &str = "peak_angle_deg";
const PARABOLA: &str = "peak_angle_parabola_deg";

/// Power below which an account of the ledger is left out where it is so in every model.
const NOTHING: f64 = 5e-7;

/// Part of its standard error from which on the bound of a figure's bias is shown.
const SEEN: f64 = 0.1;

/// One figure of a model.
#[derive(Clone, Debug)]
pub struct Figure<'a> {
    /// Name for people.
    pub label: String,
    /// Unit that it is shown in.
    pub unit: &'static str,
    /// Factor from the stored value to the one shown.
    pub scale: f64,
    /// The entry of `results.json`.
    pub at: At<'a>,
    /// Of a peak angle that is the middle of a bin the entry of that between bins.
    between: Option<At<'a>>,
}

/// The figures of a model: those known first, in their order.
///
/// # Errors
/// A model that is no object.
pub fn figures<'a>(model: &Model<'a>) -> Result<Vec<Figure<'a>>> {
    let entries = model.at.entries()?;
    let known = |key: &str| FIGURES.iter().position(|(known, _)| *known == key);
    let mut found: Vec<_> = entries
        .into_iter()
        .filter(|(key, at)| *key != PARABOLA && at.is_estimate())
        .collect();
    found.sort_by_key(|(key, _)| known(key).unwrap_or(FIGURES.len()));
    let figure = |(key, at): (&str, At<'a>)| {
        let (scale, unit) = if key.ends_with("_deg") {
            (1.0, "°")
        } else {
            (100.0, "%")
        };
        let between = (key == PEAK).then(|| model.at.find(PARABOLA)).flatten();
        let label = known(key).map_or_else(|| key.replace('_', " "), |i| FIGURES[i].1.to_owned());
        Figure {
            label,
            unit,
            scale,
            at,
            between,
        }
    };
    Ok(found.into_iter().map(figure).collect())
}

/// Models of one design after the other.
fn by_design<'m, 'a>(models: &'m [Model<'a>]) -> impl Iterator<Item = &'m [Model<'a>]> {
    models.chunk_by(|a, b| a.design == b.design)
}

/// A table of figures for each design.
///
/// # Errors
/// Entries of another layout.
pub fn results(models: &[Model]) -> Result<String> {
    let mut html = String::new();
    for design in by_design(models) {
        let heads = figures(&design[0])?;
        let _ = write!(
            html,
            "<div class=\"scroll\"><table class=\"figures\"><caption>{}</caption><thead><tr><th scope=\"col\">model</th>",
            escaped(design[0].design)
        );
        for head in &heads {
            let _ = write!(
                html,
                "<th scope=\"col\">{} <span class=\"unit\">({})</span></th>",
                escaped(&head.label),
                head.unit
            );
        }
        html.push_str("</tr></thead><tbody>");
        for model in design {
            let own = figures(model)?;
            let _ = write!(
                html,
                "<tr><th scope=\"row\">{}</th>",
                escaped(&model.label())
            );
            for head in &heads {
                let figure = own.iter().find(|figure| figure.label == head.label);
                let cell = figure.map_or_else(|| Ok("–".to_owned()), cell)?;
                let _ = write!(
                    html,
                    "<td data-label=\"{} ({})\">{cell}</td>",
                    escaped(&head.label),
                    head.unit
                );
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>\n");
    }
    Ok(html)
}

fn cell(figure: &Figure) -> Result<String> {
    let e = figure.at.estimate()?;
    let scaled = |x: f64| x * figure.scale;
    let on_axis = figure.at.find("on_axis").map(|at| at.flag()).transpose()?;
    let mut text = if on_axis == Some(true) {
        "<span class=\"value\">none</span><small>maximum on axis</small>".to_owned()
    } else {
        format!(
            "<span class=\"value\">{}</span>",
            format_value_with_error(scaled(e.value), scaled(e.standard_error))
        )
    };
    if let Some(between) = figure.between.as_ref().filter(|_| on_axis != Some(true)) {
        let e = between.estimate()?;
        let _ = write!(
            text,
            "<small class=\"wrap\">by a parabola {}</small>",
            format_value_with_error(e.value, e.standard_error)
        );
    }
    if let Some(published) = figure.at.find("published") {
        let published = published.number()?;
        let _ = write!(
            text,
            "<small>published {}</small>",
            short(scaled(published))
        );
        if on_axis != Some(true) {
            let difference = scaled(e.value - published);
            let decimals = decimals(scaled(e.standard_error));
            let shown = format!("{difference:+.decimals$}").replace('-', "\u{2212}");
            let _ = write!(text, "<small><b>{shown}</b></small>");
        }
    }
    if let Some(bound) = figure.at.find("bias_bound") {
        let bound = bound.number()?;
        if bound > SEEN * e.standard_error {
            let _ = write!(
                text,
                "<small>bias below {}</small>",
                short(two_digits(scaled(bound)))
            );
        }
    }
    let changed = figure.at.find("wavelength_error");
    if let Some(error) = changed.filter(|_| on_axis != Some(true)) {
        let e = error.estimate()?;
        let _ = write!(
            text,
            "<small class=\"wrap\">last wavelengths {}</small>",
            format_value_with_error(scaled(e.value), scaled(e.standard_error))
        );
    }
    Ok(text)
}

/// Decimals that show an error to two digits.
fn decimals(error: f64) -> usize {
    if error > 0.0 {
        (1 - error.log10().floor() as i64).clamp(0, 6) as usize
    } else {
        2
    }
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

/// A number of a table's description; a dash where there is none.
fn optional(entry: &At, key: &str) -> Result<String> {
    match entry.find(key).filter(|at| !at.value().is_null()) {
        Some(at) => Ok(short(at.number()?)),
        None => Ok("–".to_owned()),
    }
}

/// Where the power went, a table for each design.
///
/// # Errors
/// Ledgers of another layout.
pub fn ledger(models: &[Model]) -> Result<String> {
    let mut html = String::new();
    for design in by_design(models) {
        let mut accounts: Vec<&str> = Vec::new();
        for model in design {
            for (account, at) in model.at.get("power_ledger")?.entries()? {
                if at.estimate()?.value.abs() > NOTHING && !accounts.contains(&account) {
                    accounts.push(account);
                }
            }
        }
        accounts.sort_by_key(|account| (account_rank(account), *account));
        let _ = write!(
            html,
            "<div class=\"scroll\"><table class=\"ledger\"><caption>{} <span class=\"unit\">(% of the emitted power)</span></caption><thead><tr><th scope=\"col\">account</th>",
            escaped(design[0].design)
        );
        for model in design {
            let _ = write!(html, "<th scope=\"col\">{}</th>", escaped(&model.label()));
        }
        html.push_str("</tr></thead><tbody>");
        for account in accounts {
            let name = account.replace('_', " ");
            let _ = write!(html, "<tr><th scope=\"row\">{}</th>", escaped(&name));
            for model in design {
                let text = match model.at.get("power_ledger")?.find(account) {
                    Some(at) => {
                        let e = at.estimate()?;
                        format_value_with_error(100.0 * e.value, 100.0 * e.standard_error)
                    }
                    None => "–".to_owned(),
                };
                let _ = write!(
                    html,
                    "<td data-label=\"{}\"><span class=\"value\">{text}</span></td>",
                    escaped(&model.label())
                );
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>\n");
    }
    Ok(html)
}

fn account_rank(account: &str) -> usize {
    const BEGINNINGS: [&str; 5] = [
        "emitted",
        "escaped_",
        "absorbed_by_",
        "absorbed_in_",
        "lost_",
    ];
    let rank = BEGINNINGS.iter().position(|b| account.starts_with(b));
    rank.unwrap_or(BEGINNINGS.len())
}

/// Columns of a design's tables: keys of `results.json` and headings.
const TABLE_COLUMNS: [(&str, &str); 11] = [
    ("band", "band"),
    ("ring", "ring"),
    ("period_um", "period (µm)"),
    ("depth_um", "depth (µm)"),
    ("orders", "highest order"),
    ("slices", "slices"),
    ("ky", "ky"),
    ("estimated_error", "error, orders and slices"),
    ("grid_error", "error, ky"),
    ("kx_error", "error, kx"),
    ("energy_residual", "power balance"),
];

/// Those that tables with a stated number of nodes do not have.
const NOT_ALWAYS: [&str; 2] = ["grid_error", "kx_error"];

/// What each table of diffraction orders says of itself.
///
/// # Errors
/// Descriptions of another layout.
pub fn tables(listed: &Listed) -> Result<String> {
    if listed.entries.is_empty() {
        return Ok("<p>No model here uses tables of diffraction orders.</p>".to_owned());
    }
    let mut html = String::new();
    for design in listed.entries.chunk_by(|a, b| a.0 == b.0) {
        let _ = write!(
            html,
            "<details><summary>{}: the tables one by one</summary><div class=\"scroll\"><table class=\"plain\"><thead><tr>",
            escaped(design[0].0)
        );
        for (_, head) in TABLE_COLUMNS {
            let _ = write!(html, "<th scope=\"col\">{head}</th>");
        }
        html.push_str("</tr></thead><tbody>");
        for (_, _, entry) in design {
            html.push_str("<tr>");
            for (key, _) in TABLE_COLUMNS {
                let text = if NOT_ALWAYS.contains(&key) {
                    optional(entry, key)?
                } else {
                    short(entry.get(key)?.number()?)
                };
                let _ = write!(html, "<td>{text}</td>");
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div></details>\n");
    }
    Ok(html)
}

/// Version, seed, hashes.
///
/// # Errors
/// Entries of another layout.
pub fn provenance(folder: &Folder, models: &[Model]) -> Result<String> {
    let top = folder.results();
    let program = top.get("program")?;
    let quick = top.get("quick")?.flag()?;
    let mut html = String::from("<dl>");
    let mut line = |name: &str, text: &str| {
        let _ = write!(html, "<dt>{name}</dt><dd>{}</dd>", escaped(text));
    };
    let version = format!(
        "{} {}",
        program.get("name")?.text()?,
        program.get("version")?.text()?
    );
    line("computed by", &version);
    line(
        "page written by",
        &format!("batwing {}", env!("CARGO_PKG_VERSION")),
    );
    line(
        "schema of results.json",
        &top.get("schema_version")?.count()?.to_string(),
    );
    line("seed", &top.get("seed")?.count()?.to_string());
    line("kind of run", if quick { "quick" } else { "full" });
    let source = top.get("published_source")?.text()?;
    for model in models {
        let figures = figures(model)?;
        if figures.iter().any(|f| f.at.find("published").is_some()) {
            line("published figures", source);
            break;
        }
    }
    html.push_str("</dl>\n");

    html.push_str("<div class=\"scroll\"><table class=\"plain hashes\"><caption>Files that went in</caption><thead><tr><th scope=\"col\">file</th><th scope=\"col\">SHA-256</th></tr></thead><tbody>");
    for input in top.get("inputs")?.list()? {
        row(
            &mut html,
            input.get("file")?.text()?,
            input.get("sha256")?.text()?,
        );
    }
    html.push_str("</tbody></table></div>\n<div class=\"scroll\"><table class=\"plain names\"><caption>Paths traced</caption><thead><tr><th scope=\"col\">design</th><th scope=\"col\">model</th><th scope=\"col\">paths</th><th scope=\"col\">surfaces met by a path</th></tr></thead><tbody>");
    for model in models {
        let counters = model.at.get("counters")?;
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(model.design),
            escaped(&model.label()),
            thousands(model.at.get("paths")?.count()?),
            short(counters.get("surfaces_per_path")?.number()?)
        );
    }
    let _ = write!(
        html,
        "</tbody></table></div>\n<details><summary>{} files that came out, with their hashes</summary><div class=\"scroll\"><table class=\"plain hashes\"><thead><tr><th scope=\"col\">file</th><th scope=\"col\">SHA-256</th></tr></thead><tbody>",
        folder.files().len()
    );
    for (file, hash) in folder.files() {
        row(&mut html, file, hash);
    }
    html.push_str("</tbody></table></div></details>\n");
    Ok(html)
}

fn row(html: &mut String, file: &str, hash: &str) {
    let _ = write!(
        html,
        "<tr><td>{}</td><td><code>{}</code></td></tr>",
        escaped(file),
        escaped(hash)
    );
}

/// Groups of three digits, apart by narrow spaces.
fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

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
