//! A body as JSON.

use serde_json::{Map, Value, json};
use somatic::author::Finding;
use somatic::body::{Body, Modality};
use somatic::field::{Field, WORLD};
use somatic::internal::author::cell_spread;

use super::inspection::{Inspection, cells_of};

/// One object and a newline.
pub(super) fn text(seen: &Inspection) -> String {
    let Inspection { body, fields, .. } = seen;
    let link = |index: usize| body.links[index].name.as_str();
    let skin = seen.graph.skin(body);
    let taxel = |index: usize| {
        let taxel = &body.taxels[index];
        let node = skin.taxels().binary_search_by_key(&taxel.id, |node| node.id).ok().map(|node| &skin.taxels()[node]);
        let mean_normal =
            node.map(|node| skin.link_from_body(node.link).transform_vector3(node.mean_normal).to_array());
        let mut seen = json!({
            "id": taxel.id,
            "link": link(taxel.link),
            "position": taxel.position_in_link.to_array(),
            "normal": taxel.normal_in_link.to_array(),
            "area": taxel.area,
            "modality": taxel.modality.name(),
            "cell": node.map(|node| node.cell_m2),
            "mean_normal": mean_normal,
        });
        if taxel.modality == Modality::Force3 {
            seen["tangent"] = json!(taxel.tangents_in_link()[0].to_array());
        }
        seen
    };
    let mut whole = json!({
        "links": body.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>(),
        "taxels": (0..body.taxels.len()).map(taxel).collect::<Vec<_>>(),
        "fields": fields.iter().map(|f| field(body, fields, f)).collect::<Vec<_>>(),
        "findings": seen.findings,
        "lint": seen.odd.iter().map(finding).collect::<Vec<_>>(),
        "near_at_rest": seen.overlaps.iter().map(|overlap| json!({
            "links": overlap.links.map(link),
            "tolerance": overlap.tolerance_m,
            "nearest": overlap.nearest_m,
            "taxels": overlap.taxels.each_ref().map(|side| side.iter().map(|&index| body.taxels[index].id).collect::<Vec<_>>()),
            "facing": overlap.facing,
        })).collect::<Vec<_>>(),
        "coverage": {
            "links": seen.coverage.links.iter().map(|of| json!({
                "link": link(of.link), "area": of.area, "seen": of.seen,
            })).collect::<Vec<_>>(),
            "holes": seen.coverage.holes.iter().map(|hole| json!({
                "link": link(hole.link), "position": hole.position_in_link.to_array(), "area": hole.area,
            })).collect::<Vec<_>>(),
        },
    });
    if let Some([low, high]) = cell_spread(cells_of(body)) {
        whole["cells"] = json!({"p5": low, "p95": high});
    }
    if let Some(errors) = &seen.errors {
        whole["errors"] = errors[0].as_json_with_ideal(&errors[1]);
    }
    for (name, value) in seen.graph.json(body) {
        whole[name] = value;
    }
    format!("{whole}\n")
}

fn field(body: &Body, fields: &[Field], field: &Field) -> Value {
    let member = |member: &somatic::field::Member| {
        let mut object = Map::new();
        object.insert("taxel".into(), body.taxels[member.taxel].id.into());
        object.insert("weight".into(), member.weight.into());
        if field.chart.is_ok() {
            object.insert("uv".into(), json!([member.place.x, member.place.y]));
        }
        Value::Object(object)
    };
    let mut object = json!({
        "name": field.name,
        "parent": field.parent.map(|parent| fields[parent].name.as_str()),
        "anchor": field.anchor.map_or(WORLD, |anchor| body.links[anchor].name.as_str()),
        "members": field.members.iter().map(member).collect::<Vec<_>>(),
        "chart": field.chart.as_ref().ok().map(|chart| json!({
            "kind": chart.kind,
            "origin": field.origin_in_anchor.to_array(),
            "u": chart.u_in_anchor.to_array(),
            "v": chart.v_in_anchor.to_array(),
            "normal": chart.normal_in_anchor.to_array(),
            "distortion": chart.distortion,
            "distortion_rms": chart.distortion_rms,
        })),
    });
    if let Err(reason) = &field.chart {
        object["no_chart"] = reason.to_string().into();
    }
    object
}

fn finding(finding: &Finding) -> Value {
    json!({
        "kind": finding.kind,
        "taxels": finding.taxels,
        "fields": finding.fields,
        "worst": finding.worst,
        "unit": finding.kind.unit(),
        "place": finding.place,
        "links": finding.links.iter().map(|of| json!({"link": of.link, "taxels": of.taxels, "of": of.of})).collect::<Vec<_>>(),
        "what": finding.to_string(),
    })
}
