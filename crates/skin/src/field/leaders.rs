//! Numbers that are put together, by the least of each set (union–find).

/// Per number of a set its leader: the least of the set.
pub(super) struct Leaders(Vec<usize>);

impl Leaders {
    /// The numbers from 0 to `count`, each alone.
    pub(super) fn alone(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The leader of the set that has `number`.
    pub(super) fn of(&mut self, mut number: usize) -> usize {
        while self.0[number] != number {
            self.0[number] = self.0[self.0[number]];
            number = self.0[number];
        }
        number
    }

    /// Puts the sets together that have `a` and `b`.
    pub(super) fn join(&mut self, a: usize, b: usize) {
        let [a, b] = [a, b].map(|number| self.of(number));
        self.0[a.max(b)] = a.min(b);
    }
}
