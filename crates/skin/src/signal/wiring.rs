//! Wiring: the taxel on each channel of each board of one robot; `docs/reference/wire.md` has the file's keys.

mod to_toml;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::channel::{Axis, Channel};
use crate::body::MAX_TAXEL_ID;
use crate::error::{Error, Result};
use crate::keys::Text;
use crate::limits::{self, MAX_TOML_BYTES};

const MAX_CHANNELS: i64 = 256;

/// The boards of a robot and their taxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    boards: Vec<WiredBoard>,
}

/// A board and its taxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WiredBoard {
    /// Its id, 0 to 65534.
    pub id: u16,
    /// Bits of a value (8, 10, 12 or 16), if given.
    pub bits: Option<u8>,
    /// The port it is expected on, if given.
    pub port: Option<String>,
    /// The baud rate of its line, if given.
    pub baud: Option<u32>,
    /// Per channel the taxel's id, of one with three axes the number of a [`Channel`]; `None` for an unused channel.
    pub taxels: Vec<Option<u32>>,
    /// Per channel the wiper to set on its potentiometer, if given.
    pub wipers: Vec<Option<u8>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    board: Vec<BoardKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardKeys {
    id: Spanned<i64>,
    bits: Option<Spanned<i64>>,
    port: Option<String>,
    baud: Option<Spanned<i64>>,
    channels: Option<Spanned<i64>>,
    taxels: Vec<Spanned<RunKeys>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunKeys {
    channel: Spanned<i64>,
    first: Option<Spanned<i64>>,
    count: Option<Spanned<i64>>,
    ids: Option<Vec<Spanned<Id>>>,
    axes: Option<Spanned<i64>>,
    wipers: Option<Spanned<Vec<Spanned<i64>>>>,
}

/// An id, or the name of a channel such as `"4.u"`.
#[derive(Deserialize)]
#[serde(untagged)]
enum Id {
    Number(u32),
    Name(String),
}

impl Wiring {
    /// Reads the wiring in the TOML file at `path`.
    ///
    /// # Errors
    /// The file cannot be read, or something in it makes no sense; the message has the line and the key.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        Self::from_text(&text).map_err(|e| e.at(path.display()))
    }

    /// The wiring in `text`.
    ///
    /// # Errors
    /// As [`Wiring::load`].
    pub fn from_text(text: &str) -> Result<Self> {
        let text = Text(text);
        let file: File = text.parse()?;
        let (mut boards, mut ids) = (Vec::new(), BTreeSet::new());
        let mut channel_of: BTreeMap<u32, (u16, usize)> = BTreeMap::new();
        for keys in &file.board {
            let board = keys.read(text)?;
            if !ids.insert(board.id) {
                return Err(text.wrong(keys.id.span(), format!("two boards have the id {}", board.id)));
            }
            for (channel, taxel) in board.taxels.iter().enumerate().filter_map(|(c, taxel)| Some((c, (*taxel)?))) {
                if let Some((id, before)) = channel_of.insert(taxel, (board.id, channel)) {
                    let what = format!(
                        "taxel {} is on channel {channel} of board {} and on channel {before} of board {id}",
                        Channel(taxel),
                        board.id
                    );
                    return Err(text.wrong(keys.id.span(), what));
                }
            }
            boards.push(board);
        }
        if boards.is_empty() {
            return Err(Error::failed("there is no board; give at least one [[board]]"));
        }
        Ok(Self { boards })
    }

    /// The minimum number of boards for `taxels` taxels.
    #[must_use]
    pub fn least_boards(taxels: usize) -> usize {
        taxels.div_ceil(MAX_CHANNELS as usize)
    }

    /// The default wiring: `boards` boards, numbered from `first_id`, share `taxels` evenly in ascending order of their ids; the values of
    /// a taxel with three axes are side by side.
    ///
    /// # Errors
    /// There are fewer taxels than boards, or a board would have more than 256 channels or an id over 65534.
    pub fn in_order(taxels: &[u32], first_id: u16, boards: usize) -> Result<Self> {
        let mut sorted = taxels.to_vec();
        Channel::side_by_side(&mut sorted);
        if boards == 0 || sorted.len() < boards {
            let what = format!("{} taxels cannot be shared by {boards} boards", sorted.len());
            return Err(Error::usage(what));
        }
        let least = Self::least_boards(sorted.len());
        if boards < least {
            let what = format!(
                "{} taxels need at least {least} boards of 256 channels; give as many ports, or a wiring",
                sorted.len()
            );
            return Err(Error::usage(what));
        }
        if usize::from(first_id) + boards > usize::from(u16::MAX) {
            return Err(Error::usage("a board's id is 65534 at most"));
        }
        let mut rest = &sorted[..];
        let take = |index: usize| {
            let (own, after) = rest.split_at(rest.len().div_ceil(boards - index));
            rest = after;
            let taxels = own.iter().copied().map(Some).collect();
            let wipers = vec![None; own.len()];
            WiredBoard { id: first_id + index as u16, bits: None, port: None, baud: None, taxels, wipers }
        };
        Ok(Self { boards: (0..boards).map(take).collect() })
    }

    /// The boards, in the order of the file.
    #[must_use]
    pub fn boards(&self) -> &[WiredBoard] {
        &self.boards
    }

    /// The board whose id is `id`.
    #[must_use]
    pub fn board(&self, id: u16) -> Option<&WiredBoard> {
        self.boards.iter().find(|board| board.id == id)
    }

    /// The same wiring with the wipers that `wiper` gives for a board's id and a channel with a taxel.
    #[must_use]
    pub fn with_wipers(&self, wiper: impl Fn(u16, u16) -> Option<u8>) -> Self {
        let mut wiring = self.clone();
        for board in &mut wiring.boards {
            let wired = (0..).zip(&board.taxels);
            board.wipers = wired.map(|(channel, taxel)| taxel.and_then(|_| wiper(board.id, channel))).collect();
        }
        wiring
    }

    /// The taxel on a board's channel.
    #[must_use]
    pub fn taxel(&self, board: u16, channel: u16) -> Option<u32> {
        self.board(board)?.taxels.get(usize::from(channel)).copied().flatten()
    }
}

impl BoardKeys {
    fn read(&self, text: Text<'_>) -> Result<WiredBoard> {
        let int = |key, value: Option<&Spanned<i64>>, range| text.int(key, value, range);
        let id = int("id", Some(&self.id), 0..65535)?.unwrap_or(0) as u16;
        let bits = int("bits", self.bits.as_ref(), 8..17)?.map(|bits| bits as u8);
        if let (Some(key), Some(bits)) = (&self.bits, bits.filter(|bits| ![8, 10, 12, 16].contains(bits))) {
            return Err(text.wrong(key.span(), format!("`bits` is {bits}; it must be 8, 10, 12 or 16")));
        }
        let baud = int("baud", self.baud.as_ref(), 1..1_000_000_000)?;
        let channels = int("channels", self.channels.as_ref(), 1..MAX_CHANNELS + 1)?.map(|count| count as usize);
        let mut taxels = vec![None; channels.unwrap_or(0)];
        let mut wipers = taxels.iter().map(|_| None).collect::<Vec<Option<u8>>>();
        for keys in &self.taxels {
            let run = keys.get_ref();
            let channel = int("channel", Some(&run.channel), 0..MAX_CHANNELS)?.unwrap_or(0) as usize;
            let ids = run.channels(keys.span(), text)?;
            let end = channel + ids.len();
            let most = channels.unwrap_or(MAX_CHANNELS as usize);
            if end > most {
                let what = format!("this reaches channel {}, and the board has {most} channels", end - 1);
                return Err(text.wrong(keys.span(), what));
            }
            taxels.resize(taxels.len().max(end), None);
            wipers.resize(taxels.len(), None);
            if let Some(given) = &run.wipers {
                if given.get_ref().len() != ids.len() {
                    let what = format!("{} `wipers` are given for {} channels", given.get_ref().len(), ids.len());
                    return Err(text.wrong(given.span(), what));
                }
                for (channel, wiper) in (channel..).zip(given.get_ref()) {
                    wipers[channel] = int("wipers", Some(wiper), 0..256)?.map(|wiper| wiper as u8);
                }
            }
            for (channel, id) in (channel..).zip(ids) {
                if taxels[channel].replace(id).is_some() {
                    return Err(text.wrong(keys.span(), format!("channel {channel} has a taxel already")));
                }
            }
        }
        if taxels.iter().all(Option::is_none) {
            return Err(text.wrong(self.id.span(), format!("board {id} has no taxels; give `taxels`")));
        }
        Ok(WiredBoard { id, bits, port: self.port.clone(), baud, taxels, wipers })
    }
}

impl RunKeys {
    /// What its channels are of; `at` is where it stands in `text`.
    fn channels(&self, at: Range<usize>, text: Text<'_>) -> Result<Vec<u32>> {
        let first = text.int("first", self.first.as_ref(), 0..i64::from(u32::MAX))?;
        let ids: Vec<u32> = match (&self.ids, first) {
            (Some(ids), None) => {
                text.refuse("count", self.count.as_ref(), "with `ids`")?;
                ids.iter().map(|id| channel(id, text)).collect::<Result<_>>()?
            }
            (None, Some(first)) => {
                let count = text.int("count", self.count.as_ref(), 1..MAX_CHANNELS + 1)?.unwrap_or(1);
                (0..count).map(|index| first.saturating_add(index)).collect()
            }
            _ => return Err(text.wrong(at, "give either `ids` or `first` with `count`")),
        };
        let Some(axes) = &self.axes else { return Ok(ids) };
        if *axes.get_ref() != 3 || ids.iter().any(|&id| id > MAX_TAXEL_ID) {
            return Err(text.wrong(axes.span(), "`axes` is 3, for taxels with three axes; leave it out for others"));
        }
        let all = |id: u32| [Axis::Normal, Axis::U, Axis::V].map(|axis| Channel::of_taxel(id, axis).0);
        Ok(ids.into_iter().flat_map(all).collect())
    }
}

/// The channel that `id` is.
fn channel(id: &Spanned<Id>, text: Text<'_>) -> Result<u32> {
    match id.get_ref() {
        Id::Number(number) => Ok(*number),
        Id::Name(name) => Channel::named(name).map(|channel| channel.0).ok_or_else(|| {
            let what =
                format!("`ids` has `{name}`; write an id as 4, and of one with three axes also \"4.u\" and \"4.v\"");
            text.wrong(id.span(), what)
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of the repository's examples.
    fn example(name: &str) -> Wiring {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/wirings");
        Wiring::from_text(&std::fs::read_to_string(format!("{folder}/{name}.toml")).unwrap()).unwrap()
    }

    #[test]
    fn the_hands_wiring_is_the_papers() {
        let hand = example("hand");
        assert_eq!(hand.boards().len(), 1);
        assert_eq!(hand.boards()[0].taxels.len(), 64);
        let wired = |channel| hand.taxel(1, channel);
        assert_eq!(
            [0, 8, 9, 15, 16, 25, 26, 27, 31, 32, 51, 52, 64].map(wired).map(|taxel| taxel.is_some()),
            [true, true, false, false, true, true, true, false, false, true, true, false, false]
        );
        // The bundled hand's ids are its channels.
        assert!((0..64).filter_map(|c| Some((c, wired(c)?))).all(|(c, taxel)| u32::from(c) == taxel));
        assert_eq!(hand.boards()[0].taxels.iter().flatten().count(), 40);
        let counts = |wiring: &Wiring| -> Vec<usize> {
            wiring.boards().iter().map(|board| board.taxels.iter().flatten().count()).collect()
        };
        assert_eq!(counts(&example("hand-boards")), [9, 9, 2, 20]);
    }

    #[test]
    fn without_a_file_boards_share_the_taxels_in_order() {
        let wiring = Wiring::in_order(&[9, 3, 5, 4, 7], 10, 2).unwrap();
        assert_eq!((wiring.taxel(10, 0), wiring.taxel(10, 2), wiring.taxel(11, 0)), (Some(3), Some(5), Some(7)));
        assert_eq!((wiring.taxel(11, 1), wiring.taxel(11, 2), wiring.taxel(12, 0)), (Some(9), None, None));
        assert!(Wiring::in_order(&[1], 0, 2).unwrap_err().is_usage());
        let many: Vec<u32> = (0..600).collect();
        assert!(Wiring::in_order(&many, 0, 2).unwrap_err().to_string().contains("at least 3 boards"));
        assert!(Wiring::in_order(&many, 65534, 3).is_err());
    }

    #[test]
    fn taxels_with_three_axes_have_three_channels() {
        let names = |wiring: &Wiring, board: usize| -> Vec<String> {
            wiring.boards()[board].taxels.iter().flatten().map(|&id| Channel(id).to_string()).collect()
        };
        let text = "[[board]]\nid = 1\ntaxels = [{ channel = 0, ids = [9, \"4.v\", \"4.u\"] }, { channel = 3, first = 6, count = 2, axes = 3 }]";
        let wiring = Wiring::from_text(text).unwrap();
        assert_eq!(names(&wiring, 0), ["9", "4.v", "4.u", "6", "6.u", "6.v", "7", "7.u", "7.v"]);
        let ids: Vec<u32> = wiring.boards()[0].taxels.iter().flatten().copied().collect();
        let shared = Wiring::in_order(&ids, 1, 2).unwrap();
        assert_eq!(names(&shared, 0), ["4.u", "4.v", "6", "6.u", "6.v"]);
        assert_eq!(names(&shared, 1), ["7", "7.u", "7.v", "9"]);
        let why =
            |run: &str| Wiring::from_text(&format!("[[board]]\nid = 1\ntaxels = [{run}]")).unwrap_err().to_string();
        assert!(why("{ channel = 0, ids = [\"4.w\"] }").contains("`ids` has `4.w`"));
        assert!(why("{ channel = 0, first = 1, axes = 2 }").contains("`axes` is 3"));
        assert!(why("{ channel = 0, ids = [\"4.u\"], axes = 3 }").contains("`axes` is 3"));
        assert!(why("{ channel = 0, ids = [\"4.u\", \"4.u\"] }").contains("taxel 4.u is on channel 1"));
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_line() {
        let why = |text: &str| crate::keys::without_column(&Wiring::from_text(text).unwrap_err().to_string());
        let board = |rest: &str| format!("[[board]]\nid = 1\n{rest}\n");
        let run = |run: &str| board(&format!("taxels = [{run}]"));
        assert!(
            why(&run("{ channel = 0, first = 1 }, { channel = 0, first = 2 }")).starts_with("line 3: channel 0 has")
        );
        assert!(why(&run("{ channel = 0 }")).contains("either `ids`"));
        assert!(why(&run("{ channel = 0, first = 1, ids = [2] }")).contains("either `ids`"));
        assert!(why(&run("{ channel = 0, count = 2, ids = [2] }")).contains("with `ids`"));
        assert!(why(&run("{ channel = 250, first = 0, count = 9 }")).contains("channel 258"));
        assert!(why(&run("{ channel = 0, ids = [5] }, { channel = 1, ids = [5] }")).contains("taxel 5 is on channel"));
        assert!(why(&board("bits = 9\ntaxels = [{ channel = 0, first = 0 }]")).contains("8, 10, 12 or 16"));
        assert!(
            why(&run("{ channel = 0, first = 1, count = 2, wipers = [3] }")).contains("1 `wipers` are given for 2")
        );
        assert!(why(&run("{ channel = 0, first = 1, wipers = [256] }")).contains("between 0 and 255"));
        assert!(why(&board("chanels = 3\ntaxels = []")).contains("did you mean `channels`"));
        assert!(why(&board("taxels = []")).contains("has no taxels"));
        assert!(why(&run("{ channel = 0, first = 1 }").repeat(2)).contains("two boards"));
        assert!(why("").contains("board"));
    }
}
