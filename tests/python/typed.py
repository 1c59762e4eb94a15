"""What a type checker is to say of code that uses the package; checked, never run."""

from __future__ import annotations

from typing import assert_type

import numpy as np
import numpy.typing as npt

import somatic_touch as st

body = st.Body.bundled("hand")
engine = st.Engine(body, {"outputs": ["total"]}, backend="cpu")
p = engine.process([0.0], np.zeros((1, 40), np.float32))
assert_type(p, st.Percepts)
assert_type(p.contact, npt.NDArray[np.bool_])
assert_type(p.touches.id, npt.NDArray[np.uint64])
assert_type(body.fields["hand/back"].uv, npt.NDArray[np.float64] | None)
assert_type(st.read("a.csv").calibration, st.Calibration | None)
assert_type(engine.verify([0.0], [[0.0] * 40])["quantities"]["total"]["worst_share"], float)
engine.step("now", [0.0] * 40)  # type: ignore[arg-type]
st.Engine(body, backend="gpus")  # type: ignore[arg-type]
