//! What a layout's lint finds, one defect at a time on a sound plate, and how much of it is covered.

use std::path::Path;
use std::time::{Duration, Instant};

use glam::DVec3;
use somatic::Body;
use somatic::author::{FindingKind, coverage, lint};
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::field::FieldSet;
use somatic::internal::author::{Placed, place_evenly};
use somatic::internal::body::{Glb, MeshData};
use somatic::internal::field::Unroller;

/// A sheet of 0.1 m × 0.1 m about the origin that looks along +z, with 10 × 10 taxels 10 mm apart in one field. `height`
/// lifts it, by x.
pub(crate) struct Plate {
    mesh: MeshData,
    pub(crate) taxels: Vec<Taxel>,
    pub(crate) fields: Vec<FieldSpec>,
}

impl Plate {
    pub(crate) fn flat() -> Self {
        Self::lifted("plate", |_| 0.0, |_| DVec3::Z)
    }

    /// With an edge along y on top, from which both sides fall at 45°.
    pub(crate) fn ridge() -> Self {
        Self::lifted("ridge", |x| -x.abs(), |x| DVec3::new(x.signum(), 0.0, 1.0).normalize())
    }

    fn lifted(name: &str, height: impl Fn(f64) -> f64, normal: impl Fn(f64) -> DVec3) -> Self {
        let mut mesh = MeshData::default();
        for row in 0..=10 {
            for column in 0..=10 {
                let [x, y] = [column, row].map(|i| 0.01 * f64::from(i) - 0.05);
                mesh.positions.push([x, y, height(x)].map(|x| x as f32));
                mesh.normals.push([0.0, 0.0, 1.0]);
            }
        }
        for row in 0..10_u32 {
            for column in 0..10 {
                let a = 11 * row + column;
                mesh.triangles.extend([[a, a + 1, a + 12], [a, a + 12, a + 11]]);
            }
        }
        let taxels: Vec<Taxel> = (0..100_u32)
            .map(|id| {
                let [x, y] = [id % 10, id / 10].map(|i| 0.01 * f64::from(i) - 0.045);
                Taxel {
                    id,
                    link: 0,
                    position_in_link: DVec3::new(x, y, height(x)),
                    normal_in_link: normal(x),
                    area: 1e-4,
                    modality: Modality::Pressure,
                    tangent_in_link: None,
                }
            })
            .collect();
        let members = taxels.iter().map(|taxel| (taxel.id, MemberSpec::default())).collect();
        let field = FieldSpec { name: name.to_owned(), members, ..FieldSpec::default() };
        Self { mesh, taxels, fields: vec![field] }
    }

    /// Gives its first field a geodesic chart about the middle, u along x.
    pub(crate) fn geodesic(&mut self) {
        let body = self.body();
        let asked = ChartSpec {
            kind: ChartKind::Geodesic,
            origin_in_anchor: Some([0.0, 0.0, 0.0]),
            u_in_anchor: Some([1.0, 0.0, 0.0]),
        };
        let spec = FieldSpec { chart: Some(asked), ..body.fields[0].clone() };
        self.fields[0] = Unroller::new(&body).unroll(&spec).unwrap();
    }

    pub(crate) fn body(&self) -> Body {
        Body::from_bytes("plate", &self.glb().to_bytes().unwrap()).unwrap()
    }

    pub(crate) fn save(&self, path: &Path) {
        self.glb().save(somatic::OutputPath::new(path, true, &[]).unwrap()).unwrap();
    }

    fn glb(&self) -> Glb {
        let mut glb = Glb::new();
        let link = glb.node("arm", None, DVec3::ZERO);
        glb.mesh(link, "skin", &self.mesh, None, None);
        glb.taxels("taxels", Some(link), &self.taxels, None);
        for field in &self.fields {
            glb.field(field, Some(link), DVec3::ZERO);
        }
        glb
    }

    fn add(&mut self, id: u32, x: f64, y: f64, z: f64) {
        let taxel = Taxel { id, position_in_link: DVec3::new(x, y, z), ..self.taxels[0].clone() };
        self.taxels.push(taxel);
        self.fields[0].members.insert(id, MemberSpec::default());
    }
}

/// The kinds of what is found in `body`, in order.
pub(crate) fn kinds(body: &Body) -> Vec<FindingKind> {
    let fields = FieldSet::new(body).unwrap().fields;
    lint(body, &fields).iter().map(|finding| finding.kind).collect()
}

/// What is found on a flat plate after `change`: of one kind, at these taxels, that bad.
fn found(change: impl FnOnce(&mut Plate)) -> (FindingKind, Vec<u32>, Option<f64>) {
    let mut plate = Plate::flat();
    change(&mut plate);
    let body = plate.body();
    let findings = lint(&body, &FieldSet::new(&body).unwrap().fields);
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    let text = finding.to_string();
    assert!(text.contains(finding.remedy()) && !text.contains('\n'), "{text}");
    (finding.kind, finding.taxels.clone(), finding.worst)
}

#[test]
fn a_sound_plate_is_clean() {
    assert_eq!(kinds(&Plate::flat().body()), []);
    assert_eq!(kinds(&Plate::ridge().body()), []);
}

#[test]
fn a_link_of_millimetres_is_asked_about() {
    let mut plate = Plate::flat();
    plate.add(100, 40.0, 0.0, 0.0);
    let body = plate.body();
    let findings = lint(&body, &FieldSet::new(&body).unwrap().fields);
    let large = findings.iter().find(|finding| finding.kind == FindingKind::LargeLink).unwrap();
    assert!(large.to_string().contains("up to 40 m; millimetres?"), "{large}");
}

#[test]
fn each_defect_is_found_where_it_is_and_nothing_else() {
    let near = |worst: Option<f64>, expected: f64| (worst.unwrap() - expected).abs() < 1e-6;

    let (kind, taxels, _) = found(|plate| plate.add(100, -0.045, -0.045, 0.0));
    assert_eq!((kind, taxels), (FindingKind::CoincidentTaxels, vec![0, 100]));

    let (kind, taxels, worst) = found(|plate| plate.taxels[37].position_in_link.z += 0.002);
    assert_eq!((kind, taxels), (FindingKind::OffSurface, vec![37]));
    assert!(near(worst, 0.002));

    let (kind, taxels, worst) = found(|plate| plate.taxels[8].normal_in_link = DVec3::NEG_Z);
    assert_eq!((kind, taxels), (FindingKind::InwardNormal, vec![8]));
    assert!(near(worst, std::f64::consts::PI));

    let tilted = DVec3::new(1e-3_f64.sin(), 0.0, 1e-3_f64.cos());
    let (kind, taxels, worst) = found(|plate| plate.taxels[8].normal_in_link = tilted);
    assert_eq!((kind, taxels), (FindingKind::StaleNormal, vec![8]));
    assert!(near(worst, 1e-3));

    let (kind, taxels, _) = found(|plate| {
        plate.fields[0].members.remove(&42);
    });
    assert_eq!((kind, taxels), (FindingKind::UnusedTaxel, vec![42]));

    let (kind, _, worst) = found(|plate| {
        let members = [(3, MemberSpec::default()), (4, MemberSpec::default())].into();
        plate.fields.push(FieldSpec { name: "small".into(), members, ..FieldSpec::default() });
    });
    assert_eq!((kind, worst), (FindingKind::SmallField, Some(2.0)));

    // All but a corner and one taxel far from it.
    let (kind, taxels, worst) = found(|plate| {
        plate.taxels.retain(|taxel| taxel.id == 99 || (taxel.id % 10 < 4 && taxel.id < 40));
        let kept: Vec<u32> = plate.taxels.iter().map(|taxel| taxel.id).collect();
        plate.fields[0].members.retain(|id, _| kept.contains(id));
    });
    assert_eq!((kind, taxels), (FindingKind::IsolatedTaxel, vec![99]));
    assert!(near(worst, 0.06 * 2.0_f64.sqrt()));
}

/// A link of each spacing, with 20 × 20 taxels, the first at the origin; and one more taxel at each of `more`.
fn links(spacings_m: &[f64], more: &[(usize, DVec3)]) -> Body {
    let mut glb = Glb::new();
    let mut id = 0;
    for (index, &spacing_m) in spacings_m.iter().enumerate() {
        let link = glb.node(&format!("l{index}"), None, DVec3::X * index as f64);
        let grid = (0..400).map(|k| DVec3::new(f64::from(k % 20), f64::from(k / 20), 0.0) * spacing_m);
        let more = more.iter().filter(|(own, _)| *own == index).map(|(_, at)| *at);
        let model = Plate::flat().taxels[0].clone();
        let taxel = |(id, position_in_link): (u32, DVec3)| Taxel { id, position_in_link, ..model.clone() };
        let taxels: Vec<Taxel> = (id..).zip(grid.chain(more)).map(taxel).collect();
        id += taxels.len() as u32;
        glb.taxels(&format!("taxels {index}"), Some(link), &taxels, None);
    }
    Body::from_bytes("links", &glb.to_bytes().unwrap()).unwrap()
}

#[test]
fn spacing_is_compared_with_what_is_usual_around() {
    // A body whose hand is ten times as fine as its torso.
    assert_eq!(lint_of_spacing(&links(&[0.03, 0.003], &[])), []);
    let found = lint_of_spacing(&links(&[0.03, 0.003], &[(0, DVec3::new(0.216, 0.21, 0.0))]));
    assert_eq!(found, [(FindingKind::CrowdedTaxels, vec![147, 400])]);
    // What is near in the torso is far in the hand.
    let crowded = DVec3::new(0.0216, 0.021, 0.0);
    let found = lint_of_spacing(&links(&[0.03, 0.003], &[(1, crowded), (1, DVec3::new(-0.02, 0.0, 0.0))]));
    assert_eq!(found, [(FindingKind::CrowdedTaxels, vec![547, 800]), (FindingKind::IsolatedTaxel, vec![801])]);
    assert_eq!(lint_of_spacing(&links(&[0.03, 0.003], &[(0, DVec3::new(-0.03, 0.0, 0.0))])), []);
    // The two at a fifth are found, at a fourth they are not.
    let at = |share: f64| links(&[0.01], &[(0, DVec3::new(0.05 + 0.01 * share, 0.05, 0.0))]);
    assert_eq!(lint_of_spacing(&at(0.2)), [(FindingKind::CrowdedTaxels, vec![105, 400])]);
    assert_eq!(lint_of_spacing(&at(0.25)), []);
    // A link that is coarse on one side of a line, and fine on the other.
    let mut plate = Plate::flat();
    plate.taxels.retain(|taxel| taxel.position_in_link.x < 0.0);
    let model = plate.taxels[0].clone();
    for (id, k) in (100..).zip(0..1500) {
        let position_in_link = DVec3::new(0.0075 + 0.0015 * f64::from(k % 25), 0.0015 * f64::from(k / 25) - 0.045, 0.0);
        plate.taxels.push(Taxel { id, position_in_link, ..model.clone() });
    }
    plate.fields[0].members = plate.taxels.iter().map(|taxel| (taxel.id, MemberSpec::default())).collect();
    assert_eq!(lint_of_spacing(&plate.body()), []);
}

/// What is found of spacing in `body`, with the ids.
fn lint_of_spacing(body: &Body) -> Vec<(FindingKind, Vec<u32>)> {
    use FindingKind::{CoincidentTaxels, CrowdedTaxels, IsolatedTaxel};
    let mut findings = lint(body, &[]);
    findings.retain(|finding| matches!(finding.kind, CoincidentTaxels | CrowdedTaxels | IsolatedTaxel));
    findings.into_iter().map(|finding| (finding.kind, finding.taxels)).collect()
}

#[test]
fn what_editors_round_is_current() {
    let mut plate = Plate::flat();
    plate.taxels[3].position_in_link.z += 0.9e-6;
    plate.taxels[4].normal_in_link = DVec3::new(0.9e-5, 0.0, 1.0).normalize();
    // Another sensor at one place measures something else.
    plate.add(100, -0.045, -0.045, 0.0);
    plate.taxels[100].modality = Modality::Temperature;
    assert_eq!(kinds(&plate.body()), []);
}

#[test]
fn a_taxel_on_an_edge_may_have_the_normal_of_either_side() {
    for normal in [DVec3::new(1.0, 0.0, 1.0), DVec3::new(-1.0, 0.0, 1.0)] {
        let mut plate = Plate::ridge();
        plate.taxels[45].position_in_link = DVec3::new(0.0, 0.001, 0.0);
        plate.taxels[45].normal_in_link = normal.normalize();
        assert_eq!(kinds(&plate.body()), []);
    }
    let mut plate = Plate::ridge();
    plate.taxels[45].position_in_link = DVec3::new(0.0, 0.001, 0.0);
    plate.taxels[45].normal_in_link = DVec3::Z;
    assert_eq!(kinds(&plate.body()), [FindingKind::StaleNormal]);
}

#[test]
fn a_body_far_from_its_origin_is_no_worse() {
    // 10 km away, single precision is 1 mm: what it rounds is not the layout's fault.
    let mut plate = Plate::flat();
    let far = |x: f64| f64::from((x + 1e4) as f32);
    for corner in &mut plate.mesh.positions {
        corner[0] = far(f64::from(corner[0])) as f32;
    }
    plate.taxels.iter_mut().for_each(|taxel| taxel.position_in_link.x = far(taxel.position_in_link.x));
    let found = kinds(&plate.body());
    assert!(!found.contains(&FindingKind::OffSurface) && !found.contains(&FindingKind::StaleNormal), "{found:?}");
}

#[test]
fn coverage_is_the_area_within_a_taxels_spacing() {
    let whole = coverage(&Plate::flat().body());
    let (area, seen) = whole.of_skin();
    assert!((area - 0.01).abs() < 1e-8 && (seen - area).abs() < 1e-8, "{area} {seen}");
    assert!(whole.holes.is_empty());

    // The half at x > 0 loses its taxels. Those at x = −5 mm see 10 mm on, less between the rows, where the circle
    // around them has come in from 10 to √(10² − 5²) mm at most.
    let mut plate = Plate::flat();
    plate.taxels.retain(|taxel| taxel.position_in_link.x < 0.0);
    plate.fields[0].members.retain(|id, _| id % 10 < 5);
    let half = coverage(&plate.body());
    let (_, seen) = half.of_skin();
    let (least, most) = (0.1 * (0.05 - 0.005 + 0.0086), 0.1 * (0.05 - 0.005 + 0.0101));
    assert!((least..most).contains(&seen), "{least} {seen} {most}");
    let [hole] = &half.holes[..] else { panic!("{:?}", half.holes) };
    assert!((hole.area - (0.01 - seen)).abs() < 1e-6);
    assert!((hole.position_in_link - DVec3::new(0.0275, 0.0, 0.0)).length() < 0.002, "{hole:?}");
}

#[test]
fn the_far_side_of_a_sheet_is_not_seen() {
    let mut plate = Plate::flat();
    let there = plate.mesh.positions.len() as u32;
    let below: Vec<[f32; 3]> = plate.mesh.positions.iter().map(|&[x, y, _]| [x, y, -0.001]).collect();
    plate.mesh.positions.extend(below);
    plate.mesh.normals.extend(vec![[0.0, 0.0, -1.0]; there as usize]);
    let turned: Vec<[u32; 3]> = plate.mesh.triangles.iter().map(|t| [t[0], t[2], t[1]].map(|v| v + there)).collect();
    plate.mesh.triangles.extend(turned);
    let both = coverage(&plate.body());
    let (area, seen) = both.of_skin();
    assert!((area - 0.02).abs() < 1e-8 && (seen - 0.01).abs() < 1e-6, "{area} {seen}");
    let [hole] = &both.holes[..] else { panic!("{:?}", both.holes) };
    assert!((hole.position_in_link.z + 0.001).abs() < 1e-9 && (hole.area - 0.01).abs() < 1e-6);
}

#[test]
fn twenty_thousand_taxels_are_looked_at_in_time() {
    let mut plate = Plate::flat();
    let positions: Vec<DVec3> = plate.mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let placed = place_evenly(&positions, &plate.mesh.triangles, 20_000, 1, &mut |_| true).unwrap();
    let model = plate.taxels[0].clone();
    let taxel = |(id, placed): (u32, &Placed)| Taxel { id, position_in_link: placed.point.position, ..model.clone() };
    plate.taxels = (0..).zip(&placed).map(taxel).collect();
    plate.fields[0].members = (0..20_000).map(|id| (id, MemberSpec::default())).collect();
    let body = plate.body();
    let start = Instant::now();
    assert_eq!(kinds(&body), []);
    let (area, seen) = coverage(&body).of_skin();
    assert!(seen > 0.99 * area, "{seen} of {area}");
    // Seconds without optimisation, on a busy machine; a quadratic way takes minutes.
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}
