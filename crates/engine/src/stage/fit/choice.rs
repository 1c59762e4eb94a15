//! Fits all kinds of contact and chooses one.

use glam::DVec2;

use super::descent::{Fitted, STEPS, descend};
use super::kinds::{Blob, Contact, Kind, Line, Point, Segment};
use super::objective::Sensor;
use super::place::{Place, PlaceOfFit};
use super::real::Real;
use super::shape::{Parameter, Shape};
use super::touch::{LEAST_PRESSED, Start, Touch};
use crate::percept::{ContactKind, FitSigma, TouchFlags};
use crate::stage::angle;

/// What a parameter costs: two more lower χ² by over twice as much in one touch of a hundred by chance, e^−PENALTY.
pub(super) const PENALTY: f64 = 4.6;
/// χ² a pressed taxel more than parameters over which it is doubtful that a contact explains a touch: residuals of 2σ on average.
const MISFIT: f64 = 4.0;
/// What a force is off by for a layer that is not a Gaussian, as a share of it: the standard deviation over layers.
const LAYER_SHARE: f64 = 0.04;
/// A descent has come to rest when it could still lower χ² by this: parameters are within 0.1σ.
const AT_REST: f64 = 0.01;

/// A contact in the chart of its touch, as `docs/explanation/fit.md` has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) kind: ContactKind,
    /// Its middle (u, v), m; of a line the point nearest to the touch's centroid.
    pub(crate) place: [f64; 2],
    /// Its force, in N where P is in Pa, else in the unit of P; absent where it goes on beyond the sensors.
    pub(crate) force: Option<f64>,
    /// Its direction along, rad in [0, π); absent for a point.
    pub(crate) angle: Option<f64>,
    /// The standard deviation of its pressure across, at the sensors, m.
    pub(crate) width: f64,
    /// Of a segment from end to end, m; of a blob the standard deviation of its pressure along.
    pub(crate) length: Option<f64>,
    /// Standard deviations, where the noise of the sensors is known.
    pub(crate) sigma: Option<FitSigma>,
    /// Where the touch is, by the fit and by its moments.
    pub(crate) blended: Option<Place>,
}

/// The fits of a touch, or of several in lanes. Those with more parameters are made for touches with enough taxels.
#[derive(Clone, Copy)]
pub(crate) struct Fits<R> {
    point: Fitted<R, 4>,
    line: Fitted<R, 4>,
    long: Option<[Fitted<R, 6>; 2]>,
}

/// Fits all kinds to `sensors`, from `start`.
#[inline(always)]
pub(crate) fn fit<R: Real>(sensors: &[Sensor<R>], start: &Start<R>) -> Fits<R> {
    let (gains, steps) = (start.gain_variance, start.steps);
    let point = descend::<R, Point, 4>(sensors, gains, with_force::<R, Point, 4>(sensors, start.point), steps);
    let line = descend::<R, Line, 4>(sensors, gains, with_force::<R, Line, 4>(sensors, start.line), steps);
    let mut long = None;
    if start.is_long {
        // As much force as the line has on the segment's length.
        let force = line.shape.force + start.half_length + std::f64::consts::LN_2;
        let segment = Shape { force, length: start.half_length, ..line.shape };
        let blob = with_force::<R, Blob, 6>(sensors, start.blob);
        long = Some([
            descend::<R, Segment, 6>(sensors, gains, segment, steps),
            descend::<R, Blob, 6>(sensors, gains, blob, steps),
        ]);
    }
    Fits { point, line, long }
}

/// The same of one touch alone: compiled once, as it is long.
#[inline(never)]
pub(crate) fn fit_alone(sensors: &[Sensor<f64>], start: &Start<f64>) -> Fits<f64> {
    fit(sensors, start)
}

/// `shape`, which has a force of 1, with the force that explains the pressed sensors best.
#[inline(always)]
fn with_force<R: Real, M: Kind<K>, const K: usize>(sensors: &[Sensor<R>], shape: Shape<R>) -> Shape<R> {
    let (contact, zero) = (Contact::from_shape(&shape), shape.force.all(0.0));
    let (mut both, mut own) = (zero, shape.force.all(f64::MIN_POSITIVE));
    for sensor in sensors {
        let (felt, _) = M::felt(&contact, sensor.at, sensor.margin);
        let felt = R::choose(zero.is_below(sensor.pressed), felt, zero);
        both = both + R::choose(zero.is_below(sensor.pressed), felt * sensor.pressure, zero);
        own = own + felt * felt;
    }
    Shape { force: (both / own).at_least(f64::MIN_POSITIVE).ln(), ..shape }
}

impl<R: Copy> Fits<R> {
    /// Each number by `of`, as a lane's.
    pub(crate) fn map<T>(&self, of: impl Fn(R) -> T + Copy) -> Fits<T> {
        Fits {
            point: mapped(&self.point, of),
            line: mapped(&self.line, of),
            long: self.long.as_ref().map(|long| long.each_ref().map(|long| mapped(long, of))),
        }
    }
}

fn mapped<R: Copy, T, const K: usize>(fitted: &Fitted<R, K>, of: impl Fn(R) -> T + Copy) -> Fitted<T, K> {
    let Fitted { shape: Shape { place, along, force, width, length }, cost, chi_squared, ahead, covariance } = *fitted;
    Fitted {
        shape: Shape {
            place: place.map(of),
            along: along.map(of),
            force: of(force),
            width: of(width),
            length: of(length),
        },
        cost: of(cost),
        chi_squared: of(chi_squared),
        ahead: of(ahead),
        covariance: covariance.map(|row| row.map(of)),
    }
}

/// The fit of one kind.
struct Candidate {
    kind: ContactKind,
    parameters: usize,
    floor: f64,
    shape: Shape<f64>,
    cost: f64,
    chi_squared: f64,
    ahead: f64,
    /// By [`Parameter`]; 0 for what the kind does not have.
    variances: [f64; 6],
    /// Of across and along.
    shared: f64,
}

impl Candidate {
    fn from_fit<M: Kind<K>, const K: usize>(kind: ContactKind, fitted: &Fitted<f64, K>) -> Self {
        let free = M::FREE;
        let mut variances = [0.0; 6];
        for (k, parameter) in free.into_iter().enumerate() {
            variances[parameter as usize] = fitted.covariance[k][k];
        }
        let shared = if free[1] == Parameter::Along { fitted.covariance[1][0] } else { 0.0 };
        let &Fitted { shape, cost, chi_squared, ahead, .. } = fitted;
        Self { kind, parameters: K, floor: M::FLOOR, shape, cost, chi_squared, ahead, variances, shared }
    }

    fn variance(&self, parameter: Parameter) -> f64 {
        self.variances[parameter as usize]
    }

    /// What it makes the sensors of `touch` feel.
    fn felt(&self, touch: &Touch) -> Vec<f64> {
        let contact = Contact::from_shape(&self.shape);
        let felt = |&Sensor { at, margin, .. }: &Sensor<f64>| match self.kind {
            ContactKind::Point => Point::felt(&contact, at, margin).0,
            ContactKind::Line => Line::felt(&contact, at, margin).0,
            ContactKind::Segment => Segment::felt(&contact, at, margin).0,
            ContactKind::Blob => Blob::felt(&contact, at, margin).0,
        };
        touch.sensors().iter().map(felt).collect()
    }

    fn each(fits: &Fits<f64>) -> impl Iterator<Item = Self> {
        let short = [
            Self::from_fit::<Point, 4>(ContactKind::Point, &fits.point),
            Self::from_fit::<Line, 4>(ContactKind::Line, &fits.line),
        ];
        let long = fits.long.as_ref().map(|[segment, blob]| {
            [
                Self::from_fit::<Segment, 6>(ContactKind::Segment, segment),
                Self::from_fit::<Blob, 6>(ContactKind::Blob, blob),
            ]
        });
        short.into_iter().chain(long.into_iter().flatten())
    }
}

/// What the contact that explains a touch best makes its taxels feel.
pub(crate) struct Explained {
    /// By taxel, in the unit of P.
    pub(crate) felt: Vec<f64>,
    /// The standard deviation of its pressure at the sensors, across; of one that was to be a blob in the geometric mean of both ways.
    pub(crate) width_m: f64,
}

impl Touch {
    /// What the best of `fits`, or its blob, makes the taxels feel, however well it explains them: what they differ by may be their gains.
    pub(crate) fn explained(&self, fits: &Fits<f64>, as_blob: bool) -> Option<Explained> {
        let blob = Candidate::each(fits).find(|candidate| as_blob && candidate.kind == ContactKind::Blob);
        let best = blob.or_else(|| self.best(Some(fits)))?;
        if best.ahead > AT_REST || !self.reaches(DVec2::from_array(best.shape.place)) {
            return None;
        }
        let length = if as_blob && best.kind == ContactKind::Blob { best.shape.length } else { best.shape.width };
        let width_m = libm::exp(0.5 * (best.shape.width + length)) * self.unit_m;
        Some(Explained { felt: best.felt(self).into_iter().map(|felt| felt * self.peak).collect(), width_m })
    }

    /// The likeliest kind of those that the taxels are enough for; with few taxels a point, whose spread then is the prior's.
    fn best(&self, fits: Option<&Fits<f64>>) -> Option<Candidate> {
        let is_clear = |candidate: &Candidate| {
            self.pressed > candidate.parameters
                || (candidate.kind == ContactKind::Point && self.pressed >= LEAST_PRESSED)
        };
        let candidates = Candidate::each(fits?).filter(is_clear);
        let penalised = |candidate: &Candidate| {
            candidate.cost + self.width_of_floor(candidate.floor) + 2.0 * PENALTY * candidate.parameters as f64
        };
        candidates.min_by(|a, b| penalised(a).total_cmp(&penalised(b)))
    }

    /// Σ ln(D²/(D² − f²)), D and f as in the objective: a likelihood pays for the room that a floor gives.
    fn width_of_floor(&self, floor: f64) -> f64 {
        let pressed = self.sensors().iter().filter(|sensor| sensor.pressed > 0.0);
        let without = |sensor: &Sensor<f64>| sensor.variance + self.gain_variance() * sensor.pressure * sensor.pressure;
        pressed.map(|sensor| libm::log1p(floor * floor / without(sensor))).sum()
    }

    /// The fit of the touch that `fits` were made for, if enough taxels are pressed; the flags say why something is absent or
    /// doubtful.
    pub(crate) fn conclude(&self, fits: Option<&Fits<f64>>) -> (Option<Fit>, TouchFlags) {
        let Some(best) = self.best(fits) else { return (None, TouchFlags::FEW_TAXELS) };
        if !best.chi_squared.is_finite() {
            return (None, TouchFlags::POOR_FIT);
        }
        let spare = self.pressed as f64 - best.parameters as f64;
        // Of a descent that is cut short there is less to ask.
        let explains = self.steps < 2 || best.chi_squared <= MISFIT * spare.max(1.0);
        let rests = self.steps < STEPS || best.ahead <= AT_REST;
        let (fit, mut flags) = self.checked(&best);
        flags.set(TouchFlags::POOR_FIT, !(explains && rests));
        flags.set(TouchFlags::FEW_TAXELS, spare <= 0.0);
        (fit, flags)
    }

    fn checked(&self, best: &Candidate) -> (Option<Fit>, TouchFlags) {
        let Shape { place, along, force, width, length } = best.shape;
        let (mut place, along) = (DVec2::from_array(place), DVec2::from_array(along));
        let (half, is_line) = (libm::exp(length), best.kind == ContactKind::Line);
        if is_line {
            // The point of the line that is nearest to the touch's mean, which is the origin.
            place -= along * place.dot(along);
        }
        if !self.reaches(place) {
            return (None, TouchFlags::OFF_SKIN);
        }
        let ends =
            if best.kind == ContactKind::Segment { [place - along * half, place + along * half] } else { [place; 2] };
        let is_whole = !is_line && ends.into_iter().all(|end| self.reaches(end));
        let force = libm::exp(force) * self.peak;
        let [across, lengthwise] = [Parameter::Across, Parameter::Along].map(|parameter| best.variance(parameter));
        let sides = DVec2::new(-along.y, along.x);
        // Of a line only what it is off across.
        let place_variance = sides * sides * across + along * along * lengthwise + 2.0 * sides * along * best.shared;
        // What the contact does not explain says that all of it is known less well.
        let spare = (self.pressed as f64 - best.parameters as f64).max(1.0);
        let widened = (best.chi_squared / spare).max(1.0);
        // Of what has a logarithm as its parameter the standard deviation is a share.
        let share_of = |parameter: Parameter| (widened * best.variance(parameter)).sqrt();
        let length = match best.kind {
            ContactKind::Point | ContactKind::Line => None,
            ContactKind::Segment => is_whole.then_some(2.0 * half * self.unit_m),
            ContactKind::Blob => Some(half * self.unit_m),
        };
        let width = libm::exp(width) * self.unit_m;
        let variance = (place_variance * widened).max(DVec2::ZERO);
        let sigma = FitSigma {
            place: (variance.map(f64::sqrt) * self.unit_m).to_array(),
            force: force * share_of(Parameter::Force).hypot(LAYER_SHARE),
            angle: share_of(Parameter::Turn),
            width: width * share_of(Parameter::Width),
            length: length.unwrap_or(0.0) * share_of(Parameter::Length),
        };
        let felt = best.felt(self);
        let line = is_line.then_some(along);
        let fit = Fit {
            blended: self.blended(PlaceOfFit { felt: &felt, place, variance, floor: best.floor, line }),
            kind: best.kind,
            place: (place * self.unit_m + self.origin).to_array(),
            force: is_whole.then_some(force),
            angle: (best.kind != ContactKind::Point).then(|| angle::of_line(along.x, along.y)),
            width,
            length,
            sigma: self.has_noise.then_some(sigma),
        };
        (Some(fit), if is_whole { TouchFlags::empty() } else { TouchFlags::OFF_SKIN })
    }
}
