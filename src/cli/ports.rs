//! Serial lines as sources: the flags that commands have for them.

use std::path::PathBuf;

use clap::Args;
use somatic::internal::scene_file::hertz;
use somatic::scene::file::LineKeys;

/// How boards on serial lines are read.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct LineFlags {
    /// The board and the channel of each taxel, a TOML file [default: taxels in ascending order of their ids].
    ///
    /// By default the boards, one per port, share the taxels. `somatic board --help` shows such a file.
    #[arg(long, value_name = "FILE")]
    pub(super) wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, such as 100Hz [default: one for each frame of the fastest board].
    ///
    /// With 0 there is one for each frame of any board. A bare number is in Hz.
    #[arg(long, value_name = "RATE", value_parser = hertz)]
    pub(super) live_rate: Option<f64>,

    /// Make the boards send frames at this rate, such as 100Hz [default: leave them as they are].
    ///
    /// With 0 they send as fast as the line allows. A bare number is in Hz.
    #[arg(long, value_name = "RATE", value_parser = hertz)]
    pub(super) board_rate: Option<f64>,
}

impl LineFlags {
    /// What a scene would say of them.
    pub(super) fn keys(&self) -> LineKeys {
        let mut keys = LineKeys::default();
        keys.wiring.clone_from(&self.wiring);
        (keys.live_rate_hz, keys.board_rate_hz) = (self.live_rate, self.board_rate);
        keys
    }
}
