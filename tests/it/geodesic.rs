//! Geodesic charts from the surface to percepts: laid, written, read, run on every backend.

use std::f64::consts::{PI, TAU};
use std::time::{Duration, Instant};

use glam::DVec3;
use somatic::body::{ChartKind, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::field::{FieldSet, NoChart};
use somatic::internal::author::{place_apart, place_by_density, place_evenly};
use somatic::internal::body::{Glb, MeshData, Topology};
use somatic::internal::field::Unroller;
use somatic::{Body, Percept};

use crate::common::{backends, engine, frame, meshes};

const RADIUS: f64 = 0.04;
const LENGTH: f64 = 0.12;

/// Part of a tube around the y axis, in facets of `step` rad from `from` on; angle 0 is at +z.
fn tube(from: f64, step: f64, facets: u32, holes: impl Fn(u32, u32) -> bool) -> MeshData {
    let rows = 24_u32;
    let mut mesh = MeshData::default();
    for row in 0..=rows {
        for facet in 0..=facets {
            let (sin, cos) = (from + f64::from(facet) * step).sin_cos();
            let y = f64::from(row) / f64::from(rows) * LENGTH;
            mesh.positions.push([RADIUS * sin, y, RADIUS * cos].map(|x| x as f32));
            mesh.normals.push([sin, 0.0, cos].map(|x| x as f32));
        }
    }
    for row in 0..rows {
        for facet in (0..facets).filter(|&facet| !holes(row, facet)) {
            let a = row * (facets + 1) + facet;
            let (b, c, d) = (a + 1, a + facets + 2, a + facets + 1);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A taxel on the tube's facets.
fn on_tube(id: u32, from: f64, step: f64, angle: f64, y: f64) -> Taxel {
    let facet = ((angle - from) / step).floor();
    let at = |facet: f64| DVec3::new((from + facet * step).sin(), 0.0, (from + facet * step).cos()) * RADIUS;
    let part = (angle - from) / step - facet;
    let middle = from + (facet + 0.5) * step;
    Taxel {
        id,
        link: 0,
        position_in_link: at(facet).lerp(at(facet + 1.0), part) + DVec3::Y * y,
        normal_in_link: DVec3::new(middle.sin(), 0.0, middle.cos()),
        area: 1e-5,
        modality: Modality::Pressure,
        tangent_in_link: None,
    }
}

fn written(mesh: &MeshData, taxels: &[Taxel], fields: &[FieldSpec]) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("arm", None, DVec3::ZERO);
    glb.mesh(link, "skin", mesh, None, None);
    glb.taxels("taxels", Some(link), taxels, None);
    for field in fields {
        glb.field(field, Some(link), DVec3::ZERO);
    }
    Body::from_bytes("arm", &glb.to_bytes().unwrap()).unwrap()
}

fn all_of(taxels: &[Taxel]) -> FieldSpec {
    let members = taxels.iter().map(|taxel| (taxel.id, MemberSpec::default())).collect();
    FieldSpec { name: "arm".into(), members, ..FieldSpec::default() }
}

/// Taxels on a grid over angles `angles` and half the tube's length.
fn grid(from: f64, step: f64, angles: impl Iterator<Item = f64>) -> Vec<Taxel> {
    let places = angles.flat_map(|angle| (0..7).map(move |row| (angle, 0.03 + 0.01 * f64::from(row))));
    places.zip(0..).map(|((angle, y), id)| on_tube(id, from, step, angle, y)).collect()
}

#[test]
fn a_field_around_half_a_limb_is_unrolled_on_every_backend() {
    let (from, step) = (-100.0_f64.to_radians(), 2.0_f64.to_radians());
    let mesh = tube(from, step, 100, |_, _| false);
    let angle_of = |column: u32| (-90.0 + 15.0 * f64::from(column) + 0.5).to_radians();
    let taxels = grid(from, step, (0..13).map(angle_of));
    let bare = written(&mesh, &taxels, &[]);
    let spec = all_of(&taxels);

    // A plane cannot hold it; the file with the chart does.
    let plane = FieldSet::new(&written(&mesh, &taxels, std::slice::from_ref(&spec))).unwrap();
    assert!(matches!(plane.fields[0].chart, Err(NoChart::Wraps(angle)) if angle.to_degrees() > 80.0));
    let unrolled = Unroller::new(&bare).unroll(&spec).unwrap();
    let body = written(&mesh, &taxels, std::slice::from_ref(&unrolled));
    // What is kept comes back to the last bit.
    assert_eq!(body.fields[0], unrolled);
    let fields = FieldSet::new(&body).unwrap();
    let field = &fields.fields[0];
    let chart = field.chart.as_ref().unwrap();
    assert_eq!(chart.kind, ChartKind::Geodesic);
    // Facets of 2° stand for an arc within their angle's square over 24, and as much again in what the normals say.
    assert!(chart.distortion < 2e-3 && chart.distortion_rms <= chart.distortion, "{}", chart.distortion);

    // Seen from the origin: +u is along +x, or what is left of it there; +v is along the axis.
    let origin = field.origin_in_anchor;
    let zero = origin.x.atan2(origin.z);
    assert!(chart.normal_in_anchor.distance(DVec3::new(zero.sin(), 0.0, zero.cos())) < 0.02);
    assert!(chart.v_in_anchor.distance(DVec3::Y) < 1e-6);
    let pressed = [(1_usize, 2_usize, 3.0), (1, 4, 1.0), (2, 3, 4.0)];
    let mut values = vec![0.0; taxels.len()];
    let (mut total, mut angle, mut y) = (0.0, 0.0, 0.0);
    for (column, row, value) in pressed {
        values[column * 7 + row] = value;
        total += value;
        angle += value * angle_of(column as u32);
        y += value * (0.03 + 0.01 * row as f64);
    }
    let (angle, y) = (angle / total, y / total);
    assert!(angle.to_degrees() < -65.0);
    for kind in backends() {
        let mut engine = engine(&body, kind);
        let percepts = engine.process(&[frame(0.0, &values)]).unwrap();
        let percept: Percept = percepts.touched(0).next().unwrap();
        let [u, v] = percept.centroid.unwrap();
        // The facets' chords are shorter than their arcs by (2°)²/24.
        let right = [RADIUS * (angle - zero), y - origin.y];
        assert!((u - right[0]).abs() < 1e-5 && (v - right[1]).abs() < 1e-6, "{kind:?}: {u} {v} {right:?}");
        let normal = DVec3::new(angle.sin(), 0.0, angle.cos());
        let position = DVec3::from_array(percept.position.unwrap());
        // Taxels lie 10 mm apart; the surface between them comes back to a hundredth of that.
        let off = position.distance(normal * RADIUS + DVec3::Y * y);
        assert!(off < 1e-4, "{kind:?}: {off} m");
        assert!(DVec3::from_array(percept.normal.unwrap()).angle_between(normal).to_degrees() < 2.0);
        assert!(percept.orientation.is_some() && percept.principal_axis.is_some());
    }
    let mut engine = engine(&body, somatic::BackendKind::Cpu);
    let (_, agreement) = engine.process_and_compare(&[frame(0.0, &values)]).unwrap();
    assert!(agreement.holds(), "{agreement:?}");
}

#[test]
fn where_no_chart_can_be_the_reason_says_why() {
    let step = TAU / 120.0;
    let around = tube(-PI, step, 120, |_, _| false);
    let reason = |mesh: &MeshData, taxels: &[Taxel], origin: Option<[f64; 3]>| {
        let chart = origin.map(|origin| somatic::body::ChartSpec {
            kind: ChartKind::Geodesic,
            origin_in_anchor: Some(origin),
            u_in_anchor: None,
        });
        let spec = FieldSpec { chart, ..all_of(taxels) };
        Unroller::new(&written(mesh, taxels, &[])).unroll(&spec)
    };
    // All the way round: two ways meet at the back.
    let ring = grid(-PI, step, (0..16).map(|i| -PI + 0.01 + f64::from(i) * TAU / 16.0));
    let front = Some([0.0, 0.06, RADIUS]);
    let why = reason(&around, &ring, front).unwrap_err();
    assert!(matches!(why, NoChart::CutLocus { .. } | NoChart::Torn(..)), "{why}");
    assert!(why.to_string().contains("goes all the way around"), "{why}");
    // Three quarters of it are no problem for the same tube.
    let most = grid(-PI, step, (2..14).map(|i| -PI + 0.01 + f64::from(i) * TAU / 16.0));
    reason(&around, &most, front).unwrap();

    // A hole behind which the way bends.
    let slit = tube(-PI, step, 120, |row, facet| row != 23 && (50..53).contains(&facet));
    let sides = grid(-PI, step, [-0.6, 0.6].into_iter());
    let why = reason(&slit, &sides, Some([RADIUS * 0.6_f64.sin(), 0.03, RADIUS * 0.6_f64.cos()])).unwrap_err();
    assert!(matches!(why, NoChart::Bent(..)), "{why}");
    reason(&around, &sides, front).unwrap();

    // Two parts that do not hang together.
    let parted = tube(-PI, step, 120, |_, facet| (50..53).contains(&facet) || (100..103).contains(&facet));
    let why = reason(&parted, &sides, Some([RADIUS * 0.6_f64.sin(), 0.06, RADIUS * 0.6_f64.cos()])).unwrap_err();
    assert_eq!(why, NoChart::Unreachable(0, 7));

    // No taxels, no surface, and a file whose chart lost its (u, v).
    assert_eq!(
        reason(&MeshData { triangles: vec![[0, 0, 0]], ..around.clone() }, &sides, front),
        Err(NoChart::NoSurface)
    );
    let empty = FieldSpec { name: "arm".into(), ..FieldSpec::default() };
    assert_eq!(Unroller::new(&written(&around, &sides, &[])).unroll(&empty), Err(NoChart::NoTaxels));
    let mut lost = reason(&around, &sides, front).unwrap();
    lost.members.get_mut(&3).unwrap().uv = None;
    let fields = FieldSet::new(&written(&around, &sides, &[lost])).unwrap();
    assert_eq!(fields.fields[0].chart, Err(NoChart::Unplaced(1)));
}

#[test]
fn real_and_hostile_meshes_are_survived() {
    let Some(files) = meshes() else { return };
    let (mut surfaces, mut charts, mut reasons) = (0, 0, Vec::new());
    for path in files {
        let Ok(mut body) = Body::load(&path) else { continue };
        for link in 0..body.links.len().min(4) {
            let began = Instant::now();
            let corners: Vec<DVec3> = body.triangles_in_link(link).flatten().collect();
            let triangles: Vec<[u32; 3]> =
                (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let topology = Topology::new(&corners, &triangles);
            assert_eq!(topology.triangles.len() + topology.flaws.degenerate + topology.flaws.doubled, triangles.len());
            let Ok(placed) = place_evenly(&topology.positions, &topology.triangles, 120, 1, &mut |_| true) else {
                continue;
            };
            assert_eq!(placed.len(), 120);
            surfaces += 1;
            let area: f64 = placed.iter().map(|placed| placed.point.area).sum();
            let spacing = (area / 120.0).sqrt();
            let apart = place_apart(&topology.positions, &topology.triangles, spacing, 1, &mut |_| true).unwrap();
            assert!(!apart.is_empty());
            let density = |placed: &somatic::internal::author::Placed| 1.0 + placed.point.normal.y;
            let _ = place_by_density(&topology.positions, &topology.triangles, 50, 1, density, &mut |_| true);
            body.taxels = placed
                .iter()
                .zip(0..)
                .map(|(placed, id)| Taxel {
                    id,
                    link,
                    position_in_link: placed.point.position,
                    normal_in_link: placed.point.normal,
                    area: placed.point.area,
                    modality: Modality::Pressure,
                    tangent_in_link: None,
                })
                .collect();
            // Patches around some of them, small and large, and all of it.
            let mut unroller = Unroller::new(&body);
            for (centre, share) in [(0, 8), (40, 8), (70, 30), (100, 30), (0, 120)] {
                let centre = placed[centre].point.position;
                let mut near: Vec<u32> = (0..120).collect();
                let away = |id: &u32| placed[*id as usize].point.position.distance(centre);
                near.sort_by(|a, b| away(a).total_cmp(&away(b)));
                let members = near[..share].iter().map(|&id| (id, MemberSpec::default())).collect();
                let spec = FieldSpec { name: "patch".into(), members, ..FieldSpec::default() };
                match unroller.unroll(&spec) {
                    Ok(laid) => {
                        assert!(laid.members.values().all(|m| m.uv.is_some_and(|uv| uv.iter().all(|x| x.is_finite()))));
                        charts += 1;
                    }
                    Err(why) => reasons.push(format!("{}: {why}", path.file_name().unwrap().display())),
                }
            }
            assert!(began.elapsed() < Duration::from_secs(10), "{}: {:?}", path.display(), began.elapsed());
        }
    }
    eprintln!("{surfaces} surfaces, {charts} charts, and:\n{}", reasons.join("\n"));
    assert!(surfaces >= 10 && charts >= 20, "{surfaces} surfaces, {charts} charts");
}
