"""What a type checker is to say of code that uses the package; checked, never run."""

from __future__ import annotations

import datetime
from typing import Any, assert_type

import numpy as np
import numpy.typing as npt

import somatic_touch as st

body = st.Body.bundled("hand")
engine = st.Engine(body, {"outputs": ["total"]}, backend="cpu")
p = engine.process([0.0], np.zeros((1, 40), np.float32))
assert_type(p, st.Percepts)
assert_type(p.contact, npt.NDArray[np.bool_])
assert_type(p.touches.id, npt.NDArray[np.uint64])
assert_type(body.fields["hand/back"].uv, npt.NDArray[np.float64] | None)
assert_type(st.read("a.csv").calibration, st.Calibration | None)
assert_type(engine.verify([0.0], [[0.0] * 40])["quantities"]["total"]["worst_share"], float)
assert_type(p.between(0, datetime.datetime.now(datetime.UTC)).select(["hand/*"]), st.Percepts)
assert_type(p.touches["link"], list[str])
assert_type([len(touches) for touches in p.touches.by_frame()], list[int])
assert_type(body.surface[1], npt.NDArray[np.uint32])
assert_type(body.forward({"elbow": [0.1, 0.2]})["hand"], npt.NDArray[np.float64])
assert_type(body.joints["elbow"]["limits"], tuple[float, float] | None)
with st.open("a.csv", seconds=10, progress=True) as parts:
    assert_type([part.t for part in parts], list[npt.NDArray[np.float64]])
engine.step(datetime.datetime.now(datetime.UTC), {4: 512.0, 7: None})
engine.process([datetime.datetime.now(datetime.UTC)], [{4: 512.0}], joints={"elbow": 0.1})
assert_type(body == st.Body.from_arrays([[0, 0, 0]], [[0, 0, 1]], surface=([[0, 0, 0]], [[0, 0, 0]])), bool)
engine.step("now", [0.0] * 40)  # type: ignore[arg-type]
st.Engine(body, backend="gpus")  # type: ignore[arg-type]
with st.live(source="serial:/dev/ttyUSB0", body=body) as live:
    assert_type([p.t for p in live], list[npt.NDArray[np.float64]])
    assert_type(live.stop(), None)
assert_type(st.tradeoff(body, within="3 mm").pick, dict[str, Any] | None)
assert_type(st.calibrate(body, "a.csv", rest=5).calibration, st.Calibration)
assert_type(st.tradeoff(body, within="3 mm", all=False, write="a.toml").plot("orientation", way="batch"), Any)
assert_type(st.compare(body, "hand"), st.Compared)
assert_type(st.compare(body, "hand")["second_is_nearer"], Any)
assert_type(st.read("a.csv", skip_bad=True), st.Recording)
st.plot("a.csv", "a.svg", body=body, from_s=1)
st.plot("a.csv", "a.svg", boddy=body)  # type: ignore[call-arg]
st.inspect(body, joints="a.urdf", up="y")
st.compare(body, body).plot("plaice")  # type: ignore[arg-type]
assert_type(st.author(urdf_skin="a.urdf", package={"a": "b"}, geometry="none"), st.Body)
assert_type(st.convert(body, "a.csv"), int)
assert_type(st.outputs()["name"], npt.NDArray[Any])
with st.view(body, open=False) as shown:
    assert_type(shown.url, str)
st.author("a.stl", up="x")  # type: ignore[arg-type]
grip = st.Body.from_arrays([[0, 0, 0]], [[0, 0, 1]], modality="force3", tangents=[[1, 0, 0]])
three = st.Engine(grip, backend="cpu", taxels=["0", "0.u", "0.v"])
three.process([0.0], [{0: [1.0, 0.1, None]}])
three.step(0.0, {"0": 1.0, "0.u": None})
three.step(0.0, np.zeros((1, 3), np.float32))
assert_type(three.channels + three.letters + body.channels, list[str])
assert_type(p.select(letters="shear").select("hand/*", letters=["shear", "temperature"]), st.Percepts)
assert_type(three.columns("touches"), st.Table)
assert_type(live.boards, st.Table)
assert_type(st.author(body, zones={0: "heel"}), st.Body)
assert_type(st.info("a.mcap", contacts="a.csv")["contacts"], Any)
st.plot("a.csv", "a.svg", calibration=st.Calibration("", body))
grip.plot([[1.0, 0.0, 0.0]], letter="shear")
p.select(letters="sheer")  # type: ignore[arg-type]
st.Body.from_arrays([[0, 0, 0]], [[0, 0, 1]], modality="force")  # type: ignore[arg-type]
