//! How a plan is made: what is read, then the fields one by one, then what follows from all of them.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;

use super::super::curves::Curves;
use super::super::left_out::{LeftOut, is_pressure, pressed_members};
use super::super::members::{parts, quantity_of, surface, thresholds, unit_of, weights};
use super::super::onset::softened;
use super::super::senses::{ForTouches, Senses, letters_and_outputs};
use super::super::stages::Stages;
use super::super::{Coordinates, Scene, choose_fields};
use super::{Plan, PlanField};
use crate::body::{Body, KeptOfShape, Modality, Nearest};
use crate::error::{Error, Result, nearest};
use crate::field::{Field, FieldSet, WORLD};
use crate::percept::{Outputs, TouchOutputs};
use crate::signal::{Calibration, DriftKeys, Letter, Receptor, Response, TaxelCalibration};
use crate::stage::hysteresis::Thresholds;
use crate::stage::layout;

impl Plan {
    /// The plan for `scene` on `body`, whose fields are `fields`, with one robot's `calibration`.
    ///
    /// # Errors
    /// The body has no taxels or no fields; a glob is malformed or matches nothing; the calibration is for another body
    /// or has a curve that cannot be computed with; a field mixes quantities; the scene asks for a signal that no sensor has, for no
    /// letter, for one twice, or for a filter of motion that lets nothing pass.
    pub fn new(body: &Body, fields: &FieldSet, scene: &Scene, calibration: &Calibration) -> Result<Self> {
        check(body, fields, scene, calibration)?;
        let calibration = &*calibration.of_corrected(body);
        let chosen = choose_fields(fields, &scene.fields).map_err(|e| e.at(&body.name))?;
        let outputs = scene.knobs.orientation_by.applied(scene.outputs);
        let is_drifting = calibration.drift != DriftKeys::default();
        let (letters, outputs) = letters_and_outputs(body, fields, &chosen, scene, outputs, is_drifting)?;
        let left_out = LeftOut::from_fields(body, &chosen, fields, &letters);
        let chosen = left_out.feeling(body, chosen, fields)?;
        // Nobody named letters, and there are no pressures to find touches in.
        let feels_pressure = !letters.is_empty() && letters.iter().any(|letter| letter.receptor.is_of_pressure());
        let touches = scene.asked_touches().filter(|_| feels_pressure || !scene.letters.is_empty());
        let read = read(body, fields, touches.is_some(), &chosen);
        let mut plan = Self::without_fields(body, scene, calibration, read, outputs)?;
        let for_touches = ForTouches::new(body, scene, &letters, touches.is_some());
        plan.senses = Senses::new(body, fields, &chosen, &letters, calibration, for_touches);
        plan.stages.senses = letters.iter().any(|letter| !letter.receptor.is_of_pressure());
        plan.letters = letters;
        let tells_shear = plan.letters.iter().any(|letter| letter.receptor == Receptor::Shear);
        plan.senses.check_shear(body, (&plan.body_taxels, &plan.calibrations), tells_shear)?;
        let of_touches = touches.map_or(TouchOutputs::empty(), |touches| touches.outputs);
        plan.senses.check_touches(body, of_touches).map_err(|e| e.at(&body.name))?;
        plan.touch_outputs = touches.map(|touches| touches.outputs | plan.senses.of_touches());
        plan.left_out = left_out.but_for(plan.touch_outputs);
        let first_slots = plan.lay_out_slots(calibration)?;
        if touches.is_some() {
            plan.find_touches(&first_slots)?;
        }
        plan.note_what_is_felt();
        let parents = chosen.iter().filter_map(|&index| fields.fields[index].parent).collect();
        let from = Sources {
            body,
            scene,
            calibration,
            nearest: Nearest::new(body),
            kept: body.kept_of_shape(),
            parents,
            first_slots,
        };
        let mut made =
            FieldsMade { fields: Vec::with_capacity(chosen.len() * plan.letters.len()), members: Vec::new() };
        for index in chosen {
            made.add(&plan, &from, index, &fields.fields[index])?;
        }
        plan.take_fields(made);
        plan.choose_columns();
        Ok(plan)
    }

    /// A plan that reads `body_taxels` and has no fields yet.
    fn without_fields(
        body: &Body,
        scene: &Scene,
        calibration: &Calibration,
        body_taxels: Vec<usize>,
        outputs: Outputs,
    ) -> Result<Self> {
        let calibrated = |taxel: usize| {
            // Backends have a channel at least.
            let mask = calibration.taxels[taxel].mask || !is_pressure(body, taxel);
            TaxelCalibration { mask, ..calibration.taxels[taxel] }
        };
        let (calibrations, onsets) = softened(body_taxels.iter().map(|&taxel| calibrated(taxel)));
        Ok(Self {
            outputs,
            stages: Stages::for_outputs(outputs),
            columns: outputs,
            letters: Vec::new(),
            senses: Senses::default(),
            knobs: scene.knobs,
            relative_to: scene.checked_link(body)?,
            change_dead_band: calibration.change.dead_band,
            calibrations,
            onsets,
            calibration_changes: 0,
            areas: body_taxels.iter().map(|&taxel| body.taxels[taxel].area).collect(),
            calibrated: 0,
            taxels: Vec::new(),
            curves: Curves::default(),
            feels_from: Vec::new(),
            touched_from: None,
            touch_outputs: None,
            spread_slots: Vec::new(),
            heaviest: Vec::new(),
            left_out: LeftOut::default(),
            fields: Arc::default(),
            members: Arc::default(),
            body_taxels,
        })
    }

    /// Takes the fields, and what follows from all of them together.
    fn take_fields(&mut self, FieldsMade { fields, members }: FieldsMade) {
        let members_of = |field: &PlanField| &members[field.first..][..field.count];
        let heaviest = |field| members_of(field).iter().fold(0.0, |most, member| f32::max(most, member.weight));
        self.heaviest = fields.iter().map(heaviest).collect();
        let spread = fields.iter().filter(|field| !field.parts.is_empty());
        let slots: BTreeSet<u32> =
            spread.flat_map(|field| members_of(field).iter().map(|member| member.slot)).collect();
        self.spread_slots = slots.into_iter().collect();
        self.stages.hysteresis = fields.iter().any(|field| field.thresholds != Thresholds::default());
        self.fields = fields.into();
        self.members = members.into();
        if !self.presses() {
            // What is asked of pressures is asked of no field.
            let Stages { pressures, senses, .. } = self.stages;
            let pressures = pressures && self.touched_from.is_some();
            let others = Stages::for_outputs(self.outputs & (Outputs::OF_OTHER_LETTERS | Outputs::SELF_CONTACTS));
            self.stages = Stages { pressures, senses, ..others };
        }
    }

    /// Adds to the columns what stages work on.
    fn choose_columns(&mut self) {
        if self.stages.hysteresis {
            self.columns |= Outputs::TOTAL;
        }
        if self.stages.position || self.stages.filter {
            self.columns |= Outputs::CENTROID;
        }
        self.columns |= self.read_back();
        if self.stages.motion || self.stages.filter {
            self.columns |= Outputs::ACTIVE;
        }
    }
}

/// Refuses what does not go together.
fn check(body: &Body, fields: &FieldSet, scene: &Scene, calibration: &Calibration) -> Result<()> {
    if body.taxels.is_empty() {
        let what = "the body has no taxels: add some, as with `somatic author --taxels 500`";
        return Err(Error::failed(what).at(&body.name));
    }
    if fields.fields.is_empty() {
        return Err(Error::failed("the body has no fields: add some with `somatic author`").at(&body.name));
    }
    calibration.check_body(&body.name)?;
    for (index, taxel) in body.taxels.iter().enumerate().filter(|(_, taxel)| taxel.modality == Modality::Force3) {
        calibration.check_leak(index, taxel.id).map_err(|e| e.at(&body.name))?;
    }
    Letter::check(&scene.letters)?;
    let has_changes = scene.letters.iter().any(|letter| letter.receptor == Receptor::Change);
    scene.knobs.check(scene.outputs, has_changes, scene.touches.is_some())?;
    scene.check_world()?;
    let is_fsr = |taxel: &TaxelCalibration| matches!(taxel.response, Response::Fsr(_));
    let signal = scene.letters.iter().find_map(|letter| letter.signal);
    if let Some(signal) = signal.filter(|_| !calibration.taxels.iter().any(is_fsr)) {
        return Err(Error::usage(format!(
            "signal `{signal}` is for sensors of kind `fsr`, and the calibration has none; give it `sensor = \"fsr\"` under [all] or [taxel.ID]"
        )));
    }
    if let Some(name) = calibration.fields.keys().find(|name| !fields.fields.iter().any(|f| f.name == **name)) {
        let near = nearest(name, fields.fields.iter().map(|field| field.name.as_str()));
        let hint = near.map_or("`somatic inspect` lists the fields".into(), |near| format!("did you mean `{near}`?"));
        let what = format!("the calibration has thresholds for field `{name}`, which the body does not have: {hint}");
        return Err(Error::failed(what).at(&body.name));
    }
    Ok(())
}

/// The taxels of `body` whose pressures are read: those of the `chosen` fields, and with touches all. Where none feels pressure, the
/// first taxel stands for one.
fn read(body: &Body, fields: &FieldSet, has_touches: bool, chosen: &[usize]) -> Vec<usize> {
    let of_fields = chosen.iter().flat_map(|&f| fields.fields[f].members.iter().map(|member| member.taxel));
    let of_touches = (0..body.taxels.len()).filter(|_| has_touches);
    let read: BTreeSet<usize> = of_fields.chain(of_touches).filter(|&taxel| is_pressure(body, taxel)).collect();
    if read.is_empty() { vec![0] } else { read.into_iter().collect() }
}

/// What fields are made of.
struct Sources<'a> {
    body: &'a Body,
    scene: &'a Scene,
    calibration: &'a Calibration,
    nearest: Nearest<'a>,
    kept: KeptOfShape<'a>,
    /// The fields that have others of the plan in them.
    parents: BTreeSet<usize>,
    /// Each letter's first slot.
    first_slots: Vec<u32>,
}

/// The fields so far, and their members.
struct FieldsMade {
    fields: Vec<PlanField>,
    members: Vec<layout::Member>,
}

impl FieldsMade {
    /// Adds `field`, the body's field `index`, in every letter that its taxels have.
    fn add(&mut self, plan: &Plan, from: &Sources<'_>, index: usize, field: &Field) -> Result<()> {
        let pressed = pressed_members(from.body, field);
        let shape = if pressed.members.is_empty() { field } else { &pressed };
        let in_first = made_in_first_letter(plan, from, index, shape)?;
        let channel_of = |taxel: usize| plan.body_taxels.binary_search(&taxel).expect("its field was chosen") as u32;
        for (letter, &first_slot) in from.first_slots.iter().enumerate() {
            let receptor = plan.letters[letter].receptor;
            if !receptor.is_of_pressure() {
                let sensed = plan.senses.members(from.body, &plan.body_taxels, field, receptor);
                if !sensed.is_empty() {
                    self.fields.push(in_first.clone().of_senses(letter, self.members.len(), receptor, sensed));
                }
                continue;
            }
            if pressed.members.is_empty() {
                continue;
            }
            // The same in every letter, but for what it reads and when it counts as touched.
            let in_letter = PlanField {
                letter,
                first: self.members.len(),
                thresholds: thresholds(from.calibration, &field.name, receptor),
                ..in_first.clone()
            };
            self.members.extend(pressed.members.iter().zip(&in_letter.places).map(|(member, place)| layout::Member {
                slot: first_slot + channel_of(member.taxel),
                weight: member.weight as f32,
                u: place.x as f32,
                v: place.y as f32,
            }));
            self.fields.push(in_letter);
        }
        Ok(())
    }
}

/// A field of the plan but for its place among the members and its thresholds.
fn made_in_first_letter(plan: &Plan, from: &Sources<'_>, index: usize, field: &Field) -> Result<PlanField> {
    let Sources { body, scene, calibration, nearest, kept, parents, .. } = from;
    let (count, unit_m) = (field.members.len(), unit_of(field.radius_m()));
    let places: Vec<DVec3> = field.members.iter().map(|member| member.place / f64::from(unit_m)).collect();
    let still = layout::Still::new(plan.sums(count), count, field.radius_m() / f64::from(unit_m));
    let has_parts = plan.stages.position && scene.coordinates == Coordinates::World;
    Ok(PlanField {
        name: field.name.clone(),
        letter: 0,
        link: field.anchor.map_or(WORLD, |anchor| &body.links[anchor].name).to_owned(),
        anchor: field.anchor,
        first: 0,
        count,
        charted: field.chart.is_ok(),
        divided: parents.contains(&index),
        quantity: quantity_of(body, field, calibration)?,
        area_known: field.members.iter().all(|member| body.taxels[member.taxel].area > 0.0),
        weights: weights(field),
        unweighted: field.members.iter().all(|member| member.weight as f32 == 1.0),
        unit_m,
        thresholds: Thresholds::default(),
        still,
        filter: scene.filter.settings(field.spacing_m(), still, f64::from(unit_m))?,
        parts: if has_parts { parts(body, field) } else { Arc::default() },
        depths: places.iter().map(|place| place.z as f32).collect(),
        origin_in_anchor: field.origin_in_anchor,
        chart: field.chart.as_ref().ok().cloned(),
        no_chart: field.chart.as_ref().err().cloned(),
        sensed: Arc::default(),
        surface: plan.stages.position.then(|| surface(nearest, kept, field)).flatten(),
        spacing: field.spacing_m() / f64::from(unit_m),
        places,
    })
}
