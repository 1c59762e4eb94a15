"""Bodies as tables, of arrays, and their joints."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import ROOT

import somatic_touch as st

ROBOTS = ROOT / "examples" / "robots"


@pytest.mark.parametrize("name", ["hand", "humanoid"])
def test_taxels_are_a_table_as_they_are(name) -> None:
    taxels = st.Body.bundled(name).taxels
    frame, other = pd.DataFrame(taxels), pl.DataFrame(taxels)
    names = ["id", "link", *[f"{vector}_{axis}" for vector in ("position", "normal", "place") for axis in "xyz"], "area", "modality"]
    assert list(frame.columns) == other.columns == names == list(taxels.dtype.names or ())
    for vector in ("position", "normal", "place"):
        columns = [f"{vector}_{axis}" for axis in "xyz"]
        assert np.array_equal(frame[columns], taxels[vector]) and np.array_equal(other[columns], taxels[vector])
        assert taxels[vector].shape == (len(taxels), 3) and np.array_equal(taxels[3][vector], taxels[vector][3])
        assert np.array_equal(taxels[::-2][vector], taxels[vector][::-2])
    assert np.array_equal(frame["id"], taxels["id"]) and type(taxels["id"]) is np.ndarray
    again = pickle.loads(pickle.dumps(taxels))
    assert np.array_equal(again, taxels) and np.array_equal(again["place"], taxels["place"])
    assert not taxels.flags.writeable
    with pytest.raises(ValueError, match="velocity"):
        taxels["velocity"]


def test_the_truth_of_a_simulation_is_a_table() -> None:
    truth = st.simulate(ROOT / "examples" / "simulations" / "rod.toml").truth
    frame = pd.DataFrame(truth)
    assert np.array_equal(frame[["u", "v"]], truth["uv"], equal_nan=True)
    assert np.array_equal(frame[["velocity_u", "velocity_v"]], truth["velocity_uv"], equal_nan=True)
    assert np.array_equal(frame["velocity_x"], truth["velocity"][:, 0], equal_nan=True)


def test_a_surface_is_its_triangles_in_the_world() -> None:
    body = st.Body.bundled("hand")
    vertices, faces = body.surface
    # A point (x, y, z) of a body is (z, x, y) in the world.
    assert np.array_equal(vertices[faces], body.triangles[..., [2, 0, 1]])
    assert len(np.unique(vertices, axis=0)) == len(vertices) < 3 * len(faces)
    nearest = np.linalg.norm(vertices[None] - body.taxels["place"][:, None], axis=2).min(axis=1)
    assert nearest.max() < 0.01
    vertices, faces = st.Body.grid(2, 2, 0.01).surface
    assert vertices.shape[1:] == faces.shape[1:] == (3,)


POSITIONS = np.stack([*np.meshgrid(np.arange(8) * 0.01, np.arange(6) * 0.01), np.zeros((6, 8))], axis=-1).reshape(-1, 3)
UP = np.tile([0, 0, 2.0], (48, 1))
SQUARE = (np.array([[0, 0, 0], [0.07, 0, 0], [0.07, 0.05, 0], [0, 0.05, 0]]), [[0, 1, 2], [0, 2, 3]])


def test_a_body_of_arrays(tmp_path) -> None:
    pad = st.Body.from_arrays(POSITIONS, UP, areas=1e-4, surface=SQUARE, name="pad")
    taxels = pad.taxels
    assert pad.name == "pad" and pad.links == ["pad"] and taxels["id"].tolist() == list(range(48))
    assert np.allclose(taxels["place"], POSITIONS, atol=1e-8) and np.array_equal(taxels["position"], taxels["place"])
    assert np.array_equal(taxels["normal"], UP / 2) and np.allclose(taxels["area"], 1e-4)
    vertices, faces = pad.surface
    assert np.allclose(vertices, SQUARE[0], atol=1e-8) and faces.tolist() == SQUARE[1]
    values = np.zeros(48, np.float32)
    values[[9, 10]] = 100
    p = st.Engine(pad, {"outputs": ["force", "position"]}, st.Calibration("[all]\nunit = 'kPa'", pad), "cpu").step(0, values)
    assert p["force"][0, p.index("pad")] == pytest.approx(200e3 * 1e-4, rel=1e-6)
    assert np.allclose(p["position"][0, p.index("pad")], POSITIONS[[9, 10]].mean(axis=0), atol=1e-6)
    pad.save(tmp_path / "pad.glb")
    assert np.array_equal(st.Body.load(tmp_path / "pad.glb").taxels, taxels)
    assert pickle.loads(pickle.dumps(pad)) == pad
    bare = st.Body.from_arrays(POSITIONS.tolist(), UP.tolist())
    assert len(bare.surface[1]) == 0 and (bare.taxels["area"] == 0).all()


def test_a_body_of_arrays_with_links() -> None:
    links = ["left"] * 24 + ["right"] * 24
    ids = np.arange(100, 148)[::-1]
    areas = np.linspace(1e-5, 1e-4, 48)
    body = st.Body.from_arrays(POSITIONS, UP, link=links, ids=ids, areas=areas, surface={"right": SQUARE}, name="pads")
    assert body.links == ["left", "right"] and body.taxels["id"].tolist() == sorted(ids.tolist())
    assert np.allclose(body.taxels["position"][::-1], POSITIONS, atol=1e-8) and np.allclose(body.taxels["area"][::-1], areas)
    assert [body.links[link] for link in body.taxels["link"]] == links[::-1]
    engine = st.Engine(body, {"outputs": ["position"]}, backend="cpu")
    p = engine.step(0, [1] * 48, pose={"right": [0, 0, 5, 0, 0, 0, 1], "left": [0, 0, 1, 0, 0, 0, 1]})
    assert p["position"][0, p.index("right"), 2] == pytest.approx(5) and p.in_world[0, p.index("right")]


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"normals": UP[:3]}, "normals should be one a taxel, 48; there are 3"),
        ({"normals": UP * 0}, "normal of row 0 is zero"),
        ({"positions": POSITIONS * np.nan}, "row 0 is not finite"),
        ({"positions": POSITIONS[:, :2]}, r"positions should have shape \[rows, 3\]; this has \[48, 2\]"),
        ({"positions": np.zeros((0, 3)), "normals": np.zeros((0, 3))}, "at least"),
        ({"positions": "here"}, "positions should be numbers"),
        ({"ids": [1] * 48}, "1 is there twice"),
        ({"ids": [1]}, "ids should be one a taxel"),
        ({"ids": [2**31 + at for at in range(48)]}, "is over"),
        ({"areas": [1, 2]}, r"shape \[\] or \[48\]"),
        ({"areas": -1}, "area of row 0 is -1"),
        ({"link": ["a"]}, "link should be one a taxel"),
        ({"surface": SQUARE[0]}, "no pair"),
        ({"surface": (SQUARE[0], [[0, 1, 4]])}, "face 0 has no vertex"),
        ({"surface": (SQUARE[0] + np.inf, SQUARE[1])}, "vertex 0 is not finite"),
        ({"surface": {"skni": SQUARE}}, "did you mean `skin`"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_other_arrays_are_no_body_and_say_why(keys, says: str) -> None:
    with pytest.raises(st.UsageError, match=says):
        st.Body.from_arrays(**{"positions": POSITIONS, "normals": UP, **keys})


def test_a_sheet_has_the_cells_that_are_there() -> None:
    there = np.array([[1, 0, 1], [1, 1, 1]])
    whole, sheet = st.Body.grid(2, 3, 0.01), st.Body.grid(2, 3, 0.01, cells=there)
    assert sheet.taxels["id"].tolist() == [0, 2, 3, 4, 5]
    assert np.array_equal(sheet.taxels["place"], whole.taxels["place"][there.ravel() > 0])
    for cells in ([[True, False]], np.ones((3, 2)), "all", [[True] * 3, [True] * 2]):
        with pytest.raises(st.UsageError, match=r"cells should be bool of shape \[rows, columns\] = \[2, 3\]"):
            st.Body.grid(2, 3, 0.01, cells=cells)


@pytest.fixture(scope="module")
def arm() -> st.Body:
    return st.author(ROBOTS / "arm.urdf", taxels=80, seed=1)


def test_joints_say_where_links_are(arm: st.Body) -> None:
    assert arm.joints["shoulder"] == {"link": "upper_arm", "kind": "revolute", "unit": "rad", "limits": (-2, 2)}
    assert arm.joints["elbow"]["kind"] == "continuous" and arm.joints["elbow"]["limits"] is None
    assert arm.joints["grip"]["unit"] == "m" and "other_grip" not in arm.joints
    rest = arm.forward(dict.fromkeys(arm.joints, 0.0))
    taxels = arm.taxels
    for link, pose in rest.items():
        rows = taxels[taxels["link"] == arm.links.index(link)]
        assert pose.shape == (7,) and np.allclose(rotated(pose, rows["position"]), rows["place"], atol=1e-9)
    bent = arm.forward({"shoulder": np.pi / 2, "elbow": 0, "grip": 0.01})
    # By the URDF: about y at (0, 0, 0.12), so that what was forward is down.
    assert np.allclose(bent["fore_arm"][:3], [0, 0, 0.12 - 0.3]) and np.allclose(bent["finger"][:3], [0, 0.02, 0.12 - 0.54])
    assert np.allclose(bent["other_finger"][:3], [0, -0.02, 0.12 - 0.54])
    unknown = arm.forward({"shoulder": 0.3})
    assert list(unknown) == ["base", "upper_arm"]
    many = arm.forward({"shoulder": [0, 0.1, 0.2], "elbow": 0.5, "grip": [0, 0, 0]}, {"base": [1, 0, 0, 0, 0, 0, 1]})
    assert all(pose.shape == (3, 7) for pose in many.values())
    one = arm.forward({"shoulder": 0.2, "elbow": 0.5, "grip": 0})
    assert np.allclose(many["finger"][2] - one["finger"], [1, 0, 0, 0, 0, 0, 0])


def rotated(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    vector, w = pose[3:6], pose[6]
    return points + 2 * np.cross(vector, np.cross(vector, points) + w * points) + pose[:3]


def test_joints_give_the_percepts_of_the_command(arm: st.Body, somatic, tmp_path) -> None:
    arm.save(tmp_path / "arm.glb")
    t = np.arange(60) * 0.01
    random = np.random.default_rng(3)
    values = random.integers(0, 500, (60, 80)).astype(np.float32)
    joints = {"shoulder": np.sin(3 * t), "elbow": 2 * t, "grip": np.full(60, 0.01)}
    ids = arm.taxels["id"]
    pd.DataFrame(np.column_stack([t, values]), columns=["t", *ids]).to_csv(tmp_path / "touch.csv", index=False)
    pd.DataFrame({"t": t, **joints}).to_csv(tmp_path / "joints.csv", index=False)
    outputs = "total,position,normal,touches"
    text = somatic(
        "run", "--quiet", "--body", tmp_path / "arm.glb", "--source", tmp_path / "touch.csv", "--joints", ROBOTS / "arm.urdf",
        "--joint-states", tmp_path / "joints.csv", "--backend", "cpu", "--outputs", outputs, "--all-fields", "--sink", "-",
    )
    p = st.Engine(arm, {"outputs": outputs.split(",")}, backend="cpu").process(t, values, joints=joints)
    compared = 0
    for frame, line in enumerate(map(json.loads, text.splitlines())):
        for index, field in enumerate(line["fields"]):
            assert field["in_world" if "in_world" in field else "contact"] in (True, False)
            for name in ("position", "normal"):
                assert (name in field) == p.present(name)[frame, index]
                if name in field:
                    # A body has its links at rest in single precision, a URDF in double.
                    assert np.allclose(p[name][frame, index], field[name], atol=1e-7), (frame, field["field"], name)
                    compared += 1
    assert compared > 500 and p.in_world.any()
    still = st.Engine(arm, {"outputs": ["position"]}, backend="cpu").process(t, values)
    assert not np.allclose(still["position"], p["position"], equal_nan=True)
    poses = arm.forward(joints)
    by_pose = st.Engine(arm, {"outputs": outputs.split(",")}, backend="cpu").process(t, values, pose=poses)
    assert np.allclose(by_pose["position"], p["position"], atol=1e-12, equal_nan=True) and np.array_equal(by_pose.flags, p.flags)
    engine = st.Engine(arm, {"outputs": ["position"]}, backend="cpu")
    assert engine.verify(t, values, joints=joints)["agrees"]
    engine = st.Engine(arm, {"outputs": ["position"]}, backend="cpu")
    one = engine.step(t[7], values[7], joints={name: positions[7] for name, positions in joints.items()})
    assert np.array_equal(one["position"][0], p["position"][7], equal_nan=True)


@pytest.mark.parametrize(
    ("joints", "says"),
    [
        ({"shoulder": 0, "elbow": 0}, "no position of `grip`, which moves `(other_)?finger`"),
        ({"shuolder": 0}, "there is no joint `shuolder`; did you mean `shoulder`"),
        ({"other_grip": 0}, "`other_grip` follows `grip`; leave it out"),
        ({"shoulder": [0, 1, 2]}, r"`shoulder` should have shape \[\] or \[2\], and have \[3\]"),
        ({"shoulder": [0, np.nan]}, "`shoulder` at frame 1 is not finite"),
        ({"shoulder": "bent"}, "should be numbers"),
        ([0, 1], "no dict"),
        ({1: 0}, "no text"),
    ],
)
def test_other_joints_are_refused_and_say_why(arm: st.Body, joints, says: str) -> None:
    with pytest.raises(st.UsageError, match=says):
        st.Engine(arm, backend="cpu").process([0, 1], np.zeros((2, 80)), joints=joints)


def test_a_body_without_joints_says_where_to_get_them(hand: st.Body) -> None:
    assert hand.joints == {} and list(hand.forward({})) == hand.links
    with pytest.raises(st.UnknownNameError, match="make one from a URDF"):
        hand.forward({"wrist": 0})
    with pytest.raises(st.UnknownNameError, match="did you mean `hand`"):
        hand.forward({}, {"hnad": [0, 0, 0, 0, 0, 0, 1]})
