//! Touched fields as markers with ids that stay.

use glam::{DQuat, DVec3};

use super::moment::TouchedField;
use super::places::{WORLD, header, quaternion, vector, z_up_from_y_up};
use crate::robot::messages::{Color, Marker, MarkerArray, Point, Pose};
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
}

impl Touches {
    pub(super) fn new(fields: Vec<FieldNames>) -> Self {
        let none = vec![[false; 2]; fields.len()];
        Self { shown: none.clone(), before: none, fields }
    }

    /// The markers of a frame: those of `touched` fields, and the ends of those that are no longer touched. `None` where there
    /// are neither.
    pub(super) fn message(&mut self, time_ns: u64, touched: &[TouchedField]) -> Option<MarkerArray> {
        let mut shows = vec![[false; 2]; self.fields.len()];
        let mut markers = Vec::new();
        for touch in touched {
            let Some(position) = touch.position.map(DVec3::from) else { continue };
            shows[touch.field] = [true, touch.normal.is_some()];
            markers.push(self.sphere(time_ns, touch, position));
            markers.extend(touch.normal.map(|normal| self.arrow(time_ns, touch, position, normal.into())));
        }
        for (field, (shows, shown)) in shows.iter().zip(&self.shown).enumerate() {
            for part in (0..2).filter(|&part| shown[part] && !shows[part]) {
                let FieldNames { field: name, link, .. } = &self.fields[field];
                let (ns, id) = (name.clone(), id(field, part));
                markers.push(Marker { header: header(time_ns, link), ns, id, action: DELETE, ..Marker::default() });
            }
        }
        self.before = std::mem::replace(&mut self.shown, shows);
        (!markers.is_empty()).then_some(MarkerArray { markers })
    }

    /// Says that the last message was not sent: what it ended is still shown.
    pub(super) fn was_refused(&mut self) {
        for (shown, before) in self.shown.iter_mut().zip(&self.before) {
            (0..2).for_each(|part| shown[part] |= before[part]);
        }
    }

    fn marker(&self, time_ns: u64, touch: &TouchedField, part: usize, position: DVec3, turn: DQuat) -> Marker {
        let FieldNames { field: name, link, world, .. } = &self.fields[touch.field];
        let frame = if touch.in_world { world } else { link };
        // A link stays as the body has it, the world itself is z up.
        let up = if touch.in_world && world == WORLD { z_up_from_y_up() } else { DQuat::IDENTITY };
        let (position, turn) = (up * position, up * turn);
        Marker {
            header: header(time_ns, frame),
            ns: name.clone(),
            id: id(touch.field, part),
            action: ADD,
            pose: Pose {
                position: Point { x: position.x, y: position.y, z: position.z },
                orientation: quaternion(turn.normalize()),
            },
            color: COLOUR,
            // It moves with its link until the next message.
            frame_locked: !touch.in_world,
            ..Marker::default()
        }
    }

    fn sphere(&self, time_ns: u64, touch: &TouchedField, position: DVec3) -> Marker {
        let area_m2 = touch.area_m2.filter(|&area| area > 0.0);
        let diameter_m = area_m2.map_or(DEFAULT_DIAMETER_M, |area| 2.0 * (area / std::f64::consts::PI).sqrt());
        let marker = self.marker(time_ns, touch, 0, position, DQuat::IDENTITY);
        Marker { r#type: SPHERE, scale: vector(DVec3::splat(diameter_m)), ..marker }
    }

    fn arrow(&self, time_ns: u64, touch: &TouchedField, position: DVec3, normal: DVec3) -> Marker {
        let marker =
            self.marker(time_ns, touch, 1, position, DQuat::from_rotation_arc(DVec3::X, normal.normalize_or(DVec3::X)));
        Marker { r#type: ARROW, scale: vector(ARROW_M.into()), ..marker }
    }
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
            let markers = touches.message(0, touched).map_or_else(Vec::new, |message| message.markers);
            if !is_sent {
                touches.was_refused();
            }
            markers.iter().map(|marker| (marker.ns.clone(), marker.action)).collect::<Vec<_>>()
        };
        let [a, b] = ["a", "b"].map(str::to_owned);
        assert_eq!(told(&[touch(0)], true), [(a.clone(), ADD)]);
        assert_eq!(told(&[touch(1)], false), [(b.clone(), ADD), (a.clone(), DELETE)]);
        assert_eq!(told(&[touch(1)], true), [(b.clone(), ADD), (a, DELETE)]);
        assert_eq!(told(&[], true), [(b, DELETE)]);
        assert_eq!(told(&[], true), []);
    }
}
