// SPDX-License-Identifier: MIT OR Apache-2.0
//! The near field of one ring: E, H and the flow of power on a grid of points in and around its
//! unit cell.
//!
//! Fields are normalised to the incident wave. Axes are those of the cell: x along the meridian, z
//! outward; the silicone fills z < 0.

use anyhow::{Context, Result, ensure};
use rcwa::field::{Field, Grid, Incident, Sample, field};
use rcwa::{Bloch, Pol, Side, Truncation};

use crate::interface::interface;
use geometry::Cell;
use metrics::quantity::{Axis, Quantity, Unit};
use runtime::run_context::RunContext;

/// Points per wavelength in the densest medium.
const POINTS_PER_WAVELENGTH: f64 = 20.0;
/// Slices per vacuum wavelength of depth, where none are asked for.
const SLICES_PER_WAVELENGTH: f64 = 24.0;
/// Most points of a grid: some 200 bytes each in memory.
const MAX_POINTS: usize = 4_000_000;

/// The incident wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IncidentWave {
    /// [`Side::Top`] is the inner side, the silicone.
    pub side: Side,
    /// Angle to the normal of the chord, degrees, -90 < θ < 90.
    pub theta_deg: f64,
    /// Azimuth of the tangential wavevector from x, degrees.
    pub phi_deg: f64,
    /// Polarisation.
    pub pol: Pol,
}

/// Extent and resolution of the near field; missing values follow from the cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearFieldSettings {
    /// Periods along x, at least 1.
    pub periods: usize,
    /// Depth of the grid in both half-spaces, µm.
    pub margin_um: Option<f64>,
    /// Highest order kept.
    pub orders: Option<usize>,
    /// Slices of the relief.
    pub slices: Option<usize>,
}

/// Fields in the middles of a grid of bins.
#[derive(Debug, Clone)]
pub struct NearField {
    /// Along x, µm.
    pub x: Axis,
    /// Along z, µm.
    pub z: Axis,
    /// The fields, for unit incident amplitude; row by row from the lowest z.
    pub field: Field,
    /// Index of the medium that the light comes from.
    pub incident_index: f64,
    /// Tangential wavevector of the incident wave, in units of k0.
    pub bloch: Bloch,
    /// Highest order kept.
    pub orders: usize,
    /// Slices.
    pub slices: usize,
}

impl NearField {
    /// |E|² relative to the incident wave.
    pub fn intensity(&self) -> Vec<f64> {
        self.field.samples.iter().map(Sample::intensity).collect()
    }

    /// Poynting vectors relative to the length of the incident one.
    pub fn poynting(&self) -> Vec<[f64; 3]> {
        let unit = 0.5 * self.incident_index;
        self.field.samples.iter().map(|s| s.poynting().map(|c| c / unit)).collect()
    }

    /// R + T - 1; 0 without loss.
    pub fn energy_residual(&self) -> f64 {
        self.field.reflected + self.field.transmitted - 1.0
    }

    /// Largest difference of the power through any plane from 1 - R; 0 without loss.
    pub fn flux_residual(&self) -> f64 {
        let expected = 1.0 - self.field.reflected;
        self.field.flux.iter().map(|f| (f - expected).abs()).fold(0.0, f64::max)
    }
}

/// Computes the near field of `cell`.
///
/// # Errors
/// Too few orders, a negative margin, too many points; those of the solver; an interrupt.
pub fn near_field(
    cell: &Cell,
    wavelength_um: f64,
    wave: &IncidentWave,
    frame: &NearFieldSettings,
    context: RunContext,
) -> Result<NearField> {
    let interface = interface(cell, wavelength_um)?;
    let least = interface.highest_order();
    let orders = frame.orders.unwrap_or(least + least.div_ceil(2).max(8));
    ensure!(
        orders >= least,
        "--orders: orders up to ±{least} propagate, expected at least {least}, got {orders}"
    );
    let depth = cell.depth_um / wavelength_um;
    let slices = frame.slices.unwrap_or((SLICES_PER_WAVELENGTH * depth).ceil() as usize + 2);
    let (x, z) = axes(cell, wavelength_um, frame)?;

    let stack = interface.stack(&interface.relief.slice_plan(slices))?;
    let bloch = Bloch::from_angles(
        &stack,
        wave.side,
        wave.theta_deg.to_radians(),
        wave.phi_deg.to_radians(),
    );
    // The solver passes the layers twice, up and down.
    let bar = context.console.progress(2 * stack.layers().len() as u64, "near field");
    let stop = context.interrupt.watch();
    let watch = |layers: usize| {
        bar.inc(layers as u64);
        stop(layers)
    };
    let grid = Grid { x: x.centres(), z: z.centres() };
    let incident = Incident::unit(wave.side, wave.pol);
    let found = field(&stack, bloch, Truncation::new(orders)?, &incident, grid, &watch);
    bar.finish_and_clear();
    context.interrupt.check()?;
    Ok(NearField {
        field: found.with_context(|| format!("near field of ring {}", cell.ring))?,
        incident_index: stack.index(wave.side).re,
        slices: stack.layers().len(),
        x,
        z,
        bloch,
        orders,
    })
}

/// Axes of square bins, a whole number of them to a period.
fn axes(cell: &Cell, wavelength_um: f64, frame: &NearFieldSettings) -> Result<(Axis, Axis)> {
    let margin = frame.margin_um.unwrap_or_else(|| (2.0 * wavelength_um).max(0.25 * cell.depth_um));
    ensure!(
        margin.is_finite() && margin >= 0.0,
        "--margin-um: expected a length of at least 0, got {margin}"
    );
    let dense = cell.inner_index.max(cell.background_index);
    let per_period =
        (POINTS_PER_WAVELENGTH * dense * cell.period_um / wavelength_um).ceil().max(256.0);
    let step = cell.period_um / per_period;
    let rows = ((cell.depth_um + 2.0 * margin) / step).ceil();
    let columns = per_period * frame.periods as f64;
    ensure!(
        rows * columns <= MAX_POINTS as f64,
        "{columns} x {rows} points, expected at most {MAX_POINTS}: take fewer --periods or a smaller --margin-um"
    );
    let middle = 0.5 * cell.depth_um;
    let reach = 0.5 * rows * step;
    let axis = |name: &str, low, high, bins: f64| {
        Axis::uniform(Quantity::new(name, Unit::Micrometre), low, high, bins as usize)
    };
    Ok((
        axis("x", 0.0, cell.period_um * frame.periods as f64, columns)?,
        axis("z", middle - reach, middle + reach, rows)?,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    use runtime::interrupt::Interrupt;

    const FRAME: NearFieldSettings =
        NearFieldSettings { periods: 1, margin_um: Some(0.3), orders: None, slices: Some(6) };

    fn cell() -> Cell {
        crate::cell_of_ring(15)
    }

    fn solved(wave: IncidentWave, frame: NearFieldSettings) -> Result<NearField> {
        let interrupt = Interrupt::default();
        near_field(&cell(), 0.55, &wave, &frame, RunContext::quiet(&interrupt, 1))
    }

    #[test]
    fn bins_are_square_and_centred_on_the_relief() {
        let cell = cell();
        let (x, z) = axes(&cell, 0.55, &NearFieldSettings { periods: 3, ..FRAME }).expect("axes");
        let step = |a: &Axis| (a.range()[1] - a.range()[0]) / a.bins() as f64;
        assert!((step(&x) - step(&z)).abs() < 1e-12);
        assert!((x.range()[1] - 3.0 * cell.period_um).abs() < 1e-12);
        assert!((z.range()[0] + z.range()[1] - cell.depth_um).abs() < 1e-12);
        assert!(z.range()[0] <= -0.3 && step(&x) < 0.55 / 1.41 / 19.0);
        for (periods, margin_um) in [(1, Some(-1.0)), (1, Some(f64::NAN)), (64, Some(50.0))] {
            let frame = NearFieldSettings { periods, margin_um, ..FRAME };
            assert!(axes(&cell, 0.55, &frame).is_err(), "{periods} {margin_um:?}");
        }
    }

    #[test]
    fn light_comes_from_the_side_asked_for_and_power_is_kept() {
        for (side, theta_deg) in [(Side::Top, 20.0), (Side::Bottom, -35.0)] {
            let wave = IncidentWave { side, theta_deg, phi_deg: 10.0, pol: Pol::P };
            let found = solved(wave, FRAME).expect("solved");
            assert!(found.energy_residual().abs() < 1e-10 && found.flux_residual() < 1e-10);
            let width = found.x.bins();
            let poynting = found.poynting();
            let intensity = found.intensity();
            // Far behind the structure the mean flow through z is T cos θ of the incident one.
            let row = if side == Side::Top { found.z.bins() - 1 } else { 0 };
            let mean: f64 =
                poynting[row * width..][..width].iter().map(|s| s[2]).sum::<f64>() / width as f64;
            let sense = if side == Side::Top { 1.0 } else { -1.0 };
            let expected = sense * found.field.transmitted * f64::to_radians(theta_deg).cos();
            assert!((mean - expected).abs() < 1e-6, "{mean} {expected}");
            assert!(intensity.iter().all(|i| (0.0..40.0).contains(i)));
        }
    }

    #[test]
    fn too_few_orders_are_refused() {
        let wave = IncidentWave { side: Side::Top, theta_deg: 0.0, phi_deg: 0.0, pol: Pol::S };
        let few = NearFieldSettings { orders: Some(5), ..FRAME };
        let error = solved(wave, few).expect_err("too few").to_string();
        assert!(error.contains("--orders") && error.contains("got 5"), "{error}");
    }
}
