// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design with more packages at the same pitch.

use tracer::glam::DVec3;
use tracer::receiver::DetectorRectangle;
use tracer::{Detector, Measurement, Shape};

use super::MAX_BINS as MAX_PLANE_BINS;
use super::receivers::MAX_BINS;
use crate::resolved::Design;
use crate::resolved::array::PackagePositions;
use crate::resolved::receivers::CheckedReceiver;
use crate::resolved::solids::CheckedSolid;
use crate::schema::receivers::{Normal, ReceiverForm};
use crate::schema::solids::{Per, SolidForm};
use crate::schema::{Arrangement, is_default};

impl Design {
    /// The design with so many columns and rows of packages at its pitch. Walls, films and plates over
    /// all are as far from the outermost packages as before. Of the receivers the one called `receiver`
    /// is left, wider by as much. `None` where something would not repeat: packages that differ or stand
    /// in no full rows, other solids that stand once, prints other than dots by rule at a pitch that
    /// divides theirs, a receiver that faces or looks aside, reads some light alone or has bins that do
    /// not divide the pitch. `None` as well of more bins or dots than a design may have.
    pub fn widened(&self, packages: [usize; 2], receiver: Option<&str>) -> Option<Self> {
        let arrangement = Arrangement::Square;
        let PackagePositions::Grid { columns, rows, arrangement: Arrangement::Square } =
            self.array.positions
        else {
            return None;
        };
        let array = &self.array;
        let are_alike = array.drives.is_none()
            && !(array.is_offset() || array.is_turned() || array.is_scaled())
            && self.led.offsets_mm.is_empty()
            && self.led.tilts_deg.is_empty();
        if !are_alike || self.print_of_one_place(self.array.pitch_mm.along()).is_some() {
            return None;
        }
        let pitch_mm = self.array.pitch_mm.along();
        let before = [columns, rows];
        let more_mm = [0, 1].map(|k| (packages[k] - before[k]) as f64 * pitch_mm[k]);
        let mut wide = self.clone();
        let [columns, rows] = packages;
        wide.array.positions = PackagePositions::Grid { columns, rows, arrangement };
        if let Some(size) = wide.housing.as_mut().and_then(|housing| housing.inner_size_mm.as_mut())
        {
            (0..2).for_each(|k| size[k] += more_mm[k]);
        }
        let axes = self.array.axes_mm();
        let reach = [0, 1].map(|k| axes.iter().map(|at| at[k].abs()).fold(0.0, f64::max));
        for plate in wide.solids.iter_mut().filter(|solid| solid.per() == Per::Array) {
            plate.widen(reach, more_mm)?;
        }
        wide.prints = wide.printed_again()?;
        wide.receivers.retain(|kept| Some(kept.name()) == receiver);
        for receiver in &mut wide.receivers {
            receiver.widen(more_mm)?;
        }
        if receiver.is_some() {
            // Nothing reads the plane.
            let least = pitch_mm[0].min(pitch_mm[1]);
            wide.receiver.bin_mm = wide.receiver.bin_mm.max(0.25 * least);
        }
        let plane = wide.cells_mm().map(|length| length / wide.receiver.bin_mm);
        let bins: usize = wide.receivers.iter().map(|receiver| receiver.detector.bins()).sum();
        (plane[0] * plane[1] <= MAX_PLANE_BINS && bins as f64 <= MAX_BINS).then_some(wide)
    }
}

impl CheckedSolid {
    /// Makes a film, or a level plate over all packages, longer along x and y.
    fn widen(&mut self, reach_mm: [f64; 2], more_mm: [f64; 2]) -> Option<()> {
        let [x, y, _] = self.stated.shared.position_mm.0;
        let SolidForm::Box(flat) = &mut self.stated.kind else { return None };
        let is_level = flat.rotation_deg.is_none_or(|angles| is_default(&angles.0));
        let is_over_all = (0..2).all(|k| 0.5 * flat.size_mm.0[k] >= reach_mm[k]);
        if !(is_level && is_over_all && is_default(&[x, y])) {
            return None;
        }
        (0..2).for_each(|k| flat.size_mm.0[k] += more_mm[k]);
        let half = 0.5 * DVec3::from_array(flat.size_mm.0);
        self.symmetry = self.symmetry.min(self.form.symmetry(&self.stated.kind));
        self.form.pieces = vec![Shape::cuboid(-half, half).ok()?];
        for at in self.form.outline.iter_mut().filter(|at| at[0] > 0.0) {
            at[0] += 0.5 * more_mm[0];
        }
        Some(())
    }
}

impl CheckedReceiver {
    /// Makes a level rectangle longer along x and y, by whole bins.
    fn widen(&mut self, more_mm: [f64; 2]) -> Option<()> {
        let stated = self.stated.kind.rectangle().filter(|of| of.normal == Normal::Up)?;
        if self.stated.shared.only.is_some() {
            return None;
        }
        let (mut size_mm, mut bins) = (stated.size_mm, stated.bins);
        for k in 0..2 {
            let more = more_mm[k] * bins[k] as f64 / size_mm[k];
            if (more - more.round()).abs() > 1e-6 {
                return None;
            }
            size_mm[k] += more_mm[k];
            bins[k] += more.round() as usize;
        }
        let centre = DVec3::from_array(stated.position_mm);
        let wide = DetectorRectangle::new(stated.normal.facing(), centre, size_mm, bins).ok()?;
        let Detector { measurement, .. } = &mut self.detector;
        let (size, count) = match &mut self.stated.kind {
            ReceiverForm::Plane(stated) => (&mut stated.size_mm, &mut stated.bins),
            ReceiverForm::Luminance(stated) => (&mut stated.size_mm, &mut stated.bins),
            _ => return None,
        };
        (size.0, count.0) = (size_mm, bins);
        match measurement {
            Measurement::Luminance(_, angles) if angles.has_view() => return None,
            Measurement::Plane(rectangle) | Measurement::Luminance(rectangle, _) => {
                *rectangle = wide;
            }
            _ => return None,
        }
        Some(())
    }
}
