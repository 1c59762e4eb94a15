//! Reads COLLADA 1.4 and 1.5: the meshes of its scene, each as often as it is placed, where its nodes put it.

mod file;
mod geometry;
mod numbers;
mod transform;

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DVec3};
use roxmltree::Node;

use self::file::File;
use super::options::check_unit;
use super::triangles::Triangles;
use super::xml;
use crate::body::Up;
use crate::error::{Result, failed};
use crate::limits::{MAX_NODES, MAX_XML_DEPTH};

/// The mesh in metres, in the axes of the file, and which of these points up.
pub(super) fn read(bytes: &[u8]) -> Result<(Triangles, Up)> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| failed!("not a valid COLLADA mesh: byte {} is not UTF-8; save it as UTF-8", e.valid_up_to()))?;
    let document = xml::parse(text)?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(failed!("not a COLLADA mesh: its root is <{}>", root.tag_name().name()));
    }
    let file = File::from_document(&document);
    let mut mesh = file.scene(root)?;
    let asset = root.children().find(|node| node.has_tag_name("asset"));
    let (unit_m, up) = asset.map_or(Ok((1.0, Up::Y)), |asset| file.unit_and_up(asset))?;
    mesh.transform(&DAffine3::from_scale(DVec3::splat(unit_m)));
    Ok((mesh, up))
}

/// A node that is still to be placed.
struct Placed<'a> {
    node: Node<'a, 'a>,
    scene_from_parent: DAffine3,
    depth: usize,
}

impl<'a> File<'a> {
    fn unit_and_up(&self, asset: Node<'a, 'a>) -> Result<(f64, Up)> {
        let child = |tag: &'static str| asset.children().find(|node| node.has_tag_name(tag));
        let unit_m = match child("unit").and_then(|unit| Some((unit, unit.attribute("meter")?))) {
            Some((unit, text)) => {
                let metres = text.trim().parse().map_err(|_| self.at(unit, format!("`meter` is `{text}`")))?;
                check_unit(metres).map_err(|e| self.at(unit, e.to_string()))?
            }
            None => 1.0,
        };
        match child("up_axis").and_then(|up| up.text()).map(str::trim) {
            Some("Z_UP") => Ok((unit_m, Up::Z)),
            _ => Ok((unit_m, Up::Y)),
        }
    }

    /// The scene that is shown, in the file's unit.
    fn scene(&self, root: Node<'a, 'a>) -> Result<Triangles> {
        let shown = root.children().find(|node| node.has_tag_name("scene"));
        let shown = shown.and_then(|scene| scene.children().find(|node| node.has_tag_name("instance_visual_scene")));
        let scene = match shown {
            Some(instance) => self.named(instance, "url", "visual_scene")?,
            None => {
                let scenes: Vec<_> = root.descendants().filter(|node| node.has_tag_name("visual_scene")).collect();
                match scenes[..] {
                    [only] => only,
                    _ => return Err(self.at(root, "it has no <scene> that says what is shown; export it again")),
                }
            }
        };
        let mut known: HashMap<Node<'a, 'a>, Rc<Triangles>> = HashMap::new();
        let mut whole = Triangles::default();
        // The last one is placed first, which keeps the order of the file.
        let mut waiting: Vec<Placed<'a>> = self.below(scene, DAffine3::IDENTITY, 0);
        let mut count = 0_usize;
        while let Some(Placed { node, scene_from_parent, depth }) = waiting.pop() {
            count += 1;
            if count > MAX_NODES {
                return Err(self.at(node, format!("its nodes place over {MAX_NODES} others; export fewer instances")));
            }
            if depth > MAX_XML_DEPTH {
                let what = format!("nodes are placed within each other over {MAX_XML_DEPTH} deep; break the ring");
                return Err(self.at(node, what));
            }
            match node.tag_name().name() {
                "node" => {
                    let scene_from_node = scene_from_parent * self.transform(node)?;
                    waiting.extend(self.below(node, scene_from_node, depth + 1));
                }
                "instance_node" => {
                    let node = self.named(node, "url", "node")?;
                    waiting.push(Placed { node, scene_from_parent, depth: depth + 1 });
                }
                "instance_geometry" => {
                    let geometry = self.named(node, "url", "geometry")?;
                    self.place(node, geometry, &scene_from_parent, &mut known, &mut whole)?;
                }
                _ => {
                    let controller = self.named(node, "url", "controller")?;
                    let (geometry, scene_from_geometry) = self.rest_of(controller, scene_from_parent)?;
                    self.place(node, geometry, &scene_from_geometry, &mut known, &mut whole)?;
                }
            }
        }
        Ok(whole)
    }

    /// What `node` holds, the last first.
    fn below(&self, node: Node<'a, 'a>, scene_from_parent: DAffine3, depth: usize) -> Vec<Placed<'a>> {
        const KINDS: [&str; 4] = ["node", "instance_node", "instance_geometry", "instance_controller"];
        let held = node.children().rev().filter(|child| KINDS.contains(&child.tag_name().name()));
        held.map(|node| Placed { node, scene_from_parent, depth }).collect()
    }

    /// Adds `geometry`, which `instance` places, to `whole`. What is placed again is read once.
    fn place(
        &self,
        instance: Node<'a, 'a>,
        geometry: Node<'a, 'a>,
        scene_from_geometry: &DAffine3,
        known: &mut HashMap<Node<'a, 'a>, Rc<Triangles>>,
        whole: &mut Triangles,
    ) -> Result<()> {
        let mesh = match known.get(&geometry) {
            Some(mesh) => mesh.clone(),
            None => {
                let mesh = Rc::new(self.geometry(geometry)?);
                known.insert(geometry, mesh.clone());
                mesh
            }
        };
        whole.check_room_for(&mesh).map_err(|e| self.at(instance, e.to_string()))?;
        whole.extend_placed(&mesh, scene_from_geometry);
        Ok(())
    }

    /// The mesh of a controller as it is before anything moves it.
    fn rest_of(&self, controller: Node<'a, 'a>, scene_from_node: DAffine3) -> Result<(Node<'a, 'a>, DAffine3)> {
        let own = controller.children().find(|child| ["skin", "morph"].contains(&child.tag_name().name()));
        let own = own.ok_or_else(|| self.at(controller, "<controller> has neither <skin> nor <morph>"))?;
        let geometry = self.named(own, "source", "geometry")?;
        if own.has_tag_name("morph") {
            return Ok((geometry, scene_from_node));
        }
        // The joints place a skin, not the node: where they were when it was bound, that is this matrix.
        let bound = own.children().find(|child| child.has_tag_name("bind_shape_matrix"));
        Ok((geometry, bound.map_or(Ok(DAffine3::IDENTITY), |matrix| self.matrix(matrix))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file whose scene has `nodes` and whose library of nodes has `library`; geometry `g` is a triangle.
    fn file(library: &str, nodes: &str) -> String {
        format!(
            r##"<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X"/><param name="Y"/><param name="Z"/></accessor>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>
</skin></controller></library_controllers>
<library_nodes>{library}</library_nodes>
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
        )
    }

    const ONE: &str = "<instance_geometry url=\"#g\"/>";

    /// The first corners of the triangles, in the file's unit.
    fn places(library: &str, nodes: &str) -> Vec<DVec3> {
        let (mesh, up) = read(file(library, nodes).as_bytes()).unwrap();
        assert_eq!(up, Up::Z);
        mesh.triangles.iter().map(|triangle| mesh.positions[triangle[0] as usize] * 100.0).collect()
    }

    fn are(got: &[DVec3], wanted: &[[f64; 3]]) {
        assert_eq!(got.len(), wanted.len(), "{got:?}");
        for (got, wanted) in got.iter().zip(wanted) {
            assert!(got.distance(DVec3::from_array(*wanted)) < 1e-12, "{got} is not {wanted:?}");
        }
    }

    #[test]
    fn nested_nodes_are_where_their_transforms_in_order_put_them() {
        // Small shifts count, too.
        let inner = format!("<node><translate>0.001 0 0</translate>{ONE}</node>");
        are(&places("", &inner), &[[0.001, 0.0, 0.0]]);
        let turned = format!("<node><translate>1 0 0</translate><rotate>0 0 2 90</rotate>{inner}</node>");
        are(&places("", &turned), &[[1.0, 0.001, 0.0]]);
        let other =
            format!("<node><rotate>0 0 1 90</rotate><translate>1 0 0</translate><scale>2 3 4</scale>{inner}</node>");
        are(&places("", &other), &[[0.0, 1.002, 0.0]]);
        let matrix = format!("<node><matrix>0 -1 0 7 1 0 0 8 0 0 1 9 0 0 0 1</matrix>{other}</node>");
        are(&places("", &matrix), &[[7.0 - 1.002, 8.0, 9.0]]);
    }

    #[test]
    fn each_instance_is_there_in_the_order_of_the_file() {
        let twice = format!(
            "<node>{ONE}</node><node><translate>0 0 1</translate>{ONE}{ONE}<instance_node url=\"#n\"/></node>\
             <node><translate>3 0 0</translate><instance_controller url=\"#c\"/></node>"
        );
        let library = format!("<node id=\"n\"><translate>0 2 0</translate>{ONE}</node>");
        let wanted = [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 2.0, 1.0], [5.0, 0.0, 0.0]];
        are(&places(&library, &twice), &wanted);
    }

    #[test]
    fn instances_of_instances_end() {
        let why =
            |library: &str| read(file(library, "<node><instance_node url=\"#n0\"/></node>").as_bytes()).unwrap_err();
        let ring = "<node id=\"n0\"><node id=\"n1\"><instance_node url=\"#n0\"/></node></node>";
        assert!(why(ring).to_string().contains("within each other over"), "{}", why(ring));
        let tenfold: String = (0..12)
            .map(|level| {
                let ten = format!("<instance_node url=\"#n{}\"/>", level + 1).repeat(10);
                format!("<node id=\"n{level}\">{ten}</node>")
            })
            .collect();
        let error = why(&format!("{tenfold}<node id=\"n12\"/>")).to_string();
        assert!(error.contains("place over 1000000 others"), "{error}");
    }

    #[test]
    fn what_leads_nowhere_is_reported_with_its_line() {
        for (part, other, wanted) in [
            ("url=\"#g\"", "url=\"#h\"", "line 10: not a valid COLLADA mesh: there is no <geometry> called `h`"),
            ("url=\"#g\"", "url=\"b.dae#g\"", "`b.dae#g` is in another file"),
            ("url=\"#g\"", "", "<instance_geometry> has no `url`"),
            ("url=\"#s\"", "url=\"#t\"", "no <visual_scene> called `t`"),
            ("meter=\"0.01\"", "meter=\"-1\"", "line 2: not a valid COLLADA mesh: a unit of -1 m"),
            ("COLLADA", "COLLIDA", "its root is <COLLIDA>"),
        ] {
            let text = file("", &format!("<node>{ONE}</node>")).replace(part, other);
            let why = read(text.as_bytes()).unwrap_err().to_string();
            assert!(why.contains(wanted), "{why}");
        }
    }
}
