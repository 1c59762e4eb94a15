//! Sends the frames or the percepts of a limb to the computer that brings limbs together.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use super::handover::{Carrier, Handover, tell};
use super::line::LineWriter;
use super::{FieldNames, Flow, InputFrames, Session, Sink, SkinNames};
use crate::error::Result;
use crate::limb::{
    FRAME_BYTES, LimbSends, Network, PerceptHead, Publication, Side, end_packet, frame_packet, hash, layout_packet,
    percepts_begin,
};
use crate::percept::Percepts;
use crate::scene::Plan;
use crate::signal::{Channel, RawValue};

/// Packets that wait for the network; then the oldest give way.
const ROOM: usize = 64;
/// How often a limb says which taxels its frames have, for heads that come later.
const LAYOUT_PERIOD: Duration = Duration::from_secs(1);
/// How long the end waits for the network.
const END_WAIT: Duration = Duration::from_secs(2);

/// Sends a limb's frames or percepts over Zenoh, from a thread of its own.
pub struct ZenohSink {
    packets: Handover<Vec<u8>>,
    sends: LimbSends,
    lines: LineWriter,
    /// The indices of the values that are sent, of a frame's: those of the taxels of the plan's fields. Touches of the whole body read
    /// others, too; those are for other limbs to send.
    sent: Vec<usize>,
    values: Vec<RawValue>,
    layout: u32,
    boot: u8,
    /// The number of the next packet.
    sequence: u32,
    last_s: f64,
}

impl ZenohSink {
    /// Opens the session that `session.zenoh_config` describes, and sends under `key`.
    ///
    /// # Errors
    /// The session cannot be opened.
    pub fn open(key: &str, sends: LimbSends, session: &Session<'_>) -> Result<Self> {
        let read: Option<HashSet<u32>> = session.plan.zip(session.body).map(|(plan, body)| {
            let taxels = plan.taxels_of_fields().into_keys();
            taxels.filter_map(|index| body.taxels.get(index)).map(|taxel| taxel.id).collect()
        });
        let is_read = |id: &u32| read.as_ref().is_none_or(|read| read.contains(&Channel(*id).taxel()));
        let sent: Vec<usize> = (0..session.taxels.len()).filter(|&index| is_read(&session.taxels[index])).collect();
        let taxels: Vec<u32> = sent.iter().map(|&index| session.taxels[index]).collect();
        let layout = hash(&taxels);
        let publication =
            Network::open(session.zenoh_config, Side::Limb)?.publish(key, sends == LimbSends::Percepts)?;
        let carrier = LimbCarrier {
            publication,
            taxels: (sends == LimbSends::Frames).then_some(taxels),
            layout_sent_at: None,
            is_read: None,
            name: format!("zenoh:{key}"),
            packet: Vec::new(),
        };
        let packets = Handover::start(&format!("sink `zenoh:{key}`"), sends.word(), ROOM, carrier)?;
        // Any number that the last start most likely did not have.
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let boot = (now.as_micros() ^ u128::from(std::process::id())) as u8;
        let lines = LineWriter::new(&session.names, session.all_fields).with_skin(session.skin().as_ref());
        Ok(Self { packets, sends, lines, sent, values: Vec::new(), layout, boot, sequence: 0, last_s: 0.0 })
    }

    /// The number of the packet that comes now.
    fn count(&mut self) -> u32 {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        sequence
    }
}

impl Sink for ZenohSink {
    fn write_input(&mut self, heard: &InputFrames<'_>) -> Result<Flow> {
        if self.sends == LimbSends::Frames {
            for frame in heard.frames {
                let (boot, sequence, layout) = (self.boot, self.count(), self.layout);
                self.last_s = frame.t_s;
                self.values.clear();
                self.values.extend(self.sent.iter().map(|&index| frame.values[index]));
                let values = &self.values;
                self.packets.hand_over(|to| frame_packet(to, boot, sequence, frame.t_s, layout, values))?;
            }
        }
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        if self.sends == LimbSends::Percepts {
            for frame in 0..percepts.frames() {
                let head = PerceptHead { boot: self.boot, sequence: self.count() };
                self.last_s = percepts.t_s(frame);
                self.packets.hand_over(|to| {
                    percepts_begin(to, head);
                    self.lines.write_keys(percepts, frame, to);
                })?;
            }
        }
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        Ok(Flow::Open)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let (boot, sequence, t_s) = (self.boot, self.sequence, self.last_s);
        self.packets.hand_over(|to| end_packet(to, boot, sequence, t_s))?;
        self.packets.finish(END_WAIT).map(|_| ())
    }
}

/// Bytes of a frame of a limb whose engine has `plan`, without those of Zenoh and of the network.
#[must_use]
pub fn limb_frame_bytes(plan: &Plan) -> usize {
    FRAME_BYTES + 4 * plan.taxels_of_fields().values().sum::<usize>()
}

/// Bytes of `percepts`, all their frames, as a limb sends them, without those of Zenoh and of the network. Their touches are on `skin`.
#[must_use]
pub fn limb_percept_bytes(
    names: &[FieldNames],
    all_fields: bool,
    skin: Option<&SkinNames>,
    percepts: &Percepts,
) -> usize {
    let lines = LineWriter::new(names, all_fields).with_skin(skin);
    let bytes = |frame: usize| {
        let mut line = Vec::new();
        percepts_begin(&mut line, PerceptHead { boot: 255, sequence: percepts.frame_number(frame) as u32 });
        lines.write_keys(percepts, frame, &mut line);
        line.len()
    };
    (0..percepts.frames()).map(bytes).sum()
}

/// Puts packets on the network, and now and then before a frame the layout that it is in.
struct LimbCarrier {
    publication: Publication,
    /// Of frames.
    taxels: Option<Vec<u32>>,
    /// When the layout was sent last, and whether somebody reads was looked at.
    layout_sent_at: Option<Instant>,
    is_read: Option<bool>,
    name: String,
    packet: Vec<u8>,
}

impl Carrier<Vec<u8>> for LimbCarrier {
    fn carry(&mut self, item: &Vec<u8>) -> Result<()> {
        let now = Instant::now();
        if self.layout_sent_at.is_none_or(|sent_at| now - sent_at >= LAYOUT_PERIOD) {
            self.layout_sent_at = Some(now);
            let is_read = self.publication.is_read();
            if self.is_read.replace(is_read) != Some(is_read) {
                let what = if is_read { "it has a subscriber" } else { "it has no known subscriber" };
                tell(&format!("{}: {what}", self.name));
            }
            if let Some(taxels) = &self.taxels {
                layout_packet(&mut self.packet, item, taxels);
                self.publication.put(&self.packet)?;
            }
        }
        self.publication.put(item)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::{TcpListener, TcpStream};
    use std::thread;

    use super::*;
    use crate::{Body, Engine, Frame, Options, Scene, bundled, touch};

    fn median_us(mut act: impl FnMut()) -> f64 {
        let mut took: Vec<f64> = (0..4000)
            .map(|_| {
                // As frames come: the thread that sends is asleep.
                thread::sleep(Duration::from_micros(200));
                let begin = Instant::now();
                act();
                begin.elapsed().as_secs_f64() * 1e6
            })
            .collect();
        took.sort_by(f64::total_cmp);
        took[took.len() / 2]
    }

    #[test]
    fn a_limb_sends_the_taxels_of_its_fields_also_where_touches_read_all() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let scene = |touches: Option<touch::Options>| Scene::default().fields(["hand/midhand/thumb"]).touches(touches);
        let plan = |touches: Option<touch::Options>| {
            let options = Options::default().scene(scene(touches)).backend(crate::BackendKind::Reference);
            Engine::new(&body, options).unwrap().plan().clone()
        };
        let (without, with) = (plan(None), plan(Some(touch::Options::default())));
        assert!(without.channels() == 5 && with.channels() == body.taxels.len());
        assert_eq!(with.taxels_of_fields(), without.taxels_of_fields());
        assert_eq!(with.taxels_of_fields().into_keys().collect::<Vec<_>>(), without.body_taxels);
        assert_eq!(limb_frame_bytes(&with), FRAME_BYTES + 4 * 5);
    }

    #[test]
    fn handing_a_frame_over_costs_the_engine_s_thread_little() {
        let body = Body::from_bytes("humanoid", bundled::body("humanoid").unwrap()).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let engine = Engine::new(&body, Options::default().backend(crate::BackendKind::Cpu)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let config = folder.path().join("nobody.json5");
        let silent = r#"{mode: "peer", listen: {endpoints: []}, scouting: {multicast: {enabled: false}}}"#;
        std::fs::write(&config, silent).unwrap();
        let session = Session { taxels: &ids, zenoh_config: Some(&config), ..Session::default() };
        let mut sink = ZenohSink::open("robot/all", LimbSends::Frames, &session).unwrap();
        let frames = [Frame { values: vec![RawValue::new(7.0); ids.len()], ..Frame::default() }];
        let input = InputFrames {
            frames: &frames,
            pressures: &|_, _| (),
            sensed: &|_, _, _| (),
            plan: engine.plan(),
            values_read: None,
            values_noted: &[],
            values_sensed: &[],
            arrived: None,
            call: Duration::ZERO,
        };
        let handed_us = median_us(|| assert_eq!(sink.write_input(&input).unwrap(), Flow::Open));

        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut bare = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        bare.set_nodelay(true).unwrap();
        let (mut read, _) = listener.accept().unwrap();
        thread::spawn(move || {
            let mut buffer = [0; 1 << 16];
            while read.read(&mut buffer).is_ok_and(|count| count > 0) {}
        });
        let bytes = vec![7; FRAME_BYTES + 4 * ids.len()];
        let sent_us = median_us(|| bare.write_all(&bytes).unwrap());
        eprintln!("a frame of {} bytes: {handed_us:.1} µs to hand over, {sent_us:.1} µs to send", bytes.len());
        assert!(handed_us < 3.0 * sent_us, "{handed_us} µs, and {sent_us} µs to send it");
    }
}
