//! `write`: percepts to the files that `somatic run` writes.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use somatic::Error;
use somatic::output::OutputPaths;
use somatic::sink::{Flow, Sink, SinkSpec};

use crate::error::{OrRaise, usage};
use crate::percepts::PyPercepts;
use crate::session::Run;
use crate::threads::free;

/// Writes percepts to a file as `somatic run --sink` does: NDJSON, CSV, Parquet or MCAP.
///
/// `percepts` are a `Percepts`, or an iterable of those of one engine, so that a recording that does not fit into memory can be
/// written as it is read. `sink` is a path, or a text such as `ndjson:FILE`; an existing file is replaced only with `force`. The
/// file appears when all is written. `wide` makes CSV with one row a frame. MCAP gets percepts without raw frames.
///
/// >>> import pathlib, tempfile
/// >>> import somatic_touch as st
/// >>> touch = st.read("hand")
/// >>> p = touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values)
/// >>> path = pathlib.Path(tempfile.mkdtemp()) / "percepts.csv"
/// >>> st.write(p, path)
/// >>> path.read_text().splitlines()[0]
/// 't [s],frame,field,link,contact,total [count],flags'
#[pyfunction]
#[pyo3(signature = (percepts, sink, *, force = false, all_fields = false, header = false, wide = false))]
pub(crate) fn write(
    py: Python<'_>,
    percepts: &Bound<'_, PyAny>,
    sink: &Bound<'_, PyAny>,
    force: bool,
    all_fields: bool,
    header: bool,
    wide: bool,
) -> PyResult<()> {
    let text = match sink.extract::<String>() {
        Ok(text) => text,
        Err(_) => sink.extract::<PathBuf>()?.display().to_string(),
    };
    let spec: SinkSpec = text.parse().or_raise(py)?;
    if matches!(spec, SinkSpec::Page(_)) {
        return Err(usage(py, "a page shows frames too; see `Engine.view`"));
    }
    if spec.needs_frames() {
        let what = format!(
            "sink `{text}` has frames too, and percepts alone are written here; write mcap:FILE, ndjson:FILE or csv:FILE, or run `somatic run --sink {text}`"
        );
        return Err(usage(py, what));
    }
    if wide && !matches!(spec, SinkSpec::Csv(_)) {
        return Err(usage(py, "wide is for a table in CSV; name a sink csv:FILE"));
    }
    let mut file = File { spec, force, all_fields, header, wide, open: None };
    if let Ok(one) = percepts.cast::<PyPercepts>() {
        file.write(py, one.get())?;
    } else {
        let wrong = "percepts should be a Percepts, or an iterable of them";
        for part in percepts.try_iter().map_err(|_| usage(py, wrong))? {
            file.write(py, part?.cast::<PyPercepts>().map_err(|_| usage(py, wrong))?.get())?;
            py.check_signals()?;
        }
    }
    match file.open {
        Some((sink, _)) => free(py, || sink.finish()).or_raise(py),
        None => Err(usage(py, "there are no percepts to write")),
    }
}

/// A sink that is opened by the first percepts.
struct File {
    spec: SinkSpec,
    force: bool,
    all_fields: bool,
    header: bool,
    wide: bool,
    open: Option<(Box<dyn Sink + Send>, Arc<Run>)>,
}

impl File {
    fn write(&mut self, py: Python<'_>, percepts: &PyPercepts) -> PyResult<()> {
        if !percepts.is_whole() {
            let what = "these are a part of percepts, by `between` or `select`; write all of them, or the part's table, as by `to_polars().write_parquet`";
            return Err(usage(py, what));
        }
        if self.open.is_none() {
            let sink = self.start(&percepts.run).or_raise(py)?;
            self.open = Some((sink, Arc::clone(&percepts.run)));
        }
        let Some((sink, run)) = &mut self.open else { return Ok(()) };
        if !Arc::ptr_eq(run, &percepts.run) {
            return Err(usage(py, "these percepts are of several engines; write each into a file of its own"));
        }
        let (Flow::Open | Flow::Closed) = free(py, || sink.write(&percepts.inner)).or_raise(py)?;
        Ok(())
    }

    fn start(&self, run: &Run) -> Result<Box<dyn Sink + Send>, Error> {
        let mut session = run.session("Python", self.all_fields, true);
        session.header = self.header;
        let table = run.tables(self.wide);
        let none: [PathBuf; 0] = [];
        self.spec.target(&mut OutputPaths::new(self.force, none), &[], table)?.open(&session)
    }
}
