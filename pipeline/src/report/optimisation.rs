// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of an optimisation, from `optimise.json`.

use anyhow::Result;

use super::plots::{Heading, MarkedLine, Picture, marked_lines, pareto_front, search_convergence};
use crate::metrics::Estimate;
use crate::quantity::{Curve, Unit};
use crate::results::optimisation::{GenerationEntry, OptimisationFile};

impl OptimisationFile {
    fn heading(&self, title: &str) -> Heading {
        Heading::new(title, format!("{} from {}", self.name, self.design))
    }

    /// The convergence of the search: the best candidate of every generation that met the
    /// constraints, over the number of candidates, and the verified objective before and after.
    ///
    /// # Errors
    /// Values that are no curve.
    pub fn convergence_picture(&self) -> Result<Picture> {
        let heading = self.heading("Convergence of the search");
        search_convergence(&heading, &self.convergence()?)
    }

    fn convergence(&self) -> Result<Vec<Curve>> {
        let (mut at, mut value, mut error) = (Vec::new(), Vec::new(), Vec::new());
        let mut candidates = 0.0;
        for generation in self.stages.iter().flat_map(|stage| &stage.generations) {
            candidates += generation.candidates as f64;
            let GenerationEntry { best, standard_error, feasible, .. } = generation;
            if let (Some(best), Some(standard_error), true) = (best, standard_error, feasible) {
                at.push(candidates);
                value.push(*best);
                error.push(*standard_error);
            }
        }
        let level = |label: &str, e: Estimate| {
            let errors = vec![e.standard_error; 2];
            Curve::new(label, vec![0.0, candidates], vec![e.value; 2], errors)
        };
        let mut curves = Vec::new();
        if at.len() > 1 {
            let label = "best of a generation, in the search";
            curves.push(Curve::new(label, at, value, error)?);
        }
        if let Some(before) = self.objective.before {
            curves.push(level("verified before", before)?);
        }
        curves.push(level("verified after", self.objective.after)?);
        Ok(curves)
    }

    /// Change of the objective for one unit of each coefficient, where it was looked at.
    ///
    /// # Errors
    /// Values that cannot be drawn.
    pub fn sensitivity_picture(&self) -> Result<Option<Picture>> {
        let lines = self.coefficients.iter().filter_map(|c| {
            let sensitivity = c.sensitivity?;
            Some(MarkedLine {
                label: c.variable.clone(),
                marks: vec![(String::new(), sensitivity.value, sensitivity.standard_error)],
                least: f64::NEG_INFINITY,
            })
        });
        let lines: Vec<MarkedLine> = lines.collect();
        if lines.is_empty() {
            return Ok(None);
        }
        let heading = self.heading("Sensitivities at the design found");
        let words = "change of the objective for one unit";
        marked_lines(&heading, words, Unit::Relative, &lines).map(Some)
    }

    /// The Pareto front, where one was sought.
    ///
    /// # Errors
    /// Values that cannot be drawn.
    pub fn front_picture(&self) -> Result<Option<Picture>> {
        let Some(front) = &self.front else {
            return Ok(None);
        };
        let heading = self.heading("Pareto front");
        let names = front.figures.each_ref().map(String::as_str);
        let designs: Vec<[Estimate; 2]> = front.designs.iter().map(|d| d.figures).collect();
        pareto_front(&heading, names, &designs, front.before).map(Some)
    }
}
