//! The touches of one frame.

use bitflags::bitflags;
use glam::DVec3;

use super::ContactKind;

bitflags! {
    /// Why a quantity of a touch is absent or in doubt, and what was wrong with the input. Names are those of
    /// [`Flags`](crate::percept::Flags) where both have one.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct TouchFlags: u32 {
        /// Only one taxel is pressed: no axis, no orientation, no spread.
        const ONE_TAXEL = 1 << 0;
        /// The second and third farthest points are as good as equally far: orientation is in doubt.
        const TIE = 1 << 1;
        /// Its taxels, or the two farthest points, fall together: axis and anisotropy, or orientation, are absent.
        const COINCIDENT = 1 << 2;
        /// The pressure spreads equally in all directions (anisotropy under 10⁻³): the axis is absent.
        const ISOTROPIC = 1 << 3;
        /// It goes around a limb, over 120° from its middle: its axis is that of the moments in space, and it has no angles and no
        /// orientation.
        const WRAPPED = 1 << 4;
        /// It lies on several links.
        const SEVERAL_LINKS = 1 << 5;
        /// It began, was joined with another, lost a part, or went over to another link less than 0.2 s ago: no velocity.
        const YOUNG = 1 << 6;
        /// Touches of the frame before have become one in this frame.
        const MERGED = 1 << 7;
        /// One of its taxels is above its P_max.
        const SATURATED = 1 << 8;
        /// The value of one of its taxels was altered, or that of a taxel beside it was masked, or one of temperature under it, or what
        /// says how one of its taxels pulls.
        const FAULTY_INPUT = 1 << 9;
        /// One of its taxels, also of those of temperature, lies outside the range that the calibration says the sensor has.
        const OUT_OF_RANGE = 1 << 10;
        /// The value of a taxel beside it is missing, or that of a taxel of temperature under it, or how one of its taxels pulls.
        const INCOMPLETE = 1 << 11;
        /// One of its taxels has not been heard from for too long.
        const STALE = 1 << 12;
        /// P has no unit, or a taxel no area: force and mean pressure are absent.
        const NO_UNIT = 1 << 13;
        /// Under five of its taxels are pressed: a fit is a point whose spread is a guess, and under three there is none.
        const FEW_TAXELS = 1 << 14;
        /// The contact goes on beyond the sensors: its force and length are not known, or there is no fit.
        const OFF_SKIN = 1 << 15;
        /// No kind of contact explains what its taxels feel: the fit is in doubt.
        const POOR_FIT = 1 << 16;
        /// What the layer makes of a contact is not known, as the calibration has no `[layer]` or a taxel has no area: no fit.
        const NO_LAYER = 1 << 17;
        /// The calibration does not say how much its sensors' values vary: no standard deviations.
        const NOISE_UNKNOWN = 1 << 18;
        /// Taxels near their thresholds, or pressed little, may change what is found by more than noise does: a standard deviation is
        /// absent.
        const UNSURE = 1 << 19;
        /// It has had fits for less than 0.2 s without a gap as long: no velocity of the fit.
        const YOUNG_FIT = 1 << 20;
        /// Its taxels have three axes, and nothing pulls along them: no direction of its shear.
        const STILL = 1 << 21;
        /// Under three of its temperature taxels have a reading, or they lie in a line, or it is wrapped: no gradient.
        const NO_GRADIENT = 1 << 22;
        /// Its temperature taxels have not been read for half of the window: no rate.
        const NO_PREVIOUS = 1 << 23;
        /// Of one of its taxels alone it is known how it pulls, as the others have one axis: no torsion.
        const ONE_PULLED = 1 << 24;
    }
}

impl TouchFlags {
    /// The flags' names in lower case, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }
}

/// A touch of the whole body in one frame. Its place and directions are in the frame of its link, or in the world: [`Touch::in_world`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Touch {
    /// Lasts from onset to release, and is never used again.
    pub id: u64,
    /// Time since its onset to the nanosecond, s.
    pub age_s: f64,
    /// Index of the link with most of its total.
    pub link: u32,
    /// ΣP over its taxels, in the unit of P.
    pub total: f64,
    /// The largest P.
    pub peak: f64,
    /// Number of its taxels.
    pub active: u32,
    /// Area of its taxels, m²; absent where one is unknown.
    pub area_m2: Option<f64>,
    /// Force, N: ΣPA of pressures, ΣP of forces.
    pub force_newton: Option<f64>,
    /// Force over area, Pa.
    pub mean_pressure_pascal: Option<f64>,
    /// The surface point of its taxels' cells that is nearest to the weighted mean of their positions in space, m.
    pub position: DVec3,
    /// The mean of its taxels' positions in space, without weights, m.
    pub centre: DVec3,
    /// Outward unit normal at the position.
    pub normal: DVec3,
    /// Unit vector along the principal axis of the second moments.
    pub principal_axis: Option<DVec3>,
    /// The same as an angle in the chart of the touch, in [0, π), rad.
    pub principal_axis_rad: Option<f64>,
    /// (λ₁ − λ₂) / (λ₁ + λ₂) of the two largest moments.
    pub anisotropy: Option<f64>,
    /// Standard deviation along and across the principal axis, m.
    pub spread_m: Option<[f64; 2]>,
    /// Unit vector along the line through the two farthest points.
    pub orientation: Option<DVec3>,
    /// The same as an angle in the chart of the touch, in [0, π), rad.
    pub orientation_rad: Option<f64>,
    /// Change of the position on the skin over 0.2 s, m/s.
    pub velocity: Option<DVec3>,
    /// What presses, where that is asked for and known.
    pub fit: Option<TouchFit>,
    /// Where it is by its fit and by its moments, each weighted by how sure it is; its position where it has no fit. m; only on request.
    pub place: Option<DVec3>,
    /// Standard deviation of that along u and v of the touch's chart, where it has a fit and the noise of the sensors is known, m.
    pub place_sigma_m: Option<[f64; 2]>,
    /// Standard deviation of the total from the noise of the sensors, in the unit of P; only on request, as the next two.
    pub total_sigma: Option<f64>,
    /// Standard deviation of the position along u and v of the touch's chart, m.
    pub position_sigma_m: Option<[f64; 2]>,
    /// Standard deviation of the principal axis, rad.
    pub principal_axis_sigma_rad: Option<f64>,
    /// Σws over its taxels that have three axes, each with the weight w that it has in the position, times ΣP/ΣwP: in the unit of P.
    pub shear: Option<DVec3>,
    /// The same along u and v of the touch's chart, in the unit of P.
    pub shear_in_chart: Option<[f64; 2]>,
    /// The same as an angle in that chart, in (−π, π], rad.
    pub shear_direction_rad: Option<f64>,
    /// The force on the skin by all its taxels, normal and, where it is known, tangential, N; absent where none has three axes.
    pub force_vector_newton: Option<DVec3>,
    /// Σw(x − c) × s · n about the mean c of those taxels by wP, times ΣP/ΣwP, in the unit of P times m.
    pub torsion: Option<f64>,
    /// ‖Σws‖ / ΣwP of those taxels, each s turned into the touch's chart.
    pub friction: Option<f64>,
    /// Standard deviation of that from the noise of the sensors; only on request.
    pub friction_sigma: Option<f64>,
    /// Friction over that at which it slips, where the calibration has it.
    pub slip_ratio: Option<f64>,
    /// Mean of the temperature taxels whose nearest pressure taxel (same side of the same link, within 1.5 cell widths) is one of its, °C.
    pub temperature_celsius: Option<f64>,
    /// The highest temperature of these, °C.
    pub warmest_celsius: Option<f64>,
    /// The id of the taxel that has it; of equal ones the lowest.
    pub warmest_taxel: Option<u32>,
    /// Where that taxel is, m; in the world by the pose of its own link, if that is known.
    pub warmest_position: Option<DVec3>,
    /// The lowest temperature of these, °C.
    pub coldest_celsius: Option<f64>,
    /// The id of the taxel that has it; of equal ones the lowest.
    pub coldest_taxel: Option<u32>,
    /// Where that taxel is, m; in the world by the pose of its own link, if that is known.
    pub coldest_position: Option<DVec3>,
    /// Gradient of their temperature along u and v of the touch's chart, K/m.
    pub temperature_gradient_kelvin_per_m: Option<[f64; 2]>,
    /// How fast their mean changes, K/s, over the window of the calibration.
    pub temperature_rate_kelvin_per_s: Option<f64>,
    /// Whether its place and directions are in the world (or in [`Scene::relative_to`](crate::scene::Scene::relative_to)), because the
    /// frame carried a pose of its link.
    pub in_world: bool,
    /// Why quantities are absent or in doubt.
    pub flags: TouchFlags,
    /// The taxel that the chart is based at: the one nearest to the weighted mean.
    pub base: u32,
    /// It began, was joined with another, lost a part or went over to another link in this frame: what moves is measured anew.
    pub(crate) begins_anew: bool,
    pub(crate) links: [u32; 2],
    pub(crate) fields: [u32; 2],
    pub(crate) taxels: [u32; 2],
}

impl Touch {
    /// Where it is as well as is known: its [`place`](Self::place) where that was asked for, else its position, m.
    #[must_use]
    pub fn best_place(&self) -> DVec3 {
        self.place.unwrap_or(self.position)
    }
}

/// The contact that explains best what the taxels of a touch and those beside them feel, as `docs/explanation/fit.md` has it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TouchFit {
    /// Its kind.
    pub kind: ContactKind,
    /// Its middle on the skin, m; of a line the point nearest to the touch's mean.
    pub place: DVec3,
    /// Its force, in N where P is in Pa, else in the unit of P; absent where it goes on beyond the sensors.
    pub force: Option<f64>,
    /// Unit vector along it; absent for a point.
    pub direction: Option<DVec3>,
    /// The same as an angle in the chart of the touch, in [0, π), rad.
    pub angle_rad: Option<f64>,
    /// The standard deviation of its pressure across, at the sensors, m.
    pub width_m: f64,
    /// Of a segment from end to end, m; of a blob the standard deviation of its pressure along.
    pub length_m: Option<f64>,
    /// Change of its middle on the skin over 0.2 s, m/s; of a line only across it.
    pub velocity: Option<DVec3>,
    /// Standard deviations, where the noise of the sensors is known.
    pub sigma: Option<FitSigma>,
}

/// Standard deviations of a [`TouchFit`], each in the unit of what it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FitSigma {
    /// Along u and v of the touch's chart; of a line only what it is off across.
    pub place: [f64; 2],
    /// Of the force.
    pub force: f64,
    /// Of the angle.
    pub angle: f64,
    /// Of the width.
    pub width: f64,
    /// Of the length.
    pub length: f64,
}

/// The part of a touch on one of its links.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LinkShare {
    /// Index of the link.
    pub link: u32,
    /// ΣP of the touch on it, in the unit of P.
    pub total: f64,
    /// Force and torque on it, where they are known: of taxels with three axes tangential ones too, as far as these are.
    pub wrench: Option<Wrench>,
}

/// What presses on a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Σ Aᵢ(−Pᵢnᵢ + sᵢ) in the link's frame, N; s is 0 but of taxels with three axes.
    pub force_newton: DVec3,
    /// Σ xᵢ × Fᵢ about the link's origin in its frame, N m.
    pub torque_newton_m: DVec3,
}

/// The part of a touch in one field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldShare {
    /// Index of the field.
    pub field: u32,
    /// ΣP of the touch in it, in the unit of P.
    pub total: f64,
}

/// The touches of a frame.
#[derive(Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TouchFrame {
    /// The oldest first.
    pub touches: Vec<Touch>,
    /// Ids that have ended with this frame, ascending; those that were joined with others too.
    pub released: Vec<u64>,
    pub(crate) links: Vec<LinkShare>,
    pub(crate) fields: Vec<FieldShare>,
    pub(crate) taxels: Vec<u32>,
}

impl Clone for TouchFrame {
    fn clone(&self) -> Self {
        Self {
            touches: self.touches.clone(),
            released: self.released.clone(),
            links: self.links.clone(),
            fields: self.fields.clone(),
            taxels: self.taxels.clone(),
        }
    }

    // In memory that is used again.
    fn clone_from(&mut self, other: &Self) {
        self.touches.clone_from(&other.touches);
        self.released.clone_from(&other.released);
        self.links.clone_from(&other.links);
        self.fields.clone_from(&other.fields);
        self.taxels.clone_from(&other.taxels);
    }
}

impl TouchFrame {
    /// Forgets all.
    #[doc(hidden)]
    pub fn clear(&mut self) {
        self.touches.clear();
        self.released.clear();
        self.links.clear();
        self.fields.clear();
        self.taxels.clear();
    }

    /// The links that `touch`, one of these, lies on, in the body's order.
    #[must_use]
    pub fn links(&self, touch: &Touch) -> &[LinkShare] {
        part(&self.links, touch.links)
    }

    /// The fields that hold parts of `touch`, one of these, ascending.
    #[must_use]
    pub fn fields(&self, touch: &Touch) -> &[FieldShare] {
        part(&self.fields, touch.fields)
    }

    /// The taxels of `touch`, one of these, as ascending nodes.
    #[must_use]
    pub fn taxels(&self, touch: &Touch) -> &[u32] {
        part(&self.taxels, touch.taxels)
    }
}

fn part<T>(all: &[T], [from, to]: [u32; 2]) -> &[T] {
    all.get(from as usize..to as usize).unwrap_or_default()
}
