//! The triangles of a `<geometry>`.

use std::collections::HashMap;

use glam::DVec3;
use roxmltree::Node;

use super::file::File;
use crate::error::Result;
use crate::mesh::triangles::Triangles;

/// The inputs of a primitive, as far as they say places.
struct Inputs {
    /// Numbers of a corner in `<p>`.
    width: usize,
    /// Which of them is its vertex.
    offset: usize,
    /// Where the places of its vertices begin in the mesh, and how many there are.
    first: u32,
    count: u32,
}

impl<'a> File<'a> {
    /// The triangles of `geometry`, in its own coordinates. Lines and splines have none.
    pub(super) fn geometry(&self, geometry: Node<'a, 'a>) -> Result<Triangles> {
        let mut whole = Triangles::default();
        for mesh in geometry.children().filter(|child| ["mesh", "convex_mesh"].contains(&child.tag_name().name())) {
            if mesh.attribute("convex_hull_of").is_some() {
                return Err(self.at(mesh, "the hull of another mesh is not stored; export it as a mesh"));
            }
            let own = |tag: &'static str| mesh.children().filter(move |child| child.has_tag_name(tag));
            let by_id = |tag: &'static str| -> HashMap<&str, Node<'_, '_>> {
                own(tag).filter_map(|node| Some((node.attribute("id")?, node))).collect()
            };
            let mut parts =
                Mesh { file: self, sources: by_id("source"), vertices: by_id("vertices"), begun: HashMap::new() };
            for primitive in mesh.children() {
                match primitive.tag_name().name() {
                    "triangles" => parts.triangles(primitive, &mut whole)?,
                    "polylist" => parts.polylist(primitive, &mut whole)?,
                    "polygons" | "trifans" => parts.lists(primitive, &mut whole, Triangles::fan)?,
                    "tristrips" => parts.lists(primitive, &mut whole, strip)?,
                    _ => {}
                }
            }
        }
        Ok(whole)
    }
}

/// Each corner from the third on makes a triangle with the two before it; every second one is the other way round.
fn strip(mesh: &mut Triangles, corners: &[u32]) {
    for (at, three) in corners.windows(3).enumerate() {
        mesh.triangles.push(if at % 2 == 0 { [three[0], three[1], three[2]] } else { [three[1], three[0], three[2]] });
    }
}

/// A `<mesh>`.
struct Mesh<'s, 'a> {
    file: &'s File<'a>,
    sources: HashMap<&'a str, Node<'a, 'a>>,
    vertices: HashMap<&'a str, Node<'a, 'a>>,
    /// By `<source>`, where its places begin in the mesh and how many there are.
    begun: HashMap<Node<'a, 'a>, (u32, u32)>,
}

impl<'a> Mesh<'_, 'a> {
    fn triangles(&mut self, node: Node<'a, 'a>, whole: &mut Triangles) -> Result<()> {
        let Some(inputs) = self.inputs(node, whole)? else { return Ok(()) };
        let mut count = 0_u64;
        for list in node.children().filter(|child| child.has_tag_name("p")) {
            let mut triangle = [0; 3];
            let mut corner = 0;
            self.corners(list, &inputs, |vertex| {
                triangle[corner] = vertex;
                corner = (corner + 1) % 3;
                if corner == 0 {
                    whole.triangles.push(triangle);
                    count += 1;
                }
            })?;
            if corner != 0 {
                return Err(self.file.at(list, "<p> ends within a triangle; export it again"));
            }
        }
        self.check_count(node, count)
    }

    fn polylist(&mut self, node: Node<'a, 'a>, whole: &mut Triangles) -> Result<()> {
        let Some(inputs) = self.inputs(node, whole)? else { return Ok(()) };
        let child = |tag: &'static str| node.children().find(|child| child.has_tag_name(tag));
        let (Some(lengths), Some(list)) = (child("vcount"), child("p")) else {
            return self.check_count(node, 0);
        };
        let mut corners = Vec::new();
        self.corners(list, &inputs, |vertex| corners.push(vertex))?;
        let (mut at, mut count) = (0_usize, 0);
        for length in self.file.numbers::<u32>(lengths) {
            let end = at.saturating_add(length? as usize);
            let face = corners.get(at..end);
            let face =
                face.ok_or_else(|| self.file.at(list, "<p> has fewer corners than <vcount> says; export it again"))?;
            whole.fan(face);
            at = end;
            count += 1;
        }
        if at < corners.len() {
            return Err(self.file.at(list, "<p> has more corners than <vcount> says; export it again"));
        }
        self.check_count(node, count)
    }

    /// A `<p>` for each face, fan or strip.
    fn lists(&mut self, node: Node<'a, 'a>, whole: &mut Triangles, add: impl Fn(&mut Triangles, &[u32])) -> Result<()> {
        let Some(inputs) = self.inputs(node, whole)? else { return Ok(()) };
        let mut corners = Vec::new();
        for list in node.children() {
            match list.tag_name().name() {
                "p" => {
                    corners.clear();
                    self.corners(list, &inputs, |vertex| corners.push(vertex))?;
                    add(whole, &corners);
                }
                "ph" => return Err(self.file.at(list, "a polygon with holes is not read; export triangles")),
                _ => {}
            }
        }
        Ok(())
    }

    /// Gives the vertex of each corner in `list`.
    fn corners(&self, list: Node<'a, 'a>, inputs: &Inputs, mut each: impl FnMut(u32)) -> Result<()> {
        let mut within = 0;
        for index in self.file.numbers::<u32>(list) {
            let index = index?;
            if within == inputs.offset {
                if index >= inputs.count {
                    let what = format!("a corner is vertex {index}, of {}; export it again", inputs.count);
                    return Err(self.file.at(list, what));
                }
                each(inputs.first + index);
            }
            within = (within + 1) % inputs.width;
        }
        if within == 0 { Ok(()) } else { Err(self.file.at(list, "<p> ends within a corner; export it again")) }
    }

    /// Whether `node` has the number of faces that it says.
    fn check_count(&self, node: Node<'a, 'a>, count: u64) -> Result<()> {
        match node.attribute("count").map(|text| (text, text.trim().parse::<u64>())) {
            Some((text, said)) if said.as_ref() != Ok(&count) => {
                let tag = node.tag_name().name();
                Err(self.file.at(node, format!("<{tag}> says it has {text} faces, and has {count}; export it again")))
            }
            _ => Ok(()),
        }
    }

    /// The inputs of the primitive `node`, with their places in `whole`; `None` if it has no vertices.
    fn inputs(&mut self, node: Node<'a, 'a>, whole: &mut Triangles) -> Result<Option<Inputs>> {
        let file = self.file;
        let (mut width, mut vertex) = (1, None);
        for input in node.children().filter(|child| child.has_tag_name("input")) {
            let offset: u16 = match input.attribute("offset").map(|text| text.trim().parse()) {
                None => 0,
                Some(offset) => offset.map_err(|_| file.at(input, "`offset` is not a small whole number"))?,
            };
            width = width.max(usize::from(offset) + 1);
            if input.attribute("semantic") == Some("VERTEX") {
                vertex = Some((input, usize::from(offset)));
            }
        }
        let Some((input, offset)) = vertex else { return Ok(None) };
        let id = |input: Node<'a, 'a>| {
            let id = input.attribute("source").and_then(|source| source.strip_prefix('#'));
            id.ok_or_else(|| file.at(input, "<input> has no `source` in this file"))
        };
        let (mut input, mut source) = (input, id(input)?);
        if let Some(vertices) = self.vertices.get(source) {
            let is_place = |child: &Node<'_, '_>| child.attribute("semantic") == Some("POSITION");
            input =
                vertices.children().find(is_place).ok_or_else(|| file.at(*vertices, "<vertices> have no POSITION"))?;
            source = id(input)?;
        }
        let own = self.sources.get(source).copied();
        let own = own.ok_or_else(|| file.at(input, format!("there is no <source> called `{source}` in its mesh")))?;
        let (first, count) = match self.begun.get(&own) {
            Some(&begun) => begun,
            None => {
                let places = self.places(own)?;
                let begun = (whole.positions.len() as u32, places.len() as u32);
                whole.positions.extend(places);
                self.begun.insert(own, begun);
                begun
            }
        };
        Ok(Some(Inputs { width, offset, first, count }))
    }

    /// The places in `source`.
    fn places(&self, source: Node<'a, 'a>) -> Result<Vec<DVec3>> {
        let file = self.file;
        let array = source.children().find(|child| child.has_tag_name("float_array"));
        let array = array.ok_or_else(|| file.at(source, "a <source> of places has no <float_array>"))?;
        let numbers = file.numbers(array).collect::<Result<Vec<f64>>>()?;
        let accessor = source.descendants().find(|child| child.has_tag_name("accessor"));
        let whole = |name: &str, usual: usize| match accessor.and_then(|own| Some((own, own.attribute(name)?))) {
            Some((own, text)) => text.trim().parse().map_err(|_| file.at(own, format!("`{name}` is `{text}`"))),
            None => Ok(usual),
        };
        let (offset, stride) = (whole("offset", 0)?, whole("stride", if accessor.is_some() { 1 } else { 3 })?);
        let params: Vec<&str> = accessor.map_or_else(Vec::new, |own| {
            let params = own.children().filter(|child| child.has_tag_name("param"));
            params.map(|param| param.attribute("name").unwrap_or_default()).collect()
        });
        let named = |name: &str| params.iter().position(|param| param.eq_ignore_ascii_case(name));
        let [x, y, z] = match (named("X"), named("Y"), named("Z")) {
            (Some(x), Some(y), Some(z)) => [x, y, z],
            // Unnamed, they are in order.
            _ => [0, 1, 2],
        };
        let last = x.max(y).max(z);
        if stride <= last {
            return Err(file.at(source, format!("places have x, y and z, and this has a stride of {stride}")));
        }
        let there = numbers.len().saturating_sub(offset);
        let count = if there > last { (there - last - 1) / stride + 1 } else { 0 };
        let said = whole("count", count)?;
        if said > count {
            let what = format!("it says it has {said} places, and has {count}; export it again");
            return Err(file.at(source, what));
        }
        let place = |at: usize| DVec3::new(numbers[at + x], numbers[at + y], numbers[at + z]);
        Ok((0..said).map(|index| place(offset + index * stride)).collect())
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::read;

    /// Four corners of a square, each with a number before them and one after, and `primitive` on them.
    fn square(primitive: &str) -> String {
        format!(
            r##"<COLLADA><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="20">9 0 0 7 0 9 <!-- 5 -->0 1 7 0 8 1 1 7 0 6 1 0 7 0
</float_array><technique_common><accessor source="#a" count="4" stride="5" offset="1"><param name="Y"/><param name="X"/><param/>
<param name="Z"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{primitive}</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/>
</node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
        )
    }

    const INPUTS: &str = "<input semantic=\"NORMAL\" source=\"#none\" offset=\"0\"/><input semantic=\"VERTEX\" source=\"#v\" \
                          offset=\"1\"/><input semantic=\"TEXCOORD\" source=\"#t\" offset=\"1\"/>";

    #[test]
    fn every_kind_of_face_is_the_same_square() {
        for (primitive, wanted) in [
            (
                format!("<triangles count=\"2\">{INPUTS}<p>9 0 9 1 9 2 9 0 9 2 9 3</p></triangles>"),
                [[0, 1, 2], [0, 2, 3]],
            ),
            (
                format!("<polylist count=\"1\">{INPUTS}<vcount>4</vcount><p>9 0 9 1 9 2 9 3</p></polylist>"),
                [[0, 1, 2], [0, 2, 3]],
            ),
            (format!("<polygons count=\"1\">{INPUTS}<p>9 0 9 1 9 2 9 3</p></polygons>"), [[0, 1, 2], [0, 2, 3]]),
            (format!("<trifans count=\"1\">{INPUTS}<p>9 0 9 1 9 2 9 3</p></trifans>"), [[0, 1, 2], [0, 2, 3]]),
            (format!("<tristrips count=\"1\">{INPUTS}<p>9 0 9 1 9 3 9 2</p></tristrips>"), [[0, 1, 3], [3, 1, 2]]),
        ] {
            let lines = "<lines count=\"1\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1</p></lines>";
            let (mesh, _) = read(square(&format!("{lines}{primitive}")).as_bytes()).unwrap();
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
            assert_eq!(mesh.positions.len(), 4);
            let areas: Vec<DVec3> = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                    (b - a).cross(c - a)
                })
                .collect();
            assert_eq!(mesh.triangles, wanted, "{primitive}");
            assert!(mesh.positions.iter().all(|p| corners.contains(p)), "{:?}", mesh.positions);
            assert!(areas.iter().all(|area| area.z.abs() == 1.0 && area.z == areas[0].z), "{areas:?}");
        }
    }

    #[test]
    fn what_a_list_claims_and_does_not_have_is_an_error_and_takes_no_room() {
        let whole = |count: &str, vcount: &str, list: &str| {
            format!("<polylist count=\"{count}\">{INPUTS}<vcount>{vcount}</vcount><p>{list}</p></polylist>")
        };
        for (primitive, wanted) in [
            (whole("4294967295", "3", "0 0 0 1 0 2"), "says it has 4294967295 faces, and has 1"),
            (whole("1", "4294967295", "0 0 0 1 0 2"), "fewer corners than <vcount>"),
            (whole("1", "3", "0 0 0 1 0 2 0 3"), "more corners than <vcount>"),
            (whole("1", "3", "0 0 0 1 0 4"), "a corner is vertex 4, of 4"),
            (whole("1", "3", "0 0 0 1 0 -1"), "<p> has `-1`, which is not a valid number"),
            (whole("1", "3", "0 0 0 1 0"), "ends within a corner"),
            (format!("<triangles count=\"1\">{INPUTS}<p>0 0 0 1 0 2 0 3</p></triangles>"), "within a triangle"),
            (format!("<polygons>{INPUTS}<ph><p>0 0 0 1 0 2</p></ph></polygons>"), "holes"),
        ] {
            let why = read(square(&primitive).as_bytes()).unwrap_err().to_string();
            assert!(why.starts_with("line 6: ") && why.contains(wanted), "{why}");
        }
        let good = square(&whole("1", "3", "0 0 0 1 0 2"));
        for (part, other, wanted) in [
            ("count=\"4\"", "count=\"5\"", "says it has 5 places, and has 4"),
            ("stride=\"5\"", "stride=\"2\"", "a stride of 2"),
            ("stride=\"5\"", "stride=\"0\"", "a stride of 0"),
            ("offset=\"1\"><param", "offset=\"99\"><param", "says it has 4 places, and has 0"),
            ("source=\"#p\"", "source=\"#q\"", "no <source> called `q`"),
            ("9 0 0 7", "9 0 0,5 7", "<float_array> has `0,5`"),
        ] {
            assert!(good.contains(part), "{part}");
            let why = read(good.replacen(part, other, 1).as_bytes()).unwrap_err().to_string();
            assert!(why.contains(wanted), "{why}");
        }
    }
}
