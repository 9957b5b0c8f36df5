// SPDX-License-Identifier: MIT OR Apache-2.0
//! The equations reduced to the skeletons of the tiles, in single precision: each tile is solved by
//! itself, and one dense matrix couples what they send \[Martinsson2005\].

use crate::compression::{CMat, PER_PANEL};
use crate::coupling::Sides;
use crate::equations::System;
use crate::lu::{Factors, SingleMat, single, to_single};
use crate::tile::{Skeletons, Tile, nodes_of};
use faer::linalg::matmul::matmul;
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut, MatRef, Par};
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;

/// Columns of the dense matrix that are computed together, chosen.
const COLUMNS_TOGETHER: usize = 64;

/// A tile by itself, for light of one parity: with what it receives at its skeleton z, its equations
/// are D x + L z = f and it sends y = C x.
struct Own {
    /// Factors of D, the equations of the tile alone.
    factors: Factors,
    /// The matrix C, corners included.
    collect: SingleMat,
    /// The product 1/D L.
    spread: SingleMat,
    /// The product C 1/D L, this tile's part of E.
    exchange: SingleMat,
}

impl Own {
    /// Solves a tile by itself, once for each parity.
    fn all(system: &System, number: usize) -> Vec<Self> {
        let tile = &system.tiles[number];
        let sides = system.coupling.of_panels(&tile.panels, &tile.panels);
        let parities = 0..system.parities.len();
        parities.map(|parity| Self::new(system, number, parity, &sides)).collect()
    }

    fn new(system: &System, number: usize, parity: usize, sides: &Sides) -> Self {
        let (tile, Skeletons { sends, receives }) =
            (&system.tiles[number], &system.skeletons[number]);
        let size = tile.size();
        let sign = system.parities[parity];
        let mut matrix =
            CMat::from_fn(size, size, |i, j| sides[0][(i, j)] + sign * sides[1][(i, j)]);
        let mut collect = sends.basis.to_owned();
        for group in &system.groups {
            let Some(first) = tile.panels.iter().position(|panel| *panel == group.panels[0]) else {
                continue;
            };
            let block = &group.blocks[parity];
            let columns = first * PER_PANEL..first * PER_PANEL + block.nrows();
            // The product in single precision would take a step of refinement more.
            let product = matrix.as_ref().subcols(columns.start, columns.len()) * block;
            matrix.as_mut().subcols_mut(columns.start, columns.len()).copy_from(&product);
            let product = collect.as_ref().subcols(columns.start, columns.len()) * to_single(block);
            collect.as_mut().subcols_mut(columns.start, columns.len()).copy_from(&product);
        }
        let mut entries = Vec::with_capacity(size * size);
        for (j, column) in matrix.col_iter().enumerate() {
            let unit = |i| if i == j { Complex64::ONE } else { Complex64::ZERO };
            entries.extend(column.iter().enumerate().map(|(i, value)| single(value + unit(i))));
        }
        let factors = Factors::new(entries, size);
        let spread = factors.solve(&receives.basis.transpose().to_owned());
        let exchange = &collect * &spread;
        Self { factors, collect, spread, exchange }
    }
}

/// The equations for light of one parity, compressed to the skeletons of the tiles: what they send, y,
/// and receive, z, obey y + E z = g and z = S y, with E of each tile by itself and the kernels S from
/// tile to tile.
pub(crate) struct Reduced<'a> {
    tiles: &'a [Tile],
    own: Vec<Own>,
    /// First unknown of each tile among what is sent and received.
    sent: Vec<usize>,
    received: Vec<usize>,
    /// The kernels S, column by column.
    kernels: Vec<Complex32>,
    /// Factors of 1 + E S.
    factors: Factors,
}

impl<'a> Reduced<'a> {
    /// Reduces the equations of each parity.
    pub fn all(system: &System<'a>) -> Vec<Self> {
        let numbers = 0..system.tiles.len();
        let mut own: Vec<Vec<Own>> =
            numbers.into_par_iter().map(|number| Own::all(system, number)).collect();
        let starts = |count: fn(&Skeletons) -> usize| {
            system.skeletons.iter().fold(vec![0], |mut starts, skeletons| {
                starts.push(starts[starts.len() - 1] + count(skeletons));
                starts
            })
        };
        let sent = starts(|skeletons| skeletons.sends.kept.len());
        let received = starts(|skeletons| skeletons.receives.kept.len());
        let [width, height] = [&sent, &received].map(|starts| starts[starts.len() - 1]);
        let parities = 0..system.parities.len();
        let mut kernels = vec![vec![Complex32::ZERO; height * width]; parities.len()];
        let mut columns: Vec<Vec<&mut [Complex32]>> =
            (0..system.tiles.len()).map(|_| Vec::new()).collect();
        for kernels in &mut kernels {
            let mut rest = kernels.as_mut_slice();
            for (columns, pair) in columns.iter_mut().zip(sent.windows(2)) {
                let (first, others) =
                    std::mem::take(&mut rest).split_at_mut((pair[1] - pair[0]) * height);
                columns.push(first);
                rest = others;
            }
        }
        columns.into_par_iter().enumerate().for_each(|(source, mut columns)| {
            for target in (0..system.tiles.len()).filter(|target| *target != source) {
                for (columns, block) in columns.iter_mut().zip(system.exchanged(target, source)) {
                    for (j, values) in block.col_iter().enumerate() {
                        let column = &mut columns[j * height + received[target]..];
                        column
                            .iter_mut()
                            .zip(values.iter())
                            .for_each(|(to, &from)| *to = single(from));
                    }
                }
            }
        });
        let mut all = Vec::new();
        for (parity, kernels) in kernels.into_iter().enumerate().rev() {
            let own: Vec<Own> = own.iter_mut().map(|own| own.remove(parity)).collect();
            let mut entries = vec![Complex32::ZERO; width * width];
            entries.par_chunks_mut(width.max(1) * COLUMNS_TOGETHER).enumerate().for_each(
                |(number, columns)| {
                    let first = COLUMNS_TOGETHER * number;
                    let count = columns.len() / width;
                    let mut columns = MatMut::from_column_major_slice_mut(columns, width, count);
                    let kernels = MatRef::from_column_major_slice(&kernels, height, width);
                    let kernels = kernels.subcols(first, count);
                    for (tile, own) in own.iter().enumerate() {
                        let rows = sent[tile]..sent[tile + 1];
                        let from = received[tile]..received[tile + 1];
                        matmul(
                            columns.rb_mut().subrows_mut(rows.start, rows.len()),
                            Accum::Replace,
                            own.exchange.as_ref(),
                            kernels.subrows(from.start, from.len()),
                            Complex32::ONE,
                            Par::Seq,
                        );
                    }
                    for j in 0..count {
                        columns[(first + j, j)] += Complex32::ONE;
                    }
                },
            );
            let factors = Factors::new(entries, width);
            let (sent, received) = (sent.clone(), received.clone());
            all.push(Self { tiles: system.tiles, own, sent, received, kernels, factors });
        }
        all.reverse();
        all
    }

    /// Solves for these right-hand sides f: the densities ρ', a column a source.
    pub fn solve(&self, right: &CMat) -> CMat {
        let count = right.ncols();
        let rows_of = |tile: &Tile| {
            let rows = tile.panels.iter().flat_map(|p| p * PER_PANEL..(p + 1) * PER_PANEL);
            rows.collect::<Vec<usize>>()
        };
        let alone = |(tile, own): (&Tile, &Own)| {
            let rows = rows_of(tile);
            let right = SingleMat::from_fn(rows.len(), count, |i, j| single(right[(rows[i], j)]));
            own.factors.solve(&right)
        };
        let alone: Vec<SingleMat> = self.tiles.par_iter().zip(&self.own).map(alone).collect();
        let mut found = CMat::zeros(right.nrows(), count);
        let [width, height] = [&self.sent, &self.received].map(|starts| starts[starts.len() - 1]);
        let mut sent = SingleMat::zeros(width, count);
        for (tile, alone) in alone.iter().enumerate() {
            let own = &self.own[tile];
            sent.as_mut()
                .subrows_mut(self.sent[tile], own.collect.nrows())
                .copy_from(&own.collect * alone);
        }
        let sent = self.factors.solve(&sent);
        let kernels = MatRef::from_column_major_slice(&self.kernels, height, width);
        let parts = (0..self.tiles.len()).into_par_iter().map(|tile| {
            let own = &self.own[tile];
            let kernels = kernels.subrows(self.received[tile], own.spread.ncols());
            &alone[tile] - &own.spread * (kernels * &sent)
        });
        for (tile, part) in self.tiles.iter().zip(parts.collect::<Vec<SingleMat>>()) {
            for (i, row) in rows_of(tile).into_iter().enumerate() {
                for j in 0..count {
                    let value = part[(i, j)];
                    found[(row, j)] = Complex64::new(value.re.into(), value.im.into());
                }
            }
        }
        found
    }
}

impl System<'_> {
    /// Kernels from what one tile sends to what another receives, by parity.
    fn exchanged(&self, target: usize, source: usize) -> Vec<CMat> {
        let mesh = self.coupling.mesh;
        let (to, from) = (&self.tiles[target], &self.tiles[source]);
        let receives = &self.skeletons[target].receives;
        let sends = &self.skeletons[source].sends;
        let (sides, rows, columns) = if to.is_near(from, mesh) {
            let sides = self.coupling.of_panels(&to.panels, &from.panels);
            (sides, receives.kept.clone(), sends.kept.clone())
        } else {
            let (targets, rows) = nodes_of(&to.nodes(mesh), &receives.kept);
            let (sources, columns) = nodes_of(&from.nodes(mesh), &sends.kept);
            (self.coupling.of_nodes(&targets, &sources), rows, columns)
        };
        let of_parity = |sign: &f64| {
            let value = |i: usize, j: usize| {
                let place = (rows[i], columns[j]);
                sides[0][place] + sign * sides[1][place]
            };
            let kernels = CMat::from_fn(rows.len(), columns.len(), value);
            receives.triangle.transpose() * (kernels * &sends.triangle)
        };
        self.parities.iter().map(of_parity).collect()
    }
}
