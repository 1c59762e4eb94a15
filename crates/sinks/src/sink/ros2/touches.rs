//! Touches of the whole body as markers: one each, whose id stays.

use std::mem::take;

use super::moment::FeltTouch;
use super::places::{quaternion, vector};
use crate::robot::messages::{Color, Header, Marker, MarkerArray, Point, Time};
use crate::sink::SkinNames;

/// Type and actions of `visualization_msgs/Marker`.
const SPHERE: i32 = 2;
const ADD: i32 = 0;
const DELETE: i32 = 2;

/// The namespace of all markers: ids are of the whole body, and a touch keeps its own where it goes over to another link.
const NAMESPACE: &str = "touches";
const COLOUR: Color = Color { r: 1.0, g: 0.55, b: 0.1, a: 0.9 };

/// Makes the markers of each frame.
pub(super) struct Touches {
    links: Vec<String>,
    world: String,
    /// The touches that are shown, each with its frame.
    shown: Vec<(u64, Frame)>,
    /// The same before the last message.
    before: Vec<(u64, Frame)>,
    /// The last message, whose memory the next one takes.
    message: MarkerArray,
}

/// What a marker's place is in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Frame {
    World,
    Link(u32),
}

impl Touches {
    pub(super) fn new(skin: SkinNames) -> Self {
        let (shown, before) = (Vec::new(), Vec::new());
        Self { links: skin.links, world: skin.world, shown, before, message: MarkerArray::default() }
    }

    /// The markers of a frame: those of its `touches`, and the ends of those that are over. `None` where there are neither.
    pub(super) fn message(&mut self, time_ns: u64, touches: &[FeltTouch]) -> Option<&MarkerArray> {
        let Self { links, world, shown, before, message } = self;
        std::mem::swap(shown, before);
        shown.clear();
        let mut made = Made { markers: &mut message.markers, count: 0, time_ns };
        let name = |frame: Frame| match frame {
            Frame::World => world.as_str(),
            Frame::Link(link) => &links[link as usize],
        };
        for touch in touches {
            let frame = if touch.in_world { Frame::World } else { Frame::Link(touch.link) };
            shown.push((touch.id, frame));
            let marker = made.next(name(frame), touch.id);
            let (place, turn) = (touch.mark.position, touch.mark.turn);
            marker.r#type = SPHERE;
            marker.pose.position = Point { x: place.x, y: place.y, z: place.z };
            marker.pose.orientation = quaternion(turn);
            marker.scale = vector(touch.mark.diameters_m);
            marker.color = COLOUR;
            // It moves with its link until the next message.
            marker.frame_locked = !touch.in_world;
        }
        for &(id, frame) in before.iter().filter(|(id, _)| !is_among(shown, *id)) {
            made.next(name(frame), id).action = DELETE;
        }
        let count = made.count;
        message.markers.truncate(count);
        (count > 0).then_some(message)
    }

    /// Says that the last message was not sent: what it ended is still shown.
    pub(super) fn was_refused(&mut self) {
        let Self { shown, before, .. } = self;
        before.retain(|(id, _)| !is_among(shown, *id));
        shown.append(before);
    }
}

fn is_among(shown: &[(u64, Frame)], id: u64) -> bool {
    shown.iter().any(|(other, _)| *other == id)
}

/// Markers that are made in the memory of older ones.
struct Made<'a> {
    markers: &'a mut Vec<Marker>,
    count: usize,
    time_ns: u64,
}

impl Made<'_> {
    /// The next marker, of the touch `id`, in `frame`.
    fn next(&mut self, frame: &str, id: u64) -> &mut Marker {
        if self.count == self.markers.len() {
            self.markers.push(Marker::default());
        }
        let marker = &mut self.markers[self.count];
        self.count += 1;
        let (mut frame_id, mut ns) = (take(&mut marker.header.frame_id), take(&mut marker.ns));
        frame.clone_into(&mut frame_id);
        NAMESPACE.clone_into(&mut ns);
        let header = Header { stamp: Time::from_ns(self.time_ns), frame_id };
        *marker = Marker { header, ns, id: marker_id(id), action: ADD, ..Marker::default() };
        marker
    }
}

/// The id of the touch `id`: the same number, which begins again after 2³¹ touches.
fn marker_id(id: u64) -> i32 {
    (id & 0x7FFF_FFFF) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_whose_end_was_not_sent_is_ended_with_the_next_message() {
        let touch = |id| FeltTouch { id, ..FeltTouch::default() };
        let skin = SkinNames { links: vec!["hand".into()], world: "world".into(), ..SkinNames::default() };
        let mut touches = Touches::new(skin);
        let mut sent = |touched: &[FeltTouch], is_sent: bool| {
            let markers = touches.message(0, touched).map_or(&[][..], |message| &message.markers);
            let sent = markers.iter().map(|marker| (marker.id, marker.action)).collect::<Vec<_>>();
            assert!(markers.iter().all(|marker| marker.ns == NAMESPACE && marker.header.frame_id == "hand"));
            if !is_sent {
                touches.was_refused();
            }
            sent
        };
        assert_eq!(sent(&[touch(7)], true), [(7, ADD)]);
        assert_eq!(sent(&[touch(9)], false), [(9, ADD), (7, DELETE)]);
        assert_eq!(sent(&[touch(9)], true), [(9, ADD), (7, DELETE)]);
        assert_eq!(sent(&[touch(9), touch(10)], true), [(9, ADD), (10, ADD)]);
        assert_eq!(sent(&[touch(10)], true), [(10, ADD), (9, DELETE)]);
        assert_eq!(sent(&[], true), [(10, DELETE)]);
        assert_eq!(sent(&[], true), []);
    }

    #[test]
    fn an_end_is_reported_in_the_frame_that_the_touch_was_in_last() {
        let skin =
            SkinNames { links: ["arm", "hand"].map(str::to_owned).into(), world: "map".into(), ..SkinNames::default() };
        let mut touches = Touches::new(skin);
        let mut frames = |touched: &[FeltTouch]| -> Vec<(String, bool)> {
            let markers = touches.message(0, touched).map_or(&[][..], |message| &message.markers);
            markers.iter().map(|marker| (marker.header.frame_id.clone(), marker.frame_locked)).collect()
        };
        let touch = |id, link, in_world| FeltTouch { id, link, in_world, ..FeltTouch::default() };
        let locked = |name: &str, is_locked: bool| (name.to_owned(), is_locked);
        assert_eq!(frames(&[touch(0, 0, false), touch(1, 1, true)]), [locked("arm", true), locked("map", false)]);
        // It goes over to another link, with the same id.
        assert_eq!(frames(&[touch(0, 1, false)]), [locked("hand", true), locked("map", false)]);
        assert_eq!(frames(&[]), [locked("hand", false)]);
    }

    #[test]
    fn ids_are_those_of_touches_and_never_negative() {
        assert_eq!([0, 17, 0x8000_0001, u64::MAX].map(marker_id), [0, 17, 1, i32::MAX]);
    }
}
