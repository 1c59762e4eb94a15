//! One touch of a whole body: what it does to the taxels, and what is true of it.

use glam::DVec3;

use super::super::contact;
use super::super::profile::Profile;
use super::cells::{Cells, UNFELT};
use super::chart::is_beside;
use super::footprint::Footprint;
use super::indenter::{END_M, Placed, Pose, Shape, walk};
use super::layer::Layer;
use super::path::{self, BodyPath, Waypoint};
use super::press::{Pressure, Skin};
use super::surface::WholeSurface;
use crate::body::{Body, Modality};

/// An indenter that stays above the place of its path by more than this share of its size does not reach it.
const UNREACHED: f64 = 0.25;

/// What a taxel feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::source::simulated) enum Covers {
    /// The force on its cell: the surface that is nearer to it than to other taxels.
    Cell,
    /// The force on a square of its area.
    Area,
}

/// What presses: one indenter, or two side by side with half of the force each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::source::simulated) enum Tool {
    One(Shape),
    Pair { shape: Shape, apart_m: f64 },
}

/// The skin of a whole body at rest, as simulated touches press it.
pub(in crate::source::simulated) struct BodySkin {
    surface: WholeSurface,
    cells: Cells,
    layer: Layer,
    covers: Covers,
    /// By taxel, if any has three axes.
    tangents: Vec<[DVec3; 2]>,
}

/// A touch of a whole body.
pub(in crate::source::simulated) struct BodyTouch {
    pub(in crate::source::simulated) name: String,
    pub(in crate::source::simulated) tool: Tool,
    /// rad
    pub(in crate::source::simulated) angle: Profile,
    pub(in crate::source::simulated) path: BodyPath,
    pub(in crate::source::simulated) force_newton: Profile,
}

/// What one indenter does, in the body's frame at rest.
pub(in crate::source::simulated) struct Contact {
    pub(in crate::source::simulated) force_newton: f64,
    pub(in crate::source::simulated) depth_m: f64,
    pub(in crate::source::simulated) position: DVec3,
    pub(in crate::source::simulated) normal: DVec3,
    pub(in crate::source::simulated) link: usize,
    pub(in crate::source::simulated) principal_axis: Option<DVec3>,
    /// Along an indenter that has a direction, or from the first of a pair to the second, in the tangent plane.
    pub(in crate::source::simulated) direction: Option<DVec3>,
    /// The place of the path under it, and the way that it faces there.
    pub(in crate::source::simulated) stands_at: DVec3,
    /// The link of that place, if what is in the way keeps the indenter well above it.
    pub(in crate::source::simulated) unreached: Option<usize>,
    pub(in crate::source::simulated) along: DVec3,
    /// Of the even disc with the second moment of its pressure, m.
    pub(in crate::source::simulated) radius_m: f64,
    /// The forces of taxels that feel it, if they are asked for.
    pub(in crate::source::simulated) forces_newton: Vec<(usize, f64)>,
}

impl Tool {
    pub(in crate::source::simulated) fn is_long(&self) -> bool {
        match self {
            Self::One(shape) => shape.is_long(),
            Self::Pair { .. } => true,
        }
    }
}

impl BodySkin {
    /// The skin of `body` under `layer`, and the taxels with these indices and sides of squares of their area, m.
    pub(in crate::source::simulated) fn new(
        body: &Body,
        layer: &contact::Layer,
        taxels: &[(usize, f64)],
        covers: Covers,
    ) -> Self {
        let least_side_m = taxels.iter().map(|(_, side_m)| *side_m).min_by(f64::total_cmp).unwrap_or(0.0);
        let layer = Layer::new(layer, least_side_m);
        let (surface, cells) = (WholeSurface::new(body, layer.piece_m()), Cells::new(body, taxels));
        let has_pulls = taxels.iter().any(|&(index, _)| body.taxels[index].modality == Modality::Force3);
        let tangents = |&(index, _): &(usize, f64)| {
            let taxel = &body.taxels[index];
            let rest = &body.links[taxel.link].body_from_link;
            taxel.tangents_in_link().map(|tangent| rest.transform_vector3(tangent))
        };
        let tangents = if has_pulls { taxels.iter().map(tangents).collect() } else { Vec::new() };
        Self { surface, cells, layer, covers, tangents }
    }

    /// Where a taxel is.
    pub(in crate::source::simulated) fn position(&self, taxel: usize) -> DVec3 {
        self.cells.sensors()[taxel].position
    }

    /// The normal of a taxel and its tangents, if any taxel has three axes.
    pub(in crate::source::simulated) fn axes(&self, taxel: usize) -> (DVec3, [DVec3; 2]) {
        (self.cells.sensors()[taxel].normal, self.tangents[taxel])
    }

    /// The skin at `p`, if there is any within 20 mm.
    pub(in crate::source::simulated) fn waypoint(&self, p: DVec3, outward: Option<DVec3>) -> Option<Waypoint> {
        path::waypoint(&self.surface, p, outward)
    }

    /// Adds what the taxels feel of `pressure` to `forces_newton`.
    fn feel(&self, pressure: &Pressure, forces_newton: &mut [f64]) {
        match self.covers {
            Covers::Cell => {
                for felt in pressure.felt.iter().filter(|felt| felt.piece.taxel != UNFELT) {
                    forces_newton[felt.piece.taxel as usize] += felt.force_newton;
                }
            }
            Covers::Area => {
                let reach_m = self.layer.reach_m();
                let ends = pressure.loads.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), load| {
                    (low.min(load.position), high.max(load.position))
                });
                for (index, (sensor, force)) in self.cells.sensors().iter().zip(forces_newton).enumerate() {
                    let within = reach_m + sensor.side_m;
                    if sensor.position.distance_squared(sensor.position.clamp(ends.0, ends.1)) <= within * within {
                        *force += self.on_square(pressure, index);
                    }
                }
            }
        }
    }

    /// The force on the square of a taxel's area: the pressure at Gauss's three by three nodes.
    fn on_square(&self, pressure: &Pressure, taxel: usize) -> f64 {
        /// √(3/5), and the weights of the outer and the middle node.
        const NODES: [(f64, f64); 3] =
            [(-0.774_596_669_241_483_4, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.774_596_669_241_483_4, 5.0 / 18.0)];
        let sensor = &self.cells.sensors()[taxel];
        let Some(spot) = self.surface.nearest(sensor.position, sensor.normal) else { return 0.0 };
        let mesh = self.surface.facet(spot.facet).mesh;
        let Some(part) = pressure.parts.get(&spot.facet).filter(|_| self.cells.is_on(taxel, mesh)) else {
            return 0.0;
        };
        let skin = self.skin();
        let u = sensor.normal.any_orthonormal_vector() * (sensor.side_m / 2.0);
        let v = sensor.normal.cross(u);
        let loads = || pressure.loads.iter().filter(|load| load.part == *part && is_beside(load.normal, sensor.normal));
        let at = |p: DVec3| -> f64 {
            let pressures = loads().filter(|load| load.spread_m2 > 0.0);
            let pressure_of = |load: &super::press::Load| {
                load.force_newton * skin.share(load, p - load.position, sensor.normal) / load.spread_m2
            };
            pressures.map(pressure_of).sum()
        };
        let nodes = NODES.iter().flat_map(|a| NODES.iter().map(move |b| (a, b)));
        let mean: f64 = nodes.map(|((x, p), (y, q))| p * q * at(sensor.position + u * *x + v * *y)).sum();
        mean * sensor.side_m * sensor.side_m
    }

    fn skin(&self) -> Skin<'_> {
        Skin { surface: &self.surface, cells: &self.cells, layer: &self.layer }
    }
}

impl BodyTouch {
    /// The force at `t_s`, if the touch presses.
    pub(in crate::source::simulated) fn force(&self, t_s: f64) -> Option<f64> {
        self.force_newton.within(t_s).filter(|&force| force > 0.0)
    }

    /// A time up to `until_s` at which the touch presses and its path leaves the skin.
    pub(in crate::source::simulated) fn leaves_skin(&self, skin: &BodySkin, until_s: f64) -> Option<f64> {
        let times = self.path.times_to_check().chain(self.force_newton.times());
        let mut pressed = times.filter(|&t_s| t_s <= until_s && self.force(t_s).is_some());
        pressed.find(|&t_s| !self.path.is_on_skin(&skin.surface, t_s) || self.poses(skin, t_s).is_none())
    }

    /// The poses of its indenters; `None` where there is no skin for one.
    fn poses(&self, skin: &BodySkin, t_s: f64) -> Option<Vec<(Shape, Pose)>> {
        let pose = self.path.pose(&skin.surface, t_s, self.angle.held(t_s))?;
        match self.tool {
            Tool::One(shape) => Some(vec![(shape, pose)]),
            Tool::Pair { shape, apart_m } => {
                let beside = |side: f64| {
                    let (way, left_m) = walk(&skin.surface, &pose.spot, pose.along * side, apart_m / 2.0);
                    // With a part of the way left, it has met the end of the skin.
                    let (spot, ahead) = *way.last().filter(|_| left_m <= END_M)?;
                    let normal = skin.surface.smooth_normal(&spot);
                    // As the way runs there: around a limb, `pose.along` may point back.
                    let along = ahead * side;
                    let along = (along - normal * along.dot(normal)).normalize_or(along);
                    Some((shape, Pose { spot, normal, along }))
                };
                Some(vec![beside(-1.0)?, beside(1.0)?])
            }
        }
    }

    /// Presses at `t_s`, adds what the taxels feel to `forces_newton`, and returns what is true of each indenter, with those forces if
    /// it is to be `by_contact`; `None` where there is no skin.
    pub(in crate::source::simulated) fn press(
        &self,
        skin: &BodySkin,
        t_s: f64,
        (force_newton, by_contact): (f64, bool),
        forces_newton: &mut [f64],
    ) -> Option<Vec<Contact>> {
        let poses = self.poses(skin, t_s)?;
        let each_newton = force_newton / poses.len() as f64;
        let mut contacts = Vec::with_capacity(poses.len());
        for (shape, pose) in poses {
            let placed = Placed::new(&skin.surface, shape, pose);
            let pressure = skin.skin().press(&placed, each_newton);
            let own = if by_contact {
                let mut own = vec![0.0; forces_newton.len()];
                skin.feel(&pressure, &mut own);
                own.into_iter().enumerate().filter(|(_, force)| *force > 0.0).collect()
            } else {
                skin.feel(&pressure, forces_newton);
                Vec::new()
            };
            own.iter().for_each(|&(taxel, force)| forces_newton[taxel] += force);
            let Footprint { spot, normal, link, principal_axis, radius_m } =
                Footprint::new(&skin.surface, &pressure.felt)?;
            let flat = (pose.along - normal * pose.along.dot(normal)).normalize_or(pose.along);
            contacts.push(Contact {
                force_newton: each_newton,
                depth_m: pressure.depth_m,
                position: spot.position,
                normal,
                link,
                principal_axis,
                direction: self.tool.is_long().then_some(flat),
                stands_at: pose.spot.position,
                unreached: (-pressure.depth_m > UNREACHED * shape.size_m())
                    .then(|| skin.surface.facet(pose.spot.facet).link),
                along: flat,
                radius_m,
                forces_newton: own,
            });
        }
        Some(contacts)
    }
}
