"""What options cost and give, and calibrations: the command's figures, as tables."""

from __future__ import annotations

import json
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from conftest import ROOT

import somatic_touch as st


def session(path: pathlib.Path, ids: Sequence[int] | np.ndarray = range(4), at_once: bool = False) -> pathlib.Path:
    """Nothing for three seconds, then each sensor in its turn, or all at once, as a 10-bit converter gives it."""
    random = np.random.default_rng(2)
    t, sensors = np.arange(900) / 100, len(ids)
    raw = 200 + random.integers(-1, 2, (900, sensors))
    for sensor in range(sensors):
        at = 350 if at_once else 350 + 100 * sensor
        raw[at : at + 50, sensor] += 100 * (sensor % 4 + 1)
    header = ",".join(["t", *map(str, ids)])
    np.savetxt(path, np.column_stack([t, raw]), delimiter=",", header=header, comments="", fmt="%g")
    return path


@pytest.mark.once
def test_a_calibration_is_the_commands(somatic, tmp_path: pathlib.Path) -> None:
    source, body = session(tmp_path / "session.csv"), st.Body.grid(1, 4, 0.01, name="pad")
    body.save(tmp_path / "pad.glb")
    found = st.calibrate(tmp_path / "pad.glb", source, bits=10)
    told = json.loads(somatic(
        "calibrate", "--body", tmp_path / "pad.glb", "--source", source, "--bits", 10, "-o", tmp_path / "pad.toml", "--json"
    ))
    assert found.calibration.text == (tmp_path / "pad.toml").read_text()
    assert [row["travel"] for row in found] == [sensor["travel"] for sensor in told["sensors"]]
    assert found.report["raw_range"] == told["raw_range"] == [0, 1023] and not found.report["invert"]
    assert found.to_pandas()["baseline"].tolist() == found["baseline"].tolist() == pytest.approx([200.0] * 4, abs=0.5)
    assert found.to_polars().columns == found.keys()
    found.calibration.save(tmp_path / "own.toml")
    assert (tmp_path / "own.toml").read_text() == found.calibration.text
    with pytest.raises(st.SomaticError, match="exists"):
        found.calibration.save(tmp_path / "own.toml")
    # From memory the same.
    assert st.calibrate(body, st.read(source, body=body), bits=10)["travel"].tolist() == found["travel"].tolist()
    # In newtons, where the force is known.
    known = st.calibrate(body, source, known="4.9N", on="taxel")
    assert known.calibration.quantity == "N" and known["gain"][0] == pytest.approx(4.9 / known["travel"][0], rel=1e-3)


@pytest.mark.once
def test_arrays_in_messages_are_calibrated_by_a_map(tmp_path: pathlib.Path) -> None:
    source, body = session(tmp_path / "session.csv"), st.Body.grid(1, 4, 0.01)
    rows = np.loadtxt(source, delimiter=",", skiprows=1)
    lines = [json.dumps({"t": row[0], "pads": [{"force": list(row[1:3])}, {"force": list(row[3:])}]}) for row in rows]
    (tmp_path / "session.ndjson").write_text("\n".join(lines) + "\n")
    (tmp_path / "pads.toml").write_text('values = "pads[*].force"\n')
    with pytest.warns(UserWarning, match="4 values a message"):
        found = st.calibrate(body, tmp_path / "session.ndjson", bits=10, map=str(tmp_path / "pads.toml"))
    assert found.calibration.text == st.calibrate(body, source, bits=10).calibration.text
    with pytest.raises(st.UsageError, match="neither a file nor a preset"):
        st.calibrate(body, source, map="dex4")


@pytest.mark.once
def test_what_cannot_be_calibrated_says_so(tmp_path: pathlib.Path) -> None:
    source, body = session(tmp_path / "session.csv"), st.Body.grid(1, 4, 0.01)
    with pytest.raises(st.InputError, match="moved during the rest.*mask_moved"):
        st.calibrate(body, source, rest=5)
    with pytest.raises(st.UsageError, match="both known= and on="):
        st.calibrate(body, source, known="4.9N")
    with pytest.raises(st.UsageError, match="over 0"):
        st.calibrate(body, source, rest=0)
    with pytest.raises(st.UsageError, match="give a source"):
        st.calibrate(body)


@pytest.mark.once
def test_gains_are_found_from_touches() -> None:
    grid = st.Body.grid(13, 13, 0.005, name="grid")
    finger = (ROOT / "examples" / "simulations" / "finger.toml").read_text()
    touches = st.simulate(finger.replace("rate_hz = 25", "rate_hz = 10"), body=grid).recording
    shares: list[float] = []
    found = st.calibrate(grid, gains_from=touches, calibration=touches.calibration, progress=shares.append)
    told = found["pressed"] > 0
    assert told.any() and np.isfinite(found["gain"][told]).any() and found.report["sigma_m"] > 0
    assert "[layer]" in found.calibration.text and shares == sorted(shares)


@pytest.mark.once
def test_a_trade_has_the_commands_rows(somatic, touch: st.Recording) -> None:
    scene = {"outputs": ["centroid", "orientation"], "fields": "hand/*"}
    found = st.tradeoff(scene=scene, backend="cpu", seconds=0.02, frames=160, within="3 mm")
    told = json.loads(somatic(
        "tradeoff", "--outputs", "centroid,orientation", "--fields", "hand/*", "--backend", "cpu", "--seconds", "0.02", "--frames", 160,
        "--json",
    ))
    names = ["way", "backend", "arithmetic", "charts", "orientation_by", "coverage", "cadence"]
    assert {tuple(row[name] for name in names) for row in found} == {tuple(row[name] for name in names) for row in told["rows"]}
    assert found.report["frames"] == told["frames"] and found.report["truth"] and found.pick is not None
    assert "truth_round_mm_p95" in found
    table = found.to_pandas()
    assert len(table) == len(found) and (table["p50_us"] > 0).all() and table["front"].any()
    assert table["centroid_mm_p95"].notna().all()
    # What was picked is a scene.
    st.Engine(st.Body.bundled("hand"), {**scene, **found.scene}).step(0.0, touch.values[0])
    front = st.tradeoff(scene=scene, source=touch, backend="cpu", seconds=0.02, frames=160, all=False)
    assert front["front"].all() and 0 < len(front) < len(found)
    impossible = st.tradeoff(scene=scene, source=touch, backend="cpu", seconds=0.05, frames=160, budget="1 ns")
    assert impossible.missed and "times" in impossible.missed[0]
    for wrong in ({"seconds": 0}, {"within": "3 kg"}, {"backend": "reference"}):
        with pytest.raises(st.UsageError):
            st.tradeoff(**{"seconds": 0.05, "frames": 160, **wrong})  # type: ignore[arg-type]


@pytest.mark.once
def test_a_pick_is_written_into_a_scene_file(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "hand.scene.toml"
    text = "# Mine.\noutputs = [\"centroid\"] # where\n\n[accuracy]\ncentroid = \"3 mm\"\n"
    path.write_text(text)
    small: dict[str, Any] = {"source": touch, "backend": "cpu", "seconds": 0.02, "frames": 40, "write": path}
    with pytest.warns(UserWarning, match="hand.scene.toml: it stays as it was: no options meet"):
        st.tradeoff(**small, budget="1 ns")
    assert path.read_text() == text
    found = st.tradeoff(**small)
    assert found.pick is not None and not found.missed
    written = path.read_text()
    assert written.startswith("# Mine.\noutputs = [\"centroid\"] # where\n") and "centroid = " not in written
    assert f'backend = "{found.pick["backend"]}"' in written
    assert st.Scene.load(path) == st.Scene({"outputs": ["centroid"], **found.scene})
    # The wish has gone with the first pick.
    with pytest.raises(st.UsageError, match="write= needs within= or budget="):
        st.tradeoff(**small)
    with pytest.raises(st.InputError, match="no such file"):
        st.tradeoff(**{**small, "write": tmp_path / "none.toml"}, within="3 mm")


def test_a_table_of_columns() -> None:
    table = st.Table([{"a": 1, "b": None}, {"a": 2, "b": 0.5}])
    assert table["a"].tolist() == [1, 2] and np.isnan(table["b"][0]) and list(table)[0] == {"a": 1}
    assert table.to_arrow()["b"].null_count == 1 and table.to_polars()["b"].null_count() == 1
    assert "<td>2</td>" in table._repr_html_() and "b" in table and table != st.Table([])
    with pytest.raises(KeyError, match="no column `c`"):
        table["c"]
