//! Reads a URDF: links with their geometry, and joints.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use roxmltree::{Document, Node};

use super::options::{Geometry, MeshOptions};
use super::ros_packages;
use super::xml::{self, Lines};
use crate::error::{Error, Result, failed};
use crate::limits::{MAX_CELLS, MAX_TAXELS};

/// The parts of a URDF that make its shape.
#[derive(Debug)]
pub struct Robot {
    /// Its links, in the file's order.
    pub links: Vec<RobotLink>,
    /// Its joints, in the file's order.
    pub joints: Vec<RobotJoint>,
    /// Its tactile sensors, by the extension `<sensor><tactile>`.
    pub(super) sensors: Vec<RobotSensor>,
}

/// A link.
#[derive(Debug)]
pub struct RobotLink {
    /// Its name.
    pub name: String,
    pub(super) shapes: Vec<Shape>,
}

/// Geometry of a link, and where in the file it is.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) link_from_shape: DAffine3,
    pub(super) kind: ShapeKind,
    pub(super) line: u32,
}

#[derive(Debug)]
pub(super) enum ShapeKind {
    Mesh { path: PathBuf, scale: DVec3 },
    Box(DVec3),
    Cylinder { radius_m: f64, length_m: f64 },
    Sphere { radius_m: f64 },
}

/// A joint between two links.
#[derive(Debug)]
pub struct RobotJoint {
    /// Its name.
    pub name: String,
    /// The link that carries it.
    pub parent: String,
    /// The link that it moves.
    pub child: String,
    /// The pose of the child in the parent at rest, m.
    pub parent_from_child: DAffine3,
    /// How it moves.
    pub motion: JointMotion,
    /// The least and the greatest position, rad or m, where the file has a range.
    pub limits: Option<[f64; 2]>,
    /// The joint that it follows, if any.
    pub mimic: Option<JointMimic>,
    /// Its line in the file.
    pub line: u32,
}

/// How a joint moves its child, along or around a unit axis in the child's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMotion {
    /// Not at all.
    Fixed,
    /// Around an axis.
    Revolute {
        /// The axis.
        axis: DVec3,
        /// Without limits.
        is_continuous: bool,
    },
    /// Along an axis.
    Prismatic {
        /// The axis.
        axis: DVec3,
    },
    /// `floating` and `planar`: more than one number says where the child is.
    Free,
}

/// `<mimic>`: a joint's position is `multiplier` · that of `joint` + `offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMimic {
    /// The joint that drives it.
    pub joint: String,
    /// Its position per position of `joint`.
    pub multiplier: f64,
    /// Its position where that of `joint` is 0, rad or m.
    pub offset: f64,
}

/// A tactile sensor: taxels on a link.
#[derive(Debug)]
pub(super) struct RobotSensor {
    pub(super) name: String,
    /// Whose data vector its taxels are in.
    pub(super) channel: String,
    pub(super) link: String,
    pub(super) taxels: Vec<SensorTaxel>,
    pub(super) line: u32,
}

/// A taxel: z is its normal.
#[derive(Debug)]
pub(super) struct SensorTaxel {
    /// Its place in the data vector.
    pub(super) index: u32,
    pub(super) link_from_taxel: DAffine3,
    /// 0 where it is not known.
    pub(super) area_m2: f64,
}

/// Most taxels of an array.
const MAX_ARRAY_TAXELS: u64 = MAX_CELLS as u64;

impl Robot {
    /// Reads the URDF at `path`.
    ///
    /// # Errors
    /// It is not a URDF, is a xacro, or names a package that is not given; with the line.
    pub fn load(path: &Path, options: &MeshOptions) -> Result<Self> {
        let text = xml::text_of(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        read(&text, path, folder, options).map_err(|e| e.at(path.display()))
    }

    /// Reads links and joints alone of the URDF at `path`.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn load_joints(path: &Path) -> Result<Self> {
        Self::load(path, &MeshOptions { geometry: Geometry::None, ..MeshOptions::default() })
    }

    /// The same of a URDF in `text`.
    pub fn joints_of(text: &str) -> Result<Self> {
        let options = MeshOptions { geometry: Geometry::None, ..MeshOptions::default() };
        read(text, Path::new(""), Path::new(""), &options)
    }

    /// The meshes that it names.
    pub(super) fn mesh_files(&self) -> Vec<PathBuf> {
        let shapes = self.links.iter().flat_map(|link| &link.shapes);
        shapes
            .filter_map(|shape| match &shape.kind {
                ShapeKind::Mesh { path, .. } => Some(path.clone()),
                _ => None,
            })
            .collect()
    }
}

/// `text` without its comments, in which what xacro has read may still stand.
fn without_comments(text: &str) -> String {
    let mut parts = text.split("<!--");
    let before = parts.next().unwrap_or_default().to_owned();
    parts.fold(before, |kept, part| kept + part.split_once("-->").map_or("", |(_, after)| after))
}

/// The robot in `text`, whose meshes are beside `folder`.
fn read(text: &str, path: &Path, folder: &Path, options: &MeshOptions) -> Result<Robot> {
    let is_xacro = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xacro"))
        || ["<xacro:", "\"${"].iter().any(|sign| without_comments(text).contains(sign));
    if is_xacro {
        let what = "it is a xacro, a program that writes a URDF; run it first: xacro robot.urdf.xacro > robot.urdf";
        return Err(Error::failed(what));
    }
    let document = xml::parse(text)?;
    Reader { folder, options, lines: Lines::from_document(&document) }.robot(&document)
}

struct Reader<'a> {
    folder: &'a Path,
    options: &'a MeshOptions,
    lines: Lines,
}

impl Reader<'_> {
    fn robot(&self, document: &Document<'_>) -> Result<Robot> {
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            return Err(failed!("not a URDF: its root is <{}>, not <robot>", root.tag_name().name()));
        }
        let named = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
        let links = named("link").map(|node| self.link(node)).collect::<Result<Vec<_>>>()?;
        let joints = named("joint").map(|node| self.joint(node)).collect::<Result<Vec<_>>>()?;
        if links.is_empty() {
            return Err(Error::failed("it has no <link>"));
        }
        let is_tactile = |node: &Node<'_, '_>| node.children().any(|child| child.has_tag_name("tactile"));
        let (mut sensors, mut taxels) = (Vec::new(), 0);
        for node in named("sensor").filter(is_tactile) {
            let sensor = self.sensor(node)?;
            taxels += sensor.taxels.len();
            if taxels > MAX_TAXELS {
                return Err(self.at(node, format!("its sensors have over {MAX_TAXELS} taxels; give fewer")));
            }
            sensors.push(sensor);
        }
        Ok(Robot { links, joints, sensors })
    }

    fn line(&self, node: Node<'_, '_>) -> u32 {
        self.lines.line(node)
    }

    fn at(&self, node: Node<'_, '_>, what: impl Into<String>) -> Error {
        Error::failed(what).at(format!("line {}", self.line(node)))
    }

    fn attribute<'n>(&self, node: Node<'n, '_>, name: &str) -> Result<&'n str> {
        let missing = || self.at(node, format!("<{}> has no `{name}`", node.tag_name().name()));
        node.attribute(name).ok_or_else(missing)
    }

    fn child<'n, 'd>(&self, node: Node<'n, 'd>, name: &str) -> Result<Node<'n, 'd>> {
        let missing = || self.at(node, format!("<{}> has no <{name}>", node.tag_name().name()));
        node.children().find(|child| child.has_tag_name(name)).ok_or_else(missing)
    }

    fn link(&self, node: Node<'_, '_>) -> Result<RobotLink> {
        let tag = match self.options.geometry {
            Geometry::Visual => Some("visual"),
            Geometry::Collision => Some("collision"),
            Geometry::None => None,
        };
        let is_wanted = |child: &Node<'_, '_>| tag.is_some_and(|tag| child.has_tag_name(tag));
        let shapes = node.children().filter(is_wanted).map(|child| self.shape(child));
        Ok(RobotLink { name: self.attribute(node, "name")?.to_owned(), shapes: shapes.collect::<Result<_>>()? })
    }

    fn shape(&self, node: Node<'_, '_>) -> Result<Shape> {
        let geometry = self.child(node, "geometry")?;
        let own = geometry.children().find(Node::is_element).ok_or_else(|| self.at(geometry, "<geometry> is empty"))?;
        let kind = match own.tag_name().name() {
            "mesh" => ShapeKind::Mesh {
                path: self.resolve(own, self.attribute(own, "filename")?)?,
                scale: match own.attribute("scale") {
                    Some(text) => self.vector(own, "scale", text)?,
                    None => DVec3::ONE,
                },
            },
            "box" => ShapeKind::Box(self.vector(own, "size", self.attribute(own, "size")?)?),
            "cylinder" => {
                ShapeKind::Cylinder { radius_m: self.number(own, "radius")?, length_m: self.number(own, "length")? }
            }
            "sphere" => ShapeKind::Sphere { radius_m: self.number(own, "radius")? },
            other => {
                return Err(
                    self.at(own, format!("a <{other}> is not a shape of a URDF; use mesh, box, cylinder or sphere"))
                );
            }
        };
        Ok(Shape { link_from_shape: self.origin(node)?, kind, line: self.line(node) })
    }

    fn joint(&self, node: Node<'_, '_>) -> Result<RobotJoint> {
        let link = |tag: &str| self.child(node, tag).and_then(|child| self.attribute(child, "link").map(str::to_owned));
        Ok(RobotJoint {
            name: self.attribute(node, "name")?.to_owned(),
            parent: link("parent")?,
            child: link("child")?,
            parent_from_child: self.origin(node)?,
            motion: self.motion(node)?,
            limits: node.children().find(|child| child.has_tag_name("limit")).and_then(limits),
            mimic: node
                .children()
                .find(|child| child.has_tag_name("mimic"))
                .map(|node| self.mimic(node))
                .transpose()?,
            line: self.line(node),
        })
    }

    fn motion(&self, node: Node<'_, '_>) -> Result<JointMotion> {
        let axis = || {
            let own = node.children().find(|child| child.has_tag_name("axis")).map(|axis| {
                let text = self.attribute(axis, "xyz")?;
                let unit = self.vector(axis, "xyz", text)?.try_normalize();
                unit.ok_or_else(|| self.at(axis, format!("the axis `{text}` has no direction")))
            });
            own.unwrap_or(Ok(DVec3::X))
        };
        // Authoring needs no type; kinematics then does not know how the child moves.
        match node.attribute("type").unwrap_or("floating") {
            "fixed" => Ok(JointMotion::Fixed),
            "revolute" => Ok(JointMotion::Revolute { axis: axis()?, is_continuous: false }),
            "continuous" => Ok(JointMotion::Revolute { axis: axis()?, is_continuous: true }),
            "prismatic" => Ok(JointMotion::Prismatic { axis: axis()? }),
            "floating" | "planar" => Ok(JointMotion::Free),
            other => Err(self.at(
                node,
                format!(
                    "a joint of type `{other}`; a URDF has fixed, revolute, continuous, prismatic, floating and planar"
                ),
            )),
        }
    }

    fn mimic(&self, node: Node<'_, '_>) -> Result<JointMimic> {
        let number = |name: &str, usual: f64| match node.attribute(name) {
            None => Ok(usual),
            Some(text) => {
                let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
                number.ok_or_else(|| self.at(node, format!("`{name}` is `{text}`; write a number")))
            }
        };
        Ok(JointMimic {
            joint: self.attribute(node, "joint")?.to_owned(),
            multiplier: number("multiplier", 1.0)?,
            offset: number("offset", 0.0)?,
        })
    }

    /// A `<sensor>` with a `<tactile>`, which has an `<array>` or `<taxel>`s.
    fn sensor(&self, node: Node<'_, '_>) -> Result<RobotSensor> {
        let name = self.attribute(node, "name")?.to_owned();
        let link = self.attribute(self.child(node, "parent")?, "link")?.to_owned();
        let tactile = self.child(node, "tactile")?;
        let link_from_sensor = self.origin(node)?;
        let listed: Vec<Node<'_, '_>> = tactile.children().filter(|child| child.has_tag_name("taxel")).collect();
        let array = tactile.children().find(|child| child.has_tag_name("array"));
        let taxels = match (array, &listed[..]) {
            (Some(array), []) => self.array(array, link_from_sensor)?,
            (None, []) => return Err(self.at(tactile, "<tactile> has neither <taxel> nor <array>")),
            (Some(array), _) => return Err(self.at(array, "a sensor has <taxel>s or an <array>, not both; remove one")),
            (None, listed) => listed.iter().map(|&taxel| self.taxel(taxel, link_from_sensor)).collect::<Result<_>>()?,
        };
        let channel = tactile.attribute("channel").unwrap_or(&name).to_owned();
        Ok(RobotSensor { name, channel, link, taxels, line: self.line(node) })
    }

    fn taxel(&self, node: Node<'_, '_>, link_from_sensor: DAffine3) -> Result<SensorTaxel> {
        let index = self.whole(node, "idx", self.attribute(node, "idx")?)?;
        let geometry = node.children().find(|child| child.has_tag_name("geometry"));
        let own = geometry.and_then(|geometry| geometry.children().find(Node::is_element));
        let area_m2 = match own {
            Some(own) if own.has_tag_name("box") => {
                let size = self.vector(own, "size", self.attribute(own, "size")?)?;
                (size.x * size.y).abs()
            }
            Some(own) if own.has_tag_name("cylinder") => std::f64::consts::PI * self.number(own, "radius")?.powi(2),
            _ => 0.0,
        };
        Ok(SensorTaxel { index, link_from_taxel: link_from_sensor * self.pose(node)?, area_m2 })
    }

    /// Rows of taxels along x, columns along y, the first one at the origin but for `offset`.
    fn array(&self, node: Node<'_, '_>, link_from_sensor: DAffine3) -> Result<Vec<SensorTaxel>> {
        let count = |name: &str| self.attribute(node, name).and_then(|text| self.whole(node, name, text));
        let (rows, columns) = (count("rows")?, count("cols")?);
        let all = u64::from(rows) * u64::from(columns);
        if all == 0 || all > MAX_ARRAY_TAXELS {
            return Err(self.at(
                node,
                format!("an array of {rows} rows and {columns} columns; give it 1 to {MAX_ARRAY_TAXELS} taxels"),
            ));
        }
        let size = self.pair(node, "size", self.attribute(node, "size")?)?;
        let or = |name: &str, or: [f64; 2]| node.attribute(name).map_or(Ok(or), |text| self.pair(node, name, text));
        let (spacing, offset) = (or("spacing", size)?, or("offset", [0.0; 2])?);
        let by_row = match node.attribute("order").unwrap_or("row-major") {
            "row-major" => true,
            "col-major" | "column-major" => false,
            other => return Err(self.at(node, format!("`order` is `{other}`; write row-major or col-major"))),
        };
        let taxel = |index: u32| {
            let (row, column) = if by_row { (index / columns, index % columns) } else { (index % rows, index / rows) };
            let place = |count: u32, axis: usize| f64::from(count) * spacing[axis] - offset[axis];
            let at = DVec3::new(place(row, 0), place(column, 1), 0.0);
            let link_from_taxel = link_from_sensor * DAffine3::from_translation(at);
            SensorTaxel { index, link_from_taxel, area_m2: (size[0] * size[1]).abs() }
        };
        Ok((0..rows * columns).map(taxel).collect())
    }

    fn whole(&self, node: Node<'_, '_>, name: &str, text: &str) -> Result<u32> {
        text.trim().parse().map_err(|_| self.at(node, format!("`{name}` is `{text}`; write a whole number")))
    }

    fn pair(&self, node: Node<'_, '_>, name: &str, text: &str) -> Result<[f64; 2]> {
        let three = self.vector(node, name, &format!("{text} 0"));
        three.map(|v| [v.x, v.y]).map_err(|_| self.at(node, format!("`{name}` is `{text}`; write two numbers")))
    }

    /// The `<origin xyz rpy>` below `node`: rolled around x, then pitched around y, then yawed around z, all fixed axes.
    fn origin(&self, node: Node<'_, '_>) -> Result<DAffine3> {
        let origin = node.children().find(|child| child.has_tag_name("origin"));
        origin.map_or(Ok(DAffine3::IDENTITY), |origin| self.pose(origin))
    }

    /// The attributes `xyz` and `rpy` of `origin`.
    fn pose(&self, origin: Node<'_, '_>) -> Result<DAffine3> {
        let vector =
            |name: &str| origin.attribute(name).map_or(Ok(DVec3::ZERO), |text| self.vector(origin, name, text));
        let (xyz, rpy) = (vector("xyz")?, vector("rpy")?);
        Ok(DAffine3::from_rotation_translation(DQuat::from_euler(EulerRot::ZYX, rpy.z, rpy.y, rpy.x), xyz))
    }

    fn vector(&self, node: Node<'_, '_>, name: &str, text: &str) -> Result<DVec3> {
        let numbers: Vec<f64> =
            text.split_whitespace().filter_map(|word| word.parse().ok()).filter(|x: &f64| x.is_finite()).collect();
        match numbers[..] {
            [x, y, z] if text.split_whitespace().count() == 3 => Ok(DVec3::new(x, y, z)),
            _ => Err(self.at(node, format!("`{name}` is `{text}`; write three numbers"))),
        }
    }

    fn number(&self, node: Node<'_, '_>, name: &str) -> Result<f64> {
        let text = self.attribute(node, name)?;
        let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
        number.ok_or_else(|| self.at(node, format!("`{name}` is `{text}`; write a number over 0")))
    }

    /// The file that `name` means.
    fn resolve(&self, node: Node<'_, '_>, name: &str) -> Result<PathBuf> {
        if let Some(rest) = name.strip_prefix("package://") {
            return ros_packages::resolve(rest, &self.options.packages, &self.options.package_roots)
                .map_err(|e| self.at(node, e.to_string()));
        }
        let plain = name.strip_prefix("file://").unwrap_or(name);
        if plain.contains("://") {
            return Err(self.at(node, format!("`{name}` is not a file; write a path, or package://NAME/…")));
        }
        Ok(self.folder.join(plain))
    }
}

/// The range of a `<limit>`: what is not there is 0, and no range is none.
fn limits(node: Node<'_, '_>) -> Option<[f64; 2]> {
    let number = |name: &str| node.attribute(name).map_or(Some(0.0), |text| text.trim().parse::<f64>().ok());
    let range = [number("lower")?, number("upper")?];
    (range[0] < range[1]).then_some(range)
}
