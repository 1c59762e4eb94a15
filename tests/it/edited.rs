//! Bodies as editors leave them: ids found twice, taxels deleted or moved, attributes not exported.

use glam::DVec3;
use serde_json::json;
use somatic::Body;
use somatic::author::{FindingKind, lint};
use somatic::body::MAX_TAXEL_ID;
use somatic::field::FieldSet;
use somatic::internal::author::refresh;
use somatic::internal::field::TaxelGraph;

use crate::draft::Draft;
use crate::lint::{Plate, kinds};

/// Taxels with `ids` in a row, and a field of each text.
fn row(ids: &[f32], fields: &[&str]) -> Draft {
    let mut draft = Draft::default();
    let points: Vec<[f32; 3]> = (0..ids.len()).map(|i| [0.01 * i as f32, 0.0, 0.0]).collect();
    let mesh = draft.taxels(&points, ids);
    draft.node(json!({"name": "arm", "mesh": mesh}));
    fields.iter().for_each(|field| {
        draft.field(field);
    });
    draft
}

fn ids(body: &Body) -> Vec<u32> {
    body.taxels.iter().map(|taxel| taxel.id).collect()
}

#[test]
fn an_id_found_twice_is_renumbered_and_said() {
    let field = r#"{"version":1,"name":"a","members":{"7":[1],"9":[1]}}"#;
    let body = row(&[9.0, 7.0, 7.0, 3.0, 7.0], &[field]).load().unwrap();
    assert_eq!(ids(&body), [3, 7, 9, 10, 11]);
    // The first in the file keeps its id, and the others come in their order.
    let x = |id: u32| body.taxels[body.taxel_index(id).unwrap()].position_in_link.x;
    assert!([(7, 0.01), (10, 0.02), (11, 0.04)].iter().all(|&(id, at)| (x(id) - at).abs() < 1e-8));
    assert_eq!(body.fields[0].members.keys().copied().collect::<Vec<_>>(), [7, 9]);
    let [finding] = &body.findings[..] else { panic!("{:?}", body.findings) };
    for words in ["2 taxels", "7 on link `arm` is now 10", "is now 11", "in no field"] {
        assert!(finding.contains(words), "{words}: {finding}");
    }
    assert!(row(&[9.0, 7.0, 3.0], &[]).load().unwrap().findings.is_empty(), "nothing is twice here");

    let most = MAX_TAXEL_ID as f32;
    assert_eq!(ids(&row(&[most, 0.0, most, 2.0], &[]).load().unwrap()), [0, 1, 2, MAX_TAXEL_ID]);
}

#[test]
fn members_whose_taxels_are_gone_are_left_out_and_said() {
    let field = r#"{"version":1,"name":"a","members":{"1":[1],"2":[0.5],"8":[1]}}"#;
    let body = row(&[1.0, 2.0], &[field]).load().unwrap();
    assert_eq!(body.fields[0].members.keys().copied().collect::<Vec<_>>(), [1, 2]);
    assert_eq!(body.fields[0].members[&2].weight, 0.5);
    assert!(body.findings[0].contains("field `a` names taxel 8"), "{:?}", body.findings);
    // A field that loses all of them cannot be run, and says that.
    let body = row(&[1.0], &[r#"{"version":1,"name":"a","members":{"8":[1]}}"#]).load().unwrap();
    assert!(FieldSet::new(&body).unwrap_err().to_string().contains("field `a` has no taxels"));
}

#[test]
fn edges_of_a_file_are_used_while_they_are_current_and_no_damage_of_them_is_an_error() {
    let load = |edges: &[serde_json::Value]| {
        let mut draft = row(&[1.0, 2.0, 3.0], &[r#"{"version":1,"name":"a","members":{"1":[1]}}"#]);
        for edges in edges {
            draft.node(json!({"name": "edges", "extras": {"somatic_edges": edges}}));
        }
        draft.load().unwrap()
    };
    let pairs = |body: &Body| TaxelGraph::from_body(body).0.edges().collect::<Vec<_>>();
    let current = r#"{"version":1,"edges":{"1":[0.03,2,3],"2":[0],"3":[0]}}"#;
    for edges in [&[json!(current)][..], &[json!(current), json!(current)]] {
        let body = load(edges);
        assert_eq!((body.links.len(), body.findings.len()), (1, 0), "{:?}", body.findings);
        assert_eq!((pairs(&body), TaxelGraph::from_body(&body).1), (vec![(0, 1), (0, 2)], None));
    }
    // What is made without them: each taxel in the row and the next.
    let made = vec![(0, 1), (1, 2)];
    assert_eq!(pairs(&load(&[])), made);
    for outdated in [
        r#"{"version":1,"edges":{"1":[0.03,2,3],"2":[0]}}"#,
        r#"{"version":1,"edges":{"1":[0.03,2,3],"2":[0],"3":[0],"4":[0]}}"#,
        r#"{"version":1,"edges":{"1":[0.0301,2,3],"2":[0],"3":[0]}}"#,
    ] {
        let body = load(&[json!(outdated)]);
        assert!(TaxelGraph::from_body(&body).1.unwrap().contains("made anew"));
        assert_eq!((pairs(&body), body.findings.len()), (made.clone(), 0));
    }
    let other = json!(current.replace("0.03", "0.04"));
    for damaged in [vec![json!("{")], vec![json!(7)], vec![json!({"version": 1})], vec![json!(current), other]] {
        let body = load(&damaged);
        assert!(body.findings[0].contains("edges between taxels"), "{:?}", body.findings);
        assert_eq!((pairs(&body), body.links.len()), (made.clone(), 1));
    }
}

#[test]
fn options_that_were_off_in_blender_are_named() {
    const FIELD: &str = r#"{"version":1,"name":"a","members":{"1":[1]}}"#;
    let finding = |draft: &Draft| draft.load().unwrap().findings.first().cloned().unwrap_or_default();
    let blender = |mut draft: Draft| {
        draft.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
        draft
    };
    let bare = |points: bool| {
        let mut draft = Draft::default();
        if points {
            let place = draft.points(&[[0.0; 3]]);
            let mesh = draft.mesh(&json!({"mode": 0, "attributes": {"POSITION": place}}));
            draft.node(json!({"name": "arm", "mesh": mesh}));
        } else {
            draft.node(json!({"name": "arm"}));
        }
        draft
    };
    let names =
        |text: &str| ["export_attributes", "use_mesh_vertices", "export_extras"].map(|option| text.contains(option));
    // Without attributes the points are there, but are no taxels; without loose points there is nothing.
    let mut points = bare(true);
    points.field(FIELD);
    assert_eq!(names(&finding(&points)), [true, false, false]);
    let mut nothing = bare(false);
    nothing.field(FIELD);
    assert_eq!(names(&finding(&nothing)), [true, true, false]);
    assert_eq!(names(&finding(&blender(row(&[1.0], &[])))), [false, false, true]);
    assert_eq!(names(&finding(&blender(bare(false)))), [true, true, true]);
    // Nothing is missing, or nothing says that it comes from Blender.
    assert_eq!(finding(&blender(row(&[1.0], &[FIELD]))), "");
    assert_eq!(finding(&row(&[1.0], &[])), "");
}

#[test]
fn a_taxel_that_was_moved_is_found_and_its_normal_and_uv_worked_out_again() {
    // On a ridge, whose sides rise at 45°: taxel 5 of the left side is moved over to the right.
    let mut plate = Plate::ridge();
    plate.geodesic();
    let sound = plate.body();
    assert_eq!(kinds(&sound), []);
    let before = sound.fields[0].clone();
    let mut same = sound.clone();
    assert_eq!(refresh(&mut same), Vec::<String>::new());
    assert_eq!((same.taxels, &same.fields), (sound.taxels.clone(), &sound.fields), "what is current keeps its bits");

    let moved = plate.taxels.iter_mut().find(|taxel| taxel.position_in_link.x < -0.02).unwrap();
    let id = moved.id;
    moved.position_in_link.x *= -1.0;
    moved.position_in_link.y += 0.003;
    let mut body = plate.body();
    let findings = lint(&body, &FieldSet::new(&body).unwrap().fields);
    assert_eq!(
        findings.iter().map(|f| f.kind).collect::<Vec<_>>(),
        [FindingKind::StaleNormal, FindingKind::StaleChart]
    );
    assert_eq!((&findings[0].taxels[..], &findings[1].fields[..]), (&[id][..], &["ridge".to_owned()][..]));
    assert!((findings[0].worst.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{findings:?}");

    let notes = refresh(&mut body);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert_eq!(kinds(&body), []);
    let taxel = &body.taxels[body.taxel_index(id).unwrap()];
    assert!((taxel.normal_in_link - DVec3::new(0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt())).length() < 1e-6);
    for (other, member) in &body.fields[0].members {
        let ([u, v], [x, y]) = (member.uv.unwrap(), before.members[other].uv.unwrap());
        // A ridge unrolls to a plane, on which x is √2 times as far as seen from above.
        assert_eq!((u - x).abs() > 1e-6, *other == id, "taxel {other}: {u} {x}");
        assert!(*other == id || (v - y).abs() < 1e-6);
    }
    // The surface is a plate of 45° from both sides, so that it is known where it must lie now.
    let [u, v] = body.fields[0].members[&id].uv.unwrap();
    let [x, y] = before.members[&id].uv.unwrap();
    assert!((u + x).abs() < 1e-6 && (v - y - 0.003).abs() < 1e-6, "{u} {x} {v} {y}");
}
