//! A virtual board on its serial line: paced by the baud rate, with simulated faults.

use std::time::Duration;

use serde_json::{Value, json};
use somatic::Result;
use somatic::internal::board::{Faults, FaultyLine, VirtualBoard, Window};
use somatic::internal::output::OutputLink;

use super::pty::Pty;

/// Maximum time that the line is credited for at once.
const MAX_CREDIT_STEP: Duration = Duration::from_millis(50);

/// Settings that all boards of a command share.
pub(super) struct LineSettings {
    pub(super) baud: u32,
    pub(super) faults: Faults,
    /// Maximum number of frames per board.
    pub(super) frames: u64,
}

pub(super) struct Station {
    pub(super) id: u16,
    pub(super) board: VirtualBoard,
    /// Per channel, its index in the readings.
    pub(super) places: Vec<Option<usize>>,
    pub(super) plug: Option<Pty>,
    pub(super) link: Option<OutputLink>,
    to_host: FaultyLine,
    from_host: FaultyLine,
    /// Bytes that the line may send now.
    credit: f64,
    row: u64,
    resets: u64,
    unplugs: u64,
    bytes: u64,
    unheard: u64,
    overrun: u64,
}

impl Station {
    pub(super) fn new(
        id: u16,
        board: VirtualBoard,
        places: Vec<Option<usize>>,
        link: Option<OutputLink>,
        seed: u64,
    ) -> Self {
        let seed = seed.wrapping_mul(0x1_0001).wrapping_add(id.into());
        Self {
            id,
            board,
            places,
            plug: None,
            link,
            to_host: FaultyLine::new(seed),
            from_host: FaultyLine::new(!seed),
            credit: 0.0,
            row: 0,
            resets: 0,
            unplugs: 0,
            bytes: 0,
            unheard: 0,
            overrun: 0,
        }
    }

    pub(super) fn plug_in(&mut self) -> Result<()> {
        let pty = Pty::open()?;
        if let Some(link) = &self.link {
            link.lead_to(&pty.path)?;
        }
        self.plug = Some(pty);
        Ok(())
    }

    pub(super) fn pull_out(&mut self) {
        // The link first: the terminal's name may at once be another's.
        if let (Some(_), Some(link)) = (&self.plug, &self.link) {
            link.remove();
        }
        self.plug = None;
    }

    /// Whether everything has been sent.
    pub(super) fn is_done(&mut self, common: &LineSettings) -> bool {
        self.board.frames() >= common.frames && self.board.outgoing().is_empty()
    }

    /// Simulates the time from `now` − `step` to `now`. `row` is the number of the `readings`.
    pub(super) fn go_on(
        &mut self,
        now: Duration,
        step: Duration,
        common: &LineSettings,
        row: u64,
        readings: &[Option<u16>],
    ) -> Result<()> {
        let faults = &common.faults;
        let begun = |windows: &[Window]| windows.iter().map(|window| window.at(now).0).sum::<u64>();
        let lasts = |windows: &[Window]| windows.iter().any(|window| window.at(now).1);
        self.unplugs = begun(&faults.unplug);
        match (lasts(&faults.unplug), &self.plug) {
            (true, Some(_)) => self.pull_out(),
            (false, None) => self.plug_in()?,
            _ => {}
        }
        if begun(&faults.reset) > self.resets {
            self.resets = begun(&faults.reset);
            self.board.restart(now);
        }
        let baud_ratio = self.plug.as_ref().filter(|plug| plug.is_open()).map(|plug| plug.baud_ratio(common.baud));
        if let (Some(plug), Some(baud_ratio)) = (&self.plug, baud_ratio) {
            let (mut buffer, mut arrives) = ([0; 1024], Vec::new());
            for &byte in plug.read(&mut buffer) {
                self.from_host.pass(byte, faults, 1.0 / baud_ratio, &mut arrives);
            }
            self.board.receive(&arrives, now);
        }
        self.credit += step.min(MAX_CREDIT_STEP).as_secs_f64() * f64::from(common.baud) / 10.0;
        let (silent, mut arrives) = (lasts(&faults.silence), Vec::new());
        while self.credit >= 1.0 {
            if self.board.outgoing().is_empty() {
                let fresh = row > self.row || (row > 0 && !self.board.is_unthrottled());
                let may = !silent && fresh && self.board.frames() < common.frames;
                if !may || !self.board.is_due(now) {
                    self.credit = 0.0;
                    break;
                }
                let own: Vec<Option<u16>> = self.places.iter().map(|place| readings[(*place)?]).collect();
                self.board.send(&own, now);
                self.row = row;
            }
            let Some(byte) = self.board.outgoing().pop_front() else { break };
            self.credit -= 1.0;
            self.bytes += 1;
            match baud_ratio {
                Some(baud_ratio) => self.to_host.pass(byte, faults, baud_ratio, &mut arrives),
                None => self.unheard += 1,
            }
        }
        if let Some(plug) = &self.plug {
            self.overrun += (arrives.len() - plug.write(&arrives)) as u64;
        }
        Ok(())
    }

    pub(super) fn port(&self) -> String {
        self.plug.as_ref().map_or_else(|| "unplugged".to_owned(), |plug| plug.path.display().to_string())
    }

    /// Counts of what was sent and which faults occurred.
    pub(super) fn account(&self) -> Value {
        let (out, back) = (self.to_host.done, self.from_host.done);
        json!({
            "board": self.id,
            "frames": self.board.frames(),
            "bytes": self.bytes,
            "commands": self.board.commands(),
            "wipers": self.board.wipers(),
            "faults": {
                "noise_bytes": out.noise_bytes + back.noise_bytes,
                "dropped_bytes": out.dropped_bytes + back.dropped_bytes,
                "flipped_bits": out.flipped_bits + back.flipped_bits,
                "garbled_bytes": out.garbled_bytes + back.garbled_bytes,
                "unplugs": self.unplugs,
                "resets": self.resets,
            },
            "unheard_bytes": self.unheard,
            "overrun_bytes": self.overrun,
        })
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        self.pull_out();
    }
}
