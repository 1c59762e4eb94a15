//! Outputs by their stages, their letters and their names.

use super::columns::{COLUMNS, Column, Outputs};

impl Outputs {
    /// What is given unless something else is asked for: [`Outputs::USUAL_AND_MOTION`] without [`Outputs::MOTION`], which is from frame to
    /// frame: between two frames noise moves a centroid more than a finger does.
    pub const USUAL: Self = Self::USUAL_AND_MOTION.difference(Self::MOTION);

    /// What is computed from a frame and the one before it: all but [`Outputs::SELF_CONTACTS`], [`Outputs::FILTERED`],
    /// [`Outputs::SIGMAS`], [`Outputs::SPEED_IN_WORLD`], [`Outputs::FORCE`], which depends on the calibration, and
    /// [`Outputs::OF_OTHER_LETTERS`], which depend on the taxels.
    pub const USUAL_AND_MOTION: Self = Self::all()
        .difference(Self::SELF_CONTACTS)
        .difference(Self::FILTERED)
        .difference(Self::SIGMAS)
        .difference(Self::SPEED_IN_WORLD)
        .difference(Self::FORCE)
        .difference(Self::OF_OTHER_LETTERS);

    /// Counts, and ids of taxels.
    pub(super) const WHOLE: Self = Self::ACTIVE
        .union(Self::WARMEST_TAXEL)
        .union(Self::COLDEST_TAXEL)
        .union(Self::NEAREST_TAXEL)
        .union(Self::COVERED);

    /// What other letters give: of shear, temperature and proximity.
    pub const OF_OTHER_LETTERS: Self =
        Self::of_stage("shear").union(Self::of_stage("temperature")).union(Self::of_stage("proximity"));

    /// How sure quantities are.
    pub const SIGMAS: Self = Self::of_stage("sigma");

    /// Motion that counts, of [`crate::scene::MotionFilter`].
    pub const FILTERED: Self = Self::of_stage("filter");

    /// What the stage *motion* gives.
    pub const MOTION: Self = Self::of_stage("motion");

    /// What stage `stage` gives.
    pub(crate) const fn of_stage(stage: &str) -> Self {
        let (mut outputs, mut i) = (Self::empty(), 0);
        while i < COLUMNS.len() {
            if is_same(COLUMNS[i].stage.as_bytes(), stage.as_bytes()) {
                outputs = outputs.union(COLUMNS[i].output);
            }
            i += 1;
        }
        outputs
    }

    /// The outputs' names as the command line and NDJSON spell them, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }

    /// The one output called `name`, if there is one.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        (name == name.to_lowercase()).then(|| Self::from_name(&name.to_uppercase())).flatten()
    }

    /// The columns of these outputs, in the table's order.
    pub fn columns(self) -> impl Iterator<Item = &'static Column> {
        COLUMNS.iter().filter(move |column| self.contains(column.output))
    }
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    match (a, b) {
        ([], []) => true,
        ([x, a @ ..], [y, b @ ..]) => *x == *y && is_same(a, b),
        _ => false,
    }
}
