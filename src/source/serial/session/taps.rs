//! Sets the boards' potentiometers one after the other, and again after a restart.

use std::time::Duration;

use super::LineState;
use crate::source::boards::TapTrouble;
use crate::wire::{Command, Ended, Outcome, Status};

impl LineState {
    /// Requests the next tap that is not set, and starts the board once all are.
    pub(super) fn set_taps(&mut self, now: Duration) {
        let Some(board) = self.board.filter(|_| self.dialogue.is_idle()) else { return };
        let due = self.config.shared.lock().next_tap(board);
        if let Some((channel, tap)) = due {
            self.ask(Command::Tap { channel, tap }, now);
        } else if std::mem::take(&mut self.starts) {
            // Silence counts from here.
            self.last_frame = now;
            self.ask(Command::Start, now);
        }
    }

    pub(super) fn tap_ended(&mut self, ended: Ended) {
        let (Command::Tap { channel, tap }, Some((board, id))) = (ended.command, self.joined) else { return };
        let mut state = self.config.shared.lock();
        let taxel = self.config.wiring.taxel(id, channel);
        let on = taxel.map_or_else(|| format!("channel {channel}"), |taxel| format!("taxel {taxel}"));
        let Some(channel_tap) = state.taps[board].get_mut(usize::from(channel)) else { return };
        let what = match ended.outcome {
            Outcome::Done { value } if value == u32::from(tap) => return channel_tap.set = Some(tap),
            Outcome::Done { value } => {
                (channel_tap.set, channel_tap.trouble) = (u8::try_from(value).ok(), Some(TapTrouble::Refused));
                format!("set tap {value} instead of {tap} on {on}")
            }
            // The other channels of this board are not tried.
            Outcome::Refused(Status::Unknown) => {
                let left = state.abandon_taps(board, TapTrouble::Refused);
                format!("does not know `tap`; {left} of its channels stay as they are")
            }
            Outcome::Refused(_) => {
                channel_tap.trouble = Some(TapTrouble::Refused);
                format!("refuses tap {tap} on {on}")
            }
            Outcome::Unanswered => {
                let left = state.abandon_taps(board, TapTrouble::Unanswered);
                format!("does not answer `tap`; {left} of its channels stay as they are")
            }
        };
        state.notify(format!("{}: board {id} {what}", self.config.port));
    }
}
