"""Taxels with three axes, temperatures and distances: frames in, percepts by their letters, tables, pictures and files."""

from __future__ import annotations

import copy
import json
import pathlib
import pickle
import subprocess
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import somatic_touch as st

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PITCH = 0.005
SIDE = 5
COUNT = SIDE * SIDE
# Along the sheet, from its middle.
UV = PITCH * (np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1).reshape(-1, 2) - (SIDE - 1) / 2)
UP = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
PLACES = np.concatenate([UV, np.zeros((COUNT, 1))], axis=1)
WARM, NEAR = 100, 200
CALIBRATION = (
    '[all]\nunit = "N"\nnoise = 0.01\n[shear]\nslips_at = 0.5\n[proximity]\nunit = "mm"\nrange = 80\nwindow_s = 0.2\n[temperature]\nwindow_s = 0.5\n'
)


def pad(tangent: Any = (0.0, 1.0, 0.0)) -> st.Body:
    """A sheet of taxels with three axes; t is along its y and n × t along −x."""
    return st.Body.from_arrays(
        PLACES, UP, ids=np.arange(COUNT), areas=PITCH**2, modality="force3", tangents=np.tile(tangent, (COUNT, 1)), name="pad"
    )


def skin() -> st.Body:
    """The same with a temperature and a distance at each place."""
    kinds: list[Any] = [kind for kind in ("force3", "temperature", "proximity") for _ in range(COUNT)]
    tangents = np.full((3 * COUNT, 3), np.nan)
    tangents[:COUNT] = [0, 1, 0]
    ids = np.concatenate([np.arange(COUNT), WARM + np.arange(COUNT), NEAR + np.arange(COUNT)])
    return st.Body.from_arrays(
        np.tile(PLACES, (3, 1)), np.tile(UP, (3, 1)), ids=ids, areas=PITCH**2, modality=kinds, tangents=tangents, name="skin"
    )


def forces(frames: int, seed: int = 1) -> np.ndarray:
    """Forces along the normal, t and n × t, [frames, taxels, 3], in newtons."""
    random = np.random.default_rng(seed)
    centre = random.uniform(-0.005, 0.005, (frames, 1, 2))
    press = np.maximum(0.2 * (1 - ((UV - centre) ** 2).sum(axis=2) / (2.5 * PITCH) ** 2), 0)
    drag = random.uniform(-0.4, 0.4, (frames, 1, 2)) * press[..., None]
    return np.concatenate([press[..., None], drag], axis=2).astype(np.float32)


def in_channels(values: np.ndarray) -> np.ndarray:
    """Values [..., taxels, 3] in the order of `Body.channels`."""
    return np.ascontiguousarray(np.swapaxes(values, -1, -2)).reshape(*values.shape[:-2], 3 * values.shape[-2])


def calibrated(body: st.Body, **keys: Any) -> st.Engine:
    return st.Engine(body, st.Scene(**keys), st.Calibration(CALIBRATION, body), "cpu")


def same(a: st.Percepts, b: st.Percepts) -> bool:
    return all(np.array_equal(a[name], b[name], equal_nan=True) for name in a.keys()) and np.array_equal(a.flags, b.flags)


def test_taxels_say_what_they_measure() -> None:
    body = skin()
    taxels = body.taxels
    assert taxels["modality"].tolist() == ["force3"] * COUNT + ["temperature"] * COUNT + ["proximity"] * COUNT
    assert np.allclose(taxels["tangent"][:COUNT], [0, 1, 0]) and np.isnan(taxels["tangent"][COUNT:]).all()
    assert body.channels[:2] == ["0", "1"] and body.channels[3 * COUNT] == "0.u" and len(body.channels) == 5 * COUNT
    again = pickle.loads(pickle.dumps(body))
    assert again == body and np.allclose(again.taxels["tangent"], taxels["tangent"], equal_nan=True)
    # As far as it is at right angles to the normal, and the link's x without one.
    assert np.allclose(pad((0.0, 3.0, 4.0)).taxels["tangent"], [0, 1, 0], atol=1e-7)
    assert np.allclose(pad((np.nan,) * 3).taxels["tangent"], [1, 0, 0])
    assert body.fields["skin"].taxels.size == 3 * COUNT
    assert set(st.Body.bundled("hand").taxels["modality"]) == {"pressure"}


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"modality": "force"}, "modality: there is no `force`; did you mean `force3`"),
        ({"modality": ["force3"] * 2}, "modality should be one a taxel, 25; there are 2"),
        ({"modality": "force3", "tangents": np.tile([0, 0, 1], (COUNT, 1))}, "tangent of row 0 has no direction across"),
        ({"modality": "force3", "tangents": np.zeros((COUNT, 3))}, "tangent of row 0 has no direction across"),
        ({"modality": "force3", "tangents": np.zeros((3, 3))}, "tangents should be one a taxel, 25; there are 3"),
        ({"tangents": np.tile([1, 0, 0], (COUNT, 1))}, "row 0 has a tangent and is of pressure; give NaN there"),
    ],
)
def test_bodies_that_cannot_be_are_refused(keys: dict[str, Any], why: str) -> None:
    with pytest.raises(st.UsageError, match=why):
        st.Body.from_arrays(PLACES, UP, **keys)


def test_values_of_three_axes_are_those_of_their_channels() -> None:
    body, values = pad(), forces(40)
    t = 0.01 * np.arange(40)
    wanted = calibrated(body).process(t, in_channels(values))
    assert wanted.select("pad").letters == ["sustained", "shear"] and len(set(wanted.fields)) == len(wanted.letters)
    for given in (values, values.astype(np.float64), np.asfortranarray(values), values[::1].tolist()):
        assert same(calibrated(body).process(t, given), wanted)
    engine = calibrated(body)
    assert engine.channels == body.channels and engine.letters == wanted.letters
    steps = [engine.step(time, frame) for time, frame in zip(t, values, strict=True)]
    assert all(np.array_equal(p["shear"][0], wanted["shear"][index], equal_nan=True) for index, p in enumerate(steps))
    by_id = [{int(id): frame[id].tolist() for id in range(COUNT)} for frame in values]
    by_name = [{f"{id}{axis}": float(frame[id, at]) for id in range(COUNT) for at, axis in enumerate(("", ".u", ".v"))} for frame in values]
    arrays = [{id: frame[id] for id in range(COUNT)} for frame in values]
    for given in (by_id, by_name, arrays):
        assert same(calibrated(body).process(t, given), wanted)
    # In another order, named.
    order = np.random.default_rng(2).permutation(3 * COUNT)
    engine = st.Engine(body, None, st.Calibration(CALIBRATION, body), "cpu", taxels=[body.channels[at] for at in order])
    assert engine.channels == [body.channels[at] for at in order]
    assert same(engine.process(t, in_channels(values)[:, order]), wanted)
    again = copy.copy(engine)
    assert again.channels == engine.channels and same(again.process(t + 1, values), engine.process(t + 1, values))
    assert pickle.loads(pickle.dumps(calibrated(body))).channels == body.channels


def test_columns_of_a_table_are_by_their_names() -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    body, values = pad(), in_channels(forces(6))
    t = 0.01 * np.arange(6)
    wanted = calibrated(body).process(t, values)
    # As files have them: the three of a taxel side by side.
    names = [f"{id}{axis}" for id in range(COUNT) for axis in ("", ".u", ".v")]
    order = [body.channels.index(name) for name in names]
    table = pandas.DataFrame(values[:, order], columns=names)
    for given in (table, polars.DataFrame({name: values[:, at] for name, at in zip(names, order, strict=True)}), pandas.DataFrame(values)):
        assert same(calibrated(body).process(t, given), wanted)
    assert same(calibrated(body).step(0.0, table.iloc[0]), calibrated(body).step(0.0, values[0]))
    missing = np.zeros_like(values, dtype=bool)
    missing[:, 4] = True
    assert same(calibrated(body).process(t, table, missing[:, order]), calibrated(body).process(t, values, missing))
    other = table.rename(columns={"3.v": "99.v"})
    with pytest.raises(KeyError, match="values have a column of channel `99.v`; the engine's are 0, 1"):
        calibrated(body).process(t, other)
    with pytest.raises(KeyError, match="channel `3.u` is there twice"):
        calibrated(body).process(t, table.rename(columns={"3.v": "3.u"}))
    # Names of something else say nothing.
    assert same(calibrated(body).process(t, pandas.DataFrame(values, columns=[f"pad {name}" for name in range(75)])), wanted)


def test_a_mask_is_of_values_or_of_taxels() -> None:
    body, values = pad(), forces(6)
    t = 0.01 * np.arange(6)
    of_values = np.random.default_rng(3).random((6, COUNT, 3)) < 0.2
    of_taxels = of_values.any(axis=2)

    def dicts(missing: np.ndarray) -> list[dict[int, list[float | None]]]:
        def of(frame: int, id: int) -> list[float | None]:
            return [None if missing[frame, id, axis] else float(values[frame, id, axis]) for axis in range(3)]

        return [{id: of(frame, id) for id in range(COUNT)} for frame in range(6)]

    wanted = calibrated(body).process(t, dicts(of_values))
    assert same(calibrated(body).process(t, values, of_values), wanted)
    assert (wanted.flags & st.Flags.INCOMPLETE).any()
    whole = np.repeat(of_taxels[..., None], 3, axis=2)
    wanted = calibrated(body).process(t, dicts(whole))
    for mask in (whole, of_taxels):
        assert same(calibrated(body).process(t, values, mask), wanted)
    always = of_taxels[0]
    wanted = calibrated(body).process(t, dicts(np.broadcast_to(always[None, :, None], (6, COUNT, 3))))
    assert same(calibrated(body).process(t, values, always), wanted)
    first = calibrated(body)
    assert same(first.step(0.0, values[0], of_values[0]), calibrated(body).step(0.0, dicts(of_values)[0]))
    with pytest.raises(st.UsageError, match=r"mask should be bool of shape \[frames, taxels, 3\] = \[6, 25, 3\]"):
        calibrated(body).process(t, values, of_values[:, :, 0].T)
    # Flat values have a mask of their own shape alone.
    with pytest.raises(st.UsageError, match=r"mask should be bool of shape \[frames, taxels\] = \[6, 75\]"):
        calibrated(body).process(t, in_channels(values), of_taxels)


@pytest.mark.parametrize("shape", [(2, COUNT), (2, COUNT, 2), (2, 3, COUNT), (COUNT, 3), (2, 3 * COUNT + 1), (2, 1, COUNT, 3)])
def test_other_shapes_are_refused_with_both(shape: tuple[int, ...]) -> None:
    with pytest.raises(st.UsageError, match=r"shape \[frames, taxels, 3\] = \[2, 25, 3\] or \[frames, channels\] = \[2, 75\]; this has"):
        st.Engine(pad(), backend="cpu").process([0.0, 0.1], np.zeros(shape, np.float32))


def test_frames_of_mixed_bodies_are_by_channel() -> None:
    engine = st.Engine(skin(), backend="cpu")
    with pytest.raises(st.UsageError, match=r"shape \[frames, channels\] = \[1, 125\]; this has shape \[1, 75, 3\]"):
        engine.process([0.0], np.zeros((1, 75, 3), np.float32))
    for frame, why in [
        ({WARM: [1, 2, 3]}, "taxel 100 has one value, and three are given; its modality is not force3"),
        ({4: [1, 2]}, "taxel 4 should have a number, or None if it is missing, or three"),
        ({"4.u": [1, 2, 3]}, "taxel 4.u should have a number"),
        ({4: [1, 2, 3], "4.v": 3}, "taxel 4.v is there twice"),
        ({4: 1, "4": 2}, "taxel 4 is there twice"),
        ({"4.w": 1}, "frame 0 has a value of taxel '4.w'; "),
        ({"100.u": 1}, "frame 0 has a value of taxel '100.u'; the engine's are 0, 1"),
    ]:
        with pytest.raises(st.UsageError, match=why):
            engine.step(0.0, frame)  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="`4.w` is no channel"):
        st.Engine(skin(), backend="cpu", taxels=["4", "4.w"])
    with pytest.raises(st.SomaticError, match="100.u"):
        st.Engine(skin(), backend="cpu", taxels=["100.u"])


def touched(engine: st.Engine, frames: int = 20) -> st.Percepts:
    """Percepts of a drag, of a plane of temperatures that rise, and of something that comes near."""
    t = 0.05 * np.arange(frames)
    values = forces(frames)
    made: list[dict[int | str, Any]] = []
    for time, press in zip(t, values, strict=True):
        frame: dict[int | str, Any] = {id: press[id] for id in range(COUNT)}
        frame |= {WARM + id: 25 + 6 * time + 300 * UV[id, 0] - 100 * UV[id, 1] for id in range(COUNT)}
        frame |= {NEAR + id: 1e3 * (0.06 - 0.04 * time + np.linalg.norm(UV[id])) for id in range(COUNT)}
        made.append(frame)
    return engine.process(t, made)


def test_percepts_are_of_their_letters() -> None:
    everywhere = touched(calibrated(skin()))
    assert len(set(everywhere.fields)) == len(everywhere.fields) >= 4
    p = everywhere.select("skin")
    assert p.letters == ["sustained", "shear", "temperature", "proximity"]
    of = dict(zip(p.letters, range(4), strict=True))
    values = forces(20).astype(np.float64)
    # t is y and n × t is −x.
    in_plane = np.stack([-values[..., 2].sum(axis=1), values[..., 1].sum(axis=1)], axis=1)
    vectors = p["shear_vector"][:, of["shear"]]
    assert np.allclose(vectors[:, :2], in_plane, atol=1e-6) and np.allclose(vectors[:, 2], 0, atol=1e-9)
    assert np.allclose(p["force_vector"][:, of["shear"], 2], -values[..., 0].sum(axis=1), rtol=1e-5)
    friction = np.linalg.norm(in_plane, axis=1) / values[..., 0].sum(axis=1)
    assert np.allclose(p["friction"][:, of["shear"]], friction, rtol=1e-5)
    assert np.allclose(p["slip_ratio"][:, of["shear"]], 2 * friction, rtol=1e-5)
    warm = of["temperature"]
    assert np.allclose(p["temperature"][:, warm], 25 + 6 * p.t, atol=1e-4)
    assert p["temperature_rate"][-1, warm] == pytest.approx(6, rel=1e-3) and np.isnan(p["temperature_rate"][0, warm])
    assert set(p["warmest_taxel"][:, warm]) == {WARM + 4} and np.isnan(p["warmest_taxel"][:, 0]).all()
    near = of["proximity"]
    assert np.allclose(p["nearest"][:, near], 0.06 - 0.04 * p.t, atol=1e-6) and set(p["nearest_taxel"][:, near]) == {NEAR + 12}
    assert p["approach_speed"][-1, near] == pytest.approx(0.04, rel=1e-3)
    # What is of one letter is absent in the others, and says so.
    for name, letter in [("total", "sustained"), ("shear", "shear"), ("temperature", "temperature"), ("nearest", "proximity")]:
        assert p.present(name).tolist() == [[at == letter for at in p.letters]] * 20
        column = p[name].reshape(20, 4, -1)
        assert np.isnan(column[~p.present(name)]).all() and np.isfinite(column[p.present(name)]).all()
    assert p.unit("shear") == p.unit("total") == "N" and p.unit("torsion") == "N m"
    assert (p.unit("temperature"), p.unit("temperature_rate"), p.unit("nearest")) == ("°C", "K/s", "m")
    # Of proximity: that something is in range; of temperature: that there is a reading.
    assert p.contact.tolist() == [[True, True, True, near <= 0.08] for near in 0.06 - 0.04 * p.t]
    far = calibrated(skin()).step(0.0, {**{NEAR + id: 200 for id in range(COUNT)}, WARM: 20.0, 3: [1, 0, 0]}).select("skin")
    assert far.contact.tolist() == [[True, True, True, False]] and np.isnan(far["nearest"]).all() and far["covered"][0, 3] in (0, np.nan)
    assert st.Flags.OUT_OF_RANGE in st.Flags(far.flags[0, 3])


def test_letters_are_chosen() -> None:
    body = skin()
    p = touched(calibrated(body)).select("skin")
    shear = p.select(letters="shear")
    assert shear.letters == ["shear"] and np.array_equal(shear["shear"][:, 0], p["shear"][:, 1])
    both = p.select("skin", letters=["temperature", "shear"])
    assert both.letters == ["shear", "temperature"] and both.fields == p.fields[1:3]
    assert shear.select(letters="shear").fields == shear.fields and p.select("skin").letters == p.letters
    with pytest.raises(KeyError, match="no field is of letter `sheer`; did you mean `shear`"):
        p.select(letters="sheer")  # type: ignore[arg-type]
    with pytest.raises(KeyError, match="no field is of letter `shear`"):
        p.select(letters="temperature").select(letters="shear")
    alone = touched(calibrated(body, letters=["temperature", "proximity"])).select("skin")
    assert alone.letters == ["temperature", "proximity"]
    assert np.array_equal(alone["temperature"][:, 0], p["temperature"][:, 2])
    assert set(touched(calibrated(body, outputs=["total"])).letters) == {"sustained"}
    assert set(touched(calibrated(body, outputs=["total", "warmest"])).letters) == {"sustained", "temperature"}
    with pytest.raises(st.UsageError, match="letter `shear` has no taxels"):
        st.Engine(st.Body.bundled("hand"), st.Scene(letters=["shear"]), backend="cpu")
    with pytest.raises(st.UsageError, match="did you mean `shear`"):
        st.Scene(letters=["sheer"])
    for text in ('[temperature]\nunit = "C°F"', "[proximity]\nrange = -1", "[shear]\nslips_at = 'x'"):
        with pytest.raises(st.SomaticError):
            st.Calibration(text, body)


@pytest.mark.once
def test_tables_and_lines_are_the_commands(somatic: Any, tmp_path: pathlib.Path) -> None:
    body = skin()
    body.save(tmp_path / "skin.glb")
    (tmp_path / "skin.toml").write_text(CALIBRATION)
    random = np.random.default_rng(5)
    values = np.concatenate([in_channels(forces(30))[:, :COUNT], random.uniform(20, 90, (30, 2 * COUNT)), in_channels(forces(30))[:, COUNT:]], axis=1)
    t = 0.02 * np.arange(30)
    with (tmp_path / "frames.csv").open("w") as file:
        print("t", *body.channels, sep=",", file=file)
        for time, row in zip(t, values, strict=True):
            print(time, *(repr(float(np.float32(value))) for value in row), sep=",", file=file)
    read = st.read(tmp_path / "frames.csv", body=body)
    assert read.channels == body.channels and np.array_equal(read.values, values.astype(np.float32))
    assert repr(read).endswith("30 frames of 75 taxels in 0.58 s>") and read.taxels == [int(name.split(".")[0]) for name in body.channels]
    again = pickle.loads(pickle.dumps(read))
    assert again == read and again.channels == read.channels
    somatic(
        *("run", "--quiet", "--body", tmp_path / "skin.glb", "--source", tmp_path / "frames.csv", "--calibration", tmp_path / "skin.toml"),
        *("--backend", "cpu", "--sink", f"ndjson:{tmp_path / 'theirs.ndjson'}"),
    )
    calibration = st.Calibration(CALIBRATION, body)
    p = read.engine(None, calibration, "cpu").process(read.t, read.values)
    st.write(p, tmp_path / "mine.ndjson")
    assert (tmp_path / "mine.ndjson").read_bytes() == (tmp_path / "theirs.ndjson").read_bytes()
    table = p.to_pandas(all_fields=True)
    assert table["letter"].tolist() == p.letters * 30
    rows = table[(table["letter"] == "temperature") & (table["field"] == "skin")]
    assert np.array_equal(rows["temperature"], p.select("skin", letters="temperature")["temperature"][:, 0], equal_nan=True)
    assert (table["shear_u"].notna() == (table["letter"] == "shear")).all()
    # And through a recording.
    st.convert(read, tmp_path / "frames.mcap", calibration=calibration)
    back = st.read(tmp_path / "frames.mcap")
    order = [back.channels.index(name) for name in read.channels]
    assert np.array_equal(back.values[:, order], read.values) and back.calibration == calibration
    assert same(back.engine(backend="cpu").process(back.t, back.values), p)
    found = read.engine(None, calibration, "cpu").verify(read.t, read.values)
    assert found["agrees"], found["failures"]


def test_touches_have_their_shear() -> None:
    values = forces(1)
    p = calibrated(pad()).process([0.0], values)
    assert len(p.touches) == 1
    shear = p.touches["shear"]
    assert shear.shape[0] == 1 and np.isfinite(shear).all()
    length = np.linalg.norm(values[0, :, 1:].astype(float).sum(axis=0))
    assert np.linalg.norm(shear[0]) == pytest.approx(length, rel=1e-5)
    assert p.touches.unit("shear") == "N" and p.touches["friction"][0] == pytest.approx(length / values[0, :, 0].sum(), rel=1e-4)
    assert np.linalg.norm(p.touches["shear_in_chart"][0]) == pytest.approx(length, rel=1e-5)
    assert p.touches["slip_ratio"][0] == 2 * p.touches["friction"][0]
    assert np.array_equal(p.touches.to_pandas()[["shear_x", "shear_y", "shear_z"]], shear)


def test_notebooks_show_what_each_letter_tells() -> None:
    read = st.read("sensing-hand")
    p = read.engine(backend="cpu").process(read.t, read.values)
    shown = p._repr_html_()
    for head in ("largest force [N]", "largest shear [N]", "warmest [°C]", "nearest [m]"):
        assert f"<th>{head}</th>" in shown, shown
    shear = np.linalg.norm(p.select("hand", letters="shear")["shear_vector"][:, 0], axis=1)
    row = next(row for row in shown.split("<tr>") if "hand · shear" in row)
    assert f"<td>{np.nanmax(shear):.4g}</td>" in row and row.count("<td></td>") == 3
    alone = p.select(letters="proximity")._repr_html_()
    assert "nearest [m]" in alone and "force" not in alone


def test_a_bundled_body_is_simulated_with_its_senses() -> None:
    touch = 'on = "hand/midhand/index"\nindenter = "ball"\nradius_m = 0.01\npath = [[0, 0]]\ntimes_s = [0]\nforce_newton = [[0, 2], [1, 2]]\nfriction = 0.5'
    made = st.simulate(f'body = "sensing-hand"\nrate_hz = 20\nduration_s = 1\n[layer]\nthickness_m = 0.005\n[sensor]\nkind = "ideal"\n[[touch]]\n{touch}\n')
    assert len(made.recording.channels) == 111 and made.recording.body.name == "sensing-hand"
    p = made.recording.engine(backend="cpu").process(made.recording.t, made.recording.values)
    assert set(p.letters) >= {"sustained", "shear"} and np.isfinite(p.select(letters="shear")["friction"]).any()


def test_letters_are_measured_beside_pressures() -> None:
    body = skin()
    told = st.bench(body, backend="cpu", seconds=0.05)
    assert "letters" not in told
    # Each taxel is of a letter, and one with three axes of two.
    kind = dict(zip(body.taxels["id"].tolist(), body.taxels["modality"].tolist(), strict=True))
    members = [kind[id] for field in body.fields.values() for id in field.taxels.tolist()]
    assert told["rate"] * told["us_median"] / 1e6 == pytest.approx(len(members) + members.count("force3"))
    for letters, of in [("shear", 1), (["sustained", "shear"], 2), (["sustained", "change", "shear"], 3)]:
        told = st.bench(body, {"max_gap_s": 2}, st.Calibration(CALIBRATION, body), "cpu", letters=letters, frames=4, seconds=0.05)  # type: ignore[arg-type]
        assert told["letters"] == ([letters] if isinstance(letters, str) else letters)
        assert told["rate"] * told["us_median"] / 4e6 == pytest.approx(of * members.count("force3")) and told["us_median_pressure"] > 0
    told = st.bench(pad(), st.Scene(letters=["sustained"]), backend="cpu", letters="sustained", seconds=0.2)
    assert 0.2 < told["us_median"] / told["us_median_pressure"] < 5
    for body, letters, why in [
        ("hand", "shear", "letter `shear` has no taxels"),
        (pad(), "sheer", "did you mean `shear`"),
        (pad(), [], "letters should have one letter or more"),
    ]:
        with pytest.raises(st.UsageError, match=why):
            st.bench(body, letters=letters)  # type: ignore[arg-type]


def test_messages_with_three_axes_are_read_for_a_body(tmp_path: pathlib.Path) -> None:
    body, values = pad(), forces(5)
    lines = [json.dumps({"t": 0.1 * at, "force": frame.astype(float).ravel().tolist()}) for at, frame in enumerate(values)]
    (tmp_path / "frames.ndjson").write_text("\n".join(lines) + "\n")
    (tmp_path / "map.toml").write_text('values = "force"\naxes = "nuv"\n')
    keys: dict[str, Any] = {"map": str(tmp_path / "map.toml"), "body": body}
    wanted = calibrated(body).process(0.1 * np.arange(5), values)
    for skip_bad in (False, True):
        read = st.read(tmp_path / "frames.ndjson", skip_bad=skip_bad, **keys)
        assert same(read.engine(None, st.Calibration(CALIBRATION, body), "cpu").process(read.t, read.values), wanted)
    with st.open(tmp_path / "frames.ndjson", seconds=0.25, **keys) as parts:
        assert sum(len(part) for part in parts) == 5
    with pytest.raises(st.SomaticError, match="a message has 25 taxels with three axes, and the body 0"):
        st.read(tmp_path / "frames.ndjson", map=keys["map"], body=st.Body.grid(5, 5, PITCH))


def test_hdf5_of_three_axes(tmp_path: pathlib.Path) -> None:
    h5py = pytest.importorskip("h5py")
    body, values = pad(), forces(10)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["three"], file["flat"] = values, in_channels(values)
        file["few"] = values[:, :7]
    wanted = calibrated(body).process(0.1 * np.arange(10), values)
    for name in ("three", "flat"):
        read = st.read(tmp_path / "a.h5", dataset=name, rate_hz=10, body=body)
        assert sorted(read.channels) == sorted(body.channels)
        assert same(read.engine(None, st.Calibration(CALIBRATION, body), "cpu").process(read.t, read.values), wanted)
    assert st.read(tmp_path / "a.h5", dataset="three", rate_hz=10, body=body).channels[:4] == ["0", "0.u", "0.v", "1"]
    with pytest.raises(st.UsageError, match="21 values, and body `pad` has 25 taxels with 75 values"):
        st.read(tmp_path / "a.h5", dataset="few", rate_hz=10, body=body)


def test_pictures_of_letters() -> None:
    body = skin()
    p = touched(calibrated(body)).select("skin")
    for letter, output in [("sustained", "total [N]"), ("shear", "shear [N]"), ("temperature", "temperature [°C]"), ("proximity", "nearest [m]")]:
        ax = p.select(letters=letter).plot(output.split()[0])  # type: ignore[arg-type]
        assert ax.get_ylabel() == output and len(ax.lines) >= 1
    labels = [line.get_label() for line in p.plot("shear").lines]
    assert [label.rsplit(" ", 1)[1] for label in labels if not label.startswith("_")] == ["u", "v"]
    # Of one letter alone its own quantity is drawn.
    assert p.select(letters="proximity").plot().get_ylabel() == "nearest [m]"
    plt.close("all")
    values = np.full(3 * COUNT, np.nan)
    values[COUNT : 2 * COUNT] = 30 + 100 * UV[:, 0]
    ax = body.plot(values, letter="temperature", unit="°C")
    grey, hollow, colored = ax.collections[-3:]
    assert [len(part.get_offsets()) for part in (grey, hollow, colored)] == [2 * COUNT, 0, COUNT]
    low, high = colored.get_clim()
    assert (low + high) / 2 == pytest.approx(30) and colored.get_cmap().name == "RdBu_r"
    assert body.plot(np.ones(3 * COUNT), letter="proximity").collections[-1].get_cmap().name == "viridis_r"
    assert body.plot(np.ones(3 * COUNT)).collections[-1].get_cmap().name == "viridis"
    ax = pad().plot(forces(1)[0], unit="N")
    # The shafts come first, from their tips to the taxels.
    shafts = np.array(ax.collections[-1]._segments3d[:COUNT])
    assert np.allclose(shafts[:, 1], PLACES, atol=1e-6)
    drag = forces(1)[0, :, 1:].astype(float)
    drag = np.stack([-drag[:, 1], drag[:, 0], np.zeros(COUNT)], axis=1)
    longest = np.linalg.norm(drag, axis=1).max()
    assert np.allclose(shafts[:, 0] - shafts[:, 1], drag / longest * 0.12 * 4 * PITCH, atol=1e-6)
    plt.close("all")
    # Of links that are turned against the world, too.
    robot = st.Body.bundled("humanoid")
    taxels = robot.taxels
    for link in np.unique(taxels["link"]):
        of_link = np.flatnonzero(taxels["link"] == link)
        aside = robot._at_rest(taxels["position"] - taxels["position"][of_link[0]])[of_link]
        assert np.allclose(aside, taxels["place"][of_link] - taxels["place"][of_link[0]], atol=1e-9)
    with pytest.raises(st.UsageError, match="no taxel of this body is of letter `temperature`"):
        pad().plot(np.ones(COUNT), letter="temperature")
    with pytest.raises(st.UsageError, match="there is no letter `warmth` to plot"):
        pad().plot(letter="warmth")  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match=r"shape \[taxels\] = \[25\] or \[taxels, 3\]"):
        pad().plot(np.ones((COUNT, 2)))


@pytest.mark.once
def test_three_axes_from_python_are_those_of_lines_of_json(command: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """What a dict says is what the command reads of a line."""
    body = pad()
    body.save(tmp_path / "pad.glb")
    lines = '{"t":0,"values":{"3":[0.5,0.1,-0.2],"4":[0.4,null,0.1],"5":0.3,"6.u":0.2}}\n'
    done = subprocess.run(
        [command, "run", "--quiet", "--body", tmp_path / "pad.glb", "--source", "-", "--backend", "cpu", "--sink", "ndjson:-"],
        input=lines.encode(),
        capture_output=True,
        check=True,
    )
    p = st.Engine(body, backend="cpu").step(0, {3: [0.5, 0.1, -0.2], 4: [0.4, None, 0.1], "5": 0.3, "6.u": 0.2})
    st.write(p, tmp_path / "mine.ndjson")
    assert (tmp_path / "mine.ndjson").read_bytes() == done.stdout
