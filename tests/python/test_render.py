"""Pictures are the command's, byte by byte."""

from __future__ import annotations

import io
import pathlib

import numpy as np
import pytest
from conftest import ROOT, without_gpu
from PIL import Image

import somatic_touch as st

TOUCH = ["--source", ROOT / "bodies" / "touch.csv"]


@pytest.fixture(scope="module", autouse=True)
def adapter() -> None:
    try:
        st.render(st.Body.bundled("hand"), size=(240, 400))
    except st.SomaticError as error:
        without_gpu(error)


@pytest.mark.once
@pytest.mark.parametrize(
    ("flags", "keys"),
    [
        ([], {}),
        (["--view", "top,bottom", "--field", "hand/palm*", "--size", "600"], {"views": ["top", "bottom"], "fields": ["hand/palm*"], "size": 600}),
        (["--uv", "hand/palm", "--size", "700"], {"uv": "hand/palm", "size": 700}),
        (["--edges", "--view", "front", "--size", "400"], {"edges": True, "views": ["front"], "size": 400}),
        (["--ids", "--look-at", "hand/palm", "--view", "all"], {"ids": True, "look_at": "hand/palm", "views": ["all"]}),
        ([*TOUCH], {}),
        ([*TOUCH, "--at", "2.9", "--size", "800x600"], {"at_s": 2.9, "size": (800, 600)}),
        ([*TOUCH, "--from", "2", "--to", "3", "--rate", "5", "--size", "400"], {"from_s": 2, "to_s": 3, "rate_hz": 5, "size": 400}),
    ],
    ids=lambda value: " ".join(map(str, value)) if isinstance(value, list) else "",
)
def test_a_picture_is_the_command_s(somatic, hand: st.Body, touch: st.Recording, tmp_path: pathlib.Path, flags: list, keys: dict) -> None:
    somatic("render", "hand", "-o", tmp_path / "theirs.png", *flags)
    picture = st.render(touch if "--source" in flags else hand, **keys)
    picture.save(tmp_path / "mine.png")
    theirs = (tmp_path / "theirs.png").read_bytes()
    assert (tmp_path / "mine.png").read_bytes() == theirs == picture._repr_png_()
    image = Image.open(io.BytesIO(theirs))
    assert image.size == picture.size
    pixels = picture.pixels if picture.pixels.ndim == 3 else picture.pixels[0]
    assert np.array_equal(pixels[..., :3], np.asarray(image.convert("RGB"))) and (pixels[..., 3] == 255).all()
    if "from_s" in keys:
        assert picture.pixels.ndim == 4 and len(picture.pixels) == image.n_frames == 6  # type: ignore[attr-defined]
        image.seek(3)
        assert np.array_equal(picture.pixels[3, ..., :3], np.asarray(image.convert("RGB")))


@pytest.mark.once
@pytest.mark.parametrize("letter", ["shear", "temperature", None])
def test_a_letter_is_drawn_as_the_command_draws_it(somatic, tmp_path: pathlib.Path, letter: str | None) -> None:
    flags = [] if letter is None else ["--letter", letter]
    source, calibration = ROOT / "bodies" / "meeting.csv", ROOT / "bodies" / "sensing-hand.toml"
    somatic("render", "sensing-hand", "--source", source, "--calibration", calibration, "--size", "500", "-o", tmp_path / "theirs.png", *flags)
    picture = st.render(st.read("sensing-hand"), letter=letter, size=500)  # type: ignore[arg-type]
    assert picture._repr_png_() == (tmp_path / "theirs.png").read_bytes()
    with pytest.raises(st.UsageError, match="letter"):
        st.render(st.read("sensing-hand"), letter="warmth")  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="letter is about a touch"):
        st.render(st.Body.bundled("sensing-hand"), letter="shear")


def test_a_picture_is_an_array(hand: st.Body, tmp_path: pathlib.Path) -> None:
    picture = st.render(hand, size=300)
    width, height = picture.size
    assert width == 300 and repr(picture) == f"<Picture: 300 × {height} pixels>"
    array = np.asarray(picture)
    assert array.shape == (height, width, 4) and array.dtype == np.uint8 and not array.flags.writeable
    assert array.ctypes.data == picture.pixels.ctypes.data
    copy = np.array(picture)
    assert copy.ctypes.data != array.ctypes.data and copy.flags.writeable and np.array_equal(copy, array)
    assert np.asarray(picture, np.float32).dtype == np.float32
    with pytest.raises(ValueError):
        np.array(picture, np.float32, copy=False)
    path = tmp_path / "hand.png"
    picture.save(path)
    with pytest.raises(st.SomaticError, match="it exists"):
        picture.save(path)
    picture.save(path, force=True)
    with pytest.raises(st.UsageError, match="only PNG"):
        picture.save(tmp_path / "hand.jpg")


def test_a_calibration_gives_the_unit(hand: st.Body, touch: st.Recording) -> None:
    one, other = (st.render(touch, at_s=2.9, size=400, calibration=calibration) for calibration in (None, st.Calibration("[all]\nunit = 'kPa'", hand)))
    assert one.size == other.size and not np.array_equal(one, other)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"views": ["frnt"]}, "views: .*did you mean `front`"),
        ({"fields": ["hand/plam"]}, "did you mean|no field"),
        ({"uv": "hand/nothing"}, "no field"),
        ({"look_at": "plam"}, "did you mean|no field or link"),
        ({"size": 10}, "cannot be drawn"),
        ({"at_s": 1.0}, "at_s is about a touch"),
        ({"ids": True, "fields": ["hand/palm"]}, "goes with neither"),
        ({"uv": "hand/palm", "views": ["top"]}, "neither views"),
        ({"uv": "hand/palm", "edges": True}, "nor edges"),
    ],
)
def test_other_pictures_are_refused(hand: st.Body, keys: dict, why: str) -> None:
    with pytest.raises(st.UsageError, match=why):
        st.render(hand, **keys)


def test_other_touches_are_refused(touch: st.Recording) -> None:
    for keys, why in [
        ({"at_s": -9.0}, "no frames up to -9 s; give a time of its own, from "),
        ({"at_s": 1.0, "to_s": 2.0}, "give one of them"),
        ({"from_s": 0.0, "rate_hz": 0.0}, "not a rate"),
        ({"uv": "hand/palm"}, "neither a recording"),
    ]:
        with pytest.raises(st.UsageError, match=why):
            st.render(touch, **keys)
    with pytest.raises(st.UsageError, match="no body"):
        st.render(st.read(ROOT / "bodies" / "touch.csv"))
