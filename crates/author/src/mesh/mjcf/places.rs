//! Where the geoms and sites of a model are, by name and by what moves with them.

use std::collections::{BTreeMap, HashMap};

use glam::DAffine3;

use super::model::{Geom, GeomShape, Model};
use crate::mesh::triangles::Triangles;

/// A model's parts, found once for all of its sensors.
pub(super) struct Places<'a> {
    pub(super) model: &'a Model,
    /// By name, the body and the place in it of the first geom of that name.
    pub(super) geoms: HashMap<&'a str, (usize, usize)>,
    /// The same of sites.
    pub(super) sites: HashMap<&'a str, (usize, usize)>,
    /// By body, the one at the root of those that move as one with it.
    pub(super) rigid: Vec<usize>,
    /// By that body, the shapes that collide.
    pub(super) shapes: BTreeMap<usize, Vec<Shape<'a>>>,
    /// How many triangles rays were compared with.
    pub(super) ray_tests: usize,
}

/// A shape that collides.
pub(super) struct Shape<'a> {
    pub(super) body: usize,
    pub(super) geom: &'a Geom,
    pub(super) mesh: Option<&'a Triangles>,
    pub(super) world_from_geom: DAffine3,
    pub(super) geom_from_world: DAffine3,
}

impl<'a> Places<'a> {
    pub(super) fn from_model(model: &'a Model) -> Self {
        let mut places = Self {
            model,
            geoms: HashMap::new(),
            sites: HashMap::new(),
            rigid: Vec::new(),
            shapes: BTreeMap::new(),
            ray_tests: 0,
        };
        for (index, body) in model.bodies.iter().enumerate() {
            // A parent is before its children.
            let rigid = match body.parent {
                Some(parent) if !body.has_joint => places.rigid[parent],
                _ => index,
            };
            places.rigid.push(rigid);
            for (at, site) in body.sites.iter().enumerate() {
                places.sites.entry(&site.name).or_insert((index, at));
            }
            for (at, geom) in body.geoms.iter().enumerate() {
                places.geoms.entry(&geom.name).or_insert((index, at));
                if geom.collides {
                    let mesh = if let GeomShape::Mesh(mesh) = &geom.shape { model.meshes.get(mesh) } else { None };
                    let world_from_geom = body.world_from_body * geom.body_from_geom;
                    let geom_from_world = world_from_geom.inverse();
                    let shape = Shape { body: index, geom, mesh, world_from_geom, geom_from_world };
                    places.shapes.entry(rigid).or_default().push(shape);
                }
            }
        }
        places
    }
}
