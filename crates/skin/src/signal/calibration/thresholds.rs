//! The thresholds of contact and change: the tables `[contact]` and `[change]`.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use crate::error::Result;
use crate::keys::Text;
use crate::signal::response::MAX_MAGNITUDE;

/// The sums S at which a field's contact begins and ends, in the unit of S. By default any S > 0 is contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactThresholds {
    /// Contact begins over this.
    pub on: f64,
    /// Contact ends at this or below; at most `on`.
    pub off: f64,
}

impl ContactThresholds {
    /// The same in another unit: `factor` new units are one old unit.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { on: self.on * factor, off: self.off * factor }
    }
}

/// The thresholds of the letter [`crate::signal::Receptor::Change`] for all taxels and fields, P per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChangeCalibration {
    /// Changes up to this one count as 0.
    pub dead_band: f64,
    /// Contact thresholds of the change.
    pub contact: ContactThresholds,
}

impl ChangeCalibration {
    /// The same in another unit: `factor` new units are one old unit.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { dead_band: self.dead_band * factor, contact: self.contact.times(factor) }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ContactKeys {
    on: Option<Spanned<f64>>,
    off: Option<Spanned<f64>>,
    #[serde(default)]
    field: BTreeMap<String, FieldContactKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldContactKeys {
    on: Spanned<f64>,
    off: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChangeKeys {
    dead_band: Option<Spanned<f64>>,
    on: Option<Spanned<f64>>,
    off: Option<Spanned<f64>>,
}

/// Units of contact thresholds.
const OF_SUMS: &str = "in the unit of S";
const OF_CHANGES: &str = "in P per second";

impl ContactKeys {
    /// The thresholds for all fields, and those of single fields by name.
    pub(super) fn read(self, text: Text<'_>) -> Result<(ContactThresholds, BTreeMap<String, ContactThresholds>)> {
        let all = thresholds(self.on.as_ref(), self.off.as_ref(), OF_SUMS, text)?;
        let one = |keys: FieldContactKeys| thresholds(Some(&keys.on), keys.off.as_ref(), OF_SUMS, text);
        let fields = self.field.into_iter().map(|(name, keys)| Ok((name, one(keys)?)));
        Ok((all, fields.collect::<Result<_>>()?))
    }
}

impl ChangeKeys {
    pub(super) fn read(&self, text: Text<'_>) -> Result<ChangeCalibration> {
        let dead_band = self.dead_band.as_ref().map_or(0.0, |band| *band.get_ref());
        match &self.dead_band {
            Some(band) if !(0.0..=MAX_MAGNITUDE).contains(&dead_band) => {
                let what = format!("`dead_band` is {dead_band}; it must be 0 or more, {OF_CHANGES}");
                Err(text.wrong(band.span(), what))
            }
            _ => Ok(ChangeCalibration {
                dead_band,
                contact: thresholds(self.on.as_ref(), self.off.as_ref(), OF_CHANGES, text)?,
            }),
        }
    }
}

/// Thresholds of contact in `unit`; `off` is `on` where it is not given.
fn thresholds(
    on: Option<&Spanned<f64>>,
    off: Option<&Spanned<f64>>,
    unit: &str,
    text: Text<'_>,
) -> Result<ContactThresholds> {
    let wrong = |key: &str, value: &Spanned<f64>, must: &str| {
        Err(text.wrong(value.span(), format!("`{key}` is {}; it must be {must}", value.get_ref())))
    };
    let on_value = on.map_or(0.0, |on| *on.get_ref());
    let off_value = off.map_or(on_value, |off| *off.get_ref());
    match (on, off) {
        (Some(on), _) if !(0.0..=MAX_MAGNITUDE).contains(&on_value) => wrong("on", on, &format!("0 or more, {unit}")),
        (_, Some(off)) if !(0.0..=on_value).contains(&off_value) => wrong("off", off, "between 0 and `on`"),
        _ => Ok(ContactThresholds { on: on_value, off: off_value }),
    }
}
