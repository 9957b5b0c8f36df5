// SPDX-License-Identifier: MIT OR Apache-2.0
//! Primaries of displays, the colours that they reach, and how much of standard ones.
//!
//! Area is that of the triangle of the primaries over that of the standard; coverage is the part of
//! the standard's triangle that lies within it (IDMS 1.2, 5.18), both in x, y (CIE 1931) and in
//! u', v' (CIE 1976).

use super::chromaticity::{uv, xy, xyz_of_xy};

/// A point of a plane of chromaticities.
type Point = [f64; 2];
/// Rows of a matrix.
pub type Matrix = [[f64; 3]; 3];

/// x and y of D65, the white of all standards here.
pub const D65: Point = [0.3127, 0.3290];

/// Three primaries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Primaries {
    /// Name for people.
    pub name: &'static str,
    /// x and y of red, green and blue.
    pub xy: [Point; 3],
}

/// ITU-R BT.2020, table 3; BT.2100 has the same.
pub const BT2020: Primaries =
    Primaries { name: "BT.2020", xy: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]] };
/// SMPTE RP 431-2; with the white D65 the display P3.
pub const DCI_P3: Primaries =
    Primaries { name: "DCI-P3", xy: [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]] };
/// ITU-R BT.709, and sRGB.
pub const BT709: Primaries =
    Primaries { name: "BT.709", xy: [[0.640, 0.330], [0.300, 0.600], [0.150, 0.060]] };
/// Standards that figures compare with.
pub const STANDARDS: [Primaries; 3] = [BT2020, DCI_P3, BT709];

impl Primaries {
    /// Linear red, green and blue to X, Y and Z: (1, 1, 1) is `white` with Y = 1. Columns are the
    /// primaries (SMPTE RP 177).
    pub fn to_xyz(&self, white: Point) -> Matrix {
        let columns = self.xy.map(xyz_of_xy);
        let plain: Matrix = [0, 1, 2].map(|k| columns.map(|column| column[k]));
        let scale = inverse(&plain).map_or([f64::NAN; 3], |m| apply(&m, xyz_of_xy(white)));
        plain.map(|row| [0, 1, 2].map(|k| row[k] * scale[k]))
    }

    /// True if `white` lies within the primaries: beyond them one would have to be negative.
    pub fn hold(&self, white: Point) -> bool {
        self.to_xyz(white)[1].iter().all(|luminance| *luminance > 0.0)
    }
}

/// `m` times `v`.
pub fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The inverse by cofactors; `None` of columns that lie in one plane to rounding.
pub fn inverse(m: &Matrix) -> Option<Matrix> {
    let cofactor = |i: usize, j: usize| {
        let [a, b] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(j + 1) % 3, (j + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    let length = |j: usize| m.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
    let volume = length(0) * length(1) * length(2);
    let is_flat = determinant.is_nan() || determinant.abs() <= 1e-12 * volume;
    (!is_flat).then(|| [0, 1, 2].map(|i| [0, 1, 2].map(|j| cofactor(j, i) / determinant)))
}

/// Area and coverage in a plane, each over the area of a standard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Area of the triangle; may exceed 1.
    pub area: f64,
    /// Part of the standard's triangle that is reached, 0 to 1.
    pub coverage: f64,
}

/// What primaries of these x and y reach of `standard`: in x, y and in u', v'.
pub fn shares(primaries: [Point; 3], standard: &Primaries) -> [Shares; 2] {
    let of = |triangle: [Point; 3], wanted: [Point; 3]| {
        let (triangle, wanted) = (anticlockwise(triangle), anticlockwise(wanted));
        let whole = area(&wanted);
        let common = triangle_within(triangle, &wanted);
        Shares { area: area(&triangle) / whole, coverage: (area(&common) / whole).min(1.0) }
    };
    let in_uv = |xy: [Point; 3]| xy.map(|p| uv(xyz_of_xy(p)).unwrap_or([f64::NAN; 2]));
    [of(primaries, standard.xy), of(in_uv(primaries), in_uv(standard.xy))]
}

/// Coverages of [`STANDARDS`] one after the other, each in x, y and in u', v', by primaries of these X, Y
/// and Z; NaN where one is dark.
pub fn coverages(primaries: [[f64; 3]; 3]) -> [f64; 2 * STANDARDS.len()] {
    let xy = primaries.map(|xyz| xy(xyz).unwrap_or([f64::NAN; 2]));
    if xy.as_flattened().iter().any(|v| v.is_nan()) {
        return [f64::NAN; 2 * STANDARDS.len()];
    }
    let all = STANDARDS.map(|standard| shares(xy, &standard).map(|of| of.coverage));
    std::array::from_fn(|k| all[k / 2][k % 2])
}

/// Twice the area of a triangle, positive anticlockwise.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn anticlockwise([a, b, c]: [Point; 3]) -> [Point; 3] {
    if turn(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Area of a polygon with its corners in order, positive anticlockwise.
fn area(corners: &[Point]) -> f64 {
    let Some(first) = corners.first() else { return 0.0 };
    corners.windows(2).map(|pair| 0.5 * turn(*first, pair[0], pair[1])).sum()
}

/// The part of the convex polygon `wanted` within `triangle`, both anticlockwise (I. E. Sutherland,
/// G. W. Hodgman, Commun. ACM 17 (1974) 32).
fn triangle_within(triangle: [Point; 3], wanted: &[Point]) -> Vec<Point> {
    if turn(triangle[0], triangle[1], triangle[2]) <= 0.0 {
        return Vec::new();
    }
    let mut corners = wanted.to_vec();
    for k in 0..3 {
        let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
        let side = |p: Point| turn(from, to, p);
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (i, b) in corners.iter().enumerate() {
            let a = corners[(i + corners.len() - 1) % corners.len()];
            let (of_a, of_b) = (side(a), side(*b));
            if (of_a < 0.0) != (of_b < 0.0) {
                let t = of_a / (of_a - of_b);
                kept.push([0, 1].map(|k| a[k] + t * (b[k] - a[k])));
            }
            if of_b >= 0.0 {
                kept.push(*b);
            }
        }
        corners = kept;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ratios of areas from the standards' own numbers, as widely published (72 % and 53 % in x, y);
    /// both triangles lie within BT.2020 but for a sliver of DCI-P3's red in x, y: 99.98 % of it is
    /// covered.
    #[test]
    fn standards_have_the_published_areas() {
        for (primaries, xy, uv) in
            [(BT2020, 1.0, 1.0), (BT709, 0.5289, 0.5803), (DCI_P3, 0.7174, 0.7287)]
        {
            let found = shares(primaries.xy, &BT2020);
            for (shares, area) in found.iter().zip([xy, uv]) {
                assert!((shares.area - area).abs() < 1e-3, "{}: {found:?}", primaries.name);
                assert!((shares.coverage - shares.area).abs() < 3e-4, "{found:?}");
            }
        }
        // A standard covers itself exactly, whichever way its corners run.
        for standard in STANDARDS {
            let [r, g, b] = standard.xy;
            for corners in [[r, g, b], [b, g, r], [g, r, b]] {
                for found in shares(corners, &standard) {
                    assert_eq!(found.coverage.to_bits(), 1f64.to_bits());
                    assert!((found.area - 1.0).abs() < 1e-12);
                }
            }
        }
        for (k, standard) in STANDARDS.iter().enumerate() {
            let found = coverages(standard.xy.map(xyz_of_xy));
            assert!(found[2 * k..][..2].iter().all(|share| *share > 1.0 - 1e-9), "{found:?}");
            assert!((found[1] - shares(standard.xy, &BT2020)[1].coverage).abs() < 1e-9);
        }
        assert!(coverages([[0.0; 3], [1.0; 3], [1.0; 3]]).iter().all(|share| share.is_nan()));
    }

    #[test]
    fn coverage_is_the_common_part() {
        let standard =
            Primaries { name: "half a square", xy: [[0.0, 0.1], [0.4, 0.1], [0.0, 0.5]] };
        // Disjoint; around it; within it at half its size; a corner cut; without area.
        for (triangle, area, coverage) in [
            ([[0.5, 0.6], [0.6, 0.6], [0.5, 0.7]], 0.0625, 0.0),
            ([[-0.4, -0.3], [1.2, -0.3], [-0.4, 1.3]], 16.0, 1.0),
            ([[0.1, 0.15], [0.3, 0.15], [0.1, 0.35]], 0.25, 0.25),
            ([[0.2, 0.1], [0.6, 0.1], [0.2, 0.5]], 1.0, 0.25),
            ([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]], 0.0, 0.0),
        ] {
            let [found, _] = shares(triangle, &standard);
            assert!((found.area - area).abs() < 1e-12, "{found:?}");
            assert!((found.coverage - coverage).abs() < 1e-12, "{found:?}");
        }
    }

    /// IEC 61966-2-1 prints the matrix of sRGB to four digits; BT.2020 the luminances of its
    /// primaries.
    #[test]
    fn matrices_are_the_published_ones() {
        let printed =
            [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
        let found = BT709.to_xyz(D65);
        for (found, printed) in found.iter().flatten().zip(printed.iter().flatten()) {
            assert!((found - printed).abs() < 6e-5, "{found} {printed}");
        }
        for (found, printed) in BT2020.to_xyz(D65)[1].iter().zip([0.2627, 0.6780, 0.0593]) {
            assert!((found - printed).abs() < 6e-5, "{found} {printed}");
        }
        // Equal parts lie within, a point beyond the side from green to blue does not.
        assert!(BT709.hold(D65) && BT709.hold([1.0 / 3.0; 2]));
        assert!(!BT709.hold([0.18, 0.329]) && BT2020.hold([0.18, 0.329]));
        let back = inverse(&found).expect("primaries apart");
        let v = [0.3, 0.5, 0.1];
        let same = apply(&back, apply(&found, v));
        assert!((0..3).all(|k| (same[k] - v[k]).abs() < 1e-14), "{same:?}");
        assert_eq!(inverse(&[[1.0, 2.0, 3.0], [1.0, 2.0, 4.0], [1.0, 2.0, 5.0]]), None);
        assert_eq!(inverse(&[[0.0; 3]; 3]), None);
    }
}
