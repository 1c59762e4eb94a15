//! Boards on serial lines, many at once, as one source of frames.
//!
//! One thread per port reads and decodes ([`crate::wire`]) without waiting for the consumer; when the queue is full, the
//! oldest frames are dropped and counted. Frames of boards are merged into frames of the skin. `docs/reference/boards.md`
//! explains the messages.

mod port;
mod session;

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

pub(super) use self::port::explained;
use self::session::{LineConfig, Session};
use super::Source;
use super::boards::{Lines, Merge, Merged, Pace, Shared};
use crate::error::{Error, Result, failed};
use crate::signal::{Channel, Frame, Wiring};

/// The default speed of a line, baud.
const DEFAULT_BAUD: u32 = 57_600;

/// How boards on serial lines are read.
#[derive(Clone, Debug, Default)]
pub struct SerialOptions {
    /// The taxel on each channel of each board. Without one, as many boards as ports, numbered from 1, share the body's
    /// taxels in ascending order of their ids ([`Wiring::in_order`]).
    pub wiring: Option<Wiring>,
    /// Rate of merged frames, Hz; 0 for one at each frame of any board. By default one at each frame of the fastest board.
    pub live_rate_hz: Option<f64>,
    /// Frame rate to set on the boards, Hz; 0 is as fast as the line allows. By default their rate is left as it is.
    pub board_rate_hz: Option<f64>,
    /// Maximum age of a value, s; by default three periods of its board, at least 50 ms.
    pub max_age_s: Option<f64>,
}

/// Frames of boards on serial lines.
///
/// Times count from its opening, s. Values of a silent board are [`RawValue::STALE`](somatic_skin::signal::RawValue::STALE).
pub struct SerialSource {
    merged: Merged,
    taxels: Vec<u32>,
    wiring: Arc<Wiring>,
}

somatic_skin::debug_by_name!(SerialSource);

impl SerialSource {
    /// Starts to read `ports`, each with its speed in baud where one is given, for a body whose taxels have `ids`.
    ///
    /// It returns at once. Whether boards answer is reported by [`Lines::notices`], and by an error of
    /// [`Source::next_frame`] if no line can be used.
    ///
    /// # Errors
    /// A port is named twice; the wiring has taxels that the body does not have; a rate or an age makes no sense.
    pub fn open(ports: &[(String, Option<u32>)], ids: &[u32], options: &SerialOptions) -> Result<Self> {
        let wiring = match &options.wiring {
            Some(wiring) => wiring.clone(),
            None => Wiring::in_order(ids, 1, ports.len()).map_err(|e| e.at("no --wiring is given"))?,
        };
        check(ports, ids, &wiring)?;
        let pace = Pace::from_rate(options.live_rate_hz)?;
        let rate_mhz = options.board_rate_hz.map(rate_mhz).transpose()?;
        let taxels: Vec<u32> =
            wiring.boards().iter().flat_map(|board| board.taxels.iter().flatten().copied()).collect();
        let mut next = 0..taxels.len();
        let mut place = |taxel: &Option<u32>| taxel.and_then(|_| next.next());
        let places = wiring.boards().iter().map(|board| board.taxels.iter().map(&mut place).collect()).collect();

        let wiring = Arc::new(wiring);
        let start = Instant::now();
        let shared = Arc::new(Shared::of_boards(&wiring, ports.len(), start));
        for (line, (port, baud)) in ports.iter().enumerate() {
            let usual = || wired_baud(&wiring, port).unwrap_or(DEFAULT_BAUD);
            let session = Session::new(LineConfig {
                line,
                port: port.clone(),
                baud: baud.unwrap_or_else(usual),
                fixed: baud.is_some(),
                rate_mhz,
                wiring: Arc::clone(&wiring),
                shared: Arc::clone(&shared),
            });
            thread::Builder::new()
                .name(format!("line {}", line + 1))
                .spawn(move || port::read(session, start))
                .map_err(|e| failed!("cannot start a thread: {e}").at(port))?;
        }
        let merge = Merge::new(places, pace, options.max_age_s);
        let merged = Merged::new(shared, merge, taxels.len(), start);
        Ok(Self { merged, taxels, wiring })
    }

    /// The taxel on each channel of each board.
    #[must_use]
    pub fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    /// State and messages of the lines, for display.
    #[must_use]
    pub fn lines(&self) -> Lines {
        self.merged.lines.clone()
    }
}

/// The wiring's speed for the board expected on `port`, or the speed that all boards share.
fn wired_baud(wiring: &Wiring, port: &str) -> Option<u32> {
    let boards = wiring.boards();
    let own = boards.iter().find(|board| board.port.as_deref() == Some(port)).and_then(|board| board.baud);
    own.or_else(|| boards[0].baud.filter(|_| boards.iter().all(|board| board.baud == boards[0].baud)))
}

fn check(ports: &[(String, Option<u32>)], ids: &[u32], wiring: &Wiring) -> Result<()> {
    let mut named = HashSet::new();
    for (port, _) in ports {
        let same = Path::new(port).canonicalize().unwrap_or_else(|_| port.into());
        if !named.insert(same) {
            return Err(Error::usage("this port is given twice; give each once").at(port));
        }
    }
    let there: HashSet<u32> = ids.iter().copied().collect();
    for board in wiring.boards() {
        let strange = board.taxels.iter().enumerate().find(|(_, taxel)| taxel.is_some_and(|id| !there.contains(&id)));
        if let Some((channel, Some(id))) = strange {
            let what = format!("the body has no taxel {}; is it the right body?", Channel(*id));
            return Err(Error::failed(what).at(format!("wiring: board {}: channel {channel}", board.id)));
        }
    }
    Ok(())
}

fn rate_mhz(hz: f64) -> Result<u32> {
    if hz == 0.0 || (0.001..=1e6).contains(&hz) {
        return Ok((hz * 1e3).round() as u32);
    }
    Err(Error::usage(format!(
        "--board-rate {hz} is not a rate; give 0.001 to 1000000 Hz, or 0 for as many as the line takes"
    )))
}

impl Source for SerialSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        self.merged.next_frame(frame)
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.merged.read_at()
    }

    fn losses(&self) -> Vec<String> {
        self.merged.lines.losses()
    }
}
