// SPDX-License-Identifier: MIT OR Apache-2.0
//! A scene → what its receivers saw: the Monte Carlo run of one model of one design.

use std::sync::Arc;

use anyhow::{Result, anyhow, ensure};
use bsdf::ray_optics::{Outline, Polygon, UnitCell};
use bsdf::{Binned, Bsdf, IncidenceMap, Mask, Masked, OrderTable, RemappedIncidence};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use tracer::{CheckpointStore, Control, FarField, PlaneMap, Scene, Settings};

use super::model::Model;
use super::observation::{Observation, plane_grid};
use super::receivers;
use super::scene::{self, Skin};
use super::tables::DesignTables;
use crate::checkpoint::LEAST_PATHS;
use crate::config::design::{Design, Dome, Elements};
use crate::config::schema::{Incidence, Polarization, Scattering};
use crate::geometry::{Cell, Meridian, ring_cell};
use crate::interrupt::Interrupted;
use crate::metrics::extraction::flow;
use crate::run_context::Environment;

/// Groups of paths, from whose scatter all errors come.
pub(crate) const GROUPS: usize = 64;

/// The output function of SplitMix64 [Steele Lea Flood 2014], a bijection that scatters neighbours.
pub(super) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The dome's surface for `model`; `tables` for the hybrid.
pub fn skin(design: &Design, model: Model, tables: Option<&DesignTables>) -> Result<Skin> {
    let Some(dome) = &design.dome else {
        return Ok(Skin::Refracting(Meridian { pieces: Vec::new() }));
    };
    ensure!(
        !(model.is_banded() && design.is_coated()),
        "{}: expected a model of rays on the relief itself with dome.coating, got {}",
        design.name,
        model.label(design)
    );
    Ok(match model {
        Model::Geometric => Skin::Refracting(design.outline(dome)?),
        Model::Fine => Skin::Refracting(Meridian::stepped(dome, &design.hybrid_rings())?),
        Model::Control => {
            let cells = band_cells(design);
            let scatter = cells.iter().map(|cell| {
                cell.as_ref()
                    .map(|c| Ok(Arc::new(UnitCell::new(&outline(c))?) as Arc<dyn Bsdf>))
                    .transpose()
            });
            banded(design, dome, scatter.collect::<Result<_>>()?)
        }
        Model::Hybrid => {
            let tables =
                tables.ok_or_else(|| anyhow!("the hybrid of {} needs its tables", design.name))?;
            let scatter = tables.bands.iter().enumerate().map(|(band, table)| {
                let solved = || table.as_ref().map(|t| solved(design, &t.table)).transpose();
                let scatter = design
                    .files
                    .band_scatter(band)
                    .map_or_else(solved, |s| Ok(Some(s)))?;
                Ok(scatter.map(|s| simplified(design, s)))
            });
            banded(design, dome, scatter.collect::<Result<_>>()?)
        }
    })
}

/// A solved table for the polarisation that the design asks for.
fn solved(design: &Design, table: &Arc<OrderTable>) -> Result<Arc<dyn Bsdf>> {
    let polarization = match design.hybrid.polarization {
        Polarization::Unpolarised => return Ok(Arc::clone(table) as Arc<dyn Bsdf>),
        Polarization::S => bsdf::Polarization::S,
        Polarization::P => bsdf::Polarization::P,
    };
    Ok(Arc::new(table.for_polarization(polarization)?))
}

/// A band with what `[hybrid]` leaves out of it.
fn simplified(design: &Design, mut scatter: Arc<dyn Bsdf>) -> Arc<dyn Bsdf> {
    let hybrid = &design.hybrid;
    // x of a band points away from the axis: light that travels so comes from x < 0.
    let by = match hybrid.incidence {
        Incidence::Conical => None,
        Incidence::InPlane => Some(IncidenceMap::InPlane),
        Incidence::Outwards => Some(IncidenceMap::FromNegativeX),
        Incidence::Inwards => Some(IncidenceMap::FromPositiveX),
        Incidence::HalfTurn => Some(IncidenceMap::HalfTurn),
        Incidence::AzimuthMean => Some(IncidenceMap::Azimuths),
    };
    if let Some(by) = by {
        scatter = Arc::new(RemappedIncidence { bsdf: scatter, by });
    }
    let part = match hybrid.scattering {
        Scattering::Whole => None,
        Scattering::Transmission => Some(Mask::Transmission),
        Scattering::SpecularReflection => Some(Mask::SpecularReflection),
        Scattering::FromInside => Some(Mask::FromInside),
    };
    if let Some(part) = part {
        scatter = Arc::new(Masked {
            bsdf: scatter,
            part,
        });
    }
    if hybrid.spread_deg > 0.0 {
        scatter = Arc::new(Binned::new(scatter, hybrid.spread_deg));
    }
    scatter
}

fn banded(design: &Design, dome: &Dome, scatter: Vec<Option<Arc<dyn Bsdf>>>) -> Skin {
    let width_mm = design.hybrid.element_width_um * 1e-3 * design.hybrid.rings_per_band as f64;
    let ends: Vec<f64> = (1..=scatter.len()).map(|k| k as f64 * width_mm).collect();
    Skin::Banded(Meridian::banded(dome, &ends), scatter)
}

/// The unit cell of every band's representative ring, in what lies around the domes of a design that fits; `None` where the band is smooth.
pub fn band_cells(design: &Design) -> Vec<Option<Cell>> {
    let Some(dome) = &design.dome else {
        return Vec::new();
    };
    // What does not fit is refused before anything asks for cells.
    let around = scene::index_about_domes(design).unwrap_or(1.0);
    let rings: Elements = design.hybrid_rings();
    (0..rings.shapes.len() / design.hybrid.rings_per_band)
        .map(|band| {
            let cell = ring_cell(
                dome,
                &rings,
                band * design.hybrid.rings_per_band + design.hybrid.representative,
                design.silicone.index,
            )?;
            Some(cell.within(around))
        })
        .collect()
}

/// The cell as the ray-optics control takes it.
pub fn outline(cell: &Cell) -> Outline {
    Outline {
        period: cell.period_um,
        depth: cell.depth_um,
        index_inner: cell.inner_index,
        index_outer: cell.background_index,
        background: cell.background_index,
        polygons: cell
            .polygons
            .iter()
            .map(|p| Polygon {
                index: p.index,
                points: p.points_um.clone(),
            })
            .collect(),
    }
}

/// Share of the power that may be given up without a word.
const NEGLIGIBLE: f64 = 1e-5;

/// Traces `paths` paths of `design` with the dome's surface `skin`; `what` is shown beside the progress.
pub fn observe(
    design: &Design,
    skin: &Skin,
    paths: u64,
    what: &str,
    env: Environment,
) -> Result<Observation> {
    let bar = env.console.bar(paths, what);
    let job = Job {
        design,
        skin,
        what,
        bar: &bar,
    };
    let observed = scene::build(design, skin).and_then(|scene| job.trace(&scene, paths, env));
    bar.finish_and_clear();
    if let Ok(seen) = &observed {
        for (account, share) in given_up(seen) {
            env.console.warn(&format!(
                "{what}: {share:.1e} of the power was {}, and no figure knows where it would have gone",
                account.replace('_', " ")
            ));
        }
    }
    observed
}

/// Accounts of power given up that hold more than [`NEGLIGIBLE`] of what was emitted, and their share of it.
fn given_up(seen: &Observation) -> Vec<(&str, f64)> {
    let totals = seen.powers.total();
    let emitted = totals[flow::EMITTED];
    let shares = seen.accounts.iter().zip(totals);
    shares
        .filter(|(account, _)| account.starts_with("lost_"))
        .map(|(account, power)| (account.as_str(), power / emitted))
        .filter(|(_, share)| *share > NEGLIGIBLE)
        .collect()
}

/// The plane on which uniformity is judged.
///
/// # Errors
/// More bins than a plane may have.
pub(super) fn plane(design: &Design) -> Result<PlaneMap, tracer::Error> {
    let grid = plane_grid(design);
    PlaneMap::centred(
        design.receiver.plane_height_mm,
        grid.bin_mm,
        grid.columns,
        grid.rows,
    )
}

/// What is traced.
struct Job<'a> {
    design: &'a Design,
    skin: &'a Skin,
    what: &'a str,
    bar: &'a ProgressBar,
}

impl Job<'_> {
    /// Traces a scene.
    fn trace(&self, scene: &Scene, paths: u64, env: Environment) -> Result<Observation> {
        env.interrupt.check()?;
        let design = self.design;
        let plane = plane(design)?;
        let far = FarField::new(design.far_field.bin_deg, design.far_field.azimuth_bin_deg)?;
        let detectors = receivers::detectors(design);
        let settings = Settings {
            groups: GROUPS,
            max_bounces: design.trace.max_interactions,
            polarization: scene::polarization(design),
            sampling: scene::sampling(design),
            path_splitting: design.trace.split.unwrap_or(1),
            ..Settings::new(paths, env.seed)
        };
        let progress = |done: u64| self.bar.inc(done);
        let kept = env.checkpoints.filter(|_| paths >= LEAST_PATHS);
        let kept = kept
            .map(|kept| {
                let (of, by) = ((self.design, self.skin), (settings.paths, settings.seed));
                Ok::<_, serde_json::Error>(kept.of(&ingredients(of, self.what, by)?))
            })
            .transpose()?;
        let control = Control {
            progress: Some(&progress),
            cancel: Some(env.interrupt.flag()),
            checkpoints: kept.as_ref().map(|kept| kept as &dyn CheckpointStore),
        };
        let outcome = tracer::run_detecting(scene, &[&far, &plane], &detectors, &settings, control);
        env.interrupt.check()?;
        let outcome = match outcome {
            Err(tracer::Error::Cancelled) => return Err(Interrupted.into()),
            other => other?,
        };
        let mut seen = Observation::new(design, outcome);
        seen.depolarised_by = scene.scattering_surfaces();
        Ok(seen)
    }
}

/// All that the groups of a trace depend on, beside the program. Tables follow from the design.
pub(super) fn ingredients(
    (design, skin): (&Design, &Skin),
    what: &str,
    (paths, seed): (u64, u64),
) -> serde_json::Result<Value> {
    let (kind, open) = match skin {
        Skin::Refracting(_) => ("refracting", None),
        Skin::Only(_, open) => ("only", Some(*open)),
        Skin::Banded(..) => ("banded", None),
    };
    Ok(json!({
        "what": what,
        "design": serde_json::to_value(design)?,
        "skin": {"kind": kind, "open": open, "meridian": format!("{:?}", skin.meridian())},
        "paths": paths,
        "seed": seed,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use crate::config::schema::Sampling;
    use crate::interrupt::Interrupt;
    use crate::metrics::far_field::{Bins, Peak};

    fn seen(change: impl Fn(&mut Design)) -> Observation {
        let mut design = config::embedded("d1.toml").expect("valid");
        change(&mut design);
        let interrupt = Interrupt::default();
        let env = Environment::quiet(&interrupt, 3);
        let skin = skin(&design, Model::Geometric, None).expect("a dome");
        observe(&design, &skin, 160_000, "", env).expect("a trace")
    }

    #[test]
    fn a_package_alone_does_not_care_about_crossing() {
        let alone = |crossing: bool| {
            seen(|d| {
                (d.array.columns, d.array.rows) = (1, 1);
                d.array.crossing = crossing;
            })
        };
        assert_eq!(alone(true).far_field, alone(false).far_field);
    }

    #[test]
    fn what_is_given_up_is_named_with_its_share() {
        let short = seen(|d| d.trace.max_interactions = 3);
        let found = given_up(&short);
        let [(account, share)] = found[..] else {
            panic!("{found:?}")
        };
        assert!(account.contains("bounces"), "{account}");
        let ledger = short.ledger();
        let booked = ledger.accounts.iter().find(|(name, _)| name == account);
        assert!(share > 0.01 && (share - booked.expect("an account").1.value).abs() < 1e-12);
        assert_eq!(given_up(&seen(|_| {})), []);
    }

    #[test]
    fn other_ways_of_tracing_find_the_same() {
        let figures = |change: &dyn Fn(&mut Design)| {
            let changed = |d: &mut Design| {
                change(d);
                (d.receiver.bin_mm, d.receiver.read_bin_mm) = (0.5, None);
                let far = &mut d.far_field;
                (far.read_bin_deg, far.centre_deg, far.peak_fit_deg) = (Some(5.0), 5.0, 10.0);
                (far.read_bins, far.peak) = (Bins::Between, Peak::Parabola);
                d.trace.paths = 160_000;
            };
            let seen = seen(changed);
            let mut design = config::embedded("d1.toml").expect("valid");
            changed(&mut design);
            let figures = seen.figures(&design).into_iter();
            figures.map(|f| (f.key, f.estimate)).collect::<Vec<_>>()
        };
        let at_random = |d: &mut Design| d.trace.sampling = Sampling::Random;
        let plain = figures(&at_random);
        let net = figures(&|d| d.trace.sampling = Sampling::Sobol);
        let parts = figures(&|d| {
            at_random(d);
            d.trace.split = Some(2);
        });
        for key in ["centre_to_peak", "extraction_efficiency", "peak_angle_deg"] {
            let of = |figures: &[(&str, crate::metrics::Estimate)]| {
                let found = figures.iter().find(|(name, _)| *name == key);
                found.expect("a figure").1
            };
            for other in [&net, &parts] {
                let (a, b) = (of(&plain), of(other));
                let error = a.standard_error.hypot(b.standard_error);
                let difference = (a.value - b.value).abs();
                // Neither the same draws nor another result.
                assert!(
                    difference > 0.0 && difference < 4.5 * error,
                    "{key}: {a:?} {b:?}"
                );
            }
        }
        let error = |figures: &[(&str, crate::metrics::Estimate)]| figures[1].1.standard_error;
        assert!(plain[1].0 == "centre_to_peak" && error(&net) < 0.6 * error(&plain));
    }

    #[test]
    fn without_crossing_every_package_is_one_that_stands_alone() {
        // On the mirror of all of them: the mean of single packages at the four places is what all together send out.
        let change = |d: &mut Design| {
            d.array.pitch_mm = 3.5;
            d.array.crossing = false;
            (d.receiver.bin_mm, d.receiver.read_bin_mm) = (0.5, None);
        };
        let apart = seen(change);
        let single = seen(|d| {
            change(d);
            (d.array.columns, d.array.rows) = (1, 1);
        });
        // What leaves the dome does not see the mirror's edge.
        let out = |o: &Observation| crate::metrics::jackknife(&o.flows, |p| p[flow::OUTWARD]);
        let (a, b) = (out(&apart), out(&single));
        let error = a.standard_error.hypot(b.standard_error);
        assert!((a.value - b.value).abs() < 4.5 * error, "{a:?} {b:?}");
        assert_eq!(apart.paths, single.paths);
    }

    #[test]
    fn without_crossing_nothing_comes_back_into_domes_from_others() {
        let back = |crossing: bool| {
            let seen = seen(|d| {
                d.array.pitch_mm = 3.5;
                d.array.crossing = crossing;
            });
            let inward = crate::metrics::extraction::flow::INWARD;
            let flow = crate::metrics::jackknife(&seen.flows, |p| p[inward]);
            let total: f64 = seen.far_field.total().iter().sum();
            assert!(total > 0.8 && total < 1.0, "{total}");
            flow
        };
        let (with, without) = (back(true), back(false));
        let error = with.standard_error.hypot(without.standard_error);
        // Nearly touching, a package sends a good part of its light into the others.
        assert!(
            with.value - without.value > 5.0 * error,
            "{with:?} {without:?}"
        );
    }
}
