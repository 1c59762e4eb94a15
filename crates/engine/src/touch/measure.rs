//! The quantities of one touch.

use glam::{DVec2, DVec3};

use super::bridges::Bridges;
use super::moments::{self, Line, Pulling};
use super::skin::Skin;
use crate::percept::{FieldShare, LinkShare, Touch, TouchFlags, TouchFrame, TouchOutputs, Wrench};

/// Spread of the weights with which the normals of taxels count at a position, in roots of their cells.
const NORMAL_SPREAD: f64 = 0.5;

/// What the quantities of touches are made of.
pub(super) struct Felt<'a> {
    pub(super) skin: &'a Skin,
    pub(super) bridges: &'a Bridges,
    /// P by node.
    pub(super) pressures: &'a [f64],
    /// What is to be said of nodes, by node; empty if nothing is.
    pub(super) notes: &'a [TouchFlags],
    pub(super) wanted: TouchOutputs,
}

/// Memory for the quantities of a touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Measure {
    pulling: Vec<Pulling>,
    places: Vec<DVec2>,
}

/// Where a touch is on the body at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
}

impl Measure {
    /// Adds the touch on `nodes`, not empty, to `out`, without what depends on the frames before; where it is at rest.
    pub(super) fn touch(&mut self, felt: &Felt<'_>, nodes: &[u32], out: &mut TouchFrame) -> Place {
        let Felt { skin, wanted, .. } = *felt;
        let mut touch = sums(felt, nodes);
        touch.links = add_links(felt, nodes, &mut out.links);
        let shares = &out.links[touch.links[0] as usize..];
        // Of equal ones the first of the body.
        touch.link =
            shares.iter().fold(shares[0], |most, share| if share.total > most.total { *share } else { most }).link;
        if shares.len() > 1 {
            touch.flags |= TouchFlags::SEVERAL_LINKS;
        }
        if wanted.contains(TouchOutputs::FIELDS) {
            touch.fields = add_fields(felt, nodes, out);
        }
        if wanted.contains(TouchOutputs::TAXELS) {
            let from = out.taxels.len();
            out.taxels.extend_from_slice(nodes);
            out.taxels[from..].sort_unstable();
            touch.taxels = [from as u32, out.taxels.len() as u32];
        }
        self.pulling.clear();
        self.pulling.extend(nodes.iter().map(|&node| {
            let pull = skin.taxel(node).weight() * felt.pressures[node as usize];
            Pulling { node, pull }
        }));
        let (mean, total) = moments::mean(skin, &self.pulling);
        touch.base = moments::base(skin, &self.pulling, mean);
        let place = place(skin, nodes, touch.base, mean);
        let about = (touch.base, touch.link, total);
        let shape =
            moments::shape(skin, &self.pulling, about, wanted.contains(TouchOutputs::ORIENTATION), &mut self.places);
        let link_from_body = skin.link_from_body(touch.link);
        let in_link = |line: Option<Line>| line.map(|line| link_from_body.transform_vector3(line.along));
        touch.position = link_from_body.transform_point3(place.position);
        touch.centre = link_from_body.transform_point3(touch.centre);
        touch.normal = link_from_body.transform_vector3(place.normal);
        touch.principal_axis = in_link(shape.axis);
        touch.principal_axis_rad = shape.axis.and_then(|line| line.angle_rad);
        (touch.anisotropy, touch.spread_m) = (shape.anisotropy, shape.spread_m);
        touch.orientation = in_link(shape.orientation);
        touch.orientation_rad = shape.orientation.and_then(|line| line.angle_rad);
        touch.flags |= shape.flags;
        out.touches.push(touch);
        place
    }
}

/// Sums, means and flags; the centre is in the body at rest.
fn sums(felt: &Felt<'_>, nodes: &[u32]) -> Touch {
    let skin = felt.skin;
    let about = skin.taxel(nodes[0]).position;
    let (mut total, mut peak, mut area_m2, mut newton) = (0.0, 0.0_f64, 0.0, 0.0);
    let (mut offsets, mut flags) = (DVec3::ZERO, TouchFlags::empty());
    let (mut area_known, mut force_known) = (true, true);
    for &node in nodes {
        let (taxel, pressure) = (skin.taxel(node), felt.pressures[node as usize]);
        total += pressure;
        peak = peak.max(pressure);
        offsets += taxel.position - about;
        area_m2 += taxel.area_m2;
        newton += pressure * taxel.reading.newton_at_one;
        area_known &= taxel.area_m2 > 0.0;
        force_known &= taxel.reading.newton_at_one > 0.0;
        if let Some(note) = felt.notes.get(node as usize) {
            flags |= *note;
        }
        if felt.bridges.is_beside_one(skin, node) {
            flags |= of_gaps(felt, node);
        }
    }
    if !force_known {
        flags |= TouchFlags::NO_UNIT;
    }
    Touch {
        id: 0,
        age_s: 0.0,
        link: 0,
        total,
        peak,
        active: nodes.len() as u32,
        area_m2: area_known.then_some(area_m2),
        force_newton: force_known.then_some(newton),
        mean_pressure_pascal: (force_known && area_known).then(|| newton / area_m2),
        position: DVec3::ZERO,
        centre: about + offsets / nodes.len() as f64,
        normal: DVec3::ZERO,
        principal_axis: None,
        principal_axis_rad: None,
        anisotropy: None,
        spread_m: None,
        orientation: None,
        orientation_rad: None,
        velocity: None,
        fit: None,
        total_sigma: None,
        position_sigma_m: None,
        place: None,
        place_sigma_m: None,
        principal_axis_sigma_rad: None,
        shear: None,
        shear_in_chart: None,
        shear_direction_rad: None,
        force_vector_newton: None,
        torsion: None,
        friction: None,
        friction_sigma: None,
        slip_ratio: None,
        temperature_celsius: None,
        warmest_celsius: None,
        warmest_taxel: None,
        warmest_position: None,
        coldest_celsius: None,
        coldest_taxel: None,
        coldest_position: None,
        temperature_gradient_kelvin_per_m: None,
        temperature_rate_kelvin_per_s: None,
        in_world: false,
        flags,
        base: 0,
        begins_anew: false,
        links: [0; 2],
        fields: [0; 2],
        taxels: [0; 2],
    }
}

/// What is to be said of the taxels without a value beside `node`: that they are missing, unless something else is noted.
fn of_gaps(felt: &Felt<'_>, node: u32) -> TouchFlags {
    let gaps = felt.skin.beside(node).iter().filter(|other| !felt.bridges.has_value(**other));
    let note_on = |other: &u32| match felt.notes.get(*other as usize) {
        Some(note) if !note.is_empty() => *note,
        _ => TouchFlags::INCOMPLETE,
    };
    gaps.map(note_on).fold(TouchFlags::empty(), |all, note| all | note)
}

/// Adds the links that `nodes` lie on, in the body's order.
pub(super) fn add_links(felt: &Felt<'_>, nodes: &[u32], links: &mut Vec<LinkShare>) -> [u32; 2] {
    let from = links.len();
    for &node in nodes {
        let (taxel, pressure) = (felt.skin.taxel(node), felt.pressures[node as usize]);
        let known = links[from..].iter().position(|share| share.link == taxel.link);
        let at = known.map_or(links.len(), |known| from + known);
        if known.is_none() {
            let wrench = felt.wanted.contains(TouchOutputs::WRENCH).then(Wrench::default);
            links.push(LinkShare { link: taxel.link, total: 0.0, wrench });
        }
        let share = &mut links[at];
        share.total += pressure;
        if taxel.reading.newton_at_one <= 0.0 {
            share.wrench = None;
        }
        if let Some(wrench) = &mut share.wrench {
            let link_from_body = felt.skin.link_from_body(taxel.link);
            let force = link_from_body.transform_vector3(taxel.normal) * (-pressure * taxel.reading.newton_at_one);
            wrench.force_newton += force;
            wrench.torque_newton_m += link_from_body.transform_point3(taxel.position).cross(force);
        }
    }
    links[from..].sort_unstable_by_key(|share| share.link);
    [from as u32, links.len() as u32]
}

fn add_fields(felt: &Felt<'_>, nodes: &[u32], out: &mut TouchFrame) -> [u32; 2] {
    let from = out.fields.len();
    for &node in nodes {
        let total = felt.pressures[node as usize];
        for &field in felt.skin.fields_of(node) {
            match out.fields[from..].binary_search_by_key(&field, |share| share.field) {
                Ok(known) => out.fields[from + known].total += total,
                Err(at) => out.fields.insert(from + at, FieldShare { field, total }),
            }
        }
    }
    [from as u32, out.fields.len() as u32]
}

/// The surface point of the cells of `nodes` that is nearest to `mean`, and the normal there: the mean of their normals, with
/// weights exp(−½ (r / 0.5 d)²) at the distance r, where d is the root of the cell. Without a surface it is `mean` on the tangent
/// plane of `base`, the nearest taxel.
fn place(skin: &Skin, nodes: &[u32], base: u32, mean: DVec3) -> Place {
    let cells = std::iter::once(base).chain(nodes.iter().copied().filter(|&node| node != base));
    let nearest = skin.surface().nearest(cells.map(|node| skin.cell_of(node)), mean);
    let base = skin.taxel(base);
    let position = nearest.map_or_else(
        || mean - base.mean_normal * (mean - base.position).dot(base.mean_normal),
        |nearest| nearest.position,
    );
    let normal = |&node: &u32| {
        let taxel = skin.taxel(node);
        let square = NORMAL_SPREAD * NORMAL_SPREAD * taxel.cell_m2;
        taxel.mean_normal * libm::exp(-0.5 * taxel.position.distance_squared(position) / square)
    };
    let normals: DVec3 = if nodes.len() == 1 { base.mean_normal } else { nodes.iter().map(normal).sum() };
    Place { position, normal: normals.try_normalize().unwrap_or(base.mean_normal) }
}
