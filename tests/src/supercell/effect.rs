// SPDX-License-Identifier: MIT OR Apache-2.0
//! Distance of two results: power by direction of incidence, compared bin by bin.

use std::collections::BTreeMap;

use rcwa::Side;

use super::waves::{BIN_DEG, BINS, Wave};

/// How incident light is gathered before it is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gathered {
    /// Every plane wave by itself.
    Single,
    /// All waves whose angle across the grooves lies in one range of so many degrees, as diffuse
    /// light brings them.
    Ranges(f64),
    /// All waves from one side.
    Diffuse,
}

/// Light of one range of incidence: shares of its power.
#[derive(Debug, Clone, PartialEq)]
struct Light {
    weight: f64,
    transmitted: Vec<f64>,
}

/// Differences between two results.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effect {
    /// Transmitted share of the first and of the second, all light together.
    pub passes: [f64; 2],
    /// Mean absolute difference of the transmitted share.
    pub total: f64,
    /// Largest absolute difference of the transmitted share.
    pub worst_total: f64,
    /// Share of the incident power that is transmitted elsewhere: half the sum over bins of the
    /// absolute difference.
    pub moved: f64,
    /// Absolute turn of the mean direction of what is transmitted, mean over the light that passes,
    /// degrees.
    pub turn_deg: f64,
}

fn gather(waves: &[Wave], side: Side, how: Gathered) -> BTreeMap<(i64, usize), Light> {
    let mut all: BTreeMap<(i64, usize), Light> = BTreeMap::new();
    for wave in waves.iter().filter(|w| w.side == side) {
        let range = match how {
            Gathered::Single => (i64::from(wave.node), wave.line),
            Gathered::Ranges(width) => ((wave.angle_deg / width).floor() as i64, 0),
            Gathered::Diffuse => (0, 0),
        };
        let light =
            all.entry(range).or_insert_with(|| Light { weight: 0.0, transmitted: vec![0.0; BINS] });
        light.weight += wave.weight;
        for (sum, share) in light.transmitted.iter_mut().zip(&wave.transmitted) {
            *sum += wave.weight * share;
        }
    }
    for light in all.values_mut() {
        for share in &mut light.transmitted {
            *share /= light.weight;
        }
    }
    all
}

fn mean_direction(transmitted: &[f64]) -> f64 {
    let middle = |bin: usize| (bin as f64 + 0.5) * BIN_DEG - 90.0;
    let moment: f64 = transmitted.iter().enumerate().map(|(bin, share)| middle(bin) * share).sum();
    moment / transmitted.iter().sum::<f64>()
}

/// How far `second` is from `first` for light from `side`; both must hold the same waves.
///
/// # Panics
/// If they do not.
pub fn effect(first: &[Wave], second: &[Wave], side: Side, how: Gathered) -> Effect {
    assert_eq!(first.len(), second.len(), "results of the same waves");
    let (a, b) = (gather(first, side, how), gather(second, side, how));
    let mut effect = Effect::default();
    let (mut weight, mut passing) = (0.0, 0.0);
    for (x, y) in a.values().zip(b.values()) {
        let passes = [x, y].map(|l| l.transmitted.iter().sum::<f64>());
        let difference = (passes[1] - passes[0]).abs();
        let moved: f64 =
            x.transmitted.iter().zip(&y.transmitted).map(|(x, y)| 0.5 * (x - y).abs()).sum();
        weight += x.weight;
        effect.passes[0] += x.weight * passes[0];
        effect.passes[1] += x.weight * passes[1];
        effect.total += x.weight * difference;
        effect.worst_total = effect.worst_total.max(difference);
        effect.moved += x.weight * moved;
        if passes[0] > 0.02 && passes[1] > 0.02 {
            let turn = mean_direction(&y.transmitted) - mean_direction(&x.transmitted);
            effect.turn_deg += x.weight * passes[0] * turn.abs();
            passing += x.weight * passes[0];
        }
    }
    effect.passes = effect.passes.map(|p| p / weight);
    effect.total /= weight;
    effect.moved /= weight;
    effect.turn_deg /= passing;
    effect
}
