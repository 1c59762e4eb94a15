"""Percepts as frames come: over pseudo-terminals, from boards and from a board that prints numbers."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import pickle
import subprocess
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from test_interrupt import ctrl_c

import somatic_touch as st

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are pseudo-terminals on POSIX alone")
SENSORS = st.Body.grid(1, 3, 0.01, name="pad")
TEXT = {"columns": "1-3"}
"""Also the one that never changes."""


class Printer:
    """A board that prints three numbers a line, about a hundred times a second, to whoever has its line open."""

    def __init__(self) -> None:
        self.end, line = os.openpty()
        self.name = os.ttyname(line)
        self.line = line
        self.over = threading.Event()
        self.sent = 0
        self.thread = threading.Thread(target=self.write, daemon=True)
        self.thread.start()

    def write(self) -> None:
        os.set_blocking(self.end, False)
        while not self.over.wait(0.01):
            self.sent += 1
            with contextlib.suppress(BlockingIOError):
                os.write(self.end, f"{self.sent % 100} {self.sent % 7} 500\n".encode())

    def close(self) -> None:
        self.over.set()
        self.thread.join()
        os.close(self.line)
        os.close(self.end)


@pytest.fixture
def printer() -> Iterator[Printer]:
    board = Printer()
    yield board
    board.close()


@contextlib.contextmanager
def boards(command: pathlib.Path, folder: pathlib.Path) -> Iterator[str]:
    """A board of the bundled hand on a pseudo-terminal."""
    link = folder / "board"
    played = subprocess.Popen([command, "board", "--link", link, "--loop"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 20
        while not link.exists() and time.monotonic() < until:
            time.sleep(0.02)
        yield f"serial:{link}"
    finally:
        played.terminate()
        played.wait()


@pytest.mark.once
def test_a_board_that_prints_numbers(printer: Printer) -> None:
    keys = {"outputs": ["total"], "backend": "cpu", "text": TEXT}
    with pytest.warns(UserWarning, match="text"), st.live(keys, source=f"text:{printer.name}", body=SENSORS) as live:
        assert live.fields == ["pad"] and live.taxels == [0, 1, 2] and live.backend == "cpu"
        found = [p for p, _ in zip(live, range(20), strict=False)]
    assert [len(p.t) for p in found] == [1] * 20
    t = np.array([p.t[0] for p in found])
    assert (np.diff(t) > 0).all() and [p.first_frame for p in found] == list(range(20))
    totals = np.array([p["total"][0, 0] for p in found])
    assert (totals >= 500).all() and len(set(totals)) > 5
    # It is closed: a loop over it has ended.
    assert not list(live)
    with pytest.raises(TypeError, match="live stays in its process"):
        pickle.dumps(live)


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_another_thread_stops_it(printer: Printer) -> None:
    live = st.live(source=f"text:{printer.name}", text=TEXT, body=SENSORS, outputs=["total"], backend="cpu")
    seen: list[int] = []
    stopped: list[float] = []

    def stop() -> None:
        while len(seen) < 5:
            time.sleep(0.005)
        stopped.append(time.perf_counter())
        live.stop()

    thread = threading.Thread(target=stop)
    thread.start()
    for p in live:
        seen.append(p.first_frame)
    assert time.perf_counter() - stopped[0] < 1 and len(seen) >= 5
    thread.join()


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_ctrl_c_ends_it_also_where_nothing_comes(printer: Printer) -> None:
    live = st.live(source=f"text:{printer.name}", text=TEXT, body=SENSORS, backend="cpu")
    next(live)
    printer.over.set()
    with ctrl_c():
        for _ in live:
            pass
    assert not list(live)


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_boards_are_read_as_the_command_reads_them(command: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with boards(command, tmp_path) as port, st.live(source=port, body="hand", outputs=["total", "touches"], backend="cpu") as live:
        assert len(live.taxels) == 40 and len(live.fields) == 13
        totals = [float(np.nan_to_num(p["total"]).max()) for p, _ in zip(live, range(100), strict=False)]
        (row,) = live.boards
        assert row["port"] == port.removeprefix("serial:") and row["delivered"] >= 100 and row["sent"] == row["delivered"] + row["lost"]
    assert len(totals) == 100 and max(totals) > 100
    summary = tmp_path / "summary.json"
    with boards(command, tmp_path) as port:
        words = ["run", "--quiet", "--body", "hand", "--source", port, "--for", "1s", "--summary", summary, "--sink", f"ndjson:{tmp_path / 'a.ndjson'}"]
        subprocess.run([command, *words], check=True, capture_output=True)
    (told,) = json.loads(summary.read_text())["boards"]
    assert set(live.boards.keys()) == set(told)
    calibrated = st.Calibration("[all]\ngain = 2\nunit = 'kPa'", st.Body.bundled("hand"))
    with boards(command, tmp_path) as port, st.live(source=port, body="hand", calibration=calibrated, outputs=["total"]) as live:
        assert next(live).unit("total") == "Pa"


@pytest.mark.once
def test_a_recording_is_played_with_the_same_bits(touch: st.Recording, tmp_path: pathlib.Path) -> None:
    scene = {"outputs": ["total", "centroid"], "backend": "cpu"}
    whole = touch.engine(scene, backend="cpu").process(touch.t, touch.values)
    parts = list(st.live(scene))
    assert sum(len(p.t) for p in parts) == 280
    for name in whole.keys():
        np.testing.assert_array_equal(np.concatenate([p[name] for p in parts]), whole[name])
    # From the file of a scene, whose paths are relative to it.
    st.Body.bundled("hand").save(tmp_path / "own.glb")
    (tmp_path / "touch.csv").write_text("t,0,1\n0,1,2\n0.1,3,4\n")
    (tmp_path / "a.scene.toml").write_text('body = "own.glb"\nsource = "touch.csv"\noutputs = ["total"]\n')
    live = st.live(tmp_path / "a.scene.toml")
    assert [p.t.tolist() for p in live] == [[0.0, 0.1]] and live.losses == [] and len(live.boards) == 0


def test_what_makes_no_sense_is_one_line(tmp_path: pathlib.Path) -> None:
    for keys, what in [
        ({"sink": "a.csv"}, "`sink` is for the command"),
        ({"sorce": "-"}, "there is no key `sorce`"),
        ({"source": "serial:/dev/no-such", "wiring": "no.toml", "body": "hand"}, "no.toml"),
        ({"source": "text:/dev/no-such-board", "body": "hand"}, "no-such-board"),
        ({"accuracy": {"budget": "1 ms"}}, "tradeoff"),
        ({"source": "zenoh:arm"}, "zenoh"),
        ({"source": "ros2:/skin"}, "ros2"),
    ]:
        with pytest.raises(st.SomaticError, match=what) as raised:
            st.live(keys)
        assert "\n" not in str(raised.value)
    with pytest.raises(st.UsageError, match="not both"):
        st.live(tmp_path / "a.toml", body="hand")
