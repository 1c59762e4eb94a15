//! What is measured, on which frames, and how a measurement is described.

use somatic::signal::Frame;
use somatic::source::{SimulatedSource, Source, SourceSpec};
use somatic::tradeoff::{CallMode, MeasureOptions, Measurement, Pick, Target, TestFrames};
use somatic::{BackendKind, Body, Error, Options, Result};

use crate::cli::input::{Input, RECORDED_BATCH};
use crate::cli::plan::pressed;
use crate::cli::scene::RunOptions;
use crate::cli::words::number;

/// What `pick` misses of `target`, which nothing grants.
pub(super) fn missed(target: &Target, pick: &Pick<'_>) -> Result<String> {
    let combination = pick.row.combination()?;
    Ok(format!("no knobs meet {}; nearest is {combination}: {}", target.words(), pick.missed.join("; ")))
}

/// Why a GPU is not chosen unless it is asked for, where all there are compute on the CPU.
pub(super) fn software() -> Option<String> {
    #[cfg(feature = "gpu")]
    {
        let adapters = somatic::backend::gpu::adapters();
        let names: Vec<&str> = adapters.iter().map(|adapter| &adapter.name[..]).collect();
        let is_software = !adapters.is_empty() && adapters.iter().all(|adapter| adapter.kind == "software");
        is_software
            .then(|| format!("gpu: {} computes on the same CPU; ask for it with --backend gpu", names.join(", ")))
    }
    #[cfg(not(feature = "gpu"))]
    None
}

pub(super) fn measure_options(asked: &RunOptions, options: &Options, seconds: f64) -> Result<MeasureOptions> {
    let backends = match options.backend {
        BackendKind::Auto if software().is_some() => vec![BackendKind::Cpu],
        BackendKind::Auto => vec![BackendKind::Cpu, BackendKind::Gpu],
        BackendKind::Reference => {
            return Err(Error::usage("the reference has no knobs to compare; take another backend, or auto"));
        }
        kind => vec![kind],
    };
    let batch = asked.batch.map_or(RECORDED_BATCH, |batch| batch as usize);
    Ok(MeasureOptions { seconds, batch, ways: CallMode::ALL.to_vec(), backends })
}

/// The first frames of `input`, up to `most`, and the truth where it knows it.
pub(super) fn played(input: &Input, asked: &RunOptions, ids: &[u32], most: usize) -> Result<TestFrames> {
    let mut played = TestFrames { source: input.name.clone(), ..TestFrames::default() };
    fn next(played: &mut TestFrames, source: &mut dyn Source) -> Result<bool> {
        if played.frames.is_empty() {
            played.taxels = source.taxels().to_vec();
        }
        let mut frame = Frame::missing(0.0, played.taxels.len());
        let is_there = source.next_frame(&mut frame)?;
        played.frames.extend(is_there.then_some(frame));
        Ok(is_there)
    }
    if let Some(SourceSpec::Sim(path)) = &input.spec {
        let mut source = SimulatedSource::open(path)?;
        while played.frames.len() < most && next(&mut played, &mut source)? {
            played.truth.push(source.truth().to_vec());
        }
    } else {
        let mut source = input.open(ids, asked)?;
        while played.frames.len() < most && next(&mut played, &mut *source)? {}
    }
    if played.frames.is_empty() {
        return Err(Error::failed("there is no frame in it").at(&played.source));
    }
    Ok(played)
}

/// What `somatic plan` calls a row.
pub(super) fn in_words(row: &Measurement) -> String {
    let [centroid, orientation] = row.judged();
    let mut words = vec![format!("{:.2} µs a frame, p99 {:.2} µs", row.p50_us, row.p99_us)];
    if centroid.compared > 0 {
        words.push(format!("centroid within {} mm", number(centroid.p99)));
    }
    if orientation.compared > 0 {
        words.push(format!("orientation within {}°", number(orientation.p99)));
    }
    words.join(", ")
}

/// Frames for a body that nobody has recorded, or cannot be read again: every taxel pressed, each time otherwise.
pub(super) fn made_up(body: &Body, taxels: Vec<u32>) -> TestFrames {
    let frames = pressed(body.taxels.len(), 32);
    TestFrames { source: "every taxel pressed".to_owned(), taxels, frames, truth: Vec::new() }
}
