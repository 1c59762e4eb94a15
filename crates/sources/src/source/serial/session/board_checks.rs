//! Checks the board on a line against the wiring, and forwards its frames.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{LineConfig, LineState};
use crate::signal::WiredBoard;
use crate::source::boards::{BoardFrame, BoardState, ChannelWiper, Verdict};
use crate::wire::{Bits, Command, Head, Identity, NO_LAYOUT, PacketOrder, layout_hash};

impl LineState {
    pub(super) fn count_losses(&mut self, head: &Head, order: &PacketOrder, now: Duration) {
        let Some((board, id)) = self.joined.filter(|(_, id)| *id == head.board) else { return };
        let mut state = self.config.shared.lock();
        state.accounts[board].lost += u64::from(order.lost);
        self.lost += order.lost;
        if order.restarted {
            state.wipers[board].iter_mut().for_each(ChannelWiper::forget);
            state.accounts[board].restarts += 1;
            state.notify(format!("{}: board {id} has started again", self.config.port));
            drop(state);
            self.clock_restarted = true;
            self.reset_identity(now);
        }
    }

    fn reset_identity(&mut self, now: Duration) {
        (self.board, self.since) = (None, now);
    }

    /// Checks a board's identity against the wiring and configures the board.
    pub(super) fn identified(&mut self, head: &Head, order: &PacketOrder, identity: &Identity<'_>, now: Duration) {
        let wiring = Arc::clone(&self.config.wiring);
        let Some(board) = wiring.boards().iter().position(|board| board.id == head.board) else {
            return self.unknown_board(head.board);
        };
        if let Err(why) = fits(&wiring.boards()[board], identity) {
            self.board = None;
            return self.bad(format!("board {}: {why}", head.board));
        }
        if !self.join(board, head.board) {
            return;
        }
        // A board that stops without a request or restart was stopped by another host, or has ended.
        let stops = identity.request == 0 && !identity.running && self.started && !order.restarted;
        if stops {
            if !std::mem::replace(&mut self.stopped, true) {
                self.config.shared.lock().accounts[board].state = BoardState::Silent;
                self.notify(&format!("board {} has stopped", head.board));
            }
            return;
        }
        self.stopped = false;
        let rate = self.config.rate_mhz.filter(|rate| *rate != identity.rate_mhz);
        if let Some(rate_mhz) = rate {
            self.ask(Command::Rate { rate_mhz }, now);
        }
        self.config.shared.lock().accounts[board].bits = Some(identity.bits.count());
        // Wipers come before frames.
        (self.starts, self.started) = (!identity.running, self.started || !identity.running);
    }

    fn unknown_board(&mut self, id: u16) {
        self.board = None;
        let ids: Vec<String> = self.config.wiring.boards().iter().map(|board| board.id.to_string()).collect();
        let known =
            if ids.len() == 1 { format!("has board {}", ids[0]) } else { format!("has boards {}", ids.join(", ")) };
        self.bad(format!("board {id} is on this line, and the wiring {known}; give --wiring a file that has it"));
    }

    /// Accepts a board that sends frames but does not answer, if its channels fit.
    pub(super) fn accept_unidentified(&mut self, head: &Head, reach: usize, partial: bool) {
        let wiring = Arc::clone(&self.config.wiring);
        let Some(board) = wiring.boards().iter().position(|board| board.id == head.board) else {
            return self.unknown_board(head.board);
        };
        let wired = wiring.boards()[board].taxels.len();
        if !partial && reach < wired {
            return self.bad(format!("board {} has {reach} channels, and the wiring {wired}", head.board));
        }
        if self.join(board, head.board) {
            let what = "sends frames but answers nothing, so its layout is not checked; does the line lead to it, too?";
            self.notify(&format!("board {} {what}", head.board));
        }
    }

    /// Assigns the board to this line. Returns false if another line has it.
    fn join(&mut self, board: usize, id: u16) -> bool {
        let LineConfig { line, port, shared, .. } = &self.config;
        let mut state = shared.lock();
        if let Some(other) = state.claim(board, *line) {
            drop(state);
            self.bad(format!("board {id} answers on line {} too; give one of them another id", other + 1));
            return false;
        }
        state.set_verdict(*line, Verdict::Good);
        let account = &mut state.accounts[board];
        account.port = Some(port.clone());
        let (was_away, was_bad) = (self.unplugged.take().is_some(), self.said.take().is_some());
        if was_away {
            // It is silent until a frame comes.
            account.state = BoardState::Silent;
        }
        if was_away && self.joined == Some((board, id)) {
            // Its clock has gone on, unless a packet says that it has restarted.
            state.notify(format!("{port}: board {id} is back"));
        } else if was_away || was_bad {
            state.notify(format!("{port}: board {id} found"));
        }
        if self.joined != Some((board, id)) {
            if let Some((other, _)) = self.joined {
                state.accounts[other].state = BoardState::Silent;
            }
            // Its count begins here, and its wipers are unknown.
            state.wipers[board].iter_mut().for_each(ChannelWiper::forget);
            (self.joined, self.lost, self.clock_restarted) = (Some((board, id)), 0, true);
        }
        drop(state);
        self.board = Some(board);
        true
    }

    /// Forwards a frame, if its board is identified.
    pub(super) fn frame(&mut self, head: &Head, frame: BoardFrame, now: Duration, read_at: Instant) {
        let Some((board, id)) = self.joined.filter(|(_, id)| *id == head.board) else {
            if self.board.is_some() {
                // Another board on this line.
                self.reset_identity(now);
            }
            return;
        };
        if self.board != Some(board) {
            // A frame that is not used counts as lost.
            self.lost += 1;
            self.config.shared.lock().accounts[board].lost += 1;
            return;
        }
        if std::mem::take(&mut self.silent) {
            self.config.shared.lock().notify(format!("{}: board {id} sends frames again", self.config.port));
        }
        (self.last_frame, self.stopped) = (now, false);
        let mut frame = frame;
        {
            let wipers = &self.config.shared.lock().wipers[board];
            frame.values.retain(|(channel, _)| !wipers.get(*channel as usize).is_some_and(|wiper| wiper.is_unknown()));
        }
        let (lost, restarted) = (std::mem::take(&mut self.lost), std::mem::take(&mut self.clock_restarted));
        self.config.shared.deliver(BoardFrame { board, lost, restarted, ..frame }, read_at);
    }
}

fn fits(wired: &WiredBoard, identity: &Identity<'_>) -> Result<(), String> {
    let (channels, taxels) = (usize::from(identity.channels), &wired.taxels);
    if channels < taxels.len() {
        return Err(format!("it has {channels} channels, and the wiring {}", taxels.len()));
    }
    if wired.bits.and_then(Bits::new).is_some_and(|bits| bits != identity.bits) {
        let (has, wants) = (identity.bits.count(), wired.bits.unwrap_or(0));
        return Err(format!("its values have {has} bits, and the wiring says {wants}"));
    }
    let padded = taxels.iter().copied().chain(std::iter::repeat(None)).take(channels);
    if identity.layout != NO_LAYOUT && identity.layout != layout_hash(padded) {
        return Err(
            "it is made for another layout than the wiring's; flash it anew, or give --wiring its file".to_owned()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_fits_its_wiring_or_the_reason_is_reported() {
        let (taxels, wipers) = (vec![Some(4), None, Some(9)], vec![None; 3]);
        let wired = WiredBoard { id: 1, bits: Some(10), port: None, baud: None, taxels, wipers };
        let hash = |taxels: &[Option<u32>]| layout_hash(taxels.iter().copied());
        let right = Identity {
            request: 1,
            running: true,
            channels: 3,
            bits: Bits::Ten,
            layout: hash(&[Some(4), None, Some(9)]),
            rate_mhz: 0,
            firmware: "",
        };
        assert_eq!(fits(&wired, &right), Ok(()));
        assert_eq!(fits(&wired, &Identity { layout: NO_LAYOUT, ..right }), Ok(()), "it does not know");
        let longer = Identity { channels: 4, layout: hash(&[Some(4), None, Some(9), None]), ..right };
        assert_eq!(fits(&wired, &longer), Ok(()), "channels that nobody wired");
        let why = |identity: Identity<'_>| fits(&wired, &identity).unwrap_err();
        assert!(why(Identity { channels: 2, ..right }).contains("2 channels, and the wiring 3"));
        assert!(why(Identity { bits: Bits::Twelve, ..right }).contains("12 bits"));
        assert!(why(Identity { channels: 4, ..right }).contains("another layout"));
    }
}
