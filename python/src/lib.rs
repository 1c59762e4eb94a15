//! The module `somatic_touch._native`: what the Python package has in Rust.

mod about;
mod accuracy;
mod agreement;
mod array_body;
mod arrays;
mod author;
mod body;
mod body_tables;
mod calibration;
mod channels;
mod convert;
#[cfg(feature = "gpu")]
mod drawing;
mod engine;
mod error;
mod field;
mod frame_values;
mod given;
mod globs;
mod kinematics;
mod live;
mod opening;
mod parts;
mod percepts;
mod picture;
mod plotting;
mod progress;
mod recording;
mod runner;
mod same;
mod scene;
mod self_contacts;
mod session;
mod sheet;
mod simulation;
mod sinks;
mod state;
mod stream;
mod threads;
mod touch_parts;
mod touches;
mod view;

use pyo3::prelude::*;

#[pymodule]
#[pyo3(name = "_native")]
mod native {
    use super::*;

    #[pymodule_export]
    use about::{compare, info, inspect, outputs};
    #[pymodule_export]
    use accuracy::{calibrate, gains, tradeoff, write_pick};
    #[pymodule_export]
    use author::author;
    #[pymodule_export]
    use body::PyBody;
    #[pymodule_export]
    use calibration::PyCalibration;
    #[pymodule_export]
    use convert::convert;
    #[pymodule_export]
    use engine::PyEngine;
    #[pymodule_export]
    use field::PyField;
    #[pymodule_export]
    use live::{PyLive, open_live};
    #[pymodule_export]
    use opening::body_of;
    #[pymodule_export]
    use parts::{PyParts, open};
    #[pymodule_export]
    use percepts::PyPercepts;
    #[pymodule_export]
    use picture::{PyPicture, render};
    #[pymodule_export]
    use plotting::plot;
    #[pymodule_export]
    use recording::{PyRecording, read};
    #[pymodule_export]
    use runner::{metadata, run};
    #[pymodule_export]
    use scene::PyScene;
    #[pymodule_export]
    use self_contacts::PySelfContacts;
    #[pymodule_export]
    use simulation::{PySimulation, simulate};
    #[pymodule_export]
    use sinks::write;
    #[pymodule_export]
    use state::PyState;
    #[pymodule_export]
    use touches::PyTouches;
    #[pymodule_export]
    use view::PyView;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        threads::note_process();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
