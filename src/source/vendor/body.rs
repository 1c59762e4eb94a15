//! The body of a recording: each panel a flat sheet that looks up, with a field of all its cells.

use std::collections::HashMap;

use glam::DVec3;

use super::layout::{Cell, Layout, Panel};
use crate::body::{ChartKind, ChartSpec, FieldSpec, Glb, MAX_TAXEL_ID, MemberSpec, MeshData, Modality, Taxel};
use crate::error::{Result, failed};

/// Corners nearer to each other than this are one, m.
const SAME_CORNER_M: f64 = 1e-7;

/// A `.glb` with the sensors of `layout`. The page's x is x and its y is −z; y is the normal.
pub(super) fn glb(layout: &Layout) -> Result<Vec<u8>> {
    if let Some(id) = layout.ids().into_iter().find(|id| *id > MAX_TAXEL_ID) {
        return Err(failed!("id {id} is over the {MAX_TAXEL_ID} that a body can hold"));
    }
    let mut glb = Glb::new();
    let material = glb.material("sheet", [0.25, 0.32, 0.42], 0.9);
    for panel in &layout.panels {
        let link = glb.node(&panel.name, None, place(panel.offset_m));
        if panel.is_placed {
            glb.mesh(link, &panel.name, &sheet(panel), Some(material), None);
        }
        let taxels: Vec<Taxel> = panel.cells.iter().map(taxel).collect();
        glb.taxels(&format!("{} taxels", panel.name), Some(link), &taxels, None);
        let centre = taxels.iter().map(|taxel| taxel.position_in_link).sum::<DVec3>() / taxels.len().max(1) as f64;
        let none = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
        let field = FieldSpec {
            name: panel.name.clone(),
            parent: None,
            members: panel.cells.iter().map(|cell| (cell.id, MemberSpec::default())).collect(),
            chart: (!panel.is_placed).then_some(none),
        };
        glb.field(&field, Some(link), centre);
    }
    glb.to_bytes()
}

fn place([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x, 0.0, -y)
}

fn taxel(cell: &Cell) -> Taxel {
    Taxel {
        id: cell.id,
        link: 0,
        position_in_link: place(cell.centre_m),
        normal_in_link: DVec3::Y,
        area: cell.area_m2,
        modality: Modality::Pressure,
    }
}

/// Two triangles for each cell, which share the corners of their neighbours.
fn sheet(panel: &Panel) -> MeshData {
    let mut mesh = MeshData::default();
    let mut known: HashMap<[i64; 2], u32> = HashMap::new();
    for cell in &panel.cells {
        let [a, b, c, d] = counter_clockwise(cell.corners_m).map(|corner| {
            let key = corner.map(|x| (x / SAME_CORNER_M).round() as i64);
            *known.entry(key).or_insert_with(|| {
                mesh.positions.push(place(corner).as_vec3().to_array());
                mesh.normals.push([0.0, 1.0, 0.0]);
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// The same corners, counter-clockwise on the page, and so as seen from above.
fn counter_clockwise([a, b, c, d]: [[f64; 2]; 4]) -> [[f64; 2]; 4] {
    let (one, other) = ([c[0] - a[0], c[1] - a[1]], [d[0] - b[0], d[1] - b[1]]);
    if one[0] * other[1] - one[1] * other[0] < 0.0 { [a, d, c, b] } else { [a, b, c, d] }
}
