//! Reads a URDF: links with their geometry, and joints.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use roxmltree::{Document, Node};

use super::{Geometry, MeshOptions};
use crate::error::{Error, Result, failed};

/// The parts of a URDF that make its shape.
#[derive(Debug)]
pub(super) struct Robot {
    pub(super) links: Vec<RobotLink>,
    pub(super) joints: Vec<RobotJoint>,
}

#[derive(Debug)]
pub(super) struct RobotLink {
    pub(super) name: String,
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

#[derive(Debug)]
pub(super) struct RobotJoint {
    pub(super) parent: String,
    pub(super) child: String,
    /// At rest.
    pub(super) parent_from_child: DAffine3,
    pub(super) line: u32,
}

impl Robot {
    /// Reads the URDF at `path`.
    ///
    /// # Errors
    /// It is no URDF, or a xacro, or names a package that is not given; with the line.
    pub(super) fn load(path: &Path, options: &MeshOptions) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e))?;
        let read = Reader { folder: path.parent().unwrap_or(Path::new("")), options, text: &text };
        read.robot(path).map_err(|e| e.at(path.display()))
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

struct Reader<'a> {
    folder: &'a Path,
    options: &'a MeshOptions,
    text: &'a str,
}

impl Reader<'_> {
    fn robot(&self, path: &Path) -> Result<Robot> {
        let is_xacro = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xacro"))
            || self.text.contains("<xacro:")
            || self.text.contains("\"${");
        if is_xacro {
            let what = "it is a xacro, a program that writes a URDF; run it first: xacro robot.urdf.xacro > robot.urdf";
            return Err(Error::failed(what));
        }
        let document = Document::parse(self.text).map_err(|e| failed!("not valid XML: {e}"))?;
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
        Ok(Robot { links, joints })
    }

    fn line(&self, node: Node<'_, '_>) -> u32 {
        node.document().text_pos_at(node.range().start).row
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
            Geometry::Visual => "visual",
            Geometry::Collision => "collision",
        };
        let shapes = node.children().filter(|child| child.has_tag_name(tag)).map(|child| self.shape(child));
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
                    self.at(own, format!("a <{other}> is no shape of a URDF; it has mesh, box, cylinder and sphere"))
                );
            }
        };
        Ok(Shape { link_from_shape: self.origin(node)?, kind, line: self.line(node) })
    }

    fn joint(&self, node: Node<'_, '_>) -> Result<RobotJoint> {
        let link = |tag: &str| self.child(node, tag).and_then(|child| self.attribute(child, "link").map(str::to_owned));
        Ok(RobotJoint {
            parent: link("parent")?,
            child: link("child")?,
            parent_from_child: self.origin(node)?,
            line: self.line(node),
        })
    }

    /// The `<origin xyz rpy>` below `node`: rolled around x, then pitched around y, then yawed around z, all fixed axes.
    fn origin(&self, node: Node<'_, '_>) -> Result<DAffine3> {
        let Some(origin) = node.children().find(|child| child.has_tag_name("origin")) else {
            return Ok(DAffine3::IDENTITY);
        };
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
            let (package, rest) = rest.split_once('/').unwrap_or((rest, ""));
            let folder = self.options.packages.get(package).ok_or_else(|| {
                self.at(
                    node,
                    format!("`{name}` is in the package `{package}`; say where that is: --package {package}=FOLDER"),
                )
            })?;
            return Ok(folder.join(rest));
        }
        let plain = name.strip_prefix("file://").unwrap_or(name);
        if plain.contains("://") {
            return Err(self.at(node, format!("`{name}` is not a file; write a path, or package://NAME/…")));
        }
        Ok(self.folder.join(plain))
    }
}
