//! Reads what is wanted of a message in CDR, by the definition of its type.

use super::definition::{Base, Field, Many};
use super::plan::{Plan, Take, Want};
use crate::error::{Error, failed};
use crate::source::{Dimension, Lies, order};

/// The deepest that messages may lie within each other.
const MAX_DEPTH: usize = 32;
/// Bytes that writers may put behind a message.
const MAX_PADDING: usize = 7;

/// Why nothing comes of a message.
#[derive(Debug, PartialEq)]
pub(in crate::robot) enum Trouble {
    /// It is not as long as its definition says.
    Damaged,
    /// It has not what the map says.
    Wrong(Error),
}

/// A time in a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::robot) enum Stamp {
    /// A stamp, ns.
    Ns(i64),
    /// A number.
    Number(f64),
}

/// What was taken of a message.
#[derive(Debug, Default)]
pub(in crate::robot) struct Taken {
    /// The numbers of each path.
    pub(in crate::robot) values: Vec<Vec<f64>>,
    /// How many values each array has, and the sensors' names, where these are read.
    pub(in crate::robot) counts: Vec<usize>,
    pub(in crate::robot) names: Vec<String>,
    pub(in crate::robot) time: Option<Stamp>,
    /// How the values of an array with a layout lie.
    pub(in crate::robot) lies: Option<Lies>,
    /// The last layout, and where its values are in their order.
    known: Option<(Vec<Dimension>, usize, usize, Vec<usize>)>,
    numbers: Vec<f64>,
}

type Walked<T> = Result<T, Trouble>;

/// Bytes of a message being read.
struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big: bool,
}

impl<'a> Cdr<'a> {
    fn new(message: &'a [u8]) -> Option<Self> {
        let (header, bytes) = message.split_at_checked(4)?;
        // Plain CDR in either order of bytes; the last two bytes are options.
        (header[0] == 0 && header[1] <= 1).then_some(Self { bytes, at: 0, is_big: header[1] == 0 })
    }

    fn take(&mut self, count: usize) -> Walked<&'a [u8]> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end)).ok_or(Trouble::Damaged)?;
        self.at += count;
        Ok(taken)
    }

    /// `count` numbers of `size` bytes.
    fn numbers(&mut self, size: usize, count: usize) -> Walked<&'a [u8]> {
        if count == 0 {
            return Ok(&[]);
        }
        self.at = self.at.next_multiple_of(size);
        self.take(size.checked_mul(count).ok_or(Trouble::Damaged)?)
    }

    fn number(&mut self, base: Base) -> Walked<f64> {
        let size = base.size().ok_or(Trouble::Damaged)?;
        self.numbers(size, 1).map(|bytes| number(base, bytes, self.is_big))
    }

    fn length(&mut self) -> Walked<usize> {
        self.number(Base::U32).map(|length| length as usize)
    }

    /// A text without the zero at its end.
    fn text(&mut self) -> Walked<&'a [u8]> {
        let length = self.length()?;
        let text = self.take(length)?;
        Ok(text.strip_suffix(&[0]).unwrap_or(text))
    }
}

/// The number of `base` that `bytes` are.
fn number(base: Base, bytes: &[u8], is_big: bool) -> f64 {
    macro_rules! read {
        ($type:ty) => {{
            let mut own = [0; size_of::<$type>()];
            own.copy_from_slice(bytes);
            if is_big { <$type>::from_be_bytes(own) } else { <$type>::from_le_bytes(own) }
        }};
    }
    match base {
        Base::Bool | Base::U8 => f64::from(bytes[0]),
        Base::I8 => f64::from(bytes[0] as i8),
        Base::U16 => f64::from(read!(u16)),
        Base::I16 => f64::from(read!(i16)),
        Base::U32 => f64::from(read!(u32)),
        Base::I32 => f64::from(read!(i32)),
        Base::U64 => read!(u64) as f64,
        Base::I64 => read!(i64) as f64,
        Base::F32 => f64::from(read!(f32)),
        Base::F64 => read!(f64),
        Base::Text | Base::WideText | Base::Message(_) => f64::NAN,
    }
}

impl Plan {
    /// Takes what is wanted of `message` into `taken`, in place of what that holds.
    pub(in crate::robot) fn read(&self, message: &[u8], taken: &mut Taken) -> Walked<()> {
        taken.values.resize_with(self.paths, Vec::new);
        taken.values.iter_mut().for_each(Vec::clear);
        taken.time = None;
        taken.counts.clear();
        taken.names.clear();
        let mut walk = Walk { plan: self, cdr: Cdr::new(message).ok_or(Trouble::Damaged)?, taken };
        walk.one(Base::Message(0), Some(&self.want), 0)?;
        let left = walk.cdr.bytes.len() - walk.cdr.at;
        if self.is_whole && left > MAX_PADDING {
            let what = "its definition is of another version of the message";
            return Err(Trouble::Wrong(failed!("{left} bytes of it are left over; {what}")));
        }
        Ok(())
    }
}

struct Walk<'a> {
    plan: &'a Plan,
    cdr: Cdr<'a>,
    taken: &'a mut Taken,
}

impl Walk<'_> {
    fn field(&mut self, field: &Field, want: Option<&Want>, depth: usize) -> Walked<()> {
        let base = field.base;
        let count = match field.many {
            Many::One => return self.one(base, want, depth),
            Many::Array(count) => count,
            Many::Sequence => self.cdr.length()?,
        };
        let is_there = |want: &Want| {
            let over = want.items.iter().find(|(_, end, _)| *end != usize::MAX && *end > count);
            over.map_or(Ok(()), |(_, end, _)| {
                Err(Trouble::Wrong(failed!("`{}` has {count} items, and [{}] is asked for", field.name, end - 1)))
            })
        };
        want.map_or(Ok(()), is_there)?;
        let Some(size) = base.size() else {
            // Each item has at least a byte, so that a length that is wrong takes no time.
            if count > self.cdr.bytes.len().saturating_sub(self.cdr.at) {
                return Err(Trouble::Damaged);
            }
            return (0..count).try_for_each(|index| self.one(base, want.and_then(|want| want.item(index)), depth));
        };
        let bytes = self.cdr.numbers(size, count)?;
        let Some(want) = want else { return Ok(()) };
        if let Some(Take::Values(path)) = want.take {
            return self.numbers(base, bytes, path);
        }
        for (first, end, own) in &want.items {
            let end = (*end).min(count);
            match own.take {
                Some(Take::Values(path)) if *first < end => {
                    self.numbers(base, &bytes[first * size..end * size], path)?;
                }
                Some(Take::Time) if *first < end => {
                    let own = &bytes[first * size..(first + 1) * size];
                    self.taken.time = Some(Stamp::Number(number(base, own, self.cdr.is_big)));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Takes the numbers of `base` that `bytes` are, for the path of number `path`.
    fn numbers(&mut self, base: Base, bytes: &[u8], path: usize) -> Walked<()> {
        let to = &mut self.taken.values[path];
        let before = to.len();
        match (self.plan.decoder, base.size()) {
            (Some(decoder), _) => decoder.bytes(bytes, |number| to.push(number)).map_err(Trouble::Wrong)?,
            (None, Some(size)) => {
                let is_big = self.cdr.is_big;
                to.extend(bytes.chunks_exact(size).map(|bytes| number(base, bytes, is_big)));
            }
            (None, None) => {}
        }
        self.taken.counts.push(self.taken.values[path].len() - before);
        Ok(())
    }

    fn one(&mut self, base: Base, want: Option<&Want>, depth: usize) -> Walked<()> {
        let take = want.and_then(|want| want.take);
        match base {
            Base::Text => {
                let text = self.cdr.text()?;
                match (take, self.plan.decoder) {
                    (Some(Take::Values(path)), Some(decoder)) => {
                        let to = &mut self.taken.values[path];
                        let before = to.len();
                        let text = std::str::from_utf8(text).map_err(|_| Trouble::Damaged)?;
                        decoder.text(text, |number| to.push(number)).map_err(Trouble::Wrong)?;
                        self.taken.counts.push(self.taken.values[path].len() - before);
                        Ok(())
                    }
                    (Some(Take::Name), _) => {
                        self.taken.names.push(String::from_utf8_lossy(text).into_owned());
                        Ok(())
                    }
                    _ => Ok(()),
                }
            }
            Base::WideText => {
                Err(Trouble::Wrong(Error::failed("it has a wstring, which writers write differently; it is not read")))
            }
            Base::Message(number) => self.message(number, want, depth),
            number => {
                let value = self.cdr.number(number)?;
                match take {
                    Some(Take::Values(path)) => {
                        self.taken.values[path].push(value);
                        self.taken.counts.push(1);
                    }
                    Some(Take::Time) => self.taken.time = Some(Stamp::Number(value)),
                    Some(Take::Name) | None => {}
                }
                Ok(())
            }
        }
    }

    fn message(&mut self, number: usize, want: Option<&Want>, depth: usize) -> Walked<()> {
        if depth > MAX_DEPTH {
            return Err(Trouble::Damaged);
        }
        let plan = self.plan;
        let own = plan.definition.of(number);
        if want.is_some_and(|want| want.take == Some(Take::Time)) {
            // Their types were looked at.
            let (seconds, ns) = (self.cdr.number(own.fields[0].base)?, self.cdr.number(own.fields[1].base)?);
            self.taken.time = Some(Stamp::Ns(seconds as i64 * 1_000_000_000 + ns as i64));
            return Ok(());
        }
        if own.fields.is_empty() {
            // Such a message has a byte all the same.
            return self.cdr.take(1).map(drop);
        }
        let of_data = want.and_then(|want| want.fields.get(&1)).and_then(|want| want.take);
        if let (true, Some(Take::Values(path))) = (plan.laid_out[number], of_data) {
            return self.laid_out(own.fields[1].base, path);
        }
        let fields = own.fields.iter().enumerate();
        fields
            .map(|(at, field)| (field, want.and_then(|want| want.fields.get(&at))))
            .try_for_each(|(field, want)| self.field(field, want, depth + 1))
    }

    /// Takes the values of an array with a layout, row by row.
    fn laid_out(&mut self, base: Base, path: usize) -> Walked<()> {
        let mut dimensions = Vec::new();
        for _ in 0..self.cdr.length()? {
            let label = String::from_utf8_lossy(self.cdr.text()?).into_owned();
            dimensions.push(Dimension { label, size: self.cdr.length()?, stride: self.cdr.length()? });
        }
        let offset = self.cdr.length()?;
        let count = self.cdr.length()?;
        let size = base.size().ok_or(Trouble::Damaged)?;
        let bytes = self.cdr.numbers(size, count)?;
        if self.plan.decoder.is_some() {
            return self.numbers(base, bytes.get(offset * size..).unwrap_or_default(), path);
        }
        let is_known = |known: &(Vec<Dimension>, usize, usize, Vec<usize>)| {
            known.0 == dimensions && (known.1, known.2) == (offset, count)
        };
        if !self.taken.known.as_ref().is_some_and(is_known) {
            let (places, lies) = order(&dimensions, offset, count).map_err(Trouble::Wrong)?;
            self.taken.lies = Some(lies);
            self.taken.known = Some((dimensions, offset, count, places));
        }
        let is_big = self.cdr.is_big;
        let Taken { values, counts, numbers, known, .. } = &mut *self.taken;
        numbers.clear();
        numbers.extend(bytes.chunks_exact(size).map(|bytes| number(base, bytes, is_big)));
        let places = known.iter().flat_map(|(.., places)| places);
        let before = values[path].len();
        values[path].extend(places.filter_map(|&place| numbers.get(place)));
        counts.push(values[path].len() - before);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
