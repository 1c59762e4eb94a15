//! The truth of a simulated frame.

use std::f64::consts::PI;

use glam::DVec3;

/// The true state of one touch in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Index of the touch in the file.
    pub touch: usize,
    /// Its name; `touch 1` and so on where the file gives none.
    pub name: String,
    /// The link of the positions: the one that the file names, the field's anchor, or the one that bears most of a touch of the
    /// whole body.
    pub link: String,
    /// The field whose chart has (u, v) and the angle, if the file names one.
    pub field: Option<String>,
    /// Middle of the contact on the body's surface, m; of a touch of the whole body the surface point nearest to the mean of the
    /// pressure in space.
    pub position_in_link: DVec3,
    /// Outward unit normal there.
    pub normal_in_link: DVec3,
    /// The same point in the field's chart, m.
    pub uv: Option<[f64; 2]>,
    /// The angle of `direction_in_link` in the chart, or from the link's +x in the tangent plane, rad in [0, π).
    pub angle: Option<f64>,
    /// Mean velocity since the frame before, m/s; absent in a touch's first frame.
    pub velocity_in_link: Option<DVec3>,
    /// The same in the field's chart, m/s.
    pub velocity_uv: Option<[f64; 2]>,
    /// Length of `velocity_in_link`, m/s.
    pub speed: Option<f64>,
    /// Force along the normal, N; of a touch of the whole body the integral of the pressure.
    pub force_newton: f64,
    /// Unit vector along a rod, an edge, a strap or an ellipsoid, or from the first of a pair to the second, in the tangent plane.
    pub direction_in_link: Option<DVec3>,
    /// Unit vector along the footprint on the taxels: of a touch of the whole body, if it is longer than wide.
    pub principal_axis_in_link: Option<DVec3>,
    /// How far the indenter's lowest point is under the surface, m: of a touch of the whole body.
    pub depth_m: Option<f64>,
    /// Force along the skin, N, of a touch with friction on a body with taxels of three axes; so are the next three.
    pub shear_in_link: Option<DVec3>,
    /// The same along u and v of the field's chart, if that is plane.
    pub shear_uv: Option<[f64; 2]>,
    /// Moment about the outward normal, N m, counter-clockwise from outside.
    pub torsion: Option<f64>,
    /// Whether the indenter has slipped since the frame before.
    pub slips: Option<bool>,
    /// How far the indenter's lowest point is above the skin, m, if the body has proximity taxels: 0 while it presses, else as the file's
    /// `gap_m` has it. Absent of a touch of the whole body.
    pub gap_m: Option<f64>,
    /// The indenter's temperature, °C, if the file gives it.
    pub celsius: Option<f64>,
}

/// The angle of a line, in [0, π).
pub(super) fn line_angle(angle: f64) -> f64 {
    let turned = angle.rem_euclid(PI);
    if turned < PI { turned } else { 0.0 }
}
