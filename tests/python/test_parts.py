"""Recordings in stretches, and bars of progress."""

from __future__ import annotations

import pathlib
import subprocess
import sys
import types

import numpy as np
import pytest
from conftest import ROOT

import somatic_touch as st
import somatic_touch.batch

TOUCH = ROOT / "bodies" / "touch.csv"


@pytest.mark.parametrize("seconds", [0.001, 0.7, 2, 5.58, 100])
def test_stretches_are_the_recording(touch: st.Recording, seconds: float) -> None:
    with st.open(TOUCH, seconds=seconds, body="hand") as parts:
        assert parts.taxels == touch.taxels and parts.body == st.Body.bundled("hand") and parts.calibration is None
        engine = parts.engine({"outputs": ["total", "touches"]}, backend="cpu")
        read = list(parts)
        assert list(parts) == []
    assert np.array_equal(np.concatenate([part.t for part in read]), touch.t)
    assert np.concatenate([part.values for part in read]).tobytes() == touch.values.tobytes()
    for part in read:
        assert len(part) > 0 and (np.floor(part.t / seconds + 1e-9) == np.floor(part.t[0] / seconds + 1e-9)).all()
        assert part.body is parts.body and part.losses == []
    whole = touch.engine({"outputs": ["total", "touches"]}, backend="cpu").process(touch.t, touch.values)
    made = [engine.process(part.t, part.values) for part in read]
    assert np.array_equal(np.concatenate([p["total"] for p in made]), whole["total"])
    assert np.array_equal(np.concatenate([p.touches.id for p in made]), whole.touches.id)


def test_a_part_of_a_recording_is_read_in_stretches() -> None:
    parts = st.open(TOUCH, seconds=1, body="hand", from_s=1, to_s=3.5)
    assert [len(part) for part in parts] == [50, 50, 25]
    assert [len(part) for part in st.open("hand", seconds=1, from_s=1, to_s=2)] == [50]


def test_stretches_without_frames_are_left_out(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "gap.csv"
    path.write_text("t,0,1\n0,1,2\n0.5,1,2\n1,1,2\n7.25,3,4\n7.5,3,4\n8,3,4\n")
    read = [part.t.tolist() for part in st.open(path, seconds=1, body=st.Body.grid(1, 2, 0.01))]
    assert read == [[0, 0.5], [1], [7.25, 7.5], [8]]


def test_a_lost_frame_is_reported_once(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "short.csv"
    path.write_text("t,0,1\n0,1,2\n1,1,2\n2,3,4\n3,3")
    whole = st.read(path)
    assert len(whole.losses) == 1
    parts = st.open(path, seconds=1)
    assert [part.losses for part in parts] == [[], [], whole.losses] and parts.losses == whole.losses
    path.write_text("t,0,1\n0,1,2\n1,oops,2\n")
    with pytest.raises(st.InputError, match="oops"):
        list(st.open(path, seconds=0.5))


@pytest.mark.once
@pytest.mark.skipif(not pathlib.Path("/proc/self/status").exists(), reason="memory is read from /proc")
def test_memory_has_one_stretch(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "long.csv"
    with path.open("w") as file:
        file.write("t," + ",".join(map(str, range(40))) + "\n")
        row = "," + ",".join(["7"] * 40) + "\n"
        file.writelines(f"{frame / 1000}{row}" for frame in range(120_000))
    code = f"""
import pathlib, re, sys
import somatic_touch as st
most = lambda: int(re.search(r"VmHWM:\\s+(\\d+)", pathlib.Path("/proc/self/status").read_text())[1])
st.read("hand")
before = most()
frames = sum(len(part) for part in st.open({str(path)!r}, seconds=1)) if sys.argv[1] == "open" else len(st.read({str(path)!r}))
print(frames, most() - before)
"""
    grown = {}
    for how in ("open", "read"):
        done = subprocess.run([sys.executable, "-c", code, how], capture_output=True, text=True, check=True)
        frames, grown[how] = map(int, done.stdout.split())
        assert frames == 120_000
    # 19 MB of values, and as much again while they are gathered.
    assert grown["open"] < 8_000 < grown["read"], grown


def test_other_stretches_are_refused() -> None:
    for seconds in (0, -1, np.nan, np.inf):
        with pytest.raises(st.UsageError, match="seconds should be a positive number"):
            st.open(TOUCH, seconds=seconds)
    with pytest.raises(st.InputError, match="no such file"):
        st.open("no-such.csv")
    with pytest.raises(st.UsageError, match="it has no body; read it with body="):
        st.open(TOUCH).engine()
    with st.open(TOUCH) as parts:
        parts.close()
        assert list(parts) == [] and "40 taxels" in repr(parts)


def test_a_bar_grows_where_tqdm_is_installed(touch: st.Recording, tmp_path: pathlib.Path, monkeypatch) -> None:
    bars = []

    class Bar:
        def __init__(self, **about) -> None:
            self.about, self.n, self.is_closed = about, 0, False
            bars.append(self)

        def update(self, more) -> None:
            self.n += more

        def close(self) -> None:
            self.is_closed = True

    monkeypatch.setitem(sys.modules, "tqdm", types.ModuleType("tqdm"))
    monkeypatch.setitem(sys.modules, "tqdm.auto", types.SimpleNamespace(tqdm=Bar))  # type: ignore[arg-type]
    touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values, progress=True)
    st.run(TOUCH, tmp_path / "a.csv", body=touch.body, progress=True)
    st.author("hand", taxels=40, progress=True)
    assert sum(len(part) for part in st.open("hand", seconds=1, progress=True)) == 280
    assert [bar.n for bar in bars] == [280, 280, pytest.approx(1), 280] and all(bar.is_closed for bar in bars)
    assert [bar.about["total"] for bar in bars] == [280, None, 1, None]
    touch.engine(backend="cpu").process(touch.t, touch.values, progress=False)
    assert len(bars) == 4
    somatic_touch.batch.percepts([TOUCH], {"outputs": ["total"]}, tmp_path, body=touch.body, workers=1, progress=True)
    assert (bars[4].n, bars[4].about["total"], bars[4].is_closed) == (1, 1, True)


def test_without_tqdm_a_bar_is_refused_and_says_what_to_do(touch: st.Recording, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.raises(st.UsageError, match="pip install tqdm"):
        touch.engine(backend="cpu").process(touch.t, touch.values, progress=True)
    told: list[int] = []
    list(st.open("hand", seconds=2, progress=told.append))
    assert told == [100, 200, 280]
