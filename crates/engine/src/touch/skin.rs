//! The skin: what touches need to know of a body, made once on loading.

use glam::{DAffine3, DMat3, DVec3};

use super::cell_tree::CellTree;

/// A pressure taxel on the body at rest. Taxels are numbered by ascending id; a number is called a node, as in the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTaxel {
    /// Its id in the body.
    pub id: u32,
    /// Index of its link.
    pub link: u32,
    /// Position in the frame of the body at rest, m.
    pub position: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// The mean outward normal of about 4 mm of surface there, of unit length: for charts.
    pub mean_normal: DVec3,
    /// Its share of the surface, m²: for lengths.
    pub cell_m2: f64,
    /// Area of the sensor, m²; 0 if unknown.
    pub area_m2: f64,
    /// How its value counts.
    pub reading: Reading,
}

impl SkinTaxel {
    /// Weight of its P in place and axis.
    #[must_use]
    pub fn weight(&self) -> f64 {
        if self.reading.weighs_by_cell { self.cell_m2 } else { 1.0 }
    }
}

/// How the value of a taxel counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Its force at P = 1, N: its area where P is a pressure, 1 where P is a force. 0 where it is unknown.
    pub newton_at_one: f64,
    /// Whether its P has the area of its cell as its weight in place and axis, and not 1: where P is a pressure, and where sensors
    /// of one size sit on cells of several sizes. A sensor that covers its cell has added up already.
    pub weighs_by_cell: bool,
    /// Standard deviation of the noise of P.
    pub sigma: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self { newton_at_one: 0.0, weighs_by_cell: true, sigma: 0.0 }
    }
}

/// The pressure taxels of a body at rest, their graph, and the surface by their cells.
#[derive(Clone, Debug)]
pub struct Skin {
    taxels: Vec<SkinTaxel>,
    /// Per node where its neighbours begin; one more at the end.
    first: Vec<u32>,
    /// The neighbours of all nodes, one node after the other.
    neighbours: Vec<u32>,
    surface: CellTree,
    /// Per node the one whose cell of `surface` it has.
    cell_of: Vec<u32>,
    links: Vec<SkinLink>,
    /// Per node where its fields begin; one more at the end.
    first_field: Vec<u32>,
    /// The fields of all nodes, ascending.
    fields: Vec<u32>,
}

/// A link at rest.
#[derive(Clone, Copy, Debug)]
struct SkinLink {
    link_from_body: DAffine3,
    /// Its axes in the body at rest.
    axes: DMat3,
}

/// What a skin is made of.
#[derive(Clone, Debug, Default)]
pub struct SkinParts {
    /// By ascending id.
    pub taxels: Vec<SkinTaxel>,
    /// Pairs of nodes that are neighbours.
    pub edges: Vec<(u32, u32)>,
    /// Per link its pose on the body at rest: body_from_link.
    pub body_from_link: Vec<DAffine3>,
    /// The surface at rest, m, in triangles that are each in the cell of one node.
    pub surface: Vec<(u32, [DVec3; 3])>,
    /// Per node the one whose cell it has, itself unless another is at its place. Empty: all have their own.
    pub cell_of: Vec<u32>,
}

impl Skin {
    /// The skin of `parts`. Edges and surface of nodes that are not there are left out, as are edges of a node with itself.
    #[must_use]
    pub fn from_parts(parts: SkinParts) -> Self {
        let SkinParts { mut taxels, edges, body_from_link, mut surface, cell_of } = parts;
        give_cells(&mut taxels);
        let count = taxels.len() as u32;
        let mut pairs: Vec<(u32, u32)> = edges
            .into_iter()
            .filter(|&(a, b)| a != b && a < count && b < count)
            .flat_map(|(a, b)| [(a, b), (b, a)])
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        surface.retain(|(node, _)| *node < count);
        let positions: Vec<DVec3> = taxels.iter().map(|taxel| taxel.position).collect();
        let own = |node: u32| cell_of.get(node as usize).copied().filter(|&cell| cell < count).unwrap_or(node);
        let link = |body_from_link: DAffine3| SkinLink {
            link_from_body: body_from_link.inverse(),
            axes: body_from_link.matrix3,
        };
        let mut links: Vec<SkinLink> = body_from_link.into_iter().map(link).collect();
        let least = taxels.iter().map(|taxel| taxel.link as usize + 1).max().unwrap_or(0);
        links.resize_with(links.len().max(least), || link(DAffine3::IDENTITY));
        Self {
            first: starts(count, pairs.iter().map(|&(from, _)| from)),
            neighbours: pairs.into_iter().map(|(_, to)| to).collect(),
            surface: CellTree::new(&positions, &surface),
            cell_of: (0..count).map(own).collect(),
            links,
            first_field: vec![0; taxels.len() + 1],
            fields: Vec::new(),
            taxels,
        }
    }

    /// Says which nodes each field holds; touches list their shares of these fields.
    pub fn set_fields(&mut self, members: &[Vec<u32>]) {
        let count = self.taxels.len() as u32;
        let of_field =
            |(field, nodes): (u32, &Vec<u32>)| nodes.iter().map(move |&node| (node, field)).collect::<Vec<_>>();
        let mut pairs: Vec<(u32, u32)> = (0..).zip(members).flat_map(of_field).filter(|pair| pair.0 < count).collect();
        pairs.sort_unstable();
        pairs.dedup();
        self.first_field = starts(count, pairs.iter().map(|&(node, _)| node));
        self.fields = pairs.into_iter().map(|(_, field)| field).collect();
    }

    /// Changes how the values of taxels count, by node; the rest stay.
    pub fn set_readings(&mut self, readings: impl IntoIterator<Item = Reading>) {
        self.taxels.iter_mut().zip(readings).for_each(|(taxel, reading)| taxel.reading = reading);
    }

    /// Number of pressure taxels.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.taxels.len()
    }

    /// The taxels by node.
    #[must_use]
    pub fn taxels(&self) -> &[SkinTaxel] {
        &self.taxels
    }

    /// The taxel with number `node`.
    pub(super) fn taxel(&self, node: u32) -> &SkinTaxel {
        &self.taxels[node as usize]
    }

    /// The neighbours of `node` on the skin, ascending.
    #[must_use]
    pub fn beside(&self, node: u32) -> &[u32] {
        let [from, to] = [0, 1].map(|step| self.first[node as usize + step] as usize);
        &self.neighbours[from..to]
    }

    /// The fields that hold `node`, ascending.
    pub(super) fn fields_of(&self, node: u32) -> &[u32] {
        let [from, to] = [0, 1].map(|step| self.first_field[node as usize + step] as usize);
        &self.fields[from..to]
    }

    /// The surface by cells.
    pub(super) fn surface(&self) -> &CellTree {
        &self.surface
    }

    /// Whether the cell of `node` has a surface.
    pub(crate) fn has_surface(&self, node: u32) -> bool {
        self.surface.has_surface(self.cell_of(node))
    }

    /// The node whose cell of the surface `node` has.
    pub(super) fn cell_of(&self, node: u32) -> u32 {
        self.cell_of[node as usize]
    }

    /// Takes the body at rest to the link's frame: link_from_body.
    #[must_use]
    pub fn link_from_body(&self, link: u32) -> DAffine3 {
        self.links[link as usize].link_from_body
    }

    /// The axes of a link in the body at rest.
    pub(super) fn axes_of(&self, link: u32) -> &DMat3 {
        &self.links[link as usize].axes
    }

    /// Memory of its tables, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let numbers = [&self.first, &self.neighbours, &self.cell_of, &self.first_field, &self.fields];
        let numbers: usize = numbers.iter().map(|numbers| size_of_val(&numbers[..])).sum();
        self.surface.bytes() + size_of_val(&self.taxels[..]) + size_of_val(&self.links[..]) + numbers
    }
}

/// Gives taxels without a cell one of the usual size: a weight of 0 would leave a touch without a place.
fn give_cells(taxels: &mut [SkinTaxel]) {
    const USUAL_M2: f64 = 1e-4;
    let is_cell = |cell_m2: f64| cell_m2 > 0.0 && cell_m2.is_finite();
    let mut known: Vec<f64> = taxels.iter().map(|taxel| taxel.cell_m2).filter(|&cell_m2| is_cell(cell_m2)).collect();
    known.sort_unstable_by(f64::total_cmp);
    let usual_m2 = known.get(known.len() / 2).copied().unwrap_or(USUAL_M2);
    taxels.iter_mut().filter(|taxel| !is_cell(taxel.cell_m2)).for_each(|taxel| taxel.cell_m2 = usual_m2);
}

/// Where the items of each of `count` owners begin in a list that is sorted by owner, and where it ends.
fn starts(count: u32, owners: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut starts = vec![0_u32; count as usize + 1];
    owners.for_each(|owner| starts[owner as usize + 1] += 1);
    for owner in 0..count as usize {
        starts[owner + 1] += starts[owner];
    }
    starts
}
