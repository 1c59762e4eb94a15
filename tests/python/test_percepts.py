"""Percepts equal the command's, to the bit."""

from __future__ import annotations

import csv
import json
import pathlib
from typing import Any

import numpy as np
import pytest
from conftest import DATA, ROOT, pressed

import somatic_touch as st

ALL = (
    "total,peak,active,area,centroid,position,normal,orientation,principal_axis,anisotropy,displacement,direction,distance,"
    "radial_distance,speed,radial_speed,filtered_displacement,filtered_direction,filtered_speed,touches"
).split(",")


def compare(p: st.Percepts, text: str) -> int:
    """Compares percepts with NDJSON of all fields; gives how many numbers were equal."""
    compared = 0
    lines = [json.loads(line) for line in text.splitlines()]
    assert len(lines) == len(p.t)
    touches = p.touches
    columns = {name: touches[name] for name in ("principal_axis", "velocity", "spread", "anisotropy")}
    touch_rows = iter(zip(touches.id, touches.total, touches.active, touches.link, touches.position, range(len(touches)), strict=True))
    for index, line in enumerate(lines):
        assert line["t"] == p.t[index]
        assert [field["field"] for field in line["fields"]] == p.fields
        for number, field in enumerate(line["fields"]):
            assert field["contact"] == p.contact[index, number]
            flags = [str(flag.name).lower() for flag in st.Flags(p.flags[index, number])]
            assert flags == field["flags"]
            for name in p.keys():
                column, present = p[name], p.present(name)
                assert present[index, number] == (name in field), (index, name)
                got = column[index, number]
                if name in field:
                    assert np.array_equal(got, np.asarray(field[name], column.dtype)), (index, name)
                    compared += 1
                elif column.dtype.kind == "f":
                    assert np.isnan(got).all()
        for touch in line["touches"]:
            identity, total, active, link, position, row = next(touch_rows)
            assert (identity, active, link) == (touch["id"], touch["active"], touch["link"])
            assert total == touch["total"] and np.array_equal(position, touch["position"])
            assert [str(flag.name).lower() for flag in st.TouchFlags(touches.flags[row])] == touch["flags"]
            for name in ("principal_axis", "velocity", "spread", "anisotropy"):
                got = columns[name][row]
                assert np.isnan(got).all() if name not in touch else np.array_equal(got, touch[name]), (index, name)
            compared += 1
    assert next(touch_rows, None) is None
    return compared


@pytest.fixture(params=["reference", "cpu", "gpu"])
def backend(request) -> str:
    return request.getfixturevalue("gpu") if request.param == "gpu" else request.param


def test_the_bundled_touch(somatic, touch: st.Recording, backend: Any) -> None:
    text = somatic("run", "--quiet", "--backend", backend, "--outputs", ",".join(ALL), "--all-fields", "--sink", "-")
    p = touch.engine({"outputs": ALL}, backend=backend).process(touch.t, touch.values)
    assert compare(p, text) > 10_000
    assert p["total"].dtype == (np.float64 if backend == "reference" else np.float32)
    # The comparison itself can fail.
    other = touch.values.copy()
    other[0] += 1
    changed = touch.engine({"outputs": ALL}, backend=backend).process(touch.t, other)
    with pytest.raises(AssertionError):
        compare(changed, text)


def test_touches_have_fits(somatic) -> None:
    rod = ROOT / "examples/simulations/turn.toml"
    outputs = ["touches.fit_kind", "touches.fit_place", "touches.fit_direction", "touches.fit_sigmas"]
    text = somatic("run", "--quiet", "--source", f"sim:{rod}", "--backend", "cpu", "--outputs", ",".join(outputs), "--sink", "-")
    recording = st.simulate(rod).recording
    touches = recording.engine({"outputs": outputs}, backend="cpu").process(recording.t, recording.values).touches
    rows = [touch for line in map(json.loads, text.splitlines()) for touch in line["touches"]]
    assert len(rows) == len(touches) > 150
    told = 0
    for index, row in enumerate(rows):
        assert [str(flag.name).lower() for flag in st.TouchFlags(touches.flags[index])] == row["flags"]
        for name in ["fit_place", "fit_direction", "fit_angle_sigma"]:
            got = touches[name][index]
            assert np.array_equal(got, row[name]) if name in row else np.isnan(got).all()
            told += name in row
    assert told > 200
    with pytest.raises(st.UsageError, match="fit_width"):
        touches["fit_width"]
    percepts = recording.engine({"outputs": outputs}, backend="cpu").process(recording.t, recording.values)
    with pytest.raises(st.UsageError, match="`fit_place` is `touches.fit_place` now; see `.touches`"):
        percepts["fit_place"]


def test_a_grid(somatic, tmp_path: pathlib.Path, backend: Any) -> None:
    mat = st.Body.grid(13, 7, 0.01, name="sheet", regions=(3, 2))
    mat.save(tmp_path / "sheet.glb")
    t, values = pressed(mat, 90)
    with (tmp_path / "touch.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["t", *mat.taxels["id"]])
        rows.writerows([[time, *row] for time, row in zip(t, values.tolist(), strict=True)])
    text = somatic(
        "run", "--quiet", "--body", tmp_path / "sheet.glb", "--source", tmp_path / "touch.csv", "--backend", backend,
        "--outputs", ",".join(ALL), "--all-fields", "--sink", "-",
    )
    p = st.Engine(mat, {"outputs": ALL}, backend=backend).process(t, values)
    assert compare(p, text) > 5_000
    read = st.read(tmp_path / "touch.csv", body=str(tmp_path / "sheet.glb"))
    assert np.array_equal(read.values, values) and np.array_equal(read.t, t)


def test_a_grasp(somatic, tmp_path: pathlib.Path, backend: Any) -> None:
    grasps = sorted((DATA / "recordings" / "icub_grasp").glob("*.csv"))
    if not grasps:
        pytest.skip(f"no grasps in {DATA}")
    body = st.Body.grid(5, 12, 0.004, name="fingers", regions=(5, 1))
    body.save(tmp_path / "fingers.glb")
    calibration = "[all]\nbaseline = 245\ninvert = true\ndead_band = 4\n"
    (tmp_path / "fingers.toml").write_text(calibration)
    compared = 0
    for grasp in grasps[:4]:
        text = somatic(
            "run", "--quiet", "--body", tmp_path / "fingers.glb", "--source", grasp, "--backend", backend,
            "--calibration", tmp_path / "fingers.toml", "--outputs", ",".join(ALL), "--all-fields", "--sink", "-",
        )
        recording = st.read(grasp, body=body)
        engine = recording.engine({"outputs": ALL}, st.Calibration(calibration, body), backend)
        compared += compare(engine.process(recording.t, recording.values), text)
    assert compared > 500


def test_percepts_do_not_depend_on_the_cut(touch: st.Recording, backend: Any) -> None:
    whole = touch.engine({"outputs": ALL}, backend=backend).process(touch.t, touch.values)
    for cut in (1, 7, 64):
        engine = touch.engine({"outputs": ALL}, backend=backend)
        parts = [
            engine.process(touch.t[start : start + cut], touch.values[start : start + cut])
            for start in range(0, len(touch), cut)
        ]
        for name in whole:
            assert np.array_equal(np.concatenate([part[name] for part in parts]), whole[name], equal_nan=True), name
        assert [part.first_frame for part in parts] == list(range(0, len(touch), cut))
    steps = touch.engine({"outputs": ALL}, backend=backend)
    for index in range(100):
        p = steps.step(touch.t[index], touch.values[index])
        assert np.array_equal(p["centroid"][0], whole["centroid"][index], equal_nan=True)


def test_a_scene_file_gives_what_the_command_gives(somatic, touch: st.Recording) -> None:
    path = ROOT / "examples" / "scenes" / "palm.toml"
    text = somatic("run", path, "--quiet", "--backend", "cpu", "--all-fields", "--sink", "-")
    p = touch.engine(st.Scene.load(path), backend="cpu").process(touch.t, touch.values)
    lines = [json.loads(line) for line in text.splitlines()]
    assert [field["field"] for field in lines[0]["fields"]] == p.fields
    got = [[field.get("centroid", [np.nan] * 2) for field in line["fields"]] for line in lines]
    assert np.array_equal(np.array(got, np.float32), p["centroid"], equal_nan=True)


def test_missing_and_faulty_values(hand: st.Body) -> None:
    engine = st.Engine(hand, {"outputs": ["total"]}, backend="cpu")
    values = np.ones((1, 40), np.float32)
    values[0, 16] = np.nan
    mask = np.zeros((1, 40), bool)
    mask[0, 17] = True
    back = engine.fields.index("hand/back")
    flags = lambda *arguments: st.Flags(engine.process([0.0], *arguments).flags[0, back])  # noqa: E731
    assert st.Flags.FAULTY_INPUT in flags(values)
    assert st.Flags.INCOMPLETE not in flags(values)
    assert st.Flags.INCOMPLETE in flags(values, mask)
    assert st.Flags.INCOMPLETE in flags(np.ones((1, 40)), mask[0])
    assert flags(np.ones((1, 40))) & (st.Flags.INCOMPLETE | st.Flags.FAULTY_INPUT) == 0


def test_poses(hand: st.Body) -> None:
    engine = st.Engine(hand, {"outputs": ["position", "normal"]}, backend="cpu")
    values = np.ones((3, 40), np.float32)
    still = engine.process([0, 1, 2], values)
    moved = engine.process([3, 4, 5], values, pose={"hand": [1, 2, 3, 0, 0, 0, 1]})
    assert not still.in_world.any() and moved.in_world.all()
    # Where the anchor is the link that is posed; the others hang on it as at rest.
    back = engine.fields.index("hand/back")
    assert np.allclose((moved["position"] - still["position"])[:, back], [1, 2, 3])
    each = np.tile(np.array([0, 0, 0, 0, 0, 0, 1.0]), (3, 1))
    each[:, 0] = [0, 1, 2]
    moving = engine.process([6, 7, 8], values, pose={"hand": each})
    assert np.allclose((moving["position"] - still["position"])[:, back, 0], [0, 1, 2])


def test_values_without_a_copy_are_read_where_they_are(touch: st.Recording) -> None:
    # What is converted first gives the same percepts.
    wanted = touch.engine(backend="cpu").process(touch.t, touch.values)
    values = np.where(touch.mask, np.float32(0), touch.values)
    for other in (values.astype(np.float64), values.astype(np.uint16), np.asfortranarray(values), values[::-1][::-1]):
        got = touch.engine(backend="cpu").process(touch.t, other, touch.mask)
        assert np.array_equal(got["total"], wanted["total"])


def test_units(hand: st.Body) -> None:
    p = st.Engine(hand, calibration=st.Calibration("[all]\nunit = 'kPa'", hand), backend="cpu").step(0, [1] * 40)
    assert (p.unit("total"), p.unit("force"), p.unit("centroid"), p.unit("anisotropy")) == ("Pa", "N", "m", "1")
    assert p["peak"].max() == 1000
    assert st.Engine(hand, backend="cpu").step(0, [1] * 40).unit("total") == "count"


def test_an_old_name_gives_an_error_with_the_new_one(touch: st.Recording) -> None:
    for scene, new in [
        ({"outputs": ["axis"]}, "`axis` is `principal_axis` now"),
        ({"outputs": ["footprint_angle"]}, "`footprint_angle` is `touches.fit_direction` now"),
        ({"outputs": ["fit_place"]}, "`fit_place` is `touches.fit_place` now"),
        ({"in": "hand"}, "`in` is `relative_to` now"),
        ({"force": True}, "`force` is `overwrite` now"),
        ("speed = 2", "`speed` is `playback_speed` now"),
    ]:
        with pytest.raises(st.UsageError if isinstance(scene, dict) else st.SomaticError, match=new):
            st.Scene(**scene) if isinstance(scene, dict) else touch.engine(scene, backend="cpu")
    p = touch.engine({"outputs": ["principal_axis"]}, backend="cpu").process(touch.t[:2], touch.values[:2])
    with pytest.raises(st.UsageError, match="`axis` is `principal_axis` now"):
        p["axis"]
    with pytest.raises(AttributeError, match="`contacts` is `self_contacts` now"):
        p.contacts  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="no attribute 'banana'"):
        p.banana  # type: ignore[attr-defined]
    assert not hasattr(p, "__array__")
