"""Rows and frames of touches, and whether percepts are the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _native
from ._flags import TouchFlags


def by_frame(found: Any, frames: int) -> Iterator[Any]:
    """The part of each frame."""
    for frame in range(frames):
        yield found._of_frame(frame)


def rows(found: Any) -> Iterator[dict[str, Any]]:
    """A dict for each row; what is absent of a row is not in its dict."""
    columns = {name: found[name] for name in found.keys()}
    for index in range(len(found)):
        row: dict[str, Any] = {}
        for name, column in columns.items():
            value = column[index]
            if name == "flags":
                row[name] = TouchFlags(value)
            elif isinstance(value, str):
                row[name] = value
            elif value.dtype.kind != "f" or not np.isnan(value).all():
                row[name] = value if value.ndim else value.item()
        yield row


def are_same_percepts(a: _native.Percepts, b: _native.Percepts) -> bool:
    """Whether both say the same of the same frames."""
    if a.keys() != b.keys() or a.fields != b.fields or a.first_frame != b.first_frame:
        return False
    if not (np.array_equal(a.t, b.t, equal_nan=True) and np.array_equal(a.flags, b.flags) and np.array_equal(a.in_world, b.in_world)):
        return False
    for name in a.keys():
        if a[name].dtype != b[name].dtype or not np.array_equal(a.present(name), b.present(name)):
            return False
        if not np.array_equal(a[name], b[name], equal_nan=a[name].dtype.kind == "f"):
            return False
    return all(_are_same_rows(_part(a, part), _part(b, part)) for part in ("touches", "self_contacts"))


def _part(p: _native.Percepts, name: str) -> Any:
    try:
        return getattr(p, name)
    except ValueError:
        return None


def _are_same_rows(a: Any, b: Any) -> bool:
    if a is None or b is None:
        return a is b
    return a.keys() == b.keys() and all(
        np.array_equal(a[name], b[name], equal_nan=np.asarray(a[name]).dtype.kind == "f") for name in a.keys()
    )


def are_same_recordings(a: _native.Recording, b: _native.Recording) -> bool:
    """Whether both have the same bits."""
    return (
        a.channels == b.channels
        and a.losses == b.losses
        and a.body == b.body
        and a.calibration == b.calibration
        and _are_same_bits(a.t, b.t)
        and _are_same_bits(a.values, b.values)
        and a.pose.keys() == b.pose.keys()
        and all(_are_same_bits(pose, b.pose[link]) for link, pose in a.pose.items())
    )


def _are_same_bits(a: Any, b: Any) -> bool:
    return bool(a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes())
