//! Letters that are not made of pressures: which of them a scene reads, and the taxels of their fields.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Scene;
use crate::body::{Body, Taxel, listed};
use crate::error::{Error, Result};
use crate::field::{Field, FieldSet};
use crate::percept::{Column, Outputs, TouchOutputs};
use crate::signal::{
    Axis, Calibration, Channel, Letter, Receptor, SenseCalibration, ShearCalibration, TaxelCalibration,
};

/// What the host reads of raw values for a plan's letters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Senses {
    /// The channels of the body that are read, as [`Channel::all_of`] counts.
    pub(crate) channels: Vec<usize>,
    /// Their ids, ascending.
    ids: Vec<u32>,
    pub(crate) temperature: Option<SenseCalibration>,
    pub(crate) proximity: Option<SenseCalibration>,
    /// Of fields with that letter, and of touches.
    pub(crate) shear: Option<ShearCalibration>,
    /// Whether touches have shear.
    pulls_touches: bool,
}

/// Which letters touches read, of the whole body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForTouches {
    /// Tangential forces: wrenches are made of them, whatever is asked for.
    reads_pulls: bool,
    gives_shear: bool,
    gives_temperature: bool,
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
    Receptor::OF_HOST
        .into_iter()
        .find(|&receptor| outputs_of(receptor).contains(column.output))
        .unwrap_or(Receptor::Sustained)
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

/// The letters of `scene`, and its outputs with those of the letters. If it names no letters, they are those that its taxels have and
/// whose outputs are asked for, which all are by default; and that of pressure, in which touches are found, also where no field of the
/// scene has such taxels. If `is_drifting`, pressures are followed, whatever is asked for.
///
/// # Errors
/// A usage error: a letter has no taxels, or what is asked for no letter.
pub(super) fn letters_and_outputs(
    body: &Body,
    fields: &FieldSet,
    chosen: &[usize],
    scene: &Scene,
    outputs: Outputs,
    is_drifting: bool,
) -> Result<(Vec<Letter>, Outputs)> {
    let members = || chosen.iter().flat_map(|&field| &fields.fields[field].members);
    let has = |receptor: Receptor| members().any(|member| receptor.reads(body.taxels[member.taxel].modality));
    let is_usual = outputs.contains(Outputs::USUAL);
    let others = Receptor::OF_HOST;
    let finds_touches = scene.asked_touches().is_some() && body.taxels.iter().any(|taxel| taxel.modality.is_pressed());
    let letters = if scene.letters.is_empty() {
        let asked = outputs & Outputs::OF_OTHER_LETTERS;
        let is_pressed = has(Receptor::Sustained);
        let wanted = others.into_iter().filter(|&receptor| {
            let is_all = asked.is_empty() && is_usual;
            // Where touches alone are asked for, a field without pressures says whether it reads anything.
            let is_bare = outputs.is_empty() && !is_pressed;
            has(receptor) && (outputs.intersects(outputs_of(receptor)) || is_all || is_bare)
        });
        let is_of_others_alone = outputs == asked && !asked.is_empty();
        let reads_pressure = finds_touches || (is_pressed && (is_drifting || !is_of_others_alone));
        let pressure = reads_pressure.then_some(Receptor::Sustained);
        let letters = pressure.into_iter().chain(wanted);
        letters.map(|receptor| Letter { receptor, ..Letter::default() }).collect()
    } else {
        scene.letters.clone()
    };
    if let Some(why) = lacks_pressure(scene, outputs, has(Receptor::Sustained), finds_touches) {
        return Err(Error::usage(why).at(&body.name));
    }
    let there: Vec<Receptor> = others.into_iter().filter(|&other| has(other)).collect();
    let is_any_read = letters.iter().any(|letter| has(letter.receptor));
    let is_empty = |receptor: &Receptor| match receptor {
        // Touches are found in it.
        Receptor::Sustained if finds_touches && is_any_read => false,
        // Where nothing else is there either, no letter reads what is.
        receptor => !has(*receptor) && (!receptor.is_of_pressure() || !there.is_empty()),
    };
    if let Some(empty) = letters.iter().map(|letter| letter.receptor).find(is_empty) {
        return Err(Error::usage(without_taxels(empty, &there)).at(&body.name));
    }
    let mut given = outputs - Outputs::OF_OTHER_LETTERS;
    for receptor in others {
        let own = outputs_of(receptor);
        let of_letter = outputs & own;
        if letters.iter().any(|letter| letter.receptor == receptor) {
            let usual = own - Outputs::FRICTION_SIGMA;
            given |= if of_letter.is_empty() && is_usual { usual } else { of_letter };
        } else if !of_letter.is_empty() && !outputs.contains(Outputs::USUAL | own) {
            // Whoever asks for everything gets what there is.
            let names: Vec<String> = of_letter.names().map(|name| format!("`{name}`")).collect();
            let why = why_not(receptor, has(receptor));
            let what = format!("{} {} of letter `{receptor}`, {why}", listed(&names), is_or_are(&names));
            return Err(Error::usage(what).at(&body.name));
        }
    }
    Ok((letters, given))
}

impl ForTouches {
    /// For touches, if they are asked for, beside fields in `letters`. A scene that names letters gets no others, and one that asks for
    /// what is made of touches, but for no touches, gets none.
    pub(super) fn new(body: &Body, scene: &Scene, letters: &[Letter], are_asked: bool) -> Self {
        let has = |receptor: Receptor| are_asked && body.taxels.iter().any(|taxel| receptor.reads(taxel.modality));
        let has_all = scene.letters.is_empty() && scene.touches.is_some();
        let gives = |receptor: Receptor| {
            let is_named = letters.iter().any(|letter| letter.receptor == receptor);
            has(receptor) && (is_named || has_all)
        };
        Self {
            reads_pulls: has(Receptor::Shear),
            gives_shear: gives(Receptor::Shear),
            gives_temperature: gives(Receptor::Temperature),
        }
    }
}

/// What touches have of shear.
const OF_SHEAR: TouchOutputs = TouchOutputs::SHEAR.union(TouchOutputs::FRICTION_SIGMA);

fn is_or_are(names: &[String]) -> &'static str {
    if names.len() == 1 { "is" } else { "are" }
}

/// Why `receptor`, which the taxels have or not, is not read.
fn why_not(receptor: Receptor, is_there: bool) -> String {
    if is_there {
        format!("which `letters` leaves out; add `{receptor}` to `letters`")
    } else {
        "which no field's taxels have".to_owned()
    }
}

/// That letter `empty` has no taxels: they have `there`.
fn without_taxels(empty: Receptor, there: &[Receptor]) -> String {
    match empty {
        Receptor::Shear => "letter `shear` has no taxels: no field has one of three axes (modality force3)".to_owned(),
        Receptor::Temperature | Receptor::Proximity => {
            format!("letter `{empty}` has no taxels: no field has one of that modality")
        }
        Receptor::Sustained | Receptor::Change => format!(
            "no field has a taxel that measures pressure, of which letter `{empty}` is made; leave out what asks for it: \
             the taxels have {}",
            listed(there)
        ),
    }
}

/// Why pressures that `scene` asks for by name, in `outputs` or of touches, are not read, if so: its letters leave them out, or no field
/// `is_pressed`, or nothing of the body is, in which it `finds_touches`.
fn lacks_pressure(scene: &Scene, outputs: Outputs, is_pressed: bool, finds_touches: bool) -> Option<String> {
    if outputs.contains(Outputs::USUAL) {
        // Whoever asks for everything gets what there is.
        return None;
    }
    let of_fields = outputs - Outputs::OF_OTHER_LETTERS - Outputs::SELF_CONTACTS;
    let mut names: Vec<String> = of_fields.names().map(|name| format!("`{name}`")).collect();
    if !scene.letters.is_empty() {
        let is_read = scene.letters.iter().any(|letter| letter.receptor.is_of_pressure());
        return (!is_read && !names.is_empty()).then(|| {
            format!(
                "{} {} of letters `sustained` and `change`, which `letters` leaves out; add `sustained` to `letters`",
                listed(&names),
                is_or_are(&names)
            )
        });
    }
    if is_pressed {
        return None;
    }
    let of_touches =
        [(scene.touches.is_some(), "`touches`"), (outputs.contains(Outputs::SELF_CONTACTS), "`self_contacts`")];
    names.extend(
        of_touches.iter().filter(|(is_asked, _)| *is_asked && !finds_touches).map(|(_, name)| (*name).to_owned()),
    );
    (!names.is_empty()).then(|| {
        format!(
            "no field has a taxel that measures pressure, of which {} {} made; leave that out of `outputs`",
            listed(&names),
            is_or_are(&names)
        )
    })
}

impl Senses {
    /// Which of [`Senses::channels`] has the value of taxel `id` along `axis`, if it is read.
    pub(crate) fn place_of(&self, id: u32, axis: Axis) -> Option<usize> {
        self.ids.binary_search(&Channel::of_taxel(id, axis).0).ok()
    }

    /// The ids of [`Senses::channels`].
    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// For `letters` of the fields `chosen`, and for touches, which are anywhere on the body.
    pub(super) fn new(
        body: &Body,
        fields: &FieldSet,
        chosen: &[usize],
        letters: &[Letter],
        calibration: &Calibration,
        for_touches: ForTouches,
    ) -> Self {
        let is_read = |receptor: Receptor| letters.iter().any(|letter| letter.receptor == receptor);
        let [temperature, proximity, shear] =
            [Receptor::Temperature, Receptor::Proximity, Receptor::Shear].map(is_read);
        let ForTouches { reads_pulls, gives_shear, gives_temperature } = for_touches;
        if !(temperature || proximity || shear || reads_pulls || gives_temperature) {
            return Self::default();
        }
        let all = Channel::all_of(body);
        let place = |channel: Channel| all.binary_search(&channel.0).expect("it is a channel of the body");
        let mut channels = BTreeSet::new();
        let mut read = |taxel: usize, of: [(Receptor, bool); 3]| {
            let taxel = &body.taxels[taxel];
            let Some((receptor, true)) = of.into_iter().find(|(receptor, _)| receptor.reads(taxel.modality)) else {
                return;
            };
            let axes: &[Axis] = if receptor == Receptor::Shear { &[Axis::U, Axis::V] } else { &[Axis::Normal] };
            channels.extend(axes.iter().map(|&axis| place(Channel::of_taxel(taxel.id, axis))));
        };
        let of_fields =
            [(Receptor::Shear, shear), (Receptor::Temperature, temperature), (Receptor::Proximity, proximity)];
        let of_touches =
            [(Receptor::Shear, reads_pulls), (Receptor::Temperature, gives_temperature), (Receptor::Proximity, false)];
        let members = chosen.iter().flat_map(|&field| &fields.fields[field].members);
        members.for_each(|member| read(member.taxel, of_fields));
        (0..body.taxels.len()).for_each(|taxel| read(taxel, of_touches));
        Self {
            ids: channels.iter().map(|&channel| all[channel]).collect(),
            channels: channels.into_iter().collect(),
            temperature: (temperature || gives_temperature).then(|| calibration.temperature.clone()),
            proximity: proximity.then(|| calibration.proximity.clone()),
            shear: (shear || reads_pulls).then(|| calibration.shear.clone()),
            pulls_touches: gives_shear,
        }
    }

    /// Refuses shear whose calibration does not say what it is made of: of the taxels `body_taxels`, which `calibrations` are of, one
    /// has a curve and no gain for its tangential values. What wrenches alone read is not refused; `of_fields`
    /// says whether fields read it.
    pub(super) fn check_shear(
        &self,
        body: &Body,
        (body_taxels, calibrations): (&[usize], &[TaxelCalibration]),
        of_fields: bool,
    ) -> Result<()> {
        let Some(by) = self.shear.as_ref().filter(|_| of_fields || self.pulls_touches) else { return Ok(()) };
        let lacks_gain = |taxel: usize, calibration: &TaxelCalibration| {
            let has_axes = Receptor::Shear.reads(body.taxels[taxel].modality);
            has_axes && !calibration.mask && !by.has_gain(taxel, calibration.response)
        };
        let found = body_taxels.iter().zip(calibrations).find(|&(&taxel, calibration)| lacks_gain(taxel, calibration));
        if let Some((&taxel, _)) = found {
            return Err(Error::usage(format!(
                "taxel {} has a curve or is an FSR, and the curve covers only the normal force: give `gain` in [shear], P for a raw unit along the skin",
                body.taxels[taxel].id
            )));
        }
        Ok(())
    }

    /// Refuses what is `asked` of touches by name and no letter gives. Whoever asks for everything gets what there is.
    pub(super) fn check_touches(&self, body: &Body, asked: TouchOutputs) -> Result<()> {
        if asked == TouchOutputs::all() {
            return Ok(());
        }
        let known = self.of_touches() | if self.pulls_touches { OF_SHEAR } else { TouchOutputs::empty() };
        let of_letters = [(OF_SHEAR, Receptor::Shear), (TouchOutputs::TEMPERATURE, Receptor::Temperature)];
        for (outputs, receptor) in of_letters {
            if let Some(name) = (outputs & (asked - known)).names().next() {
                let why = why_not(receptor, body.taxels.iter().any(|taxel| receptor.reads(taxel.modality)));
                return Err(Error::usage(format!("`touches.{name}` is of letter `{receptor}`, {why}")));
            }
        }
        Ok(())
    }

    /// What touches have of these letters.
    pub(super) fn of_touches(&self) -> TouchOutputs {
        let shear = if self.pulls_touches { TouchOutputs::SHEAR } else { TouchOutputs::empty() };
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
        let value = |taxel: &Taxel, axis: Axis| self.place_of(taxel.id, axis).expect("it is read");
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
