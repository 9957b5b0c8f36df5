// SPDX-License-Identifier: MIT OR Apache-2.0
//! BSDF XML of WINDOW and Radiance: matrices on the full Klems basis, and tensor trees.
//!
//! In: the text of a file, or a [`WindowBsdf`]. Out: the other. A matrix has one column for each of
//! 145 cells of incidence and one row for each of 145 cells of exit, in 1/sr; a tree is a
//! [`TensorTree`]. Both are functions of the tangential direction in which light travels, so light
//! that passes straight on lies on the diagonal. Sources of the layout: files generated with
//! pyradiance, and Radiance's readers `bsdf_m.c` and `bsdf_t.c`. *Front* is WINDOW's: Radiance and
//! this program take it for light from z < 0, our inner side. Only the data of the visible spectrum
//! are read.

use crate::text::{FormatError, Tokens, check_line_ends, push_rows, quoted};
use bsdf::Transport;
use bsdf::angular_basis::AngularBasis;
use bsdf::direction::Side;
use bsdf::tensor_tree::{Branch, MAX_DEPTH, TensorTree};
use roxmltree::{Document, Node, ParsingOptions};
use std::fmt::Write as _;
use std::io::{self, Write};

/// Deepest nesting of elements that is parsed. Files have 6; the parser takes stack for each.
const MAX_NESTED: usize = 64;

/// Cells of the full Klems basis.
pub const KLEMS: usize = 145;
const BASIS: &str = "LBNL/Klems Full";
const SQUARE: &str = "LBNL/Shirley-Chiu";

/// A direction of scattering: side of incidence and transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direction {
    /// Side that light comes from.
    pub from: Side,
    /// Reflected or transmitted.
    pub transport: Transport,
}

/// The four directions of a file, with their names.
pub const DIRECTIONS: [(&str, Direction); 4] = {
    const fn direction(from: Side, transport: Transport) -> Direction {
        Direction { from, transport }
    }
    [
        ("Transmission Front", direction(Side::Inner, Transport::Transmission)),
        ("Transmission Back", direction(Side::Outer, Transport::Transmission)),
        ("Reflection Front", direction(Side::Inner, Transport::Reflection)),
        ("Reflection Back", direction(Side::Outer, Transport::Reflection)),
    ]
};

/// Values of one block.
#[derive(Clone, Debug, PartialEq)]
pub enum ScatteringData {
    /// Shape (exit, incidence), 145 × 145, 1/sr.
    Klems(Vec<f64>),
    /// Tensor tree.
    Tree(TensorTree),
}

/// One block.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowBlock {
    /// Side of incidence and transport.
    pub direction: Direction,
    /// The values.
    pub data: ScatteringData,
}

/// The content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowBsdf {
    /// Name of the material.
    pub name: String,
    /// Who made it.
    pub manufacturer: String,
    /// Blocks, each direction at most once.
    pub blocks: Vec<WindowBlock>,
}

fn line_at(node: Node<'_, '_>) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}

fn wrong(node: Node<'_, '_>, expected: &str, got: impl Into<String>) -> FormatError {
    FormatError::line(line_at(node), expected, got)
}

/// The child element `name` of an element.
fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Result<Node<'a, 'input>, FormatError> {
    node.children().find(|c| c.tag_name().name() == name).ok_or_else(|| {
        let expected = format!("an element {name} in {}", node.tag_name().name());
        wrong(node, &expected, "none")
    })
}

/// The text of the child element `name` of an element.
fn child_text<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, FormatError> {
    let child = child(node, name)?;
    child
        .text()
        .map(str::trim)
        .filter(|t| !t.is_empty())
        .ok_or_else(|| wrong(child, &format!("text in {name}"), "nothing"))
}

/// Reads the text of a file.
///
/// # Errors
/// If it is not of this layout, on another angle basis, has several kinds of line end, or holds
/// NaN, infinite or negative values or a power above 1.
pub fn read(text: &str) -> Result<WindowBsdf, FormatError> {
    check_line_ends(text)?;
    check_nesting(text)?;
    let options = ParsingOptions { nodes_limit: 100_000, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        FormatError::line(error.pos().row as usize, "well-formed XML", error.to_string())
    })?;
    let root = document.root_element();
    versions(text, root)?;
    if root.tag_name().name() != "WindowElement" {
        let expected = "a BSDF file whose outermost element is WindowElement";
        return Err(wrong(root, expected, quoted(root.tag_name().name())));
    }
    let layer = child(child(root, "Optical")?, "Layer")?;
    let definition = child(layer, "DataDefinition")?;
    let structure = child_text(definition, "IncidentDataStructure")?;
    let kind = ["Columns", "Rows", "TensorTree3", "TensorTree4"]
        .iter()
        .position(|s| s.eq_ignore_ascii_case(structure))
        .ok_or_else(|| {
            let expected = "IncidentDataStructure Columns, Rows, TensorTree3 or TensorTree4";
            wrong(definition, expected, quoted(structure))
        })?;
    let about = |name: &str| {
        child(layer, "Material").and_then(|m| child_text(m, name)).unwrap_or_default().to_owned()
    };
    let mut bsdf =
        WindowBsdf { name: about("Name"), manufacturer: about("Manufacturer"), blocks: Vec::new() };
    for wavelength in layer.children().filter(|n| n.tag_name().name() == "WavelengthData") {
        if !child_text(wavelength, "Wavelength")?.eq_ignore_ascii_case("Visible") {
            continue;
        }
        for node in wavelength.children().filter(|n| n.tag_name().name() == "WavelengthDataBlock") {
            let block = block(node, kind)?;
            if bsdf.blocks.iter().any(|b| b.direction == block.direction) {
                return Err(wrong(node, "each WavelengthDataDirection once", "two"));
            }
            bsdf.blocks.push(block);
        }
    }
    if bsdf.blocks.is_empty() {
        let expected = "a WavelengthDataBlock of the wavelength Visible";
        return Err(wrong(layer, expected, "none"));
    }
    Ok(bsdf)
}

/// Refuses elements nested more than `MAX_NESTED` deep. Of text that is no XML it says nothing:
/// the parser stops where this scan does.
///
/// # Errors
/// At the first element that lies deeper.
pub fn check_nesting(text: &str) -> Result<(), FormatError> {
    let (mut rest, mut depth) = (text, 0_usize);
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let markup = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        let end = match markup.iter().find(|(start, _)| rest.starts_with(start)) {
            Some((start, end)) => {
                rest[start.len()..].find(end).map(|found| start.len() + found + end.len())
            }
            None => tag_end(rest),
        };
        let Some(end) = end else { break };
        let tag = &rest[..end];
        if tag.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.starts_with("<!") && !tag.starts_with("<?") && !tag.ends_with("/>") {
            depth += 1;
        }
        if depth > MAX_NESTED {
            let before = &text[..text.len() - rest.len()];
            let feed = if text.contains('\n') { '\n' } else { '\r' };
            let line = 1 + before.matches(feed).count();
            let expected = format!("elements nested at most {MAX_NESTED} deep");
            return Err(FormatError::line(line, expected, "deeper ones"));
        }
        rest = &rest[end..];
    }
    Ok(())
}

/// End of the tag that `text` begins with: behind the first `>` outside of quotes.
fn tag_end(text: &str) -> Option<usize> {
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(at + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
    }
    None
}

/// Checks that the major versions of XML and of the schema are 1.
fn versions(text: &str, root: Node<'_, '_>) -> Result<(), FormatError> {
    let declaration = text.strip_prefix("<?xml").and_then(|t| t.split_once("?>"));
    if let Some((declaration, _)) = declaration {
        let stated = declaration.split(['"', '\'']).nth(1).unwrap_or_default();
        if !stated.starts_with("1.") {
            return Err(FormatError::line(1, "version 1 of XML", quoted(stated)));
        }
    }
    let schema = root
        .attributes()
        .find(|a| a.name() == "schemaLocation")
        .and_then(|a| a.value().split_once("BSDF-v"));
    match schema {
        Some((_, version)) if !version.starts_with("1.") => {
            let expected = "version 1 of the schema, as in BSDF-v1.4.xsd";
            Err(wrong(root, expected, quoted(version)))
        }
        _ => Ok(()),
    }
}

fn block(node: Node<'_, '_>, kind: usize) -> Result<WindowBlock, FormatError> {
    let name = child_text(node, "WavelengthDataDirection")?;
    let (_, direction) =
        *DIRECTIONS.iter().find(|d| d.0.eq_ignore_ascii_case(name)).ok_or_else(|| {
            let expected = "Transmission or Reflection, Front or Back";
            wrong(node, expected, quoted(name))
        })?;
    let bases: &[(&str, &str)] = if kind < 2 {
        &[("ColumnAngleBasis", BASIS), ("RowAngleBasis", BASIS)]
    } else {
        &[("AngleBasis", SQUARE)]
    };
    for (element, expected) in bases {
        let got = child_text(node, element)?;
        if !got.eq_ignore_ascii_case(expected) {
            return Err(wrong(node, &format!("{element} {expected}"), quoted(got)));
        }
    }
    let scattering = child(node, "ScatteringData")?;
    let text = scattering.text().unwrap_or_default();
    let line = line_at(scattering.first_child().unwrap_or(scattering));
    let data = if kind < 2 {
        ScatteringData::Klems(matrix(text, line, kind == 1)?)
    } else {
        let spaced = text.replace(',', " ").replace('{', " { ").replace('}', " } ");
        ScatteringData::Tree(tree(&mut Tokens::starting(&spaced, line), kind + 1)?)
    };
    Ok(WindowBlock { direction, data })
}

/// 145 × 145 numbers separated by blanks or commas.
fn matrix(text: &str, line: usize, by_rows: bool) -> Result<Vec<f64>, FormatError> {
    // A comma ends a number as a blank does.
    let text = text.replace(',', " ");
    let mut words = Tokens::starting(&text, line);
    let values = words.values("a value of the matrix", KLEMS * KLEMS)?;
    words.end(&format!("{} values and no more", KLEMS * KLEMS))?;
    let values = if by_rows { transposed(&values) } else { values };
    Ok(values)
}

fn transposed(values: &[f64]) -> Vec<f64> {
    (0..KLEMS * KLEMS).map(|k| values[k % KLEMS * KLEMS + k / KLEMS]).collect()
}

/// Reads nested braces; `words` are those of a text with a blank around every brace.
fn tree(words: &mut Tokens<'_>, rank: usize) -> Result<TensorTree, FormatError> {
    let root = branch(words, rank, 0)?;
    words.end("the end of the tree")?;
    Ok(TensorTree { rank, root })
}

fn brace(words: &mut Tokens<'_>, brace: &str) -> Result<(), FormatError> {
    let line = words.line();
    if words.peek() == Some(brace) {
        words.take();
        return Ok(());
    }
    let got = words.peek().map_or("the end of the tree".to_owned(), quoted);
    Err(FormatError::line(line, format!("`{brace}` of a tensor tree"), got))
}

fn branch(words: &mut Tokens<'_>, rank: usize, depth: u32) -> Result<Branch, FormatError> {
    brace(words, "{")?;
    let branch = if words.peek() == Some("{") {
        if depth == MAX_DEPTH {
            let expected = format!("a tree at most {MAX_DEPTH} branches deep");
            return Err(FormatError::line(words.line(), expected, "a deeper one"));
        }
        let mut children = Vec::new();
        for _ in 0..1 << rank {
            children.push(self::branch(words, rank, depth + 1)?);
        }
        Branch::Split(children)
    } else {
        let mut values = Vec::new();
        while words.peek().is_some_and(|word| word != "}") {
            let value = words.number_that("a value of the tree", "0 or more", |v| v >= 0.0)?;
            values.push(value as f32);
        }
        let log2 = (0..=MAX_DEPTH - depth)
            .find(|log2| values.len() == 1 << (*log2 as usize * rank))
            .ok_or_else(|| {
                let expected = format!("a power of {} values", 1 << rank);
                FormatError::line(words.line(), expected, values.len().to_string())
            })?;
        Branch::Block { log2, values }
    };
    brace(words, "}")?;
    Ok(branch)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Writes a file; all blocks are of the kind of the first.
///
/// # Errors
/// If the writer fails.
pub fn write(bsdf: &WindowBsdf, writer: &mut impl Write) -> io::Result<()> {
    let tree_rank = bsdf.blocks.iter().find_map(|b| match &b.data {
        ScatteringData::Tree(tree) => Some(tree.rank),
        ScatteringData::Klems(_) => None,
    });
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <WindowElement xmlns=\"http://windows.lbl.gov\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xsi:schemaLocation=\"http://windows.lbl.gov/BSDF-v1.4.xsd\">\n\
         <WindowElementType>System</WindowElementType>\n<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n\
         \t<Material>\n\t\t<Name>{}</Name>\n\t\t<Manufacturer>{}</Manufacturer>\n\t\t<DeviceType>Other</DeviceType>\n\t</Material>\n\
         \t<Geometry format=\"MGF\"/>\n\t<DataDefinition>\n",
        escaped(&bsdf.name),
        escaped(&bsdf.manufacturer)
    );
    if let Some(rank) = tree_rank {
        let _ =
            writeln!(text, "\t\t<IncidentDataStructure>TensorTree{rank}</IncidentDataStructure>");
    } else {
        push_klems(&mut text);
    }
    text.push_str("\t</DataDefinition>\n");
    for block in &bsdf.blocks {
        let name = DIRECTIONS.iter().find(|d| d.1 == block.direction).map_or("", |d| d.0);
        let _ = write!(
            text,
            "\t<WavelengthData>\n\t\t<LayerNumber>System</LayerNumber>\n\t\t<Wavelength unit=\"Integral\">Visible</Wavelength>\n\
             \t\t<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>\n\t\t<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>\n\
             \t\t<WavelengthDataBlock>\n\t\t\t<WavelengthDataDirection>{name}</WavelengthDataDirection>\n"
        );
        match &block.data {
            ScatteringData::Klems(values) => {
                let _ = writeln!(
                    text,
                    "\t\t\t<ColumnAngleBasis>{BASIS}</ColumnAngleBasis>\n\t\t\t<RowAngleBasis>{BASIS}</RowAngleBasis>\n\
                     \t\t\t<ScatteringDataType>BTDF</ScatteringDataType>\n\t\t\t<ScatteringData>"
                );
                push_rows(&mut text, values, KLEMS);
            }
            ScatteringData::Tree(tree) => {
                let _ = writeln!(
                    text,
                    "\t\t\t<AngleBasis>{SQUARE}</AngleBasis>\n\
                     \t\t\t<ScatteringDataType>BTDF</ScatteringDataType>\n\t\t\t<ScatteringData>"
                );
                push_branch(&mut text, &tree.root);
            }
        }
        text.push_str("\t\t\t</ScatteringData>\n\t\t</WavelengthDataBlock>\n\t</WavelengthData>\n");
        writer.write_all(text.as_bytes())?;
        text.clear();
    }
    text.push_str("</Layer>\n</Optical>\n</WindowElement>\n");
    writer.write_all(text.as_bytes())
}

/// The definition of the full Klems basis.
fn push_klems(text: &mut String) {
    let _ = write!(
        text,
        "\t\t<IncidentDataStructure>Columns</IncidentDataStructure>\n\t\t<AngleBasis>\n\t\t\t<AngleBasisName>{BASIS}</AngleBasisName>\n"
    );
    let cells = AngularBasis::klems();
    let mut cell = 0;
    while cell < cells.len() {
        let [theta, _] = cells.bounds(cell);
        let count = (cell..cells.len())
            .take_while(|c| (cells.bounds(*c)[0][0] - theta[0]).abs() < 1e-9)
            .count();
        let [low, high] = theta.map(|t| t.to_degrees().round());
        let middle = if cell == 0 { 0.0 } else { 0.5 * (low + high) };
        let _ = write!(
            text,
            "\t\t\t<AngleBasisBlock>\n\t\t\t\t<Theta>{middle}</Theta>\n\t\t\t\t<nPhis>{count}</nPhis>\n\t\t\t\t<ThetaBounds>\n\
             \t\t\t\t\t<LowerTheta>{low}</LowerTheta>\n\t\t\t\t\t<UpperTheta>{high}</UpperTheta>\n\t\t\t\t</ThetaBounds>\n\t\t\t</AngleBasisBlock>\n"
        );
        cell += count;
    }
    text.push_str("\t\t</AngleBasis>\n");
}

fn push_branch(text: &mut String, branch: &Branch) {
    match branch {
        Branch::Split(children) => {
            text.push_str("{\n");
            for child in children {
                push_branch(text, child);
            }
            text.push_str("}\n");
        }
        Branch::Block { values, .. } => {
            text.push('{');
            for value in values {
                text.push(' ');
                if *value == 0.0 {
                    text.push('0');
                } else {
                    // Nine digits bring back every f32.
                    let _ = write!(text, "{value:.8e}");
                }
            }
            text.push_str(" }\n");
        }
    }
}
