"""How fast a value changes over a window of time, for `oracle.py`."""

from collections import deque

import numpy as np

from calibrated import Value

EPSILON = float(np.finfo(np.float64).eps)


class Slope:
    """The line of least squares through the last `window` seconds and the last sample before them, of which samples nearer than a
    128th replace the newest. What is sampled is moved by members alone that have a value before and after."""

    def __init__(self, window):
        self.window, self.kept, self.level, self.before = window, deque(), 0.0, {}

    def clear(self):
        self.kept.clear()
        self.before = {}

    def follow(self, t, now, of, size):
        """`now` has the members' values, and `of` makes one of some of them, or None."""
        both = [member for member in now if member in self.before]
        was, value = of({member: self.before[member] for member in both}), of({member: now[member] for member in both})
        if was is None or value is None:
            self.kept.clear()
            self.level = of(now)
        else:
            self.level += value - was
        self.before = now
        return self.take(t, self.level, size)

    def take(self, t, value, size):
        # What a time of this size, and a difference of two, lose to rounding.
        slack = 1e-9 * self.window + 2 * EPSILON * abs(t)
        if self.kept and t <= self.kept[-1][0]:
            self.kept.clear()
        # After a gap of two windows in frames that were not slow, nothing is known of before.
        are_slow = len(self.kept) < 2 or self.kept[-1][0] - self.kept[-2][0] > self.window + slack
        if not are_slow and t - self.kept[-1][0] > 2 * self.window + slack:
            self.kept.clear()
        if len(self.kept) > 1 and self.kept[-1][0] - self.kept[-2][0] < self.window / 128:
            self.kept.pop()
        self.kept.append((t, value, size))
        while len(self.kept) > 1 and t - self.kept[1][0] >= self.window - slack:
            self.kept.popleft()
        if len(self.kept) > 2 and t - self.kept[0][0] > 2 * self.window + slack:
            self.kept.popleft()
        if t - self.kept[0][0] < self.window / 2 - slack:
            return None
        times, values, sizes = np.array(self.kept).T
        away = times - times[0]
        away -= away.mean()
        size = np.abs(values).max() + sizes.max()
        return Value((away * (values - values.mean())).sum() / (away**2).sum(), size / (t - times[0]))
