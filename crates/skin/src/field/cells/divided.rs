//! The cells of points that were placed on a surface: their areas, and what their edges are made of.

use glam::DVec3;

use super::{Cells, Piece};
use crate::body::{NONE, SurfaceIndex, Topology, point_tree};
use crate::field::geodesic::SurfacePlace;

/// cos 90° with a tolerance for rounding: the two faces at a box's edge are on one side, those of a sharper edge are not.
const MIN_NORMAL_COSINE: f64 = -1e-9;

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct CellPoint {
    /// Its position, m.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Index of its triangle.
    pub triangle: usize,
}

/// A surface divided among points.
pub struct Divided {
    /// The surface.
    pub topology: Topology,
    /// Per point.
    pub places: Vec<SurfacePlace>,
    /// The cells of the points.
    pub cells: Cells,
}

impl Divided {
    /// Per point the area of its cell on `triangles` over `positions`, m²; points at one place share theirs. Together they have the
    /// surface's area: pieces without a point belong to the nearest on their side, in a straight line. Vertices of different
    /// groups are never connected. Triangles for which `is_skin` is false, if given, have no area. The second part is what they
    /// are of; `None` if there is no surface.
    pub fn with_areas(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        group_of: &dyn Fn(u32) -> u32,
        is_skin: Option<&dyn Fn(usize) -> bool>,
        points: &[CellPoint],
    ) -> (Vec<f64>, Option<Self>) {
        let topology = Topology::of_groups(positions, triangles, group_of);
        let mut sound = vec![NONE; triangles.len()];
        (0..).zip(&topology.given).for_each(|(index, &given)| sound[given as usize] = index);
        let mut index = None;
        let mut place = |point: &CellPoint| {
            let triangle = match sound[point.triangle] {
                // It is degenerate, or a duplicate.
                NONE => {
                    let all = || (0..topology.triangles.len() as u32).map(|triangle| topology.corners(triangle));
                    let index = index.get_or_insert_with(|| SurfaceIndex::of_triangles(all()));
                    index.nearest(point.position)?.triangle as u32
                }
                triangle => triangle,
            };
            Some(SurfacePlace::in_triangle(&topology, triangle, point.position))
        };
        let places: Option<Vec<SurfacePlace>> = points.iter().map(&mut place).collect();
        let Some(places) = places else { return (vec![0.0; points.len()], None) };
        let mut cells = match is_skin {
            Some(is_skin) => {
                Cells::of_skin(&topology, &places, &|triangle| is_skin(topology.given[triangle as usize] as usize))
            }
            None => Cells::new(&topology, &places),
        };
        let mut pieces = std::mem::take(&mut cells.pieces);
        let left_out = (0..triangles.len())
            .filter(|&triangle| sound[triangle] == NONE && is_skin.is_none_or(|is_skin| is_skin(triangle)));
        let corners = |triangle: usize| triangles[triangle].map(|v| positions.get(v as usize).copied());
        let corners = left_out.filter_map(|triangle| match corners(triangle) {
            [Some(a), Some(b), Some(c)] => Some([a, b, c]),
            _ => None,
        });
        pieces.extend(corners.map(Piece::from_corners).filter(|piece| piece.area > 0.0));
        let (mut areas, first) = (cells.areas.clone(), &cells.first);
        give_away(&pieces, points, |owner, area| areas[first[owner] as usize] += area);
        let mut sharing = vec![0_u32; points.len()];
        first.iter().for_each(|&first| sharing[first as usize] += 1);
        let areas = first.iter().map(|&first| areas[first as usize] / f64::from(sharing[first as usize])).collect();
        (areas, Some(Self { topology, places, cells }))
    }
}

/// Gives each piece to the nearest of `points` that is on its side, else to the nearest.
fn give_away(pieces: &[Piece], points: &[CellPoint], mut give: impl FnMut(usize, f64)) {
    if pieces.is_empty() {
        return;
    }
    let tree = point_tree(points.iter().map(|point| point.position));
    for piece in pieces {
        let nearest = || tree.nearest_neighbor_iter(piece.middle.to_array()).map(|spot| spot.data);
        let facing = nearest().find(|&point| points[point].normal.dot(piece.normal) > MIN_NORMAL_COSINE);
        if let Some(owner) = facing.or_else(|| nearest().next()) {
            give(owner, piece.area);
        }
    }
}
