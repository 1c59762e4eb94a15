//! A robot whose MJCF has its skin: `<tactile>` sensors, which feel at the vertices of a mesh, and `touch_grid` sensors, which
//! feel in bins of directions from a site.
//!
//! A taxel of a `touch_grid` has no place of its own: it is put where the middle of its bin leaves the shapes that touch with
//! the site's body.

mod builtin;
mod document;
mod mesh_asset;
mod model;
mod places;
mod pose;
mod ray;
mod read;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use self::model::{Geom, GeomShape, MjSensor, Model, SensorKind, TouchGrid};
use self::places::{Places, Shape};
use self::ray::{Exit, last_exit};
use super::options::{Geometry, MeshOptions};
use super::shapes;
use super::triangles::{Room, Triangles};
use crate::body::{Glb, MAX_TAXEL_ID, Modality, Original, Taxel};
use crate::error::{Error, Result, failed};
use crate::limits::{MAX_RAY_TESTS, MAX_TAXELS};
use crate::recipe::Recipe;
use crate::report::PlaceReport;
use crate::skin::{Authored, author};

/// A ray that meets a surface flatter than this tells no area of it.
const MIN_COSINE: f64 = 0.2;
/// The cosine of the largest angle between a grid's axis and a normal at which its forces count as along and across that, 30°.
const ALONG_AXIS: f64 = 0.866_025_403_784_438_6;

/// The body of the MJCF at `path` with the taxels of its `<tactile>` and `touch_grid` sensors, grouped into fields as without
/// rules. An id is the index of the taxel's first value in the data of these sensors, which follow each other.
///
/// # Errors
/// The file cannot be read or is invalid, has no such sensor, or one that names what is not there; with the line.
pub fn author_mjcf_skin(path: &Path, options: &MeshOptions) -> Result<Authored> {
    let model = read::read(path)?;
    build(&model, path, options).map_err(|e| e.at(path.display()))
}

/// Taxels by body, and the notices about them.
#[derive(Default)]
struct Skin {
    by_body: BTreeMap<usize, Vec<Taxel>>,
    /// Bodies whose colliding shapes have taxels.
    shaped: BTreeSet<usize>,
    places: Vec<PlaceReport>,
    notes: Vec<String>,
}

fn build(model: &Model, path: &Path, options: &MeshOptions) -> Result<Authored> {
    if model.sensors.is_empty() {
        let what = "it has neither <tactile> nor touch_grid sensors, and taxels are not placed on an MJCF; do that on the \
                    robot's URDF or mesh: somatic author robot.urdf --taxels 500 -o body.glb";
        return Err(Error::failed(what));
    }
    let mut skin = Skin::default();
    let mut places = Places::from_model(model);
    let (mut first_id, mut taxels) = (0_u64, 0_u64);
    for sensor in &model.sensors {
        let at = |e: Error| e.at(format!("line {}", sensor.line));
        let count = place(&mut places, sensor, first_id as u32, &mut skin).map_err(at)?;
        taxels += u64::from(count);
        first_id += u64::from(count) * u64::from(sensor.kind.channels());
        if taxels > MAX_TAXELS as u64 {
            return Err(at(failed!("its sensors have over {MAX_TAXELS} taxels; give fewer")));
        }
        if first_id > u64::from(MAX_TAXEL_ID) + 1 {
            return Err(failed!("its taxels reach {first_id}, over the {MAX_TAXEL_ID} that a file can hold"));
        }
    }
    skin.notes.extend(about_data(model));
    let mut glb = Glb::new();
    let material = glb.material("robot", [0.6, 0.62, 0.66], 0.8);
    let (up, note) = options.robot_up();
    skin.notes.extend(note);
    let gltf_from_world = up.body_from_root();
    let mut nodes: BTreeMap<usize, usize> = BTreeMap::new();
    let mut room = Room::default();
    for (index, body) in model.bodies.iter().enumerate() {
        // Of the world only what has skin is of use.
        if index == 0 && !skin.by_body.contains_key(&0) {
            continue;
        }
        let parent = body.parent.and_then(|parent| nodes.get(&parent).copied());
        let way = if parent.is_some() { body.parent_from_body } else { gltf_from_world * body.world_from_body };
        let node = glb.placed_node(&body.name, parent, way);
        nodes.insert(index, node);
        let mesh = looks(model, &body.geoms, options.geometry, skin.shaped.contains(&index))?;
        room.take(&mesh)?;
        if !mesh.triangles.is_empty() {
            glb.mesh(node, &body.name, &mesh.into_mesh_data(), Some(material), None);
        }
        if let Some(taxels) = skin.by_body.get(&index) {
            glb.taxels(&format!("{} taxels", body.name), Some(node), taxels, None);
        }
    }
    let file = Original::from_bytes(&path.display().to_string(), &glb.to_bytes()?, None)?;
    let made = author(file, &Recipe::none(), |_| {})?;
    // A vertex has the mean of the normals around it until then.
    skin.notes.extend(made.notes.into_iter().filter(|note| !note.starts_with("normals recomputed")));
    Ok(Authored { places: skin.places, notes: skin.notes, ..made })
}

/// What is to be said of the sensors' data, `mjData.sensordata`.
fn about_data(model: &Model) -> Vec<String> {
    let mut notes = Vec::new();
    if model.scalar_touches > 0 {
        notes.push(format!("{} <touch> sensors have no surface, and are left out", model.scalar_touches));
    }
    let has_axes = model.sensors.iter().any(|sensor| sensor.kind.has_axes());
    let others = model.other_sensors + if has_axes { model.sensors.len() - 1 } else { 0 };
    if others > 0 {
        let of = if has_axes { "one sensor with three axes" } else { "sensors that are skin" };
        let values = match has_axes {
            false => "values = \"sensordata[7:88]\"",
            true => {
                "values = [\"sensordata[7:88]\", \"sensordata[88:169]\", \"sensordata[169:250]\"], axes = \"n,u,-v\" and ids"
            }
        };
        notes.push(format!(
            "--map mujoco is for a `sensordata` of {of}, and this one has {others} more: name the skin's part in a map of your \
             own, as {values}"
        ));
    }
    notes
}

/// Places the taxels of `sensor`, whose ids go on from `first_id`; gives how many ids are its own.
fn place(places: &mut Places<'_>, sensor: &MjSensor, first_id: u32, skin: &mut Skin) -> Result<u32> {
    let model = places.model;
    let (count, placed) = match &sensor.kind {
        SensorKind::Tactile { geom, mesh } => on_vertices(places, sensor, geom, mesh)?,
        SensorKind::TouchGrid { site, grid } => {
            let (placed, aside) = in_bins(places, sensor, site, grid)?;
            if grid.has_axes() && aside > 0 {
                skin.notes.push(format!(
                    "sensor `{}`: its forces are along its site's axes; {aside} of its taxels look over 30° away from its z, where \
                     what presses and what pulls are mixed",
                    sensor.name
                ));
            }
            placed
        }
    };
    let mut links: BTreeMap<String, usize> = BTreeMap::new();
    let mut ids = Vec::new();
    for (index, body, mut taxel) in placed {
        taxel.id = first_id.saturating_add(index);
        ids.push(taxel.id);
        *links.entry(model.bodies[body].name.clone()).or_insert(0) += 1;
        skin.by_body.entry(body).or_default().push(taxel);
        if matches!(sensor.kind, SensorKind::TouchGrid { .. }) {
            skin.shaped.insert(body);
        }
    }
    let missing = count as usize - ids.len();
    if missing > 0 {
        let why = match sensor.kind {
            SensorKind::Tactile { .. } => "are in no triangle",
            SensorKind::TouchGrid { .. } => "look past every shape",
        };
        skin.notes.push(format!(
            "sensor `{}`: {missing} of its {count} taxels {why}, and are left out; ids stay as in its data",
            sensor.name
        ));
    }
    let name = sensor.name.clone();
    if let SensorKind::TouchGrid { grid, .. } = &sensor.kind
        && !matches!(grid.channels, 1 | 3)
    {
        skin.notes.push(format!(
            "sensor `{}`: of its {} channels the first is read; with nchannel=3 its taxels have three axes",
            sensor.name, grid.channels
        ));
    }
    skin.places.push(PlaceReport {
        name,
        ids,
        links,
        least_spacing_m: None,
        mean_spacing_m: None,
        ..PlaceReport::default()
    });
    Ok(count)
}

/// How many taxels a sensor has, and those with a place: index, body, taxel in that body's frame.
type PlacedTaxels = (u32, Vec<(u32, usize, Taxel)>);

/// A taxel at each vertex of `mesh` on `geom`: it feels along the vertex's normal and has a third of the triangles around it.
fn on_vertices(places: &Places<'_>, sensor: &MjSensor, geom: &str, mesh: &str) -> Result<PlacedTaxels> {
    let unknown =
        |what: &str, name: &str| failed!("sensor `{}` names the {what} `{name}`, which is not there", sensor.name);
    let model = places.model;
    let &(body, index) = places.geoms.get(geom).ok_or_else(|| unknown("geom", geom))?;
    let own = &model.bodies[body].geoms[index];
    let vertices = model.meshes.get(mesh).ok_or_else(|| unknown("mesh", mesh))?;
    if own.shape != GeomShape::Mesh(mesh.to_owned()) {
        return Err(failed!(
            "sensor `{}` feels at the vertices of `{mesh}`, and its geom `{geom}` has another shape: MuJoCo then centres the \
             mesh by its inertia; add a geom of this mesh to the body (contype=\"0\", mass=\"0\") and name that one",
            sensor.name
        ));
    }
    if vertices.positions.is_empty() {
        return Err(failed!(
            "mesh `{mesh}` has no vertices that are known here; save it as an .stl or .obj file, or use a builtin plate or wedge"
        ));
    }
    let mut normals = vec![DVec3::ZERO; vertices.positions.len()];
    let mut areas = vec![0.0; vertices.positions.len()];
    for triangle in &vertices.triangles {
        let [a, b, c] = triangle.map(|v| vertices.positions[v as usize]);
        let area = (b - a).cross(c - a) / 2.0;
        for &v in triangle {
            normals[v as usize] += area;
            areas[v as usize] += area.length() / 3.0;
        }
    }
    let mut placed = Vec::with_capacity(normals.len());
    for (index, ((&position, normal), area)) in vertices.positions.iter().zip(normals).zip(areas).enumerate() {
        let Some(normal) = normal.try_normalize() else { continue };
        let taxel = Taxel {
            id: 0,
            link: 0,
            position_in_link: own.body_from_geom.transform_point3(position),
            normal_in_link: own.body_from_geom.transform_vector3(normal).normalize(),
            area,
            modality: Modality::Pressure,
            tangent_in_link: None,
        };
        placed.push((index as u32, body, taxel));
    }
    if placed.is_empty() {
        return Err(failed!(
            "mesh `{mesh}` has vertices without triangles, so that none has a normal; give it its faces"
        ));
    }
    Ok((vertices.positions.len() as u32, placed))
}

/// A taxel for each bin of `grid`, where its middle leaves the shapes that move with the site's body; and how many of them look over
/// 30° away from the site's −z.
fn in_bins(places: &mut Places<'_>, sensor: &MjSensor, site: &str, grid: &TouchGrid) -> Result<(PlacedTaxels, usize)> {
    let model = places.model;
    let &(body, index) = places
        .sites
        .get(site)
        .ok_or_else(|| failed!("sensor `{}` names the site `{site}`, which is not there", sensor.name))?;
    let own = &model.bodies[body].sites[index];
    let world_from_site = model.bodies[body].world_from_body * own.body_from_site;
    let shapes = places.shapes.get(&places.rigid[body]).map_or(&[][..], Vec::as_slice);
    let tests: usize = shapes.iter().map(|shape| shape.mesh.map_or(1, |mesh| mesh.triangles.len())).sum();
    places.ray_tests = places.ray_tests.saturating_add(tests.saturating_mul(grid.taxels() as usize));
    if places.ray_tests > MAX_RAY_TESTS {
        return Err(failed!(
            "the bins of `{}` are compared with {tests} triangles each, over {MAX_RAY_TESTS} with those before; give it fewer \
             bins, or a coarser mesh to collide with",
            sensor.name
        ));
    }
    let [site_x, site_z] = [DVec3::X, DVec3::Z].map(|axis| world_from_site.transform_vector3(axis));
    let (mut placed, mut aside) = (Vec::new(), 0);
    for index in 0..grid.taxels() {
        let [[a0, a1], [e0, e1]] = grid.bin(index);
        let direction = TouchGrid::direction((a0 + a1) / 2.0, (e0 + e1) / 2.0);
        let along = world_from_site.transform_vector3(direction);
        let from = world_from_site.translation;
        let exits = shapes.iter().filter_map(|Shape { body, geom, mesh, world_from_geom, geom_from_world }| {
            let (origin, along) = (geom_from_world.transform_point3(from), geom_from_world.transform_vector3(along));
            let exit = last_exit(&geom.shape, *mesh, origin, along)?;
            Some((*body, Exit { normal: world_from_geom.transform_vector3(exit.normal), ..exit }))
        });
        let Some((on, exit)) = exits.max_by(|(_, a), (_, b)| a.distance_m.total_cmp(&b.distance_m)) else { continue };
        let body_from_world = model.bodies[on].world_from_body.inverse();
        let solid_angle = (a1 - a0) * (libm::sin(e1) - libm::sin(e0));
        let cosine = along.dot(exit.normal);
        let area = if cosine < MIN_COSINE { 0.0 } else { solid_angle * exit.distance_m.powi(2) / cosine };
        let normal = exit.normal.normalize();
        aside += usize::from(normal.dot(-site_z) < ALONG_AXIS);
        // Where the surface is turned against the site, its x is turned with it.
        let tangent = DQuat::from_rotation_arc(-site_z, normal) * site_x;
        let tangent_in_link = grid.has_axes().then(|| body_from_world.transform_vector3(tangent).normalize());
        let taxel = Taxel {
            id: 0,
            link: 0,
            position_in_link: body_from_world.transform_point3(from + exit.distance_m * along),
            normal_in_link: body_from_world.transform_vector3(normal).normalize(),
            area,
            modality: if grid.has_axes() { Modality::Force3 } else { Modality::Pressure },
            tangent_in_link,
        };
        placed.push((index, on, taxel));
    }
    if placed.is_empty() {
        return Err(failed!("sensor `{}`: no shape of its body is visible from its site along −z", sensor.name));
    }
    Ok(((grid.taxels(), placed), aside))
}

/// What of `geoms` is shown, in their body's frame; all if its colliding shapes have taxels.
fn looks(model: &Model, geoms: &[Geom], geometry: Geometry, is_shaped: bool) -> Result<Triangles> {
    let has_visuals = geoms.iter().any(|geom| !geom.collides && geom.shape != GeomShape::Other);
    let mut whole = Triangles::default();
    for geom in geoms {
        let is_shown = match geometry {
            Geometry::None => false,
            Geometry::Collision => geom.collides,
            Geometry::Visual => is_shaped || !has_visuals || !geom.collides,
        };
        if !is_shown {
            continue;
        }
        let mut mesh = match &geom.shape {
            GeomShape::Box(half) => shapes::cuboid(2.0 * *half),
            GeomShape::Ellipsoid(radii) => {
                let mut ball = shapes::sphere(1.0);
                ball.transform(&DAffine3::from_scale(*radii));
                ball
            }
            GeomShape::Cylinder { radius_m, half_length_m } => shapes::cylinder(*radius_m, 2.0 * half_length_m),
            GeomShape::Capsule { radius_m, half_length_m } => shapes::capsule(*radius_m, 2.0 * half_length_m),
            GeomShape::Mesh(mesh) => {
                let known = model.meshes.get(mesh);
                known.ok_or_else(|| failed!("geom `{}` is of mesh `{mesh}`, which is not there", geom.name))?.clone()
            }
            GeomShape::Other => continue,
        };
        whole.check_room_for(&mesh)?;
        mesh.transform(&geom.body_from_geom);
        whole.extend(&mesh);
    }
    Ok(whole)
}
