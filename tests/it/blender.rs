//! Bodies taken through a real Blender and back, untouched and edited. `tests/blender/run` sets it up; without it, in
//! `SOMATIC_BLENDER`, this is a skip.

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use serde_json::{Value, json};
use somatic::Body;
use somatic::author::{FindingKind, lint};
use somatic::body::{FieldSpec, MemberSpec, Taxel};
use somatic::field::FieldSet;
use somatic::internal::author::refresh;
use somatic::internal::body::{EdgeRow, Glb, StoredEdges};
use somatic::internal::field::TaxelGraph;
use tempfile::TempDir;

use crate::draft::Draft;
use crate::lint::{Plate, kinds};
use somatic_testing::skip;

/// Positions are current within this, m, and directions within this, rad; `docs/reference/layout.md` has them.
const NEAR_M: f64 = 1e-6;
const NEAR_RAD: f64 = 1e-5;

/// The Pythons that have a `bpy`, each with another Blender.
fn blenders() -> Vec<PathBuf> {
    let Some(list) = std::env::var_os("SOMATIC_BLENDER") else {
        skip("BLENDER", "no Blender; tests/blender/run installs one and runs this");
        return Vec::new();
    };
    std::env::split_paths(&list).collect()
}

fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bodies").join(name)
}

/// The file that Blender writes of `source` after `edit`, with the folder that it is in.
fn through(python: &Path, source: &Path, edit: &[&str]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("back.glb");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/blender/edit.py");
    let output = Command::new(python).arg(script).args([source, &target]).args(edit).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{edit:?}: {said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.lines().any(|line| line.starts_with("DID ")), "{edit:?}: {said}");
    (folder, target)
}

fn edited(python: &Path, source: &Path, edit: &[&str]) -> Body {
    let (_folder, target) = through(python, source, edit);
    Body::load(&target).unwrap()
}

/// Asserts that both have the same links, taxels and fields, but for what editors round.
fn assert_same(before: &Body, after: &Body) {
    assert_eq!(before.findings, after.findings);
    let links =
        |body: &Body| body.links.iter().map(|link| link.name.clone()).collect::<std::collections::BTreeSet<_>>();
    assert!(links(after).is_superset(&links(before)), "{:?}", links(after));
    assert_same_taxels(before, after, &[]);
    let fields = |body: &Body| {
        let mut fields = body.fields.clone();
        fields.sort_by(|a, b| a.name.cmp(&b.name));
        fields
    };
    assert_eq!(fields(before), fields(after));
}

/// Asserts that both have the same taxels, except for those in `except`.
fn assert_same_taxels(before: &Body, after: &Body, except: &[u32]) {
    let kept = |body: &'_ Body| body.taxels.iter().filter(|t| !except.contains(&t.id)).cloned().collect::<Vec<_>>();
    let (old, new) = (kept(before), kept(after));
    assert_eq!(old.len(), new.len());
    for (old, new) in old.iter().zip(&new) {
        assert_eq!((old.id, old.modality), (new.id, new.modality));
        assert_eq!(before.links[old.link].name, after.links[new.link].name, "taxel {}", old.id);
        let moved = old.position_in_link.distance(new.position_in_link);
        let turned = old.normal_in_link.cross(new.normal_in_link).length();
        assert!(moved < NEAR_M && turned < NEAR_RAD, "taxel {}: {moved} m, {turned} rad", old.id);
        assert!((old.area - new.area).abs() <= 1e-6 * old.area, "taxel {}", old.id);
        let tangents = [old.tangent_in_link, new.tangent_in_link];
        let turned = tangents[0].zip(tangents[1]).map(|(old, new)| old.distance(new));
        let is_same = turned.map_or(tangents == [None; 2], |by| by < NEAR_RAD);
        assert!(is_same, "taxel {}: tangents {tangents:?}", old.id);
    }
}

/// What `somatic run` says of `recording` on `body`.
fn percepts(body: &Path, recording: &Path) -> Option<String> {
    let Some(command) = option_env!("CARGO_BIN_EXE_somatic") else {
        skip("COMMAND", "percepts are compared where the command is built");
        return None;
    };
    let mut command = Command::new(command);
    command.arg("run").arg("--body").arg(body).arg("--source").arg(recording);
    let output = command.args(["--backend", "reference", "--all-fields", "--sink", "-"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}

/// Asserts that two percepts of the same name are the same, numbers within `near`.
fn assert_near(name: &str, a: &Value, b: &Value, near: f64) {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{name}");
            a.iter().zip(b).for_each(|(a, b)| assert_near(name, a, b, near));
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            // Angles just under π and just over 0 are near each other too.
            let off = (a - b).abs();
            let off = if name == "orientation" || name == "principal_axis" {
                off.min(std::f64::consts::PI - off)
            } else {
                off
            };
            assert!(off <= near, "{name}: {a} and {b}");
        }
        _ => assert_eq!(a, b, "{name}"),
    }
}

#[test]
fn a_rigid_body_comes_back_with_the_same_percepts() {
    for python in blenders() {
        let source = bundled("hand.glb");
        let (_folder, target) = through(&python, &source, &[]);
        assert_same(&Body::load(&source).unwrap(), &Body::load(&target).unwrap());
        let touch = bundled("touch.csv");
        let (before, after) = (percepts(&source, &touch), percepts(&target, &touch));
        assert!(before == after, "the hand's percepts are not the same to the byte");
    }
}

#[test]
fn a_body_with_every_kind_of_taxel_comes_back_with_the_same_percepts() {
    for python in blenders() {
        let source = bundled("sensing-hand.glb");
        let (_folder, target) = through(&python, &source, &[]);
        let before = Body::load(&source).unwrap();
        assert_eq!(before.taxels.iter().filter(|taxel| taxel.tangent_in_link.is_some()).count(), 29);
        assert_same(&before, &Body::load(&target).unwrap());
        let meeting = bundled("meeting.csv");
        let (before, after) = (percepts(&source, &meeting), percepts(&target, &meeting));
        assert!(before.as_ref().is_none_or(|text| text.contains("\"shear\":[") && text.contains("\"warmest\":")));
        assert!(before == after, "the hand's percepts are not the same to the byte");
    }
}

/// The body of the taxels of `before`, each link's below a node that is moved by `scale` and `turn`.
fn below_nodes(before: &Body, scale: DVec3, turn: DQuat) -> Body {
    let mut draft = Draft::default();
    for (index, link) in before.links.iter().enumerate() {
        let own: Vec<&Taxel> = before.taxels.iter().filter(|taxel| taxel.link == index).collect();
        let mut link = json!({"name": link.name});
        if !own.is_empty() {
            let points: Vec<[f32; 3]> = own.iter().map(|taxel| taxel.position_in_link.as_vec3().to_array()).collect();
            let mesh = draft.taxels(&points, &own.iter().map(|taxel| taxel.id as f32).collect::<Vec<_>>());
            let column =
                |value: &dyn Fn(&Taxel) -> f64| own.iter().map(|taxel| value(taxel) as f32).collect::<Vec<_>>();
            let mut columns = vec![("_MODALITY".to_owned(), column(&|taxel| taxel.modality.code().into()))];
            for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
                columns.push((format!("_N{name}"), column(&|taxel| taxel.normal_in_link[axis])));
                columns.push((format!("_T{name}"), column(&|taxel| taxel.tangent_in_link.map_or(0.0, |t| t[axis]))));
            }
            for (name, column) in columns {
                let column = draft.scalars(&column);
                draft.json["meshes"][mesh]["primitives"][0]["attributes"][name] = column.into();
            }
            let turn = turn.as_quat().to_array();
            link["children"] = json!([draft.node(json!({"mesh": mesh, "rotation": turn, "scale": scale.to_array()}))]);
        }
        draft.node(link);
    }
    draft.load().unwrap()
}

#[test]
fn tangents_come_back_from_what_is_written_and_turn_with_the_nodes_of_their_taxels() {
    let before = Body::load(bundled("sensing-hand.glb")).unwrap();
    let tangents = |body: &Body| body.taxels.iter().filter(|taxel| taxel.tangent_in_link.is_some()).count();
    let mut glb = Glb::new();
    for (index, link) in before.links.iter().enumerate() {
        let own: Vec<Taxel> = before.taxels.iter().filter(|taxel| taxel.link == index).cloned().collect();
        let link = glb.node(&link.name, None, DVec3::ZERO);
        if !own.is_empty() {
            glb.taxels("taxels", Some(link), &own, None);
        }
    }
    let written = Body::from_bytes("hand", &glb.to_bytes().unwrap()).unwrap();
    assert_same_taxels(&before, &written, &[]);
    assert_eq!((tangents(&before), tangents(&written)), (29, 29));
    // A turn, a mirror image and a stretch, as of objects that an editor has moved.
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.4, -1.1, 2.3);
    for scale in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(2.0, 0.5, 1.25)] {
        let moved = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::ZERO);
        let after = below_nodes(&before, scale, turn);
        assert_eq!((after.taxels.len(), tangents(&after)), (before.taxels.len(), 29));
        for (old, new) in before.taxels.iter().zip(&after.taxels) {
            assert_eq!((old.id, old.modality), (new.id, new.modality));
            let right = old.tangent_in_link.map(|tangent| moved.transform_vector3(tangent).normalize());
            let Some((right, found)) = right.zip(new.tangent_in_link) else {
                assert_eq!(right, new.tangent_in_link, "taxel {}", old.id);
                continue;
            };
            assert!(right.distance(found) < 1e-6, "taxel {}: {right} and {found}", old.id);
            assert!(found.dot(new.normal_in_link).abs() < 1e-6 && (found.length() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_skinned_body_comes_back_with_the_same_percepts() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("touch.csv");
    let ids: Vec<String> = (0..960).map(|id| id.to_string()).collect();
    let mut text = format!("t,{}\n", ids.join(","));
    for frame in 0..40_u32 {
        // A tenth of the skin, another in each frame, at pressures that repeat nowhere near.
        let row = (0..960_u32).map(|id| match (id * 7919 + frame * 104_729) % 1009 {
            low if low < 101 => (1 + (id * 31 + frame * 17) % 887).to_string(),
            _ => "0".to_owned(),
        });
        text += &format!("{:.2},{}\n", f64::from(frame) * 0.02, row.collect::<Vec<_>>().join(","));
    }
    std::fs::write(&recording, text).unwrap();
    for python in blenders() {
        let source = bundled("humanoid.glb");
        let (_folder, target) = through(&python, &source, &[]);
        assert_same(&Body::load(&source).unwrap(), &Body::load(&target).unwrap());
        let (Some(before), Some(after)) = (percepts(&source, &recording), percepts(&target, &recording)) else {
            return;
        };
        let (mut compared, mut doubtful) = (0, 0);
        assert_eq!(before.lines().count(), 40);
        assert_eq!(before.lines().count(), after.lines().count());
        for (before, after) in before.lines().zip(after.lines()) {
            let [before, after] = [before, after].map(|line| serde_json::from_str::<Value>(line).unwrap());
            let lists = [&before, &after].map(|frame| frame["fields"].as_array().unwrap());
            assert_eq!(lists[0].len(), lists[1].len());
            for (old, new) in lists[0].iter().zip(lists[1]) {
                let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
                assert_eq!(keys(old), keys(new));
                let tie = old["flags"].as_array().unwrap().contains(&"tie".into());
                for (name, value) in old.as_object().unwrap() {
                    // What is farthest may change where two are about as far: that is what the flag is for.
                    if name == "orientation" && tie {
                        doubtful += 1;
                        continue;
                    }
                    let near = match name.as_str() {
                        // Two places, 20 ms apart.
                        "speed" | "radial_speed" => 2.0 * NEAR_M / 0.02,
                        "displacement" | "distance" | "radial_distance" => 2.0 * NEAR_M,
                        "centroid" | "position" => NEAR_M,
                        "area" => 1e-6 * value.as_f64().unwrap(),
                        _ => NEAR_RAD,
                    };
                    assert_near(name, value, &new[name], near);
                    compared += 1;
                }
            }
        }
        assert!(compared > 10_000 && doubtful < compared / 100, "{compared} {doubtful}");
    }
}

#[test]
fn a_taxel_moved_in_blender_is_found_and_its_normal_worked_out_again() {
    for python in blenders() {
        // One on a finger, one on a skinned belly; the edit moves each by 3 mm along x.
        for (file, id) in [("hand.glb", 36), ("humanoid.glb", 5)] {
            let before = Body::load(bundled(file)).unwrap();
            let mut after = edited(&python, &bundled(file), &["move", &id.to_string()]);
            assert_same_taxels(&before, &after, &[id]);
            let taxel = |body: &Body| body.taxels[body.taxel_index(id).unwrap()].clone();
            let moved = taxel(&after).position_in_link.distance(taxel(&before).position_in_link);
            assert!((moved - 0.003).abs() < NEAR_M, "{moved}");
            let findings = lint(&after, &FieldSet::new(&after).unwrap().fields);
            let stale: Vec<_> = findings.iter().filter(|f| f.kind == FindingKind::StaleNormal).collect();
            assert_eq!(stale.iter().map(|f| &f.taxels[..]).collect::<Vec<_>>(), [[id]], "{findings:?}");
            let notes = refresh(&mut after);
            assert!(notes.iter().any(|note| note.contains("normals recomputed for 1 of")), "{notes:?}");
            assert!(!kinds(&after).contains(&FindingKind::StaleNormal));
        }
    }
}

#[test]
fn the_chart_of_a_taxel_moved_in_blender_is_laid_again() {
    for python in blenders() {
        let mut plate = Plate::flat();
        plate.geodesic();
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("plate.glb");
        plate.save(&source);
        let before = Body::load(&source).unwrap();
        assert_same(&before, &edited(&python, &source, &[]));
        let mut after = edited(&python, &source, &["move", "42"]);
        assert_eq!(kinds(&after), [FindingKind::StaleChart], "on a plane the normal stays");
        assert_eq!(refresh(&mut after), ["chart of field `plate` recomputed"]);
        let uv = |body: &Body, id: u32| body.fields[0].members[&id].uv.unwrap();
        for id in 0..100 {
            let ([u, v], [x, y]) = (uv(&after, id), uv(&before, id));
            let moved = if id == 42 { 0.003 } else { 0.0 };
            assert!((u - x - moved).abs() < NEAR_M && (v - y).abs() < NEAR_M, "taxel {id}");
        }
    }
}

#[test]
fn taxels_deleted_and_duplicated_in_blender_are_reported() {
    for python in blenders() {
        for file in ["hand.glb", "humanoid.glb"] {
            let before = Body::load(bundled(file)).unwrap();
            let after = edited(&python, &bundled(file), &["delete", "5"]);
            assert_eq!(after.taxels.len() + 1, before.taxels.len());
            assert_same_taxels(&before, &after, &[5]);
            let holding = before.fields.iter().filter(|field| field.members.contains_key(&5)).count();
            assert!(holding > 0 && after.findings.len() == holding, "{:?}", after.findings);
            assert!(after.findings.iter().all(|finding| finding.contains("names taxel 5")));
            assert!(FieldSet::new(&after).is_ok());

            let after = edited(&python, &bundled(file), &["duplicate", "5"]);
            let new = before.taxels.last().unwrap().id + 1;
            assert_eq!(after.taxels.len(), before.taxels.len() + 1);
            assert_same_taxels(&before, &after, &[new]);
            let copy = &after.taxels[after.taxel_index(new).unwrap()];
            let original = &after.taxels[after.taxel_index(5).unwrap()];
            assert!((copy.position_in_link.distance(original.position_in_link) - 0.003).abs() < NEAR_M);
            let [finding] = &after.findings[..] else { panic!("{:?}", after.findings) };
            assert!(finding.contains(&format!("is now {new}")), "{finding}");
        }
    }
}

#[test]
fn a_field_added_and_a_density_painted_in_blender_come_back() {
    for python in blenders() {
        let mut after = edited(&python, &bundled("hand.glb"), &["add_field", "4"]);
        let new = after.fields.iter().position(|field| field.name == "new").unwrap();
        let members = [(4, MemberSpec::default()), (5, MemberSpec { weight: 0.5, uv: None })].into();
        assert_eq!(after.fields.remove(new), FieldSpec { name: "new".into(), members, ..FieldSpec::default() });
        assert_same(&Body::load(bundled("hand.glb")).unwrap(), &after);

        let (_folder, target) = through(&python, &bundled("hand.glb"), &["paint", "0"]);
        assert_same(&Body::load(bundled("hand.glb")).unwrap(), &Body::load(&target).unwrap());
        let bytes = std::fs::read(&target).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let primitives = json["meshes"].as_array().unwrap().iter().map(|mesh| &mesh["primitives"][0]["attributes"]);
        let densities: Vec<&Value> = primitives.filter_map(|attributes| attributes.get("_DENSITY")).collect();
        assert_eq!(densities.len(), 5, "one a mesh");
        for accessor in densities {
            let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
            assert_eq!((&accessor["type"], &accessor["componentType"]), (&"SCALAR".into(), &5126.into()));
        }
    }
}

#[test]
fn edges_come_back_also_at_four_megabytes() {
    let row = |id: u32| (id, EdgeRow { lengths_m: f64::from(id) * 1e-6, to: vec![id + 1, id + 2, id + 400] });
    let edges = StoredEdges { rows: (1_000_000..1_085_000).map(row).collect(), ..StoredEdges::default() };
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("large.glb");
    let mut glb = Glb::new();
    glb.node("arm", None, DVec3::ZERO);
    glb.edges(&edges);
    let bytes = glb.to_bytes().unwrap();
    assert!(bytes.len() > 4_000_000, "{} bytes", bytes.len());
    std::fs::write(&source, bytes).unwrap();
    for python in blenders() {
        let after = edited(&python, &source, &[]);
        assert_eq!(after.edges.as_ref(), Some(&edges));
        // A bundled body's are current, and are not made anew.
        let after = edited(&python, &bundled("humanoid.glb"), &[]);
        assert!(after.edges.is_some());
        assert_eq!(TaxelGraph::from_body(&after).1, None);
    }
}

#[test]
fn options_left_off_are_named() {
    let cases: [(&str, &[&str]); 4] = [
        ("without_export_attributes", &["export_attributes"]),
        ("without_use_mesh_vertices", &["use_mesh_vertices"]),
        ("without_export_extras", &["export_extras"]),
        ("without", &["export_attributes", "use_mesh_vertices", "export_extras"]),
    ];
    for python in blenders() {
        for file in ["hand.glb", "humanoid.glb"] {
            for (edit, options) in cases {
                let body = edited(&python, &bundled(file), &[edit]);
                let finding = body.findings.first().unwrap_or_else(|| panic!("{file} {edit}: nothing is said"));
                assert!(options.iter().all(|option| finding.contains(option)), "{file} {edit}: {finding}");
            }
        }
    }
}
