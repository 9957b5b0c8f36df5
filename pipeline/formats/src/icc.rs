// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether an ICC profile is that of sRGB (ICC.1:2010): by its colorants, adapted to D50, and its
//! curves, not by its name.

/// Colorants of sRGB adapted to D50, X, Y and Z of red, green and blue (ICC, "sRGB v4 and v2").
const COLORANTS: [(&[u8; 4], [f64; 3]); 3] = [
    (b"rXYZ", [0.4361, 0.2225, 0.0139]),
    (b"gXYZ", [0.3851, 0.7169, 0.0971]),
    (b"bXYZ", [0.1431, 0.0606, 0.7141]),
];
const CURVES: [&[u8; 4]; 3] = [b"rTRC", b"gTRC", b"bTRC"];
/// Largest difference of colorants, and of light at a level.
const SAME: f64 = 2e-3;

/// True of the profile of sRGB.
pub fn is_srgb(profile: &[u8]) -> bool {
    let is_near = |a: f64, b: f64| (a - b).abs() <= SAME;
    let has_colorant = |(name, xyz): (&[u8; 4], [f64; 3])| {
        let tag = tag(profile, *name).filter(|tag| tag.starts_with(b"XYZ "));
        tag.is_some_and(|tag| {
            (0..3).all(|k| fixed(tag, 8 + 4 * k).is_some_and(|v| is_near(v, xyz[k])))
        })
    };
    let has_curve = |name: &[u8; 4]| {
        let Some(tag) = tag(profile, *name) else { return false };
        // Light of sRGB at these levels (IEC 61966-2-1).
        [(0.1, 0.010_02), (0.5, 0.214_04), (0.8, 0.603_83)]
            .into_iter()
            .all(|(level, light)| curve(tag, level).is_some_and(|v| is_near(v, light)))
    };
    COLORANTS.into_iter().all(has_colorant) && CURVES.into_iter().all(has_curve)
}

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let four = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    Some(u32::from_be_bytes(four) as usize)
}

/// A number in steps of 1/65536.
fn fixed(bytes: &[u8], at: usize) -> Option<f64> {
    let four = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    Some(f64::from(i32::from_be_bytes(four)) / 65_536.0)
}

/// The bytes of a tag.
fn tag(profile: &[u8], name: [u8; 4]) -> Option<&[u8]> {
    let count = number(profile, 128)?.min(100);
    let entry = |k: &usize| profile.get(132 + 12 * k..136 + 12 * k) == Some(&name[..]);
    let at = 132 + 12 * (0..count).find(entry)?;
    let (from, length) = (number(profile, at + 4)?, number(profile, at + 8)?);
    profile.get(from..from.checked_add(length)?)
}

/// Light of a curve at a level: of samples, of one gamma, or of the third parametric form.
fn curve(tag: &[u8], level: f64) -> Option<f64> {
    if tag.starts_with(b"para") {
        let [g, a, b, c, d] = [0, 1, 2, 3, 4].map(|k| fixed(tag, 12 + 4 * k));
        let is_third = tag.get(8..10)? == [0, 3];
        let (g, a, b, c, d) = (g?, a?, b?, c?, d?);
        let light = if level >= d { (a * level + b).powf(g) } else { c * level };
        return is_third.then_some(light);
    }
    let count = tag.starts_with(b"curv").then(|| number(tag, 8))??;
    let sample = |k: usize| {
        let two = tag.get(12 + 2 * k..14 + 2 * k)?.try_into().ok()?;
        Some(f64::from(u16::from_be_bytes(two)))
    };
    match count {
        0 => Some(level),
        1 => Some(level.powf(sample(0)? / 256.0)),
        _ => {
            let at = level * (count - 1) as f64;
            let k = (at as usize).min(count - 2);
            let [a, b] = [sample(k)?, sample(k + 1)?];
            Some((a + (b - a) * (at - k as f64)) / 65_535.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A profile of these colorants and one curve, whose name is sRGB whatever it is.
    fn profile(colorants: [[f64; 3]; 3], curve: &[u8]) -> Vec<u8> {
        let step = |v: f64| ((v * 65_536.0).round() as i32).to_be_bytes();
        let mut tags: Vec<(&[u8; 4], Vec<u8>)> = vec![(b"desc", b"desc\0\0\0\0sRGB".to_vec())];
        for ((name, _), xyz) in COLORANTS.iter().zip(colorants) {
            let numbers = xyz.into_iter().flat_map(step);
            tags.push((*name, b"XYZ \0\0\0\0".iter().copied().chain(numbers).collect()));
        }
        tags.extend(CURVES.map(|name| (name, curve.to_vec())));
        let mut bytes = vec![0; 128];
        bytes.extend((tags.len() as u32).to_be_bytes());
        let mut at = 132 + 12 * tags.len() as u32;
        for (name, tag) in &tags {
            bytes.extend(name.iter());
            bytes.extend(at.to_be_bytes());
            bytes.extend((tag.len() as u32).to_be_bytes());
            at += tag.len() as u32;
        }
        bytes.extend(tags.into_iter().flat_map(|(_, tag)| tag));
        bytes
    }

    #[test]
    fn a_profile_is_known_by_its_numbers() {
        let srgb = COLORANTS.map(|(_, xyz)| xyz);
        let fixed = |v: f64| ((v * 65_536.0).round() as i32).to_be_bytes();
        let para = [2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045];
        let para: Vec<u8> = b"para\0\0\0\0\0\x03\0\0"
            .iter()
            .copied()
            .chain(para.into_iter().flat_map(fixed))
            .collect();
        assert!(is_srgb(&profile(srgb, &para)));
        // The colorants of Display P3, a gamma of 2.2, and light are others under the same name.
        let p3 = [[0.5151, 0.2412, -0.0011], [0.2920, 0.6922, 0.0419], [0.1571, 0.0666, 0.7841]];
        assert!(!is_srgb(&profile(p3, &para)));
        let gamma = b"curv\0\0\0\0\0\0\0\x01\x02\x33";
        assert!(!is_srgb(&profile(srgb, gamma)));
        assert!(!is_srgb(&profile(srgb, b"curv\0\0\0\0\0\0\0\0")));
        let whole = profile(srgb, &para);
        assert!((0..whole.len()).all(|end| !is_srgb(&whole[..end])));
    }
}
