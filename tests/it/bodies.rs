//! The bundled bodies are what their recipes make, and what `bodies/README.md` says they are.

#[allow(dead_code)]
#[path = "../../bodies/recipes/main.rs"]
mod recipes;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::DVec3;
use somatic::Body;
use somatic::author::lint;
use somatic::body::{FieldSpec, Modality, Surface, Taxel};
use somatic::field::FieldSet;
use somatic::internal::author::widest_radius;

fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bodies").join(name)
}

fn load(name: &str) -> Body {
    let body = Body::load(bundled(name)).unwrap();
    assert_eq!(body.findings, Vec::<String>::new(), "{name}");
    body
}

fn field<'a>(body: &'a Body, name: &str) -> &'a FieldSpec {
    body.fields.iter().find(|field| field.name == name).unwrap_or_else(|| panic!("no field {name}"))
}

fn children<'a>(body: &'a Body, name: &str) -> Vec<&'a FieldSpec> {
    body.fields.iter().filter(|field| field.parent.as_deref() == Some(name)).collect()
}

/// The fields without children at and below `field`.
fn leaves<'a>(body: &'a Body, field: &'a FieldSpec) -> Vec<&'a FieldSpec> {
    match children(body, &field.name) {
        below if below.is_empty() => vec![field],
        below => below.into_iter().flat_map(|child| leaves(body, child)).collect(),
    }
}

/// Ids of a field and all its descendants.
fn ids(body: &Body, name: &str) -> BTreeSet<u32> {
    let mut ids: BTreeSet<u32> = field(body, name).members.keys().copied().collect();
    for child in children(body, name) {
        ids.extend(self::ids(body, &child.name));
    }
    ids
}

fn taxel(body: &Body, id: u32) -> &Taxel {
    &body.taxels[body.taxel_index(id).unwrap()]
}

fn in_body(body: &Body, taxel: &Taxel) -> DVec3 {
    body.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link)
}

fn normal_in_body(body: &Body, taxel: &Taxel) -> DVec3 {
    body.links[taxel.link].body_from_link.transform_vector3(taxel.normal_in_link)
}

fn extent(points: impl IntoIterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.into_iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Edges that do not have one triangle on each side, the two running along it in opposite ways.
fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let mut runs: HashMap<(u32, u32), usize> = HashMap::new();
    for &[a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *runs.entry(edge).or_default() += 1;
        }
    }
    runs.iter().filter(|&(&(a, b), &count)| count != 1 || runs.get(&(b, a)) != Some(&1)).count()
}

/// Volume inside a closed surface whose triangles look outward, m³.
fn volume(surface: &Surface) -> f64 {
    let corner = |v: u32| surface.positions[v as usize];
    surface.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

/// How far the taxel farthest from the body's surface is from it, m.
fn farthest_off_surface(body: &Body) -> f64 {
    let mut surfaces = BTreeMap::new();
    let offs = body.taxels.iter().map(|taxel| {
        let surface = surfaces.entry(taxel.link).or_insert_with(|| body.surface_in_link(taxel.link));
        surface.nearest(taxel.position_in_link).unwrap().position.distance(taxel.position_in_link)
    });
    offs.fold(0.0, f64::max)
}

/// The largest angle between two of the normals, in degrees.
fn widest_angle(normals: &[DVec3]) -> f64 {
    let pairs = normals.iter().flat_map(|a| normals.iter().map(move |b| a.angle_between(*b).to_degrees()));
    pairs.fold(0.0, f64::max)
}

/// Per taxel, the distance to the nearest one whose normal agrees within 90°, m.
fn spacings(points: &[(DVec3, DVec3)]) -> Vec<f64> {
    let nearest = |i: usize| {
        let others = points.iter().enumerate().filter(|&(j, other)| j != i && other.1.dot(points[i].1) > 0.0);
        others.map(|(_, other)| other.0.distance(points[i].0)).fold(f64::INFINITY, f64::min)
    };
    (0..points.len()).map(nearest).collect()
}

#[test]
fn the_files_are_what_the_recipes_make() {
    for (name, made) in recipes::files().unwrap() {
        let there = std::fs::read(bundled(name)).unwrap();
        assert!(there == made, "bodies/{name} is not what its recipe makes: cargo run --example bodies");
    }
}

#[test]
fn the_surfaces_are_closed_look_outward_and_carry_every_taxel() {
    for (name, parts, most_bytes) in [
        ("hand.glb", 5, 500_000),
        ("sensing-hand.glb", 5, 500_000),
        ("mat.glb", 1, 500_000),
        ("humanoid.glb", 1, 1_500_000),
    ] {
        let body = load(name);
        assert_eq!(body.surfaces.len(), parts, "{name}");
        for surface in &body.surfaces {
            assert_eq!(open_edges(&surface.triangles), 0, "{name}: {}", surface.name);
            assert_eq!(open_edges(&surface.triangles[1..]), 3, "a hole must show");
            assert!(volume(surface) > 0.0, "{name}: {} is inside out", surface.name);
        }
        // Single precision puts a taxel 1 m from the origin off by no more than 1e-7 m.
        let off = farthest_off_surface(&body);
        assert!(off < 1e-6, "{name}: a taxel is {off} m off the surface");
        assert!(body.taxels.iter().all(|t| (t.normal_in_link.length() - 1.0).abs() < 1e-6 && t.area > 0.0), "{name}");
        assert!(std::fs::metadata(bundled(name)).unwrap().len() < most_bytes, "{name} is too large");
    }
}

#[test]
fn a_taxel_beside_the_surface_is_noticed() {
    let mut body = load("hand.glb");
    body.taxels[3].position_in_link += DVec3::Y * 2e-6;
    assert!(farthest_off_surface(&body) > 1e-6);
}

#[test]
fn the_hand_has_the_boards_of_the_paper() {
    let body = load("hand.glb");
    let counts = ["hand/palm", "hand/back", "hand/side", "hand/midhand", "hand"].map(|name| ids(&body, name).len());
    assert_eq!(counts, [9, 9, 2, 20, 40]);
    assert_eq!(ids(&body, "hand/palm"), (0..9).collect());
    assert_eq!(ids(&body, "hand/back"), (16..25).collect());
    assert_eq!(ids(&body, "hand/side"), [16 + 9, 16 + 10].into());
    assert_eq!(ids(&body, "hand/midhand"), (32..52).collect());
    let names: Vec<&str> = body.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["hand", "thumb", "index", "middle", "ring"]);
    for (first, digit) in (32..).step_by(5).zip(&names[1..]) {
        assert_eq!(ids(&body, &format!("hand/midhand/{digit}")), (first..first + 5).collect());
        let link = body.link_index(digit).unwrap();
        assert!((first..first + 5).all(|id| taxel(&body, id).link == link));
        assert_eq!(body.links[link].parent, Some(0));
    }
    assert!((0..32).filter_map(|id| body.taxel_index(id)).all(|index| body.taxels[index].link == 0));
}

#[test]
fn the_hand_has_the_measures_of_the_paper() {
    let body = load("hand.glb");
    let palm = body.surfaces.iter().find(|surface| surface.name == "hand").unwrap();
    let (low, high) = extent(palm.positions.iter().copied());
    assert!((high - low).abs_diff_eq(DVec3::new(0.048, 0.011, 0.036), 1e-5), "{} m", high - low);
    for board in ["hand/palm", "hand/back"] {
        let up = if board == "hand/back" { 1.0 } else { -1.0 };
        for (i, &id) in ids(&body, board).iter().enumerate() {
            let sensor = taxel(&body, id);
            let place = DVec3::new(0.012 * (1.0 - (i % 3) as f64), 0.0055 * up, 0.011 * (1.0 - (i / 3) as f64));
            assert!(sensor.position_in_link.distance(place) < 1e-6, "{board}: {id}");
            assert!(sensor.normal_in_link.distance(DVec3::Y * up) < 1e-3, "{board}: {id}");
        }
    }
    let points: Vec<(DVec3, DVec3)> =
        body.taxels.iter().map(|t| (in_body(&body, t), normal_in_body(&body, t))).collect();
    let least = spacings(&points).into_iter().fold(f64::INFINITY, f64::min);
    assert!(least >= 0.005, "sensors of 5 mm do not fit {least} m apart");
    assert!(body.taxels.iter().all(|t| (t.area - 1.963_495e-5).abs() < 1e-10));
}

#[test]
fn a_fingers_sensors_look_much_the_same_way() {
    let body = load("hand.glb");
    let normals = |name: &str| -> Vec<DVec3> {
        ids(&body, name).iter().map(|&id| normal_in_body(&body, taxel(&body, id))).collect()
    };
    for finger in children(&body, "hand/midhand") {
        let widest = widest_angle(&normals(&finger.name));
        assert!(widest < 60.0, "{}: {widest}°", finger.name);
    }
    assert!(widest_angle(&normals("hand")) > 170.0);
}

#[test]
fn the_palms_quadrants_share_its_centre() {
    let body = load("hand.glb");
    let quadrants = children(&body, "hand/palm");
    assert_eq!(quadrants.len(), 4);
    for quadrant in quadrants {
        assert_eq!(quadrant.members.len(), 4);
        assert!(quadrant.members.contains_key(&4));
        let mean = quadrant.members.keys().map(|&id| taxel(&body, id).position_in_link).sum::<DVec3>() / 4.0;
        assert_eq!(quadrant.name.contains("radial"), mean.x > 0.001, "{}: the thumb is at +x", quadrant.name);
        assert_eq!(quadrant.name.contains("distal"), mean.z > 0.001, "{}: the fingers are at +z", quadrant.name);
    }
}

#[test]
fn the_sensing_hand_has_three_axes_in_its_palm_and_fingers_and_four_kinds_of_taxels() {
    let (plain, body) = (load("hand.glb"), load("sensing-hand.glb"));
    let of = |modality: Modality| -> BTreeSet<u32> {
        body.taxels.iter().filter(|taxel| taxel.modality == modality).map(|taxel| taxel.id).collect()
    };
    assert_eq!(of(Modality::Force3), (0..9).chain(32..52).collect());
    assert_eq!(of(Modality::Temperature), (64..73).collect());
    assert_eq!(of(Modality::Proximity), (80..84).collect());
    assert_eq!(of(Modality::Pressure), (16..27).collect());
    assert!(plain.taxels.iter().all(|own| own.position_in_link == taxel(&body, own.id).position_in_link));
    // To the fingertips, in the skin.
    for id in 0..9 {
        let sensor = taxel(&body, id);
        let tangent = sensor.tangent_in_link.unwrap();
        assert!(tangent.dot(DVec3::Z) > 0.999 && tangent.dot(sensor.normal_in_link).abs() < 1e-6, "{id}: {tangent}");
    }
    let meeting = std::fs::read_to_string(bundled("meeting.csv")).unwrap();
    let readme = std::fs::read_to_string(bundled("README.md")).unwrap();
    let values = meeting.lines().next().unwrap().split(',').count() - 1;
    assert_eq!((values, meeting.lines().count()), (body.taxels.len() + 2 * of(Modality::Force3).len(), 1 + 6 * 50));
    assert!(readme.contains(&format!("on the {values} values of `sensing-hand.glb`")), "{values}");
}

#[test]
fn the_mat_is_a_grid_of_an_inch() {
    let body = load("mat.glb");
    assert_eq!(body.taxels.len(), 64 * 32);
    for (id, taxel) in body.taxels.iter().enumerate() {
        assert_eq!(taxel.id as usize, id);
        let (row, column) = ((id / 32) as f64, (id % 32) as f64);
        let place = DVec3::new(0.0254 * (column - 15.5), 0.008, 0.0254 * (row - 31.5));
        assert!(taxel.position_in_link.distance(place) < 1e-7, "taxel {id}");
        assert_eq!(taxel.normal_in_link, DVec3::Y);
    }
    let (low, high) = extent(body.surfaces[0].positions.iter().copied());
    assert!((high - low).abs_diff_eq(DVec3::new(0.8528, 0.008, 1.6656), 1e-6), "{} m", high - low);
}

#[test]
fn the_mats_fields_cover_it_on_each_of_three_levels() {
    let body = load("mat.glb");
    let all: BTreeSet<u32> = (0..64 * 32).collect();
    assert_eq!(ids(&body, "mat"), all);
    let of = |kind: &str| -> Vec<&FieldSpec> { body.fields.iter().filter(|f| f.name.contains(kind)).collect() };
    let (bands, quadrants, patches) = (of("/band_"), of("/quadrant_"), of("/patch_"));
    assert_eq!((bands.len(), quadrants.len(), patches.len(), body.fields.len()), (7, 4, 128, 140));
    for kind in [&bands, &quadrants, &patches] {
        let union: BTreeSet<u32> = kind.iter().flat_map(|field| field.members.keys().copied()).collect();
        assert_eq!(union, all);
    }
    for pair in bands.windows(2) {
        assert_eq!(pair[0].members.len(), 16 * 32);
        assert_eq!(pair[0].members.keys().filter(|id| pair[1].members.contains_key(id)).count(), 8 * 32);
    }
    for patch in patches {
        assert_eq!(patch.members.len(), 16);
        let parent = field(&body, patch.parent.as_deref().unwrap());
        assert_eq!(parent.parent.as_deref(), Some("mat"));
        assert!(patch.members.keys().all(|id| parent.members.contains_key(id)), "{}", patch.name);
    }
    let head_left = field(&body, "mat/quadrant_head_left");
    assert!(head_left.members.contains_key(&0) && !head_left.members.contains_key(&31));
}

#[test]
fn the_humanoid_stands_75_centimetres_tall_on_the_ground() {
    let body = load("humanoid.glb");
    let (low, high) = extent(body.surfaces[0].positions.iter().copied());
    assert!(low.y.abs() < 1e-3 && (high.y - 0.75).abs() < 2e-3, "from {} to {} m", low.y, high.y);
    assert!((low.x + high.x).abs() < 5e-3, "it leans to one side");
    for (left, right) in [("left_hand", "right_hand"), ("left_foot", "right_foot")] {
        let origin = |name: &str| body.links[body.link_index(name).unwrap()].body_from_link.translation;
        assert!((origin(left) * DVec3::new(-1.0, 1.0, 1.0)).distance(origin(right)) < 1e-6);
        assert!(origin(left).x > 0.0);
    }
}

#[test]
fn bundled_bodies_stand_upright_in_the_world_and_look_along_its_x() {
    let humanoid = load("humanoid.glb");
    let link = |name: &str| &humanoid.links[humanoid.link_index(name).unwrap()];
    let place = |name: &str| link(name).world_from_link().translation;
    assert!(place("head").z > 0.5 && place("left_hand").y > 0.05 && place("right_hand").y < -0.05);
    // Its toes reach farther from the ankles than its heels.
    for name in ["left_foot", "right_foot"] {
        let foot = humanoid.taxels.iter().filter(|taxel| humanoid.links[taxel.link].name == name);
        let (low, high) = extent(foot.map(|t| link(name).world_from_link().transform_point3(t.position_in_link)));
        assert!(high.x - place(name).x > 2.0 * (place(name).x - low.x), "{name}: {low} {high}");
    }
    // The mat's taxels look up, its left half lies on the left.
    let mat = load("mat.glb");
    let way = mat.links[mat.taxels[0].link].world_from_link();
    assert!(mat.taxels.iter().all(|taxel| way.transform_vector3(taxel.normal_in_link).distance(DVec3::Z) < 1e-6));
}

#[test]
fn the_humanoids_skeleton_hangs_together() {
    let body = load("humanoid.glb");
    let path = |name: &str| -> Vec<&str> {
        let mut path = Vec::new();
        let mut at = body.link_index(name);
        while let Some(link) = at {
            path.push(body.links[link].name.as_str());
            at = body.links[link].parent;
        }
        path
    };
    assert_eq!(path("head"), ["head", "neck", "chest", "spine", "pelvis"]);
    for side in ["left", "right"] {
        let of = |names: [&str; 3]| names.map(|name| format!("{side}_{name}"));
        assert_eq!(path(&format!("{side}_hand"))[..3], of(["hand", "forearm", "upper_arm"]));
        assert_eq!(path(&format!("{side}_hand"))[3..], ["chest", "spine", "pelvis"]);
        assert_eq!(path(&format!("{side}_foot"))[..3], of(["foot", "shank", "thigh"]));
        assert_eq!(path(&format!("{side}_foot"))[3..], ["pelvis"]);
    }
    assert!(body.link_index("humanoid taxels").is_none(), "points are no link");
}

#[test]
fn the_humanoids_taxels_are_evenly_spread() {
    let body = load("humanoid.glb");
    let count = 960;
    assert_eq!(body.taxels.len(), count);
    assert!(body.taxels.iter().enumerate().all(|(i, taxel)| taxel.id as usize == i));
    let surface = &body.surfaces[0];
    let corner = |v: u32| surface.positions[v as usize];
    let area: f64 = surface
        .triangles
        .iter()
        .map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length() / 2.0)
        .sum();
    let shared: f64 = body.taxels.iter().map(|taxel| taxel.area).sum();
    assert!((shared / area - 1.0).abs() < 1e-5, "taxels stand for {shared} of {area} m²");

    let evenness = |points: &[(DVec3, DVec3)]| {
        let spacings = spacings(points);
        let mean = spacings.iter().sum::<f64>() / spacings.len() as f64;
        let variance = spacings.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / spacings.len() as f64;
        let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
        (variance.sqrt() / mean, least / (2.0 * widest_radius(area, count)))
    };
    let mut points: Vec<(DVec3, DVec3)> =
        body.taxels.iter().map(|t| (in_body(&body, t), normal_in_body(&body, t))).collect();
    let (variation, least) = evenness(&points);
    assert!(variation < 0.12, "coefficient of variation {variation}");
    assert!(least >= 0.65, "least spacing {least} of the widest there could be");
    points[7].0 = points[8].0 + DVec3::X * 0.008;
    points[7].1 = points[8].1;
    assert!(evenness(&points).1 < 0.65, "a taxel moved beside another must show");
}

#[test]
fn the_humanoids_fields_nest_and_their_patches_have_true_charts() {
    let body = load("humanoid.glb");
    let charts = FieldSet::new(&body).unwrap().fields;
    assert!(lint(&body, &charts).is_empty(), "{:?}", lint(&body, &charts));
    assert!(body.fields.len() >= 60, "{} fields", body.fields.len());
    let limbs: BTreeSet<&str> = children(&body, "body").iter().map(|limb| limb.name.as_str()).collect();
    assert_eq!(limbs, ["head", "left_arm", "left_leg", "right_arm", "right_leg", "torso"].into());
    let mut seen = BTreeSet::new();
    for limb in limbs {
        for patch in children(&body, limb).iter().flat_map(|segment| leaves(&body, segment)) {
            assert!(patch.name.starts_with(&format!("{limb}/")));
            assert!(patch.members.len() >= 3, "{}: {} taxels", patch.name, patch.members.len());
            let members: Vec<&Taxel> = patch.members.keys().map(|&id| taxel(&body, id)).collect();
            assert!(members.iter().all(|t| t.link == members[0].link), "{} spans links", patch.name);
            assert!(members.iter().all(|t| seen.insert(t.id)), "{} shares a taxel", patch.name);
            let chart = charts.iter().find(|field| field.name == patch.name).unwrap().chart.as_ref();
            assert!(chart.is_ok_and(|chart| chart.distortion <= 0.25), "{}: {chart:?}", patch.name);
        }
    }
    assert_eq!(seen.len(), body.taxels.len());
    let limb = |name: &str| ids(&body, name).iter().map(|&id| in_body(&body, taxel(&body, id))).sum::<DVec3>();
    assert!(limb("left_arm").x > 0.0 && limb("right_leg").x < 0.0, "left is at +x");
    let torso: Vec<DVec3> = ids(&body, "torso").iter().map(|&id| taxel(&body, id).normal_in_link).collect();
    assert!(widest_angle(&torso) > 150.0, "a limb wraps round, a patch does not");
}

#[test]
fn the_humanoids_weights_sum_to_one() {
    let file = std::fs::read(bundled("humanoid.glb")).unwrap();
    let length = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&file[20..20 + length(12)]).unwrap();
    let bin = &file[20 + length(12) + 8..];
    let mut rows = 0;
    for mesh in json["meshes"].as_array().unwrap() {
        let accessor = mesh["primitives"][0]["attributes"]["WEIGHTS_0"].as_u64().unwrap() as usize;
        let view = json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
        let number = |key: &str| json["bufferViews"][view][key].as_u64().unwrap() as usize;
        let bytes = &bin[number("byteOffset")..number("byteOffset") + number("byteLength")];
        for row in bytes.as_chunks::<16>().0 {
            let weights: Vec<f64> = row.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect();
            // Each of four weights is rounded to within 2⁻²⁵.
            assert!((weights.iter().sum::<f64>() - 1.0).abs() <= 4.0 / f64::from(1 << 25), "{weights:?}");
            assert!(weights.is_sorted_by(|a, b| a >= b) && weights[3] >= 0.0, "{weights:?}");
            rows += 1;
        }
    }
    let body = load("humanoid.glb");
    assert_eq!(rows, body.surfaces[0].positions.len() + body.taxels.len());
}
