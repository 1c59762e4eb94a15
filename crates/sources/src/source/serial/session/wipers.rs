//! Sets the boards' potentiometers one after the other, and again after a restart.

use std::time::Duration;

use super::LineState;
use crate::signal::Channel;
use crate::source::boards::WiperTrouble;
use crate::wire::{Command, Ended, Outcome, Status};

impl LineState {
    /// Requests the next wiper that is not set, and starts the board once all are.
    pub(super) fn set_wipers(&mut self, now: Duration) {
        let Some(board) = self.board.filter(|_| self.dialogue.is_idle()) else { return };
        let due = self.config.shared.lock().next_wiper(board);
        if let Some((channel, wiper)) = due {
            self.ask(Command::Wiper { channel, wiper }, now);
        } else if std::mem::take(&mut self.starts) {
            // Silence counts from here.
            self.last_frame = now;
            self.ask(Command::Start, now);
        }
    }

    pub(super) fn wiper_ended(&mut self, ended: Ended) {
        let (Command::Wiper { channel, wiper }, Some((board, id))) = (ended.command, self.joined) else { return };
        let mut state = self.config.shared.lock();
        let taxel = self.config.wiring.taxel(id, channel);
        let on = taxel.map_or_else(|| format!("channel {channel}"), |taxel| format!("taxel {}", Channel(taxel)));
        let Some(channel_wiper) = state.wipers[board].get_mut(usize::from(channel)) else { return };
        let what = match ended.outcome {
            Outcome::Done { value } if value == u32::from(wiper) => return channel_wiper.set = Some(wiper),
            Outcome::Done { value } => {
                (channel_wiper.set, channel_wiper.trouble) = (u8::try_from(value).ok(), Some(WiperTrouble::Refused));
                format!("set wiper {value} instead of {wiper} on {on}")
            }
            // The other channels of this board are not tried.
            Outcome::Refused(Status::Unknown) => {
                let left = state.abandon_wipers(board, WiperTrouble::Refused);
                format!("does not know `wiper`; {left} of its channels stay as they are")
            }
            Outcome::Refused(_) => {
                channel_wiper.trouble = Some(WiperTrouble::Refused);
                format!("refuses wiper {wiper} on {on}")
            }
            Outcome::Unanswered => {
                let left = state.abandon_wipers(board, WiperTrouble::Unanswered);
                format!("does not answer `wiper`; {left} of its channels stay as they are")
            }
        };
        state.notify(format!("{}: board {id} {what}", self.config.port));
    }
}
