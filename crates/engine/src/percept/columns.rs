//! Every output, once: its name, unit, shape, stage and where its numbers are kept.
//!
//! Batches, sinks, the live table, dumps, device readback and the comparison with the reference go by [`COLUMNS`]. A new
//! output is a row here, and its formulas and bound in its stage's files.

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};
use serde::Serialize;

use super::Flags;
use super::typed::Typed;

/// An output as data.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Column {
    /// Its bit.
    pub output: Outputs,
    /// As `--outputs` and NDJSON spell it.
    pub name: &'static str,
    /// What it is measured in.
    pub unit: Unit,
    /// Numbers of a value: 1, 2 (along u and v) or 3 (x, y and z).
    pub components: usize,
    /// How two values of it are compared.
    pub measure: Measure,
    /// The stage that makes it, as in `crates/engine/src/stage`.
    pub stage: &'static str,
    /// What it is, in a line.
    pub help: &'static str,
    /// Where its components are kept.
    #[doc(hidden)]
    pub store: Store,
    /// What shaders call the override that says in which of a device's columns it is.
    pub(crate) shader_override: &'static str,
}

/// What an output is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// The unit of P, as the calibration has it.
    P,
    /// N where P is in Pa, else the unit of P: what a force is in.
    Force,
    /// None: a number, a part or a direction in space.
    One,
    /// m.
    Metre,
    /// m².
    SquareMetre,
    /// rad.
    Radian,
    /// m/s.
    MetrePerSecond,
    /// N.
    Newton,
    /// Pa.
    Pascal,
    /// The unit of P times m.
    PMetre,
    /// °C.
    Celsius,
    /// K/m.
    KelvinPerMetre,
    /// K/s.
    KelvinPerSecond,
    /// None: a [`super::ContactKind`], which data files name.
    Kind,
}

impl Unit {
    /// As data files spell it.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::P => "P",
            Self::Force => "P or N",
            Self::One | Self::Kind => "1",
            Self::Metre => "m",
            Self::SquareMetre => "m²",
            Self::Radian => "rad",
            Self::MetrePerSecond => "m/s",
            Self::Newton => "N",
            Self::Pascal => "Pa",
            Self::PMetre => "P m",
            Self::Celsius => "°C",
            Self::KelvinPerMetre => "K/m",
            Self::KelvinPerSecond => "K/s",
        }
    }
}

/// How far two values of an output are apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Their difference.
    Number,
    /// The angle between two lines, at most π/2.
    Line,
    /// The angle between two directions, at most π.
    Direction,
    /// Their distance.
    Vector,
    /// Their distance, each coordinate having a bound of its own.
    Place,
}

/// Where an output's components are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Store {
    /// Among the counts of pressed taxels.
    Active,
    /// One part each, in the precision of the backend.
    Backend(&'static [Component]),
    /// Side by side, in double precision on every backend.
    Host(Host),
}

/// Makes, of one row an output, what is typed: the outputs' bits, the percept's fields, and where numbers are kept.
macro_rules! columns {
    ($(
        #[doc = $help:literal]
        $output:ident $bit:literal $name:ident: $type:ty, $unit:ident, $measure:ident, $stage:ident,
            parts [$($part:ident)*] host [$($host:ident)?];
    )*) => {
        bitflags! {
            /// Quantities a percept can hold: what is asked for, and what is present.
            #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
            #[repr(transparent)]
            pub struct Outputs: u64 {
                $(#[doc = $help] const $output = 1 << $bit;)*
                /// Touches of two links at one place in the world, each with an identity; only on request. With them touches are
                /// looked for.
                const SELF_CONTACTS = 1 << 37;
            }
        }

        /// One field's percept for one frame. Lengths in metres, angles in radians.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize)]
        #[non_exhaustive]
        pub struct Percept {
            /// Index of the field, as [`Plan::fields`](crate::scene::Plan::fields) counts: once for each letter.
            pub field: usize,
            /// Which of the run's letters it is of, as [`Plan::letters`](crate::scene::Plan::letters) counts.
            pub letter: usize,
            /// Whether the field is touched.
            pub contact: bool,
            $(
                #[doc = $help]
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $name: Option<$type>,
            )*
            /// Why quantities are absent, or in doubt.
            pub flags: Flags,
            /// Whether position and normal are in the world (or in [`Scene::relative_to`](crate::scene::Scene::relative_to)), because the
            /// frame carried a pose, or in the field's anchor.
            pub in_world: bool,
        }

        impl Percept {
            /// A percept that has every quantity for which `read` gives components.
            pub(super) fn with(
                (field, letter): (usize, usize),
                flags: Flags,
                in_world: bool,
                read: impl Fn(&'static Column) -> Option<[f64; 3]>,
            ) -> Self {
                let mut columns = COLUMNS.iter();
                let mut next = || columns.next().and_then(&read);
                Self {
                    field,
                    letter,
                    contact: !flags.contains(Flags::NO_CONTACT),
                    $($name: next().map(Typed::from_components),)*
                    flags,
                    in_world,
                }
            }

            /// The quantity of `column`, its components first, if it is present.
            #[must_use]
            pub fn value(&self, column: &Column) -> Option<[f64; 3]> {
                match column.output {
                    $(Outputs::$output => self.$name.map(Typed::components),)*
                    _ => None,
                }
            }
        }

        /// One component of an output that backends write, or what stages keep beside the outputs.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Component {
            $($(#[doc = concat!("A part of ", stringify!($output), ".")] $part,)*)*
            /// The centroid's third coordinate, for positions.
            CentroidDepth,
        }

        impl Component {
            /// All of them, in their order.
            pub(crate) const ALL: &'static [Self] = &[$($(Self::$part,)*)* Self::CentroidDepth];
            pub(crate) const COUNT: usize = Self::ALL.len();

            /// The column that it is a component of; none for what is kept beside the outputs.
            pub(crate) const fn column(self) -> Option<&'static Column> {
                match self {
                    $($(Self::$part => Some(&Column::$output),)*)*
                    Self::CentroidDepth => None,
                }
            }
        }

        /// An output that the host makes in double precision.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Host {
            $($(#[doc = concat!(stringify!($host), ".")] $host,)?)*
        }

        impl Host {
            pub(crate) const ALL: &'static [Self] = &[$($(Self::$host,)?)*];
            pub(crate) const COUNT: usize = Self::ALL.len();

            pub(crate) const fn column(self) -> &'static Column {
                match self {
                    $($(Self::$host => &Column::$output,)?)*
                }
            }
        }

        impl Column {
            $(pub(crate) const $output: Self = Self {
                output: Outputs::$output,
                name: stringify!($name),
                unit: Unit::$unit,
                components: size_of::<$type>().div_ceil(size_of::<f64>()),
                measure: Measure::$measure,
                stage: stringify!($stage),
                help: $help,
                store: store(&[$(Component::$part),*], &[$(Host::$host)?]),
                shader_override: concat!(stringify!($output), "_AT"),
            };)*
        }

        /// Every output but [`Outputs::SELF_CONTACTS`], which are a table of their own.
        pub const COLUMNS: &[Column] = &[$(Column::$output),*];
    };
}

const fn store(parts: &'static [Component], host: &'static [Host]) -> Store {
    match (parts, host) {
        ([], []) => Store::Active,
        ([], [host, ..]) => Store::Host(*host),
        (parts, _) => Store::Backend(parts),
    }
}

columns! {
    #[doc = "S = Σ wᵢPᵢ, in the unit of P."]
    TOTAL 0 total: f64, P, Number, contact, parts [Total] host [];
    #[doc = "max Pᵢ, in the unit of P."]
    PEAK 1 peak: f64, P, Number, contact, parts [Peak] host [];
    #[doc = "Number of taxels with P > 0."]
    ACTIVE 2 active: u32, One, Number, contact, parts [] host [];
    #[doc = "Summed area of the taxels with P > 0, m²."]
    AREA 3 area: f64, SquareMetre, Number, contact, parts [Area] host [];
    #[doc = "Pressure-weighted mean (u, v) in the field's chart, m (eq. 1–2)."]
    CENTROID 4 centroid: [f64; 2], Metre, Place, centroid, parts [CentroidU CentroidV] host [];
    #[doc = "The same point on the surface, m; for a field without a chart the pressure-weighted mean."]
    POSITION 5 position: [f64; 3], Metre, Vector, position, parts [] host [Position];
    #[doc = "The outward unit normal there."]
    NORMAL 6 normal: [f64; 3], One, Vector, position, parts [] host [Normal];
    #[doc = "Angle of the line through the two farthest points, rad in [0, π) (eq. 9–19)."]
    ORIENTATION 7 orientation: f64, Radian, Line, orientation, parts [Orientation] host [];
    #[doc = "Principal axis of the pressure-weighted second moments, rad in [0, π)."]
    PRINCIPAL_AXIS 8 principal_axis: f64, Radian, Line, principal_axis, parts [PrincipalAxis] host [];
    #[doc = "(λ₁ − λ₂)/(λ₁ + λ₂) of those moments, in [0, 1]."]
    ANISOTROPY 9 anisotropy: f64, One, Number, principal_axis, parts [Anisotropy] host [];
    #[doc = "(Δu, Δv) of the centroid since the frame before, m (eq. 3–4)."]
    DISPLACEMENT 10 displacement: [f64; 2], Metre, Vector, motion, parts [DisplacementU DisplacementV] host [];
    #[doc = "Its direction, rad in (−π, π] (eq. 5)."]
    DIRECTION 11 direction: f64, Radian, Direction, motion, parts [Direction] host [];
    #[doc = "Its length, m."]
    DISTANCE 12 distance: f64, Metre, Number, motion, parts [Distance] host [];
    #[doc = "Change of the centroid's distance from the chart's origin, m (eq. 6–7): blind to motion around it."]
    RADIAL_DISTANCE 13 radial_distance: f64, Metre, Number, motion, parts [RadialDistance] host [];
    #[doc = "Distance over time, m/s."]
    SPEED 14 speed: f64, MetrePerSecond, Number, motion, parts [Speed] host [];
    #[doc = "Radial distance over time, m/s (eq. 8)."]
    RADIAL_SPEED 15 radial_speed: f64, MetrePerSecond, Number, motion, parts [RadialSpeed] host [];
    #[doc = "How fast the position moves in the world (or in --relative-to LINK), over the skin and with its link, m/s; only on request."]
    SPEED_IN_WORLD 38 speed_in_world: f64, MetrePerSecond, Number, world_motion, parts [] host [SpeedInWorld];
    #[doc = "(Δu, Δv) since the last centroid that counted, m, where this one counts too; only on request, as is all filtered motion."]
    FILTERED_DISPLACEMENT 17 filtered_displacement: [f64; 2], Metre, Vector, filter, parts [] host [FilteredDisplacement];
    #[doc = "The direction of such steps, averaged over time, rad in (−π, π]."]
    FILTERED_DIRECTION 18 filtered_direction: f64, Radian, Direction, filter, parts [] host [FilteredDirection];
    #[doc = "The length of such a step over the time that it took, m/s."]
    FILTERED_SPEED 19 filtered_speed: f64, MetrePerSecond, Number, filter, parts [] host [FilteredSpeed];
    #[doc = "Force in newtons, unweighted: Σ PᵢAᵢ where P is in Pa, Σ Pᵢ where it is in N; given by default where the calibration has a unit."]
    FORCE 20 force: f64, Newton, Number, force, parts [] host [Force];
    #[doc = "The standard deviation of the total by the sensors' noise, in the unit of P; only on request, as are all sigmas."]
    TOTAL_SIGMA 30 total_sigma: f64, P, Number, sigma, parts [] host [TotalSigma];
    #[doc = "The standard deviations of the centroid by the sensors' noise, along u and v, m."]
    CENTROID_SIGMA 31 centroid_sigma: [f64; 2], Metre, Vector, sigma, parts [] host [CentroidSigma];
    #[doc = "The standard deviation of the principal axis by the sensors' noise, rad."]
    PRINCIPAL_AXIS_SIGMA 32 principal_axis_sigma: f64, Radian, Number, sigma, parts [] host [PrincipalAxisSigma];
    #[doc = "s = Σ wᵢsᵢ over the pressed taxels, along u and v of the field's chart."]
    SHEAR 39 shear: [f64; 2], P, Vector, shear, parts [] host [Shear];
    #[doc = "Its direction, rad in (−π, π]."]
    SHEAR_DIRECTION 40 shear_direction: f64, Radian, Direction, shear, parts [] host [ShearDirection];
    #[doc = "The same sum in space, each taxel's along its own tangents."]
    SHEAR_VECTOR 41 shear_vector: [f64; 3], P, Vector, shear, parts [] host [ShearVector];
    #[doc = "The force on the skin, normal and tangential, unweighted, N."]
    FORCE_VECTOR 42 force_vector: [f64; 3], Newton, Vector, shear, parts [] host [ForceVector];
    #[doc = "Σ wᵢ(xᵢ − c) × sᵢ · n about the centroid c: how the touch twists, counter-clockwise seen from outside."]
    TORSION 43 torsion: f64, PMetre, Number, shear, parts [] host [Torsion];
    #[doc = "‖s‖ / Σ wᵢPᵢ over the taxels whose sᵢ is known; without a chart Σ wᵢ‖sᵢ‖ / Σ wᵢPᵢ."]
    FRICTION 44 friction: f64, One, Number, shear, parts [] host [Friction];
    #[doc = "The standard deviation of the friction by the sensors' noise; only on request."]
    FRICTION_SIGMA 45 friction_sigma: f64, One, Number, shear, parts [] host [FrictionSigma];
    #[doc = "Friction over that at which it slips, if the calibration has slips_at: a slip begins at 0.95."]
    SLIP_RATIO 62 slip_ratio: f64, One, Number, shear, parts [] host [SlipRatio];
    #[doc = "Weighted mean of the temperatures, °C."]
    TEMPERATURE 46 temperature: f64, Celsius, Number, temperature, parts [] host [Temperature];
    #[doc = "The highest temperature, °C."]
    WARMEST 47 warmest: f64, Celsius, Number, temperature, parts [] host [Warmest];
    #[doc = "The id of the taxel that has it."]
    WARMEST_TAXEL 48 warmest_taxel: u32, One, Number, temperature, parts [] host [WarmestTaxel];
    #[doc = "Where that is, m."]
    WARMEST_POSITION 49 warmest_position: [f64; 3], Metre, Vector, temperature, parts [] host [WarmestPosition];
    #[doc = "The lowest temperature, °C."]
    COLDEST 50 coldest: f64, Celsius, Number, temperature, parts [] host [Coldest];
    #[doc = "The id of the taxel that has it."]
    COLDEST_TAXEL 51 coldest_taxel: u32, One, Number, temperature, parts [] host [ColdestTaxel];
    #[doc = "Where that is, m."]
    COLDEST_POSITION 52 coldest_position: [f64; 3], Metre, Vector, temperature, parts [] host [ColdestPosition];
    #[doc = "How the temperature rises along u and v, by a plane of least squares, K/m."]
    TEMPERATURE_GRADIENT 53 temperature_gradient: [f64; 2], KelvinPerMetre, Vector, temperature, parts [] host [TemperatureGradient];
    #[doc = "How fast the mean rises, by a line of least squares over window_s of the calibration, K/s."]
    TEMPERATURE_RATE 54 temperature_rate: f64, KelvinPerSecond, Number, temperature, parts [] host [TemperatureRate];
    #[doc = "The least distance, m."]
    NEAREST 55 nearest: f64, Metre, Number, proximity, parts [] host [Nearest];
    #[doc = "The id of the taxel that has it."]
    NEAREST_TAXEL 56 nearest_taxel: u32, One, Number, proximity, parts [] host [NearestTaxel];
    #[doc = "Where that taxel is, m."]
    NEAREST_POSITION 57 nearest_position: [f64; 3], Metre, Vector, proximity, parts [] host [NearestPosition];
    #[doc = "The outward unit normal there."]
    NEAREST_NORMAL 58 nearest_normal: [f64; 3], One, Vector, proximity, parts [] host [NearestNormal];
    #[doc = "How fast the least distance falls, by a line of least squares over window_s of the calibration, m/s."]
    APPROACH_SPEED 59 approach_speed: f64, MetrePerSecond, Number, proximity, parts [] host [ApproachSpeed];
    #[doc = "Number of taxels with something in range."]
    COVERED 60 covered: u32, One, Number, proximity, parts [] host [Covered];
    #[doc = "Mean (u, v) of these taxels in the field's chart, each weighing 1/d², m."]
    PROXIMITY_CENTROID 61 proximity_centroid: [f64; 2], Metre, Vector, proximity, parts [] host [ProximityCentroid];
}

impl Column {
    #[cfg(feature = "gpu")]
    pub(crate) fn shader_constant(&self) -> String {
        self.name.to_uppercase()
    }

    /// Whether its values are whole numbers: counts, and ids of taxels.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        Outputs::WHOLE.contains(self.output)
    }

    /// Whether it is in double precision on every backend.
    #[must_use]
    pub fn is_double(&self) -> bool {
        matches!(self.store, Store::Host(_))
    }
}

impl Component {
    /// The outputs that it is made for: its own, and those that later stages make of it.
    pub(crate) fn wanted_for(self) -> Outputs {
        const PLACE: Outputs = Outputs::of_stage("position").union(Outputs::SPEED_IN_WORLD);
        let own = self.column().map_or(Outputs::empty(), |column| column.output);
        match self {
            Self::CentroidU | Self::CentroidV | Self::CentroidDepth => own | PLACE,
            _ => own,
        }
    }

    /// The outputs that it is kept for: also motion, which is made of centroids.
    pub(crate) fn kept_for(self) -> Outputs {
        match self {
            Self::CentroidU | Self::CentroidV => self.wanted_for() | Outputs::MOTION,
            _ => self.wanted_for(),
        }
    }

    /// Whether it is a length, or a length a second: backends count it in the field's own unit of length.
    #[cfg(feature = "gpu")]
    pub(crate) fn is_length(self) -> bool {
        self.column().is_none_or(|column| matches!(column.unit, Unit::Metre | Unit::MetrePerSecond))
    }
}
