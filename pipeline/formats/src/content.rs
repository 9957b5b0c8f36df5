// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reading a file of any format that is known: recognised by its content, checked in full.

use std::path::Path;
use std::sync::Arc;

use crate::fields::photometric_text;
use anyhow::{Context, Result, bail};
use bsdf::measured::ScatterTable;
use bsdf::{Bsdf, LobeMotion, MeasuredBsdf, OrderTable, Side, Transport};
use serde_json::{Value, json};
use tracer::Distribution;

use metrics::plural::count;

use super::photometry::{Labels, Photometry};
use super::ray_files::{self, RaySummary};
use super::{READERS, Reads, sniff};
use runtime::bounded_text::{MAX_ROWS, MAX_TABLES, bounded_bytes};
use runtime::progress::warn_once;

/// Largest power above 1 that is rounding of printed values and needs no warning.
const ROUNDING: f64 = 1e-3;

/// Content of a file.
pub enum Content {
    /// Table of diffraction orders.
    Orders(Arc<OrderTable>),
    /// Scattering of a surface.
    Scatter(ScatterFile),
    /// Far field.
    FarField(FarField),
    /// Rays.
    Rays(RaySummary),
}

/// Scattering of a file.
pub struct ScatterFile {
    /// Name of the format.
    pub format: &'static str,
    /// Wavelength that the file states, nm.
    pub wavelength_nm: Option<f64>,
    /// Oddities of a file that can be used.
    pub warnings: Vec<String>,
    pub(super) surface: Surface,
}

/// Tables of one file, each with side and transport.
pub type Tables = Result<Vec<(Side, Transport, ScatterTable)>, bsdf::Error>;
/// Tables for light from a side, between media of indices inner and outer.
type OneSided = dyn Fn(Side, [f64; 2]) -> Tables + Send + Sync;
/// Surface between media of indices inner and outer.
type TwoSided = dyn Fn([f64; 2], LobeMotion) -> Result<MeasuredBsdf, bsdf::Error> + Send + Sync;

/// Scattering of a file as a function of what the file does not say.
pub(super) enum Surface {
    OneSided(Box<OneSided>),
    TwoSided(Box<TwoSided>),
}

impl ScatterFile {
    /// Scattering of a file that does not say from which side its light comes.
    pub fn one_sided(
        format: &'static str,
        tables: impl Fn(Side, [f64; 2]) -> Tables + Send + Sync + 'static,
    ) -> Self {
        let surface = Surface::OneSided(Box::new(tables));
        Self { format, wavelength_nm: None, warnings: Vec::new(), surface }
    }

    /// Scattering of a file that says which side is meant.
    pub fn two_sided(
        format: &'static str,
        surface: impl Fn([f64; 2], LobeMotion) -> Result<MeasuredBsdf, bsdf::Error>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        let surface = Surface::TwoSided(Box::new(surface));
        Self { format, wavelength_nm: None, warnings: Vec::new(), surface }
    }

    /// Tables for light from `side`; `None` where the file says itself which side is meant.
    pub fn tables(&self, side: Side, indices: [f64; 2]) -> Option<Tables> {
        match &self.surface {
            Surface::OneSided(tables) => Some(tables(side, indices)),
            Surface::TwoSided(_) => None,
        }
    }

    /// True where the file does not say from which side its light comes.
    pub fn is_one_sided(&self) -> bool {
        matches!(self.surface, Surface::OneSided(_))
    }

    /// Surface between media of refractive index `indices`, with nothing but what the file gives;
    /// `side` is where the light of a one-sided file comes from.
    ///
    /// # Errors
    /// If its power exceeds 1.
    pub fn given(
        &self,
        indices: [f64; 2],
        between: LobeMotion,
        side: Side,
    ) -> Result<MeasuredBsdf, bsdf::Error> {
        match &self.surface {
            Surface::OneSided(tables) => {
                MeasuredBsdf::new(indices, between, tables(side, indices)?)
            }
            Surface::TwoSided(surface) => surface(indices, between),
        }
    }
}

/// Far field of a file.
pub struct FarField {
    /// Name of the format.
    pub format: &'static str,
    /// Maker and names.
    pub labels: Labels,
    /// Statement of the flux of the lamps.
    pub photometry: Photometry,
    /// Oddities of a file that can be used.
    pub warnings: Vec<String>,
    /// Computes the intensity, cd.
    pub distribution: Box<dyn Fn() -> Result<Distribution, tracer::Error> + Send + Sync>,
}

/// Reads and checks the file at `path`, with its first set of lamps, and prints its warnings.
///
/// # Errors
/// A file that cannot be read, of a format that is not known, or that does not keep to it; the
/// message names the file, the line or offset, what was expected and what stands there.
pub fn read(path: &Path) -> Result<Content> {
    read_lamp_set(path, None)
}

/// The same with set `lamp_set` of the lamps, from 1; `None` is the first.
///
/// # Errors
/// As [`read`]; a set of lamps that the file has not.
pub fn read_lamp_set(path: &Path, lamp_set: Option<usize>) -> Result<Content> {
    let content = parse(path, lamp_set).with_context(|| path.display().to_string())?;
    for warning in content.warnings() {
        warn_once(&format!("{}: {warning}", path.display()));
    }
    Ok(content)
}

fn parse(path: &Path, lamp_set: Option<usize>) -> Result<Content> {
    let reader = sniff::reader(path)?;
    let has_sets = |reads: &Reads| matches!(reads, Reads::LampSets(_));
    if lamp_set.is_some() && !has_sets(&reader.reads) {
        let able = READERS.iter().filter(|reader| has_sets(&reader.reads)).map(|r| r.name);
        let able = able.collect::<Vec<_>>().join(" or ");
        bail!("--lamp-set: expected an {able} file, got {}", reader.name);
    }
    let bytes = || bounded_bytes(path, MAX_TABLES);
    let text = || -> Result<String> { Ok(photometric_text(&bounded_bytes(path, MAX_ROWS)?)?) };
    Ok(match reader.reads {
        Reads::OrdersOfFile(read) => Content::Orders(Arc::new(read(path)?)),
        Reads::Orders(read) => Content::Orders(Arc::new(read(&bytes()?)?)),
        Reads::Scatter(read) => Content::Scatter(read(&bytes()?)?),
        Reads::FarField(read) => Content::FarField(read(&text()?)?),
        Reads::LampSets(read) => Content::FarField(read(&text()?, lamp_set)?),
        Reads::Rays(_) => Content::Rays(ray_files::summary(path)?),
    })
}

/// Prints what is odd about a surface of the files called `name`.
pub(super) fn warn(name: &str, measured: &MeasuredBsdf) {
    for warning in gain(measured).into_iter().chain(one_sided(measured)) {
        warn_once(&format!("{name}: {warning}"));
    }
}

/// A warning where a surface scatters more than it gets.
fn gain(measured: &MeasuredBsdf) -> Option<String> {
    let most = measured.largest_at_node();
    (most > 1.0 + ROUNDING).then(|| {
        format!(
            "light of one incidence adds up to {most:.4} of its power; it is scaled to 1 where it is traced"
        )
    })
}

/// A warning where files know one side alone of a surface, which is or will be completed by
/// reciprocity.
fn one_sided(measured: &MeasuredBsdf) -> Option<String> {
    let derived = measured.derived().or(measured.lacks_transmission());
    let dark = Side::BOTH.into_iter().find(|side| {
        let given = |t: &Transport| measured.table(*side, *t).is_some();
        let own = |t: &Transport| derived != Some(*side) || *t == Transport::Reflection;
        !Transport::BOTH.iter().any(|t| own(t) && given(t))
    });
    match (derived, dark) {
        (Some(side), dark) => {
            let rest = dark.map_or("", |_| "; its reflection is not known and taken as 0");
            Some(format!(
                "transmission of light from the {side} side is not given: it follows by reciprocity from that of light from the {} side{rest}",
                side.opposite()
            ))
        }
        (None, Some(side)) => {
            Some(format!("nothing is given for light from the {side} side: it is absorbed"))
        }
        (None, None) => None,
    }
}

impl Content {
    /// Name of the format.
    pub fn format(&self) -> &'static str {
        match self {
            Self::Orders(_) => "table of diffraction orders",
            Self::Scatter(file) => file.format,
            Self::FarField(file) => file.format,
            Self::Rays(rays) => rays.format,
        }
    }

    /// Oddities of a file that can be used.
    fn warnings(&self) -> &[String] {
        match self {
            // Power above 1 is looked for where scattering becomes a surface.
            Self::Scatter(file) => &file.warnings,
            Self::FarField(file) => &file.warnings,
            Self::Rays(rays) => &rays.warnings,
            Self::Orders(_) => &[],
        }
    }

    /// Scattering as a surface between media of refractive index `indices`
    /// (inner, outer); `side` is where the light of a one-sided file comes from, `name` that
    /// of the file in warnings.
    ///
    /// # Errors
    /// If it holds none, or its power exceeds 1.
    pub fn bsdf(
        &self,
        name: &str,
        indices: [f64; 2],
        between: LobeMotion,
        side: Side,
    ) -> Result<Arc<dyn Bsdf>> {
        if let Self::Orders(table) = self {
            return Ok(Arc::clone(table) as Arc<dyn Bsdf>);
        }
        let measured = self.measured(indices, between, side)?.reciprocal();
        warn(name, &measured);
        Ok(Arc::new(measured))
    }

    /// Scattering as a reflector in air, for light from the outer side.
    ///
    /// # Errors
    /// As [`Content::bsdf`].
    pub fn reflector(&self, name: &str, between: LobeMotion) -> Result<Arc<dyn Bsdf>> {
        if let Self::Orders(table) = self {
            return Ok(Arc::clone(table) as Arc<dyn Bsdf>);
        }
        let measured = self.measured([1.0, 1.0], between, Side::Outer)?;
        if let Some(warning) = gain(&measured) {
            warn_once(&format!("{name}: {warning}"));
        }
        Ok(Arc::new(measured))
    }

    /// True for scattering that turns with the incidence: tables at one azimuth for all. Tables of
    /// orders do not.
    ///
    /// # Errors
    /// As [`Content::bsdf`].
    pub fn is_isotropic(&self, indices: [f64; 2]) -> Result<bool> {
        if matches!(self, Self::Orders(_)) {
            return Ok(false);
        }
        let measured = self.measured(indices, LobeMotion::Fixed, Side::Outer)?;
        let turns = measured.tables().all(|(_, _, r)| r.is_isotropic());
        Ok(turns)
    }

    fn measured(&self, indices: [f64; 2], between: LobeMotion, side: Side) -> Result<MeasuredBsdf> {
        match self {
            Self::Scatter(file) => Ok(file.given(indices, between, side)?),
            _ => bail!("expected scattering of a surface, got {}", self.format()),
        }
    }

    /// Content for programs and for people.
    ///
    /// # Errors
    /// If its power exceeds 1, or it holds nothing that can be used.
    pub fn describe(&self) -> Result<(Value, String)> {
        let (mut value, lines) = match self {
            Self::Orders(table) => {
                let (header, grid) = (table.header(), table.grid());
                (
                    json!({"header": header, "grid": grid, "nodes": table.node_count(), "orders": table.entry_count()}),
                    vec![
                        format!(
                            "design {}, band {}, ring {}",
                            header.design, header.band, header.ring
                        ),
                        format!(
                            "{}, {} in all",
                            count(table.node_count(), "incidence"),
                            count(table.entry_count(), "order")
                        ),
                    ],
                )
            }
            Self::Scatter(file) => file.describe()?,
            Self::FarField(file) => file.describe()?,
            Self::Rays(rays) => rays.describe(),
        };
        value["format"] = self.format().into();
        let mut warnings = value["warnings"].as_array().cloned().unwrap_or_default();
        warnings.extend(self.warnings().iter().cloned().map(Value::from));
        value["warnings"] = warnings.into();
        Ok((value, format!("{}\n  {}", self.format(), lines.join("\n  "))))
    }
}

impl ScatterFile {
    fn describe(&self) -> Result<(Value, Vec<String>)> {
        // Between equal media, so that no incidence of the file is left out.
        let measured = self.given([1.0, 1.0], LobeMotion::Fixed, Side::Outer)?;
        let (mut lines, mut tables) = (Vec::new(), Vec::new());
        for (side, transport, table) in measured.tables() {
            let incidences = table.incidences();
            let totals: Vec<f64> = incidences.iter().map(|wi| table.total(*wi)).collect();
            let low = totals.iter().copied().fold(f64::INFINITY, f64::min);
            let high = totals.iter().copied().fold(0.0, f64::max);
            let kind = if transport == Transport::Reflection { "reflected" } else { "transmitted" };
            let from = if self.is_one_sided() {
                "one side".to_owned()
            } else {
                format!("the {side} side")
            };
            lines.push(format!(
                "light from {from}, {kind}: {}, {low:.6} to {high:.6} of the power",
                count(incidences.len(), "incidence")
            ));
            tables.push(json!({"from": from, "transport": kind, "incidences": incidences.len(), "least": low, "most": high}));
        }
        let most = measured.largest_power();
        let one_sided = match (self.is_one_sided(), measured.lacks_transmission()) {
            (false, _) => one_sided(&measured),
            // What such a file does not say may lie in another.
            (true, Some(_)) => Some(
                "transmission of light from the other side follows by reciprocity where no other file gives it"
                    .to_owned(),
            ),
            (true, None) => None,
        };
        let warnings: Vec<String> = gain(&measured).into_iter().chain(one_sided).collect();
        lines.extend(warnings.iter().map(|w| format!("warning: {w}")));
        lines.push(format!("most power from one incidence: {most:.6}"));
        let factors = measured.factors();
        if let Some([low, high]) = factors {
            lines.push(format!(
                "values times {low:.4} to {high:.4}, so that they integrate to the powers that the file states"
            ));
        }
        Ok((
            json!({"tables": tables, "most_power": most, "scaled_by": factors, "warnings": warnings}),
            lines,
        ))
    }
}

impl FarField {
    fn describe(&self) -> Result<(Value, Vec<String>)> {
        let table = (self.distribution)()?;
        let Photometry { lumens, absolute, watts } = self.photometry;
        let watts = Some(watts).filter(|watts| *watts > 0.0);
        let (polar, azimuths) = (table.thetas_deg().len(), table.phis_deg().len());
        let flux = table.flux();
        let kind = if absolute { "absolute" } else { "relative" };
        let mut lines = vec![
            format!(
                "{kind} photometry, {}, {}",
                count(polar, "polar angle"),
                count(azimuths, "plane")
            ),
            match watts {
                Some(watts) => format!("flux {flux:.4} lm, power {watts} W"),
                None => format!("flux {flux:.4} lm, power not stated"),
            },
        ];
        let mut value = json!({"photometry": kind, "polar_angles": polar, "planes": azimuths, "flux_lm": flux, "power_w": watts});
        if !absolute {
            lines.push(format!("lamps {lumens} lm, light output ratio {:.4}", flux / lumens));
            value["lamps_lm"] = lumens.into();
            value["light_output_ratio"] = (flux / lumens).into();
        }
        Ok((value, lines))
    }
}
