// SPDX-License-Identifier: MIT OR Apache-2.0
//! Native file format of order tables: versioned, checksummed, self-describing.
//!
//! In: an [`OrderTable`] or the bytes of a file. Out: the bytes, or the checked table. The layout,
//! all numbers little-endian (`docs/reference/native-table-format.md` has the details):
//!
//! ```text
//! 8 bytes  magic "BWORDERS"
//! u32      version: 2, or 3 with Jones matrices
//! u32      length of the header in bytes
//! u64      length of the payload in bytes
//! header   JSON: origin of the table, grid; name, dtype, shape and payload offset of every array
//! payload  the arrays, one after the other
//! 32 bytes SHA-256 of everything before
//! ```
//!
//! In Python:
//!
//! ```python
//! import hashlib, json, struct
//! import numpy as np
//!
//! data = open("ring-075.bworders", "rb").read()
//! magic, version, header_length, payload_length = struct.unpack_from("<8sIIQ", data)
//! assert magic == b"BWORDERS" and version in (2, 3)
//! assert hashlib.sha256(data[:-32]).digest() == data[-32:]
//! header = json.loads(data[24 : 24 + header_length])
//! arrays = {}
//! for a in header["arrays"]:
//!     start = 24 + header_length + a["offset"]
//!     values = np.frombuffer(data, a["dtype"], int(np.prod(a["shape"])), start)
//!     arrays[a["name"]] = values.reshape(a["shape"])
//! ```

use crate::error::Error;
use crate::json;
use crate::order_table::{Grid, OrderTable, TableHeader};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io::{Read, Write};

/// First bytes of a file.
const MAGIC: &[u8; 8] = b"BWORDERS";
/// Version without Jones matrices.
pub const VERSION: u32 = 2;
/// Version with the array of Jones matrices.
pub const VERSION_WITH_JONES: u32 = 3;
/// Bytes before the header.
const PRELUDE: usize = 24;
/// Bytes of the arrays per node, without efficiencies.
const BYTES_PER_NODE: u64 = 1 + 2 + 4 + 4 + 4 + 4;

/// The JSON header.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct FileHeader {
    table: TableHeader,
    grid: Grid,
    arrays: Vec<ArrayInfo>,
}

/// Type and position of an array.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct ArrayInfo {
    name: String,
    /// Type as numpy spells it.
    dtype: String,
    shape: Vec<usize>,
    /// Bytes from the start of the payload.
    offset: usize,
}

/// Name of the array of Jones matrices: by entry, out, in, real and imaginary part.
const JONES: &str = "jones";

fn version(with_jones: bool) -> u32 {
    if with_jones { VERSION_WITH_JONES } else { VERSION }
}

/// Arrays and their bytes, in the order of the payload.
fn pack(table: &OrderTable) -> (Vec<ArrayInfo>, Vec<u8>) {
    let mut infos = Vec::new();
    let mut payload = Vec::new();
    let mut add = |name: &str, dtype: &str, shape: Vec<usize>, bytes: Vec<u8>| {
        infos.push(ArrayInfo {
            name: name.to_owned(),
            dtype: dtype.to_owned(),
            shape,
            offset: payload.len(),
        });
        payload.extend(bytes);
    };
    let nodes = &table.layout().nodes;
    let ids: Vec<_> = table.grid().nodes().collect();
    let count = nodes.len();
    add("node_side", "u1", vec![count], ids.iter().map(|id| id.side.index() as u8).collect());
    add(
        "node_ky",
        "<u2",
        vec![count],
        ids.iter().flat_map(|id| (id.ky_index as u16).to_le_bytes()).collect(),
    );
    add(
        "node_kx",
        "<i4",
        vec![count],
        ids.iter().flat_map(|id| (id.kx_index as i32).to_le_bytes()).collect(),
    );
    add(
        "node_first",
        "<u4",
        vec![count],
        nodes.iter().flat_map(|n| n.first.to_le_bytes()).collect(),
    );
    let lowest = nodes.iter().flat_map(|n| n.lowest).flat_map(i16::to_le_bytes);
    add("node_lowest", "<i2", vec![count, 2], lowest.collect());
    let counts = nodes.iter().flat_map(|n| n.count).flat_map(u16::to_le_bytes);
    add("node_count", "<u2", vec![count, 2], counts.collect());
    for (name, array) in ["s", "p"].into_iter().zip(table.arrays()) {
        add(name, "<f4", vec![array.len()], array.iter().flat_map(|v| v.to_le_bytes()).collect());
    }
    if let Some(jones) = table.packed_jones() {
        let numbers = jones.as_flattened();
        add(
            JONES,
            "<f4",
            vec![jones.len(), 2, 2, 2],
            numbers.iter().flat_map(|v| v.to_le_bytes()).collect(),
        );
    }
    (infos, payload)
}

/// Writes a table.
///
/// # Errors
/// If the writer fails.
pub fn write(table: &OrderTable, mut writer: impl Write) -> Result<(), Error> {
    let (arrays, payload) = pack(table);
    let header = FileHeader { table: table.header().clone(), grid: table.grid().clone(), arrays };
    let mut header = serde_json::to_vec(&header)?;
    // Blanks, which JSON ignores, align the payload to eight bytes.
    header.resize(header.len().next_multiple_of(8), b' ');
    let mut bytes = Vec::with_capacity(PRELUDE + header.len() + payload.len() + 32);
    bytes.extend(MAGIC);
    bytes.extend(version(table.has_jones()).to_le_bytes());
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(header);
    bytes.extend(payload);
    let checksum = Sha256::digest(&bytes);
    bytes.extend(checksum);
    writer.write_all(&bytes)?;
    writer.flush()?;
    Ok(())
}

/// Reads a table and checks it: the file against its checksum, its parts against each other, the
/// efficiencies as in [`OrderTable::build`].
///
/// # Errors
/// If it is not such a file, of another version, truncated, altered, followed by more, or
/// inconsistent.
pub fn read(mut reader: impl Read) -> Result<OrderTable, Error> {
    let prelude = read_part(&mut reader, "first bytes", PRELUDE as u64)?;
    if !prelude.starts_with(MAGIC) {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        return Err(Error::Magic { expected: text(MAGIC), got: text(&prelude[..8]) });
    }
    let [version, header_length] = [8, 12].map(|at| u32::from_le_bytes(four(&prelude[at..])));
    if version != VERSION && version != VERSION_WITH_JONES {
        return Err(Error::Version { expected: VERSION, got: version });
    }
    let [low, high] = [16, 20].map(|at| u64::from(u32::from_le_bytes(four(&prelude[at..]))));
    let payload_length = low | high << 32;

    let header = read_part(&mut reader, "header", u64::from(header_length))?;
    let payload = read_part(&mut reader, "arrays", payload_length)?;
    let stored = read_part(&mut reader, "checksum", 32)?;
    if reader.take(1).read_to_end(&mut Vec::new())? > 0 {
        let expected = (PRELUDE + header.len() + payload.len() + 32) as u64;
        return Err(Error::TrailingBytes { expected });
    }
    let mut hasher = Sha256::new();
    for part in [&prelude, &header, &payload] {
        hasher.update(part);
    }
    let computed = hasher.finalize();
    if computed[..] != stored[..] {
        return Err(Error::Checksum { expected: hex(&stored), got: hex(&computed) });
    }
    let header = json::parse(&header)?;
    let header: FileHeader = serde_json::from_value(header)?;
    let with_jones = header.arrays.iter().any(|array| array.name == JONES);
    if version != self::version(with_jones) {
        return Err(Error::Version { expected: self::version(with_jones), got: version });
    }
    unpack(&header, &payload)
}

/// Table from a header and a payload whose checksum is right.
fn unpack(header: &FileHeader, payload: &[u8]) -> Result<OrderTable, Error> {
    header.grid.validate()?;
    let contradiction =
        |part, expected: String, got: String| Err(Error::Inconsistent { part, expected, got });
    // The payload must be large enough before anything is allocated for the grid.
    let nodes = header.grid.node_count() as u64;
    if (payload.len() as u64) < nodes * BYTES_PER_NODE {
        let expected = format!("at least {} bytes for {nodes} nodes", nodes * BYTES_PER_NODE);
        return contradiction("arrays", expected, format!("{} bytes", payload.len()));
    }
    let [s, p] = ["s", "p"].map(|name| floats(header, payload, name));
    let mut table = OrderTable::from_parts(header.table.clone(), header.grid.clone(), s?, p?)?;
    if header.arrays.iter().any(|array| array.name == JONES) {
        let numbers = floats(header, payload, JONES)?;
        let (jones, rest) = numbers.as_chunks::<8>();
        if jones.len() != table.entry_count() || !rest.is_empty() {
            let expected = format!("{} matrices", table.entry_count());
            return contradiction("arrays", expected, format!("{} numbers", numbers.len()));
        }
        table = table.with_packed_jones(jones.to_vec())?;
    }
    let (arrays, expected) = pack(&table);
    if header.arrays != arrays {
        return contradiction(
            "list of arrays",
            format!("{arrays:?}"),
            format!("{:?}", header.arrays),
        );
    }
    if expected != payload {
        let at = expected
            .iter()
            .zip(payload)
            .position(|(a, b)| a != b)
            .unwrap_or(expected.len().min(payload.len()));
        let expected = "the nodes of the grid and nothing else".to_owned();
        return contradiction("arrays", expected, format!("another byte at offset {at}"));
    }
    Ok(table)
}

/// The f32 array `name` of a payload.
fn floats(header: &FileHeader, payload: &[u8], name: &'static str) -> Result<Vec<f32>, Error> {
    let range = header.arrays.iter().find(|a| a.name == name).and_then(|array| {
        let length = array.shape.iter().try_fold(4_usize, |product, n| product.checked_mul(*n))?;
        payload.get(array.offset..array.offset.checked_add(length)?)
    });
    let bytes = range.ok_or_else(|| Error::Inconsistent {
        part: "list of arrays",
        expected: format!("an array {name:?} within {} bytes", payload.len()),
        got: format!("{:?}", header.arrays),
    })?;
    Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes(four(b))).collect())
}

/// Exactly `length` bytes; never allocates more than the reader holds.
fn read_part(reader: &mut impl Read, part: &'static str, length: u64) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    reader.take(length).read_to_end(&mut bytes)?;
    let got = bytes.len() as u64;
    if got < length { Err(Error::Truncated { part, expected: length, got }) } else { Ok(bytes) }
}

/// The first four bytes of at least four.
fn four(bytes: &[u8]) -> [u8; 4] {
    [bytes[0], bytes[1], bytes[2], bytes[3]]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests;
