// SPDX-License-Identifier: MIT OR Apache-2.0
use std::f64::consts::PI;

use super::*;

const BINS: AngularBins =
    AngularBins { bin_deg: 2.0, polar: 90, azimuths: 36, bins: BinPlacement::Between };

const JUDGE: FarFieldReading = FarFieldReading {
    recorded: BINS,
    read_bin_deg: 2.0,
    read_bins: BinPlacement::Between,
    centre_deg: 2.0,
    peak: PeakMethod::Parabola,
    peak_fit_deg: 6.0,
    cut_deg: None,
    symmetry: Symmetry::Square,
};

/// Powers of the intensity `f(θ°)`, spread evenly over azimuth, integrated over each ring.
fn powers(f: impl Fn(f64) -> f64) -> Vec<f64> {
    powers_in(BINS, f)
}

fn powers_in(sphere: AngularBins, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let n = 200;
    let ring = |i: usize| -> f64 {
        let step = sphere.bin_deg / f64::from(n);
        let at = |k: i32| sphere.bin_deg * i as f64 + (f64::from(k) + 0.5) * step;
        let weight = |theta: f64| f(theta) * theta.to_radians().sin();
        2.0 * PI * step.to_radians() * (0..n).map(|k| weight(at(k))).sum::<f64>()
    };
    let spread = |i: usize| vec![ring(i) / sphere.azimuths as f64; sphere.azimuths];
    (0..sphere.polar).flat_map(spread).collect()
}

fn twice(p: &[f64]) -> Grouped {
    Grouped::new(vec![p.iter().map(|v| 0.4 * v).collect(), p.iter().map(|v| 0.6 * v).collect()])
}

#[test]
fn parabola_finds_the_peak_between_bins() {
    let f = |t: f64| 1.0 - ((t - 26.3) / 40.0).powi(2);
    let figures = JUDGE.figures(&twice(&powers(|t| f(t).max(0.0))));
    assert!((figures.peak_angle_deg.value - 26.3).abs() < 0.02, "{figures:?}");
    assert!((figures.peak_w_per_sr.value - 1.0).abs() < 1e-3);
    // Mean over the cap below 2°, where sin θ weights the outer part: θ = 4/3°.
    assert!((figures.centre_to_peak.value - f(4.0 / 3.0)).abs() < 2e-3);
    assert!(figures.peak_angle_deg.standard_error < 1e-9);
    let plain = JUDGE.plain(&powers(|t| f(t).max(0.0)));
    assert!((plain.peak_angle_deg - figures.peak_angle_deg.value).abs() < 1e-9);
    assert!((plain.centre_to_peak - figures.centre_to_peak.value).abs() < 1e-12);
    assert!(plain.peak_angle_parabola_deg.is_nan() && figures.peak_angle_parabola_deg.is_none());
}

#[test]
fn beam_and_field_angle_are_those_of_closed_forms() {
    let widths = |f: &dyn Fn(f64) -> f64| {
        let figures = JUDGE.figures(&twice(&powers(f)));
        let plain = JUDGE.plain(&powers(f));
        for (grouped, plain) in figures.widths_deg.iter().zip(&plain.widths_deg) {
            assert!(grouped.0.value.is_nan() == plain.is_nan());
            assert!(plain.is_nan() || (grouped.0.value - plain).abs() < 1e-9, "{figures:?}");
        }
        figures.widths_deg.map(|(width, _)| width.value)
    };
    let near = |found: f64, expected: f64| (found - expected).abs() < 0.3;
    // A Lambertian source: half at 60 degrees, a tenth at acos 0.1.
    let [beam, field] = widths(&|t| t.to_radians().cos().max(0.0));
    assert!(near(beam, 120.0) && near(field, 2.0 * 0.1f64.acos().to_degrees()), "{beam} {field}");
    // A batwing: its outer flank counts.
    let [beam, field] = widths(&|t| (1.0 - ((t - 50.0) / 20.0).powi(2)).max(0.05));
    let half = 50.0 + 20.0 * 0.5f64.sqrt();
    let tenth = 50.0 + 20.0 * 0.9f64.sqrt();
    assert!(near(beam, 2.0 * half) && near(field, 2.0 * tenth), "{beam} {field}");
    // Light that ends at the horizon with a fifth of its peak has no field angle above it; with
    // light below the horizon the angle goes on.
    let ends = |t: f64| if t < 90.0 { 0.2 + 0.8 * t.to_radians().cos() } else { 0.0 };
    let [beam, field] = widths(&ends);
    assert!(near(beam, 2.0 * 0.375f64.acos().to_degrees()) && field.is_nan(), "{beam} {field}");
    let [_, field] = widths(&|t| 1.0 - t / 130.0 + f64::from(t > 130.0) * (t / 130.0 - 1.0));
    assert!(near(field, 234.0), "{field}");
    // Light that is alike in all directions has neither.
    assert!(widths(&|_| 1.0).iter().all(|width| width.is_nan()));
}

#[test]
fn lambertian_peaks_on_the_axis() {
    let figures = JUDGE.figures(&twice(&powers(|t| t.to_radians().cos().max(0.0) / PI)));
    assert!(figures.peak_angle_deg.value < 1.0, "{figures:?}");
    assert!((figures.centre_to_peak.value - 1.0).abs() < 1e-3);
}

#[test]
fn a_peak_off_the_axis_must_stand_out_of_the_noise() {
    let f = |t: f64| (1.0 - ((t - 26.3) / 60.0).powi(2)).max(0.0);
    let dented = powers(f);
    let even = powers(|t| t.to_radians().cos().max(0.0) / PI);
    // Sixteen groups whose rings scatter by `noise`, of one sign or the other by a Walsh code of
    // the ring.
    let noisy = |p: &[f64], noise: f64| {
        let group = |g: usize| {
            let of = |(k, w): (usize, &f64)| {
                let code = (k / BINS.azimuths * 5 + 3) % 15 + 1;
                let sign = if (g & code).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
                w / 16.0 * (1.0 + noise * sign)
            };
            p.iter().enumerate().map(of).collect()
        };
        JUDGE.figures(&Grouped::new((0..16).map(group).collect()))
    };
    let place = |p: &[f64], noise: f64| noisy(p, noise).peak_place;
    assert_eq!(place(&dented, 0.01), PeakPlace::OffAxis);
    assert_eq!(place(&dented, 0.1), PeakPlace::OffAxis);
    assert_eq!(place(&dented, 1.0), PeakPlace::NotResolved);
    assert_eq!(place(&even, 0.001), PeakPlace::OnAxis);
    for noise in [0.1, 1.0] {
        assert_eq!(place(&even, noise), PeakPlace::NotResolved, "{noise}");
    }
}

#[test]
fn bins_that_noise_makes_alike_are_stated() {
    let f = |t: f64| (1.0 - ((t - 26.3) / 60.0).powi(2)).max(0.0);
    let by_bin = FarFieldReading { peak: PeakMethod::Bin, ..JUDGE };
    let exact = by_bin.figures(&twice(&powers(f)));
    let middle = exact.peak_angle_deg.value;
    assert_eq!(exact.peak_range_deg, Some([middle; 2]));
    let half = 0.5 * JUDGE.read_bin_deg;
    assert_eq!(exact.peak_edges_deg, Some([middle - half, middle + half]));
    // Eight groups in which every ring scatters by its own Walsh code.
    let group = |g: usize| {
        let of = |(k, w): (usize, &f64)| {
            let odd = (g & (k / BINS.azimuths % 7 + 1)).count_ones() % 2 == 1;
            w / 8.0 * if odd { 0.99 } else { 1.01 }
        };
        powers(f).iter().enumerate().map(of).collect()
    };
    let noisy = by_bin.figures(&Grouped::new((0..8).map(group).collect()));
    let [first, last] = noisy.peak_range_deg.expect("a peak that is a bin");
    assert!(first < middle && last > middle, "{first} {last}");
    // Standard error of the difference at most 0.01 (2 / 7)^(1/2) of the peak: within three of it
    // lie bins up to 60° sqrt(0.016) from the largest.
    assert!(first > middle - 10.0 && last < middle + 10.0, "{first} {last}");
    assert_eq!(JUDGE.figures(&twice(&powers(f))).peak_range_deg, None);
}

#[test]
fn bins_taken_together_read_as_bins_recorded_so() {
    let f = |t: f64| (1.0 - ((t - 26.3) / 60.0).powi(2)).max(0.0);
    let coarse = AngularBins { bin_deg: 6.0, polar: 30, ..BINS };
    let (fine, fewer) = (powers(f), powers_in(coarse, f));
    let judge =
        |recorded| FarFieldReading { recorded, read_bin_deg: 6.0, centre_deg: 6.0, ..JUDGE };
    let (a, b) = (judge(BINS).plain(&fine), judge(coarse).plain(&fewer));
    assert!((a.peak_angle_deg - b.peak_angle_deg).abs() < 1e-3, "{a:?} {b:?}");
    assert!((a.centre_to_peak - b.centre_to_peak).abs() < 1e-4, "{a:?} {b:?}");
}

#[test]
fn bins_about_multiples_hold_the_intensity_about_them() {
    let judge = FarFieldReading {
        recorded: AngularBins { bin_deg: 2.5, polar: 72, ..BINS },
        read_bin_deg: 5.0,
        read_bins: BinPlacement::About,
        centre_deg: 2.5,
        peak: PeakMethod::Bin,
        ..JUDGE
    };
    // All bins together are the whole sphere, and an even intensity is even in them.
    let sphere = judge.sphere();
    assert_eq!(sphere.polar, 37);
    let whole: f64 = (0..sphere.polar).map(|i| sphere.ring_sr(i)).sum();
    assert!((whole - 4.0 * PI).abs() < 1e-12);
    let even = judge.seen(&powers_in(judge.recorded, |_| 3.0));
    assert!(even.iter().all(|i| (i - 3.0).abs() < 1e-7), "{even:?}");

    // Between 25 and 30 degrees the largest bin is that about the nearer of the two.
    for (peak, about) in [(27.0, 25.0), (28.0, 30.0), (1.0, 0.0)] {
        let f = |t: f64| (1.0 - ((t - peak) / 60.0).powi(2)).max(0.0);
        let powers = powers_in(judge.recorded, f);
        let figures = judge.figures(&twice(&powers));
        assert!((figures.peak_angle_deg.value - about).abs() < 1e-12);
        assert!(figures.peak_angle_deg.standard_error < 1e-12);
        // Mean over the cap below 2.5 degrees: θ = 5/3 degrees. Over 5 degrees the mean of a
        // parabola lies w²/24 of its curvature lower.
        let bin = |t: f64| f(t) - 25.0 / 12.0 / 3600.0;
        let ratio = f(5.0 / 3.0) / if about > 0.0 { bin(about) } else { f(5.0 / 3.0) };
        assert!((figures.centre_to_peak.value - ratio).abs() < 2e-3, "{figures:?} {ratio}");
        // The parabola through the same bins finds the peak between them, beside the axis a maximum
        // on it.
        let between = FarFieldReading { peak: PeakMethod::Parabola, peak_fit_deg: 10.0, ..judge }
            .plain(&powers);
        let vertex = if about > 0.0 { peak } else { 0.0 };
        assert!((between.peak_angle_deg - vertex).abs() < 0.1, "{between:?} {peak}");
        // So does that through the recorded bins, which is told beside the bin.
        let beside = figures.peak_angle_parabola_deg.expect("a peak");
        let vertex = if about > 0.0 { peak } else { beside.value };
        assert!((beside.value - vertex).abs() < 0.1, "{beside:?} {peak}");
        assert!(beside.value < 1.5 || about > 0.0, "{beside:?}");
        let plain = judge.plain(&powers);
        assert!((plain.peak_angle_parabola_deg - beside.value).abs() < 1e-9);
    }
}

#[test]
fn a_cut_has_its_own_peak_and_the_centre_of_all() {
    // Peak at 20° over most azimuths, at 40° and half as high in the bins about φ = 45°, 135°,
    // 225°, 315°.
    let ridge = |t: f64, at: f64, high: f64| (high * (1.0 - ((t - at) / 15.0).powi(2))).max(0.1);
    let (most, few) = (powers(|t| ridge(t, 20.0, 1.0)), powers(|t| ridge(t, 40.0, 0.5)));
    let mixed: Vec<f64> = (0..most.len())
        .map(|k| if k % BINS.azimuths % 9 == 4 { few[k] } else { most[k] })
        .collect();
    let cut = |cut_deg| FarFieldReading { cut_deg, ..JUDGE }.figures(&twice(&mixed));
    let (mean, along, across) = (cut(None), cut(Some(0.0)), cut(Some(45.0)));
    for (figures, angle, ratio) in
        [(mean, 20.0, 0.1 / (8.0 / 9.0 + 0.1 / 9.0)), (along, 20.0, 0.1), (across, 40.0, 0.2)]
    {
        assert!((figures.peak_angle_deg.value - angle).abs() < 0.1, "{figures:?}");
        assert!((figures.centre_to_peak.value - ratio).abs() < 2e-3, "{figures:?}");
    }
}

/// Draws of a far field: groups of paths whose numbers in rings of 2.5 degrees are Poisson.
fn drawn(f: &dyn Fn(f64) -> f64, paths: f64, seed: u64) -> Grouped {
    const GROUPS: usize = 32;
    let sphere = AngularBins { bin_deg: 2.5, polar: 72, azimuths: 1, ..BINS };
    let exact = powers_in(sphere, f);
    let scale = paths / exact.iter().sum::<f64>() / GROUPS as f64;
    let mut rng = tracer::random::stream(seed, 0);
    let mut poisson = |mean: f64| {
        let normal = (0..12).map(|_| tracer::random::unit(&mut rng)).sum::<f64>() - 6.0;
        (mean + mean.sqrt() * normal).max(0.0)
    };
    let group = |_| exact.iter().map(|power| poisson(power * scale)).collect();
    Grouped::new((0..GROUPS).map(group).collect())
}

/// A peak that falls faster outwards, as batwings do.
fn skew(theta: f64, peak: f64) -> f64 {
    let x = (theta - peak) / if theta < peak { 40.0 } else { 20.0 };
    if theta < 90.0 { (1.0 - x * x).max(0.0) } else { 0.0 }
}

#[test]
fn errors_of_peak_angles_are_their_scatter() {
    let judge = FarFieldReading {
        recorded: AngularBins { bin_deg: 2.5, polar: 72, azimuths: 1, ..BINS },
        read_bin_deg: 2.5,
        centre_deg: 2.5,
        peak_fit_deg: 7.5,
        ..JUDGE
    };
    // In the middle of a bin, and on the edge of two.
    for (peak, paths) in
        [(31.25, 3e4), (30.0, 3e4), (31.25, 1e5), (30.0, 1e5), (31.25, 1e6), (30.0, 1e6)]
    {
        let f = |theta: f64| skew(theta, peak);
        let seen = (0..100).map(|seed| judge.figures(&drawn(&f, paths, seed)));
        let (open, known): (Vec<_>, Vec<_>) = seen.partition(|seen| seen.peak_edges_deg.is_some());
        // What is not resolved lies between the ends that are shown.
        for [low, high] in open.iter().filter_map(|seen| seen.peak_edges_deg) {
            assert!(low < peak && peak < high, "{low} {high}");
        }
        if paths >= 1e5 {
            assert!(open.is_empty(), "{paths}: {} not resolved", open.len());
        }
        let known: Vec<Estimate> = known.iter().map(|seen| seen.peak_angle_deg).collect();
        if known.len() < 50 {
            continue;
        }
        let count = known.len() as f64;
        let mean = known.iter().map(|angle| angle.value).sum::<f64>() / count;
        let square =
            |of: &dyn Fn(&Estimate) -> f64| known.iter().map(|e| of(e).powi(2)).sum::<f64>();
        let scatter = square(&|angle| angle.value - mean) / (count - 1.0);
        let stated = square(&|angle| angle.standard_error) / count;
        let ratio = (scatter / stated).sqrt();
        assert!((0.8..1.25).contains(&ratio), "{peak} {paths}: {ratio} of {}", known.len());
    }
}

/// Near the axis the window has no room, and the vertex is still found where it is.
#[test]
fn peaks_near_the_axis_are_not_drawn_to_a_limit() {
    for bin_deg in [2.0, 2.5] {
        let sphere =
            AngularBins { bin_deg, polar: (180.0 / bin_deg) as usize, azimuths: 1, ..BINS };
        let judge = FarFieldReading {
            recorded: sphere,
            read_bin_deg: bin_deg,
            centre_deg: bin_deg,
            peak_fit_deg: 3.0 * bin_deg,
            ..JUDGE
        };
        let mut last = 0.0;
        for step in 0..24 {
            let peak = 6.0 + 0.25 * f64::from(step);
            let x = |theta: f64| (theta - peak) / 40.0;
            let exact = powers_in(sphere, |theta| (1.0 - x(theta) * x(theta)).max(0.0));
            let found = judge.figures(&twice(&exact)).peak_angle_deg.value;
            assert!((found - peak).abs() < 0.15 * bin_deg, "{bin_deg}: {found} for {peak}");
            assert!(found > last, "{found} after {last}");
            last = found;
        }
    }
}

#[test]
fn a_peak_that_noise_leaves_open_has_the_interval_of_its_bins() {
    // Four hundred paths a ring on a top that is level to a percent over thirty degrees.
    let f = |theta: f64| (1.0 - ((theta - 30.0) / 60.0).powi(4)).max(0.0);
    let recorded = AngularBins { bin_deg: 2.5, polar: 72, azimuths: 1, ..BINS };
    let judge = FarFieldReading { recorded, read_bin_deg: 2.5, centre_deg: 2.5, ..JUDGE };
    for seed in 0..20 {
        let figures = judge.figures(&drawn(&f, 3e4, seed));
        let [low, high] = figures.peak_edges_deg.expect("not resolved");
        assert!(low < 30.0 && high > 30.0, "{low} {high}");
        assert!(figures.peak_angle_deg.standard_error >= (high - low) / 12f64.sqrt() - 1e-12);
    }
}

#[test]
fn narrow_beams_hold_what_bins_do_to_them_or_are_not_resolved() {
    // Intensity cos^n, of which 1 W leaves: (n + 1) / 2 pi at its peak.
    let recorded = AngularBins { bin_deg: 2.0, polar: 90, azimuths: 1, ..BINS };
    let judge = FarFieldReading { recorded, read_bin_deg: 2.0, centre_deg: 2.0, ..JUDGE };
    for n in [20.0, 60.0, 150.0, 300.0, 600.0, 2000.0, 1e6] {
        let inside = |deg: f64| deg.min(90.0).to_radians().cos().powf(n + 1.0);
        let power = |ring: u32| inside(2.0 * f64::from(ring)) - inside(2.0 * f64::from(ring + 1));
        // Noise far below what bins do.
        let noise = |g: u32, ring: u32| 1e-4 * (f64::from((31 * g + 17 * ring) % 7) - 3.0);
        let group = |g: u32| (0..90).map(|ring| power(ring) * (1.0 + noise(g, ring))).collect();
        let found = judge.figures(&Grouped::new((0..16).map(group).collect()));
        let angle = |part: f64| 2.0 * part.powf(1.0 / n).acos().to_degrees();
        let within = |found: Estimate, ends: Option<[f64; 2]>, exact: f64| {
            let reach = 3.0 * found.standard_error + 2e-3 * exact;
            let plain = [found.value - reach, found.value + reach];
            let [low, high] = ends.or(found.interval()).unwrap_or(plain);
            assert!(low <= exact && exact <= high, "n {n}: {exact}, {low} to {high}");
        };
        for ((width, ends), part) in found.widths_deg.into_iter().zip(WIDTHS) {
            within(width, ends, angle(part));
        }
        // Within one bin the peak is anything.
        if n < 2000.0 {
            within(found.peak_w_per_sr, None, 16.0 * (n + 1.0) / std::f64::consts::TAU);
        } else {
            assert!(found.peak_w_per_sr.value.is_nan());
        }
    }
}

#[test]
fn narrow_lobes_off_the_axis_hold_what_bins_do_to_them_or_are_not_resolved() {
    let recorded = AngularBins { bin_deg: 2.0, polar: 90, azimuths: 1, ..BINS };
    let judge = FarFieldReading { recorded, read_bin_deg: 2.0, centre_deg: 2.0, ..JUDGE };
    for middle_deg in [30.0, 31.0, 37.3, 52.6] {
        for sigma_deg in [0.3, 0.8, 1.5, 2.5, 4.0, 7.0] {
            let intensity = |deg: f64| (-0.5 * ((deg - middle_deg) / sigma_deg).powi(2)).exp();
            // By 400 steps of each ring.
            let power = |ring: u32| {
                let step = |k: u32| 2.0 * (f64::from(ring) + (f64::from(k) + 0.5) / 400.0);
                let weight = (2.0_f64 / 400.0).to_radians() * std::f64::consts::TAU;
                (0..400).map(|k| intensity(step(k)) * step(k).to_radians().sin()).sum::<f64>()
                    * weight
            };
            let noise = |g: u32, ring: u32| 1e-4 * (f64::from((31 * g + 17 * ring) % 7) - 3.0);
            let powers: Vec<f64> = (0..90).map(power).collect();
            let group = |g: u32| {
                (0..)
                    .zip(&powers)
                    .map(|(ring, power)| power / 16.0 * (1.0 + noise(g, ring)))
                    .collect()
            };
            let found = judge.figures(&Grouped::new((0..16).map(group).collect()));
            let what = format!("{middle_deg}, {sigma_deg}");
            let within = |found: Estimate, ends: Option<[f64; 2]>, exact: f64| {
                let reach = 3.0 * found.standard_error + 2e-3 * exact;
                let plain = [found.value - reach, found.value + reach];
                let [low, high] = ends.or(found.interval()).unwrap_or(plain);
                assert!(low <= exact && exact <= high, "{what}: {exact}, {low} to {high}");
            };
            for ((width, ends), part) in found.widths_deg.into_iter().zip(WIDTHS) {
                within(width, ends, 2.0 * (middle_deg + sigma_deg * (-2.0 * part.ln()).sqrt()));
            }
            let peak = found.peak_w_per_sr;
            if !peak.value.is_nan() {
                within(peak, None, 1.0);
            }
            assert!(sigma_deg < 2.0 || !peak.value.is_nan(), "{what}");
        }
    }
}

/// Groups of a few paths that are luminance: rings of 5 degrees hold Poisson numbers of paths by
/// intensity times cosine, each of the power of one over the cosine.
fn luminance(f: &dyn Fn(f64) -> f64, paths: f64, seed: u64) -> Grouped {
    const GROUPS: usize = 32;
    let sphere = AngularBins { bin_deg: 5.0, polar: 18, azimuths: 1, ..BINS };
    let cosines: Vec<f64> = (0..18).map(|i| sphere.centre_deg(i).to_radians().cos()).collect();
    let flux: Vec<f64> = powers_in(sphere, f).iter().zip(&cosines).map(|(p, c)| p * c).collect();
    let per_watt = paths / flux.iter().sum::<f64>() / GROUPS as f64;
    let mut rng = tracer::random::stream(seed, 0);
    let mut poisson = |mean: f64| {
        if mean > 30.0 {
            let normal = (0..12).map(|_| tracer::random::unit(&mut rng)).sum::<f64>() - 6.0;
            return (mean + mean.sqrt() * normal).round().max(0.0);
        }
        let (mut left, mut count) = (mean.exp() * tracer::random::unit(&mut rng), 0.0);
        while left > 1.0 {
            left *= tracer::random::unit(&mut rng);
            count += 1.0;
        }
        count
    };
    let mut group = |_| -> Vec<f64> {
        flux.iter().zip(&cosines).map(|(flux, c)| poisson(flux * per_watt) / c).collect()
    };
    Grouped::new((0..GROUPS).map(&mut group).collect())
}

/// A beam of 45 degrees of full width at half maximum, without and with a side lobe above half of its
/// peak: outwards from the peak it is the first fall to half that counts.
#[test]
fn the_width_of_a_main_lobe_is_known_or_said_not_to_be() {
    let recorded = AngularBins { bin_deg: 5.0, polar: 18, azimuths: 1, ..BINS };
    let judge = FarFieldReading {
        recorded,
        read_bin_deg: 5.0,
        centre_deg: 5.0,
        peak: PeakMethod::Bin,
        ..JUDGE
    };
    for side in [0.0, 0.3, 0.7] {
        let f = |theta: f64| {
            let lobe = |x: f64| 0.5_f64.powf(x * x);
            lobe(theta / 22.5) + side * lobe((theta - 65.0) / 6.0)
        };
        for (paths, least, sharp) in [(100.0, 0.9, 0.0), (1000.0, 0.9, 0.0), (3e5, 0.95, 0.95)] {
            let (mut held, mut resolved) = (0.0, 0.0);
            for seed in 0..40 {
                let far = judge.figures(&luminance(&f, paths, seed));
                let entry = far.widths_deg[0];
                let (width, ends) = entry;
                let reach = 3.0 * width.standard_error;
                let ends = ends.or(width.interval());
                let [low, high] = ends.unwrap_or([width.value - reach, width.value + reach]);
                held += f64::from(u8::from(width.value.is_nan() || (low <= 45.0 && high >= 45.0)));
                resolved += f64::from(u8::from(high - low < 12.0));
            }
            let [held, resolved] = [held / 40.0, resolved / 40.0];
            let what = format!("side {side}, {paths} paths: {held} held, {resolved} resolved");
            assert!(held >= least && resolved >= sharp, "{what}");
        }
    }
}
