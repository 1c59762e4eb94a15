//! Where everything is on a plot, pixels before they are scaled up.

use super::gather::Gathered;

pub(super) const TITLE: i32 = 30;
pub(super) const LEGEND: i32 = 26;
/// Around what a panel plots into.
pub(super) const LEFT: i32 = 66;
pub(super) const RIGHT: i32 = 18;
const PANEL: i32 = 132;
const BETWEEN: i32 = 16;
/// Ticks and name of the axis of time.
const TIME_AXIS: i32 = 46;
const MAP_TITLE: i32 = 40;
const MAP: i32 = 300;
const MAP_BAR: i32 = 58;
/// Between the maps of two quantities, and of two fields, are these parts of a column's width: more than between taxels.
const BETWEEN_QUANTITIES: i32 = 9;
const BETWEEN_FIELDS: i32 = 24;

/// A rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    pub(super) left: i32,
    pub(super) top: i32,
    pub(super) width: i32,
    pub(super) height: i32,
}

impl Area {
    pub(super) fn right(&self) -> i32 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> i32 {
        self.top + self.height
    }
}

/// The arrangement of a figure: a column for each recording.
#[derive(Debug)]
pub(super) struct Page {
    columns: usize,
    /// Width of what a column plots into.
    width: i32,
    panels: usize,
    has_maps: bool,
}

impl Page {
    pub(super) fn for_fields(all: &[Gathered]) -> Self {
        let columns = all.len().max(1);
        let width = match columns {
            1 => 760,
            2 => 520,
            _ => 400,
        };
        let panels = all.iter().map(|gathered| gathered.panels.len()).max().unwrap_or(0);
        Self { columns, width, panels, has_maps: all.iter().any(|gathered| !gathered.maps.is_empty()) }
    }

    pub(super) fn size(&self) -> [i32; 2] {
        let maps = if self.has_maps { MAP_TITLE + MAP + MAP_BAR } else { 0 };
        [self.columns as i32 * (LEFT + self.width + RIGHT), self.maps_top() + maps + 8]
    }

    fn maps_top(&self) -> i32 {
        TITLE + LEGEND + self.panels as i32 * (PANEL + BETWEEN) - BETWEEN + TIME_AXIS
    }

    fn left(&self, column: usize) -> i32 {
        column as i32 * (LEFT + self.width + RIGHT) + LEFT
    }

    /// Where the title of a column is.
    pub(super) fn title(&self, column: usize) -> Area {
        Area { left: self.left(column), top: 0, width: self.width, height: TITLE }
    }

    /// Where the legend of the whole figure is.
    pub(super) fn legend(&self) -> Area {
        let width = self.columns as i32 * (LEFT + self.width + RIGHT) - LEFT - RIGHT;
        Area { left: LEFT, top: TITLE, width, height: LEGEND }
    }

    pub(super) fn panel(&self, column: usize, panel: usize) -> Area {
        let top = TITLE + LEGEND + panel as i32 * (PANEL + BETWEEN) + 4;
        Area { left: self.left(column), top, width: self.width, height: PANEL }
    }

    /// Where the maps of `quantity`, 0 or 1, are in a column: what they show is above them, the scale of their colours below.
    pub(super) fn maps(&self, column: usize, quantity: usize) -> Area {
        let between = self.width / BETWEEN_QUANTITIES;
        let width = (self.width - between) / 2;
        let left = self.left(column) + quantity as i32 * (width + between);
        Area { left, top: self.maps_top() + MAP_TITLE, width, height: MAP }
    }

    /// Where map `index` of the `count` maps of `quantity` is in a column, with the field's name above it.
    pub(super) fn map(&self, column: usize, quantity: usize, index: usize, count: usize) -> Area {
        let (area, between) = (self.maps(column, quantity), self.width / BETWEEN_FIELDS);
        let count = count.max(1) as i32;
        let width = (area.width - (count - 1) * between) / count;
        Area { left: area.left + index as i32 * (width + between), width, ..area }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_lie_apart_and_in_their_column() {
        for columns in 1..=4 {
            let page = Page { columns, width: [760, 520, 400, 400][columns - 1], panels: 2, has_maps: true };
            for column in 0..columns {
                let areas: Vec<Area> = [0, 1]
                    .into_iter()
                    .flat_map(|quantity| [0, 1].map(|index| page.map(column, quantity, index, 2)))
                    .collect();
                let gaps: Vec<i32> = areas.windows(2).map(|pair| pair[1].left - pair[0].right()).collect();
                assert!(gaps.iter().all(|&gap| gap >= 16) && gaps[1] >= 40, "{columns}: {gaps:?}");
                let panel = page.panel(column, 0);
                assert!(areas[0].left >= panel.left && areas[3].right() <= panel.right(), "{columns}");
            }
        }
    }
}
