//! Flat sheets of sensors. Each is a link with a mesh of its cells, its taxels, and its fields.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;

use super::glb::{Glb, MeshData};
use super::layout::{ChartKind, ChartSpec, FieldSpec, MAX_TAXEL_ID, MemberSpec};
use super::model::{Modality, Taxel};
use crate::error::{Error, Result, failed};

/// Cells whose corners are nearer to each other than this share them, m.
const SAME_CORNER_M: f64 = 1e-7;

/// A flat sheet of sensors: a link, the field of all its cells, and fields of parts.
///
/// Its coordinates are (u, v) in metres, as on paper: u to the right, v up the page, seen from the side that is touched. In
/// its link's frame that is x and −z, and y is the normal. They are the coordinates of its field's chart, but for the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Name of the link and of the field of all cells.
    pub name: String,
    /// The sensors.
    pub cells: Vec<SheetCell>,
    /// Fields below that of all cells: a name and the ids of cells. They are called `sheet/part`.
    pub parts: Vec<(String, Vec<u32>)>,
    /// Where the origin of its coordinates is in the body, m.
    pub origin_in_body: DVec3,
    /// Whether it is known where its cells are. If not, there is neither a mesh nor a chart.
    pub has_places: bool,
}

/// One sensor of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetCell {
    /// The taxel's id.
    pub id: u32,
    /// The taxel's place, m.
    pub centre: [f64; 2],
    /// Its corners one after the other in either direction, m.
    pub corners: [[f64; 2]; 4],
    /// The area that it measures, m².
    pub area_m2: f64,
    /// What it measures; of three axes the tangential ones are along u and v.
    pub modality: Modality,
}

impl SheetCell {
    /// A rectangle around `centre`, `width_m` along u and `height_m` along v, which measures the pressure on all of its area.
    #[must_use]
    pub fn rectangle(id: u32, centre: [f64; 2], width_m: f64, height_m: f64) -> Self {
        let corner = |u: f64, v: f64| [centre[0] + u * width_m / 2.0, centre[1] + v * height_m / 2.0];
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Self { id, centre, corners, area_m2: width_m * height_m, modality: Modality::Pressure }
    }

    /// The same that measures force along three axes, if `has_axes`.
    #[must_use]
    pub fn with_axes(self, has_axes: bool) -> Self {
        if has_axes { Self { modality: Modality::Force3, ..self } } else { self }
    }

    /// Its corners, counter-clockwise seen from the side that is touched.
    fn counter_clockwise(&self) -> [[f64; 2]; 4] {
        let [a, b, c, d] = self.corners;
        let across = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
        let (one, other) = (across(a, c), across(b, d));
        if one[0] * other[1] - one[1] * other[0] < 0.0 { [a, d, c, b] } else { self.corners }
    }
}

impl Sheet {
    /// A sheet of `cells` with one field.
    #[must_use]
    pub fn new(name: &str, cells: Vec<SheetCell>) -> Self {
        Self { name: name.to_owned(), cells, parts: Vec::new(), origin_in_body: DVec3::ZERO, has_places: true }
    }

    /// The same with its origin elsewhere: beside another sheet.
    #[must_use]
    pub fn at(self, origin_in_body: DVec3) -> Self {
        Self { origin_in_body, ..self }
    }

    /// Its extent along u and v, m: the lower and the upper corner.
    #[must_use]
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let corners = self.cells.iter().flat_map(|cell| cell.corners);
        corners.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], [u, v]| {
            [[low[0].min(u), low[1].min(v)], [high[0].max(u), high[1].max(v)]]
        })
    }

    fn check(&self) -> Result<()> {
        if self.name.trim().is_empty() {
            return Err(Error::failed("a sheet has no name; give it one"));
        }
        if self.cells.is_empty() {
            return Err(failed!("the sheet `{}` has no cells; give it at least one", self.name));
        }
        for cell in &self.cells {
            let numbers = cell.corners.as_flattened().iter().chain(&cell.centre);
            if !(numbers.into_iter().all(|x| x.is_finite()) && cell.area_m2 >= 0.0 && cell.area_m2.is_finite()) {
                return Err(failed!("cell {} of the sheet `{}` is not finite; correct it", cell.id, self.name));
            }
            if cell.id > MAX_TAXEL_ID {
                return Err(failed!("id {} is over the {MAX_TAXEL_ID} that a file can hold", cell.id));
            }
        }
        Ok(())
    }

    /// Every cell as two triangles. Cells share the corners that they have in common.
    fn mesh(&self) -> MeshData {
        let mut mesh = MeshData::default();
        let mut known: HashMap<[i64; 2], u32> = HashMap::new();
        for cell in &self.cells {
            let corners = cell.counter_clockwise().map(|corner| {
                *known.entry(corner.map(|x| (x / SAME_CORNER_M).round() as i64)).or_insert_with(|| {
                    mesh.positions.push(in_link(corner).as_vec3().to_array());
                    mesh.normals.push([0.0, 1.0, 0.0]);
                    mesh.positions.len() as u32 - 1
                })
            });
            let [a, b, c, d] = corners;
            let is_flat = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
            mesh.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|triangle| !is_flat(*triangle)));
        }
        mesh
    }

    fn taxels(&self) -> Vec<Taxel> {
        let taxel = |cell: &SheetCell| Taxel {
            id: cell.id,
            link: 0,
            position_in_link: in_link(cell.centre),
            normal_in_link: DVec3::Y,
            area: cell.area_m2,
            modality: cell.modality,
            tangent_in_link: None,
        };
        self.cells.iter().map(taxel).collect()
    }

    /// The mean place of the cells at `indices`, ascending.
    fn middle_of(&self, indices: impl IntoIterator<Item = usize>) -> DVec3 {
        let chosen = indices.into_iter().map(|index| &self.cells[index]);
        let (sum, count) = chosen.fold((DVec3::ZERO, 0), |(sum, count), cell| (sum + in_link(cell.centre), count + 1));
        sum / f64::from(count.max(1))
    }
}

/// (u, v) of a sheet in its link's frame.
fn in_link([u, v]: [f64; 2]) -> DVec3 {
    DVec3::new(u, 0.0, -v)
}

/// A body of `sheets`: each a link of its own with a mesh, its taxels, and its fields with charts.
///
/// # Errors
/// Two sheets have the same name, two cells the same id, a part names an unknown cell, or a cell is invalid.
pub fn sheets(sheets: &[Sheet]) -> Result<Glb> {
    let (mut names, mut ids) = (BTreeSet::new(), BTreeSet::new());
    let mut glb = Glb::new();
    let fabric = glb.material("sheet", [0.25, 0.32, 0.42], 0.9);
    for sheet in sheets {
        sheet.check()?;
        let parts = sheet.parts.iter().map(|(part, ids)| (format!("{}/{part}", sheet.name), ids));
        let parts: Vec<(String, &Vec<u32>)> = parts.collect();
        for name in std::iter::once(&sheet.name).chain(parts.iter().map(|(name, _)| name)) {
            if !names.insert(name.clone()) {
                return Err(failed!("two sheets or parts are called `{name}`; give each a name of its own"));
            }
        }
        let own: HashMap<u32, usize> = sheet.cells.iter().zip(0..).map(|(cell, index)| (cell.id, index)).collect();
        if let Some(id) = sheet.cells.iter().map(|cell| cell.id).find(|&id| !ids.insert(id)) {
            return Err(failed!("id {id} is used twice; give each cell of the body an id of its own"));
        }
        if let Some((name, id)) =
            parts.iter().find_map(|(name, ids)| Some((name, ids.iter().find(|&id| !own.contains_key(id))?)))
        {
            return Err(failed!("`{name}` holds cell {id}, which the sheet does not have"));
        }
        let link = glb.node(&sheet.name, None, sheet.origin_in_body);
        let mesh = sheet.mesh();
        // Cells of an unknown size have no triangles.
        if sheet.has_places && !mesh.triangles.is_empty() {
            glb.mesh(link, &sheet.name, &mesh, Some(fabric), None);
        }
        glb.taxels(&format!("{} taxels", sheet.name), Some(link), &sheet.taxels(), None);
        let all = sheet.cells.iter().map(|cell| cell.id);
        let no_chart = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
        let chart = (!sheet.has_places).then_some(no_chart);
        let whole = FieldSpec { name: sheet.name.clone(), chart, ..FieldSpec::default() }.with_members(all);
        glb.field(&whole, Some(link), sheet.middle_of(0..sheet.cells.len()));
        for (name, ids) in parts {
            let members = ids.iter().map(|&id| (id, MemberSpec::default())).collect();
            let parent = Some(sheet.name.clone());
            // In the order of the cells, so that the sum is the same whatever the order of the part.
            let cells: BTreeSet<usize> = ids.iter().map(|id| own[id]).collect();
            glb.field(&FieldSpec { name, parent, members, chart: None }, Some(link), sheet.middle_of(cells));
        }
    }
    if sheets.is_empty() {
        return Err(Error::failed("a body of sheets needs at least one"));
    }
    Ok(glb)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells in `rows` and `columns`, 10 mm apart.
    fn grid(rows: u32, columns: u32) -> Sheet {
        let centre = |id: u32| [0.01 * f64::from(id % columns), -0.01 * f64::from(id / columns)];
        Sheet::new("mat", (0..rows * columns).map(|id| SheetCell::rectangle(id, centre(id), 0.01, 0.01)).collect())
    }

    fn upward_area(mesh: &MeshData) -> f64 {
        let at = |v: u32| glam::Vec3::from(mesh.positions[v as usize]).as_dvec3();
        mesh.triangles.iter().map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).y / 2.0).sum()
    }

    #[test]
    fn cells_share_corners_and_cover_the_sheet() {
        let mesh = grid(4, 5).mesh();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (5 * 6, 2 * 20));
        assert!((upward_area(&mesh) - 20.0 * 1e-4).abs() < 1e-9, "it faces whoever touches it");
    }

    #[test]
    fn a_cell_given_clockwise_faces_up_too() {
        let mut sheet = grid(1, 1);
        let before = upward_area(&sheet.mesh());
        sheet.cells[0].corners.reverse();
        assert!(before > 0.0 && (before - upward_area(&sheet.mesh())).abs() < 1e-12);
    }

    #[test]
    fn three_axes_are_the_normal_and_those_of_the_paper() {
        let mut sheet = grid(1, 2);
        sheet.cells[1] = sheet.cells[1].with_axes(true);
        let body = crate::body::Body::from_bytes("a.glb", &sheets(&[sheet]).unwrap().to_bytes().unwrap()).unwrap();
        assert_eq!([0, 1].map(|at: usize| body.taxels[at].modality), [Modality::Pressure, Modality::Force3]);
        // Right and up on paper are x and −z of the link.
        assert_eq!(body.taxels[1].tangents_in_link(), [DVec3::X, DVec3::NEG_Z]);
    }

    #[test]
    fn cells_without_places_have_neither_mesh_nor_chart() {
        let nowhere =
            |id| SheetCell { corners: [[0.0; 2]; 4], area_m2: 0.0, ..SheetCell::rectangle(id, [0.0; 2], 0.0, 0.0) };
        let mut sheet = Sheet::new("left", vec![nowhere(1), nowhere(2)]);
        sheet.has_places = false;
        let body = crate::body::Body::from_bytes("a.glb", &sheets(&[sheet]).unwrap().to_bytes().unwrap()).unwrap();
        assert_eq!((body.surfaces.len(), body.taxels.len()), (0, 2));
        assert_eq!(body.fields[0].chart.map(|chart| chart.kind), Some(ChartKind::None));
    }
}
