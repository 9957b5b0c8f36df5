// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files with wavelengths, written byte by byte.
//!
//! TM-25: a header, spectral tables, and a column for each ray's wavelength or table. LightTools: a
//! header, eight numbers a ray, the last its wavelength, and an end mark. Source: IES TM-25-13 and
//! the public code of TM25RaySetTools. Nothing here uses the readers under test.

pub mod dome;

use std::path::Path;

/// A ray: where it starts (mm), where it goes, its flux and its wavelength (nm) or the number of
/// its spectral table.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Start, mm.
    pub position: [f32; 3],
    /// Unit vector.
    pub direction: [f32; 3],
    /// W or lm.
    pub flux: f32,
    /// nm, or a number from 1.
    pub colour: f32,
}

/// What the header says of wavelengths.
#[derive(Debug, Clone)]
pub enum Says {
    /// Nothing.
    Nothing,
    /// One wavelength for all, nm.
    One(f32),
    /// The colour of a ray is its wavelength.
    PerRay,
    /// One table of wavelength and power for all.
    Table(Vec<[f32; 2]>),
    /// The colour of a ray is the number of its table.
    Tables(Vec<Vec<[f32; 2]>>),
}

/// Writes a file of rays whose flux is in W, or in lm.
///
/// # Panics
/// If it cannot be written.
pub fn write(path: &Path, says: &Says, radiant: bool, rays: &[Ray]) {
    let mut bytes = vec![0_u8; 36_288];
    let mut put = |at: usize, word: [u8; 4]| bytes[at..at + 4].copy_from_slice(&word);
    let sum: f32 = rays.iter().map(|ray| f64::from(ray.flux)).sum::<f64>() as f32;
    put(0, *b"TM25");
    put(4, 2013_u32.to_le_bytes());
    put(if radiant { 16 } else { 12 }, sum.to_le_bytes());
    put(if radiant { 12 } else { 16 }, f32::NAN.to_le_bytes());
    put(20, (rays.len() as u32).to_le_bytes());
    let (kind, one, tables): (u32, f32, &[Vec<[f32; 2]>]) = match says {
        Says::Nothing => (0, f32::NAN, &[]),
        Says::One(nm) => (1, *nm, &[]),
        Says::PerRay => (2, f32::NAN, &[]),
        Says::Table(table) => (3, f32::NAN, std::slice::from_ref(table)),
        Says::Tables(tables) => (4, f32::NAN, tables),
    };
    put(60, kind.to_le_bytes());
    put(64, one.to_le_bytes());
    put(76, (tables.len() as u32).to_le_bytes());
    let flags = [true, true, radiant, kind == 2, !radiant, false, false, kind == 4];
    for (k, flag) in flags.into_iter().enumerate() {
        put(256 + 4 * k, u32::from(flag).to_le_bytes());
    }
    for table in tables {
        bytes.extend((table.len() as u32).to_le_bytes());
        bytes.extend(table.iter().flatten().flat_map(|v| v.to_le_bytes()));
    }
    let used = bytes.len() - 36_288;
    bytes.resize(36_288 + used.next_multiple_of(32), 0);
    for ray in rays {
        let mut columns = [&ray.position[..], &ray.direction].concat();
        match (kind, radiant) {
            (2, false) => columns.extend([ray.colour, ray.flux]),
            (2 | 4, _) => columns.extend([ray.flux, ray.colour]),
            _ => columns.push(ray.flux),
        }
        bytes.extend(columns.iter().flat_map(|v| v.to_le_bytes()));
    }
    std::fs::write(path, bytes).expect("written");
}

/// Writes a LightTools file of rays whose flux is in W and whose colour is their wavelength.
///
/// # Panics
/// If it cannot be written.
pub fn write_lighttools(path: &Path, rays: &[Ray]) {
    let sum: f64 = rays.iter().map(|ray| f64::from(ray.flux)).sum();
    let mut bytes = b"LTRF".to_vec();
    // Version 2.0, W, positions count, wavelengths, millimetres; the origin; the flux.
    for code in [2_u32, 0, 0, 0, 2, 1] {
        bytes.extend(code.to_le_bytes());
    }
    for value in [0.0, 0.0, 0.0, sum as f32] {
        bytes.extend(value.to_le_bytes());
    }
    for ray in rays {
        let numbers = ray.position.iter().chain(&ray.direction);
        let numbers = numbers.chain([&ray.flux, &ray.colour]);
        bytes.extend(numbers.flat_map(|v| v.to_le_bytes()));
    }
    bytes.extend(b"LTRFEND");
    std::fs::write(path, bytes).expect("written");
}
