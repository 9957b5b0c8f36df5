// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls of an array that is larger than the stated one. Light of a package far from all walls, moved
//! near one, is mirrored in it times the share that comes back; packages nearer to the wall, which are
//! traced where they stand, tell this share, and how far the law is off.

use std::f64::consts::FRAC_2_PI;

use design::Design;
use metrics::{Estimate, JackknifedFigure, spread};

use super::Array;
use super::estimates::{figure, readings};
use super::map_receiver::Frame;
use super::places::Places;
use super::responses::Responses;
use super::superposition::{Piece, RowOfGroups, rows};

/// Walls about the whole array.
#[derive(Debug, Clone)]
pub(super) struct Walls {
    /// Places of the lower and the upper wall along x and y, in halves of a bin.
    half_bins: [[isize; 2]; 2],
    /// Bins of the whole map.
    bins: [usize; 2],
    /// Share of the light beyond a wall that comes back, of each part of the light, along x and y.
    returned: Vec<[JackknifedFigure; 2]>,
}

/// Light of a package near a wall, by cells of a pitch from the wall on and by groups of paths.
struct NearWall {
    /// Traced where it stands.
    traced: Vec<Vec<f64>>,
    /// Of the inner package moved there: within the wall, and its image from beyond it.
    within: Vec<Vec<f64>>,
    image: Vec<Vec<f64>>,
}

/// Light that lies wrong beside the walls across an axis.
#[derive(Debug, Clone)]
pub(super) struct AtWalls {
    /// The most of it over the light beyond a wall.
    pub error: f64,
    /// What all packages that are moved make of it at a place beside a wall, over the mean at full drive.
    pub share: Estimate,
    /// The most of that in each cell of a pitch from the wall on.
    pub by_cell: Vec<f64>,
}

impl Walls {
    /// Walls of `design`, or none, about the whole array, whose map is `frame`.
    pub fn new(design: &Design, places: &Places, (step, frame): ([usize; 2], Frame)) -> Self {
        let half_bins = [0, 1].map(|k| {
            let more = (places.whole[k] - places.traced[k]) as f64 * places.pitch_mm[k];
            let of_walls = design.housing_half_mm().filter(|_| step[k] > 0);
            let low = of_walls.map_or(frame.low_mm[k], |half| -half[k] - 0.5 * more);
            let low = (2.0 * (low - frame.low_mm[k]) / frame.bin_mm[k]).round() as isize;
            [low, 2 * frame.bins[k] as isize - low]
        });
        Self { half_bins, bins: frame.bins, returned: Vec::new() }
    }

    /// A piece of a part of the light, and its images in the walls that it crosses.
    pub fn folded<'a>(&self, piece: Piece<'a>, part: usize) -> Vec<Piece<'a>> {
        let is_moved = |k: usize| {
            piece.at[k] < 0 || piece.at[k] + piece.bins()[k] as isize > self.bins[k] as isize
        };
        let within = [0, 1].map(|k| {
            let [low, high] = self.half_bins[k];
            if is_moved(k) {
                [low.div_euclid(2), (high + 1).div_euclid(2)]
            } else {
                piece.within[k]
            }
        });
        let mut pieces = vec![Piece { within, ..piece }];
        for k in 0..2 {
            let end = piece.at[k] + piece.bins()[k] as isize;
            let crossed = [piece.at[k] < 0, end > self.bins[k] as isize];
            let walls = self.half_bins[k].into_iter().zip(crossed).filter(|(_, crossed)| *crossed);
            let returned = self.returned.get(part).map_or(1.0, |shares| shares[k].value);
            let images: Vec<Piece> = walls
                .flat_map(|(half_bins, _)| {
                    pieces.iter().map(move |piece| {
                        let mut image = Piece { weight: returned * piece.weight, ..*piece };
                        image.at[k] = half_bins - end;
                        image.turn.mirror[k] = !image.turn.mirror[k];
                        image
                    })
                })
                .collect();
            pieces.extend(images);
        }
        pieces
    }
}

impl Array<'_> {
    /// Finds what comes back of light beyond the walls, in each part.
    pub(super) fn find_returned(&mut self) {
        let groups = self.responses.groups;
        let of_part = |part: usize| {
            [0, 1].map(|axis| {
                let all = JackknifedFigure::new(1.0, vec![1.0; groups]);
                let Some(away) = self.places.near_wall(axis).checked_sub(1) else { return all };
                let [mut beyond, mut missing] = [(); 2].map(|()| vec![0.0; groups]);
                for near in self.near_walls(axis, away, part) {
                    near.image.iter().for_each(|cell| add(&mut beyond, 1.0, cell));
                    near.traced.iter().for_each(|cell| add(&mut missing, 1.0, cell));
                    near.within.iter().for_each(|cell| add(&mut missing, -1.0, cell));
                }
                let [beyond, missing] = [beyond, missing].map(|groups| readings(&groups));
                if beyond.iter().any(|light| *light <= 0.0) {
                    return all;
                }
                let mut shares: Vec<f64> =
                    missing.iter().zip(&beyond).map(|(light, of)| light / of).collect();
                let share = shares.pop().unwrap_or(1.0).clamp(0.0, 1.0);
                JackknifedFigure::new(share, shares)
            })
        };
        self.walls.returned = (0..self.parts.len()).map(of_part).collect();
    }

    /// Light that lies wrong beside the walls across an axis: the law beside what is traced, cell by
    /// cell, for a package one place nearer than those that tell what comes back, and the error of what
    /// these tell; of one lot, or all. `None` where none is moved.
    pub(super) fn error_at_walls(&self, axis: usize, lot: Option<usize>) -> Option<AtWalls> {
        let near_wall = self.places.near_wall(axis);
        let away = near_wall.checked_sub(2).filter(|_| self.is_moved(axis))?;
        let (groups, cells) = (self.responses.groups, self.places.traced[axis]);
        // Differences in the cells of both walls, light beyond them, there and one place farther, and all.
        let mut wrong = vec![vec![0.0; groups]; 2 * cells];
        let [mut beyond, mut all] = [(); 2].map(|()| vec![0.0; groups]);
        // Light beyond, one place farther, by cells, and what comes back of it without each group.
        let (mut farther, mut comes_back) = (vec![0.0; cells], vec![0.0; groups]);
        let mut one_path = 0.0;
        for (number, part) in self.parts.iter().enumerate() {
            if lot.is_some_and(|lot| part.lot != lot) {
                continue;
            }
            let y = if lot.is_some() { part.weight() } else { part.xyz[1] };
            let share = &self.walls.returned[number][axis];
            let returned = share.value;
            one_path += y * self.one_path_of_inner(number);
            for (wall, near) in self.near_walls(axis, away, number).iter().enumerate() {
                for cell in 0..cells {
                    let wrong = &mut wrong[wall * cells + cell];
                    add(wrong, y, &near.within[cell]);
                    add(wrong, y * returned, &near.image[cell]);
                    add(wrong, -y, &near.traced[cell]);
                    add(&mut beyond, y, &near.image[cell]);
                    add(&mut all, y, &near.within[cell]);
                    add(&mut all, y, &near.image[cell]);
                }
            }
            for near in self.near_walls(axis, away + 1, number) {
                for (sum, cell) in farther.iter_mut().zip(&near.image) {
                    let light = y * cell.iter().sum::<f64>();
                    *sum += light;
                    add(&mut comes_back, light, &share.without);
                }
            }
        }
        let [beyond, all] = [beyond, all].map(|groups| readings(&groups));
        if beyond.iter().any(|light| *light <= 0.0) {
            return None;
        }
        // Absolute differences less those of noise alone.
        let wrong = wrong.iter().map(|cell| figure(readings(cell), 1.0, one_path));
        let (mut sum, mut noise, mut square) = (0.0, 0.0, 0.0);
        for cell in wrong {
            sum += cell.value.abs();
            noise += FRAC_2_PI.sqrt() * cell.standard_error;
            square += cell.standard_error.powi(2);
        }
        let of_beyond = |light: f64| (light / beyond[groups]).min(1.0);
        // Light beyond the cells from each on.
        for cell in (1..cells).rev() {
            farther[cell - 1] += farther[cell];
        }
        let of_share = if farther[0] > 0.0 { spread(&comes_back) / farther[0] } else { 0.0 };
        let error = Estimate::new(of_beyond((sum - noise).max(0.0)), of_beyond(square.sqrt()));
        let error = error.with_error(of_share);
        let most = (error.value + 2.0 * error.standard_error).min(1.0);
        Some(AtWalls {
            error: most,
            share: error.times(farther[0] / all[groups]),
            by_cell: farther.iter().map(|light| most * light / all[groups]).collect(),
        })
    }

    /// What one path of the inner package adds to a bin.
    fn one_path_of_inner(&self, part: usize) -> f64 {
        let middle = self.places.traced.map(|count| (count - 1) / 2);
        self.responses.at(middle, part).block.one_path
    }

    /// True if responses are moved towards the walls along an axis.
    fn is_moved(&self, axis: usize) -> bool {
        self.places.is_extended(axis) && self.places.traced[axis] > self.places.stated[axis]
    }

    /// Packages so many places `away` from the lower and from the upper wall, in the middle along the
    /// other axis.
    fn near_walls(&self, axis: usize, away: usize, part: usize) -> Vec<NearWall> {
        if !self.is_moved(axis) {
            return Vec::new();
        }
        let Self { responses, receiver, places, .. } = self;
        let (traced, bins) = (places.traced, receiver.frame.bins);
        let middle = [0, 1].map(|k| (traced[k] - 1) / 2);
        let at = |number: usize| {
            let mut place = middle;
            place[axis] = number;
            profile(responses, (place, part), bins, axis)
        };
        let inner = at(middle[axis]);
        let (groups, step) = (responses.groups, self.step[axis] as isize);
        let low = self.walls.half_bins[axis][0];
        let near = |is_low: bool| {
            let number = if is_low { away } else { traced[axis] - 1 - away };
            let moved = (middle[axis] as isize - number as isize) * step;
            // Cell of a bin, counted from the wall; negative beyond it.
            let cell = |bin: isize| {
                let from_wall = if is_low {
                    2 * bin + 1 - low
                } else {
                    2 * bins[axis] as isize - low - 2 * bin - 1
                };
                from_wall.div_euclid(2 * step)
            };
            let sums = |profile: &[Vec<f64>], cell: &dyn Fn(isize) -> isize| {
                let mut sums = vec![vec![0.0; groups]; traced[axis]];
                for (bin, values) in profile.iter().enumerate() {
                    let cell = usize::try_from(cell(bin as isize)).ok();
                    if let Some(sums) = cell.and_then(|cell| sums.get_mut(cell)) {
                        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                    }
                }
                sums
            };
            NearWall {
                traced: sums(&at(number), &cell),
                within: sums(&inner, &|bin| cell(bin - moved)),
                image: sums(&inner, &|bin| -1 - cell(bin - moved)),
            }
        };
        [true, false].map(near).into()
    }
}

/// Adds so many times the numbers of groups.
fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(sum, value)| *sum += factor * value);
}

/// Sums of a response over the bins across `axis`, by bin along it and by group.
fn profile(
    responses: &Responses,
    (place, part): ([usize; 2], usize),
    bins: [usize; 2],
    axis: usize,
) -> Vec<Vec<f64>> {
    let piece = responses.at(place, part);
    if axis == 1 {
        let sums = |_: usize, row: &RowOfGroups| {
            (0..row.count()).map(|group| row.group(group).iter().sum()).collect()
        };
        return rows(bins, responses.groups, &[piece], sums);
    }
    let mut sums = vec![vec![0.0; responses.groups]; bins[0]];
    for groups in rows(bins, responses.groups, &[piece], |_, row| {
        (0..row.count()).map(|group| row.group(group).to_vec()).collect::<Vec<_>>()
    }) {
        for (group, values) in groups.iter().enumerate() {
            values.iter().enumerate().for_each(|(bin, value)| sums[bin][group] += value);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use design::resolved::array::PackagePositions;
    use design::schema::{Arrangement, Pitch};

    use crate::MapReceiver;
    use crate::responses::ChannelLight;
    use crate::superposition::Block;

    /// Light of a package in bins of half a pitch from its middle on.
    const KERNEL: [f64; 10] = [10.0, 7.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.6, 0.3];
    const COLUMNS: usize = 13;
    const GROUPS: usize = 16;
    /// Share that walls send back.
    const RETURNED: f64 = 0.6;

    /// Light farther than so many pitches and a half from a package, on one side.
    fn beyond(places: usize) -> f64 {
        KERNEL.iter().skip(2 * places + 1).sum()
    }

    /// Light of the package in a column, by bins, with the images in walls that send back a share.
    fn of_package(column: usize, returned: f64) -> Vec<f64> {
        let middle = 2.0 * column as f64 + 1.0;
        let bins = 2 * COLUMNS;
        let images = [(1.0, middle), (returned, -middle), (returned, 2.0 * bins as f64 - middle)];
        let light = |bin: usize| {
            let of = |(share, at): (f64, f64)| {
                let away = (bin as f64 + 0.5 - at).abs() as usize;
                share * KERNEL.get(away).copied().unwrap_or(0.0)
            };
            images.into_iter().map(of).sum()
        };
        (0..bins).map(light).collect()
    }

    /// Reads an array of 13 columns, of which 5 are traced, beside walls that send back this share of the
    /// light of the outermost packages, and with this noise in the groups of those that tell the share.
    fn read(outermost: f64, noise: f64, read: impl FnOnce(&Array)) {
        let mut design = design::embedded("d1.toml").expect("valid");
        let (columns, rows, arrangement) = (COLUMNS, 5, Arrangement::Square);
        design.array.positions = PackagePositions::Grid { columns, rows, arrangement };
        design.array.pitch_mm = Pitch::Same(8.0);
        let whole = [COLUMNS, 5];
        let mut places = Places::new(&design, Some(whole), Some([5, 5])).expect("places");
        places.divide(whole).expect("a zone for each");
        let bins = [2 * COLUMNS, 10];
        let mut receiver = MapReceiver::new(&design, None, &places, false).expect("the plane");
        receiver.frame = Frame { bins, bin_mm: [4.0; 2], low_mm: [-52.0, -20.0] };
        let block = |column: usize| {
            let from_end = column.min(COLUMNS - 1 - column);
            let light = of_package(column, if from_end == 0 { outermost } else { RETURNED });
            let group = |group: usize| {
                let sign = if group.is_multiple_of(2) { 1.0 } else { -1.0 };
                let factor = if from_end == 1 { 1.0 + noise * sign } else { 1.0 };
                let mut values = vec![0.0; bins[0] * bins[1]];
                let row = values[5 * bins[0]..][..bins[0]].iter_mut().zip(&light);
                row.for_each(|(value, light)| *value = factor * light / GROUPS as f64);
                values
            };
            Block::new(bins, &(0..GROUPS).map(group).collect::<Vec<_>>(), 1e-12)
        };
        let blocks = (0..COLUMNS).map(block).collect();
        let images: Vec<usize> = (0..5 * COLUMNS).map(|k| k % COLUMNS).collect();
        let half_bins = bins.map(|bins| [0, 2 * bins as isize]);
        let mut array = Array {
            places: &places,
            receiver: &receiver,
            responses: Responses::of_blocks(blocks, &images, COLUMNS),
            zones: whole,
            step: [2; 2],
            frame: receiver.frame,
            parts: ChannelLight::whole(),
            walls: Walls { half_bins, bins, returned: Vec::new() },
        };
        array.find_returned();
        read(&array);
    }

    /// Walls of the law: it is found as it is, and what its packages leave open is its error.
    #[test]
    fn the_error_of_what_comes_back_is_part_of_the_bound() {
        for noise in [0.0, 0.1] {
            read(RETURNED, noise, |array| {
                let found = &array.walls.returned[0][0];
                assert!((found.value - RETURNED).abs() < 1e-9, "{}", found.value);
                let near: f64 = of_package(1, RETURNED).iter().sum();
                let error = noise * near / beyond(1) / (GROUPS as f64 - 1.0).sqrt();
                assert!((found.standard_error - error).abs() < 1e-9, "{}", found.standard_error);
                let at_walls = array.error_at_walls(0, None).expect("moved");
                let expected = (2.0 * error).min(1.0);
                assert!((at_walls.error - expected).abs() < 1e-6, "{} {error}", at_walls.error);
            });
        }
    }

    /// Where the outermost packages tell walls of half as much more, the mean over the panel is as far off
    /// as all packages that are moved make it together, and no more than that is charged to it.
    #[test]
    fn a_mean_is_charged_for_the_area_beside_walls_alone() {
        read(1.5 * RETURNED, 0.0, |array| {
            let all = 2.0 * KERNEL.iter().sum::<f64>();
            let wrong = 0.5 * RETURNED;
            let found = array.beyond(None).expect("moved");
            for (cell, share) in found.by_cell[0].iter().enumerate() {
                let expected = wrong * beyond(1 + cell) / all;
                assert!((share - expected).abs() < 1e-6, "{cell}: {share} {expected}");
            }
            let cells: f64 = (1..COLUMNS).map(beyond).sum();
            let expected = 2.0 / COLUMNS as f64 * wrong * cells / all;
            assert!((found.walls_of_mean - expected).abs() < 1e-6, "{}", found.walls_of_mean);
            // Light of the moved packages that lies wrong, over that of all.
            let moved: f64 = (2..COLUMNS - 2).map(|i| beyond(i) + beyond(COLUMNS - 1 - i)).sum();
            let off = wrong * moved / (COLUMNS as f64 * all);
            assert!(off > 0.0 && off < found.walls_of_mean, "{off}");
            // Control: at a wall it is more; what bins have more than the middle averages to it.
            assert!(found.bound() - found.bound_of_mean() > 2.0 * found.walls_of_mean);
            let everywhere = array.light_off(Some(&found), &[1.0; 5 * COLUMNS]);
            let more = |bin: usize| everywhere.at([bin, 5]) - everywhere.at([COLUMNS, 5]);
            let mean = (0..2 * COLUMNS).map(more).sum::<f64>() / (2 * COLUMNS) as f64;
            assert!((mean - found.walls_of_mean).abs() < 1e-6, "{mean}");
            assert!((more(0) - found.by_cell[0][0]).abs() < 1e-6, "{}", more(0));
            // Two bins to a cell.
            let cells = array.light_off_by_cell(Some(&found), [COLUMNS, 1]);
            for (cell, share) in cells.iter().enumerate() {
                let bins = [2 * cell, 2 * cell + 1].map(|bin| everywhere.at([bin, 5]));
                assert!(
                    (share - 0.5 * (bins[0] + bins[1])).abs() < 1e-9,
                    "{cell}: {share} {bins:?}"
                );
            }
        });
    }
}
