//! A quantity over time, in few buckets however long it goes on.

/// Most buckets of a series: over two for each pixel of a panel.
const MAX_BUCKETS: usize = 4096;

/// The values of some frames that follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bucket {
    /// Time of the first frame, s.
    pub(super) t_s: f64,
    /// The least and the greatest value; none where it is absent in all frames.
    pub(super) range: Option<[f64; 2]>,
}

/// A quantity over time: the least and greatest value of as many frames as are needed to have few buckets.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) buckets: Vec<Bucket>,
    /// Frames of a bucket.
    frames: u64,
    /// Frames in the last bucket.
    in_last: u64,
}

impl Default for Series {
    fn default() -> Self {
        Self { buckets: Vec::new(), frames: 1, in_last: 1 }
    }
}

impl Series {
    pub(super) fn push(&mut self, t_s: f64, value: Option<f64>) {
        let new = Bucket { t_s, range: value.map(|value| [value; 2]) };
        if self.in_last < self.frames
            && let Some(last) = self.buckets.last_mut()
        {
            *last = joined(*last, new);
            self.in_last += 1;
            return;
        }
        if self.buckets.len() == MAX_BUCKETS {
            self.buckets =
                self.buckets.chunks(2).map(|pair| pair.iter().copied().reduce(joined).unwrap_or(pair[0])).collect();
            self.frames *= 2;
        }
        self.buckets.push(new);
        self.in_last = 1;
    }

    /// The least and greatest of all values.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        let ranges = self.buckets.iter().filter_map(|bucket| bucket.range);
        ranges.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)])
    }
}

fn joined(one: Bucket, other: Bucket) -> Bucket {
    let range = match (one.range, other.range) {
        (Some([low, high]), Some([l, h])) => Some([low.min(l), high.max(h)]),
        (range, None) | (None, range) => range,
    };
    Bucket { t_s: one.t_s, range }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_series_keeps_its_extremes_in_few_buckets() {
        let mut series = Series::default();
        for frame in 0..1_000_000_u32 {
            let value = if frame == 777_777 { 99.0 } else { f64::from(frame % 10) };
            series.push(f64::from(frame), (frame != 5).then_some(value));
        }
        assert!(series.buckets.len() <= MAX_BUCKETS && series.buckets.len() > MAX_BUCKETS / 4);
        assert_eq!(series.range(), Some([0.0, 99.0]));
        assert!(series.buckets.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
        let peak = series.buckets.iter().rposition(|bucket| bucket.t_s <= 777_777.0).unwrap();
        assert_eq!(series.buckets[peak].range.unwrap()[1], 99.0);
    }
}
