//! `somatic board`: boards made of software, each on a pseudo-terminal of its own.

mod pty;
mod station;

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use somatic::internal::board::{BoardConfig, Faults, Potentiometers, VirtualBoard};
use somatic::internal::output::OutputLink;
use somatic::internal::scene_file::hertz;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::signal::Channel;
use somatic::internal::wire::{Bits, layout_hash};
use somatic::signal::Wiring;
use somatic::source::{CsvSource, NdjsonSource, Source, SourceSpec, VendorOptions};
use somatic::{Error, Frame, Result, bundled};

use self::station::{LineSettings, Station};
use super::interrupt::stop_on_signal;
use super::stdio::{DONE, print};
use super::words;
use somatic::internal::run::{Arrival, Feed, ReadMode};

const EXAMPLES: &str = "\
Examples:
  somatic board --link /tmp/hand --loop           a hand, touched again and again, at /tmp/hand
  somatic board --wiring hand.toml --source sim:rod.toml --frames 500
  somatic board --boards 4 --for 10s --faults noise=1e-4,drop=1e-4,unplug=1s@5s

Faults, with commas between them: noise=P and drop=P, the chance of a byte; flip=P, of a bit;
drift=50ppm; silence=2s@10s, for 2 s once after 10 s; unplug=1s/20s, for 1 s every 20 s;
reset@30s.

A wiring has the board and the channel of each taxel, in TOML:

  [[board]]
  id = 1
  bits = 10
  channels = 64
  taxels = [
    { channel = 0, first = 0, count = 9 },      # taxels 0 to 8 on channels 0 to 8
    { channel = 25, ids = [25, 26] },           # one by one
  ]";

/// What a sensor that nobody touches reads.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rest {
    /// Readings rise when pressed.
    Low,
    /// Readings fall when pressed.
    High,
}

/// What boards do with commands to set a wiper.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Wipers {
    /// They set it.
    Obeyed,
    /// They do not know the command.
    Unknown,
    /// They do not answer.
    Ignored,
}

/// Play boards on pseudo-terminals, without hardware.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// What they play: csv:FILE, sim:FILE.toml, or - for NDJSON [default: a touch on the bundled hand].
    #[arg(long, value_name = "SOURCE")]
    source: Option<String>,

    /// The body whose taxels the boards have [default: the source's; of NDJSON, the bundled hand].
    #[arg(long, value_name = "BODY")]
    body: Option<String>,

    /// Begin again at the end.
    #[arg(long = "loop", conflicts_with = "frames")]
    again: bool,

    /// The board and the channel of each taxel, TOML [default: taxels in ascending order of their ids].
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["board", "boards"])]
    wiring: Option<PathBuf>,

    /// The id of the board, or of the first.
    #[arg(long, value_name = "ID", default_value_t = 1)]
    board: u16,

    /// How many boards share the taxels.
    #[arg(long, value_name = "N", default_value_t = 1)]
    boards: usize,

    /// A link to the pseudo-terminal, so that it has a steady name.
    ///
    /// Of several boards, each has PATH-ID.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,

    /// Speed of the line.
    #[arg(long, default_value_t = 57_600, value_parser = clap::value_parser!(u32).range(50..=50_000_000))]
    baud: u32,

    /// Bits of a value: 8, 10, 12 or 16 [default: the wiring's, or 10].
    #[arg(long)]
    bits: Option<u8>,

    /// Frames per second, such as 50Hz [default: each that the source has, as far as the line has room].
    ///
    /// A bare number is in Hz.
    #[arg(long, value_name = "RATE", value_parser = hertz)]
    rate: Option<f64>,

    /// Send only the channels that changed, and all once a second.
    #[arg(long)]
    partial: bool,

    /// Send nothing before the host's command to start.
    #[arg(long)]
    wait: bool,

    /// What an untouched sensor reads, which matters to the wipers.
    #[arg(long, value_enum, default_value = "low")]
    rest: Rest,

    /// What boards do with commands that set a wiper of a potentiometer.
    #[arg(long, value_enum, default_value = "obeyed")]
    wipers: Wipers,

    /// What goes wrong, such as noise=1e-4,drop=1e-4.
    ///
    /// Faults are listed below.
    #[arg(long, value_name = "FAULTS", default_value = "")]
    faults: String,

    /// Random seed of the faults.
    ///
    /// The same seed gives the same faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// End when each board has sent this many frames.
    ///
    /// The source begins again as often as that needs.
    #[arg(long, value_name = "N")]
    frames: Option<u64>,

    /// End after this time, such as 2s.
    #[arg(long = "for", value_name = "TIME")]
    lasts: Option<String>,

    /// Print where the boards are, and at the end what they sent, as JSON.
    #[arg(long)]
    json: bool,
}

/// How long a board still answers after its last frame, so that the host can read.
const LINGER: Duration = Duration::from_millis(500);
/// So long it waits for a plug that is pulled just then.
const UNPLUG_TIMEOUT: Duration = Duration::from_secs(5);
/// So often it says meanwhile that it has.
const FINAL_REPORT_INTERVAL: Duration = Duration::from_millis(50);
/// A byte at 57600 baud takes 0.17 ms; the other side sees some at once, as from any USB adapter.
const TIME_STEP: Duration = Duration::from_millis(2);

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let (mut stations, common, play) = open(arguments)?;
    let lasts = arguments.lasts.as_deref().map(words::seconds).transpose()?;
    let stop = stop_on_signal()?;
    let start = Instant::now();
    for station in &mut stations {
        station.plug_in()?;
    }
    tell_where(arguments, &stations)?;

    let mut feed = None;
    let (mut row, mut before, mut readings) = (0, Duration::ZERO, vec![None; play.taxels.len()]);
    let (mut ending, mut report_at, mut pulled_at): (Option<Duration>, _, _) = (None, Duration::ZERO, Duration::ZERO);
    while !stop.load(Ordering::Relaxed) {
        let now = start.elapsed();
        if ending.is_none() {
            let running = stations.iter().any(|station| station.board.is_running());
            if feed.is_none() && running {
                feed = Some(play.start()?);
            }
            match feed.as_mut().and_then(|feed| feed.next(Duration::ZERO)) {
                Some(Arrival::Frames(frames, _)) => {
                    row += 1;
                    frames.iter().for_each(|frame| play.read(frame, &mut readings));
                }
                Some(Arrival::End(_)) if play.again => feed = None,
                Some(Arrival::End(_)) => ending = Some(now),
                Some(Arrival::Failed(error)) => return Err(error),
                None | Some(Arrival::Woken) => {}
            }
        }
        for station in &mut stations {
            station.go_on(now, now.saturating_sub(before), &common, row, &readings)?;
        }
        before = now;
        let over = stations.iter_mut().all(|station| station.is_done(&common)) || lasts.is_some_and(|most| now >= most);
        if over && ending.is_none() {
            ending = Some(now);
        }
        if stations.iter().any(|station| station.plug.is_none()) {
            pulled_at = now;
        }
        // A board whose plug is pulled has yet to say how many frames there were.
        if let Some(since) = ending
            && now >= since.max(pulled_at.min(since + UNPLUG_TIMEOUT)) + LINGER
        {
            break;
        }
        if ending.is_some() && now >= report_at {
            // Who listens learns how many frames there were; more than once, as its line may be bad.
            stations.iter_mut().for_each(|station| station.board.finish(now));
            report_at = now + FINAL_REPORT_INTERVAL;
        }
        pty::wait(stations.iter().filter_map(|station| station.plug.as_ref()), TIME_STEP);
    }
    tell_what(arguments, &stations, start.elapsed())
}

/// The source that boards play.
struct Play {
    spec: Option<SourceSpec>,
    ids: Vec<u32>,
    taxels: Vec<u32>,
    most: f64,
    again: bool,
}

impl Play {
    fn open(spec: Option<&SourceSpec>, ids: &[u32]) -> Result<Box<dyn Source + Send>> {
        match spec {
            // Lines of unknown taxels are errors: a board has no way to report them.
            Some(SourceSpec::Stdin) => Ok(Box::new(NdjsonSource::stdin(ids.to_vec()).strict())),
            Some(spec) => spec.open(ids, &VendorOptions::default()),
            None => Ok(Box::new(CsvSource::from_reader("bundled touch", bundled::TOUCH, None, None)?)),
        }
    }

    fn start(&self) -> Result<Feed> {
        let speed = (self.spec != Some(SourceSpec::Stdin)).then_some(1.0);
        Ok(Feed::start(Self::open(self.spec.as_ref(), &self.ids)?, ReadMode { most: 1, gather: false, speed }))
    }

    /// Whole counts within the bits of a value. What is missing or no number is not a reading.
    fn read(&self, frame: &Frame, readings: &mut [Option<u16>]) {
        for (reading, value) in readings.iter_mut().zip(&frame.values) {
            *reading = value.number().map(|value| value.round().clamp(0.0, self.most) as u16);
        }
    }
}

fn open(arguments: &Arguments) -> Result<(Vec<Station>, LineSettings, Play)> {
    let faults: Faults = arguments.faults.parse()?;
    let spec = arguments.source.as_deref().map(str::parse::<SourceSpec>).transpose()?;
    let again = arguments.again || arguments.frames.is_some();
    let live = spec == Some(SourceSpec::Stdin);
    if live && arguments.again {
        return Err(Error::usage("standard input cannot be read twice; leave out --loop"));
    }
    if spec == Some(SourceSpec::CsvStdin) {
        return Err(Error::usage("boards play CSV from files; name one as --source csv:FILE"));
    }
    let wiring = arguments.wiring.as_ref().map(Wiring::load).transpose()?;
    let body = arguments.body.as_deref().or(live.then_some("hand")).map(load_body).transpose()?;
    let ids: Vec<u32> = body.iter().flat_map(Channel::all_of).collect();
    if let (Some(body), None) = (&body, &spec)
        && arguments.body.as_deref() != Some("hand")
    {
        let boards = match Wiring::least_boards(ids.len()) {
            0 | 1 => String::new(),
            least if wiring.is_some() || arguments.boards >= least => String::new(),
            least => format!(" --boards {least}"),
        };
        return Err(Error::usage(format!(
            "the bundled touch is for the bundled hand; name what boards on body `{}` play: somatic board --body {}{boards} \
             --source sim:FILE.toml",
            body.name, body.name
        )));
    }
    let taxels = Play::open(spec.as_ref(), &ids)?.taxels().to_vec();
    if let Some(body) = &body
        && let Some(id) = taxels.iter().find(|id| !ids.contains(id))
    {
        let id = Channel(*id);
        let what = format!("the source has taxel {id}, and the body has none of that number; is it for another body?");
        return Err(Error::failed(what).at(&body.name));
    }
    let wiring = match wiring {
        Some(wiring) => wiring,
        None => in_order(if body.is_some() { &ids } else { &taxels }, arguments)?,
    };
    let rate_mhz = rate_mhz(arguments)?;
    let read = FilesRead::default().named(arguments.source.as_slice()).files(&arguments.wiring).bodies(&arguments.body);
    let mut outputs = read.outputs(false);
    let mut stations = Vec::new();
    let mut most = 0;
    for wired in wiring.boards() {
        let count = arguments.bits.or(wired.bits).unwrap_or(10);
        let bits = Bits::new(count)
            .ok_or_else(|| Error::usage(format!("--bits {count} is not possible; give 8, 10, 12 or 16")))?;
        most = most.max(bits.max());
        let place = |taxel: &Option<u32>| taxels.iter().position(|id| Some(id) == taxel.as_ref());
        let make = BoardConfig {
            board: wired.id,
            channels: wired.taxels.len() as u16,
            bits,
            layout: layout_hash(wired.taxels.iter().copied()),
            rate_mhz,
            running: !arguments.wait,
            partial: arguments.partial,
            falls: arguments.rest == Rest::High,
            potentiometers: match arguments.wipers {
                Wipers::Obeyed => Potentiometers::Obeyed,
                Wipers::Unknown => Potentiometers::Unknown,
                Wipers::Ignored => Potentiometers::Ignored,
            },
            drift: faults.drift,
        };
        let link = arguments.link.as_ref().map(|link| match wiring.boards() {
            [_] => link.clone(),
            _ => PathBuf::from(format!("{}-{}", link.display(), wired.id)),
        });
        let link = link.map(|link| outputs.add_link(link)).transpose()?;
        let places = wired.taxels.iter().map(place).collect();
        stations.push(Station::new(wired.id, VirtualBoard::new(make, Duration::ZERO), places, link, arguments.seed));
    }
    let common = LineSettings { baud: arguments.baud, faults, frames: arguments.frames.unwrap_or(u64::MAX) };
    Ok((stations, common, Play { spec, ids, taxels, most: most.into(), again: again && !live }))
}

/// The rate that is asked for, mHz; 0 where it is left to the boards.
fn rate_mhz(arguments: &Arguments) -> Result<u32> {
    match arguments.rate {
        None => Ok(0),
        Some(hz) if (0.001..=1e6).contains(&hz) => Ok((hz * 1e3).round() as u32),
        Some(hz) => Err(Error::usage(format!("--rate {hz} is not a rate; give 0.001 to 1000000 Hz"))),
    }
}

/// The wiring of `taxels` to as many boards as `arguments` say.
fn in_order(taxels: &[u32], arguments: &Arguments) -> Result<Wiring> {
    let least = Wiring::least_boards(taxels.len());
    if arguments.boards > 0 && arguments.boards < least {
        return Err(Error::usage(format!(
            "{} taxels need at least {least} boards of 256 channels; add --boards {least}",
            taxels.len()
        )));
    }
    Wiring::in_order(taxels, arguments.board, arguments.boards)
}

fn tell_where(arguments: &Arguments, stations: &[Station]) -> Result<()> {
    let about = |station: &Station| {
        json!({"board": station.id, "port": station.port(), "link": station.link.as_ref().map(OutputLink::path), "baud": arguments.baud,
            "channels": station.places.len()})
    };
    if arguments.json {
        let boards: Vec<Value> = stations.iter().map(about).collect();
        return print(&format!("{}\n", json!({"playing": boards})));
    }
    let line = |station: &Station| {
        let link = station.link.as_ref().map(|link| format!(" ({})", link.path().display())).unwrap_or_default();
        let channels = words::count(station.places.len() as u64, "channel");
        format!("board {} at {}{link}: {channels}, {} baud\n", station.id, station.port(), arguments.baud)
    };
    print(&stations.iter().map(line).collect::<String>())
}

fn tell_what(arguments: &Arguments, stations: &[Station], time: Duration) -> Result<u8> {
    let accounts: Vec<Value> = stations.iter().map(Station::account).collect();
    if arguments.json {
        print(&format!("{}\n", json!({"seconds": time.as_secs_f64(), "sent": accounts})))?;
        return Ok(DONE);
    }
    let mut text = String::new();
    for account in &accounts {
        let number = |key: &str| account[key].as_u64().unwrap_or(0);
        let (frames, bytes) = (words::count(number("frames"), "frame"), words::count(number("bytes"), "byte"));
        text += &format!("board {}: {frames}, {bytes} sent", number("board"));
        let happened = account["faults"].as_object().into_iter().flatten();
        for (name, count) in happened.filter(|(_, count)| count.as_u64() > Some(0)) {
            text += &format!(", {count} {}", name.replace('_', " "));
        }
        text += "\n";
    }
    print(&text)?;
    Ok(DONE)
}
