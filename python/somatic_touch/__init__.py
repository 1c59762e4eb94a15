"""A sense of touch for whole robots: touch frames in, percepts out.

>>> import numpy as np
>>> import somatic_touch as st
>>> body = st.Body.bundled("hand")
>>> engine = st.Engine(body, {"outputs": ["total", "centroid"]}, backend="cpu")
>>> frame = np.zeros(40, np.float32)
>>> frame[:9] = 10 * np.arange(9)
>>> p = engine.step(0.0, frame)
>>> p["total"][0, p.index("hand/palm")]
np.float32(360.0)
"""

from ._errors import InputError, SomaticError, UnknownNameError, UsageError
from ._flags import Flags, TouchFlags
from ._native import (
    Body,
    Calibration,
    Engine,
    EngineState,
    Field,
    Parts,
    Percepts,
    Picture,
    Recording,
    Scene,
    SelfContacts,
    Simulation,
    Touches,
    View,
    __version__,
    author,
    metadata,
    open,
    read,
    render,
    run,
    simulate,
    write,
)

__all__ = [
    "Body",
    "Calibration",
    "Engine",
    "EngineState",
    "Field",
    "Flags",
    "InputError",
    "Parts",
    "Percepts",
    "Picture",
    "Recording",
    "Scene",
    "SelfContacts",
    "Simulation",
    "SomaticError",
    "TouchFlags",
    "Touches",
    "UnknownNameError",
    "UsageError",
    "View",
    "__version__",
    "author",
    "metadata",
    "open",
    "read",
    "render",
    "run",
    "simulate",
    "write",
]
