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

    /// Where map `index` of `count` is in a column; the title is above it, the scale of its colours below.
    pub(super) fn map(&self, column: usize, index: usize, count: usize) -> Area {
        let width = self.width / count.max(1) as i32;
        let left = self.left(column) + index as i32 * width;
        Area { left: left + 4, top: self.maps_top() + MAP_TITLE, width: width - 8, height: MAP }
    }
}
