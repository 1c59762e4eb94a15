//! The graph of a body's taxels, as it is reported.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use somatic::body::Body;
use somatic::internal::field::TaxelGraph;
use somatic::internal::touch::{Reading, Skin};

/// A taxel has fewer neighbours than this only at the edge of the skin.
const FEW: usize = 3;

/// Most islands that are named, and most ids.
const MAX_ISLANDS: usize = 6;
const MAX_IDS: usize = 8;

/// The graph, and what stands out in it.
pub(super) struct SkinGraph {
    graph: TaxelGraph,
    /// Indices of taxels, the largest first.
    islands: Vec<Vec<u32>>,
}

impl SkinGraph {
    pub(super) fn new(graph: TaxelGraph, body: &Body) -> Self {
        let islands = graph.islands(body);
        Self { graph, islands }
    }

    /// What touches are found in.
    pub(super) fn skin(&self, body: &Body) -> Skin {
        Skin::new(body, &self.graph, |_| Reading::default())
    }

    /// Ids of the pressure taxels with fewer than `number` neighbours, and at least `least`.
    fn with_fewer(&self, body: &Body, least: usize, number: usize) -> Vec<u32> {
        let mut taxels: Vec<u32> = self.islands.iter().flatten().copied().collect();
        taxels.retain(|&taxel| (least..number).contains(&self.graph.neighbours(taxel as usize).len()));
        taxels.sort_unstable();
        taxels.into_iter().map(|taxel| body.taxels[taxel as usize].id).collect()
    }

    /// Lines of the report, each with its name.
    pub(super) fn lines(&self, body: &Body) -> Vec<(&'static str, String)> {
        let taxels: usize = self.islands.iter().map(Vec::len).sum();
        if taxels == 0 {
            return Vec::new();
        }
        let edges = self.graph.edges().count();
        let mut text = format!("{edges} between neighbours, {:.1} a taxel", 2.0 * edges as f64 / taxels as f64);
        let (alone, few) = (self.with_fewer(body, 0, 1), self.with_fewer(body, 1, FEW));
        if !few.is_empty() {
            text += &format!("; fewer than {FEW} of {}", shown(&few));
        }
        let mut lines = vec![("edges", text)];
        let several: Vec<&Vec<u32>> = self.islands.iter().filter(|island| island.len() > 1).collect();
        if several.len() > 1 {
            let names: Vec<String> = several.iter().take(MAX_ISLANDS).map(|island| name(body, island)).collect();
            let more = several.len() - names.len();
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            lines.push(("islands", format!("{}: {}{more}", several.len(), names.join(", "))));
        }
        if !alone.is_empty() {
            lines.push(("alone", format!("{}, without an edge", shown(&alone))));
        }
        lines
    }

    /// Members of the JSON: edges by ids, islands, and taxels with few edges.
    pub(super) fn json(&self, body: &Body) -> [(&'static str, Value); 4] {
        let id = |taxel: u32| body.taxels[taxel as usize].id;
        let island = |island: &Vec<u32>| {
            let links: BTreeMap<&str, usize> = links_of(body, island);
            json!({"links": links, "taxels": island.iter().map(|&taxel| id(taxel)).collect::<Vec<u32>>()})
        };
        let several = self.islands.iter().filter(|island| island.len() > 1);
        [
            ("edges", self.graph.edges().map(|(a, b)| json!([id(a), id(b)])).collect()),
            ("islands", several.map(island).collect()),
            ("without_edge", self.with_fewer(body, 0, 1).into()),
            ("few_edges", self.with_fewer(body, 1, FEW).into()),
        ]
    }
}

fn shown(ids: &[u32]) -> String {
    let count = if ids.len() == 1 { "1 taxel".to_owned() } else { format!("{} taxels", ids.len()) };
    let first: Vec<String> = ids.iter().take(MAX_IDS).map(ToString::to_string).collect();
    let more = ids.len() - first.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{count} ({}{more})", first.join(", "))
}

/// Taxels of an island by the name of their link.
fn links_of<'a>(body: &'a Body, island: &[u32]) -> BTreeMap<&'a str, usize> {
    let mut links = BTreeMap::new();
    for &taxel in island {
        *links.entry(body.links[body.taxels[taxel as usize].link].name.as_str()).or_insert(0) += 1;
    }
    links
}

/// The link that most of the island's taxels are on, and their number.
fn name(body: &Body, island: &[u32]) -> String {
    let links = links_of(body, island);
    let most = links.iter().max_by_key(|(_, count)| **count).map_or("", |(name, _)| *name);
    let others = if links.len() > 1 { format!(" and {} more links", links.len() - 1) } else { String::new() };
    format!("`{most}`{others} {}", island.len())
}
