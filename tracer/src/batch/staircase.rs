// SPDX-License-Identifier: MIT OR Apache-2.0
//! Intersection of a batch with a staircase: the comparisons of [`crate::shape::Stairs`], level by
//! level for all rays.
//!
//! Boundary j lies at the height of tread j, the last one at the foot; `square[j]` is the squared
//! radius of the solid just above it, `square[j + 1]` just below. A ray that rises passes the
//! boundaries downwards in j, one that falls upwards.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within a loop would keep it from being compiled to wide \
        instructions"
)]

use pulp::{Simd, WithSimd};

use super::lanes::{LANES, Lane, Lanes};
use crate::conversion::whole;
use crate::ray::{first_lanes, lanes as rays};
use crate::shape::{Axial, Revolution, Shell, Stairs, quadratic_root};

/// Most boundaries, and most cells of the search for the first one.
const BOUNDARIES: usize = 512;
const CELLS: usize = 4096;
/// Levels compared for all rays together; rays not decided by then go on one by one.
const UNROLL: usize = 2;
/// Least |d_z| of a ray that the tables serve.
const STEEP: f64 = 1e-9;

/// A staircase in tables.
pub(super) struct StaircaseTable<'a> {
    stairs: &'a Stairs,
    shell: Shell,
    height: Box<[f64; BOUNDARIES]>,
    square: Box<[f64; BOUNDARIES]>,
    /// Of each boundary its height with the square beyond it for a ray that falls, then for one
    /// that rises.
    rows: Box<[[f64; 2]; 2 * BOUNDARIES]>,
    /// Number of boundaries above each cell of the root of the depth.
    cells: Box<[u16; CELLS]>,
    per_root: f64,
    top: f64,
    foot: f64,
    last: i64,
}

/// State of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State(f64);

impl State {
    const OPEN: Self = Self(0.0);
    const RISER: Self = Self(1.0);
    const TREAD: Self = Self(2.0);
    const NOTHING: Self = Self(3.0);
    /// To begin again beyond the inner ball.
    const JUMP: Self = Self(4.0);
    /// To search one by one.
    const ALONE: Self = Self(5.0);
}

/// The searches of all rays.
pub(super) struct StaircaseSearches {
    state: [State; LANES],
    boundary: [i64; LANES],
    /// Distances where the search stands, where it ends, and where the ray is nearest to the axis.
    at: Lane,
    stop: Lane,
    turn: Lane,
    a: Lane,
    b: Lane,
    c: Lane,
    height: Lane,
    /// Squared radii of the solid before and beyond the boundary, in the direction of the ray.
    before: Lane,
    after: Lane,
    /// 1 for a ray that rises, else 0.
    up: [i64; LANES],
    /// Height of the tread or squared radius of the riser found.
    value: Lane,
}

impl StaircaseSearches {
    pub fn new() -> Self {
        let zero = [0.0; LANES];
        Self {
            state: [State::OPEN; LANES],
            boundary: [0; LANES],
            at: zero,
            stop: zero,
            turn: zero,
            a: zero,
            b: zero,
            c: zero,
            height: zero,
            before: zero,
            after: zero,
            up: [0; LANES],
            value: zero,
        }
    }
}

impl<'a> StaircaseTable<'a> {
    /// The tables of a relief, if it is a staircase and not too large or uneven for them.
    pub fn new(relief: &'a Revolution) -> Option<Self> {
        let stairs = relief.stairs()?;
        let levels = stairs.levels();
        let (count, foot) = (levels.len(), stairs.foot());
        if count + 2 > BOUNDARIES {
            return None;
        }
        let mut height = Box::new([foot; BOUNDARIES]);
        let mut square = Box::new([levels[count - 1].1; BOUNDARIES]);
        square[0] = -1.0;
        for (k, (h, q)) in levels.iter().enumerate() {
            (height[k], square[k + 1]) = (*h, *q);
        }
        let mut rows = Box::new([[0.0; 2]; 2 * BOUNDARIES]);
        for (k, pair) in rows.chunks_exact_mut(2).enumerate() {
            let under = square[(k + 1).min(BOUNDARIES - 1)];
            (pair[0], pair[1]) = ([height[k], under], [height[k], square[k]]);
        }
        let top = levels[0].0;
        let per_root = (CELLS - 1) as f64 / (top - foot).sqrt();
        let mut cells = Box::new([0_u16; CELLS]);
        for (k, (h, _)) in levels.iter().enumerate() {
            let cell = cell(top, per_root, *h);
            if k > 0 && self::cell(top, per_root, levels[k - 1].0) == cell {
                return None;
            }
            for later in &mut cells[cell + 1..] {
                *later = k as u16 + 1;
            }
        }
        Some(Self {
            stairs,
            shell: relief.shell(),
            height,
            square,
            rows,
            cells,
            per_root,
            top,
            foot,
            last: count as i64,
        })
    }

    /// Begins the search of a ray: everything that needs no table.
    #[inline(always)]
    fn begin(&self, lanes: &Lanes, searches: &mut StaircaseSearches, lane: usize) {
        let o = [0, 1, 2].map(|axis| lanes.origin[axis][lane]);
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let inside = lanes.inside[lane].is_set();
        let (a, b) = (d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]);
        let rising = d[2] > 0.0;
        let [enters, leaves] = [lanes.ends[0][lane], lanes.ends[1][lane]];

        // Inside, the search begins beyond the inner ball, or ends before it and begins anew;
        // outside, it is within the outer one.
        let idle = !rising & (a * enters + b <= 0.0);
        let near = inside & (enters > 0.0) & !idle;
        let start = if inside { leaves } else { enters };
        let start = if (start > 0.0) & !near { start } else { 0.0 };
        let missed = !inside & ((leaves < 0.0) | (rising & (b >= 0.0)));
        let hidden = start >= lanes.flat[lane];
        let z = o[2] + start * d[2];
        let low = !rising & (z <= self.foot);
        let alone = d[2].abs() < STEEP;
        let open = if missed | hidden | low { State::NOTHING } else { State::OPEN };
        searches.state[lane] = if alone { State::ALONE } else { open };
        searches.at[lane] = start;
        let stop = if inside { f64::INFINITY } else { leaves };
        searches.stop[lane] = if near { enters } else { stop };
        searches.turn[lane] = -b / a;
        searches.a[lane] = a;
        searches.b[lane] = b;
        searches.c[lane] = o[0] * o[0] + o[1] * o[1];
        searches.up[lane] = i64::from(rising);
        self.depth(searches, lane, z);
    }

    /// Notes the height at which a search begins, and its cell.
    #[inline(always)]
    fn depth(&self, searches: &mut StaircaseSearches, lane: usize, z: f64) {
        let depth = self.top - z;
        let root = depth.sqrt();
        let root = if depth > 0.0 { root } else { 0.0 } * self.per_root;
        let max = (CELLS - 1) as f64;
        searches.height[lane] = z;
        searches.boundary[lane] = whole(if root < max { root } else { max });
    }

    /// Begins a search anew beyond the inner ball.
    fn jump(&self, lanes: &Lanes, searches: &mut StaircaseSearches, lane: usize) {
        let start = lanes.ends[1][lane];
        let z = lanes.origin[2][lane] + start * lanes.direction[2][lane];
        let low = lanes.direction[2][lane] <= 0.0 && z <= self.foot;
        searches.state[lane] =
            if low || start >= lanes.flat[lane] { State::NOTHING } else { State::OPEN };
        (searches.at[lane], searches.stop[lane]) = (start, f64::INFINITY);
        self.depth(searches, lane, z);
        self.read(searches, lane);
        self.first(lanes, searches, lane);
        self.load(searches, lane);
    }

    /// Reads how many boundaries lie above the cell of a search, and the height of the next.
    #[inline(always)]
    fn read(&self, searches: &mut StaircaseSearches, lane: usize) {
        let above = self.cells[searches.boundary[lane] as usize & (CELLS - 1)];
        searches.boundary[lane] = i64::from(above);
        searches.value[lane] = self.height[usize::from(above) & (BOUNDARIES - 1)];
    }

    /// The first boundary that it passes.
    #[inline(always)]
    fn first(&self, lanes: &Lanes, searches: &mut StaircaseSearches, lane: usize) {
        let (z, above) = (searches.height[lane], searches.boundary[lane]);
        let next = searches.value[lane] >= z;
        let level = above + i64::from(next & (above < self.last));
        let rising = lanes.direction[2][lane] > 0.0;
        let inside = lanes.inside[lane].is_set();
        // Above the top there is nothing for light that rises.
        let over = rising & !inside & (level == 0);
        let before = searches.state[lane];
        searches.state[lane] = if over { State::NOTHING } else { before };
        let risen = level - i64::from(z >= self.foot);
        let (boundary, min) = if rising { (risen, 0) } else { (level, i64::from(inside)) };
        searches.boundary[lane] = if boundary < min { min } else { boundary };
    }

    /// Reads the first boundary.
    #[inline(always)]
    fn load(&self, searches: &mut StaircaseSearches, lane: usize) {
        let (boundary, up) = (searches.boundary[lane] as usize, searches.up[lane] as usize);
        searches.before[lane] = self.square[(boundary + up) & (BOUNDARIES - 1)];
        self.next(searches, lane);
    }

    /// Reads a boundary's height and what is beyond it.
    #[inline(always)]
    fn next(&self, searches: &mut StaircaseSearches, lane: usize) {
        let (boundary, up) = (searches.boundary[lane] as usize, searches.up[lane] as usize);
        let [height, after] = self.rows[(2 * boundary + up) & (2 * BOUNDARIES - 1)];
        searches.height[lane] = height;
        searches.after[lane] = after;
    }

    /// Compares a ray with a boundary.
    #[inline(always)]
    fn compare(&self, lanes: &Lanes, searches: &mut StaircaseSearches, lane: usize) {
        let (state, value, at) = (searches.state[lane], searches.value[lane], searches.at[lane]);
        let open = state == State::OPEN;
        let inside = lanes.inside[lane].is_set();
        let rising = lanes.direction[2][lane] > 0.0;
        let boundary = searches.boundary[lane];
        let (a, b, c) = (searches.a[lane], searches.b[lane], searches.c[lane]);
        let square = |t: f64| (a * t + 2.0 * b) * t + c;
        let height = searches.height[lane];
        let (before, after) = (searches.before[lane], searches.after[lane]);
        let t = (height - lanes.origin[2][lane]) * lanes.per_dz[lane];
        let here = square(t);

        let min = if before < after { before } else { after };
        let turn = searches.turn[lane];
        let dip = if turn < t { turn } else { t };
        let dip = if dip > at { dip } else { at };
        let dips = square(dip) < before;
        let riser = (inside & (here > before)) | (!inside & dips);
        let hit = (inside & (here > min)) | (!inside & (dips | (here < after)));
        let foot = boundary == self.last;
        let last = (rising & !inside & ((boundary == 0) | (t >= turn))) | (!rising & foot);
        let stops = t >= searches.stop[lane];
        let end = last | stops;
        let met = if riser { State::RISER } else { State::TREAD };
        let met = if foot & rising { State::NOTHING } else { met };
        let passed = if end { State::NOTHING } else { State::OPEN };
        let jumps = stops & inside & !last;
        let passed = if jumps { State::JUMP } else { passed };
        let next = if hit { met } else { passed };
        let met_at = if riser { before } else { height };
        searches.state[lane] = if open { next } else { state };
        searches.value[lane] = if open { met_at } else { value };
        searches.at[lane] = if open { t } else { at };
        let goes_on = open & !hit & !end;
        let way = if rising { -1 } else { 1 };
        let way = if goes_on { way } else { 0 };
        searches.boundary[lane] = boundary + way;
        searches.before[lane] = after;
    }

    /// The rest of the search of one ray.
    #[inline(always)]
    fn rest(&self, lanes: &Lanes, searches: &mut StaircaseSearches, lane: usize) {
        loop {
            while searches.state[lane] == State::OPEN {
                self.compare(lanes, searches, lane);
                self.next(searches, lane);
            }
            if searches.state[lane] != State::JUMP {
                return;
            }
            self.jump(lanes, searches, lane);
        }
    }

    /// Distance and primitive of the surface found.
    #[inline(always)]
    fn end(lanes: &mut Lanes, searches: &StaircaseSearches, lane: usize) {
        let (state, value) = (searches.state[lane], searches.value[lane]);
        let (a, b) = (searches.a[lane], searches.b[lane]);
        let rising = lanes.direction[2][lane] > 0.0;
        let tread = (value - lanes.origin[2][lane]) * lanes.per_dz[lane];
        let c = searches.c[lane] - value;
        let discriminant = b * b - a * c;
        let root = if discriminant > 0.0 { discriminant } else { 0.0 }.sqrt();
        let s = if lanes.inside[lane].is_set() { root } else { -root };
        let riser = quadratic_root([a, b, c], s);
        let distance = if state == State::RISER { riser } else { tread };
        let distance = if distance > 0.0 { distance } else { 0.0 };
        let found = (state == State::RISER) | (state == State::TREAD);
        let upright = state == State::RISER;
        lanes.dome[lane] = if found { distance } else { f64::INFINITY };
        let step = searches.boundary[lane] - i64::from(!rising & upright);
        lanes.dome_primitive[lane] = 2 * step + i64::from(upright);
        lanes.dome_line[0][lane] = if upright { 1.0 } else { 0.0 };
        lanes.dome_line[1][lane] = if upright { 0.0 } else { 1.0 };
        let root = (if value > 0.0 { value } else { 0.0 }).sqrt();
        lanes.dome_line[2][lane] = if upright { root } else { value };
    }

    /// Searches for a ray that the tables do not serve.
    fn alone(&self, lanes: &mut Lanes, lane: usize) {
        let ray = lanes.ray(lane);
        let axial = Axial::new(&ray);
        let passage = (self.shell).passage(ray.origin.to_array(), ray.direction.to_array());
        let found = if lanes.inside[lane].is_set() {
            self.stairs.leave_through(&passage, axial)
        } else {
            self.stairs.enter_through(&passage, axial)
        };
        let (distance, primitive) = found.unwrap_or((f64::INFINITY, 0));
        (lanes.dome[lane], lanes.dome_primitive[lane]) = (distance, i64::from(primitive));
        let step = primitive as usize / 2;
        let line = if primitive % 2 == 1 {
            [1.0, 0.0, self.square[step + 1].sqrt()]
        } else {
            [0.0, 1.0, self.height[step]]
        };
        for (all, number) in lanes.dome_line.iter_mut().zip(line) {
            all[lane] = number;
        }
    }
}

/// The cell of a height.
fn cell(top: f64, per_root: f64, z: f64) -> usize {
    let depth = top - z;
    let root = if depth > 0.0 { depth.sqrt() } else { 0.0 } * per_root;
    (root as usize).min(CELLS - 1)
}

/// Intersects all rays with a staircase.
pub(super) struct StaircaseSearch<'a> {
    pub table: &'a StaircaseTable<'a>,
    pub lanes: &'a mut Lanes,
    pub searches: &'a mut StaircaseSearches,
    /// Rays in flight.
    pub active: usize,
}

impl WithSimd for StaircaseSearch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        search(self.table, self.lanes, self.searches, self.active);
    }
}

#[inline(always)]
fn search(
    table: &StaircaseTable<'_>,
    lanes: &mut Lanes,
    searches: &mut StaircaseSearches,
    active: usize,
) {
    for lane in 0..LANES {
        table.begin(lanes, searches, lane);
    }
    for lane in 0..LANES {
        table.read(searches, lane);
    }
    for lane in 0..LANES {
        table.first(lanes, searches, lane);
    }
    for lane in 0..LANES {
        table.load(searches, lane);
    }
    for level in 0..UNROLL {
        if level > 0 {
            for lane in 0..LANES {
                table.next(searches, lane);
            }
        }
        for lane in 0..LANES {
            table.compare(lanes, searches, lane);
        }
    }
    let mut open = 0;
    let (mut begun_anew, mut alone) = (0, 0);
    for lane in 0..LANES {
        let state = searches.state[lane];
        open |= u64::from(state == State::OPEN) << lane;
        begun_anew |= u64::from(state == State::JUMP) << lane;
        alone |= u64::from(state == State::ALONE) << lane;
    }
    let active = first_lanes(active);
    // What is open stands before a boundary not read yet.
    for lane in rays(open & active) {
        table.next(searches, lane);
        table.rest(lanes, searches, lane);
    }
    for lane in rays(begun_anew & active) {
        table.jump(lanes, searches, lane);
        table.rest(lanes, searches, lane);
    }
    for lane in 0..LANES {
        StaircaseTable::end(lanes, searches, lane);
    }
    for lane in rays(alone & active) {
        table.alone(lanes, lane);
    }
}
