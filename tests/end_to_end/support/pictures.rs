// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures that tests write.

/// A picture of two pixels, of this gamma where it is stated.
pub fn png(colour: png::ColorType, gamma: Option<f32>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    if let Some(gamma) = gamma {
        encoder.set_source_gamma(png::ScaledFloat::new(gamma));
    }
    let pixels = vec![90; 2 * colour.samples()];
    encoder.write_header().expect("a header").write_image_data(&pixels).expect("pixels");
    bytes
}
