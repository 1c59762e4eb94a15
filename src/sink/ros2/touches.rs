//! Touched fields as markers with ids that stay.

use std::mem::take;

use glam::{DQuat, DVec3};

use super::moment::TouchedField;
use super::places::{quaternion, vector};
use crate::robot::messages::{Color, Header, Marker, MarkerArray, Point, Time};
use crate::sink::FieldNames;

/// Types and actions of `visualization_msgs/Marker`.
const ARROW: i32 = 0;
const SPHERE: i32 = 2;
const ADD: i32 = 0;
const DELETE: i32 = 2;

/// Diameter of the sphere of a touch without an area, m.
const DEFAULT_DIAMETER_M: f64 = 0.01;
/// Length of the arrow along a touch's normal, and the diameters of its shaft and head, m.
const ARROW_M: [f64; 3] = [0.04, 0.004, 0.008];
const COLOUR: Color = Color { r: 1.0, g: 0.55, b: 0.1, a: 0.9 };

/// Makes the markers of each frame.
pub(super) struct Touches {
    /// Told apart by their names alone.
    fields: Vec<FieldNames>,
    /// By field, whether its sphere and its arrow are shown.
    shown: Vec<[bool; 2]>,
    /// The same before the last message.
    before: Vec<[bool; 2]>,
    /// The last message, whose memory the next one takes.
    message: MarkerArray,
}

impl Touches {
    pub(super) fn new(fields: Vec<FieldNames>) -> Self {
        let none = vec![[false; 2]; fields.len()];
        Self { shown: none.clone(), before: none, fields, message: MarkerArray::default() }
    }

    /// The markers of a frame: those of `touched` fields, and the ends of those that are no longer touched. `None` where there
    /// are neither.
    pub(super) fn message(&mut self, time_ns: u64, touched: &[TouchedField]) -> Option<&MarkerArray> {
        let Self { fields, shown, before, message } = self;
        std::mem::swap(shown, before);
        shown.fill([false; 2]);
        let mut made = Made { markers: &mut message.markers, count: 0, time_ns };
        for touch in touched {
            let Some(position) = touch.position.map(DVec3::from) else { continue };
            let names = &fields[touch.field];
            shown[touch.field][0] = true;
            let sphere = made.placed(names, touch, 0, position, DQuat::IDENTITY);
            (sphere.r#type, sphere.scale) = (SPHERE, vector(DVec3::splat(diameter_m(touch.area_m2))));
            if let Some(normal) = touch.normal.map(DVec3::from) {
                shown[touch.field][1] = true;
                let turn = DQuat::from_rotation_arc(DVec3::X, normal.normalize_or(DVec3::X));
                let arrow = made.placed(names, touch, 1, position, turn);
                (arrow.r#type, arrow.scale) = (ARROW, vector(ARROW_M.into()));
            }
        }
        for (field, (shown, before)) in shown.iter().zip(before).enumerate() {
            for part in (0..2).filter(|&part| before[part] && !shown[part]) {
                made.next(&fields[field], &fields[field].link, id(field, part)).action = DELETE;
            }
        }
        let count = made.count;
        message.markers.truncate(count);
        (count > 0).then_some(message)
    }

    /// Says that the last message was not sent: what it ended is still shown.
    pub(super) fn was_refused(&mut self) {
        for (shown, before) in self.shown.iter_mut().zip(&self.before) {
            (0..2).for_each(|part| shown[part] |= before[part]);
        }
    }
}

/// Markers that are made in the memory of older ones.
struct Made<'a> {
    markers: &'a mut Vec<Marker>,
    count: usize,
    time_ns: u64,
}

impl Made<'_> {
    /// The next marker, of a field's part, in `frame`.
    fn next(&mut self, names: &FieldNames, frame: &str, id: i32) -> &mut Marker {
        if self.count == self.markers.len() {
            self.markers.push(Marker::default());
        }
        let marker = &mut self.markers[self.count];
        self.count += 1;
        let (mut frame_id, mut ns) = (take(&mut marker.header.frame_id), take(&mut marker.ns));
        frame.clone_into(&mut frame_id);
        names.field.clone_into(&mut ns);
        let header = Header { stamp: Time::from_ns(self.time_ns), frame_id };
        *marker = Marker { header, ns, id, action: ADD, ..Marker::default() };
        marker
    }

    /// The next marker, at `position` and turned by `turn`, both in the frame that the touch is told in.
    fn placed(
        &mut self,
        names: &FieldNames,
        touch: &TouchedField,
        part: usize,
        position: DVec3,
        turn: DQuat,
    ) -> &mut Marker {
        let frame = if touch.in_world { &names.world } else { &names.link };
        let marker = self.next(names, frame, id(touch.field, part));
        marker.pose.position = Point { x: position.x, y: position.y, z: position.z };
        marker.pose.orientation = quaternion(turn.normalize());
        marker.color = COLOUR;
        // It moves with its link until the next message.
        marker.frame_locked = !touch.in_world;
        marker
    }
}

/// The diameter of a sphere that is as wide as a touch of this area.
fn diameter_m(area_m2: Option<f64>) -> f64 {
    let area_m2 = area_m2.filter(|&area| area > 0.0);
    area_m2.map_or(DEFAULT_DIAMETER_M, |area| 2.0 * (area / std::f64::consts::PI).sqrt())
}

/// The id of a field's sphere (0) or arrow (1): the same from onset to release, and in every run of the same scene.
fn id(field: usize, part: usize) -> i32 {
    i32::try_from(2 * field + part).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_whose_end_was_not_sent_is_ended_with_the_next_message() {
        let touch = |field| TouchedField { field, position: Some([0.1, 0.0, 0.0]), ..TouchedField::default() };
        let names = |field: &str| FieldNames { field: field.into(), link: "hand".into(), ..FieldNames::default() };
        let mut touches = Touches::new(["a", "b"].map(names).into());
        let mut told = |touched: &[TouchedField], is_sent: bool| {
            let markers = touches.message(0, touched).map_or(&[][..], |message| &message.markers);
            let told = markers.iter().map(|marker| (marker.ns.clone(), marker.action)).collect::<Vec<_>>();
            if !is_sent {
                touches.was_refused();
            }
            told
        };
        let [a, b] = ["a", "b"].map(str::to_owned);
        assert_eq!(told(&[touch(0)], true), [(a.clone(), ADD)]);
        assert_eq!(told(&[touch(1)], false), [(b.clone(), ADD), (a.clone(), DELETE)]);
        assert_eq!(told(&[touch(1)], true), [(b.clone(), ADD), (a, DELETE)]);
        assert_eq!(told(&[], true), [(b, DELETE)]);
        assert_eq!(told(&[], true), []);
    }
}
