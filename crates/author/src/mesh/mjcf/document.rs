//! The XML of an MJCF: files included in each other as one text, and attributes with their defaults.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat, DVec3};
use roxmltree::{Document, Node};

use super::pose::{Angles, ORIENTATIONS};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_DEFAULTS, MAX_INCLUDE_DEPTH, MAX_INCLUDES, MAX_XML_BYTES};
use crate::mesh::xml::{self, Lines};

/// The text of the file at `path`, with the content of included files in place of each `<include>`.
pub(super) fn included(path: &Path) -> Result<String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut includes = Includes { folder, seen: BTreeSet::from([path.to_owned()]) };
    includes.put_into(&xml::text_of(path)?, 0).map_err(|e| e.at(path.display()))
}

/// The paths in an included file are relative to the folder of the first one.
struct Includes<'a> {
    folder: &'a Path,
    /// What is included, which is included once, as in MuJoCo.
    seen: BTreeSet<PathBuf>,
}

impl Includes<'_> {
    fn put_into(&mut self, text: &str, depth: usize) -> Result<String> {
        let document = parse(text)?;
        let lines = Lines::from_document(&document);
        let includes = document.descendants().filter(|node| node.has_tag_name("include"));
        let mut parts: Vec<(std::ops::Range<usize>, String)> = Vec::new();
        for node in includes {
            let at = |e: Error| e.at(format!("line {}", lines.line(node)));
            let name = node.attribute("file").ok_or_else(|| at(Error::failed("<include> has no `file`")))?;
            if depth == MAX_INCLUDE_DEPTH {
                return Err(at(failed!("files include each other over {MAX_INCLUDE_DEPTH} deep, as `{name}`")));
            }
            let path = self.folder.join(name);
            if !self.seen.insert(path.clone()) {
                return Err(at(failed!("`{name}` is included a second time, which MuJoCo refuses, too; remove one")));
            }
            if self.seen.len() > MAX_INCLUDES {
                return Err(at(failed!("over {MAX_INCLUDES} files are included; put some together")));
            }
            let inner = xml::text_of(&path).map_err(at)?;
            let inner = self.put_into(&inner, depth + 1).map_err(|e| at(e.at(path.display())))?;
            let inner_document = parse(&inner).map_err(|e| at(e.at(path.display())))?;
            let children = inner_document.root_element().children().filter(Node::is_element);
            let content: Vec<&str> = children.map(|child| &inner_document.input_text()[child.range()]).collect();
            parts.push((node.range(), content.join("\n")));
        }
        let text = document.input_text();
        let length = text.len() + parts.iter().map(|(_, content)| content.len()).sum::<usize>();
        if length as u64 > MAX_XML_BYTES {
            return Err(failed!("with its included files it has over {}; leave some out", limits::size(MAX_XML_BYTES)));
        }
        let (mut whole, mut end) = (String::with_capacity(length), 0);
        for (range, content) in parts {
            whole += &text[end..range.start];
            whole += &content;
            end = range.end;
        }
        Ok(whole + &text[end..])
    }
}

/// `text` as XML.
pub(super) fn parse(text: &str) -> Result<Document<'_>> {
    xml::parse(text)
}

/// Attributes by class, tag and name, with those of the class above.
#[derive(Debug, Default)]
pub(super) struct Defaults {
    classes: BTreeMap<String, BTreeMap<(String, String), String>>,
    /// How many attributes are there again, as those of the class above.
    inherited: usize,
}

/// The class that is above all.
const MAIN: &str = "";

impl Defaults {
    pub(super) fn read(root: Node<'_, '_>) -> Result<Self> {
        let mut defaults = Self::default();
        for node in root.children().filter(|node| node.has_tag_name("default")) {
            defaults.take(node, MAIN, None)?;
        }
        Ok(defaults)
    }

    fn take(&mut self, node: Node<'_, '_>, class: &str, above: Option<&str>) -> Result<()> {
        if let Some(above) = above {
            let inherited = self.classes.get(above).cloned().unwrap_or_default();
            self.inherited += inherited.len();
            if self.inherited > MAX_DEFAULTS {
                let what = failed!("its <default> classes inherit over {MAX_DEFAULTS} attributes; make them fewer");
                return Err(at(node, what));
            }
            self.classes.insert(class.to_owned(), inherited);
        }
        let own = self.classes.entry(class.to_owned()).or_default();
        for element in node.children().filter(|child| child.is_element() && !child.has_tag_name("default")) {
            let tag = element.tag_name().name();
            // A new orientation replaces an inherited one, however that is written.
            if element.attributes().any(|own| ORIENTATIONS.contains(&own.name())) {
                own.retain(|(known, name), _| known != tag || !ORIENTATIONS.contains(&name.as_str()));
            }
            for attribute in element.attributes() {
                own.insert((tag.to_owned(), attribute.name().to_owned()), attribute.value().to_owned());
            }
        }
        for child in node.children().filter(|child| child.has_tag_name("default")) {
            if let Some(name) = child.attribute("class") {
                self.take(child, name, Some(class))?;
            }
        }
        Ok(())
    }

    /// The attribute `name` of `node`, its own or that of its class.
    pub(super) fn get<'a>(&'a self, node: Node<'a, '_>, name: &str) -> Option<&'a str> {
        node.attribute(name).or_else(|| {
            let known = self.classes.get(class_of(node)).or_else(|| self.classes.get(MAIN))?;
            known.get(&(node.tag_name().name().to_owned(), name.to_owned())).map(String::as_str)
        })
    }

    /// The orientation of `node`: the attribute that gives it and its numbers' text.
    fn orientation<'a>(&'a self, node: Node<'a, '_>) -> Option<(&'static str, &'a str)> {
        let own = ORIENTATIONS.into_iter().find_map(|name| Some((name, node.attribute(name)?)));
        own.or_else(|| ORIENTATIONS.into_iter().find_map(|name| Some((name, self.get(node, name)?))))
    }

    /// The pose of `node` in what is around it.
    pub(super) fn pose(&self, node: Node<'_, '_>, angles: &Angles) -> Result<DAffine3> {
        let place = match self.get(node, "pos") {
            Some(text) => three(node, "pos", text)?,
            None => DVec3::ZERO,
        };
        let turn = match self.orientation(node) {
            Some((name, text)) => angles.orientation(name, &numbers(node, name, text)?).map_err(|e| at(node, e))?,
            None => DQuat::IDENTITY,
        };
        Ok(DAffine3::from_rotation_translation(turn, place))
    }
}

/// The class of `node`: its own, or that of what is around it.
fn class_of<'a>(node: Node<'a, '_>) -> &'a str {
    let own = node.attribute("class");
    let around = || node.ancestors().skip(1).find_map(|above| above.attribute("childclass"));
    own.or_else(around).unwrap_or(MAIN)
}

/// `error` at the line of `node`.
pub(super) fn at(node: Node<'_, '_>, error: Error) -> Error {
    error.at(format!("line {}", node.document().text_pos_at(node.range().start).row))
}

pub(super) fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str> {
    let missing = || at(node, failed!("<{}> has no `{name}`", node.tag_name().name()));
    node.attribute(name).ok_or_else(missing)
}

/// The numbers in `text`, the attribute `name` of `node`.
pub(super) fn numbers(node: Node<'_, '_>, name: &str, text: &str) -> Result<Vec<f64>> {
    let number = |word: &str| {
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| at(node, failed!("`{name}` has `{word}`, which is not a number")))
    };
    text.split_whitespace().map(number).collect()
}

pub(super) fn three(node: Node<'_, '_>, name: &str, text: &str) -> Result<DVec3> {
    match numbers(node, name, text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(at(node, failed!("`{name}` is `{text}`; write three numbers"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_come_from_the_class_and_those_above_it() {
        let text = r#"<mujoco><default><geom type="box" euler="0 0 90"/><default class="tip"><geom quat="1 0 0 0" size="1"/>
            </default></default><worldbody><body childclass="tip"><geom name="a"/><geom name="b" size="2"/></body>
            <geom name="c"/></worldbody></mujoco>"#;
        let document = parse(text).unwrap();
        let defaults = Defaults::read(document.root_element()).unwrap();
        let geom = |name: &str| document.descendants().find(|node| node.attribute("name") == Some(name)).unwrap();
        let get = |name: &str, key: &str| defaults.get(geom(name), key).map(str::to_owned);
        assert_eq!(
            [get("a", "type"), get("a", "size"), get("b", "size")],
            ["box", "1", "2"].map(|x| Some(x.to_owned()))
        );
        assert_eq!((get("c", "size"), get("c", "type").as_deref()), (None, Some("box")));
        let x_of = |name: &str| defaults.pose(geom(name), &Angles::default()).unwrap().matrix3.x_axis;
        assert!(x_of("c").distance(DVec3::Y) < 1e-12 && x_of("a").distance(DVec3::X) < 1e-12);
    }

    #[test]
    fn classes_that_inherit_too_much_are_refused() {
        let main: String = (0..2000).map(|index| format!("<g{index} a='1'/>")).collect();
        let classes: String = (0..600).map(|index| format!("<default class='c{index}'/>")).collect();
        let text = format!("<mujoco><default>{main}{classes}</default></mujoco>");
        let document = parse(&text).unwrap();
        let why = Defaults::read(document.root_element()).unwrap_err().to_string();
        assert!(why.starts_with("line 1: its <default> classes inherit over 1000000"), "{why}");
    }

    #[test]
    fn included_files_are_where_they_are_included() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("a.xml", "<mujoco><include file=\"b.xml\"/><worldbody/></mujoco>");
        write("b.xml", "<mujoco><asset/><include file=\"c.xml\"/></mujoco>");
        write("c.xml", "<mujocoinclude><sensor/></mujocoinclude>");
        let text = included(&folder.path().join("a.xml")).unwrap();
        let document = parse(&text).unwrap();
        let tags: Vec<&str> =
            document.root_element().children().map(|node| node.tag_name().name()).filter(|t| !t.is_empty()).collect();
        assert_eq!(tags, ["asset", "sensor", "worldbody"]);
        write("c.xml", "<mujocoinclude><include file=\"a.xml\"/></mujocoinclude>");
        assert!(
            included(&folder.path().join("a.xml"))
                .unwrap_err()
                .to_string()
                .contains("`a.xml` is included a second time")
        );
    }

    #[test]
    fn files_that_include_each_other_tenfold_end() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for level in 0..9 {
            let ten = format!("<include file=\"i{}.xml\"/>", level + 1).repeat(10);
            write(&format!("i{level}.xml"), &format!("<mujoco>{ten}</mujoco>"));
        }
        write("i9.xml", "<mujoco/>");
        assert!(included(&folder.path().join("i0.xml")).unwrap_err().to_string().contains("a second time"));
        // Nor do names help.
        for index in 0..1100 {
            write(&format!("n{index}.xml"), "<mujoco/>");
        }
        let all: String = (0..1100).map(|index| format!("<include file=\"n{index}.xml\"/>")).collect();
        write("all.xml", &format!("<mujoco>{all}</mujoco>"));
        assert!(included(&folder.path().join("all.xml")).unwrap_err().to_string().contains("over 1000 files"));
    }
}
