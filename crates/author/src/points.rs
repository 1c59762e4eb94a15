//! Taxels at given places: empties and points in the file, or rows of a table, projected to the nearest surface.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;

use super::icub::IcubFile;
use super::placed::{Placed, SurfacePoint};
use super::recipe_values::Globs;
use super::rest_surface::RestSurface;
use super::{recipe, voronoi};
use crate::body::{Body, Hit, Modality, SurfaceIndex, read_taxel_table};
use crate::error::{Error, Result, failed, suggestion};
use crate::field::geodesic::barycentric;
use crate::limits::{self, MAX_TABLE_BYTES};

pub(super) struct GivenPoint {
    pub(super) id: Option<u32>,
    position_in_body: DVec3,
    /// The link on whose surface it is, if it is named and has any.
    link: Option<usize>,
    /// Its outward unit normal, if given.
    normal_in_body: Option<DVec3>,
    /// Its area, m², if given.
    area_m2: Option<f64>,
    /// What it measures, if given.
    modality: Option<Modality>,
    tangent_in_body: Option<DVec3>,
    name: String,
}

/// A place on the surface, and how far it was moved there, m.
pub(super) struct Snapped {
    pub(super) placed: Placed,
    pub(super) id: Option<u32>,
    /// What it measures, if that is its own.
    pub(super) modality: Option<Modality>,
    /// The tangent of one with three axes, if it has its own.
    pub(super) tangent_in_body: Option<DVec3>,
    pub(super) moved_m: f64,
}

impl Snapped {
    /// A place that nobody gave.
    pub(super) fn on_surface(placed: Placed) -> Self {
        Self { placed, id: None, modality: None, tangent_in_body: None, moved_m: 0.0 }
    }
}

/// The places of the marks called `names`, sorted by name, `tip.2` before `tip.10`.
pub(super) fn of_marks(rest_surface: &RestSurface<'_>, names: &Globs) -> Result<Vec<GivenPoint>> {
    let mut marks: Vec<_> = rest_surface.details.marks.iter().filter(|mark| names.matches(&mark.name)).collect();
    if marks.is_empty() {
        let known = rest_surface.details.marks.iter().map(|mark| mark.name.as_str());
        let asked = names.listed();
        return Err(failed!(
            "no empty and no mesh of points is called `{asked}`; {} (from Blender, export with `Loose Points` on)",
            suggestion(&asked, known)
        ));
    }
    marks.sort_by_key(|mark| natural(&mark.name));
    let given = marks.iter().flat_map(|mark| {
        mark.positions_in_body.iter().enumerate().map(|(index, &position_in_body)| GivenPoint {
            id: None,
            position_in_body,
            link: None,
            normal_in_body: None,
            area_m2: None,
            modality: None,
            tangent_in_body: None,
            name: if mark.positions_in_body.len() > 1 {
                format!("point {index} of `{}`", mark.name)
            } else {
                format!("`{}`", mark.name)
            },
        })
    });
    Ok(given.collect())
}

/// A sort key for names with numbers.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut pieces = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let letters = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, after) = rest.split_at(letters);
        let digits = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let (number, after) = after.split_at(digits);
        pieces.push((text.to_owned(), number.parse().unwrap_or(0)));
        rest = after;
    }
    pieces
}

/// The places in the table at `path`: columns `id`, `x`, `y`, `z` in metres, optionally `link` for coordinates in a link's
/// frame and on its surface, `nx`, `ny`, `nz` to choose between the sides of a thin part, `area` in m², `modality`, and `tx`, `ty`, `tz`
/// of taxels with three axes. If the place says what its taxels measure, `modality`, no row says something else.
pub(super) fn of_table(
    rest_surface: &RestSurface<'_>,
    path: &Path,
    modality: Option<Modality>,
) -> Result<Vec<GivenPoint>> {
    read_table(rest_surface, path, modality).map_err(|e| e.at(path.display()))
}

fn read_table(rest_surface: &RestSurface<'_>, path: &Path, modality: Option<Modality>) -> Result<Vec<GivenPoint>> {
    let file = limits::open(path, MAX_TABLE_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::failed("no such file; it must be next to the recipe"),
        _ => Error::failed(e.to_string()),
    })?;
    let mut given = Vec::new();
    for row in read_taxel_table(file, false)? {
        let (mut position_in_body, mut tangent_in_body, mut normal_in_body) = (row.position, row.tangent, row.normal);
        if let Some([own, wanted]) = row.modality.zip(modality).map(<[Modality; 2]>::from).filter(|[a, b]| a != b) {
            let (own, wanted) = (own.name(), wanted.name());
            let what =
                format!("taxel {} measures {own}, and the place's `modality` is {wanted}; remove one of them", row.id);
            return Err(Error::failed(what).at(format!("line {}", row.line)));
        }
        let find = |name: &String| find_link(rest_surface.body, name).map_err(|e| e.at(format!("line {}", row.line)));
        let link = row.link.as_ref().map(find).transpose()?;
        if let Some(link) = link {
            let body_from_link = rest_surface.body.links[link].body_from_link;
            position_in_body = body_from_link.transform_point3(position_in_body);
            tangent_in_body = tangent_in_body.map(|tangent| body_from_link.transform_vector3(tangent));
            normal_in_body = normal_in_body.map(|normal| body_from_link.transform_vector3(normal));
        }
        let name = format!("line {}: taxel {}", row.line, row.id);
        given.push(GivenPoint {
            id: Some(row.id),
            position_in_body,
            link,
            normal_in_body,
            area_m2: row.area_m2,
            modality: row.modality,
            tangent_in_body,
            name,
        });
    }
    Ok(given)
}

fn find_link(body: &Body, name: &str) -> Result<usize> {
    let hint = || suggestion(name, body.links.iter().map(|link| link.name.as_str()));
    body.link_index(name).ok_or_else(|| failed!("the body has no link `{name}`; {}", hint()))
}

/// The places of the taxels of `modality` in the iCub's position file at `path`, in the frame of `link` or of the link that
/// the file names; ids are channels plus `first_id`. Also returns notes.
pub(super) fn of_icub(
    rest_surface: &RestSurface<'_>,
    path: &Path,
    link: Option<&str>,
    modality: Modality,
    first_id: u32,
) -> Result<(Vec<GivenPoint>, Vec<String>)> {
    let place = |e: Error| e.at(path.display());
    let text = limits::read_to_string(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
    let mut file = IcubFile::read(&text).map_err(place)?;
    let link = find_link(rest_surface.body, link.unwrap_or(&file.part))?;
    let body_from_link = rest_surface.body.links[link].body_from_link;
    let chosen = file.taxels().filter(|(_, taxel)| taxel.modality == modality);
    let given: Vec<GivenPoint> = chosen
        .map(|(channel, taxel)| GivenPoint {
            id: Some(first_id.saturating_add(channel)),
            position_in_body: body_from_link.transform_point3(taxel.position_in_link),
            link: Some(link),
            normal_in_body: None,
            area_m2: None,
            modality: None,
            tangent_in_body: None,
            name: format!("channel {channel} of {}", path.display()),
        })
        .collect();
    if given.is_empty() {
        return Err(place(failed!("it has no taxel for {}", modality.name())));
    }
    let others = file.taxels().count() - given.len();
    let mut notes = std::mem::take(&mut file.notes);
    if others > 0 {
        let what =
            format!("{others} taxels for something else than {} are left to a place of their own", modality.name());
        notes.push(what);
    }
    let name = path.file_name().map_or(path.display().to_string(), |name| name.to_string_lossy().into_owned());
    Ok((given, notes.into_iter().map(|note| format!("{name}: {note}")).collect()))
}

/// Triangles, by their numbers, and their index.
type Part = (Vec<usize>, SurfaceIndex);

/// Triangles this near to a point meet there, m.
const MEET_M: f64 = 1e-6;

/// `given` projected to the nearest points of `region`: of those that name a link with a surface, to that; of those that have a normal,
/// to a side that faces as it does, within 90°.
pub(super) fn snap(
    rest_surface: &RestSurface<'_>,
    region: &[bool],
    given: &[GivenPoint],
    within_m: f64,
) -> Result<Vec<Snapped>> {
    let part = |is_of: &dyn Fn(usize) -> bool| -> Part {
        let triangles: Vec<usize> = (0..region.len()).filter(|&triangle| region[triangle] && is_of(triangle)).collect();
        let index = SurfaceIndex::of_triangles(triangles.iter().map(|&triangle| rest_surface.corners(triangle)));
        (triangles, index)
    };
    let all = part(&|_| true);
    let mut of_link: BTreeMap<usize, Part> = BTreeMap::new();
    for link in given.iter().filter_map(|place| place.link) {
        of_link.entry(link).or_insert_with(|| part(&|triangle| rest_surface.carries(triangle, link)));
    }
    let mut snapped = Vec::with_capacity(given.len());
    for place in given {
        // A link without a surface of its own is a frame alone.
        let own = place.link.and_then(|link| of_link.get(&link)).filter(|(_, index)| !index.is_empty());
        let (triangles, index) = own.unwrap_or(&all);
        let hit = nearest(index, place).ok_or_else(|| match place.normal_in_body {
            Some(_) if !index.is_empty() => {
                failed!("{}: no surface faces as its normal does; correct nx, ny, nz or leave them out", place.name)
            }
            _ => Error::failed("the surface has no area to put taxels on"),
        })?;
        let moved_m = hit.position.distance(place.position_in_body);
        if moved_m > within_m {
            let of = match (place.link.filter(|_| own.is_some()), place.normal_in_body) {
                (Some(link), None) => format!(" of `{}`", rest_surface.body.links[link].name),
                (Some(link), Some(_)) => {
                    format!(" of `{}` that faces as its normal does", rest_surface.body.links[link].name)
                }
                (None, Some(_)) => " that faces as its normal does".to_owned(),
                (None, None) => String::new(),
            };
            return Err(failed!(
                "{} lies {} from the surface{of}, farther than the {} of `within`; correct it, or raise `within`",
                place.name,
                recipe::shown(moved_m),
                recipe::shown(within_m)
            ));
        }
        let triangle = triangles[hit.triangle];
        let barycentric = barycentric(rest_surface.corners(triangle), hit.position);
        let point = SurfacePoint { position: hit.position, normal: hit.normal, area: 0.0 };
        snapped.push(Snapped {
            placed: Placed { point, triangle, barycentric },
            id: place.id,
            modality: place.modality,
            tangent_in_body: place.tangent_in_body,
            moved_m,
        });
    }
    let placed: Vec<Placed> = snapped.iter().map(|snapped| snapped.placed).collect();
    let all_known = given.iter().all(|place| place.area_m2.is_some());
    let cells = if all_known { vec![0.0; placed.len()] } else { voronoi::areas(rest_surface, &placed) };
    for ((snapped, place), cell) in snapped.iter_mut().zip(given).zip(cells) {
        snapped.placed.point.area = place.area_m2.unwrap_or(cell);
    }
    Ok(snapped)
}

/// The point of the surface in `index` for `place`. On an edge its triangle is the one that faces most as the normal does.
fn nearest(index: &SurfaceIndex, place: &GivenPoint) -> Option<Hit> {
    let Some(facing) = place.normal_in_body else { return index.nearest(place.position_in_body) };
    let hit = index.nearest_where(place.position_in_body, |normal| normal.dot(facing) > 0.0)?;
    let meet = index.triangles_within(hit.position, MEET_M);
    let (triangle, normal) = meet.max_by(|a, b| a.1.dot(facing).total_cmp(&b.1.dot(facing)).then(b.0.cmp(&a.0)))?;
    Some(if normal.dot(facing) > hit.normal.dot(facing) {
        Hit { normal, triangle: triangle as usize, ..hit }
    } else {
        hit
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use crate::body::{Body, Glb, MeshData, Modality, Original};
    use crate::field::FieldSet;
    use crate::{Recipe, author};

    /// Boxes about their links' origins: name, place of the link, half sides, m.
    fn boxes(of: &[(&str, DVec3, [f32; 3])]) -> Original {
        let mut glb = Glb::new();
        for &(name, place, half) in of {
            let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] });
            let mesh = MeshData {
                positions: (0..8).map(corner).collect(),
                normals: vec![[0.0, 0.0, 1.0]; 8],
                triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
                skinning: None,
            };
            let node = glb.node(name, None, place);
            glb.mesh(node, name, &mesh, None, None);
        }
        Original::from_bytes("boxes.glb", &glb.to_bytes().unwrap(), None).unwrap()
    }

    #[test]
    fn a_row_comes_to_the_surface_of_its_link_and_to_the_side_of_its_normal() {
        let folder = tempfile::tempdir().unwrap();
        let made = |csv: &str| {
            std::fs::write(folder.path().join("a.csv"), csv).unwrap();
            let recipe = Recipe::parse("a.toml", "[[place]]\ncsv = \"a.csv\"\n", folder.path()).unwrap();
            // Fingers 1 mm apart.
            let right = DVec3::new(0.0, 0.0, 0.003);
            let plate = [0.01, 0.02, 0.001];
            author(boxes(&[("left", DVec3::ZERO, plate), ("right", right, plate)]), &recipe, |_| {})
        };
        let place = |body: &Body, taxel: usize| {
            let taxel = &body.taxels[taxel];
            (body.links[taxel.link].name.clone(), taxel.position_in_link, taxel.normal_in_link)
        };
        let is = |found: (String, DVec3, DVec3), link: &str, z: f64, normal: DVec3| {
            let near = (found.1.z - z).abs() < 1e-7 && found.2.distance(normal) < 1e-6;
            assert!(found.0 == link && near, "{found:?}");
        };
        // The first is nearest to the right finger, in the left one's frame; the last on an edge.
        let body = made(
            "id,link,x,y,z,nx,ny,nz\n0,left,0,0,0.0018,,,\n1,left,0.004,0,0.0002,0,0,-1\n2,right,0.004,0.01,-0.0002,0.1,0,1\n\
             3,left,0.01,0,0.001,1,0,0.1\n4,left,0.01,0.01,0.001,0.1,0,1\n",
        );
        let body = body.unwrap().body;
        is(place(&body, 0), "left", 0.001, DVec3::Z);
        is(place(&body, 1), "left", -0.001, DVec3::NEG_Z);
        is(place(&body, 2), "right", 0.001, DVec3::Z);
        is(place(&body, 3), "left", 0.001, DVec3::X);
        is(place(&body, 4), "left", 0.001, DVec3::Z);
        let why = made("id,link,x,y,z,nx,ny,nz\n7,left,0,0,0.09,,,\n").unwrap_err().to_string();
        assert!(why.contains("line 2: taxel 7 lies 89.0 mm from the surface of `left`, farther than"), "{why}");
    }

    #[test]
    fn other_kinds_join_the_field_of_their_own_side_of_a_thin_shell() {
        let place = |first: u32, taxels: u32, kind: &str| {
            format!("[[place]]\nname = \"{kind}\"\nfirst_id = {first}\ntaxels = {taxels}\nmodality = \"{kind}\"\n")
        };
        let text = place(0, 120, "pressure") + &place(1000, 40, "temperature");
        let recipe = Recipe::parse("a.toml", &text, Path::new("")).unwrap();
        let palm = boxes(&[("palm", DVec3::ZERO, [0.05, 0.05, 0.0005])]);
        let body = author(palm, &recipe, |_| {}).unwrap().body;
        let fields = FieldSet::new(&body).unwrap().fields;
        let mut warm = 0;
        for field in fields.iter().filter(|field| field.name.contains('/')) {
            let of = |is_warm: bool| {
                let members = field.members.iter().map(|member| &body.taxels[member.taxel]);
                members.filter(move |taxel| (taxel.modality == Modality::Temperature) == is_warm)
            };
            for taxel in of(true) {
                let is_beside = of(false).any(|pressed| pressed.normal_in_link.dot(taxel.normal_in_link) > 0.0);
                assert!(is_beside || of(false).next().is_none(), "{}: {taxel:?}", field.name);
                warm += 1;
            }
        }
        assert!(warm >= 40, "{warm}");
    }
}
