//! The edges of the taxels' graph as a layout stores them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Deserialize;

use super::layout::MAX_TAXEL_ID;
use crate::error::{Error, Result, failed};

/// Version of the JSON that is written, and the latest that is read.
const VERSION: u32 = 1;

/// Key in a node's `extras` whose value is the JSON of the edges, as one string.
pub(super) const EDGES_KEY: &str = "somatic_edges";

/// Edges between taxels. They are derived data, which is made anew where it is out of date.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoredEdges {
    /// Per taxel id its edges to higher ids; each taxel of the graph is there.
    pub rows: BTreeMap<u32, EdgeRow>,
    /// Sets of links, by name, that count as one skin, so that edges lead from one to the other where they meet at rest.
    pub joined: Vec<Vec<String>>,
}

/// The edges of a taxel to those with higher ids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EdgeRow {
    /// The sum of the straight distances between their ends at rest, m, rounded to 1 µm.
    pub lengths_m: f64,
    /// The other ends' ids, ascending.
    pub to: Vec<u32>,
}

/// The JSON string under [`EDGES_KEY`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EdgesJson {
    version: u32,
    #[serde(default)]
    joined: Vec<Vec<String>>,
    /// Taxel id → `[sum of lengths, higher ids…]`.
    edges: BTreeMap<String, Vec<f64>>,
}

impl StoredEdges {
    /// The edges in the JSON string `text`.
    #[doc(hidden)]
    pub fn from_json(text: &str) -> Result<Self> {
        let json: EdgesJson = serde_json::from_str(text).map_err(|e| failed!("they are not the JSON of edges: {e}"))?;
        if json.version > VERSION {
            return Err(failed!("their version {} is newer than this program", json.version));
        }
        let whole = |number: f64| {
            let is_id = (0.0..=f64::from(MAX_TAXEL_ID)).contains(&number) && number.fract() == 0.0;
            if is_id { Ok(number as u32) } else { Err(failed!("{number} is not a taxel id")) }
        };
        let mut rows = BTreeMap::new();
        for (key, row) in json.edges {
            let id: u32 = key.parse().map_err(|_| failed!("`{key}` is not a taxel id"))?;
            let Some((&lengths_m, to)) = row.split_first().filter(|(lengths, _)| lengths.is_finite()) else {
                return Err(failed!("taxel {id} has no sum of lengths"));
            };
            let to = to.iter().map(|&number| whole(number)).collect::<Result<Vec<u32>>>()?;
            if to.iter().any(|&other| other <= id) || !to.is_sorted_by(|a, b| a < b) {
                return Err(failed!("the edges of taxel {id} do not lead to higher ids in their order"));
            }
            if rows.insert(id, EdgeRow { lengths_m, to }).is_some() {
                return Err(failed!("taxel {id} appears twice"));
            }
        }
        Ok(Self { rows, joined: json.joined })
    }

    /// The JSON string that [`Self::from_json`] reads back.
    #[doc(hidden)]
    pub fn to_json(&self) -> String {
        let mut text = format!("{{\"version\":{VERSION},");
        if !self.joined.is_empty() {
            let _ = write!(text, "\"joined\":{},", serde_json::Value::from_iter(self.joined.iter().cloned()));
        }
        text += "\"edges\":{";
        for (number, (id, row)) in self.rows.iter().enumerate() {
            let separator = if number > 0 { "," } else { "" };
            let _ = write!(text, "{separator}\"{id}\":[{}", row.lengths_m);
            row.to.iter().for_each(|other| {
                let _ = write!(text, ",{other}");
            });
            text += "]";
        }
        text + "}}"
    }

    /// The edges in `texts`; a file should have one text. An error says why they cannot be used.
    pub(super) fn of_nodes<'a>(texts: impl Iterator<Item = &'a String>) -> Result<Option<Self>> {
        // Editors copy nodes.
        let texts: BTreeSet<&String> = texts.collect();
        match texts.len() {
            0 | 1 => texts.first().map(|text| Self::from_json(text)).transpose(),
            _ => Err(Error::failed("several nodes have different ones, as after joining files")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_survive_their_json() {
        let text = r#"{"version":1,"edges":{"7":[0.034512,8,300],"8":[0],"300":[0]}}"#;
        let edges = StoredEdges::from_json(text).unwrap();
        assert_eq!(edges.rows[&7], EdgeRow { lengths_m: 0.034512, to: vec![8, 300] });
        assert_eq!(edges.to_json(), text);
        assert_eq!(StoredEdges::default().to_json(), r#"{"version":1,"edges":{}}"#);
        let joined = r#"{"version":1,"joined":[["left \"arm\"","hand"],["a","b","c"]],"edges":{"7":[0]}}"#;
        assert_eq!(StoredEdges::from_json(joined).unwrap().to_json(), joined);
    }

    #[test]
    fn what_is_wrong_with_edges_is_named() {
        let why = |text: &str| StoredEdges::from_json(text).unwrap_err().to_string();
        assert!(why(r#"{"version":2,"edges":{}}"#).contains("newer"));
        assert!(why(r#"{"version":1,"edges":{"a":[0]}}"#).contains("`a`"));
        assert!(why(r#"{"version":1,"edges":{"1":[]}}"#).contains("no sum"));
        assert!(why(r#"{"version":1,"edges":{"1":[0.1,0.5]}}"#).contains("0.5"));
        assert!(why(r#"{"version":1,"edges":{"1":[0.1,1]}}"#).contains("higher"));
        assert!(why(r#"{"version":1,"edges":{"1":[0.1,5,3]}}"#).contains("order"));
        assert!(why(r#"{"version":1,"edges":{"1":[0],"01":[0]}}"#).contains("twice"));
        assert!(why("[]").contains("not the JSON of edges"));
        let two = [r#"{"version":1,"edges":{"1":[0]}}"#.to_owned(), r#"{"version":1,"edges":{"2":[0]}}"#.to_owned()];
        assert!(StoredEdges::of_nodes(two.iter()).unwrap_err().to_string().contains("several"));
        assert_eq!(StoredEdges::of_nodes([&two[0], &two[0]].into_iter()).unwrap().unwrap().rows.len(), 1);
        assert_eq!(StoredEdges::of_nodes([].into_iter()).unwrap(), None);
    }
}
