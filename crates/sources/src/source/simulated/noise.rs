//! Noise as a function of seed, frame and taxel, so that it does not depend on the order of frames or on the machine.

/// The finalizer of SplitMix64.
fn mixed(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A standard normal number for (seed, frame, taxel), by Box and Muller.
pub(super) fn normal(seed: u64, frame: u64, taxel: u32) -> f64 {
    const ODD: u64 = 0x9E37_79B9_7F4A_7C15;
    let of_seed = mixed(seed.wrapping_add(ODD));
    let of_frame = mixed(of_seed ^ frame.wrapping_mul(ODD));
    let key = mixed(of_frame.wrapping_add(u64::from(taxel).wrapping_mul(0xD1B5_4A32_D192_ED03)));
    // 53 bits each, the first in (0, 1] as its logarithm is taken.
    let unit = |bits: u64| (bits >> 11) as f64 / 9_007_199_254_740_992.0;
    let radius = (-2.0 * libm::log(1.0 - unit(key))).sqrt();
    radius * libm::cos(std::f64::consts::TAU * unit(mixed(key.wrapping_add(ODD))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_normal_along_frames_taxels_and_seeds() {
        let count = 20_000_u32;
        let along: [fn(u32) -> f64; 3] =
            [|i| normal(1, u64::from(i), 7), |i| normal(1, 7, i), |i| normal(u64::from(i), 7, 7)];
        for sample in along {
            let values: Vec<f64> = (0..count).map(sample).collect();
            let n = f64::from(count);
            let mean = values.iter().sum::<f64>() / n;
            let power = |k: i32| values.iter().map(|v| v.powi(k)).sum::<f64>() / n;
            let neighbours = values.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / n;
            // Five standard deviations of each estimate for independent standard normal numbers.
            let five = 5.0 / n.sqrt();
            assert!(mean.abs() < five, "{mean}");
            assert!((power(2) - 1.0).abs() < five * 2.0_f64.sqrt());
            assert!((power(4) - 3.0).abs() < five * 96.0_f64.sqrt());
            assert!(neighbours.abs() < five);
        }
        assert_ne!(normal(1, 2, 3), normal(1, 3, 2));
    }
}
