//! Writes percepts as NDJSON, one line per frame.
//!
//! Absent quantities are omitted. Numbers have the fewest digits that read back to the same bits.

use std::io::{self, BufWriter, ErrorKind, Write};

use super::line::LineWriter;
use super::touch_line::SkinNames;
use super::{FieldNames, Flow, Sink};
use crate::error::{Result, failed};
use crate::output::{OutputFile, OutputPath};
use crate::percept::Percepts;

/// Writes percepts as NDJSON.
pub struct NdjsonSink {
    name: String,
    writer: BufWriter<Output>,
    lines: LineWriter,
    line: Vec<u8>,
    closed: bool,
}

somatic_skin::debug_by_name!(NdjsonSink);

/// The destination of lines.
enum Output {
    File(OutputFile),
    Writer(Box<dyn Write + Send>),
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.write(bytes),
            Self::Writer(writer) => writer.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::File(file) => file.flush(),
            Self::Writer(writer) => writer.flush(),
        }
    }
}

impl NdjsonSink {
    /// Writes to `output`, where the file appears or is replaced when the sink is finished. Fields without contact are
    /// listed only with `all_fields`.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn to_file(output: OutputPath, names: &[FieldNames], all_fields: bool) -> Result<Self> {
        let name = output.name().display().to_string();
        Ok(Self::new(name, Output::File(output.begin()?), names, all_fields))
    }

    /// Writes to `writer`, which messages call `name`.
    #[must_use]
    pub fn to_writer(
        name: impl Into<String>,
        writer: impl Write + Send + 'static,
        names: &[FieldNames],
        all_fields: bool,
    ) -> Self {
        Self::new(name.into(), Output::Writer(Box::new(writer)), names, all_fields)
    }

    fn new(name: String, to: Output, names: &[FieldNames], all_fields: bool) -> Self {
        Self {
            name,
            writer: BufWriter::with_capacity(1 << 16, to),
            lines: LineWriter::new(names, all_fields),
            line: Vec::new(),
            closed: false,
        }
    }

    /// The same, with touches of the whole body where they are looked for: those on `skin`.
    #[must_use]
    pub fn with_skin(mut self, skin: Option<&SkinNames>) -> Self {
        self.lines = self.lines.with_skin(skin);
        self
    }

    /// The same, beginning with `header` as its first line.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn with_header(mut self, header: Option<&str>) -> Result<Self> {
        if let Some(header) = header {
            let written = writeln!(self.writer, "{header}");
            // A reader that has gone is noticed again with the first frame.
            let _ = self.flow(written)?;
        }
        Ok(self)
    }

    fn flow(&mut self, written: io::Result<()>) -> Result<Flow> {
        match written {
            Ok(()) => Ok(Flow::Open),
            Err(e) if e.kind() == ErrorKind::BrokenPipe => {
                self.closed = true;
                Ok(Flow::Closed)
            }
            Err(e) => Err(failed!("cannot write: {e}").at(&self.name)),
        }
    }
}

impl Sink for NdjsonSink {
    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        assert_eq!(percepts.fields(), self.lines.fields(), "a sink has the name of every field");
        for frame in 0..percepts.frames() {
            if self.closed {
                return Ok(Flow::Closed);
            }
            self.line.clear();
            self.lines.write(percepts, frame, &mut self.line);
            self.line.push(b'\n');
            let written = self.writer.write_all(&self.line);
            if self.flow(written)? == Flow::Closed {
                return Ok(Flow::Closed);
            }
        }
        Ok(Flow::Open)
    }

    fn write_percepts_of_limbs(&mut self, lines: &[String]) -> Result<Flow> {
        for line in lines {
            if self.closed {
                return Ok(Flow::Closed);
            }
            let written = writeln!(self.writer, "{line}");
            if self.flow(written)? == Flow::Closed {
                return Ok(Flow::Closed);
            }
        }
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        if self.closed {
            return Ok(Flow::Closed);
        }
        let flushed = self.writer.flush();
        self.flow(flushed)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let flow = self.flush()?;
        // Nothing is left in the buffer, or what is left has no reader.
        match self.writer.into_parts().0 {
            Output::File(file) if flow == Flow::Open => file.finish(),
            _ => Ok(()),
        }
    }

    fn finish_early(mut self: Box<Self>) -> Result<Option<String>> {
        let flow = self.flush()?;
        // Every line is of use without those after it; but a file that is there is not given up for a part of a new one.
        match self.writer.into_parts().0 {
            Output::File(file) if flow == Flow::Open => Ok((!file.finish_early()?).then_some(self.name)),
            _ => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::percept::{Component, Flags, Host, Outputs, Precision, Values};

    fn names() -> Vec<FieldNames> {
        [("hand/palm", "hand"), ("say \"hi\"", "arm")]
            .map(|(field, link)| FieldNames {
                field: field.into(),
                link: link.into(),
                world: "world".into(),
                ..FieldNames::default()
            })
            .into()
    }

    /// Two frames of two fields; the first field is touched, in the second frame in the world.
    fn percepts(precision: Precision) -> Percepts {
        let mut percepts = Percepts::new(Outputs::USUAL_AND_MOTION, 2, precision);
        percepts.reset(2);
        percepts.first_frame = 7;
        percepts.t_s = vec![0.05, 0.1];
        percepts.in_world[2] = true;
        percepts.flags = vec![Flags::TIE | Flags::SATURATED, Flags::NO_CONTACT, Flags::empty(), Flags::NO_CONTACT];
        let present = [
            (Outputs::USUAL_AND_MOTION - Outputs::MOTION) | Outputs::DISPLACEMENT,
            Outputs::TOTAL,
            Outputs::TOTAL | Outputs::POSITION,
            Outputs::empty(),
        ];
        present.into_iter().enumerate().for_each(|(cell, present)| percepts.set_present(cell, present));
        percepts.active[0] = 3;
        for cell in 0..4 {
            percepts.set_host(Host::Position, cell, &[0.1, -0.2, 1e-9]);
            percepts.set_host(Host::Normal, cell, &[0.0, 0.0, 1.0]);
        }
        macro_rules! fill {
            ($columns:expr) => {{
                $columns[Component::Total].copy_from_slice(&[0.1, 0.0, 12.0, 0.0]);
                let first = [
                    (Component::Peak, 1e-30),
                    (Component::Area, 2.5e-5),
                    (Component::CentroidU, 0.3),
                    (Component::CentroidV, -0.7),
                    (Component::Orientation, 1.5),
                    (Component::PrincipalAxis, 0.0),
                    (Component::Anisotropy, 1.0),
                    (Component::DisplacementU, -0.5),
                    (Component::DisplacementV, 0.1),
                ];
                first.into_iter().for_each(|(part, value)| $columns[part][0] = value);
            }};
        }
        match &mut percepts.values {
            Values::F32(columns) => fill!(columns),
            Values::F64(columns) => fill!(columns),
        }
        percepts
    }

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn written(percepts: &Percepts, all_fields: bool) -> String {
        written_as(percepts, &names(), all_fields)
    }

    fn written_as(percepts: &Percepts, names: &[FieldNames], all_fields: bool) -> String {
        let shared = Shared::default();
        let mut sink = Box::new(NdjsonSink::to_writer("out", shared.clone(), names, all_fields));
        assert_eq!(sink.write(percepts).unwrap(), Flow::Open);
        sink.finish().unwrap();
        String::from_utf8(shared.0.lock().unwrap().clone()).unwrap()
    }

    #[test]
    fn a_frame_is_a_line_of_the_fields_in_contact() {
        let wanted = concat!(
            r#"{"t":0.05,"frame":7,"fields":[{"field":"hand/palm","link":"hand","contact":true,"total":0.1,"#,
            r#""peak":1e-30,"active":3,"area":0.000025,"centroid":[0.3,-0.7],"position":[0.1,-0.2,1e-9],"#,
            r#""normal":[0.0,0.0,1.0],"orientation":1.5,"principal_axis":0.0,"anisotropy":1.0,"displacement":[-0.5,0.1],"flags":["tie","saturated"]}]}"#,
            "\n",
            r#"{"t":0.1,"frame":8,"fields":[{"field":"hand/palm","link":"world","contact":true,"total":12.0,"#,
            r#""position":[0.1,-0.2,1e-9],"flags":[]}]}"#,
            "\n"
        );
        // The fewest digits of either precision are the same here, though the values are not.
        for precision in [Precision::F32, Precision::F64] {
            let text = written(&percepts(precision), false).replace("2.5e-5", "0.000025");
            assert_eq!(text, wanted, "{precision:?}");
        }
    }

    #[test]
    fn all_fields_are_listed_where_asked_for() {
        let text = written(&percepts(Precision::F32), true);
        assert!(
            text.contains(r#"{"field":"say \"hi\"","link":"arm","contact":false,"total":0.0,"flags":["no_contact"]}"#)
        );
        for line in text.lines() {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            assert_eq!(line["fields"].as_array().unwrap().len(), 2);
        }
    }

    #[test]
    fn a_letter_is_reported_where_it_has_a_name() {
        let mut names = names();
        names[0].letter = Some("change".into());
        names[0].signal = Some("raw".into());
        names[1].signal = Some("linear".into());
        let text = written_as(&percepts(Precision::F32), &names, true);
        assert!(text.contains(r#""link":"hand","letter":"change","signal":"raw","contact":true"#), "{text}");
        assert!(text.contains(r#""link":"arm","signal":"linear","contact":false"#), "{text}");
    }

    #[test]
    fn a_frame_without_contact_is_still_a_line() {
        let mut percepts = Percepts::new(Outputs::TOTAL, 2, Precision::F32);
        percepts.reset(1);
        percepts.flags = vec![Flags::NO_CONTACT; 2];
        assert_eq!(written(&percepts, false), "{\"t\":0.0,\"frame\":0,\"fields\":[]}\n");
    }

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.ndjson");
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let to = |force: bool| OutputPath::new(&path, force, &[]).unwrap();
        let mut sink = NdjsonSink::to_file(to(false), &names(), false).unwrap();
        let _ = sink.write(&percepts(Precision::F32)).unwrap();
        assert!(!path.exists() && files() == 1);
        drop(sink);
        assert_eq!(files(), 0);

        std::fs::write(&path, "old").unwrap();
        let mut sink = Box::new(NdjsonSink::to_file(to(true), &names(), false).unwrap());
        let _ = sink.write(&percepts(Precision::F32)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        sink.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 2);
        assert_eq!(files(), 1);
    }

    struct Failing(ErrorKind);

    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_pipe_is_an_end_and_a_full_disk_an_error() {
        let percepts = percepts(Precision::F32);
        let mut sink = Box::new(NdjsonSink::to_writer("out", Failing(ErrorKind::BrokenPipe), &names(), false));
        assert_eq!(sink.write(&percepts).unwrap(), Flow::Open, "it is buffered");
        assert_eq!(sink.flush().unwrap(), Flow::Closed);
        assert_eq!(sink.write(&percepts).unwrap(), Flow::Closed);
        sink.finish().unwrap();
        let mut sink = Box::new(NdjsonSink::to_writer("out", Failing(ErrorKind::StorageFull), &names(), false));
        let _ = sink.write(&percepts).unwrap();
        assert!(sink.finish().unwrap_err().to_string().starts_with("out: cannot write"));
    }
}
