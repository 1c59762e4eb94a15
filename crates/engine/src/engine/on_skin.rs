//! Touches of the whole body: what they are found in, frame by frame, and where their links are then.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::letters::SensedValues;
use super::links::{LinkPoses, Links};
use super::self_contacts::SelfContacts;
use super::skin_fits::{FitTrails, Moment, SkinFits};
use super::skin_sigmas::SkinSigmas;
use super::touch_check::TouchCheck;
use super::touch_senses::{PlanAndSkin, Sensed, TouchSenses};
use super::touch_warmth::Trends;
use crate::backend::RawBatch;
use crate::body::Body;
use crate::field::TaxelGraph;
use crate::percept::{Flags, LinkShare, Percepts, TouchFlags, TouchFrame, TouchOutputs};
use crate::scene::{Plan, PlanField, Scene};
use crate::signal::{self, Frame, Intake, LayerResponse, Quantity, RawValue, Response, TaxelCalibration};
use crate::stage::fit::STEPS;
use crate::stage::self_contacts::Memory;
use crate::stage::{calibrate, force};
use crate::touch::{Input, Reading, Skin, SkinTaxel, TouchState, Touches};

/// Flags of a field that holds a taxel without a value, or with a flagged one.
const OF_VALUES: Flags =
    Flags::INCOMPLETE.union(Flags::FAULTY_INPUT).union(Flags::OUT_OF_RANGE).union(Flags::SATURATED).union(Flags::STALE);

/// Raw values or gains beyond this may make a P that is not believed.
const LARGE: f64 = (1_u64 << 29) as f64;

/// Finds the touches of the whole body. The plan's channels are the skin's nodes: both are all pressure taxels by ascending id.
pub(super) struct OnSkin {
    touches: Touches,
    /// The slot of the first channel.
    first_slot: usize,
    /// Whether each channel is in a field, whose flags say what is wrong with its value.
    all_in_fields: bool,
    /// What is to be known before the first frame, a line each.
    remarks: Vec<String>,
    /// Where fits are asked for.
    fits: Option<SkinFits>,
    /// Where self-contacts are asked for.
    self_contacts: Option<SelfContacts>,
    /// Where standard deviations are asked for.
    sigmas: Option<SkinSigmas>,
    /// Where taxels have three axes or measure temperature.
    senses: Option<TouchSenses>,
    /// Memory for a frame.
    without_value: Vec<u32>,
    notes: Vec<(u32, TouchFlags)>,
    poses: LinkPoses,
    is_held: Vec<bool>,
    /// What the host read in the last frame that touches were found in, where that is needed.
    row: Vec<RawValue>,
}

/// What the next touches depend on beside the next frames, and what pressed in the last one.
#[derive(Clone, Debug)]
pub(super) struct OnSkinState {
    touches: TouchState,
    pressed: Vec<(u32, f64)>,
    row: Vec<RawValue>,
    trends: Trends,
    self_contacts: Option<Memory>,
    fits: FitTrails,
}

impl OnSkin {
    /// `None` where touches of the whole body are not asked for.
    pub(super) fn new(body: &Body, plan: &Plan, scene: &Scene, layer: Option<LayerResponse>) -> Option<Self> {
        let (mut options, first_slot) = scene.asked_touches().zip(plan.touched_from)?;
        let (graph, note) = TaxelGraph::from_body(body);
        let mut skin = Skin::new(body, &graph, |taxel| {
            let channel = plan.body_taxels.binary_search(&taxel);
            channel.map_or(Reading::default(), |channel| reading(plan, channel))
        });
        let fields: Vec<Vec<u32>> = plan.fields.iter().map(|field| nodes_of(plan, field, first_slot)).collect();
        let in_fields: BTreeSet<u32> = fields.iter().flatten().copied().collect();
        skin.set_fields(&fields);
        let fits = options.outputs.intersects(TouchOutputs::FIT).then(|| {
            let over_s = options.outputs.contains(TouchOutputs::FIT_VELOCITY).then_some(options.velocity_over_s);
            SkinFits::new(layer, scene.knobs.orientation_by.steps().unwrap_or(STEPS), over_s)
        });
        let sigmas = SkinSigmas::new(options.outputs);
        let senses = TouchSenses::new(body, plan, &skin);
        if fits.is_some() || sigmas.is_some() || senses.as_ref().is_some_and(TouchSenses::needs_taxels) {
            // Which taxels are fitted, vary, or are pulled.
            options.outputs |= TouchOutputs::TAXELS;
        }
        Some(Self {
            first_slot,
            fits,
            self_contacts: SelfContacts::new(body, plan, scene),
            sigmas,
            senses,
            all_in_fields: in_fields.len() == plan.channels(),
            remarks: note.into_iter().chain(sensors_are_unknown(plan, &skin)).collect(),
            touches: Touches::new(Arc::new(skin), options),
            without_value: Vec::new(),
            notes: Vec::new(),
            poses: LinkPoses::default(),
            is_held: Vec::new(),
            row: Vec::new(),
        })
    }

    /// The skin that touches are found on.
    pub(super) fn skin(&self) -> &Skin {
        self.touches.skin()
    }

    /// From now on gives the taxels of touches too.
    pub(super) fn keep_taxels(&mut self) {
        self.touches.keep_taxels();
    }

    /// Remarks before the first frame, a line each: why the edges that the body's file holds are not used, and that
    /// nothing says what its sensors cover.
    pub(super) fn remarks(&self) -> &[String] {
        &self.remarks
    }

    pub(super) fn state(&self) -> OnSkinState {
        OnSkinState {
            touches: self.touches.state(),
            pressed: self.touches.pressed().collect(),
            row: self.row.clone(),
            trends: self.senses.as_ref().map(TouchSenses::trends).unwrap_or_default(),
            fits: self.fits.as_ref().map(SkinFits::state).unwrap_or_default(),
            self_contacts: self.self_contacts.as_ref().map(SelfContacts::state),
        }
    }

    pub(super) fn restore(&mut self, state: &OnSkinState) {
        self.touches.restore(&state.touches);
        self.touches.set_pressed(&state.pressed);
        self.row.clone_from(&state.row);
        self.senses.iter_mut().for_each(|senses| senses.set_trends(&state.trends));
        if let Some(fits) = &mut self.fits {
            fits.restore(&state.fits);
        }
        if let Some((self_contacts, state)) = self.self_contacts.as_mut().zip(state.self_contacts.as_ref()) {
            self_contacts.restore(state);
        }
    }

    /// What presses on each link in the last frame, as [`Touches::on_links`] has it, and pulls.
    pub(super) fn on_links(&self, plan: &Plan, out: &mut Vec<LinkShare>) {
        self.touches.on_links(out);
        if let Some(senses) = &self.senses {
            senses.add_to_links(
                PlanAndSkin { plan, skin: self.touches.skin() },
                &self.row,
                self.touches.pressed(),
                out,
            );
        }
    }

    /// Finds the touches of `frames`, which are those of `raw`; their fields and pressures are in `percepts`. `intake` has noted
    /// what is stale, by frame of the call, and what is corrected in part; `sensed` has what the host reads. With `check`,
    /// touches are compared with their definition.
    pub(super) fn find(
        &mut self,
        (plan, links): (&Plan, &Links),
        frames: &[Frame],
        raw: &RawBatch<'_>,
        (intake, sensed): (&Intake, SensedValues<'_>),
        percepts: &mut Percepts,
        mut check: Option<&mut TouchCheck>,
    ) {
        for (offset, frame) in frames.iter().enumerate() {
            let index = raw.first + offset;
            let stale = intake.stale().get(index).map_or(&[][..], Vec::as_slice);
            self.look_at_values(plan, raw, offset, stale, percepts);
            self.look_at_corrected(plan, intake.notes().get(index).map_or(&[][..], Vec::as_slice));
            if let Some(senses) = self.senses.as_ref().filter(|_| !stale.is_empty()) {
                self.notes.extend(senses.stale_nodes(plan, stale).map(|node| (node, TouchFlags::STALE)));
            }
            let mut found = percepts.take_touch_frame(index);
            let slots = plan.slots();
            let pressures = &percepts.pressures[index * slots..][..slots][self.first_slot..][..plan.channels()];
            let input = Input {
                t_s: frame.t_s,
                restarts: raw.steps[offset].restarts(),
                pressures,
                without_value: &self.without_value,
                notes: &self.notes,
            };
            let before = check.is_some().then(|| self.touches.state());
            self.touches.step(input, &mut found);
            if let Some((check, before)) = check.as_deref_mut().zip(before) {
                let number = percepts.frame_number(index);
                check.compare((offset, number), &input, (&before, &self.touches), &found);
            }
            let flags = &mut percepts.flags[index * plan.fields.len()..][..plan.fields.len()];
            flag_several(&found, flags, &mut self.is_held);
            if let Some(sigmas) = &mut self.sigmas {
                sigmas.add((plan, self.touches.skin()), raw, offset, pressures, &mut found);
            }
            self.poses.clear();
            if !found.touches.is_empty() && links.may_pose(frame) {
                links.poses_into(index, frame, &mut self.poses);
            }
            if let Some(senses) = &mut self.senses {
                let (row, poses) = (sensed.row(index), self.poses.as_slice());
                let sensed = Sensed { t_s: frame.t_s, raw, offset, row, pressures, poses };
                senses.add(PlanAndSkin { plan, skin: self.touches.skin() }, &sensed, &mut found);
            }
            put_in_world(self.poses.as_slice(), &mut found);
            if let Some(self_contacts) = &mut self.self_contacts {
                let (contacts, are_known) = self_contacts.find(&found, input.restarts);
                percepts.push_self_contacts(contacts, are_known);
            }
            if let Some(fits) = &mut self.fits {
                let moment = Moment { offset, t_s: frame.t_s, poses: self.poses.as_slice() };
                fits.take((plan, self.touches.skin()), raw, moment, &mut found);
            }
            percepts.put_touch_frame(index, found);
        }
        if let Some(last) = frames.len().checked_sub(1).filter(|_| self.senses.is_some()) {
            self.row.clear();
            self.row.extend_from_slice(sensed.row(raw.first + last));
        }
        if let Some(fits) = &mut self.fits {
            fits.finish(self.touches.skin(), percepts);
        }
    }

    /// Notes which taxels have no value in a frame, and what is to be said of those that have one.
    fn look_at_values(&mut self, plan: &Plan, raw: &RawBatch<'_>, offset: usize, stale: &[usize], percepts: &Percepts) {
        self.without_value.clear();
        self.notes.clear();
        let fields = plan.fields.len();
        let flags = &percepts.flags[(raw.first + offset) * fields..][..fields];
        if self.all_in_fields && stale.is_empty() && !flags.iter().any(|flags| flags.intersects(OF_VALUES)) {
            return;
        }
        let pressures = &percepts.pressures[(raw.first + offset) * plan.slots()..][self.first_slot..];
        let calibrations = plan.calibrations.iter();
        for (channel, (value, calibration)) in raw.rows.row(offset).zip(calibrations).enumerate() {
            let node = channel as u32;
            let has_value = has_value(value, calibration, || {
                let response = plan.taxels[self.first_slot + channel].response;
                calibrate::pressure(value, calibration, plan.curves.table(response)).is_some()
            });
            let mut note = TouchFlags::empty();
            if !has_value {
                self.without_value.push(node);
                note |= if value.is_missing() { TouchFlags::INCOMPLETE } else { TouchFlags::FAULTY_INPUT };
            } else if pressures[channel] > 0.0 {
                let [low, high] = calibration.raw_range.map(f64::from);
                if value.number().is_some_and(|value| !(low..=high).contains(&value)) {
                    note |= TouchFlags::OUT_OF_RANGE;
                }
                if pressures[channel] > calibration.p_max {
                    note |= TouchFlags::SATURATED;
                }
            }
            if !note.is_empty() {
                self.notes.push((node, note));
            }
        }
        let channels = stale.iter().filter_map(|taxel| plan.body_taxels.binary_search(taxel).ok());
        self.notes.extend(channels.map(|channel| (channel as u32, TouchFlags::STALE)));
    }

    /// Notes which taxels are corrected in part, or were out of range before: touches that hold them say so.
    fn look_at_corrected(&mut self, plan: &Plan, noted: &[(usize, signal::Reading)]) {
        let on_skin = |&(taxel, reading): &(usize, signal::Reading)| {
            let channel = plan.body_taxels.binary_search(&taxel).ok()?;
            Some((channel as u32, flag_of(reading)))
        };
        self.notes.extend(noted.iter().filter_map(on_skin));
    }
}

/// What a touch is flagged with for a reading that is out of range or none.
fn flag_of(reading: signal::Reading) -> TouchFlags {
    match reading {
        signal::Reading::Missing => TouchFlags::INCOMPLETE,
        signal::Reading::Faulty => TouchFlags::FAULTY_INPUT,
        signal::Reading::Value(..) => TouchFlags::OUT_OF_RANGE,
    }
}

/// Flags the fields that hold parts of several of the touches `found`. `is_held` is memory: by field, whether one holds a part of it.
fn flag_several(found: &TouchFrame, flags: &mut [Flags], is_held: &mut Vec<bool>) {
    if found.touches.len() < 2 {
        return;
    }
    is_held.clear();
    is_held.resize(flags.len(), false);
    for share in found.touches.iter().flat_map(|touch| found.fields(touch)) {
        let field = share.field as usize;
        if std::mem::replace(&mut is_held[field], true) {
            flags[field] |= Flags::SEVERAL;
        }
    }
}

/// Whether a raw value counts; `is_believed` says whether its P does, where that may be too large.
fn has_value(value: RawValue, calibration: &TaxelCalibration, is_believed: impl FnOnce() -> bool) -> bool {
    let Some(number) = value.number() else { return false };
    if calibration.mask {
        return false;
    }
    let is_usual = number.abs() < LARGE && calibration.baseline.abs() < LARGE && calibration.gain.abs() < LARGE;
    (is_usual && calibration.response == Response::Linear) || is_believed()
}

/// The channels of the members of a field that is read in the slots from `first_slot` on.
fn nodes_of(plan: &Plan, field: &PlanField, first_slot: usize) -> Vec<u32> {
    let slots = plan.members_of(field).iter().map(|member| member.slot as usize);
    slots
        .filter_map(|slot| slot.checked_sub(first_slot))
        .filter(|&node| node < plan.channels())
        .map(|node| node as u32)
        .collect()
}

/// How the value of the taxel at `channel` counts in touches.
fn reading(plan: &Plan, channel: usize) -> Reading {
    let calibration = &plan.calibrations[channel];
    Reading {
        newton_at_one: force::newtons_per_p(calibration.quantity, plan.areas[channel]).unwrap_or(0.0),
        weighs_by_cell: calibration.weighs_by_cell(),
        sigma: sigma(plan, channel),
    }
}

/// That sensors that give counts are taken to be of one size, where the calibration does not say what they cover, that matters, and the
/// layout does not show it.
fn sensors_are_unknown(plan: &Plan, skin: &Skin) -> Option<String> {
    /// Sizes that differ by less than this factor are one.
    const ALIKE: f64 = 1.05;
    let unsaid = |calibration: &TaxelCalibration| {
        calibration.quantity == Quantity::Count && calibration.sensors.is_none() && !calibration.mask
    };
    let taxels = || plan.calibrations.iter().zip(skin.taxels()).filter(|(calibration, _)| unsaid(calibration));
    let are_alike = |size: fn(&SkinTaxel) -> f64| {
        let range = |(low, high): (f64, f64), size: f64| (low.min(size), high.max(size));
        let (low, high) = taxels().map(|(_, taxel)| size(taxel)).fold((f64::INFINITY, 0.0), range);
        low > 0.0 && high <= ALIKE * low
    };
    // Without a calibration nobody has begun to say anything.
    let is_calibrated = plan.calibrations.iter().any(|calibration| *calibration != TaxelCalibration::default());
    let matters =
        is_calibrated && taxels().count() > 1 && !are_alike(|taxel| taxel.cell_m2) && !are_alike(|taxel| taxel.area_m2);
    matters.then(|| {
        "the calibration does not say what its sensors cover: counts weigh by the areas of taxels' cells in the place and axis of a \
         touch, as of sensors of one size; give it `sensors = \"equal\"`, or \"cell\" if each covers its cell"
            .to_owned()
    })
}

/// The standard deviation of the noise of P, about: where it is not known, that of half a count, or a third of the dead band.
fn sigma(plan: &Plan, channel: usize) -> f64 {
    /// Noise of a raw value that is not known.
    const HALF_A_COUNT: f64 = 0.5;
    let calibration = &plan.calibrations[channel];
    let slot = plan.touched_from.unwrap_or(0) + channel;
    let knots = plan.curves.table(plan.taxels[slot].response).written;
    let slope = match (knots.first(), knots.last()) {
        (Some(first), Some(last)) if last[0] > first[0] => ((last[1] - first[1]) / (last[0] - first[0])).abs(),
        _ => calibration.gain.abs(),
    };
    match calibration.noise {
        Some(noise) => slope * noise,
        None => (slope * HALF_A_COUNT).max(calibration.dead_band / 3.0),
    }
}

/// Puts the touches whose links `poses` has into the world.
fn put_in_world(poses: &[Option<DAffine3>], found: &mut TouchFrame) {
    for touch in &mut found.touches {
        let Some(world_from_link) = poses.get(touch.link as usize).copied().flatten() else { continue };
        let turn = |direction: &mut DVec3| *direction = world_from_link.transform_vector3(*direction);
        touch.position = world_from_link.transform_point3(touch.position);
        touch.centre = world_from_link.transform_point3(touch.centre);
        turn(&mut touch.normal);
        let vectors = [&mut touch.principal_axis, &mut touch.orientation, &mut touch.velocity];
        let pulls = [&mut touch.shear, &mut touch.force_vector_newton];
        vectors.into_iter().chain(pulls).flatten().for_each(turn);
        touch.in_world = true;
    }
}
