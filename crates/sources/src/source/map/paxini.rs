//! PaXini's tactile sensors, PX-6AX, on its board for many of them, over a serial port.
//!
//! The board is asked which sensors are connected and how many taxels each has, and told to send frames by itself: of each sensor its
//! total, 6 bytes, which is not read, and three bytes for each taxel: x and y signed, z unsigned. As public readers of the board do, among
//! them one of the maker. These differ about sensors of the palm, which come last: they are left out.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read as _, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serialport::SerialPort;

use super::super::serial::explained;
use super::array_map::{ArrayMap, MapTime};
use super::mapped::{Came, Messages};
use crate::error::{Error, Result, failed};
use crate::signal::{FrameTime, RawValue};

mod packets;

use self::packets::{CONNECTED, CONTENT, Packet, Packets, READ, SENDING, SENSORS, TAXELS, WRITE};

/// The board's speed.
const BAUD: u32 = 921_600;
const READ_TIMEOUT: Duration = Duration::from_millis(20);
/// How often a request is sent, and how long its answer may take.
const TRIES: usize = 3;
const ANSWERS_WITHIN: Duration = Duration::from_millis(400);
/// Without a frame for so long, the board is asked again: it forgets what it was told when it starts again.
const SILENT_AFTER: Duration = Duration::from_secs(1);
const REOPEN_INTERVAL: Duration = Duration::from_millis(200);

/// Totals and taxels.
const EVERYTHING: u8 = 3;
const TOTAL_BYTES: usize = 6;
/// Sensors are numbered finger by finger, and those of the palm follow.
const FINGERS: [&str; 5] = ["thumb", "index", "middle", "ring", "little"];
const PARTS: [&str; 4] = ["proximal", "middle", "tip", "nail"];
const OF_FINGERS: usize = FINGERS.len() * PARTS.len();
/// What a sensor of the palm has in a frame at most, with more taxels than any that is sold.
const PALM_BYTES: usize = TOTAL_BYTES + 3 * 255;
/// Frames of another length, one after the other, that are no damage.
const OTHERS: u32 = 10;

/// Such a board.
pub(in crate::source) struct PaxiniBoard {
    name: String,
    port: String,
    baud: u32,
    line: Line,
    packets: Packets,
    /// Frames that came while an answer was waited for: their errors and data.
    frames: VecDeque<(u8, Vec<u8>)>,
    map: ArrayMap,
    /// The sensors that are connected, with their taxels.
    sensors: Vec<(String, usize)>,
    palms: u32,
    start: Instant,
    /// When the last frame came, or the board was asked for frames.
    last: Instant,
    /// Whether nothing is known since the last frame.
    is_stale: bool,
    has_stale: bool,
    /// Frames of another length since the last one that was right.
    others: u32,
    wrong: u64,
    /// The error of the board that was reported last, and frames with one.
    error: u8,
    with_error: u64,
    notices: Vec<String>,
    stopped: Arc<AtomicBool>,
}

enum Line {
    Open(Box<dyn SerialPort>),
    Gone(Instant),
}

/// What a read of the line gave.
enum Heard {
    Bytes,
    Nothing,
    Gone,
}

impl PaxiniBoard {
    /// Opens the board at `port`, at `baud` or its usual speed, and has it send frames.
    ///
    /// # Errors
    /// There is no such port or board, or no sensor is connected; a usage error if the map is not for it.
    pub(in crate::source) fn open(port: &str, baud: Option<u32>, map: &ArrayMap) -> Result<Self> {
        let name = format!("paxini:{port}");
        if map.axes.is_none() || matches!(map.time, MapTime::At(..)) || map.names.is_some() {
            let what = "taxels of PaXini have three axes, and neither times nor names; write axes = \"uvn\"";
            return Err(Error::usage(what).at(&map.name));
        }
        if !map.pads.is_empty() {
            let what = "pads: each sensor of PaXini is a pad, with its name; leave them out, and write pitch = \"2mm\" for all of them";
            return Err(Error::usage(what).at(&map.name));
        }
        let now = Instant::now();
        let mut board = Self {
            name,
            port: port.to_owned(),
            baud: baud.unwrap_or(BAUD),
            line: Line::Gone(now),
            packets: Packets::default(),
            frames: VecDeque::new(),
            map: map.clone(),
            sensors: Vec::new(),
            palms: 0,
            start: now,
            last: now,
            is_stale: false,
            has_stale: false,
            others: 0,
            wrong: 0,
            error: 0,
            with_error: 0,
            notices: Vec::new(),
            stopped: Arc::default(),
        };
        board.connect()?;
        board.begin().map_err(|e| e.at(&board.name))?;
        if board.palms > 0 {
            board.notices.push(format!(
                "{} sensors of the palm are left out: public sources differ about where the board counts their taxels",
                board.palms
            ));
        }
        Ok(board)
    }

    fn connect(&mut self) -> Result<()> {
        let opened = serialport::new(&self.port, self.baud).timeout(READ_TIMEOUT).open();
        let mut port = opened.map_err(|error| explained(&self.port, &error))?;
        // As the public readers do; pseudo-terminals have no such line.
        let _ = port.write_data_terminal_ready(true);
        self.line = Line::Open(port);
        self.packets.restart();
        Ok(())
    }

    /// Finds out which sensors are there, and has the board send frames; `false` where others are there than before.
    fn begin(&mut self) -> Result<bool> {
        // Half a packet that came before would swallow the answers.
        self.packets.restart();
        // It may still send those of another program, or give no answer to this.
        let _ = self.ask(&packets::write(SENDING, &[0]), WRITE, SENDING);
        self.frames.clear();
        let connected = self.read(CONNECTED, 4)?;
        let taxels = self.read(TAXELS, 2 * SENSORS as u16)?;
        let is_there = |sensor: usize| connected[sensor / 8] & (1 << (sensor % 8)) != 0;
        let sensor = |sensor: usize| {
            let name = format!("{}_{}", FINGERS[sensor / PARTS.len()], PARTS[sensor % PARTS.len()]);
            (name, usize::from(u16::from_le_bytes([taxels[2 * sensor], taxels[2 * sensor + 1]])))
        };
        let sensors: Vec<(String, usize)> = (0..OF_FINGERS).filter(|&own| is_there(own)).map(sensor).collect();
        if sensors.iter().all(|(_, taxels)| *taxels == 0) {
            return Err(Error::failed("no sensor of a finger is connected to the board"));
        }
        if !self.sensors.is_empty() && self.sensors != sensors {
            // Later again.
            self.last = Instant::now();
            return Ok(false);
        }
        self.sensors = sensors;
        self.palms = (OF_FINGERS..SENSORS).filter(|&palm| is_there(palm)).count() as u32;
        self.packets.limit(self.frame_bytes() + self.palms as usize * PALM_BYTES);
        // Boards that do not know this send everything.
        let _ = self.ask(&packets::write(CONTENT, &[EVERYTHING]), WRITE, CONTENT);
        self.ask(&packets::write(SENDING, &[1]), WRITE, SENDING)?;
        self.last = Instant::now();
        Ok(true)
    }

    fn read(&mut self, register: u16, count: u16) -> Result<Vec<u8>> {
        let data = self.ask(&packets::read(register, count), READ, register)?;
        match data.len() == usize::from(count) {
            true => Ok(data),
            false => Err(failed!("register {register:#x}: the answer has {} bytes of {count}", data.len())),
        }
    }

    /// The data of the board's answer to `request`.
    fn ask(&mut self, request: &[u8], function: u8, register: u16) -> Result<Vec<u8>> {
        for _ in 0..TRIES {
            if let Line::Open(port) = &mut self.line {
                port.write_all(request).map_err(|e| failed!("{e}"))?;
            }
            let until = Instant::now() + ANSWERS_WITHIN;
            while Instant::now() < until && !self.stopped.load(Ordering::Relaxed) {
                match self.packets.next() {
                    Some(Packet::Pushed { error, data }) => self.frames.push_back((error, data)),
                    Some(Packet::Answer { function: own, register: at, data }) if at == register => {
                        let status = data.first().copied().unwrap_or(0);
                        return match own {
                            READ if function == READ => Ok(data),
                            WRITE if function == WRITE && status == 0 => Ok(data),
                            WRITE if function == WRITE => {
                                Err(failed!("register {register:#x}: the board refuses, with error {status}"))
                            }
                            other => Err(failed!("register {register:#x}: the board answers with function {other:#x}")),
                        };
                    }
                    Some(Packet::Answer { .. }) => {}
                    None => {
                        if let Heard::Gone = self.hear() {
                            return Err(Error::failed("the port is gone"));
                        }
                    }
                }
            }
            // A damaged length of an answer would swallow the next ones.
            self.packets.restart();
        }
        Err(failed!(
            "no answer at {} baud; is it a PaXini board for many sensors, and is it powered? Another speed: {}@115200",
            self.baud,
            self.name
        ))
    }

    /// Reads what has come, or waits a moment for it.
    fn hear(&mut self) -> Heard {
        let Line::Open(port) = &mut self.line else { return Heard::Gone };
        let mut bytes = [0; 4096];
        match port.read(&mut bytes) {
            Ok(count) if count > 0 => {
                self.packets.push(&bytes[..count]);
                Heard::Bytes
            }
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => {
                Heard::Nothing
            }
            _ => {
                self.line = Line::Gone(Instant::now());
                Heard::Gone
            }
        }
    }

    /// Does what is due while no frame comes: opens the port that is gone, or asks the board again.
    ///
    /// # Errors
    /// Other sensors are there than before.
    fn wait(&mut self) -> Result<()> {
        if let Line::Gone(since) = self.line {
            if since.elapsed() < REOPEN_INTERVAL {
                thread::sleep(READ_TIMEOUT);
                return Ok(());
            }
            if self.connect().is_err() {
                self.line = Line::Gone(Instant::now());
                return Ok(());
            }
        } else if self.last.elapsed() < SILENT_AFTER {
            return Ok(());
        }
        match self.begin() {
            Ok(true) => self.notices.push("it is told to send frames again".to_owned()),
            Ok(false) => {
                let what = "other sensors are connected to the board than at the beginning; start again";
                return Err(Error::failed(what).at(&self.name));
            }
            // Later again.
            Err(_) => self.last = Instant::now(),
        }
        Ok(())
    }

    /// The bytes of data that fingers have in a frame.
    fn frame_bytes(&self) -> usize {
        self.sensors.iter().map(|(_, taxels)| TOTAL_BYTES + 3 * taxels).sum()
    }

    /// The next frame that has come, its error and data.
    fn frame(&mut self) -> Option<(u8, Vec<u8>)> {
        if let Some(frame) = self.frames.pop_front() {
            return Some(frame);
        }
        loop {
            match self.packets.next()? {
                Packet::Pushed { error, data } => return Some((error, data)),
                Packet::Answer { .. } => {}
            }
        }
    }

    /// Whether there is such a frame, which stays the next one.
    fn is_next(&mut self) -> bool {
        let Some(frame) = self.frame() else { return false };
        self.frames.push_front(frame);
        true
    }

    /// The error where frames have `bytes` of data.
    fn other_frames(&self, bytes: usize) -> Error {
        failed!("frames have {bytes} bytes, which are not those of its sensors").at(&self.name)
    }

    /// Puts the values of a frame at the end of `values`; `false` where it has not the length of one.
    fn take(&mut self, data: &[u8], values: &mut Vec<RawValue>) -> bool {
        let own = self.frame_bytes();
        let fits = if self.palms > 0 { data.len() >= own } else { data.len() == own };
        if !fits {
            return false;
        }
        let mut rest = data;
        for (_, taxels) in &self.sensors {
            let (sensor, others) = rest.split_at(TOTAL_BYTES + 3 * taxels);
            rest = others;
            for taxel in sensor[TOTAL_BYTES..].chunks_exact(3) {
                let numbers = [f64::from(taxel[0] as i8), f64::from(taxel[1] as i8), f64::from(taxel[2])];
                values.extend(numbers.map(|number| self.map.value(number)));
            }
        }
        true
    }

    /// Notes what the board says of a frame.
    fn note(&mut self, error: u8) {
        self.with_error += u64::from(error != 0);
        if error != 0 && error != self.error {
            self.notices.push(format!("the board reports error {error}; its values are used"));
            self.error = error;
        }
    }

    /// Makes `values` those of a frame in which nothing is known, if none was since the last one.
    fn stale(&mut self, what: &str, values: &mut Vec<RawValue>) -> bool {
        if std::mem::replace(&mut self.is_stale, true) {
            return false;
        }
        self.notices.push(what.to_owned());
        let taxels: usize = self.sensors.iter().map(|(_, taxels)| taxels).sum();
        values.resize(values.len() + 3 * taxels, RawValue::STALE);
        self.has_stale = true;
        true
    }

    fn time(&self) -> Came {
        Came::Message(FrameTime::from(self.start.elapsed().as_secs_f64()))
    }
}

impl Messages for PaxiniBoard {
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
        while !self.stopped.load(Ordering::Relaxed) {
            if let Some((error, data)) = self.frame() {
                self.last = Instant::now();
                if self.take(&data, values) {
                    self.note(error);
                    (self.is_stale, self.others) = (false, 0);
                    return Ok(self.time());
                }
                (self.wrong, self.others) = (self.wrong + 1, self.others + 1);
                if self.others >= OTHERS {
                    self.others = 0;
                    return Err(self.other_frames(data.len()));
                }
                continue;
            }
            if let Some(bytes) = self.packets.too_long(OTHERS) {
                return Err(self.other_frames(bytes));
            }
            match self.hear() {
                // A frame may be among them. Else they are as good as none, however many come.
                Heard::Bytes if self.last.elapsed() < SILENT_AFTER => {}
                Heard::Bytes if self.is_next() => {}
                Heard::Gone if self.stale("gone; waiting for it to come back", values) => return Ok(self.time()),
                Heard::Bytes | Heard::Nothing if self.last.elapsed() >= SILENT_AFTER => {
                    if self.stale("no frames come; the board is asked again", values) {
                        return Ok(self.time());
                    }
                    self.wait()?;
                }
                Heard::Gone | Heard::Nothing | Heard::Bytes => self.wait()?,
            }
        }
        Ok(Came::End)
    }

    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        self.stopped = Arc::clone(stopped);
    }

    /// Each of its errors is of the board: damaged frames are counted.
    fn has_failed(&self) -> bool {
        true
    }

    fn named(&self) -> &[(String, usize)] {
        &self.sensors
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn taken(&self) -> String {
        format!("{}: forces along x, y and z; time is when they come", self.name)
    }

    fn notices(&mut self) -> Vec<String> {
        self.notices.drain(..).map(|what| format!("{}: {what}", self.name)).collect()
    }

    fn losses(&self) -> Vec<String> {
        let all = [
            (self.packets.damaged, "pieces of the line are not packets"),
            (self.wrong, "packets have another length than frames"),
            (self.with_error, "frames came with an error of the board"),
        ];
        let some = all.into_iter().filter(|(count, _)| *count > 0);
        some.map(|(count, what)| format!("{}: {count} {what}", self.name)).collect()
    }

    fn has_stale(&self) -> bool {
        self.has_stale
    }

    fn read_at(&mut self) -> Option<Instant> {
        (!self.is_stale).then_some(self.last)
    }
}

// Terminals are Unix's.
#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::os::unix::fs::symlink;

    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

    use super::super::mapped::MappedSource;
    use super::packets::tests::{answer, pushed};
    use super::*;
    use crate::body::Body;
    use crate::signal::{Channel, Frame};
    use crate::source::Source as _;

    /// What a board does from now on.
    #[derive(Clone, Debug)]
    struct Says {
        connected: [u8; 4],
        /// Of the tip of the thumb and the proximal part of the index finger.
        taxels: [u16; 2],
        /// What is sent instead of the n-th frame since it was told to send. If that is nothing, the board has started again, and is
        /// silent.
        frame: fn(u16) -> Vec<u8>,
        refuses: Option<u16>,
        /// Whether the first answer about sensors, and every other one, breaks off after a wrong length.
        breaks_off: bool,
    }

    /// The thumb's tip has two taxels, and the index finger one.
    const TWO: Says =
        Says { connected: [0b1_0100, 0, 0, 0], taxels: [2, 1], frame: plain, refuses: None, breaks_off: false };

    /// Two sensors, of which the first taxel's values are `n`, -n and 200.
    fn data(n: u16) -> Vec<u8> {
        let n = n as u8;
        let total = [9, 0, 9, 0, 9, 0];
        [&total[..], &[n, n.wrapping_neg(), 200, 0, 127, 0], &total, &[0x80, 0xAA, 0x56]].concat()
    }

    fn plain(n: u16) -> Vec<u8> {
        pushed(0, &data(n))
    }

    /// A board on a pseudo-terminal, whose name is linked to: a request is answered, and frames are sent from when it was told to.
    struct Board {
        is_unplugged: Arc<AtomicBool>,
        is_asleep: Arc<AtomicBool>,
        thread: Option<thread::JoinHandle<()>>,
        link: std::path::PathBuf,
    }

    impl Board {
        fn plugged(folder: &std::path::Path, says: Says) -> Self {
            let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
            grantpt(&end).unwrap();
            unlockpt(&end).unwrap();
            let name = ptsname(&end, Vec::new()).unwrap().into_string().unwrap();
            rustix::io::ioctl_fionbio(&end, true).unwrap();
            let link = folder.join("board");
            let _ = std::fs::remove_file(&link);
            symlink(name, &link).unwrap();
            let (is_unplugged, is_asleep) = (Arc::default(), Arc::default());
            let board =
                Self { is_unplugged: Arc::clone(&is_unplugged), is_asleep: Arc::clone(&is_asleep), thread: None, link };
            let thread = thread::spawn(move || play(File::from(end), &says, &is_unplugged, &is_asleep));
            Self { thread: Some(thread), ..board }
        }

        fn unplug(&mut self) {
            std::fs::remove_file(&self.link).unwrap();
            self.is_unplugged.store(true, Ordering::Relaxed);
            self.thread.take().unwrap().join().unwrap();
        }
    }

    /// Sends all of `bytes`, unless nobody listens for long.
    fn send(end: &mut File, mut bytes: &[u8]) {
        let until = Instant::now() + Duration::from_secs(3);
        while !bytes.is_empty() && Instant::now() < until {
            match end.write(bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(e) if e.kind() == ErrorKind::WouldBlock => thread::sleep(Duration::from_millis(1)),
                Err(_) => return,
            }
        }
    }

    fn play(mut end: File, says: &Says, is_unplugged: &AtomicBool, is_asleep: &AtomicBool) {
        let (mut sends, mut sent, mut request, mut breaks_off) = (false, 0_u16, Vec::new(), false);
        while !is_unplugged.load(Ordering::Relaxed) {
            let mut byte = [0];
            while matches!(end.read(&mut byte), Ok(1)) {
                request.push(byte[0]);
                let wanted =
                    request.get(6).map_or(9, |count| 9 + usize::from(*count) * usize::from(request[3] == WRITE));
                if request.len() < wanted {
                    continue;
                }
                let bytes = std::mem::take(&mut request);
                assert!(
                    bytes[..3] == [0x55, 0xAA, 0] && bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) == 0
                );
                let register = u16::from_le_bytes([bytes[4], bytes[5]]);
                let mut taxels = [0; 56];
                taxels[4] = says.taxels[0] as u8;
                taxels[8] = says.taxels[1] as u8;
                let told = match (bytes[3], register) {
                    (function, register) if says.refuses == Some(register) => answer(function, register, &[5]),
                    (READ, CONNECTED) => {
                        breaks_off = says.breaks_off && !breaks_off;
                        let broken = answer(READ, register, &[0; 56])[..9].to_vec();
                        if breaks_off { broken } else { answer(READ, register, &says.connected) }
                    }
                    (READ, TAXELS) => answer(READ, register, &taxels),
                    (WRITE, SENDING) => {
                        (sends, sent, breaks_off) = (bytes[8] == 1, 0, false);
                        is_asleep.store(false, Ordering::Relaxed);
                        answer(WRITE, register, &[0])
                    }
                    _ => answer(WRITE, register, &[0]),
                };
                send(&mut end, &told);
            }
            if sends && !is_asleep.load(Ordering::Relaxed) {
                let frame = (says.frame)(sent);
                sends = !frame.is_empty();
                send(&mut end, &frame);
                sent = sent.wrapping_add(1);
            }
            thread::sleep(Duration::from_millis(4));
        }
    }

    fn is_stale(frame: &Frame) -> bool {
        frame.values.iter().all(|value| *value == RawValue::STALE)
    }

    fn is_known(frame: &Frame) -> bool {
        frame.values.iter().all(|value| value.number().is_some())
    }

    /// The numbers of the next frames from the one `first` on, so many. It begins anew where nothing came for long, as on a busy machine.
    fn row(source: &mut MappedSource, first: u8, count: usize) -> Vec<u8> {
        let mut row = Vec::new();
        until(source, |frame| {
            let number = frame.values[0].number().map(|number| (number * 10.0).round() as i8 as u8);
            match number {
                None => row.clear(),
                Some(number) if row.is_empty() && number != first => {}
                Some(number) => row.push(number),
            }
            row.len() == count
        });
        row
    }

    /// The board on the line. It may give no answer for long on a busy machine.
    fn on_line(board: &Board, map: &ArrayMap) -> Result<PaxiniBoard> {
        let open = || PaxiniBoard::open(board.link.to_str().unwrap(), None, map);
        let is_answer = |opened: &Result<_>| opened.as_ref().err().is_none_or(|e| !e.to_string().contains("no answer"));
        (0..8).map(|_| open()).find(is_answer).unwrap_or_else(open)
    }

    fn opened(board: &Board) -> Result<MappedSource> {
        let map = ArrayMap::named("paxini").unwrap();
        // What is wrong with a board is no message that could be skipped.
        MappedSource::new(Box::new(on_line(board, &map)?), &map, true)
    }

    /// The next frame that is as wanted, of at most 2,000 and within a minute.
    fn until(source: &mut MappedSource, mut is_wanted: impl FnMut(&Frame) -> bool) -> Frame {
        let (mut frame, start) = (Frame::default(), Instant::now());
        for _ in 0..2_000 {
            assert!(source.next_frame(&mut frame).unwrap() && start.elapsed() < Duration::from_secs(60));
            if is_wanted(&frame) {
                return frame;
            }
        }
        panic!("none of 2,000 frames")
    }

    fn first(frame: &Frame) -> Option<f64> {
        frame.values[0].number()
    }

    #[test]
    fn forces_of_all_taxels_come_with_their_sensors_names() {
        let folder = tempfile::tempdir().unwrap();
        let board = Board::plugged(folder.path(), TWO);
        let mut source = opened(&board).unwrap();
        let names: Vec<String> = source.taxels().iter().map(|&id| Channel(id).to_string()).collect();
        assert_eq!(names, ["0.u", "0.v", "0", "1.u", "1.v", "1", "2.u", "2.v", "2"]);
        let frame = until(&mut source, |frame| first(frame) == Some(3.0_f32.into()));
        let numbers: Vec<f32> = frame.values.iter().map(|value| value.number().unwrap() as f32).collect();
        assert_eq!(numbers, [3.0, -3.0, 20.0, 0.0, 12.7, 0.0, -12.8, -8.6, 8.6]);
        // All of them, one after the other.
        assert_eq!(row(&mut source, 40, 90), (40..130).collect::<Vec<u8>>());
        let mut last = frame.t_s;
        for _ in 0..20 {
            let frame = until(&mut source, |_| true);
            assert!(frame.t_s > last, "{} after {last}", frame.t_s);
            last = frame.t_s;
        }
        assert!(source.losses().is_empty() || source.has_stale(), "{:?}", source.losses());
        let body = Body::from_bytes("pads", &source.body().unwrap()).unwrap();
        let mut names: Vec<&str> = body.fields.iter().map(|field| field.name.as_str()).collect();
        names.sort_unstable();
        assert_eq!(names, ["index_proximal", "thumb_tip"]);
        let said = source.notices().join("; ");
        assert!(said.contains("9 values a message of 2 sensors") && said.contains("untested"), "{said}");
    }

    #[test]
    fn damaged_and_short_frames_are_counted_and_the_next_one_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let damaged = |n: u16| {
            let mut bytes = plain(n);
            match n % 10 {
                // A length of 12,000 bytes, and one of an answer.
                1 => bytes[4] ^= 0x30,
                4 => bytes[1] ^= 3,
                3 => bytes[12] ^= 4,
                6 => bytes.truncate(20),
                8 => *bytes.last_mut().unwrap() ^= 1,
                9 => bytes = pushed(0, &data(n)[..15]),
                _ => {}
            }
            bytes
        };
        let board = Board::plugged(folder.path(), Says { frame: damaged, ..TWO });
        let mut source = opened(&board).unwrap();
        let wanted: Vec<u8> = (20..).filter(|n| [0, 2, 5, 7].contains(&(n % 10))).take(30).collect();
        assert_eq!(row(&mut source, 20, 30), wanted);
        let losses = source.losses().join("; ");
        assert!(
            losses.contains("pieces of the line are not packets") && losses.contains("packets have another length"),
            "{losses}"
        );
    }

    #[test]
    fn a_board_that_is_unplugged_or_starts_again_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let mut board = Board::plugged(folder.path(), TWO);
        let mut source = opened(&board).unwrap();
        until(&mut source, is_known);
        // It starts again: nothing comes until it is told to send.
        board.is_asleep.store(true, Ordering::Relaxed);
        until(&mut source, is_stale);
        until(&mut source, is_known);
        board.unplug();
        until(&mut source, is_stale);
        let again = Board::plugged(folder.path(), TWO);
        until(&mut source, is_known);
        assert!(source.has_stale());
        let said = source.notices().join("; ");
        assert!(said.contains("the board is asked again") && said.contains("gone; waiting for it"), "{said}");
        // With another sensor it is another robot.
        let mut again = again;
        again.unplug();
        let other = Board::plugged(folder.path(), Says { connected: [0b100, 0, 0, 0], ..TWO });
        let mut frame = Frame::default();
        let why = (0..2_000).find_map(|_| source.next_frame(&mut frame).err()).unwrap().to_string();
        assert!(why.contains("other sensors are connected") && why.lines().count() == 1, "{why}");
        drop(other);
    }

    #[test]
    fn a_board_that_is_silent_is_asked_until_nobody_reads_it() {
        let folder = tempfile::tempdir().unwrap();
        let mut board = Board::plugged(folder.path(), TWO);
        let mut source = opened(&board).unwrap();
        until(&mut source, is_known);
        board.unplug();
        until(&mut source, is_stale);
        let stopped: Arc<AtomicBool> = Arc::default();
        source.stop_by(&stopped);
        let thread = thread::spawn(move || source.next_frame(&mut Frame::default()).unwrap());
        thread::sleep(SILENT_AFTER / 2);
        assert!(!thread.is_finished());
        stopped.store(true, Ordering::Relaxed);
        assert!(!thread.join().unwrap(), "there is no other frame");
    }

    #[test]
    fn an_answer_that_breaks_off_does_not_swallow_the_next_one() {
        let folder = tempfile::tempdir().unwrap();
        let board = Board::plugged(folder.path(), Says { breaks_off: true, ..TWO });
        until(&mut opened(&board).unwrap(), is_known);
    }

    #[test]
    fn half_a_packet_does_not_swallow_the_answers() {
        let folder = tempfile::tempdir().unwrap();
        // The board starts again within a frame that is longer than a hundred answers.
        let frame = |n: u16| match n {
            0..30 => pushed(0, &[data(n), vec![0; 1488]].concat()),
            30 => pushed(0, &[data(n), vec![0; 1488]].concat())[..400].to_vec(),
            _ => Vec::new(),
        };
        let board = Board::plugged(folder.path(), Says { taxels: [250, 249], frame, ..TWO });
        let mut source = opened(&board).unwrap();
        let mut again = || {
            until(&mut source, is_known);
            until(&mut source, is_stale);
            let start = Instant::now();
            until(&mut source, is_known);
            start.elapsed()
        };
        // No request is sent twice, but on a busy machine.
        let fastest = (0..4).map(|_| again()).min().unwrap();
        assert!(fastest < ANSWERS_WITHIN, "{fastest:?}");
    }

    #[test]
    fn bytes_that_are_no_packets_are_as_good_as_silence() {
        let folder = tempfile::tempdir().unwrap();
        // Noise until it is told to send again, or for a quarter of a minute.
        let frame = |n: u16| if (30..4_000).contains(&n) { vec![0x33; 20] } else { plain(n) };
        let board = Board::plugged(folder.path(), Says { frame, ..TWO });
        let mut source = opened(&board).unwrap();
        until(&mut source, is_known);
        until(&mut source, is_stale);
        until(&mut source, is_known);
        let said = source.notices().join("; ");
        assert!(said.contains("the board is asked again") && said.contains("told to send frames again"), "{said}");
    }

    #[test]
    fn other_sensors_are_found_again_only_after_a_while() {
        let folder = tempfile::tempdir().unwrap();
        let mut board = Board::plugged(folder.path(), TWO);
        let map = ArrayMap::named("paxini").unwrap();
        let mut messages = on_line(&board, &map).unwrap();
        board.unplug();
        let _other = Board::plugged(folder.path(), Says { connected: [0b100, 0, 0, 0], ..TWO });
        let mut refused = || (0..2_000).find_map(|_| messages.next(&mut Vec::new()).err()).unwrap().to_string();
        for _ in 0..2 {
            assert!(refused().contains("other sensors are connected"));
        }
        let start = Instant::now();
        assert!(refused().contains("other sensors are connected"));
        assert!(start.elapsed() > SILENT_AFTER / 2, "{:?}", start.elapsed());
    }

    #[test]
    fn what_a_board_does_wrong_is_said_in_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let why = |says: Says| {
            let mut board = Board::plugged(folder.path(), says);
            let mut source = opened(&board)?;
            let mut frame = Frame::default();
            let found = (0..50).find_map(|_| source.next_frame(&mut frame).err());
            let said = [source.notices(), source.losses()].concat().join("; ");
            board.unplug();
            found.map_or(Ok(said), Err)
        };
        for (says, what) in [
            (Says { connected: [0; 4], ..TWO }, "no sensor of a finger is connected"),
            (Says { refuses: Some(SENDING), ..TWO }, "register 0x17: the board refuses, with error 5"),
            (Says { refuses: Some(TAXELS), ..TWO }, "register 0x30: the answer has 1 bytes of 56"),
            (Says { taxels: [2, 2], ..TWO }, "frames have 21 bytes, which are not those of its sensors"),
            (Says { taxels: [1, 1], ..TWO }, "frames have 21 bytes, which are not those of its sensors"),
        ] {
            let why = why(says).unwrap_err().to_string();
            assert!(why.contains(what) && why.lines().count() == 1, "{what}: {why}");
        }
        let said = why(Says { frame: |n| pushed(4, &data(n)), ..TWO }).unwrap();
        assert!(said.matches("reports error 4; its values are used").count() == 1, "{said}");
        assert!(said.contains("frames came with an error of the board"), "{said}");
        let palm = |n| pushed(0, &[data(n), vec![0; 33]].concat());
        let said = why(Says { connected: [0b1_0100, 0, 0x10, 1], frame: palm, ..TWO }).unwrap();
        assert!(said.contains("2 sensors of the palm are left out"), "{said}");
        // A line that is silent, and a port that is not there.
        let why = |port: &str, map: &str| PaxiniBoard::open(port, None, &ArrayMap::parse(map).unwrap()).err().unwrap();
        let map = "values = 'taxels'\naxes = 'uvn'";
        let silent = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        unlockpt(&silent).unwrap();
        let name = ptsname(&silent, Vec::new()).unwrap().into_string().unwrap();
        let said = why(&name, map).to_string();
        assert!(said.contains("no answer at 921600 baud; is it a PaXini board"), "{said}");
        assert!(why("/dev/no-such-port", map).to_string().contains("there is no such port"));
        assert!(why(&name, "values = 'taxels'").is_usage());
        let pads = why(&name, &format!("{map}\n[[pads]]\nname = 'tip'\ngrid = '1x2'"));
        assert!(pads.is_usage() && pads.to_string().contains("map: pads: each sensor of PaXini is a pad"), "{pads}");
    }
}
