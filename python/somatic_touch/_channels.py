"""Whose the values of a frame are, in files that do not name them."""

from __future__ import annotations

import math

from . import _native


def in_frames(shape: tuple[int, ...], body: _native.Body | None) -> list[str] | None:
    """The names of the channels of a frame of `shape`, row by row; None if the body has another number.

    They are those of the body, in their order. Where all of its taxels have three axes and so has the last axis of `shape`, the three values of a
    taxel are beside each other.

    >>> import somatic_touch as st
    >>> pad = st.Body.from_arrays([[0, 0, 0], [0.01, 0, 0]], [[0, 0, 1]] * 2, modality="force3")
    >>> in_frames((2, 3), pad), in_frames((6,), pad), in_frames((5,), pad)
    (['0', '0.u', '0.v', '1', '1.u', '1.v'], ['0', '1', '0.u', '1.u', '0.v', '1.v'], None)
    """
    width = math.prod(shape)
    if body is None:
        return [str(number) for number in range(width)]
    names = body.channels
    if len(names) != width:
        return None
    taxels = len(body.taxels)
    if len(shape) > 1 and shape[-1] == 3 and 3 * taxels == width:
        return [names[taxel + axis * taxels] for taxel in range(taxels) for axis in range(3)]
    return names


def called(body: _native.Body) -> str:
    """How many values its frames have, in words."""
    taxels, values = len(body.taxels), len(body.channels)
    return f"{taxels} taxels" + ("" if taxels == values else f" with {values} values")
