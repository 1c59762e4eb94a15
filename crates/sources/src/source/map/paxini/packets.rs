//! What PaXini's board for many sensors says and is told.
//!
//! A request is 55 AA 00, a function (3 reads, 16 writes), a register and a count of bytes, both in 16 bits with the low byte first, what
//! is written, and a checksum: the bytes of a packet add up to 0. An answer begins with AA 55 and goes on in the same way. What the board
//! sends by itself is AA 56 00, how many bytes follow but for the checksum, in 16 bits, an error that is 0 for none, and data.

use std::collections::VecDeque;

/// Functions.
pub(super) const READ: u8 = 0x03;
pub(super) const WRITE: u8 = 0x10;
/// Registers: bits of the sensors that are connected, numbers of taxels in 16 bits each, what frames hold, and whether frames are sent.
pub(super) const CONNECTED: u16 = 0x10;
pub(super) const TAXELS: u16 = 0x30;
pub(super) const CONTENT: u16 = 0x16;
pub(super) const SENDING: u16 = 0x17;
/// What is asked about. A frame with a damaged second byte begins as an answer does, but hardly one of these registers.
const REGISTERS: [u16; 4] = [CONNECTED, TAXELS, CONTENT, SENDING];
/// Sensors, those of the palm too: the longest answer has a number of 16 bits for each.
pub(super) const SENSORS: usize = 28;
const MAX_ANSWER_BYTES: usize = 2 * SENSORS;
/// What a packet begins with. The third byte is 0.
const REQUEST: [u8; 3] = [0x55, 0xAA, 0];
const ANSWER: [u8; 3] = [0xAA, 0x55, 0];
const PUSHED: [u8; 3] = [0xAA, 0x56, 0];
/// Bytes of either before its data.
const ANSWER_HEAD: usize = 8;
const PUSHED_HEAD: usize = 5;
/// Data of a frame while the sensors are not known; more is a damaged length. Twenty sensors with all the taxels that the board has room
/// for have under 11,000 bytes.
const MAX_FRAME_BYTES: usize = 1 << 14;

/// A packet of the board whose checksum is right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Packet {
    Answer { function: u8, register: u16, data: Vec<u8> },
    Pushed { error: u8, data: Vec<u8> },
}

/// A request to read `count` bytes from `register` on.
pub(super) fn read(register: u16, count: u16) -> Vec<u8> {
    request(READ, register, count, &[])
}

/// A request to write `data` at `register`.
pub(super) fn write(register: u16, data: &[u8]) -> Vec<u8> {
    request(WRITE, register, data.len() as u16, data)
}

fn request(function: u8, register: u16, count: u16, data: &[u8]) -> Vec<u8> {
    let mut bytes = [&REQUEST[..], &[function], &register.to_le_bytes(), &count.to_le_bytes(), data].concat();
    bytes.push(checksum(&bytes));
    bytes
}

fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_sub(*byte))
}

/// Packets in a stream of bytes, which may be damaged.
#[derive(Debug, Default)]
pub(super) struct Packets {
    bytes: VecDeque<u8>,
    /// Bytes that were left out since the last packet.
    left_out: bool,
    /// Bytes of data that a frame has at most, once that is known.
    most: Option<usize>,
    /// How many bytes of data frames would have that are longer, and how many came since the last frame, all with the same length.
    long: (usize, u32),
    /// Pieces between packets that are none.
    pub(super) damaged: u64,
}

impl Packets {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// Has frames of more than `most` bytes of data be damage: else a single damaged length would swallow many of them.
    pub(super) fn limit(&mut self, most: usize) {
        (self.most, self.long) = (Some(most), (0, 0));
    }

    /// The length that `times` frames had, one after the other, which were left out as too long. That is no damage: it begins to count
    /// anew.
    pub(super) fn too_long(&mut self, times: u32) -> Option<usize> {
        let (bytes, count) = self.long;
        (count >= times).then(|| {
            self.long = (0, 0);
            bytes
        })
    }

    /// Forgets what has come: the next byte may be in the middle of a packet, and is no damage.
    pub(super) fn restart(&mut self) {
        self.damaged += u64::from(!self.bytes.is_empty());
        self.bytes.clear();
        self.left_out = true;
    }

    /// The next whole packet, if all of it is there.
    pub(super) fn next(&mut self) -> Option<Packet> {
        loop {
            let bytes = self.bytes.make_contiguous();
            let head = &bytes[..bytes.len().min(3)];
            let Some(start) = [ANSWER, PUSHED].into_iter().find(|start| start.starts_with(head)) else {
                self.skip();
                continue;
            };
            let head = if start == ANSWER { ANSWER_HEAD } else { PUSHED_HEAD };
            if bytes.len() < head {
                return None;
            }
            let number = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
            let count = usize::from(number(head - 2));
            let is_sound = match start {
                ANSWER => count <= MAX_ANSWER_BYTES && REGISTERS.contains(&number(4)),
                _ => (1..=self.most.unwrap_or(MAX_FRAME_BYTES) + 1).contains(&count),
            };
            if !is_sound {
                if start == PUSHED && count > 0 {
                    let (bytes, before) = self.long;
                    self.long = (count - 1, if bytes == count - 1 { before + 1 } else { 1 });
                }
                self.skip();
                continue;
            }
            let wanted = head + count + 1;
            let whole = bytes.get(..wanted)?;
            if checksum(whole) != 0 {
                self.skip();
                continue;
            }
            let packet = match start {
                ANSWER => Packet::Answer {
                    function: whole[3],
                    register: u16::from_le_bytes([whole[4], whole[5]]),
                    data: whole[ANSWER_HEAD..wanted - 1].to_vec(),
                },
                _ => {
                    self.long = (0, 0);
                    Packet::Pushed { error: whole[PUSHED_HEAD], data: whole[PUSHED_HEAD + 1..wanted - 1].to_vec() }
                }
            };
            self.bytes.drain(..wanted);
            self.left_out = false;
            return Some(packet);
        }
    }

    /// Leaves out a byte with which no packet begins.
    fn skip(&mut self) {
        self.bytes.pop_front();
        self.damaged += u64::from(!std::mem::replace(&mut self.left_out, true));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What the board sends by itself.
    pub(in super::super) fn pushed(error: u8, data: &[u8]) -> Vec<u8> {
        let count = (data.len() as u16 + 1).to_le_bytes();
        let mut bytes = [&PUSHED[..], &count, &[error], data].concat();
        bytes.push(checksum(&bytes));
        bytes
    }

    /// Its answer to a request.
    pub(in super::super) fn answer(function: u8, register: u16, data: &[u8]) -> Vec<u8> {
        let mut bytes = request(function, register, data.len() as u16, data);
        bytes[..2].copy_from_slice(&ANSWER[..2]);
        bytes
    }

    fn all(bytes: &[u8]) -> (Vec<Packet>, u64) {
        all_up_to(None, bytes)
    }

    fn all_up_to(most: Option<usize>, bytes: &[u8]) -> (Vec<Packet>, u64) {
        let mut packets = Packets { most, ..Packets::default() };
        packets.push(bytes);
        (std::iter::from_fn(|| packets.next()).collect(), packets.damaged)
    }

    #[test]
    fn requests_are_those_of_public_examples() {
        assert_eq!(read(0, 15), [0x55, 0xAA, 0, 3, 0, 0, 0x0F, 0, 0xEF]);
        assert_eq!(write(0x17, &[1]), [0x55, 0xAA, 0, 0x10, 0x17, 0, 1, 0, 1, 0xD8]);
        assert_eq!(write(0x17, &[0]), [0x55, 0xAA, 0, 0x10, 0x17, 0, 1, 0, 0, 0xD9]);
    }

    #[test]
    fn packets_are_found_however_they_come_and_whatever_is_between_them() {
        let frame = Packet::Pushed { error: 7, data: vec![0xAA, 0x56, 0, 1, 0xAA] };
        let told = Packet::Answer { function: READ, register: 0x30, data: vec![0xAA, 0x55] };
        let [one, two] = [pushed(7, &[0xAA, 0x56, 0, 1, 0xAA]), answer(READ, 0x30, &[0xAA, 0x55])];
        let whole = [&one[..], &two].concat();
        assert_eq!(all(&whole), (vec![frame.clone(), told.clone()], 0));
        let mut packets = Packets::default();
        let mut found = Vec::new();
        for byte in &whole {
            packets.push(std::slice::from_ref(byte));
            found.extend(packets.next());
        }
        assert_eq!((found, packets.damaged), (vec![frame.clone(), told.clone()], 0));
        let noisy = [&[1, 0xAA, 0xAA][..], &one, &[0xAA, 0x55, 9], &two].concat();
        assert_eq!(all(&noisy), (vec![frame.clone(), told.clone()], 2));
        // A packet that is cut short, with one after it; and the board's own echo of a request.
        let cut = [&one[..one.len() - 3], &two, &one, &one].concat();
        assert_eq!(all(&cut), (vec![told, frame.clone(), frame.clone()], 1));
        assert_eq!(all(&[&read(0, 15)[..], &one].concat()), (vec![frame], 1));
        assert_eq!(all(&[0xAA, 0x56, 0, 0, 0, 0]), (vec![], 1));
    }

    #[test]
    fn a_damaged_byte_costs_its_packet_and_no_other() {
        let (one, two) = (pushed(0, &[0x11; 20]), pushed(0, &[0x23; 20]));
        let of_two = Packet::Pushed { error: 0, data: vec![0x23; 20] };
        // Nothing comes after it for a damaged length to end in.
        for (at, by) in (0..one.len()).flat_map(|at| (1..=u8::MAX).map(move |by| (at, by))) {
            let mut damaged = one.clone();
            damaged[at] ^= by;
            let (found, pieces) = all_up_to(Some(20), &[&damaged[..], &two].concat());
            assert!(found.last() == Some(&of_two) && pieces == 1, "{at} {by}: {found:?}");
            // By chance a shorter piece adds up to 0; its length is not that of a frame.
            let short = |packet: &Packet| matches!(packet, Packet::Pushed { data, .. } if data.len() < 20);
            assert!(found.len() == 1 || (at == 3 && found.len() == 2 && short(&found[0])), "{at} {by}: {found:?}");
        }
    }

    #[test]
    fn frames_that_are_all_too_long_are_no_damage() {
        let mut packets = Packets::default();
        packets.limit(20);
        packets.push(&pushed(0, &[1; 21]).repeat(9));
        assert_eq!((packets.next(), packets.too_long(10)), (None, None));
        packets.push(&[pushed(0, &[1; 20]), pushed(0, &[1; 21]).repeat(9), pushed(0, &[1; 22])].concat());
        assert!(packets.next().is_some());
        assert_eq!((packets.next(), packets.too_long(10)), (None, None));
        packets.push(&pushed(0, &[1; 22]).repeat(9));
        assert_eq!((packets.next(), packets.too_long(10), packets.too_long(10)), (None, Some(22), None));
    }

    /// What may happen to a packet: a byte is another one, its end is missing, or bytes come before it.
    #[derive(Clone, Debug)]
    enum Harm {
        None,
        Changed(usize, u8),
        Cut(usize),
        After(Vec<u8>),
    }

    /// Bytes with which no packet begins.
    fn bytes(count: impl Into<prop::collection::SizeRange>) -> impl Strategy<Value = Vec<u8>> {
        prop::collection::vec(any::<u8>().prop_filter("begins a packet", |byte| *byte != PUSHED[0]), count)
    }

    fn harm() -> impl Strategy<Value = Harm> {
        prop_oneof![
            3 => Just(Harm::None),
            2 => (any::<usize>(), 1..=u8::MAX).prop_map(|(at, by)| Harm::Changed(at, by)),
            // Lengths are two bytes of many.
            2 => (3..5_usize, 1..=u8::MAX).prop_map(|(at, by)| Harm::Changed(at, by)),
            1 => (1..30_usize).prop_map(Harm::Cut),
            1 => bytes(1..40).prop_map(Harm::After),
        ]
    }

    proptest! {
        #[test]
        fn packets_between_damaged_ones_are_found(
            sent in prop::collection::vec((bytes(30), any::<bool>(), harm()), 1..20),
            step in 1..200_usize,
        ) {
            let (mut line, mut whole, mut is_damaged) = (Vec::new(), Vec::new(), false);
            for (data, is_answer, harm) in sent {
                let (mut one, packet) = match is_answer {
                    true => (answer(READ, TAXELS, &data), Packet::Answer { function: READ, register: TAXELS, data }),
                    false => (pushed(data[0], &data), Packet::Pushed { error: data[0], data }),
                };
                is_damaged |= !matches!(harm, Harm::None);
                match harm {
                    Harm::None => whole.push(packet),
                    Harm::Changed(at, by) => {
                        let at = at % one.len();
                        one[at] ^= by;
                    }
                    Harm::Cut(count) => one.truncate(one.len() - count),
                    Harm::After(noise) => {
                        one.splice(0..0, noise);
                        whole.push(packet);
                    }
                }
                line.extend(one);
            }
            // What is cut may wait for its end.
            let last = Packet::Pushed { error: 0, data: vec![1; 30] };
            whole.extend([last.clone(), last.clone(), last]);
            line.extend(pushed(0, &[1; 30]).repeat(3));
            let mut packets = Packets::default();
            packets.limit(30);
            let mut found = Vec::new();
            for bytes in line.chunks(step) {
                packets.push(bytes);
                found.extend(std::iter::from_fn(|| packets.next()));
            }
            let (mut next, mut lost) = (0, 0);
            for packet in &whole {
                match found[next..].iter().position(|own| own == packet) {
                    Some(at) => next += at + 1,
                    None => lost += 1,
                }
            }
            // A piece that adds up to 0 by chance may end within a packet.
            let strange = found.len() - (whole.len() - lost);
            prop_assert!(lost <= strange, "{lost} lost, {strange} strange");
            prop_assert!(is_damaged == (packets.damaged > 0) || strange > 0);
        }

        #[test]
        fn any_bytes_are_read_to_their_end(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
            let (found, _) = all(&bytes);
            prop_assert!(found.len() <= bytes.len() / 7);
        }
    }
}
