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

#[test]
fn what_leaves_and_its_colour_decide_where_other_figures_are_noise() {
    let keys = ["uniformity", "escaped_up", "plane_u_prime", "flux.screen", "u_prime.screen"];
    let figures = keys.map(|key| figure(key, PeakPlace::OffAxis));
    let of = |changed: &str, by: f64| {
        let changes = keys.map(|key| {
            // The uniformity is noise.
            let noise = if key == "uniformity" { 0.2 } else { 1e-4 };
            let value = if key == changed { by } else { 0.0 };
            (key.into(), Estimate::new(value, noise))
        });
        verdict(&figures, &changes, 0.005)
    };
    assert_eq!(of("uniformity", 0.05).1, Some(StoppedBy::Statistics));
    for key in &keys[1..] {
        assert_eq!(of(key, 0.0065).1, None, "{key}");
    }
    // A receiver sees half of the light here: what counts is the part of its own.
    assert_eq!(of("flux.screen", 0.0024), (0.0048, Some(StoppedBy::Tolerance)));
    assert_eq!(of("flux.screen", 0.0026).1, None);
}
