//! Writes what viewers show of a recording, at a rate for the eye: taxels with pressures, touches, link poses.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use super::touch_mark::TouchMark;
use super::{FieldNames, InputFrames};
use crate::body::Body;
use crate::error::Result;
use crate::percept::Percepts;
use crate::recording::{
    Cloud, FIELDS, LINKS, Recorder, SURFACE, Scene, ShownTouch, TAXELS, TOUCHES, Transforms, nanoseconds, scalars,
    surface,
};
use crate::signal::{Frame, Receptor};

/// Period of the taxels' messages, s.
const TAXELS_PERIOD_S: f64 = 0.1;
/// Period of the messages of touches and of moving links, s.
const TOUCHES_PERIOD_S: f64 = 0.04;
/// Period of the messages of links at rest, s: a viewer that seeks needs them soon.
const LINKS_PERIOD_S: f64 = 1.0;
/// Length of the arrow of the strongest touch so far, m; the shortest is a fifth of it.
const MAX_ARROW_M: f64 = 0.06;

/// A periodic task, and the last time that it was done, s.
#[derive(Default)]
struct Timer(Option<f64>);

impl Timer {
    fn is_due(&mut self, t_s: f64, period_s: f64) -> bool {
        // A tolerance avoids being one frame late; a time that goes back restarts the period.
        let due = self.0.is_none_or(|last_s| t_s < last_s || t_s - last_s >= 0.999 * period_s);
        if due {
            self.0 = Some(t_s);
        }
        due
    }
}

struct Link {
    name: String,
    parent: Option<usize>,
    world_from_link: DAffine3,
    parent_from_link: DAffine3,
}

pub(super) struct ViewWriter {
    links: Vec<Link>,
    index_of: HashMap<String, usize>,
    /// Per link its present pose.
    world: Vec<DAffine3>,
    /// Per taxel id, its link and position in it, m.
    taxels: HashMap<u32, (usize, DVec3)>,
    /// The frame of touches that are in the world.
    world_name: String,
    /// Topics of the fields without parents, each with the field's index.
    top_fields: Vec<(String, usize)>,
    /// By link, the corners of its triangles in its frame, m, until they are written.
    surface: Option<Vec<Vec<[DVec3; 3]>>>,
    cloud: Cloud,
    pressures: Vec<(u32, f64)>,
    max_total: f64,
    /// The highest pressure of a taxel so far.
    max_pressure: f64,
    shown: bool,
    timers: [Timer; 3],
    message: Vec<u8>,
}

impl ViewWriter {
    /// For `body`, whose fields are called `names`; touches in the world are in the frame `world`.
    pub(super) fn new(body: &Body, names: &[FieldNames], world: &str) -> Self {
        let links: Vec<Link> = body
            .links
            .iter()
            .enumerate()
            .map(|(index, link)| Link {
                name: link.name.clone(),
                parent: link.parent,
                world_from_link: link.world_from_link(),
                parent_from_link: link
                    .parent
                    .map_or_else(|| link.world_from_link(), |parent| body.rest_transform(parent, index)),
            })
            .collect();
        let mut surface = vec![Vec::new(); links.len()];
        for (link, corners) in body.triangles_at_rest() {
            let link_from_body = body.links[link].body_from_link.inverse();
            surface[link].push(corners.map(|corner| link_from_body.transform_point3(corner)));
        }
        let is_computed = |name: &str| names.iter().any(|names| names.field == name);
        let is_top = |name: &str| {
            let parent = body.fields.iter().find(|spec| spec.name == name).and_then(|spec| spec.parent.as_deref());
            !parent.is_some_and(is_computed)
        };
        // Letters beside pressure have no total.
        let is_pressed = |names: &FieldNames| {
            names.letter.as_deref().is_none_or(|letter| letter.parse::<Receptor>().is_ok_and(Receptor::is_of_pressure))
        };
        let top = names.iter().enumerate().filter(|(_, names)| is_top(&names.field) && is_pressed(names));
        let is_alone =
            |field: &str| names.iter().filter(|names| names.field == field && is_pressed(names)).count() == 1;
        let topic = |names: &FieldNames| {
            if is_alone(&names.field) { names.field.clone() } else { names.with_marks().field }
        };
        Self {
            top_fields: top.map(|(index, names)| (format!("{FIELDS}{}", topic(names)), index)).collect(),
            surface: Some(surface),
            index_of: links.iter().enumerate().map(|(index, link)| (link.name.clone(), index)).collect(),
            world: links.iter().map(|link| link.world_from_link).collect(),
            taxels: body.taxels.iter().map(|taxel| (taxel.id, (taxel.link, taxel.position_in_link))).collect(),
            links,
            world_name: world.to_owned(),
            cloud: Cloud::default(),
            pressures: Vec::new(),
            max_total: 0.0,
            max_pressure: 0.0,
            shown: false,
            timers: Default::default(),
            message: Vec::new(),
        }
    }

    /// Writes links and taxels.
    pub(super) fn write_frames(&mut self, input: &InputFrames<'_>, recorder: &mut Recorder) -> Result<()> {
        if let (Some(first), Some(corners)) = (input.frames.first(), self.surface.take()) {
            let links: Vec<_> = self.links.iter().map(|link| link.name.as_str()).zip(corners).collect();
            self.message.clear();
            surface(nanoseconds(first.t_s), &links, &mut self.message);
            recorder.write(SURFACE, first.t_s, &self.message)?;
        }
        for frame in input.frames {
            let [taxels, _, links] = &mut self.timers;
            let period_s = if frame.pose.is_empty() { LINKS_PERIOD_S } else { TOUCHES_PERIOD_S };
            let (links_due, taxels_due) =
                (links.is_due(frame.t_s, period_s), taxels.is_due(frame.t_s, TAXELS_PERIOD_S));
            if links_due || (taxels_due && !frame.pose.is_empty()) {
                self.pose(frame);
            }
            if links_due {
                self.message.clear();
                let mut transforms = Transforms::new(&mut self.message);
                let time_ns = nanoseconds(frame.t_s);
                for (link, world) in self.links.iter().zip(&self.world) {
                    transforms.push(time_ns, &link.name, world);
                }
                recorder.write(LINKS, frame.t_s, &self.message)?;
            }
            if taxels_due {
                (input.pressures)(frame, &mut self.pressures);
                self.max_pressure = self
                    .pressures
                    .iter()
                    .fold(self.max_pressure, |max_pressure, (_, pressure)| max_pressure.max(*pressure));
                let max_pressure = self.max_pressure.max(f64::MIN_POSITIVE);
                for (id, pressure) in &self.pressures {
                    if let Some((link, place)) = self.taxels.get(id) {
                        let place = self.world[*link].transform_point3(*place);
                        self.cloud.push(place, *pressure, pressure / max_pressure);
                    }
                }
                self.message.clear();
                self.cloud.finish(nanoseconds(frame.t_s), &mut self.message);
                recorder.write(TAXELS, frame.t_s, &self.message)?;
            }
        }
        Ok(())
    }

    /// Updates the links' poses: those in `frame`, and their descendants; all others are at rest, or while joints are late where
    /// they were last.
    fn pose(&mut self, frame: &Frame) {
        let mut posed = vec![false; self.links.len()];
        let mut owns = vec![None; self.links.len()];
        // The first of two of one link holds.
        for (name, pose) in frame.pose.iter().rev() {
            if let Some(&link) = self.index_of.get(name) {
                owns[link] = Some(*pose);
            }
        }
        for ((index, link), own) in self.links.iter().enumerate().zip(owns) {
            if own.is_none() && frame.has_stale_pose {
                continue;
            }
            let above = link.parent.filter(|&parent| posed[parent]);
            self.world[index] = above.map_or(link.world_from_link, |parent| self.world[parent] * link.parent_from_link);
            posed[index] = above.is_some();
            if let Some(pose) = own {
                self.world[index] = pose.transform();
                posed[index] = true;
            }
        }
    }

    /// Writes touches, and the totals of fields.
    pub(super) fn write_touches(&mut self, percepts: &Percepts, recorder: &mut Recorder) -> Result<()> {
        for frame in 0..percepts.frames() {
            let t_s = percepts.t_s(frame);
            for (topic, field) in &self.top_fields {
                let percept = percepts.get(frame, *field);
                if let Some(total) = percept.total {
                    self.message.clear();
                    scalars(nanoseconds(t_s), total, percept.area, &mut self.message);
                    recorder.write(topic, t_s, &self.message)?;
                }
            }
            let Some(found) = percepts.touches(frame).filter(|_| self.timers[1].is_due(t_s, TOUCHES_PERIOD_S)) else {
                continue;
            };
            self.message.clear();
            let mut scene = Scene::new(nanoseconds(t_s), &mut self.message);
            for touch in &found.touches {
                self.max_total = self.max_total.max(touch.total);
                let share = touch.total / self.max_total.max(f64::MIN_POSITIVE);
                let TouchMark { position, normal, turn, diameters_m } = TouchMark::from_touch(touch);
                scene.push(&ShownTouch {
                    id: touch.id,
                    frame: if touch.in_world { &self.world_name } else { &self.links[touch.link as usize].name },
                    position,
                    normal,
                    turn,
                    diameters_m,
                    length_m: MAX_ARROW_M * share.clamp(0.2, 1.0),
                });
            }
            // The end of all touches is written once.
            let any = !found.touches.is_empty();
            if any || self.shown {
                recorder.write(TOUCHES, t_s, &self.message)?;
            }
            self.shown = any;
        }
        Ok(())
    }
}
