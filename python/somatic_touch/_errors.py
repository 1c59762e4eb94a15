"""The errors of this package."""

from __future__ import annotations


class SomaticError(Exception):
    """What went wrong, in one line.

    ``file`` is the file that it is about, if there is one, and ``place`` where in it: a row, a line, a key.

    >>> import somatic_touch as st
    >>> try:
    ...     st.Body.load("no-such-robot.glb")
    ... except st.SomaticError as error:
    ...     print(error.file, "|", error)
    no-such-robot.glb | no-such-robot.glb: no such file or directory
    """

    file: str | None
    place: str | None

    def __init__(self, message: str, file: str | None = None, place: str | None = None) -> None:
        super().__init__(message)
        self.file = file
        self.place = place

    def __reduce__(self) -> tuple[type[SomaticError], tuple[str, str | None, str | None]]:
        # Processes of a pool send their errors to each other.
        return type(self), (str(self), self.file, self.place)


class UsageError(SomaticError, ValueError):
    """The request makes no sense: arguments that do not exist, have another shape, or do not go together.

    >>> import somatic_touch as st
    >>> st.Scene(outputs=["centroids"])
    Traceback (most recent call last):
        ...
    somatic_touch.UsageError: outputs: there is no output `centroids`; did you mean `centroid`?
    """


class UnknownNameError(UsageError, KeyError):
    """There is nothing of this name: no output, no quantity, no field. It says which name is nearest, or what there is.

    >>> import somatic_touch as st
    >>> p = st.Engine(st.Body.bundled("hand"), {"outputs": ["centroid"]}, backend="cpu").step(0.0, [0] * 40)
    >>> p["centriod"]
    Traceback (most recent call last):
        ...
    somatic_touch.UnknownNameError: there is no output `centriod`; did you mean `centroid`?
    """

    def __str__(self) -> str:
        # A KeyError's text is in quotes.
        return str(self.args[0])


class InputError(SomaticError):
    """Something that was read cannot be used; ``file`` and ``place`` say where it stands.

    >>> import somatic_touch as st
    >>> st.Calibration("[all]\\ngian = 2", st.Body.bundled("hand"))
    Traceback (most recent call last):
        ...
    somatic_touch.InputError: line 2, column 1: there is no key `gian`; did you mean `gain`?
    """


for _error in (SomaticError, UsageError, UnknownNameError, InputError):
    _error.__module__ = "somatic_touch"
