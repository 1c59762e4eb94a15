//! Registers of a device that speaks Modbus TCP, such as a robot's hand: read again and again, each time as a message.
//!
//! A request is a header (transaction, 0, bytes that follow, unit) with function 3, an address and a count of registers, all in
//! big-endian numbers of 16 bits but the unit; the answer has the same header, the function, how many bytes follow, and these.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::{Duration, Instant};

use super::array_map::{ArrayMap, MapTime};
use super::decoder::Decoder;
use super::mapped::{Came, Messages};
use crate::error::{Error, Result, failed};
use crate::signal::{FrameTime, RawValue};

/// The port and the unit where none are named.
const PORT: u16 = 502;
const UNIT: u8 = 1;
/// How long a connection and an answer may take.
const ANSWERS_WITHIN: Duration = Duration::from_secs(3);
/// Reads holding registers. Where a device refuses, its answer has this bit, too.
const READ: u8 = 3;
const REFUSED: u8 = 0x80;
/// Bytes before an answer's function: transaction, protocol, length, unit.
const HEADER_BYTES: usize = 7;

/// Registers of a device, by a map.
pub(in crate::source) struct ModbusRegisters {
    name: String,
    device: TcpStream,
    unit: u8,
    transaction: u16,
    map: ArrayMap,
    /// The first register and the number of registers of each array.
    blocks: Vec<[u16; 2]>,
    decoder: Decoder,
    bytes: Vec<u8>,
    start: Instant,
    read_at: Option<Instant>,
    /// Whether an answer did not come, or another one came in its place: what comes next belongs to none.
    is_gone: bool,
    /// Whether any values came: a device that refuses from the beginning goes on with that.
    has_come: bool,
}

/// The address with its port, and the unit, that `HOST[:PORT][/UNIT]` names.
///
/// # Errors
/// A usage error: it is not written so.
pub(in crate::source) fn place_of(text: &str) -> Result<(String, u8)> {
    let bad =
        || Error::usage(format!("`{text}` is not a device; write modbus://HOST:PORT, or modbus://HOST:PORT/UNIT"));
    let (address, unit) = match text.split_once('/') {
        Some((address, unit)) => (address, unit.parse().map_err(|_| bad())?),
        None => (text, UNIT),
    };
    let address = match address.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0) => address.to_owned(),
        None if !address.is_empty() => format!("{address}:{PORT}"),
        _ => return Err(bad()),
    };
    Ok((address, unit))
}

impl ModbusRegisters {
    /// Connects to the device at `place`, `HOST[:PORT][/UNIT]`.
    ///
    /// # Errors
    /// It is not there; a usage error if the map does not say where its arrays are in registers.
    pub(in crate::source) fn connect(place: &str, map: &ArrayMap) -> Result<Self> {
        let name = format!("modbus://{place}");
        let blocks = map.blocks().map_err(|e| e.at(&map.name))?;
        if matches!(map.time, MapTime::At(..)) || map.names.is_some() {
            return Err(
                Error::usage("registers have neither a time nor names; leave these out of the map").at(&map.name)
            );
        }
        let (address, unit) = place_of(place)?;
        let failed = |e: std::io::Error| failed!("no connection to {address}: {e}").at(&name);
        let mut last = std::io::Error::new(ErrorKind::NotFound, "it has no address");
        let mut device = None;
        for one in address.to_socket_addrs().map_err(failed)? {
            match TcpStream::connect_timeout(&one, ANSWERS_WITHIN) {
                Ok(stream) => {
                    device = Some(stream);
                    break;
                }
                Err(e) => last = e,
            }
        }
        let Some(device) = device else { return Err(failed(last)) };
        device.set_nodelay(true).map_err(failed)?;
        device.set_read_timeout(Some(ANSWERS_WITHIN)).map_err(failed)?;
        Ok(Self {
            name,
            device,
            unit,
            transaction: 0,
            map: map.clone(),
            blocks,
            decoder: map.decoder.map_or_else(|| "i16be".parse(), Ok)?,
            bytes: Vec::new(),
            start: Instant::now(),
            read_at: None,
            is_gone: false,
            has_come: false,
        })
    }

    /// Reads the registers of the block at `index` into `bytes`.
    fn read(&mut self, index: usize) -> Result<()> {
        let [first, count] = self.blocks[index];
        self.transaction = self.transaction.wrapping_add(1);
        let mut request = Vec::with_capacity(12);
        for number in [self.transaction, 0, 6] {
            request.extend_from_slice(&number.to_be_bytes());
        }
        request.extend_from_slice(&[self.unit, READ]);
        request.extend_from_slice(&first.to_be_bytes());
        request.extend_from_slice(&count.to_be_bytes());
        let gone = |e: std::io::Error| match e.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => failed!("no answer within {} s", ANSWERS_WITHIN.as_secs()),
            ErrorKind::UnexpectedEof => Error::failed("the device has closed the connection"),
            _ => failed!("{e}"),
        };
        self.is_gone = true;
        self.device.write_all(&request).map_err(gone)?;
        let mut header = [0; HEADER_BYTES];
        self.device.read_exact(&mut header).map_err(gone)?;
        let number = |at: usize| u16::from_be_bytes([header[at], header[at + 1]]);
        // The length counts the unit, which has been read.
        let length = usize::from(number(4));
        if number(0) != self.transaction || number(2) != 0 || !(3..=255).contains(&length) {
            return Err(Error::failed("what came is not an answer in Modbus TCP; is it the right port?"));
        }
        self.bytes.resize(length - 1, 0);
        self.device.read_exact(&mut self.bytes).map_err(gone)?;
        (self.is_gone, self.read_at) = (false, Some(Instant::now()));
        checked(&self.bytes, count)
    }
}

/// Checks that `answer`, from its function on, has `count` registers.
fn checked(answer: &[u8], count: u16) -> Result<()> {
    match answer {
        [function, error, ..] if *function == READ | REFUSED => {
            let why = match error {
                1 => "it does not read registers",
                2 => "it has no such registers",
                3 => "it does not give so many at once",
                4 => "it has failed",
                6 => "it is busy",
                _ => "it does not say why in a known way",
            };
            Err(failed!("the device refuses, with error {error}: {why}"))
        }
        [function, bytes, rest @ ..] if *function == READ => {
            if usize::from(*bytes) == rest.len() && rest.len() == 2 * usize::from(count) {
                return Ok(());
            }
            Err(failed!("the answer has {} bytes, and {count} registers are {}", rest.len(), 2 * count))
        }
        _ => Err(Error::failed("what came is not an answer to a read of registers")),
    }
}

impl Messages for ModbusRegisters {
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
        for index in 0..self.blocks.len() {
            self.read(index).map_err(|e| e.at(format!("{}: register {}", self.name, self.blocks[index][0])))?;
            let map = &self.map;
            self.decoder.bytes(&self.bytes[2..], |number| values.push(map.value(number)))?;
        }
        self.has_come = true;
        Ok(Came::Message(FrameTime::from(self.start.elapsed().as_secs_f64())))
    }

    fn has_failed(&self) -> bool {
        self.is_gone || !self.has_come
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn taken(&self) -> String {
        format!("{}: registers of {}; time is when they come", self.name, self.map.paths())
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::thread;

    use super::super::mapped::MappedSource;
    use super::*;
    use crate::signal::Frame;
    use crate::source::Source as _;

    /// A device that answers each request by `answer`, of the unit, the first register and how many are asked for; the answer is all from
    /// the function on.
    fn device(answer: impl Fn(u8, u16, u16) -> Vec<u8> + Send + 'static) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut request = [0; 12];
            while stream.read_exact(&mut request).is_ok() {
                assert_eq!((&request[2..6], request[7]), (&[0, 0, 0, 6][..], 3));
                let number = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
                let body = answer(request[6], number(8), number(10));
                let length = (body.len() as u16 + 1).to_be_bytes();
                let whole = [&request[..4], &length, &request[6..7], &body].concat();
                // In two parts, as networks may deliver it.
                stream.write_all(&whole[..5]).unwrap();
                thread::sleep(Duration::from_millis(1));
                stream.write_all(&whole[5..]).unwrap();
            }
        });
        address
    }

    /// An answer with `count` registers.
    fn registers(count: u16, value: impl Fn(u16) -> i16) -> Vec<u8> {
        let mut answer = vec![3, 2 * count as u8];
        (0..count).for_each(|at| answer.extend_from_slice(&value(at).to_be_bytes()));
        answer
    }

    const MAP: &str = "values = ['tip', 'palm']\nmissing = [-1]\nregisters = { tip = [3000, 3], palm = [4900, 2] }\n";

    #[test]
    fn registers_are_read_again_and_again() {
        let address = device(|unit, first, count| {
            registers(count, |at| match (first, at) {
                (3000, at) => 100 * i16::from(unit) + at as i16,
                (4900, 0) => -1,
                _ => -300,
            })
        });
        let map = ArrayMap::parse(MAP).unwrap();
        let messages = ModbusRegisters::connect(&format!("{address}/2"), &map).unwrap();
        let mut source = MappedSource::new(Box::new(messages), &map, false).unwrap();
        let mut frame = Frame::default();
        let mut before_s = -1.0;
        for _ in 0..3 {
            assert!(source.next_frame(&mut frame).unwrap());
            let values: Vec<Option<f64>> = frame.values.iter().map(|value| value.number()).collect();
            assert_eq!(values, [Some(200.0), Some(201.0), Some(202.0), None, Some(-300.0)]);
            assert!(frame.t_s > before_s);
            before_s = frame.t_s;
        }
        assert!(
            source.notices()[0].contains("/2: registers of tip to palm; time is when they come: 5 values a message")
        );
    }

    #[test]
    fn what_a_device_does_wrong_is_said_in_a_line() {
        let map = ArrayMap::parse(MAP).unwrap();
        let why = |answer: fn(u8, u16, u16) -> Vec<u8>| {
            let mut messages = ModbusRegisters::connect(&device(answer), &map).unwrap();
            messages.next(&mut Vec::new()).unwrap_err().to_string()
        };
        for (why, says) in [
            (why(|_, _, _| vec![0x83, 2]), "register 3000: the device refuses, with error 2: it has no such registers"),
            (why(|_, _, _| vec![3, 4, 0, 1, 0, 2]), "the answer has 4 bytes, and 3 registers are 6"),
            (why(|_, _, _| vec![4, 6, 0, 1, 0, 2, 0, 3]), "not an answer to a read of registers"),
        ] {
            assert!(why.contains(says) && why.starts_with("modbus://127.0.0.1:") && why.lines().count() == 1, "{why}");
        }
        // One that speaks something else, and one that is gone.
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let other = thread::spawn(move || listener.accept().unwrap().0.write_all(b"HTTP/1.1 400 Bad Request").unwrap());
        let mut messages = ModbusRegisters::connect(&address, &map).unwrap();
        other.join().unwrap();
        let why = messages.next(&mut Vec::new()).unwrap_err().to_string();
        assert!(why.contains("is it the right port?") || why.contains("reset"), "{why}");
        let why = ModbusRegisters::connect(&address, &map).err().unwrap().to_string();
        assert!(why.contains("no connection to 127.0.0.1:"), "{why}");
    }

    #[test]
    fn a_device_that_is_gone_or_never_answers_is_no_message_to_skip() {
        let map = ArrayMap::parse(MAP).unwrap();
        let open = |address: &str| {
            let messages = ModbusRegisters::connect(address, &map).unwrap();
            MappedSource::new(Box::new(messages), &map, true)
        };
        let why = open(&device(|_, _, _| vec![0x83, 2])).err().unwrap().to_string();
        assert!(why.contains("register 3000: the device refuses, with error 2"), "{why}");
        // The second message is refused, which is skipped; then the device stops.
        let asked = std::sync::atomic::AtomicU32::new(0);
        let address = device(move |_, _, count| match asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) {
            2 => vec![0x83, 6],
            0..5 => registers(count, |at| at as i16),
            _ => panic!("it is switched off"),
        });
        let mut source = open(&address).unwrap();
        let mut frame = Frame::default();
        assert!(source.next_frame(&mut frame).unwrap() && source.next_frame(&mut frame).unwrap());
        let why = source.next_frame(&mut frame).unwrap_err().to_string();
        assert!(why.contains("the device has closed the connection") || why.contains("reset"), "{why}");
        assert_eq!(source.losses().len(), 1, "{:?}", source.losses());
    }

    #[test]
    fn a_place_and_a_map_are_checked_before_anything_is_read() {
        assert_eq!(place_of("hand").unwrap(), ("hand:502".to_owned(), 1));
        assert_eq!(place_of("192.168.11.210:6000/2").unwrap(), ("192.168.11.210:6000".to_owned(), 2));
        for wrong in ["", ":6000", "hand:0", "hand:x", "hand/256", "hand/"] {
            assert!(place_of(wrong).unwrap_err().is_usage(), "{wrong}");
        }
        for (map, says) in [
            ("values = 'tip'", "registers: name them"),
            ("values = 'palm'\nregisters = { tip = [0, 1] }", "registers: there is no `palm`; it is one of tip"),
            ("values = 'tip'\ntime = 't'\nregisters = { tip = [0, 1] }", "registers have neither a time"),
        ] {
            let why = ModbusRegisters::connect("127.0.0.1:1", &ArrayMap::parse(map).unwrap()).err().unwrap();
            assert!(why.is_usage() && why.to_string().contains(says), "{map}: {why}");
        }
        for wrong in ["{ tip = [0, 0] }", "{ tip = [0, 126] }", "{ tip = [65535, 2] }"] {
            let why = ArrayMap::parse(&format!("values = 'tip'\nregisters = {wrong}")).unwrap_err().to_string();
            assert!(why.contains("registers: `tip`"), "{why}");
        }
    }

    #[test]
    fn a_hand_by_its_name_has_all_its_pads() {
        // As the maker's own reader has it: 18 bytes are 9 registers, and the next pad begins 18 on.
        let address = device(|_, first, count| registers(count, |at| (i32::from(first) - 3000 + i32::from(at)) as i16));
        let map = ArrayMap::named("inspire").unwrap();
        let mut messages = ModbusRegisters::connect(&address, &map).unwrap();
        let mut values = Vec::new();
        messages.next(&mut values).unwrap();
        assert_eq!(values.len(), 5 * (9 + 96) + 4 * 80 + 96 + 9 + 112);
        assert_eq!(
            [0, 8, 9, 105].map(|at: usize| values[at].number()),
            [Some(0.0), Some(8.0), Some(18.0), Some(210.0)]
        );
        assert_eq!(values.last().unwrap().number(), Some(1900.0 + 111.0));
    }
}
