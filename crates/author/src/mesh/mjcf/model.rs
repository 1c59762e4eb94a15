//! The parts of an MJCF that a skin is made of.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use crate::mesh::triangles::Triangles;

/// What a `<tactile>` sensor gives of each vertex: a depth, and two speeds.
const TACTILE_CHANNELS: u32 = 3;

/// Bodies with their geometry, meshes, and the sensors that are skin.
#[derive(Debug, Default)]
pub(super) struct Model {
    /// The world first, a parent before its children.
    pub(super) bodies: Vec<MjBody>,
    pub(super) meshes: BTreeMap<String, Triangles>,
    pub(super) sensors: Vec<MjSensor>,
    /// `<touch>` sensors, which have no surface.
    pub(super) scalar_touches: usize,
    /// Sensors that are no skin, `<touch>` among them; their values lie among those of skins.
    pub(super) other_sensors: usize,
}

#[derive(Debug)]
pub(super) struct MjBody {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    /// At rest.
    pub(super) parent_from_body: DAffine3,
    pub(super) world_from_body: DAffine3,
    /// Whether it moves against its parent.
    pub(super) has_joint: bool,
    pub(super) geoms: Vec<Geom>,
    pub(super) sites: Vec<Site>,
}

#[derive(Debug)]
pub(super) struct Site {
    pub(super) name: String,
    pub(super) body_from_site: DAffine3,
}

#[derive(Debug)]
pub(super) struct Geom {
    pub(super) name: String,
    pub(super) body_from_geom: DAffine3,
    pub(super) shape: GeomShape,
    /// Whether it takes part in contacts.
    pub(super) collides: bool,
}

/// A shape around the origin of its geom; sizes are halves, as in MuJoCo, m.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum GeomShape {
    Box(DVec3),
    /// Also a sphere.
    Ellipsoid(DVec3),
    Cylinder {
        radius_m: f64,
        half_length_m: f64,
    },
    Capsule {
        radius_m: f64,
        half_length_m: f64,
    },
    Mesh(String),
    /// A plane, a height field, or a shape fitted to a mesh.
    Other,
}

#[derive(Debug)]
pub(super) struct MjSensor {
    pub(super) name: String,
    pub(super) line: u32,
    pub(super) kind: SensorKind,
}

#[derive(Debug)]
pub(super) enum SensorKind {
    /// A taxel at each vertex of a mesh.
    Tactile { geom: String, mesh: String },
    /// A taxel for each bin of directions as seen from a site.
    TouchGrid { site: String, grid: TouchGrid },
}

impl SensorKind {
    /// How many values it gives of each taxel.
    pub(super) fn channels(&self) -> u32 {
        match self {
            Self::Tactile { .. } => TACTILE_CHANNELS,
            Self::TouchGrid { grid, .. } => grid.channels,
        }
    }

    /// Whether its taxels have three axes.
    pub(super) fn has_axes(&self) -> bool {
        matches!(self, Self::TouchGrid { grid, .. } if grid.has_axes())
    }
}

/// The bins of a `touch_grid` sensor, which looks along −z: azimuth is positive towards x, elevation towards y.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TouchGrid {
    /// Horizontally and vertically.
    pub(super) size: [u32; 2],
    /// Half of the field of view, in degrees.
    pub(super) fov_deg: [f64; 2],
    /// How much narrower the bins in the middle are, 0 to 1.
    pub(super) gamma: f64,
    /// What it gives of each bin, 1 to 6: the force along the site's z, x and y, then the torque about them.
    pub(super) channels: u32,
}

impl TouchGrid {
    pub(super) fn taxels(&self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// Whether it gives a force with three axes of each bin, and nothing else.
    pub(super) fn has_axes(&self) -> bool {
        self.channels == 3
    }

    /// The azimuths and elevations between which the bin `index` is, rad.
    pub(super) fn bin(&self, index: u32) -> [[f64; 2]; 2] {
        let along = |axis: usize, at: u32| {
            let edge = |at: u32| {
                let x = 2.0 * f64::from(at) / f64::from(self.size[axis]) - 1.0;
                (self.gamma * x.powi(5) + (1.0 - self.gamma) * x) * self.fov_deg[axis].to_radians()
            };
            [edge(at), edge(at + 1)]
        };
        [along(0, index % self.size[0]), along(1, index / self.size[0])]
    }

    /// The direction with an azimuth and an elevation, in the site's frame.
    pub(super) fn direction(azimuth: f64, elevation: f64) -> DVec3 {
        DVec3::new(
            libm::cos(elevation) * libm::sin(azimuth),
            libm::sin(elevation),
            -libm::cos(elevation) * libm::cos(azimuth),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_cover_the_field_of_view_row_by_row() {
        let grid = TouchGrid { size: [4, 2], fov_deg: [40.0, 20.0], gamma: 0.0, channels: 1 };
        let near = |a: f64, deg: f64| (a - deg.to_radians()).abs() < 1e-12;
        let [azimuth, elevation] = grid.bin(0);
        assert!(
            near(azimuth[0], -40.0) && near(azimuth[1], -20.0) && near(elevation[0], -20.0) && near(elevation[1], 0.0)
        );
        let [azimuth, elevation] = grid.bin(7);
        assert!(near(azimuth[1], 40.0) && near(elevation[1], 20.0));
        let foveal = TouchGrid { gamma: 1.0, ..grid };
        assert!(near(foveal.bin(0)[0][1], -40.0 / 32.0), "the middle is finer");
        assert!(TouchGrid::direction(0.0, 0.0).distance(-DVec3::Z) < 1e-12);
        assert!(TouchGrid::direction(1.0, 0.0).x > 0.0 && TouchGrid::direction(0.0, 1.0).y > 0.0);
    }
}
