// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cross-section of a package with paths of light.
//!
//! In: the package as lines, and paths. Out: a picture with axes, x to the right and z upwards, a
//! scale bar, every object with its name beside the axes, one colour for each fate, and the shares
//! of the fates in the legend. What lies beside the plane is projected onto it and dashed: there
//! paths turn at surfaces that the section does not show.

use metrics::Estimate;
use metrics::digits::shortest;
use metrics::quantity::{Quantity, Unit};
use results::package::{PackageDrawing, SolidDrawing};
use results::ray_paths::{PathEnd, TracedPath, Vertex};
use results::shown;

use super::plots::Heading;
use super::plots::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Point, Rect};
use super::plots::draw::colour::Colour;
use super::plots::draw::palette::{BODY, LED, LED_EDGE, MEDIUM, MIRROR, RECEIVER, SILICONE, fate};
use super::plots::draw::panel::{Panel, PanelAxis, TICK_SIZE};
use super::plots::draw::scale::{ends, round_step};
use super::plots::draw::sheet::{Entry, Sample, Sheet};

/// Room for the numbers and the name of the z axis, pixels.
const NUMBERS: f64 = 75.0;
/// Letters of the picture for the page, beside those of a sheet.
const COMPACT: Layout = Layout { width: 820, left: 80.0, names: 190.0, has_shares: false };
/// The picture as a file of its own.
const SHEET: Layout = Layout { width: 1400, left: 40.0 + NUMBERS, names: 250.0, has_shares: true };
/// Least distance of names, pixels.
const APART: f64 = 27.0;
/// Tallest picture, in widths of its axes.
const TALLEST: f64 = 1.1;

/// Sizes of a picture, pixels.
#[derive(Clone, Copy)]
struct Layout {
    /// Width.
    width: u32,
    /// Left of the axes.
    left: f64,
    /// Right of the axes, for names.
    names: f64,
    /// True where the legend states shares of the paths.
    has_shares: bool,
}

/// An object and where its name points to.
struct Named {
    words: String,
    at: Point,
    colour: Colour,
}

/// The section that is drawn.
struct Section<'a> {
    drawing: &'a PackageDrawing,
    panel: Panel,
    names: Vec<Named>,
    /// Room for a name, pixels.
    room: f64,
}

/// The picture as a file of its own.
pub fn path_picture(drawing: &PackageDrawing, heading: &Heading, paths: &[TracedPath]) -> Picture {
    picture(drawing, heading, paths, (SHEET, view(drawing)))
}

/// The picture for a part of a page: larger letters, no shares; all `drawings` on one scale.
pub fn compact_picture(
    drawing: &PackageDrawing,
    heading: &Heading,
    paths: &[TracedPath],
    drawings: &[&PackageDrawing],
) -> Picture {
    let views = drawings.iter().map(|drawing| view(drawing));
    let common = views.fold(view(drawing), |[half, low, high], [other, lower, higher]| {
        [half.max(other), low.min(lower), high.max(higher)]
    });
    // The pitch stands below the ground in letters of the same size.
    let [half, low, high] = common;
    picture(drawing, heading, paths, (COMPACT, [half, 2.0 * low, high]))
}

fn picture(
    drawing: &PackageDrawing,
    heading: &Heading,
    paths: &[TracedPath],
    (layout, [half, low, high]): (Layout, [f64; 3]),
) -> Picture {
    let width = f64::from(layout.width) - layout.left - layout.names - 40.0;
    let legend = legend(paths, layout.has_shares);
    // The strip of the legend depends on its rows.
    let strip = Sheet::new(layout.width, 400, heading, &legend).body.top;
    let tall = width * (high - low) / (2.0 * half);
    let mut sheet = Sheet::new(layout.width, (strip + tall + 90.0) as u32, heading, &legend);
    let area = Rect::new(layout.left, strip + 4.0, layout.left + width, strip + 4.0 + tall);
    let axis = |name: &str, ends, count| {
        PanelAxis::linear(&Quantity::new(name, Unit::Millimetre), ends, count)
    };
    let rows = (8.0 * tall / width).ceil().max(2.0) as usize;
    let panel = Panel { area, x: axis("x", [-half, half], 8), y: axis("z", [low, high], rows) };
    let room = layout.names - 30.0;
    let mut section = Section { drawing, panel, names: Vec::new(), room };
    let canvas = &mut sheet.canvas;
    section.panel.grid(canvas);
    canvas.clipped(area, |canvas| {
        section.objects(canvas);
        section.paths(canvas, paths);
        section.dimensions(canvas);
    });
    section.panel.frame(canvas);
    section.write_names(canvas);
    sheet.canvas.finish()
}

/// Dashes of what lies beside the plane.
const BESIDE: [f32; 2] = [3.0, 4.0];
/// Largest distance from the plane of what counts as in it, mm.
const PLANE_MM: f64 = 1e-3;

/// Number of the vertex from which on a path lies beside the plane, where it leaves it.
fn leaving(path: &TracedPath) -> Option<usize> {
    let beside = |v: &Vertex| v.point_mm[1].abs() >= PLANE_MM;
    let last = path.vertices.len().checked_sub(1)?;
    match path.vertices.iter().position(beside) {
        Some(first) => Some(first.saturating_sub(1)),
        None => path.leaves_along.filter(|along| along[1].abs() > 1e-9).map(|_| last),
    }
}

/// Half the width, the lowest and the highest z in view, mm: one package with all that is about it,
/// or a package with the halves of its neighbours. What lies above is in view as far as the package
/// can still be seen.
fn view(drawing: &PackageDrawing) -> [f64; 3] {
    let [radius, top] = drawing.reach_mm(|solid| solid.each);
    let nearest = drawing.neighbours(f64::INFINITY).map(|[x, y]| x.hypot(y)).reduce(f64::min);
    let half = match (drawing.pitch_mm, nearest) {
        (Some(pitch), _) => {
            let cell = 0.56 * pitch;
            // Small packages far apart are seen with what lies above them.
            cell.clamp(1.4 * radius, (3.2 * radius).max(cell.min(0.6 * drawing.plane_mm)))
        }
        (None, nearest) => {
            let [whole, _] = drawing.reach_mm(|_| true);
            (1.06 * whole).min(nearest.map_or(f64::INFINITY, |at| 0.56 * at)).max(1.4 * radius)
        }
    };
    let solids = drawing.solids.iter().flat_map(|solid| &solid.lines_mm);
    let seen = solids.flat_map(|(line, _)| line).filter(|[x, _]| x.abs() <= half);
    let highest = seen.map(|[_, z]| 1.08 * z).fold(1.5 * top, f64::max);
    let plane = 1.08 * drawing.plane_mm;
    // Half the width of a picture of this height.
    let half_for = |high: f64| 0.5 * high / TALLEST;
    let widest = if nearest.is_some() { 1.5 * half } else { 4.0 * half };
    let half = half.max(half_for(highest).min(4.0 * half));
    let half = if half_for(plane) < widest { half.max(half_for(plane)) } else { half };
    let high = highest.max(plane).min(2.0 * half * TALLEST);
    [half, -0.11 * high.min(half), high]
}

/// Fates, with their shares of the paths where asked for.
fn legend(paths: &[TracedPath], has_shares: bool) -> Vec<Entry> {
    let whole = paths.len() as f64;
    let entry = |end: PathEnd| {
        let count = paths.iter().filter(|path| path.fate == end).count();
        let share = count as f64 / whole;
        let error = (share * (1.0 - share) / whole).sqrt();
        let words = shown::estimate(Estimate::new(share, error), Unit::Fraction);
        let sample = Sample::Line(Pen::solid(fate(end), 4.0));
        let shares = if has_shares { format!(", {words}") } else { String::new() };
        (count > 0).then(|| Entry::new(sample, format!("{}{shares}", end.words())))
    };
    let mut all: Vec<Entry> = PathEnd::ALL.into_iter().filter_map(entry).collect();
    if paths.iter().any(|path| leaving(path).is_some()) {
        let pen = Pen::dashed(Colour::MUTED, 1.4, &BESIDE);
        all.push(Entry::new(Sample::Line(pen), "beside the plane, projected"));
    }
    all
}

impl Section<'_> {
    fn at(&self, [x, z]: [f64; 2]) -> Point {
        self.panel.at(x, z)
    }

    fn all(&self, points: &[[f64; 2]]) -> Vec<Point> {
        points.iter().map(|p| self.at(*p)).collect()
    }

    fn name(&mut self, words: String, at: [f64; 2], colour: Colour) {
        let at = self.at(at);
        let Rect { left, top, right, bottom } = self.panel.area;
        if (left - 1.0..=right + 1.0).contains(&at[0])
            && (top - 1.0..=bottom + 1.0).contains(&at[1])
        {
            self.names.push(Named { words, at, colour });
        }
    }

    /// Everything that light may meet, the largest first, so that none hides what it holds.
    fn objects(&mut self, canvas: &mut Canvas) {
        let drawing = self.drawing;
        let mut solids: Vec<&SolidDrawing> = drawing.solids.iter().collect();
        solids.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
        let half = self.panel.x.scale.ends[1];
        // The package, and those beside it that the plane cuts as it does this one.
        let beside = drawing.neighbours(half + drawing.largest_radius_mm());
        let [own_turn, _] = drawing.turn_and_scale([0.0; 2]);
        let places: Vec<SectionPlace> = beside
            .filter(|[_, y]| y.abs() < 1e-6 * drawing.radius_mm)
            .filter_map(|at| {
                let [turn, scale] = drawing.turn_and_scale(at);
                ((turn - own_turn).abs() < 1e-9).then_some(SectionPlace { x_mm: at[0], scale })
            })
            .chain([SectionPlace::OWN])
            .collect();
        let lines = drawing.dome_mm.iter();
        let dome: Vec<Vec<Point>> =
            lines.flat_map(|line| places.iter().map(|at| self.all(&at.of(line)))).collect();
        let (around, inside): (Vec<_>, Vec<_>) =
            solids.into_iter().partition(|solid| extent(solid) > 2.0 * drawing.radius_mm);
        for solid in around {
            self.solid(canvas, solid, &places);
        }
        canvas.shape(&dome, true, Some(SILICONE[0]), &Pen::solid(SILICONE[1], 1.3));
        for solid in inside {
            self.solid(canvas, solid, &places);
        }
        let edge = drawing.dome_mm.iter().flatten().copied();
        // A place on the right of the outline, below the top.
        let slope = |[x, z]: &[f64; 2]| x + 0.4 * z;
        if let Some(at) = edge.max_by(|a, b| slope(a).total_cmp(&slope(b))) {
            self.name(with_index("dome", drawing.dome_index), at, SILICONE[1]);
        }
        self.ground(canvas);
        // The front of the box, seen along y; of a box level about the axis also its section.
        let corners = drawing.led_corners().map(|[x, _, z]| [x, z]);
        let front = [corners[0], corners[4], corners[5], corners[1]];
        let led: Vec<Vec<Point>> = places.iter().map(|at| self.all(&at.of(&front))).collect();
        canvas.shape(&led, true, Some(LED), &Pen::solid(LED_EDGE, 1.2));
        let right = [0, 1].map(|k| 0.5 * (corners[1][k] + corners[5][k]));
        self.name("LED".to_owned(), right, LED_EDGE);
        let plane = drawing.plane_mm;
        let pen = Pen::dashed(RECEIVER, 1.6, &[9.0, 5.0]);
        canvas.line(self.at([-half, plane]), self.at([half, plane]), &pen);
        let [_, high] = self.panel.y.scale.ends;
        let where_to = if plane > high { ", above the picture" } else { "" };
        self.name(format!("receiver, z = {plane} mm{where_to}"), [half, plane.min(high)], RECEIVER);
    }

    /// A solid, at all `places` of packages where each carries it.
    fn solid(&mut self, canvas: &mut Canvas, solid: &SolidDrawing, places: &[SectionPlace]) {
        let [fill, edge] = if solid.entered { MEDIUM } else { BODY };
        let places = if solid.each { places } else { &[SectionPlace::OWN] };
        let at_places = |line: &Vec<[f64; 2]>| -> Vec<Vec<Point>> {
            places.iter().map(|at| self.all(&at.of(line))).collect()
        };
        let closed: Vec<Vec<Point>> = joined(&solid.lines_mm).iter().flat_map(at_places).collect();
        canvas.with_tooltip(&solid.name, |canvas| {
            if !closed.is_empty() {
                canvas.shape(&closed, true, Some(fill.with_opacity(0.75)), &Pen::solid(edge, 1.3));
            }
            for (line, _) in solid.lines_mm.iter().filter(|_| closed.is_empty()) {
                for line in at_places(line) {
                    canvas.polyline(&line, &Pen::solid(edge, 2.4));
                }
            }
        });
        let half = self.panel.x.scale.ends[1];
        let points = || solid.lines_mm.iter().flat_map(|(line, _)| line);
        let [left, right] = ends(points().map(|[x, _]| *x));
        // Out of sight.
        if left > half || right < -half {
            return;
        }
        let points = points();
        let held = points.map(|[x, z]| [x.clamp(-half, half), *z]);
        let rightmost = held.max_by(|a, b| (a[0] + 0.01 * a[1]).total_cmp(&(b[0] + 0.01 * b[1])));
        if let Some(at) = rightmost {
            self.name(with_index(&solid.name, solid.index), at, edge);
        }
    }

    /// The mirror, and the floor beyond it.
    fn ground(&mut self, canvas: &mut Canvas) {
        let half = self.panel.x.scale.ends[1];
        let mirror = self.drawing.mirror_half_mm.min(half);
        let below = |x: f64| {
            let [x, y] = self.at([x, 0.0]);
            [x, y + 2.5]
        };
        canvas.line(below(-half), below(half), &Pen::solid(Colour::MUTED, 2.0));
        canvas.line(below(-mirror), below(mirror), &Pen::solid(MIRROR, 5.0));
        self.name("mirror".to_owned(), [mirror, 0.0], MIRROR);
    }

    /// Draws paths of the commonest fate first, so that the rest is not covered.
    fn paths(&self, canvas: &mut Canvas, paths: &[TracedPath]) {
        for end in PathEnd::ALL {
            let pen = Pen::solid(fate(end).with_opacity(0.75), 1.0);
            for path in paths.iter().filter(|path| path.fate == end) {
                let vertices = path.vertices.iter();
                let flat = |[x, _, z]: [f64; 3]| [x, z];
                let mut points: Vec<[f64; 2]> =
                    vertices.map(|vertex| flat(vertex.point_mm)).collect();
                let Some(last) = points.last().copied() else {
                    continue;
                };
                if let Some(along) = path.leaves_along {
                    points.push(self.exit(last, flat(along)));
                }
                let beside = leaving(path).unwrap_or(points.len());
                if beside > 0 {
                    let in_plane = &points[..points.len().min(beside + 1)];
                    canvas.polyline(&self.all(in_plane), &pen);
                }
                if let Some(rest) = points.get(beside..).filter(|rest| rest.len() > 1) {
                    let pen = Pen { dash: &BESIDE, ..pen };
                    canvas.polyline(&self.all(rest), &pen);
                }
                if path.leaves_along.is_none() {
                    canvas.disk(self.at(last), 3.0, fate(end));
                }
            }
        }
    }

    /// Point at which a ray from inside leaves the axes; its start if it lies outside.
    fn exit(&self, from: [f64; 2], along: [f64; 2]) -> [f64; 2] {
        let ends = [self.panel.x.scale.ends, self.panel.y.scale.ends];
        let until = |k: usize| match along[k] {
            d if d > 0.0 => (ends[k][1] - from[k]) / d,
            d if d < 0.0 => (ends[k][0] - from[k]) / d,
            _ => f64::INFINITY,
        };
        let length = until(0).min(until(1)).clamp(0.0, 1e3);
        [0, 1].map(|k| from[k] + length * along[k])
    }

    /// A scale bar in the upper left corner, and the pitch below the ground.
    fn dimensions(&self, canvas: &mut Canvas) {
        let Rect { left, right, top, bottom } = self.panel.area;
        let middle = self.at([0.0, 0.0]);
        let step = round_step(0.12 * self.panel.x.scale.ends[1]);
        let [from, to] = [0.0, self.at([step, 0.0])[0] - middle[0]].map(|x| x + left + 20.0);
        let plane = self.at([0.0, self.drawing.plane_mm])[1];
        let y = top + 24.0;
        // Beside the line of the receiver.
        let y = if (plane - y).abs() < 20.0 { plane + 24.0 } else { y };
        let bar = [
            [[from, y], [to, y]],
            [[from, y - 6.0], [from, y + 6.0]],
            [[to, y - 6.0], [to, y + 6.0]],
        ];
        let letters = Letters::new(TICK_SIZE, Align::Left);
        let words = format!("{} mm", shortest(step));
        let ground = Rect::new(from - 8.0, y - 13.0, to + 18.0 + letters.width(&words), y + 13.0);
        canvas.rectangle(ground, Colour::WHITE.with_opacity(0.85));
        canvas.lines(&bar, &Pen::solid(Colour::TEXT, 2.4));
        canvas.text(&words, [to + 10.0, y], &letters);
        let Some(pitch) = self.drawing.pitch_mm else {
            return;
        };
        let y = f64::midpoint(middle[1], bottom) + 2.0;
        let text = format!("pitch {pitch} mm");
        let letters = Letters::new(TICK_SIZE, Align::Centre);
        let room = letters.width(&text) / 2.0 + 10.0;
        for side in [-1.0, 1.0] {
            let edge = self.at([side * 0.5 * pitch, 0.0])[0];
            let end = edge.clamp(left, right);
            let pen = Pen::solid(Colour::TEXT, 1.4);
            canvas.line([middle[0] + side * room, y], [end, y], &pen);
            if (end - edge).abs() < 0.5 {
                let base = end - side * 10.0;
                canvas.polygon(&[[end, y], [base, y - 4.0], [base, y + 4.0]], Colour::TEXT);
                let cell = Pen::dashed(Colour::MUTED, 1.0, &[3.0, 5.0]);
                canvas.line([edge, top], [edge, bottom], &cell);
            }
        }
        canvas.text(&text, [middle[0], y], &letters);
    }

    /// Names right of the axes, in the order of their heights, with lines to what they name.
    fn write_names(&mut self, canvas: &mut Canvas) {
        self.names.sort_by(|a, b| a.at[1].total_cmp(&b.at[1]).then(b.at[0].total_cmp(&a.at[0])));
        let Rect { top, right, bottom, .. } = self.panel.area;
        let mut rows: Vec<f64> = self.names.iter().map(|named| named.at[1]).collect();
        let mut next = top + 10.0;
        for y in &mut rows {
            *y = y.max(next);
            next = *y + APART;
        }
        let mut least = bottom - 4.0;
        for y in rows.iter_mut().rev() {
            *y = y.min(least);
            least = *y - APART;
        }
        for (named, y) in self.names.iter().zip(rows) {
            let x = right + 26.0;
            let pen = Pen::solid(named.colour, 1.0);
            canvas.polyline(&[named.at, [right + 8.0, y], [x - 4.0, y]], &pen);
            canvas.disk(named.at, 2.4, named.colour);
            let mut letters = Letters::new(TICK_SIZE, Align::Left);
            letters.size *= (self.room / letters.width(&named.words)).min(1.0);
            canvas.text(&named.words, [x, y], &letters);
        }
    }
}

/// A package that the plane of the section cuts as it does the one in the middle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SectionPlace {
    /// Its axis, mm.
    x_mm: f64,
    /// Its size over that of the one in the middle.
    scale: f64,
}

impl SectionPlace {
    const OWN: Self = Self { x_mm: 0.0, scale: 1.0 };

    /// Points of the package in the middle in this one.
    fn of(self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let Self { x_mm, scale } = self;
        points.iter().map(|[x, z]| [scale * x + x_mm, scale * z]).collect()
    }
}

/// A name with the refractive index, where there is one.
fn with_index(name: &str, index: Option<f64>) -> String {
    index.map_or_else(|| name.to_owned(), |n| format!("{name}, n = {}", shortest(n)))
}

/// Extent of a solid across, mm.
fn extent(solid: &SolidDrawing) -> f64 {
    let [low, high] = solid.bounds_mm;
    let squares = (0..3).map(|k| (high[k] - low[k]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Lines that close, and stretches put together where their ends meet.
fn joined(lines: &[(Vec<[f64; 2]>, bool)]) -> Vec<Vec<[f64; 2]>> {
    const NEAR_MM: f64 = 1e-3;
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < NEAR_MM;
    let mut whole: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut stretches: Vec<&Vec<[f64; 2]>> = Vec::new();
    for (line, closed) in lines {
        if *closed {
            whole.push(line.clone());
        } else {
            stretches.push(line);
        }
    }
    while let Some(first) = stretches.pop() {
        let mut chain = first.clone();
        while let Some(end) = chain.last().copied() {
            let found = stretches.iter().position(|s| near(s[0], end) || near(s[s.len() - 1], end));
            let Some(found) = found else {
                break;
            };
            let next = stretches.swap_remove(found);
            if near(next[0], end) {
                chain.extend(&next[1..]);
            } else {
                chain.extend(next.iter().rev().skip(1));
            }
        }
        if chain.len() > 2 && near(chain[0], chain[chain.len() - 1]) {
            whole.push(chain);
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chip under a lens of the array, a plate and walls 6.5 mm apart, with these axes.
    fn cell(axes_mm: Vec<[f64; 2]>, plane_mm: f64) -> PackageDrawing {
        let flat = |name: &str, half: f64, [low, high]: [f64; 2]| SolidDrawing {
            name: name.to_owned(),
            index: None,
            entered: true,
            each: false,
            bounds_mm: [[-half, -half, low], [half, half, high]],
            lines_mm: vec![(vec![[-half, low], [half, low], [half, high], [-half, high]], true)],
        };
        PackageDrawing {
            dome_mm: Vec::new(),
            dome_index: None,
            rings: Vec::new(),
            radius_mm: 0.25,
            led_mm: [0.5, 0.25, 0.12],
            led_corners_mm: Vec::new(),
            led_offsets_mm: Vec::new(),
            turns_deg: Vec::new(),
            scales: Vec::new(),
            mirror_half_mm: 3.25,
            plane_mm,
            pitch_mm: None,
            axes_mm,
            at_mm: [0.0; 2],
            solids: vec![
                flat("lens", 2.1, [0.0, 2.0]),
                flat("plate", 3.25, [4.0, 5.0]),
                flat("wall", 3.3, [0.0, 6.85]),
            ],
        }
    }

    #[test]
    fn a_single_package_is_seen_with_all_that_is_about_it() {
        for axes in [vec![[0.0; 2]], vec![[0.0, -7.0], [0.0; 2], [0.0, 7.0]]] {
            let [half, low, high] = view(&cell(axes, 6.9));
            assert!(half >= 3.3 && low < 0.0 && high >= 6.9, "{half} {low} {high}");
        }
        // A distant plane leaves the package large.
        let [half, _, high] = view(&cell(vec![[0.0; 2]], 200.0));
        assert!((3.3..5.0).contains(&half) && (6.85..20.0).contains(&high), "{half} {high}");
    }

    /// A package of another size stands beside that in the middle, at its own place, and is seen from as
    /// far as it reaches.
    #[test]
    fn neighbours_have_their_own_size() {
        let at = SectionPlace { x_mm: 5.0, scale: 2.0 };
        assert_eq!(at.of(&[[-0.25, 0.1], [0.5, 0.0]]), [[4.5, 0.2], [6.0, 0.0]]);
        assert_eq!(SectionPlace::OWN.of(&[[-0.25, 0.1]]), [[-0.25, 0.1]]);
        for (scales, expected_mm) in [(vec![], 0.25), (vec![1.0, 4.0], 1.0), (vec![1.0, 0.5], 0.25)]
        {
            let drawing = PackageDrawing { scales, ..cell(vec![[0.0; 2], [1.0, 0.0]], 6.9) };
            assert!((drawing.largest_radius_mm() - expected_mm).abs() < 1e-12);
        }
    }

    #[test]
    fn stretches_of_a_cut_become_one_outline() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let side = |k: usize| (vec![square[k], square[(k + 1) % 4]], false);
        let reversed = |(mut line, closed): (Vec<[f64; 2]>, bool)| {
            line.reverse();
            (line, closed)
        };
        let cut = [side(0), reversed(side(2)), side(1), side(3)];
        let whole = joined(&cut);
        assert_eq!((whole.len(), whole[0].len()), (1, 5));
        // A sheet is no outline.
        assert!(joined(&cut[..1]).is_empty());
        assert_eq!(joined(&[(square.to_vec(), true)]), [square.to_vec()]);
    }
}
