//! A right hand of four digits with 40 force-sensing resistors, wired to 64 channels; taxel id = channel.
//!
//! The hand's frame: +x to the thumb's side, +y out of the back, +z to the fingertips; origin in the palm's middle.
//! Channels as the boards give them, each board having two 8:1 multiplexers: palm 0–15, back of the hand 16–31 (with
//! the side board on its channels 9 and 10), mid-hand 32–63, five to a finger.

use std::collections::BTreeMap;

use glam::DVec3;
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};

use super::solid::{Solid, Taper, exit_point, mesh, smooth_min};

const MM: f64 = 1e-3;

/// Radius of a sensor, m.
const SENSOR_RADIUS: f64 = 2.5 * MM;
/// Half of the palm's width, height and length, m.
const PALM: DVec3 = DVec3::new(24.0 * MM, 5.5 * MM, 18.0 * MM);
/// Distance between neighbours on the palm and back boards, across and along the hand, m.
const PITCH: [f64; 2] = [12.0 * MM, 11.0 * MM];

const BACK_CHANNEL: u32 = 16;
const SIDE_CHANNELS: [u32; 2] = [BACK_CHANNEL + 9, BACK_CHANNEL + 10];
const MIDHAND_CHANNEL: u32 = 32;

/// Which sensors a hand has.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Senses {
    /// 40 force-sensing resistors.
    Pressure,
    /// Those of the palm and the fingers measure along three axes; the palm has nine thermometers and four distance sensors between its
    /// own.
    All,
}

/// Ids of the first thermometer and of the first distance sensor.
pub(crate) const THERMOMETERS: u32 = 64;
pub(crate) const DISTANCES: u32 = 80;

/// The hand as a file, and its sensors.
pub(crate) struct Hand {
    pub(crate) glb: Glb,
    pub(crate) sensors: Vec<Sensor>,
}

/// One force-sensing resistor, in the hand's frame at rest.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    pub(crate) id: u32,
    /// Field of the board, or of the finger.
    pub(crate) field: &'static str,
    pub(crate) position_in_hand: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) modality: Modality,
    /// Of one with three axes.
    pub(crate) tangent: Option<DVec3>,
}

/// A finger: where it leaves the palm, its axes, and how long it is beside the others.
struct Finger {
    link: &'static str,
    field: &'static str,
    root_in_hand: DVec3,
    forward: DVec3,
    palmar: DVec3,
    scale: f64,
}

fn fingers() -> [Finger; 4] {
    let straight = |link, field, x: f64, scale| Finger {
        link,
        field,
        root_in_hand: DVec3::new(x, 0.0, 16.5) * MM,
        forward: DVec3::Z,
        palmar: DVec3::NEG_Y,
        scale,
    };
    let forward = DVec3::new(0.80, -0.16, 0.58).normalize();
    [
        Finger {
            link: "thumb",
            field: "hand/midhand/thumb",
            root_in_hand: DVec3::new(20.0, -0.5, -5.0) * MM,
            forward,
            palmar: (DVec3::NEG_Y - forward * DVec3::NEG_Y.dot(forward)).normalize(),
            scale: 0.9,
        },
        straight("index", "hand/midhand/index", 15.5, 1.0),
        straight("middle", "hand/midhand/middle", 0.0, 1.1),
        straight("ring", "hand/midhand/ring", -15.5, 0.98),
    ]
}

impl Finger {
    /// A place in the finger's own measures (mm at scale 1: to the side, palmar, forward), m in its link's frame.
    fn at(&self, side: f64, palmar: f64, forward: f64) -> DVec3 {
        let along = forward * self.scale;
        (self.palmar.cross(self.forward) * side + self.palmar * palmar + self.forward * along) * MM
    }

    fn mesh(&self) -> MeshData {
        let joints = [(0.0, 0.0, 6.3), (-0.6, 15.0, 6.1), (0.3, 28.0, 6.5), (1.6, 35.0, 5.3)];
        let tapers: Vec<Taper> = joints
            .windows(2)
            .map(|pair| Taper {
                a: self.at(0.0, pair[0].0, pair[0].1),
                b: self.at(0.0, pair[1].0, pair[1].1),
                ra: pair[0].2 * MM,
                rb: pair[1].2 * MM,
            })
            .collect();
        let solid = |p: DVec3| {
            let distances = tapers.iter().map(|taper| taper.distance(p));
            distances.reduce(|a, b| smooth_min(a, b, 3.0 * MM)).expect("a finger has three parts")
        };
        let reach = DVec3::splat(8.0 * MM);
        let tip = self.at(0.0, 1.6, 35.0);
        mesh(&solid, tip.min(DVec3::ZERO) - reach, tip.max(DVec3::ZERO) + reach, 1.5 * MM)
    }

    /// From the palm outward along the palmar face: two along the shaft, two side by side on the pad, one at the tip.
    fn sensors(&self, mesh: &MeshData) -> Vec<(DVec3, DVec3)> {
        let places: [(f64, f64, f64); 5] =
            [(9.0, 0.0, 0.0), (19.0, 0.0, 0.0), (26.5, -0.46, 0.0), (26.5, 0.46, 0.0), (33.0, 0.0, 0.25)];
        places
            .iter()
            .map(|&(forward, side, tilt)| {
                let from = self.at(0.0, 0.0, forward);
                let to = self.palmar + self.palmar.cross(self.forward) * side + self.forward * tilt;
                exit_point(mesh, from, to.normalize()).expect("a finger surrounds its axis")
            })
            .collect()
    }
}

/// A flat slab with rounded corners and edges.
fn palm() -> MeshData {
    let (corner, edge) = (8.0 * MM, 3.0 * MM);
    let solid = move |p: DVec3| {
        let (x, z) = (p.x.abs() - (PALM.x - corner), p.z.abs() - (PALM.z - corner));
        let outline = (x.max(0.0) * x.max(0.0) + z.max(0.0) * z.max(0.0)).sqrt() + x.max(z).min(0.0) - corner;
        let (across, up) = (outline + edge, p.y.abs() - PALM.y + edge);
        let (a, b) = (across.max(0.0), up.max(0.0));
        (a * a + b * b).sqrt() + across.max(up).min(0.0) - edge
    };
    mesh(&solid, -PALM, PALM, 1.5 * MM)
}

/// Nine sensors in three rows from the fingers to the wrist, each from the thumb's side to the other; `up` is +1 for
/// the back of the hand and −1 for the palm.
fn board(mesh: &MeshData, up: f64) -> Vec<(DVec3, DVec3)> {
    (0..9)
        .map(|i| {
            let (row, column) = (f64::from(i / 3), f64::from(i % 3));
            let inside = DVec3::new(PITCH[0] * (1.0 - column), 0.0, PITCH[1] * (1.0 - row));
            exit_point(mesh, inside, DVec3::Y * up).expect("the palm surrounds its middle plane")
        })
        .collect()
}

fn side_board(mesh: &MeshData) -> Vec<(DVec3, DVec3)> {
    [0.5, -0.5]
        .map(|step| {
            exit_point(mesh, DVec3::Z * (PITCH[1] * step), DVec3::NEG_X).expect("the palm surrounds its middle")
        })
        .to_vec()
}

fn field(name: &str, parent: Option<&str>, ids: impl IntoIterator<Item = u32>) -> FieldSpec {
    FieldSpec {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        members: ids.into_iter().map(|id| (id, MemberSpec::default())).collect(),
        chart: None,
    }
}

fn taxels(sensors: &[Sensor], origin_in_hand: DVec3) -> Vec<Taxel> {
    sensors
        .iter()
        .map(|sensor| Taxel {
            id: sensor.id,
            link: 0,
            position_in_link: sensor.position_in_hand - origin_in_hand,
            normal_in_link: sensor.normal,
            area: std::f64::consts::PI * SENSOR_RADIUS * SENSOR_RADIUS,
            modality: sensor.modality,
            tangent_in_link: sensor.tangent,
        })
        .collect()
}

/// Gives sensors three axes: along `forward` as it lies in the skin, and across it.
fn pull(sensors: &mut [Sensor], forward: DVec3) {
    for sensor in sensors {
        sensor.modality = Modality::Force3;
        sensor.tangent = Some((forward - sensor.normal * forward.dot(sensor.normal)).normalize());
    }
}

/// The palm's thermometers, a third of a pitch from its nine pressure sensors, and a distance sensor between each four of these.
fn palm_senses(mesh: &MeshData) -> Vec<Sensor> {
    let sensor = |id: u32, modality, inside: DVec3| {
        let (position_in_hand, normal) =
            exit_point(mesh, inside, DVec3::NEG_Y).expect("the palm surrounds its middle plane");
        Sensor { id, field: "hand/palm", position_in_hand, normal, modality, tangent: None }
    };
    let place = |row: f64, column: f64| DVec3::new(PITCH[0] * (1.0 - column), 0.0, PITCH[1] * (1.0 - row));
    let thermometer = |i: u32| {
        let inside = place(f64::from(i / 3), f64::from(i % 3)) + DVec3::Z * (PITCH[1] / 3.0);
        sensor(THERMOMETERS + i, Modality::Temperature, inside)
    };
    let distance =
        |i: u32| sensor(DISTANCES + i, Modality::Proximity, place(f64::from(i / 2) + 0.5, f64::from(i % 2) + 0.5));
    (0..9).map(thermometer).chain((0..4).map(distance)).collect()
}

/// Makes the hand.
pub(crate) fn make(senses: Senses) -> Hand {
    let mut glb = Glb::new();
    glb.describe(&BTreeMap::from([
        (
            "title",
            match senses {
                Senses::Pressure => "A right hand with 40 force-sensing resistors",
                Senses::All => "A right hand that feels force along three axes, temperature and distance",
            },
        ),
        ("after", "Stiehl, Lalla, Breazeal: Applying a \"Somatic Alphabet\" Approach, section III"),
        ("taxel_id", "channel of the mid-hand processing board, 0-63"),
    ]));
    let skin = glb.material("glove", [0.62, 0.45, 0.33], 0.7);
    let hand = glb.node("hand", None, DVec3::ZERO);
    let palm = palm();
    glb.mesh(hand, "palm", &palm, Some(skin), None);

    let mut sensors = Vec::new();
    let mut add = |field, ids: &[u32], places: &[(DVec3, DVec3)], origin: DVec3| {
        sensors.extend(ids.iter().zip(places).map(|(&id, &(position, normal))| Sensor {
            id,
            field,
            position_in_hand: origin + position,
            normal,
            modality: Modality::Pressure,
            tangent: None,
        }));
    };
    let nine = |first: u32| (first..first + 9).collect::<Vec<u32>>();
    add("hand/palm", &nine(0), &board(&palm, -1.0), DVec3::ZERO);
    add("hand/back", &nine(BACK_CHANNEL), &board(&palm, 1.0), DVec3::ZERO);
    add("hand/side", &SIDE_CHANNELS, &side_board(&palm), DVec3::ZERO);
    let mut links = Vec::new();
    for (first, finger) in (MIDHAND_CHANNEL..).step_by(5).zip(fingers()) {
        let mesh = finger.mesh();
        let ids: Vec<u32> = (first..first + 5).collect();
        add(finger.field, &ids, &finger.sensors(&mesh), finger.root_in_hand);
        let node = glb.node(finger.link, Some(hand), finger.root_in_hand);
        glb.mesh(node, finger.link, &mesh, Some(skin), None);
        links.push((node, finger));
    }

    if senses == Senses::All {
        pull(&mut sensors[..9], DVec3::Z);
        for (five, (_, finger)) in sensors[20..].chunks_mut(5).zip(&links) {
            pull(five, finger.forward);
        }
        let more = palm_senses(&palm);
        sensors.splice(20..20, more);
    }
    let (boards, digits) = sensors.split_at(sensors.len() - 20);
    glb.taxels("hand taxels", Some(hand), &taxels(boards, DVec3::ZERO), None);
    for ((node, finger), five) in links.iter().zip(digits.chunks(5)) {
        let name = format!("{} taxels", finger.link);
        glb.taxels(&name, Some(*node), &taxels(five, finger.root_in_hand), None);
    }

    glb.field(&field("hand", None, []), Some(hand), DVec3::ZERO);
    let of_palm = boards.iter().filter(|sensor| sensor.field == "hand/palm").map(|sensor| sensor.id);
    glb.field(&field("hand/palm", Some("hand"), of_palm), Some(hand), DVec3::NEG_Y * PALM.y);
    for (name, row, column) in
        [("radial_distal", 0, 0), ("ulnar_distal", 0, 1), ("radial_proximal", 1, 0), ("ulnar_proximal", 1, 1)]
    {
        let ids: Vec<u32> = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(r, c)| 3 * (row + r) + column + c).to_vec();
        let middle = ids.iter().map(|&id| sensors[id as usize].position_in_hand).sum::<DVec3>() / 4.0;
        glb.field(&field(&format!("hand/palm/{name}"), Some("hand/palm"), ids), Some(hand), middle);
    }
    // Seen from outside with the fingers up, u points right and v up on the back too.
    let chart = ChartSpec { kind: ChartKind::Plane, origin_in_anchor: None, u_in_anchor: Some([-1.0, 0.0, 0.0]) };
    let back = FieldSpec { chart: Some(chart), ..field("hand/back", Some("hand"), nine(BACK_CHANNEL)) };
    glb.field(&back, Some(hand), DVec3::Y * PALM.y);
    glb.field(&field("hand/side", Some("hand"), SIDE_CHANNELS), Some(hand), DVec3::NEG_X * PALM.x);
    glb.field(&field("hand/midhand", Some("hand"), []), Some(hand), DVec3::Z * PALM.z);
    for ((node, finger), five) in links.iter().zip(digits.chunks(5)) {
        let ids = five.iter().map(|sensor| sensor.id);
        let tip = five[4].position_in_hand - finger.root_in_hand;
        glb.field(&field(finger.field, Some("hand/midhand"), ids), Some(*node), tip);
    }
    Hand { glb, sensors }
}
