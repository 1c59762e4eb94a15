//! Views of a body, and their arrangement at one scale.

use glam::{DVec3, Mat4, Vec3};

use crate::backend::gpu::raster::Eye;

/// Pixels around each view.
const MARGIN: f64 = 14.0;
/// The outer part of that margin, pixels, which stays empty: what a view shows beside a part of a body ends before the next view.
const GAP: f64 = 5.0;
/// A view is left out if it shows less than this share of the best one.
const MIN_VISIBLE_SHARE: f64 = 0.02;
/// The same of a view of a part of a body, which the rest of the body fills.
const MIN_SHARE_OF_PART: f64 = 0.1;
/// A second view of a touch shows at least this share of what the first one does.
const SECOND_SHARE: f64 = 0.3;

words! {"view",
    /// A view of a body, which stands upright, +y up, and faces +z; its left is +x.
    View {
        /// From +z.
        Front = "front",
        /// From −z.
        Back = "back",
        /// From +x.
        Left = "left",
        /// From −x.
        Right = "right",
        /// From +y, its front below.
        Top = "top",
        /// From −y, its front above.
        Bottom = "bottom",
        /// From the front, its left, and above.
        ThreeQuarter = "three-quarter",
    }
}

impl View {
    /// Unit vectors of its eye: to the right, up, and towards it.
    pub(super) fn axes(self) -> [DVec3; 3] {
        let (towards, up) = match self {
            Self::Front => (DVec3::Z, DVec3::Y),
            Self::Back => (DVec3::NEG_Z, DVec3::Y),
            Self::Left => (DVec3::X, DVec3::Y),
            Self::Right => (DVec3::NEG_X, DVec3::Y),
            Self::Top => (DVec3::Y, DVec3::NEG_Z),
            Self::Bottom => (DVec3::NEG_Y, DVec3::Z),
            Self::ThreeQuarter => (DVec3::new(0.6, 0.5, 0.8).normalize(), DVec3::Y),
        };
        let right = up.cross(towards).normalize();
        [right, towards.cross(right), towards]
    }

    /// The four sides that show most of the taxels with these normals, or fewer if fewer show any, and then three-quarter.
    /// Without taxels front, back, left and right.
    #[must_use]
    pub fn best(normals: &[DVec3]) -> Vec<Self> {
        let sides = Self::most_first(|view| view.seen(normals));
        if sides[0].0 == 0.0 {
            return Self::ALL[..4].to_vec();
        }
        let best = Self::worth(&sides[..4], MIN_VISIBLE_SHARE * sides[0].0);
        let room = best.len() < 4;
        Self::ALL.iter().copied().filter(|view| best.contains(view) || (room && *view == Self::ThreeQuarter)).collect()
    }

    /// At most four views, of those that show something of what `shows` measures by view: the sides that show most of it, and if they
    /// are fewer three-quarter.
    pub(super) fn best_of(shows: impl Fn(Self) -> f64) -> Vec<Self> {
        let mut sides = Self::most_first(&shows);
        let enough = MIN_SHARE_OF_PART * sides[0].0;
        sides.truncate(4);
        let aslant = (shows(Self::ThreeQuarter), Self::ThreeQuarter);
        let mut best = Self::worth(&sides, enough);
        best.extend(Self::worth(&[aslant], enough));
        best.truncate(4);
        Self::ALL.iter().copied().filter(|view| best.contains(view)).collect()
    }

    /// The side that shows most of the taxels with these normals, and a second one, also three-quarter, if that shows a good part of
    /// them.
    #[must_use]
    pub(super) fn two_best(normals: &[DVec3]) -> Vec<Self> {
        let sides = Self::most_first(|view| view.seen(normals));
        let is_second = |&(seen, _): &(f64, Self)| seen >= SECOND_SHARE * sides[0].0;
        let aslant = (Self::ThreeQuarter.seen(normals), Self::ThreeQuarter);
        let second = [sides[1], aslant].into_iter().find(is_second);
        std::iter::once(sides[0].1).chain(second.map(|(_, view)| view)).collect()
    }

    /// The six sides with how much each shows, by what `shows` measures, the most first.
    fn most_first(shows: impl Fn(Self) -> f64) -> Vec<(f64, Self)> {
        let mut sides: Vec<(f64, Self)> = Self::ALL[..6].iter().map(|&view| (shows(view), view)).collect();
        sides.sort_by(|a, b| b.0.total_cmp(&a.0));
        sides
    }

    /// Those of `views` that show more than `enough`.
    fn worth(views: &[(f64, Self)], enough: f64) -> Vec<Self> {
        views.iter().filter(|&&(seen, _)| seen > enough).map(|&(_, view)| view).collect()
    }

    /// How much it shows of taxels with these normals.
    pub(super) fn seen(self, normals: &[DVec3]) -> f64 {
        let towards = self.axes()[2];
        normals.iter().map(|normal| normal.dot(towards).max(0.0)).sum()
    }
}

/// One view's place in the picture.
pub(super) struct PlacedView {
    pub(super) axes: [DVec3; 3],
    /// Left, top, width and height, pixels.
    pub(super) part: [u32; 4],
    /// The middle of what it shows, along its axes, m.
    middle: [f64; 2],
}

impl PlacedView {
    /// Whether a pixel, right and down, is in its part: a view may show less than the body.
    pub(super) fn holds(&self, (x, y): (i32, i32)) -> bool {
        let [left, top, width, height] = self.part.map(|pixels| pixels as i32);
        (left..left + width).contains(&x) && (top..top + height).contains(&y)
    }

    /// Whether what reaches `half` to both sides of a pixel is in its part.
    pub(super) fn holds_all(&self, [x, y]: [f64; 2], half: [f64; 2]) -> bool {
        [-1.0, 1.0]
            .into_iter()
            .all(|side| self.holds(((x + side * half[0]).round() as i32, (y + side * half[1]).round() as i32)))
    }
}

/// Views at one scale.
pub(super) struct Arrangement {
    pub(super) views: Vec<PlacedView>,
    /// Pixels a metre.
    pub(super) scale: f64,
    /// Their height, pixels.
    pub(super) height: u32,
}

impl Arrangement {
    /// Arranges `views` of `points` (in m, about their middle) in rows within `width` × `height` pixels, as large as they
    /// can be; the first row starts at `top`, and each view has `caption` pixels above it.
    pub(super) fn in_rows(
        views: &[[DVec3; 3]],
        points: &[DVec3],
        [width, height]: [u32; 2],
        top: u32,
        caption: u32,
    ) -> Self {
        let caption = f64::from(caption);
        let spans: Vec<[[f64; 2]; 2]> =
            views.iter().map(|axes| [span(points, axes[0]), span(points, axes[1])]).collect();
        let sizes: Vec<[f64; 2]> = spans.iter().map(|span| span.map(|[low, high]| high - low)).collect();
        let largest = |sizes: &[[f64; 2]], side: usize| sizes.iter().map(|size| size[side]).fold(0.0, f64::max);
        // Per number of columns: the columns' widths and the rows' heights, m, and the scale.
        let arranged = (1..=views.len()).map(|columns| {
            let widths: Vec<f64> = (0..columns)
                .map(|column| sizes.iter().skip(column).step_by(columns).map(|size| size[0]).fold(0.0, f64::max))
                .collect();
            let heights: Vec<f64> = sizes.chunks(columns).map(|row| largest(row, 1)).collect();
            let room = |pixels: u32, count: usize, each: f64| (f64::from(pixels) - count as f64 * each).max(1.0);
            let across = room(width, columns, 2.0 * MARGIN) / widths.iter().sum::<f64>();
            let down = room(height, heights.len(), 2.0 * MARGIN + caption) / heights.iter().sum::<f64>();
            (across.min(down), widths, heights)
        });
        let best = arranged.max_by(|a, b| a.0.total_cmp(&b.0));
        let (scale, widths, heights) = best.unwrap_or((1.0, Vec::new(), Vec::new()));
        let scale = if scale.is_finite() { scale } else { 1.0 };
        let used: f64 = widths.iter().map(|w| w * scale + 2.0 * MARGIN).sum();
        // All columns share the room that is left: views fill the picture, and partial views show more of the body.
        let spare = ((f64::from(width) - used) / widths.len().max(1) as f64).max(0.0);
        let mut placed = Vec::with_capacity(views.len());
        let mut y = f64::from(top);
        for (row, &tall) in heights.iter().enumerate() {
            let mut x = 0.0;
            for (column, &wide) in widths.iter().enumerate() {
                let Some(axes) = views.get(row * widths.len() + column) else { break };
                let [across, up] = spans[row * widths.len() + column];
                let size = [wide * scale + 2.0 * MARGIN + spare, tall * scale + 2.0 * MARGIN];
                placed.push(PlacedView {
                    axes: *axes,
                    part: [x + GAP, y + caption + GAP, size[0] - 2.0 * GAP, size[1] - 2.0 * GAP]
                        .map(|pixels| pixels.round().max(1.0) as u32),
                    middle: [(across[0] + across[1]) / 2.0, (up[0] + up[1]) / 2.0],
                });
                x += size[0];
            }
            y += tall * scale + 2.0 * MARGIN + caption;
        }
        // Rounding may exceed the edge by one.
        for PlacedView { part, .. } in &mut placed {
            part[2] = part[2].min((width - GAP as u32).saturating_sub(part[0])).max(1);
        }
        Self { views: placed, scale, height: (y - f64::from(top)).ceil() as u32 }
    }

    /// The position of `point` (m, relative to the middle) in view `index`: right and down from the top left, pixels.
    pub(super) fn pixel(&self, index: usize, point: DVec3) -> [f64; 2] {
        let view = &self.views[index];
        let [left, top, width, height] = view.part.map(f64::from);
        let [x, y] = [0, 1].map(|axis| (point.dot(view.axes[axis]) - view.middle[axis]) * self.scale);
        [left + width / 2.0 + x, top + height / 2.0 - y]
    }

    /// The cameras. A sphere of `radius_m` contains everything drawn.
    pub(super) fn eyes(&self, radius_m: f64) -> Vec<Eye> {
        let eye = |view: &PlacedView| {
            let [right, up, towards] = view.axes;
            let [_, _, width, height] = view.part.map(f64::from);
            let (across, down) = (2.0 * self.scale / width, 2.0 * self.scale / height);
            let depth = -0.5 / radius_m;
            // Rows of the matrix: what each clip coordinate takes from x, y and z, and its offset.
            let rows = [
                (right * across, -view.middle[0] * across),
                (up * down, -view.middle[1] * down),
                (towards * depth, 0.5),
                (DVec3::ZERO, 1.0),
            ];
            let rows = rows.map(|(row, offset)| row.as_vec3().extend(offset as f32));
            Eye {
                clip_from_world: Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(),
                axes: view.axes.map(|axis| Vec3::from_array(axis.as_vec3().to_array())),
                part: view.part,
            }
        };
        self.views.iter().map(eye).collect()
    }
}

/// The range of `points` along `axis`, m; at least a nanometre.
fn span(points: &[DVec3], axis: DVec3) -> [f64; 2] {
    let along = points.iter().map(|p| p.dot(axis));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low <= high { [low - 5e-10, high + 5e-10] } else { [-5e-10, 5e-10] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eye_sees_right_up_and_near_where_they_are() {
        for &view in View::ALL {
            let [right, up, towards] = view.axes();
            assert!((right.cross(up) - towards).length() < 1e-15, "{view:?}");
            assert_eq!(view.word().parse::<View>().unwrap(), view);
        }
        assert_eq!(View::Front.axes()[0], DVec3::X);
        assert_eq!(View::Left.axes()[0], DVec3::NEG_Z, "from its left it looks to the left");
        assert!("frnt".parse::<View>().unwrap_err().to_string().contains("did you mean `front`"));
    }

    #[test]
    fn sides_that_see_nothing_are_left_out() {
        assert_eq!(View::best(&[DVec3::Y; 9]), [View::Top, View::ThreeQuarter]);
        assert_eq!(View::best(&[]), View::ALL[..4]);
        let round: Vec<DVec3> = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].into();
        assert_eq!(View::best(&round), View::ALL[..4]);
        // Of a touch, the two that show most of it, or one.
        assert_eq!(View::two_best(&[DVec3::NEG_Y, DVec3::NEG_Y, DVec3::X]), [View::Bottom, View::Left]);
        assert_eq!(View::two_best(&[DVec3::NEG_Y; 9]), [View::Bottom]);
        assert_eq!(View::two_best(&[DVec3::Y; 9]), [View::Top, View::ThreeQuarter]);
        // Of a part of a body nothing but what shows it, not even from aslant.
        let shows = |seen: &'static [View]| move |view: View| if seen.contains(&view) { 1.0 } else { 0.0 };
        assert_eq!(View::best_of(shows(&[View::Bottom])), [View::Bottom]);
        assert_eq!(View::best_of(shows(&[View::Top, View::ThreeQuarter])), [View::Top, View::ThreeQuarter]);
        assert_eq!(View::best_of(shows(View::ALL)), View::ALL[..4]);
        assert!(View::best_of(shows(&[])).is_empty());
    }

    #[test]
    fn views_lie_within_the_picture_and_show_all_points() {
        let points: Vec<DVec3> =
            (0..64).map(|i| DVec3::new(f64::from(i % 4), f64::from(i / 4 % 4) * 3.0, 7.0)).collect();
        for count in 1..=7 {
            let views: Vec<_> = View::ALL[..count].iter().map(|view| view.axes()).collect();
            let arrangement = Arrangement::in_rows(&views, &points, [900, 700], 40, 26);
            assert!(arrangement.height <= 701);
            for (eye, placed) in arrangement.eyes(20.0).iter().zip(&arrangement.views) {
                let [left, top, width, height] = placed.part;
                let is_apart = |other: &PlacedView| {
                    let [x, y, wide, high] = other.part;
                    let gap = GAP as u32;
                    other.part == placed.part
                        || x >= left + width + gap
                        || left >= x + wide + gap
                        || y >= top + height + gap
                        || top >= y + high + gap
                };
                assert!(arrangement.views.iter().all(is_apart) && left >= 5 && left + width <= 895);
                assert!(left + width <= 900 && top >= 40 && top + height <= 742, "{:?}", placed.part);
                assert!(placed.holds((left as i32, top as i32)) && !placed.holds(((left + width) as i32, top as i32)));
                for point in &points {
                    let seen = eye.clip_from_world.project_point3(point.as_vec3());
                    assert!(seen.x.abs() < 1.0 && seen.y.abs() < 1.0 && (0.0..1.0).contains(&seen.z), "{seen}");
                }
            }
        }
    }
}
