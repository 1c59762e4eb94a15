//! Axes: glTF's, which a body has inside, and those of `world`, in which everything outside it is.
//!
//! A glTF body stands upright along +y and faces +z; its left is +x. The world is z up, x forward and y left, as ROS's REP 103
//! has it. So a point (x, y, z) of a body is (z, x, y) in the world. Both transforms only exchange coordinates: they round nothing.

use glam::{DAffine3, DQuat, DVec3};

/// Takes coordinates in a body's axes, which are glTF's, to the world's: (x, y, z) becomes (z, x, y).
pub const WORLD_FROM_BODY: DAffine3 = DAffine3::from_cols(DVec3::Y, DVec3::Z, DVec3::X, DVec3::ZERO);
/// Its rotation.
pub const WORLD_FROM_BODY_ROTATION: DQuat = DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5);
/// The way back: (x, y, z) becomes (y, z, x).
pub const BODY_FROM_WORLD: DAffine3 = DAffine3::from_cols(DVec3::Z, DVec3::X, DVec3::Y, DVec3::ZERO);

words! {"axis that points up",
    /// The axis that points up in the file of a mesh or robot.
    Up {
        /// y: its axes are glTF's.
        Y = "y",
        /// z, as in URDF and most CAD programs.
        Z = "z",
    }
}

impl Up {
    /// Takes a robot's root, in whose file this axis points up, to the world: with z up the two are the same, with y up its
    /// axes are glTF's.
    #[must_use]
    pub fn world_from_root(self) -> DAffine3 {
        match self {
            Self::Y => WORLD_FROM_BODY,
            Self::Z => DAffine3::IDENTITY,
        }
    }

    /// Takes a robot's root, in whose file this axis points up, to the axes of its body.
    #[must_use]
    pub fn body_from_root(self) -> DAffine3 {
        match self {
            Self::Y => DAffine3::IDENTITY,
            Self::Z => BODY_FROM_WORLD,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn up_forward_and_left_of_a_body_are_those_of_the_world() {
        for (in_body, in_world) in [(DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X), (DVec3::X, DVec3::Y)] {
            assert_eq!(WORLD_FROM_BODY.transform_vector3(in_body), in_world);
            assert_eq!(BODY_FROM_WORLD.transform_vector3(in_world), in_body);
        }
        assert_eq!(WORLD_FROM_BODY.matrix3.determinant(), 1.0);
        // Not a bit is lost on the way there and back.
        let p = DVec3::new(0.1, -1e9 / 3.0, 1e-300);
        assert_eq!(WORLD_FROM_BODY.transform_point3(p), DVec3::new(p.z, p.x, p.y));
        assert_eq!(BODY_FROM_WORLD.transform_point3(WORLD_FROM_BODY.transform_point3(p)), p);
    }

    #[test]
    fn a_robots_root_is_the_world_or_a_bodys_axes() {
        for up in [Up::Y, Up::Z] {
            assert_eq!(up.world_from_root(), WORLD_FROM_BODY * up.body_from_root());
        }
        assert_eq!(Up::Z.world_from_root(), DAffine3::IDENTITY);
        assert_eq!(Up::Y.body_from_root(), DAffine3::IDENTITY);
        assert_eq!(DMat3::from_quat(WORLD_FROM_BODY_ROTATION), WORLD_FROM_BODY.matrix3);
        // As a quaternion, which glTF stores in single precision, the turn is exact too.
        let turn = DQuat::from_mat3(&Up::Z.body_from_root().matrix3);
        assert_eq!(turn, DQuat::from_xyzw(0.5, 0.5, 0.5, -0.5));
        assert_eq!(DMat3::from_quat(turn), BODY_FROM_WORLD.matrix3);
    }
}
