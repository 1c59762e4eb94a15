//! What PaXini's board for many sensors says and is told.
//!
//! A request is 55 AA 00, a function (3 reads, 16 writes), a register and a count of bytes, both in 16 bits with the low byte first, what is
//! written, and a checksum: the bytes of a packet add up to 0. An answer begins with AA 55 and goes on in the same way. What the board sends
//! by itself is AA 56 00, how many bytes follow but for the checksum, in 16 bits, an error that is 0 for none, and data.

use std::collections::VecDeque;

/// Functions.
pub(super) const READ: u8 = 0x03;
pub(super) const WRITE: u8 = 0x10;
/// What a packet begins with. The third byte is 0.
const REQUEST: [u8; 3] = [0x55, 0xAA, 0];
const ANSWER: [u8; 3] = [0xAA, 0x55, 0];
const PUSHED: [u8; 3] = [0xAA, 0x56, 0];
/// Bytes of either before its data.
const ANSWER_HEAD: usize = 8;
const PUSHED_HEAD: usize = 5;
/// A packet with more is a damaged length: twenty sensors with all the taxels that the board has room for have under 11,000 bytes.
const MAX_BYTES: usize = 1 << 14;

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
    /// Pieces between packets that are none.
    pub(super) damaged: u64,
}

impl Packets {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
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
            let number = |at: usize| usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
            let wanted = match start {
                _ if bytes.len() < ANSWER_HEAD.min(PUSHED_HEAD) => return None,
                ANSWER if bytes.len() < ANSWER_HEAD => return None,
                ANSWER => ANSWER_HEAD + number(6) + 1,
                _ => PUSHED_HEAD + number(3) + 1,
            };
            if wanted > MAX_BYTES || (start == PUSHED && wanted == PUSHED_HEAD + 1) {
                self.skip();
                continue;
            }
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
                _ => Packet::Pushed { error: whole[PUSHED_HEAD], data: whole[PUSHED_HEAD + 1..wanted - 1].to_vec() },
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
        let mut packets = Packets::default();
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
        // Far enough for a damaged length to end.
        let tail = pushed(0, &[0; 9]).repeat(MAX_BYTES / 15 + 2);
        let mut wrong = 0;
        for (at, by) in (0..one.len()).flat_map(|at| [1, 2, 0x55, 0x80, 0xFF].map(|by| (at, by))) {
            let mut damaged = one.clone();
            damaged[at] ^= by;
            let (found, pieces) = all(&[&damaged[..], &two, &tail].concat());
            let of_two = Packet::Pushed { error: 0, data: vec![0x23; 20] };
            match found.contains(&of_two) {
                true => assert!(pieces == 1 && found[0] == of_two, "{at} {by}"),
                // By chance a longer piece adds up to 0; its length is not that of a frame.
                false => {
                    assert!(matches!(&found[0], Packet::Pushed { data, .. } if data.len() > 20), "{at} {by}");
                    wrong += 1;
                }
            }
        }
        assert!(wrong <= 1, "{wrong}");
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_to_their_end(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
            let (found, _) = all(&bytes);
            prop_assert!(found.len() <= bytes.len() / 7);
        }
    }
}
