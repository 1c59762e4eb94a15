//! The wire: vectors in both directions, arithmetic of the line, and a decoder that nothing confuses.

use std::path::{Path, PathBuf};
use std::process::Command as Process;

use proptest::prelude::*;
use serde_json::{Value, json};
use somatic::internal::wire::{
    Answer, Bits, Command, Corruption, Decoder, Event, HEAD_BYTES, Head, Identity, MAX_ENCODED_BYTES, Status, encode,
};

pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A packet, owned.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Packet {
    Frame { head: Head, bits: Bits, values: Vec<u16> },
    Partial { head: Head, bits: Bits, values: Vec<(u16, u16)> },
    Identity { head: Head, request: u8, running: bool, channels: u16, bits: Bits, layout: u32, rate: u32, text: String },
    Answer { head: Head, answer: Answer },
    Command { board: u16, request: u8, command: Command },
    Corrupt(Corruption),
}

impl Packet {
    pub(crate) fn from_event(event: &Event<'_>) -> Self {
        match *event {
            Event::Frame { head, values, .. } if values.is_partial() => {
                Self::Partial { head, bits: values.bits(), values: values.iter().collect() }
            }
            Event::Frame { head, values, .. } => {
                Self::Frame { head, bits: values.bits(), values: values.iter().map(|(_, value)| value).collect() }
            }
            Event::Identity { head, identity, .. } => Self::Identity {
                head,
                request: identity.request,
                running: identity.running,
                channels: identity.channels,
                bits: identity.bits,
                layout: identity.layout,
                rate: identity.rate_mhz,
                text: identity.firmware.to_owned(),
            },
            Event::Answer { head, answer, .. } => Self::Answer { head, answer },
            Event::Command { board, request, command } => Self::Command { board, request, command },
            Event::Corrupt { why, .. } => Self::Corrupt(why),
        }
    }

    /// The bytes on the line.
    pub(crate) fn line(&self) -> Vec<u8> {
        let mut to = [0xAA; MAX_ENCODED_BYTES];
        let length = match self {
            Self::Frame { head, bits, values } => encode::frame(&mut to, head, *bits, values),
            Self::Partial { head, bits, values } => {
                let mut sparse = vec![None; values.last().map_or(0, |(channel, _)| usize::from(*channel) + 1)];
                values.iter().for_each(|&(channel, value)| sparse[usize::from(channel)] = Some(value));
                encode::partial(&mut to, head, *bits, &sparse)
            }
            Self::Identity { head, request, running, channels, bits, layout, rate, text } => {
                let identity = Identity {
                    request: *request,
                    running: *running,
                    channels: *channels,
                    bits: *bits,
                    layout: *layout,
                    rate_mhz: *rate,
                    firmware: text,
                };
                encode::identity(&mut to, head, &identity)
            }
            Self::Answer { head, answer } => encode::answer(&mut to, head, answer),
            Self::Command { board, request, command } => encode::command(&mut to, *board, *request, *command),
            Self::Corrupt(_) => panic!("nothing to encode"),
        };
        to[..length.unwrap()].to_vec()
    }

    /// What the vectors' file says of it.
    fn json(&self) -> Value {
        let with = |kind: &str, head: &Head, more: Value| {
            let mut all = json!({
                "kind": kind, "board": head.board, "boot": head.boot, "sequence": head.sequence, "time_us": head.time_us,
            });
            all.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            all
        };
        match self {
            Self::Frame { head, bits, values } => with("frame", head, json!({"bits": bits.count(), "values": values})),
            Self::Partial { head, bits, values } => {
                with("partial", head, json!({"bits": bits.count(), "channels": values}))
            }
            Self::Identity { head, request, running, channels, bits, layout, rate, text } => with(
                "identity",
                head,
                json!({
                    "request": request, "running": running, "channels": channels, "bits": bits.count(),
                    "layout": layout, "rate_mhz": rate, "firmware": text,
                }),
            ),
            Self::Answer { head, answer } => {
                let Answer { request, command, status, value } = answer;
                let status = match status {
                    Status::Done => 0,
                    Status::Unknown => 1,
                    Status::Bad => 2,
                    Status::Failed => 3,
                    Status::Other(other) => *other,
                };
                with("answer", head, json!({"request": request, "command": command, "status": status, "value": value}))
            }
            Self::Command { board, request, command } => {
                let (name, value) = match *command {
                    Command::Identify => ("identify", json!({})),
                    Command::Rate { rate_mhz } => ("rate", json!({"rate_mhz": rate_mhz})),
                    Command::Wiper { channel, wiper } => ("wiper", json!({"channel": channel, "wiper": wiper})),
                    Command::Start => ("start", json!({})),
                    Command::Stop => ("stop", json!({})),
                };
                let mut all = json!({"kind": name, "board": board, "request": request});
                all.as_object_mut().unwrap().extend(value.as_object().unwrap().clone());
                all
            }
            Self::Corrupt(why) => panic!("{why}"),
        }
    }
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

pub(crate) fn unhex(text: &str) -> Vec<u8> {
    let digits = text.trim().as_bytes();
    digits.chunks(2).map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap()).collect()
}

/// All that a decoder makes of `bytes`.
pub(crate) fn decoded(bytes: &[u8]) -> Vec<Packet> {
    let mut events = Vec::new();
    Decoder::new().push(bytes, |event| events.push(Packet::from_event(&event)));
    events
}

/// Packets that between them go to every edge of the format.
pub(crate) fn examples() -> Vec<(&'static str, Packet)> {
    let head = |sequence: u32, time_us: u32| Head { board: 3, boot: 1, sequence, time_us };
    let ramp = |count: u32, bits: Bits| -> Vec<u16> {
        (0..count).map(|channel| (channel * 0x9E37 % (u32::from(bits.max()) + 1)) as u16).collect()
    };
    let frame = |sequence: u32, bits: Bits, values: Vec<u16>| Packet::Frame {
        head: head(sequence, 1_000_000 + 20_000 * sequence),
        bits,
        values,
    };
    let command = |request: u8, command: Command| Packet::Command { board: 3, request, command };
    let answer = |request: u8, command: Command, status: Status, value: u32| Packet::Answer {
        head: head(9, 1_180_000),
        answer: Answer { request, command: command.kind(), status, value },
    };
    let identity = |request: u8, channels: u16, layout: u32, text: &str| Packet::Identity {
        head: head(0, 12),
        request,
        running: request == 0,
        channels,
        bits: Bits::Ten,
        layout,
        rate: 50_000,
        text: text.to_owned(),
    };
    let sparse = |count: u16, step: usize| (0..count).step_by(step).map(|c| (c, c * 3)).collect::<Vec<_>>();
    vec![
        ("the least frame", frame(0, Bits::Eight, vec![0])),
        ("three values of 10 bits", frame(1, Bits::Ten, vec![0, 512, 1023])),
        ("a hand: 64 channels of 10 bits", frame(2, Bits::Ten, ramp(64, Bits::Ten))),
        ("odd count of 12 bits", frame(3, Bits::Twelve, ramp(5, Bits::Twelve))),
        ("all zero", frame(4, Bits::Sixteen, vec![0; 7])),
        ("no zero for more than 254 bytes", frame(5, Bits::Sixteen, vec![0xFFFF; 256])),
        // 13 + 1 bytes of head with zeros in them, then the checksum: these end in blocks of 254, 253 and 255 bytes.
        ("the last block is full", full_block(254)),
        ("the last block is one short", full_block(253)),
        ("the last block is one over", full_block(255)),
        (
            "sequence and clock before they wrap",
            Packet::Frame {
                head: Head { board: 65534, boot: 255, sequence: u32::MAX, time_us: u32::MAX },
                bits: Bits::Eight,
                values: vec![1, 2, 255],
            },
        ),
        ("nothing changed", Packet::Partial { head: head(6, 1_120_000), bits: Bits::Ten, values: vec![] }),
        (
            "channels 0, 9 and 63",
            Packet::Partial { head: head(7, 1_140_000), bits: Bits::Ten, values: vec![(0, 1), (9, 1000), (63, 3)] },
        ),
        (
            "every third of 256",
            Packet::Partial { head: head(8, 1_160_000), bits: Bits::Twelve, values: sparse(256, 3) },
        ),
        ("at power-up", identity(0, 64, 0, "")),
        ("asked for", identity(17, 256, 0xDEAD_BEEF, "hand 1.2 µ")),
        ("rate set", answer(18, Command::Rate { rate_mhz: 0 }, Status::Done, 57_029)),
        ("no such channel", answer(19, Command::Wiper { channel: 0, wiper: 0 }, Status::Bad, 0)),
        ("identify", command(1, Command::Identify)),
        ("identify, whoever hears it", Packet::Command { board: 65535, request: 255, command: Command::Identify }),
        ("50 Hz", command(2, Command::Rate { rate_mhz: 50_000 })),
        ("channel 63 to wiper 38", command(3, Command::Wiper { channel: 63, wiper: 38 })),
        ("start", command(4, Command::Start)),
        ("stop", command(5, Command::Stop)),
    ]
}

/// A frame whose last run of bytes without a zero is `run` bytes long.
fn full_block(run: usize) -> Packet {
    // The high byte of the time is zero, and then come bits, values and checksum.
    for sequence in 100.. {
        let head = Head { board: 3, boot: 1, sequence, time_us: 0x0012_3456 };
        let packet = Packet::Frame { head, bits: Bits::Eight, values: vec![7; run - 5] };
        let line = packet.line();
        // A checksum with a zero byte cuts the run short; the next has none.
        if line.len() == HEAD_BYTES + run + 3 + usize::from(run > 254) && line.contains(&(run.min(254) as u8 + 1)) {
            return packet;
        }
    }
    unreachable!()
}

/// `docs/wire/vectors.json`, written anew with `SOMATIC_WRITE_VECTORS=1`.
pub(crate) fn vectors() -> Vec<Value> {
    let path = root().join("docs/wire/vectors.json");
    if std::env::var_os("SOMATIC_WRITE_VECTORS").is_some() {
        let lines: Vec<String> = examples()
            .iter()
            .map(|(name, packet)| {
                json!({"name": name, "packet": packet.json(), "line": hex(&packet.line())}).to_string()
            })
            .collect();
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, format!("[\n{}\n]\n", lines.join(",\n"))).unwrap();
    }
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn the_documented_vectors_hold_in_both_directions() {
    let (vectors, examples) = (vectors(), examples());
    assert_eq!(vectors.len(), examples.len());
    for (vector, (name, packet)) in vectors.iter().zip(&examples) {
        assert_eq!((&vector["name"], &vector["packet"]), (&json!(name), &packet.json()));
        let line = unhex(vector["line"].as_str().unwrap());
        assert_eq!(hex(&packet.line()), hex(&line), "{name}");
        assert_eq!(decoded(&line), std::slice::from_ref(packet), "{name}");
    }
}

#[test]
fn sixty_four_channels_of_10_bits_reach_55_frames_a_second() {
    // 13 of head, 1 for the bits, 640 bits of values, 4 of checksum; one for COBS as that is under 255; two zeros.
    let bytes = HEAD_BYTES + 1 + 640 / 8 + 4 + 1 + 2;
    assert_eq!(bytes, 101);
    for fill in [0, 1, 1023] {
        let head = Head { board: fill, boot: fill as u8, sequence: fill.into(), time_us: fill.into() };
        assert_eq!(Packet::Frame { head, bits: Bits::Ten, values: vec![fill; 64] }.line().len(), bytes);
    }
    // A byte is 10 bits on the line: start, 8, stop.
    let frames_per_second = 57_600.0 / 10.0 / bytes as f64;
    assert!((57.0..57.1).contains(&frames_per_second), "{frames_per_second}");
}

#[test]
fn what_cannot_be_written_is_refused_and_nothing_is_written_past_the_end() {
    let head = Head { board: 0, boot: 0, sequence: 0, time_us: 0 };
    let mut to = [0; MAX_ENCODED_BYTES];
    assert_eq!(encode::frame(&mut to, &head, Bits::Ten, &[1024]), None);
    assert_eq!(encode::frame(&mut to, &head, Bits::Ten, &[]), None);
    assert_eq!(encode::frame(&mut to, &head, Bits::Ten, &[0; 257]), None);
    assert_eq!(encode::partial(&mut to, &head, Bits::Ten, &[None; 257]), None);
    assert_eq!(encode::partial(&mut to, &head, Bits::Sixteen, &[Some(0); 256]), Some(MAX_ENCODED_BYTES - 2));
    assert_eq!(encode::partial(&mut to, &head, Bits::Sixteen, &[Some(0x0101); 256]), Some(MAX_ENCODED_BYTES));
    for (name, packet) in examples() {
        let line = packet.line();
        for space in [0, 1, 2, line.len() / 2, line.len() - 2, line.len() - 1] {
            let Packet::Frame { head, bits, values } = &packet else { continue };
            assert_eq!(encode::frame(&mut to[..space], head, *bits, values), None, "{name} in {space} bytes");
        }
    }
}

#[test]
fn each_sort_of_corruption_has_its_name() {
    let whole = Packet::Command { board: 3, request: 4, command: Command::Start };
    let after_a_packet = |bytes: &[u8]| {
        let events = decoded(&[&whole.line(), bytes, &whole.line()[..]].concat());
        assert_eq!((&events[0], events.last().unwrap()), (&whole, &whole));
        events[1..events.len() - 1].to_vec()
    };
    assert_eq!(after_a_packet(&[0, 0, 0]), []);
    assert_eq!(after_a_packet(&[3, 1, 1]), [Packet::Corrupt(Corruption::Short)]);
    assert_eq!(after_a_packet(&[9, 1, 1]), [Packet::Corrupt(Corruption::Code)]);
    assert_eq!(after_a_packet(&[1; 40]), [Packet::Corrupt(Corruption::Checksum)]);
    assert_eq!(after_a_packet(&vec![1; 1 << 20]), [Packet::Corrupt(Corruption::Long)]);
    let plain = |bytes: &[u8]| {
        let checksum = crc(bytes).to_le_bytes();
        let mut line = vec![bytes.len() as u8 + 5];
        line.extend(bytes.iter().chain(&checksum));
        assert!(!line.contains(&0), "this test's own packets have no zero");
        after_a_packet(&line)
    };
    assert_eq!(plain(&[2, 0x13, 3, 3, 3]), [Packet::Corrupt(Corruption::Version(2))]);
    assert_eq!(plain(&[1, 0x77, 3, 3, 3]), [Packet::Corrupt(Corruption::Kind(0x77))]);
    assert_eq!(plain(&[1, 0x13, 3, 3, 3, 9]), [Packet::Corrupt(Corruption::Contents)]);
    assert_eq!(plain(&[1, 0x01, 3, 3, 3]), [Packet::Corrupt(Corruption::Contents)]);
    assert_eq!(decoded(&whole.line()[3..]), [Packet::Corrupt(Corruption::Joined)]);
}

/// CRC-32, bit by bit: written apart from the one in use.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    })
}

/// The encoder alone makes a crate of its own that has neither `std` nor an allocator.
#[test]
fn the_encoder_needs_neither_std_nor_allocation() {
    let folder = tempfile::tempdir().unwrap();
    let wire = root().join("crates/wire/src");
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let manifest = "[package]\nname = \"somatic\"\nversion = \"0.1.0\"\nedition = \"2024\"\n[workspace]\n[lib]\npath = \"lib.rs\"\n\
        [dependencies]\ncobs = { version = \"0.5\", default-features = false }\ncrc = \"3.4\"\n";
    let text = format!(
        "#![no_std]\n#![allow(dead_code)]\n#[path = {:?}]\npub mod format;\n#[path = {:?}]\npub mod encode;\n",
        wire.join("format.rs"),
        wire.join("encode.rs")
    );
    for (name, text) in [("Cargo.toml", manifest), ("lib.rs", &text), ("Cargo.lock", &lock)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let check = || {
        let mut cargo = Process::new(env!("CARGO"));
        cargo.args(["check", "--offline", "--quiet"]).current_dir(folder.path());
        let output = cargo.env("CARGO_TARGET_DIR", folder.path().join("target")).output().unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (compiles, why) = check();
    assert!(compiles, "{why}");
    // What does allocate is found out.
    std::fs::write(folder.path().join("lib.rs"), text + "pub fn no() -> Vec<u8> { Vec::new() }\n").unwrap();
    let (compiles, why) = check();
    assert!(!compiles && why.contains("Vec"), "{why}");
    assert!(Path::new(&wire).exists());
}

/// What happens to bytes on a line.
#[derive(Clone, Debug)]
enum Harm {
    Flip { at: prop::sample::Index, bit: u8 },
    Drop { at: prop::sample::Index, count: usize },
    Insert { at: prop::sample::Index, bytes: Vec<u8> },
}

fn harm() -> impl Strategy<Value = Harm> {
    prop_oneof![
        (any::<prop::sample::Index>(), 0..8_u8).prop_map(|(at, bit)| Harm::Flip { at, bit }),
        (any::<prop::sample::Index>(), 1..200_usize).prop_map(|(at, count)| Harm::Drop { at, count }),
        (any::<prop::sample::Index>(), prop::collection::vec(any::<u8>(), 1..300))
            .prop_map(|(at, bytes)| Harm::Insert { at, bytes }),
    ]
}

/// The bytes of `packets` after `harms`, and which packets are still whole.
fn harmed(packets: &[Packet], harms: &[Harm]) -> (Vec<u8>, Vec<bool>) {
    // Each byte with the packet that it belongs to; what a harm touches belongs to none.
    let mut line: Vec<(u8, Option<usize>)> = Vec::new();
    for (index, packet) in packets.iter().enumerate() {
        let bytes = packet.line();
        line.extend(bytes.into_iter().map(|byte| (byte, Some(index))));
    }
    let mut whole = vec![true; packets.len()];
    for harm in harms {
        match harm {
            Harm::Flip { at, bit } => {
                let place = at.index(line.len());
                let (byte, owner) = &mut line[place];
                *byte ^= 1 << bit;
                owner.take().into_iter().for_each(|owner| whole[owner] = false);
            }
            Harm::Drop { at, count } => {
                let start = at.index(line.len());
                let end = (start + count).min(line.len() - 1);
                line.drain(start..end.max(start)).for_each(|(_, owner)| {
                    owner.into_iter().for_each(|owner| whole[owner] = false);
                });
            }
            Harm::Insert { at, bytes } => {
                let place = at.index(line.len());
                let (before, after) = (place.checked_sub(1).and_then(|p| line[p].1), line[place].1);
                if before == after {
                    before.into_iter().for_each(|owner| whole[owner] = false);
                }
                line.splice(place..place, bytes.iter().map(|&byte| (byte, None)));
            }
        }
    }
    (line.into_iter().map(|(byte, _)| byte).collect(), whole)
}

pub(crate) fn frames_of_a_board() -> impl Strategy<Value = Vec<Packet>> {
    let bits = prop::sample::select(vec![Bits::Eight, Bits::Ten, Bits::Twelve, Bits::Sixteen]);
    let values = prop::collection::vec(prop::option::weighted(0.8, any::<u16>()), 1..=80);
    prop::collection::vec((bits, values, any::<bool>()), 1..12).prop_map(|frames| {
        let numbered = frames.into_iter().enumerate();
        numbered
            .map(|(number, (bits, values, full))| {
                let sequence = number as u32;
                let head = Head { board: 5, boot: 9, sequence, time_us: 17_535_u32.wrapping_mul(sequence) };
                if full {
                    let values = values.iter().map(|value| value.unwrap_or(0) & bits.max()).collect();
                    Packet::Frame { head, bits, values }
                } else {
                    let present = values.iter().zip(0..).filter_map(|(value, channel)| Some((channel, (*value)?)));
                    let values = present.map(|(channel, value)| (channel, value & bits.max())).collect();
                    Packet::Partial { head, bits, values }
                }
            })
            .collect()
    })
}

/// An answer that says that `sequence` frames were sent.
fn answer_after(sequence: u32) -> Packet {
    let head = Head { board: 5, boot: 9, sequence, time_us: 17_535_u32.wrapping_mul(sequence) };
    Packet::Answer { head, answer: Answer { request: 1, command: 0x14, status: Status::Done, value: 0 } }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn whatever_happens_on_the_line_the_books_balance(
        frames in frames_of_a_board(),
        harms in prop::collection::vec(harm(), 0..6),
        cuts in prop::collection::vec(1..90_usize, 1..30),
    ) {
        let (bytes, whole) = harmed(&frames, &harms);
        let sent = frames.len() as u32;
        let line = [answer_after(0).line(), bytes, answer_after(sent).line()].concat();
        let (mut decoder, mut got) = (Decoder::new(), Vec::new());
        let (mut rest, mut cuts) = (&line[..], cuts.iter().cycle());
        while !rest.is_empty() {
            let (piece, after) = rest.split_at((*cuts.next().unwrap()).min(rest.len()));
            decoder.push(piece, |event| got.push(Packet::from_event(&event)));
            rest = after;
        }
        let account = decoder.frame_counts().board(5).unwrap();
        prop_assert_eq!(account.intact + account.lost, u64::from(sent));
        prop_assert_eq!(account.restarts, 0);
        let came: Vec<&Packet> =
            got.iter().filter(|packet| matches!(packet, Packet::Frame { .. } | Packet::Partial { .. })).collect();
        prop_assert_eq!(came.len() as u64, account.intact);
        prop_assert!(came.iter().all(|packet| frames.contains(packet)), "something came that was not sent");
        for (frame, whole) in frames.iter().zip(whole) {
            prop_assert!(!whole || came.contains(&frame), "a whole frame did not come: {:?}", frame);
        }
    }

    #[test]
    fn noise_alone_gives_nothing(bytes in prop::collection::vec(any::<u8>(), 0..4000)) {
        prop_assert!(decoded(&bytes).iter().all(|packet| matches!(packet, Packet::Corrupt(_))));
    }
}

/// The decoder under random harm for `SOMATIC_FUZZ_SECONDS` (60 if unset), each round from another seed that it tells.
#[test]
#[ignore = "runs for as long as SOMATIC_FUZZ_SECONDS says"]
fn the_decoder_survives_a_long_time() {
    use proptest::strategy::ValueTree as _;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
    let seconds = std::env::var("SOMATIC_FUZZ_SECONDS").map_or(60, |text| text.parse().unwrap());
    let end = std::time::Instant::now() + std::time::Duration::from_secs(seconds);
    let mut decoder = Decoder::new();
    let (mut rounds, mut sent, mut bytes_sent) = (0_u64, 0_u64, 0_u64);
    decoder.push(&answer_after(0).line(), |_| ());
    while std::time::Instant::now() < end {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&rounds.to_le_bytes());
        let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &seed));
        let mut frames = frames_of_a_board().new_tree(&mut runner).unwrap().current();
        let harms = prop::collection::vec(harm(), 0..6).new_tree(&mut runner).unwrap().current();
        for frame in &mut frames {
            if let Packet::Frame { head, .. } | Packet::Partial { head, .. } = frame {
                head.sequence = sent as u32;
                sent += 1;
            }
        }
        let (bytes, whole) = harmed(&frames, &harms);
        bytes_sent += bytes.len() as u64;
        let mut came = Vec::new();
        decoder
            .push(&[bytes, answer_after(sent as u32).line()].concat(), |event| came.push(Packet::from_event(&event)));
        came.retain(|packet| matches!(packet, Packet::Frame { .. } | Packet::Partial { .. }));
        assert!(came.iter().all(|packet| frames.contains(packet)), "round {rounds}: something came that was not sent");
        assert!(frames.iter().zip(whole).all(|(frame, whole)| !whole || came.contains(frame)), "round {rounds}");
        let account = decoder.frame_counts().board(5).unwrap();
        assert_eq!(account.intact + account.lost, sent, "round {rounds}");
        rounds += 1;
    }
    let account = decoder.frame_counts().board(5).unwrap();
    eprintln!("{rounds} rounds, {bytes_sent} bytes; {sent} sent = {} intact + {} lost", account.intact, account.lost);
}
