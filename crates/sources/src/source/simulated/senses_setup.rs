//! What a touch does beside pressing, from its keys: friction, warmth, and how far off it is.

use toml::Spanned;

use super::contact::Layer;
use super::file::TouchKeys;
use super::friction::Friction;
use super::profile::Profile;
use super::setup::Setup;
use crate::body::Modality;
use crate::error::Result;
use crate::keys::Text;

/// The most that a coefficient of friction, a turn in degrees and a gap in m may be.
const MOST: f64 = 1e6;
/// The absolute zero.
const ZERO_KELVIN_CELSIUS: f64 = -273.15;

/// A temperature that there is, °C.
pub(super) fn celsius(text: Text<'_>, key: &str, value: &Spanned<f64>) -> Result<f64> {
    if *value.get_ref() < ZERO_KELVIN_CELSIUS {
        let what = format!("`{key}` is {}; nothing is colder than {ZERO_KELVIN_CELSIUS} °C", value.get_ref());
        return Err(text.wrong(value.span(), what));
    }
    text.finite(key, value)
}

/// What a touch does beside pressing.
pub(super) struct Beside {
    pub(super) friction: Option<Friction>,
    /// rad, counter-clockwise from outside
    pub(super) twist: Option<Profile>,
    pub(super) celsius: Option<f64>,
}

impl Setup<'_> {
    /// What `keys` say of a touch that presses through `layer`, with an indenter that has a direction if it `is_long`.
    pub(super) fn beside(&self, keys: &TouchKeys, layer: &Layer, is_long: bool) -> Result<Beside> {
        let text = self.text;
        let friction = match &keys.friction {
            None => {
                text.refuse("twist_deg", keys.twist_deg.as_ref(), "without `friction`")?;
                None
            }
            Some(friction) if layer.thickness_m <= 0.0 => {
                let what = "`friction` needs a layer that gives way; give [layer] its `thickness_m`";
                return Err(text.wrong(friction.span(), what));
            }
            Some(friction) => Some(Friction::new(text.positive("friction", friction)?)),
        };
        if is_long {
            text.refuse("twist_deg", keys.twist_deg.as_ref(), "for this indenter, which `angle_deg` turns")?;
        }
        let twist = self.list("twist_deg", keys.twist_deg.as_ref(), -MOST, "degrees")?;
        let twist = twist.map(|points| points.into_iter().map(|(t_s, degrees)| (t_s, degrees.to_radians())).collect());
        let celsius = keys.celsius.as_ref().map(|value| celsius(text, "celsius", value)).transpose()?;
        Ok(Beside { friction, twist: twist.map(Profile::new), celsius })
    }

    /// The touch's gaps, if the body has taxels that see them.
    pub(super) fn gap(&self, keys: &TouchKeys) -> Result<Option<Profile>> {
        let gap = self.list("gap_m", keys.gap_m.as_ref(), 0.0, "metres")?.map(Profile::new);
        let sees = self.body.taxels.iter().any(|taxel| taxel.modality == Modality::Proximity);
        Ok(gap.filter(|_| sees))
    }

    /// A list of [t, number].
    fn list(
        &self,
        key: &str,
        list: Option<&Spanned<Vec<[f64; 2]>>>,
        least: f64,
        what: &str,
    ) -> Result<Option<Vec<(f64, f64)>>> {
        let Some(list) = list else { return Ok(None) };
        let points: Vec<(f64, f64)> = list.get_ref().iter().map(|&[t_s, number]| (t_s, number)).collect();
        self.text.check_times(key, list.span(), points.iter().map(|point| point.0))?;
        match points.iter().find(|point| !(least..=MOST).contains(&point.1)) {
            Some((t_s, bad)) => {
                let what = format!("`{key}` is {bad} at {t_s} s; give [t, {what}], from {least} to {MOST}");
                Err(self.text.wrong(list.span(), what))
            }
            None => Ok(Some(points)),
        }
    }

    /// Refuses what touches of the whole body cannot do.
    pub(super) fn only_drags(&self, keys: &TouchKeys) -> Result<()> {
        let why = "for a touch of the whole body; press a field or a link";
        self.text.refuse("celsius", keys.celsius.as_ref(), why)?;
        self.text.refuse("gap_m", keys.gap_m.as_ref(), why)
    }
}
