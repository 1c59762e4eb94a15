//! What presses a field, as fitted to touches of the whole body, in the field's plane chart.

use glam::DVec3;
use somatic::body::Body;
use somatic::error::{Error, Result};
use somatic::field::FieldSet;
use somatic::{TouchFrame, TouchOutputs, touch};

/// What is asked of touches to have their fits.
pub(super) fn asked() -> touch::Options {
    let outputs = TouchOutputs::FIT_PLACE | TouchOutputs::FIT_DIRECTION | TouchOutputs::FIT_VELOCITY;
    touch::Options { outputs, ..touch::Options::default() }
}

/// A fit in a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartFit {
    /// (u, v), m.
    pub(super) place: [f64; 2],
    /// Its direction along, rad; none of a point.
    pub(super) angle: Option<f64>,
    /// Over 0.2 s, m/s.
    pub(super) velocity: Option<[f64; 2]>,
}

/// A field's plane chart on its link.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneChart {
    link: u32,
    origin: DVec3,
    axes: [DVec3; 2],
}

impl PlaneChart {
    /// The chart of `field` of `body`.
    pub(super) fn new(body: &Body, field: &str) -> Result<Self> {
        let fields = FieldSet::new(body)?.fields;
        let of_field = fields.iter().find(|of_body| of_body.name == field);
        let charted =
            of_field.and_then(|field| Some((field.anchor?, field.origin_in_anchor, field.chart.as_ref().ok()?)));
        let Some((link, origin, chart)) = charted else {
            return Err(Error::failed(format!("field `{field}` has no chart; name one that has")).at(&body.name));
        };
        Ok(Self { link: link as u32, origin, axes: [chart.u_in_anchor, chart.v_in_anchor] })
    }

    /// The fit of the touch with the largest total in a frame without poses, if it is on the chart's link.
    pub(super) fn fit(&self, found: Option<&TouchFrame>) -> Option<ChartFit> {
        let touch = found?.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total))?;
        let fit = touch.fit.filter(|_| touch.link == self.link)?;
        let along = |vector: DVec3| self.axes.map(|axis| vector.dot(axis));
        Some(ChartFit {
            place: along(fit.place - self.origin),
            angle: fit.direction.map(along).map(|[u, v]| libm::atan2(v, u)),
            velocity: fit.velocity.map(along),
        })
    }
}
