//! How an indenter's force spreads over the taxels under a compliant skin.
//!
//! `docs/explanation/simulation.md` has the model: a contact patch after Hertz, spread by the layer over the taxels.

use std::f64::consts::PI;

use super::layer::{Blur, Kernel};
use super::patch::{self, Load, Pressure};
#[cfg(test)]
use super::radial::Radial;

/// The touching object. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Indenter {
    /// A rigid cylinder lying on the skin.
    Rod {
        radius_m: f64,
        length_m: f64,
    },
    Ball {
        radius_m: f64,
    },
    /// The pad of a human finger: a soft ball, whose contact is `aspect` times as long as it is wide, with the area of a round one.
    Fingertip {
        radius_m: f64,
        aspect: f64,
    },
    /// The flat end of a cylinder: even pressure over a disc.
    Flat {
        radius_m: f64,
    },
    /// A blade, without width.
    Edge {
        length_m: f64,
    },
}

impl Indenter {
    /// Default radius of a fingertip.
    pub(super) const FINGERTIP_RADIUS_M: f64 = 0.008;

    /// Whether it has a direction.
    pub(super) fn is_long(&self) -> bool {
        matches!(self, Self::Rod { .. } | Self::Edge { .. }) || self.aspect() > 1.0
    }

    /// How many times as long as wide its contact is, where it is an ellipse.
    fn aspect(&self) -> f64 {
        if let Self::Fingertip { aspect, .. } = self { *aspect } else { 1.0 }
    }
}

/// The compliant layer over the taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layer {
    pub(super) thickness_m: f64,
    /// Standard deviation of a point force's pressure at the bottom, as a share of the thickness.
    pub(super) spread: f64,
    /// Reduced modulus E* = E/(1 − ν²).
    pub(super) stiffness_pa: f64,
    pub(super) kernel: Kernel,
    /// The contact's pressure.
    pub(super) contact: Pressure,
}

impl Layer {
    /// The Gaussian that has the same peak as Boussinesq's pressure at this depth: 1/√3.
    pub(super) const SPREAD: f64 = 0.577_350_269_189_625_8;
    /// A soft silicone rubber.
    pub(super) const STIFFNESS_PA: f64 = 400e3;
    /// Taxels that lie bare.
    pub(super) const NONE: Self = Self {
        thickness_m: 0.0,
        spread: Self::SPREAD,
        stiffness_pa: Self::STIFFNESS_PA,
        kernel: Kernel::Gaussian,
        contact: Pressure::Gaussian,
    };

    /// σ of the layer's kernel, or of the Gaussian with the same peak.
    pub(super) fn sigma_m(&self) -> f64 {
        match self.kernel {
            Kernel::Gaussian => self.spread * self.thickness_m,
            Kernel::Radial(kernel) => kernel.spread() * self.thickness_m,
        }
    }

    /// The calibration's table of the layer; empty where taxels lie bare.
    pub(super) fn calibration(&self) -> String {
        if self.thickness_m > 0.0 { format!("\n[layer]\nsigma_m = {}\n", self.sigma_m()) } else { String::new() }
    }

    /// Compliance 1/E* with an indenter whose own is `other`; a bare taxel does not give.
    fn compliance(&self, other: f64) -> f64 {
        if self.thickness_m > 0.0 { 1.0 / self.stiffness_pa + other } else { other }
    }
}

/// Reduced modulus of a fingertip: 1 N then presses a disc of 5 mm radius, as fingers do.
const FINGERTIP_STIFFNESS_PA: f64 = 50e3;
/// Minimum standard deviation of a footprint, which avoids division by zero.
const MIN_SIGMA_M: f64 = 1e-6;
/// Maximum distance of a taxel from the contact's tangent plane, beside the footprint's size.
const MAX_DEPTH_M: f64 = 5e-3;

/// The layer counts as at least this share of a Hertzian patch deep, so that a number of loads can stand for it.
const MIN_DEPTH_SHARE: f64 = 1.0 / 8.0;
/// Half as many standard deviations as count beside a footprint: how deep below the contact a taxel still feels it.
const DEPTH_SIGMAS: f64 = 4.0;

/// The pressure under an indenter, per newton, along and across it.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    loads: Vec<Load>,
    blur: Blur,
    half_across_m: f64,
    half_along_m: f64,
}

impl Footprint {
    /// The footprint of `indenter` pressed with `force_newton` on `layer`.
    pub(super) fn new(indenter: &Indenter, layer: &Layer, force_newton: f64) -> Self {
        let compliance = match indenter {
            Indenter::Fingertip { .. } => layer.compliance(1.0 / FINGERTIP_STIFFNESS_PA),
            _ => layer.compliance(0.0),
        };
        // Hertz: b² = 4(F/L)R/πE* across a rod, a³ = 3FR/4E* around a ball.
        let (patch_m, half_along_m) = match *indenter {
            Indenter::Rod { radius_m, length_m } => {
                let load = force_newton / length_m;
                ((4.0 * load * radius_m * compliance / PI).sqrt().min(radius_m), length_m / 2.0)
            }
            Indenter::Edge { length_m } => (0.0, length_m / 2.0),
            Indenter::Ball { radius_m } | Indenter::Fingertip { radius_m, .. } => {
                (libm::cbrt(0.75 * radius_m * (force_newton * compliance)).min(radius_m), 0.0)
            }
            Indenter::Flat { radius_m } => (radius_m, 0.0),
        };
        if (layer.kernel, layer.contact) == (Kernel::Gaussian, Pressure::Gaussian) {
            return Self::blurred(indenter, layer.sigma_m().max(MIN_SIGMA_M), patch_m, half_along_m);
        }
        Self::exact(indenter, layer, patch_m, half_along_m)
    }

    /// With only the variance of Hertz's patch, and a Gaussian of σ = `layer`.
    fn blurred(indenter: &Indenter, layer: f64, patch_m: f64, half_along_m: f64) -> Self {
        let widened = |variance: f64| (layer * layer + variance).sqrt();
        let line = |sigma_across_m: f64, sigma_along_m: f64| Self {
            loads: Load::line(half_along_m),
            blur: Blur::Gaussian { sigma_across_m, sigma_along_m },
            half_across_m: 0.0,
            half_along_m,
        };
        match indenter {
            Indenter::Rod { .. } => line(widened(patch_m * patch_m / 4.0), layer),
            Indenter::Edge { .. } => line(layer, layer),
            Indenter::Ball { .. } | Indenter::Fingertip { .. } => {
                let (variance, aspect) = (patch_m * patch_m / 5.0, indenter.aspect());
                line(widened(variance / aspect), widened(variance * aspect))
            }
            Indenter::Flat { radius_m } => Self::disc(*radius_m, layer),
        }
    }

    /// A disc's: strips at Gauss's nodes for a weight of √(1 − x²), which is how long a strip of a disc is. They lie
    /// closer than its blur, which therefore is never less than a 64th of its radius.
    fn disc(radius_m: f64, layer: f64) -> Self {
        let layer = layer.max(radius_m / 64.0);
        let count = (4.0 * radius_m / layer).max(8.0) as u32;
        let strips = (1..=count).map(|k| {
            let angle = PI * f64::from(k) / f64::from(count + 1);
            let sin = libm::sin(angle);
            Load {
                across_m: radius_m * libm::cos(angle),
                along_m: 0.0,
                half_m: radius_m * sin,
                part: 2.0 * sin * sin / f64::from(count + 1),
            }
        });
        Self {
            loads: strips.collect(),
            blur: Blur::Gaussian { sigma_across_m: layer, sigma_along_m: layer },
            half_across_m: radius_m,
            half_along_m: radius_m,
        }
    }

    /// With Hertz's profile as it is, and the layer's own kernel.
    fn exact(indenter: &Indenter, layer: &Layer, patch_m: f64, half_along_m: f64) -> Self {
        let least = MIN_DEPTH_SHARE * patch_m;
        let blur = match layer.kernel {
            Kernel::Gaussian => {
                let sigma = layer.sigma_m().max(least);
                Blur::Gaussian { sigma_across_m: sigma, sigma_along_m: sigma }
            }
            Kernel::Radial(kernel) => Blur::Radial { kernel, depth_m: layer.thickness_m.max(least) },
        };
        let loads = Self::loads(indenter, layer.kernel, [patch_m, half_along_m], patch::scale_m(blur));
        let stretch = indenter.aspect().sqrt();
        Self { loads, blur, half_across_m: patch_m, half_along_m: half_along_m.max(patch_m * stretch) }
    }

    /// The loads that stand for a patch of half sides `across` and `along`, m, under a kernel of this scale.
    fn loads(indenter: &Indenter, kernel: Kernel, [across, along]: [f64; 2], scale_m: f64) -> Vec<Load> {
        let loads = match indenter {
            Indenter::Rod { .. } => patch::rod(across, along, scale_m),
            Indenter::Edge { .. } => Load::line(along),
            Indenter::Ball { .. } | Indenter::Fingertip { .. } => patch::dome(across, scale_m),
            Indenter::Flat { .. } => patch::disc(across, scale_m),
        };
        let mut loads = if kernel == Kernel::Gaussian { loads } else { patch::points(loads, scale_m) };
        let stretch = indenter.aspect().sqrt();
        for load in &mut loads {
            (load.across_m, load.along_m) = (load.across_m / stretch, load.along_m * stretch);
        }
        loads
    }

    /// The radius of an even disc with the same second moment, m; of a layer that is no Gaussian, by the Gaussian of its peak.
    pub(super) fn radius_m(&self) -> f64 {
        let moment = |load: &Load| {
            let [across, along, half] = [load.across_m, load.along_m, load.half_m].map(|x| x * x);
            load.part * (across + along + half / 3.0)
        };
        let blurred: f64 = match self.blur {
            Blur::Gaussian { sigma_across_m, sigma_along_m } => {
                sigma_across_m * sigma_across_m + sigma_along_m * sigma_along_m
            }
            Blur::Radial { .. } => 2.0 * self.blur.sigma_m() * self.blur.sigma_m(),
        };
        (2.0 * (blurred + self.loads.iter().map(moment).sum::<f64>())).sqrt()
    }

    /// Maximum distance from the tangent plane at which a taxel is touched, m.
    pub(super) fn depth_m(&self) -> f64 {
        MAX_DEPTH_M + self.half_across_m + DEPTH_SIGMAS * self.blur.sigma_m()
    }

    /// The share of the force on a square taxel with sides of `side_m` whose middle lies `across_m` and `along_m` from the
    /// middle of the indenter: the integral of the pressure over it.
    pub(super) fn share_on(&self, across_m: f64, along_m: f64, side_m: f64) -> f64 {
        let margin = side_m / 2.0;
        let [reach_across, reach_along] = self.blur.reach_m();
        if across_m.abs() > self.half_across_m + margin + reach_across
            || along_m.abs() > self.half_along_m + margin + reach_along
        {
            return 0.0;
        }
        let share = |load: &Load| {
            let (across_m, along_m) = (across_m - load.across_m, along_m - load.along_m);
            self.blur.share(load.part, across_m, along_m, load.half_m, margin)
        };
        self.loads.iter().map(share).sum::<f64>().max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYER: Layer = Layer { thickness_m: 7e-3, ..Layer::NONE };
    const ALL: [Indenter; 5] = [
        Indenter::Rod { radius_m: 0.0127, length_m: 0.05 },
        Indenter::Ball { radius_m: 0.01 },
        Indenter::Fingertip { radius_m: 0.008, aspect: 1.4 },
        Indenter::Flat { radius_m: 0.02 },
        Indenter::Edge { length_m: 0.03 },
    ];

    #[test]
    fn tiles_without_gaps_feel_all_of_the_force() {
        for indenter in ALL {
            for (layer, pitch) in [(LAYER, 4e-3), (LAYER, 1.3e-3), (Layer::NONE, 4e-3)] {
                let footprint = Footprint::new(&indenter, &layer, 5.0);
                let steps = (0.09 / pitch) as i32;
                let at = |i: i32| 0.37 * pitch + f64::from(i) * pitch;
                let sum: f64 = (-steps..=steps)
                    .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
                    .map(|(i, j)| footprint.share_on(at(i), at(j), pitch))
                    .sum();
                // Masses telescope over the tiles: what is left is rounding, magnified in a line's double difference by
                // |x|/margin, and the cut tails.
                assert!((sum - 1.0).abs() < 1e-10, "{indenter:?}: {sum}");
            }
        }
    }

    #[test]
    fn footprints_are_as_wide_as_the_model_says() {
        let sigma = LAYER.sigma_m();
        let (force, pitch) = (5.0_f64, 1e-3);
        // Of Hertz's patches by their textbook formulas; an even line has a variance of L²/12, an even disc of R²/4.
        let rod = force / 0.05 * 0.0127 / (PI * 400e3);
        let ball = (0.75 * force * 0.01 / 400e3).powf(2.0 / 3.0) / 5.0;
        let finger = (0.75 * force * 0.008 * (1.0 / 400e3 + 1.0 / 50e3)).powf(2.0 / 3.0).min(0.008 * 0.008) / 5.0;
        let right = [
            (rod, 0.05 * 0.05 / 12.0),
            (ball, ball),
            (finger / 1.4, finger * 1.4),
            (0.02 * 0.02 / 4.0, 0.02 * 0.02 / 4.0),
            (0.0, 0.03 * 0.03 / 12.0),
        ];
        for (indenter, (across, along)) in ALL.iter().zip(right) {
            let footprint = Footprint::new(indenter, &LAYER, force);
            let (mut got_across, mut got_along) = (0.0, 0.0);
            for (i, j) in (-70..=70).flat_map(|i| (-70..=70).map(move |j| (f64::from(i) * pitch, f64::from(j) * pitch)))
            {
                let part = footprint.share_on(i, j, pitch);
                got_across += part * i * i;
                got_along += part * j * j;
            }
            // Tiles add the variance of an even square; σ over four pitches leaves nothing else.
            let tile = sigma * sigma + pitch * pitch / 12.0;
            assert!((got_across / (across + tile) - 1.0).abs() < 1e-7, "{indenter:?}: {got_across} {across}");
            assert!((got_along / (along + tile) - 1.0).abs() < 1e-7, "{indenter:?}: {got_along} {along}");
        }
    }

    #[test]
    fn a_larger_force_presses_a_larger_patch_up_to_the_indenters_size() {
        for indenter in &ALL[..3] {
            let peak = |force: f64| Footprint::new(indenter, &LAYER, force).share_on(0.0, 0.0, 1e-3);
            assert!(peak(1.0) > peak(10.0));
            assert_eq!(peak(1e6), peak(1e7));
        }
    }

    #[test]
    fn a_point_force_has_boussinesqs_peak() {
        let ball = Indenter::Ball { radius_m: 1e-9 };
        let (side, z) = (1e-5, LAYER.thickness_m);
        let peak = Footprint::new(&ball, &LAYER, 1.0).share_on(0.0, 0.0, side) / (side * side);
        let right = 3.0 / (2.0 * PI * z * z);
        assert!((peak / right - 1.0).abs() < 1e-6, "{peak} {right}");
    }

    /// Skins of every model but the plain one.
    fn exact_layers() -> [Layer; 5] {
        let hertz = Layer { contact: Pressure::Hertz, ..LAYER };
        let layer = |kernel: Radial| Layer { kernel: Kernel::Radial(kernel), ..hertz };
        let deep = layer(Radial::Boussinesq);
        [hertz, deep, Layer { thickness_m: 3e-3, ..deep }, layer(Radial::Exponential), layer(Radial::Bonded)]
    }

    #[test]
    fn exact_footprints_conserve_the_force_and_its_middle() {
        for (indenter, layer) in ALL.iter().flat_map(|indenter| exact_layers().map(|layer| (indenter, layer))) {
            let footprint = Footprint::new(indenter, &layer, 5.0);
            let (pitch, steps) = (4e-3, 40);
            let (mut sum, mut moment) = (0.0, 0.0);
            for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (f64::from(i), f64::from(j)))) {
                let share = footprint.share_on(i * pitch, j * pitch, pitch);
                sum += share;
                moment += share * (i + j) * pitch;
            }
            // Boussinesq's pressure has a tail: what lies beyond r of a point is z³/(r² + z²)^(3/2).
            let edge = (f64::from(steps) + 0.5) * pitch - footprint.half_along_m;
            let tail = match layer.kernel {
                Kernel::Gaussian => 0.0,
                Kernel::Radial(Radial::Boussinesq) => (layer.thickness_m / edge).powi(3),
                // Their squares are summed by rules of a few nodes.
                Kernel::Radial(_) => 1e-3,
            };
            assert!((sum - 1.0).abs() <= tail + 1e-10, "{indenter:?} {layer:?}: {:e}", sum - 1.0);
            let is_long = layer.kernel == Kernel::Radial(Radial::Boussinesq);
            assert!(!is_long || 1.0 - sum > 1e-6, "the tail is there: {:e}", 1.0 - sum);
            assert!(moment.abs() < 1e-12, "{indenter:?}: {moment:e}");
        }
    }

    #[test]
    fn more_loads_change_nothing() {
        for (indenter, layer) in ALL.iter().flat_map(|indenter| exact_layers().map(|layer| (indenter, layer))) {
            let footprint = Footprint::new(indenter, &layer, 5.0);
            let scale = patch::scale_m(footprint.blur);
            let peak = footprint.share_on(0.0, 0.0, 4e-3);
            let with = |scale: f64| {
                let halves = [footprint.half_across_m, footprint.half_along_m];
                let loads = Footprint::loads(indenter, layer.kernel, halves, scale);
                Footprint { loads, ..footprint.clone() }
            };
            let off = |other: &Footprint| {
                let at = |k: i32| f64::from(k) * 3e-3;
                let places = (0..6).flat_map(|i| (-3..6).map(move |j| (at(i), at(j))));
                places
                    .map(|(x, y)| (other.share_on(x, y, 4e-3) - footprint.share_on(x, y, 4e-3)).abs())
                    .fold(0.0, f64::max)
            };
            assert_eq!(off(&with(scale)), 0.0, "{indenter:?} {layer:?}");
            let finer = off(&with(scale / 3.0));
            // The squares of these kernels are summed by rules of a few nodes, and one has a sharp top.
            let is_summed = matches!(layer.kernel, Kernel::Radial(Radial::Exponential | Radial::Bonded));
            let within = if is_summed { 1e-3 } else { 1e-5 };
            assert!(finer < within * peak, "{indenter:?} {layer:?}: {:e}", finer / peak);
        }
    }

    #[test]
    fn the_exact_models_differ_from_the_plain_one() {
        let ball = Indenter::Ball { radius_m: 0.01 };
        let peak = |layer: &Layer| Footprint::new(&ball, layer, 5.0).share_on(0.0, 0.0, 1e-3);
        let [hertz, deep, ..] = exact_layers();
        // Under a thick layer Hertz's profile is as good as its variance; Boussinesq's tails are not a Gaussian's.
        let ratio = peak(&hertz) / peak(&LAYER);
        assert!((ratio - 1.0).abs() < 0.05 && ratio != 1.0, "{ratio}");
        let far = |layer: &Layer| Footprint::new(&ball, layer, 5.0).share_on(20e-3, 0.0, 1e-3);
        assert!(far(&deep) > 50.0 * far(&LAYER), "{:e} {:e}", far(&deep), far(&LAYER));
        // Bare of any layer's blur a dome stays a dome: zero pressure beyond the patch, 1.5 times the mean in its middle.
        let thin = Layer { thickness_m: 1e-4, contact: Pressure::Hertz, ..Layer::NONE };
        let footprint = Footprint::new(&ball, &thin, 5.0);
        let (patch, side) = (footprint.half_across_m, 1e-4);
        let mean = side * side / (PI * patch * patch);
        assert!((footprint.share_on(0.0, 0.0, side) / mean - 1.5).abs() < 0.03);
        assert!(footprint.share_on(2.1 * patch, 0.0, side) < 1e-6 * mean);
    }

    #[test]
    fn a_disc_is_even_inside_and_nothing_outside() {
        let bare = Footprint::new(&Indenter::Flat { radius_m: 0.02 }, &Layer::NONE, 1.0);
        let side = 2e-3;
        let even = side * side / (PI * 0.02 * 0.02);
        for (x, y) in [(0.0, 0.0), (0.01, 0.003), (-0.005, 0.012)] {
            let felt = bare.share_on(x, y, side);
            assert!((felt / even - 1.0).abs() < 1e-4, "{felt} {even}");
        }
        assert_eq!(bare.share_on(0.024, 0.0, side), 0.0);
    }
}
