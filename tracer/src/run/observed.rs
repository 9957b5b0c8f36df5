// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces a few paths and reports every interaction to an [`Observer`].

use glam::DVec3;

use crate::error::Error;
use crate::observer::Observer;
use crate::optics::polarisation::{Polarisation, Stokes, Unpolarised};
use crate::path::{Tracer, Walk};
use crate::random;
use crate::ray::Ray;
use crate::receiver::Tally;
use crate::scene::{Location, Scene};
use crate::settings::Settings;

/// Traces `settings.paths` paths, one after the other on this thread, and shows them to `observer`;
/// `settings.groups` is of no meaning here. Each ray of a source, in the frame of the instance that
/// carries it, is turned into another by `aim` first: one that stays in a plane, for example.
pub fn trace_observed(
    scene: &Scene,
    settings: &Settings,
    mut aim: impl FnMut(Ray) -> Ray,
    observer: &mut impl Observer,
) -> Result<(), Error> {
    settings.check()?;
    let tracer = Tracer::new(scene, &[], settings);
    let mut tally = Tally::new(&tracer.receivers);
    let mut rng = random::stream(settings.seed, 0);
    for _ in 0..settings.paths {
        let pick = random::unit(&mut rng);
        let sources = &scene.sources;
        let number =
            sources.partition_point(|placed| placed.cumulated <= pick).min(sources.len() - 1);
        let source = &sources[number];
        let ray = source.source.sample(scene.offset(), &mut rng);
        // Sources outside of their own body stand in the frame of the world.
        let carrier = match source.location {
            Location::Inside { instance, .. } if source.instance == Some(instance) => DVec3::ZERO,
            _ => scene.position(source.instance),
        };
        let mut ray = aim(Ray { origin: ray.origin - carrier, ..ray });
        ray.origin += carrier;
        let path = tracer.begin(ray, (number, source), &mut tally, observer);
        let (tracer, rng, tally, observer) = (&tracer, &mut rng, &mut tally, &mut *observer);
        match settings.polarisation {
            Polarisation::Unpolarised => {
                let light = &mut Unpolarised;
                Walk { tracer, path, light, rng, tally, observer }.follow_to(u32::MAX);
            }
            Polarisation::Carried => {
                let light = &mut Stokes::default();
                Walk { tracer, path, light, rng, tally, observer }.follow_to(u32::MAX);
            }
        }
    }
    Ok(())
}
