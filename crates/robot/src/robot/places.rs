//! Frames from messages of ROS 2: a cloud of points, or numbers in the order of the body's taxels.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::messages::{Float32MultiArray, Message as _, PointCloud2, PointField};
use crate::body::{Body, Modality, Taxel};
use crate::error::{Error, Result, failed};
use crate::signal::{Axis, Channel, Frame, FrameTime, RawValue};

/// The types of messages that frames are read from.
pub(super) const FRAME_TYPES: [&str; 2] = [PointCloud2::TYPE, Float32MultiArray::TYPE];
/// Fields of a point that are its raw value, the first that is there; and those that are its taxel's id. Of a taxel with three axes the
/// tangential ones are called as the raw value with `_u` and `_v`, or `force_u` and `force_v`. Taxels of other kinds have a field of their
/// own where there is one: °C, and mm, as values without a calibration are.
const VALUE_FIELDS: [&str; 5] = ["value", "raw", "force", "pressure", "intensity"];
const ID_FIELDS: [&str; 2] = ["taxel", "id"];
const TEMPERATURE_FIELD: &str = "temperature";
const DISTANCE_FIELD: &str = "distance_mm";

/// That messages of the type `kind` are not frames.
pub(super) fn not_read(kind: &str) -> Error {
    failed!(
        "its messages are {kind}; frames are read from {}, and from arrays in others with --map",
        FRAME_TYPES.join(" and ")
    )
}

/// Where the values of messages go in a frame of a body.
pub(super) struct Places {
    /// The channels of a frame: first the taxels' own, in the body's order.
    ids: Vec<u32>,
    index_of: HashMap<u32, usize>,
    /// By taxel, what it measures, and where its tangential values are, if it has three axes.
    kinds: Vec<Modality>,
    tangential: Vec<Option<[usize; 2]>>,
    /// By link, its taxels in the body's order.
    of_link: BTreeMap<String, Vec<usize>>,
    all: Vec<usize>,
    /// All channels, those of a taxel side by side.
    side_by_side: Vec<usize>,
    body: String,
    /// Frames of coordinates that clouds may be in: the body's links, and others that were reported.
    frames: BTreeSet<String>,
    /// What is odd about messages, a line each.
    pub(super) notices: Vec<String>,
}

impl Places {
    pub(super) fn new(body: &Body) -> Self {
        let ids = Channel::all_of(body);
        let mut of_link: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (index, taxel) in body.taxels.iter().enumerate() {
            of_link.entry(body.links[taxel.link].name.clone()).or_default().push(index);
        }
        let index_of: HashMap<u32, usize> = ids.iter().enumerate().map(|(index, id)| (*id, index)).collect();
        let place = |id: u32, axis: Axis| index_of.get(&Channel::of_taxel(id, axis).0).copied();
        let both = |taxel: &Taxel| Some([place(taxel.id, Axis::U)?, place(taxel.id, Axis::V)?]);
        let tangential = body.taxels.iter().map(both).collect();
        let kinds = body.taxels.iter().map(|taxel| taxel.modality).collect();
        let mut side_by_side = ids.clone();
        Channel::side_by_side(&mut side_by_side);
        let side_by_side = side_by_side.iter().map(|id| index_of[id]).collect();
        let frames = body.links.iter().map(|link| link.name.clone()).collect();
        let all = (0..body.taxels.len()).collect();
        let body = body.name.clone();
        Self { all, side_by_side, ids, index_of, kinds, tangential, of_link, body, frames, notices: Vec::new() }
    }

    /// The channels of a frame's values, in their order: all of the body.
    pub(super) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Empties `frame`: every value is missing.
    fn empty(&self, frame: &mut Frame) {
        frame.clear();
        frame.values.resize(self.ids.len(), RawValue::MISSING);
    }

    /// Puts the values of a cloud into `frame`, in place of what that holds, with the time `time`.
    ///
    /// # Errors
    /// As [`Places::points`].
    pub(super) fn cloud(&mut self, cloud: &PointCloud2, time: FrameTime, frame: &mut Frame) -> Result<()> {
        self.empty(frame);
        frame.set_time(time);
        self.points(cloud, |index, value| frame.values[index] = value)
    }

    /// Gives `put` the index in a frame and the value of each point of a cloud.
    ///
    /// # Errors
    /// Its points are not taxels of the body, or do not fit its bytes.
    pub(super) fn points(&mut self, cloud: &PointCloud2, mut put: impl FnMut(usize, RawValue)) -> Result<()> {
        let points = cloud.width as usize * cloud.height as usize;
        let named =
            |names: &[&str]| names.iter().find_map(|name| cloud.fields.iter().find(|field| field.name == *name));
        let Some(value) = named(&VALUE_FIELDS) else {
            let fields: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
            return Err(failed!("its points have {}; name the raw value `value`", fields.join(", ")));
        };
        let points_of = Points::new(cloud, value)?;
        let id = named(&ID_FIELDS);
        if id.is_some() {
            self.look_at_frame(&cloud.header.frame_id);
        }
        let mut put = |taxel: usize, point: usize| {
            match points_of.own_column(self.kinds[taxel]) {
                Some(column) => column.value_if_there(point).into_iter().for_each(|value| put(taxel, value)),
                None => put(taxel, RawValue::new(points_of.value.at(point))),
            }
            if let (Some(columns), Some(places)) = (&points_of.tangential, self.tangential[taxel]) {
                for (column, place) in columns.iter().zip(places) {
                    column.value_if_there(point).into_iter().for_each(|value| put(place, value));
                }
            }
        };
        if let Some(id) = id {
            let id = Column::new(cloud, id)?;
            let mut unknown = Vec::new();
            for point in 0..points {
                let own = id.at(point);
                let taxel = self.index_of.get(&(own as u32)).filter(|&&index| index < self.all.len());
                match taxel.filter(|_| own == f64::from(own as u32)) {
                    Some(&taxel) => put(taxel, point),
                    None => unknown.push(own),
                }
            }
            return match unknown.first() {
                None => Ok(()),
                Some(first) => Err(failed!(
                    "{} of {points} points are of taxels that the body does not have, taxel {first} first; give the body that \
                     has them",
                    unknown.len()
                )),
            };
        }
        let link = cloud.header.frame_id.trim_start_matches('/');
        let own = self.of_link.get(link);
        let taxels = [own, Some(&self.all)].into_iter().flatten().find(|taxels| taxels.len() == points);
        let Some(taxels) = taxels else {
            let of_link = own.map_or_else(
                || format!("the body has no taxels on a link `{link}`"),
                |taxels| format!("link `{link}` has {} taxels", taxels.len()),
            );
            return Err(failed!(
                "a cloud has {points} points, and {of_link} and {} in all; give each point its taxel's id as a field `taxel`",
                self.all.len()
            ));
        };
        taxels.iter().enumerate().for_each(|(point, &taxel)| put(taxel, point));
        Ok(())
    }

    /// Tells once of clouds that are in the frame of no link: they may be of another robot, whose ids fit.
    fn look_at_frame(&mut self, frame_id: &str) {
        let link = frame_id.trim_start_matches('/');
        if !link.is_empty() && !self.frames.contains(link) {
            self.frames.insert(link.to_owned());
            let body = &self.body;
            self.notices
                .push(format!("clouds are in frame `{link}`, which is not a link of {body}; is it the right body?"));
        }
    }

    /// Puts the numbers of an array into `frame`, in place of what that holds, with the time `time` at which it came: one for each taxel,
    /// or of those with three axes three side by side.
    ///
    /// # Errors
    /// It has another number of them.
    pub(super) fn array(&self, array: &Float32MultiArray, time: FrameTime, frame: &mut Frame) -> Result<()> {
        self.empty(frame);
        frame.set_time(time);
        let values = array.data.get(array.layout.data_offset as usize..).unwrap_or_default();
        let places = [&self.all, &self.side_by_side].into_iter().find(|places| places.len() == values.len());
        let Some(places) = places else {
            let (values, taxels) = (values.len(), self.all.len());
            let axes = match self.ids.len() {
                all if all > taxels => format!(", or {all} with all axes of each side by side"),
                _ => String::new(),
            };
            return Err(failed!(
                "an array has {values} numbers, and the body {taxels} taxels; send one for each{axes}, in the body's order (somatic \
                 inspect BODY --json lists them)"
            ));
        };
        for (&place, value) in places.iter().zip(values) {
            frame.values[place] = RawValue::new(f64::from(*value));
        }
        Ok(())
    }
}

/// The values of all points.
struct Points<'a> {
    value: Column<'a>,
    /// Along u and v.
    tangential: Option<[Column<'a>; 2]>,
    temperature: Option<Column<'a>>,
    distance: Option<Column<'a>>,
}

impl<'a> Points<'a> {
    /// Of `cloud`, whose field `value` is the raw value.
    fn new(cloud: &'a PointCloud2, value: &'a PointField) -> Result<Self> {
        let named = |name: &str| cloud.fields.iter().find(|field| field.name == name);
        let both = |stem: &str| Some([named(&format!("{stem}_u"))?, named(&format!("{stem}_v"))?]);
        let column = |name: &str| named(name).map(|field| Column::new(cloud, field)).transpose();
        let tangential = match both(&value.name).or_else(|| both("force")) {
            Some([u, v]) => Some([Column::new(cloud, u)?, Column::new(cloud, v)?]),
            None => None,
        };
        let [temperature, distance] = [TEMPERATURE_FIELD, DISTANCE_FIELD].map(column);
        Ok(Self { value: Column::new(cloud, value)?, tangential, temperature: temperature?, distance: distance? })
    }

    /// The field that taxels of `kind` have in place of the raw value.
    fn own_column(&self, kind: Modality) -> Option<&Column<'a>> {
        match kind {
            Modality::Temperature => self.temperature.as_ref(),
            Modality::Proximity => self.distance.as_ref(),
            _ => None,
        }
    }
}

/// A field of all points.
struct Column<'a> {
    data: &'a [u8],
    offset: usize,
    /// Points of a row, and the bytes of a row and of a point.
    width: usize,
    row_step: usize,
    point_step: usize,
    is_big: bool,
    datatype: u8,
}

impl<'a> Column<'a> {
    fn new(cloud: &'a PointCloud2, field: &PointField) -> Result<Self> {
        let size = match field.datatype {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            8 => 8,
            other => return Err(failed!("field `{}` has datatype {other}; ROS has 1 to 8", field.name)),
        };
        let column = Self {
            data: &cloud.data,
            offset: field.offset as usize,
            width: cloud.width as usize,
            row_step: cloud.row_step as usize,
            point_step: cloud.point_step as usize,
            is_big: cloud.is_bigendian,
            datatype: field.datatype,
        };
        let ends = |height: usize| {
            let row = height.checked_sub(1)?.checked_mul(column.row_step)?;
            let point = column.width.checked_sub(1)?.checked_mul(column.point_step)?;
            row.checked_add(point)?.checked_add(column.offset)?.checked_add(size)
        };
        let points = column.width.checked_mul(cloud.height as usize);
        let is_whole = points == Some(0) || ends(cloud.height as usize).is_some_and(|end| end <= cloud.data.len());
        if is_whole && points.is_some() {
            return Ok(column);
        }
        Err(failed!(
            "a cloud of {} × {} points of {} bytes has {} bytes; field `{}` does not fit",
            cloud.width,
            cloud.height,
            cloud.point_step,
            cloud.data.len(),
            field.name
        ))
    }

    /// The value of a field that not every point has; NaN stands for none.
    fn value_if_there(&self, point: usize) -> Option<RawValue> {
        Some(self.at(point)).filter(|number| !number.is_nan()).map(RawValue::new)
    }

    fn at(&self, point: usize) -> f64 {
        let (row, column) = (point / self.width, point % self.width);
        let bytes = &self.data[row * self.row_step + column * self.point_step + self.offset..];
        macro_rules! number {
            ($type:ty) => {{
                let mut own = [0; size_of::<$type>()];
                own.copy_from_slice(&bytes[..size_of::<$type>()]);
                f64::from(if self.is_big { <$type>::from_be_bytes(own) } else { <$type>::from_le_bytes(own) })
            }};
        }
        match self.datatype {
            1 => number!(i8),
            2 => number!(u8),
            3 => number!(i16),
            4 => number!(u16),
            5 => number!(i32),
            6 => number!(u32),
            7 => number!(f32),
            _ => number!(f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Sheet, SheetCell, sheets};
    use crate::bundled;
    use crate::robot::messages::{Header, Time};

    fn places() -> (Places, Body) {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        (Places::new(&body), body)
    }

    fn cloud(frame_id: &str, fields: &[(&str, u32, u8)], point_step: u32, data: Vec<u8>) -> PointCloud2 {
        let field = |(name, offset, datatype): &(&str, u32, u8)| PointField {
            name: (*name).to_owned(),
            offset: *offset,
            datatype: *datatype,
            count: 1,
        };
        let stamp = Time { sec: 7, nanosec: 500_000_000 };
        PointCloud2 {
            header: Header { stamp, frame_id: frame_id.to_owned() },
            height: 1,
            width: data.len() as u32 / point_step,
            fields: fields.iter().map(field).collect(),
            point_step,
            row_step: data.len() as u32,
            data,
            ..PointCloud2::default()
        }
    }

    fn read(places: &mut Places, cloud: &PointCloud2) -> Result<Frame> {
        let mut frame = Frame::missing(0.0, places.ids.len());
        places.cloud(cloud, cloud.header.stamp.frame_time(), &mut frame).map(|()| frame)
    }

    #[test]
    fn points_with_ids_go_to_their_taxels() {
        let (mut places, _) = places();
        let (first, last) = (places.ids[0], *places.ids.last().unwrap());
        let mut data = Vec::new();
        for (id, value) in [(last, 2.5_f32), (first, f32::NAN)] {
            data.extend((id as u16).to_be_bytes());
            data.extend(value.to_be_bytes());
        }
        let mut cloud = cloud("anywhere", &[("taxel", 0, 4), ("value", 2, 7)], 6, data);
        cloud.is_bigendian = true;
        let frame = read(&mut places, &cloud).unwrap();
        assert_eq!(frame.t_s, 7.5);
        assert_eq!(frame.values.last().unwrap().number(), Some(2.5));
        assert_eq!(frame.values[0], RawValue::FAULTY);
        assert!(frame.values[1..places.ids.len() - 1].iter().all(|value| value.is_missing()));
        cloud.is_bigendian = false;
        let why = read(&mut places, &cloud).unwrap_err().to_string();
        assert!(why.contains("of 2 points"), "{why}");
    }

    #[test]
    fn points_without_ids_are_the_links_or_all_in_order_or_refused_with_counts() {
        let (mut places, body) = places();
        let (link, taxels) = places.of_link.clone().into_iter().next().unwrap();
        let floats = |count: usize| (0..count).flat_map(|at| (at as f32).to_le_bytes()).collect::<Vec<u8>>();
        let field = [("pressure", 0, 7)];
        let frame = read(&mut places, &cloud(&link, &field, 4, floats(taxels.len()))).unwrap();
        for (at, &index) in taxels.iter().enumerate() {
            assert_eq!(frame.values[index].number(), Some(at as f64));
        }
        let all = body.taxels.len();
        let frame = read(&mut places, &cloud("map", &field, 4, floats(all))).unwrap();
        assert!(frame.values.iter().enumerate().all(|(at, value)| value.number() == Some(at as f64)));
        let why = read(&mut places, &cloud(&link, &field, 4, floats(all + 1))).unwrap_err().to_string();
        assert!(
            why.contains(&format!("{} points", all + 1)) && why.contains(&format!("{} taxels", taxels.len())),
            "{why}"
        );
        let why =
            read(&mut places, &cloud(&link, &[("x", 0, 7), ("y", 0, 7)], 4, floats(all))).unwrap_err().to_string();
        assert!(why.contains("have x, y"), "{why}");
    }

    /// A pad of three taxels, of which 4 and 6 have three axes.
    fn pad() -> Places {
        let cell =
            |id: u32| SheetCell::rectangle(id, [0.01 * f64::from(id), 0.0], 0.01, 0.01).with_axes(id.is_multiple_of(2));
        let sheet = Sheet::new("pad", [4, 5, 6].map(cell).to_vec());
        Places::new(&Body::from_bytes("pad", &sheets(&[sheet]).unwrap().to_bytes().unwrap()).unwrap())
    }

    #[test]
    fn tangential_values_go_beside_those_along_the_normal() {
        let mut places = pad();
        let names: Vec<String> = places.ids.iter().map(|&id| Channel(id).to_string()).collect();
        assert_eq!(names, ["4", "5", "6", "4.u", "6.u", "4.v", "6.v"]);
        let data: Vec<u8> = (0..9_u8).flat_map(|number| f32::from(number).to_le_bytes()).collect();
        for names in
            [["value", "value_u", "value_v"], ["force", "force_u", "force_v"], ["pressure", "force_u", "force_v"]]
        {
            let fields = [(names[0], 0, 7), (names[1], 4, 7), (names[2], 8, 7)];
            let frame = read(&mut places, &cloud("pad", &fields, 12, data.clone())).unwrap();
            let values: Vec<Option<f64>> = frame.values.iter().map(|value| value.number()).collect();
            // The one of taxel 5 has no place.
            assert_eq!(values, [0.0, 3.0, 6.0, 1.0, 7.0, 2.0, 8.0].map(Some), "{names:?}");
        }
        let plain = read(&mut places, &cloud("pad", &[("value", 0, 7), ("value_u", 4, 7)], 12, data)).unwrap();
        assert!(plain.values[3..].iter().all(|value| value.is_missing()));
        let mut frame = Frame::missing(0.0, 7);
        let mut array = Float32MultiArray { data: (0..7_u8).map(f32::from).collect(), ..Float32MultiArray::default() };
        places.array(&array, 0.0.into(), &mut frame).unwrap();
        let values: Vec<Option<f64>> = frame.values.iter().map(|value| value.number()).collect();
        assert_eq!(values, [0.0, 3.0, 4.0, 1.0, 5.0, 2.0, 6.0].map(Some));
        array.data.truncate(3);
        places.array(&array, 0.0.into(), &mut frame).unwrap();
        assert!(frame.values[2].number() == Some(2.0) && frame.values[3].is_missing());
        array.data.truncate(2);
        let why = places.array(&array, 0.0.into(), &mut frame).unwrap_err().to_string();
        assert!(why.contains("3 taxels; send one for each, or 7 with all axes"), "{why}");
    }

    #[test]
    fn taxels_of_other_kinds_have_fields_of_their_own() {
        let body = Body::from_bytes("hand", bundled::SENSING_HAND).unwrap();
        let mut places = Places::new(&body);
        let of = |kind: Modality| body.taxels.iter().position(|taxel| taxel.modality == kind).unwrap();
        let kinds = [Modality::Force3, Modality::Temperature, Modality::Proximity];
        let own = kinds.map(of);
        let mut data = Vec::new();
        for (index, taxel) in own.into_iter().enumerate() {
            data.extend_from_slice(&body.taxels[taxel].id.to_le_bytes());
            // Each has what is its own, and the pressed one nothing along v.
            let numbers = [
                [7.5, 0.5, f32::NAN, f32::NAN, f32::NAN],
                [f32::NAN, f32::NAN, f32::NAN, 36.5, f32::NAN],
                [f32::NAN, f32::NAN, f32::NAN, f32::NAN, 12.0],
            ];
            numbers[index].iter().for_each(|number| data.extend_from_slice(&number.to_le_bytes()));
        }
        let names = ["taxel", "pressure", "pressure_u", "pressure_v", "temperature", "distance_mm"];
        let mut fields: Vec<(&str, u32, u8)> =
            names.iter().enumerate().map(|(at, name)| (*name, 4 * at as u32, if at == 0 { 6 } else { 7 })).collect();
        let frame = read(&mut places, &cloud("palm", &fields, 24, data.clone())).unwrap();
        assert_eq!(own.map(|taxel| frame.values[taxel].number()), [7.5, 36.5, 12.0].map(Some));
        let [u, v] = places.tangential[own[0]].unwrap();
        assert_eq!(frame.values[u].number(), Some(0.5));
        assert!(frame.values[v].is_missing());
        assert_eq!(frame.values.iter().filter(|value| !value.is_missing()).count(), 4);
        // Without those fields the raw value is that of all taxels, and NaN is not a number.
        fields.truncate(4);
        let frame = read(&mut places, &cloud("palm", &fields, 24, data)).unwrap();
        assert_eq!(frame.values[own[1]], RawValue::FAULTY);
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let (mut places, _) = places();
        let whole = cloud("map", &[("value", 0, 7)], 4, vec![0; 4 * places.ids.len()]);
        assert!(read(&mut places, &whole).is_ok());
        let mut refused = |change: &dyn Fn(&mut PointCloud2)| {
            let mut other = whole.clone();
            change(&mut other);
            read(&mut places, &other).unwrap_err().to_string()
        };
        assert!(refused(&|cloud| cloud.data.truncate(9)).contains("does not fit"));
        assert!(refused(&|cloud| cloud.fields[0].offset = u32::MAX).contains("does not fit"));
        assert!(refused(&|cloud| cloud.point_step = u32::MAX).contains("does not fit"));
        assert!(refused(&|cloud| (cloud.width, cloud.height) = (u32::MAX, u32::MAX)).contains("does not fit"));
        assert!(refused(&|cloud| cloud.fields[0].datatype = 9).contains("datatype 9"));
        assert!(refused(&|cloud| cloud.width = 0).contains("0 points"));
    }

    #[test]
    fn arrays_are_in_the_bodys_order_and_as_long() {
        let (places, _) = places();
        let mut frame = Frame::missing(0.0, places.ids.len());
        let mut array = Float32MultiArray { data: vec![1.5; places.ids.len() + 1], ..Float32MultiArray::default() };
        let why = places.array(&array, 7.5.into(), &mut frame).unwrap_err().to_string();
        assert!(
            why.contains(&format!("has {} numbers, and the body {}", places.ids.len() + 1, places.ids.len())),
            "{why}"
        );
        array.layout.data_offset = 1;
        places.array(&array, 7.5.into(), &mut frame).unwrap();
        assert!(frame.values.iter().all(|value| value.number() == Some(1.5)) && frame.t_s == 7.5);
        array.layout.data_offset = u32::MAX;
        assert!(places.array(&array, 7.5.into(), &mut frame).is_err());
    }
}
