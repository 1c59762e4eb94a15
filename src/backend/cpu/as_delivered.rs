//! One frame's values, read where the source has put them.
//!
//! Fields of one frame bring their members' values side by side wherever these are. So nothing has to be brought into the plan's
//! order before: sixteen values that lie side by side are calibrated together, and those of nobody among them are read as 0.

use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::super::{Near, Picks, Rows};
use super::calibrate::{self, Sort, Tile, Tiles};
use super::lines::Lines;
use super::pick::Values;
use super::simd::{LANES, Row};
use super::slots::Slots;
use crate::scene::{Plan, PlanField};
use crate::stage::layout::{STRAIGHT, Taxel};

/// Of what is nobody's, which is read as 0.
const NOBODYS: Taxel = Taxel {
    baseline: 0.0,
    gain: 1.0,
    dead_band: 0.0,
    p_max: f32::MAX,
    raw_low: f32::MIN,
    raw_high: f32::MAX,
    area: 0.0,
    response: STRAIGHT,
};

/// A plan's taxels as some picks find them in a frame.
#[derive(Clone, Debug)]
pub(super) struct AsDelivered {
    /// By tile, where in a frame it begins.
    starts: Vec<u32>,
    /// By tile, all bits of those that are somebody's.
    wanted: Lines<u32>,
    tiles: Tiles,
    /// By group of fields, where their members have their values.
    pub(super) slots: Vec<Slots>,
}

impl AsDelivered {
    /// For frames that `picks` are of, where it pays; `slots` has the groups' slots in the plan's order, and `room` says how many
    /// there are, of which the last ones are nobody's.
    pub(super) fn new(plan: &Plan, slots: &[Slots], picks: &Picks, room: usize) -> Option<Self> {
        // Every value is one taxel's then, and fields read nothing else.
        let is_simple = plan.calibrated() == plan.channels() && !plan.has_changes() && plan.kept_pressures() == 0;
        if !is_simple || plan.fields.iter().any(PlanField::is_wide) || picks.width < LANES {
            return None;
        }
        // The last one ends with the frame, and so may begin early.
        let start_of = |place: u32| (place as usize / LANES * LANES).min(picks.width - LANES) as u32;
        let mut starts: Vec<u32> = picks.places.iter().map(|&place| start_of(place)).collect();
        starts.sort_unstable();
        starts.dedup();
        let in_order = picks.near.iter().filter(|near| matches!(near, Near::Straight(_))).count();
        let others = picks.near.len() - in_order;
        // To read and calibrate three tiles as they are takes as long as to put two together: there have to be enough of these.
        if 8 * others <= in_order || starts.len() > in_order + 3 * others / 2 || (starts.len() + 1) * LANES > room {
            return None;
        }
        let slot_at = |place: u32| {
            let start = start_of(place);
            let tile = starts.partition_point(|&other| other < start);
            (tile * LANES) as u32 + place - start
        };
        let (mut taxels, mut wanted) = (vec![NOBODYS; starts.len() * LANES], Lines::new(starts.len(), 0));
        for (taxel, &place) in plan.taxels.iter().zip(&picks.places) {
            let slot = slot_at(place) as usize;
            taxels[slot] = *taxel;
            wanted[slot / LANES][slot % LANES] = u32::MAX;
        }
        let tiles = Tiles::of(taxels.chunks(LANES).map(Tile::new).collect());
        // Curves are looked up by the plan's slot.
        if tiles.sorts.contains(&Sort::Any) {
            return None;
        }
        let to = |slot: u32| picks.places.get(slot as usize).map_or(slot, |&place| slot_at(place));
        let slots = slots.iter().map(|slots| slots.moved(to, room - 1)).collect();
        Some(Self { starts, wanted, tiles, slots })
    }

    /// A frame's pressures, by slot here, and whether any status says anything; see [`calibrate::frame`].
    pub(super) fn frame(
        &self,
        level: Level,
        plan: &Plan,
        (raw, frame): (Rows<'_>, usize),
        pressures: &mut [Row<f32>],
        statuses: &mut [Row<u32>],
    ) -> bool {
        let Rows::Picked { frames, .. } = raw else { unreachable!("only such rows have picks") };
        let values: &[u32] = bytemuck::cast_slice(&frames[frame].values);
        let values = Wanted { values, starts: &self.starts, wanted: &self.wanted };
        calibrate::all_tiles(level, plan, &self.tiles, values, pressures, statuses)
    }
}

/// A frame's values, those of nobody as 0.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    values: &'a [u32],
    starts: &'a [u32],
    wanted: &'a [Row<u32>],
}

impl Values for Wanted<'_> {
    #[inline(always)]
    fn row<S: Simd>(self, simd: S, tile: usize) -> u32x16<S> {
        let values = &self.values[self.starts[tile] as usize..][..LANES];
        u32x16::from_slice(simd, values) & u32x16::from_slice(simd, &self.wanted[tile])
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Backend, RawBatch, Step};
    use super::super::Cpu;
    use super::super::live::Live;
    use super::super::tests::{delivered, levels, mostly_at_rest, sheet, values};
    use super::*;
    use crate::field::FieldSet;
    use crate::percept::{Flags, Outputs, Percepts, Precision};
    use crate::scene::Scene;
    use crate::signal::{Calibration, Frame, RawValue};

    /// Without a gate, and with one.
    const TAXELS: [u32; 2] = [1000, 5000];

    /// The sheet's plan, some fields of fewer taxels and with weights, calibrated as `text` says.
    fn plan(taxels: u32, text: &str) -> Plan {
        let mut body = sheet(taxels);
        for (index, field) in body.fields.iter_mut().enumerate() {
            field.members = std::mem::take(&mut field.members).into_iter().take(16 - index % 7).collect();
            let weight = if index > 60 { 1.0 + f64::from(index as u32 % 3) } else { 1.0 };
            field.members.values_mut().for_each(|member| member.weight = weight);
        }
        let ids: Vec<u32> = (0..taxels).collect();
        let scene = Scene { outputs: Outputs::USUAL - Outputs::MOTION, ..Scene::default() };
        let calibration = Calibration::parse(text, &ids).unwrap();
        Plan::new(&body, &FieldSet::new(&body).unwrap(), &scene, &calibration).unwrap()
    }

    /// Values of a frame: the first eight and every fifth are nobody's, the last one is a taxel's.
    fn width(plan: &Plan) -> usize {
        plan.channels() * 5 / 4 + 7
    }

    /// Such frames' picks, and those of the same the other way round.
    fn two_picks(plan: &Plan) -> [(Vec<u32>, Picks); 2] {
        let forth = (0..plan.channels() as u32).map(|channel| channel * 5 / 4 + 8);
        let back = forth.clone().map(|place| width(plan) as u32 - 1 - place);
        [forth.collect(), back.collect()].map(|channels: Vec<u32>| {
            let picks = Picks::new(&channels, plan.calibrated(), width(plan));
            (channels, picks)
        })
    }

    fn of(plan: &Plan, picks: &Picks) -> Option<AsDelivered> {
        let live = Live::new(Level::new(), plan);
        AsDelivered::new(plan, live.slots(), picks, 1 << 16)
    }

    /// All of `frames` with calls of 1, 2 and 3 frames, in the rows that `rows` has them in; the other plan's calibration from
    /// the middle on.
    fn live<'a>(plans: [&Plan; 2], level: Level, frames: usize, rows: impl Fn(usize) -> Rows<'a>) -> Percepts {
        let mut cpu = Cpu::with_level(plans[0], level);
        let mut percepts = Percepts::new(plans[0].outputs, plans[0].fields.len(), Precision::F32)
            .with_columns(plans[0].columns, 0)
            .with_letters(plans[0].letters().len());
        percepts.reset(frames);
        let steps = [Step { dt_s: 0.01, flags: Flags::empty() }; 3];
        let (mut first, mut is_recalibrated) = (0, false);
        for call in 0.. {
            let count = (call % 3 + 1).min(frames - first);
            if count == 0 {
                break;
            }
            if first >= frames / 2 && !is_recalibrated {
                cpu.recalibrate(plans[1]);
                is_recalibrated = true;
            }
            let rows = rows(call).part(first..first + count);
            cpu.run(&RawBatch { first, frames: count, rows, steps: &steps[..count] }, &mut percepts).unwrap();
            first += count;
        }
        percepts
    }

    #[test]
    fn bits_do_not_depend_on_where_values_lie() {
        const FRAMES: usize = 170;
        for taxels in TAXELS {
            let texts = ["[all]", "[all]\nbaseline = 1\ngain = 0.7\np_max = 300"];
            let plans = texts.map(|text| plan(taxels, text));
            let [plain, other] = &plans;
            let all_over = values(plain, FRAMES);
            // A gate stands before the first frames, steps aside for those that are touched all over, and comes back.
            let mut raw = mostly_at_rest(all_over.clone(), plain.channels());
            let touched = 20 * plain.channels()..90 * plain.channels();
            raw[touched.clone()].copy_from_slice(&all_over[touched]);
            let [forth, back] = two_picks(plain);
            assert!(plans.iter().all(|plan| [&forth, &back].iter().all(|(_, picks)| of(plan, picks).is_some())));
            let frames = [&forth, &back].map(|(channels, _)| delivered(&raw, channels, width(plain)));
            let packed = Rows::Packed { values: &raw, channels: plain.channels() };
            for plans in [[plain, other], [other, plain]] {
                let right = live(plans, Level::new(), FRAMES, |_| packed);
                for level in levels() {
                    // Four calls each: both picks in turn, the second and none, none and the first, the first alone.
                    let also = live(plans, level, FRAMES, |call| match call / 4 % 4 + call % 2 {
                        0 | 3 | 4 => Rows::Picked { frames: &frames[0], picks: &forth.1 },
                        1 => Rows::Picked { frames: &frames[1], picks: &back.1 },
                        _ => packed,
                    });
                    assert!(right == also, "{level:?}, {taxels} taxels");
                }
            }
        }
    }

    #[test]
    fn what_is_nobodys_is_not_looked_at() {
        for text in ["[all]", "[all]\nbaseline = 1\ngain = 0.7\np_max = 300"] {
            let plan = plan(TAXELS[0], text);
            let [(channels, picks), _] = two_picks(&plan);
            let here = of(&plan, &picks).unwrap();
            let mut frames = vec![Frame::missing(0.0, width(&plan))];
            channels.iter().for_each(|&place| frames[0].values[place as usize] = RawValue::new(2.0));
            let (mut pressures, mut statuses) = (Lines::new(100, 0.0), Lines::new(100, 0));
            let mut frame = |frames: &[Frame]| {
                let rows = Rows::Picked { frames, picks: &picks };
                here.frame(Level::new(), &plan, (rows, 0), &mut pressures, &mut statuses)
            };
            assert!(!frame(&frames));
            frames[0].values[channels[77] as usize] = RawValue::MISSING;
            assert!(frame(&frames));
            let pressed = pressures.as_flattened().iter().filter(|&&pressure| pressure > 0.0);
            assert_eq!(pressed.count(), plan.channels() - 1);
        }
    }

    #[test]
    fn a_frame_of_which_little_is_wanted_is_not_read_through() {
        let plan = plan(TAXELS[0], "[all]");
        let apart: Vec<u32> = (0..TAXELS[0]).map(|channel| channel * 20).collect();
        assert!(of(&plan, &Picks::new(&apart, plan.calibrated(), 20_000)).is_none());
        // Where all lies one after the other there is nothing to gain, nor where it is but for the last ones.
        let straight: Vec<u32> = (0..TAXELS[0]).collect();
        for width in [1000, 1008] {
            assert!(of(&plan, &Picks::new(&straight, plan.calibrated(), width)).is_none());
        }
    }
}
