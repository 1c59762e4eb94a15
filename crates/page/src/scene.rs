//! What a page shows, as far as it does not change: the first two messages that a viewer gets.

use std::collections::HashMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::encode::{MAX_COLUMNS, Writer, no_link};
use super::mesh::{Mesh, disc_radii_m};
use super::message::{Counts, VERSION};
use super::poses::Poses;
use super::scale::Scale;
use super::sense_scale::SenseScales;
use super::senses::{PageSenses, sense_word};
use super::text::Names;
use super::touches::TouchPlaces;
use crate::body::Body;
use crate::colours::pressure_colours;
use crate::signal::{Quantity, Wiring};
use somatic_engine::percept::{Column, Flags, Outputs, TouchFlags, Unit};
use somatic_engine::scene::{Plan, PlanField, SenseRanges, receptor_of};

/// What is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Frames that come when they come.
    Live,
    /// A recording, which a player moves about in.
    Recording {
        /// Time of its first frame, s.
        start_s: f64,
        /// Time of its last frame, s.
        end_s: f64,
        /// Number of its frames.
        frames: u64,
    },
}

/// What a page says of a run.
#[derive(Clone, Copy, Debug)]
pub struct PageInfo<'a> {
    /// What people call the source.
    pub source: &'a str,
    /// What is shown.
    pub mode: Mode,
    /// The backend: its name, what it runs on, and why it was chosen.
    pub backend: [&'a str; 3],
    /// The ids of a frame's values, in their order.
    pub taxels: &'a [u32],
    /// The map from channels of boards to taxels.
    pub wiring: Option<&'a Wiring>,
    /// The largest pressure of the recording, if known.
    pub recorded_max: Option<f64>,
    /// What its other taxels read, as far as that is known.
    pub recorded_senses: SenseRanges,
}

/// What a page shows of a body and a run.
#[derive(Debug)]
pub struct PageScene {
    pub(super) plan: Plan,
    pub(super) value_of: Vec<Option<usize>>,
    pub(super) index_of_link: HashMap<String, u32>,
    /// `welcome` without what changes: run and scale.
    welcome: Value,
    pub(super) mesh: Vec<u8>,
    /// What places in the world are relative to, m.
    pub(super) origin: DVec3,
    pub(super) poses: Poses,
    pub(super) counts: Counts,
    /// What people call fields and links.
    pub(super) names: Names,
    /// By field, whether its places are in the world even where the frame has no pose.
    pub(super) of_world: Vec<bool>,
    pub(super) touch_places: TouchPlaces,
    pub(super) scale: Scale,
    /// Taxels that read something else than pressure, if there are any.
    pub(super) senses: Option<PageSenses>,
}

impl PageScene {
    /// The scene of `body` under `plan`.
    #[must_use]
    pub fn new(body: &Body, plan: &Plan, info: &PageInfo<'_>) -> Self {
        let mesh = Mesh::new(body);
        let origin = mesh.centre(body);
        let poses = Poses::new(body, origin);
        let value_of_id: HashMap<u32, usize> = info.taxels.iter().enumerate().map(|(at, &id)| (id, at)).collect();
        let of_channel = |&taxel: &usize| value_of_id.get(&body.taxels[taxel].id).copied();
        let columns: Vec<&'static Column> = plan.outputs().columns().take(MAX_COLUMNS).collect();
        let time = match info.mode {
            Mode::Live => Value::Null,
            Mode::Recording { start_s, end_s, frames } => {
                json!({"start_s": start_s, "end_s": end_s, "frames": frames})
            }
        };
        let [backend, device, why] = info.backend;
        let welcome = json!({
            "type": "welcome",
            "version": VERSION,
            "somatic": env!("CARGO_PKG_VERSION"),
            "mode": if info.mode == Mode::Live { "live" } else { "recording" },
            "body": body.name,
            "source": info.source,
            "backend": {"name": backend, "device": device, "why": why},
            // Of fields that measure different things no one unit is that of P.
            "quantity": plan.common_quantity().map_or("P", Quantity::symbol),
            "time": time,
            "origin": origin.to_array(),
            "links": body.links.iter().map(|link| json!({"name": link.name, "parent": link.parent})).collect::<Vec<_>>(),
            "channels": info.wiring.map(|wiring| channels(body, wiring)),
            "fields": fields(body, plan),
            "columns": columns.iter().map(|column| column_json(column, plan)).collect::<Vec<_>>(),
            "flags": by_bit(Flags::all().iter_names().map(|(name, flag)| (name, flag.bits()))),
            "touches": plan.touch_outputs().is_some(),
            "touch_flags": by_bit(TouchFlags::all().iter_names().map(|(name, flag)| (name, flag.bits()))),
            "self_contacts": plan.outputs().contains(Outputs::SELF_CONTACTS),
            "colours": pressure_colours().to_vec(),
        });
        Self {
            value_of: plan.body_taxels.iter().map(of_channel).collect(),
            index_of_link: body.links.iter().zip(0..).map(|(link, index)| (link.name.clone(), index)).collect(),
            welcome,
            mesh: mesh_message(body, &mesh, &poses),
            origin,
            poses,
            counts: Counts { taxels: body.taxels.len(), fields: plan.fields.len(), columns },
            names: Names {
                fields: (0..plan.fields.len()).map(|field| plan.label(field)).collect(),
                links: body.links.iter().map(|link| link.name.clone()).collect(),
            },
            of_world: plan.fields.iter().map(|field| field.anchor.is_none()).collect(),
            touch_places: TouchPlaces::new(body, plan, origin),
            scale: Scale::for_plan(plan, info.recorded_max),
            senses: PageSenses::new(body, plan, info.taxels, info.recorded_senses),
            plan: plan.clone(),
        }
    }

    /// The message `welcome`.
    pub(super) fn welcome(&self, run: &str, scale: Scale, senses: Option<&SenseScales>) -> String {
        let mut welcome = self.welcome.clone();
        welcome["run"] = run.into();
        welcome["scale"] = json!({"max": scale.max, "from": scale.from.word()});
        welcome["senses"] = match (&self.senses, senses) {
            (Some(own), Some(scales)) => own.welcome(scales),
            _ => Value::Null,
        };
        welcome.to_string()
    }
}

/// By taxel, its board and channel.
fn channels(body: &Body, wiring: &Wiring) -> Vec<Option<[usize; 2]>> {
    let mut of_id = HashMap::new();
    for board in wiring.boards() {
        for (channel, taxel) in board.taxels.iter().enumerate() {
            of_id.extend(taxel.map(|taxel| (taxel, [usize::from(board.id), channel])));
        }
    }
    body.taxels.iter().map(|taxel| of_id.get(&taxel.id).copied()).collect()
}

fn column_json(column: &Column, plan: &Plan) -> Value {
    let unit = match (column.unit, plan.common_quantity()) {
        (Unit::P, Some(quantity)) => quantity.symbol().to_owned(),
        (Unit::PMetre, Some(quantity)) => format!("{} m", quantity.symbol()),
        (unit, _) => unit.symbol().to_owned(),
    };
    json!({
        "name": column.name,
        "unit": unit,
        "components": column.components,
        "help": column.help,
        "sense": sense_word(receptor_of(column)),
    })
}

/// Flags' names by their bits.
fn by_bit<'a>(flags: impl Iterator<Item = (&'a str, u32)>) -> Vec<Option<String>> {
    let mut names = Vec::new();
    for (name, bits) in flags {
        let bit = bits.trailing_zeros() as usize;
        names.resize(names.len().max(bit + 1), None);
        names[bit] = Some(name.to_lowercase());
    }
    names
}

/// The plan's fields, each in every letter.
fn fields(body: &Body, plan: &Plan) -> Vec<Value> {
    let parent_of: HashMap<&str, &str> =
        body.fields.iter().filter_map(|spec| Some((spec.name.as_str(), spec.parent.as_deref()?))).collect();
    let index_of: HashMap<(&str, usize), usize> =
        plan.fields.iter().enumerate().map(|(index, field)| ((field.name.as_str(), field.letter), index)).collect();
    let field = |(index, field): (usize, &PlanField)| {
        // A field that is not computed is skipped.
        let mut above = std::iter::successors(parent_of.get(field.name.as_str()), |name| parent_of.get(**name));
        let parent = above.find_map(|name| index_of.get(&(*name, field.letter)));
        let members = plan.members_of(field);
        let weights = (!field.unweighted)
            .then(|| (0..members.len()).map(|member| plan.weight(field, member)).collect::<Vec<f64>>());
        let mark = plan.mark(index);
        let letter: Vec<String> =
            [mark.receptor.map(|r| r.to_string()), mark.signal.map(|s| s.to_string())].into_iter().flatten().collect();
        json!({
            "name": field.name,
            "letter": (!letter.is_empty()).then(|| letter.join(" ")),
            "sense": sense_word(plan.letters()[field.letter].receptor),
            "label": plan.label(index),
            "parent": parent,
            "link": field.anchor,
            "members": plan.taxels_of(index).collect::<Vec<_>>(),
            "weights": weights,
            "chart": chart(field),
            "no_chart": field.no_chart.as_ref().map(ToString::to_string),
        })
    };
    plan.fields.iter().enumerate().map(field).collect()
}

fn chart(field: &PlanField) -> Option<Value> {
    let chart = field.chart.as_ref()?;
    let unit_m = f64::from(field.unit_m);
    let uv: Vec<[f64; 2]> = if field.places.is_empty() {
        field.sensed_places_m().map(|place| place.to_array()).collect()
    } else {
        field.places.iter().map(|place| [place.x * unit_m, place.y * unit_m]).collect()
    };
    Some(json!({
        "kind": if chart.kind.is_stored() { "geodesic" } else { "plane" },
        "origin": field.origin_in_anchor.to_array(),
        "u": chart.u_in_anchor.to_array(),
        "v": chart.v_in_anchor.to_array(),
        "normal": chart.normal_in_anchor.to_array(),
        "uv": uv,
    }))
}

/// The binary message of the mesh, the taxels and the links at rest.
fn mesh_message(body: &Body, mesh: &Mesh, poses: &Poses) -> Vec<u8> {
    let taxels = &body.taxels;
    let mut to = Writer::new(1, 0);
    for count in [mesh.positions.len(), mesh.triangles.len(), taxels.len(), body.links.len()] {
        to.u32(count as u32);
    }
    let place = |to: &mut Writer, place: &DVec3| place.to_array().into_iter().for_each(|x| to.f32(x as f32));
    mesh.positions.iter().for_each(|position| place(&mut to, position));
    mesh.normals.iter().for_each(|normal| place(&mut to, normal));
    mesh.links.iter().for_each(|&link| to.u32(link as u32));
    mesh.triangles.iter().flatten().for_each(|&corner| to.u32(corner));
    taxels.iter().for_each(|taxel| to.u32(taxel.id));
    taxels.iter().for_each(|taxel| to.u32(no_link(Some(taxel.link))));
    taxels.iter().for_each(|taxel| place(&mut to, &taxel.position_in_link));
    taxels.iter().for_each(|taxel| place(&mut to, &taxel.normal_in_link));
    disc_radii_m(taxels).into_iter().for_each(|radius| to.f32(radius as f32));
    taxels.iter().for_each(|taxel| to.f32(taxel.area as f32));
    poses.seven().iter().flatten().for_each(|&number| to.f32(number));
    to.finish()
}
