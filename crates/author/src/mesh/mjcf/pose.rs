//! Places and orientations as MJCF writes them.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::error::{Error, Result, failed};

/// Attributes that each give an orientation.
pub(super) const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// How angles are written.
#[derive(Clone, Debug)]
pub(super) struct Angles {
    pub(super) in_degrees: bool,
    /// Three of x, y, z, X, Y and Z: axes that turn with the frame, and those that stay.
    pub(super) eulerseq: String,
}

impl Default for Angles {
    fn default() -> Self {
        Self { in_degrees: true, eulerseq: "xyz".to_owned() }
    }
}

impl Angles {
    fn radians(&self, angle: f64) -> f64 {
        if self.in_degrees { angle.to_radians() } else { angle }
    }

    /// The orientation that the attribute `name` with `numbers` gives.
    pub(super) fn orientation(&self, name: &str, numbers: &[f64]) -> Result<DQuat> {
        let wrong = || failed!("`{name}` has {} numbers; give as many as MuJoCo expects", numbers.len());
        let axis = |x: f64, y: f64, z: f64| {
            let unit = DVec3::new(x, y, z).try_normalize();
            unit.ok_or_else(|| failed!("the axis in `{name}` has no length"))
        };
        match (name, numbers) {
            ("quat", &[w, x, y, z]) => {
                let quat = DQuat::from_xyzw(x, y, z, w);
                if quat.length() < 1e-12 { Err(Error::failed("`quat` has no length")) } else { Ok(quat.normalize()) }
            }
            ("axisangle", &[x, y, z, angle]) => Ok(DQuat::from_axis_angle(axis(x, y, z)?, self.radians(angle))),
            ("xyaxes", &[a, b, c, d, e, f]) => {
                let x = axis(a, b, c)?;
                let y = DVec3::new(d, e, f);
                let y = y - x * x.dot(y);
                let y = y.try_normalize().ok_or_else(|| Error::failed("the axes in `xyaxes` are parallel"))?;
                Ok(DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))))
            }
            ("zaxis", &[x, y, z]) => Ok(towards(axis(x, y, z)?)),
            ("euler", &[a, b, c]) => {
                let mut quat = DQuat::IDENTITY;
                for (letter, angle) in self.eulerseq.chars().zip([a, b, c]) {
                    let axis = match letter.to_ascii_lowercase() {
                        'x' => DVec3::X,
                        'y' => DVec3::Y,
                        _ => DVec3::Z,
                    };
                    let turn = DQuat::from_axis_angle(axis, self.radians(angle));
                    quat = if letter.is_ascii_lowercase() { quat * turn } else { turn * quat };
                }
                Ok(quat)
            }
            _ => Err(wrong()),
        }
    }
}

/// The least turn that takes z to the unit vector `direction`.
pub(super) fn towards(direction: DVec3) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, direction)
}

/// Halfway between two ends, z from one to the other; also half their distance.
pub(super) fn between(from: DVec3, to: DVec3) -> Option<(DAffine3, f64)> {
    // MuJoCo's z points from the second end to the first.
    let direction = (from - to).try_normalize()?;
    let place = DAffine3::from_rotation_translation(towards(direction), (from + to) / 2.0);
    Some((place, from.distance(to) / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orientation_is_the_same_however_it_is_written() {
        let angles = Angles::default();
        let orientation = |name: &str, numbers: &[f64]| angles.orientation(name, numbers).unwrap();
        let turned = orientation("euler", &[0.0, 0.0, 90.0]);
        let half = 0.5_f64.sqrt();
        for other in [
            orientation("quat", &[half, 0.0, 0.0, half]),
            orientation("axisangle", &[0.0, 0.0, 2.0, 90.0]),
            orientation("xyaxes", &[0.0, 1.0, 0.0, -1.0, 0.0, 0.0]),
            Angles { in_degrees: false, eulerseq: "XYZ".into() }
                .orientation("euler", &[0.0, 0.0, std::f64::consts::FRAC_PI_2])
                .unwrap(),
        ] {
            assert!((other * DVec3::X).distance(turned * DVec3::X) < 1e-12);
        }
        assert!((orientation("zaxis", &[0.0, 3.0, 0.0]) * DVec3::Z).distance(DVec3::Y) < 1e-12);
        assert!(angles.orientation("quat", &[1.0, 0.0]).is_err() && angles.orientation("zaxis", &[0.0; 3]).is_err());
        // Axes that turn along: about x, then about the new y, which is z.
        let turned = orientation("euler", &[90.0, 90.0, 0.0]);
        assert!((turned * DVec3::X).distance(-DVec3::Z).min((turned * DVec3::X).distance(DVec3::Y)) < 1e-12);
    }
}
