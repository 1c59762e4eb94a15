"""`live`: percepts as frames come."""

from __future__ import annotations

import os
import pathlib
from typing import Any

from . import _native


def live(scene: _native.Scene | dict[str, Any] | str | os.PathLike[str] | None = None, **keys: Any) -> _native.Live:
    """Opens boards, topics or limbs, and gives percepts as their frames come.

    Parameters
    ----------
    scene : path, dict, str or Scene, optional
        A scene file, or what it would say, as docs/reference/scene.md describes it: `source`, such as 'serial:PORT', 'text:PORT', 'ros2:/TOPIC' or
        'zenoh:KEY', one or a list; `body`, a file, a bundled one or a `Body`; `calibration`, a file or a `Calibration`; `wiring`, `joints`,
        `outputs`, `fields`, and so on. A recording is played, by `playback_speed` of its own, or as fast as possible.
    **keys
        The same as keywords, which come before those of a dict.

    Returns
    -------
    Live
        `for p in live` has a `Percepts` for each frame; `live.stop()`, from any thread, Ctrl-C, and the end of a `with` block close it.

    Raises
    ------
    UsageError
        Where keys do not go together, or this wheel was built without what a source needs: `ros2` and `zenoh` are features of its build.
    InputError
        Where something cannot be opened: at once, or in the loop where a source ends badly.

    Examples
    --------
    >>> import somatic_touch as st
    >>> with st.live(body="hand", outputs=["total"], backend="cpu") as live:
    ...     for p in live:
    ...         if p["total"].max() > 0:
    ...             live.stop()
    >>> live
    <Live bundled touch on hand: 13 fields, 40 taxels>
    """
    import tempfile

    if isinstance(scene, dict):
        keys, scene = {**scene, **keys}, None
    with tempfile.TemporaryDirectory() as folder:
        # What is in memory is read as a file, as the command does it.
        body, calibration = keys.get("body"), keys.get("calibration")
        if isinstance(body, _native.Body):
            path = pathlib.Path(folder) / (pathlib.Path(body.name).stem + ".glb")
            body.save(path)
            keys["body"] = str(path)
        if isinstance(calibration, _native.Calibration):
            path = pathlib.Path(folder) / "calibration.toml"
            calibration.save(path)
            keys["calibration"] = str(path)
        for name, value in keys.items():
            if isinstance(value, os.PathLike):
                keys[name] = os.fspath(value)
        return _native._live(scene, keys)


live.__module__ = "somatic_touch"
