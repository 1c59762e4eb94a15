"""`view`: a body or a recording in a browser."""

from __future__ import annotations

import os
import pathlib
import threading
import time
from types import TracebackType
from typing import Any, TypeAlias

import numpy as np

from . import _native
from ._errors import UsageError

_Path: TypeAlias = str | os.PathLike[str]


class Shown:
    """A page that shows a body or a recording, from `view`. It is served until it is closed, or until Python ends."""

    url: str
    """The page's address, with the token that lets a browser in: whoever has it may look."""

    def __init__(self, engine: _native.Engine, view: _native.View, recording: _native.Recording | None, speed: float, loop: bool) -> None:
        self._engine = engine
        self._view = view
        self._recording = recording
        self._end = threading.Event()
        self._page: str | None = None
        self.url = view.url
        self._thread: threading.Thread | None = None
        if recording is None:
            at_rest: list[dict[int, float]] = [{}]
            engine.process([0.0], at_rest)
        else:
            self._thread = threading.Thread(target=self._play, args=(speed, loop), name="somatic view", daemon=True)
            self._thread.start()

    def _play(self, speed: float, loop: bool) -> None:
        recording = self._recording
        assert recording is not None
        t, values, pose = recording.t, recording.values, recording.pose
        moved = {link: np.asarray(poses) for link, poses in pose.items()}
        again = 0.0
        while not self._end.is_set():
            begin = time.monotonic()
            for index in range(len(t)):
                due = begin + float(t[index] - t[0]) / speed
                if self._end.wait(max(0.0, due - time.monotonic())):
                    return
                here = {link: poses[index] for link, poses in moved.items() if np.isfinite(poses[index]).all()}
                self._engine.step(float(t[index]) + again, values[index], pose=here or None)
            if not loop:
                return
            again += float(t[-1] - t[0]) + 1.0

    @property
    def viewers(self) -> int:
        """How many browsers show it."""
        return self._view.viewers

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until a recording has been played to its end, at most `timeout` seconds; tells whether it has."""
        if self._thread is not None:
            self._thread.join(timeout)
            return not self._thread.is_alive()
        return True

    def open(self) -> None:
        """Opens it in the browser of this machine."""
        # Late, as the package is imported often and pages are opened seldom.
        import tempfile
        import webbrowser

        # Command lines are public, and the address holds a token: it is handed over in a file that only its owner can read.
        page = f'<!doctype html><meta charset=utf-8><meta http-equiv=refresh content="0;url={self.url}"><title>somatic</title>'
        number, self._page = tempfile.mkstemp(".html")
        with os.fdopen(number, "w") as file:
            file.write(page)
        webbrowser.open(pathlib.Path(self._page).as_uri())

    def close(self) -> None:
        """Ends the page; browsers keep its last frame."""
        self._end.set()
        self._view.close()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(1.0)
        if self._page is not None:
            pathlib.Path(self._page).unlink(missing_ok=True)
            self._page = None

    def __enter__(self) -> Shown:
        return self

    def __exit__(self, kind: type[BaseException] | None, raised: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return "<Shown, closed>" if self._end.is_set() else f"<Shown at {self.url}>"


def view(
    what: _native.Body | _native.Recording | _Path = "hand",
    scene: _native.Scene | dict[str, Any] | str | None = None,
    calibration: _native.Calibration | None = None,
    *,
    body: _native.Body | _Path | None = None,
    speed: float = 1.0,
    loop: bool = False,
    listen: str | None = None,
    open: bool = True,
) -> Shown:
    """Opens a page that shows a body at rest, or plays a recording, and returns at once.

    Parameters
    ----------
    what : Body, Recording, str or path
        A .glb or .gltf is a body; anything else is read, with its `body` if it needs one. 'hand' is the bundled touch.
    scene, calibration : optional
        What is computed of a recording, as for `Recording.engine`.
    speed, loop : float, bool
        At how many times its own speed a recording is played, and whether again and again.
    listen : str, optional
        HOST:PORT, where port 0 is any free one; by default 127.0.0.1:7879 or the next free port.
    open : bool
        Whether the browser of this machine is opened.

    Returns
    -------
    Shown
        With `.url`, `.close()`, and a `with` block that closes it. `somatic view` has a timeline, too: there one may go back.

    Examples
    --------
    >>> import somatic_touch as st
    >>> with st.view(st.Body.bundled("mat"), listen="127.0.0.1:0", open=False) as shown:
    ...     shown.url[:17], shown.viewers
    ('http://127.0.0.1:', 0)
    """
    if not (np.isfinite(speed) and speed > 0):
        raise UsageError(f"speed should be a positive number; this is {speed}")
    shape = what
    if not isinstance(what, _native.Body | _native.Recording) and str(what).endswith((".glb", ".gltf")):
        shape = _native.Body.load(what)
    if isinstance(shape, _native.Body):
        recording = None
        engine = _native.Engine(shape, scene, calibration, "cpu")
    else:
        recording = shape if isinstance(shape, _native.Recording) else _native.read(shape, body=body)
        engine = recording.engine(scene, calibration)
    shown = Shown(engine, engine.view(listen), recording, speed, loop)
    if open:
        shown.open()
    return shown


for _public in (Shown, view):
    _public.__module__ = "somatic_touch"
