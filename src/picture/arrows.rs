//! Arrows of tangential forces on taxels.

use plotters::prelude::*;

use crate::error::Result;
use crate::ink::cannot;

/// An arrow of the highest force of the scale is so many taxels' widths long; shorter ones than this, pixels, are left out.
const WIDTHS_AT_MOST: f64 = 3.0;
const SHORTEST_ARROW: f64 = 3.0;

/// How long the arrow of `force` is on a taxel of `radius`, where the scale ends at `most`; in the unit of the radius.
pub(super) fn length(force: f64, radius: f64, most: f64) -> f64 {
    force * 2.0 * WIDTHS_AT_MOST * radius / most
}

/// A round force for the legend: 1, 2 or 5 times a power of ten, at most half of `most`.
pub(super) fn round_force(most: f64) -> f64 {
    let half = (most / 2.0).max(1e-9);
    let power = libm::pow(10.0, libm::floor(libm::log10(half)));
    [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|&force| force <= half).unwrap_or(power)
}

/// Draws arrows, each from one pixel to another, into a picture of `size`.
pub(super) fn draw(
    pixels: &mut [u8],
    [width, height]: [u32; 2],
    arrows: impl Iterator<Item = [[f64; 2]; 2]>,
) -> Result<()> {
    let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
    for line in arrows.flat_map(lines) {
        for (colour, width) in [(BLACK, 4), (WHITE, 2)] {
            area.draw(&PathElement::new(line.clone(), colour.stroke_width(width))).map_err(cannot)?;
        }
    }
    area.present().map_err(cannot)
}

/// The lines of an arrow, pixels; none where it is too short to have a direction.
fn lines([from, to]: [[f64; 2]; 2]) -> Vec<Vec<(i32, i32)>> {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let size = libm::hypot(dx, dy);
    if size < SHORTEST_ARROW {
        return Vec::new();
    }
    let head = (0.4 * size).min(9.0) / size;
    let wing = |side: f64| [to[0] - head * (dx + side * dy), to[1] - head * (dy - side * dx)];
    let point = |[x, y]: [f64; 2]| (x.round() as i32, y.round() as i32);
    vec![vec![point(from), point(to)], [wing(0.6), to, wing(-0.6)].map(point).to_vec()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_ends_where_its_force_says_with_its_head_there() {
        let arrow = lines([[10.0, 10.0], [50.0, 10.0]]);
        assert_eq!(arrow[0], [(10, 10), (50, 10)]);
        let head = &arrow[1];
        assert_eq!(head[1], (50, 10));
        assert!(head[0].0 < 50 && head[2].0 == head[0].0 && head[0].1 - 10 == 10 - head[2].1, "{head:?}");
        assert!(lines([[10.0, 10.0], [12.0, 11.0]]).is_empty(), "too short");
        // The highest force of the scale is three taxels wide, a third of it one.
        assert!((length(1.2, 4.0, 1.2) - 24.0).abs() < 1e-12 && (length(0.4, 4.0, 1.2) - 8.0).abs() < 1e-12);
        for (most, round) in [(1.4, 0.5), (0.3, 0.1), (40.0, 20.0), (10.0, 5.0)] {
            assert!((round_force(most) - round).abs() < 1e-12, "{most}");
        }
    }
}
