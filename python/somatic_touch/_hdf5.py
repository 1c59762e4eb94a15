"""Recordings in HDF5, by the paths of their datasets."""

from __future__ import annotations

import importlib
import math
import re
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._channels import called, in_frames
from ._errors import InputError, SomaticError, UsageError

# By how much a second is more than one of these. Seconds have no ending, as most datasets of times.
_UNITS = {"s": 1, "sec": 1, "seconds": 1, "ms": 1e3, "millis": 1e3, "milliseconds": 1e3, "us": 1e6, "microseconds": 1e6, "ns": 1e9, "nanoseconds": 1e9}
_LISTED = 12


def read(
    path: str,
    dataset: str | None,
    time: str | None,
    rate_hz: float | None,
    body: _native.Body | None,
    from_s: float | None,
    to_s: float | None,
) -> _native.Recording:
    """The frames of `dataset` in the file at `path`, at the times of `time` or at `rate_hz`."""
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError as error:
        raise SomaticError(f"{path}: HDF5 is read by h5py; run `pip install h5py`", path) from error
    try:
        with h5py.File(path, "r") as file:
            found = _datasets(file, h5py)
            values, shape = _frames(path, found, dataset)
            t = _times(path, found, time, rate_hz, len(values))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file or directory", path) from error
    except SomaticError:
        raise
    except (OSError, RuntimeError, KeyError) as error:
        # So h5py tells of damage.
        text = str(error).splitlines() or [type(error).__name__]
        raise InputError(f"{path}: {text[0]}; is it HDF5, and whole?", path) from error
    start = t[0] if len(t) else 0.0
    kept = (t - start >= (0 if from_s is None else from_s)) & (t - start <= (np.inf if to_s is None else to_s))
    whole = slice(None) if from_s is None and to_s is None else kept
    channels = _channels(path, shape, body)
    made: _native.Recording = _native.Recording._of_parts(  # type: ignore[attr-defined]
        path, channels, t[whole], np.ascontiguousarray(values[whole]), {}, body, None, False, []
    )
    return made


def _datasets(file: Any, h5py: Any) -> dict[str, Any]:
    """All datasets of numbers, by path."""
    found: dict[str, Any] = {}

    def see(name: str, thing: Any) -> None:
        if isinstance(thing, h5py.Dataset) and thing.dtype.kind in "iufb" and thing.shape:
            found[name] = thing

    file.visititems(see)
    return found


def _listed(found: dict[str, Any]) -> str:
    words = [f"{name} {list(thing.shape)}" for name, thing in found.items()]
    more = ", …" if len(words) > _LISTED else ""
    return (", ".join(words[:_LISTED]) + more) or "none of numbers"


def _frames(path: str, found: dict[str, Any], wanted: str | None) -> tuple[npt.NDArray[np.float32], tuple[int, ...]]:
    """The values, [frames, values], of several dimensions row by row; and the shape of a frame."""
    if wanted is None:
        many = [name for name, thing in found.items() if thing.ndim > 1]
        if len(many) != 1:
            raise UsageError(f"{path}: name the dataset of the values with dataset=; there are {_listed(found)}", path)
        wanted = many[0]
    thing = found.get(wanted.strip("/"))
    if thing is None:
        raise UsageError(f"{path}: there is no dataset `{wanted}`; there are {_listed(found)}", path)
    values = np.asarray(thing[()], np.float32)
    shape = values.shape[1:] or (1,)
    return values.reshape(len(values), math.prod(shape)), shape


def _times(path: str, found: dict[str, Any], wanted: str | None, rate_hz: float | None, frames: int) -> npt.NDArray[np.float64]:
    """The time of each frame, s."""
    if (wanted is None) == (rate_hz is None):
        fits = {name: thing for name, thing in found.items() if thing.shape == (frames,)}
        beside = f"; these have one number a frame: {_listed(fits)}" if fits else ""
        raise UsageError(f"{path}: give time=, the dataset of the times, or rate_hz={beside}", path)
    if wanted is None or rate_hz is not None:
        if not (rate_hz is not None and np.isfinite(rate_hz) and rate_hz > 0):
            raise UsageError(f"rate_hz={rate_hz} is not a frame rate; give a positive number of Hz")
        return np.arange(frames) / rate_hz
    thing = found.get(wanted.strip("/"))
    if thing is None:
        raise UsageError(f"{path}: there is no dataset `{wanted}`; there are {_listed(found)}", path)
    t = np.asarray(thing[()], np.float64).reshape(-1)
    if len(t) != frames:
        raise UsageError(f"{path}: `{wanted}` has {len(t)} times, for {frames} frames; name another dataset", path)
    if not np.isfinite(t).all():
        raise InputError(f"{path}: `{wanted}`: frame {int(np.argmin(np.isfinite(t)))} has no time; remove it", path, wanted)
    return t / _a_second(wanted, thing)


def _a_second(name: str, thing: Any) -> float:
    """How many of its units a second has: by its attribute `units`, else by the end of its name, else it is in seconds."""
    units = thing.attrs.get("units", thing.attrs.get("unit"))
    if isinstance(units, bytes):
        units = units.decode(errors="replace")
    ending = re.search(r"_([a-z]+)$", name)
    words = [str(units).strip().lower() if units is not None else "", ending.group(1) if ending else ""]
    return next((_UNITS[word] for word in words if word in _UNITS), 1)


def _channels(path: str, shape: tuple[int, ...], body: _native.Body | None) -> list[str]:
    names = in_frames(shape, body)
    if names is None:
        assert body is not None
        what = f"a frame has {math.prod(shape)} values, and body `{body.name}` has {called(body)}"
        raise UsageError(f"{path}: {what}; give the body of this sensor", path)
    return names
