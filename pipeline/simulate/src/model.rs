// SPDX-License-Identifier: MIT OR Apache-2.0
//! Models of a design: rays on the relief, or bands with a BSDF.

use schemars::JsonSchema;
use serde::Deserialize;

use design::Design;

/// Treatment of the relief of a dome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// Rays on the elements as designed.
    Geometric,
    /// Rays on the relief in the hybrid's finer steps: isolates the effect of the step.
    Fine,
    /// Rays on the smooth dome in bands; each band has the BSDF of its unit cell by ray optics.
    Control,
    /// Rays on the smooth dome in bands; each band has the BSDF of its table of diffraction
    /// orders.
    Hybrid,
}

impl Model {
    /// The models that `design` has: all four for relief, rays alone for smooth and bare packages.
    /// Bands exist without thin films only, and the steps of rings where there are rings.
    pub fn all_of(design: &Design) -> Vec<Self> {
        let mut models = if design.has_relief() && design.is_coated() {
            vec![Self::Geometric, Self::Fine]
        } else if design.has_relief() && design.without_bands.is_none() {
            vec![Self::Geometric, Self::Fine, Self::Control, Self::Hybrid]
        } else {
            vec![Self::Geometric]
        };
        // Rings as wide as the elements are no other steps.
        models.retain(|model| *model != Self::Fine || copies_um(design).is_some());
        models
    }

    /// Why relief of `design` has not all four models; `None` where it has them, or no relief.
    pub fn left_out(design: &Design) -> Option<String> {
        let reason = if design.has_relief() && design.is_coated() {
            "bands take no thin films on the dome"
        } else {
            design.without_bands.as_deref()?
        };
        let (there, has_fine) = (Self::all_of(design), copies_um(design).is_some());
        let mut missing = vec![Self::Fine, Self::Control, Self::Hybrid];
        missing.retain(|m| !there.contains(m) && (*m != Self::Fine || has_fine));
        let missing: Vec<String> = missing.iter().map(|model| model.key(design)).collect();
        let copies = if has_fine || design.is_coated() {
            ""
        } else {
            "; rings are as wide as the elements, copies at a smaller width are asked for by hybrid.element_width_um"
        };
        Some(format!("left out: {}: {reason}{copies}", missing.join(", ")))
    }

    /// Refuses a model that `design` does not have.
    ///
    /// # Errors
    /// Which models it has not, and why.
    pub fn available(self, design: &Design) -> anyhow::Result<Self> {
        if Self::all_of(design).contains(&self) {
            return Ok(self);
        }
        let smooth = || match (self, design.has_relief()) {
            (Self::Fine, true) => "the hybrid solves rings as wide as the elements \
                (hybrid.element_width_um), so that the geometric model is this one"
                .to_owned(),
            _ => "the dome is smooth, it has the geometric model only".to_owned(),
        };
        let why = Self::left_out(design).unwrap_or_else(smooth);
        anyhow::bail!("{}: {}: {why}", design.provenance.file, self.key(design))
    }

    /// Key in `results.json` and name of the directory: `hybrid_10um`; a package without relief has
    /// `geometric`.
    pub fn key(self, design: &Design) -> String {
        if design.has_relief() {
            format!("{}_{}um", self.name(), self.step_um(design))
        } else {
            self.name().to_owned()
        }
    }

    /// Name for people: `hybrid, 10 µm`.
    pub fn label(self, design: &Design) -> String {
        if design.has_relief() {
            format!("{}, {} µm", self.name(), self.step_um(design))
        } else {
            self.name().to_owned()
        }
    }

    /// Name in files of studies and problems.
    pub fn word(self) -> &'static str {
        match self {
            Self::Geometric => "geometric",
            Self::Fine => "fine",
            Self::Control => "control",
            Self::Hybrid => "hybrid",
        }
    }

    /// What the model does, in a line for people.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Geometric => "Rays on the surface as designed.",
            Self::Fine => "Rays on the same relief in the finer rings of the hybrid.",
            Self::Control => {
                "Rays on the smooth dome, which scatters as ray optics says of each ring: the hybrid without waves."
            }
            Self::Hybrid => {
                "Rays on the smooth dome, which scatters as Maxwell's equations say of each ring."
            }
        }
    }

    /// True if the relief is replaced by bands with a BSDF.
    pub fn is_banded(self) -> bool {
        matches!(self, Self::Control | Self::Hybrid)
    }

    fn name(self) -> &'static str {
        if self == Self::Fine { Self::Geometric.word() } else { self.word() }
    }

    /// Micrometres, to a nanometre.
    fn step_um(self, design: &Design) -> f64 {
        let rounded = |um: f64| (um * 1e3).round() / 1e3;
        match self {
            Self::Geometric => rounded(design.elements.width_mm * 1e3),
            Self::Fine | Self::Control | Self::Hybrid => rounded(design.hybrid.element_width_um),
        }
    }
}

/// Width of the rings of the hybrid, µm, where they are copies of the relief at another width than
/// that of its elements.
pub fn copies_um(design: &Design) -> Option<f64> {
    let [rings, elements] = [design.hybrid.element_width_um, 1e3 * design.elements.width_mm]
        .map(|um| (um * 1e3).round());
    (design.has_relief() && rings.to_bits() != elements.to_bits())
        .then_some(design.hybrid.element_width_um)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn keys_are_those_of_the_results_schema() {
        let d1 = design::embedded("d1.toml").expect("valid");
        let keys: Vec<String> = Model::all_of(&d1).into_iter().map(|m| m.key(&d1)).collect();
        assert_eq!(keys, ["geometric_100um", "geometric_10um", "control_10um", "hybrid_10um"]);
        let bare = design::embedded("bare-dome.toml").expect("valid");
        assert_eq!(
            Model::all_of(&bare).into_iter().map(|m| m.key(&bare)).collect::<Vec<_>>(),
            ["geometric"]
        );
    }

    #[test]
    fn rings_as_wide_as_the_elements_leave_out_the_model_of_finer_steps() {
        let text = design::NEW_DESIGN.replace("NAME", "own").replace("element_width_um = 10.0", "");
        let text = text.replace("width_um = 100.0", "width_um = 20.0");
        let design = design::parse("own.toml", &text, Path::new("")).expect("valid");
        let keys: Vec<String> =
            Model::all_of(&design).into_iter().map(|m| m.key(&design)).collect();
        assert_eq!(keys, ["geometric_20um", "control_20um", "hybrid_20um"]);
        assert_eq!((Model::left_out(&design), copies_um(&design)), (None, None));
        let refused = Model::Fine.available(&design).expect_err("no other steps").to_string();
        assert!(refused.contains("rings as wide as the elements"), "{refused}");
    }

    #[test]
    fn bands_that_nobody_asked_for_do_not_refuse_a_design() {
        let own = design::NEW_DESIGN.replace("NAME", "own");
        let parsed = |text: &str| design::parse("own.toml", text, Path::new(""));
        let usual = parsed(&own).expect("valid");
        assert_eq!(Model::all_of(&usual).len(), 4);
        assert_eq!(Model::left_out(&usual), None);
        let hybrid = "element_width_um = 10.0";
        let own = own.replace("[hybrid]", "#").replace(hybrid, "#");
        let x_rays = own.replace("wavelength_nm = 550.0", "wavelength_nm = 10.0");
        let rays_only = parsed(&x_rays).expect("valid");
        assert_eq!(Model::all_of(&rays_only), [Model::Geometric]);
        let why = Model::left_out(&rays_only).expect("a reason");
        assert!(why.contains("light.wavelength_nm = 10, not 15965 at ring 8"), "{why}");
        assert!(Model::Hybrid.available(&rays_only).is_err());
        let asked = x_rays + "\n[hybrid]\ntolerance = 0.01\n";
        let refused = parsed(&asked).expect_err("bands are asked for");
        let refused = refused.to_string();
        assert!(refused.contains("rings narrow enough for waves"), "{refused}");
    }
}
