// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reading a file of any format that is known: recognised by its content, checked in full.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use bsdf::formats::text::utf8;
use bsdf::formats::{lighttools, order_json, speos, window, zemax};
use bsdf::{Bsdf, LobeMotion, MeasuredBsdf, OrderTable, Side, convert};
use serde_json::{Value, json};
use tracer::Distribution;
use tracer::formats::{eulumdat, ies, photometric_text};

use metrics::plural::count;

use super::npz;
use super::ray_files::{self, RaySummary};
use super::sniff::{self, Kind};
use crate::cache::read_table;
use crate::progress::warn_once;

/// Largest power above 1 that is rounding of printed values and needs no warning.
const ROUNDING: f64 = 1e-3;

/// What a file holds.
pub enum Content {
    /// A table of diffraction orders, native, JSON or `.npz`.
    Orders(Arc<OrderTable>),
    /// Zemax tabular BSDF.
    Zemax(zemax::ZemaxBsdf),
    /// LightTools BSDF text.
    LightTools(lighttools::LightToolsBsdf),
    /// WINDOW and Radiance XML.
    Window(window::WindowBsdf),
    /// IES LM-63.
    Ies(ies::Ies),
    /// EULUMDAT.
    Ldt(Box<eulumdat::Ldt>),
    /// Speos BSDF.
    Speos(speos::SpeosBsdf),
    /// Rays of any format.
    Rays(RaySummary),
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
    for warning in content.warnings(lamp_set) {
        warn_once(&format!("{}: {warning}", path.display()));
    }
    Ok(content)
}

fn open(path: &Path) -> Result<File> {
    File::open(path).context("expected a table, a far field, rays or scattering, cannot open it")
}

fn bytes(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes).context("cannot read")?;
    Ok(bytes)
}

fn parse(path: &Path, lamp_set: Option<usize>) -> Result<Content> {
    let kind = sniff::kind(path)?;
    ensure!(
        lamp_set.is_none() || kind == Kind::Ldt,
        "--lamp-set: expected an EULUMDAT file, got {}",
        kind.name()
    );
    let text = || -> Result<String> { Ok(utf8(&bytes(path)?)?.to_owned()) };
    let photometric = || -> Result<String> { Ok(photometric_text(&bytes(path)?)?) };
    Ok(match kind {
        Kind::Orders => Content::Orders(Arc::new(read_table(path)?)),
        Kind::OrdersNpz => Content::Orders(Arc::new(npz::read(BufReader::new(open(path)?))?)),
        Kind::OrdersJson => Content::Orders(Arc::new(order_json::read(&text()?)?)),
        Kind::Window => Content::Window(window::read(&text()?)?),
        Kind::Zemax => Content::Zemax(zemax::read(&text()?)?),
        Kind::LightTools => Content::LightTools(lighttools::read(&text()?)?),
        Kind::Speos => Content::Speos(speos::read(&bytes(path)?)?),
        Kind::Ies => Content::Ies(ies::read(&photometric()?)?),
        Kind::Ldt => {
            let ldt = eulumdat::read_lamp_set(&photometric()?, lamp_set.unwrap_or(1))?;
            Content::Ldt(Box::new(ldt))
        }
        Kind::Tm25 | Kind::LightToolsRays | Kind::SpeosRays | Kind::ZemaxRays => {
            Content::Rays(ray_files::summary(path)?)
        }
    })
}

/// A warning where a surface scatters more than it gets.
pub fn gain(measured: &MeasuredBsdf) -> Option<String> {
    let most = measured.largest_at_node();
    (most > 1.0 + ROUNDING).then(|| {
        format!(
            "light of one incidence adds up to {most:.4} of its power; it is scaled to 1 where it is traced"
        )
    })
}

impl Content {
    /// Name of the format.
    pub fn format(&self) -> &'static str {
        match self {
            Self::Orders(_) => "table of diffraction orders",
            Self::Zemax(_) => "Zemax tabular BSDF",
            Self::LightTools(_) => "LightTools BSDF",
            Self::Window(_) => "WINDOW/Radiance BSDF XML",
            Self::Speos(_) => "Speos BSDF",
            Self::Ies(_) => "IES LM-63",
            Self::Ldt(_) => "EULUMDAT",
            Self::Rays(rays) => rays.format,
        }
    }

    /// What is odd in the file, though it can be used; `lamp_set` is the set of lamps asked for.
    fn warnings(&self, lamp_set: Option<usize>) -> Vec<String> {
        match self {
            Self::Ies(file) => file.warnings.clone(),
            Self::Ldt(file) => {
                let several = (file.lamp_sets > 1 && lamp_set.is_none()).then(|| {
                    format!(
                        "{} sets of lamps, the first is taken; `batwing import --lamp-set N` takes another",
                        file.lamp_sets
                    )
                });
                file.warnings.iter().cloned().chain(several).collect()
            }
            Self::Rays(rays) => rays.warnings.clone(),
            Self::Speos(file) => file.warnings.clone(),
            // Scattering is looked at where it becomes a surface.
            Self::Zemax(_) | Self::LightTools(_) | Self::Window(_) | Self::Orders(_) => Vec::new(),
        }
    }

    /// The scattering that it holds, as a surface between media of refractive index `indices`
    /// (inner, outer); `side` is where the light of a Zemax or Speos file comes from, `name` that
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
        let measured = self.measured(indices, between, side)?;
        if let Some(warning) = gain(&measured) {
            warn_once(&format!("{name}: {warning}"));
        }
        Ok(Arc::new(measured))
    }

    /// Whether scattering turns with the incidence: tables at one azimuth for all. Tables of orders
    /// do not.
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
        Ok(match self {
            Self::Zemax(file) => convert::from_zemax(&[(side, file)], indices, between)?,
            Self::LightTools(file) => convert::from_lighttools(file, indices, between)?,
            Self::Window(file) => convert::from_window(file, indices, between)?,
            Self::Speos(file) => convert::from_speos(&[(side, file)], indices, between)?,
            _ => bail!("expected scattering of a surface, got {}", self.format()),
        })
    }

    /// The intensity that it holds, cd.
    ///
    /// # Errors
    /// If it holds none.
    pub fn distribution(&self) -> Result<Distribution> {
        Ok(match self {
            Self::Ies(file) => file.distribution()?,
            Self::Ldt(file) => file.distribution()?,
            _ => bail!("expected a far field, got {}", self.format()),
        })
    }

    /// What it holds, for programs and for people; `lamp_set` is the set of lamps asked for.
    ///
    /// # Errors
    /// If its power exceeds 1, or it holds nothing that can be used.
    pub fn describe(&self, lamp_set: Option<usize>) -> Result<(Value, String)> {
        let (value, lines) = match self {
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
            Self::Zemax(_) | Self::LightTools(_) | Self::Window(_) | Self::Speos(_) => {
                self.describe_scatter()?
            }
            Self::Ies(_) | Self::Ldt(_) => self.describe_far_field()?,
            Self::Rays(rays) => rays.describe(),
        };
        let mut value = value;
        value["format"] = self.format().into();
        let mut warnings = value["warnings"].as_array().cloned().unwrap_or_default();
        warnings.extend(self.warnings(lamp_set).into_iter().map(Value::from));
        value["warnings"] = warnings.into();
        Ok((value, format!("{}\n  {}", self.format(), lines.join("\n  "))))
    }

    fn describe_scatter(&self) -> Result<(Value, Vec<String>)> {
        // Between equal media, so that no incidence of the file is left out.
        let measured = self.measured([1.0, 1.0], LobeMotion::Fixed, Side::Outer)?;
        let (mut lines, mut tables) = (Vec::new(), Vec::new());
        for (side, transport, table) in measured.tables() {
            let incidences = table.incidences();
            let totals: Vec<f64> = incidences.iter().map(|wi| table.total(*wi)).collect();
            let low = totals.iter().copied().fold(f64::INFINITY, f64::min);
            let high = totals.iter().copied().fold(0.0, f64::max);
            let kind =
                if transport == bsdf::Transport::Reflection { "reflected" } else { "transmitted" };
            let from = if matches!(self, Self::Zemax(_) | Self::Speos(_)) {
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
        let warnings: Vec<String> = gain(&measured).into_iter().collect();
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

    fn describe_far_field(&self) -> Result<(Value, Vec<String>)> {
        let table = self.distribution()?;
        let (absolute, lumens, watts) = match self {
            Self::Ies(file) => {
                let lumens = file.lumens_per_lamp * file.lamps as f64;
                (file.is_absolute(), lumens, file.watts)
            }
            Self::Ldt(file) => (file.is_absolute(), file.flux, file.watts),
            _ => bail!("expected a far field"),
        };
        let (polar, azimuths) = (table.thetas_deg().len(), table.phis_deg().len());
        let flux = table.flux();
        let kind = if absolute { "absolute" } else { "relative" };
        let mut lines = vec![
            format!(
                "{kind} photometry, {}, {}",
                count(polar, "polar angle"),
                count(azimuths, "plane")
            ),
            format!("flux {flux:.4} lm, power {watts} W"),
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
