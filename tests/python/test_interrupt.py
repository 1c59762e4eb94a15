"""Ctrl-C ends every long call within moments, and leaves nothing half done."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pathlib
import signal
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from conftest import pressed

import somatic_touch as st
import somatic_touch.batch

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
SENSORS = st.Body.grid(8, 8, 0.01, name="array")
SCENE = {"outputs": ["total", "centroid", "principal_axis", "speed", "touches"]}
FIELDS = {"outputs": ["total", "centroid", "orientation"]}


@contextlib.contextmanager
def ctrl_c(after: float = 0.3, when: Callable[[], bool] = lambda: True) -> Iterator[None]:
    """Presses Ctrl-C, some seconds from now and not before `when`; what is inside should end at once, by KeyboardInterrupt."""
    sent: list[float] = []

    def press() -> None:
        time.sleep(after)
        while not when() and time.perf_counter() < begin + 60:
            time.sleep(0.01)
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    begin = time.perf_counter()
    thread = threading.Thread(target=press)
    # Python leaves the signal ignored where it was so at its start, as in a shell's background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        thread.start()
        with pytest.raises(KeyboardInterrupt):
            yield
        ended = time.perf_counter()
    finally:
        # A call that has ended before does not take the key with it into the next test.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        thread.join()
        signal.signal(signal.SIGINT, before)
    assert ended - sent[0] < 5


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A recording of minutes, in CSV: a short one over and over, with times that go back."""
    path = tmp_path_factory.mktemp("long") / "long.csv"
    t, values = pressed(SENSORS, 200)
    rows = [",".join([f"{time:.2f}", *(f"{value:.0f}" for value in row)]) for time, row in zip(t, values, strict=True)]
    header = ",".join(["t", *map(str, range(64))])
    path.write_text(header + "\n" + ("\n".join(rows) + "\n") * 3000)
    return path


def test_process_leaves_the_engine_as_it_was() -> None:
    humanoid = st.Body.bundled("humanoid")
    t, values = pressed(humanoid, 400)
    t, values = np.arange(20_000) * 0.01, np.tile(values, (50, 1))
    engine = st.Engine(humanoid, FIELDS, backend="reference")
    wanted = st.Engine(humanoid, FIELDS, backend="reference").process(t[:50], values[:50])["total"]
    with ctrl_c():
        engine.process(t, values)
    p = engine.process(t[:50], values[:50])
    assert p.first_frame == 0 and np.array_equal(p["total"], wanted)


def test_run(recording: pathlib.Path, tmp_path: pathlib.Path) -> None:
    for sink in ("percepts.parquet", "percepts.csv"):
        with ctrl_c():
            st.run(recording, tmp_path / sink, body=SENSORS, scene=SCENE, backend="reference")
        assert not list(tmp_path.iterdir()), "a table appears when it is whole, and half ones are taken away"


def test_read(recording: pathlib.Path) -> None:
    with ctrl_c(0.1):
        st.read(recording, body=SENSORS)


def test_verify() -> None:
    humanoid = st.Body.bundled("humanoid")
    t, values = pressed(humanoid, 400)
    with ctrl_c():
        st.Engine(humanoid, FIELDS, backend="cpu").verify(np.arange(20_000) * 0.01, np.tile(values, (50, 1)))


def test_simulate() -> None:
    with ctrl_c():
        st.simulate("""
            body = "hand"
            rate_hz = 1000
            duration_s = 3600
            [[touch]]
            on = "hand/back"
            indenter = "ball"
            radius_m = 0.008
            path = [[0, -0.005], [0, 0.005]]
            times_s = [0, 3600]
            force_newton = [[0, 4], [3600, 4]]
        """)


def test_author() -> None:
    with ctrl_c(0.1):
        st.author("humanoid", taxels=100_000, seed=1)
    with pytest.raises(ZeroDivisionError):
        st.author("hand", taxels=20, seed=1, progress=lambda share: 1 // 0)
    assert len(st.author("hand", taxels=20, seed=1).taxels) == 20


def test_write(tmp_path: pathlib.Path) -> None:
    t, values = pressed(SENSORS, 200)
    engine = st.Engine(SENSORS, SCENE, backend="cpu")
    with ctrl_c():
        st.write((engine.process(t, values) for _ in range(10**6)), tmp_path / "percepts.csv")
    assert not list(tmp_path.iterdir())


def test_one_process(recording: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with ctrl_c():
        st.batch.percepts([recording], SCENE, tmp_path, body=SENSORS, backend="reference", workers=1)
    assert not list(tmp_path.iterdir())


def test_a_pool(recording: pathlib.Path, tmp_path: pathlib.Path) -> None:
    recordings = [recording]
    for number in range(5):
        recordings.append(tmp_path / f"{number}.csv")
        recordings[-1].hardlink_to(recording)
    out = tmp_path / "out"

    def are_two_under_way() -> bool:
        # Of each recording a table, and one of touches.
        return len(list(out.rglob("*.parquet.*"))) >= 4

    others = set(multiprocessing.active_children())
    with ctrl_c(when=are_two_under_way):
        st.batch.percepts(recordings, SCENE, out, body=SENSORS, backend="reference", workers=2)
    assert set(multiprocessing.active_children()) == others
    assert not [path for path in out.rglob("*") if path.is_file()]
