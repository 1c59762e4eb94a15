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

from typing import TYPE_CHECKING, Any

from ._accuracy import Calibrated, Tradeoff, calibrate, tradeoff
from ._columns import Table
from ._commands import Compared, bench, compare, info, inspect, outputs, plan, plot
from ._errors import InputError, SomaticError, UnknownNameError, UsageError
from ._flags import Flags, TouchFlags
from ._live import live
from ._native import (
    Body,
    Calibration,
    Engine,
    EngineState,
    Field,
    Live,
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
    convert,
    metadata,
    open,
    read,
    render,
    run,
    simulate,
    write,
)
from ._view import Shown, view

if TYPE_CHECKING:
    from . import batch as batch
else:

    def __getattr__(name: str) -> Any:
        """`batch`, which is imported by its first use: few need it, and it takes time."""
        if name == "batch":
            import importlib

            return importlib.import_module(".batch", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "Body",
    "Calibrated",
    "Calibration",
    "Compared",
    "Engine",
    "EngineState",
    "Field",
    "Flags",
    "InputError",
    "Live",
    "Parts",
    "Percepts",
    "Picture",
    "Recording",
    "Scene",
    "SelfContacts",
    "Shown",
    "Simulation",
    "SomaticError",
    "Table",
    "TouchFlags",
    "Touches",
    "Tradeoff",
    "UnknownNameError",
    "UsageError",
    "View",
    "__version__",
    "author",
    "bench",
    "calibrate",
    "compare",
    "convert",
    "info",
    "inspect",
    "live",
    "metadata",
    "open",
    "outputs",
    "plan",
    "plot",
    "read",
    "render",
    "run",
    "simulate",
    "tradeoff",
    "view",
    "write",
]
