"""The bits of `Percepts.flags` and of `Touches.flags`."""

from __future__ import annotations

import enum
import operator


class _Flags(enum.IntFlag):
    @classmethod
    def _missing_(cls, value: object) -> object:
        # NumPy's integers are none of Python's.
        return super()._missing_(operator.index(value))  # type: ignore[arg-type]

    def __str__(self) -> str:
        return self.name or (str(int(self)) if self else "none")


class Flags(_Flags):
    """Why a quantity is absent or in doubt, and what was wrong with the input.

    >>> import somatic_touch as st
    >>> st.Flags.STILL | st.Flags.TIE
    <Flags.TIE|STILL: 36>
    >>> print(st.Flags(4), st.Flags(0))
    TIE none
    """

    NO_CONTACT = 1 << 0
    ONE_TAXEL = 1 << 1
    TIE = 1 << 2
    COINCIDENT = 1 << 3
    ISOTROPIC = 1 << 4
    STILL = 1 << 5
    SATURATED = 1 << 6
    FAULTY_INPUT = 1 << 7
    OUT_OF_RANGE = 1 << 8
    INCOMPLETE = 1 << 9
    NO_CHART = 1 << 10
    NO_PREVIOUS = 1 << 11
    BAD_DT = 1 << 12
    STALE = 1 << 13
    SEVERAL = 1 << 14
    HELD = 1 << 16
    JUMPED = 1 << 17
    DRIFT_UNKNOWN = 1 << 18
    NO_UNIT = 1 << 19
    NO_GRADIENT = 1 << 20
    NOISE_UNKNOWN = 1 << 25
    UNSURE = 1 << 26
    STALE_POSE = 1 << 27
    NO_POSE = 1 << 28


class TouchFlags(_Flags):
    """Why a quantity of a touch is absent or in doubt, and what was wrong with the input.

    >>> import somatic_touch as st
    >>> st.TouchFlags.YOUNG | st.TouchFlags.NO_UNIT
    <TouchFlags.YOUNG|NO_UNIT: 8256>
    """

    ONE_TAXEL = 1 << 0
    TIE = 1 << 1
    COINCIDENT = 1 << 2
    ISOTROPIC = 1 << 3
    WRAPPED = 1 << 4
    SEVERAL_LINKS = 1 << 5
    YOUNG = 1 << 6
    MERGED = 1 << 7
    SATURATED = 1 << 8
    FAULTY_INPUT = 1 << 9
    OUT_OF_RANGE = 1 << 10
    INCOMPLETE = 1 << 11
    STALE = 1 << 12
    NO_UNIT = 1 << 13
    FEW_TAXELS = 1 << 14
    OFF_SKIN = 1 << 15
    POOR_FIT = 1 << 16
    NO_LAYER = 1 << 17
    NOISE_UNKNOWN = 1 << 18
    UNSURE = 1 << 19
    YOUNG_FIT = 1 << 20
    STILL = 1 << 21
    NO_GRADIENT = 1 << 22
    NO_PREVIOUS = 1 << 23
    ONE_PULLED = 1 << 24


Flags.__module__ = TouchFlags.__module__ = "somatic_touch"
