// SPDX-License-Identifier: MIT OR Apache-2.0
//! Spectra against closed forms and published figures.

use super::*;

fn table(wavelength_nm: &[f64], power: &[f64]) -> SpectralPower {
    SpectralPower::Table { wavelength_nm: wavelength_nm.to_vec(), power: power.to_vec() }
}

fn led() -> SpectralPower {
    SpectralPower::WhiteLed(WhiteLed {
        blue_nm: 450.0,
        blue_fwhm_nm: 20.0,
        phosphor_nm: 560.0,
        phosphor_fwhm_nm: 120.0,
        blue_part: 0.25,
    })
}

fn spectrum(source: SpectralPower, weighting: Weighting) -> Spectrum {
    let sampling = match source {
        SpectralPower::Lines { .. } => None,
        _ => Some(Sampling::Samples(7)),
    };
    Spectrum::new(source, weighting, sampling).expect("valid")
}

fn refused(source: SpectralPower, weighting: Weighting, sampling: Option<Sampling>) -> String {
    Spectrum::new(source, weighting, sampling).expect_err("refused").to_string()
}

fn integral(spectrum: &Spectrum, count: usize, f: impl Fn(f64) -> f64) -> f64 {
    spectrum.rule(count).iter().map(|&(nm, w)| w * f(nm)).sum()
}

#[test]
fn equal_energy_has_the_efficacy_of_the_sum_of_v() {
    // ∫ V dλ = 106.857 nm (the sum of ȳ every nm, ISO/CIE 11664-1), over the 470 nm of the table.
    for weighting in [Weighting::Radiometric, Weighting::Photometric] {
        let flat = spectrum(table(&[360.0, 830.0], &[2.0, 2.0]), weighting);
        let expected = 683.0 * 106.857 / 470.0;
        let got = flat.luminous_efficacy_lm_per_w;
        assert!((got / expected - 1.0).abs() < 1e-6, "{got} and {expected}");
    }
    // Half of that light lies below 560 nm, where the eye's curve is nearly symmetrical about 559
    // nm.
    let flat = spectrum(table(&[360.0, 830.0], &[1.0, 1.0]), Weighting::Photometric);
    let knots = metrics::colour_matching::knots_nm().filter(|&nm| nm < 560.0);
    let below: f64 = knots.map(metrics::photopic::v).sum();
    let half = 0.5 * 106.857;
    // The trapezium to 560 nm: all rows before it and half of its own.
    assert!((flat.median_nm() - 560.0) * (half - below - 0.5 * metrics::photopic::v(560.0)) >= 0.0);
    assert!((flat.median_nm() - 559.0).abs() < 2.0, "{}", flat.median_nm());
}

#[test]
fn a_line_at_the_peak_of_the_eye_has_683_lumens_per_watt() {
    let line = |nm: f64| SpectralPower::Lines { wavelength_nm: vec![nm], power: vec![3.0] };
    let green = spectrum(line(555.0), Weighting::Photometric);
    assert!((green.luminous_efficacy_lm_per_w - 683.0).abs() < 1e-9);
    assert_eq!(green.rule(7), [(555.0, 1.0)]);
    assert_eq!((green.median_nm(), green.range_nm), (555.0, [555.0, 555.0]));
    // Helium-neon and blue dies, by the rows of ISO/CIE 11664-1 about them.
    for (nm, v) in
        [(632.8, 0.2 * 0.244_889_6 + 0.8 * 0.235_334_4), (452.0, 0.041_768), (412.0, 0.001_530_752)]
    {
        let line = spectrum(line(nm), Weighting::Radiometric);
        let expected = 683.0 * v;
        assert!((line.luminous_efficacy_lm_per_w - expected).abs() < 1e-5, "{nm}: {line:?}");
    }
}

/// CIE illuminant LED-B5 (CIE 015:2018, table 12.2), rows every 5 nm joined by straight lines: u', v'
/// and efficacy by plain sums over the rows of ISO/CIE 11664-1 every nm. The CIE states 6598 K, by its
/// own interpolation.
#[test]
fn a_white_led_of_the_cie_has_its_colour() {
    #[rustfmt::skip]
    let power = [
        0.0, 0.01, 0.01, 0.03, 0.07, 0.16, 0.35, 0.78, 1.67, 3.3, 5.94, 9.92, 16.15, 25.15, 32.34,
        31.18, 23.46, 16.39, 12.08, 9.08, 7.21, 6.48, 6.49, 7.05, 8.1, 9.45, 10.88, 12.22, 13.38,
        14.29, 14.98, 15.48, 15.81, 16.01, 16.1, 16.13, 16.1, 15.98, 15.77, 15.5, 15.15, 14.76,
        14.31, 13.79, 13.22, 12.59, 11.91, 11.2, 10.47, 9.73, 9.0, 8.27, 7.57, 6.9, 6.25, 5.65,
        5.08, 4.55, 4.06, 3.61, 3.22, 2.86, 2.54, 2.26, 2.0, 1.75, 1.54, 1.36, 1.2, 1.05, 0.93,
        0.82, 0.72, 0.64, 0.56, 0.49, 0.44, 0.39, 0.35, 0.31, 0.27,
    ];
    let nm: Vec<f64> = (0..81).map(|row| 380.0 + 5.0 * f64::from(row)).collect();
    let led = spectrum(table(&nm, &power), Weighting::Photometric);
    let sum = led.tristimulus(&[555.0])[0];
    let [u, v, kelvin, _] = metrics::chromaticity::figures(sum);
    assert!((u - 0.199_220).abs() < 2e-5 && (v - 0.465_418).abs() < 2e-5, "{u} {v}");
    assert!((kelvin - 6591.0).abs() < 2.0, "{kelvin}");
    let efficacy = led.luminous_efficacy_lm_per_w;
    assert!((efficacy / 305.1873 - 1.0).abs() < 2e-5, "{efficacy}");
    assert!((683.0 * sum[1] / efficacy - 1.0).abs() < 2e-4, "{sum:?}");
}

#[test]
fn lines_are_weighted_by_power_or_by_flux() {
    let lines = SpectralPower::Lines {
        wavelength_nm: vec![450.0, 500.0, 530.0, 620.0],
        power: vec![1.0, 0.0, 2.0, 1.0],
    };
    let power = spectrum(lines.clone(), Weighting::Radiometric);
    assert_eq!(power.rule(1), [(450.0, 0.25), (530.0, 0.5), (620.0, 0.25)]);
    let flux = spectrum(lines, Weighting::Photometric).rule(1);
    let total = 0.038 + 2.0 * 0.862 + 0.381;
    for ((_, weight), v) in flux.iter().zip([0.038, 2.0 * 0.862, 0.381]) {
        assert!((weight - v / total).abs() < 1e-12);
    }
}

#[test]
fn a_flat_spectrum_is_integrated_as_straight_lines() {
    let flat = spectrum(table(&[900.0, 1100.0], &[1.0, 1.0]), Weighting::Radiometric);
    for count in quadrature::COUNTS {
        let rule = flat.rule(count);
        assert!((rule.iter().map(|p| p.1).sum::<f64>() - 1.0).abs() < 1e-14);
        assert!(rule.iter().all(|p| p.1 > 0.0));
        let finer = flat.rule(2 * count + 1);
        assert!(
            rule.iter()
                .all(|(nm, _)| finer.iter().any(|(finer, _)| nm.to_bits() == finer.to_bits())),
            "{count}"
        );
        // Wavelengths are rounded to 0.001 nm.
        assert!((integral(&flat, count, |nm| nm) - 1000.0).abs() < 1e-3);
    }
}

/// Exact and sampled integrals of a filter over the weighted power, and over X, Y and Z.
fn filtered(white: &Spectrum, count: usize, filter: impl Fn(f64) -> f64) -> ([f64; 4], [f64; 4]) {
    const SLICES: usize = 100_000;
    let density = Density::new(&white.source, false);
    let mut exact = [0.0; 4];
    let mut whole = 0.0;
    for k in 0..SLICES {
        let nm = density.quantile_nm((k as f64 + 0.5) / SLICES as f64);
        let [x, y, z] = metrics::colour_matching::xyz(nm);
        let weight = if white.weighting == Weighting::Photometric { y } else { 1.0 };
        whole += weight;
        for (sum, value) in exact.iter_mut().zip([weight, x, y, z]) {
            *sum += value * filter(nm);
        }
    }
    exact[0] /= whole;
    exact[1..].iter_mut().for_each(|value| *value /= SLICES as f64);
    let nodes: Vec<f64> = white.rule(count).into_iter().map(|(nm, _)| nm).collect();
    let mut found = [integral(white, count, &filter), 0.0, 0.0, 0.0];
    for (nm, xyz) in nodes.iter().zip(white.tristimulus(&nodes)) {
        for (sum, value) in found[1..].iter_mut().zip(xyz) {
            *sum += value * filter(*nm);
        }
    }
    (exact, found)
}

/// Chromaticity (x, y).
fn chromaticity([_, x, y, z]: [f64; 4]) -> [f64; 2] {
    [x, y].map(|value| value / (x + y + z))
}

#[test]
fn colours_and_fluxes_behind_filters_converge() {
    // An edge filter, a dye whose absorption falls by e over 40 nm, interference.
    let edge = |nm: f64| 1.0 / (1.0 + (-(nm - 520.0) / 8.0).exp());
    let dye = |nm: f64| (-3.0 * (-(nm - 420.0) / 40.0).exp()).exp();
    let film = |nm: f64| 0.6 + 0.4 * (std::f64::consts::TAU * 600.0 / nm).cos();
    let filters: [&dyn Fn(f64) -> f64; 3] = [&edge, &dye, &film];
    for weighting in [Weighting::Radiometric, Weighting::Photometric] {
        let white = spectrum(led(), weighting);
        for (number, filter) in filters.iter().enumerate() {
            let mut colours = Vec::new();
            for (count, most) in [(7, 2e-2), (15, 5e-3), (31, 1.2e-3)] {
                let (exact, found) = filtered(&white, count, filter);
                assert!(
                    (found[0] - exact[0]).abs() < most,
                    "{weighting:?} {number} {count}: {} {}",
                    found[0],
                    exact[0]
                );
                let [a, b] = [exact, found].map(chromaticity);
                let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
                assert!(distance < most, "{weighting:?} {number} {count}: {a:?} {b:?}");
                colours.push(found);
            }
            // What the last wavelengths change bounds what more would.
            let (exact, fine) = filtered(&white, 31, filter);
            let change = (fine[0] - colours[1][0]).abs();
            assert!((fine[0] - exact[0]).abs() < change.max(2e-4), "{weighting:?} {number}");
        }
    }
}

#[test]
fn rules_converge_on_an_oscillating_function_of_a_white_led() {
    // What interference makes of a step of 1.5 µm: cos(2π h (n - 1)/λ), integrated finely here.
    let f = |nm: f64| (std::f64::consts::TAU * 1500.0 * 0.41 / nm).cos();
    for weighting in [Weighting::Radiometric, Weighting::Photometric] {
        let white = spectrum(led(), weighting);
        let [low, high] = white.range_nm;
        let SpectralPower::WhiteLed(WhiteLed { blue_part, .. }) = white.source else {
            unreachable!("a white LED")
        };
        let gauss = |nm: f64, peak: f64, fwhm: f64| {
            let x = (nm - peak) / fwhm * 2.354_820_045;
            if x.abs() <= 3.0 { (-0.5 * x * x).exp() / fwhm } else { 0.0 }
        };
        let (mut sum, mut weight) = (0.0, 0.0);
        for k in 0..200_000 {
            let nm = low + (high - low) * (f64::from(k) + 0.5) / 2e5;
            let p =
                blue_part * gauss(nm, 450.0, 20.0) + (1.0 - blue_part) * gauss(nm, 560.0, 120.0);
            let w =
                if weighting == Weighting::Photometric { p * metrics::photopic::v(nm) } else { p };
            sum += w * f(nm);
            weight += w;
        }
        let errors = [3, 7, 15, 31].map(|n| (integral(&white, n, f) - sum / weight).abs());
        assert!(
            errors[3] < 1e-3 && errors[2] < 5e-3 && errors[1] < 5e-2,
            "{weighting:?}: {errors:?}"
        );
    }
}

#[test]
fn a_white_led_is_plausible() {
    let white = spectrum(led(), Weighting::Photometric);
    // The most that white light of one colour temperature or another can have: 250 to 370 lm/W
    // [Murphy2012].
    let efficacy = white.luminous_efficacy_lm_per_w;
    assert!((250.0..370.0).contains(&efficacy), "{efficacy}");
    assert!((540.0..570.0).contains(&white.median_nm()));
    // A quarter of the radiant power is blue: the quantile at 0.125 is the die's peak, but for the
    // phosphor's faint tail below it.
    let power = Density::new(&led(), false);
    assert!((power.quantile_nm(0.125) - 450.0).abs() < 1.0);
    assert!((power.total() - 1.0).abs() < 1e-6, "{}", power.total());
    // The order of what is said of a spectrum does not matter to it: without a die it is its
    // phosphor.
    let mut bare = led();
    if let SpectralPower::WhiteLed(led) = &mut bare {
        led.blue_part = 0.0;
    }
    let bare = spectrum(bare, Weighting::Radiometric);
    assert!((bare.median_nm() - 560.0).abs() < 2e-3);
    assert!((bare.range_nm[0] - (560.0 - 3.0 * 120.0 / 2.354_82)).abs() < 1e-3);
}

#[test]
fn gaps_and_zeros_hold_no_wavelength() {
    let gap = table(&[400.0, 410.0, 420.0, 600.0, 610.0, 620.0], &[0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let gap = spectrum(gap, Weighting::Radiometric);
    for (nm, _) in gap.rule(31) {
        assert!((400.0..=420.0).contains(&nm) || (600.0..=620.0).contains(&nm), "{nm}");
    }
    let padded = table(&[300.0, 400.0, 500.0, 900.0], &[0.0, 0.0, 1.0, 0.0]);
    let [low, high] = spectrum(padded, Weighting::Radiometric).range_nm;
    assert!((low - 400.0).abs() < 1e-12 && (high - 900.0).abs() < 1e-12);
}

#[test]
fn a_node_without_weight_stands_for_colours_or_is_left_out() {
    // A peak, and a tail of a millionth of its power, which the cube root gives nodes.
    let tail = {
        let nm = [540.0, 550.0, 560.0, 561.0, 800.0];
        spectrum(table(&nm, &[0.0, 1.0, 0.0, 1e-6, 1e-6]), Weighting::Radiometric)
    };
    let rule = tail.rule(31);
    assert!(rule.len() < 31 && rule.iter().all(|(_, weight)| *weight > 0.0), "{rule:?}");
    let whole: f64 = rule.iter().map(|(_, weight)| weight).sum();
    assert!((whole - 1.0).abs() < 1e-12);
    // Deep blue weighs nothing in lumens, and its Z is seen.
    let blue = table(&[380.0, 385.0, 390.0, 540.0, 550.0, 560.0], &[0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let rule = spectrum(blue, Weighting::Photometric).rule(31);
    assert!(rule.iter().any(|(nm, _)| *nm < 390.0), "{rule:?}");
    // The one wavelength of `samples = 1` is said.
    let one = Spectrum::new(led(), Weighting::Radiometric, Some(Sampling::Samples(1)));
    let one = one.expect("valid");
    let said = one.describe();
    assert!(said.contains(&format!("one wavelength, {} nm", one.rule(1)[0].0)), "{said}");
    assert!((one.rule(1)[0].0 - one.median_nm()).abs() > 0.0, "{said}");
}

#[test]
fn bad_spectra_are_refused_by_key() {
    use Weighting::{Photometric, Radiometric};
    let seven = Some(Sampling::Samples(7));
    let rows = |nm: &[f64], p: &[f64]| refused(table(nm, p), Radiometric, seven);
    for (message, words) in [
        (rows(&[400.0, 500.0], &[1.0, -1.0]), "power = -1: expected finite numbers from 0"),
        (rows(&[400.0, 500.0], &[1.0, f64::NAN]), "power = NaN"),
        (rows(&[400.0, 500.0], &[0.0, 0.0]), "power = 0 everywhere"),
        (rows(&[], &[]), "wavelength_nm = 0 wavelengths: expected at least 2"),
        (rows(&[500.0, 400.0], &[1.0, 1.0]), "wavelength_nm = 400 after 500"),
        (rows(&[400.0, 400.0], &[1.0, 1.0]), "ascending"),
        (rows(&[400.0, 500.0], &[1.0]), "power = 1 numbers"),
        (rows(&[1.0, 500.0], &[1.0, 1.0]), "wavelength_nm = 1: expected wavelengths from 10"),
        (
            refused(table(&[300.0, 500.0], &[1.0, 1.0]), Photometric, seven),
            "weighting = photometric for power from 300.0",
        ),
        (
            refused(table(&[500.0, 900.0], &[1.0, 1.0]), Photometric, seven),
            "from 360 to 830 nm only",
        ),
        (
            refused(led(), Radiometric, Some(Sampling::Samples(8))),
            "samples = 8: expected one of 1, 3, 7, 15, 31",
        ),
        (refused(led(), Radiometric, Some(Sampling::Tolerance(0.0))), "tolerance = 0"),
        (refused(led(), Radiometric, None), "tolerance = missing"),
        (
            refused(
                SpectralPower::Lines { wavelength_nm: vec![550.0], power: vec![1.0] },
                Radiometric,
                seven,
            ),
            "kind = lines",
        ),
    ] {
        assert!(message.contains(words), "no `{words}` in: {message}");
    }
    let mut wide = led();
    if let SpectralPower::WhiteLed(led) = &mut wide {
        led.phosphor_fwhm_nm = 500.0;
    }
    assert!(refused(wide, Radiometric, seven).contains("phosphor_fwhm_nm = 500"));
}
