//! The touches of the whole body in a frame's line of JSON.

use glam::DVec3;

use super::json::{key, print};
use crate::body::Body;
use crate::percept::{Touch, TouchFlags, TouchFrame, TouchOutputs, Wrench};
use crate::scene::Plan;

/// The names that touches of the whole body refer to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkinNames {
    /// The body's links.
    pub links: Vec<String>,
    /// The ids of its pressure taxels, as [`TouchFrame::taxels`] counts them.
    pub taxels: Vec<u32>,
    /// The frame of touches that are in the world: `world`, or the link that stands for it.
    pub world: String,
    /// What of touches is wanted.
    pub outputs: TouchOutputs,
}

impl SkinNames {
    /// The names of `body`, whose percepts `plan` makes; `None` if `plan` does not look for touches of the whole body.
    #[must_use]
    pub fn for_plan(body: &Body, plan: &Plan) -> Option<Self> {
        let is_node = |taxel: &&crate::body::Taxel| taxel.modality.is_pressed();
        Some(Self {
            links: body.links.iter().map(|link| link.name.clone()).collect(),
            taxels: body.taxels.iter().filter(is_node).map(|taxel| taxel.id).collect(),
            world: plan.world().to_owned(),
            outputs: plan.touch_outputs()?,
        })
    }
}

/// Writes touches of one skin.
pub(super) struct TouchWriter {
    /// As JSON.
    links: Vec<String>,
    world: String,
    taxels: Vec<u32>,
    outputs: TouchOutputs,
    flags: Vec<(TouchFlags, String)>,
}

impl TouchWriter {
    pub(super) fn new(names: &SkinNames) -> Self {
        let text = |text: &String| serde_json::Value::from(text.as_str()).to_string();
        Self {
            links: names.links.iter().map(text).collect(),
            world: text(&names.world),
            taxels: names.taxels.clone(),
            outputs: names.outputs,
            flags: TouchFlags::all().iter_names().map(|(name, flag)| (flag, name.to_lowercase())).collect(),
        }
    }

    /// A link's name, as JSON.
    pub(super) fn link(&self, link: u32) -> &str {
        &self.links[link as usize]
    }

    /// Appends `,"touches":[…],"released":[…]` to `line`. `fields` are the names of the fields, as JSON.
    pub(super) fn write<'f>(&self, found: &TouchFrame, fields: impl Fn(u32) -> &'f str, line: &mut Vec<u8>) {
        key(line, "touches");
        line.push(b'[');
        for (index, touch) in found.touches.iter().enumerate() {
            line.extend_from_slice(if index == 0 { b"{\"id\":" } else { b",{\"id\":" });
            self.write_one(found, touch, &fields, line);
            line.push(b'}');
        }
        line.push(b']');
        key(line, "released");
        print(line, &found.released);
    }

    fn write_one<'f>(&self, found: &TouchFrame, touch: &Touch, fields: &impl Fn(u32) -> &'f str, line: &mut Vec<u8>) {
        let link = &self.links[touch.link as usize];
        print(line, &touch.id);
        key(line, "age");
        print(line, &touch.age_s);
        key(line, "link");
        line.extend_from_slice(link.as_bytes());
        key(line, "in");
        line.extend_from_slice(if touch.in_world { self.world.as_bytes() } else { link.as_bytes() });
        for column in self.outputs.columns() {
            let Some(components) = column.value(touch) else { continue };
            key(line, column.name);
            match column.components {
                1 if column.is_whole() => print(line, &(components[0] as u64)),
                1 if column.output == TouchOutputs::FIT_KIND => print(line, &touch.fit.map(|fit| fit.kind)),
                1 => print(line, &components[0]),
                count => print(line, &&components[..count]),
            }
        }
        if self.outputs.contains(TouchOutputs::LINKS) {
            let shares = found.links(touch).iter().map(|share| (&*self.links[share.link as usize], share.total));
            write_shares("links", shares, touch.total, line);
        }
        if self.outputs.contains(TouchOutputs::FIELDS) {
            let shares = found.fields(touch).iter().map(|share| (fields(share.field), share.total));
            write_shares("fields", shares, touch.total, line);
        }
        if self.outputs.contains(TouchOutputs::TAXELS) {
            key(line, "taxels");
            let ids: Vec<u32> = found.taxels(touch).iter().map(|&node| self.taxels[node as usize]).collect();
            print(line, &ids);
        }
        if self.outputs.contains(TouchOutputs::WRENCH) {
            self.write_wrenches(found, touch, line);
        }
        key(line, "flags");
        line.push(b'[');
        for (index, (_, name)) in self.flags.iter().filter(|(flag, _)| touch.flags.contains(*flag)).enumerate() {
            line.extend_from_slice(if index == 0 { b"\"" } else { b",\"" });
            line.extend_from_slice(name.as_bytes());
            line.push(b'"');
        }
        line.push(b']');
    }

    /// Force and torque by link, where they are known.
    fn write_wrenches(&self, found: &TouchFrame, touch: &Touch, line: &mut Vec<u8>) {
        let known = found.links(touch).iter().filter_map(|share| Some((share.link, share.wrench?)));
        let known: Vec<(u32, Wrench)> = known.collect();
        if known.is_empty() {
            return;
        }
        key(line, "wrench");
        line.push(b'{');
        for (index, (link, wrench)) in known.into_iter().enumerate() {
            if index > 0 {
                line.push(b',');
            }
            line.extend_from_slice(self.links[link as usize].as_bytes());
            line.extend_from_slice(b":{\"force\":");
            let print_vector = |line: &mut Vec<u8>, vector: DVec3| print(line, &vector.to_array());
            print_vector(line, wrench.force_newton);
            key(line, "torque");
            print_vector(line, wrench.torque_newton_m);
            line.push(b'}');
        }
        line.push(b'}');
    }
}

/// Appends an object of shares of `total`; names are JSON.
fn write_shares<'a>(name: &str, totals: impl Iterator<Item = (&'a str, f64)>, total: f64, line: &mut Vec<u8>) {
    key(line, name);
    line.push(b'{');
    for (index, (of, part)) in totals.enumerate() {
        if index > 0 {
            line.push(b',');
        }
        line.extend_from_slice(of.as_bytes());
        line.push(b':');
        print(line, &(part / total));
    }
    line.push(b'}');
}
