//! Where a node is in the one around it.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use roxmltree::Node;

use super::file::File;
use crate::error::Result;

impl<'a> File<'a> {
    /// The product of the transforms of `node`, in the order of the file.
    pub(super) fn transform(&self, node: Node<'a, 'a>) -> Result<DAffine3> {
        let mut parent_from_node = DAffine3::IDENTITY;
        for child in node.children() {
            let own = match child.tag_name().name() {
                "matrix" => self.matrix(child)?,
                "translate" => DAffine3::from_translation(DVec3::from_array(self.exactly(child)?)),
                "scale" => DAffine3::from_scale(DVec3::from_array(self.exactly(child)?)),
                "rotate" => {
                    let [x, y, z, degrees] = self.exactly(child)?;
                    match DVec3::new(x, y, z).try_normalize() {
                        Some(axis) => DAffine3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians())),
                        // Some programs write what does not turn so.
                        None if degrees == 0.0 => DAffine3::IDENTITY,
                        None => return Err(self.at(child, "a <rotate> around an axis without direction")),
                    }
                }
                "skew" => {
                    let [degrees, ax, ay, az, bx, by, bz] = self.exactly(child)?;
                    let skew = skew(degrees, DVec3::new(ax, ay, az), DVec3::new(bx, by, bz));
                    skew.ok_or_else(|| self.at(child, "a <skew> that no shape survives"))?
                }
                "lookat" => {
                    let [ex, ey, ez, ix, iy, iz, ux, uy, uz] = self.exactly(child)?;
                    let look = look_at(DVec3::new(ex, ey, ez), DVec3::new(ix, iy, iz), DVec3::new(ux, uy, uz));
                    look.ok_or_else(|| self.at(child, "a <lookat> without a direction"))?
                }
                _ => continue,
            };
            parent_from_node *= own;
        }
        Ok(parent_from_node)
    }

    /// The 16 numbers in `node`, row by row.
    pub(super) fn matrix(&self, node: Node<'a, 'a>) -> Result<DAffine3> {
        let [a, b, c, x, d, e, f, y, g, h, i, z, rest @ ..] = self.exactly::<16>(node)?;
        if rest != [0.0, 0.0, 0.0, 1.0] {
            return Err(self.at(node, "the last row of a matrix is 0 0 0 1"));
        }
        let columns = DMat3::from_cols(DVec3::new(a, d, g), DVec3::new(b, e, h), DVec3::new(c, f, i));
        Ok(DAffine3::from_mat3_translation(columns, DVec3::new(x, y, z)))
    }
}

/// Shifts points along `along` so that `turned` turns by an angle towards it, as RenderMan's skew does.
fn skew(degrees: f64, turned: DVec3, along: DVec3) -> Option<DAffine3> {
    let (a, b) = (turned.try_normalize()?, along.try_normalize()?);
    let cosine = a.dot(b);
    let sine2 = 1.0 - cosine * cosine;
    let tangent = libm::tan(degrees.to_radians());
    let shift = tangent / (sine2.sqrt() - cosine * tangent);
    let across = (a - cosine * b) / sine2;
    let axis = |unit: DVec3| unit + shift * across.dot(unit) * b;
    let whole = DMat3::from_cols(axis(DVec3::X), axis(DVec3::Y), axis(DVec3::Z));
    (sine2 > 1e-12 && shift.is_finite()).then(|| DAffine3::from_mat3(whole))
}

/// At `eye`, with −z towards `interest` and y upwards.
fn look_at(eye: DVec3, interest: DVec3, up: DVec3) -> Option<DAffine3> {
    let back = (eye - interest).try_normalize()?;
    let right = up.cross(back).try_normalize()?;
    Some(DAffine3::from_mat3_translation(DMat3::from_cols(right, back.cross(right), back), eye))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skew_turns_one_axis_towards_another() {
        let skewed = skew(45.0, DVec3::Y, 3.0 * DVec3::X).unwrap();
        assert!(skewed.transform_vector3(DVec3::Y).distance(DVec3::new(1.0, 1.0, 0.0)) < 1e-12);
        assert!(skewed.transform_vector3(DVec3::X).distance(DVec3::X) < 1e-12);
        let oblique = DVec3::new(1.0, 1.0, 0.0).normalize();
        let turned = skew(30.0, DVec3::Y, oblique).unwrap().transform_vector3(DVec3::Y);
        assert!((turned.normalize().dot(DVec3::Y) - libm::cos(30_f64.to_radians())).abs() < 1e-12);
        assert!(skew(30.0, DVec3::Y, DVec3::Y).is_none());
    }

    #[test]
    fn who_looks_at_something_has_it_in_front() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let look = look_at(eye, eye + 5.0 * DVec3::X, DVec3::Z).unwrap();
        assert!(look.transform_point3(-2.0 * DVec3::Z).distance(eye + 2.0 * DVec3::X) < 1e-12);
        assert!(look.transform_vector3(DVec3::Y).distance(DVec3::Z) < 1e-12);
        assert!((look.matrix3.determinant() - 1.0).abs() < 1e-12);
        assert!(look_at(eye, eye, DVec3::Z).is_none() && look_at(eye, eye + DVec3::Z, DVec3::Z).is_none());
    }
}
