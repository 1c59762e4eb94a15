//! novel's loadsol, `.txt`: above the table a line with names, `DEVICE::ZONE`, and one with quantities and units; then a row for each
//! frame. Of each device the forces of its zones are sensors. Its total is left out where there are zones, and so is what else it measures.
//! Where the zones are is not in the file.

use super::super::column_names::columns;
use super::layout::{Cell, Layout, Panel, next_value};
use super::parser::{Parser, Rate};
use super::sides::sides;
use super::text::{Separator, Word};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Most columns of a table, far more than any insole has.
const MAX_COLUMNS: usize = 4096;

/// Reads frames from lines.
pub(super) struct Loadsol {
    separator: Separator,
    rate: Rate,
    unit: Option<UnitOfP>,
    /// The cells of the line above.
    names: Vec<String>,
    table: Option<Table>,
}

/// What the columns are.
struct Table {
    unit: UnitOfP,
    devices: Vec<Device>,
    /// By column up to the last one of a sensor, its place in a frame, where sensors are in the order of the devices.
    places: Vec<Option<usize>>,
    sensors: usize,
    /// In words.
    words: String,
}

/// An insole.
struct Device {
    name: String,
    /// Its zones, and their columns; one without a name is its total.
    zones: Vec<(String, usize)>,
}

impl Loadsol {
    pub(super) fn new(separator: Separator, rate: Rate, unit: Option<UnitOfP>) -> Self {
        Self { separator, rate, unit, names: Vec::new(), table: None }
    }

    /// The table whose columns have `units`.
    fn table(&self, units: &[String]) -> Result<Table> {
        if units.len() > MAX_COLUMNS {
            return Err(failed!("it has {} columns; there are at most {MAX_COLUMNS}", units.len()));
        }
        let mut devices: Vec<Device> = Vec::new();
        let mut unit = None;
        for (column, head) in units.iter().enumerate() {
            let Some(of_force) = head.strip_prefix("Force[").and_then(|rest| rest.strip_suffix(']')) else { continue };
            let named: UnitOfP = of_force.parse()?;
            if unit.replace(named).is_some_and(|before| before != named) {
                return Err(failed!(
                    "column {} is in {of_force}, and others are not; export forces in one unit",
                    column + 1
                ));
            }
            let name = self.names.get(column).map_or("", String::as_str);
            let (device, zone) = name.split_once("::").unwrap_or((name, ""));
            let at = devices.iter().position(|known| known.name == device).unwrap_or_else(|| {
                devices.push(Device { name: device.to_owned(), zones: Vec::new() });
                devices.len() - 1
            });
            devices[at].zones.push((zone.to_owned(), column));
        }
        let unit = unit.ok_or_else(|| Error::failed("it has no column `Force[N]`; export forces"))?;
        for device in &mut devices {
            if device.zones.iter().any(|(zone, _)| !zone.is_empty()) {
                device.zones.retain(|(zone, _)| !zone.is_empty());
            }
        }
        let sensors: Vec<usize> = devices.iter().flat_map(|device| &device.zones).map(|(_, column)| *column).collect();
        let mut places = vec![None; sensors.iter().max().map_or(0, |last| last + 1)];
        sensors.iter().enumerate().for_each(|(place, &column)| places[column] = Some(place));
        let of_device = |device: &Device| {
            let zones = device.zones.iter().map(|(zone, column)| match zone.as_str() {
                "" => columns(column + 1, column + 1),
                zone => format!("{} {zone}", columns(column + 1, column + 1)),
            });
            format!("{}: {}", super::text::shortened(&device.name), zones.collect::<Vec<_>>().join(", "))
        };
        let devices_in_words: Vec<String> = devices.iter().map(of_device).collect();
        let words =
            format!("column 1: the time; forces of {}; the other columns are left out", devices_in_words.join("; of "));
        Ok(Table { unit, devices, places, sensors: sensors.len(), words })
    }
}

/// Whether it is a dash, which is no reading.
fn is_dash(word: Word<'_>) -> bool {
    word.is("-")
}

impl Parser for Loadsol {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let mut cells = self.separator.cells(line);
        let Some(table) = &self.table else {
            let texts: Vec<String> = cells.map(|word| word.text().into_owned()).collect();
            if texts.first().is_some_and(|first| first.starts_with("Time[")) {
                self.table = Some(self.table(&texts)?);
            } else if texts.iter().any(|text| !text.is_empty()) {
                self.names = texts;
            }
            return Ok(false);
        };
        if line.trim_ascii().is_empty() {
            return Ok(false);
        }
        let time = cells.next().and_then(Word::number);
        let time = time.ok_or_else(|| Error::failed("its first cell is not the time"))?;
        to.clear();
        to.values.resize(table.sensors, RawValue::MISSING);
        for (column, place) in table.places.iter().enumerate().skip(1) {
            let short = || failed!("it has {column} of {} cells", table.places.len());
            let word = cells.clone().next().ok_or_else(short)?;
            match place.filter(|_| !is_dash(word)) {
                Some(place) => {
                    let value = next_value(&mut cells).ok_or_else(short)?;
                    to.values[place] = value.map_err(|e| e.at(format!("column {}", column + 1)))?;
                }
                None => drop(cells.next()),
            }
        }
        to.t_s = self.rate.time_of(Some(time), None)?;
        Ok(true)
    }

    fn end(&mut self, _: &mut Frame) -> Result<bool> {
        Ok(false)
    }

    fn go_on(&mut self) -> bool {
        self.rate.pass();
        self.table.is_some()
    }

    fn understood(&self) -> Option<String> {
        self.table.as_ref().map(|table| table.words.clone())
    }

    fn layout(&self) -> Layout {
        let Some(table) = &self.table else { return Layout::default() };
        // The side is the last part of a device's name, after a number that may have any letters.
        let last = |device: &Device| device.name.rsplit(['-', '_', ' ']).next().unwrap_or_default().to_owned();
        let ends: Vec<String> = table.devices.iter().map(last).collect();
        let names = sides(&ends.iter().map(String::as_str).collect::<Vec<_>>());
        let mut id = 0;
        let panel = |(device, name): (&Device, String)| {
            let mut panel = Panel { name, ..Panel::default() };
            for (zone, _) in &device.zones {
                panel.cells.push(Cell { id, ..Cell::default() });
                if !zone.is_empty() && !panel.parts.iter().any(|(known, _)| known == zone) {
                    panel.parts.push((zone.clone(), vec![id]));
                }
                id += 1;
            }
            panel
        };
        let panels = table.devices.iter().zip(names).map(panel).collect();
        Layout { panels, unit: self.unit.unwrap_or(table.unit) }
    }
}
