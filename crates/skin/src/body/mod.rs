//! Bodies: links, surfaces, taxels and field specifications, read from and written to glTF.
//!
//! A [`Body`] is the checked content of a glTF file, in metres. `docs/reference/layout.md` specifies the encoding.
//!
//! **Axes.** A body's are glTF's: y up, facing +z. Everything outside it is in the world, which is z up, x forward, y left:
//! [`WORLD_FROM_BODY`] takes the one to the other.
//!
//! **Frames.** Every glTF node that is neither a set of taxels nor a field is a [`Link`]. A link's frame is the rigid part
//! of the node's frame, without scale, shear and mirroring, so that coordinates in it are metres; the node's points are
//! transformed into it.

mod amend;
mod axes;
mod clear_layout;
mod details;
mod document;
mod glb;
mod joint;
mod json_edit;
mod kept;
mod layout;
mod model;
mod nearest;
mod nodes;
mod original;
mod primitives;
mod ray_tree;
mod read;
mod referenced_files;
mod repair;
mod shape;
mod sheet;
mod skin_weights;
mod stored_edges;
mod surface;
mod tangents;
mod taxel_table;
mod topology;
mod urdf_root;

pub use axes::{BODY_FROM_WORLD, Up, WORLD_FROM_BODY, WORLD_FROM_BODY_ROTATION};
pub use details::{Details, Mark, Paint, Part};
pub use glb::{Glb, MeshData, Skinning};
pub use joint::{LinkJoint, LinkMimic, LinkMotion};
pub use kept::{BitsHasher, Kept, KeptOfShape};
pub use layout::{ChartKind, ChartSpec, FieldSpec, MAX_TAXEL_ID, MemberSpec};
pub use model::{Body, Home, Link, Modality, Surface, Taxel};
pub use nearest::{Near, Nearest};
pub use original::Original;
pub use ray_tree::{Ray, RayTree};
pub use read::TaxelSource;
pub use repair::listed;
pub use sheet::{Sheet, SheetCell, sheets};
pub use skin_weights::merged_skinning;
pub use skin_weights::{blend_skinning, heaviest_four};
pub use stored_edges::{EdgeRow, StoredEdges};
pub use surface::{Hit, SurfaceIndex};
pub use surface::{PointTree, area_vector, nearest_on_triangle, point_tree};
pub use tangents::default_u;
pub(crate) use tangents::tangent_frame;
pub use taxel_table::{TaxelRow, read_taxel_table, taxel_table};
pub use topology::{Flaws, NONE, Topology};
pub use topology::{QuickHasher, next};
