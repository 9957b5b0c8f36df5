// SPDX-License-Identifier: MIT OR Apache-2.0
//! The pictures of the page: those of [`plots`](crate::plots), as SVG images within it.
//!
//! Of what a control chooses between, every picture is there; the page's script shows one of them
//! and hides curves of models that are switched off.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use metrics::figures::PEAK_ANGLE;
use minijinja::HtmlEscape;
use serde_json::{Value, json};

use metrics::Estimate;
use metrics::quantity::{Curve, Quantity, Unit};
use results::schema::LobesEntry;

use super::models::{Contents, FarFieldTable, Model};
use super::orders::Listed;
use super::tables;
use crate::convergence_study::ConvergenceStudy;
use crate::plots::{
    Colour, ErrorCurve, FarField, Heading, LineColours, Picture, Refinement, ShareBar, convergence,
    far_field_cartesian, far_field_polar, grating_lobes, palette, published_vs_computed,
    share_bars,
};

/// Points of a curve over 90° that the page draws; more would only make it longer.
const MAX_POINTS: usize = 360;

/// End of the names of files of `batwing converge`.
const ENDING: &str = "-convergence.json";
/// Folders under the results that are looked into: itself, and the default of `batwing converge`.
const FOLDERS: [&str; 2] = ["", "convergence"];

/// An error of a table by the name of its cause.
type NamedError = (&'static str, fn(&Listed) -> f64);

/// Collects pictures, whose parts have names of their own in the page.
#[derive(Debug, Default)]
pub struct Album {
    count: usize,
}

impl Album {
    /// A picture with its caption, which also describes it to those who cannot see it. It is shown by
    /// `choice` and, if `shown`, before any choice.
    pub(super) fn add(
        &mut self,
        picture: &Picture,
        caption: &str,
        choice: &Value,
        shown: bool,
    ) -> Value {
        self.count += 1;
        let svg = within_page(picture, caption, &self.count.to_string());
        json!({"svg": svg, "caption": caption, "choice": choice, "hidden": !shown})
    }

    /// A picture that is always shown.
    pub(super) fn fixed(&mut self, picture: &Picture, caption: &str) -> Value {
        self.add(picture, caption, &json!({}), true)
    }

    /// Figures of merit, computed and published.
    ///
    /// # Errors
    /// Rows that cannot be drawn.
    pub fn merit(&mut self, models: &[Model]) -> Result<Option<Value>> {
        let mut rows = tables::rows(models);
        let compared = rows.iter().any(|row| row.published.is_some());
        let mut quantities: Vec<String> = rows.iter().map(|row| row.quantity.clone()).collect();
        quantities.sort();
        quantities.dedup();
        // More are in the tables only.
        quantities.truncate(6);
        rows.retain(|row| quantities.contains(&row.quantity));
        if rows.iter().all(|row| row.published.is_none() && row.resolved().is_none()) {
            return Ok(None);
        }
        let (title, caption) = if compared {
            (
                "Published and computed",
                "Computed figures of merit (dot, bar of two standard errors to each side) and published ones (diamond). Bars shorter than the dot do not show.",
            )
        } else {
            (
                "Figures of merit",
                "Computed figures of merit, with bars of two standard errors to each side.",
            )
        };
        let picture = published_vs_computed(&Heading::new(title, designs(models)), &rows)?;
        Ok(Some(self.fixed(&picture, caption)))
    }

    /// Far fields: straight and polar, by design, cut, scale and range of angles.
    ///
    /// # Errors
    /// Curves that cannot be drawn.
    pub fn far_fields(&mut self, of: Contents) -> Result<[Vec<Value>; 2]> {
        let (mut straight, mut polar) = (Vec::new(), Vec::new());
        let all: Vec<(&Model, &FarFieldTable)> = of.models.iter().zip(of.fields).collect();
        for design in all.chunk_by(|a, b| a.0.design == b.0.design) {
            let name = design[0].0.design;
            for cut in cuts(of.fields) {
                for (scale, words) in [("absolute", ""), ("relative", ", each to its maximum")] {
                    let mut chosen = Chosen::default();
                    for (model, field) in design {
                        let Some(curve) = field.curve(&cut) else {
                            continue;
                        };
                        let opposite = field.opposite(&cut);
                        let most = opposite.map_or(0.0, Curve::maximum).max(curve.maximum());
                        let scaled = |curve: &Curve| match scale {
                            "relative" if most > 0.0 => curve.relative_to(most),
                            _ => Ok(curve.clone()),
                        };
                        let opposite = opposite.map(scaled).transpose()?;
                        let number = palette::model_number(model.key).unwrap_or(0);
                        chosen.add(model, &scaled(curve)?, opposite.as_ref(), number)?;
                    }
                    if chosen.whole.is_empty() {
                        continue;
                    }
                    let quantity = match (scale, design[0].1.unit) {
                        ("relative", _) => Quantity::new("share of the maximum", Unit::Fraction),
                        (_, Unit::Candela) => Quantity::new("luminous intensity", Unit::Candela),
                        (_, unit) => Quantity::new("intensity", unit),
                    };
                    let left = design[0].1.opposite(&cut);
                    let left = left.map_or(String::new(), |c| format!(", left {}", c.label()));
                    let subtitle = format!("{name}, {cut}{left}{words}");
                    let heading = Heading::new("Far field", &subtitle);
                    let field = |curves, peaks| FarField {
                        heading: &heading,
                        quantity: &quantity,
                        curves,
                        colours: LineColours::Models,
                        numbers: &chosen.numbers,
                        peaks,
                    };
                    let first = straight.is_empty();
                    for (reach, curves) in [("90", &chosen.upper), ("180", &chosen.whole)] {
                        let picture = far_field_cartesian(&field(curves, &chosen.peaks))?;
                        let keys =
                            json!({"design": name, "cut": cut, "scale": scale, "reach": reach});
                        let shown = first && reach == "90";
                        straight.push(self.add(
                            &picture,
                            &format!("Far field of {subtitle}."),
                            &keys,
                            shown,
                        ));
                    }
                    let picture = far_field_polar(&field(&chosen.upper, &[]))?;
                    let keys = json!({"design": name, "cut": cut, "scale": scale});
                    let caption = format!(
                        "Far field of {subtitle}, over the angle; 0° is the axis of the package."
                    );
                    polar.push(self.add(&picture, &caption, &keys, first));
                }
            }
        }
        Ok([straight, polar])
    }

    /// Power that does not escape upwards; none where all does.
    ///
    /// # Errors
    /// None.
    pub fn losses(&mut self, models: &[Model]) -> Result<Option<Value>> {
        let lost = |name: &String| {
            let begins = ["absorbed_", "lost_", "escaped_down"];
            begins.iter().any(|begin| name.starts_with(begin))
        };
        let mut accounts: Vec<String> = tables::accounts(models).into_iter().filter(lost).collect();
        accounts.sort_by_key(|account| palette::fate_of_account(account));
        if accounts.is_empty() {
            return Ok(None);
        }
        let bar = |model: &Model| {
            let all = &model.entry.power_ledger.accounts;
            let share = |account: &String| {
                let found = all.iter().find(|(name, _)| name == account);
                found.map_or(Estimate::new(0.0, 0.0), |(_, share)| share.estimate())
            };
            ShareBar {
                label: format!("{}, {}", model.design, model.label()),
                shares: accounts.iter().map(share).collect(),
            }
        };
        let bars: Vec<ShareBar> = models.iter().map(bar).collect();
        let part = |name: &String| (name.replace('_', " "), account_colour(name, &accounts));
        let names: Vec<(String, Colour)> = accounts.iter().map(part).collect();
        let heading = Heading::new("Power that does not escape upwards", designs(models));
        let picture = share_bars(&heading, "share of the emitted power", &names, &bars)?;
        let caption = "Shares of the emitted power that do not escape upwards; the rest does. The numbers stand in the tables below.";
        Ok(Some(self.fixed(&picture, caption)))
    }

    /// Errors that the tables of orders state of themselves, a column for each design.
    ///
    /// # Errors
    /// Errors that cannot be drawn.
    pub fn table_errors(&mut self, listed: &[Listed]) -> Result<Option<Value>> {
        let kinds: [NamedError; 3] = [
            ("orders and slices", |t| t.entry.estimated_error),
            ("ky", |t| t.entry.grid_error.unwrap_or(0.0)),
            ("power balance", |t| t.entry.energy_residual),
        ];
        let mut kinds = kinds.to_vec();
        kinds.retain(|(_, error)| listed.iter().any(|t| error(t) > 0.0));
        if kinds.is_empty() {
            return Ok(None);
        }
        let of_design = |tables: &[Listed]| Refinement {
            what: "band, from the axis outwards".to_owned(),
            title: tables[0].design.to_owned(),
            at: tables.iter().map(|t| t.entry.band as f64).collect(),
            logarithmic: false,
            curves: kinds
                .iter()
                .map(|(label, error)| ErrorCurve {
                    label: (*label).to_owned(),
                    errors: tables.iter().map(error).collect(),
                })
                .collect(),
            cost: Vec::new(),
        };
        let designs = listed.chunk_by(|a, b| a.design == b.design);
        let columns: Vec<Refinement> = designs.map(of_design).collect();
        let heading = Heading::new("Estimated errors of the tables", "as each table states them");
        let picture = convergence(&heading, &columns, None, "")?;
        let caption = "Estimated errors of the tables of orders by band: orders and slices, interpolation in ky, power balance.";
        Ok(Some(self.fixed(&picture, caption)))
    }

    /// Every study of convergence in the folder, by name.
    ///
    /// # Errors
    /// A file that cannot be read or is of another layout.
    pub fn studies(&mut self, results: &Path) -> Result<Vec<Value>> {
        let mut all = Vec::new();
        for folder in FOLDERS.map(|f| results.join(f)) {
            let Ok(entries) = std::fs::read_dir(&folder) else {
                continue;
            };
            let mut paths: Vec<PathBuf> = entries
                .filter_map(|entry| entry.ok().map(|e| e.path()))
                .filter(|p| p.to_string_lossy().ends_with(ENDING))
                .collect();
            paths.sort();
            for path in paths {
                let study = ConvergenceStudy::read(&path)?;
                let picture = study.picture().with_context(|| format!("`{}`", path.display()))?;
                all.extend(picture.map(|picture| self.fixed(&picture, &study.caption())));
            }
        }
        Ok(all)
    }

    /// Figure 6 of the paper: one ring by rays and by waves.
    ///
    /// # Errors
    /// Lobes that cannot be drawn.
    pub fn lobes(&mut self, figure: &LobesEntry) -> Result<Value> {
        let subtitle = format!(
            "band {}, ring {}, normal incidence from the silicone",
            figure.band, figure.ring
        );
        let heading = Heading::new("Figure 6: rays and waves", &subtitle);
        let picture = grating_lobes(&heading, &figure.rays, &figure.rcwa)?;
        let caption = format!("Figure 6: {subtitle}, by rays and by RCWA.");
        Ok(self.fixed(&picture, &caption))
    }
}

/// The colour of an account's fate; accounts of one fate grow lighter.
fn account_colour(name: &str, accounts: &[String]) -> Colour {
    let fate = |name: &str| palette::fate_of_account(name);
    let before = accounts.iter().take_while(|other| *other != name);
    let same = before.filter(|other| fate(other) == fate(name)).count();
    palette::fate(fate(name)).with_opacity(0.75f64.powi(same as i32))
}

/// The picture as a part of a page: its parts have names of their own by `name`, and its caption
/// describes it to those who cannot see it.
pub fn within_page(picture: &Picture, caption: &str, name: &str) -> String {
    let clip = format!("p{name}clip");
    let described = format!("<svg role=\"img\" aria-label=\"{}\" ", HtmlEscape(caption));
    picture
        .svg()
        .replace("<clipPath id=\"clip", &format!("<clipPath id=\"{clip}"))
        .replace("url(#clip", &format!("url(#{clip}"))
        .replacen("<svg ", &described, 1)
}

/// Names of the curves of far fields.
pub fn cuts(fields: &[FarFieldTable]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let is_left = |curve: &&Curve| {
        fields.iter().any(|field| {
            field.curves.iter().any(|other| {
                field.opposite(other.label()).is_some_and(|left| left.label() == curve.label())
            })
        })
    };
    let all = fields.iter().flat_map(|field| &field.curves);
    for curve in all.filter(|curve| !is_left(curve)) {
        if names.iter().all(|name| name != curve.label()) {
            names.push(curve.label().to_owned());
        }
    }
    names
}

/// Names of designs, each once.
pub fn designs(models: &[Model]) -> String {
    let mut names: Vec<&str> = models.iter().map(|m| m.design).collect();
    names.dedup();
    names.join(", ")
}

/// Curves of one picture of far fields.
#[derive(Default)]
struct Chosen {
    /// From 0 to 180°.
    whole: Vec<Curve>,
    /// The upper half-space, both half-planes.
    upper: Vec<Curve>,
    numbers: Vec<usize>,
    /// Published peak angles.
    peaks: Vec<(usize, f64)>,
}

impl Chosen {
    /// Adds a curve, and the one in the opposite half-plane where it is another.
    fn add(
        &mut self,
        model: &Model,
        curve: &Curve,
        opposite: Option<&Curve>,
        number: usize,
    ) -> Result<()> {
        let upper = curve.x().iter().filter(|theta| **theta <= 90.0).count();
        let named = |curve: &Curve, count: usize, most: usize| {
            let [x, value, error] = [curve.x(), curve.value(), curve.standard_error()];
            let cut = |list: &[f64]| list[..count].to_vec();
            Curve::new(model.label(), cut(x), cut(value), cut(error))?.thinned(most)
        };
        let published = model.entry.figures.get(PEAK_ANGLE.key).and_then(|peak| peak.reference);
        self.peaks.extend(published.map(|angle| (self.whole.len(), angle)));
        let right = named(curve, upper, MAX_POINTS)?;
        let left = opposite.map_or(Ok(right.clone()), |left| named(left, upper, MAX_POINTS))?;
        self.upper.push(right.beside(&left)?);
        let all = curve.x().len();
        let whole = named(curve, all, 2 * MAX_POINTS)?;
        self.whole.push(match opposite {
            Some(left) => whole.beside(&named(left, all, 2 * MAX_POINTS)?)?,
            None => whole,
        });
        self.numbers.push(number);
        Ok(())
    }
}
