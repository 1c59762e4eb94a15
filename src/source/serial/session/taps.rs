//! Boards' potentiometers are set as they are wanted, one after the other, and set again when a board has started again.

use std::time::Duration;

use super::Talk;
use crate::source::serial::taps::TapTrouble;
use crate::wire::{Command, Ended, Outcome, Status};

impl Talk {
    /// Asks the board for the next tap that is not as wanted, and to start once there is none.
    pub(super) fn tune(&mut self, now: Duration) {
        let Some(board) = self.board.filter(|_| self.dialogue.is_idle()) else { return };
        let due = self.task.shared.lock().due_tap(board);
        if let Some((channel, tap)) = due {
            self.ask(Command::Tap { channel, tap }, now);
        } else if std::mem::take(&mut self.starts) {
            // Its silence counts from here.
            self.last_frame = now;
            self.ask(Command::Start, now);
        }
    }

    /// What became of a tap that was asked for.
    pub(super) fn tap_ended(&mut self, ended: Ended) {
        let (Command::Tap { channel, tap }, Some((board, id))) = (ended.command, self.joined) else { return };
        let mut state = self.task.shared.lock();
        let taxel = self.task.wiring.taxel(id, channel);
        let on = taxel.map_or_else(|| format!("channel {channel}"), |taxel| format!("taxel {taxel}"));
        let Some(told) = state.taps[board].get_mut(usize::from(channel)) else { return };
        let what = match ended.outcome {
            Outcome::Done { value } if value == u32::from(tap) => return told.set = Some(tap),
            Outcome::Done { value } => {
                (told.set, told.trouble) = (u8::try_from(value).ok(), Some(TapTrouble::Refused));
                format!("set tap {value} instead of {tap} on {on}")
            }
            // What it does not know, or does not answer so often, is not asked for all other channels.
            Outcome::Refused(Status::Unknown) => {
                let left = state.give_taps_up(board, TapTrouble::Refused);
                format!("does not know `tap`; {left} of its channels stay as they are")
            }
            Outcome::Refused(_) => {
                told.trouble = Some(TapTrouble::Refused);
                format!("refuses tap {tap} on {on}")
            }
            Outcome::Unanswered => {
                let left = state.give_taps_up(board, TapTrouble::Unanswered);
                format!("does not answer `tap`; {left} of its channels stay as they are")
            }
        };
        state.say(format!("{}: board {id} {what}", self.task.port));
    }
}
