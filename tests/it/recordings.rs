//! Real recordings, where they are at hand: every value comes out as it stands in the file.

use crate::common::data;
use somatic::signal::Frame;
use somatic::source::{CsvSource, Source as _};

#[test]
fn recordings_are_read_value_for_value() {
    for (part, taxels) in [("recordings/mat", 2048), ("recordings/icub_grasp", 60)] {
        let Some(folder) = data(part) else { return };
        let mut files = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "csv") {
                continue;
            }
            files += 1;
            let text = std::fs::read_to_string(&path).unwrap();
            let mut source = CsvSource::open(&path, None).unwrap();
            assert_eq!(source.taxels().len(), taxels);
            let mut frame = Frame::missing(0.0, taxels);
            for line in text.lines().skip(1).filter(|line| !line.is_empty()) {
                assert!(source.next_frame(&mut frame).unwrap());
                let mut cells = line.split(',');
                assert_eq!(cells.next().unwrap().parse(), Ok(frame.t_s));
                for (value, cell) in frame.values.iter().zip(cells) {
                    assert_eq!(value.number(), cell.parse::<f32>().ok().map(f64::from), "{}: {cell}", path.display());
                }
            }
            assert!(!source.next_frame(&mut frame).unwrap());
            assert_eq!(source.progress(), Some(1.0));
            assert!(source.losses().is_empty(), "{:?}", source.losses());
        }
        assert!(files > 0);
    }
}

#[test]
#[ignore = "a measurement: run it by name with --release and --nocapture"]
fn how_fast_a_recording_is_read() {
    let Some(path) = data("recordings/mat") else { return };
    let path = std::fs::read_dir(path).unwrap().next().unwrap().unwrap().path();
    let begin = std::time::Instant::now();
    let (mut frames, mut frame) = (0, Frame::missing(0.0, 2048));
    for _ in 0..10 {
        let mut source = CsvSource::open(&path, None).unwrap();
        while source.next_frame(&mut frame).unwrap() {
            frames += 1;
        }
    }
    let taken = begin.elapsed();
    eprintln!("{frames} frames of 2048 values in {taken:?}: {:?} a frame", taken / frames.max(1));
}
