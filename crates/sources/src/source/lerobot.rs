//! LeRobot datasets, v2.1 and v3.0: tables in Parquet, each with an episode or several, one after the other.

use std::fs::File;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray as _;
use arrow_array::types::{
    ArrowPrimitiveType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};
use serde::Deserialize;
use serde_json::Map;

use super::Source;
use super::lerobot_name::LeRobotName;
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_METADATA_BYTES};
use crate::signal::{Channel, Frame, RawValue};

/// Rows that are unpacked at once.
const BATCH_ROWS: usize = 1 << 10;

/// Words in the names of features of touch.
const TOUCH: [&str; 7] = ["tactile", "touch", "taxel", "pressure", "fsr", "haptic", "skin"];

/// What percepts are called that Python has added to a dataset: they are not touch again.
const PERCEPTS: &str = "observation.percepts";

/// The columns beside the feature.
const TIME: &str = "timestamp";
const EPISODE: &str = "episode_index";

/// `meta/info.json`.
#[derive(Deserialize)]
struct Info {
    codebase_version: String,
    features: Map<String, serde_json::Value>,
    #[serde(default)]
    total_episodes: Option<u64>,
}

#[derive(Deserialize)]
struct Feature {
    dtype: String,
    shape: Vec<usize>,
}

/// A feature of numbers, and how many a frame has.
struct Numeric {
    name: String,
    shape: Vec<usize>,
}

impl Numeric {
    fn width(&self) -> Option<usize> {
        self.shape.iter().try_fold(1_usize, |all, &size| all.checked_mul(size)).filter(|&width| width > 0)
    }
}

/// Episodes of a LeRobot dataset. The times of each are seconds since its beginning.
pub struct LeRobotSource {
    /// The dataset's folder.
    name: String,
    feature: String,
    width: usize,
    taxels: Vec<u32>,
    episode: Option<u64>,
    tables: Vec<PathBuf>,
    /// How many tables have been begun.
    begun: usize,
    reader: Option<ParquetRecordBatchReader>,
    rows: Rows,
    at: usize,
    frames: u64,
    notices: Vec<String>,
}

somatic_skin::debug_by_name!(LeRobotSource);

/// Rows of a table.
#[derive(Default)]
struct Rows {
    times_s: Vec<f64>,
    episodes: Vec<f64>,
    /// By row, then by place in the feature.
    values: Vec<RawValue>,
}

impl LeRobotSource {
    /// Opens the dataset `name` for a body with the taxels `ids`: each value of the feature is one of them, in ascending order.
    ///
    /// # Errors
    /// It cannot be read, has no feature of touch or several, or not as many values as there are taxels.
    pub fn open(name: &LeRobotName, ids: &[u32]) -> Result<Self> {
        let place = name.path.display().to_string();
        let info = info_of(name)?;
        let feature = feature_of(&info, name.feature.as_deref()).map_err(|e| e.at(&place))?;
        let width = feature.width();
        let width =
            width.ok_or_else(|| failed!("feature `{}` has no values; name another one", feature.name).at(&place))?;
        let mut taxels = ids.to_vec();
        Channel::side_by_side(&mut taxels);
        if taxels.len() != width {
            let what = format!(
                "`{}` has {width} values a frame, and the body has {} taxels with {} values; give the body of this sensor with --body",
                feature.name,
                Channel::taxels_of(&taxels).len(),
                taxels.len()
            );
            return Err(Error::usage(what).at(&place));
        }
        let mut tables = name.tables();
        if let Some(episode) = name.episode {
            // Before v3 a table has one episode, by which it is called.
            let is_other = |file: &PathBuf| {
                let number =
                    file.file_stem().and_then(|stem| stem.to_str()?.strip_prefix("episode_")?.parse::<u64>().ok());
                number.is_some_and(|number| number != episode)
            };
            tables.retain(|file| !is_other(file));
        }
        if tables.is_empty() {
            return Err(Error::failed("it has no data/chunk-*/*.parquet; copy the dataset again").at(&place));
        }
        let episodes = match (name.episode, info.total_episodes) {
            (Some(episode), _) => format!("episode {episode}"),
            (None, Some(1)) => "one episode".to_owned(),
            (None, count) => {
                let count = count.map_or_else(String::new, |count| format!("{count} "));
                format!("{count}episodes, with each of which time begins anew and touches end")
            }
        };
        let notices = vec![format!("`{}` is touch, {width} values a frame; {episodes}", feature.name)];
        let (feature, episode) = (feature.name, name.episode);
        Ok(Self {
            name: place,
            feature,
            width,
            taxels,
            episode,
            tables,
            begun: 0,
            reader: None,
            rows: Rows::default(),
            at: 0,
            frames: 0,
            notices,
        })
    }

    /// Reads rows until there are some. `false` at the end.
    fn read_rows(&mut self) -> Result<bool> {
        loop {
            let Some(reader) = &mut self.reader else {
                let Some(file) = self.tables.get(self.begun) else { return Ok(false) };
                let opened = table(file, &self.feature);
                self.reader = Some(opened.map_err(|e| e.at(file.display()))?);
                self.begun += 1;
                continue;
            };
            let Some(batch) = reader.next() else {
                self.reader = None;
                continue;
            };
            let batch = batch.map_err(|e| Error::failed(format!("{e}; copy the file again")));
            let rows = batch.and_then(|batch| Rows::of(&batch, &self.feature, self.width));
            let file = &self.tables[self.begun - 1];
            (self.rows, self.at) = (rows.map_err(|e| e.at(file.display()))?, 0);
            if !self.rows.times_s.is_empty() {
                return Ok(true);
            }
        }
    }
}

impl Source for LeRobotSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            if self.at == self.rows.times_s.len() && !self.read_rows()? {
                return match (self.frames, self.episode) {
                    (0, Some(episode)) => {
                        Err(failed!("there is no episode {episode}; name one that is").at(&self.name))
                    }
                    _ => Ok(false),
                };
            }
            let at = self.at;
            self.at += 1;
            if self.episode.is_some_and(|episode| self.rows.episodes[at] != episode as f64) {
                continue;
            }
            frame.clear();
            frame.t_s = self.rows.times_s[at];
            frame.values.clear();
            frame.values.extend_from_slice(&self.rows.values[at * self.width..(at + 1) * self.width]);
            self.frames += 1;
            return Ok(true);
        }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.begun.saturating_sub(1) as f64 / self.tables.len() as f64)
    }

    fn notices(&mut self) -> Vec<String> {
        self.notices.drain(..).map(|what| format!("{}: {what}", self.name)).collect()
    }
}

/// What the dataset says that it holds.
fn info_of(name: &LeRobotName) -> Result<Info> {
    let path = name.info();
    let text = limits::read_to_string(&path, MAX_METADATA_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => {
            let what = "it has no meta/info.json; name the folder of a LeRobot dataset, which has `meta` and `data`";
            Error::failed(what).at(name.path.display())
        }
        _ => Error::io(&path, &e),
    })?;
    let info: Info = serde_json::from_str(&text).map_err(|e| {
        failed!("it is not the info.json of a LeRobot dataset ({e}); copy the file again").at(path.display())
    })?;
    if !["v2.", "v3."].iter().any(|version| info.codebase_version.starts_with(version)) {
        let what = failed!(
            "codebase_version is `{}`; v2.1 and v3.0 are read: convert the dataset with LeRobot's scripts",
            info.codebase_version
        );
        return Err(what.at(path.display()));
    }
    Ok(info)
}

/// The feature of touch: `wanted`, or the only one that looks like it.
fn feature_of(info: &Info, wanted: Option<&str>) -> Result<Numeric> {
    let is_number = |dtype: &str| ["int", "uint", "float"].iter().any(|kind| dtype.starts_with(kind));
    let counts = [TIME, EPISODE, "frame_index", "index", "task_index"];
    let numeric =
        info.features.iter().filter(|(name, _)| !counts.contains(&name.as_str())).filter_map(|(name, about)| {
            let Feature { dtype, shape } = Feature::deserialize(about).ok()?;
            is_number(&dtype).then(|| Numeric { name: name.clone(), shape })
        });
    let numeric: Vec<Numeric> = numeric.collect();
    let named: Vec<String> = numeric.iter().map(|of| format!("{} {:?}", of.name, of.shape)).collect();
    let listed = if named.is_empty() { "none of numbers".to_owned() } else { named.join(", ") };
    let looks = |name: &str| {
        let name = name.to_lowercase();
        !name.starts_with(PERCEPTS) && TOUCH.iter().any(|word| name.contains(word))
    };
    let mut found: Vec<Numeric> =
        numeric.into_iter().filter(|of| wanted.map_or_else(|| looks(&of.name), |wanted| of.name == wanted)).collect();
    match (found.len(), wanted) {
        (1, _) => Ok(found.remove(0)),
        (_, Some(wanted)) => {
            Err(Error::usage(format!("there is no feature `{wanted}` of numbers; there are: {listed}")))
        }
        (0, None) => Err(Error::usage(format!("no feature looks like touch; name it, lerobot:DIR:FEATURE: {listed}"))),
        _ => Err(Error::usage(format!("several features look like touch; name one, lerobot:DIR:FEATURE: {listed}"))),
    }
}

/// Begins the table `file`, of which the columns that are needed are read.
fn table(file: &Path, feature: &str) -> Result<ParquetRecordBatchReader> {
    let damaged = |e: parquet::errors::ParquetError| Error::failed(format!("{e}; copy the file again"));
    let opened = File::open(file).map_err(|e| Error::failed(e.to_string()))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(opened).map_err(damaged)?;
    let places = [feature, TIME, EPISODE].map(|name| {
        let place = builder.schema().fields().iter().position(|field| field.name() == name);
        place.ok_or_else(|| failed!("it has no column `{name}`; copy the file again"))
    });
    let places = places.into_iter().collect::<Result<Vec<usize>>>()?;
    let columns = ProjectionMask::roots(builder.parquet_schema(), places);
    builder.with_projection(columns).with_batch_size(BATCH_ROWS).build().map_err(damaged)
}

impl Rows {
    fn of(batch: &RecordBatch, feature: &str, width: usize) -> Result<Self> {
        let rows = batch.num_rows();
        let all_of = |name: &str, width: usize| {
            let column = batch.column_by_name(name).ok_or_else(|| failed!("it has no column `{name}`"))?;
            let of_row = "meta/info.json says how many a row has: write the dataset again";
            match numbers(column) {
                Some(numbers) if numbers.len() == rows * width => Ok(numbers),
                Some(numbers) => Err(failed!(
                    "column `{name}` has {} numbers in {rows} rows, not {width} a row; {of_row}",
                    numbers.len()
                )),
                None => Err(failed!("column `{name}` has {}, not numbers; name another feature", column.data_type())),
            }
        };
        let value = |number: Option<f64>| number.map_or(RawValue::MISSING, RawValue::new);
        let known = |name: &str| -> Result<Vec<f64>> {
            let numbers = all_of(name, 1)?.into_iter().collect::<Option<Vec<f64>>>();
            numbers.ok_or_else(|| failed!("column `{name}` has a row without a value; write the dataset again"))
        };
        Ok(Self {
            times_s: known(TIME)?,
            episodes: known(EPISODE)?,
            values: all_of(feature, width)?.into_iter().map(value).collect(),
        })
    }
}

/// The numbers of a column, row by row, of lists and of lists within lists, too; `None` where these are not numbers.
fn numbers(column: &ArrayRef) -> Option<Vec<Option<f64>>> {
    let within = match column.data_type() {
        DataType::FixedSizeList(..) => {
            let list = column.as_fixed_size_list();
            // A row without a list would count as one with values.
            list.values().slice(0, if list.null_count() > 0 { 0 } else { list.values().len() })
        }
        DataType::List(_) => {
            let list = column.as_list::<i32>();
            let ends = list.value_offsets();
            let (first, last) = (*ends.first()? as usize, *ends.last()? as usize);
            list.values().slice(first, if list.null_count() > 0 { 0 } else { last - first })
        }
        DataType::Int8 => return Some(primitive::<Int8Type>(column, f64::from)),
        DataType::Int16 => return Some(primitive::<Int16Type>(column, f64::from)),
        DataType::Int32 => return Some(primitive::<Int32Type>(column, f64::from)),
        DataType::Int64 => return Some(primitive::<Int64Type>(column, |value| value as f64)),
        DataType::UInt8 => return Some(primitive::<UInt8Type>(column, f64::from)),
        DataType::UInt16 => return Some(primitive::<UInt16Type>(column, f64::from)),
        DataType::UInt32 => return Some(primitive::<UInt32Type>(column, f64::from)),
        DataType::UInt64 => return Some(primitive::<UInt64Type>(column, |value| value as f64)),
        DataType::Float32 => return Some(primitive::<Float32Type>(column, f64::from)),
        DataType::Float64 => return Some(primitive::<Float64Type>(column, |value| value)),
        _ => return None,
    };
    numbers(&within)
}

fn primitive<T: ArrowPrimitiveType>(column: &ArrayRef, number: fn(T::Native) -> f64) -> Vec<Option<f64>> {
    column.as_primitive::<T>().iter().map(|value| value.map(number)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow_array::builder::{FixedSizeListBuilder, Float32Builder, ListBuilder, UInt16Builder};
    use arrow_array::{Float32Array, Int64Array};
    use parquet::arrow::ArrowWriter;
    use parquet::basic::Compression;
    use parquet::file::properties::WriterProperties;

    use super::*;

    const LENGTHS: [usize; 3] = [4, 2000, 3];
    const TACTILE: &str = "observation.tactile";

    /// The value of a taxel in a frame.
    fn value(episode: usize, frame: usize, taxel: usize) -> f64 {
        (1000 * episode + frame % 900 + 7 * taxel) as f64
    }

    /// The rows of some episodes: of float32 in lists of one length, or of uint16 in lists of lists.
    fn batch(episodes: &[usize], is_nested: bool) -> RecordBatch {
        let all: Vec<(usize, usize)> =
            episodes.iter().flat_map(|&episode| (0..LENGTHS[episode]).map(move |frame| (episode, frame))).collect();
        let touch: ArrayRef = if is_nested {
            let mut builder = ListBuilder::new(ListBuilder::new(UInt16Builder::new()));
            for &(episode, frame) in &all {
                for row in 0..2 {
                    (0..3).for_each(|at| {
                        builder.values().values().append_value(value(episode, frame, 3 * row + at) as u16);
                    });
                    builder.values().append(true);
                }
                builder.append(true);
            }
            Arc::new(builder.finish())
        } else {
            let mut builder = FixedSizeListBuilder::new(Float32Builder::new(), 6);
            for &(episode, frame) in &all {
                (0..6).for_each(|taxel| builder.values().append_value(value(episode, frame, taxel) as f32));
                builder.append(true);
            }
            Arc::new(builder.finish())
        };
        let times: Float32Array = all.iter().map(|&(_, frame)| Some(frame as f32 / 8.0)).collect();
        let index: Int64Array = all.iter().map(|&(episode, _)| Some(episode as i64)).collect();
        RecordBatch::try_from_iter([
            ("action", Arc::new(times.clone()) as ArrayRef),
            (TACTILE, touch),
            (TIME, Arc::new(times)),
            (EPISODE, Arc::new(index)),
        ])
        .unwrap()
    }

    fn write(file: &Path, rows: &RecordBatch) {
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut writer = ArrowWriter::try_new(File::create(file).unwrap(), rows.schema(), Some(properties)).unwrap();
        writer.write(rows).unwrap();
        writer.close().unwrap();
    }

    fn write_info(folder: &Path, version: &str, touch: &[(&str, &str)]) {
        let shape = if version == "v3.0" { "[2, 3]" } else { "[6]" };
        let touch = touch.iter().map(|(name, dtype)| format!(r#""{name}": {{"dtype": "{dtype}", "shape": {shape}}},"#));
        let touch: String = touch.collect();
        let text = format!(
            r#"{{"codebase_version": "{version}", "total_episodes": 3, "fps": 8, "features": {{ {touch}
            "action": {{"dtype": "float32", "shape": [1]}}, "timestamp": {{"dtype": "float32", "shape": [1]}}}}}}"#
        );
        std::fs::create_dir_all(folder.join("meta")).unwrap();
        std::fs::write(folder.join("meta/info.json"), text).unwrap();
    }

    /// A dataset of three episodes: a table for each in v2.1, two tables in v3.0.
    fn dataset(folder: &Path, version: &str) {
        write_info(folder, version, &[(TACTILE, "uint16"), ("observation.images.touch", "video")]);
        let chunk = folder.join("data/chunk-000");
        if version == "v3.0" {
            write(&chunk.join("file-000.parquet"), &batch(&[0, 1], true));
            write(&chunk.join("file-001.parquet"), &batch(&[2], true));
        } else {
            (0..3).for_each(|at| write(&chunk.join(format!("episode_{at:06}.parquet")), &batch(&[at], false)));
        }
    }

    fn open(name: &str) -> Result<LeRobotSource> {
        LeRobotSource::open(&name.parse().unwrap(), &[9, 2, 3, 4, 5, 6])
    }

    fn frames(source: &mut LeRobotSource) -> Result<Vec<Frame>> {
        let (mut frame, mut all) = (Frame::missing(0.0, 6), Vec::new());
        while source.next_frame(&mut frame)? {
            all.push(frame.clone());
        }
        Ok(all)
    }

    #[test]
    fn episodes_of_both_versions_are_read_one_after_the_other() {
        for version in ["v2.1", "v3.0"] {
            let folder = tempfile::tempdir().unwrap();
            dataset(folder.path(), version);
            let name = folder.path().display().to_string();
            let mut source = open(&name).unwrap();
            assert_eq!(source.taxels(), [2, 3, 4, 5, 6, 9]);
            let told = source.notices();
            assert_eq!(
                told,
                [format!(
                    "{name}: `{TACTILE}` is touch, 6 values a frame; 3 episodes, with each of which time begins anew and touches end"
                )]
            );
            let read = frames(&mut source).unwrap();
            let wanted = (0..3).flat_map(|episode| (0..LENGTHS[episode]).map(move |frame| (episode, frame)));
            assert_eq!(read.len(), LENGTHS.iter().sum::<usize>());
            for (frame, (episode, at)) in read.iter().zip(wanted) {
                assert_eq!(frame.t_s, at as f64 / 8.0);
                let values: Vec<Option<f64>> = frame.values.iter().map(|value| value.number()).collect();
                assert_eq!(values, (0..6).map(|taxel| Some(value(episode, at, taxel))).collect::<Vec<_>>());
            }
            let one = frames(&mut open(&format!("{name}:{TACTILE}#1")).unwrap()).unwrap();
            assert_eq!(one, read[4..2004]);
            let why = open(&format!("{name}#7")).and_then(|mut source| frames(&mut source)).unwrap_err().to_string();
            assert!(why.contains("no episode 7") || why.contains("it has no data/"), "{why}");
        }
    }

    #[test]
    fn an_empty_value_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        dataset(folder.path(), "v2.1");
        let mut builder = FixedSizeListBuilder::new(Float32Builder::new(), 6);
        (0..6).for_each(|at| builder.values().append_option((at != 4).then_some(1.5)));
        builder.append(true);
        let touch: ArrayRef = Arc::new(builder.finish());
        let rows = [
            (TACTILE, touch),
            (TIME, Arc::new(Float32Array::from(vec![0.0])) as ArrayRef),
            (EPISODE, Arc::new(Int64Array::from(vec![0]))),
        ];
        write(&folder.path().join("data/chunk-000/episode_000000.parquet"), &RecordBatch::try_from_iter(rows).unwrap());
        let read = frames(&mut open(&format!("{}#0", folder.path().display())).unwrap()).unwrap();
        assert!(read[0].values[4].is_missing() && read[0].values[3].number() == Some(1.5));
    }

    #[test]
    fn what_is_wrong_is_told_in_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().display().to_string();
        let why = |name: &str| {
            let e = open(name).and_then(|mut source| frames(&mut source)).unwrap_err().to_string();
            assert!(!e.contains('\n'), "{e}");
            e
        };
        assert!(why(&name).contains("it has no meta/info.json; name the folder"));
        dataset(folder.path(), "v2.1");
        assert!(
            why(&format!("{name}:force"))
                .contains("there is no feature `force` of numbers; there are: observation.tactile [6]")
        );
        let other = LeRobotSource::open(&name.parse().unwrap(), &[1, 2]).unwrap_err();
        assert!(other.is_usage() && other.to_string().contains("has 6 values a frame, and the body has 2 taxels"));
        write_info(folder.path(), "v2.1", &[(TACTILE, "float32"), ("observation.fsr", "int16")]);
        assert!(
            why(&name)
                .contains("several features look like touch; name one, lerobot:DIR:FEATURE: observation.tactile [6], ")
        );
        write_info(folder.path(), "v2.1", &[]);
        assert!(why(&name).contains("no feature looks like touch; name it, lerobot:DIR:FEATURE: action [1]"));
        write_info(folder.path(), "v1.6", &[(TACTILE, "float32")]);
        assert!(why(&name).contains("codebase_version is `v1.6`; v2.1 and v3.0 are read"));
        write_info(folder.path(), "v2.1", &[("observation.touch", "float32")]);
        assert!(why(&name).contains("episode_000000.parquet: it has no column `observation.touch`"));
        write_info(folder.path(), "v2.1", &[(TACTILE, "float32")]);
        let file = folder.path().join("data/chunk-000/episode_000001.parquet");
        let whole = std::fs::read(&file).unwrap();
        std::fs::write(&file, &whole[..whole.len() - 9]).unwrap();
        assert!(why(&name).contains("episode_000001.parquet: "));
        std::fs::write(folder.path().join("meta/info.json"), "{}").unwrap();
        assert!(why(&name).contains("it is not the info.json of a LeRobot dataset"));
    }
}
