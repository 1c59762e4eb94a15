//! Reads an MJCF: bodies with their geometry, and the sensors that are skin.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use roxmltree::{Document, Node};

use super::document::{Defaults, at, attribute, included, numbers, parse};
use super::mesh_asset;
use super::model::{Geom, GeomShape, MjBody, MjSensor, Model, SensorKind, Site, TouchGrid};
use super::pose::{Angles, between};
use crate::error::{Error, Result, failed};
use crate::limits::MAX_CELLS;
use crate::mesh::triangles::Room;
use crate::mesh::xml::Lines;

/// The plugin whose sensors are skin.
const TOUCH_GRID: &str = "mujoco.sensor.touch_grid";

/// The model in the file at `path`.
///
/// # Errors
/// It is not an MJCF, or has parts that only MuJoCo can put together; with the line.
pub(super) fn read(path: &Path) -> Result<Model> {
    let text = included(path)?;
    Reader::read(&text, path.parent().unwrap_or(Path::new(""))).map_err(|e| e.at(path.display()))
}

struct Reader<'a> {
    defaults: Defaults,
    angles: Angles,
    lines: Lines,
    /// Of plugins, by name.
    instances: HashMap<&'a str, Node<'a, 'a>>,
    room: Room,
    model: Model,
}

impl<'a> Reader<'a> {
    fn read(text: &str, folder: &Path) -> Result<Model> {
        let document = parse(text)?;
        Reader::model(&document, folder)
    }

    fn model(document: &'a Document<'a>, folder: &Path) -> Result<Model> {
        let root = document.root_element();
        if root.tag_name().name() != "mujoco" {
            return Err(failed!("not an MJCF: its root is <{}>, not <mujoco>", root.tag_name().name()));
        }
        let sections = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
        let compiler = |name: &str| sections("compiler").filter_map(|node| node.attribute(name)).next_back();
        let angles = Angles {
            in_degrees: compiler("angle") != Some("radian"),
            eulerseq: compiler("eulerseq").unwrap_or("xyz").to_owned(),
        };
        let mut instances = HashMap::new();
        for node in root.descendants().filter(|node| node.has_tag_name("instance")) {
            node.attribute("name").map(|name| instances.entry(name).or_insert(node));
        }
        let (defaults, lines) = (Defaults::read(root)?, Lines::from_document(document));
        let mut reader = Self { defaults, angles, lines, instances, room: Room::default(), model: Model::default() };
        let mesh_folder: PathBuf = folder.join(compiler("meshdir").or(compiler("assetdir")).unwrap_or(""));
        let strips = compiler("strippath") == Some("true");
        for node in sections("asset").flat_map(|asset| asset.children()).filter(|node| node.has_tag_name("mesh")) {
            let (name, mesh) =
                mesh_asset::read(node, &reader.defaults, &mesh_folder, strips).map_err(|e| at(node, e))?;
            reader.room.take(&mesh).map_err(|e| at(node, e))?;
            reader.model.meshes.insert(name, mesh);
        }
        reader.model.bodies.push(MjBody {
            name: "world".to_owned(),
            parent: None,
            parent_from_body: DAffine3::IDENTITY,
            world_from_body: DAffine3::IDENTITY,
            has_joint: false,
            geoms: Vec::new(),
            sites: Vec::new(),
        });
        for world in sections("worldbody") {
            reader.bodies(world)?;
        }
        for sensors in sections("sensor") {
            for node in sensors.children().filter(Node::is_element) {
                reader.sensor(node)?;
            }
        }
        Ok(reader.model)
    }

    /// The content of `world`, the body 0, in the order of the file. Deep bodies do not grow the stack.
    fn bodies(&mut self, world: Node<'_, '_>) -> Result<()> {
        let mut open = vec![(world.children(), 0, DAffine3::IDENTITY)];
        while let Some((children, body, body_from_node)) = open.last_mut() {
            let (body, body_from_node) = (*body, *body_from_node);
            let Some(child) = children.next() else {
                open.pop();
                continue;
            };
            match child.tag_name().name() {
                "body" => open.push((child.children(), self.body(child, body, body_from_node)?, DAffine3::IDENTITY)),
                "frame" => {
                    let frame = self.defaults.pose(child, &self.angles)?;
                    open.push((child.children(), body, body_from_node * frame));
                }
                "geom" => {
                    let geom = self.geom(child, body_from_node)?;
                    self.model.bodies[body].geoms.push(geom);
                }
                "site" => {
                    let body_from_site = body_from_node * self.placed(child)?.0;
                    let name = child.attribute("name").unwrap_or_default().to_owned();
                    self.model.bodies[body].sites.push(Site { name, body_from_site });
                }
                "joint" | "freejoint" => self.model.bodies[body].has_joint = true,
                tag @ ("replicate" | "attach") => {
                    let what = failed!(
                        "<{tag}> is put together by MuJoCo; write the model out first: \
                         mujoco.MjSpec.from_file(\"robot.xml\").to_xml()"
                    );
                    return Err(at(child, what));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the body `node`, and gives its number.
    fn body(&mut self, node: Node<'_, '_>, parent: usize, parent_from_node: DAffine3) -> Result<usize> {
        let parent_from_body = parent_from_node * self.defaults.pose(node, &self.angles)?;
        let number = self.model.bodies.len();
        self.model.bodies.push(MjBody {
            name: node.attribute("name").map_or_else(|| format!("body_{number}"), str::to_owned),
            parent: Some(parent),
            parent_from_body,
            world_from_body: self.model.bodies[parent].world_from_body * parent_from_body,
            has_joint: false,
            geoms: Vec::new(),
            sites: Vec::new(),
        });
        Ok(number)
    }

    /// The pose of a geom or site in what is around it, and half its length where it is between two ends.
    fn placed(&self, node: Node<'_, '_>) -> Result<(DAffine3, Option<f64>)> {
        let Some(text) = self.defaults.get(node, "fromto") else {
            return Ok((self.defaults.pose(node, &self.angles)?, None));
        };
        let ends = numbers(node, "fromto", text)?;
        let ends = (ends.len() == 6).then(|| between(DVec3::from_slice(&ends), DVec3::from_slice(&ends[3..])));
        let (pose, half) =
            ends.flatten().ok_or_else(|| at(node, failed!("`fromto` is `{text}`; write two places apart")))?;
        Ok((pose, Some(half)))
    }

    fn geom(&self, node: Node<'_, '_>, body_from_node: DAffine3) -> Result<Geom> {
        let get = |name: &str| self.defaults.get(node, name);
        let (pose, between_ends) = self.placed(node)?;
        let size = get("size").map_or(Ok(Vec::new()), |text| numbers(node, "size", text))?;
        let kind = get("type").unwrap_or("sphere");
        let short = || at(node, failed!("a {kind} has more numbers in `size`"));
        let number = |index: usize| size.get(index).copied().filter(|x| *x > 0.0).ok_or_else(short);
        let half_length = || between_ends.map_or_else(|| number(1), Ok);
        let three = || match between_ends {
            Some(half) => Ok(DVec3::new(number(0)?, number(0)?, half)),
            None => Ok::<_, Error>(DVec3::new(number(0)?, number(1)?, number(2)?)),
        };
        let shape = match (kind, get("mesh")) {
            ("mesh" | "sdf", Some(mesh)) => GeomShape::Mesh(mesh.to_owned()),
            // A simple shape that MuJoCo fits to a mesh.
            (_, Some(_)) => GeomShape::Other,
            ("sphere", _) => GeomShape::Ellipsoid(DVec3::splat(number(0)?)),
            ("ellipsoid", _) => GeomShape::Ellipsoid(three()?),
            ("box", _) => GeomShape::Box(three()?),
            ("cylinder", _) => GeomShape::Cylinder { radius_m: number(0)?, half_length_m: half_length()? },
            ("capsule", _) => GeomShape::Capsule { radius_m: number(0)?, half_length_m: half_length()? },
            _ => GeomShape::Other,
        };
        let collides = ["contype", "conaffinity"].iter().any(|name| get(name).is_none_or(|text| text.trim() != "0"));
        let name = node.attribute("name").unwrap_or_default().to_owned();
        Ok(Geom { name, body_from_geom: body_from_node * pose, shape, collides })
    }

    fn sensor(&mut self, node: Node<'_, '_>) -> Result<()> {
        let number = self.model.sensors.len() + 1;
        let name = node.attribute("name").map_or_else(|| format!("skin_{number}"), str::to_owned);
        let kind = match node.tag_name().name() {
            "tactile" => {
                let text = |key: &str| attribute(node, key).map(str::to_owned);
                SensorKind::Tactile { geom: text("geom")?, mesh: text("mesh")? }
            }
            "touch" => {
                self.model.scalar_touches += 1;
                self.model.other_sensors += 1;
                return Ok(());
            }
            "plugin" => match self.touch_grid(node)? {
                Some(grid) => SensorKind::TouchGrid { site: attribute(node, "objname")?.to_owned(), grid },
                None => {
                    self.model.other_sensors += 1;
                    return Ok(());
                }
            },
            _ => {
                self.model.other_sensors += 1;
                return Ok(());
            }
        };
        self.model.sensors.push(MjSensor { name, line: self.lines.line(node), kind });
        Ok(())
    }

    /// The grid of the sensor plugin `node`; `None` if it is another plugin.
    fn touch_grid(&self, node: Node<'_, '_>) -> Result<Option<TouchGrid>> {
        // A value in the sensor itself, or in the instance that it names.
        let instance = node.attribute("instance").and_then(|wanted| self.instances.get(wanted).copied());
        let plugin = node.attribute("plugin").or_else(|| instance?.parent()?.attribute("plugin"));
        if plugin != Some(TOUCH_GRID) {
            return Ok(None);
        }
        let configs = instance.unwrap_or(node);
        let config = |key: &str| {
            let found =
                configs.children().find(|node| node.has_tag_name("config") && node.attribute("key") == Some(key));
            found.and_then(|node| node.attribute("value"))
        };
        let pair = |key: &str| {
            let text = config(key).ok_or_else(|| at(node, failed!("the touch grid has no <config key=\"{key}\">")))?;
            match numbers(node, key, text)?[..] {
                [a, b] if a > 0.0 && b > 0.0 => Ok([a, b]),
                _ => Err(at(node, failed!("`{key}` is `{text}`; write two numbers over 0"))),
            }
        };
        let sides = pair("size")?;
        if sides.iter().any(|side| side.fract() != 0.0) || sides[0] * sides[1] > MAX_CELLS as f64 {
            let [columns, rows] = sides;
            let what =
                failed!("a touch grid of {columns} × {rows} taxels; give it whole numbers, and at most {MAX_CELLS}");
            return Err(at(node, what));
        }
        let size = sides.map(|side| side as u32);
        let fov_deg = pair("fov")?;
        if fov_deg[0] > 180.0 || fov_deg[1] > 90.0 {
            return Err(at(
                node,
                failed!("a field of view of {} and {} degrees; at most 180 and 90", fov_deg[0], fov_deg[1]),
            ));
        }
        let gamma = config("gamma").map_or(Ok(Vec::new()), |text| numbers(node, "gamma", text))?;
        let gamma = gamma.first().copied().unwrap_or(0.0).clamp(0.0, 1.0);
        // As in MuJoCo, 0 counts as 1.
        let channels = match config("nchannel").map(|text| (text, numbers(node, "nchannel", text))) {
            None => 1,
            Some((_, Ok(given))) if matches!(given[..], [c] if (0.0..=6.0).contains(&c) && c.fract() == 0.0) => {
                (given[0] as u32).max(1)
            }
            Some((text, _)) => {
                return Err(at(node, failed!("`nchannel` is `{text}`; write a whole number from 1 to 6")));
            }
        };
        Ok(Some(TouchGrid { size, fov_deg, gamma, channels }))
    }
}
