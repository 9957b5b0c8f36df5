// SPDX-License-Identifier: MIT OR Apache-2.0
//! Building a table: plain rows in, checked and packed arrays out.

use super::grid::{Layout, NodeId};
use super::urns::Urns;
use super::{Grid, OrderTable, Row, SHARE_TOLERANCE, TableHeader};
use crate::error::Error;
use crate::scatter::Polarization;

/// The cumulative sum of a node that absorbs nothing.
pub(super) const FULL: u32 = u32::MAX;

/// Table from rows in any order.
pub(super) fn from_rows(
    header: TableHeader,
    grid: Grid,
    rows: impl IntoIterator<Item = Row>,
) -> Result<OrderTable, Error> {
    grid.validate()?;
    let layout = Layout::new(&grid);
    let mut arrays = [vec![0.0_f32; layout.entries], vec![0.0_f32; layout.entries]];
    let mut seen = [
        vec![false; layout.nodes.len()],
        vec![false; layout.nodes.len()],
    ];
    let mut filled = vec![false; layout.entries];
    for row in rows {
        let which = match row.polarization {
            Polarization::S => 0,
            Polarization::P => 1,
            Polarization::Unpolarized => return Err(Error::UnpolarizedRow),
        };
        let (side, kx_index, ky_index) = (row.side, row.kx_index, row.ky_index);
        let id = NodeId {
            side,
            kx_index,
            ky_index,
        };
        let index = layout.find(id).ok_or(Error::NoSuchNode {
            side,
            kx_index,
            ky_index,
        })?;
        if std::mem::replace(&mut seen[which][index], true) {
            let polarization = row.polarization;
            return Err(Error::NodeTwice {
                side,
                kx_index,
                ky_index,
                polarization,
            });
        }
        let node = layout.nodes[index];
        filled[node.all()].fill(false);
        for (to, order, value) in row.shares {
            let refuse = |expected| {
                Err(Error::Share {
                    side,
                    kx_index,
                    ky_index,
                    to,
                    order,
                    expected,
                    value,
                })
            };
            match node.entry(to, order) {
                // NaN fails every comparison, so the range is asked for positively.
                _ if !(-SHARE_TOLERANCE..=1.0 + SHARE_TOLERANCE).contains(&value) => {
                    return refuse("a share between 0 and 1");
                }
                Some(entry) if filled[entry] => return refuse("each order once"),
                Some(entry) => {
                    filled[entry] = true;
                    arrays[which][entry] = value.clamp(0.0, 1.0) as f32;
                }
                None if value <= SHARE_TOLERANCE => {}
                None => return refuse("no power in an order that does not propagate"),
            }
        }
    }
    for (which, polarization) in [Polarization::S, Polarization::P].into_iter().enumerate() {
        let missing = grid.nodes().zip(&seen[which]).find(|(_, seen)| !**seen);
        if let Some((id, _)) = missing {
            let NodeId {
                side,
                kx_index,
                ky_index,
            } = id;
            return Err(Error::NodeMissing {
                side,
                kx_index,
                ky_index,
                polarization,
            });
        }
    }
    let [s, p] = arrays;
    assemble(header, grid, layout, s, p)
}

/// Table from the arrays of a file.
pub(super) fn from_parts(
    header: TableHeader,
    grid: Grid,
    s: Vec<f32>,
    p: Vec<f32>,
) -> Result<OrderTable, Error> {
    grid.validate()?;
    let layout = Layout::new(&grid);
    for array in [&s, &p] {
        if array.len() != layout.entries {
            return Err(Error::Inconsistent {
                part: "number of shares",
                expected: layout.entries.to_string(),
                got: array.len().to_string(),
            });
        }
    }
    // The layout lists its nodes as the grid does.
    for (id, node) in grid.nodes().zip(&layout.nodes) {
        let NodeId {
            side,
            kx_index,
            ky_index,
        } = id;
        for (entry, to, order) in node.orders() {
            if let Some(value) = [s[entry], p[entry]]
                .into_iter()
                .find(|v| !(0.0..=1.0).contains(v))
            {
                let (expected, value) = ("a share between 0 and 1", f64::from(value));
                return Err(Error::Share {
                    side,
                    kx_index,
                    ky_index,
                    to,
                    order,
                    expected,
                    value,
                });
            }
        }
    }
    assemble(header, grid, layout, s, p)
}

/// Checks the header and the sums, and adds up the shares for sampling.
fn assemble(
    header: TableHeader,
    grid: Grid,
    layout: Layout,
    s: Vec<f32>,
    p: Vec<f32>,
) -> Result<OrderTable, Error> {
    for (name, value) in [
        ("estimated_error", header.estimated_error),
        ("energy_residual", header.energy_residual),
    ] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(Error::Header { name, value });
        }
    }
    let mut cumulative = vec![0; layout.entries];
    // The layout lists its nodes as the grid does.
    for (id, node) in grid.nodes().zip(&layout.nodes) {
        let NodeId {
            side,
            kx_index,
            ky_index,
        } = id;
        let range = node.all();
        let mut total = 0.0;
        for array in [&s, &p] {
            let sum: f64 = array[range.clone()].iter().map(|v| f64::from(*v)).sum();
            if sum > 1.0 + SHARE_TOLERANCE {
                return Err(Error::Gain {
                    side,
                    kx_index,
                    ky_index,
                    sum,
                });
            }
            total += 0.5 * sum;
        }
        // What only rounding separates from 1 is 1: a lossless table never absorbs a ray.
        let lossless = total > 1.0 - SHARE_TOLERANCE;
        let scale = if lossless { 0.5 / total } else { 0.5 };
        let mut sum = 0.0;
        for entry in range.clone() {
            sum += scale * (f64::from(s[entry]) + f64::from(p[entry]));
            cumulative[entry] = (sum * f64::from(FULL)).round() as u32;
        }
        if lossless {
            close(&mut cumulative[range]);
        }
    }
    let urns = Urns::new(&grid, &layout, &cumulative);
    Ok(OrderTable {
        header,
        grid,
        layout,
        s,
        p,
        cumulative,
        urns,
        jones: None,
    })
}

/// Makes the running sums of a lossless node end in exactly [`FULL`]: the last order that has a share takes the rounding.
fn close(cumulative: &mut [u32]) {
    let Some(&last) = cumulative.last() else {
        return;
    };
    let from = cumulative.partition_point(|c| *c < last);
    cumulative[from..].fill(FULL);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_gives_rounding_to_the_last_order_with_a_share() {
        let mut sums = [10, 20, FULL - 3, FULL - 3];
        close(&mut sums);
        assert_eq!(sums, [10, 20, FULL, FULL]);
    }
}
