"""Your own driver in a control loop: a frame in, percepts out, some microseconds each."""

import time

import numpy as np
import somatic_touch as st

body = st.Body.grid(16, 16, 0.005, name="palm")
calibration = st.Calibration("[all]\nbaseline = 100\ngain = 0.5\ndead_band = 4\nunit = 'kPa'", body)
engine = st.Engine(body, {"outputs": ["force", "centroid", "speed"]}, calibration, "cpu")

random = np.random.default_rng(1)
rows, columns = np.divmod(np.arange(256), 16)


def sensor(t: float) -> np.ndarray:
    """What your driver reads: here a finger that circles, with noise."""
    distance = np.hypot(rows - 8 - 4 * np.sin(3 * t), columns - 8 - 4 * np.cos(3 * t))
    return np.asarray(100 + 400 * np.exp(-((distance / 1.5) ** 2)) + random.normal(0, 1, 256), np.float32)


took = []
frame = sensor(0.0)
for step in range(400):
    t = 0.005 * step
    frame = sensor(t)
    begin = time.perf_counter()
    p = engine.step(t, frame)
    took.append(time.perf_counter() - begin)
    if step % 100 == 0 and p.contact[0, 0]:
        u, v = 1000 * p["centroid"][0, 0]
        print(f"{t:4.2f} s: {p['force'][0, 0]:5.1f} N at ({u:5.1f}, {v:5.1f}) mm, {p['speed'][0, 0]:.3f} m/s")
print(f"a step of {len(frame)} taxels takes {1e6 * np.median(took):.0f} µs in the median")
