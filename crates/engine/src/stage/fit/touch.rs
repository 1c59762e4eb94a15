//! A touch as the fit takes it: its sensors in units of the layer and of its largest pressure, and where descents start.

use glam::DVec2;

use super::kinds::{Blob, Kind as _};
use super::objective::Sensor;
use super::real::Real;
use super::shape::Shape;

/// The layer over the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    /// Standard deviation of a point force's pressure at the sensors.
    pub(crate) sigma_m: f64,
    /// Relative standard deviation of the sensors' gains, and of what the model is off by.
    pub(crate) gain_spread: f64,
    /// A place farther than this from every sensor is beyond them: over half of the way from a sensor to those beside it, so that
    /// none between sensors is.
    pub(crate) reach_m: f64,
    /// How many steps descents make.
    pub(crate) steps: usize,
}

/// A taxel of a touch, or beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taxel {
    /// In the touch's chart.
    pub(crate) place_m: DVec2,
    pub(crate) area_m2: f64,
    /// The force that it feels, in N or in the unit of P; 0 if it is not pressed.
    pub(crate) pressure: f64,
    /// The P up to which one reads 0.
    pub(crate) threshold: f64,
    /// Standard deviation of P for noise, if that is known.
    pub(crate) sigma: Option<f64>,
    /// Relative standard deviation of its gain, where it is more than the layer's.
    pub(crate) gain_spread: Option<f64>,
    /// How it counts in the mean of the touch.
    pub(crate) pull: Pull,
}

/// How a taxel counts in the weighted mean of its touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pull {
    /// The weight of what it feels; 0 for a taxel of another touch.
    pub(crate) weight: f64,
    /// What a soft onset takes off what it feels before.
    pub(crate) less: f64,
}

impl Pull {
    /// The weighted pressure of a taxel that feels `pressure`.
    pub(super) fn weighted(self, pressure: f64) -> f64 {
        self.weight * (pressure - self.less).max(0.0)
    }
}

/// A touch to be fitted.
#[derive(Clone, Debug)]
pub(crate) struct Touch {
    sensors: Vec<Sensor<f64>>,
    /// By sensor.
    pub(super) pulls: Vec<Pull>,
    /// What lengths and pressures are counted in, and from where.
    pub(super) unit_m: f64,
    pub(super) peak: f64,
    pub(super) origin: DVec2,
    pub(super) pressed: usize,
    /// Whether the noise of all of its taxels is known.
    pub(super) has_noise: bool,
    gain_spread: f64,
    reach: f64,
    pub(super) steps: usize,
}

/// Where the descents of a touch, or of several in lanes, start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start<R> {
    pub(crate) point: Shape<R>,
    pub(crate) line: Shape<R>,
    pub(crate) blob: Shape<R>,
    /// The logarithm of half a segment's length.
    pub(crate) half_length: R,
    pub(crate) gain_variance: R,
    pub(crate) steps: usize,
    /// Whether there are taxels enough for segments and blobs.
    pub(crate) is_long: bool,
}

impl<R: Real> Start<R> {
    /// Several side by side, of numbers that `lanes` puts side by side.
    #[inline(always)]
    pub(crate) fn abreast<const N: usize>(starts: [&Start<f64>; N], lanes: impl Fn([f64; N]) -> R + Copy) -> Self {
        Self {
            point: Shape::abreast(starts.map(|start| &start.point), lanes),
            line: Shape::abreast(starts.map(|start| &start.line), lanes),
            blob: Shape::abreast(starts.map(|start| &start.blob), lanes),
            half_length: lanes(starts.map(|start| start.half_length)),
            gain_variance: lanes(starts.map(|start| start.gain_variance)),
            steps: starts.iter().map(|start| start.steps).max().unwrap_or(0),
            is_long: starts.iter().any(|start| start.is_long),
        }
    }
}

/// Pressed taxels that suffice for a point.
pub(super) const LEAST_PRESSED: usize = 3;
/// A taxel's noise counts as at least this part of the touch's largest pressure: what it is taken for where it is not known.
const LEAST_NOISE: f64 = 1e-3;
const UNKNOWN_NOISE: f64 = 1e-2;
/// A place farther than this outside of all sensors, in σ, is a guess: nothing on its other side feels it.
const BEYOND: f64 = 0.5;
/// Moves after which a place is as far from the hull as has been found: it is at its edge.
const MOVES: usize = 32;
/// Half of a segment's length starts at least here, in σ.
const SHORTEST_HALF: f64 = 0.5;

impl Touch {
    /// The touch of `taxels`; some of them are pressed.
    pub(crate) fn new(taxels: &[Taxel], layer: &Layer) -> Self {
        let (unit_m, peak) = (layer.sigma_m, taxels.iter().map(|taxel| taxel.pressure).fold(0.0, f64::max));
        let total: f64 = taxels.iter().map(|taxel| taxel.pressure).sum();
        let origin = taxels.iter().map(|taxel| taxel.pressure * taxel.place_m).sum::<DVec2>() / total;
        let sensor = |taxel: &Taxel| {
            let is_pressed = taxel.pressure > 0.0;
            let sigma = taxel.sigma.map_or(UNKNOWN_NOISE, |sigma| sigma / peak).max(LEAST_NOISE);
            let pressure = if is_pressed { taxel.pressure } else { taxel.threshold } / peak;
            // The layer's spread goes with what a contact makes a taxel feel; a wider one of its own with what it reads.
            let wider = taxel.gain_spread.map_or(0.0, |own| (own * own - layer.gain_spread.powi(2)).max(0.0));
            Sensor {
                at: ((taxel.place_m - origin) / unit_m).to_array(),
                margin: 0.5 * taxel.area_m2.sqrt() / unit_m,
                pressure,
                variance: sigma * sigma + wider * pressure * pressure,
                pressed: if is_pressed { 1.0 } else { 0.0 },
            }
        };
        Self {
            sensors: taxels.iter().map(sensor).collect(),
            pulls: taxels.iter().map(|taxel| Pull { less: taxel.pull.less / peak, ..taxel.pull }).collect(),
            unit_m,
            peak,
            origin,
            pressed: taxels.iter().filter(|taxel| taxel.pressure > 0.0).count(),
            has_noise: taxels.iter().all(|taxel| taxel.sigma.is_some()),
            gain_spread: layer.gain_spread,
            reach: layer.reach_m / unit_m,
            steps: layer.steps,
        }
    }

    /// Whether there are taxels enough for segments and blobs.
    pub(crate) fn is_long(&self) -> bool {
        self.pressed > Blob::FREE.len()
    }

    /// Relative variance of what taxels feel by the contact.
    pub(super) fn gain_variance(&self) -> f64 {
        self.gain_spread * self.gain_spread
    }

    pub(crate) fn sensors(&self) -> &[Sensor<f64>] {
        &self.sensors
    }

    /// Whether `place` is between sensors: near one, and not beyond the outermost.
    pub(super) fn reaches(&self, place: DVec2) -> bool {
        let at = |sensor: &Sensor<f64>| DVec2::from_array(sensor.at);
        self.sensors.iter().any(|sensor| at(sensor).distance(place) <= self.reach) && !self.is_beyond(place)
    }

    /// Whether `place` is farther than [`BEYOND`] from the convex hull of the sensors, by Gilbert's algorithm (1966): the place in the
    /// hull that is nearest so far moves towards the sensor that is farthest in the direction of `place`.
    fn is_beyond(&self, place: DVec2) -> bool {
        let at = |sensor: &Sensor<f64>| DVec2::from_array(sensor.at);
        let Some(mut nearest) = self.sensors.first().map(at) else { return true };
        for _ in 0..MOVES {
            let out = place - nearest;
            let distance = out.length();
            if distance <= BEYOND {
                return false;
            }
            let ahead = |sensor: &Sensor<f64>| out.dot(at(sensor));
            let Some(farthest) = self.sensors.iter().max_by(|a, b| ahead(a).total_cmp(&ahead(b))) else { return true };
            // All sensors lie behind the line through it.
            if out.dot(place - at(farthest)) > BEYOND * distance {
                return true;
            }
            let way = at(farthest) - nearest;
            let share = out.dot(way) / way.length_squared().max(f64::MIN_POSITIVE);
            nearest += way * share.clamp(0.0, 1.0);
        }
        false
    }

    /// Where its descents start: from its second moments. None where taxels are too few for any kind.
    pub(crate) fn start(&self) -> Option<Start<f64>> {
        let pressed = self.sensors.iter().filter(|sensor| sensor.pressed > 0.0);
        let (mut total, mut moments, mut cell) = (0.0, [0.0; 3], 0.0);
        for &Sensor { at: [u, v], margin, pressure, .. } in pressed {
            total += pressure;
            cell += pressure * margin * margin / 3.0;
            moments = [moments[0] + pressure * u * u, moments[1] + pressure * u * v, moments[2] + pressure * v * v];
        }
        let [a, b, d] = moments.map(|moment| moment / total);
        let (mean, apart) = (0.5 * (a + d), libm::hypot(0.5 * (a - d), b));
        let turn = 0.5 * libm::atan2(2.0 * b, a - d);
        // The logarithm of the spread whose variance, with that of a taxel, is a moment; none is sharper than the layer.
        let spread = |moment: f64| 0.5 * libm::log((moment - cell / total).max(1.0));
        let shape = |along, width: f64, length: f64| Shape { place: [0.0; 2], along, force: 0.0, width, length };
        let axis = [libm::cos(turn), libm::sin(turn)];
        (self.pressed >= LEAST_PRESSED).then(|| Start {
            point: shape([1.0, 0.0], spread(mean), 0.0),
            line: shape(axis, spread(mean - apart), 0.0),
            blob: shape(axis, spread(mean - apart), spread(mean + apart)),
            // An even line has a variance of h²/3.
            half_length: libm::log((6.0 * apart).sqrt().max(SHORTEST_HALF)),
            gain_variance: self.gain_variance(),
            steps: self.steps,
            is_long: self.is_long(),
        })
    }
}
