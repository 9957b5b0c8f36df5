// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ends of the search for wavelengths.

use super::*;
use metrics::far_field::PeakPlace;
use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;

fn figure(key: &'static str, peak_place: PeakPlace) -> Figure {
    Figure {
        key: key.into(),
        label: key.into(),
        unit: Unit::Fraction,
        entry: FigureEntry { peak_place, ..FigureEntry::new(Estimate::new(0.5, 0.001)) },
    }
}

#[test]
fn a_search_ends_at_the_tolerance_or_where_noise_hides_the_change() {
    let figures =
        [figure("uniformity", PeakPlace::OffAxis), figure("peak_angle_deg", PeakPlace::OffAxis)];
    let of = |uniformity: f64, angle: f64, error: f64| {
        let changes = [
            ("uniformity".into(), Estimate::new(uniformity, error)),
            ("peak_angle_deg".into(), Estimate::new(angle, 1e-3)),
        ];
        verdict(&figures, &changes, 0.01)
    };
    let (worst, stop) = of(-0.009, 0.5, 1e-4);
    assert!((worst - 0.009).abs() < 1e-15 && stop == Some(StoppedBy::Tolerance));
    // A degree counts as a point.
    assert_eq!(of(0.0, -1.1, 1e-4).1, None);
    assert_eq!(of(0.02, 0.0, 1e-4).1, None);
    assert_eq!(of(0.02, 0.0, 0.011).1, Some(StoppedBy::Statistics));
}

#[test]
fn a_peak_angle_of_noise_decides_nothing() {
    let changes = [("peak_angle_deg".into(), Estimate::new(40.0, 0.1))];
    let of = |place| verdict(&[figure("peak_angle_deg", place)], &changes, 0.01).1;
    assert_eq!(of(PeakPlace::OnAxis), Some(StoppedBy::Tolerance));
    assert_eq!(of(PeakPlace::NotResolved), Some(StoppedBy::Tolerance));
    assert_eq!(of(PeakPlace::OffAxis), None);
    // Figures beside the decisive ones are reported only.
    let aside = [("illuminance_valley_to_peak".into(), Estimate::new(1.0, 0.0))];
    let figures = [figure("illuminance_valley_to_peak", PeakPlace::OffAxis)];
    assert_eq!(verdict(&figures, &aside, 0.01).1, Some(StoppedBy::Tolerance));
}
