"""The page shows what an engine computes; docs/reference/page.md has its messages."""

from __future__ import annotations

import gc
import json
import os
import socket
import struct
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import somatic_touch as st

HERE = "127.0.0.1:0"


class Browser:
    """What a browser does: the page's socket."""

    def __init__(self, url: str) -> None:
        address, token = url.removeprefix("http://").split("/#token=")
        host, port = address.split(":")
        self.socket = socket.create_connection((host, int(port)), timeout=20)
        self.heard = self.socket.makefile("rb")
        lines = [
            "GET /socket HTTP/1.1", f"Host: {address}", f"Origin: http://{address}", "Upgrade: websocket", "Connection: Upgrade",
            "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        ]
        self.socket.sendall("".join(f"{line}\r\n" for line in [*lines, ""]).encode())
        assert b" 101 " in self.heard.readline()
        while self.heard.readline() != b"\r\n":
            pass
        self.say(type="hello", version=5, token=token, after_event=None)

    def say(self, **message: object) -> None:
        text = json.dumps(message).encode()
        assert len(text) < 126
        self.socket.sendall(bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text)

    def hear(self, kind: str | int) -> Any:
        """The next message of this kind: text by its type, binary by its number."""
        while True:
            code, length = self.heard.read(2)
            if length >= 126:
                length = int.from_bytes(self.heard.read(2 if length == 126 else 8))
            data = self.heard.read(length)
            if code & 15 == 8:
                raise AssertionError(f"the server closed: {data!r}")
            if code & 15 == 1 and (message := json.loads(data))["type"] == kind:
                return message
            if code & 15 == 2 and data[0] == kind:
                return data


def until(holds: Callable[[], bool]) -> None:
    """Waits for what holds soon."""
    end = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def number_and_time(frame: bytes) -> tuple[int, float]:
    return struct.unpack_from("<Qd", frame, 8)


def test_a_browser_sees_what_is_computed(hand: st.Body) -> None:
    engine = st.Engine(hand, backend="cpu", taxels=hand.taxels["id"][::-1])
    with engine.view(HERE) as view:
        assert urllib.request.urlopen(view.url.split("#")[0]).status == 200
        browser = Browser(view.url)
        welcome = browser.hear("welcome")
        assert welcome["body"] == "hand" and [field["name"] for field in welcome["fields"]] == engine.fields
        # The server counts a viewer a moment after it has welcomed it.
        until(lambda: view.viewers == 1)
        values = np.zeros((3, 40), np.float32)
        # By descending id: the fifth from the end is taxel 4.
        values[:, 35] = [1, 2, 512]
        engine.step(2.5, values[0])
        frame = browser.hear(2)
        assert number_and_time(frame) == (0, 2.5)
        # Of a call the last frame.
        engine.process([2.6, 2.7, 2.8], values, progress=lambda frames: None)
        assert number_and_time(browser.hear(2)) == (3, 2.8)
        browser.say(type="taxel", taxel=4)
        told = browser.hear("taxel")
        assert (told["raw"], told["pressure"]) == (512, 512)
    assert "closed" in browser.hear("ended")["reason"]
    until(lambda: view.viewers == 0)
    assert repr(view) == "<View, closed>"
    # The engine goes on, and can be shown again.
    assert engine.step(3.0, values[0]).first_frame == 4
    engine.view(HERE).close()


def test_one_view_at_a_time(hand: st.Body) -> None:
    engine = st.Engine(hand, backend="cpu")
    view = engine.view(HERE)
    with pytest.raises(st.UsageError, match="shown already"):
        engine.view(HERE)
    browser = Browser(view.url)
    del view
    gc.collect()
    assert browser.hear("ended")
    with engine.view(HERE) as view:
        del engine
        gc.collect()
        assert Browser(view.url).hear("welcome")["mode"] == "live"


def test_other_machines_need_a_name(hand: st.Body) -> None:
    engine = st.Engine(hand, backend="cpu")
    with pytest.raises(st.UsageError, match="other machines"):
        engine.view("0.0.0.0:0")
    with pytest.raises(st.UsageError, match="not an address"):
        engine.view("here")
    with engine.view("0.0.0.0:0", allow_hosts=["robot.local"]) as view:
        assert view.url.startswith("http://robot.local:")


def test_a_page_is_no_sink(touch: st.Recording, tmp_path) -> None:
    p = touch.engine(backend="cpu").process(touch.t, touch.values)
    with pytest.raises(st.UsageError, match=r"Engine\.view"):
        st.write(p, "page")
    with pytest.raises(st.UsageError, match=r"Engine\.view"):
        st.run(tmp_path / "a.csv", "page")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_fork_leaves_the_view_alone() -> None:
    code = """
import os, sys, urllib.request, somatic_touch as st
engine = st.Engine(st.Body.bundled("hand"), backend="cpu")
view = engine.view("127.0.0.1:0")
child = os.fork()
if child == 0:
    engine.step(0.0, [0] * 40)
    view.close()
    del view, engine
    sys.exit(0)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
assert urllib.request.urlopen(view.url.split("#")[0]).status == 200
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", code], check=True, timeout=60)
