// SPDX-License-Identifier: MIT OR Apache-2.0
//! A few paths for a [`Witness`] to look on at.

use crate::error::Error;
use crate::path::{Books, Tracer};
use crate::polarization::{Polarization, Stokes, Unpolarised};
use crate::random;
use crate::ray::Ray;
use crate::run::{Settings, validate};
use crate::scene::Scene;
use crate::witness::Witness;

/// Traces `settings.paths` paths, one after the other on this thread, and shows them to `witness`; `settings.groups` is of no meaning here. Each ray of
/// a source, in the frame of its body, is turned into another by `aim` first: one that stays in a plane, for example.
pub fn look_on(
    scene: &Scene,
    settings: &Settings,
    mut aim: impl FnMut(Ray) -> Ray,
    witness: &mut impl Witness,
) -> Result<(), Error> {
    validate(settings)?;
    let tracer = Tracer::new(scene, &[], settings);
    let mut books = Books::new(&tracer);
    let mut rng = random::stream(settings.seed, 0);
    for _ in 0..settings.paths {
        let pick = random::unit(&mut rng);
        let slots = &scene.slots;
        let slot = &slots[slots
            .partition_point(|slot| slot.cumulated <= pick)
            .min(slots.len() - 1)];
        let ray = aim(slot.source.sample(scene.offset(), &mut rng));
        match settings.polarization {
            Polarization::Unpolarised => {
                tracer.follow::<Unpolarised>(ray, slot, &mut rng, &mut books, witness)
            }
            Polarization::Carried => {
                tracer.follow::<Stokes>(ray, slot, &mut rng, &mut books, witness)
            }
        };
    }
    Ok(())
}
