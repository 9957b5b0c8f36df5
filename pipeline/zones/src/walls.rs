// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls of an array that is larger than the stated one. Light of a package far from all walls, moved
//! near one, is mirrored in it times the share that comes back; packages nearer to the wall, which are
//! traced where they stand, tell this share, and how far the law is off.

use std::f64::consts::FRAC_2_PI;

use design::Design;
use metrics::Estimate;

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
    returned: Vec<[f64; 2]>,
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
#[derive(Debug, Clone, Copy)]
pub(super) struct AtWalls {
    /// The most of it over the light beyond a wall.
    pub error: f64,
    /// What all packages that are moved make of it at a place beside a wall, over the mean at full drive.
    pub share: Estimate,
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
            let returned = self.returned.get(part).map_or(1.0, |shares| shares[k]);
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
        let sum = |cells: &[Vec<f64>]| cells.iter().flatten().sum::<f64>();
        let of_part = |part: usize| {
            [0, 1].map(|axis| {
                let Some(away) = self.places.near_wall(axis).checked_sub(1) else { return 1.0 };
                let near = self.near_walls(axis, away, part);
                let beyond: f64 = near.iter().map(|near| sum(&near.image)).sum();
                let missing = near.iter().map(|near| sum(&near.traced) - sum(&near.within));
                if beyond > 0.0 { (missing.sum::<f64>() / beyond).clamp(0.0, 1.0) } else { 1.0 }
            })
        };
        self.walls.returned = (0..self.parts.len()).map(of_part).collect();
    }

    /// Light that lies wrong beside the walls across an axis: the law beside what is traced, cell by
    /// cell, for a package one place nearer than those that tell what comes back; of one channel, or all.
    /// `None` where none is moved.
    pub(super) fn error_at_walls(&self, axis: usize, channel: Option<usize>) -> Option<AtWalls> {
        let near_wall = self.places.near_wall(axis);
        let away = near_wall.checked_sub(2).filter(|_| self.is_moved(axis))?;
        let (groups, cells) = (self.responses.groups, self.places.traced[axis]);
        // Differences in the cells of both walls, light beyond them, there and one place farther, and all.
        let mut wrong = vec![vec![0.0; groups]; 2 * cells];
        let [mut beyond, mut farther, mut all] = [(); 3].map(|()| vec![0.0; groups]);
        let add = |to: &mut [f64], factor: f64, from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(sum, value)| *sum += factor * value);
        };
        let mut one_path = 0.0;
        for (number, part) in self.parts.iter().enumerate() {
            if channel.is_some_and(|channel| part.channel != channel) {
                continue;
            }
            let (returned, y) = (self.walls.returned[number][axis], part.xyz[1]);
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
                near.image.iter().for_each(|cell| add(&mut farther, y, cell));
            }
        }
        let [beyond, farther, all] = [beyond, farther, all].map(|groups| readings(&groups));
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
        let error = Estimate::new(of_beyond((sum - noise).max(0.0)), of_beyond(square.sqrt()));
        Some(AtWalls {
            error: (error.value + 2.0 * error.standard_error).min(1.0),
            share: error.times(farther[groups] / all[groups]),
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
