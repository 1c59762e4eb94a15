//! Errors as JSON: m, rad, and shares of the force.

use serde_json::{Value, json};

use super::compared::ComparedLayouts;
use super::layout_errors::{LayoutErrors, Percentiles};
use crate::author::cell_spread;
use crate::body::Body;

impl LayoutErrors {
    /// How many there are, and the percentiles of each.
    pub fn as_json(&self) -> Value {
        let of = |percentiles: Option<Percentiles>| {
            percentiles
                .map(|Percentiles { count, median, p95 }| json!({"touches": count, "median": median, "p95": p95}))
        };
        json!({
            "taxels": self.taxels,
            "spacing": self.spacing_m,
            "touch_spacing": self.touch_spacing_m,
            "touches": self.touches.len(),
            "place": of(self.place_m()),
            "axis": of(self.axis_rad()),
            "force": of(self.force()),
        })
    }

    /// The same, with those of an ideal skin.
    pub fn as_json_with_ideal(&self, ideal: &Self) -> Value {
        let mut object = self.as_json();
        object["ideal"] = ideal.as_json();
        object
    }
}

impl ComparedLayouts {
    /// The errors of both layouts, which are those of `bodies` with these names.
    pub fn as_json(&self, names: [&str; 2], bodies: [&Body; 2]) -> Value {
        let layout = |side: usize| {
            let mut object = self.layouts[side].as_json_with_ideal(&self.ideal[side]);
            let cells = cell_spread(bodies[side].taxels.iter().map(|taxel| taxel.area));
            object["body"] = names[side].into();
            object["cells"] = json!(cells.map(|[low, high]| json!({"p5": low, "p95": high})));
            object["frame_s"] = self.frame_s[side].into();
            object
        };
        json!({
            "layouts": [layout(0), layout(1)],
            "same_places": self.same_places,
            "second_is_nearer": self.second_is_nearer(),
        })
    }
}
