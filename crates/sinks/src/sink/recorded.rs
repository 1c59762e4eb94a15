//! A sink that records frames, percepts and what viewers show.

use super::header;
use super::line::LineWriter;
use super::percept_schema;
use super::view::ViewWriter;
use super::{Flow, InputFrames, RecordPart, Session, Sink};
use crate::error::Result;
use crate::output::OutputPath;
use crate::percept::Percepts;
use crate::recording::{PERCEPTS, Recorder};
use crate::scene::Plan;

/// Records to MCAP.
pub struct RecordingSink {
    recorder: Recorder,
    frames: bool,
    percepts: Option<LineWriter>,
    view: Option<ViewWriter>,
    line: Vec<u8>,
}

somatic_skin::debug_by_name!(RecordingSink);

impl RecordingSink {
    /// Begins a recording at `output`.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn create(output: OutputPath, session: &Session<'_>) -> Result<Self> {
        let create = if session.is_recorded { Recorder::create_whole } else { Recorder::create };
        let mut recorder = create(output, session.taxels)?;
        recorder.set_schema_of_percepts(percept_schema::text());
        if let Some(plan) = session.plan {
            let of_fields = header::units(plan).into_iter().map(|(name, unit)| (name.to_owned(), unit));
            let of_touches = header::units_of_touches(plan).into_iter();
            recorder.set_units(of_fields.chain(of_touches.map(|(name, unit)| (format!("touches.{name}"), unit))));
        }
        for (name, media_type, bytes) in &session.attached {
            recorder.attach(name, media_type, bytes)?;
        }
        let skin = session.skin();
        let holds = |part| session.parts.is_empty() || session.parts.contains(&part);
        Ok(Self {
            recorder,
            frames: holds(RecordPart::Frames),
            percepts: holds(RecordPart::Percepts)
                .then(|| LineWriter::new(&session.names, session.all_fields).with_skin(skin.as_ref())),
            view: session.body.filter(|_| holds(RecordPart::View)).map(|body| {
                let world = session.plan.map_or("world", Plan::world);
                ViewWriter::new(body, &session.names, world)
            }),
            line: Vec::new(),
        })
    }
}

impl Sink for RecordingSink {
    fn write_input(&mut self, input: &InputFrames<'_>) -> Result<Flow> {
        if self.frames {
            for frame in input.frames {
                self.recorder.frame(frame)?;
            }
        }
        if let Some(view) = &mut self.view {
            view.write_frames(input, &mut self.recorder)?;
        }
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        if let Some(lines) = &self.percepts {
            assert_eq!(percepts.fields(), lines.fields(), "a sink has the name of every field");
            for frame in 0..percepts.frames() {
                self.line.clear();
                lines.write(percepts, frame, &mut self.line);
                self.recorder.write(PERCEPTS, percepts.t_s(frame), &self.line)?;
            }
        }
        if let Some(view) = &mut self.view {
            view.write_touches(percepts, &mut self.recorder)?;
        }
        self.recorder.tick()?;
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        self.recorder.tick()?;
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.recorder.finish()
    }

    fn finish_early(self: Box<Self>) -> Result<Option<String>> {
        self.recorder.finish_early()
    }
}
