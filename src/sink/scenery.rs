//! What viewers show of a recording: the taxels with their pressures, the touched fields, where links are; as often as an
//! eye can follow.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use super::{FieldNames, Heard};
use crate::body::Body;
use crate::error::Result;
use crate::percept::Percepts;
use crate::recording::{Arrow, Cloud, LINKS, Recorder, Scene, TAXELS, TOUCHES, Transforms, nanoseconds};
use crate::signal::Frame;

/// Between two pictures of all taxels, s.
const TAXELS_EVERY_S: f64 = 0.1;
/// Between two pictures of the touches, or of links that move, s.
const TOUCHES_EVERY_S: f64 = 0.04;
/// Between two tellings of where links at rest are, s, so that a viewer that jumps into a recording soon knows.
const LINKS_EVERY_S: f64 = 1.0;
/// The sphere of a touch whose area is not known is this wide, m.
const USUAL_WIDTH_M: f64 = 0.01;
/// The arrow of the strongest touch yet is this long, and none is shorter than a fifth of it, m.
const LONGEST_ARROW_M: f64 = 0.06;

/// When something is due again.
struct Pace {
    every_s: f64,
    last_s: Option<f64>,
}

impl Pace {
    fn new(every_s: f64) -> Self {
        Self { every_s, last_s: None }
    }

    fn is_due(&mut self, t_s: f64, every_s: f64) -> bool {
        // A little early is better than one frame late; where time goes back, it begins anew.
        let due = self.last_s.is_none_or(|last_s| t_s < last_s || t_s - last_s >= 0.999 * every_s);
        if due {
            self.last_s = Some(t_s);
        }
        due
    }

    fn due(&mut self, t_s: f64) -> bool {
        self.is_due(t_s, self.every_s)
    }
}

struct Link {
    name: String,
    parent: Option<usize>,
    world_from_link: DAffine3,
    parent_from_link: DAffine3,
}

pub(super) struct Scenery {
    links: Vec<Link>,
    index_of: HashMap<String, usize>,
    /// Per link, where it is now.
    world: Vec<DAffine3>,
    /// Per taxel id, its link and its place there, m.
    taxels: HashMap<u32, (usize, DVec3)>,
    fields: Vec<(String, String)>,
    cloud: Cloud,
    pressures: Vec<(u32, f64)>,
    strongest: f64,
    /// The highest pressure of a taxel yet.
    highest: f64,
    shown: bool,
    paces: [Pace; 3],
    message: Vec<u8>,
}

impl Scenery {
    pub(super) fn new(body: &Body, names: &[FieldNames]) -> Self {
        let links: Vec<Link> = body
            .links
            .iter()
            .map(|link| Link {
                name: link.name.clone(),
                parent: link.parent,
                world_from_link: link.world_from_link,
                parent_from_link: link.parent.map_or(link.world_from_link, |parent| {
                    body.links[parent].world_from_link.inverse() * link.world_from_link
                }),
            })
            .collect();
        let field = |names: &FieldNames| {
            let marks = [&names.letter, &names.signal].into_iter().flatten();
            let name = marks.fold(names.field.clone(), |name, mark| format!("{name} ({mark})"));
            (name, names.link.clone())
        };
        Self {
            index_of: links.iter().enumerate().map(|(index, link)| (link.name.clone(), index)).collect(),
            world: links.iter().map(|link| link.world_from_link).collect(),
            taxels: body.taxels.iter().map(|taxel| (taxel.id, (taxel.link, taxel.position_in_link))).collect(),
            links,
            fields: names.iter().map(field).collect(),
            cloud: Cloud::default(),
            pressures: Vec::new(),
            strongest: 0.0,
            highest: 0.0,
            shown: false,
            paces: [Pace::new(TAXELS_EVERY_S), Pace::new(TOUCHES_EVERY_S), Pace::new(LINKS_EVERY_S)],
            message: Vec::new(),
        }
    }

    /// Shows links and taxels.
    pub(super) fn hear(&mut self, heard: &Heard<'_>, recorder: &mut Recorder) -> Result<()> {
        for frame in heard.frames {
            let [taxels, _, links] = &mut self.paces;
            let every_s = if frame.pose.is_empty() { LINKS_EVERY_S } else { TOUCHES_EVERY_S };
            let (links_due, taxels_due) = (links.is_due(frame.t_s, every_s), taxels.due(frame.t_s));
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
                (heard.pressures)(frame, &mut self.pressures);
                self.highest =
                    self.pressures.iter().fold(self.highest, |highest, (_, pressure)| highest.max(*pressure));
                let highest = self.highest.max(f64::MIN_POSITIVE);
                for (id, pressure) in &self.pressures {
                    if let Some((link, place)) = self.taxels.get(id) {
                        let place = self.world[*link].transform_point3(*place);
                        self.cloud.push(place, *pressure, pressure / highest);
                    }
                }
                self.message.clear();
                self.cloud.finish(nanoseconds(frame.t_s), &mut self.message);
                recorder.write(TAXELS, frame.t_s, &self.message)?;
            }
        }
        Ok(())
    }

    /// Moves links as `frame` says: those that it poses, and what hangs on them as at rest; all others are at rest.
    fn pose(&mut self, frame: &Frame) {
        let mut posed = vec![false; self.links.len()];
        for (index, link) in self.links.iter().enumerate() {
            let above = link.parent.filter(|&parent| posed[parent]);
            self.world[index] = above.map_or(link.world_from_link, |parent| self.world[parent] * link.parent_from_link);
            posed[index] = above.is_some();
            let own = frame.pose.iter().find(|(name, _)| self.index_of.get(name) == Some(&index));
            if let Some((_, pose)) = own {
                self.world[index] = DAffine3::from_rotation_translation(pose.rotation, pose.translation);
                posed[index] = true;
            }
        }
    }

    /// Shows the touched fields.
    pub(super) fn see(&mut self, percepts: &Percepts, recorder: &mut Recorder) -> Result<()> {
        for frame in 0..percepts.frames() {
            let t_s = percepts.t_s(frame);
            if !self.paces[1].due(t_s) {
                continue;
            }
            self.message.clear();
            let mut scene = Scene::new(nanoseconds(t_s), &mut self.message);
            let mut any = false;
            for percept in percepts.touched(frame) {
                let Some(position) = percept.position else { continue };
                let (field, link) = &self.fields[percept.field];
                let pressed = percept.total.or(percept.peak);
                self.strongest = self.strongest.max(pressed.unwrap_or(0.0));
                let share = pressed.map_or(1.0, |pressed| pressed / self.strongest.max(f64::MIN_POSITIVE));
                let area = percept.area.filter(|&area| area > 0.0);
                scene.push(&Arrow {
                    field,
                    link: if percept.in_world { "world" } else { link },
                    position,
                    normal: percept.normal,
                    diameter_m: area.map_or(USUAL_WIDTH_M, |area| 2.0 * (area / std::f64::consts::PI).sqrt()),
                    length_m: LONGEST_ARROW_M * share.clamp(0.2, 1.0),
                });
                any = true;
            }
            // That nothing is touched any more is shown once.
            if any || self.shown {
                recorder.write(TOUCHES, t_s, &self.message)?;
            }
            self.shown = any;
        }
        Ok(())
    }
}
