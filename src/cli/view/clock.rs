//! The clock that a recording is played by, or two side by side.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// What one of the players has of it. Times are in s since the beginning of each one's recording: both begin together.
#[derive(Clone)]
pub(super) struct Clock {
    state: Arc<Mutex<State>>,
    /// Which of the players this is.
    player: usize,
}

/// What a clock says.
#[derive(Clone, Copy)]
pub(super) struct State {
    pub(super) playing: bool,
    pub(super) speed: f64,
    /// A moment, and the time that is due then.
    due: (Instant, f64),
    /// Counts what was asked of it.
    pub(super) changes: u64,
    /// Counts the jumps among these.
    pub(super) jumps: u64,
    /// Whether it begins to play with the first viewer.
    waits: bool,
    /// Whether it begins again at the end.
    loops: bool,
    /// By player, whether there is one that is not at its end.
    goes_on: [bool; 2],
    /// How many there are.
    players: usize,
}

impl State {
    /// The time that is due now, s.
    pub(super) fn now_s(&self) -> f64 {
        let (since, due_s) = self.due;
        if self.playing { due_s + since.elapsed().as_secs_f64() * self.speed } else { due_s }
    }

    /// Whether all recordings are at their ends.
    pub(super) fn is_at_end(&self) -> bool {
        self.goes_on == [false; 2]
    }

    /// Goes to `at_s` and goes on from there.
    fn set(&mut self, at_s: f64) {
        self.due = (Instant::now(), at_s);
    }
}

impl Clock {
    /// Clocks of `players`, one or two, at `speed` times the recorded speed; they begin again at the end if `loops`.
    pub(super) fn new(players: usize, speed: f64, loops: bool) -> Vec<Self> {
        let state = State {
            playing: false,
            speed,
            due: (Instant::now(), 0.0),
            changes: 0,
            jumps: 0,
            waits: true,
            loops,
            goes_on: [true, players > 1],
            players,
        };
        let state = Arc::new(Mutex::new(state));
        (0..players).map(|player| Self { state: Arc::clone(&state), player }).collect()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn state(&self) -> State {
        *self.lock()
    }

    /// Plays with the first viewer. Whether this is the first.
    pub(super) fn joined(&self) -> bool {
        let mut state = self.lock();
        let is_first = std::mem::take(&mut state.waits);
        if is_first {
            state.set(0.0);
            state.playing = true;
            state.changes += 1;
        }
        is_first
    }

    /// Plays from `at_s` on.
    pub(super) fn play(&self, at_s: f64) {
        self.change(|state| {
            state.set(at_s);
            state.playing = true;
        });
    }

    /// Stops at `at_s`, which the other player then shows, too. Gives the number of this jump.
    pub(super) fn pause(&self, at_s: f64) -> u64 {
        self.change(|state| {
            state.set(at_s);
            state.jumps += 1;
            state.playing = false;
        })
    }

    /// Goes to `at_s`. Gives the number of this jump.
    pub(super) fn seek(&self, at_s: f64) -> u64 {
        self.change(|state| {
            state.set(at_s);
            state.jumps += 1;
            // Each says anew whether it is there.
            state.goes_on = [true, state.players > 1];
        })
    }

    /// Goes on at another speed from `at_s`.
    pub(super) fn speed(&self, speed: f64, at_s: f64) {
        self.change(|state| {
            state.set(at_s);
            state.speed = speed;
        });
    }

    fn change(&self, change: impl FnOnce(&mut State)) -> u64 {
        let mut state = self.lock();
        change(&mut state);
        state.changes += 1;
        state.jumps
    }

    /// Waits for this player, which has come to `at_s` only now.
    pub(super) fn is_late(&self, at_s: f64) {
        self.lock().set(at_s);
    }

    /// Says whether this player is at its end, after as many `jumps` as it knows of. The clock stops, or begins again, where
    /// all are.
    pub(super) fn at_end(&self, is_at_end: bool, jumps: u64) {
        let mut state = self.lock();
        if jumps != state.jumps {
            return;
        }
        let was = std::mem::replace(&mut state.goes_on[self.player], !is_at_end);
        if is_at_end && was {
            state.changes += 1;
        }
        if state.playing && state.is_at_end() {
            let now_s = state.now_s();
            state.changes += 1;
            if state.loops {
                state.set(0.0);
                state.jumps += 1;
            } else {
                state.set(now_s);
                state.playing = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_stops_where_the_longer_one_ends() {
        let clocks = Clock::new(2, 1.0, false);
        assert!(clocks[0].joined() && !clocks[1].joined());
        clocks[0].at_end(true, 0);
        assert!(clocks[1].state().playing, "the other one goes on");
        clocks[1].at_end(true, 0);
        assert!(!clocks[0].state().playing && clocks[0].state().is_at_end());
        // After a jump back it is not at its end any more.
        assert_eq!(clocks[1].seek(0.5), 1);
        assert_eq!(clocks[0].state().now_s(), 0.5);
        clocks[0].play(0.5);
        // The other one has not heard of the jump.
        clocks[1].at_end(true, 1);
        clocks[0].at_end(true, 0);
        assert!(clocks[0].state().playing && !clocks[0].state().is_at_end());
    }

    #[test]
    fn one_alone_stops_or_begins_again() {
        for loops in [false, true] {
            let clocks = Clock::new(1, 1.0, loops);
            assert!(clocks[0].joined());
            clocks[0].at_end(true, 0);
            assert_eq!((clocks[0].state().playing, clocks[0].state().jumps), (loops, u64::from(loops)));
        }
    }

    #[test]
    fn time_goes_on_at_its_speed_only_while_it_plays() {
        let clock = Clock::new(1, 1000.0, false).remove(0);
        assert_eq!(clock.state().now_s(), 0.0);
        clock.play(2.0);
        std::thread::sleep(std::time::Duration::from_millis(5));
        let now_s = clock.state().now_s();
        assert!(now_s >= 7.0, "{now_s}");
        clock.pause(now_s);
        assert_eq!(clock.state().now_s(), now_s);
    }
}
