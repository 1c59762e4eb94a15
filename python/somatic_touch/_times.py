"""Dates as times: seconds since 1970 in UTC."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import UsageError


def seconds(times: npt.NDArray[Any]) -> npt.NDArray[np.float64] | None:
    """`times` in seconds if they are dates or spans of time: since 1970 in UTC, or as long as they are; else None.

    Dates without a time zone are in UTC, as NumPy and pandas have them.

    >>> seconds(np.array(["1970-01-02", "1970-01-02T00:00:00.25"], "datetime64[ms]"))
    array([86400.  , 86400.25])
    """
    if times.dtype.kind == "O":
        if times.size == 0 or not all(isinstance(time, (datetime.datetime, datetime.timedelta, np.datetime64)) for time in times.flat):
            return None
        return np.array([_second(time) for time in times.flat], np.float64).reshape(times.shape)
    if times.dtype.kind not in "Mm":
        return None
    absent = np.isnat(times)
    if absent.any():
        raise UsageError(f"t: frame {int(np.argmax(absent.ravel()))} has no time (NaT); leave such frames out")
    since = times - np.datetime64(0, "s") if times.dtype.kind == "M" else times
    whole = since.astype("timedelta64[s]")
    # By parts, as the whole in nanoseconds has more digits than a double.
    rest: npt.NDArray[np.float64] = (since - whole) / np.timedelta64(1, "s")
    made: npt.NDArray[np.float64] = whole.astype(np.float64) + rest
    return made


def _second(time: datetime.datetime | datetime.timedelta | np.datetime64) -> float:
    if isinstance(time, (np.datetime64, datetime.timedelta)) and not isinstance(time, datetime.datetime):
        if isinstance(time, datetime.timedelta) and time == time:
            return time.total_seconds()
        made = seconds(np.asarray([time], "datetime64"))
        assert made is not None
        return float(made[0])
    if time != time:
        raise UsageError("t: a frame has no time (NaT); leave such frames out")
    return (time if time.tzinfo else time.replace(tzinfo=datetime.UTC)).timestamp()
