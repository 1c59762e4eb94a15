"""Percepts as tables, recordings, sinks, simulations and bodies."""

from __future__ import annotations

import json
import pathlib

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from conftest import DATA, ROOT

import somatic_touch as st

OUTPUTS = ["total", "active", "centroid", "position", "principal_axis", "touches"]


@pytest.fixture(scope="module", params=["cpu", "reference"])
def p(request) -> st.Percepts:
    touch = st.read("hand")
    return touch.engine({"outputs": OUTPUTS}, backend=request.param).process(touch.t, touch.values)


def test_tables_have_the_rows_of_the_columns(p: st.Percepts) -> None:
    table = pa.table(p)
    assert table.num_rows == p.contact.sum()
    assert table.schema.field("centroid_u").metadata[b"unit"] == b"m"
    assert table.schema.metadata[b"somatic.backend"].split(b";")[0] in (b"cpu", b"reference")
    frames, fields = np.nonzero(p.contact)
    for column, got in [("total", p["total"]), ("active", p["active"]), ("principal_axis", p["principal_axis"])]:
        values = table[column].to_pandas().to_numpy(p[column].dtype)
        assert np.array_equal(values, got[frames, fields], equal_nan=True), column
    for number, component in enumerate("uv"):
        assert np.array_equal(table[f"centroid_{component}"], p["centroid"][frames, fields, number], equal_nan=True)
    assert table["principal_axis"].null_count == (~p.present("principal_axis")[p.contact]).sum()
    assert table["field"].to_pylist() == [p.fields[field] for field in fields]
    everything = p.to_arrow(all_fields=True)
    assert everything.num_rows == p.flags.size
    assert everything["flags"].to_pylist()[0] == [str(flag.name).lower() for flag in st.Flags(p.flags[0, 0])]


def test_pandas_and_polars_have_the_same(p: st.Percepts) -> None:
    table = p.to_arrow()
    frame, other = p.to_pandas(), p.to_polars()
    assert isinstance(frame, pd.DataFrame) and isinstance(other, pl.DataFrame)
    assert list(frame.columns) == other.columns == table.column_names
    assert np.array_equal(frame["total"], table["total"]) and np.array_equal(other["total"], table["total"])
    assert frame["field"].astype(str).tolist() == other["field"].cast(pl.String).to_list()
    assert pl.DataFrame(p.touches)["touch"].to_list() == p.touches.id.tolist()


def test_touches_are_a_table(p: st.Percepts) -> None:
    touches = p.touches
    table = pa.table(touches)
    assert table.num_rows == len(touches) > 100
    for name in ("t", "total", "active", "age"):
        assert np.array_equal(table[name], getattr(touches, name))
    assert np.array_equal(table["touch"], touches.id) and table["link"].to_pylist() == touches.link
    assert np.array_equal(touches.t, p.t[touches.frame])
    with pytest.raises(st.UsageError, match="add `touches.orientation`"):
        touches["orientation"]
    with pytest.raises(st.UsageError, match="there are: total"):
        touches["weight"]
    with pytest.raises(st.UsageError, match="not asked for"):
        st.Engine(st.Body.bundled("hand"), {"outputs": "total"}, backend="cpu").step(0, [0] * 40).touches  # noqa: B018


def test_files_are_the_command_s(p: st.Percepts, somatic, tmp_path: pathlib.Path) -> None:
    backend = p.to_arrow().schema.metadata[b"somatic.backend"].decode().split(";")[0]
    flags = ["run", "--quiet", "--outputs", ",".join(OUTPUTS), "--backend", backend]
    for ending in ("ndjson", "csv"):
        mine, theirs = tmp_path / f"mine.{ending}", tmp_path / f"theirs.{ending}"
        st.write(p, mine)
        somatic(*flags, "--sink", theirs)
        assert mine.read_bytes() == theirs.read_bytes()
    assert (tmp_path / "mine.touches.csv").read_bytes() == (tmp_path / "theirs.touches.csv").read_bytes()
    with pytest.raises(st.SomaticError, match="it exists"):
        st.write(p, tmp_path / "mine.csv")
    st.write(p, f"csv:{tmp_path / 'mine.csv'}", force=True, wide=True)
    st.write(p, tmp_path / "a.parquet", all_fields=True)
    read = pq.read_table(tmp_path / "a.parquet")
    assert read.num_rows == p.flags.size and read.to_pylist() == p.to_arrow(all_fields=True).to_pylist()
    assert b"somatic.body.sha256" in read.schema.metadata


def test_a_file_is_written_as_it_is_computed(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    engine = touch.engine({"outputs": ["total"]}, backend="cpu")
    parts = (engine.process(touch.t[i : i + 64], touch.values[i : i + 64]) for i in range(0, len(touch), 64))
    st.write(parts, tmp_path / "parts.ndjson")
    whole = touch.engine({"outputs": ["total"]}, backend="cpu")
    st.write(whole.process(touch.t, touch.values), tmp_path / "whole.ndjson")
    assert (tmp_path / "parts.ndjson").read_bytes() == (tmp_path / "whole.ndjson").read_bytes()

    def fails():
        yield touch.engine(backend="cpu").process(touch.t[:9], touch.values[:9])
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        st.write(fails(), tmp_path / "half.csv")
    assert not (tmp_path / "half.csv").exists()
    with pytest.raises(st.UsageError, match="no percepts"):
        st.write([], tmp_path / "none.csv")
    with pytest.raises(st.UsageError, match="should be a Percepts"):
        st.write([1], tmp_path / "none.csv")  # type: ignore[list-item]


def test_sinks_that_need_frames_are_refused(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    p = touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values)
    for sink in [f"ros2-mcap:{tmp_path / 'bag'}", "zenoh:skin", "ros2:/skin"]:
        with pytest.raises(st.UsageError, match="has frames too, and percepts alone are written here"):
            st.write(p, sink)
    assert not (tmp_path / "bag").exists()


@pytest.mark.once
def test_recordings(somatic, touch: st.Recording, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "touch.mcap"
    somatic("run", "--quiet", "--body", "hand", "--source", ROOT / "bodies" / "touch.csv", "--sink", f"mcap:{path}")
    read = st.read(path)
    assert read.body is not None and len(read.body.taxels) == 40
    assert np.array_equal(read.t, touch.t) and np.array_equal(read.mask, touch.mask)
    assert np.array_equal(read.values.view(np.uint32), touch.values.view(np.uint32))
    part = st.read(path, from_s=1, to_s=2)
    assert (part.t >= 1).all() and (part.t <= 2).all() and 45 < len(part) < 55
    with pytest.raises(st.SomaticError, match="no body"):
        st.read(ROOT / "bodies" / "touch.csv").engine()
    with pytest.raises(st.UsageError, match="simulate"):
        st.read("sim:a.toml")
    with pytest.raises(st.UsageError, match="somatic_touch.live gives"):
        st.read("serial:/dev/ttyUSB0")
    bad = tmp_path / "bad.csv"
    bad.write_text("t,0,1\n0,1,2\n1,oops,3\n")
    with pytest.raises(st.InputError) as caught:
        st.read(bad)
    assert caught.value.file == str(bad) and caught.value.place and "oops" in str(caught.value)


@pytest.mark.once
def test_exports(tmp_path: pathlib.Path) -> None:
    insoles = st.read(ROOT / "examples" / "exports" / "insoles.csv")
    assert insoles.body is not None and insoles.calibration is not None and insoles.calibration.quantity in ("Pa", "N")
    p = insoles.engine({"outputs": ["force", "centroid"]}, backend="cpu").process(insoles.t, insoles.values)
    assert np.nanmax(p["force"]) > 50
    given = st.Calibration("[all]\nbaseline = 1\n", insoles.body)
    with pytest.warns(UserWarning, match=r"of its own calibration, this stays under yours: unit = "):
        engine = insoles.engine({"outputs": ["force"]}, given, "cpu")
    assert np.nanmax(engine.process(insoles.t, insoles.values)["force"]) > 50
    with pytest.warns(UserWarning, match="this stays under yours"):
        source = ROOT / "examples" / "exports" / "insoles.csv"
        st.run(source, tmp_path / "percepts.ndjson", scene={"outputs": ["force"]}, calibration=given)
    plain = tmp_path / "plain.txt"
    plain.write_text("\n".join(" ".join(map(str, row)) for row in np.arange(24).reshape(8, 3)))
    mat = st.read(plain, grid="4x3", pitch="10mm", rate_hz=50, format="matrix", unit="kPa")
    assert mat.values.shape == (2, 12) and mat.t.tolist() == [0, 0.02]


@pytest.mark.once
def test_simulations(somatic, tmp_path: pathlib.Path) -> None:
    rod = ROOT / "examples" / "simulations" / "rod.toml"
    somatic("simulate", rod, "-o", tmp_path / "rod.csv")
    simulated = st.simulate(rod)
    recorded = st.read(tmp_path / "rod.csv", body="hand")
    assert np.array_equal(simulated.recording.values, recorded.values)
    truth = pd.read_csv(tmp_path / "rod.truth.csv")
    assert len(truth) == len(simulated.truth)
    assert simulated.recording.calibration is not None
    assert simulated.recording.calibration.text == (tmp_path / "rod.calibration.toml").read_text()
    p = simulated.recording.engine({"outputs": ["centroid"]}, backend="cpu").process(recorded.t, recorded.values)
    rows = simulated.truth
    centroid = p["centroid"][rows["frame"], p.index("hand/back")]
    middle = (rows["force"] > 20) & np.isfinite(centroid[:, 0])
    assert np.abs(centroid[middle, 1] - rows["uv"][middle, 1]).mean() < 0.004
    again = st.simulate(rod, seed=9)
    assert not np.array_equal(again.recording.values, simulated.recording.values)
    with pytest.raises(st.InputError, match="no such file"):
        st.simulate("no.toml")


@pytest.mark.once
def test_bodies(somatic, tmp_path: pathlib.Path) -> None:
    arm = ROOT / "examples" / "robots" / "arm.urdf"
    skin = st.author(arm, taxels=40, seed=3)
    somatic("author", arm, "--taxels", 40, "--seed", 3, "-o", tmp_path / "skin.glb")
    skin.save(tmp_path / "mine.glb")
    assert (tmp_path / "mine.glb").read_bytes() == (tmp_path / "skin.glb").read_bytes()
    body = st.Body.load(tmp_path / "mine.glb")
    assert np.array_equal(body.taxels, skin.taxels) and list(body.fields) == list(skin.fields) and body.links == skin.links
    told = json.loads(somatic("inspect", tmp_path / "skin.glb", "--json"))
    assert len(told["links"]) > 3 and len(told["fields"]) > 3
    taxels = body.taxels
    assert taxels["id"].tolist() == [taxel["id"] for taxel in told["taxels"]]
    assert np.array_equal(taxels["position"], [taxel["position"] for taxel in told["taxels"]])
    assert [body.links[link] for link in taxels["link"]] == [taxel["link"] for taxel in told["taxels"]]
    fields = body.fields
    for field in told["fields"]:
        mine = fields[field["name"]]
        assert mine.parent == field["parent"] and mine.taxels.tolist() == [m["taxel"] for m in field["members"]]
        assert (mine.uv is None) == (field["chart"] is None)
        if mine.uv is not None:
            assert np.array_equal(mine.uv, [member["uv"] for member in field["members"]])
    shares: list[float] = []
    even = st.author("hand", taxels=20, progress=shares.append)
    assert shares and 0 <= min(shares) <= max(shares) <= 1
    assert len(st.author(arm, spacing="60 mm").taxels) < len(st.author(arm, spacing="40 mm").taxels)
    scattered = st.author("hand", taxels=20, even=False, hidden="keep", clear="1 mm")
    flags = ("--even", "off", "--hidden", "keep", "--clear", "1mm")
    somatic("author", "hand", "--taxels", 20, *flags, "-o", tmp_path / "scattered.glb")
    scattered.save(tmp_path / "mine.glb", force=True)
    assert (tmp_path / "mine.glb").read_bytes() == (tmp_path / "scattered.glb").read_bytes()
    assert not np.array_equal(scattered.taxels, even.taxels)
    with pytest.raises(st.UsageError, match="'drop' or 'keep'"):
        st.author("hand", taxels=60, hidden="yes")  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="clear"):
        st.author("hand", taxels=60, clear="wide")
    with pytest.raises(st.UsageError, match="leave taxels"):
        st.author("hand", "a.toml", taxels=3)
    with pytest.raises(st.UsageError, match="did you mean `hand`"):
        st.Body.bundled("hnad")  # type: ignore[arg-type]


@pytest.mark.once
def test_a_robot_of_others_is_dressed() -> None:
    meshes = DATA / "meshes"
    found = sorted(meshes.glob("**/*.stl")) if meshes.is_dir() else []
    if not found:
        pytest.skip(f"no meshes in {DATA}")
    body = st.author(found[0], taxels=20, unit="mm")
    assert len(body.taxels) == 20
