//! Which links of a body a URDF moves, and whether the two agree at rest.

use glam::{DAffine3, DQuat, DVec3};

use super::kinematics::Kinematics;
use crate::body::{Body, Taxel, Up};
use crate::error::{Error, Result, failed};
use crate::signal::Pose;

/// How far apart URDF and body may have a link at rest, m.
pub const MAX_REST_DISTANCE_M: f64 = 1e-3;
/// How far they may have it turned against each other, rad.
pub const MAX_REST_ANGLE_RAD: f64 = 0.01;

/// Where bodies that older versions made from a URDF have its root: its x is their left.
const WORLD_FROM_OLD_ROOT: DAffine3 = DAffine3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z, DVec3::ZERO);

/// The links that a URDF and a body have in common, by name.
#[derive(Clone, Debug)]
pub struct LinkMatches {
    /// Index in the URDF, and the name.
    pub(super) matched: Vec<(usize, String)>,
    /// Links of the body that the URDF does not have.
    unmatched: Vec<String>,
    /// The same with what carries them: each link of the body above, the nearest first, as far as one that the URDF has, with the
    /// transform from there to the link at rest.
    carried: Vec<(String, Vec<(String, DAffine3)>)>,
    /// The joints that move a link with taxels, each with such a link.
    pub(super) needed: Vec<(usize, String)>,
    /// How many links of the URDF the body does not have.
    not_in_body: usize,
}

impl LinkMatches {
    /// Matches the links of `robot`, whose axis `up` points up, with those of `body`.
    ///
    /// # Errors
    /// They have no link in common; or with every joint at 0, a link is over [`MAX_REST_DISTANCE_M`] or
    /// [`MAX_REST_ANGLE_RAD`] from where the body has it.
    pub fn new(robot: &Kinematics, body: &Body, up: Up) -> Result<Self> {
        let mut matched = Vec::new();
        for (index, name) in robot.link_names().enumerate() {
            if body.link_index(name).is_some() {
                matched.push((index, name.to_owned()));
            }
        }
        let is_matched = |name: &str| matched.iter().any(|(_, known)| known == name);
        if matched.is_empty() {
            let some: Vec<&str> = body.links.iter().take(3).map(|link| link.name.as_str()).collect();
            return Err(failed!(
                "none of its links has the name of a link of body `{}`, whose links are {} and so on; author the body from \
                 this URDF, or name its nodes as the URDF does",
                body.name,
                some.join(", ")
            ));
        }
        let unmatched: Vec<String> =
            body.links.iter().filter(|link| !is_matched(&link.name)).map(|link| link.name.clone()).collect();
        let carried = unmatched.iter().map(|name| (name.clone(), carriers(body, name, is_matched))).collect();
        let mut needed: Vec<(usize, String)> = Vec::new();
        for taxel in &body.taxels {
            // A link that the URDF does not have moves with the nearest above it that it has.
            let mut at = Some(taxel.link);
            while let Some(link) = at {
                if let Some((index, name)) = matched.iter().find(|(_, name)| *name == body.links[link].name) {
                    for joint in robot.joints_above(*index) {
                        if needed.iter().all(|(known, _)| *known != joint) {
                            needed.push((joint, name.clone()));
                        }
                    }
                    break;
                }
                at = body.links[link].parent;
            }
        }
        let is_alone = |taxel: &Taxel| !is_matched(&body.links[taxel.link].name);
        if let Some(taxel) = body.taxels.iter().find(|taxel| is_alone(taxel)).filter(|_| needed.is_empty()) {
            return Err(failed!(
                "none of its joints moves a link with taxels of body `{}`, and it has no link `{}` of the body; is it the URDF of \
                 this robot?",
                body.name,
                body.links[taxel.link].name
            ));
        }
        let not_in_body = robot.link_names().len() - matched.len();
        let matches = Self { matched, unmatched, carried, needed, not_in_body };
        matches.check_rest(robot, body, up)?;
        Ok(matches)
    }

    fn check_rest(&self, robot: &Kinematics, body: &Body, up: Up) -> Result<()> {
        let Some((name, distance_m, angle_rad)) = self.farthest(robot, body, &up.world_from_root()) else {
            return Ok(());
        };
        let other = if up == Up::Z { Up::Y } else { Up::Z };
        let agrees_with = |world_from_root: &DAffine3| self.farthest(robot, body, world_from_root).is_none();
        let what_to_do = if agrees_with(&other.world_from_root()) {
            format!("with --up {other} they agree")
        } else if agrees_with(&WORLD_FROM_OLD_ROOT) {
            "an older version made the body, with the URDF's x to its left: author it anew, and it faces along x"
                .to_owned()
        } else {
            "author the body from this URDF, or put its links where the URDF has them".to_owned()
        };
        Err(Error::failed(format!(
            "with all joints at 0, link `{name}` is {:.1} mm and {:.1}° from where body `{}` has it, and {} mm and {:.1}° are \
             allowed; {what_to_do}",
            distance_m * 1e3,
            angle_rad.to_degrees(),
            body.name,
            MAX_REST_DISTANCE_M * 1e3,
            MAX_REST_ANGLE_RAD.to_degrees(),
        )))
    }

    /// The first link that does not agree at rest, its distance (m) and angle (rad).
    fn farthest(&self, robot: &Kinematics, body: &Body, world_from_root: &DAffine3) -> Option<(&str, f64, f64)> {
        let rest = robot.rest_poses(world_from_root);
        self.matched.iter().find_map(|(index, name)| {
            let of_body = &body.links[body.link_index(name)?].world_from_link();
            let distance_m = rest[*index].translation.distance(of_body.translation);
            let angle_rad = rotation(&rest[*index]).angle_between(rotation(of_body));
            let agrees = distance_m <= MAX_REST_DISTANCE_M && angle_rad <= MAX_REST_ANGLE_RAD;
            (!agrees).then_some((name.as_str(), distance_m, angle_rad))
        })
    }

    /// Adds the poses of links that the URDF does not have to `poses`, as far as what carries them is there.
    pub(super) fn put_carried(&self, poses: &mut Vec<(String, Pose)>) {
        for (name, above) in &self.carried {
            let pose_of = |name: &str| poses.iter().find(|(posed, _)| posed == name).map(|(_, pose)| pose.transform());
            if pose_of(name).is_some() {
                continue;
            }
            let Some(world_from_link) = above.iter().find_map(|(above, rest)| Some(pose_of(above)? * *rest)) else {
                continue;
            };
            let rotation = rotation(&world_from_link).normalize();
            poses.push((name.clone(), Pose { translation: world_from_link.translation, rotation }));
        }
    }

    /// What is matched and what is not, in a line.
    #[must_use]
    pub fn summary(&self) -> String {
        let all = self.matched.len() + self.unmatched.len();
        let mut text = format!("{} of the body's {all} links are in the URDF", self.matched.len());
        if !self.unmatched.is_empty() {
            text += &format!("; not {}: they keep their places on the links above them", self.unmatched.join(", "));
        }
        if self.not_in_body > 0 {
            let (links, are) = if self.not_in_body == 1 { ("link", "is") } else { ("links", "are") };
            text += &format!("; {} {links} of the URDF {are} not in the body", self.not_in_body);
        }
        text
    }
}

/// The links above the link called `name`, the nearest first, as far as one that `is_matched`, each with its transform to that
/// link at rest.
fn carriers(body: &Body, name: &str, is_matched: impl Fn(&str) -> bool) -> Vec<(String, DAffine3)> {
    let Some(link) = body.link_index(name) else { return Vec::new() };
    let mut carriers = Vec::new();
    let mut at = body.links[link].parent;
    while let Some(above) = at {
        let name = &body.links[above].name;
        carriers.push((name.clone(), body.rest_transform(above, link)));
        at = body.links[above].parent.filter(|_| !is_matched(name));
    }
    carriers
}

fn rotation(pose: &DAffine3) -> DQuat {
    DQuat::from_mat3(&pose.matrix3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Glb;

    const ARM: &str = r#"<robot name="r"><link name="base"/><link name="arm"/><joint name="j" type="revolute"><parent link="base"/>
        <child link="arm"/><origin xyz="0.3 0 0.1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>"#;

    /// The body of [`ARM`] with this root.
    fn body(body_from_root: DAffine3) -> Body {
        let mut glb = Glb::new();
        let base = glb.placed_node("base", None, body_from_root);
        glb.node("arm", Some(base), DVec3::new(0.3, 0.0, 0.1));
        Body::from_bytes("arm.glb", &glb.to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn a_body_with_the_turn_of_an_older_version_is_to_be_authored_anew() {
        let robot = Kinematics::from_urdf("r", ARM).unwrap();
        assert!(LinkMatches::new(&robot, &body(Up::Z.body_from_root()), Up::Z).is_ok());
        let old = DAffine3::from_quat(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2));
        let why = |body: &Body, up| LinkMatches::new(&robot, body, up).unwrap_err().to_string();
        let said = why(&body(old), Up::Z);
        assert!(said.contains("link `base` is 0.0 mm and 90.0°") && said.contains("author it anew"), "{said}");
        // Any other turn is not an older version's.
        let other = why(&body(DAffine3::from_quat(DQuat::from_rotation_x(0.5))), Up::Z);
        assert!(!other.contains("older") && other.contains("author the body from this URDF"), "{other}");
        assert!(why(&body(Up::Z.body_from_root()), Up::Y).contains("with --up z they agree"));
        assert!(why(&body(Up::Y.body_from_root()), Up::Z).contains("with --up y they agree"));
    }
}
