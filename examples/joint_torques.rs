//! Touch in a controller: the torque of a joint that touches explain, to be taken off the torque that is measured.
//!
//!     cargo run --example joint_torques
//!     cargo run --example joint_torques -- examples/simulations/elbow.toml left_upper_arm z
//!
//! A simulation stands for the robot: its frames, and its calibration, whose unit makes forces of pressures. The joint turns the link
//! that is named about an axis through the link's origin, and bears what presses on that link and on all that hang on it.

use glam::DVec3;
use somatic::percept::LinkShare;
use somatic::source::{SimulatedSource, Source as _};
use somatic::{Body, Calibration, Engine, Error, Frame, Options, Result, Scene, touch};

/// Newtons, which ideal simulated sensors give; your robot's calibration says its own.
const UNIT: &str = "[all]\nunit = \"N\"\n";

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let usual = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/elbow.toml");
    let mut source = SimulatedSource::open(arguments.next().unwrap_or_else(|| usual.to_owned()))?;
    let body = source.body().clone();
    let link = arguments.next().unwrap_or_else(|| "left_forearm".to_owned());
    let joint = Joint::new(&body, &link, &arguments.next().unwrap_or_else(|| "x".to_owned()))?;

    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&Calibration::lay_over(&source.calibration(), UNIT)?.text, &ids)?;
    let scene = Scene::default().touches(touch::Options::default());
    let mut engine = Engine::new(&body, Options::default().scene(scene).calibration(calibration))?;
    engine.set_channels(source.taxels())?;

    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut presses = Vec::new();
    while source.next_frame(&mut frame)? {
        let percepts = engine.process_one(&frame)?;
        let touches = percepts.touches(0).map_or(0, |found| found.touches.len());
        // Whatever touches they are of, all pressed taxels count once.
        engine.presses_on_links(&mut presses);
        let Pressed { force_newton, torque_newton_m } = joint.pressed(&body, &presses)?;
        // Yours would go on: `let free = measured_newton_m - explained_newton_m;`
        let explained_newton_m = joint.axis_in_link.dot(torque_newton_m);
        println!(
            "{:.2} s  {touches} touches: {:5.2} N on {link} and below, {explained_newton_m:+.3} N m about its axis",
            frame.t_s,
            force_newton.length(),
        );
    }
    Ok(())
}

/// A joint as a controller knows it.
pub struct Joint {
    /// The link that it moves; its origin is on the axis.
    pub link: usize,
    /// A unit vector in the frame of the link.
    pub axis_in_link: DVec3,
    /// By link of the body, whether it moves with the joint.
    pub is_moved: Vec<bool>,
}

/// What presses on a link and on all that hang on it, in the frame of the link; the torque is about its origin.
pub struct Pressed {
    pub force_newton: DVec3,
    pub torque_newton_m: DVec3,
}

impl Joint {
    /// The joint that turns the link called `link` about its `axis`: x, y or z.
    pub fn new(body: &Body, link: &str, axis: &str) -> Result<Self> {
        let found = body.links.iter().position(|own| own.name == link);
        let link = found.ok_or_else(|| Error::usage(format!("the body has no link `{link}`")))?;
        let axis_in_link = match axis {
            "x" => DVec3::X,
            "y" => DVec3::Y,
            "z" => DVec3::Z,
            other => return Err(Error::usage(format!("`{other}` is not an axis; write x, y or z"))),
        };
        let mut is_moved = vec![false; body.links.len()];
        // A parent comes before its children.
        for (index, own) in body.links.iter().enumerate() {
            is_moved[index] = index == link || own.parent.is_some_and(|parent| is_moved[parent]);
        }
        Ok(Self { link, axis_in_link, is_moved })
    }

    /// What of `presses` the joint bears. The robot is at rest here; yours has the poses of now (`somatic::robot::Kinematics`).
    pub fn pressed(&self, body: &Body, presses: &[LinkShare]) -> Result<Pressed> {
        let own_from_body = body.links[self.link].body_from_link.inverse();
        let mut sum = Pressed { force_newton: DVec3::ZERO, torque_newton_m: DVec3::ZERO };
        for press in presses.iter().filter(|press| self.is_moved[press.link as usize]) {
            let other = &body.links[press.link as usize];
            let wrench = press.wrench.ok_or_else(|| {
                Error::failed(format!(
                    "what presses on `{}` is not known in newtons; give a calibration with a unit",
                    other.name
                ))
            })?;
            let own_from_other = own_from_body * other.body_from_link;
            let force_newton = own_from_other.transform_vector3(wrench.force_newton);
            sum.force_newton += force_newton;
            sum.torque_newton_m += own_from_other.transform_vector3(wrench.torque_newton_m)
                + own_from_other.translation.cross(force_newton);
        }
        Ok(sum)
    }
}
