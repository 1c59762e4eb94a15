//! Letters that are not made of pressures, over a batch: shear, temperature and proximity of every field that has such taxels.
//!
//! They are made here of raw values, in double precision, alike on every backend.

use glam::{DAffine3, DVec2, DVec3};

use super::letter_cell::{Made, Readings};
use super::links::Links;
use super::pulls::{Pull, Pulls};
use super::spread::{Frames, Now};
use crate::backend::Step;
use crate::percept::{Flags, Host, Outputs, Percepts};
use crate::scene::{Plan, PlanField, SensedMember};
use crate::signal::{RawValue, Reading, Receptor, Sense, SenseCalibration, ShearCalibration};
use crate::stage::proximity::{LEAST_M, Near};
use crate::stage::shear::{Noise, Noisy, Pulled, Sums};
use crate::stage::temperature::Warm;
use crate::stage::window::Trend;
use crate::stage::{proximity, temperature};

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
    /// Its number in the plan.
    pub(super) number: usize,
    pub(super) frames: Frames<'a>,
    /// The frame's number in the call.
    pub(super) frame: usize,
    pub(super) step: &'a Step,
    pub(super) sensed: SensedValues<'a>,
}

/// The frame that places and directions of a cell are in.
enum Frame {
    World,
    Anchor,
    /// The links lie apart, and where they are is not known.
    Nowhere,
}

impl Cell<'_> {
    /// Fills the cell `cell` of `percepts`, which backends leave out. `room` has what the fields of a frame share, and `trend` what the
    /// letter measured before.
    pub(super) fn make(&self, cell: usize, percepts: &mut Percepts, room: &mut Room, trend: &mut Trend) {
        let Room { pulls, warm, near, now } = room;
        percepts.set_present(cell, Outputs::empty());
        // As it was in a frame of another call.
        percepts.in_world[cell] = false;
        let mut made = Made { percepts, cell, flags: Flags::empty(), is_there: false };
        if self.step.restarts() {
            trend.clear();
        }
        let senses = &self.plan.senses;
        match self.plan.letters()[self.field.letter].receptor {
            Receptor::Sustained | Receptor::Change => {}
            Receptor::Shear => {
                senses.shear.iter().for_each(|by| self.shear(by, pulls, now, &mut made));
            }
            Receptor::Temperature => {
                senses.temperature.iter().for_each(|by| self.temperature(by, warm, now, (&mut made, trend)));
            }
            Receptor::Proximity => {
                senses.proximity.iter().for_each(|by| self.proximity(by, near, now, (&mut made, trend)));
            }
        }
        made.flags.set(Flags::NO_CONTACT, !made.is_there);
        made.flags.set(Flags::NO_CHART, self.field.chart.is_none());
        made.percepts.flags[cell] = made.flags;
    }

    /// Which frame places of members on the links `links_of` are in.
    fn frame_of(&self, mut links_of: impl Iterator<Item = usize>, now: &mut Now) -> Frame {
        let frame = &self.frames.frames[0];
        let links: &Links = self.frames.links;
        if links.are_posed(frame) {
            let poses = self.frames.poses(0, now);
            if links_of.all(|link| poses[link].is_some()) {
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
        let (own, frame) =
            (&self.field.sensed[member], self.frame_of(std::iter::once(self.field.sensed[member].link), now));
        let (position, outward) = match frame {
            Frame::World => {
                let world = self.world_from_link(own, now);
                (world.transform_point3(own.position_in_link), world.transform_vector3(own.normal_in_link))
            }
            Frame::Anchor => (own.position_in_anchor, own.normal_in_anchor),
            Frame::Nowhere => {
                made.lack(normal.map_or(output, |(normal, _)| output | normal), Flags::NO_POSE);
                return;
            }
        };
        made.percepts.in_world[made.cell] = matches!(frame, Frame::World);
        made.give(output, host, &position.to_array());
        if let Some((output, host)) = normal {
            made.give(output, host, &outward.to_array());
        }
    }

    /// Puts what `read` makes of the values of members that have a reading into `readings`; the others' flags go into `made`.
    fn read<T>(
        &self,
        by: &SenseCalibration,
        readings: &mut Readings<T>,
        made: &mut Made<'_>,
        read: impl Fn(&SensedMember, &Sense, (RawValue, f64), &mut Flags) -> Option<T>,
    ) {
        let row = self.sensed.row(self.frame);
        readings.members.clear();
        readings.values.clear();
        readings.by_member.clear();
        for (index, member) in self.field.sensed.iter().enumerate() {
            let (raw, sense) = (row[member.values[0]], by.of_taxel(member.taxel));
            match sense.read(raw) {
                Reading::Missing => made.flags |= Flags::INCOMPLETE,
                Reading::Faulty => made.flags |= Flags::FAULTY_INPUT,
                Reading::Value(number, is_in_range) => {
                    // The value counts all the same.
                    if !is_in_range {
                        made.flags |= Flags::OUT_OF_RANGE;
                    }
                    let read = read(member, sense, (raw, number), &mut made.flags);
                    // Of proximity: where there is none, nothing is near.
                    readings.by_member.push((index, if read.is_some() { number } else { f64::INFINITY }));
                    readings.members.extend(read.is_some().then_some(index));
                    readings.values.extend(read);
                }
            }
        }
    }

    fn temperature(
        &self,
        by: &SenseCalibration,
        readings: &mut Readings<Warm>,
        now: &mut Now,
        (made, trend): (&mut Made<'_>, &mut Trend),
    ) {
        self.read(by, readings, made, |member, _, (_, celsius), _| {
            Some(Warm { weight: member.weight, celsius, place_m: member.place_m })
        });
        let Readings { members, values: warm, by_member } = &*readings;
        if warm.is_empty() {
            return;
        }
        made.is_there = true;
        let mean = temperature::mean(warm);
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
            [(temperature::extreme(warm, |a, b| a > b), warmest), (temperature::extreme(warm, |a, b| a < b), coldest)]
        {
            let Some(found) = found else { continue };
            made.give(value.0, value.1, &[warm[found].celsius]);
            made.give(taxel.0, taxel.1, &[f64::from(self.field.sensed[members[found]].id)]);
            self.give_place(members[found], position, None, now, made);
        }
        if self.field.chart.is_some() {
            match temperature::gradient(warm) {
                Some(gradient) => {
                    made.give(Outputs::TEMPERATURE_GRADIENT, Host::TemperatureGradient, &gradient.to_array());
                }
                None => made.lack(Outputs::TEMPERATURE_GRADIENT, Flags::NO_GRADIENT),
            }
        }
        let sensed = &self.field.sensed;
        let mean_of = |members: &mut dyn Iterator<Item = (usize, f64)>| {
            temperature::mean_of(members.map(|(member, celsius)| [sensed[member].weight, celsius]))
        };
        match trend.take(self.t_s(), by_member, by.window_s, mean_of) {
            Some(rate) => made.give(Outputs::TEMPERATURE_RATE, Host::TemperatureRate, &[rate]),
            None => made.lack(Outputs::TEMPERATURE_RATE, Flags::NO_PREVIOUS),
        }
    }

    fn t_s(&self) -> f64 {
        self.frames.frames[0].t_s
    }

    fn proximity(
        &self,
        by: &SenseCalibration,
        readings: &mut Readings<Near>,
        now: &mut Now,
        (made, trend): (&mut Made<'_>, &mut Trend),
    ) {
        self.read(by, readings, made, |member, sense, (raw, distance_m), flags| {
            let end_beyond = sense.end_beyond(raw);
            if distance_m > by.range_m || end_beyond.is_gt() {
                return None;
            }
            // It is nearer than that.
            if distance_m < LEAST_M || end_beyond.is_lt() {
                *flags |= Flags::SATURATED;
            }
            Some(Near { distance_m: distance_m.max(LEAST_M), place_m: member.place_m })
        });
        let Readings { members, values: near, by_member } = &*readings;
        if by_member.is_empty() {
            return;
        }
        made.give(Outputs::COVERED, Host::Covered, &[near.len() as f64]);
        let Some(nearest) = proximity::nearest(near) else {
            made.flags |= Flags::OUT_OF_RANGE;
            // What was in range may be there still, of a member that has no reading now.
            if !trend.misses_one(by_member) {
                trend.clear();
            }
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
            let centroid = proximity::centroid(near).to_array();
            made.give(Outputs::PROXIMITY_CENTROID, Host::ProximityCentroid, &centroid);
        }
        let least = |members: &mut dyn Iterator<Item = (usize, f64)>| {
            let least_m = members.map(|(_, distance_m)| distance_m.max(LEAST_M)).fold(f64::INFINITY, f64::min);
            least_m.is_finite().then_some(least_m)
        };
        match trend.take(self.t_s(), by_member, by.window_s, least) {
            // From 0, so that what stays has no sign.
            Some(slope) => made.give(Outputs::APPROACH_SPEED, Host::ApproachSpeed, &[0.0 - slope]),
            None => made.lack(Outputs::APPROACH_SPEED, Flags::NO_PREVIOUS),
        }
    }

    /// The members that are pressed, and what they feel.
    fn pressed<'m>(&'m self, pulls: &'m Pulls) -> impl Iterator<Item = (&'m SensedMember, &'m Pull)> {
        self.field.sensed.iter().filter_map(|member| Some((member, pulls.of_channel(member.channel?)?)))
    }

    /// The sums over the pressed members, with vectors in `frame`.
    fn sums(&self, pulls: &Pulls, frame: &Frame, now: &mut Now) -> Sums {
        let mut sums = Sums::default();
        if !matches!(frame, Frame::World) {
            for (member, pull) in self.pressed(pulls) {
                add(&mut sums, member, pull, (&member.tangents_in_anchor, member.normal_in_anchor));
            }
            return sums;
        }
        let poses = self.frames.poses(0, now);
        let (mut of_link, mut link) = (Sums::default(), None);
        let mut end_link = |of_link: &mut Sums, link: Option<usize>| {
            let world = link.and_then(|link: usize| poses[link]).unwrap_or(DAffine3::IDENTITY);
            sums.join(&std::mem::take(of_link), |vector| world.transform_vector3(vector));
        };
        for (member, pull) in self.pressed(pulls) {
            if link.is_some_and(|link| link != member.link) {
                end_link(&mut of_link, link);
            }
            link = Some(member.link);
            add(&mut of_link, member, pull, (&member.tangents_in_link, member.normal_in_link));
        }
        end_link(&mut of_link, link);
        sums
    }

    fn shear(&self, by: &ShearCalibration, pulls: &mut Pulls, now: &mut Now, made: &mut Made<'_>) {
        pulls.look(by, &self.frames, self.sensed.row(self.frame));
        if !pulls.is_pressed_or_flagged(self.number) {
            return;
        }
        made.flags |= pulls.flags_of(self.field.sensed.iter().filter_map(|member| member.channel));
        let frame = self.frame_of(self.pressed(pulls).map(|(member, _)| member.link), now);
        let found = self.sums(pulls, &frame, now);
        if !found.is_pressed() {
            return;
        }
        made.is_there = true;
        if matches!(frame, Frame::Nowhere) {
            made.lack(Outputs::SHEAR_VECTOR | Outputs::FORCE_VECTOR, Flags::NO_POSE);
        } else {
            made.percepts.in_world[made.cell] = matches!(frame, Frame::World);
            if found.pull > 0.0 {
                made.give(Outputs::SHEAR_VECTOR, Host::ShearVector, &found.in_space().to_array());
            }
            match found.force() {
                Some(newtons) => made.give(Outputs::FORCE_VECTOR, Host::ForceVector, &newtons.to_array()),
                None => made.lack(Outputs::FORCE_VECTOR, Flags::NO_UNIT),
            }
        }
        if found.pull <= 0.0 {
            // It is not known how any of them pulls.
            return;
        }
        if self.field.chart.is_some() {
            let DVec2 { x, y } = found.along_chart;
            made.give(Outputs::SHEAR, Host::Shear, &[x, y]);
            match found.torsion() {
                Some(torsion) => made.give(Outputs::TORSION, Host::Torsion, &[torsion]),
                // Where others are pressed, it is said why theirs is not known.
                None if found.is_one_taxel() => made.lack(Outputs::TORSION, Flags::ONE_TAXEL),
                None => {}
            }
            match found.direction() {
                Some(direction) => made.give(Outputs::SHEAR_DIRECTION, Host::ShearDirection, &[direction]),
                None => made.lack(Outputs::SHEAR_DIRECTION, Flags::STILL),
            }
        }
        let charted = self.field.chart.is_some();
        let friction = found.friction(charted);
        made.give(Outputs::FRICTION, Host::Friction, &[friction]);
        if made.percepts.outputs().contains(Outputs::FRICTION_SIGMA) {
            match found.friction_sigma(charted, by, self.noisy(pulls)) {
                Some(sigma) => made.give(Outputs::FRICTION_SIGMA, Host::FrictionSigma, &[sigma]),
                None => made.flags |= Flags::NOISE_UNKNOWN,
            }
        }
        if let Some(slips_at) = by.slips_at {
            made.give(Outputs::SLIP_RATIO, Host::SlipRatio, &[friction / slips_at]);
        }
    }

    /// The pressed members whose tangential force is known, with its noise; `None` where that is not known.
    fn noisy<'m>(&'m self, pulls: &'m Pulls) -> impl Iterator<Item = Option<Noisy<'m>>> {
        let noise = |channel: usize| {
            let raw = self.frames.raw.rows.value(self.frames.offset, channel);
            let calibration = (&self.plan.calibrations[channel], self.plan.curve_of(channel));
            Noise::of(raw, calibration, pulls.sides_of(channel)?)
        };
        let known = self.pressed(pulls).filter_map(|(member, pull)| Some((member, pull.felt?)));
        known.map(move |(member, felt)| {
            let tangents_in_chart = &member.tangents_in_chart;
            Some(Noisy { weight: member.weight, felt, noise: noise(member.channel?)?, tangents_in_chart })
        })
    }
}

/// Room for what the fields of a frame are made of, used again from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct Room {
    pulls: Pulls,
    warm: Readings<Warm>,
    near: Readings<Near>,
    pub(super) now: Now,
}

impl Room {
    pub(super) fn new(plan: &Plan) -> Self {
        Self { pulls: Pulls::new(plan), warm: Readings::none(), near: Readings::none(), now: Now::default() }
    }

    /// Forgets the frame.
    pub(super) fn forget(&mut self) {
        self.pulls.forget();
        self.now.forget();
    }
}

/// Adds what `member` feels to `sums`, in whose space it has these tangents and this normal.
fn add(sums: &mut Sums, member: &SensedMember, pull: &Pull, (tangents, normal): (&[DVec3; 2], DVec3)) {
    sums.add(&Pulled {
        weight: member.weight,
        pressure: pull.pressure,
        felt: pull.felt,
        tangents_in_chart: &member.tangents_in_chart,
        tangents,
        normal,
        place_m: member.place_m,
        newtons_per_p: pull.newtons_per_p,
    });
}
