"""The command's other subcommands: `info`, `inspect`, `compare`, `outputs`, `plan`, `bench` and `plot`."""

from __future__ import annotations

import csv
import json
import os
import time
import tomllib
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from . import _native
from ._columns import Table
from ._errors import UsageError

_Path: TypeAlias = str | os.PathLike[str]
_Backend: TypeAlias = Literal["auto", "reference", "cpu", "gpu"]
_Letter: TypeAlias = Literal["sustained", "change", "shear", "temperature", "proximity"]
_Asked: TypeAlias = _native.Scene | dict[str, Any] | str | None


class _Reading(TypedDict, total=False):
    """The keywords of `read`."""

    body: _native.Body | _Path | None
    from_s: float | None
    to_s: float | None
    rate_hz: float | None
    format: str | None
    grid: str | None
    pitch: str | None
    unit: str | None
    layout: _Path | None
    skip_bad: bool
    map: str | None


def _of(body: _native.Body | _Path) -> _native.Body:
    return body if isinstance(body, _native.Body) else _native._body(body)


def info(
    source: _Path,
    *,
    rate_hz: float | None = None,
    format: str | None = None,
    grid: str | None = None,
    pitch: str | None = None,
    unit: str | None = None,
    layout: _Path | None = None,
    map: str | None = None,
    threshold: str | None = None,
    shortest_s: float = 0.05,
    contacts: bool | _Path = False,
    force: bool = False,
) -> dict[str, Any]:
    """What is in the recording at `source`, as `somatic info` tells it.

    Of a recording `kind`, `bytes`, `taxels`, `frames`, `start` and `duration` in seconds, `rate_hz`, `gaps`, `longest_gap`, `backwards`, `losses`; of an MCAP
    `topics` and `attached` too, of an export `unit` and `panels`; of a ROS 2 bag its `topics`. Where the body comes with it, `fields` has those
    that are touched, a dict each: `contacts`, the `longest` and the mean one, `stance` (s), `mean` and `peak` of the `quantity`, force or total,
    in `unit`. A contact begins over `threshold`, a force such as "20N" or a share of the peak such as "5%", ends at half of it, and lasts
    `shortest_s` or more. With `contacts` there is a `Table` of them too, a row each, as `contacts`; a path writes it there, a .csv, which is
    replaced only with `force`. The other keywords are those of `read`.

    >>> import pathlib, tempfile
    >>> import somatic_touch as st
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "touch.mcap"
    >>> _ = st.convert(st.read("hand"), path)
    >>> known = st.info(path)
    >>> known["kind"], known["frames"], known["duration"], [file["name"] for file in known["attached"]]
    ('MCAP', 280, 5.58, ['hand'])
    >>> palm = [row for row in st.info(path, contacts=True)["contacts"] if row["field"] == "hand/palm"]
    >>> [(row["contact"], row["whole"], row["total_peak"]) for row in palm]
    [(1, True, 1099.0)]
    """
    table = None if isinstance(contacts, bool) else contacts
    is_asked = contacts is not False
    told, rows = _native._info(
        os.fspath(source), rate_hz, format, grid, pitch, unit, layout, map, threshold, shortest_s, is_asked, table, force
    )
    known: dict[str, Any] = json.loads(told)
    if rows is not None:
        known["contacts"] = Table([_contact(row) for row in csv.DictReader(rows.splitlines())])
    return known


def _contact(row: dict[str, str]) -> dict[str, Any]:
    """A row of the table of contacts with numbers as such; what is blank is absent."""
    others: dict[str, Callable[[str], Any]] = {"recording": str, "field": str, "unit": str, "contact": int, "whole": "true".__eq__}
    return {name: others.get(name, float)(text) if text else None for name, text in row.items()}


def inspect(
    body: _native.Body | _Path,
    *,
    contact_tolerance_m: float | None = None,
    errors: bool = False,
    joints: _Path | None = None,
    up: Literal["y", "z"] | None = None,
) -> dict[str, Any]:
    """What `body` holds, and what is odd about it, as `somatic inspect` tells it: `links`, `fields`, `skin`, `holes`, `islands` and `findings`.

    Areas are in m²; `covered` is how much of them is near a taxel. `near_at_rest` counts pairs of links whose taxels are closer at rest than
    `contact_tolerance_m`. With `errors` touches are simulated on it: `errors` then has the median and the 95th percentile of how far off their
    place is (m), their axis (rad) and their force (a share of it), and the same of an `ideal` skin. `joints` is a URDF, in whose poses taxels that
    are covered at rest are looked at too, and `up` its axis that points up; a body that was made from a URDF needs none.

    >>> import somatic_touch as st
    >>> seen = st.inspect("hand")
    >>> seen["taxels"], len(seen["fields"]), seen["islands"]
    (40, 13, 5)
    """
    seen: dict[str, Any] = json.loads(_native._inspect(_of(body), contact_tolerance_m, errors, joints, up))
    return seen


class Compared(dict[str, Any]):
    """How two layouts differ, see `compare`: a dict of `layouts`, `same_places` and `second_is_nearer`."""

    def plot(self, quantity: Literal["place", "axis", "force"] = "place", *, ax: Any = None) -> Any:
        """Draws how far off `quantity` is on both layouts and on ideal skins, with matplotlib; gives the axes.

        >>> import somatic_touch as st
        >>> told = st.compare(st.Body.grid(4, 4, 0.01), st.Body.grid(8, 8, 0.005), touches=60)
        >>> told.plot().get_ylabel()
        'place off by [mm]'
        """
        from . import _figures

        return _figures.compared(self, quantity, ax)


def compare(first: _native.Body | _Path, second: _native.Body | _Path, *, touches: int = 400) -> Compared:
    """How far off so many simulated touches are on two layouts, as `somatic author --compare` tells it.

    `layouts` has for each what `inspect(errors=True)` has as `errors`, and `frame_s`, the time of a live frame. `second_is_nearer` is the share of
    touches that the second layout places better, where both have one surface (`same_places`).

    >>> import somatic_touch as st
    >>> told = st.compare(st.Body.grid(4, 4, 0.01), st.Body.grid(8, 8, 0.005), touches=60)
    >>> [layout["taxels"] for layout in told["layouts"]]
    [16, 64]
    >>> told["layouts"][0]["place"]["median"] > told["layouts"][1]["place"]["median"]
    True
    """
    return Compared(json.loads(_native._compare(_of(first), _of(second), touches)))


def outputs() -> Table:
    """The quantities that can be asked for, a row each: `name`, `unit`, `components` (0 of a list), `default` and `what`.

    >>> import somatic_touch as st
    >>> {row["name"]: row["unit"] for row in st.outputs()}["force"]
    'N'
    """
    return Table(json.loads(_native._outputs()))


def plan(
    body: _native.Body | _Path = "hand",
    scene: _Asked = None,
    calibration: _native.Calibration | None = None,
    backend: _Backend | None = None,
) -> dict[str, Any]:
    """What `scene` computes on `body`, over how much, and what is left out and why: `Engine.plan` without frames.

    >>> import somatic_touch as st
    >>> [stage["stage"] for stage in st.plan("hand", {"outputs": ["centroid"]}, backend="cpu")["stages"] if stage["runs"]]
    ['calibrate', 'contact', 'centroid']
    """
    return _native.Engine(_of(body), scene, calibration, backend).plan()


def bench(
    body: _native.Body | _Path = "hand",
    scene: _Asked = None,
    calibration: _native.Calibration | None = None,
    backend: _Backend | None = None,
    *,
    letters: _Letter | Sequence[_Letter] | None = None,
    frames: int = 1,
    seconds: float = 1.0,
) -> dict[str, Any]:
    """How long a call takes on this machine, from frames in memory to percepts in memory, with every taxel pressed.

    `frames` is how many a call has: 1 as on a robot, more as in a recording. Gives `backend`, `calls`, `us_median` and `us_p99` of a call, and
    `rate`, memberships (a sensor in a field in a frame, of one letter) per second. `somatic bench` measures made-up skins; this measures yours, from
    Python. With `letters` these are measured, and the same body from pressures alone in turns with them, which takes `us_median_pressure`.

    >>> import somatic_touch as st
    >>> told = st.bench("hand", {"outputs": ["total"]}, backend="cpu", seconds=0.05)
    >>> told["backend"], told["calls"] > 2, told["us_median"] <= told["us_p99"]
    ('cpu', True, True)
    >>> told = st.bench("sensing-hand", backend="cpu", letters=["sustained", "shear"], seconds=0.05)
    >>> told["letters"], told["us_median_pressure"] > 0
    (['sustained', 'shear'], True)
    """
    body = _of(body)
    if letters is None:
        skins = [_Skin(body, _native.Engine(body, scene, calibration, backend, batch=frames), frames)]
    else:
        letters = [letters] if isinstance(letters, str) else list(letters)
        if not letters:
            raise UsageError("letters should have one letter or more, such as 'shear'")
        asked = tomllib.loads((scene if isinstance(scene, _native.Scene) else _native.Scene(scene)).text)
        # Of a taxel with three axes the first one is its pressure: what nobody reads is not in the frames.
        pressed = [name for name, kind in _kinds(body) if "." not in name and kind in _READS["sustained"]]
        both: list[tuple[Sequence[str], list[str] | None]] = [(letters, None), (["sustained"], pressed)]
        skins = []
        for of, taxels in both:
            scene = _native.Scene({**asked, "letters": list(of)})
            skins.append(_Skin(body, _native.Engine(body, scene, calibration, backend, taxels=taxels, batch=frames), frames))
    start = time.perf_counter()
    while len(skins[0].took) < 4 or time.perf_counter() - start < seconds:
        for skin in skins:
            skin.call()
    us = skins[0].us()
    median = float(np.median(us))
    told: dict[str, Any] = {
        "backend": skins[0].engine.backend,
        "calls": len(us),
        "us_median": median,
        "us_p99": float(np.quantile(us, 0.99)),
        "rate": 1e6 * skins[0].members() * frames / median,
    }
    if letters is not None:
        told |= {"letters": letters, "us_median_pressure": float(np.median(skins[1].us()))}
    return told


_READS = {
    "sustained": {"pressure", "force3"},
    "change": {"pressure", "force3"},
    "shear": {"force3"},
    "temperature": {"temperature"},
    "proximity": {"proximity"},
}
"""By letter, the kinds of taxel that it is of."""


def _kinds(body: _native.Body) -> list[tuple[str, str]]:
    """The names of a body's channels, and what their taxels measure."""
    taxels = body.taxels
    kind = dict(zip(taxels["id"].tolist(), taxels["modality"].tolist(), strict=True))
    return [(name, kind[int(name.split(".")[0])]) for name in body.channels]


class _Skin:
    """A body whose calls are measured."""

    def __init__(self, body: _native.Body, engine: _native.Engine, frames: int) -> None:
        self.body, self.engine = body, engine
        self.values = np.random.default_rng(1).uniform(1, 1000, (frames, len(engine.channels))).astype(np.float32)
        self.times = np.arange(frames) * 0.01
        self.took: list[float] = []

    def call(self) -> None:
        self.times += len(self.times) * 0.01
        began = time.perf_counter()
        self.engine.process(self.times, self.values)
        self.took.append(time.perf_counter() - began)

    def us(self) -> npt.NDArray[np.float64]:
        # The first one fetches memory.
        return 1e6 * np.array(self.took[1:])

    def members(self) -> int:
        """How many taxels the fields have, each by its letter."""
        fields, kind = self.body.fields, dict(_kinds(self.body))
        # A field of several letters is called by each, too.
        of = [(name if name in fields else name.rpartition(" · ")[0], letter) for name, letter in zip(self.engine.fields, self.engine.letters, strict=True)]
        return sum(kind[str(id)] in _READS[letter] for name, letter in of for id in fields[name].taxels)


def plot(
    recordings: _native.Recording | _Path | Sequence[_native.Recording | _Path],
    path: _Path,
    *,
    outputs: Sequence[str] = (),
    fields: str | Sequence[str] = (),
    calibration: _native.Calibration | None = None,
    force: bool = False,
    **reading: Unpack[_Reading],
) -> None:
    """Draws recordings side by side into `path`, a .svg or .png, as `somatic plot` does: quantities over time, and the highest pressures.

    `outputs` are drawn over time in the place of load and area; `fields` are globs; `calibration` is laid over the recordings' own. Other keywords, such as `body`, `from_s` and `to_s`, are those
    of `read`, for recordings that are paths. `Percepts.plot` draws on matplotlib's axes.

    >>> import pathlib, tempfile
    >>> import somatic_touch as st
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "touch.svg"
    >>> st.plot("hand", path, outputs=["total"])
    >>> path.read_text()[:4]
    '<svg'
    """
    several = [recordings] if isinstance(recordings, str | os.PathLike | _native.Recording) else recordings
    read = [one if isinstance(one, _native.Recording) else _native.read(one, **reading) for one in several]
    _native._plot(read, path, list(outputs), [fields] if isinstance(fields, str) else list(fields), calibration, force)


for _public in (Compared, info, inspect, compare, outputs, plan, bench, plot):
    _public.__module__ = "somatic_touch"
