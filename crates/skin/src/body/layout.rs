//! The layout's encoding in glTF: names of attributes and keys, and the JSON of fields.
//!
//! `docs/reference/layout.md` is the specification.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Largest taxel id: integers up to this one are exact as f32.
pub const MAX_TAXEL_ID: u32 = 1 << 24;

/// Version of the field JSON that is written, and the latest that is read.
pub(super) const VERSION: u32 = 1;

/// Key in a node's `extras` whose value is the field's JSON, as one string.
pub(super) const FIELD_KEY: &str = "somatic_field";

/// The attributes of a taxel primitive, without the underscore that glTF puts before custom names.
pub(super) const TAXEL_ID: &str = "TAXEL_ID";
pub(super) const NORMAL: [&str; 3] = ["NX", "NY", "NZ"];
/// The tangent of a taxel with three axes; absent where no taxel has one of its own.
pub(super) const TANGENT: [&str; 3] = ["TX", "TY", "TZ"];
pub(super) const AREA: &str = "AREA";
pub(super) const MODALITY: &str = "MODALITY";

/// The specification of a receptive field in a layout, without anchor and chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldSpec {
    /// Unique name; slashes (`hand/palm`) have no meaning.
    pub name: String,
    /// Name of the parent field. A parent holds all taxels of its descendants beside its own.
    pub parent: Option<String>,
    /// Its own members by taxel id.
    pub members: BTreeMap<u32, MemberSpec>,
    /// Its chart; by default a plane chart.
    pub chart: Option<ChartSpec>,
}

/// A member of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemberSpec {
    /// Weight w > 0 in every sum of the field.
    pub weight: f64,
    /// Chart coordinates (u, v) in metres, for charts that positions alone do not give.
    pub uv: Option<[f64; 2]>,
}

impl Default for MemberSpec {
    fn default() -> Self {
        Self { weight: 1.0, uv: None }
    }
}

/// The kind of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChartKind {
    /// Orthogonal projection on the tangent plane at the origin.
    Plane,
    /// Geodesic polar coordinates, stored in the layout: the shortest path on the surface from the origin.
    Geodesic,
    /// Unrolled by the normals of its taxels, stored in the layout: lengths are estimated from positions and normals, also where the
    /// surface has holes or consists of shells that do not meet.
    Normals,
    /// No chart.
    None,
}

impl ChartKind {
    /// Whether the layout stores (u, v) of such a chart.
    #[doc(hidden)]
    #[must_use]
    pub fn is_stored(self) -> bool {
        matches!(self, Self::Geodesic | Self::Normals)
    }
}

/// The chart specified in a layout.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChartSpec {
    /// The kind of chart.
    pub kind: ChartKind,
    /// Origin in the anchor's frame, m.
    #[serde(rename = "origin", skip_serializing_if = "Option::is_none")]
    pub origin_in_anchor: Option<[f64; 3]>,
    /// Direction of +u in the anchor's frame; its part along the normal is ignored.
    #[serde(rename = "u", skip_serializing_if = "Option::is_none")]
    pub u_in_anchor: Option<[f64; 3]>,
}

/// The JSON string under [`FIELD_KEY`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldJson {
    version: u32,
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    parent: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chart: Option<ChartSpec>,
    /// Taxel id → `[weight]` or `[weight, u, v]`.
    #[serde(default)]
    members: BTreeMap<String, Vec<f64>>,
}

impl FieldSpec {
    /// The same field with `ids` among its own members, new ones with weight 1. A parent needs this for a geodesic chart of
    /// its descendants' taxels.
    #[must_use]
    pub fn with_members(mut self, ids: impl IntoIterator<Item = u32>) -> Self {
        for id in ids {
            self.members.entry(id).or_default();
        }
        self
    }

    /// The field in the JSON string `text`.
    #[doc(hidden)]
    pub fn from_json(text: &str) -> Result<Self> {
        let bad = |what: String| Error::failed(what);
        let version = serde_json::from_str::<serde_json::Value>(text)
            .ok()
            .and_then(|value| value.get("version").and_then(serde_json::Value::as_u64));
        if let Some(version) = version.filter(|&v| v > u64::from(VERSION)) {
            return Err(bad(format!("layout version {version} is newer than this program; update it")));
        }
        let json: FieldJson =
            serde_json::from_str(text).map_err(|e| bad(format!("its JSON is not the JSON of a field: {e}")))?;
        if json.name.is_empty() {
            return Err(bad("a field has an empty name; give it one".into()));
        }
        let finite = |v: Option<[f64; 3]>| v.is_none_or(|v| v.iter().all(|x| x.is_finite()));
        if let Some(chart) = &json.chart
            && !(finite(chart.origin_in_anchor) && finite(chart.u_in_anchor))
        {
            return Err(bad("its chart has a number that is not finite".into()));
        }
        if let Some(chart) = &json.chart
            && chart.kind.is_stored()
            && (chart.origin_in_anchor.is_none() || chart.u_in_anchor.is_none())
        {
            return Err(bad("a geodesic chart needs its `origin` and `u`; lay it again".into()));
        }
        let mut members = BTreeMap::new();
        for (key, row) in json.members {
            let id: u32 =
                key.parse().map_err(|_| bad(format!("member `{key}` is not a taxel id; ids are whole numbers")))?;
            let (weight, uv) = match row[..] {
                [weight] => (weight, None),
                [weight, u, v] => (weight, Some([u, v])),
                _ => return Err(bad(format!("member {id} should be [weight] or [weight, u, v]"))),
            };
            if !(weight.is_finite() && (MIN_WEIGHT..=MAX_WEIGHT).contains(&weight)) {
                return Err(bad(format!(
                    "member {id} has weight {weight}; weights lie between {MIN_WEIGHT:e} and {MAX_WEIGHT:e}"
                )));
            }
            if uv.is_some_and(|uv| uv.iter().any(|x| !x.is_finite())) {
                return Err(bad(format!("member {id} has a chart coordinate that is not finite")));
            }
            if members.insert(id, MemberSpec { weight, uv }).is_some() {
                return Err(bad(format!("member {id} appears twice; give each taxel once")));
            }
        }
        Ok(Self { name: json.name, parent: json.parent, members, chart: json.chart })
    }

    /// The JSON string that [`FieldSpec::from_json`] reads back.
    #[doc(hidden)]
    pub fn to_json(&self) -> String {
        let json = FieldJson {
            version: VERSION,
            name: self.name.clone(),
            parent: self.parent.clone(),
            chart: self.chart,
            members: self
                .members
                .iter()
                .map(|(id, m)| {
                    let row = match m.uv {
                        Some([u, v]) => vec![m.weight, u, v],
                        None => vec![m.weight],
                    };
                    (id.to_string(), row)
                })
                .collect(),
        };
        serde_json::to_string(&json).expect("a field is plain data")
    }
}

/// Weights in this range keep products in single precision.
pub(super) const MIN_WEIGHT: f64 = 1.0 / 1_048_576.0;
pub(super) const MAX_WEIGHT: f64 = 1_048_576.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_survives_its_json() {
        let spec = FieldSpec {
            name: "hand/palm".into(),
            parent: Some("hand".into()),
            members: [(3, MemberSpec::default()), (12, MemberSpec { weight: 0.5, uv: Some([0.01, -0.02]) })].into(),
            chart: Some(ChartSpec {
                kind: ChartKind::Plane,
                origin_in_anchor: Some([0.0, 0.1, 0.2]),
                u_in_anchor: None,
            }),
        };
        assert_eq!(FieldSpec::from_json(&spec.to_json()).unwrap(), spec);
    }

    #[test]
    fn coordinates_come_back_to_the_last_bit() {
        // Numbers that a reader which rounds twice gets wrong are about one in four.
        let uv = |i: u32| [1.0 / f64::from(3 + i), -(f64::from(i) * 0.7).sin() * 0.05];
        let members = (0..1000).map(|id| (id, MemberSpec { weight: 1.0, uv: Some(uv(id)) })).collect();
        let spec = FieldSpec { name: "a".into(), members, ..FieldSpec::default() };
        assert_eq!(FieldSpec::from_json(&spec.to_json()).unwrap(), spec);
    }

    #[test]
    fn what_a_field_may_not_say_is_named() {
        let why = |text: &str| FieldSpec::from_json(text).unwrap_err().to_string();
        assert!(why(r#"{"version":1,"name":"a","members":{"x":[1]}}"#).contains("member `x`"));
        assert!(why(r#"{"version":1,"name":"a","members":{"3":[0]}}"#).contains("weight 0"));
        assert!(why(r#"{"version":1,"name":"a","members":{"3":[1,2]}}"#).contains("member 3"));
        assert!(why(r#"{"version":2,"name":"a"}"#).contains("newer"));
        assert!(why(r#"{"version":1,"nam":"a"}"#).contains("nam"));
        assert!(why(r#"{"version":1,"name":"a","chart":{"kind":"geodesic","u":[1,0,0]}}"#).contains("origin"));
    }
}
