//! The ways in and out: reading CSV into frames, and writing percepts as NDJSON, in bytes a second.

// The skins of `somatic bench`.

use std::fmt::Write as _;
use std::io::{Seek as _, SeekFrom};

use divan::Bencher;
use divan::counter::BytesCount;
use somatic::internal::shape::Shape;
use somatic::sink::{FieldNames, NdjsonSink, Sink};
use somatic::source::{CsvSource, Source as _};
use somatic::{BackendKind, Frame, Outputs};

fn main() {
    divan::main();
}

const FRAMES: usize = 256;

/// A recording as somebody's logger writes it: 12-bit counts, and every tenth value with decimals.
fn csv(sensors: usize) -> String {
    let mut text = "t".to_owned();
    (0..sensors).for_each(|id| write!(text, ",{id}").unwrap());
    for frame in 0..FRAMES {
        write!(text, "\n{}", frame as f64 / 100.0).unwrap();
        for id in 0..sensors {
            let counts = (id * 31 + frame * 17) % 4096;
            if id % 10 == 0 { write!(text, ",{counts}.25") } else { write!(text, ",{counts}") }.unwrap();
        }
    }
    text + "\n"
}

#[divan::bench(args = [40, 1000, 7560], max_time = 1)]
fn parse_csv(bencher: Bencher<'_, '_>, sensors: usize) {
    // A source owns what it reads from, and copying this would be measured too.
    let text: &'static str = csv(sensors).leak();
    bencher.counter(BytesCount::of_str(text)).bench_local(|| {
        let mut source = CsvSource::from_reader("made up", text.as_bytes(), None, None).unwrap();
        let mut frame = Frame::missing(0.0, sensors);
        let mut frames = 0;
        while source.next_frame(&mut frame).unwrap() {
            frames += 1;
        }
        assert_eq!(frames, FRAMES);
    });
}

#[divan::bench(args = [9, 100, 600], max_time = 1)]
fn write_ndjson(bencher: Bencher<'_, '_>, fields: usize) {
    let shape = Shape { sensors: 1000, fields, members: 16, wide: 0, local: false, frames: FRAMES, seed: 1 };
    let body = shape.body();
    let mut engine = shape.engine(&body, BackendKind::Cpu, Outputs::USUAL_AND_MOTION).unwrap();
    let names = FieldNames::all_of(engine.plan());
    let percepts = engine.process(&shape.frames()).unwrap();
    let write = |to: Box<dyn std::io::Write + Send>| {
        let mut sink: Box<dyn Sink + Send> = Box::new(NdjsonSink::to_writer("nobody", to, &names, false));
        let _ = sink.write(percepts).unwrap();
        sink.finish().unwrap();
    };
    let mut file = tempfile::tempfile().unwrap();
    write(Box::new(file.try_clone().unwrap()));
    let bytes = file.seek(SeekFrom::End(0)).unwrap();
    bencher.counter(BytesCount::new(bytes)).bench_local(|| write(Box::new(std::io::sink())));
}
