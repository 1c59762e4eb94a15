"""Recordings in HDF5, which h5py writes here."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import h5py
import numpy as np
import pytest

import somatic_touch as st

pytestmark = pytest.mark.once


@pytest.fixture
def file(tmp_path) -> pathlib.Path:
    """Two sensors, times in seconds and milliseconds, and what is not a number."""
    path = tmp_path / "file.h5"
    with h5py.File(path, "w") as made:
        made["tactile/left"] = np.arange(60, dtype=np.uint16).reshape(10, 2, 3)
        made["tactile/right"] = np.full((10, 6), 0.5)
        made["tactile/t"] = 100 + 0.1 * np.arange(10)
        made["tactile/t_ms"] = 100 * np.arange(10)
        made["tactile/stamps"] = 100_000 * np.arange(10)
        made["tactile/stamps"].attrs["units"] = "us"
        made["notes"] = "no numbers"
    return path


def test_a_dataset_is_read_by_its_path(file: pathlib.Path) -> None:
    read = st.read(file, dataset="tactile/left", time="tactile/t")
    assert np.array_equal(read.values, np.arange(60).reshape(10, 6)) and read.taxels == [0, 1, 2, 3, 4, 5]
    assert np.array_equal(read.t, 100 + 0.1 * np.arange(10)) and read.body is None
    for time in ("/tactile/t_ms", "tactile/stamps"):
        assert np.allclose(st.read(file, dataset="tactile/right", time=time).t, 0.1 * np.arange(10))
    assert np.array_equal(st.read(str(file), dataset="tactile/left", rate_hz=50).t, np.arange(10) / 50)
    part = st.read(file, dataset="tactile/left", time="tactile/t", from_s=0.25, to_s=0.55)
    assert len(part) == 3 and np.array_equal(part.values, read.values[3:6])
    engine = st.read(file, dataset="tactile/left", rate_hz=50, body=st.Body.grid(2, 3, 0.01)).engine({"outputs": "total"}, backend="cpu")
    assert engine.process(read.t, read.values)["total"][9, 0] == read.values[9].sum()


def test_a_value_that_is_no_number_is_faulty(file: pathlib.Path) -> None:
    with h5py.File(file, "a") as made:
        made["tactile/right"][3, 4] = np.nan
    read = st.read(file, dataset="tactile/right", rate_hz=50)
    assert np.isnan(read.values[3, 4]) and not read.mask.any()


def test_what_is_wrong_is_told_in_one_line(file: pathlib.Path, tmp_path) -> None:
    for keywords, wanted in [
        ({"rate_hz": 1}, r"name the dataset of the values with dataset=; there are tactile/left \[10, 2, 3\], "),
        ({"dataset": "left", "rate_hz": 1}, "there is no dataset `left`; there are tactile/left"),
        ({"dataset": "tactile/left"}, r"give time=, the dataset of the times, or rate_hz=; these have one number a frame: tactile/stamps \[10\], "),
        ({"dataset": "tactile/left", "time": "tactile/t", "rate_hz": 1}, "give time=, the dataset of the times, or rate_hz="),
        ({"dataset": "tactile/left", "time": "tactile/left"}, "`tactile/left` has 60 times, for 10 frames"),
        ({"dataset": "tactile/left", "rate_hz": 0}, "rate_hz=0.0 is not a frame rate"),
        ({"dataset": "tactile/left", "rate_hz": 1, "body": "hand"}, "a frame has 6 values, and body `hand` has 40 taxels"),
        ({"dataset": "tactile/left", "rate_hz": 1, "grid": "2x3"}, "format, grid, pitch, unit and layout are for exports"),
    ]:
        with pytest.raises(st.UsageError, match=wanted):
            st.read(file, **keywords)
    with pytest.raises(st.UsageError, match="dataset and time are for HDF5"):
        st.read("touch.csv", dataset="tactile/left")
    with pytest.raises(st.InputError, match=r"none\.h5: no such file or directory"):
        st.read("none.h5", dataset="a", rate_hz=1)
    damaged = tmp_path / "damaged.h5"
    damaged.write_bytes(file.read_bytes()[:300])
    with pytest.raises(st.InputError, match="is it HDF5, and whole") as raised:
        st.read(damaged, dataset="a", rate_hz=1)
    assert "\n" not in str(raised.value)


def test_without_h5py_it_says_what_to_install() -> None:
    code = "import sys; sys.modules['h5py'] = None; import somatic_touch as st; st.read('a.h5')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "HDF5 is read by h5py; run `pip install h5py`" in done.stderr
