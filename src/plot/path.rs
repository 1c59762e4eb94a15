//! The path of a centre of pressure, thinned out evenly where it is long.

/// Most points of a path.
const MAX_POINTS: usize = 8192;

/// Points (u, v), m, one list for each contact.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub(super) runs: Vec<Vec<(f64, f64)>>,
    points: usize,
    /// One point in this many is kept.
    step: usize,
    seen: usize,
    in_contact: bool,
}

impl Default for Path {
    fn default() -> Self {
        Self { runs: Vec::new(), points: 0, step: 1, seen: 0, in_contact: false }
    }
}

impl Path {
    /// Takes the next point, or that there is none.
    pub(super) fn push(&mut self, point: Option<[f64; 2]>) {
        let Some([u, v]) = point else {
            self.in_contact = false;
            return;
        };
        if !std::mem::replace(&mut self.in_contact, true) {
            self.runs.push(Vec::new());
            self.seen = 0;
        }
        self.seen += 1;
        if !(self.seen - 1).is_multiple_of(self.step) {
            return;
        }
        if let Some(run) = self.runs.last_mut() {
            run.push((u, v));
            self.points += 1;
        }
        if self.points > MAX_POINTS {
            self.step = self.step.saturating_mul(2);
            for run in &mut self.runs {
                let mut index = 0;
                run.retain(|_| {
                    index += 1;
                    (index - 1) % 2 == 0
                });
            }
            self.points = self.runs.iter().map(Vec::len).sum();
            // Contacts of a single frame: the first ones are kept.
            if self.points > MAX_POINTS {
                self.runs.truncate(MAX_POINTS / 2);
                self.points = self.runs.iter().map(Vec::len).sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_path_is_thinned_and_contacts_stay_apart() {
        let mut path = Path::default();
        for frame in 0..300_000_u32 {
            let there = frame % 1000 < 900;
            path.push(there.then(|| [f64::from(frame % 1000), f64::from(frame / 1000)]));
        }
        assert!(path.points <= MAX_POINTS + 1 && path.runs.len() == 300);
        for (contact, run) in path.runs.iter().enumerate() {
            assert!(!run.is_empty() && run.iter().all(|&(_, v)| v == contact as f64));
            assert!(run.windows(2).all(|pair| pair[0].0 < pair[1].0));
        }
    }

    #[test]
    fn contacts_of_single_frames_are_no_longer_thinned_when_the_step_is_as_large_as_it_gets() {
        let mut path = Path::default();
        for frame in 0..600_000_u32 {
            path.push(frame.is_multiple_of(2).then(|| [f64::from(frame), 0.0]));
        }
        assert!(path.step == usize::MAX && path.points <= MAX_POINTS && path.runs[1] == [(2.0, 0.0)]);
    }
}
