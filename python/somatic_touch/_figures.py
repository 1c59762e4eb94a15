"""Pictures of comparisons, calibrations and trades on matplotlib's axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import UsageError
from ._plots import _axes, _legend, _nothing

if TYPE_CHECKING:
    from ._accuracy import Calibrated, Tradeoff

# What touches on a layout are off by: what is drawn, and how many of it one of the library's units is.
_OFF_BY = {"place": ("mm", 1e3), "axis": ("degrees", 180 / np.pi), "force": ("% of the force", 100.0)}
# The columns of a trade: against the truth where it is known, else against the reference.
_ERRORS = {"place": ("truth_place_mm", "centroid_mm", "mm"), "orientation": ("truth_orientation_deg", "orientation_deg", "degrees")}
# The smallest error that is drawn: many are zero, for which a logarithm has no place.
_LEAST = 1e-9
_GREY = "0.75"


def _one_of(name: str, names: Mapping[str, object]) -> None:
    if name not in names:
        raise UsageError(f"there is no `{name}` to plot; plot one of {', '.join(names)}")


def compared(told: dict[str, Any], quantity: str, ax: Any) -> Any:
    """See `Compared.plot`."""
    _one_of(quantity, _OFF_BY)
    unit, factor = _OFF_BY[quantity]
    ax, _ = _axes(ax, (6, 4))
    bars: list[tuple[str, dict[str, float] | None, str]] = []
    for number, layout in enumerate(told["layouts"]):
        bars += [(layout["body"], layout[quantity], f"C{number}"), ("ideal skin", layout["ideal"][quantity], "0.5")]
    places = [0.0, 1.0, 2.5, 3.5]
    for at, (_, errors, color) in zip(places, bars, strict=True):
        if errors is not None:
            ax.bar(at, factor * errors["p95"], 0.8, color=color, alpha=0.35)
            ax.bar(at, factor * errors["median"], 0.8, color=color)
    if not any(errors is not None for _, errors, _ in bars):
        _nothing(ax, f"no touch has {quantity}")
    ax.set_xticks(places, [name for name, _, _ in bars])
    ax.set_ylabel(f"{quantity} off by [{unit}]")
    ax.set_title("dark: median, light: 95th percentile", fontsize="medium")
    return ax


def calibrated(found: Calibrated, ax: Any) -> Any:
    """See `Calibrated.plot`."""
    ax, is_own = _axes(ax, (9, 4))
    ax.set_xlabel("taxel")
    if "baseline" not in found:
        _gains(found, ax)
    else:
        _travels(found, ax)
    _legend(ax, is_own)
    return ax


def _gains(found: Calibrated, ax: Any) -> None:
    told = found["pressed"] > 0
    ax.axhline(1.0, color=_GREY, linewidth=1)
    ax.plot(found["taxel"][told], found["gain"][told], "o", color="C0", markersize=4, label="found from touches")
    ax.plot(found["taxel"][~told], found["gain"][~told], "o", color="0.5", markersize=4, fillstyle="none", label="not pressed")
    ax.set_ylabel("gain")


def _travels(found: Calibrated, ax: Any) -> None:
    taxel, rest = found["taxel"], found["baseline"].astype(np.float64)
    travel, band = found["travel"].astype(np.float64), found["dead_band"].astype(np.float64)
    side = -1 if found.report["invert"] else 1
    width = float(np.clip(500 / max(1, len(taxel)), 0.6, 6))
    went = np.isfinite(rest) & np.isfinite(travel)
    rests = np.isfinite(rest)
    ax.vlines(taxel[went], rest[went], (rest + side * travel)[went], color="C0", alpha=0.5, linewidth=width, label="pressed")
    ax.vlines(taxel[rests], (rest - band)[rests], (rest + band)[rests], color="C1", linewidth=1.4 * width, label="dead band")
    ax.plot(taxel[went], rest[went], "o", color="0.1", markersize=4, label="at rest")
    if not went.all():
        ax.plot(taxel[~went], np.nan_to_num(rest[~went]), "x", color="C3", markersize=6, label="never pressed, or lost")
    for end in found.report["raw_range"] or []:
        ax.axhline(end, color=_GREY, linewidth=1)
    ax.set_ylabel("raw value")


def tradeoff(found: Tradeoff, quantity: str, way: str, ax: Any) -> Any:
    """See `Tradeoff.plot`."""
    _one_of(quantity, _ERRORS)
    _one_of(way, {"live": 0, "batch": 0})
    true, rounded, unit = _ERRORS[quantity]
    column = true if found.report["truth"] else rounded
    rows = [row for row in found if row["way"] == way and row.get(f"{column}_compared", 0) > 0]
    ax, is_own = _axes(ax, (7, 5))
    ax.set_xscale("log")
    ax.set_yscale("log")
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault("double" if row["backend"] == "reference" else f"{row['backend']}, {row['arithmetic']}", []).append(row)
    for number, (name, group) in enumerate(groups.items()):
        for front, style in ((False, {"fillstyle": "none", "alpha": 0.5}), (True, {"label": name})):
            drawn = [row for row in group if row["front"] is front]
            if drawn or front:
                ax.plot(*_points(drawn, column), "o", color=f"C{number}", markersize=6, **style)
    best = sorted((row for row in rows if row["front"]), key=lambda row: row["p50_us"])
    ax.plot(*_points(best, column), "-", color=_GREY, zorder=0)
    if found.report["truth"]:
        _name_methods(ax, best, column)
    if found.pick is not None and found.pick["way"] == way and column + "_p95" in found.pick:
        ax.plot(*_points([found.pick], column), "o", color="0.1", markersize=14, fillstyle="none", label="picked")
    if not rows:
        _nothing(ax, f"no {quantity} was compared")
    ax.set_xlabel(f"time of a frame, {way} [µs]")
    ax.set_ylabel(f"{quantity} off by, 95th percentile [{unit}]")
    ax.set_title("filled: no other is faster and as accurate", fontsize="medium")
    _legend(ax, is_own)
    return ax


def _points(rows: list[dict[str, Any]], column: str) -> tuple[list[float], list[float]]:
    return [row["p50_us"] for row in rows], [max(row[column + "_p95"], _LEAST) for row in rows]


def _name_methods(ax: Any, best: list[dict[str, Any]], column: str) -> None:
    """Against the truth methods differ, and other options hardly: each method has its name once."""
    named: set[str] = set()
    for row in best:
        if row["orientation_by"] not in named:
            named.add(row["orientation_by"])
            at = [values[0] for values in _points([row], column)]
            # By turns above and below, as several may be as accurate.
            aside = (6, 6) if len(named) % 2 else (6, -14)
            ax.annotate(row["orientation_by"], at, xytext=aside, textcoords="offset points", fontsize="small")
