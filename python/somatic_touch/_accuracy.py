"""`tradeoff` and `calibrate`, whose results are tables."""

from __future__ import annotations

import json
import os
import pathlib
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeAlias

from . import _native
from ._columns import Table
from ._errors import UsageError

_Path: TypeAlias = str | os.PathLike[str]
_Progress: TypeAlias = bool | Callable[[float], object]

_KNOBS = ("arithmetic", "charts", "orientation_by", "coverage", "cadence")
_USUAL = {"charts": "as-authored", "coverage": "auto", "cadence": "every-frame"}
_FLAT = ("centroid_mm", "orientation_deg", "round_mm", "across_mm", "place_mm")


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """A row without rows in it: `truth` has errors, and errors have numbers."""
    made: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, dict):
            within = "" if name in _FLAT else f"{name}_"
            for inner, number in _flat(value).items():
                made[f"{name}_{inner}" if name in _FLAT else within + inner] = number
        elif value is None and name in ("truth", "truth_with_fit"):
            continue
        else:
            made[name] = value
    return made


class Tradeoff(Table):
    """What each combination of options costs and gives: a row for each, see `tradeoff`.

    `way` is 'live' or 'batch'; `backend`, `arithmetic`, `charts`, `orientation_by`, `coverage` and `cadence` are the combination; `p50_us` and
    `p99_us` its time of a frame; `centroid_mm_rms`, `orientation_deg_p99` and so on its errors against the reference, and
    `truth_place_mm_p95` and so on those against the truth, where that is known; `front` tells whether no other is faster and as accurate.
    """

    report: dict[str, Any]
    """What was measured on: `body`, `source`, `frames`, `touched`, `ties`, `truth`, `touches`, `left_out`, `kept_charts`."""

    pick: dict[str, Any] | None
    """The row that was picked for `within` and `budget`, the nearest one if none meets them."""

    missed: list[str]
    """What of these the pick misses, a line each."""

    def __init__(self, report: dict[str, Any], all: bool = True) -> None:
        super().__init__([_flat(row) for row in report.pop("rows") if all or row["front"]])
        picked = report.pop("pick", None)
        self.pick = None if picked is None else _flat(picked)
        self.missed = report.pop("missed", [])
        self.report = report

    @property
    def scene(self) -> dict[str, Any]:
        """The keys of a scene that say what was picked, to be laid over yours: `{**mine, **tradeoff.scene}`."""
        if self.pick is None:
            raise UsageError("nothing was picked; give within= or budget=")
        knobs = {name: self.pick[name] for name in _KNOBS if self.pick[name] != _USUAL.get(name)}
        if self.pick["backend"] == "reference":
            knobs.pop("arithmetic", None)
        if self.pick["orientation_by"] == self.report["asked_by"]:
            knobs.pop("orientation_by", None)
        return {"backend": self.pick["backend"], **({"accuracy": knobs} if knobs else {})}

    def plot(self, quantity: Literal["place", "orientation"] = "place", *, way: Literal["live", "batch"] = "live", ax: Any = None) -> Any:
        """Draws the time of a frame against its error, a dot for each combination, with matplotlib; gives the axes.

        The errors are those of `quantity` against the truth where that is known, else against the reference.

        >>> import somatic_touch as st
        >>> found = st.tradeoff(scene={"outputs": ["centroid"]}, source="hand", backend="cpu", seconds=0.05, frames=50)
        >>> found.plot().get_ylabel()
        'place off by, 95th percentile [mm]'
        """
        from . import _figures

        return _figures.tradeoff(self, quantity, way, ax)


def tradeoff(
    body: _native.Body | _Path | None = None,
    scene: _native.Scene | dict[str, Any] | str | None = None,
    source: _native.Recording | _Path | None = None,
    calibration: _native.Calibration | None = None,
    *,
    backend: Literal["auto", "cpu", "gpu"] | None = None,
    seconds: float = 10.0,
    frames: int | None = None,
    within: str | None = None,
    budget: str | None = None,
    all: bool = True,
    write: _Path | None = None,
    progress: _Progress | None = None,
) -> Tradeoff:
    """Measures speed against accuracy on a body and this machine, as `somatic tradeoff` does.

    Parameters
    ----------
    body : Body or str, optional
        By default that of `source`, or the bundled hand.
    scene : Scene, dict or str, optional
        What is computed; options that it sets stay as they are.
    source : Recording or path, optional
        What is timed: a recording, or a simulation such as 'sim:FILE.toml', which knows the truth. Without it touches are simulated on the body.
    calibration : Calibration, optional
        By default the source's own.
    seconds : float
        How long to measure; longer is steadier.
    frames : int, optional
        How many first frames of the source to measure on; 512 by default, fewer of large bodies.
    within, budget : str, optional
        A tolerance such as '3 mm, 5 deg', and a time of a frame such as '100us', for which a row is picked: the fastest within the tolerance, or
        the most accurate within a budget alone.
    all : bool
        Whether the table has every combination, or only those in front, which no other beats.
    write : path, optional
        A scene file, whose comments stay: the pick is written into it, and nothing if the pick misses something, which is a warning. It is also
        the `scene` and the wish, where these are not given.
    progress : bool or callable, optional
        True shows a bar of tqdm, a function is called with the share that is done, 0 to 1.

    Returns
    -------
    Tradeoff
        A table with a row for each combination, and `.pick`, `.missed` and `.scene`. Unlike the command's, measurements are not kept.

    Examples
    --------
    >>> import somatic_touch as st
    >>> found = st.tradeoff(scene={"outputs": ["centroid"]}, source="hand", backend="cpu", seconds=0.05, frames=50, within="3 mm")
    >>> found.pick["backend"] in ("cpu", "reference"), found.missed, "p50_us" in found
    (True, [], True)
    """
    if write is not None:
        # Before the measurement: it takes long, and this may not be a scene.
        there = _native.Scene._load_without_wish(write)
        scene = there if scene is None else scene
        if within is None and budget is None:
            within, budget = _wish(write)
    text = _native._tradeoff(body, scene, source, calibration, backend, seconds, frames, within, budget, progress)
    found = Tradeoff(json.loads(text), all)
    if write is not None:
        if found.pick is None or found.missed:
            why = "; ".join(found.missed) or "there is nothing to pick from"
            warnings.warn(f"{os.fspath(write)}: it stays as it was: no options meet within= and budget=: {why}", stacklevel=2)
        else:
            words = {name: found.pick[name] for name in ("backend", *_KNOBS)}
            _native._write_pick(write, json.dumps(words), found.report["asked_by"], within, budget)
    return found


def _wish(path: _Path) -> tuple[str | None, str | None]:
    """The tolerance and the budget that the scene file at `path` has."""
    import tomllib

    with pathlib.Path(path).open("rb") as file:
        asked = tomllib.load(file).get("accuracy", {})
    within = ", ".join(asked[key] for key in ("centroid", "orientation") if key in asked)
    budget = asked.get("budget")
    if not within and budget is None:
        raise UsageError("write= needs within= or budget=, which pick what to write")
    return within or None, budget


class Calibrated(Table):
    """What `calibrate` has found, a row for each sensor: `taxel`, `baseline`, `strays` (how far from it), `noise` (σ), `dead_band`, `travel`, `full` and `gain`, in raw units.

    Of `gains_from` it is `taxel`, `gain`, by which factor it feels more than others, and `pressed`, by how many touches.
    """

    calibration: _native.Calibration
    """What follows from it, for engines; `calibration.save(path)` writes it."""

    report: dict[str, Any]
    """The rest: `invert`, `raw_range`, `crosstalk`, `remarks` and `losses`; of `gains_from` `touches`, `width_m`, `sigma_m`, `left`, `gain_spread` and `losses`."""

    def __init__(self, report: dict[str, Any], calibration: _native.Calibration) -> None:
        super().__init__(report.pop("rows"))
        self.report = report
        self.calibration = calibration

    def plot(self, *, ax: Any = None) -> Any:
        """Draws where each sensor rests, its dead band, and how far presses went, with matplotlib; of `gains_from` the gains. Gives the axes.

        >>> import somatic_touch as st
        >>> grid = st.Body.grid(1, 2, 0.01)
        >>> rows = [{"taxel": 0, "baseline": 100.0, "dead_band": 3.0, "travel": 200.0}, {"taxel": 1, "baseline": 98.0, "dead_band": 3.0, "travel": None}]
        >>> found = st.Calibrated({"rows": rows, "invert": False, "raw_range": [0, 1023]}, st.Calibration("", grid))
        >>> [text.get_text() for text in found.plot().get_legend().get_texts()]
        ['pressed', 'dead band', 'at rest', 'never pressed, or lost']
        """
        from . import _figures

        return _figures.calibrated(self, ax)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def calibrate(
    body: _native.Body | _Path,
    source: _native.Recording | _Path | Sequence[str] | None = None,
    *,
    rest: float = 3.0,
    press: float | None = None,
    bits: int | None = None,
    missing: Sequence[float] = (),
    equalise: bool = False,
    known: str | None = None,
    on: Literal["taxel", "field"] | None = None,
    mask_moved: bool = False,
    rate_hz: float | None = None,
    wiring: _Path | None = None,
    live_rate_hz: float | None = None,
    board_rate_hz: float | None = None,
    columns: str | None = None,
    ids: str | None = None,
    frame_end: str | None = None,
    time: str | None = None,
    map: str | None = None,
    gains_from: _native.Recording | _Path | None = None,
    calibration: _native.Calibration | None = None,
    stamp: float | None = None,
    say: Callable[[str], object] = _say,
    progress: _Progress | None = None,
) -> Calibrated:
    """Finds baselines, noise, range and gains of sensors, as `somatic calibrate` does.

    Parameters
    ----------
    body : Body or str
        The robot.
    source : Recording, path or list of str
        A recording, or boards: 'serial:PORT', of which there may be several, 'text:PORT', or '-'. First nothing touches the robot for `rest` seconds, then
        every sensor is pressed firmly, until the recording ends, for `press` seconds, or until Ctrl-C.
    bits, missing, equalise, mask_moved
        The converter's bits; raw values that are no readings; gains with which all presses are equal, for sensors that were pressed alike;
        and whether sensors that moved at rest are masked, in the place of an error.
    known, on
        The force of every press, such as '4.9N' or '500g', or of presses that follow each other, such as '1N,2N,5N'; and what they pressed on: each
        'taxel', or the 'field' of all together, which gives one scale. P is in newtons then. Several forces on taxels make curves.
    rate_hz, wiring, live_rate_hz, board_rate_hz, columns, ids, frame_end, time, map
        How the source is read: see docs/reference/scene.md.
    gains_from, calibration, stamp
        In the place of `source`, a recording of ordinary touches, from which gains and the layer's width are found, for the calibration that has
        baselines and dead bands; `stamp` is the radius in metres, if all touches are by the flat end of a stamp.
    say : callable
        Is told what is to be done at boards; prints to standard error by default.
    progress : bool or callable, optional
        Of `gains_from`: True shows a bar of tqdm, a function is called with the share that is done, 0 to 1.

    Returns
    -------
    Calibrated
        A table with a row for each sensor, and `.calibration`.

    Raises
    ------
    InputError
        Where sensors moved at rest, or none was pressed.

    Examples
    --------
    >>> import numpy as np, pathlib, tempfile
    >>> import somatic_touch as st
    >>> t = np.arange(600) / 100
    >>> raw = 100 + np.where(t > 3.5, 200, 0)[:, None] + np.random.default_rng(1).integers(0, 2, (600, 2))
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "session.csv"
    >>> np.savetxt(path, np.column_stack([t, raw]), delimiter=",", header="t,0,1", comments="")
    >>> found = st.calibrate(st.Body.grid(1, 2, 0.01), path)
    >>> found["travel"].round(-1).tolist(), found.calibration.quantity
    ([200.0, 200.0], 'count')
    """
    if not isinstance(body, _native.Body):
        body = _native._body(body)
    if gains_from is not None:
        if source is not None or calibration is None:
            raise UsageError("gains are added to a calibration: give gains_from= and calibration=, and no source")
        text, made = _native._gains(body, gains_from, calibration, stamp, rate_hz, map, progress)
    elif source is None or calibration is not None or stamp is not None:
        raise UsageError("give a source; calibration= and stamp= are for gains_from=")
    else:
        asked = {
            "rest_s": float(rest),
            "press_s": press,
            "bits": bits,
            "missing": list(missing),
            "equalise": equalise,
            "known": known,
            "on": on,
            "mask_moved": mask_moved,
            "rate_hz": rate_hz,
            "wiring": wiring,
            "live_rate_hz": live_rate_hz,
            "board_rate_hz": board_rate_hz,
            "text": [columns, ids, frame_end, time],
            "map": map,
        }
        text, made = _native._calibrate(body, source, asked, say)
    return Calibrated(json.loads(text), _native.Calibration(made, body))


for _public in (Tradeoff, tradeoff, Calibrated, calibrate):
    _public.__module__ = "somatic_touch"
