//! What a touch does beside pressing, from its keys: friction, warmth, and how far off it is.

use toml::Spanned;

use super::contact::Layer;
use super::file::{File, TouchKeys};
use super::friction::Friction;
use super::profile::Profile;
use super::setup::Setup;
use crate::body::{Body, Modality};
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

/// Whether `body` has a taxel that measures `modality`.
fn has(body: &Body, modality: Modality) -> bool {
    body.taxels.iter().any(|taxel| taxel.modality == modality)
}

/// A line about the keys of `file` that no taxel of `body` feels, if there are any: one file may be for several bodies.
pub(super) fn without_effect(file: &File, body: &Body) -> Option<String> {
    let touches = |is_given: fn(&TouchKeys) -> bool| file.touch.iter().any(|touch| is_given(touch.get_ref()));
    let (warm, near) = (&file.temperature, &file.proximity);
    let has_warm = warm.ambient_celsius.is_some() || warm.time_constant_s.is_some() || warm.noise_sigma.is_some();
    let keys = [
        (Modality::Force3, "`friction`", touches(|keys| keys.friction.is_some())),
        (Modality::Force3, "`twist_deg`", touches(|keys| keys.twist_deg.is_some())),
        (Modality::Temperature, "`celsius`", touches(|keys| keys.celsius.is_some())),
        (Modality::Temperature, "[temperature]", has_warm),
        (Modality::Proximity, "`gap_m`", touches(|keys| keys.gap_m.is_some())),
        (Modality::Proximity, "[proximity]", near.range_m.is_some() || near.noise_sigma.is_some()),
    ];
    let idle: Vec<_> = keys.into_iter().filter(|&(modality, _, is_given)| is_given && !has(body, modality)).collect();
    let names: Vec<&str> = idle.iter().map(|(_, name, _)| *name).collect();
    let mut kinds: Vec<String> = idle.iter().map(|(modality, ..)| modality.name()).collect();
    kinds.dedup();
    let effect = if names.len() == 1 { "has" } else { "have" };
    let (names, kinds) = (names.join(", "), kinds.join(" or "));
    (!idle.is_empty()).then(|| format!("{names} {effect} no effect: the body has no taxels of {kinds}"))
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
        Ok(gap.filter(|_| self.sees()))
    }

    /// Whether the body has taxels that see distances.
    pub(super) fn sees(&self) -> bool {
        has(self.body, Modality::Proximity)
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

#[cfg(test)]
mod tests {
    use super::super::SimulatedSource;
    use crate::body::Body;
    use crate::bundled;
    use crate::signal::Frame;
    use crate::source::Source as _;

    const PALM: &str = "rate_hz = 10\nduration_s = 0.5\n[layer]\nthickness_m = 0.003\n[[touch]]\non = \"hand/palm\"\n\
                        indenter = \"ball\"\nradius_m = 0.02\npath = [[0, 0]]\nforce_newton = [[0, 4], [0.3, 4], [0.31, 0]]\n";

    fn on(body: &str, text: &str) -> SimulatedSource {
        let body = Body::from_bytes(body, bundled::body(body).unwrap()).unwrap();
        SimulatedSource::on_body("a.toml", text, body).unwrap()
    }

    #[test]
    fn keys_that_no_taxel_feels_are_told_in_a_line() {
        let all = format!(
            "{PALM}friction = 0.5\ntwist_deg = [[0, 0]]\ncelsius = 34\ngap_m = [[0, 0.1]]\n[temperature]\nnoise_sigma = 1\n\
             [proximity]\nrange_m = 0.2\n"
        );
        let mut simulation = on("hand", &all);
        let what = "a.toml: `friction`, `twist_deg`, `celsius`, [temperature], `gap_m`, [proximity] have no effect: the body has no \
                    taxels of force3 or temperature or proximity";
        assert_eq!(simulation.notices(), [what]);
        assert!(simulation.notices().is_empty());
        let one = on("hand", &format!("{PALM}celsius = 34\n")).notices();
        assert_eq!(one, ["a.toml: `celsius` has no effect: the body has no taxels of temperature"]);
        assert!(on("sensing-hand", &all).notices().is_empty() && on("hand", PALM).notices().is_empty());
    }

    #[test]
    fn what_presses_is_seen_also_without_a_gap() {
        let nearest = |text: &str| {
            let mut simulation = on("sensing-hand", text);
            let (mut frame, mut all) = (Frame::default(), Vec::new());
            while simulation.next_frame(&mut frame).unwrap() {
                let gap_m = simulation.truth().first().and_then(|truth| truth.gap_m);
                let least_m = simulation.sensed.distances_m.iter().copied().fold(f64::INFINITY, f64::min);
                all.push((gap_m, least_m));
            }
            all
        };
        let plain = nearest(PALM);
        for &(gap_m, least_m) in &plain[..4] {
            assert!(gap_m == Some(0.0) && least_m < 0.02, "{gap_m:?}, {least_m} m");
        }
        assert_eq!(plain[4], (None, f64::INFINITY));
        let with_gap = nearest(&format!("{PALM}gap_m = [[0, 0.05], [1, 0.05]]\n"));
        assert_eq!(with_gap[..4], plain[..4]);
        assert_eq!(with_gap[4].0, Some(0.05));
    }
}
