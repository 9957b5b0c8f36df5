// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls of an array that is larger than the stated one. Light of a package far from all walls, moved
//! near one, is mirrored in it times the share that comes back; packages nearer to the wall, which are
//! traced where they stand, tell this share, and how far the law is off.

use design::Design;
use metrics::{Estimate, JackknifedFigure};

use super::Array;
use super::map_receiver::Frame;
use super::places::Places;
use super::reference::readings;
use super::responses::Responses;
use super::superposition::{Piece, rows};

/// Walls about the whole array.
#[derive(Debug, Clone)]
pub(super) struct Walls {
    /// Twice the bin at which the lower and the upper wall stand, along x and y.
    twice: [[isize; 2]; 2],
    /// Bins of the whole map.
    bins: [usize; 2],
    /// Share of the light beyond a wall that comes back, of each part of the light, along x and y.
    returned: Vec<[f64; 2]>,
}

/// Light of a package near a wall, by groups of paths.
struct NearWall {
    /// Traced where it stands.
    traced: Vec<f64>,
    /// Of the inner package moved there: within the wall, and beyond it.
    within: Vec<f64>,
    beyond: Vec<f64>,
}

/// Error of the law of the walls.
#[derive(Debug, Clone, Copy)]
pub(super) struct AtWalls {
    /// The most that it is off, over the light beyond a wall.
    pub law: f64,
    /// Light that it gives too much, of all packages from those that are moved on, over that of one.
    pub moved: Estimate,
}

impl Walls {
    /// Walls of `design`, or none, about the whole array, whose map is `frame`.
    pub fn new(design: &Design, places: &Places, (step, frame): ([usize; 2], Frame)) -> Self {
        let twice = [0, 1].map(|k| {
            let more = (places.whole[k] - places.traced[k]) as f64 * places.pitch_mm[k];
            let of_walls = design.housing_half_mm().filter(|_| step[k] > 0);
            let low = of_walls.map_or(frame.low_mm[k], |half| -half[k] - 0.5 * more);
            let low = (2.0 * (low - frame.low_mm[k]) / frame.bin_mm[k]).round() as isize;
            [low, 2 * frame.bins[k] as isize - low]
        });
        Self { twice, bins: frame.bins, returned: Vec::new() }
    }

    /// A piece of a part of the light, and its images in the walls that it crosses.
    pub fn folded<'a>(&self, piece: Piece<'a>, part: usize) -> Vec<Piece<'a>> {
        let within = self.twice.map(|[low, high]| [low.div_euclid(2), (high + 1).div_euclid(2)]);
        let mut pieces = vec![Piece { within, ..piece }];
        for k in 0..2 {
            let end = piece.at[k] + piece.bins()[k] as isize;
            let crossed = [piece.at[k] < 0, end > self.bins[k] as isize];
            let walls = self.twice[k].into_iter().zip(crossed).filter(|(_, crossed)| *crossed);
            let returned = self.returned.get(part).map_or(1.0, |shares| shares[k]);
            let images: Vec<Piece> = walls
                .flat_map(|(twice, _)| {
                    pieces.iter().map(move |piece| {
                        let mut image = Piece { weight: returned * piece.weight, ..*piece };
                        image.at[k] = twice - end;
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
        let sum = |groups: &[f64]| groups.iter().sum::<f64>();
        let of_part = |part: usize| {
            [0, 1].map(|axis| {
                let Some(away) = self.places.near_wall(axis).checked_sub(1) else { return 1.0 };
                let near = self.near_walls(axis, away, part);
                let beyond: f64 = near.iter().map(|near| sum(&near.beyond)).sum();
                let missing = near.iter().map(|near| sum(&near.traced) - sum(&near.within));
                if beyond > 0.0 { (missing.sum::<f64>() / beyond).clamp(0.0, 1.0) } else { 1.0 }
            })
        };
        self.walls.returned = (0..self.parts.len()).map(of_part).collect();
    }

    /// How far the law of the walls across an axis is off, for a package one place nearer to a wall than
    /// those that tell what comes back; of one channel, or all. `None` where none is moved.
    pub(super) fn error_at_walls(&self, axis: usize, channel: Option<usize>) -> Option<AtWalls> {
        let groups = self.responses.groups;
        let near_wall = self.places.near_wall(axis);
        let away = near_wall.checked_sub(2).filter(|_| self.is_moved(axis))?;
        let [mut error, mut beyond, mut moved, mut all] = [(); 4].map(|()| vec![0.0; groups]);
        for (number, part) in self.parts.iter().enumerate() {
            if channel.is_some_and(|channel| part.channel != channel) {
                continue;
            }
            let (returned, y) = (self.walls.returned[number][axis], part.xyz[1]);
            let near = self.near_walls(axis, away, number);
            let others = near_wall..=self.places.reach(axis);
            let others: Vec<NearWall> =
                others.flat_map(|away| self.near_walls(axis, away, number)).collect();
            for group in 0..groups {
                for near in &near {
                    let law = near.within[group] + returned * near.beyond[group];
                    error[group] += y * (law - near.traced[group]);
                    beyond[group] += y * near.beyond[group];
                    all[group] += y * (near.within[group] + near.beyond[group]);
                }
                moved[group] += y * others.iter().map(|near| near.beyond[group]).sum::<f64>();
            }
        }
        let [error, beyond, moved, all] =
            [error, beyond, moved, all].map(|groups| readings(&groups));
        let estimate = |of: &dyn Fn(usize) -> f64| {
            JackknifedFigure::new(of(groups), (0..groups).map(of).collect()).estimate()
        };
        if beyond.iter().any(|light| *light <= 0.0) {
            return None;
        }
        let law = estimate(&|k| error[k] / beyond[k]);
        let moved = estimate(&|k| error[k] / beyond[k] * moved[k] / all[k]);
        Some(AtWalls { law: law.value.abs() + 2.0 * law.standard_error, moved })
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
        let low = self.walls.twice[axis][0];
        let near = |is_low: bool| {
            let number = if is_low { away } else { traced[axis] - 1 - away };
            let moved = 2 * (middle[axis] as isize - number as isize) * self.step[axis] as isize;
            // Bins of the inner package that stand beyond the wall once it is moved.
            let wall = if is_low { low } else { 2 * bins[axis] as isize - low };
            let is_beyond = |bin: usize| {
                let twice = 2 * bin as isize + 1 - moved;
                if is_low { twice < wall } else { twice > wall }
            };
            let sum = |profile: &[Vec<f64>], is_counted: &dyn Fn(usize) -> bool| {
                let mut sums = vec![0.0; responses.groups];
                let counted = profile.iter().enumerate().filter(|(bin, _)| is_counted(*bin));
                for (_, groups) in counted {
                    sums.iter_mut().zip(groups).for_each(|(sum, value)| *sum += value);
                }
                sums
            };
            NearWall {
                traced: if places.is_traced(axis, number) {
                    sum(&at(number), &|_| true)
                } else {
                    Vec::new()
                },
                within: sum(&inner, &|bin| !is_beyond(bin)),
                beyond: sum(&inner, &is_beyond),
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
        let sums = |_: usize, row: &super::superposition::RowOfGroups| {
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
