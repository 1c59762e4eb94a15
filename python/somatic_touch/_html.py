"""What notebooks show: a few rows of each."""

from __future__ import annotations

import html
import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native

_MOST_ROWS = 10
_PRESSED = ("force", "total", "peak")
_MOST = {"sustained": _PRESSED, "change": _PRESSED, "shear": ("shear_vector", "shear"), "temperature": ("warmest", "temperature"), "proximity": ("nearest",)}
"""By letter what its fields are told by, the first that was asked for."""


def _number(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else ""


def _table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[object]], more: int = 0) -> str:
    def cells(tag: str, row: Sequence[object]) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in row) + "</tr>"

    body = "".join(cells("td", row) for row in rows)
    if more:
        body += f'<tr><td colspan="{len(heads)}">… and {more} more</td></tr>'
    head = f"<thead>{cells('th', heads)}</thead>" if any(heads) else ""
    # A caption of tables is centred and far away in some notebooks.
    return f"<div><code>{html.escape(caption)}</code><table>{head}<tbody>{body}</tbody></table></div>"


def percepts(p: _native.Percepts) -> str:
    """The fields that are touched, for how long, and how hard, warm or near."""
    most_of = {letter: next((name for name in names if name in p), None) for letter, names in _MOST.items()}
    frames = p.contact.sum(axis=0)
    order = np.flatnonzero(frames)
    letters = p.letters
    columns = list(dict.fromkeys(name for letter, name in most_of.items() if name is not None and letter in letters))
    # What is nearest and warmest is called so.
    heads = [name if name in ("nearest", "warmest") else f"largest {name.removesuffix('_vector')}" for name in columns]
    heads = [head if p.unit(name) == "1" else f"{head} [{p.unit(name)}]" for head, name in zip(heads, columns, strict=True)]
    heads = ["field", "frames in contact", *heads]
    rows: list[Sequence[object]] = []
    for index in order[:_MOST_ROWS]:
        own = most_of[letters[index]]
        values = p[own][:, index][p.present(own)[:, index]] if own is not None else np.empty(0)
        values = np.linalg.norm(values, axis=1) if values.ndim > 1 else values
        most = _number(float(values.min() if own == "nearest" else values.max())) if values.size else ""
        rows.append([p.fields[index], int(frames[index]), *(most if name == own else "" for name in columns)])
    return _table(repr(p), heads, rows or [["none is touched", *[""] * (len(heads) - 1)]], max(0, len(order) - _MOST_ROWS))


def touches(found: _native.Touches) -> str:
    """The first rows."""
    heads = ["frame", "t [s]", "id", "link", f"total [{found.unit('total')}]", "active", "position [m]"]
    columns = zip(found.frame, found.t, found.id, found.link, found.total, found.active, found.position, strict=True)
    rows: list[Sequence[object]] = []
    for frame, t, identity, link, total, active, position in columns:
        if len(rows) == _MOST_ROWS:
            break
        rows.append([frame, _number(t), identity, link, _number(total), active, ", ".join(map(_number, position))])
    return _table(repr(found), heads, rows, max(0, len(found) - _MOST_ROWS))


def self_contacts(found: _native.SelfContacts) -> str:
    """The first rows."""
    heads = ["frame", "t [s]", "id", "links", "touches", "position [m]", "distance [m]"]
    columns = zip(found.frame, found.t, found.id, found.link, found.touch, found.position, found.distance, strict=True)
    rows: list[Sequence[object]] = []
    for frame, t, identity, link, touch, position, distance in columns:
        if len(rows) == _MOST_ROWS:
            break
        rows.append([frame, _number(t), identity, *[f"{a}, {b}" for a, b in (link, touch)], ", ".join(map(_number, position)), _number(distance)])
    return _table(repr(found), heads, rows, max(0, len(found) - _MOST_ROWS))


def body(shape: _native.Body) -> str:
    """The links that have taxels."""
    taxels = shape.taxels
    links, counts = np.unique(taxels["link"], return_counts=True)
    rows = [[shape.links[link], count, _area(taxels["area"][taxels["link"] == link])] for link, count in zip(links[:_MOST_ROWS], counts, strict=False)]
    return _table(repr(shape), ["link", "taxels", "area [cm²]"], rows, max(0, len(links) - _MOST_ROWS))


def _area(areas: npt.NDArray[np.float64]) -> str:
    return _number(1e4 * float(areas.sum())) if (areas > 0).all() else "unknown"


def recording(read: _native.Recording) -> str:
    """What it has."""
    steps = np.diff(read.t)
    steps = steps[np.isfinite(steps) & (steps > 0)]
    rows: list[list[object]] = [
        ["frames", len(read)],
        ["rate", f"{_number(1 / float(np.median(steps)))} Hz" if len(steps) else "unknown"],
        ["taxels", len(set(read.taxels))],
        ["missing values", f"{_number(100 * float(read.mask.mean()))} %" if read.mask.size else "none"],
        ["links with poses", ", ".join(read.pose) or "none"],
        ["body", read.body if read.body is not None else "none; read it with body="],
        ["calibration", read.calibration if read.calibration is not None else "none"],
    ]
    rows.extend(["lost", loss] for loss in read.losses[:_MOST_ROWS])
    return _table(repr(read), ["", ""], rows, max(0, len(read.losses) - _MOST_ROWS))


def rows(table: Any) -> str:
    """The first rows of a table of columns."""
    names = table.keys()

    def cell(value: object) -> object:
        return _number(value) if isinstance(value, float) else value

    shown = [[cell(row.get(name, "")) for name in names] for row in itertools.islice(table, _MOST_ROWS)]
    return _table(repr(table), names, shown, max(0, len(table) - _MOST_ROWS))
