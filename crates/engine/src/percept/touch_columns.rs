//! Every quantity of touches of the whole body, once: its name, unit and shape.
//!
//! Sinks, tables and Python go by [`TOUCH_COLUMNS`]. A new quantity is a row here, and its formula in `crates/engine/src/touch`.

use bitflags::bitflags;
use glam::DVec3;

use super::{ContactKind, FitSigma, Touch, TouchFit, Unit};

bitflags! {
    /// Quantities of touches: what is asked for. Identity, age, link and flags are always there.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct TouchOutputs: u64 {
        /// ΣP over its taxels.
        const TOTAL = 1 << 0;
        /// Its force.
        const FORCE = 1 << 1;
        /// The largest P.
        const PEAK = 1 << 2;
        /// Its force over its area.
        const MEAN_PRESSURE = 1 << 3;
        /// Number of its taxels.
        const ACTIVE = 1 << 4;
        /// Summed area of its taxels.
        const AREA = 1 << 5;
        /// Where it is on the skin.
        const POSITION = 1 << 6;
        /// The mean of its taxels' positions, without weights.
        const CENTRE = 1 << 7;
        /// The outward normal at its position.
        const NORMAL = 1 << 8;
        /// The principal axis of its second moments, as a vector and as an angle in its own chart.
        const PRINCIPAL_AXIS = 1 << 9;
        /// How unlike its moments along and across that axis are.
        const ANISOTROPY = 1 << 10;
        /// Standard deviation along and across that axis.
        const SPREAD = 1 << 11;
        /// The line through its two farthest points, as a vector and as an angle in its own chart; only on request.
        const ORIENTATION = 1 << 12;
        /// How fast its position moves on the skin.
        const VELOCITY = 1 << 13;
        /// All links that it lies on, with their shares of its total.
        const LINKS = 1 << 14;
        /// The fields that hold parts of it, with their shares of its total.
        const FIELDS = 1 << 15;
        /// The ids of its taxels; only on request.
        const TAXELS = 1 << 16;
        /// Force and torque on each link that it lies on; only on request.
        const WRENCH = 1 << 17;
        /// What kind of contact presses: point, line, segment or blob; only on request, as is all of the fit.
        const FIT_KIND = 1 << 18;
        /// Where it presses.
        const FIT_PLACE = 1 << 19;
        /// How hard it presses in all.
        const FIT_FORCE = 1 << 20;
        /// Its direction along.
        const FIT_DIRECTION = 1 << 21;
        /// The standard deviation of its pressure across.
        const FIT_WIDTH = 1 << 22;
        /// How long it is.
        const FIT_LENGTH = 1 << 23;
        /// The standard deviations of all of these.
        const FIT_SIGMAS = 1 << 24;
        /// How fast that moves on the skin.
        const FIT_VELOCITY = 1 << 25;
        /// The standard deviation of its total; only on request, as the next two.
        const TOTAL_SIGMA = 1 << 26;
        /// The standard deviation of its position along u and v of its chart.
        const POSITION_SIGMA = 1 << 27;
        /// The standard deviation of its principal axis.
        const PRINCIPAL_AXIS_SIGMA = 1 << 28;
        /// Where it is by its fit and by its moments; only on request.
        const PLACE = 1 << 29;
        /// How it pulls along the skin: shear, force as a vector, torsion and friction; given by default where taxels have three axes.
        const SHEAR = 1 << 30;
        /// How warm the taxels under it are, mean, extremes, gradient and rate; given by default where some measure temperature.
        const TEMPERATURE = 1 << 31;
        /// The standard deviation of its friction; only on request.
        const FRICTION_SIGMA = 1 << 32;
    }
}

impl Default for TouchOutputs {
    fn default() -> Self {
        Self::USUAL
    }
}

impl TouchOutputs {
    /// What is given unless more is asked for.
    pub const USUAL: Self = Self::all()
        .difference(Self::ORIENTATION)
        .difference(Self::TAXELS)
        .difference(Self::WRENCH)
        .difference(Self::FIT)
        .difference(Self::SIGMAS)
        .difference(Self::FRICTION_SIGMA)
        .difference(Self::SHEAR)
        .difference(Self::TEMPERATURE);

    /// What is made of fits.
    pub const FIT: Self = Self::FIT_KIND
        .union(Self::FIT_PLACE)
        .union(Self::FIT_FORCE)
        .union(Self::FIT_DIRECTION)
        .union(Self::FIT_WIDTH)
        .union(Self::FIT_LENGTH)
        .union(Self::FIT_SIGMAS)
        .union(Self::FIT_VELOCITY)
        .union(Self::PLACE);

    /// Standard deviations of what is made of pressures and not of fits.
    pub const SIGMAS: Self = Self::TOTAL_SIGMA.union(Self::POSITION_SIGMA).union(Self::PRINCIPAL_AXIS_SIGMA);

    /// The names as `--outputs touches.NAME` and NDJSON spell them, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }

    /// The one called `name`, if there is one.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        (name == name.to_lowercase()).then(|| Self::from_name(&name.to_uppercase())).flatten()
    }

    /// The columns of these, in the table's order.
    pub fn columns(self) -> impl Iterator<Item = &'static TouchColumn> {
        TOUCH_COLUMNS.iter().filter(move |column| self.contains(column.output))
    }
}

/// A quantity of a touch that is one number, or two or three of one kind.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct TouchColumn {
    /// What asks for it.
    pub output: TouchOutputs,
    /// As NDJSON and tables spell it.
    pub name: &'static str,
    /// What it is measured in.
    pub unit: Unit,
    /// Numbers of a value: 1, 2 (along and across, or along u and v) or 3 (x, y and z).
    pub components: usize,
    /// What it is, in a line.
    pub help: &'static str,
    value: fn(&Touch) -> Option<[f64; 3]>,
}

impl TouchColumn {
    /// Whether it is a whole number: a count, or the id of a taxel.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.output == TouchOutputs::ACTIVE || self.name.ends_with("_taxel")
    }

    /// The quantity of `touch`, its components first, if it is present.
    #[must_use]
    pub fn value(&self, touch: &Touch) -> Option<[f64; 3]> {
        (self.value)(touch)
    }
}

const fn one(number: f64) -> Option<[f64; 3]> {
    Some([number, 0.0, 0.0])
}

fn one_of(number: Option<f64>) -> Option<[f64; 3]> {
    number.and_then(one)
}

fn vector(vector: Option<DVec3>) -> Option<[f64; 3]> {
    vector.map(|vector| vector.to_array())
}

fn sigma(touch: &Touch) -> Option<FitSigma> {
    touch.fit?.sigma
}

fn has(touch: &Touch, of: impl FnOnce(TouchFit) -> Option<f64>) -> bool {
    touch.fit.and_then(of).is_some()
}

/// Rows of the table: output, name, unit, components, help, value.
macro_rules! touch_columns {
    ($($output:ident $name:literal $unit:ident $components:literal $help:literal $value:expr;)*) => {
        /// Every quantity of touches that is a number or a vector, in the order in which they are given.
        pub const TOUCH_COLUMNS: &[TouchColumn] = &[$(TouchColumn {
            output: TouchOutputs::$output,
            name: $name,
            unit: Unit::$unit,
            components: $components,
            help: $help,
            value: $value,
        }),*];
    };
}

touch_columns! {
    TOTAL "total" P 1 "ΣP over its taxels, in the unit of P." |touch| one(touch.total);
    FORCE "force" Newton 1 "ΣPA where P is a pressure, ΣP where it is a force, N." |touch| one_of(touch.force_newton);
    PEAK "peak" P 1 "The largest P, in the unit of P." |touch| one(touch.peak);
    MEAN_PRESSURE "mean_pressure" Pascal 1 "Force over area, Pa." |touch| one_of(touch.mean_pressure_pascal);
    ACTIVE "active" One 1 "Number of its taxels." |touch| one(touch.active as f64);
    AREA "area" SquareMetre 1 "Summed area of its taxels, m²." |touch| one_of(touch.area_m2);
    POSITION "position" Metre 3 "The point of the skin nearest to the weighted mean of its taxels, m." |touch| vector(Some(touch.position));
    CENTRE "centre" Metre 3 "The mean of its taxels' positions, without weights, m." |touch| vector(Some(touch.centre));
    NORMAL "normal" One 3 "The outward unit normal at its position." |touch| vector(Some(touch.normal));
    PRINCIPAL_AXIS "principal_axis" One 3 "Unit vector along the principal axis of its second moments." |touch| vector(touch.principal_axis);
    PRINCIPAL_AXIS "principal_axis_angle" Radian 1 "The same as an angle in its own chart, rad in [0, π)." |touch| one_of(touch.principal_axis_rad);
    ANISOTROPY "anisotropy" One 1 "(λ₁ − λ₂)/(λ₁ + λ₂) of those moments, in [0, 1]." |touch| one_of(touch.anisotropy);
    SPREAD "spread" Metre 2 "Standard deviation along and across that axis, m." |touch| touch.spread_m.map(|[along, across]| [along, across, 0.0]);
    ORIENTATION "orientation" One 3 "Unit vector along the line through its two farthest points; only on request." |touch| vector(touch.orientation);
    ORIENTATION "orientation_angle" Radian 1 "The same as an angle in its own chart, rad in [0, π)." |touch| one_of(touch.orientation_rad);
    VELOCITY "velocity" MetrePerSecond 3 "Change of the position on the skin over 0.2 s, m/s." |touch| vector(touch.velocity);
    PLACE "place" Metre 3 "The best estimate of where it is: its position and that of its fit, each weighted by how sure it is." |touch| vector(touch.place);
    PLACE "place_sigma" Metre 2 "The standard deviation of that along u and v of the touch's chart." |touch| touch.place_sigma_m.map(|[u, v]| [u, v, 0.0]);
    FIT_KIND "fit_kind" Kind 1 "What kind of contact presses: point, line, segment or blob." |touch| one_of(touch.fit.and_then(|fit| ContactKind::ALL.iter().position(|kind| *kind == fit.kind)).map(|kind| kind as f64));
    FIT_PLACE "fit_place" Metre 3 "Where it presses, on the skin; of a line the point nearest to the touch's mean." |touch| vector(touch.fit.map(|fit| fit.place));
    FIT_SIGMAS "fit_place_sigma" Metre 2 "The standard deviation of that along u and v of the touch's chart." |touch| sigma(touch).map(|sigma| [sigma.place[0], sigma.place[1], 0.0]);
    FIT_FORCE "fit_force" Force 1 "Total contact force, including between taxels; absent if the contact extends beyond the sensors." |touch| one_of(touch.fit.and_then(|fit| fit.force));
    FIT_SIGMAS "fit_force_sigma" Force 1 "The standard deviation of that." |touch| one_of(sigma(touch).filter(|_| has(touch, |fit| fit.force)).map(|sigma| sigma.force));
    FIT_DIRECTION "fit_direction" One 3 "Unit vector along it; absent for a point." |touch| vector(touch.fit.and_then(|fit| fit.direction));
    FIT_DIRECTION "fit_angle" Radian 1 "The same as an angle in the touch's chart, rad in [0, π)." |touch| one_of(touch.fit.and_then(|fit| fit.angle_rad));
    FIT_SIGMAS "fit_angle_sigma" Radian 1 "The standard deviation of that." |touch| one_of(sigma(touch).filter(|_| has(touch, |fit| fit.angle_rad)).map(|sigma| sigma.angle));
    FIT_WIDTH "fit_width" Metre 1 "The standard deviation of its pressure across, at the sensors." |touch| one_of(touch.fit.map(|fit| fit.width_m));
    FIT_SIGMAS "fit_width_sigma" Metre 1 "The standard deviation of that." |touch| one_of(sigma(touch).map(|sigma| sigma.width));
    FIT_LENGTH "fit_length" Metre 1 "How long a segment is; of a blob the standard deviation of its pressure along." |touch| one_of(touch.fit.and_then(|fit| fit.length_m));
    FIT_SIGMAS "fit_length_sigma" Metre 1 "The standard deviation of that." |touch| one_of(sigma(touch).filter(|_| has(touch, |fit| fit.length_m)).map(|sigma| sigma.length));
    FIT_VELOCITY "fit_velocity" MetrePerSecond 3 "Change of the place of the fit on the skin over 0.2 s, m/s; of a line only across it." |touch| vector(touch.fit.and_then(|fit| fit.velocity));
    TOTAL_SIGMA "total_sigma" P 1 "The standard deviation of its total, from the sensors' noise." |touch| one_of(touch.total_sigma);
    POSITION_SIGMA "position_sigma" Metre 2 "The standard deviation of its position along u and v of its own chart, m." |touch| touch.position_sigma_m.map(|[u, v]| [u, v, 0.0]);
    PRINCIPAL_AXIS_SIGMA "principal_axis_sigma" Radian 1 "The standard deviation of its principal axis, rad." |touch| one_of(touch.principal_axis_sigma_rad);
    SHEAR "shear" P 3 "Σws over its taxels that have three axes, w as in its position, in the unit of its total." |touch| vector(touch.shear);
    SHEAR "shear_in_chart" P 2 "The same along u and v of its own chart, each turned into that with its taxel's normal." |touch| touch.shear_in_chart.map(|[u, v]| [u, v, 0.0]);
    SHEAR "shear_direction" Radian 1 "The same as an angle in its own chart, rad in (−π, π]." |touch| one_of(touch.shear_direction_rad);
    SHEAR "force_vector" Newton 3 "The force on the skin by its taxels, normal and, of three axes, tangential, N." |touch| vector(touch.force_vector_newton);
    SHEAR "torsion" PMetre 1 "Σw(x − c) × s · n about the mean c of those taxels, counter-clockwise seen from outside." |touch| one_of(touch.torsion);
    SHEAR "friction" One 1 "‖Σws‖ / ΣwP of those taxels, each s turned into its own chart." |touch| one_of(touch.friction);
    SHEAR "slip_ratio" One 1 "Friction over that at which it slips, slips_at of the calibration: a slip begins at 0.95." |touch| one_of(touch.slip_ratio);
    FRICTION_SIGMA "friction_sigma" One 1 "The standard deviation of its friction, from the sensors' noise." |touch| one_of(touch.friction_sigma);
    TEMPERATURE "temperature" Celsius 1 "Mean of the temperature taxels whose nearest pressure taxel (same side of the same link, within 1.5 cell widths) is one of its, °C." |touch| one_of(touch.temperature_celsius);
    TEMPERATURE "warmest" Celsius 1 "The highest temperature of these, °C." |touch| one_of(touch.warmest_celsius);
    TEMPERATURE "warmest_taxel" One 1 "The id of the taxel that has it." |touch| one_of(touch.warmest_taxel.map(f64::from));
    TEMPERATURE "warmest_position" Metre 3 "Where that is, m." |touch| vector(touch.warmest_position);
    TEMPERATURE "coldest" Celsius 1 "The lowest temperature of these, °C." |touch| one_of(touch.coldest_celsius);
    TEMPERATURE "coldest_taxel" One 1 "The id of the taxel that has it." |touch| one_of(touch.coldest_taxel.map(f64::from));
    TEMPERATURE "coldest_position" Metre 3 "Where that is, m." |touch| vector(touch.coldest_position);
    TEMPERATURE "temperature_gradient" KelvinPerMetre 2 "Gradient of their temperature along u and v of its own chart, K/m." |touch| touch.temperature_gradient_kelvin_per_m.map(|[u, v]| [u, v, 0.0]);
    TEMPERATURE "temperature_rate" KelvinPerSecond 1 "How fast that mean changes, over the window of the calibration, K/s." |touch| one_of(touch.temperature_rate_kelvin_per_s);
}
