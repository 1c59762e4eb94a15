//! Sets of numbers that grow together, each known by its least number (union–find).

/// Per number a lower one of its set; itself if it is the least, which leads the set.
pub(super) struct Leaders(Vec<usize>);

impl Leaders {
    /// The numbers from 0 up to, but not with, `count`, each in a set of its own.
    pub(super) fn alone(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The number that leads the set of `number`.
    pub(super) fn of(&mut self, mut number: usize) -> usize {
        while self.0[number] != number {
            self.0[number] = self.0[self.0[number]];
            number = self.0[number];
        }
        number
    }

    /// Makes one set of those of `a` and `b`.
    pub(super) fn join(&mut self, a: usize, b: usize) {
        let [a, b] = [a, b].map(|number| self.of(number));
        self.0[a.max(b)] = a.min(b);
    }
}
