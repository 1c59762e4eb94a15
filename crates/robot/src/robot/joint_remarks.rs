//! Remarks on odd joint states, each reported once.

use std::collections::BTreeSet;

use super::kinematics::Kinematics;

/// How far beyond its limits a joint may be before its unit is doubted, as a share of its range: robots give way a little.
const BEYOND_LIMITS: f64 = 0.1;

/// Remarks on joint states.
#[derive(Default)]
pub(super) struct JointRemarks {
    has_doubted_units: bool,
    has_told_of_carried: bool,
    /// Joints that the URDF does not have.
    strange: BTreeSet<String>,
    /// Remarks that are not reported yet, a line each.
    pub(super) notices: Vec<String>,
}

impl JointRemarks {
    /// Of a joint that is called `name` at `t_s` s: one that `robot` does not have is left out, as a robot's states may be of more
    /// than its URDF has.
    pub(super) fn strange_joint(&mut self, robot: &Kinematics, name: &str, t_s: f64) {
        if self.strange.contains(name) {
            return;
        }
        self.strange.insert(name.to_owned());
        let near = crate::error::nearest(name, robot.joint_names());
        let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        self.notices.push(format!("at {t_s} s: the URDF has no joint `{name}`, which is left out{hint}"));
    }

    /// That frames carry states at `t_s` s, and that those of the recording `name` are used.
    pub(super) fn carried(&mut self, name: &str, t_s: f64) {
        if !std::mem::replace(&mut self.has_told_of_carried, true) {
            self.notices.push(format!(
                "at {t_s} s: frames carry joint states of their own; states of {name} replace them, as --joint-states names it"
            ));
        }
    }

    /// Of a joint that stands at `t_s` s where only another unit would be: beyond its limits, or more than once around where it
    /// turns with an end.
    pub(super) fn units(&mut self, robot: &Kinematics, position_of: impl Fn(usize) -> Option<f64>, t_s: f64) {
        if self.has_doubted_units {
            return;
        }
        let doubt = |joint: usize| {
            let position = position_of(joint)?;
            if robot.is_limited_turn(joint) && position.abs() > std::f64::consts::TAU {
                return Some((joint, format!("{position} rad, over a whole turn; are these degrees? Give radians")));
            }
            let [least, greatest] = robot.limits(joint)?;
            let beyond = BEYOND_LIMITS * (greatest - least);
            let is_beyond = !(least - beyond..=greatest + beyond).contains(&position);
            let unit = robot.unit(joint);
            is_beyond.then(|| {
                let limits = format!("its limits in the URDF are {least} to {greatest} {unit}");
                (joint, format!("{position} {unit}, and {limits}; are its states in {unit}?"))
            })
        };
        if let Some((joint, what)) = (0..robot.joint_names().len()).find_map(doubt) {
            self.has_doubted_units = true;
            let name = robot.joint_names().nth(joint).unwrap_or_default();
            self.notices.push(format!("at {t_s} s: joint `{name}` is at {what}"));
        }
    }
}
