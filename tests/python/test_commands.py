"""What the command can, Python can."""

from __future__ import annotations

import inspect
import json
import pathlib
import re
from operator import attrgetter

import numpy as np
import pytest
from conftest import ROOT

import somatic_touch as st

ALONE = {"completions", "devices", "board", "tune", "paper", "help"}
"""What is for a terminal, or for boards' own settings."""


@pytest.mark.once
def test_all_that_the_command_lists_is_callable(somatic) -> None:
    listed = set(re.findall(r"^  ([a-z]+)  +\S", somatic("--help"), re.MULTILINE))
    assert len(listed) > 15 and listed >= ALONE, listed
    callables = {name for name in st.__all__ if callable(getattr(st, name))}
    assert listed - ALONE - callables == set()


ITS_RESULT = "what the function gives is Python's own, with names"
"""Why `--json` is no keyword."""

ELSEWHERE = {
    "info": {"json": ITS_RESULT},
    "convert": {"output": "=to"},
    "plot": {"output": "=path"},
    "author": {
        "output": "Body.save",
        "force": "Body.save",
        "json": "Body.taxels",
        "errors": "inspect",
        "compare": "compare",
        "grid": "Body.grid",
        "pitch": "Body.grid",
        "ids": "Body.grid",
        "cells": "Body.grid",
    },
    "inspect": {"json": ITS_RESULT, "strict": "it is the exit code of a process; `findings` are empty or not"},
    "render": {"output": "Picture.save", "force": "Picture.save", "source": "=what"},
    "calibrate": {"output": "Calibration.save", "force": "Calibration.save", "json": ITS_RESULT, "plot": "Calibrated.plot"},
    "plan": {"json": ITS_RESULT, "schema": "it prints what editors of scene files read, whatever the scene"},
    "tradeoff": {"json": ITS_RESULT, "plot": "Tradeoff.plot"},
    "simulate": {"output": "convert", "force": "convert", "truth": "Simulation.truth"},
    "bench": {
        **dict.fromkeys(
            ("sensors", "fields", "members", "wide", "local", "seed", "dump", "force"),
            "the command measures made-up skins; this measures a body, from Python",
        ),
        "outputs": "=scene",
        "calls": "=seconds",
        "json": ITS_RESULT,
    },
    "outputs": {"json": ITS_RESULT},
    "run": {
        "check-order": "it is for somebody who presses one pad after the other, at a terminal",
        "describe": "Engine.columns",
        "for": "Live.stop",
        "summary": "Live.boards",
        "table": "Percepts.touches",
    },
    "view": {"beside": "a page shows what one engine computes; each recording has a `view` of its own", "for": "Shown.close"},
}
"""
Flags without a keyword, and where Python has them: a function, a method, or another parameter of the function (after `=`); else why it
has not.
"""


@pytest.mark.once
def test_flags_of_a_command_are_keywords(somatic) -> None:
    schema = json.loads((ROOT / "docs" / "scene.schema.json").read_text())
    of_scene = {key for part in (schema, *schema["$defs"].values()) for key in part.get("properties", {})} | {"force", "speed", "within"}
    reading = inspect.signature(st.read).parameters
    for command, others in ELSEWHERE.items():
        flags = set(re.findall(r"^ {2,6}(?:-\w, )?--([a-z-]+)", somatic(command, "--help"), re.MULTILINE)) - {"help"}
        keywords = set(inspect.signature(getattr(st, command)).parameters)
        keywords |= set(reading) if "reading" in keywords else set()
        # A run's flags are keys of its scene.
        keywords |= of_scene if {"letters", "tare"} <= flags else set()
        words = {flag: flag.replace("-", "_") for flag in flags}
        # `outputs` are other things than an `output`.
        ends = {"output": ("",)}
        missing = {flag for flag, word in words.items() if not keywords & {word + end for end in ends.get(flag, ("", "s", "_s", "_hz", "_m"))}}
        assert missing - set(others) == set(), command
        assert set(others) <= flags, f"{command} has lost a flag"
        # What has a keyword needs no place elsewhere.
        assert set(others) <= missing, command
        for flag, place in others.items():
            is_there = place[1:] in keywords if place.startswith("=") else " " in place or attrgetter(place)(st) is not None
            assert is_there, f"{command} --{flag}: {place}"


@pytest.mark.once
def test_columns_are_described_as_by_the_command(somatic) -> None:
    engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["total", "centroid", "touches"]}, backend="cpu")
    told = somatic("run", "--quiet", "--describe", "--outputs", "total,centroid,touches")
    parts = told.split("\n\nin a second file")
    for table, text in zip(("fields", "touches"), parts, strict=True):
        rows = [line.split() for line in text.splitlines()[2:]]
        columns = engine.columns(table)  # type: ignore[arg-type]
        assert [row[0] for row in rows] == columns["name"].tolist()
        for row, column in zip(rows, columns, strict=True):
            assert column["unit"] in (*row, "") and column["type"].split()[0] in row and column["what"].split()[-1] == row[-1]
            assert column["absent"] == ("or absent" in " ".join(row[:8]))
    with pytest.raises(st.UsageError, match="were not asked for"):
        engine.columns("self_contacts")
    with pytest.raises(KeyError, match="did you mean `touches`"):
        engine.columns("touch")  # type: ignore[arg-type]


@pytest.mark.once
def test_contacts_of_a_recording_are_a_table(somatic, touch: st.Recording, tmp_path: pathlib.Path) -> None:
    st.convert(touch, tmp_path / "touch.mcap")
    somatic("info", tmp_path / "touch.mcap", "--contacts", tmp_path / "theirs.csv", "--shortest", "0")
    known = st.info(tmp_path / "touch.mcap", contacts=tmp_path / "mine.csv", shortest_s=0.0)
    assert (tmp_path / "mine.csv").read_bytes() == (tmp_path / "theirs.csv").read_bytes()
    contacts = known["contacts"]
    counts = {field["field"]: field["contacts"] for field in known["fields"]}
    assert {name: contacts["field"].tolist().count(name) for name in counts} == counts and len(contacts) > 3
    assert (contacts["offset [s]"] > contacts["onset [s]"]).all() and contacts["whole"].dtype == bool
    assert np.isnan(contacts["force_peak [N]"].astype(float)).all() and (contacts["total_peak"] > 0).all()
    assert "contacts" not in st.info(tmp_path / "touch.mcap") and len(contacts.to_pandas()) == len(contacts)
    again = st.info(tmp_path / "touch.mcap", contacts=True, shortest_s=0.0)["contacts"]
    assert again["path [m]"].tolist() == pytest.approx(contacts["path [m]"].tolist(), nan_ok=True)
    with pytest.raises(st.SomaticError, match="exists"):
        st.info(tmp_path / "touch.mcap", contacts=tmp_path / "mine.csv")
    st.info(tmp_path / "touch.mcap", contacts=tmp_path / "mine.csv", force=True)
    with pytest.raises(st.SomaticError, match="touch.mcap"):
        st.info(tmp_path / "touch.mcap", contacts=tmp_path / "touch.mcap", force=True)
    with pytest.warns(UserWarning, match="no place for what is attached"):
        st.convert(touch, tmp_path / "touch.csv")
    with pytest.raises(st.UsageError, match="it has no body, which contacts need"):
        st.info(tmp_path / "touch.csv", contacts=True)


@pytest.mark.once
def test_zones_are_the_commands(somatic, tmp_path: pathlib.Path) -> None:
    insole = st.Body.grid(20, 8, 0.01, name="insole")
    insole.save(tmp_path / "insole.glb")
    somatic("author", tmp_path / "insole.glb", "--zones", "heel=30%,midfoot,toes", "-o", tmp_path / "theirs.glb")
    theirs = st.Body.load(tmp_path / "theirs.glb").fields
    for shape in (insole, tmp_path / "insole.glb"):
        fields = st.author(shape, zones="heel=30%,midfoot,toes").fields
        assert {name: field.taxels.tolist() for name, field in fields.items()} == {
            name: field.taxels.tolist() for name, field in theirs.items()
        }
    assert len(theirs["insole/heel"]) == 48 and st.author(insole, zones="heel,toes").name == "insole"
    (tmp_path / "zones.csv").write_text("taxel,zone\n0,toe\n1,toe\n159,heel\n")
    for zones in ({0: "toe", 1: "toe", 159: "heel"}, tmp_path / "zones.csv", str(tmp_path / "zones.csv")):
        body = st.author(insole, zones=zones)  # type: ignore[arg-type]
        assert body.fields["insole/toe"].taxels.tolist() == [0, 1] and body.fields["insole/heel"].taxels.tolist() == [159]
    wrong: list[tuple[dict[str, object], str]] = [
        ({"zones": "heel=130%,toes"}, "zones: .*heel=30%"),
        ({"zones": {}}, "zones should have by taxel its zone"),
        ({"zones": {0: " "}}, "zones should have by taxel its zone"),
        ({"zones": "a,b", "taxels": 3}, "taxels: zones are parts of a skin that is there"),
        ({"zones": "a,b", "up": "y"}, "up: a body has been read"),
    ]
    for keys, what in wrong:
        with pytest.raises(st.UsageError, match=what):
            st.author(insole, **keys)  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="zones: this skin has its places"):
        st.author(csv_skin=tmp_path / "zones.csv", zones="a,b")
    with pytest.raises(st.InputError, match="taxel 999"):
        st.author(insole, zones={999: "toe"})


@pytest.mark.once
def test_info_is_the_commands(somatic, touch: st.Recording, tmp_path: pathlib.Path) -> None:
    assert st.convert(touch, tmp_path / "touch.mcap") == 280
    with pytest.warns(UserWarning, match="no place for what is attached: hand"):
        assert st.convert(tmp_path / "touch.mcap", tmp_path / "touch.csv") == 280
    for name in ("touch.mcap", "touch.csv"):
        told = json.loads(somatic("info", tmp_path / name, "--json"))
        known = st.info(tmp_path / name)
        for key in ("kind", "bytes", "taxels", "frames", "start", "duration", "rate_hz", "gaps", "backwards", "losses"):
            assert known[key] == pytest.approx(told[key]), key
        assert known["fields"] == told["fields"]
    assert known["frames"] == 280 and known["fields"] is None
    (palm,) = [field for field in st.info(tmp_path / "touch.mcap")["fields"] if field["field"] == "hand/palm"]
    assert palm["contacts"] > 0 and palm["peak"] >= palm["mean"] > 0 and palm["unit"] == "count"
    many = st.info(tmp_path / "touch.mcap", threshold="1%", shortest_s=0.0)["fields"]
    assert sum(field["contacts"] for field in many) >= palm["contacts"]
    with pytest.raises(st.UsageError, match="no newtons here"):
        st.info(tmp_path / "touch.mcap", threshold="20N")
    with pytest.raises(st.InputError, match="no-such"):
        st.info("no-such.csv")


@pytest.mark.once
def test_frames_come_through_bit_for_bit(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    assert touch.body is not None
    st.convert(touch, tmp_path / "touch.mcap", calibration=st.Calibration("[all]\ngain = 2", touch.body))
    again = st.read(tmp_path / "touch.mcap")
    assert again.values.tobytes() == touch.values.tobytes() and again.calibration is not None
    assert again.calibration.text == "[all]\ngain = 2"
    with pytest.raises(st.SomaticError, match="exists"):
        st.convert(touch, tmp_path / "touch.mcap")
    with pytest.warns(UserWarning, match="no place for fields"):
        assert st.convert("hand", tmp_path / "skin.csv") == 40
    assert len(st.author(csv_skin=tmp_path / "skin.csv").taxels) == 40
    with pytest.raises(st.UsageError, match="becomes a .csv or a .urdf"):
        st.convert(touch.body, tmp_path / "skin.mcap")


@pytest.mark.once
def test_bodies_and_quantities_are_the_commands(somatic) -> None:
    told, seen = json.loads(somatic("inspect", "hand", "--json")), st.inspect("hand")
    assert [field["name"] for field in told["fields"]] == [field["name"] for field in seen["fields"]]
    assert seen["taxels"] == 40 and sum(link["taxels"] for link in seen["links"]) == 40 and 0 < seen["skin"]["covered"] < seen["skin"]["area"]
    listed = json.loads(somatic("outputs", "--json"))
    assert [row["name"] for row in listed["touches"] + listed["fields"]] == st.outputs()["name"].tolist()
    assert [row["unit"] for row in listed["touches"] + listed["fields"]] == st.outputs()["unit"].tolist()
    assert [row["default"] for row in listed["touches"] + listed["fields"]] == st.outputs()["default"].tolist()


@pytest.mark.once
def test_errors_of_a_layout_are_the_commands(somatic, tmp_path: pathlib.Path) -> None:
    coarse = st.Body.grid(5, 5, 0.01, name="coarse")
    coarse.save(tmp_path / "coarse.glb")
    told = json.loads(somatic("inspect", tmp_path / "coarse.glb", "--errors", "--json"))
    assert st.inspect(coarse, errors=True)["errors"] == told["errors"] and st.inspect(coarse)["errors"] is None
    compared = st.compare(coarse, tmp_path / "coarse.glb", touches=40)
    one, other = ({**layout, "frame_s": 0, "body": ""} for layout in compared["layouts"])
    assert one == other and one["place"]["touches"] <= one["touches"] == 40
    with pytest.raises(st.UsageError, match="1 or more"):
        st.compare(coarse, coarse, touches=0)
    assert compared["same_places"] and compared["second_is_nearer"] == 0 and compared["layouts"][1]["frame_s"] > 0


@pytest.mark.once
def test_exports_are_described_and_converted(somatic, tmp_path: pathlib.Path) -> None:
    plain = tmp_path / "plain.txt"
    plain.write_text("\n".join(" ".join(map(str, row)) for row in np.arange(24).reshape(8, 3)))
    keys = {"grid": "4x3", "pitch": "10mm", "rate_hz": 50, "format": "matrix", "unit": "kPa"}
    flags = ("--grid", "4x3", "--pitch", "10mm", "--rate", 50, "--format", "matrix", "--unit", "kPa")
    told, known = json.loads(somatic("info", plain, *flags, "--json")), st.info(plain, **keys)
    assert known == told
    assert (known["frames"], known["unit"], known["panels"][0]["taxels"]) == (2, "kPa", 12)
    somatic("convert", plain, tmp_path / "theirs.csv", *flags)
    with pytest.warns(UserWarning, match="what is attached"):
        assert st.convert(plain, tmp_path / "mine.csv", **keys) == 2
    assert (tmp_path / "mine.csv").read_bytes() == (tmp_path / "theirs.csv").read_bytes()


@pytest.mark.once
def test_poses_of_a_urdf_are_looked_at(somatic, tmp_path: pathlib.Path) -> None:
    robot = ROOT / "examples" / "robots" / "arm.urdf"
    body = st.author(robot, taxels=60, seed=1)
    body.save(tmp_path / "arm.glb")
    for keys, flags in (({}, ()), ({"joints": robot}, ("--joints", robot)), ({"joints": robot, "up": "z"}, ("--joints", robot, "--up", "z"))):
        told = json.loads(somatic("inspect", tmp_path / "arm.glb", *flags, "--json"))
        assert st.inspect(body, **keys)["findings"] == told["findings"]  # type: ignore[arg-type]
    with pytest.raises(st.SomaticError, match="arm.urdf"):
        st.inspect("hand", joints=robot)
    with pytest.raises(st.UsageError, match="give both"):
        st.inspect(body, up="z")
    with pytest.raises(st.UsageError, match="contact_tolerance_m should be over 0"):
        st.inspect(body, contact_tolerance_m=0)


@pytest.mark.once
def test_bad_rows_are_skipped_where_that_is_asked_for(tmp_path: pathlib.Path) -> None:
    path, body = tmp_path / "bad.csv", st.Body.grid(1, 2, 0.01)
    path.write_text("t,0,1\n0,1,2\n0.1,x,4\n0.2,5,6\n")
    with pytest.raises(st.InputError, match="bad.csv"):
        st.read(path, body=body)
    kept = st.read(path, body=body, skip_bad=True)
    assert kept.t.tolist() == [0.0, 0.2] and len(kept.losses) == 1
    with st.open(path, body=body, skip_bad=True) as parts:
        assert [len(part) for part in parts] == [2] and len(parts.losses) == 1
    assert st.run(path, tmp_path / "skipped.csv", body=body, skip_bad=True)["frames"] == 2
    st.convert(kept, tmp_path / "kept.mcap")
    with pytest.raises(st.UsageError, match="skip_bad is for"):
        st.read(tmp_path / "kept.mcap", skip_bad=True)


@pytest.mark.once
def test_percepts_in_lines_of_json_are_the_commands(somatic, touch: st.Recording, tmp_path: pathlib.Path) -> None:
    with pytest.warns(UserWarning, match="no place for what is attached"):
        st.convert(touch, tmp_path / "touch.csv")
    somatic(
        "run", "--quiet", "--source", tmp_path / "touch.csv", "--outputs", "total,touches", "--backend", "cpu", "--from", 2, "--to", 3, "--sink",
        f"ndjson:{tmp_path / 'theirs.ndjson'}",
    )
    scene = {"outputs": ["total", "touches"], "backend": "cpu"}
    part = st.read(tmp_path / "touch.csv", body="hand", from_s=2, to_s=3)
    st.write(part.engine(scene).process(part.t, part.values), f"ndjson:{tmp_path / 'mine.ndjson'}")
    st.run(tmp_path / "touch.csv", f"ndjson:{tmp_path / 'run.ndjson'}", body=touch.body, scene=scene, from_s=2, to_s=3)
    theirs = (tmp_path / "theirs.ndjson").read_bytes()
    assert theirs.count(b"\n") > 10 and (tmp_path / "mine.ndjson").read_bytes() == theirs == (tmp_path / "run.ndjson").read_bytes()


@pytest.mark.once
def test_plots_are_drawn(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    st.plot([touch, "hand"], tmp_path / "two.png", fields="hand/palm*")
    assert (tmp_path / "two.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.warns(UserWarning, match="no place for what is attached"):
        st.convert(touch, tmp_path / "touch.csv")
    st.plot(tmp_path / "touch.csv", tmp_path / "part.svg", body="hand", from_s=2, to_s=3)
    assert (tmp_path / "part.svg").read_text()[:4] == "<svg"
    for wrong in (tmp_path / "two.png", tmp_path / "two.pdf"):
        with pytest.raises(st.SomaticError):
            st.plot(touch, wrong)
    with pytest.raises(st.UsageError, match="did you mean `total`"):
        st.plot(touch, tmp_path / "a.svg", outputs=["totl"])


@pytest.mark.once
def test_a_view_plays_a_recording_and_returns_at_once(touch: st.Recording) -> None:
    with st.view(touch, {"outputs": ["total"]}, speed=100, listen="127.0.0.1:0", open=False) as shown:
        assert shown.url.startswith("http://127.0.0.1:") and shown.viewers == 0
        assert shown.wait(20)
    assert repr(shown) == "<Shown, closed>"
    with st.view("hand", speed=1e-3, listen="127.0.0.1:0", open=False) as shown:
        assert not shown.wait(0.1)
    assert shown.wait(5), "it ends with its page"
    with pytest.raises(st.UsageError, match="positive"):
        st.view("hand", speed=0)


@pytest.mark.once
def test_a_bag_of_percepts_is_refused(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    p = touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values)
    with pytest.raises(st.UsageError, match="has frames too, and percepts alone are written") as raised:
        st.write(p, f"ros2-mcap:{tmp_path / 'bag'}")
    assert "\n" not in str(raised.value) and not (tmp_path / "bag").exists()


@pytest.mark.once
def test_bags_are_read(somatic, touch: st.Recording, tmp_path: pathlib.Path) -> None:
    somatic("run", "--quiet", "--sink", f"ros2-mcap:{tmp_path / 'bag'}", "--outputs", "total")
    known = st.info(f"ros2-mcap:{tmp_path / 'bag'}")
    assert known["topics"] and known["kind"] == "bag of ROS 2"
    again = st.read(f"ros2-mcap:{tmp_path / 'bag'}", body="hand")
    assert len(again) == 280
    order = [again.taxels.index(id) for id in touch.taxels]
    np.testing.assert_array_equal(again.values[:, order], touch.values)
    with pytest.raises(st.SomaticError, match="body="):
        st.read(f"ros2-mcap:{tmp_path / 'bag'}")


MODEL = """<mujoco model="pad">
  <asset><mesh name="plate" builtin="plate" params="5 7" scale="0.02 0.03 0.01"/></asset>
  <worldbody><body name="palm">
    <geom type="box" size="0.02 0.03 0.01" mass="0.1"/>
    <geom name="palm skin" type="mesh" mesh="plate" mass="0" contype="0" conaffinity="0"/>
  </body></worldbody>
  <sensor><tactile name="palm" geom="palm skin" mesh="plate"/></sensor>
</mujoco>
"""


@pytest.mark.once
def test_skins_that_come_with_their_places(tmp_path: pathlib.Path) -> None:
    robot = ROOT / "examples" / "robots" / "arm.urdf"
    bare = st.author(robot)
    assert len(bare.taxels) == 0 and bare.name == "arm.glb" and len(bare.links) > 2
    body = st.author(robot, taxels=60, up="z", clear="2 mm")
    assert len(body.taxels) > 0 and set(body.joints) == set(bare.joints)
    with pytest.warns(UserWarning):
        st.convert(body, tmp_path / "skin.urdf")
    skin = st.author(urdf_skin=tmp_path / "skin.urdf", geometry="none")
    assert skin.taxels["id"].tolist() == body.taxels["id"].tolist()
    mirrored = st.author("mat", taxels=30, seed=1, mirror="y").taxels["place"]
    assert np.allclose(np.sort(mirrored[:, 1]), np.sort(-mirrored[:, 1]), atol=1e-3)
    (tmp_path / "pad.xml").write_text(MODEL)
    model = st.author(mjcf_skin=tmp_path / "pad.xml")
    assert len(model.taxels) > 0 and model.links == ["palm"] and model.name == "pad.glb"
    # A layout that is there is brought up to date.
    body.save(tmp_path / "edited.glb")
    assert st.author(tmp_path / "edited.glb").taxels["id"].tolist() == body.taxels["id"].tolist()
    for keys, what in [
        ({"shape": "hand", "urdf_skin": "a.urdf"}, "give one shape"),
        ({}, "give one shape"),
        ({"csv_skin": "a.csv", "taxels": 3}, "taxels: this skin has its places"),
        ({"shape": "hand", "taxels": 3, "up": "z"}, "up: it is for"),
        ({"shape": "hand", "taxels": 3, "mirror": "x"}, "mirror: there is no 'x'"),
        ({"shape": "hand", "mirror": "y"}, "mirror: it is for taxels"),
        ({"shape": robot, "geometry": "thick"}, "geometry: there is no 'thick'"),
    ]:
        with pytest.raises(st.UsageError, match=what):
            st.author(**keys)  # type: ignore[arg-type]
