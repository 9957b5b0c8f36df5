// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ink and densities over the place, checked.

use std::sync::Arc;

use bsdf::{DiffuseLaw, DiffuseLobe, Diffuser};
use serde::Serialize;
use tracer::{Pattern, Printed, SurfaceModel};

use super::Design;
use super::solids::{BOX_FACES, CheckedSolid};
use crate::schema::prints::Print;
use metrics::illuminance::Symmetry;

/// Ink on the mirror or on a face of a film, or the density of a film.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedPrint {
    /// As written.
    #[serde(flatten)]
    pub stated: Print,
    /// Share of its cells under ink; mean density.
    pub coverage: f64,
    /// Places of ink or particles.
    #[serde(skip)]
    pub(crate) pattern: Arc<Pattern>,
}

impl CheckedPrint {
    /// True of the density of a film, false of ink.
    pub fn is_density(&self) -> bool {
        self.stated.reflected.is_none()
    }

    /// What it is and of what, in words.
    pub fn name(&self) -> String {
        let kind = if self.is_density() { "density of" } else { "ink on" };
        format!("{kind} {}", self.stated.on)
    }

    /// The symmetry that it leaves.
    pub fn symmetry(&self) -> Symmetry {
        if self.pattern.is_mirrored() { Symmetry::Rectangle } else { Symmetry::None }
    }

    fn on(&self, base: SurfaceModel, ink: SurfaceModel) -> SurfaceModel {
        let pattern = Arc::clone(&self.pattern);
        SurfaceModel::Printed(Arc::new(Printed { base, ink, pattern }))
    }
}

impl Design {
    /// A mirror like `base` with the ink on it.
    pub fn printed_mirror(&self, base: SurfaceModel) -> SurfaceModel {
        match self.prints.iter().find(|print| print.stated.on == Print::MIRROR) {
            Some(print) => {
                let reflectance = print.stated.reflected.unwrap_or_default();
                print.on(base, SurfaceModel::Lambertian { reflectance })
            }
            None => base,
        }
    }

    /// The medium of a solid as the tracer takes it.
    pub fn traced_medium(&self, solid: &CheckedSolid) -> Option<tracer::Medium> {
        let medium = solid.medium.as_ref()?.to_tracer(solid.name());
        let mut densities = self.prints.iter().filter(|print| print.is_density());
        let own = densities.find(|print| print.stated.on == solid.name());
        Some(medium.with_density(own.map(|print| Arc::clone(&print.pattern))))
    }

    /// Puts the ink on the upper and the lower face of a film between media of these indices into the
    /// patches of its box.
    ///
    /// # Errors
    /// None that the checks have left.
    pub fn print_film(
        &self,
        film: &CheckedSolid,
        indices: [f64; 2],
        patches: &mut [SurfaceModel],
    ) -> anyhow::Result<()> {
        for (face, patch) in BOX_FACES {
            let on = format!("{}.{face}", film.name());
            let Some(print) = self.prints.iter().find(|print| print.stated.on == on) else {
                continue;
            };
            let lobe = |share| DiffuseLobe { share, law: DiffuseLaw::Lambertian };
            let Print { reflected, transmitted, .. } = print.stated;
            let ink =
                Diffuser::new(lobe(reflected.unwrap_or_default()), lobe(transmitted), indices)?;
            patches[patch] = print.on(patches[patch].clone(), SurfaceModel::Scatter(Arc::new(ink)));
        }
        Ok(())
    }
}
