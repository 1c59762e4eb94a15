//! `author`: a skin on a mesh.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use somatic::author::Recipe;
use somatic::author::mesh::MeshOptions;
use somatic::internal::author::mesh;
use somatic::internal::body::Original;
use somatic::{Body, Error, bundled};

use crate::body::PyBody;
use crate::error::{OrRaise, interrupted};
use crate::progress::Progress;
use crate::threads::free;

/// Puts a skin on a mesh, as `somatic author` does, and gives the body.
///
/// `shape` is a file (.glb, .gltf, .stl, .obj, .dae, .ply or .urdf) or a bundled body. Either `recipe`, the path of a file that
/// docs/reference/recipe.md describes; or `taxels`, how many, `spacing`, such as '8 mm', or both, on the nodes, meshes or links whose names match
/// one of the globs `regions`. `unit` says what the file's numbers are: 'um', 'mm', 'cm' or 'm'. `even=False` leaves taxels where they
/// were scattered, `hidden='keep'` places some where nothing can touch them, and `clear`, such as '5 mm', is their least distance from
/// where a link, a mesh or the surface ends; without them the recipe's hold. `progress` is called with the share that is done, 0 to 1; True shows a bar of tqdm.
///
/// >>> import somatic_touch as st
/// >>> body = st.author("hand", taxels=60, seed=1)
/// >>> len(body.taxels)
/// 60
#[pyfunction]
#[pyo3(signature = (shape, recipe = None, *, taxels = None, spacing = None, regions = Vec::new(), seed = None, unit = None, even = None, hidden = None, clear = None, progress = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn author(
    py: Python<'_>,
    shape: PathBuf,
    recipe: Option<PathBuf>,
    taxels: Option<u64>,
    spacing: Option<&str>,
    regions: Vec<String>,
    seed: Option<u64>,
    unit: Option<&str>,
    even: Option<bool>,
    hidden: Option<&str>,
    clear: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyBody> {
    let mut made = match &recipe {
        Some(_) if taxels.is_some() || spacing.is_some() || !regions.is_empty() => {
            Err(Error::usage("a recipe says what is placed where; leave taxels, spacing and regions out"))
        }
        Some(path) => Recipe::load(path),
        None => Recipe::simple(taxels, spacing, &regions),
    }
    .or_raise(py)?;
    if let Some(seed) = seed {
        made = made.with_seed(seed);
    }
    if let Some(unit) = unit {
        made = made.with_unit(unit).map_err(|e| e.at("unit")).or_raise(py)?;
    }
    if let Some(even) = even {
        made = made.with_even(even);
    }
    if let Some(hidden) = hidden {
        let keep = match hidden {
            "keep" => Ok(true),
            "drop" => Ok(false),
            _ => Err(Error::usage(format!("hidden: there is no '{hidden}'; it is 'drop' or 'keep'"))),
        };
        made = made.with_hidden(keep.or_raise(py)?);
    }
    if let Some(clear) = clear {
        made = made.with_clear(clear).map_err(|e| e.at("clear")).or_raise(py)?;
    }
    let progress = Progress::new(py, progress, Some(1.0), "")?;
    let mut raised = None;
    let done = free(py, || {
        let file = open(&shape, &mut made)?;
        let shown = |share: f64| {
            let heard = Python::attach(|py| {
                py.check_signals()?;
                progress.as_ref().map_or(Ok(()), |progress| progress.tell(py, (share,)))
            });
            raised = heard.err();
            raised.is_none()
        };
        let authored = somatic::internal::author::author_while(file, &made, shown)?;
        let name = shape
            .with_extension("glb")
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let bytes = Arc::new(authored.file.to_glb()?);
        Ok(PyBody { inner: Arc::new(Body { name, ..authored.body }), bytes })
    });
    match raised {
        Some(error) => Err(interrupted(Some(error))),
        None => {
            let made = done.or_raise_of(py, &shape)?;
            progress.as_ref().map_or(Ok(()), |progress| progress.fill(py, (1.0,)))?;
            Ok(made)
        }
    }
}

fn open(shape: &Path, recipe: &mut Recipe) -> somatic::Result<Original> {
    if !shape.exists()
        && let Some(name) = shape.to_str()
        && let Some(bytes) = bundled::body(name)
    {
        return Original::from_bytes(name, bytes, None);
    }
    if mesh::is_mesh(shape) {
        let mut options = MeshOptions::default().with_ros_packages();
        options.unit_m = recipe.take_unit();
        return mesh::open(shape, &options);
    }
    Original::open(shape)
}
