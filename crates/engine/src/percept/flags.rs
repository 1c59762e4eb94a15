//! Why quantities are absent, or in doubt.

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};
use serde::{Serialize, Serializer};

bitflags! {
    /// Why a quantity is absent or in doubt, and what was wrong with the input.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
    #[repr(transparent)]
    pub struct Flags: u32 {
        /// The field is not in contact: everything that needs a touch is absent. Of letter temperature: no taxel has a reading; of letter
        /// proximity: none reads anything in range.
        const NO_CONTACT = 1 << 0;
        /// Only one taxel is pressed: there is no line through two points, no spread and no torsion.
        const ONE_TAXEL = 1 << 1;
        /// The second and third farthest points are as good as equally far (R₂ − R₃ ≤ 2⁻¹⁴ R₁): orientation is in doubt.
        const TIE = 1 << 2;
        /// The points that would define a line fall together: orientation (or axis) is absent.
        const COINCIDENT = 1 << 3;
        /// The pressure spreads equally in all directions (anisotropy under 10⁻³): the axis is absent.
        const ISOTROPIC = 1 << 4;
        /// The centroid did not move, or its filtered steps cancel each other out: there is no direction of motion. Of letter shear:
        /// nothing pulls along the skin, and there is no direction of shear.
        const STILL = 1 << 5;
        /// A pressed taxel is above its P_max; its value is kept. Of letter proximity: something is nearer than 0.1 mm, or
        /// than its taxel's curve goes.
        const SATURATED = 1 << 6;
        /// A taxel's value was masked or altered: not finite, unbelievable, or distrusted by the calibration's checks.
        const FAULTY_INPUT = 1 << 7;
        /// A taxel's raw value lies outside the range that the calibration says the sensor has; it is kept. Of letter proximity also:
        /// nothing is in range; of letter shear: a tangential value is left out, and its taxel's normal one is kept.
        const OUT_OF_RANGE = 1 << 8;
        /// A taxel's value is missing and left out of every sum.
        const INCOMPLETE = 1 << 9;
        /// The field has no chart: what needs (u, v) is absent.
        const NO_CHART = 1 << 10;
        /// There is no previous frame to measure motion from, or less than half a window to measure a rate over.
        const NO_PREVIOUS = 1 << 11;
        /// The time step is zero, negative, or longer than the scene allows.
        const BAD_DT = 1 << 12;
        /// The field's channels have not been heard from for too long.
        const STALE = 1 << 13;
        /// The field is touched in several places: its centroid may lie where nobody touches.
        const SEVERAL = 1 << 14;
        // From here on the host's alone: a word of the device has no room for them.
        /// The centroid has not come as far as the filter's window from the last one that counted: filtered displacement
        /// and speed are absent, the filtered direction stays what it was. Or the contact is younger than the time over which
        /// motion is measured.
        const HELD = 1 << 16;
        /// The centroid went farther at once than the filter's window: it is taken for another touch, and filtered motion
        /// starts anew.
        const JUMPED = 1 << 17;
        /// A taxel has been touched for long while too few others were untouched to tell its drift: its baseline is that of
        /// the onset.
        const DRIFT_UNKNOWN = 1 << 18;
        /// P has no unit, or a taxel no area: the force is absent.
        const NO_UNIT = 1 << 19;
        /// Under three temperature taxels have a reading, or they lie in a line: the gradient is absent.
        const NO_GRADIENT = 1 << 20;
        /// The calibration does not say how noisy a pressed taxel is: there are no sigmas.
        const NOISE_UNKNOWN = 1 << 25;
        /// Noise alone may switch a taxel on or off, or turn the axis anyhow: what depends on it has no sigma.
        const UNSURE = 1 << 26;
        /// The states of the joints that move the field are missing or too old: its position and normal are in the link, or it has
        /// none as it lies over several.
        const STALE_POSE = 1 << 27;
        /// Frames do not say where the field is in the world: it is in no contact with another link, and has no speed there. Of
        /// a field over several links: where one is that is pressed; it has no position.
        const NO_POSE = 1 << 28;
    }
}

impl Flags {
    /// The flags' names as percept NDJSON spells them, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }
}

/// A list of names.
impl Serialize for Flags {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.names())
    }
}
