//! What a scene asks of an engine and of tables.

use super::{Accuracy, SceneFile};
use crate::engine::Options;
use crate::error::{Error, Result};
use crate::percept::Outputs;
use crate::scene::{AskedOutputs, MotionFilter, Scene};
use crate::signal::{Calibration, Letter, Quantity, Receptor, UnitOfP};
use crate::sink::TableWish;
use crate::source::{ArrayMap, SourceSpec, VendorOptions};
use crate::touch;

impl SceneFile {
    /// What of it an engine is asked: what is computed, and how. The rest says where frames come from and go to, and how a run is shown.
    #[must_use]
    pub fn of_engine(&self) -> Self {
        let knobs = self.accuracy;
        Self {
            outputs: self.outputs.clone(),
            touch: self.touch,
            fields: self.fields.clone(),
            letters: self.letters.clone(),
            signal: self.signal.clone(),
            backend: self.backend,
            batch: self.batch,
            tare: self.tare,
            coordinates: self.coordinates,
            relative_to: self.relative_to.clone(),
            contact_tolerance_m: self.contact_tolerance_m,
            max_gap_s: self.max_gap_s,
            max_age_s: self.max_age_s,
            filter_window: self.filter_window.clone(),
            filter_by: self.filter_by,
            filter_time_s: self.filter_time_s,
            filter_over_s: self.filter_over_s,
            accuracy: Accuracy { centroid_m: None, orientation_rad: None, budget_s: None, ..knobs },
            ..Self::default()
        }
    }

    /// The outputs of fields that it names; if it names none, those that are usual.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        AskedOutputs::all_of(&self.outputs).of_fields
    }

    /// What is asked of touches of the whole body; `None` looks for none.
    #[must_use]
    pub fn touches(&self) -> Option<touch::Options> {
        let outputs = AskedOutputs::all_of(&self.outputs).of_touches?;
        // Nobody has asked for them, and there are no pressures to find them in.
        let is_in_vain =
            self.outputs.is_empty() && !self.letters.is_empty() && !self.letters.contains(&Receptor::Sustained);
        (!is_in_vain).then(|| self.touch.unwrap_or_default().options(outputs))
    }

    /// What tables have of that.
    #[must_use]
    pub fn tables(&self, wide: bool) -> TableWish {
        TableWish::new(self.outputs(), self.touches().is_some(), wide)
    }

    /// The engine's options under `calibration`, for calls of `batch` frames. Whether anybody knows where the sensors are is
    /// `is_placed`.
    ///
    /// # Errors
    /// A usage error: the filter of motion is not a filter.
    pub fn engine_options(&self, calibration: Option<Calibration>, is_placed: bool, batch: usize) -> Result<Options> {
        let usual = Scene::default();
        // Boards' values have their age where frames are put together.
        let is_merged =
            self.sources.iter().any(|source| matches!(source, SourceSpec::Serial { .. } | SourceSpec::Zenoh(_)));
        let scene = Scene::default()
            .outputs(self.outputs_under(calibration.as_ref(), is_placed))
            .fields(self.fields.clone())
            .max_age_s(self.max_age_s.filter(|_| !is_merged).unwrap_or(usual.max_age_s))
            .max_gap_s(self.max_gap_s.unwrap_or(usual.max_gap_s))
            .letters(self.letters_read())
            .filter(self.filter()?)
            .knobs(self.accuracy.knobs())
            .contact_tolerance_m(self.contact_tolerance_m)
            // Without places of sensors there is no place of a touch.
            .touches(self.touches().filter(|_| is_placed))
            .relative_to(self.relative_to.clone())
            .coordinates(self.coordinates.unwrap_or(usual.coordinates));
        Ok(Options::default()
            .scene(scene)
            .calibration(calibration)
            .backend(self.backend.unwrap_or_default())
            .tare(self.tare)
            .batch(batch))
    }

    /// The letters that it names, in its signals; none where it names neither, which means those that the taxels have.
    fn letters_read(&self) -> Vec<Letter> {
        match (self.letters.is_empty(), self.signal.is_empty()) {
            (true, true) => Vec::new(),
            (true, false) => Letter::all_of(&[Receptor::Sustained], &self.signal),
            (false, _) => Letter::all_of(&self.letters, &self.signal),
        }
    }

    /// The outputs that are asked for; if none are, those that `calibration` and what is read can give.
    fn outputs_under(&self, calibration: Option<&Calibration>, is_placed: bool) -> Outputs {
        if !self.outputs.is_empty() {
            return self.outputs();
        }
        let has_unit =
            |calibration: &Calibration| calibration.taxels.iter().any(|taxel| taxel.quantity != Quantity::Count);
        match (is_placed, calibration.is_some_and(has_unit)) {
            // Sensors without known places.
            (false, _) => Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE,
            (true, true) => self.outputs() | Outputs::FORCE,
            (true, false) => self.outputs(),
        }
    }

    /// Which motion counts.
    ///
    /// # Errors
    /// A usage error: it says something of a filter that is not used, or that is none.
    pub(super) fn filter(&self) -> Result<MotionFilter> {
        let usual = MotionFilter::default();
        let given = [
            ("filter_window", self.filter_window.is_some()),
            ("filter_by", self.filter_by.is_some()),
            ("filter_time_s", self.filter_time_s.is_some()),
            ("filter_over_s", self.filter_over_s.is_some()),
        ];
        let is_measured = self.outputs().intersects(Outputs::FILTERED);
        if let Some((key, _)) = given.iter().find(|(_, given)| *given && !is_measured) {
            return Err(Error::usage(format!(
                "`{key}` is for outputs that are not asked for; add `outputs = \"filtered_direction\"`, or others of filtered_*"
            )));
        }
        let by_window = &given[1..3];
        if let Some((key, _)) = by_window.iter().find(|(_, given)| *given && self.filter_over_s.is_some()) {
            return Err(Error::usage(format!("`{key}` has no effect with `filter_over_s`; leave one of them out")));
        }
        let filter = usual
            .by(self.filter_by.unwrap_or(usual.by))
            .time_constant_s(self.filter_time_s.unwrap_or(usual.time_constant_s));
        let filter = self.filter_window.as_ref().map_or(Ok(filter), |window| filter.with_window(window))?;
        let is_by_window = by_window.iter().any(|(_, given)| *given);
        Ok(filter.over_s(self.filter_over_s.or(filter.over_s.filter(|_| !is_by_window))))
    }

    /// Options of a pressure system's export, besides what its file says.
    ///
    /// # Errors
    /// A usage error: a grid, a pitch or a unit is none, or a key of text is not written so.
    pub fn export_options(&self) -> Result<VendorOptions> {
        let map = self.map.as_deref().or_else(|| self.sources.iter().find_map(SourceSpec::usual_map));
        Ok(VendorOptions {
            format: self.format,
            rate_hz: self.rate_hz,
            grid: self.grid.as_deref().map(VendorOptions::grid_of).transpose()?,
            pitch_m: self.pitch.as_deref().map(VendorOptions::pitch_of).transpose()?,
            unit: self.unit.as_deref().map(str::parse::<UnitOfP>).transpose().map_err(|e| e.at("`unit`"))?,
            layout: self.layout.clone(),
            skip_bad: self.skip_bad,
            text: self.text.options()?,
            map: map.map(ArrayMap::named).transpose().map_err(|e| e.at("`map`"))?,
        })
    }
}
