// SPDX-License-Identifier: MIT OR Apache-2.0
//! STEP (ISO 10303-21, AP214) of a whole design: one part a body with its exact surfaces, and an
//! assembly that places their copies, in millimetres.
//!
//! A generating curve gives planes, cylinders, cones, spheres and tori; an arc whose circle meets
//! the axis gives a surface of revolution. All but planes are two faces of half a turn, so that no
//! face has a seam. Equal designs give equal bytes: the time in the header is that of no clock.

use std::collections::HashMap;
use std::fmt::{Display, Write as _};

use anyhow::{Result, ensure};
use glam::{DMat3, DVec3};

use super::body::{Body, Form};
use super::mesh::BOX_FACES;
use super::{Writer, Writes, program};
use runtime::atomic_file::Sink;

mod revolution;

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "step",
    help: "CAD: STEP AP214 of the whole design, exact surfaces, .step or .stp",
    endings: &["step", "stp"],
    writes: Writes::Solids(write),
};

/// Allowed number of triangles of a body, each of which takes about a kilobyte.
const MAX_TRIANGLES: usize = 100_000;

/// Distance within which points are one place in the reader, mm.
const ACCURACY_MM: f64 = 1e-7;

/// Number of an entity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Id(usize);

impl Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A real number as the format has it: with a point, in shortest digits.
struct Real(f64);

impl Display for Real {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // -0 is 0.
        let text = format!("{:?}", self.0 + 0.0);
        match text.split_once('e') {
            None => f.write_str(&text),
            Some((digits, exponent)) if digits.contains('.') => write!(f, "{digits}E{exponent}"),
            Some((digits, exponent)) => write!(f, "{digits}.E{exponent}"),
        }
    }
}

/// A text between apostrophes.
struct Text<'a>(&'a str);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_char('\'')?;
        for letter in self.0.chars() {
            match letter {
                '\'' => f.write_str("''")?,
                '\\' => f.write_str("\\\\")?,
                ' '..='~' => f.write_char(letter)?,
                '\0'..='\u{ffff}' => write!(f, "\\X2\\{:04X}\\X0\\", u32::from(letter))?,
                _ => write!(f, "\\X4\\{:08X}\\X0\\", u32::from(letter))?,
            }
        }
        f.write_char('\'')
    }
}

/// Ids joined by commas.
struct List<'a>(&'a [Id]);

impl Display for List<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, id) in self.0.iter().enumerate() {
            write!(f, "{}{id}", if k > 0 { "," } else { "" })?;
        }
        Ok(())
    }
}

/// True or false as the format has it.
fn flag(value: bool) -> &'static str {
    if value { ".T." } else { ".F." }
}

/// Writer of numbered entities.
struct Entities<'a> {
    file: &'a mut dyn Sink,
    last: usize,
}

impl Entities<'_> {
    fn add(&mut self, entity: &dyn Display) -> Result<Id> {
        self.last += 1;
        writeln!(self.file, "#{}={entity};", self.last)?;
        Ok(Id(self.last))
    }

    fn point(&mut self, at: DVec3) -> Result<Id> {
        let [x, y, z] = at.to_array().map(Real);
        self.add(&format_args!("CARTESIAN_POINT('',({x},{y},{z}))"))
    }

    fn direction(&mut self, along: DVec3) -> Result<Id> {
        let [x, y, z] = along.to_array().map(Real);
        self.add(&format_args!("DIRECTION('',({x},{y},{z}))"))
    }

    fn vertex(&mut self, at: DVec3) -> Result<Id> {
        let point = self.point(at)?;
        self.add(&format_args!("VERTEX_POINT('',{point})"))
    }

    /// A frame with these directions of its z and x.
    fn frame(&mut self, origin: DVec3, z: DVec3, x: DVec3) -> Result<Id> {
        let (origin, z, x) = (self.point(origin)?, self.direction(z)?, self.direction(x)?);
        self.add(&format_args!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"))
    }

    fn circle(&mut self, centre: DVec3, normal: DVec3, radius: f64) -> Result<Id> {
        // All circles lie across z or have their centres in y = 0.
        let frame = self.frame(centre, normal, DVec3::X)?;
        self.add(&format_args!("CIRCLE('',{frame},{})", Real(radius)))
    }

    fn line(&mut self, [from, to]: [DVec3; 2]) -> Result<Id> {
        let (from, along) = (self.point(from)?, self.direction((to - from).normalize())?);
        let along = self.add(&format_args!("VECTOR('',{along},1.0)"))?;
        self.add(&format_args!("LINE('',{from},{along})"))
    }

    fn edge(&mut self, [from, to]: [Id; 2], curve: Id) -> Result<Id> {
        self.add(&format_args!("EDGE_CURVE('',{from},{to},{curve},.T.)"))
    }

    fn plane(&mut self, at: DVec3, normal: DVec3, along: DVec3) -> Result<Id> {
        let frame = self.frame(at, normal, along)?;
        self.add(&format_args!("PLANE('',{frame})"))
    }

    /// A bound of a face: edges in order, each along its way or against it.
    fn bound(&mut self, edges: &[(Id, bool)], outer: bool) -> Result<Id> {
        let mut ways = Vec::with_capacity(edges.len());
        for (edge, along) in edges {
            let along = flag(*along);
            ways.push(self.add(&format_args!("ORIENTED_EDGE('',*,*,{edge},{along})"))?);
        }
        let ring = self.add(&format_args!("EDGE_LOOP('',({}))", List(&ways)))?;
        let kind = if outer { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
        self.add(&format_args!("{kind}('',{ring},.T.)"))
    }

    /// A face; `same` where its normal is that of the surface.
    fn face(&mut self, bounds: &[Id], surface: Id, same: bool) -> Result<Id> {
        let (bounds, same) = (List(bounds), flag(same));
        self.add(&format_args!("ADVANCED_FACE('',({bounds}),{surface},{same})"))
    }

    /// Flat faces by the numbers of their corners, counter-clockwise from outside.
    fn polygons<'a>(
        &mut self,
        corners: &[DVec3],
        polygons: impl Iterator<Item = &'a [u32]>,
    ) -> Result<Vec<Id>> {
        let vertices = corners.iter().map(|corner| self.vertex(*corner));
        let vertices: Vec<Id> = vertices.collect::<Result<_>>()?;
        let mut known: HashMap<[u32; 2], Id> = HashMap::new();
        let mut faces = Vec::new();
        for polygon in polygons {
            let mut ways = Vec::with_capacity(polygon.len());
            for (k, from) in polygon.iter().enumerate() {
                let to = polygon[(k + 1) % polygon.len()];
                let ends = [*from.min(&to), *from.max(&to)];
                let edge = if let Some(edge) = known.get(&ends) {
                    *edge
                } else {
                    let curve = self.line(ends.map(|end| corners[end as usize]))?;
                    let edge = self.edge(ends.map(|end| vertices[end as usize]), curve)?;
                    known.insert(ends, edge);
                    edge
                };
                ways.push((edge, *from < to));
            }
            let [a, b, c] = [0, 1, 2].map(|k| corners[polygon[k] as usize]);
            let normal = (b - a).cross(c - b).normalize();
            let plane = self.plane(a, normal, (b - a).normalize())?;
            let bound = self.bound(&ways, true)?;
            faces.push(self.face(&[bound], plane, true)?);
        }
        Ok(faces)
    }

    fn disc(&mut self, radius: f64) -> Result<Vec<Id>> {
        let ring = self.ring([radius, 0.0])?;
        let plane = self.plane(DVec3::ZERO, DVec3::Z, DVec3::X)?;
        let bound = self.bound(&ring.ways(true), true)?;
        Ok(vec![self.face(&[bound], plane, true)?])
    }

    /// The faces of a form.
    fn faces(&mut self, name: &str, form: &Form) -> Result<Vec<Id>> {
        match form {
            Form::Revolved(meridian) => self.revolution(meridian),
            Form::Box(corners) => {
                let faces = BOX_FACES.map(|face| face.map(|corner| corner as u32));
                self.polygons(corners, faces.iter().map(|face| &face[..]))
            }
            Form::Mesh(mesh) => {
                let count = mesh.triangles.len();
                ensure!(
                    count <= MAX_TRIANGLES,
                    "{name}: expected a mesh of at most {MAX_TRIANGLES} triangles for STEP, got {count}"
                );
                let corners: Vec<DVec3> =
                    mesh.vertices.iter().copied().map(DVec3::from_array).collect();
                self.polygons(&corners, mesh.triangles.iter().map(|triangle| &triangle[..]))
            }
            Form::Rectangle([x, y]) => {
                let corners = [[-x, -y], [*x, -y], [*x, *y], [-x, *y]];
                let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
                self.polygons(&corners, std::iter::once(&[0, 1, 2, 3][..]))
            }
            Form::Disc(radius) => self.disc(*radius),
        }
    }

    fn product(&mut self, name: &str, base: &Base) -> Result<Part> {
        let Base { product_context, definition_context, .. } = base;
        let name = Text(name);
        let product = self.add(&format_args!("PRODUCT({name},{name},'',({product_context}))"))?;
        self.add(&format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"))?;
        let version = self.add(&format_args!("PRODUCT_DEFINITION_FORMATION('','',{product})"))?;
        let definition = self
            .add(&format_args!("PRODUCT_DEFINITION('design','',{version},{definition_context})"))?;
        let shape = self.add(&format_args!("PRODUCT_DEFINITION_SHAPE('','',{definition})"))?;
        let origin = self.frame(DVec3::ZERO, DVec3::Z, DVec3::X)?;
        Ok(Part { definition, shape, origin })
    }

    /// The part of a body, and what represents it.
    fn part(&mut self, body: &Body, base: &Base) -> Result<(Part, Id)> {
        let name = Text(&body.name);
        let faces = self.faces(&body.name, &body.form)?;
        let faces = List(&faces);
        let (kind, item) = if body.is_sheet() {
            let shell = self.add(&format_args!("OPEN_SHELL('',({faces}))"))?;
            let model = self.add(&format_args!("SHELL_BASED_SURFACE_MODEL({name},({shell}))"))?;
            ("MANIFOLD_SURFACE_SHAPE_REPRESENTATION", model)
        } else {
            let shell = self.add(&format_args!("CLOSED_SHELL('',({faces}))"))?;
            let solid = self.add(&format_args!("MANIFOLD_SOLID_BREP({name},{shell})"))?;
            ("ADVANCED_BREP_SHAPE_REPRESENTATION", solid)
        };
        let part = self.product(&body.name, base)?;
        let (origin, context) = (part.origin, base.context);
        let shown = self.add(&format_args!("{kind}({name},({origin},{item}),{context})"))?;
        let shape = part.shape;
        self.add(&format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{shown})"))?;
        Ok((part, shown))
    }

    /// Contexts and units.
    fn base(&mut self) -> Result<Base> {
        let application = self
            .add(&"APPLICATION_CONTEXT('core data for automotive mechanical design processes')")?;
        self.add(&format_args!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{application})"
        ))?;
        let product_context =
            self.add(&format_args!("PRODUCT_CONTEXT('',{application},'mechanical')"))?;
        let definition_context = self.add(&format_args!(
            "PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')"
        ))?;
        let length = self.add(&"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")?;
        let angle = self.add(&"(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")?;
        let solid = self.add(&"(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")?;
        let accuracy = self.add(&format_args!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{length},'distance_accuracy_value','')",
            Real(ACCURACY_MM)
        ))?;
        let context = self.add(&format_args!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({accuracy}))GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
        ))?;
        Ok(Base { product_context, definition_context, context })
    }
}

/// Contexts that all parts share.
struct Base {
    product_context: Id,
    definition_context: Id,
    context: Id,
}

/// A product.
struct Part {
    definition: Id,
    shape: Id,
    origin: Id,
}

/// A part where it stands in the assembly.
struct Occurrence {
    name: String,
    part: usize,
    frame: Id,
}

/// Writes `bodies` as an assembly called `name`.
fn write(bodies: &[Body], name: &str, file: &mut dyn Sink) -> Result<()> {
    let (program, title) = (program(), Text(name));
    let program = Text(&program);
    write!(
        file,
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(({title}),'2;1');\n\
         FILE_NAME({title},'1970-01-01T00:00:00',(''),(''),{program},{program},'');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n"
    )?;
    let mut entities = Entities { file: &mut *file, last: 0 };
    let base = entities.base()?;
    let parts = bodies.iter().map(|body| entities.part(body, &base));
    let parts: Vec<(Part, Id)> = parts.collect::<Result<_>>()?;
    let whole = entities.product(name, &base)?;
    let mut copies = Vec::new();
    for (part, body) in bodies.iter().enumerate() {
        let DMat3 { x_axis, z_axis, .. } = body.rotation;
        for (k, place) in body.places.iter().enumerate() {
            let frame = entities.frame(*place, z_axis, x_axis)?;
            let name = match body.places.len() {
                1 => body.name.clone(),
                _ => format!("{} {}", body.name, k + 1),
            };
            copies.push(Occurrence { name, part, frame });
        }
    }
    let mut frames = vec![whole.origin];
    frames.extend(copies.iter().map(|copy| copy.frame));
    let (frames, context) = (List(&frames), base.context);
    let shown =
        entities.add(&format_args!("SHAPE_REPRESENTATION({title},({frames}),{context})"))?;
    let shape = whole.shape;
    entities.add(&format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{shown})"))?;
    for (number, Occurrence { name, part, frame }) in (1..).zip(&copies) {
        let (part, shown_part) = &parts[*part];
        let (assembly, of_part, origin) = (whole.definition, part.definition, part.origin);
        let name = Text(name);
        let copy = entities.add(&format_args!(
            "NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}',{name},'',{assembly},{of_part},$)"
        ))?;
        let placed = entities.add(&format_args!("PRODUCT_DEFINITION_SHAPE('','',{copy})"))?;
        let moved =
            entities.add(&format_args!("ITEM_DEFINED_TRANSFORMATION('','',{origin},{frame})"))?;
        let relation = entities.add(&format_args!(
            "(REPRESENTATION_RELATIONSHIP('','',{shown_part},{shown})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})SHAPE_REPRESENTATION_RELATIONSHIP())"
        ))?;
        entities
            .add(&format_args!("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{placed})"))?;
    }
    write!(file, "ENDSEC;\nEND-ISO-10303-21;\n")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use geometry::outline::{Ends, Row, outline};

    use super::*;

    fn body(name: &str, form: Form) -> Body {
        Body {
            name: name.to_owned(),
            form,
            rotation: DMat3::IDENTITY,
            places: vec![DVec3::ZERO, DVec3::X],
        }
    }

    fn turned(rows: &[&[f64]]) -> Form {
        let rows: Vec<Row> = rows.iter().map(|row| Row::of(row).expect("a row")).collect();
        Form::Revolved(outline(&rows, Ends::OnBottom).expect("a curve"))
    }

    fn written(bodies: &[Body]) -> String {
        let mut bytes = Vec::new();
        write(bodies, "a design", &mut std::io::Cursor::new(&mut bytes)).expect("written");
        String::from_utf8(bytes).expect("text")
    }

    /// Entities by their numbers: the name, and what is between its brackets.
    fn entities(text: &str) -> BTreeMap<usize, (&str, &str)> {
        let lines = text.lines().filter_map(|line| line.strip_prefix('#'));
        lines
            .filter_map(|line| {
                let (number, entity) = line.split_once('=')?;
                let (name, rest) = entity.split_once('(')?;
                Some((number.parse().ok()?, (name, rest.strip_suffix(");")?)))
            })
            .collect()
    }

    fn counts(text: &str) -> BTreeMap<&str, usize> {
        let mut counts = BTreeMap::new();
        for (name, _) in entities(text).values() {
            *counts.entry(*name).or_insert(0) += 1;
        }
        counts
    }

    fn numbers(text: &str) -> Vec<usize> {
        let words = text.split(|c: char| !(c.is_ascii_digit() || c == '#'));
        words.filter_map(|word| word.strip_prefix('#')?.parse().ok()).collect()
    }

    /// Every edge bounds two faces, which run along it in opposite senses.
    fn closed(text: &str) {
        let mut ways: BTreeMap<usize, Vec<bool>> = BTreeMap::new();
        for (name, inside) in entities(text).values() {
            if *name == "ORIENTED_EDGE" {
                ways.entry(numbers(inside)[0]).or_default().push(inside.ends_with(".T."));
            }
        }
        assert!(!ways.is_empty());
        for (edge, mut ways) in ways {
            ways.sort_unstable();
            assert_eq!(ways, [false, true], "edge {edge}");
        }
    }

    #[test]
    fn surfaces_and_faces_of_bodies_are_counted() {
        let quarter = -(std::f64::consts::FRAC_PI_8).tan();
        let bead: &[&[f64]] = &[&[0.0, 1.0], &[2.0, 1.0], &[2.0, 0.4, -1.0], &[2.1, 0.0]];
        let blunt: &[&[f64]] = &[&[0.0, 1.0], &[1.0, 0.5, -0.1], &[1.0, 0.0]];
        let cuboid = Form::cuboid(DVec3::ZERO, DVec3::ONE);
        for (form, faces, surfaces) in [
            (cuboid, 6, &[("PLANE", 6)][..]),
            (Form::ball(0.5), 2, &[("SPHERICAL_SURFACE", 1)]),
            (Form::cylinder(0.5, 2.0), 4, &[("CYLINDRICAL_SURFACE", 1), ("PLANE", 2)]),
            (turned(&[&[0.0, 1.0], &[1.0, 0.0, quarter]]), 3, &[("SPHERICAL_SURFACE", 1)]),
            (turned(&[&[0.0, 1.0], &[1.0, 0.0]]), 3, &[("CONICAL_SURFACE", 1), ("PLANE", 1)]),
            (turned(bead), 6, &[("TOROIDAL_SURFACE", 1), ("CONICAL_SURFACE", 1), ("PLANE", 2)]),
            (turned(blunt), 5, &[("SURFACE_OF_REVOLUTION", 1), ("CYLINDRICAL_SURFACE", 1)]),
        ] {
            let text = written(&[body("a", form)]);
            let counted = counts(&text);
            assert_eq!(counted["ADVANCED_FACE"], faces, "{text}");
            for (surface, expected) in surfaces {
                assert_eq!(counted.get(surface), Some(expected), "{surface}\n{text}");
            }
            closed(&text);
            // All have the topology of a ball; rings of planes cut faces once more.
            let rings = counted.get("FACE_BOUND").copied().unwrap_or_default();
            let ball = counted["VERTEX_POINT"] + faces - counted["EDGE_CURVE"] - rings;
            assert_eq!(ball, 2, "{text}");
        }
    }

    #[test]
    fn cones_get_wider_along_their_axis_and_spheres_face_outwards() {
        // A cone over one that narrows downwards.
        let text = written(&[body("a", turned(&[&[0.0, 1.0], &[1.0, 0.5], &[0.5, 0.0]]))]);
        let half = Real(std::f64::consts::FRAC_PI_4).to_string();
        let all = entities(&text);
        let steep: Vec<_> = all.values().filter(|(name, _)| *name == "CONICAL_SURFACE").collect();
        assert_eq!(steep.len(), 2);
        assert!(steep[0].1.ends_with(&format!(",1.0,{}", Real(2_f64.atan()))), "{steep:?}");
        assert!(steep[1].1.ends_with(&format!(",1.0,{half}")), "{steep:?}");
        let faces = all.values().filter(|(name, _)| *name == "ADVANCED_FACE");
        // Four halves of cones outwards; the bottom down.
        let outwards: Vec<bool> = faces.map(|(_, inside)| inside.ends_with(".T.")).collect();
        assert_eq!(outwards, [true, true, true, true, false]);
    }

    #[test]
    fn parts_are_written_once_and_stand_where_they_are_placed() {
        let sheet = Form::Rectangle([1.0, 2.0]);
        let bodies = [body("it's a dome", Form::ball(1.0)), body("B\u{e4}ffle", sheet)];
        let text = written(&bodies);
        let counted = counts(&text);
        assert_eq!(counted["MANIFOLD_SOLID_BREP"], 1);
        assert_eq!(counted["OPEN_SHELL"], 1);
        assert_eq!(counted["NEXT_ASSEMBLY_USAGE_OCCURRENCE"], 4);
        assert!(text.contains("PRODUCT('it''s a dome',"), "{text}");
        assert!(text.contains("'B\\X2\\00E4\\X0\\ffle 2'"), "{text}");
        // The same bytes again.
        assert_eq!(text, written(&bodies));
        let all = entities(&text);
        for (number, (_, inside)) in &all {
            assert!(numbers(inside).iter().all(|other| other < number), "#{number}");
        }
    }

    #[test]
    fn real_numbers_have_a_point() {
        for (value, text) in [
            (1.0, "1.0"),
            (-0.0, "0.0"),
            (1e-7, "1.E-7"),
            (-2.5e-9, "-2.5E-9"),
            (1e300, "1.E300"),
            (0.1 + 0.2, "0.30000000000000004"),
        ] {
            assert_eq!(Real(value).to_string(), text);
        }
    }
}
