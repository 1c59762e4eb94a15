//! Letters that are not made of pressures, over a batch: shear, temperature and proximity of every field that has such taxels.
//!
//! They are made here of raw values, in double precision, alike on every backend.

use glam::{DAffine3, DVec2, DVec3};

use super::links::Links;
use super::spread::{Frames, Now};
use crate::backend::Step;
use crate::percept::{Flags, Host, Outputs, Percepts};
use crate::scene::{Plan, PlanField, SensedMember};
use crate::signal::{RawValue, Reading, Receptor, SenseCalibration, ShearCalibration, TaxelCalibration};
use crate::stage::proximity::{LEAST_M, Near};
use crate::stage::shear::Pulled;
use crate::stage::temperature::Warm;
use crate::stage::window::Window;
use crate::stage::{calibrate, force, proximity, shear, temperature};

/// The values of the frames of a call that such letters are made of.
#[derive(Clone, Copy, Default)]
pub(super) struct SensedValues<'a> {
    pub(super) values: &'a [RawValue],
    /// Values of a frame.
    pub(super) width: usize,
}

impl<'a> SensedValues<'a> {
    pub(super) fn row(self, frame: usize) -> &'a [RawValue] {
        &self.values[frame * self.width..][..self.width]
    }
}

/// A field of a plan in one frame of a call.
pub(super) struct Cell<'a> {
    pub(super) plan: &'a Plan,
    pub(super) field: &'a PlanField,
    pub(super) frames: Frames<'a>,
    /// The frame's number in the call.
    pub(super) frame: usize,
    pub(super) step: &'a Step,
    pub(super) sensed: SensedValues<'a>,
}

/// Which channels nothing presses in a frame: found when the first field asks, as fields share taxels.
#[derive(Default)]
pub(super) struct Quiet(Vec<bool>);

impl Quiet {
    fn of(&mut self, cell: &Cell<'_>) -> &[bool] {
        if self.0.is_empty() {
            let plan = cell.plan;
            let row = cell.frames.raw.rows.row(cell.frames.offset);
            let is_quiet =
                |(channel, raw)| calibrate::is_quiet(raw, &plan.calibrations[channel], plan.curve_of(channel));
            self.0.extend(row.enumerate().map(is_quiet));
        }
        &self.0
    }
}

/// The frame that places and directions of a cell are in.
enum Frame {
    World,
    Anchor,
    /// The links lie apart, and where they are is not known.
    Nowhere,
}

/// What came of a cell.
struct Made<'a> {
    percepts: &'a mut Percepts,
    cell: usize,
    flags: Flags,
    /// Whether something is there to tell of.
    is_there: bool,
}

impl Made<'_> {
    fn give(&mut self, output: Outputs, host: Host, components: &[f64]) {
        if self.percepts.outputs().contains(output) {
            self.percepts.add_present(self.cell, output);
            self.percepts.set_host(host, self.cell, components);
        }
    }
}

impl Cell<'_> {
    /// Makes the cell `cell` of `percepts`, of which the backend knows nothing. `now` and `quiet` have what the fields of a frame share,
    /// and `window` what the letter measured before.
    pub(super) fn make(
        &self,
        cell: usize,
        percepts: &mut Percepts,
        (now, quiet): (&mut Now, &mut Quiet),
        window: &mut Window,
    ) {
        percepts.set_present(cell, Outputs::empty());
        let mut made = Made { percepts, cell, flags: Flags::empty(), is_there: false };
        if self.step.restarts() {
            window.clear();
        }
        let senses = &self.plan.senses;
        match self.plan.letters()[self.field.letter].receptor {
            Receptor::Sustained | Receptor::Change => {}
            Receptor::Shear => senses.shear.iter().for_each(|shear| self.shear(shear, quiet.of(self), now, &mut made)),
            Receptor::Temperature => {
                senses.temperature.iter().for_each(|by| self.temperature(by, now, &mut made, window));
            }
            Receptor::Proximity => {
                senses.proximity.iter().for_each(|by| self.proximity(by, now, &mut made, window));
            }
        }
        made.flags.set(Flags::NO_CONTACT, !made.is_there);
        made.flags.set(Flags::NO_CHART, self.field.chart.is_none());
        made.percepts.flags[cell] = made.flags;
    }

    /// Which frame places of `members` are in.
    fn frame_of(&self, mut members: impl Iterator<Item = usize>, now: &mut Now) -> Frame {
        let frame = &self.frames.frames[0];
        let links: &Links = self.frames.links;
        if links.are_posed(frame) {
            let poses = self.frames.poses(0, now);
            if members.all(|member| poses[self.field.sensed[member].link].is_some()) {
                return Frame::World;
            }
        }
        let first = self.field.sensed[0].link;
        let is_apart = links.may_pose(frame) && self.field.sensed.iter().any(|member| member.link != first);
        if is_apart { Frame::Nowhere } else { Frame::Anchor }
    }

    fn world_from_link(&self, member: &SensedMember, now: &mut Now) -> DAffine3 {
        self.frames.poses(0, now)[member.link].unwrap_or(DAffine3::IDENTITY)
    }

    /// Gives where `member` is, and its normal if `normal` is wanted.
    fn give_place(
        &self,
        member: usize,
        (output, host): (Outputs, Host),
        normal: Option<(Outputs, Host)>,
        now: &mut Now,
        made: &mut Made<'_>,
    ) {
        let (own, frame) = (&self.field.sensed[member], self.frame_of(std::iter::once(member), now));
        let (position, outward) = match frame {
            Frame::World => {
                let world = self.world_from_link(own, now);
                (world.transform_point3(own.position_in_link), world.transform_vector3(own.normal_in_link))
            }
            Frame::Anchor => (own.position_in_anchor, own.normal_in_anchor),
            Frame::Nowhere => {
                made.flags |= Flags::NO_POSE;
                return;
            }
        };
        made.percepts.in_world[made.cell] = matches!(frame, Frame::World);
        made.give(output, host, &position.to_array());
        if let Some((output, host)) = normal {
            made.give(output, host, &outward.to_array());
        }
    }

    /// The members that have a reading, by `read` of its value, and the flags of the others.
    fn readings<T>(
        &self,
        by: &SenseCalibration,
        made: &mut Made<'_>,
        read: impl Fn(&SensedMember, f64, bool, &mut Flags) -> Option<T>,
    ) -> (Vec<usize>, Vec<T>) {
        let row = self.sensed.row(self.frame);
        let (mut members, mut values) = (Vec::new(), Vec::new());
        for (index, member) in self.field.sensed.iter().enumerate() {
            match by.of_taxel(member.taxel).read(row[member.values[0]]) {
                Reading::Missing => made.flags |= Flags::INCOMPLETE,
                Reading::Faulty => made.flags |= Flags::FAULTY_INPUT,
                Reading::Value(value, is_in_range) => {
                    if let Some(value) = read(member, value, is_in_range, &mut made.flags) {
                        members.push(index);
                        values.push(value);
                    }
                }
            }
        }
        (members, values)
    }

    fn temperature(&self, by: &SenseCalibration, now: &mut Now, made: &mut Made<'_>, window: &mut Window) {
        let (members, warm) = self.readings(by, made, |member, celsius, is_in_range, flags| {
            flags.set(Flags::OUT_OF_RANGE, flags.contains(Flags::OUT_OF_RANGE) || !is_in_range);
            Some(Warm { weight: member.weight, celsius, place_m: member.place_m })
        });
        if warm.is_empty() {
            window.clear();
            return;
        }
        made.is_there = true;
        let mean = temperature::mean(&warm);
        made.give(Outputs::TEMPERATURE, Host::Temperature, &[mean]);
        let warmest = [
            (Outputs::WARMEST, Host::Warmest),
            (Outputs::WARMEST_TAXEL, Host::WarmestTaxel),
            (Outputs::WARMEST_POSITION, Host::WarmestPosition),
        ];
        let coldest = [
            (Outputs::COLDEST, Host::Coldest),
            (Outputs::COLDEST_TAXEL, Host::ColdestTaxel),
            (Outputs::COLDEST_POSITION, Host::ColdestPosition),
        ];
        for (found, [value, taxel, position]) in
            [(temperature::extreme(&warm, |a, b| a > b), warmest), (temperature::extreme(&warm, |a, b| a < b), coldest)]
        {
            let Some(found) = found else { continue };
            made.give(value.0, value.1, &[warm[found].celsius]);
            made.give(taxel.0, taxel.1, &[f64::from(self.field.sensed[members[found]].id)]);
            self.give_place(members[found], position, None, now, made);
        }
        if self.field.chart.is_some()
            && let Some(gradient) = temperature::gradient(&warm)
        {
            made.give(Outputs::TEMPERATURE_GRADIENT, Host::TemperatureGradient, &gradient.to_array());
        }
        match window.take(self.t_s(), mean, by.window_s) {
            Some(rate) => made.give(Outputs::TEMPERATURE_RATE, Host::TemperatureRate, &[rate]),
            None => made.flags |= Flags::NO_PREVIOUS,
        }
    }

    fn t_s(&self) -> f64 {
        self.frames.frames[0].t_s
    }

    fn proximity(&self, by: &SenseCalibration, now: &mut Now, made: &mut Made<'_>, window: &mut Window) {
        let (members, near) = self.readings(by, made, |member, distance_m, is_in_range, flags| {
            if !is_in_range || distance_m > by.range_m {
                return None;
            }
            if distance_m < LEAST_M {
                *flags |= Flags::SATURATED;
            }
            Some(Near { distance_m: distance_m.max(LEAST_M), place_m: member.place_m })
        });
        made.give(Outputs::COVERED, Host::Covered, &[near.len() as f64]);
        let Some(nearest) = proximity::nearest(&near) else {
            made.flags |= Flags::OUT_OF_RANGE;
            window.clear();
            return;
        };
        made.is_there = true;
        let (member, distance_m) = (members[nearest], near[nearest].distance_m);
        made.give(Outputs::NEAREST, Host::Nearest, &[distance_m]);
        made.give(Outputs::NEAREST_TAXEL, Host::NearestTaxel, &[f64::from(self.field.sensed[member].id)]);
        let [position, normal] =
            [(Outputs::NEAREST_POSITION, Host::NearestPosition), (Outputs::NEAREST_NORMAL, Host::NearestNormal)];
        self.give_place(member, position, Some(normal), now, made);
        if self.field.chart.is_some() {
            let centroid = proximity::centroid(&near).to_array();
            made.give(Outputs::PROXIMITY_CENTROID, Host::ProximityCentroid, &centroid);
        }
        match window.take(self.t_s(), distance_m, by.window_s) {
            // From 0, so that what stays has no sign.
            Some(slope) => made.give(Outputs::APPROACH_SPEED, Host::ApproachSpeed, &[0.0 - slope]),
            None => made.flags |= Flags::NO_PREVIOUS,
        }
    }

    /// The members that are pressed and whose tangential forces are known, and what they feel. `quiet` says by channel which need no
    /// look.
    fn pulled(&self, by: &ShearCalibration, quiet: &[bool], made: &mut Made<'_>) -> (Vec<usize>, Vec<Pulled>) {
        let (plan, row) = (self.plan, self.sensed.row(self.frame));
        let (mut members, mut pulled) = (Vec::new(), Vec::new());
        for (index, member) in self.field.sensed.iter().enumerate() {
            let Some(channel) = member.channel.filter(|&channel| !quiet[channel]) else { continue };
            let (calibration, curve) = (&plan.calibrations[channel], plan.curve_of(channel));
            let raw = self.frames.raw.rows.value(self.frames.offset, channel);
            let own = calibrate::reference(raw, calibration, curve);
            made.flags |= Flags::from_bits_truncate(own.status & !calibrate::UNUSABLE);
            if own.value <= 0.0 {
                continue;
            }
            let gain = tangential_gain(by, member.taxel, calibration);
            let [su, sv] = match tangential(by, member.taxel, gain, own.value, member.values.map(|value| row[value])) {
                Ok(pulls) => pulls,
                Err(why) => {
                    made.flags |= why;
                    continue;
                }
            };
            let [tu, tv] = member.tangents_in_chart;
            members.push(index);
            pulled.push(Pulled {
                weight: member.weight,
                pressure: own.value,
                shear: su * tu + sv * tv,
                // Along its own tangents, until the frame is known.
                shear_in_space: DVec3::new(su, sv, 0.0),
                place_m: member.place_m,
                newtons_per_p: force::newtons_per_p(calibration.quantity, plan.areas[channel]),
                sigmas: calibration.noise.map(|noise| {
                    let of_pressure = raw.number().map_or(0.0, |raw| calibrate::sigma(raw, noise, calibration, curve));
                    [of_pressure, gain.abs() * noise]
                }),
                ..Pulled::default()
            });
        }
        (members, pulled)
    }

    fn shear(&self, by: &ShearCalibration, quiet: &[bool], now: &mut Now, made: &mut Made<'_>) {
        let (members, mut pulled) = self.pulled(by, quiet, made);
        if pulled.is_empty() {
            return;
        }
        made.is_there = true;
        let frame = self.frame_of(members.iter().copied(), now);
        for (&index, taxel) in members.iter().zip(&mut pulled) {
            let member = &self.field.sensed[index];
            let DVec3 { x: su, y: sv, .. } = taxel.shear_in_space;
            let ([tu, tv], normal) = match frame {
                Frame::World => {
                    let world = self.world_from_link(member, now);
                    let turned = |direction| world.transform_vector3(direction);
                    (member.tangents_in_link.map(turned), turned(member.normal_in_link))
                }
                _ => (member.tangents_in_anchor, member.normal_in_anchor),
            };
            (taxel.shear_in_space, taxel.normal) = (su * tu + sv * tv, normal);
        }
        let found = shear::reference(&pulled, self.field.chart.is_some());
        if matches!(frame, Frame::Nowhere) {
            made.flags |= Flags::NO_POSE;
        } else {
            made.percepts.in_world[made.cell] = matches!(frame, Frame::World);
            made.give(Outputs::SHEAR_VECTOR, Host::ShearVector, &found.in_space.to_array());
            match found.force {
                Some(newtons) => made.give(Outputs::FORCE_VECTOR, Host::ForceVector, &newtons.to_array()),
                None => made.flags |= Flags::NO_UNIT,
            }
        }
        if self.field.chart.is_some() {
            self.along_chart(&found, made);
        }
        made.give(Outputs::FRICTION, Host::Friction, &[found.friction]);
        if made.percepts.outputs().contains(Outputs::FRICTION_SIGMA) {
            match found.friction_sigma {
                Some(sigma) => made.give(Outputs::FRICTION_SIGMA, Host::FrictionSigma, &[sigma]),
                None => made.flags |= Flags::NOISE_UNKNOWN,
            }
        }
        if let Some(slips_at) = by.slips_at {
            made.give(Outputs::SLIP_RATIO, Host::SlipRatio, &[found.friction / slips_at]);
        }
    }

    fn along_chart(&self, found: &shear::Shear, made: &mut Made<'_>) {
        let DVec2 { x, y } = found.along_chart;
        made.give(Outputs::SHEAR, Host::Shear, &[x, y]);
        made.give(Outputs::TORSION, Host::Torsion, &[found.torsion]);
        match found.direction {
            Some(direction) => made.give(Outputs::SHEAR_DIRECTION, Host::ShearDirection, &[direction]),
            None => made.flags |= Flags::STILL,
        }
    }
}

/// P for a raw unit of a tangential value of the body's taxel `taxel`.
pub(super) fn tangential_gain(by: &ShearCalibration, taxel: usize, calibration: &TaxelCalibration) -> f64 {
    by.gain_of(taxel, calibration.gain, calibration.unit_factor)
}

/// The tangential forces of the body's taxel `taxel` along t and n × t, where it is pressed by `pressure` and reads `raw`.
pub(super) fn tangential(
    by: &ShearCalibration,
    taxel: usize,
    gain: f64,
    pressure: f64,
    raw: [RawValue; 2],
) -> Result<[f64; 2], Flags> {
    let numbers = raw.map(|raw| raw.number().filter(|number| number.abs() <= calibrate::HUGE));
    let [Some(u), Some(v)] = numbers else {
        let is_missing = raw.iter().any(|raw| raw.is_missing());
        return Err(if is_missing { Flags::INCOMPLETE } else { Flags::FAULTY_INPUT });
    };
    Ok(by.forces(taxel, gain, pressure, [u, v]))
}
