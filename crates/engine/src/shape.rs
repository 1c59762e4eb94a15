//! A made-up skin of any size, to measure speed on: `somatic bench` and `benches/` share it.

mod letters;

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use crate::backend::BackendKind;
use crate::body::{Body, FieldSpec, Link, MAX_TAXEL_ID, MemberSpec, Modality, Taxel};
use crate::engine::{Engine, Options};
use crate::error::{Error, Result};
use crate::percept::{Column, Outputs};
use crate::random::Random;
use crate::scene::{Coverage, Knobs, Scene};
use crate::signal::{Frame, RawValue};

/// How many of what; the rest follows from it and the seed.
///
/// Sensors lie on a flat square sheet, 25 mm² each: at random, and every field has its own distinct random ones of them; or
/// row by row, and every field has neighbours and stands beside the one before it, as on a real skin, which is kinder to
/// caches. All have weight 1. In every frame every sensor is pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Sensors of the sheet; their ids count up from 0.
    pub sensors: usize,
    /// Fields of [`Shape::members`] sensors each.
    pub fields: usize,
    /// Sensors of each field.
    pub members: usize,
    /// Sensors of one more field, the last; 0 for none.
    pub wide: usize,
    /// Whether sensors lie in rows and fields are patches of neighbours.
    pub local: bool,
    /// Frames a call.
    pub frames: usize,
    /// Of places, members and values.
    pub seed: u64,
}

/// Side of the square that a sensor stands for, m.
const PITCH_M: f64 = 0.005;
/// Values lie in (0, this].
const FULL: f64 = 1023.0;
/// Time between frames, s.
const STEP_S: f64 = 0.01;

// About what a body, a plan and a backend's tables hold, bytes.
const BYTES_A_SENSOR: u128 = 250;
const BYTES_A_MEMBERSHIP: u128 = 350;
const BYTES_A_FIELD: u128 = 1500;

impl Shape {
    /// Refuses what is not skin: nothing of something, or more members than sensors.
    pub fn check(&self) -> Result<()> {
        let given = [
            ("--sensors", self.sensors),
            ("--fields", self.fields),
            ("--members", self.members),
            ("--frames", self.frames),
        ];
        if let Some((name, _)) = given.iter().find(|(_, count)| *count == 0) {
            return Err(Error::usage(format!("{name} 0 leaves nothing to measure; give at least 1")));
        }
        if self.sensors > MAX_TAXEL_ID as usize + 1 {
            let most = MAX_TAXEL_ID as usize + 1;
            return Err(Error::usage(format!("--sensors {} is more than a body can have, {most}", self.sensors)));
        }
        for (name, count) in [("--members", self.members), ("--wide", self.wide)] {
            if count > self.sensors {
                let sensors = self.sensors;
                return Err(Error::usage(format!(
                    "{name} {count} is more than the {sensors} sensors there are; a field has each at most once"
                )));
            }
        }
        Ok(())
    }

    /// Fields in all.
    pub fn all_fields(&self) -> usize {
        self.fields + usize::from(self.wide > 0)
    }

    /// (field, sensor) pairs of a call, over all its frames.
    pub fn memberships(&self) -> u128 {
        (self.fields as u128 * self.members as u128 + self.wide as u128) * self.frames as u128
    }

    /// About how much memory the body, an engine for `outputs` and a call's frames and percepts take, bytes.
    pub fn bytes(&self, outputs: Outputs) -> u128 {
        // A cell's flags, what is present and whose frame it is in; and its numbers.
        let cell: u128 = 9 + outputs.iter().map(bytes_a_cell).sum::<u128>();
        let frames = self.frames as u128 * (self.sensors as u128 * 4 + self.all_fields() as u128 * cell + 64);
        let tables = self.memberships() / (self.frames as u128).max(1) * BYTES_A_MEMBERSHIP;
        frames + tables + self.sensors as u128 * BYTES_A_SENSOR + self.all_fields() as u128 * BYTES_A_FIELD
    }

    /// The sheet with its fields: `field 0` and on, and `wide`.
    pub fn body(&self) -> Body {
        let mut random = Random::new(self.seed);
        let side_m = PITCH_M * (self.sensors as f64).sqrt();
        let columns = self.sensors.isqrt();
        let mut place = |id: usize| match self.local {
            true => DVec3::new((id % columns) as f64, 0.0, (id / columns) as f64) * PITCH_M,
            false => {
                let mut along = || (random.unit() - 0.5) * side_m;
                DVec3::new(along(), 0.0, along())
            }
        };
        let taxels = (0..self.sensors).map(|id| Taxel {
            id: id as u32,
            link: 0,
            position_in_link: place(id),
            normal_in_link: DVec3::Y,
            area: PITCH_M * PITCH_M,
            modality: Modality::Pressure,
            tangent_in_link: None,
        });
        let taxels = taxels.collect();
        let mut order: Vec<u32> = (0..self.sensors as u32).collect();
        let widths = std::iter::repeat_n(self.members, self.fields).chain((self.wide > 0).then_some(self.wide));
        let members = widths.map(|width| {
            if self.local {
                return self.patch(width, &mut random);
            }
            // The first steps of a Fisher-Yates shuffle, from whatever order the field before left.
            for place in 0..width {
                let left = self.sensors - place;
                order.swap(place, place + (random.unit() * left as f64) as usize);
            }
            order[..width].iter().map(|&id| (id, MemberSpec::default())).collect()
        });
        let mut members: Vec<BTreeMap<u32, MemberSpec>> = members.collect();
        if self.local {
            members[..self.fields].sort_by_key(|members| members.keys().next().copied());
        }
        let fields = members.into_iter().enumerate().map(|(field, members)| FieldSpec {
            name: if field < self.fields { format!("field {field}") } else { "wide".to_owned() },
            members,
            ..FieldSpec::default()
        });
        Body {
            name: "sheet".to_owned(),
            fields: fields.collect(),
            links: vec![Link {
                name: "sheet".to_owned(),
                parent: None,
                body_from_link: DAffine3::IDENTITY,
                link_from_node: DAffine3::IDENTITY,
                joint: None,
                urdf_up: None,
            }],
            surfaces: Vec::new(),
            taxels,
            edges: None,
            findings: Vec::new(),
            kept: Default::default(),
        }
    }

    /// As many neighbours as `width`, in a patch as square as can be, somewhere.
    fn patch(&self, width: usize, random: &mut Random) -> BTreeMap<u32, MemberSpec> {
        let columns = self.sensors.isqrt();
        let across = (width as f64).sqrt().ceil().min(columns as f64) as usize;
        let mut anywhere = |count: usize, of: usize| (random.unit() * (of.saturating_sub(count) + 1) as f64) as usize;
        let first_row = anywhere(width.div_ceil(across), self.sensors / columns);
        let first = first_row * columns + anywhere(across, columns);
        (0..width).map(|i| ((first + i / across * columns + i % across) as u32, MemberSpec::default())).collect()
    }

    /// A call's frames, every sensor pressed with its own value in (0, 1023], 10 ms apart from t = 0.
    pub fn frames(&self) -> Vec<Frame> {
        // Another sequence than the body's.
        let mut random = Random::new(!self.seed);
        let mut value = || RawValue::new(FULL * (1.0 - random.unit()));
        let frame = |index| (index as f64 * STEP_S, (0..self.sensors).map(|_| value()).collect());
        (0..self.frames).map(frame).map(|(t_s, values)| Frame { t_s, values, ..Frame::default() }).collect()
    }

    /// Moves `frames` on in time by a call, so that the next call goes on where the one before ended.
    pub fn advance(&self, frames: &mut [Frame]) {
        frames.iter_mut().for_each(|frame| frame.t_s += self.frames as f64 * STEP_S);
    }

    /// An engine on `body`, which is [`Shape::body`], for calls of the shape's number of frames.
    pub fn engine(&self, body: &Body, backend: BackendKind, outputs: Outputs) -> Result<Engine> {
        // Its frames repeat, and what repeats is not to be left out of a measurement.
        let scene = Scene::default().outputs(outputs).knobs(Knobs::default().coverage(Coverage::All));
        Engine::new(body, Options::default().scene(scene).backend(backend).batch(self.frames))
    }
}

/// Bytes of an output's array in a cell, with single-precision numbers but for the host's.
fn bytes_a_cell(output: Outputs) -> u128 {
    let bytes = |column: &Column| column.components * if column.is_double() { 8 } else { 4 };
    output.columns().map(bytes).sum::<usize>() as u128
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const SHAPE: Shape = Shape { sensors: 50, fields: 7, members: 5, wide: 50, local: false, frames: 3, seed: 9 };

    #[test]
    fn a_shape_is_what_it_says_and_the_same_again() {
        let (body, frames) = (SHAPE.body(), SHAPE.frames());
        let widths: Vec<usize> = body.fields.iter().map(|field| field.members.len()).collect();
        assert_eq!(widths, [5, 5, 5, 5, 5, 5, 5, 50]);
        assert_eq!(SHAPE.memberships(), 3 * (7 * 5 + 50));
        let sets: BTreeSet<Vec<u32>> = body.fields.iter().map(|f| f.members.keys().copied().collect()).collect();
        assert_eq!(sets.len(), 8, "fields differ");
        let values = frames.iter().flat_map(|frame| &frame.values).map(|value| value.number().unwrap());
        assert!(frames.len() == 3 && values.clone().all(|value| 0.0 < value && value <= 1023.0));
        assert!(values.fold(0.0, f64::max) > 900.0);

        assert_eq!((body.taxels, frames), (SHAPE.body().taxels, SHAPE.frames()));
        let other = Shape { seed: 10, ..SHAPE };
        assert!(other.body().fields != body.fields && other.frames() != SHAPE.frames());
    }

    #[test]
    fn neighbours_lie_side_by_side() {
        for sensors in [50, 59, 64, 101] {
            let local = Shape { sensors, wide: sensors, local: true, ..SHAPE };
            let body = local.body();
            let (wide, fields) = body.fields.split_last().unwrap();
            assert_eq!(wide.members.len(), sensors);
            let place = |id: &u32| body.taxels[*id as usize].position_in_link;
            for field in fields {
                assert_eq!(field.members.len(), 5);
                let apart = field.members.keys().flat_map(|a| field.members.keys().map(move |b| place(a) - place(b)));
                // Three in a row and two below.
                assert!(apart.into_iter().all(|apart| apart.x.abs() < 2.1 * PITCH_M && apart.z.abs() < 1.1 * PITCH_M));
            }
            assert!(fields[1..].iter().any(|field| field.members != fields[0].members));
        }
    }

    #[test]
    fn every_field_of_it_is_touched_and_has_all_that_is_usual() {
        let mut engine = SHAPE.engine(&SHAPE.body(), BackendKind::Reference, Outputs::USUAL_AND_MOTION).unwrap();
        let mut frames = SHAPE.frames();
        engine.process(&frames).unwrap();
        SHAPE.advance(&mut frames);
        let percepts = engine.process(&frames).unwrap();
        for percept in (0..3).flat_map(|frame| percepts.touched(frame)) {
            assert!(
                percept.orientation.is_some() && percept.normal.is_some() && percept.speed.is_some(),
                "{percept:?}"
            );
        }
        assert_eq!(percepts.touched(0).count(), SHAPE.all_fields());
    }
}
