//! Letters that are not made of pressures: which of them a scene reads, and the taxels of their fields.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Scene;
use crate::body::{Body, Taxel, listed};
use crate::error::{Error, Result};
use crate::field::{Field, FieldSet};
use crate::percept::{Column, Outputs, TouchOutputs};
use crate::signal::{Axis, Calibration, Channel, Letter, Receptor, SenseCalibration, ShearCalibration};

/// What the host reads of raw values for a plan's letters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Senses {
    /// The channels of the body that are read, as [`Channel::all_of`] counts.
    pub(crate) channels: Vec<usize>,
    pub(crate) temperature: Option<SenseCalibration>,
    pub(crate) proximity: Option<SenseCalibration>,
    pub(crate) shear: Option<ShearCalibration>,
}

/// A taxel of a field in such a letter.
#[derive(Clone, Debug)]
pub(crate) struct SensedMember {
    /// Its place in the body.
    pub(crate) taxel: usize,
    pub(crate) id: u32,
    /// Which of the plan's channels has its pressure, if it is pressed.
    pub(crate) channel: Option<usize>,
    /// Which of [`Senses::channels`] its value is; of one with three axes, those of its tangential values.
    pub(crate) values: [usize; 2],
    pub(crate) weight: f64,
    /// (u, v) in the field's chart, m.
    pub(crate) place_m: DVec2,
    pub(crate) link: usize,
    pub(crate) position_in_link: DVec3,
    pub(crate) normal_in_link: DVec3,
    pub(crate) tangents_in_link: [DVec3; 2],
    /// The same in the anchor, with the body at rest.
    pub(crate) position_in_anchor: DVec3,
    pub(crate) normal_in_anchor: DVec3,
    pub(crate) tangents_in_anchor: [DVec3; 2],
    /// Its tangents along u and v of the field's chart.
    pub(crate) tangents_in_chart: [DVec2; 2],
}

/// What reads what `column` is made of: shear, temperature or proximity, or else pressure.
#[must_use]
pub fn receptor_of(column: &Column) -> Receptor {
    let others = [Receptor::Shear, Receptor::Temperature, Receptor::Proximity];
    others.into_iter().find(|&receptor| outputs_of(receptor).contains(column.output)).unwrap_or(Receptor::Sustained)
}

/// What the letter of `receptor` gives, if the host makes it; else nothing.
pub(crate) fn outputs_of(receptor: Receptor) -> Outputs {
    match receptor {
        Receptor::Sustained | Receptor::Change => Outputs::empty(),
        Receptor::Shear => Outputs::of_stage("shear"),
        Receptor::Temperature => Outputs::of_stage("temperature"),
        Receptor::Proximity => Outputs::of_stage("proximity"),
    }
}

/// The letters of `scene`, and its outputs with those of the letters: if it names no letters, those that its taxels have and whose
/// outputs are asked for, which all are by default.
///
/// # Errors
/// A letter has no taxels, or an output no letter.
pub(super) fn letters_and_outputs(
    body: &Body,
    fields: &FieldSet,
    chosen: &[usize],
    scene: &Scene,
    outputs: Outputs,
) -> Result<(Vec<Letter>, Outputs)> {
    let members = || chosen.iter().flat_map(|&field| &fields.fields[field].members);
    let has = |receptor: Receptor| members().any(|member| receptor.reads(body.taxels[member.taxel].modality));
    let asked = outputs & Outputs::OF_OTHER_LETTERS;
    let is_usual = outputs.contains(Outputs::USUAL);
    let others = [Receptor::Shear, Receptor::Temperature, Receptor::Proximity];
    let letters = if scene.letters.is_empty() {
        let wanted = others.into_iter().filter(|&receptor| {
            let own = outputs_of(receptor);
            has(receptor) && (outputs.intersects(own) || (asked.is_empty() && is_usual))
        });
        let pressure = Some(Receptor::Sustained).filter(|&receptor| has(receptor));
        let letters = pressure.into_iter().chain(wanted);
        letters.map(|receptor| Letter { receptor, ..Letter::default() }).collect()
    } else {
        scene.letters.clone()
    };
    let is_read = |receptor: Receptor| letters.iter().any(|letter| letter.receptor == receptor);
    if let Some(empty) = others.into_iter().find(|&receptor| is_read(receptor) && !has(receptor)) {
        let kind = if empty == Receptor::Shear { "of three axes (modality force3)" } else { "of that modality" };
        return Err(Error::usage(format!("letter `{empty}` has no taxels: no field has one {kind}")).at(&body.name));
    }
    let mut given = outputs - Outputs::OF_OTHER_LETTERS;
    for receptor in others {
        let own = outputs_of(receptor);
        let of_letter = outputs & own;
        if is_read(receptor) {
            let usual = own - Outputs::FRICTION_SIGMA;
            given |= if of_letter.is_empty() { usual } else { of_letter };
        } else if !of_letter.is_empty() && !outputs.contains(Outputs::USUAL | own) {
            // Whoever asks for everything gets what there is.
            let names: Vec<String> = of_letter.names().collect();
            let what = format!("`{}` is of letter `{receptor}`, which no field's taxels have", listed(&names));
            return Err(Error::usage(what).at(&body.name));
        }
    }
    Ok((letters, given))
}

impl Senses {
    /// For `letters` of the fields `chosen`.
    pub(super) fn new(
        body: &Body,
        fields: &FieldSet,
        chosen: &[usize],
        letters: &[Letter],
        calibration: &Calibration,
    ) -> Self {
        let is_read = |receptor: Receptor| letters.iter().any(|letter| letter.receptor == receptor);
        let [temperature, proximity, shear] =
            [Receptor::Temperature, Receptor::Proximity, Receptor::Shear].map(is_read);
        if !(temperature || proximity || shear) {
            return Self::default();
        }
        let all = Channel::all_of(body);
        let place = |channel: Channel| all.binary_search(&channel.0).expect("it is a channel of the body");
        let mut channels = BTreeSet::new();
        for member in chosen.iter().flat_map(|&field| &fields.fields[field].members) {
            let taxel = &body.taxels[member.taxel];
            if shear && Receptor::Shear.reads(taxel.modality) {
                channels.extend([Axis::U, Axis::V].map(|axis| place(Channel::of_taxel(taxel.id, axis))));
            }
            let is_sensed = (temperature && Receptor::Temperature.reads(taxel.modality))
                || (proximity && Receptor::Proximity.reads(taxel.modality));
            if is_sensed {
                channels.insert(place(Channel::of_taxel(taxel.id, Axis::Normal)));
            }
        }
        Self {
            channels: channels.into_iter().collect(),
            temperature: temperature.then(|| calibration.temperature.clone()),
            proximity: proximity.then(|| calibration.proximity.clone()),
            shear: shear.then(|| calibration.shear.clone()),
        }
    }

    /// Refuses what is `asked` of touches by name and no letter gives. Whoever asks for everything gets what there is.
    pub(super) fn check_touches(&self, asked: TouchOutputs) -> Result<()> {
        let others = (TouchOutputs::SHEAR | TouchOutputs::TEMPERATURE) & asked;
        let lacking: Vec<String> = (others - self.of_touches()).names().map(|name| format!("touches.{name}")).collect();
        if lacking.is_empty() || asked == TouchOutputs::all() {
            return Ok(());
        }
        Err(Error::usage(format!(
            "no letter gives `{}`: no field's taxels have it, or it is not asked for",
            listed(&lacking)
        )))
    }

    /// What touches have of these letters.
    pub(super) fn of_touches(&self) -> TouchOutputs {
        let shear = self.shear.as_ref().map_or(TouchOutputs::empty(), |_| TouchOutputs::SHEAR);
        let temperature = self.temperature.as_ref().map_or(TouchOutputs::empty(), |_| TouchOutputs::TEMPERATURE);
        shear | temperature
    }

    /// The members of `field` that `receptor` reads.
    pub(super) fn members(
        &self,
        body: &Body,
        body_taxels: &[usize],
        field: &Field,
        receptor: Receptor,
    ) -> Arc<[SensedMember]> {
        let all = Channel::all_of(body);
        let value = |taxel: &Taxel, axis: Axis| {
            let channel = all.binary_search(&Channel::of_taxel(taxel.id, axis).0).expect("it is a channel of the body");
            self.channels.binary_search(&channel).expect("it is read")
        };
        let read = field.members.iter().filter(|member| receptor.reads(body.taxels[member.taxel].modality));
        let made = read.map(|member| {
            let taxel = &body.taxels[member.taxel];
            let anchor_from_link = match field.anchor {
                Some(anchor) => body.rest_transform(anchor, taxel.link),
                None => body.links[taxel.link].world_from_link(),
            };
            let tangents_in_link = taxel.tangents_in_link();
            let normal_in_anchor = anchor_from_link.transform_vector3(taxel.normal_in_link);
            let tangents_in_anchor = tangents_in_link.map(|tangent| anchor_from_link.transform_vector3(tangent));
            let tangents_in_chart = field.chart.as_ref().map_or([DVec2::ZERO; 2], |chart| {
                tangents_in_anchor.map(|tangent| chart.along(tangent, normal_in_anchor))
            });
            SensedMember {
                taxel: member.taxel,
                id: taxel.id,
                channel: body_taxels.binary_search(&member.taxel).ok(),
                values: match receptor {
                    Receptor::Shear => [Axis::U, Axis::V].map(|axis| value(taxel, axis)),
                    _ => [value(taxel, Axis::Normal); 2],
                },
                weight: member.weight,
                place_m: member.place.truncate(),
                link: taxel.link,
                position_in_link: taxel.position_in_link,
                normal_in_link: taxel.normal_in_link,
                tangents_in_link,
                position_in_anchor: anchor_from_link.transform_point3(taxel.position_in_link),
                normal_in_anchor,
                tangents_in_anchor,
                tangents_in_chart,
            }
        });
        made.collect()
    }
}
