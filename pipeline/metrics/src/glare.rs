// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light that the eye scatters over what it looks at: the veil of a display's own bright parts.
//!
//! A source of illuminance E at the eye, at the angle θ (degrees) from where it looks, lays a veil
//! of luminance L over that place (CIE 146:2002, the general equation of disability glare):
//!
//! L / E = 10/θ³ + (5/θ² + 0.1 p/θ) (1 + (A/62.5)⁴) + 0.0025 p,  0.1° < θ < 100°,
//!
//! for an age of A years and the pigment p of the eye, from 0 (black) over 0.5 (brown) to 1.2 (light
//! blue). A bin of a display of luminance L and area a sends E = L a D cos θ / d³ to an eye before its
//! middle at the distance D, d away from the bin. Light from within 0.1° belongs to the image itself.
//!
//! Bins are summed as they are seen from a place: those far away together, at the middle of their
//! light, as far as they appear smaller than `OPENING` times their angle θ, and those near it in
//! parts (J. Barnes, P. Hut, Nature 324 (1986) 446). No approximation is made of flat fields or
//! small angles. A test holds the error of a veil below 0.5 %.

use rayon::prelude::*;

/// Angles at which the equation holds, degrees.
const RANGE_DEG: [f64; 2] = [0.1, 100.0];
/// Largest size of bins that are summed together, over their angle from the place looked at.
const OPENING: f64 = 0.1;
/// Smallest parts into which bins are cut, degrees: a twentieth of the smallest angle.
const SMALLEST_DEG: f64 = 0.005;

/// Whose eye looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    /// Age, years.
    pub age_years: f64,
    /// Pigment of the iris: 0 black, 0.5 brown, 1.2 light blue.
    pub pigment: f64,
}

impl Observer {
    /// Luminance of the veil for each lux at the eye, (cd/m²)/lx, at an angle within [`RANGE_DEG`].
    fn veil_per_lux(&self, degrees: f64) -> f64 {
        let by_age = 1.0 + (self.age_years / 62.5).powi(4);
        let inverse = 1.0 / degrees;
        let pigment = self.pigment;
        inverse * (inverse * (10.0 * inverse + 5.0 * by_age) + 0.1 * pigment * by_age)
            + 0.0025 * pigment
    }
}

/// An eye before the middle of a display.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewing {
    /// Distance, mm.
    pub distance_mm: f64,
    /// Whose eye it is.
    pub observer: Observer,
}

/// Bins put together.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    /// Luminance times area, cd/m² mm².
    light: f64,
    /// Middle of the light, mm from the middle of the display.
    at_mm: [f64; 2],
}

/// Nodes of one size, row by row.
struct Tier {
    columns: usize,
    rows: usize,
    nodes: Vec<Node>,
}

impl Tier {
    /// Two by two of these in one.
    fn halved(&self) -> Self {
        let [columns, rows] = [self.columns, self.rows].map(|count| count.div_ceil(2));
        let sum = |k: usize| {
            let mut sum = Node::default();
            for [i, j] in children([k % columns, k / columns], self) {
                let child = self.nodes[j * self.columns + i];
                sum.light += child.light;
                (0..2).for_each(|k| sum.at_mm[k] += child.light * child.at_mm[k]);
            }
            if sum.light > 0.0 {
                sum.at_mm = sum.at_mm.map(|moment| moment / sum.light);
            }
            sum
        };
        Self { columns, rows, nodes: (0..columns * rows).map(sum).collect() }
    }
}

/// Places in `level` of the four parts of a node of the level above it.
fn children([i, j]: [usize; 2], level: &Tier) -> impl Iterator<Item = [usize; 2]> {
    let ends = [(2 * i + 2).min(level.columns), (2 * j + 2).min(level.rows)];
    (2 * j..ends[1]).flat_map(move |j| (2 * i..ends[0]).map(move |i| [i, j]))
}

/// Middle of a bin of so many, from the middle of all, mm.
fn middle(bin: usize, count: usize, bin_mm: f64) -> f64 {
    (bin as f64 + 0.5 - 0.5 * count as f64) * bin_mm
}

/// A display before an eye.
pub struct Glare {
    /// Bins, then ever larger nodes up to one.
    levels: Vec<Tier>,
    /// Sides of a bin, mm.
    bin_mm: [f64; 2],
    distance_mm: f64,
    observer: Observer,
}

/// A place that the eye looks at.
struct Gaze {
    /// mm from the middle of the display.
    at_mm: [f64; 2],
    /// Distance of the eye from it, mm.
    length_mm: f64,
}

impl Glare {
    /// A display of this `luminance`, cd/m², in `columns` times `rows` bins of `bin_mm`, row by row from
    /// the bottom, seen from `distance_mm` before its middle. Luminance that noise drives below 0
    /// counts as 0.
    pub fn new(
        luminance: &[f64],
        [columns, rows]: [usize; 2],
        bin_mm: [f64; 2],
        distance_mm: f64,
        observer: Observer,
    ) -> Self {
        let bin = |(k, luminance): (usize, &f64)| Node {
            light: luminance.max(0.0) * bin_mm[0] * bin_mm[1],
            at_mm: [middle(k % columns, columns, bin_mm[0]), middle(k / columns, rows, bin_mm[1])],
        };
        let nodes = luminance.iter().enumerate().map(bin).collect();
        let mut levels = vec![Tier { columns, rows, nodes }];
        while let Some(last) = levels.last()
            && last.nodes.len() > 1
        {
            let next = last.halved();
            levels.push(next);
        }
        Self { levels, bin_mm, distance_mm, observer }
    }

    /// Luminance of the veil, cd/m², over a place in mm from the middle of the display.
    fn veil(&self, at_mm: [f64; 2]) -> f64 {
        let [x, y] = at_mm;
        let length_mm = (x * x + y * y + self.distance_mm * self.distance_mm).sqrt();
        let top = self.levels.len() - 1;
        let nodes = &self.levels[top].nodes;
        let of = |k: usize| self.of_node(&Gaze { at_mm, length_mm }, top, [k, 0]);
        (0..nodes.len()).map(of).sum()
    }

    /// The veil over the middle of each bin that `is_read`; 0 elsewhere.
    pub fn veils(&self, is_read: impl Fn(usize) -> bool + Sync) -> Vec<f64> {
        let Tier { columns, rows, nodes } = &self.levels[0];
        let of = |bin: usize| {
            if !is_read(bin) {
                return 0.0;
            }
            let at = [(bin % columns, columns), (bin / columns, rows)];
            self.veil([0, 1].map(|k| middle(at[k].0, *at[k].1, self.bin_mm[k])))
        };
        (0..nodes.len()).into_par_iter().map(of).collect()
    }

    fn of_node(&self, gaze: &Gaze, level: usize, [i, j]: [usize; 2]) -> f64 {
        let nodes = &self.levels[level];
        let node = nodes.nodes[j * nodes.columns + i];
        if node.light <= 0.0 {
            return 0.0;
        }
        let size_mm = self.bin_mm.map(|bin| bin * f64::from(1u32 << level));
        if let Some(veil) = self.together(gaze, node, size_mm) {
            return veil;
        }
        match level.checked_sub(1) {
            Some(below) => children([i, j], &self.levels[below])
                .map(|child| self.of_node(gaze, below, child))
                .sum(),
            None => self.of_part(gaze, node, size_mm),
        }
    }

    /// Veil of a part of a bin, which is of one luminance.
    fn of_part(&self, gaze: &Gaze, node: Node, size_mm: [f64; 2]) -> f64 {
        if let Some(veil) = self.together(gaze, node, size_mm) {
            return veil;
        }
        let size_mm = size_mm.map(|size| 0.5 * size);
        let mut sum = 0.0;
        for sides in [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]] {
            let at_mm = [0, 1].map(|k| node.at_mm[k] + sides[k] * size_mm[k]);
            sum += self.of_part(gaze, Node { light: 0.25 * node.light, at_mm }, size_mm);
        }
        sum
    }

    /// Veil of a node as a point; `None` of one too large for that.
    fn together(&self, gaze: &Gaze, node: Node, size_mm: [f64; 2]) -> Option<f64> {
        let ([a, b], [x, y], z) = (gaze.at_mm, node.at_mm, self.distance_mm);
        let square = x * x + y * y + z * z;
        let length = square.sqrt();
        // |(a, b, z) × (x, y, z)| and the scalar product: exact at small angles too.
        let [dx, dy] = [x - a, y - b];
        let across = ((z * dx).powi(2) + (z * dy).powi(2) + (a * y - b * x).powi(2)).sqrt();
        let along = a * x + b * y + z * z;
        let degrees = across.atan2(along).to_degrees();
        let size_deg = (size_mm[0].max(size_mm[1]) / length).to_degrees();
        if size_deg > (OPENING * degrees).max(SMALLEST_DEG) {
            return None;
        }
        if degrees < RANGE_DEG[0] {
            return Some(0.0);
        }
        let cos = along / (gaze.length_mm * length);
        let lux = node.light * z * cos / (square * length);
        Some(lux * self.observer.veil_per_lux(degrees))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PI: f64 = std::f64::consts::PI;
    const USUAL: Observer = Observer { age_years: 25.0, pigment: 0.5 };

    /// The terms of the equation by hand, and its ratio of ages: at 62.5 years the second term is
    /// doubled.
    #[test]
    fn veils_of_points_are_those_of_the_equation() {
        let young = Observer { age_years: 0.0, pigment: 0.0 };
        assert!((young.veil_per_lux(1.0) - 15.0).abs() < 1e-12);
        assert!((young.veil_per_lux(10.0) - 0.06).abs() < 1e-12);
        let old = Observer { age_years: 62.5, pigment: 1.0 };
        assert!((old.veil_per_lux(1.0) - (10.0 + 2.0 * 5.1 + 0.0025)).abs() < 1e-12);
        // (25/62.5)⁴ = 0.0256.
        let usual = 10.0 / 8.0 + (5.0 / 4.0 + 0.025) * 1.0256 + 0.00125;
        assert!((USUAL.veil_per_lux(2.0) - usual).abs() < 1e-12);
        // Between 1° and 30° that of Stiles and Holladay, 10/θ², to its 40 %.
        let ratio = USUAL.veil_per_lux(3.0) * 0.9;
        assert!((0.6..1.4).contains(&ratio), "{ratio}");
    }

    /// Straylight of 2 422 drivers at 7°: twice that of the young at 65 years, three times at 77
    /// (T. J. T. P. van den Berg et al., Am. J. Ophthalmol. 144 (2007) 358; 0.10 in log₁₀ between people).
    #[test]
    fn veils_grow_with_age_as_measured() {
        let at_7_deg = |age_years| Observer { age_years, pigment: 0.5 }.veil_per_lux(7.0);
        for (age, times) in [(65.0, 2.0f64), (77.0, 3.0)] {
            let found = at_7_deg(age) / at_7_deg(0.0);
            assert!((found / times).log10().abs() < 0.05, "{age}: {found}");
        }
    }

    /// One bright bin far from the place is a source of known illuminance.
    #[test]
    fn a_small_source_on_a_display_is_a_point() {
        let mut luminance = vec![0.0; 101 * 41];
        luminance[20 * 101 + 90] = 1e4;
        let observer = USUAL;
        let glare = Glare::new(&luminance, [101, 41], [1.0, 1.0], 500.0, observer);
        // Bin 90 lies 40 mm from the middle; the eye looks at 30 mm on the other side.
        let [to_bin, to_place] = [40f64, 30.0].map(|x| (x / 500.0).atan());
        let degrees = (to_bin + to_place).to_degrees();
        let distance = 40f64.hypot(500.0);
        let lux = 1e4 * (500.0 / distance) * (to_bin + to_place).cos() / (distance * distance);
        let found = glare.veil([-30.0, 0.0]);
        assert!((found / (lux * observer.veil_per_lux(degrees)) - 1.0).abs() < 1e-9, "{found}");
    }

    /// A disc about the place that is looked at, of luminance L between the angles a and b, sends
    /// E = 2π L cos θ sin θ dθ; the veil is the integral of that.
    #[test]
    fn a_disc_has_the_veil_of_its_integral() {
        let (count, distance, outer) = (400, 300.0, 60.0);
        for (inner, observer) in [(0.0, USUAL), (6.0, Observer { age_years: 70.0, pigment: 1.2 })] {
            // The part of a bin on an edge, by 8 x 8 points.
            let part = |k: usize| {
                let at = |k: usize, s: usize| (k as f64 + (s as f64 + 0.5) / 8.0 - 200.0) * 0.3;
                let is_in = |s: usize| {
                    let r = at(k % count, s % 8).hypot(at(k / count, s / 8));
                    (inner..outer).contains(&r)
                };
                250.0 * (0..64).filter(|s| is_in(*s)).count() as f64 / 64.0
            };
            let luminance: Vec<f64> = (0..count * count).map(part).collect();
            let glare = Glare::new(&luminance, [count; 2], [0.3; 2], distance, observer);
            let [from, to] = [inner, outer].map(|r: f64| (r / distance).atan().to_degrees());
            let (from, steps) = (from.max(RANGE_DEG[0]), 200_000);
            let step = (to / from).ln() / f64::from(steps);
            let integral: f64 = (0..steps)
                .map(|k| {
                    let degrees = from * ((f64::from(k) + 0.5) * step).exp();
                    let rad = degrees.to_radians();
                    let lux = 2.0 * PI * 250.0 * rad.cos() * rad.sin() * rad * step;
                    lux * observer.veil_per_lux(degrees)
                })
                .sum();
            let found = glare.veil([0.0; 2]);
            assert!((found / integral - 1.0).abs() < 5e-3, "{found} {integral}");
        }
    }

    /// The sum over all bins one by one, of a random picture.
    #[test]
    fn bins_together_are_the_sum_of_each() {
        let mut rng = tracer::random::stream(7, 0);
        let size = [160, 90];
        let bin = [4.0, 4.0];
        // Black but for one bin in eight.
        let mut draw = || tracer::random::unit(&mut rng);
        let luminance: Vec<f64> = (0..size[0] * size[1])
            .map(|_| if draw() < 0.125 { 1000.0 * draw() } else { 0.0 })
            .collect();
        let observer = USUAL;
        let glare = Glare::new(&luminance, size, bin, 700.0, observer);
        let places = [[2.0, 2.0], [-300.0, 170.0], [101.0, -3.0], [317.9, -177.9]];
        let of_bins = glare.veils(|bin| bin == 45 * 160 + 80);
        assert_eq!(of_bins[45 * 160 + 80].to_bits(), glare.veil(places[0]).to_bits());
        assert_eq!(of_bins.iter().filter(|veil| **veil > 0.0).count(), 1);
        for place in &places {
            let found = glare.veil(*place);
            let gaze = Gaze {
                at_mm: *place,
                length_mm: (place[0].powi(2) + place[1].powi(2) + 700f64.powi(2)).sqrt(),
            };
            // Every bin in parts of an eighth.
            let exact: f64 = glare.levels[0]
                .nodes
                .iter()
                .filter(|node| node.light > 0.0)
                .map(|node| {
                    let light = node.light / 1024.0;
                    let part = |k: usize| {
                        let off = |k: usize| ((k as f64 + 0.5) / 32.0 - 0.5) * 4.0;
                        let at_mm = [node.at_mm[0] + off(k % 32), node.at_mm[1] + off(k / 32)];
                        glare.together(&gaze, Node { light, at_mm }, [0.0; 2]).unwrap_or(0.0)
                    };
                    (0..1024).map(part).sum::<f64>()
                })
                .sum();
            assert!((found / exact - 1.0).abs() < 5e-3, "{place:?}: {found} {exact}");
        }
    }

    #[test]
    fn black_has_no_veil_and_older_eyes_more() {
        let dark = Glare::new(&[0.0; 12], [4, 3], [5.0; 2], 400.0, USUAL);
        assert!(dark.veil([1.0, 1.0]).abs() < f64::MIN_POSITIVE);
        let lit = |age_years| {
            let observer = Observer { age_years, ..USUAL };
            Glare::new(&[100.0; 12], [4, 3], [5.0; 2], 400.0, observer).veil([30.0, 0.0])
        };
        assert!(lit(70.0) > 1.2 * lit(25.0) && lit(25.0) > 0.0);
    }
}
