"""Percepts as frames come: over pseudo-terminals, from boards and from a board that prints numbers."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import pickle
import socket
import subprocess
import threading
import time
import tty
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from test_interrupt import ctrl_c

import somatic_touch as st

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are pseudo-terminals on POSIX alone")
SENSORS = st.Body.grid(1, 3, 0.01, name="pad")
TEXT = {"columns": "1-3"}
"""Also the one that never changes."""


class Board:
    """A board at the end of a pseudo-terminal, which plays in a thread of its own until it is closed."""

    def __init__(self) -> None:
        self.end, self.line = os.openpty()
        self.name = os.ttyname(self.line)
        os.set_blocking(self.end, False)
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.play, daemon=True)
        self.thread.start()

    def play(self) -> None:
        raise NotImplementedError

    def close(self) -> None:
        self.over.set()
        self.thread.join()
        os.close(self.line)
        os.close(self.end)


class Printer(Board):
    """A board that prints three numbers a line, about a hundred times a second, to whoever has its line open."""

    def __init__(self) -> None:
        self.sent = 0
        super().__init__()

    def play(self) -> None:
        while not self.over.wait(0.01):
            self.sent += 1
            with contextlib.suppress(BlockingIOError):
                os.write(self.end, f"{self.sent % 100} {self.sent % 7} 500\n".encode())


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


class Paxini(Board):
    """A board of PaXini with the tip of an index finger of two taxels: it sends frames until it is silent, or is never heard of at all."""

    def __init__(self) -> None:
        self.is_silent, self.is_pressed = threading.Event(), threading.Event()
        super().__init__()
        tty.setraw(self.line)
        self.name = f"paxini:{self.name}"

    @staticmethod
    def summed(*parts: int) -> bytes:
        return bytes([*parts, -sum(parts) % 256])

    def play(self) -> None:
        request, sends = b"", False
        while not self.over.wait(0.005):
            with contextlib.suppress(BlockingIOError):
                request += os.read(self.end, 100)
            while len(request) >= (wanted := 9 + (request[3:4] == b"\x10")):
                asked, request = request[:wanted], request[wanted:]
                if self.is_silent.is_set():
                    continue
                is_write = asked[3] == 0x10
                data = [0] * (1 if is_write else asked[6])
                if asked[4] == 0x10:
                    data[0] = 0b100_0000
                elif asked[4] == 0x30:
                    data[12] = 2
                sends = is_write and asked[4] == 0x17 and asked[8] == 1
                os.write(self.end, self.summed(0xAA, 0x55, 0, asked[3], asked[4], 0, len(data), 0, *data))
            if sends and not self.is_silent.is_set():
                harder = 100 if self.is_pressed.is_set() else 0
                with contextlib.suppress(BlockingIOError):
                    os.write(self.end, self.summed(0xAA, 0x56, 0, 13, 0, 0, *[0] * 6, 10, 246, 50 + harder, 20, 0, 30 + harder))


@pytest.fixture
def paxini() -> Iterator[Paxini]:
    board = Paxini()
    yield board
    board.close()


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_ctrl_c_ends_a_board_of_three_axes_that_is_silent(paxini: Paxini) -> None:
    live = st.live(source=paxini.name, backend="cpu")
    assert live.channels == ["0.u", "0.v", "0", "1.u", "1.v", "1"] and live.body.taxels["modality"].tolist() == ["force3"] * 2
    p = next(p for p in live if np.isfinite(p["shear"]).any()).select("index_tip")
    assert p.letters == ["sustained", "shear"] and p["total"][0, 0] == pytest.approx(8) and p["shear"][0, 1] == pytest.approx([3, -1])
    paxini.is_silent.set()
    with ctrl_c(2.5):
        for _ in live:
            pass
    assert not list(live)


@pytest.mark.once
def test_what_is_live_is_not_read_to_an_end_that_never_comes(paxini: Paxini, tmp_path: pathlib.Path) -> None:
    begin = time.perf_counter()
    for source in (paxini.name, "modbus://127.0.0.1:9", "ros2:/skin"):
        for call in (st.read, st.open, lambda source, **keys: st.convert(source, tmp_path / "a.mcap", **keys)):
            keys = {} if source.startswith("paxini") else {"map": "inspire"}
            with pytest.raises(st.UsageError, match="only recordings are read here; somatic_touch.live gives percepts of it") as raised:
                call(source, **keys)  # type: ignore[operator]
            assert source in str(raised.value) and "\n" not in str(raised.value)
    for skip_bad in (False, True):
        with pytest.raises(st.UsageError, match="only recordings"):
            st.read(paxini.name, map="paxini", skip_bad=skip_bad)
    with pytest.raises(st.UsageError, match="only recordings"):
        st.run(paxini.name, tmp_path / "a.csv", body=SENSORS)
    assert time.perf_counter() - begin < 2 and not list(tmp_path.iterdir())


@pytest.mark.once
def test_ctrl_c_is_heard_while_a_device_does_not_answer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as device:
        name = f"modbus://127.0.0.1:{device.getsockname()[1]}"
        with ctrl_c():
            st.live(source=name, map="inspire")
        with ctrl_c():
            st.calibrate(st.Body.grid(1, 1, 0.01), name, map="inspire")
        with pytest.raises(st.InputError, match="no answer within 3 s"):
            st.live(source=name, map="inspire", skip_bad=True)


def when_free(call: Callable[[], Any]) -> Any:
    """What `call` gives once the port is not taken any more, which takes a moment."""
    until = time.monotonic() + 10
    while True:
        try:
            return call()
        except st.InputError as error:
            if "does another program use it" not in str(error) or time.monotonic() > until:
                raise
        time.sleep(0.05)


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_a_port_is_free_when_its_loop_has_ended_also_where_nothing_comes(paxini: Paxini) -> None:
    live = st.live(source=paxini.name, backend="cpu")
    next(live)
    paxini.is_silent.set()
    time.sleep(1.5)
    live.stop()
    with pytest.raises(st.InputError, match="no answer at 921600 baud"):
        when_free(lambda: st.live(source=paxini.name, backend="cpu"))


@pytest.mark.once
@pytest.mark.filterwarnings("ignore")
def test_a_board_of_three_axes_is_calibrated(paxini: Paxini) -> None:
    with st.live(source=paxini.name, backend="cpu") as live:
        body = live.body

    def press(told: str) -> None:
        if told.startswith("now press"):
            paxini.is_pressed.set()

    found = when_free(lambda: st.calibrate(body, paxini.name, rest=0.5, press=0.5, say=press))
    assert found["travel"].tolist() == pytest.approx([10, 10]) and "shear_baseline = [1, -1]" in found.calibration.text
    st.Engine(body, None, found.calibration, "cpu").step(0, [[5, 1, -1], [3, 2, 0]])
