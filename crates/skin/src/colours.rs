//! The colours of what taxels read: one map of each kind for the page and for pictures.
//!
//! Pressure goes from a dark blue over purple, rose and orange to a light yellow. Lightness rises evenly, so that people who see
//! colours differently and prints in grey show the same order; no colour of it is grey, so that it stands out from a body.
//! Temperature goes from blue over nearly white to red: both ways it gets darker, and the two sides differ for everybody.
//! Distance goes from a light green, where something is near, to a dark one.

use std::f64::consts::PI;

/// Number of colours.
pub const COLOURS: usize = 256;

/// A map in Oklab, interpolated linearly.
struct Map {
    /// (position, lightness).
    lightness: &'static [(f64, f64)],
    /// (position, chroma, hue in degrees).
    anchors: &'static [(f64, f64, f64)],
}

const PRESSURE: Map = Map {
    lightness: &[(0.0, 0.36), (1.0, 0.94)],
    anchors: &[
        (0.0, 0.15, 272.0),
        (0.25, 0.20, 305.0),
        (0.5, 0.20, 360.0),
        (0.75, 0.17, 405.0),
        (0.9, 0.16, 445.0),
        (1.0, 0.14, 465.0),
    ],
};

const TEMPERATURE: Map = Map {
    lightness: &[(0.0, 0.34), (0.5, 0.95), (1.0, 0.42)],
    anchors: &[
        (0.0, 0.17, 262.0),
        (0.3, 0.13, 245.0),
        // The hue changes in one step, where there is hardly any.
        (0.4999, 0.02, 240.0),
        (0.5, 0.015, 60.0),
        (0.7, 0.13, 55.0),
        (1.0, 0.17, 30.0),
    ],
};

const DISTANCE: Map = Map {
    lightness: &[(0.0, 0.95), (1.0, 0.34)],
    anchors: &[(0.0, 0.10, 185.0), (0.3, 0.13, 175.0), (0.65, 0.11, 165.0), (1.0, 0.08, 155.0)],
};

/// The colours from no pressure to the highest of the scale, sRGB.
#[must_use]
pub fn pressure_colours() -> [[u8; 3]; COLOURS] {
    PRESSURE.colours()
}

/// The colours from the coldest temperature of the scale to the warmest, sRGB.
#[must_use]
pub fn temperature_colours() -> [[u8; 3]; COLOURS] {
    TEMPERATURE.colours()
}

/// The colours from no distance to the farthest of the scale, sRGB.
#[must_use]
pub fn distance_colours() -> [[u8; 3]; COLOURS] {
    DISTANCE.colours()
}

impl Map {
    fn colours(&self) -> [[u8; 3]; COLOURS] {
        std::array::from_fn(|index| self.colour(index as f64 / (COLOURS - 1) as f64))
    }

    /// The colour at `share` of the scale.
    fn colour(&self, share: f64) -> [u8; 3] {
        let at = self.lightness.iter().position(|anchor| anchor.0 >= share).unwrap_or(self.lightness.len() - 1).max(1);
        let (a, b) = (self.lightness[at - 1], self.lightness[at]);
        let lightness = a.1 + (b.1 - a.1) * ((share - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
        let at = self.anchors.iter().position(|anchor| anchor.0 >= share).unwrap_or(self.anchors.len() - 1).max(1);
        let (a, b) = (self.anchors[at - 1], self.anchors[at]);
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
    fn temperatures_darken_both_ways_and_distances_one_way_for_every_kind_of_sight() {
        let (temperatures, distances) = (temperature_colours(), distance_colours());
        let backwards = |colours: &[[u8; 3]]| colours.iter().rev().copied().collect::<Vec<_>>();
        for sight in &SIGHTS {
            assert!(rises(&temperatures[..COLOURS / 2], sight, 4));
            assert!(rises(&backwards(&temperatures[COLOURS / 2..]), sight, 4));
            assert!(rises(&backwards(&distances), sight, 4));
        }
        let [cold, middle, warm] = [0, COLOURS / 2, COLOURS - 1].map(|at| temperatures[at]);
        assert!(cold[2] > cold[0] + 100 && warm[0] > warm[2] + 100, "{cold:?}, {warm:?}");
        assert!(lightness(linear(middle)) > 90.0, "{middle:?}");
    }

    /// Oklab, in which distances are about as large as they look.
    fn oklab(rgb: [f64; 3]) -> [f64; 3] {
        const CONES: [[f64; 3]; 3] = [
            [0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9],
            [0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6],
            [0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5],
        ];
        const LAB: [[f64; 3]; 3] = [
            [0.210_454_255_3, 0.793_617_785, -0.004_072_046_8],
            [1.977_998_495_1, -2.428_592_205, 0.450_593_709_9],
            [0.025_904_037_1, 0.782_771_766_2, -0.808_675_766],
        ];
        let by =
            |matrix: [[f64; 3]; 3], of: [f64; 3]| matrix.map(|row| row.iter().zip(of).map(|(a, b)| a * b).sum::<f64>());
        by(LAB, by(CONES, rgb).map(f64::cbrt))
    }

    fn apart(one: [u8; 3], other: [u8; 3], sight: &[[f64; 3]; 3]) -> f64 {
        let seen = |colour: [u8; 3]| {
            let rgb = linear(colour);
            oklab(sight.map(|row| row.iter().zip(rgb).map(|(a, b)| a * b).sum::<f64>().clamp(0.0, 1.0)))
        };
        seen(one).iter().zip(seen(other)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn what_is_cold_and_what_is_warm_differ_for_every_kind_of_sight() {
        let colours = temperature_colours();
        // As far from the middle, on both sides: as far apart as two greys whose lightness differs by a tenth.
        for sight in &SIGHTS {
            for off in [32, 64, 96, 127] {
                let distance = apart(colours[127 - off], colours[128 + off], sight);
                assert!(distance >= 0.1, "{off}: {distance}");
            }
        }
        // Green and red of one lightness would not do.
        assert!(apart([120, 125, 40], [200, 80, 60], &SIGHTS[2]) < 0.1);
    }

    #[test]
    fn no_colour_is_grey() {
        for colour in pressure_colours() {
            let (least, most) = (colour.iter().min().unwrap(), colour.iter().max().unwrap());
            assert!(most - least > 60, "{colour:?}");
        }
    }
}
