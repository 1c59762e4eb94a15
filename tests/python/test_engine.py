"""Memory, threads, processes and interruptions."""

from __future__ import annotations

import gc
import os
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import pressed

import somatic_touch as st


def test_columns_are_read_only_and_outlive_their_engine(hand: st.Body) -> None:
    t, values = pressed(hand, 300)
    engine = st.Engine(hand, backend="cpu")
    p = engine.process(t, values)
    total = p["total"]
    wanted = total.copy()
    assert total is p["total"] and not total.flags.writeable
    with pytest.raises(ValueError):
        total[0] = 1
    # Later calls use other memory as long as somebody needs this.
    for _ in range(10):
        engine.process(t + 10, 2 * values)
    del engine, p
    gc.collect()
    assert np.array_equal(total, wanted)


def test_values_are_read_where_they_are(hand: st.Body) -> None:
    _, values = pressed(hand, 300)
    engine = st.Engine(hand, backend="cpu")

    def is_read_in_place(values: np.ndarray, *mask: np.ndarray) -> bool:
        return engine._reads_at(values, *mask) == values.ctypes.data

    assert is_read_in_place(values) and is_read_in_place(values[100:200])
    read_only = values.view()
    read_only.flags.writeable = False
    assert is_read_in_place(read_only)
    # What cannot be read so is converted, and none of that is in place.
    for other in (values.astype(np.float64), np.asfortranarray(values), values[::2], values.astype(">f4"), values.astype(int)):
        assert not is_read_in_place(other)
    assert not is_read_in_place(values, np.zeros(40, bool))
    with pytest.raises(st.UsageError):
        engine._reads_at(values[:, 1:])


def test_a_column_is_a_view_that_owns_its_memory(hand: st.Body) -> None:
    p = st.Engine(hand, backend="cpu").process(*pressed(hand, 300))
    for name in p.keys():
        column = p[name]
        assert column.flags.c_contiguous and not column.flags.owndata and not column.flags.writeable
        # Its owner holds these numbers alone, neither percepts nor engine; a second look is at the same memory.
        assert type(column.base).__name__ == "PySliceContainer"
        assert p[name].ctypes.data == column.ctypes.data
        assert np.asarray(column).ctypes.data == column.ctypes.data


def test_percepts_that_live_keep_what_they_say(hand: st.Body) -> None:
    t, values = pressed(hand, 50)
    engine = st.Engine(hand, {"outputs": ["total"]}, backend="cpu")
    kept = [engine.process(t, values * (1 + index)) for index in range(12)]
    one = np.array(kept[0]["total"])
    for index, p in enumerate(kept):
        assert np.allclose(p["total"], one * (1 + index), rtol=1e-5)


def test_memory_is_used_again(hand: st.Body) -> None:
    import resource

    # Percepts and touches of a call take 6 MB.
    t, values = pressed(hand, 1000)
    engine = st.Engine(hand, backend="cpu")

    def run(times: int) -> int:
        for _ in range(times):
            engine.process(t, values)["total"]
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    first = run(6)
    assert run(8) < first + 20_000, "kilobytes"


def test_two_engines_in_two_threads_share_a_body(hand: st.Body) -> None:
    t, values = pressed(hand, 2000)
    wanted = st.Engine(hand, backend="cpu").process(t, values)["total"]
    got: list[np.ndarray] = []

    def work() -> None:
        engine = st.Engine(hand, backend="cpu")
        got.append(np.concatenate([engine.process(t[i : i + 100], values[i : i + 100])["total"] for i in range(0, 2000, 100)]))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 4 and all(np.array_equal(one, wanted) for one in got)


def test_threads_that_share_an_engine_take_turns(hand: st.Body) -> None:
    t, values = pressed(hand, 500)
    engine = st.Engine(hand, {"outputs": ["total"]}, backend="cpu")
    wanted = engine.process(t, values)["total"]
    failed: list[object] = []

    def work() -> None:
        for _ in range(20):
            if not np.array_equal(engine.process(t, values)["total"], wanted):
                failed.append("other totals")

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed


def test_the_lock_is_free_while_it_computes(hand: st.Body) -> None:
    t, values = pressed(hand, 2000)
    engine = st.Engine(hand, backend="reference")
    counted, stop = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    engine.process(t, values)
    took = time.perf_counter() - begin
    stop.set()
    thread.join()
    # Half of what an idle machine would count: others may use it too.
    assert counted > 0.1 * took / 0.001, (counted, took)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_fork_after_use(hand: st.Body) -> None:
    code = """
import os, sys, numpy as np, somatic_touch as st
sys.path.insert(0, sys.argv[1])
from conftest import pressed
humanoid = st.Body.bundled("humanoid")
t, values = pressed(humanoid, 3000)
scene = {"outputs": ["total"]}
engine = st.Engine(humanoid, scene, backend="cpu")
first = engine.state()
wanted = engine.process(t, values)["total"]
child = os.fork()
engine.restore(first)
same = np.array_equal(engine.process(t, values)["total"], wanted)
again = st.Engine(humanoid, scene, backend="cpu").process(t, values)["total"]
same &= np.array_equal(again, wanted)
if child == 0:
    os._exit(0 if same else 1)
assert same and os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""
    folder = os.path.dirname(__file__)
    subprocess.run([sys.executable, "-W", "ignore", "-c", code, folder], check=True, timeout=120)


def test_progress_is_reported_and_its_error_raised(hand: st.Body) -> None:
    t, values = pressed(hand, 3000)
    engine = st.Engine(hand, backend="cpu")
    told: list[int] = []
    engine.process(t, values, progress=told.append)
    assert told[-1] == 3000 and told == sorted(told)
    with pytest.raises(ZeroDivisionError):
        engine.process(t, values, progress=lambda frames: 1 // 0)


def test_what_belongs_together_is_pickled(hand: st.Body) -> None:
    again = pickle.loads(pickle.dumps(hand))
    assert np.array_equal(again.taxels, hand.taxels)
    scene = st.Scene(outputs=["total"], max_gap_s=2)
    assert pickle.loads(pickle.dumps(scene)).text == scene.text
    try:
        st.Body.load("no.glb")
    except st.InputError as error:
        other = pickle.loads(pickle.dumps(error))
        assert type(other) is st.InputError and other.file == "no.glb" and str(other) == str(error)
        assert isinstance(error.__cause__, FileNotFoundError)


def test_flags_are_the_library_s(somatic) -> None:
    source = (__import__("conftest").ROOT / "crates" / "engine" / "src" / "percept" / "flags.rs").read_text()
    import re

    known = {name: 1 << int(bit) for name, bit in re.findall(r"const (\w+) = 1 << (\d+);", source)}
    assert {flag.name: flag.value for flag in st.Flags} == known
    source = (__import__("conftest").ROOT / "crates" / "engine" / "src" / "percept" / "touch.rs").read_text()
    known = {name: 1 << int(bit) for name, bit in re.findall(r"const (\w+) = 1 << (\d+);", source)}
    assert {flag.name: flag.value for flag in st.TouchFlags} == known


def test_scenes(tmp_path) -> None:
    for made in (
        st.Scene(outputs=["total"], accuracy={"arithmetic": "compensated"}),
        st.Scene({"outputs": "total", "accuracy": {"arithmetic": "compensated"}}),
        st.Scene('outputs = ["total"]\n[accuracy]\narithmetic = "compensated"'),
    ):
        engine = st.Engine(st.Body.bundled("hand"), made, backend="cpu")
        assert engine.outputs == ["total"] and engine.plan()["knobs"]["arithmetic"] == "compensated"
    for keys, why in [
        ({"output": "total"}, "did you mean `outputs`"),
        ({"outputs": "totl"}, "outputs: .*did you mean `total`"),
        ({"max_gap_s": -1}, "max_gap_s = -1"),
        ({"source": "a.csv"}, "for the command"),
        ({"accuracy": {"centroid": "1 mm"}}, "tradeoff"),
        ({"outputs": object()}, "not a value of a scene"),
        ({"batch": 0}, "batch"),
    ]:
        with pytest.raises(st.UsageError, match=why):
            st.Scene(**keys)
    path = tmp_path / "a.scene.toml"
    path.write_text('body = "hand"\nsource = "a.csv"\noutputs = ["total"]\n')
    assert st.Scene.load(path).text.strip() == 'outputs = ["total"]'
    with pytest.raises(st.SomaticError, match="line 1, column"):
        st.Scene("outputs = [")
