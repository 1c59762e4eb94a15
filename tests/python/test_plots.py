"""Pictures on matplotlib's axes: what is drawn is what the columns have."""

from __future__ import annotations

import copy
import json
import sys
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import somatic_touch as st

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def p() -> st.Percepts:
    touch = st.read("hand")
    return touch.engine(backend="cpu").process(touch.t, touch.values)


def lines(ax) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in ax.lines if not line.get_label().startswith("_")}


def test_percepts_are_lines_over_time(p: st.Percepts) -> None:
    ax = p.plot("total", fields=["hand/back", "hand/palm"])
    drawn = lines(ax)
    assert list(drawn) == ["hand/back", "hand/palm"] and (ax.get_xlabel(), ax.get_ylabel()) == ("t [s]", "total [count]")
    assert np.array_equal(drawn["hand/back"], p["total"][:, p.index("hand/back")])
    ax = p.plot("position", fields="hand/back")
    drawn = lines(ax)
    assert list(drawn) == ["hand/back x", "hand/back y", "hand/back z"] and ax.get_ylabel() == "position [m]"
    for axis, values in enumerate(drawn.values()):
        column = np.where(p.present("position"), p["position"][..., axis], np.nan)[:, p.index("hand/back")]
        assert np.array_equal(values, column, equal_nan=True) and np.isnan(values).any()


def test_many_fields_are_the_ten_that_are_pressed_longest(p: st.Percepts) -> None:
    ax = p.plot()
    assert len(lines(ax)) == 10 and ax.get_title() == "10 of 12 fields in contact"
    nothing = p.between(100).plot()
    assert not lines(nothing) and "no field is in contact" in nothing.texts[0].get_text()


def test_axes_that_are_given_are_used(p: st.Percepts) -> None:
    figure, (first, second) = plt.subplots(2)
    assert p.plot("total", ax=first) is first and p.touches.plot(ax=second) is second
    assert plt.get_fignums() == [figure.number]


def test_a_value_between_gaps_is_a_point() -> None:
    engine = st.Engine(st.Body.grid(1, 3, 0.01), {"outputs": ["centroid"]}, backend="cpu")
    p = engine.process([0, 1, 2], [[0, 0, 0], [0, 5, 0], [0, 0, 0]])
    points = [line for line in p.plot().lines if line.get_marker() == "."]
    assert [line.get_xdata().tolist() for line in points] == [[1], [1]]


def test_dates_count_from_the_first() -> None:
    touch = st.read("hand")
    engine = touch.engine({"outputs": ["total"]}, backend="cpu")
    p = engine.process(np.datetime64("2026-01-02", "us") + (1e6 * touch.t).astype("m8[us]"), touch.values)
    ax = p.plot()
    assert ax.get_xlabel() == "s since 2026-01-02 00:00:00.000000 UTC" and ax.lines[0].get_xdata()[0] == 0


def test_touches_are_lines_by_their_identity(p: st.Percepts) -> None:
    touches = p.touches
    ax = touches.plot()
    drawn = lines(ax)
    assert len(drawn) == len(np.unique(touches.id)) == 6
    assert np.array_equal(drawn["touch 5 on hand"], touches.total[touches.id == 5])
    assert "touch 5 on hand along" in lines(touches.plot("spread"))
    assert not lines(p.between(100).touches.plot())
    with pytest.raises(st.UnknownNameError):
        touches.plot("spraed")
    with pytest.raises(st.UsageError, match="plot one of"):
        touches.plot("link")
    only = st.Engine(st.Body.grid(1, 3, 0.01), {"outputs": ["touches"]}, backend="cpu").step(0, [0, 1, 0])
    with pytest.raises(st.UsageError, match=r"touches alone; see `\.touches\.plot\(\)`"):
        only.plot()


def test_bodies_are_taxels_in_the_world(hand: st.Body) -> None:
    ax = hand.plot()
    offsets = np.concatenate([np.column_stack(points._offsets3d) for points in ax.collections if hasattr(points, "_offsets3d")])
    places = hand.taxels["place"]
    assert np.allclose(np.sort(offsets, axis=0), np.sort(places, axis=0))
    assert [text.get_text() for text in ax.get_legend().get_texts()] == hand.links
    values = np.arange(40.0)
    values[3] = np.nan
    ax = hand.plot(values, unit="kPa", surface=False)
    hollow, coloured = ax.collections
    assert np.allclose(np.column_stack(hollow._offsets3d), places[[3]]) and np.array_equal(coloured.get_array(), np.delete(values, 3))
    with pytest.raises(st.UsageError, match=r"\[taxels\] = \[40\].*shape \[3\]"):
        hand.plot([1, 2, 3])
    with pytest.raises(st.UsageError, match='projection="3d"'):
        hand.plot(ax=plt.figure().add_subplot())


def test_compared_layouts_are_bars(hand: st.Body) -> None:
    told = st.compare(st.Body.grid(4, 4, 0.01, name="coarse"), st.Body.grid(8, 8, 0.005, name="fine"), touches=60)
    ax = told.plot()
    layouts = told["layouts"]
    errors = [layout["place"] for layout in layouts] + [layout["ideal"]["place"] for layout in layouts]
    drawn = sorted(bar.get_height() for bar in ax.patches)
    assert drawn == pytest.approx(sorted(1e3 * each[name] for each in errors for name in ("median", "p95")))
    assert [text.get_text() for text in ax.get_xticklabels()] == [layouts[0]["body"], "ideal skin", layouts[1]["body"], "ideal skin"]
    assert told.plot("axis").get_ylabel() == "axis off by [degrees]" and json.loads(json.dumps(told)) == told
    with pytest.raises(st.UsageError, match="plot one of place, axis, force"):
        told.plot("plaice")  # type: ignore[arg-type]


def test_calibrations_are_where_sensors_rest_and_how_far_they_go() -> None:
    sensors = [
        {"taxel": 3, "baseline": 100.0, "noise": 1.0, "dead_band": 4.0, "travel": 200.0},
        {"taxel": 5, "baseline": 90.0, "noise": 1.0, "dead_band": 4.0, "travel": None},
    ]
    found = st.Calibrated({"rows": sensors, "invert": True, "raw_range": [0, 1023]}, st.Calibration("", st.Body.grid(1, 2, 0.01)))
    ax = found.plot()
    pressed, bands = ([segment.tolist() for segment in lines.get_segments()] for lines in ax.collections)
    assert pressed == [[[3, 100], [3, -100]]] and bands == [[[3, 96], [3, 104]], [[5, 86], [5, 94]]]
    drawn = lines(ax)
    assert drawn["at rest"].tolist() == [100] and drawn["never pressed, or lost"].tolist() == [90]
    gains = [{"taxel": 0, "gain": 1.25, "pressed": 4}, {"taxel": 1, "gain": None, "pressed": 0}]
    ax = st.Calibrated({"rows": gains}, found.calibration).plot()
    assert lines(ax)["found from touches"].tolist() == [1.25] and ax.get_ylabel() == "gain"


def row(way: str, us: float, off: float, front: bool, by: str = "as-asked") -> dict[str, Any]:
    errors = {"compared": 3, "rms": off, "median": off, "p95": off, "p99": off, "worst": off}
    words = {"backend": "cpu", "arithmetic": "one-pass", "charts": "plane", "orientation_by": by, "coverage": "all", "cadence": "every-frame"}
    return {"way": way, **words, "p50_us": us, "p99_us": us, "centroid_mm": errors, "orientation_deg": errors, "truth": None, "front": front}


def test_a_trade_is_time_against_error() -> None:
    rows = [row("live", 2.0, 1.0, True), row("live", 4.0, 0.0, True), row("live", 5.0, 1.0, False), row("batch", 1.0, 3.0, True)]
    report = {"rows": rows, "truth": False, "asked_by": "as-asked", "pick": rows[1], "missed": []}
    found = st.Tradeoff(copy.deepcopy(report))
    ax = found.plot()
    drawn = lines(ax)
    assert drawn["cpu, one-pass"].tolist() == [1.0, 1e-9] and drawn["picked"].tolist() == [1e-9]
    beaten = [line for line in ax.lines if line.get_fillstyle() == "none" and line.get_label().startswith("_")]
    assert [line.get_xdata().tolist() for line in beaten] == [[5.0]]
    assert "picked" not in lines(found.plot("orientation", way="batch"))
    front = st.Tradeoff(copy.deepcopy(report), all=False)
    assert front["p50_us"].tolist() == [2.0, 4.0, 1.0] and front.pick == found.pick and len(found) == 4
    truth = {name: {**rows[0]["centroid_mm"], "p95": 7.0} for name in ("place_mm", "orientation_deg")}
    true = st.Tradeoff({**report, "truth": True, "rows": [{**rows[0], "truth": truth}], "pick": None})
    ax = true.plot("orientation")
    assert lines(ax)["cpu, one-pass"].tolist() == [7.0] and [text.get_text() for text in ax.texts] == ["as-asked"]
    assert true.plot(way="batch").texts[0].get_text() == "no place was compared"
    with pytest.raises(st.UsageError, match="plot one of place, orientation"):
        found.plot("axis")  # type: ignore[arg-type]


def test_without_matplotlib_it_says_what_to_install(p: st.Percepts, hand: st.Body, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    empty = st.Tradeoff({"rows": [], "truth": False, "asked_by": "as-asked"})
    for plot in (p.plot, p.touches.plot, hand.plot, empty.plot):
        with pytest.raises(st.SomaticError, match="pip install matplotlib"):
            plot()
