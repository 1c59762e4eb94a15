//! Rules make fields: which taxels go together on a surface, what they are called, which charts they get.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use somatic::body::{ChartKind, FieldSpec, Modality, Taxel};
use somatic::field::{FieldSet, NoChart};
use somatic::internal::author::group::{FieldRule, Grouping, MAX_PLANE_DISTORTION, Painted, group};
use somatic::internal::author::place_evenly;
use somatic::internal::body::{Glb, MeshData};
use somatic::{Body, Result, bundled};

use crate::common::meshes;

#[derive(serde::Deserialize)]
struct Recipe {
    #[serde(default)]
    fields: Vec<FieldRule>,
}

fn rules(text: &str) -> Vec<FieldRule> {
    toml::from_str::<Recipe>(text).unwrap().fields
}

fn grouped(body: &Body, text: &str) -> Result<Grouping> {
    group(body, &(), &rules(text))
}

fn why(body: &Body, text: &str) -> String {
    grouped(body, text).unwrap_err().to_string()
}

fn field<'a>(grouping: &'a Grouping, name: &str) -> &'a FieldSpec {
    let found = grouping.fields.iter().find(|field| field.name == name);
    found.unwrap_or_else(|| panic!("{name} among {:?}", names(grouping)))
}

fn names(grouping: &Grouping) -> Vec<&str> {
    grouping.fields.iter().map(|field| field.name.as_str()).collect()
}

fn ids(field: &FieldSpec) -> Vec<u32> {
    field.members.keys().copied().collect()
}

/// The body with the fields that were made, as its file would have it.
fn complete(body: &Body, grouping: &Grouping) -> FieldSet {
    FieldSet::new(&Body { fields: grouping.fields.clone(), ..body.clone() }).unwrap()
}

fn body(meshes: &[(&str, &MeshData)], taxels: &[Taxel]) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("limb", None, DVec3::ZERO);
    for (name, mesh) in meshes {
        let node = glb.node(name, Some(link), DVec3::ZERO);
        glb.mesh(node, name, mesh, None, None);
    }
    glb.taxels("taxels", Some(link), taxels, None);
    Body::from_bytes("limb", &glb.to_bytes().unwrap()).unwrap()
}

fn taxel(id: u32, position_in_link: DVec3, normal_in_link: DVec3) -> Taxel {
    Taxel {
        id,
        link: 0,
        position_in_link,
        normal_in_link,
        area: 1e-5,
        modality: Modality::Pressure,
        tangent_in_link: None,
    }
}

/// Squares of 2 mm in the plane y = 0, looking up, where `is_there` (of their columns and rows); a taxel in every second.
fn plate(columns: u32, rows: u32, is_there: impl Fn(u32, u32) -> bool) -> Body {
    let mut mesh = MeshData::default();
    let mut taxels = Vec::new();
    let at = |column: f64, row: f64| DVec3::new(column * 2e-3, 0.0, row * 2e-3);
    for row in 0..=rows {
        for column in 0..=columns {
            mesh.positions.push(at(column.into(), row.into()).as_vec3().to_array());
            mesh.normals.push([0.0, 1.0, 0.0]);
        }
    }
    for row in 0..rows {
        for column in (0..columns).filter(|&column| is_there(column, row)) {
            let a = row * (columns + 1) + column;
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
            if row % 2 == 0 && column % 2 == 0 {
                let middle = at(f64::from(column) + 0.5, f64::from(row) + 0.5);
                taxels.push(taxel(taxels.len() as u32, middle, DVec3::Y));
            }
        }
    }
    body(&[("plate", &mesh)], &taxels)
}

const RADIUS: f64 = 0.02;

/// A tube around the y axis, open at its ends, 120 mm long, with `around` × `along` taxels.
fn tube(around: u32, along: u32) -> Body {
    let (mut mesh, facets, rows) = (MeshData::default(), 96_u32, 24_u32);
    for row in 0..=rows {
        for facet in 0..=facets {
            let (sin, cos) = (f64::from(facet % facets) / f64::from(facets) * TAU).sin_cos();
            let y = f64::from(row) / f64::from(rows) * 0.12;
            mesh.positions.push([RADIUS * sin, y, RADIUS * cos].map(|x| x as f32));
            mesh.normals.push([sin, 0.0, cos].map(|x| x as f32));
        }
    }
    for row in 0..rows {
        for facet in 0..facets {
            let a = row * (facets + 1) + facet;
            let (b, c, d) = (a + 1, a + facets + 2, a + facets + 1);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let places = (0..along).flat_map(|row| (0..around).map(move |step| (row, step)));
    let taxels = places.zip(0..).map(|((row, step), id)| {
        let (sin, cos) = ((f64::from(step) + 0.25) / f64::from(around) * TAU).sin_cos();
        let normal = DVec3::new(sin, 0.0, cos);
        taxel(id, normal * RADIUS + DVec3::Y * (0.12 * (f64::from(row) + 0.5) / f64::from(along)), normal)
    });
    body(&[("tube", &mesh)], &taxels.collect::<Vec<_>>())
}

#[test]
fn without_rules_there_is_a_field_for_each_link() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    let grouping = grouped(&body, "").unwrap();
    let links: BTreeSet<&str> = body.taxels.iter().map(|taxel| body.links[taxel.link].name.as_str()).collect();
    let whole = |name: &&str| !name.contains('/');
    assert_eq!(names(&grouping).into_iter().filter(whole).collect::<BTreeSet<_>>(), links);
    let held: BTreeSet<u32> = grouping.fields.iter().flat_map(|field| field.members.keys().copied()).collect();
    assert_eq!(held.len(), body.taxels.len());
    // Limbs go all the way round and have no chart; the patches below them have one each.
    let complete = complete(&body, &grouping);
    let is_lowest = |index: usize| complete.fields.iter().all(|field| field.parent != Some(index));
    for (index, field) in complete.fields.iter().enumerate().filter(|(index, _)| is_lowest(*index)) {
        assert!(field.chart.is_ok() && field.members.len() < 30, "{} {index}: {:?}", field.name, grouping.notes);
    }
}

#[test]
fn patches_go_by_the_way_over_the_surface() {
    // Two prongs 20 mm wide and 100 mm long, 4 mm apart, on a bar that joins them: a tuning fork.
    let fork = plate(22, 60, |column, row| row < 10 || !(10..12).contains(&column));
    let x = |id: u32| fork.taxels[id as usize].position_in_link.x;
    let z = |id: u32| fork.taxels[id as usize].position_in_link.z;
    let spans = |patch: &[u32]| {
        let on = |side: fn(f64) -> bool| patch.iter().any(|&id| z(id) > 0.04 && side(x(id)));
        on(|x| x < 0.022) && on(|x| x > 0.022)
    };
    let grouping = grouped(&fork, "[[fields]]\nname = \"fork\"\npatches = 5").unwrap();
    assert_eq!(grouping.fields.len(), 6, "{:?}", names(&grouping));
    for patch in &grouping.fields[1..] {
        assert!(!spans(&ids(patch)), "{} is on both prongs", patch.name);
        assert!(!patch.members.is_empty(), "{}", patch.name);
    }
    let held: usize = grouping.fields[1..].iter().map(|patch| patch.members.len()).sum();
    assert_eq!(held, fork.taxels.len());
    // Without the gap, what is as far up is near, and a patch is on both sides.
    let whole = grouped(&plate(22, 60, |_, _| true), "[[fields]]\nname = \"fork\"\npatches = 5").unwrap();
    let whole_spans = |patch: &FieldSpec| {
        let sheet = plate(22, 60, |_, _| true);
        let far = |side: fn(f64) -> bool| {
            ids(patch).iter().map(|&id| sheet.taxels[id as usize].position_in_link).any(|p| p.z > 0.04 && side(p.x))
        };
        far(|x| x < 0.022) && far(|x| x > 0.022)
    };
    assert!(whole.fields[1..].iter().any(whole_spans));

    // The same again, and about this many a patch.
    assert_eq!(grouped(&fork, "[[fields]]\nname = \"fork\"\npatches = 5").unwrap().fields, grouping.fields);
    let of = grouped(&fork, "[[fields]]\npatches = { of = 20 }\nstem = \"spot\"").unwrap();
    assert_eq!(of.fields.len(), fork.taxels.len().div_ceil(20));
    assert_eq!(of.fields[0].name, "spot_01");
    // More than there are taxels, and on parts that do not hang together.
    let most = grouped(&fork, "[[fields]]\npatches = 9999").unwrap();
    assert!(most.fields.len() == fork.taxels.len() && most.notes[0].contains("instead of 9999"), "{:?}", most.notes);
    let parted = plate(22, 20, |column, _| !(10..12).contains(&column));
    let two = grouped(&parted, "[[fields]]\npatches = 1").unwrap();
    assert!(two.fields.len() == 2 && two.notes[0].contains("2 patches instead of 1"), "{:?}", two.notes);
}

/// A part of a limb of 40 mm, 132° around it, in strips that do not meet: nine taxels in each.
fn strips() -> Body {
    let (radius, half_gap) = (0.04, 0.01);
    let at = |turn: f64, along: f64| DVec3::new(radius * turn.sin(), along, radius * turn.cos());
    let (mut meshes, mut taxels) = (Vec::new(), Vec::new());
    for strip in 0..6_u32 {
        let middle = (f64::from(strip) - 2.5) * 0.38;
        let turns = [-1.0, 0.0, 1.0].map(|side| middle + side * (0.19 - half_gap));
        let positions: Vec<DVec3> = turns.iter().flat_map(|&turn| [at(turn, -0.03), at(turn, 0.03)]).collect();
        meshes.push(MeshData {
            normals: positions.iter().map(|p| [(p.x / radius) as f32, 0.0, (p.z / radius) as f32]).collect(),
            positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
            triangles: (0..2_u32)
                .flat_map(|q| [[2 * q, 2 * q + 2, 2 * q + 3], [2 * q, 2 * q + 3, 2 * q + 1]])
                .collect(),
            skinning: None,
        });
        taxels.extend((0..3_u32).flat_map(|column| (0..3_u32).map(move |row| (column, row))).map(|(column, row)| {
            let turn = middle + 0.12 * (f64::from(column) - 1.0);
            let id = 9 * strip + 3 * column + row;
            taxel(id, at(turn, 0.01 * (f64::from(row) - 1.0)), DVec3::new(turn.sin(), 0.0, turn.cos()))
        }));
    }
    let names: Vec<String> = (0..6).map(|strip| format!("strip {strip}")).collect();
    body(&names.iter().map(String::as_str).zip(&meshes).collect::<Vec<_>>(), &taxels)
}

#[test]
fn patches_go_over_shells_that_do_not_meet_and_have_charts_by_normals() {
    let body = strips();
    let made =
        grouped(&body, "[[fields]]\nname = \"limb\"\npatches = { of = 27, even = true }\nwrap = \"split\"").unwrap();
    let set = complete(&body, &made);
    let patches: Vec<_> = set.fields.iter().filter(|field| field.name != "limb").collect();
    assert_eq!(patches.iter().map(|patch| patch.members.len()).collect::<Vec<_>>(), [27, 27], "{:?}", made.notes);
    for patch in &patches {
        // Half of the limb is no worse in a plane than most fields.
        assert!(patch.chart.as_ref().unwrap().distortion < 0.2);
    }
    // All of it is too bent for a plane, and no way over the surface leads from strip to strip.
    let made = grouped(&body, "[[fields]]\nname = \"limb\"\nchart = \"auto\"").unwrap();
    assert_eq!(field(&made, "limb").chart.unwrap().kind, ChartKind::Normals, "{:?}", made.notes);
    let set = complete(&body, &made);
    let limb = &set.fields[0];
    assert!(limb.chart.as_ref().unwrap().distortion < 1e-6);
    for (a, b) in limb.members.iter().zip(&limb.members[1..]) {
        let turn = |taxel: usize| body.taxels[taxel].position_in_link.x.atan2(body.taxels[taxel].position_in_link.z);
        let right = 0.04 * (turn(b.taxel) - turn(a.taxel)).abs();
        assert!(((b.place - a.place).x.abs() - right).abs() < 1e-6, "an arc is as long as it is");
    }
    assert!(why(&body, "[[fields]]\nname = \"limb\"\nchart = \"geodesic\"").contains("no path on the surface"));
    let asked = grouped(&body, "[[fields]]\nname = \"limb\"\nchart = \"normals\"").unwrap();
    assert_eq!(field(&asked, "limb").members, field(&made, "limb").members);
    let around = why(&tube(24, 3), "[[fields]]\nname = \"tube\"\nchart = \"normals\"");
    assert!(around.contains("over the limit of 120°"), "{around}");
}

#[test]
fn discs_hold_what_is_within_their_radius_and_overlap_as_asked() {
    let sheet = plate(40, 40, |_, _| true);
    let at = |id: u32| sheet.taxels[id as usize].position_in_link;
    let within = |centre: DVec3, radius: f64| -> Vec<u32> {
        (0..sheet.taxels.len() as u32).filter(|&id| at(id).distance(centre) <= radius).collect()
    };
    // At ids, at points, at the middles of fields.
    let grouping = grouped(&sheet, "[[fields]]\nseeds = [27, \"210..=211\"]\nradius = \"11 mm\"").unwrap();
    assert_eq!(names(&grouping), ["disc_01", "disc_02", "disc_03"]);
    for (field, seed) in grouping.fields.iter().zip([27, 210, 211]) {
        assert_eq!(ids(field), within(at(seed), 0.011));
    }
    let point = DVec3::new(0.0313, 0.0, 0.0287);
    let text = format!("[[fields]]\nseeds = [[{}, 0.001, {}]]\nradius = 0.01", point.x, point.z);
    assert_eq!(ids(&grouped(&sheet, &text).unwrap().fields[0]), within(point, 0.01));
    let middles =
        "[[fields]]\nname = \"a\"\ntaxels = [\"0..=19\"]\n[[fields]]\nname = \"b\"\nradius = 0.01\nseeds = \"a\"";
    let grouping = grouped(&sheet, middles).unwrap();
    assert_eq!(ids(field(&grouping, "b/disc_01")), within(at(9), 0.01));

    // Spread, so that neighbours share half of their width: no taxel is left out, none of two seeds nearer than that.
    let grouping = grouped(&sheet, "[[fields]]\nname = \"s\"\nradius = \"12 mm\"\noverlap = 0.5").unwrap();
    assert!(grouping.notes.is_empty(), "{:?}", grouping.notes);
    let held: BTreeSet<u32> = grouping.fields.iter().flat_map(ids).collect();
    assert_eq!(held.len(), sheet.taxels.len());
    let discs: Vec<BTreeSet<u32>> = grouping.fields[1..].iter().map(|disc| ids(disc).into_iter().collect()).collect();
    for (i, disc) in discs.iter().enumerate() {
        let shares = discs.iter().enumerate().any(|(j, other)| i != j && !disc.is_disjoint(other));
        assert!(shares, "disc {i} overlaps none");
    }
    let apart = grouped(&sheet, "[[fields]]\nradius = \"12 mm\"\noverlap = 0").unwrap();
    assert!(apart.fields.len() * 2 < grouping.fields.len());
    assert!(apart.notes[0].contains("in no disc"), "{:?}", apart.notes);
    let members: Vec<u32> = apart.fields.iter().flat_map(ids).collect();
    assert_eq!(members.iter().collect::<BTreeSet<_>>().len(), members.len(), "none of them overlap");

    // As wide as makes them overlap: seeds 20 mm apart that share a fifth of their width have a radius of 12.5 mm.
    let grouping = grouped(&sheet, "[[fields]]\nseeds = [210, 215]\noverlap = 0.2").unwrap();
    assert!((at(210).distance(at(215)) - 0.02).abs() < 1e-9);
    assert_eq!(ids(&grouping.fields[0]), within(at(210), 0.0125));

    // Across the gap of a fork nothing is near.
    let fork = plate(22, 60, |column, row| row < 10 || !(10..12).contains(&column));
    let tip = fork.taxels.iter().find(|t| t.position_in_link.z > 0.11 && t.position_in_link.x > 0.015).unwrap();
    let disc = grouped(&fork, &format!("[[fields]]\nseeds = [{}]\nradius = 0.03", tip.id)).unwrap();
    assert!(ids(&disc.fields[0]).iter().all(|&id| fork.taxels[id as usize].position_in_link.x < 0.02));
}

#[test]
fn rows_and_columns_go_by_ids() {
    let mat = Body::from_bytes("mat", bundled::MAT).unwrap();
    let text = "[[fields]]\nname = \"mat\"\nrows = { of = 32 }\n[[fields]]\nname = \"across\"\ncolumns = { of = 32 }\n\
                [[fields]]\nname = \"block\"\ntaxels = [\"100..=400\"]\nrows = { of = 4, first = 96, stride = 32 }";
    let grouping = grouped(&mat, text).unwrap();
    assert_eq!(ids(field(&grouping, "mat/row_03")), (64..96).collect::<Vec<_>>());
    assert_eq!(ids(field(&grouping, "across/column_32")), (0..64).map(|row| 32 * row + 31).collect::<Vec<_>>());
    // The first row of the block is not among its taxels, and keeps its number all the same.
    assert_eq!(ids(field(&grouping, "block/row_02")), (128..132).collect::<Vec<_>>());
    assert!(!names(&grouping).contains(&"block/row_01"));
    assert!(field(&grouping, "mat").members.is_empty(), "it holds what is below it");
    let complete = complete(&mat, &grouping);
    assert_eq!(complete.fields[0].members.len(), mat.taxels.len());
    assert!(complete.fields.iter().all(|field| field.chart.as_ref().is_ok_and(|chart| chart.kind == ChartKind::Plane)));
}

#[test]
fn fields_nest_and_overlap_at_once() {
    let sheet = plate(40, 40, |_, _| true);
    let text = r#"
        [[fields]]
        name = "left_arm/forearm"
        patches = 4
        [[fields]]
        within = "left_arm/forearm/top_*"
        radius = "9 mm"
        overlap = 0.5
        [[fields]]
        name = "left_arm/spot"
        taxels = [3, "10..=20"]
        weight = 0.5
        [[fields]]
        within = "left_arm/forearm/top_[34]"
        name = "core"
        taxels = ["0..=200"]
    "#;
    let grouping = grouped(&sheet, text).unwrap();
    let spot = field(&grouping, "left_arm/spot");
    assert_eq!(ids(spot), [3].into_iter().chain(10..=20).collect::<Vec<_>>());
    assert!(spot.members.values().all(|member| member.weight == 0.5));
    assert_eq!(field(&grouping, "left_arm/forearm/top_1").parent.as_deref(), Some("left_arm/forearm"));
    assert_eq!(field(&grouping, "left_arm/forearm").parent.as_deref(), Some("left_arm"));
    assert_eq!(field(&grouping, "left_arm").parent, None);
    let patch: BTreeSet<u32> = ids(field(&grouping, "left_arm/forearm/top_2")).into_iter().collect();
    let disc = field(&grouping, "left_arm/forearm/top_2/disc_01");
    assert!(ids(disc).iter().all(|id| patch.contains(id)));
    assert!(ids(field(&grouping, "left_arm/forearm/top_4/core")).iter().all(|&id| id <= 200));
    // Every parent comes before its children, and all of it is what a file can hold.
    let mut seen = BTreeSet::new();
    for field in &grouping.fields {
        assert!(field.parent.as_ref().is_none_or(|parent| seen.contains(parent)), "{}", field.name);
        assert!(seen.insert(field.name.clone()));
    }
    let complete = complete(&sheet, &grouping);
    assert_eq!(complete.fields[0].members.len(), sheet.taxels.len());
}

#[test]
fn a_parent_is_named_without_a_longer_name() {
    let sheet = plate(20, 20, |_, _| true);
    let text = "[[fields]]\nname = \"arm/fore\"\nparent = \"body/skin\"\npatches = 2\n\
                [[fields]]\nname = \"arm\"\ntaxels = [1]\n\
                [[fields]]\nname = \"leg\"\nparent = \"body/skin\"\ntaxels = [\"50..=60\"]";
    let grouping = grouped(&sheet, text).unwrap();
    let parent = |name: &str| field(&grouping, name).parent.as_deref();
    assert_eq!(names(&grouping)[..3], ["body", "body/skin", "arm"]);
    assert_eq!([parent("body"), parent("body/skin")], [None, Some("body")]);
    // A rule that makes a level a field of its own leaves it where it stands.
    assert_eq!([parent("arm"), parent("leg"), parent("arm/fore")], [Some("body/skin"), Some("body/skin"), Some("arm")]);
    assert_eq!(complete(&sheet, &grouping).fields[0].members.len(), sheet.taxels.len());
    let again = "[[fields]]\nname = \"arm/fore\"\nparent = \"body\"\n[[fields]]\nname = \"arm/aft\"\nparent = \"bode\"";
    assert!(why(&sheet, again).contains("field rule 2: `parent`: `arm` is below `body`"), "{}", why(&sheet, again));
    assert!(why(&sheet, "[[fields]]\nname = \"a/b\"\nparent = \"a\"").contains("cannot be below itself"));
    assert!(why(&sheet, "[[fields]]\nname = \"a\"\nparent = \"\"").contains("a level of it is empty"));
    let within = "[[fields]]\nname = \"a\"\n[[fields]]\nwithin = \"a\"\nparent = \"b\"\npatches = 2";
    assert!(why(&sheet, within).contains("`parent` has no effect"));
}

/// Two materials on a plate, and an attribute that rises along x.
struct Paint<'a>(&'a Body);

impl Painted for Paint<'_> {
    fn materials(&self) -> Vec<String> {
        vec!["skin".into(), "shell".into()]
    }

    fn material(&self, _: usize, triangle: usize) -> Option<&str> {
        Some(if triangle % 80 < 40 { "skin" } else { "shell" })
    }

    fn attributes(&self) -> Vec<String> {
        vec!["_SOFT".into()]
    }

    fn attribute(&self, name: &str, surface: usize, triangle: usize, barycentric: [f64; 3]) -> Option<f64> {
        assert_eq!(name, "_SOFT");
        let surface = &self.0.surfaces[surface];
        let corners = surface.triangles[triangle].map(|v| surface.positions[v as usize].x / 0.08);
        Some(corners.iter().zip(barycentric).map(|(x, weight)| x * weight).sum())
    }
}

#[test]
fn what_is_painted_on_a_mesh_chooses_its_taxels() {
    // Forty squares a row, two triangles each: the first twenty columns are of the one material.
    let sheet = plate(40, 40, |_, _| true);
    let paint = Paint(&sheet);
    let x = |id: &u32| sheet.taxels[*id as usize].position_in_link.x;
    let text = "[[fields]]\nname = \"soft\"\nattribute = \"_SOFT\"\n[[fields]]\nname = \"m\"\neach = \"material\"\n\
                [[fields]]\nname = \"both\"\nattribute = \"_SOFT\"\nmaterial = \"sk*\"\n[[fields]]\neach = \"mesh\"";
    let why = group(&sheet, &paint, &rules(text)).unwrap_err().to_string();
    assert!(why.contains("field rule 3") && why.contains("no taxel"), "{why}");
    let grouping = group(&sheet, &paint, &rules(&text.replace("sk*", "shell"))).unwrap();
    let soft = ids(field(&grouping, "soft"));
    assert!(soft.len() == 200 && soft.iter().all(|id| x(id) > 0.04));
    assert_eq!(ids(field(&grouping, "m/shell")), soft);
    assert_eq!(ids(field(&grouping, "both")), soft);
    assert!(ids(field(&grouping, "m/skin")).iter().all(|id| x(id) < 0.04));
    assert_eq!(field(&grouping, "plate").members.len(), 400);
    let why = group(&sheet, &paint, &rules("[[fields]]\nname = \"a\"\nmaterial = \"skim\"")).unwrap_err().to_string();
    assert!(why.contains("did you mean `skin`?"), "{why}");
    let why =
        group(&sheet, &paint, &rules("[[fields]]\nname = \"a\"\nattribute = \"_SOFTT\"")).unwrap_err().to_string();
    assert!(why.contains("did you mean `_SOFT`?"), "{why}");
}

#[test]
fn a_field_around_a_limb_is_named_split_or_refused() {
    let limb = tube(16, 12);
    // By default it has no chart, and the note says what would help.
    let bare = grouped(&limb, "[[fields]]\neach = \"link\"").unwrap();
    let [note] = &bare.notes[..] else { panic!("{:?}", bare.notes) };
    assert!(note.contains("`limb`: without a chart") && note.contains("`wrap = \"split\"`"), "{note}");
    assert!(complete(&limb, &bare).fields[0].chart.is_err());

    let split = |chart: &str| {
        let text = format!("[[fields]]\nname = \"arm\"\nchart = \"{chart}\"\nwrap = \"split\"");
        let grouping = grouped(&limb, &text).unwrap();
        assert!(grouping.notes[0].contains("split into"), "{:?}", grouping.notes);
        let complete = complete(&limb, &grouping);
        assert!(complete.fields[0].chart.is_err() && complete.fields[0].members.len() == limb.taxels.len());
        let parts = &complete.fields[1..];
        // Each says where it is: no two are on the same side of so few.
        let sides = ["front", "back", "left", "right"].map(|side| format!("arm/{side}_1"));
        assert!(parts.iter().all(|part| sides.contains(&part.name) && part.parent == Some(0)), "{parts:?}");
        assert_eq!(parts.iter().map(|part| part.members.len()).sum::<usize>(), limb.taxels.len());
        parts.iter().map(|part| part.chart.clone().unwrap()).collect::<Vec<_>>()
    };
    // Two half shells unroll; planes see at most 75° to each side.
    let unrolled = split("geodesic");
    assert_eq!(unrolled.len(), 2);
    assert!(unrolled.iter().all(|chart| chart.kind == ChartKind::Geodesic && chart.distortion < 0.01), "{unrolled:?}");
    let planes = split("plane");
    assert_eq!(planes.len(), 3);
    assert!(planes.iter().all(|chart| chart.kind == ChartKind::Plane && chart.distortion > MAX_PLANE_DISTORTION));
    assert_eq!(split("auto").len(), 2);

    for (chart, parts) in [("plane", "3 parts"), ("geodesic", "2 parts")] {
        let why = why(&limb, &format!("[[fields]]\nname = \"arm\"\nchart = \"{chart}\""));
        assert!(why.contains("field `arm`") && why.contains(parts) && why.contains("split"), "{why}");
    }
    let text = "[[fields]]\nname = \"arm\"\nchart = \"geodesic\"\nwrap = \"bare\"";
    let bare = complete(&limb, &grouped(&limb, text).unwrap());
    assert!(bare.fields[0].chart.is_err());
    let none = complete(&limb, &grouped(&limb, "[[fields]]\nname = \"a\"\ntaxels = [0, 1]\nchart = \"none\"").unwrap());
    assert_eq!(none.fields[0].chart, Err(NoChart::ByChoice));
}

#[test]
fn each_field_gets_the_chart_that_suits_it_and_parents_get_theirs() {
    let limb = tube(24, 12);
    // A third of the way round, in two patches: the whole of it and each of them bend too much for a plane.
    let third: Vec<String> = (0..12).map(|row| format!("\"{}..={}\"", 24 * row, 24 * row + 7)).collect();
    let text = format!(
        "[[fields]]\nname = \"arm\"\ntaxels = [{}]\npatches = 2\n[[fields]]\nname = \"flat\"\ntaxels = [0, 24, 48, 1, 25, 49]\n\
         u = [0.0, 1.0, 0.0]",
        third.join(", ")
    );
    let grouping = grouped(&limb, &text).unwrap();
    assert!(grouping.notes.is_empty(), "{:?}", grouping.notes);
    let complete = complete(&limb, &grouping);
    let chart = |name: &str| {
        let field = complete.fields.iter().find(|field| field.name == name).unwrap();
        (field.chart.clone().unwrap(), field)
    };
    let (arm, whole) = chart("arm");
    assert!(arm.kind == ChartKind::Geodesic && arm.distortion < 0.01, "{arm:?}");
    assert_eq!(whole.members.len(), 96);
    // Unrolled, the farthest two are as far apart as around the tube.
    let u: Vec<f64> = whole.members.iter().map(|member| member.place.x).collect();
    let width = u.iter().copied().fold(f64::MIN, f64::max) - u.iter().copied().fold(f64::MAX, f64::min);
    let right = RADIUS * 7.0 / 24.0 * TAU;
    assert!((width / right - 1.0).abs() < 2e-3, "{width} {right}");
    let (flat, _) = chart("flat");
    assert!(
        flat.kind == ChartKind::Plane
            && flat.distortion <= MAX_PLANE_DISTORTION
            && flat.u_in_anchor.distance(DVec3::Y) < 1e-6
    );
    assert!(PI > 3.0 && arm.distortion_rms <= arm.distortion);
}

#[test]
fn taxels_without_a_surface_are_grouped_from_each_to_the_next() {
    let limb = tube(16, 12);
    let without = Body { surfaces: Vec::new(), ..limb.clone() };
    let grouping = grouped(&without, "[[fields]]\nname = \"arm\"\npatches = 6").unwrap();
    assert_eq!(grouping.fields.len(), 7);
    assert!(grouping.notes.iter().any(|note| note.contains("from taxel to taxel")), "{:?}", grouping.notes);
    assert!(grouping.fields[1..].iter().all(|patch| (12..=60).contains(&patch.members.len())));
}

#[test]
fn rules_that_make_no_sense_are_named() {
    let sheet = plate(10, 10, |_, _| true);
    for (text, part) in [
        ("name = \"a\"\npatches = 2\nrows = { of = 3 }", "it has several of"),
        ("", "add a `name`"),
        ("patches = 0", "`patches`"),
        ("name = \"a\"\nlink = \"lims\"", "did you mean `limb`?"),
        ("name = \"a\"\nmesh = \"x\"", "it is one of plate"),
        ("name = \"a\"\nmaterial = \"x\"", "there is none"),
        ("name = \"a\"\ntaxels = [900]", "no taxel from 900 to 900; its ids are from 0 to 24"),
        ("name = \"a\"\nwithin = \"b\"", "no field of an earlier rule matches `b`"),
        ("name = \"a//b\"", "a level of it is empty"),
        ("radius = 0.1", "overlap"),
        ("radius = 0.1\noverlap = 1.0", "`overlap`"),
        ("overlap = 0.4", "radius"),
        ("seeds = [3]\noverlap = 0.4", "seed 1 has no other"),
        ("seeds = [77]\nradius = 0.1", "taxel 77"),
        ("name = \"a\"\nmodality = \"presure\"", "did you mean `pressure`?"),
        ("name = \"a\"\nweight = 0.0", "`weight`"),
        ("name = \"a\"\nu = [0, 0, 0]", "`u`"),
        ("rows = { of = 0 }", "1 or more"),
    ] {
        let why = why(&sheet, &format!("[[fields]]\n{text}"));
        assert!(why.contains(part) && why.starts_with("field rule 1: "), "{text}: {why}");
        assert!(!why.contains('\n'));
    }
    let twice = why(&sheet, "[[fields]]\nname = \"a\"\n[[fields]]\nname = \"a\"");
    assert!(twice.contains("field rule 2") && twice.contains("there is one of that name"), "{twice}");
    for text in ["nam = \"a\"", "chart = \"flat\"", "patches = \"many\"", "radius = \"3 feet\"", "taxels = [\"9..2\"]"]
    {
        assert!(toml::from_str::<Recipe>(&format!("[[fields]]\n{text}")).is_err(), "{text}");
    }
}

#[test]
fn real_and_hostile_meshes_are_grouped_or_named() {
    let Some(files) = meshes() else { return };
    let mut seen = 0;
    for path in files {
        let Ok(mut body) = Body::load(&path) else { continue };
        for link in 0..body.links.len().min(2) {
            let corners: Vec<DVec3> = body.triangles_in_link(link).flatten().collect();
            let triangles: Vec<[u32; 3]> =
                (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            if corners.iter().any(|p| !p.is_finite()) {
                continue;
            }
            let Ok(placed) = place_evenly(&corners, &triangles, 150, 1, &mut |_| true) else { continue };
            body.taxels = placed
                .iter()
                .zip(0..)
                .map(|(p, id)| Taxel { link, ..taxel(id, p.point.position, p.point.normal) })
                .collect();
            let text = "[[fields]]\nname = \"all\"\npatches = 8\n[[fields]]\nname = \"limb\"\nwrap = \"split\"\n\
                        [[fields]]\nname = \"discs\"\nradius = 0.02\nseeds = [0, 50, 100]\nchart = \"geodesic\"\nwrap = \"bare\"";
            let began = std::time::Instant::now();
            let grouping = grouped(&body, text).unwrap();
            assert!(began.elapsed().as_secs() < 20, "{}: {:?}", path.display(), began.elapsed());
            let complete = complete(&body, &grouping);
            // A level leaves charts to what is below it, unless it asks for one by name.
            let is_level = |name: &str| name == "all";
            for field in complete.fields.iter().filter(|field| field.chart.is_err() && !is_level(&field.name)) {
                // A note names the first of many.
                let named = |name: &str| {
                    let of = |note: &String| {
                        note.contains(&format!("`{name}`")) || note.contains("`all/") && note.contains(" more")
                    };
                    grouping.notes.iter().any(of)
                };
                assert!(named(&field.name), "{}: {} {:?}", path.display(), field.name, grouping.notes);
            }
            let patches = complete.fields.iter().filter(|field| field.name.starts_with("all/"));
            assert_eq!(patches.map(|field| field.members.len()).sum::<usize>(), 150);
            eprintln!(
                "{} link {link}: {} fields, {:?}\n  {}",
                path.display(),
                complete.fields.len(),
                began.elapsed(),
                grouping.notes.join("\n  ")
            );
            seen += 1;
        }
    }
    assert!(seen >= 10, "{seen} surfaces");
}
