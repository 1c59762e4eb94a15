//! The body of mapped values: pads as sheets, a grid, or a row of dots.

use glam::DVec3;

use super::super::sizes::USUAL_PITCH_M;
use super::array_map::{ArrayMap, Pad};
use crate::body::{Sheet, SheetCell, sheets};
use crate::error::{Result, failed};
use crate::signal::Channel;

/// How many of the map's grids `count` taxels are, if they are more than one.
fn grids(map: &ArrayMap, count: usize) -> Option<(usize, [u32; 2])> {
    let [rows, columns] = map.grid?;
    let cells = rows as usize * columns as usize;
    let is_grid = rows > 1 && columns > 1;
    (is_grid && count > cells && count.is_multiple_of(cells)).then_some((count / cells, [rows, columns]))
}

/// Whether `count` taxels are pads: those that the map names, or several of its grids.
pub(in crate::source) fn has_pads(map: &ArrayMap, count: usize) -> bool {
    !map.pads.is_empty() || grids(map, count).is_some()
}

/// Pads of one grid side by side, with an empty column between them.
fn in_a_row(count: usize, grid: [u32; 2], pitch_m: [f64; 2]) -> Vec<Pad> {
    let step_m = f64::from(grid[1] + 1) * pitch_m[1];
    let from_middle = |index: usize| index as f64 - (count as f64 - 1.0) / 2.0;
    let pad = |index: usize| Pad {
        name: format!("pad_{}", index + 1),
        grid,
        pitch_m,
        at_m: [from_middle(index) * step_m, 0.0],
    };
    (0..count).map(pad).collect()
}

/// The pads of `count` taxels, and what is to be said of them.
fn pads(map: &ArrayMap, count: usize) -> Result<(Vec<Pad>, String)> {
    if map.pads.is_empty() {
        let grid = map.grid.unwrap_or([1, u32::try_from(count).unwrap_or(u32::MAX)]);
        let pitch_m = map.pitch_m.unwrap_or([USUAL_PITCH_M; 2]);
        let guess =
            "10 mm apart. This distance is a guess: `pitch` in the map sets it, and `body` names a body of yours";
        let apart = map.pitch_m.map_or(guess.to_owned(), |[rows, columns]| match rows == columns {
            true => format!("{} mm apart", rows * 1e3),
            false => format!("{} mm and {} mm apart", rows * 1e3, columns * 1e3),
        });
        if let Some((pads, [rows, columns])) = grids(map, count) {
            let what = format!("{pads} pads (pad_1 to pad_{pads}), side by side, of {rows} × {columns} sensors each");
            return Ok((in_a_row(pads, grid, pitch_m), format!("{what}, {apart}")));
        }
        let (name, what) = match grid {
            [1, _] => ("row", format!("a row of {count} sensors")),
            [rows, columns] => ("grid", format!("a grid of {rows} × {columns} sensors")),
        };
        let pad = Pad { name: name.to_owned(), grid, pitch_m, at_m: [0.0; 2] };
        if pad.cells() != count {
            return Err(failed!(
                "grid: {} × {} are {} sensors, and a message has {count} values",
                grid[0],
                grid[1],
                pad.cells()
            ));
        }
        return Ok((vec![pad], format!("{what}, {apart}")));
    }
    // Hands are sold with some of their pads.
    let mut used = 0;
    let own = map.pads.iter().take_while(|pad| {
        let is_there = used < count;
        used += if is_there { pad.cells() } else { 0 };
        is_there
    });
    let own: Vec<Pad> = own.cloned().collect();
    if used != count {
        return Err(failed!("pads: {} pads have {used} sensors, and a message has {count} values", own.len()));
    }
    let names: Vec<&str> = own.iter().map(|pad| pad.name.as_str()).collect();
    let listed = if let [first, .., last] = &names[..] { format!("{first} to {last}") } else { names.join("") };
    let absent = match map.pads.len() - own.len() {
        0 => String::new(),
        absent => format!(", without the last {absent} of the map, for which a message has no values"),
    };
    let guess = match map.names {
        Some(_) => "; where they lie is a guess, and `body` names a body of yours",
        None => "",
    };
    let pads = if names.len() == 1 { "pad" } else { "pads" };
    let words = format!("{} {pads} ({listed}) of {count} sensors{absent}{guess}", names.len());
    Ok((own, words))
}

/// A body for the values of the channels `ids` in their order, a `.glb`.
///
/// # Errors
/// The map's pads or grid have another number of sensors.
pub(in crate::source) fn glb(map: &ArrayMap, ids: &[u32]) -> Result<Vec<u8>> {
    let taxels = Channel::taxels_of(ids);
    let (pads, _) = pads(map, taxels.len())?;
    let from_middle = |index: usize, count: u32| index as f64 - (f64::from(count) - 1.0) / 2.0;
    let mut taxels = taxels.iter();
    let sheet = |pad: &Pad| {
        let [rows, columns] = pad.grid;
        let cells = taxels.by_ref().take(pad.cells()).enumerate().map(|(index, &(id, has_axes))| {
            let (row, column) = (index / columns as usize, index % columns as usize);
            let centre = [from_middle(column, columns) * pad.pitch_m[1], -from_middle(row, rows) * pad.pitch_m[0]];
            SheetCell::rectangle(id, centre, pad.pitch_m[1], pad.pitch_m[0]).with_axes(has_axes)
        });
        let [u, v] = pad.at_m;
        Sheet::new(&pad.name, cells.collect()).at(DVec3::new(u, 0.0, -v))
    };
    sheets(&pads.iter().map(sheet).collect::<Vec<Sheet>>())?.to_bytes()
}

/// What is to be said of that body.
pub(in crate::source) fn about(map: &ArrayMap, ids: &[u32]) -> String {
    let taxels = Channel::taxels_of(ids);
    let axes = if taxels.iter().any(|&(_, has_axes)| has_axes) { "; each has three axes" } else { "" };
    pads(map, taxels.len()).map_or_else(|e| e.to_string(), |(_, words)| format!("a body is made: {words}{axes}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;

    #[test]
    fn pads_are_sheets_and_some_may_be_absent() {
        let map = ArrayMap::named("dex3").unwrap();
        for (count, links) in [(108, 9), (84, 7)] {
            let ids: Vec<u32> = (0..count).collect();
            let body = Body::from_bytes("dex3", &glb(&map, &ids).unwrap()).unwrap();
            assert_eq!(body.taxels.len(), count as usize);
            assert_eq!(body.fields.iter().filter(|field| field.name.starts_with("pad_")).count(), links);
        }
        let some: Vec<u32> = (0..84).collect();
        assert!(about(&map, &some).contains("without the last 2"), "{}", about(&map, &some));
        for wrong in [100, 120] {
            let why = glb(&map, &(0..wrong).collect::<Vec<u32>>()).unwrap_err().to_string();
            assert!(why.contains(&format!("a message has {wrong} values")), "{why}");
        }
    }

    #[test]
    fn without_pads_it_is_a_grid_or_a_row() {
        let ids: Vec<u32> = (0..6).collect();
        let row = ArrayMap::parse("values = 'a'").unwrap();
        assert!(about(&row, &ids).contains("a row of 6 sensors, 10 mm apart. This distance is a guess"));
        let grid = ArrayMap::parse("values = 'a'\ngrid = '2x3'\npitch = '4mm'").unwrap();
        assert_eq!(about(&grid, &ids), "a body is made: a grid of 2 × 3 sensors, 4 mm apart");
        let body = Body::from_bytes("grid", &glb(&grid, &ids).unwrap()).unwrap();
        let [first, last] = [0, 5].map(|at: usize| body.taxels[at].position_in_link);
        assert!((first - last).abs().abs_diff_eq(DVec3::new(0.008, 0.0, 0.004), 1e-6), "{first} {last}");
        assert!(glb(&grid, &ids[..5]).unwrap_err().to_string().contains("grid: 2 × 3 are 6 sensors"));
        let three: Vec<u32> = (0..18).collect();
        let words = "a body is made: 3 pads (pad_1 to pad_3), side by side, of 2 × 3 sensors each, 4 mm apart";
        assert_eq!(about(&grid, &three), words);
        let body = Body::from_bytes("pads", &glb(&grid, &three).unwrap()).unwrap();
        assert_eq!(body.fields.iter().filter(|field| field.name.starts_with("pad_")).count(), 3);
    }
}
