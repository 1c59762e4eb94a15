//! What viewers show: messages of the well-known package `foxglove`.

use glam::{DAffine3, DQuat, DVec3};

use super::proto::Writer;

/// Bytes of a point: x, y, z and the pressure, single precision each, and its colour. By these names of its parts viewers
/// know it for one.
const STRIDE: u32 = 20;
const NUMBERS: [&str; 4] = ["x", "y", "z", "pressure"];
const COLOURS: [&str; 4] = ["red", "green", "blue", "alpha"];
/// `UINT8` and `FLOAT32` of `PackedElementField.NumericType`.
const UINT8: u64 = 1;
const FLOAT32: u64 = 7;
/// Red, green and blue of what is touched, and of a taxel that is not.
const TOUCHED: [f64; 3] = [0.95, 0.35, 0.1];
const UNTOUCHED: [f64; 3] = [0.35, 0.4, 0.5];
/// Red, green, blue and opacity of the body's surface.
const SURFACE_COLOUR: [f64; 4] = [0.62, 0.62, 0.60, 1.0];
/// `ALL` of `SceneEntityDeletion.Type`.
const ALL: u64 = 1;

fn vector(writer: &mut Writer<'_>, field: u32, [x, y, z]: [f64; 3]) {
    writer.message(field, |vector| {
        vector.double(1, x);
        vector.double(2, y);
        vector.double(3, z);
    });
}

fn quaternion(writer: &mut Writer<'_>, field: u32, rotation: DQuat) {
    writer.message(field, |writer| {
        for (field, value) in (1..).zip(rotation.to_array()) {
            writer.double(field, value);
        }
    });
}

fn pose(writer: &mut Writer<'_>, field: u32, place: [f64; 3], rotation: DQuat) {
    writer.message(field, |writer| {
        vector(writer, 1, place);
        quaternion(writer, 2, rotation);
    });
}

fn rgba(writer: &mut Writer<'_>, field: u32, colour: [f64; 4]) {
    writer.message(field, |writer| {
        for (field, value) in (1..).zip(colour) {
            writer.double(field, value);
        }
    });
}

/// [`TOUCHED`], so opaque.
fn colour(writer: &mut Writer<'_>, field: u32, alpha: f64) {
    let [r, g, b] = TOUCHED;
    rgba(writer, field, [r, g, b, alpha]);
}

/// The surface of a body as `foxglove.SceneUpdate`, appended to `to`: of each link its triangles, corners in the link's frame, m.
pub fn surface(time_ns: u64, links: &[(&str, Vec<[DVec3; 3]>)], to: &mut Vec<u8>) {
    let mut writer = Writer(to);
    for (link, triangles) in links.iter().filter(|(_, triangles)| !triangles.is_empty()) {
        writer.message(2, |entity| {
            entity.time(1, time_ns);
            entity.text(2, link);
            entity.text(3, &format!("surface/{link}"));
            entity.number(5, 1);
            entity.message(12, |list| {
                pose(list, 1, [0.0; 3], DQuat::IDENTITY);
                triangles.iter().flatten().for_each(|corner| vector(list, 2, corner.to_array()));
                rgba(list, 3, SURFACE_COLOUR);
            });
        });
    }
}

/// What plots show of a field, `somatic.Field`, appended to `to`: its total, and its area, m², where it is known.
pub fn scalars(time_ns: u64, total: f64, area: Option<f64>, to: &mut Vec<u8>) {
    let mut writer = Writer(to);
    writer.time(1, time_ns);
    writer.double(2, total);
    if let Some(area) = area {
        writer.double(3, area);
    }
}

/// Taxels as points, m in the world, each with its pressure and a colour for it.
#[derive(Default)]
pub struct Cloud {
    data: Vec<u8>,
}

impl Cloud {
    /// A point whose pressure is that `share` of the highest.
    pub fn push(&mut self, place: DVec3, pressure: f64, share: f64) {
        let [x, y, z] = place.as_vec3().to_array();
        for value in [x, y, z, pressure as f32] {
            self.data.extend_from_slice(&value.to_le_bytes());
        }
        // A root, as little pressure is to be seen too.
        let share = share.clamp(0.0, 1.0).sqrt();
        for (from, to) in UNTOUCHED.into_iter().zip(TOUCHED) {
            self.data.push((255.0 * (from + (to - from) * share)).round() as u8);
        }
        self.data.push(u8::MAX);
    }

    /// The message `foxglove.PointCloud`, appended to `to`; afterwards there are no points.
    pub fn finish(&mut self, time_ns: u64, to: &mut Vec<u8>) {
        let mut writer = Writer(to);
        writer.time(1, time_ns);
        writer.text(2, "world");
        pose(&mut writer, 3, [0.0; 3], DQuat::IDENTITY);
        writer.fixed32(4, STRIDE);
        let numbers = (0..).step_by(4).zip(NUMBERS).map(|(offset, name)| (offset, name, FLOAT32));
        let colours = (16..).zip(COLOURS).map(|(offset, name)| (offset, name, UINT8));
        for (offset, name, kind) in numbers.chain(colours) {
            writer.message(5, |field| {
                field.text(1, name);
                field.fixed32(2, offset);
                field.number(3, kind);
            });
        }
        writer.bytes(6, &self.data);
        self.data.clear();
    }
}

/// Where links are in the world: `foxglove.FrameTransforms`.
pub struct Transforms<'a>(Writer<'a>);

impl<'a> Transforms<'a> {
    /// Into `to`, after what is there.
    pub fn new(to: &'a mut Vec<u8>) -> Self {
        Self(Writer(to))
    }

    /// Adds the link `link` at `time_ns`.
    pub fn push(&mut self, time_ns: u64, link: &str, world_from_link: &DAffine3) {
        let (_, rotation, translation) = world_from_link.to_scale_rotation_translation();
        self.0.message(1, |transform| {
            transform.time(1, time_ns);
            transform.text(2, "world");
            transform.text(3, link);
            vector(transform, 4, translation.to_array());
            quaternion(transform, 5, rotation);
        });
    }
}

/// A touch: an ellipsoid where it is, and an arrow that presses it.
pub struct ShownTouch<'a> {
    /// Its id.
    pub id: u64,
    /// What the rest is in.
    pub frame: &'a str,
    /// The middle of the ellipsoid, m.
    pub position: DVec3,
    /// The outward unit normal there.
    pub normal: DVec3,
    /// Turns the ellipsoid's axes into those of the frame.
    pub turn: DQuat,
    /// Its diameters along its own axes, m.
    pub diameters_m: DVec3,
    /// Length of the arrow, m.
    pub length_m: f64,
}

/// The touches of a frame: `foxglove.SceneUpdate`, in place of whatever was shown before.
pub struct Scene<'a> {
    writer: Writer<'a>,
    time_ns: u64,
}

impl<'a> Scene<'a> {
    #[doc(hidden)]
    pub fn new(time_ns: u64, to: &'a mut Vec<u8>) -> Self {
        let mut writer = Writer(to);
        writer.message(1, |deletion| {
            deletion.time(1, time_ns);
            deletion.number(2, ALL);
        });
        Self { writer, time_ns }
    }

    #[doc(hidden)]
    pub fn push(&mut self, touch: &ShownTouch<'_>) {
        let &ShownTouch { id, frame, position, normal, turn, diameters_m, length_m } = touch;
        self.writer.message(2, |entity| {
            entity.time(1, self.time_ns);
            entity.text(2, frame);
            entity.text(3, &id.to_string());
            entity.number(5, 1);
            entity.message(7, |arrow| {
                // An arrow lies along +x.
                let tail = position + normal * length_m;
                pose(arrow, 1, tail.to_array(), DQuat::from_rotation_arc(DVec3::X, -normal));
                arrow.double(2, 0.7 * length_m);
                arrow.double(3, 0.1 * length_m);
                arrow.double(4, 0.3 * length_m);
                arrow.double(5, 0.2 * length_m);
                colour(arrow, 6, 1.0);
            });
            entity.message(9, |sphere| {
                pose(sphere, 1, position.to_array(), turn);
                vector(sphere, 2, diameters_m.to_array());
                colour(sphere, 3, 0.6);
            });
        });
    }
}
