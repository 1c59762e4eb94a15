//! The colours of pressure: one map for the page and for pictures.
//!
//! From a dark blue over purple, rose and orange to a light yellow. Lightness rises evenly, so that people who see
//! colours differently and prints in grey show the same order; no colour of it is grey, so that it stands out from a body.

use std::f64::consts::PI;

/// Number of colours.
pub const COLOURS: usize = 256;

/// Lightness at both ends (Oklab).
const LIGHTNESS: [f64; 2] = [0.36, 0.94];

/// (position, chroma, hue in degrees) in Oklab, interpolated linearly.
const ANCHORS: [(f64, f64, f64); 6] = [
    (0.0, 0.15, 272.0),
    (0.25, 0.20, 305.0),
    (0.5, 0.20, 360.0),
    (0.75, 0.17, 405.0),
    (0.9, 0.16, 445.0),
    (1.0, 0.14, 465.0),
];

/// The colours from no pressure to the highest of the scale, sRGB.
#[must_use]
pub fn pressure_colours() -> [[u8; 3]; COLOURS] {
    std::array::from_fn(|index| colour(index as f64 / (COLOURS - 1) as f64))
}

/// The colour at `share` of the scale.
fn colour(share: f64) -> [u8; 3] {
    let lightness = LIGHTNESS[0] + (LIGHTNESS[1] - LIGHTNESS[0]) * share;
    let after = ANCHORS.iter().position(|anchor| anchor.0 >= share).unwrap_or(ANCHORS.len() - 1).max(1);
    let (a, b) = (ANCHORS[after - 1], ANCHORS[after]);
    let way = ((share - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
    let hue = (a.2 + (b.2 - a.2) * way) * PI / 180.0;
    let mut chroma = a.1 + (b.1 - a.1) * way;
    // What a screen cannot show is made less colourful, at the same lightness.
    loop {
        let rgb = linear_of(lightness, chroma * hue.cos(), chroma * hue.sin());
        if chroma <= 0.0 || rgb.iter().all(|part| (0.0..=1.0).contains(part)) {
            return rgb.map(|part| (encoded(part.clamp(0.0, 1.0)) * 255.0).round() as u8);
        }
        chroma -= 0.002;
    }
}

/// Linear sRGB of an Oklab colour (B. Ottosson, 2020).
fn linear_of(lightness: f64, a: f64, b: f64) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(colour: [u8; 3]) -> [f64; 3] {
        colour.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
        })
    }

    /// CIE L*.
    fn lightness(rgb: [f64; 3]) -> f64 {
        let y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    /// How people without the cones for red, green or blue see it (Machado, Oliveira and Fernandes, 2009).
    const SIGHTS: [[[f64; 3]; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.152_286, 1.052_583, -0.204_868], [0.114_503, 0.786_281, 0.099_216], [-0.003_882, -0.048_116, 1.051_998]],
        [[0.367_322, 0.860_646, -0.227_968], [0.280_085, 0.672_501, 0.047_413], [-0.011_82, 0.042_94, 0.968_881]],
        [[1.255_528, -0.076_749, -0.178_779], [-0.078_411, 0.930_809, 0.147_602], [0.004_733, 0.691_367, 0.303_9]],
    ];

    fn rises(colours: &[[u8; 3]], sight: &[[f64; 3]; 3], over: usize) -> bool {
        let seen: Vec<f64> = colours
            .iter()
            .map(|&colour| {
                let rgb = linear(colour);
                lightness(sight.map(|row| row.iter().zip(rgb).map(|(a, b)| a * b).sum::<f64>().clamp(0.0, 1.0)))
            })
            .collect();
        seen.windows(over + 1).all(|pair| pair[over] > pair[0])
    }

    #[test]
    fn lightness_rises_for_every_kind_of_sight() {
        let colours = pressure_colours();
        // Eight bits a channel round single steps away.
        for sight in &SIGHTS {
            assert!(rises(&colours, sight, 4));
        }
        let range = [colours[0], colours[255]].map(|colour| lightness(linear(colour)));
        assert!(range[0] < 32.0 && range[1] > 90.0, "{range:?}");
        // A rainbow does not rise.
        let rainbow: Vec<[u8; 3]> = (0..=255).map(|i: u8| [i, 255 - i, 128]).collect();
        assert!(!rises(&rainbow, &SIGHTS[0], 4));
    }

    #[test]
    fn no_colour_is_grey() {
        for colour in pressure_colours() {
            let (least, most) = (colour.iter().min().unwrap(), colour.iter().max().unwrap());
            assert!(most - least > 60, "{colour:?}");
        }
    }
}
