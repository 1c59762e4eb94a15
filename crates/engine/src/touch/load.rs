//! The skin of a body.

use std::collections::BTreeMap;

use glam::DVec3;

use super::skin::{Reading, Skin, SkinParts, SkinTaxel};
use crate::body::{Body, point_tree};
use crate::field::{CellSurface, Seated, TaxelGraph, mean_normals_of};

impl Skin {
    /// The skin of `body`, whose graph is `graph`, with the readings `reading` of its pressure taxels, by their indices in the body.
    ///
    /// A cell is the taxel's share of the surface; without a surface it is the sensor's area, else the square of the distance to
    /// the nearest other taxel of its link.
    #[must_use]
    pub fn new(body: &Body, graph: &TaxelGraph, reading: impl Fn(usize) -> Reading) -> Self {
        let is_node = |taxel: usize| body.taxels[taxel].modality.is_pressed();
        let nodes: Vec<usize> = (0..body.taxels.len()).filter(|&taxel| is_node(taxel)).collect();
        let mut node_of = vec![u32::MAX; body.taxels.len()];
        (0..).zip(&nodes).for_each(|(node, &taxel)| node_of[taxel] = node);
        let divided = body.kept_of_shape().get(0, || Divided::new(body));
        let Divided { cells, normals } = &*divided;
        let spacing_m = spacings_m(body, &nodes);
        let taxel = |(&index, spacing_m): (&usize, f64)| {
            let taxel = &body.taxels[index];
            let rest = &body.links[taxel.link].body_from_link;
            let sensor_m2 = if taxel.area > 0.0 { taxel.area } else { spacing_m * spacing_m };
            SkinTaxel {
                id: taxel.id,
                link: taxel.link as u32,
                position: rest.transform_point3(taxel.position_in_link),
                normal: rest.transform_vector3(taxel.normal_in_link),
                mean_normal: rest.transform_vector3(normals[index]).normalize_or(DVec3::Z),
                cell_m2: cells.area_m2[index].unwrap_or(sensor_m2),
                area_m2: taxel.area,
                reading: reading(index),
            }
        };
        let edges = graph.edges().map(|(a, b)| (node_of[a as usize], node_of[b as usize]));
        let surface = cells.triangles.iter().map(|&(taxel, corners)| (node_of[taxel as usize], corners));
        Self::from_parts(SkinParts {
            taxels: nodes.iter().zip(spacing_m).map(taxel).collect(),
            edges: edges.collect(),
            body_from_link: body.links.iter().map(|link| link.body_from_link).collect(),
            surface: surface.collect(),
            cell_of: nodes.iter().map(|&taxel| node_of[cells.cell_of[taxel] as usize]).collect(),
        })
    }
}

/// The surface of a body as its taxels divide it.
struct Divided {
    cells: CellSurface,
    /// Per taxel.
    normals: Vec<DVec3>,
}

impl Divided {
    fn new(body: &Body) -> Self {
        let seated = Seated::new(body);
        Self { cells: CellSurface::new(body, &seated), normals: mean_normals_of(body, &seated) }
    }
}

/// Per taxel of `nodes` the distance to the nearest other one of its link that is not at its place, m; where there is none, that
/// of the body, else 1 cm.
fn spacings_m(body: &Body, nodes: &[usize]) -> Vec<f64> {
    const USUAL_M: f64 = 0.01;
    let mut by_link: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    nodes.iter().for_each(|&taxel| by_link.entry(body.taxels[taxel].link).or_default().push(taxel));
    let mut spacing_m: BTreeMap<usize, f64> = BTreeMap::new();
    for taxels in by_link.values() {
        let position = |taxel: usize| body.taxels[taxel].position_in_link;
        let tree = point_tree(taxels.iter().map(|&taxel| position(taxel)));
        for &taxel in taxels {
            let near = tree.nearest_neighbor_iter_with_distance_2(position(taxel).to_array());
            let other = near.map(|(_, squared)| squared).find(|&squared| squared > 0.0);
            spacing_m.extend(other.map(|squared| (taxel, squared.sqrt())));
        }
    }
    let least_m = spacing_m.values().copied().reduce(f64::min).unwrap_or(USUAL_M);
    nodes.iter().map(|taxel| spacing_m.get(taxel).copied().unwrap_or(least_m)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::body::area_vector;
    use crate::bundled;
    use crate::percept::TouchFrame;
    use crate::touch::{Input, Options, Touches};

    #[test]
    fn a_press_anywhere_on_bundled_bodies_is_one_touch_on_its_taxels_surface() {
        for (name, bytes) in [("hand", bundled::HAND), ("humanoid", bundled::HUMANOID)] {
            let body = Body::from_bytes(name, bytes).unwrap();
            let graph = TaxelGraph::from_body(&body).0;
            let skin = Arc::new(Skin::new(&body, &graph, |_| Reading::default()));
            assert_eq!(skin.nodes(), body.taxels.len());
            for node in 0..skin.nodes() as u32 {
                let own = skin.surface().triangles_about(skin.cell_of(node));
                let area_m2: f64 = own.map(|corners| area_vector(corners).length() / 2.0).sum();
                let cell_m2 = skin.taxel(node).cell_m2;
                assert!((area_m2 / cell_m2 - 1.0).abs() < 1e-3, "{name} {node}: {area_m2} {cell_m2}");
            }
            let mut touches = Touches::new(skin.clone(), Options::default());
            let mut frame = TouchFrame::default();
            let mut found = 0;
            for pressed in skin.taxels().iter().step_by(7) {
                let spread_m = 1.2 * pressed.cell_m2.sqrt();
                let pressures: Vec<f64> = skin
                    .taxels()
                    .iter()
                    .map(|taxel| {
                        let near = taxel.mean_normal.dot(pressed.mean_normal) > 0.3 && taxel.link == pressed.link;
                        let away = taxel.position.distance(pressed.position) / spread_m;
                        if near && away < 2.0 { (-0.5 * away * away).exp() } else { 0.0 }
                    })
                    .collect();
                touches.step(Input { restarts: true, ..Input::new(0.0, &pressures[..]) }, &mut frame);
                let strongest = frame.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)).unwrap();
                let rest = body.links[strongest.link as usize].body_from_link;
                let position = rest.transform_point3(strongest.position);
                assert!(position.distance(pressed.position) < spread_m, "{name} {}", pressed.id);
                found += usize::from(frame.touches.len() == 1);
            }
            assert!(found * 10 >= 9 * skin.taxels().iter().step_by(7).count(), "{name}: {found}");
        }
    }
}
