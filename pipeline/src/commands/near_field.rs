// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing near-field`: the near field of one ring as pictures, EXR image and JSON.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use num_complex::Complex64;
use rcwa::field::Sample;
use rcwa::guard::MAX_SLICES;
use rcwa::{Pol, Side, Truncation};
use serde_json::{Value, json};

use arrays::exr::{Channel, write_channels};
use design::Design;
use geometry::Cell;
use metrics::plural::count;
use metrics::quantity::{Map, Quantity, Unit};
use report::plots::{Heading, NearFieldMap, near_field_map};
use runtime::atomic_file;
use runtime::run_context::RunContext;
use simulate::{cells, scene_check};

use super::arguments::{IncidentSide, finite, whole};
use super::outputs::writable;
use gratings::near_field::{IncidentWave, NearField, NearFieldSettings, near_field};

/// Polarisations (`docs/explanation/conventions.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IncidentPol {
    /// E across the plane of incidence.
    S,
    /// H across it.
    P,
}

/// `batwing near-field`.
#[derive(Debug, Args)]
pub struct NearFieldArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Ring, from 1
    #[arg(long, value_name = "N")]
    pub ring: usize,
    /// Side that the light comes from
    #[arg(long, value_enum, default_value = "inner")]
    pub side: IncidentSide,
    /// Angle to the normal of the ring's chord, above -90 and below 90
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = polar_angle)]
    pub theta_deg: f64,
    /// Azimuth from the meridian
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite)]
    pub phi_deg: f64,
    /// Polarisation
    #[arg(long, value_enum, default_value = "s")]
    pub pol: IncidentPol,
    /// Periods to show
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=20_u8))]
    pub periods: u8,
    /// Depth of view into both half-spaces, in µm [default: two wavelengths or a quarter of the
    /// height of the relief]
    #[arg(long, value_name = "UM", value_parser = finite)]
    pub margin_um: Option<f64>,
    /// Highest order to keep [default: 1.5 times the highest that propagates]
    #[arg(long, value_name = "M", value_parser = whole(0..=Truncation::MAX))]
    pub orders: Option<usize>,
    /// Slices of the relief [default: 24 to a wavelength]
    #[arg(long, value_name = "N", value_parser = whole(1..=MAX_SLICES))]
    pub slices: Option<usize>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "fields")]
    pub out: PathBuf,
}

/// Computes the field and writes it.
pub fn run(arguments: &NearFieldArgs, context: RunContext) -> Result<()> {
    let design = scene_check::load(&arguments.design)?;
    let of_file = || arguments.design.display().to_string();
    let cell = cells::ring(&design, arguments.ring).with_context(of_file)?;
    let wave = IncidentWave {
        side: match arguments.side {
            IncidentSide::Inner => Side::Top,
            IncidentSide::Outer => Side::Bottom,
        },
        theta_deg: arguments.theta_deg,
        phi_deg: arguments.phi_deg,
        pol: match arguments.pol {
            IncidentPol::S => Pol::S,
            IncidentPol::P => Pol::P,
        },
    };
    let settings = NearFieldSettings {
        periods: usize::from(arguments.periods),
        margin_um: arguments.margin_um,
        orders: arguments.orders,
        slices: arguments.slices,
    };
    writable(&arguments.out)?;
    let field = near_field(&cell, design.wavelength_nm * 1e-3, &wave, &settings, context)?;

    let stem = format!(
        "{}-ring-{:03}-field-{}-{}-theta{}-phi{}",
        design.name,
        arguments.ring,
        side_name(wave.side),
        pol_name(wave.pol),
        wave.theta_deg,
        wave.phi_deg
    );
    let path = |ending: &str| arguments.out.join(format!("{stem}{ending}"));
    let output = NearFieldOutput {
        poynting: field.poynting(),
        field: &field,
        design: &design,
        cell: &cell,
        wave,
    };
    output.pictures(&path)?;
    let json = output.describe();
    let axes = [&field.z, &field.x];
    write_channels(&path(".exr"), axes, &output.channels(), &json)?;
    atomic_file::write_json(&path(".json"), &json)?;
    context.console.result(&json, || {
        format!(
            "R = {:.6}, T = {:.6}, R + T - 1 = {:.0e}\norders -{m}..{m}, {}, {} x {} points\nwritten to {}",
            field.field.reflected,
            field.field.transmitted,
            field.energy_residual(),
            count(field.slices, "slice"),
            field.x.bins(),
            field.z.bins(),
            arguments.out.join(stem.clone() + ".*").display(),
            m = field.orders,
        )
    })
}

/// A parser of angles to the normal.
fn polar_angle(text: &str) -> Result<f64, String> {
    let angle = finite(text).ok().filter(|v| v.abs() < 90.0);
    angle.ok_or_else(|| "expected an angle above -90 and below 90 degrees".to_owned())
}

fn side_name(side: Side) -> &'static str {
    match side {
        Side::Top => "inner",
        Side::Bottom => "outer",
    }
}

/// The medium around the dome in words, by its index.
fn around(index: f64) -> &'static str {
    if (index - 1.0).abs() < 1e-12 { "air" } else { "solid around the dome" }
}

fn pol_name(pol: Pol) -> &'static str {
    match pol {
        Pol::S => "s",
        Pol::P => "p",
    }
}

/// A near field and what it is of.
struct NearFieldOutput<'a> {
    field: &'a NearField,
    poynting: Vec<[f64; 3]>,
    design: &'a Design,
    cell: &'a Cell,
    wave: IncidentWave,
}

impl NearFieldOutput<'_> {
    fn describe(&self) -> Value {
        let (found, design, cell, wave) = (self.field, self.design, self.cell, self.wave);
        json!({
            "design": design.name,
            "ring": cell.ring,
            "period_um": cell.period_um,
            "depth_um": cell.depth_um,
            "wavelength_um": design.wavelength_nm * 1e-3,
            "incident": {
                "side": side_name(wave.side),
                "index": found.incident_index,
                "theta_deg": wave.theta_deg,
                "phi_deg": wave.phi_deg,
                "pol": pol_name(wave.pol),
                "kx": found.bloch.kx0,
                "ky": found.bloch.ky,
            },
            "orders": found.orders,
            "slices": found.slices,
            "R": found.field.reflected,
            "T": found.field.transmitted,
            "energy_residual": found.energy_residual(),
            "flux_residual": found.flux_residual(),
            "largest_intensity": found.intensity().into_iter().fold(0.0, f64::max),
            "x_um": found.x.range(),
            "z_um": found.z.range(),
            "points": [found.x.bins(), found.z.bins()],
        })
    }

    /// The channels of the EXR image.
    fn channels(&self) -> Vec<Channel> {
        const AMPLITUDE: &str = "incident amplitude";
        const MAGNETIC: &str = "incident amplitude / impedance of free space";
        const FLOW: &str = "incident Poynting vector";
        type Vector = fn(&Sample) -> [Complex64; 3];
        let samples = &self.field.field.samples;
        let channel =
            |name, quantity, unit, values: Vec<f64>| Channel { name, quantity, unit, values };
        let flow = |i: usize| self.poynting.iter().map(|s| s[i]).collect();
        let mut list = vec![
            channel("intensity", "|E|^2", "incident |E|^2", self.field.intensity()),
            channel("poynting_x", "time average of Sx", FLOW, flow(0)),
            channel("poynting_y", "time average of Sy", FLOW, flow(1)),
            channel("poynting_z", "time average of Sz", FLOW, flow(2)),
            channel("index", "refractive index", "1", samples.iter().map(|s| s.index.re).collect()),
        ];
        let electric: Vector = |s| s.electric;
        let magnetic: Vector = |s| s.magnetic;
        for (vector, names, [real, imaginary], unit) in [
            (
                electric,
                [["ex_re", "ex_im"], ["ey_re", "ey_im"], ["ez_re", "ez_im"]],
                ["real part of a component of E", "imaginary part of a component of E"],
                AMPLITUDE,
            ),
            (
                magnetic,
                [["hx_re", "hx_im"], ["hy_re", "hy_im"], ["hz_re", "hz_im"]],
                ["real part of a component of H", "imaginary part of a component of H"],
                MAGNETIC,
            ),
        ] {
            for (i, [re, im]) in names.into_iter().enumerate() {
                let part =
                    |of: fn(Complex64) -> f64| samples.iter().map(|s| of(vector(s)[i])).collect();
                list.push(channel(re, real, unit, part(|z| z.re)));
                list.push(channel(im, imaginary, unit, part(|z| z.im)));
            }
        }
        list
    }

    /// Writes the pictures of intensity and flow of power.
    fn pictures(&self, path: &dyn Fn(&str) -> PathBuf) -> Result<()> {
        let (found, design, cell, wave) = (self.field, self.design, self.cell, self.wave);
        let from = match wave.side {
            Side::Top => "from the silicone, below".to_owned(),
            Side::Bottom => format!("from the {}, above", around(cell.background_index)),
        };
        let wave = format!(
            "{} nm, {}-polarised, {from}, at θ = {}°, φ = {}°; R = {:.2} %, T = {:.2} %",
            design.wavelength_nm,
            pol_name(wave.pol),
            wave.theta_deg,
            wave.phi_deg,
            100.0 * found.field.reflected,
            100.0 * found.field.transmitted
        );
        let media = [
            format!("silicone, n = {}", cell.inner_index),
            format!("{}, n = {}", around(cell.background_index), cell.background_index),
        ];
        // The outline closes along the chord, where silicone meets silicone.
        let surface = &cell.points_um;
        let flow: Vec<[f64; 2]> = self.poynting.iter().map(|s| [s[0], s[2]]).collect();
        let length = |s: &[f64; 3]| s.iter().map(|c| c * c).sum::<f64>().sqrt();
        let draw =
            |file: &Path, what: &str, quantity: &str, values: Vec<f64>, flow: &[[f64; 2]]| {
                let errors = vec![0.0; values.len()];
                let quantity = Quantity::new(quantity, Unit::Relative);
                let map = Map::new(quantity, found.z.clone(), found.x.clone(), values, errors)?;
                let heading =
                    Heading::new(format!("{}, ring {}: {what}", design.name, cell.ring), &wave);
                let picture = near_field_map(&NearFieldMap {
                    heading: &heading,
                    map: &map,
                    flow,
                    surface,
                    period: cell.period_um,
                    media: [&media[0], &media[1]],
                })?;
                atomic_file::write_bytes(file, &picture.png()?)
            };
        draw(
            &path("-intensity.png"),
            "intensity of the electric field",
            "|E|² / incident |E|²",
            found.intensity(),
            &[],
        )?;
        draw(
            &path("-poynting.png"),
            "flow of power",
            "|S| / incident |S|",
            self.poynting.iter().map(length).collect(),
            &flow,
        )
    }
}
