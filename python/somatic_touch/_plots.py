"""Pictures of percepts, touches and bodies on matplotlib's axes."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import SomaticError, UsageError

# Fields or touches that have a colour and a name each.
_MOST = 10
_STYLES = ("-", "--", ":")
# Triangles that matplotlib turns without a wait.
_MOST_TRIANGLES = 20_000
# From here on a time is one of a clock that counts from 1970: September 2001.
_DATES_S = 1e9


def _axes(ax: Any, size: tuple[float, float], **about: Any) -> tuple[Any, bool]:
    """Where to draw, and whether that is a figure of its own."""
    if ax is not None:
        return ax, False
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise SomaticError("pictures of this kind are drawn by matplotlib; run `pip install matplotlib`") from error
    return plt.figure(figsize=size, layout="constrained").add_subplot(**about), True


def _time(t: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], str]:
    """Times as they are drawn, and what they are called: dates count from the first."""
    first = float(np.min(t)) if len(t) and np.isfinite(t).all() else 0.0
    if first < _DATES_S:
        return t, "t [s]"
    began = datetime.datetime.fromtimestamp(first, datetime.UTC)
    return t - first, f"s since {began:%Y-%m-%d %H:%M:%S.%f} UTC"


def _named(quantity: str, unit: str) -> str:
    return quantity if unit == "1" else f"{quantity} [{unit}]"


def _letters(quantity: str, count: int) -> list[str]:
    if count == 1:
        return [""]
    if count == 3:
        return [" x", " y", " z"]
    return [" along", " across"] if quantity == "spread" else [" u", " v"]


def _lines(ax: Any, t: npt.NDArray[np.float64], values: npt.NDArray[Any], quantity: str, name: str | None, color: str) -> None:
    """A line for each component, with gaps where it is absent; a value between two gaps is a point."""
    values = values.reshape(len(t), -1).astype(np.float64)
    letters = _letters(quantity, values.shape[1])
    for component, letter in enumerate(letters):
        column = values[:, component]
        label = None if name is None else name + letter
        ax.plot(t, column, _STYLES[component], color=color, label=label)
        there = np.isfinite(column)
        alone = there & ~np.append(there[1:], False) & ~np.append(False, there[:-1])
        ax.plot(t[alone], column[alone], ".", color=color)


def _nothing(ax: Any, what: str) -> None:
    ax.text(0.5, 0.5, what, transform=ax.transAxes, ha="center", va="center", color="0.4")


def _legend(ax: Any, is_own: bool) -> None:
    """Beside the axes where there is room."""
    if ax.get_legend_handles_labels()[0]:
        place = {"loc": "upper left", "bbox_to_anchor": (1.01, 1)} if is_own else {"loc": "upper right"}
        ax.legend(fontsize="small", frameon=not is_own, **place)


def _finished(ax: Any, is_own: bool, label: str, quantity: str) -> Any:
    ax.set_xlabel(label)
    ax.set_ylabel(quantity)
    _legend(ax, is_own)
    return ax


def percepts(p: _native.Percepts, output: str | None, fields: Any, ax: Any) -> Any:
    """See `Percepts.plot`."""
    shown = p if fields is None else p.select(fields)
    if output is None:
        names = [name for name in ("force", "total", "peak", *p.keys()) if name in p]
        # Of one letter the columns of others are empty.
        output = next((name for name in names if shown.present(name).any()), next(iter(names), None))
    if output is None:
        raise UsageError("these percepts have touches alone; see `.touches.plot()`")
    values, t, unit = shown[output], shown.t, shown.unit(output)
    there = shown.present(output)
    pressed = there & shown.contact
    ax, is_own = _axes(ax, (9, 4))
    t, label = _time(t)
    touched = [index for index in range(len(shown.fields)) if pressed[:, index].any()]
    # Those that are pressed longest, in the order of fields.
    longest = sorted(sorted(touched, key=lambda index: -int(pressed[:, index].sum()))[:_MOST])
    for number, index in enumerate(longest):
        column = np.where(there[:, index].reshape(-1, *[1] * (values.ndim - 2)), values[:, index], np.nan)
        _lines(ax, t, column, output, shown.fields[index], f"C{number}")
    if not touched:
        _nothing(ax, f"no field is in contact and has {output}")
    elif len(touched) > _MOST:
        ax.set_title(f"{_MOST} of {len(touched)} fields in contact", fontsize="medium")
    return _finished(ax, is_own, label, _named(output, unit))


def touches(found: _native.Touches, quantity: str, ax: Any) -> Any:
    """See `Touches.plot`."""
    values, ids, links = np.asarray(found[quantity]), found.id, found.link
    if values.dtype.kind not in "fiu":
        raise UsageError(f"`{quantity}` is no number; plot one of {', '.join(found.keys())}")
    ax, is_own = _axes(ax, (9, 4))
    t, label = _time(found.t)
    every, counts = np.unique(ids, return_counts=True)
    named = set(every[np.argsort(-counts, kind="stable")[:_MOST]].tolist())
    for number, identity in enumerate(every):
        rows = ids == identity
        first = int(np.argmax(rows))
        name = f"touch {identity} on {links[first]}" if int(identity) in named else None
        _lines(ax, t[rows], values[rows], quantity, name, f"C{number % 10}")
    if not len(every):
        _nothing(ax, "no touches")
    elif len(every) > _MOST:
        ax.set_title(f"{len(every)} touches, the {_MOST} longest named", fontsize="medium")
    return _finished(ax, is_own, label, _named(quantity, found.unit(quantity)))


def body(shape: _native.Body, values: Any, ax: Any, surface: bool, unit: str | None, letter: str | None) -> Any:
    """See `Body.plot`."""
    taxels = shape.taxels
    if letter is not None and letter not in _READS:
        raise UsageError(f"there is no letter `{letter}` to plot; plot one of {', '.join(_READS)}")
    places: npt.NDArray[np.float64] = taxels["place"]
    ax, is_own = _axes(ax, (8, 6), projection="3d")
    if not hasattr(ax, "get_zlim"):
        raise UsageError('ax should be three-dimensional; make it with projection="3d"')
    # Taxels are seen through the surface.
    ax.computed_zorder = False
    corners = places
    if surface:
        vertices, faces = shape.surface
        if len(faces):
            from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped,unused-ignore]

            step = -(-len(faces) // _MOST_TRIANGLES)
            drawn = Poly3DCollection(vertices[faces[::step]], facecolor="0.6", linewidth=0, alpha=0.12, zorder=0)
            ax.add_collection3d(drawn)
            corners = np.concatenate([places, vertices])
    if values is None:
        for number, link in enumerate(np.unique(taxels["link"])):
            here = places[taxels["link"] == link]
            name = shape.links[int(link)] if number < _MOST else None
            ax.scatter(*here.T, s=9, color=f"C{number % 10}", label=name, depthshade=False, zorder=2)
        if len(shape.links) > 1:
            _legend(ax, is_own)
    else:
        _values(ax, shape, np.asarray(values, np.float64), unit, letter)
    if len(corners):
        low, high = corners.min(axis=0), corners.max(axis=0)
        # One scale for all axes; what is flat gets some room.
        room = np.maximum(high - low, 0.1 * (high - low).max() + 1e-6)
        middle = (low + high) / 2
        for axis, at, size in zip("xyz", middle, room, strict=True):
            getattr(ax, f"set_{axis}lim")(at - 0.55 * size, at + 0.55 * size)
            _ticks(getattr(ax, f"{axis}axis"), float(at), float(size / room.max()))
        ax.set_box_aspect(room, zoom=0.9)
    ax.set_xlabel("x, forward [m]", labelpad=10)
    ax.set_ylabel("y, left [m]", labelpad=10)
    ax.set_zlabel("z, up [m]", labelpad=10)
    ax.set_title(shape.name, fontsize="medium")
    return ax


# The kinds of taxels that a letter reads.
_READS = {
    "sustained": ("pressure", "force3"),
    "shear": ("force3",),
    "temperature": ("temperature",),
    "proximity": ("proximity",),
}
_COLORS = {"temperature": "RdBu_r", "proximity": "viridis_r"}
# The longest arrow, as a share of the body.
_LONGEST = 0.12


def _values(ax: Any, shape: _native.Body, values: npt.NDArray[np.float64], unit: str | None, letter: str | None) -> None:
    """A colour for each taxel that `letter` reads, and an arrow for the tangential part of three values."""
    taxels = shape.taxels
    places: npt.NDArray[np.float64] = taxels["place"]
    modality = taxels["modality"]
    if values.shape not in ((len(places),), (len(places), 3)):
        what = f"values should have shape [taxels] = [{len(places)}] or [taxels, 3], by ascending id"
        raise UsageError(f"{what}; this has shape {list(values.shape)}")
    if letter is None:
        one = [name for name, kinds in _READS.items() if name != "shear" and np.isin(modality, kinds).all()]
        letter = one[0] if one else None
    read = np.isin(modality, _READS[letter]) if letter else np.full(len(places), True)
    if not read.any():
        raise UsageError(f"no taxel of this body is of letter `{letter}`")
    if not read.all():
        ax.scatter(*places[~read].T, s=3, color="0.7", depthshade=False, zorder=2)
    numbers = values if values.ndim == 1 else values[:, 0]
    there = read & np.isfinite(numbers)
    ax.scatter(*places[read & ~there].T, s=10, facecolors="none", edgecolors="0.5", depthshade=False, zorder=2, label="no value")
    colors: dict[str, Any] = {"cmap": _COLORS.get(letter or "", "viridis")}
    if letter == "temperature" and there.any():
        middle = float(np.median(numbers[there]))
        # At least a degree, so that noise is no picture.
        reach = max(float(np.abs(numbers[there] - middle).max()), 0.5)
        colors |= {"vmin": middle - reach, "vmax": middle + reach}
    points = ax.scatter(*places[there].T, s=12, c=numbers[there], depthshade=False, zorder=3, **colors)
    ax.figure.colorbar(points, ax=ax, shrink=0.6, pad=0.12, label=unit or "")
    if not there[read].all():
        ax.legend(fontsize="small", loc="upper left")
    if values.ndim == 2:
        _arrows(ax, shape, values, there & np.isfinite(values).all(axis=1) & (modality == "force3"))


def _arrows(ax: Any, shape: _native.Body, values: npt.NDArray[np.float64], there: npt.NDArray[np.bool_]) -> None:
    """The tangential parts of forces, the largest as long as `_LONGEST` says."""
    taxels = shape.taxels
    if not there.any():
        return
    tangents = taxels["tangent"]
    in_links = np.where(there[:, None], values[:, 1:2] * tangents + values[:, 2:3] * np.cross(taxels["normal"], tangents), 0.0)
    forces = shape._at_rest(in_links)[there]
    largest = float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    if largest == 0.0:
        return
    places = taxels["place"]
    scale = _LONGEST * float(np.ptp(places, axis=0).max(initial=1e-3)) / largest
    ax.quiver(*places[there].T, *(scale * forces).T, color="0.1", linewidth=1, arrow_length_ratio=0.3, zorder=4)


def _ticks(axis: Any, middle: float, share: float) -> None:
    """As many as a side has room for that is `share` of the longest."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    axis.set_major_locator(MaxNLocator(max(2, round(5 * share))) if share > 0.35 else FixedLocator([float(f"{middle:.1g}")]))
