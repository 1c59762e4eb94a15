//! The surface of a whole body at rest, cut into pieces as touches need them.

use std::sync::OnceLock;

use glam::DVec3;

use super::cells::{Cells, UNFELT};
use super::chart::is_beside;
use super::pieces::{middle, pieces};
use crate::body::{Body, Home, NONE, SurfaceIndex, Topology, area_vector};

/// Edges of the tiles into which large triangles are cut first, m, and in edges of pieces.
const TILE_M: f64 = 0.012;
const TILE_PIECES: f64 = 6.0;
/// A surface that faces the same way and lies this far above a point, or less, covers it.
const COVER_M: f64 = 0.02;
/// Surfaces nearer than this lie in each other.
const COINCIDENT_M: f64 = 1e-5;
/// Two directions within 83° of each other are on one side: meshes have many edges of 90° and few near this.
const SAME_SIDE_COSINE: f64 = 0.121_869_343_405_147_48;
/// Spread of the weights of a smooth normal, and how far they reach, m.
const NORMAL_SIGMA_M: f64 = 4e-3;
const NORMAL_REACH_M: f64 = 3.0 * NORMAL_SIGMA_M;

/// Whether a surface with this normal can be pressed from where `outward` points to.
pub(super) fn faces(normal: DVec3, outward: DVec3) -> bool {
    normal.dot(outward) > SAME_SIDE_COSINE
}

/// A triangle at rest.
pub(super) struct Facet {
    pub(super) corners: [DVec3; 3],
    pub(super) normal: DVec3,
    pub(super) link: usize,
    /// Index of its mesh among the body's surfaces.
    pub(super) mesh: u32,
    tiles: OnceLock<Box<[Tile]>>,
}

/// A part of a facet whose pieces are made together.
pub(super) struct Tile {
    corners: [DVec3; 3],
    pub(super) middle: DVec3,
    pub(super) radius_m: f64,
    pieces: OnceLock<Box<[Piece]>>,
}

/// A piece of the surface that counts as a point.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    pub(super) middle: DVec3,
    pub(super) area_m2: f64,
    /// Index of the taxel in whose cell it lies among those of [`Cells`], or [`UNFELT`].
    pub(super) taxel: u32,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) position: DVec3,
    /// The facet's normal.
    pub(super) normal: DVec3,
    pub(super) facet: usize,
}

/// The surface of a body at rest, in the body's own frame.
pub(super) struct WholeSurface {
    facets: Vec<Facet>,
    /// Per facet those across its edges that carry the same layer, or [`NONE`].
    across: Vec<[u32; 3]>,
    index: SurfaceIndex,
    /// Maximum edge of a piece, m.
    edge_m: f64,
}

impl WholeSurface {
    /// The surface of `body` in pieces with edges of at most `edge_m`.
    pub(super) fn new(body: &Body, edge_m: f64) -> Self {
        let meshes = body.surfaces.iter().zip(0..).flat_map(|(surface, mesh)| {
            let skinned = matches!(surface.home, Home::Skinned { .. });
            std::iter::repeat_n((mesh, skinned), surface.triangles.len())
        });
        let (mut facets, mut skinned) = (Vec::new(), Vec::new());
        for ((link, corners), (mesh, is_skinned)) in body.triangles_at_rest().into_iter().zip(meshes) {
            let normal = area_vector(corners).normalize_or_zero();
            facets.push(Facet { corners, normal, link, mesh, tiles: OnceLock::new() });
            skinned.push(is_skinned);
        }
        let positions: Vec<DVec3> = facets.iter().flat_map(|facet| facet.corners).collect();
        let corners: Vec<[u32; 3]> = (0..facets.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let topology = Topology::new(&positions, &corners);
        let mut across = vec![[NONE; 3]; facets.len()];
        for (valid, &given) in topology.given.iter().enumerate() {
            for edge in 0..3 {
                let Some(&beyond) = topology.across.get(3 * valid + edge).filter(|&&beyond| beyond != NONE) else {
                    continue;
                };
                let (here, there) = (given as usize, topology.given[beyond as usize / 3] as usize);
                // The layers of links that move against each other end there; that of a skin with bones does not.
                if facets[here].link == facets[there].link || (skinned[here] && skinned[there]) {
                    across[here][edge] = there as u32;
                }
            }
        }
        let index = SurfaceIndex::of_triangles(facets.iter().map(|facet| facet.corners));
        Self { facets, across, index, edge_m }
    }

    pub(super) fn facet(&self, facet: usize) -> &Facet {
        &self.facets[facet]
    }

    pub(super) fn facets(&self) -> impl Iterator<Item = &Facet> {
        self.facets.iter()
    }

    /// The facets across the edges of `facet` on the same layer.
    pub(super) fn beside(&self, facet: usize) -> impl Iterator<Item = usize> + '_ {
        self.across[facet].iter().filter(|&&other| other != NONE).map(|&other| other as usize)
    }

    /// The facets within `within_m` of `p`, ascending.
    pub(super) fn around(&self, p: DVec3, within_m: f64) -> Vec<usize> {
        let mut found: Vec<usize> = self.index.within(p, within_m).collect();
        found.sort_unstable();
        found
    }

    /// The surface point nearest to `p` that can be pressed from where `outward` points to.
    pub(super) fn nearest(&self, p: DVec3, outward: DVec3) -> Option<Spot> {
        self.index.nearest_where(p, |normal| faces(normal, outward)).map(spot)
    }

    /// The surface point nearest to `p`.
    pub(super) fn nearest_of_all(&self, p: DVec3) -> Option<Spot> {
        self.index.nearest(p).map(spot)
    }

    /// Whether another part of the surface lies over `p`, so that nothing reaches it along its normal.
    pub(super) fn is_covered(&self, p: DVec3, normal: DVec3) -> bool {
        let half = (COVER_M - COINCIDENT_M) / 2.0;
        self.index.along(p + normal * (COINCIDENT_M + half), normal, half).is_some()
    }

    /// The tiles of `facet`.
    pub(super) fn tiles(&self, facet: usize) -> &[Tile] {
        let facet = &self.facets[facet];
        facet.tiles.get_or_init(|| {
            let mut tiles = Vec::new();
            pieces(
                facet.corners,
                TILE_M.max(TILE_PIECES * self.edge_m),
                |_, _| true,
                |corners, _| {
                    let middle = middle(corners);
                    let radius_m = corners.iter().map(|p| p.distance_squared(middle)).fold(0.0, f64::max).sqrt();
                    tiles.push(Tile { corners, middle, radius_m, pieces: OnceLock::new() });
                },
            );
            tiles.into_boxed_slice()
        })
    }

    /// The pieces of `tile`, one of `facet`'s; `cells` has their taxels.
    pub(super) fn pieces<'a>(&'a self, facet: usize, tile: &'a Tile, cells: &Cells) -> &'a [Piece] {
        tile.pieces.get_or_init(|| {
            let facet = &self.facets[facet];
            let mut found = Vec::new();
            pieces(
                tile.corners,
                self.edge_m,
                |_, _| true,
                |corners, area_m2| {
                    let middle = middle(corners);
                    let taxel = cells.taxel_at(middle, facet.normal, facet.mesh).unwrap_or(UNFELT);
                    found.push(Piece { middle, area_m2, taxel });
                },
            );
            found.into_boxed_slice()
        })
    }

    /// The outward normal around `spot`: a mean of the facets', weighted by a Gaussian of 4 mm.
    pub(super) fn smooth_normal(&self, spot: &Spot) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for facet in self.around(spot.position, NORMAL_REACH_M) {
            let normal = self.facets[facet].normal;
            if !is_beside(spot.normal, normal) {
                continue;
            }
            let near = |p: DVec3, radius: f64| p.distance(spot.position) <= NORMAL_REACH_M + radius;
            pieces(self.facets[facet].corners, NORMAL_SIGMA_M / 2.0, near, |corners, area_m2| {
                let squared = middle(corners).distance_squared(spot.position);
                if squared <= NORMAL_REACH_M * NORMAL_REACH_M {
                    sum += normal * (area_m2 * libm::exp(-0.5 * squared / (NORMAL_SIGMA_M * NORMAL_SIGMA_M)));
                }
            });
        }
        sum.normalize_or(spot.normal)
    }
}

fn spot(hit: crate::body::Hit) -> Spot {
    Spot { position: hit.position, normal: hit.normal, facet: hit.triangle }
}
