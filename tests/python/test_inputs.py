"""Whatever is given to `process`: percepts, or an exception that says the shape expected."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

import somatic_touch as st

HAND = st.Body.bundled("hand")
ENGINE = st.Engine(HAND, {"outputs": ["total", "centroid", "orientation"]}, backend="cpu")
EXPECTED = r"values should be float32 of shape \[frames, taxels\] = \[2, 40\]"


@pytest.mark.parametrize(
    "values",
    [
        np.zeros((2, 39), np.float32),
        np.zeros((3, 40), np.float32),
        np.zeros((40, 2), np.float32),
        np.zeros(80, np.float32),
        np.zeros((2, 40, 1), np.float32),
        np.zeros((0, 40), np.float32),
        np.zeros((2, 0), np.float32),
        np.float32(1),
        np.zeros((2, 40), complex),
        np.zeros((2, 40), bool),
        np.zeros((2, 40), object),
        np.zeros((2, 40), "S4"),
        np.zeros((2, 40), "M8[s]"),
        np.broadcast_to(np.float32(0), (10**6, 10**6)),
        [[1] * 40, [1] * 39],
        "values",
        None,
        {1: 2},
    ],
    ids=lambda values: str(getattr(values, "shape", values))[:20],
)
def test_other_values_are_refused_with_the_shape(values: object) -> None:
    with pytest.raises(st.UsageError, match=EXPECTED):
        ENGINE.process([0.0, 0.1], values)


@pytest.mark.parametrize("t", [None, "now", 0.5, [[0.0, 0.1]], np.zeros(2, complex), [0, "a"], np.zeros((2, 1))])
def test_other_times_are_refused_with_the_shape(t: object) -> None:
    with pytest.raises(st.UsageError, match=r"t should be float64 of shape \[frames\]"):
        ENGINE.process(t, np.zeros((2, 40), np.float32))


@pytest.mark.parametrize("mask", [np.zeros((2, 40)), np.zeros((40, 2), bool), np.zeros(39, bool), True, "mask"])
def test_other_masks_are_refused_with_the_shape(mask: object) -> None:
    with pytest.raises(st.UsageError, match=r"mask should be bool of shape \[frames, taxels\] = \[2, 40\]"):
        ENGINE.process([0.0, 0.1], np.zeros((2, 40), np.float32), mask)


@pytest.mark.parametrize(
    ("pose", "why"),
    [
        ([1], "not a dict"),
        ({1: [0] * 7}, "not text"),
        ({"hand": [0, 0, 0, 0, 0, 1]}, r"shape \[7\] or \[2, 7\]"),
        ({"hand": [[0, 0, 0, 0, 0, 0, 1]] * 3}, r"shape \[7\] or \[2, 7\]"),
        ({"hand": [0, 0, 0, 0, 0, 0, 0]}, "length 0"),
        ({"hand": [np.nan, 0, 0, 0, 0, 0, 1]}, "not finite"),
        ({"hnad": [0, 0, 0, 0, 0, 0, 1]}, "did you mean `hand`"),
    ],
)
def test_other_poses_are_refused_and_say_why(pose: Any, why: str) -> None:
    with pytest.raises(st.SomaticError, match=why):
        ENGINE.process([0.0, 0.1], np.zeros((2, 40), np.float32), pose=pose)


def test_no_frames_give_no_percepts() -> None:
    p = ENGINE.process([], np.zeros((0, 40), np.float32))
    assert p["centroid"].shape == (0, 13, 2) and p.flags.shape == (0, 13) and len(p.t) == 0
    assert st.Engine(HAND, {"outputs": ["touches"]}, backend="cpu").process([], np.zeros((0, 40))).touches.t.shape == (0,)


def test_percepts_without_room_are_an_error_and_no_crash() -> None:
    # Address space alone: nothing of it is ever touched.
    t = np.broadcast_to(np.float64(0), 10**12)
    with pytest.raises((MemoryError, st.UsageError)):
        ENGINE.process(t, np.broadcast_to(np.float32(0), (10**12, 40)))


def test_other_engines_are_refused() -> None:
    with pytest.raises(st.UsageError, match="did you mean `reference`"):
        st.Engine(HAND, backend="referense")  # type: ignore[arg-type]
    with pytest.raises(st.SomaticError, match="did you mean|no field"):
        st.Engine(HAND, {"fields": "hand/plam"}, backend="cpu")
    with pytest.raises(st.SomaticError, match="taxel id 99"):
        st.Engine(HAND, backend="cpu", taxels=[0, 99])
    with pytest.raises(st.UsageError, match="a scene is a Scene, a dict"):
        st.Engine(HAND, 7, backend="cpu")  # type: ignore[arg-type]
    mat = st.Calibration("body = 'mat'", st.Body.bundled("mat"))
    with pytest.raises(st.SomaticError, match="40"):
        st.Engine(HAND, calibration=mat, backend="cpu")


floats = some.one_of(some.floats(width=32), some.sampled_from([np.nan, np.inf, -np.inf, 1e38, 1e-45, -0.0]))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    values=arrays.arrays(
        some.one_of(arrays.floating_dtypes(endianness="?"), arrays.integer_dtypes(endianness="?"), arrays.boolean_dtypes()),
        arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=41),
        fill=some.just(0),
    ),
    frames=some.integers(0, 41),
)
def test_any_array_gives_percepts_or_says_the_shape(values: np.ndarray, frames: int) -> None:
    t = np.arange(frames) * 0.01
    try:
        p = ENGINE.process(t, values)
    except st.UsageError as error:
        assert f"[frames, taxels] = [{frames}, 40]" in str(error)
    else:
        assert values.shape == (frames, 40) and p["total"].shape == (frames, 13)


@settings(max_examples=100, deadline=None)
@given(
    values=arrays.arrays(np.float32, (5, 40), elements=floats, fill=some.just(np.float32(0))),
    t=arrays.arrays(np.float64, 5, elements=some.floats()),
    how=some.sampled_from(["as it is", "read-only", "reversed", "fortran", "every other", "unaligned", "swapped"]),
)
def test_the_same_numbers_give_the_same_percepts_however_they_lie(values: np.ndarray, t: np.ndarray, how: str) -> None:
    state = ENGINE.state()
    wanted = ENGINE.process(t, values)
    ENGINE.restore(state)
    other = values
    match how:
        case "read-only":
            other = values.copy()
            other.setflags(write=False)
        case "reversed":
            other = values[::-1, ::-1].copy()[::-1, ::-1]
        case "fortran":
            other = np.asfortranarray(values)
        case "every other":
            other = np.repeat(values, 2, axis=1)[:, ::2]
        case "unaligned":
            room = np.zeros(values.nbytes + 1, np.uint8)
            room[1:] = np.frombuffer(values.tobytes(), np.uint8)
            other = room[1:].view(np.float32).reshape(values.shape)
        case "swapped":
            other = values.astype(values.dtype.newbyteorder())
    got = ENGINE.process(t, other)
    for name in wanted:
        assert np.array_equal(got[name], wanted[name], equal_nan=True)
        there = wanted.present(name)
        assert np.isfinite(wanted[name][there]).all() and np.isnan(wanted[name][~there]).all()
    assert np.array_equal(got.flags, wanted.flags)


@pytest.mark.once
def test_arrays_in_messages_are_read_by_a_map(tmp_path: pathlib.Path) -> None:
    (tmp_path / "pads.toml").write_text('values = "pads[*].force"\ngrid = "2x2"\npitch = "5mm"\nmissing = [-1]\n')
    lines = tmp_path / "pads.ndjson"
    lines.write_text('{"t":0,"pads":[{"force":[0,9]},{"force":[3,4]}]}\n{"t":0.1,"pads":[{"force":[0,7]},{"force":[-1,4]}]}\n')
    keys = {"map": str(tmp_path / "pads.toml")}
    recording = st.read(f"ndjson:{lines}", **keys)
    assert recording.body is not None and len(recording.body.taxels) == 4
    assert recording.values[0].tolist() == [0, 9, 3, 4] and np.isnan(recording.values[1, 2])
    (part,) = st.open(f"ndjson:{lines}", **keys)
    assert part.values[1, 3] == 4
    assert st.convert(f"ndjson:{lines}", tmp_path / "pads.mcap", **keys) == 2
    known = st.info(f"ndjson:{lines}", **keys)
    assert (known["kind"], known["frames"]) == ("messages", 2)
    with pytest.raises(st.SomaticError, match="pads"):
        (tmp_path / "wrong.toml").write_text('values = "pad[*].force"\ngrid = "2x2"\npitch = "5mm"\n')
        st.read(f"ndjson:{lines}", map=str(tmp_path / "wrong.toml"))
